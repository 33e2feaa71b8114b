"""Where the hanging pendulum is unstable: frequency and base acceleration, with bifurcation points laid over it.

The set of figure 13 (xi1 = xi2 = 0.021, lm = 0.2, Omega0 = 1/2) at constant base acceleration, in units of g. The chart
is Floquet's theory about the linear response of the primary (pendulum at rest). Instability at multiplier -1 starts at
the principal resonance Omega = 2 Omega0; a second sheet at +1 (theta of the period of the force) hangs down from large
accelerations, and between the two the rest is stable again. The markers come from another method: collocation of the
nonlinear equations, continued in Omega (triangles, period doublings) and in the acceleration at Omega = 1.

Checked: every marker lies on a boundary (growth rate zero) of its kind, to 1e-8; the tip of the principal tongue
against the small-damping threshold 4 xi2/|U_abs|; at Omega = 1 the gap 0.528 ... 0.540 g between the sheets.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

SET = dict(xi1=0.021, xi2=0.021, mass_ratio_total=0.2, Omega0=0.5)
LEVELS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5)
WINDOW = (0.4, 1.4)
GAP = ((0.97, 1.03), (0.5, 0.6))


def compute() -> dict[str, Any]:
    """The chart and special points of branches across it."""
    pendulum = st.models.autoparametric_pendulum.from_acceleration(**SET)
    points = []
    for level in LEVELS:
        rest = st.continuation(st.Collocation(pendulum.with_params(acceleration=level)), "Omega", WINDOW)
        points += [(p.kind, p.params["Omega"], level) for p in rest.special]
    upward = st.continuation(st.Collocation(pendulum.with_params(Omega=1.0)), "acceleration", (0.001, 0.6))
    points += [(p.kind, 1.0, p.params["acceleration"]) for p in upward.special]
    chart = st.chart(
        pendulum, x=("Omega", *WINDOW), y=("acceleration", 0.0, 0.6), shape=(600, 400), about="linear"
    )
    gap = st.chart(pendulum, x=("Omega", *GAP[0]), y=("acceleration", *GAP[1]), shape=(300, 300), about="linear")
    return {"chart": chart, "gap": gap, "points": points, "upward": upward}


def check(data: dict[str, Any]) -> None:
    """Markers on the boundaries, tip and gap by number."""
    chart = data["chart"]
    for kind, Omega, acceleration in data["points"]:
        here = chart.at(Omega=Omega, acceleration=acceleration)
        assert abs(here.exponents.real.max()) < 1e-8, (kind, Omega, acceleration)
        critical = -1 if kind is st.Kind.PERIOD_DOUBLING else 1
        assert np.abs(here.multipliers - critical).min() < 1e-6
    assert sum(kind is st.Kind.PERIOD_DOUBLING for kind, *_ in data["points"]) >= 2 * len(LEVELS) + 2
    tip = min((t for t in chart.tips), key=lambda t: t.y)
    assert tip.order == 1 and abs(tip.y / (4 * 0.021 / abs(1 + 1 / 0.042j)) - 1) < 1e-2
    gap = [p.params["acceleration"] for p in data["upward"].special][1:3]
    assert np.allclose(gap, [0.528, 0.540], atol=1e-3), gap


def draw(data: dict[str, Any], path: Path) -> None:
    """The chart, its boundaries, the markers; beside it the gap."""
    figure, axes = _figure.panels(2, width=9.6, height=4.2, width_ratios=(3, 2))
    data["chart"].plot(ax=axes[0], orders=False)
    data["gap"].plot(ax=axes[1], orders=False, colorbar=False, legend=False)
    names = {st.Kind.PERIOD_DOUBLING: "period doubling", st.Kind.BRANCH_POINT: "branch point"}
    for axis, window in zip(axes, ((WINDOW, (0, 0.6)), GAP), strict=True):
        for kind, name in names.items():
            shown = [
                p[1:] for p in data["points"]
                if p[0] is kind and window[0][0] <= p[1] <= window[0][1] and window[1][0] <= p[2] <= window[1][1]
            ]  # fmt: skip
            look = {**style.marker(kind, style.COLOURS["orange"]), "markeredgecolor": style.COLOURS["black"]}
            look["linestyle"] = "none"
            axis.plot(*np.array(shown).T, **look, zorder=4, label=f"{name}, by continuation", clip_on=False)
        axis.set_ylabel("base acceleration (g)")
    axes[0].legend(**{**style.ABOVE, "ncols": 2})
    _figure.letter(axes[1], "the gap between the sheets")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
