r"""Sensitivity of a special point: how its place moves with every other parameter.

The defining system (`defining`) G(u, lambda_1, e; a) = (F + e b, g) = 0 is regular at the point, so

    [ F_u   F_1   b   ] [ du/da        ]       [ F_a ]
    [ g_u   g_1   g_e ] [ dlambda_1/da ]  =  - [ g_a ],
                        [ de/da        ]

one bordered solve with a right side for every parameter a; the gradients of g are the adjoint ones of the builder (one
forward and one backward sweep along the orbit, second derivatives of the equations). The third unknown gives the torus
angle's or the Hopf frequency's derivative besides. Where a branch point's unfolding parameter has a derivative, the
parameter breaks the point up, and there is no place to differentiate.

At an extremum of lambda_2 over lambda_1 along a curve of special points (the tip of a tongue) dlambda_2/da at fixed
lambda_1 is the derivative of the tip's lambda_2 (envelope theorem). Reference: Govaerts (2000), chapter 4.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, unknown_name
from ..protocols import Critical
from ..results.sensitivity_table import Sensitivity
from ..results.special import SpecialPoint
from ..words import Kind
from .defining import conditions, first_extra, gradients
from .locus import Locus

__all__ = ["sensitivity"]

Array = NDArray[np.float64]
_KINDS = (Kind.FOLD, Kind.BRANCH_POINT, Kind.HOPF, Kind.PERIOD_DOUBLING, Kind.NEIMARK_SACKER)
_BREAKS = 1e-6  # derivative of the unfolding parameter, relative to that of the equations


def sensitivity(point: SpecialPoint, of: str | None = None) -> Sensitivity:
    """Derivatives of the place of a special point by all other parameters (see `SpecialPoint.sensitivity`)."""
    if not isinstance(point, SpecialPoint):
        raise InputError(f"a sensitivity needs a special point such as branch['PD1'], got {type(point).__name__}")
    problem, kind, u, params = point.problem, point.defining_kind, np.array(point.u), point.params_vector
    along, values = point.free, point.critical_values
    extra = None
    if isinstance(problem, Locus):
        params = problem.completed(u, params)
        u, _, extra = problem.parts(u)
        problem, kind, along = problem.inner, problem.kind, problem.along
    if kind not in _KINDS:
        raise InputError(f"{point.label} is a {kind} point: it has no defining system whose derivative could be taken")
    names = list(problem.parameters)
    of = point.free if of is None else of
    if of not in names:
        raise unknown_name("parameter", of, names, "this problem")
    if extra is None:
        extra = first_extra(kind, problem.critical, values)
    x, breaking = _derivatives(problem, kind, u, params, along, of, extra)
    others = [name for name in names if name != of]
    kept = [k for k in range(len(others)) if k not in breaking]
    angle = _angle_rates(problem.critical, kind, extra, x[u.size + 1 :])
    return Sensitivity(
        label=point.label,
        kind=kind if point.defining_kind is point.kind else point.kind,
        name=of,
        value=float(params[names.index(of)]),
        params=dict(zip(names, params.tolist())),
        derivatives={others[k]: float(x[u.size, k]) for k in kept},
        angle={others[k]: float(angle[k]) for k in kept} if angle is not None else {},
        breaking=tuple(others[k] for k in sorted(breaking)),
    )


def _derivatives(
    problem: Any, kind: Kind, u: Array, params: Array, along: str, of: str, extra: Array
) -> tuple[Array, set[int]]:
    """(N + 1 + e, m - 1) derivatives of (u, lambda_1, e), and which parameters break a branch point."""
    names = list(problem.parameters)
    L = problem.linearise(u, params)
    try:
        begun = conditions(kind, L, problem.critical, along, extra)
        found = gradients(kind, L, problem.critical, along, extra, begun)
    except np.linalg.LinAlgError:
        raise ConvergenceError("the conditions of this point are singular", last=u) from None
    n, q, e = u.size, found.g.size, extra.size
    columns = np.zeros((n, 1 + e))
    columns[:, 0] = L.column(of)
    if kind is Kind.BRANCH_POINT:
        columns[:, 1] = L.embed(np.real(begun.frame.left[:, 0]))
    k = names.index(of)
    corner = np.column_stack([found.by_params[:, k], found.by_extra.reshape(q, e)])
    rest = [i for i in range(len(names)) if i != k]
    right = -np.concatenate([np.column_stack([L.column(names[i]) for i in rest]), found.by_params[:, rest]])
    x = np.asarray(L.solve(found.by_u, columns, corner, right))
    if not np.isfinite(x).all():
        raise ConvergenceError(
            f"'{of}' does not move this point, or it is one of higher codimension: its place has no derivative",
            last=u,
        )
    symmetry = getattr(problem, "symmetry", None)  # of half-period orbits: what breaks it has no place there
    breaking = {i for i, j in enumerate(rest) if symmetry is not None and names[j] in symmetry.fixed}
    if kind is Kind.BRANCH_POINT:
        drive = np.abs(right[:n]).max(axis=0)
        breaking |= {i for i in range(len(rest)) if abs(x[n + 1, i]) * np.abs(columns[:, 1]).max() > _BREAKS * drive[i]}
    return x, breaking


def _angle_rates(critical: Critical, kind: Kind, extra: Array, rates: Array) -> Array | None:
    """Derivatives of theta = arccos c or omega = sqrt(kappa) from those of c or kappa."""
    if kind not in (Kind.HOPF, Kind.NEIMARK_SACKER):
        return None
    e = float(extra[0])
    slope = -1.0 / math.sqrt(max(1 - e * e, 1e-300)) if critical.circle else 0.5 / math.sqrt(max(e, 1e-300))
    return np.asarray(slope * rates[0])
