"""Base motion in SI units, shared by every ``from_physical``: y0 = A cos(w t), w = 2 pi frequency.

Either the amplitude A (m) or the acceleration amplitude A w^2 (m/s^2) is the parameter in the equations; the other one
follows. Coordinates are relative to the moving base, so that the base acts on a mass m by -m y0'' = +m A w^2 cos(w t).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ..constants import GRAVITY
from ..errors import InputError
from ..systems.excitation import BaseMotion

__all__ = ["GRAVITY", "Shaker", "positive", "shaker"]

t = sp.Symbol("t", real=True)


def positive(zero_allowed: bool = False, **values: float | None) -> None:
    """InputError for the first value that is not a positive (or non-negative) finite number."""
    for name, value in values.items():
        if value is None:
            raise InputError(f"{name} is needed")
        number = float(value)
        if not math.isfinite(number) or number < 0 or (number == 0 and not zero_allowed):
            raise InputError(f"{name} must be {'zero or ' if zero_allowed else ''}positive and finite; got {value}")


@dataclass(frozen=True)
class Shaker:
    """The base motion's expressions and parameters."""

    acceleration: sp.Expr  # A w^2
    omega: sp.Expr  # w
    motion: BaseMotion
    parameters: dict[str, float]
    units: dict[str, str]
    bounds: dict[str, tuple[float, float]]

    @property
    def amplitude(self) -> sp.Expr:
        """A as an expression in the parameters."""
        return self.acceleration / self.omega**2

    @property
    def load(self) -> sp.Expr:
        """-y0'' = A w^2 cos(w t): the base's load per unit mass."""
        return self.acceleration * sp.cos(self.omega * t)

    @property
    def displacement(self) -> sp.Expr:
        """y0 = A cos(w t)."""
        return self.amplitude * sp.cos(self.omega * t)


def shaker(amplitude: float | None, acceleration: float | None, frequency: float) -> Shaker:
    """The base motion of exactly one of an amplitude (m) and an acceleration amplitude (m/s^2), at a frequency (Hz)."""
    if (amplitude is None) == (acceleration is None):
        raise InputError("give exactly one of amplitude=... (m) and acceleration=... (m/s^2)")
    positive(frequency=frequency)
    f = sp.Symbol("frequency", real=True)
    omega = 2 * sp.pi * f
    name, value, unit = (
        ("amplitude", amplitude, "m") if acceleration is None else ("acceleration", acceleration, "m/s^2")
    )
    assert value is not None
    positive(zero_allowed=True, **{name: value})
    symbol: Any = sp.Symbol(name, real=True)
    return Shaker(
        acceleration=symbol * omega**2 if name == "amplitude" else symbol,
        omega=omega,
        motion=BaseMotion(name, omega),
        parameters={name: float(value), "frequency": float(frequency)},
        units={name: unit, "frequency": "Hz"},
        bounds={"frequency": (1e-9, math.inf)},
    )
