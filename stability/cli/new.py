"""``stability new FILE.toml``: a commented template of a model as text, ready to be charted and edited."""

from __future__ import annotations

from pathlib import Path

import click

from ._arguments import check_outputs, replacing
from ._console import Console, as_json_option


@click.command("new")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
@as_json_option
@click.pass_obj
def command(console: Console, file: Path, force: bool) -> None:
    """Write a commented template of a model as text to FILE (.toml)."""
    check_outputs([file], [".toml"], force)
    with replacing(file) as temporary:
        temporary.write_text(template(file.stem), encoding="utf-8")
    console.say(f"wrote {file}: a pendulum on a spring that is shaken; edit it, then")
    console.table([
        (f"stability models {file}", "shows the equations of motion that come out of it"),
        (f"stability chart {file} --x Omega:0.5:1.5 --y F:0:0.1 --about linear", "draws its instability tongues"),
    ])
    console.result({"written": str(file)})


def template(name: str) -> str:
    """The template's text, with the model's name filled in."""
    from ..systems.textfile import template as text

    return text(name)
