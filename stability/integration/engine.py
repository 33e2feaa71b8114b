"""The engine of simulation: one system, compiled once, integrated over and over.

A motion over [t0, t1] is cut at the jumps of the right-hand side in time; each piece is one call of
kernels/runge_kutta.py (order 8, error control per step, dense output of order 7), or, where the system has stops,
switches or user events, a chain of such calls from event to event (integration/events.py). The compiled calls release
the GIL, so that threads run motions side by side. A motion that cannot go on has an `Ending` that says so and
everything up to its last good point; only a Python function that raises is an error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from ..errors import InputError, NonFiniteError
from ..kernels import piecewise, runge_kutta
from ..results.trajectory import Ending, Happening
from .compiled import CompiledField
from .events import guards_of
from .flow import pieces
from .nonsmooth import follow_events, kept_steps

__all__ = ["Engine", "Motion", "Precision"]

Array = np.ndarray
_ESCAPED = 1e6  # growth over the largest value so far that tells escape from a jump, where the step collapses


@dataclass(frozen=True)
class Precision:
    """Tolerances and limits of an integration: local error per step <= atol + rtol |x|."""

    rtol: float = 1e-9
    atol: Any = 1e-12
    max_steps: int = 2_000_000
    max_events: int = 100_000

    def __post_init__(self) -> None:
        if not 1e-14 <= self.rtol <= 1e-2:
            raise InputError(f"rtol = {self.rtol!r}: a number from 1e-14 to 1e-2 is needed")
        atol = np.asarray(self.atol, float)
        if not ((atol > 0) & np.isfinite(atol)).all():
            raise InputError(f"atol = {self.atol!r}: positive finite numbers are needed")
        for name in ("max_steps", "max_events"):
            if getattr(self, name) < 1:
                raise InputError(f"{name} = {getattr(self, name)}: a whole number >= 1 is needed")

    def scales(self, n: int) -> Array:
        """(n,) absolute tolerances."""
        atol = np.asarray(self.atol, float)
        if atol.shape not in ((), (n,)):
            raise InputError(f"atol has shape {atol.shape}; a number or ({n},), one per state, is needed")
        return np.ascontiguousarray(np.broadcast_to(atol, (n,)))


@dataclass(frozen=True, eq=False)
class Motion:
    """What an integration gave.

    Attributes
    ----------
    t : float, where it ended;  x : (n,) state there;  steps : int;  ending : Ending
    edges : (K + 1,);  nested : (K, 8, n) dense output as kernels/runge_kutta.py makes it (empty unless dense)
    coefficients : the same as Chebyshev series, see kernels/piecewise.py
    happenings : tuple of Happening
    variations : (n, k), the columns that were asked for, carried over events
    """

    t: float
    x: Array
    steps: int
    ending: Ending
    edges: Array = field(default_factory=lambda: np.zeros(1))
    nested: Array = field(default_factory=lambda: np.zeros((0, 8, 0)))
    happenings: tuple[Happening, ...] = ()
    variations: Array | None = None
    expanded: Array | None = None

    @cached_property
    def coefficients(self) -> Array:
        """(K, 8, n) Chebyshev coefficients of the pieces."""
        return piecewise.from_steps(self.nested) if self.expanded is None else self.expanded


class Engine:
    """Integrates one system; made once per system by `Engine.of`, safe to share between threads."""

    def __init__(self, system: Any, events: tuple[tuple[str, Any], ...] = (), stopping: tuple[str, ...] = ()) -> None:
        self.system = system
        self.compiled = CompiledField.of(system)
        self.address = self.compiled.evaluations.address("F")
        self.guards = guards_of(system, dict(events), stopping)

    @classmethod
    def of(cls, system: Any, events: Mapping[str, Any] | None = None, stopping: Sequence[str] = ()) -> Engine:
        """The engine of a system, with events by name (expressions or their text); `stopping`: those that end it."""
        return _engine(system, tuple((events or {}).items()), tuple(stopping))

    @property
    def forced(self) -> bool:
        """Whether the system has a forcing period."""
        return self.compiled.forced

    def period(self, params: Array) -> float:
        """Forcing period at the parameters (1 for an autonomous system: its clock's unit)."""
        return float(self.compiled.evaluations.period(params)) if self.forced else 1.0

    def cuts(self, params: Array, t0: float, t1: float) -> list[tuple[float, float]]:
        """[t0, t1] cut at the jumps of the right-hand side in time."""
        breaks = self.compiled.breaks(params) if self.forced else np.zeros(0)
        return list(pieces(self.compiled, t0, t1, self.period(params), breaks))

    def run(
        self, params: Array, x0: Array, t0: float, t1: float, precision: Precision, *, dense: bool = True,
        variations: bool = False, parameters: Sequence[str] = (),
    ) -> Motion:  # fmt: skip
        """From (t0, x0) to t1 > t0, or to where it cannot go on.

        variations : True carries the columns of dx(t)/dx0;  parameters : names for further columns dx(t)/dp at fixed
        phase
        """
        n = len(x0)
        which = np.array([-1] * (n if variations else 0) + [self.compiled.place(p) for p in parameters], np.int64)
        rates = self._rates(params, which)
        start_columns = np.eye(n, len(which)) if variations else np.zeros((n, len(which)))
        intervals = self.cuts(params, t0, t1)
        if self.guards is not None:
            chain, ending = follow_events(
                self, self.guards, params, x0, t0, t1, precision, intervals, dense=dense, which=which, rates=rates,
                columns=start_columns,
            )  # fmt: skip
            return Motion(chain.t, chain.x, chain.steps, ending, *kept_steps(chain, n), tuple(chain.happenings),
                          chain.z[:, 1:].copy())  # fmt: skip
        x = np.ascontiguousarray(np.column_stack([x0, start_columns]))
        period, scales, h = self.period(params), precision.scales(n), 0.0
        address = self.compiled.address if len(which) else self.address
        inside = 1e-13 * max(period, abs(t1)) if len(intervals) > 1 else 0.0
        edges, nested, steps, t, status = [np.array([t0])], [], 0, t0, runge_kutta.DONE
        for start, end in intervals:
            status, t, h, count, times, coefficients = runge_kutta.integrate(
                address, params, 1.0, 0.0, 1.0 / period, start, end, x, which, rates, precision.rtol, scales, h,
                inside, precision.max_steps - steps, int(dense),
            )  # fmt: skip
            steps += count
            if dense:
                edges.append(times[1:])
                nested.append(coefficients)
            if status != runge_kutta.DONE:
                break
        state, columns = x[:, 0].copy(), _joined(nested, len(x))
        ending = self.ending(status, t, state, x0)
        return Motion(float(t), state, steps, ending, np.concatenate(edges), columns, (), x[:, 1:].copy())

    def _rates(self, params: Array, which: Array) -> Array:
        """T_p / T of the parameters among the variations, zero for directions."""
        if not self.forced or not (which >= 0).any():
            return np.zeros(len(which))
        slope = self.compiled.evaluations.period_gradient(params) / self.period(params)
        return np.array([slope[k] if k >= 0 else 0.0 for k in which])

    def ending(self, status: int, t: float, x: Array, x0: Array) -> Ending:
        """The kernel's status in words; an exception of a Python right-hand side is raised here."""
        if status == runge_kutta.DONE:
            return Ending.COMPLETED
        error = self.compiled.evaluations.callback_error
        if status == runge_kutta.NOT_FINITE and error is not None:
            why = self.compiled.evaluations.failure()
            raise NonFiniteError(f"the motion of '{self.system.name}' failed at t = {t:.6g}{why}") from error
        if status == runge_kutta.TOO_MANY_STEPS:
            return Ending.MAX_STEPS
        if status == runge_kutta.STEP_TOO_SMALL and np.abs(x).max() < _ESCAPED * max(1e-3, float(np.abs(x0).max())):
            return Ending.STEP_TOO_SMALL
        return Ending.DIVERGED


@lru_cache(maxsize=64)
def _engine(system: Any, events: tuple[tuple[str, Any], ...], stopping: tuple[str, ...]) -> Engine:
    return Engine(system, events, stopping)


def _joined(nested: list[Array], n: int) -> Array:
    return np.concatenate(nested) if nested else np.zeros((0, 8, n))
