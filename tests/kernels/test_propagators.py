"""Transition matrices: closed forms (constant coefficients, Meissner), mpmath's expm, Liouville, order."""

from __future__ import annotations

import itertools

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from stability.kernels.hill import propagate_hill
from stability.kernels.propagators import ordered_product, propagate, step_edges, step_factors, transition


def hill(a, b, shape=np.cos, damping=0.0):
    """Generator of x'' + 2 damping x' + (a + b shape(2 pi s)) x = 0 over T = 2 pi, nodes along a."""
    a, b = np.broadcast_arrays(np.atleast_1d(np.asarray(a, float)), b)

    def generator(s):
        s = np.asarray(s, float)
        s = s[:, None] if s.ndim == 1 else s
        g = np.zeros((len(s), len(a), 2, 2))
        g[..., 0, 1] = 2 * np.pi
        g[..., 1, 0] = -2 * np.pi * (a + b * shape(2 * np.pi * s))
        g[..., 1, 1] = -4 * np.pi * damping
        return g

    return generator


def meissner_trace(a, b):
    p, q = np.sqrt(a + b), np.sqrt(a - b)
    return 2 * np.cos(p * np.pi) * np.cos(q * np.pi) - (p / q + q / p) * np.sin(p * np.pi) * np.sin(q * np.pi)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7])
def test_constant_coefficients_equal_the_matrix_exponential(n):
    matrices = np.random.default_rng(n).normal(size=(5, n, n))
    result, error, _ = transition(lambda s: np.broadcast_to(matrices, (len(s), 5, n, n)), nodes=5)
    with mpmath.workdps(30):  # scipy's expm loses up to four digits on two of these matrices
        exact = [mpmath.expm(mpmath.matrix(m.tolist()), method="taylor") for m in matrices]
    exact = np.array([e.tolist() for e in exact], dtype=float)
    assert np.all(np.abs(result - exact).max(axis=(1, 2)) <= error)
    assert np.all(error < 3e-13 * np.maximum(1, np.abs(exact).max(axis=(1, 2))))


@pytest.mark.parametrize("size", [1e-6, 1.0, 30.0, 200.0])
def test_large_and_small_exponents_of_either_sign(size):
    for sign in (1.0, -1.0):
        m = np.array([[0.3, 1.0], [sign * size, -0.4]])
        result, _, _ = transition(lambda s, m=m: np.broadcast_to(m, (len(s), 1, 2, 2)))
        exact = expm(m)
        assert np.abs(result[0] - exact).max() <= 1e-12 * max(1, np.abs(exact).max())


@pytest.mark.parametrize("steps", [8, 9, 13])
def test_meissner_trace_with_breaks_is_the_closed_form_at_any_step_count(steps):
    a, b = np.array([0.7, 1.3, 4.2]), 0.6
    square = lambda u: np.sign(np.cos(u))  # noqa: E731
    m = propagate(hill(a, b, square), step_edges(steps, [0.25, 0.75]), 3)
    np.testing.assert_allclose(np.trace(m, axis1=1, axis2=2), meissner_trace(a, b), rtol=0, atol=5e-14)


def test_breaks_that_differ_between_nodes():
    duty = np.array([0.2, 0.35, 0.5])
    a, b = 1.1, 0.5

    def generator(s):
        s = s[:, None] if s.ndim == 1 else s
        g = np.zeros((len(s), 3, 2, 2))
        g[..., 0, 1] = 1.0
        g[..., 1, 0] = -(a + b * np.where(s < duty, 1.0, -1.0))
        return g

    m = propagate(generator, step_edges(10, duty[None, :]), 3)
    for d, got in zip(duty, m, strict=True):
        first = expm(d * np.array([[0, 1], [-(a + b), 0]]))
        second = expm((1 - d) * np.array([[0, 1], [-(a - b), 0]]))
        np.testing.assert_allclose(got, second @ first, rtol=0, atol=1e-14)


def test_order_six_and_richardson_order_eight():
    g = hill(1.3, 0.8)
    exact, _, _ = transition(g, tolerance=1e-14, steps=128)
    levels = [propagate(g, step_edges(n)) for n in (16, 32, 64)]
    errors = [np.abs(m - exact).max() for m in levels]
    assert 50 < errors[0] / errors[1] < 90 and 50 < errors[1] / errors[2] < 80
    raised = [np.abs(f + (f - c) / 63 - exact).max() for c, f in itertools.pairwise(levels)]
    assert 180 < raised[0] / raised[1] < 400


