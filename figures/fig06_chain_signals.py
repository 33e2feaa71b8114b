"""Figure 6 (right): frequency response of the chain from time signals, largest and smallest of the last 5 periods.

Parameters as on the left: xi1 = xi2 = 0.021, mass ratio 0.5, Omega0 = 1 and 5; 50 periods a point from the state
before, the last 5 recorded [given]. Checked: every settled point lies on the transfer function within the reported
transient, points that have not settled are marked, and four times as many periods bring them onto it.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style
from stability.plots.sweeps import plot_sweep


def compute() -> dict[str, Any]:
    """Sweeps of both tunings, and the closed form."""
    data: dict[str, Any] = {}
    for Omega0 in (1.0, 5.0):
        system = st.models.chain(Omega0=Omega0)
        response = st.linear_response(system)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", st.errors.UnsettledWarning)  # open markers show those points
            data[Omega0, 50] = st.sweep(system, "Omega", (0.3, 2.0), step=0.02)
            data[Omega0, 200] = st.sweep(system, "Omega", (0.3, 2.0), step=0.1, periods=200)
        data[Omega0, "Omega"] = Omega = np.linspace(0.3, 2.0, 1000)
        for name in "uv":
            data[Omega0, name] = np.abs(response.frequency_response(Omega, name))
        data[Omega0, "response"] = response
    return data


def check(data: dict[str, Any]) -> None:
    """Amplitudes from the signals against the transfer function."""
    for Omega0 in (1.0, 5.0):
        for periods in (50, 200):
            run = data[Omega0, periods]
            for name in "uv":
                exact = np.abs(data[Omega0, "response"].frequency_response(run.parameter, name))
                off = np.abs(run.peak_to_peak[name] / 2 / exact - 1)
                assert (off[run.settled] < 0.02).all(), (Omega0, periods, name, off.max())
        assert data[Omega0, 200].settled.all() and len(data[Omega0, 50]) == 86


def draw(data: dict[str, Any], path: Path) -> None:
    """Both masses, one axes each."""
    figure, axes = _figure.panels(2, width=7.2, height=3.1, sharey=True)
    for axis, name in zip(axes, "uv"):
        for Omega0, color, dash in ((1.0, style.SERIES[0], "-"), (5.0, style.COLOURS["vermilion"], "--")):
            axis.plot(data[Omega0, "Omega"], data[Omega0, name], dash, color=color, linewidth=1.0,
                      label=rf"$\Omega_0 = {Omega0:g}$")
            plot_sweep(data[Omega0, 50], ax=axis, y=f"{name}.max", color=color, jumps=False, marker="o", markersize=2.4,
                       label="last 5 of 50 periods" if Omega0 == 1 else None)
        axis.set(xlabel=r"$\Omega$", xlim=(0.3, 2.0), yscale="log", ylim=(0.05, 70), ylabel="")
    axes[0].set_ylabel("displacement over base amplitude")
    axes[0].legend(frameon=False, fontsize="small")
    _figure.letter(axes[0], "(a) first mass")
    _figure.letter(axes[1], "(b) second mass")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
