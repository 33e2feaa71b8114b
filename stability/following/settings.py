"""What the user asked of a continuation, checked before any work starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ..errors import InputError, unknown_name
from ..protocols import Problem
from ..systems.system import System
from ..words import Kind
from .stepping import Steps

__all__ = ["Progress", "Settings", "checked", "checked_problem"]


class Progress(NamedTuple):
    """What a progress callback gets after every accepted point."""

    points: int
    parameter: float
    step: float  # scaled length of the next step
    special: int  # how many special points so far


@dataclass(frozen=True)
class Settings:
    """A continuation request: parameter, window (from, to), steps, wanted values, user functions, stops.

    told : names of the functions about which a warning was given
    """

    name: str
    index: int
    window: tuple[float, float]
    steps: Steps
    max_points: int
    at: tuple[float, ...]
    events: tuple[tuple[str, Callable[[Any], float]], ...]
    stop_at: tuple[str, ...]
    tolerance: float
    progress: Callable[[Progress], Any] | None
    told: set[str] = field(default_factory=set, compare=False)

    @property
    def low(self) -> float:
        """Lower wall of the parameter."""
        return min(self.window)

    @property
    def high(self) -> float:
        """Upper wall of the parameter."""
        return max(self.window)

    @property
    def weight(self) -> float:
        """1 / (scale of the parameter): a full window has length one."""
        return 1.0 / (self.high - self.low)


def _number(what: str, value: Any, low: float, high: float = math.inf) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{what} must be a number, got {value!r}") from None
    if not (math.isfinite(number) and low < number <= high):
        raise InputError(f"{what} must be a finite number > {low:g}, got {number:g}")
    return number


def _event_list(events: Any) -> tuple[tuple[str, Callable[[Any], float]], ...]:
    if callable(events):
        events = (events,)
    if isinstance(events, str) or not isinstance(events, Iterable):
        raise InputError(f"events must be a function, solution -> float, several, or a mapping of them, got {events!r}")
    pairs = list(events.items()) if isinstance(events, Mapping) else [("", e) for e in events]
    for name, function in pairs:
        if not callable(function):
            raise InputError(f"event {name or function!r} is not callable: give functions, solution -> float")
    return tuple((name or getattr(f, "__name__", "event"), f) for name, f in pairs)


def _stop_list(stop_at: Any, names: Iterable[str]) -> tuple[str, ...]:
    if not isinstance(stop_at, Iterable):
        raise InputError(f'stop_at must be kinds, labels or names of events, such as ("PD",), got {stop_at!r}')
    wanted = (stop_at,) if isinstance(stop_at, str) else tuple(stop_at)
    prefixes = {kind.label for kind in Kind}
    for item in wanted:
        known = isinstance(item, Kind) or item in names or str(item).rstrip("0123456789") in prefixes
        if not known:
            raise unknown_name("kind or event to stop at", item, [*sorted(prefixes), *names], "continuation")
    return tuple(item.label if isinstance(item, Kind) else str(item) for item in wanted)


def checked_problem(problem: Any) -> None:
    """InputError for anything that is no problem, above all a system, saying what to make of it."""
    if isinstance(problem, System):
        raise InputError(
            f"'{problem.name}' is a system, and its motions are of several sorts: give the problem to be solved, "
            "st.Collocation(system) for its periodic orbits or st.Equilibrium(system) for its equilibria"
        )
    if not (hasattr(problem, "seed") and hasattr(problem, "correct")):
        raise InputError(
            "a problem is needed, such as st.Collocation(system) or st.Equilibrium(system), "
            f"got {type(problem).__name__}"
        )


def checked(
    problem: Problem,
    name: str,
    window: Any,
    *,
    ds: float | None,
    ds_max: float | None,
    max_points: int,
    at: Any,
    events: Any,
    stop_at: Any,
    tolerance: float,
    progress: Any,
) -> Settings:
    """Settings from the arguments of `continuation`.

    Raises
    ------
    UnknownNameError, InputError
        The parameter does not exist; a window, step, value or tolerance is outside what is allowed.
    """
    checked_problem(problem)
    names = list(problem.parameters)
    if name not in names:
        raise unknown_name("parameter", name, names, "this problem")
    if hasattr(problem, "check_free"):
        problem.check_free(name)  # a parameter that breaks the symmetry of orbits solved on half of their period
    try:
        first, last = (float(v) for v in window)
    except (TypeError, ValueError):
        raise InputError(f"the window of '{name}' must be two numbers (from, to), got {window!r}") from None
    if not (math.isfinite(first) and math.isfinite(last)) or first == last:
        raise InputError(f"the window of '{name}' must be two different finite numbers, got ({first}, {last})")
    lowest, highest = getattr(getattr(problem, "system", None), "bounds", {}).get(name, (-math.inf, math.inf))
    if not lowest <= min(first, last) <= max(first, last) <= highest:
        raise InputError(
            f"the window ({first:g}, {last:g}) leaves the bounds [{lowest:g}, {highest:g}] of the parameter '{name}'"
        )
    longest = 0.2 if ds_max is None else _number("ds_max", ds_max, 0.0)
    step = min(0.01, longest) if ds is None else _number("ds", ds, 0.0)
    if step > longest:
        raise InputError(f"ds = {step:g} is longer than ds_max = {longest:g}")
    if not isinstance(max_points, int) or max_points < 2:
        raise InputError(f"max_points must be a whole number >= 2, got {max_points!r}")
    try:
        wanted = tuple(float(v) for v in (at if isinstance(at, Iterable) else (at,)))
    except (TypeError, ValueError):
        raise InputError(f"at must be values of '{name}', got {at!r}") from None
    outside = [v for v in wanted if not min(first, last) <= v <= max(first, last)]
    if outside:
        raise InputError(f"at = {outside[0]:g} lies outside the window ({first:g}, {last:g}) of '{name}'")
    listed = _event_list(events)
    return Settings(
        name,
        names.index(name),
        (first, last),
        Steps(step, longest, min(1e-9, step * 1e-3)),
        max_points,
        wanted,
        listed,
        _stop_list(stop_at, [n for n, _ in listed]),
        _number("tolerance", tolerance, 0.0, 1e-2),
        progress,
    )
