"""Period maps and multipliers: 30-digit tables, closed forms (Meissner, constant coefficients, limit cycles), identities."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as some

import stability as st
from stability.errors import ConvergenceError, InputError, NonFiniteError, UnknownNameError
from stability.floquet.period_maps import monodromy
from stability.words import Crossing, Verdict

DATA = Path(__file__).parents[1] / "data"
t = sp.Symbol("t", real=True)


@dataclass(frozen=True)
class Motion:
    """The least an orbit has to offer."""

    function: object
    period: float

    def __call__(self, time):
        return self.function(np.asarray(time, dtype=float))


def at_rest(n: int, period: float) -> Motion:
    return Motion(lambda time: np.zeros((n, *time.shape)), period)


def table() -> list[dict[str, float]]:
    with (DATA / "mathieu_monodromy.csv").open() as stream:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(stream)]


@pytest.mark.parametrize("row", table(), ids=lambda row: f"a{row['a']}-q{row['q']}-zeta{row['zeta']}")
def test_damped_mathieu_to_thirty_digits(row: dict[str, float]) -> None:
    """Entries within the reported error; both multipliers, the small one in relative terms (issue A: zeta = 5)."""
    m = monodromy(st.models.mathieu_canonical(a=row["a"], q=row["q"], zeta=row["zeta"]))
    exact = np.array([[row["M11"], row["M12"]], [row["M21"], row["M22"]]])
    assert np.max(np.abs(m.matrix - exact)) <= m.matrix_error
    assert m.matrix_error <= 1e-11 * max(1.0, np.abs(exact).max())
    values = np.array([row["re1"] + 1j * row["im1"], row["re2"] + 1j * row["im2"]])
    assert np.all(np.abs(m.multipliers - values) <= m.multiplier_errors)
    if abs(values[1].imag) == 0 and abs(values[0] - values[1]) > 1e-3:
        assert abs(m.multipliers[1] / values[1] - 1) < 1e-11
    assert abs(m.multipliers[0] * m.multipliers[1] / np.exp(-2 * row["zeta"] * np.pi) - 1) < 1e-12
    assert m.liouville_defect < 1e-11


def test_multiplier_of_1e_28() -> None:
    """x'' + 10 x' + (1 + 0.5 cos t) x = 0: eig of the period map gives 1e-18; det/mu is right (research, 9.7e-28)."""
    m = monodromy(st.models.mathieu(a=1.0, b=0.5, Omega=1.0, delta=5.0))
    assert abs(m.multipliers[1]) == pytest.approx(9.7e-28, rel=0.01)
    assert abs(m.multipliers.prod() / np.exp(-10 * 2 * np.pi) - 1) < 1e-13
    assert m.multiplier_errors[1] < 1e-10 * abs(m.multipliers[1])


@pytest.mark.parametrize(("a", "b"), [(0.7, 0.4), (2.0, 1.5), (1.0, 1.7), (5.0, 0.3), (0.2, 0.9)])
def test_meissner_trace(a: float, b: float) -> None:
    """tr = 2 cos cos - (p1/p2 + p2/p1) sin sin, p = sqrt(a +- b) (catalogue 5); jumps are step edges."""
    m = monodromy(st.models.meissner(a=a, b=b, Omega=2.0))
    half = np.pi / 2
    p1, p2 = np.emath.sqrt(a + b), np.emath.sqrt(a - b)
    trace = 2 * np.cos(p1 * half) * np.cos(p2 * half) - (p1 / p2 + p2 / p1) * np.sin(p1 * half) * np.sin(p2 * half)
    assert abs(np.trace(m.matrix) - complex(trace).real) < 1e-12 * max(1, abs(trace))
    assert m.verdict is (Verdict.UNSTABLE if abs(trace) > 2 else Verdict.NEUTRAL)


