"""Stiff systems: scipy's implicit methods over the compiled right-hand side and Jacobian.

Radau IIA of order 5, BDF of orders 1-5, LSODA. Their dense output is taken over at eight nodes a step, so that a stiff
motion is a `Trajectory` like any other. Reference: E. Hairer, G. Wanner (1996), Solving Ordinary Differential Equations
II, sections IV.8 and V.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..integration.engine import Engine, Motion, Precision
from ..kernels import piecewise
from ..results.trajectory import Ending

__all__ = ["METHODS", "stiff_motion"]

Array = np.ndarray
METHODS = ("Radau", "BDF", "LSODA")


def stiff_motion(
    engine: Engine, params: Array, x0: Array, t0: float, t1: float, precision: Precision, method: str
) -> Motion:
    """From (t0, x0) to t1 by an implicit method of scipy."""
    from scipy.integrate import solve_ivp

    if engine.system.stops:
        raise InputError(f"'{engine.system.name}' has hard stops: they need method='DOP853'")
    evaluations, rate = engine.compiled.evaluations, 1.0 / engine.period(params)

    def phase(t: float, start: float, end: float) -> Array:
        return np.array([min(max(t, start), end) * rate])

    edges, columns, steps, x, t, ending = [np.array([t0])], [], 0, np.array(x0, float), t0, Ending.COMPLETED
    intervals = engine.cuts(params, t0, t1)
    inside = 1e-13 * max(1 / rate, abs(t1)) if len(intervals) > 1 else 0.0
    for start, end in intervals:
        ends = (start + inside, end - inside)

        def slope(s: float, y: Array, ends: Any = ends) -> Array:
            return evaluations.F(phase(s, *ends), np.ascontiguousarray(y[None]), params)[0]

        def jacobian(s: float, y: Array, ends: Any = ends) -> Array:
            return evaluations.FJ(phase(s, *ends), np.ascontiguousarray(y[None]), params)[1][0]

        with np.errstate(all="ignore"):
            found = solve_ivp(
                slope, (start, end), x, method=method, rtol=max(precision.rtol, 3e-14), atol=precision.scales(len(x)),
                jac=jacobian, dense_output=True,
            )  # fmt: skip
        good = np.isfinite(found.y).all(axis=0)
        kept = int(np.argmin(good)) if not good.all() else good.size
        times, states = found.t[:kept], found.y[:, :kept]
        if times.size > 1:
            nodes = piecewise.node_times(times)
            columns.append(piecewise.from_nodes(found.sol(nodes.ravel()).T.reshape(*nodes.shape, -1)))
            edges.append(times[1:])
        steps += times.size - 1
        t, x = float(times[-1]), states[:, -1].copy()
        if not found.success or kept < good.size:
            escaped = kept < good.size or np.abs(x).max() > 1e6 * max(1e-3, np.abs(x0).max())
            ending = Ending.DIVERGED if escaped else Ending.STEP_TOO_SMALL
            break
    joined = np.concatenate(columns) if columns else np.zeros((0, 8, len(x)))
    return Motion(t, x, steps, ending, np.concatenate(edges), expanded=joined)
