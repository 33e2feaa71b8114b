"""How far a special point, or a number told of a solution, moves with every parameter: frozen data, a ranked table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from ..errors import unknown_name
from ..words import Kind

__all__ = ["Sensitivity"]


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivity:
    """Derivatives of a special point's place or a solution's measure: of `SpecialPoint.sensitivity`, `sensitivity`.

    Attributes
    ----------
    label, kind : of the point; the name of the number told of an ordinary solution, whose kind is None
    name : str, the parameter lambda_1 in which its place is told, or that number's;  value : float
    params : mapping of all parameter values there
    derivatives : mapping of name to d lambda_1 / d name, all other parameters fixed
    relative : mapping of name to (name / lambda_1) (d lambda_1 / d name): per cent for per cent, largest modulus first
    angle : mapping of name to the derivative of the torus angle (NS, radians) or of the frequency (Hopf); else empty
    breaking : tuple of names of parameters that break the point up (branch points only): it has no place then
    """

    label: str
    kind: Kind | None
    name: str
    value: float
    params: Mapping[str, float]
    derivatives: Mapping[str, float]
    angle: Mapping[str, float]
    breaking: tuple[str, ...] = ()
    relative: Mapping[str, float] = field(init=False)

    def __post_init__(self) -> None:
        size = self.value or 1.0
        relative = {k: d * self.params[k] / size for k, d in self.derivatives.items()}
        order = sorted(relative, key=lambda k: (-abs(relative[k]), -abs(self.derivatives[k])))
        object.__setattr__(self, "relative", MappingProxyType({k: relative[k] for k in order}))
        object.__setattr__(self, "derivatives", MappingProxyType({k: self.derivatives[k] for k in order}))
        object.__setattr__(self, "angle", MappingProxyType(dict(self.angle)))
        object.__setattr__(self, "params", MappingProxyType(dict(self.params)))

    def __getitem__(self, name: str) -> float:
        """d lambda_1 / d name."""
        if name not in self.derivatives:
            raise unknown_name("parameter", name, list(self.derivatives), "this table")
        return self.derivatives[name]

    def __repr__(self) -> str:
        what = f"{self.label} {self.kind} at" if self.kind is not None else "a solution with"
        head = f"{what} {self.name} = {self.value:.10g}"
        width = max((len(k) for k in self.derivatives), default=4)
        rows = [f"  {'':{width}}  {'value':>12}  {'derivative':>13}  {'% per %':>10}"]
        for name, slope in self.derivatives.items():
            rows.append(f"  {name:{width}}  {self.params[name]:12.6g}  {slope:13.6g}  {self.relative[name]:10.4g}")
        tail = [f"  broken up by: {', '.join(self.breaking)}"] if self.breaking else []
        return "\n".join([head, *rows, *tail])

    def to_dict(self) -> dict[str, list[float] | list[str]]:
        """Columns parameter, value, derivative, relative: ``pandas.DataFrame(table.to_dict())``."""
        names = list(self.derivatives)
        return {
            "parameter": names,
            "value": [self.params[k] for k in names],
            "derivative": [self.derivatives[k] for k in names],
            "relative": [self.relative[k] for k in names],
        }
