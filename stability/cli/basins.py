"""``stability basins MODEL``: which steady motion every start of a grid comes to.

Two initial values span the grid; the attractors are printed with their shares. On a terminal a bar shows the progress.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._arguments import SETTING, SHAPE, SPAN, check_outputs, replacing, settings
from ._console import Console, as_json_option
from ._motions import ACCELERATION, excited

if TYPE_CHECKING:
    from ..results.basins import Basins

FORMATS = (".png", ".svg", ".pdf", ".npz", ".csv")
_BAR = 30


@click.command("basins")
@click.argument("model")
@click.option("--x", "x", type=SPAN, required=True, help="First initial value and its range, as u:-8:8.")
@click.option("--y", "y", type=SPAN, required=True, help="Second initial value and its range, as u_dot:-8:8.")
@click.option("--shape", type=SHAPE, default="200x200", show_default=True, help="Cells along x and y.")
@click.option("--set", "pairs", type=SETTING, multiple=True, help="A parameter or an option of the model; repeatable.")
@click.option("--x0", "initial", type=SETTING, multiple=True, help="The other initial values, as u=0.1; repeatable.")
@click.option("--periods", type=click.IntRange(20), default=400, show_default=True, help="Longest time followed.")
@click.option("--acceleration", type=ACCELERATION, help="Constant base acceleration, as 0.5g or 4.9 (m/s^2).")
@click.option("--amplitude", type=click.FloatRange(0), help="Constant base amplitude (m).")
@click.option("--workers", type=click.IntRange(1), help="Threads; all cores by default.")
@click.option("-o", "--output", "outputs", type=click.Path(path_type=Path), multiple=True,
              help="File to write: .png .svg .pdf, or data as .npz .csv; repeatable.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
@as_json_option
@click.pass_obj
def command(
    console: Console, model: str, x: tuple[str, float, float], y: tuple[str, float, float], shape: tuple[int, int],
    pairs: tuple[tuple[str, Any], ...], initial: tuple[tuple[str, Any], ...], periods: int,
    acceleration: float | None, amplitude: float | None, workers: int | None, outputs: tuple[Path, ...], force: bool,
) -> None:  # fmt: skip
    """Basins of attraction of MODEL over two initial values.

    \b
    stability basins duffing.from_physical --set frequency=25 --x y:-6e-3:6e-3 --y y_dot:-0.8:0.8 -o basins.png
    stability basins base_driven_pendulum --set xi=0.05 --x phi:-3:3 --y phi_dot:-2:2 --shape 1000x1000 -o b.npz
    """
    chosen, x0 = settings(pairs), settings(initial)
    check_outputs(outputs, FORMATS, force)
    with console.working(f"basins of {model}") as say:
        from .. import basins
        from ._models import system_from

        system = excited(system_from(model, chosen), acceleration, amplitude)
        began = time.perf_counter()
        found: Basins = basins(
            system, x=x, y=y, shape=shape, x0=x0, periods=periods, workers=workers,
            progress=partial(_progress, say, f"basins of {model}"),
        )  # fmt: skip
        seconds = time.perf_counter() - began
    for path in outputs:
        with console.working(f"writing {path}"), replacing(path) as temporary:
            _write(found, temporary)
    document = _document(found, model, chosen, seconds, outputs)
    _report(console, document, found)
    console.result(document)


def _progress(say: Callable[[str], Any], what: str, done: int, total: int) -> None:
    full = _BAR * done // total
    say(f"{what} {'█' * full}{'░' * (_BAR - full)} {100 * done // total} %")


def _write(found: Basins, path: Path) -> None:
    ending = path.suffix.lower()
    if ending == ".npz":
        found.save(path)
    elif ending == ".csv":
        import numpy as np

        grid = np.meshgrid(found.x, found.y)
        columns = np.column_stack([grid[0].ravel(), grid[1].ravel(), found.labels.ravel()])
        np.savetxt(path, columns, delimiter=",", header=f"{found.x_name},{found.y_name},attractor", comments="")
    else:
        from ._pictures import write_picture

        def draw(axes: Any) -> None:
            found.plot(ax=axes)
            axes.legend(frameon=True, fontsize="small")

        write_picture(path, draw)


def _document(
    found: Basins, model: str, chosen: dict[str, Any], seconds: float, outputs: tuple[Path, ...]
) -> dict[str, Any]:
    return {
        "model": model,
        "set": chosen,
        "x": [found.x_name, float(found.x[0]), float(found.x[-1])],
        "y": [found.y_name, float(found.y[0]), float(found.y[-1])],
        "shape": list(found.labels.shape[::-1]),
        "attractors": [
            {"label": a.label, "periods": a.multiple, "share": a.share, "points": a.points.tolist()}
            for a in found.attractors
        ],
        "escaped": found.escaped,
        "undecided": found.undecided,
        "agreement": found.agreement,
        "seconds": seconds,
        "written": [str(path) for path in outputs],
    }


def _report(console: Console, document: dict[str, Any], found: Basins) -> None:
    rows = []
    for one in found.attractors:
        kind = f"repeats after {one.multiple} period{'s' * (one.multiple > 1)}" if one.multiple else "does not repeat"
        place = ", ".join(f"{name} = {value:.5g}" for name, value in zip(found.states, one.points[0]))
        rows.append((f"attractor {one.label}", f"{100 * one.share:.4g} % of the starts; {kind}; {place}"))
    for word, share in (("escaped", found.escaped), ("undecided", found.undecided)):
        if share:
            rows.append((word, f"{100 * share:.4g} %"))
    if found.agreement < 1.0:
        rows.append(("agreement", f"{100 * found.agreement:.4g} % of 200 starts come to the same by integration"))
    rows.append(("cells", f"{found.labels.size} in {document['seconds']:.1f} s"))
    console.table(rows)
    for path in document["written"]:
        console.say(f"wrote {path}")
    if not document["written"]:
        console.say("add -o basins.png (svg, pdf, npz, csv) to keep it")
