r"""Does a resonance close? A warning for branches that leave their window on a resonance that never turns back.

One-term balance of q'' = f(t, q, q', p) on q = a cos(theta), theta = w t, averaged over the phase of the forcing:

    detuning  w^2 - k(a, w),   k = -2 <f cos theta>/a,       damping force  D(a, w) = 2 <f sin theta>,
    exciting force  F(w) = |fundamental harmonic of f(t, 0, 0)|

Along the backbone w^2 = k(a, w). A response rides on it where most of w^2 - k(0) is made up by k(a) - k(0). The peak is
where the motion lags by 90 degrees: on the backbone with D = F. If D < F all along the backbone, the resonance is open:
the branch never turns back. For u'' + 2 xi u' + u + beta u^3 = Omega^2 cos(Omega tau), D/F = 2 xi a/Omega rises to
4 xi/sqrt(3 beta): open for beta >= 16 xi^2/3. For one degree of freedom, responses of the forcing's period, and slow
flows of `averaging`. A backbone that does not bend, k(a) = k(0) within half of the detuning, is none: the response is
linear there, whatever damps it. Reference: Krack and Gross (2019), chapter 2.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import OpenResonanceWarning
from ..results.branch import Branch
from ..words import Status

__all__ = ["warn_if_open"]

Array = NDArray[np.float64]
Balance = Callable[[float, float], tuple[float, float, float]]
_DECADES, _STEPS = 4.0, 16
_ANGLES, _PHASES = 48, 8


def warn_if_open(branch: Branch, stacklevel: int = 3) -> None:
    """Warn where an end of a frequency response is on an open resonance; costs nothing for any other branch."""
    for end in (0, -1):
        if branch.statuses[end] is not Status.PARAMETER_BOUND:
            continue
        found = _balance(branch, end)
        share = math.inf if found is None else _share(*found)
        if share < 1:
            system = branch.meshes[int(branch.mesh_of[end])].system.name
            warnings.warn(
                f"open resonance of '{system}': at {branch.name} = {branch.parameter[end]:g} the branch leaves the "
                f"window along the backbone, where the damping force stays below the exciting force ({share:.2f} of it "
                f"at 10^{_DECADES:g} times the amplitude), so that it never turns back; a lower branch is a family of "
                "its own (families). More damping, a smaller base amplitude or constant acceleration closes the peak",
                OpenResonanceWarning,
                stacklevel=stacklevel,
            )


def _balance(branch: Branch, end: int) -> tuple[Balance, float, float] | None:
    """(balance, amplitude, parameter) at an end of a response that this module knows; None for all others."""
    problem = branch.meshes[int(branch.mesh_of[end])]
    system, kind = getattr(problem, "system", None), branch.method.get("problem")
    if system is None or len(system.coordinates) == 0 or system.stops:
        return None
    index = list(system.parameters).index(branch.name) if branch.name in system.parameters else None
    if index is None:
        return None
    value, params = float(branch.parameter[end]), branch._vector(end if end == 0 else len(branch) - 1)
    slow = bool(system.reconstruction) and system.states[0].endswith("_cos")
    if kind == "Equilibrium" and slow and len(system.states) == 2:
        return _of_slow_flow(problem, params, index), float(np.hypot(*branch.unknowns[end])), value
    forced = kind in ("Collocation", "HarmonicBalance", "Shooting") and getattr(problem, "multiple", 0) == 1
    if not forced or problem.own or len(system.states) != 2 or len(system.coordinates) != 1:
        return None
    if branch.name not in {s.name for s in getattr(system.period_expression, "free_symbols", ())}:
        return None
    amplitude = problem.measures(branch.unknowns[end], params)[f"{system.coordinates[0]}.amplitude(1)"]
    return _of_oscillator(problem, params, index), float(amplitude), value


def _of_oscillator(problem: Any, params: Array, index: int) -> Balance:
    """The head of this module, by samples of f over the angle of the motion and the phase of the forcing."""
    system, evaluations = problem.system, problem.evaluations
    place = system.states.index(system.coordinates[0])
    theta = 2 * np.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES  # mirrored at 0 and pi, where dry friction jumps
    angle, phase = (g.ravel() for g in np.meshgrid(theta, np.arange(_PHASES) / _PHASES, indexing="ij"))
    rest, turns = np.zeros((_ANGLES, 2)), np.arange(_ANGLES) / _ANGLES

    def balance(a: float, value: float) -> tuple[float, float, float]:
        p = params.copy()
        p[index] = value
        w = 2 * np.pi / float(evaluations.period(p))
        states = np.empty((angle.size, 2))
        states[:, place], states[:, 1 - place] = a * np.cos(angle), -a * w * np.sin(angle)
        f = evaluations.F(phase, states, p)[:, 1 - place].reshape(_ANGLES, _PHASES).mean(axis=1)
        exciting = evaluations.F(turns, rest, p)[:, 1 - place]
        k, damping = -2 * float(np.mean(f * np.cos(theta))) / a, 2 * float(np.mean(f * np.sin(theta)))
        return w * w - k, damping, 2 * abs(complex(np.mean(exciting * np.exp(-2j * np.pi * turns))))

    return balance


def _of_slow_flow(problem: Any, params: Array, index: int) -> Balance:
    """The same of a slow flow z': z' at rest is the excitation, what z = (a, 0) adds is damping and detuning."""
    states = np.zeros((2, 2))

    def balance(a: float, value: float) -> tuple[float, float, float]:
        p = params.copy()
        p[index] = value
        states[1, 0] = a
        rest, moved = problem.evaluations.F(np.zeros(2), states, p)
        return float(moved[1] - rest[1]) / a, float(rest[0] - moved[0]), float(np.hypot(*rest))

    return balance


def _share(balance: Balance, amplitude: float, value: float) -> float:
    """D/F far out on the backbone if it is below 1 all along; infinity for a closed resonance, or another branch."""
    if not amplitude > 0 or value == 0:
        return math.inf
    with np.errstate(all="ignore"):
        linear, here = balance(1e-6 * amplitude, value)[0], balance(amplitude, value)[0]
        if not abs(here) < 0.5 * abs(linear):
            return math.inf
        growth, share = 1.0, math.inf
        for k in range(_STEPS + 1):
            a = amplitude * 10 ** (_DECADES * k / _STEPS)
            found = _on_backbone(balance, a, value * growth)
            if found is None:
                return math.inf
            growth, value = (found / value if k else 1.0), found
            _, damping, exciting = balance(a, value)
            if not damping < exciting:
                return math.inf
            share = damping / exciting
    return share


def _on_backbone(balance: Balance, a: float, guess: float) -> float | None:
    """The parameter at which the detuning is zero, by Newton's method on its logarithm; None where there is none."""
    x = guess
    for _ in range(40):
        gap, step = balance(a, x)[0], 1e-6
        slope = (balance(a, x * (1 + step))[0] - gap) / step
        if not (math.isfinite(gap) and math.isfinite(slope)) or slope == 0:
            return None
        change = max(-0.5, min(0.5, -gap / slope))
        x *= math.exp(change)
        if abs(change) < 1e-6:
            return x
    return None
