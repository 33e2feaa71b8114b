"""One-sided magnetic spring: a weight that floats above one fixed magnet, like poles facing.

F(y) is the force that HOLDS the displacement y (upwards) from the floating height h0; f is the repulsion of the pair.

    geometry   F = m g - f(h0 + y),  f(h0) = m g;     w^2 = -f'(h0)/m
    dipole     F = m g [1 - (h0/(h0 + y))^4];         w^2 = 4 g/h0    (far-field law, h0 an effective length)

Asymmetric, softening, upright only: upwards the weight alone brings it back, so the free motion with peak-to-peak
height H obeys  frequency < 1/(2 sqrt(2 H/g)).

Reference: catalogue sections 1 and 10; A.3 of the source chapter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..constants import GRAVITY
from ..errors import InputError
from ._magnet_pairs import MagnetPair
from ._magnet_springs import MagneticSpring
from ._magnets import Magnet, checked_magnet
from ._ranges import positive
from ._spring_motion import crossings, refine
from ._springs import Spring

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["DipoleMagnetSpring", "OneSidedMagnetSpring"]


@dataclass(frozen=True)
class OneSidedMagnetSpring(MagneticSpring):
    """A weight that floats above one fixed magnet, like poles facing; y = 0 at the floating height.

    Parameters
    ----------
    moving : RingMagnet, DiscMagnet or BlockMagnet
    mass : float
        Whole moving mass, kg, > 0.
    fixed : magnet, optional
        Default like the moving one.
    gravity : float
        m/s^2, > 0.
    travel : (float, float), optional
        Range of the table; default from 90 % of the way to contact up to four times the floating height.
    name : str

    Raises
    ------
    InputError
        A weight that the magnets cannot carry.

    Examples
    --------
    >>> from stability.models import DiscMagnet, OneSidedMagnetSpring
    >>> spring = OneSidedMagnetSpring(DiscMagnet(5e-3, 3e-3, 1.2), mass=0.020)
    >>> round(1e3 * spring.floating_gap, 3), round(spring.natural_frequency, 3)     # mm, rad/s
    (15.433, 42.959)
    """

    moving: Magnet
    mass: float
    fixed: Magnet | None = None
    gravity: float = GRAVITY
    travel: tuple[float, float] | None = None
    name: str = "F_one_sided"

    def __post_init__(self) -> None:
        owner = type(self).__name__
        checked_magnet(owner, "moving", self.moving)
        if self.fixed is not None:
            checked_magnet(owner, "fixed", self.fixed)
        object.__setattr__(self, "mass", positive(owner, "mass", self.mass, "kg"))
        object.__setattr__(self, "gravity", positive(owner, "gravity", self.gravity, "m/s^2"))
        _ = self.floating_gap
        self._check_travel()

    @cached_property
    def pair(self) -> MagnetPair:
        """The fixed and the moving magnet."""
        return MagnetPair(self.fixed or self.moving, self.moving)

    @cached_property
    def floating_gap(self) -> float:
        """Face-to-face distance h0 at which f(h0) = m g: the largest one, which is stable, m."""
        size = max(self.pair.first.size, self.pair.second.size) + self.pair.centre_offset
        gaps = np.geomspace(1e3 * size, 1e-4 * size, 400)
        surplus = self.pair.force(gaps) - self.mass * self.gravity
        if not np.any(surplus > 0.0):
            limit = float(np.max(surplus) + self.mass * self.gravity) / self.gravity
            raise InputError(
                f"OneSidedMagnetSpring: mass must be below {limit:g} kg (all these magnets carry); got {self.mass:g}"
            )
        i = int(np.flatnonzero(surplus > 0.0)[0])
        weight = self.mass * self.gravity
        return refine(lambda h: float(self.pair.force(h)) - weight, float(gaps[i]), float(gaps[i - 1]))

    @property
    def natural_frequency(self) -> float:
        """sqrt(-f'(h0)/m), rad/s."""
        return math.sqrt(float(self.stiffness(0.0)) / self.mass)

    @property
    def domain(self) -> tuple[float, float]:
        return -self.floating_gap, math.inf

    @property
    def length_scale(self) -> float:
        return self.floating_gap

    @property
    def _default_travel(self) -> tuple[float, float]:
        return -0.9 * self.floating_gap, 4.0 * self.floating_gap

    @cached_property
    def equilibria(self) -> tuple[float, ...]:
        """y = 0, and what lies below it when the force of unequal magnets turns at small gaps."""
        below = np.linspace(-0.999 * self.floating_gap, -1e-6 * self.floating_gap, 2001)
        return (*crossings(self.force, below), 0.0)

    def derivative(self, y: Any, order: int) -> np.ndarray:
        y = self._free(y)
        weight = self.mass * self.gravity if order == 0 else 0.0
        return weight - self.pair.derivative(self.floating_gap + y, order)

    def energy(self, q: Any) -> np.ndarray:
        y, h = self._free(q), self.floating_gap
        return self.mass * self.gravity * y + (self.pair.energy(h + y) - self.pair.energy(h))


@dataclass(frozen=True)
class DipoleMagnetSpring(Spring):
    """The one-sided magnetic spring in the far-field law: ``F = weight (1 - (h0/(h0 + y))^4)``, w^2 = 4 g/h0.

    Parameters
    ----------
    weight : float
        m g in N, > 0.
    floating_gap : float
        Effective height h0 of the floating position, m, > 0; contact at y = -h0.

    Examples
    --------
    >>> from stability.models import DipoleMagnetSpring
    >>> spring = DipoleMagnetSpring(weight=0.020 * 9.81, floating_gap=1.1e-3)
    >>> round(float(spring.backbone(0.0, 0.020)) / (2 * 3.141592653589793), 2)     # Hz
    30.06
    """

    weight: float
    floating_gap: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "weight", positive("DipoleMagnetSpring", "weight", self.weight, "N"))
        object.__setattr__(self, "floating_gap", positive("DipoleMagnetSpring", "floating_gap", self.floating_gap, "m"))

    @property
    def parameters(self) -> dict[str, float]:
        return {"weight": self.weight, "h0": self.floating_gap}

    @property
    def domain(self) -> tuple[float, float]:
        return -self.floating_gap, math.inf

    @property
    def length_scale(self) -> float:
        return self.floating_gap

    @property
    def equilibria(self) -> tuple[float, ...]:
        return (0.0,)

    def _ratio(self, y: Any) -> tuple[np.ndarray, np.ndarray]:
        y = np.asarray(y, dtype=float)
        if np.any(~(y > -self.floating_gap)):
            raise InputError(f"DipoleMagnetSpring: displacement must be > {-self.floating_gap:g} m (contact)")
        return y, self.floating_gap / (self.floating_gap + y)

    def force(self, q: Any) -> np.ndarray:
        return self.weight * (1.0 - self._ratio(q)[1] ** 4)

    def energy(self, q: Any) -> np.ndarray:
        y, ratio = self._ratio(q)
        return self.weight * (y + self.floating_gap * (ratio**3 - 1.0) / 3.0)

    def stiffness(self, q: Any) -> np.ndarray:
        return 4.0 * self.weight / self.floating_gap * self._ratio(q)[1] ** 5

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        weight, h = self._coefficients(symbols).values()
        return weight * (1 - (h / (h + symbol)) ** 4)

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        weight, h = self._coefficients(symbols).values()
        return weight * (symbol + h * ((h / (h + symbol)) ** 3 - 1) / 3)
