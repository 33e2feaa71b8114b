r"""`sweep`: an experiment on the shaker, simulated.

At every value of the parameter the system dwells for a number of forcing periods; the last few are recorded. The
state is carried over to the next value (``start="carry"``: both stable branches are found, one in each direction) or
the system starts from rest each time (``start="rest"``). A dwell begins at phase 0 and lasts whole periods, so that a
carried forcing is continuous. The order of the ends is the direction.

Jumps: where the response differs more between two neighbours than between theirs, the sweep is repeated from the near
side with steps of 1/8, 1/64 and 1/512 of the interval; what keeps its size is a jump. A sweep through a fold jumps
late, by the delay of the passage: more periods bring the jump to the fold.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count
from typing import Any

import numpy as np

from ..errors import InputError, NonFiniteError, StabilityError, StabilityWarning, UnsettledWarning, check_names
from ..integration.engine import Engine, Precision
from ..results.sweep import Jump, Sweep
from ..results.trajectory import Ending
from .dwelling import Dwell, dwell

__all__ = ["sweep"]

Array = np.ndarray
_POINTS = 100
_PARTS = 8  # parts of an interval, level after level
_LEVELS = 3
_VISIBLE = 0.03  # of the largest response: smaller steps are not looked at
_ABRUPT = 1.6  # times the neighbours' steps: what is looked at
_KEPT = 0.4  # of its size: a jump is what keeps it while the steps get finer


def sweep(
    system: Any, parameter: str, window: tuple[float, float], *, start: str = "carry", periods: int = 50,
    record: int = 5, step: float | None = None, x0: Any = None, period: float | None = None, harmonics: int = 5,
    rtol: float = 1e-8, atol: Any = 1e-12, workers: int | None = None,
    progress: Callable[[int, int], Any] | None = None, **params: float,
) -> Sweep:  # fmt: skip
    """Sweep a parameter of a forced system and record the steady response, as on a shaker.

    Parameters
    ----------
    system : System
        Excited as it is (`System.with_excitation` changes between constant amplitude and constant acceleration).
    parameter : str
    window : (from, to)
        Their order is the direction.
    start : "carry" or "rest"
        Each value starts from the end of the one before, or from `x0`.
    periods, record : int
        Forcing periods per value, and how many of them, the last ones, are recorded.
    step : float, optional
        Step of the parameter; by default a hundredth of the window.
    x0 : state, default rest
    period : float, optional
        Length of a "period" of an autonomous system.
    harmonics : int
    rtol, atol : tolerances of the integration
    workers : int, threads (``start="rest"`` only; a carried sweep is a chain)
    progress : called with (done, total)
    **params : values of the other parameters

    Returns
    -------
    Sweep
        A sweep ends early, with its points so far, where the motion escapes, a Python right-hand side raises, or
        Ctrl-C is pressed: see ``status``.

    Raises
    ------
    InputError, UnknownNameError
        Before any work.
    StabilityError
        There is no first point to keep; what a right-hand side raised there is a NonFiniteError.

    Warns
    -----
    StabilityWarning
        The sweep was cut short by an error or Ctrl-C.
    UnsettledWarning
        Where more than 1 % of the transient is left in what was recorded.

    Examples
    --------
    >>> import stability as st
    >>> up = st.sweep(st.models.duffing(xi=0.05, beta=0.0), "Omega", (0.8, 1.2), step=0.1)
    >>> [round(v, 2) for v in up.maximum["u"].tolist()]
    [1.74, 3.85, 10.0, 5.1, 3.16]
    """
    plan = _Plan.checked(system, parameter, window, start, periods, record, step, x0, period, harmonics, params)
    precision = Precision(rtol, atol)
    precision.scales(system.n)
    engine = Engine.of(system)
    values = plan.values()
    run = _Runner(engine, plan, precision)
    dwells: list[Dwell] = []
    last = Ending.COMPLETED
    jumps: tuple[Jump, ...] = ()
    try:
        if start == "carry":
            _carried(run, values, plan.x0, progress, dwells)
        else:
            _from_rest(run, values, plan.x0, workers, progress, dwells)
    except (NonFiniteError, KeyboardInterrupt) as error:
        last = _cut_short(error, dwells, parameter, values)
    if dwells[-1].ending is not Ending.COMPLETED:
        last = dwells.pop().ending
    if not dwells:
        raise StabilityError(f"'{system.name}' escapes at the first value, {parameter} = {values[0]:g} ({last})")
    values = values[: len(dwells)]
    try:
        jumps = () if last is Ending.INTERRUPTED else _jumps(run, values, dwells)
    except KeyboardInterrupt as error:
        last = _cut_short(error, dwells, parameter, values)
    result = _collected(run, values, dwells, last, jumps)
    _warn(result)
    return result


def _cut_short(error: BaseException, dwells: list[Dwell], parameter: str, values: Array) -> Ending:
    """What ends a sweep from outside, told by a warning; raised again where there is no point to keep."""
    if not dwells:
        raise error
    interrupted = isinstance(error, KeyboardInterrupt)
    here = values[min(len(dwells), len(values) - 1)]
    where = f"after {len(dwells)} of {len(values)} points, at {parameter} = {here:g}"
    why = "interrupted; jumps may be missing" if interrupted else str(error)
    warnings.warn(f"the sweep ends {where}: {why}", StabilityWarning, stacklevel=3)
    return Ending.INTERRUPTED if interrupted else Ending.FAILED


@dataclass(frozen=True)
class _Plan:
    """The checked request."""

    parameter: str
    window: tuple[float, float]
    step: float
    start: str
    periods: int
    record: int
    harmonics: int
    period: float | None
    x0: Array
    params: Array
    place: int

    @classmethod
    def checked(
        cls, system: Any, parameter: str, window: Any, start: str, periods: int, record: int, step: float | None,
        x0: Any, period: float | None, harmonics: int, params: dict[str, float],
    ) -> _Plan:  # fmt: skip
        check_names("parameter", [parameter], system.parameters)
        try:
            lo, hi = (float(v) for v in window)
        except (TypeError, ValueError):
            raise InputError(f"the window is (from, to), two numbers; got {window!r}") from None
        if not (math.isfinite(lo) and math.isfinite(hi) and lo != hi):
            raise InputError(f"the window needs two different finite ends; got ({lo:g}, {hi:g})")
        if parameter in params:
            raise InputError(f"'{parameter}' is swept: it cannot be given a value, too")
        if start not in ("carry", "rest"):
            raise InputError(f"start = {start!r}; 'carry' (from the state before) or 'rest' (from x0 each time)")
        for name, value, low in (("periods", periods, 2), ("record", record, 1), ("harmonics", harmonics, 1)):
            if not isinstance(value, (int, np.integer)) or value < low:
                raise InputError(f"{name} = {value!r}: a whole number >= {low} is needed")
        if record >= periods:
            raise InputError(f"record = {record} of periods = {periods}: something must be left for settling")
        width = abs(hi - lo)
        step = width / _POINTS if step is None else float(step)
        if not 0 < step <= width:
            raise InputError(f"step = {step:g}: a positive number up to the window's width, {width:g}, is needed")
        if system.period_expression is None and (period is None or not 0 < period < math.inf):
            raise InputError(f"'{system.name}' is autonomous: give period=, the length of a dwell's unit")
        if system.period_expression is not None and period is not None:
            raise InputError(f"'{system.name}' has its own forcing period: leave period= out")
        for end in (lo, hi):
            system.parameter_vector(**params, **{parameter: end})
        base = system.parameter_vector(**params)
        place = list(system.parameters).index(parameter)
        return cls(parameter, (lo, hi), step, start, int(periods), int(record), int(harmonics), period,
                   system.state_vector(x0), base, place)  # fmt: skip

    def values(self) -> Array:
        """The parameter's values, both ends included; the last step may be shorter."""
        lo, hi = self.window
        count = int(abs(hi - lo) / self.step * (1 + 1e-12))
        inner = lo + math.copysign(self.step, hi - lo) * np.arange(count + 1)
        if abs(inner[-1] - hi) < 1e-9 * self.step:
            inner[-1] = hi
            return np.asarray(inner)
        return np.append(inner, hi)


