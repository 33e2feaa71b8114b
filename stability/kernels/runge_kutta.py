"""Adaptive Runge-Kutta of order 8 with variational equations, over a vector field called by its address.

Scaled time s, dx/ds = sigma f(phase, x, p), phase = frac(phase_0 + rate s). Together with the state, k variations

    dV/ds = sigma J V                                  (columns that start from given directions)
    dV/ds = sigma (J V + f_p) + sigma_p f              (derivative by a parameter, at fixed phase)

which share the state's stages, so that V is the exact derivative of the discrete flow. The step is controlled by the
state and by the variations. Error estimate and control of DOP853: err = |h| e5^2 / sqrt(e5^2 + 0.01 e3^2).
Reference: E. Hairer, S. P. Norsett, G. Wanner (1993), Solving Ordinary Differential Equations I, section II.5-II.6.
"""

from __future__ import annotations

import math

import numpy as np

from stability.errors import InputError
from stability.kernels import dop853_coefficients as method
from stability.kernels.addresses import call_field
from stability.kernels.caching import kernel

__all__ = ["DONE", "NOT_FINITE", "STEP_TOO_SMALL", "TOO_MANY_STEPS", "advance", "integrate", "interpolate"]

DONE, STEP_TOO_SMALL, TOO_MANY_STEPS, NOT_FINITE, NO_ROOM = 0, 1, 2, 3, 4
_NODES = method.C
# rows behind the stages: the step, its two errors, the dense output. They and 0, 1 are entries of an array because an
# integer literal as an argument is a type of its own for numba, which compiles the helper once more for it.
_BEHIND, _FIRST = np.array([16, 17, 18, 19]), np.array([0, 1])


