"""Basins of attraction over a grid of initial values, and the attractors that were found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .solutions import frozen
from .storage import register, write

__all__ = ["Attractor", "Basins"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Attractor:
    """A steady motion that others come to.

    Attributes
    ----------
    label : int
    points : (m, n) its stroboscopic states;  multiple : m, it repeats after m periods; 0: it does not repeat
    share : part of the grid that comes to it
    """

    label: int
    points: Array
    multiple: int
    share: float

    def __repr__(self) -> str:
        kind = f"period {self.multiple} T" if self.multiple else "not periodic"
        return f"Attractor {self.label} | {kind} | {100 * self.share:.3g} % of the grid"


@register("basins")
@dataclass(frozen=True, eq=False, repr=False)
class Basins:
    """Which attractor the motion from every cell of a grid comes to; what `basins` returns.

    Attributes
    ----------
    system, x_name, y_name : str
    x : (nx,);  y : (ny,) initial values, centres of the cells
    labels : (ny, nx) int, index into `attractors`, -1 escaped, -2 undecided
    attractors : tuple of Attractor
    states : tuple of str;  params : mapping
    agreement : part of some cells, spread over the grid, that came to the same attractor when followed by integration
        (where a table of the stroboscopic map was used; else 1)
    """

    system: str
    x_name: str
    y_name: str
    x: Array
    y: Array
    labels: NDArray[np.int64]
    attractors: tuple[Attractor, ...]
    states: tuple[str, ...]
    params: Mapping[str, float]
    agreement: float = 1.0

    def __post_init__(self) -> None:
        for key in ("x", "y"):
            object.__setattr__(self, key, frozen(getattr(self, key)))
        object.__setattr__(self, "labels", frozen(self.labels, np.int64))
        object.__setattr__(self, "params", MappingProxyType(dict(self.params)))

    @property
    def escaped(self) -> float:
        """Part of the grid from which the motion escapes."""
        return float((self.labels == -1).mean())

    @property
    def undecided(self) -> float:
        """Part of the grid that came to no attractor in time."""
        return float((self.labels == -2).mean())

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw the basins, with the attractors' stroboscopic points."""
        from ..plots.basin_maps import plot_basins

        return plot_basins(self, ax=ax, **options)

    def __repr__(self) -> str:
        shares = "  ".join(f"{a.label}: {100 * a.share:.3g} % ({a.multiple} T)" for a in self.attractors)
        rest = f" | escaped {100 * self.escaped:.3g} %" if self.escaped else ""
        rest += f" | undecided {100 * self.undecided:.3g} %" if self.undecided else ""
        return f"Basins {self.system} {self.labels.shape[1]} x {self.labels.shape[0]} | {shares}{rest}"

    def save(self, path: Any) -> None:
        """Write to ``.npz``; `load` reads it back."""
        plain = ("system", "x_name", "y_name", "states", "params")
        header: dict[str, Any] = {k: getattr(self, k) for k in plain}
        header["agreement"] = self.agreement
        header["attractors"] = [[a.label, a.multiple, a.share] for a in self.attractors]
        arrays = {"x": self.x, "y": self.y, "labels": self.labels}
        write(path, "basins", header, arrays | {f"points{a.label}": a.points for a in self.attractors})

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Basins:
        """The inverse of `save`."""
        found = tuple(Attractor(k, frozen(arrays[f"points{k}"]), m, share) for k, m, share in header["attractors"])
        own: dict[str, Any] = {k: v for k, v in header.items() if k != "attractors"}
        own |= {"states": tuple(own["states"]), **{k: arrays[k] for k in ("x", "y", "labels")}}
        return cls(attractors=found, **own)
