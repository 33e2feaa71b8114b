"""The flow of a system and its derivatives: initial value problems to a given tolerance.

    x' = f(t, x, p), x(t_0) = x_0;      Phi' = J Phi, Phi(t_0) = I;      (dx/dp)' = J dx/dp + df/dp

The derivative by a parameter of a forced system is taken at fixed phase t / T(p), where it does not grow with t
through T(p) alone. An interval is cut at the jumps of the right-hand side in time; each piece is one compiled call
(kernels/runge_kutta.py), order 8 with dense output of order 7. Where the system has stops or switches in its states,
the pieces end at the events and the variations pass them by saltation (integration/nonsmooth.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError, NonFiniteError
from ..kernels import runge_kutta
from .compiled import CompiledField
from .switches import has_switches

__all__ = ["Flow", "flow"]

Array = np.ndarray
_MAX_STEPS = 1_000_000


@dataclass(frozen=True, eq=False)
class Flow:
    """The end of an integration and, where asked for, everything between.

    Attributes
    ----------
    t : float, the end;  x : (n,) state there;  steps : int
    matrix : (n, n) dx(t)/dx_0, or None
    by_parameter : (n, q) dx(t)/dp at fixed phase, or None
    """

    t: float
    x: Array
    steps: int
    matrix: Array | None = None
    by_parameter: Array | None = None
    _dense: tuple[Array, Array] | None = field(default=None, repr=False)

    @property
    def times(self) -> Array:
        """(steps + 1,) ends of the steps (only with dense=True)."""
        if self._dense is None:
            raise InputError("this flow was integrated without dense output: pass dense=True")
        return self._dense[0]

    @property
    def nested(self) -> Array:
        """(steps, 8, n) dense output of the steps, see kernels/piecewise.py (only with dense=True)."""
        if self._dense is None:
            raise InputError("this flow was integrated without dense output: pass dense=True")
        return self._dense[1]

    def __call__(self, t: Any) -> Array:
        """x(t): (n,) for a number, (n, N) for an array of times inside the interval (only with dense=True)."""
        if self._dense is None:
            raise InputError("this flow was integrated without dense output: pass dense=True")
        times = np.array(t, float, ndmin=1).ravel()
        out = np.empty((len(times), len(self.x)))
        runge_kutta.interpolate(self._dense[0], self._dense[1], times, out)
        return np.asarray(out.T.reshape(len(self.x), *np.shape(t)))


def pieces(
    compiled: CompiledField, t0: float, t1: float, period: float, breaks: Array
) -> Iterator[tuple[float, float]]:
    """[t0, t1] cut at the breaks (phases) of a forced field."""
    if not len(breaks):
        yield t0, t1
        return
    first, last = np.floor(t0 / period), np.ceil(t1 / period)
    inner = ((np.arange(first, last + 1)[:, None] + breaks).ravel()) * period
    tiny = 1e-12 * max(abs(t0), abs(t1), period)
    corners = np.concatenate([[t0], np.sort(inner[(inner > t0 + tiny) & (inner < t1 - tiny)]), [t1]])
    yield from zip(corners[:-1].tolist(), corners[1:].tolist())


def flow(
    system: Any, span: tuple[float, float], x0: Any, params: Array | None = None, *, rtol: float = 1e-10,
    atol: Any = 1e-12, variations: bool = False, parameters: Sequence[str] = (), dense: bool = False,
    max_steps: int = _MAX_STEPS,
) -> Flow:  # fmt: skip
    """Integrate from span[0] to span[1] > span[0].

    Parameters
    ----------
    system : System
    span : (t0, t1)
    x0 : state (mapping of names, missing ones zero, or array (n,))
    params : (m,) parameter values, default those of the system
    rtol, atol : relative and absolute (number or (n,)) tolerance of the state; variations are held to the same relative
        tolerance
    variations : True gives `matrix`;  parameters : names for `by_parameter`;  dense : True makes the result callable

    Raises
    ------
    InputError, UnknownNameError
        Before any work.
    NonFiniteError, ConvergenceError
        The solution leaves the finite range, or the step becomes too small (both carry t and x of the last good step).

    Examples
    --------
    >>> import numpy as np, stability as st
    >>> end = flow(st.models.mathieu(a=1.0, b=0.0, delta=0.0), (0.0, np.pi), dict(q=1.0), variations=True)
    >>> np.round(end.matrix, 8) + 0.0
    array([[-1.,  0.],
           [ 0., -1.]])
    """
    parameters = tuple(parameters)
    plan = _plan(system, variations, parameters)
    params = plan.params.copy() if params is None else np.array(params, float)
    x = system.state_vector(x0)
    n, (t0, t1) = len(x), (float(span[0]), float(span[1]))
    if not (math.isfinite(t0) and math.isfinite(t1) and t1 > t0):
        raise InputError(f"span = ({t0:g}, {t1:g}): two ascending finite times are needed")
    scales = np.empty(n)
    scales[:] = atol
    if not 1e-15 < rtol < 1 or not all(map((0.0).__lt__, scales.tolist())):
        raise InputError(f"rtol = {rtol:g} must lie in (1e-15, 1), atol = {atol} must be positive")
    compiled = plan.compiled
    if compiled is None:
        return _over_events(system, (t0, t1), x, params, rtol, atol, variations, parameters, dense, max_steps)
    z = plan.start.copy()
    z[:, 0] = x
    period, slopes, breaks = compiled.timing(params)
    rates = np.where(plan.which >= 0, slopes[plan.which], 0.0) if parameters else plan.rates
    steps, kept, h = 0, [], 0.0
    for start, end in pieces(compiled, t0, t1, period, breaks) if len(breaks) else ((t0, t1),):
        inside = 1e-13 * max(period, abs(end)) if len(breaks) else 0.0
        status, s, h, count, times, coefficients = runge_kutta.integrate(
            plan.address, params, 1.0, 0.0, 1.0 / period, start, end, z, plan.which, rates, rtol,
            scales, h, inside, max_steps - steps, dense,
        )  # fmt: skip
        steps += count
        if status != runge_kutta.DONE:
            raise _failure(system, status, s, z[:, 0], steps)
        if dense:
            kept.append((times, coefficients))
    matrix = z[:, 1 : n + 1].copy() if variations else None
    by_parameter = z[:, 1 + (n if variations else 0) :].copy() if parameters else None
    stored = None
    if dense:
        stored = (
            np.concatenate([kept[0][0][:1], *(k[0][1:] for k in kept)]),
            np.concatenate([k[1] for k in kept]),
        )
    return Flow(t1, z[:, 0].copy(), steps, matrix, by_parameter, stored)


@dataclass(frozen=True, eq=False)
class _Plan:
    """What all integrations of a system with the same variations have in common.

    params (m,) of the system; which (k,), rates (k,) zeros: see kernels/runge_kutta.py; start (n, 1 + k): a state of
    zeros and the variations at the start; compiled is None where events have to be looked for.
    """

    params: Array
    compiled: CompiledField | None
    address: int
    which: Array
    rates: Array
    start: Array


@lru_cache(maxsize=64)
def _plan(system: Any, variations: bool, parameters: tuple[str, ...]) -> _Plan:
    """The plan; nothing in it is written to."""
    params, n = system.parameter_vector(), system.n
    if system.stops or has_switches(system):
        none = np.zeros(0)
        return _Plan(params, None, 0, none, none, none)
    compiled = CompiledField.of(system)
    which = np.array([-1] * (n if variations else 0) + [compiled.place(name) for name in parameters], np.int64)
    start = np.zeros((n, 1 + len(which)))
    if variations:
        start[:, 1 : 1 + n] = np.eye(n)
    address = compiled.address if parameters else compiled.evaluations.address("FJ" if variations else "F")
    return _Plan(params, compiled, address, which, np.zeros(len(which)), start)


def _over_events(
    system: Any, span: tuple[float, float], x: Array, params: Array, rtol: float, atol: Any, variations: bool,
    parameters: Sequence[str], dense: bool, max_steps: int,
) -> Flow:  # fmt: skip
    from ..results.trajectory import Ending
    from .engine import Engine, Precision

    precision = Precision(rtol, atol, max_steps)
    engine = Engine.of(system)
    try:
        motion = engine.run(params, x, *span, precision, dense=dense, variations=variations, parameters=parameters)
    except InputError as error:  # beyond a wall: a Newton iterate may be there, and has to be told so
        raise ConvergenceError(str(error), t=span[0], x=x.copy(), steps=0) from error
    if motion.ending is not Ending.COMPLETED:
        codes = {Ending.DIVERGED: runge_kutta.NOT_FINITE, Ending.MAX_STEPS: runge_kutta.TOO_MANY_STEPS}
        status = codes.get(motion.ending, runge_kutta.STEP_TOO_SMALL)
        raise _failure(system, status, motion.t, motion.x, motion.steps)
    columns, n = motion.variations, len(x)
    assert columns is not None
    return Flow(
        motion.t, motion.x, motion.steps, columns[:, :n].copy() if variations else None,
        columns[:, n if variations else 0 :].copy() if parameters else None,
        (motion.edges, motion.nested) if dense else None,
    )  # fmt: skip


def _failure(system: Any, status: int, t: float, x: Array, steps: int) -> Exception:
    state = ", ".join(f"{name} = {value:.4g}" for name, value in zip(system.states, x))
    if status == runge_kutta.NOT_FINITE:
        why = CompiledField.of(system).evaluations.failure(keep=True)
        sentence = f"the solution of '{system.name}' is no longer finite at t = {t:.6g}; last state {state}{why}"
        return NonFiniteError(sentence)
    what = "needs too many steps" if status == runge_kutta.TOO_MANY_STEPS else "needs a step below rounding"
    return ConvergenceError(
        f"the integration of '{system.name}' {what} at t = {t:.6g}, {state}; loosen rtol and atol, or look for a jump "
        "of the right-hand side that is not declared in `breaks`",
        t=t, x=x.copy(), steps=steps,
    )  # fmt: skip
