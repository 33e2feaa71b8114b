"""Laws every chart obeys: change of units, shift of time, refinement, damping as exact algebra, blocks as maxima."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as some

import stability as st

t = sp.Symbol("t", real=True)


def shifted_mathieu(phase):
    q = sp.Function("q")(t)
    a, b, d = sp.symbols("a b d", real=True)
    return st.System.from_equations(
        {q.diff(t, 2): -2 * d * q.diff(t) - (a + b * sp.cos(t + phase) + b * sp.sin(2 * t + 2 * phase) / 2) * q},
        [q], parameters=dict(a=1.0, b=0.5, d=0.02), period=2 * sp.pi,
    )  # fmt: skip


@settings(max_examples=8, deadline=None)
@given(factor=some.floats(0.2, 5.0), delta=some.floats(0.0, 0.3))
def test_a_change_of_the_unit_of_time_scales_the_growth_rate(factor, delta):
    plain = st.chart(st.models.mathieu(delta=delta), x=("a", -0.3, 2), y=("b", 0, 1.5), shape=12)
    f2 = factor**2
    scaled = st.chart(
        st.models.mathieu(delta=factor * delta, Omega=factor), x=("a", -0.3 * f2, 2 * f2), y=("b", 0, 1.5 * f2), shape=12
    )
    np.testing.assert_allclose(scaled.growth_rate / factor, plain.growth_rate, rtol=0, atol=5e-10)


@settings(max_examples=6, deadline=None)
@given(phase=some.floats(0.0, 6.2))
def test_a_shift_of_time_changes_nothing(phase):
    here = st.chart(shifted_mathieu(phase), x=("a", -0.3, 2), y=("b", 0, 1.5), shape=12)
    there = st.chart(shifted_mathieu(0.0), x=("a", -0.3, 2), y=("b", 0, 1.5), shape=12)
    np.testing.assert_allclose(here.growth_rate, there.growth_rate, rtol=0, atol=1e-10)
    assert here.layers[0].form == "two"


@pytest.mark.parametrize("phase", [0.0, 0.7, sp.pi / 2, 2.0])
def test_an_even_equation_is_recognised_wherever_its_centre_is(phase):
    q = sp.Function("q")(t)
    a, b = sp.symbols("a b", real=True)
    wave = sp.cos(t + phase) + sp.cos(3 * t + 3 * phase) / 3
    system = st.System.from_equations(
        {q.diff(t, 2): -(a + b * wave) * q}, [q], parameters=dict(a=1.0, b=0.5), period=2 * sp.pi
    )
    assert st.chart(system, x=("a", 0, 2), y=("b", 0, 1), shape=5).layers[0].form == "hill"


@settings(max_examples=6, deadline=None)
@given(delta=some.floats(0.001, 0.2))
def test_refining_the_grid_or_the_tolerance_changes_no_verdict(delta):
    model = st.models.mathieu(delta=delta)
    coarse = st.chart(model, x=("a", -0.5, 3), y=("b", 0, 2), shape=21, tolerance=1e-6)
    fine = st.chart(model, x=("a", -0.5, 3), y=("b", 0, 2), shape=41)
    again = np.asarray(fine.verdict)[::2, ::2]
    known = np.asarray(coarse.verdict) != st.Verdict.UNDETERMINED
    assert np.all(np.asarray(coarse.verdict)[known] == again[known])
    assert np.abs(coarse.growth_rate - fine.growth_rate[::2, ::2]).max() <= coarse.error + fine.error


def test_damping_is_a_shift_of_stiffness_and_of_the_growth_rate():
    delta = 0.17
    damped = st.chart(st.models.mathieu(delta=delta), x=("a", delta**2, 3 + delta**2), y=("b", 0, 2), shape=30)
    plain = st.chart(st.models.mathieu(), x=("a", 0, 3), y=("b", 0, 2), shape=30)
    np.testing.assert_allclose(damped.growth_rate + delta, plain.growth_rate, rtol=0, atol=2e-10)


def test_the_trap_is_the_worse_of_its_two_directions():
    trap = st.chart(st.models.paul_trap(zeta=0.01), x=("a", -0.3, 0.3), y=("q", 0, 1), shape=24)
    one = st.models.mathieu_canonical(zeta=0.01)
    first = st.chart(one, x=("a", -0.3, 0.3), y=("q", 0, 1), shape=24).growth_rate
    assert len(trap.layers) == 2
    np.testing.assert_allclose(trap.growth_rate, np.maximum(first, first[:, ::-1]), rtol=0, atol=1e-10)


def test_the_same_call_gives_the_same_bytes():
    calls = [st.chart(st.models.mathieu(delta=0.03), x=("a", 0, 2), y=("b", 0, 1), shape=40) for _ in range(2)]
    assert calls[0].growth_rate.tobytes() == calls[1].growth_rate.tobytes()
    assert np.array_equal(calls[0].tips, calls[1].tips)


def test_large_windows_are_tiled_and_stay_accurate():
    """Deep unstable corner: factors up to 1e9; against 30-digit tridiagonal growth at points of the corner."""
    import mpmath

    chart = st.chart(st.models.mathieu(), x=("a", -10, 60), y=("b", 0, 40), shape=(36, 21))
    mpmath.mp.dps = 30
    for j, i in ((20, 0), (10, 3), (20, 18), (15, 30), (4, 2)):
        a, b = mpmath.mpf(chart.x[i]), mpmath.mpf(chart.y[j])
        # multipliers from Whittaker's determinant: cosh(2 pi mu) = 1 + D(0) (cosh-form), by products of 2 x 2 steps
        value = _trace_by_taylor(a, b)
        exact = float(mpmath.acosh(max(mpmath.mpf(1), abs(value) / 2)) / (2 * mpmath.pi))
        assert abs(exact - chart.growth_rate[j, i]) < 1e-10


def _trace_by_taylor(a, b, steps=24, terms=50):
    """Trace of the monodromy matrix of q'' + (a + b cos t) q = 0: Taylor series over half a period in mpmath."""
    import mpmath

    h = mpmath.pi / steps
    solutions = [[mpmath.mpf(1), mpmath.mpf(0)], [mpmath.mpf(0), mpmath.mpf(1)]]
    for step in range(steps):
        c, s = mpmath.cos(h * step), mpmath.sin(h * step)
        wave = [(c, -s, -c, s)[j % 4] / mpmath.factorial(j) for j in range(terms)]
        for solution in solutions:
            x = list(solution)
            for k in range(terms - 2):
                total = a * x[k] + b * mpmath.fsum(wave[j] * x[k - j] for j in range(k + 1))
                x.append(-total / ((k + 1) * (k + 2)))
            solution[0] = mpmath.polyval(x[::-1], h)
            solution[1] = mpmath.polyval([k * x[k] for k in range(terms - 1, 0, -1)], h)
    (u1, v1), (u2, v2) = solutions
    return 2 * (u1 * v2 + v1 * u2)


def test_a_python_function_gives_the_chart_of_its_equation():
    def shape(s):
        return np.cos(s)

    by_function = st.models.hill(shape, period=2 * np.pi, delta=0.04)
    left = st.chart(by_function, x=("a", -0.3, 2), y=("b", 0, 1.5), shape=14)
    right = st.chart(st.models.mathieu(delta=0.04), x=("a", -0.3, 2), y=("b", 0, 1.5), shape=14)
    np.testing.assert_allclose(left.growth_rate, right.growth_rate, rtol=0, atol=1e-11)


def test_fast_circuits_are_slow_ones_in_other_units() -> None:
    """L and C of a microwave circuit: 1/(L C) = 1e21 beside the 1 of q' = q_dot hides neither coupling nor damping."""
    import numpy as np

    import stability as st

    slow, fast = dict(inductance=1.0, capacitance=1.0), dict(inductance=1e-9, capacitance=1e-12)
    unit = np.sqrt(fast["inductance"] / fast["capacitance"])  # ohm: keeps the damping ratio
    w0 = 1 / np.sqrt(fast["inductance"] * fast["capacitance"])
    for resistance in (0.0, 1e-4, 0.05):
        one = st.models.resistance_modulated_circuit(**slow, resistance=resistance, epsilon=3.0, omega=2.0)
        two = st.models.resistance_modulated_circuit(**fast, resistance=resistance * unit, epsilon=3.0, omega=2.0 * w0)
        a = st.chart(one, x=("omega", 1.2, 2.6), y=("epsilon", 0.1, 5.0), shape=(20, 20))
        b = st.chart(two, x=("omega", 1.2 * w0, 2.6 * w0), y=("epsilon", 0.1, 5.0), shape=(20, 20))
        assert np.abs(b.growth_rate / w0 - a.growth_rate).max() < 1e-8
        assert (np.asarray(a.verdict.codes) == np.asarray(b.verdict.codes)).mean() > 0.99
        assert bool((b.verdict == st.Verdict.NEUTRAL).any()) == (resistance == 0.0)
