r"""Walls: solves exactly at an end of the parameter's window, and at the ends of an unknown's.

A problem may keep one of its unknowns inside a window, as the driver does the parameter.

``problem.walls`` is a tuple of (place of the unknown in u, counted from the end; low, high): the second parameter of a
curve of special points. A step that would pass a wall is replaced by a solve *on* it: the last row of the bordered
system is then the unit vector of that unknown, and the parameter is free. A branch that reaches a wall ends there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..protocols import Corrected, Tangent
from .points import Point, dot
from .settings import Settings

__all__ = ["landing", "on_wall"]

Array = NDArray[np.float64]
Guess = tuple[Array, float]


def _walls(problem: Any) -> tuple[tuple[int, float, float], ...]:
    return getattr(problem, "walls", ())


def on_wall(point: Point) -> bool:
    """Whether the point lies on a wall of an unknown."""
    return any(point.u[place] in (low, high) for place, low, high in _walls(point.problem))


def landing(
    last: Point, predict: Callable[[float], Guess], settings: Settings, u: Array, parameter: float, h: float
) -> tuple[Corrected, Tangent, float, Guess] | str | None:
    """The solve on the wall beyond which (u, parameter) lies, if it is about one step away.

    Returns
    -------
    (solution, tangent on the side of `last`'s, arclength, guess), or why there is none yet: a shorter step is to be
    tried; None where (u, parameter) lies beyond no wall. ``predict(h)`` gives (u, parameter) at arclength h.
    """
    if not settings.low <= parameter <= settings.high:
        return _at_end(last, predict, settings, settings.low if parameter < settings.low else settings.high, h)
    for place, low, high in _walls(last.problem):
        if not low <= u[place] <= high:
            return _aside(last, predict, settings, place, low if u[place] < low else high, h)
    return None


def _reach(gap: float, rate: float, h: float) -> float | None:
    """Arclength to a wall along the tangent; None if it is more than about one step away."""
    reach = gap / rate if rate else math.inf
    return reach if 0 < reach <= 2 * h else None


def _at_end(
    last: Point, predict: Callable[[float], Guess], settings: Settings, wall: float, h: float
) -> tuple[Corrected, Tangent, float, Guess] | str:
    reach = _reach(wall - last.parameter, last.tangent.parameter, h)
    if reach is None:
        return ""
    u, _ = predict(reach)
    params = last.params.copy()
    params[settings.index] = wall
    found = last.problem.correct(u, params, settings.name, None, 0.0, settings.tolerance)
    if not found.converged or found.tangent is None:
        return f"at the end of the window: {found.note}"
    if any(not low <= found.u[place] <= high for place, low, high in _walls(last.problem)):
        return ""  # the other wall comes first
    slope, weight, w = found.tangent, settings.weight, last.problem.weights
    size = math.sqrt(dot(w, slope.u, slope.u) + weight**2)
    side = dot(w, slope.u, last.tangent.u) + weight**2 * last.tangent.parameter
    size = math.copysign(size, side)
    tangent = Tangent(slope.u / size, 1.0 / size, weight)
    signed = found._replace(determinant_sign=found.determinant_sign * (1 if size > 0 else -1))
    return signed, tangent, reach, (u, wall)


def _aside(
    last: Point, predict: Callable[[float], Guess], settings: Settings, place: int, wall: float, h: float
) -> tuple[Corrected, Tangent, float, Guess] | str:
    reach = _reach(wall - float(last.u[place]), float(last.tangent.u[place]), h)
    if reach is None:
        return ""
    problem, w, weight = last.problem, last.problem.weights, settings.weight
    u, parameter = predict(reach)
    u, params, direction = u.copy(), last.params.copy(), np.zeros(last.u.size)
    u[place], params[settings.index], direction[place] = wall, parameter, 1.0 / math.sqrt(w[place])
    found = problem.correct(u, params, settings.name, Tangent(direction, 0.0, weight), 0.0, settings.tolerance)
    if not found.converged or found.tangent is None:
        return f"at the end of the other parameter's window: {found.note}"
    if not settings.low <= float(found.params[settings.index]) <= settings.high:
        return ""
    found.u[place] = wall  # but for rounding it is
    t = found.tangent
    side = dot(w, t.u, last.tangent.u) + t.parameter * last.tangent.parameter * weight**2
    t = t if side > 0 else Tangent(-t.u, -t.parameter, weight)
    return found, t, reach, (u, parameter)
