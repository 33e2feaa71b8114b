"""`StabilityChart`: growth rate and class over two parameters, boundary curves, tongue tips, and how accurate they are.

For x' = A(t, p) x with A of period T(p) the growth rate is the largest real part of the Floquet exponents,

    growth = log(max |mu|) / T          per unit time; positive: unstable,

with mu the eigenvalues of the monodromy matrix. The chart keeps the Chebyshev tiles it was painted from, so that
multipliers at any point (`at`) and the picture are available without the system, also after `load`.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, MissingDependencyError, check_names
from ..words import Verdict
from .categories import KINDS, VERDICTS, Categories
from .storage import register, write
from .tiles import Layer, Tile, evaluate

__all__ = ["BoundaryCurve", "ChartPoint", "StabilityChart", "TongueTip"]

Array = NDArray[np.float64]
_SEVERITY = (Verdict.STABLE, Verdict.NEUTRAL, Verdict.UNDETERMINED, Verdict.UNSTABLE)


@dataclass(frozen=True, eq=False)
class BoundaryCurve:
    """A curve on which the largest multiplier leaves the unit circle.

    Attributes
    ----------
    x, y : (points,) float, in order along the curve; every point satisfies the boundary equation
    kind : "+1", "-1" or "pair", how the multiplier leaves
    order : tongue order n (a = (n Omega / 2)^2 at its root for Mathieu's equation), or None where it is not defined
    """

    x: Array
    y: Array
    kind: str
    order: int | None = None

    def __repr__(self) -> str:
        order = "" if self.order is None else f" order {self.order}"
        return f"BoundaryCurve {self.kind}{order} | {len(self.x)} points"


@dataclass(frozen=True)
class TongueTip:
    """A local minimum of y on a boundary curve: the least y at which a tongue opens.

    Attributes
    ----------
    x, y : float
    kind : "+1", "-1" or "pair"
    order : tongue order, or None
    """

    x: float
    y: float
    kind: str
    order: int | None = None


@dataclass(frozen=True, eq=False)
class ChartPoint:
    """Floquet data at one point of a chart.

    Attributes
    ----------
    params : parameter values
    multipliers : (n,) complex, descending modulus
    period : T
    growth_rate : largest real Floquet exponent, per unit time
    verdict : Verdict;  kind : "none", "+1", "-1" or "pair"
    error : estimated absolute error of the growth rate anywhere on the chart
    """

    params: Mapping[str, float]
    multipliers: NDArray[np.complex128]
    period: float
    growth_rate: float
    verdict: Verdict
    kind: str
    error: float

    @property
    def exponents(self) -> NDArray[np.complex128]:
        """(n,) log(multiplier) / T, imaginary parts in (-pi/T, pi/T]."""
        return np.asarray(np.log(self.multipliers) / self.period)


@register("stability-chart")
@dataclass(frozen=True, eq=False, repr=False)
class StabilityChart:
    """Stability over two parameters; made by `chart`.

    Attributes
    ----------
    x_name, y_name : str
        The two parameters.
    x : (nx,) float;  y : (ny,) float
        Their values, increasing.
    growth_rate : (ny, nx) float
        Largest real Floquet exponent, per unit time.
    verdict : Categories (ny, nx)
        Words of `Verdict`; ``chart.verdict == Verdict.UNSTABLE`` is a boolean array.
    kind : Categories (ny, nx)
        How the largest multiplier leaves the unit circle: "+1", "-1", "pair"; "none" where it is not outside.
    error : float
        Estimated largest absolute error of the growth rate on the grid.
    params : mapping
        All other parameters.
    name : str
        Of the system.
    layers : tuple of Layer
        What the chart was painted from (see `results.tiles`).
    """

    x_name: str
    y_name: str
    x: Array
    y: Array
    growth_rate: Array
    verdict: Categories
    kind: Categories
    error: float
    params: Mapping[str, float]
    name: str
    layers: tuple[Layer, ...]
    _trace: Callable[[StabilityChart], tuple[Sequence[BoundaryCurve], Sequence[TongueTip]]] | None = field(default=None)

    def __post_init__(self) -> None:
        object.__setattr__(self, "params", MappingProxyType(dict(self.params)))
        for array in (self.x, self.y, self.growth_rate):
            array.setflags(write=False)

    @cached_property
    def _curves(self) -> tuple[tuple[BoundaryCurve, ...], tuple[TongueTip, ...]]:
        if self._trace is None:
            return (), ()
        curves, tips = self._trace(self)
        return tuple(curves), tuple(tips)

    @property
    def boundaries(self) -> tuple[BoundaryCurve, ...]:
        """The boundary curves, computed at the first access (and before the chart is saved)."""
        return self._curves[0]

    @property
    def tips(self) -> tuple[TongueTip, ...]:
        """Local minima of y on the boundary curves, ordered by tongue."""
        return self._curves[1]

    def at(self, **params: float) -> ChartPoint:
        """Multipliers, growth rate, verdict and kind at any point of the window, from the chart's own tiles.

        Parameters
        ----------
        **params : the two parameters of the axes, both inside the window.

        Raises
        ------
        UnknownNameError, InputError
            Other names, or a point outside the window.

        *Accuracy*: that of the chart, `error`; checked against single monodromy matrices.
        """
        check_names("axis", params, (self.x_name, self.y_name), "this chart")
        missing = [n for n in (self.x_name, self.y_name) if n not in params]
        if missing:
            raise InputError(f"chart.at needs {self.x_name} and {self.y_name}; {missing[0]} is missing")
        x, y = float(params[self.x_name]), float(params[self.y_name])
        for name, value, axis in ((self.x_name, x, self.x), (self.y_name, y, self.y)):
            if not axis[0] <= value <= axis[-1]:
                raise InputError(f"{name} = {value:g} is outside the chart: {axis[0]:g} to {axis[-1]:g}")
        at = np.array([x]), np.array([y])
        multipliers, verdicts = [], []
        for layer in self.layers:
            fields = evaluate(layer.tiles, *at)[0][:, 0]
            chi, sigma = (float(v) for v in evaluate(layer.tiles, *at, "clock")[0][:, 0])
            normal = normalised_multipliers(layer.form, fields, layer.states)
            rate = sigma + chi * float(np.log(np.abs(normal[0])))
            calm = rate <= self.error if layer.neutral else rate < -self.error
            stable = Verdict.NEUTRAL if layer.neutral else Verdict.STABLE
            verdicts.append(Verdict.UNSTABLE if rate > self.error else (stable if calm else Verdict.UNDETERMINED))
            multipliers.append(normal * np.exp(sigma / chi))
        together = np.concatenate(multipliers)
        together = together[np.argsort(-np.abs(together), kind="stable")]
        growth = chi * float(np.log(np.abs(together[0])))
        verdict = max(verdicts, key=_SEVERITY.index)
        kind = "none"
        if verdict is Verdict.UNSTABLE:
            pair = abs(together[0].imag) > 1e-9 * abs(together[0])
            kind = "pair" if pair else ("+1" if together[0].real > 0 else "-1")
        everything = {**self.params, self.x_name: x, self.y_name: y}
        return ChartPoint(everything, together, 1.0 / chi, growth, verdict, kind, self.error)

    def plot(self, kind: str = "growth_rate", ax: Any = None, **style: Any) -> Any:
        """Draw the chart: filled by growth rate or by class ("class"), boundary curves by kind, orders labelled."""
        from ..plots.charts import plot_chart

        return plot_chart(self, kind, ax=ax, **style)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the chart to an ``.npz`` file that `load` reads; boundaries and tips are computed first."""
        header, arrays = self.to_storage()
        write(path, "stability-chart", header, arrays)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one row per point: x, y, growth rate, verdict, kind."""
        with open(path, "w", newline="", encoding="utf-8") as stream:
            table = csv.writer(stream)
            table.writerow([self.x_name, self.y_name, "growth_rate", "verdict", "kind"])
            for j, y in enumerate(self.y.tolist()):
                words = (self.growth_rate[j].tolist(), self.verdict[j].tolist(), self.kind[j].tolist())
                table.writerows([x, y, g, v, k] for x, g, v, k in zip(self.x.tolist(), *words, strict=True))

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` with growth_rate, verdict and kind (codes, the words in the attributes)."""
        try:
            import xarray
        except ImportError:
            raise MissingDependencyError("to_xarray needs xarray: python -m pip install xarray") from None
        dims = (self.y_name, self.x_name)
        codes = {
            name: (dims, np.array(c.codes), {"words": list(map(str, c.words))})
            for name, c in (("verdict", self.verdict), ("kind", self.kind))
        }
        return xarray.Dataset(
            {"growth_rate": (dims, np.array(self.growth_rate)), **codes},
            coords={self.y_name: np.array(self.y), self.x_name: np.array(self.x)},
            attrs={"system": self.name, "error": self.error, **self.params},
        )

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        arrays: dict[str, NDArray[Any]] = {
            "x": self.x, "y": self.y, "growth_rate": self.growth_rate,
            "verdict": self.verdict.codes, "kind": self.kind.codes,
        }  # fmt: skip
        tiles = [tile for layer in self.layers for tile in layer.tiles]
        for i, tile in enumerate(tiles):
            arrays[f"fields_{i}"], arrays[f"clock_{i}"] = tile.fields, tile.clock
        for i, curve in enumerate(self.boundaries):
            arrays[f"curve_{i}"] = np.array([curve.x, curve.y])
        header = {
            "type": "stability-chart", "x_name": self.x_name, "y_name": self.y_name, "error": float(self.error),
            "params": dict(self.params), "name": self.name,
            "layers": [[layer.form, layer.states, bool(layer.neutral), len(layer.tiles)] for layer in self.layers],
            "tiles": [[list(map(float, t.box)), float(t.error), float(t.clock_error)] for t in tiles],
            "curves": [[c.kind, c.order] for c in self.boundaries],
            "tips": [[t.x, t.y, t.kind, t.order] for t in self.tips],
        }  # fmt: skip
        return header, arrays

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> StabilityChart:
        """The inverse of `to_storage`."""
        tiles = [
            Tile(tuple(box), arrays[f"fields_{i}"], arrays[f"clock_{i}"], error, clock_error)
            for i, (box, error, clock_error) in enumerate(header["tiles"])
        ]
        layers = []
        for form, states, neutral, count in header["layers"]:
            layers.append(Layer(form, states, neutral, tuple(tiles[:count])))
            tiles = tiles[count:]
        curves = tuple(
            BoundaryCurve(arrays[f"curve_{i}"][0], arrays[f"curve_{i}"][1], kind, order)
            for i, (kind, order) in enumerate(header["curves"])
        )
        tips = tuple(TongueTip(x, y, kind, order) for x, y, kind, order in header["tips"])
        kept = {k: header[k] for k in ("x_name", "y_name", "error", "params", "name")}
        return cls(
            x=arrays["x"], y=arrays["y"], growth_rate=arrays["growth_rate"],
            verdict=Categories(arrays["verdict"], VERDICTS), kind=Categories(arrays["kind"], KINDS),
            layers=tuple(layers), _trace=lambda _: (curves, tips), **kept,
        )  # fmt: skip

    def __repr__(self) -> str:
        shape = f"{len(self.x)} x {len(self.y)}"
        axes = f"{self.x_name} {self.x[0]:g} to {self.x[-1]:g}, {self.y_name} {self.y[0]:g} to {self.y[-1]:g}"
        shares = "  ".join(f"{word} {n / self.verdict.size:.1%}" for word, n in self.verdict.counts().items())
        return f"StabilityChart {self.name} | {axes} | {shape} points | {shares} | error <= {self.error:.1e}"


def normalised_multipliers(form: str, f: Array, n: int) -> NDArray[np.complex128]:
    """Multipliers of M0 (determinant 1) from the fields at one point, descending modulus; pairs to full precision."""
    if form in ("hill", "two"):
        if form == "hill":
            p, m = f[0] * f[1], f[2] * f[3]
            half = 1.0 + 2.0 * p if abs(p) < abs(m) else 2.0 * m - 1.0
            s = p * m  # (tr^2 - 4) / 16
            root = 2.0 * np.sqrt(abs(s))
        else:
            half, s = 0.5 * f[3], 0.25 * f[0] * f[0] + f[1] * f[2]
            root = np.sqrt(abs(s))
        if s < 0:
            return np.array([complex(half, root), complex(half, -root)]) / np.hypot(half, root)
        large = half + np.copysign(root, half)
        return np.array([large, 1.0 / large], dtype=complex)
    values = np.linalg.eigvals(f[-n * n :].reshape(n, n)).astype(complex)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])
