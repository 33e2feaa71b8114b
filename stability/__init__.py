"""Stability and bifurcations of oscillators: write the oscillator once, look at it through every lens of the field.

Floquet charts, averaging, harmonic balance, continuation and simulation all take the same `System`; each result says
how accurate it is. Everything is loaded on first use (PEP 562), so that ``import stability`` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ._version import __version__ as __version__

# public name -> module that defines it
_EXPORTS: dict[str, str] = {
    "families": "following.families",
    "loci": "following.sheets",
    "locus": "problems.locus_starting",
    "switch": "problems.switching",
    "solve": "following.driver",
    "continuation": "following.driver",
    "steps": "following.driver",
    "Walk": "following.walking",
    "Sensitivity": "results.sensitivity_table",
    "sensitivity": "problems.measure_rates",
    "SpecialPoint": "results.special",
    "PeriodicOrbit": "results.solutions",
    "FixedPoint": "results.solutions",
    "Equilibrium": "problems.equilibria",
    "Branch": "results.branch",
    "Collocation": "problems.collocation",
    "Shooting": "problems.shooting",
    "Backbone": "problems.backbone",
    "HarmonicBalance": "problems.harmonic_balance",
    "chart": "charting.charts",
    "StabilityChart": "results.chart",
    "ConstantAcceleration": "systems.excitation",
    "ConstantAmplitude": "systems.excitation",
    "Criticality": "words",
    "Crossing": "words",
    "HardStop": "systems.stops",
    "Kind": "words",
    "load": "results.storage",
    "load_model": "systems.textfile",
    "load_response": "results.measured_files",
    "MeasuredResponse": "results.measured",
    "mathieu_a": "floquet.mathieu",
    "mathieu_a_of_exponent": "floquet.exponents",
    "mathieu_b": "floquet.mathieu",
    "mathieu_exponent": "floquet.exponents",
    "Monodromy": "floquet.period_maps",
    "monodromy": "floquet.period_maps",
    "simulate": "simulation.simulating",
    "energy_balance": "simulation.energy",
    "EnergyBalance": "simulation.energy",
    "lyapunov": "simulation.chaos",
    "basins": "simulation.basin_maps",
    "Basins": "results.basins",
    "LyapunovSpectrum": "simulation.chaos",
    "Ensemble": "simulation.simulating",
    "Trajectory": "results.trajectory",
    "LineSpectrum": "results.line_spectrum",
    "sweep": "simulation.sweeping",
    "Sweep": "results.sweep",
    "Status": "words",
    "Symmetry": "systems.symmetries",
    "System": "systems.system",
    "Table": "systems.tables",
    "Verdict": "words",
    "compare": "comparing.overlay",
    "responses": "comparing.responding",
    "Responses": "results.responses",
    "Comparison": "results.comparison",
    "dimensionless": "systems.scaling",
    "linearised": "systems.linearising",
    "equations_of_motion": "systems.lagrangian",
    "mass_matrix": "systems.lagrangian",
    "averaging": "analytic.slow_flow",
    "multiple_scales": "analytic.slow_flow",
    "frequency_law": "analytic.frequency_laws",
    "transition_series": "analytic.transition_curves",
    "duffing_motion": "analytic.conservative_motion",
    "pendulum_motion": "analytic.conservative_motion",
    "ConservativeMotion": "analytic.conservative_motion",
    "duffing_amplitudes": "analytic.duffing_forms",
    "duffing_fold_onset": "analytic.duffing_forms",
    "duffing_folds": "analytic.duffing_forms",
    "duffing_frequencies": "analytic.duffing_forms",
    "duffing_mathieu_amplitudes": "analytic.duffing_forms",
    "duffing_peak": "analytic.duffing_forms",
    "autoparametric_amplitudes": "analytic.autoparametric_forms",
    "autoparametric_characteristic": "analytic.autoparametric_forms",
    "autoparametric_hopf": "analytic.autoparametric_forms",
    "autoparametric_interval": "analytic.autoparametric_forms",
    "autoparametric_threshold": "analytic.autoparametric_forms",
    "reconstruct": "analytic.reconstructing",
    "reconstruction_residual": "analytic.reconstructing",
    "linear_response": "charting.transfer",
    "LinearResponse": "charting.transfer",
}

# submodules that are themselves public
_MODULES = ("errors", "models", "systems", "words")

__all__ = sorted([*_EXPORTS, *_MODULES, "__version__"])


def __getattr__(name: str) -> Any:
    if name in _EXPORTS:
        value = getattr(import_module(f"{__name__}.{_EXPORTS[name]}"), name)
    elif name in _MODULES:
        value = import_module(f"{__name__}.{name}")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return list(__all__)
