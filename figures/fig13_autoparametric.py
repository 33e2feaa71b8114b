"""Figure 13: the autoparametric absorber at 0.2 g, w = w1 = 2 w2: the pendulum takes the energy of the mass.

Parameters: f = 22.22 Hz [given]; mass ratio 0.2, xi1 = xi2 = 0.021, phi(0) = 0.01 rad [chosen]; l = 2.0132 mm, A =
0.10066 mm, l/A = 20. Checked: |phi| first reaches pi after 7.526 periods; the pendulum then rotates irregularly
(chaotic: no single number is checked there) and locks to an oscillation of 1.035 rad with twice the period of the
base, while |u| falls from 23.8 with the pendulum blocked to 0.71; this orbit is the one that shooting finds, and it
is stable.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

VALUES = dict(xi1=0.021, xi2=0.021, mass_ratio_total=0.2, length_ratio=20.0, Omega0=0.5, Omega=1.0)
PERIODS = 400


def compute() -> dict[str, Any]:
    """The motion, the same with the pendulum at rest, and the locked orbit by Newton's method."""
    system = st.models.autoparametric_pendulum(**VALUES)
    T = system.period
    motion = st.simulate(system, (0.0, PERIODS * T), x0=dict(theta=0.01), rtol=1e-11, atol=1e-13)
    blocked = st.simulate(system, (0.0, 100 * T), rtol=1e-11, atol=1e-13)
    problem, p = st.Shooting(system, multiple=2), system.parameter_vector()
    settled = st.simulate(system, (0.0, 1500 * T), x0=dict(theta=0.01)).final
    settled[1] = np.mod(settled[1] + np.pi, 2 * np.pi) - np.pi
    found = problem.correct(settled, p, "Omega", None, 0.0, 1e-10)
    orbit = problem.view(found.u, p)
    return {"T": T, "motion": motion, "blocked": blocked, "converged": found.converged, "orbit": orbit}


def first_turn(motion: Any) -> float:
    """Time at which |theta| first reaches pi."""
    return float(min(motion.crossings("theta", s * np.pi).min(initial=np.inf) for s in (-1, 1)))


def check(data: dict[str, Any]) -> None:
    """The catalogue's numbers."""
    assert abs(first_turn(data["motion"]) / data["T"] - 7.526) < 5e-4
    assert abs(data["blocked"].last(1).max["u"] - 23.8) < 0.05 and data["blocked"].max["theta"] == 0
    orbit = data["orbit"]
    assert data["converged"] and orbit.verdict is st.Verdict.STABLE
    assert abs(orbit.max["theta"] - 1.035) < 5e-4 and abs(orbit.min["theta"] + 1.035) < 5e-4
    assert abs(max(orbit.max["u"], -orbit.min["u"]) - 0.71) < 2e-3
    assert np.ptp(data["motion"].window(0, 100 * data["T"])["theta"]) > 2 * np.pi  # it rotates, there and back
    assert orbit.multipliers.size == 4 and np.abs(orbit.multipliers).max() < 1


def draw(data: dict[str, Any], path: Path) -> None:
    """Mass and pendulum over time, the locked orbit in the phase plane."""
    figure, axes = _figure.panels(2, 2, width=7.2, height=4.6, width_ratios=(2.3, 1))
    T, motion, blocked = data["T"], data["motion"], data["blocked"]
    shown = motion.window(0.0, 100 * T)
    axes[0, 0].plot(blocked.t / T, blocked["u"], color=style.COLOURS["sky"], linewidth=0.5, label="pendulum blocked")
    axes[0, 0].plot(shown.t / T, shown["u"], color=style.SERIES[0], linewidth=0.7, label="free")
    axes[0, 0].set(xlim=(0, 100), ylabel="$u$", ylim=(-27, 34))
    axes[0, 0].legend(frameon=False, fontsize="small", ncols=2, loc="upper right")
    axes[1, 0].plot(shown.t / T, shown["theta"] / (2 * np.pi), color=style.SERIES[0], linewidth=0.8)
    turn = first_turn(motion) / T
    axes[1, 0].axvline(turn, color=style.COLOURS["vermilion"], linewidth=0.8, linestyle="--")
    red = style.COLOURS["vermilion"]
    axes[1, 0].annotate(rf"$|\theta| = \pi$ after {turn:.3f} periods", (turn, 0.9), xytext=(6, 0), fontsize="small",
                        xycoords=("data", "axes fraction"), textcoords="offset points", color=red)
    axes[1, 0].set(xlim=(0, 100), xlabel="periods of the base", ylabel=r"$\theta/2\pi$ (turns)")
    orbit = data["orbit"]
    times = np.linspace(0, orbit.period, 801)
    values = orbit(times)
    axes[0, 1].plot(values[0], values[2], color=style.SERIES[0], linewidth=1.2)
    axes[0, 1].set(xlabel="$u$", ylabel=r"$\dot{u}$")
    axes[1, 1].plot(values[1], values[3], color=style.SERIES[0], linewidth=1.2)
    axes[1, 1].set(xlabel=r"$\theta$ (rad)", ylabel=r"$\dot{\theta}$")
    _figure.letter(axes[0, 0], "(a) mass")
    _figure.letter(axes[1, 0], "(b) pendulum")
    _figure.letter(axes[0, 1], "(c) locked orbit")
    _figure.letter(axes[1, 1], rf"(d) $\pm${orbit.max['theta']:.3f} rad")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
