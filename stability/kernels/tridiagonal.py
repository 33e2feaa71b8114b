r"""Eigenvalues of symmetric tridiagonal matrices by index, for many matrices at once: Sturm counts, then Newton.

The pivots of the factorisation ``T - x = L D L^T`` of a real symmetric tridiagonal matrix with diagonal ``d_k`` and
off-diagonal ``e_k``,

    p_0 = d_0 - x,   p_k = d_k - x - e_{k-1}^2 / p_{k-1},

have as many negative members as there are eigenvalues below ``x`` (Sturm, Sylvester). A bracket that is cut by such
counts cannot lose the index of its eigenvalue. The computed counts are exact for off-diagonals that differ from the
given ones by a few units in the last place (Kahan 1966), so that the error of an eigenvalue is a few roundings of those
entries in which its eigenvector lives, not of the largest entry.

The last digits come from the twisted factorisation: with the pivots ``p_k`` from above and ``m_k`` from below,
``g_k = p_k + m_k - (d_k - x)`` is the reciprocal of the diagonal entry of ``(T - x)^-1``, its derivative is
``-|z|^2`` with ``(T - x) z = g_k e_k``, ``z_k = 1``, and ``x + g_r/|z|^2`` at the smallest ``|g_r|`` is a Rayleigh
quotient. Both recursions are run with their derivatives, whose terms have one sign.

References: W. Kahan, Accurate eigenvalues of a symmetric tri-diagonal matrix, Stanford CS41 (1966);
B. N. Parlett, I. S. Dhillon, Linear Algebra Appl. 267 (1997) 247-279.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["indexed_eigenvalues", "sturm_count"]

_EPS = float(np.finfo(float).eps)
_TINY = 1e-290
_COARSE = 0.3  # multisection stops at this width over sqrt(scale), the size of gaps; Newton steps do the rest
_MAX_STEPS = 80
_NOISE = 4.0  # roundings of the scale below which a Newton step is noise; the step itself is still taken

Array = NDArray[np.float64]


def sturm_count(diagonal: Array, squares: Array, x: Array) -> NDArray[np.int64]:
    """Number of eigenvalues below `x`.

    Parameters
    ----------
    diagonal : (N, P) float, entries ``d_k`` of P matrices.
    squares : (N - 1, P) float, squared off-diagonals ``e_k^2``.
    x : (..., P) float, shifts.

    Returns
    -------
    (..., P) int
    """
    # a pivot of exactly zero makes the next one -inf, which counts as it should (IEEE arithmetic; no -0 occurs)
    with np.errstate(divide="ignore"):
        pivot = diagonal[0] - x
        count = (pivot < 0).astype(np.int64)
        for k in range(1, diagonal.shape[0]):
            pivot = (diagonal[k] - x) - squares[k - 1] / pivot
            count += pivot < 0
    return count


def _newton_step(diagonal: Array, squares: Array, x: Array) -> tuple[Array, NDArray[np.int64]]:
    """Rayleigh-quotient correction at `x` (P,), and the Sturm count there."""
    size, points = diagonal.shape
    down, slope = np.empty((size, points)), np.empty((size, points))
    gamma, rise = np.empty((size, points)), np.empty((size, points))
    shifted = diagonal - x
    for k in range(size):
        if k:
            ratio = squares[k - 1] / down[k - 1]
            np.subtract(shifted[k], ratio, out=down[k])
            slope[k] = 1.0 + ratio / down[k - 1] * slope[k - 1]
        else:
            down[0], slope[0] = shifted[0], 1.0
        np.copyto(down[k], -_TINY, where=np.abs(down[k]) < _TINY)
    up = shifted[-1]
    gamma[-1], rise[-1] = down[-1], 1.0
    for k in range(size - 2, -1, -1):
        np.copyto(up, -_TINY, where=np.abs(up) < _TINY)
        ratio = squares[k] / up
        gamma[k] = down[k] - ratio  # = p_k + m_k - (d_k - x), without the difference of two large numbers
        rise[k] = 1.0 + ratio / up * rise[k + 1]
        up = shifted[k] - ratio
    best = np.argmin(np.abs(gamma), axis=0)[None]
    picked = [np.take_along_axis(array, best, axis=0)[0] for array in (gamma, slope, rise)]
    norm = picked[1] + picked[2] - 1.0  # |z|^2; an overflow far from the eigenvalue must not pass for a step of zero
    return np.where(norm < np.inf, picked[0] / norm, np.nan), np.sum(down < 0, axis=0)


def _multisection(
    diagonal: Array, squares: Array, index: NDArray[np.int64], lower: Array, upper: Array, width: Array
) -> tuple[Array, Array]:
    """Cut the brackets by counts until each is narrower than `width`."""
    points = index.size
    shifts = int(np.clip(4096 // max(points, 1), 1, 48))
    fractions = (np.arange(1, shifts + 1) / (shifts + 1.0))[:, None]
    column = np.arange(points)
    while np.any(upper - lower > width):
        grid = np.concatenate([lower[None], lower + (upper - lower) * fractions, upper[None]])
        below = np.sum(sturm_count(diagonal, squares, grid[1:-1]) <= index, axis=0)
        lower, upper = grid[below, column], grid[below + 1, column]
    return lower, upper


def _right_index(
    diagonal: Array,
    squares: Array,
    index: NDArray[np.int64],
    lower: Array,
    upper: Array,
    x: Array,
    at: NDArray[np.intp],
    scale: Array,
) -> NDArray[np.bool_]:
    """Whether x[at] is the eigenvalue asked for; where not, its bracket is cut and x set to the middle of it."""
    reach = 4.0 * _NOISE * _EPS * scale[at]
    sides = np.stack([x[at] - reach, x[at] + reach])
    below, above = sturm_count(diagonal[:, at], squares[:, at], sides)
    too_low, too_high = above <= index[at], below > index[at]
    lower[at] = np.where(too_low, np.maximum(lower[at], sides[1]), lower[at])
    upper[at] = np.where(too_high, np.minimum(upper[at], sides[0]), upper[at])
    wrong = too_low | too_high
    x[at] = np.where(wrong, 0.5 * (lower[at] + upper[at]), x[at])
    return ~wrong


def indexed_eigenvalues(
    diagonal: Array, squares: Array, index: NDArray[np.int64], lower: Array, upper: Array, scale: Array
) -> Array:
    """Eigenvalue number `index` (from 0, ascending) of each of P symmetric tridiagonal matrices.

    Parameters
    ----------
    diagonal : (N, P) float
    squares : (N - 1, P) float, squared off-diagonals.
    index : (P,) int
    lower, upper : (P,) float, a bracket that holds the eigenvalue.
    scale : (P,) float, the iteration ends at a few roundings of this size.

    Returns
    -------
    (P,) float; the order is certain (counted), the value good to a few roundings of `scale`.

    Examples
    --------
    >>> d = np.array([[0.0], [1.0], [4.0]]); e2 = np.full((2, 1), 0.01)
    >>> x = indexed_eigenvalues(d, e2, np.array([1]), np.array([-1.0]), np.array([5.0]), np.array([1.0]))
    >>> bool(abs(x[0] - np.linalg.eigvalsh(np.diag(d[:, 0]) + 0.1 * (np.eye(3, k=1) + np.eye(3, k=-1)))[1]) < 1e-15)
    True
    """
    width = _COARSE * np.sqrt(np.maximum(scale, 1.0))
    lower, upper = _multisection(diagonal, squares, index, lower.copy(), upper.copy(), width)
    x = 0.5 * (lower + upper)
    active = np.arange(index.size)
    for _ in range(_MAX_STEPS):
        d, e2, at = diagonal[:, active], squares[:, active], x[active]
        with np.errstate(over="ignore", invalid="ignore"):
            step, count = _newton_step(d, e2, at)
        high = count > index[active]
        lo = np.where(high, lower[active], at)
        hi = np.where(high, at, upper[active])
        lower[active], upper[active] = lo, hi
        move = at + step
        tolerance = _NOISE * _EPS * scale[active]
        # a step that leaves the bracket by no more than roundings is at the eigenvalue; any other is not for it
        outside = (move < lo - tolerance) | (move > hi + tolerance) | ~np.isfinite(move)
        x[active] = np.where(outside, 0.5 * (lo + hi), move)
        settled = ~outside & (np.abs(step) <= tolerance)
        if settled.any():
            # Newton may have found a neighbour in the same bracket: counts on both sides of the value tell its index
            settled[settled] = _right_index(diagonal, squares, index, lower, upper, x, active[settled], scale)
        done = settled | (hi - lo <= 0.25 * tolerance)
        active = active[~done]
        if active.size == 0:
            break
    return x
