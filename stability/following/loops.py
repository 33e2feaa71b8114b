r"""Recognising a closed branch: has the curve come back to where it was, in the same direction?

The first points of a branch are remembered, a few of them, so that one is away from folds. When the parameter passes
the value of one of them again in the same direction, the solution there is computed and compared by its extrema and
period: they do not depend on the mesh, nor on the phase of an autonomous orbit. A segment in which the parameter turns
is looked at in its two parts: a remembered point may lie in one of them.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..results.solutions import FixedPoint, PeriodicOrbit
from ..words import Kind
from .locating import Locator
from .points import Point, dot

__all__ = ["Home", "collapsed"]

PARENT = "parent's"  # how the names of such ends begin
_SAME, _NOTHING = 1e-5, 1e-8
_REMEMBERED = (0, 3, 7, 12)
_FEWEST = 4
# a mesh that is not the same in both halves breaks the symmetry by its error e, the crossing by about e^(1/3)
_COLLAPSED = 2e-2


class Home:
    """Points at the beginning of a branch, to be recognised when the curve returns."""

    def __init__(self, first: Point) -> None:
        self.marks: list[tuple[int, Point]] = [(0, first)]

    def remember(self, accepted: int, point: Point) -> None:
        """Keep the point if it is one of the first."""
        if accepted in _REMEMBERED:
            self.marks.append((accepted, point))

    def reached(self, a: Point, b: Point, locator: Locator, accepted: int) -> tuple[Point, float] | None:
        """(the point again, arclength of the whole loop) if the segment from a to b passes a remembered point."""
        for p, q in _monotone(a, b, locator, [mark for number, mark in self.marks if accepted >= number + _FEWEST]):
            found = self._passed(p, q, locator, accepted)
            if found is not None:
                return found
        return None

    def _passed(self, a: Point, b: Point, locator: Locator, accepted: int) -> tuple[Point, float] | None:
        for number, mark in self.marks:
            passed = (a.parameter - mark.parameter) * (b.parameter - mark.parameter) < 0
            same_way = b.tangent.parameter * mark.tangent.parameter > 0
            if accepted < number + _FEWEST or not (passed and same_way):
                continue
            point = locator.at_parameter(a, b, mark.parameter)
            if point is not None and _same(point, mark):
                return point, point.s - self.marks[0][1].s - self._since_first(mark, point)
        return None

    def _since_first(self, mark: Point, at: Point) -> float:
        """Length of the curve from the first point to the mark, in the norm of `at` where scales have changed."""
        known = [p for _, p in self.marks]
        passed = known[: 1 + next(i for i, p in enumerate(known) if p is mark)]
        w, weight = at.problem.weights, at.tangent.weight
        if at.problem is mark.problem or any(p.u.size != at.u.size for p in passed):
            return mark.s - known[0].s
        steps = [(q.u - p.u, (q.parameter - p.parameter) * weight) for p, q in pairwise(passed)]
        return sum(math.sqrt(dot(w, du, du) + dl * dl) for du, dl in steps)


def _monotone(a: Point, b: Point, locator: Locator, marks: list[Point]) -> list[tuple[Point, Point]]:
    """The segment; in two parts where the parameter turns in it beyond a remembered point that lies beside its ends."""
    r, t, h = a.tangent.parameter, b.tangent.parameter, b.s - a.s
    if not (marks and r * t < 0 and h > 0):
        return [(a, b)]
    bend = 3 * (r + t) - 6 * (b.parameter - a.parameter) / h  # the rate is about r + (t - r - bend) x + bend x^2
    slope = t - r - bend
    x = 2 * r / (-slope + math.copysign(math.sqrt(max(slope**2 - 4 * bend * r, 0.0)), r))
    turn = a.parameter + h * x * (r + x * (slope / 2 + x * bend / 3))
    ends = (a.parameter, b.parameter)
    beyond = (max(ends), turn) if turn > max(ends) else (turn, min(ends))
    if not (0 < x < 1 and any(beyond[0] < mark.parameter < beyond[1] for mark in marks)):
        return [(a, b)]
    middle = locator.on_curve(a, b, x)
    return [(a, b)] if middle is None else [(a, middle), (middle, b)]


def _same(p: Point, q: Point) -> bool:
    (one, angles), (other, _) = _invariants(p), _invariants(q)
    if one.shape != other.shape:
        return False
    size, gap = np.maximum(np.abs(one), np.abs(other)).max(axis=1), one - other
    # an angle that went once round is where it was
    gap[angles] -= 2 * np.pi * np.round(gap[angles].mean(axis=1, keepdims=True) / (2 * np.pi))
    return bool((np.abs(gap).max(axis=1) <= _SAME * size + _NOTHING * size.max(initial=0.0)).all())


def _invariants(point: Point) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(k, 2) numbers of a solution that depend neither on its mesh nor on its phase, and which of them are angles.

    Extrema of every state, and the period; of a curve of special points the second parameter as well.
    """
    values, angles = _of_solution(point)
    second = getattr(point.problem, "free", None)
    if second is None:
        return values, angles
    at = point.problem.measures(point.u, point.params)[second]
    return np.vstack([values, [at, at]]), np.append(angles, False)


