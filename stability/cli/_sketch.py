"""A chart as characters: blank where stable, darker the faster the growth; y upwards, as on paper."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["sketch"]

_SHADES = " ░▒▓█"
_MARGIN = 13


def sketch(growth_rate: npt.NDArray[np.float64], x: dict[str, Any], y: dict[str, Any], columns: int = 80) -> str:
    """Lines of text for a growth rate (ny, nx): each character shows the largest growth in its cell.

    >>> import numpy as np
    >>> axis = {"parameter": "a", "from": 0.0, "to": 1.0}
    >>> print(sketch(np.array([[-1.0, 0.2], [-1.0, 1.0]]), axis, axis, columns=2).splitlines()[0])
                1 | █
    """
    ny, nx = growth_rate.shape
    width, height = min(columns, nx), min(max(2, columns // 4), ny)
    rows = [int(i) for i in np.linspace(0, ny, height + 1)[:-1]]
    starts = [int(i) for i in np.linspace(0, nx, width + 1)[:-1]]
    cells = np.fmax.reduceat(np.fmax.reduceat(growth_rate, rows, axis=0), starts, axis=1)
    top = float(np.nanmax(cells))
    relative = np.clip(np.nan_to_num(cells) / top, 0.0, 1.0) if top > 0 else np.zeros_like(cells)
    shade = np.where(relative > 0, 1 + np.minimum((relative * 4).astype(int), 3), 0)
    lines = []
    for i in range(height - 1, -1, -1):
        mark = f"{y['to']:.4g}" if i == height - 1 else f"{y['from']:.4g}" if i == 0 else ""
        lines.append(f"{mark:>{_MARGIN}} |" + "".join(_SHADES[k] for k in shade[i]))
    ends = f"{x['from']:.4g}", f"{x['to']:.4g}"
    gap = max(1, width - len(ends[0]) - len(ends[1]))
    lines.append(" " * _MARGIN + " +" + "-" * width)
    lines.append(" " * (_MARGIN + 2) + ends[0] + " " * gap + ends[1])
    lines.append(" " * (_MARGIN + 2) + f"{x['parameter']} along x, {y['parameter']} along y; darker grows faster")
    return "\n".join(lines)
