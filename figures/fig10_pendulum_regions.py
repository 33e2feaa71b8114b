"""Figure 10, regions: the base-driven pendulum over excitation frequency and amplitude, with the chapter's points.

Pendulum of 108.1 mm, no damping, w2 = sqrt(g/l) = 9.526 rad/s. Points: A = 100 mm at w = w2 (1:1, unstable, exponent
0.745666 1/s: the beat of figure 10), A = 100 mm at w = 10 rad/s (printed, but stable), A = 10 mm at w = 2 w2 (2:1,
exponent 0.87774 1/s). Checked: these exponents, the 1:1 interval 8.485 ... 9.880 rad/s at A = 100 mm, and the 2:1
interval 17.53 ... 21.16 rad/s at A = 10 mm, both against Mathieu's characteristic values.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import _figure

import stability as st
from stability.plots import style

LENGTH, G = 0.1081, 9.81
W2 = math.sqrt(G / LENGTH)


def compute() -> dict[str, Any]:
    """The chart and the exponents at the operating points."""
    pendulum = st.models.base_driven_pendulum.from_physical(length=LENGTH)
    points = {"1:1": (W2, 0.1), "10 rad/s": (10.0, 0.1), "2:1": (2 * W2, 0.01)}
    return {
        "chart": st.chart(pendulum, x=("frequency", 0.8, 4.5), y=("amplitude", 0.0, 0.12), shape=(800, 500)),
        "points": points,
        "exponents": {
            name: st.monodromy(pendulum, frequency=w / (2 * math.pi), amplitude=A).exponents.real.max()
            for name, (w, A) in points.items()
        },
    }


def check(data: dict[str, Any]) -> None:
    """The catalogue's numbers, and the edges of both tongues from Mathieu's characteristic values."""
    exponents = data["exponents"]
    assert abs(exponents["1:1"] - 0.745666) < 5e-7
    assert abs(exponents["2:1"] - 0.87774) < 5e-6
    assert abs(exponents["10 rad/s"]) < 1e-9
    q = 2 * 0.1 / LENGTH  # q_M = 2 A/l at every frequency; a_M = 4 w2^2/w^2
    low, high = (2 * W2 / math.sqrt(value) for value in (float(st.mathieu_a(2, q)), float(st.mathieu_b(2, q))))
    assert abs(low - 8.485) < 1e-3 and abs(high - 9.880) < 1e-3
    q = 2 * 0.01 / LENGTH
    low1, high1 = (2 * W2 / math.sqrt(value) for value in (float(st.mathieu_a(1, q)), float(st.mathieu_b(1, q))))
    assert abs(low1 - 17.53) < 5e-3 and abs(high1 - 21.16) < 5e-3
    for edge, A in ((low, 0.1), (high, 0.1), (low1, 0.01), (high1, 0.01)):
        inside = 1e-5 * (1 if edge in (low, low1) else -1)
        verdicts = [
            data["chart"].at(frequency=edge * (1 + s * inside) / (2 * math.pi), amplitude=A).verdict for s in (1, -1)
        ]
        assert verdicts == [st.Verdict.UNSTABLE, st.Verdict.NEUTRAL], (edge, verdicts)


def draw(data: dict[str, Any], path: Path) -> None:
    """The chart with the three points."""
    figure, axis = _figure.panels(width=6.4, height=4.0)
    data["chart"].plot(ax=axis)
    places = {"1:1": (1.62, 0.05, "left"), "10 rad/s": (1.66, 0.078, "left"), "2:1": (2.85, 0.024, "center")}
    for marker, (name, (w, A)) in zip("o^s", data["points"].items(), strict=True):
        growth = data["exponents"][name]
        text = f"{name}\n{growth:.3f} 1/s" if growth > 1e-6 else f"{name}\nstable"
        x, y, side = places[name]
        axis.annotate(text, (w / (2 * math.pi), A), xytext=(x, y), ha=side, va="center", fontsize="small",
                      arrowprops=dict(arrowstyle="-", linewidth=0.7))
        axis.plot(w / (2 * math.pi), A, marker, color="white", markeredgecolor=style.COLOURS["black"], markersize=7)
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
