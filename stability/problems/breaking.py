r"""Pitchforks of symmetric orbits: which branch points break a symmetry, and the branch that is born there.

On half of a period (orbit_symmetry.py) such a point is a simple multiplier -1 of N. On the whole period it is a +1 with
two crossing branches: the orbit has a symmetry, x(t + P/2) = S x(t) or x(t) = S x(t), that the new direction turns
round. The discrete problem has the pitchfork up to its error only, since its mesh is not the same in both halves;
therefore the point is located again on half of the period, as a -1, and the new branch starts from there. In the same
way the place is found where a branch without the symmetry gets it back.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..errors import InputError
from ..protocols import Seed
from ..words import Kind
from .collocation import Collocation
from .defining import locate
from .equilibria import Equilibrium
from .orbit_symmetry import Mirror, broken, on_half, turned, turned_equilibrium

__all__ = ["breaks_symmetry", "pitchfork", "regained"]

Array = np.ndarray


def _crossing(point: Any) -> tuple[Mirror | None, Array, float]:
    """(symmetry that is lost, the crossing branch's direction and rate) at a branch point of a whole period."""
    from .switching import null_directions

    problem = point.problem
    if not isinstance(problem, (Collocation, Equilibrium)) or getattr(problem, "halved", False):
        return None, np.zeros(0), 0.0
    if not problem.system.symmetries:
        return None, np.zeros(0), 0.0
    try:
        u, rate = null_directions(point)[1]
    except (InputError, np.linalg.LinAlgError):
        return None, np.zeros(0), 0.0
    x = np.array(point.u)
    lost = turned_equilibrium(problem, x, u) if isinstance(problem, Equilibrium) else turned(problem, x, u)
    for name in () if lost is None else lost.symmetry.fixed:  # the symmetry holds at the system's own value only
        if name == point.free or point.params[name] != problem.system.parameters[name]:
            return None, u, rate
    return lost, u, rate


def breaks_symmetry(point: Any) -> bool:
    """Whether a branch point is a symmetry-breaking pitchfork."""
    if point.defining_kind is Kind.PERIOD_DOUBLING:
        return True
    return _crossing(point)[0] is not None


def pitchfork(point: Any) -> Seed | None:
    """The seed of the branch born at a symmetry-breaking point; None at any other branch point."""
    params, free = point.params_vector, point.free
    if point.defining_kind is Kind.PERIOD_DOUBLING:
        return _seed(point.problem, np.array(point.u), params, free)
    mirror, u, rate = _crossing(point)
    if mirror is None:
        return None
    if not mirror.fraction:  # the same at every time: the discrete problem has the symmetry, too
        own: dict[str, Any] = {"_memo": {}}
        if isinstance(point.problem, Equilibrium):
            own = {"fresh": True} if point.problem.following else {}  # the new branch has its own scales
        problem = dataclasses.replace(point.problem, mirror=mirror, **own)
        old = np.array(point.direction), float(point.rate)
        return Seed(problem, np.array(point.u), params, u, rate, 2, Kind.BRANCH_POINT, free, old, True)
    half, start = on_half(point.problem, np.array(point.u), mirror.symmetry)
    spread = abs(point.bracket[1] - point.bracket[0]) or 1e-3 * (abs(point.params[free]) or 1.0)
    values = np.array([-1.0 + 0j])
    found = locate(half, Kind.PERIOD_DOUBLING, start, params, free, 1.0 / spread, values, radius=1.0)
    return _seed(half, found.u, found.params, free) if found.converged else None


def regained(
    problem: Any, u: Array, params: Array, free: str, weight: float
) -> tuple[Collocation, Array, Array, Array] | None:
    """(problem, u, direction, params) where a family without the symmetry gets it back, exactly; None: not found."""
    if not problem.mirror.fraction:
        return None
    half, start = on_half(problem, u, problem.mirror.symmetry)
    found = locate(half, Kind.PERIOD_DOUBLING, start, params, free, weight, np.array([-1.0 + 0j]), radius=0.1)
    if not found.converged:
        return None
    return (*broken(half, found.u, found.params, _critical(half, found.u, found.params)), found.params)


def _critical(half: Collocation, u: Array, params: Array) -> Array:
    """v of N v = -v."""
    M = half.linearise(u, params).spectral
    return np.asarray(np.linalg.svd(M + np.eye(len(M)))[2][-1])


def _seed(half: Collocation, u: Array, params: Array, free: str) -> Seed:
    problem, whole, direction = broken(half, u, params, _critical(half, u, params))
    mirrored = problem.mirror is not None
    return Seed(problem, whole, params, direction, 0.0, 2, Kind.BRANCH_POINT, free, None, mirrored)
