r"""Motions of two states once a period, from a table of the stroboscopic map.

The map x(0) -> x(T) is smooth, so that a table of its values over a rectangle gives it anywhere inside: by Lagrange
interpolation through 6 x 6 points, whose error is estimated by the difference from 4 x 4 points and is smaller than
that by a further factor of the spacing. A motion that leaves the table, or meets a place where the estimate is larger
than allowed, is handed back.

Reference: C. S. Hsu (1987), Cell-to-Cell Mapping (interpolated: B. H. Tongue (1987), Physica D 28, 401-408).
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel
from stability.kernels.strobing import UNDECIDED

__all__ = ["HANDED_BACK", "follow"]

HANDED_BACK = -3
_IN_A_ROW = 3


@kernel(inline=True)
def _weights(f, six, four):  # type: ignore[no-untyped-def]
    """Lagrange weights at f in [0, 1] between the middle points of -2 .. 3 and of -1 .. 2."""
    a, b, c, d, e, g = f + 2.0, f + 1.0, f, f - 1.0, f - 2.0, f - 3.0
    six[0] = -b * c * d * e * g / 120.0
    six[1] = a * c * d * e * g / 24.0
    six[2] = -a * b * d * e * g / 12.0
    six[3] = a * b * c * e * g / 12.0
    six[4] = -a * b * c * d * g / 24.0
    six[5] = a * b * c * d * e / 120.0
    four[0] = -c * d * e / 6.0
    four[1] = b * d * e / 2.0
    four[2] = -b * c * e / 2.0
    four[3] = b * c * d / 6.0


@kernel(inline=True)
def _image(table, low, step, scale, allowed, z, new, six, four, sixy, foury):  # type: ignore[no-untyped-def]
    """Whether the image of z was found to the allowed accuracy; it goes into `new`."""
    rows, columns = table.shape[0], table.shape[1]
    px, py = (z[0] - low[0]) / step[0], (z[1] - low[1]) / step[1]
    if not (2.0 <= px < columns - 3.0 and 2.0 <= py < rows - 3.0):
        return False
    i, j = int(px), int(py)
    _weights(px - i, six, four)
    _weights(py - j, sixy, foury)
    for a in range(2):
        high, rough = 0.0, 0.0
        for r in range(6):
            along, part = 0.0, 0.0
            for q in range(6):
                value = table[j - 2 + r, i - 2 + q, a]
                along += six[q] * value
                if 1 <= q < 5:
                    part += four[q - 1] * value
            high += sixy[r] * along
            if 1 <= r < 5:
                rough += foury[r - 1] * part
        if not abs(high - rough) <= allowed * scale[a]:
            return False
        new[a] = high
    return True


@kernel(inline=True)
def _owner(z, points, owners, scale, wraps, tolerance):  # type: ignore[no-untyped-def]
    """Attractor of the first point within the tolerance, or UNDECIDED."""
    for k in range(points.shape[0]):
        inside = True
        for a in range(2):
            gap = z[a] - points[k, a]
            if wraps[a]:
                gap -= 2.0 * np.pi * np.round(gap / (2.0 * np.pi))
            if not abs(gap) <= tolerance * scale[a]:
                inside = False
                break
        if inside:
            return owners[k]
    return UNDECIDED


@kernel
def follow(table, low, step, allowed, X, periods, points, owners, scale, wraps, tolerance, labels):  # type: ignore[no-untyped-def]
    """Follow every row of X (N, 2), in place, for at most `periods` periods; labels (N,) int are filled.

    table (my, mx, 2): images of the points low + (i, j) step; an angle is taken back into the table by whole turns.
    HANDED_BACK: the motion is to be followed from X by integration.
    """
    six, four, sixy, foury = np.empty(6), np.empty(4), np.empty(6), np.empty(4)
    z, new = np.empty(2), np.empty(2)
    turn = 2.0 * np.pi
    for n in range(X.shape[0]):
        z[0], z[1] = X[n, 0], X[n, 1]
        labels[n] = UNDECIDED
        row, last = 0, UNDECIDED
        for _ in range(periods):
            for a in range(2):
                if wraps[a]:
                    z[a] -= turn * np.floor((z[a] - low[a] - 3.0 * step[a]) / turn)
            if not _image(table, low, step, scale, allowed, z, new, six, four, sixy, foury):
                labels[n] = HANDED_BACK
                break
            z[0], z[1] = new[0], new[1]
            now = _owner(z, points, owners, scale, wraps, tolerance)
            row = row + 1 if now == last and now != UNDECIDED else 1
            last = now
            if now != UNDECIDED and row >= _IN_A_ROW:
                labels[n] = now
                break
        X[n, 0], X[n, 1] = z[0], z[1]
