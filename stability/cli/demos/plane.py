"""The spring-mass-pendulum over two parameters: where it starts to swing, jumps, and begins to beat.

    u'' + 2 xi1 u' + u + lm ll (theta'^2 cos theta + theta'' sin theta) = Omega^2 cos Omega tau
    theta'' + 2 xi2 Omega0 theta' + (Omega0^2 + (u'' - Omega^2 cos Omega tau)/ll) sin theta = 0

over frequency Omega and base acceleration a = Omega^2/(ll Omega0^2). The tongue of the linearised pendulum (a damped
Mathieu problem about the motion of the mass) is a chart; the curves of the full, nonlinear system are followed: period
doublings of the pendulum at rest, folds and torus points of its swing.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

TITLE = "Two parameters: tongue, folds and torus points of the spring-mass-pendulum"
FIGURE = "plane.png"
WINDOW, HEIGHT = (0.88, 1.12), (2e-4, 0.3)


def compute() -> dict[str, Any]:
    """The tongue's border from a chart, and the curves of special points of the nonlinear system."""
    import stability as st

    start = time.perf_counter()
    pendulum = st.models.autoparametric_pendulum.from_acceleration(acceleration=0.005)
    tongue = st.chart(pendulum, x=("Omega", *WINDOW), y=("acceleration", 2e-4, 0.02), about="linear", shape=(120, 120))
    rest = st.continuation(st.Collocation(pendulum), "Omega", WINDOW)
    swing = st.continuation(st.switch(rest["PD1"]), "Omega", WINDOW)
    curves = {}
    births = {"PD": rest["PD1"], "LP": swing["LP1"], "LP right": swing["LP2"], "NS": swing["NS1"]}
    for name, point in births.items():
        curves[name] = st.continuation(st.locus(point, free="acceleration", window=HEIGHT), "Omega", WINDOW)
    tips = tuple((tip.x, tip.y) for tip in tongue.tips)
    borders = tuple((curve.x, curve.y) for curve in tongue.boundaries)
    return {"tips": tips, "borders": borders, "curves": curves, "seconds": time.perf_counter() - start}


def rows(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Cost, agreement of the two ways to the tongue, and the points that organise the picture."""
    from ...words import Kind

    curves = data["curves"]
    points = sum(len(curve) for curve in curves.values())
    table = [("chart and four curves", f"{points} points in {data['seconds']:.2f} s")]
    extrema = curves["PD"].of_kind(Kind.EXTREMUM)
    worst = max(min(abs(p.params["acceleration"] / y - 1) for p in extrema) for _, y in data["tips"])
    table.append(("tips of the chart against the curve, relative", f"{worst:.1e}"))
    words = {"PD": "starts to swing", "LP": "jumps", "LP right": "jumps", "NS": "beats"}
    for name, curve in curves.items():
        for point in curve.special:
            if point.kind in (Kind.EXTREMUM, Kind.CUSP, Kind.GENERALIZED_PERIOD_DOUBLING, Kind.R3, Kind.R4):
                Omega, a = point.params["Omega"], point.params["acceleration"]
                table.append((f"{words[name]}, {point.label}", f"Omega = {Omega:.8f}   a = {a:.8f}   {point.kind}"))
    return table


def draw(data: dict[str, Any], path: Path) -> None:
    """The plane: acceleration on a logarithmic scale."""
    from ...plots.style import ABOVE, COLOURS, SERIES, marker
    from ...words import Kind
    from .._pictures import write_picture

    def plane(axes: Any) -> None:
        for k, (x, y) in enumerate(data["borders"]):
            label = "tongue of the linearised pendulum" if k == 0 else None
            axes.plot(x, y, color=COLOURS["sky"], linewidth=6, alpha=0.6, label=label, solid_capstyle="round")
        look = {
            "PD": (SERIES[0], "period doubling: it starts to swing", (Kind.GENERALIZED_PERIOD_DOUBLING,)),
            "LP": (SERIES[1], "fold: its swing jumps", ()),
            "LP right": (SERIES[1], None, ()),
            "NS": (SERIES[2], "torus: its swing beats", ()),
        }
        for name, (color, label, kinds) in look.items():
            data["curves"][name].plot(axes, y="acceleration", color=color, label=label, kinds=kinds)
        for point in data["curves"]["NS"].of_kind(Kind.R4):
            place = point.params["Omega"], point.params["acceleration"]
            axes.plot(*place, **marker(Kind.R4, SERIES[2]))
            left = place[0] < 0.99
            axes.annotate(
                "1:4", place, xytext=(-6 if left else 6, 0), textcoords="offset points", color=SERIES[2],
                ha="right" if left else "left", va="center", fontsize="small",
            )  # fmt: skip
        axes.set(xlim=WINDOW, ylim=HEIGHT, yscale="log", ylabel="base acceleration $a$ (g)")
        axes.legend(**{**ABOVE, "ncols": 2, "loc": "lower left", "bbox_to_anchor": (0.0, 1.0)})

    write_picture(path, plane)
