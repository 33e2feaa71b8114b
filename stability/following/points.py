r"""A point of a branch while it is followed, and the smooth functions that tell where its spectrum becomes critical.

For multipliers mu_i (eigenvalues lambda_i):

    plus  = prod (mu_i - 1)          (prod lambda_i)            zero at folds and branch points
    minus = prod (mu_i + 1)          (1)                        zero at period doublings
    pair  = prod_(i<j) (mu_i mu_j - 1)  (prod (lambda_i + lambda_j))   zero at Neimark-Sacker / Hopf and neutral saddles

They are symmetric functions of the values, hence smooth along the branch even where values collide, and a parabola
through three of them shows a dip to zero *between* points, which counts at the points cannot show.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..protocols import Corrected, Problem, Spectrum, Stride, Tangent

__all__ = ["SMALL", "Point", "dot", "make_point", "rescaled", "smooth_tests", "strode", "tangent_of"]

Array = NDArray[np.float64]
SMALL = 6  # values up to which the products are plain


class Point(NamedTuple):
    """A solution on the branch with everything the driver compares between neighbours."""

    problem: Problem
    u: Array
    params: Array
    parameter: float  # params[free]
    tangent: Tangent
    spectrum: Spectrum
    tests: tuple[float, float, float]
    determinant_sign: int
    residual: float
    iterations: int
    s: float  # arclength from the start, in the weighted norm
    step: float  # length of the step that led here


def dot(weights: Array, a: Array, b: Array) -> float:
    """sum_i weights_i a_i b_i."""
    return float(np.dot(weights * a, b))


def smooth_tests(values: NDArray[np.complex128], circle: bool) -> tuple[float, float, float]:
    """(plus, minus, pair) of the module's head; factors of large spectra are divided by 1 + |value|.

    >>> smooth_tests(np.array([0.5 + 0j, -0.5 + 0j]), True)
    (0.75, 0.75, -1.25)
    """
    listed = values.tolist()
    if len(listed) <= SMALL:
        plus = minus = pair = 1.0 + 0.0j
        if circle:
            for i, a in enumerate(listed):
                plus *= a - 1
                minus *= a + 1
                for b in listed[i + 1 :]:
                    pair *= a * b - 1
        else:
            for i, a in enumerate(listed):
                plus *= a
                for b in listed[i + 1 :]:
                    pair *= a + b
        return plus.real, minus.real, pair.real
    size = np.abs(values)
    first, second = np.triu_indices(len(listed), 1)
    if circle:
        return (
            float(np.prod((values - 1) / (1 + size)).real),
            float(np.prod((values + 1) / (1 + size)).real),
            float(np.prod((values[first] * values[second] - 1) / (1 + size[first] * size[second])).real),
        )
    top = float(size.max()) or 1.0
    plus = float(np.prod(values / (0.1 * top + size)).real)
    sums = (values[first] + values[second]) / (0.1 * top + size[first] + size[second])
    return plus, 1.0, float(np.prod(sums).real)


def make_point(problem: Problem, found: Corrected, tangent: Tangent, k: int, s: float, step: float) -> Point:
    """The point that a converged `Corrected` describes, with its spectrum."""
    L = found.linearisation
    spectrum = problem.spectrum(problem.linearise(found.u, found.params) if L is None else L)
    tests = smooth_tests(spectrum.values, problem.critical.circle)
    if not all(map(math.isfinite, tests)):
        tests = (1.0, 1.0, 1.0)
    parameter = float(found.params[k])
    return Point(
        problem, found.u, found.params, parameter, tangent, spectrum, tests, found.determinant_sign, found.residual,
        found.iterations, s, step,
    )


def strode(last: Point, stride: Stride, k: int) -> Point | None:
    """The point that a problem's own step from `last` leads to; None where its spectrum is not finite."""
    found, tangent, s = stride.found, stride.found.tangent, last.s + stride.distance
    if tangent is None:
        return None
    if stride.spectrum is None or stride.tests is None:
        point = make_point(last.problem, found, tangent, k, s, stride.distance)
        return point if np.isfinite(point.spectrum.values).all() else None
    return Point(
        last.problem, found.u, found.params, float(found.params[k]), tangent, stride.spectrum, stride.tests,
        found.determinant_sign, found.residual, found.iterations, s, stride.distance,
    )  # fmt: skip


def rescaled(point: Point, problem: Problem) -> Point:
    """The same point of the same equations, for a problem with other scales: its tangent has another length."""
    t = point.tangent
    size = math.sqrt(dot(problem.weights, t.u, t.u) + (t.parameter * t.weight) ** 2)
    return point._replace(problem=problem, tangent=Tangent(t.u / size, t.parameter / size, t.weight))


def tangent_of(
    problem: Problem, L: Any, free: str, near: tuple[Array, float], weight: float
) -> Tangent | None:
    """The unit tangent at a regular point, on the side of the direction `near`; None where it is not unique.

    The bordered system [[F_u, F_lambda], [near]] t = e is regular unless the point is a branch point.
    """
    n = near[0].size
    rows = (problem.weights * near[0])[None, :]
    corner = np.array([[near[1] * weight**2]])
    right = np.zeros((n + 1, 1))
    right[n] = 1.0
    t = L.solve(rows, L.column(free)[:, None], corner, right)[:, 0]
    length = math.sqrt(dot(problem.weights, t[:n], t[:n]) + (weight * float(t[n])) ** 2)
    if not math.isfinite(length) or length == 0 or length > 1e12:
        return None
    return Tangent(t[:n] / length, float(t[n]) / length, weight)
