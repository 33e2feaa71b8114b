r"""Sweeps over the condensed intervals: variations forward in time, adjoints backward, and the gradients they give.

    forward    dY_j = Z_j du_j + X_j,     du_{j+1} = (1 - sum d) du_j + sum_i d_i dY_ji,     X_j = G_j^-1 C_j
    backward   omega_j = G_j^-T (d x eta_{j+1} + rho_j),     eta_j = (1 - sum d) eta_{j+1} + sum_i r_i omega_ji

For a scalar g = eta_N . du_N + sum_j rho_j . dY_j of a variation, the derivative of g with respect to anything that
the stage residual R depends on is -sum_j omega_j . d(R'[variation]): one forward and one backward sweep give the
gradient with respect to every unknown and parameter. With R = W (Y - u) - h sigma f, sigma = span T, the variation
(V, tau = dT, lambda = dp_free), omega' = h omega and z = (x, p),

    dg = sum omega'^T d( sigma f_z (V, lambda) + (span tau + sigma_lambda lambda) f ),

second derivatives of f by the C function of `Evaluator.second_gradient`. These kernels call each other by address (see
`addresses.native_call`), so that each is compiled once.
"""

from __future__ import annotations

import functools

import numpy as np
from numba import types

from stability.kernels.addresses import native_address, native_call
from stability.kernels.caching import kernel
from stability.kernels.condensation import solve_stages, solve_stages_transposed
from stability.kernels.directional import call_directional

__all__ = ["ADJOINT", "FACTORS", "FORWARD", "GRADIENT", "adjoint_sweep", "forward_sweep", "gradient", "sweeps"]


def _array(dimensions, dtype=types.float64, constant=False):  # type: ignore[no-untyped-def]
    return types.Array(dtype, dimensions, "C", readonly=constant)


_RULE_VECTOR, _RULE_MATRIX = _array(1, constant=True), _array(2, constant=True)
_VECTOR, _MATRIX, _STACK, _INDICES = _array(1), _array(2), _array(3), _array(1, types.int64)
FACTORS = (  # A, h, sigma, J, kept, position, LU, pivots
    _RULE_MATRIX, _VECTOR, types.float64, _STACK, _INDICES, _INDICES, _STACK, _array(2, types.int64),
)  # fmt: skip
FORWARD = (*FACTORS, _RULE_VECTOR, _STACK, types.int64, _STACK, _VECTOR, _MATRIX, _MATRIX)
ADJOINT = (*FACTORS, _RULE_VECTOR, _RULE_VECTOR, _MATRIX, _VECTOR, _MATRIX)
GRADIENT = (
    types.UniTuple(types.int64, 2), types.int64, *FACTORS, _RULE_VECTOR, _RULE_VECTOR, _STACK, _STACK, _VECTOR, _MATRIX,
    _VECTOR, *[types.float64] * 4, types.int64, _VECTOR, _MATRIX, _STACK, _VECTOR, _VECTOR, _MATRIX, _VECTOR, _VECTOR,
    _MATRIX, _VECTOR,
)  # fmt: skip
_forward, _adjoint = native_call(FORWARD), native_call(ADJOINT)


@functools.cache
def sweeps() -> tuple[int, int]:
    """Addresses of `forward_sweep` and `adjoint_sweep` for other kernels."""
    return native_address(forward_sweep, FORWARD), native_address(adjoint_sweep, ADJOINT)


