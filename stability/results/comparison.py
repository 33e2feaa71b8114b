"""What `compare` gives: errors of other methods along the parameter, and the solutions that each of them misses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..words import Verdict
from .method_names import called
from .solutions import frozen
from .storage import register
from .sweep import Sweep

__all__ = ["Comparison", "Difference", "distinct", "swept"]

Array = NDArray[np.float64]


def distinct(places: list[float]) -> list[float]:
    """Ascending, places closer than 1e-9 of the largest once (mirror images have their special points at one place)."""
    found: list[float] = []
    for place in sorted(places):
        if not found or place - found[-1] > 1e-9 * max(abs(p) for p in places):
            found.append(place)
    return found


def swept(sweep: Sweep, quantity: str) -> Array:
    """(N,) a quantity of branches, such as u.amplitude(1) or u.max, along a sweep."""
    stem, _, measure = quantity.rpartition(".")
    sources = {"amplitude(1)": sweep.amplitude(1), "max": sweep.maximum, "min": sweep.minimum, "mean": sweep.mean}
    if measure not in sources:
        raise InputError(f"a sweep has no {quantity}: it has {', '.join(f'<state>.{m}' for m in sources)}")
    return sources[measure][stem]


@register("difference")
@dataclass(frozen=True, eq=False, repr=False)
class Difference:
    """One method against the reference.

    Attributes
    ----------
    name : str, the method
    parameter, reference, value : (N,) matched solutions: parameter, the reference's quantity, this method's
    verdicts : tuple of Verdict of the matched solutions (the reference's)
    missing : tuple of (parameter, verdict, quantity): solutions of the reference that this method does not have
    extra : tuple of (parameter, verdict, quantity): solutions of this method that the reference does not have
    folds : tuple of (reference's parameter, this method's or nan), matched in order of the parameter
    """

    name: str
    parameter: Array
    reference: Array
    value: Array
    verdicts: tuple[Verdict, ...]
    missing: tuple[tuple[float, Verdict, float], ...]
    extra: tuple[tuple[float, Verdict, float], ...]
    folds: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        for key in ("parameter", "reference", "value"):
            object.__setattr__(self, key, frozen(getattr(self, key)))

    @property
    def errors(self) -> Array:
        """(N,) relative differences, (value - reference) over the largest reference value of all."""
        scale = float(np.abs(self.reference).max(initial=0.0)) or 1.0
        return np.asarray((self.value - self.reference) / scale)

    @property
    def worst(self) -> float:
        """Largest modulus of `errors`; 0 where nothing was matched."""
        return float(np.abs(self.errors).max(initial=0.0))

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        header = {
            "name": self.name,
            "verdicts": [str(v) for v in self.verdicts],
            "missing": [[p, str(v), q] for p, v, q in self.missing],
            "extra": [[p, str(v), q] for p, v, q in self.extra],
            "folds": [list(pair) for pair in self.folds],
        }
        return header, {key: getattr(self, key) for key in ("parameter", "reference", "value")}

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Difference:
        """The inverse of `to_storage`."""
        missing, extra = (tuple((p, Verdict(v), q) for p, v, q in header[key]) for key in ("missing", "extra"))
        return cls(
            header["name"], arrays["parameter"], arrays["reference"], arrays["value"],
            tuple(Verdict(v) for v in header["verdicts"]), missing, extra, tuple((a, b) for a, b in header["folds"]),
        )  # fmt: skip

    def __repr__(self) -> str:
        median = float(np.median(np.abs(self.errors))) if self.errors.size else np.nan
        parts = [f"{self.name}: {self.parameter.size} matched, error median {median:.1e}, largest {self.worst:.1e}"]
        if self.missing:
            parts.append(f"misses {len(self.missing)}")
        if self.extra:
            parts.append(f"has {len(self.extra)} more")
        return ", ".join(parts)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Methods laid over a reference; what `compare` returns.

    Attributes
    ----------
    reference : str, name of the reference method
    quantity : str, the compared column
    parameter_name : str
    differences : mapping of method name to Difference
    curves : tuple of the compared results themselves, the reference first (for the plot)
    """

    reference: str
    quantity: str
    parameter_name: str
    differences: Any
    curves: tuple[Any, ...] = field(repr=False, default=())
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "differences", MappingProxyType(dict(self.differences)))

    def __getitem__(self, name: str) -> Difference:
        from ..errors import unknown_name

        known = called(name, self.differences)
        if known is None:
            raise unknown_name("method", name, self.differences, "this comparison")
        found: Difference = self.differences[known]
        return found

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.differences)

    def table(self) -> str:
        """Errors and folds side by side, as text."""
        lines = [f"{self.quantity} against {self.reference}, along {self.parameter_name}"]
        head = f"{'method':28} {'matched':>7} {'median':>9} {'largest':>9} {'missing':>7} {'more':>5}"
        lines += [head, "-" * len(head)]
        for d in self.differences.values():
            errors = np.abs(d.errors)
            median = f"{np.median(errors):9.1e}" if errors.size else f"{'-':>9}"
            row = f"{d.name[:28]:28} {errors.size:7d} {median} {d.worst:9.1e} {len(d.missing):7d} {len(d.extra):5d}"
            lines.append(row)
            for here, there in d.folds:
                shown = "not found" if np.isnan(there) else f"{there:.9g}, off by {there - here:.1e}"
                lines.append(f"    fold at {here:.9g}: {shown}")
        return "\n".join(lines)

    def plot(self, ax: Any = None) -> Any:
        """Draw all methods on one axes; returns the artists."""
        from ..plots.comparisons import plot_comparison

        return plot_comparison(self, ax=ax)

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """Matched solutions of all methods as columns of equal length: method, parameter, reference, value, verdict."""
        parts = list(self.differences.values())
        return {
            "method": np.array([d.name for d in parts for _ in range(d.parameter.size)]),
            self.parameter_name: np.concatenate([d.parameter for d in parts] or [np.zeros(0)]),
            "reference": np.concatenate([d.reference for d in parts] or [np.zeros(0)]),
            "value": np.concatenate([d.value for d in parts] or [np.zeros(0)]),
            "verdict": np.array([str(v) for d in parts for v in d.verdicts]),
        }

    def __repr__(self) -> str:
        return (
            "Comparison of "
            + f"{self.quantity} with {self.reference}\n  "
            + "\n  ".join(repr(d) for d in self.differences.values())
        )
