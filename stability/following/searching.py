r"""Everything that happened between two neighbouring points: what the integers show, and what they do not.

A value that leaves and returns within a step, two folds within a step, leave all integers as they were. Where a
parabola through three neighbours (`events.dip_of`) or the cubic of the parameter (`events.double_turn`) comes near zero
inside the step, the test function is minimised along the curve; a point where it has crossed zero divides the segment,
and each part is resolved by its integers. A crossing that the parabola foretold and the curve does not show makes the
step doubtful: near a branch point the new point may lie on the other branch.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..words import Kind
from .events import crossed, dip_of, double_turn, supported
from .locating import Found, Locator
from .points import Point

__all__ = ["between", "hopped"]

_DIP = 0.15  # a vertex below this part of its neighbours is looked at


def between(locator: Locator, before: Point | None, a: Point, b: Point) -> tuple[list[Found], bool]:
    """Events between a and b (and, seen late, between the point before and a), and whether b is doubtful."""
    here: list[Point] = [a, b]
    behind: list[Point] = [before, a] if before is not None and before.problem is a.problem else []
    x = double_turn(a, b)
    cuts = [] if x is None else [(x, 3, 0.0)]
    if before is not None and supported(a, b):
        for which in _tests(b):
            dip = dip_of((before, a, b), which)
            if dip is not None and dip.depth < _DIP:
                cuts.append((dip.at, which, dip.depth))
    doubtful = False
    for x, which, depth in cuts:
        knots = here if x > a.s else behind
        if not knots:
            continue
        turn = _turning_point(locator, knots[0], knots[-1], which, x)
        if turn is not None:
            knots.append(turn)
            knots.sort(key=lambda q: q.s)
        elif depth < 0 and knots is here and len(here) == 2:
            doubtful = True
    found: list[Found] = []
    for knots in (behind if len(behind) > 2 else [], here):
        for p, q in pairwise(knots):
            found += locator.resolve(p, q)
    return found, doubtful and not found


def hopped(locator: Locator, a: Point, b: Point) -> bool:
    """Whether a branch point lies between a and b though the determinant kept its sign: b is on another branch."""
    return locator.attempt(Kind.BRANCH_POINT, a, b) is not None


def _tests(b: Point) -> list[int]:
    """Test functions to watch for dips; -1 and -2 stand for single real and complex values."""
    if not b.spectrum.values.size:
        return [3]
    return [3, 0, -1, -2] + [1] * (b.problem.critical.minus is not None)


def _turning_point(locator: Locator, a: Point, b: Point, which: int, x: float) -> Point | None:
    """Minimise the test over the segment by parabolas: a point where it has crossed zero, or None."""
    known = [a, b]
    for _ in range(20):
        new = _inside(locator, a, b, x)
        if new is None or min(abs(new.s - p.s) for p in known) < 1e-9:
            return None
        known.append(new)
        known.sort(key=lambda p: p.s)
        here = next(k for k, p in enumerate(known) if p is new)
        i = min(max(here, 1), len(known) - 2)
        triple = (known[i - 1], known[i], known[i + 1])
        if crossed((a, new, b), which) or crossed(triple, which):
            return new
        dip = dip_of(triple, which)
        if dip is None:
            return None
        low = int(np.argmin(np.abs(dip.values)))
        if low != 1 and 0 < i - 1 + low < len(known) - 1:  # the lowest point so far becomes the middle one
            i += low - 1
            triple = (known[i - 1], known[i], known[i + 1])
            dip = dip_of(triple, which)
            if dip is None:
                return None
        lowest, x = triple[1], dip.at
        if abs(x - lowest.s) < 0.1 * dip.width:
            if triple[2].s - triple[0].s < 8 * dip.width:
                return None  # the minimum is sampled closely, and it is not zero
            side = 1 if triple[2].s - lowest.s > lowest.s - triple[0].s else -1
            x = lowest.s + side * 2 * dip.width
    return None


def _inside(locator: Locator, a: Point, b: Point, s: float) -> Point | None:
    """The point of the curve near arclength s, kept off the ends of the segment."""
    width = b.s - a.s
    return locator.on_curve(a, b, min(0.995, max(0.005, (s - a.s) / width))) if width > 0 else None
