"""Characteristic values of Mathieu's equation against 30-digit tables, identities and a dense solver."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stability.errors import ConvergenceError, InputError
from stability.floquet.mathieu import mathieu_a, mathieu_b

DATA = Path(__file__).parents[1] / "data"
VALUE = {"a": mathieu_a, "b": mathieu_b}
DOUBLE_POINT = 1.46876861378514199j  # Mulholland and Goldstein 1929; DLMF 28.7


def table() -> list[tuple[str, int, float, str]]:
    with (DATA / "mathieu_values.csv").open() as stream:
        return [(row["kind"], int(row["n"]), float(row["q"]), row["value"]) for row in csv.DictReader(stream)]


@pytest.mark.parametrize("kind", ["a", "b"])
def test_thirty_digit_table(kind: str) -> None:
    """Issue A: error <= 2e-15 max(|a|, |q|, n^2); the order of each table entry was proven by counting."""
    rows = [row for row in table() if row[0] == kind]
    orders, strengths = np.array([row[1] for row in rows]), np.array([row[2] for row in rows])
    values = VALUE[kind](orders, strengths)
    errors = np.array([float(abs(mpmath.mpf(float(v)) - mpmath.mpf(row[3]))) for v, row in zip(values, rows)])
    assert len(rows) > 600
    assert np.max(errors / np.maximum(np.maximum(np.abs(values), strengths), orders**2.0)) <= 2e-15


def test_values_do_not_depend_on_how_they_are_asked_for() -> None:
    """Scalars, vectors and grids choose other block sizes, and must give the same order and value to a rounding."""
    orders, strengths = np.arange(12), np.array([0.3, 21.0, 640.0])
    grid = mathieu_a(orders[:, None], strengths)
    single = np.array([[mathieu_a(int(n), float(q)) for q in strengths] for n in orders])
    assert np.max(np.abs(grid - single) / np.maximum(strengths, orders[:, None] ** 2 + 1.0)) < 1e-15


def test_series_of_order_four() -> None:
    """DLMF 28.6.1-2 and 28.6.14, truncation error below the next term."""
    q = np.array([0.01, 0.02, 0.05])
    assert np.all(np.abs(mathieu_a(0, q) - (-(q**2) / 2 + 7 * q**4 / 128 - 29 * q**6 / 2304)) < q**8)
    assert np.all(np.abs(mathieu_a(1, q) - (1 + q - q**2 / 8 - q**3 / 64 - q**4 / 1536)) < q**5)
    n = np.array([7, 12])[:, None]
    assert np.all(np.abs(mathieu_b(n, q) - (n**2 + q**2 / (2 * (n**2 - 1)))) < q**4 / n**4 + 2e-15 * n**2)


def test_large_q_expansion() -> None:
    """DLMF 28.8.1: a_n and b_n+1 ~ -2 h^2 + 2 s h - (s^2 + 1)/8 - (s^3 + 3 s)/(2^7 h) - ..., h^2 = q, s = 2n + 1."""
    n, q = np.arange(6)[:, None], np.array([1e4, 1e5, 1e6])
    h, s = np.sqrt(q), 2 * n + 1
    series = -2 * q + 2 * s * h - (s**2 + 1) / 8 - (s**3 + 3 * s) / (128 * h)
    next_term = (5 * s**4 + 34 * s**2 + 9) / (4096 * q)
    for value in (mathieu_a(n, q), mathieu_b(n + 1, q)):
        assert np.all(np.abs(value - series + next_term) < 0.2 * next_term + 2e-15 * q)


@settings(max_examples=20, deadline=None)
@given(some.floats(min_value=1e-3, max_value=1e6))
def test_order_and_interlacing(q: float) -> None:
    """a0 < b1 < a1 < b2 < ...: tongues and bands alternate (equality only below rounding)."""
    n = np.arange(0, 40)
    a, b = mathieu_a(n, q), mathieu_b(n + 1, q)
    slack = 4e-15 * np.maximum(q, (n + 1.0) ** 2)
    assert np.all(a - b < slack)  # a_n < b_{n+1}
    assert np.all(b[:-1] - a[1:] < slack[1:])  # b_{n+1} < a_{n+1}
    assert np.all(np.diff(a) > 0) and np.all(np.diff(b) > 0)


@settings(max_examples=30, deadline=None)
@given(some.integers(0, 499), some.floats(min_value=0, max_value=1e6))
def test_symmetry_in_q(n: int, q: float) -> None:
    """A shift of z by pi/2 changes the sign of q (DLMF 28.2.26)."""
    scale = max(q, n * n, 1)
    mirrored = mathieu_a(n, q) if n % 2 == 0 else mathieu_b(n, q)
    assert abs(mathieu_a(n, -q) - mirrored) <= 4e-15 * scale
    if n:
        mirrored = mathieu_b(n, q) if n % 2 == 0 else mathieu_a(n, q)
        assert abs(mathieu_b(n, -q) - mirrored) <= 4e-15 * scale


def test_where_scipy_jumps_order() -> None:
    """Orders at which the root search of scipy.special lands on a neighbour; ours agrees with LAPACK on every entry."""
    from scipy import special

    orders, strengths = np.arange(16), np.linspace(2.5, 500, 200)
    ours = mathieu_a(orders[:, None], strengths)
    k = np.arange(0, 130, 2.0)
    for column, q in enumerate(strengths):
        even = np.diag(k**2) + q * (np.eye(k.size, k=1) + np.eye(k.size, k=-1))
        even[0, 1] = even[1, 0] = np.sqrt(2) * q
        uneven = np.diag((k + 1) ** 2) + q * (np.eye(k.size, k=1) + np.eye(k.size, k=-1))
        uneven[0, 0] += q
        lapack = np.sort(np.concatenate([np.linalg.eigvalsh(even)[:8], np.linalg.eigvalsh(uneven)[:8]]))
        assert np.max(np.abs(ours[:, column] - lapack)) < 1e-15 * 130**2
    peer = special.mathieu_a(orders[:, None], strengths)
    wrong = np.abs(peer - ours) > 1e-6 * np.maximum(np.abs(ours), 1)
    neighbours = np.min(np.abs(peer[:, None, :] - ours[None, :, :]), axis=1)
    # wherever the peer differs, it gives the value of another order (or a root beyond those listed), never a better one
    assert np.all((neighbours[wrong] < 1e-6 * np.abs(peer[wrong])) | (peer[wrong] > ours[-1].min()))


def test_order_five_at_q_21() -> None:
    """scipy issue 4479: mathieu_a(5, 21) is not mathieu_a(3, 21). The witness is Sturm's count in 60 digits (table)."""
    values = {row[1]: float(row[3]) for row in table() if row[0] == "a" and row[2] == 21.0}
    assert mathieu_a(5, 21.0) == pytest.approx(values[5], rel=1e-15)
    assert mathieu_a(5, 21.0) - mathieu_a(3, 21.0) > 20


