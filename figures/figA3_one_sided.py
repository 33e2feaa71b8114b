"""Figure A3: the one-sided magnetic spring, swept at 0.5 g, and the same with a hard stop.

Parameters: h0 = 1.1 mm, d/m = 20 1/s, m = 20 g [chosen]; 50 periods a point, 5 recorded. Checked: folds of
continuation at 17.420 Hz and 22.781 Hz, largest peak to peak 3.654 mm at 17.53 Hz (the 3.65 mm of the chapter is peak
to peak: free motion over a one-sided spring obeys f <= 1/(2 sqrt(2 H/g))), a smooth superharmonic of about 1 mm near
13.6 Hz; the sweeps jump behind the folds. With a stop of restitution 0.7 at y = 1.5 mm the peak is cut off; the sweep
down touches it where the free response does, the impacting motion of the sweep up lives on to 32.7 Hz: continuation
of the impact orbits has grazing points at 24.2459 Hz and 20.3385 Hz, a period doubling at 26.076 Hz and a fold at
32.7025 Hz, and the sweeps, carried on for 30 periods, hit the stop with the speeds of its stable part.
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
    quiet = st.continuation(st.Shooting(stopped), "frequency", (35.0, 8.0), ds_max=0.05)
    data["quiet"] = quiet
    data["knocking"] = st.continuation(st.switch(quiet["GR1"]), "frequency", (8.0, 35.0), ds_max=0.05)
    for name in ("stopped up", "stopped down"):
        data[f"{name}, speeds"] = [impact_speeds(stopped, f, x) for f, x in zip(data[name].parameter, data[name].ends)]
    return data


def impact_speeds(system: Any, frequency: float, state: np.ndarray) -> np.ndarray:
    """Speeds of all impacts within 30 periods from the end of a dwell."""
    run = st.simulate(system, (0.0, 30 / frequency), x0=state, frequency=frequency)
    return np.array([event.before[1] for event in run.events if event.kind == "impact"])


def highest(s: np.ndarray, size: np.ndarray, parameter: np.ndarray) -> tuple[float, float]:
    """The largest size along a branch and where it is, by polynomials through five points."""
    top = size.argmax()
    near = slice(top - 2, top + 3)
    along = np.linspace(s[near][0], s[near][-1], 1001) - s[top]
    sizes, places = (np.polyval(np.polyfit(s[near] - s[top], y[near], 4), along) for y in (size, parameter))
    return float(sizes.max()), float(places[sizes.argmax()])


def check(data: dict[str, Any]) -> None:
    """Folds, peak and superharmonic of the catalogue; jumps behind the folds; the stop holds."""
    branch = data["branch"]
    low, high = sorted(p.params["frequency"] for p in branch.special)
    assert abs(low - 17.420) < 5e-4 and abs(high - 22.781) < 5e-4
    size = 1e3 * (branch.columns["y.max"] - branch.columns["y.min"])
    peak, place = highest(branch.arclength, size, branch.parameter)
    assert abs(peak - 3.654) < 1e-3 and abs(place - 17.53) < 0.03
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
    check_stop(data)


def check_stop(data: dict[str, Any]) -> None:
    """Grazing where collocation's free orbit has its maximum at the stop; the sweeps against the impact orbits."""
    branch, quiet, knocking = data["branch"], data["quiet"], data["knocking"]
    grazing, end = (quiet["GR1"].params["frequency"], knocking["GR1"].params["frequency"])
    assert abs(grazing - 24.2459) < 5e-5 and abs(end - 20.3385) < 5e-5
    free = [o.max["y"] / STOP for f in (grazing, end) for o in branch.at(frequency=f)]
    assert sum(abs(top - 1) < 1e-7 for top in free) == 2
    assert abs(data["stopped down"].jumps[0].parameter - grazing) < 0.01
    fold = knocking["LP1"].params["frequency"]
    assert abs(fold - 32.7025) < 5e-5 and abs(knocking["PD1"].params["frequency"] - 26.0763) < 5e-5
    assert 0 < data["stopped up"].jumps[-1].bracket[1] - fold < 0.1
    assert (knocking.columns["impacts"] == 1).all()
    met = 0
    for name in ("stopped up", "stopped down"):
        for f, speeds in zip(data[name].parameter, data[f"{name}, speeds"]):
            if speeds.size and f > knocking["PD1"].params["frequency"] + 0.2:
                assert abs(speeds[-1] / nearest(knocking, "impact_speed.max", f, speeds[-1]) - 1) < 0.01
                met += 1
    assert met > 20


