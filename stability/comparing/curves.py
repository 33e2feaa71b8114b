"""What is compared of a method: the solutions that its branches have at a value of the parameter, in one quantity.

A method may need several branches (detached ones, those born at a branch point): they count together. The quantity is
a column, ``<coordinate>.amplitude(1)``, ``<state>.max``, ...; the slow flow of `averaging` carries its amplitude as
``<coordinate>_amplitude``, and its extrema are those of the motion that it stands for (`reconstruct`). States of a slow
flow that are the same motion at another time (of a p:q resonance there are p) count once.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analytic.reconstructing import steady_extrema
from ..errors import InputError, unknown_name
from ..results.branch import Branch
from ..results.comparison import distinct
from ..results.measured import MeasuredResponse
from ..results.sweep import Sweep
from ..words import Kind, Verdict

__all__ = ["Curves", "default_quantity", "described", "unique"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Curves:
    """The branches of one method, read in one quantity."""

    name: str
    branches: tuple[Branch, ...]
    quantity: str
    _known: dict[float, list[tuple[Verdict, float]]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        for branch in self.branches:
            _own_column(branch, self.quantity)

    @property
    def parameter(self) -> str:
        """The continued parameter."""
        return self.branches[0].name

    @property
    def bounds(self) -> tuple[float, float]:
        """The values of the parameter that the branches cover."""
        return (min(float(b.parameter.min()) for b in self.branches),
                max(float(b.parameter.max()) for b in self.branches))  # fmt: skip

    @property
    def folds(self) -> list[float]:
        """Parameter values of the folds, ascending; those of mirror images, at one place, once."""
        return distinct([p.params[b.name] for b in self.branches for p in b.of_kind(Kind.FOLD)])

    def rows(self, value: float) -> list[tuple[Verdict, float]]:
        """(verdict, quantity) of every solution at a value of the parameter: solved, not interpolated."""
        if value not in self._known:
            found = []
            for branch in self.branches:
                column = _own_column(branch, self.quantity)
                rows = _motions(branch.rows_at(**{branch.name: value}), _slow(branch) is not None)
                if column is not None:
                    found += [(row["verdict"], float(row[column])) for row in rows]
                elif rows:
                    states = np.array([[row[s] for s in _slow(branch).states] for row in rows]).T
                    values = _reconstructed(branch, states, np.full(len(rows), value), self.quantity)
                    found += [(row["verdict"], float(v)) for row, v in zip(rows, values)]
            self._known[value] = found
        return self._known[value]

    def drawable(self) -> tuple[Branch, ...]:
        """The branches with the quantity among their columns."""
        shown = []
        for branch in self.branches:
            column = _own_column(branch, self.quantity)
            if column == self.quantity:
                shown.append(branch)
                continue
            if column is not None:
                values = branch.columns[column]
            else:
                states = np.array([branch.columns[s] for s in _slow(branch).states])
                values = _reconstructed(branch, states, branch.parameter, self.quantity)
            own = (branch.name, "arclength", "residual")
            stored = {n: branch.columns[n] for n in branch.columns if n not in own} | {self.quantity: values}
            shown.append(dataclasses.replace(branch, stored_columns=stored))
        return tuple(shown)


def _motions(rows: Sequence[dict[str, Any]], slow: bool) -> list[dict[str, Any]]:
    """The rows of different motions: states of a slow flow with equal amplitudes are one, shifted in time."""
    if not slow:
        return list(rows)

    def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
        names = [name for name in one if name.endswith("_amplitude")]
        alike = all(math.isclose(one[name], other[name], rel_tol=1e-7) for name in names)
        return bool(names) and alike and one["verdict"] is other["verdict"]

    kept: list[dict[str, Any]] = []
    for row in rows:
        if not any(same(row, other) for other in kept):
            kept.append(row)
    return kept


def default_quantity(branch: Branch) -> str:
    """The fundamental amplitude of the first coordinate."""
    for name in branch.columns:
        if name.endswith(".amplitude(1)"):
            return name
    for name in branch.columns:
        if name.endswith(("_amplitude", ".max")):
            return name
    raise InputError("the reference has no amplitude column: give quantity=...")


def _slow(branch: Branch) -> Any:
    """The slow flow that a branch belongs to; None for any other branch."""
    if branch.method.get("problem") != "Equilibrium":
        return None
    system = branch._problem(0).system
    return system if system.reconstruction else None


def _own_column(branch: Branch, quantity: str) -> str | None:
    """The branch's own name of the quantity; None where it has to be read off the reconstructed motion."""
    slow = _slow(branch)
    columns = branch.columns if slow is None else (*slow.states, *slow.outputs)  # what it has of itself, unaided
    if quantity in columns:
        return quantity
    stem, _, measure = quantity.rpartition(".")
    if measure == "amplitude(1)" or quantity.endswith("_amplitude"):
        bare = stem or quantity.removesuffix("_amplitude")
        for alias in (f"{bare}_amplitude", f"{bare}.amplitude(1)"):
            if alias in columns:
                return alias
    if slow is not None and stem in slow.reconstruction and measure in ("max", "min"):
        return None
    raise unknown_name("column", quantity, columns, "a compared branch")


def _reconstructed(branch: Branch, states: Array, at: Array, quantity: str) -> Array:
    """(P,) extrema of the motions that slow states (n, P) stand for."""
    stem, _, measure = quantity.rpartition(".")
    slow = _slow(branch)
    params: dict[str, Any] = {k: v for k, v in branch.params.items() if k in slow.parameters}
    low, high = steady_extrema(slow, states, {**params, branch.name: at})
    place = list(slow.reconstruction).index(stem)
    return high[place] if measure == "max" else low[place]


def described(result: Any) -> str:
    """What a result was computed by, in words."""
    if isinstance(result, Sweep):
        lo, hi = result.window
        return f"sweep {'up' if hi > lo else 'down'}"
    if isinstance(result, MeasuredResponse):
        return "measured"
    branch = result if isinstance(result, Branch) else result[0]
    problem = str(branch.method.get("problem", "branch"))
    if problem == "HarmonicBalance":
        first = branch.meshes[0]
        spec = first if isinstance(first, Mapping) else first.spec
        return f"harmonic balance {spec.get('harmonics', '')}".strip()
    if problem == "Equilibrium":
        slow = _slow(branch)
        for word in ("averaging", "multiple scales") if slow is not None else ():
            if f", {word} " in slow.name:
                return f"{word}, order 2" if slow.name.endswith("order 2") else word
        return "equilibria"
    return problem.lower()


def unique(names: Sequence[str]) -> list[str]:
    """Names of which equal ones get a number."""
    return [name if names[:k].count(name) == 0 else f"{name} ({names[:k].count(name) + 1})"
            for k, name in enumerate(names)]  # fmt: skip
