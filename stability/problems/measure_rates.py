r"""`sensitivity`: how a number told of a solution (an amplitude, an extremum, a period) moves with every parameter.

F(u, a) = 0 gives F_u du/da = -F_a, one factorisation and a right side for every parameter a, the period's dependence
included. A measure m(u, a) (a column of a branch) then changes at the rate

    dm/da = (m(u + h du/da, a + h) - m(u - h du/da, a - h)) / 2h,      extrapolated from two steps h (fourth order):

a difference of a formula, no solution is computed again. Extrema are those of the interpolating polynomial: where two
of them are equally high m has a kink, and the rate is that of neither. At a fold no rate exists. Reference: Kelley and
Deuflhard on implicit differentiation: Deuflhard, Newton Methods for Nonlinear Problems (2004), section 5.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, check_names, unknown_name
from ..protocols import Problem
from ..results.sensitivity_table import Sensitivity
from ..results.special import SpecialPoint

__all__ = ["measure_rates", "sensitivity"]

Array = NDArray[np.float64]
_STEP = 1e-4  # of a difference, relative to the size of the solution


def sensitivity(
    problem: Problem | SpecialPoint, of: str | None = None, *, start: Any = None, tolerance: float = 1e-9,
    **params: float,
) -> Sensitivity:  # fmt: skip
    """Derivatives of a number told of one solution of F(u, p) = 0 by all parameters, as a ranked table.

    Parameters
    ----------
    problem : Problem or SpecialPoint
        `Collocation`, `HarmonicBalance`, `Shooting`, `Equilibrium`, ...; for a special point as
        `SpecialPoint.sensitivity`.
    of : str
        A column of branches of this problem: ``"theta.max"``, ``"u.amplitude(1)"``, ``"period"``, ``"x"`` (equilibria),
        an output's ``"<name>.mean"`` (its extrema are those of the mesh's points, too coarse to differentiate).
    start : state, solution or None
        Something near the solution; one that knows its own parameter values (an orbit of `Branch.at`) brings them.
    tolerance : float
        Of Newton's method, as in `continuation`.
    **params : float
        Parameter values that differ from the start's, or from the defaults.

    Returns
    -------
    Sensitivity
        ``table["xi"]`` is d(of)/d(xi) with all other parameters fixed; ``table.relative`` in per cent for per cent.

    Raises
    ------
    UnknownNameError
        No such column or parameter.
    ConvergenceError
        There is no solution near the start, or it is a fold or branch point.

    Notes
    -----
    *Accuracy*: of the discrete problem, 1e-9 relative; checked against differences of solutions computed separately.

    Examples
    --------
    >>> import stability as st
    >>> table = st.sensitivity(st.Collocation(st.models.duffing(xi=0.1, beta=0.0)), "u.amplitude(1)", Omega=1.0)
    >>> round(table["xi"], 6)  # amplitude 1/(2 xi) at resonance
    -50.0
    """
    if isinstance(problem, SpecialPoint):
        if start is not None or params:
            raise InputError("a special point brings its own solution and parameters: sensitivity(point, of)")
        return problem.sensitivity(of)  # type: ignore[no-any-return]
    names = list(problem.parameters)
    check_names("parameter", params, names, "this problem")
    if of is None:
        raise InputError("say of what: sensitivity(problem, of='theta.max'), the name of a column of its branches")
    if problem.seed() is not None:
        raise InputError("a problem born at a special point is a branch: give the method's own, and an orbit as start=")
    known = getattr(start, "params", {})
    values = {name: params.get(name, known.get(name, value)) for name, value in problem.parameters.items()}
    vector = np.array([float(v) for v in values.values()])
    if not np.isfinite(vector).all():
        raise InputError(f"parameter values must be finite, got {values}")
    u = problem.start(vector, start)
    found = problem.correct(u, vector, names[0], None, 0.0, tolerance)
    if not found.converged:
        raise ConvergenceError(f"no solution: {found.note}; give start= nearer to one", last=u, note=found.note)
    return measure_rates(problem, found.u, found.params, of)


def measure_rates(problem: Any, u: Array, params: Array, of: str) -> Sensitivity:
    """The table at a solution (u, params)."""
    measures, names = problem.measures(u, params), list(problem.parameters)
    if of not in measures:
        raise unknown_name("column", of, list(measures), "this problem")
    if of in {f"{name}.{end}" for name in problem.system.outputs for end in ("max", "min")}:
        raise InputError(f"'{of}' is taken at the mesh's points and has no reliable rate: give a state's, or .mean")
    L = problem.linearise(u, params)
    right = -np.column_stack([L.column(name) for name in names])
    rates = np.asarray(L.solve(np.zeros((0, u.size)), np.zeros((u.size, 0)), np.zeros((0, 0)), right))
    if not np.isfinite(rates).all():
        raise ConvergenceError(f"'{of}' has no rate here: the solution is a fold or branch point", last=u)
    weights = problem.weights
    size = 1.0 + math.sqrt(float(weights @ u**2))
    derivatives = {}
    for k, name in enumerate(names):
        du = rates[:, k]
        speed = math.sqrt(float(weights @ du**2)) / size
        step = _STEP * min(1 / speed if speed else math.inf, max(abs(float(params[k])), 1e-2))
        coarse, fine = (_difference(problem, u, params, du, k, of, h) for h in (step, step / 2))
        derivatives[name] = (4 * fine - coarse) / 3
    return Sensitivity(
        label=of, kind=None, name=of, value=float(measures[of]), params=dict(zip(names, params.tolist())),
        derivatives=derivatives, angle={},
    )  # fmt: skip


def _difference(problem: Any, u: Array, params: Array, du: Array, k: int, of: str, h: float) -> float:
    ends = []
    for side in (h, -h):
        p = params.copy()
        p[k] += side
        ends.append(problem.measures(u + side * du, p)[of])
    return float(ends[0] - ends[1]) / (2 * h)
