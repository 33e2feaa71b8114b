"""``stability response MODEL``: one oscillator, several methods, one axes, and a table of how far they are apart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ._arguments import INTERVAL, SETTING, check_outputs, replacing, settings
from ._console import FAILURE, OK, Console, as_json_option
from .average import ORDER, RATIO

PICTURES = (".png", ".svg", ".pdf")
FORMATS = (*PICTURES, ".npz", ".csv")


@click.command("response")
@click.argument("model")
@click.option("--parameter", required=True, metavar="NAME", help="The parameter along which the response is followed.")
@click.option("--range", "window", type=INTERVAL, required=True, help="From where to where.")
@click.option("--method", "methods", default="averaging,hb3,hb9,collocation,sweep", show_default=True,
              help="Methods, separated by commas: averaging, averaging2, multiple-scales, hb9 (any number of "
              "harmonics), collocation, shooting, sweep, sweep-up, sweep-down.")
@click.option("--set", "pairs", type=SETTING, multiple=True, help="A parameter or an option of the model; repeatable.")
@click.option("--quantity", metavar="COLUMN", help="What is compared and drawn, such as u.amplitude(1) or u.max.")
@click.option("--resonance", type=RATIO, help="For averaging: excitation : response, such as 2:1.")
@click.option("--small", type=ORDER, multiple=True, help="For averaging: what is small, as name or name=order.")
@click.option("--born", is_flag=True, help="Also the branches that are born at branch points and period doublings.")
@click.option("--start", type=SETTING, multiple=True, help="State in which sweeps start, as theta=0.01; repeatable.")
@click.option("--step", type=float, help="Step of the sweeps; by default a hundredth of the range.")
@click.option("--data", type=click.Path(path_type=Path, exists=True, dir_okay=False),
              help="A measured response (text with named columns and units), laid over the methods.")
@click.option("-o", "--output", "outputs", type=click.Path(path_type=Path), multiple=True,
              help="File to write (.png .svg .pdf .npz .csv); repeatable.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@as_json_option
@click.pass_obj
def command(
    console: Console, model: str, parameter: str, window: tuple[float, float], methods: str,
    pairs: tuple[tuple[str, Any], ...], quantity: str | None, resonance: tuple[int, int] | None,
    small: tuple[tuple[str, int], ...], born: bool, start: tuple[tuple[str, Any], ...], step: float | None,
    data: Path | None, outputs: tuple[Path, ...], force: bool,
) -> int:  # fmt: skip
    """The response of MODEL by several methods, with folds and errors side by side.

    A method that fails is reported and does not touch the others; the exit code is then 1.

    \b
    stability response duffing --parameter Omega --range 0.3:3 --method averaging,hb3,hb9,collocation,sweep -o r.png
    stability response duffing.from_physical --parameter frequency --range 20:29 --data shaker.csv -o r.png
    stability response autoparametric_pendulum --parameter Omega --range 0.9:1.1 --resonance 2:1 --born
        --quantity theta.max --method averaging,averaging2,collocation -o r.npz
    """
    chosen, first = settings(pairs), settings(start)
    check_outputs(outputs, FORMATS, force)
    with console.working(f"responses of {model}") as tell:
        from .. import load_response, responses
        from ._models import system_from

        found = responses(
            system_from(model, chosen), parameter, window, [m.strip() for m in methods.split(",") if m.strip()],
            quantity=quantity, born=born, resonance=resonance, small=dict(small) or None, x0=first or None, step=step,
            measured=None if data is None else load_response(data),
            progress=lambda method: tell(f"responses of {model}: {method}"),
        )  # fmt: skip
    if not len(found):
        raise next(iter(found.failures.values()))
    for path in sorted(outputs, key=lambda path: path.suffix.lower() in PICTURES):
        with console.working(f"writing {path}"), replacing(path) as temporary:
            _write(found, temporary)
    console.say(found.table())
    for path in outputs:
        console.say(f"wrote {path}")
    console.result({
        "model": model, "set": chosen, "parameter": parameter, "range": list(window), "quantity": found.quantity,
        "reference": found.comparison.reference, "methods": found.rows(),
        "failures": {name: str(error) for name, error in found.failures.items()},
        "written": [str(path) for path in outputs],
    })  # fmt: skip
    return FAILURE if found.failures else OK


def _write(found: Any, path: Path) -> None:
    ending = path.suffix.lower()
    if ending == ".npz":
        found.save(path)
    elif ending == ".csv":
        found.to_csv(path)
    else:
        from ._pictures import write_picture

        write_picture(path, lambda axes: found.plot(ax=axes))
