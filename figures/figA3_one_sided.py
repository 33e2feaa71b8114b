"""Figure A3: the one-sided magnetic spring, swept at 0.5 g, and the same with a hard stop.

Parameters: h0 = 1.1 mm, d/m = 20 1/s, m = 20 g [chosen]; 50 periods a point, 5 recorded. Checked: folds of
continuation at 17.420 Hz and 22.781 Hz, largest peak to peak 3.654 mm at 17.53 Hz (the 3.65 mm of the chapter is peak
to peak: free motion over a one-sided spring obeys f <= 1/(2 sqrt(2 H/g))), a smooth superharmonic of about 1 mm near
13.6 Hz; the sweeps jump behind the folds. With a stop of restitution 0.7 at y = 1.5 mm the peak is cut off; the sweep
down touches it where the free response does (grazing, 24.25 Hz), the impacting motion of the sweep up lives on to
32.7 Hz.
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

STOP = 1.5e-3


def compute() -> dict[str, Any]:
    """Sweeps both ways, free and with the stop, and the branch."""
    system = st.models.one_sided_magnet.from_physical()
    stopped = system.replace(stops=(st.HardStop("y", STOP, 1, 0.7),))
    data: dict[str, Any] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.UnsettledWarning)  # open markers show those points
        for name, which, window in (
            ("up", system, (8.0, 35.0)), ("down", system, (35.0, 8.0)),
            ("stopped up", stopped, (8.0, 35.0)), ("stopped down", stopped, (35.0, 8.0)),
        ):  # fmt: skip
            data[name] = st.sweep(which, "frequency", window, step=0.25)
    data["branch"] = st.continuation(st.Collocation(system), "frequency", (8.0, 35.0), ds_max=0.05)
    return data


def check(data: dict[str, Any]) -> None:
    """Folds, peak and superharmonic of the catalogue; jumps behind the folds; the stop holds."""
    branch = data["branch"]
    low, high = sorted(p.params["frequency"] for p in branch.special)
    assert abs(low - 17.420) < 5e-4 and abs(high - 22.781) < 5e-4
    size = 1e3 * (branch.columns["y.max"] - branch.columns["y.min"])
    top = size.argmax()
    assert abs(size[top] - 3.654) < 1e-3 and abs(branch.parameter[top] - 17.53) < 0.03
    near = (branch.parameter > 12.5) & (branch.parameter < 14.5) & (size < 1.5)
    assert abs(size[near].max() - 1.0) < 0.1 and abs(branch.parameter[near][size[near].argmax()] - 13.6) < 0.3
    (upward,), downward = data["up"].jumps, data["down"].jumps[-1]
    assert 0 < upward.bracket[1] - high < 0.1 and 0 < low - downward.bracket[1] < 0.05
    for name in ("stopped up", "stopped down"):
        assert data[name].high[:, 0].max() <= STOP * (1 + 1e-12)
        run = data[name]
        for k in np.nonzero((run.high[:, 0] < 0.999 * STOP) & run.settled)[0]:  # no contact: the free response
            level = nearest(branch, "y.max", run.parameter[k], run.high[k, 0])
            assert abs(run.high[k, 0] / level - 1) < 0.01
    # contact begins where the free response touches the stop: y.max = 1.5 mm above the upper fold
    above, top = branch.parameter > 23.5, branch.columns["y.max"]
    grazing = float(np.interp(-STOP, -top[above], branch.parameter[above]))
    assert abs(data["stopped down"].jumps[0].parameter - grazing) < 0.01


def draw(data: dict[str, Any], path: Path) -> None:
    """Response without and with the stop."""
    figure, axes = _figure.panels(2, width=7.2, height=3.1, sharey=True)
    branch = data["branch"]
    size = 1e3 * (branch.columns["y.max"] - branch.columns["y.min"])
    for axis, prefix in ((axes[0], ""), (axes[1], "stopped ")):
        for part in branch.segments():
            points = slice(part.start, part.stop)
            look = style.line(part.verdict) | (dict(linewidth=0.8) if prefix else {})
            axis.plot(branch.parameter[points], size[points], **look,
                      color=style.COLOURS["grey"] if prefix else style.SERIES[0],
                      label="continuation, free" if part.start == 0 else None)
        plot_sweep(data[f"{prefix}up"], ax=axis, y="y_mm.pp", label="sweep up")
        plot_sweep(data[f"{prefix}down"], ax=axis, y="y_mm.pp", label="sweep down")
        axis.set(xlabel="$f$ (Hz)", xlim=(8, 35), ylim=(0, 4.1))
    for mark in np.nonzero(branch.marks >= 0)[0]:
        axes[0].plot(branch.parameter[mark], size[mark], **style.marker(st.Kind.FOLD))
    axes[0].annotate("17.420 Hz, 3.65 mm", (17.42, 3.65), xytext=(18.6, 3.72), fontsize="small")
    axes[0].annotate("22.781 Hz", (22.781, 0.95), xytext=(24.3, 0.25), fontsize="small",
                     arrowprops=dict(arrowstyle="-", linewidth=0.5, shrinkB=4))
    axes[0].set_ylabel("$y$ peak to peak (mm)")
    axes[1].set_ylabel("")
    axes[1].legend(frameon=False, fontsize="small")
    _figure.letter(axes[0], "(a) one-sided magnet, 0.5 g")
    _figure.letter(axes[1], "(b) with a stop at 1.5 mm, $e = 0.7$")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
