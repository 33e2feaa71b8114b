r"""What a truncated Fourier series misses, the monodromy along the corrected orbit, Hill exponents from its modes.

Compiled loops of the equations that problems/harmonic_truncation.py (`missing`, `corrected`) and
problems/harmonic_spectrum.py (`propagate`, `quotients`) state. Tuples of arrays as in harmonic_assembly; K = 2H + 1.
"""

from __future__ import annotations

import functools

import numpy as np

from stability.kernels.addresses import call_field, native_address
from stability.kernels.caching import kernel
from stability.kernels.condensation import condense
from stability.kernels.condensation_newton import _CONDENSE, _condense
from stability.kernels.harmonic_assembly import multiply, states

__all__ = ["condenser", "corrected", "missing", "propagate", "quotients"]


@functools.cache
def condenser() -> int:
    """Address of `condense` for `propagate`."""
    return native_address(condense, _CONDENSE)


@kernel(inline=True)
def _solve_small(A, b):  # type: ignore[no-untyped-def]
    """b (n, k) becomes A^-1 b, by elimination with row interchanges; A (n, n) is lost. False: singular."""
    n = A.shape[0]
    for p in range(n):
        row = p
        for i in range(p + 1, n):
            if abs(A[i, p]) > abs(A[row, p]):
                row = i
        if not abs(A[row, p]) > 0.0:
            return False
        if row != p:
            for j in range(n):
                A[p, j], A[row, j] = A[row, j], A[p, j]
            for j in range(b.shape[1]):
                b[p, j], b[row, j] = b[row, j], b[p, j]
        for i in range(n):
            if i != p:
                factor = A[i, p] / A[p, p]
                for j in range(p + 1, n):
                    A[i, j] -= factor * A[p, j]
                for j in range(b.shape[1]):
                    b[i, j] -= factor * b[p, j]
    for p in range(n):
        for j in range(b.shape[1]):
            b[p, j] /= A[p, p]
    return True


@kernel(inline=True)
def _kept(F, rows, out):  # type: ignore[no-untyped-def]
    for i in range(F.shape[0]):
        for r in range(rows.shape[0]):
            out[i, r] = F[i, rows[r]]


@kernel(inline=True)
def _changes(G, slope, c, omega, layout, out):  # type: ignore[no-untyped-def]
    """out (N, n) += change of the states by the coefficients c."""
    _, unknowns, velocities, _ = layout
    x, v = np.empty((G.shape[0], c.shape[1])), np.empty((G.shape[0], c.shape[1]))
    multiply(G, c, x)
    multiply(slope, c, v)
    for i in range(G.shape[0]):
        for r in range(c.shape[1]):
            out[i, unknowns[r]] += x[i, r]
            if velocities[r] >= 0:
                out[i, velocities[r]] += omega * v[i, r]


@kernel(inline=True)
def _upper(J, layout, omega, force, out):  # type: ignore[no-untyped-def]
    """out (2H + 2, q): Z_k x_k = f_k for the harmonics H + 1 .. K, Z_k = (i k omega)^r - mean J."""
    rows, unknowns, velocities, _ = layout
    q, N, H = rows.shape[0], J.shape[0], out.shape[0] // 2 - 1
    by_x, by_v = np.zeros((q, q)), np.zeros((q, q))
    for i in range(N):
        for r in range(q):
            for j in range(q):
                by_x[r, j] += J[i, rows[r], unknowns[j]] / N
                if velocities[j] >= 0:
                    by_v[r, j] += J[i, rows[r], velocities[j]] / N
    Z, f = np.empty((q, q), np.complex128), np.empty((q, 1), np.complex128)
    for h in range(H + 1):
        ik = 1j * omega * (H + 1 + h)
        for r in range(q):
            for j in range(q):
                Z[r, j] = -by_x[r, j] - ik * by_v[r, j]
            Z[r, r] += ik * ik if velocities[r] >= 0 else ik
            f[r, 0] = force[2 * h, r] - 1j * force[2 * h + 1, r]
        regular = _solve_small(Z, f)
        for r in range(q):
            f[r, 0] = f[r, 0] if regular else np.inf
            out[2 * h, r], out[2 * h + 1, r] = f[r, 0].real, -f[r, 0].imag


