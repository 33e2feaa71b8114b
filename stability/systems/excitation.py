"""Base excitation: y0 = A cos(w t) at constant amplitude A, or at constant acceleration amplitude A w^2.

A shaker runs at constant acceleration, so that A(w) = acceleration/w^2 changes along a sweep; a crank runs at constant
amplitude. A system that declares its `BaseMotion` can be turned from one into the other, exactly: the parameter is
replaced in the equations, so that derivatives with respect to the frequency contain the change of A.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import InputError

if TYPE_CHECKING:
    from .system import System

__all__ = ["BaseMotion", "ConstantAcceleration", "ConstantAmplitude", "Excitation"]


@dataclass(frozen=True)
class BaseMotion:
    """How a system's equations contain its base motion.

    Parameters
    ----------
    parameter : str
        ``"amplitude"`` (A, m) or ``"acceleration"`` (A w^2, m/s^2): the parameter that is in the equations now.
    angular_frequency : sympy expression
        w in the system's parameters, e.g. 2 pi ``frequency``.
    """

    parameter: str
    angular_frequency: Any

    def __post_init__(self) -> None:
        if self.parameter not in ("amplitude", "acceleration"):
            raise InputError(f"a base motion has the parameter 'amplitude' or 'acceleration'; got '{self.parameter}'")


@dataclass(frozen=True)
class Excitation:
    """Base class of the excitations that `System.with_excitation` takes."""

    @property
    def _target(self) -> tuple[str, float, str]:
        raise TypeError("use ConstantAmplitude or ConstantAcceleration")

    def applied_to(self, system: System) -> System:
        """The system with this excitation (see `System.with_excitation`)."""
        from .equations import symbol

        name, value, unit = self._target
        if system.base is None:
            raise InputError(
                f"'{system.name}' declares no base motion, so its excitation cannot be exchanged; "
                "build it with its model's from_physical(...)"
            )
        old = system.base.parameter
        if old == name:
            return system.with_params(**{name: value})
        w2 = system.base.angular_frequency**2
        new_in_old = symbol(name) / w2 if name == "acceleration" else symbol(name) * w2
        swap = {symbol(old): new_in_old}

        def changed(e: Any) -> Any:
            return e.xreplace(swap) if hasattr(e, "xreplace") else e

        parameters = {(name if k == old else k): (value if k == old else v) for k, v in system.parameters.items()}
        units = {(name if k == old else k): (unit if k == old else u) for k, u in system.units.items()}
        return system.replace(
            parameters=parameters,
            units={**units, name: unit},
            bounds={k: b for k, b in system.bounds.items() if k != old},
            orders={(name if k == old else k): o for k, o in system.orders.items()},
            rhs=None if system.rhs is None else tuple(changed(e) for e in system.rhs),
            outputs={k: changed(e) for k, e in system.outputs.items()},
            base=BaseMotion(name, system.base.angular_frequency),
        )


@dataclass(frozen=True)
class ConstantAmplitude(Excitation):
    """Base motion y0 = A cos(w t) whose amplitude A stays the same at every frequency.

    Parameters
    ----------
    amplitude : float
        A in m.

    Examples
    --------
    >>> import stability as st
    >>> st.ConstantAmplitude(0.001).amplitude
    0.001
    """

    amplitude: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.amplitude) and self.amplitude >= 0):
            raise InputError(f"amplitude must be finite and not negative; got {self.amplitude}")

    @property
    def _target(self) -> tuple[str, float, str]:
        return "amplitude", float(self.amplitude), "m"


@dataclass(frozen=True)
class ConstantAcceleration(Excitation):
    """Base motion whose acceleration amplitude A w^2 stays the same at every frequency, as on a shaker.

    Parameters
    ----------
    acceleration : float
        A w^2 in m/s^2.

    Examples
    --------
    >>> import stability as st
    >>> st.ConstantAcceleration(0.5*9.81).acceleration
    4.905
    """

    acceleration: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.acceleration) and self.acceleration >= 0):
            raise InputError(f"acceleration must be finite and not negative; got {self.acceleration}")

    @property
    def _target(self) -> tuple[str, float, str]:
        return "acceleration", float(self.acceleration), "m/s^2"
