"""Figure 2: characteristic curves of the springs of figure 1; (a) force of displacement, (b) torque of angle.

    linear  F = k q;   three rings  F = f(gap - y) - f(gap + y);   one-sided  F = m g [1 - (h0/(h0 + y))^4]
    T = c phi;   T = T2 sin 2 phi + T4 sin 4 phi;   T1 sin(phi + pi/4) added

Differences from the source: parameters are chosen (none are printed), see `_spring_set`. "Integrating the force or
torque adds up to zero" holds round closed paths, over [-s, s] for odd springs, and over one turn for the rotors;
the checks show where it does not hold (erratum: text after figure 1).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from _figure import OUT, letter, make, panels, save
from _spring_set import GRAVITY, MASS, RING, springs

from stability import models
from stability.plots.style import COLOURS


def compute() -> dict[str, Any]:
    """Curves, Taylor coefficients of the ring spring, and the closing integrals (from the force alone)."""
    every = springs()
    y, phi = np.linspace(-7.2e-3, 9e-3, 400), np.linspace(-math.pi, math.pi, 721)
    names = tuple(every)
    return {
        "names": names,
        "springs": every,
        "at": {name: y if i < 3 else phi for i, name in enumerate(names)},
        "curves": {name: every[name].force(y if i < 3 else phi) for i, name in enumerate(names)},
        "taylor": every["three rings"].taylor,
        "symmetric": {name: every[name].work((-5e-3, 5e-3) if i < 3 else (-1, 1)) for i, name in enumerate(names)},
        "closed": {name: every[name].work((0.0, 4e-3, -3e-3, 0.0)) for name in names},
        "turn": {name: every[name].work((0.0, math.pi, 2 * math.pi)) for name in names[3:]},
    }


def check(data: dict[str, Any]) -> None:
    """Catalogue numbers, a second method for the ring force, and the closing properties."""
    k0, k1, k2, k3 = data["taylor"]
    assert k0 == 0.0 and k2 == 0.0
    assert round(k1, 1) == 189.2 and round(k3 / 1e6, 2) == 1.87
    y = data["at"]["three rings"]
    pair = models.MagnetPair(RING, RING)
    elliptic = pair.force(12e-3 - y, "closed form") - pair.force(12e-3 + y, "closed form")
    np.testing.assert_allclose(data["curves"]["three rings"], elliptic, rtol=0, atol=1e-11)
    slope = float(data["springs"]["one-sided"].stiffness(0.0))
    assert math.isclose(slope / MASS, 4 * GRAVITY / 8e-3, rel_tol=1e-12)  # w^2 = 4 g/h0
    assert float(data["springs"]["rotor"].stiffness(0.0)) > 0.0
    for name in data["names"]:
        scale = float(np.max(np.abs(data["curves"][name])))
        assert abs(data["closed"][name]) < 1e-12 * scale
        odd = name not in ("one-sided", "unsymmetrical rotor")
        assert (abs(data["symmetric"][name]) < 1e-12 * scale) == odd
    assert all(abs(data["turn"][name]) < 1e-15 for name in ("rotor", "unsymmetrical rotor"))
    assert data["turn"]["linear rotational"] > 0.09  # a linear torsion spring is not periodic: c (2 pi)^2/2


def draw(data: dict[str, Any], path: Path) -> None:
    """Two panels; linear blue, symmetric red, unsymmetrical orange as in the source, with different strokes."""
    figure, axes = panels(2, height=3.1)
    strokes = ((COLOURS["blue"], "dashed"), (COLOURS["vermilion"], "solid"), (COLOURS["orange"], "dashdot"))
    legends = (
        ("linear, 190 N/m", "three rings, gap 12 mm", "one-sided, 20 g at 8 mm"),
        ("linear, 5 mN m/rad", r"$T_2 \sin 2\varphi + T_4 \sin 4\varphi$", r"$T_1 \sin(\varphi + \pi/4)$ added"),
    )
    for side, (axis, scale) in enumerate(zip(axes, ((1e3, 1.0), (180.0 / math.pi, 1e3)))):
        for (colour, stroke), name, label in zip(strokes, data["names"][3 * side : 3 * side + 3], legends[side]):
            x, force = scale[0] * data["at"][name], scale[1] * data["curves"][name]
            axis.plot(x, force, color=colour, linestyle=stroke, linewidth=1.6, label=label)
        axis.axhline(0.0, color=COLOURS["grey"], linewidth=0.5)
        axis.axvline(0.0, color=COLOURS["grey"], linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
        place = "upper left" if side == 0 else "lower right"
        axis.legend(fontsize="small", loc=place, facecolor="white", edgecolor="none", framealpha=1.0)
    axes[0].set(xlabel="displacement $y$ in mm", ylabel="force $F$ in N", xlim=(-7.2, 9.0), ylim=(-2.2, 2.8))
    axes[1].set(xlabel=r"angle $\varphi$ in degrees", ylabel="torque $T$ in mN m", xlim=(-180, 180), ylim=(-22, 16))
    axes[1].set_xticks(range(-180, 181, 90))
    letter(axes[0], "(a) translational")
    letter(axes[1], "(b) rotational")
    save(figure, path)


def main(folder: Path | str = OUT) -> list[Path]:
    """compute -> check -> draw."""
    return make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
