r"""The variational equation along a periodic orbit: ``y' = df/dx (t, x*(t), p) y`` over the period of the orbit.

The orbit is any callable ``orbit(t) -> (n,) or (n, N)`` with a ``period``. For a forced system that period must be a
whole multiple k of the forcing period; the map is then that of k forcing periods. For an autonomous system it is the
orbit's own, and x*' is an eigenvector of the period map with the multiplier 1. Before any integration the orbit is
checked: the relative residual of ``x*' = f(t, x*, p)``, with the derivative by a fourth-order difference of the
callable, must be small.

Pieces: an orbit with ``edges`` (times of its polynomial pieces) is smooth only between them; they become breaks of the
integration, besides those of the system.

Shapes: phases (K,) in units of the orbit's period; generators (K, 1, n, n), multiplied by the period.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, NonFiniteError

__all__ = ["orbit_generator"]

Array = NDArray[np.float64]

_RESIDUAL = 1e-5  # relative; differences of an orbit of tolerance 1e-9 stay below
_PROBES: NDArray[np.float64] = np.asarray((np.arange(24) + 0.37) / 24, dtype=np.float64)


def orbit_generator(system: Any, orbit: Any, P: Array) -> tuple[Callable[[Array], Array], float, Array]:
    """``phases (K,) -> T A (K, 1, n, n)``, the period T of the orbit, and the phases where A or its derivatives jump.

    Raises
    ------
    InputError
        The period is not positive or no multiple of the forcing period, the orbit has another number of states, is not
        periodic or does not solve the equations.
    NonFiniteError
        The equations are not finite on the orbit.
    """
    from ..systems.evaluators import evaluator

    field = evaluator(system)
    period = float(orbit.period)
    if not (np.isfinite(period) and period > 0):
        raise InputError(f"the orbit has the period {period!r}; it must be positive and finite")
    multiple = 1
    if system.period_expression is not None:
        forcing = float(np.atleast_1d(field.period(P))[0])
        multiple = max(1, round(period / forcing))
        if abs(period / forcing - multiple) > 1e-9 * multiple:
            raise InputError(
                f"the orbit's period {period:.9g} is no multiple of the forcing period {forcing:.9g} of "
                f"'{system.name}' at these parameters; give the parameters of the orbit"
            )

    def states(phase: Array) -> Array:
        values = np.asarray(orbit(phase * period), dtype=float)
        if values.shape != (field.n, phase.size):
            raise InputError(
                f"the orbit gives an array {values.shape} at {phase.size} times; ({field.n}, {phase.size}) is needed"
            )
        return np.ascontiguousarray(values.T)

    def jacobian(phase: Array) -> Array:
        forced = np.mod(phase * multiple, 1.0)
        J = np.asarray(field.FJ(np.ascontiguousarray(forced), states(phase), P)[1], dtype=float)
        if not np.isfinite(J).all():
            raise NonFiniteError(f"the derivatives of '{system.name}' are not finite on the orbit; see its points")
        return period * J[:, None]

    _check(system, field, states, multiple, period, P)
    return jacobian, period, _breaks(field, system, orbit, P, multiple, period)


def _check(system: Any, field: Any, states: Callable[[Array], Array], multiple: int, period: float, P: Array) -> None:
    """The orbit solves the equations (differences of the callable against the right-hand side)."""
    step = 1e-3
    moved = [states(_PROBES + k * step) for k in (-2, -1, 1, 2)]
    rate = (moved[0] - 8.0 * moved[1] + 8.0 * moved[2] - moved[3]) / (12.0 * step * period)
    F = np.asarray(field.F(np.mod(_PROBES * multiple, 1.0), states(_PROBES), P))
    if not np.isfinite(F).all():
        raise NonFiniteError(f"'{system.name}' is not finite on the orbit")
    # a jump of the right-hand side spoils single probes; the middle one speaks for the orbit
    misfit = np.median(np.abs(F - rate), axis=0) / np.maximum(np.abs(F).max(), 1e-300)
    if misfit.max() > _RESIDUAL:
        worst = system.states[int(np.argmax(misfit))]
        raise InputError(
            f"the orbit does not solve '{system.name}' at these parameters: relative residual {misfit.max():.1e} in "
            f"{worst}'; give the parameters at which the orbit was computed"
        )


def _breaks(field: Any, system: Any, orbit: Any, P: Array, multiple: int, period: float) -> Array:
    """Phases in (0, 1) of the orbit's period where the integration must have an edge."""
    parts = [np.zeros(0)]
    if system.breaks:
        own = np.asarray(field.breaks(P), dtype=float).ravel()
        parts.append(((np.arange(multiple)[:, None] + own) / multiple).ravel())
    edges = getattr(orbit, "edges", None)
    if edges is not None:
        parts.append((np.asarray(edges, dtype=float) / period)[1:-1])
    merged = np.unique(np.concatenate(parts))
    merged = merged[(merged > 1e-12) & (merged < 1.0 - 1e-12)]
    keep = np.concatenate([[True], np.diff(merged) > 1e-12]) if merged.size else np.zeros(0, bool)
    return np.asarray(merged[keep])
