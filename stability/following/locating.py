r"""From "something happened between A and B" to located points.

A fold or a period doubling that is alone in its segment is found by a few points of the curve (`narrowing`). Every
other suspected kind is located by Newton on its defining system (`problems.defining`), started on the cubic Hermite
interpolant of the segment where the secant of the test function vanishes. A located point counts if it lies on the
segment and shows its own signature (tangent, multiplier at the limit, cos theta inside (-1, 1), omega^2 > 0: a real
pair with product one is a neutral saddle, no Neimark-Sacker point). If the located points together explain the change
of the integers, the segment is done; otherwise it is halved on the curve. A change that survives to the smallest width
is reported as UNEXPLAINED, in the middle of its bracket.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..problems.defining import Located, locate
from ..protocols import Tangent
from ..words import Kind
from .events import Changes, changes, supported, turns
from .narrowing import narrowed
from .points import Point, dot, make_point, smooth_tests, tangent_of

__all__ = ["Found", "Locator", "hermite", "shown"]

Array = NDArray[np.float64]
_PAIRS = (Kind.HOPF, Kind.NEIMARK_SACKER)
_AMBIGUOUS = 10  # halvings after which the simplest explanation of a change is taken
_EDGE = 1e-6  # how far outside its bracket, in units of the bracket, a located point may lie
_TURN = 0.05  # longest segment in which a turn is taken for a part of a branch point
_ONE_PLACE = 2e-4  # scaled distance below which a fold and a branch point of one parameter value are one
_UNFOLDING = 1e-10  # a perturbed crossing is no branch point: its unfolding parameter is not zero,
_IMPERFECT = 1e-6  # unless it is smaller than the error of the discretisation (and this), which unfolds as well
_SIGNATURE = 1e-5  # how close to the limit the critical value of a located point must be


class Found(NamedTuple):
    """A located event: its point, its kind, the parameter values that bracket it, the Newton accuracy, a name.

    breaking: a branch point at which the orbits' symmetry is lost, located as a -1 of the half-period map.
    """

    point: Point
    kind: Kind
    bracket: tuple[float, float]
    accuracy: float
    name: str = ""
    breaking: bool = False


def shown(found: Found) -> Found:
    """As the whole orbit sees it: -1 of the half-period map of a symmetric orbit is a +1, a branch point."""
    if found.kind is Kind.PERIOD_DOUBLING and getattr(found.point.problem, "halved", False):
        return found._replace(kind=Kind.BRANCH_POINT, breaking=True)
    return found


def hermite(a: Point, b: Point, x: float) -> tuple[Array, float]:
    """(u, parameter) of the cubic Hermite interpolant at the fraction x of the segment."""
    h = chord_length(a, b)
    one = 1 - x
    c0, c1 = (1 + 2 * x) * one * one, x * x * (3 - 2 * x)
    d0, d1 = h * x * one * one, -h * x * x * one
    u = c0 * a.u + c1 * b.u + d0 * a.tangent.u + d1 * b.tangent.u
    parameter = c0 * a.parameter + c1 * b.parameter + d0 * a.tangent.parameter + d1 * b.tangent.parameter
    return u, parameter


def chord_length(a: Point, b: Point) -> float:
    """|z_b - z_a| in the weighted norm."""
    du, dl = b.u - a.u, (b.parameter - a.parameter) * a.tangent.weight
    return math.sqrt(dot(a.problem.weights, du, du) + dl * dl)


def fraction(a: Point, b: Point, u: Array, parameter: float) -> float:
    """Where (u, parameter) projects onto the segment, along the tangent of its older end: 0 at a, 1 at b."""
    wt, tl = a.problem.weights * a.tangent.u, a.tangent.parameter * a.tangent.weight**2
    whole = float(wt @ (b.u - a.u)) + tl * (b.parameter - a.parameter)
    part = float(wt @ (u - a.u)) + tl * (parameter - a.parameter)
    return part / whole if whole else math.nan


class Locator:
    """Locates events between neighbouring points of one branch (same mesh at both ends)."""

    def __init__(self, free: str, index: int, tolerance: float, smallest: float) -> None:
        self.free, self.k, self.tolerance, self.smallest = free, index, tolerance, smallest

    # ------------------------------------------------------------------ points on the curve
    def on_curve(self, a: Point, b: Point, x: float) -> Point | None:
        """The point of the branch at the fraction x, corrected orthogonally to the older tangent."""
        u, parameter = hermite(a, b, x)
        params = a.params.copy()
        params[self.k] = parameter
        found = a.problem.correct(u, params, self.free, a.tangent, 0.0, self.tolerance)
        if not found.converged or found.tangent is None:
            return None
        where = fraction(a, b, found.u, float(found.params[self.k]))
        if not -_EDGE <= where <= 1 + _EDGE:
            return None
        return make_point(a.problem, found, found.tangent, self.k, a.s + where * (b.s - a.s), where * b.step)

    def at_parameter(self, a: Point, b: Point, value: float) -> Point | None:
        """The point with parameter == value between a and b (monotone there), solved at fixed parameter."""
        x = _secant(a.parameter - value, b.parameter - value)
        for _ in range(3):
            u, parameter = hermite(a, b, x)
            slope = (hermite(a, b, x + 1e-6)[1] - parameter) / 1e-6
            if not slope:
                break
            x = min(1.0, max(0.0, x - (parameter - value) / slope))
        u, _ = hermite(a, b, x)
        params = a.params.copy()
        params[self.k] = value
        found = a.problem.correct(u, params, self.free, None, 0.0, self.tolerance)
        if not found.converged or found.tangent is None:
            return None
        where = fraction(a, b, found.u, value)
        if not -1e-3 <= where <= 1 + 1e-3:
            return None
        near = _mean_direction(a, b)
        tangent = _oriented(a, found.tangent, near)
        return make_point(a.problem, found, tangent, self.k, a.s + min(1, max(0, where)) * (b.s - a.s), b.step)

    def zero(self, a: Point, b: Point, g: Callable[[Point], float], ga: float, gb: float) -> Point | None:
        """Where a function of the solution vanishes between a and b: Illinois iteration along the curve.

        None where the curve or the function is lost on the way.
        """
        x0, x1, side, best = 0.0, 1.0, 0, None
        for _ in range(80):
            x = (x0 * gb - x1 * ga) / (gb - ga)
            best = self.on_curve(a, b, x)
            if best is None:
                return None
            gx = g(best)
            if math.isnan(gx):
                return None
            if gx == 0 or x1 - x0 < 1e-14:
                break
            if gx * ga > 0:
                settled, x0, ga = abs(x - x0), x, gx
                gb *= 0.5 if side < 0 else 1.0
                side = -1
            else:
                settled, x1, gb = abs(x - x1), x, gx
                ga *= 0.5 if side > 0 else 1.0
                side = 1
            if settled < 1e-13:
                break
        return best

    # ------------------------------------------------------------------ events from counts
    def resolve(self, a: Point, b: Point, level: int = 0) -> list[Found]:
        """All events between a and b, in order along the branch."""
        change = changes(a, b)
        if not supported(a, b):
            if not change.fold:
                return []
            change = Changes(True, False, 0, 0, 0, 0, False)  # of the signs only that of the parameter's rate counts
        fine = level >= _AMBIGUOUS
        if change.nothing and (fine or not change.collision):
            return []
        critical = a.problem.critical
        kinds = change.suspects(critical.pair, critical.minus is not None)
        alone = self._alone(kinds[0], a, b) if len(kinds) == 1 and change.is_one(kinds[0]) else None
        if alone is not None:
            return [alone]
        located = [f for f in (self.attempt(kind, a, b) for kind in kinds) if f is not None]
        if _is_turning_crossing(change, located, chord_length(a, b)) or self._turns_at_crossing(a, b, change, located):
            located = [f for f in located if f.kind is not Kind.FOLD]
            if len(located) == 1 and not change.collision:
                return located
        located.sort(key=lambda f: f.point.s)
        if located and self._separate(a, b, located):
            return located
        if fine and located and change.explained([f.kind for f in located]):
            return located
        middle = None
        if level < 60 and chord_length(a, b) > self.smallest:
            middle = next((m for m in (self.on_curve(a, b, x) for x in (0.5, 0.41, 0.63)) if m is not None), None)
        if middle is None:
            return [] if change.nothing else self._leftover(a, b, change)
        return self.resolve(a, middle, level + 1) + self.resolve(middle, b, level + 1)

    def _alone(self, kind: Kind, a: Point, b: Point) -> Found | None:
        """A fold or a period doubling that is the one event between a and b; None where it is not found quickly."""
        whole = a.problem.critical.circle and not getattr(a.problem, "own", 0)  # no trivial multiplier to take out
        if not (kind is Kind.FOLD or (kind is Kind.PERIOD_DOUBLING and whole)):
            return None
        made = narrowed(kind, a, b, self.free, self.k, min(1e-11, self.tolerance))
        if made is None or not _shows(kind, made[0]):
            return None
        return Found(made[0], kind, (a.parameter, b.parameter), made[1])

    def _turns_at_crossing(self, a: Point, b: Point, change: Changes, located: list[Found]) -> bool:
        """Whether only a branch point could be located where the parameter turns too, and the turn is right there.

        A pitchfork met on its own side branch: outside a small part of the segment around it nothing happens, and in it
        the rate of the parameter vanishes where the point is.
        """
        if not (change.fold and change.branch and [f.kind for f in located] == [Kind.BRANCH_POINT]):
            return False
        crossing = located[0].point
        x = (crossing.s - a.s) / (b.s - a.s) if b.s > a.s else math.nan
        if not 0 < x < 1 or chord_length(a, b) > _TURN:
            return False
        p, q = (self.on_curve(a, b, y) for y in (max(x - 0.1, x / 2), min(x + 0.1, (1 + x) / 2)))
        if p is None or q is None or not (changes(a, p).nothing and changes(q, b).nothing and turns(p, q)):
            return False
        zero = p.s + (q.s - p.s) * p.tangent.parameter / (p.tangent.parameter - q.tangent.parameter)
        return abs(zero - crossing.s) < 0.1 * (q.s - p.s)

    def _separate(self, a: Point, b: Point, located: list[Found]) -> bool:
        """Whether the changes between points taken midway between the located events are one event each."""
        ends = [a]
        for f, g in pairwise(located):
            x = (0.5 * (f.point.s + g.point.s) - a.s) / (b.s - a.s) if b.s > a.s else math.nan
            middle = self.on_curve(a, b, x) if math.isfinite(x) else None
            if middle is None or not f.point.s < middle.s < g.point.s:
                return False
            ends.append(middle)
        ends.append(b)
        return all(changes(p, q).is_one(f.kind) for (p, q), f in zip(pairwise(ends), located))

    def _leftover(self, a: Point, b: Point, change: Changes) -> list[Found]:
        """At the smallest width: what can be located at all, else one UNEXPLAINED point."""
        critical = a.problem.critical
        kinds = change.suspects(critical.pair, critical.minus is not None)
        located = [f for f in (self.attempt(kind, a, b, edge=1e3) for kind in kinds) if f is not None]
        if change.fold and change.branch and any(f.kind is Kind.BRANCH_POINT for f in located):
            return [f for f in located if f.kind is not Kind.FOLD]
        if located and change.explained([f.kind for f in located]):
            return located
        point = self.on_curve(a, b, 0.5) or b
        bracket = (a.parameter, b.parameter)
        if change.fold and not change.unstable and not change.branch:
            # a corner of a piecewise smooth curve: the parameter turns without a rate
            return [Found(point, Kind.FOLD, bracket, chord_length(a, b))]
        return [Found(point, Kind.UNEXPLAINED, bracket, chord_length(a, b))]

    def attempt(self, kind: Kind, a: Point, b: Point, edge: float = _EDGE) -> Found | None:
        """Newton on the defining system of `kind`; None unless it ends on the segment with its own signature."""
        x = _first_fraction(kind, a, b)
        u, parameter = hermite(a, b, x)
        params = a.params.copy()
        params[self.k] = parameter
        length = chord_length(a, b)
        values = (a if x < 0.5 else b).spectrum.values
        if kind in _PAIRS and not (values.imag > 0).any():
            values = (b if x < 0.5 else a).spectrum.values
        radius = 2 * length * max(1.0, edge)
        located = locate(
            a.problem, kind, u, params, self.free, a.tangent.weight, values, radius=radius,
            tolerance=min(1e-11, self.tolerance),
        )
        if not located.converged:
            return None
        where = fraction(a, b, located.u, float(located.params[self.k]))
        if not -edge <= where <= 1 + edge:
            return None
        point = self._point_at(kind, located, a, b, where)
        if point is None or not _signature(kind, located, point):
            return None
        return Found(point, kind, (a.parameter, b.parameter), located.accuracy)

    def _point_at(self, kind: Kind, located: Located, a: Point, b: Point, where: float) -> Point | None:
        problem, near = a.problem, _mean_direction(a, b)
        L = problem.linearise(located.u, located.params)
        spectrum = problem.spectrum(L)
        weight = a.tangent.weight
        tangent: Tangent | None
        if kind is Kind.BRANCH_POINT:
            tangent = _projected(problem.weights, L, self.free, located.right, near, weight)
        else:
            tangent = tangent_of(problem, L, self.free, near, weight)
        if tangent is None:
            return None
        tests = smooth_tests(spectrum.values, problem.critical.circle)
        scaled = getattr(L, "size_of_residual", None)
        residual = float(np.max(np.abs(L.residual))) if scaled is None else float(scaled)
        s = a.s + min(1.0, max(0.0, where)) * (b.s - a.s)
        parameter = float(located.params[self.k])
        return Point(
            problem, located.u, located.params, parameter, tangent, spectrum, tests, 0, residual, located.iterations,
            s, where * b.step,
        )


def _is_turning_crossing(change: Changes, located: list[Found], length: float) -> bool:
    """A pitchfork met on its own side branch: the parameter turns and the determinant vanishes at one point.

    The branch is vertical in the parameter there. The fold's own system is singular at such a point: it may be found
    less accurately, or not at all.
    """
    if not (change.fold and change.branch):
        return False
    places = {f.kind: f.point for f in located}
    crossing, fold = places.get(Kind.BRANCH_POINT), places.get(Kind.FOLD)
    if crossing is None:
        return False
    weight = crossing.tangent.weight
    if fold is None:
        return length < _ONE_PLACE and abs(crossing.tangent.parameter) * weight < 1e-3
    gap = abs(fold.s - crossing.s)
    return abs(fold.parameter - crossing.parameter) * weight < 1e-8 and gap < min(_ONE_PLACE, 0.1 * length + 1e-7)


def _secant(ga: float, gb: float) -> float:
    """Fraction where the line from ga to gb vanishes, kept inside the segment."""
    x = ga / (ga - gb) if ga != gb and math.isfinite(ga) and math.isfinite(gb) else 0.5
    return min(0.95, max(0.05, x))


def _first_fraction(kind: Kind, a: Point, b: Point) -> float:
    """Where to start: the secant root of the kind's own test function."""
    if kind is Kind.FOLD:
        return _secant(a.tangent.parameter, b.tangent.parameter)
    if kind is Kind.BRANCH_POINT:
        ends = [p.tests[0] / p.tangent.parameter if p.tangent.parameter else math.nan for p in (a, b)]
        return _secant(*ends) if ends[0] * ends[1] < 0 else 0.5
    if kind is Kind.PERIOD_DOUBLING:
        return _secant(a.tests[1], b.tests[1]) if a.tests[1] * b.tests[1] < 0 else 0.5
    return _secant(a.tests[2], b.tests[2]) if a.tests[2] * b.tests[2] < 0 else 0.5


