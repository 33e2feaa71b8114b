"""Machine code against numpy against mpmath: every function, random expressions, and all derivatives.

Three witnesses: the numpy back end (whole expressions, whole-expression derivatives, sympy's code printer), mpmath's
evaluation and numerical derivatives in 40 digits, and differences of the next lower derivative.
"""

import sys
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as hs

from stability.errors import CompileError
from stability.systems import _machine, evaluators
from stability.systems.evaluators import evaluator
from stability.systems.system import System
from stability.systems.tables import Table

x, v, a, b, Omega, t = sp.symbols("x v a b Omega t", real=True)
BELL = Table.from_function("bell", lambda s: np.exp(-(s**2)), (-3, 3), tolerance=1e-10)
MISNAMED = Table("sin", [-1.0, 0.0, 1.0], [[1.0, 2.0, 0.5], [3.0, -1.0, 0.0]])
STEPS = Table.from_samples("steps", [-2, -1, 0.5, 2], [0, 1, 1.5, 4], method="monotone")

FUNCTIONS = {
    "sum": x + v - 2 * a, "product": x * v * a / b, "quotient": (x - 1) / (v**2 + b), "rational": sp.Rational(2, 3) * x,
    "powers": x**2 + x**7 - v**13 / 50 + (1 + x**2) ** -3, "high power": x**50 / 1000, "beyond product powers": x**65,
    "float power": (1 + x**2) ** 1.7, "half powers": (1 + x**2) ** sp.Rational(5, 2) + (2 + v**2) ** sp.Rational(-3, 2),
    "parameter power": sp.Abs(x) ** (a + 1), "sqrt": sp.sqrt(1 + x**2), "exp": sp.exp(-x) + sp.exp(v / 3),
    "log": sp.log(2 + x**2), "sin": sp.sin(3 * x), "cos": sp.cos(x - v), "tan": sp.tan(x / 2), "asin": sp.asin(x / 4),
    "acos": sp.acos(x / 4), "atan": sp.atan(x * v), "atan2": sp.atan2(x, v), "sinh": sp.sinh(x), "cosh": sp.cosh(x),
    "tanh": sp.tanh(x), "asinh": sp.asinh(x), "acosh": sp.acosh(2 + x**2), "atanh": sp.atanh(x / 4),
    "sec": sp.sec(x / 4), "csc": sp.csc(4 + x / 4), "cot": sp.cot(4 + x / 4), "sech": sp.sech(x),
    "csch": sp.csch(4 + x), "coth": sp.coth(4 + x), "abs": sp.Abs(x * v), "sign": sp.sign(x) * v,
    "heaviside": sp.Heaviside(x - v) * x, "heaviside value": sp.Heaviside(x, 0) + v, "max": sp.Max(x, v, a) ** 2,
    "min": sp.Min(x, v, 0.3) * b, "mod": sp.Mod(x, 0.7) + sp.Mod(x, -0.3), "floor": sp.floor(3 * x) * v,
    "ceiling": sp.ceiling(3 * x) * v, "frac": sp.frac(x) * v, "power law": sp.sign(x) * sp.Abs(x) ** 1.5 * b,
    "piecewise": sp.Piecewise((x**2, x > 0.5), (sp.log(-x), (x < -0.5) & (v > 0)), (v, True)),
    "piecewise or": sp.Piecewise((x, (x > v) | ~(v >= a)), (v * b, sp.Ne(x, a)), (0, True)),
    "piecewise equality": sp.Piecewise((x, sp.Eq(sp.floor(x), 0)), (v**2, x <= 0), (x * v, True)),
    "table": BELL(x) * v + BELL(4 * v), "monotone table": STEPS(2 * x) * a, "constants": sp.pi * x + sp.E * v,
    "forcing": sp.cos(Omega * t) * x + sp.sin(3 * Omega * t + a) * t,
}  # fmt: skip


def system_of(*rhs, forced=True, **options):
    parameters = {"a": 0.4, "b": 1.3, "Omega": 2.0}
    period = 2 * sp.pi / Omega if forced else None
    names = ("x", "v", "y", "z")[: len(rhs)]
    return System("trial", names, names, parameters, rhs, period_expression=period, **options)


