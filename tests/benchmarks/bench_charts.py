"""Cost of a stability chart beside its peers, in one run and one thread: CPU time, errors, ratios.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_charts.py

The work is the growth rate of q'' + 2 delta q' + (a + b cos t) q = 0, delta = 0.05, on 1000 x 1000 points of
a in [-1, 5], b in [0, 5]. Peers integrate every point: they are run on a sample and extrapolated. Errors are against
the 30-digit table of tests/data. Times are CPU times of this process, the least of several runs.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import stability as st

TABLE = Path(__file__).parents[1] / "data" / "mathieu_growth.npz"
POINTS = 1_000_000
DELTA = 0.05


def least(function: Callable[[], Any], runs: int = 5) -> tuple[float, Any]:
    """Least CPU time of several runs, and the last result."""
    best, result = np.inf, None
    for _ in range(runs):
        start = time.process_time()
        result = function()
        best = min(best, time.process_time() - start)
    return best, result


def sample(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """a, b and the exact growth rate of points of the table."""
    table = np.load(TABLE)
    here = np.flatnonzero(table["delta"] == DELTA)[:count]
    return table["a"][here], table["b"][here], table["growth"][here]


def growth(trace: np.ndarray) -> np.ndarray:
    """Growth rate from the trace of the undamped monodromy matrix."""
    return np.arccosh(np.maximum(1.0, np.abs(trace) / 2)) / (2 * np.pi) - DELTA


def ours() -> tuple[list[tuple[str, float, float]], float]:
    """Rows (what, seconds, error) of the library, and its warm time."""
    model = st.models.mathieu(delta=DELTA)
    window = dict(x=("a", -1.0, 5.0), y=("b", 0.0, 5.0), shape=(1000, 1000))
    start = time.process_time()
    chart = st.chart(model, **window)
    cold = time.process_time() - start
    warm, chart = least(lambda: st.chart(model, **window), 15)
    table = np.load(TABLE)
    here = table["delta"] == DELTA
    error = float(np.abs(chart.growth_rate[table["row"][here], table["column"][here]] - table["growth"][here]).max())
    start = time.process_time()
    curves = len(chart.boundaries)
    traced = time.process_time() - start
    rows = [
        ("chart, first call (compiles the model)", cold, error),
        ("chart, warm: growth rate, verdict, kind", warm, error),
        (f"its {curves} boundary curves and {len(chart.tips)} tips", traced, float("nan")),
    ]
    coupled = st.models.coupled_mathieu()
    pair, chart = least(
        lambda: st.chart(coupled, x=("omega2", 1.5, 2.0), y=("epsilon", 0.0, 0.5), shape=(1000, 1000)), 3
    )
    rows.append(("two degrees of freedom, 10^6 points", pair, chart.error))
    return rows, warm


def solve_ivp_rows() -> list[tuple[str, float, float]]:
    from scipy.integrate import solve_ivp

    rows = []
    for method, tolerance, count in (("RK45", 1e-8, 12), ("DOP853", 1e-12, 12)):
        a, b, exact = sample(count)

        def run(a: Any = a, b: Any = b, method: str = method, tolerance: float = tolerance) -> np.ndarray:
            traces = []
            for ai, bi in zip(a, b, strict=True):
                k = ai - DELTA**2

                def rhs(s: float, y: np.ndarray, k: float = k, bi: float = bi) -> list[float]:
                    c = k + bi * np.cos(s)
                    return [y[1], -c * y[0], y[3], -c * y[2]]

                y = solve_ivp(rhs, (0, 2 * np.pi), [1, 0, 0, 1], method=method, rtol=tolerance, atol=tolerance).y[:, -1]
                traces.append(y[0] + y[3])
            return np.array(traces)

        seconds, traces = least(run, 2)
        rows.append((f"scipy solve_ivp {method}, rtol {tolerance:g}", seconds * POINTS / count, _worst(traces, exact)))
    return rows


def numpy_row() -> tuple[str, float, float]:
    """Classical Runge-Kutta, all points at once, half a period (the usual vectorised script)."""
    a, b, exact = sample(400)
    repeat = 25
    big_a, big_b = np.tile(a, repeat), np.tile(b, repeat)
    steps = 512

    def run() -> np.ndarray:
        k, h = big_a - DELTA**2, np.pi / steps
        y = np.zeros((4, big_a.size))
        y[0] = y[3] = 1.0

        def f(s: float, y: np.ndarray) -> np.ndarray:
            c = -(k + big_b * np.cos(s))
            return np.stack([y[1], c * y[0], y[3], c * y[2]])

        for i in range(steps):
            s = i * h
            k1 = f(s, y)
            k2 = f(s + h / 2, y + h / 2 * k1)
            k3 = f(s + h / 2, y + h / 2 * k2)
            k4 = f(s + h, y + h * k3)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return 2 * (y[0] * y[3] + y[1] * y[2])

    seconds, traces = least(run, 2)
    return "NumPy RK4, 512 steps, half a period", seconds * POINTS / big_a.size, _worst(traces[: a.size], exact)


def heyoka_row() -> tuple[str, float, float] | None:
    """heyoka's batch mode (8 lanes), Taylor, tolerance 1e-15, half a period."""
    try:
        import heyoka as hy
    except ImportError:
        return None
    names = hy.make_vars("x", "v", "y", "w")
    x, v, y, w = names
    c = hy.par[0] + hy.par[1] * hy.cos(hy.time)
    system = [(x, v), (v, -c * x), (y, w), (w, -c * y)]
    batch = 8
    integrator = hy.taylor_adaptive_batch(system, np.zeros((4, batch)), tol=1e-15)
    a, b, exact = sample(400)
    count = len(a) // batch * batch
    a, b, exact = a[:count], b[:count], exact[:count]

    def run() -> np.ndarray:
        traces = []
        for first in range(0, count, batch):
            integrator.set_time(0.0)
            integrator.state[:] = np.array([1.0, 0.0, 0.0, 1.0])[:, None]
            integrator.pars[0], integrator.pars[1] = a[first : first + batch] - DELTA**2, b[first : first + batch]
            integrator.propagate_until(np.pi)
            s = integrator.state
            traces.append(2 * (s[0] * s[3] + s[1] * s[2]))
        return np.concatenate(traces)

    seconds, traces = least(run, 3)
    return "heyoka batch of 8, tolerance 1e-15, half a period", seconds * POINTS / count, _worst(traces, exact)


def _worst(traces: np.ndarray, exact: np.ndarray) -> float:
    return float(np.abs(growth(np.asarray(traces)) - exact).max())


def memory() -> float:
    """Peak resident memory of this process in MiB after a 4000 x 4000 chart."""
    st.chart(st.models.mathieu(delta=DELTA), x=("a", -1.0, 5.0), y=("b", 0.0, 5.0), shape=(4000, 4000))
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    rows, warm = ours()
    peak = memory()
    rows += solve_ivp_rows()
    rows.append(numpy_row())
    peer = heyoka_row()
    if peer is not None:
        rows.append(peer)
    out = sys.stdout.write
    out(f"{'10^6 points, CPU time of one thread':52s} {'seconds':>12s} {'error':>9s} {'x warm':>10s}\n")
    for what, seconds, error in rows:
        out(f"{what:52s} {seconds:12.4f} {error:9.1e} {seconds / warm:10.3g}\n")
    out(f"peak memory of the process with a 4000 x 4000 chart: {peak:.0f} MiB\n")


if __name__ == "__main__":
    main()
