"""The spring-mass-pendulum over frequency and base acceleration: borders of rest, folds and torus points of the swing.

u'' + 2 xi1 u' + u + lm ll (th'^2 cos th + th'' sin th) = Omega^2 cos(Omega tau),
th'' + 2 xi2 Omega0 th' + sin th (Omega0^2 + (u'' - Omega^2 cos(Omega tau))/ll) = 0,     ll = Omega^2/(a Omega0^2).

(a) Lightly damped (xi1 = 0.002, xi2 = 0.005, Omega0 = 0.48): the tongue of the linearised pendulum, a damped Mathieu
problem about the motion of the mass, is the period-doubling curve of the full system; folds and torus points of the
swinging motion are known to the full system only. The fold curve ends where the doubling changes its danger (GPD).
(b) Damped (0.02, 0.01, 0.5), up to 3 g: every sheet, of multiplier -1 (the pendulum swings with period 2T) and +1
(period T), with gaps of stable rest between them.

Checked: points of all sheets against the exact Mathieu problem (no time stepping); the tongue's tips from the chart;
the fold curve's end on the GPD point; multipliers exp(+-i pi/2) at the resonances of the torus curve.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

LIGHT = dict(xi1=0.002, xi2=0.005, Omega0=0.48)
DAMPED = dict(xi1=0.02, xi2=0.01, Omega0=0.5)
WINDOW, HEIGHT = (0.88, 1.12), (2e-4, 0.3)
SIGN = {st.Kind.PERIOD_DOUBLING: -1, st.Kind.BRANCH_POINT: 1}


def compute() -> dict[str, Any]:
    """Chart and curves of (a), sheets of (b)."""
    light = st.models.autoparametric_pendulum.from_acceleration(acceleration=0.005, **LIGHT)
    tongue = st.chart(light, x=("Omega", *WINDOW), y=("acceleration", 2e-4, 0.02), about="linear", shape=(80, 80))
    rest = st.continuation(st.Collocation(light), "Omega", WINDOW)
    swing = st.continuation(st.switch(rest["PD1"]), "Omega", WINDOW)
    births = {"PD": rest["PD1"], "LP1": swing["LP1"], "LP2": swing["LP2"], "NS": swing["NS1"]}
    curves = {
        name: st.continuation(st.locus(point, free="acceleration", window=HEIGHT), "Omega", WINDOW)
        for name, point in births.items()
    }
    damped = st.models.autoparametric_pendulum.from_acceleration(**DAMPED)
    sheets = st.loci(
        st.Collocation(damped, degree=7), "Omega", (0.45, 1.7), free="acceleration", free_window=(0.01, 3.0),
        cuts=(0.3, 2.0), kinds=SIGN,
    )  # fmt: skip
    return {"tongue": tongue, "curves": curves, "sheets": sheets}


def gap(kind: st.Kind, Omega: float, acceleration: float, p: dict[str, float]) -> float:
    """sign * trace / (2 cosh) - 1 of the exact Mathieu problem: zero on a sheet, positive where rest is unstable."""
    ratio = Omega**2 / (acceleration * p["Omega0"] ** 2)
    depth = Omega**2 * abs(Omega**2 / (1 - Omega**2 + 2j * p["xi1"] * Omega) + 1) / ratio
    delta = p["xi2"] * p["Omega0"]
    a, q = 4 * (p["Omega0"] ** 2 - delta**2) / Omega**2, 2 * depth / Omega**2
    trace = 2 * np.cos(np.pi * st.mathieu_exponent(a, q)).real
    return float(SIGN[kind] * trace / (2 * np.cosh(delta * 2 * np.pi / Omega)) - 1)


def on_sheet(curve: Any, kind: st.Kind, p: dict[str, float], tolerance: float) -> None:
    """Every third point lies on the exact border, in relative units of both parameters."""
    h = 1e-6
    for Omega, a in list(zip(curve.columns["Omega"], curve.columns["acceleration"]))[::3]:
        across = (gap(kind, Omega * (1 + h), a, p) - gap(kind, Omega * (1 - h), a, p)) / (2 * h)
        up = (gap(kind, Omega, a * (1 + h), p) - gap(kind, Omega, a * (1 - h), p)) / (2 * h)
        assert abs(gap(kind, Omega, a, p)) < tolerance * np.hypot(across, up)


def check(data: dict[str, Any]) -> None:
    """The numbers of the module's head."""
    curves, sheets = data["curves"], data["sheets"]
    on_sheet(curves["PD"], st.Kind.PERIOD_DOUBLING, LIGHT, 1e-9)
    tips = {p.params["acceleration"] for p in curves["PD"].of_kind(st.Kind.EXTREMUM)}
    assert len(data["tongue"].tips) == 2
    assert all(min(abs(a / tip.y - 1) for a in tips) < 1e-8 for tip in data["tongue"].tips)
    end, doubling = curves["LP1"]["CP1"], curves["PD"]["GPD1"]
    assert abs(end.params["acceleration"] / doubling.params["acceleration"] - 1) < 1e-4
    assert abs(end.params["Omega"] - doubling.params["Omega"]) < 1e-5
    resonances = curves["NS"].of_kind(st.Kind.R4)
    assert len(resonances) == 2 and curves["NS"].status is st.Status.CLOSED_LOOP
    assert all(min(abs(m - 1j) for m in p.solution.multipliers) < 1e-7 for p in resonances)
    kinds = [sheet.meshes[0].kind for sheet in sheets]
    assert kinds.count(st.Kind.PERIOD_DOUBLING) >= 3 and kinds.count(st.Kind.BRANCH_POINT) >= 2
    for sheet, kind in zip(sheets, kinds):
        on_sheet(sheet, kind, DAMPED, 1e-9)


