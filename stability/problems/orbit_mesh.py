"""The discretisation of a periodic orbit: mesh, Gauss points, phases, layout of the unknowns.

Scaled time s in [0, 1] covers the fraction `span` of the forcing period (span = 1; 2 for a doubled orbit; 1/2 for an
orbit with x(t + T/2) = S x(t)) or of the orbit's own period T of an autonomous system. Unknowns, in this order:

    u = (nodes x(s_j), j = 0 .. N;   stages x(s_j + c_i h_j);   T for autonomous systems)        N >= 1 intervals.

Equations in the same places: node equations and the boundary condition x(1) = S x(0) + w; stage equations; phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from stability.kernels.gauss import GaussRule, gauss_rule, lagrange_matrix

__all__ = ["OrbitMesh"]

Array = np.ndarray


@lru_cache(maxsize=64)
def _between_degrees(degree: int, other: int) -> Array:
    """(m', m + 1): values at (0, c_1, .., c_m) -> values at the Gauss points of another degree."""
    return lagrange_matrix(gauss_rule(degree).abscissae, gauss_rule(other).points)


@dataclass(frozen=True, eq=False)
class OrbitMesh:
    """Mesh of degree m on edges (N + 1,) for n states; `own` = 1 when the period is an unknown."""

    edges: Array
    degree: int
    n: int
    span: float
    own: int

    @cached_property
    def intervals(self) -> int:
        """N."""
        return len(self.edges) - 1

    @cached_property
    def _parts(self) -> tuple[int, int, tuple[int, int], tuple[int, int]]:
        """End of the nodes, end of the stages, and the shapes of both."""
        N, n, m = self.intervals, self.n, self.degree
        return (N + 1) * n, (N + 1) * n + N * m * n, (N + 1, n), (N, m * n)

    @cached_property
    def rule(self) -> GaussRule:
        """Gauss coefficients."""
        return gauss_rule(self.degree)

    @cached_property
    def h(self) -> Array:
        """(N,) interval lengths."""
        return np.diff(self.edges)

    @cached_property
    def points(self) -> Array:
        """(N, m) Gauss points in s."""
        return np.asarray(self.edges[:-1, None] + self.h[:, None] * self.rule.points)

    @cached_property
    def phase(self) -> Array:
        """(N m,) forcing phase of the Gauss points, frac(span s)."""
        return np.ascontiguousarray(np.mod(self.span * self.points.ravel(), 1.0))

    @cached_property
    def weights(self) -> Array:
        """(N m,) of the quadrature over s at the Gauss points."""
        return np.ascontiguousarray((self.h[:, None] * self.rule.weights).ravel())

    @cached_property
    def size(self) -> int:
        """Length of u."""
        return self._parts[1] + self.own

    def split(self, u: Array) -> tuple[Array, Array, Array]:
        """Views: nodes (N + 1, n), stages (N, m n), rest (own,)."""
        first, last, nodes, stages = self._parts
        return u[:first].reshape(nodes), u[first:last].reshape(stages), u[last:]

    def join(self, nodes: Array, stages: Array, rest: Array | float = 0.0) -> Array:
        """u from its parts."""
        first, last, _, _ = self._parts
        u = np.empty(last + self.own)
        u[:first], u[first:last], u[last:] = nodes.ravel(), stages.ravel(), rest
        return u

    def polynomial(self, nodes: Array, stages: Array) -> Array:
        """Values (N, m + 1, n) at the local abscissae (0, c_1, .., c_m)."""
        out = np.empty((self.intervals, self.degree + 1, self.n))
        out[:, 0], out[:, 1:] = nodes[:-1], stages.reshape(self.intervals, self.degree, self.n)
        return out

    def leading(self, nodes: Array, stages: Array) -> Array:
        """(N, n): the m-th derivative over m! of the polynomial with respect to s."""
        return np.asarray(self.last_terms(nodes, stages) * self._derivative[2])

    def last_terms(self, nodes: Array, stages: Array) -> Array:
        """(N, n): the coefficient of the highest power, h^m times the m-th derivative over m!."""
        matrix, first, _ = self._derivative
        return np.asarray(stages @ matrix + first * nodes[:-1])

    @cached_property
    def _derivative(self) -> tuple[Array, float, Array]:
        """The m-th derivative: (m n, n) on the stages of an interval, a factor of its left node, h^-m (N, 1)."""
        first, *rest = self.rule.leading
        return np.kron(np.array(rest)[:, None], np.eye(self.n)), float(first), self.h[:, None] ** -self.degree

    def transfer(self, other: OrbitMesh, *vectors: Array) -> list[Array]:
        """Vectors u of this mesh as vectors of `other` (same n, span and own)."""
        s = np.concatenate([other.edges, other.points.ravel()])
        piece = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, self.intervals - 1)
        basis = lagrange_matrix(self.rule.abscissae, (s - self.edges[piece]) / self.h[piece])[:, None, :]
        out = []
        for u in vectors:
            nodes, stages, rest = self.split(u)
            values = (basis @ self.polynomial(nodes, stages)[piece])[:, 0]
            values[other.intervals] = nodes[-1]
            out.append(other.join(values[: other.intervals + 1], values[other.intervals + 1 :], rest))
        return out

    @cached_property
    def raised(self) -> OrbitMesh:
        """The mesh of degree m + 1."""
        return OrbitMesh(self.edges, self.degree + 1, self.n, self.span, self.own)

    @cached_property
    def dense(self) -> OrbitMesh:
        """The mesh whose polynomials are as accurate between the nodes as the nodes are (degree 2m, at most 11)."""
        degree = min(2 * self.degree, 11) if self.n <= 8 else min(self.degree + 2, 11)
        return OrbitMesh(self.edges, max(degree, self.degree), self.n, self.span, self.own)

    def resample(self, other: OrbitMesh, nodes: Array, stages: Array) -> Array:
        """Stage values (N, m' n) of the same polynomial for another degree on the same edges."""
        matrix = _between_degrees(self.degree, other.degree)
        return (matrix @ self.polynomial(nodes, stages)).reshape(self.intervals, -1)

    def quadrature(self, scales: Array) -> Array:
        """(N, m n) weights h_j b_i / scale^2 of the inner product, at the stages."""
        return np.asarray(self.weights[:, None] / scales**2).reshape(self.intervals, -1)
