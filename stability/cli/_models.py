"""MODEL and ``--set``: from words on the command line to a `System`.

A catalogue name may carry a constructor (``base_driven_pendulum.from_physical``); then, and for the plain name, the
settings are the arguments of that call, so that options (``base_term=false``) can be set as well as parameters.
Settings of a text model or of a Python function are its parameters.
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError, StabilityError

if TYPE_CHECKING:
    from ..models._model import Model
    from ..systems.system import System

__all__ = ["system_from"]

_TROUBLE_IN_A_FILE = (
    ArithmeticError, AssertionError, AttributeError, LookupError, NameError, OSError, RuntimeError, TypeError,
    ValueError,
)  # fmt: skip


def system_from(text: str, settings: Mapping[str, Any]) -> System:
    """The system that MODEL and the settings describe; an error of use names what exists."""
    if ":" in text or Path(text).suffix in (".toml", ".py"):
        return _from_file(text).with_params(**_numbers(settings))
    from ..models import by_name

    name, _, constructor = text.partition(".")
    return _built(by_name(name), constructor, settings)


def _from_file(text: str) -> System:
    """A text model or a Python function; what goes wrong in the user's own code is said with its line."""
    from ..systems.sources import resolve_model

    try:
        return resolve_model(text)
    except StabilityError:
        raise
    except _TROUBLE_IN_A_FILE as error:
        file = text.rpartition(":")[0] or text
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename.endswith(file)]
        where = f"{file}, line {lines[-1]}" if lines else text
        raise InputError(f"{where}: {type(error).__name__}: {error}") from error


def _built(model: Model, constructor: str, settings: Mapping[str, Any]) -> System:
    if constructor and constructor not in model.constructors:
        have = ", ".join(f"{model.name}.{c}" for c in model.constructors) or f"{model.name} alone"
        raise click.BadParameter(f"there is no {model.name}.{constructor}; there is {have}", param_hint="'MODEL'")
    build = model.constructors[constructor] if constructor else model
    accepted = inspect.signature(build).parameters
    arguments = {k: v for k, v in settings.items() if k in accepted}
    _numbers({k: v for k, v in arguments.items() if isinstance(accepted[k].default, float)})
    others = {k: v for k, v in settings.items() if k not in accepted}
    try:
        system: System = build(**arguments)
    except TypeError as error:  # a word where a number belongs, or a required argument that is missing
        raise InputError(f"{model.name}: {error}") from error
    return system.with_params(**_numbers(others)) if others else system


def _numbers(settings: Mapping[str, Any]) -> dict[str, float]:
    for name, value in settings.items():
        if isinstance(value, (bool, str)):
            raise click.BadParameter(f"parameter {name} must be a number; got {value}", param_hint="'--set'")
    return dict(settings)
