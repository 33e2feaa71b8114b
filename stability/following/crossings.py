r"""Where a curve without defining systems of its own branches: between points where an answer changes sides.

A problem may have ``response(point)``: the answer x of the linearised curve to a fixed small change of its equations,
orthogonal to its direction. Where two curves cross the linearisation is singular: x grows without bound and comes back
from the other side. Between a and b the function

    f(s) = |x_a| / (x_a . x(s))

is smooth, positive at a, and zero at a crossing. Newton's method fails close to it, so f and the solution are
interpolated there through four to six points of the curve around the zero, twice, closer the second time. Where x
turns by more than a right angle without growing, f has a pole instead: no crossing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..words import Kind
from .locating import Found, Locator
from .points import Point

__all__ = ["crossing", "interpolated_zero"]

Array = NDArray[np.float64]
_OFFSETS = (-1.0, -0.6, -0.3, 0.3, 0.6, 1.0)
_FEWEST = 4
_WIDTHS = (0.2, 0.06)  # of the segment
_LOOSE = 1e-5  # a residual that the interpolated point may have


def crossing(locator: Locator, a: Point, b: Point, answer: Array, after: Array) -> Found | None:
    """The crossing between a and b, whose answers are given; None where f has a pole or the curve is lost."""
    size = float(np.linalg.norm(answer))
    ends = (1 / size, size / float(answer @ after))
    made = interpolated_zero(locator, a, b, lambda z: _inverse(answer, size, z), ends)
    if made is None:
        return None
    return Found(made[0], Kind.BRANCH_POINT, (a.parameter, b.parameter), made[1] ** 2)


def interpolated_zero(
    locator: Locator, a: Point, b: Point, f: Callable[[Point], float | None], ends: tuple[float, float]
) -> tuple[Point, float] | None:
    """(point, arclength by which it moved last) where f vanishes between a and b, by interpolation around it.

    For zeros at which the curve itself cannot be solved for. None where f is larger there than at the ends (a pole).
    """
    x, accuracy = ends[0] / (ends[0] - ends[1]), math.inf
    samples: list[tuple[Point, float]] = []
    for width in _WIDTHS:
        samples = []
        for at in [x + width * offset for offset in _OFFSETS]:
            z = locator.on_curve(a, b, at) if 0.02 < at < 0.98 else None
            value = None if z is None else f(z)
            if z is not None and value is not None:
                samples.append((z, value))
        samples += [] if len(samples) >= _FEWEST else [(a, ends[0]), (b, ends[1])]
        samples.sort(key=lambda sample: sample[0].s)
        root = _root([z.s for z, _ in samples], [value for _, value in samples])
        if root is None or not a.s < root < b.s or max(abs(value) for _, value in samples) > 2 * max(map(abs, ends)):
            return None
        accuracy, x = abs((root - a.s) / (b.s - a.s) - x) * (b.s - a.s), (root - a.s) / (b.s - a.s)
    point = _interpolated(samples, a.s + x * (b.s - a.s), locator.k)
    try:
        residual = point.problem.residual_at(point.u, point.params)  # type: ignore[attr-defined]
    except np.linalg.LinAlgError:
        return None
    return (point._replace(residual=residual), accuracy) if residual < _LOOSE else None


def _inverse(answer: Array, size: float, z: Point) -> float | None:
    x = z.problem.response(z)  # type: ignore[attr-defined]
    product = 0.0 if x is None else float(answer @ x)
    return size / product if product else None


def _root(at: list[float], values: list[float]) -> float | None:
    """The zero of the polynomial through all values that lies nearest to their middle."""
    if len(at) < _FEWEST or len(set(at)) < len(at):
        return None
    middle, half = 0.5 * (at[0] + at[-1]), 0.5 * (at[-1] - at[0])
    roots = np.roots(np.polyfit((np.array(at) - middle) / half, values, len(at) - 1))
    real = roots[np.abs(roots.imag) < 1e-9].real
    real = real[np.abs(real) < 3]
    return middle + half * float(real[np.argmin(np.abs(real))]) if real.size else None


def _interpolated(samples: list[tuple[Point, float]], s: float, k: int) -> Point:
    """The point at arclength s by Lagrange interpolation of unknowns and parameters."""
    points = [z for z, _ in samples]
    weights = [math.prod((s - q.s) / (p.s - q.s) for q in points if q is not p) for p in points]
    u: Any = sum(w * p.u for w, p in zip(weights, points))
    params: Any = sum(w * p.params for w, p in zip(weights, points))
    near = min(points, key=lambda p: abs(p.s - s))
    return near._replace(u=u, params=params, parameter=float(params[k]), s=s)
