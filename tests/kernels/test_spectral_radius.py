"""Closed-form spectral radius of quartics against numpy's companion eigenvalues and constructed roots."""

from __future__ import annotations

import numpy as np
import pytest

from stability.kernels.spectral_radius import four_states, four_states_reciprocal

RNG = np.random.default_rng(5)


def coefficients(roots):
    """c1, c2, c3 of prod (z - root) with unit product of the roots."""
    out = np.array([np.poly(r).real for r in roots])
    return np.array([-out[:, 1], out[:, 2], -out[:, 3]])


def pairs(count, reciprocal):
    """Roots of real quartics of unit determinant: complex pairs, real pairs, and mixtures."""
    rows = []
    for _ in range(count):
        kind = RNG.integers(3)
        if reciprocal:
            if kind == 0:
                z = np.exp(RNG.normal() * 0.5 + 1j * RNG.uniform(0, np.pi))
                rows.append([z, z.conj(), 1 / z, 1 / z.conj()])
            else:
                row = []
                for _ in range(2):
                    if RNG.random() < 0.5:
                        z = np.exp(1j * RNG.uniform(0, np.pi))
                        row += [z, z.conj()]
                    else:
                        r = np.exp(RNG.normal()) * RNG.choice([-1, 1])
                        row += [r, 1 / r]
                rows.append(row)
        else:
            q = np.exp(RNG.normal())
            row = []
            for product in (q, 1 / q):
                if RNG.random() < 0.5:
                    z = np.sqrt(product) * np.exp(1j * RNG.uniform(0, np.pi))
                    row += [z, z.conj()]
                else:
                    r = np.exp(RNG.normal()) * RNG.choice([-1, 1])
                    row += [r, product / r]
            rows.append(row)
    return np.array(rows, dtype=complex)


@pytest.mark.parametrize("reciprocal", [True, False])
def test_radius_and_kind_from_constructed_roots(reciprocal):
    roots = pairs(20000, reciprocal)
    c = coefficients(roots)
    exact = np.log(np.abs(roots).max(axis=1))
    gap = np.abs(roots[:, :, None] - roots[:, None, :]) + 10 * np.eye(4)
    separated = gap.min(axis=(1, 2)) > 0.05
    for function in (four_states, four_states_reciprocal) if reciprocal else (four_states,):
        theta, kind, _ = function(c)
        assert np.abs(theta - exact)[separated].max() < 2e-10
        largest = roots[np.arange(len(roots)), np.abs(roots).argmax(axis=1)]
        expected = np.where(np.abs(largest.imag) > 1e-12, 3, np.where(largest.real > 0, 1, 2))
        clear = separated & (exact > 1e-6)
        second = np.sort(np.abs(roots), axis=1)
        clear &= (second[:, 3] - second[:, 1] > 1e-6) | (expected == 3)
        single = clear & ((second[:, 3] - second[:, 2] > 1e-6) | (expected == 3))
        assert np.mean(kind[single] == expected[single]) == 1.0


def test_sensitivity_bounds_the_error_of_perturbed_coefficients():
    roots = pairs(5000, False)
    c = coefficients(roots)
    theta, _, slope = four_states(c)
    moved, _, _ = four_states(c + 1e-9 * RNG.choice([-1, 1], size=c.shape))
    radius = np.exp(theta)
    bound = 1e-9 * (radius + radius**2 + radius**3) * slope
    usable = bound < 1e-5
    assert usable.mean() > 0.95
    assert np.all(np.abs(moved - theta)[usable] <= 1.2 * bound[usable] + 1e-12)


def test_near_the_unit_circle_the_reciprocal_form_keeps_its_digits():
    w = 2.0 + np.array([1e-12, 1e-9, 1e-6, 1e-3])
    c = np.array([w + 0.3, 2.0 + 0.3 * w, w + 0.3])
    theta, kind, margin = four_states_reciprocal(c)
    np.testing.assert_allclose(theta, np.arccosh(w / 2), rtol=1e-3, atol=3e-8)
    assert np.all(kind == 1) and np.all(margin > 0)
