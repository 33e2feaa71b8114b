r"""How long a step may be: prediction, the checks a new point must pass, and the next length.

From the last point z_0 with unit tangent t_0 and the points before it, at arclengths s_1 > s_2 > .. back from it, the
predictor is the explicit Adams formula

    z = z_0 + int_0^h sum_i t_i l_i(s) ds,      l_i the Lagrange polynomials of 0, s_1, s_2, .. (four points at most),

corrected orthogonally to t_0. (Points and tangents together would give the same order from half as many points, but
an unstable recursion where Newton's method leaves a direction as predicted: the phase of an autonomous orbit.)
The new point z_1 with tangent t_1 is accepted if

    angle(t_0, t_1) <= ANGLE               the curve does not turn too far,
    angle(z_1 - z_0, t_0 + t_1) <= CHORD   chord and mean tangent agree: on a smooth curve they do to second order in h,
                                           where Newton has hopped onto a crossing or a neighbouring branch they do not,
    |z_1 - z| <= MISSED |z_1 - z_0|        nor do predictor and corrector,
    motion of the spectrum <= MOTION       Hausdorff distance of the two sets of values in the chordal metric.

The next length aims at half of each limit, at few Newton iterations, and not beyond the place where a value would
become critical (`room`). Kinks of a piecewise smooth system turn by a finite angle over any step: below ``KINK`` times
the longest step the angle is no longer an obstacle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .points import Point

__all__ = [
    "LIMITS", "ORDER", "PACE", "Comparison", "Steps", "adams_weights", "compare", "next_length", "predict",
    "spectral_motion",
]  # fmt: skip

Array = NDArray[np.float64]
ANGLE, CHORD, MISSED, MOTION, KINK = 0.6, 0.15, 0.2, 0.7, 1e-4
_FEW = 3
_APPROACH, _CREEP = 0.8, 0.1
_FAR, ORDER = 2.5, 4
LIMITS, PACE = (ANGLE, CHORD, MISSED, MOTION), (_FAR, float(_FEW), _APPROACH, _CREEP)
_GAUSS = 0.5 - 0.5 / math.sqrt(3)
_SMALL = 6
LIMITS = (ANGLE, CHORD, MISSED, MOTION)


@dataclass(frozen=True)
class Steps:
    """Lengths in the weighted norm: a full window of the parameter is 1, the scale of a state is 1."""

    first: float = 0.01
    longest: float = 0.2
    shortest: float = 1e-9


class Comparison(NamedTuple):
    """How far a new point is from the old one, each relative to its limit, and the distance itself."""

    distance: float
    angle: float
    chord: float
    missed: float
    motion: float
    following: float | None = None  # the next length, where it is known already
    quiet: bool = False  # nothing can have happened on the way
    rests: bool = False  # the mesh need not be adapted now

    @property
    def worst(self) -> float:
        """The largest ratio; above 1 the step is refused."""
        return max(self.angle, self.chord, self.missed, self.motion)

    @property
    def reason(self) -> str:
        """Which check the point fails, in words."""
        sentences = {
            "the curve turns by too much (a kink, or another curve)": self.angle,
            "chord and tangents disagree (a crossing or a neighbouring curve)": self.chord,
            "the corrector goes far from the prediction": self.missed,
            "multipliers or eigenvalues move by too much": self.motion,
        }
        return max(sentences, key=sentences.__getitem__)


def predict(last: Point, past: Sequence[Point], h: float) -> tuple[Array, float]:
    """(u, parameter) of the predictor; `past`, the points before, latest first, counts as far as it shares the mesh.

    Steps that differ too much end the past: extrapolation far beyond short steps, or from a long one, is of no use.
    """
    tangents, places = [last.tangent], [0.0]
    newer, reach = last, h
    for point in past[: ORDER - 1]:
        if point.problem is not last.problem or not newer.step > 0 or (reach > _FAR * newer.step and len(places) > 1):
            break
        places.append(places[-1] - newer.step)
        tangents.append(point.tangent)
        newer, reach = point, newer.step
        if h > _FAR * last.step:
            break
    u, parameter = last.u.copy(), last.parameter
    for weight, t in zip(adams_weights(places, h), tangents):
        u += weight * t.u
        parameter += weight * t.parameter
    return u, parameter


def adams_weights(places: Sequence[float], h: float) -> list[float]:
    """int_0^h l_i(s) ds of the Lagrange polynomials of at most four `places`, by Gauss quadrature with two points.

    >>> adams_weights([0.0, -1.0], 1.0)
    [1.5, -0.5]
    """
    half, first, second = 0.5 * h, _GAUSS * h, (1 - _GAUSS) * h
    weights = []
    for x in places:
        p = q = half
        for y in places:
            if y != x:
                p *= (first - y) / (x - y)
                q *= (second - y) / (x - y)
        weights.append(p + q)
    return weights


def spectral_motion(a: NDArray[np.complex128], b: NDArray[np.complex128], circle: bool, rate: float = 0.0) -> float:
    """Hausdorff distance of two spectra: multipliers on the Riemann sphere, eigenvalues relative to their size.

    `rate` is the largest modulus met on the branch: eigenvalues far below it may move by a tenth of it.

    >>> round(spectral_motion(np.array([1.0 + 0j]), np.array([1.1 + 0j]), True), 3)
    0.048
    """
    if not a.size or not b.size:
        return 0.0
    if circle and a.size <= _SMALL:
        return _motion_on_sphere(a.tolist(), b.tolist())
    gap = np.abs(a[:, None] - b[None, :])
    if circle:
        gap /= np.sqrt(np.multiply.outer(1 + np.abs(a) ** 2, 1 + np.abs(b) ** 2))
    else:
        gap /= 1e-300 + np.maximum.outer(np.abs(a), np.abs(b)) + 0.1 * max(rate, float(np.abs(b).max()))
    return float(max(gap.min(axis=1).max(), gap.min(axis=0).max()))


def _motion_on_sphere(a: list[complex], b: list[complex]) -> float:
    """The chordal Hausdorff distance of few multipliers."""
    stretch = [1 + abs(y) ** 2 for y in b]
    nearest, worst = [math.inf] * len(b), 0.0
    for x in a:
        size, least = 1 + abs(x) ** 2, math.inf
        for k, y in enumerate(b):
            gap = abs(x - y) / math.sqrt(size * stretch[k])
            if gap < least:
                least = gap
            if gap < nearest[k]:
                nearest[k] = gap
        if least > worst:
            worst = least
    return max(worst, *nearest)


def compare(last: Point, new: Point, guess: tuple[Array, float], rate: float = 0.0) -> Comparison:
    """The checks of the module's head for a candidate on the mesh of `last`; `guess` is where the corrector began."""
    w, t0, t1, weight = last.problem.weights, last.tangent, new.tangent, last.tangent.weight
    du, dl = new.u - last.u, (new.parameter - last.parameter) * weight
    miss, miss_l = new.u - guess[0], (new.parameter - guess[1]) * weight
    weighted = w * du
    length = math.sqrt(float(weighted.dot(du)) + dl * dl)
    cosine = float((w * t0.u).dot(t1.u)) + t0.parameter * t1.parameter * weight * weight
    angle = math.acos(max(-1.0, min(1.0, cosine)))
    if length == 0:
        return Comparison(0.0, angle / ANGLE, 0.0, 0.0, 0.0)
    along = float(weighted.dot(t0.u)) + float(weighted.dot(t1.u)) + (t0.parameter + t1.parameter) * weight * dl
    mean = math.sqrt(max(2 + 2 * cosine, 1e-30))
    chord = math.acos(max(-1.0, min(1.0, along / (length * mean))))
    missed = math.sqrt(float((w * miss).dot(miss)) + miss_l * miss_l) / length
    motion = spectral_motion(last.spectrum.values, new.spectrum.values, last.problem.critical.circle, rate)
    return Comparison(length, angle / ANGLE, chord / CHORD, missed / MISSED, motion / MOTION)


