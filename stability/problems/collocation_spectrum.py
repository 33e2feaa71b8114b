"""Multipliers of a collocated orbit, their error, and the verdict they support.

The error is the sum of the change by degree m + 1 (`collocation_error`), the distance of an autonomous orbit's trivial
multiplier from 1, what Liouville's formula misses (`orbit_spectrum.liouville_gap`), rounding of the product, and past
kinks twice the distance from multipliers by integration (`collocation_kinks`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..protocols import Spectrum
from .collocation_error import TRUST, multiplier_error
from .collocation_kinks import kink_error
from .orbit_spectrum import contracted, deflated, eigenvalues, liouville_gap, orbit_spectrum

if TYPE_CHECKING:
    from .collocation import Collocation
    from .collocation_linearisation import CollocationLinearisation

__all__ = ["collocation_spectrum", "growth_of_volume"]



def collocation_spectrum(problem: Collocation, linearisation: CollocationLinearisation) -> Spectrum:
    """Counts and verdict at a linearisation; of steps that were taken together the multipliers are known already."""
    M, own = linearisation.spectral, problem.mesh.own
    largest = float(np.abs(M).max())
    if not largest < np.inf:
        return orbit_spectrum(np.full(problem.mesh.n - own, np.nan, complex), np.inf)
    direction = problem.direction_of_flow(linearisation) if own else None
    known = vars(linearisation).get("nontrivial")
    if known is None:
        matrix, error = (M, 0.0) if direction is None else deflated(M, direction)
        known = eigenvalues(matrix), error
    values, error = known
    error += multiplier_error(problem, linearisation, values, direction) + TRUST[4] * largest * len(M)
    if problem.kinked:
        error += kink_error(problem, linearisation, values)
    factors = linearisation.work.M
    if problem.halved:
        factors = np.concatenate([factors, problem.closure[None]])  # S^-1 = S
    values = contracted(values, factors)
    error += liouville_gap(values, growth_of_volume(linearisation), problem.orientation)
    return orbit_spectrum(values, error, _area_preserving(problem, linearisation))


def growth_of_volume(linearisation: CollocationLinearisation) -> float:
    """int tr J dt over the span of the mesh, by the mesh's own Gauss quadrature."""
    return linearisation.sigma * linearisation.summary[1]


def _area_preserving(problem: Collocation, linearisation: CollocationLinearisation) -> bool:
    """Whether a forced system of two states has no divergence, hence det M = 1."""
    J = linearisation.work.J
    if problem.mesh.n != 2 or problem.mesh.own or problem.orientation < 0 or J[0, 0, 0] + J[0, 1, 1] != 0.0:
        return False
    if float(np.abs(J[:, 0, 0] + J[:, 1, 1]).max()) != 0.0:
        return False
    return problem.flow.divergence_free(linearisation.params)
