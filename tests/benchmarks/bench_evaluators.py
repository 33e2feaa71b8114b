"""Evaluators: time to compile and time of a call with 200 points, each back end, and the ratio to numpy's `lambdify`.

Run ``python tests/benchmarks/bench_evaluators.py``; the numbers are minima of repeated, interleaved measurements. Only
the ratios are comparable between machines.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

import stability as st
from stability.systems.evaluators import Evaluator, evaluator

POINTS = 200
MODELS = ("mathieu", "duffing", "autoparametric_pendulum", "nonlinear_absorber", "harvester", "lorenz")


def chain(bodies: int) -> st.System:
    """A chain of Duffing oscillators, base of the first one moving."""
    import sympy as sp

    xi, beta, Omega, t = sp.symbols("xi beta Omega t", real=True)
    q = sp.symbols(f"q1:{bodies + 1}", real=True)
    w = [sp.Symbol(f"{s.name}_dot", real=True) for s in q]
    force = [-s - 2 * xi * v - beta * s**3 for s, v in zip(q, w, strict=True)]
    for i in range(bodies - 1):
        link = q[i + 1] - q[i] + beta * (q[i + 1] - q[i]) ** 3
        force[i] += link
        force[i + 1] -= link
    force[0] += sp.cos(Omega * t)
    names = tuple(s.name for s in q)
    parameters = {"xi": 0.01, "beta": 0.1, "Omega": 1.1}
    states = (*names, *(s.name for s in w))
    return st.System("chain", names, states, parameters, (*w, *force), period_expression=2 * sp.pi / Omega)


def best(calls: list[Callable[[], object]], repeats: int = 15, count: int = 100) -> list[float]:
    """Seconds per call, interleaved."""
    least = [np.inf] * len(calls)
    for _ in range(repeats):
        for k, call in enumerate(calls):
            start = time.perf_counter()
            for _ in range(count):
                call()
            least[k] = min(least[k], (time.perf_counter() - start) / count)
    return least


def main() -> None:
    """Print one line per system."""
    write = sys.stdout.write
    evaluator(st.models.van_der_pol(), "llvm").F(None, np.zeros((1, 2)), [1.0])  # LLVM's own start is not a model's
    write(f"{'system':26s} {'n':>3s} {'m':>3s} | compile FJP [s]: llvm lambdify | {POINTS} points FJP [us]: ")
    write("llvm lambdify ratio | 1 point [us]: llvm\n")
    systems = [(name, getattr(st.models, name)()) for name in MODELS] + [("chain of 10", chain(10))]
    for name, system in systems:
        rng = np.random.default_rng(0)
        phase, X, P = rng.random(POINTS), 0.3 * rng.normal(size=(POINTS, len(system.states))), system.parameter_vector()
        made: list[Evaluator] = []
        compile_times = []
        for backend in ("llvm", "lambdify"):
            start = time.perf_counter()
            made.append(evaluator(system, backend))
            made[-1].FJP(phase, X, P)
            compile_times.append(time.perf_counter() - start)
        one, other = made
        single = X[:1].copy()
        fast, slow, alone = best(
            [
                lambda e=one, a=(phase, X, P): e.FJP(*a),
                lambda e=other, a=(phase, X, P): e.FJP(*a),
                lambda e=one, a=(phase[:1], single, P): e.FJP(*a),
            ]
        )
        write(f"{name:26s} {one.n:3d} {one.m:3d} | {compile_times[0]:8.3f} {compile_times[1]:8.3f} | ")
        write(f"{fast * 1e6:8.1f} {slow * 1e6:8.1f} {slow / fast:6.1f} | {alone * 1e6:6.1f}\n")


if __name__ == "__main__":
    main()
