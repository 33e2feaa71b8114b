"""The engine of simulation: one system, compiled once, integrated over and over.

A motion over [t0, t1] is cut at the jumps of the right-hand side in time; each piece is one call of
kernels/runge_kutta.py (order 8, error control per step, dense output of order 7), or, where the system has stops,
switches or user events, a chain of such calls from event to event (integration/events.py). The compiled calls release
the GIL, so that threads run motions side by side. A motion that cannot go on has an `Ending` that says so and everything
up to its last good point; only a Python function that raises is an error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from ..errors import InputError, NonFiniteError
from ..kernels import piecewise, runge_kutta
from ..results.trajectory import Ending, Happening
from .compiled import CompiledField
from .flow import pieces

__all__ = ["Engine", "Motion", "Precision"]

Array = np.ndarray
_ESCAPED = 1e6  # growth over the largest value so far that tells escape from a jump, where the step collapses
NO_COLUMNS = np.zeros(0, np.int64), np.zeros(0)


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
    edges : (K + 1,);  coefficients : (K, 8, n) Chebyshev, see kernels/piecewise.py (empty unless dense)
    happenings : tuple of Happening
    matrix : (n, n) dx(t)/dx(t0), events included, or None
    """

    t: float
    x: Array
    steps: int
    ending: Ending
    edges: Array = field(default_factory=lambda: np.zeros(1))
    coefficients: Array = field(default_factory=lambda: np.zeros((0, 8, 0)))
    happenings: tuple[Happening, ...] = ()
    matrix: Array | None = None


class Engine:
    """Integrates one system; made once per system by `Engine.of`, safe to share between threads."""

    def __init__(self, system: Any) -> None:
        self.system = system
        self.compiled = CompiledField.of(system)
        self.address = self.compiled.evaluations.address("F")

    @classmethod
    def of(cls, system: Any) -> Engine:
        """The engine of a system."""
        return _engine(system)

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
        self, params: Array, x0: Array, t0: float, t1: float, precision: Precision, *, dense: bool = True, h: float = 0.0
    ) -> Motion:
        """From (t0, x0) to t1 > t0, or to where it cannot go on."""
        period, x = self.period(params), np.array(x0, float).reshape(-1, 1)
        scales, which = precision.scales(len(x)), NO_COLUMNS
        intervals = self.cuts(params, t0, t1)
        inside = 1e-13 * max(period, abs(t1)) if len(intervals) > 1 else 0.0
        edges, nested, steps, t, status = [np.array([t0])], [], 0, t0, runge_kutta.DONE
        for start, end in intervals:
            status, t, h, count, times, coefficients = runge_kutta.integrate(
                self.address, params, 1.0, 0.0, 1.0 / period, start, end, x, which[0], which[1], precision.rtol, scales,
                h, inside, precision.max_steps - steps, int(dense),
            )  # fmt: skip
            steps += count
            if dense:
                edges.append(times[1:])
                nested.append(coefficients)
            if status != runge_kutta.DONE:
                break
        state, columns = x[:, 0].copy(), _joined(nested, len(x))
        ending = self.ending(status, t, state, x0)
        return Motion(float(t), state, steps, ending, np.concatenate(edges), columns)

    def ending(self, status: int, t: float, x: Array, x0: Array) -> Ending:
        """The kernel's status in words; an exception of a Python right-hand side is raised here."""
        if status == runge_kutta.DONE:
            return Ending.COMPLETED
        error = self.compiled.evaluations.callback_error
        if status == runge_kutta.NOT_FINITE and error is not None:
            message = f"the right-hand side of '{self.system.name}' failed at t = {t:.6g}: {error}"
            raise NonFiniteError(message) from error
        if status == runge_kutta.TOO_MANY_STEPS:
            return Ending.MAX_STEPS
        if status == runge_kutta.STEP_TOO_SMALL and np.abs(x).max() < _ESCAPED * max(1e-3, float(np.abs(x0).max())):
            return Ending.STEP_TOO_SMALL
        return Ending.DIVERGED


@lru_cache(maxsize=64)
def _engine(system: Any) -> Engine:
    return Engine(system)


def _joined(nested: list[Array], n: int) -> Array:
    if not nested:
        return np.zeros((0, 8, n))
    return piecewise.from_steps(np.concatenate(nested))
