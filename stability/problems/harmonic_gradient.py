r"""Exact gradients of w^T S v and w^T M v of a harmonic-balance problem, for the defining systems of special points.

With the adjoint samples W_i of w (w^T G+ f = sum W_i . f_i), the variation z_v = (dX_v, v_p) of states and parameters
at the samples and y = J^T W, the core's scalar g = w^T dF[v] changes by

    dg[u] = w^T d2Lin[v, u] - sum W . f_zz[z_v, z_u] - sum y_vel . ( v_omega x_u' + u_omega x_v' ),

because velocities omega x' are products of two unknowns. For M = Re Y exp(Lambda T) Y^-1 made of selected modes of
Hill's matrix (all modes V, inverse U): first-order perturbation of values and vectors gives w^T dM v = sum_ab G_ab
dHill_ab,

    G = U^T C V^T (of rank n),   C_ij = (w^T(mu_j - M) P V_i) b_j / (lambda_j - lambda_i),
    C_jj = T mu_j (w^T P V_j) b_j,   b = Y^-1 v,

and dHill is made of f_zz at the samples and of domega. One batched call of second derivatives each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels.fourier import derivative

if TYPE_CHECKING:
    from .harmonic_linearisation import HarmonicLinearisation

__all__ = ["core_gradient", "curvature", "spectral_gradient"]

Array = np.ndarray
_SAME = 1e-9


def _parts(values: Array) -> list[tuple[complex, Array]]:
    """Real and imaginary parts with their factors, zero ones left out."""
    return [(f, part) for f, part in ((1.0, np.real(values)), (1j, np.imag(values))) if np.any(part)]


def core_gradient(L: HarmonicLinearisation, w: Array, v: Array, free: int) -> tuple[Array, Array]:
    """Gradient of w^T [S, s_free] v by u (N,) and by p (m,)."""
    kind = np.result_type(w, v, float)
    by_u, by_p = np.zeros(L.u.size, kind), np.zeros(L.params.size, kind)
    for a, w_part in _parts(w):
        for b, v_part in _parts(v):
            found = _real_core_gradient(L, w_part, v_part, free)
            factor = a * b if np.iscomplexobj(by_u) else 1.0
            by_u += factor * found[0]
            by_p += factor * found[1]
    return by_u, by_p


def _real_core_gradient(L: HarmonicLinearisation, w: Array, v: Array, free: int) -> tuple[Array, Array]:
    problem, layout = L.problem, L.problem.layout
    basis, own, omega, size = layout.basis, L.problem.own, L.omega, layout.count * layout.q
    weight = (w / problem.row_sizes)[:size].reshape(layout.count, layout.q)
    direction = problem.column_sizes * v[:-1]
    c = direction[:size].reshape(layout.count, layout.q)
    places, velocities = layout.pairs
    rates = L.omega_slopes
    turn = -omega / L.period * direction[-1] if own else rates[free] * v[-1]
    adjoint = np.zeros_like(L.X)
    adjoint[:, layout.rows] = basis.analysis.T @ weight
    z = np.zeros((layout.samples, layout.n + L.params.size))
    z[:, layout.unknowns] = basis.synthesis @ c
    slope = basis.slope @ c[:, places]
    z[:, velocities] = omega * slope + turn / omega * L.X[:, velocities]
    z[:, layout.n + free] = v[-1]
    second = np.einsum("lkr,kr->kl", _second(L, z), adjoint)
    through = np.einsum("kr,krs->ks", adjoint, L.J)[:, velocities]
    by_c = -_pulled_back(L, second)
    by_c[:, places] -= turn * (basis.slope.T @ through)
    by_c += turn * _adjoint_linear(L, weight)
    by_omega = float((weight * (_linear_rate(L, c) + turn * _linear_curvature(L))).sum())
    by_omega -= float((second[:, velocities] * L.X[:, velocities]).sum()) / omega + float((through * slope).sum())
    by_p = -second[:, layout.n :].sum(axis=0) + by_omega * rates
    along = float(weight.ravel() @ L.by_omega)
    if own:
        by_period = -omega / L.period * by_omega + along * 2 * omega / L.period**2 * direction[-1]
        return np.append(by_c.ravel(), by_period), by_p
    if v[-1] != 0.0:
        by_p = by_p + along * v[-1] * _omega_curvature(L, free)
    return by_c.ravel(), by_p


def _omega_curvature(L: HarmonicLinearisation, free: int) -> Array:
    """d2 omega / dp_free dp, (m,), for omega = 2 pi / T(p)."""
    problem = L.problem
    slope = L.period_slopes
    bend = problem.multiple * problem.flow.period_second(L.params, free)
    return np.asarray(2 * L.omega * slope[free] * slope / L.period**2 - L.omega / L.period * bend)


def _linear_rate(L: HarmonicLinearisation, c: Array) -> Array:
    """Derivative by omega of the linear part without winding: r omega^(r-1) D^r c."""
    layout = L.problem.layout
    k = layout.basis.k[:, None]
    return np.where(layout.second, -2 * L.omega * k * k * c, derivative(c))


def _linear_curvature(L: HarmonicLinearisation) -> Array:
    """Second derivative by omega of the linear part."""
    layout = L.problem.layout
    k = layout.basis.k[:, None]
    return np.where(layout.second, -2 * k * k * L.c, 0.0)


def _adjoint_linear(L: HarmonicLinearisation, weight: Array) -> Array:
    """Gradient by c of w^T (r omega^(r-1) D^r c): D^T = -D."""
    layout = L.problem.layout
    k = layout.basis.k[:, None]
    return np.where(layout.second, -2 * L.omega * k * k * weight, -derivative(weight))


def _pulled_back(L: HarmonicLinearisation, samples: Array) -> Array:
    """Gradient by c (2H + 1, q) at fixed omega from one by the states at the samples (N, >= n)."""
    layout = L.problem.layout
    places, velocities = layout.pairs
    out = layout.basis.synthesis.T @ samples[:, layout.unknowns]
    out[:, places] += L.omega * (layout.basis.slope.T @ samples[:, velocities])
    return np.asarray(out)


def _sizes(L: HarmonicLinearisation) -> Array:
    return np.concatenate([L.problem.scales, np.maximum(np.abs(L.params), 1e-3)])


def _second(L: HarmonicLinearisation, direction: Array) -> Array:
    """f_zz[direction, e_l] for all l: (n + m, N, n), one batched call; unit directions of the variables' size."""
    count, width = direction.shape
    sizes = _sizes(L)
    length = float(np.abs(direction / sizes).max())
    if length == 0:
        return np.zeros((width, count, L.X.shape[1]))
    units = np.repeat(np.diag(sizes), count, axis=0)
    values = L.problem.evaluations.second(
        np.tile(L.problem.phase, width), np.tile(L.X, (width, 1)), L.params, np.tile(direction / length, (width, 1)),
        units
    )
    return np.asarray(values.reshape(width, count, -1) * (length / sizes)[:, None, None])