def _of_solution(point: Point) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    system = getattr(point.problem, "system", None)
    angles = getattr(system, "angles", ())
    measures = point.problem.measures(point.u, point.params)
    # of outputs only samples at the mesh are known
    states = [s for s in getattr(system, "states", ()) if f"{s}.max" in measures]
    if states and "period" in measures:
        rows = [[measures[f"{s}.max"], measures[f"{s}.min"]] for s in states]
        values = np.array([*rows, [measures["period"], measures["period"]]])
        return values, np.array([*(s in angles for s in states), False])
    solution = point.problem.view(point.u, point.params)
    if isinstance(solution, FixedPoint):
        return np.repeat(solution.x[:, None], 2, axis=1), np.array([s in angles for s in solution.states])
    values = np.repeat(np.array(list(measures.values()))[:, None], 2, axis=1)
    return values, np.zeros(len(values), bool)


def collapsed(point: Point) -> str | None:
    """What a family has come back to where its orbit repeats itself within its period, or stands still; else None.

    Doubled orbits end where they become the simple orbit twice over ("parent's PD"), orbits born at a Hopf point where
    they shrink to an equilibrium ("parent's HB"); beyond, the same solutions follow shifted in time. Orbits that have
    lost a symmetry end where they regain it (""); beyond, their images follow. Differences count relative to the
    states' scales.
    """
    if not point.spectrum.error < 1.0:
        return None  # close to a homoclinic orbit, which stands still for nearly all of its period
    mirror = getattr(point.problem, "mirror", None)
    solution = point.problem.view(point.u, point.params)
    if isinstance(solution, FixedPoint) and mirror is not None:
        gap = np.abs(mirror.symmetry.matrix @ point.u - point.u)
        return "" if (gap <= _COLLAPSED * np.maximum(np.abs(point.u), point.problem.scales)).all() else None  # type: ignore[attr-defined]
    if not isinstance(solution, PeriodicOrbit):
        return None
    times = np.linspace(0.0, 0.5 * solution.period, 33)
    wound = 0.5 * np.asarray(solution.winding)[:, None]
    if mirror is not None:
        times = np.linspace(0.0, (1.0 - mirror.fraction) * solution.period, 33)
        first = mirror.symmetry.matrix @ solution(times)
        second = solution(times + mirror.fraction * solution.period)
    else:
        first, second = solution(times), solution(times + 0.5 * solution.period) - wound
    size = np.maximum(np.abs(first).max(axis=1), getattr(point.problem, "scales", 0.0)) + 1e-300
    if not (np.abs(first - second).max(axis=1) <= _COLLAPSED * size).all():
        return None
    if mirror is not None:
        return ""
    still = np.ptp(first, axis=1) <= 2 * _COLLAPSED * size
    return f"{PARENT} {Kind.HOPF.label if still.all() else Kind.PERIOD_DOUBLING.label}"
