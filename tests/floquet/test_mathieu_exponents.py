"""Characteristic exponents against 30-digit values (power series in mpmath), closed forms and their own inverse."""

from __future__ import annotations

import csv
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as some

from stability.errors import ConvergenceError, InputError
from stability.floquet.exponents import mathieu_a_of_exponent, mathieu_exponent
from stability.floquet.mathieu import mathieu_a, mathieu_b
from stability.kernels.double_double import add, exact_product, multiply

DATA = Path(__file__).parents[1] / "data" / "mathieu_exponents.csv"


def table(where: str) -> tuple[np.ndarray, np.ndarray, list]:
    with DATA.open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["where"].startswith(where)]
    values = [(mpmath.mpf(row["real"]), mpmath.mpf(row["imaginary"])) for row in rows]
    return np.array([float(row["a"]) for row in rows]), np.array([float(row["q"]) for row in rows]), values


@pytest.mark.parametrize(
    ("where", "least"), [("scattered", 80), ("large", 7), ("edge 1e-09", 30), ("edge -1e-09", 30), ("edge 1e-12", 30)]
)
def test_thirty_digit_table(where: str, least: int) -> None:
    """Issue A: 1e-12 absolute, also 1e-9 from a tongue edge (and 1e-12 from it: the table has that, too)."""
    a, q, values = table(where)
    assert len(values) >= least
    nu = mathieu_exponent(a, q)
    error = [
        max(abs(mpmath.mpf(float(v.real)) - real), abs(mpmath.mpf(float(v.imag)) - imaginary))
        for v, (real, imaginary) in zip(nu, values, strict=True)
    ]
    assert max(error) <= 1e-12


def test_free_equation() -> None:
    """q = 0: nu = sqrt(a), i sqrt(-a)."""
    a = np.array([0.0, 0.3, 1.0, 4.0, 6.25, 100.0, 12345.6])
    assert np.allclose(mathieu_exponent(a, 0.0), np.sqrt(a), rtol=1e-14, atol=0)
    assert np.allclose(mathieu_exponent(-a, 0.0), 1j * np.sqrt(a), rtol=1e-14, atol=0)


def test_perturbation_series() -> None:
    """DLMF 28.15.1: a = nu^2 + q^2/(2 (nu^2 - 1)) + (5 nu^2 + 7) q^4/(32 (nu^2-1)^3 (nu^2-4)) + O(q^6)."""
    nu, q = np.array([0.37, 1.5, 2.61])[:, None], np.array([0.02, 0.05])
    w = nu**2
    series = w + q**2 / (2 * (w - 1)) + (5 * w + 7) * q**4 / (32 * (w - 1) ** 3 * (w - 4))
    assert np.max(np.abs(mathieu_a_of_exponent(nu, q) - series)) < 5 * 0.05**6
    assert np.max(np.abs(mathieu_exponent(series, q) - nu)) < 5 * 0.05**6


@settings(max_examples=100, deadline=None)
@given(some.floats(0.0, 60.0), some.floats(-300.0, 300.0))
@example(5.00390625, 1.0)
def test_inverse(nu: float, q: float) -> None:
    """nu -> a -> nu; compared in a, where the problem is well conditioned (thin bands are not resolved in nu)."""
    a = mathieu_a_of_exponent(nu, q)
    again = mathieu_exponent(a, q)
    scale = max(abs(a), abs(q), 1.0)
    slope = (mathieu_exponent(a + 1e-6 * scale, q).real - mathieu_exponent(a - 1e-6 * scale, q).real) / (2e-6 * scale)
    at_edge = np.sqrt(8e-16 * scale * max(slope, 1.0) * 10)
    assert abs(again.real - nu) <= at_edge + 1.0 * (abs(q) > 2 * nu**2)
    if again.imag == 0:
        assert abs(mathieu_a_of_exponent(again.real, q) - a) <= 4e-15 * max(scale, nu * nu)


def test_neighbours_in_a_narrow_gap_are_not_confused() -> None:
    """nu = 5 + d and 5 - d are two eigenvalues of one matrix, close for small d: the index decides which is which."""
    for nu in (5.00390625, 4.99609375, 5.0001, 4.9999, 7.00001):
        for q in (0.0, 0.5, 1.0, 2.0):
            a = mathieu_a_of_exponent(nu, q)
            assert abs(mathieu_exponent(a, q) - nu) < 1e-9, (nu, q)


def test_integer_order_is_the_upper_edge() -> None:
    n, q = np.arange(9), 7.5
    assert np.max(np.abs(mathieu_a_of_exponent(n, q) - mathieu_a(n, q))) < 4e-15 * 64
    # from below: b_n, with the square root law of the edge
    below = mathieu_a_of_exponent(n[1:4] - 1e-6, q)
    assert np.max(np.abs(below - mathieu_b(n[1:4], q))) < 1e-9


def test_unfolding_is_monotone_and_continuous() -> None:
    """Re nu never decreases in a, stands still in tongues, and meets integers at a_n and b_n."""
    for q in (0.3, 1.0, 2.0):
        a = np.linspace(-2 * q - 1, 60, 4001)
        nu = mathieu_exponent(a, q)
        assert np.all(np.diff(nu.real) >= 0) and np.max(np.diff(nu.real)) < 0.5
        growing = nu.imag > 0
        assert np.all(nu.real[growing] == np.round(nu.real[growing]))
        n = np.arange(1, 6)
        inside = mathieu_exponent(0.5 * (mathieu_a(n, q) + mathieu_b(n, q)), q)
        assert np.all(inside.real == n) and np.all(inside.imag > 0)
        assert np.all(nu.imag >= 0)