def points(N=40, n=2, seed=1):
    rng = np.random.default_rng(seed)
    return rng.random(N), rng.normal(size=(N, n)), np.array([0.4, 1.3, 2.0])


def close(got, want, tolerance=1e-13):
    """Relative to the largest value over the points, entry by entry; NaN must match NaN."""
    scale = np.nanmax(np.abs(want), axis=0, initial=1.0)
    np.testing.assert_array_equal(np.isnan(got), np.isnan(want))
    assert np.nanmax(np.abs(got - want) / scale, initial=0.0) < tolerance


@pytest.mark.parametrize("name", FUNCTIONS)
def test_both_back_ends_agree(name):
    """Values, Jacobians, parameter derivatives, second and third directional derivatives."""
    system = system_of(v, FUNCTIONS[name])
    phase, X, P = points()
    U, V, W = np.random.default_rng(2).normal(size=(3, len(X), 5))
    one, other = evaluator(system, "llvm"), evaluator(system, "lambdify")
    assert (one.backend, other.backend) == ("llvm", "lambdify")
    for got, want in zip(one.FJP(phase, X, P), other.FJP(phase, X, P), strict=True):
        close(got, want)
    for got, want in zip(one.FJ(phase, X, P), one.FJP(phase, X, P)[:2], strict=True):
        close(got, want, 1e-15)
    np.testing.assert_array_equal(one.F(phase, X, P), one.FJ(phase, X, P)[0])
    close(one.second(phase, X, P, V, W), other.second(phase, X, P, V, W), 1e-12)
    close(one.third(phase, X, P, U, V, W), other.third(phase, X, P, U, V, W), 1e-12)


SMOOTH = [name for name in FUNCTIONS if name not in ("table", "monotone table", "misnamed table", "mod", "frac")]


@pytest.mark.parametrize("name", SMOOTH)
def test_values_and_gradient_against_mpmath(name):
    """Witness: mpmath in 40 digits, the derivative over x and over Omega at fixed phase as difference quotients."""
    system = system_of(v, FUNCTIONS[name])
    phase, X, P = points(6, seed=3)
    F, J, Fp = evaluator(system, "llvm").FJP(phase, X, P)
    function = sp.lambdify((x, v, a, b, Omega, t), FUNCTIONS[name], "mpmath")

    def exact(s, state, velocity, frequency):
        return mpmath.mpf(
            mpmath.re(
                function(state, velocity, mpmath.mpf(P[0]), mpmath.mpf(P[1]), frequency, s * 2 * mpmath.pi / frequency)
            )
        )

    with mpmath.workdps(40):
        h = mpmath.mpf(10) ** -14
        for k in range(len(X)):
            s, state, velocity, frequency = (mpmath.mpf(float(q)) for q in (phase[k], *X[k], P[2]))
            value = exact(s, state, velocity, frequency)
            slope = (exact(s, state + h, velocity, frequency) - exact(s, state - h, velocity, frequency)) / (2 * h)
            over_frequency = (exact(s, state, velocity, frequency + h) - exact(s, state, velocity, frequency - h)) / (
                2 * h
            )
            scale = max(1.0, abs(float(value)), abs(float(slope)))
            assert abs(F[k, 1] - float(value)) < 2e-14 * scale
            assert abs(J[k, 1, 0] - float(slope)) < 1e-13 * scale
            assert abs(Fp[k, 1, 2] - float(over_frequency)) < 1e-13 * max(scale, abs(float(over_frequency)))


SYMBOLS = [x, v, a, b]
BOUNDED = [sp.sin, sp.cos, sp.tanh, sp.atan, sp.Abs, sp.sign, sp.Heaviside]
POSITIVE = [
    lambda e: sp.sqrt(1 + e**2),
    lambda e: sp.log(2 + e**2),
    lambda e: 1 / (1 + e**2),
    lambda e: sp.exp(-(e**2)),
]
leaves = hs.sampled_from(SYMBOLS) | hs.integers(-3, 3).map(sp.Integer) | hs.sampled_from([0.5, 1.7, -0.3]).map(sp.Float)


