"""Python functions as systems: differences against the exact derivatives of the same equations, and their error estimate."""

import ctypes

import numpy as np
import pytest
import sympy as sp

from stability.errors import EquationError, InputError
from stability.systems.evaluators import evaluator
from stability.systems.system import System

Omega = sp.Symbol("Omega", real=True)
NATIVE = ctypes.CFUNCTYPE(
    None, ctypes.c_int64, *[ctypes.c_void_p] * 3, ctypes.c_int64, *[ctypes.c_void_p] * 3
)  # fmt: skip


def rates(t, x, *, a=1.3, b=0.2, Omega=2.0):
    q, w = x
    return np.stack([w, -a * q - b * np.exp(q) * w + np.cos(Omega * t) * q**2 + t / 9])


def equations():
    q, w, a, b, t = sp.symbols("q w a b t", real=True)
    rhs = (w, -a * q - b * sp.exp(q) * w + sp.cos(Omega * t) * q**2 + t / 9)
    parameters = {"a": 1.3, "b": 0.2, "Omega": 2.0}
    return System("same", ("q", "w"), ("q", "w"), parameters, rhs, period_expression=2 * sp.pi / Omega)


FUNCTION = System.from_function(rates, "q w", period=2 * sp.pi / Omega)
EXACT = evaluator(equations(), "llvm")


def points(N=25, seed=1):
    rng = np.random.default_rng(seed)
    return rng.random(N), rng.normal(size=(N, 2)), np.array([1.3, 0.2, 2.0])


