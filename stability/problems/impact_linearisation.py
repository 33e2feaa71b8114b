r"""The linearisation of an orbit with impacts: arcs of flight, their impact times among the unknowns.

Arc j runs from the node s_j to s_(j+1) (times in units of the orbit's period P), s_0 = origin, s_N = origin + 1. A
node is a cut at a fixed time or an impact, whose time is an unknown. With the flow Psi_j of the system without its
walls, the restitution R (q' -> -e q') at an impact and the identity at a cut,

    R_j Psi_j(X_j; s_j, s_(j+1), p) - X_(j+1) = 0,    X_N = X_0 + winding,     side (position - q) = 0  at every impact,

    d Psi_j = Phi_j (dX_j - P f(X_j) ds_j) + P f(end) ds_(j+1) + (s_(j+1) - s_j) f(end) dT + Psi_p dp.

These equations are smooth in all unknowns, also where an impact becomes infinitely slow: only the elimination of its
time divides by its speed. Eliminating all but X_0 (and T) gives the core M - I with the monodromy matrix M, whose
factors are Phi_j and the saltation matrices (integration/saltation.py).
Reference: P. Thota, H. Dankowicz (2008), TC-HAT, SIAM J. Appl. Dyn. Syst. 7, 1283-1322.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..integration.saltation import saltation
from .shooting_linearisation import ShootingLinearisation

if TYPE_CHECKING:
    from .impact_shooting import ImpactShooting

__all__ = ["Arcs", "ImpactLinearisation"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Arcs:
    """Ends (N, n), matrices (N, n, n), derivatives by parameters (N, n, m), fields at start and end (N, n), period."""

    edges: Array
    ends: Array
    matrices: Array
    slopes: Array
    first: Array
    last: Array
    period: float

    @classmethod
    def failed(cls, count: int, n: int, m: int) -> Arcs:
        """All not finite."""
        shapes = ((count + 1,), (count, n), (count, n, n), (count, n, m), (count, n), (count, n))
        parts = [np.full(shape, np.nan) for shape in shapes]
        return cls(parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], np.nan)


class ImpactLinearisation(ShootingLinearisation):
    """See `protocols.Linearisation` and the head of this file."""

    problem: ImpactShooting  # type: ignore[assignment]
    parts: Arcs  # type: ignore[assignment]

    def __init__(self, problem: ImpactShooting, u: Array, params: Array, parts: Arcs) -> None:
        self.problem, self.u, self.params, self.parts = problem, u, params, parts  # type: ignore[assignment]
        self.reference = u
        self.K, self.n, self.own = problem.count, problem.n, problem.own

    # ------------------------------------------------------------------ residual, matrix, columns
    def _maps(self) -> list[Array | None]:
        """R_j (n, n) at the end of every arc, None at a cut and at the end of the period."""
        maps: list[Array | None] = []
        for mark in (*self.problem.marks, -1):
            if mark < 0:
                maps.append(None)
                continue
            wall = self.problem.contacts[mark]
            R = np.eye(self.n)
            R[wall.velocity, wall.velocity] = -wall.restitution
            maps.append(R)
        return maps

    @cached_property
    def residual(self) -> Array:
        """F(u, p): matching of the arcs, the walls at the impacts, the phase condition."""
        problem, ends = self.problem, self.parts.ends
        nexts = np.roll(self.states, -1, axis=0).copy()
        nexts[-1] += problem.winding
        matching = [(end if R is None else R @ end) - after for R, end, after in zip(self._maps(), ends, nexts)]
        walls = []
        for end, mark in zip(ends, problem.marks):
            if mark >= 0:
                wall = problem.contacts[mark]
                walls.append(wall.side * (wall.position - end[wall.coordinate]))
        out = np.append(np.ravel(matching), walls)
        if self.own:
            out = np.append(out, self.anchor @ (self.u - self.reference))
        return out

    @cached_property
    def anchor(self) -> Array:
        """(N,) of the phase condition: the first impact keeps its time; without impacts as in plain shooting."""
        row = np.zeros(self.problem.size)
        times = [c for c in self.problem.time_columns if c >= 0]
        if times:
            row[times[0]] = 1.0
        else:
            row[: self.n] = self.phase_row
        return row

    @property
    def size_of_residual(self) -> float:
        """Largest residual over the scales of the states."""
        return float(np.abs(self.residual / self.problem.row_sizes).max())

    @cached_property
    def matrix(self) -> Array:
        """F_u, dense: columns X (N n), impact times (q), period (own)."""
        problem, parts, n, count = self.problem, self.parts, self.n, self.K
        size = problem.size
        A, row = np.zeros((size, size)), count * n
        column_of = problem.time_columns
        for j, R in enumerate(self._maps()):
            E = np.zeros((n, size))
            E[:, j * n : (j + 1) * n] = parts.matrices[j]
            if column_of[j] >= 0:
                E[:, column_of[j]] -= parts.period * (parts.matrices[j] @ parts.first[j])
            if column_of[j + 1] >= 0:
                E[:, column_of[j + 1]] += parts.period * parts.last[j]
            if self.own:
                E[:, -1] += (parts.edges[j + 1] - parts.edges[j]) * parts.last[j]
            A[j * n : (j + 1) * n] = E if R is None else R @ E
            after = (j + 1) % count
            A[j * n : (j + 1) * n, after * n : (after + 1) * n] -= np.eye(n)
            if R is not None:
                wall = problem.contacts[problem.marks[j]]
                A[row] = -wall.side * E[wall.coordinate]
                row += 1
        if self.own:
            A[-1] = self.anchor
        return A

    def column(self, name: str) -> Array:
        """dF/dp_name, (N,): at fixed phase for forced systems."""
        slopes = self.parts.slopes[:, :, self.problem.index(name)]
        matching = [slope if R is None else R @ slope for R, slope in zip(self._maps(), slopes)]
        walls = [self.problem.contacts[mark] for mark in self.problem.marks]
        events = [
            -wall.side * slope[wall.coordinate] for wall, mark, slope in zip(walls, self.problem.marks, slopes)
            if mark >= 0
        ]  # fmt: skip
        return np.concatenate([np.ravel(matching), events, np.zeros(self.own)])

    def determinant_sign(self, column: Array, border: Array | None) -> int:
        """Sign of the determinant of the core, bordered or not: it does not depend on where the nodes are."""
        rows, columns = self._inner
        return super().determinant_sign(column, border) * int(np.linalg.slogdet(self.matrix[np.ix_(rows, columns)])[0])

    # ------------------------------------------------------------------ the core
    @cached_property
    def _inner(self) -> tuple[Array, Array]:
        """Rows and columns that are eliminated: all but the periodicity (and phase), all but X_0 (and T)."""
        n, last, size = self.n, (self.K - 1) * self.n, self.problem.size
        q = size - self.K * n - self.own
        events = np.arange(self.K * n, self.K * n + q)
        return np.concatenate([np.arange(last), events]), np.concatenate([np.arange(n, self.K * n), events])

    @cached_property
    def _outer(self) -> tuple[Array, Array]:
        n, size = self.n, self.problem.size
        tail = np.arange(size - self.own, size)
        return np.concatenate([np.arange((self.K - 1) * n, self.K * n), tail]), np.concatenate([np.arange(n), tail])

    def _eliminated(self, right: Array) -> Array:
        """A_II^-1 right; not finite where an impact has no speed."""
        rows, columns = self._inner
        if not len(rows):
            return np.zeros((0, right.shape[1]))
        try:
            return np.linalg.solve(self.matrix[np.ix_(rows, columns)], right)
        except np.linalg.LinAlgError:
            return np.full(right.shape, np.nan)

    def _reduced(self, outer: Array, inner: Array) -> Array:
        """Columns of the Schur complement from right sides in the outer and inner rows."""
        rows = self._outer[0]
        return np.asarray(outer - self.matrix[np.ix_(rows, self._inner[1])] @ self._eliminated(inner))

    @cached_property
    def core(self) -> Array:
        """M - I, bordered by period and phase condition for autonomous systems (unknown dT / T)."""
        rows, columns = self._outer
        S = self._reduced(self.matrix[np.ix_(rows, columns)], self.matrix[np.ix_(self._inner[0], columns)])
        unknowns = np.append(self.problem.scales, [self.parts.period] * self.own)
        return np.asarray(S * unknowns / np.append(self.problem.scales, [1.0] * self.own)[:, None])

    @cached_property
    def spectral(self) -> Array:
        """M = D^-1 (monodromy matrix) D at the origin."""
        return np.asarray(self.core[: self.n, : self.n] + np.eye(self.n))

    @property
    def factors(self) -> Array:
        """(k, n, n) the flights and, between them, the saltation matrices: their product is the monodromy matrix."""
        factors = []
        for j, R in enumerate(self._maps()):
            factors.append(self.parts.matrices[j])
            if R is not None:
                wall = self.problem.contacts[self.problem.marks[j]]
                gradient = np.zeros(self.n)
                gradient[wall.coordinate] = -wall.side
                factors.append(saltation(R, self.parts.last[j], self.parts.first[j + 1], gradient))
        return np.array(factors)

    def core_column(self, name: str) -> Array:
        """s_name."""
        c = self.column(name)[:, None]
        reduced = self._reduced(c[self._outer[0]], c[self._inner[0]])[:, 0]
        return np.asarray(reduced / np.append(self.problem.scales, [1.0] * self.own))

    def embed(self, w: Array) -> Array:
        """(N,): D w in the periodicity condition, the last entry in the phase condition."""
        out = np.zeros(self.problem.size, np.result_type(w, float))
        out[self._outer[0]] = w * np.append(self.problem.scales, [1.0] * self.own)
        return out

    def lift(self, v: Array, free: str | None = None) -> Array:
        """(N,) the unknowns that belong to core unknowns v."""
        if np.iscomplexobj(v):
            return self.lift(v.real, free) + 1j * self.lift(v.imag, free)
        k = self.n + self.own
        outer = v[:k] * np.append(self.problem.scales, [self.parts.period] * self.own)
        right = self.matrix[np.ix_(self._inner[0], self._outer[1])] @ outer
        if free is not None:
            right = right + v[-1] * self.column(free)[self._inner[0]]
        out = np.empty(self.problem.size)
        out[self._outer[1]] = outer
        out[self._inner[1]] = -self._eliminated(right[:, None])[:, 0]
        return out
