"""The pendulum as an absorber: reduction of the primary motion, saturation over acceleration, effect of detuning.

The set of figure 13 in SI units: m1 = 40 g, m2 = 10 g, w1 = 2 w2 = 2 pi 22.22 Hz, xi1 = xi2 = 0.021, constant base
acceleration (so that the base amplitude A(w) = acceleration/w^2 falls with the frequency).
(a) 20 log10(y_pendulum/y_rest) over the frequency at 0.02, 0.05 and 0.2 g, y the largest displacement of the primary
relative to the base on the swinging branch, y_rest with the pendulum at rest, at the same frequency.
(b) y and phi over the acceleration at 22.22 Hz: beyond the threshold the primary stays where it is, the pendulum takes
what is added. (c) y over the tuning Omega0 = w2/w1 at Omega = 1 for 0.02 and 0.05 g (dimensionless, in units of A).

Checked: y_rest against the linear response; threshold acceleration/g = 4 xi2/|U_abs| (averaging) within 1 %; saturation
within 2 % up to ten times the threshold; at 0.2 g the reduction at 22.22 Hz is 30.5 dB, by simulation too.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

G, HERTZ, XI = 9.81, 22.22, 0.021
LEVELS = (0.02, 0.05, 0.2)
TUNING = (0.02, 0.05)
SET = dict(xi1=XI, xi2=XI, mass_ratio_total=0.2, Omega0=0.5)


def _born(problem: Any, name: str, window: tuple[float, float], **options: Any) -> tuple[Any, Any]:
    """The branch at rest, and the branch that is born at its last period doubling."""
    rest = st.continuation(problem, name, window, **options)
    return rest, st.continuation(st.switch(rest.of_kind(st.Kind.PERIOD_DOUBLING)[-1]), name, window, **options)


def compute() -> dict[str, Any]:
    """Branches over frequency, acceleration and tuning; a simulation."""
    pendulum = st.models.autoparametric_pendulum.from_physical()
    over_frequency = {}
    for level in LEVELS:
        problem = st.Collocation(pendulum.with_params(acceleration=level * G))
        over_frequency[level] = _born(problem, "frequency", (12.0, 35.0), ds_max=0.05)
    tuned = {}
    for level in TUNING:
        system = st.models.autoparametric_pendulum.from_acceleration(acceleration=level, **SET)
        tuned[level] = _born(st.Collocation(system), "Omega0", (0.3, 0.8), ds_max=0.05)
    steady = st.simulate(pendulum, (0.0, 400 / HERTZ), x0=dict(phi=0.01))
    return {
        "frequency": over_frequency,
        "acceleration": _born(st.Collocation(pendulum), "acceleration", (0.001 * G, 0.4 * G), ds_max=0.05),
        "tuning": tuned,
        "simulated": float(np.abs(steady(np.linspace(380, 400, 4001) / HERTZ)[0]).max()),
    }


def at_rest(frequency: Any, acceleration: float) -> Any:
    """Displacement (m) of the linear oscillator relative to its base."""
    W = np.asarray(frequency) / HERTZ
    return acceleration / (2 * math.pi * HERTZ) ** 2 / np.abs(1 - W**2 + 2j * XI * W)


def check(data: dict[str, Any]) -> None:
    """Closed forms at rest, averaging at the threshold, saturation, simulation."""
    for level, (rest, swing) in data["frequency"].items():
        exact = at_rest(rest.parameter, level * G)
        assert np.allclose(rest.columns["y.max"], exact, rtol=1e-7)
        assert swing.status is st.Status.CLOSED_LOOP
    rest, swing = data["acceleration"]
    threshold = rest["PD1"].params["acceleration"]
    averaged = G * 4 * XI / abs(1 + 1 / (2j * XI))
    assert abs(threshold / averaged - 1) < 1e-2
    inside = swing.parameter < 10 * threshold
    held = swing.columns["y.max"] / at_rest(HERTZ, threshold)
    assert inside.sum() > 5 and np.abs(held[inside] - 1).max() < 0.02
    (orbit,) = (o for o in data["frequency"][0.2][1].at(frequency=HERTZ) if o.verdict is st.Verdict.STABLE)
    largest = max(orbit.max["y"], -orbit.min["y"])
    assert abs(data["simulated"] / largest - 1) < 1e-3
    assert abs(20 * math.log10(largest / at_rest(HERTZ, 0.2 * G)) + 30.52) < 0.01
    for rest, swing in data["tuning"].values():
        low, high = (p.params["Omega0"] for p in rest.special)
        assert low < 0.5 < high and swing.count(st.Verdict.UNSTABLE) == 0


def _reduction(axis: Any, data: dict[str, Any]) -> None:
    for color, (level, (_, swing)) in zip(style.SERIES, data["frequency"].items()):
        ratio = swing.columns["y.max"] / at_rest(swing.parameter, level * G)
        name: str | None = f"{level:g} g"
        for segment in swing.segments():
            part = slice(segment.start, segment.stop)
            axis.plot(swing.parameter[part], 20 * np.log10(ratio[part]), color=color, **style.line(segment.verdict),
                      label=name if segment.verdict is st.Verdict.STABLE else None)
            name = None if segment.verdict is st.Verdict.STABLE else name
    axis.axhline(0.0, color=style.COLOURS["grey"], linewidth=0.8)
    axis.set(xlabel="frequency (Hz)", ylabel="primary: with over without pendulum (dB)")
    axis.legend(fontsize="small", frameon=False)
    _figure.letter(axis, "(a) reduction")


def _saturation(axis: Any, data: dict[str, Any]) -> None:
    for branch, color in zip(data["acceleration"], (style.COLOURS["black"], style.COLOURS["blue"])):
        for segment in branch.segments():
            part = slice(segment.start, segment.stop)
            axis.plot(branch.parameter[part] / G, 1000 * branch.columns["y.max"][part], color=color,
                      **style.line(segment.verdict))
    swing = data["acceleration"][1]
    axis.set(xlabel="base acceleration (g)", ylabel="max $y$ (mm)", ylim=(0, 0.3), xlim=(0, 0.4))
    twin = axis.twinx()
    twin.plot(swing.parameter / G, swing.columns["phi.max"], color=style.COLOURS["orange"], linewidth=1.2)
    twin.set_ylabel(r"max $\varphi$ (rad), orange")
    twin.set_ylim(0, 2)
    axis.annotate("at rest", (0.035, 0.27), fontsize="small")
    axis.annotate("swings", (0.24, 0.055), fontsize="small", color=style.COLOURS["blue"])
    _figure.letter(axis, "(b) saturation at 22.22 Hz")


def draw(data: dict[str, Any], path: Path) -> None:
    """Three panels."""
    figure, axes = _figure.panels(3, width=10.5, height=3.5)
    _reduction(axes[0], data)
    _saturation(axes[1], data)
    data["tuning"][TUNING[0]][0].plot(ax=axes[2], y="u.max", kinds=(), label="at rest")
    for color, (level, (_, swing)) in zip(style.SERIES[1:], data["tuning"].items()):
        swing.plot(ax=axes[2], y="u.max", color=color, kinds=(), label=f"{level:g} g")
    axes[2].set(xlabel=r"tuning $\Omega_0 = \omega_2/\omega_1$", ylabel="max $y/A$ at $\\Omega$ = 1", ylim=(0, 26))
    axes[2].legend(fontsize="small", frameon=False, loc="lower right")
    _figure.letter(axes[2], "(c) detuning")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
