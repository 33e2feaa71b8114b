"""What is asked for: the axes of a chart, its shape, and the window in which samples can be taken.

Equations may be singular on an edge of the window though their limit is not (0/0 at zero acceleration, say). Samples
are then taken from a window that is smaller by 1e-4 of its width at that side, and the edge is extrapolated: T_k grows
there by no more than exp(k sqrt(4e-4)), which costs a fraction of a digit.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, NonFiniteError, ResourceLimitError, check_names
from ..floquet.linearisation import PeriodicLinear

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["axis", "grid_shape", "sampled_window"]

Array = NDArray[np.float64]
_BYTES = 10  # per point: growth rate, verdict, kind
_INSET = 1e-4


def axis(which: str, given: Any, system: System) -> tuple[str, float, float]:
    """A checked (name, lo, hi)."""
    if isinstance(given, str) or not isinstance(given, Sequence) or len(given) != 3:
        raise InputError(f"{which} = {given!r}; give (name, lo, hi), for instance {which}=('a', 0.0, 2.0)")
    name, lo, hi = given
    check_names("parameter", [name], system.parameters)
    try:
        lo, hi = float(lo), float(hi)
    except (TypeError, ValueError):
        raise InputError(f"the interval of {which} = '{name}' must be two numbers; got {lo!r}, {hi!r}") from None
    if not (math.isfinite(lo) and math.isfinite(hi)):
        raise InputError(f"the interval of {which} = '{name}' must be finite; got {lo}, {hi}")
    if not lo < hi:
        raise InputError(f"the interval of {which} = '{name}' must have lo < hi; got {lo:g}, {hi:g}")
    return str(name), lo, hi


def grid_shape(shape: Any) -> tuple[int, int]:
    """(nx, ny), at least 2 each, that fit into half of the machine's memory."""
    pair = (shape, shape) if isinstance(shape, int | np.integer) else shape
    try:
        nx, ny = (int(n) for n in pair)
        exact = all(n == m for n, m in zip((nx, ny), pair, strict=True))
    except (TypeError, ValueError):
        exact = False
    if not exact:
        raise InputError(f"shape = {shape!r}; give two whole numbers (nx, ny)")
    if nx < 2 or ny < 2:
        raise InputError(f"shape = {shape!r}; at least 2 points along each axis are needed")
    limit = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2 if hasattr(os, "sysconf") else 2**33
    if nx * ny * _BYTES > limit:
        raise ResourceLimitError(
            f"a chart of {nx} x {ny} points needs {nx * ny * _BYTES / 2**30:.1f} GiB; at most {limit / 2**30:.1f} GiB "
            "are used: make shape smaller, or chart several windows"
        )
    return nx, ny


def sampled_window(
    linear: PeriodicLinear, base: Array, columns: tuple[int, int], window: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """The window, with sides drawn in where the matrix A is not finite on the side but has a limit there.

    Raises
    ------
    NonFiniteError
        A is not finite on a side and does not tend to a limit.
    """
    out = list(window)
    for side in range(4):
        along, across = columns[side // 2], columns[1 - side // 2]
        lo, hi = window[2 * (side // 2)], window[2 * (side // 2) + 1]
        other_lo, other_hi = window[2 - 2 * (side // 2)], window[3 - 2 * (side // 2)]
        P = np.repeat(base[None, :], 3, axis=0)
        P[:, across] = other_lo + (other_hi - other_lo) * np.array([0.21, 0.52, 0.83])
        edge, inward = (lo, hi - lo) if side % 2 == 0 else (hi, lo - hi)
        P[:, along] = edge
        if _finite(linear, P) is not None:
            continue
        values = []
        for part in (_INSET, 1e-2 * _INSET):
            P[:, along] = edge + part * inward
            values.append(_finite(linear, P))
        near, nearer = values
        if near is None or nearer is None or np.abs(near - nearer).max() > 1e-2 * max(1.0, np.abs(near).max()):
            P[:, along] = edge
            linear.A(np.array([0.1]), P)  # raises the error that names state and parameters
            raise NonFiniteError(f"the equations have no limit at {linear.system.name}'s edge {edge:g} of the window")
        out[side] = edge + _INSET * inward
    return out[0], out[1], out[2], out[3]


def _finite(linear: PeriodicLinear, P: Array) -> Array | None:
    """A at some phases, or None where it is not finite."""
    try:
        return linear.A(np.array([0.137, 0.711]), P)
    except NonFiniteError:
        return None
