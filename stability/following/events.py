r"""What happened between two neighbouring points: integer counts, two signs, and dips that neither shows.

Between points A and B (same mesh) compare: the sign of the parameter's tangent (fold), the sign of the bordered
determinant (branch point), the number of real values beyond +1 and -1, of pairs outside, and of all unstable ones.
det F_u = (determinant) x (tangent component) up to a positive factor, so the parity of the values beyond +1 changes at
folds and branch points only; the parity of those beyond -1 only at period doublings; what then remains of the change in
the unstable count are pairs. A step with one such event and nothing else is elementary; any other is divided further.

In-and-out changes leave all integers unchanged. They are suspected where the parabola through three neighbours of a
smooth test function (`points.smooth_tests`) reaches zero, or nearly, between them, and where the cubic Hermite
interpolant of the parameter turns twice inside a step (two folds).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..words import Kind
from .points import Point

__all__ = ["TURN", "Changes", "Dip", "changes", "crossed", "dip_of", "double_turn", "supported"]


_LOST = 0.1  # an error of multipliers (eigenvalues: relative to the largest) beyond which counts mean nothing
_FEW = 6
TURN = 0.02  # part of a rate of the parameter below which an extreme rate is looked at
_STILL = 1e-10  # a scaled rate of the parameter that is rounding


Triple = tuple[complex, complex, complex]


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
        """No event (values that merely collide inside or outside are none, see `collision`)."""
        odd = self.known and (self.beyond_plus % 2 != (self.fold != self.branch))
        return not (self.fold or self.branch or self.unstable or self.beyond_minus % 2 or odd)

    @property
    def collision(self) -> bool:
        """Real values became pairs or back, outside the limit; several events that cancel would look the same."""
        return bool(self.beyond_plus or self.beyond_minus or self.pairs)

    def suspects(self, pair: Kind | None, minus: bool) -> list[Kind]:
        """The kinds to look for, each once."""
        kinds = [Kind.FOLD] * self.fold + [Kind.BRANCH_POINT] * self.branch
        if minus and self.beyond_minus % 2:
            kinds.append(Kind.PERIOD_DOUBLING)
        if pair is not None and (self.pairs or abs(self.unstable) > len(kinds)):
            kinds.append(pair)
        return kinds

    def is_one(self, kind: Kind) -> bool:
        """Exactly one event of this kind, and no collision beside it."""
        signs = (self.fold, self.branch)
        integers = (abs(self.beyond_plus), abs(self.beyond_minus), abs(self.pairs))
        if kind is Kind.FOLD:
            return signs == (True, False) and (integers == (1, 0, 0) or not self.known)
        if kind is Kind.BRANCH_POINT:
            return signs == (False, True) and (integers == (1, 0, 0) or not self.known)
        return signs == (False, False) and integers == ((0, 1, 0) if kind is Kind.PERIOD_DOUBLING else (0, 0, 1))

    def explained(self, kinds: list[Kind]) -> bool:
        """Whether events of these kinds, with collisions beside them, can make these changes."""
        folds, branches = kinds.count(Kind.FOLD), kinds.count(Kind.BRANCH_POINT)
        if folds % 2 != self.fold or branches % 2 != self.branch:
            return False
        if not self.known:
            return True
        doublings = kinds.count(Kind.PERIOD_DOUBLING)
        reals = folds + branches + doublings
        reach = reals + 2 * (len(kinds) - reals)
        return (
            abs(self.unstable) <= reach
            and (self.unstable - reach) % 2 == 0
            and (reals > 0 or len(kinds) != 1 or abs(self.unstable) == 2)
            and self.beyond_minus % 2 == doublings % 2
            and self.beyond_plus % 2 == (folds + branches) % 2
        )


def changes(a: Point, b: Point) -> Changes:
    """Compare neighbours; a zero tangent component or determinant (a point exactly at an event) is no change."""
    x, y = a.spectrum, b.spectrum
    return Changes(
        turns(a, b),
        a.determinant_sign * b.determinant_sign < 0,
        y.beyond_plus - x.beyond_plus,
        y.beyond_minus - x.beyond_minus,
        y.pairs - x.pairs,
        y.unstable - x.unstable,
        x.values.size > 0,
    )


def supported(a: Point, b: Point) -> bool:
    """False where counts and determinants are noise: values known worse than their distance to the limit.

    Near a homoclinic orbit multipliers reach 1e15, and neither the others nor the determinant's sign mean anything.
    """
    near = False
    for p in (a, b):
        values, error = p.spectrum.values.tolist(), p.spectrum.error
        if not values:
            return True
        circle = p.problem.critical.circle
        if error > (_LOST if circle else _LOST * max(map(abs, values))):
            return False
        near = near or min(abs(abs(z) - 1.0) if circle else abs(z.real) for z in values) > error
    return near


def turns(a: Point, b: Point) -> bool:
    """Whether the parameter's rate changes sign by more than its rounding error."""
    weight = a.tangent.weight
    r0, r1 = a.tangent.parameter * weight, b.tangent.parameter * weight
    return r0 * r1 < 0 and max(abs(r0), abs(r1)) > _STILL


