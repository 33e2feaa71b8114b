r"""Zeros of functions that a problem itself wants watched: points of codimension two on curves of special points.

A problem may have ``monitors``, a tuple of (kind, function of a point), and ``confirmed(kind, point, scale)``, which
names a located zero or says that it is none (a pole, a neutral saddle). Zeros are found by Illinois iteration along the
curve between neighbouring points, as for a user's events, instead of the driver's own events: such a curve has neither
counts nor defining systems of its own. Where a function has an ``exact`` companion, that one is used to locate.

Two zeros within a step leave the signs at its ends as they were. A function g that is the derivative along the curve of
its companion ``primitive``, G, is there the parabola with the values g(0), g(1) and the mean G(1) - G(0); any other one
the parabola through the point before as well. Where that has changed sign in between, the curve is looked at there.
Where the curve itself branches, `crossings` finds. Problems without monitors cost nothing here.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from ..words import Kind
from .crossings import crossing, interpolated_zero
from .locating import Found, Locator
from .points import Point

__all__ = ["Monitor"]

_POLE = 1e3  # a function that becomes so much larger than at both ends has no zero there


class Monitor:
    """Watches the functions of one side of a branch; remembers their values at the last point."""

    def __init__(self, first: Point) -> None:
        self.values = [function(first) for _, function in getattr(first.problem, "monitors", ())]
        self._older: list[tuple[float, float] | None] = [None] * len(self.values)  # (arclength, value) before that
        self._answer: tuple[object, Any] = (None, None)

    @property
    def alone(self) -> bool:
        """Whether the problem's own functions are all there is to watch."""
        return bool(self.values)

    def zeros(self, locator: Locator, knots: list[Point]) -> list[Found]:
        """Zeros between neighbouring knots, all on one mesh; the first knot's values are those remembered."""
        found: list[Found] = []
        problem = knots[0].problem
        for k, (kind, function) in enumerate(getattr(problem, "monitors", ())):
            values = [self.values[k], *(function(p) for p in knots[1:])]
            exact = getattr(function, "exact", function)
            passed = list(zip(knots, values))
            for (p, gp), (q, gq) in self._divided(locator, function, passed, k):
                if gq != 0 and not gp * gq < 0:
                    continue
                # a knot may lie on the zero itself: the middle of a segment that is symmetric about it
                point = q if gq == 0 else _located(locator, p, q, exact, (gp, gq))
                named = _named(kind, point, p, q, max(abs(gp), abs(gq)))
                # two functions may vanish at one point: both rates do at a cusp
                found += [f for f in named if all(f.kind is not g.kind or f.bracket != g.bracket for g in found)]
            self.values[k], self._older[k] = values[-1], (knots[-2].s, values[-2])
        return found + self._crossings(locator, knots)

    def _divided(
        self, locator: Locator, function: Any, passed: list[tuple[Point, float]], k: int
    ) -> list[tuple[tuple[Point, float], tuple[Point, float]]]:
        """Neighbouring (knot, value), with a point between two of one sign where the function has another one there."""
        pairs = []
        before = self._older[k]
        for one, other in pairwise(passed):
            x = _dip(one, other, getattr(function, "primitive", None), before)
            middle = None if x is None else locator.on_curve(one[0], other[0], x)
            value = 0.0 if middle is None else function(middle)
            inside = [] if middle is None or not value * one[1] < 0 else [(middle, value)]
            pairs += list(pairwise([one, *inside, other]))
            before = (one[0].s, one[1])
        return pairs

    def _crossings(self, locator: Locator, knots: list[Point]) -> list[Found]:
        response, found = getattr(knots[0].problem, "response", None), []
        if response is None:
            return []
        answer = self._answer[1] if self._answer[0] is knots[0].u else response(knots[0])
        for p, q in pairwise(knots):
            after = response(q)
            if answer is not None and after is not None and float(answer @ after) < 0:
                at = crossing(locator, p, q, answer, after)
                found += [] if at is None else [at]
            answer = after
        self._answer = (knots[-1].u, answer)
        return found


def _dip(
    one: tuple[Point, float], other: tuple[Point, float], primitive: Any, before: tuple[float, float] | None
) -> float | None:
    """Fraction of the segment at which a function of one sign at its ends is expected to have the other one."""
    (p, gp), (q, gq) = one, other
    h = q.s - p.s
    if not (gp * gq > 0 and h > 0):
        return None
    if primitive is not None:
        bend = 3 * (gp + gq) - 6 * (primitive(q) - primitive(p)) / h
    elif before is not None and before[0] < p.s:
        bend = ((gq - gp) / h - (gp - before[1]) / (p.s - before[0])) / (q.s - before[0]) * h * h
    else:
        return None
    slope = gq - gp - bend
    x = -0.5 * slope / bend if bend else -1.0
    return x if 0 < x < 1 and (gp + 0.5 * slope * x) * gp < 0 else None


def _located(locator: Locator, p: Point, q: Point, function: Any, ends: tuple[float, float]) -> Point | None:
    """The zero between p and q; by interpolation where the curve is singular there. None at a pole."""
    largest, pole = _POLE * max(map(abs, ends)), False

    def guarded(z: Point) -> float:
        nonlocal pole
        value = float(function(z))
        pole = pole or abs(value) > largest
        return math.nan if pole else value

    point = locator.zero(p, q, guarded, *ends)
    if point is None and not pole and hasattr(p.problem, "residual_at"):
        made = interpolated_zero(locator, p, q, function, ends)
        point = None if made is None else made[0]
    return point


def _named(kind: Kind, point: Point | None, p: Point, q: Point, scale: float) -> list[Found]:
    """The event at a located zero, if the problem confirms it."""
    if point is None:
        return []
    named = point.problem.confirmed(kind, point, scale)  # type: ignore[attr-defined]
    return [] if named is None else [Found(point, named, (p.parameter, q.parameter), abs(q.s - p.s) * 1e-13)]
