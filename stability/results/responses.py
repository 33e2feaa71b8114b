"""What `responses` gives: the response of one oscillator by several methods, side by side, and what went wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import StabilityError, unknown_name
from ..words import Kind
from .branch import Branch
from .bundles import packed, unpacked
from .comparison import Comparison, distinct, swept
from .measured import MeasuredResponse
from .method_names import called
from .storage import register, write, write_columns
from .sweep import Sweep

__all__ = ["Responses"]

_HEAD = ("median", "largest", "missing", "more", "time")


@register("responses")
@dataclass(frozen=True, eq=False, repr=False)
class Responses(Mapping[str, Any]):
    """Responses by method; what `responses` returns. A mapping of method to its branches, its sweep, the measurement.

    Attributes
    ----------
    comparison : Comparison of the methods that came out; its reference is "" where only sweeps did
    failures : mapping of method to the error that ended it; the other methods are not touched by it
    seconds : mapping of method to its computing time
    """

    comparison: Comparison
    failures: Mapping[str, StabilityError]
    seconds: Mapping[str, float]

    def __post_init__(self) -> None:
        for key in ("failures", "seconds"):
            object.__setattr__(self, key, MappingProxyType(dict(getattr(self, key))))

    @property
    def parameter(self) -> str:
        """The continued parameter."""
        return self.comparison.parameter_name

    @property
    def quantity(self) -> str:
        """The compared column."""
        return self.comparison.quantity

    def __getitem__(self, method: str) -> Any:
        known = called(method, self.comparison.names)
        if known is not None:
            return self.comparison.curves[self.comparison.names.index(known)]
        failed = called(method, self.failures)
        if failed is not None:
            raise self.failures[failed]
        raise unknown_name("method", method, [*self, *self.failures], "this response")

    def __contains__(self, method: object) -> bool:
        return isinstance(method, str) and called(method, self.comparison.names) is not None

    def __iter__(self) -> Iterator[str]:
        return iter(self.comparison.names)

    def __len__(self) -> int:
        return len(self.comparison.names)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    # ------------------------------------------------------------------ numbers
    def rows(self) -> list[dict[str, Any]]:
        """One row a method: folds (jumps of a sweep) with errors, other special points, errors along the curve."""
        return [self._row(method) for method in self]

    def _row(self, method: str) -> dict[str, Any]:
        result, name = self[method], self.parameter
        row: dict[str, Any] = {"method": method, "seconds": self.seconds[method]}
        if not isinstance(result, tuple):
            row["points"] = len(result)
            row["jumps"] = [jump.parameter for jump in result.jumps] if isinstance(result, Sweep) else []
        else:
            points = [p for b in result for p in b.special]
            row["folds"] = distinct([p.params[name] for p in points if p.kind is Kind.FOLD])
            places: dict[Kind, list[float]] = {}
            for p in points:
                if p.kind not in (Kind.FOLD, Kind.USER):
                    places.setdefault(p.kind, []).append(p.params[name])
            row["others"] = [(str(kind), place) for kind, found in places.items() for place in distinct(found)]
            row["points"] = sum(len(b) for b in result)
            row["status"] = [str(b.status) for b in result]
        own = self.comparison.differences.get(method)
        if own is not None:
            size = np.abs(own.errors)
            row |= {"matched": size.size, "missing": len(own.missing), "more": len(own.extra)}
            row["median_error"] = float(np.median(size)) if size.size else None
            row["largest_error"] = own.worst if size.size else None
            errors = {there: there - here for here, there in own.folds}
            row["fold_errors"] = [errors.get(place) for place in row.get("folds", ())]
            row["folds_missed"] = [here for here, there in own.folds if np.isnan(there)]
        return row

    def table(self) -> str:
        """Methods side by side, as text: folds with their errors, errors along the curve, missing solutions, time."""
        reference, rows = self.comparison.reference, self.rows()
        against = f", errors relative to the largest value of {reference}" if reference else ""
        lines = [f"{self.quantity} along {self.parameter}{against}"]
        texts = [_places(row) for row in rows]
        width = max(len(m) for m in (*self, *self.failures, "method"))
        wide = max(len(text) for text in (*texts, "folds (errors)"))
        lines.append(f"{'method':{width}}  {'folds (errors)':{wide}}" + "".join(f" {word:>8}" for word in _HEAD))
        lines.append("-" * len(lines[-1]))
        for row, text in zip(rows, texts):
            cells = [f"{row[k]:.1e}" if row.get(k) is not None else "-" for k in ("median_error", "largest_error")]
            cells += [str(row.get(k, "-")) for k in ("missing", "more")] + [f"{row['seconds']:.2f} s"]
            lines.append(f"{row['method']:{width}}  {text:{wide}}" + "".join(f" {cell:>8}" for cell in cells))
            others = [f"{kind} {place:.9g}" for kind, place in row.get("others", ())]
            missed = [f"no fold at {place:.9g}" for place in row.get("folds_missed", ())]
            if others or missed:
                lines.append(" " * (width + 2) + ", ".join(others + missed))
        lines += [f"{method:{width}}  failed: {error}" for method, error in self.failures.items()]
        return "\n".join(lines)

    def __repr__(self) -> str:
        failed = f" | failed: {', '.join(self.failures)}" if self.failures else ""
        return f"Responses {self.quantity} along {self.parameter} | {', '.join(self)}{failed}"

    def plot(self, ax: Any = None) -> Any:
        """Draw all methods on one axes; returns the artists."""
        return self.comparison.plot(ax=ax)

    # ------------------------------------------------------------------ data
    def to_dict(self) -> dict[str, NDArray[Any]]:
        """All points of all methods as columns of equal length: method, branch, parameter, quantity, verdict."""
        names = ("method", "branch", self.parameter, self.quantity, "verdict")
        columns: dict[str, list[Any]] = {name: [] for name in names}
        for method, result in self.items():
            for k, curve in enumerate(result if isinstance(result, tuple) else (result,)):
                values, words = self._read(curve)
                parts = ([method] * len(curve), [k] * len(curve), curve.parameter.tolist(), values, words)
                for name, part in zip(names, parts):
                    columns[name] += part
        return {name: np.array(column) for name, column in columns.items()}

    def _read(self, curve: Branch | Sweep | MeasuredResponse) -> tuple[list[float], list[str]]:
        if isinstance(curve, MeasuredResponse):
            return curve.values(self.quantity).tolist(), ["measured"] * len(curve)
        if isinstance(curve, Sweep):
            return swept(curve, self.quantity).tolist(), ["settled" if s else "unsettled" for s in curve.settled]
        return curve.columns[self.quantity].tolist(), [str(v) for v in curve.verdicts]

    def to_csv(self, path: Any) -> None:
        """Write `to_dict` as comma-separated text with a header line."""
        write_columns(path, self.to_dict())

    def save(self, path: Any) -> None:
        """Write to a ``.npz`` file that `stability.load` reads: all branches and sweeps, errors, failures."""
        header, arrays = self.to_storage()
        write(path, "responses", header, arrays)

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        c = self.comparison
        shapes = [len(curve) if isinstance(curve, tuple) else None for curve in c.curves]
        curves = [part for curve in c.curves for part in (curve if isinstance(curve, tuple) else (curve,))]
        parts, arrays = packed([*curves, *c.differences.values()])
        header = {
            "reference": c.reference, "quantity": c.quantity, "parameter": c.parameter_name, "names": list(c.names),
            "differences": list(c.differences), "shapes": shapes, "parts": parts, "seconds": dict(self.seconds),
            "failures": {name: str(error) for name, error in self.failures.items()},
        }  # fmt: skip
        return header, arrays

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Responses:
        """The inverse of `to_storage` (an error comes back as `StabilityError` with its sentence)."""
        parts = iter(unpacked(header["parts"], arrays))
        curves = tuple(next(parts) if n is None else tuple(next(parts) for _ in range(n)) for n in header["shapes"])
        found = {name: next(parts) for name in header["differences"]}
        comparison = Comparison(
            header["reference"], header["quantity"], header["parameter"], found, curves, tuple(header["names"])
        )
        failures = {name: StabilityError(text) for name, text in header["failures"].items()}
        return cls(comparison, failures, header["seconds"])


def _places(row: Mapping[str, Any]) -> str:
    """Folds with the errors of those that have a partner in the reference; the jumps of a sweep."""
    if row["method"] == "measured":
        return f"{row['points']} points"
    if "jumps" in row:
        shown = [f"jump {place:.6g}" for place in row["jumps"][:3]]
        more = len(row["jumps"]) - len(shown)
        return ", ".join(shown + ([f"{more} more"] if more else [])) or "no jump"
    errors = row.get("fold_errors") or [None] * len(row["folds"])
    shown = [f"{place:.9g}" + ("" if e is None else f" ({e:+.0e})") for place, e in zip(row["folds"], errors)]
    return "  ".join(shown) or "none"
