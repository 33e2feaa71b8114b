"""First points of periodic-orbit problems: from nothing, a state, an orbit, samples, a doubled orbit.

Forced systems: Newton's first step from x = 0 is the linear response; where Newton fails, transients are integrated
and Newton starts from the last period. Autonomous systems need something to start from: a state (its transients are
integrated until they close up), an orbit, or a Hopf point (`switch`). Samples of a periodic function are interpolated
trigonometrically, so that switching can add a direction to an orbit in any layout.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ConvergenceError, InputError, NonFiniteError
from ..protocols import Corrected

if TYPE_CHECKING:
    from .collocation import Collocation
    from .orbits import OrbitDiscretisation

__all__ = ["discretised", "doubled_problem", "from_function", "started"]

Array = np.ndarray
_TOLERANCE = 1e-10
_EXACT = 1e-12  # a residual, over the scales, that is rounding
_TRANSIENTS = 400  # periods of a forced system


def from_function(problem: OrbitDiscretisation, function: Callable[[Array], Array], period: float) -> Array:
    """u of x = function(t) -> (n, K) with the given orbit period.

    Half of a period gets the symmetric part of the function, (x(t) + S (x(t + P/2) - w)) / 2.
    """
    if not problem.halved:
        return problem.packed(np.asarray(function(problem.places * period), float).T, period)
    times = problem.places * (0.5 * period)
    first, second = (np.asarray(function(t), float).T for t in (times, times + 0.5 * period))
    return problem.packed(0.5 * (first + (second - problem.winding) @ problem.closure.T), period)


def discretised(problem: OrbitDiscretisation, times: Array, states: Array, period: float) -> Array:
    """u of the trigonometric interpolant of equispaced samples states (n, K)."""
    states = np.asarray(states, float)
    count = states.shape[1]
    phase = (times - times[0]) / period
    coefficients = np.fft.rfft(states - phase * problem.whole_winding[:, None], axis=1) / count
    if count % 2 == 0:
        coefficients[:, -1] *= 0.5
    k = np.arange(coefficients.shape[1])
    factor = np.where(k == 0, 1.0, 2.0)

    def function(t: Array) -> Array:
        s = (t - times[0]) / period
        waves = (factor * coefficients) @ np.exp(2j * np.pi * np.outer(k, s))
        return np.asarray(waves.real + s * problem.whole_winding[:, None])

    return from_function(problem, function, period)


def doubled_problem(problem: Collocation, u: Array, params: Array, vector: Array) -> tuple[Collocation, Array, Array]:
    """Twice the period: the mesh twice, the orbit twice, and the variation (v(s), -v(s)) of M v = -v."""
    mesh = problem.mesh
    edges = np.concatenate([mesh.edges / 2, 0.5 + mesh.edges[1:] / 2])
    multiple = problem.multiple if mesh.own else 2 * problem.multiple
    new = dataclasses.replace(
        problem, multiple=multiple, intervals=2 * problem.intervals, edges=edges, winding=2 * problem.winding,
        mirror=None, symmetry=None, period_scale=2 * problem.period_scale if mesh.own else 1.0, _memo={},
    )  # fmt: skip
    nodes, stages, rest = mesh.split(u)
    shifted = np.tile(problem.winding, mesh.degree)
    twice = new.mesh.join(
        np.concatenate([nodes, nodes[1:] + problem.winding]), np.concatenate([stages, stages + shifted]), 2 * rest
    )
    linearisation = problem.linearise(u, params)
    lifted = linearisation.lift(np.concatenate([vector, np.zeros(mesh.own)]))
    dn, ds, _ = mesh.split(lifted)
    direction = new.mesh.join(np.concatenate([dn, -dn[1:]]), np.concatenate([ds, -ds]), 0.0)
    return new, twice, direction


# ---------------------------------------------------------------------- start
def started(problem: OrbitDiscretisation, params: Array, guess: Any) -> Array:
    """A converged u; see the head of this file.

    guess: None, a state (mapping of names or array (n,)), an array u, an orbit (callable with `period`), a fixed point
    (with `x`), or a function t -> (n, K) together with its period as the tuple (function, period).
    """
    if isinstance(guess, np.ndarray) and guess.shape == (problem.size,):
        return _settled(problem, np.array(guess, float), params, "the given solution")
    if isinstance(guess, tuple) and len(guess) == 2 and callable(guess[0]):
        return _settled(problem, from_function(problem, guess[0], float(guess[1])), params, "the given function")
    if callable(guess) and hasattr(guess, "period"):
        return _from_orbit(problem, params, guess)
    if guess is None and not problem.own:
        return _from_rest(problem, params)
    if guess is None:
        raise InputError(
            f"'{problem.system.name}' is autonomous: give a state near the orbit (start=dict(...)), an orbit, or start "
            "from a Hopf point by switch(...)"
        )
    state = guess.x if hasattr(guess, "x") and np.ndim(guess.x) == 1 else guess
    return _from_transients(problem, params, problem.system.state_vector(state))


def _newton(problem: OrbitDiscretisation, u: Array, params: Array) -> Corrected:
    name = next(iter(problem.parameters), "")
    return problem.correct(u, params, name, None, 0.0, _TOLERANCE)


def _settled(problem: OrbitDiscretisation, u: Array, params: Array, what: str) -> Array:
    found = _newton(problem, u, params)
    exact = found.note == "singular" and found.residual <= _EXACT  # at a branch point or fold: a solution all the same
    if not (found.converged or exact):
        raise _failed(problem, params, found, what)
    if problem.own:
        states = problem.pieces(found.u, params)[2].reshape(-1, problem.system.n)
        path = float(np.abs(problem.evaluations.F(None, states, params)).max()) * float(found.u[-1])
        if path <= 1e-6 * max(float(np.abs(states).max()), 1e-9):
            raise ConvergenceError(
                f"Newton's method went from {what} to an equilibrium of '{problem.system.name}': "
                "give a state near the orbit (its transients are integrated) or a better orbit",
                u=found.u, params=params,
            )  # fmt: skip
    return found.u


def _failed(problem: OrbitDiscretisation, params: Array, found: Corrected, what: str) -> ConvergenceError:
    where = ", ".join(f"{k} = {v:g}" for k, v in zip(problem.parameters, params))
    return ConvergenceError(
        f"Newton's method did not reach a periodic orbit of '{problem.system.name}' from {what} ({found.note}; "
        f"residual {found.residual:.1e}) at {where}; give a state near the orbit, an orbit of another method, or start "
        f"at another parameter value{problem.advice}",
        residual=found.residual, iterations=found.iterations, u=found.u, params=params,
    )  # fmt: skip


def _from_orbit(problem: OrbitDiscretisation, params: Array, orbit: Any) -> Array:
    states = getattr(orbit, "states", problem.system.states)
    if tuple(states) != tuple(problem.system.states):
        raise InputError(f"the orbit has the states {tuple(states)}, the system {tuple(problem.system.states)}")
    period = float(orbit.period)
    if not problem.own:
        wanted = problem.multiple * problem.evaluations.period(params)
        turns = wanted / (period * round(max(1.0, wanted / period)))
        if not 0.5 < turns < 2:
            raise InputError(f"an orbit of period {period:g} does not fit {problem.multiple} periods, {wanted:g}")
        ratio = period / wanted * max(1, round(wanted / period))
        return _settled(problem, from_function(problem, lambda t: orbit(t * ratio), wanted), params, "the given orbit")
    return _settled(problem, from_function(problem, orbit, period), params, "the given orbit")


def _from_rest(problem: OrbitDiscretisation, params: Array) -> Array:
    found = _newton(problem, problem.packed(problem.places[:, None] * problem.winding, 0.0), params)
    if found.converged:
        return found.u
    first = f"Newton's method from rest ({found.note}; residual {found.residual:.1e})"
    try:
        return _from_transients(problem, params, np.zeros(problem.system.n))
    except NonFiniteError as error:
        raise NonFiniteError(f"tried {first}, then transients from rest: {error}") from error
    except ConvergenceError as error:
        raise ConvergenceError(f"tried {first}, then transients from rest: {error}", **error.data) from error


def _from_transients(problem: OrbitDiscretisation, params: Array, state: Array) -> Array:
    from ..integration.transients import settled_orbit

    turns = problem.whole_winding
    times, states, period = settled_orbit(problem.system, params, state, problem.multiple, turns, _TRANSIENTS)
    interpolant = _periodic_cubic(times, states)
    return _settled(problem, from_function(problem, interpolant, period), params, "the end of transients")


def _periodic_cubic(times: Array, states: Array) -> Callable[[Array], Array]:
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(times, states, axis=1)
    return lambda t: np.asarray(spline(np.clip(t, times[0], times[-1])))
