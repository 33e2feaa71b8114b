"""Adaptive Runge-Kutta of order 8 with variational equations, over a vector field called by its address.

Scaled time s, dx/ds = sigma f(phase, x, p), phase = frac(phase_0 + rate s). Together with the state, k variations

    dV/ds = sigma J V                                  (columns that start from given directions)
    dV/ds = sigma (J V + f_p) + sigma_p f              (derivative by a parameter, at fixed phase)

which share the state's stages, so that V is the exact derivative of the discrete flow. The step is controlled by the
state and by the variations. Error estimate and control of DOP853: err = |h| e5^2 / sqrt(e5^2 + 0.01 e3^2).
Reference: E. Hairer, S. P. Norsett, G. Wanner (1993), Solving Ordinary Differential Equations I, section II.5-II.6.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_field
from stability.kernels.caching import kernel
from stability.kernels.dop853_coefficients import E3 as _E3
from stability.kernels.dop853_coefficients import E5 as _E5
from stability.kernels.dop853_coefficients import A as _A
from stability.kernels.dop853_coefficients import B as _B
from stability.kernels.dop853_coefficients import C as _C
from stability.kernels.dop853_coefficients import D as _D

__all__ = ["DONE", "NOT_FINITE", "STEP_TOO_SMALL", "TOO_MANY_STEPS", "integrate", "interpolate"]

DONE, STEP_TOO_SMALL, TOO_MANY_STEPS, NOT_FINITE = 0, 1, 2, 3


@kernel(inline=True)
def _slope(field, P, sigma, phase0, rate, low, high, s, z, n, which, sigma_p, F, J, Fp, x, phase, out):  # type: ignore[no-untyped-def]
    """d(x, V)/ds at (s, z); z and out are (n, 1 + k), state in column 0."""
    phase[0] = phase0 + rate * min(max(s, low), high)
    phase[0] -= np.floor(phase[0])
    for a in range(n):
        x[0, a] = z[a, 0]
    call_field(field, 1, phase, x, P, 0, F, J, Fp)
    for a in range(n):
        out[a, 0] = sigma * F[0, a]
        for k in range(which.shape[0]):
            value = 0.0
            for b in range(n):
                value += J[0, a, b] * z[b, 1 + k]
            if which[k] >= 0:
                value += Fp[0, a, which[k]]
            out[a, 1 + k] = sigma * value + sigma_p[k] * F[0, a]


@kernel(inline=True)
def _error(K, h, z, new, rtol, atol, n, P, which):  # type: ignore[no-untyped-def]
    """Scaled error of the step: the larger one of the state's and the variations'.

    A variation is held to rtol of its own largest entry; a derivative by a parameter p need not be better than what a
    relative change of p by one makes of the state's tolerance (where it is zero, its rounding is all there is).
    """
    worst = 0.0
    columns = z.shape[1]
    for first, last in ((0, 1), (1, columns)):
        five, three, count = 0.0, 0.0, 0
        for k in range(first, last):
            size = 0.0
            if k > 0:
                for a in range(n):
                    size = max(size, abs(new[a, k]) / atol[a])
            for a in range(n):
                if k == 0:
                    scale = atol[a] + rtol * max(abs(z[a, 0]), abs(new[a, 0]))
                else:
                    scale = rtol * atol[a] * max(size, 1e-300) + 1e-300
                    if which[k - 1] >= 0 and P[which[k - 1]] != 0.0:
                        scale = max(scale, (atol[a] + rtol * abs(new[a, 0])) / abs(P[which[k - 1]]))
                e5, e3 = 0.0, 0.0
                for i in range(12):
                    e5 += _E5[i] * K[i, a, k]
                    e3 += _E3[i] * K[i, a, k]
                five += (e5 / scale) ** 2
                three += (e3 / scale) ** 2
                count += 1
        total = five + 0.01 * three
        if total > 0.0:
            worst = max(worst, abs(h) * five / np.sqrt(total * count))
        elif total != 0.0:
            return np.nan
    return worst


@kernel(inline=True)
def _first_step(z, slope, rtol, atol, span):  # type: ignore[no-untyped-def]
    """A careful first step: a hundredth of |x| / |x'| in units of the tolerance."""
    d0, d1 = 0.0, 0.0
    for a in range(z.shape[0]):
        scale = atol[a] + rtol * abs(z[a, 0])
        d0, d1 = d0 + (z[a, 0] / scale) ** 2, d1 + (slope[a, 0] / scale) ** 2
    h = 0.01 * np.sqrt(d0 / d1) if d0 > 1e-10 and d1 > 1e-10 else 1e-3 * span
    return min(h, 0.1 * span)


@kernel(inline=True)
def _stage(weights, count, h, z, K, out):  # type: ignore[no-untyped-def]
    """out = z + h sum_i weights_i K_i."""
    for a in range(z.shape[0]):
        for k in range(z.shape[1]):
            value = 0.0
            for i in range(count):
                value += weights[i] * K[i, a, k]
            out[a, k] = z[a, k] + h * value


@kernel(inline=True)
def _doubled(times, coefficients, steps):  # type: ignore[no-untyped-def]
    """Twice the room for dense output."""
    room, n = 2 * coefficients.shape[0], coefficients.shape[2]
    more_t, more_c = np.empty(room + 1), np.empty((room, 8, n))
    for q in range(steps + 1):
        more_t[q] = times[q]
    for q in range(steps):
        for r in range(8):
            for a in range(n):
                more_c[q, r, a] = coefficients[q, r, a]
    return more_t, more_c