def _quads() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(stages, weights, number) of the non-zero weights of each row, four at a time; the last four padded by zeros."""
    rows = [*method.A, method.B, method.E5, method.E3, *method.D]
    places, weights, counts = np.zeros((len(rows), 4, 4), np.int64), np.zeros((len(rows), 4, 4)), []
    for r, row in enumerate(rows):
        used = np.flatnonzero(row)
        places[r].flat[: len(used)], weights[r].flat[: len(used)] = used, row[used]
        counts.append(-(-len(used) // 4))
    return places, weights, np.array(counts)


_PLACES, _WEIGHTS, _QUADS = _quads()


@kernel(inline=True)
def _between(x, low, high):  # type: ignore[no-untyped-def]
    """x, or the limit that it exceeds."""
    return low if x < low else high if x > high else x


@kernel(inline=True)
def _combine(row, h, start, K, out):  # type: ignore[no-untyped-def]
    """out = start + h sum_i w_i K_i with the weights of a row of the method."""
    for e in range(out.shape[0]):
        out[e] = start[e]
    for q in range(_QUADS[row]):
        i, j, k, m = _PLACES[row, q, 0], _PLACES[row, q, 1], _PLACES[row, q, 2], _PLACES[row, q, 3]
        a, b, c, d = _WEIGHTS[row, q, 0], _WEIGHTS[row, q, 1], _WEIGHTS[row, q, 2], _WEIGHTS[row, q, 3]
        for e in range(out.shape[0]):
            out[e] += h * ((a * K[i, e] + b * K[j, e]) + (c * K[k, e] + d * K[m, e]))


@kernel(inline=True)
def _slope(field, P, sigma, phase, z, which, sigma_p, F, J, Fp, x, K, i):  # type: ignore[no-untyped-def]
    """K_i = d(x, V)/ds at z (n (1 + k),); state a at a (1 + k), its variations behind it."""
    n, count, m = x.shape[0], which.shape[0], P.shape[0]
    columns = count + 1
    phase[0] -= math.floor(phase[0])
    for a in range(n):
        x[a] = z[a * columns]
    call_field(field, 1, phase, x, P, 0, F, J, Fp)
    for a in range(n):
        at = a * columns
        K[i, at] = sigma * F[a]
        if count == 0:
            continue
        for k in range(count):
            K[i, at + 1 + k] = sigma_p[k] * F[a]
            if which[k] >= 0:
                K[i, at + 1 + k] += sigma * Fp[a * m + which[k]]
        for b in range(n):
            factor = sigma * J[a * n + b]
            if factor != 0.0:
                for k in range(count):
                    K[i, at + 1 + k] += factor * z[b * columns + 1 + k]


@kernel(inline=True)
def _error(five, three, z, new, rtol, atol, P, which):  # type: ignore[no-untyped-def]
    """Scaled error of the step from its two estimates: the larger one of the state's and the variations'.

    A variation is held to rtol of its own largest entry; a derivative by a parameter p need not be better than what a
    relative change of p by one makes of the state's tolerance (where it is zero, its rounding is all there is).
    """
    n, count = atol.shape[0], which.shape[0]
    columns = count + 1
    worst, square, other = 0.0, 0.0, 0.0
    for k in range(columns):
        size, floor = 0.0, 0.0
        if k > 0:
            for a in range(n):
                value = abs(new[a * columns + k]) / atol[a]
                size = value if value > size else size
            if which[k - 1] >= 0 and P[which[k - 1]] != 0.0:
                floor = 1.0 / abs(P[which[k - 1]])
        for a in range(n):
            e = a * columns + k
            before, after = abs(z[a * columns]), abs(new[a * columns])
            scale = atol[a] + rtol * (after if k > 0 or after > before else before)
            if k > 0:
                least = rtol * atol[a] * size + 1e-300
                scale = scale * floor if scale * floor > least else least
            square += (five[e] / scale) ** 2
            other += (three[e] / scale) ** 2
        if k == 0 or k == count:
            total = square + 0.01 * other
            if total > 0.0:
                value = square / math.sqrt(total * (n if k == 0 else n * count))
                worst = value if value > worst else worst
            elif total != 0.0:
                return np.nan
            square, other = 0.0, 0.0
    return worst


@kernel(inline=True)
def _first_step(field, P, sigma, rate, s, span, z, which, sigma_p, F, J, Fp, x, phase, K, work, rtol, atol):  # type: ignore[no-untyped-def]
    """The step whose Taylor term of order 8 has the tolerance's size, judged by an Euler step (Hairer et al., II.4)."""
    n, columns = atol.shape[0], which.shape[0] + 1
    d0, d1, d2 = 0.0, 0.0, 0.0
    for a in range(n):
        scale = atol[a] + rtol * abs(z[a * columns])
        d0, d1 = d0 + (z[a * columns] / scale) ** 2, d1 + (K[0, a * columns] / scale) ** 2
    d0, d1 = math.sqrt(d0 / n), math.sqrt(d1 / n)
    h = 0.01 * d0 / d1 if d0 > 1e-5 and d1 > 1e-5 else 1e-3 * span
    h = h if h < 0.1 * span else 0.1 * span
    for e in range(work.shape[0]):
        work[e] = z[e] + h * K[0, e]
    phase[0] += rate * h
    _slope(field, P, sigma, phase, work, which, sigma_p, F, J, Fp, x, K, _FIRST[1])
    for a in range(n):
        scale = atol[a] + rtol * abs(z[a * columns])
        d2 += ((K[1, a * columns] - K[0, a * columns]) / scale) ** 2
    d2 = math.sqrt(d2 / n) / h
    d2 = d2 if d2 > d1 else d1
    better = (0.01 / d2) ** 0.125 if d2 > 1e-15 else 1e-3 * h
    if not better < 100.0 * h:
        better = 100.0 * h
    return better if better < 0.1 * span else 0.1 * span


