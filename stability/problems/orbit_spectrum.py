"""Multipliers of a periodic orbit as integer counts and a verdict.

Stable: all multipliers inside the unit circle, apart from the trivial one of an autonomous orbit. The trivial
multiplier belongs to the direction f of the flow; it is removed exactly, by the orthogonal change of basis whose first
vector is f / |f|,

    Q^T M Q = [ 1  * ]
              [ 0  M_2 ],      multipliers = eigenvalues of M_2,

and |M f - f| / |f| is a measured error. A multiplier closer to the unit circle than the error is not counted as
outside, and a verdict that depends on it is UNDETERMINED.

Liouville's formula is a second witness at every point: the product of all multipliers is exp(int_0^T tr J dt). What the
product misses becomes part of the error (`liouville_gap`), so that a Jacobian that is not the field's own, a mesh too
coarse or a product of matrices that has lost its digits leaves no verdict standing that it could have turned.

    gap = |prod mu - E| / prod max(|mu|, r),      E = sign exp(int tr J),      r = 1e-3 max(1, largest |mu|),

is the error of one multiplier that would explain what is missed. A product that is too large, |prod mu| > |E|, may owe
it to the k smallest multipliers alone (k = 1; 2: a conjugate pair, where there are others). If so their true size is
s = |mu_n| (|E| / |prod mu|)^(1/k). Where |mu_n| < 1 and s <= r this is what is believed, and gap = 0: the error is
below |mu_n| itself, leads inwards and says nothing about any other multiplier. Gauss's rule does that to the mode of a
stiff state: degree 5 leaves about (1 - 60/|z|)^N, some hundredths, for z = h lambda = -300 on N = 20 intervals, where
the multiplier is e^-6000. A product that is too small is never explained so, nor
one whose smallest factor is not faint.
"""

from __future__ import annotations

import math

import numpy as np

from ..floquet.verdicts import classify
from ..kernels.periodic_schur import product_eigenvalues
from ..protocols import Spectrum
from ..words import Verdict

__all__ = ["contracted", "deflated", "eigenvalues", "liouville_gap", "orbit_spectrum", "spectrum_distance"]

Array = np.ndarray
_FAINT = 1e-3  # multipliers below this part of the largest may be wrong by much and leave the others right


def eigenvalues(matrix: Array) -> Array:
    """Complex eigenvalues by descending modulus; 2 x 2 in closed form (without cancellation)."""
    if matrix.shape == (2, 2):
        (a, b), (c, d) = matrix.tolist()
        half, det = (a + d) / 2, a * d - b * c
        square = 0.25 * (a - d) * (a - d) + b * c  # a power would raise where this overflows
        if square >= 0:
            large = half + math.copysign(math.sqrt(square), half)
            return np.array([large, det / large if large else 0.0], complex)
        root = math.sqrt(-square)
        return np.array([complex(half, root), complex(half, -root)])
    if not matrix.size:
        return np.zeros(0, complex)
    values = np.linalg.eigvals(matrix).astype(complex)
    return np.asarray(values[np.lexsort((-values.imag, -np.abs(values).round(14)))])


def deflated(matrix: Array, direction: Array) -> tuple[Array, float]:
    """(M_2, |M f - f| / |f|); see the head of this file."""
    f = direction / np.linalg.norm(direction)
    reflector = f.copy()
    reflector[0] += math.copysign(1.0, f[0])
    H = np.eye(len(f)) - 2 * np.outer(reflector, reflector) / (reflector @ reflector)
    return (H @ matrix @ H)[1:, 1:], float(np.linalg.norm(matrix @ f - f))


def spectrum_distance(values: Array, others: Array) -> float:
    """Largest distance of the values near or outside the unit circle to their partners, relative to max(1, |mu|)."""
    worst = 0.0
    for value in values.tolist():
        if abs(value) > 0.3:
            worst = max(worst, min(abs(value - other) for other in others.tolist()) / max(1.0, abs(value)))
    return worst


def contracted(values: Array, factors: Array) -> Array:
    """`values` with those below 1e-10 of the largest replaced by the relatively accurate ones of the factors' product.

    Eigenvalues of a product that has been multiplied out are known to rounding of the largest only; the periodic QR
    algorithm on the factors (N, n, n) knows them all. `values` may lack the trivial multiplier.
    """
    size = [abs(z) for z in values.tolist()]
    limit = 1e-10 * max(1.0, *size) if size else 0.0
    count = sum(one < limit for one in size)
    if not count:
        return values
    exact = product_eigenvalues(factors)
    out = values.copy()
    out[len(values) - count :] = exact[len(exact) - count :]
    return out


def liouville_gap(values: Array, integral: float, sign: float = 1.0) -> float:
    """Error of the multipliers near the unit circle that Liouville's formula asks for.

    An error e of one multiplier changes the product by e times the others; see the head of this file for the formula.
    The floor r keeps strongly contracted multipliers, whose own relative error is no concern of the others, from being
    taken for an error of those. (The trivial multiplier 1 may be left out.)

    integral : int_0^T tr J dt;  sign : that of the determinant of the orbit's symmetry

    >>> liouville_gap(np.array([0.8 + 0.4j, 0.8 - 0.4j]), math.log(0.8)) < 1e-15
    True
    >>> round(liouville_gap(np.array([0.9 + 0j, 0.8 + 0j]), math.log(0.738)), 3)
    0.025
    >>> liouville_gap(np.array([0.9 + 0j, 0.02 + 0j]), -6000.0)
    0.0
    """
    product, others = 1.0 + 0.0j, 1.0
    listed = values.tolist()
    sizes = [abs(value) for value in listed]
    least = _FAINT * max(1.0, max(sizes, default=0.0))
    for value, size in zip(listed, sizes):
        product *= value
        others *= max(size, least)
    if not math.isfinite(others):
        return 0.0  # the product means nothing; the values say so themselves
    expected = sign * math.exp(min(integral, 700.0))
    if _smallest_are_smaller(sizes, abs(product), abs(expected), least):
        return 0.0
    return abs(product.real - expected) / others


def _smallest_are_smaller(sizes: list[float], product: float, expected: float, faint: float) -> bool:
    """Whether faint smallest multipliers explain a product that is too large; see the head of this file."""
    smallest = min(sizes, default=1.0)
    if not (expected < product and smallest < 1.0):
        return False
    k = sum(size <= smallest * (1 + 1e-9) for size in sizes)
    return (k == 1 or k < len(sizes)) and smallest * (expected / product) ** (1 / k) <= faint


def orbit_spectrum(values: Array, error: float, neutral: bool = False) -> Spectrum:
    """Counts and verdict of the non-trivial multipliers `values`, whose error near the unit circle is `error`.

    neutral: the equations prove that multipliers come in pairs mu, 1/mu.
    """
    plus = minus = pairs = 0
    radius = 0.0
    for value in values.tolist():
        radius = max(radius, abs(value))
        if abs(value) > 1.0:
            if value.imag == 0.0:
                plus, minus = plus + (value.real > 0), minus + (value.real < 0)
            elif value.imag > 0.0:
                pairs += 1
    if not math.isfinite(radius):
        verdict = Verdict.UNDETERMINED
    elif radius > 1.0 + error:
        verdict = Verdict.UNSTABLE
    else:
        verdict = Verdict.STABLE if radius < 1.0 - error else Verdict.UNDETERMINED
        if neutral and verdict is Verdict.UNDETERMINED:
            verdict = classify(values, error, neutral=True).verdict
    return Spectrum(values, error, plus + minus + 2 * pairs, plus, minus, pairs, verdict)