def test_error_estimate_bounds_the_error_against_dop853():
    def rhs(t, y, a, b, d):
        x = y.reshape(2, 2)
        return np.array([x[1], -2 * d * x[1] - (a + b * np.cos(t)) * x[0]]).ravel()

    for a, b, d in [(0.3, 0.4, 0.05), (2.2, 1.9, 0.0), (-0.5, 2.0, 0.2)]:
        m, error, _ = transition(hill(a, b, damping=d), tolerance=1e-12)
        y = solve_ivp(rhs, (0, 2 * np.pi), np.eye(2).ravel(), args=(a, b, d), rtol=2.3e-14, atol=1e-15, method="DOP853")
        assert np.abs(m[0] * np.array([[1, 1], [1, 1]]) - y.y[:, -1].reshape(2, 2)).max() < 2e-11
        assert error[0] < 1e-11 * max(1, np.abs(m).max())
        assert abs(np.linalg.det(m[0]) - np.exp(-4 * np.pi * d)) < 1e-12 * max(1, np.abs(m).max() ** 2)


def test_general_matrices_agree_with_the_two_by_two_kernel():
    g = hill([0.3, 1.7], 0.9, damping=0.1)

    def doubled(s):
        small = g(s)
        big = np.zeros((*small.shape[:2], 4, 4))
        big[..., :2, :2] = small
        big[..., 2:, 2:] = small[:, ::-1]
        return big

    edges = step_edges(40)
    two, four = step_factors(g, edges), step_factors(doubled, edges)
    np.testing.assert_allclose(four[..., :2, :2], two, rtol=0, atol=1e-14)
    np.testing.assert_allclose(four[..., 2:, 2:], two[:, ::-1], rtol=0, atol=1e-14)
    assert np.all(four[..., :2, 2:] == 0)


def test_ordered_product_is_the_plain_product():
    factors = np.random.default_rng(1).normal(size=(7, 3, 4, 4))
    plain = factors[0]
    for f in factors[1:]:
        plain = f @ plain
    np.testing.assert_allclose(ordered_product(factors), plain, rtol=1e-12)


def test_two_periods_square_the_matrix_and_blocks_do_not_matter():
    a = np.linspace(0, 2, 900)
    g = hill(a, 0.5)
    one = propagate(g, step_edges(64), 900)
    two = propagate(g, step_edges(128, (), 0.0, 2.0), 900)
    np.testing.assert_allclose(two, one @ one, rtol=0, atol=1e-12)
    np.testing.assert_allclose(one[450], propagate(hill(a[450], 0.5), step_edges(64))[0], atol=1e-13)


@pytest.mark.parametrize("steps", [24, 96])
def test_hill_kernel_is_the_general_kernel_on_a_scalar_equation(steps):
    a, b = np.array([-0.4, 0.8, 3.1]), 1.2
    edges = step_edges(steps)

    def stiffness(s):
        s = s[:, None] if s.ndim == 1 else s
        return 4 * np.pi**2 * (a + b * np.cos(2 * np.pi * s) + 0.3 * np.sin(4 * np.pi * s))

    def generator(s):
        g = np.zeros((len(s), 3, 2, 2))
        g[..., 0, 1] = 1.0
        g[..., 1, 0] = -stiffness(s)
        return g

    planes, matrix = propagate_hill(stiffness, edges, 3), propagate(generator, edges, 3)
    np.testing.assert_allclose(planes.reshape(2, 2, 3).transpose(2, 0, 1), matrix, rtol=1e-12, atol=1e-12)


def test_half_period_factors_give_trace_plus_and_minus_two():
    a, b = np.linspace(-0.5, 4, 7), 1.3

    def stiffness(s):
        return 4 * np.pi**2 * (a + b * np.cos(2 * np.pi * s)[:, None])

    u1, u2, v1, v2 = propagate_hill(stiffness, step_edges(200, (), 0.0, 0.5), 7)
    whole = propagate_hill(stiffness, step_edges(400), 7)
    trace = whole[0] + whole[3]
    np.testing.assert_allclose(4 * v1 * u2, trace - 2, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(4 * u1 * v2, trace + 2, rtol=1e-11, atol=1e-11)
