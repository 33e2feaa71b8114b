r"""Where a branch begins: a corrected first solution, or the first steps away from a special point.

At a first solution the tangent points to the far end of the window. A branch that is born at a special point leaves it
along the direction of its seed, on one side or on both; the first step is taken orthogonally to the old branch, and its
length is found by trial.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError
from ..protocols import Corrected, Problem, Seed, Tangent
from .follower import Entry, Follower
from .points import Point, dot, make_point, smooth_tests, tangent_of
from .settings import Settings

__all__ = ["born_sides", "first_point", "inside_window"]

Array = NDArray[np.float64]


def inside_window(start: Any, settings: Settings) -> float | None:
    """The parameter value of a start that is a solution from inside the window; None for any other start."""
    value = getattr(start, "params", {}).get(settings.name)
    return value if value is not None and settings.low < value < settings.high else None


def _params_of(problem: Problem) -> Array:
    return np.array(list(problem.parameters.values()), dtype=float)


def first_point(problem: Problem, settings: Settings, start: Any, value: float) -> Point:
    """A corrected solution at a parameter value, its tangent pointing to the far end of the window."""
    params = _params_of(problem)
    params[settings.index] = value
    u = problem.start(params, start)
    found = problem.correct(u, params, settings.name, None, 0.0, settings.tolerance)
    if not found.converged:
        raise ConvergenceError(
            f"no solution at {settings.name} = {value:g}: {found.note}; give start= nearer to a solution, "
            "or begin at another end of the window",
            last=u, iterations=found.iterations, note=found.note,
        )
    inward = math.copysign(1.0, settings.window[1] - settings.window[0])
    found, tangent = _with_tangent(problem, found, settings, inward)
    point = make_point(problem, found, tangent, settings.index, 0.0, 0.0)  # what its errors are tells how to adapt
    better = problem.adapt(found.u, found.params, tangent)
    if better is None:
        return point
    problem, u, _ = better  # solved again also where only scales are new: the tolerance counts in them
    found = problem.correct(u, found.params, settings.name, None, 0.0, settings.tolerance)
    if not found.converged:
        raise ConvergenceError(f"the first solution was lost when its mesh was adapted: {found.note}", last=point.u)
    found, tangent = _with_tangent(problem, found, settings, inward)
    return make_point(problem, found, tangent, settings.index, 0.0, 0.0)


def _with_tangent(
    problem: Problem, found: Corrected, settings: Settings, inward: float
) -> tuple[Corrected, Tangent]:
    """The unit tangent of a fixed-parameter solve, and its determinant's sign turned into that of the bordered one."""
    w, weight = problem.weights, settings.weight
    if found.tangent is not None:
        size = math.sqrt(dot(w, found.tangent.u, found.tangent.u) + weight**2) * inward
        if math.isfinite(size) and abs(size) < 1e8 * weight:
            sign = int(math.copysign(1, inward)) * found.determinant_sign
            return found._replace(determinant_sign=sign), Tangent(found.tangent.u / size, 1.0 / size, weight)
    # a fold at the very start: the tangent lies across the parameter
    L = problem.linearise(found.u, found.params)
    random = np.random.default_rng(0).standard_normal(found.u.size) * (w > 0)
    random /= math.sqrt(dot(w, random, random)) or 1.0
    tangent = tangent_of(problem, L, settings.name, (random, inward / weight), weight)
    if tangent is None:
        raise ConvergenceError(
            f"the solution at {settings.name} = {settings.window[0]:g} is singular (a branch point); "
            "begin a little away from it", last=found.u,
        )
    if tangent.parameter * inward < 0:
        tangent = Tangent(-tangent.u, -tangent.parameter, weight)
    return found._replace(determinant_sign=0), tangent


