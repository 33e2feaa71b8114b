"""`Model`: a catalogue entry, a callable that makes a `System`, with its equation, source and figure.

    model(...)               -> System   (dimensionless, or in the parameters of its equation)
    model.from_physical(...) -> System   (SI units), where the entry has one

The functions behind a model are keyword-only with defaults that show the phenomenon.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

from ..errors import InputError, check_names
from ..systems.system import System

__all__ = ["Model", "model"]


class Model:
    """A catalogue entry: calling it gives a `System`; further constructors are attributes.

    Attributes
    ----------
    name : str
        Catalogue name.
    equation : str
        The equation of motion in plain text.
    source : str
        Where it comes from (chapter equation, catalogue section, literature).
    figure : str
        The figures of the chapter in which it appears ("" if none).
    constructors : dict
        Name -> further constructor (``from_physical``, ...).
    """

    def __init__(self, function: Callable[..., System], equation: str, source: str, figure: str, group: str) -> None:
        functools.update_wrapper(self, function)
        self.name = function.__name__
        self.equation, self.source, self.figure, self.group = equation, source, figure, group
        self.constructors: dict[str, Callable[..., System]] = {}
        self._function = function
        self.__signature__ = inspect.signature(function)

    @property
    def summary(self) -> str:
        """First line of the docstring."""
        return (self.__doc__ or "").strip().splitlines()[0]

    def __call__(self, *args: Any, **params: Any) -> System:
        """The system; unknown names are answered with the nearest valid one."""
        return _called(self._function, self.name, args, params)

    def constructor(self, function: Callable[..., System]) -> Callable[..., System]:
        """Decorator: attach a further constructor under the function's own name (``from_physical``)."""
        name = function.__name__

        @functools.wraps(function)
        def checked(*args: Any, **params: Any) -> System:
            return _called(function, f"{self.name}.{name}", args, params)

        self.constructors[name] = checked
        return checked

    def __getattr__(self, name: str) -> Any:
        constructors = self.__dict__.get("constructors", {})
        if name in constructors:
            return constructors[name]
        if name.startswith("from_"):
            have = ", ".join(constructors) or "none besides the call itself"
            raise AttributeError(f"model '{self.__dict__.get('name')}' has no constructor '{name}'; it has {have}")
        raise AttributeError(name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.constructors]

    def __repr__(self) -> str:
        shown = [str(p.replace(annotation=p.empty)) for p in self.__signature__.parameters.values()]
        return f"Model {self.name}: {self.summary}\n  {self.equation}\n  {self.name}({', '.join(shown)})"


def _called(function: Callable[..., System], name: str, args: tuple[Any, ...], params: dict[str, Any]) -> System:
    signature = inspect.signature(function)
    positional = [p for p in signature.parameters.values() if p.kind is not p.KEYWORD_ONLY]
    if len(args) > len(positional):
        raise InputError(f"{name} takes keyword arguments only: {', '.join(signature.parameters)}")
    if not any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values()):
        check_names("parameter", params, signature.parameters, name)
    return function(*args, **params)


def model(*, equation: str, source: str, figure: str = "", group: str = "") -> Callable[[Callable[..., System]], Model]:
    """Decorator that makes a catalogue entry of a keyword-only function that returns a `System`."""

    def wrap(function: Callable[..., System]) -> Model:
        return Model(function, equation, source, figure, group)

    return wrap
