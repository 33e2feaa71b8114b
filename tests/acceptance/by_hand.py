"""An independent derivation: Lagrange's equations from energies in the inertial frame, and what a system leaves of them.

    e_i = d/dt(dL/dq_i') - dL/dq_i + dR/dq_i' - Q_i,    L = T - U

Nothing of the library's own Lagrangian code is used. A system satisfies the equations if e_i = 0 after its accelerations
have been put in, identically in states, parameters and time; this is evaluated with 50 digits at random points (a wrong
term shows with probability one), so that no simplification has to succeed first. The mass matrix must be regular.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from typing import Any

import mpmath
import sympy as sp

import stability as st

t = sp.Symbol("t", real=True)
DIGITS = 50


def real(names: str) -> Any:
    """Real symbols: those that a `System` uses."""
    return sp.symbols(names, real=True)


def coordinate(name: str) -> Any:
    """q(t)."""
    return sp.Function(name)(t)


def lagrange(
    T: Any, U: Any, coordinates: Sequence[Any], R: Any = 0, Q: Mapping[Any, Any] | None = None
) -> dict[Any, sp.Expr]:
    """Coordinate -> e_i."""
    L = T - U
    found = {}
    for q in coordinates:
        v = q.diff(t)
        force = (Q or {}).get(q, 0)
        found[q] = sp.diff(sp.diff(L, v), t) - sp.diff(L, q) + sp.diff(sp.sympify(R), v) - force
    return found


def states_of(coordinates: Sequence[Any]) -> dict[Any, sp.Symbol]:
    """Derivatives and coordinates -> the state symbols of a system, highest derivative first."""
    velocity = {q.diff(t): real(f"{q.func.__name__}_dot") for q in coordinates}
    return {**velocity, **{q: real(q.func.__name__) for q in coordinates}}


def remainders(system: st.System, equations: Mapping[Any, Any], charge: Any = None) -> list[sp.Expr]:
    """e_i with the system's accelerations; a charge's derivative is the state ``i``, or what Kirchhoff's law leaves."""
    coordinates = [q for q in equations if q is not charge]
    rhs = dict(zip(system.states, system.rhs))
    accelerations = {q.diff(t, 2): rhs[f"{q.func.__name__}_dot"] for q in coordinates}
    velocities = states_of(coordinates)
    current: dict[Any, Any] = {}
    work = dict(equations)
    if charge is not None and "i" in rhs:
        accelerations[charge.diff(t, 2)] = rhs["i"]
        current = {charge.diff(t): real("i")}
    elif charge is not None:
        (law,) = sp.solve(work.pop(charge), charge.diff(t))
        current = {charge.diff(t): law}
    return [e.doit().subs(accelerations).subs(current).subs(velocities) for e in work.values()]


def vanishes(expression: Any, signed: Sequence[str] = (), points: int = 6, **fixed: float) -> bool:
    """Whether an expression is zero at random points, to 50 digits less rounding.

    Symbols lie in (0.3, 1.7); those named in `signed` take either sign, so that both sides of a contact are met.
    """
    expression = sp.sympify(expression)
    symbols = sorted(expression.free_symbols, key=str)
    with mpmath.workdps(DIGITS):
        function = sp.lambdify(symbols, expression, "mpmath")
        source = random.Random(2026)
        for _ in range(points):
            values = []
            for symbol in symbols:
                value = mpmath.mpf(source.randint(300, 1700)) / 1009
                value *= source.choice((-1, 1)) if symbol.name in signed else 1
                values.append(mpmath.mpf(fixed.get(symbol.name, value)))
            if abs(function(*values)) > mpmath.mpf(10) ** (8 - DIGITS):
                return False
    return True


def obeys(system: st.System, equations: Mapping[Any, Any], charge: Any = None, **fixed: float) -> bool:
    """Whether the system's accelerations satisfy all equations, and its other states are velocities."""
    rhs = dict(zip(system.states, system.rhs))
    kinematic = all(rhs[q] == real(f"{q}_dot") for q in system.coordinates if f"{q}_dot" in rhs)
    left = remainders(system, equations, charge)
    return kinematic and bool(left) and all(vanishes(e, system.states, **fixed) for e in left)


def regular(T: Any, coordinates: Sequence[Any], **fixed: float) -> bool:
    """Whether the mass matrix has an inverse, so that the equations determine the accelerations."""
    M = sp.hessian(T, [q.diff(t) for q in coordinates])
    return not vanishes(M.det().subs(states_of(coordinates)), **fixed)


def base(by: str = "amplitude") -> tuple[Any, Any]:
    """(y0, w) of the base motion A cos(w t) in a `from_physical` system; A = acceleration/w^2 if that is its parameter."""
    w = 2 * sp.pi * real("frequency")
    A = real("amplitude") if by == "amplitude" else real("acceleration") / w**2
    return A * sp.cos(w * t), w
