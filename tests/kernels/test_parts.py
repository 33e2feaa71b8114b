"""Functions that are compiled as parts of kernels: no machine code of their own, and the values of plain Python."""

from __future__ import annotations

import numpy as np
import pytest
from numba import float64, int64
from numba.core.registry import cpu_target

from stability.kernels.caching import kernel
from stability.kernels.condensation_reduced import monodromy_product


@kernel(inline=True)
def _root(x):  # type: ignore[no-untyped-def]
    """sqrt(x), by an exception of its own where there is none."""
    if x < 0.0:
        raise ValueError("negative")
    return np.sqrt(x)


@kernel(inline=True, merged=True)
def _sum_of_roots(x):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(x.shape[0]):
        total += _root(x[k])
    return total


@kernel(inline=True)
def _factorial(n):  # type: ignore[no-untyped-def]
    return n * _factorial(n - 1) if n > 1 else int64(1)


@kernel
def _of_parts(x, n):  # type: ignore[no-untyped-def]
    return _sum_of_roots(x), _root(x[0]), _factorial(n)


def test_values_and_exceptions_are_those_of_python():
    """A part called by a part and twice by a kernel, one that calls itself, and an exception that passes two of them."""
    x = np.array([4.0, 9.0, 2.0])
    assert _of_parts(x, 6) == (5.0 + np.sqrt(2.0), 2.0, 720)
    assert _of_parts(x, 6)[0] == sum(_root.py_func(value) for value in x)
    with pytest.raises(ValueError, match="negative"):
        _of_parts(-x, 6)


def test_parts_are_linked_and_never_become_machine_code_of_their_own():
    """Their names are unknown to the machine code in this process, those of kernels are not."""
    monodromy_product(np.ones((1, 1, 1)))
    engine = cpu_target.target_context.codegen()._engine

    def known(dispatcher):
        return [engine.is_symbol_defined(one.fndesc.llvm_func_name) for one in dispatcher.overloads.values()]

    _of_parts(np.ones(1), 1)
    _root.compile((float64,))  # a kernel from the disk cache brings its parts along, uncompiled
    _sum_of_roots.compile((float64[::1],))
    assert all(known(_of_parts)) and all(known(monodromy_product))
    assert known(_root) == known(_sum_of_roots) == [False]
