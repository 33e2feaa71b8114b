"""From energies in SI units to a base-excited `System`, with an optional electromagnetic coil.

Coordinates are relative to the moving base. A coil on coordinate q with coupling k_em (V s/m = N/A) adds the state i,

    L_c i' + (R_c + R_l) i = k_em(q) q',      force on q:  -k_em(q) i,      load power  P = R_l i^2,

or, with neglected inductance, i = k_em(q) q'/(R_c + R_l). A rotary coil is the same with torque and angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ..errors import InputError, unknown_name
from ..systems.system import System
from ._shaker import Shaker, positive

__all__ = ["Coil", "physical_system"]

t = sp.Symbol("t", real=True)


@dataclass(frozen=True)
class Coil:
    """Electromagnetic transducer: L_c i' + (R_c + R_l) i = k_em(q) q', force -k_em(q) i on the coordinate q.

    Parameters
    ----------
    coupling : float or callable
        k_em (V s/m = N/A; V s/rad for an angle); or a function of the sympy coordinate giving an expression, for a
        position-dependent coupling (the derivative of the flux linkage).
    coil_resistance : float
        R_c (ohm).
    load_resistance : float
        R_l (ohm).
    inductance : float
        L_c (H); 0 neglects it, and the current is no state then.
    coordinate : str, optional
        The coordinate it is attached to; the model's first one by default.

    Raises
    ------
    InputError
        For negative resistances or inductance, or no resistance at all.

    Examples
    --------
    >>> import stability as st
    >>> coil = st.models.Coil(coupling=5.0, coil_resistance=50.0, load_resistance=550.0)
    >>> st.models.linear_oscillator.from_physical(acceleration=4.905, coil=coil).states
    ('y', 'y_dot')
    """

    coupling: float | Callable[[Any], Any] = 5.0
    coil_resistance: float = 50.0
    load_resistance: float = 550.0
    inductance: float = 0.0
    coordinate: str | None = None

    def __post_init__(self) -> None:
        positive(zero_allowed=True, coil_resistance=self.coil_resistance, load_resistance=self.load_resistance)
        positive(zero_allowed=True, inductance=self.inductance)
        if self.coil_resistance + self.load_resistance <= 0:
            raise InputError("coil_resistance + load_resistance must be positive")

    @property
    def parameters(self) -> dict[str, float]:
        """The coil's parameters, by the names they get in the system."""
        values = {} if callable(self.coupling) else {"k_em": float(self.coupling)}
        values |= {"coil_resistance": float(self.coil_resistance), "load_resistance": float(self.load_resistance)}
        return values | ({"inductance": float(self.inductance)} if self.inductance else {})

    def attached(self, q: Any) -> tuple[Any, Any, dict[Any, Any], list[Any]]:
        """(current, force on q, extra equation, extra coordinate) for the coordinate function q(t)."""
        k = sp.sympify(self.coupling(q)) if callable(self.coupling) else sp.Symbol("k_em", real=True)
        resistance = sp.Symbol("coil_resistance", real=True) + sp.Symbol("load_resistance", real=True)
        if not self.inductance:
            current = k * q.diff(t) / resistance
            return current, -k * current, {}, []
        i = sp.Function("i")(t)
        equation = {i.diff(t): (k * q.diff(t) - resistance * i) / sp.Symbol("inductance", real=True)}
        return i, -k * i, equation, [i]


def physical_system(
    name: str,
    description: str,
    lagrangian: Any,
    coordinates: Sequence[Any],
    parameters: Mapping[str, float],
    *,
    base: Shaker,
    dissipation: Any = 0,
    forces: Mapping[Any, Any] | None = None,
    units: Mapping[str, str] | None = None,
    outputs: Mapping[str, Any] | None = None,
    angles: Sequence[str] = (),
    coil: Coil | None = None,
) -> System:
    """A base-excited system in SI units from T - U (with the base motion in it or in `forces`), R and a coil."""
    from ..systems.lagrangian import equations_of_motion

    acting: dict[Any, Any] = dict(forces or {})
    values, shown = {**base.parameters, **parameters}, dict(outputs or {})
    extra: list[Any] = []
    all_units = {**base.units, **(units or {})}
    electrical: dict[Any, Any] = {}
    if coil is not None:
        names = [c.func.__name__ for c in coordinates]
        if coil.coordinate is not None and coil.coordinate not in names:
            raise unknown_name("coordinate", coil.coordinate, names, f"'{name}'")
        q = coordinates[names.index(coil.coordinate) if coil.coordinate else 0]
        current, force, electrical, extra = coil.attached(q)
        acting[q] = acting.get(q, 0) + force
        values.update(coil.parameters)
        all_units.update({k: u for k, u in _COIL_UNITS.items() if k in coil.parameters})
        if extra:
            all_units["i"] = "A"
        power = sp.Symbol("load_resistance", real=True) * current**2
        shown.update(current=current, power_mW=1000 * power)
        all_units.update(current="A", power_mW="mW")
    equations = equations_of_motion(lagrangian, coordinates, dissipation=dissipation, forces=acting)
    equations += [sp.Eq(left, right) for left, right in electrical.items()]
    return System.from_equations(
        equations,
        [*coordinates, *extra],
        parameters=values,
        units=all_units,
        bounds={**base.bounds, **_ranges(values)},
        outputs=shown,
        angles=angles,
        base=base.motion,
        period=2 * sp.pi / base.omega,
        name=name,
        description=description,
    )


def _ranges(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Masses, lengths and gaps are positive, dampers and resistances not negative, also after `with_params`."""
    limits = {}
    for name in values:
        if name.startswith(("mass", "length", "gap", "inductance")):
            limits[name] = (1e-300, math.inf)
        elif "damping" in name or "resistance" in name:
            limits[name] = (0.0, math.inf)
    return limits


_COIL_UNITS = {"k_em": "V s/m", "coil_resistance": "ohm", "load_resistance": "ohm", "inductance": "H"}
