r"""Folds and period doublings between two points of a branch, by a few more points of the curve.

Between a and b the curve is z(x), z = (u, lambda), with x the projection on the tangent of a, 0 at a and 1 at b: a
solve orthogonal to that tangent keeps x. Each solve leaves the tangent, hence z'(x), and the spectral matrix. Here

    fold               g(x) = lambda'(x)
    period doubling    g(x) = prod (mu_i + 1)          (`points.smooth_tests`)

is smooth and has a simple zero. The next x is the zero of an interpolant: of the derivative of Hermite's polynomial of
lambda through a, b and the first point between them (folds), or of the polynomial through all g. A solve begins on
Hermite's polynomial of z, so that the later ones take a single iteration. The error of each x is about the product of
all errors before. This is the defining system of the event with the bordered solve inside instead of beside it: it is
regular where that one is, and needs no second derivatives.

Events that share their segment with another one are left to `problems.defining`, and so are those that are not found
quickly (a kink).
Reference: Ostrowski (1973), *Solution of Equations in Euclidean and Banach Spaces*, chapters 3, 11 and 13.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..problems.orbit_spectrum import eigenvalues
from ..protocols import Corrected, Tangent
from ..words import Kind
from .points import SMALL, Point, dot, make_point, smooth_tests

__all__ = ["interpolant", "narrowed", "value_and_slope"]

Array = NDArray[np.float64]
_MOST = 8  # solves
_NODES = 5  # of the interpolant
_SLOW = 0.1  # each point has less than this part of the test function of the one before
_STALLED = 1e-8  # a move that rounding keeps from falling
_TURNED = 0.3  # least cosine of the angle between the tangents


class _Node(NamedTuple):
    """A point of the curve: x, z = (u, parameter), z' = stretch * tangent, g."""

    x: float
    u: Array
    parameter: float
    tangent: Tangent
    stretch: float
    g: float

    @property
    def rate(self) -> float:
        """lambda'(x)."""
        return self.stretch * self.tangent.parameter


class _Line:
    """The coordinate x: projection on the tangent of a in units of the segment's own."""

    def __init__(self, a: Point, b: Point) -> None:
        self.row, self.pull = a.problem.weights * a.tangent.u, a.tangent.parameter * a.tangent.weight**2
        self.start, self.begin = a.u, a.parameter
        self.whole = float(self.row.dot(b.u - a.u)) + self.pull * (b.parameter - a.parameter)

    def stretch(self, t: Tangent) -> float:
        """|dz/dx|; infinity where the curve turns away from the line."""
        cosine = float(self.row.dot(t.u)) + self.pull * t.parameter
        return self.whole / cosine if cosine > _TURNED else math.inf


def narrowed(kind: Kind, a: Point, b: Point, free: str, k: int, tolerance: float) -> tuple[Point, float] | None:
    """(the fold or period doubling between a and b, the last move); None where it is not found, or not quickly.

    g has different signs at a and b; `k` is the place of the parameter `free`, `tolerance` that of `defining.locate`.
    """
    line, problem = _Line(a, b), a.problem
    ends = [_end(kind, line, a, 0.0), _end(kind, line, b, 1.0)]
    if not (line.whole > 0 and ends[0].g * ends[1].g < 0 and ends[1].stretch < math.inf):
        return None
    nodes, size = ends, math.sqrt(dot(a.problem.weights, a.u, a.u))
    x = _next(kind, nodes)
    for _ in range(_MOST):
        if x is None:
            return None
        u, parameter = _guess(nodes, x)
        params = a.params.copy()
        params[k] = parameter
        found = problem.correct(u, params, free, a.tangent, 0.0, tolerance)
        if not found.converged or found.tangent is None:
            return None
        g = _test(kind, found)
        node = _Node(x, found.u, float(found.params[k]), found.tangent, line.stretch(found.tangent), g)
        if not (node.stretch < math.inf and math.isfinite(g)):
            return None
        slow = len(nodes) > 2 and abs(g) > _SLOW * abs(nodes[-1].g)
        nodes = [*nodes, node]
        x = _next(kind, nodes)
        move = math.inf if x is None else abs(x - node.x) * line.whole / (1.0 + size)
        if move <= tolerance or (slow and move < _STALLED):
            at = a.s + node.x * (b.s - a.s)
            point = make_point(
                problem, found._replace(determinant_sign=0), found.tangent, k, at, node.x * b.step
            )  # fmt: skip
            return point, move
        if slow:
            return None
    return None


def _end(kind: Kind, line: _Line, p: Point, x: float) -> _Node:
    g = p.tangent.parameter if kind is Kind.FOLD else p.tests[1]
    return _Node(x, p.u, p.parameter, p.tangent, line.stretch(p.tangent), g)


