"""A vibration energy harvester with a stiffening spring on the shaker at 0.5 g: response and power over the frequency.

Parameters [chosen, catalogue 11]: m = 20 g, 20 Hz, d = 0.05 N s/m, k3 = 1.9e7 N/m3; coil 5 V s/m, 50 ohm, neglected
inductance, load 550 ohm: the best one, R_c + k_em^2/d. Sweeps up and down, 80 periods a point, over continuation.
Checked: the sweeps jump behind the folds of continuation; settled points lie on its stable part; the power put in by
the shaker is the power taken by damper, coil and load (every tenth point of the branch); the linear harvester's
largest power is P = (m a)^2/(8 d) (k_em^2/d)/(R_c + k_em^2/d) = 21.872 mW, and no frequency gives the nonlinear one
more.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import _figure
import numpy as np
from _levels import nearest

import stability as st
from stability.models import Coil
from stability.plots import style
from stability.plots.branches import plot_branch
from stability.plots.sweeps import plot_sweep

ACCELERATION = 0.5 * 9.81
MASS, DAMPING, COUPLING, COIL, LOAD = 0.02, 0.05, 5.0, 50.0, 550.0
LARGEST = 1e3 * (MASS * ACCELERATION) ** 2 / (8 * DAMPING) * (COUPLING**2 / DAMPING) / (COIL + COUPLING**2 / DAMPING)


def harvester(cubic: float) -> Any:
    """The harvester at 0.5 g."""
    coil = Coil(coupling=COUPLING, coil_resistance=COIL, load_resistance=LOAD)
    system = st.models.harvester.from_physical(mass=MASS, damping=DAMPING, cubic=cubic, coil=coil)
    return system.with_excitation(st.ConstantAcceleration(ACCELERATION))


def compute() -> dict[str, Any]:
    """Sweeps both ways, the branch, the linear branch."""
    system = harvester(1.9e7)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.UnsettledWarning)  # open markers show those points
        up = st.sweep(system, "frequency", (10.0, 40.0), step=0.5, periods=80)
        down = st.sweep(system, "frequency", (40.0, 10.0), step=0.5, periods=80)
    return {
        "up": up, "down": down,
        "branch": st.continuation(st.Collocation(system), "frequency", (10.0, 40.0), ds_max=0.05),
        "linear": st.continuation(st.Collocation(harvester(0.0)), "frequency", (10.0, 40.0), ds_max=0.02),
    }  # fmt: skip


def balance(branch: Any, index: int) -> float:
    """(power put in - power taken)/power put in, by Gauss quadrature over the orbit."""
    orbit, f = branch.solution(index), float(branch.parameter[index])
    nodes, weights = np.polynomial.legendre.leggauss(400)
    t = orbit.period * (nodes + 1) / 2
    speed = orbit(t)[1]
    current = COUPLING * speed / (COIL + LOAD)
    supplied = MASS * ACCELERATION * np.cos(2 * math.pi * f * t) * speed
    taken = DAMPING * speed**2 + (COIL + LOAD) * current**2
    return float(weights @ (supplied - taken) / (weights @ supplied))


def check(data: dict[str, Any]) -> None:
    """Jumps behind folds, agreement with the stable branch, power balance, largest power."""
    branch, linear = data["branch"], data["linear"]
    low, high = sorted(p.params["frequency"] for p in branch.special)
    (upward,), (downward,) = data["up"].jumps, data["down"].jumps
    assert 0 < upward.bracket[1] - high < 0.1 and 0 < low - downward.bracket[1] < 0.05
    assert abs(high - 30.9198) < 1e-4 and abs(low - 22.8442) < 1e-4
    for run in (data["up"], data["down"]):
        for k in np.nonzero(run.settled[1:-1])[0] + 1:
            power = run.mean["power_mW"][k]
            assert abs(power / nearest(branch, "power_mW.mean", run.parameter[k], power) - 1) < 0.02
    assert max(abs(balance(branch, k)) for k in range(0, len(branch), 10)) < 1e-9
    assert abs(LARGEST - 21.872) < 5e-4
    top = linear.columns["power_mW.mean"]
    assert 0 <= LARGEST - top.max() < 2e-3 * LARGEST and abs(linear.parameter[top.argmax()] - 20.0) < 0.1
    assert branch.columns["power_mW.mean"].max() < LARGEST


def draw(data: dict[str, Any], path: Path) -> None:
    """Displacement and power."""
    figure, axes = _figure.panels(2, width=7.2, height=3.0)
    branch = data["branch"]
    for axis, y, column in ((axes[0], "y_mm.max", "y_mm.max"), (axes[1], "power_mW.mean", "power_mW.mean")):
        plot_branch(data["linear"], ax=axis, y=column, color=style.COLOURS["grey"], linewidth=0.8, label="linear")
        plot_branch(branch, ax=axis, y=column, color=style.SERIES[0], labels=False, label="continuation")
        plot_sweep(data["up"], ax=axis, y=y, label="sweep up", markersize=3.0)
        plot_sweep(data["down"], ax=axis, y=y, label="sweep down", markersize=3.0)
        axis.set(xlabel="$f$ (Hz)", xlim=(10, 40))
    axes[0].set(ylabel=r"$\max\,y$ (mm)", ylim=(0, 8))
    axes[1].set(ylabel="mean power in the load (mW)", ylim=(0, 26))
    axes[1].axhline(LARGEST, color=style.COLOURS["green"], linewidth=0.8, linestyle=":")
    axes[1].annotate(f"{LARGEST:.2f} mW", (10.4, LARGEST), xytext=(0, 3), textcoords="offset points", fontsize="small")
    for point in branch.special:
        f = point.params["frequency"]
        axes[0].annotate(f"{f:.2f} Hz", (f, 1e3 * point.solution.max["y"]), xytext=(5, 4), textcoords="offset points",
                         fontsize="small")
    axes[1].legend(frameon=False, fontsize="small", loc="center right", bbox_to_anchor=(1, 0.36), handlelength=1.1,
                   handletextpad=0.5)
    _figure.letter(axes[0], "(a) response at 0.5 g")
    _figure.letter(axes[1], "(b) power")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