def _mean_direction(a: Point, b: Point) -> tuple[Array, float]:
    return a.tangent.u + b.tangent.u, a.tangent.parameter + b.tangent.parameter


def _oriented(a: Point, slope: Tangent, near: tuple[Array, float]) -> Tangent:
    """The slope du/dlambda of a fixed-parameter solve as a unit tangent on the side of `near`."""
    w, weight = a.problem.weights, a.tangent.weight
    length = math.sqrt(dot(w, slope.u, slope.u) + (slope.parameter * weight) ** 2)
    if dot(w, slope.u, near[0]) + slope.parameter * near[1] * weight**2 < 0:
        length = -length
    return Tangent(slope.u / length, slope.parameter / length, weight)


def _projected(
    w: Array, L: object, free: str, right: NDArray[np.float64], near: tuple[Array, float], weight: float
) -> Tangent | None:
    """The direction in the two-dimensional null space at a branch point that is closest to `near`."""
    z = [(np.real(L.lift(v, free)), float(np.real(v[-1]))) for v in np.real(right).T]  # type: ignore[attr-defined]

    def product(p: tuple[Array, float], q: tuple[Array, float]) -> float:
        return dot(w, p[0], q[0]) + weight**2 * p[1] * q[1]

    gram = np.array([[product(p, q) for q in z] for p in z])
    scale = np.sqrt(np.diag(gram))
    if not (scale > 0).all():
        return None
    target = np.array([product(p, near) for p in z])
    try:
        c = np.linalg.solve(gram / np.outer(scale, scale), target / scale) / scale
    except np.linalg.LinAlgError:
        return None
    u, parameter = c[0] * z[0][0] + c[1] * z[1][0], float(c[0] * z[0][1] + c[1] * z[1][1])
    length = math.sqrt(product((u, parameter), (u, parameter)))
    return Tangent(u / length, parameter / length, weight) if length > 0 and math.isfinite(length) else None


