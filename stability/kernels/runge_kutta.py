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
from stability.kernels.addresses import borrowed, call_field
from stability.kernels.caching import kernel
from stability.kernels.vectors import add_four, combine_four, set_four

__all__ = ["DONE", "NOT_FINITE", "STEP_TOO_SMALL", "TOO_MANY_STEPS", "advance", "integrate", "interpolate"]

DONE, STEP_TOO_SMALL, TOO_MANY_STEPS, NOT_FINITE, NO_ROOM = 0, 1, 2, 3, 4
_NODES = method.C
# rows behind the stages: the step, its two errors (the second: what it has beyond the step), the dense output. They are
# entries of an array because an integer literal as an argument is a type of its own for numba, which compiles the
# helper once more for it. Lines behind the slopes: state, end of step, its copy, zeros, two errors.
_BEHIND, _FIRST, _LINES = np.array([16, 17, 18, 19]), np.array([0, 1]), np.arange(16, 22)


def _quads() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(stages, weights, number) of the non-zero weights of each row, four at a time; the last four padded by zeros."""
    rows = [*method.A, method.B, method.E5, method.E3 - method.B, *method.D]
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
def _exchange(z, line, inward):  # type: ignore[no-untyped-def]
    """Between z (n, 1 + k) and a line of the state followed by the variations, rows behind each other.

    In a line the variations are read in the same blocks as they were written, which processors do without a stall.
    """
    n, columns = z.shape
    for a in range(n):
        for k in range(columns):
            place = a if k == 0 else n + a * (columns - 1) + k - 1
            if inward == 1:
                line[place] = z[a, k]
            else:
                z[a, k] = line[place]


@kernel(inline=True)
def _combine(row, h, start, K, out):  # type: ignore[no-untyped-def]
    """out = start + h sum_i w_i K_i with the weights of a row of the method; out and start are numbers of rows of K."""
    for q in range(_QUADS[row]):
        rows = (_PLACES[row, q, 0], _PLACES[row, q, 1], _PLACES[row, q, 2], _PLACES[row, q, 3])
        a, b, c, d = _WEIGHTS[row, q, 0], _WEIGHTS[row, q, 1], _WEIGHTS[row, q, 2], _WEIGHTS[row, q, 3]
        weights = (h * a, h * b, h * c, h * d)
        for e in range(0, K.shape[1], 4):
            combine_four(K, out, start if q == 0 else out, e, rows, weights)


@kernel(inline=True)
def _slope(field, P, sigma, phase, x, V, which, sigma_p, plain, F, J, Fp, K, i):  # type: ignore[no-untyped-def]
    """K_i = d(x, V)/ds at x (n,), V (n, k); plain: no derivatives by parameters.

    An unsigned index cannot be negative: no wrapping, no gathered loads. F is read last: the processor has written it.
    """
    n, count = V.shape
    phase[0] -= math.floor(phase[0])
    call_field(field, 1, phase, x, P, 0, F, J, Fp)
    for a in range(n if count > 0 else 0):
        at, factor = n + a * count, sigma * J[a, 0]
        if plain:
            for k in range(0, count - 3, 4):
                set_four(K, i, at + k, factor, V, 0, k)
            for k in range(count - count % 4, count):
                K[i, np.uint64(at + k)] = factor * V[0, k]
        else:
            for k in range(count):
                slope = sigma_p[k] * F[a] + factor * V[0, k]
                K[i, np.uint64(at + k)] = slope + sigma * Fp[a, which[k]] if which[k] >= 0 else slope
        for b in range(1, n):
            factor = sigma * J[a, b]
            if factor != 0.0:
                for k in range(0, count - 3, 4):
                    add_four(K, i, at + k, factor, V, b, k)
                for k in range(count - count % 4, count):
                    K[i, np.uint64(at + k)] += factor * V[b, k]
    for a in range(n):
        K[i, np.uint64(a)] = sigma * F[a]


@kernel(inline=True)
def _state_error(five, three, x, new, rtol, atol):  # type: ignore[no-untyped-def]
    """Scaled error of the state from its two estimates."""
    square, other = 0.0, 0.0
    for a in range(atol.shape[0]):
        before, after = abs(x[a]), abs(new[a])
        scale = atol[a] + rtol * (after if after > before else before)
        square += (five[a] / scale) ** 2
        other += (three[a] / scale) ** 2
    return _scaled(square, other, atol.shape[0])


@kernel(inline=True)
def _scaled(square, other, count):  # type: ignore[no-untyped-def]
    """The error from sums of squares; nan stays nan."""
    total = square + 0.01 * other
    return square / math.sqrt(total * count) if total != 0.0 else 0.0


@kernel(inline=True)
def _variation_error(five, three, V, x, rtol, atol, weights, P, which):  # type: ignore[no-untyped-def]
    """Scaled error of the variations V (n, k) at x from their two estimates.

    A variation is held to rtol of its own largest entry, in units of atol (weights: 1 / atol); a derivative by a
    parameter p need not be better than what a relative change of p by one makes of the state's tolerance (where it is
    zero, its rounding is all there is).
    """
    n, count = V.shape
    square, other = 0.0, 0.0
    for k in range(count):
        size, first, second = 0.0, 0.0, 0.0
        if which[k] < 0 or P[which[k]] == 0.0:
            for a in range(n):
                weight = weights[a]
                value = abs(V[a, k]) * weight
                size = value if value > size else size
                first += (five[a, k] * weight) ** 2
                second += (three[a, k] * weight) ** 2
            scale = 1.0 / (rtol * size + 1e-300)
            square += first * scale * scale
            other += second * scale * scale
            continue
        for a in range(n):
            value = abs(V[a, k]) / atol[a]
            size = value if value > size else size
        floor = 1.0 / abs(P[which[k]])
        for a in range(n):
            scale, least = floor * (atol[a] + rtol * abs(x[a])), rtol * atol[a] * size + 1e-300
            scale = scale if scale > least else least
            square += (five[a, k] / scale) ** 2
            other += (three[a, k] / scale) ** 2
    return _scaled(square, other, n * count)


@kernel(inline=True)
def _first_step(x, K, h, rtol, atol):  # type: ignore[no-untyped-def]
    """The step whose Taylor term of order 8 has the tolerance's size, from the slopes at the ends of an Euler step h.

    Reference: Hairer et al., section II.4.
    """
    d1, d2 = 0.0, 0.0
    for a in range(atol.shape[0]):
        scale = atol[a] + rtol * abs(x[a])
        d1 += (K[0, a] / scale) ** 2
        d2 += ((K[1, a] - K[0, a]) / (scale * h)) ** 2
    d2 = math.sqrt((d2 if d2 > d1 else d1) / atol.shape[0])
    better = (0.01 / d2) ** 0.125 if d2 > 1e-15 else 1e-3 * h
    return better if better < 100.0 * h else 100.0 * h


@kernel(inline=True)
def _euler_step(x, K, rtol, atol, span):  # type: ignore[no-untyped-def]
    """A hundredth of |x| / |x'| in units of the tolerance."""
    d0, d1 = 0.0, 0.0
    for a in range(atol.shape[0]):
        scale = atol[a] + rtol * abs(x[a])
        d0, d1 = d0 + (x[a] / scale) ** 2, d1 + (K[0, a] / scale) ** 2
    h = 0.01 * math.sqrt(d0 / d1) if d0 > 1e-10 and d1 > 1e-10 else 1e-3 * span
    return _between(h, 0.0, 0.1 * span)


