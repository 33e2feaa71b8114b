"""`compare`: errors of several methods against a reference along the parameter.

At each value of the parameter all solutions of both methods are found by solving (not by interpolation), matched by
verdict (`matching`), and compared in one quantity (`curves`); folds are matched in order. A sweep is compared with the
stable solution of the reference that is nearest to it, at its own settled points; a measured response likewise, and
where it is the reference the others are read at its points.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..results.branch import Branch
from ..results.comparison import Comparison, Difference, swept
from ..results.measured import MeasuredResponse
from ..results.sweep import Sweep
from ..words import Verdict
from .curves import Curves, default_quantity, described, unique
from .matching import matched

__all__ = ["compare", "difference"]

Array = NDArray[np.float64]
_BESIDE = 1e-3  # of the grid's step: how far from a fold solutions are compared


def compare(
    reference: Branch | Sequence[Branch] | MeasuredResponse, *others: Any, quantity: str | None = None, points: int = 81
) -> Comparison:
    """Lay other results over a reference and say, in numbers, where they differ and what they miss.

    Parameters
    ----------
    reference : Branch, sequence of Branch, or MeasuredResponse
        The answer that the others are measured against.
    *others : Branch, sequence of Branch, Sweep, or MeasuredResponse
        Branches of any method (collocation, harmonic balance, the slow flow of averaging, ...) or sweeps, along the
        same parameter. Several branches of one method (what `families` returns) count together.
    quantity : str, optional
        Compared column, ``"<coordinate>.amplitude(1)"`` or ``"<state>.max"``; by default the fundamental amplitude of
        the reference's first coordinate. Extrema of a slow flow are those of the reconstructed motion.
    points : int
        How many values of the parameter branches are compared at; one on a fold is moved off it by 1e-3 of the step.

    Returns
    -------
    Comparison
        ``.table()``, ``.plot()``, ``[name]`` -> Difference with ``.errors``, ``.missing``, ``.folds``.

    Raises
    ------
    InputError
        Different parameters, nothing to compare with, or windows that do not overlap.
    UnknownNameError
        A result has no such column.

    *Accuracy*: both sides are solved to their own tolerance at each value; the differences are those of the methods.

    Examples
    --------
    >>> import stability as st
    >>> duffing = st.models.duffing()
    >>> full = st.continuation(st.Collocation(duffing), "Omega", (0.5, 0.9))
    >>> slow = st.continuation(st.Equilibrium(st.averaging(duffing)), "Omega", (0.5, 0.9))
    >>> st.compare(full, slow, points=5)["averaging"].worst < 0.01
    True
    """
    first = _several(reference)
    measured = reference if isinstance(reference, MeasuredResponse) else None
    if first is None and measured is None:
        raise InputError(f"the reference must be a Branch or several; got {type(reference).__name__}")
    if not others:
        raise InputError("give at least one result to compare with the reference")
    if not isinstance(points, int) or points < 2:
        raise InputError(f"points must be a whole number >= 2; got {points!r}")
    for other in others:
        if _several(other) is None and not isinstance(other, (Sweep, MeasuredResponse)):
            raise InputError(f"cannot compare a {type(other).__name__}; give branches, sweeps, measured responses")
    names = unique([described(r) for r in (reference, *others)])
    if measured is not None:
        return against_measured(measured, others, names, quantity)
    assert first is not None
    base = Curves(names[0], first, quantity or default_quantity(first[0]))
    found = {name: difference(base, name, other, points) for name, other in zip(names[1:], others)}
    return Comparison(
        names[0], base.quantity, base.parameter, found, tuple(drawn(base.quantity, r) for r in (reference, *others)),
        tuple(names),
    )  # fmt: skip


def difference(base: Curves, name: str, other: Any, points: int) -> Difference:
    """One method, its branches or its sweep, against the reference."""
    branches = _several(other)
    own = other.name if branches is None else branches[0].name
    if own != base.parameter:
        raise InputError(f"'{name}' runs along {own}, the reference along {base.parameter}")
    if isinstance(other, MeasuredResponse):
        return _points_difference(name, base, other.parameter, other.values(base.quantity))
    if branches is None:
        kept = other.settled
        return _points_difference(name, base, other.parameter[kept], swept(other, base.quantity)[kept])
    return _branch_difference(name, base, Curves(name, branches, base.quantity), points)


def drawn(quantity: str, result: Any) -> Any:
    """The result with the quantity among its columns, for the plot."""
    branches = _several(result)
    return result if branches is None else Curves("", branches, quantity).drawable()


def _several(result: Any) -> tuple[Branch, ...] | None:
    """The branches of a method; None for what is no branch."""
    if isinstance(result, Branch):
        return (result,)
    if isinstance(result, Sequence) and result and all(isinstance(b, Branch) for b in result):
        return tuple(result)
    return None


def _branch_difference(name: str, base: Curves, other: Curves, points: int) -> Difference:
    (a, b), (c, d) = base.bounds, other.bounds
    low, high = max(a, c), min(b, d)
    if not low < high:
        raise InputError(f"'{name}' and the reference have no value of {base.parameter} in common")
    matches: list[tuple[float, float, float, Verdict]] = []
    missing: list[tuple[float, Verdict, float]] = []
    extra: list[tuple[float, Verdict, float]] = []
    for value in _values(low, high, points, [*base.folds, *other.folds]):
        here, there = base.rows(value), other.rows(value)
        pairs, alone, more = matched(here, there)
        matches += [(value, here[i][1], there[j][1], here[i][0]) for i, j in pairs]
        missing += [(value, here[i][0], here[i][1]) for i in alone]
        extra += [(value, there[j][0], there[j][1]) for j in more]
    return _difference(name, matches, missing, extra, _folds(base.folds, other.folds))


def _values(low: float, high: float, points: int, folds: list[float]) -> list[float]:
    """Where branches are compared: an even grid, off the folds.

    At a fold two solutions are one, without a verdict, and rounding decides which method has none, one or two.
    """
    clear = _BESIDE * (high - low) / (points - 1)
    grid = np.linspace(low, high, points)
    for fold in folds:
        inwards = 1.0 if fold < 0.5 * (low + high) else -1.0
        grid[np.abs(grid - fold) < clear] = fold + inwards * clear
    return [float(value) for value in grid if low <= value <= high]


def _points_difference(name: str, base: Curves, at: Array, values: Array) -> Difference:
    """What was seen at single values of the parameter: each against the nearest solution that is not unstable."""
    low, high = base.bounds
    matches: list[tuple[float, float, float, Verdict]] = []
    extra: list[tuple[float, Verdict, float]] = []
    for value, seen in zip(at.tolist(), values.tolist()):
        if not low <= value <= high:
            continue
        here = [row for row in base.rows(value) if row[0] is not Verdict.UNSTABLE]
        if here:
            verdict, nearest = min(here, key=lambda row: abs(row[1] - seen))
            matches.append((value, nearest, seen, verdict))
        else:
            extra.append((value, Verdict.STABLE, seen))
    return _difference(name, matches, [], extra, ())


def against_measured(
    measured: MeasuredResponse, others: Sequence[Any], names: Sequence[str], quantity: str | None
) -> Comparison:
    """Branches and sweeps against what was measured, at its points; a point that they do not have is missing."""
    found: dict[str, Difference] = {}
    if quantity is None:
        branches = next((b for b in map(_several, others) if b is not None), None)
        if branches is None:
            raise InputError("which quantity? Give quantity='<state>.amplitude(1)' or '<state>.max'")
        quantity = measured.quantity(tuple(branches[0].columns))
    at, seen = measured.parameter, measured.values(quantity)
    for name, other in zip(names[1:], others):
        several = _several(other)
        own = other.name if several is None else several[0].name
        if own != measured.name:
            raise InputError(f"'{name}' runs along {own}, the measured response along {measured.name}: rename it by "
                             "load_response(file, names={...})")  # fmt: skip
        if several is None:
            turned = _interpolated(name, other, quantity, at, seen)
        else:
            turned = _points_difference(name, Curves(name, several, quantity), at, seen)
        # the roles are the other way round: a point for which the method has no solution is missing
        here, there = turned.value, turned.reference
        found[name] = Difference(name, turned.parameter, here, there, turned.verdicts, turned.extra, ())
    curves = (measured, *(drawn(quantity, other) for other in others))
    return Comparison(names[0], quantity, measured.name, found, curves, tuple(names))


def _interpolated(name: str, other: Sweep | MeasuredResponse, quantity: str, at: Array, seen: Array) -> Difference:
    """Measured points inside the other's range against its values there, interpolated between its settled points."""
    kept = other.settled if isinstance(other, Sweep) else np.ones(len(other), bool)
    values = swept(other, quantity) if isinstance(other, Sweep) else other.values(quantity)
    order = np.argsort(other.parameter[kept], kind="stable")
    places, values = other.parameter[kept][order], values[kept][order]
    inside = (at >= places.min(initial=np.inf)) & (at <= places.max(initial=-np.inf))
    there = np.interp(at[inside], places, values) if inside.any() else np.zeros(0)
    return Difference(name, at[inside], there, seen[inside], (Verdict.STABLE,) * int(inside.sum()), (), ())


def _difference(name: str, matches: list[Any], missing: list[Any], extra: list[Any], folds: Any) -> Difference:
    columns = list(zip(*matches)) if matches else [(), (), (), ()]
    return Difference(
        name, np.array(columns[0], float), np.array(columns[1], float), np.array(columns[2], float),
        tuple(columns[3]), tuple(missing), tuple(extra), tuple(folds),
    )  # fmt: skip


def _folds(here: list[float], there: list[float]) -> list[tuple[float, float]]:
    """The reference's folds with the nearest of the other's, each used once."""
    pairs, left, _ = matched([(Verdict.STABLE, x) for x in here], [(Verdict.STABLE, x) for x in there])
    return [(here[i], there[j]) for i, j in pairs] + [(here[i], float("nan")) for i in left]
