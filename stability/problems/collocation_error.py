"""Errors of a collocation solution, measured by one Newton step at degree m + 1 from the same orbit.

The step changes the nodes by their error at degree m, up to higher order, and likewise the period and the multipliers.
Along a branch it is taken with the arclength condition of the point; for a solution alone, at fixed parameters, unless
the solution lies close to a fold: there the step is bordered by the null direction, and the parameter that unfolds the
singularity most is free. The step costs about as much as an iteration of the solve, so the error of multipliers that
are far from the unit circle is carried over from an earlier point of the same mesh.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..protocols import Corrected, Tangent
from .orbit_spectrum import deflated, eigenvalues, spectrum_distance

if TYPE_CHECKING:
    from .collocation import Collocation
    from .collocation_linearisation import CollocationLinearisation, Workspace

__all__ = ["multiplier_error", "node_error", "refined"]

Array = np.ndarray


def _same(a: Array, b: Array) -> bool:
    return a is b or np.array_equal(a, b)


def refined(problem: Collocation, u: Array, params: Array) -> tuple[Array, Array, Workspace] | None:
    """(change of u's nodes, corrected u at degree m + 1, its arrays) of one Newton step; None if it failed."""
    known = problem._memo.get("refined")
    if known is not None and _same(known[0], u) and _same(known[1], params):
        found_before: tuple[Array, Array, Workspace] | None = known[2]
        return found_before
    mesh = problem.mesh
    nodes, stages, rest = mesh.split(u)
    higher = mesh.raised
    start = higher.join(nodes, mesh.resample(higher, nodes, stages), rest)
    index, tangent = 0, None
    at = problem._memo.get("tangent")
    if at is not None and _same(at[0], u):
        index, t = at[1], at[2]
        t_nodes, t_stages, t_rest = mesh.split(t.u)
        t_stages = mesh.resample(higher, t_nodes, t_stages)
        tangent = Tangent(higher.join(t_nodes, t_stages, t_rest), t.parameter, t.weight)
    found = problem.newton(higher, start, params, index, tangent, 0.0, np.inf, 1)
    if tangent is None and not _is_small(problem, found, nodes):
        # close to a fold the step at a fixed parameter runs along the branch: hold the solution's place there
        index, null = _along_branch(problem, u, params)
        t_nodes, t_stages, t_rest = mesh.split(null)
        t_stages = mesh.resample(higher, t_nodes, t_stages)
        border = Tangent(higher.join(t_nodes, t_stages, t_rest), 0.0, 1.0)
        other = problem.newton(higher, start, params, index, border, 0.0, np.inf, 1)
        found = other if _is_small(problem, other, nodes) else found
    result: Any = None
    if found.converged:
        change = higher.split(found.u)[0] - nodes
        result = (change, found.u, found.linearisation)
    problem._memo["refined"] = (u, params, result)
    return result


def _is_small(problem: Collocation, found: Corrected, nodes: Array) -> bool:
    """Whether the step of `refined` is what a discretisation error can be."""
    change = problem.mesh.raised.split(found.u)[0] - nodes
    return found.converged and bool(np.abs(change / problem.scales).max() < 1e-4)


def _along_branch(problem: Collocation, u: Array, params: Array) -> tuple[int, Array]:
    """The parameter that unfolds a nearly singular core most, and its null direction as a unit vector in u."""
    L = problem.linearise(u, params)
    if L.sign == 0.0:
        return 0, np.zeros(problem.size)
    left, _, right = np.linalg.svd(L.core)
    null = L.lift(right[-1])
    columns = [abs(float(left[:, -1] @ L.core_column(name))) for name in problem.parameters]
    sizes = np.maximum(np.abs(params), 1e-3)
    length = math.sqrt(float(problem.weights @ null**2))
    return int(np.argmax(np.array(columns) * sizes)), null / max(length, 1e-300)


def node_error(problem: Collocation, u: Array, params: Array) -> float:
    """Largest error of the nodes and of the period over their scales, by degree m + 1; inf: unknown."""
    step = refined(problem, u, params)
    if step is None:
        return np.inf
    worst = float(np.abs(step[0] / problem.scales).max())
    if problem.mesh.own:
        worst = max(worst, abs(float(step[1][-1] - u[-1])) / float(u[-1]))
    return worst


def multiplier_error(
    problem: Collocation, linearisation: CollocationLinearisation, values: Array, direction: Array | None
) -> float:
    """Change of the multipliers near the unit circle from degree m to m + 1.

    Where no multiplier is near the circle, the change at an earlier point of the same mesh is carried over, times
    3 and the square of the growth of the m-th derivative (up to 2): nodes have twice the order of the polynomial.
    """
    mesh = problem.mesh
    nodes, stages, _ = mesh.split(linearisation.solution)
    size = float(np.abs(mesh.leading(nodes, stages) / problem.scales).max())
    known = problem._memo.get("level")
    if known is not None and 0 < size < 2 * known[1]:
        carried = 3 * known[0] * max(1.0, size / known[1]) ** 2
        if float(np.abs(np.abs(values) - 1).min(initial=1.0)) > 1e3 * carried + 1e-5:
            return float(carried)
    step = refined(problem, linearisation.solution, linearisation.solution_params)
    if step is None:
        return math.inf
    other = problem.spectral_of(step[2].M)
    if direction is not None:
        other = deflated(other, direction)[0]
    error = spectrum_distance(values, eigenvalues(other))
    problem._memo["level"] = (max(error, 1e-15), size)
    return error
