r"""f, f_x, f_p of an equilibrium at one point, scaled, with what the defining systems need of them.

With D = diag(s) the spectral matrix and the core are D^-1 f_x D, similar to f_x and free of the states' units. The
gradient of w^T D^-1 f_x D v is a batch of second directional derivatives of f along (D v, e_i). A stable equilibrium
has all eigenvalues in the left half plane; their error is that of the matrix, a multiple of its norm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..protocols import Spectrum
from ..words import Verdict

if TYPE_CHECKING:
    from .equilibria import Equilibrium

__all__ = ["DenseLinearisation", "eigenvalue_spectrum", "equilibrated_solve"]

Array = NDArray[np.float64]


def eigenvalue_spectrum(matrix: Array, floor: float) -> Spectrum:
    """Counts and verdict of a Jacobian's eigenvalues; `floor` is the error of the matrix relative to its norm."""
    values = np.linalg.eigvals(matrix).astype(complex)
    if values.size > 1:
        values = values[np.argsort(-values.real, kind="stable")]
    error = floor * math.sqrt(float(np.einsum("ij,ij->", matrix, matrix)))
    real = pairs = 0
    for value in values.tolist():
        if value.real <= 0:
            break
        if value.imag == 0:
            real += 1
        elif value.imag > 0:
            pairs += 1
    top = float(values[0].real) if values.size else -math.inf
    if top > error:
        verdict = Verdict.UNSTABLE
    else:
        verdict = Verdict.STABLE if top < -error else Verdict.UNDETERMINED
    return Spectrum(values, error, real + 2 * pairs, real, 0, pairs, verdict)


@dataclass(frozen=True, eq=False)
class DenseLinearisation:
    """f, f_x, f_p at one point, in the scaled variables of an `Equilibrium` (see `protocols.Linearisation`)."""

    problem: Equilibrium
    u: Array
    params: Array
    F: Array
    J: Array
    Fp: Array

    @property
    def residual(self) -> Array:
        """f(x, p), (n,)."""
        return self.F

    @property
    def size_of_residual(self) -> float:
        """Largest residual over the size of the terms of its equation."""
        terms = np.abs(self.J) @ (np.abs(self.u) + self.problem.scales) + 1e-300
        return float(np.max(np.abs(self.F) / terms))

    @cached_property
    def spectral(self) -> Array:
        """D^-1 f_x D, (n, n)."""
        s = self.problem.scales
        return self.J * s / s[:, None]

    @property
    def core(self) -> Array:
        """The same as `spectral`."""
        return self.spectral

    def column(self, name: str) -> Array:
        """df/dp_name, (n,)."""
        return self.Fp[:, self.problem.index(name)]

    def core_column(self, name: str) -> Array:
        """D^-1 df/dp_name, (n,)."""
        return self.column(name) / self.problem.scales

    def solve(self, rows: Array, columns: Array, corner: Array, right_sides: Array) -> Array:
        """The bordered solve of `protocols.Linearisation`, in scaled and equilibrated form."""
        n, q = self.F.size, columns.shape[1]
        s = self.problem.scales
        K = np.empty((n + q, n + q))
        K[:n, :n] = self.core
        K[:n, n:] = columns / s[:, None]
        K[n:, :n] = rows * s
        K[n:, n:] = corner
        b = np.array(right_sides, dtype=float)
        b[:n] /= s[:, None]
        x = equilibrated_solve(K, b)
        x[:n] *= s[:, None]
        return x

    def spectral_gradient(self, w: NDArray[Any], v: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Gradient of w^T D^-1 f_x D v: second derivatives of f in the directions (D v, e_i), one batch."""
        return self._gradient(w, v, np.zeros(self.params.size))

    def core_gradient(self, w: NDArray[Any], v: NDArray[Any], free: str) -> tuple[NDArray[Any], NDArray[Any]]:
        """Gradient of w^T [S, s_free] v."""
        direction = np.zeros(self.params.size, dtype=np.result_type(v, float))
        direction[self.problem.index(free)] = v[-1]
        return self._gradient(w, v[:-1], direction)

    def _gradient(
        self, w: NDArray[Any], v: NDArray[Any], v_params: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        n, m = self.F.size, self.params.size
        s = self.problem.scales
        z = np.concatenate([v * s, v_params])
        # sizes of the variables, so that second derivatives by differences are well scaled
        sizes = np.concatenate([s, np.maximum(np.abs(self.params), 1e-3)])
        weights, phase, X = w / s, np.zeros(1), self.u[None, :]
        gradient: NDArray[Any] = np.zeros(n + m)
        for factor, part in ((1.0, z.real), (1j, z.imag)):
            for turn, weight in ((1.0, np.real(weights)), (1j, np.imag(weights))):
                if np.any(part) and np.any(weight):
                    slope = self.problem.evaluations.second_gradient(phase, X, self.params, part, weight, sizes)[0]
                    gradient = gradient + factor * turn * slope
        return gradient[:n], gradient[n:]

    def embed(self, w: NDArray[Any]) -> NDArray[Any]:
        """D w: the right side of f whose core part is w."""
        return w * self.problem.scales

    def lift(self, v: NDArray[Any], free: str | None = None) -> NDArray[Any]:
        """D v (without its last entry, which belongs to the parameter, if `free` is given)."""
        return (v if free is None else v[:-1]) * self.problem.scales


def equilibrated_solve(K: Array, b: Array) -> Array:
    """K^-1 b with rows scaled to one; non-finite numbers where K is singular."""
    size = np.abs(K).max(axis=1)
    size[size == 0] = 1.0
    try:
        return np.asarray(np.linalg.solve(K / size[:, None], b / size[:, None]))
    except np.linalg.LinAlgError:
        return np.full_like(b, np.nan)
