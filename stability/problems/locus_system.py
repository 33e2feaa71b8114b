r"""The extended system whose zeros are a curve of special points in two parameters, and its bordered Newton step.

With the conditions g(u, p, e) (q,) of `defining` (q = 1 + number of extra unknowns e: mu, omega^2 or cos theta),

    F(u, p) + e b = 0,     g(u, p, e) = 0        unknowns U = (u, lambda_2, e) and lambda_1,

where e b stands for the unfolding of a branch point only. One Newton step is one bordered solve of the inner problem:

    [ F_u   F_1    F_2    b   ] [ du  ]     [ -F - e b ]
    [ g_u   g_1    g_2    g_e ] [ dl1 ]  =  [ -g       ]
    [ t_u   t_1    t_2    0   ] [ dl2 ]     [ rest     ]
                                [ de  ]

The borders of g are taken anew from the singular vectors at every iterate: g changes by a regular factor, its zeros do
not, and no border can become orthogonal to what it has to complete. The gradients of g are the dearest part of a step:
once Newton is close, one more step is made with the derivatives of the iterate before (g in that one's borders).
Reference: Kuznetsov (2004), 10.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..protocols import Linearisation
from ..words import Kind
from .defining import Conditions, Equations, conditions, gradients, values_in

if TYPE_CHECKING:
    from .locus import Locus

__all__ = ["ExtendedLinearisation", "Place"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ExtendedLinearisation:
    """The inner linearisation at (u, p) and the conditions; their gradients (sweeps) only when a step is solved.

    Attributes
    ----------
    inner : Linearisation of the inner problem
    begun : Conditions, g with the borders of this point
    names : (lambda_1, lambda_2)
    """

    problem: Locus
    u: Array
    params: Array
    inner: Linearisation
    begun: Conditions
    names: tuple[str, str]

    @classmethod
    def at(cls, problem: Locus, U: Array, params: Array, first: str) -> ExtendedLinearisation:
        """At any point; `params` holds lambda_1, lambda_2 is taken from U.

        Raises
        ------
        LinAlgError
            The linearisation is not finite, or the conditions are not regular.
        """
        inner, free = problem.inner, problem.free
        u, _, extra = problem.parts(U)
        params = problem.completed(U, params)
        L = inner.linearise(u, params)
        begun = conditions(problem.kind, L, inner.critical, problem.along, extra)
        if begun.g.size != 1 + extra.size:
            raise np.linalg.LinAlgError("a pair needs two states at least")
        return cls(problem, U, params, L, begun, (first, free))

    @cached_property
    def found(self) -> Equations:
        """The conditions g and their gradients."""
        problem, extra = self.problem, self.problem.parts(self.u)[2]
        return gradients(problem.kind, self.inner, problem.inner.critical, problem.along, extra, self.begun)

    @cached_property
    def columns(self) -> Array:
        """(N, 2 + e), derivatives of the inner equations by lambda_1, lambda_2 and the extra unknowns."""
        problem = self.problem
        columns = np.zeros((self.u.size - 1 - problem.extras, 2 + problem.extras))
        columns[:, 0], columns[:, 1] = self.inner.column(self.names[0]), self.inner.column(self.names[1])
        if problem.kind is Kind.BRANCH_POINT:
            columns[:, 2] = self.inner.embed(np.real(self.begun.frame.left[:, 0]))
        return columns

    @property
    def residual(self) -> Array:
        """(N + q,): inner equations, then conditions."""
        F = np.array(self.inner.residual)
        if self.problem.kind is Kind.BRANCH_POINT:
            F = F + self.problem.parts(self.u)[2][0] * self.columns[:, 2]
        return np.concatenate([F, np.real(self.begun.g)])

    def residual_elsewhere(self, other: ExtendedLinearisation) -> Array:
        """The same at another point, with the borders of this one: for a step by this point's derivatives."""
        problem, extra = self.problem, self.problem.parts(other.u)[2]
        F = np.array(other.inner.residual)
        if problem.kind is Kind.BRANCH_POINT:
            F = F + extra[0] * self.columns[:, 2]
        frame = self.begun.frame
        g = values_in(problem.kind, other.inner, problem.inner.critical, problem.along, extra, frame)
        return np.concatenate([F, g])

    @property
    def unfolding(self) -> Array:
        """(N + q,) a change of the conditions alone that varies smoothly along the curve; zeros where none is known.

        A curve branches where no change of (u, lambda_1, lambda_2, e) answers it.
        """
        g = self.begun.orientation * np.array([1.0, 0.6])[: self.begun.g.size]
        return np.concatenate([np.zeros(self.u.size - 1 - self.problem.extras), g])

    def column(self, name: str) -> Array:
        """(N + q,): derivative by any parameter but lambda_2."""
        k = list(self.problem.parameters).index(name)
        return np.concatenate([self.inner.column(name), self.found.by_params[:, k]])

    def solve_bordered(self, row: Array, right_sides: Array) -> Array:
        """Solve with the last row `row` = (u, lambda_1, lambda_2, e) given; right sides (N + q + 1, r)."""
        names = list(self.problem.parameters)
        by_params = self.found.by_params[:, [names.index(name) for name in self.names]]
        n, q = self.found.by_u.shape[1], self.found.g.size
        rows = np.concatenate([self.found.by_u, row[None, :n]])
        corner = np.zeros((q + 1, 2 + self.found.by_extra.shape[1]))
        corner[:q] = np.column_stack([by_params, self.found.by_extra])
        corner[q] = row[n:]
        return np.asarray(self.inner.solve(rows, self.columns, corner, right_sides))


@dataclass(frozen=True, eq=False)
class Place:
    """A point of the curve as a `protocols.Linearisation`: lazy, and without a core.

    Special points of the curve are found along it (`locus_tests`), not from a defining system of their own, whose
    gradients would need third derivatives of the inner problem.
    """

    problem: Locus
    u: Array
    params: Array

    @cached_property
    def extended(self) -> ExtendedLinearisation:
        """The extended linearisation, by the parameter along which the point was found."""
        return ExtendedLinearisation.at(self.problem, self.u, self.params, self.problem.along)

    @property
    def residual(self) -> Array:
        """(N + q,): inner equations, then conditions."""
        return self.extended.residual

    @property
    def spectral(self) -> Array:
        """That of the inner problem."""
        return np.asarray(self.problem.inner_linearisation(self.u, self.params).spectral)

    def column(self, name: str) -> Array:
        """(N + q,): derivative by any parameter but lambda_2."""
        return self.extended.column(name)

    @property
    def core(self) -> Array:
        """Not available.

        Raises
        ------
        LinAlgError
            Always.
        """
        raise np.linalg.LinAlgError("curves of special points have no defining system of their own")

    def core_column(self, name: str) -> Any:
        """Not available, see `core`."""
        return self.core
