"""Gauss coefficients against exact moments and the order conditions; meshes against their definition."""

from __future__ import annotations

import numpy as np
import pytest

from stability.errors import InputError
from stability.kernels.gauss import gauss_rule, lagrange_matrix
from stability.kernels.meshes import equidistribute, monitor, uniform_edges


@pytest.mark.parametrize("degree", range(1, 9))
def test_moments_are_exact(degree):
    rule = gauss_rule(degree)
    c, b, A = rule.points, rule.weights, rule.matrix
    for k in range(2 * degree):  # quadrature exact to degree 2m - 1
        assert abs(b @ c**k - 1 / (k + 1)) < 1e-14
    for k in range(degree):  # stage order m
        assert np.abs(A @ c**k - c ** (k + 1) / (k + 1)).max() < 1e-14


@pytest.mark.parametrize("degree", (1, 4, 5, 8))
def test_stability_function_is_the_pade_approximant(degree):
    """R(z) = 1 + z b (I - zA)^-1 1 has |R(iy)| = 1: Gauss methods conserve the oscillator's energy."""
    rule = gauss_rule(degree)
    z = 0.7j
    R = 1 + z * rule.weights @ np.linalg.solve(np.eye(degree) - z * rule.matrix, np.ones(degree))
    assert abs(abs(R) - 1) < 1e-13
    assert abs(rule.inverse @ rule.matrix - np.eye(degree)).max() < 1e-11


def test_interpolation_reproduces_polynomials_and_their_derivatives():
    x = gauss_rule(5).abscissae
    at = np.linspace(0, 1, 7)
    assert np.abs(lagrange_matrix(x, at) @ x**5 - at**5).max() < 1e-13
    assert np.abs(lagrange_matrix(x, at, derivative=True) @ x**5 - 5 * at**4).max() < 1e-12


def test_wrong_degree_says_what_is_allowed():
    with pytest.raises(InputError, match="from 1 to 12"):
        gauss_rule(0)


def test_mesh_points_stay_on_breaks_and_share_the_error_equally():
    breaks = np.array([0.25, 0.7])
    edges = uniform_edges(12, breaks)
    assert len(edges) == 13 and all(np.abs(edges - b).min() == 0 for b in breaks)
    # a layer at 0.5: x^(m+1) ~ 1 / width^(m+1) inside of it
    rho = np.where(np.abs(edges[:-1] + np.diff(edges) / 2 - 0.5) < 0.1, 30.0, 1.0)
    new = equidistribute(edges, rho, 40, breaks)
    assert len(new) == 41 and (np.diff(new) > 0).all()
    assert all(np.abs(new - b).min() == 0 for b in breaks)
    share = np.interp(
        new, edges, np.concatenate([[0], np.cumsum(np.maximum(rho, 0.2 * rho @ np.diff(edges)) * np.diff(edges))])
    )
    inner = [np.diff(share[(new >= lo) & (new <= hi)]) for lo, hi in ((0, 0.25), (0.25, 0.7), (0.7, 1.0))]
    assert all(np.ptp(part) < 1e-12 for part in inner)


def test_monitor_measures_the_next_derivative_and_not_the_jumps_at_breaks():
    """x = s^6 with m = 5: x^(6) = 720, and leading = x^(5)/5! = 6 s, whose slope is 6; a jump at a break is ignored."""
    edges = np.linspace(0, 1, 11)
    middle = edges[:-1] + 0.05
    smooth = monitor(edges, 6 * middle[:, None], 5, np.zeros(1))
    assert np.abs(smooth - 6 ** (1 / 6)).max() < 1e-12
    jump = 6 * middle + 1e6 * (middle > 0.5)
    assert np.abs(monitor(edges, jump[:, None], 5, np.array([0.0, 0.5])) - 6 ** (1 / 6)).max() < 1e-9
