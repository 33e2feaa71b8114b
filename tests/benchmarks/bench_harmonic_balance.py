"""Frequency responses by harmonic balance beside other Python packages: ratios of processor time in one run, one thread.

Duffing: u'' + 2 xi u' + u + beta u^3 = Omega^2 cos(Omega t), xi = .02, beta = .001, Omega from .3 to 3, 7 harmonics.
Chain: two masses on a moving base, both springs cubic (xi = .021, mass ratio .42, beta = .0003), 15 harmonics. What each
delivers is printed beside its time: number of points, errors of the folds, stability. Folds of a peer that locates none
are the nearest of its points; "to 1e-9" is the same task as ours: steps so short that a quartic through the five points
about a turn has its fold to 1e-9 (found by halving). Peers that are not installed are left out:
pip install pyharm-os harmonicbalance mousai. NLvib (Octave) is not to be had as a package and is not among them.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_harmonic_balance.py
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import logging
import os
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import stability as st

FOLDS = np.array([1.38093302985, 1.08843663946])
XI, BETA, HARMONICS = 0.02, 0.001, 7
CHAIN = dict(xi1=0.021, xi2=0.021, mass_ratio_21=0.42, Omega0=1.0, beta1=0.0003, beta2=0.0003)


class Outcome(NamedTuple):
    """What one package delivered."""

    points: int
    folds: np.ndarray
    stability: str


def turning_points(Omega: np.ndarray) -> np.ndarray:
    """Values where a sequence turns: the nearest points to the folds."""
    steps = np.sign(np.diff(Omega))
    turns = np.flatnonzero(steps[:-1] * steps[1:] < 0) + 1
    return Omega[turns]


def fitted_turns(points: np.ndarray) -> np.ndarray:
    """Folds as extrema of the quartic through five points about every turn; the last unknown is Omega."""
    Omega = points[:, -1]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    steps, folds = np.sign(np.diff(Omega)), []
    for i in np.flatnonzero(steps[:-1] * steps[1:] < 0) + 1:
        near = slice(max(i - 2, 0), i + 3)
        fit = np.polynomial.Polynomial.fit(s[near] - s[i], Omega[near], len(s[near]) - 1)
        roots = fit.deriv().roots()
        folds.append(fit(min(roots[np.abs(roots.imag) < 1e-9].real, key=abs, default=0.0)))
    return np.array(folds)


def ours(problem: Callable[[], object]) -> Callable[[], Outcome]:
    def run() -> Outcome:
        branch = st.continuation(problem(), "Omega", (0.3, 3.0))
        folds = np.array([p.params["Omega"] for p in branch.of_kind(st.Kind.FOLD)])
        return Outcome(len(branch), folds, "every point")

    return run


def pyharm(
    M: np.ndarray, C: np.ndarray, K: np.ndarray, cubes: tuple[float, ...], harmonics: int, ds_max: float = 1.0
) -> Callable[[], Outcome]:
    """Masses on a moving base, cubic springs from the base to the first, from the first to the second."""
    connectors = {
        f"base {i}": {
            "type": "GOForcing", "connect": {"s": [i]}, "dirs": [0], "dto": 2, "ho": 1, "amp": -float(M[i, i]),
        }
        for i in range(len(M))
    }  # fmt: skip
    for i, k in enumerate(cubes):
        nodes = {"s": [0]} if i == 0 else {"s": [0], "INTERNAL": [1]}
        connectors[f"spring {i}"] = {"type": "CubicSpring", "connect": nodes, "dirs": [0], "k": k}
    model = {
        "analysis": {
            "FRF": {
                "study": "frf", "solver": "scipyroot", "puls_inf": 0.3, "puls_sup": 3.0, "ds_max": ds_max,
                "ds_min": 1e-8, "ds0": min(0.1, ds_max), "sign_ds": 1, "verbose": False,
            }
        },
        "system": {"type": "Base", "nh": harmonics, "nti": 4 * harmonics + 4, "adim": {"status": False}},
        "substructures": {"s": {"matrix": {"M": M, "C": C, "K": K}, "ndofs": 1}},
        "connectors": connectors,
    }  # fmt: skip

    def run() -> Outcome:
        folder = Path.cwd()
        with tempfile.TemporaryDirectory() as scratch:  # it writes into the current folder, when it is imported too
            os.chdir(scratch)
            try:
                from pyHarm.Maestro import Maestro

                maestro = Maestro(model)
                maestro.operate()
            finally:
                os.chdir(folder)
        points = np.array([s.x for s in maestro.nls["FRF"].SolList if s.flag_accepted])
        folds = turning_points(points[:, -1]) if ds_max == 1.0 else fitted_turns(points)
        return Outcome(len(points), folds, "none")

    return run


def duffing_in_pyharm(ds_max: float = 1.0) -> Callable[[], Outcome]:
    return pyharm(np.eye(1), np.eye(1) * 2 * XI, np.eye(1), (BETA,), HARMONICS, ds_max)


def chain_in_pyharm(ds_max: float = 1.0) -> Callable[[], Outcome]:
    ratio, xi = CHAIN["mass_ratio_21"], CHAIN["xi1"]
    pair, first = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.diag([1.0, 0.0])
    cubes = CHAIN["beta1"], ratio * CHAIN["beta2"]
    return pyharm(np.diag([1.0, ratio]), 2 * xi * (first + ratio * pair), first + ratio * pair, cubes, 15, ds_max)


def harmonicbalance() -> Outcome:
    from harmonicbalance.fourier import Fourier
    from harmonicbalance.predictorcorrector import PredictorCorrectorSolver

    def residual(X):  # type: ignore[no-untyped-def]
        Omega = X.omega
        F = Fourier(coeff_dc=0.0, coeffs_cos=np.eye(1, HARMONICS)[0] * Omega**2, omega=Omega, n=HARMONICS)
        return X.dt().dt() + 2 * XI * X.dt() + X + BETA * X**3 - F

    start = Fourier(omega=0.3, n=HARMONICS)
    start[1] = 0.1
    solver = PredictorCorrectorSolver(residual, start, alpha_start=0.3, alpha_end=3.0, alpha_step=0.1)
    solutions = solver.solve()
    Omega = np.array([s.omega for s in solutions])
    return Outcome(len(Omega), turning_points(Omega), "none")


def mousai() -> Outcome:
    from mousai import hb_time

    def acceleration(x, v, params):  # type: ignore[no-untyped-def]
        t, Om = params["cur_time"], params["omega"]
        return np.array([[-2 * XI * v - x - BETA * x**3 + Om**2 * np.cos(Om * t)]])

    x, count = np.zeros((1, 2 * HARMONICS + 1)), 0
    x[0, 1] = 0.1
    for Om in np.linspace(0.3, 3.0, 28):
        try:
            _, x, *_ = hb_time(
                acceleration, x0=x, omega=Om, num_harmonics=HARMONICS, eqform="second_order", params={"omega": Om}
            )
            count += 1
        except Exception:  # noqa: BLE001 - what a peer raises is its own; a point is lost
            continue
    return Outcome(count, np.zeros(0), "none")


def timed(run: Callable[[], Outcome], repeats: int) -> tuple[float, Outcome]:
    """Smallest processor time of some runs, the first (compilation) not counted."""
    outcome, best = run(), np.inf
    for _ in range(repeats):
        begin = time.process_time()
        outcome = run()
        best = min(best, time.process_time() - begin)
    return best, outcome


def table(entries: list[tuple[str, Callable[[], Outcome], int]], truth: np.ndarray) -> list[str]:
    """One line per entry; ratios to the first."""
    lines, first = [], None
    for name, run, repeats in entries:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            try:
                seconds, outcome = timed(run, repeats)
            except Exception as error:  # noqa: BLE001 - a peer that does not run is said, not hidden
                lines.append(f"{name:30s} failed: {type(error).__name__}: {error}")
                continue
        first = seconds if first is None else first
        near = [float(np.abs(outcome.folds - f).min()) for f in truth] if outcome.folds.size else []
        folds = ", ".join(f"{e:.0e}" for e in near) or "none"
        lines.append(
            f"{name:30s} {seconds:7.3f} s  x {seconds / first:6.1f}  {outcome.points:5d} points  "
            f"fold errors {folds:14s} stability: {outcome.stability}"
        )
    return lines


def main() -> list[str]:
    """Tables of all that are installed."""
    duffing, chain = st.models.duffing(xi=XI, beta=BETA), st.models.chain(**CHAIN)
    there = {name: importlib.util.find_spec(name) is not None for name in ("pyHarm", "harmonicbalance", "mousai")}
    logging.disable(logging.CRITICAL)
    rows = [
        ("stability, harmonic balance", ours(lambda: st.HarmonicBalance(duffing, harmonics=HARMONICS)), 9),
        ("stability, collocation", ours(lambda: st.Collocation(duffing)), 9),
    ]
    if there["pyHarm"]:
        rows += [("pyHarm", duffing_in_pyharm(), 5), ("pyHarm, folds to 1e-9", duffing_in_pyharm(0.2), 2)]
    if there["harmonicbalance"]:
        rows.append(("harmonicbalance", harmonicbalance, 1))
    if there["mousai"]:
        rows.append(("mousai", mousai, 1))
    lines = ["Duffing, 7 harmonics", *table(rows, FOLDS)]
    fine = st.continuation(st.Collocation(chain, accuracy=1e-11), "Omega", (0.3, 3.0))
    rows = [
        ("stability, harmonic balance", ours(lambda: st.HarmonicBalance(chain, harmonics=15)), 5),
        ("stability, collocation", ours(lambda: st.Collocation(chain)), 5),
    ]
    if there["pyHarm"]:
        rows += [("pyHarm", chain_in_pyharm(), 2), ("pyHarm, folds to 1e-9", chain_in_pyharm(0.1), 1)]
    truth = np.array([p.params["Omega"] for p in fine.of_kind(st.Kind.FOLD)])
    lines += ["", "Chain of two masses, 15 harmonics", *table(rows, truth)]
    logging.disable(logging.NOTSET)
    return lines


if __name__ == "__main__":
    import sys

    sys.stdout.write("\n".join(main()) + "\n")
