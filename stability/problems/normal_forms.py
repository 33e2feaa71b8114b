r"""Criticality: the coefficient of the normal form at a special point, hence on which side new solutions live.

With the critical vectors A q = mu q, A^T p = mu p, p^T q = 1 (bilinear; p of the conjugate pair is conjugated) and the
second and third derivatives B, C of the vector field x' = A x + B(x, x)/2 + C(x, x, x)/6 or of the period map x -> ...:

    kind             field                                                  map
    fold             a = p.B(q, q)/2                                        the same
    pitchfork        b = p.[C(q, q, q) + 3 B(q, h)]/6,   A h = -B(q, q)     b,   (I - A) h = B(q, q)
    Hopf             l = Re p.[C(q, q, q*) - 2 B(q, A^-1 B(q, q*)) + B(q*, (2 i w - A)^-1 B(q, q))] / (2 w)
    period doubling                                                         b,   (I - A) h = B(q, q)
    Neimark-Sacker   d = Re e^-it p.[C(q, q, q*) + 2 B(q, (I - A)^-1 B(q, q*)) + B(q*, (e^2it - A)^-1 B(q, q))] / 2

(h in the complement of q). Supercritical, the new solutions attract where the old one has ceased to: b < 0, l < 0,
d < 0, but b > 0 for a period doubling (x -> -x + b x^3). A branch point with a = p.B(q, q)/2 != 0 is transcritical and
has no such word. |q| = 1 in the states' own units; for orbits at phase zero.

Near a strong resonance, exp(i k t) = 1 for k <= 4, d does not decide; it is left out.
Reference: Kuznetsov (2004), (3.20), (5.39), (5.51), (5.66), section 8.7 on strong resonances.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..words import Criticality, Kind

__all__ = ["FieldForms", "Forms", "NormalForm", "normal_form"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_ZERO = 1e-6  # a coefficient below this part of its terms is zero
_NOTHING = 1e-12  # terms of a system without nonlinearity, in scaled variables
_RESONANT = 1e-3


class NormalForm(NamedTuple):
    """The coefficient of the table above and the word; either is None where it has no meaning."""

    coefficient: float | None
    criticality: Criticality | None


class Forms(Protocol):
    """A (n, n), B(x, y), C(x, y, z) of a field or a map, multilinear over complex vectors; sizes of the variables."""

    matrix: Array
    sizes: Array

    def second(self, x: Any, y: Any) -> Any:
        """B(x, y), (n,)."""

    def third(self, x: Any, y: Any, z: Any) -> Any:
        """C(x, y, z), (n,)."""


class FieldForms:
    """The forms of a vector field at an equilibrium, in the scaled variables of its linearisation."""

    def __init__(self, L: Any) -> None:
        self.L, self.matrix, self.sizes = L, np.asarray(L.spectral), np.asarray(L.problem.scales)

    def _direction(self, x: Array) -> Array:
        return np.concatenate([x * self.sizes, np.zeros(self.L.params.size)])[None, :]

    def second(self, x: Any, y: Any) -> Any:
        """B(x, y) = D^-1 f_xx[D x, D y]."""
        return _complex_forms(self._real_second, x, y)

    def third(self, x: Any, y: Any, z: Any) -> Any:
        """C(x, y, z) = D^-1 f_xxx[D x, D y, D z]."""
        return _complex_forms(self._real_third, x, y, z)

    def _real_second(self, *vectors: Array) -> Array:
        return self._derivative(self.L.problem.evaluations.second, vectors)

    def _real_third(self, *vectors: Array) -> Array:
        return self._derivative(self.L.problem.evaluations.third, vectors)

    def _derivative(self, function: Any, vectors: tuple[Array, ...]) -> Array:
        directions = [self._direction(v) for v in vectors]
        value = function(np.zeros(1), self.L.u[None, :], self.L.params, *directions)[0]
        return np.asarray(value / self.sizes)


def _complex_forms(form: Any, *vectors: Any) -> Any:
    """A symmetric real multilinear form at complex vectors, by its real and imaginary parts."""
    total: Any = 0.0
    for choice in np.ndindex(*(2,) * len(vectors)):
        parts = [np.imag(v) if c else np.real(v) for c, v in zip(choice, vectors)]
        if all(np.any(part) for part in parts):
            total = total + 1j ** sum(choice) * form(*parts)
    return total if np.ndim(total) else np.zeros(len(vectors[0]))


def normal_form(kind: Kind, forms: Forms, circle: bool) -> NormalForm:
    """Coefficient and word of a special point; `circle` True: the forms are those of a map."""
    if kind in (Kind.FOLD, Kind.BRANCH_POINT):
        return _at_plus_one(kind, forms, circle)
    if kind is Kind.PERIOD_DOUBLING and circle:
        p, q = _null_vectors(forms.matrix + np.eye(len(forms.matrix)))
        terms = forms.cubic_terms(p, q) if hasattr(forms, "cubic_terms") else None
        if terms is None:
            h = np.linalg.solve(np.eye(len(q)) - forms.matrix, forms.second(q, q))
            terms = (p @ forms.third(q, q, q) / 6, p @ forms.second(q, h) / 2)
        return _judged(np.real(terms), forms, np.real(q), -1)
    if kind is Kind.HOPF and not circle:
        return _hopf(forms)
    if kind is Kind.NEIMARK_SACKER and circle:
        return _torus(forms)
    return NormalForm(None, None)


def _critical_vectors(matrix: Array, target: complex) -> tuple[Complex, Complex]:
    """(p, q), p^T q = 1, |q| = 1, of the eigenvalue nearest to `target`."""
    values, right = np.linalg.eig(matrix)
    q = right[:, int(np.argmin(np.abs(values - target)))]
    values, left = np.linalg.eig(matrix.T)
    p = left[:, int(np.argmin(np.abs(values - target)))]
    q = q * np.exp(-1j * np.angle(q[int(np.argmax(np.abs(q)))]))
    if not np.imag(target):
        q, p = np.real(q), np.real(p)
    q = q / np.linalg.norm(q)
    return p / (p @ q), q


def _null_vectors(matrix: Array) -> tuple[Array, Array]:
    """(p, q), p^T q = 1, |q| = 1, of a singular matrix."""
    left, _, right = np.linalg.svd(matrix)
    p, q = left[:, -1], right[-1]
    return p / (p @ q), q


def _judged(terms: Any, forms: Forms, q: Any, attracting: int, power: int = 2) -> NormalForm:
    """The sum of the terms, in the states' units, and its word: `attracting` is the sign (-1: positive attracts)."""
    total, size = float(np.sum(terms)), float(np.sum(np.abs(terms)))
    if not math.isfinite(total):
        return NormalForm(None, None)
    length = float(np.linalg.norm(forms.sizes * q))
    coefficient = total / length**power
    if size < _NOTHING or abs(total) < _ZERO * size:
        return NormalForm(coefficient, Criticality.DEGENERATE)
    supercritical = total * attracting < 0
    return NormalForm(coefficient, Criticality.SUPERCRITICAL if supercritical else Criticality.SUBCRITICAL)


