"""Errors of a collocation solution, measured by one Newton step at degree m + 1 from the same orbit.

The step changes the nodes by their error at degree m, up to higher order, and likewise the period and the multipliers.
Along a branch it is taken with the arclength condition of the point; for a solution alone, at fixed parameters. Where a
multiplier is 1, at folds and branch points, the linear system of that step is singular and the step would run along the
branch, or over to the other one: there it is bordered by the null vectors v of F_u and w of F_u^T,

    [ F_u   w ] [ change ]   [ -F ]
    [ v^T   0 ] [   mu   ] = [  0 ],

so that the solution keeps its place along v, and what of F only a change of the parameter could mend (mu) is left: it
moves the special point, not the orbit. The step costs about as much as an iteration of the solve, so the error of
multipliers that are far from the unit circle is carried over from an earlier point of the same mesh.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels.condensation_reduced import monodromy_product
from ..protocols import Tangent
from .orbit_spectrum import deflated, eigenvalues, spectrum_distance

if TYPE_CHECKING:
    from .collocation import Collocation
    from .collocation_linearisation import CollocationLinearisation, Workspace

__all__ = ["TRUST", "carried_errors", "carried_to", "multiplier_error", "node_error", "refined"]

Array = np.ndarray
_SINGULAR = 1e-4  # distance of a multiplier from 1 below which a step at a fixed parameter means nothing
_HIGHEST = 11
_ALIKE = 0.8  # ratio of roughnesses
# a carried error: its factor, the growth up to which it is carried; distance from the circle beyond which it may be, as
# a multiple of it and absolutely; rounding of a product of matrices
TRUST = (3.0, 10.0, 1e3, 1e-5, 1e-15)


def _same(a: Array, b: Array) -> bool:
    return a is b or np.array_equal(a, b)


def refined(
    problem: Collocation, u: Array, params: Array, values: Array | None = None
) -> tuple[Array, Array, Workspace] | None:
    """(change of u's nodes, corrected u at degree m + 1, its arrays) of one Newton step; None if it failed.

    values : the multipliers but the trivial one, where they are known
    """
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
    result: Any = None
    if tangent is None and values is None:
        values = _free_multipliers(problem, u, params)
    if tangent is None and values is not None and np.abs(values - 1).min(initial=1.0) < _SINGULAR:
        result = _held_step(problem, u, params)
    else:
        found = problem.newton(higher, start, params, index, tangent, 0.0, np.inf, 1)
        if found.converged:
            result = (higher.split(found.u)[0] - nodes, found.u, found.linearisation)
    problem._memo["refined"] = (u, params, result)
    return result


def _free_multipliers(problem: Collocation, u: Array, params: Array) -> Array | None:
    """Multipliers besides the trivial one, kept for `node_error`; None where there are none."""
    L = problem.linearise(u, params)
    M, direction = L.spectral, None
    if L.sign == 0.0 or not np.isfinite(M).all():
        return None
    if problem.mesh.own:
        direction = problem.direction_of_flow(L)
        if not direction.any():  # an orbit at its birth stands still
            return None
        M = deflated(M, direction)[0]
    values = eigenvalues(M)
    problem._memo["multipliers"] = u, values, direction
    return values


def _held_step(problem: Collocation, u: Array, params: Array) -> tuple[Array, Array, Workspace] | None:
    """The bordered step of the module's head (at degree 10 for the highest degree, 11: it bounds the error then)."""
    degree = problem.degree + 1 if problem.degree < _HIGHEST else _HIGHEST - 1
    other = dataclasses.replace(problem, degree=degree, _memo={})
    nodes, stages, rest = problem.mesh.split(u)
    start = other.mesh.join(nodes, problem.mesh.resample(other.mesh, nodes, stages), rest)
    L = other.linearise(start, params)
    if L.sign == 0.0 or not np.isfinite(L.core).all():
        return None
    left, _, right = np.linalg.svd(L.core)
    null = L.lift(right[-1])
    row = other.weights * null / max(math.sqrt(float(other.weights @ null**2)), 1e-300)
    right_side = -np.append(L.residual, 0.0)[:, None]
    x = L.solve(row[None], L.embed(left[:, -1])[:, None], np.zeros((1, 1)), right_side)[:-1, 0]
    if not np.isfinite(x).all():
        return None
    return other.mesh.split(x)[0].copy(), start + x, L.work


def node_error(problem: Collocation, u: Array, params: Array) -> float:
    """Largest error of the nodes and of the period over their scales, by degree m + 1; inf: unknown."""
    step = refined(problem, u, params)
    if step is None:
        return np.inf
    worst = float(np.abs(step[0] / problem.scales).max())
    if problem.mesh.own:
        worst = max(worst, abs(float(step[1][-1] - u[-1])) / float(u[-1]))
    known = problem._memo.pop("multipliers", None)
    if known is not None and known[0] is u and "level" not in problem._memo:
        _measured(problem, step, known[1], known[2], u, worst, _roughness(problem, u))
    return worst


def _measured(
    problem: Collocation, step: tuple[Array, Array, Workspace], values: Array, direction: Array | None, u: Array,
    nodes: float, roughness: float,
) -> float:  # fmt: skip
    """The change of the multipliers `values` by a refining step from u; what is measured is kept, to be carried."""
    other = problem.spectral_of(monodromy_product(step[2].M))
    if direction is not None:
        other = deflated(other, direction)[0]
    error = spectrum_distance(values, eigenvalues(other))
    level = max(error, 1e-15), nodes, roughness
    problem._memo["level"] = level
    problem._memo.setdefault("levels", {})[id(u)] = u, level
    return error


def multiplier_error(
    problem: Collocation, linearisation: CollocationLinearisation, values: Array, direction: Array | None
) -> float:
    """Change of the multipliers near the unit circle from degree m to m + 1.

    Where none is near the circle, but for those that are critical by construction, the change at an earlier point of
    the same mesh is carried over, times 3 and the square of the growth of the last terms h^m x^(m) / m! (up to 10):
    nodes have twice the order of the polynomial, and a mesh made for one orbit may resolve another one worse. On a
    curve of special points, whose own error it is, only between points that are nearly as rough.
    """
    solution, roughness = linearisation.solution, linearisation.summary[2]
    problem._memo["roughness"] = solution, roughness
    carried, _ = carried_errors(problem, solution, roughness)
    if linearisation.critical and not _alike(problem, roughness):
        carried = math.inf
    free = values.tolist()
    for target in linearisation.critical[: len(free)]:
        free.remove(min(free, key=lambda z: abs(z - target)))
    if min((abs(abs(z) - 1) for z in free), default=1.0) > TRUST[2] * carried + TRUST[3]:
        return carried
    step = refined(problem, solution, linearisation.solution_params, values)
    if step is None:
        return math.inf
    nodes = node_error(problem, solution, linearisation.solution_params)
    return _measured(problem, step, values, direction, solution, nodes, roughness)


def _alike(problem: Collocation, roughness: float) -> bool:
    """Whether the point at which errors were measured last is hardly rougher or smoother than this one."""
    known = problem._memo.get("level")
    return known is not None and _ALIKE * known[2] < roughness and _ALIKE * roughness < known[2]


def carried_errors(problem: Collocation, u: Array, roughness: float | None = None) -> tuple[float, float]:
    """Errors of multipliers and nodes carried from an earlier point of the same mesh (see above); inf: unknown."""
    at, known = problem._memo.get("levels", {}).get(id(u), (None, None))
    if at is not u:
        known = problem._memo.get("level")
    if known is None:
        return math.inf, math.inf
    if roughness is None:
        roughness = _roughness(problem, u)
    growth = roughness / known[2] if known[2] > 0 else math.inf
    if not 0 < growth < TRUST[1]:
        return math.inf, math.inf
    factor = TRUST[0] * max(1.0, growth) ** 2
    return factor * known[0], factor * known[1]


def carried_to(problem: Collocation, new: Collocation) -> None:
    """Let `new`, the same problem with other scales, know the errors that `problem` knows."""
    known = problem._memo.get("level")
    if known is not None:
        ratios = problem.scales / new.scales
        new._memo["level"] = (known[0], known[1] * float(ratios.max()), known[2] * float(ratios.min()))


def _roughness(problem: Collocation, u: Array) -> float:
    """The largest last term of the polynomials over the scales: what the mesh resolves worst (`summary`)."""
    known = problem._memo.get("roughness")
    if known is not None and known[0] is u:
        return float(known[1])
    nodes, stages, _ = problem.mesh.split(u)
    return float(np.abs(problem.mesh.last_terms(nodes, stages) / problem.scales).max())
