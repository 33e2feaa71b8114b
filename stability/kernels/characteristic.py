"""Coefficients of characteristic polynomials of many small matrices.

det(z - M) = z^n - c_1 z^(n-1) + c_2 z^(n-2) - ... + (-1)^n c_n,   c_k the sum of the principal minors of size k,
by Faddeev and LeVerrier: N_1 = M, c_k = tr(N_k) / k, N_{k+1} = M (c_k I - N_k).

Reference: F. R. Gantmacher, The theory of matrices (1959), volume 1, chapter IV. The coefficients determine
the roots well up to n of about 10, not beyond.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["characteristic_coefficients"]

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
    return out
