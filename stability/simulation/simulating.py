r"""`simulate`: a system in time, from given states, to a given accuracy.

    x' = f(t, x, p),   x(t0) = x0,          local error per step <= atol + rtol |x|

Hard stops, kinks and jumps of the right-hand side in the states, and a user's events are located on the way. The
compiled explicit Runge-Kutta method of order 8 of integration/engine.py; stiff systems by scipy's implicit methods on
request. The result is dense. Motions of a batch run in threads and give the same bytes for any number of them.

Reference: E. Hairer, S. P. Norsett, G. Wanner (1993), Solving Ordinary Differential Equations I.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count
from typing import Any, overload

import numpy as np

from ..errors import InputError, NonFiniteError
from ..integration.engine import Engine, Motion, Precision
from ..results.trajectory import Ending, Trajectory
from .starts import batch, checked_span
from .stiff import METHODS as _STIFF
from .stiff import stiff_motion

__all__ = ["Ensemble", "simulate"]

Array = np.ndarray


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Sequence[Trajectory]):
    """The motions of a batch: a sequence of `Trajectory`, callable: (n, B) at a number, (n, N, B) at an array.

    Attributes
    ----------
    members : tuple of Trajectory

    Examples
    --------
    >>> import stability as st
    >>> runs = st.simulate(st.models.duffing(), (0, 10), x0=dict(u=[0.0, 0.1, 0.2]))
    >>> len(runs), runs(5.0).shape
    (3, (2, 3))
    """

    members: tuple[Trajectory, ...]

    def __len__(self) -> int:
        return len(self.members)

    @overload
    def __getitem__(self, k: int) -> Trajectory: ...
    @overload
    def __getitem__(self, k: slice) -> Ensemble: ...
    def __getitem__(self, k: Any) -> Any:
        return Ensemble(self.members[k]) if isinstance(k, slice) else self.members[k]

    def __iter__(self) -> Iterator[Trajectory]:
        return iter(self.members)

    def __call__(self, t: Any) -> Array:
        return np.stack([member(t) for member in self.members], axis=-1)

    @property
    def final(self) -> Array:
        """(n, B) states where the motions ended."""
        return np.stack([member.final for member in self.members], axis=-1)

    @property
    def status(self) -> tuple[Ending, ...]:
        """Why each one ended."""
        return tuple(member.status for member in self.members)

    def __repr__(self) -> str:
        bad = sum(member.status is not Ending.COMPLETED for member in self.members)
        tail = f" | {bad} not completed" if bad else ""
        return f"Ensemble of {len(self)} trajectories of {self.members[0].system}{tail}"


def simulate(
    system: Any, span: tuple[float, float], *, x0: Any = None, rtol: float = 1e-9, atol: Any = 1e-12,
    method: str = "DOP853", events: Mapping[str, Any] | None = None, stop_at: Sequence[str] = (),
    workers: int | None = None, max_steps: int = 2_000_000, **params: Any,
) -> Any:  # fmt: skip
    """Integrate a system in time: x' = f(t, x, p), x(t0) = x0.

    Parameters
    ----------
    system : System
    span : (t0, t1)
        t0 < t1.
    x0 : mapping of state -> value (missing ones zero), or array (n,); default rest
        An array of values (B,), or an array (n, B), makes a batch.
    rtol, atol : float (atol also (n,))
        The local error of a step is kept below atol + rtol |x|.
    events : mapping of name -> expression, sympy or text such as ``"u - 0.5"``
        Zeros of the expressions along the motion are recorded in ``trajectory.events``, both ways.
    stop_at : names of events that end the motion
    method : "DOP853", or "Radau", "BDF", "LSODA" for stiff systems (through scipy)
    workers : number of threads of a batch; default all cores
    max_steps : int
    **params : parameter values by name; arrays (B,) make a batch

    Returns
    -------
    Trajectory, or an Ensemble of B of them for a batch
        A motion that escapes ends early with a `status` that says so.

    Raises
    ------
    InputError, UnknownNameError
        Before any work.
    NonFiniteError
        The right-hand side is not finite at the start, or is a Python function that raises.

    Notes
    -----
    *Accuracy*: the global error over tens of periods stays within 100 x the tolerance for every model of the catalogue
    (tests/simulation), chaotic motions excepted.

    Examples
    --------
    >>> import numpy as np, stability as st
    >>> run = st.simulate(st.models.mathieu(a=1.0, b=0.0, delta=0.0), (0, 2*np.pi), x0=dict(q=1.0))
    >>> np.round(run(np.pi), 9) + 0.0
    array([-1.,  0.])
    """
    t0, t1 = checked_span(span)
    precision = Precision(rtol, atol, max_steps)
    if method != "DOP853" and method not in _STIFF:
        others = ", ".join(map(repr, _STIFF))
        raise InputError(f"method = {method!r}; there is 'DOP853', and for stiff systems {others}")
    if workers is not None and workers < 1:
        raise InputError(f"workers = {workers}: a whole number >= 1 is needed")
    X, P, count = batch(system, x0, params)
    precision.scales(system.n)
    if method != "DOP853" and events:
        raise InputError("events need method='DOP853'")
    engine = Engine.of(system, events, (stop_at,) if isinstance(stop_at, str) else stop_at)
    _check_start(engine, X, P, t0)

    def one(k: int) -> Trajectory:
        if method == "DOP853":
            motion = engine.run(P[k], X[k], t0, t1, precision)
        else:
            motion = stiff_motion(engine, P[k], X[k], t0, t1, precision, method)
        return as_trajectory(engine, motion, P[k], precision.rtol)

    if count is None:
        return one(0)
    threads = min(workers or cpu_count() or 1, count)
    if threads == 1 or engine.compiled.evaluations.backend != "llvm":
        return Ensemble(tuple(one(k) for k in range(count)))
    with ThreadPoolExecutor(threads) as pool:
        return Ensemble(tuple(pool.map(one, range(count))))


def _check_start(engine: Engine, X: Array, P: Array, t0: float) -> None:
    """Raise `NonFiniteError` where a motion cannot begin; what a Python function raises does so itself."""
    rate = 1.0 / engine.compiled.evaluations.period(P) if engine.forced else 1.0
    with np.errstate(all="ignore"):
        rates = engine.compiled.evaluations.F(np.broadcast_to(t0 * rate, (len(X),)), X, P)
    bad = np.argwhere(~np.isfinite(rates))
    if bad.size:
        k, i = bad[0]
        start = ", ".join(f"{s} = {v:g}" for s, v in zip(engine.system.states, X[k]))
        raise NonFiniteError(
            f"the rate of {engine.system.states[i]} of '{engine.system.name}' is {rates[k, i]} at the start, "
            f"t = {t0:g}, {start}: give x0= or parameters where it is finite"
        )


def as_trajectory(engine: Engine, motion: Motion, params: Array, rtol: float) -> Trajectory:
    """The motion with names; its outputs are functions that are evaluated when asked for."""
    system, evaluations = engine.system, engine.compiled.evaluations
    period = engine.period(params) if engine.forced else None
    rate = 1.0 if period is None else 1.0 / period
    values = params.copy()

    def outputs(times: Array, states: Array) -> Array:
        return np.asarray(evaluations.outputs(np.ascontiguousarray(times * rate), np.ascontiguousarray(states), values))

    edges, coefficients = motion.edges, motion.coefficients
    if not len(coefficients):  # escaped in the very first step: the start alone is known
        edges = np.array([edges[0], max(np.nextafter(edges[0], np.inf), edges[0] + 1e-100)])
        coefficients = np.zeros((1, 8, len(motion.x)))
        coefficients[0, 0] = motion.x
    return Trajectory(
        system=system.name, states=tuple(system.states), edges=edges, coefficients=coefficients,
        params=dict(zip(system.parameters, values.tolist())), status=motion.ending, period=period,
        angles=tuple(system.angles), units=dict(system.units), output_names=tuple(system.outputs),
        events=motion.happenings, rtol=rtol, steps=motion.steps, _outputs=outputs if system.outputs else None,
    )  # fmt: skip
