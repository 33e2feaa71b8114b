"""Lines of a quasi-periodic motion: one stem each, the strongest with the whole numbers that make them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .style import SERIES, axis_label

if TYPE_CHECKING:
    from ..results.line_spectrum import LineSpectrum

__all__ = ["plot_lines"]


def plot_lines(spectrum: LineSpectrum, ax: Any = None, *, labels: int = 6, **style: Any) -> list[Any]:
    """Draw amplitudes over frequencies, on a logarithmic scale.

    Parameters
    ----------
    spectrum : LineSpectrum
    ax : matplotlib Axes, optional
    labels : how many of the strongest lines carry their whole numbers
    **style : of the stems

    Returns
    -------
    list of artists
    """
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(6.0, 3.6), layout="constrained").add_subplot()
    look = {"color": SERIES[0], "linewidth": 1.2, **style}
    least = 0.3 * float(spectrum.amplitude.min(initial=1.0))
    artists: list[Any] = [ax.vlines(spectrum.frequency, least, spectrum.amplitude, **look)]
    for f, a, k in list(zip(spectrum.frequency, spectrum.amplitude, spectrum.orders.tolist()))[:labels]:
        text = "(" + ", ".join(f"{n:d}" for n in k) + ")"
        artists.append(
            ax.annotate(text, (f, a), xytext=(0, 3), textcoords="offset points", ha="center", rotation=90,
                        fontsize="small")
        )
    top = float(spectrum.amplitude.max(initial=2 * least))
    ax.set_yscale("log")
    ax.set(ylim=(least, 10 * top), xlabel="frequency (cycles per unit time)")
    ax.set_ylabel(f"amplitude of {axis_label(spectrum.name)}")
    return artists
