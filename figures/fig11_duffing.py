"""Figure 11: the base-excited Duffing oscillator at 0.5 g: motion at 25 Hz from rest, swept response 5 ... 40 Hz.

Parameters [chosen]: m = 20 g, f1 = 20 Hz, k3 = 1.90e7 N/m3, d = 0.1365 N s/m; gravity off. 50 periods a point, the last
5 recorded [given]; step 0.5 Hz [chosen]. Checked: the sweep jumps at the folds of continuation, 26.998 Hz (4.3016 mm)
and 22.798 Hz, late by the passage only; from rest at 25 Hz the motion settles on the lower branch, 0.562 mm.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import _figure
import numpy as np
from _levels import nearest

import stability as st
from stability.plots import style
from stability.plots.branches import plot_branch
from stability.plots.sweeps import plot_sweep


def compute() -> dict[str, Any]:
    """Motion from rest, sweeps both ways and from rest, the branch of periodic solutions."""
    system = st.models.duffing.from_physical()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.UnsettledWarning)  # open markers show those points
        up = st.sweep(system, "frequency", (5.0, 40.0), step=0.5)
        down = st.sweep(system, "frequency", (40.0, 5.0), step=0.5)
        rest = st.sweep(system, "frequency", (5.0, 40.0), step=0.5, start="rest")
        late = st.sweep(system, "frequency", (20.0, 28.0), step=0.5, periods=400)
    return {
        "motion": st.simulate(system, (0.0, 50 / 25.0), frequency=25.0),
        "up": up, "down": down, "rest": rest, "late": late,
        "branch": st.continuation(st.Collocation(system), "frequency", (5.0, 40.0), ds_max=0.05),
    }  # fmt: skip


def check(data: dict[str, Any]) -> None:
    """Folds of the catalogue; jumps behind the folds, closer with more periods; agreement with the stable branch."""
    low, high = sorted(p.params["frequency"] for p in data["branch"].special)
    assert abs(high - 26.998) < 5e-4 and abs(low - 22.798) < 6e-4
    fold = max(data["branch"].special, key=lambda p: p.params["frequency"])
    assert abs(fold.solution.max["y"] * 1e3 - 4.3016) < 2e-4
    (upward,), (downward,), (late,) = data["up"].jumps, data["down"].jumps, data["late"].jumps
    assert high < upward.bracket[1] < high + 0.05 and low - 0.05 < downward.bracket[1] < low
    assert high < late.bracket[1] <= upward.bracket[1]
    assert abs(data["motion"].last(1).max["y"] * 1e3 - 0.562) < 2e-3
    for run in (data["up"], data["down"]):
        for f, top, settled in zip(run.parameter[1:-1], run.maximum["y"][1:-1], run.settled[1:-1]):
            if settled:
                assert abs(top / nearest(data["branch"], "y.max", f, top) - 1) < 0.01


def draw(data: dict[str, Any], path: Path) -> None:
    """Time, phase plane, response."""
    figure, axes = _figure.panels(2, 2, width=7.2, height=5.2)
    grid = axes[0, 0].get_gridspec()
    for axis in axes[1]:
        axis.remove()
    below = figure.add_subplot(grid[1, :])
    motion = data["motion"]
    axes[0, 0].plot(motion.t, motion["y_mm"], color=style.SERIES[0], linewidth=0.7)
    axes[0, 0].set(xlabel="$t$ (s)", ylabel="$y$ (mm)", xlim=(0, 2))
    axes[0, 1].plot(motion["y_mm"], 1e3 * motion["y_dot"], color=style.COLOURS["grey"], linewidth=0.5)
    last = motion.last(5)
    axes[0, 1].plot(last["y_mm"], 1e3 * last["y_dot"], color=style.SERIES[0], linewidth=1.4)
    axes[0, 1].set(xlabel="$y$ (mm)", ylabel=r"$\dot{y}$ (mm/s)")
    plot_branch(data["branch"], ax=below, y="y_mm.max", color=style.SERIES[0], labels=False, label="continuation")
    for run, label in (("up", "sweep up"), ("down", "sweep down")):
        plot_sweep(data[run], ax=below, y="y_mm.max", label=label)
    plot_sweep(data["rest"], ax=below, y="y_mm.max", color=style.COLOURS["green"], label="from rest", jumps=False)
    for point in data["branch"].special:
        f, top = point.params["frequency"], 1e3 * point.solution.max["y"]
        below.annotate(f"{f:.3f} Hz, {top:.3f} mm", (f, top), xytext=(31, top - 0.1), fontsize="small",
                       arrowprops=dict(arrowstyle="-", linewidth=0.5, shrinkB=4))
    below.set(xlabel="$f$ (Hz)", ylabel=r"$\max\, y$ (mm)", xlim=(5, 40), ylim=(0, 4.7))
    below.legend(frameon=False, fontsize="small", loc="upper left")
    below.set_xticks(np.arange(5, 41, 5))
    _figure.letter(axes[0, 0], "(a) 25 Hz from rest, 50 periods")
    _figure.letter(axes[0, 1], "(b) phase plane, last 5 periods dark")
    _figure.letter(below, "(c) response at 0.5 g")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
