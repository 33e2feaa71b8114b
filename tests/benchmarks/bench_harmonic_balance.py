"""Frequency response by harmonic balance beside other Python packages: ratios of processor time in one run, one thread.

u'' + 2 xi u' + u + beta u^3 = Omega^2 cos(Omega t), xi = .02, beta = .001, Omega from .3 to 3, 7 harmonics; what each
delivers is printed beside its time: number of points, error of the two folds (1.38093302985, 1.08843663946), stability.
Peers that are not installed are left out: pip install pyharm-os harmonicbalance mousai.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_harmonic_balance.py
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import logging
import time
import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import stability as st

FOLDS = np.array([1.38093302985, 1.08843663946])
XI, BETA, HARMONICS = 0.02, 0.001, 7


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


def ours(problem: Callable[[], object]) -> Callable[[], Outcome]:
    def run() -> Outcome:
        branch = st.continuation(problem(), "Omega", (0.3, 3.0))
        folds = np.array([p.params["Omega"] for p in branch.of_kind(st.Kind.FOLD)])
        return Outcome(len(branch), folds, "every point")

    return run


def pyharm() -> Outcome:
    from pyHarm.Maestro import Maestro

    model = {
        "analysis": {
            "FRF": {
                "study": "frf", "solver": "scipyroot", "puls_inf": 0.3, "puls_sup": 3.0, "ds_max": 1.0, "ds_min": 1e-8,
                "ds0": 0.1, "sign_ds": 1, "verbose": False,
            }
        },
        "system": {"type": "Base", "nh": HARMONICS, "nti": 4 * HARMONICS + 4, "adim": {"status": False}},
        "substructures": {"s": {"matrix": {"M": np.eye(1), "C": np.eye(1) * 2 * XI, "K": np.eye(1)}, "ndofs": 1}},
        "connectors": {
            "spring": {"type": "CubicSpring", "connect": {"s": [0]}, "dirs": [0], "k": BETA},
            "base": {"type": "GOForcing", "connect": {"s": [0]}, "dirs": [0], "dto": 2, "ho": 1, "amp": -1.0},
        },
    }  # fmt: skip
    maestro = Maestro(model)
    maestro.operate()
    accepted = [s.x[-1] for s in maestro.nls["FRF"].SolList if s.flag_accepted]
    return Outcome(len(accepted), turning_points(np.array(accepted)), "none")


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


def main() -> list[str]:
    """Table of all that are installed."""
    duffing = st.models.duffing(xi=XI, beta=BETA)
    entries: list[tuple[str, Callable[[], Outcome], int]] = [
        ("stability, harmonic balance", ours(lambda: st.HarmonicBalance(duffing, harmonics=HARMONICS)), 7),
        ("stability, collocation", ours(lambda: st.Collocation(duffing)), 7),
    ]
    for package, run in (("pyHarm", pyharm), ("harmonicbalance", harmonicbalance), ("mousai", mousai)):
        if importlib.util.find_spec(package) is not None:
            entries.append((package, run, 3 if package == "pyHarm" else 1))
    lines, first = [], None
    logging.disable(logging.CRITICAL)
    for name, run, repeats in entries:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            try:
                seconds, outcome = timed(run, repeats)
            except Exception as error:  # noqa: BLE001 - a peer that does not run is said, not hidden
                lines.append(f"{name:30s} failed: {type(error).__name__}: {error}")
                continue
        first = seconds if first is None else first
        near = [float(np.abs(outcome.folds - f).min()) for f in FOLDS] if outcome.folds.size else []
        folds = ", ".join(f"{e:.0e}" for e in near) or "none"
        lines.append(
            f"{name:30s} {seconds:7.3f} s  x {seconds / first:6.1f}  {outcome.points:5d} points  "
            f"fold errors {folds:14s} stability: {outcome.stability}"
        )
    logging.disable(logging.NOTSET)
    return lines


if __name__ == "__main__":
    import sys

    sys.stdout.write("\n".join(main()) + "\n")
