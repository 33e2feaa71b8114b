"""What a command says and where: results to standard output, progress and warnings to standard error.

Colour and spinners appear on a terminal only; with ``--json`` standard output carries exactly one JSON document.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TextIO

import click

from ..errors import EquationError, FileFormatError, InputError, StabilityError, UnknownNameError

__all__ = ["Console", "as_json_option", "exit_code", "failure", "show_warning"]

OK, FAILURE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
_BAD_INPUT = (InputError, UnknownNameError, EquationError, FileFormatError)
_BAD_FILES = (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError, PermissionError)


class Console:
    """The mouth of a command; `as_json` silences everything but `result`."""

    def __init__(self) -> None:
        self.as_json = False

    def say(self, text: str = "", **style: Any) -> None:
        """A line for a person; `style` as in `click.style`, dropped where output is no terminal."""
        if not self.as_json:
            click.echo(click.style(text, **style) if style else text)

    def table(self, rows: Sequence[Sequence[str]], *, indent: int = 2) -> None:
        """Left-aligned columns; the last one wraps to the terminal and keeps its indentation."""
        if self.as_json or not rows:
            return
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
        start = indent + sum(width + 2 for width in widths)
        room = max(30, self.width() - start)
        for row in rows:
            head = " " * indent + "".join(f"{cell:<{width + 2}}" for cell, width in zip(row, widths))
            tail = click.wrap_text(row[-1], room).split("\n") if len(row[-1]) > room else [row[-1]]
            click.echo((head + ("\n" + " " * start).join(tail)).rstrip())

    def result(self, document: dict[str, Any]) -> None:
        """The result as one JSON document, where ``--json`` asks for it."""
        if self.as_json:
            click.echo(json.dumps(document, indent=2, allow_nan=False, default=_plain))

    @contextlib.contextmanager
    def working(self, what: str) -> Iterator[Callable[[str], None]]:
        """A spinner on a terminal, nothing elsewhere; yields a function that changes its text."""
        if self.as_json or not sys.stderr.isatty():
            yield lambda text: None
            return
        from rich.console import Console as RichConsole

        with RichConsole(stderr=True).status(what) as status:
            yield lambda text: status.update(text)

    def is_terminal(self) -> bool:
        """Whether a person looks at standard output."""
        return not self.as_json and sys.stdout.isatty()

    @staticmethod
    def width() -> int:
        """Columns of the terminal, 110 where there is none."""
        import shutil

        return min(shutil.get_terminal_size((110, 40)).columns, 140)


def as_json_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """``--json``: it reaches the console before the command runs, the command itself does not see it."""

    def store(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
        ctx.ensure_object(Console).as_json = value

    decorated: Callable[..., Any] = click.option(
        "--json", is_flag=True, expose_value=False, callback=store, help="One JSON document on standard output."
    )(command)
    return decorated


def exit_code(error: BaseException) -> int:
    """Which exit code an error has: what the user can put right is 2."""
    if isinstance(error, (click.Abort, KeyboardInterrupt)):
        return INTERRUPTED
    if isinstance(error, click.ClickException):
        return error.exit_code
    return BAD_INPUT if isinstance(error, (*_BAD_INPUT, *_BAD_FILES)) else FAILURE


def failure(error: BaseException, as_json: bool) -> None:
    """Say on standard error what went wrong, and on standard output too where a JSON document was asked for."""
    if isinstance(error, (click.Abort, KeyboardInterrupt)):
        message, kind = "interrupted; no unfinished file was left", "Interrupted"
    else:
        message = error.format_message() if isinstance(error, click.ClickException) else _sentence(error)
        kind = type(error).__name__
    if as_json:
        document = {"error": {"type": kind, "message": message, "exit_code": exit_code(error)}}
        click.echo(json.dumps(document, indent=2))
    context = getattr(error, "ctx", None)
    if context is not None and not as_json:
        click.echo(context.get_usage(), err=True)
    click.echo(click.style("error: ", fg="red", bold=True) + message, err=True)


def show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """A warning as one sentence on standard error, without the source line that raised it."""
    click.echo(click.style("warning: ", fg="yellow", bold=True) + str(message), err=True)


def _sentence(error: BaseException) -> str:
    if isinstance(error, OSError) and not isinstance(error, StabilityError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error) or type(error).__name__


def _plain(value: Any) -> Any:
    """NumPy scalars and arrays, and complex numbers, as JSON."""
    if isinstance(value, complex):
        return [value.real, value.imag]
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)
