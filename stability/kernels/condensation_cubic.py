r"""The cubic coefficient of a period doubling from one compiled pass along the orbit.

With M q = -q, M^T p = -p of the scaled map x -> D^-1 S^-1 Phi(D x), and the map's second and third derivatives B, C,

    terms = ( p.C(q, q, q) / 6,  p.B(q, h) / 2 ),      (I - M) h = B(q, q).

V, H are the variations from D q and D h, W the one from zero with the inhomogeneity f_xx[V, V]. The end of a variation
with the inhomogeneity g, times p, is the sum of omega' g over the stages by one adjoint sweep from p, so that

    p.C(q, q, q) = sum omega'.(f_xxx[V, V, V] + 3 f_xx[V, W]),      p.B(q, h) = sum omega'.f_xx[V, H],

omega' = h sigma omega. Derivatives by the C functions of `Evaluator.directional_address`.
Reference: Kuznetsov (2004), (5.39); sweeps as in `condensation_sweeps`.
"""

from __future__ import annotations

import numpy as np

from stability.kernels.addresses import call_solver, native_call
from stability.kernels.caching import kernel
from stability.kernels.condensation_sweeps import ADJOINT, FORWARD
from stability.kernels.directional import call_directional

__all__ = ["cubic_terms"]

_forward, _adjoint = native_call(FORWARD), native_call(ADJOINT)


@kernel(inline=True)
def _run(sweeps, factors, update, Z, forced, X, start, nodes, stages, direction):  # type: ignore[no-untyped-def]
    """One variation; its stages as directions (count, n + m)."""
    A, h, sigma, J, kept, position, LU, pivots = factors
    n, degree = start.shape[0], A.shape[0]
    _forward(
        sweeps[0],
        (A, h, sigma, J, kept, position, LU, pivots, update, Z, forced, X, start, nodes, stages),
    )
    for j in range(stages.shape[0]):
        for i in range(degree):
            for a in range(n):
                direction[j * degree + i, a] = stages[j, i * n + a]


@kernel
def cubic_terms(  # type: ignore[no-untyped-def]
    sweeps, solver, second, third, A, h, sigma, J, kept, position, LU, pivots, update, row_sums, Z, S, scales, M, p, q,
    phase, Y, P, sizes, terms,
):  # fmt: skip
    """Fill terms (2,); p, q (n,), the spectral matrix M (n, n), stages Y (N, mn). nan where I - M is singular."""
    intervals, size = Y.shape
    n, degree, count = q.shape[0], A.shape[0], J.shape[0]
    nodes, stages, omega = np.empty((intervals + 1, n)), np.empty((intervals, size)), np.empty((intervals, size))
    X, start, rho = np.zeros((intervals, size, 1)), np.empty(n), np.zeros((intervals, size))
    width = n + P.shape[0]
    V, W, H = np.zeros((count, width)), np.zeros((count, width)), np.zeros((count, width))
    g, of_W, of_H = np.empty((count, n)), np.empty((count, n)), np.empty((count, n))
    factors, forced = (A, h, sigma, J, kept, position, LU, pivots), X.shape[2]  # a literal 1 would be another type
    for a in range(n):
        start[a] = scales[a] * q[a]
    _run(sweeps, factors, update, Z, forced - 1, X, start, nodes, stages, V)
    call_directional(second, phase, Y, P, (V, V), g, sizes)
    for j in range(intervals):
        for i in range(degree):
            for a in range(n):
                X[j, i * n + a, 0] = sigma * h[j] * g[j * degree + i, a]
    for a in range(n):
        start[a] = 0.0
    _run(sweeps, factors, update, Z, forced, X, start, nodes, stages, W)
    K, right, swaps, order = np.empty((n, n)), np.zeros((1, n)), np.empty(n, np.int32), np.zeros(3, np.int32)
    order[0], order[1] = n, 1
    for a in range(n):
        for b in range(n):
            K[b, a] = (1.0 if a == b else 0.0) - M[a, b]
            right[0, a] += S[a, b] * nodes[intervals, b] / scales[a]  # S^-1 = S
    call_solver(solver, order, K, swaps, right)
    for a in range(n):
        start[a] = scales[a] * right[0, a]
    for j in range(intervals):
        for k in range(size):
            X[j, k, 0] = 0.0
    _run(sweeps, factors, update, Z, forced - 1, X, start, nodes, stages, H)
    for a in range(n):
        start[a] = 0.0
        for b in range(n):
            start[a] += S[b, a] * p[b] / scales[b]
    _adjoint(sweeps[1], (A, h, sigma, J, kept, position, LU, pivots, update, row_sums, rho, start, omega))
    call_directional(third, phase, Y, P, (V, V, V), g, sizes)
    call_directional(second, phase, Y, P, (V, W), of_W, sizes)
    call_directional(second, phase, Y, P, (V, H), of_H, sizes)
    cubic, quadratic = 0.0, 0.0
    for j in range(intervals):
        for i in range(degree):
            for a in range(n):
                weight, c = sigma * h[j] * omega[j, i * n + a], j * degree + i
                cubic += weight * (g[c, a] + 3.0 * of_W[c, a])
                quadratic += weight * of_H[c, a]
    terms[0] = cubic / 6.0 if order[2] == 0 else np.nan
    terms[1] = quadratic / 2.0 if order[2] == 0 else np.nan
