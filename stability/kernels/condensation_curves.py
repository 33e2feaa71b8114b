r"""Newton's method for curves of special orbits in two parameters, one compiled call for a whole solve.

To the discretised orbit (`condensation_newton`) come q conditions g and q - 1 extra unknowns e,

    kind              A                            g                                      e
    fold              core S                       G                                      -
    period doubling   M + I                        G                                      -
    torus             M^2 - 2 c M + I              G in coordinates of W^T V, W^T M V      c = cos(theta)

with G, w, v of `bordering`, M = D^-1 S^-1 Phi D and the core as in problems/collocation_linearisation.py, and the
gradients of g = - w^T dA v by one forward and one backward sweep each (`condensation_sweeps.gradient`). One step is one
bordered solve with the unknowns (u, lambda_1, lambda_2, e). Borders are taken anew at every iterate; once a step was
small, the next one is tried with the gradients and borders of the iterate before, everything else new: if it ends the
iteration, no gradient had to be made, else it is made then. Reference: Kuznetsov (2004), 10.3; Govaerts (2000), 4, 5.
"""

from __future__ import annotations

import functools

import numpy as np

from stability.kernels.addresses import native_address, native_call
from stability.kernels.bordering import bordered, borders
from stability.kernels.caching import kernel
from stability.kernels.condensation_newton import (
    _condense,
    _evaluate,
    _parameter_column,
    _phase_row,
    _reduce_and_solve,
    _residual,
    solvers,
)
from stability.kernels.condensation_sweeps import FORWARD, GRADIENT, gradient, sweeps

__all__ = ["CONVERGED", "DOUBLING", "FOLD", "NO_CONVERGENCE", "SINGULAR", "TORUS", "calls", "curve_newton"]

FOLD, DOUBLING, TORUS = 0, 1, 2
CONVERGED, NO_CONVERGENCE, SINGULAR = 0, 1, 2
SMOOTH = 0.6  # second component of the change of a pair's conditions that `x[1]` answers
_forward, _gradient = native_call(FORWARD), native_call(GRADIENT)


@functools.cache
def calls() -> tuple[int, int, int, int, int]:
    """Addresses of condense, reduce_and_solve, gradient, forward_sweep, adjoint_sweep."""
    return (*solvers(), native_address(gradient, GRADIENT), *sweeps())


@kernel(inline=True)
def _core_matrix(calls, kind, factors, update, Z, X, T, phase_row, S, scales, c, spectral, A, room):  # type: ignore[no-untyped-def]
    """Fill the spectral matrix (n, n) and A (k, k), column by column. X[:, :, 0] belongs to the period."""
    n, (start, _, _, _), (_, stages), forcing, nodes = scales.shape[0], room[0], room[1], room[2], room[3]
    h, J, kept, position, LU, pivots = factors[1], factors[3], factors[4], factors[5], factors[6], factors[7]
    for e in range(A.shape[0]):
        for a in range(n):
            start[a] = scales[a] if a == e else 0.0
        for j in range(stages.shape[0]):
            for k in range(stages.shape[1]):
                forcing[j, k, 0] = -T * X[j, k, 0] if e == n else 0.0
        _forward(calls[3], (factors[0], h, factors[2], J, kept, position, LU, pivots, update, Z, 0, forcing, start,
                            nodes, stages))  # fmt: skip
        for a in range(n):
            value = 0.0
            for b in range(n):
                value += S[a, b] * nodes[-1, b] / scales[a]  # S^-1 = S
            A[a, e] = value
            if e < n:
                spectral[a, e] = value
        if A.shape[0] > n:
            A[n, e] = 0.0
            for j in range(stages.shape[0]):
                for k in range(stages.shape[1]):
                    A[n, e] += phase_row[j, k] * stages[j, k]
    for a in range(n):
        A[a, a] += 1.0 if kind == DOUBLING else -1.0
    if kind == TORUS:
        for a in range(n):
            for b in range(n):
                A[a, b] = (1.0 if a == b else 0.0) - 2.0 * c * spectral[a, b]
                for e in range(n):
                    A[a, b] += spectral[a, e] * spectral[e, b]


