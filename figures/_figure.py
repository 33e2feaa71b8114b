"""How a figure script is made: compute -> check the numbers -> draw.

Each script of this folder is one figure and has

    compute() -> dict          the numbers, by the library
    check(data) -> None        asserts them against closed forms or published values, before anything is drawn
    draw(data, path) -> None   the picture
    main(folder) -> [path]     the three in this order

``python figures/<name>.py`` writes into figures/out; the test suite runs every ``main`` in a folder of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

OUT = Path(__file__).resolve().parent / "out"


def make(
    script: str,
    compute: Callable[[], dict[str, Any]],
    check: Callable[[dict[str, Any]], None],
    draw: Callable[[dict[str, Any], Path], None],
    folder: Path | str = OUT,
) -> list[Path]:
    """Run one script into `folder`; the picture is named like the script."""
    path = Path(folder) / f"{Path(script).stem}.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    data = compute()
    check(data)
    draw(data, path)
    return [path]


def panels(
    columns: int = 1, rows: int = 1, *, width: float = 7.0, height: float = 3.4, **options: Any
) -> tuple[Figure, Any]:
    """A figure without pyplot (no global state), of a printed page's width in inches, and its axes."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def letter(axes: Axes, text: str) -> None:
    """(a), (b), ... in the upper left corner outside the axes."""
    axes.set_title(text, loc="left", fontsize="medium")


def save(figure: Figure, path: Path) -> None:
    """300 dots an inch for a picture of points; the size is that of `panels`."""
    figure.savefig(path, dpi=300)
