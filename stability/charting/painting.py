"""From tiles to the grid: growth rate, verdict and kind at every point, by matrix products in blocks of rows.

growth = sigma + theta / T, with theta from the closed forms of `kernels.spectral_radius`. A block of rows is small
enough that its temporaries stay in the second-level cache; everything is written in place.

Errors. The fields carry an absolute error d (Tile.error). For two states theta depends on s (p or -m, or the
discriminant) like a square root, so the error is read off s itself: |ds| = d (|f0| + |f1|) and the like,
dtheta = asinh(sqrt(s + ds)) - asinh(sqrt(s)) (times 2). Away from the edges a bound for the tile suffices; the few
points close to an edge (|s| below a threshold at which the bound reaches the tolerance) are done one by one. The
verdict is UNDETERMINED where the error is not smaller than |growth|, NEUTRAL inside a region where det M = 1 forces
all multipliers onto the unit circle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.chebyshev import basis
from ..results.categories import NEUTRAL, STABLE, UNDETERMINED, UNSTABLE
from ..results.tiles import Tile
from .painting_many import paint_four, paint_matrix, paint_reciprocal

__all__ = ["Picture", "combine", "paint", "worst_error"]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Rows = NDArray[np.intp]
Doubt = list[tuple[Rows, Rows, Array]]
Target = tuple[Array, Codes, Codes, Doubt]
_BLOCK = 32_768
_PLUS, _MINUS, _PAIR = 1, 2, 3


@dataclass(frozen=True, eq=False)
class Picture:
    """What `paint` gives: growth (ny, nx), verdict and kind codes (ny, nx) int8, and the largest error.

    `doubtful` are points whose error exceeds the tolerance, rows and columns (2, B), with their `doubts` (B,); the
    error is that of all others.
    """

    growth: Array
    verdict: Codes
    kind: Codes
    error: float
    doubtful: Rows
    doubts: Array


def paint(tiles: tuple[Tile, ...], form: str, neutral: bool, x: Array, y: Array, tolerance: float) -> Picture:
    """Growth rate, verdict and kind on the grid of x (nx,) and y (ny,), both increasing.

    Parameters
    ----------
    form : "hill", "two", "reciprocal", "four" or "matrix"
    neutral : whether stable means neutrally stable (no damping and a structure that proves it)
    tolerance : of the growth rate; sets how close to an edge the error is looked at point by point
    """
    shape = (len(y), len(x))
    growth, verdict, kind = np.empty(shape), np.empty(shape, np.int8), np.empty(shape, np.int8)
    error = 0.0
    doubt: Doubt = []
    right, top = max(t.box[1] for t in tiles), max(t.box[3] for t in tiles)
    left, bottom = min(t.box[0] for t in tiles), min(t.box[2] for t in tiles)
    for tile in tiles:
        x0, x1, y0, y1 = tile.box
        columns = slice(*np.searchsorted(x, [x0, x1], side="left"))
        rows = slice(*np.searchsorted(y, [y0, y1], side="left"))
        columns = slice(0 if x0 == left else columns.start, len(x) if x1 == right else columns.stop)
        rows = slice(0 if y0 == bottom else rows.start, len(y) if y1 == top else rows.stop)
        if columns.start >= columns.stop or rows.start >= rows.stop:
            continue
        into = growth[rows, columns], verdict[rows, columns], kind[rows, columns]
        local: Doubt = []
        error = max(error, _paint_tile(tile, form, neutral, x[columns], y[rows], tolerance, (*into, local)))
        doubt += [(i + rows.start, j + columns.start, each) for i, j, each in local]
    where = [np.concatenate([d[k] for d in doubt] or [np.zeros(0)]) for k in range(3)]
    return Picture(growth, verdict, kind, error, np.array(where[:2], dtype=np.intp), where[2])


def combine(first: Picture, second: Picture) -> Picture:
    """The picture of a system of two independent blocks: the larger growth rate, the more serious verdict."""
    severity = np.array([0, 3, 1, 2], dtype=np.int8)  # stable < neutral < undetermined < unstable
    word = np.array([0, 2, 3, 1], dtype=np.int8)
    verdict = word[np.maximum(severity[first.verdict], severity[second.verdict])]
    kind = np.where(second.growth > first.growth, second.kind, first.kind)
    kind[verdict != UNSTABLE] = 0
    growth = np.maximum(first.growth, second.growth, out=first.growth)
    doubtful = np.concatenate([first.doubtful, second.doubtful], axis=1)
    doubts = np.concatenate([first.doubts, second.doubts])
    return Picture(growth, verdict, kind, max(first.error, second.error), doubtful, doubts)


def worst_error(tile: Tile, form: str, tolerance: float) -> float:
    """Estimated error of the growth rate on a tile, from a 24 x 24 grid, edges left out (see the head)."""
    x0, x1, y0, y1 = tile.box
    x, y = np.linspace(x0, x1, 24), np.linspace(y0, y1, 24)
    into: Target = np.empty((24, 24)), np.empty((24, 24), np.int8), np.empty((24, 24), np.int8), []
    return _paint_tile(tile, form, False, x, y, tolerance, into, bulk_only=True)


def _paint_tile(
    tile: Tile, form: str, neutral: bool, x: Array, y: Array, tolerance: float,
    into: Target, bulk_only: bool = False,
) -> float:  # fmt: skip
    growth, verdict, kind, doubt = into
    xi, eta = tile.scaled(x, y)
    across, up = basis(xi, tile.fields.shape[2] - 1), basis(eta, tile.fields.shape[1] - 1).T
    columns = np.ascontiguousarray(tile.fields @ across)  # (Q, Ky, nx)
    ticks = _ticks(tile, xi, eta)
    worst = tile.clock_error * 10.0
    size = max(1, _BLOCK // len(x))
    buffers = np.empty((len(columns), size, len(x)))
    along, weight = np.abs(columns).max(axis=2), np.abs(up)
    painter = _PAINTERS[form]
    for first in range(0, len(y), size):
        rows = slice(first, min(first + size, len(y)))
        block = buffers[:, : rows.stop - first]
        for plane, out in zip(columns, block, strict=True):
            np.dot(up[rows], plane, out=out)
        chi, sigma = (t[rows] if t.shape[0] > 1 else t for t in ticks)
        local: Doubt = []
        target = growth[rows], verdict[rows], kind[rows], local
        largest = (weight[rows] @ along.T).max(axis=0)  # of |f|, each function, in this block
        worst = max(worst, painter(block, largest, chi, sigma, tile.error, neutral, tolerance, target, bulk_only))
        doubt += [(i + first, j, each) for i, j, each in local]
    return worst


def _ticks(tile: Tile, xi: Array, eta: Array) -> tuple[Array, Array]:
    """1/T and sigma as arrays that broadcast against (ny, nx): (1, 1), (1, nx), (ny, 1) or (ny, nx)."""
    ky, kx = tile.clock.shape[1:]
    values = basis(eta if ky > 1 else eta[:1], ky - 1).T @ tile.clock @ basis(xi if kx > 1 else xi[:1], kx - 1)
    return values[0], values[1]


def _two_states(
    s: Array, factor: float, positive: Array, negative: Array, uncertain: Callable[[Rows, Rows], Array],
    chi: Array, sigma: Array,
    neutral: bool, tolerance: float, target: Target, bulk_only: bool, bound: float,
) -> float:  # fmt: skip
    """Growth = sigma + factor chi asinh(sqrt(max(s, 0))), its error, verdict and kind.

    `bound` is an upper bound of the error of s in the block, `uncertain` a function of indices giving it exactly.
    """
    growth, verdict, kind, doubt = target
    chi_top = float(np.max(chi))
    np.maximum(s, 0.0, out=growth)
    np.sqrt(growth, out=growth)
    np.arcsinh(growth, out=growth)
    growth *= factor * chi
    growth += sigma
    near = max((0.5 * factor * bound * chi_top / tolerance) ** 2, 4.0 * bound)
    error = 0.5 * factor * chi_top * bound / np.sqrt(near * (1.0 + near))
    if bulk_only or near > 0.25:  # the bound for the block is too coarse: look at every point
        error, close = 0.0, np.arange(s.size)
    else:
        close = np.flatnonzero(np.abs(s) < near)
    over, under = verdict.view(bool), kind.view(bool)
    if neutral:
        np.greater(s, bound, out=over)
        np.greater_equal(s, -bound, out=under)
    else:
        np.greater(growth, error, out=over)
        np.greater_equal(growth, -error, out=under)
    _encode(verdict, kind, neutral)
    if close.size:
        rows, columns = np.unravel_index(close, s.shape)
        here, ds = s[rows, columns], uncertain(rows, columns)
        upper = np.arcsinh(np.sqrt(np.maximum(here + ds, 0.0)))
        lower = np.arcsinh(np.sqrt(np.maximum(here - ds, 0.0)))
        each = factor * np.broadcast_to(chi, s.shape)[rows, columns] * (upper - lower)
        if bulk_only:  # edges are nowhere better than their square root allows, however small the tile
            return float(np.where(np.abs(here) > 1e-2, each, 0.0).max())
        if neutral:
            codes = np.where(here > ds, UNSTABLE, np.where(here < -ds, NEUTRAL, UNDETERMINED))
        else:
            at = growth[rows, columns]
            codes = np.where(at > each, UNSTABLE, np.where(at < -each, STABLE, UNDETERMINED))
        verdict[rows, columns] = codes
        bad = each > tolerance
        if bad.any():
            doubt.append((rows[bad], columns[bad], each[bad]))
        error = max(error, float(np.where(bad, 0.0, each).max()))
    # kind: 3 - 2 [positive] - [negative] where unstable
    np.equal(verdict, UNSTABLE, out=kind.view(bool))
    kind *= 3 - 2 * positive.view(np.int8) - negative.view(np.int8)
    return error


def _encode(verdict: Codes, not_stable: Codes, neutral: bool) -> None:
    """0/1 codes 'surely unstable' (in `verdict`) and 'not surely stable' to verdict codes, in place."""
    # unstable 1, stable 0, undetermined 3; neutral 2 instead of 0
    verdict *= -2
    not_stable *= 3
    verdict += not_stable
    if neutral:
        not_stable //= 3
        np.subtract(1, not_stable, out=not_stable)
        not_stable *= 2
        verdict += not_stable


def _paint_hill(
    f: Array, size: Array, chi: Array, sigma: Array, d: float, neutral: bool, tolerance: float,
    target: Target, bulk_only: bool,
) -> float:  # fmt: skip
    largest = float(max(size[0] + size[1], size[2] + size[3]))
    p, m = f[0] * f[1], f[2] * f[3]
    positive, negative = p > 0, m < 0
    np.negative(m, out=m)
    s = np.maximum(p, m, out=p)

    def uncertain(rows: Rows, columns: Rows) -> Array:
        a, b, c, e = (np.abs(plane[rows, columns]) for plane in f)
        # s is stored over p, and m holds -m: equality says which of the two it came from
        each = np.where(s[rows, columns] == m[rows, columns], c + e, a + b)
        return d * each + d * d + 4e-16 * np.abs(s[rows, columns])

    return _two_states(
        s, 2.0, positive, negative, uncertain, chi, sigma, neutral, tolerance, target, bulk_only, d * (largest + d)
    )  # fmt: skip


def _paint_two(
    f: Array, size: Array, chi: Array, sigma: Array, d: float, neutral: bool, tolerance: float,
    target: Target, bulk_only: bool,
) -> float:  # fmt: skip
    s = 0.25 * f[0] * f[0] + f[1] * f[2]
    inside = s > 0
    positive, negative = inside & (f[3] > 0), inside & (f[3] <= 0)

    def uncertain(rows: Rows, columns: Rows) -> Array:
        a, b, c = (np.abs(plane[rows, columns]) for plane in f[:3])
        return d * (0.5 * a + b + c) + 2.0 * d * d + 4e-16 * (0.25 * a * a + b * c)

    bound = d * float(0.5 * size[0] + size[1] + size[2] + 2.0 * d)
    return _two_states(
        s, 1.0, positive, negative, uncertain, chi, sigma, neutral, tolerance, target, bulk_only, bound
    )  # fmt: skip


_PAINTERS = {
    "hill": _paint_hill, "two": _paint_two,
    "four": paint_four, "reciprocal": paint_reciprocal, "matrix": paint_matrix,
}  # fmt: skip
