"""Adaptive Chebyshev tiles of Floquet data over a rectangle of two parameters.

The fields of `sampling` are analytic in the parameters, so their Chebyshev coefficients fall geometrically: nodes are
doubled (nested Lobatto points) in each direction until the last two coefficients are below the target, then what is
not needed is chopped. A rectangle is split where 65 nodes do not suffice, or where the fields grow so large that
rounding, eps max|f|, would show in the growth rate. The time steps are chosen on a 3 x 3 sample of the tile by
doubling until two successive Richardson values agree.

The error of a tile is absolute, of its fields: truncation + time steps + rounding.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError
from ..kernels.chebyshev import chop, coefficients, lobatto, tails
from ..results.tiles import Tile
from .sampling import Sampler

__all__ = ["build_tiles"]

Array = NDArray[np.float64]

_FIRST, _LARGEST = 16, 64
_MAX_TILES = 200
_MAX_SPLIT_FOR_ERROR = 64  # beyond, a tile that converged is kept with the error it has
_MAX_STEPS = 8192


def build_tiles(
    sampler: Sampler, box: tuple[float, float, float, float], tolerance: float, worst: Callable[[Tile], float]
) -> tuple[Tile, ...]:
    """Tiles that cover the box (x0, x1, y0, y1).

    Parameters
    ----------
    sampler : Sampler
    tolerance : of the growth rate, absolute.
    worst : Tile -> estimated error of the growth rate on it; a tile above the tolerance is split while that helps.
    """
    done: list[Tile] = []
    waiting: list[tuple[tuple[float, float, float, float], float]] = [(box, np.inf)]
    while waiting:
        current, inherited = waiting.pop()
        tile, direction = _build(sampler, current, tolerance)
        full = len(done) + len(waiting) >= _MAX_TILES
        if tile is not None and direction is None:
            error = worst(tile)
            few = len(done) + len(waiting) < _MAX_SPLIT_FOR_ERROR
            if error > tolerance and few and error < 0.5 * inherited:
                kx, ky = tile.fields.shape[2], tile.fields.shape[1]
                direction, inherited = ("x" if kx >= ky else "y"), error
        if direction is None and tile is not None:
            done.append(tile)
            continue
        if full or direction is None:
            x0, x1, y0, y1 = current
            raise ConvergenceError(
                f"the Floquet data do not converge on {x0:g} to {x1:g}, {y0:g} to {y1:g} after {len(done)} tiles: a "
                "singular point or very large growth lies there; make the window smaller, or raise tolerance",
                box=current, tiles=len(done),
            )  # fmt: skip
        for part in _halves(current, direction):
            waiting.append((part, inherited))
    return tuple(sorted(done, key=lambda tile: (tile.box[2], tile.box[0])))


def _halves(box: tuple[float, float, float, float], direction: str) -> list[tuple[float, float, float, float]]:
    x0, x1, y0, y1 = box
    if direction == "x":
        middle = 0.5 * (x0 + x1)
        return [(x0, middle, y0, y1), (middle, x1, y0, y1)]
    middle = 0.5 * (y0 + y1)
    return [(x0, x1, y0, middle), (x0, x1, middle, y1)]


def _mesh(box: tuple[float, float, float, float], dx: int, dy: int) -> tuple[Array, Array]:
    """Lobatto nodes of the box as two flat arrays, y slow."""
    x0, x1, y0, y1 = box
    x = 0.5 * (x0 + x1) + 0.5 * (x1 - x0) * lobatto(dx)
    y = 0.5 * (y0 + y1) + 0.5 * (y1 - y0) * lobatto(dy)
    return np.tile(x, dy + 1), np.repeat(y, dx + 1)


def _build(
    sampler: Sampler, box: tuple[float, float, float, float], tolerance: float
) -> tuple[Tile | None, str | None]:
    """A converged tile, or the direction in which the box has to be split."""
    x, y = _mesh(box, 2, 2)
    clock = sampler.clock(x, y)
    target = 4e-4 * tolerance / float(clock[0].max())
    steps, step_error = _choose_steps(sampler, x, y, target)
    dx = dy = _FIRST
    values = _sample(sampler, box, dx, dy, steps, None)
    while True:
        shape = (-1, dy + 1, dx + 1)
        C = coefficients(values.reshape(shape))
        largest = float(np.abs(values).max())
        if not np.isfinite(largest):
            return None, "x" if dx >= dy else "y"
        wanted = max(target, 4e-15 * largest)
        in_x, in_y = tails(C)
        if in_x <= wanted and in_y <= wanted:
            break
        grow_x, grow_y = in_x > wanted, in_y > wanted
        if (grow_x and dx == _LARGEST) or (grow_y and dy == _LARGEST):
            return None, "x" if grow_x and dx == _LARGEST else "y"
        new_x, new_y = dx * (2 if grow_x else 1), dy * (2 if grow_y else 1)
        values = _sample(sampler, box, new_x, new_y, steps, (values.reshape(shape), dx, dy))
        dx, dy = new_x, new_y
    fields, lost = chop(C, wanted)
    rounding = np.finfo(float).eps * (8.0 + 0.05 * steps) * largest
    x, y = _mesh(box, dx, dy)
    ticks, missed = _clock(sampler.clock(x, y).reshape(2, dy + 1, dx + 1))
    # the clock enters the growth rate directly, not through the fields; it is added by the caller
    return Tile(box, fields, ticks, lost + in_x + in_y + step_error + rounding, missed), None


def _clock(values: Array) -> tuple[Array, float]:
    """Chopped coefficients of 1/T and sigma."""
    scale = np.abs(values).max(axis=(1, 2), keepdims=True)
    for axis in (1, 2):  # most often a direction does not matter at all
        if np.all(np.ptp(values, axis=axis, keepdims=True) <= 1e-15 * scale):
            values = values.take([0], axis=axis)
    C = coefficients(values)
    kept, lost = chop(C, 1e-15 * float(scale.max()))
    remaining = [t for t in tails(C) if np.isfinite(t)]
    missed = max(remaining, default=0.0)
    return kept, lost + (missed if missed > 1e-14 * scale.max() else 0.0) + 1e-16 * float(scale.max())


def _choose_steps(sampler: Sampler, x: Array, y: Array, target: float) -> tuple[int, float]:
    """Steps for which two successive Richardson values on the sample agree to the target, and their difference."""
    steps, error = 16, np.inf
    before = sampler.fields(x, y, steps)
    while True:
        ratio = 2.0 if not np.isfinite(error) else (error / (0.25 * target)) ** 0.125
        old, steps = steps, 2 * int(np.ceil(0.5 * steps * min(2.0, max(1.3, ratio))))
        now = sampler.fields(x, y, steps)
        # the difference is the error of the coarser value; that of the finer one is smaller by the order 8
        error = float(np.abs(now - before).max()) / ((steps / old) ** 8 - 1.0)
        floor = 2e-16 * steps * float(np.abs(now).max())
        if error <= max(0.5 * target, floor) or steps >= _MAX_STEPS or not np.isfinite(error):
            return steps, 2.0 * error
        before = now


def _sample(
    sampler: Sampler,
    box: tuple[float, float, float, float],
    dx: int,
    dy: int,
    steps: int,
    known: tuple[Array, int, int] | None,
) -> Array:
    """Fields (Q, N) at the Lobatto nodes of the box; values known on a coarser nested mesh are not computed again."""
    x, y = _mesh(box, dx, dy)
    if known is None:
        return sampler.fields(x, y, steps)
    old, ox, oy = known
    have = np.zeros((dy + 1, dx + 1), dtype=bool)
    have[:: dy // oy, :: dx // ox] = True
    missing = ~have.ravel()
    out = np.empty((len(old), have.size))
    out[:, have.ravel()] = old.reshape(len(old), -1)
    out[:, missing] = sampler.fields(x[missing], y[missing], steps)
    return out
