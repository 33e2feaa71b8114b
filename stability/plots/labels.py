"""Labels beside points that keep out of each other's way.

A label knows its point and a few places around it (offsets in points). When the figure is drawn, and only then are
limits and scales of the axes final, it takes the first place where it covers no label of the same axes that was written
before it; where all are taken, the first.
"""

from __future__ import annotations

import functools
from typing import Any, Literal

__all__ = ["write_label"]

Place = tuple[int, int, Literal["left", "right"]]
_PLACES: tuple[Place, ...] = (
    (4, 4, "left"), (-4, 4, "right"), (4, -11, "left"), (-4, -11, "right"), (4, 14, "left"), (4, -21, "left"),
)  # fmt: skip
_BELOW = (*_PLACES[2:4], *_PLACES[:2], *_PLACES[4:])


@functools.cache
def _label_class() -> Any:
    from matplotlib.text import Annotation

    class Label(Annotation):
        """An annotation with several places to stand at."""

        places = _PLACES

        def draw(self, renderer: Any) -> None:
            """Take a free place, then draw."""
            taken = []
            for text in self.axes.texts if self.axes is not None else ():
                if text is self:
                    break
                if isinstance(text, Label) and text.get_visible():
                    taken.append(text.get_window_extent(renderer))
            for place in (*self.places, self.places[0]):
                self.xyann, side = place[:2], place[2]
                self.set_horizontalalignment(side)
                if not any(self.get_window_extent(renderer).overlaps(box) for box in taken):
                    break
            super().draw(renderer)

    return Label


def write_label(ax: Any, text: str, place: tuple[float, float], color: str, below: bool = False) -> Any:
    """Write a label beside a point, with a white halo that keeps it readable on a line; return the artist.

    `below`: under the point if there is room, and not over it.
    """
    from matplotlib.patheffects import withStroke

    label = _label_class()(
        text, place, xytext=(4, 4), textcoords="offset points", fontsize="small", color=color, zorder=2.5,
        path_effects=[withStroke(linewidth=1.5, foreground="white")],
    )  # fmt: skip
    label.places = _BELOW if below else _PLACES
    ax.add_artist(label)
    return label
