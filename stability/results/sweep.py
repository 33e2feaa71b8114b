"""A frequency sweep as on a shaker: what was recorded at each value of the parameter, in the order it was visited.

At each value the last `record` periods of a dwell of `periods` periods give the largest and smallest values, the mean
and the harmonics of every state and output. `transient` is the estimated part of the transient that was still alive
then (kernels/settling.py), `settled` says whether it is at most 1 %. A jump is where the response changes although
the step of the parameter is refined.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from .solutions import frozen
from .storage import register, write
from .trajectory import Ending

__all__ = ["Jump", "Sweep"]

Array = NDArray[np.float64]


class Jump(NamedTuple):
    """A jump of the response: its place, the values of the parameter on both sides, the response there.

    before, after : mapping of state or output -> (min, max)
    """

    parameter: float
    bracket: tuple[float, float]
    before: Mapping[str, tuple[float, float]]
    after: Mapping[str, tuple[float, float]]


class _Columns(Mapping[str, NDArray[Any]]):
    """One (N,) array per state and output."""

    def __init__(self, names: tuple[str, ...], values: NDArray[Any]) -> None:
        self._names, self._values = names, values

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._names:
            raise unknown_name("state or output", name, self._names, "this sweep")
        return np.asarray(self._values[:, self._names.index(name)])

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"columns: {', '.join(self._names)}"


@register("sweep")
@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """The response along a sweep of one parameter; what `sweep` returns.

    Attributes
    ----------
    system, name : str, the system and the swept parameter
    window : (from, to);  start : "carry" or "rest"
    states, output_names : tuples of str
    parameter : (N,) values in the order visited
    low, high, average : (N, q) smallest, largest, mean value of the q states and outputs
    coefficients : (N, q, H + 1) complex, c_k = mean of x exp(-2 pi i k t / T)
    strobes : (N, record, n) states at the ends of the recorded periods
    transient : (N,) estimated transient left over the half peak-to-peak value;  settled : (N,) bool
    multiple : (N,) int, the motion repeats after that many periods
    jumps : tuple of Jump;  params : mapping of the other parameters
    periods, record : int;  status : Ending (a sweep ends where the motion escapes);  units : mapping
    """

    system: str
    name: str
    window: tuple[float, float]
    start: str
    states: tuple[str, ...]
    output_names: tuple[str, ...]
    parameter: Array
    low: Array
    high: Array
    average: Array
    coefficients: NDArray[np.complex128]
    strobes: Array
    transient: Array
    settled: NDArray[np.bool_]
    multiple: NDArray[np.int64]
    params: Mapping[str, float]
    periods: int
    record: int
    status: Ending = Ending.COMPLETED
    jumps: tuple[Jump, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for key in ("parameter", "low", "high", "average", "strobes", "transient"):
            object.__setattr__(self, key, frozen(getattr(self, key)))
        object.__setattr__(self, "coefficients", frozen(self.coefficients, complex))
        object.__setattr__(self, "settled", frozen(self.settled, bool))
        object.__setattr__(self, "multiple", frozen(self.multiple, np.int64))
        object.__setattr__(self, "status", Ending(self.status))
        object.__setattr__(self, "window", (float(self.window[0]), float(self.window[1])))
        for key in ("states", "output_names", "jumps"):
            object.__setattr__(self, key, tuple(getattr(self, key)))
        for key in ("params", "units"):
            object.__setattr__(self, key, MappingProxyType(dict(getattr(self, key))))

    def __len__(self) -> int:
        return int(self.parameter.size)

    @property
    def names(self) -> tuple[str, ...]:
        """States, then outputs."""
        return self.states + self.output_names

    @property
    def maximum(self) -> Mapping[str, Array]:
        """State or output -> (N,) largest value over the recorded periods."""
        return _Columns(self.names, self.high)

    @property
    def minimum(self) -> Mapping[str, Array]:
        """State or output -> (N,) smallest value."""
        return _Columns(self.names, self.low)

    @property
    def peak_to_peak(self) -> Mapping[str, Array]:
        """State or output -> (N,) largest minus smallest value."""
        return _Columns(self.names, self.high - self.low)

    @property
    def mean(self) -> Mapping[str, Array]:
        """State or output -> (N,) mean value."""
        return _Columns(self.names, self.average)

    @property
    def ends(self) -> Array:
        """(N, n) states at the ends of the dwells."""
        return self.strobes[:, -1]

    @property
    def section(self) -> Mapping[str, Array]:
        """State -> (N, record) its values once a period: all of them over the parameter are a bifurcation diagram."""
        n, record = len(self.states), self.strobes.shape[1]
        return {s: self.strobes[:, :, i].reshape(-1, record) for i, s in enumerate(self.states[:n])}

    def _harmonic(self, k: int) -> NDArray[np.complex128]:
        if not 0 <= k < self.coefficients.shape[2]:
            top = self.coefficients.shape[2] - 1
            raise InputError(f"harmonic {k}: this sweep has 0 to {top}; sweep with harmonics={k}")
        return self.coefficients[:, :, k]

    def amplitude(self, k: int = 1) -> Mapping[str, Array]:
        """State or output -> (N,) amplitude 2 |c_k| of harmonic k of the forcing (k = 0: the mean)."""
        values = self._harmonic(k)
        return _Columns(self.names, values.real if k == 0 else 2 * np.abs(values))

    def phase(self, k: int = 1) -> Mapping[str, Array]:
        """State or output -> (N,) phase of harmonic k in (-pi, pi]: x = ... + amplitude cos(2 pi k t / T + phase)."""
        return _Columns(self.names, np.angle(self._harmonic(k)))

    def plot(self, ax: Any = None, y: str | None = None, **options: Any) -> Any:
        """Draw the response over the parameter; `y` is a state or output with a measure: "y.max", "y.min", "y.pp"."""
        from ..plots.sweeps import plot_sweep

        return plot_sweep(self, ax=ax, y=y, **options)

    def __repr__(self) -> str:
        jumps = "  ".join(f"jump {jump.parameter:.6g}" for jump in self.jumps) or "no jumps"
        unsettled = int((~self.settled).sum())
        state = "all settled" if not unsettled else f"{unsettled} unsettled"
        return (
            f"Sweep {self.system} {self.name} {self.window[0]:g} -> {self.window[1]:g} ({self.start}) | "
            f"{len(self)} points | {jumps} | {state} | {self.status}"
        )

    # ------------------------------------------------------------------ data
    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Columns by name: the parameter, <name>.max, .min, .mean, .amplitude, .phase, transient, settled."""
        columns: dict[str, NDArray[Any]] = {self.name: self.parameter}
        for name in self.names:
            columns[f"{name}.max"], columns[f"{name}.min"] = self.maximum[name], self.minimum[name]
            columns[f"{name}.mean"] = self.mean[name]
            columns[f"{name}.amplitude"], columns[f"{name}.phase"] = self.amplitude()[name], self.phase()[name]
        columns["transient"], columns["settled"] = self.transient, self.settled.astype(float)
        return columns

    def to_csv(self, path: Any) -> None:
        """The columns as comma-separated text with a line of names."""
        columns = self.to_columns()
        np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")

    def save(self, path: Any) -> None:
        """Write to ``.npz``; `load` reads it back."""
        header, arrays = self.to_storage()
        write(path, "sweep", header, arrays)

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        plain = ("system", "name", "window", "start", "states", "output_names", "params", "periods", "record", "units")
        header = {k: getattr(self, k) for k in plain} | {"status": str(self.status)}
        header["jumps"] = [[j.parameter, list(j.bracket), dict(j.before), dict(j.after)] for j in self.jumps]
        arrays = ("parameter", "low", "high", "average", "coefficients", "strobes", "transient", "settled", "multiple")
        return header, {k: getattr(self, k) for k in arrays}

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Sweep:
        """The inverse of `to_storage`."""
        fields: dict[str, Any] = {**header, **arrays}
        fields["jumps"] = tuple(Jump(p, tuple(b), before, after) for p, b, before, after in fields["jumps"])
        return cls(**fields)
