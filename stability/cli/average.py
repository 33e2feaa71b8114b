"""``stability average MODEL``: the slow flow of an oscillator by averaging or multiple scales, as text or LaTeX."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import click

from ._arguments import SETTING, settings
from ._console import Console, as_json_option

if TYPE_CHECKING:
    from ..systems.system import System


class _Ratio(click.ParamType):
    """``2:1`` -> (2, 1)."""

    name = "p:q"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        parts = value.split(":")
        if len(parts) != 2 or not all(p.isascii() and p.isdigit() and 0 < int(p[:6]) < 1000 for p in parts):
            self.fail(f"'{value}' is not p:q, excitation to response, for example 2:1", param, ctx)
        return int(parts[0]), int(parts[1])


class _Order(click.ParamType):
    """``beta`` or ``length_ratio=-2`` -> (name, order)."""

    name = "name[=order]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, int]:
        if isinstance(value, tuple):
            return value
        name, equals, text = value.partition("=")
        try:
            order = int(text) if equals else 1
        except ValueError:
            self.fail(f"'{value}': the order must be an integer, for example {name}=1", param, ctx)
        if not name:
            self.fail(f"'{value}' is not name or name=order", param, ctx)
        return name, order


RATIO, ORDER = _Ratio(), _Order()


@click.command("average")
@click.argument("model")
@click.option("--set", "pairs", type=SETTING, multiple=True, help="A parameter or an option of the model; repeatable.")
@click.option("--resonance", type=RATIO, help="Excitation : response of the slowest coordinate, such as 2:1.")
@click.option("--order", type=click.IntRange(1, 2), default=1, show_default=True, help="Order of the small parameter.")
@click.option("--variables", type=click.Choice(["cartesian", "polar"]), help="Slow states; by default cartesian.")
@click.option("--small", type=ORDER, multiple=True, help="What is small, as name or name=order; repeatable.")
@click.option("--method", type=click.Choice(["averaging", "multiple-scales"]), default="averaging", show_default=True)
@click.option("--latex", is_flag=True, help="Equations in LaTeX.")
@as_json_option
@click.pass_obj
def command(
    console: Console, model: str, pairs: tuple[tuple[str, Any], ...], resonance: tuple[int, int] | None, order: int,
    variables: str | None, small: tuple[tuple[str, int], ...], method: str, latex: bool,
) -> None:  # fmt: skip
    """The slow flow of MODEL: its equilibria are the periodic responses, its Hopf points the torus bifurcations.

    \b
    stability average duffing
    stability average autoparametric_pendulum --resonance 2:1 --latex
    stability average duffing.from_physical --small damping --small cubic --small acceleration --order 2
    """
    chosen = settings(pairs)
    with console.working(f"averaging {model}"):
        from .. import averaging, multiple_scales
        from ._models import system_from

        system = system_from(model, chosen)
        verb = averaging if method == "averaging" else multiple_scales
        start = time.perf_counter()
        slow = verb(system, order=order, resonance=resonance, variables=variables, small=dict(small) or None)
        seconds = time.perf_counter() - start
    if latex:
        console.say(slow.latex())
    else:
        _report(console, slow)
    console.result(_document(slow, model, chosen, method, seconds))


def _report(console: Console, slow: System) -> None:
    console.say(slow.name, bold=True)
    console.table([(f"{s}'", f"= {e}") for s, e in zip(slow.states, slow.rhs or ())])
    console.table([(name, f"= {e}") for name, e in slow.outputs.items()])
    console.say("in the original coordinates, with amplitudes of the fundamental harmonic")
    console.table([(name, f"= {e}") for name, e in slow.reconstruction.items() if not name.endswith("_dot")])


def _document(slow: System, model: str, chosen: dict[str, Any], method: str, seconds: float) -> dict[str, Any]:
    return {
        "model": model,
        "set": chosen,
        "method": method,
        "name": slow.name,
        "equations": {s: str(e) for s, e in zip(slow.states, slow.rhs or ())},
        "outputs": {k: str(e) for k, e in slow.outputs.items()},
        "reconstruction": {k: str(e) for k, e in slow.reconstruction.items()},
        "latex": slow.latex(),
        "seconds": seconds,
    }
