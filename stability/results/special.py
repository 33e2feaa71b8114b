r"""A special point of a branch: where the number or the stability of solutions changes, located and labelled.

At a fold and at a branch point F_u is singular (multiplier +1, eigenvalue 0); at a period doubling a multiplier is -1;
at a Neimark-Sacker point a pair is exp(+-i theta); at a Hopf point a pair of eigenvalues is +-i omega.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileFormatError
from ..words import Criticality, Kind
from .revival import revive
from .solutions import FixedPoint, PeriodicOrbit, frozen
from .storage import register, write

__all__ = ["SpecialPoint"]

_RESONANT = 0.01
_OF_HALF = (Kind.R1, Kind.R1, Kind.R3, Kind.R2)  # powers 1 to 4 of a half-period map, as the whole period shows them
_SOLUTIONS: dict[str, Any] = {"fixed-point": FixedPoint, "periodic-orbit": PeriodicOrbit}


@register("special-point")
@dataclass(frozen=True, eq=False, repr=False)
class SpecialPoint:
    """A located event on a branch.

    Attributes
    ----------
    kind : Kind;  label : str, such as ``LP1``;  name : str, of a user's event
    params : mapping of all parameter values
    solution : FixedPoint or PeriodicOrbit
    multipliers : (n,) complex, multipliers of an orbit or eigenvalues of an equilibrium
    half_multipliers : (n,) complex or None, of the half-period map of an orbit solved on half of its period: -1 at the
        loss of its symmetry; `multipliers` are their squares
    bracket : (float, float), values of the continued parameter at the points between which it was found
    accuracy : float, last Newton update in the scaled norm (the error left is about its square)
    criticality : Criticality or None;  coefficient : float or None, of the normal form (computed when first asked for)
    free : str, the continued parameter
    u, direction : (N,) the problem's unknowns there and the direction of the branch in them;  rate : float, the
        parameter's part of the direction
    """

    kind: Kind
    label: str
    params: Mapping[str, float]
    multipliers: NDArray[np.complex128]
    bracket: tuple[float, float]
    free: str
    u: NDArray[np.float64]
    direction: NDArray[np.float64]
    rate: float
    source: Any = field(repr=False)  # the problem, or its spec after `load`
    accuracy: float = 0.0
    name: str = ""
    half_multipliers: NDArray[np.complex128] | None = None
    breaking: bool | None = field(default=None, repr=False)  # None: not looked at yet
    stored: Any = field(default=None, repr=False)  # the solution, where it was read from a file
    normal: tuple[float | None, Criticality | None] | None = field(default=None, repr=False)  # None: not computed yet

    def __post_init__(self) -> None:
        object.__setattr__(self, "kind", Kind(self.kind))
        object.__setattr__(self, "params", MappingProxyType({k: float(v) for k, v in self.params.items()}))
        for key, dtype in (("multipliers", complex), ("u", float), ("direction", float)):
            object.__setattr__(self, key, frozen(getattr(self, key), dtype))
        if self.half_multipliers is not None:
            object.__setattr__(self, "half_multipliers", frozen(self.half_multipliers, complex))
        low, high = self.bracket
        object.__setattr__(self, "bracket", (float(low), float(high)))
        if self.normal is not None:
            coefficient, word = self.normal
            object.__setattr__(self, "normal", (coefficient, None if word is None else Criticality(word)))

    @property
    def problem(self) -> Any:
        """The problem on whose mesh it was located (rebuilt from its description after `load`)."""
        return revive(self.source) if isinstance(self.source, Mapping) else self.source

    @cached_property
    def solution(self) -> Any:
        """The orbit or the fixed point (computed when first asked for)."""
        return self.problem.view(np.array(self.u), self.params_vector) if self.stored is None else self.stored

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """The same as `multipliers` (the word for equilibria)."""
        return self.multipliers

    @property
    def critical_values(self) -> NDArray[np.complex128]:
        """The values of the map on which the point was located: `half_multipliers` if there are any."""
        return self.multipliers if self.half_multipliers is None else self.half_multipliers

    @property
    def defining_kind(self) -> Kind:
        """The kind of the defining system: a symmetry-breaking point on half of a period is a simple -1 there."""
        simple = self.half_multipliers is not None and self.kind is Kind.BRANCH_POINT and bool(self.breaking)
        return Kind.PERIOD_DOUBLING if simple else self.kind

    @cached_property
    def symmetry_breaking(self) -> bool:
        """Whether the branch that is born at this branch point loses a symmetry: two branches, images of each other."""
        if self.breaking is None and self.kind is Kind.BRANCH_POINT:
            return bool(import_module("stability.problems.breaking").breaks_symmetry(self))
        return bool(self.breaking)

    @property
    def resonance(self) -> Kind | None:
        """The strong resonance that a Neimark-Sacker point is close to: exp(i k theta) within 0.01 of 1, k <= 4.

        On half of a period the angle is that of the half-period map: a pair at +-i is a double -1 of the whole period
        and named so, 1:2 (a doubling, which a symmetric orbit has in no other way), a double -1 of the half a 1:1.
        """
        if self.kind is not Kind.NEIMARK_SACKER:
            return None
        upper = [v for v in self.critical_values.tolist() if v.imag >= 0]
        nearest = min(upper, key=lambda v: abs(abs(v) - 1), default=0j)
        names = (Kind.R1, Kind.R2, Kind.R3, Kind.R4) if self.half_multipliers is None else _OF_HALF
        close = [name for k, name in enumerate(names, 1) if abs((nearest / (abs(nearest) or 1.0)) ** k - 1) < _RESONANT]
        return close[0] if close else None

    @property
    def params_vector(self) -> NDArray[np.float64]:
        """(m,) parameter values in the problem's order."""
        return np.array(list(self.params.values()))

    @cached_property
    def _normal_form(self) -> tuple[float | None, Criticality | None]:
        if self.normal is not None:
            return self.normal
        module = import_module("stability.problems.criticality")
        return module.criticality_of(self.problem, self.defining_kind, np.array(self.u), self.params_vector)  # type: ignore[no-any-return]

    @property
    def criticality(self) -> Criticality | None:
        """Where the new solutions live: SUPERCRITICAL (they attract), SUBCRITICAL, DEGENERATE; None: no such word.

        Of Hopf, pitchfork, period-doubling and Neimark-Sacker points; of a fold only DEGENERATE (a cusp). Near the
        strong resonances exp(i k theta) = 1, k <= 4, a torus coefficient does not decide: None. Nor is there one where
        the solution meets a kink or jump of the right-hand side that the coefficient feels (problems/kinks.py).
        """
        return self._normal_form[1]

    @property
    def coefficient(self) -> float | None:
        """The normal form's coefficient (problems/normal_forms.py says which), for |q| = 1 in the states' units."""
        return self._normal_form[0]

    def sensitivity(self, of: str | None = None) -> Any:
        """How the place of this point moves with every other parameter: derivatives, ranked.

        Parameters
        ----------
        of : str or None
            The parameter in which the place is told, d of / d other; by default the one the branch was continued in.
            On a curve of special points (`locus`) with an extremum of `of` at this point, it is the extremum's rate.

        Returns
        -------
        Sensitivity
            ``table["xi"]`` is the derivative; ``table.relative`` in per cent for per cent; printed, a ranked table.

        Raises
        ------
        InputError, UnknownNameError
            A kind without a defining system; no such parameter.
        ConvergenceError
            The point does not move with `of`, or is one of higher codimension.

        Examples
        --------
        >>> import stability as st
        >>> branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14))
        >>> round(branch["HB1"].sensitivity()["sigma"], 6)  # rho = sigma (sigma + b + 3)/(sigma - b - 1)
        0.146814
        """
        return import_module("stability.problems.sensitivity").sensitivity(self, of)

    def __repr__(self) -> str:
        named = f" '{self.name}'" if self.name else ""
        words = ([str(self.criticality)] if self.criticality else []) + ["symmetry breaking"] * self.symmetry_breaking
        words += [f"near {self.resonance}"] if self.resonance else []
        tail = f" | {', '.join(words)}" if words else ""
        return f"{self.label} {self.kind}{named} at {self.free} = {self.params[self.free]:.10g}{tail}"

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        solution, arrays = self.solution.to_storage()
        header = {
            "kind": str(self.kind),
            "label": self.label,
            "params": dict(self.params),
            "bracket": list(self.bracket),
            "free": self.free,
            "rate": float(self.rate),
            "accuracy": float(self.accuracy),
            "name": self.name,
            "breaking": self.symmetry_breaking,
            "criticality": None if self.criticality is None else str(self.criticality),
            "coefficient": self.coefficient,
            "source": dict(self.source if isinstance(self.source, Mapping) else self.source.spec),
            "solution": solution,
        }
        own = {"multipliers": self.multipliers, "u": self.u, "direction": self.direction}
        own |= {} if self.half_multipliers is None else {"half_multipliers": self.half_multipliers}
        return header, own | {f"solution.{k}": a for k, a in arrays.items()}

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> SpecialPoint:
        """The inverse of `to_storage`."""
        fields = dict(header)
        stored = fields.pop("solution")
        if stored.get("type") not in _SOLUTIONS:
            raise FileFormatError(f"a special point's solution is of unknown type {stored.get('type')!r}")
        inner = {k.removeprefix("solution."): a for k, a in arrays.items() if k.startswith("solution.")}
        solution = _SOLUTIONS[stored["type"]].from_storage(stored, inner)
        normal = (fields.pop("coefficient"), fields.pop("criticality"))
        own: dict[str, Any] = {k: arrays[k] for k in ("multipliers", "u", "direction")}
        own["half_multipliers"] = arrays.get("half_multipliers")
        return cls(stored=solution, normal=normal, **own, **fields)

    def save(self, path: Any) -> None:
        """Write to a ``.npz`` file that `stability.load` reads."""
        header, arrays = self.to_storage()
        write(path, "special-point", header, arrays)
