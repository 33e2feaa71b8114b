"""Systems around a Python function f(t, x, *, parameters): the source of a System besides equations and energies."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import sympy as sp

from ..errors import EquationError, InputError, check_names
from .equations import symbol

__all__ = ["function_fields"]


def _signature_parameters(function: Callable[..., Any], given: Mapping[str, float] | None) -> dict[str, float]:
    if not callable(function):
        raise InputError(f"function must be callable as f(t, x, *, <parameters>); got {function!r}")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        raise InputError(f"the signature of {function!r} cannot be read; wrap it in a def f(t, x, *, ...)") from None
    positional = [p for p in signature.parameters.values() if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    keyword = [p for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY]
    if len(positional) != 2 or any(p.kind is p.VAR_POSITIONAL for p in signature.parameters.values()):
        raise InputError(f"the function must be f(t, x, *, <parameters>); its signature is {signature}")
    defaults: dict[str, Any] = {p.name: p.default for p in keyword}
    if not any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values()):
        check_names("parameter", given or {}, defaults, "the function")
    values = {**defaults, **(given or {})}
    for name, value in values.items():
        if value is inspect.Parameter.empty:
            raise InputError(f"parameter '{name}' has no default: give parameters=dict({name}=...)")
    return values


def _period(period: Any, parameters: Mapping[str, float]) -> Any:
    if period is None:
        return None
    if isinstance(period, str):
        from .parsing import parse_expression

        return parse_expression(period, list(parameters))
    if isinstance(period, sp.Expr):
        unknown = {s.name for s in period.free_symbols} - set(parameters)
        if unknown:
            raise EquationError(f"the period {period} uses unknown symbol(s) {', '.join(sorted(unknown))}")
        return period.xreplace({s: symbol(s.name) for s in period.free_symbols})
    if callable(period):
        wanted = set(inspect.signature(period).parameters)
        check_names("parameter", wanted, parameters, "the function")

        def of_parameters(**values: float) -> float:
            return float(period(**{k: values[k] for k in wanted}))

        return of_parameters
    return sp.Float(float(period))


def function_fields(
    function: Callable[..., Any],
    states: str | Sequence[str],
    period: Any,
    parameters: Mapping[str, float] | None,
    name: str | None,
    *,
    breaks: Iterable[float] = (),
    angles: Iterable[str] = (),
    **others: Any,
) -> dict[str, Any]:
    """The fields of a `System` around a Python function: the work behind `System.from_function`."""
    names = tuple(states.replace(",", " ").split()) if isinstance(states, str) else tuple(states)
    values = _signature_parameters(function, parameters)
    return {
        "name": name or getattr(function, "__name__", "function"),
        "coordinates": names,
        "states": names,
        "parameters": values,
        "rhs": None,
        "period_expression": _period(period, values),
        "function": function,
        "breaks": tuple(sp.sympify(b) for b in breaks),
        "angles": tuple(angles),
        **{k: (v or {}) if k in ("bounds", "units") else v for k, v in others.items()},
    }
