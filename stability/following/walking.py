r"""A continuation under way: `Walk` goes from point to point, stops when asked, and is a branch at any moment.

A branch has one side or two. The sides are followed one after the other; the second one is left out where the first
ended in a way that leaves nothing to it (it closed on itself, or was stopped). `continuation` is a walk that is run to
its end, `steps` hands the walk to the user, `Branch.extend` walks on from the ends of a stored branch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..results.branch import Branch
from ..words import Kind, Status, Verdict
from .follower import Follower
from .points import Point

__all__ = ["Step", "Walk", "ended"]


def ended(follower: Follower | None) -> Status:
    """The status of a side: one that never made a step could not leave its first point; one under way is stopped."""
    if follower is None:
        return Status.STEP_TOO_SMALL
    return Status.STOPPED if follower.status is None else follower.status


@dataclass(frozen=True, eq=False)
class Step:
    """One accepted point of a walk.

    Attributes
    ----------
    number : int, how many points there are now;  parameter : float, value of the continued parameter
    length : float, length of the step that led here, in the scaled norm (see `continuation`)
    values : (n,) complex, multipliers (orbits) or eigenvalues (equilibria);  verdict : Verdict
    special : tuple of Kind, what was found between the point before and this one
    solution : FixedPoint or PeriodicOrbit, computed when asked for
    """

    number: int
    parameter: float
    length: float
    values: NDArray[np.complex128]
    verdict: Verdict
    special: tuple[Kind, ...]
    _point: Point

    @cached_property
    def solution(self) -> Any:
        """The solution at this point."""
        return self._point.problem.view(self._point.u, self._point.params)

    def __repr__(self) -> str:
        found = "".join(f" {kind.label}" for kind in self.special)
        return f"Step {self.number} at {self.parameter:.10g} | {self.verdict}{found}"


class Walk(Iterator[Step]):
    """A continuation point by point: an iterator of `Step`; made by `steps`.

    Attributes
    ----------
    status : Status or None
        None while there is more to follow.
    branch : Branch
        All points so far, at any moment; where the walk has not ended its status is ``STOPPED``.

    Notes
    -----
    A loop may be left at any point, by ``break``, by an exception or by the keyboard: `branch` has every accepted
    point, and the walk can be taken up again with ``next`` or another loop.
    """

    def __init__(
        self, sides: tuple[Callable[[], Follower] | Follower | None, ...], together: Callable[[Walk], Branch],
        alone: tuple[Status, ...] = (),
    ) -> None:  # fmt: skip
        self._waiting = list(sides)
        self._together, self._last_words = together, alone
        self.sides: list[Follower | None] = []  # begun so far, in the order of `sides`
        self._reported: dict[int, int] = {}
        self._next_side()

    def _next_side(self) -> bool:
        """Go over to the next side, if there is one."""
        while self._waiting:
            side = self._waiting.pop(0)
            follower = side() if callable(side) and not isinstance(side, Follower) else side
            self.sides.append(follower)
            if follower is not None:
                self._reported[id(follower)] = len(follower.entries)
                return True
        return False

    def _alone(self, side: Follower) -> bool:
        """Whether a side ended in a way that leaves nothing to the next one."""
        return side.interrupted or side.status in self._last_words

    def side(self, number: int) -> Follower | None:
        """A side that has been begun."""
        return self.sides[number] if number < len(self.sides) else None

    @property
    def _now(self) -> Follower | None:
        return self.sides[-1] if self.sides else None

    @property
    def status(self) -> Status | None:
        """Why the walk ended; None while it goes on."""
        now = self._now
        if now is None:
            return Status.STEP_TOO_SMALL
        done = now.status is not None and (not self._waiting or self._alone(now))
        return now.status if done else None

    def __iter__(self) -> Walk:
        return self

    def __next__(self) -> Step:
        while True:
            now = self._now
            if now is None:
                raise StopIteration
            point = next(now, None)
            if point is not None:
                return self._step(now, point)
            if self._alone(now) or not self._next_side():
                raise StopIteration

    def _step(self, side: Follower, point: Point) -> Step:
        new = side.entries[self._reported[id(side)] :]
        self._reported[id(side)] = len(side.entries)
        kinds = tuple(entry.found.kind for entry in new if entry.found is not None)
        number = sum(len(s.entries) for s in self.sides if s is not None)
        spectrum = point.spectrum
        return Step(number, point.parameter, point.step, spectrum.values, spectrum.verdict, kinds, point)

    def run(self) -> Walk:
        """Go on to the end; an interrupt from the keyboard ends the walk and keeps its points."""
        try:
            while (now := self._now) is not None:
                for _ in now:
                    pass
                self._reported[id(now)] = len(now.entries)
                if self._alone(now) or not self._next_side():
                    break
        except KeyboardInterrupt:
            now = self._now
            if now is not None:
                now.interrupt()
                self._waiting.clear()
        return self

    @property
    def branch(self) -> Branch:
        """All points so far, as a branch."""
        return self._together(self)

    def __repr__(self) -> str:
        status = self.status
        points = sum(len(s.entries) for s in self.sides if s is not None)
        return f"Walk | {points} points so far | {'goes on' if status is None else status.name}"
