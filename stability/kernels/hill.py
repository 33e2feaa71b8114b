"""Scalar Hill equations y'' + K(s) y = 0 by Magnus order 6 in closed form, batched; the four half-period factors.

Equation and convention
-----------------------
y'' = -K(s) y with the phase s as independent variable (K = T^2 k for x'' + k(t) x = 0 of period T). u1, u2 are the
solutions with u1 = 1, u1' = 0 and u2 = 0, u2' = 1 at the start. The Magnus exponent of `propagators` collapses: with
K1, K2, K3 at the Gauss points of a step h,

    p = -h K2,   q = -(sqrt(15) h / 3) (K3 - K1),   r = -(10 h / 3) (K3 - 2 K2 + K1),
    exponent = [[e, f], [g, -e]],
    e = (-20 h q + (4/3) h^2 p q + h^2 q r / 30) / 240,
    f = h + (h^3 q^2 / 15 - (4/3) h^2 r) / 240,
    g = p + r / 12 + ((4/3) h p r + h r^2 / 15 - 2 h q^2 + h^2 q^2 p / 15) / 240.

Half-period factors: if K(s0 + s) = K(s0 - s) and u1, u2 start at s0, then with h = 1/2 (half a period)

    tr - 2 = 4 u1'(s0 + h) u2(s0 + h),      tr + 2 = 4 u1(s0 + h) u2'(s0 + h):

half the integration, half the exponent range, and tr -+ 2 keeps its relative accuracy at the limits of stability,
where the multipliers depend on it by a square root.

References: S. Blanes, F. Casas, J. A. Oteo, J. Ros, Physics Reports 470 (2009) 151; W. Magnus, S. Winkler, Hill's
equation (1966), section 1.3.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .propagators import cosh_sinhc

__all__ = ["propagate_hill"]

Array = NDArray[np.float64]
_BLOCK = 24_000


def propagate_hill(stiffness: Callable[[Array], Array], edges: Array, nodes: int = 1) -> Array:
    """Fundamental solutions of y'' + K(s) y = 0 over all steps.

    Parameters
    ----------
    stiffness : phases (K,) or (K, N) -> (K, N), K(s) of every node.
    edges : (S + 1,) or (S + 1, N) phases, see `propagators.step_edges`.
    nodes : N, to size the blocks.

    Returns
    -------
    (4, N) : u1, u2, u1', u2' at the last edge.

    >>> u1, u2, v1, v2 = propagate_hill(lambda s: np.full((len(s), 1), np.pi**2), np.linspace(0, 0.5, 5))
    >>> bool(abs(u1[0]) < 1e-15 and abs(u2[0] - 1 / np.pi) < 1e-15)
    True
    """
    edges = np.asarray(edges, dtype=float)
    block = max(1, _BLOCK // max(1, nodes))
    total: Array | None = None
    for first in range(0, len(edges) - 1, block):
        part = _tree(_steps(stiffness, edges[first : first + block + 1]))
        total = part if total is None else _times(part, total)
    assert total is not None
    return total


def _steps(stiffness: Callable[[Array], Array], edges: Array) -> Array:
    """Step matrices as planes (4, S, N): m11, m12, m21, m22."""
    steps = len(edges) - 1
    half, middle = 0.5 * (edges[1:] - edges[:-1]), 0.5 * (edges[1:] + edges[:-1])
    shift = 2.0 * np.sqrt(0.15) * half
    values = stiffness(np.concatenate([middle - shift, middle, middle + shift]))
    k1, k2, k3 = values[:steps], values[steps : 2 * steps], values[2 * steps :]
    h = 2.0 * (half[:, None] if half.ndim == 1 else half)
    h2 = h * h
    p = -h * k2
    q = (-np.sqrt(15.0) / 3.0 * h) * (k3 - k1)
    r = (-10.0 / 3.0 * h) * (k1 + k3) + (20.0 / 3.0 * h) * k2
    qq = q * q
    e = q * ((h2 / 180.0) * p + (h2 / 7200.0) * r - h / 12.0)
    f = h + (h * h2 / 3600.0) * qq - (h2 / 180.0) * r
    g = p + r * (1.0 / 12.0 + (h / 180.0) * p + (h / 3600.0) * r) + qq * ((h2 / 3600.0) * p - h / 120.0)
    cosh, sinhc = cosh_sinhc(e * e + f * g)
    out = np.empty((4, *e.shape))
    e *= sinhc
    np.add(cosh, e, out=out[0])
    np.multiply(sinhc, f, out=out[1])
    np.multiply(sinhc, g, out=out[2])
    np.subtract(cosh, e, out=out[3])
    return out


def _tree(factors: Array) -> Array:
    """Product of the step matrices (4, S, N), the last step on the left: (4, N)."""
    while factors.shape[1] > 1:
        even = factors.shape[1] // 2 * 2
        paired = _times(factors[:, 1:even:2], factors[:, 0:even:2])
        factors = paired if even == factors.shape[1] else np.concatenate([paired, factors[:, even:]], axis=1)
    return factors[:, 0]


def _times(left: Array, right: Array) -> Array:
    """Product of 2 x 2 matrices given as planes (4, ...)."""
    out = np.empty(np.broadcast_shapes(left.shape, right.shape))
    for i in (0, 2):
        for j in (0, 1):
            np.multiply(left[i], right[j], out=out[i + j])
            out[i + j] += left[i + 1] * right[j + 2]
    return out
