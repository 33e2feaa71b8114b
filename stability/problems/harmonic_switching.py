r"""From a period doubling of a harmonic-balance orbit to the problem of twice the period.

Harmonic k of the orbit is harmonic 2k of the doubled one; the new motion has the odd harmonics. To first order it is
antiperiodic over the old period, so its direction is the null vector of the doubled problem's Jacobian restricted to
odd harmonics (even and odd ones do not mix at the orbit itself), which is Hill's matrix at lambda = i omega / 2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.fourier import stretched

if TYPE_CHECKING:
    from .harmonic_balance import HarmonicBalance

__all__ = ["doubled_problem"]

Array = np.ndarray


def doubled_problem(problem: HarmonicBalance, u: Array, params: Array) -> tuple[HarmonicBalance, Array, Array]:
    """(problem with 2H harmonics on twice the period, its u = the orbit twice, the antiperiodic direction)."""
    fields = {"harmonics": 2 * problem.harmonics, "fewest": 2 * problem.fewest, "most": min(2 * problem.most, 1000)}
    fields["winding"] = 2 * problem.winding
    if problem.own:
        fields["period_scale"] = 2 * problem.period_scale
    else:
        fields["subharmonic"] = 2 * problem.subharmonic
    if problem.fixed_samples:
        fields["samples"] = 2 * problem.samples
    new = problem.changed(**fields)
    c = stretched(problem.coefficients(u), 2, new.harmonics)
    twice = np.append(c.ravel(), 2 * u[u.size - problem.own :])
    odd = np.flatnonzero(np.repeat(new.layout.basis.k % 2 == 1, new.layout.q))
    core = new.linearise(twice, params).core[np.ix_(odd, odd)]
    direction = np.zeros(new.size)
    direction[odd] = new.column_sizes[odd] * np.linalg.svd(core)[2][-1]
    return new, twice, direction
