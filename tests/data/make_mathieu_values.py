"""Make mathieu_values.csv: characteristic values a_n(q), b_n(q) of x'' + (a - 2 q cos 2z) x = 0 to 30 digits.

Second method, nothing of the library in it: a dense symmetric eigenvalue solver of twice the rows needed starts,
Newton's method on the determinant of the tridiagonal matrix in 60-digit arithmetic ends, and Sturm counts in
60-digit arithmetic 1e-9 (relative) to either side prove the order. Run: ``python tests/data/make_mathieu_values.py``
(about 20 s).
"""

from __future__ import annotations

import csv
from pathlib import Path

import mpmath
import numpy as np

ORDERS = [*range(0, 61, 1)]
STRENGTHS = [0.0009765625, 0.1, 0.75, 3.0, 15.625, 21.0, 88.0, 500.0, 2500.0, 10000.0]
FAR = [(140, 3e4), (141, 777.0), (300, 2e5), (499, 1e6), (498, 1.0), (0, 1e6), (7, 1e6), (250, 4e4)]


def matrix(n: int, q: float, odd: bool, rows: int) -> tuple[list, list]:
    """Diagonal and squared off-diagonal in exact (mpmath) numbers."""
    first = 1 if n % 2 else (2 if odd else 0)
    strength = mpmath.mpf(q)
    diagonal = [mpmath.mpf((first + 2 * k) ** 2) for k in range(rows)]
    squares = [strength**2] * (rows - 1)
    if n % 2:
        diagonal[0] += -strength if odd else strength
    elif not odd:
        squares[0] *= 2
    return diagonal, squares


def sturm_count(diagonal: list, squares: list, x) -> int:
    """Number of eigenvalues below x."""
    value = diagonal[0] - x
    count = int(value < 0)
    for d, e2 in zip(diagonal[1:], squares, strict=True):
        value = d - x - e2 / value
        count += value < 0
    return count


def value(n: int, q: float, odd: bool):
    """The characteristic value of order n, its index proven."""
    turning = np.sqrt(n * n + 4 * q + 1)
    rows = int(turning + 30 * np.cbrt(2 * q / turning) + 60)
    diagonal, squares = matrix(n, q, odd, rows)
    off = np.sqrt(np.array([float(e) for e in squares]))
    dense = np.diag([float(d) for d in diagonal]) + np.diag(off, 1) + np.diag(off, -1)
    index = (n - 1) // 2 if n % 2 else (n // 2 - 1 if odd else n // 2)
    x = mpmath.mpf(float(np.linalg.eigvalsh(dense)[index]))
    scale = max(n * n, q, 1)
    for _ in range(12):
        step = 1 / log_derivative(diagonal, squares, x)
        x -= step
        if abs(step) < scale * mpmath.mpf(10) ** -45:
            break
    else:
        raise ArithmeticError((n, q, odd, step))
    margin = mpmath.mpf(10) ** -9 * scale
    below, above = sturm_count(diagonal, squares, x - margin), sturm_count(diagonal, squares, x + margin)
    assert (below, above) == (index, index + 1), (n, q, odd, below, above, index)
    return x


def log_derivative(diagonal: list, squares: list, x):
    """(d/dx) log det(T - x) = sum of (pivot'/pivot)."""
    value, slope = diagonal[0] - x, mpmath.mpf(-1)
    total = slope / value
    for d, e2 in zip(diagonal[1:], squares, strict=True):
        value, slope = d - x - e2 / value, -1 + e2 / value**2 * slope
        total += slope / value
    return total


def main() -> None:
    mpmath.mp.dps = 60
    path = Path(__file__).with_name("mathieu_values.csv")
    with path.open("w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(["kind", "n", "q", "value"])
        for n, q in [(n, q) for q in STRENGTHS for n in ORDERS] + FAR:
            for odd in (False, True):
                if odd and n == 0:
                    continue
                table.writerow(["ba"[not odd], n, repr(q), mpmath.nstr(value(n, q, odd), 32)])


if __name__ == "__main__":
    main()
