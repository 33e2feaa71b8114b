"""All methods of a comparison on one axes: the reference thick and grey below, the others in their series colours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..results.comparison import swept
from ..results.measured import MeasuredResponse
from ..results.sweep import Sweep
from .branches import plot_branch
from .measurements import plot_measured
from .style import COLOURS, SERIES, axis_label

if TYPE_CHECKING:
    from ..results.comparison import Comparison

__all__ = ["plot_comparison"]


def plot_comparison(comparison: Comparison, ax: Any = None) -> list[Any]:
    """Draw every compared branch, sweep and measured response; unstable parts dashed; special points: the reference's.

    Parameters
    ----------
    comparison : Comparison
    ax : Axes or None
        Where to draw; a new figure otherwise.

    Returns
    -------
    list of artists
    """
    if ax is None:
        import matplotlib.pyplot as plt

        _, ax = plt.subplots(layout="constrained")
    stem, _, measure = comparison.quantity.rpartition(".")
    artists = []
    colours = [c for c in SERIES if c not in (COLOURS["black"], COLOURS["grey"])]
    for k, (name, curve) in enumerate(zip(comparison.names, comparison.curves)):
        if isinstance(curve, MeasuredResponse):
            artists += plot_measured(curve, ax=ax, y=comparison.quantity, label=name)
            continue
        if isinstance(curve, Sweep):
            values = swept(curve, comparison.quantity)
            lo, hi = curve.window
            marker = ">" if hi > lo else "<"
            artists += ax.plot(
                curve.parameter[curve.settled], values[curve.settled], marker, color=colours[(k - 1) % len(colours)],
                markersize=3.0, markerfacecolor="none", linestyle="none", label=name,
            )  # fmt: skip
            continue
        look: dict[str, Any] = {"color": colours[(k - 1) % len(colours)], "kinds": ()}
        if k == 0:
            look = {"color": COLOURS["grey"], "linewidth": 3.0}
        for i, branch in enumerate(curve):
            artists += plot_branch(branch, ax=ax, y=comparison.quantity, label=None if i else name, **look)
    ax.set_xlabel(axis_label(comparison.parameter_name))
    ax.set_ylabel(f"amplitude of {axis_label(stem)}" if measure == "amplitude(1)" else axis_label(comparison.quantity))
    ax.legend(frameon=False, fontsize="small")
    return artists
