r"""A table of the stroboscopic map for basins of systems with two states (kernels/strobe_table.py).

Following a cell takes as many periods of integration as its transient lasts; one period for every point of a table
replaces them all. The table covers the grid and the motions of the coarse subset, with a margin; whole turns of an
angle; it is made finer until nearly no place is handed back. It is worth its price where the grid's cells would take
several times as many periods one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..kernels import strobe_table, strobing

__all__ = ["StrobeTable", "tabulated"]

Array = np.ndarray
_SIZES = (129, 257, 513, 1025)
_WORTH = 4.0  # so many times fewer periods of integration, at least
_ALLOWED = 1e-6  # estimated error of an image over the scales
_HANDED_BACK = 0.02  # of the cells that are tried: more need a finer table
_HELPED, _USELESS = 0.7, 0.7  # of the part that was handed back before; of all cells
_ESCAPING = 0.1  # of the subset: more make a table as dear as the cells
_MARGIN = 0.05
_EDGE = 4  # points beyond the rectangle on every side


@dataclass(frozen=True, eq=False)
class StrobeTable:
    """Images (my, mx, 2) of the points low + (i, j) step, two arrays (2,); rows: how many were integrated for it."""

    images: Array
    low: Array
    step: Array
    rows: int

    def assign(self, run: Any, states: Array, labels: Array) -> None:
        """Follow states (N, 2) in place and label them; what the table does not know is integrated."""
        points, owners = run.targets()
        strobe_table.follow(
            self.images, self.low, self.step, _ALLOWED, states, run.periods, points, owners, run.scale, run.wraps,
            run.tolerance, labels,
        )  # fmt: skip
        left = np.nonzero(labels == strobe_table.HANDED_BACK)[0]
        if left.size:
            rest, found = np.ascontiguousarray(states[left]), np.empty(left.size, np.int64)
            run.assign(rest, found)
            states[left], labels[left] = rest, found


def tabulated(
    run: Any, cells: Array, pool: Executor, progress: Callable[[int, int], Any] | None, extra: int
) -> StrobeTable | None:
    """A table for the cells (N, 2), or None where integrating them one by one costs less or the map is too rough.

    run : the follower of `basins`, which has learnt the attractors;  extra : rows that `progress` counts besides
    """
    if cells.shape[1] != 2 or not run.found or run.escaped > _ESCAPING:
        return None
    if len(cells) * run.periods < _WORTH * _SIZES[0] ** 2:
        return None
    work = len(cells) * run.mean_periods(cells)
    low, high = _rectangle(run, cells)
    best: tuple[float, StrobeTable] | None = None
    rows = 0
    for size in _SIZES:
        if work < _WORTH * size**2:
            break
        table = _made(run, low, high, size, pool, progress, (rows, extra))
        rows = table.rows
        some = np.ascontiguousarray(cells[:: max(1, len(cells) // 2000)])
        labels, (points, owners) = np.empty(len(some), np.int64), run.targets()
        strobe_table.follow(
            table.images, table.low, table.step, _ALLOWED, some, run.periods, points, owners, run.scale, run.wraps,
            run.tolerance, labels,
        )  # fmt: skip
        left = float((labels == strobe_table.HANDED_BACK).mean())
        if best is not None and best[0] <= _USELESS and left > _HELPED * best[0]:
            break  # what is left escapes, or leaves the rectangle
        best = (left, table)
        if left <= _HANDED_BACK:
            break
    return None if best is None or best[0] > _USELESS else replace(best[1], rows=rows)


def _rectangle(run: Any, cells: Array) -> tuple[Array, Array]:
    """What the table has to cover."""
    low = np.minimum(cells.min(axis=0), run.seen[0])
    high = np.maximum(cells.max(axis=0), run.seen[1])
    width = cells.max(axis=0) - cells.min(axis=0)  # motions that are about to escape go far
    low, high = np.maximum(low, cells.min(axis=0) - width), np.minimum(high, cells.max(axis=0) + width)
    margin = _MARGIN * (high - low)
    low, high = low - margin, high + margin
    turned = cells.min(axis=0)
    return np.where(run.wraps, turned, low), np.where(run.wraps, turned + 2 * np.pi, high)


def _made(
    run: Any, low: Array, high: Array, size: int, pool: Executor, progress: Callable[[int, int], Any] | None,
    beside: tuple[int, int],
) -> StrobeTable:  # fmt: skip
    step = (high - low) / (size - 1)
    # an angle reaches one point further than a turn below and above, for the stencil
    count = size + 2 * _EDGE
    first = low - _EDGE * step
    xs, ys = (first[a] + step[a] * np.arange(count) for a in range(2))
    images = np.empty((count, count, 2))

    def row(k: int) -> None:
        states = np.column_stack([xs, np.full(count, ys[k])])
        labels = np.empty(count, np.int64)
        run.assign(states, labels, periods=1, known=False)
        states[labels == strobing.ESCAPED] = np.nan
        images[k] = states

    for k, _ in enumerate(pool.map(row, range(count))):
        if progress is not None:
            progress(beside[0] + k + 1, beside[0] + count + beside[1])
    return StrobeTable(images, first, step, beside[0] + count)