def curvature(L: HarmonicLinearisation) -> Array:
    """d2 f_r / dx_s dz_l at the samples: (N, n, n, n + m), one batched call."""
    n, (count, width) = L.problem.layout.n, (L.problem.layout.samples, L.problem.layout.n + L.params.size)
    sizes = _sizes(L)
    units = np.diag(sizes)
    first, other = np.repeat(units[:n], width * count, axis=0), np.tile(np.repeat(units, count, axis=0), (n, 1))
    values = L.problem.evaluations.second(
        np.tile(L.problem.phase, n * width), np.tile(L.X, (n * width, 1)), L.params, first, other
    )
    values = values.reshape(n, width, count, n) / (sizes[:n, None] * sizes)[:, :, None, None]
    return np.ascontiguousarray(values.transpose(2, 3, 0, 1))


def spectral_gradient(L: HarmonicLinearisation, w: Array, v: Array) -> tuple[Array, Array]:
    """Gradient of w^T M v by u (N,) and by p (m,)."""
    problem, layout, modes = L.problem, L.problem.layout, L.modes
    n, omega, T = layout.n, L.omega, L.period
    left, right, by_period = _factors(modes, w / problem.scales, v * problem.scales, T)
    a, b = left.reshape(layout.count, n, -1), right.reshape(layout.count, n, -1)  # G = sum_j a_j b_j^T
    at = np.tensordot(layout.basis.analysis.T, a, 1), np.tensordot(layout.basis.synthesis, b, 1)
    weights = np.einsum("krj,ksj->krs", *at, optimize=True)
    samples = np.einsum("krs,krsl->kl", weights, L.curvature, optimize=True)
    k, cosine, sine = np.arange(1, layout.harmonics + 1), slice(1, None, 2), slice(2, None, 2)
    by_omega = (k[:, None, None] * (a[sine] * b[cosine] - a[cosine] * b[sine])).sum()
    _, velocities = layout.pairs
    by_omega += (samples[:, velocities] * L.X[:, velocities]).sum() / omega
    by_c = _pulled_back(L, samples).ravel()
    by_p = samples[:, n:].sum(axis=0)
    if problem.own:
        found = np.append(by_c, by_period - omega / T * by_omega), by_p
    else:
        found = by_c, by_p + by_omega * L.omega_slopes + by_period * L.period_slopes
    if np.iscomplexobj(w) or np.iscomplexobj(v):
        return found
    return np.real(found[0]), np.real(found[1])


def _factors(modes: Any, w: Array, v: Array, T: float) -> tuple[Array, Array, complex]:
    """(A, B) with G = A B^T, and the derivative by T at fixed Hill matrix, of w^T M v; w, v in the states' own units.

    The selected modes come in conjugate pairs, so that M is real and the formula holds for complex w and v too.
    """
    chosen, values, vectors = modes.chosen, modes.values, modes.vectors
    mu, Y = modes.multipliers, modes.start[:, chosen]
    b = np.linalg.solve(Y, v.astype(complex))
    a = w @ modes.start
    M = (Y * mu) @ np.linalg.inv(Y)
    a_M = w @ M @ modes.start
    gap = values[chosen][None, :] - values[:, None]
    small = np.abs(gap) < _SAME * (1 + np.abs(values[chosen]))[None, :]
    C = np.where(small, 0.0, (a[:, None] * mu - a_M[:, None]) * b / np.where(small, 1.0, gap))
    C[chosen, np.arange(len(chosen))] = a[chosen] * T * mu * b
    return modes.inverse.T @ C, vectors[:, chosen], complex((w @ Y) @ (values[chosen] * mu * b))
