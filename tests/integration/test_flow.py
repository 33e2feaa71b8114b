"""The flow against closed forms and scipy; its derivatives against differences; order conditions of the tables."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.errors import ConvergenceError, InputError, NonFiniteError, UnknownNameError
from stability.integration.flow import flow
from stability.integration.transients import settled_orbit
from stability.kernels import dop853_coefficients as table

t, xi, beta, Omega = sp.symbols("t xi beta Omega", real=True)
u = sp.Function("u")(t)


def duffing():
    return st.System.from_equations(
        {u.diff(t, 2): -2 * xi * u.diff(t) - u - beta * u**3 + Omega**2 * sp.cos(Omega * t)},
        coordinates=[u],
        parameters={"xi": 0.02, "beta": 0.05, "Omega": 2.0},
        period=2 * sp.pi / Omega,
    )


def test_order_conditions_of_the_tables():
    """Quadrature to degree 7, row sums, tall trees b A c^k = 1/((k+1)(k+2)), embedded errors vanish to their order."""
    A, b, c = table.A[:12, :12], table.B, table.C[:12]
    assert np.abs(A.sum(axis=1) - c).max() < 1e-14
    assert np.abs(table.A.sum(axis=1) - table.C).max() < 1e-14
    for k in range(8):
        assert abs(b @ c**k - 1 / (k + 1)) < 1e-14
    for k in range(6):
        assert abs(b @ A @ c**k - 1 / ((k + 1) * (k + 2))) < 1e-14
        assert abs(b @ A @ A @ c**k * (k + 1) * (k + 2) * (k + 3) - 1) < 1e-12 or k > 4
    for k in range(5):
        assert abs(table.E5 @ c**k) < 1e-13
    for k in range(3):
        assert abs(table.E3 @ c**k) < 1e-13


def test_oscillator_to_its_closed_form_with_derivatives():
    """q'' + q = 0 over 20 periods; matrix is the rotation; tolerance proportionality."""
    system = st.System.from_equations({u.diff(t, 2): -(Omega**2) * u}, coordinates=[u], parameters={"Omega": 1.0})
    T = 40 * np.pi + 0.3
    wanted = np.array([np.cos(T), -np.sin(T)])
    errors = []
    for rtol in (1e-6, 1e-9, 1e-12):
        end = flow(system, (0.0, T), dict(u=1.0), rtol=rtol, atol=rtol * 1e-2, variations=True, parameters=("Omega",))
        errors.append(np.abs(end.x - wanted).max())
        assert errors[-1] < 200 * rtol
        assert np.abs(end.matrix - [[np.cos(T), np.sin(T)], [-np.sin(T), np.cos(T)]]).max() < 400 * rtol
    by_omega = [-T * np.sin(T), -np.sin(T) - T * np.cos(T)]
    assert np.abs(end.by_parameter[:, 0] - by_omega).max() < 1e-8
    assert errors[0] > 1e2 * errors[2]


def test_dense_output_against_scipy():
    system, x0, times = duffing(), [0.3, 0.1], np.linspace(0, 12, 301)
    mine = flow(system, (0.0, 12.0), x0, rtol=1e-11, atol=1e-12, dense=True)
    other = solve_ivp(lambda s, y: system(s, y), (0, 12), x0, "DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    assert np.abs(mine(times) - other.sol(times)).max() < 2e-8
    assert np.abs(mine(mine.times) - other.sol(mine.times)).max() < 1e-9
    assert np.abs(mine(times[::-1]) - mine(times)[:, ::-1]).max() == 0
    assert mine(3.0).shape == (2,)
    with pytest.raises(InputError, match="dense"):
        flow(system, (0.0, 1.0), x0)(0.5)


def test_derivatives_against_differences():
    """By the state, by a parameter at fixed time, and by Omega at fixed phase (the end moves with the period)."""
    system, x0, h = duffing(), np.array([0.3, 0.1]), 1e-3
    full = flow(system, (0.0, np.pi), x0, rtol=1e-12, atol=1e-13, variations=True, parameters=("Omega", "xi"))

    def end(x, **values):
        T = 2 * np.pi / values.get("Omega", 2.0)
        return flow(system, (0.0, T), x, system.parameter_vector(**values), rtol=1e-13, atol=1e-14).x

    def central(f):
        return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)

    for k in range(2):
        assert np.abs(central(lambda s: end(x0 + s * np.eye(2)[k])) - full.matrix[:, k]).max() < 1e-9  # noqa: B023
    assert np.abs(central(lambda s: end(x0, Omega=2 + s)) - full.by_parameter[:, 0]).max() < 1e-8
    assert np.abs(central(lambda s: end(x0, xi=0.02 + s)) - full.by_parameter[:, 1]).max() < 1e-8


def test_steps_do_not_straddle_jumps():
    """q'' = sign(cos t): parabolas, exact for any Runge-Kutta method that stops at the jumps."""
    system = st.System.from_equations(
        {u.diff(t, 2): sp.sign(sp.cos(Omega * t))}, coordinates=[u], parameters={"Omega": 1.0}, period=2 * sp.pi / Omega,
        breaks=(sp.Rational(1, 4), sp.Rational(3, 4)),
    )  # fmt: skip
    end = flow(system, (0.0, 2 * np.pi), [0.0, 0.0], rtol=1e-6, atol=1e-8)
    q, v, time = 0.0, 0.0, 0.0
    for corner, sign in ((np.pi / 2, 1), (3 * np.pi / 2, -1), (2 * np.pi, 1)):
        d = corner - time
        q, v, time = q + v * d + sign * d**2 / 2, v + sign * d, corner
    assert np.abs(end.x - [q, v]).max() < 1e-11
    assert end.steps < 30


def test_failures_are_typed_and_carry_the_last_point():
    blow = st.System.from_equations({u.diff(t): u**2}, coordinates=[u], parameters={})
    with pytest.raises((NonFiniteError, ConvergenceError)):
        flow(blow, (0.0, 2.0), dict(u=1.0))
    with pytest.raises(ConvergenceError, match="too many steps") as caught:
        flow(duffing(), (0.0, 1e4), [0.1, 0.0], max_steps=50)
    assert 0 < caught.value.steps <= 50 and np.isfinite(caught.value.x).all()
    with pytest.raises(InputError, match="ascending"):
        flow(duffing(), (1.0, 1.0), [0.0, 0.0])
    with pytest.raises(UnknownNameError):
        flow(duffing(), (0.0, 1.0), [0.0, 0.0], parameters=("omega",))


def test_transients_settle_on_the_orbit():
    system = duffing()
    times, states, period = settled_orbit(system, system.parameter_vector(xi=0.1), np.zeros(2), 1, np.zeros(2), 400)
    assert abs(period - np.pi) < 1e-14 and np.abs(states[:, -1] - states[:, 0]).max() < 1e-5
    assert times[0] == 0 and abs(times[-1] - period) < 1e-14
    rest = st.System.from_equations({u.diff(t, 2): -u - u.diff(t)}, coordinates=[u], parameters={})
    with pytest.raises(ConvergenceError, match="did not settle"):
        settled_orbit(rest, np.zeros(0), np.array([1.0, 0.0]), 1, np.zeros(2), 10)