@dataclass(frozen=True)
class _Runner:
    """Dwells at given values."""

    engine: Engine
    plan: _Plan
    precision: Precision

    def __call__(self, value: float, x0: Array) -> Dwell:
        plan = self.plan
        params = plan.params.copy()
        params[plan.place] = value
        period = self.engine.period(params) if plan.period is None else plan.period
        return dwell(self.engine, params, x0, period, plan.periods, plan.record, plan.harmonics, self.precision)


def _carried(run: _Runner, values: Array, x: Array, progress: Any, dwells: list[Dwell]) -> None:
    """Fill `dwells`, which the caller keeps whatever happens."""
    for k, value in enumerate(values):
        dwells.append(run(float(value), x))
        if dwells[-1].ending is not Ending.COMPLETED:
            break
        x = dwells[-1].end
        if progress is not None:
            progress(k + 1, len(values))


def _from_rest(
    run: _Runner, values: Array, x: Array, workers: int | None, progress: Any, dwells: list[Dwell]
) -> None:  # fmt: skip
    """Fill `dwells`, which the caller keeps whatever happens."""
    threads = 1 if run.engine.compiled.evaluations.backend != "llvm" else workers or cpu_count() or 1
    with ThreadPoolExecutor(max(1, min(threads, len(values)))) as pool:
        try:
            for k, found in enumerate(pool.map(lambda value: run(float(value), x), values)):
                dwells.append(found)
                if found.ending is not Ending.COMPLETED:
                    break
                if progress is not None:
                    progress(k + 1, len(values))
        finally:
            pool.shutdown(cancel_futures=True)