def test_below_the_first_tongue() -> None:
    """nu = i y below a_0: the inverse by bisection returns to y."""
    y = np.array([1e-3, 0.5, 3.0, 40.0])
    a = mathieu_a_of_exponent(1j * y, 2.0)
    assert np.allclose(mathieu_exponent(a, 2.0), 1j * y, rtol=1e-9, atol=0) and np.all(a < mathieu_a(0, 2.0))


def test_large_arguments_stay_right() -> None:
    """Deep in the first tongue: WKB, Im nu = (1/pi) int_0^pi sqrt(2 q cos 2z - a) dz, relative error O(1/|a|)."""
    a, q = -3.1e6, 1e6
    z = (np.arange(2000) + 0.5) * np.pi / 2000
    wkb = np.mean(np.sqrt(2 * q * np.cos(2 * z) - a))
    assert abs(mathieu_exponent(a, q).imag / wkb - 1) < 1e-6
    assert mathieu_exponent(a, q).real == 0.0
    # above the barrier, same integral for Re nu
    a = 3.1e6
    wkb = np.mean(np.sqrt(a - 2 * q * np.cos(2 * z)))
    assert abs(mathieu_exponent(a, q).real / wkb - 1) < 1e-6


def test_exponents_at_bands_thinner_than_rounding() -> None:
    """q = 1e6: at a_7, as a double, nu is in the tongue or in the band next to it, and nothing fails."""
    a = mathieu_a(7, 1e6)
    nu = mathieu_exponent(np.array([a - 500.0, a + 500.0]), 1e6)
    assert np.all(nu.real == [7.0, 8.0])


def test_complex_arguments() -> None:
    """cos(pi nu) is half the trace, to 30 digits by complex power series."""
    with DATA.open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["where"] == "complex cosine"]
    assert len(rows) == 4
    for row in rows:
        nu = mathieu_exponent(complex(row["a"]), complex(row["q"]))
        cosine = complex(float(row["real"]), float(row["imaginary"]))
        assert abs(np.cos(np.pi * nu) - cosine) < 3e-14 * max(abs(cosine), 1)
        assert 0 <= nu.real <= 1


def test_complex_dtype_agrees_with_real() -> None:
    """The principal value of a real point is the unfolded one, folded."""
    a, q = np.array([0.3, 2.0, 5.5, 1.0, -3.0]), np.array([0.1, 1.0, 0.7, 0.5, 2.0])
    unfolded, principal = mathieu_exponent(a, q), mathieu_exponent(a + 0j, q)
    folded = np.abs(unfolded.real - 2 * np.round(unfolded.real / 2))
    assert np.allclose(principal.real, folded, atol=1e-13) and np.allclose(np.abs(principal.imag), unfolded.imag, atol=1e-13)


def test_double_double_products_are_exact() -> None:
    """Against integers in Python: 53 x 53 bits fit in 106."""
    x, y = np.array([float(2**53 - 1), 94906267.0]), np.array([float(2**53 - 3), 3.0])
    high, low = exact_product(x, y)
    assert [int(h) + int(e) for h, e in zip(high, low, strict=True)] == [int(u) * int(v) for u, v in zip(x, y, strict=True)]
    with mpmath.workdps(60):
        third = np.array(1 / 3), np.array(float(mpmath.mpf(1) / 3 - mpmath.mpf(1 / 3)))
        square = multiply(third, third)
        assert abs(mpmath.mpf(float(square[0])) + float(square[1]) - mpmath.mpf(1) / 9) < 1e-31
        rest = add(square, (np.array(-1 / 9), np.array(0.0)))
        assert abs(mpmath.mpf(float(rest[0])) + float(rest[1]) - (mpmath.mpf(1) / 9 - mpmath.mpf(1 / 9))) < 1e-31


@pytest.mark.parametrize(
    ("call", "fragment"),
    [
        (lambda: mathieu_exponent(float("nan"), 1.0), "NaN"),
        (lambda: mathieu_exponent(1.0, 2e6), "too large"),
        (lambda: mathieu_exponent(5e6, 2.0), "too large"),
        (lambda: mathieu_exponent("a", 2.0), "no number"),
        (lambda: mathieu_a_of_exponent(501.0, 2.0), "too large"),
        (lambda: mathieu_a_of_exponent(1 + 0.1j, 2.0), "inside a tongue"),
        (lambda: mathieu_a_of_exponent(1.5, 2j), "real q"),
    ],
)
def test_bad_input_is_named(call, fragment: str) -> None:
    with pytest.raises(InputError, match=fragment):
        call()


def test_complex_arguments_beyond_double_precision_are_refused() -> None:
    """Never silently wrong: the Wronskian tells, and the error carries by how much."""
    with pytest.raises(ConvergenceError, match="Wronskian") as caught:
        mathieu_exponent(3000.0 + 0j, 1000j)
    assert caught.value.defect > 1e-9 and caught.value.q == 1000j