def room(last: Point, new: Point) -> float:
    """Arclength left until some value, at its present rate, is critical: growth Re(lambda) or log|mu|, or mu = +-1.

    Steps that slow down before a crossing see pairs of crossings apart, and do not hop where branches cross. Growth is
    compared in order of size: the k-th largest is continuous along the curve and changes no faster than the values do,
    while partners guessed among many values would seem to run.
    """
    a, b = last.spectrum.values, new.spectrum.values
    if not b.size or a.size != b.size:
        return math.inf
    circle = last.problem.critical.circle
    least = math.inf
    for x, y in zip(_margins(last, a.tolist(), circle), _margins(new, b.tolist(), circle)):
        if x * y > 0 and abs(y) < abs(x):
            least = min(least, abs(y) / (abs(x) - abs(y)))
    return least * new.step


def _margins(point: Point, values: list[complex], circle: bool) -> list[float]:
    """Signed distances to the limit: by the products of `smooth_tests` at +1, -1, and each value's growth, sorted."""
    plus, minus, _ = point.tests
    if not circle:
        nearest = min(map(abs, values))
        return [math.copysign(nearest, plus) if plus else 0.0, *sorted(z.real for z in values)]
    margins = [
        math.copysign(min(abs(z - 1) for z in values), plus) if plus else 0.0,
        math.copysign(min(abs(z + 1) for z in values), minus) if minus else 0.0,
    ]
    return margins + [math.log(size) if size else -math.inf for size in sorted(map(abs, values))]


def next_length(h: float, seen: Comparison, last: Point, new: Point, steps: Steps) -> float:
    """Aim at half of the limits; shorten where Newton needed many iterations, never more than double."""
    if seen.following is not None:
        return seen.following
    factor = 2.0
    if seen.worst > 0:
        factor = min(factor, 0.5 / seen.worst)
    if new.iterations > _FEW:
        factor = min(factor, 1.2 if new.iterations == _FEW + 1 else 0.7)
    ahead = max(_APPROACH * room(last, new), _CREEP * steps.longest)
    return min(steps.longest, h * max(0.4, factor), ahead)