# ---- complex q -----------------------------------------------------------------------------------------------------


def test_complex_q_meets_the_real_axis() -> None:
    orders, strengths = np.arange(1, 9)[:, None], np.array([0.5, -7.0, 120.0])
    for value in (mathieu_a, mathieu_b):
        real, continued = value(orders, strengths), value(orders, strengths + 0j)
        assert np.max(np.abs(continued - real)) < 1e-12 * 120


def test_double_point() -> None:
    """a_0 = a_2 = 2.08869890274969540 at q = 1.46876861378514199 i : real below, a pair beyond."""
    pair = mathieu_a(np.array([0, 2]), DOUBLE_POINT)
    assert np.all(np.abs(pair - 2.08869890274969540) < 1e-6)
    assert abs(pair.mean() - 2.08869890274969540) < 1e-7
    below = mathieu_a(np.array([0, 2]), 1.46j)
    assert np.all(np.abs(below.imag) < 1e-13) and below[1].real - below[0].real > 0.05
    beyond = mathieu_a(np.array([0, 2]), 1.48j)
    assert abs(beyond[0] - np.conj(beyond[1])) < 1e-12 and abs(beyond[0].imag) > 0.05
    # the square root law on both sides, with one coefficient
    before = ((below[1] - below[0]) / 2) ** 2 / abs(DOUBLE_POINT - 1.46j)
    after = ((beyond[1] - beyond[0]) / 2) ** 2 / abs(1.48j - DOUBLE_POINT)
    assert abs(before + after) < 0.05 * abs(before)


def test_imaginary_axis_is_the_limit_from_the_right() -> None:
    for n in (0, 2, 4, 6):
        on_axis, beside = mathieu_a(n, 20j), mathieu_a(n, 20j + 1e-5)
        assert abs(on_axis - beside) < 1e-4  # |da/dq| is of order one here