@kernel
def missing(  # type: ignore[no-untyped-def]
    field, P, omega, spectrum, finer, upper_basis, layout, work, c, upper, change, sides
):
    """Fill upper (2H + 2, q), change (N, n) by it, and sides (k, order): right sides for the first H harmonics.

    k = 1: exact samples. k = 2: with aliasing, measured at the points of `finer` = (points, G, G D, analysis to K,
    phases) between the samples; the second side is its share alone. `field` is the address of F.
    """
    _, F, J, _, _, R, _, _, _ = work
    rows = layout[0]
    N, n, q, M = F.shape[0], F.shape[1], rows.shape[0], c.shape[0]
    force, kept = np.empty((2 * M + 1, q)), np.empty((N, q))
    _kept(F, rows, kept)
    multiply(spectrum[: 2 * M + 1], kept, force)
    sides[:] = 0.0
    if sides.shape[0] == 2:
        X, other, none = np.empty((N, n)), np.empty((2 * M + 1, q)), np.empty((1, 1, 1))
        between = np.empty((N, n))
        states(finer[1], finer[2], finer[0], c, omega, layout, X)
        call_field(field, N, finer[4], X, P, 0, between, none, none)
        _kept(between, rows, kept)
        multiply(finer[3], kept, other)
        for e in range(2 * M + 1):
            for r in range(q):
                half = 0.5 * (other[e, r] - force[e, r])
                force[e, r] += half
                if e < M:
                    sides[0, e * q + r] = sides[1, e * q + r] = half
    _upper(J, layout, omega, force[M:], upper)
    change[:] = 0.0
    _changes(upper_basis[0], upper_basis[1], upper, omega, layout, change)
    for i in range(N):
        for r in range(q):
            kept[i, r] = 0.0
            for a in range(n):
                kept[i, r] += J[i, rows[r], a] * change[i, a]
    multiply(spectrum[:M], kept, force[:M])
    for e in range(M):
        for r in range(q):
            sides[0, e * q + r] += force[e, r] - R[e * q + r]


@kernel(inline=True)
def _largest_over(change, scales):  # type: ignore[no-untyped-def]
    worst, finite = 0.0, True
    for i in range(change.shape[0]):
        for a in range(change.shape[1]):
            value = abs(change[i, a]) / scales[a]
            finite = finite and value < np.inf
            worst = max(worst, value)
    return worst if finite else np.inf


@kernel
def corrected(G, slope, layout, X, c, upper, period, own, scales, steps, change, coefficients):  # type: ignore[no-untyped-def]
    """coefficients (2K + 1, q) from the steps (k, order) that solve `sides`: (period, error, share of aliasing)."""
    velocities = layout[2]
    M, q = c.shape
    omega = 2.0 * np.pi / period
    d_period = steps[0, M * q] if own == 1 else 0.0
    _changes(G, slope, steps[0, : M * q].reshape((M, q)), omega, layout, change)
    for i in range(X.shape[0]):
        for r in range(q):
            if velocities[r] >= 0:
                change[i, velocities[r]] -= d_period / period * X[i, velocities[r]]
    aliasing = 0.0
    if steps.shape[0] == 2:
        by_alias = np.zeros(X.shape)
        _changes(G, slope, steps[1, : M * q].reshape((M, q)), omega, layout, by_alias)
        aliasing = _largest_over(by_alias, scales)
    for e in range(coefficients.shape[0]):
        for r in range(q):
            coefficients[e, r] = c[e, r] + steps[0, e * q + r] if e < M else upper[e - M, r]
    return period + d_period, max(_largest_over(change, scales), abs(d_period) / period), aliasing