@kernel
def integrate(field, P, sigma, phase0, rate, s, end, z, which, sigma_p, rtol, atol, h, inside, max_steps, dense):  # type: ignore[no-untyped-def]
    """Advance z (n, 1 + k) in place from s to `end` > s.

    which (k,) int: parameter index of a variation, -1 for none; sigma_p (k,). h: first step, 0 for an automatic one.
    The field is never evaluated closer than `inside` to the two ends: they may be jumps of the field in time.
    dense = 1 keeps the steps. Returns (status, s reached, last h, steps, times (steps + 1,), coefficients
    (steps, 8, n)): on a step x(s + theta h) is built from the eight coefficients by `interpolate`.
    """
    n, columns = z.shape
    K = np.zeros((16, n, columns))
    F, J, Fp = np.empty((1, n)), np.empty((1, n, n)), np.empty((1, n, P.shape[0]))
    x, phase, work, new = np.empty((1, n)), np.empty(1), np.empty((n, columns)), np.empty((n, columns))
    low, high = s + inside, end - inside
    room = 64 if dense == 1 else 1
    times, coefficients = np.empty(room + 1), np.empty((room, 8, n))
    times[0] = s
    steps, rejected = 0, False
    _slope(field, P, sigma, phase0, rate, low, high, s, z, n, which, sigma_p, F, J, Fp, x, phase, K[0])
    if h <= 0.0:
        h = _first_step(z, K[0], rtol, atol, end - s)
    status = TOO_MANY_STEPS
    for _ in range(max_steps):
        h = min(h, end - s)
        if end - s - h < 1e-3 * h:
            h = end - s
        for i in range(1, 12):
            _stage(_A[i], i, h, z, K, work)
            at = s + _C[i] * h
            _slope(field, P, sigma, phase0, rate, low, high, at, work, n, which, sigma_p, F, J, Fp, x, phase, K[i])
        _stage(_B, 12, h, z, K, new)
        error = _error(K, h, z, new, rtol, atol, n, P, which)
        if not error < 1.0:
            h *= min(1.0, max(0.1, 0.9 * error ** (-0.125) if error < np.inf else 0.1))
            rejected = True
            if not h > 1e-14 * max(abs(s), abs(end)):
                status = NOT_FINITE if not error < np.inf else STEP_TOO_SMALL
                break
            continue
        at = s + h
        _slope(field, P, sigma, phase0, rate, low, high, at, new, n, which, sigma_p, F, J, Fp, x, phase, K[12])
        if dense == 1:
            if steps == coefficients.shape[0]:
                times, coefficients = _doubled(times, coefficients, steps)
            for i in range(13, 16):
                _stage(_A[i], i, h, z, K, work)
                at = s + _C[i] * h
                _slope(field, P, sigma, phase0, rate, low, high, at, work, n, which, sigma_p, F, J, Fp, x, phase, K[i])
            _keep(h, z, new, K, coefficients, steps)
            times[steps + 1] = s + h
        steps += 1
        finished = h == end - s
        s = end if finished else s + h
        for a in range(n):
            for k in range(columns):
                z[a, k] = new[a, k]
                K[0, a, k] = K[12, a, k]
        if finished:
            status = DONE
            break
        h *= min(1.0 if rejected else 6.0, max(0.333, 0.9 * error ** (-0.125) if error > 0.0 else 6.0))
        rejected = False
    return status, s, h, steps, times[: steps * dense + 1], coefficients[: steps * dense]


@kernel(inline=True)
def _keep(h, z, new, K, coefficients, q):  # type: ignore[no-untyped-def]
    """The eight coefficients of the dense output of step q."""
    for a in range(z.shape[0]):
        change = new[a, 0] - z[a, 0]
        coefficients[q, 0, a] = z[a, 0]
        coefficients[q, 1, a] = change
        coefficients[q, 2, a] = h * K[0, a, 0] - change
        coefficients[q, 3, a] = 2.0 * change - h * (K[12, a, 0] + K[0, a, 0])
        for r in range(4):
            value = 0.0
            for i in range(16):
                value += _D[r, i] * K[i, a, 0]
            coefficients[q, 4 + r, a] = h * value


@kernel
def interpolate(times, coefficients, at, out):  # type: ignore[no-untyped-def]
    """Dense output at ascending or unordered s (M,): fills out (M, n); s outside the span is extrapolated."""
    steps, _, n = coefficients.shape
    j = 0
    for q in range(at.shape[0]):
        s = at[q]
        if j >= steps or s < times[j]:
            j = 0
        while j < steps - 1 and s > times[j + 1]:
            j += 1
        theta = (s - times[j]) / (times[j + 1] - times[j])
        rest = 1.0 - theta
        for a in range(n):
            c = coefficients[j]
            value = theta * c[7, a]
            value = rest * (c[6, a] + value)
            value = theta * (c[5, a] + value)
            value = rest * (c[4, a] + value)
            value = theta * (c[3, a] + value)
            value = rest * (c[2, a] + value)
            out[q, a] = c[0, a] + theta * (c[1, a] + value)