@kernel(inline=True)
def _coordinates(M, W, V, P):  # type: ignore[no-untyped-def]
    """P (q, a a): the functions of G that count; of a pair the pseudo-inverse of [vec W^T V, vec W^T M V]."""
    n, a = W.shape
    if a == 1:
        P[0, 0] = 1.0
        return
    B = np.zeros((2, 4))
    for i in range(2):
        for j in range(2):
            for x in range(n):
                B[0, 2 * i + j] += W[x, i] * V[x, j]
                for y in range(n):
                    B[1, 2 * i + j] += W[x, i] * M[x, y] * V[y, j]
    first, mixed, second = 0.0, 0.0, 0.0
    for k in range(4):
        first += B[0, k] * B[0, k]
        mixed += B[0, k] * B[1, k]
    mixed /= first
    for k in range(4):
        B[1, k] -= mixed * B[0, k]
        second += B[1, k] * B[1, k]
    for k in range(4):
        P[1, k] = B[1, k] / second
        P[0, k] = B[0, k] / first - mixed * P[1, k]


@kernel(inline=True)
def _conditions(P, G, g):  # type: ignore[no-untyped-def]
    """g = P vec G; returns the largest modulus."""
    a, largest = G.shape[0], 0.0
    for r in range(g.shape[0]):
        g[r] = 0.0
        for i in range(a):
            for j in range(a):
                g[r] += P[r, a * i + j] * G[i, j]
        largest = max(largest, abs(g[r]))
    return largest


@kernel(inline=True)
def _add_row(  # type: ignore[no-untyped-def]
    own, w, v, weights, rows, corner,
    calls, second, factors, update, row_sums, Z, X, S, scales, span, T, F, Fp, dT, phase, Y, P, sizes, phase_row,
    first, other, room,
):  # fmt: skip
    """Subtract weights[r] times the gradient of w^T d(spectral or core) v from the rows own + r and their corner."""
    n, (start, eta, bend, by_params), (rho, by_stages), forcing = scales.shape[0], room[0], room[1], room[2]
    relative = v[n] if v.shape[0] > n else 0.0
    for a in range(n):
        start[a] = scales[a] * v[a]
        eta[a] = 0.0
        for b in range(n):
            eta[a] += S[b, a] * w[b] / scales[b]
    for j in range(rho.shape[0]):
        for k in range(rho.shape[1]):
            rho[j, k] = w[n] * phase_row[j, k] if v.shape[0] > n else 0.0
            forcing[j, k, 0] = -relative * T * X[j, k, 0] if v.shape[0] > n else 0.0
    A, h, sigma, J, kept, position, LU, pivots = factors
    rest = _gradient(calls[2], (
        (calls[3], calls[4]), second, A, h, sigma, J, kept, position, LU, pivots, update, row_sums, Z, forcing, start,
        rho, eta, span, relative * T, relative, 0.0, 0, bend, F, Fp, dT, phase, Y, P, sizes, by_stages, by_params,
    ))  # fmt: skip
    for r in range(weights.shape[0]):
        if own == 1:
            corner[own + r, 0] -= weights[r] * rest
        corner[own + r, own] -= weights[r] * by_params[first]
        corner[own + r, own + 1] -= weights[r] * by_params[other]
        for j in range(rho.shape[0]):
            for k in range(rho.shape[1]):
                rows[own + r, j, k] -= weights[r] * by_stages[j, k]


@kernel(inline=True)
def _pair_of(M, w, v, i, j, c, side, x, y):  # type: ignore[no-untyped-def]
    """w_i^T M v_j; x, y: a term of w_i^T d(M^2 - 2 c M) v_j = w_i^T dM (M v_j - 2 c v_j) + (M^T w_i)^T dM v_j."""
    n, product = M.shape[0], 0.0
    for a in range(n):
        right, left = 0.0, 0.0
        for b in range(n):
            right += M[a, b] * v[b, j]
            left += M[b, a] * w[b, i]
        product += w[a, i] * right
        x[a] = w[a, i] if side == 0 else left
        y[a] = right - 2.0 * c * v[a, j] if side == 0 else v[a, j]
    return product


@kernel(inline=True)
def _columns(own, first, other, h, sigma, span, dT, F, Fp, stage, node, columns, node_columns):  # type: ignore[no-untyped-def]
    """Columns of the period, of both parameters, of e (zero), -residual, and of the change of conditions (zero)."""
    at = columns.shape[2] - 2
    for k in range(own + 2):
        which = first if k == own else other
        if k < own:
            which = -1
        _parameter_column(h, sigma, span, dT, F, Fp, which, columns, k)
    for j in range(stage.shape[0]):
        for k in range(stage.shape[1]):
            for e in range(own + 2, columns.shape[2]):
                columns[j, k, e] = 0.0
            columns[j, k, at] = -stage[j, k]
    for j in range(node.shape[0]):
        for a in range(node.shape[1]):
            node_columns[j, a, at] = -node[j, a]


@kernel(inline=True)
def _size(weights, x, without):  # type: ignore[no-untyped-def]
    """sqrt(sum weights x^2) but for the place `without`."""
    total = 0.0
    for k in range(weights.shape[0]):
        if k != without:
            total += weights[k] * x[k] * x[k]
    return np.sqrt(total)


