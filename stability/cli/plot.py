"""``stability plot FILE.npz``: draw a stored chart, branch or orbit; no solver is loaded."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import click

from ..errors import FileFormatError
from ._arguments import check_outputs, replacing
from ._console import Console, as_json_option

PICTURES = (".png", ".svg", ".pdf")


@click.command("plot")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--y", metavar="COLUMN", help="What of a branch is drawn, such as u.max.")
@click.option("--kind", type=click.Choice(["growth_rate", "class"]), help="What of a chart is drawn.")
@click.option("-o", "--output", type=click.Path(path_type=Path),
              help="Picture to write (.png .svg .pdf); by default FILE with the ending .png.")
@click.option("--force", is_flag=True, help="Overwrite an existing picture.")
@as_json_option
@click.pass_obj
def command(
    console: Console, file: Path, y: str | None, kind: str | None, output: Path | None, force: bool
) -> None:
    """Draw a stored result (a .npz file that `chart` or `continue` wrote)."""
    target = output or file.with_suffix(".png")
    check_outputs([target], PICTURES, force)
    from .. import load
    from ._pictures import write_picture

    with console.working(f"drawing {file}"):
        result = load(file)
        if not hasattr(result, "plot"):
            raise FileFormatError(f"{file} holds a {type(result).__name__}, which has no picture")
        options: dict[str, Any] = {k: v for k, v in (("y", y), ("kind", kind)) if v is not None}
        wrong = [f"--{name}" for name in options if name not in inspect.signature(result.plot).parameters]
        if wrong:
            raise click.UsageError(f"a {type(result).__name__} is not drawn with {' '.join(wrong)}")
        with replacing(target) as temporary:
            write_picture(temporary, lambda axes: result.plot(ax=axes, **options))
    console.say(repr(result))
    console.say(f"wrote {target}")
    console.result({"result": type(result).__name__, "written": str(target)})
