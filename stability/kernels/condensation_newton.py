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

import functools

import numpy as np
from numba import types

from stability.kernels.addresses import call_field, native_address, native_call
from stability.kernels.caching import kernel
from stability.kernels.condensation import condense
from stability.kernels.condensation_reduced import reduce_and_solve

__all__ = ["CONVERGED", "NEWTON", "NOT_FINITE", "NO_CONVERGENCE", "SINGULAR", "evaluate", "newton", "solvers"]

CONVERGED, NO_CONVERGENCE, SINGULAR, NOT_FINITE = 0, 1, 2, 3
STALLED, ROUNDING = 1e-6, 1e-12  # a correction that no longer falls, and a scaled residual that is rounding


def _array(dimensions, dtype=types.float64, constant=False):  # type: ignore[no-untyped-def]
    return types.Array(dtype, dimensions, "C", readonly=constant)


_RULE = (_array(2, constant=True), _array(2, constant=True), _array(1, constant=True), _array(1, constant=True))
_INDICES = _array(1, types.int64)
_CONDENSE = (
    *_RULE, _array(1), types.float64, _array(3), _INDICES, _INDICES, _array(3), _array(3), _array(2, types.int64),
    _array(3), _array(3),
)  # fmt: skip
_REDUCE = (
    _RULE[3], _array(3), _array(3), _array(3), _array(3), _array(3), _array(3), _array(2), _array(2, constant=True),
    types.int64, _array(2),
)  # fmt: skip
_condense, _reduce_and_solve = native_call(_CONDENSE), native_call(_REDUCE)
_INT, _REAL, _VECTOR, _MATRIX, _STACK = types.int64, types.float64, _array(1), _array(2), _array(3)
NEWTON = (  # the types of `newton`'s arguments, line by line
    types.UniTuple(_INT, 2), _INT, _INT, _REAL, _VECTOR, _VECTOR, *_RULE, _INDICES, _INDICES, _array(2, constant=True),
    _VECTOR, _array(1, constant=True), _VECTOR, _MATRIX,
    _VECTOR, _INT, _VECTOR, _MATRIX, _MATRIX, _VECTOR, _INT, _VECTOR, _MATRIX, _REAL, _REAL, _REAL, _REAL, _INT,
    _MATRIX, _STACK, _STACK, _VECTOR, _STACK, _array(2, types.int64), _STACK, _STACK, _MATRIX, _VECTOR,
)  # fmt: skip


@functools.cache
def solvers() -> tuple[int, int]:
    """Addresses of `condense` and `reduce_and_solve` for `newton`; they stay compiled as long as their modules."""
    return native_address(condense, _CONDENSE), native_address(reduce_and_solve, _REDUCE)


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
def _norm(weights, x):  # type: ignore[no-untyped-def]
    """sqrt(sum w x^2); x may have a parameter's entry more than w."""
    total = 0.0
    for k in range(weights.shape[0]):
        total += weights[k] * x[k] * x[k]
    return np.sqrt(total)


@kernel(inline=True)
def _borders(own, arc, W, h, stage_weights, weight_T, nodes, Y, t_Y, t_T, pull, rows, node_rows, corner):  # type: ignore[no-untyped-def]
    """Rows of the phase condition and of the arclength, with their entries at the unknown period and parameter."""
    for r in range(rows.shape[0]):
        for j in range(nodes.shape[0]):
            for a in range(nodes.shape[1]):
                node_rows[r, j, a] = 0.0
        for k in range(corner.shape[1]):
            corner[r, k] = 0.0
    if own == 1:
        _phase_row(W, h, stage_weights, nodes, Y, rows[0])
    if arc == 1:
        for j in range(Y.shape[0]):
            for k in range(Y.shape[1]):
                rows[own, j, k] = stage_weights[j, k] * t_Y[j, k]
        if own == 1:
            corner[own, 0] = weight_T * t_T
        corner[own, own] = pull


@kernel(inline=True)
def _columns(own, arc, free, h, sigma, span, F, Fp, dT, stage, node, columns, node_columns):  # type: ignore[no-untyped-def]
    """Right sides of the linear system: period, parameter, -residual; without an arc the parameter is a right side."""
    at_free, at_rhs = (own, own + 1) if arc == 1 else (own + 1, own)
    for column in range(own + 1):  # one call: literal arguments would be types of their own and compiled once more
        which, place = (-1, 0) if column < own else (free, at_free)
        _parameter_column(h, sigma, span, dT, F, Fp, which, columns, place)
    for j in range(stage.shape[0]):
        for k in range(stage.shape[1]):
            columns[j, k, at_rhs] = -stage[j, k]
            if arc == 0:
                columns[j, k, at_free] = -columns[j, k, at_free]
    for j in range(node.shape[0]):
        for a in range(node.shape[1]):
            for k in range(own + 2):
                node_columns[j, a, k] = 0.0
            node_columns[j, a, at_rhs] = -node[j, a]
    return at_rhs


