r"""Floquet multipliers of a computed period map, each with its error.

Given the matrix M of one period, its factors ``M = F_K ... F_1``, ``det M = exp(int_0^T tr A dt)`` (Liouville) and
the error ``|dM|``:

* n = 2. With ``D = ((M11 - M22)/2)^2 + M12 M21`` the multipliers are ``tr/2 +- sqrt D``; real ones: the larger by
  this formula, the smaller as ``det/mu``, so that it keeps its relative accuracy however small it is; a pair: of
  modulus ``sqrt det``. The error follows from those of trace and D, including the square root at ``D = 0``.
* Decoupled or one-way coupled states: the multipliers are those of the diagonal blocks, each with its own error.
* n > 2. If all moduli are of similar size, ``eig(M)``; else the eigenvalues of the product from the factors
  (`stability.kernels.periodic_schur`). First-order error ``|y| |dM| |x| / |y^H x|`` while it is small against the gap
  to the next multiplier, else the bound of Elsner, ``|dmu| <= (|M| + |M + dM|)^(1 - 1/n) |dM|^(1/n)``.

Reference: G. W. Stewart, J. Sun, Matrix perturbation theory (1990), chapter IV.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.block_triangular import mutual_blocks
from ..kernels.periodic_schur import product_eigenvalues

__all__ = ["multipliers_with_errors"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_GRADED = 1e-4  # the smallest modulus over the largest, below which the product itself is not trusted
_EPS = float(np.finfo(float).eps)


def multipliers_with_errors(
    matrix: Array, factors: Array, log_determinant: float, error: float
) -> tuple[Complex, Array, NDArray[np.intp]]:
    """Multipliers (n,), descending modulus, their absolute errors (n,), and the block of coupled states of each.

    Parameters
    ----------
    matrix : (n, n), product of the factors.
    factors : (K, n, n), first one applied first.
    log_determinant : ``int_0^T tr A dt``.
    error : estimated error of the entries of `matrix` (largest).

    Notes
    -----
    *Accuracy*: checked against closed forms (constant coefficients, Meissner) and 30-digit values down to 1e-28.
    """
    blocks = mutual_blocks((matrix != 0) | (factors != 0).any(axis=0))
    if len(blocks) > 1:
        return _blockwise(matrix, factors, blocks, error)
    values, errors = _coupled(matrix, factors, log_determinant, error)
    return values, errors, np.zeros(len(values), dtype=np.intp)


def _coupled(matrix: Array, factors: Array, log_determinant: float, error: float) -> tuple[Complex, Array]:
    """One block of coupled states."""
    if len(matrix) == 1:
        value = float(np.exp(log_determinant)) if matrix[0, 0] > 0 else float(matrix[0, 0])
        return np.array([value], dtype=complex), np.array([error])
    if len(matrix) == 2:
        return _two(matrix, log_determinant, error)
    return _many(matrix, factors, error)


def _blockwise(
    matrix: Array, factors: Array, blocks: list[NDArray[np.intp]], error: float
) -> tuple[Complex, Array, NDArray[np.intp]]:
    """Each diagonal block of a block-triangular period map by itself."""
    values, errors = [], []
    for members in blocks:
        part = np.ix_(members, members)
        own = np.ascontiguousarray(factors[:, part[0], part[1]])
        logarithm = float(np.sum(np.linalg.slogdet(own)[1]))
        v, e = _coupled(matrix[part], own, logarithm, error)
        values.append(v)
        errors.append(e)
    joined, spread = np.concatenate(values), np.concatenate(errors)
    labels = np.repeat(np.arange(len(blocks)), [len(b) for b in blocks])
    order = np.lexsort((-joined.imag, -np.round(np.abs(joined), 13)))
    return joined[order], spread[order], labels[order]


def _two(matrix: Array, log_determinant: float, error: float) -> tuple[Complex, Array]:
    """Closed form for n = 2."""
    half = 0.5 * (matrix[0, 0] + matrix[1, 1])
    discriminant = (0.5 * (matrix[0, 0] - matrix[1, 1])) ** 2 + matrix[0, 1] * matrix[1, 0]
    spread = error * (abs(matrix[0, 0] - matrix[1, 1]) + abs(matrix[0, 1]) + abs(matrix[1, 0]) + 2.0 * error)
    # |sqrt(D + d) - sqrt(D)| <= min(sqrt d, d / sqrt|D|)
    root = np.sqrt(abs(discriminant))
    shift = error + (min(np.sqrt(spread), spread / root) if root > 0 else np.sqrt(spread))
    if discriminant >= 0:
        large = half + np.copysign(root, half)
        if large == 0.0:
            return np.zeros(2, complex), np.full(2, shift)
        small = np.copysign(np.exp(log_determinant - np.log(abs(large))), large)
        values = np.array([large, small], dtype=complex)
        return values, np.array([shift, min(shift, abs(small) * (shift / abs(large) + 4.0 * _EPS))])
    modulus = np.exp(0.5 * log_determinant)
    value = complex(half, root)
    value *= modulus / abs(value)
    return np.array([value, value.conjugate()]), np.full(2, shift)


def _many(matrix: Array, factors: Array, error: float) -> tuple[Complex, Array]:
    """Eigenvalues for n > 2, from the factors where the spectrum is graded."""
    n = len(matrix)
    values, right = np.linalg.eig(matrix)
    values = values.astype(complex)
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 13)))
    values, right = values[order], right[:, order]
    norm = float(np.linalg.norm(matrix, 2))
    size = n * error
    graded = np.abs(values[-1]) < _GRADED * norm
    exact = product_eigenvalues(factors) if graded else values
    bound = (2.0 * norm + size) ** (1.0 - 1.0 / n) * size ** (1.0 / n)
    try:
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError:
        return exact, np.full(n, bound)
    condition = np.linalg.norm(left, axis=1) * np.linalg.norm(right, axis=0)
    first = condition * size
    distance = np.abs(values[:, None] - values[None, :])
    np.fill_diagonal(distance, np.inf)
    errors = np.where(first < 0.25 * distance.min(axis=1), 2.0 * first, np.maximum(first, bound))
    if graded:
        # from the factors: the relative error is that of the steps, whatever the size of the multiplier
        relative = np.maximum(size / max(norm, 1e-300), 64.0 * _EPS * len(factors))
        small = np.abs(exact) < _GRADED * norm
        errors = np.where(small, np.minimum(errors, 1e3 * relative * np.abs(exact)), errors)
    return exact, errors
