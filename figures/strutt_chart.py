"""Strutt chart of equation (40) without and with damping, and the first-order tongue over it.

    q'' + 2 delta q' + (a + b cos t) q = 0

(a) delta = 0: boundaries are Mathieu's characteristic values, 4 a = a_n(q), b_n(q) with q = 2 b.
(b) delta = 0.05: each tongue opens at a depth of its own; averaging, to first order, puts the edges of the first at

    (a - 1/4)^2 = b^2/4 - delta^2,      growth rate  -delta + sqrt(b^2/4 - (a - 1/4)^2),

so that it opens at b = 2 delta.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

DELTA = 0.05
X, Y = ("a", -0.6, 3.0), ("b", 0.0, 2.2)


def compute() -> dict[str, Any]:
    """Both charts, and the averaged tongue."""
    undamped = st.chart(st.models.mathieu(delta=0.0), x=X, y=Y, shape=(900, 600))
    damped = st.chart(st.models.mathieu(delta=DELTA), x=X, y=Y, shape=(900, 600))
    b = np.linspace(2 * DELTA, 1.0, 200)
    half_width = np.sqrt(b**2 / 4 - DELTA**2)
    return {"undamped": undamped, "damped": damped, "b": b, "left": 0.25 - half_width, "right": 0.25 + half_width}


def check(data: dict[str, Any]) -> None:
    """Undamped edges are characteristic values; the damped tip is 2 delta up to second order in delta."""
    undamped, damped = data["undamped"], data["damped"]
    for b in (0.3, 0.9, 1.7):
        edges = [float(f(n, 2 * b)) / 4 for f in (st.mathieu_a, st.mathieu_b) for n in (1, 2, 3)]
        inside = [a for a in edges if X[1] < a < X[2]]
        assert len(inside) >= 4
        for a in inside:
            assert abs(abs(undamped.at(a=a, b=b).multipliers.sum()) - 2) < 1e-9
    assert undamped.error < 1e-8 and damped.error < 1e-8
    first = min((tip for tip in damped.tips), key=lambda tip: tip.y)
    assert abs(first.y - 2 * DELTA) < DELTA**2 and abs(first.x - 0.25) < DELTA**2
    depths = [tip.y for tip in sorted(damped.tips, key=lambda tip: tip.order)]
    assert len(depths) >= 3 and depths == sorted(depths), "higher tongues open later"
    # weak modulation: growth at the centre of the first tongue as averaging has it, up to second order
    assert abs(damped.at(a=0.25, b=0.25).exponents.real.max() - (0.125 - DELTA)) < 0.25**2 / 4


def draw(data: dict[str, Any], path: Path) -> None:
    """Two panels with one scale of growth."""
    figure, (left, right) = _figure.panels(2, width=7.2, height=3.3, sharey=True)
    top = float(max(data["undamped"].growth_rate.max(), data["damped"].growth_rate.max()))
    data["undamped"].plot(ax=left, vmax=top, colorbar=False)
    data["damped"].plot(ax=right, vmax=top, legend=False)
    dots = {"color": style.COLOURS["black"], "linestyle": (0, (1, 1)), "linewidth": 1.5}
    (averaged,) = right.plot(data["left"], data["b"], **dots)
    right.plot(data["right"], data["b"], **dots)
    right.legend([averaged], ["averaging, first order"], **style.ABOVE)
    right.set_ylabel("")
    _figure.letter(left, r"(a) $\delta = 0$")
    _figure.letter(right, rf"(b) $\delta = {DELTA}$")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