def draw(data: dict[str, Any], path: Path) -> None:
    """Response without and with the stop, and the speeds of the impacts."""
    figure, axes = _figure.panels(3, width=7.2, height=2.9)
    branch = data["branch"]
    size = 1e3 * (branch.columns["y.max"] - branch.columns["y.min"])
    for axis, prefix in ((axes[0], ""), (axes[1], "stopped ")):
        for part in branch.segments():
            points = slice(part.start, part.stop)
            look = style.line(part.verdict) | (dict(linewidth=0.8) if prefix else {})
            axis.plot(branch.parameter[points], size[points], **look,
                      color=style.COLOURS["grey"] if prefix else style.SERIES[0],
                      label="continuation" if part.start == 0 else None)
        plot_sweep(data[f"{prefix}up"], ax=axis, y="y_mm.pp", label="sweep up", markersize=2.5)
        plot_sweep(data[f"{prefix}down"], ax=axis, y="y_mm.pp", label="sweep down", markersize=2.5)
        axis.set(xlabel="$f$ (Hz)", xlim=(8, 35), ylim=(0, 4.3))
    for mark in np.nonzero(branch.marks >= 0)[0]:
        axes[0].plot(branch.parameter[mark], size[mark], **style.marker(st.Kind.FOLD))
    axes[0].annotate("17.420 Hz, 3.65 mm", (17.42, 3.65), xytext=(15.5, 3.9), fontsize="small")
    axes[0].annotate("22.781 Hz", (22.781, 0.95), xytext=(24.3, 0.15), fontsize="small",
                     arrowprops=dict(arrowstyle="-", linewidth=0.5, shrinkB=4))
    axes[0].set_ylabel("$y$ peak to peak (mm)")
    axes[1].set_ylabel("")
    axes[1].legend(frameon=False, fontsize="small", loc="upper right")
    draw_impacts(data, axes[2])
    _figure.letter(axes[0], "(a) no stop, 0.5 g")
    _figure.letter(axes[1], "(b) stop at 1.5 mm, $e = 0.7$")
    _figure.letter(axes[2], "(c) impacts")
    _figure.save(figure, path)


def draw_impacts(data: dict[str, Any], axis: Any) -> None:
    """Speeds of the impacts: the sweeps' as dots, the continued orbits with one impact a period as a line."""
    knocking = data["knocking"]
    for name, color in (("stopped up", style.SERIES[2]), ("stopped down", style.SERIES[4])):
        for f, speeds in zip(data[name].parameter, data[f"{name}, speeds"]):
            axis.plot(np.full(speeds.size, f), 1e3 * speeds, ".", color=color, markersize=2.8, markeredgewidth=0.0,
                      zorder=2.6)
    speed = 1e3 * knocking.columns["impact_speed.max"]
    for part in knocking.segments():
        points = slice(part.start, part.stop)
        axis.plot(knocking.parameter[points], speed[points], **style.line(part.verdict), color=style.SERIES[0])
    places = {"LP1": (-28, 3), "PD1": (3, -12), "GR1": (3, 5)}
    for mark in np.nonzero(knocking.marks >= 0)[0]:
        special = knocking.special[knocking.marks[mark]]
        axis.plot(knocking.parameter[mark], speed[mark], **style.marker(special.kind), clip_on=False)
        axis.annotate(special.label, (knocking.parameter[mark], speed[mark]), xytext=places[special.label],
                      textcoords="offset points", fontsize="small")
    grazing = data["quiet"]["GR1"]
    axis.plot(grazing.params["frequency"], 0.0, **style.marker(grazing.kind), clip_on=False)
    axis.set(xlabel="$f$ (Hz)", ylabel="impact speed (mm/s)", xlim=(18, 35), ylim=(0, 108))


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
