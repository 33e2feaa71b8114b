"""Make mathieu_exponents.csv: nu(a, q) of x'' + (a - 2 q cos 2z) x = 0 to 30 digits, also next to tongue edges.

Second method: the power series of both solutions about z = 0, which converges everywhere, summed at z = pi/2 with
enough digits for its cancellation (the Wronskian confirms them). S = -u1' u2 = sin^2(pi nu/2); the integer part by
Sturm counts in the same arithmetic (`make_mathieu_values`). Run: ``python tests/data/make_mathieu_exponents.py``
(three minutes).
"""

from __future__ import annotations

import csv
from pathlib import Path

import mpmath
import numpy as np
from make_mathieu_values import matrix, sturm_count, value


def half_period(a, q, full: bool = False):
    """u1, u1', u2, u2' at pi/2 (or pi) by power series."""
    h = mpmath.pi if full else mpmath.pi / 2
    small = mpmath.mpf(10) ** -mpmath.mp.dps
    cosine, out = [mpmath.mpf(1)], []
    for start in (0, 1):
        # only every second coefficient differs from zero
        x, quiet = [mpmath.mpf(1)], 0
        while quiet < 12:
            m = len(x) - 1
            k = start + 2 * m
            if len(cosine) <= m:
                cosine.append(-4 * cosine[-1] / ((2 * m - 1) * (2 * m)))
            total = -a * x[m] + 2 * q * mpmath.fdot((cosine[j], x[m - j]) for j in range(m + 1))
            x.append(total / ((k + 1) * (k + 2)))
            quiet = quiet + 1 if abs(x[-1]) * (k + 2) * h ** (k + 2) < small else 0
        powers = [start + 2 * m for m in range(len(x))]
        out.append(mpmath.fsum(c * h**k for c, k in zip(x, powers, strict=True)))
        out.append(mpmath.fsum(k * c * h ** (k - 1) for c, k in zip(x, powers, strict=True) if k))
    return out


def exponent(a: float, q: float):
    """(Re nu, Im nu), unfolded."""
    mpmath.mp.dps = int(80 + 6 * np.sqrt(abs(a) + 2 * abs(q)))
    x, strength = mpmath.mpf(a), mpmath.mpf(q)
    u1, v1, u2, v2 = half_period(x, strength)
    assert abs(u1 * v2 - u2 * v1 - 1) < mpmath.mpf(10) ** -45
    rows = int(np.sqrt(abs(a) + 2 * abs(q)) + 60)
    below = sum(sturm_count(*matrix(n, q, odd, rows), x) for n, odd in ((0, False), (1, False), (1, True), (2, True)))
    order = below // 2
    near = -v1 * u2 if order % 2 == 0 else u1 * v2
    if below % 2:
        assert near > 0
        return order + 2 / mpmath.pi * mpmath.atan2(mpmath.sqrt(near), mpmath.sqrt(1 - near)), mpmath.mpf(0)
    assert near <= 0
    return mpmath.mpf(order), 2 / mpmath.pi * mpmath.asinh(mpmath.sqrt(-near))


def points() -> list[tuple[float, float, str]]:
    """Scattered points, and points 1e-9 and 1e-12 from tongue edges."""
    random = np.random.default_rng(20)
    chosen = []
    for _ in range(90):
        q = float(10 ** random.uniform(-2, 2.3))
        chosen.append((float(random.uniform(-2.2 * q, 2.5 * q + 40)), q, "scattered"))
    for a, q in [(3000.5, 1e3), (1e4, 40.0), (1e4, 4.9e3), (-7000.0, 4e3), (1999.0, 4e3), (1e-5, 1e-3), (2.0, 0.0)]:
        chosen.append((a, q, "large"))
    for q in (0.25, 3.0, 12.0, 150.0):
        for n in (0, 1, 2, 3, 6):
            for odd in (False, True):
                if odd and n == 0:
                    continue
                mpmath.mp.dps = 60
                edge = value(n, q, odd)
                for offset in (1e-9, -1e-9, 1e-12):
                    chosen.append((float(edge + mpmath.mpf(offset)), q, f"edge {offset:g}"))
    return chosen


def main() -> None:
    with Path(__file__).with_name("mathieu_exponents.csv").open("w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(["a", "q", "where", "real", "imaginary"])
        for a, q, where in points():
            real, imaginary = exponent(a, q)
            table.writerow([repr(a), repr(q), where, mpmath.nstr(real, 32), mpmath.nstr(imaginary, 32)])
        for a, q in [(2 + 1j, 1.0 + 0j), (5.0 + 0j, 2j), (-1 - 2j, 3 + 1j), (40 + 3j, 11 - 8j)]:
            mpmath.mp.dps = 120
            u1, v1, u2, v2 = half_period(mpmath.mpc(a), mpmath.mpc(q))
            cosine = u1 * v2 + v1 * u2  # cos(pi nu), half the trace
            table.writerow([a, q, "complex cosine", mpmath.nstr(cosine.real, 32), mpmath.nstr(cosine.imag, 32)])


if __name__ == "__main__":
    main()
