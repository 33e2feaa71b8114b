"""Newton's method for harmonic balance with pseudo-arclength, one compiled call for a whole solve.

Unknowns u = (c, T): coefficients (2H + 1, q) and, for an autonomous system (`period` address 0), the period.

    balance   R(c, omega, p) = 0                              (see harmonic_assembly)
    phase     <dc_ref/dtheta, c - c_ref> / |dc_ref/dtheta| = 0    autonomous systems; the reference is the given u
    arc       <t, (u, lambda) - (u_0, lambda_0)> = ds         where a tangent is given

Each step solves the bordered dense system with LAPACK's dgesv, rows divided by their sizes; a second right-hand side
gives the tangent (without `arc` the derivative by the parameter).
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_solver
from stability.kernels.caching import kernel
from stability.kernels.harmonic_assembly import assemble

__all__ = ["CONVERGED", "NEGATIVE_PERIOD", "NOT_FINITE", "NO_CONVERGENCE", "SINGULAR", "newton"]

CONVERGED, NO_CONVERGENCE, SINGULAR, NOT_FINITE, NEGATIVE_PERIOD = 0, 1, 2, 3, 4


@kernel(inline=True)
def _phase_row(k, weights, c, row):  # type: ignore[no-untyped-def]
    """row = weights . dc/dtheta over its length."""
    M, q = c.shape
    total = 0.0
    for e in range(M):
        for r in range(q):
            slope = 0.0 if e == 0 else k[e] * c[e + 1, r] if e % 2 == 1 else -k[e] * c[e - 1, r]
            row[e * q + r] = weights[e * q + r] * slope
            total += weights[e * q + r] * slope * slope
    for i in range(M * q):
        row[i] *= 1.0 / np.sqrt(total) if total > 0.0 else 1.0


@kernel(inline=True)
def _bordered(own, arc, A, by_period, column, phase_row, arc_row, pull, row_sizes, full):  # type: ignore[no-untyped-def]
    """`full`, column by column: rows over their sizes, with the phase condition, the period, the arc, the parameter."""
    inner, last = A.shape[0], A.shape[0] + own
    for i in range(inner):
        factor = 1.0 / row_sizes[i]
        for j in range(inner):
            full[j, i] = A[i, j] * factor
        if own == 1:
            full[inner, i] = by_period[i] * factor
        if arc == 1:
            full[last, i] = column[i] * factor
    if own == 1:
        full[inner, inner] = 0.0
        for j in range(inner):
            full[j, inner] = phase_row[j]
    if arc == 1:
        for j in range(last):
            full[j, last] = arc_row[j]
        full[last, last] = pull
        if own == 1:
            full[last, inner] = 0.0


@kernel(inline=True)
def _right_sides(own, arc, R, column, row_sizes, gap, along, x):  # type: ignore[no-untyped-def]
    """x (2, N + arc): minus the residual, and what makes the tangent."""
    inner = R.shape[0]
    for i in range(inner):
        x[0, i] = -R[i] / row_sizes[i]
        x[1, i] = 0.0 if arc == 1 else -column[i] / row_sizes[i]
    if own == 1:
        x[0, inner], x[1, inner] = -gap, 0.0
    if arc == 1:
        x[0, inner + own], x[1, inner + own] = along, 1.0


@kernel(inline=True)
def _sign(full, pivots):  # type: ignore[no-untyped-def]
    """Sign of the determinant from the factors."""
    sign = 1
    for i in range(pivots.shape[0]):
        sign = -sign if full[i, i] < 0.0 else sign
        sign = -sign if pivots[i] != i + 1 else sign
    return sign


@kernel(inline=True)
def _largest(R, row_sizes, gap):  # type: ignore[no-untyped-def]
    """Largest residual over its size; nan where one is not finite."""
    largest, finite = abs(gap), True
    for i in range(R.shape[0]):
        value = abs(R[i]) / row_sizes[i]
        finite = finite and value < np.inf
        largest = max(largest, value)
    return largest if finite else np.nan


@kernel(inline=True)
def _length(weights, x):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(weights.shape[0]):
        total += weights[i] * x[i] * x[i]
    return total


@kernel
def newton(  # type: ignore[no-untyped-def]
    solver, field, period, multiple, phase, tables, layout, work, P, index, u, weights, row_sizes, t, t_l, weight_l,
    arc, ds, tolerance, settled, most, full, pivots, x,
):  # fmt: skip
    """Correct u and, with a tangent (`arc` 1), P[index], both in place; at most `most` steps (0: only fill `work`).

    x (2, N + arc) receives the last correction and the tangent as (u, parameter), normalised where `arc` is 1; `full`
    and `pivots` the factors of the last bordered matrix (columns as rows). Where the last correction exceeds `settled`
    `work` is filled once more at the solution. Returns (status, iterations, residual, sign of the determinant, period).
    """
    R, by_omega, column, A = work[5], work[6], work[7], work[8]
    inner, size, own = R.shape[0], u.shape[0], 1 if period == 0 else 0
    M = tables[3].shape[0]
    c = u[:inner].reshape((M, inner // M))
    given, P_given, pull = u.copy(), P[index] if P.shape[0] else 0.0, weight_l * weight_l * t_l
    phase_row, arc_row, by_period = np.zeros(size), np.zeros(size), np.empty(inner)
    if own == 1:
        _phase_row(tables[9], weights, c, phase_row)
    if arc == 1:
        for i in range(size):
            arc_row[i] = weights[i] * t[i]
            u[i] += ds * t[i]
        P[index] += ds * t_l
    sizes = np.empty(3, np.int32)
    status, sign, residual, previous, iterations, T = NO_CONVERGENCE, 0, np.inf, np.inf, 0, u[size - 1]
    while True:
        if own == 1 and not u[inner] > 0.0:
            status = NEGATIVE_PERIOD
            break
        T = assemble(field, period, multiple, phase, tables, layout, work, P, index, c, u[size - 1])
        gap, along = 0.0, ds
        for i in range(size):
            gap += phase_row[i] * (u[i] - given[i])
            along -= arc_row[i] * (u[i] - given[i])
        residual = _largest(R, row_sizes, gap)
        if not residual < np.inf:
            status = NOT_FINITE
        if status in (CONVERGED, NOT_FINITE) or iterations >= most:
            break
        iterations += 1
        along -= pull * (P[index] - P_given) if arc == 1 else 0.0
        _right_sides(own, arc, R, column, row_sizes, gap, along, x)
        for i in range(inner):
            by_period[i] = -2.0 * np.pi / (T * T) * by_omega[i]
        _bordered(own, arc, A, by_period, column, phase_row, arc_row, pull, row_sizes, full)
        sizes[0], sizes[1], sizes[2] = size + arc, 2, 0
        call_solver(solver, sizes, full, pivots, x)
        change_l = x[0, size] if arc == 1 else 0.0
        change, length = np.sqrt(_length(weights, x[0]) + (weight_l * change_l) ** 2), np.sqrt(_length(weights, u))
        if sizes[2] != 0 or not (change < np.inf and _length(weights, x[1]) < np.inf):
            status = SINGULAR
            break
        damping = 1.0
        if arc == 0 and change > 0.5 * (1.0 + length):
            damping = 0.5 * (1.0 + length) / change
        if own == 1 and x[0, inner] < -0.5 * u[inner]:
            damping = min(damping, -0.5 * u[inner] / x[0, inner])
        for i in range(size):
            u[i] += damping * x[0, i]
        if arc == 1:
            P[index] += damping * change_l
        if change <= tolerance * (1.0 + length):
            status = CONVERGED
            if change <= settled * (1.0 + length):
                break
        elif arc == 1 and iterations > 1 and change > 2.0 * previous:
            break
        previous = change
    if iterations > 0:
        sign = _sign(full, pivots)
        if arc == 1:
            total = np.sqrt(_length(weights, x[1]) + (weight_l * x[1, size]) ** 2)
            for i in range(size + 1):
                x[1, i] /= total
    return status, iterations, residual, sign, T
