"""Permanent magnets by shape and polarisation: rings, discs, blocks.

Uniform, rigid polarisation J = Br (tesla) along the axis; dipole moment m = J V/mu0 with mu0 = 1.25663706212e-6
(CODATA 2018). Each pole face is a sheet of magnetic charge; a ring's face is a disc minus a disc (`rims`). SI units.

Reference: E. P. Furlani, Permanent Magnet and Electromechanical Devices (2001), chapter 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from ._ranges import positive

__all__ = ["MU0", "BlockMagnet", "DiscMagnet", "Magnet", "RingMagnet", "checked_magnet"]

MU0 = 1.25663706212e-6


class Magnet:
    """A magnet polarised along its axis; see `RingMagnet`, `DiscMagnet`, `BlockMagnet`."""

    thickness: float
    polarization: float

    @property
    def area(self) -> float:
        """Area of a pole face, m^2."""
        raise NotImplementedError

    @property
    def size(self) -> float:
        """Largest lateral half dimension, m."""
        raise NotImplementedError

    @property
    def volume(self) -> float:
        """m^3."""
        return self.area * self.thickness

    @property
    def moment(self) -> float:
        """Dipole moment J V/mu0, A m^2."""
        return self.polarization * self.volume / MU0


@dataclass(frozen=True)
class RingMagnet(Magnet):
    """Ring, polarised along its axis.

    Parameters
    ----------
    inner_radius, outer_radius, thickness : float
        m, 0 < inner < outer, thickness > 0.
    polarization : float
        Remanence Br in T, > 0.

    Examples
    --------
    >>> from stability.models import RingMagnet
    >>> ring = RingMagnet(inner_radius=3e-3, outer_radius=6e-3, thickness=4e-3, polarization=1.2)
    >>> round(ring.moment, 4)
    0.324
    """

    inner_radius: float
    outer_radius: float
    thickness: float
    polarization: float

    def __post_init__(self) -> None:
        _all_positive(self, "inner_radius", "outer_radius", "thickness")
        if not self.inner_radius < self.outer_radius:
            raise InputError(
                f"RingMagnet: inner_radius must be below outer_radius = {self.outer_radius:g} m; "
                f"got {self.inner_radius:g} (a full disc is DiscMagnet)"
            )

    @property
    def rims(self) -> tuple[tuple[float, float], ...]:
        """(radius, sign) of the charged discs that make a pole face."""
        return (self.outer_radius, 1.0), (self.inner_radius, -1.0)

    @property
    def area(self) -> float:
        return math.pi * (self.outer_radius**2 - self.inner_radius**2)

    @property
    def size(self) -> float:
        return self.outer_radius


@dataclass(frozen=True)
class DiscMagnet(Magnet):
    """Disc or cylinder, polarised along its axis.

    Parameters
    ----------
    radius, thickness : float
        m, > 0.
    polarization : float
        Remanence Br in T, > 0.

    Examples
    --------
    >>> from stability.models import DiscMagnet
    >>> round(1e6 * DiscMagnet(radius=5e-3, thickness=3e-3, polarization=1.2).area, 2)     # mm^2
    78.54
    """

    radius: float
    thickness: float
    polarization: float

    def __post_init__(self) -> None:
        _all_positive(self, "radius", "thickness")

    @property
    def rims(self) -> tuple[tuple[float, float], ...]:
        """(radius, sign) of the charged discs that make a pole face."""
        return ((self.radius, 1.0),)

    @property
    def area(self) -> float:
        return math.pi * self.radius**2

    @property
    def size(self) -> float:
        return self.radius


@dataclass(frozen=True)
class BlockMagnet(Magnet):
    """Rectangular block, polarised along its thickness; facing blocks have parallel edges.

    Parameters
    ----------
    length, width, thickness : float
        Edges along x, y, z in m, > 0.
    polarization : float
        Remanence Br in T, > 0.

    Examples
    --------
    >>> from stability.models import BlockMagnet, MagnetPair
    >>> block = BlockMagnet(length=10e-3, width=10e-3, thickness=3e-3, polarization=1.2)
    >>> disc = block.equal_area_disc()
    >>> round(float(MagnetPair(block, block).force(12e-3) / MagnetPair(disc, disc).force(12e-3)), 3)
    0.982
    """

    length: float
    width: float
    thickness: float
    polarization: float

    def __post_init__(self) -> None:
        _all_positive(self, "length", "width", "thickness")

    @property
    def area(self) -> float:
        return self.length * self.width

    @property
    def size(self) -> float:
        return 0.5 * max(self.length, self.width)

    @property
    def half_edges(self) -> tuple[float, float, float]:
        """Half edges along x, y, z in m."""
        return 0.5 * self.length, 0.5 * self.width, 0.5 * self.thickness

    def equal_area_disc(self) -> DiscMagnet:
        """The disc of equal face area: the cheap approximation of a square block."""
        return DiscMagnet(math.sqrt(self.area / math.pi), self.thickness, self.polarization)


def _all_positive(magnet: Any, *lengths: str) -> None:
    owner = type(magnet).__name__
    for name in lengths:
        object.__setattr__(magnet, name, positive(owner, name, getattr(magnet, name), "m"))
    object.__setattr__(magnet, "polarization", positive(owner, "polarization", magnet.polarization, "T"))


def checked_magnet(owner: str, name: str, value: Any) -> Any:
    """The value, which must be a magnet."""
    if not isinstance(value, Magnet):
        raise InputError(f"{owner}: {name} must be a RingMagnet, DiscMagnet or BlockMagnet; got {value!r}")
    return value