def _at_plus_one(kind: Kind, forms: Forms, circle: bool) -> NormalForm:
    A, n = forms.matrix, len(forms.matrix)
    p, q = _critical_vectors(A, 1.0 if circle else 0.0)
    K = np.eye(n) - A if circle else -A
    B = np.real(forms.second(q, q))
    quadratic = float(p @ B) / 2
    size = float(np.linalg.norm(p) * np.linalg.norm(B)) / 2
    none = size < _NOTHING or abs(quadratic) < _ZERO * size
    if kind is Kind.FOLD or not none:
        word = Criticality.DEGENERATE if none else None
        return NormalForm(quadratic / float(np.linalg.norm(forms.sizes * q)), word)
    bordered = np.block([[K, q[:, None]], [p[None, :], np.zeros((1, 1))]])
    h = np.linalg.solve(bordered, np.append(B, 0.0))[:n]
    terms = [p @ forms.third(q, q, q) / 6, p @ forms.second(q, h) / 2]
    return _judged(np.real(terms), forms, q, 1)


def _hopf(forms: Forms) -> NormalForm:
    A, eye = forms.matrix, np.eye(len(forms.matrix))
    values = np.linalg.eigvals(A)
    upper = values[values.imag > 0]
    if not upper.size:
        return NormalForm(None, None)
    omega = float(upper[int(np.argmin(np.abs(upper.real)))].imag)
    p, q = _critical_vectors(A, 1j * omega)
    c = np.conj(q)
    still = np.linalg.solve(A, np.real(forms.second(q, c)))
    twice = np.linalg.solve(2j * omega * eye - A, forms.second(q, q))
    terms = [p @ forms.third(q, q, c), -2 * (p @ forms.second(q, still)), p @ forms.second(c, twice)]
    return _judged(np.real(terms) / (2 * omega), forms, q, 1)


def _torus(forms: Forms) -> NormalForm:
    A, eye = forms.matrix, np.eye(len(forms.matrix))
    values = np.linalg.eigvals(A)
    upper = values[values.imag > 0]
    if not upper.size:
        return NormalForm(None, None)
    mu = complex(upper[int(np.argmin(np.abs(np.abs(upper) - 1)))])
    mu /= abs(mu)
    if any(abs(mu**k - 1) < _RESONANT for k in (1, 2, 3, 4)):
        return NormalForm(None, None)
    p, q = _critical_vectors(A, mu)
    terms = forms.torus_terms(p, q, mu) if hasattr(forms, "torus_terms") else None
    if terms is None:
        c = np.conj(q)
        still = np.linalg.solve(eye - A, np.real(forms.second(q, c)))
        twice = np.linalg.solve(mu**2 * eye - A, forms.second(q, q))
        terms = (p @ forms.third(q, q, c), 2 * (p @ forms.second(q, still)), p @ forms.second(c, twice))
    return _judged(np.real(np.array(terms) / mu) / 2, forms, q, 1)