@kernel(inline=True)
def _end_of_step(h, line, K, zero, work, new, five, three, V, rtol, atol, weights, P, which):  # type: ignore[no-untyped-def]
    """Fill work and new with the end of the step (V are the variations in work); returns its scaled error."""
    n, size = V.shape[0], V.shape[0] * (1 + V.shape[1])
    _combine(_BEHIND[0], h, _LINES[3], K, _LINES[1])
    _combine(_BEHIND[1], h, _LINES[3], K, _LINES[4])
    _combine(_BEHIND[2], h, _LINES[1], K, _LINES[5])
    for e in range(new.shape[0]):
        work[e] += line[e]
        new[e] = work[e]
    error = _state_error(five, three, line, new, rtol, atol)
    if V.shape[1] > 0:
        other = _variation_error(
            five[n:size].reshape(V.shape), three[n:size].reshape(V.shape), V, new, rtol, atol, weights, P, which
        )
        error = other if not other <= error else error
    return error


@kernel
def advance(  # type: ignore[no-untyped-def]
    field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps, dense, steps, times,
    coefficients,
):  # fmt: skip
    """Advance z (n, 1 + k) in place from s to `end` > s: (status, s reached, last h, steps).

    The field is never evaluated beyond low and high. dense = 1 keeps the steps from number `steps` on in times and
    coefficients, as `integrate` describes, and ends with NO_ROOM when these are full.
    """
    n, m, size = z.shape[0], P.shape[0], z.size
    flat = (size + 7) // 8 * 8  # filled up with zeros: the processor takes eight at a time
    rows, field_values = np.zeros((22, flat)), np.empty(1 + n + n * n + n * m + n)
    found = _advance(
        field, borrowed(P), sigma, phase0, rate, low, high, s, end, borrowed(z), borrowed(which), borrowed(sigma_p),
        rtol, borrowed(atol), h, max_steps, dense, steps, borrowed(times), borrowed(coefficients), borrowed(rows),
        borrowed(field_values),
    )  # fmt: skip
    rows[0, 0], field_values[0] = 0.0, 0.0  # their last use: they are kept until here
    return found


