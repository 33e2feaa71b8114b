"""Typed errors and warnings: each sentence names the field, the value received, what is allowed and what to try next.

One root, `StabilityError`; each subclass also derives from the builtin a caller would expect (KeyError, ValueError,
...). Errors of use are raised before any computation starts. Numerical trouble carries its data as attributes
(last good point, residual, iterations), so that nothing that was computed is lost.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

__all__ = [
    "CompileError",
    "ConvergenceError",
    "EquationError",
    "ExpressionError",
    "FileFormatError",
    "InputError",
    "MissingDependencyError",
    "NonFiniteError",
    "OpenResonanceWarning",
    "ResourceLimitError",
    "StabilityError",
    "StabilityWarning",
    "TruncationWarning",
    "UnknownNameError",
    "UnsettledWarning",
    "unknown_name",
]


class StabilityError(Exception):
    """Root of every error this library raises on purpose."""


class InputError(StabilityError, ValueError):
    """An argument is outside what is allowed; raised before any work starts."""


class UnknownNameError(StabilityError, KeyError):
    """A state, parameter, model, column or label that does not exist; the sentence names the nearest one that does."""

    def __str__(self) -> str:  # KeyError would show the repr, with quotes
        return str(self.args[0]) if self.args else ""


class EquationError(StabilityError, ValueError):
    """Equations that are not a well-posed system (not square, unknown symbols, singular mass matrix)."""


class ExpressionError(EquationError):
    """Text that is not an allowed expression; `column` points into `text`, and the message draws a caret there."""

    def __init__(self, message: str, text: str = "", column: int | None = None) -> None:
        self.text, self.column = text, column
        if text and column is not None:
            message = f"{message}\n    {text}\n    {' ' * column}^"
        super().__init__(message)


class CompileError(StabilityError, NotImplementedError):
    """A function that no compiled back end knows; the sentence names it and the alternative."""


class NonFiniteError(StabilityError, ArithmeticError):
    """The right-hand side is NaN or infinite where a finite value is needed; names the state and the place."""


class ConvergenceError(StabilityError, RuntimeError):
    """An iteration did not converge; carries what it had (any keyword becomes an attribute, also in `.data`)."""

    def __init__(self, message: str, **data: Any) -> None:
        super().__init__(message)
        self.data = data
        for key, value in data.items():
            setattr(self, key, value)


class ResourceLimitError(StabilityError, MemoryError):
    """The request does not fit the machine (memory, points); names the size asked for and the limit."""


class FileFormatError(StabilityError, ValueError):
    """A file that is not what its name says, or is damaged."""


class MissingDependencyError(StabilityError, ImportError):
    """An optional package is needed for this call; the sentence says which and how to install it."""


class StabilityWarning(UserWarning):
    """Root of every warning of this library."""


class TruncationWarning(StabilityWarning):
    """Too few harmonics, nodes or intervals for the accuracy asked for; says how many are missing."""


class OpenResonanceWarning(StabilityWarning):
    """A resonance that never turns back: its branch has no peak, and the lower branch is not connected with it."""


class UnsettledWarning(StabilityWarning):
    """A transient has not died out where a steady value is recorded."""


def unknown_name(what: str, name: object, allowed: Iterable[str], owner: str = "this system") -> UnknownNameError:
    """The error for a misspelt name: lists what exists and proposes the nearest.

    >>> print(unknown_name("parameter", "omga", ["xi", "beta", "Omega"]))
    no parameter 'omga'; this system has xi, beta, Omega; did you mean 'Omega'?
    """
    names = list(allowed)
    lowered = {n.lower(): n for n in reversed(names)}
    close = difflib.get_close_matches(str(name).lower(), list(lowered), n=1, cutoff=0.5)
    listing = ", ".join(names) if names else f"no {what}s at all"
    hint = f"; did you mean '{lowered[close[0]]}'?" if close else ""
    return UnknownNameError(f"no {what} '{name}'; {owner} has {listing}{hint}")


def check_names(
    what: str, given: Mapping[str, Any] | Iterable[str], allowed: Iterable[str], owner: str = "this system"
) -> None:
    """Raise `UnknownNameError` for the first name in `given` that is not `allowed`."""
    known = list(allowed)
    for name in given:
        if name not in known:
            raise unknown_name(what, name, known, owner)
