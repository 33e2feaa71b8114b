"""Instability tongues of the damped Mathieu equation, and where each of them opens.

    q'' + 2 delta q' + (a + b cos t) q = 0

Averaging to first order lets the first tongue open at b = 4 delta sqrt(a) with a = 1/4, that is b = 2 delta; the chart
gives the exact tip. The tongue of order n opens at a depth of order delta^(1/n).
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

TITLE = "Instability tongues: q'' + 2 delta q' + (a + b cos t) q = 0, delta = 0.05"
FIGURE = "tongues.png"
DELTA = 0.05


def compute() -> dict[str, Any]:
    """The chart with damping, 10^6 points."""
    import stability as st

    start = time.perf_counter()
    chart = st.chart(st.models.mathieu(delta=DELTA), x=("a", -0.5, 2.5), y=("b", 0.0, 2.0), shape=(1000, 1000))
    return {"chart": chart, "seconds": time.perf_counter() - start}


def rows(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Cost, accuracy, and the tip of each tongue."""
    import numpy as np

    chart = data["chart"]
    unstable = np.mean(chart.verdict == "unstable")
    table = [
        ("growth rate at 1000 x 1000 points, first call", f"{data['seconds']:.2f} s, error <= {chart.error:.1e}"),
        ("unstable part of the chart", f"{unstable:.2%}"),
    ]
    for tip in sorted(chart.tips, key=lambda tip: tip.order):
        first = f"  (averaging: b = {2 * DELTA:g})" if tip.order == 1 else ""
        table.append((f"tongue {tip.order} opens at", f"a = {tip.x:.10f}, b = {tip.y:.10f}{first}"))
    return table


def draw(data: dict[str, Any], path: Path) -> None:
    """Growth rate with the boundary curves over it."""
    from .._pictures import write_picture

    write_picture(path, lambda axes: data["chart"].plot(ax=axes))
