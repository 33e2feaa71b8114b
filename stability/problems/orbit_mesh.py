"""The discretisation of a periodic orbit: mesh, Gauss points, phases, layout of the unknowns.

Scaled time s in [0, 1] covers the fraction `span` of the forcing period (span = 1; 2 for a doubled orbit; 1/2 for an
orbit with x(t + T/2) = S x(t)) or of the orbit's own period T of an autonomous system. Unknowns, in this order:

    u = (nodes x(s_j), j = 0 .. N;   stages x(s_j + c_i h_j);   T for autonomous systems)        N >= 1 intervals.

Equations in the same places: node equations and the boundary condition x(1) = S x(0) + w; stage equations; phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stability.kernels.gauss import GaussRule, gauss_rule, lagrange_matrix

__all__ = ["OrbitMesh"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class OrbitMesh:
    """Mesh of degree m on edges (N + 1,) for n states; `own` = 1 when the period is an unknown."""

    edges: Array
    degree: int
    n: int
    span: float
    own: int

    @property
    def intervals(self) -> int:
        """N."""
        return len(self.edges) - 1

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
    def size(self) -> int:
        """Length of u."""
        return (self.intervals + 1) * self.n + self.intervals * self.degree * self.n + self.own

    def split(self, u: Array) -> tuple[Array, Array, Array]:
        """Views: nodes (N + 1, n), stages (N, m n), rest (own,)."""
        first = (self.intervals + 1) * self.n
        last = first + self.intervals * self.degree * self.n
        stages = u[first:last].reshape(self.intervals, self.degree * self.n)
        return u[:first].reshape(self.intervals + 1, self.n), stages, u[last:]

    def join(self, nodes: Array, stages: Array, rest: Array | float = 0.0) -> Array:
        """u from its parts."""
        u = np.empty(self.size)
        a, b, c = self.split(u)
        a[:], b[:], c[:] = nodes, np.reshape(stages, b.shape), rest
        return u

    def polynomial(self, nodes: Array, stages: Array) -> Array:
        """Values (N, m + 1, n) at the local abscissae (0, c_1, .., c_m)."""
        inner = stages.reshape(self.intervals, self.degree, self.n)
        return np.concatenate([nodes[:-1, None, :], inner], axis=1)

    def evaluate(self, nodes: Array, stages: Array, s: Array) -> Array:
        """The collocation polynomial at any s (K,) in [0, 1]: (K, n)."""
        piece = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, self.intervals - 1)
        local = (s - self.edges[piece]) / self.h[piece]
        basis = lagrange_matrix(self.rule.abscissae, local)
        return np.asarray(np.einsum("ki,kin->kn", basis, self.polynomial(nodes, stages)[piece]))

    def leading(self, nodes: Array, stages: Array) -> Array:
        """(N, n): the m-th derivative over m! of the polynomial with respect to s."""
        values = np.einsum("i,jin->jn", self.rule.leading, self.polynomial(nodes, stages))
        return np.asarray(values / (self.h**self.degree)[:, None])

    def transfer(self, u: Array, other: OrbitMesh) -> Array:
        """u of this mesh as a vector of `other` (same n, span and own)."""
        nodes, stages, rest = self.split(u)
        new_nodes = self.evaluate(nodes, stages, other.edges)
        new_nodes[-1] = nodes[-1]
        return other.join(new_nodes, self.evaluate(nodes, stages, other.points.ravel()), rest)

    def with_edges(self, edges: Array) -> OrbitMesh:
        """The same discretisation on another mesh."""
        return OrbitMesh(np.asarray(edges, float), self.degree, self.n, self.span, self.own)

    def with_degree(self, degree: int) -> OrbitMesh:
        """Another degree on the same mesh."""
        return OrbitMesh(self.edges, degree, self.n, self.span, self.own)

    @cached_property
    def raised(self) -> tuple[OrbitMesh, Array]:
        """The mesh of degree m + 1 and the matrix (m + 1, m + 1) from polynomial values to its stage values."""
        higher = self.with_degree(self.degree + 1)
        return higher, lagrange_matrix(self.rule.abscissae, higher.rule.points)

    def raise_degree(self, nodes: Array, stages: Array) -> Array:
        """Stage values (N, (m + 1) n) of the same polynomial on the mesh of degree m + 1."""
        matrix = self.raised[1]
        values = np.einsum("ik,jkn->jin", matrix, self.polynomial(nodes, stages))
        return np.ascontiguousarray(values.reshape(self.intervals, -1))

    def quadrature(self, scales: Array) -> Array:
        """(N, m n) weights h_j b_i / scale^2 of the inner product, at the stages."""
        weights = (self.h[:, None] * self.rule.weights)[:, :, None] / scales**2
        return np.ascontiguousarray(weights.reshape(self.intervals, -1))