@kernel(inline=True)
def _scale(weights, u, second):  # type: ignore[no-untyped-def]
    """1 + |(u, lambda_2)|."""
    count, total = u.shape[0], 0.0
    for k in range(count):
        total += weights[k] * u[k] * u[k]
    return 1.0 + np.sqrt(total + weights[count + 1] * second * second)


@kernel(inline=True)
def _fixed(own, q, n, row, rows, node_rows, corner):  # type: ignore[no-untyped-def]
    """The last row, in its three parts."""
    intervals, size = rows.shape[1], rows.shape[2]
    last, begin = own + q, row.shape[0] - corner.shape[0]
    for j in range(intervals + 1):
        for b in range(n):
            node_rows[last, j, b] = row[j * n + b]
    for j in range(intervals):
        for b in range(size):
            rows[last, j, b] = row[(intervals + 1) * n + j * size + b]
    for b in range(corner.shape[0]):
        corner[last, b] = row[begin + b]


@kernel(inline=True)
def _gradients(kind, own, matrices, w, v, c, coordinates, rows, corner, request):  # type: ignore[no-untyped-def]
    """The rows of the conditions and their corner: the gradients of g, all terms of all pairs (w_i, v_j)."""
    k, a = w.shape
    q, room = coordinates.shape[0], (np.empty(k), np.empty(k), np.empty(coordinates.shape[0]))
    x, y, weight = room
    for r in range(own, own + q):
        for b in range(corner.shape[1]):
            corner[r, b] = 0.0
        for j in range(rows.shape[1]):
            for b in range(rows.shape[2]):
                rows[r, j, b] = 0.0
    for term in range(a * a * a):
        i, j, side = (term // 4, (term // 2) % 2, term % 2) if a == 2 else (0, 0, 0)
        for b in range(k):
            x[b], y[b] = w[b, i], v[b, j]
        for r in range(q):
            weight[r] = coordinates[r, a * i + j]
        if kind == TORUS:
            product = _pair_of(matrices, w, v, i, j, c, side, x, y)
            for r in range(q):
                corner[own + r, own + 2] += (2.0 - 2.0 * side) * weight[r] * product
        _add_row(own, x, y, weight, rows, corner, *request)


@kernel(inline=True)
def _right_sides(own, q, g, turn, single, row, moved, corner):  # type: ignore[no-untyped-def]
    """Of the conditions and of the last row: what is missing, and the change of the conditions to be answered."""
    at, off = corner.shape[1] - 2, 0.0
    for b in range(row.shape[0]):
        off += row[b] * moved[b]
    for r in range(q):
        corner[own + r, at] = -g[r]
        corner[own + r, at + 1] = -turn if single else (1.0 if r == 0 else SMOOTH)
    corner[own + q, at] = -off


@kernel(inline=True)
def _take(x, u, P, e, moved, first, other):  # type: ignore[no-untyped-def]
    """Move by a step; returns the largest relative change of e."""
    count, change = u.shape[0], 0.0
    for b in range(count):
        u[b] += x[b]
    for b in range(moved.shape[0]):
        moved[b] += x[b]
    P[first] += x[count]
    P[other] += x[count + 1]
    for b in range(e.shape[0]):
        e[b] += x[count + 2 + b]
        change = max(change, abs(x[count + 2 + b]) / (1.0 + abs(e[b])))
    return change


@kernel(inline=True)
def _arrays(intervals, size, n, unknowns, m):  # type: ignore[no-untyped-def]
    """Rows, columns and residuals at stages and nodes; the corner; room for a variation and a gradient."""
    return (
        (np.zeros((unknowns, intervals, size)), np.zeros((unknowns, intervals + 1, n))),
        (np.empty((intervals, size, unknowns + 2)), np.zeros((intervals + 1, n, unknowns + 2))),
        (np.empty((intervals, size)), np.empty((intervals + 1, n))),
        np.zeros((unknowns, unknowns + 2)),
        (
            (np.empty(n), np.empty(n), np.zeros(m), np.empty(m)),
            (np.empty((intervals, size)), np.empty((intervals, size))),
            np.empty((intervals, size, 1)),
            np.empty((intervals + 1, n)),
        ),
    )


@kernel
def curve_newton(  # type: ignore[no-untyped-def]
    calls, lapack, field, period, second, kind, first, other, span, phase, h, W, A, row_sums, update, kept, position,
    S, jump, scales, quadrature, P, u, nodes, Y, e, T, row, weights, sizes, tolerance, near, stalled, most,
    F, J, Fp, dT, LU, pivots, Z, M, x, report,
):  # fmt: skip
    """Correct u = (nodes, Y, period), P[first], P[other] and e in place; returns the status.

    row, weights (K,): last row and inner product in the order (u, lambda_1, lambda_2, e); the row is zero at the place
    where the solve begins. nodes, Y are views of u. Steps below `near` are followed by one with old gradients, sizes
    relative to 1 + |u|; `tolerance`, or `stalled` where rounding stops the decrease, ends the iteration. x (3, K)
    receives the last step, the answer to a change of the conditions that is smooth along the curve, and the curve's
    direction; report (4,): iterations, residual, sign of the elimination, 1 where the last step had its own gradients.
    F .. M then belong to the solution itself.
    """
    intervals, size, n, count = Y.shape[0], Y.shape[1], nodes.shape[1], u.shape[0]
    own, q, a = (1 if period == 0 else 0), 1 + e.shape[0], (2 if kind == TORUS else 1)
    k, unknowns, moved = n + (own if kind == FOLD else 0), own + q + 1, np.zeros(row.shape[0])
    (rows, node_rows), (columns, node_columns), (stage, node), corner, room = _arrays(
        intervals, size, n, unknowns, P.shape[0])  # fmt: skip
    spectral, matrix, coordinates, g = np.empty((n, n)), np.empty((k, k)), np.empty((q, a * a)), np.empty(q)
    left, right, w, v, G = np.empty((k, a)), np.empty((k, a)), np.empty((k, a)), np.empty((k, a)), np.empty((a, a))
    _fixed(own, q, n, row, rows, node_rows, corner)
    status, iterations, last, known, fresh, sign, length = NO_CONVERGENCE, 0, np.inf, False, True, 0.0, np.inf
    while True:
        if own == 1:
            T[0] = u[count - 1]
        sigma = _evaluate(field, period, span, phase, P, Y, T, F, J, Fp, dT)
        residual = _residual(W, update, h, sigma, S, jump, nodes, Y, F, scales, stage, node)
        if status == CONVERGED or iterations >= most or not residual < np.inf:
            break
        iterations += 1
        if own == 1:
            _phase_row(W, h, quadrature, nodes, Y, rows[0])
        _columns(own, first, other, h, sigma, span, dT, F, Fp, stage, node, columns, node_columns)
        sign = _condense(calls[0], (W, A, row_sums, update, h, sigma, J, kept, position, columns, LU, pivots, Z, M))
        if sign == 0.0:
            break
        c, scale = e[0] if kind == TORUS else 0.0, _scale(weights, u, P[other])
        factors = (A, h, sigma, J, kept, position, LU, pivots)
        _core_matrix(calls, kind, factors, update, Z, columns, T[0], rows[0], S, scales, c, spectral, matrix, room)
        fresh = not known or not last < near * scale
        for _ in range(2):
            if fresh:
                borders(lapack, matrix, left, right)
                _coordinates(spectral, left, right, coordinates)
            turn = bordered(lapack, matrix, left, right, w, v, G)
            _conditions(coordinates, G, g)
            if fresh:
                request = (
                    calls, second, factors, update, row_sums, Z, columns, S, scales, span, T[0], F, Fp, dT, phase, Y, P,
                    sizes, rows[0], first, other, room,
                )  # fmt: skip
                _gradients(kind, own, spectral, w, v, c, coordinates, rows, corner, request)
            known = True
            _right_sides(own, q, g, turn, a == 1, row, moved, corner)
            arguments = (update, Z, M, columns, node_columns, rows, node_rows, corner, S, 1, x)
            sign = _reduce_and_solve(calls[1], arguments) * abs(turn)
            length = _size(weights, x[0], -1)
            if fresh or length <= tolerance * scale:
                break
            fresh, iterations = True, iterations + 1
        if sign == 0.0 or not length < np.inf:
            break
        change = _take(x[0], u, P, e, moved, first, other)
        limit = stalled if 0.25 * last < length <= stalled * scale else tolerance
        if length <= limit * scale and change <= 1e-6:
            status = CONVERGED
        elif (iterations > 2 and length > 4.0 * last) or length > 1e6 * scale:
            break
        last = length
    if status == CONVERGED:
        none = np.empty((intervals, size, 0))
        sign = _condense(calls[0], (W, A, row_sums, update, h, sigma, J, kept, position, none, LU, pivots, Z, M))
    if sign == 0.0 or not residual < np.inf or not length < np.inf:
        status = SINGULAR
    report[0], report[1], report[2], report[3] = iterations, residual, sign, 1.0 if fresh else 0.0
    return status
