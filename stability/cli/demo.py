"""``stability demo``: each lens of the library once, as figures and a table."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import click

from ._arguments import replacing
from ._console import Console, as_json_option
from .demos import SECTIONS


@click.command("demo")
@click.argument("sections", nargs=-1, metavar="[SECTION]...")
@click.option("--folder", type=click.Path(path_type=Path), default=Path("stability-demo"), show_default=True,
              help="Where the figures go; a folder that exists is left alone and a number is added to the name.")
@as_json_option
@click.pass_obj
def command(console: Console, sections: tuple[str, ...], folder: Path) -> None:
    """A guided tour: computes, prints a table and writes figures. SECTION picks some of it."""
    from ..errors import check_names

    check_names("section", sections, SECTIONS, "the demo")
    target = _free(folder)
    target.mkdir(parents=True)
    documents = []
    for name in sections or SECTIONS:
        section = import_module(f"{__package__}.demos.{name}")
        console.say(section.TITLE, bold=True)
        with console.working(name):
            data = section.compute()
        table = section.rows(data)
        console.table(table)
        picture = target / section.FIGURE
        with console.working(f"drawing {picture}"), replacing(picture) as temporary:
            section.draw(data, temporary)
        console.say(f"  wrote {picture}")
        console.say()
        documents.append({"section": name, "title": section.TITLE, "table": dict(table), "figure": str(picture)})
    console.result({"sections": documents})


def _free(folder: Path) -> Path:
    """`folder`, or the first of folder-2, folder-3, ... that does not exist: nothing is ever overwritten."""
    candidate, k = folder, 1
    while candidate.exists():
        k += 1
        candidate = folder.with_name(f"{folder.name}-{k}")
    return candidate
