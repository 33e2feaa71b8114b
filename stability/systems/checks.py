"""What makes a `System` well-posed: names, values, symbols and the period are checked when it is built."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import EquationError, InputError, check_names

if TYPE_CHECKING:
    from .system import System

__all__ = ["checked_fields"]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_RESERVED = {"t", "pi"}


def _check_name(kind: str, name: Any) -> str:
    if not isinstance(name, str) or not _NAME.match(name) or "__" in name or keyword.iskeyword(name):
        raise EquationError(
            f"{kind} name {name!r} is not allowed: letters, digits and single underscores, no Python keyword"
        )
    if name in _RESERVED:
        raise EquationError(f"{kind} name '{name}' is reserved")
    return name


def _numbers(parameters: Mapping[str, Any]) -> dict[str, float]:
    out = {}
    for key, value in parameters.items():
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InputError(f"parameter '{key}' must be a number; got {value!r}") from None
        if not math.isfinite(number):
            raise InputError(f"parameter '{key}' must be finite; got {number}")
        out[key] = number
    return out


def _intervals(system: System) -> dict[str, tuple[float, float]]:
    bounds = {}
    for key, interval in system.bounds.items():
        try:
            lo, hi = map(float, interval)
        except (TypeError, ValueError):
            raise InputError(f"bounds of '{key}' must be a pair (lo, hi); got {interval!r}") from None
        if not lo < hi:
            raise InputError(f"bounds of '{key}' must satisfy lo < hi; got ({lo:g}, {hi:g})")
        bounds[key] = (lo, hi)
    for key, value in system.parameters.items():
        lo, hi = bounds.get(key, (-math.inf, math.inf))
        if not lo <= value <= hi:
            raise InputError(f"parameter '{key}' = {value:.15g} is outside its bounds [{lo:.15g}, {hi:.15g}]")
    return bounds


def _check_symbols(system: System) -> None:
    from .equations import TIME, symbol

    states = {symbol(s) for s in system.states}
    parameters = {symbol(p) for p in system.parameters}
    everything = states | parameters | {TIME}

    def check(where: str, expression: Any, allowed: set[Any]) -> None:
        unknown = sorted(str(s) for s in expression.free_symbols - allowed)
        if unknown:
            raise EquationError(
                f"{where} uses {', '.join(unknown)}: no state and no parameter "
                f"of '{system.name}'; give parameters=dict({unknown[0]}=...)"
            )
        if expression.has(*_infinities()):
            raise EquationError(f"{where} contains an infinite or undefined constant: {expression}")

    assert system.rhs is not None
    for s, e in zip(system.states, system.rhs):
        check(f"the equation of {s}", e, everything)
    for k, e in system.outputs.items():
        check(f"output '{k}'", e, everything)
    for k, e in system.reconstruction.items():
        check(f"the reconstruction of '{k}'", e, everything)
    if system.period_expression is not None:
        check("the period", system.period_expression, parameters)
    elif any(e.has(TIME) for e in system.rhs):
        raise EquationError(f"'{system.name}' depends on time: give its forcing period, period=...")
    for b in system.breaks:
        check("a break", b, parameters)


def _infinities() -> tuple[Any, ...]:
    import sympy as sp

    return sp.oo, -sp.oo, sp.zoo, sp.nan


def _symmetries(given: Any, states: tuple[str, ...]) -> tuple[Any, ...]:
    from .symmetries import Symmetry

    declared = (given,) if isinstance(given, (Mapping, Symmetry)) else tuple(given)
    whole = [(s if isinstance(s, Symmetry) else Symmetry(s)).completed(states) for s in declared]
    return tuple(Symmetry(s.images, s.shift) for s in whole)


def checked_fields(system: System) -> dict[str, Any]:
    """The fields of a new system, validated and in canonical types; raises before anything is computed."""
    states, coordinates = tuple(system.states), tuple(system.coordinates)
    parameters = _numbers(system.parameters)
    for s in states:
        _check_name("state", s)
    for p in parameters:
        _check_name("parameter", p)
    names = [*states, *parameters]
    twice = {n for n in names if names.count(n) > 1}
    if twice:
        raise EquationError(f"name '{sorted(twice)[0]}' stands for two things (states and parameters must differ)")
    if not states:
        raise EquationError("a system needs at least one state")
    check_names("state", coordinates, states, f"'{system.name}'")
    check_names("coordinate", system.angles, coordinates, f"'{system.name}'")
    check_names("parameter", system.bounds, names, f"'{system.name}'")
    check_names("parameter", system.units, [*names, *system.outputs], f"'{system.name}'")
    for stop in system.stops:
        check_names("coordinate", [stop.coordinate], coordinates, f"'{system.name}'")
    for k in system.outputs:
        _check_name("output", k)
    for k in system.reconstruction:
        _check_name("reconstructed state", k)
    rhs = system.rhs
    if (rhs is None) == (system.function is None):
        raise EquationError("a system has either expressions or a function")
    if rhs is not None:
        import sympy as sp

        rhs = tuple(sp.sympify(e) for e in rhs)
        if len(rhs) != len(states):
            raise EquationError(f"{len(rhs)} right-hand side(s) for {len(states)} state(s): a system must be square")
    object.__setattr__(system, "rhs", rhs)
    object.__setattr__(system, "parameters", parameters)
    if rhs is not None:
        _check_symbols(system)
    if system.period_expression is not None:
        system.period_at()
    return {
        "states": states, "coordinates": coordinates, "parameters": parameters, "bounds": _intervals(system),
        "angles": tuple(system.angles), "stops": tuple(system.stops),
        "breaks": tuple(system.breaks),
        "declared_symmetries": _symmetries(system.declared_symmetries, states),
    }  # fmt: skip
