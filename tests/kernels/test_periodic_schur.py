"""Eigenvalues of products from the factors, against known spectra and 60-digit arithmetic."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from stability.errors import InputError, NonFiniteError
from stability.kernels.periodic_schur import product_eigenvalues


def exact(factors: np.ndarray) -> list:
    with mpmath.workdps(90):
        product = mpmath.eye(factors.shape[1])
        for factor in factors:
            product = mpmath.matrix(factor.tolist()) * product
        return mpmath.eig(product, left=False, right=False)


def relative_errors(values: np.ndarray, witness: list) -> list[float]:
    return [float(min(abs(mpmath.mpc(complex(v)) - w) for v in values) / abs(w)) for w in witness]


@pytest.mark.parametrize(("n", "count"), [(2, 40), (3, 64), (5, 50), (8, 40)])
def test_random_steps(n: int, count: int) -> None:
    """Spectra down to 1e-30 of the norm, pairs included, against 90 digits; eig of the product loses the small ones."""
    random = np.random.default_rng(n)
    factors = np.eye(n) + 0.2 * random.normal(size=(count, n, n)) - 0.08 * np.diag(np.arange(n))
    values = product_eigenvalues(factors)
    witness = exact(factors)
    condition = max(np.linalg.cond(f) for f in factors)
    assert max(relative_errors(values, witness)) < count * 2.3e-16 * max(condition, 10) * 30
    assert np.all(np.diff(np.abs(values)) <= 1e-12 * np.abs(values[:-1]))


def test_known_similarity() -> None:
    """F_j = B_{j+1} D B_j^-1 with B_K = B_0: the eigenvalues are those of D^K, a rotation block and 1e-3 to the 20."""
    random = np.random.default_rng(5)
    count = 20
    bases = [np.linalg.qr(random.normal(size=(4, 4)))[0] + 0.1 * random.normal(size=(4, 4)) for _ in range(count)]
    angle = 0.3
    block = np.zeros((4, 4))
    block[:2, :2] = 0.9 * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    block[2, 2], block[3, 3] = -0.1, 1e-3
    factors = np.array([bases[(j + 1) % count] @ block @ np.linalg.inv(bases[j]) for j in range(count)])
    values = product_eigenvalues(factors)
    assert np.allclose(values[0], 0.9**20 * np.exp(1j * angle * 20), rtol=1e-12) or np.allclose(
        values[1], 0.9**20 * np.exp(1j * angle * 20), rtol=1e-12
    )
    assert abs(values[2] / 1e-20 - 1) < 1e-12 and values[2].imag == 0
    assert abs(values[3] / 1e-60 - 1) < 1e-11


def test_cyclic_shift_leaves_eigenvalues() -> None:
    """F_1 F_K ... F_2 is similar to F_K ... F_1."""
    random = np.random.default_rng(8)
    factors = np.eye(4) + 0.3 * random.normal(size=(30, 4, 4)) - np.diag([0, 0.1, 0.3, 0.6])
    first = product_eigenvalues(factors, logarithm=True)
    second = product_eigenvalues(np.roll(factors, 7, axis=0), logarithm=True)
    assert np.max(np.abs(np.exp(first - second) - 1)) < 1e-11


def test_sum_of_logarithms_is_liouville() -> None:
    """sum log |mu| = sum log |det F_j|, where the product has underflowed."""
    random = np.random.default_rng(9)
    factors = 1e-3 * (np.eye(3) + 0.4 * random.normal(size=(200, 3, 3)))
    logs = product_eigenvalues(factors, logarithm=True)
    assert abs(logs.real.sum() - np.linalg.slogdet(factors)[1].sum()) < 1e-9
    assert np.all(product_eigenvalues(factors) == 0) and logs.real.max() < -1000


def test_zero_and_minus_one() -> None:
    assert product_eigenvalues(np.array([[[-1.0]], [[2.0]]]))[0] == -2.0
    values = product_eigenvalues(np.array([np.diag([1.0, 0.0]), np.diag([2.0, 3.0])]))
    assert values[0] == 2.0 and values[1] == 0.0
    jordan = np.array([[1.0, 1.0], [0.0, 1.0]])
    assert np.allclose(product_eigenvalues(np.array([jordan] * 10)), 1.0, atol=1e-6)


def test_bad_input() -> None:
    with pytest.raises(InputError, match="square"):
        product_eigenvalues(np.zeros((3, 2, 4)))
    with pytest.raises(InputError, match="stack"):
        product_eigenvalues(np.eye(2))
    with pytest.raises(NonFiniteError, match="factor 1"):
        product_eigenvalues(np.array([np.eye(2), np.eye(2) * np.nan]))
