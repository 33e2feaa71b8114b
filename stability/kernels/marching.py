r"""Several steps of a branch of periodic orbits in one compiled call: predict, correct, compare, choose the next step.

What `following/stepping.py` says in Python, for points z = (u, lambda) on one mesh with unit tangents t and the inner
product <(u, l), (v, k)> = sum w u v + weight^2 l k:

    predict    z = z_0 + int_0^h sum_i t_i l_i(s) ds                       Adams, at most four tangents
    correct    `condensation_newton.newton`, orthogonally to t_0
    compare    angle(t_0, t_1), angle(z_1 - z_0, t_0 + t_1), |z_1 - z| / |z_1 - z_0|, motion of the multipliers
    next       half of the limits, few Newton iterations, not beyond where a multiplier becomes critical

The march ends before the first step that is not plainly good: one that Newton refuses, or a check a few times, or that
leaves the window of the parameter. Whoever asked for it then goes on step by step, and looks for events between the
points, where `quiet_segments` cannot rule them out. Multipliers: closed form for one or two, LAPACK's dgeev by its
address otherwise; of an autonomous orbit the direction f of the flow is removed by a reflection
(`problems/orbit_spectrum.py`).
"""

from __future__ import annotations

import functools

import numpy as np

from stability.kernels.addresses import call_eigenvalues, call_field, eigenvalue_address, native_address, native_call
from stability.kernels.caching import kernel
from stability.kernels.condensation_newton import NEWTON, newton, solvers
from stability.kernels.condensation_reduced import summary
from stability.kernels.quiet_segments import carried, quiet, reading

__all__ = ["addresses", "march"]

RETRIES, SHORT = 3, 0.01  # of steps that a limit refuses, in one march; not below this part of the longest step

_newton = native_call(NEWTON)


@functools.cache
def addresses() -> tuple[int, int, int, int]:
    """Addresses for `march`: Newton's method, its two solvers, LAPACK's eigenvalues."""
    return native_address(newton, NEWTON), *solvers(), eigenvalue_address()


@kernel(inline=True)
def _predict(points, tangents, rates, steps, k, now, h, far, guess):  # type: ignore[no-untyped-def]
    """guess (N,) = the predicted u at arclength h from point k, whose tangent is row `now`; returns lambda's change."""
    places, weights = np.empty(4), np.empty(4)
    places[0], count, reach = 0.0, 1, h
    while count < 4 and now - count >= 0:
        newer = steps[now - count + 1]
        if not newer > 0.0 or (reach > far * newer and count > 1):
            break
        places[count] = places[count - 1] - newer
        reach = newer
        count += 1
        if h > far * steps[now]:
            break
    half, inner = 0.5 * h, 0.5 - 0.5 / np.sqrt(3.0)
    change = 0.0
    for i in range(count):
        p = q = half
        for j in range(count):
            if j != i:
                p *= (inner * h - places[j]) / (places[i] - places[j])
                q *= ((1.0 - inner) * h - places[j]) / (places[i] - places[j])
        weights[i] = p + q
        change += weights[i] * rates[now - i]
    for a in range(guess.shape[0]):
        value = points[k, a]
        for i in range(count):
            value += weights[i] * tangents[now - i, a]
        guess[a] = value
    return change


@kernel(inline=True)
def _scaled(product, S, scales, M):  # type: ignore[no-untyped-def]
    """M = D^-1 S^-1 Phi D, S^-1 = S^T; returns its largest entry."""
    n, largest = scales.shape[0], 0.0
    for a in range(n):
        for b in range(n):
            value = 0.0
            for c in range(n):
                value += S[c, a] * product[c, b]
            M[a, b] = value * scales[b] / scales[a]
            largest = max(largest, abs(M[a, b]))
    return largest


