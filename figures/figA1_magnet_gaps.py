"""Figure A1: force of a ring magnet between two fixed rings, for different distances of the fixed magnets.

    F(y) = f(gap - y) - f(gap + y),   k1 = -2 f'(gap),   k3 = -f'''(gap)/3

Rings 3/6 mm, 4 mm thick, 1.2 T, gaps 4, 6, 8, 12, 16, 20 mm: all chosen, the source says no more than "different
distances of non-movable magnets" (catalogue, section 1).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from _figure import OUT, letter, make, panels, save
from _spring_set import RING

from stability import models
from stability.plots.style import COLOURS

GAPS = (4e-3, 6e-3, 8e-3, 12e-3, 16e-3, 20e-3)


def compute() -> dict[str, Any]:
    """Displacement, force and stiffness for each gap, to 0.3 mm before contact; Taylor coefficients at the centre."""
    every = [models.LevitatedMagnetSpring(RING, gap=gap) for gap in GAPS]
    at = [np.linspace(-(gap - 0.3e-3), gap - 0.3e-3, 401) for gap in GAPS]
    return {
        "springs": every,
        "at": at,
        "force": [s.force(y) for s, y in zip(every, at)],
        "stiffness": [s.stiffness(y) for s, y in zip(every, at)],
        "energy": [s.energy(y) for s, y in zip(every, at)],
        "k1": np.array([s.taylor[1] for s in every]),
        "k3": np.array([s.taylor[3] for s in every]),
    }


def check(data: dict[str, Any]) -> None:
    """Catalogue numbers at 12 mm; elliptic closed form; energy by quadrature; every spring odd and hardening."""
    assert round(float(data["k1"][3]), 1) == 189.2 and round(float(data["k3"][3]) / 1e6, 2) == 1.87
    pair = models.MagnetPair(RING, RING)
    for gap, y, force, energy, spring in zip(GAPS, data["at"], data["force"], data["energy"], data["springs"]):
        elliptic = pair.force(gap - y, "closed form") - pair.force(gap + y, "closed form")
        np.testing.assert_allclose(force, elliptic, rtol=0, atol=1e-11)
        np.testing.assert_allclose(force, -force[::-1], rtol=0, atol=1e-12)
        assert np.isclose(spring.work(np.linspace(0.0, y[-1], 9)), energy[-1], rtol=1e-10, atol=0)
    assert np.all(np.diff(data["k1"]) < 0.0) and np.all(data["k3"] > 0.0)
    for stiffness in data["stiffness"]:
        assert np.argmin(stiffness) == 200  # softest at the centre


def draw(data: dict[str, Any], path: Path) -> None:
    """(a) force, (b) stiffness on a logarithmic scale; dark to light from the smallest gap to the largest."""
    from matplotlib import colormaps

    figure, axes = panels(2, height=3.1)
    shades = colormaps["cividis"](np.linspace(0.0, 0.85, len(GAPS)))
    blank = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
    strokes = ("solid", "dashed", "dashdot", "solid", "dashed", "dashdot")
    for i, (gap, y) in enumerate(zip(GAPS, data["at"])):
        style, name = {"color": shades[i], "linestyle": strokes[i], "linewidth": 1.5}, f"{1e3 * gap:.0f}"
        axes[0].plot(1e3 * y, data["force"][i], **style)
        axes[0].annotate(name, (1e3 * y[-1], 23.3), ha="center", va="bottom", fontsize="small")
        axes[1].plot(1e3 * y, data["stiffness"][i], **style)
        axes[1].annotate(
            name, (0.0, data["k1"][i]), xytext=(0, -3), textcoords="offset points", ha="center", va="top",
            fontsize="small", bbox=blank,
        )  # fmt: skip
    for axis in axes:
        axis.axvline(0.0, color=COLOURS["grey"], linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
        axis.set(xlabel="displacement $y$ in mm", xlim=(-20.5, 20.5))
    axes[0].axhline(0.0, color=COLOURS["grey"], linewidth=0.5)
    axes[0].set(ylabel="force $F$ in N", ylim=(-26, 27))
    axes[0].annotate("gap in mm", (2.6, 23.3), ha="right", va="bottom", fontsize="small", bbox=blank)
    axes[1].set(ylabel=r"stiffness $\mathrm{d}F/\mathrm{d}y$ in N/m", yscale="log", ylim=(22, 3e4))
    letter(axes[0], "(a) force")
    letter(axes[1], "(b) stiffness")
    save(figure, path)


def main(folder: Path | str = OUT) -> list[Path]:
    """compute -> check -> draw."""
    return make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
