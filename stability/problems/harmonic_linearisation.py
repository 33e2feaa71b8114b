r"""The linearisation of a harmonic-balance problem: residual, exact Jacobian, bordered solves, gradients.

Residual of series k, with r_k = 2 or 1 its order and D the derivative by theta,

    R_k = omega^r D^r c_k - G+ f_row(k)(X),      X = X(c, omega)      (see harmonic_layout),

exact Jacobian from one call of the evaluator at all samples (J = f_x, Fp = f_p at fixed phase):

    dR_k/dc_j = delta_kj omega^r D^r - T(J_(k, x_j)) - omega T(J_(k, v_j)) D,
    dR/dp = - G+ Fp + (dR/domega) (domega/dp),      omega = 2 pi / T(p)   (autonomous: T is the last unknown).

So a forcing amplitude that depends on its frequency (base excitation) is inside Fp. The core is the whole scaled
Jacobian; gradients of w^T S v and w^T M v follow from second directional derivatives at the samples, with the adjoint
W(t) of w: w^T G+ f = sum_i W_i . f_i. References: Detroux, Renson, Masset, Kerschen (2015), CMAME 296, 18-38.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels.fourier import derivative

if TYPE_CHECKING:
    from .harmonic_balance import HarmonicBalance

__all__ = ["HarmonicLinearisation", "HarmonicWork"]

Array = np.ndarray


class HarmonicWork:
    """The arrays a kernel fills at one linearisation (see kernels/harmonic_assembly), and the factors of its solve."""

    __slots__ = ("filled", "full", "pivots", "x")

    def __init__(self, layout: Any, m: int, own: int, border: int) -> None:
        N, n, size = layout.samples, layout.n, layout.count * layout.q
        self.filled = (
            np.empty((N, n)), np.empty((N, n)), np.empty((N, n, n)), np.empty((N, n, m)), np.zeros(m), np.empty(size),
            np.empty(size), np.empty(size), np.empty((size, size)),
        )  # fmt: skip
        order = size + own + border
        self.full, self.pivots, self.x = np.empty((order, order)), np.empty(order, np.int32), np.empty((2, order))


class HarmonicLinearisation:
    """F, F_u and spectral data at (u, p); see `protocols.Linearisation`.

    `factors`: (LU, pivots from 0) of F_u bordered by a column and the tangent, of an iterate within the solve's last
    correction of (u, p), or None.
    """

    def __init__(
        self, problem: HarmonicBalance, u: Array, params: Array, work: HarmonicWork, period: float, index: int = 0,
        reference: Array | None = None, factors: tuple[Array, Array] | None = None,
    ) -> None:  # fmt: skip
        layout = problem.layout
        self.problem, self.u, self.params = problem, u, params
        self.reference, self.factors, self.index = reference, factors, index
        self.c = u[: layout.count * layout.q].reshape(layout.count, layout.q)
        self.filled = work.filled
        self.X, self.F, self.J, self.Fp, self.period_slopes = work.filled[:5]
        self.balance, self.by_omega, self.by_index, self.by_coefficients = work.filled[5:]
        self.period = period
        self.omega = 2 * np.pi / period

    @classmethod
    def at(cls, problem: HarmonicBalance, u: Array, params: Array) -> HarmonicLinearisation:
        """At any u and p, copied."""
        u, params = np.array(u, float), np.array(params, float)
        work, _, _, _, period = problem.newton(u, params, 0, None, 0.0, 0.0, 0)
        return cls(problem, u, params, work, period)

    # ------------------------------------------------------------------ residual
    @cached_property
    def residual(self) -> Array:
        """F(u, p), (N,)."""
        if not self.problem.own:
            return self.balance
        gap = 0.0 if self.reference is None else float(self.phase_row @ (self.u - self.reference))
        return np.append(self.balance, gap)

    @property
    def size_of_residual(self) -> float:
        """Largest residual over the size of its equation; inf where something is not finite."""
        value = float(np.abs(self.residual / self.problem.row_sizes).max())
        return value if np.isfinite(value) else np.inf

    @property
    def complaint(self) -> str:
        """Which state is not finite, and where."""
        bad, why = np.argwhere(~np.isfinite(self.F)), self.problem.evaluations.failure()
        if not len(bad):
            return f"not finite: a derivative or the solution{why}"
        point, state = bad[0]
        where = self.problem.layout.basis.points[point]
        return f"not finite: state {self.problem.system.states[state]} at phase {where:.3g}{why}"

    @cached_property
    def phase_row(self) -> Array:
        """(N,) of the phase condition: weights . dc_ref/dtheta, normalised; reference: its own where none is given."""
        problem, layout = self.problem, self.problem.layout
        u = self.u if self.reference is None else self.reference
        slope = derivative(u[:-1].reshape(layout.count, layout.q))
        row = problem.weights * np.append(slope.ravel(), 0.0)
        length = float(np.sqrt((slope.ravel() ** 2 * problem.weights[:-1]).sum()))
        return np.asarray(row / (length if length > 0 else 1.0))

    # ------------------------------------------------------------------ derivatives
    @cached_property
    def products(self) -> Array:
        """T of all J_(row, state): (2H + 1, 2H + 1, q, n)."""
        layout = self.problem.layout
        J = self.J[:, layout.rows].reshape(layout.samples, -1)
        return np.asarray(layout.basis.multiplication(J).reshape(layout.count, layout.count, layout.q, layout.n))

    @cached_property
    def matrix(self) -> Array:
        """F_u, dense (N, N)."""
        if not self.problem.own:
            return self.by_coefficients
        size = len(self.balance)
        A = np.empty((size + 1, size + 1))
        A[:size, :size] = self.by_coefficients
        A[:size, size] = self.by_omega * (-self.omega / self.period)
        A[size] = self.phase_row
        return A

    @cached_property
    def omega_slopes(self) -> Array:
        """domega/dp, (m,): zero for autonomous systems."""
        problem = self.problem
        if problem.own:
            return np.zeros(len(self.params))
        return np.asarray(-self.omega / self.period * self.period_slopes)

    def column(self, name: str) -> Array:
        """dF/dp_name, (N,)."""
        problem, layout = self.problem, self.problem.layout
        index = problem.index(name)
        if index == self.index:
            values = self.by_index
        else:
            moved = layout.basis.analysis @ self.Fp[:, layout.rows, index]
            values = float(self.omega_slopes[index]) * self.by_omega - moved.ravel()
        return np.append(values, 0.0) if problem.own else values

    # ------------------------------------------------------------------ solving
    def solve(self, rows: Array, columns: Array, corner: Array, right_sides: Array) -> Array:
        """Solve [[F_u, columns], [rows, corner]] x = right_sides; singular: non-finite numbers."""
        N, extra = self.matrix.shape[0], columns.shape[1]
        full = np.empty((N + extra, N + extra))
        full[:N, :N] = self.matrix
        full[:N, N:], full[N:, :N], full[N:, N:] = columns, rows, corner
        sizes = np.abs(full).max(axis=1)
        if not (sizes.min() > 0 and np.isfinite(sizes.max())):
            return np.full(right_sides.shape, np.nan)
        full /= sizes[:, None]
        try:
            return np.asarray(np.linalg.solve(full, right_sides / sizes[:, None]))
        except np.linalg.LinAlgError:
            return np.full(right_sides.shape, np.nan)

    def determinant_sign(self, column: Array, border: Array | None) -> int:
        """Sign of det F_u, or of the matrix bordered by the column and the tangent."""
        full = self.matrix
        if border is not None:
            full = np.block([[full, column[:, None]], [border[None]]])
        return int(np.linalg.slogdet(full)[0])

    # ------------------------------------------------------------------ core: the scaled Jacobian
    @cached_property
    def core(self) -> Array:
        """S = rows^-1 F_u columns, (N, N)."""
        problem = self.problem
        return np.asarray(self.matrix * problem.column_sizes / problem.row_sizes[:, None])

    def core_column(self, name: str) -> Array:
        """s_name, (N,)."""
        return self.column(name) / self.problem.row_sizes

    def embed(self, w: Array) -> Array:
        """(N,): w in units of the equations."""
        return np.asarray(self.problem.row_sizes * w)

    def lift(self, v: Array, free: str | None = None) -> Array:
        """(N,): v in units of the unknowns."""
        return np.asarray(self.problem.column_sizes * v[: self.u.size])

    # ------------------------------------------------------------------ spectral matrix
    @cached_property
    def correction(self) -> Any:
        """What the missing harmonics would change (see harmonic_truncation)."""
        from .harmonic_truncation import correction

        return correction(self)

    @cached_property
    def modes(self) -> Any:
        """Hill's eigenvalue problem of the truncated system, solved whole (see harmonic_spectrum)."""
        from .harmonic_spectrum import hill_modes

        return hill_modes(self)

    @property
    def spectral(self) -> Array:
        """M (n, n): real monodromy matrix whose eigenvalues are the Hill multipliers of the truncated system."""
        return np.asarray(self.modes.monodromy)

    @cached_property
    def curvature(self) -> Array:
        """Second derivatives of the field at the samples (see harmonic_gradient)."""
        from .harmonic_gradient import curvature

        return curvature(self)

    def spectral_gradient(self, w: Array, v: Array) -> tuple[Array, Array]:
        """Gradient of w^T M v by u and by p."""
        from .harmonic_gradient import spectral_gradient

        return spectral_gradient(self, np.asarray(w), np.asarray(v))

    def core_gradient(self, w: Array, v: Array, free: str) -> tuple[Array, Array]:
        """Gradient of w^T [S, s_free] v by u and by p."""
        from .harmonic_gradient import core_gradient

        return core_gradient(self, np.asarray(w), np.asarray(v), self.problem.index(free))
