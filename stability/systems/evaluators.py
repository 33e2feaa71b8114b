"""Evaluators from equations: which back end computes a system's right-hand side, and the keeping of compiled ones.

"llvm" is machine code with the loop over the points inside; "lambdify" is numpy, the fallback and the oracle of the
first; "function" (see _differences.py) is a Python function with derivatives by differences. All take and give the
same arrays (see _evaluator.py) and may be handed to compiled kernels by address. "auto" takes machine code where it
can: a function without machine code sends the whole system to numpy, and one that no back end knows is a CompileError
that names it.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import Any

import numpy as np

from ..errors import CompileError, InputError
from ._evaluator import Evaluator, address_of

__all__ = ["Evaluator", "evaluator"]

Array = np.ndarray
UNUSED = (None, None, None)  # the output arguments of machine code that a quantity does not have


class ExpressionEvaluator(Evaluator):
    """Common part of the back ends that start from equations."""

    def __init__(self, system: Any, equations: Any) -> None:
        super().__init__(system)
        self._equations = equations

    def second_gradient(self, phase: Any, X: Any, P: Any, V: Any, W: Any, sizes: Any) -> Array:
        """As in the contract, by its own program: one evaluation for all k."""
        phase, X, P = self._checked(phase, X, P)
        N = len(X)
        blocks = []
        for given, width in ((V, self.n + self.m), (W, self.n)):
            block = np.asarray(given, dtype=float)
            if block.shape not in ((N, width), (width,)):
                raise InputError(f"a direction has shape {(N, width)} or {(width,)}; got {block.shape}")
            blocks.append(np.ascontiguousarray(np.broadcast_to(block, (N, width))))
        out = np.empty((N, self.n + self.m))
        self._run("second_gradient", phase, X, P, tuple(blocks), (out,))
        return out

    def _break_values(self, P: Array) -> Array:
        if not self._equations.breaks:
            return np.empty(0)
        code = self._codes.get("breaks")
        if code is None:
            from ._lambdify import numpy_function

            code = self._codes["breaks"] = numpy_function(self._equations.parameters, self._equations.breaks)
        return np.array(code(*P), dtype=float)

    def _period_values(self, P: Array) -> tuple[Array, Array]:
        N = 1 if P.ndim == 1 else len(P)
        T, gradient = np.empty((N, 1)), np.empty((N, self.m))
        self._run("period", None, np.empty((N, self.n)), P, (), (T, gradient))
        return T.reshape(P.shape[:-1]), gradient.reshape(P.shape)


class LlvmEvaluator(ExpressionEvaluator):
    """Machine code from LLVM."""

    backend = "llvm"

    def _compiled(self, which: str) -> Any:
        from ._machine import MachineCode

        return MachineCode(self._equations.program(which))

    def _native(self, which: str) -> tuple[int, Any]:
        code = self._code(which)
        return code.address, code

    _native_directional = _native  # with all outputs: the last pointers of the C border are not read

    def _run(
        self, which: str, phase: Array | None, X: Array, P: Array, directions: tuple[Array, ...], out: tuple[Array, ...]
    ) -> None:
        code = self._codes.get(which) or self._code(which)
        code.call(
            len(X),
            None if phase is None else address_of(phase),
            address_of(X),
            address_of(P),
            0 if P.ndim == 1 else self.m,
            *[address_of(block) for block in directions],
            *[address_of(array) for array in out],
            *UNUSED[len(out) :],
        )


class LambdifyEvaluator(ExpressionEvaluator):
    """numpy code from sympy."""

    backend = "lambdify"

    def _compiled(self, which: str) -> Any:
        from ._lambdify import NumpyCode

        return NumpyCode(self._equations.expanded(which))

    def _run(
        self, which: str, phase: Array | None, X: Array, P: Array, directions: tuple[Array, ...], out: tuple[Array, ...]
    ) -> None:
        N = len(X)
        flat = tuple(array.reshape(N, int(np.prod(array.shape[1:]))) for array in out)
        self._code(which).run(np.zeros(N) if phase is None else phase, X, P, directions, flat)


# ---------------------------------------------------------------------- making and keeping them

_CACHE: OrderedDict[Any, Evaluator] = OrderedDict()
_CACHE_LOCK = threading.Lock()
_CACHE_SIZE = 128


def evaluator(system: Any, backend: str = "auto", *, derivatives: str = "differences") -> Evaluator:
    """The evaluator of a system, kept for systems of equal content (default parameter values do not matter).

    Parameters
    ----------
    system : System
    backend : "auto", "llvm" or "lambdify"
        "auto" takes machine code and falls back to numpy where llvmlite is missing or a function has no machine code.
        Python functions have their own back end, "function".
    derivatives : "differences" or "complex_step"
        Of Python functions only. The complex step is exact to rounding for analytic functions and silently wrong for
        |x|, comparisons and anything that drops imaginary parts.

    Returns
    -------
    Evaluator
        Frozen in use and safe to share between threads; keep a reference as long as one of its addresses is in use.

    Raises
    ------
    CompileError
        A function no back end knows; the sentence names it.
    InputError
        Unknown back end.

    Examples
    --------
    >>> import stability as st
    >>> e = evaluator(st.models.duffing())
    >>> F, J = e.FJ(np.array([0.0]), np.zeros((1, 2)), st.models.duffing().parameter_vector())
    >>> F.shape, J.shape
    ((1, 2), (1, 2, 2))
    """
    if derivatives not in ("differences", "complex_step"):
        raise InputError(f"derivatives must be 'differences' or 'complex_step', got {derivatives!r}")
    if system.function is not None:
        if backend not in ("auto", "function"):
            raise InputError(f"a system from a Python function has the back end 'function', not {backend!r}")
        key: Any = ("function", system.function, tuple(system.parameters), system.period_expression, derivatives)
    else:
        if backend not in ("auto", "llvm", "lambdify"):
            raise InputError(f"backend must be 'auto', 'llvm' or 'lambdify', got {backend!r}")
        outputs = tuple(system.outputs.items())
        names = (tuple(system.states), tuple(system.parameters))
        key = (backend, names, system.rhs, system.period_expression, outputs, tuple(system.breaks))
    with _CACHE_LOCK:
        known = _CACHE.get(key)
        if known is not None:
            _CACHE.move_to_end(key)
            return known
    made = _made(system, backend, derivatives)
    with _CACHE_LOCK:
        made = _CACHE.setdefault(key, made)
        while len(_CACHE) > _CACHE_SIZE:
            _CACHE.popitem(last=False)
    return made


def _made(system: Any, backend: str, derivatives: str) -> Evaluator:
    if system.function is not None:
        from ._differences import FunctionEvaluator

        return FunctionEvaluator(system, complex_step=derivatives == "complex_step")
    from . import _lambdify, _llvm, _machine
    from ._program import Equations, functions_in

    equations = Equations(system)
    used = functions_in([*equations.rhs, *equations.outputs])
    if backend != "lambdify":
        missing = sorted(used - _llvm.SUPPORTED)
        reason = f"no machine code for {', '.join(missing)}" if missing else _machine.unavailable()
        if not reason:
            return LlvmEvaluator(system, equations)
        if backend == "llvm":
            raise CompileError(f"{reason}; backend='lambdify' may know more")
    missing = sorted(used - _lambdify.SUPPORTED)
    if missing:
        raise CompileError(
            f"no back end knows the function{'s' if len(missing) > 1 else ''} {', '.join(missing)}; write it with "
            "elementary functions, as a Table, or give the system as a Python function (System.from_function)"
        )
    return LambdifyEvaluator(system, equations)
