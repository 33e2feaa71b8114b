"""Singular borders and bordered systems: numpy's decomposition, and the defining equations themselves."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from stability.kernels import bordering


@numba.njit
def borders(lapack, A, W, V):
    bordering.borders(lapack, A, W, V)


@numba.njit
def bordered(lapack, A, W, V, w, v, G):
    return bordering.bordered(lapack, A, W, V, w, v, G)


def matrix(k, small, seed):
    """Random with singular values 1 .. k, the last ones replaced by `small`."""
    rng = np.random.default_rng(seed)
    left, right = (np.linalg.qr(rng.standard_normal((k, k)))[0] for _ in range(2))
    sizes = np.arange(k, 0, -1.0)
    sizes[k - len(small) :] = small
    return left * sizes @ right.T, left, right


@pytest.mark.parametrize(("k", "small"), [(1, [0.3]), (2, [1e-9]), (4, [0.0]), (4, [0.2, 1e-12]), (9, [1e-3, 1e-3])])
def test_borders_span_what_the_small_singular_values_belong_to(k, small):
    A, left, right = matrix(k, small, 1)
    a = len(small)
    W, V, w, v, G = (np.full(shape, np.nan) for shape in [(k, a)] * 4 + [(a, a)])
    kept = A.copy()
    borders(bordering.lapack(), A, W, V)
    assert np.array_equal(A, kept)
    for got, exact in ((W, left[:, k - a :]), (V, right[:, k - a :])):
        assert np.abs(got.T @ got - np.eye(a)).max() < 1e-14
        assert np.abs(got @ got.T - exact @ exact.T).max() < 1e-12
    sign = bordered(bordering.lapack(), A, W, V, w, v, G)
    assert np.abs(w - W).max() < 1e-12 and np.abs(v - V).max() < 1e-12
    assert np.abs(G + W.T @ A @ V).max() < 1e-14 * k
    assert sorted(np.linalg.svd(G)[1]) == pytest.approx(sorted(small), abs=1e-14)
    K = np.block([[A, W], [V.T, np.zeros((a, a))]])
    assert sign == np.sign(np.linalg.det(K))


@pytest.mark.parametrize("a", [1, 2])
def test_any_borders_solve_the_bordered_equations(a):
    rng = np.random.default_rng(5)
    A, W, V = rng.standard_normal((5, 5)), rng.standard_normal((5, a)), rng.standard_normal((5, a))
    w, v, G = np.empty((5, a)), np.empty((5, a)), np.empty((a, a))
    sign = bordered(bordering.lapack(), A, W, V, w, v, G)
    K = np.block([[A, W], [V.T, np.zeros((a, a))]])
    assert np.abs(A @ v + W @ G).max() < 1e-13 and np.abs(V.T @ v - np.eye(a)).max() < 1e-13
    assert np.abs(w.T @ A + G @ V.T).max() < 1e-13 and np.abs(W.T @ w - np.eye(a)).max() < 1e-13
    assert sign == np.sign(np.linalg.det(K))
    if a == 1:
        assert G[0, 0] == pytest.approx(np.linalg.det(A) / np.linalg.det(K), rel=1e-12)


def test_what_is_not_finite_or_singular_is_told():
    W, V, w, v, G = (np.zeros(shape) for shape in [(2, 1)] * 4 + [(1, 1)])
    borders(bordering.lapack(), np.array([[1.0, np.nan], [0.0, 1.0]]), W, V)
    assert np.isnan(W).all() and np.isnan(V).all()
    assert bordered(bordering.lapack(), np.diag([1.0, 0.0]), np.array([[1.0], [0.0]]), np.array([[1.0], [0.0]]), w, v, G) == 0
