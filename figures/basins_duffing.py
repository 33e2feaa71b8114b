"""Basins of attraction of figure 11's oscillator at 25 Hz, between its folds: small and large vibration.

Initial displacement and velocity at phase 0; the other parameters as in figure 11. Checked: the two attractors are
the two stable orbits of the continued branch; the unstable orbit between them, from continuation too, lies on the
boundary of the basins: motions that start a little to either side along its unstable direction end on different
attractors.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

FREQUENCY = 25.0


def compute() -> dict[str, Any]:
    """Basins, and the three orbits at 25 Hz."""
    system = st.models.duffing.from_physical(frequency=FREQUENCY)
    basins = st.basins(system, x=("y", -6e-3, 6e-3), y=("y_dot", -0.8, 0.8), shape=(120, 96))
    branch = st.continuation(st.Collocation(system), "frequency", (20.0, 30.0), at=(FREQUENCY,))
    return {"system": system, "basins": basins, "orbits": branch.at(frequency=FREQUENCY)}


def ends(data: dict[str, Any]) -> list[int]:
    """Attractors of two motions that start on both sides of the unstable orbit."""
    system, basins = data["system"], data["basins"]
    saddle = next(o for o in data["orbits"] if o.verdict is st.Verdict.UNSTABLE)
    T, x = saddle.period, saddle(0.0)
    matrix = st.monodromy(system, about=saddle).matrix
    values, vectors = np.linalg.eig(matrix)
    direction = vectors[:, np.abs(values).argmax()].real
    step = 1e-2 * direction * np.linalg.norm(x) / np.linalg.norm(direction)
    both = st.simulate(system, (0, 300 * T), x0=np.column_stack([x + step, x - step])).final
    points = np.array([a.points[0] for a in basins.attractors])
    scale = np.abs(points).max(axis=0)
    return [int(np.abs((points - end) / scale).max(axis=1).argmin()) for end in both.T]


def check(data: dict[str, Any]) -> None:
    """Attractors and boundary against the orbits of continuation."""
    basins, orbits = data["basins"], data["orbits"]
    stable = np.array([o(0.0) for o in orbits if o.verdict is st.Verdict.STABLE])
    assert len(stable) == len(basins.attractors) == 2 and basins.undecided == basins.escaped == 0
    for attractor in basins.attractors:
        off = np.abs(stable - attractor.points[0]) / np.abs(stable).max(axis=0)
        assert off.max(axis=1).min() < 5e-3 and attractor.multiple == 1
    assert sorted(ends(data)) == [0, 1]


def draw(data: dict[str, Any], path: Path) -> None:
    """The basins with the three orbits' points."""
    figure, axis = _figure.panels(width=4.8, height=4.0)
    basins = data["basins"]
    basins.plot(ax=axis, points=False)
    looks = {st.Verdict.STABLE: ("o", "stable"), st.Verdict.UNSTABLE: ("X", "unstable")}
    for orbit in data["orbits"]:
        marker, word = looks[orbit.verdict]
        y, v = orbit(0.0)
        axis.plot(y, v, marker, color=style.COLOURS["black"], markerfacecolor="white", markersize=7)
        axis.annotate(f"{word}, {1e3 * orbit.max['y']:.3f} mm", (y, v), xytext=(7, 5), textcoords="offset points",
                      fontsize="small")
    axis.set(xlabel="$y(0)$ (mm)", ylabel=r"$\dot{y}(0)$ (m/s)")
    axis.set_xticks(np.arange(-6, 7, 2) * 1e-3, labels=[f"{k}" for k in range(-6, 7, 2)])
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
