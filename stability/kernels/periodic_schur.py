r"""Eigenvalues of a product of matrices from its factors, each to relative accuracy: periodic orthogonal iteration.

Wanted are the eigenvalues of ``M = F_K ... F_2 F_1``. In the product itself all eigenvalues below ``eps |M|`` are
lost (multipliers of strongly contracting directions). Instead, orthogonal bases are carried through the factors,

    F_j Q_{j-1} = Q_j R_j,   j = 1 .. K   (QR, R upper triangular with positive diagonal),

round and round: after each round ``M Q_0 = Q_K R_K ... R_1``, so that ``M`` in the basis ``Q_0`` is ``W R`` with the
orthogonal ``W = Q_0^T Q_K``. The lower left blocks of ``W`` fall per round by the ratio of the moduli on both sides
(Bauer's iteration); ``Q_K`` is the next ``Q_0``. Where ``W`` has become block diagonal, ``W R`` is block triangular:
eigenvalues of a block are those of ``W_bb (R_K)_bb ... (R_1)_bb``, whose rows are of similar size, because a block
holds only moduli that are close to each other, as those of complex pairs are. Each step commits errors relative to
the column it works on, hence the relative accuracy.

The iteration ends when no block spans more than a factor 100 in modulus (`_SPREAD`), or after `_ROUNDS` rounds with
the blocks reached; the relative error of an eigenvalue is then of the order ``K eps`` times the condition of the
factors times the spread of its block.

References: F. L. Bauer, Z. angew. Math. Phys. 8 (1957) 214 (Treppeniteration); A. Bojanczyk, G. Golub, P. Van Dooren,
The periodic Schur decomposition, Proc. SPIE 1770 (1992) 31-42; K. Lust, Int. J. Bifurcation Chaos 11 (2001) 2389.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, NonFiniteError

__all__ = ["product_eigenvalues"]

Array = NDArray[np.float64]

_ROUNDS = 400
_SPREAD = 100.0
_DECOUPLED = 1e-15  # entries of W below this times sqrt(n) separate blocks


def product_eigenvalues(factors: ArrayLike, logarithm: bool = False) -> NDArray[np.complex128]:
    """Eigenvalues of ``factors[-1] @ ... @ factors[1] @ factors[0]``, small ones to relative accuracy, too.

    Parameters
    ----------
    factors : (K, n, n) float, first factor applied first; finite. Each should be reasonably conditioned (a time step).
    logarithm : give the principal logarithms instead, for products beyond the range of floating point numbers; a
        zero eigenvalue is ``-inf``.

    Returns
    -------
    (n,) complex, descending modulus; a conjugate pair with the positive imaginary part first.

    Raises
    ------
    InputError
        Not a stack of square matrices.
    NonFiniteError
        A factor holds NaN or infinity.

    Notes
    -----
    *Accuracy*: relative error about ``K eps cond(F)``, checked against products of known spectrum and against 50-digit
    arithmetic. Eigenvalues that are defective or clustered keep the usual root of it.

    Examples
    --------
    >>> step = np.diag([1.0, 1e-3]) + np.array([[0.0, 0.5], [0.0, 0.0]])
    >>> print(f"{product_eigenvalues(np.array([step] * 10))[1].real:.12g}")
    1e-30
    """
    stack = np.asarray(factors, dtype=float)
    if stack.ndim != 3 or stack.shape[1] != stack.shape[2] or stack.shape[0] == 0 or stack.shape[1] == 0:
        raise InputError(f"factors have shape {stack.shape}; a stack (K, n, n) of square matrices is needed")
    if not np.isfinite(stack).all():
        raise NonFiniteError(f"factor {int(np.argwhere(~np.isfinite(stack))[0, 0])} holds NaN or infinity")
    logs = _logarithms(stack)
    order = np.lexsort((-logs.imag, -np.round(logs.real, 12)))
    logs = logs[order]
    if logarithm:
        return logs
    with np.errstate(over="ignore", under="ignore"):
        values = np.exp(logs)
    real = (logs.imag == 0.0) | (logs.imag == np.pi)
    return np.where(real, np.where(logs.imag == 0.0, 1.0, -1.0) * np.exp(logs.real), values)


def _logarithms(stack: Array) -> NDArray[np.complex128]:
    """Logarithms of the eigenvalues, block after block."""
    basis = np.eye(stack.shape[1])
    best: NDArray[np.complex128] | None = None
    for turn in range(_ROUNDS):
        start = basis
        basis, triangles = _round(stack, basis)
        turned = start.T @ basis
        # looking at the blocks costs as much as a round: do it ever more rarely
        if turn < 4 or turn % 8 == 7 or turn == _ROUNDS - 1:
            best, spread = _blocks(turned, triangles)
            if spread <= _SPREAD:
                break
    assert best is not None
    return best


def _round(stack: Array, basis: Array) -> tuple[Array, Array]:
    """Carry an orthogonal basis through all factors: the new basis and the triangles (K, n, n)."""
    triangles = np.empty_like(stack)
    for j, factor in enumerate(stack):
        basis, upper = np.linalg.qr(factor @ basis)
        signs = np.where(np.diagonal(upper) < 0, -1.0, 1.0)
        basis, triangles[j] = basis * signs, upper * signs[:, None]
    return basis, triangles


def _blocks(turned: Array, triangles: Array) -> tuple[NDArray[np.complex128], float]:
    """Eigenvalue logarithms of the diagonal blocks that `turned` has reached, and the largest spread in one."""
    n = len(turned)
    small = _DECOUPLED * np.sqrt(n)
    cuts = [0, *(i for i in range(1, n) if np.abs(turned[i:, :i]).max() <= small * max(1, n - i)), n]
    logs, spread = np.empty(n, dtype=complex), 1.0
    for low, high in pairwise(cuts):
        part = _block(turned[low:high, low:high], triangles[:, low:high, low:high])
        logs[low:high] = part
        sizes = part.real[np.isfinite(part.real)]
        if part.size > 1:  # an eigenvalue that rounding made zero has an unknown size: the block must come apart
            spread = max(spread, float(np.exp(min(np.ptp(sizes), 700.0))) if sizes.size == part.size else np.inf)
    return logs, spread


def _block(turned: Array, triangles: Array) -> NDArray[np.complex128]:
    """Logarithms of the eigenvalues of ``turned @ triangles[-1] @ ... @ triangles[0]``, with the scale kept apart."""
    if len(turned) == 1:
        diagonal = triangles[:, 0, 0]
        with np.errstate(divide="ignore"):
            size = float(np.sum(np.log(diagonal)))
        return np.array([complex(size, 0.0 if turned[0, 0] > 0 else np.pi)])
    product, exponent = np.eye(len(turned)), 0
    for upper in triangles:
        product = upper @ product
        largest = np.abs(product).max()
        if largest == 0.0:
            return np.full(len(turned), -np.inf + 0j)
        _, shift = np.frexp(largest)
        product, exponent = np.ldexp(product, -shift), exponent + int(shift)
    values = np.linalg.eigvals(turned @ product).astype(complex)
    with np.errstate(divide="ignore"):
        return np.log(np.abs(values)) + exponent * np.log(2.0) + 1j * np.angle(values)
