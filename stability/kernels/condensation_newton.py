"""Newton's method for collocation with pseudo-arclength, one compiled call for a whole solve.

On scaled time s in [0, 1], t = sigma s, sigma = span T: the discretised problem (see `gauss`) is

    stage   sum_k W_ik (Y_jk - u_j) - h_j sigma f(phase_ji, Y_ji, p) = 0,      phase = frac(span s) of a forced system
    node    u_{j+1} - (1 - sum d) u_j - sum_i d_i Y_ji = 0
    end     u_N - S u_0 - w = 0                        S = identity or a symmetry, w = 2 pi k of a winding angle
    phase   <x_ref', Y - Y_ref> = 0                    autonomous systems only, whose unknown is the period T
    arc     <t, (u, lambda) - (u_0, lambda_0)> = ds    where a tangent is given

The stages are Gauss points, so each inner product is an exact quadrature with the weights h_j b_i / scale^2.
Forced systems (`period` address not 0): T = T(p) with its gradient, so the parameter derivative at fixed phase is
-h (sigma f_p + span T_p f).
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_field
from stability.kernels.caching import kernel
from stability.kernels.condensation import condense
from stability.kernels.condensation_reduced import reduce_and_solve

__all__ = ["CONVERGED", "NOT_FINITE", "NO_CONVERGENCE", "SINGULAR", "evaluate", "newton"]

CONVERGED, NO_CONVERGENCE, SINGULAR, NOT_FINITE = 0, 1, 2, 3


@kernel(inline=True)
def _evaluate(field, period, span, phase, P, Y, T, F, J, Fp, dT):  # type: ignore[no-untyped-def]
    """Field and Jacobians at all stages; sigma. T (1,) is overwritten by T(p) for a forced system."""
    if period != 0:
        zero = np.zeros(1)
        call_field(period, 1, zero, zero, P, 0, T, np.empty(1), dT)
    count = phase.shape[0]
    call_field(field, count, phase, Y, P, 0, F, J, Fp)
    return span * T[0]


@kernel(inline=True)
def _residual(W, update, h, sigma, S, jump, nodes, Y, F, scales, stage, node):  # type: ignore[no-untyped-def]
    """Fill the stage (N, mn) and node (N+1, n) residuals; returns the largest scaled entry (nan where not finite)."""
    intervals = h.shape[0]
    degree, n = W.shape[0], nodes.shape[1]
    left = 1.0
    for i in range(degree):
        left -= update[i]
    largest, finite = 0.0, True
    for j in range(intervals):
        for a in range(n):
            carry = nodes[j + 1, a] - left * nodes[j, a]
            for i in range(degree):
                value = -h[j] * sigma * F[j * degree + i, a]
                for k in range(degree):
                    value += W[i, k] * (Y[j, k * n + a] - nodes[j, a])
                stage[j, i * n + a] = value
                carry -= update[i] * Y[j, i * n + a]
                finite = finite and abs(value) < np.inf
                largest = max(largest, abs(value) / scales[a])
            node[j, a] = carry
            finite = finite and abs(carry) < np.inf
            largest = max(largest, abs(carry) / scales[a])
    for a in range(n):
        value = nodes[intervals, a] - jump[a]
        for b in range(n):
            value -= S[a, b] * nodes[0, b]
        node[intervals, a] = value
        largest = max(largest, abs(value) / scales[a])
    return largest if finite else np.nan


@kernel(inline=True)
def _parameter_column(h, sigma, span, dT, F, Fp, which, out, k):  # type: ignore[no-untyped-def]
    """Column k of `out` (N, mn, K): derivative of the stage equations by parameter `which`, or by the period (-1)."""
    intervals, size = out.shape[0], out.shape[1]
    n = F.shape[1]
    degree = size // n
    for j in range(intervals):
        for i in range(degree):
            for a in range(n):
                if which < 0:
                    value = span * F[j * degree + i, a]
                else:
                    value = sigma * Fp[j * degree + i, a, which] + span * dT[which] * F[j * degree + i, a]
                out[j, i * n + a, k] = -h[j] * value


@kernel(inline=True)
def _phase_row(W, h, weights, nodes, Y, row):  # type: ignore[no-untyped-def]
    """row = weights . x'(s) of the reference orbit, scaled so that row . x' / |x'| = 1."""
    intervals, size = Y.shape
    degree, n = W.shape[0], nodes.shape[1]
    total = 0.0
    for j in range(intervals):
        for i in range(degree):
            for a in range(n):
                slope = 0.0
                for k in range(degree):
                    slope += W[i, k] * (Y[j, k * n + a] - nodes[j, a])
                slope /= h[j]
                total += weights[j, i * n + a] * slope * slope
                row[j, i * n + a] = weights[j, i * n + a] * slope
    if total > 0.0:
        factor = 1.0 / np.sqrt(total)
        for j in range(intervals):
            for k in range(size):
                row[j, k] *= factor


@kernel(inline=True)
def _norm(weights, weight_T, dY, dT):  # type: ignore[no-untyped-def]
    total = weight_T * dT * dT
    for j in range(dY.shape[0]):
        for k in range(dY.shape[1]):
            total += weights[j, k] * dY[j, k] * dY[j, k]
    return np.sqrt(total)