def grow(inner):
    pair = hs.tuples(inner, inner)
    return (
        hs.tuples(hs.sampled_from(BOUNDED + POSITIVE), inner).map(lambda q: q[0](q[1]))
        | pair.map(lambda q: q[0] + q[1])
        | pair.map(lambda q: q[0] * q[1])
        | pair.map(lambda q: sp.Max(*q))
        | pair.map(lambda q: sp.Min(*q))
        | hs.tuples(inner, hs.sampled_from([2, 3, 5])).map(lambda q: q[0] ** q[1])
        | hs.tuples(inner, inner, inner).map(lambda q: sp.Piecewise((q[0], q[1] > q[2]), (q[2], True)))
        | inner.map(lambda e: sp.sign(e) * sp.Abs(e) ** 1.5)
    )


@given(hs.recursive(leaves, grow, max_leaves=8))
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
def test_random_expressions_agree(expression):
    """Both back ends within 1e-13 of each other, relative to what an input error of 1e-13 does to the values."""
    system = SimpleNamespace(
        states=("x", "v"), parameters={"a": 0.4, "b": 1.3}, rhs=(v, expression), period_expression=None, outputs={},
        breaks=(), function=None,
    )  # fmt: skip
    _, X, P = points(20, seed=4)
    P = P[:2]
    one, other = evaluator(system, "llvm"), evaluator(system, "lambdify")
    nearby = X * (1 + 1e-13)
    got_all, want_all = one.FJP(None, X, P), other.FJP(None, X, P)
    for got, want, moved in zip(got_all, want_all, other.FJP(None, nearby, P * (1 + 1e-13)), strict=True):
        np.testing.assert_array_equal(np.isfinite(got), np.isfinite(want))
        finite = np.isfinite(want) & np.isfinite(moved)
        allowed = 1e-13 * np.maximum(1.0, np.abs(want)) + 10 * np.abs(moved - want)
        assert np.all((np.abs(got - want) <= allowed)[finite])


@pytest.mark.parametrize("name", ["forcing", "powers", "atan2", "parameter power", "table", "piecewise", "exp"])
@pytest.mark.parametrize("backend", ["llvm", "lambdify"])
def test_directional_derivatives_against_differences_of_the_jacobian(name, backend):
    """D2F[V, W] is the slope along W of J V (Fp included); D3F[U, V, W] the slope along U of D2F[V, W]."""
    system = system_of(v, FUNCTIONS[name])
    e = evaluator(system, backend)
    phase, X, P = points(12, seed=5)
    X += 0.5 * np.sign(X)  # away from kinks, where a difference quotient means nothing
    U, V, W = np.random.default_rng(6).normal(size=(3, len(X), 5))

    def first(shift):
        Z = np.hstack([X, np.tile(P, (len(X), 1))]) + shift
        _, J, Fp = e.FJP(phase, Z[:, :2].copy(), Z[:, 2:].copy())
        return np.einsum("kij,kj->ki", np.concatenate([J, Fp], axis=2), V)

    def second(shift):
        Z = np.hstack([X, np.tile(P, (len(X), 1))]) + shift
        return e.second(phase, Z[:, :2].copy(), Z[:, 2:].copy(), V, W)

    h = 2e-4  # fourth-order quotient: truncation 1e-15, rounding 1e-12
    for lower, direction, value in (
        (first, W, e.second(phase, X, P, V, W)),
        (second, U, e.third(phase, X, P, U, V, W)),
    ):
        slope = (
            8 * (lower(h * direction) - lower(-h * direction)) - lower(2 * h * direction) + lower(-2 * h * direction)
        ) / (12 * h)
        assert np.max(np.abs(slope - value)) < 1e-8 * max(1.0, np.max(np.abs(value)))


def test_power_law_spring_has_finite_derivatives_at_rest():
    """Closed form: at x = 0 value and slope of sign(x)|x|^1.5 vanish, |x|^a log|x| too."""
    system = system_of(v, sp.sign(x) * sp.Abs(x) ** 1.5 + sp.Abs(x) ** (1 + a), forced=False)
    for backend in ("llvm", "lambdify"):
        F, J, Fp = evaluator(system, backend).FJP(None, np.zeros((3, 2)), [0.4, 1.3, 2.0])
        assert not F.any() and not Fp.any() and not J[:, 1].any()


