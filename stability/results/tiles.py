"""Tiles of a stability chart: Chebyshev coefficients of Floquet data over rectangles of two parameters.

A tile of the box (x0, x1, y0, y1) holds ``fields`` (Q, Ky, Kx), the Floquet data of the chart's form, and ``clock``
(2, ky, kx), 1/T and sigma (mean trace over n). The growth rate is sigma + theta / T with theta = log of the largest
multiplier of the normalised monodromy matrix; forms and formulas: `kernels.spectral_radius` and `charting.sampling`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.chebyshev import at_points

__all__ = ["Layer", "Tile", "evaluate"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Tile:
    """Coefficients on one rectangle.

    Attributes
    ----------
    box : (x0, x1, y0, y1)
    fields : (Q, Ky, Kx) float
    clock : (2, ky, kx) float
    error : absolute error of the fields
    clock_error : absolute error of the clock
    """

    box: tuple[float, float, float, float]
    fields: Array
    clock: Array
    error: float
    clock_error: float = 0.0

    def scaled(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Coordinates in [-1, 1] x [-1, 1]."""
        x0, x1, y0, y1 = self.box
        return (2.0 * x - x0 - x1) / (x1 - x0), (2.0 * y - y0 - y1) / (y1 - y0)


@dataclass(frozen=True, eq=False)
class Layer:
    """Tiles of one block of states (see `floquet.structure.blocks`); a chart is the maximum over its layers.

    Attributes
    ----------
    form : what the fields are, see `charting.sampling`
    states : number of states of the block
    neutral : whether stable means neutrally stable
    tiles : tuple of Tile
    """

    form: str
    states: int
    neutral: bool
    tiles: tuple[Tile, ...]


def evaluate(
    tiles: tuple[Tile, ...], x: Array, y: Array, which: str = "fields", count: int | None = None
) -> tuple[Array, Array, Array]:
    """Values and exact derivatives d/dx, d/dy of ``fields`` or ``clock`` at points (B,): three arrays (Q, B).

    `count` limits the work to the first functions. Points outside all tiles take the nearest tile's edge value.
    """
    x, y = np.broadcast_arrays(np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float)))
    owner = np.zeros(x.shape, dtype=int)
    if len(tiles) > 1:
        boxes = np.array([t.box for t in tiles])
        outside_x = np.maximum(boxes[:, :1] - x, x - boxes[:, 1:2]) / np.ptp(boxes[:, :2])
        outside_y = np.maximum(boxes[:, 2:3] - y, y - boxes[:, 3:]) / np.ptp(boxes[:, 2:])
        owner = np.maximum(np.maximum(outside_x, outside_y), 0.0).argmin(axis=0)
    first = getattr(tiles[0], which)[:count]
    out = tuple(np.empty((len(first), x.size)) for _ in range(3))
    for index in np.unique(owner):
        tile, here = tiles[index], owner == index
        xi, eta = tile.scaled(x[here], y[here])
        value, in_xi, in_eta = at_points(getattr(tile, which)[:count], xi, eta)
        x0, x1, y0, y1 = tile.box
        out[0][:, here], out[1][:, here], out[2][:, here] = value, in_xi * 2.0 / (x1 - x0), in_eta * 2.0 / (y1 - y0)
    return out[0], out[1], out[2]