# ---------------------------------------------------------------------- born at a special point
def born_sides(seed: Seed, settings: Settings) -> tuple[Point, tuple[Follower | None, Follower | None]]:
    """The birth point and a follower that has made its first step on each side (None where that failed)."""
    if settings.name != seed.free:
        raise InputError(
            f"this branch is born at a point found along '{seed.free}': continue it in '{seed.free}' first, then start "
            f"from one of its solutions in '{settings.name}'"
        )
    problem, weight = seed.problem, settings.weight
    w, params = problem.weights, np.array(seed.params, dtype=float)
    at = float(params[settings.index])
    if not settings.low <= at <= settings.high:
        window = f"({settings.low:g}, {settings.high:g})"
        raise InputError(f"the branch is born at {settings.name} = {at:.10g}, outside the window {window}")
    size = math.sqrt(dot(w, seed.tangent, seed.tangent) + (seed.parameter * weight) ** 2)
    tangent = Tangent(seed.tangent / size, seed.parameter / size, weight)
    # an orbit born at a Hopf point has no direction of flow at its birth: its spectrum is taken just beside it
    beside = seed.u if seed.sides == 2 else seed.u + 1e-4 * tangent.u
    spectrum = problem.spectrum(problem.linearise(beside, params))
    tests = smooth_tests(spectrum.values, problem.critical.circle)
    birth = Point(problem, seed.u, params, at, tangent, spectrum, tests, 0, 0.0, 0, 0.0, 0.0)
    ahead = _first_step(seed, birth, settings, 1.0)
    behind = _first_step(seed, birth, settings, -1.0) if seed.sides == 2 and not seed.mirror else None
    if ahead is None and (seed.sides == 1 or seed.mirror):
        ahead = _first_step(seed, birth, settings, -1.0)
    return birth, (ahead, behind)


def _first_step(seed: Seed, birth: Point, settings: Settings, side: float) -> Follower | None:
    """A short step along the new direction, kept away from the old branch; its length is found by trial."""
    t = birth.tangent
    if side < 0:
        t = Tangent(-t.u, -t.parameter, t.weight)
    problem, w, weight = birth.problem, birth.problem.weights, t.weight
    normal = t
    if seed.avoid is not None:
        old_u, old_l = seed.avoid
        size = math.sqrt(dot(w, old_u, old_u) + (weight * old_l) ** 2)
        c = (dot(w, t.u, old_u) + t.parameter * old_l * weight**2) / size**2
        u, parameter = t.u - c * old_u, t.parameter - c * old_l
        size = math.sqrt(dot(w, u, u) + (weight * parameter) ** 2)
        if size > 1e-3:
            normal = Tangent(u / size, parameter / size, weight)
    h = settings.steps.first
    while h > 1e-14:
        params = birth.params.copy()
        params[settings.index] += h * t.parameter
        found = problem.correct(birth.u + h * t.u, params, settings.name, normal, 0.0, settings.tolerance)
        point = _first_accepted(birth, t, found, settings, h)
        if point is not None:
            follower = Follower(settings, point, length=2 * point.step, mirrored=seed.sides == 1 or seed.mirror)
            follower.entries.append(Entry(point, None))
            follower._adapt()
            return follower
        h *= 0.25
    return None


def _first_accepted(birth: Point, t: Tangent, found: Corrected, settings: Settings, h: float) -> Point | None:
    """The first point of a side if it lies along `t` and inside the window."""
    if not found.converged or found.tangent is None:
        return None
    parameter = float(found.params[settings.index])
    if not settings.low <= parameter <= settings.high:
        return None
    w, weight = birth.problem.weights, t.weight
    du, dl = found.u - birth.u, (parameter - birth.parameter) * weight
    length = math.sqrt(dot(w, du, du) + dl * dl)
    along = dot(w, t.u, du) + t.parameter * weight * dl
    turn = dot(w, t.u, found.tangent.u) + t.parameter * found.tangent.parameter * weight**2
    if not (0.9 * length < along and 0.3 * h < length < 3 * h and abs(turn) > 0.9):
        return None
    tangent, sign = found.tangent, found.determinant_sign
    if turn < 0:
        tangent, sign = Tangent(-tangent.u, -tangent.parameter, weight), -sign
    turned = found._replace(determinant_sign=sign)
    return make_point(birth.problem, turned, tangent, settings.index, length, length)
