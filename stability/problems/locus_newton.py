r"""The bordered Newton solve of a curve of special points, and what it leaves behind for the tests along the curve.

Full steps converge quadratically; their dearest part is the gradient of the conditions (a forward and an adjoint sweep
with second derivatives, `locus_system`). After a step of size s the error left is O(s^2), and one more step with the
derivatives of the iterate before brings it to O(s^3): where s is small it ends the iteration. The tangent is then the
one of that iterate, good to O(s), which is enough to predict the next point; where its sign decides (turning points,
cusps), `sharpened` computes it anew.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..protocols import Corrected, Tangent
from ..words import Kind
from .locus_system import ExtendedLinearisation

if TYPE_CHECKING:
    from .locus import Locus

__all__ = ["corrected", "response", "sharpened"]

Array = NDArray[np.float64]
_MAX_NEWTON = 10
_NEAR = 1e-4  # size of a full step, in the weighted norm relative to 1 + |u|, after which a cheap one is tried
_STALLED = 1e-7  # rounding may stop the decrease above the tolerance: steps below this that do not shrink are the last
_UNFOLDED = 1e-7


class _Step(NamedTuple):
    """A step of all unknowns, its size in the weighted norm, tangent and response columns of the same solve."""

    du: Array
    dl: float
    size: float
    others: Array


class _Newton:
    """One solve: the last row, the weights, and where it began."""

    def __init__(self, curve: Locus, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float) -> None:
        self.curve, self.free, self.tangent = curve, free, tangent
        self.k = list(curve.parameters).index(free)
        self.params = np.array(params, dtype=float)
        if tangent is not None:
            u = u + ds * tangent.u
            self.params[self.k] += ds * tangent.parameter
        self.u, self.w = u, curve.weights
        self.weight = 0.0 if tangent is None else tangent.weight
        self.row = curve.row_of(tangent, u.size)
        self.begun = curve.ordered(u, self.params[self.k])

    def step(self, L: ExtendedLinearisation, residual: Array, columns: Array) -> _Step:
        """One bordered solve with the derivatives of L; `columns` (N + q + 1, r) are solved for besides."""
        off = float(self.row @ (self.curve.ordered(self.u, self.params[self.k]) - self.begun))
        right = np.column_stack([np.append(-residual, -off), columns])
        x = L.solve_bordered(self.row, right)
        du, dl = self.curve.split(x[:, 0])
        size = math.sqrt(float(self.w @ du**2) + (self.weight * dl) ** 2) if np.isfinite(x).all() else math.nan
        return _Step(du, dl, size, x[:, 1:])

    def take(self, step: _Step) -> None:
        """Move by a step."""
        self.u = self.u + step.du
        self.params[self.k] += step.dl

    def settled(self, step: _Step, tolerance: float) -> bool:
        """Whether a step that was taken is small enough to be the last."""
        if not step.size <= tolerance * self.scale:
            return False
        e, change = self.curve.parts(self.u)[2], self.curve.parts(step.du)[2]
        return bool((np.abs(change) <= 1e-6 * (1 + np.abs(e))).all())

    @property
    def scale(self) -> float:
        """1 + |u|."""
        return 1.0 + math.sqrt(float(self.w @ self.u**2))


def corrected(
    curve: Locus, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
) -> Corrected:
    """`Problem.correct` of a `Locus`."""
    if curve.condensed:
        return _compiled(curve, u, params, free, tangent, ds, tolerance)
    at, last = _Newton(curve, u, params, free, tangent, ds), math.inf
    iteration = 0
    L: ExtendedLinearisation | None = None
    while iteration < _MAX_NEWTON:
        iteration += 1
        try:
            if L is None:
                L = ExtendedLinearisation.at(curve, at.u, at.params, free)
            columns = np.zeros((at.row.size, 2))
            columns[-1, 0] = 1.0
            columns[:-1, 1] = L.unfolding
            step = at.step(L, L.residual, columns)
            if not math.isfinite(step.size):
                return failed(at.u, at.params, iteration, "singular")
            at.take(step)
            stalled = 0.25 * last < step.size <= _STALLED * at.scale
            if at.settled(step, _STALLED if stalled else tolerance):
                return _succeeded(at, step.others, iteration, True)
            if (iteration > 2 and step.size > 4 * last) or step.size > 1e6 * at.scale:
                break
            last, before, L = step.size, L, None
            if step.size < _NEAR * at.scale and not np.iscomplexobj(before.begun.frame.left):
                iteration += 1
                L = ExtendedLinearisation.at(curve, at.u, at.params, free)
                cheap = at.step(before, before.residual_elsewhere(L), np.zeros((at.row.size, 0)))
                if cheap.size <= tolerance * at.scale:
                    at.take(cheap)
                    if at.settled(cheap, tolerance):
                        return _succeeded(at, step.others, iteration, False)
                    L = None
        except np.linalg.LinAlgError:
            return failed(at.u, at.params, iteration, "singular")
    return failed(at.u, at.params, iteration, "no convergence")


def _compiled(
    curve: Locus, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
) -> Corrected:
    from .locus_collocation import compiled

    limits = (_NEAR, _STALLED, _MAX_NEWTON)
    found, others, sharp = compiled(curve, u, params, free, tangent, ds, tolerance, limits)
    L = found.linearisation
    if not found.converged:
        return found
    curve.remember("inner", found.u, L)
    curve.remember("response", found.u, others[:, 1])
    curve.remember("sharp", found.u, sharp)
    return found._replace(tangent=_unit(curve, others[:, 2], tangent), linearisation=None)


def _succeeded(at: _Newton, others: Array, iterations: int, sharp: bool) -> Corrected:
    curve, u, tangent = at.curve, at.u, at.tangent
    new = _unit(curve, others[:, 0], tangent)
    try:
        residual = curve.residual_at(u, at.params)
    except np.linalg.LinAlgError:
        return failed(u, at.params, iterations, "singular")
    if curve.kind is Kind.BRANCH_POINT and abs(curve.parts(u)[2][0]) > _UNFOLDED:
        return failed(u, at.params, iterations, f"no branch point: '{curve.free}' unfolds it")
    curve.remember("response", u, others[:, 1])
    curve.remember("sharp", u, sharp)
    return Corrected(u, curve.completed(u, at.params), new, residual, iterations, 0, None, math.isfinite(residual))


def _unit(curve: Locus, direction: Array, tangent: Tangent | None) -> Tangent:
    t_u, rate = curve.split(direction)
    if tangent is None:
        return Tangent(t_u, 1.0, 1.0)
    length = math.sqrt(float(curve.weights @ t_u**2) + (tangent.weight * rate) ** 2)
    return Tangent(t_u / length, rate / length, tangent.weight)


def failed(u: Array, params: Array, iterations: int, note: str) -> Corrected:
    """What a solve returns that found nothing."""
    return Corrected(u, params, None, math.inf, iterations, 0, None, False, note)


# ---------------------------------------------------------------------- at a point of the curve
def _solved(point: Any) -> Array | None:
    """Tangent and response columns at a point, from its own derivatives; None where they are singular."""
    curve: Locus = point.problem
    row = curve.row_of(point.tangent, point.u.size)
    try:
        L = ExtendedLinearisation.at(curve, point.u, point.params, curve.along)
        columns = np.zeros((row.size, 2))
        columns[-1, 0] = 1.0
        columns[:-1, 1] = L.unfolding
        x = L.solve_bordered(row, columns)
    except np.linalg.LinAlgError:
        return None
    return x if np.isfinite(x).all() else None


def sharpened(point: Any) -> Any:
    """The point with the tangent of its own derivatives (after a cheap last step it has that of the iterate before)."""
    if point.problem.recalled("sharp", point.u) is True:
        return point
    x = _solved(point)
    return point if x is None else point._replace(tangent=_unit(point.problem, x[:, 0], point.tangent))


def response(point: Any) -> Array | None:
    """(N + 2 + e,) change of (u, lambda_1, lambda_2, e), orthogonal to the tangent, that answers `unfolding`."""
    known = point.problem.recalled("response", point.u)
    if known is not None:
        return np.asarray(known)
    x = _solved(point)
    return None if x is None else x[:, 1]
