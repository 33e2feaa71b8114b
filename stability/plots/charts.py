"""Pictures of stability charts: filled by growth rate or by class, with boundary curves and tongue orders.

The unstable part is filled with a colour that darkens with the growth rate (the scale is capped so that deep
instability does not wash out the tongues); the stable part stays white. Boundary curves come from the chart as exact
curves, not as contours of pixels; their line style says how the multiplier leaves the unit circle. The order of a
tongue stands at its tip, or inside the tongue next to its root where there is no damping.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..words import Verdict
from .style import ABOVE, GROWTH_MAP, VERDICT_FILLS, axis_label, boundary_line

if TYPE_CHECKING:
    from ..results.chart import StabilityChart

__all__ = ["plot_chart"]

_MEANING = {"+1": r"$\mu=+1$", "-1": r"$\mu=-1$", "pair": "complex pair"}


def plot_chart(
    chart: StabilityChart, kind: str = "growth_rate", *, ax: Any = None, boundaries: bool = True, orders: bool = True,
    colorbar: bool = True, legend: bool = True, vmax: float | None = None,
) -> Any:  # fmt: skip
    """Draw a stability chart.

    Parameters
    ----------
    chart : StabilityChart
    kind : "growth_rate" or "class"
        What the areas show.
    ax : matplotlib Axes, optional
        Drawn into; a new figure is made if missing.
    boundaries, orders, colorbar, legend : bool
        What is drawn besides the areas.
    vmax : float, optional
        Growth rate at which the colour scale ends; by default the 98 % point of the unstable growth rates.

    Returns
    -------
    matplotlib Axes

    Examples
    --------
    >>> import stability as st
    >>> tongues = st.chart(st.models.mathieu(delta=0.05), x=("a", -0.5, 2.5), y=("b", 0, 2), shape=(60, 40))
    >>> plot_chart(tongues).get_xlabel()
    '$a$'
    """
    if kind not in ("growth_rate", "class"):
        raise InputError(f"kind = {kind!r}; a chart is drawn by 'growth_rate' or by 'class'")
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(6.0, 4.2), layout="constrained").add_subplot()
    mesh = _fill_growth(chart, ax, vmax) if kind == "growth_rate" else _fill_class(chart, ax)
    if colorbar and kind == "growth_rate" and mesh is not None:
        ax.figure.colorbar(mesh, ax=ax, label="growth rate (1/time)", pad=0.02, extend="max")
    if boundaries:
        _draw_boundaries(chart, ax, legend)
    if orders:
        _label_orders(chart, ax)
    ax.set(xlabel=axis_label(chart.x_name), ylabel=axis_label(chart.y_name))
    ax.set(xlim=(chart.x[0], chart.x[-1]), ylim=(chart.y[0], chart.y[-1]))
    return ax


def _extent(chart: StabilityChart) -> tuple[float, float, float, float]:
    """Outer edges of the cells around the grid points."""
    dx, dy = 0.5 * (chart.x[1] - chart.x[0]), 0.5 * (chart.y[1] - chart.y[0])
    return chart.x[0] - dx, chart.x[-1] + dx, chart.y[0] - dy, chart.y[-1] + dy


def _fill_growth(chart: StabilityChart, ax: Any, vmax: float | None) -> Any:
    """Unstable growth rates as an image; None if there are none."""
    unstable = np.asarray(chart.verdict == Verdict.UNSTABLE)
    shown = np.ma.masked_where(~unstable, chart.growth_rate)
    if not unstable.any():
        return None
    top = float(np.percentile(shown.compressed(), 98.0)) if vmax is None else vmax
    return ax.imshow(
        shown, origin="lower", extent=_extent(chart), aspect="auto", cmap=GROWTH_MAP, vmin=0.0, vmax=max(top, 1e-300),
        interpolation="nearest", rasterized=True,
    )  # fmt: skip


def _fill_class(chart: StabilityChart, ax: Any) -> Any:
    """Verdicts as plain colours."""
    from matplotlib.colors import ListedColormap

    colours = ListedColormap([VERDICT_FILLS[Verdict(word)] for word in chart.verdict.words])
    return ax.imshow(
        chart.verdict.codes, origin="lower", extent=_extent(chart), aspect="auto", cmap=colours,
        vmin=-0.5, vmax=len(chart.verdict.words) - 0.5, interpolation="nearest", rasterized=True,
    )  # fmt: skip


def _draw_boundaries(chart: StabilityChart, ax: Any, legend: bool) -> None:
    named: set[str] = set()
    for curve in chart.boundaries:
        label = None if curve.kind in named else _MEANING.get(curve.kind, curve.kind)
        named.add(curve.kind)
        ax.plot(curve.x, curve.y, label=label, **boundary_line(curve.kind))
    if legend and len(named) > 1:
        ax.legend(**ABOVE)


def _label_orders(chart: StabilityChart, ax: Any) -> None:
    """The order of each tongue below its tip, or where a pair of boundary curves meets the lower edge."""
    from matplotlib.patheffects import withStroke

    height, width = chart.y[-1] - chart.y[0], chart.x[-1] - chart.x[0]
    halo = [withStroke(linewidth=2.5, foreground="white")]
    style = {"ha": "center", "fontsize": "small", "clip_on": True, "path_effects": halo}
    done = set()
    for tip in chart.tips:
        if tip.order is not None and tip.order not in done:
            done.add(tip.order)
            low = tip.y - 0.02 * height < chart.y[0] + 0.03 * height
            y = tip.y + 0.05 * height if low else tip.y - 0.015 * height
            ax.text(tip.x, y, str(tip.order), va="bottom" if low else "top", **style)
    roots: dict[int, list[float]] = {}
    for curve in chart.boundaries:
        if curve.order is not None and curve.order not in done:
            ends = [curve.x[i] for i in (0, -1) if abs(curve.y[i] - chart.y[0]) < 1e-9 * height]
            roots.setdefault(curve.order, []).extend(ends)
    for order, ends in roots.items():
        if ends and order > 0 and abs(np.mean(ends) - 0.5 * (chart.x[0] + chart.x[-1])) < 0.5 * width:
            ax.text(float(np.mean(ends)), chart.y[0] + 0.02 * height, str(order), va="bottom", **style)
