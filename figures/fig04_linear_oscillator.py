"""Figure 4: the linear oscillator on a moving base, U/Y0 = -s^2/(1 + 2 xi s + s^2): Bode plot and magnitude.

Parameters: xi = 0.02, 0.05, 0.1, 0.2, 0.5 [chosen; the chapter gives none]. Checked: peak 1/(2 xi sqrt(1 - xi^2)) at
Omega = 1/sqrt(1 - 2 xi^2); the phase starts at zero for the corrected sign of (24) and ends at -180 degrees; (25) as
printed, |Om^2/(1 + Om^2 + 2j xi Om)|, has no resonance at all.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

XI = (0.02, 0.05, 0.1, 0.2, 0.5)


def compute() -> dict[str, Any]:
    """Responses and peaks for each damping ratio."""
    Omega = np.unique(np.concatenate([np.geomspace(0.1, 10, 1500), np.linspace(0.8, 1.3, 1501)]))
    responses = {xi: st.linear_response(st.models.linear_oscillator(xi=xi)) for xi in XI}
    return {
        "Omega": Omega,
        "u": {xi: r.frequency_response(Omega, "u") for xi, r in responses.items()},
        "peaks": {xi: r.peaks("u") for xi, r in responses.items()},
    }


def check(data: dict[str, Any]) -> None:
    """Peaks and phases against the closed forms."""
    for xi, peaks in data["peaks"].items():
        ((where, height),) = peaks
        assert abs(where - 1 / np.sqrt(1 - 2 * xi**2)) < 1e-10
        assert abs(height - 1 / (2 * xi * np.sqrt(1 - xi**2))) < 1e-9 * height
        phase = np.degrees(np.unwrap(np.angle(data["u"][xi])))
        assert abs(phase[0]) < 10 and abs(phase[-1] + 180) < 10
    Omega = data["Omega"]
    printed = Omega**2 / np.abs(1 + Omega**2 + 2j * 0.05 * Omega)
    assert printed.max() < 1.0  # equation (25) as printed never resonates


def draw(data: dict[str, Any], path: Path) -> None:
    """Bode plot on the left, magnitude on the right."""
    figure, axes = _figure.panels(2, 2, width=7.2, height=4.4, height_ratios=(2, 1))
    (magnitude, upper), (phase, lower) = axes
    grid = upper.get_gridspec()
    upper.remove()
    lower.remove()
    right = figure.add_subplot(grid[:, 1])
    dashes = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
    for xi, color, dash in zip(XI, style.SERIES, dashes):
        line = dict(color=color, linestyle=dash, label=rf"$\xi = {xi:g}$", linewidth=1.4)
        magnitude.plot(data["Omega"], np.abs(data["u"][xi]), **line)
        phase.plot(data["Omega"], np.degrees(np.unwrap(np.angle(data["u"][xi]))), **line)
        right.plot(data["Omega"], np.abs(data["u"][xi]), **line)
    magnitude.set(xscale="log", yscale="log", ylabel=r"$|U/Y_0|$", xlim=(0.1, 10), ylim=(5e-3, 50))
    magnitude.tick_params(labelbottom=False)
    phase.set(xscale="log", xlabel=r"$\Omega$", ylabel="phase (deg)", xlim=(0.1, 10), yticks=(-180, -90, 0))
    right.set(xlabel=r"$\Omega$", ylabel=r"$|U/Y_0|$", xlim=(0, 3), ylim=(0, 12))
    right.text(1.06, 11.6, "25 for $\\xi = 0.02$", va="top", fontsize="small")
    right.legend(frameon=False, loc="center right", fontsize="small")
    _figure.letter(magnitude, "(a)")
    _figure.letter(right, "(b)")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
