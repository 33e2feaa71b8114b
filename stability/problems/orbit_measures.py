"""What is recorded of an orbit at every point of a branch, and the orbit a user sees.

Every discretisation gives its orbit as polynomials on pieces of the period (`pieces`). Extrema are those
of the polynomial; <x>.amplitude(1) = 2 |c_1| is the response at the forcing frequency (autonomous: at the orbit's own),
c_k = int_0^1 x(s) exp(-2 pi i k m s) ds by Gauss quadrature, m forcing periods per orbit. An orbit of m > 1 periods has
its subharmonic response besides, amplitude(1/m) = 2 |c_(1/m)|. An orbit solved on half of its period is unfolded by its
symmetry first: x(s + 1/2) = S x(s).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.extrema import extrema
from ..kernels.gauss import gauss_rule
from ..results.solutions import PeriodicOrbit

if TYPE_CHECKING:
    from .collocation import Collocation
    from .orbits import OrbitDiscretisation

__all__ = ["fundamental", "orbit_measures", "orbit_view"]

Array = np.ndarray


@lru_cache(maxsize=32)
def _to_monomials(degree: int) -> Array:
    """(d + 1, d + 1): values at (0, c_1 .. c_d) -> coefficients of z^k, z in [-1, 1]."""
    abscissae = 2 * gauss_rule(degree).abscissae - 1
    return np.asarray(np.linalg.inv(np.vander(abscissae, increasing=True)))


def orbit_measures(problem: OrbitDiscretisation, u: Array, params: Array) -> dict[str, float]:
    """Columns: <state>.max, .min, <coordinate>.amplitude(1), .amplitude(1/m), <output>.max, .min, .mean, period."""
    degree, edges, values, period = problem.pieces(u, params)
    rule, states = gauss_rule(degree), problem.system.states
    C = np.ascontiguousarray(np.einsum("ki,jin->jkn", _to_monomials(degree), values))
    low, high = np.empty(len(states)), np.empty(len(states))
    extrema(C, low, high)
    out = {}
    for k, name in enumerate(states):
        out[f"{name}.max"], out[f"{name}.min"] = float(high[k]), float(low[k])
    h = np.diff(edges)
    points = (edges[:-1, None] + h[:, None] * rule.points).ravel()
    weights = (h[:, None] * rule.weights).ravel()
    stages = values[:, 1:].reshape(len(points), len(states))
    turning = problem.whole_winding
    swing = stages - points[:, None] * turning if turning.any() else stages
    periods = problem.forcing_periods
    orders = {"1": periods} | ({f"1/{periods}": 1} if periods > 1 else {})
    for label, number in orders.items():
        harmonic = (weights * np.exp(-2j * np.pi * number * points)) @ swing
        for k, name in enumerate(problem.system.coordinates):
            out[f"{name}.amplitude({label})"] = 2 * abs(complex(harmonic[k]))
    out["period"] = period
    if problem.evaluations.output_names:
        phase = np.mod(problem.multiple * points, 1.0)
        results = problem.evaluations.outputs(phase, np.ascontiguousarray(stages), params)
        for k, name in enumerate(problem.evaluations.output_names):
            column = results[:, k]
            out[f"{name}.max"], out[f"{name}.min"] = float(column.max()), float(column.min())
            out[f"{name}.mean"] = float(weights @ column)
    return out


def fundamental(problem: Collocation, u: Array) -> Array:
    """(n,) 2 |c_1| of the states by the stages of a collocation mesh: within its error what `orbit_measures` gives.

    For orbits solved on their whole period; angles may turn.
    """
    mesh = problem.mesh
    points, swing = mesh.points.ravel(), mesh.split(u)[1].reshape(-1, mesh.n)
    if problem.whole_winding.any():
        swing = swing - points[:, None] * problem.whole_winding
    angle = 2 * np.pi * problem.forcing_periods * points
    real, imaginary = (mesh.weights * wave(angle) @ swing for wave in (np.cos, np.sin))
    return np.asarray(2 * np.hypot(real, imaginary))


def orbit_view(problem: OrbitDiscretisation, u: Array, params: Array) -> PeriodicOrbit:
    """The orbit with its multipliers (the trivial one included), verdict, error and residual."""
    degree, edges, values, period = problem.pieces(u, params)
    linearisation = problem.linearise(u, params)
    spectrum = problem.spectrum(linearisation)
    multipliers = spectrum.values
    halves = multipliers if problem.halved else None
    if problem.halved:
        multipliers = multipliers**2
    if problem.own:
        multipliers = np.append(multipliers, 1.0)
    multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
    return PeriodicOrbit.from_nodes(
        problem.system.states, edges * period, gauss_rule(degree).abscissae, values,
        dict(zip(problem.parameters, params.tolist())), multipliers=multipliers, verdict=spectrum.verdict,
        error=problem.error(u, params), residual=linearisation.size_of_residual,
        winding=problem.whole_winding, half_multipliers=halves, multiple=problem.forcing_periods,
    )  # fmt: skip