def test_exponents_of_the_catalogue() -> None:
    """Figure 10: 1:1 resonance 0.745666 1/s, 2:1 with A = 10 mm 0.87774 1/s, w = 10 rad/s neutral (catalogue 6, errata)."""
    pendulum = st.models.base_driven_pendulum.from_physical
    natural = np.sqrt(9.81 / 0.1081)

    def at(w: float, amplitude: float):
        return monodromy(pendulum(length=0.1081, amplitude=amplitude, frequency=w / (2 * np.pi)))

    one, two, literal = at(natural, 0.1), at(2 * natural, 0.01), at(10.0, 0.1)
    assert one.growth_rate == pytest.approx(0.745666, abs=5e-7) and one.kind is Crossing.PLUS_ONE
    assert two.growth_rate == pytest.approx(0.87774, abs=5e-6) and two.kind is Crossing.MINUS_ONE
    assert literal.verdict is Verdict.NEUTRAL and np.trace(literal.matrix) == pytest.approx(1.887, abs=5e-4)
    # the interval of the 1:1 tongue, 8.485 to 9.880 rad/s
    inside = [at(w, 0.1).verdict for w in (8.4855, 9.8795)]
    outside = [at(w, 0.1).verdict for w in (8.4845, 9.8805)]
    assert inside == [Verdict.UNSTABLE] * 2 and outside == [Verdict.NEUTRAL] * 2


@settings(max_examples=30, deadline=None)
@given(some.floats(-1, 8), some.floats(0, 4))
def test_growth_rate_is_the_characteristic_exponent(a: float, q: float) -> None:
    """Two independent roads: Magnus steps, and Hill's determinant."""
    m = monodromy(st.models.mathieu_canonical(a=a, q=q))
    nu = st.mathieu_exponent(a, q)
    assert abs(np.trace(m.matrix) - 2 * np.cos(np.pi * nu).real) < 4 * m.matrix_error + 1e-13 * abs(np.trace(m.matrix))


@settings(max_examples=15, deadline=None)
@given(some.floats(0.1, 3), some.floats(0, 1.5), some.floats(0, 0.3), some.floats(0, 6.2))
def test_time_shift_leaves_multipliers(a: float, b: float, delta: float, shift: float) -> None:
    """Another start of the period is a similarity of the map."""
    x = sp.Function("x")(sp.Symbol("t", real=True))
    names = sp.symbols("a b delta phase", real=True)
    A, B, D, phase = names
    equation = {x.diff(t, 2): -2 * D * x.diff(t) - (A + B * sp.cos(t + phase)) * x}
    system = st.System.from_equations(
        equation, coordinates=[x], parameters=dict(a=1.0, b=0.5, delta=0.1, phase=0.0), period=2 * sp.pi
    )
    first = monodromy(system, a=a, b=b, delta=delta, phase=0.0)
    second = monodromy(system, a=a, b=b, delta=delta, phase=shift)
    assert np.all(np.abs(first.multipliers - second.multipliers) <= first.multiplier_errors + second.multiplier_errors)


def test_twice_the_period_squares_the_multipliers() -> None:
    system = st.models.mathieu(a=0.3, b=0.4, delta=0.05)
    once = monodromy(system)
    twice = monodromy(system, about=at_rest(2, 2 * system.period))
    assert twice.period == pytest.approx(2 * once.period)
    expected = np.sort_complex(once.multipliers**2)
    assert np.max(np.abs(np.sort_complex(twice.multipliers) - expected)) < 1e-11
    assert twice.growth_rate == pytest.approx(once.growth_rate, abs=1e-11)


