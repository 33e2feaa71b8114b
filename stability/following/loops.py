r"""Recognising a closed branch: has the curve come back to where it started, in the same direction?

A segment that passes close to the first point is a candidate; it is closed if the point of the branch nearest to the
first one *is* the first one, to the accuracy of the corrector. On another mesh the first solution is carried over (as a
start for the current problem) before it is compared.
"""

from __future__ import annotations

import math

import numpy as np

from ..errors import ConvergenceError, InputError
from ..results.solutions import PeriodicOrbit
from .locating import Locator, chord_length
from .points import Point, dot, make_point

__all__ = ["Home", "collapsed"]

_SAME = 1e-6
_FEWEST = 4
# a mesh that is not the same in both halves breaks the symmetry by its error e, the crossing by about e^(1/3)
_COLLAPSED = 2e-2


class Home:
    """The first point of a branch, to be recognised when the curve returns."""

    def __init__(self, first: Point) -> None:
        self.first = first

    def reached(self, a: Point, b: Point, locator: Locator, accepted: int) -> Point | None:
        """The closing point, equal to the first one, if the segment from a to b passes through it."""
        if accepted < _FEWEST:
            return None
        if a.problem is self.first.problem:
            return self._on_same_mesh(a, b, locator)
        return self._by_parameter(a, b, locator)

    def _on_same_mesh(self, a: Point, b: Point, locator: Locator) -> Point | None:
        home, w, weight = self.first, a.problem.weights, a.tangent.weight
        du, dl = home.u - a.u, (home.parameter - a.parameter) * weight
        length = chord_length(a, b)
        along = dot(w, a.tangent.u, du) + a.tangent.parameter * weight * dl
        across = dot(w, du, du) + dl * dl - along * along
        if not 0 < along <= 1.1 * length or across > (0.3 * length) ** 2:
            return None
        found = a.problem.correct(a.u, a.params, locator.free, a.tangent, along, locator.tolerance)
        if not found.converged or found.tangent is None:
            return None
        if dot(w, found.tangent.u, home.tangent.u) + found.tangent.parameter * home.tangent.parameter * weight**2 <= 0:
            return None
        point = make_point(a.problem, found, found.tangent, locator.k, a.s + along, along)
        return point if self._same(point, home) else None

    def _by_parameter(self, a: Point, b: Point, locator: Locator) -> Point | None:
        home = self.first
        if not (a.parameter - home.parameter) * (b.parameter - home.parameter) < 0:
            return None
        if b.tangent.parameter * home.tangent.parameter < 0:
            return None
        point = locator.at_parameter(a, b, home.parameter)
        if point is None:
            return None
        try:
            u = a.problem.start(home.params, home.problem.view(home.u, home.params))
        except (ConvergenceError, InputError):
            return None
        found = a.problem.correct(u, point.params, locator.free, None, 0.0, locator.tolerance)
        if not found.converged:
            return None
        return point if self._same(point, point._replace(u=found.u)) else None

    @staticmethod
    def _same(p: Point, q: Point) -> bool:
        w = p.problem.weights
        du = p.u - q.u
        size = 1 + math.sqrt(dot(w, p.u, p.u))
        return math.sqrt(dot(w, du, du)) + abs(p.parameter - q.parameter) * p.tangent.weight < _SAME * size


def collapsed(point: Point) -> bool:
    """Whether an orbit repeats itself after half its period, or stands still: a family has come back to its parents.

    Doubled orbits end where they become the simple orbit twice over, orbits born at a Hopf point where they shrink to
    an equilibrium; beyond, the same solutions follow shifted in time. Differences count relative to the states' scales.
    """
    solution = point.problem.view(point.u, point.params)
    if not isinstance(solution, PeriodicOrbit):
        return False
    times = np.linspace(0.0, 0.5 * solution.period, 33)
    wound = 0.5 * np.asarray(solution.winding)[:, None]
    first, second = solution(times), solution(times + 0.5 * solution.period) - wound
    size = np.maximum(np.abs(first).max(axis=1), getattr(point.problem, "scales", 0.0)) + 1e-300
    return bool((np.abs(first - second).max(axis=1) <= _COLLAPSED * size).all())
