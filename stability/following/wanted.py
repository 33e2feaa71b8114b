r"""What a user wants located along a branch: values of the parameter, zeros of functions g(solution).

Between neighbouring points P, Q a value is passed where (lambda_P - value)(lambda_Q - value) < 0, a zero where
g_P g_Q < 0; both are then solved on the curve. A function that is not a number at a point has no sign there: a zero
beside that point may be missed, which is told once by a warning and in the message of the branch.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

from ..errors import InputError, StabilityWarning
from ..words import Kind
from .locating import Found, Locator
from .points import Point
from .settings import Settings

__all__ = ["Wanted"]


def _gap(value: float, point: Point) -> float:
    return point.parameter - value


def _value_of(name: str, function: Callable[[Any], float], point: Point) -> float:
    """A user's event function at a point; what it raises is told whose it is."""
    solution = point.problem.view(point.u, point.params)
    try:
        return float(function(solution))
    except Exception as error:
        error.add_note(f"the event '{name}'")
        raise


def _first_value(name: str, function: Callable[[Any], float], point: Point) -> float:
    """The same at the first point: a function that fails there is a mistake, and no work is lost yet."""
    try:
        return _value_of(name, function, point)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise InputError(f"the event '{name}' failed at the first solution: {reason}") from error


class Wanted:
    """The wanted values and user functions of one side of a branch; it remembers their last values."""

    def __init__(self, settings: Settings, locator: Locator, first: Point) -> None:
        self._settings, self._locator = settings, locator
        self._notes: dict[str, str] = {}
        self._last = [self._told(name, first, _first_value(name, f, first)) for name, f in settings.events]

    @property
    def anything(self) -> bool:
        """Whether there is anything to look for."""
        return bool(self._settings.at or self._settings.events)

    @property
    def note(self) -> str:
        """Which functions were not numbers somewhere, in words; empty: none."""
        return "; ".join(self._notes.values())

    def between(self, knots: list[Point]) -> list[Found]:
        """All that is passed from each of the points to the next."""
        return self._values(knots) + self._zeros(knots)

    def _told(self, name: str, point: Point, value: float) -> float:
        """`value`, and a word about it where it is not a number."""
        if math.isnan(value) and name not in self._notes:
            at = f"{self._settings.name} = {point.parameter:.10g}"
            self._notes[name] = note = f"the event '{name}' is not a number at {at}: a zero of it may be missed"
            if name not in self._settings.told:
                self._settings.told.add(name)
                warnings.warn(note, StabilityWarning, stacklevel=2)
        return value

    def _values(self, knots: list[Point]) -> list[Found]:
        found = []
        for p, q in pairwise(knots):
            for value in self._settings.at:
                if (p.parameter - value) * (q.parameter - value) < 0:
                    point = self._locator.at_parameter(p, q, value)
                    if point is None:
                        ends = p.parameter - value, q.parameter - value
                        point = self._locator.zero(p, q, partial(_gap, value), *ends)
                    if point is not None:
                        found.append(Found(point, Kind.USER, (p.parameter, q.parameter), 0.0))
        return found

    def _zeros(self, knots: list[Point]) -> list[Found]:
        found = []
        for k, (name, function) in enumerate(self._settings.events):
            value_of = partial(self._event, name, function)
            values = [self._last[k], *(value_of(p) for p in knots[1:])]
            self._last[k] = values[-1]
            for (p, gp), (q, gq) in pairwise(zip(knots, values)):
                if gp * gq < 0:
                    point = self._locator.zero(p, q, value_of, gp, gq)
                    if point is not None:
                        found.append(Found(point, Kind.USER, (p.parameter, q.parameter), 0.0, name))
        return found

    def _event(self, name: str, function: Callable[[Any], float], point: Point) -> float:
        return self._told(name, point, _value_of(name, function, point))
