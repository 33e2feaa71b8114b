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

from ..errors import OpenResonanceWarning, StabilityWarning
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
_BUMP, _TRIES = 1e-6, 16


class Balance(NamedTuple):
    """The forces of the module's head for many motions at once: amplitudes (K,) at parameter values (K,), or at one.

    resisting(a, values, few) : detuning, damping force, w^2 (slow flows: nan), each (K,); `few` = by few samples.
    exciting(values) : exciting force (K,).
    """

    resisting: Callable[[Array, Array | float, bool], tuple[Array, Array, Array]]
    exciting: Callable[[Array], Array]


def warn_if_open(branch: Branch, stacklevel: int = 3) -> None:
    """Warn where an end of a frequency response is on an open resonance; costs nothing for any other branch."""
    ends = [end for end in (0, -1) if branch.statuses[end] is Status.PARAMETER_BOUND]
    if not ends or not _known(branch):
        return
    for end in ends:
        try:
            share = _share(*_balance(branch, end))
        except Exception as error:  # noqa: BLE001 - far out a field may fail in any way; the branch stays
            at = f"{branch.name} = {branch.parameter[end]:g}"
            warnings.warn(
                f"whether the resonance stays open beyond {at} is not known: far out on its backbone the equations "
                f"fail ({type(error).__name__}: {error})", StabilityWarning, stacklevel=stacklevel,
            )  # fmt: skip
            continue
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


def _is_slow(branch: Branch) -> bool:
    system = branch.meshes[0].system
    slow = bool(system.reconstruction) and system.states[0].endswith("_cos")
    return branch.method.get("problem") == "Equilibrium" and slow and len(system.states) == 2


def _known(branch: Branch) -> bool:
    """Whether the branch is a frequency response that this module knows."""
    problem = branch.meshes[0]
    system = getattr(problem, "system", None)
    if system is None or len(system.coordinates) == 0 or system.stops or branch.name not in system.parameters:
        return False
    if _is_slow(branch):
        return True
    kind = branch.method.get("problem") in ("Collocation", "HarmonicBalance", "Shooting")
    if not kind or getattr(problem, "multiple", 0) != 1 or problem.own:
        return False
    if len(system.states) != 2 or len(system.coordinates) != 1:
        return False
    return branch.name in {s.name for s in getattr(system.period_expression, "free_symbols", ())}


def _balance(branch: Branch, end: int) -> tuple[Balance, float, float]:
    """(balance, amplitude, parameter) at an end."""
    problem, u = branch.meshes[int(branch.mesh_of[end])], branch.unknowns[end]
    value, params = float(branch.parameter[end]), branch._vector(end if end == 0 else len(branch) - 1)
    index = list(problem.system.parameters).index(branch.name)
    if _is_slow(branch):
        return _of_slow_flow(problem, params, index), float(np.hypot(*u)), value
    return _of_oscillator(problem, params, index), _amplitude(problem, u, params), value


def _amplitude(problem: Any, u: Array, params: Array) -> float:
    """Of the fundamental harmonic of the one coordinate."""
    if isinstance(problem, Collocation) and not problem.halved:
        return fundamental(problem, u)[problem.system.states.index(problem.system.coordinates[0])]
    return float(problem.measures(u, params)[f"{problem.system.coordinates[0]}.amplitude(1)"])


