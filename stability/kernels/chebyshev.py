"""Chebyshev tensors: functions of two parameters from samples at Chebyshev-Lobatto nodes, and their values on grids.

f(x, y) = sum_{j,k} C[j, k] T_j(eta) T_k(xi) on the box [x0, x1] x [y0, y1], with xi = (2 x - x0 - x1) / (x1 - x0) and
eta alike; the nodes xi_i = cos(pi i / d), i = 0 .. d, are nested when d doubles. For f analytic in the box the
coefficients fall geometrically, so the last ones measure the truncation error; rounding leaves a plateau of about
eps max|f|. A grid costs two matrix products (Ty^T C) Tx, in blocks of rows.

Shapes: coefficients (Q, Ky, Kx) for Q functions at once; values on a grid (Q, ny, nx); values at points (Q, B).

Reference: L. N. Trefethen, Approximation theory and approximation practice (2013), chapters 3, 4, 8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["at_points", "basis", "basis_derivative", "chop", "coefficients", "lobatto", "tails"]

Array = NDArray[np.float64]
_MARGIN = 1e-3  # extrapolation beyond the box, used where an edge of a window cannot be sampled itself


def lobatto(degree: int) -> Array:
    """Chebyshev-Lobatto nodes cos(pi i / degree), i = 0 .. degree, exactly symmetric about zero: (degree + 1,).

    >>> lobatto(2)
    array([ 1.,  0., -1.])
    """
    i = np.arange(degree + 1)
    return np.sin(np.pi * (degree - 2 * i) / (2.0 * degree)) if degree else np.zeros(1)


def basis(xi: Array, degree: int) -> Array:
    """T_0 .. T_degree at the points xi: (degree + 1, points), by cos(k arccos xi); a little outside [-1, 1] by cosh.

    >>> basis(np.array([0.5]), 2)[:, 0].round(12).tolist()
    [1.0, 0.5, -0.5]
    """
    k = np.arange(degree + 1)[:, None]
    values = np.asarray(np.cos(k * np.arccos(np.clip(xi, -1.0, 1.0))))
    beyond = np.abs(xi) > 1.0 + 1e-15
    if np.any(beyond):
        far = np.minimum(np.abs(xi[beyond]), 1.0 + _MARGIN)
        values[:, beyond] = np.sign(xi[beyond]) ** k * np.cosh(k * np.arccosh(far))
    return values


def basis_derivative(xi: Array, degree: int) -> Array:
    """dT_k/dxi = k U_{k-1}(xi), by the recurrence U_{k+1} = 2 xi U_k - U_{k-1}: (degree + 1, points)."""
    xi = np.clip(xi, -1.0 - _MARGIN, 1.0 + _MARGIN)
    out = np.zeros((degree + 1, xi.size))
    before, now = np.zeros_like(xi), np.ones_like(xi)
    for k in range(1, degree + 1):
        out[k] = k * now
        before, now = now, 2.0 * xi * now - before
    return out


def coefficients(values: Array) -> Array:
    """Chebyshev coefficients from values at the tensor of Lobatto nodes, (Q, ny, nx) -> (Q, ny, nx).

    >>> xi, eta = lobatto(4), lobatto(2)
    >>> coefficients((2 * eta[:, None] * xi + 1.0)[None])[0].round(12)[:2, :2].tolist()
    [[1.0, 0.0], [0.0, 2.0]]
    """
    return np.asarray(_to_coefficients(values.shape[-2] - 1) @ values @ _to_coefficients(values.shape[-1] - 1).T)


def _to_coefficients(degree: int) -> Array:
    """Matrix from values at the Lobatto nodes to Chebyshev coefficients."""
    if degree == 0:
        return np.ones((1, 1))
    i = np.arange(degree + 1)
    matrix = 2.0 / degree * np.cos(np.pi * np.outer(i, i) / degree)
    matrix[:, [0, -1]] *= 0.5
    matrix[[0, -1]] *= 0.5
    return matrix


def tails(coefficient: Array, last: int = 2) -> tuple[float, float]:
    """Sum over the last `last` columns (rows) of max|C| along the other direction: truncation in x and in y."""
    magnitude = np.abs(coefficient)
    in_x = float(magnitude[..., -last:].sum(axis=-1).max()) if coefficient.shape[-1] > last else np.inf
    in_y = float(magnitude[..., -last:, :].sum(axis=-2).max()) if coefficient.shape[-2] > last else np.inf
    return in_x, in_y


def chop(coefficient: Array, tolerance: float) -> tuple[Array, float]:
    """Drop trailing rows and columns whose summed magnitudes stay below `tolerance`; returns what is left and what
    the dropped part can amount to at most.

    >>> kept, lost = chop(np.array([[[1.0, 1e-3, 1e-20]]]), 1e-15)
    >>> kept.shape, bool(lost <= 1e-15)
    ((1, 1, 2), True)
    """
    lost = 0.0
    for axis in (-1, -2):
        other = -2 if axis == -1 else -1
        sums = np.abs(coefficient).sum(axis=other).max(axis=0)
        trailing = np.cumsum(sums[::-1])[::-1]
        keep = max(1, int(np.count_nonzero(trailing > 0.5 * tolerance)))
        lost += float(trailing[keep]) if keep < len(trailing) else 0.0
        coefficient = coefficient[..., :keep] if axis == -1 else coefficient[..., :keep, :]
    return np.ascontiguousarray(coefficient), lost


def at_points(coefficient: Array, xi: Array, eta: Array) -> tuple[Array, Array, Array]:
    """Values and exact derivatives with respect to xi and eta at scattered points: three arrays (Q, B)."""
    ky, kx = coefficient.shape[-2:]
    tx, ty = basis(xi, kx - 1), basis(eta, ky - 1)
    rows = np.matmul(coefficient, tx)  # (Q, Ky, B)
    slopes = np.matmul(coefficient, basis_derivative(xi, kx - 1))
    value = np.einsum("qkb,kb->qb", rows, ty)
    return value, np.einsum("qkb,kb->qb", slopes, ty), np.einsum("qkb,kb->qb", rows, basis_derivative(eta, ky - 1))
