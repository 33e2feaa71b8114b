"""The linearisation of a shooting problem: a small dense cyclic matrix of the segments' flows.

    F_u = [ Phi_0  -I                    c_0 ]        rows: matching of the segments, the last one the periodicity;
          [        Phi_1  -I             c_1 ]        columns: states at the starts of the segments, then (autonomous)
          [ -I                  Phi_K-1  c_K ]        the period, c_j = dPsi_j/dT = f(end of segment j) / K;
          [ phase row                     0  ]        the phase condition f(x_0) . dx_0 / (|f|) in units of the scales.

Second derivatives of the flow (gradients of w^T M v) are central differences of the variational matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .shooting import Shooting

__all__ = ["Segments", "ShootingLinearisation"]

Array = np.ndarray
_STEP = 3e-5  # of central differences, relative to the scales: error about 1e-9 + tolerance of the integration / step


@dataclass(frozen=True, eq=False)
class Segments:
    """Ends (K, n), matrices (K, n, n), derivatives by parameters (K, n, m), d end / d s (K, n), period."""

    ends: Array
    matrices: Array
    slopes: Array
    rates: Array
    period: float

    @classmethod
    def failed(cls, segments: int, n: int, m: int) -> Segments:
        """All not finite."""
        nan = np.nan
        return cls(
            np.full((segments, n), nan), np.full((segments, n, n), nan), np.full((segments, n, m), nan),
            np.full((segments, n), nan), nan,
        )  # fmt: skip


class ShootingLinearisation:
    """See `protocols.Linearisation` and the head of this file."""

    def __init__(self, problem: Shooting, u: Array, params: Array, parts: Segments) -> None:
        self.problem, self.u, self.params, self.parts = problem, u, params, parts
        self.reference = u
        self.K, self.n, self.own = problem.segments, problem.n, problem.own

    # ------------------------------------------------------------------ residual, matrix, columns
    @property
    def states(self) -> Array:
        """(K, n) at the starts of the segments."""
        return self.u[: self.K * self.n].reshape(self.K, self.n)

    @cached_property
    def phase_row(self) -> Array:
        """(n,) of the phase condition, from the reference orbit."""
        start = self.reference[None, : self.n]
        slope = self.problem.evaluations.F(None, start, self.params)[0] / self.problem.scales**2
        length = float(np.sqrt((slope**2 * self.problem.scales**2).sum()))
        return np.asarray(slope / (length if length > 0 else 1.0))

    @cached_property
    def residual(self) -> Array:
        """F(u, p)."""
        nexts = np.roll(self.states, -1, axis=0).copy()
        nexts[-1] += self.problem.winding
        out = (self.parts.ends - nexts).ravel()
        if self.own:
            out = np.append(out, self.phase_row @ (self.u[: self.n] - self.reference[: self.n]))
        return out

    @property
    def size_of_residual(self) -> float:
        """Largest residual over the scales of the states."""
        gaps = self.residual[: self.K * self.n].reshape(self.K, self.n) / self.problem.scales
        return float(np.abs(gaps).max())

    @property
    def complaint(self) -> str:
        """Where the flow is not finite."""
        bad, why = np.argwhere(~np.isfinite(self.parts.ends)), self.problem.evaluations.failure()
        if not len(bad):
            return f"not finite{why}"
        return f"not finite: state {self.problem.system.states[bad[0][1]]} in segment {bad[0][0]}{why}"

    @cached_property
    def matrix(self) -> Array:
        """F_u, dense."""
        K, n = self.K, self.n
        A = np.zeros((K * n + self.own, K * n + self.own))
        for j in range(K):
            rows, here, after = slice(j * n, (j + 1) * n), slice(j * n, (j + 1) * n), (j + 1) % K
            A[rows, here] += self.parts.matrices[j]
            A[rows, after * n : (after + 1) * n] -= np.eye(n)
        if self.own:
            A[: K * n, -1] = (self.parts.rates / self.parts.period).ravel()
            A[-1, :n] = self.phase_row
        return A

    def column(self, name: str) -> Array:
        """dF/dp_name, (N,): at fixed phase for forced systems."""
        values = self.parts.slopes[:, :, self.problem.index(name)]
        return np.append(values.ravel(), np.zeros(self.own))

    # ------------------------------------------------------------------ solving
    def solve(self, rows: Array, columns: Array, corner: Array, right_sides: Array) -> Array:
        """Solve [[F_u, columns], [rows, corner]] x = right_sides; singular: non-finite numbers."""
        full = np.block([[self.matrix, columns], [rows, corner]])
        scale = np.abs(full).max(axis=1, keepdims=True)
        if not np.isfinite(full).all() or (scale == 0).any():
            return np.full(right_sides.shape, np.nan)
        try:
            return np.linalg.solve(full / scale, right_sides / scale)
        except np.linalg.LinAlgError:
            return np.full(right_sides.shape, np.nan)

    def determinant_sign(self, column: Array, border: Array | None) -> int:
        """Sign of det F_u, or of the matrix bordered by the column and the tangent."""
        full = self.matrix
        if border is not None:
            full = np.block([[full, column[:, None]], [border[None]]])
        return int(np.linalg.slogdet(full)[0])

    # ------------------------------------------------------------------ spectral matrix and core
    @property
    def factors(self) -> Array:
        """(K, n, n) matrices whose product is the monodromy matrix."""
        return self.parts.matrices

    @cached_property
    def spectral(self) -> Array:
        """M = D^-1 Phi_{K-1} .. Phi_0 D."""
        product = np.eye(self.n)
        for matrix in self.parts.matrices:
            product = matrix @ product
        D = self.problem.scales
        return np.asarray(product * D / D[:, None])

    def _variation(self, start: Array, tau: float, free: int, amount: float) -> tuple[Array, Array]:
        """States (K, n) at the starts and the end (n,) of the variation from `start` with dT = tau, dp = amount."""
        out, x = np.empty((self.K, self.n)), np.array(start, float)
        for j in range(self.K):
            out[j] = x
            x = self.parts.matrices[j] @ x + amount * self.parts.slopes[j, :, free]
            if tau != 0.0:
                x = x + tau / self.parts.period * self.parts.rates[j]
        return out, x

    def _end(self, states: Array, end: Array) -> Array:
        gap = (end - states[0]) / self.problem.scales
        return np.append(gap, [self.phase_row @ states[0]] if self.own else [])

    @cached_property
    def core(self) -> Array:
        """M - I, bordered by period and phase condition for autonomous systems (unknown dT / T)."""
        n = self.n
        core = np.empty((n + self.own, n + self.own))
        core[:n, :n] = self.spectral - np.eye(n)
        if self.own:
            core[n, :n] = self.phase_row * self.problem.scales
            core[:, n] = self._end(*self._variation(np.zeros(n), self.parts.period, 0, 0.0))
        return core

    def core_column(self, name: str) -> Array:
        """s_name."""
        return self._end(*self._variation(np.zeros(self.n), 0.0, self.problem.index(name), 1.0))

    def embed(self, w: Array) -> Array:
        """(N,): D w in the periodicity condition, the last entry in the phase condition."""
        out = np.zeros(self.K * self.n + self.own, np.result_type(w, float))
        out[(self.K - 1) * self.n : self.K * self.n] = self.problem.scales * w[: self.n]
        out[self.K * self.n :] = w[self.n :]
        return out

    def lift(self, v: Array, free: str | None = None) -> Array:
        """(N,) the unknowns that belong to core unknowns v."""
        if np.iscomplexobj(v):
            return self.lift(v.real, free) + 1j * self.lift(v.imag, free)
        tau = float(v[self.n]) * self.parts.period if self.own else 0.0
        index, amount = (0, 0.0) if free is None else (self.problem.index(free), float(v[-1]))
        states, _ = self._variation(self.problem.scales * v[: self.n], tau, index, amount)
        return np.append(states.ravel(), [tau] * self.own)

    # ------------------------------------------------------------------ gradients by differences
    def spectral_gradient(self, w: Array, v: Array) -> tuple[Array, Array]:
        """Gradient of w^T M v by u and by p, by central differences of the variational matrices."""
        return self._differences(lambda L: w @ L.spectral @ v)

    def core_gradient(self, w: Array, v: Array, free: str) -> tuple[Array, Array]:
        """Gradient of w^T [core, s_free] v by u and by p."""

        def scalar(L: ShootingLinearisation) -> Any:
            L.reference = self.u
            return w @ (L.core @ v[:-1] + v[-1] * L.core_column(free))

        return self._differences(scalar)

    def _differences(self, scalar: Any) -> tuple[Array, Array]:
        problem = self.problem
        sizes_u = problem.sizes(self.parts.period)
        sizes_p = np.maximum(np.abs(self.params), 1e-2)
        gradients = []
        for which, sizes in ((0, sizes_u), (1, sizes_p)):
            values = []
            for k, size in enumerate(sizes):
                pair = []
                for sign in (1.0, -1.0):
                    u, p = self.u.copy(), self.params.copy()
                    (u, p)[which][k] += sign * _STEP * size
                    pair.append(scalar(problem.linearise(u, p)))
                values.append((pair[0] - pair[1]) / (2 * _STEP * size))
            gradients.append(np.array(values))
        return gradients[0], gradients[1]
