"""Dimensionless form: a time scale, a length for each coordinate, and names for the groups that remain.

With t = tau/w and q_i = L_i u_i (so that q_i' = L_i w u_i'), the equations q_i'' = f_i become

    u_i'' = f_i / (L_i w^2),      a first-order state s = S u_s:  u_s' = f_s/(S w).

The remaining parameters must combine into the named groups (xi = d/(2 m w1), ...): with all scales 1, each group's
definition is solved for one old parameter and put in; a parameter whose value then still matters is named in an error.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from ..errors import EquationError, check_names
from .equations import TIME, symbol
from .system import System

__all__ = ["dimensionless"]


def _expression(value: Any, allowed: Mapping[str, float]) -> sp.Expr:
    if isinstance(value, str):
        from .parsing import parse_expression

        value = parse_expression(value, list(allowed))
    expression = sp.sympify(value)
    check_names("parameter", sorted(s.name for s in expression.free_symbols), allowed)
    return expression.xreplace({s: symbol(s.name) for s in expression.free_symbols})


def _eliminated(
    expressions: list[sp.Expr], scales: list[sp.Expr], groups: Mapping[str, sp.Expr], kept: set[sp.Symbol]
) -> list[sp.Expr]:
    """The expressions in the groups: all scales are 1 and each group is its name, solved for one old parameter each.

    What is then left of the old parameters may have any value (Buckingham's theorem); this is checked by numbers, and
    they are set to 1.
    """
    every = set().union(*(e.free_symbols for e in [*expressions, *scales, *groups.values()]))
    positive = {s: sp.Dummy(s.name, positive=True) for s in every - kept}
    names = {sp.Dummy(name, positive=True): symbol(name) for name in groups}
    work = [e.xreplace(positive) for e in expressions]
    equations = [(str(e), e.xreplace(positive), sp.S.One) for e in scales if e != 1]
    equations += [(k, e.xreplace(positive), d) for (k, e), d in zip(groups.items(), names)]
    for i in range(len(equations)):
        label, definition, value = equations[i]
        if definition == value:  # a scale that is named twice
            continue
        for choice in sorted(definition.free_symbols - set(names), key=str, reverse=True):
            solved = sp.solve(sp.Eq(definition, value), choice)
            if len(solved) == 1:
                work = [e.subs(choice, solved[0]) for e in work]
                rest = equations[i + 1 :]
                equations[i + 1 :] = [(k, e.subs(choice, solved[0]), v) for k, e, v in rest]
                break
        else:
            raise EquationError(f"{label} cannot be solved for one of the old parameters")
    free = sorted(set().union(*(e.free_symbols for e in work)) - set(names) - kept, key=str)
    _check_free(work, free, list(groups))
    reduced = [sp.simplify(e.xreplace(dict.fromkeys(free, sp.S.One))) for e in work]
    return [e.xreplace(names) for e in reduced]


def _check_free(expressions: list[sp.Expr], free: list[sp.Symbol], groups: list[str]) -> None:
    """EquationError for an old parameter whose value still matters."""
    symbols = sorted(set().union(*(e.free_symbols for e in expressions)), key=str)
    point = {s: sp.Float(0.3 + 0.1 * sp.pi.evalf() / (1.3 + k), 30) for k, s in enumerate(symbols)}
    before = [e.evalf(25, subs=point) for e in expressions]
    left = []
    for s in free:
        after = [e.evalf(25, subs={**point, s: 2.5 * point[s]}) for e in expressions]
        if any(abs(x - y) > 1e-12 * (1 + abs(x)) for x, y in zip(before, after)):
            left.append(s.name)
    if left:
        raise EquationError(f"the groups {', '.join(groups)} leave {', '.join(left)} over: name another group")


def dimensionless(
    system: System,
    *,
    frequency: Any,
    lengths: Mapping[str, Any],
    groups: Mapping[str, Any],
    names: Mapping[str, str] | None = None,
    name: str | None = None,
) -> System:
    """The dimensionless form of a system for a chosen frequency and length scales.

    t = tau/w, q_i = L_i u_i; every old parameter has to disappear into the named groups.

    Parameters
    ----------
    system : System
        A system of expressions.
    frequency : expression or str
        w in the system's parameters, such as ``"sqrt(stiffness/mass)"``.
    lengths : mapping of coordinate to expression or str
        L_i; coordinates that are left out keep the scale 1 (angles).
    groups : mapping of str to expression or str
        New parameter -> its definition in the old ones, such as ``xi="damping/(2*sqrt(stiffness*mass))"``.
    names : mapping, optional
        Old coordinate -> new name.
    name : str, optional
        Name of the new system.

    Returns
    -------
    System
        With the groups as parameters (defaults from the old ones) and without outputs.

    Raises
    ------
    EquationError
        If a group cannot be solved for a parameter, or parameters are left over.

    Examples
    --------
    >>> import stability as st
    >>> spring = st.models.linear_oscillator.from_physical(amplitude=0.001)
    >>> st.dimensionless(spring, frequency="sqrt(stiffness/mass)", lengths=dict(y="amplitude"), names=dict(y="u"),
    ...     groups=dict(xi="damping/(2*sqrt(stiffness*mass))", Omega="2*pi*frequency*sqrt(mass/stiffness)")).rhs
    (u_dot, Omega**2*cos(Omega*t) - u - 2*u_dot*xi)
    """
    if system.rhs is None:
        raise EquationError(f"'{system.name}' is a Python function: a dimensionless form needs expressions")
    check_names("coordinate", lengths, system.coordinates, f"'{system.name}'")
    check_names("coordinate", names or {}, system.coordinates, f"'{system.name}'")
    w = _expression(frequency, system.parameters)
    scale = {c: _expression(lengths.get(c, 1), system.parameters) for c in system.coordinates}
    definitions = {k: _expression(v, system.parameters) for k, v in groups.items()}
    renamed = {c: (names or {}).get(c, c) for c in system.coordinates}
    factors, new_states = {}, []
    for s in system.states:
        moving = s.endswith("_dot") and s.removesuffix("_dot") in scale
        c = s.removesuffix("_dot") if moving else s
        factors[s] = scale[c] * w if moving else scale[c]
        new_states.append(f"{renamed[c]}_dot" if moving else renamed[c])
    swap = {symbol(s): factors[s] * symbol(f"new_{u}") for s, u in zip(system.states, new_states)}
    swap[TIME] = TIME / w
    scaled = [e.xreplace(swap) / (factors[s] * w) for s, e in zip(system.states, system.rhs)]
    period = [] if system.period_expression is None else [system.period_expression * w]
    moving_symbols = {symbol(f"new_{u}") for u in new_states} | {TIME}
    everything = [*scaled, *period, *system.breaks]
    reduced = _eliminated(everything, [w, *scale.values()], definitions, moving_symbols)
    back = {symbol(f"new_{u}"): symbol(u) for u in new_states}
    reduced = [e.xreplace(back) for e in reduced]
    own = {symbol(k): v for k, v in system.parameters.items()}
    n = len(system.states)
    return System(
        name=name or f"{system.name}, dimensionless",
        coordinates=tuple(renamed[c] for c in system.coordinates),
        states=tuple(new_states),
        parameters={k: float(e.subs(own)) for k, e in definitions.items()},
        rhs=tuple(reduced[:n]),
        period_expression=reduced[n] if period else None,
        breaks=tuple(reduced[n + len(period) :]),
        angles=tuple(renamed[a] for a in system.angles),
        description=system.description,
    )
