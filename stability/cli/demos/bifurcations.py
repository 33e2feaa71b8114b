"""Bifurcation points of the spring-mass-pendulum: where it starts to swing, and where its swing begins to beat.

    u'' + 2 xi1 u' + u + mass_ratio_total length_ratio (theta'^2 cos theta + theta'' sin theta) = Omega^2 cos Omega tau
    theta'' + 2 xi2 Omega0 theta' + (Omega0^2 + (u'' - Omega^2 cos Omega tau)/length_ratio) sin theta = 0

The pendulum at rest loses stability by period doubling; the swinging branch that is born there has folds and
Neimark-Sacker points (an amplitude that beats). Between its period doublings the rest position is unstable.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

TITLE = "Bifurcation points: spring-mass-pendulum, the pendulum at rest and swinging"
FIGURE = "bifurcations.png"


def compute() -> dict[str, Any]:
    """The branch at rest, and the swinging one that is born at its first period doubling."""
    import stability as st

    start = time.perf_counter()
    window = (0.5, 1.5)
    rest = st.continuation(st.Collocation(st.models.autoparametric_pendulum()), "Omega", window)
    swing = st.continuation(st.switch(rest["PD1"]), "Omega", window)
    return {"rest": rest, "swing": swing, "seconds": time.perf_counter() - start}


def rows(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Cost, accuracy, and the special points of both branches."""
    points = sum(len(data[name]) for name in ("rest", "swing"))
    worst = max(float(max(data[name].residuals)) for name in ("rest", "swing"))
    table = [("both branches, with stability at each point", f"{points} points in {data['seconds']:.2f} s"),
             ("largest residual", f"{worst:.1e}")]
    for name, words in (("rest", "at rest"), ("swing", "swinging")):
        for point in data[name].special:
            table.append((f"{words}, {point.label}", f"Omega = {point.params['Omega']:.10f}   {point.kind}"))
    return table


def draw(data: dict[str, Any], path: Path) -> None:
    """Swing of the pendulum over the frequency of excitation: solid stable, dashed unstable."""
    from ...plots.style import SERIES
    from ...words import Kind
    from .._pictures import write_picture

    def both(axes: Any) -> None:
        data["rest"].plot(axes, y="theta.max", color=SERIES[0])
        own = (Kind.FOLD, Kind.NEIMARK_SACKER)  # its branch point lies on PD2, which is marked already
        data["swing"].plot(axes, y="theta.max", color=SERIES[2], kinds=own)
        axes.set_xlim(0.88, 1.1)

    write_picture(path, both)
