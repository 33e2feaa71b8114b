"""``stability chart MODEL``: the stability chart of a system over two of its parameters.

Growth rate: the largest real part of the Floquet exponents per unit time, positive where the solution is unstable.
Without ``-o`` the chart is sketched on the terminal; nothing is written.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._arguments import SETTING, SHAPE, SPAN, check_outputs, replacing, settings
from ._console import Console, as_json_option

if TYPE_CHECKING:
    from ..results.chart import StabilityChart

PICTURES = (".png", ".svg", ".pdf")
_LEAVES = {"+1": "mu = +1", "-1": "mu = -1", "pair": "complex pair"}
FORMATS = (*PICTURES, ".npz", ".csv")

# axes that show the tongues of models that are usually asked for without any
AXES: dict[str, tuple[tuple[str, float, float], tuple[str, float, float]]] = {
    "mathieu": (("a", -0.5, 2.5), ("b", 0.0, 2.0)),
    "mathieu_canonical": (("a", -2.0, 10.0), ("q", 0.0, 6.0)),
    "meissner": (("a", -0.5, 3.0), ("b", 0.0, 3.0)),
    "hill": (("a", -0.5, 2.5), ("b", 0.0, 2.0)),
    "paul_trap": (("a", -0.4, 0.4), ("q", 0.0, 1.2)),
}


@click.command("chart")
@click.argument("model")
@click.option("--set", "pairs", type=SETTING, multiple=True, help="A parameter or an option of the model; repeatable.")
@click.option("--x", type=SPAN, help="Parameter along x, and its interval.")
@click.option("--y", type=SPAN, help="Parameter along y, and its interval.")
@click.option("--shape", type=SHAPE, default="1000x1000", show_default=True, help="Points along x and along y.")
@click.option("--about", metavar="SOLUTION", help="'linear' (the linear response), or an equilibrium as theta=0,u=0.")
@click.option("--kind", type=click.Choice(["growth_rate", "class"]), default="growth_rate", show_default=True,
              help="What the picture shows.")
@click.option("--tolerance", type=click.FloatRange(1e-13, 1e-2), default=1e-10, show_default=True,
              help="Of the growth rate.")
@click.option("-o", "--output", "outputs", type=click.Path(path_type=Path), multiple=True,
              help="File to write: .png .svg .pdf, or data as .npz .csv; repeatable.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@as_json_option
@click.pass_obj
def command(
    console: Console, model: str, pairs: tuple[tuple[str, Any], ...], x: tuple[str, float, float] | None,
    y: tuple[str, float, float] | None, shape: tuple[int, int], about: str | None, kind: str, tolerance: float,
    outputs: tuple[Path, ...], force: bool,
) -> None:  # fmt: skip
    """Stability chart (instability tongues) of MODEL over two parameters.

    \b
    stability chart mathieu --set delta=0.05 --x a:-0.5:2.5 --y b:0:2 -o tongues.png
    stability chart base_driven_pendulum.from_physical --set length=0.1081 \\
        --x frequency:1:5 --y amplitude:0:0.1 --about theta=0 -o pendulum.pdf -o pendulum.npz
    """
    chosen = settings(pairs)
    check_outputs(outputs, FORMATS, force)
    x, y = _axes(model, x, y)
    with console.working(f"charting {model}"):
        from .. import chart
        from ._models import system_from

        system = system_from(model, chosen)
        start = time.perf_counter()
        computed = chart(system, x=x, y=y, shape=shape, about=_about(about), tolerance=tolerance)
        painted = time.perf_counter() - start
        traced = len(computed.boundaries), time.perf_counter() - start - painted
    for path in outputs:
        with console.working(f"writing {path}"), replacing(path) as temporary:
            _write(computed, temporary, kind)
    document = _document(computed, model, chosen, x, y, painted, traced, outputs)
    _report(console, document, computed, bool(outputs))
    console.result(document)


def _axes(model: str, x: Any, y: Any) -> tuple[tuple[str, float, float], tuple[str, float, float]]:
    usual = AXES.get(model)
    if usual is not None:
        return x or usual[0], y or usual[1]
    missing = [name for name, value in (("--x", x), ("--y", y)) if value is None]
    if missing:
        names = f"`stability models {model}` lists the parameters"
        raise click.UsageError(f"missing {' and '.join(missing)} as name:lo:hi ({names})")
    return x, y


def _about(text: str | None) -> Any:
    """``theta=3.14,u=0`` -> the equilibrium by names; a word is passed on."""
    if text is None or "=" not in text:
        return text
    return settings([SETTING.convert(piece, None, None) for piece in text.split(",")])


def _write(computed: StabilityChart, path: Path, kind: str) -> None:
    ending = path.suffix.lower()
    if ending == ".npz":
        computed.save(path)
    elif ending == ".csv":
        computed.to_csv(path)
    else:
        from ._pictures import write_picture

        write_picture(path, lambda axes: computed.plot(kind, ax=axes))


def _document(
    computed: StabilityChart, model: str, chosen: dict[str, Any], x: Any, y: Any, painted: float,
    traced: tuple[int, float], outputs: tuple[Path, ...],
) -> dict[str, Any]:  # fmt: skip
    import numpy as np

    counts = computed.verdict.counts()
    shares = {str(word): count / computed.verdict.size for word, count in counts.items() if count}
    return {
        "model": model,
        "set": chosen,
        "x": {"parameter": x[0], "from": x[1], "to": x[2]},
        "y": {"parameter": y[0], "from": y[1], "to": y[2]},
        "shape": list(computed.growth_rate.shape[::-1]),
        "shares": shares,
        "largest_growth_rate": float(np.nanmax(computed.growth_rate)),
        "error": float(np.nanmax(computed.error)),
        "tips": [{"order": tip.order, "kind": tip.kind, x[0]: tip.x, y[0]: tip.y} for tip in computed.tips],
        "boundaries": traced[0],
        "seconds": {"points": painted, "boundaries": traced[1]},
        "written": [str(path) for path in outputs],
    }


def _report(console: Console, document: dict[str, Any], computed: StabilityChart, written: bool) -> None:
    x, y = document["x"], document["y"]
    if not written and console.is_terminal():
        from ._sketch import sketch

        console.say(sketch(computed.growth_rate, x, y, columns=min(console.width() - 12, 96)))
    nx, ny = document["shape"]
    rows = [
        ("points", f"{nx} x {ny} in {document['seconds']['points']:.2f} s"),
        ("boundaries", f"{document['boundaries']} curves in {document['seconds']['boundaries']:.2f} s"),
        ("growth rate", f"at most {document['largest_growth_rate']:.6g}, error <= {document['error']:.1e}"),
        *((word, f"{share:.2%} of the points") for word, share in document["shares"].items()),
    ]
    for tip in document["tips"]:
        name = "tongue" if tip["order"] is None else f"tongue {tip['order']}"
        place = ", ".join(f"{axis['parameter']} = {tip[axis['parameter']]:.10g}" for axis in (x, y))
        rows.append((f"{name} opens ({_LEAVES[tip['kind']]})", f"at {place}"))
    console.table(rows)
    for path in document["written"]:
        console.say(f"wrote {path}")
    if not written:
        console.say("add -o chart.png (svg, pdf, npz, csv) to keep it")
