"""``stability continue MODEL``: follow a branch of solutions along a parameter, with its special points.

A forced system is followed by its periodic orbits (Gauss collocation), an autonomous one by its equilibria. Where a
branch ends for lack of convergence the exit code is 1; what was computed is written all the same.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..words import Status
from ._arguments import INTERVAL, SETTING, check_outputs, replacing, settings
from ._console import FAILURE, OK, Console, as_json_option

if TYPE_CHECKING:
    from ..results.branch import Branch

PICTURES = (".png", ".svg", ".pdf")
FORMATS = (*PICTURES, ".npz", ".csv")
METHODS = ("auto", "collocation", "shooting", "harmonic-balance", "equilibrium")


@click.command("continue")
@click.argument("model")
@click.option("--parameter", required=True, metavar="NAME", help="The parameter that is continued.")
@click.option("--range", "window", type=INTERVAL, required=True, help="From where to where; may run downward.")
@click.option("--set", "pairs", type=SETTING, multiple=True, help="A parameter or an option of the model; repeatable.")
@click.option("--start", type=SETTING, multiple=True, help="State of a first solution, as x=6; repeatable.")
@click.option("--method", type=click.Choice(METHODS), default="auto", show_default=True, help="What is solved.")
@click.option("--multiple", type=click.IntRange(1), default=1, metavar="K", help="Orbits of K forcing periods.")
@click.option("--winding", "turns", type=SETTING, multiple=True, metavar="ANGLE=TURNS",
              help="Rotations: whole turns of an angle per orbit, as theta=1; repeatable.")
@click.option("--symmetric", is_flag=True,
              help="Symmetric orbits, on half of their period where the equations allow it (collocation).")
@click.option("--harmonics", type=click.IntRange(1), metavar="H",
              help="Of harmonic balance; by default as many as the motion needs.")
@click.option("--switch", "labels", multiple=True, metavar="LABEL",
              help="Go on from this point (PD1, BP1, HB1) to the branch that is born there; repeatable.")
@click.option("--locus", "curve", metavar="LABEL", help="Then follow this point (PD1, LP1, NS1) in a second parameter.")
@click.option("--free", metavar="NAME", help="The second parameter, for --locus.")
@click.option("--max-points", type=click.IntRange(2), default=2000, show_default=True, help="At most so many points.")
@click.option("--ds-max", type=click.FloatRange(0, min_open=True), metavar="LENGTH",
              help="Longest step; the whole range has the length 1 (0.2 by default).")
@click.option("--y", metavar="COLUMN", help="What a picture shows, such as u.max.")
@click.option("-o", "--output", "outputs", type=click.Path(path_type=Path), multiple=True,
              help="File to write: .png .svg .pdf with all branches, .npz .csv with the last; repeatable.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@as_json_option
@click.pass_obj
def command(
    console: Console, model: str, parameter: str, window: tuple[float, float], pairs: tuple[tuple[str, Any], ...],
    start: tuple[tuple[str, Any], ...], method: str, multiple: int, turns: tuple[tuple[str, Any], ...],
    symmetric: bool, harmonics: int | None, labels: tuple[str, ...], curve: str | None, free: str | None,
    max_points: int, ds_max: float | None, y: str | None, outputs: tuple[Path, ...], force: bool,
) -> int:  # fmt: skip
    """Follow a branch of MODEL along a parameter, with its stability and special points.

    \b
    stability continue duffing --set beta=0.001 --parameter Omega --range 0.3:3 -o branch.png -o branch.npz
    stability continue autoparametric_pendulum --parameter Omega --range 0.5:1.5 --switch PD1 -o swing.npz
    stability continue autoparametric_pendulum --parameter Omega --range 0.9:1.1 --locus PD1 --free length_ratio
    stability continue duffing --parameter Omega --range 0.3:3 --method harmonic-balance --harmonics 9 --ds-max 0.05
    """
    if (curve is None) != (free is None):
        raise click.UsageError("--locus LABEL and --free NAME belong together: which point, and the second parameter")
    chosen, first = settings(pairs), settings(start, "--start")
    orbit = {"multiple": multiple, "winding": settings(turns, "--winding"), "harmonics": harmonics}
    orbit["symmetry"] = "auto" if symmetric else None
    steps = {"max_points": max_points, "ds_max": ds_max}
    check_outputs(outputs, FORMATS, force)
    begun = time.perf_counter()
    with console.working(f"following {model}") as tell:
        branches = _follow(model, chosen, (method, orbit), parameter, window, first, labels, (curve, free), steps, tell)
    seconds = time.perf_counter() - begun
    for path in sorted(outputs, key=lambda path: path.suffix.lower() in PICTURES):  # data first: --y may be misspelt
        with console.working(f"writing {path}"), replacing(path) as temporary:
            _write(branches if free is None else branches[-1:], temporary, y or free)
    document = {
        "model": model, "set": chosen, "parameter": parameter, "range": list(window), "seconds": seconds,
        "branches": [_facts(branch) for branch in branches], "written": [str(path) for path in outputs],
    }  # fmt: skip
    _report(console, branches, seconds, outputs)
    console.result(document)
    broken = (Status.DIVERGED, Status.STEP_TOO_SMALL)
    return FAILURE if any(status in broken for branch in branches for status in branch.statuses) else OK


def _follow(
    model: str, chosen: dict[str, Any], how: tuple[str, dict[str, Any]], parameter: str, window: tuple[float, float],
    first: dict[str, Any], labels: Sequence[str], curve: tuple[str | None, str | None], steps: dict[str, Any],
    tell: Any,
) -> list[Branch]:  # fmt: skip
    """The branch, those that are born at the labelled points, one from the other, and a curve of special points."""
    from .. import continuation, locus, switch
    from ._models import system_from

    def progress(at: Any) -> None:
        tell(f"following {model}: {at.points} points, {parameter} = {at.parameter:.6g}, {at.special} special")

    system = system_from(model, chosen)
    options: dict[str, Any] = {**steps, "progress": progress}
    branches = [continuation(_problem(system, *how), parameter, window, start=first or None, **options)]
    for label in labels:
        branches.append(continuation(switch(branches[-1][label]), parameter, window, **options))
    point, free = curve
    if point is not None and free is not None:
        branches.append(continuation(locus(branches[-1][point], free=free), parameter, window, **options))
    return branches


def _problem(system: Any, method: str, orbit: dict[str, Any]) -> Any:
    """The problem that a method makes of a system, with the options that it knows."""
    from .. import Collocation, Equilibrium, HarmonicBalance, Shooting

    if method == "auto":
        method = "equilibrium" if system.period is None else "collocation"
    multiple, winding, harmonics = orbit["multiple"], orbit["winding"] or None, orbit["harmonics"]
    if harmonics is not None and method != "harmonic-balance":
        raise click.UsageError("--harmonics belongs to --method harmonic-balance")
    if orbit["symmetry"] is not None and method != "collocation":
        raise click.UsageError("--symmetric belongs to --method collocation")
    if method == "equilibrium":
        if multiple != 1 or winding is not None:
            raise click.UsageError("--multiple and --winding are of periodic orbits: add --method collocation")
        return Equilibrium(system)
    if method == "harmonic-balance":
        return HarmonicBalance(system, harmonics=harmonics, subharmonic=multiple, winding=winding)
    if method == "shooting":
        return Shooting(system, multiple=multiple, winding=winding)
    return Collocation(system, multiple=multiple, winding=winding, symmetry=orbit["symmetry"])


def _write(branches: list[Branch], path: Path, y: str | None) -> None:
    ending = path.suffix.lower()
    if ending == ".npz":
        branches[-1].save(path)
    elif ending == ".csv":
        branches[-1].to_csv(path)
    else:
        from ..plots.style import SERIES
        from ._pictures import write_picture

        write_picture(path, lambda axes: [b.plot(axes, y=y, color=c) for b, c in zip(branches, SERIES * len(branches))])


def _facts(branch: Branch) -> dict[str, Any]:
    return {
        "points": len(branch),
        "status": str(branch.status),
        "message": branch.message,
        "largest_residual": float(max(branch.residuals)),
        "verdicts": {str(v): sum(w is v for w in branch.verdicts) for v in sorted(set(branch.verdicts))},
        "special": [
            {
                "label": point.label,
                "name": point.name,
                "kind": str(point.kind),
                branch.name: point.params[branch.name],
                "params": dict(point.params),
                "criticality": None if point.criticality is None else str(point.criticality),
                "symmetry_breaking": point.symmetry_breaking,
            }
            for point in branch.special
        ],
    }


def _report(console: Console, branches: list[Branch], seconds: float, outputs: tuple[Path, ...]) -> None:
    for branch in branches:
        console.say(repr(branch), bold=True)
        rows = []
        rounding = 1e-13 * abs(branch.window[1] - branch.window[0])
        for point in branch.special:
            what = f"{point.kind}, {point.criticality}" if point.criticality else str(point.kind)
            what += ", symmetry breaking" if point.symmetry_breaking else ""
            what += f" ({point.name})" if point.name else ""
            value = point.params[branch.name]
            value = 0.0 if abs(value) < rounding else value
            rows.append((point.label, f"{branch.name} = {value:.10g}", what))
        console.table(rows)
        if branch.message:
            console.say(f"  {branch.status} at {branch.name} = {branch.parameter[-1]:.10g}: {branch.message}")
    console.say(f"  {seconds:.2f} s")
    for path in outputs:
        console.say(f"wrote {path}")
    if not outputs:
        console.say("add -o branch.npz (csv, png, svg, pdf) to keep it")
