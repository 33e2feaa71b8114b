"""Meshes for collocation: equidistribution of the local error, refinement, breaks.

A collocation polynomial of degree m has the error C h^{m+1} |x^(m+1)| on an interval of length h. Its m-th derivative
is piecewise constant; the jumps between neighbours, divided by the distance of their midpoints, estimate x^(m+1), and
a mesh with equal integrals of the monitor

    rho(s) = |x^(m+1)(s)|^(1 / (m + 1))

has equal errors everywhere. A floor under rho (a fraction of its mean) keeps intervals from growing without bound.
Where the right-hand side jumps in time, x^(m+1) does not exist: breaks stay mesh points, jumps are not measured across
them, and the intervals are shared between the segments by the integral of rho.
Reference: U. Ascher, J. Christiansen, R. D. Russell (1979), Math. Comp. 33, 659-679; R. D. Russell, J. Christiansen
(1978), SIAM J. Numer. Anal. 15, 59-80.
"""

from __future__ import annotations

import numpy as np

__all__ = ["equidistribute", "monitor", "uniform_edges"]

_FLOOR = 0.2  # smallest monitor relative to its mean: no interval is more than about 1/floor times the mean length


def uniform_edges(intervals: int, breaks: np.ndarray) -> np.ndarray:
    """`intervals` intervals (more if there are more breaks) of nearly equal length with a mesh point on each break.

    >>> uniform_edges(4, np.array([0.3]))
    array([0.  , 0.3 , 0.53333333, 0.76666667, 1.  ])
    """
    return equidistribute(np.array([0.0, 1.0]), np.array([1.0]), intervals, breaks)


def monitor(edges: np.ndarray, leading: np.ndarray, degree: int, breaks: np.ndarray) -> np.ndarray:
    """rho (N,) on the intervals; `leading` (N, n) is the m-th derivative of the scaled states over m!."""
    h = np.diff(edges)
    middle = edges[:-1] + h / 2
    distance = np.empty(len(h))
    distance[:-1], distance[-1] = middle[1:] - middle[:-1], middle[0] + 1.0 - middle[-1]
    right = np.empty_like(leading)  # jumps at the right edges of the intervals
    right[:-1], right[-1] = leading[1:] - leading[:-1], leading[0] - leading[-1]
    right = np.abs(right) / distance[:, None]
    left = np.concatenate([right[-1:], right[:-1]])
    if not len(breaks):
        return np.asarray((0.5 * (left + right)).max(axis=1) ** (1.0 / (degree + 1)))
    closed = np.ones(len(h), bool)  # closed[j]: the jump at the right edge of interval j counts
    for b in breaks:
        closed[np.argmin(np.abs(edges[1:] - (b if b > 0 else 1.0)))] = False
    weight = np.stack([np.roll(closed, 1), closed]).astype(float)
    total = weight.sum(axis=0)
    average = (weight[:, :, None] * np.stack([left, right])).sum(axis=0) / np.maximum(total, 1.0)[:, None]
    average[total == 0] = np.abs(leading)[total == 0] / h[total == 0, None]
    return np.asarray(average.max(axis=1) ** (1.0 / (degree + 1)))


def equidistribute(edges: np.ndarray, rho: np.ndarray, intervals: int, breaks: np.ndarray) -> np.ndarray:
    """New edges with equal integrals of the floored monitor `rho` (N,) between the breaks.

    Each segment between breaks has at least one interval; 0 and 1 are always edges.
    """
    h = np.diff(edges)
    mean = float(rho @ h)
    rho = np.maximum(rho, _FLOOR * mean) if mean > 0 else np.ones_like(h)
    integral = np.concatenate([[0.0], np.cumsum(rho * h)])
    inner = np.asarray(breaks, float)
    corners = np.unique(np.concatenate([[0.0], inner[(inner > 1e-12) & (inner < 1 - 1e-12)], [1.0]]))
    marks = np.interp(corners, edges, integral)
    share = np.diff(marks) / integral[-1] * max(intervals, len(marks) - 1)
    counts = np.maximum(1, np.floor(share)).astype(int)
    while counts.sum() < intervals:
        counts[np.argmax(share / counts)] += 1
    pieces = []
    for k, count in enumerate(counts):
        piece = np.interp(np.linspace(marks[k], marks[k + 1], count + 1), integral, edges)
        piece[0], piece[-1] = corners[k], corners[k + 1]
        pieces.append(piece[:-1])
    return np.concatenate([*pieces, [1.0]])
