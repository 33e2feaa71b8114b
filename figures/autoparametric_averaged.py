"""The spring-mass-pendulum: branches of the averaged flow and of the full equations together.

u'' + 2 xi1 u' + u + lm ll (th'^2 cos th + th'' sin th) = Omega^2 cos(Omega tau),
th'' + 2 xi2 Omega0 th' + sin th (Omega0^2 + (u'' - Omega^2 cos(Omega tau))/ll) = 0,   default (detuned) parameters.
Averaged at 2:1 to first and second order: the period doublings of the rest position are branch points of the slow flow,
the Neimark-Sacker points of the swinging branch its Hopf points. The swing is the largest angle of the reconstructed
motion. (b) The stretch between the two torus points, where neither rest nor swing is stable. (c) The upper fold.

Checked: doublings, folds and torus points of the full equations (harmonic balance) against known digits, those of the
slow flows against them: first order to 3.5e-3 (folds), 3e-4 (torus points) and 2e-4 (doublings), second order closer.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure

import stability as st
from stability.plots import style

WINDOW = (0.88, 1.1)
FULL = {"folds": (0.917430758, 1.061210890), "doublings": (0.951292278, 1.010150122),
        "torus": (0.984873538, 0.999884193)}  # fmt: skip
METHODS = {"hb5": "full equations", "averaging": "averaged, order 1", "averaging2": "averaged, order 2"}


def compute() -> dict[str, Any]:
    """Rest and swing by three methods, laid over each other."""
    found = st.responses(
        st.models.autoparametric_pendulum(), "Omega", WINDOW, tuple(METHODS), resonance=(2, 1), born=True,
        quantity="theta.max", points=45,
    )  # fmt: skip
    return {"responses": found}


def special(row: dict[str, Any]) -> dict[str, list[float]]:
    """Folds, births of the swing, and torus points of a method."""
    names = {"period doubling": "doublings", "Neimark-Sacker": "torus", "Hopf": "torus"}
    if row["method"] != "hb5":
        names["branch point"] = "doublings"
    places: dict[str, list[float]] = {"folds": row["folds"], "doublings": [], "torus": []}
    for kind, place in row["others"]:
        if kind in names:
            places[names[kind]].append(place)
    return places


def check(data: dict[str, Any]) -> None:
    """Special points of each method."""
    found = data["responses"]
    assert not found.failures
    points = {row["method"]: special(row) for row in found.rows()}
    for key, places in FULL.items():
        assert max(abs(a - b) for a, b in zip(points["hb5"][key], places, strict=True)) < 2e-9, (key, points["hb5"])
    tolerances = {"folds": 3.5e-3, "doublings": 2e-4, "torus": 3e-4}
    for key, places in FULL.items():
        far = {
            name: max(abs(a - b) for a, b in zip(points[name][key], places, strict=True))
            for name in ("averaging", "averaging2")
        }
        assert far["averaging2"] < far["averaging"] < tolerances[key], (key, far)
    worst = [found.comparison[name].worst for name in ("averaging", "averaging2")]
    assert worst[1] < worst[0] < 0.05, worst


def draw(data: dict[str, Any], path: Path) -> None:
    """Swing over frequency, and the stretch of torus motion enlarged."""
    figure, axes = _figure.panels(3, width=10.5, height=3.6, width_ratios=(1.4, 1, 1))
    found = data["responses"]
    colours = (style.COLOURS["grey"], style.SERIES[1], style.SERIES[2])
    looks = dict(zip(METHODS, zip(colours, (3.0, 1.2, 1.2))))
    inner = (st.Kind.NEIMARK_SACKER, st.Kind.HOPF)
    for axis in axes:
        for name, label in METHODS.items():
            colour, width = looks[name]
            for k, branch in enumerate(found[name]):
                branch.plot(ax=axis, y="theta.max", color=colour, linewidth=width, kinds=inner, labels=False,
                            label=None if k else label)  # fmt: skip
        axis.set(xlabel=r"$\Omega$", ylabel=r"max $\theta$ (rad)")
    axes[0].set(xlim=(0.9, 1.08), ylim=(-0.02, 0.62))
    axes[1].set(xlim=(0.978, 1.004), ylim=(0.05, 0.165), ylabel="")
    axes[2].set(xlim=(1.035, 1.068), ylim=(0.33, 0.55), ylabel="")
    axes[0].legend(fontsize="small", frameon=False, loc="upper left")
    _figure.letter(axes[0], "(a) pendulum at rest and swinging")
    _figure.letter(axes[1], "(b) torus points")
    _figure.letter(axes[2], "(c) upper fold")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
