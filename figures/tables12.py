"""Tables 1 and 2: translation and rotation; mechanical and electrical systems, in both analogies.

Table 1 as data (`models.TRANSLATION_ROTATION`), with the misprints corrected: omega = dphi/dt, alpha = domega/dt,
P = T omega, energies in s. Table 2: L = T - U on both sides, U_B = -U0 q for a source that drives the current.

    m y'' + d y' + k y = F        <->   L q'' + R q' + q/C = U0            (force-voltage; series circuit)
                                  <->   C psi'' + psi'/R + psi/L = I0      (force-current; parallel circuit)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st

MECHANICAL = dict(mass=0.02, damping=0.1056, stiffness=315.827, force=0.3)
ROWS = [
    ("displacement y", "charge q", "flux linkage psi"),
    ("velocity y'", "current i = q'", "voltage psi'"),
    ("mass m", "inductance L", "capacitance C"),
    ("damping d", "resistance R", "conductance 1/R"),
    ("stiffness k", "1/C", "1/L"),
    ("force F", "source voltage U0", "source current I0"),
    ("T = 1/2 m y'^2", "1/2 L q'^2", "1/2 C psi'^2"),
    ("U = 1/2 k y^2 - F y", "q^2/(2 C) - U0 q", "psi^2/(2 L) - I0 psi"),
    ("R = 1/2 d y'^2", "1/2 R q'^2", "psi'^2/(2 R)"),
]


def compute() -> dict[str, Any]:
    """The rows of both tables, and one oscillator in both analogies."""
    circuits = {
        name: st.models.mechanical_to_electrical(**MECHANICAL, analogy=name)
        for name in ("force-voltage", "force-current")
    }
    back = {name: st.models.electrical_to_mechanical(**values, analogy=name) for name, values in circuits.items()}
    return {"table 1": st.models.TRANSLATION_ROTATION, "circuits": circuits, "back": back}


def check(data: dict[str, Any]) -> None:
    """Same natural frequency and damping ratio in every form; the way back is the identity; table 1 is corrected."""
    m, d, k = (MECHANICAL[name] for name in ("mass", "damping", "stiffness"))
    w, xi = np.sqrt(k / m), d / (2 * np.sqrt(k * m))
    series, parallel = data["circuits"]["force-voltage"], data["circuits"]["force-current"]
    for values, ratio in (
        (series, series["resistance"] / 2 * np.sqrt(series["capacitance"] / series["inductance"])),
        (parallel, 1 / (2 * parallel["resistance"]) * np.sqrt(parallel["inductance"] / parallel["capacitance"])),
    ):
        assert np.isclose(1 / np.sqrt(values["inductance"] * values["capacitance"]), w, rtol=1e-13)
        assert np.isclose(ratio, xi, rtol=1e-13)
    for values in data["back"].values():
        assert all(np.isclose(values[name], MECHANICAL[name], rtol=1e-13) for name in MECHANICAL)
    rows = {row.quantity: row for row in data["table 1"]}
    assert rows["power"].rotation == "P = T omega" and rows["velocity"].rotation == "omega = dphi/dt"


def _letters(text: str) -> str:
    """Greek letters and superscripts in place of the words of the plain data."""
    for word, letter in zip(
        ("omega", "alpha", "phi", "psi", "int ", "^2"), ("\u03c9", "\u03b1", "\u03c6", "\u03c8", "\u222b ", "\u00b2")
    ):
        text = text.replace(word, letter)
    return text


def draw(data: dict[str, Any], path: Path) -> None:
    """Both tables on one page."""
    figure, (upper, lower) = _figure.panels(1, 2, width=7.0, height=6.4)
    first = [
        [row.quantity, row.translation, row.translation_unit, row.rotation, row.rotation_unit]
        for row in data["table 1"]
    ]
    tables = (
        (upper, first, ["", "translation", "unit", "rotation", "unit"], "Table 1"),
        (lower, ROWS, ["mechanical", "force-voltage", "force-current"], "Table 2"),
    )
    for axes, cells, heads, title in tables:
        axes.set_axis_off()
        _figure.letter(axes, title)
        cells = [[_letters(text) for text in row] for row in cells]
        table = axes.table(cellText=cells, colLabels=heads, cellLoc="left", bbox=[0, 0, 1, 1])
        table.auto_set_font_size(False)
        table.set_fontsize(8)
        for (line, _), cell in table.get_celld().items():
            cell.set_linewidth(0.4)
            if line == 0:
                cell.set_text_props(weight="bold")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw; the files that were written."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
