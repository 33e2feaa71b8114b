"""Extrema of a piecewise polynomial, between the mesh points too.

On each piece x(z) = sum_k c_k z^k with z in [-1, 1]. Sign changes of x' on a grid of 2 d + 1 points are bracketed and
refined by safeguarded Newton steps; the ends of the pieces are candidates as well.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel

__all__ = ["extrema"]


@kernel(inline=True)
def _polynomial(C, j, a, z):  # type: ignore[no-untyped-def]
    """Value, first and second derivative by Horner's scheme."""
    value, first, second = 0.0, 0.0, 0.0
    for k in range(C.shape[1] - 1, -1, -1):
        second = second * z + 2.0 * first
        first = first * z + value
        value = value * z + C[j, k, a]
    return value, first, second


@kernel
def extrema(C, low, high):  # type: ignore[no-untyped-def]
    """Fill low (n,) and high (n,) from monomial coefficients C (N, d + 1, n) on [-1, 1]."""
    pieces, terms, n = C.shape
    grid = 2 * terms
    for a in range(n):
        low[a], high[a] = np.inf, -np.inf
        for j in range(pieces):
            left = -1.0
            value, slope, _ = _polynomial(C, j, a, left)
            low[a], high[a] = min(low[a], value), max(high[a], value)
            for k in range(1, grid + 1):
                right = -1.0 + 2.0 * k / grid
                value, after, _ = _polynomial(C, j, a, right)
                low[a], high[a] = min(low[a], value), max(high[a], value)
                if slope * after < 0.0:
                    lo, hi, z = left, right, (left * after - right * slope) / (after - slope)
                    for _ in range(60):
                        value, first, second = _polynomial(C, j, a, z)
                        if first * slope > 0.0:
                            lo = z
                        else:
                            hi = z
                        step = z - first / second if second != 0.0 else 0.5 * (lo + hi)
                        if not lo < step < hi:
                            step = 0.5 * (lo + hi)
                        if abs(step - z) < 1e-9:
                            break
                        z = step
                    value, _, _ = _polynomial(C, j, a, z)
                    low[a], high[a] = min(low[a], value), max(high[a], value)
                left, slope = right, after
