r"""Piecewise polynomials in time: values, extrema, crossings, integrals, with numpy alone.

On the piece [e_j, e_(j+1)] a column is sum_i c[j, i] T_i(s), s = 2 (t - e_j)/(e_(j+1) - e_j) - 1, with Chebyshev
polynomials T_i. A motion with impacts jumps between pieces; at an edge the later piece counts. The dense output of a
Runge-Kutta step,

    x(theta) = b_0 + theta (b_1 + (1 - theta)(b_2 + theta (b_3 + (1 - theta)(b_4 + ...)))),

is such a polynomial of degree 7. Arrays: edges (K + 1,), coefficients (K, d + 1, n).
Reference: E. Hairer, S. P. Norsett, G. Wanner (1993), section II.6; L. N. Trefethen (2013), chapters 3, 18, 19.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

__all__ = [
    "NODES", "at", "bounds", "crossings", "derivative", "extrema", "from_nodes", "from_steps", "integrals",
    "node_times", "projections", "restricted",
]  # fmt: skip

Array = np.ndarray
chebyshev = np.polynomial.chebyshev
_DEGREE = 7
# local nodes in [0, 1] of a polynomial of degree 7; the ends are among them, so that pieces join exactly
NODES: Array = 0.5 - 0.5 * np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)
_BISECTIONS = 52
_ROUNDING = 4 * float(np.finfo(float).eps)  # over the size of a piece: what has no sign
_JUMP = 1e-9  # over the size of the pieces: what joins


@cache
def _from_values() -> Array:
    """(8, 8): Chebyshev coefficients from values at NODES."""
    return np.asarray(np.linalg.inv(chebyshev.chebvander(2 * NODES - 1, _DEGREE)))


@cache
def _from_nested() -> Array:
    """(8, 8): Chebyshev coefficients from the nested coefficients b of a Runge-Kutta step."""
    theta, columns = NODES, []
    for which in range(_DEGREE + 1):
        value = np.zeros_like(theta)
        for k in range(_DEGREE, -1, -1):
            value = value + (1.0 if k == which else 0.0)
            if k:
                value = value * (theta if k % 2 else 1 - theta)
        columns.append(value)
    return np.asarray(_from_values() @ np.array(columns).T)


def from_steps(nested: Array) -> Array:
    """Chebyshev coefficients (K, 8, n) of the steps of kernels/runge_kutta.py, given as (K, 8, n)."""
    return np.einsum("ij,kjn->kin", _from_nested(), nested)


def node_times(edges: Array) -> Array:
    """(K, 8) times of the nodes of every piece."""
    return edges[:-1, None] + np.diff(edges)[:, None] * NODES


def from_nodes(values: Array) -> Array:
    """Coefficients (K, 8, n) from values (K, 8, n) at `node_times`."""
    return np.einsum("ij,kjn->kin", _from_values(), values)


def at(edges: Array, coefficients: Array, times: Array) -> Array:
    """Values (N, n) at times (N,); at an edge the later piece counts, beyond the ends the end pieces are continued."""
    piece = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, edges.size - 2)
    width = np.diff(edges)[piece]
    s = 2 * (times - edges[piece]) / width - 1
    basis = chebyshev.chebvander(s, coefficients.shape[1] - 1)
    return np.einsum("ki,kin->kn", basis, coefficients[piece])


def derivative(edges: Array, coefficients: Array) -> Array:
    """Coefficients (K, d, n) of the derivative with respect to time."""
    slopes = np.asarray(chebyshev.chebder(coefficients, axis=1))
    return slopes * (2 / np.diff(edges))[:, None, None]


def restricted(edges: Array, coefficients: Array, t0: float, t1: float) -> tuple[Array, Array]:
    """The part on [t0, t1] inside the edges, cut pieces expanded again (exact up to rounding)."""
    inner = edges[(edges > t0) & (edges < t1)]
    cut = np.concatenate([[t0], inner, [t1]])
    first = int(np.clip(np.searchsorted(edges, t0, side="right") - 1, 0, edges.size - 2))
    part = coefficients[first : first + cut.size - 1].copy()
    for j in {0, cut.size - 2}:
        lo, hi = edges[first + j], edges[first + j + 1]
        if cut[j] != lo or cut[j + 1] != hi:
            s = 2 * (cut[j] + (cut[j + 1] - cut[j]) * NODES - lo) / (hi - lo) - 1
            part[j] = _from_values() @ (chebyshev.chebvander(s, _DEGREE) @ part[j])
    return cut, part


def crossings(edges: Array, column: Array, direction: int = 0, parts: int = 16, level: float = 0.0) -> Array:
    """Times in (e_0, e_K] at which a column (K, d + 1) passes from one side of `level` to the other.

    direction +1 keeps upward crossings, -1 downward ones. The end of a step belongs to one of its two pieces only; a
    value within rounding of the level has the sign of the one before, so that a touch is no crossing, and an arrival at
    the very end is one. A jump over the level between two pieces is no crossing.
    """
    shifted = np.array(column, float)
    shifted[:, 0] -= level
    size = np.abs(column).sum(axis=1) + abs(level)
    around = np.concatenate([size[:1], size, size[-1:]])
    noise = _ROUNDING * np.maximum(np.maximum(around[:-2], around[2:]), size)
    return _passages(edges, shifted, noise, _joined(column), direction, parts)


def _joined(column: Array) -> Array:
    """(K - 1,) bool: whether a column (K, d + 1) goes on without a jump from one piece to the next."""
    ends, starts = column[:-1].sum(axis=1), column[1:] @ (-1.0) ** np.arange(column.shape[1])
    size = np.abs(column).sum(axis=1)
    return np.asarray(np.abs(ends - starts) <= _JUMP * np.maximum(size[:-1], size[1:]))


def _passages(edges: Array, column: Array, noise: Array, joined: Array, direction: int, parts: int) -> Array:
    """Sign changes of a column between samples in a row, bracketed on a grid of `parts` a piece, then bisected.

    Samples within `noise` (K,) have no sign; a sample at a joint is that of the later piece. Between two samples of
    opposite signs with others of none between them, the passage is where the first sign ends.
    """
    theta = np.linspace(0, 1, parts + 1)
    values = column @ chebyshev.chebvander(2 * theta - 1, column.shape[1] - 1).T
    signs = np.where(np.abs(values) <= noise[:, None], 0, np.sign(values)).astype(int)
    kept = np.ones(values.shape, bool)
    kept[:-1, -1] = ~joined
    stretch = np.broadcast_to(np.concatenate([[0], np.cumsum(~joined)])[:, None], values.shape)[kept]
    piece, place, sign = *np.nonzero(kept), signs[kept]
    if sign.size and sign[-1] == 0:  # where it arrives at the end, it has passed
        before = np.nonzero((sign != 0) & (stretch == stretch[-1]))[0]
        sign[-1] = -sign[before[-1]] if before.size else 0
    known = np.nonzero(sign)[0]
    first, second = known[:-1], known[1:]
    change = np.where(stretch[first] == stretch[second], sign[second] - sign[first], 0)
    start = first[change != 0 if direction == 0 else change == 2 * direction]
    piece, place, left = piece[start], place[start], sign[start]
    lo, hi = theta[place], theta[place + 1]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (lo + hi)
        value = np.einsum("ki,ki->k", chebyshev.chebvander(2 * middle - 1, column.shape[1] - 1), column[piece])
        same = value * left > 0
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    return np.asarray(edges[piece] + (edges[piece + 1] - edges[piece]) * 0.5 * (lo + hi))


def extrema(edges: Array, column: Array) -> tuple[Array, Array, Array]:
    """(times, values, signs): local extrema of a column (K, d + 1), sign +1 for a maximum, -1 for a minimum.

    Where the column has a corner between two pieces its slope jumps, and the corner is an extremum like any other.
    """
    slope = derivative(edges, column[..., None])[..., 0]
    steepest = 2 * (column.shape[1] - 1) ** 2 / np.diff(edges)  # of a polynomial over its size: Markov's inequality
    noise, joined = _ROUNDING * np.abs(column).sum(axis=1) * steepest, _joined(column)
    tops, bottoms = (_passages(edges, slope, noise, joined, way, 16) for way in (-1, +1))
    times = np.concatenate([tops, bottoms])
    signs = np.concatenate([np.ones(tops.size), -np.ones(bottoms.size)])
    order = np.argsort(times, kind="stable")
    times = times[order]
    return times, at(edges, column[..., None], times)[:, 0], signs[order]


def bounds(edges: Array, column: Array) -> tuple[float, float]:
    """(smallest, largest) value of a column (K, d + 1), between the edges too."""
    _, inner, _ = extrema(edges, column)
    ends = np.concatenate([column.sum(axis=1), column @ (-1.0) ** np.arange(column.shape[1])])
    values = np.concatenate([inner, ends])
    return float(values.min()), float(values.max())


def integrals(edges: Array, coefficients: Array) -> Array:
    """(n,) integral over all pieces."""
    k = np.arange(coefficients.shape[1])
    weights = np.where(k % 2 == 0, 2.0 / (1.0 - k**2 + (k == 1)), 0.0)
    return np.einsum("i,kin,k->n", weights, coefficients, 0.5 * np.diff(edges))


def projections(edges: Array, coefficients: Array, omega: Any) -> Array:
    """(M, n) means of x(t) exp(-i omega t) over the pieces, omega (M,), by Gauss-Legendre quadrature of each piece."""
    rates = np.atleast_1d(np.asarray(omega, float))
    longest = float(np.diff(edges).max()) * float(np.abs(rates).max(initial=0.0))
    s, w = np.polynomial.legendre.leggauss(coefficients.shape[1] + 4 + int(longest))
    times = edges[:-1, None] + np.diff(edges)[:, None] * (0.5 + 0.5 * s)
    basis = chebyshev.chebvander(s, coefficients.shape[1] - 1)
    values = np.einsum("si,kin->ksn", basis, coefficients)
    weights = np.diff(edges)[:, None] * (0.5 * w) / (edges[-1] - edges[0])
    return np.array([np.einsum("ks,ksn->n", weights * np.exp(-1j * r * times), values) for r in rates])
