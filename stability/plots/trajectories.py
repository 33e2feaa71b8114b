"""Motions: over time, in the phase plane, as an amplitude spectrum, as a Poincare section.

A trajectory that ended early is marked with a cross at its last point. Axes in, axes out; nothing touches pyplot.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .style import SERIES, axis_label

if TYPE_CHECKING:
    from ..results.trajectory import Trajectory

__all__ = ["plot_trajectory"]

_KINDS = ("time", "phase", "spectrum", "poincare")


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    from matplotlib.figure import Figure

    return Figure(figsize=(6.0, 3.6), layout="constrained").add_subplot()


def plot_trajectory(
    trajectory: Trajectory, kind: str = "time", *, ax: Any = None, name: str | None = None, x: str | None = None,
    y: str | None = None, section: str | None = None, **style: Any,
) -> Any:  # fmt: skip
    """Draw one motion.

    Parameters
    ----------
    trajectory : Trajectory
    kind : "time", "phase", "spectrum" or "poincare"
    ax : matplotlib Axes, optional
    name : state or output over time, or whose spectrum is drawn; default the first state
    x, y : states or outputs of the phase plane or section; default the first state and its velocity
    section : of a Poincare section, see `Trajectory.poincare`
    **style : of the line

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    InputError, UnknownNameError

    Examples
    --------
    >>> import stability as st
    >>> run = st.simulate(st.models.duffing(), (0, 50))
    >>> plot_trajectory(run, "phase").get_ylabel()
    '$\\\\dot{u}$'
    """
    if kind not in _KINDS:
        raise InputError(f"kind = {kind!r}; a trajectory is drawn by {', '.join(map(repr, _KINDS))}")
    ax = _axes(ax)
    look = {"color": SERIES[0], "linewidth": 0.9, **style}
    states = trajectory.states
    first = states[0] if name is None else name
    x = states[0] if x is None else x
    y = (f"{x}_dot" if f"{x}_dot" in states else states[1 % len(states)]) if y is None else y
    if kind == "time":
        ax.plot(trajectory.t, trajectory[first], **look)
        _end(trajectory, ax, trajectory.t[-1:], trajectory[first][-1:], look)
        ax.set(xlabel=axis_label("t"), ylabel=_label(trajectory, first), xlim=trajectory.span)
    elif kind == "phase":
        ax.plot(trajectory[x], trajectory[y], **look)
        _end(trajectory, ax, trajectory[x][-1:], trajectory[y][-1:], look)
        ax.set(xlabel=_label(trajectory, x), ylabel=_label(trajectory, y))
    elif kind == "spectrum":
        frequency, amplitude = trajectory.spectrum(first)
        ax.semilogy(frequency[1:], np.maximum(amplitude[1:], 1e-300), **look)
        top = float(amplitude.max(initial=1e-300))
        ax.set(xlabel="frequency (cycles per unit time)", ylabel=f"amplitude of {_label(trajectory, first)}")
        ax.set_ylim(1e-6 * top, 2 * top)
    else:
        _section(trajectory, ax, x, y, section, look)
    return ax


def _label(trajectory: Trajectory, name: str) -> str:
    return axis_label(name, trajectory.units.get(name, ""))


def _end(trajectory: Trajectory, ax: Any, x: Any, y: Any, look: dict[str, Any]) -> None:
    if str(trajectory.status) != "completed":
        ax.plot(x, y, "x", color=look["color"], markersize=7)


def _section(trajectory: Trajectory, ax: Any, x: str, y: str, section: str | None, look: dict[str, Any]) -> None:
    if section is None:
        period = trajectory.period
        if period is None:
            raise InputError("a stroboscopic section needs a forcing period: give section=, a state or output")
        t0, t1 = trajectory.span
        times = t0 + period * np.arange(int((t1 - t0) / period * (1 + 1e-12)) + 1)
    else:
        times = trajectory.crossings(section, 0.0, 1)
    points = {**look, "linestyle": "none", "marker": ".", "markersize": 2.5}
    ax.plot(trajectory(times, x), trajectory(times, y), **points)
    ax.set(xlabel=_label(trajectory, x), ylabel=_label(trajectory, y))