CONTACTS = {
    "maximum": sp.Max(x - 1, 0) ** 1.5,
    "scaled": (b * sp.Max(x - 1, 0)) ** 1.5 / b**1.5,
    "piecewise": sp.Piecewise((x - 1, x > 1), (0, True)) ** 1.5,
    "modulus": sp.Abs(sp.Piecewise((x - 1, x > 1), (0, True))) ** 1.5,
    "parameter": sp.Max(x - 1, 0) ** (a + 1.1),
}


@pytest.mark.parametrize("name", CONTACTS)
@pytest.mark.parametrize("backend", ["llvm", "lambdify"])
def test_contact_law_out_of_contact(name, backend):
    """Hertz contact max(x - 1, 0)^(3/2): all derivatives are 0 at x < 1 (not 0 * inf), closed forms at x > 1."""
    e = evaluator(system_of(v, -CONTACTS[name] + sp.Max(x - 1, 0) * 0.2), backend)
    X, P = np.array([[0.4, 0.0], [1.36, 0.0]]), [0.4, 1.3, 2.0]
    along = np.array([1.0, 0, 0, 0, 0])
    F, J = e.FJ(0.0, X, P)
    second, third = e.second(0.0, X, P, along, along), e.third(0.0, X, P, along, along, along)
    np.testing.assert_allclose(F[:, 1], [0, -0.216 + 0.072], atol=1e-15)
    np.testing.assert_allclose(J[:, 1, 0], [0, -1.5 * 0.6 + 0.2], atol=1e-15)
    np.testing.assert_allclose(second[:, 1], [0, -0.75 / 0.6], rtol=1e-13)
    np.testing.assert_allclose(third[:, 1], [0, 0.375 / 0.216], rtol=1e-13)
    assert np.isfinite(e.FJP(0.0, X, P)[2]).all()


def test_nan_in_gives_nan_out():
    """No operation, not even a comparison, may turn NaN into a number silently (Max, Min, sign, tables, remainders)."""
    for name in ("max", "min", "sign", "heaviside", "mod", "floor", "table", "abs", "powers"):
        system = system_of(v, FUNCTIONS[name])
        for backend in ("llvm", "lambdify"):
            value = evaluator(system, backend).F(0.1, [[np.nan, 1.0]], [0.4, 1.3, 2.0])
            assert np.isnan(value[0, 1]), (name, backend)


def test_branch_not_taken_does_not_leak():
    """log of a negative number in the other branch leaves value and slope alone."""
    system = system_of(v, sp.Piecewise((sp.log(x), x > 0), (x, True)))
    for backend in ("llvm", "lambdify"):
        F, J = evaluator(system, backend).FJ(0.0, [[-2.0, 0.0]], [0.4, 1.3, 2.0])
        assert F[0, 1] == -2.0 and J[0, 1, 0] == 1.0


def stand_in(expression):
    return SimpleNamespace(
        states=("x",), parameters={}, rhs=(expression,), period_expression=None, outputs={}, breaks=(), function=None
    )


def test_a_function_nobody_knows_is_named():
    with pytest.raises(CompileError, match="besselj"):
        evaluator(stand_in(sp.besselj(0, x)))
    with pytest.raises(CompileError, match="besselj"):
        evaluator(stand_in(sp.besselj(0, x)), "llvm")


def test_fallback_when_machine_code_is_not_to_be_had(monkeypatch):
    """Without llvmlite, "auto" gives numpy and the same numbers; asking for "llvm" says what is missing."""
    expression = sp.sin(x) * x**3 + sp.Integer(17)
    want = evaluator(stand_in(expression), "llvm").FJ(None, [[0.7]], [])
    evaluators._CACHE.clear()
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)  # as if it were not installed
    _machine._started.cache_clear()
    fallback = evaluator(stand_in(expression))
    assert fallback.backend == "lambdify"
    for got, expected in zip(fallback.FJ(None, [[0.7]], []), want, strict=True):
        close(got, expected, 1e-15)
    with pytest.raises(CompileError, match="llvmlite"):
        evaluator(stand_in(expression + 1), "llvm")
    evaluators._CACHE.clear()