def draw(data: dict[str, Any], path: Path) -> None:
    """Both planes, acceleration on a logarithmic scale."""
    figure, (left, right) = _figure.panels(2, width=8.2, height=4.2)
    curves, kinds = data["curves"], st.Kind
    for k, border in enumerate(data["tongue"].boundaries):
        label = "linearised pendulum" if k == 0 else None
        left.plot(border.x, border.y, color=style.COLOURS["sky"], linewidth=6, alpha=0.6, label=label)
    rows = (
        ("PD", 0, "period doubling", (kinds.GENERALIZED_PERIOD_DOUBLING,)), ("LP1", 1, "fold", ()),
        ("LP2", 1, None, ()), ("NS", 2, "torus", ()),
    )  # fmt: skip
    for name, colour, label, marked in rows:
        curves[name].plot(ax=left, y="acceleration", color=style.SERIES[colour], label=label, kinds=marked)
    for point in curves["NS"].of_kind(kinds.R4):
        place, side = (point.params["Omega"], point.params["acceleration"]), 1 if point.params["Omega"] > 0.99 else -1
        left.plot(*place, **style.marker(kinds.R4, style.SERIES[2]))
        left.annotate(
            "1:4", place, xytext=(6 * side, 0), textcoords="offset points", va="center", fontsize="small",
            ha="left" if side > 0 else "right", color=style.SERIES[2],
        )  # fmt: skip
    left.set(xlim=WINDOW, ylim=HEIGHT, yscale="log", ylabel="base acceleration $a$ (g)")
    named: set[st.Kind] = set()
    for sheet in data["sheets"]:
        kind = sheet.meshes[0].kind
        label = None if kind in named else f"multiplier ${SIGN[kind]:+d}$"
        colour = style.SERIES[0] if kind is kinds.PERIOD_DOUBLING else style.COLOURS["vermilion"]
        look = dict(linewidth=2.0) if kind is kinds.PERIOD_DOUBLING else dict(linewidth=1.0, zorder=3)
        sheet.plot(ax=right, y="acceleration", color=colour, label=label, kinds=(), **look)
        named.add(kind)
    right.set(xlim=(0.45, 1.7), ylim=(0.01, 3.0), yscale="log", ylabel="")
    for axis, name in ((left, "(a)"), (right, "(b)")):
        _figure.letter(axis, name)
        axis.legend(**{**style.ABOVE, "ncols": 2})
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
