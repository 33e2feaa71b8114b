"""Simulation beside its peers: one period with monodromy matrix, a carried sweep, an impact oscillator.

Run ``python tests/benchmarks/bench_simulation.py``; minima of repeated, interleaved measurements of CPU time, one
thread. Peers:
scipy's DOP853 over a lambdified right-hand side with variational equations, at the tolerance that gives the same
measured error, and heyoka's Taylor integrator where it is installed. Only the ratios are comparable between machines.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.integration.flow import flow

WANTED = 1e-10


def least(function: Callable[[], Any], repeats: int) -> float:
    """Smallest CPU time of some calls."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def with_variations(system: st.System) -> Callable[[float, np.ndarray], np.ndarray]:
    """x' and Phi' = J Phi by sympy's lambdify."""
    t = sp.Symbol("t", real=True)
    states = [sp.Symbol(s, real=True) for s in system.states]
    at = {sp.Symbol(k, real=True): v for k, v in system.parameters.items()}
    rhs = sp.Matrix([e.subs(at) for e in system.rhs])
    f = sp.lambdify((t, states), list(rhs), "numpy")
    J = sp.lambdify((t, states), rhs.jacobian(states), "numpy")
    n = system.n

    def slope(s: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate([f(s, z[:n]), (np.asarray(J(s, z[:n])) @ z[n:].reshape(n, n)).ravel()])

    return slope


def heyoka_period(system: st.System, x0: np.ndarray, tolerance: float) -> Callable[[], np.ndarray] | None:
    """One period of states and variations by heyoka, compiled outside; None where it is not installed."""
    try:
        import heyoka as hy
    except ImportError:
        return None
    states = hy.make_vars(*system.states)
    names = [sp.Symbol(s, real=True) for s in system.states]
    at = {sp.Symbol(k, real=True): v for k, v in system.parameters.items()}
    rhs = [hy.from_sympy(e.subs(at), {**dict(zip(names, states)), sp.Symbol("t", real=True): hy.time}) for e in system.rhs]
    variational = hy.var_ode_sys(list(zip(states, rhs)), hy.var_args.vars, order=1)
    integrator = hy.taylor_adaptive(variational, x0.tolist(), tol=tolerance, compact_mode=False)
    start = integrator.state.copy()

    def run() -> np.ndarray:
        integrator.time = 0.0
        integrator.state[:] = start
        integrator.propagate_until(system.period)
        return integrator.state.copy()

    return run


def one_period() -> None:
    """States and monodromy of a four-state model over one period at a measured error of 1e-10."""
    system = st.models.autoparametric_pendulum(xi1=0.021, xi2=0.021, length_ratio=20.0, Omega0=0.5)
    x0, span = np.array([1.0, 0.5, 0.2, -0.1]), (0.0, system.period)
    exact = flow(system, span, x0, rtol=1e-14, atol=1e-16, variations=True)
    scale = max(1.0, float(np.abs(exact.matrix).max()))

    def error(x: np.ndarray, matrix: np.ndarray) -> float:
        return max(float(np.abs(x - exact.x).max()), float(np.abs(matrix - exact.matrix).max()) / scale)

    slope, start = with_variations(system), np.concatenate([x0, np.eye(4).ravel()])

    def ours(rtol: float) -> Any:
        return flow(system, span, x0, rtol=rtol, atol=rtol * 0.1, variations=True)

    def scipy(rtol: float) -> Any:
        return solve_ivp(slope, span, start, "DOP853", rtol=rtol, atol=rtol * 0.1)

    def chosen(run: Callable[[float], Any], read: Callable[[Any], tuple[np.ndarray, np.ndarray]]) -> float:
        return next(r for r in 10.0 ** -np.arange(7.0, 14.0, 0.25) if error(*read(run(r))) <= WANTED)

    mine = chosen(ours, lambda end: (end.x, end.matrix))
    theirs = chosen(scipy, lambda found: (found.y[:4, -1], found.y[4:, -1].reshape(4, 4)))
    pairs = [(least(lambda: ours(mine), 60), least(lambda: scipy(theirs), 3)) for _ in range(8)]
    a, b = (min(column) for column in zip(*pairs))
    print(f"one period with monodromy, error 1e-10: {1e6 * a:.0f} us; scipy DOP853 {b / a:.0f} x that")
    print("  ratio in each of 8 rounds:", " ".join(f"{theirs / ours:.0f}" for ours, theirs in pairs))
    for tolerance in 10.0 ** -np.arange(6.0, 15.0, 0.5):
        peer = heyoka_period(system, x0, float(tolerance))
        if peer is None:
            print("  heyoka is not installed")
            return
        state = peer()
        if error(state[:4], state[4:].reshape(4, 4)) <= WANTED:
            c = least(peer, 200)
            print(f"  heyoka {1e6 * c:.0f} us at tolerance {tolerance:.0e}: ours is {a / c:.2f} x heyoka")
            return


def sweeps() -> None:
    """Figure 11's carried sweep, 71 frequencies of 50 periods, and the same between stops."""
    system = st.models.duffing.from_physical()
    stopped = system.replace(stops=(st.HardStop("y", 1e-3, 1, 0.7), st.HardStop("y", -1e-3, -1, 0.7)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, which in (("smooth", system), ("with two hard stops", stopped)):
            st.sweep(which, "frequency", (5.0, 6.0), step=0.5)
            seconds = least(lambda which=which: st.sweep(which, "frequency", (5.0, 40.0), step=0.5), 3)
            print(f"carried sweep, 71 frequencies x 50 periods, {name}: {seconds:.2f} s")


def basins() -> None:
    """Figure 11's oscillator between its folds: a million cells, CPU time of all threads."""
    system = st.models.duffing.from_physical(frequency=25.0)
    grid = dict(x=("y", -6e-3, 6e-3), y=("y_dot", -0.8, 0.8))
    st.basins(system, **grid, shape=(150, 150))
    for side in (300, 1000):
        began = time.process_time()
        found = st.basins(system, **grid, shape=(side, side))
        seconds = time.process_time() - began
        print(f"basins of {side} x {side} cells: {seconds:.1f} s of CPU time, agreement {found.agreement:.3f}")


def main() -> int:
    """All lines."""
    one_period()
    sweeps()
    basins()
    return 0


if __name__ == "__main__":
    sys.exit(main())