@kernel(inline=True)
def _without_flow(M, f, scales, A, B):  # type: ignore[no-untyped-def]
    """A (n - 1, n - 1): M without the direction f / scales, by reflection on the first axis; |M f - f| / |f|."""
    n = M.shape[0]
    size = gap = 0.0
    for a in range(n):
        f[a] /= scales[a]
    for a in range(n):
        value = -f[a]
        for b in range(n):
            value += M[a, b] * f[b]
        gap += value * value
        size += f[a] * f[a]
    gap = np.sqrt(gap / size)
    f[0] += np.sqrt(size) if f[0] >= 0.0 else -np.sqrt(size)
    size = 0.0
    for a in range(n):
        size += f[a] * f[a]
    for b in range(n):  # H M H, H = I - 2 f f^T / |f|^2
        value = 0.0
        for a in range(n):
            value += f[a] * M[a, b]
        for a in range(n):
            B[a, b] = M[a, b] - 2.0 * value / size * f[a]
    for a in range(1, n):
        value = 0.0
        for b in range(n):
            value += B[a, b] * f[b]
        for b in range(1, n):
            A[a - 1, b - 1] = B[a, b] - 2.0 * value / size * f[b]
    return gap


@kernel(inline=True)
def _matrices(own, field, P, phase, nodes, product, S, scales, M, f, column, other, square):  # type: ignore[no-untyped-def]
    """M, and square: M without the flow of an autonomous orbit; returns the largest entry of M and |M f - f| / |f|."""
    largest = _scaled(product, S, scales, M)
    if own == 1:
        call_field(field, 1, phase, nodes, P, 0, f, other, column)
        return largest, _without_flow(M, f[0], scales, square, other)
    for a in range(M.shape[0]):
        for b in range(M.shape[0]):
            square[a, b] = M[a, b]
    return largest, 0.0


@kernel(inline=True)
def _multipliers(address, A, count, packed, re, im, room):  # type: ignore[no-untyped-def]
    """Eigenvalues of the leading (count, count) block of A; False where they could not be had.

    Those that are rounding of the largest become 0: what they are, other ways tell (`orbit_spectrum.contracted`).
    """
    if not _raw_multipliers(address, A, count, packed, re, im, room):
        return False
    largest = 1.0
    for i in range(count):
        largest = max(largest, re[i] * re[i] + im[i] * im[i])
    for i in range(count):
        if re[i] * re[i] + im[i] * im[i] < 1e-20 * largest:
            re[i] = im[i] = 0.0
    return True


@kernel(inline=True)
def _raw_multipliers(address, A, count, packed, re, im, room):  # type: ignore[no-untyped-def]
    if count <= 2:
        a, b, c, d = A[0, 0], 0.0, 0.0, 0.0
        if count == 1:
            re[0], im[0] = a, 0.0
            return abs(a) < np.inf
        b, c, d = A[0, 1], A[1, 0], A[1, 1]
        half, square = 0.5 * (a + d), 0.25 * (a - d) * (a - d) + b * c
        if square >= 0.0:
            re[0] = half + (np.sqrt(square) if half >= 0.0 else -np.sqrt(square))
            re[1] = (a * d - b * c) / re[0] if re[0] != 0.0 else 0.0
            im[0] = im[1] = 0.0
        else:
            re[0] = re[1] = half
            im[0] = np.sqrt(-square)
            im[1] = -im[0]
        return abs(re[0]) < np.inf and abs(im[0]) < np.inf
    for a in range(count):
        for b in range(count):
            packed[b * count + a] = A[a, b]
            if not abs(A[a, b]) < np.inf:
                return False
    sizes = np.zeros(3, np.int32)
    sizes[0], sizes[1] = count, room.shape[0]
    call_eigenvalues(address, sizes, packed, re, im, room)
    for i in range(1, count):  # by descending modulus; pairs are equal and stay together
        x, y = re[i], im[i]
        size = x * x + y * y
        place = i
        while place > 0 and re[place - 1] ** 2 + im[place - 1] ** 2 < size:
            re[place], im[place] = re[place - 1], im[place - 1]
            place -= 1
        re[place], im[place] = x, y
    return sizes[2] == 0


