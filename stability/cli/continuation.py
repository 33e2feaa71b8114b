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
@click.option("--parameter", metavar="NAME", help="The parameter that is continued (known to a saved branch).")
@click.option("--range", "window", type=INTERVAL,
              help="From where to where; may run downward (by default that of a saved branch).")
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
@click.option("--free-range", "walls", type=INTERVAL, help="Where the curve ends in the second parameter.")
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
    console: Console, model: str, parameter: str | None, window: tuple[float, float] | None,
    pairs: tuple[tuple[str, Any], ...], start: tuple[tuple[str, Any], ...], method: str, multiple: int,
    turns: tuple[tuple[str, Any], ...], symmetric: bool, harmonics: int | None, labels: tuple[str, ...],
    curve: str | None, free: str | None, walls: tuple[float, float] | None, max_points: int, ds_max: float | None,
    y: str | None, outputs: tuple[Path, ...], force: bool,
) -> int:  # fmt: skip
    """Follow a branch of MODEL along a parameter, with its stability and special points.

    MODEL may be a saved branch (branch.npz): then --switch or --locus goes on from its points.

    \b
    stability continue duffing --set beta=0.001 --parameter Omega --range 0.3:3 -o branch.png -o branch.npz
    stability continue autoparametric_pendulum --parameter Omega --range 0.5:1.5 --switch PD1 -o swing.npz
    stability continue autoparametric_pendulum --parameter Omega --range 0.9:1.1 --locus PD1 --free length_ratio
    stability continue semi.npz --locus PD1 --free acceleration --free-range 0.0001:0.1 --range 0.8:1.2 -o tongue.png
    stability continue duffing --parameter Omega --range 0.3:3 --method harmonic-balance --harmonics 9 --ds-max 0.05
    """
    from .. import continuation
    from ._models import system_from

    if (curve is None) != (free is None):
        raise click.UsageError("--locus LABEL and --free NAME belong together: which point, and the second parameter")
    if walls is not None and free is None:
        raise click.UsageError("--free-range is the window of --free NAME")
    chosen, first = settings(pairs), settings(start, "--start")
    saved = _saved(model, labels, curve, bool(chosen or first or turns or harmonics or symmetric) or multiple != 1)
    if saved is None and (parameter is None or window is None):
        raise click.UsageError("--parameter NAME and --range FROM:TO are needed: along what, from where to where")
    if saved is not None:
        if parameter not in (None, saved.name):
            raise click.UsageError(f"{model} was continued in '{saved.name}': its points go on in that parameter")
        parameter, window = saved.name, window or saved.window
    assert parameter is not None and window is not None
    orbit = {"multiple": multiple, "winding": settings(turns, "--winding"), "harmonics": harmonics}
    orbit["symmetry"] = "auto" if symmetric else None
    steps = {"max_points": max_points, "ds_max": ds_max}
    check_outputs(outputs, FORMATS, force)
    begun = time.perf_counter()
    with console.working(f"following {model}") as tell:
        options = {**steps, "progress": _teller(tell, model, parameter)}
        if saved is not None:
            branches = [saved]
        else:
            problem = _problem(system_from(model, chosen), method, orbit)
            branches = [continuation(problem, parameter, window, start=first or None, **options)]
        branches = _follow(branches, parameter, window, labels, (curve, free, walls), options)
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


def _saved(model: str, labels: Sequence[str], curve: str | None, others: bool) -> Branch | None:
    """The branch that MODEL names a file of; None where it is a model."""
    if Path(model).suffix.lower() != ".npz":
        return None
    from .. import load
    from ..results.branch import Branch

    if others:
        raise click.UsageError("a saved branch has its own model and method: give --switch, --locus and steps only")
    if not labels and curve is None:
        raise click.UsageError(f"{model} is a saved branch: where to go on? --switch LABEL, or --locus and --free")
    branch = load(model)
    if not isinstance(branch, Branch):
        raise click.UsageError(f"{model} holds a {type(branch).__name__}, not a branch")
    return branch


def _teller(tell: Any, model: str, parameter: str) -> Any:
    def progress(at: Any) -> None:
        tell(f"following {model}: {at.points} points, {parameter} = {at.parameter:.6g}, {at.special} special")

    return progress


def _follow(
    branches: list[Branch], parameter: str, window: tuple[float, float], labels: Sequence[str],
    curve: tuple[str | None, str | None, tuple[float, float] | None], options: dict[str, Any],
) -> list[Branch]:  # fmt: skip
    """The branches that are born at the labelled points, one from the other, and a curve of special points."""
    from .. import continuation, locus, switch

    branches = list(branches)
    for label in labels:
        branches.append(continuation(switch(branches[-1][label]), parameter, window, **options))
    point, free, walls = curve
    if point is not None and free is not None:
        problem = locus(branches[-1][point], free=free, window=walls)
        branches.append(continuation(problem, parameter, window, **options))
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
        rows, second = [], getattr(branch.meshes[0], "free", "")
        rounding = 1e-13 * abs(branch.window[1] - branch.window[0])
        for point in branch.special:
            what = f"{point.kind}, {point.criticality}" if point.criticality else str(point.kind)
            what += ", symmetry breaking" if point.symmetry_breaking else ""
            what += f" ({point.name})" if point.name else ""
            value = point.params[branch.name]
            value = 0.0 if abs(value) < rounding else value
            place = f"{branch.name} = {value:.10g}"
            if second:
                place += f"  {second} = {point.params[second]:.10g}"
            rows.append((point.label, place, what))
        console.table(rows)
        if branch.message:
            console.say(f"  {branch.status} at {branch.name} = {branch.parameter[-1]:.10g}: {branch.message}")
    console.say(f"  {seconds:.2f} s")
    for path in outputs:
        console.say(f"wrote {path}")
    if not outputs:
        console.say("add -o branch.npz (csv, png, svg, pdf) to keep it")
