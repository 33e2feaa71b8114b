"""``stability sweep MODEL``: the response along a slow sweep, as on a shaker.

The range's order is the direction. Without ``-o`` the jumps and the largest response are printed; nothing is written.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._arguments import SETTING, check_outputs, replacing, settings
from ._console import Console, as_json_option
from ._motions import ACCELERATION, RANGE, excited, swept_parameter

if TYPE_CHECKING:
    from ..results.sweep import Sweep

FORMATS = (".png", ".svg", ".pdf", ".npz", ".csv")


@click.command("sweep")
@click.argument("model")
@click.option("--range", "window", type=RANGE, required=True, help="Ends in the sweep's direction, as 5:40 or 40:5.")
@click.option("--parameter", help="Swept parameter; the excitation frequency by default.")
@click.option("--set", "pairs", type=SETTING, multiple=True, help="A parameter or an option of the model; repeatable.")
@click.option("--x0", "initial", type=SETTING, multiple=True, help="Initial value of a state, as u=0.1; repeatable.")
@click.option("--step", type=click.FloatRange(0, min_open=True), help="Step; a hundredth of the range by default.")
@click.option("--start", type=click.Choice(["carry", "rest"]), default="carry", show_default=True,
              help="Each value starts from the state before, or from rest.")
@click.option("--both", is_flag=True, help="Then back again.")
@click.option("--periods", type=click.IntRange(2), default=50, show_default=True, help="Periods per value.")
@click.option("--record", type=click.IntRange(1), default=5, show_default=True, help="Of these the last are recorded.")
@click.option("--acceleration", type=ACCELERATION, help="Constant base acceleration, as 0.5g or 4.9 (m/s^2).")
@click.option("--amplitude", type=click.FloatRange(0), help="Constant base amplitude (m).")
@click.option("--y", "measure", help="What the picture shows, as y.max, y_mm.pp, y.amplitude.")
@click.option("-o", "--output", "outputs", type=click.Path(path_type=Path), multiple=True,
              help="File to write: .png .svg .pdf, or data as .npz .csv; repeatable.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@as_json_option
@click.pass_obj
def command(
    console: Console, model: str, window: tuple[float, float], parameter: str | None,
    pairs: tuple[tuple[str, Any], ...], initial: tuple[tuple[str, Any], ...], step: float | None, start: str,
    both: bool, periods: int, record: int, acceleration: float | None, amplitude: float | None, measure: str | None,
    outputs: tuple[Path, ...], force: bool,
) -> None:  # fmt: skip
    """Response of MODEL along a sweep of one parameter.

    \b
    stability sweep duffing.from_physical --range 5:40 --step 0.5 --acceleration 0.5g --both -o sweep.png
    stability sweep duffing --set beta=0.001 --range 0.3:3 --y u.amplitude -o sweep.csv
    """
    chosen, x0 = settings(pairs), settings(initial)
    check_outputs(outputs, FORMATS, force)
    if both and any(path.suffix.lower() == ".npz" for path in outputs):
        raise click.UsageError("--both gives two sweeps: write .csv, or two .npz by two commands")
    with console.working(f"sweeping {model}") as say:
        from .. import sweep
        from ._models import system_from

        system = excited(system_from(model, chosen), acceleration, amplitude)
        name = swept_parameter(system, parameter)
        _check_measure(system, measure)
        began = time.perf_counter()
        runs: list[Sweep] = []
        for ends in (window, window[::-1])[: 1 + both]:
            way = f"{name} {ends[0]:g} to {ends[1]:g}"
            options: dict[str, Any] = dict(start=start, periods=periods, record=record, step=step, x0=x0)
            shown = partial(_progress, say, way)
            runs.append(sweep(system, name, ends, progress=shown, **options))
        seconds = time.perf_counter() - began
    for path in outputs:
        with console.working(f"writing {path}"), replacing(path) as temporary:
            _write(runs, temporary, measure)
    document = _document(runs, model, chosen, seconds, outputs)
    _report(console, document, runs)
    console.result(document)


def _progress(say: Callable[[str], Any], way: str, done: int, total: int) -> None:
    say(f"{way}: {done} of {total}")


def _check_measure(system: Any, measure: str | None) -> None:
    from ..errors import InputError, check_names

    if measure is None:
        return
    name, dot, what = measure.rpartition(".")
    check_names("state or output", [name if dot else measure], [*system.states, *system.outputs], f"'{system.name}'")
    known = ("max", "min", "pp", "mean", "amplitude", "phase", "section")
    if dot and what not in known:
        raise InputError(f"--y {measure}: the measure is one of {', '.join(known)}")


def _write(runs: list[Sweep], path: Path, measure: str | None) -> None:
    ending = path.suffix.lower()
    if ending == ".npz":
        runs[0].save(path)
    elif ending == ".csv":
        import numpy as np

        columns = [run.to_columns() for run in runs]
        rows = np.vstack([np.column_stack(list(c.values())) for c in columns])
        np.savetxt(path, rows, delimiter=",", header=",".join(columns[0]), comments="")
    else:
        from ._pictures import write_picture

        def draw(axes: Any) -> None:
            for run in runs:
                way = "up" if run.window[1] > run.window[0] else "down"
                run.plot(ax=axes, y=measure, label=f"sweep {way}")
            if len(runs) > 1:
                axes.legend(frameon=False)

        write_picture(path, draw)


def _document(
    runs: list[Sweep], model: str, chosen: dict[str, Any], seconds: float, outputs: tuple[Path, ...]
) -> dict[str, Any]:
    sweeps = []
    for run in runs:
        name = run.states[0]
        top = int(run.maximum[name].argmax())
        sweeps.append({
            "from": run.window[0],
            "to": run.window[1],
            "points": len(run),
            "settled": int(run.settled.sum()),
            "status": str(run.status),
            "largest": {"state": name, "max": float(run.maximum[name][top]), "at": float(run.parameter[top])},
            "jumps": [
                dict(at=j.parameter, bracket=list(j.bracket), before=list(j.before[name]), after=list(j.after[name]))
                for j in run.jumps
            ],
        })  # fmt: skip
    return {
        "model": model,
        "set": chosen,
        "parameter": runs[0].name,
        "start": runs[0].start,
        "periods": runs[0].periods,
        "record": runs[0].record,
        "sweeps": sweeps,
        "seconds": seconds,
        "written": [str(path) for path in outputs],
    }


def _report(console: Console, document: dict[str, Any], runs: list[Sweep]) -> None:
    rows = []
    for one, run in zip(document["sweeps"], runs):
        way = f"{run.name} {run.window[0]:g} to {run.window[1]:g}"
        known = [run.units.get(name, "") for name in (run.states[0], run.name)]
        units = [f" {unit}" if unit not in ("", "1") else "" for unit in known]
        rows.append((way, f"{one['points']} points, {one['settled']} settled, {one['status']}"))
        largest = one["largest"]
        top = f"max {largest['state']} = {largest['max']:.6g}{units[0]}"
        rows.append(("largest", f"{top} at {largest['at']:.8g}{units[1]}"))
        for jump in run.jumps:
            before, after = (side[run.states[0]][1] for side in (jump.before, jump.after))
            place = f"at {jump.parameter:.8g}{units[1]}"
            rows.append(("jump", f"{place}: max {run.states[0]} {before:.6g} -> {after:.6g}{units[0]}"))
    rows.append(("time", f"{document['seconds']:.2f} s"))
    console.table(rows)
    for path in document["written"]:
        console.say(f"wrote {path}")
    if not document["written"]:
        console.say("add -o sweep.png (svg, pdf, npz, csv) to keep it")
