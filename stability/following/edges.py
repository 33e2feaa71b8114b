r"""Where the physical part of a branch ends: problems with a clearance.

A problem may have a ``clearance(u, params)``, positive where its solutions mean something: periodic motions with a
given sequence of impacts end where they graze (problems/impact_shooting.py). The curve of zeros goes on smoothly
beyond, so that the place is found between two points like any other zero, by Illinois iteration along the curve; a
parabola through three neighbours shows a dip below zero inside a step. What happens on the way there is sought up to a
point just in front: the multipliers of an impact without speed are infinite.
"""

from __future__ import annotations

from ..words import Kind
from .events import vertex
from .locating import Found, Locator
from .points import Point

__all__ = ["Edge"]

_DIP = 0.3  # a vertex below this part of the second smallest neighbour is looked at
_IN_FRONT = 0.999


class Edge:
    """Watches the clearance of one side of a branch."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Point, float]] = {}

    def _value(self, point: Point) -> float:
        return float(point.problem.clearance(point.u, point.params))  # type: ignore[attr-defined]

    def _values(self, points: list[Point]) -> list[float]:
        """Clearances of accepted points, each computed once."""
        self._known = {id(p): self._known.get(id(p)) or (p, self._value(p)) for p in points}
        return [self._known[id(p)][1] for p in points]

    def reached(self, locator: Locator, before: Point | None, a: Point, b: Point) -> tuple[Found, Point] | float | None:
        """(the grazing point, a point just in front of it), None, or the factor by which to shorten a lost step."""
        if not hasattr(a.problem, "clearance"):
            return None
        behind = before if before is not None and before.problem is a.problem else None
        values = self._values([p for p in (behind, a, b) if p is not None])
        ga, gb = values[-2:]
        if behind is not None and gb > 0:
            dip = vertex((behind.s, a.s, b.s), (values[0], ga, gb))
            if dip is not None and dip.depth < _DIP and a.s < dip.at < b.s:
                middle = locator.on_curve(a, b, (dip.at - a.s) / (b.s - a.s))
                if middle is not None and self._value(middle) < 0:
                    b, gb = middle, self._value(middle)
        if gb > 0:
            return None
        point = locator.zero(a, b, self._value, ga, gb)
        front = None if point is None else locator.on_curve(a, b, _IN_FRONT * (point.s - a.s) / (b.s - a.s))
        if point is None or front is None:
            return 0.4
        return Found(point, Kind.GRAZING, (a.parameter, b.parameter), abs(b.s - a.s) * 1e-13), front
