"""The bordered periodic system that remains after local elimination (see `condensation`).

    du_{j+1} = M_j du_j + Q_j z           (j = 0 .. N-1)
    du_N     = S du_0 + q_N z             boundary condition x(1) = S x(0) + w
    sum_j rho_j . dY_j + sum_j tau_j . du_j = gamma z       q border rows,

where z = (-lambda_1 .. -lambda_q, 1 of one right-hand side): a column is the coefficient of an unknown parameter
(moved to the right) or a right-hand side. Neighbouring M_j are multiplied as long as the product stays moderate; the
nodes between such groups are eliminated with row interchanges among the 2n rows that hold the node, so that strongly
expanding and contracting directions do no harm (a plain product over the period loses as many digits as its largest
partial product has). A dense system of n + q unknowns is left.
Reference: S. J. Wright (1993), SIAM J. Numer. Anal. 30, 1-29 (structured elimination for boundary value problems).
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel
from stability.kernels.elimination import back_substitute, eliminate

__all__ = ["monodromy_product", "reduce_and_solve", "summary"]

LIMIT = 100.0  # largest entry of a product of neighbouring M_j: at most two digits are lost inside a group


@kernel(inline=True, sums=True)
def _gather(update, Z, X, nodes, rows, node_rows, corner):  # type: ignore[no-untyped-def]
    """Q (N, n, K), border coefficients of the nodes (q, N+1, n) and the reduced right sides of the borders (q, K)."""
    intervals, size, extra = X.shape
    n = Z.shape[2]
    degree = size // n
    q = corner.shape[0]
    Q = np.empty((intervals, n, extra))
    borders = np.empty((q, intervals + 1, n))
    reduced = np.empty((q, extra))
    for r in range(q):
        for k in range(extra):
            reduced[r, k] = corner[r, k]
    for j in range(intervals):
        for a in range(n):
            for k in range(extra):
                value = nodes[j, a, k]
                for i in range(degree):
                    value += update[i] * X[j, i * n + a, k]
                Q[j, a, k] = value
        for r in range(q):
            for b in range(n):
                borders[r, j, b] = node_rows[r, j, b]
            for row in range(size):
                factor = rows[r, j, row]
                if factor != 0.0:
                    for b in range(n):
                        borders[r, j, b] += factor * Z[j, row, b]
                    for k in range(extra):
                        reduced[r, k] -= factor * X[j, row, k]
    for r in range(q):
        for b in range(n):
            borders[r, intervals, b] = node_rows[r, intervals, b]
    return Q, borders, reduced


@kernel(inline=True, sums=True)
def _group(M, Q, borders, reduced, ends, G):  # type: ignore[no-untyped-def]
    """Multiply the M_j of neighbouring intervals as long as the product stays moderate.

    Group i holds the nodes ends[i] .. ends[i+1]; G[i] = [E | g] (n, n + K): u at its end = E u at its start + g z. The
    border coefficients of its inner nodes are moved to its start. Returns the number of groups.
    """
    intervals, n, extra = Q.shape
    q = borders.shape[0]
    count = 0
    ends[0] = 0
    hold = np.empty((n, n + extra))
    for j in range(intervals):
        new = ends[count] == j
        for a in range(n):
            for b in range(n):
                hold[a, b] = M[j, a, b] if new else 0.0
            for k in range(extra):
                hold[a, n + k] = Q[j, a, k]
        if not new:
            for c in range(n):
                for a in range(n):
                    factor = M[j, a, c]
                    for k in range(n + extra):
                        hold[a, k] += factor * G[count, c, k]
                for r in range(q):
                    factor = borders[r, j, c]
                    for b in range(n):
                        borders[r, ends[count], b] += factor * G[count, c, b]
                    for k in range(extra):
                        reduced[r, k] -= factor * G[count, c, n + k]
        largest = 0.0
        for a in range(n):
            for k in range(n + extra):
                G[count, a, k] = hold[a, k]
                if k < n:
                    largest = max(largest, abs(hold[a, k]))
        if largest > LIMIT or j == intervals - 1:
            count += 1
            ends[count] = j + 1
    return count


@kernel(inline=True, sums=True)
def _chain(G, count, ends, borders, reduced, R):  # type: ignore[no-untyped-def]
    """Eliminate the nodes between groups. R (count-1, n, 3n+K) receives the pivot rows [u_i | u_0 | u_{i+1} | z].

    Returns the last relation T[:n] = [coefficient of u_N | of u_0 | . | z] and the sign.
    """
    n = G.shape[1]
    extra = G.shape[2] - n
    q = borders.shape[0]
    width = 3 * n + extra
    T = np.empty((2 * n, width))
    swaps = np.empty(n, np.int64)
    sign = 1.0
    for a in range(n):
        for b in range(n):
            T[a, b] = 0.0
            T[a, n + b] = -G[0, a, b]
        T[a, a] = 1.0
        for k in range(extra):
            T[a, 3 * n + k] = G[0, a, n + k]
    for i in range(1, count):
        here, after = ends[i], ends[i + 1]
        for a in range(n):
            for b in range(n):
                T[n + a, b] = -G[i, a, b]
                T[n + a, n + b] = 0.0
                T[n + a, 2 * n + b] = 0.0
                T[a, 2 * n + b] = 0.0
            T[n + a, 2 * n + a] = 1.0
            for k in range(extra):
                T[n + a, 3 * n + k] = G[i, a, n + k]
        one = eliminate(T, 2 * n, n, width, swaps)
        if one == 0.0:
            return T, 0.0
        sign *= one
        for r in range(q):
            for p in range(n):
                factor = borders[r, here, p] / T[p, p]
                for b in range(p + 1, n):
                    borders[r, here, b] -= factor * T[p, b]
                for b in range(n):
                    borders[r, 0, b] -= factor * T[p, n + b]
                    borders[r, after, b] -= factor * T[p, 2 * n + b]
                for k in range(extra):
                    reduced[r, k] -= factor * T[p, 3 * n + k]
        for a in range(n):
            for k in range(width):
                R[i - 1, a, k] = T[a, k]
            for b in range(n):
                T[a, b] = T[n + a, 2 * n + b]
                T[a, n + b] = T[n + a, n + b]
            for k in range(extra):
                T[a, 3 * n + k] = T[n + a, 3 * n + k]
    return T, sign


@kernel(inline=True, sums=True)
def _dense(T, borders, reduced, S, end, tangent):  # type: ignore[no-untyped-def]
    """The (n+q) system in (u_0, lambda) with its right sides, rows scaled to unit size; solved in place."""
    n = S.shape[0]
    q, extra = reduced.shape
    intervals = borders.shape[1] - 1
    sides = extra - q + tangent
    size = n + q
    D = np.empty((size, size + sides))
    for a in range(size):
        for b in range(size, size + sides):
            D[a, b] = 0.0
        for b in range(n):
            D[a, b] = T[a, n + b] if a < n else borders[a - n, 0, b]
        for k in range(extra):
            D[a, n + k] = T[a, 3 * n + k] if a < n else reduced[a - n, k]
        for c in range(n):
            factor = T[a, c] if a < n else borders[a - n, intervals, c]
            if factor != 0.0:
                for b in range(n):
                    D[a, b] += factor * S[c, b]
                for k in range(extra):
                    D[a, n + k] -= factor * end[c, k]
    if tangent == 1:
        D[size - 1, size + sides - 1] = 1.0
    for a in range(size):
        largest = 0.0
        for b in range(size):
            largest = max(largest, abs(D[a, b]))
        if largest > 0.0:
            for b in range(size + sides):
                D[a, b] /= largest
    sign = eliminate(D, size, size, size + sides, np.empty(size, np.int64))
    if sign != 0.0:
        back_substitute(D, size, size + sides)
    return D, sign


@kernel(sums=True)
def reduce_and_solve(update, Z, M, X, nodes, rows, node_rows, corner, S, tangent, out):  # type: ignore[no-untyped-def]
    """Solve the bordered system for every right-hand side.

    Parameters: X (N, mn, K) = G^-1 C and nodes (N+1, n, K), the columns of the node equations (last: the boundary
    condition); the first q of the K columns belong to unknown parameters. rows (q, N, mn), node_rows (q, N+1, n),
    corner (q, K). `tangent` = 1 adds one right side: zero but for a 1 in the last border row.
    out (sides, (N + 1) n + N mn + q) receives nodes, stages and parameters of each. Returns the sign (0: singular).
    """
    intervals, size, extra = X.shape
    n = Z.shape[2]
    q = corner.shape[0]
    sides = extra - q + tangent
    Q, borders, reduced = _gather(update, Z, X, nodes, rows, node_rows, corner)
    ends, G = np.empty(intervals + 1, np.int64), np.empty((intervals, n, n + extra))
    count = _group(M, Q, borders, reduced, ends, G)
    R = np.empty((max(count - 1, 1), n, 3 * n + extra))
    T, sign = _chain(G, count, ends, borders, reduced, R)
    if sign == 0.0:
        return 0.0
    D, one = _dense(T, borders, reduced, S, nodes[intervals], tangent)
    if one == 0.0:
        return 0.0
    z, du, first = np.empty(extra), np.empty((sides, intervals + 1, n)), (intervals + 1) * n
    for side in range(sides):
        column = n + q + side
        for k in range(extra):
            z[k] = 0.0
        for k in range(q):
            out[side, first + intervals * size + k] = D[n + k, column]
            z[k] = -D[n + k, column]
        if q + side < extra:
            z[q + side] = 1.0
        for a in range(n):
            du[side, 0, a] = D[a, column]
        for a in range(n):
            value = 0.0
            for k in range(extra):
                value += nodes[intervals, a, k] * z[k]
            for b in range(n):
                value += S[a, b] * du[side, 0, b]
            du[side, intervals, a] = value
        for i in range(count - 1, 0, -1):
            here, after = ends[i], ends[i + 1]
            for p in range(n - 1, -1, -1):
                value = 0.0
                for k in range(extra):
                    value += R[i - 1, p, 3 * n + k] * z[k]
                for b in range(n):
                    value -= R[i - 1, p, n + b] * du[side, 0, b] + R[i - 1, p, 2 * n + b] * du[side, after, b]
                for b in range(p + 1, n):
                    value -= R[i - 1, p, b] * du[side, here, b]
                du[side, here, p] = value / R[i - 1, p, p]
        for i in range(count):
            for j in range(ends[i] + 1, ends[i + 1]):
                for a in range(n):
                    value = 0.0
                    for k in range(extra):
                        value += Q[j - 1, a, k] * z[k]
                    for b in range(n):
                        value += M[j - 1, a, b] * du[side, j - 1, b]
                    du[side, j, a] = value
        for j in range(intervals):
            for row in range(size):
                value = 0.0
                for b in range(n):
                    value += Z[j, row, b] * du[side, j, b]
                for k in range(extra):
                    value += X[j, row, k] * z[k]
                out[side, first + j * size + row] = value
        for j in range(intervals + 1):
            for a in range(n):
                out[side, j * n + a] = du[side, j, a]
    return sign * one


@kernel(inline=True, sums=True)
def _multiply_all(M, product, work):  # type: ignore[no-untyped-def]
    """product (n, n) = M_{N-1} .. M_0; `work` (n, n) is room for it."""
    intervals, n, _ = M.shape
    for a in range(n):
        for b in range(n):
            product[a, b] = 1.0 if a == b else 0.0
    for j in range(intervals):
        for a in range(n):
            for b in range(n):
                value = 0.0
                for c in range(n):
                    value += M[j, a, c] * product[c, b]
                work[a, b] = value
        for a in range(n):
            for b in range(n):
                product[a, b] = work[a, b]


@kernel(sums=True)
def monodromy_product(M):  # type: ignore[no-untyped-def]
    """M_{N-1} .. M_0."""
    n = M.shape[1]
    product = np.empty((n, n))
    _multiply_all(M, product, np.empty((n, n)))
    return product


@kernel(sums=True)
def summary(M, J, h, b, leading, scales, nodes, Y, product):  # type: ignore[no-untyped-def]
    """What a point of a branch is asked for: (int tr J ds, roughness), and the product M_{N-1} .. M_0.

    The integral by the Gauss weights b; the roughness is the largest last term h^m x^(m) / m! of scaled polynomials,
    whose coefficients are `leading` (see `gauss`): what the mesh resolves worst.
    """
    n, degree = scales.shape[0], b.shape[0]
    trace, rough = 0.0, 0.0
    for j in range(h.shape[0]):
        for i in range(degree):
            for a in range(n):
                trace += h[j] * b[i] * J[j * degree + i, a, a]
        for a in range(n):
            value = leading[0] * nodes[j, a]
            for i in range(degree):
                value += leading[i + 1] * Y[j, i * n + a]
            rough = max(rough, abs(value) / scales[a])
    _multiply_all(M, product, np.empty((n, n)))
    return trace, rough
