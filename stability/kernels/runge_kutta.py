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
from stability.kernels.vectors import combine_four, combine_sixteen, product

__all__ = ["DONE", "NOT_FINITE", "STEP_TOO_SMALL", "TOO_MANY_STEPS", "advance", "integrate", "interpolate"]

DONE, STEP_TOO_SMALL, TOO_MANY_STEPS, NOT_FINITE, NO_ROOM = 0, 1, 2, 3, 4
_NODES = method.C
# rows behind the stages: the step, its two errors (the second: what it has beyond the step), the dense output. They are
# entries of an array because an integer literal as an argument is a type of its own for numba, which compiles the
# helper once more for it. Lines behind the slopes and one that these may run over into: state, end of step, its copy,
# zeros, two errors.
_BEHIND, _FIRST, _LINES = np.array([16, 17, 18, 19]), np.array([0, 1]), np.arange(17, 23)


def _terms() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(stages, weights, number) of the non-zero weights of each row."""
    rows = [*method.A, method.B, method.E5, method.E3 - method.B, *method.D]
    places, weights = np.zeros((len(rows), 16), np.int64), np.zeros((len(rows), 16))
    for r, row in enumerate(rows):
        used = np.flatnonzero(row)
        places[r, : len(used)], weights[r, : len(used)] = used, row[used]
    return places, weights, np.array([np.count_nonzero(row) for row in rows])


_PLACES, _WEIGHTS, _COUNTS = _terms()
_NO_TIMES, _NO_STEPS = np.empty(0), np.empty((0, 8, 0))  # without dense output; nobody writes into them


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
    full = K.shape[1] - K.shape[1] % 16
    for e in range(0, full, 16):
        combine_sixteen(K, out, start, e, h, _PLACES, _WEIGHTS, row, _COUNTS[row])
    for e in range(full, K.shape[1], 4):
        combine_four(K, out, start, e, h, _PLACES, _WEIGHTS, row, _COUNTS[row])


@kernel(inline=True, merged=True)
def _slope(field, P, sigma, phase, x, V, which, sigma_p, plain, used, F, J, Fp, K, i):  # type: ignore[no-untyped-def]
    """K_i = d(x, V)/ds at x (n,), V (n, k); plain: no derivatives by parameters; used (n,) is a work place.

    An unsigned index cannot be negative: no wrapping, no gathered loads.
    """
    n, count = V.shape
    phase[0] -= np.floor(phase[0])
    call_field(field, 1, phase, x, P, 0, F, J, Fp)
    for a in range(n if count > 0 else 0):
        some = 0
        for b in range(n):
            used[np.uint64(some)] = b
            some += J[a, b] != 0.0
        product(K, i, n + a * count, sigma, J, a, used, some, V)
    if not plain:
        for a in range(n):
            for k in range(count):
                slope = sigma_p[k] * F[a]
                K[i, np.uint64(n + a * count + k)] += slope + sigma * Fp[a, which[k]] if which[k] >= 0 else slope
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
def _variation_error(K, n, rtol, atol, weights, P, which):  # type: ignore[no-untyped-def]
    """Scaled error of the variations at the end of a step from their two estimates, the last lines of K.

    A variation is held to rtol of its own largest entry, in units of atol (weights: 1 / atol); a derivative by a
    parameter p need not be better than what a relative change of p by one makes of the state's tolerance (where it is
    zero, its rounding is all there is).
    """
    count = which.shape[0]
    square, other = 0.0, 0.0
    for k in range(count):
        size, first, second = 0.0, 0.0, 0.0
        by_parameter = which[k] >= 0 and P[which[k]] != 0.0
        for a in range(n):
            at, weight = np.uint64(n + a * count + k), weights[a]
            value = abs(K[18, at]) * weight
            size = value if value > size else size
            first += (K[21, at] * weight) ** 2
            second += (K[22, at] * weight) ** 2
        scale = 1.0 / (rtol * size + 1e-300)
        if by_parameter:
            floor, first, second, scale = 1.0 / abs(P[which[k]]), 0.0, 0.0, 1.0
            for a in range(n):
                at = np.uint64(n + a * count + k)
                unit, least = floor * (atol[a] + rtol * abs(K[18, np.uint64(a)])), rtol * atol[a] * size + 1e-300
                unit = unit if unit > least else least
                first += (K[21, at] / unit) ** 2
                second += (K[22, at] / unit) ** 2
        square += first * scale * scale
        other += second * scale * scale
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
def _end_of_step(h, K, n, rtol, atol, weights, P, which):  # type: ignore[no-untyped-def]
    """Fill work and new with the end of the step; returns its scaled error."""
    line, work, new, five, three = K[17], K[18], K[19], K[21], K[22]
    _combine(_BEHIND[0], h, _LINES[3], K, _LINES[1])
    _combine(_BEHIND[1], h, _LINES[3], K, _LINES[4])
    _combine(_BEHIND[2], h, _LINES[1], K, _LINES[5])
    for e in range(K.shape[1]):
        work[e] += line[e]
        new[e] = work[e]
    error = _state_error(five, three, line, new, rtol, atol)
    if which.shape[0] > 0:
        other = _variation_error(K, n, rtol, atol, weights, P, which)
        error = other if not other <= error else error
    return error


@kernel
def advance(  # type: ignore[no-untyped-def]
    field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps, dense, steps, times,
    coefficients,
):  # fmt: skip
    """Advance z (n, 1 + k) in place from s to `end` > s: (status, s reached, next h, steps).

    The field is never evaluated beyond low and high. dense = 1 keeps the steps from number `steps` on in times and
    coefficients, as `integrate` describes, and ends with NO_ROOM when these are full.
    """
    n, m, size = z.shape[0], P.shape[0], z.size
    flat = (size + 3) // 4 * 4  # filled up with zeros: the processor takes four at a time
    rows, field_values = np.zeros((23, flat)), np.empty(1 + n + n * n + n * m + n)
    used = np.empty(n, np.int64)
    found = _advance(
        field, borrowed(P), sigma, phase0, rate, low, high, s, end, borrowed(z), borrowed(which), borrowed(sigma_p),
        rtol, borrowed(atol), h, max_steps, dense, steps, borrowed(times), borrowed(coefficients), borrowed(rows),
        borrowed(field_values), borrowed(used),
    )  # fmt: skip
    rows[0, 0], field_values[0], used[0] = 0.0, 0.0, 0  # their last use: they are kept until here
    return found


@kernel(inline=True)
def _advance(  # type: ignore[no-untyped-def]
    field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps, dense, steps, times,
    coefficients, rows, field_values, used,
):  # fmt: skip
    """`advance` with arrays without owners; rows (23, flat) of zeros; field_values (1 + 2 n + n n + n m), used (n,)."""
    n, count = z.shape[0], which.shape[0]
    size, flat, squared = n * (1 + count), rows.shape[1], 1 + n + n * n
    K, lines, phase = rows, rows[17:], field_values[:1]
    line, work, new, five = lines[0], lines[1], lines[2], lines[4]
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
    unknown, rejected, finished, status, tried = h <= 0.0, False, False, TOO_MANY_STEPS, 0
    i, last, error, length = _FIRST[0], 16 if dense == 1 else 13, 0.0, h
    while tried < max_steps:
        if i == 1 and not unknown:  # a step begins
            if dense == 1 and steps == coefficients.shape[0]:
                status = NO_ROOM
                break
            length = _fitted(h, end - s)
            finished = length == end - s
        if i == 12:  # the slope at the end of the step, known to be good before it is taken
            error = _end_of_step(length, K, n, rtol, atol, weights, P, which)
            factor = 0.9 / math.sqrt(math.sqrt(math.sqrt(error))) if error > 0.0 else 6.0
            if not error < 1.0:
                h = length * _between(factor if error < np.inf else 0.1, 0.1, 1.0)
                rejected, i, tried = True, _FIRST[1], tried + 1
                if not (h > 1e-14 * abs(s) and h > 1e-14 * abs(end)):
                    status = NOT_FINITE if not error < np.inf else STEP_TOO_SMALL
                    break
                continue
        elif i > 0:
            _combine(i, length, _LINES[0], K, _LINES[1])
        phase[0] = phase0 + rate * _between(s + _NODES[i] * length, low, high)
        _slope(field, P, sigma, phase, work, V, which, sigma_p, plain, used, F, J, Fp, K, i)
        i += 1
        if unknown and i == 1:
            length = _euler_step(line, K, rtol, atol, end - s) / _NODES[1]
        elif unknown:
            h = _between(_first_step(line, K, _NODES[1] * length, rtol, atol), 0.0, 0.1 * (end - s))
            unknown, i = False, _FIRST[1]
        elif i == last:
            if dense == 1:
                _keep(length, line, new, K, five, coefficients, steps)
                times[steps + 1] = s + length
            steps, tried, i = steps + 1, tried + 1, _FIRST[1]
            s = end if finished else s + length
            for e in range(flat):
                line[e] = new[e]
                K[0, e] = K[12, e]
            h = length * _between(factor, 0.333, 1.0 if rejected else 6.0)
            rejected = False
            if finished:
                status = DONE
                break
    _exchange(z, line, _FIRST[0])
    return status, s, h, steps


@kernel(inline=True)
def _fitted(h, rest):  # type: ignore[no-untyped-def]
    """The step h, or what is left, in one step or in two equal ones."""
    return rest if rest < 1.001 * h else 0.5 * rest if rest < 2.0 * h else h


@kernel(inline=True)
def _keep(h, z, new, K, work, coefficients, q):  # type: ignore[no-untyped-def]
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
    dense = 1 keeps the steps. Returns (status, s reached, next h, steps, times (steps + 1,), coefficients
    (steps, 8, n); both empty without): on a step x(s + theta h) is built from the eight coefficients by `interpolate`.
    """
    if not z.flags.c_contiguous:
        raise InputError("z must be C-contiguous: it is advanced in place")
    low, high = s + inside, end - inside
    if not dense:
        status, s, h, steps = advance(
            field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps, 0, 0,
            _NO_TIMES, _NO_STEPS,
        )  # fmt: skip
        return status, s, h, steps, _NO_TIMES, _NO_STEPS
    times, coefficients = np.empty(65), np.empty((64, 8, len(z)))
    times[0] = s
    steps, status = 0, NO_ROOM
    while status == NO_ROOM:
        if steps == len(coefficients):
            times, coefficients = np.resize(times, 2 * steps + 1), np.resize(coefficients, (2 * steps, 8, len(z)))
        status, s, h, steps = advance(
            field, P, sigma, phase0, rate, low, high, s, end, z, which, sigma_p, rtol, atol, h, max_steps - steps, 1,
            steps, times, coefficients,
        )  # fmt: skip
    return status, s, h, steps, times[: steps + 1], coefficients[:steps]


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