def double_turn(a: Point, b: Point) -> float | None:
    """Arclength where the parameter's rate is extreme inside a step whose cubic interpolant turns twice; else None.

    With chord h and rates r0, r1 the cubic's rate is r0 (1-x)(1-3x) + 6 x (1-x) D + r1 x (3x-2), D = (l1 - l0)/h.
    """
    r0, r1, h = a.tangent.parameter, b.tangent.parameter, b.step
    if r0 * r1 <= 0 or h <= 0 or abs(r0) * a.tangent.weight < _STILL:
        return None
    mean = (b.parameter - a.parameter) / h
    curvature = 3 * (r0 + r1) - 6 * mean
    if curvature == 0:
        return None
    x = (2 * r0 + r1 - 3 * mean) / curvature
    if not 0 < x < 1:
        return None
    rate = r0 * (1 - x) * (1 - 3 * x) + 6 * x * (1 - x) * mean + r1 * x * (3 * x - 2)
    return a.s + x * h if rate * r0 <= TURN * r0 * r0 else None


def test_value(p: Point, which: int) -> float:
    """Test function 0 plus, 1 minus, 2 pair (`points.smooth_tests`), 3 rate of the parameter."""
    return p.tests[which] if which < 3 else p.tangent.parameter


class Dip(NamedTuple):
    """Vertex of a parabola through three neighbours of equal sign, opening away from zero."""

    at: float
    depth: float  # value at the vertex over the second smallest of the three: negative where it crosses zero
    values: tuple[float, float, float]
    width: float  # distance from the vertex at which the parabola has twice the smallest of the three values


def vertex(at: tuple[float, float, float], values: tuple[float, float, float]) -> Dip | None:
    """The vertex, if it lies between the outer two; else None."""
    (x0, x1, x2), (y0, y1, y2) = at, values
    if not (y0 * y1 > 0 and y1 * y2 > 0 and x0 < x1 < x2):
        return None
    first, second = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
    bend = (second - first) / (x2 - x0)
    if bend * y1 <= 0:
        return None
    x = 0.5 * (x0 + x1) - first / (2 * bend)
    if not x0 < x < x2:
        return None
    value = y0 + first * (x - x0) + bend * (x - x0) * (x - x1)
    smallest, second, _ = sorted((abs(y0), abs(y1), abs(y2)))
    return Dip(x, value / math.copysign(second, y1), values, math.sqrt(smallest / abs(bend)))


def dip_of(points: tuple[Point, Point, Point], which: int, triples: list[Triple] | None = None) -> Dip | None:
    """The dip of a test function: 0 plus, 1 minus, 2 pair (`points.smooth_tests`), 3 rate of the parameter.

    -1, -2: the deepest dip of any single real, any complex value followed through the three (see `matched`); a value
    that goes out and comes back inside a step is smoother by itself than in a product with all the others. A real one
    that was complex is not: there only the products are smooth.
    """
    p, q, r = points
    at = (p.s, q.s, r.s)
    if which >= 0:
        return vertex(at, (_test(p, which), _test(q, which), _test(r, which)))
    deepest = None
    if which == -1:
        triples = [t for t in (matched(points) if triples is None else triples) if t[0].imag == t[2].imag == 0.0]
    for values in growth_of(points, which, triples):
        size = abs(values[1])
        dip = vertex(at, values) if size < abs(values[0]) or size < abs(values[2]) else None
        if dip is not None and (deepest is None or dip.depth < deepest.depth):
            deepest = dip
    return deepest


