r"""Stability of a harmonic-balance orbit: Hill's exponents, checked by the monodromy along the corrected orbit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.hill_matrix import hill_matrix, mean_harmonics, selected
from ..protocols import Spectrum
from .orbit_spectrum import eigenvalues, orbit_spectrum

if TYPE_CHECKING:
    from .harmonic_linearisation import HarmonicLinearisation

__all__ = ["HillModes", "checked_spectrum", "hill_modes"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class HillModes:
    """The eigenproblem of Hill's matrix, solved whole.

    Attributes
    ----------
    values : (N,);  vectors, inverse : (N, N) complex, all modes and their inverse
    chosen : (n,) indices of the exponents;  multipliers : (n,) complex, exp(lambda T), of the chosen ones
    start : (n, N) states at s = 0 of all modes
    monodromy : (n, n) real, in units of the problem's scales
    certain : whether the strip held exactly n exponents
    """

    values: Array
    vectors: Array
    inverse: Array
    chosen: Array
    multipliers: Array
    start: Array
    monodromy: Array
    certain: bool


def all_products(L: HarmonicLinearisation) -> Array:
    """T(A) (2H + 1, 2H + 1, n, n) of the whole first-order system."""
    layout = L.problem.layout
    out = np.zeros((layout.count, layout.count, layout.n, layout.n))
    out[:, :, layout.rows] = L.products
    places, velocities = layout.pairs
    eye = np.arange(layout.count)
    for coordinate, velocity in zip(layout.unknowns[places].tolist(), velocities.tolist()):
        out[eye, eye, coordinate, velocity] = 1.0
    return out


def hill_modes(L: HarmonicLinearisation) -> HillModes:
    """All modes of the truncated Hill matrix and the real monodromy matrix that the selected ones make."""
    n = L.problem.layout.n
    values, vectors = np.linalg.eig(hill_matrix(all_products(L), L.omega))
    spread = mean_harmonics(vectors, n)[1]
    chosen, certain = selected(values, spread, L.omega, n)
    mu = np.exp(values[chosen] * L.period)
    blocks = vectors.reshape(-1, n, len(values))
    start = blocks[0] + blocks[1::2].sum(axis=0)
    Y, D = start[:, chosen], L.problem.scales
    monodromy = np.real((Y * mu) @ np.linalg.inv(Y)) * D / D[:, None]
    return HillModes(values, vectors, np.linalg.inv(vectors), chosen, mu, start, monodromy, certain)


def checked_spectrum(L: HarmonicLinearisation) -> Spectrum:
    values = eigenvalues(L.spectral)
    return orbit_spectrum(values, 1e-9)
