r"""One dwell: a number of periods at fixed parameters, and what the last of them say.

Largest and smallest values are those of the dense output between its steps; harmonics are integrals over the recorded
periods, c_k = mean of x exp(-2 pi i k t/T), with t = 0 at phase 0; the transient left is estimated from the
stroboscopic states of the whole dwell (kernels/settling.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..integration.engine import Engine, Precision
from ..kernels import piecewise
from ..kernels.extrema import extrema
from ..kernels.settling import SETTLED, transient_left
from ..results.trajectory import Ending
from .simulating import as_trajectory

__all__ = ["Dwell", "dwell"]

Array = np.ndarray
# (8, 8): monomial coefficients on [-1, 1] from Chebyshev ones
_MONOMIALS = np.array([np.append(np.polynomial.chebyshev.cheb2poly(row), [0.0] * 8)[:8] for row in np.eye(8)]).T


@dataclass(frozen=True, eq=False)
class Dwell:
    """What one dwell gave: q states and outputs, see `results.sweep.Sweep`."""

    low: Array
    high: Array
    average: Array
    coefficients: Array
    strobes: Array
    transient: float
    multiple: int
    ending: Ending

    @property
    def end(self) -> Array:
        """(n,) state at the end."""
        return self.strobes[-1]

    @property
    def settled(self) -> bool:
        """Whether at most 1 % of the transient is left."""
        return self.transient <= SETTLED

    @property
    def size(self) -> Array:
        """(q,) peak-to-peak values."""
        return self.high - self.low


def dwell(
    engine: Engine, params: Array, x0: Array, period: float, periods: int, record: int, harmonics: int,
    precision: Precision,
) -> Dwell:  # fmt: skip
    """Run `periods` periods from x0 at phase 0 and measure the last `record` of them."""
    system = engine.system
    motion = engine.run(params, x0, 0.0, periods * period, precision)
    if motion.ending is not Ending.COMPLETED:
        q = len(system.states) + len(system.outputs)
        empty = np.zeros(q)
        none = np.zeros((q, harmonics + 1), complex)
        return Dwell(empty, empty, empty, none, motion.x[None], np.inf, 1, motion.ending)
    last = as_trajectory(engine, motion, params, precision.rtol).window((periods - record) * period, periods * period)
    columns = np.concatenate([last.coefficients, last._expanded_outputs], axis=2)
    low, high = np.empty(columns.shape[2]), np.empty(columns.shape[2])
    extrema(np.ascontiguousarray(np.einsum("ij,kjn->kin", _MONOMIALS, columns)), low, high)
    rates = 2 * np.pi / period * np.arange(harmonics + 1)
    coefficients = piecewise.projections(last.edges, columns, rates).T
    strobes = piecewise.at(motion.edges, motion.coefficients, period * np.arange(periods + 1)).T
    scale = 0.5 * (high - low)[: len(system.states)]
    largest = max(float(scale.max()), 1e-300)
    scale = np.where(scale > 1e-9 * largest, scale, largest)
    left, multiple = transient_left(strobes, scale, np.isin(system.states, system.angles))
    recorded = np.vstack([strobes[:, 1 + periods - record : -1].T, motion.x])
    return Dwell(low, high, coefficients[:, 0].real, coefficients, recorded, left, multiple, motion.ending)
