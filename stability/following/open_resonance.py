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
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import OpenResonanceWarning
from ..problems.collocation import Collocation
from ..problems.orbit_measures import fundamental
from ..results.branch import Branch
from ..words import Status

__all__ = ["warn_if_open"]

Array = NDArray[np.float64]
_DECADES, _STEPS = 4.0, 16
_ANGLES, _PHASES = 48, 8
_THIRD, _HALF = 3, 2  # every third angle and every second phase are enough to come near the backbone
_NEAR, _DOUBT = 0.5, (0.3, 0.8)  # part of the linear detuning that is left on a backbone; where few samples may err
_SETTLED, _MOST = 1e-6, 0.5  # change of log(parameter) that ends an iteration; the largest that is made at once
_BUMP = 1e-6


class Balance(NamedTuple):
    """The forces of the module's head for many motions at once: amplitudes (K,) at parameter values (K,).

    resisting(a, values, few) : detuning and damping force, each (K,); `few` = by few samples.
    exciting(values) : exciting force (K,).
    square(value) : w^2; None: not known.
    """

    resisting: Callable[[Array, Array, bool], tuple[Array, Array]]
    exciting: Callable[[Array], Array]
    square: Callable[[float], float] | None = None


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
    return _of_oscillator(problem, params, index), _amplitude(problem, branch.unknowns[end], params), value


def _amplitude(problem: Any, u: Array, params: Array) -> float:
    """Of the fundamental harmonic of the one coordinate."""
    if isinstance(problem, Collocation) and not problem.halved:
        return fundamental(problem, u)[problem.system.states.index(problem.system.coordinates[0])]
    return float(problem.measures(u, params)[f"{problem.system.coordinates[0]}.amplitude(1)"])