def _shows(kind: Kind, point: Point) -> bool:
    """Whether a point is the fold or the period doubling it is taken for."""
    if kind is Kind.FOLD:
        return abs(point.tangent.parameter * point.tangent.weight) < 1e-4
    values = point.spectrum.values
    near = np.abs(values - (point.problem.critical.minus or 0.0))
    return bool(values.size) and float(near.min()) < _SIGNATURE + 100 * point.spectrum.error


def _signature(kind: Kind, located: Located, point: Point) -> bool:
    """Whether the located point is what its kind says."""
    if kind in (Kind.FOLD, Kind.PERIOD_DOUBLING):
        return _shows(kind, point)
    critical, values = point.problem.critical, point.spectrum.values
    allowed = _SIGNATURE + 100 * point.spectrum.error
    if kind is Kind.BRANCH_POINT:
        unfolding = abs(float(located.extra[0]))
        if unfolding < _UNFOLDING or unfolding > _IMPERFECT:
            return unfolding < _UNFOLDING
        return unfolding < point.problem.error(point.u, point.params)
    extra, paired = float(located.extra[0]), values[values.imag != 0]
    if not paired.size:
        return False
    if critical.circle:
        return abs(extra) < 1 - 1e-12 and bool(np.min(np.abs(np.abs(paired) - 1)) < allowed)
    size = float(np.max(np.abs(values)))
    return extra > (1e-8 * size) ** 2 and bool(np.min(np.abs(paired.real)) < allowed * size)
