r"""Events on the dense output of Runge-Kutta steps.

Guards w_k = sign_k g_k(x, t, p) >= 0: an event is a guard that turns negative.

Every guard is looked at at nine points of every step, with slopes, so that a guard that dips below zero and comes back
within a step is seen, too (two events in one step; grazing). The root is bisected to rounding. A guard that stands at
zero at the start is fresh: leaving zero is no event, and one that does not leave it is reported (theta = -1).

The guards are a C function like a vector field (kernels/addresses.py): states (x, t, padding), values F[0, :count].
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_field
from stability.kernels.caching import kernel

__all__ = ["scan", "values"]

_PARTS = 8
_DELTA = 1e-5
_GOLDEN = 0.6180339887498949


@kernel
def values(guards, P, x, t, size):  # type: ignore[no-untyped-def]
    """Values (size,) of all guards at (x, t)."""
    X, F = np.zeros((1, size)), np.zeros((1, size))
    none = np.empty((1, 1, 1))
    n = x.shape[0]
    X[0, :n] = x
    X[0, n] = t
    call_field(guards, 1, np.zeros(1), X, P, 0, F, none, none)
    return F[0].copy()


@kernel(inline=True)
def _look(guards, P, times, coefficients, j, theta, X, F, none, phase):  # type: ignore[no-untyped-def]
    """All guards at theta of step j, into F[0]."""
    c = coefficients[j]
    rest = 1.0 - theta
    n = c.shape[1]
    for a in range(n):
        value = theta * c[7, a]
        value = rest * (c[6, a] + value)
        value = theta * (c[5, a] + value)
        value = rest * (c[4, a] + value)
        value = theta * (c[3, a] + value)
        value = rest * (c[2, a] + value)
        X[0, a] = c[0, a] + theta * (c[1, a] + value)
    X[0, n] = times[j] + theta * (times[j + 1] - times[j])
    call_field(guards, 1, phase, X, P, 0, F, none, none)


@kernel(inline=True)
def _brackets(W, S, k, fresh, best):  # type: ignore[no-untyped-def]
    """(interval, kind) of the first event of guard k: kind 0 none, 1 root, 2 perhaps a dip, 3 early return."""
    begin = 0
    if fresh:
        if W[k, 1] < 0.0:
            return 0, 3
        begin = 1
    for i in range(begin, _PARTS):
        if i >= best * _PARTS:
            break
        if W[k, i + 1] < 0.0:
            return i, 1
        if S[k, i] < 0.0 and S[k, i + 1] > 0.0:
            return i, 2
    return 0, 0


@kernel(inline=True)
def _tabulate(guards, P, times, coefficients, j, signs, W, S, X, F, none, phase):  # type: ignore[no-untyped-def]
    """Guards W (count, 9) and their slopes S over theta at nine points of step j."""
    for q in range(2 * (_PARTS + 1)):
        i = q // 2
        theta = i / _PARTS
        shift = _DELTA if i < _PARTS else -_DELTA
        _look(guards, P, times, coefficients, j, theta + (q % 2) * shift, X, F, none, phase)
        for k in range(signs.shape[0]):
            if q % 2 == 0:
                W[k, i] = signs[k] * F[0, k]
            else:
                S[k, i] = (signs[k] * F[0, k] - W[k, i]) / shift


@kernel(inline=True)
def _probed(guards, P, times, coefficients, j, k, sign, kind, low, high, X, F, none, phase):  # type: ignore[no-untyped-def]
    """(found, low, high): a bracket of the root inside [low, high].

    kind 2: golden section towards the minimum, until the guard is negative there; kind 3: halving from the right, until
    it is positive.
    """
    left, right, other, least = low, high, -1.0, 0.0
    for r in range(48):
        if kind == 3:
            probe = high * 0.5 ** (r + 1)
        elif other < 0.0:
            probe = right - _GOLDEN * (right - left)
        else:
            probe = left + right - other
        _look(guards, P, times, coefficients, j, probe, X, F, none, phase)
        value = sign * F[0, k]
        if kind == 3:
            if value > 0.0:
                return True, probe, 2.0 * probe
        elif value < 0.0:
            return True, low, probe
        elif other < 0.0:
            other, least = probe, value
        elif value < least:
            if probe < other:
                right = other
            else:
                left = other
            other, least = probe, value
        elif probe < other:
            left = probe
        else:
            right = probe
    return False, low, high


@kernel(inline=True)
def _bisected(guards, P, times, coefficients, j, k, sign, low, high, X, F, none, phase):  # type: ignore[no-untyped-def]
    """theta where the guard turns negative, between low (not negative) and high (negative)."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        _look(guards, P, times, coefficients, j, middle, X, F, none, phase)
        if sign * F[0, k] < 0.0:
            high = middle
        else:
            low = middle
    return high


@kernel
def scan(guards, P, times, coefficients, size, count, signs, active, fresh):  # type: ignore[no-untyped-def]
    """(step, theta, guard, slope) of the first event in steps (K + 1,) (K, 8, n); guard -1: none; theta -1: not left.

    signs (count,), active and fresh (count,) bool. slope: d w/dt there.
    """
    X, F, none, phase = np.zeros((1, size)), np.zeros((1, size)), np.empty((1, 1, 1)), np.zeros(1)
    W, S = np.empty((count, _PARTS + 1)), np.empty((count, _PARTS + 1))
    waiting = fresh.copy()
    for j in range(len(coefficients)):
        _tabulate(guards, P, times, coefficients, j, signs, W, S, X, F, none, phase)
        best, which = 2.0, -1
        for k in range(count):
            while active[k]:
                i, kind = _brackets(W, S, k, waiting[k], best)
                low, high = i / _PARTS, (i + 1) / _PARTS
                if kind >= 2:
                    found, low, high = _probed(
                        guards, P, times, coefficients, j, k, signs[k], kind, low, high, X, F, none, phase
                    )
                    if not found and kind == 3:
                        return j, -1.0, k, 0.0
                    if not found:
                        S[k, i] = 0.0  # no dip here: look further
                        continue
                if kind > 0 and low < best:
                    at = _bisected(guards, P, times, coefficients, j, k, signs[k], low, high, X, F, none, phase)
                    if at < best:
                        best, which = at, k
                break
        if which >= 0:
            slope = 0.0
            for q in range(2):
                _look(guards, P, times, coefficients, j, best - q * _DELTA, X, F, none, phase)
                slope += (1.0 - 2.0 * q) * signs[which] * F[0, which]
            return j, best, which, slope / (_DELTA * (times[j + 1] - times[j]))
        for k in range(count):
            if W[k, _PARTS] > 0.0:
                waiting[k] = False
    return -1, 0.0, -1, 0.0
