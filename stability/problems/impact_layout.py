r"""Where an orbit with impacts is cut: its origin, the cuts of its flights, and the sequence of its impacts.

The impacts of an orbit at times s_1 < .. < s_q (in units of its period) divide it into q flights. The origin is put in
the middle of the longest flight, where it stays far from impacts while they move; a flight is cut into as many equal
parts as its share of the wanted number of segments asks for. Without impacts the origin is phase zero.

`frozen` finds the sequence in a motion of one period; motions that stick to a wall have none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ConvergenceError, InputError, NonFiniteError
from ..integration.engine import Engine, Precision
from ..kernels import piecewise
from ..results.trajectory import Ending

if TYPE_CHECKING:
    from .impact_shooting import ImpactShooting
    from .shooting import Shooting

__all__ = ["Impact", "frozen", "laid_out", "started_at_walls", "uneven"]

Array = np.ndarray
_UNEVEN = 0.3  # shortest part of a flight over the mean of its parts that is left alone
_TRANSIENTS, _SETTLED = 400, 1e-7


class Impact(NamedTuple):
    """Time in units of the period, number of the stop, state behind it (n,)."""

    time: float
    stop: int
    after: Array


def laid_out(
    impacts: list[Impact], segments: int, state: Callable[[float], Array], winding: Array
) -> tuple[tuple[int, ...], tuple[float, ...], float, Array, Array]:
    """(marks, cuts, origin, states (N, n), impact times (q,)) of an orbit with these impacts, in order.

    state : state at a time in units of the period, any real number (the orbit goes on, wound)
    """
    if not impacts:
        cuts = np.arange(1, segments) / segments
        states = [state(0.0), *(state(float(c)) for c in cuts)]
        return (-1,) * len(cuts), tuple(cuts.tolist()), 0.0, np.array(states), np.zeros(0)
    times = np.array([impact.time for impact in impacts])
    flights = np.diff(np.append(times, times[0] + 1.0))
    longest = int(np.argmax(flights))
    middle = times[longest] + 0.5 * flights[longest]
    origin = middle - math.floor(middle)
    turned = []
    for impact in impacts:
        late = -math.floor(impact.time - origin)
        turned.append(Impact(impact.time + late, impact.stop, impact.after + late * winding))
    turned.sort(key=lambda impact: impact.time)
    marks: list[int] = []
    cuts_: list[float] = []
    states_: list[Array] = [state(origin)]
    corners = [origin, *(impact.time for impact in turned), origin + 1.0]
    for k, (a, b) in enumerate(pairwise(corners)):
        parts = max(1, math.ceil((b - a) * segments - 1e-9))
        for i in range(1, parts):
            cut = a + (b - a) * i / parts
            marks.append(-1)
            cuts_.append(cut)
            states_.append(state(cut))
        if k < len(turned):
            marks.append(turned[k].stop)
            states_.append(turned[k].after)
    return tuple(marks), tuple(cuts_), origin, np.array(states_), np.array([impact.time for impact in turned])


def uneven(edges: Array, marks: tuple[int, ...]) -> bool:
    """Whether an impact has come near a cut or the origin."""
    widths, starts = np.diff(edges), [k + 1 for k, m in enumerate(marks) if m >= 0]
    if not starts:
        return False
    flights = [widths[a:b] for a, b in pairwise(starts)]
    flights.append(np.concatenate([widths[starts[-1] :], widths[: starts[0]]]))
    return any(float(f.min()) < _UNEVEN * float(f.mean()) for f in flights)


def frozen(problem: Shooting, x: Array, params: Array, period: float) -> tuple[ImpactShooting, Array] | None:
    """The problem with the sequence of impacts of the motion from x at t = 0, and its first u; None where it sticks."""
    from .impact_shooting import ImpactShooting

    engine = Engine.of(problem.system)
    precision = Precision(max(problem.rtol, 1e-12), problem.atol * problem.scales)
    motion = engine.run(params, x, 0.0, period, precision)
    if motion.ending is not Ending.COMPLETED:
        raise ConvergenceError(f"the motion of '{problem.system.name}' did not last a period", t=motion.t, x=motion.x)
    happened = [h for h in motion.happenings if h.kind in ("impact", "stick", "release")]
    if any(h.kind != "impact" for h in happened):
        return None
    assert engine.guards is not None
    numbers = {wall.name: k for k, wall in enumerate(engine.guards.walls)}
    impacts = [Impact(h.t / period, numbers[h.name], np.array(h.after)) for h in happened]

    def state(s: float) -> Array:
        back = math.floor(s)
        found = piecewise.at(motion.edges, motion.coefficients, np.array([(s - back) * period]))[0]
        return np.asarray(found + back * problem.winding)

    marks, cuts, origin, states, times = laid_out(impacts, problem.segments, state, problem.winding)
    kept = ("system", "segments", "multiple", "winding", "rtol", "atol", "scales", "period_scale")
    new = ImpactShooting(**{k: getattr(problem, k) for k in kept}, marks=marks, cuts=cuts, origin=origin)
    return new, new.packed(states, period, times)


# ---------------------------------------------------------------------- first points
def started_at_walls(problem: Shooting, params: Array, guess: Any) -> Array | None:
    """A converged u of `Shooting` for a system with hard stops; None where only plain shooting can go on.

    Without a guess the motion that does not reach the walls is tried first, then transients from rest; a state starts
    transients; an orbit (callable with `period`) gives its own sequence of impacts.
    """
    if isinstance(guess, np.ndarray) and guess.shape == (problem.size,) and problem.segments > 1:
        return None
    if guess is None and not problem.own:
        found = _solved(problem, np.zeros(problem.n), params, problem.orbit_period(params), free=True)
        if found is not None:
            return found
    given = _orbit_of(guess)
    if given is not None:
        x, period = given[0], given[1] if problem.own else problem.orbit_period(params)
    elif problem.own:
        if guess is None:
            return None
        from ..integration.transients import settled_orbit

        state = problem.system.state_vector(guess)
        _, states, period = settled_orbit(problem.system, params, state, 1, problem.winding, 1)
        x = states[:, 0].copy()
    else:
        period = problem.orbit_period(params)
        x = _settled(problem, params, problem.system.state_vector(guess), period)
    found = _solved(problem, x, params, period)
    if found is None and given is not None:
        raise ConvergenceError(
            f"Newton's method did not reach an orbit of '{problem.system.name}' with the impacts of the given one; "
            "give an orbit at nearer parameter values, or a state whose transients end there", x=x, params=params,
        )  # fmt: skip
    if found is None and problem.segments == 1:  # it sticks: plain shooting from there
        return problem.packed(x, period)
    return found


def _orbit_of(guess: Any) -> tuple[Array, float] | None:
    """(state at t = 0, period) of a guess that is an orbit or a pair (function, period)."""
    if isinstance(guess, tuple) and len(guess) == 2 and callable(guess[0]):
        return np.asarray(guess[0](np.zeros(1)), float)[:, 0], float(guess[1])
    if callable(guess) and hasattr(guess, "period"):
        return np.asarray(guess(0.0), float), float(guess.period)
    return None


def _settled(problem: Shooting, params: Array, x: Array, period: float) -> Array:
    """The state at phase zero after the transients."""
    engine, precision = Engine.of(problem.system), Precision(1e-9, 1e-11 * problem.scales)
    for _ in range(max(1, _TRANSIENTS // problem.multiple)):
        motion = engine.run(params, x, 0.0, period, precision, dense=False)
        if motion.ending is not Ending.COMPLETED:
            raise ConvergenceError(
                f"the transients of '{problem.system.name}' end at t = {motion.t:.6g} ({motion.ending})",
                t=motion.t, x=motion.x,
            )  # fmt: skip
        moved = float(np.abs(motion.x - x - problem.winding).max())
        x = motion.x - problem.winding
        if moved <= _SETTLED * max(float(np.abs(x).max()), 1e-6):
            break
    return x


def _solved(problem: Shooting, x: Array, params: Array, period: float, free: bool = False) -> Array | None:
    """u of `problem` by Newton on the motion's own sequence of impacts (none with `free`); None without success."""
    from .impact_shooting import ImpactShooting

    try:
        if free:
            kept = ("system", "multiple", "winding", "rtol", "atol", "scales", "period_scale")
            made: Any = ImpactShooting(**{k: getattr(problem, k) for k in kept}), np.array(x)
        else:
            made = frozen(problem, x, params, period)
    except (ConvergenceError, NonFiniteError, InputError):
        made = None
    if made is None:
        return None
    orbit, u = made
    found = orbit.correct(u, params, next(iter(problem.parameters), ""), None, 0.0, 1e-10)
    if not found.converged or not orbit.clearance(found.u, params) > 0:
        return None
    period = orbit.period_of(found.u, params)
    states = []
    for s in problem.places:
        back = math.ceil(orbit.origin - s) if s < orbit.origin else 0
        states.append(orbit.state_at(found.u, params, s + back) - back * problem.winding)
    return problem.packed(np.array(states), period)