@kernel(inline=True)
def _motion(re, im, k, count):  # type: ignore[no-untyped-def]
    """Hausdorff distance of the rows k and k + 1 of multipliers, in the chordal metric."""
    worst = 0.0
    for way in range(2):
        here, there = k + way, k + 1 - way
        for i in range(count):
            least, size = np.inf, 1.0 + re[here, i] ** 2 + im[here, i] ** 2
            for j in range(count):
                gap = (re[here, i] - re[there, j]) ** 2 + (im[here, i] - im[there, j]) ** 2
                least = min(least, gap / (size * (1.0 + re[there, j] ** 2 + im[there, j] ** 2)))
            worst = max(worst, least)
    return np.sqrt(worst)


@kernel(inline=True)
def _margins(re, im, k, count, out):  # type: ignore[no-untyped-def]
    """out (count + 2,): signed distances to +1 and -1, then the growth of each multiplier in order of size."""
    for side in range(2):
        limit = 1.0 - 2.0 * side
        nearest, a, b = np.inf, 1.0, 0.0
        for i in range(count):
            x, y = re[k, i] - limit, im[k, i]
            nearest = min(nearest, np.sqrt(x * x + y * y))
            a, b = a * x - b * y, a * y + b * x
        out[side] = 0.0 if a == 0.0 else (nearest if a > 0.0 else -nearest)
    for i in range(count):
        size = re[k, i] ** 2 + im[k, i] ** 2
        growth = 0.5 * np.log(size) if size > 0.0 else -np.inf
        place = i + 2
        while place > 2 and out[place - 1] > growth:
            out[place] = out[place - 1]
            place -= 1
        out[place] = growth


@kernel(inline=True)
def _room(re, im, k, count, before, after):  # type: ignore[no-untyped-def]
    """Steps like the last one until some multiplier, at its present rate, is critical."""
    _margins(re, im, k, count, before)
    _margins(re, im, k + 1, count, after)
    least = np.inf
    for i in range(count + 2):
        x, y = before[i], after[i]
        if x * y > 0.0 and abs(y) < abs(x) < np.inf:
            least = min(least, abs(y) / (abs(x) - abs(y)))
    return least


@kernel(inline=True)
def _compare(weights, weight, points, tangents, rates, guess, k, now, change, miss, limits, out):  # type: ignore[no-untyped-def]
    """Distance of point k + 1, out[1]; out[2:5]: angles of tangents, of chord and mean tangent, miss, over limits."""
    square = cosine = along = missed = 0.0
    for a in range(weights.shape[0]):
        du, t0, t1 = points[k + 1, a] - points[k, a], tangents[now, a], tangents[now + 1, a]
        gap = points[k + 1, a] - guess[a]
        square += weights[a] * du * du
        cosine += weights[a] * t0 * t1
        along += weights[a] * du * (t0 + t1)
        missed += weights[a] * gap * gap
    w2 = weight * weight
    distance = np.sqrt(square + w2 * change * change)
    cosine += w2 * rates[now] * rates[now + 1]
    out[1], out[2] = distance, np.arccos(max(-1.0, min(1.0, cosine))) / limits[0]
    out[3] = out[4] = 0.0
    if distance > 0.0:
        along += w2 * change * (rates[now] + rates[now + 1])
        chord = along / (distance * np.sqrt(max(2.0 + 2.0 * cosine, 1e-30)))
        out[3] = np.arccos(max(-1.0, min(1.0, chord))) / limits[1]
        out[4] = np.sqrt(missed + w2 * miss * miss) / distance / limits[2]
    return distance


@kernel(inline=True)
def _begin(P, points, k, free, change, guess):  # type: ignore[no-untyped-def]
    """Row k + 1 of P and points: where Newton's method begins."""
    for a in range(P.shape[1]):
        P[k + 1, a] = P[k, a]
    P[k + 1, free] += change
    for a in range(guess.shape[0]):
        points[k + 1, a] = guess[a]


