"""Local elimination of collocation stages: one interval at a time, one LU factorisation each.

Linearised stage equations of interval j (see `gauss`), with z the coefficients of the columns carried along:

    G_j dY = (r x I) du_j + C_j z,     G_j = W x I - h_j sigma diag(J_1 .. J_m),    sigma = dt/ds (span of time),

unknowns stage-major (row i n + a is state a at stage i). Eliminating dY leaves a relation between neighbouring nodes,

    dY = Z_j du_j + X_j z,     du_{j+1} = M_j du_j + Q_j z,
    M_j = (1 - sum d) I + sum_i d_i Z_ji,    Q_j = sum_i d_i X_ji + (columns of the node equation),

so M_j is the monodromy matrix of the interval. Every parameter derivative and right-hand side is a column of C.

Oscillators have equations x_a' = v exactly. Their stages are known from those of the velocity, with A = W^-1,

    dx_i = dx_0 + h sigma sum_k A_ik dv_k + sum_k A_ik C_{x,k} z,

and are eliminated by hand; only the *kept* states enter the factorisation (half of them for a mechanical system, an
eighth of the work): G' = W x I - h sigma diag(J_vv) - (h sigma)^2 A_ik J_{vx,i}. ``kept[c]`` is the state index of the
c-th kept state, ``position[c]`` the state whose derivative it is, or -1. det G and det G' have the same sign.
Reference: T. F. Fairgrieve, A. D. Jepson (1991), SIAM J. Numer. Anal. 28, 1446-1462 (condensation and multipliers).
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel

__all__ = ["condense", "solve_stages", "solve_stages_transposed"]


@kernel(inline=True)
def eliminate(T, rows, size, width, swaps):  # type: ignore[no-untyped-def]
    """LU with row interchanges of the first `size` columns of T[:rows], applied to all `width` columns.

    Right-looking, four columns at a time. Row interchanges move the multipliers, kept below the diagonal, too (LAPACK's
    convention); `swaps` (size,) receives the pivot rows. Returns the sign of the product of the pivots and
    interchanges, 0 where a pivot is zero or not finite.
    """
    sign = 1.0
    for start in range(0, size, 4):
        stop = min(start + 4, size)
        for p in range(start, stop):
            best, row = abs(T[p, p]), p
            for i in range(p + 1, rows):
                value = abs(T[i, p])
                if value > best:
                    best, row = value, i
            swaps[p] = row
            if not (best > 0.0 and best < np.inf):
                return 0.0
            if row != p:
                sign = -sign
                for k in range(width):
                    T[p, k], T[row, k] = T[row, k], T[p, k]
            if T[p, p] < 0.0:
                sign = -sign
            inverse = 1.0 / T[p, p]
            for i in range(p + 1, rows):
                factor = T[i, p] * inverse
                T[i, p] = factor
                for k in range(p + 1, stop):
                    T[i, k] -= factor * T[p, k]
        for p in range(start + 1, stop):
            for i in range(start, p):
                factor = T[p, i]
                for k in range(stop, width):
                    T[p, k] -= factor * T[i, k]
        if stop == start + 4:
            for i in range(stop, rows):
                f, g, h, e = T[i, start], T[i, start + 1], T[i, start + 2], T[i, start + 3]
                for k in range(stop, width):
                    T[i, k] -= f * T[start, k] + g * T[start + 1, k] + h * T[start + 2, k] + e * T[start + 3, k]
        else:
            for p in range(start, stop):
                for i in range(stop, rows):
                    factor = T[i, p]
                    for k in range(stop, width):
                        T[i, k] -= factor * T[p, k]
    return sign


@kernel(inline=True)
def back_substitute(T, size, width):  # type: ignore[no-untyped-def]
    """Solve with the upper triangle of T[:size, :size] for the columns size .. width, in place, four rows at a time."""
    stop = size
    while stop > 0:
        start = max(stop - 4, 0)
        for p in range(stop - 1, start - 1, -1):
            inverse = 1.0 / T[p, p]
            for k in range(size, width):
                T[p, k] *= inverse
            for i in range(start, p):
                factor = T[i, p]
                for k in range(size, width):
                    T[i, k] -= factor * T[p, k]
        if stop - start == 4:
            for i in range(start):
                f, g, h, e = T[i, start], T[i, start + 1], T[i, start + 2], T[i, start + 3]
                for k in range(size, width):
                    T[i, k] -= f * T[start, k] + g * T[start + 1, k] + h * T[start + 2, k] + e * T[start + 3, k]
        stop = start


@kernel(inline=True)
def _integrated(A, kept, position, n, columns, j, H):  # type: ignore[no-untyped-def]
    """H (m, s, K): sum_k A_ik C_k of the equations x' = v, for each kept velocity."""
    degree, small, extra = A.shape[0], kept.shape[0], columns.shape[2]
    for c in range(small):
        a = position[c]
        if a >= 0:
            for i in range(degree):
                for e in range(extra):
                    H[i, c, e] = 0.0
                for k in range(degree):
                    factor = A[i, k]
                    for e in range(extra):
                        H[i, c, e] += factor * columns[j, k * n + a, e]


