r"""How long a step may be: prediction, the checks a new point must pass, and the next length.

From the last point z_0 with unit tangent t_0 (and the one before, t_-1, a distance h_-1 back) the predictor is

    z = z_0 + h t_0 + h^2/2 (t_0 - t_-1)/h_-1,

corrected orthogonally to t_0. The new point z_1 with tangent t_1 is accepted if

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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .points import Point, dot

__all__ = ["Comparison", "Steps", "compare", "predict", "spectral_motion"]

Array = NDArray[np.float64]
ANGLE, CHORD, MISSED, MOTION, KINK = 0.6, 0.15, 0.2, 0.7, 1e-4
_FEW = 3
_APPROACH, _CREEP = 0.8, 0.1


@dataclass(frozen=True)
class Steps:
    """Lengths in the weighted norm: a full window of the parameter is 1, the scale of a state is 1."""

    first: float = 0.01
    longest: float = 0.2
    shortest: float = 1e-9


@dataclass(frozen=True)
class Comparison:
    """How far a new point is from the old one, each relative to its limit, and the distance itself."""

    distance: float
    angle: float
    chord: float
    missed: float
    motion: float

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


def predict(last: Point, before: Point | None, h: float) -> tuple[Array, float]:
    """(u, parameter) of the predictor; `before` None, or on another mesh, gives the tangent predictor."""
    t = last.tangent
    u, parameter = last.u + h * t.u, last.parameter + h * t.parameter
    if before is not None and before.u.size == last.u.size and before.problem is last.problem and last.step > 0:
        bend = 0.5 * h * h / last.step
        u += bend * (t.u - before.tangent.u)
        parameter += bend * (t.parameter - before.tangent.parameter)
    return u, parameter


def spectral_motion(a: NDArray[np.complex128], b: NDArray[np.complex128], circle: bool, rate: float = 0.0) -> float:
    """Hausdorff distance of two spectra: multipliers on the Riemann sphere, eigenvalues relative to their size.

    `rate` is the largest modulus met on the branch: eigenvalues far below it may move by a tenth of it.

    >>> round(spectral_motion(np.array([1.0 + 0j]), np.array([1.1 + 0j]), True), 3)
    0.048
    """
    if not a.size or not b.size:
        return 0.0
    if circle and a.size <= 3:
        first, second = a.tolist(), b.tolist()
        return max(_farthest(first, second), _farthest(second, first))
    gap = np.abs(a[:, None] - b[None, :])
    if circle:
        gap /= np.sqrt(np.multiply.outer(1 + np.abs(a) ** 2, 1 + np.abs(b) ** 2))
    else:
        gap /= 1e-300 + np.maximum.outer(np.abs(a), np.abs(b)) + 0.1 * max(rate, float(np.abs(b).max()))
    return float(max(gap.min(axis=1).max(), gap.min(axis=0).max()))


def _farthest(a: list[complex], b: list[complex]) -> float:
    """Largest chordal distance of a multiplier of `a` from the set `b`."""
    return max(
        min(abs(x - y) / math.sqrt((1 + abs(x) ** 2) * (1 + abs(y) ** 2)) for y in b) for x in a
    )


def compare(last: Point, new: Point, guess: tuple[Array, float], rate: float = 0.0) -> Comparison:
    """The checks of the module's head for a candidate on the mesh of `last`; `guess` is where the corrector began."""
    w, t0, t1, weight = last.problem.weights, last.tangent, new.tangent, last.tangent.weight
    du, dl = new.u - last.u, (new.parameter - last.parameter) * weight
    length = math.sqrt(dot(w, du, du) + dl * dl)
    wt0 = w * t0.u
    cosine = float(wt0 @ t1.u) + t0.parameter * t1.parameter * weight * weight
    angle = math.acos(max(-1.0, min(1.0, cosine)))
    if length == 0:
        return Comparison(0.0, angle / ANGLE, 0.0, 0.0, 0.0)
    first = (float(wt0 @ du) + t0.parameter * weight * dl) / length
    second = (dot(w, t1.u, du) + t1.parameter * weight * dl) / length
    mean = math.sqrt(max(2 + 2 * cosine, 1e-30))
    chord = math.acos(max(-1.0, min(1.0, (first + second) / mean)))
    du, dl = new.u - guess[0], (new.parameter - guess[1]) * weight
    missed = math.sqrt(dot(w, du, du) + dl * dl) / length
    motion = spectral_motion(last.spectrum.values, new.spectrum.values, last.problem.critical.circle, rate)
    return Comparison(length, angle / ANGLE, chord / CHORD, missed / MISSED, motion / MOTION)


def room(last: Point, new: Point) -> float:
    """Arclength left until some value, at its present rate, is critical: growth Re(lambda) or log|mu|, or a product.

    Steps that slow down before a crossing see pairs of crossings apart, and do not hop where branches cross.
    """
    a, b = last.spectrum.values, new.spectrum.values
    if not b.size or a.size != b.size:
        return math.inf
    before, now = [last.tests[0], last.tests[1]], [new.tests[0], new.tests[1]]
    earlier = a.tolist()
    circle = last.problem.critical.circle
    for value in b.tolist():
        like = min(earlier, key=lambda z, v=value: abs(z - v))  # type: ignore[misc]
        if circle:
            if value and like:
                before.append(math.log(abs(like)))
                now.append(math.log(abs(value)))
        else:
            before.append(like.real)
            now.append(value.real)
    least = math.inf
    for x, y in zip(before, now):
        if x * y > 0 and abs(y) < abs(x):
            least = min(least, abs(y) / (abs(x) - abs(y)))
    return least * new.step


def next_length(h: float, seen: Comparison, last: Point, new: Point, steps: Steps) -> float:
    """Aim at half of the limits; shorten where Newton needed many iterations, never more than double."""
    factor = 2.0
    if seen.worst > 0:
        factor = min(factor, 0.5 / seen.worst)
    if new.iterations > _FEW:
        factor = min(factor, 1.2 if new.iterations == _FEW + 1 else 0.7)
    ahead = max(_APPROACH * room(last, new), _CREEP * steps.longest)
    return min(steps.longest, h * max(0.4, factor), ahead)
