r"""Zeros of functions that a problem itself wants watched: points of codimension two on curves of special points.

A problem may have ``monitors``, a tuple of (kind, function of a point), and ``confirmed(kind, point, scale)``, which
names a located zero or says that it is none (a pole, a neutral saddle). Zeros are found by Illinois iteration along the
curve between neighbouring points, as for a user's events, instead of the driver's own events: such a curve has neither
counts nor defining systems of its own. Problems without monitors cost nothing here.
"""

from __future__ import annotations

from .locating import Found, Locator
from .points import Point

__all__ = ["Monitor"]


class Monitor:
    """Watches the functions of one side of a branch; remembers their values at the last point."""

    def __init__(self, first: Point) -> None:
        self.values = [function(first) for _, function in getattr(first.problem, "monitors", ())]

    @property
    def alone(self) -> bool:
        """Whether the problem's own functions are all there is to watch."""
        return bool(self.values)

    def zeros(self, locator: Locator, knots: list[Point]) -> list[Found]:
        """Zeros between neighbouring knots, all on one mesh; the first knot's values are those remembered."""
        found: list[Found] = []
        problem = knots[0].problem
        for k, (kind, function) in enumerate(getattr(problem, "monitors", ())):
            values = [self.values[k], *(function(p) for p in knots[1:])]
            self.values[k] = values[-1]
            for (p, gp), (q, gq) in zip(zip(knots, values), zip(knots[1:], values[1:])):
                if gq != 0 and not gp * gq < 0:
                    continue
                # a knot may lie on the zero itself: the middle of a segment that is symmetric about it
                point = q if gq == 0 else locator.zero(p, q, function, gp, gq)
                named = None if point is None else problem.confirmed(kind, point, max(abs(gp), abs(gq)))  # type: ignore[attr-defined]
                if point is not None and named is not None:
                    found.append(Found(point, named, (p.parameter, q.parameter), abs(q.s - p.s) * 1e-13))
        return found
