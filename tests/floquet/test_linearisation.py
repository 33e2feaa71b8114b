"""Linearisation about zero, equilibria, orbits and the linear response: closed forms and refusals."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import InputError
from stability.floquet.linearisation import linearise
from stability.floquet.structure import blocks, structure

t = sp.Symbol("t", real=True)


def matrix(linear, phases, **params):
    return linear.A(np.asarray(phases, float), linear.system.parameter_vector(**params))[:, 0]


def test_mathieu_matrix_is_the_closed_form():
    linear = linearise(st.models.mathieu(a=1.0, b=0.5, Omega=2.0, delta=0.1))
    s = np.linspace(0, 1, 9)
    A = matrix(linear, s)
    np.testing.assert_allclose(A[:, 1, 0], -(1 + 0.5 * np.cos(2 * np.pi * s)), atol=1e-15)
    np.testing.assert_allclose(A[:, 1, 1], -0.2, atol=1e-16)
    np.testing.assert_allclose(linear.period(linear.system.parameter_vector()), [np.pi], rtol=1e-15)


def test_the_upright_position_is_found_from_a_rough_guess():
    pendulum = st.models.base_driven_pendulum.from_physical(length=0.1081)
    down, up = linearise(pendulum), linearise(pendulum, {pendulum.states[0]: 3.0})
    np.testing.assert_allclose(matrix(up, [0.1, 0.6])[:, 1, 0], -matrix(down, [0.1, 0.6])[:, 1, 0], rtol=1e-12)


def forced(k=0.0, parametric=0.0):
    x = sp.Function("x")(t)
    f, K, W, p = sp.symbols("f K W p", real=True)
    force = f * sp.cos(W * t) + sp.Rational(1, 2)
    return st.System.from_equations(
        {x.diff(t, 2): -x.diff(t) / 10 - (1 + p * sp.cos(W * t)) * x - K * x**3 + force},
        [x], parameters=dict(f=1.0, K=k, W=2.0, p=parametric), period=2 * sp.pi / W,
    )  # fmt: skip


def test_linear_response_of_a_linear_oscillator_is_its_transfer_function():
    linear = linearise(forced(), "linear")
    P = linear.system.parameter_vector()
    phases = np.linspace(0, 1, 11)[:, None]
    G = 1.0 / (1 - 4 + 0.2j)
    exact = 0.5 + (G * np.exp(2j * np.pi * phases[:, 0])).real
    np.testing.assert_allclose(linear.motion(P).at(phases)[:, 0, 0], exact, atol=1e-14)


def test_linear_response_with_periodic_coefficients_solves_the_equation():
    linear = linearise(forced(parametric=0.4), "linear")
    P = linear.system.parameter_vector()
    motion = linear.motion(P)
    s = np.linspace(0, 1, 13)[:, None]
    x, rate = motion.at(s)[:, 0], motion.rate(s)[:, 0] / np.pi
    F = linear.evaluator.F(s[:, 0].copy(), np.ascontiguousarray(x), P)
    np.testing.assert_allclose(rate, F, atol=1e-12)


def test_a_linear_response_that_is_no_solution_is_refused_with_its_residual():
    linear = linearise(forced(k=0.1), "linear")
    with pytest.raises(InputError, match=r"relative residual .* in x_dot'"):
        matrix(linear, [0.1])


def test_orbit_and_function_of_the_parameters_agree_with_the_linear_response():
    from stability.results.solutions import PeriodicOrbit

    system = forced()

    def orbit(W, f, **_):
        G = f / (1 - W**2 + 0.1j * W)

        def x(time):
            z = G * np.exp(1j * W * np.asarray(time))
            return np.array([0.5 + z.real, (1j * W * z).real])

        return PeriodicOrbit.from_function(system.states, x, 2 * np.pi / W)

    P = np.array([system.parameter_vector(W=w) for w in (0.7, 2.0)])
    s = np.linspace(0, 1, 5)[:, None] * np.ones(2)
    by_function = linearise(system, orbit).motion(P).at(s)
    np.testing.assert_allclose(by_function, linearise(system, "linear").motion(P).at(s), atol=1e-11)
    one = linearise(system, orbit(2.0, 1.0)).motion(P[1:])
    np.testing.assert_allclose(one.at(s[:, :1]), by_function[:, 1:], atol=1e-12)
    with pytest.raises(InputError, match="period"):
        linearise(system, orbit(2.0, 1.0)).motion(P)


def test_zero_that_is_no_solution_and_autonomous_systems_are_refused():
    with pytest.raises(InputError, match="x = 0 is not a solution"):
        matrix(linearise(forced()), [0.0])
    with pytest.raises(InputError, match="autonomous"):
        linearise(st.models.van_der_pol())


def test_blocks_and_structure():
    pendulum = st.models.autoparametric_pendulum.from_acceleration()
    P = pendulum.parameter_vector()
    box = np.array([P * 0.9, P * 1.1])
    linear = linearise(pendulum, "linear")
    assert blocks(linear, box) == ((0, 2), (1, 3))
    theta = linear.block((1, 3))
    full, part = linear.A(np.array([0.2]), P)[0, 0], theta.A(np.array([0.2]), P)[0, 0]
    assert np.array_equal(full[np.ix_([1, 3], [1, 3])], part)
    found = structure(theta, box)
    assert found.scalar and found.constant_damping and not found.trace_free
    coil = st.models.inductance_modulated_circuit()
    C = coil.parameter_vector()
    found = structure(linearise(coil), np.array([C * 0.9, C * 1.1]))
    assert found.scalar and not found.constant_damping and found.centre is None
