"""Plain steps, several at a time, where a problem can take them in one call.

A `StridingProblem` predicts, corrects and judges by itself, by the limits and the pace of `stepping`, and gives back
the steps that are plainly good. The first that is not, is taken here step by step; so is a step that turns out to need
another length than the one it was made with, and all that follow from it are dropped. Events between the points are
looked for as between any others, unless the problem has ruled them out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..protocols import Stretch, Stride
from .points import Point
from .searching import WATCH
from .settings import Settings
from .stepping import LIMITS, ORDER, PACE

__all__ = ["Strides"]

Array = NDArray[np.float64]
_MOST = 8  # steps at a time: what is made ahead is lost where the branch has to be looked at


class Strides:
    """The steps made ahead of one side of a branch."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._steps: Iterator[Stride] = iter(())
        self._left = 0  # so many may still come
        self._from: Array | None = None  # where the next of them begins
        self._refused: Array | None = None  # where the last of them was not plainly good

    def step(self, last: Point, past: Sequence[Point], h: float, rest: int, every: int) -> Stride | None:
        """The step of length h from `last`; None: look at it closely.

        After `rest` steps, and then after each `every`, the mesh is adapted where it needs to be.
        """
        if last.u is self._refused:
            return None
        if not (last.u is self._from and self._left):
            self._begin(last, past, h, rest, every)
        made = next(self._steps, None)
        if made is None or made.tried != h:
            self._left, self._refused = 0, last.u
            return None
        self._left = self._left - 1 if made.spectrum is not None and made.rests else 0
        self._from = made.found.u
        return made

    def _begin(self, last: Point, past: Sequence[Point], h: float, rest: int, every: int) -> None:
        settings, problem = self._settings, last.problem
        self._steps, self._left = iter(()), _MOST
        strides = getattr(problem, "strides", None)
        if strides is None:
            return
        points = [last]
        for point in past[: ORDER - 1]:
            if point.problem is not problem:
                break
            points.append(point)
        two = (last, *past[:1])
        self._steps = strides(
            Stretch(
                last.u, last.params, settings.name, tuple(p.tangent for p in points), tuple(p.step for p in points),
                tuple(p.spectrum for p in two), tuple(p.tests for p in two), tuple(p.determinant_sign for p in two),
                (past[0].tangent.parameter, last.s - past[0].s) if past else (0.0, 0.0), h, _MOST, rest, every,
                (settings.low, settings.high), settings.tolerance, LIMITS, (settings.steps.longest, *PACE), WATCH,
            )
        )  # fmt: skip