@kernel(inline=True)
def _assemble(W, A, row_sums, scale, J, first, kept, position, columns, j, H, T):  # type: ignore[no-untyped-def]
    """T = [G' | du_0 columns | C'] of interval j; `first` is the index of its first stage in J."""
    degree, small, n = W.shape[0], kept.shape[0], J.shape[1]
    size, extra = degree * small, columns.shape[2]
    for i in range(degree):
        for c in range(small):
            row, state = i * small + c, kept[c]
            for k in range(size + n):
                T[row, k] = 0.0
            for e in range(extra):
                T[row, size + n + e] = columns[j, i * n + state, e]
            for k in range(degree):
                T[row, k * small + c] = W[i, k]
            T[row, size + state] = row_sums[i]
            for b in range(small):
                T[row, i * small + b] -= scale * J[first + i, state, kept[b]]
                a = position[b]
                if a >= 0:
                    slope = scale * J[first + i, state, a]
                    if slope != 0.0:
                        T[row, size + a] += slope
                        twice = slope * scale
                        for k in range(degree):
                            T[row, k * small + b] -= twice * A[i, k]
                        for e in range(extra):
                            T[row, size + n + e] += slope * H[i, b, e]


@kernel(inline=True)
def _expand(A, scale, kept, position, T, size, n, H, columns, Z, j):  # type: ignore[no-untyped-def]
    """The stages of all states from those of the kept ones: columns[j] (mn, K) and Z[j] (mn, n)."""
    degree, small, extra = A.shape[0], kept.shape[0], columns.shape[2]
    for c in range(small):
        a, state = position[c], kept[c]
        for i in range(degree):
            for b in range(n):
                Z[j, i * n + state, b] = T[i * small + c, size + b]
            for e in range(extra):
                columns[j, i * n + state, e] = T[i * small + c, size + n + e]
        if a < 0:
            continue
        for i in range(degree):
            row = i * n + a
            for b in range(n):
                Z[j, row, b] = 0.0
            Z[j, row, a] = 1.0
            for e in range(extra):
                columns[j, row, e] = H[i, c, e]
            for k in range(degree):
                factor = scale * A[i, k]
                for b in range(n):
                    Z[j, row, b] += factor * T[k * small + c, size + b]
                for e in range(extra):
                    columns[j, row, e] += factor * T[k * small + c, size + n + e]


@kernel
def condense(W, A, row_sums, update, h, sigma, J, kept, position, columns, LU, pivots, Z, M):  # type: ignore[no-untyped-def]
    """Factor every interval, overwrite `columns` (N, mn, K) by X = G^-1 C, fill LU, pivots, Z (N, mn, n), M (N, n, n).

    LU (N, ms, ms) and pivots (N, ms) belong to the s kept states. Returns the product of the signs of the determinants
    (0: a singular interval).
    """
    intervals, extra = columns.shape[0], columns.shape[2]
    degree, small, n = W.shape[0], kept.shape[0], J.shape[1]
    size = degree * small
    T, H = np.empty((size, size + n + extra)), np.empty((degree, small, extra))
    swaps = np.empty(size, np.int64)
    total = 1.0
    for i in range(degree):
        total -= update[i]
    sign = 1.0
    for j in range(intervals):
        scale = h[j] * sigma
        _integrated(A, kept, position, n, columns, j, H)
        _assemble(W, A, row_sums, scale, J, j * degree, kept, position, columns, j, H, T)
        one = eliminate(T, size, size, size + n + extra, swaps)
        sign *= one
        if one == 0.0:
            return 0.0
        for row in range(size):
            pivots[j, row] = swaps[row]
            for k in range(size):
                LU[j, row, k] = T[row, k]
        back_substitute(T, size, size + n + extra)
        _expand(A, scale, kept, position, T, size, n, H, columns, Z, j)
        for a in range(n):
            for b in range(n):
                value = total if a == b else 0.0
                for i in range(degree):
                    value += update[i] * Z[j, i * n + a, b]
                M[j, a, b] = value
    return sign


