"""Figure 6 (left): transfer functions of the chain of two masses, Omega0 = 1 (solid) and 5 (dashed).

Parameters: xi1 = xi2 = 0.021 [given]; mass ratio 0.50, not the printed 0.42: only 0.50 gives the stated peaks at 0.71,
1.41 and 0.82, 6.1 (product of the undamped frequencies Omega0, sum of their squares 1 + Omega0^2 (1 + lam)). Checked:
the catalogue's peaks, the characteristic polynomial, a direct complex solve. The printed equations load the first mass
only, which swaps the large and the small peak.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

PEAKS = {
    (1.0, "u"): [(0.7072, 22.45), (1.4218, 5.79)],
    (1.0, "v"): [(0.7073, 44.90), (1.4029, 6.06)],
    (5.0, "u"): [(0.8131, 29.24), (6.342, 1.083)],
}


def compute() -> dict[str, Any]:
    """Magnitudes and peaks of both coordinates for both tunings, and of the printed mass ratio."""
    Omega = np.geomspace(0.2, 12, 4000)
    data: dict[str, Any] = {"Omega": Omega}
    for Omega0 in (1.0, 5.0):
        response = st.linear_response(st.models.chain(Omega0=Omega0))
        data[Omega0] = {name: response.frequency_response(Omega, name) for name in "uv"}
        data[Omega0, "frequencies"] = response.natural_frequencies
        for name in "uv":
            data[Omega0, name] = response.peaks(name)
    data["printed ratio"] = st.linear_response(st.models.chain(mass_ratio_21=0.42)).peaks("u")
    return data


def check(data: dict[str, Any]) -> None:
    """The catalogue's peaks, and a direct complex solve of the equations of motion."""
    for key, expected in PEAKS.items():
        for (where, height), (x, y) in zip(data[key], expected, strict=True):
            assert abs(where - x) < 6e-4 * key[0] and abs(height - y) < 2e-3 * y
    for Omega0 in (1.0, 5.0):
        squares = data[Omega0, "frequencies"] ** 2
        assert abs(squares.prod() - Omega0**2) < 1e-9 * Omega0**2
        lam, xi = 0.5, 0.021
        c = 2 * xi * Omega0
        C = np.array([[2 * xi + lam * c, -lam * c], [-c, c]])
        K = np.array([[1 + lam * Omega0**2, -lam * Omega0**2], [-(Omega0**2), Omega0**2]])
        for k in (0, 1234, 3999):
            w = data["Omega"][k]
            hand = np.linalg.solve(K - w**2 * np.eye(2) + 1j * w * C, w**2 * np.ones(2))
            assert np.allclose([data[Omega0]["u"][k], data[Omega0]["v"][k]], hand, rtol=1e-10)
    (low, high) = data["printed ratio"]
    assert abs(low[0] - 0.727) < 1e-3 and abs(high[0] - 0.71) > 0.5 and abs(low[0] - 0.71) > 0.01


def draw(data: dict[str, Any], path: Path) -> None:
    """|U/Y0| and |V/Y0|, one axes each."""
    figure, axes = _figure.panels(2, width=7.2, height=3.2, sharey=True)
    for axis, name in zip(axes, "uv"):
        for Omega0, dash, color in ((1.0, "-", style.SERIES[0]), (5.0, "--", style.COLOURS["vermilion"])):
            axis.plot(data["Omega"], np.abs(data[Omega0][name]), dash, color=color, linewidth=1.4,
                      label=rf"$\Omega_0 = {Omega0:g}$")
            for where, height in data[Omega0, name]:
                if height > 1.2:
                    side = -1 if Omega0 == 1.0 and where < 1 else 1
                    axis.annotate(f"{where:.3g}", (where, height), xytext=(4 * side, 1), textcoords="offset points",
                                  ha="right" if side < 0 else "left", fontsize="x-small", color=color)
        axis.set(xscale="log", yscale="log", xlabel=r"$\Omega$", xlim=(0.2, 12), ylim=(0.02, 90))
        axis.set_xticks([0.2, 0.5, 1, 2, 5, 10], labels=["0.2", "0.5", "1", "2", "5", "10"], minor=False)
    axes[0].set_ylabel("response over base amplitude")
    axes[0].legend(frameon=False, fontsize="small")
    _figure.letter(axes[0], r"(a) $|U/Y_0|$")
    _figure.letter(axes[1], r"(b) $|V/Y_0|$")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
