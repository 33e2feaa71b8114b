r"""How many samples in time the projection needs.

A term of degree d in the states and with harmonics up to m of the forcing in its coefficients has harmonics up to
d H + m of the orbit; on N samples those up to H are exact for N > (d + 1) H + m, and those up to 2H + 1, from which
the truncation is judged, for N > (d + 2) H + m + 1. Terms that are not polynomials have no such number: N starts at 8 H
and grows while twice the samples change the projection (`aliasing`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

__all__ = ["equation_degrees", "first_samples", "polynomial_degree"]

_FORCING = 2  # harmonics of the forcing allowed for in coefficients; more are found by measurement
_UNKNOWN = 6
_HIGHEST = 12


@lru_cache(maxsize=256)
def _degrees_of(rhs: Any, states: tuple[str, ...]) -> tuple[int, ...] | None:
    import sympy as sp

    symbols = [sp.Symbol(name, real=True) for name in states]
    degrees = []
    for expression in rhs:
        if not expression.is_polynomial(*symbols):
            return None
        degrees.append(int(sp.Poly(expression, *symbols).total_degree()))
    return tuple(degrees)


def equation_degrees(system: Any) -> tuple[int, ...] | None:
    """Total degree of every equation in the states; None where they are not polynomials (or a Python function)."""
    return None if system.rhs is None else _degrees_of(system.rhs, tuple(system.states))


def polynomial_degree(system: Any) -> int | None:
    """Total degree of the equations in the states; None where they are not polynomials (or a Python function)."""
    degrees = equation_degrees(system)
    return None if degrees is None else max(1, *degrees)


def first_samples(system: Any, harmonics: int, subharmonic: int, degree: int | None = None) -> int:
    """An even number of samples, exact for polynomials up to degree 12 (or `degree`); see the head of this file.

    >>> import stability as st
    >>> first_samples(st.models.duffing(), 7, 1)
    40
    """
    if degree is None:
        known = polynomial_degree(system)
        degree = _UNKNOWN if known is None else min(known, _HIGHEST)
    degree = max(degree, 2)
    count = (degree + 2) * harmonics + _FORCING * subharmonic + 2
    return int(2 * np.ceil(max(count, 4 * harmonics + 4) / 2))
