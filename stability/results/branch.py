r"""A branch: a one-parameter family of solutions as read-only arrays along the curve, with its labelled special points.

Points are in the order of the curve; special points are points of it, so that a plot passes exactly through its folds.
Everything a user derives from a point (columns, solutions) is computed when asked for; what is stored is what the
driver found: unknowns u, the parameter, tangents, spectra, verdicts, residuals. A branch read from a file needs no
solver until it is asked for a solution between its points (`at`) or for more of itself (`extend`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, UnknownNameError, unknown_name
from ..protocols import Tangent
from ..words import Kind, Status, Verdict
from .revival import revive
from .solutions import frozen
from .special import SpecialPoint
from .storage import register, write, write_columns

__all__ = ["Branch", "Columns", "Segment"]

Array = NDArray[np.float64]
_PER_POINT = ("parameter", "rates", "arclength", "values", "value_errors", "residuals", "iterations", "marks")


class Segment(NamedTuple):
    """Points start .. stop - 1 of a branch, all of one verdict; neighbouring segments share their end point."""

    verdict: Verdict
    start: int
    stop: int


class Columns(Mapping[str, Array]):
    """Named columns of a branch, (points,) each; measures are computed when the first of them is asked for."""

    def __init__(self, branch: Branch, stored: Mapping[str, Array] | None = None) -> None:
        self._branch = branch
        own = {"arclength": branch.arclength, "residual": branch.residuals}
        self._own = {branch.name: branch.parameter, **own}
        self._stored = dict(stored) if stored is not None else None

    def _measures(self) -> dict[str, Array]:
        if self._stored is None:
            rows = [self._branch._measures_at(i) for i in range(len(self._branch))]
            names = dict.fromkeys(name for row in rows for name in row)
            self._stored = {n: frozen([row.get(n, math.nan) for row in rows]) for n in names if n != self._branch.name}
        return self._stored

    def __getitem__(self, name: str) -> Array:
        if name in self._own:
            return self._own[name]
        measures = self._measures()
        if name not in measures:
            raise unknown_name("column", name, list(self), "this branch")
        return measures[name]

    def __iter__(self) -> Iterator[str]:
        yield self._branch.name
        yield from self._measures()
        yield from ("arclength", "residual")

    def __len__(self) -> int:
        return len(self._own) + len(self._measures())

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    def __repr__(self) -> str:
        return f"Columns: {', '.join(self)}"


@register("branch")
@dataclass(frozen=True, eq=False, repr=False)
class Branch:
    """A family of solutions along one parameter; what `continuation` returns.

    Attributes
    ----------
    name : str, the continued parameter;  window : (from, to)
    parameter : (P,) its values;  rates : (P,) d(parameter)/ds;  arclength : (P,) in the scaled norm
    unknowns, tangents : tuples of (N,) arrays, the problem's u and its unit tangents
    meshes : tuple of problems (or their specs, after `load`);  mesh_of : (P,) which of them a point belongs to
    params : mapping of all parameter values at the first point
    values : (P, n) complex, multipliers (orbits) or eigenvalues (equilibria);  value_errors : (P,)
    half_values : (P, n) complex or None, of the half-period map where orbits were solved on half of their period (their
        squares are `values`)
    verdicts : tuple of Verdict, one per point
    residuals : (P,);  iterations : (P,);  marks : (P,) index into `special`, -1 for an ordinary point
    special : tuple of SpecialPoint
    status : Status of the end (``statuses`` of both ends);  method : mapping that says how it was computed
    """

    name: str
    window: tuple[float, float]
    parameter: Array
    rates: Array
    arclength: Array
    unknowns: tuple[Array, ...]
    tangents: tuple[Array, ...]
    meshes: tuple[Any, ...] = field(repr=False)
    mesh_of: NDArray[np.int64]
    params: Mapping[str, float]
    values: NDArray[np.complex128]
    value_errors: Array
    verdicts: tuple[Verdict, ...]
    residuals: Array
    iterations: NDArray[np.int64]
    marks: NDArray[np.int64]
    special: tuple[SpecialPoint, ...]
    statuses: tuple[Status, Status]
    method: Mapping[str, Any]
    half_values: NDArray[np.complex128] | None = None
    stored_columns: Mapping[str, Array] | None = field(default=None, repr=False)
    stored_errors: Array | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for key in ("parameter", "rates", "arclength", "value_errors", "residuals"):
            object.__setattr__(self, key, frozen(getattr(self, key)))
        for key in ("mesh_of", "iterations", "marks"):
            object.__setattr__(self, key, frozen(getattr(self, key), np.int64))
        object.__setattr__(self, "values", frozen(self.values, complex))
        if self.half_values is not None:
            object.__setattr__(self, "half_values", frozen(self.half_values, complex))
        object.__setattr__(self, "verdicts", tuple(Verdict(v) for v in self.verdicts))
        object.__setattr__(self, "statuses", tuple(Status(s) for s in self.statuses))
        object.__setattr__(self, "params", MappingProxyType(dict(self.params)))
        object.__setattr__(self, "method", MappingProxyType(dict(self.method)))

    # ------------------------------------------------------------------ reading
    def __len__(self) -> int:
        return self.parameter.size

    @property
    def status(self) -> Status:
        """Why the branch ended (its last end; ``statuses[0]`` tells about the first of a two-sided branch)."""
        return self.statuses[1]

    @property
    def messages(self) -> tuple[str, str]:
        """Why the branch stopped at either end, in words; empty where the status says it all."""
        first, last = self.method.get("notes", ("", ""))
        return str(first), str(last)

    @property
    def message(self) -> str:
        """Why the branch ended, in words: what the last refused step ran into, or what was raised."""
        return self.messages[1]

    @cached_property
    def columns(self) -> Columns:
        """Named columns, (P,) each: the parameter, the problem's measures, arclength, residual."""
        return Columns(self, self.stored_columns)

    @cached_property
    def error(self) -> Array:
        """(P,) estimated discretisation error of every point."""
        if self.stored_errors is not None:
            return frozen(self.stored_errors)
        return frozen([self._problem(i).error(self.unknowns[i], self._vector(i)) for i in range(len(self))])

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the special points, in the order of the branch."""
        return tuple(p.label for p in self.special)

    def __getitem__(self, label: str) -> SpecialPoint:
        for point in self.special:
            if point.label == label or (point.name and point.name == label):
                return point
        births = [p for p in self.special if p.kind in (Kind.BRANCH_POINT, Kind.PERIOD_DOUBLING)]
        here = {p.kind.label for p in self.special}
        if births and str(label).rstrip("0123456789") in {kind.label for kind in Kind} - here:
            born = f"continuation(switch(branch['{births[0].label}']), '{self.name}', {self.window})['{label}']"
            raise UnknownNameError(
                f"no special point '{label}'; this branch has {', '.join(self.labels)}; it may lie on a branch that is "
                f"born here: {born}"
            )
        raise unknown_name("special point", label, self.labels, "this branch")

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.labels)

    def of_kind(self, kind: Kind) -> tuple[SpecialPoint, ...]:
        """All special points of one kind."""
        return tuple(p for p in self.special if p.kind is Kind(kind))

    def count(self, verdict: Verdict) -> int:
        """How many points have this verdict."""
        return sum(v is Verdict(verdict) for v in self.verdicts)

    def segments(self) -> tuple[Segment, ...]:
        """Stretches of constant verdict; a special point belongs to the stretches on both of its sides."""
        found: list[Segment] = []
        for i in range(len(self) - 1):
            inner = [k for k in (i, i + 1) if self.marks[k] < 0] or [i + 1]
            verdict = self.verdicts[inner[-1]]
            if found and found[-1].verdict is verdict:
                found[-1] = Segment(verdict, found[-1].start, i + 2)
            else:
                found.append(Segment(verdict, i, i + 2))
        if not found and len(self):
            found.append(Segment(self.verdicts[0], 0, 1))
        return tuple(found)

    def solution(self, index: int) -> Any:
        """The solution at a point, as FixedPoint or PeriodicOrbit."""
        i = range(len(self))[index]
        return self._problem(i).view(self.unknowns[i], self._vector(i))

    def at(self, **value: float) -> tuple[Any, ...]:
        """All solutions at a value of the continued parameter, in the order of the branch: solved, not interpolated.

        Raises
        ------
        UnknownNameError
            The name is not the continued parameter.
        ConvergenceError
            A solution that must exist between two points did not converge.
        """
        return tuple(problem.view(u, params) for problem, u, params in self._points_at(value))

    def rows_at(self, **value: float) -> tuple[dict[str, Any], ...]:
        """The named columns, and the verdict, of all solutions at a value of the continued parameter (see `at`)."""
        rows = []
        for problem, u, params in self._points_at(value):
            spectrum = problem.spectrum(problem.linearise(u, params))
            rows.append({**problem.measures(u, params), "verdict": spectrum.verdict})
        return tuple(rows)

    def _points_at(self, value: Mapping[str, float]) -> list[tuple[Any, Array, Array]]:
        """(problem, u, params) of every solution at the value, in the order of the branch."""
        if len(value) != 1 or self.name not in value:
            wrong = next((k for k in value if k != self.name), "nothing")
            raise unknown_name("continued parameter", wrong, [self.name], "this branch")
        target = float(value[self.name])
        found: list[tuple[float, tuple[Any, Array, Array]]] = []
        exact = np.nonzero(self.parameter == target)[0].tolist()
        if self.statuses == (Status.CLOSED_LOOP,) * 2 and {0, len(self) - 1} <= set(exact):
            exact.remove(len(self) - 1)  # the last point of a closed curve is its first
        for k in exact:
            found.append((float(k), (self._problem(k), self.unknowns[k], self._vector(k))))
        gap = self.parameter - target
        for i in np.nonzero(gap[:-1] * gap[1:] < 0)[0]:
            found.append((i + 0.5, self._between(int(i), target)))
        return [point for _, point in sorted(found, key=lambda pair: pair[0])]

    def _between(self, i: int, target: float) -> tuple[Any, Array, Array]:
        problem, params = self._problem(i), self._vector(i)
        index, h = list(problem.parameters).index(self.name), float(self.arclength[i + 1] - self.arclength[i])
        on_both = self.mesh_of[i] == self.mesh_of[i + 1]
        x = self._where(i, h, target)
        cubic = np.array([x * x * (3 - 2 * x), h * x * (1 - x) ** 2, h * x * x * (x - 1)])
        guess = self.unknowns[i] + h * x * self.tangents[i]
        if on_both:
            ends = self.unknowns[i + 1] - self.unknowns[i], self.tangents[i], self.tangents[i + 1]
            guess = self.unknowns[i] + sum(c * v for c, v in zip(cubic, ends))
        tolerance = float(self.method["tolerance"])
        # Newton at a fixed value may leave for another part of the curve: the result has to lie near the cubic
        params[index] = target
        for start in (guess, self.unknowns[i]):
            found = problem.correct(start, params, self.name, None, 0.0, tolerance)
            far = np.sqrt((problem.weights * (found.u - guess) ** 2).sum()) if found.converged else np.inf
            if far <= 0.5 * h:
                return problem, found.u, found.params
        weight = 1.0 / float(self.method["scale"])
        tangent = Tangent(self.tangents[i], float(self.rates[i]), weight)
        held = problem.correct(guess, params, self.name, tangent, 0.0, tolerance)
        if held.converged:
            found = problem.correct(held.u, params, self.name, None, 0.0, tolerance)
            if found.converged:
                return problem, found.u, found.params
        raise ConvergenceError(
            f"no solution converged at {self.name} = {target:.10g} between {self.parameter[i]:.10g} and "
            f"{self.parameter[i + 1]:.10g}; ask for it during the continuation with at=({target:.10g},)",
            last=self.solution(i),
        )

    def _where(self, i: int, h: float, target: float) -> float:
        """x in (0, 1) at which the cubic through values and rates of both ends has the parameter value."""
        p, q, r, s = self.parameter[i], self.parameter[i + 1], h * self.rates[i], h * self.rates[i + 1]
        cubic = np.roots([2 * (p - q) + r + s, 3 * (q - p) - 2 * r - s, r, p - target])
        inside = [float(x.real) for x in cubic if abs(x.imag) < 1e-9 and 0 < x.real < 1]
        return inside[0] if len(inside) == 1 else float((target - p) / (q - p))

    def _problem(self, i: int) -> Any:
        return self._problems[self.mesh_of[i]]

    @cached_property
    def _problems(self) -> tuple[Any, ...]:
        return tuple(revive(m) if isinstance(m, Mapping) else m for m in self.meshes)

    def _vector(self, i: int) -> Array:
        params = np.array(list(self.params.values()))
        params[list(self.params).index(self.name)] = self.parameter[i]
        return params

    def _measures_at(self, i: int) -> dict[str, float]:
        return self._problem(i).measures(self.unknowns[i], self._vector(i))  # type: ignore[no-any-return]

    # ------------------------------------------------------------------ more of it
    def extend(self, max_points: int = 2000, window: tuple[float, float] | None = None, progress: Any = None) -> Branch:
        """Continue where the branch stopped: a branch that also holds the new points.

        Parameters
        ----------
        max_points : int
            How many more points.
        window : (from, to) or None
            A new parameter interval; None keeps the old one.
        """
        return import_module("stability.following.driver").extend(  # type: ignore[no-any-return]
            self, max_points=max_points, window=window, progress=progress
        )

    def plot(self, ax: Any = None, y: str | None = None, **style: Any) -> Any:
        """Draw column `y`: solid stable, dashed unstable, dotted undetermined, special points marked.

        Without `y` the first measure is drawn. Returns the artists.
        """
        from ..plots.branches import plot_branch

        return plot_branch(self, ax=ax, y=y, **style)

    # ------------------------------------------------------------------ to other forms
    def to_dict(self) -> dict[str, NDArray[Any]]:
        """Columns, verdict and label as arrays of equal length: ``pandas.DataFrame(branch.to_dict())``."""
        table: dict[str, NDArray[Any]] = {name: np.array(self.columns[name]) for name in self.columns}
        table["verdict"] = np.array([str(v) for v in self.verdicts])
        table["label"] = np.array(["" if m < 0 else self.special[m].label for m in self.marks.tolist()])
        return table

    def to_csv(self, path: Any) -> None:
        """Write `to_dict` as comma-separated text with a header line."""
        write_columns(path, self.to_dict())

    def __repr__(self) -> str:
        first, last = (f"{v:g}" for v in self.window)
        values, zero = [p.params[self.name] for p in self.special[:8]], 1e-13 * abs(self.window[1] - self.window[0])
        marks = "  ".join(f"{p.label} {0 if abs(v) < zero else v:.4g}" for p, v in zip(self.special, values))
        more = f"  ... {len(self.special) - 8} more" if len(self.special) > 8 else ""
        parts = [f"Branch {self.name} {first} -> {last}", f"{len(self)} points"]
        if marks:
            parts.append(marks + more)
        for verdict in (Verdict.UNSTABLE, Verdict.NEUTRAL, Verdict.UNDETERMINED):
            number = sum(v is verdict and m < 0 for v, m in zip(self.verdicts, self.marks.tolist()))
            if number or verdict is Verdict.UNSTABLE:
                parts.append(f"{number} {verdict}")
        return " | ".join([*parts, self.status.name])

    # ------------------------------------------------------------------ storage
    def save(self, path: Any) -> None:
        """Write to a ``.npz`` file that `stability.load` reads; measures and errors are computed and stored too."""
        header, arrays = self.to_storage()
        write(path, "branch", header, arrays)

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        points = [p.to_storage() for p in self.special]
        names = [n for n in self.columns if n not in (self.name, "arclength", "residual")]
        header = {
            "name": self.name,
            "window": list(self.window),
            "params": dict(self.params),
            "verdicts": [str(v) for v in self.verdicts],
            "statuses": [str(s) for s in self.statuses],
            "method": dict(self.method),
            "meshes": [dict(m if isinstance(m, Mapping) else m.spec) for m in self.meshes],
            "special": [p[0] for p in points],
            "columns": names,
        }
        sizes = [u.size for u in self.unknowns]
        arrays = {key: getattr(self, key) for key in (*_PER_POINT, "mesh_of")}
        arrays |= {"sizes": np.array(sizes), "unknowns": np.concatenate(self.unknowns)}
        arrays |= {"tangents": np.concatenate(self.tangents), "error": self.error}
        arrays |= {} if self.half_values is None else {"half_values": self.half_values}
        arrays |= {f"column.{k}": self.columns[n] for k, n in enumerate(names)}
        arrays |= {f"special.{k}.{n}": a for k, p in enumerate(points) for n, a in p[1].items()}
        return header, arrays

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Branch:
        """The inverse of `to_storage`."""
        ends = np.cumsum(arrays["sizes"])[:-1]
        special = []
        for k, inner in enumerate(header["special"]):
            prefix = f"special.{k}."
            own = {n.removeprefix(prefix): a for n, a in arrays.items() if n.startswith(prefix)}
            special.append(SpecialPoint.from_storage(inner, own))
        first, last = header["window"]
        return cls(
            name=header["name"],
            window=(first, last),
            unknowns=tuple(frozen(a) for a in np.split(arrays["unknowns"], ends)),
            tangents=tuple(frozen(a) for a in np.split(arrays["tangents"], ends)),
            meshes=tuple(header["meshes"]),
            mesh_of=arrays["mesh_of"],
            params=header["params"],
            verdicts=header["verdicts"],
            special=tuple(special),
            statuses=header["statuses"],
            method=header["method"],
            stored_columns={n: frozen(arrays[f"column.{k}"]) for k, n in enumerate(header["columns"])},
            stored_errors=arrays["error"],
            half_values=arrays.get("half_values"),
            **{key: arrays[key] for key in _PER_POINT},
        )

    def __iter__(self) -> Iterator[Any]:
        raise InputError("a branch is not a sequence: use .columns, .special, .solution(i) or .at(...)")
