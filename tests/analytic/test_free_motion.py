"""Free oscillations: rows 1a-1e and 3a-3c of the verified closed forms, each with its order.

Witnesses: elliptic functions (checked here against DOP853), DOP853 over one period, exact half-swings of dry friction.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from exact_orbits import SMALL, TIGHT, assert_order, free_orbit, observed_orders
from scipy.integrate import quad, solve_ivp

import stability as st
from stability.analytic.fourier_terms import moment
from stability.errors import EquationError, InputError

t = sp.Symbol("t")
x = sp.Function("x", real=True)(t)
alpha, beta, delta = sp.symbols("alpha beta delta", real=True)
a = sp.Symbol("a", positive=True)


def spring(force, **parameters):
    return st.System.from_equations(
        {x.diff(t, 2): -x - force}, [x], parameters=parameters, orders=dict.fromkeys(parameters, 1)
    )


def value(law, **numbers):
    return float(law.subs({s: numbers[s.name] for s in law.free_symbols}))


# ------------------------------------------------------------------ exact motion
@pytest.mark.parametrize(
    ("A", "alpha_", "beta_"),
    [(0.7, 1.0, 2.0), (3.0, 1.0, 0.0), (1.3, 0.0, 1.0), (0.9, 1.0, -1.0), (2.5, -1.0, 1.0), (1.2, -1.0, 1.0)],
)
def test_duffing_motion_solves_the_equation(A, alpha_, beta_):
    """cn, sn, dn and the linear limit against DOP853 over a period: position, velocity, return."""
    motion = st.duffing_motion(amplitude=A, alpha=alpha_, beta=beta_)
    times = motion.period * np.linspace(0, 1, 33)
    truth = solve_ivp(
        lambda s, y: [y[1], -alpha_ * y[0] - beta_ * y[0] ** 3], (0, times[-1]), [A, 0.0], t_eval=times, **TIGHT
    ).y
    assert np.abs(motion(times) - truth).max() < 1e-9
    assert np.abs(motion(motion.period) - [A, 0]).max() < 1e-10


@pytest.mark.parametrize("A", [0.1, 1.5, 3.1])
def test_pendulum_motion_solves_the_equation(A):
    motion = st.pendulum_motion(amplitude=A, omega0=1.3)
    times = motion.period * np.linspace(0, 1, 33)
    truth = solve_ivp(lambda s, y: [y[1], -1.69 * np.sin(y[0])], (0, times[-1]), [A, 0.0], t_eval=times, **TIGHT).y
    assert np.abs(motion(times) - truth).max() < 1e-8


def test_exact_motion_refuses_what_is_not_periodic():
    for bad in (dict(amplitude=1.0, beta=-1.0), dict(amplitude=1.0, alpha=-1.0), dict(amplitude=0.5, alpha=-1.0)):
        with pytest.raises(InputError, match="no periodic motion"):
            st.duffing_motion(**bad)
    with pytest.raises(InputError, match="between 0 and pi"):
        st.pendulum_motion(amplitude=math.pi)


def test_frequency_at_infinite_amplitude():
    """omega/(sqrt(beta) A) -> 0.847213: Gamma(3/4)^2/sqrt(pi)."""
    limit = math.gamma(0.75) ** 2 / math.sqrt(math.pi)
    assert abs(st.duffing_motion(amplitude=1.0, alpha=0.0).frequency - limit) < 1e-14
    assert abs(st.duffing_motion(amplitude=1e4).frequency / 1e4 - limit) < 1e-8


# ------------------------------------------------------------------ rows 1a-1e
ROWS = {
    "1a": (dict(order=1, amplitude="maximum"), "A", 1.98, (3.0e-3, 5.1e-5)),
    "1b": (dict(order=2, amplitude="maximum"), "A", 2.98, (2.8e-4, 6.1e-7)),
    "1c": (dict(order=2), "a", 2.99, (1.1e-4, 2.3e-7)),
    "1d": (dict(order=1, squared=True), "a", 1.97, (8.2e-4, 1.4e-5)),
    "1e": (dict(order=2, squared=True), "a", 2.97, (9.7e-5, 2.1e-7)),
}


@pytest.mark.parametrize("row", ROWS)
def test_frequency_of_the_free_duffing_oscillator(row):
    """Rows 1a-1e: errors of omega (1d, 1e: of omega^2) at z = beta A^2 (or beta a^2) = eps, and their order."""
    options, which, order, (largest, smallest) = ROWS[row]
    law = st.frequency_law(spring(beta * x**3, beta=0.1), **options)
    errors = []
    for z in SMALL:
        A = 1.0
        if which == "a":  # beta = 1: the amplitude whose fundamental harmonic is sqrt(z)
            A = math.sqrt(z)
            for _ in range(60):
                A *= math.sqrt(z) / st.duffing_motion(amplitude=A).harmonic()
            motion, size, b = st.duffing_motion(amplitude=A), math.sqrt(z), 1.0
        else:
            motion, size, b = st.duffing_motion(amplitude=A, beta=z), A, z
        predicted = value(law, a=size, beta=b)
        errors.append(abs(predicted - motion.frequency ** (2 if options.get("squared") else 1)))
    assert_order(errors, order, slack=0.03)
    assert errors[0] == pytest.approx(largest, rel=0.05)
    assert errors[-1] == pytest.approx(smallest, rel=0.05)


def test_coefficients_in_both_amplitudes():
    """15/256 in the fundamental harmonic, 21/256 in the maximum."""
    free = spring(beta * x**3, beta=0.1)
    assert st.frequency_law(free).coeff(beta, 2) == -sp.Rational(15, 256) * a**4
    assert st.frequency_law(free, amplitude="maximum").coeff(beta, 2) == -sp.Rational(21, 256) * a**4


# ------------------------------------------------------------------ rows 3a, 3b, 3b'
def test_coefficients_of_real_powers():
    """c_n by the Gamma function against quadrature and the listed values."""
    listed = {0: 4 / math.pi, 1: 1.0, 2: 0.848826, 3: 0.75, 4: 0.679061, 5: 0.625, 7: 35 / 64}
    for n, number in listed.items():
        c = 2 * float(moment(sp.Integer(n + 1), sp.Integer(0)))
        assert c == pytest.approx(number, abs=5e-7)
        assert c == pytest.approx(
            quad(lambda s, n=n: abs(math.cos(s)) ** (n + 1), 0, math.pi / 2)[0] * 4 / math.pi, rel=1e-10
        )


@pytest.mark.parametrize("n", [2, 3, 4, 5, 7])
def test_odd_restoring_force_of_any_power(n):
    """Row 3a: omega^2 = 1 + beta c_n a^(n-1) for beta |u|^(n-1) u; order 1.97-1.98."""
    law = st.frequency_law(spring(beta * sp.Abs(x) ** (n - 1) * x, beta=0.1), order=1, squared=True)
    c = 2 * float(moment(sp.Integer(n + 1), sp.Integer(0)))
    assert value(law, a=1.3, beta=0.2) == pytest.approx(1 + 0.2 * c * 1.3 ** (n - 1), rel=1e-12)
    errors = []
    for b in SMALL:
        omega, _, size = free_orbit(lambda q, b=b: -q - b * abs(q) ** (n - 1) * q, 1.0)
        errors.append(abs(math.sqrt(value(law, a=size, beta=b)) - omega))
    assert_order(errors, 1.975, slack=0.05)


def test_real_power_that_is_no_integer():
    """|u|^(3/2) u: the coefficient by quadrature, the same order."""
    law = st.frequency_law(spring(beta * sp.Abs(x) ** sp.Rational(3, 2) * x, beta=0.1), order=1, squared=True)
    c = quad(lambda s: math.cos(s) ** 3.5, 0, math.pi / 2, epsabs=1e-13)[0] * 4 / math.pi
    assert value(law, a=1.0, beta=0.2) == pytest.approx(1 + 0.2 * c, rel=1e-12)
    errors = []
    for b in SMALL:
        omega, _, size = free_orbit(lambda q, b=b: -q - b * abs(q) ** 1.5 * q, 1.0)
        errors.append(abs(math.sqrt(value(law, a=size, beta=b)) - omega))
    assert_order(errors, 1.975, slack=0.05)


@pytest.mark.parametrize(("n", "coefficient"), [(2, "5/6"), (4, "63/80"), (6, "1287/1792")])
def test_even_restoring_force(n, coefficient):
    """Row 3b: omega^2 = 1 - 2 n S_n alpha^2 a^(2n-2), error of order 4 (measured 4.05-4.11)."""
    law = st.frequency_law(spring(alpha * x**n, alpha=0.1), order=2, squared=True)
    assert sp.simplify(law - (1 - sp.Rational(coefficient) * alpha**2 * a ** (2 * n - 2))) == 0
    errors = []
    for e in SMALL:
        omega, _, size = free_orbit(lambda q, e=e: -q - e * q**n, 0.8)
        errors.append(abs(value(law, a=size, alpha=e) - omega**2))
    assert observed_orders(errors)[-1] > 3.9


def test_quadratic_and_cubic_force_with_drift():
    """Row 3b': omega = 1 + (3/8 beta - 5/12 alpha^2) a^2, drift -alpha a^2/2, second harmonic alpha a^2/6."""
    system = st.System.from_equations(
        {x.diff(t, 2): -x - alpha * x**2 - beta * x**3}, [x], parameters=dict(alpha=0.1, beta=0.1),
        orders=dict(alpha=1, beta=2),
    )  # fmt: skip
    assert sp.expand(st.frequency_law(system) - (1 + (3 * beta / 8 - 5 * alpha**2 / 12) * a**2)) == 0
    slow = st.multiple_scales(system, order=2)
    size = sp.Symbol("x_amplitude", real=True)
    time = sp.Symbol("t", real=True)
    shape = slow.reconstruction["x"].subs(slow.outputs["frequency"] * time, sp.Symbol("p"))
    assert (
        sp.expand(
            slow.reconstruction["x"].subs(time, 0) - size - alpha * size**2 * (sp.Rational(1, 6) - sp.Rational(1, 2))
        )
        == 0
    )
    assert shape.has(alpha)
    errors = []
    for e in SMALL:
        _, mean, amplitude = free_orbit(lambda q, e=e: -q - e * q**2 - e**2 * q**3, 0.8)
        errors.append(abs(mean + e * amplitude**2 / 2))
    assert observed_orders(errors)[-1] > 2.9