# ---------------------------------------------------------------------- jumps


def _jumps(run: _Runner, values: Array, dwells: list[Dwell]) -> tuple[Jump, ...]:
    """Steps of the response that stay while the parameter's interval is halved."""
    if len(dwells) < 3:
        return ()
    n = len(run.engine.system.states)
    sizes = np.array([d.size[:n] for d in dwells])
    unit = np.where(sizes.max(axis=0) > 0, sizes.max(axis=0), 1.0)
    steps = (np.abs(np.diff(sizes, axis=0)) / unit).max(axis=1)
    padded = np.concatenate([[steps[1]], steps, [steps[-2]]])
    around = np.minimum(padded[:-2], padded[2:])
    candidates = np.nonzero((steps > _VISIBLE) & (steps > _ABRUPT * around))[0]
    found: dict[int, Jump] = {}
    for k in candidates.tolist():
        jump = _located(run, float(values[k]), float(values[k + 1]), dwells[k], dwells[k + 1], unit, float(steps[k]))
        if jump is None:
            continue
        if k - 1 in found and not dwells[k].settled:  # one jump, recorded on its way
            found[k - 1] = found[k - 1]._replace(after=jump.after)
        else:
            found[k] = jump
    return tuple(found.values())


def _located(
    run: _Runner, lo: float, hi: float, before: Dwell, after: Dwell, unit: Array, size: float
) -> Jump | None:
    """The jump by finer and finer steps from the near side; None where the response turns out to be steep only.

    A large step may kick the motion off its branch before the branch ends: the finer steps go on beyond `hi` then.
    """

    def distance(a: Dwell, b: Dwell) -> float:
        return float((np.abs(a.size - b.size)[: len(unit)] / unit).max())

    carried, last, width = run.plan.start == "carry", run.plan.window[1], hi - lo
    for level in range(1, _LEVELS + 1):
        start, part = lo, width / _PARTS**level
        for i in range(1, 3 * _PARTS + 1):
            value = start + i * part
            if (value - last) * part > 0:
                return None
            try:
                found = run(value, before.end if carried else run.plan.x0)
            except NonFiniteError:  # a Python right-hand side that raises
                return None
            if found.ending is not Ending.COMPLETED:
                return None
            if distance(before, found) > _KEPT * size:
                hi, after = value, found
                break
            if level == 1 and i == _PARTS and distance(found, after) < 0.5 * _KEPT * size:
                return None
            lo, before = value, found
        else:
            return None
    names = (*run.engine.system.states, *run.engine.system.outputs)
    sides = [{name: (float(d.low[i]), float(d.high[i])) for i, name in enumerate(names)} for d in (before, after)]
    return Jump(0.5 * (lo + hi), (lo, hi), sides[0], sides[1])


def _collected(run: _Runner, values: Array, dwells: list[Dwell], last: Ending, jumps: tuple[Jump, ...]) -> Sweep:
    plan, system = run.plan, run.engine.system
    fixed = {k: float(v) for k, v in zip(system.parameters, plan.params) if k != plan.parameter}
    return Sweep(
        system=system.name, name=plan.parameter, window=plan.window, start=plan.start, states=tuple(system.states),
        output_names=tuple(system.outputs), parameter=values,
        low=np.array([d.low for d in dwells]), high=np.array([d.high for d in dwells]),
        average=np.array([d.average for d in dwells]), coefficients=np.array([d.coefficients for d in dwells]),
        strobes=np.array([d.strobes for d in dwells]), transient=np.array([d.transient for d in dwells]),
        settled=np.array([d.settled for d in dwells]), multiple=np.array([d.multiple for d in dwells]),
        params=fixed, periods=plan.periods, record=plan.record, status=last, jumps=jumps, units=dict(system.units),
    )  # fmt: skip


def _warn(result: Sweep) -> None:
    bad = np.nonzero(~result.settled)[0]
    if not bad.size:
        return
    worst = bad[np.argmax(result.transient[bad])]
    left = result.transient[worst]
    share = f"{100 * left:.2g} % of" if np.isfinite(left) else "an unknown part of"
    warnings.warn(
        f"{bad.size} of {len(result)} points have not settled in {result.periods} periods (worst at {result.name} = "
        f"{result.parameter[worst]:.6g}: {share} the transient is left): use more periods, or it is not periodic",
        UnsettledWarning,
        stacklevel=3,
    )
