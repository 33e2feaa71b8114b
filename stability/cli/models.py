"""``stability models [NAME]``: the catalogue as a list, or one model with its equation, states and parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ._console import Console, as_json_option

if TYPE_CHECKING:
    from ..models._model import Model
    from ..systems.system import System


@click.command("models")
@click.argument("name", required=False)
@as_json_option
@click.pass_obj
def command(console: Console, name: str | None) -> None:
    """List the catalogue, or describe the model NAME (a catalogue name, a text file or file.py:function)."""
    if name is None:
        _list(console)
    else:
        _describe(console, name)


def _list(console: Console) -> None:
    from ..models import catalogue

    entries = catalogue()
    groups: dict[str, list[Model]] = {}
    for entry in entries.values():
        groups.setdefault(getattr(entry, "group", "") or "models", []).append(entry)
    for group, members in groups.items():
        console.say(group, bold=True)
        console.table([row for e in members for row in ((e.name, e.summary), ("", e.equation))])
        console.say()
    console.say(f"{len(entries)} models; `stability models NAME` describes one.")
    console.result({"models": [_card(entry) for entry in entries.values()]})


def _card(entry: Model) -> dict[str, Any]:
    return {
        "name": entry.name,
        "summary": entry.summary,
        "equation": entry.equation,
        "source": entry.source,
        "figure": entry.figure,
        "constructors": list(entry.constructors),
    }


def _describe(console: Console, name: str) -> None:
    from ..models import catalogue
    from ._models import system_from

    entry = catalogue().get(name)
    system = system_from(name, {})
    card = _card(entry) if entry is not None else {"name": system.name}
    if entry is not None:
        console.say(f"{entry.name}: {entry.summary}", bold=True)
        console.table([("equation", entry.equation), ("source", entry.source), *_optional("figure", entry.figure)])
        for constructor in entry.constructors:
            console.table([("also", f"{name}.{constructor}")])
        console.say()
    console.say(repr(system))
    console.result({**card, **_facts(system)})


def _optional(label: str, text: str) -> list[tuple[str, str]]:
    return [(label, text)] if text else []


def _facts(system: System) -> dict[str, Any]:
    return {
        "states": list(system.states),
        "parameters": dict(system.parameters),
        "units": dict(system.units),
        "period": system.period,
        "equations": {} if system.rhs is None else dict(zip((f"d{s}/dt" for s in system.states), map(str, system.rhs))),
    }