@kernel
def solve_stages(A, h, sigma, J, kept, position, LU, pivots, columns):  # type: ignore[no-untyped-def]
    """Overwrite `columns` (N, mn, K) by G^-1 columns with the stored factors."""
    intervals, extra = columns.shape[0], columns.shape[2]
    degree, small, n = A.shape[0], kept.shape[0], J.shape[1]
    size = degree * small
    T, H, Z = np.empty((size, n + extra)), np.empty((degree, small, extra)), np.empty((1, degree * n, n))
    part = np.empty((1, degree * n, extra))
    for j in range(intervals):
        scale = h[j] * sigma
        _integrated(A, kept, position, n, columns, j, H)
        for i in range(degree):
            for c in range(small):
                for b in range(n):
                    T[i * small + c, b] = 0.0
                for e in range(extra):
                    T[i * small + c, n + e] = columns[j, i * n + kept[c], e]
                for b in range(small):
                    if position[b] >= 0:
                        slope = scale * J[j * degree + i, kept[c], position[b]]
                        for e in range(extra):
                            T[i * small + c, n + e] += slope * H[i, b, e]
        for p in range(size):
            row = pivots[j, p]
            if row != p:
                for k in range(n, n + extra):
                    T[p, k], T[row, k] = T[row, k], T[p, k]
        for p in range(size):
            for i in range(p + 1, size):
                for k in range(n, n + extra):
                    T[i, k] -= LU[j, i, p] * T[p, k]
        for p in range(size - 1, -1, -1):
            for k in range(n, n + extra):
                T[p, k] /= LU[j, p, p]
                for i in range(p):
                    T[i, k] -= LU[j, i, p] * T[p, k]
        _expand(A, scale, kept, position, T, 0, n, H, part, Z, 0)
        for row in range(degree * n):
            for e in range(extra):
                columns[j, row, e] = part[0, row, e]


@kernel
def solve_stages_transposed(A, h, sigma, J, kept, position, LU, pivots, columns):  # type: ignore[no-untyped-def]
    """Overwrite `columns` (N, mn) by G^-T columns.

    G'^T y_v = c_v + h sigma A^T c_x,  y_x = A^T (c_x + h sigma J_x^T y_v)
    """
    intervals = columns.shape[0]
    degree, small, n = A.shape[0], kept.shape[0], J.shape[1]
    size = degree * small
    y = np.empty(size)
    hold = np.empty(degree)
    for j in range(intervals):
        scale = h[j] * sigma
        for i in range(degree):
            for c in range(small):
                y[i * small + c] = columns[j, i * n + kept[c]]
                if position[c] >= 0:
                    for k in range(degree):
                        y[i * small + c] += scale * A[k, i] * columns[j, k * n + position[c]]
        for p in range(size):
            for i in range(p):
                y[p] -= LU[j, i, p] * y[i]
            y[p] /= LU[j, p, p]
        for p in range(size - 1, -1, -1):
            for i in range(p + 1, size):
                y[p] -= LU[j, i, p] * y[i]
        for p in range(size - 1, -1, -1):
            row = pivots[j, p]
            y[p], y[row] = y[row], y[p]
        for c in range(small):
            a = position[c]
            if a >= 0:
                for i in range(degree):
                    hold[i] = columns[j, i * n + a]
                    for b in range(small):
                        hold[i] += scale * J[j * degree + i, kept[b], a] * y[i * small + b]
                for i in range(degree):
                    value = 0.0
                    for k in range(degree):
                        value += A[k, i] * hold[k]
                    columns[j, i * n + a] = value
        for i in range(degree):
            for c in range(small):
                columns[j, i * n + kept[c]] = y[i * small + c]
