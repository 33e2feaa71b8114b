"""Derivative rules for non-smooth terms: against one-sided difference quotients in 40 digits and closed forms."""

import math

import mpmath
import numpy as np
import pytest
import sympy as sp

from stability.errors import CompileError
from stability.systems._lambdify import numpy_function
from stability.systems.expressions import PowerLog, differentiate
from stability.systems.tables import Table

x, y, p = sp.symbols("x y p", real=True)
FORBIDDEN = (sp.DiracDelta, sp.Derivative, sp.Subs)
EXPRESSIONS = [
    sp.sin(x) * sp.exp(-x * y), sp.cos(x * y) ** 3 / (1 + x**2), sp.tan(x / 3), sp.asin(x / 5), sp.acos(x / 5),
    sp.atan(x * y), sp.atan2(x, 1 + y**2), sp.sinh(x), sp.cosh(x - y), sp.tanh(x), sp.asinh(x), sp.acosh(2 + x**2),
    sp.atanh(x / 5), sp.log(1 + x**2), sp.sqrt(1 + x * x * y * y), (1 + x**2) ** y, sp.sec(x / 4), sp.csc(3 + x / 4),
    sp.cot(3 + x / 4), sp.sech(x), sp.csch(3 + x), sp.coth(3 + x), sp.Abs(x - y) ** 3, sp.Abs(x) * sp.sign(x - 2 * y),
    sp.sign(x) * sp.Abs(x) ** sp.Rational(5, 2), sp.Heaviside(x - y) * x**2, sp.Max(x, y**2, 0.3) * x,
    sp.Min(x * y, y - x), sp.floor(3 * x) * x**2, sp.Mod(x, 0.7) * y, sp.Mod(2.3, 1 + x**2),
    sp.Piecewise((x**3, x > y), (sp.sin(x), (x > -1) & (y < 1)), (x * y, True)), sp.frac(x) * x, sp.ceiling(x) * x,
]  # fmt: skip


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_derivative_against_high_precision_difference(expression):
    """Witness: mpmath's difference quotient in 40 digits, at points away from kinks."""
    function = sp.lambdify((x, y), expression, "mpmath")
    for px, py in [(0.61, 0.27), (-0.83, 0.41), (0.35, -1.2)]:
        with mpmath.workdps(40):
            at, step = mpmath.mpf(px), mpmath.mpf(10) ** -15
            truth = float(mpmath.diff(lambda a, b=py: function(a, mpmath.mpf(b)), at, h=step))
        value = float(numpy_function([x, y], [differentiate(expression, x)])(px, py)[0])
        assert value == pytest.approx(truth, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_derivatives_contain_nothing_that_cannot_be_evaluated(expression):
    for symbol in (x, y):
        first = differentiate(expression, symbol)
        assert not first.has(*FORBIDDEN)
        assert not differentiate(first, symbol).has(*FORBIDDEN)


def test_sign_and_heaviside_are_flat():
    for expression in (sp.sign(x * y), sp.Heaviside(x - 1), sp.floor(x)):
        assert differentiate(expression, x) == 0


def value_at(expression, **at):
    names = sorted(expression.free_symbols, key=str)
    with np.errstate(all="ignore"):
        return float(numpy_function(names, [expression])(*(np.float64(at[s.name]) for s in names))[0])


@pytest.mark.parametrize("power", [sp.Rational(3, 2), sp.Integer(2), sp.Float(2.5), sp.Integer(3), sp.Float(4.7), p])
def test_power_law_spring_at_rest(power):
    """d sign(x)|x|^p = p |x|^(p-1): the closed form, at 0 (where sympy's is NaN) and off it."""
    slope = differentiate(sp.sign(x) * sp.Abs(x) ** power, x)
    exponent = 1.5 if power == p else float(power)
    assert value_at(slope, x=0.0, p=exponent) == 0.0
    for at in (-1.3, 0.4):
        assert value_at(slope, x=at, p=exponent) == pytest.approx(exponent * abs(at) ** (exponent - 1), rel=1e-14)


def test_linear_limit_of_the_power_law():
    """At p = 1 the spring is linear with slope 1, also at rest."""
    assert value_at(differentiate(sp.sign(x) * sp.Abs(x) ** p, x), x=0.0, p=1.0) == 1.0


@pytest.mark.parametrize("power", [1.5, 2.5, 7 / 2])
def test_even_power_law_at_rest(power):
    slope = differentiate(sp.Abs(x) ** power, x)
    assert value_at(slope, x=0.0) == 0.0
    assert value_at(slope, x=-0.7) == pytest.approx(-power * 0.7 ** (power - 1), rel=1e-14)


def test_plain_power_at_zero():
    expression = x**p
    assert value_at(expression, x=0.0, p=1.5) == 0.0
    assert value_at(differentiate(expression, x), x=0.0, p=1.5) == 0.0
    assert value_at(differentiate(expression, p), x=0.0, p=1.5) == 0.0


def test_infinite_slope_stays_infinite():
    """sqrt|x| has a vertical tangent at 0: no finite number may be invented."""
    second = differentiate(differentiate(sp.sign(x) * sp.Abs(x) ** 1.5, x), x)
    assert not math.isfinite(value_at(second, x=0.0))


def test_power_over_its_exponent():
    """d|x|^p/dp = |x|^p log|x|, its own derivatives against mpmath; 0 at x = 0."""
    expression = sp.Abs(x) ** p
    mixed = differentiate(differentiate(expression, p), x)
    with mpmath.workdps(40):
        truth = mpmath.diff(lambda a, b: abs(a) ** b, (mpmath.mpf(-0.6), mpmath.mpf(2.3)), (1, 1))
    assert value_at(mixed, x=-0.6, p=2.3) == pytest.approx(float(truth), rel=1e-13)
    assert value_at(mixed, x=0.0, p=2.3) == 0.0
    twice = differentiate(differentiate(expression, p), p)
    assert value_at(twice, x=0.3, p=2.3) == pytest.approx(0.3**2.3 * math.log(0.3) ** 2, rel=1e-14)
    assert PowerLog(x, p, 0) == x**p


def test_ties_are_settled_the_same_way_every_time():
    """At x = y, Max has the slope of exactly one of its arguments: the slopes over x and over y add to one."""
    for kind in (sp.Max, sp.Min):
        slopes = [differentiate(kind(x, y), s) for s in (x, y)]
        assert sum(value_at(s, x=0.5, y=0.5) for s in slopes) == 1.0


def test_table_chain_rule():
    table = Table.from_samples("force", np.linspace(-1, 1, 12), np.linspace(-1, 1, 12) ** 5)
    assert differentiate(table(x**2), x) == 2 * x * table.derivative()(x**2)
    assert differentiate(table(y), x) == 0


def test_a_table_may_have_the_name_of_a_function():
    """A user's table called "floor" or "sin" is that table, not the function."""
    for name in ("floor", "sin", "Abs"):
        table = Table(name, [0.0, 1.0], [[1.0, 2.0]])
        assert value_at(table(x), x=0.25) == 1.5
        assert value_at(differentiate(table(x), x), x=0.25) == 2.0


def test_unknown_functions_are_named():
    with pytest.raises(CompileError, match="mystery"):
        differentiate(sp.Function("mystery")(x), x)
    with pytest.raises(CompileError, match="Integral"):
        differentiate(sp.Integral(sp.sin(x * y), (y, 0, 1)), x)


def test_modulus_of_something_that_may_be_complex_stays_whole():
    """|log x|: sympy alone would split it into real and imaginary parts."""
    slope = differentiate(sp.Abs(sp.log(x), evaluate=False), x)
    assert not slope.has(sp.re, sp.im, sp.conjugate)
    assert value_at(slope, x=0.5) == pytest.approx(-2.0)
