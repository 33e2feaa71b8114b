r"""A smooth line through the points of a branch: the driver takes few points, a picture of chords would show corners.

Between two neighbours the line is the cubic with the points P_k and the slopes D_k at both ends,

    P(t) = (1 + 2t)(1 - t)^2 P_0 + t^2 (3 - 2t) P_1 + h (t (1 - t)^2 D_0 - t^2 (1 - t) D_1),      0 <= t <= 1,

over the chord length h, axes scaled to equal ranges. D_k is that of the parabola through three neighbours; at folds,
where the parameter turns, its slope is zero, so that the line does not pass them. It is an interpolation for the eye,
of third order in the step: every accepted point, and every special one, lies on it exactly.
References: de Boor (2001), A Practical Guide to Splines, chapter IV (Bessel's slopes).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["smooth_pieces"]

Array = NDArray[np.float64]
_PARTS = 12
_TURNING = 1e-6  # part of the largest rate that is none
_STRAIGHT = 2e-3  # a turn, in rad, below which the chord is the line


def smooth_pieces(x: Array, y: Array, rates: Array | None = None) -> list[Array]:
    """The pieces (2, k) between neighbouring points, ends included; a chord where the line is straight or not finite.

    `rates` are dx/ds, where x is the continued parameter: zero at a fold.
    """
    points = np.array([x, y], float)
    pieces = [points[:, k : k + 2] for k in range(points.shape[1] - 1)]
    spread = np.array([np.ptp(row[np.isfinite(row)]) if np.isfinite(row).any() else 0.0 for row in points])
    scale = np.where(spread > 0, spread, 1.0)[:, None]
    places = points / scale
    h = np.hypot(*np.diff(places, axis=1))
    if len(h) < 2 or not np.isfinite(h).any():
        return pieces
    with np.errstate(all="ignore"):
        D = _slopes(places, h)
        if rates is not None:
            D[0, np.abs(rates) < _TURNING * np.nanmax(np.abs(rates))] = 0.0
        chords = np.diff(places, axis=1) / h
        turn = [np.hypot(*(D[:, :-1] - chords)), np.hypot(*(D[:, 1:] - chords))]
        bent = np.isfinite(turn[0] + turn[1]) & (np.maximum(*turn) > _STRAIGHT)
    t = np.linspace(0.0, 1.0, _PARTS + 1)
    for k in np.nonzero(bent)[0].tolist():
        inner = (1 + 2 * t) * (1 - t) ** 2 * places[:, k, None] + t**2 * (3 - 2 * t) * places[:, k + 1, None]
        inner += h[k] * (t * (1 - t) ** 2 * D[:, k, None] - t**2 * (1 - t) * D[:, k + 1, None])
        inner *= scale
        inner[:, 0], inner[:, -1] = points[:, k], points[:, k + 1]
        pieces[k] = inner
    return pieces


def _slopes(values: Array, h: Array) -> Array:
    """(d, P) slopes of values (d, P) by the parabola through three neighbours at distances h (P - 1,)."""
    first = np.diff(values, axis=1) / h
    D = np.empty_like(values)
    D[:, 1:-1] = (h[1:] * first[:, :-1] + h[:-1] * first[:, 1:]) / (h[:-1] + h[1:])
    D[:, 0], D[:, -1] = 2 * first[:, 0] - D[:, 1], 2 * first[:, -1] - D[:, -2]
    return D
