r"""Residual, Jacobian and parameter column of a harmonic-balance problem in one compiled call.

The same quantities as problems/harmonic_linearisation.py, which states the equations; here by loops, because at 7
harmonics numpy's calls cost ten times the arithmetic. Layout: coefficient e of series r at e q + r; q series,
M = 2H + 1 coefficients, N samples, n states. `velocities[r]` is the state that is omega x_r', or -1 for a series of
first order. T(j) = Toeplitz + Hankel by the tables `first`, `second` of kernels/fourier.py.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_field
from stability.kernels.caching import kernel

__all__ = ["assemble"]


@kernel(inline=True)
def _linear(k, order_two, c, e, r, omega, power):  # type: ignore[no-untyped-def]
    """omega^r D^r c at coefficient e of series r (power 0), or its derivative by omega (power 1), without winding."""
    if order_two:
        return -(omega * omega if power == 0 else 2.0 * omega) * k[e] * k[e] * c[e, r]
    scale = omega if power == 0 else 1.0
    if e == 0:
        return 0.0
    return scale * k[e] * (c[e + 1, r] if e % 2 == 1 else -c[e - 1, r])


@kernel(inline=True)
def _states(G, slope, s, c, omega, unknowns, velocities, winding, X):  # type: ignore[no-untyped-def]
    """X (N, n) of the coefficients."""
    N, M = G.shape
    for i in range(N):
        for r in range(unknowns.shape[0]):
            x, v = 0.0, 0.0
            for e in range(M):
                x += G[i, e] * c[e, r]
                v += slope[i, e] * c[e, r]
            X[i, unknowns[r]] = x + s[i] * winding[r]
            if velocities[r] >= 0:
                X[i, velocities[r]] = omega * (v + winding[r] / (2.0 * np.pi))


@kernel(inline=True)
def _add_product(spectrum, first, second, J, row, state, places, turns, r, j, table, A):  # type: ignore[no-untyped-def]
    """A[block r, j] -= T(J_(row, state)) with columns taken from `places` and multiplied by `turns` (D, or nothing)."""
    harmonics, N = spectrum.shape[0] - 2, J.shape[0]
    q_times = table.shape[0]
    for h in range(harmonics):
        value = 0.0
        for i in range(N):
            value += spectrum[h, i] * J[i, row, state]
        if h > 0:
            value *= 0.5
        table[h], table[harmonics + h] = value, -value
    table[q_times - 1] = 0.0
    M = first.shape[0]
    q = (A.shape[0] - A.shape[0] % M) // M
    for e in range(M):
        factor = 0.5 if e == 0 else 1.0
        for m in range(M):
            place = places[m]
            A[e * q + r, m * q + j] -= factor * turns[m] * (table[first[e, place]] + table[second[e, place]])


@kernel
def assemble(  # type: ignore[no-untyped-def]
    field, period, multiple, phase, s, G, slope, analysis, spectrum, first, second, swap, turn, k, rows, unknowns,
    velocities, winding, P, index, c, T, X, F, J, Fp, dT, R, by_omega, column, A,
):  # fmt: skip
    """Fill X, F, J, Fp, dT (m,), R, by_omega, column (M q,) and A (M q, M q); returns the orbit's period.

    `period` is the address of the forcing period (0: autonomous, then T is the period and dT stays zero); `index` the
    parameter of `column`.
    """
    N, M = G.shape
    q, m = rows.shape[0], P.shape[0]
    if period != 0:
        zero, value, slopes = np.zeros((1, 1)), np.empty((1, 1)), np.empty((1, 1, m))
        call_field(period, 1, zero[0], zero, P, 0, value, np.empty((1, 1, 1)), slopes)
        T = multiple * value[0, 0]
        for i in range(m):
            dT[i] = multiple * slopes[0, 0, i]
    omega = 2.0 * np.pi / T
    rate = -omega / T * dT[index] if period != 0 else 0.0
    _states(G, slope, s, c, omega, unknowns, velocities, winding, X)
    call_field(field, N, phase, X, P, 0, F, J, Fp)
    through = np.zeros((N, q))
    for i in range(N):
        for r in range(q):
            for j in range(q):
                if velocities[j] >= 0:
                    through[i, r] += J[i, rows[r], velocities[j]] * X[i, velocities[j]] / omega
    for r in range(q):
        second_order = velocities[r] >= 0
        for e in range(M):
            force, moved, pushed = 0.0, 0.0, 0.0
            for i in range(N):
                force += analysis[e, i] * F[i, rows[r]]
                moved += analysis[e, i] * Fp[i, rows[r], index]
                pushed += analysis[e, i] * through[i, r]
            straight = winding[r] / (2.0 * np.pi) if e == 0 and not second_order else 0.0
            R[e * q + r] = _linear(k, second_order, c, e, r, omega, 0) + omega * straight - force
            by_omega[e * q + r] = _linear(k, second_order, c, e, r, omega, 1) + straight - pushed
            column[e * q + r] = rate * by_omega[e * q + r] - moved
    A[:] = 0.0
    places, turns = np.empty((2, M), np.int64), np.ones((2, M))
    for e in range(M):
        places[0, e], places[1, e], turns[1, e] = e, swap[e], turn[e] * omega
    table = np.empty(2 * (spectrum.shape[0] - 2) + 1)
    for r in range(q):
        for j in range(q):
            for which in range(2):
                state = unknowns[j] if which == 0 else velocities[j]
                if state >= 0:
                    _add_product(
                        spectrum, first, second, J, rows[r], state, places[which], turns[which], r, j, table, A
                    )
        for e in range(M):
            if velocities[r] >= 0:
                A[e * q + r, e * q + r] -= omega * omega * k[e] * k[e]
            elif e % 2 == 1:
                A[e * q + r, (e + 1) * q + r] += omega * k[e]
                A[(e + 1) * q + r, e * q + r] -= omega * k[e]
    return T
