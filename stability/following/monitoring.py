r"""Zeros of functions that a problem itself wants watched: points of codimension two on curves of special points.

A problem may have ``monitors``, a tuple of (kind, function of a point), and ``confirmed(kind, point, scale)``, which
names a located zero or says that it is none (a pole, a neutral saddle). Zeros are found by Illinois iteration along the
curve between neighbouring points, as for a user's events. Problems without monitors cost nothing here.
"""

from __future__ import annotations

from .locating import Found, Locator
from .points import Point

__all__ = ["Monitor"]


class Monitor:
    """Watches the functions of one side of a branch; remembers their values at the last point."""

    def __init__(self, first: Point) -> None:
        self.values = [function(first) for _, function in getattr(first.problem, "monitors", ())]

    def zeros(self, locator: Locator, knots: list[Point]) -> list[Found]:
        """Zeros between neighbouring knots, all on one mesh; the first knot's values are those remembered."""
        found: list[Found] = []
        problem = knots[0].problem
        for k, (kind, function) in enumerate(getattr(problem, "monitors", ())):
            values = [self.values[k], *(function(p) for p in knots[1:])]
            self.values[k] = values[-1]
            for (p, gp), (q, gq) in zip(zip(knots, values), zip(knots[1:], values[1:])):
                if not gp * gq < 0:
                    continue
                point = locator.zero(p, q, function, gp, gq)
                named = None if point is None else problem.confirmed(kind, point, max(abs(gp), abs(gq)))  # type: ignore[attr-defined]
                if point is not None and named is not None:
                    found.append(Found(point, named, (p.parameter, q.parameter), abs(q.s - p.s) * 1e-13))
        return found

    def named(self, found: list[Found]) -> list[Found]:
        """Events of the driver's own, by the names they have on this curve."""
        out = []
        for one in found:
            confirm = getattr(one.point.problem, "confirmed", None)
            kind = one.kind if confirm is None else confirm(one.kind, one.point, 1.0)
            if kind is not None:
                out.append(one._replace(kind=kind))
        return out
