"""Letting transients die out: from any state to a first guess of a stable periodic orbit.

Forced systems: whole orbits of k forcing periods are integrated until the stroboscopic point stops moving. Autonomous
systems: after a long time the last state x* is taken, and the orbit is what lies between it and its last return to the
section (x - x*) . f(x*) = 0 close to x*.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ConvergenceError
from .flow import Flow, flow

__all__ = ["settled_orbit"]

Array = np.ndarray
_RTOL = 1e-8
_SAMPLES = 401
_SETTLED = 1e-7


def settled_orbit(
    system: Any, params: Array, state: Array, multiple: int, winding: Array, periods: int
) -> tuple[Array, Array, float]:
    """(times (K,) from 0 to the period, states (n, K), period) of the motion that `state` settles on.

    Raises ConvergenceError where an autonomous system does not come back close to where it was.
    """
    if system.period_expression is None:
        return _autonomous(system, params, state)
    period = multiple * system.period_at(**dict(zip(system.parameters, params.tolist())))
    x, orbit = np.array(state, float), None
    for k in range(max(1, periods // multiple)):
        orbit = flow(system, (k * period, (k + 1) * period), x, params, rtol=_RTOL, atol=1e-10, dense=True)
        moved = float(np.abs(orbit.x - x - winding).max())
        size = float(np.abs(orbit.x).max())
        x = orbit.x - winding
        if moved <= _SETTLED * max(size, 1e-6):
            break
    times = np.linspace(0.0, period, _SAMPLES)
    assert orbit is not None
    return times, orbit(times + k * period), period


def _autonomous(system: Any, params: Array, state: Array) -> tuple[Array, Array, float]:
    x, t = np.array(state, float), 0.0
    named = dict(zip(system.parameters, params.tolist()))
    speed = float(np.abs(system(0.0, x, **named)).max())
    horizon = 60.0 * max(float(np.abs(x).max()), 1e-3) / max(speed, 1e-6)
    for _ in range(5):
        orbit = flow(system, (t, t + horizon), x, params, rtol=_RTOL, atol=1e-10, dense=True)
        t, x = t + horizon, orbit.x
        found = _last_return(system, named, orbit, t - horizon, t)
        if found is not None:
            times = np.linspace(0.0, found, _SAMPLES)
            return times, orbit(t - found + times), found
        horizon *= 3.0
    raise ConvergenceError(
        f"the transients of '{system.name}' did not settle on a periodic orbit by t = {t:.4g}; last state "
        f"{dict(zip(system.states, x.tolist()))}: give a state near the orbit or the orbit itself",
        t=t, x=x,
    )  # fmt: skip


def _last_return(system: Any, named: dict[str, float], orbit: Flow, t0: float, t1: float) -> float | None:
    """Time since the last passage through the section at the end, None where the motion did not close up."""
    times = np.linspace(t1, t0, 20001)
    states = orbit(times)
    end = states[:, 0]
    scale = np.maximum(np.ptp(states[:, : len(times) // 2], axis=1), 1e-300)
    normal = system(0.0, end, **named) / scale**2
    height = normal @ (states - end[:, None])
    distance = np.sqrt((((states - end[:, None]) / scale[:, None]) ** 2).mean(axis=0))
    if float(np.abs(normal * scale).max()) == 0.0 or float(np.ptp(states[:, : len(times) // 2], axis=1).max()) < 1e-6:
        return None
    crossing = (height[1:-1] >= 0) & (height[2:] < 0) & (distance[1:-1] < 0.03)
    left = np.argmax(distance > 0.1)  # has to leave the neighbourhood first
    places = np.nonzero(crossing)[0]
    places = places[places > left]
    if not left or not len(places):
        return None
    k = int(places[0]) + 1
    a, b = height[k], height[k + 1]
    return float(t1 - (times[k] + (times[k + 1] - times[k]) * a / (a - b)))
