"""Sweeps over the condensed intervals: variations forward in time, adjoints backward.

    forward    dY_j = Z_j du_j + X_j,     du_{j+1} = (1 - sum d) du_j + sum_i d_i dY_ji + q_j
    backward   omega_j = G_j^-T (d x eta_{j+1} + rho_j),     eta_j = (1 - sum d) eta_{j+1} + sum_i r_i omega_ji

For a scalar g = eta_N . du_N + sum_j rho_j . dY_j of a variation, the derivative of g with respect to anything that
the stage residual R depends on is -sum_j omega_j . d(R'[variation]): one forward and one backward sweep give the
gradient with respect to every unknown and parameter.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel
from stability.kernels.condensation import solve_stages_transposed

__all__ = ["adjoint_sweep", "forward_sweep"]


@kernel
def forward_sweep(update, Z, X, nodes, start):  # type: ignore[no-untyped-def]
    """K variations at once: X (N, mn, K), nodes (N, n, K), start (n, K) -> du (K, N+1, n), dY (K, N, mn)."""
    intervals, size, count = X.shape
    n = start.shape[0]
    degree = size // n
    left = 1.0
    for i in range(degree):
        left -= update[i]
    du, dY = np.empty((count, intervals + 1, n)), np.empty((count, intervals, size))
    for e in range(count):
        for a in range(n):
            du[e, 0, a] = start[a, e]
        for j in range(intervals):
            for row in range(size):
                value = X[j, row, e]
                for b in range(n):
                    value += Z[j, row, b] * du[e, j, b]
                dY[e, j, row] = value
            for a in range(n):
                value = left * du[e, j, a] + nodes[j, a, e]
                for i in range(degree):
                    value += update[i] * dY[e, j, i * n + a]
                du[e, j + 1, a] = value
    return du, dY


@kernel
def adjoint_sweep(A, row_sums, update, h, sigma, J, kept, position, LU, pivots, rho, eta):  # type: ignore[no-untyped-def]
    """omega (N, mn) of the terminal weight eta (n,) and the stage weights rho (N, mn); see the head of this file."""
    intervals, size = rho.shape
    degree, n = A.shape[0], eta.shape[0]
    left = 1.0
    for i in range(degree):
        left -= update[i]
    omega = np.empty((intervals, size))
    now = np.empty(n)
    for a in range(n):
        now[a] = eta[a]
    for j in range(intervals - 1, -1, -1):
        for i in range(degree):
            for a in range(n):
                omega[j, i * n + a] = update[i] * now[a] + rho[j, i * n + a]
        solve_stages_transposed(
            A, h[j : j + 1], sigma, J[j * degree : (j + 1) * degree], kept, position,
            LU[j : j + 1], pivots[j : j + 1], omega[j : j + 1],
        )  # fmt: skip
        for a in range(n):
            value = left * now[a]
            for i in range(degree):
                value += row_sums[i] * omega[j, i * n + a]
            now[a] = value
    return omega
