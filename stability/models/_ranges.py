"""Admissible ranges of physical quantities, checked before any work: each refusal names field, value and range."""

from __future__ import annotations

import math
from typing import Any

from ..errors import InputError

__all__ = ["choice", "finite", "non_negative", "positive"]


def _number(owner: str, name: str, value: Any, allowed: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{owner}: {name} must be a number {allowed}; got {value!r}") from None
    if not math.isfinite(number):
        raise InputError(f"{owner}: {name} must be a finite number {allowed}; got {number}")
    return number


def finite(owner: str, name: str, value: Any) -> float:
    """The value as a finite float."""
    return _number(owner, name, value, "in (-inf, inf)")


def positive(owner: str, name: str, value: Any, unit: str = "") -> float:
    """The value as a float > 0.

    >>> positive("disc", "radius", 0.01, "m")
    0.01
    """
    number = _number(owner, name, value, "> 0")
    if number <= 0.0:
        raise InputError(f"{owner}: {name} must be > 0{' ' + unit if unit else ''}; got {number:g}")
    return number


def non_negative(owner: str, name: str, value: Any, unit: str = "") -> float:
    """The value as a float >= 0."""
    number = _number(owner, name, value, ">= 0")
    if number < 0.0:
        raise InputError(f"{owner}: {name} must be >= 0{' ' + unit if unit else ''}; got {number:g}")
    return number


def choice(owner: str, name: str, value: Any, allowed: tuple[str, ...]) -> str:
    """The value, which must be one of the allowed words."""
    if value not in allowed:
        raise InputError(f"{owner}: {name} must be one of {', '.join(map(repr, allowed))}; got {value!r}")
    return str(value)
