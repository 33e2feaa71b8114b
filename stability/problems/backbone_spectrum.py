r"""Stability of nonlinear normal modes: multipliers of the conservative motion, without the two that are always 1.

Along a motion of x'' = f(x, x') with an energy (growth g = 0) the monodromy matrix Phi(T) has the multiplier 1 twice,
in a Jordan block: the direction of the flow, Phi f = f, and the neighbouring motions of the family. The first is taken
out by the orthogonal change of basis of orbit_spectrum; what is left has a simple 1, the value nearest to it. The other
2 (n_c - 1) multipliers come in pairs mu, 1/mu: on the unit circle and apart from each other they are NEUTRAL, one off
the circle by more than the error makes the mode UNSTABLE, anything else is UNDETERMINED.

Their error: twice the distance to the multipliers along the orbit without the harmonics that it misses, the defects of
Liouville's formula and of Phi f = f, and that of the pairs, |mu mu' - 1|.

With damping the motion is kept up by a growth that nature does not have: its multipliers are those of an artificial
system and prove nothing, and the verdict stays UNDETERMINED; ask for the mode of the system without damping. Reference:
G. Kerschen et al. (2009), Mech. Syst. Signal Process. 23, 170-194; M. Peeters et al. (2009), ibid. 195-216.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..floquet.verdicts import classify
from ..kernels.fourier import resized
from ..words import Verdict
from .harmonic_spectrum import propagated
from .orbit_spectrum import deflated, eigenvalues, spectrum_distance

if TYPE_CHECKING:
    from .harmonic_linearisation import HarmonicLinearisation
    from .harmonic_truncation import Correction

__all__ = ["ModeStability", "mode_stability"]

Array = np.ndarray
_CONSERVATIVE = 1e-8  # largest |g| T of a motion that has an energy


class ModeStability(NamedTuple):
    """Multipliers (n - 2,) beside the double 1, by descending modulus; their error; the verdict."""

    values: Array
    error: float
    verdict: Verdict


def mode_stability(L: HarmonicLinearisation, growth: float) -> ModeStability:
    """From the linearisation of the free system at a motion with the given growth g."""
    n, conservative = L.problem.layout.n, abs(growth) * L.period < _CONSERVATIVE
    if n == 2:  # a planar family of periodic motions: nothing is left beside the double 1
        return ModeStability(np.zeros(0, complex), 0.0, Verdict.NEUTRAL)
    unknown = ModeStability(np.full(n - 2, np.nan, complex), np.inf, Verdict.UNDETERMINED)
    found = L.correction
    if not found.error < np.inf:
        return unknown
    same = replace(found, coefficients=resized(L.c, 2 * L.problem.harmonics + 1), period=L.period)
    corrected, truncated = _without_unity(L, found), _without_unity(L, same)
    if corrected is None or truncated is None:
        return unknown
    (values, defect), (others, _) = corrected, truncated
    error = defect + 2 * max(spectrum_distance(values, others), spectrum_distance(others, values))
    if not conservative:
        return ModeStability(values, error, Verdict.UNDETERMINED)
    partners = np.abs(values[:, None] * values - 1.0)
    np.fill_diagonal(partners, np.inf)
    error += float((partners.min(axis=1) / np.maximum(1.0, np.abs(values))).max())
    return ModeStability(values, error, classify(values, error, neutral=True).verdict)


def _without_unity(L: HarmonicLinearisation, found: Correction) -> tuple[Array, float] | None:
    """(multipliers beside the double 1, measured defects) along one orbit."""
    along = propagated(L, found)
    if along is None:
        return None
    D = L.problem.scales
    rest, drift = deflated(along.monodromy * D / D[:, None], along.flow / D)
    values = eigenvalues(rest)
    family = int(np.argmin(np.abs(values - 1.0)))
    return np.delete(values, family), along.defect + drift
