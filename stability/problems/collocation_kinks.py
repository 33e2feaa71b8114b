r"""Errors of a collocation solution that passes kinks, by integration with its passages located.

Polynomials across a kink lose their order: nodes are off by O(h^2), and the variational equation, whose matrix jumps
inside an interval, by O(h); one more degree has the same trouble in the same intervals and sees a part of it only. The
flow phi over the span of the mesh, in pieces that end at the kinks, with saltation (integration/flow.py), has none of
it. From the first node x_0, with the closure x(1) = S x(0) + w,

    (Phi - S) dx = S x_0 + w - phi(x_0)      (autonomous: + f(end) dsigma,  f(x_0) . dx = 0)

is the error of x_0 to first order; parts along which the matrix is singular (a branch at its fold) are left out, as
they only move the orbit along its branch. A second integration from x_0 + dx gives the orbit whose nodes and
multipliers the errors are counted from. Twice the largest difference of a multiplier, not over its modulus, is their
error. Cost: two integrations a point.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import ConvergenceError, NonFiniteError, StabilityWarning
from ..integration.flow import flow
from ..integration.switches import has_switches
from .kinks import kink_words, passes
from .orbit_spectrum import deflated, eigenvalues, spectrum_distance

if TYPE_CHECKING:
    from .collocation import Collocation
    from .collocation_linearisation import CollocationLinearisation

__all__ = ["Passage", "kink_advice", "kink_error", "passage", "warn_of_kinks"]

Array = np.ndarray
_RTOL = 1e-9
_SINGULAR = 1e-4
_MOST_STEPS = 20_000


class Passage(NamedTuple):
    """What the integration says: Phi of the corrected orbit, direction of the flow or None, error of the nodes."""

    fundamental: Array
    direction: Array | None
    nodes: float


_LOST = Passage(np.full((1, 1), np.nan), None, math.inf)


def kink_advice(system: object) -> str:
    """What to say of a problem that stops, where the equations have kinks; begins with a semicolon, or empty."""
    words = kink_words(system)
    return f"; the equations have kinks ({words}) that polynomials in time do not follow: try Shooting" if words else ""


def passage(problem: Collocation, u: Array, params: Array) -> Passage | None:
    """The orbit again, by integration; None where it passes no kink."""
    if not has_switches(problem.system):
        return None
    known = problem._memo.get("passage")
    if known is not None and np.array_equal(known[0], u) and np.array_equal(known[1], params):
        return known[2]  # type: ignore[no-any-return]
    found = None
    if _passes(problem, u, params):
        try:
            found = _integrated(problem, u, params)
        except (ConvergenceError, NonFiniteError, np.linalg.LinAlgError):
            found = _LOST
    problem._memo["passage"] = (np.array(u), np.array(params), found)
    return found


def _span(problem: Collocation, u: Array, params: Array) -> float:
    """Time from the first node to the last."""
    if problem.mesh.own:
        return float(problem.mesh.span * u[-1])
    return float(problem.mesh.span * problem.evaluations.period(params))


def _passes(problem: Collocation, u: Array, params: Array) -> bool:
    nodes, stages, _ = problem.mesh.split(u)
    X = np.concatenate([nodes, stages.reshape(-1, problem.mesh.n)])
    places = np.concatenate([problem.mesh.edges, problem.mesh.points.ravel()])
    return passes(problem.system, places * _span(problem, u, params), X, params)


def _integrated(problem: Collocation, u: Array, params: Array) -> Passage:
    mesh, scales = problem.mesh, problem.scales
    nodes, span = mesh.split(u)[0], _span(problem, u, params)
    own = mesh.own

    def run(x: Array, end: float) -> tuple[Array, Array, Array]:
        found = flow(
            problem.system, (0.0, end), x, params, rtol=_RTOL, atol=_RTOL * scales, variations=True, dense=True,
            max_steps=_MOST_STEPS,
        )  # fmt: skip
        assert found.matrix is not None
        return found.x, found.matrix, found(np.clip(mesh.edges * end, 0.0, end)).T

    def rate(x: Array) -> Array:
        return np.asarray(problem.evaluations.F(np.zeros(1), np.ascontiguousarray(x[None]), params)[0])

    end, matrix, _ = run(nodes[0], span)
    gap = problem.closure @ nodes[0] + problem.winding - end
    A = (matrix - problem.closure) * scales / scales[:, None]
    right = gap / scales
    if own:
        flown, first = rate(end) * span / scales, rate(nodes[0]) / scales
        first = first / max(float(np.linalg.norm(first)), 1e-300)
        A = np.block([[A, flown[:, None]], [first[None], np.zeros((1, 1))]])
        right = np.append(right, 0.0)
    cut = _SINGULAR / max(1.0, float(np.linalg.norm(A, 2)))
    change = np.linalg.lstsq(A, right, rcond=cut)[0]
    start, stretched = nodes[0] + change[: mesh.n] * scales, span * (1 + (change[-1] if own else 0.0))
    if not (np.isfinite(change).all() and stretched > 0):
        return _LOST
    end, matrix, along = run(start, stretched)
    worst = max(float(np.abs((along - nodes) / scales).max()), abs(float(change[-1])) if own else 0.0)
    return Passage(matrix, rate(start) / scales if own else None, worst)


def kink_error(problem: Collocation, linearisation: CollocationLinearisation, values: Array) -> float:
    """Error of the multipliers `values` that the passages of kinks make; 0 where there are none."""
    found = passage(problem, linearisation.u, linearisation.params)
    if found is None:
        return 0.0
    if not np.isfinite(found.fundamental).all():
        return math.inf
    matrix = problem.spectral_of(found.fundamental)
    if found.direction is not None:
        if not found.direction.any():
            return math.inf
        matrix = deflated(matrix, found.direction)[0]
    others = eigenvalues(matrix)
    warn_of_kinks(problem, linearisation.params, found)
    distance = max(spectrum_distance(values, others), spectrum_distance(others, values))
    return 2 * distance * max(1.0, float(np.abs(values).max(initial=0.0)))


def warn_of_kinks(problem: Collocation, params: Array, found: Passage) -> None:
    """One StabilityWarning for a problem and its adapted copies, where the wanted accuracy is missed."""
    if found.nodes <= problem.accuracy or problem._warned:
        return
    problem._warned.add("kinks")
    where = ", ".join(f"{k} = {v:.6g}" for k, v in zip(problem.parameters, params.tolist()))
    warnings.warn(
        f"'{problem.system.name}' passes kinks ({kink_words(problem.system)} in its equations) at {where}: estimated "
        f"error {found.nodes:.1e} of the states' scales, wanted {problem.accuracy:.0e}; collocation converges slowly "
        "there and finer meshes help little. Shooting locates the kinks",
        StabilityWarning, stacklevel=4,
    )  # fmt: skip
