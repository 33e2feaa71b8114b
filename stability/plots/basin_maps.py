"""Basins of attraction as areas of one lightness each, attractors as their stroboscopic points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .style import COLOURS, axis_label

if TYPE_CHECKING:
    from ..results.basins import Basins

__all__ = ["plot_basins"]

# light enough for points on them, and apart in grey print
_AREAS = ("#FFFFFF", COLOURS["sky"], COLOURS["orange"], COLOURS["green"], COLOURS["purple"], COLOURS["blue"])
_ESCAPED, _UNDECIDED = "#404040", "#BDBDBD"


def plot_basins(basins: Basins, ax: Any = None, *, points: bool = True) -> Any:
    """Draw basins over their two initial values.

    Parameters
    ----------
    basins : Basins
    ax : matplotlib Axes, optional
    points : whether the attractors' stroboscopic points are drawn, where they fall into the picture

    Returns
    -------
    matplotlib Axes
    """
    from matplotlib.colors import ListedColormap

    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(5.2, 4.4), layout="constrained").add_subplot()
    count = len(basins.attractors)
    colours = [_UNDECIDED, _ESCAPED, *(_AREAS[k % len(_AREAS)] for k in range(count))]
    dx, dy = (0.5 * (v[1] - v[0]) for v in (basins.x, basins.y))
    extent = (basins.x[0] - dx, basins.x[-1] + dx, basins.y[0] - dy, basins.y[-1] + dy)
    ax.imshow(basins.labels, origin="lower", extent=extent, aspect="auto", interpolation="nearest",
              cmap=ListedColormap(colours), vmin=-2.5, vmax=count - 0.5)  # fmt: skip
    if points:
        i, j = basins.states.index(basins.x_name), basins.states.index(basins.y_name)
        for k, attractor in enumerate(basins.attractors):
            at = np.asarray(attractor.points)
            ax.plot(at[:, i], at[:, j], "os^Dv*"[k % 6], color="black", markerfacecolor="white", markersize=5,
                    markeredgewidth=1.2, label=f"{100 * attractor.share:.3g} %, {attractor.multiple or '?'} T")
    ax.set(xlabel=axis_label(basins.x_name), ylabel=axis_label(basins.y_name))
    ax.set(xlim=extent[:2], ylim=extent[2:])
    return ax
