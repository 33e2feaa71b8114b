"""Basins of the autoparametric pendulum where rest and swinging are both stable: does a push start it swinging?

xi1 = xi2 = 0.021, mass ratio 0.2, l/A = 40, Omega0 = 0.5 [chosen], Omega = 0.85: below the period doubling of the
semi-trivial solution (0.8978) and above the fold of the swinging one (0.7680). The mass starts at rest, u = u' = 0,
the pendulum at any angle and speed. Checked: the two attractors are the stable orbits of continuation, the swing with
twice the period of the base; motions to both sides of the unstable swinging orbit, which continuation gives too, end
on different ones; the picture is symmetric, as theta -> -theta is a symmetry of the equations; cells followed one by
one agree.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style
from stability.plots.branches import plot_branch

OMEGA = 0.85
VALUES = dict(xi1=0.021, xi2=0.021, mass_ratio_total=0.2, length_ratio=40.0, Omega0=0.5, Omega=OMEGA)


def compute() -> dict[str, Any]:
    """Basins, and the orbits at the same frequency."""
    system = st.models.autoparametric_pendulum(**VALUES)
    basins = st.basins(
        system, x=("theta", -2.8, 2.8), y=("theta_dot", -1.2, 1.2), shape=(129, 97), tolerance=5e-3, rtol=1e-6
    )
    semi = st.continuation(st.Collocation(system), "Omega", (0.6, 1.0), stop_at="PD1")
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.6, 1.0), max_points=120)
    return {"system": system, "basins": basins, "semi": semi, "swing": swing,
            "orbits": (*semi.at(Omega=OMEGA), *swing.at(Omega=OMEGA))}  # fmt: skip


def label_of(data: dict[str, Any], state: np.ndarray) -> int:
    """The attractor that a stroboscopic state belongs to."""
    gaps = []
    for attractor in data["basins"].attractors:
        off = attractor.points - state
        off[:, 1] -= 2 * np.pi * np.round(off[:, 1] / (2 * np.pi))
        gaps.append(np.abs(off).max(axis=1).min())
    return int(np.argmin(gaps)) if min(gaps) < 0.1 else -1


def check(data: dict[str, Any]) -> None:
    """Attractors, boundary, symmetry."""
    basins, orbits = data["basins"], data["orbits"]
    assert abs(data["semi"]["PD1"].params["Omega"] - 0.8978) < 5e-5
    assert abs(data["swing"]["LP1"].params["Omega"] - 0.7680) < 5e-5
    assert len(basins.attractors) == 2 and basins.undecided == basins.escaped == 0
    assert sorted(a.multiple for a in basins.attractors) == [1, 2]
    stable = [o for o in orbits if o.verdict is st.Verdict.STABLE]
    assert sorted(label_of(data, o(0.0)) for o in stable) == [0, 1]
    saddle = next(o for o in orbits if o.verdict is st.Verdict.UNSTABLE)
    system, values = data["system"], np.abs(saddle.multipliers)
    assert (values > 1).sum() == 1
    spectrum, vectors = np.linalg.eig(st.monodromy(system, about=saddle).matrix)
    direction = vectors[:, np.abs(spectrum).argmax()].real
    step = 0.05 * direction / np.linalg.norm(direction)
    x, T = saddle(0.0), saddle.period
    both = st.simulate(system, (0, 400 * T), x0=np.column_stack([x + step, x - step])).final
    assert sorted(label_of(data, end) for end in both.T) == [0, 1]
    assert (basins.labels == basins.labels[::-1, ::-1]).mean() > 0.995
    for j, i in ((48, 64), (64, 60), (40, 20), (20, 64), (70, 10)):
        start = dict(theta=basins.x[i], theta_dot=basins.y[j])
        assert label_of(data, st.simulate(system, (0, 600 * T), x0=start).final) == basins.labels[j, i]


def draw(data: dict[str, Any], path: Path) -> None:
    """Basins beside the branches that explain them."""
    figure, axes = _figure.panels(2, width=7.2, height=3.1)
    basins = data["basins"]
    basins.plot(ax=axes[0], points=False)
    words = {1: "comes to rest", 2: "swings"}
    for place in ((0.0, 0.0), (0.3, 0.65)):
        cell = np.abs(basins.y - place[1]).argmin(), np.abs(basins.x - place[0]).argmin()
        word = words[basins.attractors[basins.labels[cell]].multiple]
        axes[0].text(*place, word, ha="center", va="center", fontsize="small")
    axes[0].set(xlabel=r"$\theta(0)$ (rad)", ylabel=r"$\dot{\theta}(0)$")
    plot_branch(data["semi"], ax=axes[1], y="theta.max", color=style.COLOURS["blue"], label="pendulum at rest")
    plot_branch(data["swing"], ax=axes[1], y="theta.max", color=style.COLOURS["vermilion"], label="swinging")
    axes[1].axvline(OMEGA, color=style.COLOURS["grey"], linewidth=0.8, linestyle=":")
    axes[1].set(xlim=(0.75, 1.0), ylim=(-0.05, 2.2), ylabel=r"$\max\,\theta$ (rad)")
    axes[1].legend(frameon=False, fontsize="small", loc="upper right")
    _figure.letter(axes[0], rf"(a) basins at $\Omega = {OMEGA}$")
    _figure.letter(axes[1], "(b) continuation")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