@kernel(inline=True)
def _rests(own, stages, period, scales, smallest, units, period_scale, error, band):  # type: ignore[no-untyped-def]
    """Whether `problems/orbit_adaption.py` would leave scales and mesh alone: the nodes' error lies in the band."""
    n = scales.shape[0]
    if not band[0] <= error <= band[1] or (own == 1 and not 0.5 <= period / period_scale <= 2.0):
        return False
    largest = 0.0
    for a in range(n):
        size = 0.0
        for j in range(stages.shape[0]):
            for i in range(a, stages.shape[1], n):
                size = max(size, abs(stages[j, i]))
        largest = max(largest, size / units[a])
    if not 0.0 < largest < np.inf:
        return False
    for a in range(n):
        size = 0.0
        for j in range(stages.shape[0]):
            for i in range(a, stages.shape[1], n):
                size = max(size, abs(stages[j, i]))
        wanted = max(size, smallest[a]) if size > 1e-6 * largest * units[a] else min(largest, 1.0) * units[a]
        if not 0.5 <= wanted / scales[a] <= 2.0:
            return False
    return True


@kernel(inline=True)
def _look(  # type: ignore[no-untyped-def]
    k, now, count, re, im, readings, signs, rates, steps, older, moved, watch, error, trust, growth, orientation,
    rounding, out,
):  # fmt: skip
    """out[10], out[11]: whether the multipliers of a new point, and the segment behind it, leave nothing in doubt."""
    row = k + 1
    out[10] = reading(
        re[row + 1], im[row + 1], count, error, trust, growth, orientation, rounding, readings[row + 1]
    )
    since, earlier = (older[1], older[0]) if k == 0 else (steps[now], rates[max(now - 1, 0)])
    out[11] = since > 0.0 and quiet(
        re, im, row, count, readings, signs, (earlier, rates[now], rates[now + 1]), (steps[now], steps[now + 1]), since,
        moved, watch,
    )


@kernel(inline=True)
def _next_length(distance, worst, iterations, pace, room):  # type: ignore[no-untyped-def]
    """`stepping.next_length`; room: in steps like the last one."""
    factor = 2.0 if worst == 0.0 else min(2.0, 0.5 / worst)
    if iterations > pace[2]:
        factor = min(factor, 1.2 if iterations == pace[2] + 1.0 else 0.7)
    ahead = max(pace[3] * room * distance, pace[4] * pace[0])
    return min(pace[0], min(distance * max(0.4, factor), ahead))


@kernel(inline=True)
def _normalised(weights, weight, x, t):  # type: ignore[no-untyped-def]
    """t = the unit tangent along x (u, parameter); returns the rate of the parameter."""
    size = weights.shape[0]
    total = (weight * x[size]) ** 2
    for a in range(size):
        total += weights[a] * x[a] * x[a]
    total = np.sqrt(total)
    for a in range(size):
        t[a] = x[a] / total
    return x[size] / total


