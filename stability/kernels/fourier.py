r"""Real Fourier series on equispaced samples: the alternating frequency-time scheme as small dense matrices.

A real periodic function of the phase s in [0, 1) is kept as coefficients (2H + 1,) in the order

    x(s) = a_0 + sum_k ( a_k cos 2 pi k s + b_k sin 2 pi k s ),      c = (a_0, a_1, b_1, a_2, b_2, ..., a_H, b_H).

With N equispaced samples: synthesis x = G c, analysis c = G+ x (exact for harmonics up to (N - 1)/2), derivative by the
angle 2 pi s: c -> D c. Multiplication by a function j(s), projected on the same harmonics, is the matrix
T(j) = G+ diag(j) G, made of the harmonics of j up to 2H (N >= 4H + 1 samples hold them; the basis asks for one harmonic
more) by

    cos i cos j = (cos(i-j) + cos(i+j)) / 2   and its like:    T = Toeplitz + Hankel.

Aliasing: a product of p series has harmonics up to pH; on N samples harmonic m looks like harmonic N - m, so the first
H are exact for N > (p + 1) H. Reference: T. M. Cameron, J. H. Griffin (1989), J. Applied Mechanics 56, 149-154;
M. Krack, J. Gross (2019), Harmonic Balance for Nonlinear Vibration Problems, chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["FourierBasis", "derivative", "fourier_basis", "ranks", "resized", "series", "stretched", "tail_fit"]

Array = NDArray[np.float64]


def ranks(harmonics: int) -> NDArray[np.int64]:
    """(2H + 1,) harmonic number of every coefficient: 0, 1, 1, 2, 2, ..., H, H."""
    return (np.arange(2 * harmonics + 1) + 1) // 2


def series(harmonics: int, s: Array) -> Array:
    """G (K, 2H + 1): values of 1, cos 2 pi s, sin 2 pi s, ... at points s (K,).

    >>> series(1, np.array([0.0, 0.25])).round(12) + 0.0
    array([[1., 1., 0.],
           [1., 0., 1.]])
    """
    angle = 2 * np.pi * np.outer(np.asarray(s, float), np.arange(1, harmonics + 1))
    out = np.ones((len(angle), 2 * harmonics + 1))
    out[:, 1::2], out[:, 2::2] = np.cos(angle), np.sin(angle)
    return out


def derivative(c: Array) -> Array:
    """Coefficients (2H + 1, ...) of dx/d(2 pi s): a cos + b sin -> k b cos - k a sin.

    >>> derivative(np.array([5.0, 1.0, 2.0]))
    array([ 0.,  2., -1.])
    """
    out = np.zeros_like(c)
    k = np.arange(1, (len(c) + 1) // 2).reshape(-1, *[1] * (c.ndim - 1))
    out[1::2], out[2::2] = k * c[2::2], -k * c[1::2]
    return out


def resized(c: Array, harmonics: int) -> Array:
    """The same series (2H + 1, ...) cut off after, or filled with zeros up to, other `harmonics`."""
    size = 2 * harmonics + 1
    out = np.zeros((size, *c.shape[1:]), c.dtype)
    kept = min(size, len(c))
    out[:kept] = c[:kept]
    return out


def stretched(c: Array, factor: int, harmonics: int) -> Array:
    """x(factor s) as a series of `harmonics`: harmonic k moves to factor k.

    >>> stretched(np.array([1.0, 2.0, 3.0]), 2, 2)
    array([1., 0., 0., 2., 3.])
    """
    out = np.zeros((2 * harmonics + 1, *c.shape[1:]), c.dtype)
    out[0] = c[0]
    for k in range(1, (len(c) + 1) // 2):
        if factor * k <= harmonics:
            out[2 * factor * k - 1 : 2 * factor * k + 1] = c[2 * k - 1 : 2 * k + 1]
    return out


def tail_fit(sizes: Array) -> tuple[float, float, bool]:
    """(ratio, power, whether the ratio fits better): sizes ~ ratio^k or ~ k^-power, by least squares on their envelope.

    sizes (K,) belong to harmonics 1 .. K; the envelope (largest of this and all later ones) bridges the harmonics that
    symmetric motions do not have. Values below rounding (1e-16 of the largest) do not count; with fewer than two left
    the ratio is 0.

    >>> ratio, _, geometric = tail_fit(0.5 ** np.arange(12))
    >>> round(ratio, 6), geometric
    (0.5, True)
    """
    envelope = np.maximum.accumulate(np.asarray(sizes, float)[::-1])[::-1]
    top = float(envelope[0]) if len(envelope) else 0.0
    used = np.flatnonzero(envelope > 1e-16 * top)
    if top == 0.0 or len(used) < 2:
        return 0.0, np.inf, True
    used = used[len(used) // 3 :] if len(used) > 4 else used
    k, y = used + 1.0, np.log(envelope[used])
    fits = [np.polyfit(x, y, 1) for x in (k, np.log(k))]
    misfits = [float(((np.polyval(f, x) - y) ** 2).sum()) for f, x in zip(fits, (k, np.log(k)))]
    return float(np.exp(min(fits[0][0], 0.0))), max(-float(fits[1][0]), 0.0), misfits[0] <= misfits[1]


@dataclass(frozen=True, eq=False)
class FourierBasis:
    """Matrices of H harmonics on N equispaced samples; see the head of this file.

    Attributes
    ----------
    points : (N,) s
    synthesis, slope : (N, 2H + 1), G and G D;  analysis : (2H + 1, N), G+
    k : (2H + 1,) harmonic numbers;  swap : (2H + 1,) and turn : (2H + 1,) of `times_derivative`
    spectrum : (4H + 3, N) analysis of the harmonics up to 2H + 1
    """

    harmonics: int
    samples: int
    points: Array
    synthesis: Array
    slope: Array
    analysis: Array
    k: Array
    swap: NDArray[np.int64]
    turn: Array
    spectrum: Array
    first: NDArray[np.int64]
    second: NDArray[np.int64]

    def multiplication(self, values: Array) -> Array:
        """T(j) for samples j (N, q): (2H + 1, 2H + 1, q), rows by columns."""
        c = self.spectrum[:-2] @ values
        half = 0.5 * c
        half[0] = c[0]
        table = np.concatenate([half, -half, np.zeros((1, half.shape[1]))])
        out = table[self.first]
        out += table[self.second]
        out[0] *= 0.5
        return np.asarray(out)

    def times_derivative(self, T: Array) -> Array:
        """T D for T (2H + 1, 2H + 1, ...): columns of the derivative."""
        return np.asarray(T[:, self.swap] * self.turn.reshape(-1, *[1] * (T.ndim - 2)))


@lru_cache(maxsize=64)
def fourier_basis(harmonics: int, samples: int) -> FourierBasis:
    """The basis of H harmonics on N >= 4H + 3 samples, made once.

    >>> basis = fourier_basis(3, 16)
    >>> bool(abs(basis.analysis @ basis.synthesis - np.eye(7)).max() < 1e-15)
    True
    """
    H, N = harmonics, samples
    s = np.arange(N) / N
    double = series(2 * H + 1, s).T * (2.0 / N)
    double[0] *= 0.5
    double = np.ascontiguousarray(double)
    k = ranks(H)
    swap = np.arange(2 * H + 1)
    swap[1::2], swap[2::2] = np.arange(2, 2 * H + 1, 2), np.arange(1, 2 * H + 1, 2)
    turn = np.where(np.arange(2 * H + 1) % 2 == 1, -k, k).astype(float)  # column cos_k of T D is -k T[:, sin_k]
    G = series(H, s)
    slope = np.ascontiguousarray(G[:, swap] * turn)
    first, second = _toeplitz_hankel(H)
    analysis = double[: 2 * H + 1].copy()
    arrays = (s, G, slope, analysis, k.astype(float), swap, turn, double, first, second)
    for array in arrays:
        array.setflags(write=False)
    return FourierBasis(H, N, *arrays)


def _toeplitz_hankel(H: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places of the two parts of T in the table (halved coefficients of harmonics 0 .. 2H, the same negated, zero)."""
    minus = 4 * H + 1

    def cosine(m: int, sign: int) -> int:
        return (0 if m == 0 else 2 * m - 1) + (minus if sign < 0 else 0)

    def sine(m: int, sign: int) -> int:
        return 2 * minus if m == 0 else 2 * m + (minus if sign < 0 else 0)

    size = 2 * H + 1
    first, second = np.empty((size, size), np.int64), np.empty((size, size), np.int64)
    for r in range(size):
        i, row_sine = (r + 1) // 2, r > 0 and r % 2 == 0
        for c in range(size):
            j, column_sine = (c + 1) // 2, c > 0 and c % 2 == 0
            gap, both, sign = abs(i - j), i + j, 1 if i > j else -1
            if row_sine and column_sine:
                first[r, c], second[r, c] = cosine(gap, 1), cosine(both, -1)
            elif row_sine:
                first[r, c], second[r, c] = sine(gap, sign), sine(both, 1)
            elif column_sine:
                first[r, c], second[r, c] = sine(gap, -sign), sine(both, 1)
            else:
                first[r, c], second[r, c] = cosine(gap, 1), cosine(both, 1)
    return first, second