@kernel
def propagate(  # type: ignore[no-untyped-def]
    condense, field, P, period, c, nodes, rule, layout, position, fundamental
):
    """fundamental (S + 1, n, n): Phi along the orbit c (2K + 1, q) at the ends of S equal intervals, by collocation.

    nodes = (points, phases, G, G D, widths); `field` is the address of F and J; `position` as in kernels/condensation.
    Returns the integral of the trace of the Jacobian (nan: not finite).
    """
    s, phase, G, slope, widths = nodes
    W, A, row_sums, update, weights = rule
    S, degree, n = widths.shape[0], W.shape[0], fundamental.shape[1]
    size, rows = degree * layout[0].shape[0], layout[0]
    X, F = np.empty((S * degree, n)), np.empty((S * degree, n))
    J, none = np.empty((S * degree, n, n)), np.empty((1, 1, 1))
    states(G, slope, s, c, 2.0 * np.pi / period, layout, X)
    call_field(field, S * degree, phase, X, P, 0, F, J, none)
    LU, pivots = np.empty((S, size, size)), np.empty((S, size), np.int64)
    columns, Z, M = np.empty((S, degree * n, 0)), np.empty((S, degree * n, n)), np.empty((S, n, n))
    sign = _condense(
        condense, (W, A, row_sums, update, widths, period, J, rows, position, columns, LU, pivots, Z, M)
    )
    for a in range(n):
        for b in range(n):
            fundamental[0, a, b] = 1.0 if a == b else 0.0
    total, finite = 0.0, sign != 0.0
    for j in range(S):
        for a in range(n):
            for b in range(n):
                value = 0.0
                for e in range(n):
                    value += M[j, a, e] * fundamental[j, e, b]
                fundamental[j + 1, a, b] = value
        for i in range(degree):
            for a in range(n):
                total += widths[j] * weights[i] * J[j * degree + i, a, a]
    for a in range(n):
        for b in range(n):
            finite = finite and abs(fundamental[S, a, b]) < np.inf
    return period * total if finite else np.nan


@kernel
def quotients(synthesis, analysis, coarse, k, J, fundamental, Y, exponents, omega, quotient, bound):  # type: ignore[no-untyped-def]
    """Two-sided Rayleigh quotients of Hill's matrix with the modes exp(-lambda s) Phi(s) y, and bounds of their error.

    coarse (2H + 1, S) analyses the S starts of the intervals; Y (n, n) eigenvectors of Phi(T), exponents = log mu;
    J (N, n, n) at the samples. Fills quotient and bound (n,), the bound over omega. False: the modes are dependent.
    """
    S, N, M, n = coarse.shape[1], J.shape[0], k.shape[0], Y.shape[0]
    width = n * n
    right, left = np.empty((S, width), np.complex128), np.empty((S, width), np.complex128)
    P, inverse = np.empty((n, n), np.complex128), np.empty((n, n), np.complex128)
    for j in range(S):
        for b in range(n):
            shrink = np.exp(-exponents[b] * (j / S))
            for a in range(n):
                value = 0.0j
                for e in range(n):
                    value += fundamental[j, a, e] * Y[e, b]
                P[a, b] = right[j, a * n + b] = value * shrink
                inverse[a, b] = 1.0 if a == b else 0.0
        if not _solve_small(P, inverse):
            return False
        for b in range(n):
            for a in range(n):
                left[j, a * n + b] = inverse[b, a]
    v, w = np.empty((M, width), np.complex128), np.empty((M, width), np.complex128)
    at, applied = np.empty((N, width), np.complex128), np.empty((M, width), np.complex128)
    multiply(coarse, right.view(np.float64), v.view(np.float64))
    multiply(coarse, left.view(np.float64), w.view(np.float64))
    multiply(synthesis, v.view(np.float64), at.view(np.float64))
    pushed = np.zeros((N, width), np.complex128)
    for i in range(N):
        for a in range(n):
            for e in range(n):
                if J[i, a, e] != 0.0:
                    for b in range(n):
                        pushed[i, a * n + b] += J[i, a, e] * at[i, e * n + b]
    multiply(analysis, pushed.view(np.float64), applied.view(np.float64))
    for e in range(1, M):
        for b in range(width):
            applied[e, b] -= omega * k[e] * (v[e + 1, b] if e % 2 == 1 else -v[e - 1, b])
    for b in range(n):
        below, above, size, length, rest = 0.0j, 0.0j, 0.0, 0.0, 0.0
        for e in range(M):
            mean = 1.0 if e == 0 else 0.5
            for a in range(n):
                at_b = a * n + b
                below += mean * w[e, at_b] * v[e, at_b]
                above += mean * w[e, at_b] * applied[e, at_b]
                size += mean * abs(w[e, at_b]) ** 2
                length += mean * abs(v[e, at_b]) ** 2
        quotient[b] = above / below
        for e in range(M):
            for a in range(n):
                rest += (1.0 if e == 0 else 0.5) * abs(applied[e, a * n + b] - quotient[b] * v[e, a * n + b]) ** 2
        bound[b] = np.sqrt(rest * size) / abs(below) * np.sqrt(rest / length) / omega
    return True
