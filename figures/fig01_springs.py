"""Figure 1: the six springs, sketched, each with its characteristic curve and its energy.

Top: translational; bottom: rotational; left to right: linear, nonlinear, nonlinear unsymmetrical. O is the origin.

    E(s) = int_0^s F dq,   F the force (torque) that HOLDS the displacement

The sketches of the source are not available, only their caption; what is drawn here follows the text: three magnets
with like poles facing, one magnet under a floating one, a rotor with two magnets in a salient iron stator. The rotor
is drawn at its stable position, the minimum of the energy; the source draws it at the unstable one, 90 degrees further.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from _figure import OUT, make, panels, save
from _spring_set import GRAVITY, MASS, springs
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle, Wedge

from stability.plots.style import COLOURS

NORTH, SOUTH, IRON = COLOURS["vermilion"], COLOURS["sky"], "#BDBDBD"
TITLES = ("linear", "nonlinear", "nonlinear unsymmetrical")


def compute() -> dict[str, Any]:
    """Force and energy of each spring over a range about the origin."""
    every = springs()
    reach = [(-8e-3, 8e-3)] * 2 + [(-4e-3, 8e-3)] + [(-math.pi, math.pi)] * 3
    at = {name: np.linspace(*ends, 361) for name, ends in zip(every, reach)}
    return {
        "springs": every,
        "at": at,
        "force": {name: spring.force(at[name]) for name, spring in every.items()},
        "energy": {name: spring.energy(at[name]) for name, spring in every.items()},
    }


def check(data: dict[str, Any]) -> None:
    """Energy by quadrature of the force; closed forms of the single springs; which of them are symmetric."""
    for name, spring in data["springs"].items():
        q, energy = data["at"][name], data["energy"][name]
        for i in (0, 90, 300, 360):
            assert math.isclose(spring.work(np.linspace(0.0, q[i], 9)), energy[i], rel_tol=1e-9, abs_tol=1e-16)
        assert abs(float(spring.force(0.0))) < 1e-14 and float(spring.energy(0.0)) == 0.0
        assert spring.rest == 0.0 or abs(spring.rest) < 1e-12
        mirror = q[np.abs(q) <= 4e-3] if name == "one-sided" else q
        odd = np.allclose(spring.force(-mirror), -spring.force(mirror), rtol=1e-9, atol=1e-14)
        assert odd == (name not in ("one-sided", "unsymmetrical rotor"))
    y, weight = data["at"]["one-sided"], MASS * GRAVITY
    exact = weight * (y + 8e-3 / 3 * ((1 + y / 8e-3) ** -3 - 1))
    np.testing.assert_allclose(data["energy"]["one-sided"], exact, rtol=1e-9, atol=1e-17)
    phi = data["at"]["rotor"]
    exact = 5e-3 * (1 - np.cos(2 * phi)) - 2.5e-4 * (1 - np.cos(4 * phi))
    np.testing.assert_allclose(data["energy"]["rotor"], exact, rtol=0, atol=1e-16)
    np.testing.assert_allclose(data["springs"]["rotor"].escape, (-math.pi / 2, math.pi / 2), rtol=1e-12)


def _magnet(axis: Axes, y: float, north_up: bool) -> None:
    """A disc magnet seen from the side: north vermilion, south light blue."""
    for base, pole in ((y, north_up), (y - 0.16, not north_up)):
        colour = NORTH if pole else SOUTH
        axis.add_patch(Rectangle((-0.5, base), 1.0, 0.16, facecolor=colour, edgecolor="black", lw=0.6))
        axis.text(0.0, base + 0.07, "N" if pole else "S", ha="center", va="center_baseline", fontsize=5.5)


def _ground(axis: Axes, y: float, up: bool) -> None:
    corner = (-0.8, y if up else y - 0.1)
    axis.add_patch(Rectangle(corner, 1.6, 0.1, facecolor="none", edgecolor="black", hatch="////", lw=0))
    axis.plot((-0.8, 0.8), (y, y), color="black", lw=0.9)


def _coil(axis: Axes) -> None:
    """A helical spring on the ground under a mass."""
    turns = np.linspace(-1.0, 0.15, 12)
    x = 0.22 * np.array([0, 0, *((-1) ** k for k in range(8)), 0, 0])
    axis.plot(x, turns, color="black", lw=1.0)
    axis.add_patch(Rectangle((-0.5, 0.15), 1.0, 0.4, facecolor=IRON, edgecolor="black", lw=0.8))
    _ground(axis, -1.0, up=False)


def _torsion(axis: Axes) -> None:
    """A spiral spring between a shaft and the frame."""
    angle = np.linspace(0.0, 6.0 * math.pi, 300)
    radius = 0.18 + 0.72 * angle / angle[-1]
    axis.plot(radius * np.cos(angle), radius * np.sin(angle), color="black", lw=1.0)
    axis.add_patch(Circle((0, 0), 0.18, facecolor=IRON, edgecolor="black", lw=0.8))
    axis.plot((0.9, 1.1), (0, 0), color="black", lw=1.0)
    axis.plot((1.1, 1.1), (-0.3, 0.3), color="black", lw=0.9)


def _rotor(axis: Axes, unsymmetrical: bool) -> None:
    """Salient stator (two iron poles, left and right) and a hollow shaft with two magnets, poles across the gap."""
    for centre in (0.0, 180.0):
        narrow = 12.0 if unsymmetrical and centre else 0.0
        ends = (centre - 42 + narrow, centre + 42)
        axis.add_patch(Wedge((0, 0), 1.05, *ends, width=0.28, facecolor=IRON, edgecolor="black", lw=0.7))
    for start, colour, name in ((-90.0, NORTH, "N"), (90.0, SOUTH, "S")):
        ends = (start + 8, start + 172)
        axis.add_patch(Wedge((0, 0), 0.68, *ends, width=0.26, facecolor=colour, edgecolor="black", lw=0.7))
        axis.text(0.55 if name == "N" else -0.55, 0.0, name, ha="center", va="center", fontsize=5.5)
    axis.add_patch(Circle((0, 0), 0.42, facecolor="white", edgecolor="black", lw=0.7))


def _sketch(axis: Axes, index: int) -> None:
    axis.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), aspect="equal")
    axis.axis("off")
    if index == 0:
        _coil(axis)
    elif index == 1:
        for y, north_up in ((0.86, False), (0.0, True), (-0.86, False)):
            _magnet(axis, y, north_up)
        _ground(axis, 1.02, up=True)
        _ground(axis, -1.02, up=False)
    elif index == 2:
        _magnet(axis, 0.0, True)
        _magnet(axis, -0.86, False)
        _ground(axis, -1.02, up=False)
    elif index == 3:
        _torsion(axis)
    else:
        _rotor(axis, unsymmetrical=index == 5)
    if index < 3:
        height = 0.35 if index == 0 else 0.0
        axis.annotate("", (0.95, height + 0.55), (0.95, height), arrowprops={"arrowstyle": "->", "lw": 0.8})
        axis.plot((0.55, 1.05), (height, height), color="black", lw=0.6)
        axis.text(1.1, height + 0.42, "$y$", fontsize="small")
        axis.text(1.1, height - 0.14, "O", fontsize="small")
    else:
        turn = np.radians(np.linspace(50, 80, 30))
        x, y = 1.22 * np.cos(turn), 1.22 * np.sin(turn)
        axis.plot(x, y, color="black", lw=0.8)
        axis.annotate("", (x[-1], y[-1]), (x[-6], y[-6]), arrowprops={"arrowstyle": "->", "lw": 0.8})
        axis.text(0.95, 0.98, r"$\varphi$", fontsize="small")
        axis.text(0.0, 0.0, "O", fontsize="small", ha="center", va="center")


def draw(data: dict[str, Any], path: Path) -> None:
    """Sketch above curve for each spring; force solid (left scale), energy dashed (right scale)."""
    figure, axes = panels(3, 4, height=7.4, gridspec_kw={"height_ratios": (0.9, 1.3, 0.9, 1.3)})
    for index, name in enumerate(data["springs"]):
        row, column = 2 * (index // 3), index % 3
        linear = index < 3
        _sketch(axes[row][column], index)
        if linear:
            axes[row][column].set_title(TITLES[column], fontsize="medium")
        curve = axes[row + 1][column]
        x = data["at"][name] * (1e3 if linear else 180.0 / math.pi)
        curve.axhline(0.0, color=COLOURS["grey"], lw=0.5)
        curve.axvline(0.0, color=COLOURS["grey"], lw=0.5)
        twin = curve.twinx()
        upward, stored = data["force"][name] * (1.0 if linear else 1e3), 1e3 * data["energy"][name]
        (force,) = curve.plot(x, upward, color=COLOURS["blue"], lw=1.6)
        (energy,) = twin.plot(x, stored, color=COLOURS["vermilion"], lw=1.3, linestyle="dashed")
        for scale, values in ((curve, upward), (twin, stored)):
            limit = 1.08 * float(np.max(np.abs(values)))
            scale.set_ylim(-limit, limit)  # both zeros at the same height
            scale.tick_params(labelsize="small")
        twin.set_yticks([tick for tick in twin.get_yticks() if 0.0 <= tick <= twin.get_ylim()[1]])
        curve.set_xlabel("$y$ in mm" if linear else r"$\varphi$ in degrees", fontsize="small")
        if not linear:
            curve.set_xticks((-180, -90, 0, 90, 180))
        if column == 0:
            curve.set_ylabel("force in N" if linear else "torque in mN m", color=COLOURS["blue"])
        if column == 2:
            twin.set_ylabel("energy in mJ", color=COLOURS["vermilion"])
        if index == 0:
            curve.legend((force, energy), ("force", "energy"), fontsize="small", frameon=False, loc="lower right")
    save(figure, path)


def main(folder: Path | str = OUT) -> list[Path]:
    """compute -> check -> draw."""
    return make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
