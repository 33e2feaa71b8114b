r"""Hill's matrix of a linear periodic system and its Floquet exponents; the Koopman form of the monodromy matrix.

y' = A(t) y with A of frequency omega; y = exp(lambda t) p(t), p periodic, gives p' + lambda p = A p. With the series of
p cut off after H harmonics (real coefficients, harmonic by harmonic, states inside) that is the matrix eigenproblem

    ( T(A) - omega D ) p = lambda p,        size n (2H + 1).

Every exponent appears as lambda + i m omega, m = -H .. H (its mode shifted by m harmonics), the outer ones spoilt by
the truncation. *Selection*: multipliers mu = exp(lambda T) are wanted once each. Sorting by the imaginary part takes
those of one strip of width omega; a strip -omega/2 .. omega/2 cuts through exponents at half the frequency (mu < 0,
period-2 tongues), of which it may keep both copies of one and lose another. Here the strip is -c < Im <= omega - c with
the edge c put where no exponent is near, and eigenvectors decide where the count is not n: those centred nearest to
harmonic zero (weighted mean) come first, a copy of one that is taken already is skipped.

*Koopman-Hill*: with z_m = y exp(-i m omega t), z' = Hill z, z(0) = (y(0), y(0), ...): Phi(T) = C exp(Hill T) W, no
eigenvalues, no sorting; it converges with H, from the outside in. The subharmonic form uses the matrix of frequency
omega/2, whose odd harmonics start from another set of values, and takes the mean of the two.

References: G. W. Hill (1886); A. Lazarus, O. Thomas (2010), C. R. Mecanique 338, 510-517; L. Guillot et al. (2020),
J. Comput. Phys. 416, 109477; F. Bayer, R. I. Leine (2023), Nonlinear Dynamics 111, 15439-15460.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .fourier import fourier_basis

__all__ = ["hill_matrix", "koopman_hill", "mean_harmonics", "selected"]

Array = NDArray[np.float64]
_COPY = 0.02  # exponents closer than this (in omega) after a shift by whole harmonics are one
_EDGES = (0.5, 0.48, 0.46, 0.43, 0.4, 0.36, 0.32, 0.28)


def hill_matrix(products: Array, omega: float) -> Array:
    """T(A) - omega D, (N, N) with N = n (2H + 1), from the products T(A) (2H + 1, 2H + 1, n, n)."""
    count, n = products.shape[0], products.shape[2]
    matrix = products.transpose(0, 2, 1, 3).reshape(count * n, count * n).copy()
    k = np.repeat(np.arange(1, (count + 1) // 2), n)
    place = np.tile(np.arange(n), (count - 1) // 2)
    cosine, sine = (2 * k - 1) * n + place, 2 * k * n + place
    matrix[cosine, sine] -= omega * k
    matrix[sine, cosine] += omega * k
    return matrix


def mean_harmonics(vectors: NDArray[np.complex128], n: int) -> tuple[Array, Array]:
    """Weighted means of k and of |k| over the squared harmonics of every column: ((K,), (K,))."""
    c = vectors.reshape(-1, n, vectors.shape[1])
    plus, minus = 0.5 * (c[1::2] - 1j * c[2::2]), 0.5 * (c[1::2] + 1j * c[2::2])
    up, down = (np.abs(plus) ** 2).sum(axis=1), (np.abs(minus) ** 2).sum(axis=1)
    k = np.arange(1, len(up) + 1)[:, None]
    total = (np.abs(c[0]) ** 2).sum(axis=0) + up.sum(axis=0) + down.sum(axis=0)
    return (k * (up - down)).sum(axis=0) / total, (k * (up + down)).sum(axis=0) / total


def selected(
    values: NDArray[np.complex128], spread: Array, omega: float, n: int
) -> tuple[NDArray[np.int64], bool]:
    """Indices (n,) of the exponents, one for each multiplier, and whether the strip alone decided.

    Parameters
    ----------
    values : (N,) eigenvalues of Hill's matrix;  spread : (N,) mean |k| of their vectors.
    """
    im = values.imag / omega
    near = im[np.abs(im) < 1.6]
    edges = [(float(min(np.abs(near + c).min(), np.abs(near - (1 - c)).min())), c) for c in _EDGES] if near.size else []
    best = max((min(gap, 0.02), c) for gap, c in edges)[1] if edges else 0.5
    inside = np.flatnonzero((im > -best) & (im <= 1 - best))
    if len(inside) == n:
        return inside, True
    # a strip that holds too many or too few: the best centred ones first, each multiplier once
    order = np.argsort(spread + 1e-6 * np.abs(im), kind="stable").tolist()
    taken: list[int] = []
    for i in order:
        gaps = [(values[i] - values[j]) / omega for j in taken]
        if not any(round(d.imag) != 0 and abs(d - 1j * round(d.imag)) < _COPY for d in gaps):
            taken.append(i)
        if len(taken) == n:
            break
    taken += [i for i in order if i not in taken][: n - len(taken)]
    return np.array(taken, np.int64), False


def koopman_hill(A: Array, omega: float, harmonics: int, subharmonic: bool = True) -> Array:
    """Phi(T) (n, n) = C exp(Hill T) W from samples A (K, n, n) of one period, T = 2 pi / omega.

    K >= 4 H + 3, and 2 K >= 8 H + 7 for the subharmonic form, which resolves twice the frequencies.

    Examples
    --------
    >>> import numpy as np
    >>> oscillator = np.tile([[0.0, 1.0], [-0.25, 0.0]], (20, 1, 1))
    >>> koopman_hill(oscillator, 1.0, 2).round(10) + 0.0
    array([[-1.,  0.],
           [ 0., -1.]])
    """
    from scipy.linalg import expm

    n, T = A.shape[1], 2 * np.pi / omega
    basis = fourier_basis(harmonics, len(A))
    count = 2 * harmonics + 1
    products = basis.multiplication(A.reshape(len(A), -1)).reshape(count, count, n, n)
    at_zero = np.zeros(count)
    at_zero[0], at_zero[1::2] = 1.0, 2.0  # z_m(0) = y(0) for all m: a Dirac comb, mean 1 and all cosines 2
    W = np.kron(at_zero[:, None], np.eye(n))
    direct = (expm(hill_matrix(products, omega) * T) @ W)[:n]
    if not subharmonic:
        return np.asarray(direct)
    # harmonics (m - 1/2) omega: p = exp(i omega t / 2) x (integer harmonics), real as pairs; the orbit run twice
    twice = np.concatenate([A, A])
    H2 = 2 * harmonics + 1
    basis = fourier_basis(H2, len(twice))
    count = 2 * H2 + 1
    products = basis.multiplication(twice.reshape(len(twice), -1)).reshape(count, count, n, n)
    odd = np.flatnonzero(basis.k % 2 == 1)
    keep = (odd[:, None] * n + np.arange(n)).ravel()
    half = hill_matrix(products, omega / 2)[np.ix_(keep, keep)]
    comb = np.where(odd % 2 == 1, 2.0, 0.0)
    z = expm(half * T) @ np.kron(comb[:, None], np.eye(n))
    # y(T) = z_(1/2)(T) exp(i omega T / 2) = - z_(1/2)(T): cosine coefficient of the lowest harmonic, halved
    lowest = -0.5 * z[:n]
    return np.asarray(0.5 * (direct + lowest))
