"""A picture into a file, the same bytes each time: no date in it, and identifiers that do not depend on chance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["write_picture"]

_NO_DATE: dict[str, dict[str, None]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def write_picture(path: Path, draw: Callable[[Any], Any], width: float = 6.4, height: float = 4.4) -> None:
    """Draw into fresh axes (size in inches) and save; the format is that of the ending."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    ending = path.suffix.lower()
    with rc_context({"svg.hashsalt": "stability"}):
        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.add_subplot())
        figure.savefig(path, dpi=200, format=ending[1:], metadata=_NO_DATE.get(ending))
