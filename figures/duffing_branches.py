"""Branches of Duffing oscillators: stability at every point, folds, a detached family, broken symmetry.

(a) u'' + 2 xi u' + u + beta u^3 = Omega^2 cos(Omega tau), xi = 0.02, beta = 0.001: a closed peak with two folds.
(b) beta = 0.05 > 16 xi^2/3: the resonance is open; the family that comes from low frequency rises without a fold, the
other one is detached from it and has the only fold. (c) x'' + 0.1 x' + x + x^3 = 5 cos(omega t): the symmetric branch
loses its stability at two branch points, between which the asymmetric pair lives.

Checked: the folds 1.380933030, 1.088436639 and 1.416368134 (also from the other end), a multiplier +1 at each of them,
no fold on the rising family, each asymmetric orbit the mirror image of its partner.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.errors import OpenResonanceWarning
from stability.plots import style

WINDOW = (0.3, 3.0)
FINE = dict(ds_max=0.05)  # for a smooth picture; the folds do not need it


def compute() -> dict[str, Any]:
    """Five branches."""
    closed = st.Collocation(st.models.duffing(xi=0.02, beta=0.001))
    opened = st.Collocation(st.models.duffing(xi=0.02, beta=0.05))
    textbook = st.Collocation(st.models.duffing_textbook(delta=0.1, alpha=1, beta=1, gamma=5))
    symmetric = st.continuation(textbook, "omega", (0.6, 2.5), **FINE)
    with warnings.catch_warnings(record=True) as caught:  # the library says that the resonance is open
        warnings.simplefilter("always", OpenResonanceWarning)
        rising = st.continuation(opened, "Omega", WINDOW, **FINE)
        detached = st.continuation(opened, "Omega", WINDOW[::-1], **FINE)
    return {
        "warnings": [w.category for w in caught],
        "closed": st.continuation(closed, "Omega", WINDOW, **FINE),
        "closed, from above": st.continuation(closed, "Omega", WINDOW[::-1]),
        "rising": rising,
        "detached": detached,
        "symmetric": symmetric,
        "asymmetric": st.continuation(st.switch(symmetric["BP1"]), "omega", (0.6, 2.5), **FINE),
    }


def check(data: dict[str, Any]) -> None:
    """Folds by number and by their multiplier; stability between them; symmetry."""
    for name in ("closed", "closed, from above"):
        folds = sorted(p.params["Omega"] for p in data[name].of_kind(st.Kind.FOLD))
        assert np.allclose(folds, [1.088436639, 1.380933030], rtol=0, atol=2e-9), folds
    assert data["warnings"] and set(data["warnings"]) == {OpenResonanceWarning}
    assert not data["rising"].special and data["rising"].count(st.Verdict.UNSTABLE) == 0
    (fold,) = data["detached"].special
    assert fold.kind is st.Kind.FOLD and abs(fold.params["Omega"] - 1.416368134) < 2e-9
    for point in (*data["closed"].special, fold):
        assert np.abs(point.multipliers - 1).min() < 1e-6
    verdicts = [str(orbit.verdict) for orbit in data["closed"].at(Omega=1.2)]
    assert verdicts == ["stable", "unstable", "stable"]

    symmetric, asymmetric = data["symmetric"], data["asymmetric"]
    births = [p.params["omega"] for p in symmetric.of_kind(st.Kind.BRANCH_POINT)]
    assert len(births) == 2 and asymmetric.status is st.Status.CLOSED_LOOP
    middle = sum(births) / 2
    (other,) = {orbit.verdict for orbit in symmetric.at(omega=middle)}
    assert other is st.Verdict.UNSTABLE
    pair = asymmetric.at(omega=births[0] + 0.05)
    tops, bottoms = sorted(o.max["x"] for o in pair), sorted(-o.min["x"] for o in pair)
    assert len(pair) == 2 and np.allclose(tops, bottoms, rtol=1e-7) and tops[1] - tops[0] > 0.05


def draw(data: dict[str, Any], path: Path) -> None:
    """Three bifurcation diagrams."""
    figure, axes = _figure.panels(3, width=9.5, height=3.3)
    data["closed"].plot(ax=axes[0])
    axes[0].set_ylim(-1, 39)
    _figure.letter(axes[0], r"(a) $\beta$ = 0.001")
    data["rising"].plot(ax=axes[1], label="from below")
    data["detached"].plot(ax=axes[1], color=style.SERIES[2], label="detached, from above")
    axes[1].legend(fontsize="small", frameon=False, loc="upper left")
    _figure.letter(axes[1], r"(b) $\beta$ = 0.05")
    data["symmetric"].plot(ax=axes[2], label="symmetric")
    data["asymmetric"].plot(ax=axes[2], color=style.SERIES[2], kinds=(st.Kind.FOLD,), labels=False, label="asymmetric")
    axes[2].legend(fontsize="small", frameon=False, loc="lower right")
    _figure.letter(axes[2], "(c) 5 cos $\\omega t$")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
