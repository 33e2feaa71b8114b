r"""The linearisation of a collocation problem: condensed solves, monodromy, core, and exact gradients of both.

With the fundamental matrix Phi of the span (product of the condensed M_j), the boundary condition x(1) = S x(0) + w
and scales D = diag(scales of the states), spectral matrix and core are (y = D^-1 x(0), tau = dT / T)

    M = D^-1 S^-1 Phi D,      core = M - I   (forced),      core = [[M - I, D^-1 S^-1 dx(1)/dtau], [phase row]].

Gradients of g = w^T M v and w^T [core, s_free] v follow from one forward sweep (the variation V, tau, lambda that
starts at v) and one backward sweep (omega, from w): the stage residual is R = W (Y - u) - h sigma f, so with z = (x, p)

    dg = sum h omega^T d( sigma f_z (V, lambda) + (span tau + sigma_lambda lambda) f ),

which needs the gradient of omega^T f_z (V, lambda) over z at the stages only (kernels/condensation_sweeps.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels.condensation import condense, solve_stages
from ..kernels.condensation_reduced import reduce_and_solve, summary
from ..kernels.condensation_sweeps import forward_sweep, gradient, sweeps
from .orbit_mesh import OrbitMesh

if TYPE_CHECKING:
    from .collocation import Collocation

__all__ = ["CollocationLinearisation", "Workspace"]

Array = np.ndarray


@cache
def _keep_freed_memory() -> None:
    """Free a large block once: the C library learns from it to keep what is freed later, up to twice that size.

    It would hand some megabytes back to the system and ask for them again at every solve, a third of the time of one.
    """
    np.empty(1 << 21)


class Workspace:
    """The arrays a kernel fills at one linearisation: field and derivatives at the stages, factors, node relations.

    Without `factors` LU and pivots are empty: large arrays that a point of a branch is never asked for.
    """

    __slots__ = ("F", "Fp", "J", "LU", "M", "T", "Z", "dT", "pivots")

    def __init__(self, mesh: OrbitMesh, m: int, kept: int, factors: bool) -> None:
        _keep_freed_memory()
        count, N, n = mesh.intervals * mesh.degree, mesh.intervals, mesh.n
        size = mesh.degree * kept
        self.F, self.J, self.Fp = np.empty((count, n)), np.empty((count, n, n)), np.empty((count, n, m))
        self.T, self.dT = np.zeros(1), np.zeros(m)
        stored = N if factors else 0
        self.LU, self.pivots = np.empty((stored, size, size)), np.empty((stored, size), np.int64)
        self.Z, self.M = np.empty((N, mesh.degree * n, n)), np.empty((N, n, n))


@dataclass(frozen=True, eq=False)
class CollocationLinearisation:
    """F, F_u and spectral data at (u, p); see `protocols.Linearisation`. `sign` = 0: a singular interval.

    A Newton solve leaves the linearisation of its last iterate: `correction` = (change of u, change of the parameter,
    its index) leads from there to the solution `solution`, `solution_params`. `critical` are multipliers that it has by
    construction (a point of a curve of special points): nothing depends on how exactly they are known.
    """

    problem: Collocation
    solution: Array
    solution_params: Array
    work: Workspace
    sign: float
    correction: tuple[Array, float, int] | None = None
    critical: tuple[complex, ...] = ()

    @cached_property
    def u(self) -> Array:
        """(N,) where the linearisation is taken."""
        if self.correction is None:
            return self.solution
        return np.asarray(self.solution - self.correction[0])

    @cached_property
    def params(self) -> Array:
        """(m,) where the linearisation is taken."""
        params = self.solution_params
        if self.correction is not None and self.correction[1] != 0.0:
            params = params.copy()
            params[self.correction[2]] -= self.correction[1]
        return params

    # ------------------------------------------------------------------ shorthands
    @property
    def mesh(self) -> OrbitMesh:
        """The discretisation."""
        return self.problem.mesh

    @cached_property
    def sigma(self) -> float:
        """dt/ds."""
        return float(self.mesh.span * self.work.T[0])

    @property
    def period(self) -> float:
        """Forcing period, or the orbit's own."""
        return float(self.work.T[0])

    @cached_property
    def phase_row(self) -> Array:
        """(N, mn) of the phase condition (autonomous): weights . x' with u as its own reference, normalised."""
        mesh, weights = self.mesh, self.problem.quadrature
        nodes, stages, _ = mesh.split(self.u)
        inner = stages.reshape(mesh.intervals, mesh.degree, mesh.n) - nodes[:-1, None, :]
        slope = np.einsum("ik,jkn->jin", mesh.rule.inverse, inner).reshape(stages.shape) / mesh.h[:, None]
        length = float(np.sqrt((weights * slope**2).sum()))
        return np.asarray(weights * slope / (length if length > 0 else 1.0))

    # ------------------------------------------------------------------ residual and columns
    @cached_property
    def residual(self) -> Array:
        """F(u, p): node equations, boundary condition, stage equations, phase (0: u is its own reference)."""
        mesh, rule = self.mesh, self.mesh.rule
        nodes, stages, _ = mesh.split(self.u)
        inner = stages.reshape(mesh.intervals, mesh.degree, mesh.n)
        W, d = rule.inverse, rule.update
        field_part = (mesh.h * self.sigma)[:, None, None] * self.work.F.reshape(inner.shape)
        stage = W @ (inner - nodes[:-1, None, :]) - field_part
        node = np.empty_like(nodes)
        node[:-1] = nodes[1:] - (1 - d.sum()) * nodes[:-1] - d @ inner
        node[-1] = nodes[-1] - self.problem.closure @ nodes[0] - self.problem.winding
        return mesh.join(node, stage, 0.0)

    @property
    def size_of_residual(self) -> float:
        """Largest residual over the scales of the states."""
        mesh = self.mesh
        return float(np.abs(self.residual[: mesh.size - mesh.own].reshape(-1, mesh.n) / self.problem.scales).max())

    def _stage_column(self, free: int) -> Array:
        """(N, mn): derivative of the stage equations by parameter `free`, -1: by the period."""
        mesh, work = self.mesh, self.work
        if free < 0:
            values = mesh.span * work.F
        else:
            values = self.sigma * work.Fp[:, :, free] + mesh.span * work.dT[free] * work.F
        return np.asarray(-mesh.h[:, None] * values.reshape(mesh.intervals, -1))

    def column(self, name: str) -> Array:
        """dF/dp_name, (N,)."""
        out = np.zeros(self.mesh.size)
        self.mesh.split(out)[1][:] = self._stage_column(self.problem.index(name))
        return out

    # ------------------------------------------------------------------ solving
    def factors(self) -> tuple[Any, ...]:
        """A, h, sigma, J, kept, position, LU, pivots: what the kernels need to solve stage equations."""
        mesh, problem = self.mesh, self.problem
        LU, pivots = self._eliminated
        return mesh.rule.matrix, mesh.h, self.sigma, self.work.J, problem.kept, problem.position, LU, pivots

    @cached_property
    def _eliminated(self) -> tuple[Array, Array]:
        """LU and pivots; made now where the Newton solve has not kept them."""
        mesh, work, problem = self.mesh, self.work, self.problem
        if not len(work.LU):
            other = Workspace(mesh, len(self.params), len(problem.kept), True)
            rule, none = mesh.rule, np.empty((mesh.intervals, mesh.degree * mesh.n, 0))
            condense(
                rule.inverse, rule.matrix, rule.row_sums, rule.update, mesh.h, self.sigma, work.J, problem.kept,
                problem.position, none, other.LU, other.pivots, other.Z, other.M,
            )  # fmt: skip
            work.LU, work.pivots = other.LU, other.pivots
        return work.LU, work.pivots

    def solve(self, rows: Array, columns: Array, corner: Array, right_sides: Array) -> Array:
        """Solve [[F_u, columns], [rows, corner]] x = right_sides; singular: non-finite numbers."""
        mesh, problem = self.mesh, self.problem
        N, n, own = mesh.intervals, mesh.n, mesh.own
        q, sides = columns.shape[1], right_sides.shape[1]
        body = np.concatenate([columns, right_sides[: mesh.size]], axis=1)
        extra = own + q + sides
        X, nodes = np.empty((N, mesh.degree * n, extra)), np.zeros((N + 1, n, extra))
        all_rows, node_rows = np.zeros((own + q, N, mesh.degree * n)), np.zeros((own + q, N + 1, n))
        corners = np.zeros((own + q, extra))
        if own:
            X[:, :, 0] = self._stage_column(-1)
            all_rows[0] = self.phase_row
        for k in range(q + sides):
            nodes[:, :, own + k], X[:, :, own + k], rest = mesh.split(np.ascontiguousarray(body[:, k]))
            corners[:own, own + k] = rest
        for r in range(q):
            node_rows[own + r], all_rows[own + r], rest = mesh.split(np.ascontiguousarray(rows[r], dtype=float))
            corners[own + r, :own] = rest
        corners[own:, own : own + q] = corner
        corners[own:, own + q :] = right_sides[mesh.size :]
        out = np.full((mesh.size + q, sides), np.nan)
        if self.sign == 0.0 or not np.isfinite(body).all():
            return out
        solve_stages(*self.factors(), X)
        x = np.empty((sides, mesh.size + q))
        sign = reduce_and_solve(
            mesh.rule.update, self.work.Z, self.work.M, X, nodes, all_rows, node_rows, corners, problem.closure, 0, x
        )
        if sign != 0.0:
            out[:] = x.T
        return out

    # ------------------------------------------------------------------ spectral matrix and core
    @cached_property
    def fundamental(self) -> Array:
        """Phi (n, n) of the span, in the states' own units."""
        return self.summary[0]

    @cached_property
    def summary(self) -> tuple[Array, float, float]:
        """Phi, int tr J ds, roughness: the largest last term h^m x^(m) / m! of the polynomials over the scales."""
        mesh, work = self.mesh, self.work
        nodes, stages, _ = mesh.split(self.solution)
        product = np.empty((mesh.n, mesh.n))
        trace, roughness = summary(
            work.M, work.J, mesh.h, mesh.rule.weights, mesh.rule.leading, self.problem.scales, nodes, stages, product
        )
        return product, float(trace), float(roughness)

    @cached_property
    def spectral(self) -> Array:
        """M = D^-1 S^-1 Phi D."""
        return self.problem.spectral_of(self.summary[0])

    def _forcing(self, tau: float, free: int, amount: float) -> Array:
        """(N, mn, 1): the stage columns of a variation with dT = tau, dp_free = amount."""
        X = np.zeros((self.mesh.intervals, self.mesh.degree * self.mesh.n, 1))
        if tau != 0.0:
            X[:, :, 0] -= tau * self._stage_column(-1)
        if amount != 0.0:
            X[:, :, 0] -= amount * self._stage_column(free)
        return X

    def variation(self, start: Array, forcing: Array | None = None) -> tuple[Array, Array]:
        """Nodes (N + 1, n), stages (N, mn) of the variation with dx(0) = start (n,) and the stage columns `forcing`."""
        mesh = self.mesh
        forced, X = (0, self._forcing(0.0, 0, 0.0)) if forcing is None else (1, forcing)
        nodes, stages = np.empty((mesh.intervals + 1, mesh.n)), np.empty((mesh.intervals, mesh.degree * mesh.n))
        start = np.ascontiguousarray(start, dtype=float)
        forward_sweep(*self.factors(), mesh.rule.update, self.work.Z, forced, X, start, nodes, stages)
        return nodes, stages

    def _variation(self, start: Array, tau: float, free: int, amount: float) -> tuple[Array, Array]:
        """The variation with dx(0) = start, dT = tau, dp_free = amount."""
        moved = tau != 0.0 or amount != 0.0
        return self.variation(start, self._forcing(tau, free, amount) if moved else None)

    def _end(self, nodes: Array, stages: Array) -> Array:
        """The core equations of a variation that satisfies the inner ones: (k,)."""
        problem, D = self.problem, self.problem.scales
        gap = problem.closure @ nodes[-1] - nodes[0]
        if not self.mesh.own:
            return np.asarray(gap / D)
        return np.append(gap / D, (self.phase_row * stages).sum())

    @cached_property
    def core(self) -> Array:
        """(k, k); see the head of this file."""
        n, own = self.mesh.n, self.mesh.own
        core = np.empty((n + own, n + own))
        core[:n, :n] = self.spectral - np.eye(n)
        if own:
            D = self.problem.scales
            for k in range(n):
                unit = np.zeros(n)
                unit[k] = D[k]
                core[n, k] = (self.phase_row * self._variation(unit, 0.0, 0, 0.0)[1]).sum()
            core[:, n] = self._end(*self._variation(np.zeros(n), self.period, 0, 0.0))
        return core

    def core_column(self, name: str) -> Array:
        """s_name, (k,)."""
        return self._end(*self._variation(np.zeros(self.mesh.n), 0.0, self.problem.index(name), 1.0))

    def embed(self, w: Array) -> Array:
        """(N,): S D w in the boundary condition, the last entry in the phase condition."""
        n = self.mesh.n
        out = np.zeros(self.mesh.size, dtype=np.result_type(w, float))
        nodes, _, rest = self.mesh.split(out)
        nodes[-1] = self.problem.closure @ (self.problem.scales * w[:n])
        rest[:] = w[n:]
        return out

    def lift(self, v: Array, free: str | None = None) -> Array:
        """(N,) the unknowns that belong to core unknowns v when all inner equations hold."""
        if np.iscomplexobj(v):
            return self.lift(v.real, free) + 1j * self.lift(v.imag, free)
        n, own = self.mesh.n, self.mesh.own
        index = 0 if free is None else self.problem.index(free)
        tau = float(v[n]) * self.period if own else 0.0
        nodes, stages = self._variation(self.problem.scales * v[:n], tau, index, 0.0 if free is None else float(v[-1]))
        return self.mesh.join(nodes, stages, tau)

    # ------------------------------------------------------------------ gradients
    def spectral_gradient(self, w: Array, v: Array) -> tuple[Array, Array]:
        """Gradient of w^T M v by u and by p."""
        extended = np.concatenate([v, np.zeros(self.mesh.own + 1)])
        return self._bilinear(np.concatenate([w, np.zeros(self.mesh.own)]), extended, 0)

    def core_gradient(self, w: Array, v: Array, free: str) -> tuple[Array, Array]:
        """Gradient of w^T [core, s_free] v by u and by p."""
        return self._bilinear(w, v, self.problem.index(free))

    def _bilinear(self, w: Array, v: Array, free: int) -> tuple[Array, Array]:
        """Complex w and v by the real ones."""
        if not (np.iscomplexobj(w) or np.iscomplexobj(v)):
            return self._gradient(w, v, free)
        kind = np.result_type(w, v, float)
        total = np.zeros(self.mesh.size, kind), np.zeros(len(self.params), kind)
        for a, real_w in ((1.0, np.real(w)), (1j, np.imag(w))):
            for b, real_v in ((1.0, np.real(v)), (1j, np.imag(v))):
                if np.any(real_w) and np.any(real_v):
                    factor = a * b if np.iscomplexobj(total[0]) else 1.0
                    for whole, part in zip(total, self._gradient(real_w, real_v, free)):
                        whole += factor * part
        return total

    def _gradient(self, w: Array, v: Array, free: int) -> tuple[Array, Array]:
        problem, mesh, work = self.problem, self.mesh, self.work
        n, m, own, D = mesh.n, len(self.params), mesh.own, problem.scales
        relative, amount = (float(v[n]) if own else 0.0), float(v[-1])
        tau = relative * self.period
        X = self._forcing(tau, free, amount)
        if tau != 0.0 or amount != 0.0:
            solve_stages(*self.factors(), X)
        eta = problem.closure.T @ (w[:n] / D)
        rho = self.phase_row * float(w[n]) if own else np.zeros((mesh.intervals, mesh.degree * n))
        bend = np.zeros(m) if own or amount == 0.0 else amount * self._period_second(free)
        by_stages, by_params = np.empty((mesh.intervals, mesh.degree * n)), np.empty(m)
        rest = gradient(
            sweeps(), problem.evaluations.directional_address("second_gradient"), *self.factors(), mesh.rule.update,
            mesh.rule.row_sums, work.Z, X, D * v[:n], rho, eta, mesh.span, tau, relative, amount, free, bend, work.F,
            work.Fp, work.dT, mesh.phase, np.ascontiguousarray(mesh.split(self.u)[1]), self.params, self.sizes,
            by_stages, by_params,
        )  # fmt: skip
        return mesh.join(np.zeros((mesh.intervals + 1, n)), by_stages, rest), by_params

    def _period_second(self, free: int) -> Array:
        """d2T / dp_free dp (m,) of the forcing period, made once."""
        if free not in self._bends:
            self._bends[free] = self.problem.flow.period_second(self.params, free)
        return self._bends[free]

    @cached_property
    def _bends(self) -> dict[int, Array]:
        return {}

    @property
    def sizes(self) -> Array:
        """(n + m,) of states and parameters, so that second derivatives by differences are well scaled."""
        return np.concatenate([self.problem.scales, np.maximum(np.abs(self.params), 1e-3)])
