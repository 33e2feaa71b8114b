"""Bifurcation diagrams, orbits in the phase plane, multipliers in the complex plane.

Stable stretches are solid, unstable dashed, undetermined dotted (`plots.style`), so that a grey print tells them apart;
special points carry one marker per kind and their label. Nothing here touches pyplot's state except to make a new
figure where no axes are given.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..words import Kind, Verdict
from .curves import smooth_pieces
from .labels import write_label
from .style import SERIES, axis_label, line, marker

if TYPE_CHECKING:
    from ..results.branch import Branch, Segment
    from ..results.solutions import PeriodicOrbit
    from ..results.special import SpecialPoint

__all__ = ["plot_branch", "plot_multipliers", "plot_orbit"]

Array = NDArray[np.float64]


_PARENT = "parent's"  # names of ends on a parent's special point begin with it


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots()[1]


def _default_column(branch: Branch) -> str:
    """Of a curve of special points the second parameter, else the first maximum, else the first measure there is."""
    names = [n for n in branch.columns if n not in (branch.name, "arclength", "residual")]
    if not names:
        raise InputError("this branch has no columns besides its parameter")
    if branch.method.get("problem") == "Locus":
        return names[0]
    return next((n for n in names if n.endswith(".max")), names[0])


def plot_branch(
    branch: Branch,
    ax: Any = None,
    y: str | None = None,
    x: str | None = None,
    *,
    color: str | None = None,
    labels: bool = True,
    kinds: tuple[Kind, ...] | None = None,
    smooth: bool = True,
    **style: Any,
) -> list[Any]:
    """Draw a column of a branch over its parameter.

    Parameters
    ----------
    branch : Branch
    ax : Axes or None
        Where to draw; None makes a new figure.
    y, x : str or None
        Columns; by default the first maximum (or the first state) over the continued parameter.
    color : str or None
        Of the line and the markers.
    labels : bool
        Write the labels (LP1, PD1, ...) beside the markers.
    kinds : tuple of Kind or None
        Which special points to mark; None marks all but the points asked for by value.
    smooth : bool
        Cubics between the points (see `curves`); False draws straight lines from point to point.
    **style
        Passed on to ``Axes.plot`` of the lines; a ``label`` names the first stable stretch (or the first).

    Returns
    -------
    list of artists
        Lines, then markers, then labels.

    Raises
    ------
    UnknownNameError
        No such column.
    """
    ax = _axes(ax)
    y = _default_column(branch) if y is None else y
    x = branch.name if x is None else x
    abscissa, ordinate = branch.columns[x], branch.columns[y]
    color = SERIES[0] if color is None else color
    artists: list[Any] = []
    segments, legend = branch.segments(), style.pop("label", None)
    named = next((k for k, s in enumerate(segments) if s.verdict is Verdict.STABLE), 0)
    rates = branch.rates if x == branch.name else None
    pieces = smooth_pieces(abscissa, ordinate, rates) if smooth else None
    for k, segment in enumerate(segments):
        part = _part(abscissa, ordinate, pieces, segment)
        look = {**line(segment.verdict), "color": color, **style}
        artists += ax.plot(*part, label=legend if k == named else None, **look)
    for index, point in _marked(branch, kinds):
        place = (float(abscissa[index]), float(ordinate[index]))
        artists += ax.plot([place[0]], [place[1]], zorder=3, **marker(point.kind, color))
        if labels:
            below = point.name.startswith(_PARENT)
            artists.append(write_label(ax, point.name or point.label, place, color, below))
    ax.set_xlabel(axis_label(x))
    ax.set_ylabel(axis_label(y))
    return artists


def _part(x: Array, y: Array, pieces: list[Array] | None, segment: Segment) -> Array:
    """(2, k) of the line over a segment."""
    own = [] if pieces is None else pieces[segment.start : segment.stop - 1]
    if not own:
        return np.array([x[segment.start : segment.stop], y[segment.start : segment.stop]])
    return np.concatenate([own[0], *(piece[:, 1:] for piece in own[1:])], axis=1)


def _marked(branch: Branch, kinds: tuple[Kind, ...] | None) -> Iterator[tuple[int, SpecialPoint]]:
    """(index, special point) of those that are drawn: all but values asked for, or those of some kinds."""
    for index, mark in enumerate(branch.marks.tolist()):
        if mark < 0:
            continue
        point = branch.special[mark]
        if (point.kind is not Kind.USER or bool(point.name)) if kinds is None else point.kind in kinds:
            yield index, point


def plot_orbit(
    orbit: PeriodicOrbit, ax: Any = None, x: str | None = None, y: str | None = None, **style: Any
) -> list[Any]:
    """Draw a periodic orbit in the phase plane of two states (by default the first coordinate and its velocity).

    Returns
    -------
    list of artists
    """
    ax = _axes(ax)
    states = orbit.states
    x = states[0] if x is None else x
    if y is None:
        y = f"{x}_dot" if f"{x}_dot" in states else states[1 % len(states)]
    for name in (x, y):
        if name not in states:
            raise unknown_name("state", name, states, "this orbit")
    times = np.linspace(0.0, orbit.period, max(400, 2 * orbit.t.size))
    values = orbit(times)
    look = {**line(orbit.verdict), "color": SERIES[0], **style}
    artists = ax.plot(values[states.index(x)], values[states.index(y)], **look)
    ax.set_xlabel(axis_label(x))
    ax.set_ylabel(axis_label(y))
    return list(artists)


def plot_multipliers(branch: Branch, ax: Any = None, *, limit: float = 3.0, **style: Any) -> list[Any]:
    """Draw the multipliers (or eigenvalues) of a branch in the complex plane, with the limit of stability.

    Parameters
    ----------
    limit : float
        Multipliers of larger modulus are not drawn (an unstable orbit's reach 1e5).

    Returns
    -------
    list of artists
        The stability limit, the values of all points, the critical ones of special points with their markers.
    """
    ax = _axes(ax)
    values = branch.values
    circle = _is_circle(branch)
    if circle:
        angle = np.linspace(0, 2 * np.pi, 361)
        artists = list(ax.plot(np.cos(angle), np.sin(angle), color=SERIES[-1], linewidth=0.8))
        shown = np.where(np.abs(values) <= limit, values, np.nan)
        ax.set_aspect("equal", adjustable="datalim")
    else:
        artists = [ax.axvline(0.0, color=SERIES[-1], linewidth=0.8)]
        shown = values
    look = {"linestyle": "none", "marker": ".", "markersize": 3, "color": SERIES[0], **style}
    artists += ax.plot(shown.real.ravel(), shown.imag.ravel(), **look)
    for point in branch.special:
        if point.kind is Kind.USER:
            continue
        critical = _critical(point, circle)
        artists += ax.plot(critical.real, critical.imag, zorder=3, **marker(point.kind, SERIES[2]))
    what = "multipliers" if circle else "eigenvalues"
    ax.set_xlabel(f"real part of {what}")
    ax.set_ylabel("imaginary part")
    return artists


def _critical(point: SpecialPoint, circle: bool) -> NDArray[np.complex128]:
    """The value or the pair that is critical at a special point; all of them where its kind does not tell."""
    values = point.multipliers
    if point.kind in (Kind.NEIMARK_SACKER, Kind.HOPF):
        upper = values[values.imag > 0]
        distance = np.abs(np.abs(upper) - 1) if circle else np.abs(upper.real)
        nearest = upper[np.argsort(distance)[:1]]
        return np.concatenate([nearest, nearest.conj()])
    places = {Kind.FOLD: float(circle), Kind.BRANCH_POINT: float(circle), Kind.PERIOD_DOUBLING: -1.0}
    if point.kind not in places:
        return values
    return values[np.argsort(np.abs(values - places[point.kind]))[:1]]


def _is_circle(branch: Branch) -> bool:
    """Whether the values are multipliers: stored with the method, so that no solver is needed."""
    return bool(branch.method.get("circle", True))
