"""`compare`: errors of several methods against a reference along the parameter.

At each value of the parameter all solutions of both methods are found by solving (not by interpolation), matched by
verdict (`matching`), and compared in one quantity; folds are matched in order. A sweep is compared with the stable
solution of the reference that is nearest to it, at its own settled points. The slow flow of `averaging` carries its
amplitude as the output ``<coordinate>_amplitude``, which stands for ``<coordinate>.amplitude(1)``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..results.branch import Branch
from ..results.comparison import Comparison, Difference
from ..results.sweep import Sweep
from ..words import Kind, Verdict
from .matching import matched

__all__ = ["compare"]

Array = NDArray[np.float64]


def compare(reference: Branch, *others: Any, quantity: str | None = None, points: int = 81) -> Comparison:
    """Lay other results over a reference and say, in numbers, where they differ and what they miss.

    Parameters
    ----------
    reference : Branch
        The answer that the others are measured against.
    *others : Branch or Sweep
        Branches of any method (collocation, harmonic balance, the slow flow of averaging, ...) or sweeps, along the
        same parameter.
    quantity : str, optional
        Compared column, ``"<coordinate>.amplitude(1)"`` or ``"<state>.max"``; by default the fundamental amplitude of
        the reference's first coordinate.
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
    if not isinstance(reference, Branch):
        raise InputError(f"the reference must be a Branch; got {type(reference).__name__}")
    if not others:
        raise InputError("give at least one result to compare with the reference")
    if not isinstance(points, int) or points < 2:
        raise InputError(f"points must be a whole number >= 2; got {points!r}")
    for other in others:
        if not isinstance(other, (Branch, Sweep)):
            raise InputError(f"cannot compare a {type(other).__name__}; give branches and sweeps")
    column = quantity or _default_quantity(reference)
    base = _column(reference, column)
    names = _names([reference, *others])
    differences = {}
    for name, other in zip(names[1:], others):
        if other.name != reference.name:
            raise InputError(f"'{name}' runs along {other.name}, the reference along {reference.name}")
        if isinstance(other, Sweep):
            differences[name] = _sweep_difference(name, reference, base, other, column)
        else:
            differences[name] = _branch_difference(name, reference, base, other, _column(other, column), points)
    return Comparison(names[0], column, reference.name, differences, (reference, *others), tuple(names))


def _default_quantity(reference: Branch) -> str:
    for name in reference.columns:
        if name.endswith(".amplitude(1)"):
            return name
    for name in reference.columns:
        if name.endswith(("_amplitude", ".max")):
            return name
    raise InputError("the reference has no amplitude column: give quantity=...")


def _column(branch: Branch, quantity: str) -> str:
    """The branch's own name of the quantity."""
    if quantity in branch.columns:
        return quantity
    stem = quantity.removesuffix(".amplitude(1)").removesuffix("_amplitude")
    for alias in (f"{stem}_amplitude", f"{stem}.amplitude(1)"):
        if alias in branch.columns:
            return alias
    raise unknown_name("column", quantity, branch.columns, "a compared branch")


def _method(result: Any) -> str:
    if isinstance(result, Sweep):
        lo, hi = result.window
        return f"sweep {'up' if hi > lo else 'down'}"
    spec = result.meshes[0] if isinstance(result.meshes[0], dict) else result.meshes[0].spec
    problem = str(result.method.get("problem", "branch"))
    if problem == "HarmonicBalance":
        return f"harmonic balance {spec.get('harmonics', '')}".strip()
    if problem == "Equilibrium":
        system = getattr(result.meshes[0], "system", None)
        described = system.name if system is not None else "equilibria"
        for word in ("averaging", "multiple scales"):
            if word in described:
                return word
        return "equilibria"
    return problem.lower()


def _names(results: list[Any]) -> list[str]:
    """A name for each result; equal ones get a number."""
    plain = [_method(r) for r in results]
    names: list[str] = []
    for k, name in enumerate(plain):
        count = plain[:k].count(name)
        names.append(name if count == 0 else f"{name} ({count + 1})")
    return names


def _rows(branch: Branch, value: float, column: str) -> list[tuple[Verdict, float]]:
    return [(row["verdict"], float(row[column])) for row in branch.rows_at(**{branch.name: value})]


def _branch_difference(name: str, reference: Branch, base: str, other: Branch, column: str, points: int) -> Difference:
    low = max(reference.parameter.min(), other.parameter.min())
    high = min(reference.parameter.max(), other.parameter.max())
    if not low < high:
        raise InputError(f"'{name}' and the reference have no value of {reference.name} in common")
    matches: list[tuple[float, float, float, Verdict]] = []
    missing: list[tuple[float, Verdict, float]] = []
    extra: list[tuple[float, Verdict, float]] = []
    for value in np.linspace(low, high, points):
        here, there = _rows(reference, value, base), _rows(other, value, column)
        pairs, alone, more = matched(here, there)
        matches += [(float(value), here[i][1], there[j][1], here[i][0]) for i, j in pairs]
        missing += [(float(value), here[i][0], here[i][1]) for i in alone]
        extra += [(float(value), there[j][0], there[j][1]) for j in more]
    return _difference(name, matches, missing, extra, _folds(reference, other))


def _sweep_difference(name: str, reference: Branch, base: str, sweep: Sweep, quantity: str) -> Difference:
    stem, _, measure = quantity.rpartition(".")
    sources = {"amplitude(1)": sweep.amplitude(1), "max": sweep.maximum, "min": sweep.minimum}
    if measure not in sources:
        raise InputError(f"a sweep has no {quantity}: compare <state>.amplitude(1), <state>.max or <state>.min")
    values = sources[measure][stem]
    matches: list[tuple[float, float, float, Verdict]] = []
    missing: list[tuple[float, Verdict, float]] = []
    extra: list[tuple[float, Verdict, float]] = []
    for value, seen, settled in zip(sweep.parameter, values, sweep.settled):
        if not settled or not reference.parameter.min() <= value <= reference.parameter.max():
            continue
        here = [row for row in _rows(reference, float(value), base) if row[0] is not Verdict.UNSTABLE]
        if here:
            verdict, nearest = min(here, key=lambda row: abs(row[1] - seen))
            matches.append((float(value), nearest, float(seen), verdict))
        else:
            extra.append((float(value), Verdict.STABLE, float(seen)))
    return _difference(name, matches, missing, extra, ())


def _difference(name: str, matches: list[Any], missing: list[Any], extra: list[Any], folds: Any) -> Difference:
    columns = list(zip(*matches)) if matches else [(), (), (), ()]
    return Difference(
        name, np.array(columns[0], float), np.array(columns[1], float), np.array(columns[2], float),
        tuple(columns[3]), tuple(missing), tuple(extra), tuple(folds),
    )  # fmt: skip


def _folds(reference: Branch, other: Branch) -> list[tuple[float, float]]:
    """The reference's folds with the nearest of the other's, each used once."""
    here = sorted(p.params[reference.name] for p in reference.of_kind(Kind.FOLD))
    there = [p.params[other.name] for p in other.of_kind(Kind.FOLD)]
    pairs, left, _ = matched([(Verdict.STABLE, x) for x in here], [(Verdict.STABLE, x) for x in there])
    return [(here[i], there[j]) for i, j in pairs] + [(here[i], float("nan")) for i in left]
