"""Fourier kernel and Hill matrices against definitions, products in time, and closed forms of linear systems."""

import numpy as np
import pytest

from stability.kernels.fourier import derivative, fourier_basis, ranks, resized, series, stretched, tail_fit
from stability.kernels.hill_matrix import hill_matrix, koopman_hill, mean_harmonics, selected


@pytest.mark.parametrize("harmonics", [1, 2, 5, 12])
def test_multiplication_is_the_projected_product(harmonics):
    """Toeplitz + Hankel against G+ diag(j) G, for j with all harmonics that the samples hold."""
    basis = fourier_basis(harmonics, 4 * harmonics + 4)
    values = np.random.default_rng(harmonics).standard_normal((basis.samples, 3))
    T = basis.multiplication(values)
    for i in range(3):
        direct = basis.analysis @ (values[:, i, None] * basis.synthesis)
        assert np.abs(T[:, :, i] - direct).max() < 1e-14 * basis.samples
    assert np.abs(basis.times_derivative(T)[:, :, 0] - basis.analysis @ (values[:, :1] * basis.slope)).max() < 1e-12


def test_derivative_of_a_known_function():
    """x = 1 + cos 2t + 3 sin 3t has x' = -2 sin 2t + 9 cos 3t."""
    c = np.zeros(7)
    c[0], c[3], c[6] = 1.0, 1.0, 3.0
    d = derivative(c)
    assert d.tolist() == [0, 0, 0, 0, -2, 9, 0]
    s = np.linspace(0, 1, 13)
    assert np.allclose(series(3, s) @ d, -2 * np.sin(4 * np.pi * s) + 9 * np.cos(6 * np.pi * s), atol=1e-13)


def test_resizing_and_stretching_keep_the_function():
    c = np.random.default_rng(0).standard_normal(9)
    s = np.linspace(0, 1, 11)
    assert np.allclose(series(7, s) @ resized(c, 7), series(4, s) @ c)
    assert np.allclose(series(8, s) @ stretched(c, 2, 8), series(4, 2 * s) @ c, atol=1e-12)
    assert ranks(2).tolist() == [0, 1, 1, 2, 2]


def test_tails_are_told_apart():
    """Geometric and algebraic sequences with every second harmonic missing, as symmetric motions have."""
    k = np.arange(1.0, 41)
    odd = k % 2 == 1
    ratio, _, geometric = tail_fit(np.where(odd, 0.7**k, 0.0))
    assert geometric and abs(ratio - 0.7) < 0.02
    _, power, geometric = tail_fit(np.where(odd, k**-3.0, 0.0))
    assert not geometric and abs(power - 3) < 0.2


def _products(A, harmonics):
    n, count = A.shape[1], 2 * harmonics + 1
    return fourier_basis(harmonics, len(A)).multiplication(A.reshape(len(A), -1)).reshape(count, count, n, n)


def test_hill_matrix_of_a_constant_system_is_exact():
    """Exponents of x'' + 0.1 x' + 0.4 x = 0, each shifted by whole multiples of omega; multipliers by exp(A T)."""
    A = np.tile([[0.0, 1.0], [-0.4, -0.1]], (40, 1, 1))
    values, vectors = np.linalg.eig(hill_matrix(_products(A, 3), 1.3))
    own = np.linalg.eigvals(A[0])
    expected = np.sort_complex((own[:, None] + 1.3j * np.arange(-3, 4)).ravel().round(10))
    assert np.abs(np.sort_complex(values.round(10)) - expected).max() < 1e-9
    chosen, certain = selected(values, mean_harmonics(vectors, 2)[1], 1.3, 2)
    assert certain
    T = 2 * np.pi / 1.3
    mu, truth = np.exp(T * values[chosen]), np.exp(T * own)
    assert np.abs(mu[:, None] - truth).min(axis=0).max() < 1e-12
    assert np.abs(mu[:, None] - truth).min(axis=1).max() < 1e-12


@pytest.mark.parametrize("a", [0.2, 0.24, 0.25, 0.26, 0.3])
def test_exponents_at_half_the_frequency_are_taken_once(a):
    """Inside and beside the period-2 tongue of x'' + (a + 0.2 cos t) x = 0: multipliers by `monodromy` (Magnus)."""
    import stability as st

    s = np.arange(80) / 80
    A = np.zeros((80, 2, 2))
    A[:, 0, 1], A[:, 1, 0] = 1.0, -(a + 0.2 * np.cos(2 * np.pi * s))
    values, vectors = np.linalg.eig(hill_matrix(_products(A, 9), 1.0))
    chosen, _ = selected(values, mean_harmonics(vectors, 2)[1], 1.0, 2)
    mu = np.sort_complex(np.exp(2 * np.pi * values[chosen]))
    truth = np.sort_complex(st.monodromy(st.models.mathieu(a=a, b=0.2, delta=0.0)).multipliers)
    # at the edge of a tongue the two are a double value, whose error is the square root of rounding
    assert np.abs(mu - truth).max() < 1e-6
    Phi = koopman_hill(A, 1.0, 9)
    assert np.abs(np.sort_complex(np.linalg.eigvals(Phi)) - truth).max() < 1e-6


def test_koopman_hill_converges_to_the_monodromy_matrix():
    """Mathieu with a = 1, b = 0.8: error falls by orders with H; both forms."""
    import stability as st

    s = np.arange(160) / 160
    A = np.zeros((160, 2, 2))
    A[:, 0, 1], A[:, 1, 0] = 1.0, -(1.0 + 0.8 * np.cos(2 * np.pi * s))
    truth = st.monodromy(st.models.mathieu(a=1.0, b=0.8, delta=0.0)).matrix
    for subharmonic in (False, True):
        errors = [np.abs(koopman_hill(A, 1.0, H, subharmonic) - truth).max() for H in (4, 8, 16)]
        assert errors[0] > errors[1] > errors[2]
        assert errors[2] < 1e-9
