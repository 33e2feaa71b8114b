"""Tables: polynomials reproduced exactly, derivative and antiderivative inverse to each other, data round trip, refusals."""

import json
import pickle

import numpy as np
import pytest
import sympy as sp

from stability.errors import ConvergenceError, InputError
from stability.systems.evaluators import evaluator
from stability.systems.system import System
from stability.systems.tables import Table, TableFunction

x, v = sp.symbols("x v", real=True)


def test_quintic_reproduces_a_polynomial_of_degree_five_with_three_derivatives():
    grid = np.linspace(-1, 2, 10)
    polynomial = np.polynomial.Polynomial([1, -2, 0.5, 3, -1, 0.25])
    table = Table.from_samples("p", grid, polynomial(grid))
    at = np.linspace(-1, 2, 301)
    for order in range(4):
        np.testing.assert_allclose(table.evaluate(at, order), polynomial.deriv(order)(at), atol=1e-10)


def test_quintic_is_smooth_across_breakpoints():
    """C^4: value and four derivatives from the left and right of each inner breakpoint agree."""
    grid = np.linspace(0, 3, 12)
    table = Table.from_samples("s", grid, np.sin(3 * grid))
    for order, tolerance in zip(range(5), (1e-14, 1e-12, 1e-11, 1e-9, 1e-7)):
        f = table.derivative(order)
        inner = f.breakpoints[1:-1]
        left, right = f.evaluate(np.nextafter(inner, -9)), f.evaluate(inner)
        assert np.max(np.abs(left - right)) < tolerance * 3.0**order


def test_monotone_stays_monotone_and_hits_the_samples():
    xs, ys = np.array([0, 1, 2, 3, 5.0]), np.array([0, 0, 1, 10, 10.0])
    table = Table.from_samples("m", xs, ys, method="monotone")
    np.testing.assert_allclose(table.evaluate(xs), ys, atol=1e-14)
    fine = table.evaluate(np.linspace(0, 5, 1001))
    assert np.all(np.diff(fine) >= -1e-14) and fine.min() >= 0 and fine.max() <= 10 + 1e-14


def test_function_within_the_stated_error():
    """1000 points that the constructor did not look at."""

    def force(s):
        return 1 / (1 + s**2) ** 2

    table = Table.from_function("magnet", force, (-4, 4), tolerance=1e-9)
    at = np.random.default_rng(0).uniform(-4, 4, 1000)
    assert 0 < table.fit_error <= 1e-9
    assert np.max(np.abs(table.evaluate(at) - force(at))) <= 1.5 * table.fit_error
    assert np.max(np.abs(table.evaluate(at, 1) + 4 * at / (1 + at**2) ** 3)) < 1e-6


def test_a_kink_cannot_be_fitted():
    with pytest.raises(ConvergenceError, match="kink") as caught:
        Table.from_function("kink", lambda s: np.abs(s - 0.1234), (-1, 1), max_pieces=256)
    assert caught.value.error > 0


def test_antiderivative_is_exact():
    """Its derivative is the table bit for bit (up to one rounding), it is continuous, and it is the integral."""
    table = Table.from_function("bell", lambda s: np.exp(-(s**2)), (-3, 3), tolerance=1e-10)
    integral = table.antiderivative()
    at = np.linspace(-5, 5, 1001)
    np.testing.assert_allclose(integral.evaluate(at, 1), table.evaluate(at), rtol=1e-15, atol=1e-18)
    assert integral.evaluate(-3.0) == 0.0
    from math import erf, pi, sqrt

    assert integral.evaluate(3.0) == pytest.approx(sqrt(pi) * erf(3.0), abs=1e-9)
    inner = integral.breakpoints[1:]
    np.testing.assert_allclose(integral.evaluate(np.nextafter(inner, -9)), integral.evaluate(inner), atol=1e-14)


@pytest.mark.parametrize("method", ["quintic", "monotone"])
def test_linear_extrapolation_continues_value_and_slope(method):
    grid = np.linspace(0, 2, 9)
    table = Table.from_samples("e", grid, grid**3, method=method)
    slope = float(table.evaluate(2.0, 1))
    assert table.evaluate(3.0) == pytest.approx(8.0 + slope, rel=1e-12)
    assert table.evaluate(7.0, 1) == pytest.approx(slope, rel=1e-12)
    assert table.evaluate(7.0, 2) == 0.0 and table.evaluate(-7.0, 3) == 0.0
    assert table.evaluate(-1.0) == pytest.approx(-float(table.evaluate(0.0, 1)), abs=1e-12)


def test_nan_outside_on_request_in_every_back_end():
    grid = np.linspace(0, 2, 9)
    table = Table.from_samples("e", grid, grid**3, extrapolate="nan")
    assert np.isnan(table.evaluate([-0.1, 2.1])).all() and np.isnan(table.evaluate(2.1, 3))
    assert table.evaluate(2.0) == pytest.approx(8.0) and table.evaluate(0.0) == pytest.approx(0.0, abs=1e-14)
    system = System("t", ("x", "v"), ("x", "v"), {}, (v, -table(x)))
    for backend in ("llvm", "lambdify"):
        F, J = evaluator(system, backend).FJ(None, [[2.1, 0.0], [2.0, 0.0], [-1e-9, 0.0]], [])
        assert np.isnan(F[[0, 2], 1]).all() and np.isnan(J[[0, 2], 1, 0]).all() and F[1, 1] == pytest.approx(-8.0)


