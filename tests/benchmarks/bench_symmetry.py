"""Symmetric orbits on half of their period beside the same branches on the whole period.

Run:  python tests/benchmarks/bench_symmetry.py

Textbook Duffing oscillator, x'' + 0.1 x' + x + x^3 = F cos(omega t), F = 5, 10, 25, down to omega = 0.3; the swinging
branch of the autoparametric pendulum (theta(t + T) = -theta(t) on 2T); asymmetric loops of F = 25, whose second half is
written down as an image, against loops that are followed all the way round. Processor times on one thread, the least of
seven runs that alternate; the ratio is what counts (wanted: at most 0.6). Beside it the largest difference of the
special points' places. The last lines are one corrected point with its multipliers at a fixed density of the mesh, for
two and four states: what is left of the factor two when the driver's own work per point is left out.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[_name] = "1"

import sys
import time
from collections.abc import Callable
from typing import Any

import stability as st

RUNS = 7


def least(*calls: Callable[[], Any]) -> tuple[list[float], list[Any]]:
    """Least processor times (s) of the calls, which take turns, and what they returned."""
    times, results = [float("inf")] * len(calls), [call() for call in calls]
    for _ in range(RUNS):
        for k, call in enumerate(calls):
            begun = time.process_time()
            results[k] = call()
            times[k] = min(times[k], time.process_time() - begun)
    return times, results


def line(name: str, parameter: str, whole: Callable[[], Any], half: Callable[[], Any]) -> None:
    """One row: points, times, ratio, and how far apart equal labels lie."""
    (slow, fast), (a, b) = least(whole, half)
    same = a.labels == b.labels
    gaps = [abs(p.params[parameter] - q.params[parameter]) for p, q in zip(a.special, b.special)]
    gap = max(gaps) if same else float("nan")
    sys.stdout.write(
        f"{name:34s} {len(a):5d} {len(b):5d}   {1e3 * slow:8.1f} {1e3 * fast:8.1f}   {fast / slow:6.3f}   "
        f"{len(a.special):3d} labels {'equal' if same else 'DIFFERENT'}, {gap:.1e} apart\n"
    )


def main() -> None:
    """Print the table."""
    sys.stdout.write(f"{'':34s} {'points':>11s}   {'CPU time, ms':>17s}   {'ratio':>6s}\n")
    for force, start in ((5.0, 8.0), (10.0, 12.0), (25.0, 16.0)):
        system = st.models.duffing_textbook(delta=0.1, gamma=force)
        line(
            f"Duffing F = {force:g}", "omega",
            lambda s=system, w=start: st.continuation(st.Collocation(s), "omega", (w, 0.3)),
            lambda s=system, w=start: st.continuation(st.Collocation(s, symmetry="auto"), "omega", (w, 0.3)),
        )  # fmt: skip
    pendulum = st.models.autoparametric_pendulum(
        length_ratio=10.0, mass_ratio_total=0.2, Omega0=0.5, xi1=0.02, xi2=0.01, base_term=False
    )
    whole = st.continuation(st.Collocation(pendulum), "Omega", (0.5, 1.5))["PD1"]
    half = st.continuation(st.Collocation(pendulum, symmetry="auto"), "Omega", (0.5, 1.5))["PD1"]
    line(
        "pendulum, swinging on 2T", "Omega", lambda: st.continuation(st.switch(whole), "Omega", (0.5, 1.5)),
        lambda: st.continuation(st.switch(half), "Omega", (0.5, 1.5)),
    )
    branch = st.continuation(st.Collocation(system, symmetry="auto"), "omega", (16.0, 0.3))
    for label in ("BP1", "BP3"):
        line(
            f"Duffing F = 25, loop from {label}", "omega",
            # a user's event need not have the symmetry: with one, both halves of the loop are followed
            lambda p=branch[label]: st.continuation(st.switch(p), "omega", (16.0, 0.3), events=_nothing),
            lambda p=branch[label]: st.continuation(st.switch(p), "omega", (16.0, 0.3)),
        )  # fmt: skip


    for name, system, multiple, free in (
        ("point, 2 states, 100 and 50 intervals", st.models.duffing_textbook(delta=0.1, gamma=5.0, omega=2.0), 1, "omega"),
        ("point, 4 states, 100 and 50 intervals", pendulum.with_params(Omega=0.7), 2, "Omega"),
    ):
        problems = [
            st.Collocation(system, multiple=multiple, symmetry=s, intervals=n) for s, n in ((None, 100), ("auto", 50))
        ]
        (slow, fast), _ = least(*(solving(p, free) for p in problems))
        sys.stdout.write(f"{name:48s}{5 * slow:8.3f} {5 * fast:8.3f}   {fast / slow:6.3f}\n")


def solving(problem: st.Collocation, free: str) -> Callable[[], None]:
    """200 corrections along the tangent, with spectra."""
    params = problem.system.parameter_vector()
    u = problem.start(params)
    tangent = problem.correct(u, params, free, None, 0.0, 1e-9).tangent

    def solve() -> None:
        for k in range(200):
            found = problem.correct(u, params, free, tangent, 1e-4 * (1 + k % 3), 1e-9)
            problem.spectrum(found.linearisation)

    return solve


def _nothing(orbit: Any) -> float:
    return 1.0


if __name__ == "__main__":
    main()
