"""Duffing's response and backbone by every method on one axes, and how far each is from the others at the peak.

u'' + 2 xi u' + u + beta u^3 = Omega^2 cos(Omega tau), xi = 0.02, beta = 0.001. (a) Responses by collocation (grey),
averaging to first and second order, harmonic balance with three harmonics, a sweep up and a sweep down; backbones:
numeric (a free motion by harmonic balance) and Omega^2 = 1 + 3/4 beta a^2 (+ 3/128 beta^2 a^4 at the second order).
(b) The peak enlarged.

Checked: folds 1.380933030 and 1.088436639; those of averaging from the discriminant of its cubic; errors of the folds
fall from method to method; the numeric backbone against elliptic functions to 1e-9, its series to their own orders;
the phase resonance of one-term balance lies on the first-order backbone; sweeps on the stable branches, jumps at folds.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import _figure
import numpy as np
import sympy as sp

import stability as st
from stability.errors import TruncationWarning, UnsettledWarning
from stability.plots import style

XI, BETA = 0.02, 0.001
WINDOW = (0.6, 1.8)
METHODS = ("averaging", "averaging2", "hb3", "collocation", "sweep")
LABELS = {"averaging": "averaging, order 1", "averaging2": "averaging, order 2", "hb3": "3 harmonics"}
TRUTH = (1.088436639, 1.380933030)


def compute() -> dict[str, Any]:
    """All responses, and the backbones on a grid of fundamental amplitudes."""
    system = st.models.duffing(xi=XI, beta=BETA)
    with warnings.catch_warnings():  # three harmonics on purpose; sweeps are drawn where they have settled
        for kind in (TruncationWarning, UnsettledWarning):
            warnings.simplefilter("ignore", kind)
        found = st.responses(system, "Omega", WINDOW, METHODS, points=121, step=0.02)
    backbone = st.continuation(st.Backbone(system, harmonics=15), "amplitude", (0.1, 45.0))
    a, symbols = np.linspace(0.1, 45.0, 200), (sp.Symbol("a", positive=True), sp.Symbol("beta", real=True))
    undamped = {sp.Symbol("xi", real=True): 0}
    laws = [st.frequency_law(system, order=order, squared=True).subs(undamped) for order in (1, 2)]
    series = [np.sqrt(sp.lambdify(symbols, law)(a, BETA)) for law in laws]
    return {"responses": found, "backbone": backbone, "a": a, "series": series}


def check(data: dict[str, Any]) -> None:
    """Numbers of the head of this file."""
    found, backbone = data["responses"], data["backbone"]
    rows = {row["method"]: row for row in found.rows()}
    assert not found.failures and np.allclose(rows["collocation"]["folds"], TRUTH, rtol=0, atol=2e-9)
    closed = sorted(place for place, _ in st.duffing_folds(xi=XI, beta=BETA))
    assert np.allclose(rows["averaging"]["folds"], closed, rtol=0, atol=1e-9)
    size = [max(map(abs, rows[name]["fold_errors"])) for name in ("averaging", "averaging2", "hb3")]
    assert 8e-3 < size[0] < 9e-3 and 3e-3 < size[1] < 4e-3 and size[2] < 2e-5, size
    # the backbone: amplitude of the fundamental and frequency of the exact free motion with the same largest value
    for top, fundamental, omega in zip(*(backbone.columns[k] for k in ("u.max", "u.amplitude(1)", "omega"))):
        exact = st.duffing_motion(amplitude=top, beta=BETA)
        assert abs(omega / exact.frequency - 1) < 1e-9 and abs(fundamental / exact.harmonic(1) - 1) < 1e-9
    z = BETA * backbone.columns["u.amplitude(1)"] ** 2
    squares = backbone.columns["omega"] ** 2
    for order, series in ((1, 1 + 0.75 * z), (2, 1 + 0.75 * z + 3 / 128 * z**2)):
        assert (np.abs(series - squares) < 0.03 * z ** (order + 1) + 1e-12).all()
    Omega, peak = st.duffing_peak(xi=XI, beta=BETA)
    assert abs(np.sqrt(1 + 0.75 * BETA * peak**2) - Omega) < 1e-12
    for name, fold in (("sweep-up", TRUTH[1]), ("sweep-down", TRUTH[0])):
        (jump,) = rows[name]["jumps"]
        assert abs(jump - fold) < 3e-3 and rows[name]["largest_error"] < 2e-3


def draw(data: dict[str, Any], path: Path) -> None:
    """The whole response, and its peak."""
    figure, axes = _figure.panels(2, width=8.4, height=3.9, width_ratios=(1.25, 1))
    found, grey = data["responses"], style.COLOURS["grey"]
    column = found.quantity
    for k, axis in enumerate(axes):
        for branch in found["collocation"]:
            branch.plot(ax=axis, y=column, color=grey, linewidth=3.0, kinds=(), label="collocation")
        for colour, (name, label) in zip(style.SERIES[1:], LABELS.items()):
            for branch in found[name]:
                branch.plot(ax=axis, y=column, color=colour, linewidth=1.2, kinds=(), label=label)
        for name, marker in (("sweep-up", ">"), ("sweep-down", "<")):
            sweep = found[name]
            axis.plot(sweep.parameter[sweep.settled], sweep.amplitude(1)["u"][sweep.settled], marker, color="black",
                      markersize=3, markerfacecolor="none", markeredgewidth=0.6, linestyle="none",
                      label=name.replace("-", " "))  # fmt: skip
        looks = ((":", "order 1"), ("-.", "order 2"))
        axis.plot(data["backbone"].columns["omega"], data["backbone"].columns["u.amplitude(1)"], color="black",
                  linewidth=0.8, label="backbone")  # fmt: skip
        for (dashes, word), series in zip(looks, data["series"]):
            axis.plot(series, data["a"], dashes, color="black", linewidth=0.8, label=f"backbone, {word}")
        axis.set(xlabel=r"$\Omega$", ylabel="amplitude of $u$" if k == 0 else "")
    axes[0].set(xlim=(0.7, 1.6), ylim=(0, 44))
    axes[1].set(xlim=(1.30, 1.42), ylim=(29, 37.5))
    axes[0].legend(fontsize="x-small", frameon=False, loc="upper left")
    _figure.letter(axes[0], "(a) response and backbone")
    _figure.letter(axes[1], "(b) the peak")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
