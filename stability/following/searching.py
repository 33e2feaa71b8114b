r"""Everything that happened between two neighbouring points: what the integers show, and what they do not.

A value that leaves and returns within a step, two folds within a step, leave all integers as they were. Where a
parabola through three neighbours (`events.dip_of`) or the cubic of the parameter (`events.double_turn`) comes near zero
inside the step, the test function is minimised along the curve; a point where it has crossed zero divides the segment,
and each part is resolved by its integers. A crossing that the parabola, or the line through the last two values,
foretold and the curve does not show makes the step doubtful: near a branch point the new point may lie on the other
branch. Both ends of a segment that is searched share a mesh: of a point whose mesh was adapted the segment behind it
needs the older form (`twin`).
"""

from __future__ import annotations

from itertools import pairwise

from ..words import Kind
from .events import TURN, Triple, changes, crossed, dip_of, double_turn, growth_of, matched, supported
from .locating import Found, Locator, shown
from .points import Point

__all__ = ["WATCH", "between", "hopped"]

_DIP = 0.15  # a vertex below this part of its neighbours is looked at
_MANY = 6  # values beyond which their product is no test
_SUDDEN = 0.2  # a value that comes down to less than this part of itself in a step
WATCH = (_DIP, _SUDDEN, TURN)  # for problems that look at several steps by themselves


def between(
    locator: Locator, before: Point | None, a: Point, b: Point, twin: Point | None = None
) -> tuple[list[Found], bool]:
    """Events between a and b (and, seen late, between the point before and a), and whether b is doubtful.

    `twin` is a on the mesh of the point before, where that is another one.
    """
    here: list[Point] = [a, b]
    end = a if twin is None else twin
    behind: list[Point] = [before, end] if before is not None and before.problem is end.problem else []
    segments = [tuple(knots) for knots in (behind, here) if knots]
    x = double_turn(a, b)
    cuts = [] if x is None else [(x, 3, 0.0)]
    doubtful = False
    if before is not None and supported(a, b):
        triples = matched((before, a, b))
        for which in _tests(b):
            dip = dip_of((before, a, b), which, triples)
            if dip is not None and dip.depth < _DIP:
                cuts.append((dip.at, which, dip.depth))
        doubtful = _foretold((before, a, b), triples) and hopped(locator, a, b)
    for x, which, depth in cuts:
        if x <= a.s and not behind:
            continue
        searched = here if x > a.s else behind
        if which in (0, -1) and _touches(searched[0], searched[-1]):
            continue
        turn = _turning_point(locator, segments, which, x)
        if turn is not None:
            knots = here if turn.problem is a.problem and turn.s > a.s else behind
            knots.append(turn)
            knots.sort(key=lambda q: q.s)
        elif depth < 0 and x > a.s and len(here) == 2:
            doubtful = True
    found: list[Found] = []
    for knots in (behind if len(behind) > 2 else [], here):
        for p, q in pairwise(knots):
            found += [shown(f) for f in locator.resolve(p, q)]
    return found, doubtful and not found


def _foretold(points: tuple[Point, Point, Point], triples: list[Triple]) -> bool:
    """Whether a real value that came down toward the limit should have passed it, or almost, and has not.

    Going on as between the first two it changes sign before the third, or it is far smaller than `stepping.room` lets
    it become. Multipliers: those at +1, for at -1 no branches of one problem cross.
    At a fold the value nearest to the limit vanishes with the parameter's rate: there only their ratio tells of a
    branch point. The ratios of others tell nothing.
    """
    r0, r1, r2 = (abs(p.tangent.parameter) for p in points)
    if not points[2].step > 0 < points[1].step or not (r0 and r1 and r2):
        return False
    if points[1].problem.critical.circle:
        triples = [t for t in triples if t[1].real > 0.0]
    values = growth_of(points, -1, triples)
    least = min((abs(y1) for _, y1, _ in values), default=0.0)
    further = points[2].step / points[1].step
    for y0, y1, y2 in values:
        if not (y0 * y1 > 0 and y1 * y2 > 0):
            continue
        at_fold = abs(y1) == least and _comes_down(y0 / r0, y1 / r1, y2 / r2, further)
        if at_fold or _comes_down(y0, y1, y2, further):
            return True
    return False


def _touches(p: Point, q: Point) -> bool:
    """Whether a fold and a branch point between p and q explain that a value came to +1 (or 0) and went back.

    Where a pitchfork is met on its own side branch both are one point, and no step near it may end on it.
    """
    change = changes(p, q)
    return change.fold and change.branch


def _comes_down(before: float, now: float, then: float, further: float) -> bool:
    """Whether the line through two numbers of one sign changes it before the third, or that is far smaller."""
    ahead = now + (now - before) * further
    return ahead * now < 0 or abs(then) < _SUDDEN * abs(now)


def hopped(locator: Locator, a: Point, b: Point) -> bool:
    """Whether a branch point lies between a and b though the determinant kept its sign: b is on another branch."""
    return locator.attempt(Kind.BRANCH_POINT, a, b) is not None


def _tests(b: Point) -> list[int]:
    """Test functions to watch for dips; -1 and -2 stand for single real and complex values.

    The products of many values dip wherever a pair inside the limit turns past +1 or -1: single values tell more.
    """
    if not b.spectrum.values.size:
        return [3]
    if b.spectrum.values.size > _MANY:
        return [3, -1, -2]
    return [3, 0, -1, -2] + [1] * (b.problem.critical.minus is not None)


def _turning_point(locator: Locator, segments: list[tuple[Point, ...]], which: int, x: float) -> Point | None:
    """Minimise the test over neighbouring segments by parabolas: a point where it has crossed zero, or None."""
    known = [segments[0][0], *(ends[1] for ends in segments)]
    for _ in range(20):
        a, b = next((ends for ends in segments if x <= ends[1].s), segments[-1])
        new = _inside(locator, a, b, x)
        if new is None or min(abs(new.s - p.s) for p in known) < 1e-9:
            return None
        known.append(new)
        known.sort(key=lambda p: p.s)
        triples = [(known[i - 1], known[i], known[i + 1]) for i in range(1, len(known) - 1)]
        beside = [three for three in triples if any(p is new for p in three)]
        if any(crossed(three, which) for three in [(a, new, b), *beside]):
            return new
        dips = [(dip, three) for three in triples if (dip := dip_of(three, which)) is not None]
        if not dips:
            return None
        dip, three = min(dips, key=lambda pair: pair[0].depth)
        x = dip.at
        nearest = min(known, key=lambda p: abs(p.s - x))
        if abs(x - nearest.s) < 0.1 * dip.width:
            if three[2].s - three[0].s < 8 * dip.width:
                return None  # the minimum is sampled closely, and it is not zero
            side = 1 if three[2].s - nearest.s > nearest.s - three[0].s else -1
            x = nearest.s + side * 2 * dip.width
    return None


def _inside(locator: Locator, a: Point, b: Point, s: float) -> Point | None:
    """The point of the curve near arclength s, kept off the ends of the segment."""
    width = b.s - a.s
    return locator.on_curve(a, b, min(0.995, max(0.005, (s - a.s) / width))) if width > 0 else None
