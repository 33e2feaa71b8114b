r"""Residual, Jacobian and parameter column of a harmonic-balance problem, by loops inside a compiled kernel.

The same quantities as problems/harmonic_linearisation.py, which states the equations. Layout: coefficient e of series r
at e q + r; q series, M = 2H + 1 coefficients, N samples, n states. `velocities[r]` is the state that is omega x_r', or
-1 for a series of first order. T(j) = Toeplitz + Hankel by the tables `first`, `second` of kernels/fourier.py; where
an entry of the Jacobian is the same at all samples (a linear term), T(j) = j I.

Arrays travel in three tuples:

    tables = (points, synthesis, slope, analysis, spectrum, first, second, swap, turn, k)      of the Fourier basis
    layout = (rows, unknowns, velocities, winding)
    work   = (X, F, J, Fp, dT, R, by_omega, column, A)                                         filled here
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_field
from stability.kernels.caching import kernel

__all__ = ["assemble", "multiply", "states"]


@kernel(inline=True)
def multiply(A, B, out):  # type: ignore[no-untyped-def]
    """out = A B: rows of B stay together; a single column by four sums side by side."""
    count = B.shape[0]
    if out.shape[1] == 1:
        for i in range(out.shape[0]):
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            for k in range(0, count - 3, 4):
                a += A[i, k] * B[k, 0]
                b += A[i, k + 1] * B[k + 1, 0]
                c += A[i, k + 2] * B[k + 2, 0]
                d += A[i, k + 3] * B[k + 3, 0]
            for k in range(count - count % 4, count):
                a += A[i, k] * B[k, 0]
            out[i, 0] = (a + b) + (c + d)
        return
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = 0.0
        for k in range(count):
            factor = A[i, k]
            for j in range(out.shape[1]):
                out[i, j] += factor * B[k, j]


@kernel(inline=True)
def states(G, slope, s, c, omega, layout, X):  # type: ignore[no-untyped-def]
    """X (N, n) of the coefficients c at the points s with matrices G and G D."""
    _, unknowns, velocities, winding = layout
    x, v = np.empty((G.shape[0], c.shape[1])), np.empty((G.shape[0], c.shape[1]))
    multiply(G, c, x)
    multiply(slope, c, v)
    for i in range(G.shape[0]):
        for r in range(c.shape[1]):
            X[i, unknowns[r]] = x[i, r] + s[i] * winding[r]
            if velocities[r] >= 0:
                X[i, velocities[r]] = omega * (v[i, r] + winding[r] / (2.0 * np.pi))


@kernel(inline=True)
def _linear(k, order_two, c, e, r, omega):  # type: ignore[no-untyped-def]
    """omega^r D^r c at coefficient e of series r and its derivative by omega, without winding."""
    if order_two:
        return -omega * omega * k[e] * k[e] * c[e, r], -2.0 * omega * k[e] * k[e] * c[e, r]
    if e == 0:
        return 0.0, 0.0
    turned = c[e + 1, r] if e % 2 == 1 else -c[e - 1, r]
    return omega * k[e] * turned, k[e] * turned


@kernel(inline=True)
def _residual(tables, layout, work, c, omega, rate, index):  # type: ignore[no-untyped-def]
    """R, its derivative by omega, and the column of parameter `index`, whose frequency has the slope `rate`."""
    _, _, _, analysis, _, _, _, _, _, k = tables
    rows, _, velocities, winding = layout
    X, F, J, Fp, _, R, by_omega, column, _ = work
    N, q, M = X.shape[0], rows.shape[0], analysis.shape[0]
    # columns: forces, their slopes by the parameter, those by the velocities' common factor omega
    samples, found = np.zeros((N, 3 * q)), np.empty((M, 3 * q))
    for i in range(N):
        for r in range(q):
            samples[i, r] = F[i, rows[r]]
            samples[i, q + r] = Fp[i, rows[r], index] if Fp.shape[2] else 0.0
            for j in range(q):
                if velocities[j] >= 0:
                    samples[i, 2 * q + r] += J[i, rows[r], velocities[j]] * X[i, velocities[j]] / omega
    multiply(analysis, samples, found)
    for r in range(q):
        second_order = velocities[r] >= 0
        for e in range(M):
            straight = winding[r] / (2.0 * np.pi) if e == 0 and not second_order else 0.0
            value, slope = _linear(k, second_order, c, e, r, omega)
            R[e * q + r] = value + omega * straight - found[e, r]
            by_omega[e * q + r] = slope + straight - found[e, 2 * q + r]
            column[e * q + r] = rate * by_omega[e * q + r] - found[e, q + r]


@kernel(inline=True)
def _is_constant(J, row, state):  # type: ignore[no-untyped-def]
    same = True
    for i in range(1, J.shape[0]):
        same = same and J[i, row, state] == J[0, row, state]
    return same


@kernel(inline=True)
def _jacobian(tables, layout, J, omega, A):  # type: ignore[no-untyped-def]
    """A = omega^r D^r - T(J_x) - omega T(J_v) D."""
    _, _, _, _, spectrum, first, second, swap, turn, k = tables
    rows, unknowns, velocities, _ = layout
    M, q, N, harmonics = first.shape[0], rows.shape[0], J.shape[0], spectrum.shape[0] - 2
    table, values, found = np.zeros(2 * harmonics + 1), np.empty((N, 1)), np.empty((harmonics, 1))
    A[:] = 0.0
    for r in range(q):
        for j in range(q):
            for which in range(2):
                state = unknowns[j] if which == 0 else velocities[j]
                if state < 0:
                    continue
                if _is_constant(J, rows[r], state):
                    value = J[0, rows[r], state]
                    for m in range(M if value != 0.0 else 0):
                        place, factor = (m, 1.0) if which == 0 else (swap[m], turn[m] * omega)
                        A[place * q + r, m * q + j] -= factor * value
                    continue
                for i in range(N):
                    values[i, 0] = J[i, rows[r], state]
                multiply(spectrum[:harmonics], values, found)
                for h in range(harmonics):
                    value = found[h, 0] if h == 0 else 0.5 * found[h, 0]
                    table[h], table[harmonics + h] = value, -value
                for e in range(M):
                    half = 0.5 if e == 0 else 1.0
                    for m in range(M):
                        place, factor = (m, half) if which == 0 else (swap[m], half * turn[m] * omega)
                        A[e * q + r, m * q + j] -= factor * (table[first[e, place]] + table[second[e, place]])
        for e in range(M):
            if velocities[r] >= 0:
                A[e * q + r, e * q + r] -= omega * omega * k[e] * k[e]
            elif e % 2 == 1:
                A[e * q + r, (e + 1) * q + r] += omega * k[e]
                A[(e + 1) * q + r, e * q + r] -= omega * k[e]


@kernel(inline=True)
def assemble(field, period, multiple, phase, tables, layout, work, P, index, c, T):  # type: ignore[no-untyped-def]
    """Fill `work`; returns the orbit's period.

    `period` is the address of the forcing period (0: autonomous, then T is the period and dT stays zero); `index` the
    parameter of `column`.
    """
    X, F, J, Fp, dT, _, _, _, A = work
    m = P.shape[0]
    if period != 0:
        zero, value, slopes = np.zeros((1, 1)), np.empty((1, 1)), np.empty((1, 1, m))
        call_field(period, 1, zero[0], zero, P, 0, value, np.empty((1, 1, 1)), slopes)
        T = multiple * value[0, 0]
        for i in range(m):
            dT[i] = multiple * slopes[0, 0, i]
    omega = 2.0 * np.pi / T
    rate = -omega / T * dT[index] if period != 0 and m > 0 else 0.0
    states(tables[1], tables[2], tables[0], c, omega, layout, X)
    call_field(field, X.shape[0], phase, X, P, 0, F, J, Fp)
    _residual(tables, layout, work, c, omega, rate, index)
    _jacobian(tables, layout, J, omega, A)
    return T