@kernel(inline=True)
def _advance(  # type: ignore[no-untyped-def]
    field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps, dense, steps, times,
    coefficients, rows, field_values,
):  # fmt: skip
    """`advance` with arrays without owners; rows (22, flat) of zeros, field_values (1 + 2 n + n n + n m)."""
    n, count = z.shape[0], which.shape[0]
    size, flat, squared = n * (1 + count), rows.shape[1], 1 + n + n * n
    K, lines, phase = rows, rows[16:], field_values[:1]
    line, work, new, zero, five, three = lines[0], lines[1], lines[2], lines[3], lines[4], lines[5]
    F, J = field_values[1 : 1 + n], field_values[1 + n : squared].reshape((n, n))
    Fp = field_values[squared : squared + n * P.shape[0]].reshape((n, P.shape[0]))
    V, weights = work[n:size].reshape((n, count)), field_values[squared + n * P.shape[0] :]
    for a in range(n):
        weights[a] = 1.0 / atol[a]
    by_parameter = 0
    for k in range(count):
        by_parameter += which[k] >= 0 or sigma_p[k] != 0.0
    plain = by_parameter == 0
    _exchange(z, line, _FIRST[1])
    for e in range(flat):
        work[e] = line[e]
    rejected, status, last = False, TOO_MANY_STEPS, 16 if dense == 1 else 13
    phase[0] = phase0 + rate * _between(s, low, high)
    _slope(field, P, sigma, phase, work, V, which, sigma_p, plain, F, J, Fp, K, _FIRST[0])
    if h <= 0.0:
        h = _euler_step(line, K, rtol, atol, end - s)
        for e in range(flat):
            work[e] = line[e] + h * K[0, e]
        phase[0] += rate * h
        _slope(field, P, sigma, phase, work, V, which, sigma_p, plain, F, J, Fp, K, _FIRST[1])
        h = _between(_first_step(line, K, h, rtol, atol), 0.0, 0.1 * (end - s))
    for _ in range(max_steps):
        if dense == 1 and steps == coefficients.shape[0]:
            status = NO_ROOM
            break
        if end - s - h < 1e-3 * h:
            h = end - s
        error = 0.0
        for i in range(1, last):  # stage 12 is the slope at the end of the step, known to be good before it is taken
            if i != 12:
                _combine(i, h, _LINES[0], K, _LINES[1])
            else:
                error = _end_of_step(h, line, K, zero, work, new, five, three, V, rtol, atol, weights, P, which)
                if not error < 1.0:
                    break
            phase[0] = phase0 + rate * _between(s + _NODES[i] * h, low, high)
            _slope(field, P, sigma, phase, work, V, which, sigma_p, plain, F, J, Fp, K, i)
        factor = 0.9 / math.sqrt(math.sqrt(math.sqrt(error))) if error > 0.0 else 6.0
        if not error < 1.0:
            h *= _between(factor if error < np.inf else 0.1, 0.1, 1.0)
            rejected = True
            if not (h > 1e-14 * abs(s) and h > 1e-14 * abs(end)):
                status = NOT_FINITE if not error < np.inf else STEP_TOO_SMALL
                break
            continue
        if dense == 1:
            _keep(h, line, new, K, zero, five, coefficients, steps)
            times[steps + 1] = s + h
        steps += 1
        finished = h == end - s
        s = end if finished else s + h
        for e in range(flat):
            line[e] = new[e]
            K[0, e] = K[12, e]
        if finished:
            status = DONE
            break
        h *= _between(factor, 0.333, 1.0 if rejected else 6.0)
        rejected = False
    _exchange(z, line, _FIRST[0])
    return status, s, h, steps


@kernel(inline=True)
def _keep(h, z, new, K, zero, work, coefficients, q):  # type: ignore[no-untyped-def]
    """The eight coefficients of the dense output of step q."""
    for a in range(coefficients.shape[2]):
        change = new[a] - z[a]
        coefficients[q, 0, a] = z[a]
        coefficients[q, 1, a] = change
        coefficients[q, 2, a] = h * K[0, a] - change
        coefficients[q, 3, a] = 2.0 * change - h * (K[12, a] + K[0, a])
    for r in range(4):
        _combine(_BEHIND[3] + r, h, _LINES[3], K, _LINES[4])
        for a in range(coefficients.shape[2]):
            coefficients[q, 4 + r, a] = work[a]


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
    steps, status = 0, NO_ROOM
    while status == NO_ROOM:
        if dense and steps == len(coefficients):
            times, coefficients = np.resize(times, 2 * steps + 1), np.resize(coefficients, (2 * steps, 8, n))
        status, s, h, steps = advance(
            field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps - steps,
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
