"""Coefficients of Gauss-Legendre collocation in stage form.

On one interval of length h with left node value u and stage values Y_1 .. Y_m at the Gauss points c_1 < .. < c_m of
[0, 1], the Runge-Kutta equations Y = u + h A F(Y), u_+ = u + h b'F(Y) are written with W = A^-1 and d = b'W:

    sum_k W_ik (Y_k - u) = h F(Y_i),        u_+ = (1 - sum d) u + sum_i d_i Y_i.

F stands outside the sums, so the off-diagonal blocks of the Jacobian are multiples of the identity. The collocation
polynomial is the polynomial of degree m through (0, u), (c_i, Y_i). Order 2m at the nodes, m + 1 uniformly.
Reference: E. Hairer, S. P. Norsett, G. Wanner (1993), Solving Ordinary Differential Equations I, section II.7.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stability.errors import InputError

__all__ = ["GaussRule", "gauss_rule", "lagrange_matrix"]


@dataclass(frozen=True)
class GaussRule:
    """The numbers of one degree m.

    Attributes
    ----------
    points : (m,) array
        Gauss points c_i on (0, 1), ascending.
    weights : (m,) array
        Quadrature weights b_i, sum 1: the integral over an interval is h sum b_i f(c_i), exact to degree 2m - 1.
    matrix, inverse : (m, m) arrays
        A and W = A^-1.
    row_sums : (m,) array
        sum_k W_ik.
    update : (m,) array
        d = b'W.
    leading : (m + 1,) array
        The coefficient of x^m of the polynomial through the values at (0, c_1, .., c_m).
    """

    degree: int
    points: np.ndarray
    weights: np.ndarray
    matrix: np.ndarray
    inverse: np.ndarray
    row_sums: np.ndarray
    update: np.ndarray
    leading: np.ndarray

    @property
    def abscissae(self) -> np.ndarray:
        """(0, c_1, .., c_m): where the collocation polynomial is fixed."""
        return np.concatenate([[0.0], self.points])


def lagrange_matrix(abscissae: np.ndarray, at: np.ndarray, derivative: bool = False) -> np.ndarray:
    """Values (or first derivatives) at `at` of the Lagrange polynomials of `abscissae`: (len(at), len(abscissae)).

    >>> lagrange_matrix(np.array([0.0, 1.0]), np.array([0.25]))
    array([[0.75, 0.25]])
    """
    x, t = np.asarray(abscissae, float), np.atleast_1d(np.asarray(at, float))
    size = len(x)
    scale = np.prod(x[:, None] - x + np.eye(size), axis=1)
    if not derivative:
        ones, gaps = np.ones((len(t), 1)), t[:, None] - x
        left = np.cumprod(np.concatenate([ones, gaps[:, :-1]], axis=1), axis=1)
        right = np.cumprod(np.concatenate([ones, gaps[:, :0:-1]], axis=1), axis=1)[:, ::-1]
        return np.asarray(left * right / scale)
    out = np.zeros((len(t), size))
    for k in range(size):
        others = np.delete(x, k)
        for drop in range(size - 1):
            out[:, k] += np.prod(t[:, None] - np.delete(others, drop), axis=1) / scale[k]
    return out


@lru_cache(maxsize=32)
def gauss_rule(degree: int) -> GaussRule:
    """The coefficients of degree m = `degree` (1 to 12).

    Accuracy: entries to about 1e-14 for m <= 8 (checked against exact moments in the tests).

    >>> gauss_rule(1).inverse
    array([[2.]])
    """
    if not 1 <= int(degree) <= 12:
        raise InputError(f"degree = {degree}: the collocation degree must be an integer from 1 to 12 (default 5)")
    nodes, weights = np.polynomial.legendre.leggauss(int(degree))
    c, b = (nodes + 1) / 2, weights / 2
    size = len(c)
    fine, fine_weights = np.polynomial.legendre.leggauss(size)  # exact for the integrand's degree m - 1
    A = np.empty((size, size))
    for i in range(size):
        A[i] = (c[i] / 2) * fine_weights @ lagrange_matrix(c, c[i] * (fine + 1) / 2)
    W = np.linalg.inv(A)
    x = np.concatenate([[0.0], c])
    leading = np.array([1 / np.prod(x[k] - np.delete(x, k)) for k in range(size + 1)])
    rule = GaussRule(size, c, b, A, W, W.sum(axis=1), b @ W, leading)
    for array in (c, b, A, W, rule.row_sums, rule.update, leading):
        array.setflags(write=False)
    return rule
