r"""From event to event: motions of systems with stops, switches and user events.

Between two events the smooth form of the system is integrated with its modes and holds fixed (integration/events.py,
kernels/guarded_steps.py). At an event the state is mapped (integration/impacts.py), the variations pass by the
saltation formula (integration/saltation.py), the mode changes its sign, and the next piece starts. A guard that stands
at zero is *fresh*: it may leave zero, which is no event; a guard that cannot leave it is pressed: on a wall the body is
held, at a switch both sides push back, which is sliding in Filippov's sense and ends the motion with that word.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..kernels import guarded_steps, runge_kutta
from ..results.trajectory import Ending, Happening
from .events import Guards
from .impacts import bounce
from .saltation import passed

if TYPE_CHECKING:
    from .engine import Engine, Precision

__all__ = ["Chain", "follow_events"]

Array = np.ndarray
EVENT, HELD = 10, 11  # beside the kernel's own ways of ending
_CHUNK = 16  # steps between two looks at the guards
_UNLIMITED = 10**9
_AHEAD = 1e-7  # of the interval: how far is looked ahead for the sign of a guard that starts at zero


@dataclass(eq=False)
class Chain:
    """A motion in the making; what changes from event to event.

    z (n, 1 + k): state and variations;  P: own parameters, modes, holds;  signs, active, fresh: of the guards
    """

    engine: Engine
    guards: Guards
    precision: Precision
    z: Array
    P: Array
    which: Array
    rates: Array
    t: float
    h: float = 0.0
    steps: int = 0
    signs: Array = field(default_factory=lambda: np.zeros(0))
    active: Array = field(default_factory=lambda: np.zeros(0, bool))
    fresh: Array = field(default_factory=lambda: np.zeros(0, bool))
    edges: list[Array] = field(default_factory=list)
    nested: list[Array] = field(default_factory=list)
    happenings: list[Happening] = field(default_factory=list)
    returned: tuple[int, float] = (-1, np.nan)

    @property
    def x(self) -> Array:
        """(n,) state."""
        return self.z[:, 0].copy()

    def values(self, x: Array | None = None, t: float | None = None) -> Array:
        """All guards at (x, t), here and now by default."""
        at, now = self.x if x is None else x, self.t if t is None else t
        found = guarded_steps.values(self.guards.field.address("F"), self.P, at, now, self.guards.size)
        return np.asarray(found[: self.guards.count])

    def slope(self, x: Array) -> Array:
        """x' of the smooth form in the present modes."""
        period = self.engine.period(self.P[: self.guards.own])
        return np.asarray(self.guards.smooth.evaluations.F(self.t / period, x[None].copy(), self.P)[0])

    # ------------------------------------------------------------------ the start
    def begin(self, t1: float) -> None:
        """Signs, modes, contacts at the start."""
        guards, kinds = self.guards, np.array(self.guards.kinds)
        now = self.values()
        ahead = self._ahead(t1)
        zero = np.abs(now) <= 1e-13 * np.maximum(1.0, np.abs(now).max(initial=0.0))
        zero &= np.abs(now) <= 1e3 * np.abs(ahead - now) + 1e-300
        signs = np.where(np.where(zero, ahead, now) < 0, -1.0, 1.0)
        self.fresh = zero.copy()
        self.active = kinds != "release"
        self.signs = np.where((kinds == "wall") | (kinds == "release"), 1.0, signs)
        for k in np.nonzero(kinds == "switch")[0].tolist():
            self.P[guards.own + k] = self.signs[k]
        first = guards.first("wall")
        for number, wall in enumerate(guards.walls):
            gap = wall.side * (wall.position - self.z[wall.coordinate, 0])
            if gap < -1e-12 * max(1.0, abs(wall.position)):
                name, value = self.engine.system.states[wall.coordinate], self.z[wall.coordinate, 0]
                raise InputError(
                    f"the motion starts beyond the {wall.name} at {wall.position:g}: {name} = {value:g}"
                )
            self.fresh[first + number] = gap <= 1e-13 * max(1.0, abs(wall.position))
            if self.fresh[first + number] and wall.side * self.z[wall.velocity, 0] > 0:
                self._wall(first + number)

    def _ahead(self, t1: float) -> Array:
        """The guards a moment later, by the system's own field (its switches decide for themselves)."""
        engine, own, z = self.engine, self.P[: self.guards.own].copy(), self.z[:, :1].copy()
        moment = _AHEAD * min(t1 - self.t, engine.period(own))
        runge_kutta.integrate(
            engine.address, own, 1.0, 0.0, 1.0 / engine.period(own), self.t, self.t + moment, z, np.zeros(0, np.int64),
            np.zeros(0), 1e-6, self.precision.scales(len(z)), moment, 0.0, 50, 0,
        )  # fmt: skip
        return self.values(np.ascontiguousarray(z[:, 0]), self.t + moment)

    # ------------------------------------------------------------------ pieces
    def piece(self, end: float, inside: float, dense: bool) -> tuple[int, int]:
        """(status, guard) of the integration to `end` or to the next event; the variations follow the state."""
        start, before = self.t, self.z.copy()
        status, guard = self._state_piece(end, inside, dense)
        if len(self.which) and self.t > start:
            z = before
            self._integrate(z, start, self.t, inside, 0.0, _UNLIMITED, self.which, False)
            z[:, 0] = self.z[:, 0]
            self.z = z
        return status, guard

    def _integrate(
        self, z: Array, t: float, end: float, inside: float, h: float, steps: int, which: Array, dense: bool
    ) -> Any:
        rate = 1.0 / self.engine.period(self.P[: self.guards.own])
        address = self.guards.smooth.address if len(which) else self.guards.address
        rates = self.rates if len(which) else np.zeros(0)
        return runge_kutta.integrate(
            address, self.P, 1.0, 0.0, rate, t, end, z, which, rates, self.precision.rtol,
            self.precision.scales(len(z)), h, inside, steps, int(dense),
        )  # fmt: skip

    def _state_piece(self, end: float, inside: float, dense: bool) -> tuple[int, int]:
        z, none, guards = np.ascontiguousarray(self.z[:, :1]), np.zeros(0, np.int64), self.guards
        while True:
            t = self.t
            status, s, self.h, count, times, nested = self._integrate(z, t, end, inside, self.h, _CHUNK, none, True)
            self.steps += max(count, 1)
            j, theta, guard, slope = guarded_steps.scan(
                guards.field.address("F"), self.P, times, nested, guards.size, guards.count, self.signs, self.active,
                self.fresh,
            )  # fmt: skip
            if guard >= 0:
                self._keep(times[: j + 1], nested[:j], dense)
                self.t, z = float(times[j]), nested[j, 0].reshape(-1, 1).copy()
                if theta >= 0.0:
                    z = self._meet(z, times[j + 1] - times[j], theta, guard, slope, end, dense)
                self.z[:, 0] = z[:, 0]
                return (EVENT if theta >= 0.0 else HELD), guard
            self._keep(times, nested, dense)
            self.t, self.z[:, 0] = float(s), z[:, 0]
            if count:
                self.fresh[:] = False
            if status != runge_kutta.TOO_MANY_STEPS or self.steps >= self.precision.max_steps:
                return status, -1

    def _keep(self, times: Array, nested: Array, dense: bool) -> None:
        if dense and len(nested):
            self.edges.append(times[1:])
            self.nested.append(nested)

    def _meet(
        self, start: Array, width: float, theta: float, guard: int, slope: float, end: float, dense: bool
    ) -> Array:
        """The state (n, 1) at the event: the step is taken again to end there, its end corrected on the solution."""
        at, low, none = self.t + theta * width, self.t, np.zeros(0, np.int64)
        z = start
        for _ in range(4):
            z = start.copy()
            if not at > low:
                return z
            _, _, _, _, times, nested = self._integrate(z, low, at, 0.0, at - low, 60, none, True)
            gap = self.signs[guard] * self.values(np.ascontiguousarray(z[:, 0]), at)[guard]
            change = -gap / slope if slope else 0.0
            if not 2e-16 * max(abs(at), width) < abs(change) < 1e-3 * width or at + change > end:
                break
            at += change
        self._keep(times, nested, dense)
        self.t, self.h = float(times[-1]), width
        return z

    # ------------------------------------------------------------------ events
    def happen(self, guard: int) -> bool:
        """Pass the event of a guard; True where it ends the motion."""
        kind = self.guards.kinds[guard]
        if kind == "wall":
            self._wall(guard)
        elif kind == "release":
            self._release(guard)
        elif kind == "switch":
            self._switch(guard)
        else:
            self.signs[guard] *= -1.0
            self.fresh[guard] = True
            self._note("event", guard, self.x, self.x)
        return bool(self.guards.stopping[guard])

    def _note(self, kind: str, guard: int, before: Array, after: Array) -> None:
        name = self.guards.names[guard]
        self.happenings.append(Happening(self.t, kind, name, tuple(before.tolist()), tuple(after.tolist())))

    def _pass(self, guard: int, before: Array, after: Array, derivative: Array, f_before: Array) -> None:
        """Write the new state and carry the variations over."""
        if len(self.which):
            gradient, by_time, by_params = self.guards.gradients(self.t, before, self.P, guard)
            by_guard = np.array([
                by_params[p] + by_time * self.t * rate if p >= 0 else 0.0 for p, rate in zip(self.which, self.rates)
            ])  # fmt: skip
            rate = float(gradient @ f_before + by_time)
            if rate == 0.0:
                self.z[:, 1:] = derivative @ self.z[:, 1:]
            else:
                f_after = self.slope(after)
                self.z[:, 1:] = passed(self.z[:, 1:], derivative, f_before, f_after, gradient, rate, by_guard)
        self.z[:, 0] = after

    def _switch(self, guard: int) -> None:
        x, before = self.x, self.slope(self.x)
        self.signs[guard] *= -1.0
        self.P[self.guards.own + guard] = self.signs[guard]
        self._pass(guard, x, x, np.eye(len(x)), before)
        self.fresh[guard] = True
        self._note("switch", guard, x, x)

    def _wall(self, guard: int, held: bool = False) -> None:
        number = guard - self.guards.first("wall")
        wall, release = self.guards.walls[number], self.guards.first("release") + number
        x, before = self.x, self.slope(self.x)
        pressing = np.inf if held else wall.side * before[wall.velocity]
        tolerance = float(self.precision.scales(len(x))[wall.coordinate])
        after, derivative, sticks = bounce(wall, x, pressing, tolerance)
        if sticks:
            self.P[wall.hold] = 1.0
            self.active[guard], self.active[release] = False, True
            self.fresh[release] = wall.side * before[wall.velocity] <= 0.0
        self._pass(guard, x, after, derivative, before)
        self.fresh[guard] = True
        self._note("stick" if sticks else "impact", guard, x, after)

    def _release(self, guard: int) -> None:
        number = guard - self.guards.first("release")
        wall, own = self.guards.walls[number], self.guards.first("wall") + number
        self.P[wall.hold] = 0.0
        self.active[guard], self.active[own], self.fresh[own] = False, True, True
        self._note("release", guard, self.x, self.x)

    def pressed(self, guard: int) -> bool:
        """A fresh guard does not leave zero: hold on a wall, turn back at a switch; False where nothing helps."""
        kind = self.guards.kinds[guard]
        if kind == "wall":
            number = guard - self.guards.first("wall")
            wall = self.guards.walls[number]
            if wall.hold < 0:
                return False
            self.z[wall.velocity, 0] = 0.0
            self._wall(guard, held=True)
            return True
        if self.returned == (guard, self.t):
            return False
        self.returned = (guard, self.t)
        if kind == "switch":
            self._switch(guard)
        else:
            self.signs[guard] *= -1.0
            self.fresh[guard] = True
        return True