@kernel
def advance(  # type: ignore[no-untyped-def]
    field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps, dense, steps, times,
    coefficients,
):  # fmt: skip
    """Advance z (n (1 + k),) in place from s to `end` > s: (status, s reached, last h, steps).

    The field is never evaluated beyond low and high. dense = 1 keeps the steps from number `steps` on in times and
    coefficients, as `integrate` describes, and ends with NO_ROOM when these are full.
    """
    n, flat = atol.shape[0], z.shape[0]
    columns = which.shape[0] + 1
    K, work, new, zero = np.zeros((16, flat)), np.empty(flat), np.empty(flat), np.zeros(flat)
    five, three = np.empty(flat), np.empty(flat)
    F, J, Fp, x, phase = np.empty(n), np.empty(n * n), np.empty(n * P.shape[0]), np.empty(n), np.empty(1)
    rejected, status, last = False, TOO_MANY_STEPS, 16 if dense == 1 else 13
    phase[0] = phase0 + rate * _between(s, low, high)
    _slope(field, P, sigma, phase, z, which, sigma_p, F, J, Fp, x, K, _FIRST[0])
    if h <= 0.0:
        h = _first_step(
            field, P, sigma, rate, s, end - s, z, which, sigma_p, F, J, Fp, x, phase, K, work, rtol, atol
        )  # fmt: skip
    for _ in range(max_steps):
        if dense == 1 and steps == coefficients.shape[0]:
            status = NO_ROOM
            break
        if end - s - h < 1e-3 * h:
            h = end - s
        error = 0.0
        for i in range(1, last):  # stage 12 is the slope at the end of the step, known to be good before it is taken
            _combine(i, h, z, K, work)
            if i == 12:
                _combine(_BEHIND[0], h, z, K, new)
                _combine(_BEHIND[1], h, zero, K, five)
                _combine(_BEHIND[2], h, zero, K, three)
                error = _error(five, three, z, new, rtol, atol, P, which)
                if not error < 1.0:
                    break
                for e in range(flat):
                    work[e] = new[e]
            phase[0] = phase0 + rate * _between(s + _NODES[i] * h, low, high)
            _slope(field, P, sigma, phase, work, which, sigma_p, F, J, Fp, x, K, i)
        factor = 0.9 * error ** (-0.125) if error > 0.0 else 6.0
        if not error < 1.0:
            h *= _between(factor if error < np.inf else 0.1, 0.1, 1.0)
            rejected = True
            if not (h > 1e-14 * abs(s) and h > 1e-14 * abs(end)):
                status = NOT_FINITE if not error < np.inf else STEP_TOO_SMALL
                break
            continue
        if dense == 1:
            _keep(h, z, new, K, columns, zero, five, coefficients, steps)
            times[steps + 1] = s + h
        steps += 1
        finished = h == end - s
        s = end if finished else s + h
        for e in range(flat):
            z[e] = new[e]
            K[0, e] = K[12, e]
        if finished:
            status = DONE
            break
        h *= _between(factor, 0.333, 1.0 if rejected else 6.0)
        rejected = False
    return status, s, h, steps


@kernel(inline=True)
def _keep(h, z, new, K, columns, zero, work, coefficients, q):  # type: ignore[no-untyped-def]
    """The eight coefficients of the dense output of step q."""
    for a in range(coefficients.shape[2]):
        e = a * columns
        change = new[e] - z[e]
        coefficients[q, 0, a] = z[e]
        coefficients[q, 1, a] = change
        coefficients[q, 2, a] = h * K[0, e] - change
        coefficients[q, 3, a] = 2.0 * change - h * (K[12, e] + K[0, e])
    for r in range(4):
        _combine(_BEHIND[3] + r, h, zero, K, work)
        for a in range(coefficients.shape[2]):
            coefficients[q, 4 + r, a] = work[a * columns]


def integrate(
    field: int, P: np.ndarray, sigma: float, phase0: float, rate: float, s: float, end: float, z: np.ndarray,
    which: np.ndarray, sigma_p: np.ndarray, rtol: float, atol: np.ndarray, h: float, inside: float, max_steps: int,
    dense: int,
) -> tuple[int, float, float, int, np.ndarray, np.ndarray]:  # fmt: skip
    """Advance z (n, 1 + k) in place from s to `end` > s.

    which (k,) int: parameter index of a variation, -1 for none; sigma_p (k,). h: first step, 0 for an automatic one.
    The field is never evaluated closer than `inside` to the two ends: they may be jumps of the field in time.
    dense = 1 keeps the steps. Returns (status, s reached, last h, steps, times (steps + 1,), coefficients
    (steps, 8, n)): on a step x(s + theta h) is built from the eight coefficients by `interpolate`.
    """
    if not z.flags.c_contiguous:
        raise InputError("z must be C-contiguous: it is advanced in place")
    n, low, high, room = len(z), s + inside, end - inside, 64 * dense
    times, coefficients = np.empty(room + 1), np.empty((room, 8, n))
    times[0] = s
    line, steps, status = z.reshape(-1), 0, NO_ROOM
    while status == NO_ROOM:
        if dense and steps == len(coefficients):
            times, coefficients = np.resize(times, 2 * steps + 1), np.resize(coefficients, (2 * steps, 8, n))
        status, s, h, steps = advance(
            field, P, sigma, phase0, rate, low, high, s, end, line, which, sigma_p, rtol, atol, h, max_steps - steps,
            dense, steps, times, coefficients,
        )  # fmt: skip
    return status, s, h, steps, times[: steps * dense + 1], coefficients[: steps * dense]


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
