"""Mechanical and electrical oscillators are the same equations (tables 1 and 2 of the chapter, corrected).

Force-voltage analogy:   m y'' + d y' + k y = F   <->   L q'' + R q' + q/C = U0,
                         y <-> q, y' <-> i, m <-> L, d <-> R, k <-> 1/C, F <-> U0.
Force-current analogy:   y <-> flux linkage psi (y' <-> voltage u), m <-> C, d <-> 1/R, k <-> 1/L, F <-> source current.

Energies: L_mech = 1/2 m y'^2 - 1/2 k y^2 - m g y, R = 1/2 d y'^2; L_el = 1/2 L q'^2 - q^2/(2 C) + U0 q, R = 1/2 R q'^2
(the signs of the potential terms are errata of (7), (8) and of table 2).
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import sympy as sp

from ..errors import InputError
from ..systems.equations import symbol
from ..systems.system import System

__all__ = ["TRANSLATION_ROTATION", "analogue", "electrical_to_mechanical", "mechanical_to_electrical"]


@dataclass(frozen=True)
class Correspondence:
    """One row of table 1: a quantity of translation and its counterpart of rotation."""

    quantity: str
    translation: str
    translation_unit: str
    rotation: str
    rotation_unit: str


TRANSLATION_ROTATION: tuple[Correspondence, ...] = (
    Correspondence("displacement", "s", "m", "phi", "rad"),
    Correspondence("velocity", "v = ds/dt", "m/s", "omega = dphi/dt", "rad/s"),
    Correspondence("acceleration", "a = dv/dt", "m/s^2", "alpha = domega/dt", "rad/s^2"),
    Correspondence("inertia", "m", "kg", "J", "kg m^2"),
    Correspondence("force, torque", "F = m a", "N", "T = J alpha", "N m"),
    Correspondence("momentum", "p = m v", "N s", "L = J omega", "N m s"),
    Correspondence("kinetic energy", "1/2 m v^2", "J", "1/2 J omega^2", "J"),
    Correspondence("potential energy", "1/2 k s^2", "J", "1/2 c phi^2", "J"),
    Correspondence("work", "W = int F ds", "J", "W = int T dphi", "J"),
    Correspondence("power", "P = F v", "W", "P = T omega", "W"),
)

# analogy -> mechanical parameter -> (electrical parameter, whether the value is inverted)
_PAIRS = MappingProxyType({
    "force-voltage": {
        "mass": ("inductance", False), "damping": ("resistance", False),
        "stiffness": ("capacitance", True), "force": ("voltage", False),
    },
    "force-current": {
        "mass": ("capacitance", False), "damping": ("resistance", True),
        "stiffness": ("inductance", True), "force": ("current", False),
    },
})  # fmt: skip
_UNITS = MappingProxyType({"inductance": "H", "capacitance": "F", "resistance": "ohm", "voltage": "V", "current": "A"})


def _pairs(analogy: str) -> dict[str, tuple[str, bool]]:
    if analogy not in _PAIRS:
        raise InputError(f"analogy must be 'force-voltage' or 'force-current'; got {analogy!r}")
    return _PAIRS[analogy]


def _turned(name: str, value: float, inverted: bool) -> float:
    if inverted and value == 0:
        raise InputError(f"{name} = 0 has no counterpart: its inverse is infinite")
    return 1.0 / value if inverted else float(value)


def mechanical_to_electrical(
    *, mass: float, damping: float, stiffness: float, force: float = 0.0, analogy: str = "force-voltage"
) -> dict[str, float]:
    """The circuit with the equation of m y'' + d y' + k y = F.

    Parameters
    ----------
    mass, damping, stiffness, force : float
        m (kg), d (N s/m), k (N/m), F (N).
    analogy : str
        ``"force-voltage"`` (series circuit) or ``"force-current"`` (parallel circuit).

    Returns
    -------
    dict
        inductance, resistance, capacitance and voltage (or current).

    Raises
    ------
    InputError
        For another analogy, or a zero whose inverse is needed.

    Examples
    --------
    >>> import stability as st
    >>> st.models.mechanical_to_electrical(mass=2.0, damping=0.5, stiffness=4.0)["capacitance"]
    0.25
    """
    given = dict(mass=mass, damping=damping, stiffness=stiffness, force=force)
    return {new: _turned(old, given[old], inverted) for old, (new, inverted) in _pairs(analogy).items()}


def electrical_to_mechanical(
    *,
    inductance: float,
    resistance: float,
    capacitance: float,
    voltage: float = 0.0,
    current: float = 0.0,
    analogy: str = "force-voltage",
) -> dict[str, float]:
    """The mechanical oscillator with the equation of a circuit: the inverse of `mechanical_to_electrical`.

    Parameters
    ----------
    inductance, resistance, capacitance : float
        L (H), R (ohm), C (F).
    voltage, current : float
        Source voltage U0 (force-voltage) or source current (force-current).
    analogy : str
        ``"force-voltage"`` or ``"force-current"``.

    Returns
    -------
    dict
        mass, damping, stiffness, force.

    Raises
    ------
    InputError
        For another analogy, or a zero whose inverse is needed.

    Examples
    --------
    >>> import stability as st
    >>> st.models.electrical_to_mechanical(inductance=2.0, resistance=0.5, capacitance=0.25)["stiffness"]
    4.0
    """
    given = dict(
        inductance=inductance, resistance=resistance, capacitance=capacitance, voltage=voltage, current=current
    )
    return {old: _turned(new, given[new], inverted) for old, (new, inverted) in _pairs(analogy).items()}


def analogue(system: System, analogy: str = "force-voltage", coordinate: str | None = None) -> System:
    """A mechanical system written as its electrical analogue: other names, the same motion.

    ``mass*``, ``damping*``, ``stiffness*`` become inductance, resistance and 1/capacitance (force-voltage), or
    capacitance, 1/resistance and 1/inductance (force-current); numbers at the end of names are kept.

    Parameters
    ----------
    system : System
        With parameters named mass, damping, stiffness (numbered ones too).
    analogy : str
        ``"force-voltage"`` or ``"force-current"``.
    coordinate : str, optional
        New stem of the coordinate names; ``q`` (charge) or ``psi`` (flux linkage) by default.

    Returns
    -------
    System

    Raises
    ------
    InputError
        If the system has none of these parameters.

    Examples
    --------
    >>> import stability as st
    >>> st.models.analogue(st.models.linear_oscillator.from_physical(amplitude=0.001)).states
    ('q', 'q_dot')
    """
    pairs = _pairs(analogy)
    stem = coordinate or ("q" if analogy == "force-voltage" else "psi")
    swap, parameters, units = {}, {}, dict(system.units)
    for name, value in system.parameters.items():
        base = name.rstrip("0123456789")
        if base in pairs and base != "force":
            new, inverted = pairs[base]
            new += name[len(base) :]
            swap[symbol(name)] = 1 / symbol(new) if inverted else symbol(new)
            parameters[new] = _turned(name, value, inverted)
            units.pop(name, None)
            units[new] = _UNITS[new.rstrip("0123456789")]
        else:
            parameters[name] = value
    if not swap:
        raise InputError(f"'{system.name}' has no parameter mass, damping or stiffness to find an analogue for")
    count = len(system.coordinates)
    renamed = {c: stem if count == 1 else f"{stem}{i}" for i, c in enumerate(system.coordinates, start=1)}
    states = tuple(
        f"{renamed[s.removesuffix('_dot')]}_dot" if s.endswith("_dot") else renamed[s] for s in system.states
    )
    swap.update({symbol(old): symbol(new) for old, new in zip(system.states, states)})
    assert system.rhs is not None
    return system.replace(
        name=f"{system.name}, {analogy} analogue",
        coordinates=tuple(renamed[c] for c in system.coordinates),
        states=states,
        parameters=parameters,
        units={k: u for k, u in units.items() if k in parameters},
        bounds={k: b for k, b in system.bounds.items() if k in parameters},
        rhs=tuple(sp.sympify(e).xreplace(swap) for e in system.rhs),
        outputs={},
        angles=(),
    )