def _test(kind: Kind, found: Corrected) -> float:
    """g; the sign and the zero are those of the rate with respect to x."""
    if kind is Kind.FOLD:
        return found.tangent.parameter if found.tangent is not None else math.nan
    matrix = getattr(found.linearisation, "spectral", None)
    if matrix is None:
        return math.nan
    if len(matrix) > SMALL:
        return smooth_tests(eigenvalues(matrix), True)[1]
    return float(np.linalg.det(matrix + np.eye(len(matrix))))  # the product itself


# ---------------------------------------------------------------------- interpolation
def interpolant(x: Sequence[float], f: Sequence[float], slopes: Sequence[float] | None = None) -> list[float]:
    """Divided differences of f at x; with slopes every x counts twice in a row (Hermite).

    >>> interpolant([0.0, 1.0], [0.0, 1.0], [0.0, 3.0])
    [0.0, 0.0, 1.0, 1.0]
    """
    if slopes is None:
        at, column = list(x), list(f)
    else:
        at, column = [y for y in x for _ in (0, 1)], [y for y in f for _ in (0, 1)]
    out = [column[0]]
    for order in range(1, len(at)):
        if order == 1 and slopes is not None:
            column = [
                slopes[i // 2] if i % 2 == 0 else (column[i + 1] - column[i]) / (at[i + 1] - at[i])
                for i in range(len(at) - 1)
            ]
        else:
            column = [(column[i + 1] - column[i]) / (at[i + order] - at[i]) for i in range(len(at) - order)]
        out.append(column[0])
    return out


def value_and_slope(at: Sequence[float], c: Sequence[float], x: float, derivative: bool) -> tuple[float, float]:
    """The polynomial c_0 + (x - at_0) (c_1 + (x - at_1) (c_2 + ..)) and its slope; of its derivative, if asked for.

    >>> value_and_slope([0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 1.0, 1.0], 2.0, False)
    (8.0, 12.0)
    """
    value = slope = bend = 0.0
    for k in range(len(c) - 1, -1, -1):
        gap = x - at[k]
        bend = bend * gap + 2 * slope
        slope = slope * gap + value
        value = value * gap + c[k]
    return (slope, bend) if derivative else (value, slope)


def _next(kind: Kind, nodes: list[_Node]) -> float | None:
    """The zero of the interpolant between the nodes that are nearest to it on either side."""
    below = max((n for n in nodes if n.g * nodes[0].g > 0), key=lambda n: n.x)
    above = min((n for n in nodes if n.g * nodes[0].g <= 0), key=lambda n: n.x)
    if not below.x < above.x:
        return None
    if nodes[-1].g == 0.0:
        return nodes[-1].x
    hermite = kind is Kind.FOLD and len(nodes) <= 3
    if hermite:
        used = sorted(nodes, key=lambda n: n.x)
        at = [n.x for n in used for _ in (0, 1)]
        c = interpolant([n.x for n in used], [n.parameter for n in used], [n.rate for n in used])
        low, high = below.rate, above.rate
    else:
        used = nodes[: -_NODES - 1 : -1]
        at = [n.x for n in used]
        values = [n.rate if kind is Kind.FOLD else n.g for n in used]
        c = interpolant(at, values)
        low, high = (below.rate, above.rate) if kind is Kind.FOLD else (below.g, above.g)
    return _zero(at, c, hermite, (below.x, low), (above.x, high))


def _zero(
    at: list[float], c: list[float], derivative: bool, below: tuple[float, float], above: tuple[float, float]
) -> float | None:
    """Newton's method from the secant's zero, kept between two places with values of different signs."""
    (left, low), (right, high) = below, above
    x = left - low * (right - left) / (high - low)
    for _ in range(60):
        value, slope = value_and_slope(at, c, x, derivative)
        if value == 0.0:
            return x
        if value * low > 0:
            left = x
        else:
            right = x
        new = x - value / slope if slope else math.nan
        if not left <= new <= right:
            new = 0.5 * (left + right)
        if abs(new - x) <= 1e-15 * abs(x):
            return new
        x = new
    return x if math.isfinite(x) else None


def _guess(nodes: list[_Node], x: float) -> tuple[Array, float]:
    """(u, parameter) of Hermite's polynomial through the first three nodes."""
    used, parameter = nodes[:3], 0.0
    u: Any = 0.0
    for i, n in enumerate(used):
        basis, slope = 1.0, 0.0
        for j, other in enumerate(used):
            if j != i:
                basis *= (x - other.x) / (n.x - other.x)
                slope += 1.0 / (n.x - other.x)
        square, gap = basis * basis, x - n.x
        of_value, of_slope = (1 - 2 * gap * slope) * square, gap * square * n.stretch
        u = u + of_value * n.u + of_slope * n.tangent.u
        parameter += of_value * n.parameter + of_slope * n.tangent.parameter
    return u, parameter
