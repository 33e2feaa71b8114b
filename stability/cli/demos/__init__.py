"""The sections of ``stability demo``: one file a section, listed in `SECTIONS` in the order in which they are shown.

A section is a module with

    TITLE : str                          one line
    FIGURE : str                         name of the picture it writes
    compute() -> dict                    the numbers
    rows(data) -> list of (label, text)  the table a person reads
    draw(data, path) -> None             the picture
"""

from __future__ import annotations

__all__ = ["SECTIONS"]

SECTIONS: tuple[str, ...] = ("tongues", "methods", "bifurcations", "plane")
