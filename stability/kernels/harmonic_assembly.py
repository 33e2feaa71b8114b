r"""Residual, Jacobian and parameter column of a harmonic-balance problem in one compiled call.

The same quantities as problems/harmonic_linearisation.py, which states the equations; here by loops, because at 7
harmonics numpy's calls cost ten times the arithmetic. Layout: coefficient l of series r at l q + r; q series, M = 2H + 1
coefficients, N samples, n states. `velocities[r]` is the state that is omega x_r', or -1 for a series of first order.
T(j) = Toeplitz + Hankel by the tables `first`, `second` of kernels/fourier.py.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_field
from stability.kernels.caching import kernel

__all__ = ["assemble"]


@kernel(inline=True)
def _linear(k, order_two, c, l, r, omega, power):  # type: ignore[no-untyped-def]
    """omega^r D^r c at coefficient l of series r (power 0), or its derivative by omega (power 1), without winding."""
    if order_two:
        return -(omega * omega if power == 0 else 2.0 * omega) * k[l] * k[l] * c[l, r]
    scale = omega if power == 0 else 1.0
    if l == 0:
        return 0.0
    return scale * k[l] * (c[l + 1, r] if l % 2 == 1 else -c[l - 1, r])


@kernel(inline=True)
def _states(G, slope, s, c, omega, unknowns, velocities, winding, X):  # type: ignore[no-untyped-def]
    """X (N, n) of the coefficients."""
    N, M = G.shape
    for i in range(N):
        for r in range(unknowns.shape[0]):
            x, v = 0.0, 0.0
            for l in range(M):
                x += G[i, l] * c[l, r]
                v += slope[i, l] * c[l, r]
            X[i, unknowns[r]] = x + s[i] * winding[r]
            if velocities[r] >= 0:
                X[i, velocities[r]] = omega * (v + winding[r] / (2.0 * np.pi))


@kernel(inline=True)
def _add_product(spectrum, first, second, J, row, state, swap, turn, scale, r, j, table, A):  # type: ignore[no-untyped-def]
    """A[block r, j] -= scale T(J_(row, state)) (D if `swap` is used: turn not all one)."""
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
    for l in range(M):
        factor = scale * (0.5 if l == 0 else 1.0)
        for m in range(M):
            place = swap[m]
            A[l * q + r, m * q + j] -= factor * turn[m] * (table[first[l, place]] + table[second[l, place]])


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
        for l in range(M):
            force, moved, pushed = 0.0, 0.0, 0.0
            for i in range(N):
                force += analysis[l, i] * F[i, rows[r]]
                moved += analysis[l, i] * Fp[i, rows[r], index]
                pushed += analysis[l, i] * through[i, r]
            straight = winding[r] / (2.0 * np.pi) if l == 0 and not second_order else 0.0
            R[l * q + r] = _linear(k, second_order, c, l, r, omega, 0) + omega * straight - force
            by_omega[l * q + r] = _linear(k, second_order, c, l, r, omega, 1) + straight - pushed
            column[l * q + r] = rate * by_omega[l * q + r] - moved
    A[:] = 0.0
    same, ones = np.arange(M), np.ones(M)
    table = np.empty(2 * (spectrum.shape[0] - 2) + 1)
    for r in range(q):
        for j in range(q):
            _add_product(spectrum, first, second, J, rows[r], unknowns[j], same, ones, 1.0, r, j, table, A)
            if velocities[j] >= 0:
                _add_product(spectrum, first, second, J, rows[r], velocities[j], swap, turn, omega, r, j, table, A)
        for l in range(M):
            if velocities[r] >= 0:
                A[l * q + r, l * q + r] -= omega * omega * k[l] * k[l]
            elif l % 2 == 1:
                A[l * q + r, (l + 1) * q + r] += omega * k[l]
                A[(l + 1) * q + r, l * q + r] -= omega * k[l]
    return T
