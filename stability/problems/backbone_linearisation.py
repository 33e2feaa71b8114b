r"""The linearisation of a backbone: that of the free system's harmonic balance, bordered by growth, phase, amplitude.

    F(c, T, g; p, A) = ( R(c, T; p, g),  phase . u,  amplitude . u - A ),

    F_u = [ R_c     R_T   R_g ]
          [ phase         0   ]
          [ amplitude     0   ].
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .backbone_spectrum import ModeStability, mode_stability
from .backbone_system import GROWTH
from .harmonic_linearisation import HarmonicLinearisation

if TYPE_CHECKING:
    from .backbone import Backbone

__all__ = ["BackboneLinearisation"]

Array = np.ndarray


class BackboneLinearisation:
    """F, F_u and the core at (u, p); see `protocols.Linearisation`. There is no spectral matrix."""

    def __init__(self, problem: Backbone, u: Array, params: Array) -> None:
        self.problem, self.u, self.params = problem, u, params
        self.inner = HarmonicLinearisation.at(problem.inner, u[:-1], np.append(params[:-1], u[-1]))

    @cached_property
    def residual(self) -> Array:
        """F(u, p), (N,)."""
        conditions = self.problem.conditions @ self.u
        conditions[1] -= self.params[-1]
        return np.append(self.inner.residual[:-1], conditions)

    @property
    def size_of_residual(self) -> float:
        """Largest residual over the size of its equation; inf where something is not finite."""
        value = float(np.abs(self.residual / self.problem.row_sizes).max())
        return value if np.isfinite(value) else np.inf

    @cached_property
    def matrix(self) -> Array:
        """F_u, dense (N, N)."""
        N = self.u.size
        A = np.zeros((N, N))
        A[:-2, :-1] = self.inner.matrix[:-1]
        A[:-2, -1] = self.inner.column(GROWTH)[:-1]
        A[-2:] = self.problem.conditions
        return A

    def column(self, name: str) -> Array:
        """dF/dp_name, (N,)."""
        out = np.zeros(self.u.size)
        if name == "amplitude":
            out[-1] = -1.0
        else:
            out[:-2] = self.inner.column(name)[:-1]
        return out

    @cached_property
    def stability(self) -> ModeStability:
        """Multipliers of the motion and the verdict (see backbone_spectrum)."""
        return mode_stability(self.inner, float(self.u[-1]))

    @property
    def spectral(self) -> Array:
        """(0, 0): no multipliers."""
        return np.zeros((0, 0))

    def solve(self, rows: Array, columns: Array, corner: Array, right_sides: Array) -> Array:
        """Solve [[F_u, columns], [rows, corner]] x = right_sides; singular: non-finite numbers."""
        full = np.block([[self.matrix, columns], [rows, corner]])
        sizes = np.append(self.problem.column_sizes, np.ones(columns.shape[1]))
        full = full * sizes
        scale = np.abs(full).max(axis=1, keepdims=True)
        if not np.isfinite(full).all() or (scale == 0).any():
            return np.full(right_sides.shape, np.nan)
        try:
            return np.asarray(np.linalg.solve(full / scale, right_sides / scale) * sizes[:, None])
        except np.linalg.LinAlgError:
            return np.full(right_sides.shape, np.nan)

    def determinant_sign(self, column: Array, border: Array | None) -> int:
        """Sign of det F_u, or of the matrix bordered by the column and the tangent."""
        full = self.matrix
        if border is not None:
            full = np.block([[full, column[:, None]], [border[None]]])
        return int(np.linalg.slogdet(full / np.abs(full).max(axis=1, keepdims=True))[0])

    # ------------------------------------------------------------------ core: the scaled Jacobian
    @cached_property
    def core(self) -> Array:
        """S = rows^-1 F_u columns, (N, N)."""
        return np.asarray(self.matrix * self.problem.column_sizes / self.problem.row_sizes[:, None])

    def core_column(self, name: str) -> Array:
        """s_name, (N,)."""
        return self.column(name) / self.problem.row_sizes

    def embed(self, w: Array) -> Array:
        """(N,): w in units of the equations."""
        return np.asarray(self.problem.row_sizes * w)

    def lift(self, v: Array, free: str | None = None) -> Array:
        """(N,): v in units of the unknowns."""
        return np.asarray(self.problem.column_sizes * v[: self.u.size])

    def spectral_gradient(self, w: Array, v: Array) -> tuple[Array, Array]:
        """Zero: there is no spectral matrix."""
        return np.zeros(self.u.size), np.zeros(self.params.size)

    def core_gradient(self, w: Array, v: Array, free: str) -> tuple[Array, Array]:
        """Gradient of w^T [S, s_free] v by u and by p: the conditions are linear, the rest is the inner problem's."""
        inner_w = np.append(w[:-2], 0.0)
        growth = self.problem.column_sizes[-1] * v[-2]
        by_u, by_p = self.inner.core_gradient(inner_w, np.append(v[:-2], growth), GROWTH)
        if free != "amplitude" and v[-1] != 0:
            more = self.inner.core_gradient(inner_w, np.append(np.zeros(self.inner.u.size), v[-1]), free)
            by_u, by_p = by_u + more[0], by_p + more[1]
        return np.append(by_u, by_p[-1]), np.append(by_p[:-1], 0.0)
