"""Lagrange's equations from T - U, Rayleigh's dissipation function and external generalised forces.

    d/dt (dL/dq') - dL/dq + dR/dq' = Q,        L = T - U

Written out with the mass matrix, which is what the equations are then solved through:

    M q'' = Q - dR/dq' + dL/dq - (d2L/dq'dq) q' - d2L/dq'dt,        M = d2L/dq'2.

Sign convention: Q is the force that acts on the coordinate; R is half the dissipated power for viscous damping, so
that its derivative is the damping force. Source: (1), (2) of the chapter, with d/dt of dL/dq' (not of dL/dq: erratum).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from ..errors import EquationError, unknown_name
from .equations import _coordinate_functions

__all__ = ["equations_of_motion", "mass_matrix"]


def _with_symbols(
    expression: Any, functions: list[Any], time: sp.Symbol
) -> tuple[sp.Expr, list[sp.Dummy], list[sp.Dummy], dict[Any, Any]]:
    """The expression in plain dummies q, v for the coordinates and velocities, and the way back."""
    q = [sp.Dummy(f"q{i}", real=True) for i in range(len(functions))]
    v = [sp.Dummy(f"v{i}", real=True) for i in range(len(functions))]
    e = sp.sympify(expression)
    velocities = {sp.Derivative(f, time): w for f, w in zip(functions, v)}
    for d in e.atoms(sp.Derivative):
        if d not in velocities and d.expr in functions:
            raise EquationError(f"{d}: energies may contain coordinates and their first derivatives only")
    e = e.xreplace(velocities).xreplace(dict(zip(functions, q))).doit()
    back = {**dict(zip(q, functions)), **{w: d for d, w in velocities.items()}}
    return e, q, v, back


def equations_of_motion(
    lagrangian: Any, coordinates: Sequence[Any], *, dissipation: Any = 0, forces: Mapping[Any, Any] | None = None
) -> list[sp.Eq]:
    """Lagrange's equations as ``Eq(M q'' + ..., Q)``, one for each coordinate, linear in the accelerations.

    Parameters
    ----------
    lagrangian : sympy expression
        T - U in coordinates, first derivatives, time and parameters.
    coordinates : sequence of sympy functions of time
        q(t).
    dissipation : sympy expression
        Rayleigh function R.
    forces : mapping
        Coordinate -> generalised force Q.

    Returns
    -------
    list of sympy.Eq

    Raises
    ------
    EquationError
        If an energy contains accelerations; UnknownNameError for a force on something that is no coordinate.

    Examples
    --------
    >>> import sympy as sp
    >>> from stability.systems.lagrangian import equations_of_motion
    >>> t, m, k = sp.symbols("t m k"); y = sp.Function("y")(t)
    >>> equations_of_motion(m*y.diff(t)**2/2 - k*y**2/2, [y])[0]
    Eq(k*y(t) + m*Derivative(y(t), (t, 2)), 0)
    """
    functions, time = _coordinate_functions(coordinates)
    forces = dict(forces or {})
    for f in forces:
        if f not in functions:
            raise unknown_name("coordinate", f, [str(c) for c in functions], "the Lagrangian")
    L, q, v, back = _with_symbols(lagrangian, functions, time)
    R, _, vr, back_r = _with_symbols(dissipation, functions, time)
    equations = []
    for i, f in enumerate(functions):
        momentum = sp.diff(L, v[i])
        terms = sum((sp.diff(momentum, v[j]) * sp.Derivative(g, (time, 2)) for j, g in enumerate(functions)), sp.S.Zero)
        terms += sum((sp.diff(momentum, q[j]) * v[j] for j in range(len(functions))), sp.S.Zero)
        terms += sp.diff(momentum, time) - sp.diff(L, q[i])
        left = terms.xreplace(back) + sp.diff(R, vr[i]).xreplace(back_r)
        right = sp.sympify(forces.get(f, 0))
        equations.append(sp.Eq(left, right, evaluate=False))
    return equations


def mass_matrix(lagrangian: Any, coordinates: Sequence[Any]) -> sp.Matrix:
    """M = d2L/dq'2, (n_c, n_c), in the coordinates.

    Parameters
    ----------
    lagrangian : sympy expression
        T - U.
    coordinates : sequence of sympy functions of time
        q(t).

    Returns
    -------
    sympy.Matrix

    Examples
    --------
    >>> import sympy as sp
    >>> from stability.systems.lagrangian import mass_matrix
    >>> t, m = sp.symbols("t m"); y = sp.Function("y")(t)
    >>> mass_matrix(m*y.diff(t)**2/2, [y])
    Matrix([[m]])
    """
    functions, time = _coordinate_functions(coordinates)
    L, _, v, back = _with_symbols(lagrangian, functions, time)
    return sp.hessian(L, v).xreplace(back)
