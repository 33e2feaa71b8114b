"""When and how the mesh and the scales of a collocation problem follow the solution.

The error of the nodes goes like N^(-2m); the wanted `accuracy` gives the number of intervals,

    N_new = N (safety . error / accuracy)^(1 / 2m),

limited to a factor between 2/3 and 2, with a dead band so that the mesh rests while the error is between 1e-5 and 1
times the accuracy. Errors that are rounding, N eps |core^-1|, are left alone: an undamped orbit far up a resonance is
known to few digits, and no mesh gives it more. The intervals are placed by equidistribution (kernels/meshes.py) when
the error per interval is uneven. Scales are the largest moduli of the states on the orbit, kept within a factor of 2 of
them; those of an angle do not fall below a small part of a radian, so that a branch that is born where a pendulum hangs
still leaves at once.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kernels.meshes import equidistribute, monitor
from ..protocols import Tangent
from .collocation_error import carried_errors

if TYPE_CHECKING:
    from ..systems.system import System
    from .collocation import Collocation

__all__ = ["adapted", "natural_sizes", "resting", "state_scales"]

Array = np.ndarray
_UNEVEN = 1.5  # largest share of the monitor over the mean share that is left alone
_FINE = 1e-2  # part of the wanted accuracy below which nobody minds where the intervals are
_COARSE = 1e-5  # part of it below which fewer intervals will do
_TINY = 1e-6
_LOST = 30.0  # errors below so many times their rounding do not ask for more intervals
_ANGLE = 0.02  # rad


class Natural(NamedTuple):
    """What a system says of the sizes of its states: smallest sensible scales (n,), units to compare them in (n,)."""

    smallest: Array | float = 0.0
    units: Array | float = 1.0


@lru_cache(maxsize=64)
def _places(states: tuple[str, ...], names: tuple[str, ...]) -> tuple[Array, Array]:
    """Where the named coordinates are among the states, and their velocities; without those that are no states."""
    velocities = tuple(f"{name}_dot" for name in names)
    first, second = (
        np.array([states.index(k) for k in group if k in states], dtype=int) for group in (names, velocities)
    )
    return first, second


def natural_sizes(system: System, period: float) -> Natural:
    """Smallest scales: a small angle, and the velocity of swinging by it once a period; 0 elsewhere.

    A velocity counts in 2 pi / period of its coordinate, whatever the unit of time.
    """
    sizes, units = np.zeros(system.n), np.ones(system.n)
    if math.isfinite(period) and period > 0:
        units[_places(system.states, system.coordinates)[1]] = 2 * np.pi / period
    if system.angles:
        angles, turning = _places(system.states, system.angles)
        sizes[angles] = _ANGLE
        if math.isfinite(period):
            sizes[turning] = 2 * np.pi * _ANGLE / period
    return Natural(sizes, units)


def state_scales(values: Array, natural: Natural = Natural()) -> Array:  # noqa: B008 - a constant
    """(n,) largest moduli of values (K, n), not below the smallest sensible ones (see `natural_sizes`).

    A state that is (nearly) zero, compared with the others in their units, takes the largest scale of all, at most 1.
    """
    return _scales_of(np.abs(values).max(axis=0), natural)


def _scales_of(size: Array, natural: Natural) -> Array:
    """The same of the largest moduli (n,)."""
    largest = float((size / natural.units).max())
    if not np.isfinite(largest) or largest == 0.0:
        return np.ones(len(size))
    alive = size > _TINY * largest * natural.units
    return np.where(alive, np.maximum(size, natural.smallest), min(largest, 1.0) * natural.units)


def adapted(
    problem: Collocation, u: Array, params: Array, tangent: Tangent | None
) -> tuple[Collocation, Array, Tangent | None] | None:
    """(problem, u, tangent) with a better mesh or better scales; None where the present ones are good."""
    mesh = problem.mesh
    nodes, stages, rest = mesh.split(u)
    period_scale = float(rest[0]) if mesh.own else 1.0
    period = period_scale if mesh.own else problem.orbit_period(params)
    size = np.abs(stages).max(axis=0).reshape(mesh.degree, mesh.n).max(axis=0)
    natural = natural_sizes(problem.system, period)
    rescale = not (0.5 <= period_scale / problem.period_scale <= 2.0 and _fit(problem.scales, size, natural))
    if not rescale:
        scales, period_scale = problem.scales, problem.period_scale
        if not problem.adaptive:
            return None
    else:
        scales = _scales_of(size, natural)
    known = problem.system.breaks or problem.mirror is not None
    breaks = problem.break_points(params) if known else np.zeros(0)
    moved = any(np.abs(mesh.edges - b).min() > 1e-12 for b in breaks)
    count, edges = mesh.intervals, mesh.edges
    if problem.adaptive or moved:
        _, error = carried_errors(problem, u)
        if not error <= problem.accuracy:
            error = problem.error(u, params)
        count = _wanted_intervals(problem, error) if problem.adaptive else count
        if count > mesh.intervals and error < _LOST * _rounding(problem, u, params):
            count = mesh.intervals
        if moved or count != mesh.intervals or error > _FINE * problem.accuracy:
            rho = monitor(mesh.edges, mesh.leading(nodes, stages) / scales, mesh.degree, breaks)
            share = rho * mesh.h
            uneven = problem.adaptive and float(share.max()) * len(share) > _UNEVEN * float(share.sum())
            if moved or uneven or count != mesh.intervals:
                edges = equidistribute(mesh.edges, rho, count, breaks)
    if edges is mesh.edges:
        return (problem.rescaled(scales, period_scale), u, tangent) if rescale else None
    new = dataclasses.replace(problem, edges=edges, scales=scales, period_scale=period_scale, _memo={})
    if tangent is None:
        return new, mesh.transfer(new.mesh, u)[0], None
    moved_u, moved_t = mesh.transfer(new.mesh, u, tangent.u)
    return new, moved_u, Tangent(moved_t, tangent.parameter, tangent.weight)


def resting(problem: Collocation, period: float) -> tuple[Array, Array, float, float]:
    """What a march needs to know whether `adapted` would say None: sizes (see `Natural`), and a band of node errors.

    The band is empty where the mesh has to follow breaks.
    """
    natural = natural_sizes(problem.system, period)
    low, high = 0.0, np.inf
    if problem.system.breaks or problem.mirror is not None:
        low, high = 1.0, 0.0
    elif problem.adaptive:
        low = 0.0 if problem.intervals >= problem.mesh.intervals else _COARSE * problem.accuracy
        high = _FINE * problem.accuracy
    return np.asarray(natural.smallest), np.asarray(natural.units), low, high


def _fit(scales: Array, size: Array, natural: Natural) -> bool:
    """Whether the scales are within a factor of 2 of those that the largest moduli `size` (n,) ask for."""
    sizes, smallest, units = size.tolist(), np.asarray(natural.smallest).tolist(), np.asarray(natural.units).tolist()
    largest = max(map(operator.truediv, sizes, units))
    if not math.isfinite(largest) or largest == 0.0:
        return bool(((scales <= 2.0) & (scales >= 0.5)).all())
    top = min(largest, 1.0)
    for scale, one, least, unit in zip(scales.tolist(), sizes, smallest, units):
        wanted = max(one, least) if one > _TINY * largest * unit else top * unit
        if not 0.5 <= wanted / scale <= 2.0:
            return False
    return True


def _rounding(problem: Collocation, u: Array, params: Array) -> float:
    """Error of the nodes that rounding of the equations makes, over the scales."""
    L = problem.linearise(u, params)
    if L.sign == 0.0 or not np.isfinite(L.core).all():
        return 0.0
    least = float(np.linalg.svd(L.core, compute_uv=False)[-1])
    return problem.mesh.intervals * float(np.finfo(float).eps) / max(least, 1e-300)


def _wanted_intervals(problem: Collocation, error: float) -> int:
    N = problem.mesh.intervals
    ratio = min(error / problem.accuracy, 1e12) if math.isfinite(error) else 1e3
    if _COARSE <= ratio <= 1.0 or (ratio < 1.0 and problem.intervals >= N):
        return N
    factor = float((4.0 * ratio) ** (0.5 / problem.mesh.degree)) if ratio > 0 else 0.0
    wanted = int(np.ceil(N * min(max(factor, 2 / 3), 2.0)))
    return int(min(max(wanted, problem.intervals), 1000))
