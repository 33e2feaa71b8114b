"""Makes auto_duffing.csv: the labels AUTO-07p prints on the main branch of x'' + 0.1 x' + x + x^3 = F cos(omega t).

Run:  python tests/data/make_auto_duffing.py          (needs the Debian package auto-07p and gcc; about two minutes)

NTST 200, NCOL 4, tolerances 1e-8 (EPSS 1e-7), from high omega downwards, starting with the orbit that the library gives
there. Rows are written in AUTO's order; a run that starts to repeat itself is cut at the first repetition.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))

import bench_continuation

import stability as st

KINDS = {1: "BP", 2: "LP", 5: "LP", 6: "BP", 7: "PD", 8: "TR"}
START = {5.0: 8.0, 10.0: 12.0, 25.0: 16.0}


def main() -> None:
    rows = []
    for F, omega in START.items():
        system = st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=F)
        orbit = st.solve(st.Collocation(system), omega=omega)
        result = bench_continuation.auto_run(system, orbit, "omega", (omega, 0.3), 200, 4, 1, ds_max=0.05)
        if result is None:
            raise SystemExit("AUTO-07p was not found")
        seen: set[tuple[str, float]] = set()
        for label, value in result[2]:
            if label not in KINDS:
                continue
            key = (KINDS[label], round(value, 7))
            if key in seen:
                break
            seen.add(key)
            rows.append((F, KINDS[label], f"{value:.11f}"))
    with open(Path(__file__).with_name("auto_duffing.csv"), "w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows([("F", "kind", "omega"), *rows])


if __name__ == "__main__":
    main()