@settings(max_examples=25, deadline=None)
@given(some.integers(0, 12), some.floats(0.01, 60), some.floats(-1.5, 1.5))
def test_complex_values_solve_the_characteristic_equation(n: int, radius: float, angle: float) -> None:
    """The residual of the continued fraction's matrix, in 40 digits, divided by its slope: the error of the value."""
    q = radius * np.exp(1j * angle)
    try:
        value = mathieu_a(n, complex(q))
    except ConvergenceError:
        return  # the ray ran into a double point, and said so
    with mpmath.workdps(40):
        x, strength = mpmath.mpc(value), mpmath.mpc(complex(q))
        first = n % 2
        pivot, total = (first + strength if first else mpmath.mpf(0)) - x, mpmath.mpf(0)
        slope = mpmath.mpf(-1)
        total = slope / pivot
        for k in range(1, 60):
            e2 = strength**2 * (2 if k == 1 and not first else 1)
            pivot, slope = mpmath.mpf(first + 2 * k) ** 2 - x - e2 / pivot, -1 + e2 / pivot**2 * slope
            total += slope / pivot
        assert abs(1 / total) < 1e-6 * max(abs(value), radius, 1)


@pytest.mark.parametrize(("n", "q", "odd"), [(4, 100 * np.exp(0.5j), False), (7, 60 * np.exp(1.2j), True)])
def test_path_against_newton_in_thirty_digits(n: int, q: complex, odd: bool) -> None:
    """The same ray in 150 equal steps, Newton's method on the determinant in 30 digits, secant predictor."""
    first = (n % 2) or (2 if odd else 0)
    rows = int(25 + 1.7 * abs(q) ** 0.5 + n / 2)
    with mpmath.workdps(30):
        before = value = mpmath.mpf(n * n)
        for step in range(1, 151):
            x = mpmath.mpc(complex(q)) * step / 150
            guess = 2 * value - before if step > 2 else value
            for _ in range(40):
                pivot, slope = first**2 + ((-x if odd else x) if n % 2 else 0) - guess, mpmath.mpf(-1)
                total = slope / pivot
                for k in range(1, rows):
                    e2 = x * x * (2 if k == 1 and first == 0 else 1)
                    pivot, slope = (first + 2 * k) ** 2 - guess - e2 / pivot, -1 + e2 / pivot**2 * slope
                    total += slope / pivot
                guess -= 1 / total
                if abs(1 / total) < 1e-18 * abs(guess):
                    break
            before, value = value, guess
    assert abs(VALUE["b" if odd else "a"](n, complex(q)) - complex(value)) < 1e-12 * abs(q)


def test_conjugate_symmetry() -> None:
    q = 3 + 4j
    assert abs(mathieu_a(3, q) - np.conj(mathieu_a(3, np.conj(q)))) < 1e-12
    assert abs(mathieu_b(3, -q) - mathieu_a(3, q)) < 1e-12


def test_no_heavy_imports() -> None:
    """The road from q to a tongue edge and an exponent needs numpy only."""
    code = (
        "import sys, stability as st; st.mathieu_a(3, 2.0), st.mathieu_b(3, 2j), st.mathieu_exponent(1.0, 2.0); "
        "sys.exit(any(name in sys.modules for name in ('scipy', 'numba', 'sympy', 'matplotlib')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=120).returncode == 0


# ---- errors --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "fragment"),
    [
        (lambda: mathieu_a(1.5, 1.0), "no integer"),
        (lambda: mathieu_a(float("nan"), 1.0), "no integer"),
        (lambda: mathieu_a("two", 1.0), "no integer"),
        (lambda: mathieu_a(-1, 1.0), "out of range"),
        (lambda: mathieu_a(500, 1.0), "499"),
        (lambda: mathieu_b(0, 1.0), "there is no b_0"),
        (lambda: mathieu_a(1, float("nan")), "NaN"),
        (lambda: mathieu_a(1, np.array([1.0, np.inf])), "infinity"),
        (lambda: mathieu_a(1, 1.1e6), "too large"),
        (lambda: mathieu_a(1, 501j), "too large"),
        (lambda: mathieu_a(1, "q"), "no number"),
    ],
)
def test_bad_input_is_named(call, fragment: str) -> None:
    with pytest.raises(InputError, match=fragment):
        call()
