"""Floquet data at parameter nodes: what the Chebyshev tensors of a chart interpolate.

For each node (x, y) the monodromy matrix M over one period is reduced to functions that are analytic in the
parameters and normalised to determinant 1, M0 = M exp(-sigma T), sigma = mean trace of A over n:

    form "hill"        u1'/(2 pi), 2 pi u2, u1, u2' after half a period of y'' + T^2 (k - c^2/4) y = 0 (phase units)
    form "two"         M11 - M22, M12, M21, M11 + M22 of M0
    form "four"        c1, c2, c3 of z^4 - c1 z^3 + c2 z^2 - c3 z + 1 = det(z - M0), then the entries (n = 4)
    form "reciprocal"  the same where c1 = c3 for all parameters (Hamiltonian, or so but for uniform damping)
    form "matrix"      the entries of M0, row by row (other n)

and the clock 1/T and sigma. The values are Richardson-extrapolated Magnus results (order 8); see kernels.propagators.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..floquet.linearisation import PeriodicLinear
from ..floquet.structure import Structure
from ..kernels.characteristic import characteristic_coefficients
from ..kernels.hill import propagate_hill
from ..kernels.propagators import propagate, step_edges

__all__ = ["Sampler"]

Array = NDArray[np.float64]
_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(10)
_TRIED = np.asarray((np.arange(5) + 0.413) / 5.0, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Sampler:
    """Samples of one chart: the linear system, the fixed parameters and which two vary.

    Attributes
    ----------
    linear : PeriodicLinear
    base : (m,) parameter values; columns `x` and `y` are replaced
    x, y : column numbers of the two parameters
    window : (x0, x1, y0, y1)
    structure : Structure
    """

    linear: PeriodicLinear
    base: Array
    x: int
    y: int
    structure: Structure
    window: tuple[float, float, float, float]

    @cached_property
    def form(self) -> str:
        """Which functions are sampled (see the head of this module)."""
        if self.linear.n == 2:
            return "hill" if self.structure.centre is not None else "two"
        if self.linear.n == 4:
            return "reciprocal" if self.is_reciprocal else "four"
        return "matrix"

    @cached_property
    def balance(self) -> Array:
        """Units of the states, (n,), in which rows and columns of A are of like size (SI velocities are not)."""
        x0, x1, y0, y1 = self.window
        P = self.parameters(np.array([0.5 * (x0 + x1)]), np.array([0.5 * (y0 + y1)]))
        size = np.abs(self.linear.A(_TRIED, P)).max(axis=(0, 1))
        np.fill_diagonal(size, 0.0)
        d = np.ones(len(size))
        for _ in range(20):
            for i in range(len(d)):
                row, column = float((size[i] * d).sum()) / d[i], float((size[:, i] / d).sum()) * d[i]
                if row > 0 and column > 0:
                    d[i] *= np.sqrt(row / column)
        return np.asarray(d / d[0])

    @cached_property
    def is_reciprocal(self) -> bool:
        """Whether the polynomial of M0 is its own reciprocal at random points of the window."""
        random = np.random.default_rng(3)
        x0, x1, y0, y1 = self.window
        x, y = x0 + (x1 - x0) * random.random(6), y0 + (y1 - y0) * random.random(6)
        c = characteristic_coefficients(self._normalised(x, y, 256))
        return bool(np.all(np.abs(c - c[::-1]) <= 1e-8 * np.maximum(1.0, np.abs(c).max(axis=0))))

    def parameters(self, x: Array, y: Array) -> Array:
        """Parameters (N, m) at points x (N,), y (N,)."""
        P = np.repeat(self.base[None, :], len(x), axis=0)
        P[:, self.x], P[:, self.y] = x, y
        return P

    def clock(self, x: Array, y: Array) -> Array:
        """1/T and sigma: (2, N)."""
        P = self.parameters(x, y)
        field, breaks = self.linear.bind(P), self.linear.breaks(P)
        if self.structure.trace_free:
            sigma = np.zeros(len(P))
        elif self.structure.constant_trace:
            sigma = np.trace(field(np.array([0.123])), axis1=2, axis2=3)[0] / self.linear.n
        else:
            edges = step_edges(8, breaks)
            edges = edges[:, None] if edges.ndim == 1 else edges
            half, middle = 0.5 * np.diff(edges, axis=0), 0.5 * (edges[1:] + edges[:-1])
            points = middle[:, None] + half[:, None] * _GAUSS_X[:, None]
            weights = np.broadcast_to(half[:, None] * _GAUSS_W[:, None], points.shape).reshape(-1, points.shape[2])
            flat = points.reshape(-1, points.shape[2])
            trace = np.trace(field(flat[:, 0] if flat.shape[1] == 1 else flat), axis1=2, axis2=3)
            sigma = (weights * trace).sum(axis=0) / self.linear.n
        return np.array([1.0 / self.linear.period(P), sigma])

    def matrix(self, x: Array, y: Array, steps: int) -> Array:
        """Monodromy matrices M (N, n, n), not normalised, by one Richardson step from `steps` and half as many."""
        P = self.parameters(x, y)
        period, breaks, field = self.linear.period(P), self.linear.breaks(P), self.linear.bind(P)

        def generator(phase: Array) -> Array:
            return field(phase) * period[:, None, None]

        fine = propagate(generator, step_edges(steps, breaks), len(P))
        coarse = propagate(generator, step_edges(steps // 2, breaks), len(P))
        return fine + (fine - coarse) / 63.0

    def fields(self, x: Array, y: Array, steps: int) -> Array:
        """The functions of the form at points x (N,), y (N,): (Q, N); infinite where they overflow."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self._fields(x, y, steps)

    def _fields(self, x: Array, y: Array, steps: int) -> Array:
        if self.form == "hill":
            return self._half_period(x, y, steps)
        M = self._normalised(x, y, steps)
        if self.form == "two":
            return np.array([M[:, 0, 0] - M[:, 1, 1], M[:, 0, 1], M[:, 1, 0], M[:, 0, 0] + M[:, 1, 1]])
        entries = M.reshape(len(M), -1).T
        return entries if self.form == "matrix" else np.concatenate([characteristic_coefficients(M), entries])

    def _normalised(self, x: Array, y: Array, steps: int) -> Array:
        """M0 = M exp(-sigma T), (N, n, n), in balanced units of the states."""
        clock = self.clock(x, y)
        d = self.balance
        return self.matrix(x, y, steps) * (np.exp(-clock[1] / clock[0])[:, None, None] * (d / d[:, None]))

    def _stiffness(self, x: Array, y: Array, P: Array, shared: bool) -> tuple[Callable[[Array], Array], Array]:
        """k as a function of the phases, (K, N), and c^2/4 (N,), for q'' + c q' + k q = 0.

        Most equations depend on the two parameters through polynomials of low degree at fixed phase. Then k at 3 x 3
        nodes gives it at all others by a matrix product; tried out at some nodes, else k is evaluated everywhere.
        """
        if len(P) > 60 and shared:
            coarse = self.linear.bind(self.parameters(*(g.ravel() for g in np.meshgrid(_three(x), _three(y)))))
            weights = np.einsum("in,jn->jin", _lagrange(x), _lagrange(y)).reshape(9, -1)
            some = np.linspace(0, len(P) - 1, 7).astype(int)
            tried = self.linear.bind(P[some])(_TRIED)[..., 1, :]
            rows = coarse(_TRIED)[..., 1, :]
            both = np.einsum("kcj,cn->knj", rows, weights[:, some])
            if np.abs(both - tried).max() <= 4e-15 * np.abs(rows).max():
                return lambda phase: -(coarse(phase)[..., 1, 0] @ weights), 0.25 * (rows[0, :, 1] @ weights) ** 2
        field = self.linear.bind(P)
        return lambda phase: -field(phase)[..., 1, 0], 0.25 * field(_TRIED[:1])[0, :, 1, 1] ** 2

    def _half_period(self, x: Array, y: Array, steps: int) -> Array:
        """u1'/(2 pi), 2 pi u2, u1, u2' after half a period from the centre of symmetry."""
        P = self.parameters(x, y)
        square = self.linear.period(P) ** 2
        breaks = self.linear.breaks(P)
        field, damping = self._stiffness(x, y, P, breaks.ndim == 1)
        start = float(self.structure.centre or 0.0)
        shifted = np.concatenate([breaks, breaks + 1.0]) if breaks.size else breaks

        def stiffness(phase: Array) -> Array:
            return square * (field(np.mod(phase, 1.0)) - damping)

        fine, coarse = (
            propagate_hill(stiffness, step_edges(s, shifted, start, start + 0.5), len(P)) for s in (steps, steps // 2)
        )
        u1, u2, v1, v2 = fine + (fine - coarse) / 63.0
        return np.array([v1 / (2.0 * np.pi), 2.0 * np.pi * u2, u1, v2])


def _three(x: Array) -> Array:
    """Ends and middle of the range of x."""
    lo, hi = x.min(), x.max()
    return np.array([lo, 0.5 * (lo + hi), hi])


def _lagrange(x: Array) -> Array:
    """Lagrange polynomials of the nodes `_three(x)` at x: (3, N)."""
    lo, hi = x.min(), x.max()
    u = (2.0 * x - lo - hi) / (hi - lo)
    return np.array([0.5 * u * (u - 1.0), (1.0 - u) * (1.0 + u), 0.5 * u * (u + 1.0)])
