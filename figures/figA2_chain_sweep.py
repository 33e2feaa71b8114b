"""Figure A2: the chain of two masses with cubic springs, swept at 0.5 g: first and second mass, peak to peak.

Parameters: mass ratio 0.5, w1 = w2 = 169 rad/s, xi1 = xi2 = 0.031, k3/m = 1.98e9 for both springs [chosen to fit
A_pp = 7.9 mm at 25.5 Hz, given]; 50 periods a point, 5 recorded. Checked: folds of continuation at 25.514 Hz, 7.906 mm,
and at 21.328 Hz; the sweeps jump behind them, by less than 0.05 Hz; settled points lie on the stable branch.
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
from stability.plots.sweeps import plot_sweep


def compute() -> dict[str, Any]:
    """Sweeps both ways and the branch."""
    w, xi, cubic = 169.0, 0.031, 1.98e9
    system = st.models.chain.from_physical(
        damping1=2 * xi * 0.02 * w, damping2=2 * xi * 0.01 * w, cubic1=cubic * 0.02, cubic2=cubic * 0.01,
        acceleration=0.5 * 9.81,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.UnsettledWarning)  # open markers show those points
        up = st.sweep(system, "frequency", (10.0, 60.0), step=0.5, periods=80)
        down = st.sweep(system, "frequency", (60.0, 10.0), step=0.5, periods=80)
    branch = st.continuation(st.Collocation(system), "frequency", (10.0, 60.0), ds_max=0.05)
    return {"up": up, "down": down, "branch": branch}


def check(data: dict[str, Any]) -> None:
    """Folds and amplitude of the catalogue; jumps behind the folds; both ways on the stable branch."""
    low, high = sorted(data["branch"].special, key=lambda p: p.params["frequency"])
    assert abs(high.params["frequency"] - 25.514) < 5e-4 and abs(low.params["frequency"] - 21.328) < 5e-4
    size = high.solution.max["y1"] - high.solution.min["y1"]
    assert abs(1e3 * size - 7.906) < 1e-3
    upward, downward = data["up"].jumps[0], data["down"].jumps[-1]
    assert 0 < upward.bracket[1] - high.params["frequency"] < 0.05
    assert 0 < low.params["frequency"] - downward.bracket[1] < 0.05
    for run in (data["up"], data["down"]):
        for k in range(1, len(run) - 1):
            top = run.maximum["y1"][k]
            if run.settled[k]:
                assert abs(top / nearest(data["branch"], "y1.max", run.parameter[k], top) - 1) < 0.015


def draw(data: dict[str, Any], path: Path) -> None:
    """First mass and relative motion of the second one, peak to peak."""
    figure, axes = _figure.panels(2, width=7.2, height=3.1)
    branch = data["branch"]
    for axis, name, label in ((axes[0], "y1_mm", "$y_1$"), (axes[1], "relative_mm", "$y_2 - y_1$")):
        size = branch.columns[f"{name}.max"] - branch.columns[f"{name}.min"]
        for part in branch.segments():
            points = slice(part.start, part.stop)
            look = style.line(part.verdict)
            axis.plot(branch.parameter[points], size[points], color=style.SERIES[0], **look,
                      label="continuation" if part.start == 0 else None)
        plot_sweep(data["up"], ax=axis, y=f"{name}.pp", label="sweep up")
        plot_sweep(data["down"], ax=axis, y=f"{name}.pp", label="sweep down")
        for mark in np.nonzero(branch.marks >= 0)[0]:
            axis.plot(branch.parameter[mark], size[mark], **style.marker(st.Kind.FOLD))
        axis.set(xlabel="$f$ (Hz)", ylabel=f"{label} peak to peak (mm)", xlim=(10, 60))
        axis.set_ylim(bottom=0)
    high = max(branch.special, key=lambda p: p.params["frequency"])
    axes[0].annotate("25.514 Hz, 7.906 mm", (high.params["frequency"], 7.906), xytext=(29, 7.6), fontsize="small")
    axes[0].annotate("21.328 Hz", (21.328, 2.56), xytext=(29, 3.4), fontsize="small",
                     arrowprops=dict(arrowstyle="-", linewidth=0.5))
    axes[1].legend(frameon=False, fontsize="small")
    _figure.letter(axes[0], "(a) first mass")
    _figure.letter(axes[1], "(b) second mass, relative")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
