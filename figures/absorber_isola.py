"""A nonlinear absorber: a detached resonance is born, grows, and merges with the main branch.

x'' + eps l1 x' + x + eps (l2 r' + kappa r^3) = eps F cos(Omega t),  y'' = l2 r' + kappa r^3,  r = x - y: a linear
oscillator with a small mass (eps = 0.05) on a purely cubic spring, l1 = l2 = 0.1, kappa = 4/3. Harmonic balance with as
many harmonics as the motion needs. (a) Fold and torus curves over frequency and forcing: the left fold curve has a
minimum on its lower part, where the isola is born, and one on its upper part, where it merges with the main branch;
cusps where two folds meet. (b), (c) Responses between birth and merger, and after it.

Checked: with one harmonic |A + B z|^2 z = (eps F)^2, z = |r|^2, is exact: the fold curve, its extrema and the cusps are
those of this polynomial; with all harmonics birth and merger agree with collocation, and the number of families is 1,
2, 1 before birth, between, and after the merger; torus points of harmonic balance and collocation are the same.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import _figure
import numpy as np
import sympy as sp
from scipy.optimize import minimize_scalar

import stability as st
from stability.plots import style

WINDOW = (0.7, 1.3)
EPSILON, L1, L2, KAPPA = 0.05, 0.1, 0.1, 4 / 3
BETWEEN, AFTER = 0.6, 0.95
FINE = dict(ds_max=0.1)  # for a smooth picture


def absorber(forcing: float, frequency: float = 1.0) -> st.System:
    """The oscillator with its absorber."""
    t = sp.Symbol("t", real=True)
    x, y = (sp.Function(name)(t) for name in "xy")
    Omega, F = sp.symbols("Omega F", real=True)
    force = L2 * (x.diff(t) - y.diff(t)) + sp.Rational(4, 3) * (x - y) ** 3
    equations = {
        x.diff(t, 2): -EPSILON * L1 * x.diff(t) - x - EPSILON * force + EPSILON * F * sp.cos(Omega * t),
        y.diff(t, 2): force,
    }
    return st.System.from_equations(
        equations, coordinates=[x, y], period=2 * sp.pi / Omega, parameters={"Omega": frequency, "F": forcing},
        name="oscillator with cubic absorber",
    )  # fmt: skip


def exact_folds(Omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """F of the (lower, upper) fold with one harmonic: the extrema over z of |A + B z|^2 z; nan where there is none."""
    D = 1 - Omega**2 + 1j * Omega * EPSILON * L1
    coupled = EPSILON - D / Omega**2
    A, B = D + 1j * Omega * L2 * coupled, 0.75 * KAPPA * coupled
    mixed, aa, bb = (A * np.conj(B)).real, abs(A) ** 2, abs(B) ** 2
    inside = 4 * mixed**2 - 3 * aa * bb
    inside = np.where(abs(inside) < 1e-10 * aa * bb, 0.0, inside)  # at a cusp it is rounding
    with np.errstate(invalid="ignore"):
        root = np.sqrt(inside)
        z = [(-2 * mixed + sign * root) / (3 * bb) for sign in (1, -1)]
        lower, upper = (np.sqrt(aa * s + 2 * mixed * s**2 + bb * s**3) / EPSILON for s in z)
    return lower, upper


def fold_curves(make: Any) -> tuple[st.Branch, st.Branch]:
    """Fold curves of the isola and of the main resonance by one discretisation; the isola is found along F."""
    left = st.continuation(make(absorber(0.5, 0.95)), "F", (0.001, 2.0))
    (detached, *_) = left.at(F=BETWEEN)[1:]
    isola = st.continuation(make(absorber(BETWEEN)), "Omega", WINDOW, start=detached)
    main = st.continuation(make(absorber(BETWEEN)), "Omega", WINDOW)
    folds = [st.continuation(st.locus(branch["LP1"], free="F"), "Omega", WINDOW, **FINE) for branch in (isola, main)]
    return folds[0], folds[1]


def compute() -> dict[str, Any]:
    """Curves by harmonic balance with 1 and all harmonics and by collocation; responses; torus points."""
    with warnings.catch_warnings():  # one harmonic is too few, and says so: it is the one with a closed form
        warnings.simplefilter("ignore", st.errors.TruncationWarning)
        data: dict[str, Any] = {"exact": fold_curves(lambda system: st.HarmonicBalance(system, harmonics=1))}
    data |= {"curves": fold_curves(st.HarmonicBalance), "collocation": fold_curves(st.Collocation)}
    for name, forcing in (("before", 0.23), ("between", BETWEEN), ("after", AFTER)):
        data[name] = st.families(st.HarmonicBalance(absorber(forcing)), "Omega", WINDOW, places=4, **FINE)
    data["orbits"] = st.continuation(st.Collocation(absorber(BETWEEN)), "Omega", WINDOW)
    seven = st.continuation(st.HarmonicBalance(absorber(BETWEEN), harmonics=7), "Omega", WINDOW)
    data["torus"] = st.continuation(st.locus(seven["NS1"], free="F"), "Omega", (0.88, 1.2))
    return data


def extrema(curve: st.Branch) -> tuple[np.ndarray, np.ndarray]:
    """(Omega, F) of birth and merger."""
    (birth,), (merger,) = curve.of_kind(st.Kind.ISOLA_CENTRE), curve.of_kind(st.Kind.ISOLA_MERGER)
    return tuple(np.array([p.params["Omega"], p.params["F"]]) for p in (birth, merger))  # type: ignore[return-value]


def check(data: dict[str, Any]) -> None:
    """One harmonic against its polynomial; all harmonics against collocation; the count of families."""
    for curve in data["exact"][:2]:
        Omega, F = curve.columns["Omega"], curve.columns["F"]
        gap = np.nanmin(np.abs(np.array(exact_folds(Omega)) - F), axis=0)
        assert gap.max() < 1e-6, gap.max()
    birth, merger = extrema(data["exact"][0])
    lowest = minimize_scalar(lambda w: exact_folds(np.array(w))[0], bracket=(0.9, 0.945, 0.96), tol=1e-12)
    saddle = minimize_scalar(lambda w: exact_folds(np.array(w))[1], bracket=(0.94, 0.963, 0.97), tol=1e-12)
    for point, exact in ((birth, lowest), (merger, saddle)):
        assert abs(point[1] - exact.fun) < 1e-9 and abs(point[0] - exact.x) < 1e-6, (point, exact.x, exact.fun)

    for ours, theirs in zip(extrema(data["curves"][0]), extrema(data["collocation"][0])):
        assert np.abs(ours - theirs).max() < 1e-6, (ours, theirs)
    birth, merger = extrema(data["curves"][0])
    assert 0.23 < birth[1] < BETWEEN < merger[1] < AFTER
    assert [len(data[name]) for name in ("before", "between", "after")] == [1, 2, 1]
    assert data["between"][1].status is st.Status.CLOSED_LOOP
    for curve, other in zip(data["curves"][:2], data["collocation"]):
        cusps = [[(p.params["Omega"], p.params["F"]) for p in c.of_kind(st.Kind.CUSP)] for c in (curve, other)]
        assert len(cusps[0]) == 1 and np.allclose(*cusps, rtol=0, atol=1e-6), cusps
    pair = data["between"][0], data["orbits"]
    torus = [sorted(p.params["Omega"] for p in branch.of_kind(st.Kind.NEIMARK_SACKER)) for branch in pair]
    assert len(torus[0]) == 2 and np.allclose(*torus, rtol=0, atol=1e-8), torus


def draw(data: dict[str, Any], path: Path) -> None:
    """Curves over two parameters, and two responses."""
    figure, axes = _figure.panels(3, width=10.5, height=3.6)
    isola, main = data["curves"]
    shown = (st.Kind.CUSP, st.Kind.ISOLA_CENTRE, st.Kind.ISOLA_MERGER)
    isola.plot(ax=axes[0], y="F", kinds=shown, label="folds")
    main.plot(ax=axes[0], y="F", color=style.SERIES[2], kinds=(st.Kind.CUSP,), label="folds, main")
    data["torus"].plot(ax=axes[0], y="F", color=style.SERIES[1], kinds=(), label="torus")
    for forcing in (BETWEEN, AFTER):
        axes[0].axhline(forcing, color="0.8", linewidth=0.8, zorder=0)
    axes[0].set_ylim(0, 1.5)
    axes[0].set_xlim(0.85, 1.25)
    axes[0].legend(fontsize="small", frameon=False, loc="lower right", handlelength=1.2)
    _figure.letter(axes[0], "(a) curves of special points")
    for axis, name, forcing, mark in ((axes[1], "between", BETWEEN, "b"), (axes[2], "after", AFTER, "c")):
        first, *others = data[name]
        first.plot(ax=axis, y="x.max", label="main branch")
        for other in others:
            other.plot(ax=axis, y="x.max", color=style.SERIES[2], label="isola")
        axis.set_xlim(0.85, 1.25)
        axis.set_yscale("log")
        axis.legend(fontsize="small", frameon=False, loc="upper right")
        _figure.letter(axis, f"({mark}) F = {forcing:g}")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
