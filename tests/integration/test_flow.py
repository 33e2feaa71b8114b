"""The flow against closed forms and scipy; its derivatives against differences; order conditions of the tables."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.linalg import expm, expm_frechet

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


@pytest.mark.parametrize("n, parameters", [(1, ()), (2, ("k",)), (3, ()), (5, ("k",)), (7, ("k", "c"))])
def test_linear_systems_of_every_width_against_the_exponential(n, parameters):
    """x' = (k A + c B) x with zeros in A: matrix = exp(t (k A + c B)), its derivatives by Frechet's; dense output, too.

    The kernel sums four entries at a time, so every remainder of n (1 + columns) by four has to be right.
    """
    values = np.random.default_rng(n)
    A = np.where(values.random((n, n)) < 0.5, values.standard_normal((n, n)), 0.0)
    B = values.standard_normal((n, n))
    k, c = sp.symbols("k c", real=True)
    names = tuple(f"x{a}" for a in range(n))
    rhs = sp.Matrix(k * sp.Matrix(A) + c * sp.Matrix(B)) * sp.Matrix(sp.symbols(names, real=True))
    system = st.System("linear", names, names, {"k": 0.7, "c": 0.4}, tuple(rhs))
    x0, M = values.standard_normal(n), 0.7 * A + 0.4 * B
    end = flow(system, (0.0, 1.5), x0, rtol=1e-12, atol=1e-13, variations=True, parameters=parameters, dense=True)
    matrix = expm(1.5 * M)
    size = np.abs(matrix).max()
    assert np.abs(end.matrix - matrix).max() < 1e-10 * size
    assert np.abs(end.x - matrix @ x0).max() < 1e-10 * size * np.abs(x0).max()
    assert np.abs(end(0.9) - expm(0.9 * M) @ x0).max() < 1e-8 * size
    for column, name in enumerate(parameters):
        wanted = expm_frechet(1.5 * M, 1.5 * {"k": A, "c": B}[name], compute_expm=False) @ x0
        assert np.abs(end.by_parameter[:, column] - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_the_last_steps_are_of_one_length():
    """What is left of an interval is no sliver: on q'' + q = 0, where all steps have one length, neither has the last."""
    system = st.System.from_equations({u.diff(t, 2): -u}, coordinates=[u], parameters={})
    for end in np.linspace(20.0, 24.0, 9):
        steps = np.diff(flow(system, (0.0, float(end)), dict(u=1.0), rtol=1e-9, atol=1e-11, dense=True).times)
        assert steps[-1] > 0.45 * np.median(steps)
        assert steps[4:].max() < 1.2 * np.median(steps)


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
