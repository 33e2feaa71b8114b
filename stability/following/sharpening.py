r"""Special points as accurate as the branch: located once more where their mesh was not good enough.

A special point is located on the mesh of the older of its neighbours. Where the solution changes quickly that mesh may
have fallen behind: its error, estimated at the point itself, is larger than the accuracy that was asked for. Then the
mesh is adapted there, and the defining system (`problems.defining`) is solved again on it, from the known point.
"""

from __future__ import annotations

import math

from ..problems.collocation import Collocation
from ..problems.collocation_error import carried_errors
from ..problems.defining import locate
from ..protocols import Tangent
from ..words import Kind
from .follower import Entry
from .points import dot, smooth_tests
from .settings import Settings

__all__ = ["sharpened"]

_DEFINED = (Kind.FOLD, Kind.BRANCH_POINT, Kind.PERIOD_DOUBLING, Kind.NEIMARK_SACKER)
_WORSE = 2.0  # error over the accuracy beyond which the point is located again
_ROUNDS = 3
_NEAR = 1e-4  # scaled distance by which the better point may lie from the first


def sharpened(settings: Settings, entry: Entry) -> Entry:
    """The entry, or a better one of the same special point."""
    for _ in range(_ROUNDS):
        better = _better(settings, entry)
        if better is None:
            break
        entry = better
    return entry


def _better(settings: Settings, entry: Entry) -> Entry | None:
    """The same special point on an adapted mesh; None where the mesh is good, or nothing was found on a better one."""
    point, found = entry
    old = point.problem
    if found is None or found.kind not in _DEFINED or not isinstance(old, Collocation) or not old.adaptive:
        return None
    allowed = _WORSE * old.accuracy
    if carried_errors(old, point.u)[1] <= 3 * allowed or not old.error(point.u, point.params) > allowed:
        return None
    adapted = old.adapt(point.u, point.params, point.tangent)
    if adapted is None:
        return None
    problem, u, tangent = adapted
    on_half = found.breaking and problem.halved
    kind = Kind.PERIOD_DOUBLING if on_half else found.kind
    spectrum = point.spectrum
    at = locate(problem, kind, u, point.params, settings.name, settings.weight, spectrum.values, radius=_NEAR)
    parameter = float(at.params[settings.index])
    if not at.converged or abs(parameter - point.parameter) * settings.weight > _NEAR:
        return None
    spectrum = problem.spectrum(problem.linearise(at.u, at.params))
    length = math.sqrt(dot(problem.weights, tangent.u, tangent.u) + (tangent.parameter * tangent.weight) ** 2)
    new = point._replace(
        problem=problem, u=at.u, params=at.params, parameter=parameter, spectrum=spectrum,
        tangent=Tangent(tangent.u / length, tangent.parameter / length, tangent.weight),
        tests=smooth_tests(spectrum.values, problem.critical.circle),
    )  # fmt: skip
    return Entry(new, found._replace(point=new, accuracy=at.accuracy))
