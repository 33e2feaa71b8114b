"""The command line: ``stability COMMAND ...``, one file a command, each loaded only when it is called.

Exit codes: 0 ok, 1 failure (a computation that did not come out), 2 bad input (a name, value, file or option), 130
interrupted. What the user can put right is one sentence without a traceback. With ``--json`` standard output is one
JSON document, of the result or of the error; progress and warnings go to standard error.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import click

from .._version import __version__
from ..errors import StabilityError, check_names
from ._console import Console, exit_code, failure, show_warning

__all__ = ["main"]

# command -> one line of help; the module stability.cli.<command> holds it under the name `command`
COMMANDS: dict[str, str] = {
    "average": "The slow flow by averaging or multiple scales, as text or LaTeX.",
    "basins": "Which steady motion every start of a grid comes to.",
    "chart": "Stability chart (instability tongues) over two parameters.",
    "continue": "Follow a branch of solutions, with its special points.",
    "demo": "A guided tour: writes figures and prints a table.",
    "doctor": "Which 'stability' is imported, versions, back ends, caches.",
    "models": "List the catalogue, or describe one model.",
    "new": "Write a commented template of a model as text.",
    "response": "A response by several methods on one axes, with folds and errors side by side.",
    "simulate": "Motion in time from given initial values.",
    "sweep": "Response along a slow sweep, as on a shaker.",
    "plot": "Draw a stored chart, branch, sweep or orbit, measured data over it.",
}
_FILES = {"continue": "continuation"}  # a keyword of Python is no name of a module


class _LazyGroup(click.Group):
    """A group that imports a command's module when that command is named, and not before."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command:
        check_names("command", [name], sorted(COMMANDS), "stability")
        loaded: click.Command = import_module(f"{__name__}.{_FILES.get(name, name)}").command
        return loaded

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(sorted(COMMANDS.items()))


@click.group(
    cls=_LazyGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(__version__, prog_name="stability")
@click.pass_context
def stability(ctx: click.Context) -> None:
    """Stability and bifurcations of oscillators.

    MODEL, wherever a command takes one, is a name of the catalogue (`stability models`), a text file such as
    my_oscillator.toml (`stability new my_oscillator.toml`), or a Python function as file.py:function.
    """
    ctx.obj = Console()
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    args : sequence of str, optional
        Arguments without the program's name; those of the process by default.

    Returns
    -------
    int
        0 ok, 1 failure, 2 bad input, 130 interrupted.

    Examples
    --------
    >>> from stability.cli import main
    >>> main(["--version"])
    stability, version ...
    0
    """
    arguments = list(sys.argv[1:] if args is None else args)
    with warnings.catch_warnings():
        warnings.showwarning = show_warning
        try:
            outcome: Any = stability.main(args=arguments, prog_name="stability", standalone_mode=False)
        except (click.ClickException, click.Abort, StabilityError, OSError, MemoryError, KeyboardInterrupt) as error:
            failure(error, as_json="--json" in arguments)
            return exit_code(error)
    return outcome if isinstance(outcome, int) else 0
