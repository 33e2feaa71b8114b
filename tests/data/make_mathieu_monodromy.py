"""Make mathieu_monodromy.csv: period map of w'' + 2 zeta w' + (a - 2 q cos 2z) w = 0 over pi, to 30 digits.

Second method: w = exp(-zeta z) x with x'' + (a - zeta^2 - 2 q cos 2z) x = 0, power series of x about 0 summed at z =
pi with enough digits (`make_mathieu_exponents`). The multipliers follow in the same arithmetic, the small one too. Run:
``python tests/data/make_mathieu_monodromy.py`` (a few seconds).
"""

from __future__ import annotations

import csv
from pathlib import Path

import mpmath
from make_mathieu_exponents import half_period

POINTS = [
    (1.0, 0.5, 0.0), (1.0, 0.5, 0.05), (1.0, 0.5, 5.0), (2.0, 1.0, 5.0), (4.0, 0.0, 10.0), (25.0, 4.0, 0.3),
    (-1.0, 3.0, 0.1), (7.5, 3.25, 0.01), (60.0, 20.0, 1.0), (0.0, 2.0, 0.5), (300.0, 90.0, 0.2), (4.125, 0.875, 0.0625),
]  # fmt: skip


def period_map(a: float, q: float, zeta: float) -> tuple[list, list]:
    mpmath.mp.dps = 220
    z = mpmath.mpf(zeta)
    u1, v1, u2, v2 = half_period(mpmath.mpf(a) - z * z, mpmath.mpf(q), full=True)
    decay = mpmath.exp(-z * mpmath.pi)
    first, second = u1 + z * u2, v1 + z * v2
    entries = [decay * first, decay * u2, decay * (second - z * first), decay * (v2 - z * u2)]
    half = (entries[0] + entries[3]) / 2
    determinant = entries[0] * entries[3] - entries[1] * entries[2]
    assert abs(determinant / decay**2 - 1) < mpmath.mpf(10) ** -40
    root = mpmath.sqrt(mpmath.mpc(half * half - determinant))
    values = sorted([half + root, half - root], key=lambda m: (-abs(m), -m.imag))
    return entries, values


def main() -> None:
    with Path(__file__).with_name("mathieu_monodromy.csv").open("w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(["a", "q", "zeta", "M11", "M12", "M21", "M22", "re1", "im1", "re2", "im2"])
        for a, q, zeta in POINTS:
            entries, values = period_map(a, q, zeta)
            numbers = [*entries, *(part for m in values for part in (m.real, m.imag))]
            table.writerow([repr(a), repr(q), repr(zeta), *(mpmath.nstr(x, 32) for x in numbers)])


if __name__ == "__main__":
    main()
