r"""The other half of a branch that breaks a symmetry: the image of the first, written down instead of computed.

At a symmetry-breaking pitchfork (problems/orbit_symmetry.py) the two halves of the new branch are images of each other,

    u -> image(u) on the turned mesh,    same parameters, multipliers and events,    tangents mapped like u.

A half that ends at another pitchfork of the same symmetry is followed by its image back to the birth point: a closed
loop. Any other half gives the branch  image reversed - birth - half.
"""

from __future__ import annotations

import math
from typing import Any

from ..problems.breaking import regained
from ..protocols import Tangent
from ..words import Status
from .follower import Entry, Follower
from .points import Point, dot, smooth_tests
from .settings import Settings
from .sharpening import sharpened

__all__ = ["with_images"]

_NEAR = 1e-4  # scaled distance between a pitchfork as it was met, a little unfolded, and as it is


class _Images:
    """Images of points; one image problem for every problem of the branch."""

    def __init__(self) -> None:
        self._problems: dict[int, tuple[Any, Any]] = {}

    def entry(self, entry: Entry, s: float) -> Entry:
        """The image of an entry at arclength s, passed in the direction opposite to its model's."""
        p = entry.point
        known = self._problems.setdefault(id(p.problem), (p.problem, None))
        if known[1] is None:
            known = self._problems[id(p.problem)] = (p.problem, p.problem.image_problem())  # type: ignore[attr-defined]
        image = p.problem.image  # type: ignore[attr-defined]
        t = Tangent(-image(p.tangent.u), -p.tangent.parameter, p.tangent.weight)
        sign = -p.determinant_sign
        point: Point = p._replace(problem=known[1], u=image(p.u), tangent=t, s=s, determinant_sign=sign)
        return Entry(point, None if entry.found is None else entry.found._replace(point=point))


def with_images(birth: Entry, half: Follower) -> tuple[list[Entry], Status]:
    """All entries of the branch, and the status of both of its ends."""
    status, images = half.status or Status.STOPPED, _Images()  # under way: stopped
    entries = [sharpened(half.settings, e) for e in half.entries]
    ends_in_pitchfork = status is Status.CLOSED_LOOP and half.entries and half.entries[-1].found is not None
    if ends_in_pitchfork:
        last = _exactly(half.settings, entries[-1])
        end = last.point.s
        back = [images.entry(e, 2 * end - e.point.s) for e in reversed(entries[:-1])]
        closing = Entry(birth.point._replace(s=2 * end), None)
        return [birth, *entries[:-1], last, *back, closing], status
    if status is Status.CLOSED_LOOP:  # it has come round by itself
        return [birth, *entries], status
    front = [images.entry(e, -e.point.s) for e in reversed(entries)]
    return [*front, birth, *entries], status


def _exactly(settings: Settings, entry: Entry) -> Entry:
    """The pitchfork at the end of a half, on a mesh that is the same in both halves of the period."""
    point, found = entry
    exact = regained(point.problem, point.u, point.params, settings.name, settings.weight)  # type: ignore[arg-type]
    if exact is None or found is None:
        return entry
    problem, u, direction, params = exact
    parameter = float(params[settings.index])
    if abs(parameter - point.parameter) * settings.weight > _NEAR:
        return entry
    length = math.sqrt(dot(problem.weights, direction, direction))
    tangent = Tangent(direction / length, 0.0, settings.weight)
    spectrum = problem.spectrum(problem.linearise(u, params))
    tests = smooth_tests(spectrum.values, True)
    new = point._replace(
        problem=problem, u=u, params=params, parameter=parameter, tangent=tangent, spectrum=spectrum, tests=tests
    )
    return Entry(new, found._replace(point=new, breaking=True))
