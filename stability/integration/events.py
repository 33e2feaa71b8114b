r"""Events of a system: its switches, its walls and what a user asks for, as guards of a compiled field.

The smooth form of a piecewise system (integration/switches.py) has extra parameters: a mode per switch and, per hard
stop, a hold that keeps the coordinate on the wall (q' = q'' = 0 while it is pressed against it). Guards, in this
order:

    switch    g(t, x, p)                  sign = mode: the right-hand side changes its form where g changes sign
    wall      side (position - q) >= 0    the velocity is reversed at zero: q'+ = -e q'-
    release   side q''(t, x, p) >= 0      a held coordinate is let go at zero
    event     any expression              recorded, both ways; may end the motion

All are one C function over (x, t), compiled like a vector field, so that derivatives for saltation come with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp
from sympy.core.function import AppliedUndef

from ..errors import InputError, check_names
from ..systems.evaluators import evaluator
from .compiled import CompiledField
from .switches import frozen_switches

__all__ = ["Guards", "Wall", "guards_of"]

Array = np.ndarray
TIME = sp.Symbol("t", real=True)


@dataclass(frozen=True)
class Wall:
    """A hard stop: indices of its coordinate, velocity and hold parameter (-1: cannot be held)."""

    name: str
    coordinate: int
    velocity: int
    position: float
    side: int
    restitution: float
    hold: int


@dataclass(frozen=True, eq=False)
class Guards:
    """A system in smooth form with its guards.

    Attributes
    ----------
    smooth : CompiledField of the smooth form;  address : int, its F
    extra : number of extra parameters (modes, then holds), appended to the system's own, m
    kinds, names : of the guards ("switch", "wall", "release", "event")
    walls : tuple of Wall
    field : Evaluator of the guards;  size : its number of states
    stopping : (K,) bool, events that end the motion
    """

    smooth: CompiledField
    address: int
    own: int
    extra: int
    kinds: tuple[str, ...]
    names: tuple[str, ...]
    walls: tuple[Wall, ...]
    field: Any
    size: int
    stopping: Array

    @property
    def count(self) -> int:
        """Number of guards."""
        return len(self.kinds)

    def first(self, kind: str) -> int:
        """Index of the first guard of a kind (count if there is none)."""
        return self.kinds.index(kind) if kind in self.kinds else self.count

    def gradients(self, t: float, x: Array, params: Array, which: int) -> tuple[Array, float, Array]:
        """dg/dx (n,), dg/dt, dg/dp (m + extra,) of one guard at fixed time."""
        X = np.zeros((1, self.size))
        X[0, : len(x)], X[0, len(x)] = x, t
        _, J, Fp = self.field.FJP(None, X, params)
        return J[0, which, : len(x)].copy(), float(J[0, which, len(x)]), Fp[0, which].copy()


def _walls(system: Any, first: int) -> tuple[Wall, ...]:
    """The stops as walls, checked: a velocity of its own for each coordinate, and room between opposite stops."""
    walls = []
    for k, stop in enumerate(system.stops):
        velocity = f"{stop.coordinate}_dot"
        check_names("state", [velocity], system.states, f"'{system.name}' (a stop needs its coordinate's velocity)")
        side = "above" if stop.side > 0 else "below"
        walls.append(
            Wall(f"{stop.coordinate} stop {side}", system.states.index(stop.coordinate), system.states.index(velocity),
                 float(stop.position), stop.side, stop.restitution, first + k if system.rhs is not None else -1)
        )  # fmt: skip
    for upper in walls:
        for lower in walls:
            facing = upper.side > 0 > lower.side and upper.coordinate == lower.coordinate
            if facing and upper.position <= lower.position:
                name = system.states[upper.coordinate]
                raise InputError(
                    f"the stops of {name} overlap: from above at {upper.position:g}, from below at {lower.position:g}"
                )
    return tuple(walls)


def _user_events(system: Any, events: Mapping[str, Any]) -> list[sp.Expr]:
    from ..systems.parsing import parse_expression

    names = [*system.states, *system.parameters, "t"]
    allowed = {sp.Symbol(name, real=True) for name in names}
    found = []
    for name, given in events.items():
        expression = parse_expression(given, names) if isinstance(given, str) else sp.sympify(given)
        rates = {d: sp.Symbol(f"{d.expr.func.__name__}_dot", real=True) for d in expression.atoms(sp.Derivative)}
        expression = expression.xreplace(rates)
        own = {f: sp.Symbol(f.func.__name__, real=True) for f in expression.atoms(AppliedUndef)}
        expression = expression.xreplace(own)
        expression = expression.xreplace({s: sp.Symbol(s.name, real=True) for s in expression.free_symbols})
        unknown = expression.free_symbols - allowed
        if unknown:
            check_names("state or parameter", [str(s) for s in unknown], names, f"event '{name}' of '{system.name}'")
        found.append(expression)
    return found


def guards_of(system: Any, events: Mapping[str, Any] | None = None, stopping: Sequence[str] = ()) -> Guards | None:
    """The guards of a system; None where it has none (no switches in the states, no stops, no events).

    Raises
    ------
    InputError, UnknownNameError, ExpressionError
        Overlapping stops, a stop on a coordinate without velocity, unknown names in an event.
    """
    events = dict(events or {})
    check_names("event", stopping, events, "this simulation")
    frozen, rhs = frozen_switches(system)
    m = len(system.parameters)
    walls = _walls(system, m + len(frozen.guards))
    user = _user_events(system, events)
    if not (frozen.guards or walls or user):
        return None
    parameters = dict(system.parameters) | {mode.name: 1.0 for mode in frozen.modes}
    kinds = ["switch"] * len(frozen.guards) + ["wall"] * len(walls)
    names = [str(g) for g in frozen.guards] + [wall.name for wall in walls]
    q = [sp.Symbol(system.states[wall.coordinate], real=True) for wall in walls]
    expressions = [*frozen.guards, *(wall.side * (wall.position - c) for wall, c in zip(walls, q))]
    if system.rhs is not None:
        holds = [sp.Symbol(f"hold{frozen.prefix[4:]}_{k}", real=True) for k in range(len(walls))]
        parameters |= {hold.name: 0.0 for hold in holds}
        kinds += ["release"] * len(walls)
        names += [f"release of {wall.name}" for wall in walls]
        expressions += [wall.side * rhs[wall.velocity] for wall in walls]
        rows = list(rhs)
        for wall, hold in zip(walls, holds):
            for row in (wall.coordinate, wall.velocity):
                rows[row] = (1 - hold) * rows[row]
        smooth = system.replace(
            rhs=tuple(rows), parameters=parameters, stops=(), outputs={}, units={},
            name=f"{system.name}, switches frozen",
        )  # fmt: skip
    else:
        smooth = system
    kinds += ["event"] * len(user)
    names += list(events)
    expressions += user
    compiled = CompiledField.of(smooth)
    field, size = _guard_field(system, parameters, expressions)
    ends = np.array([kind == "event" and name in stopping for kind, name in zip(kinds, names)], bool)
    return Guards(
        compiled, compiled.evaluations.address("F"), m, len(parameters) - m, tuple(kinds), tuple(names), walls, field,
        size, ends,
    )  # fmt: skip


def _guard_field(system: Any, parameters: Mapping[str, float], expressions: Sequence[sp.Expr]) -> tuple[Any, int]:
    """The guards as right-hand side of a field over (x, t, padding)."""
    from ..systems.system import System

    clock = sp.Symbol("elapsed", real=True)
    while clock.name in system.states or clock.name in parameters:
        clock = sp.Symbol(clock.name + "x", real=True)
    states = [*system.states, clock.name]
    size = max(len(states), len(expressions))
    states += [f"{clock.name}{k}" for k in range(size - len(states))]
    rows = [e.xreplace({TIME: clock}) for e in expressions] + [sp.S.Zero] * (size - len(expressions))
    made = System(f"guards of {system.name}", tuple(states), tuple(states), dict(parameters), tuple(rows))
    return evaluator(made), size