# ------------------------------------------------------------------ row 3c
@pytest.mark.parametrize("p", [2, 3])
def test_power_law_damping(p):
    """Row 3c: a' = -delta c_p a^p/2 against DOP853 at whole periods; order 2."""
    v = x.diff(t)
    system = st.System.from_equations(
        {x.diff(t, 2): -x - delta * sp.Abs(v) ** (p - 1) * v}, [x], parameters=dict(delta=0.1), orders=dict(delta=1)
    )
    slow = st.averaging(system)
    c = 2 * float(moment(sp.Integer(p + 1), sp.Integer(0)))
    assert float(slow(0.0, [0.7], delta=0.3)[0]) == pytest.approx(-0.3 * c * 0.7**p / 2, rel=1e-12)
    errors = []
    for k, e in enumerate(SMALL):
        end = 2 * math.pi * 2**k
        averaged = solve_ivp(lambda s, y, e=e: slow(s, y, delta=e), (0, end), [1.0], **TIGHT).y[0, -1]
        full = solve_ivp(
            lambda s, y, e=e: [y[1], -y[0] - e * abs(y[1]) ** (p - 1) * y[1]], (0, end), [1.0, 0.0], **TIGHT
        )
        errors.append(abs(averaged - math.hypot(*full.y[:, -1])))
    assert_order(errors, 2.0, slack=0.06)


