"""One oscillator, every method, one axes: Duffing's response by averaging, harmonic balance, collocation and sweeps.

    u'' + 2 xi u' + u + beta u^3 = Omega^2 cos(Omega tau),      xi = 0.02, beta = 0.001 < 16 xi^2/3 (a closed peak)

Folds of each method, and its largest error against collocation relative to the largest amplitude.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

TITLE = "Analytic against numeric: Duffing's response by eight methods on one axes"
FIGURE = "methods.png"
METHODS = ("multiple-scales", "averaging", "averaging2", "hb3", "hb9", "collocation", "sweep")


def compute() -> dict[str, Any]:
    """All responses, each method laid over collocation."""
    import warnings

    import stability as st
    from stability.errors import OpenResonanceWarning, TruncationWarning, UnsettledWarning

    start = time.perf_counter()
    with warnings.catch_warnings():  # the table shows all of it: what three harmonics miss, what stays open
        for kind in (OpenResonanceWarning, TruncationWarning, UnsettledWarning):
            warnings.simplefilter("ignore", kind)
        found = st.responses(st.models.duffing(xi=0.02, beta=0.001), "Omega", (0.6, 1.8), METHODS, points=41)
    return {"responses": found, "seconds": time.perf_counter() - start}


def rows(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Cost, then folds and the largest error of every method."""
    found = data["responses"]
    table = [("all methods, errors included", f"{data['seconds']:.2f} s")]
    for row in found.rows():
        places = row.get("folds", row.get("jumps"))
        what = "jumps at" if "jumps" in row else "folds at"
        text = f"{what} " + ", ".join(f"{place:.6f}" for place in places)
        error = row.get("largest_error")
        kept = "reference" if row["method"] == found.comparison.reference else f"largest error {error:.1e}"
        missed = row.get("folds_missed")
        table.append((row["method"], f"{text:36}  {kept}" + (", stays open" if missed else "")))
    return table


def draw(data: dict[str, Any], path: Path) -> None:
    """Amplitude over the frequency; unstable parts dashed, sweeps as arrows."""
    from .._pictures import write_picture

    def all_methods(axes: Any) -> None:
        data["responses"].plot(ax=axes)
        axes.set_ylim(-1, 48)

    write_picture(path, all_methods)
