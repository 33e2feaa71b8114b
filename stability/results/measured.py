r"""A measured response: what was recorded on a test stand while one parameter was stepped or swept.

Columns in SI units over the swept one, in the order in which they were recorded. What a column is called says what it
is: ``amplitude`` of the fundamental, ``max``, ``min``, ``pp`` (peak to peak), ``phase`` with x = amplitude cos(2 pi f t
+ phase); with several signals ``<state>.amplitude``, ``<state>.max``, and so on, as in the columns of a branch.
`load_response` reads one from a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, check_names, unknown_name
from .solutions import frozen
from .storage import register, write

__all__ = ["MeasuredResponse"]

Array = NDArray[np.float64]
# what a branch calls a measure -> what people write over their columns
_WORDS = {
    "amplitude(1)": ("amplitude(1)", "amplitude", "ampl", "amp", "a"),
    "max": ("max", "maximum", "peak"),
    "min": ("min", "minimum"),
    "pp": ("pp", "peak_to_peak", "peak-to-peak", "p-p", "pk-pk"),
    "phase": ("phase", "phi"),
}


@register("measured-response")
@dataclass(frozen=True, eq=False, repr=False)
class MeasuredResponse:
    """A measured sweep; what `load_response` returns.

    Attributes
    ----------
    name : str, the swept parameter
    parameter : (N,) its values in the order recorded, in SI units
    columns : mapping of name to (N,) values in SI units
    units : mapping of name (the parameter's, too) to the SI unit
    source : str, where it came from

    Examples
    --------
    >>> import numpy as np, stability as st
    >>> seen = st.MeasuredResponse("frequency", np.array([10.0, 11.0]), {"amplitude": np.array([1e-3, 2e-3])})
    >>> float(seen.values("y.amplitude(1)").max())
    0.002
    """

    name: str
    parameter: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameter", frozen(self.parameter))
        columns = {str(k): frozen(v) for k, v in self.columns.items()}
        if not columns or any(v.shape != self.parameter.shape or v.ndim != 1 for v in columns.values()):
            raise InputError(f"a measured response needs columns of equal length along {self.name}")
        if not all(np.isfinite(v).all() for v in (self.parameter, *columns.values())):
            raise InputError("a measured response needs finite numbers")
        object.__setattr__(self, "columns", MappingProxyType(columns))
        check_names("column", self.units, [self.name, *columns], "this response")
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))

    def __len__(self) -> int:
        return int(self.parameter.size)

    @property
    def direction(self) -> int:
        """+1 where the parameter only rises, -1 where it only falls, 0 for both."""
        steps = np.diff(self.parameter)
        return int((steps >= 0).all()) - int((steps <= 0).all())

    def column(self, quantity: str) -> str:
        """The column that holds a quantity of a branch or a sweep, such as "y.amplitude(1)" or "y.max".

        Raises
        ------
        UnknownNameError
            No column is called so, or like its measure alone.
        """
        if quantity in self.columns:
            return quantity
        stem, _, measure = quantity.rpartition(".")
        words = _WORDS.get(measure, (measure,)) if measure != "amplitude" else _WORDS["amplitude(1)"]
        for word in words:
            for name in (f"{stem}.{word}", word, f"{stem}_{word}"):
                if name in self.columns:
                    return name
        raise unknown_name("quantity", quantity, self.columns, "this measured response")

    def values(self, quantity: str) -> Array:
        """(N,) the column that `column` names."""
        return np.asarray(self.columns[self.column(quantity)])

    def quantity(self, names: Sequence[str]) -> str:
        """The first of a branch's columns `names` of which something was measured."""
        for measured in self.columns:
            for name in names:
                stem, _, measure = name.rpartition(".")
                words = _WORDS.get(measure, ())
                if stem and measured in {name, *words, *(f"{stem}.{word}" for word in words)}:
                    return name
        raise InputError(
            f"none of the columns {', '.join(self.columns)} is a measure of this branch: say which with y= or "
            "quantity=, or rename them: load_response(file, names={'header': 'y.max'})"
        )

    def plot(self, ax: Any = None, y: str | None = None, **options: Any) -> Any:
        """Draw a column over the parameter; `y` is a column or a quantity of a branch, default the first column."""
        from ..plots.measurements import plot_measured

        return plot_measured(self, ax=ax, y=y, **options)

    def __repr__(self) -> str:
        unit = self.units.get(self.name, "")
        lo, hi = float(self.parameter.min()), float(self.parameter.max())
        way = {1: "rising", -1: "falling", 0: "both ways"}[self.direction]
        source = f" {self.source}" if self.source else ""
        return (
            f"MeasuredResponse{source} | {len(self)} points | {self.name} {lo:g} .. {hi:g} {unit} ({way}) | "
            + ", ".join(self.columns)
        )

    # ------------------------------------------------------------------ data
    def to_columns(self) -> dict[str, NDArray[Any]]:
        """The parameter and all columns by name."""
        return {self.name: self.parameter, **self.columns}

    def to_csv(self, path: Any) -> None:
        """The columns in SI units with a line of names and units; `load_response` reads it back."""
        columns = self.to_columns()
        head = ",".join(f"{name} [{self.units.get(name, '1')}]" for name in columns)
        np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=head, comments="", fmt="%.17g")

    def save(self, path: Any) -> None:
        """Write to ``.npz``; `load` reads it back."""
        header, arrays = self.to_storage()
        write(path, "measured-response", header, arrays)

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        header = {"name": self.name, "names": list(self.columns), "units": dict(self.units), "source": self.source}
        return header, {"parameter": self.parameter, "values": np.array(list(self.columns.values()))}

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> MeasuredResponse:
        """The inverse of `to_storage`."""
        columns = dict(zip(header["names"], arrays["values"]))
        return cls(header["name"], arrays["parameter"], columns, header["units"], header["source"])
