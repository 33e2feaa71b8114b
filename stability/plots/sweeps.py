"""Sweeps, alone or over the branches of another method.

Points of a carried sweep are triangles that point in its direction, those of a sweep from rest small squares; filled
where the response has settled, open where it has not. A jump is a dotted line from the response
before to the response behind it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, unknown_name
from .style import SERIES, axis_label

if TYPE_CHECKING:
    from ..results.sweep import Sweep

__all__ = ["plot_sweep"]

_MEASURES = ("max", "min", "pp", "mean", "amplitude", "phase", "section")


def _measured(sweep: Sweep, name: str, measure: str) -> np.ndarray:
    columns = {
        "max": sweep.maximum, "min": sweep.minimum, "pp": sweep.peak_to_peak, "mean": sweep.mean,
        "amplitude": sweep.amplitude(), "phase": sweep.phase(), "section": sweep.section,
    }  # fmt: skip
    if measure not in columns:
        raise InputError(f"measure '{measure}'; a sweep has {', '.join(_MEASURES)} of every state and output")
    if measure == "section" and name not in sweep.states:
        raise unknown_name("state", name, sweep.states, "the section of this sweep")
    return np.asarray(columns[measure][name])


def plot_sweep(
    sweep: Sweep, ax: Any = None, y: str | None = None, *, factor: float = 1.0, color: str | None = None,
    jumps: bool = True, **style: Any,
) -> list[Any]:  # fmt: skip
    """Draw one measure of a sweep over its parameter.

    Parameters
    ----------
    sweep : Sweep
    ax : matplotlib Axes, optional
    y : state or output with a measure, such as "y.max", "y.pp", "y_mm.amplitude"; default the first state's maximum;
        "y.section" draws the stroboscopic points of all recorded periods, a bifurcation diagram
    factor : the values are multiplied by it (1000 for mm)
    color : of points and jumps; by the direction if missing
    jumps : whether jumps are drawn
    **style : of the points

    Returns
    -------
    list of artists

    Raises
    ------
    InputError, UnknownNameError

    Examples
    --------
    >>> import stability as st
    >>> up = st.sweep(st.models.duffing(xi=0.05, beta=0.0), "Omega", (0.8, 1.2), step=0.1)
    >>> len(plot_sweep(up, y="u.amplitude"))
    1
    """
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(6.0, 4.0), layout="constrained").add_subplot()
    y = f"{sweep.states[0]}.max" if y is None else y
    name, dot, measure = y.rpartition(".")
    if not dot:
        name, measure = y, "max"
    values = factor * _measured(sweep, name, measure)
    upward = sweep.window[1] > sweep.window[0]
    color = SERIES[2 if upward else 4] if color is None else color
    look: dict[str, Any] = {
        "linestyle": "none", "marker": "s" if sweep.start == "rest" else ">" if upward else "<",
        "markersize": 2.6 if sweep.start == "rest" else 4.0, "color": color, "markeredgewidth": 0.7, **style,
    }  # fmt: skip
    settled = sweep.settled
    if measure == "section":
        dots = {**look, "marker": ".", "markersize": 1.5, "markeredgewidth": 0.0, **style}
        ax.set_xlabel(axis_label(sweep.name, sweep.units.get(sweep.name, "")))
        ax.set_ylabel(axis_label(name, sweep.units.get(name, "") if factor == 1.0 else ""))
        return list(ax.plot(np.repeat(sweep.parameter, values.shape[1]), values.ravel(), **dots))
    artists = list(ax.plot(sweep.parameter[settled], values[settled], **look))
    if not settled.all():
        open_look = {**look, "markerfacecolor": "white", "label": None}
        artists += ax.plot(sweep.parameter[~settled], values[~settled], **open_look)
    if jumps and measure in ("max", "min", "pp"):
        direction = 1 if upward else -1
        for k, jump in enumerate(sweep.jumps):
            before, after = (factor * _of(side[name], measure) for side in (jump.before, jump.after))
            beyond = settled & ((sweep.parameter - jump.bracket[1]) * direction >= 0)
            if k + 1 < len(sweep.jumps):  # and behind the next one it is another motion
                beyond &= (sweep.parameter - sweep.jumps[k + 1].bracket[0]) * direction <= 0
            if beyond.any():  # right behind the jump the motion is still on its way
                after = values[int(np.argmax(beyond))]
            artists += ax.plot([jump.parameter] * 2, [before, after], ":", color=color, linewidth=1.0)
    unit = sweep.units.get(name, "") if factor == 1.0 else ""
    ax.set_xlabel(axis_label(sweep.name, sweep.units.get(sweep.name, "")))
    ax.set_ylabel(axis_label(f"{name}.{'peak to peak' if measure == 'pp' else measure}", unit))
    return artists


def _of(bounds: tuple[float, float], measure: str) -> float:
    low, high = bounds
    return {"max": high, "min": low, "pp": high - low}[measure]
