"""Mathieu numbers: where the root search of scipy.special lands on another order, accuracy, and time per value.

The witness for both sides is the 30-digit table `tests/data/mathieu_values.csv`, whose orders are proven by Sturm
counts. Run ``python tests/benchmarks/bench_mathieu.py``; times are minima of interleaved runs, only ratios travel.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path

import mpmath
import numpy as np
from scipy import special

import stability as st

TABLE = Path(__file__).parents[1] / "data" / "mathieu_values.csv"


def rows() -> list[tuple[str, int, float, mpmath.mpf]]:
    with TABLE.open() as stream:
        return [(r["kind"], int(r["n"]), float(r["q"]), mpmath.mpf(r["value"])) for r in csv.DictReader(stream)]


def nearest_order(value: float, kind: str, q: float) -> str:
    """Which order the value belongs to."""
    orders = np.arange(1 if kind == "b" else 0, 120)
    ours = (st.mathieu_a if kind == "a" else st.mathieu_b)(orders, q)
    at = int(np.argmin(np.abs(ours - value)))
    return f"{kind}_{orders[at]}" if abs(ours[at] - value) < 1e-6 * max(abs(value), 1) else "none"


def best(calls: list, repeats: int = 7) -> list[float]:
    least = [np.inf] * len(calls)
    for _ in range(repeats):
        for k, call in enumerate(calls):
            start = time.perf_counter()
            call()
            least[k] = min(least[k], time.perf_counter() - start)
    return least


def main() -> None:
    mpmath.mp.dps = 40
    out = sys.stdout
    entries = rows()
    wrong, ours, theirs = [], 0.0, 0.0
    for kind, n, q, exact in entries:
        mine = (st.mathieu_a if kind == "a" else st.mathieu_b)(n, q)
        peer = float((special.mathieu_a if kind == "a" else special.mathieu_b)(n, q))
        scale = max(abs(float(exact)), abs(q), n * n)
        ours = max(ours, float(abs(mine - exact)) / scale)
        # the peer answers nan where it gives up: that is a wrong answer, too
        if not abs(peer - float(exact)) < 1e-6 * max(abs(float(exact)), 1):
            wrong.append((kind, n, q, peer, mine))
        else:
            theirs = max(theirs, float(abs(peer - exact)) / scale)
    out.write(f"{len(entries)} values of the table; largest error over max(|a|, |q|, n^2): ours {ours:.1e}, ")
    out.write(f"scipy {theirs:.1e} where its order is right; its order is wrong at {len(wrong)}\n")
    out.write("order          q   scipy gives        which is   right (30-digit table)\n")
    for kind, n, q, peer, mine in [("a", 5, 21.0, float(special.mathieu_a(5, 21.0)), st.mathieu_a(5, 21.0)), *wrong][:25]:
        out.write(f"{kind}_{n:<4d} {q:>11.6g}   {peer:<16.10g} {nearest_order(peer, kind, q):>9}   {mine:.12g}\n")
    q = np.linspace(0.0, 10.0, 20_000)
    a = np.linspace(-1.0, 10.0, 20_000)
    times = best([lambda: st.mathieu_a(2, q), lambda: special.mathieu_a(2, q), lambda: st.mathieu_exponent(a, q)])
    out.write(f"time per value of a_2: ours / scipy = {times[0] / times[1]:.1f}")
    out.write(f" ({times[0] / q.size * 1e6:.2f} us); of an exponent {times[2] / q.size * 1e6:.2f} us\n")


if __name__ == "__main__":
    main()
