r"""`basins`: from which initial values the motion comes to which attractor.

First a coarse subset of the grid is followed for many periods; where the stroboscopic states repeat after m periods
(up to 8) they are an attractor, and two ends belong to the same one when a point of one is a point of the other. Then
every cell is followed until it stays near the points of a known attractor (kernels/strobing.py). What is left is
looked at like the subset, so that attractors with small basins are found, too. Rows of the grid are independent: the
result does not depend on the number of threads. Where a large grid spans both states of a system, the cells are
followed by a table of the stroboscopic map (simulation/strobe_tables.py), and some of them by integration, too: their
`agreement` is reported.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from os import cpu_count
from typing import Any

import numpy as np

from ..errors import InputError, StabilityWarning, check_names
from ..integration.engine import Engine, Precision
from ..kernels import strobing
from ..results.basins import Attractor, Basins
from .strobe_tables import StrobeTable, tabulated

__all__ = ["basins"]

Array = np.ndarray
_COARSE = 15  # the subset has at most so many cells along each axis
_LONGEST = 8
_ROUNDS = 6
_EARLY = 12  # periods of the subset whose states are kept track of
_CHUNK = 10
_CHECKED = 200  # cells of a table's basins that are integrated, too
_FLOOR = 0.01  # of the largest initial value: the least scale of a state, where attractors are at rest


def basins(
    system: Any, *, x: tuple[str, float, float], y: tuple[str, float, float], shape: tuple[int, int] = (200, 200),
    x0: Any = None, periods: int = 400, tolerance: float = 1e-3, rtol: float = 1e-7, atol: Any = 1e-11,
    workers: int | None = None, progress: Callable[[int, int], Any] | None = None, **params: float,
) -> Basins:  # fmt: skip
    """Basins of attraction of a forced smooth system over a grid of two initial values.

    Parameters
    ----------
    system : System
    x, y : (state, lo, hi), the two initial values; the grid includes both ends
    shape : (nx, ny)
    x0 : state, the other initial values; default rest
    periods : int, longest time that a motion is followed
    tolerance : how near to an attractor counts as there, over the scale of each state: the largest
        stroboscopic value of the attractors, at least 1 % of the largest initial value
    rtol, atol : tolerances of the integration
    workers : number of threads, default all cores
    progress : called with (rows done, rows)
    **params : parameter values by name

    Returns
    -------
    Basins
        After Ctrl-C, once attractors are known, with the cells so far; the others are undecided.

    Raises
    ------
    InputError, UnknownNameError
        Before any work: an autonomous system, one with stops or switches, unknown names, an empty grid.

    Warns
    -----
    StabilityWarning
        It was interrupted, or a Python right-hand side raised: the cells concerned count as escaped.

    Examples
    --------
    >>> import stability as st
    >>> duffing = st.models.duffing(xi=0.05, beta=0.05, Omega=1.6)
    >>> found = st.basins(duffing, x=("u", -8, 8), y=("u_dot", -8, 8), shape=(12, 12))
    >>> [a.multiple for a in found.attractors]
    [1, 1]
    """
    engine, X, (nx, ny), grids = _checked(system, x, y, shape, x0, periods, tolerance)
    run = _Follower(engine, system.parameter_vector(**params), Precision(rtol, atol), periods, tolerance)
    rows = np.unique(np.linspace(0, ny - 1, min(ny, _COARSE)).astype(int))
    columns = np.unique(np.linspace(0, nx - 1, min(nx, _COARSE)).astype(int))
    run.learn(X.reshape(ny, nx, -1)[np.ix_(rows, columns)].reshape(-1, system.n))
    labels = np.full((ny, nx), strobing.UNDECIDED, np.int64)
    agreement = 1.0
    try:
        table = _labelled(run, X, labels, workers, progress)
        agreement = 1.0 if table is None else _agreement(run, X, labels.ravel())
    except KeyboardInterrupt:
        done = 1.0 - float((labels == strobing.UNDECIDED).mean())
        warnings.warn(
            f"interrupted: {100 * done:.3g} % of the cells are labelled, the others undecided", StabilityWarning,
            stacklevel=2,
        )  # fmt: skip
    failure = engine.compiled.evaluations.failure()
    if failure:
        warnings.warn(f"motions of '{system.name}' count as escaped where they fail{failure}", StabilityWarning, 2)
    attractors = tuple(
        Attractor(k, points, multiple, float((labels == k).mean())) for k, (points, multiple) in enumerate(run.found)
    )
    named = dict(zip(system.parameters, run.params.tolist()))
    return Basins(
        system.name, x[0], y[0], grids[0], grids[1], labels, attractors, tuple(system.states), named, agreement
    )  # fmt: skip


def _labelled(
    run: _Follower, X: Array, labels: Array, workers: int | None, progress: Callable[[int, int], Any] | None
) -> StrobeTable | None:
    """Label all cells, in place, row after row; the table of the stroboscopic map that was used."""
    ny, nx = labels.shape
    ends = X.reshape(ny, nx, -1).copy()
    threads = 1 if run.engine.compiled.evaluations.backend != "llvm" else workers or cpu_count() or 1
    with ThreadPoolExecutor(min(threads, ny)) as pool:
        try:
            table = tabulated(run, X, pool, progress, ny)
            label = run.assign if table is None else partial(table.assign, run)
            before = 0 if table is None else table.rows
            for k, _ in enumerate(pool.map(lambda row: label(ends[row], labels[row]), range(ny))):
                if progress is not None:
                    progress(before + k + 1, before + ny)
        finally:
            pool.shutdown(cancel_futures=True)
    for _ in range(_ROUNDS):  # attractors that the subset did not see
        left = labels == strobing.UNDECIDED
        before = len(run.found)
        if not left.any():
            break
        some = ends[left][:64].copy()
        run.learn(some, already=True)
        if len(run.found) == before:
            break
        states, again = ends[left], np.empty(int(left.sum()), np.int64)
        run.assign(states, again)
        ends[left], labels[left] = states, again
    return table


def _agreement(run: _Follower, X: Array, labels: Array) -> float:
    """Part of some cells, spread over the grid, that come to the same attractor by integration."""
    some = np.unique(np.linspace(0, len(X) - 1, _CHECKED).astype(int) * 7919 % len(X))
    again = np.empty(some.size, np.int64)
    run.assign(X[some].copy(), again)
    return float((again == labels[some]).mean())


def _checked(
    system: Any, x: Any, y: Any, shape: Any, x0: Any, periods: int, tolerance: float
) -> tuple[Engine, Array, tuple[int, int], tuple[Array, Array]]:
    if system.period_expression is None:
        raise InputError(f"'{system.name}' is autonomous: basins are told apart by their states once a forcing period")
    try:
        (xn, x_lo, x_hi), (yn, y_lo, y_hi) = x, y
        nx, ny = (int(v) for v in shape)
        ends = np.array([x_lo, x_hi, y_lo, y_hi], float)
    except (TypeError, ValueError):
        raise InputError(f"x and y are (state, lo, hi), shape is (nx, ny); got {x!r}, {y!r}, {shape!r}") from None
    check_names("state", [xn, yn], system.states, f"'{system.name}'")
    if xn == yn or not (np.isfinite(ends).all() and ends[0] < ends[1] and ends[2] < ends[3]):
        raise InputError(f"x = {x!r}, y = {y!r}: two different states, each with finite lo < hi")
    if min(nx, ny) < 2 or periods < 20 or not 1e-8 < tolerance < 0.5:
        raise InputError(f"shape {shape!r} at least (2, 2), periods = {periods} >= 20, tolerance = {tolerance:g} < 0.5")
    engine = Engine.of(system)
    if engine.guards is not None:
        raise InputError(f"'{system.name}' has stops or switches: basins are computed for smooth systems only")
    first, second = np.linspace(ends[0], ends[1], nx), np.linspace(ends[2], ends[3], ny)
    X = np.tile(system.state_vector(x0), (nx * ny, 1))
    X[:, system.states.index(xn)] = np.tile(first, ny)
    X[:, system.states.index(yn)] = np.repeat(second, nx)
    return engine, X, (nx, ny), (first, second)


class _Follower:
    """Follows motions and knows the attractors found so far: `found`, (points (m, n), m) each."""

    def __init__(self, engine: Engine, params: Array, precision: Precision, periods: int, tolerance: float) -> None:
        self.engine, self.params, self.periods, self.tolerance = engine, params, periods, tolerance
        n = engine.system.n
        self.rtol, self.scales = precision.rtol, precision.scales(n)
        self.period = engine.period(params)
        pieces = engine.cuts(params, 0.0, self.period)
        self.cuts = np.array([pieces[0][0], *(end for _, end in pieces)])
        self.inside = 1e-13 * self.period if len(pieces) > 1 else 0.0
        self.wraps = np.isin(engine.system.states, engine.system.angles)
        self.scale = np.ones(n)
        self.found: list[tuple[Array, int]] = []
        self.escaped = 0.0  # part of the subset
        self.seen = np.full(n, np.inf), np.full(n, -np.inf)  # least and largest stroboscopic states of the subset

    def targets(self) -> tuple[Array, Array]:
        """Points (K, n) of the known attractors, and whose they are (K,)."""
        points = np.vstack([p for p, _ in self.found]) if self.found else np.zeros((0, len(self.scale)))
        return np.ascontiguousarray(points), np.repeat(
            np.arange(len(self.found)), [len(p) for p, _ in self.found]
        ).astype(np.int64)

    def assign(self, states: Array, labels: Array, periods: int | None = None, known: bool = True) -> None:
        """Follow states (N, n) in place and label them."""
        n = states.shape[1]
        points, owners = self.targets() if known else (np.zeros((0, n)), np.zeros(0, np.int64))
        strobing.assign(
            self.engine.address, self.params, 1.0 / self.period, self.cuts, self.inside, states,
            self.periods if periods is None else periods, points, owners, self.scale, self.wraps,
            self.tolerance, self.rtol, self.scales, labels,
        )  # fmt: skip

    def learn(self, states: Array, already: bool = False) -> None:
        """Follow some states to their ends and add the attractors that are new."""
        labels = np.empty(len(states), np.int64)
        states, widest = np.ascontiguousarray(states), np.abs(states).max(axis=0)
        whole = len(states)
        if not already:
            for _ in range(_EARLY):
                self.assign(states, labels, periods=1, known=False)
                states = states[labels != strobing.ESCAPED]
                labels = labels[: len(states)]
                self.seen = np.minimum(self.seen[0], states.min(axis=0, initial=np.inf)), np.maximum(
                    self.seen[1], states.max(axis=0, initial=-np.inf)
                )
            self.assign(states, labels, known=False)
            states = states[labels != strobing.ESCAPED]
            self.escaped = 1.0 - len(states) / whole
        if not len(states):
            return
        track = [states.copy()]
        labels = np.empty(len(states), np.int64)
        for _ in range(2 * _LONGEST):
            self.assign(states, labels, periods=1, known=False)
            track.append(states.copy())
        strobes = np.array(track)
        if not already:
            ranges = np.abs(np.where(self.wraps, np.pi, strobes)).reshape(-1, states.shape[1]).max(axis=0)
            ranges = np.maximum(ranges, _FLOOR * widest)
            self.scale = np.where(ranges > 0, ranges, 1.0)
        for k in range(len(states)):
            self._add(strobes[:, k])

    def mean_periods(self, cells: Array) -> float:
        """How many periods some of the cells (N, n) take on average."""
        states = np.ascontiguousarray(cells[:: max(1, len(cells) // 50)])
        total, count = 0, len(states)
        for _ in range(0, self.periods, _CHUNK):
            labels = np.empty(len(states), np.int64)
            self.assign(states, labels, periods=_CHUNK)
            total += _CHUNK * len(states)
            states = np.ascontiguousarray(states[labels == strobing.UNDECIDED])
            if not len(states):
                break
        return total / count

    def _distance(self, a: Array, b: Array) -> Array:
        gap = a - b
        gap = np.where(self.wraps, gap - 2 * np.pi * np.round(gap / (2 * np.pi)), gap)
        return np.asarray((np.abs(gap) / self.scale).max(axis=-1))

    def _add(self, strobes: Array) -> None:
        for points, _ in self.found:
            if (self._distance(strobes[-1][None], points) < self.tolerance).any():
                return
        for m in range(1, _LONGEST + 1):
            if (self._distance(strobes[m:], strobes[:-m]) < 0.1 * self.tolerance).all():
                self.found.append((strobes[-m:].copy(), m))
                return
