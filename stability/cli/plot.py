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
@click.option("--data", type=click.Path(path_type=Path), multiple=True,
              help="Measured response to draw over a branch or sweep: csv, 'f [Hz], amplitude [mm]' above.")
@click.option("--y", metavar="COLUMN", help="What of a branch is drawn, such as u.max.")
@click.option("--kind", type=click.Choice(["growth_rate", "class"]), help="What of a chart is drawn.")
@click.option("-o", "--output", type=click.Path(path_type=Path),
              help="Picture to write (.png .svg .pdf); by default FILE with the ending .png.")
@click.option("--force", is_flag=True, help="Overwrite an existing picture.")
@as_json_option
@click.pass_obj
def command(
    console: Console, file: Path, data: tuple[Path, ...], y: str | None, kind: str | None, output: Path | None,
    force: bool,
) -> None:  # fmt: skip
    """Draw a stored result (a .npz file that `chart`, `continue` or `sweep` wrote), measured data over it."""
    target = output or file.with_suffix(".png")
    check_outputs([target], PICTURES, force)
    from .. import load, load_response
    from ._pictures import write_picture

    with console.working(f"drawing {file}"):
        result = load(file)
        if not hasattr(result, "plot"):
            raise FileFormatError(f"{file} holds a {type(result).__name__}, which has no picture")
        options: dict[str, Any] = {k: v for k, v in (("y", y), ("kind", kind)) if v is not None}
        wrong = [f"--{name}" for name in options if name not in inspect.signature(result.plot).parameters]
        if wrong:
            raise click.UsageError(f"a {type(result).__name__} is not drawn with {' '.join(wrong)}")
        measured = [load_response(path) for path in data]
        if measured:
            options["y"] = _laid_over(result, measured, y)

        def draw(axes: Any) -> None:
            result.plot(ax=axes, **options)
            for path, one in zip(data, measured):
                one.plot(ax=axes, y=options["y"], label=path.stem)
            if measured:
                axes.legend(frameon=False, fontsize="small")

        with replacing(target) as temporary:
            write_picture(temporary, draw)
    for shown in (result, *measured):
        console.say(repr(shown))
    console.say(f"wrote {target}")
    console.result({"result": type(result).__name__, "data": [str(path) for path in data], "written": str(target)})


def _laid_over(result: Any, measured: list[Any], y: str | None) -> str:
    """The column that is drawn: of the branch or sweep and of every measured response."""
    if not hasattr(result, "to_columns") and not hasattr(result, "columns"):
        raise click.UsageError(f"measured data are drawn over a branch or a sweep, not over a {type(result).__name__}")
    for one in measured:
        if one.name != result.name:
            kind = type(result).__name__
            raise click.UsageError(f"{one.source} runs along {one.name}, the {kind} along {result.name}")
    names = tuple(result.columns if hasattr(result, "columns") else result.to_columns())
    chosen = measured[0].quantity(names) if y is None else y
    for one in measured:
        one.column(chosen)
    return str(chosen)