def test_values_and_differences_against_the_equations():
    e = evaluator(FUNCTION)
    assert e.backend == "function" and e.forced and (e.n, e.m) == (2, 3)
    phase, X, P = points()
    F, J, Fp = e.FJP(phase, X, P)
    want = EXACT.FJP(phase, X, P)
    np.testing.assert_allclose(F, want[0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(J, want[1], rtol=0, atol=1e-10)
    np.testing.assert_allclose(Fp, want[2], rtol=0, atol=1e-10)
    own = np.tile(P, (len(X), 1))
    np.testing.assert_allclose(e.FJ(phase, X, own)[1], J, rtol=0, atol=1e-11)


def test_error_estimate_covers_the_true_error():
    e = evaluator(FUNCTION)
    phase, X, P = points(200, seed=2)
    want, got = EXACT.FJP(phase, X, P), e.FJP(phase, X, P)
    for estimate, a, b in zip(e.derivative_error(phase, X, P), got[1:], want[1:], strict=True):
        assert estimate.shape == a.shape
        assert np.all(np.abs(a - b) <= estimate) and np.max(estimate) < 1e-5


def test_error_estimate_shouts_at_a_kink():
    kinked = System.from_function(lambda t, x, *, k=1.0: -k * np.abs(x), "x")
    J_error, _ = evaluator(kinked).derivative_error(None, [[1e-5], [1.0]], [1.0])
    assert J_error[0, 0, 0] > 1e-2 and J_error[1, 0, 0] < 1e-8


def test_complex_step_is_exact_for_analytic_functions():
    e = evaluator(FUNCTION, derivatives="complex_step")
    assert e is not evaluator(FUNCTION)
    phase, X, P = points()
    for got, want in zip(e.FJP(phase, X, P), EXACT.FJP(phase, X, P), strict=True):
        np.testing.assert_allclose(got, want, rtol=0, atol=5e-15)


def test_directional_derivatives():
    """Against the machine code of the same equations; accuracy of differences, about eps^(2/3) and eps^(4/7)."""
    e = evaluator(FUNCTION)
    phase, X, P = points()
    U, V, W = np.random.default_rng(3).normal(size=(3, len(X), 5))
    second, third = EXACT.second(phase, X, P, V, W), EXACT.third(phase, X, P, U, V, W)
    assert np.max(np.abs(e.second(phase, X, P, V, W) - second)) < 1e-8 * np.max(np.abs(second))
    assert np.max(np.abs(e.third(phase, X, P, U, V, W) - third)) < 1e-6 * np.max(np.abs(third))
    np.testing.assert_array_equal(e.second(phase, X, P, 0 * V, W), np.zeros_like(X))


def test_period_and_its_gradient():
    e = evaluator(FUNCTION)
    P = np.array([1.3, 0.2, 2.0])
    assert e.period(P) == pytest.approx(np.pi, rel=1e-15)
    np.testing.assert_allclose(e.period_gradient(P), [0, 0, -np.pi / 2], atol=1e-15)
    np.testing.assert_allclose(
        e.period_gradient(np.stack([P, 2 * P])), [[0, 0, -np.pi / 2], [0, 0, -np.pi / 8]], atol=1e-11
    )


def test_period_given_as_a_python_function():
    """Same numbers as with the period as an expression, also with parameters of their own for every point."""
    other = evaluator(System.from_function(rates, "q w", period=lambda Omega: 2 * np.pi / Omega))
    phase, X, P = points(6)
    own = P * (1 + 0.1 * np.random.default_rng(4).random((6, 3)))
    for parameters in (P, own):
        for got, want in zip(other.FJP(phase, X, parameters), EXACT.FJP(phase, X, parameters), strict=True):
            np.testing.assert_allclose(got, want, rtol=0, atol=1e-10)
        np.testing.assert_allclose(other.period(parameters), EXACT.period(parameters), rtol=1e-15)
        np.testing.assert_allclose(other.period_gradient(parameters), EXACT.period_gradient(parameters), atol=1e-10)
    with pytest.raises(InputError, match="complex step"):
        evaluator(
            System.from_function(rates, "q w", period=lambda Omega: 2 * np.pi / Omega), derivatives="complex_step"
        )


def test_undeclared_time_dependence_is_refused():
    """A function that looks at t without a period would silently be frozen at t = 0."""
    system = System.from_function(lambda t, x, *, k=1.0: -k * x + np.cos(t), "x")
    with pytest.raises(EquationError, match="period"):
        evaluator(system).F(None, [[0.3]], [1.0])


def test_one_call_per_batch():
    """The function is called once, whatever the number of points and derivatives."""
    calls = []

    def counted(t, x, *, k=1.0):
        calls.append(x.shape)
        return [x[1], -k * x[0]]

    e = evaluator(System.from_function(counted, "x v"))
    e.F(None, [[0.0, 0.0]], [4.0])  # the first call of all looks twice, whether t matters
    calls.clear()
    J = e.FJP(None, np.zeros((10, 2)), [4.0])[1]
    assert len(calls) == 1 and calls[0] == (2, 10 * (4 * 3 + 1))
    np.testing.assert_allclose(J, np.tile([[0, 1], [-4, 0]], (10, 1, 1)), atol=1e-11)


def test_constant_rows_broadcast():
    e = evaluator(System.from_function(lambda t, x, *, k=1.0: [k, x[0]], "x v"))
    np.testing.assert_allclose(e.F(None, [[1.0, 2.0], [3.0, 4.0]], [5.0]), [[5, 1], [5, 3]])


def test_wrong_shape_of_the_result_is_explained():
    system = System.from_function(lambda t, x, *, k=1.0: [x[0], x[1]], "x v")
    wrong = system.replace(function=lambda t, x, *, k=1.0: np.zeros(7))
    with pytest.raises(InputError, match="state axis first"):
        evaluator(wrong).F(None, [[1.0, 2.0]], [1.0])
    with pytest.raises(InputError, match="'function'"):
        evaluator(system, "llvm")


def test_address_through_a_callback():
    e = evaluator(FUNCTION)
    phase, X, P = points(6)
    want = e.FJP(phase, X, P)
    got = [np.empty_like(array) for array in want]
    NATIVE(e.address("FJP"))(6, phase.ctypes.data, X.ctypes.data, P.ctypes.data, 0, *[a.ctypes.data for a in got])
    for one, other in zip(got, want, strict=True):
        np.testing.assert_array_equal(one, other)


def test_an_error_inside_a_callback_becomes_nan_and_is_kept():
    """An exception cannot cross the C border: the outputs must not keep stale numbers."""

    def touchy(t, x, *, k=1.0):
        if np.any(x > 10):
            raise ArithmeticError("too far")
        return -k * x

    e = evaluator(System.from_function(touchy, "x"))
    X, P, F = np.array([[11.0]]), np.array([1.0]), np.zeros((1, 1))
    NATIVE(e.address("F"))(1, None, X.ctypes.data, P.ctypes.data, 0, F.ctypes.data, None, None)
    assert np.isnan(F[0, 0]) and "too far" in str(e.callback_error)
