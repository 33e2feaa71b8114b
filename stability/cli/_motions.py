"""What the time-domain commands read: ``from:to`` in either direction, accelerations such as ``0.5g``."""

from __future__ import annotations

from typing import Any

import click

from ..constants import GRAVITY
from ..errors import InputError
from ._arguments import _number

__all__ = ["ACCELERATION", "RANGE", "excited", "swept_parameter"]

_USUAL = ("frequency", "Omega", "omega", "eta")


class _Range(click.ParamType):
    """``from:to`` -> (from, to), in either order."""

    name = "from:to"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        if isinstance(value, tuple):
            return value
        parts = [_number(part) for part in value.split(":")]
        if len(parts) != 2 or parts[0] is None or parts[1] is None:
            self.fail(f"'{value}' is not from:to with two numbers, for example 5:40, or 40:5 downwards", param, ctx)
        if parts[0] == parts[1]:
            self.fail(f"'{value}': the two ends must differ", param, ctx)
        return parts[0], parts[1]


class _Acceleration(click.ParamType):
    """``0.5g`` or ``4.9`` (m/s^2) -> m/s^2."""

    name = "acceleration"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        in_g = value.lower().endswith("g")
        number = _number(value[:-1] if in_g else value)
        if number is None or number < 0:
            self.fail(f"'{value}' is no acceleration; write 0.5g, or 4.905 for m/s^2", param, ctx)
        return number * GRAVITY if in_g else number


RANGE, ACCELERATION = _Range(), _Acceleration()


def excited(system: Any, acceleration: float | None, amplitude: float | None) -> Any:
    """The system at constant base acceleration (m/s^2) or amplitude (m), where one is given."""
    from ..systems.excitation import ConstantAcceleration, ConstantAmplitude

    if acceleration is not None and amplitude is not None:
        raise click.UsageError("--acceleration and --amplitude exclude each other")
    if acceleration is not None:
        return system.with_excitation(ConstantAcceleration(acceleration))
    if amplitude is not None:
        return system.with_excitation(ConstantAmplitude(amplitude))
    return system


def swept_parameter(system: Any, given: str | None) -> str:
    """The parameter that a sweep goes along: the one named, else the excitation frequency by its usual names."""
    if given is not None:
        return given
    for name in _USUAL:
        if name in system.parameters:
            return name
    raise InputError(f"which parameter? --parameter NAME; '{system.name}' has {', '.join(system.parameters)}")