@lru_cache(maxsize=16)
def _motions(count: int, few: bool, place: int) -> tuple[Array, Array, Array]:
    """Samples of `count` motions q = cos(angle): phases (K N,), (K, N, 2) states, (N, 2) weights of the means.

    N pairs of an angle and a phase of the forcing; the angles are mirrored at 0 and pi, where dry friction jumps.
    States are (q, -q') with the place of q; the means are -2 <f cos>, 2 <f sin>.
    """
    theta = 2 * np.pi * (np.arange(_ANGLES) + 0.5) / _ANGLES
    turns = np.arange(_PHASES) / _PHASES
    if few:
        theta, turns = theta[_THIRD // 2 :: _THIRD], turns[::_HALF]
    angle, phase = (g.ravel() for g in np.meshgrid(theta, turns, indexing="ij"))
    waves = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    states = waves if place == 0 else waves[:, ::-1]
    return np.tile(phase, count), np.tile(states, (count, 1, 1)), waves * np.array([-2.0, 2.0]) / angle.size


def _at_values(params: Array, index: int, values: Array | float, each: int) -> Array:
    """(m,), or (K each, m) for values (K,): the parameters with another one of them."""
    if isinstance(values, float):
        p = params.copy()
        p[index] = values
        return p
    p = np.empty((len(values), each, len(params)))
    p[:] = params
    p[:, :, index] = values[:, None]
    return p.reshape(-1, len(params))


def _of_oscillator(problem: Any, params: Array, index: int) -> Balance:
    """The head of this module, by samples of f over the angle of the motion and the phase of the forcing."""
    system, evaluations = problem.system, problem.evaluations
    place = system.states.index(system.coordinates[0])

    def resisting(a: Array, values: Array | float, few: bool) -> tuple[Array, Array, Array]:
        count = len(a)
        phases, unit, means = _motions(count, few, place)
        each = unit.shape[1]
        p = _at_values(params, index, values, each)
        w = np.asarray(2 * np.pi / evaluations.period(p if p.ndim == 1 else p[::each]))
        sizes = np.empty((count, 1, 2))
        sizes[:, 0, place], sizes[:, 0, 1 - place] = a, -a * w
        f = evaluations.F(phases, (unit * sizes).reshape(-1, 2), p)
        k, damping = (f[:, 1 - place].reshape(count, each) @ means).T
        square = w * w
        return square - k / a, damping, square

    def exciting(values: Array) -> Array:
        turns, waves = _harmonic()
        count = len(values)
        p = _at_values(params, index, values, _ANGLES)
        f = evaluations.F(np.tile(turns, count), np.zeros((count * _ANGLES, 2)), p)
        return np.abs(f[:, 1 - place].reshape(count, _ANGLES) @ waves)

    return Balance(resisting, exciting)


@lru_cache(maxsize=1)
def _harmonic() -> tuple[Array, NDArray[np.complex128]]:
    """Phases, and the weights that make twice the fundamental harmonic of samples there."""
    turns = np.arange(_ANGLES) / _ANGLES
    return turns, 2 * np.exp(-2j * np.pi * turns) / _ANGLES


def _of_slow_flow(problem: Any, params: Array, index: int) -> Balance:
    """The same of a slow flow z': z' at rest is the excitation, what z = (a, 0) adds is damping and detuning."""

    def flow(a: Array, values: Array | float) -> Array:
        states = np.zeros((len(a), 2))
        states[:, 0] = a
        return np.asarray(problem.evaluations.F(np.zeros(len(a)), states, _at_values(params, index, values, 1)))

    def resisting(a: Array, values: Array | float, few: bool) -> tuple[Array, Array, Array]:
        both = values if isinstance(values, float) else np.concatenate([values, values])
        z = flow(np.concatenate([0 * a, a]), both)
        rest, moved = z[: len(a)], z[len(a) :]
        return (moved[:, 1] - rest[:, 1]) / a, rest[:, 0] - moved[:, 0], a * math.nan

    def exciting(values: Array) -> Array:
        rest = flow(0 * values, values)
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
    linear, here = balance.resisting(np.array([1e-6 * amplitude, amplitude]), value, few)[0].tolist()
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

    The secant method with few samples, begun where w^2 is the stiffness at the first value, with the slope 2 w^2 (w is
    taken to go with the parameter); then with all samples, unless some amplitudes show that few are enough. It is the
    same curve if each value is where the two before lead, as near as one step of `_on_backbone`.
    """
    detuning, _, square = balance.resisting(a, value, True)
    slope: Array
    x, slope = value * np.sqrt(1 - detuning / square), 2 * square
    if not ((x > 0) & (x < np.inf)).all():  # no backbone at large amplitudes; a slow flow tells no w^2
        return None
    few, last, change, damping = True, detuning, x, square
    for count in range(_TRIES):
        gap, damping, square = balance.resisting(a, x, few)
        if count == 0:
            slope = 2 * square
        elif few:
            slope = np.where(np.abs(gap - last) > 1e-3 * np.abs(last), (gap - last) / change, slope)
        last, change = gap, np.clip(-gap / slope, -_MOST, _MOST)
        size = float(np.abs(change).max())
        if not size < math.inf:
            return None
        if size < _SETTLED:
            if not few or _enough(balance, a, x, gap, damping, square):
                break
            few = False
            continue
        x = x * np.exp(change)
    else:
        return None
    steps = np.diff(np.log(x / value))
    return damping / balance.exciting(x) if (np.abs(np.diff(steps)) < _MOST).all() else None


def _enough(balance: Balance, a: Array, x: Array, gap: Array, damping: Array, square: Array) -> bool:
    """Whether all samples give at the first, the middle and the last amplitude what few give."""
    some = np.array([0, len(a) // 2, len(a) - 1])
    other, force, _ = balance.resisting(a[some], x[some], False)
    near = np.abs(other - gap[some]) < 1e-9 * square[some]
    return bool((near & (np.abs(force - damping[some]) < 1e-9 * np.abs(force))).all())


def _on_backbone(balance: Balance, a: float, guess: float) -> tuple[float, float] | None:
    """(parameter at which the detuning is zero, damping force), by Newton's method on its logarithm; None: nowhere."""
    x = guess
    for _ in range(40):
        both = np.array([x, x * (1 + _BUMP)])
        (gap, bumped), (damping, _), _ = balance.resisting(np.array([a, a]), both, False)
        slope = (bumped - gap) / _BUMP
        if not (math.isfinite(gap) and math.isfinite(slope)) or slope == 0:
            return None
        change = max(-_MOST, min(_MOST, -gap / slope))
        x *= math.exp(change)
        if abs(change) < _SETTLED:
            return float(x), float(damping)
    return None