def follow_events(
    engine: Engine, guards: Guards, params: Array, x0: Array, t0: float, t1: float, precision: Precision,
    intervals: list[tuple[float, float]], *, dense: bool, which: Any, rates: Any, columns: Array,
) -> tuple[Chain, Ending]:  # fmt: skip
    """Integrate from (t0, x0) to t1 over all events; columns (n, k) start values of the variations."""
    z = np.column_stack([x0, columns]) if columns.size else np.array(x0, float).reshape(-1, 1)
    P = np.concatenate([params, np.zeros(guards.extra)])
    chain = Chain(engine, guards, precision, np.ascontiguousarray(z), P, which, rates, t0)
    chain.edges.append(np.array([t0]))
    chain.begin(t1)
    inside = 1e-13 * max(engine.period(params), abs(t1)) if len(intervals) > 1 else 0.0
    for _, end in intervals:
        while end - chain.t > 4e-16 * max(abs(end), abs(t0)):
            status, guard = chain.piece(end, inside, dense)
            if status == runge_kutta.DONE:
                break
            if status == EVENT:
                if chain.happen(guard):
                    return chain, Ending.STOPPED
            elif status == HELD:
                if not chain.pressed(guard):
                    return chain, Ending.SLIDING if guards.kinds[guard] == "switch" else Ending.TOO_MANY_EVENTS
            else:
                return chain, engine.ending(status, chain.t, chain.x, x0)
            if len(chain.happenings) > precision.max_events:
                return chain, Ending.TOO_MANY_EVENTS
    return chain, Ending.COMPLETED


def kept_steps(chain: Chain, n: int) -> tuple[Array, Array]:
    """(edges, nested coefficients) of the steps that were kept."""
    return np.concatenate(chain.edges), np.concatenate(chain.nested) if chain.nested else np.zeros((0, 8, n))
