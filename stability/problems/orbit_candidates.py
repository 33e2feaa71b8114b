r"""Starts for a search of forced periodic orbits, at one value of the parameters: `orbit_candidates`.

Three sorts, none of which needs a known orbit:

1. all one-harmonic solutions of polynomial equations (harmonic_roots), x = a_0 + a_1 cos theta + b_1 sin theta;
2. the equilibria of the averaged field G(x) = mean_s f(s, x, p), from random states by Newton's method: with a small
   forcing there is an orbit around each that is not degenerate (implicit function theorem);
3. the motions on which transients from those equilibria settle: an attractor in each well.

Guesses for Newton's method and nothing more: what is a solution is decided by the problem.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..errors import StabilityError
from .orbit_starts import from_function

if TYPE_CHECKING:
    from .orbits import OrbitDiscretisation

__all__ = ["averaged_equilibria", "orbit_candidates"]

Array = np.ndarray
_MOST_PATHS = 100  # of the homotopy to all one-harmonic solutions, at a value
_PHASES = 32
_SIZES = (0.1, 1.0, 10.0)
_RANDOM = 12  # states of each size
_NEWTON = 40
_SAME = 1e-6
_MOST = 6  # equilibria
_TRANSIENTS = 200  # periods


def orbit_candidates(problem: OrbitDiscretisation, params: Array) -> list[Array]:
    """Unknowns u to start Newton's method from, for forced systems without stops; empty for all others."""
    system = problem.system
    if problem.own or system.stops:
        return []
    period = problem.orbit_period(params)
    rests = averaged_equilibria(problem, params)
    functions = [*_one_harmonic(problem, params), *(_resting(problem, x, period) for x in rests)]
    found = [from_function(problem, function, period) for function in functions]
    found += [_settled(problem, params, x) for x in rests]
    return [u for u in found if np.isfinite(u).all()]


def _one_harmonic(problem: OrbitDiscretisation, params: Array) -> list[Callable[[Array], Array]]:
    """All one-harmonic solutions of one forcing period; none for longer orbits, turning angles, or where refused."""
    from .harmonic_balance import HarmonicBalance
    from .harmonic_roots import one_harmonic_roots

    if problem.multiple > 1 or problem.whole_winding.any():
        return []
    try:
        balance = HarmonicBalance(problem.system, harmonics=1)
        roots = one_harmonic_roots(balance, params, _MOST_PATHS)
    except StabilityError:
        return []
    period = balance.orbit_period(params)

    def motion(c: Array) -> Callable[[Array], Array]:
        return lambda t: np.asarray(balance.layout.states(c, 2 * np.pi / period, np.asarray(t) / period)).T

    return [motion(c) for c in roots]


def _resting(problem: OrbitDiscretisation, x: Array, period: float) -> Callable[[Array], Array]:
    """The state x, with the winding of the orbit."""
    return lambda t: x[:, None] + np.outer(problem.whole_winding, np.asarray(t) / period)


def _settled(problem: OrbitDiscretisation, params: Array, x: Array) -> Array:
    """u of the last of `_TRANSIENTS` periods from x; nan where the motion leaves all bounds."""
    from ..integration.transients import settled_orbit

    turns = problem.whole_winding
    try:
        times, states, period = settled_orbit(problem.system, params, x, problem.multiple, turns, _TRANSIENTS)
    except StabilityError:
        return np.full(problem.size, np.nan)
    return problem.discretise(times[:-1], states[:, :-1], period)


def averaged_equilibria(problem: OrbitDiscretisation, params: Array) -> list[Array]:
    """States (n,) where the field vanishes on the mean over a forcing period, by Newton's method from random states."""
    system, field = problem.system, problem.evaluations
    n = system.n
    X = np.vstack([np.zeros((1, n)), np.random.default_rng(0).standard_normal((len(_SIZES) * _RANDOM, n))])
    X[1:] *= np.repeat(_SIZES, _RANDOM)[:, None]
    phases = np.tile((np.arange(_PHASES) + 0.5) / _PHASES, len(X))
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON):
            F, J = field.FJ(phases, np.repeat(X, _PHASES, axis=0), params)
            G, A = (v.reshape(len(X), _PHASES, *v.shape[1:]).mean(axis=1) for v in (F, J))
            step = _least_squares(A, G)
            X = X - step
            moved = np.abs(step).max(axis=1) / (1 + np.abs(X).max(axis=1))
    return _distinct(X[np.isfinite(X).all(axis=1) & (moved < 1e-10)], [s in system.angles for s in system.states])


def _least_squares(A: Array, G: Array) -> Array:
    """A^+ G for stacks, also where A is singular; nan where it is not finite."""
    good = np.isfinite(A).all(axis=(1, 2)) & np.isfinite(G).all(axis=1)
    step = np.full_like(G, np.nan)
    step[good] = np.einsum("kij,kj->ki", np.linalg.pinv(A[good]), G[good])
    return step


def _distinct(X: Array, angles: list[bool]) -> list[Array]:
    """Each state once, angles between -pi and pi, small ones first, at most `_MOST`."""
    turning = np.array(angles)
    X = np.where(turning, np.remainder(X + np.pi, 2 * np.pi) - np.pi, X)
    kept: list[Array] = []
    for x in X[np.argsort(np.abs(X).max(axis=1))] if len(X) else X:
        gaps = [np.where(turning, np.abs(np.exp(1j * (x - y)) - 1), np.abs(x - y)) for y in kept]
        if all(float(gap.max()) > _SAME * (1 + float(np.abs(x).max())) for gap in gaps):
            kept.append(x)
    return kept[:_MOST]
