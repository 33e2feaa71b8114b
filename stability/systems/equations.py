"""From equations of motion to explicit first-order form, through the mass matrix.

Given n_c equations R_k(q, q', q'', t, p) = 0 in n_c coordinates q, linear in the highest derivative h of each
coordinate (q'' or q'),

    M(q, q', t, p) h = F(q, q', t, p),     M = dR/dh,   F = -R|_{h=0},

M h = F is solved symbolically without `solve` or `simplify`: row by row where M is diagonal, by cofactors up to 3 x 3,
else by elimination; the common subexpressions are found when the code is generated. The forcing period is read off
the arguments of sines and cosines where time occurs nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from ..errors import EquationError

__all__ = ["TIME", "forcing_period", "solve_linear", "symbol", "system_fields"]

TIME = sp.Symbol("t", real=True)


def symbol(name: str) -> sp.Symbol:
    """The real symbol that stands for a state or parameter of this name everywhere in the library."""
    return sp.Symbol(name, real=True)


def _coordinate_functions(coordinates: Sequence[Any]) -> tuple[list[AppliedUndef], sp.Symbol]:
    if isinstance(coordinates, (str, bytes)) or not isinstance(coordinates, Sequence) or not coordinates:
        raise EquationError("coordinates must be a non-empty sequence of sympy functions of time, [x(t), ...]")
    functions, times = [], set()
    for c in coordinates:
        if not isinstance(c, AppliedUndef) or len(c.args) != 1 or not isinstance(c.args[0], sp.Symbol):
            raise EquationError(f"coordinate {c!r} is not a function of time such as sympy.Function('x')(t)")
        functions.append(c)
        times.add(c.args[0])
    if len(times) > 1:
        raise EquationError(f"the coordinates depend on different times: {', '.join(sorted(map(str, times)))}")
    if len(set(functions)) < len(functions):
        raise EquationError("a coordinate is named twice")
    return functions, times.pop()


def _residuals(equations: Any, functions: list[AppliedUndef]) -> list[sp.Expr]:
    items: Iterable[Any]
    if isinstance(equations, Mapping):
        items = [sp.sympify(left) - sp.sympify(right) for left, right in equations.items()]
    elif isinstance(equations, (sp.Eq, sp.Expr)):
        items = [equations]
    else:
        items = list(equations)
    residuals: list[sp.Expr] = []
    for item in items:
        if isinstance(item, sp.Eq):
            residuals.append(item.lhs - item.rhs)
        elif isinstance(item, sp.Expr):
            residuals.append(item)
        else:
            raise EquationError(f"{item!r} is not an equation: give sympy.Eq(left, right), an expression, or a mapping")
    if len(residuals) != len(functions):
        raise EquationError(
            f"{len(residuals)} equation(s) for {len(functions)} coordinate(s) "
            f"({', '.join(f.func.__name__ for f in functions)}): a system must be square"
        )
    return residuals


def _orders(residuals: list[sp.Expr], functions: list[AppliedUndef], time: sp.Symbol) -> list[int]:
    orders = dict.fromkeys(functions, 0)
    for r in residuals:
        for d in r.atoms(sp.Derivative):
            if d.expr not in orders or any(v != time for v in d.variables):
                raise EquationError(f"{d} is not a time derivative of a coordinate")
            orders[d.expr] = max(orders[d.expr], d.derivative_count)
        for f in r.atoms(AppliedUndef):
            if f not in orders and time in f.free_symbols:
                raise EquationError(f"{f} is not among the coordinates {', '.join(map(str, functions))}")
    for f, k in orders.items():
        if k not in (1, 2):
            raise EquationError(f"coordinate {f} enters with derivatives of order {k}; order 1 or 2 is needed")
    return [orders[f] for f in functions]


def solve_linear(mass: sp.Matrix, force: sp.Matrix) -> list[sp.Expr]:
    """h of M h = F: rows of a diagonal M, cofactors up to 3 x 3, elimination beyond; EquationError if M is singular."""
    n = mass.shape[0]
    if mass.is_diagonal():
        if any(mass[i, i] == 0 for i in range(n)):
            raise EquationError("the mass matrix is singular: an equation contains no highest derivative")
        return [force[i] / mass[i, i] for i in range(n)]
    if n <= 3:
        determinant = sp.expand(mass.det(method="berkowitz"))
        if determinant == 0 or sp.simplify(determinant) == 0:
            raise EquationError(f"the mass matrix {mass.tolist()} is singular")
        adjugate = mass.adjugate()
        determinant = sp.trigsimp(determinant) if determinant.has(sp.sin, sp.cos) else determinant
        return [sum((adjugate[i, j] * force[j] for j in range(n)), sp.S.Zero) / determinant for i in range(n)]
    try:
        return list(mass.LUsolve(force))
    except (ValueError, ZeroDivisionError) as error:
        raise EquationError(f"the mass matrix is singular: {error}") from error


def forcing_period(expressions: Iterable[sp.Expr]) -> sp.Expr | None:
    """The common period of sines and cosines of c*t (None if time does not occur).

    Raises
    ------
    EquationError
        Where time occurs outside sines and cosines, or their frequencies have no common divisor.
    """
    frequencies: list[sp.Expr] = []
    dummy = sp.Dummy("phase")
    for e in expressions:
        e = sp.sympify(e)
        if not e.has(TIME):
            continue
        waves = [w for w in e.atoms(sp.sin, sp.cos, sp.tan) if w.has(TIME)]
        if e.subs(dict.fromkeys(waves, dummy)).has(TIME):
            raise EquationError(f"time enters {e} outside sines and cosines: give period=... (in the parameters)")
        for w in waves:
            c = sp.diff(w.args[0], TIME)
            if c.has(TIME):
                raise EquationError(f"the argument of {w} is not linear in time: give period=...")
            frequencies.append(2 * c if isinstance(w, sp.tan) else c)
    if not frequencies:
        return None
    first = frequencies[0]
    divisor = sp.Integer(1)
    for c in frequencies:
        ratio = sp.nsimplify(sp.simplify(c / first), rational=False)
        if not ratio.is_Rational:
            raise EquationError(f"the frequencies {first} and {c} have no common period: give period=...")
        divisor = sp.gcd(divisor, ratio)
    common = sp.Abs(divisor) * first
    if common.could_extract_minus_sign():
        common = -common
    return 2 * sp.pi / common


def _parameters(
    given: Mapping[Any, Any] | None,
) -> tuple[dict[str, float], dict[str, str], dict[str, tuple[float, float]]]:
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    bounds: dict[str, tuple[float, float]] = {}
    for key, entry in (given or {}).items():
        name = key.name if isinstance(key, sp.Symbol) else str(key)
        if isinstance(entry, Mapping):
            unknown = set(entry) - {"value", "unit", "bounds"}
            if unknown or "value" not in entry:
                raise EquationError(
                    f"parameter '{name}': a mapping has the keys value, unit, bounds; got {sorted(entry)}"
                )
            if entry.get("unit"):
                units[name] = str(entry["unit"])
            if entry.get("bounds") is not None:
                lo, hi = entry["bounds"]
                bounds[name] = (float(lo), float(hi))
            entry = entry["value"]
        values[name] = entry
    return values, units, bounds


def _canonical(expression: Any) -> sp.Expr:
    expression = sp.sympify(expression)
    named = {s: symbol(s.name) for s in expression.free_symbols if isinstance(s, sp.Symbol)}
    return expression.xreplace({s: r for s, r in named.items() if not isinstance(s, sp.Dummy)})


class _Reduction:
    """Replaces coordinates and derivatives by real symbols of their names, the highest derivatives by markers."""

    def __init__(self, functions: list[AppliedUndef], order: list[int], time: sp.Symbol) -> None:
        self.names = [f.func.__name__ for f in functions]
        self.second = [n for n, k in zip(self.names, order) if k == 2]
        self.time = time
        self.highest = [sp.Derivative(f, (time, k)) for f, k in zip(functions, order)]
        self.markers = [sp.Dummy(f"highest_{n}", real=True) for n in self.names]
        self.coordinates = {f: symbol(n) for f, n in zip(functions, self.names)}
        self.velocities = {
            sp.Derivative(f, time): symbol(f"{n}_dot") for f, n, k in zip(functions, self.names, order) if k == 2
        }

    def marked(self, expression: Any) -> sp.Expr:
        """The expression in real symbols, each highest derivative as its marker."""
        e = sp.sympify(expression).xreplace(dict(zip(self.highest, self.markers))).xreplace(self.velocities)
        return _canonical(e.xreplace(self.coordinates).xreplace({self.time: TIME}))

    def solved(self, residuals: list[sp.Expr]) -> dict[str, sp.Expr]:
        """Coordinate name -> its highest derivative, from M h = F."""
        rows = sp.Matrix([self.marked(r) for r in residuals])
        mass = rows.jacobian(self.markers)
        if any(mass.has(m) for m in self.markers):
            raise EquationError("an equation is not linear in the highest derivatives")
        force = -rows.xreplace(dict.fromkeys(self.markers, sp.S.Zero))
        return dict(zip(self.names, solve_linear(mass, force)))

    def expressed(self, expression: Any, solution: Mapping[str, sp.Expr]) -> sp.Expr:
        """An output: highest derivatives replaced by what the equations say they are."""
        return self.marked(expression).xreplace({m: solution[n] for m, n in zip(self.markers, self.names)})


def system_fields(
    equations: Any,
    coordinates: Sequence[Any],
    parameters: Mapping[Any, Any] | None,
    period: Any,
    outputs: Mapping[str, Any] | None,
    breaks: Iterable[Any],
    *,
    units: Mapping[str, str] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    angles: Iterable[str] = (),
    orders: Mapping[str, int] | None = None,
    **others: Any,
) -> dict[str, Any]:
    """The fields of a `System` from its equations: the work behind `System.from_equations`."""
    functions, time = _coordinate_functions(coordinates)
    residuals = _residuals(equations, functions)
    order = _orders(residuals, functions, time)
    reduction = _Reduction(functions, order, time)
    solution = reduction.solved(residuals)
    names, second = reduction.names, reduction.second
    states = (*names, *(f"{n}_dot" for n in second))
    rhs = tuple([symbol(f"{n}_dot") if n in second else solution[n] for n in names] + [solution[n] for n in second])
    shown = {key: reduction.expressed(e, solution) for key, e in (outputs or {}).items()}
    from .time_breaks import time_breaks

    values, own_units, own_bounds = _parameters(parameters)
    if period is None:
        period = forcing_period([*rhs])
    elif isinstance(period, (int, float)):
        period = sp.Float(period) if math.isfinite(period) else sp.nan
    period = None if period is None else _canonical(period)
    declared = tuple(_canonical(b) for b in breaks)
    return {
        "coordinates": tuple(names),
        "states": states,
        "parameters": values,
        "rhs": rhs,
        "period_expression": period,
        "outputs": shown,
        "units": {**own_units, **(units or {})},
        "bounds": {**own_bounds, **(bounds or {})},
        "breaks": declared or time_breaks(rhs, period, states),
        "angles": tuple(angles),
        "orders": dict(orders or {}),
        **others,
    }
