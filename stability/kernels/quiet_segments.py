r"""Points of a march: what their multipliers say, and whether anything can have happened since the point before.

Counts and verdict are those of `problems/orbit_spectrum.py` and `problems/collocation_error.py`, where nothing is in
doubt: no multiplier so near the unit circle, or so small, that its error would have to be computed anew.

A segment between neighbours a, b, with the point before them, is *quiet* where `following/searching.py` would find
nothing to look at: the counts, the sign of the determinant and that of the parameter's rate are the same at both ends;
the cubic of the parameter does not turn twice; no parabola through three neighbours of a test function or of a single
multiplier's growth comes near zero; no real multiplier should have crossed and has not. Multipliers are matched as the
nearest of each other; where two want the same one, or there are more than six, the segment counts as not quiet. A
segment that is not quiet is only one that has to be looked at.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel

__all__ = ["carried", "quiet", "reading"]

_MOST = 6


@kernel(inline=True)
def carried(known, rough, trust):  # type: ignore[no-untyped-def]
    """By how much an error at an earlier point of the mesh, of roughness `known`, grows; infinite: it says nothing."""
    ratio = rough / known if known > 0.0 else np.inf
    return trust[0] * max(1.0, ratio) ** 2 if 0.0 < ratio < trust[1] else np.inf


@kernel(inline=True)
def reading(re, im, count, carried, trust, growth, orientation, rounding, out):  # type: ignore[no-untyped-def]
    """Fill out (9,): error, verdict (1 stable, -1 unstable), unstable, beyond +1, beyond -1, pairs, three tests.

    carried : error of the multipliers by the mesh, infinite if it is not known; growth : int tr J dt; rounding : of the
    product. False where the error has to be computed.
    """
    near, largest, smallest, product = np.inf, 1.0, np.inf, 1.0
    plus = minus = pairs = 0
    for i in range(count):
        size = np.sqrt(re[i] * re[i] + im[i] * im[i])
        near, largest, smallest = min(near, abs(size - 1.0)), max(largest, size), min(smallest, size)
        product *= size
        if size > 1.0 and im[i] == 0.0:
            plus, minus = plus + (re[i] > 0.0), minus + (re[i] < 0.0)
        elif size > 1.0 and im[i] > 0.0:
            pairs += 1
    out[2], out[3], out[4], out[5] = plus + minus + 2 * pairs, plus, minus, pairs
    for which in range(3):  # prod (mu - 1), prod (mu + 1), prod (mu_i mu_j - 1)
        a, b = 1.0, 0.0
        for i in range(count):
            if which < 2:
                x, y = re[i] + (2.0 * which - 1.0), im[i]
                a, b = a * x - b * y, a * y + b * x
            else:
                for j in range(i + 1, count):
                    x, y = re[i] * re[j] - im[i] * im[j] - 1.0, re[i] * im[j] + im[i] * re[j]
                    a, b = a * x - b * y, a * y + b * x
        out[6 + which] = a if abs(a) < np.inf else np.inf
    tests = out[6] < np.inf and out[7] < np.inf and out[8] < np.inf
    if count > _MOST or not tests or not (largest < np.inf and near > trust[2] * carried + trust[3]):
        return False
    if smallest < 1e-10 * largest:
        return False
    others, real, turn = 1.0, 1.0, 0.0
    for i in range(count):
        real, turn = real * re[i] - turn * im[i], real * im[i] + turn * re[i]
        others *= max(np.sqrt(re[i] * re[i] + im[i] * im[i]), 1e-3 * largest)
    expected = orientation * np.exp(min(growth, 700.0))
    if abs(expected) < product and smallest < 1e-3 * largest:
        return False  # perhaps the smallest ones are smaller
    error = carried + rounding + abs(real - expected) / others
    radius = 0.0
    for i in range(count):
        radius = max(radius, np.sqrt(re[i] * re[i] + im[i] * im[i]))
    out[0] = error
    out[1] = -1.0 if radius > 1.0 + error else (1.0 if radius < 1.0 - error else 0.0)
    return out[1] != 0.0


@kernel(inline=True)
def _depth(x1, x2, y0, y1, y2):  # type: ignore[no-untyped-def]
    """Of the vertex of the parabola through (0, y0), (x1, y1), (x2, y2), over the second smallest value; 1: none."""
    if not (y0 * y1 > 0.0 and y1 * y2 > 0.0 and 0.0 < x1 < x2):
        return 1.0
    first, second = (y1 - y0) / x1, (y2 - y1) / (x2 - x1)
    bend = (second - first) / x2
    if bend * y1 <= 0.0:
        return 1.0
    x = 0.5 * x1 - first / (2.0 * bend)
    if not 0.0 < x < x2:
        return 1.0
    value = y0 + first * x + bend * x * (x - x1)
    low, middle, high = abs(y0), abs(y1), abs(y2)
    second = max(min(low, middle), min(max(low, middle), high))
    return (value if y1 > 0.0 else -value) / second


@kernel(inline=True)
def _nearest(re, im, k, i, row, count):  # type: ignore[no-untyped-def]
    """The multiplier of a row that is nearest to the i-th of row k; -1 where another one of row k wants it, too."""
    best, place = np.inf, 0
    for j in range(count):
        gap = (re[k, i] - re[row, j]) ** 2 + (im[k, i] - im[row, j]) ** 2
        if gap < best:
            best, place = gap, j
    for other in range(count):
        if other != i:
            best, wanted = np.inf, 0
            for j in range(count):
                gap = (re[k, other] - re[row, j]) ** 2 + (im[k, other] - im[row, j]) ** 2
                if gap < best:
                    best, wanted = gap, j
            if wanted == place:
                return -1
    return place


@kernel(inline=True)
def _growth(re, im, row, i):  # type: ignore[no-untyped-def]
    return 0.5 * np.log(re[row, i] ** 2 + im[row, i] ** 2)


@kernel(inline=True)
def quiet(re, im, k, count, readings, signs, rates, steps, gap, moved, watch):  # type: ignore[no-untyped-def]
    """Whether nothing can have happened between the points k and k + 1; row k - 1 is the point before them.

    readings (.., 9) and signs (of determinants) by rows, like re, im; rates of the parameter at the three points, steps
    that led to the last two; gap: arclength from k - 1 to k; moved: the parameter's change. watch: depth of a dip,
    share of a sudden fall, share of a rate that turns.
    """
    r0, r1, r2 = rates
    before, after = steps
    if count > _MOST or not (r0 * r1 > 0.0 and r1 * r2 > 0.0 and signs[k] * signs[k + 1] > 0.0):
        return False
    for c in range(2, 6):
        if readings[k, c] != readings[k + 1, c]:
            return False
    mean = moved / after
    curvature = 3.0 * (r1 + r2) - 6.0 * mean
    if curvature != 0.0:
        x = (2.0 * r1 + r2 - 3.0 * mean) / curvature
        rate = r1 * (1.0 - x) * (1.0 - 3.0 * x) + 6.0 * x * (1.0 - x) * mean + r2 * x * (3.0 * x - 2.0)
        if 0.0 < x < 1.0 and rate * r1 <= watch[2] * r1 * r1:
            return False
    x1, x2 = gap, gap + after
    if _depth(x1, x2, r0, r1, r2) < watch[0]:
        return False
    for c in range(6, 8):
        if _depth(x1, x2, readings[k - 1, c], readings[k, c], readings[k + 1, c]) < watch[0]:
            return False
    for i in range(count):
        earlier, later = _nearest(re, im, k, i, k - 1, count), _nearest(re, im, k, i, k + 1, count)
        if earlier < 0 or later < 0:
            return False
        y0, y1, y2 = _growth(re, im, k - 1, earlier), _growth(re, im, k, i), _growth(re, im, k + 1, later)
        if not (abs(y0) < np.inf and abs(y1) < np.inf and abs(y2) < np.inf):
            return False
        if _depth(x1, x2, y0, y1, y2) < watch[0]:
            return False
        if im[k, i] == 0.0 and before > 0.0:
            for _ in range(2):  # the growth, and its ratio to the parameter's rate
                ahead = y1 + (y1 - y0) * (after / before)
                if y0 * y1 > 0.0 and y1 * y2 > 0.0 and (ahead * y1 < 0.0 or abs(y2) < watch[1] * abs(y1)):
                    return False
                y0, y1, y2 = y0 / abs(r0), y1 / abs(r1), y2 / abs(r2)
    return True
