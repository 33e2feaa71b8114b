"""Axial forces between two permanent magnets, from their geometry.

Uniform, rigid polarisation J = Br (T) along the axis: each pole face is a sheet of magnetic charge +-J (charge model).
For coaxial magnets of thickness t1, t2, face-to-face distance g, and radii r with sign s (outer +, hole -)

    f(g) = +-(pi J1 J2/mu0) sum_{r1, r2} s1 s2 [S(g) - S(g + t1) - S(g + t2) + S(g + t1 + t2)],   S = S_0(r1, r2, z)

with S_0 the disc integral of `kernels.coaxial_discs` (quadrature, with derivatives and energy), or its closed form in
complete elliptic integrals (`kernels.coaxial_cylinders`). Blocks: sum of Akoun and Yonnet (`kernels.block_magnets`).

Sign: f > 0 pushes the magnets apart. Like poles facing (antiparallel J) repel from afar, unlike poles attract.
Energy W(g) = int_g^inf f, zero at infinite distance. Far away f -> 3 mu0 m1 m2/(2 pi z^4), m = J V/mu0, z between
centres.

References: E. P. Furlani, Permanent Magnet and Electromechanical Devices (2001); D. Vokoun et al., JMMM 321 (2009)
3758; W. Robertson et al., IEEE Trans. Magn. 47 (2011) 2045; G. Akoun and J.-P. Yonnet, IEEE Trans. Magn. 20
(1984) 1962.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..kernels.block_magnets import block_interaction
from ..kernels.coaxial_cylinders import cylinder_faces
from ..kernels.coaxial_discs import charged_discs
from ._magnets import MU0, BlockMagnet, RingMagnet, checked_magnet
from ._ranges import choice

__all__ = ["MagnetPair"]

FACING = ("like", "unlike")
NARROWEST = 1e-8  # gap or clearance over radius below which magnets count as touching


@dataclass(frozen=True)
class MagnetPair:
    """Two magnets on one axis: force, derivatives and energy against their face-to-face gap.

    Parameters
    ----------
    first, second : RingMagnet or DiscMagnet, or two BlockMagnet
    facing : "like" or "unlike"
        Poles that face each other: like repel from afar, unlike attract.

    Raises
    ------
    InputError
        A ring with a block; a gap at which the magnets touch. A magnet that fits into the other's hole may have any gap
        (the mid-planes coincide at ``-(t1 + t2)/2``).

    Notes
    -----
    Accuracy: charge model and closed form agree to 1e-13 for gaps up to two radii and to 1e-12 up to three; further
    out the closed form loses digits (4e-9 at 16 radii), the charge model does not. Blocks lose (gap/edge)^6 in units of
    1e-16.

    Examples
    --------
    >>> from stability.models import DiscMagnet, MagnetPair
    >>> pair = MagnetPair(DiscMagnet(5e-3, 3e-3, 1.2), DiscMagnet(5e-3, 3e-3, 1.2))
    >>> round(float(pair.force(12e-3)), 6), round(float(pair.far_field(12e-3) / pair.force(12e-3)), 3)
    (0.392989, 1.527)
    """

    first: Any
    second: Any
    facing: str = "like"

    def __post_init__(self) -> None:
        choice("MagnetPair", "facing", self.facing, FACING)
        for name in ("first", "second"):
            checked_magnet("MagnetPair", name, getattr(self, name))
        if isinstance(self.first, BlockMagnet) != isinstance(self.second, BlockMagnet):
            raise InputError(
                "MagnetPair: first and second must both be blocks, or neither; or use block.equal_area_disc()"
            )

    @property
    def nested(self) -> bool:
        """Whether one magnet fits into the hole of the other."""
        holes = [(a, b) for a, b in ((self.first, self.second), (self.second, self.first)) if isinstance(a, RingMagnet)]
        return not self.blocks and any(b.size < (1.0 - NARROWEST) * a.inner_radius for a, b in holes)

    @property
    def blocks(self) -> bool:
        """Whether the magnets are blocks."""
        return isinstance(self.first, BlockMagnet)

    @property
    def centre_offset(self) -> float:
        """Distance of the centres at gap 0, m."""
        return 0.5 * (self.first.thickness + self.second.thickness)

    @property
    def _factor(self) -> float:
        return (1.0 if self.facing == "like" else -1.0) * self.first.polarization * self.second.polarization / MU0

    def _gaps(self, gap: Any) -> np.ndarray:
        values = np.asarray(gap, dtype=float)
        limit = -math.inf if self.nested else NARROWEST * max(self.first.size, self.second.size)
        bad = ~(np.isfinite(values) & (values > limit))
        if np.any(bad):
            allowed = "finite" if self.nested else f"finite and > {limit:g} m, else the magnets touch"
            raise InputError(f"MagnetPair: gap must be {allowed}; got {float(values[bad].flat[0]):g}")
        return values

    def _disc_sum(self, gap: np.ndarray, order: int) -> np.ndarray:
        t1, t2 = self.first.thickness, self.second.thickness
        flat = gap.ravel()
        faces = np.concatenate([flat, flat + t1, flat + t2, flat + t1 + t2])
        total = np.zeros(flat.shape)
        for r1, s1 in self.first.rims:
            for r2, s2 in self.second.rims:
                part = charged_discs(r1, r2, faces, order).reshape(4, -1)
                total += s1 * s2 * ((part[0] - part[1]) - (part[2] - part[3]))
        return math.pi * self._factor * total.reshape(gap.shape)[()]

    def _block_sum(self, gap: np.ndarray, order: int) -> np.ndarray:
        z = gap + self.centre_offset
        total = block_interaction(self.first.half_edges, self.second.half_edges, (0.0, 0.0), z, order)
        return self._factor / (4.0 * math.pi) * total[()]

    def _closed_form(self, gap: np.ndarray) -> np.ndarray:
        t1, t2 = self.first.thickness, self.second.thickness
        total = np.zeros(gap.shape)
        for r1, s1 in self.first.rims:
            for r2, s2 in self.second.rims:
                for z, sign in ((gap, 1.0), (gap + t1, -1.0), (gap + t2, -1.0), (gap + t1 + t2, 1.0)):
                    total = total - 0.5 * s1 * s2 * sign * cylinder_faces(r1, r2, z)
        return self._factor * total[()]

    def force(self, gap: Any, method: str | None = None) -> np.ndarray:
        """Axial force at face-to-face distances `gap` (m, any shape), N; > 0 pushes apart.

        `method` is "charge model" (rings and discs, the default) or "closed form" (rings and discs: elliptic integrals;
        blocks: the only one).
        """
        values = self._gaps(gap)
        allowed = ("closed form",) if self.blocks else ("charge model", "closed form")
        if choice("MagnetPair", "method", method or allowed[0], allowed) == "closed form" and not self.blocks:
            return self._closed_form(values)
        return self.derivative(values, 0)

    def derivative(self, gap: Any, order: int = 1) -> np.ndarray:
        """Derivative of the force with respect to the gap, order 0 to 3, N/m^order."""
        if order not in (0, 1, 2, 3):
            raise InputError(f"MagnetPair: order must be 0, 1, 2 or 3; got {order!r}")
        values = self._gaps(gap)
        return self._block_sum(values, order + 1) if self.blocks else self._disc_sum(values, order)

    def energy(self, gap: Any) -> np.ndarray:
        """Work needed to bring the magnets from far away to `gap`, J: ``int_gap^inf f``."""
        values = self._gaps(gap)
        return -self._block_sum(values, 0) if self.blocks else self._disc_sum(values, -1)

    def far_field(self, gap: Any) -> np.ndarray:
        """Dipole law ``3 mu0 m1 m2/(2 pi z^4)`` with z the distance of the centres; the limit for large gaps."""
        z = self._gaps(gap) + self.centre_offset
        sign = math.copysign(1.0, self._factor)
        return sign * 3.0 * MU0 * self.first.moment * self.second.moment / (2.0 * math.pi * z**4)