def test_dry_friction_is_exact_at_whole_periods():
    """Row 3c, p = 0: each half swing loses 2 delta exactly; a = a0 - 2 delta t/pi."""
    system = st.System.from_equations(
        {x.diff(t, 2): -x - delta * sp.sign(x.diff(t))}, [x], parameters=dict(delta=0.1), orders=dict(delta=1)
    )
    rate = float(st.averaging(system)(0.0, [1.0], delta=0.05)[0])
    for periods in (1, 2, 4):
        exact = 1.0
        for _ in range(2 * periods):
            exact -= 2 * 0.05
        assert 1.0 + rate * 2 * math.pi * periods == pytest.approx(exact, abs=1e-14)


def limit_cycle_period(mu):
    """Time between two maxima, after the transient e^{-mu t} has died out."""

    def turning(t, y):
        return y[1]

    turning.direction = -1
    end = 30 / mu
    run = solve_ivp(
        lambda s, y: [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]],
        (0, end + 14),
        [2.0, 0.0],
        events=turning,
        max_step=0.5,
        **TIGHT,
    )
    times = [s for s in run.t_events[0] if s > end]
    return times[1] - times[0]


def test_self_excited_amplitude_and_frequency():
    """van der Pol: a = 2, omega = 1 - mu^2/16 (the textbook), error of the frequency of order 4."""
    from scipy.optimize import brentq

    slow = st.multiple_scales(st.models.van_der_pol(), order=2)
    size = sp.Symbol("x_amplitude", real=True)
    assert sp.expand(slow.rhs[0].subs(size, 2)) == 0
    law = slow.outputs["frequency"].subs(size, 2)
    assert sp.expand(law - (1 - sp.Symbol("mu", real=True) ** 2 / 16)) == 0
    errors = []
    for mu in (0.4, 0.2, 0.1):
        period = limit_cycle_period(mu)
        errors.append(abs(2 * math.pi / period - (1 - mu**2 / 16)))
    assert observed_orders(errors, (0.4, 0.2, 0.1))[-1] > 3.8
    assert brentq(lambda s: float(slow(0.0, [s], mu=0.1)[0]), 1.0, 3.0) == pytest.approx(2.0, abs=1e-12)


def test_frequency_law_leaves_the_forcing_out_and_refuses_two_degrees_of_freedom():
    base = st.frequency_law(st.models.duffing(), order=1, squared=True)
    assert sp.expand(base - (1 + 3 * beta * a**2 / 4)) == 0
    with pytest.raises(InputError, match="degrees of freedom"):
        st.frequency_law(st.models.autoparametric_quadratic())
    with pytest.raises(EquationError, match="Python function"):
        st.frequency_law(st.System.from_function(lambda t, x: (x[1], -x[0]), "x v"))
