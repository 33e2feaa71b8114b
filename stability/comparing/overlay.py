"""`compare`: errors of several methods against a reference along the parameter.

At each value of the parameter all solutions of both methods are found by solving (not by interpolation), matched by
verdict (`matching`), and compared in one quantity (`curves`); folds are matched in order. A sweep is compared with the
stable solution of the reference that is nearest to it, at its own settled points.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..results.branch import Branch
from ..results.comparison import Comparison, Difference, swept
from ..results.sweep import Sweep
from ..words import Verdict
from .curves import Curves, default_quantity, described, unique
from .matching import matched

__all__ = ["compare", "difference"]

Array = NDArray[np.float64]


def compare(
    reference: Branch | Sequence[Branch], *others: Any, quantity: str | None = None, points: int = 81
) -> Comparison:
    """Lay other results over a reference and say, in numbers, where they differ and what they miss.

    Parameters
    ----------
    reference : Branch or sequence of Branch
        The answer that the others are measured against.
    *others : Branch, sequence of Branch, or Sweep
        Branches of any method (collocation, harmonic balance, the slow flow of averaging, ...) or sweeps, along the
        same parameter. Several branches of one method (what `families` returns) count together.
    quantity : str, optional
        Compared column, ``"<coordinate>.amplitude(1)"`` or ``"<state>.max"``; by default the fundamental amplitude of
        the reference's first coordinate. Extrema of a slow flow are those of the reconstructed motion.
    points : int
        How many values of the parameter branches are compared at.

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
    if first is None:
        raise InputError(f"the reference must be a Branch or several; got {type(reference).__name__}")
    if not others:
        raise InputError("give at least one result to compare with the reference")
    if not isinstance(points, int) or points < 2:
        raise InputError(f"points must be a whole number >= 2; got {points!r}")
    for other in others:
        if _several(other) is None and not isinstance(other, Sweep):
            raise InputError(f"cannot compare a {type(other).__name__}; give branches and sweeps")
    names = unique([described(r) for r in (reference, *others)])
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
    if branches is None:
        return _sweep_difference(name, base, other)
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
    for value in np.linspace(low, high, points).tolist():
        here, there = base.rows(value), other.rows(value)
        pairs, alone, more = matched(here, there)
        matches += [(value, here[i][1], there[j][1], here[i][0]) for i, j in pairs]
        missing += [(value, here[i][0], here[i][1]) for i in alone]
        extra += [(value, there[j][0], there[j][1]) for j in more]
    return _difference(name, matches, missing, extra, _folds(base.folds, other.folds))


def _sweep_difference(name: str, base: Curves, sweep: Sweep) -> Difference:
    values, (low, high) = swept(sweep, base.quantity), base.bounds
    matches: list[tuple[float, float, float, Verdict]] = []
    extra: list[tuple[float, Verdict, float]] = []
    for value, seen, settled in zip(sweep.parameter.tolist(), values.tolist(), sweep.settled):
        if not settled or not low <= value <= high:
            continue
        here = [row for row in base.rows(value) if row[0] is not Verdict.UNSTABLE]
        if here:
            verdict, nearest = min(here, key=lambda row: abs(row[1] - seen))
            matches.append((value, nearest, seen, verdict))
        else:
            extra.append((value, Verdict.STABLE, seen))
    return _difference(name, matches, [], extra, ())


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
