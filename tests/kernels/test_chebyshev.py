"""Chebyshev tensors against known expansions; characteristic polynomials against numpy; level curves."""

from __future__ import annotations

import numpy as np
import pytest

from stability.kernels.characteristic import characteristic_coefficients
from stability.kernels.chebyshev import at_points, basis, chop, coefficients, lobatto, tails
from stability.kernels.level_curves import critical_points, rim_roots, trace


def sampled(f, dx, dy):
    return f(lobatto(dx)[None, :], lobatto(dy)[:, None])[None]


def test_interpolation_values_and_gradients_of_an_entire_function():
    def f(u, v):
        return np.exp(0.7 * u) * np.cos(2 * v + u)

    C = coefficients(sampled(f, 24, 24))
    u, v = np.random.default_rng(0).uniform(-1, 1, (2, 50))
    value, in_u, in_v = at_points(C, u, v)
    np.testing.assert_allclose(value[0], f(u, v), atol=1e-14)
    slope = np.exp(0.7 * u) * (0.7 * np.cos(2 * v + u) - np.sin(2 * v + u))
    np.testing.assert_allclose(in_u[0], slope, atol=1e-12)
    np.testing.assert_allclose(in_v[0], -2 * np.exp(0.7 * u) * np.sin(2 * v + u), atol=1e-12)


def test_tails_and_chop_measure_the_truncation():
    C = coefficients(sampled(lambda u, v: 1 / (2.0 - u) + 0 * v, 32, 4))
    kept, lost = chop(C, 1e-9)
    assert kept.shape[1] == 1 and 14 < kept.shape[2] < 24
    u = np.linspace(-1, 1, 99)
    error = np.abs(at_points(kept, u, 0 * u)[0][0] - 1 / (2.0 - u)).max()
    assert error <= lost <= 1e-9
    assert tails(C)[0] < 1e-15 and tails(C)[1] < 1e-15


def test_nodes_are_nested_and_symmetric():
    assert np.array_equal(lobatto(16)[::2], lobatto(8)) and np.array_equal(lobatto(7), -lobatto(7)[::-1])


def test_basis_a_little_outside_the_square_is_the_polynomial():
    u = np.array([-1.0004, 1.0002])
    np.testing.assert_allclose(basis(u, 9)[9], np.polynomial.chebyshev.chebval(u, [0] * 9 + [1]), rtol=1e-12)


@pytest.mark.parametrize("n", [2, 3, 4, 7, 10])
def test_characteristic_coefficients(n):
    M = np.random.default_rng(n).normal(size=(20, n, n))
    expected = np.array([np.poly(m) for m in M])[:, 1:-1].T * np.array([(-1.0) ** k for k in range(1, n)])[:, None]
    np.testing.assert_allclose(characteristic_coefficients(M), expected, rtol=1e-9, atol=1e-9)


def ellipse(u, v):
    return (u / 0.6) ** 2 + (v / 0.3) ** 2 - 1, 2 * u / 0.36, 2 * v / 0.09


def test_a_closed_curve_is_found_by_its_lowest_and_highest_points_and_traced_around():
    assert len(rim_roots(ellipse)) == 0
    special = critical_points(ellipse)
    assert sorted(special[:, 1].round(12)) == [-0.3, 0.3]
    assert special[special[:, 2] > 0][0, 1] == pytest.approx(-0.3, abs=1e-12)
    path, end = trace(ellipse, special[:1, :2], np.array([1.0]))[0]
    assert end == "closed" and np.abs(ellipse(path[:, 0], path[:, 1])[0]).max() < 1e-13
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    assert abs(length - 2.9066) < 3e-2


def test_a_region_narrower_than_any_mesh_is_found():
    width = 1e-6

    def sliver(u, v):
        return (v + 0.2) * width - (u - 0.1234) ** 2, -2 * (u - 0.1234), np.full_like(v, width)

    roots = rim_roots(sliver)
    expected = 0.1234 + np.array([-1, 1]) * np.sqrt(1.2 * width)
    np.testing.assert_allclose(sorted(roots[:, 0]), expected, atol=1e-12)
    special = critical_points(sliver)
    np.testing.assert_allclose(special[0, :2], [0.1234, -0.2], atol=1e-9)
