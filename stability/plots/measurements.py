"""Measured responses: open circles, so that what was computed stays visible below them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .style import COLOURS, axis_label

if TYPE_CHECKING:
    from ..results.measured import MeasuredResponse

__all__ = ["plot_measured"]


def plot_measured(
    measured: MeasuredResponse, ax: Any = None, y: str | None = None, *, factor: float = 1.0, **style: Any
) -> list[Any]:
    """Draw one column of a measured response over its parameter.

    Parameters
    ----------
    measured : MeasuredResponse
    ax : matplotlib Axes, optional
        Axes that have labels already keep them.
    y : a column, or a quantity of a branch such as "y.amplitude(1)"; default the first column
    factor : the values are multiplied by it (1000 for mm)
    **style : of the points

    Returns
    -------
    list of artists

    Raises
    ------
    UnknownNameError
    """
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(6.0, 4.0), layout="constrained").add_subplot()
    column = next(iter(measured.columns)) if y is None else measured.column(y)
    look: dict[str, Any] = {
        "linestyle": "none", "marker": "o", "markersize": 4.0, "markerfacecolor": "none", "color": COLOURS["vermilion"],
        "markeredgewidth": 0.8, "label": "measured", "zorder": 2.4, **style,
    }  # fmt: skip
    artists = list(ax.plot(measured.parameter, factor * measured.columns[column], **look))
    unit = measured.units.get(column, "") if factor == 1.0 else ""
    if not ax.get_xlabel():
        ax.set_xlabel(axis_label(measured.name, measured.units.get(measured.name, "")))
    if not ax.get_ylabel():
        ax.set_ylabel(axis_label(column, unit))
    return artists