@kernel
def forward_sweep(A, h, sigma, J, kept, position, LU, pivots, update, Z, forced, X, start, du, dY):  # type: ignore[no-untyped-def]
    """Fill du (N+1, n), dY (N, mn) of the variation from start (n,) with the columns X (N, mn, 1); returns 0.

    `forced` = 1: X holds C and is overwritten by G^-1 C; 0: X is G^-1 C already (or zero).
    """
    if forced == 1:
        solve_stages(A, h, sigma, J, kept, position, LU, pivots, X)
    intervals, size = dY.shape
    n, degree = start.shape[0], A.shape[0]
    left = 1.0
    for i in range(degree):
        left -= update[i]
    for a in range(n):
        du[0, a] = start[a]
    for j in range(intervals):
        for row in range(size):
            value = X[j, row, 0]
            for b in range(n):
                value += Z[j, row, b] * du[j, b]
            dY[j, row] = value
        for a in range(n):
            value = left * du[j, a]
            for i in range(degree):
                value += update[i] * dY[j, i * n + a]
            du[j + 1, a] = value
    return 0.0


@kernel
def adjoint_sweep(A, h, sigma, J, kept, position, LU, pivots, update, row_sums, rho, eta, omega):  # type: ignore[no-untyped-def]
    """Fill omega (N, mn) from the terminal weight eta (n,) and the stage weights rho (N, mn); returns 0."""
    intervals = rho.shape[0]
    degree, n = A.shape[0], eta.shape[0]
    left = 1.0
    for i in range(degree):
        left -= update[i]
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
    return 0.0


@kernel
def gradient(  # type: ignore[no-untyped-def]
    sweeps, second, A, h, sigma, J, kept, position, LU, pivots, update, row_sums, Z, X, start, rho, eta,
    span, tau, relative, amount, free, bend, F, Fp, dT, phase, Y, P, sizes, by_stages, by_params,
):  # fmt: skip
    """Gradient of g = eta . du_N + rho . dY by the stages Y (N, mn) and by p (m,), and returned: by the period.

    The variation begins at `start` (n,) with dT = tau, dp_free = amount; X (N, mn, 1) = G^-1 of its columns.
    `relative` = tau / T where the period is an unknown; `bend` (m,) = amount d2T / dp_free dp where it is given. F, J,
    Fp, dT belong to the stages; `second` is the address of `second_gradient`, `sizes` (n + m,) as there.
    """
    intervals, size = Y.shape
    n, m, count = eta.shape[0], P.shape[0], J.shape[0]
    du, V, omega = np.empty((intervals + 1, n)), np.empty((intervals, size)), np.empty((intervals, size))
    factors = (A, h, sigma, J, kept, position, LU, pivots)
    _forward(sweeps[0], (*factors, update, Z, 0, X, start, du, V))
    _adjoint(sweeps[1], (*factors, update, row_sums, rho, eta, omega))
    degree = A.shape[0]
    along, out = np.zeros((count, n + m)), np.empty((count, n + m))
    for j in range(intervals):
        for i in range(degree):
            for a in range(n):
                along[j * degree + i, a] = V[j, i * n + a]
                omega[j, i * n + a] *= h[j]
            along[j * degree + i, n + free] = amount
    call_directional(second, phase, Y, P, (along, omega), out, sizes)
    stretch, change, speed = span * (tau + dT[free] * amount), 0.0, 0.0
    for k in range(m):
        by_params[k] = 0.0
    for j in range(intervals):
        for i in range(degree):
            c = j * degree + i
            for b in range(n):
                by_stages[j, i * n + b] = sigma * out[c, b]
            for k in range(m):
                by_params[k] += sigma * out[c, n + k]
            for a in range(n):
                weight = omega[j, i * n + a]
                rate = Fp[c, a, free] * amount if amount != 0.0 else 0.0
                for b in range(n):
                    rate += J[c, a, b] * V[j, i * n + b]
                change += rate * weight
                speed += F[c, a] * weight
                if stretch != 0.0:
                    for b in range(n):
                        by_stages[j, i * n + b] += stretch * J[c, a, b] * weight
                    for k in range(m):
                        by_params[k] += stretch * Fp[c, a, k] * weight
    for k in range(m):
        by_params[k] += span * (dT[k] * change + bend[k] * speed)
    # tau = T v_n: the core unknown is relative, so that T itself appears once more
    return span * (change + relative * speed)
