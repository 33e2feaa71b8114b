r"""How much of a transient is left, from stroboscopic states x_k = x(k T).

Near a stable orbit of period m T the differences d_k = |x_k - x_(k-m)| decay like r^k. With the largest of the last L
of them, D1, and of the L before, D0, the rate is r^L = D1/D0, and what is left to travel is at most

    sum_(j >= 1) d r^(m j) = d r^m / (1 - r^m),         r >= 1: K D1, as if it went on for as long as it was watched

(rounding and the integration's error leave small differences that do not decay; a drift or chaos leaves large ones).
Distances are in units of a scale per state; angles are compared modulo 2 pi. Reference: A. C. Aitken (1926), Proc. Roy.
Soc. Edinburgh 46, 289 (the geometric extrapolation).
"""

from __future__ import annotations

import numpy as np

__all__ = ["transient_left"]

Array = np.ndarray
_LONGEST = 8
SETTLED = 0.01  # of the scale: the catalogue's 1 %


def transient_left(states: Array, scale: Array, wraps: Array) -> tuple[float, int]:
    """(left, m): distance still to travel over `scale`, and the multiple m of the period at which the motion repeats.

    Parameters
    ----------
    states : (n, K) at times k T, the last one is now;  scale : (n,) positive;  wraps : (n,) bool, angles
    """
    count = states.shape[1]
    found = np.inf, 1
    for m in range(1, min(_LONGEST, (count - 1) // 2) + 1):
        steps = states[:, m:] - states[:, :-m]
        turns = np.round(steps / (2 * np.pi)) * (2 * np.pi)
        steps = np.where(wraps[:, None], steps - turns, steps)
        distances = (np.abs(steps) / scale[:, None]).max(axis=0)
        left = _left(distances, m)
        if left <= SETTLED:
            return left, m
        if left < found[0]:
            found = left, m
    return found


def _left(distances: Array, m: int) -> float:
    window = min(12, distances.size // 2)
    if window == 0:
        return float(np.inf)
    now, before = float(distances[-window:].max()), float(distances[-2 * window : -window].max())
    last = float(distances[-max(1, min(m, window)) :].max())
    going_on = now * distances.size / m
    if not now < before:
        return going_on
    rate = (now / before) ** (m / window)
    return min(last * rate / (1 - rate), going_on) if rate < 1 else going_on
