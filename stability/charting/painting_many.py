"""Grid values for more than two states: quartics in closed form, eigenvalues beyond.

The fields are those of M0 = M exp(-sigma T): for four states c1, c2, c3 of its characteristic polynomial and then its
16 entries; else the n^2 entries. An error d of the polynomial's value moves a root z by d / |P'(z)|; where that
exceeds the tolerance (two multipliers close together, which the entries often determine much better than the
coefficients do) the point is done again with the eigenvalues of M0 and the condition numbers of its eigenvectors.
For a reciprocal quartic, w = z + 1/z: |dz / z| = |dw| / sqrt|w^2 - 4|.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.spectral_radius import four_states, four_states_reciprocal
from ..results.categories import NEUTRAL, STABLE, UNDETERMINED, UNSTABLE

__all__ = ["eigenvalue_error", "paint_four", "paint_matrix", "paint_reciprocal"]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Target = tuple[Array, Codes, Codes, list[tuple[NDArray[np.intp], NDArray[np.intp], Array]]]
_MOST_REFINED = 4096  # points of one block that are done again


def paint_reciprocal(
    f: Array, size: Array, chi: Array, sigma: Array, d: float, neutral: bool, tolerance: float,
    target: Target, bulk_only: bool,
) -> float:  # fmt: skip
    """Four states, reciprocal polynomial."""
    theta, kinds, margin = four_states_reciprocal(f[:3])
    c1, c2 = np.abs(0.5 * (f[0] + f[2])), f[1]
    gap = np.abs(c1 * c1 - 4.0 * c2 + 8.0)
    d_gap = d * (2.0 * c1 + 4.0 + d)
    dw = 0.5 * d + np.minimum(0.25 * d_gap / np.sqrt(np.maximum(gap, 1e-300)), 0.5 * np.sqrt(d_gap))
    w_squared = 4.0 * np.sinh(theta) ** 2
    complex_pair = margin >= np.maximum(gap, 0.0)
    distance = np.where(complex_pair & (kinds == 3), np.maximum(w_squared, gap), w_squared)
    each = np.minimum(dw / np.sqrt(np.maximum(distance, 1e-300)), np.sqrt(dw * (1.0 + np.abs(c1))))
    inside = margin < 0
    each = chi * np.where(inside, np.where(-margin > np.maximum(2.0 * dw, d_gap), 0.0, each), each)
    growth, verdict, kind, _ = target
    growth[...] = sigma + chi * theta
    if neutral:
        doubt = np.maximum(2.0 * dw, d_gap)
        verdict[...] = np.where(margin > doubt, UNSTABLE, np.where(margin < -doubt, NEUTRAL, UNDETERMINED))
    else:
        verdict[...] = np.where(growth > each, UNSTABLE, np.where(growth < -each, STABLE, UNDETERMINED))
    kind[...] = np.where(verdict == UNSTABLE, np.where(theta > 0, kinds, 3), 0)
    return _summary(each, bulk_only)


def paint_four(
    f: Array, size: Array, chi: Array, sigma: Array, d: float, neutral: bool, tolerance: float,
    target: Target, bulk_only: bool,
) -> float:  # fmt: skip
    """Four states, any polynomial of determinant 1."""
    growth, verdict, kind, _ = target
    theta, kinds, slope = four_states(f[:3])
    radius = np.exp(theta)
    each = slope * (radius * (1.0 + radius * (1.0 + radius)))
    each *= d
    each += 4e-15
    each *= chi
    growth[...] = theta
    growth *= chi
    growth += sigma
    bad = np.flatnonzero(each > tolerance)
    if bad.size and len(f) > 3 and not bulk_only:
        worst = bad if bad.size <= _MOST_REFINED else bad[np.argsort(-each.ravel()[bad])[:_MOST_REFINED]]
        rows, columns = np.unravel_index(worst, growth.shape)
        M = f[3:, rows, columns].T.reshape(-1, 4, 4)
        z, dz = _dominant(M, d)
        scale, offset = (np.broadcast_to(t, growth.shape)[rows, columns] for t in (chi, sigma))
        better = scale * dz / np.abs(z) < each[rows, columns]
        rows, columns, z, dz = rows[better], columns[better], z[better], dz[better]
        growth[rows, columns] = offset[better] + scale[better] * np.log(np.abs(z))
        each[rows, columns] = scale[better] * dz / np.abs(z)
        kinds[rows, columns] = _kinds(z)
    verdict[...] = UNDETERMINED
    verdict[growth > each] = UNSTABLE
    verdict[growth < -each] = STABLE
    kind[...] = kinds * (verdict == UNSTABLE)
    return _summary(each, bulk_only)


def paint_matrix(
    f: Array, size: Array, chi: Array, sigma: Array, d: float, neutral: bool, tolerance: float,
    target: Target, bulk_only: bool,
) -> float:  # fmt: skip
    """Any number of states: eigenvalues of M0 at every point; their condition at every 64th (at all, bulk only)."""
    growth, verdict, kind, _ = target
    n = round(float(np.sqrt(len(f))))
    shape = f.shape[1:]
    M = f.reshape(n * n, -1).T.reshape(-1, n, n)
    z = np.linalg.eigvals(M)
    lead = z[np.arange(len(z)), np.abs(z).argmax(axis=1)]
    sample = M if bulk_only else M[:: max(1, min(64, len(M) // 8))]
    _, dz = _dominant(sample, d)
    relative = dz / np.maximum(np.abs(_largest(sample)), 1e-300)
    error = float(np.max(chi)) * float(relative.max())
    growth[...] = sigma + chi * np.log(np.abs(lead)).reshape(shape)
    calm = NEUTRAL if neutral else STABLE
    verdict[...] = UNDETERMINED
    verdict[growth > error] = UNSTABLE
    verdict[growth < (error if neutral else -error)] = calm
    kind[...] = _kinds(lead).reshape(shape) * (verdict == UNSTABLE)
    return error


def _largest(M: Array) -> NDArray[np.complex128]:
    z = np.linalg.eigvals(M)
    return np.asarray(z[np.arange(len(z)), np.abs(z).argmax(axis=1)])


def eigenvalue_error(M: Array, d: float) -> Array:
    """Error of the largest eigenvalue of each matrix (B, n, n) whose entries are off by at most d: (B,)."""
    return _dominant(M, d)[1]


def _dominant(M: Array, d: float) -> tuple[NDArray[np.complex128], Array]:
    """Largest eigenvalues (B,) and their error: condition number times n d, at most (n d |M|^(n - 1))^(1 / n)."""
    n = M.shape[-1]
    values, right = np.linalg.eig(M)
    rows, lead = np.arange(len(M)), np.abs(values).argmax(axis=1)
    size = np.abs(M).max(axis=(1, 2))
    perturbation = n * d + 4e-16 * n * size
    try:
        left = np.linalg.inv(right)
        condition = np.sqrt((np.abs(left[rows, lead]) ** 2).sum(axis=1))  # right vectors have unit length
    except np.linalg.LinAlgError:  # an exactly defective matrix somewhere in the batch
        condition = np.full(len(M), np.inf)
    cap = np.sqrt(perturbation * np.maximum(size, 1.0)) * 4.0
    return values[rows, lead].astype(complex), np.minimum(condition * perturbation, cap)


def _kinds(z: NDArray[np.complex128]) -> Codes:
    """1, 2 or 3 for positive real, negative real and complex multipliers."""
    pair = np.abs(z.imag) > 1e-9 * np.abs(z)
    return np.where(pair, 3, np.where(z.real > 0, 1, 2)).astype(np.int8)


def _summary(each: Array, bulk_only: bool) -> float:
    """Largest error; in the bulk the median, since tiles cannot cure the neighbourhood of double multipliers."""
    return float(np.median(each)) if bulk_only else float(each.max())
