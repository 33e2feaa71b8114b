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
c-th kept state, ``position[c]`` the state whose derivative it is, or -1. det G and det G' have the same sign. Rows and
columns of G' are ordered by state, then by stage (c m + i): what the Jacobian leaves out are then whole blocks.
Reference: T. F. Fairgrieve, A. D. Jepson (1991), SIAM J. Numer. Anal. 28, 1446-1462 (condensation and multipliers).
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel
from stability.kernels.elimination import eliminate_lanes, substitute_lanes
from stability.kernels.vectors import LANES

__all__ = ["condense", "solve_stages", "solve_stages_transposed"]

MEMORY = 98304  # numbers of the intervals that are eliminated together; at least eight of them, at most 64


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
def _expand(A, scale, kept, position, T, size, n, H, columns, j):  # type: ignore[no-untyped-def]
    """The stages of all states from those of the kept ones: columns[j] (mn, K)."""
    degree, small, extra = A.shape[0], kept.shape[0], columns.shape[2]
    for c in range(small):
        a, state = position[c], kept[c]
        for i in range(degree):
            for e in range(extra):
                columns[j, i * n + state, e] = T[c * degree + i, e]
        if a < 0:
            continue
        for i in range(degree):
            for e in range(extra):
                columns[j, i * n + a, e] = H[i, c, e]
            for k in range(degree):
                factor = scale * A[i, k]
                for e in range(extra):
                    columns[j, i * n + a, e] += factor * T[c * degree + k, e]


# ---------------------------------------------------------------------- many intervals at a time
@kernel(inline=True)
def _template(W, A, row_sums, kept, position, n, columns, at, wide, T, H, V):  # type: ignore[no-untyped-def]
    """What of T = [G' | du_0 columns | C'] does not depend on J, and H: sum_k A_ik C_k of the equations x' = v."""
    degree, small, extra = W.shape[0], kept.shape[0], columns.shape[2]
    size = degree * small
    for c in range(small):
        a, state = position[c], kept[c]
        for i in range(degree):
            row = c * degree + i
            for k in range(size + n):
                for q in range(wide):
                    T[row, k, q] = 0.0
            for k in range(degree):
                for q in range(wide):
                    T[row, c * degree + k, q] = W[i, k]
            for q in range(wide):
                T[row, size + state, q] = row_sums[i]
            for e in range(extra):
                for q in range(wide):
                    T[row, size + n + e, q] = columns[at[q], i * n + state, e]
            for e in range(extra):
                for q in range(wide):
                    H[i, c, e, q] = 0.0
        for k in range(degree if a >= 0 else 0):
            for e in range(extra):
                for q in range(wide):
                    V[e, q] = columns[at[q], k * n + a, e]
            for i in range(degree):
                for e in range(extra):
                    for q in range(wide):
                        H[i, c, e, q] += A[i, k] * V[e, q]


@kernel(inline=True)
def _assemble(A, scale, J, kept, position, extra, at, wide, H, slope, T, V, begin, end):  # type: ignore[no-untyped-def]
    """Add what depends on the Jacobians J of the intervals `at`; where rows of G' begin and end."""
    degree, small, n = A.shape[0], kept.shape[0], J.shape[1]
    size = degree * small
    for c in range(small):
        for i in range(degree):
            row = c * degree + i
            begin[row], end[row] = c * degree, (c + 1) * degree
            for b in range(n):
                for q in range(wide):
                    V[b, q] = J[at[q] * degree + i, kept[c], b]
            for b in range(small):
                a, state, coupled = position[b], kept[b], False
                q = 0
                while q < wide and not coupled:
                    coupled = V[state, q] != 0.0 or (a >= 0 and V[a, q] != 0.0)
                    q += 1
                if not coupled:
                    continue
                begin[row], end[row] = min(begin[row], b * degree), max(end[row], (b + 1) * degree)
                for q in range(wide):
                    T[row, b * degree + i, q] -= scale[q] * V[state, q]
                if a < 0:
                    continue
                for q in range(wide):
                    slope[q] = scale[q] * V[a, q]
                    T[row, size + a, q] += slope[q]
                for e in range(extra):
                    for q in range(wide):
                        T[row, size + n + e, q] += slope[q] * H[i, b, e, q]
                for q in range(wide):
                    slope[q] *= scale[q]
                for k in range(degree):
                    for q in range(wide):
                        T[row, b * degree + k, q] -= slope[q] * A[i, k]


@kernel(inline=True)
def _collect(A, scale, kept, position, T, size, n, H, at, wide, V, columns, Z):  # type: ignore[no-untyped-def]
    """The stages of all states from those of the kept ones: columns (N, mn, K) and Z (N, mn, n)."""
    degree, small, extra = A.shape[0], kept.shape[0], columns.shape[2]
    for c in range(small):
        a, state = position[c], kept[c]
        for i in range(degree):
            row = c * degree + i
            for b in range(n):
                for q in range(wide):
                    Z[at[q], i * n + state, b] = T[row, size + b, q]
            for e in range(extra):
                for q in range(wide):
                    columns[at[q], i * n + state, e] = T[row, size + n + e, q]
            if a < 0:
                continue
            for b in range(n + extra):
                for q in range(wide):
                    V[b, q] = 0.0
                for k in range(degree):
                    for q in range(wide):
                        V[b, q] += A[i, k] * T[c * degree + k, size + b, q]
            for b in range(n):
                for q in range(wide):
                    Z[at[q], i * n + a, b] = scale[q] * V[b, q]
            for q in range(wide):
                Z[at[q], i * n + a, a] = scale[q] * V[a, q] + 1.0
            for e in range(extra):
                for q in range(wide):
                    columns[at[q], i * n + a, e] = scale[q] * V[n + e, q] + H[i, c, e, q]