def test_graded_spectrum_of_four_states() -> None:
    """Two uncoupled damped oscillators in rotated coordinates: closed form, moduli from 0.9 to 1e-40."""
    x, y = (sp.Function(n)(t) for n in "xy")
    c, s = sp.Rational(3, 5), sp.Rational(4, 5)
    u, v = c * x + s * y, -s * x + c * y
    law_u = -sp.Rational(1, 10) * u.diff(t) - 2 * u
    law_v = -15 * v.diff(t) - 9 * v
    system = st.System.from_equations(
        {x.diff(t, 2): sp.expand(c * law_u - s * law_v), y.diff(t, 2): sp.expand(s * law_u + c * law_v)},
        coordinates=[x, y],
        parameters={},
        period=2 * sp.pi,
    )
    m = monodromy(system)
    roots = np.concatenate([np.roots([1, 0.1, 2]), np.roots([1, 15, 9])])
    exact = np.exp(2 * np.pi * roots)
    exact = exact[np.lexsort((-exact.imag, -np.abs(exact)))]
    assert np.max(np.abs(m.multipliers / exact - 1)) < 1e-9
    assert np.all(np.abs(m.multipliers - exact) <= m.multiplier_errors)
    assert abs(exact[-1]) < 1e-38 and m.verdict is Verdict.STABLE and m.kind is None


def test_combination_resonance_leaves_as_a_pair() -> None:
    """Sum resonance Omega = omega1 + omega2 of two symmetric oscillators; and neutral between the tongues."""
    system = st.models.coupled_mathieu(omega1=1.0, omega2=1.7, delta=0.0, epsilon=0.3, h11=0.0, h22=0.0)
    resonant = monodromy(system, Omega=2.7)
    assert resonant.verdict is Verdict.UNSTABLE and resonant.kind is Crossing.PAIR and resonant.counts.pairs == 1
    # first order: growth rate epsilon/(4 sqrt(omega1 omega2))
    assert resonant.growth_rate == pytest.approx(0.3 / (4 * np.sqrt(1.7)), rel=0.02)
    assert monodromy(system, Omega=4.1).verdict is Verdict.NEUTRAL


def test_limit_cycle_of_the_normal_form() -> None:
    """r' = r - r^3, angle' = 2: the circle has the multipliers 1 and exp(-2 T), T = pi."""
    x, y = (sp.Function(n)(t) for n in "xy")
    r2 = x**2 + y**2
    system = st.System.from_equations({x.diff(t): x - 2 * y - x * r2, y.diff(t): 2 * x + y - y * r2}, coordinates=[x, y])
    circle = Motion(lambda time: np.array([np.cos(2 * time), np.sin(2 * time)]), np.pi)
    m = monodromy(system, about=circle)
    assert m.trivial == 0 and m.verdict is Verdict.STABLE
    assert abs(m.multipliers[0] - 1) <= m.multiplier_errors[0]
    assert abs(m.multipliers[1] / np.exp(-2 * np.pi) - 1) < 1e-11
    with pytest.raises(InputError, match="autonomous"):
        monodromy(system)


def test_conservative_orbit_has_a_double_multiplier() -> None:
    """x'' + x + x^3 = 0, x = A cn(w t, m): exact orbit; both multipliers are 1 in a Jordan block; neutral."""
    from scipy import special

    x = sp.Function("x")(t)
    system = st.System.from_equations({x.diff(t, 2): -x - x**3}, coordinates=[x])
    amplitude = 1.3
    w = np.sqrt(1 + amplitude**2)
    m = amplitude**2 / (2 * w**2)

    def orbit(time):
        sn, cn, dn, _ = special.ellipj(w * time, m)
        return np.array([amplitude * cn, -amplitude * w * sn * dn])

    period = 4 * special.ellipk(m) / w
    result = monodromy(system, about=Motion(orbit, period))
    assert result.verdict is Verdict.NEUTRAL and result.trivial is not None
    assert np.all(np.abs(result.multipliers - 1) <= result.multiplier_errors) and result.error < 1e-5
    # M maps x' to itself; the period falls with the amplitude, so the block is not diagonal
    rate = np.array([0.0, -amplitude - amplitude**3])
    assert np.allclose(result.matrix @ rate, rate, atol=1e-10) and abs(result.matrix[1, 0]) > 1