@kernel
def march(  # type: ignore[no-untyped-def]
    by, field, period, span, phase, h, W, A, row_sums, update, b, leading, kept, position, S, jump, scales, weights,
    stage_weights, tolerance, max_iterations, free, own, past, weight, window, limits, pace, watch, older, known, trust,
    orientation, smallest, units, rest, length,
    P, points, tangents, rates, steps, re, im, readings, signs, T, F, J, Fp, dT, LU, pivots, Z, M, x, product,
    spectral, report, seen,
):  # fmt: skip
    """Take steps until one is not plainly good; returns how many were taken, at most K.

    Row 0 of P (K + 1, m) and points (K + 1, N) is the last point of the branch; row `past` of tangents
    (past + 1 + K, N), rates and steps its tangent and the length of the step to it, earlier ones before; row 1 of re,
    im (K + 2, n), readings (K + 2, 9) and signs its multipliers, row 0 those of the point before, `older` that point's
    rate and the arclength from it (0: there is none). limits : of angle, chord, miss, motion; pace : longest step, far,
    few, approach, creep; watch, trust, and the first and last of known : see quiet_segments; known[1] : error of the
    nodes; smallest, units : sizes of states; rest : period's scale, band of the nodes' error, steps to the next
    adaption and between adaptions. The rows behind are filled, with report (K, 4) of Newton's method and seen (K, 13):
    length asked for, distance, then angle, chord, miss and motion over their limits, the next length, int tr J ds,
    roughness, |M f - f| / |f|, whether the reading is complete (else it is the last step), whether the segment is
    quiet, whether the mesh may rest (else a step after which it is to be adapted is the last one). T, F, J, Fp, dT, Z,
    M, x, product and spectral (n, n), the monodromy matrix as it is and scaled, are those of the last step tried.
    """
    taken, size, n = 0, points.shape[1], scales.shape[0]
    intervals, inner = Z.shape[0], Z.shape[1]
    guess, f, column = np.empty(size), np.empty((1, n)), np.empty((1, n, P.shape[1]))
    square, other, packed = np.empty((n, n)), np.empty((n, n)), np.empty(n * n)
    before, after, spare = np.empty(n + 2), np.empty(n + 2), np.empty(12 * n)
    first = (intervals + 1) * n
    count, due, refused, shortened = n - own, rest[3], 0, False
    for attempt in range(seen.shape[0] + RETRIES):
        k = attempt - refused  # from a range: a literal 0 would be a type of its own, compiled once more
        if k == seen.shape[0]:
            break
        now, row, step = past + k, k + 1, min(length, pace[0])
        seen[k, 0] = seen[k, 0] if shortened else step
        change = _predict(points, tangents, rates, steps, k, now, step, pace[1], guess)
        if not window[0] <= P[k, free] + change <= window[1]:
            break
        _begin(P, points, k, free, change, guess)
        u, t = points[k + 1], tangents[now]
        nodes = u[:first].reshape((intervals + 1, n))
        stages = u[first : first + intervals * inner].reshape((intervals, inner))
        status = _newton(by[0], (
            (by[1], by[2]), field, period, span, phase, h, W, A, row_sums, update, kept, position, S, jump, scales,
            weights, stage_weights, P[k + 1], free, u, nodes, stages, T, 1, t,
            t[first : first + intervals * inner].reshape((intervals, inner)), rates[now], weight, 0.0, tolerance,
            max_iterations, F, J, Fp, dT, LU, pivots, Z, M, x, report[k],
        ))  # fmt: skip
        moved = P[k + 1, free] - P[k, free]
        if status != 0.0 or not window[0] <= P[k + 1, free] <= window[1]:
            break
        rates[now + 1] = _normalised(weights, weight, x[1], tangents[now + 1])
        distance = _compare(
            weights, weight, points, tangents, rates, guess, k, now, moved, moved - change, limits, seen[k]
        )
        trace, rough = summary(M, J, h, b, leading, scales, nodes, stages, product)
        largest, gap = _matrices(
            own, field, P[k + 1], phase, nodes, product, S, scales, spectral, f, column, other, square
        )
        if not _multipliers(by[3], square, count, packed, re[row + 1], im[row + 1], spare):
            break
        seen[k, 5] = _motion(re, im, row, count) / limits[3]
        worst = max(max(seen[k, 2], seen[k, 3]), max(seen[k, 4], seen[k, 5]))
        if 1.0 < worst < np.inf and refused < RETRIES and step >= SHORT * pace[0]:  # as the driver would, a few times
            length, refused, shortened = step * max(0.25, 0.8 / worst), refused + 1, True
            continue
        if not (worst <= 1.0 and 0.0 < distance <= 3.0 * step):
            break
        shortened = False
        steps[now + 1] = distance
        length = _next_length(distance, worst, report[k, 1], pace, _room(re, im, row, count, before, after))
        seen[k, 6], seen[k, 7], seen[k, 8], seen[k, 9] = length, trace, rough, gap
        signs[row + 1], factor = report[k, 3], carried(known[2], rough, trust)
        _look(
            k, now, count, re, im, readings, signs, rates, steps, older, moved, watch, factor * known[0], trust,
            trace * span * T[0], orientation, trust[4] * largest * n + gap, seen[k],
        )
        taken, due = k + 1, due - 1.0
        seen[k, 12] = due > 0.0 or _rests(
            own, stages, T[0], scales, smallest, units, rest[0], factor * known[1], (rest[1], rest[2])
        )
        if seen[k, 10] == 0.0 or seen[k, 12] == 0.0:
            break
        due = rest[4] if due <= 0.0 else due
    return taken
