"""``stability simulate MODEL``: one motion in time, from given initial values.

Without ``-o`` the largest and smallest values are printed; nothing is written.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._arguments import SETTING, check_outputs, replacing, settings
from ._console import Console, as_json_option
from ._motions import ACCELERATION, RANGE, excited

if TYPE_CHECKING:
    from ..results.trajectory import Trajectory

FORMATS = (".png", ".svg", ".pdf", ".npz", ".csv")
_MOST_EVENTS = 12


@click.command("simulate")
@click.argument("model")
@click.option("--set", "pairs", type=SETTING, multiple=True, help="A parameter or an option of the model; repeatable.")
@click.option("--x0", "start", type=SETTING, multiple=True, help="Initial value of a state, as u=0.1; repeatable.")
@click.option("--time", "span", type=RANGE, help="Time interval, as 0:10.")
@click.option("--periods", type=click.FloatRange(0, min_open=True), help="Length in forcing periods, from t = 0.")
@click.option("--acceleration", type=ACCELERATION, help="Constant base acceleration, as 0.5g or 4.9 (m/s^2).")
@click.option("--amplitude", type=click.FloatRange(0), help="Constant base amplitude (m).")
@click.option("--rtol", type=click.FloatRange(1e-14, 1e-2), default=1e-9, show_default=True, help="Relative tolerance.")
@click.option("--method", type=click.Choice(["DOP853", "Radau", "BDF", "LSODA"]), default="DOP853", show_default=True,
              help="The last three are for stiff systems.")
@click.option("--kind", type=click.Choice(["time", "phase", "spectrum", "poincare"]), default="time",
              show_default=True, help="What the picture shows.")
@click.option("--name", help="State or output that is drawn; the first state by default.")
@click.option("-o", "--output", "outputs", type=click.Path(path_type=Path), multiple=True,
              help="File to write: .png .svg .pdf, or data as .npz .csv; repeatable.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@as_json_option
@click.pass_obj
def command(
    console: Console, model: str, pairs: tuple[tuple[str, Any], ...], start: tuple[tuple[str, Any], ...],
    span: tuple[float, float] | None, periods: float | None, acceleration: float | None, amplitude: float | None,
    rtol: float, method: str, kind: str, name: str | None, outputs: tuple[Path, ...], force: bool,
) -> None:  # fmt: skip
    """Motion of MODEL in time.

    \b
    stability simulate duffing.from_physical --periods 50 --acceleration 0.5g -o motion.png
    stability simulate base_driven_pendulum --x0 phi=0.01 --time 0:80 --kind phase -o phase.png -o motion.csv
    """
    chosen, initial = settings(pairs), settings(start)
    check_outputs(outputs, FORMATS, force)
    if (span is None) == (periods is None):
        raise click.UsageError("give either --time 0:10 or --periods 50")
    with console.working(f"simulating {model}"):
        from .. import simulate
        from ..errors import InputError, check_names
        from ._models import system_from

        system = excited(system_from(model, chosen), acceleration, amplitude)
        if name is not None:
            check_names("state or output", [name], [*system.states, *system.outputs], f"'{system.name}'")
        if periods is not None:
            if system.period is None:
                raise InputError(f"'{system.name}' is autonomous: give --time 0:10 in place of --periods")
            span = (0.0, periods * system.period)
        began = time.perf_counter()
        run: Trajectory = simulate(system, span, x0=initial, rtol=rtol, method=method)
        seconds = time.perf_counter() - began
    for path in outputs:
        with console.working(f"writing {path}"), replacing(path) as temporary:
            _write(run, temporary, kind, name)
    document = _document(run, model, chosen, initial, seconds, outputs)
    _report(console, document, run)
    console.result(document)


def _write(run: Trajectory, path: Path, kind: str, name: str | None) -> None:
    ending = path.suffix.lower()
    if ending == ".npz":
        run.save(path)
    elif ending == ".csv":
        run.to_csv(path)
    else:
        from ._pictures import write_picture

        choice = {"x": name} if kind in ("phase", "poincare") and name else {"name": name}
        write_picture(path, lambda axes: run.plot(kind, ax=axes, **choice))


def _document(
    run: Trajectory, model: str, chosen: dict[str, Any], initial: dict[str, Any], seconds: float,
    outputs: tuple[Path, ...],
) -> dict[str, Any]:  # fmt: skip
    return {
        "model": model,
        "set": chosen,
        "x0": initial,
        "time": list(run.span),
        "status": str(run.status),
        "steps": run.steps,
        "seconds": seconds,
        "values": {name: {"min": run.min[name], "max": run.max[name]} for name in run.names},
        "final": dict(zip(run.states, run.final.tolist())),
        "events": [{"t": e.t, "kind": e.kind, "name": e.name} for e in run.events],
        "settled": bool(run.settled) if run.period is not None else None,
        "written": [str(path) for path in outputs],
    }


def _unit(run: Trajectory, name: str) -> str:
    unit = run.units.get(name, "")
    return f" {unit}" if unit and unit != "1" else ""


def _report(console: Console, document: dict[str, Any], run: Trajectory) -> None:
    rows = [
        ("time", f"from {run.span[0]:g} to {run.span[1]:.8g}: {run.status}"),
        *((name, f"{v['min']:.8g} to {v['max']:.8g}{_unit(run, name)}") for name, v in document["values"].items()),
        ("steps", f"{run.steps}, computed in {document['seconds']:.2f} s"),
    ]
    if run.period is not None:
        left, multiple = run.transient
        after = "" if multiple == 1 else f", repeats after {multiple} periods"
        rows.append(("settled", f"{'yes' if run.settled else 'no'} (transient left about {left:.1e}{after})"))
    for event in run.events[:_MOST_EVENTS]:
        rows.append((f"{event.kind} {event.name}", f"at t = {event.t:.10g}"))
    if len(run.events) > _MOST_EVENTS:
        rows.append(("events", f"{len(run.events)} in all"))
    console.table(rows)
    for path in document["written"]:
        console.say(f"wrote {path}")
    if not document["written"]:
        console.say("add -o motion.png (svg, pdf, npz, csv) to keep it")
