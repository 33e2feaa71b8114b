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


@kernel
def scan(guards, P, times, coefficients, size, count, signs, active, fresh):  # type: ignore[no-untyped-def]
    """(step, theta, guard, slope) of the first event in steps (K + 1,) (K, 8, n); guard -1: none; theta -1: not left.

    signs (count,), active and fresh (count,) bool. slope: d w/dt there.
    """
    X, F, none, phase = np.zeros((1, size)), np.zeros((1, size)), np.empty((1, 1, 1)), np.zeros(1)
    W, S = np.empty((count, _PARTS + 1)), np.empty((count, _PARTS + 1))
    waiting = fresh.copy()
    for j in range(len(coefficients)):
        for q in range(2 * (_PARTS + 1)):
            i = q // 2
            theta = i / _PARTS
            shift = _DELTA if i < _PARTS else -_DELTA
            _look(guards, P, times, coefficients, j, theta + (q % 2) * shift, X, F, none, phase)
            for k in range(count):
                if q % 2 == 0:
                    W[k, i] = signs[k] * F[0, k]
                else:
                    S[k, i] = (signs[k] * F[0, k] - W[k, i]) / shift
        best, which, hi = 2.0, -1, 0.0
        for k in range(count):
            if not active[k]:
                continue
            start = 0
            while start >= 0:
                i, kind = _brackets(W, S, k, waiting[k], best)
                start = -1
                if kind == 0:
                    break
                low, high = i / _PARTS, (i + 1) / _PARTS
                if kind == 2 or kind == 3:
                    # kind 2: golden section for the minimum; kind 3: halving for a point above zero
                    left, right = low, high
                    probe, other, value_other, found = 0.0, -1.0, 0.0, False
                    for r in range(48):
                        if kind == 3:
                            probe = high * 0.5 ** (r + 1)
                        elif other < 0.0:
                            probe = right - _GOLDEN * (right - left)
                        else:
                            probe = left + right - other
                        _look(guards, P, times, coefficients, j, probe, X, F, none, phase)
                        value = signs[k] * F[0, k]
                        if kind == 3:
                            if value > 0.0:
                                low, high, found = probe, 2.0 * probe, True
                                break
                            continue
                        if value < 0.0:
                            high, found = probe, True
                            break
                        if other < 0.0:
                            other, value_other = probe, value
                        elif (probe < other) == (value < value_other):
                            if probe < other:
                                right = other
                            else:
                                right = probe
                            if probe < other:
                                other, value_other = probe, value
                        else:
                            if probe < other:
                                left = probe
                            else:
                                left, other, value_other = other, probe, value
                    if not found:
                        if kind == 3:
                            return j, -1.0, k, 0.0
                        S[k, i] = 0.0  # no dip here: look further
                        start = i
                        continue
                if low < best:
                    for _ in range(60):
                        middle = 0.5 * (low + high)
                        if middle <= low or middle >= high:
                            break
                        _look(guards, P, times, coefficients, j, middle, X, F, none, phase)
                        if signs[k] * F[0, k] < 0.0:
                            high = middle
                        else:
                            low = middle
                    if high < best:
                        best, which, hi = high, k, high
        if which >= 0:
            before = hi - _DELTA
            _look(guards, P, times, coefficients, j, before, X, F, none, phase)
            value = signs[which] * F[0, which]
            _look(guards, P, times, coefficients, j, hi, X, F, none, phase)
            slope = (signs[which] * F[0, which] - value) / (_DELTA * (times[j + 1] - times[j]))
            return j, hi, which, slope
        for k in range(count):
            if W[k, _PARTS] > 0.0:
                waiting[k] = False
    return -1, 0.0, -1, 0.0
