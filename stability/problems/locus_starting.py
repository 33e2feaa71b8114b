r"""`locus`: from a special point to the problem of the curve on which it lies in two parameters.

The curve's direction at the point is the null vector of the extended linearisation [F_u F_1 F_2 b; g_u g_1 g_2 g_e]
(`locus_system`), found by bordering it with a random row, then with the result itself.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, unknown_name
from ..protocols import Problem
from ..results.special import SpecialPoint
from ..words import Kind
from .defining import first_extra
from .locus import CURVES, Locus
from .locus_system import ExtendedLinearisation

__all__ = ["locus"]

Array = NDArray[np.float64]
_SMALLEST_SCALE = 0.05  # of the second parameter, relative to its default


def locus(
    point: SpecialPoint, *, free: str, along: str | None = None, window: tuple[float, float] | None = None
) -> Locus:
    """The curve of special points like `point` in two parameters; give it to `continuation`.

    F(u, lambda_1, lambda_2) = 0 together with the condition of the point's kind: multiplier +1 (fold, branch point),
    -1 (period doubling), exp(+-i theta) (Neimark-Sacker), eigenvalue 0 (fold) or +-i omega (Hopf).

    Parameters
    ----------
    point : SpecialPoint
        A fold, Hopf, period-doubling, Neimark-Sacker or branch point of a branch, also of a loaded one.
    free : str
        The second parameter, which becomes an unknown; its values are the column of that name.
    along : str or None
        The parameter that `continuation` will follow; by default the one of the branch on which the point was found.
    window : (low, high) or None
        Where the curve ends in `free`, inside the system's bounds of that parameter (which are the default).

    Returns
    -------
    Locus
        For ``continuation(locus(point, free="xi"), "Omega", (lo, hi))``: both sides of the point, joined. Columns:
        both parameters, ``torus_angle`` or ``hopf_frequency``, and the solution's. The verdict of a point tells whether
        the values that are not critical are inside: STABLE where the curve is a border of stability.

    Raises
    ------
    InputError
        The kind has no curve, the two parameters are one, or a branch point that the second parameter breaks up.
    UnknownNameError
        No such parameter.
    ConvergenceError
        The defining system is singular at the point (itself a point of higher codimension).

    Examples
    --------
    >>> import stability as st
    >>> branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14))
    >>> curve = st.continuation(st.locus(branch["HB1"], free="sigma"), "rho", (20, 30))
    >>> s, b, rho = curve.columns["sigma"], 8 / 3, curve.columns["rho"]
    >>> float(abs(rho - s * (s + b + 3) / (s - b - 1)).max()) < 1e-9
    True
    """
    if not isinstance(point, SpecialPoint):
        raise InputError(f"locus needs a special point such as branch['PD1'], got {type(point).__name__}")
    if point.kind not in CURVES:
        known = ", ".join(str(kind) for kind in CURVES)
        raise InputError(f"{point.label} is a {point.kind} point: curves exist for {known} points")
    problem, along = point.problem, point.free if along is None else along
    if isinstance(problem, Locus):
        raise InputError(f"{point.label} lies on a curve in two parameters already; a third one cannot be freed")
    names = list(problem.parameters)
    for name in (free, along):
        if name not in names:
            raise unknown_name("parameter", name, names, "this problem")
    if free == along:
        raise InputError(
            f"'{free}' is the parameter of the branch itself: name another one, or say along='...' which to follow"
        )
    for name in (free, along):
        getattr(problem, "check_free", _anything)(name)
    return _born(problem, point, free, along, _window(problem, point, free, window))


def _window(
    problem: Problem, point: SpecialPoint, free: str, window: tuple[float, float] | None
) -> tuple[float, float]:
    """The window of the second parameter, checked: inside the bounds, with the point in it."""
    bounds = getattr(getattr(problem, "system", None), "bounds", {}).get(free, (-math.inf, math.inf))
    lowest, highest = (float(v) for v in bounds)
    if window is None:
        return lowest, highest
    try:
        low, high = sorted(float(v) for v in window)
    except (TypeError, ValueError):
        raise InputError(f"the window of '{free}' must be two numbers (low, high), got {window!r}") from None
    if not low < high:
        raise InputError(f"the window of '{free}' must be two different numbers, got ({low:g}, {high:g})")
    if not lowest <= low < high <= highest:
        raise InputError(
            f"the window ({low:g}, {high:g}) leaves the bounds [{lowest:g}, {highest:g}] of the parameter '{free}'"
        )
    if not low <= point.params[free] <= high:
        raise InputError(
            f"{point.label} lies at {free} = {point.params[free]:.10g}, outside the window ({low:g}, {high:g})"
        )
    return low, high


def _anything(name: str) -> None:
    """Problems without a symmetry let every parameter go."""


def _born(problem: Problem, point: SpecialPoint, free: str, along: str, window: tuple[float, float]) -> Locus:
    params = point.params_vector
    second = point.params[free]
    kind = point.defining_kind
    extra = first_extra(kind, problem.critical, point.critical_values)
    scale = max(abs(second), _SMALLEST_SCALE * (abs(problem.parameters[free]) or 1.0))
    curve = Locus(problem, kind, free, along, scale, window)
    U = np.concatenate([point.u, [second], extra])
    try:
        L = ExtendedLinearisation.at(curve, U, params, along)
        direction = _direction(curve, L)
    except np.linalg.LinAlgError:
        direction = None
    if direction is None:
        raise ConvergenceError(
            f"the curve through {point.label} has no direction there: a point of higher codimension; begin beside it",
            last=point.u,
        )
    if kind is Kind.BRANCH_POINT and abs(direction[0][-1]) > 1e-5 * _size(curve, direction[0]):
        raise InputError(
            f"{point.label} is a crossing that '{free}' breaks up: no branch points beside it. Follow the folds near "
            f"it, or a parameter that keeps the symmetry or the trivial solution which makes it"
        )
    return dataclasses.replace(curve, born=(U, params, *direction))


def _size(curve: Locus, direction: Array) -> float:
    return math.sqrt(float(curve.weights @ direction**2)) or 1.0


def _direction(curve: Locus, L: ExtendedLinearisation) -> tuple[Array, float] | None:
    """The null vector of the extended linearisation: a border of random direction, then the result itself."""
    n = L.u.size
    w = np.insert(curve.weights, n - 1 - curve.extras, 1.0)
    row = np.random.default_rng(0).standard_normal(n + 1) * np.sqrt(w)
    right = np.zeros((n + 1, 1))
    right[n] = 1.0
    for _ in range(3):
        t = L.solve_bordered(row, right)[:, 0]
        length = math.sqrt(float(w @ t**2)) if np.isfinite(t).all() else math.nan
        if not (math.isfinite(length) and length > 0):
            return None
        row = w * t / length
    return curve.split(t / length)