@lru_cache(maxsize=2)
def _samples(few: bool) -> tuple[Array, Array, Array]:
    """Angles of the motion and phases of the forcing, cos and sin of all pairs: (phase, (2, N) cos sin, (N, 2) means).

    The angles are mirrored at 0 and pi, where dry friction jumps. The means are -2 <f cos>, 2 <f sin>.
    """
    theta = 2 * np.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES
    turns = np.arange(_PHASES) / _PHASES
    if few:
        theta, turns = theta[_THIRD // 2 :: _THIRD], turns[::_HALF]
    angle, phase = (g.ravel() for g in np.meshgrid(theta, turns, indexing="ij"))
    waves = np.array([np.cos(angle), np.sin(angle)])
    return phase, waves, waves.T * np.array([-2.0, 2.0]) / angle.size


def _at_values(params: Array, index: int, values: Array) -> Array:
    """(K, m): the parameters with another one of them."""
    p = np.repeat(params[None], len(values), axis=0)
    p[:, index] = values
    return p


def _of_oscillator(problem: Any, params: Array, index: int) -> Balance:
    """The head of this module, by samples of f over the angle of the motion and the phase of the forcing."""
    system, evaluations = problem.system, problem.evaluations
    place = system.states.index(system.coordinates[0])
    turns = np.arange(_ANGLES) / _ANGLES
    fundamental_of = 2 * np.exp(-2j * np.pi * turns) / _ANGLES

    def field(phase: Array, states: Array, p: Array) -> Array:
        """(K, N): the acceleration at N samples for each of K parameter vectors."""
        count, size = len(p), len(phase)
        every, phases = np.empty((count, size, len(params))), np.empty((count, size))
        every[:], phases[:] = p[:, None], phase
        f = evaluations.F(phases.ravel(), states, every.reshape(-1, len(params)))
        return np.asarray(f[:, 1 - place]).reshape(count, size)

    def resisting(a: Array, values: Array, few: bool) -> tuple[Array, Array]:
        p = _at_values(params, index, values)
        w = 2 * np.pi / evaluations.period(p)
        phase, (cosine, sine), means = _samples(few)
        states = np.empty((len(a), len(phase), 2))
        np.multiply(a[:, None], cosine, out=states[:, :, place])
        np.multiply((-a * w)[:, None], sine, out=states[:, :, 1 - place])
        k, damping = (field(phase, states.reshape(-1, 2), p) @ means).T
        return w * w - k / a, damping

    def exciting(values: Array) -> Array:
        p = _at_values(params, index, values)
        return np.abs(field(turns, np.zeros((len(p) * _ANGLES, 2)), p) @ fundamental_of)

    def square(value: float) -> float:
        return float((2 * np.pi / evaluations.period(_at_values(params, index, np.array([value]))[0])) ** 2)

    return Balance(resisting, exciting, square)


def _of_slow_flow(problem: Any, params: Array, index: int) -> Balance:
    """The same of a slow flow z': z' at rest is the excitation, what z = (a, 0) adds is damping and detuning."""

    def resisting(a: Array, values: Array, few: bool) -> tuple[Array, Array]:
        count = len(a)
        states = np.zeros((2 * count, 2))
        states[count:, 0] = a
        both = _at_values(params, index, np.concatenate([values, values]))
        z = problem.evaluations.F(np.zeros(2 * count), states, both)
        rest, moved = z[:count], z[count:]
        return (moved[:, 1] - rest[:, 1]) / a, rest[:, 0] - moved[:, 0]

    def exciting(values: Array) -> Array:
        count = len(values)
        rest = problem.evaluations.F(np.zeros(count), np.zeros((count, 2)), _at_values(params, index, values))
        return np.hypot(rest[:, 0], rest[:, 1])

    return Balance(resisting, exciting)


def _share(balance: Balance, amplitude: float, value: float) -> float:
    """D/F far out on the backbone if it is below 1 all along; infinity for a closed resonance, or another branch."""
    if not amplitude > 0 or value == 0:
        return math.inf
    with np.errstate(all="ignore"):
        left = _left(balance, amplitude, value, True)
        if _DOUBT[0] < left < _DOUBT[1]:
            left = _left(balance, amplitude, value, False)
        if not left < _NEAR:
            return math.inf
        a = amplitude * 10 ** (_DECADES * np.arange(_STEPS + 1) / _STEPS)
        shares = _at_once(balance, a, value)
        if shares is None:
            return _in_turn(balance, a, value)
        return float(shares[-1]) if (shares < 1).all() else math.inf


def _left(balance: Balance, amplitude: float, value: float, few: bool) -> float:
    """The detuning over that of small motions."""
    linear, here = balance.resisting(np.array([1e-6 * amplitude, amplitude]), np.array([value, value]), few)[0].tolist()
    return abs(here) / abs(linear) if linear else math.inf


def _in_turn(balance: Balance, amplitudes: Array, value: float) -> float:
    """The last D/F along the backbone, each point from the two before; infinity where it ends or one is not below 1."""
    growth, share = 1.0, math.inf
    for k, a in enumerate(amplitudes):
        found = _on_backbone(balance, float(a), value * growth)
        if found is None:
            return math.inf
        x, damping = found
        growth, value = (x / value if k else 1.0), x
        share = float(damping / balance.exciting(np.array([value]))[0])
        if not share < 1:
            return math.inf
    return share


def _at_once(balance: Balance, a: Array, value: float) -> Array | None:
    """D/F (K,) where `_in_turn` takes them, for all amplitudes at the same time; None where that is not sure.

    Begun where w^2 is the stiffness at the first value; Newton's method on few samples, then on all with the slopes
    found. It is the same curve if each value is where the two before lead, as near as one step of Newton's method.
    """
    if balance.square is None:
        return None
    x = value * np.sqrt(1 - balance.resisting(a, np.full(len(a), value), True)[0] / balance.square(value))
    if not np.isfinite(x).all():  # a softening spring has no backbone at large amplitudes
        return None
    slope, damping = np.ones(len(a)), a
    for few in (True, False):
        for _ in range(8):
            if few:
                gap, bumped = np.split(
                    balance.resisting(np.tile(a, 2), np.concatenate([x, x * (1 + _BUMP)]), True)[0], 2
                )
                slope = (bumped - gap) / _BUMP
            else:
                gap, damping = balance.resisting(a, x, False)
            change = -gap / slope
            size = float(np.abs(change).max())
            if not size < math.inf:
                return None
            x = x * np.exp(np.clip(change, -_MOST, _MOST))
            if size < _SETTLED:
                break
        else:
            return None
    steps = np.diff(np.log(x / value))
    return damping / balance.exciting(x) if (np.abs(np.diff(steps)) < _MOST).all() else None


def _on_backbone(balance: Balance, a: float, guess: float) -> tuple[float, float] | None:
    """(parameter at which the detuning is zero, damping force), by Newton's method on its logarithm; None: nowhere."""
    x = guess
    for _ in range(40):
        (gap, bumped), (damping, _) = balance.resisting(np.array([a, a]), np.array([x, x * (1 + _BUMP)]), False)
        slope = (bumped - gap) / _BUMP
        if not (math.isfinite(gap) and math.isfinite(slope)) or slope == 0:
            return None
        change = max(-_MOST, min(_MOST, -gap / slope))
        x *= math.exp(change)
        if abs(change) < _SETTLED:
            return float(x), float(damping)
    return None