def _test(p: Point, which: int) -> float:
    return p.tests[which] if which < 3 else p.tangent.parameter


def growth_of(
    points: tuple[Point, Point, Point], which: int, triples: list[Triple] | None = None
) -> list[tuple[float, float, float]]:
    """Growth Re(lambda), or log|mu|, of the real (-1) or complex (-2) values of the middle point and their like.

    `triples` are `matched` values, where they are known already.
    """
    if triples is None:
        triples = matched(points)
    wanted = [t for t in triples if (t[1].imag == 0.0 if which == -1 else t[1].imag > 0.0)]
    if not points[0].problem.critical.circle:
        return [(x.real, y.real, z.real) for x, y, z in wanted]
    return [(_log(x), _log(y), _log(z)) for x, y, z in wanted]


def _log(z: complex) -> float:
    """log|z|, -inf for zero."""
    size = abs(z)
    return math.log(size) if size else -math.inf


def matched(points: tuple[Point, Point, Point]) -> list[Triple]:
    """Every value of the middle point between its partners: the nearest in the other two spectra, each used once.

    Where two values have the same nearest one, real values are matched in their order as well: one of both is right.
    """
    first, middle, last = (p.spectrum.values for p in points)
    if not first.size == middle.size == last.size:
        return []
    values = middle.tolist()
    (earlier, one), (later, other) = _partners(middle, values, first), _partners(middle, values, last)
    triples = list(zip(earlier, values, later))
    if one or other:
        triples += _in_order([first.tolist(), values, last.tolist()], points[0].problem.critical.circle)
    return triples


def _in_order(spectra: list[list[complex]], circle: bool) -> list[Triple]:
    """Real values (multipliers: of one sign) of three spectra in order of size, where there are equally many."""
    triples: list[Triple] = []
    for sign in (1.0, -1.0) if circle else (0.0,):
        rows = [sorted((z for z in row if z.imag == 0.0 and z.real * sign >= 0.0), key=abs) for row in spectra]
        if not circle:
            rows = [sorted(row, key=lambda z: z.real) for row in rows]
        if len(rows[0]) == len(rows[1]) == len(rows[2]):
            triples += list(zip(*rows))
    return triples


def _partners(
    middle: NDArray[np.complex128], values: list[complex], others: NDArray[np.complex128]
) -> tuple[list[complex], bool]:
    """For every value its partner (see `_assigned`), and whether two wanted the same; a few values seldom do."""
    listed = others.tolist()
    if len(values) > _FEW:
        return [listed[k] for k in _assigned(middle, others).tolist()], False
    chosen = []
    for value in values:
        least, place = math.inf, 0
        for k, other in enumerate(listed):
            gap = abs(value - other)
            if gap < least:
                least, place = gap, k
        chosen.append(place)
    clash = len(set(chosen)) < len(values)
    if clash:
        chosen = _assigned(middle, others).tolist()
    return [listed[k] for k in chosen], clash


def _assigned(values: NDArray[np.complex128], others: NDArray[np.complex128]) -> NDArray[np.int64]:
    """For every value the index of its partner: the nearest, or, where two want the same, the closest pairs first."""
    gap = np.abs(values[:, None] - others[None, :])
    nearest = gap.argmin(axis=1)
    if len(set(nearest.tolist())) == values.size:
        return nearest
    partner = np.full(values.size, -1)
    free = set(range(values.size))
    for flat in np.argsort(gap, axis=None).tolist():
        i, j = divmod(flat, values.size)
        if partner[i] < 0 and j in free:
            partner[i] = j
            free.remove(j)
    return partner


def crossed(points: tuple[Point, Point, Point], which: int) -> bool:
    """Whether the test function (-1, -2: a single value) has another sign at the middle point than at both ends."""
    if which >= 0:
        y0, y1, y2 = (_test(p, which) for p in points)
        return y0 * y1 < 0 and y1 * y2 < 0
    return any(y0 * y1 < 0 and y1 * y2 < 0 for y0, y1, y2 in growth_of(points, which))
