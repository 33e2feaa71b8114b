"""The quadrupole mass filter: first stability region in the (q, a) plane, cosine drive and rectangular drive.

The filter transmits where both directions are stable. Checked: apex (q, a) = (0.705996, 0.236994) as the crossing of
-a_0(q) and b_1(q) found apart from the chart, cut-off q = 0.908046 at a = 0 as the zero of b_1(q) - i.e. of the first
characteristic value -, and that the chart's class agrees with both on either side.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st


def bisected(f: Any, lo: float, hi: float) -> float:
    """Zero of f in [lo, hi] by bisection, to the last bits."""
    sign = f(lo) > 0
    for _ in range(60):
        middle = 0.5 * (lo + hi)
        lo, hi = (middle, hi) if (f(middle) > 0) == sign else (lo, middle)
    return 0.5 * (lo + hi)


def compute() -> dict[str, Any]:
    """Charts, apex and cut-off."""
    window = dict(x=("q", 0.0, 1.0), y=("a", 0.0, 0.3), shape=(600, 500))
    apex_q = bisected(lambda q: float(st.mathieu_b(1, q) + st.mathieu_a(0, q)), 0.5, 0.9)
    return {
        "cosine": st.chart(st.models.paul_trap(), **window),
        "rectangular": st.chart(st.models.paul_trap(duty=0.5), **window),
        "apex": (apex_q, -float(st.mathieu_a(0, apex_q))),
        "cut-off": bisected(lambda q: float(st.mathieu_b(1, q)), 0.5, 1.0),
    }


def check(data: dict[str, Any]) -> None:
    """Published apex and cut-off; the chart's classes around them."""
    q, a = data["apex"]
    assert abs(q - 0.7059961) < 5e-7 and abs(a - 0.2369940) < 5e-7
    assert abs(data["cut-off"] - 0.9080463) < 5e-7
    chart = data["cosine"]
    outside = [chart.at(q=q, a=a * (1 + 1e-6)), chart.at(q=data["cut-off"] * (1 + 1e-6), a=0.0)]
    inside = [chart.at(q=q, a=a * (1 - 1e-4)), chart.at(q=data["cut-off"] * (1 - 1e-6), a=0.0)]
    assert all(point.verdict is st.Verdict.UNSTABLE for point in outside)
    assert not any(point.verdict is st.Verdict.UNSTABLE for point in inside)
    # rectangular drive, a = 0: stable up to 2 q = (0.7125...)^-1 scale; closed form: Meissner's trace at p^2 = +-2q
    q_edge = bisected(lambda x: np.cos(np.sqrt(2 * x) * np.pi / 2) * np.cosh(np.sqrt(2 * x) * np.pi / 2) + 1, 0.3, 1.0)
    assert data["rectangular"].at(q=q_edge * 1.0001, a=0.0).verdict is st.Verdict.UNSTABLE
    assert data["rectangular"].at(q=q_edge * 0.9999, a=0.0).verdict is not st.Verdict.UNSTABLE


def draw(data: dict[str, Any], path: Path) -> None:
    """Cosine and rectangular drive side by side."""
    figure, axes = _figure.panels(2, width=7.2, height=3.2, sharey=True)
    data["cosine"].plot("class", ax=axes[0])
    data["rectangular"].plot("class", ax=axes[1])
    axes[0].plot(*data["apex"], "k.")
    axes[0].annotate(f"apex ({data['apex'][0]:.4f}, {data['apex'][1]:.4f})", data["apex"], xytext=(-6, 4),
                     textcoords="offset points", ha="right", fontsize="small")
    _figure.letter(axes[0], "(a) cosine drive")
    _figure.letter(axes[1], "(b) square drive")
    axes[1].set_ylabel("")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