@kernel
def newton(  # type: ignore[no-untyped-def]
           field, period, span, phase, h, W, A, row_sums, update, kept, position, S, jump, scales, weights, weight_T,
           P, free, nodes, Y, T, arc, t_nodes, t_Y, t_T, t_l, weight_l, ds, tolerance, max_iterations,
           F, J, Fp, dT, LU, pivots, Z, M):  # fmt: skip
    """Correct (nodes, Y, T, P[free]) in place; `arc` = 1 with a tangent, 0 without (then P stays fixed).

    Returns (status, iterations, residual, sign, du, dY, dl, tangent of T, tangent of P[free]): du, dY, dl hold the last
    correction [0] and the tangent of the curve [1], not normalised; without `arc` the derivative by P[free].
    F, J, Fp, dT, LU, pivots, Z, M hold the last linearisation.
    """
    intervals, size = Y.shape
    n = nodes.shape[1]
    own = 1 if period == 0 else 0
    q = own + arc
    extra = own + 2
    given, given_T, given_l = np.empty((intervals, size)), T[0], P[free]
    for j in range(intervals):
        for k in range(size):
            given[j, k] = Y[j, k]
    rows, node_rows = np.zeros((q, intervals, size)), np.zeros((q, intervals + 1, n))
    corner = np.zeros((q, extra))
    if own == 1:
        _phase_row(W, h, weights, nodes, Y, rows[0])
    if arc == 1:
        for j in range(intervals):
            for k in range(size):
                rows[own, j, k] = weights[j, k] * t_Y[j, k]
                Y[j, k] += ds * t_Y[j, k]
        for j in range(intervals + 1):
            for a in range(n):
                nodes[j, a] += ds * t_nodes[j, a]
        T[0] += ds * t_T
        P[free] += ds * t_l
        if own == 1:
            corner[own, 0] = weight_T * t_T
        corner[own, own] = weight_l * weight_l * t_l
    stage, node = np.empty((intervals, size)), np.empty((intervals + 1, n))
    columns, node_columns = np.empty((intervals, size, extra)), np.zeros((intervals + 1, n, extra))
    at_free, at_rhs = (own, own + 1) if arc == 1 else (own + 1, own)
    status, sign, residual, previous = NO_CONVERGENCE, 0.0, np.inf, np.inf
    iterations = 0
    du, dY, dl = np.zeros((2, intervals + 1, n)), np.zeros((2, intervals, size)), np.zeros((2, q))
    while iterations < max_iterations:
        iterations += 1
        sigma = _evaluate(field, period, span, phase, P, Y, T, F, J, Fp, dT)
        residual = _residual(W, update, h, sigma, S, jump, nodes, Y, F, scales, stage, node)
        if not residual < np.inf:
            status = NOT_FINITE
            break
        if own == 1:
            _parameter_column(h, sigma, span, dT, F, Fp, -1, columns, 0)
        _parameter_column(h, sigma, span, dT, F, Fp, free, columns, at_free)
        flip = 1.0 if arc == 1 else -1.0
        for j in range(intervals):
            for k in range(size):
                columns[j, k, at_rhs] = -stage[j, k]
                columns[j, k, at_free] *= flip
        for j in range(intervals + 1):
            for a in range(n):
                node_columns[j, a, at_rhs] = -node[j, a]
        for r in range(q):
            value = 0.0
            for j in range(intervals):
                for k in range(size):
                    value += rows[r, j, k] * (Y[j, k] - given[j, k])
            if r == own:
                value += weight_T * t_T * (T[0] - given_T) * own + weight_l * weight_l * t_l * (P[free] - given_l) - ds
            corner[r, at_rhs] = -value
        sign = condense(W, A, row_sums, update, h, sigma, J, kept, position, columns, LU, pivots, Z, M)
        if sign == 0.0:
            status = SINGULAR
            break
        du, dY, dl, one = reduce_and_solve(update, Z, M, columns, node_columns, rows, node_rows, corner, S, arc)
        sign *= one
        if sign == 0.0:
            status = SINGULAR
            break
        change_T = dl[0, 0] if own == 1 else 0.0
        change_l = dl[0, own] if arc == 1 else 0.0
        change = np.sqrt(_norm(weights, weight_T, dY[0], change_T) ** 2 + (weight_l * change_l) ** 2)
        if not change < np.inf:
            status = NOT_FINITE
            break
        size_u = _norm(weights, weight_T, Y, T[0])
        damping = 1.0
        if arc == 0 and change > 0.5 * (1.0 + size_u):
            damping = 0.5 * (1.0 + size_u) / change
        if own == 1 and change_T < -0.5 * T[0]:
            damping = min(damping, -0.5 * T[0] / change_T)
        for j in range(intervals):
            for k in range(size):
                Y[j, k] += damping * dY[0, j, k]
        for j in range(intervals + 1):
            for a in range(n):
                nodes[j, a] += damping * du[0, j, a]
        if own == 1:
            T[0] += damping * change_T
        if arc == 1:
            P[free] += damping * change_l
        if change <= tolerance * (1.0 + size_u):
            status = CONVERGED
            break
        if arc == 1 and iterations > 1 and change > 2.0 * previous:
            break
        previous = change
    t_period = dl[1, 0] if own == 1 else 0.0
    t_parameter = dl[1, own] if arc == 1 else 1.0
    return status, iterations, residual, sign, du, dY, dl, t_period, t_parameter


@kernel
def evaluate(  # type: ignore[no-untyped-def]
             field, period, span, phase, h, W, update, S, jump, scales, P, nodes, Y, T,
             F, J, Fp, dT, stage, node):  # fmt: skip
    """Fill F, J, Fp, dT, T and the residuals stage (N, mn), node (N+1, n); returns (largest scaled residual, sigma)."""
    sigma = _evaluate(field, period, span, phase, P, Y, T, F, J, Fp, dT)
    return _residual(W, update, h, sigma, S, jump, nodes, Y, F, scales, stage, node), sigma
