r"""What happened between two neighbouring points: integer counts, two signs, and dips that neither shows.

Between points A and B (same mesh) compare: the sign of the parameter's tangent (fold), the sign of the bordered
determinant (branch point), the number of real values beyond +1 and -1, of pairs outside, and of all unstable ones.
det F_u = (determinant) x (tangent component) up to a positive factor, so the parity of the values beyond +1 changes at
folds and branch points only; the parity of those beyond -1 only at period doublings; what then remains of the change in
the unstable count are pairs. A step with one such event is *elementary*; any other is divided further.

In-and-out changes leave all integers unchanged. They are suspected where the parabola through three neighbours of a
smooth test function (`points.smooth_tests`) reaches zero, or nearly, between them, and where the cubic Hermite
interpolant of the parameter turns twice inside a step (two folds).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..words import Kind
from .points import Point

__all__ = ["Changes", "changes", "double_turn", "parabola_dip"]


class Changes(NamedTuple):
    """What the integers say happened between two points."""

    fold: bool
    branch: bool
    beyond_plus: int
    beyond_minus: int
    pairs: int
    unstable: int
    known: bool  # False for problems without a spectrum: signs only

    @property
    def nothing(self) -> bool:
        """No event at all (values that collide inside or outside the circle are none)."""
        odd = self.known and (self.beyond_plus % 2 != (self.fold != self.branch))
        return not (self.fold or self.branch or self.unstable or self.beyond_minus % 2 or odd)

    def suspects(self, pair: Kind | None, minus: bool) -> list[Kind]:
        """The kinds to look for, each once."""
        kinds = [Kind.FOLD] * self.fold + [Kind.BRANCH_POINT] * self.branch
        if minus and self.beyond_minus % 2:
            kinds.append(Kind.PERIOD_DOUBLING)
        reals = len(kinds)
        if pair is not None and (abs(self.unstable) > reals or (abs(self.unstable) - reals) % 2):
            kinds.append(pair)
        return kinds

    def explained(self, kinds: list[Kind]) -> bool:
        """Whether events of these kinds, each once, can make these changes."""
        if not self.known:
            return (Kind.FOLD in kinds) == self.fold and (Kind.BRANCH_POINT in kinds) == self.branch
        reals = sum(k in (Kind.FOLD, Kind.BRANCH_POINT, Kind.PERIOD_DOUBLING) for k in kinds)
        pairs = sum(k in (Kind.HOPF, Kind.NEIMARK_SACKER) for k in kinds)
        reach = reals + 2 * pairs
        return (
            abs(self.unstable) <= reach
            and (self.unstable - reach) % 2 == 0
            and (reach == 0 or abs(self.unstable) > 0 or reals > 1)
            and self.beyond_minus % 2 == kinds.count(Kind.PERIOD_DOUBLING) % 2
            and self.beyond_plus % 2 == (kinds.count(Kind.FOLD) + kinds.count(Kind.BRANCH_POINT)) % 2
        )


def changes(a: Point, b: Point) -> Changes:
    """Compare neighbours; a zero tangent component or determinant (a point exactly at an event) is no change."""
    x, y = a.spectrum, b.spectrum
    return Changes(
        a.tangent.parameter * b.tangent.parameter < 0,
        a.determinant_sign * b.determinant_sign < 0,
        y.beyond_plus - x.beyond_plus,
        y.beyond_minus - x.beyond_minus,
        y.pairs - x.pairs,
        y.unstable - x.unstable,
        x.values.size > 0,
    )


def supported(a: Point, b: Point) -> bool:
    """False where the change of counts is within the error of the values at both ends (noise on the limit)."""
    ends = []
    for p in (a, b):
        values = p.spectrum.values
        if not values.size:
            return True
        gap = abs(abs(values) - 1.0) if p.problem.critical.circle else abs(values.real)
        ends.append(float(gap.min()) > p.spectrum.error)
    return any(ends)


def double_turn(a: Point, b: Point) -> float | None:
    """Arclength where the parameter's rate is extreme inside a step whose cubic interpolant turns twice; else None.

    With chord h and rates r0, r1 the cubic's rate is r0 (1-x)(1-3x) + 6 x (1-x) D + r1 x (3x-2), D = (l1 - l0)/h.
    """
    r0, r1, h = a.tangent.parameter, b.tangent.parameter, b.step
    if r0 * r1 <= 0 or h <= 0:
        return None
    mean = (b.parameter - a.parameter) / h
    curvature = 3 * (r0 + r1) - 6 * mean
    if curvature == 0:
        return None
    x = (2 * r0 + r1 - 3 * mean) / curvature
    if not 0 < x < 1:
        return None
    rate = r0 * (1 - x) * (1 - 3 * x) + 6 * x * (1 - x) * mean + r1 * x * (3 * x - 2)
    return a.s + x * h if rate * r0 <= 0.02 * r0 * r0 else None


def parabola_dip(points: tuple[Point, Point, Point], which: int) -> tuple[float, float] | None:
    """(arclength, depth) of the vertex of a test function near zero between three neighbours of equal sign; else None.

    depth is the vertex value over the smaller neighbour: negative where the parabola crosses zero.
    """
    (x0, x1, x2), (y0, y1, y2) = (p.s for p in points), (p.tests[which] for p in points)
    if not (y0 * y1 > 0 and y1 * y2 > 0 and x0 < x1 < x2):
        return None
    first, second = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
    bend = (second - first) / (x2 - x0)
    if bend * y1 <= 0:  # the parabola opens away from zero
        return None
    x = 0.5 * (x0 + x1) - first / (2 * bend)
    if not x0 < x < x2:
        return None
    value = y0 + first * (x - x0) + bend * (x - x0) * (x - x1)
    depth = value / math.copysign(min(abs(y0), abs(y1), abs(y2)), y1)
    return x, depth
