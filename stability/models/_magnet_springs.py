"""Symmetric magnetic springs: levitated between two magnets, nested in a ring.

F(y) is the force that HOLDS the displacement y (upwards) of the moving magnet; f is the repulsion of a pair
(`MagnetPair`), W its energy.

    levitated   F = f_u(gap_u - y) - f_l(gap_l + y);  equal sides: odd, hardening,
                k1 = -2 f'(gap), k3 = -f'''(gap)/3
    nested      F = -f(y), y between mid-planes;      f changes sign: bistable (unlike), or an escape (like)

In equations they are `Table` functions: a quintic spline of F over `travel`, its error measured against F (`fit_error`,
relative tolerance 1e-10), its energy the exact antiderivative.

Reference: catalogue section 1; equations of the pair force in the module `_magnet_pairs`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ._magnet_pairs import MagnetPair
from ._magnets import Magnet, RingMagnet, checked_magnet
from ._ranges import finite, positive
from ._spring_motion import crossings
from ._spring_tables import OpaqueSpring

if TYPE_CHECKING:
    from ..systems.tables import Table

__all__ = ["LevitatedMagnetSpring", "MagneticSpring", "NestedRingSpring"]


class MagneticSpring(OpaqueSpring):
    """A smooth spring law with three derivatives; subclasses give `derivative`, `energy` and `domain`."""

    travel: tuple[float, float] | None
    name: str
    _limit = "where the magnets touch"

    def derivative(self, y: Any, order: int) -> np.ndarray:
        """Derivative of the force, order 0 (the force) to 3."""
        raise NotImplementedError

    def force(self, q: Any) -> np.ndarray:
        return self.derivative(q, 0)

    def stiffness(self, q: Any) -> np.ndarray:
        return self.derivative(q, 1)

    @property
    def _default_travel(self) -> tuple[float, float]:
        raise NotImplementedError

    @cached_property
    def force_table(self) -> Table:
        from ..systems.tables import Table

        return Table.from_function(self.name, self.force, self.travel or self._default_travel, tolerance=1e-10)

    @property
    def taylor(self) -> tuple[float, float, float, float]:
        """(k0, k1, k2, k3) of F = k0 + k1 y + k2 y^2 + k3 y^3 + ... about y = 0."""
        values = [float(self.derivative(0.0, order)) for order in range(4)]
        return values[0], values[1], values[2] / 2.0, values[3] / 6.0

    @cached_property
    def equilibria(self) -> tuple[float, ...]:
        """Sign changes of the force on 2001 points of `travel` (extended towards contact)."""
        low, high = self._default_travel
        inside = [d for d in self.domain if math.isfinite(d)]
        grid = np.unique(np.concatenate([np.linspace(low, high, 2001), 0.999 * np.array(inside), [0.0]]))
        return crossings(self.force, grid)

    def _check_travel(self) -> None:
        if self.travel is None:
            return
        owner = type(self).__name__
        low, high = (finite(owner, f"travel[{i}]", v) for i, v in enumerate(self.travel))
        if not self.domain[0] < low < 0.0 < high < self.domain[1]:
            a, b = self.domain
            raise InputError(f"{owner}: travel must lie around 0 inside ({a:g}, {b:g}) m; got ({low:g}, {high:g})")
        object.__setattr__(self, "travel", (low, high))

    def _free(self, y: Any) -> np.ndarray:
        """Displacements strictly inside the domain."""
        values = self._inside(y)
        if np.any((values == self.domain[0]) | (values == self.domain[1])):
            low, high = self.domain
            owner = type(self).__name__
            raise InputError(f"{owner}: displacement must stay inside ({low:g}, {high:g}) m ({self._limit})")
        return values


@dataclass(frozen=True)
class LevitatedMagnetSpring(MagneticSpring):
    """A magnet between two fixed ones, like poles facing: the hardening magnetic spring.

    Parameters
    ----------
    moving : RingMagnet, DiscMagnet or BlockMagnet
    gap : float
        Face-to-face distance to the lower magnet at y = 0, m, > 0.
    upper_gap : float, optional
        Distance to the upper magnet; default the same.
    lower, upper : magnets, optional
        The fixed magnets; default like the moving one.
    travel : (float, float), optional
        Range of the table used in equations; default 90 % of the way to contact.
    name : str
        Name of the table in printed equations.

    Gravity is not included: add a weight in parallel.

    Examples
    --------
    >>> from stability.models import LevitatedMagnetSpring, RingMagnet
    >>> spring = LevitatedMagnetSpring(RingMagnet(3e-3, 6e-3, 4e-3, 1.2), gap=12e-3)
    >>> round(spring.taylor[1], 1), round(spring.taylor[3] / 1e6, 2)     # k1 in N/m, k3 in 1e6 N/m^3
    (189.2, 1.87)
    """

    moving: Magnet
    gap: float
    upper_gap: float | None = None
    lower: Magnet | None = None
    upper: Magnet | None = None
    travel: tuple[float, float] | None = None
    name: str = "F_levitated"

    def __post_init__(self) -> None:
        owner = type(self).__name__
        for name in ("moving", "lower", "upper"):
            if name == "moving" or getattr(self, name) is not None:
                checked_magnet(owner, name, getattr(self, name))
        object.__setattr__(self, "gap", positive(owner, "gap", self.gap, "m"))
        if self.upper_gap is not None:
            object.__setattr__(self, "upper_gap", positive(owner, "upper_gap", self.upper_gap, "m"))
        _ = self._pairs
        self._check_travel()

    @cached_property
    def _pairs(self) -> tuple[MagnetPair, MagnetPair]:
        lower = self.lower or self.moving
        return MagnetPair(lower, self.moving), MagnetPair(self.upper or lower, self.moving)

    @property
    def _gaps(self) -> tuple[float, float]:
        return self.gap, self.gap if self.upper_gap is None else self.upper_gap

    @property
    def domain(self) -> tuple[float, float]:
        return -self._gaps[0], self._gaps[1]

    @property
    def _default_travel(self) -> tuple[float, float]:
        return -0.9 * self._gaps[0], 0.9 * self._gaps[1]

    @property
    def odd(self) -> bool:
        return self._pairs[0] == self._pairs[1] and self._gaps[0] == self._gaps[1]

    def derivative(self, y: Any, order: int) -> np.ndarray:
        y = self._free(y)
        (lower, upper), (below, above) = self._pairs, self._gaps
        return (-1.0) ** order * upper.derivative(above - y, order) - lower.derivative(below + y, order)

    def energy(self, q: Any) -> np.ndarray:
        y = self._free(q)
        (lower, upper), (below, above) = self._pairs, self._gaps
        rise = upper.energy(above - y) - upper.energy(above)
        return rise + (lower.energy(below + y) - lower.energy(below))


@dataclass(frozen=True)
class NestedRingSpring(MagneticSpring):
    """A disc or ring that moves through the hole of a fixed ring; y = 0 where the mid-planes coincide.

    Parameters
    ----------
    inner : DiscMagnet or RingMagnet
        Must fit into the hole.
    outer : RingMagnet
    facing : "unlike" or "like"
        "unlike" (parallel polarisation): pushed out of the centre, two stable positions outside: bistable, and
        quasi-zero-stiffness with `quasi_zero_support` in parallel. "like" (antiparallel): held at the centre, escapes.
    travel : (float, float), optional
        Range of the table; default three outer radii plus thicknesses to either side.
    name : str

    Examples
    --------
    >>> from stability.models import DiscMagnet, NestedRingSpring, RingMagnet
    >>> spring = NestedRingSpring(DiscMagnet(2e-3, 3e-3, 1.2), RingMagnet(4e-3, 8e-3, 3e-3, 1.2))
    >>> [round(1e3 * y, 3) for y in spring.equilibria]                 # mm
    [-7.156, 0.0, 7.156]
    """

    inner: Magnet
    outer: Magnet
    facing: str = "unlike"
    travel: tuple[float, float] | None = None
    name: str = "F_nested"

    def __post_init__(self) -> None:
        for name in ("inner", "outer"):
            checked_magnet("NestedRingSpring", name, getattr(self, name))
        if not (isinstance(self.outer, RingMagnet) and self.pair.nested):
            hole = getattr(self.outer, "inner_radius", 0.0)
            raise InputError(
                f"NestedRingSpring: inner must fit into the hole of the ring outer, radius below {hole:g} m; "
                f"got {self.inner.size:g}"
            )
        self._check_travel()

    @cached_property
    def pair(self) -> MagnetPair:
        """The fixed ring and the moving magnet."""
        return MagnetPair(self.outer, self.inner, self.facing)

    @property
    def _default_travel(self) -> tuple[float, float]:
        reach = 3.0 * (self.outer.size + self.pair.centre_offset)
        return -reach, reach

    @property
    def length_scale(self) -> float:
        return self.outer.size

    @property
    def odd(self) -> bool:
        return True

    @property
    def quasi_zero_support(self) -> float:
        """Stiffness that cancels k1 when put in parallel, N/m; positive for unlike poles."""
        return -float(self.stiffness(0.0))

    def derivative(self, y: Any, order: int) -> np.ndarray:
        return -self.pair.derivative(np.asarray(y, dtype=float) - self.pair.centre_offset, order)

    def energy(self, q: Any) -> np.ndarray:
        offset = self.pair.centre_offset
        return self.pair.energy(np.asarray(q, dtype=float) - offset) - self.pair.energy(-offset)