def test_lookup_at_and_around_every_breakpoint_is_the_same_in_machine_code():
    """Bisection in machine code against searchsorted, at breakpoints, their neighbours and far outside."""
    breaks = np.array([-1.0, -0.3, 0.2, 0.7, 4.0])
    table = Table("jagged", breaks, np.random.default_rng(1).normal(size=(4, 4)))
    at = np.concatenate([breaks, np.nextafter(breaks, 9), np.nextafter(breaks, -9), [-1e9, 1e9, np.nan, np.inf]])
    system = System("t", ("x", "v"), ("x", "v"), {}, (v, table(x)))
    F = evaluator(system, "llvm").F(None, np.stack([at, np.zeros_like(at)], axis=1), [])
    np.testing.assert_array_equal(F[:, 1], table.evaluate(at))


def test_derivatives_end_in_zero_and_keep_nan():
    table = Table("line", [0.0, 1.0], [[1.0, 2.0]])
    assert table.evaluate(0.5, 1) == 2.0 and table.evaluate(0.5, 2) == 0.0 and table.evaluate(0.5, 5) == 0.0
    assert np.isnan(table.evaluate(np.nan, 1)) and np.isnan(table.evaluate(np.nan, 3))
    system = System("t", ("x", "v"), ("x", "v"), {}, (v, table.derivative()(x)))
    assert np.isnan(evaluator(system).F(None, [[np.nan, 0.0]], [])[0, 1])


def test_equality_hash_and_round_trip():
    grid = np.linspace(0, 1, 8)
    one, two = (Table.from_samples("f", grid, np.exp(grid)) for _ in range(2))
    assert one == two and hash(one) == hash(two) and one(x) == two(x) and isinstance(one(x), TableFunction)
    other = Table.from_samples("f", grid, np.exp(2 * grid))
    assert one != other and one(x) != other(x) and one(x) - two(x) == 0 and one(x) - other(x) != 0
    for table in (one, one.derivative(), one.antiderivative(), Table("g", [0, 1], [[1, 2]], extrapolate="nan")):
        assert Table.from_dict(json.loads(json.dumps(table.to_dict()))) == table
    assert one(sp.Float(0.5)).evalf() == pytest.approx(float(one.evaluate(0.5)), rel=1e-15)


def test_applied_tables_can_be_pickled():
    """Their classes are made at run time, so pickling goes through the table."""
    table = Table("f", [0.0, 1.0], [[1.0, 2.0]])
    expression = x * table(x**2) + table.derivative()(x)
    assert pickle.loads(pickle.dumps(expression)) == expression  # noqa: S301 - own bytes


def test_system_with_a_table_is_data():
    grid = np.linspace(-2, 2, 21)
    table = Table.from_samples("spring", grid, np.sinh(grid))
    system = System("t", ("x", "v"), ("x", "v"), {"k": 2.0}, (v, -sp.Symbol("k", real=True) * table(x)))
    again = System.from_dict(json.loads(json.dumps(system.to_dict())))
    assert again == system and evaluator(again) is evaluator(system)
    J = evaluator(again).FJ(None, [[0.4, 0.0]], [2.0])[1]
    assert J[0, 1, 0] == pytest.approx(-2 * np.cosh(0.4), abs=1e-5)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Table("two words", [0, 1], [[1.0]]),
        lambda: Table("f", [1, 0], [[1.0]]),
        lambda: Table("f", [0, np.nan], [[1.0]]),
        lambda: Table("f", [0, 1], [[1.0], [2.0]]),
        lambda: Table("f", [0, 1], [[np.inf]]),
        lambda: Table("f", [0, 1], [[1.0]], extrapolate="constant"),
        lambda: Table.from_samples("f", [0, 1, 2], [0, 1, 2]),
        lambda: Table.from_samples("f", [0, 2, 1], [0, 1, 2], method="monotone"),
        lambda: Table.from_samples("f", [0, 1], [0, 1], method="cubic"),
        lambda: Table.from_samples("f", [0, 1, 2], [0, 1], method="monotone"),
        lambda: Table.from_function("f", np.log, (-1, 1)),
        lambda: Table.from_function("f", np.sin, (1, 1)),
        lambda: Table.from_function("f", np.sin, (0, 1), tolerance=0.0),
        lambda: Table.from_dict({"name": "f"}),
        lambda: Table.from_dict({"name": "f", "breakpoints": [0, 1], "rows": [[1], [2]], "extrapolate": "nan"}),
        lambda: Table.from_dict({"name": "f", "breakpoints": [0, 1], "rows": [[1], ["x"], [1]], "extrapolate": "nan"}),
    ],
)
def test_bad_tables_are_refused(make):
    with pytest.raises(InputError), np.errstate(all="ignore"):
        make()
