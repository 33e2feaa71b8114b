"""Where a model comes from on the command line: ``my_oscillator.toml``, ``file.py:function``, or a catalogue name.

A TOML file is data and runs nothing. A Python file is code that its user names as code: it is imported, and the
function is one of

    def swing() -> System: ...                            called without arguments, returns the System
    def swing(t, x, *, delta=0.1): ...                    a right-hand side x' = f(t, x), states in its attribute:
    swing.states, swing.period = "phi omega", None        (System.from_function)

or the name of a System built in the file. The catalogue of models is a floor above: its look-up is passed in.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from ..errors import InputError, unknown_name
from .system import System
from .textfile import load_model

_MISTAKES = (SyntaxError, ImportError, NameError, AttributeError, TypeError, LookupError, ArithmeticError)

__all__ = ["load_function", "resolve_model"]


def resolve_model(spec: str, catalogue: Callable[[str], System] | None = None) -> System:
    """The system that a command-line argument names.

    Parameters
    ----------
    spec : str
        ``FILE.toml``, ``FILE.py:NAME``, or a catalogue name if `catalogue` is given.
    catalogue : callable, optional
        Name -> System.

    Raises
    ------
    InputError
        A file that cannot be read, or a function that does not give a system.
    UnknownNameError
        No such name in the file.

    Examples
    --------
    >>> resolve_model("my_oscillator.yaml")
    Traceback (most recent call last):
        ...
    stability.errors.InputError: 'my_oscillator.yaml' is no model: give FILE.toml or FILE.py:FUNCTION
    """
    if not isinstance(spec, str):
        raise InputError(f"a model is named by text, not {type(spec).__name__}")
    if spec.lower().endswith(".toml"):
        return load_model(spec)
    path, separator, name = spec.rpartition(":")
    if separator and path.lower().endswith(".py"):
        return load_function(path, name)
    if spec.lower().endswith(".py"):
        raise InputError(f"'{spec}' is a Python file: name the function too, {spec}:FUNCTION")
    if catalogue is not None:
        return catalogue(spec)
    raise InputError(f"'{spec}' is no model: give FILE.toml or FILE.py:FUNCTION")


def load_function(path: str, name: str) -> System:
    """The system that `name` of the Python file `path` gives; the file is run. Errors as `resolve_model`."""
    file = Path(path)
    if not file.is_file():
        raise InputError(f"there is no file {path}")
    module = _imported(file)
    public = [k for k, v in vars(module).items() if not k.startswith("_") and (inspect.isfunction(v) or _is_system(v))]
    if name not in vars(module):
        raise unknown_name("function", name, public, file.name)
    found = vars(module)[name]
    if _is_system(found):
        return found
    if not callable(found):
        raise InputError(f"'{name}' in {file.name} is neither a function nor a System")
    return _system_of(found, f"{file.name}:{name}")


def _line(error: BaseException, file: Path) -> int:
    """The line of the file in which the error arose; 0 if none did."""
    if isinstance(error, SyntaxError):
        return error.lineno or 0
    lines = [f.lineno or 0 for f in traceback.extract_tb(error.__traceback__) if f.filename == str(file)]
    return lines[-1] if lines else 0


def _is_system(value: Any) -> bool:
    return isinstance(value, System)


def _imported(file: Path) -> ModuleType:
    """Run the file as a module of its own name, which can hide no other module, and without a change of sys.path."""
    name = f"stability_model_{hashlib.sha256(str(file.resolve()).encode()).hexdigest()[:16]}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise InputError(f"{file} cannot be imported as Python")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except _MISTAKES as error:
        del sys.modules[name]
        place = f", line {_line(error, file)}" if _line(error, file) else ""
        raise InputError(f"{file.name}{place} cannot be run: {type(error).__name__}: {error}") from error
    return module


def _system_of(function: Callable[..., Any], where: str) -> System:
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        raise InputError(f"the signature of {where} cannot be read") from None
    positional = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    required = [p for p in parameters if p.kind in positional and p.default is p.empty]
    if len(required) == 2:
        states = getattr(function, "states", None)
        if states is None:
            name = where.rpartition(":")[2]
            raise InputError(f'{where} is a right-hand side without names of its states: add {name}.states = "x v"')
        return System.from_function(function, states, period=getattr(function, "period", None))
    if required or any(p.kind is p.KEYWORD_ONLY and p.default is p.empty for p in parameters):
        raise InputError(f"{where} must take no arguments, or be a right-hand side f(t, x, *, <parameters>)")
    system = function()
    if not _is_system(system):
        raise InputError(f"{where} gave {type(system).__name__}; a System is needed")
    return system