def test_orbit_of_integrated_van_der_pol() -> None:
    """An orbit by numerical integration: trivial multiplier 1, the other inside; Liouville."""
    from scipy import integrate

    system = st.models.van_der_pol()

    def flow(span, start, **options):
        return integrate.solve_ivp(system, span, start, rtol=1e-12, atol=1e-13, method="DOP853", **options)

    settled = flow((0, 80), [2.0, 0.0]).y[:, -1]

    def top(time, state):
        return state[1]

    top.direction = -1
    crossing = flow((0, 40), settled, events=top)
    times = crossing.t_events[0]
    start, period = crossing.y_events[0][-2], times[-1] - times[-2]
    path = flow((0, period), start, dense_output=True).sol
    result = monodromy(system, about=Motion(lambda time: path(np.mod(time, period)), period), tolerance=1e-9)
    assert abs(result.multipliers[0] - 1) < 1e-6 and result.trivial == 0 and result.verdict is Verdict.STABLE
    assert result.liouville_defect < 1e-6


def test_pendulum_upright_and_hanging() -> None:
    """About an equilibrium: Kapitza's pendulum upright is the hanging one with the sign of a and b turned."""
    system = st.models.base_driven_pendulum(epsilon=0.1, Omega=20.0)
    up = monodromy(system, about=dict(phi=np.pi))
    nu = st.mathieu_exponent(-4 / 400, 2 * 0.1)
    assert abs(np.trace(up.matrix) - 2 * np.cos(np.pi * nu).real) < 1e-9
    assert up.verdict is Verdict.NEUTRAL  # epsilon Omega = 2 > sqrt 2


def test_bad_input_is_named_before_work() -> None:
    system = st.models.mathieu()
    with pytest.raises(UnknownNameError, match="did you mean 'delta'"):
        monodromy(system, delt=0.1)
    with pytest.raises(InputError):
        monodromy(system, a=float("nan"))
    with pytest.raises(InputError):
        monodromy(system, Omega=0.0)
    with pytest.raises(InputError, match="tolerance"):
        monodromy(system, tolerance=0.0)
    with pytest.raises(UnknownNameError, match="no state"):
        monodromy(system, about=dict(x=1.0))
    with pytest.raises(InputError, match="multiple"):
        monodromy(system, about=at_rest(2, 1.234))
    with pytest.raises(InputError, match="is needed"):
        monodromy(system, about=at_rest(3, system.period))
    with pytest.raises(InputError, match="does not solve"):
        monodromy(
            st.models.duffing(xi=0.1, beta=0.5, Omega=1.0),
            about=Motion(lambda time: np.array([np.cos(time), -np.sin(time)]), 2 * np.pi),
        )


def test_period_map_beyond_floating_point_is_refused() -> None:
    """exp(700) per period: a typed error that names the way out, not inf."""
    with pytest.raises((ConvergenceError, NonFiniteError), match=r"range of floating|not a number"):
        monodromy(st.models.mathieu_canonical(a=-5e4, q=1.0))


def test_result_is_frozen_and_shows_itself() -> None:
    m = monodromy(st.models.mathieu(a=0.25, b=0.1, delta=0.0))
    with pytest.raises(ValueError):
        m.matrix[0, 0] = 1.0
    assert "unstable" in repr(m) and "-1" in repr(m)
    assert m.params["a"] == 0.25 and m.about is None
    assert np.allclose(np.exp(m.exponents * m.period), m.multipliers, rtol=1e-13)


def test_light_damping_of_a_fast_circuit_is_not_taken_for_none() -> None:
    """R/L = 1e4 1/s beside 1/(L C) = 1e21 1/s^2: stable, not neutral; multipliers' product exp(-R T/L)."""
    import stability as st

    circuit = st.models.capacitance_modulated_circuit(
        inductance=1e-9, capacitance=1e-12, resistance=1e-5, epsilon=0.0, omega=1e10
    )
    found = st.monodromy(circuit)
    assert found.verdict is not st.Verdict.NEUTRAL
    assert found.error > 0 and abs(np.prod(found.multipliers).real - np.exp(-1e4 * found.period)) < 1e-11
