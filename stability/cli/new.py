"""``stability new FILE.toml``: a commented template of a model as text, ready to be charted and edited."""

from __future__ import annotations

import re
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
    from ..systems.textfile import template

    text = template(_model_name(file.stem))
    with replacing(file) as temporary:
        temporary.write_text(text, encoding="utf-8")
    console.say(f"wrote {file}: a Duffing oscillator, each key explained; edit it, and")
    console.table([
        (f"stability models {file}", "shows the equations that come out of it"),
        (f"stability continue {file} --parameter Omega --range 0.3:2 -o response.png", "follows its response"),
    ])
    console.result({"written": str(file)})


def _model_name(stem: str) -> str:
    """The file's name as a name of a model: letters, digits and single underscores, a letter first."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", stem).strip("_")
    return name if name[:1].isalpha() else f"model_{name}".rstrip("_")