@kernel
def newton(  # type: ignore[no-untyped-def]
    solvers, field, period, span, phase, h, W, A, row_sums, update, kept, position, S, jump, scales, weights,
    stage_weights,
    P, free, u, nodes, Y, T, arc, t, t_Y, t_l, weight_l, ds, tolerance, max_iterations,
    F, J, Fp, dT, LU, pivots, Z, M, x, report,
):  # fmt: skip
    """Correct u = (nodes, Y, period) and P[free] in place; `arc` = 1 with a tangent (t, t_l), 0 without (P stays).

    nodes and Y are views of u, t_Y of t, stage_weights of weights. Fills report (4,): status, iterations, residual,
    sign, and returns the status, as a float. x[0] is the last correction, x[1] the tangent of the curve, not normalised
    (without `arc` the derivative by P[free]), both as (u, parameter). F, J, Fp, dT, LU, pivots, Z, M hold the last
    linearisation.
    """
    intervals, size, n, count = Y.shape[0], Y.shape[1], nodes.shape[1], u.shape[0]
    own = 1 if period == 0 else 0
    last = count - 1
    pull = weight_l * weight_l * t_l
    rows, node_rows = np.empty((own + arc, intervals, size)), np.empty((own + arc, intervals + 1, n))
    corner, stage, node = np.empty((own + arc, own + 2)), np.empty((intervals, size)), np.empty((intervals + 1, n))
    columns, node_columns = np.empty((intervals, size, own + 2)), np.empty((intervals + 1, n, own + 2))
    _borders(own, arc, W, h, stage_weights, weights[last], nodes, Y, t_Y, t[last], pull, rows, node_rows, corner)
    moved = np.zeros((intervals, size))  # from the given stages
    moved_T, moved_l = ds * t[last] * arc, ds * t_l * arc
    for k in range(count):
        x[0, k] = t[k]
        u[k] += ds * t[k] * arc
    _shift(moved, x, ds * arc, (intervals + 1) * n)
    P[free] += moved_l
    status, sign, residual, previous, iterations = NO_CONVERGENCE, 0.0, np.inf, np.inf, 0
    while iterations < max_iterations:
        iterations += 1
        if own == 1:
            T[0] = u[last]
        sigma = _evaluate(field, period, span, phase, P, Y, T, F, J, Fp, dT)
        residual = _residual(W, update, h, sigma, S, jump, nodes, Y, F, scales, stage, node)
        if not residual < np.inf:
            status = NOT_FINITE
            break
        at_rhs = _columns(own, arc, free, h, sigma, span, F, Fp, dT, stage, node, columns, node_columns)
        for r in range(own + arc):
            value = 0.0
            for j in range(intervals):
                for k in range(size):
                    value += rows[r, j, k] * moved[j, k]
            if r == own:
                value += weights[last] * t[last] * moved_T * own + pull * moved_l - ds
            corner[r, at_rhs] = -value
        sign = _condense(solvers[0], (W, A, row_sums, update, h, sigma, J, kept, position, columns, LU, pivots, Z, M))
        if sign != 0.0:
            arguments = (update, Z, M, columns, node_columns, rows, node_rows, corner, S, arc, x)
            sign *= _reduce_and_solve(solvers[1], arguments)
        if sign == 0.0:
            status = SINGULAR
            break
        change_l = x[0, count] if arc == 1 else 0.0
        change, length = np.sqrt(_norm(weights, x[0]) ** 2 + (weight_l * change_l) ** 2), _norm(weights, u)
        if not change < np.inf:
            status = NOT_FINITE
            break
        damping = 1.0
        if arc == 0 and change > 0.5 * (1.0 + length):
            damping = 0.5 * (1.0 + length) / change
        if own == 1 and x[0, last] < -0.5 * u[last]:
            damping = min(damping, -0.5 * u[last] / x[0, last])
        for k in range(count):
            u[k] += damping * x[0, k]
        _shift(moved, x, damping, (intervals + 1) * n)
        moved_T, moved_l = moved_T + damping * x[0, last], moved_l + damping * change_l
        P[free] += damping * change_l
        if _settled(change / (1.0 + length), previous / (1.0 + length), residual, tolerance):
            status = CONVERGED
            break
        if arc == 1 and iterations > 1 and change > 2.0 * previous:
            break
        previous = change
    report[0], report[1], report[2], report[3] = status, iterations, residual, sign
    return report[0]


@kernel(inline=True)
def _settled(change, previous, residual, tolerance):  # type: ignore[no-untyped-def]
    """A correction below the tolerance, or one that rounding keeps from falling: as far as the digits go."""
    return change <= tolerance or (0.3 * previous < change <= STALLED and residual <= ROUNDING)


@kernel(inline=True)
def _shift(moved, x, damping, first):  # type: ignore[no-untyped-def]
    """moved += damping * (stages of x[0], which begin at `first`)."""
    size = moved.shape[1]
    for j in range(moved.shape[0]):
        for k in range(size):
            moved[j, k] += damping * x[0, first + j * size + k]


@kernel
def evaluate(  # type: ignore[no-untyped-def]
             field, period, span, phase, h, W, update, S, jump, scales, P, nodes, Y, T,
             F, J, Fp, dT, stage, node):  # fmt: skip
    """Fill F, J, Fp, dT, T and the residuals stage (N, mn), node (N+1, n); returns (largest scaled residual, sigma)."""
    sigma = _evaluate(field, period, span, phase, P, Y, T, F, J, Fp, dT)
    return _residual(W, update, h, sigma, S, jump, nodes, Y, F, scales, stage, node), sigma
