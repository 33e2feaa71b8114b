r"""`loci`: all curves of special points over two parameters that cuts through the plane meet.

A boundary in two parameters has sheets: tongues of period doubling (-1) and of multiplier +1, folds, torus curves, one
beside another with gaps between them. At a few values of the second parameter the problem is followed along the first
one; every special point that lies on no curve found so far starts a new one. Between the cuts a closed curve may be
missed, hence the cuts are the caller's to choose.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError, unknown_name
from ..problems.locus import CURVES
from ..problems.locus_starting import locus
from ..protocols import Problem
from ..results.branch import Branch
from ..results.special import SpecialPoint
from ..words import Kind
from .driver import continuation
from .settings import checked_problem

__all__ = ["loci"]

_SAME = 1e-6  # relative distance in the second parameter below which a point lies on a curve


def loci(
    problem: Problem,
    name: str,
    window: tuple[float, float],
    *,
    free: str,
    free_window: tuple[float, float],
    cuts: int | Sequence[float] = 5,
    kinds: Iterable[Kind | str] | None = None,
    **options: Any,
) -> tuple[Branch, ...]:
    """All sheets of the curves of special points of F(u, lambda_1, lambda_2) = 0 in a rectangle, named by kind.

    Parameters
    ----------
    problem : Problem
        `Equilibrium`, `Collocation`, `HarmonicBalance`, ... of a system.
    name : str
        The first parameter lambda_1, along which the problem and the curves are followed.
    window : (from, to)
        Of lambda_1.
    free : str
        The second parameter lambda_2.
    free_window : (low, high)
        Of lambda_2; every curve ends there.
    cuts : int or sequence of float
        The values of lambda_2 at which special points are looked for, or how many: evenly spread, by their logarithms
        where the window spans more than a decade.
    kinds : iterable of Kind or str, optional
        The kinds wanted (``"period doubling"``); by default all that have curves.
    **options
        Passed on to `continuation`, for the cuts and for the curves.

    Returns
    -------
    tuple of Branch
        By kind, in the order found. ``curve.meshes[0].kind`` is the kind of a curve, its title and legend in plots.

    Raises
    ------
    InputError, UnknownNameError
        Arguments that make no sense, before any work starts.
    ConvergenceError
        No cut has a solution.

    Notes
    -----
    Branch points that lambda_2 breaks up have no curve; the folds beside them have. A search by cuts: what is found is
    there; a closed curve between two cuts is not seen.

    Examples
    --------
    >>> import sympy as sp, stability as st
    >>> x, r, s = sp.symbols("x r s", real=True)  # folds of two kinds of parabolas: r = s^2, r = s + 2
    >>> f = (r - s**2 - x**2) * (r - s - 2 - (x - 5)**2)
    >>> system = st.System(name="two", coordinates=("x",), states=("x",), parameters={"r": 0.0, "s": 0.0}, rhs=(f,))
    >>> options = dict(free="s", free_window=(-1, 1), cuts=(0.5,), start=dict(x=2))
    >>> curves = st.loci(st.Equilibrium(system), "r", (4, -1), **options)
    >>> [str(c.meshes[0].kind) for c in curves]
    ['fold']
    """
    checked_problem(problem)
    wanted = CURVES if kinds is None else tuple(_kind(kind) for kind in ((kinds,) if isinstance(kinds, str) else kinds))
    for kind in wanted:
        if kind not in CURVES:
            raise InputError(f"there are no curves of '{kind}' points; curves exist for {', '.join(map(str, CURVES))}")
    names = list(problem.parameters)
    for given in (name, free):
        if given not in names:
            raise unknown_name("parameter", given, names, "this problem")
    if name == free:
        raise InputError(f"'{free}' is the first parameter itself: name another one")
    if problem.seed() is not None:
        raise InputError("a problem born at a special point cannot be cut: give the problem of the orbits themselves")
    values = _values(free, free_window, cuts)
    curves: list[Branch] = []
    trouble: ConvergenceError | None = None
    done = 0
    for value in values:
        there = dataclasses.replace(problem, system=problem.system.with_params(**{free: value}))  # type: ignore[type-var,attr-defined]
        try:
            branch = continuation(there, name, window, **options)
        except ConvergenceError as error:
            trouble = error
            continue
        done += 1
        for point in branch.special:
            if point.kind not in wanted or any(_lies_on(curve, point, free) for curve in curves):
                continue
            curve = _curve(point, name, window, free, free_window, options)
            curves += [] if curve is None else [curve]
    if trouble is not None and not done:
        raise trouble
    return tuple(sorted(curves, key=lambda curve: CURVES.index(curve.meshes[0].kind)))


def _kind(given: Kind | str) -> Kind:
    try:
        return Kind(given)
    except ValueError:
        raise unknown_name("kind of curve", given, map(str, CURVES), "loci") from None


def _values(free: str, window: tuple[float, float], cuts: int | Sequence[float]) -> list[float]:
    try:
        low, high = sorted(float(v) for v in window)
    except (TypeError, ValueError):
        raise InputError(f"the window of '{free}' must be two numbers (low, high), got {window!r}") from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError(f"the window of '{free}' must be two different finite numbers, got ({low:g}, {high:g})")
    if isinstance(cuts, int):
        if cuts < 1:
            raise InputError(f"cuts must be a number >= 1 or the values themselves, got {cuts}")
        inner = (np.arange(cuts) + 0.5) / cuts
        spread = low > 0 and high > 10 * low
        return (low * (high / low) ** inner if spread else low + (high - low) * inner).tolist()  # type: ignore[no-any-return]
    values = [float(v) for v in cuts]
    outside = [v for v in values if not low <= v <= high]
    if outside or not values:
        raise InputError(f"cuts must lie inside the window ({low:g}, {high:g}) of '{free}', got {values}")
    return values


def _lies_on(curve: Branch, point: SpecialPoint, free: str) -> bool:
    """Whether the curve passes the point, with the same critical solution."""
    if curve.meshes[0].kind is not point.kind:
        return False
    along, second = curve.columns[curve.name], point.params[free]
    here = point.params[curve.name]
    if not along.min() <= here <= along.max():
        return False
    size = max(abs(second), 1e-9)
    return any(abs(o.params[free] - second) <= _SAME * size for o in curve.at(**{curve.name: here}))


def _curve(
    point: SpecialPoint, name: str, window: tuple[float, float], free: str, free_window: tuple[float, float],
    options: dict[str, Any],
) -> Branch | None:  # fmt: skip
    kept = {key: value for key, value in options.items() if key not in ("start", "at", "events", "stop_at")}
    try:
        return continuation(locus(point, free=free, window=free_window), name, window, **kept)
    except (ConvergenceError, InputError):
        return None  # a crossing that `free` breaks up, or a point of higher codimension
