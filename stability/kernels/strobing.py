"""Many motions once a period: which known attractor each of them comes to.

A motion is followed period by period; it belongs to an attractor when its stroboscopic state has stayed within the
tolerance of one of the attractor's stroboscopic points for some periods in a row. Distances are in units of a scale per
state; angles are compared modulo 2 pi.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel
from stability.kernels.runge_kutta import DONE, advance

__all__ = ["ESCAPED", "UNDECIDED", "assign"]

ESCAPED, UNDECIDED = -1, -2
_IN_A_ROW = 3


@kernel(inline=True)
def _near(z, points, owners, scale, wraps, tolerance):  # type: ignore[no-untyped-def]
    """Attractor of the first point within the tolerance, or UNDECIDED."""
    for k in range(points.shape[0]):
        inside = True
        for a in range(z.shape[0]):
            gap = z[a, 0] - points[k, a]
            if wraps[a]:
                gap -= 2.0 * np.pi * np.round(gap / (2.0 * np.pi))
            if not abs(gap) <= tolerance * scale[a]:
                inside = False
                break
        if inside:
            return owners[k]
    return UNDECIDED


@kernel
def assign(field, P, rate, cuts, inside, X, periods, points, owners, scale, wraps, tolerance, rtol, atol, labels):  # type: ignore[no-untyped-def]
    """Follow every row of X (N, n), in place, for at most `periods` periods; labels (N,) int are filled.

    cuts (C + 1,): edges of the smooth pieces of one period, from 0 to T; points (K, n) and owners (K,): stroboscopic
    points of the known attractors and whose they are.
    """
    count, n = X.shape
    which, sigma = np.zeros(0, np.int64), np.zeros(0)
    z, times, steps = np.empty((n, 1)), np.empty(1), np.empty((0, 8, n))
    for i in range(count):
        for a in range(n):
            z[a, 0] = X[i, a]
        labels[i] = UNDECIDED
        h, row, last = 0.0, 0, UNDECIDED
        for _ in range(periods):
            status = DONE
            for c in range(cuts.shape[0] - 1):
                status, _, h, _ = advance(
                    field, P, 1.0, 0.0, rate, cuts[c] + inside, cuts[c + 1] - inside, cuts[c], cuts[c + 1], z, which,
                    sigma, rtol, atol, h, 100000, 0, 0, times, steps,
                )  # fmt: skip
                if status != DONE:
                    break
            if status != DONE:
                labels[i] = ESCAPED
                break
            now = _near(z, points, owners, scale, wraps, tolerance)
            row = row + 1 if now == last and now != UNDECIDED else 1
            last = now
            if now != UNDECIDED and row >= _IN_A_ROW:
                labels[i] = now
                break
        for a in range(n):
            X[i, a] = z[a, 0]
