"""Coefficients of characteristic polynomials of many small matrices, and stability without eigenvalues.

det(z - M) = z^n - c_1 z^(n-1) + c_2 z^(n-2) - ... + (-1)^n c_n,   c_k the sum of the principal minors of size k,
by Faddeev and LeVerrier: N_1 = M, c_k = tr(N_k) / k, N_{k+1} = M (c_k I - N_k).

Schur and Cohn: p(z) = a_0 z^n + ... + a_n has all roots inside the unit circle if and only if |a_n| < |a_0| and the
reduced polynomial (a_0 p - a_n p*) / z, p* the reversed one, has; n steps of O(n) operations for each point.

Reference: F. R. Gantmacher, The theory of matrices (1959), volume 1, chapter IV; M. Marden, Geometry of polynomials
(1966), section 42. The coefficients determine the roots well up to n of about 10, not beyond.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["characteristic_coefficients", "inside_unit_circle"]

Array = NDArray[np.float64]


def characteristic_coefficients(M: Array) -> Array:
    """c_1 .. c_{n-1} of the matrices (N, n, n): (n - 1, N). The last one, c_n, is the determinant.

    >>> characteristic_coefficients(np.diag([1.0, 2.0, 3.0])[None]).ravel()
    array([ 6., 11.])
    """
    n = M.shape[-1]
    out = np.empty((n - 1, len(M)))
    N = M
    for k in range(1, n):
        out[k - 1] = np.trace(N, axis1=1, axis2=2) / k
        if k < n - 1:
            N = M @ (out[k - 1][:, None, None] * np.eye(n) - N)
            # c_{k+1} = tr(M (c_k - N_k)) / (k + 1)
    return out


def inside_unit_circle(coefficients: Array, radius: float | Array = 1.0) -> NDArray[np.bool_]:
    """Whether all roots of a_0 z^n + ... + a_n lie inside |z| < radius, for coefficients (n + 1, ...), real.

    >>> inside_unit_circle(np.array([[1.0, 1.0], [-0.5, -0.5], [0.2, 1.1]])).tolist()
    [True, False]
    """
    a = np.array(coefficients, dtype=float)
    n = len(a) - 1
    power = np.ones(a.shape[1:])
    for k in range(1, n + 1):
        power = power / radius
        a[k] *= power
    ok = np.ones(a.shape[1:], dtype=bool)
    for m in range(n, 0, -1):
        first, last = a[0], a[m]
        ok &= np.abs(last) < np.abs(first)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = last / first
        a = a[:m] - ratio * a[m:0:-1]
    return ok