@kernel
def condense(W, A, row_sums, update, h, sigma, J, kept, position, columns, LU, pivots, Z, M):  # type: ignore[no-untyped-def]
    """Factor every interval, overwrite `columns` (N, mn, K) by X = G^-1 C, fill LU, pivots, Z (N, mn, n), M (N, n, n).

    LU (N, ms, ms) and pivots (N, ms) belong to the s kept states; empty ones are left alone. Returns the product of the
    signs of the determinants (0: a singular interval). Intervals are eliminated together, up to 64.
    """
    intervals, extra = columns.shape[0], columns.shape[2]
    degree, small, n = W.shape[0], kept.shape[0], J.shape[1]
    size = degree * small
    width = size + n + extra
    most = LANES * max(1, min((intervals + LANES - 1) // LANES, min(64, MEMORY // (size * width)) // LANES))
    T, H, V = np.empty((size, width, most)), np.empty((degree, small, extra, most)), np.empty((n + extra, most))
    swaps, hold, scale = np.empty((size, most), np.int64), np.empty(most), np.empty(most)
    begin, end, at = np.empty(size, np.int64), np.empty(size, np.int64), np.empty(most, np.int64)
    total = 1.0
    for i in range(degree):
        total -= update[i]
    sign = 1.0
    for first in range(0, intervals, most):
        lanes = min(most, intervals - first)
        wide = (lanes + LANES - 1) // LANES * LANES
        for q in range(wide):  # lanes that are left over do the last interval once more
            at[q] = min(first + q, intervals - 1)
            scale[q] = h[at[q]] * sigma
        _template(W, A, row_sums, kept, position, n, columns, at, wide, T, H, V)
        _assemble(A, scale, J, kept, position, extra, at, wide, H, hold, T, V, begin, end)
        sign *= eliminate_lanes(T, size, width, lanes, wide, swaps, hold, begin, end)
        if sign == 0.0:
            return 0.0
        if LU.shape[0] > 0:
            for row in range(size):
                for q in range(lanes):
                    pivots[first + q, row] = swaps[row, q]
                    for k in range(size):
                        LU[first + q, row, k] = T[row, k, q]
        substitute_lanes(T, size, width, wide, hold, end)
        _collect(A, scale, kept, position, T, size, n, H, at, wide, V, columns, Z)
    for j in range(intervals):
        for a in range(n):
            for b in range(n):
                M[j, a, b] = total if a == b else 0.0
            for i in range(degree):
                for b in range(n):
                    M[j, a, b] += update[i] * Z[j, i * n + a, b]
    return sign


@kernel
def solve_stages(A, h, sigma, J, kept, position, LU, pivots, columns):  # type: ignore[no-untyped-def]
    """Overwrite `columns` (N, mn, K) by G^-1 columns with the stored factors."""
    intervals, extra = columns.shape[0], columns.shape[2]
    degree, small, n = A.shape[0], kept.shape[0], J.shape[1]
    size = degree * small
    T, H = np.empty((size, extra)), np.empty((degree, small, extra))
    for j in range(intervals):
        scale = h[j] * sigma
        _integrated(A, kept, position, n, columns, j, H)
        for i in range(degree):
            for c in range(small):
                for e in range(extra):
                    T[c * degree + i, e] = columns[j, i * n + kept[c], e]
                for b in range(small):
                    if position[b] >= 0:
                        slope = scale * J[j * degree + i, kept[c], position[b]]
                        for e in range(extra):
                            T[c * degree + i, e] += slope * H[i, b, e]
        for p in range(size):
            row = pivots[j, p]
            if row != p:
                for k in range(extra):
                    T[p, k], T[row, k] = T[row, k], T[p, k]
        for p in range(size):
            for i in range(p + 1, size):
                for k in range(extra):
                    T[i, k] -= LU[j, i, p] * T[p, k]
        for p in range(size - 1, -1, -1):
            for k in range(extra):
                T[p, k] /= LU[j, p, p]
                for i in range(p):
                    T[i, k] -= LU[j, i, p] * T[p, k]
        _expand(A, scale, kept, position, T, size, n, H, columns, j)


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
                y[c * degree + i] = columns[j, i * n + kept[c]]
                if position[c] >= 0:
                    for k in range(degree):
                        y[c * degree + i] += scale * A[k, i] * columns[j, k * n + position[c]]
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
                        hold[i] += scale * J[j * degree + i, kept[b], a] * y[b * degree + i]
                for i in range(degree):
                    value = 0.0
                    for k in range(degree):
                        value += A[k, i] * hold[k]
                    columns[j, i * n + a] = value
        for i in range(degree):
            for c in range(small):
                columns[j, i * n + kept[c]] = y[c * degree + i]
