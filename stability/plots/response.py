"""Frequency responses: magnitude alone, or magnitude and phase above each other (Bode)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from .style import SERIES, axis_label, symbol

if TYPE_CHECKING:
    from ..charting.transfer import LinearResponse

__all__ = ["draw_frequency_response"]


def draw_frequency_response(
    response: LinearResponse,
    output: str | Sequence[str],
    frequency: npt.ArrayLike,
    *,
    kind: str = "magnitude",
    ax: Any = None,
    **line: Any,
) -> list[Any]:
    """Draw |G| (linear axes), or a Bode plot (logarithmic magnitude, phase in degrees); returns the lines.

    Parameters
    ----------
    response : LinearResponse
        What to draw.
    output : str or sequence of str
        States or outputs.
    frequency : array (N,)
        Values of the frequency parameter.
    kind : str
        ``"magnitude"`` or ``"bode"``.
    ax : Axes, or pair of Axes for a Bode plot, optional
        Where to draw; a new figure otherwise.
    **line
        Passed to ``Axes.plot``.

    Returns
    -------
    list of Line2D

    Raises
    ------
    InputError
        For another kind, or axes that do not fit it.
    """
    if kind not in ("magnitude", "bode"):
        raise InputError(f"kind must be 'magnitude' or 'bode'; got {kind!r}")
    names = [output] if isinstance(output, str) else list(output)
    values = np.asarray(frequency, dtype=float)
    if ax is None:
        import matplotlib.pyplot as plt

        _, ax = plt.subplots(2 if kind == "bode" else 1, 1, sharex=True, layout="constrained")
    axes = np.atleast_1d(ax)
    if axes.size != (2 if kind == "bode" else 1):
        raise InputError(f"kind={kind!r} needs {2 if kind == 'bode' else 1} axes; got {axes.size}")
    artists = []
    for i, name in enumerate(names):
        z = response.frequency_response(values, name)
        style = {"color": SERIES[i % len(SERIES)], "label": symbol(name), **line}
        artists += axes[0].plot(values, np.abs(z), **style)
        if kind == "bode":
            artists += axes[1].plot(values, np.degrees(np.unwrap(np.angle(z))), **style)
    system = response.system
    axes[0].set_ylabel(
        "amplitude" if len(names) > 1 else f"amplitude of {axis_label(names[0], system.units.get(names[0], ''))}"
    )
    if kind == "bode":
        axes[0].set_xscale("log")
        axes[0].set_yscale("log")
        axes[1].set_ylabel("phase (deg)")
        axes[1].yaxis.set_major_locator(_multiples(90))
    axes[-1].set_xlabel(axis_label(response.frequency_name, system.units.get(response.frequency_name, "")))
    if len(names) > 1:
        axes[0].legend(frameon=False)
    return artists


def _multiples(step: float) -> Any:
    from matplotlib.ticker import MultipleLocator

    return MultipleLocator(step)
