"""Rotational magnetic spring: a magnet rotor in a salient iron stator, as a Fourier series over one turn.

    T(phi) = sum_n T_n sin(n p phi + d_n),     E(phi) = sum_n T_n/(n p) [cos d_n - cos(n p phi + d_n)],   n >= 1

T is the torque that HOLDS the angle phi (the torque on the rotor is -T), p the number of pole pairs. There is no
constant term: it would not be conservative over a turn, int_0^{2 pi} T dphi = 0. Two-pole reluctance: T_2 sin 2 phi
(+ T_4 sin 4 phi), stable at phi = 0 for 2 T_2 + 4 T_4 > 0; `about` measures the angle from another position, for
example the unstable equilibrium pi/2. Unsymmetric: T_1 sin(phi + d) added.

Reference: catalogue section 1; equation (5) of the source chapter for the sign.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ._ranges import finite
from ._spring_motion import crossings
from ._springs import Spring

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["RotationalMagneticSpring"]


@dataclass(frozen=True)
class RotationalMagneticSpring(Spring):
    """Torque ``sum_n T_n sin(n p phi + d_n)``.

    Parameters
    ----------
    torques : mapping int -> float
        T_n in N m by harmonic n >= 1 (kept as sorted pairs).
    phases : mapping int -> float, optional
        d_n in rad; missing ones 0.
    pole_pairs : int
        p >= 1.

    Raises
    ------
    InputError
        Harmonic 0 (a constant torque is not conservative over a turn), no harmonic, a phase without torque.

    Examples
    --------
    >>> from stability.models import RotationalMagneticSpring
    >>> spring = RotationalMagneticSpring({2: 1e-2, 4: -1e-3})
    >>> round(float(spring.stiffness(0.0)), 6), [round(q, 6) for q in spring.escape]
    (0.016, [-1.570796, 1.570796])
    >>> round(float(spring.about(3.141592653589793 / 2).stiffness(0.0)), 6)      # unstable position
    -0.024
    """

    torques: Any
    phases: Any = ()
    pole_pairs: int = 1
    motion = "rotation"

    def __post_init__(self) -> None:
        owner = "RotationalMagneticSpring"
        torques, phases = dict(self.torques), dict(self.phases)
        if not torques:
            raise InputError(f"{owner}: torques must give at least one harmonic, as {{2: 1e-2}}")
        for n in [*torques, *phases]:
            if isinstance(n, bool) or not isinstance(n, int) or n < 1:
                raise InputError(
                    f"{owner}: harmonics must be integers >= 1; got {n!r} "
                    "(a constant torque is not conservative over a turn)"
                )
        if set(phases) - set(torques):
            raise InputError(f"{owner}: phases has harmonic {min(set(phases) - set(torques))}, which has no torque")
        if isinstance(self.pole_pairs, bool) or not isinstance(self.pole_pairs, int) or self.pole_pairs < 1:
            raise InputError(f"{owner}: pole_pairs must be an integer >= 1; got {self.pole_pairs!r}")
        pairs = tuple((n, finite(owner, f"torques[{n}]", torques[n])) for n in sorted(torques))
        angles = tuple((n, finite(owner, f"phases[{n}]", phases[n])) for n in sorted(phases) if phases[n])
        object.__setattr__(self, "torques", pairs)
        object.__setattr__(self, "phases", angles)

    @cached_property
    def _harmonics(self) -> tuple[tuple[int, float, float], ...]:
        """(n p, T_n, d_n)."""
        phases = dict(self.phases)
        return tuple((n * self.pole_pairs, torque, phases.get(n, 0.0)) for n, torque in self.torques)

    def about(self, angle: float) -> RotationalMagneticSpring:
        """The same spring with its angle measured from `angle` (rad)."""
        angle = finite("RotationalMagneticSpring", "angle", angle)
        return replace(self, phases={k // self.pole_pairs: d + k * angle for k, _, d in self._harmonics})

    @property
    def odd(self) -> bool:
        return not self.phases

    @property
    def parameters(self) -> dict[str, float]:
        return {f"T{n}": torque for n, torque in self.torques}

    def force(self, q: Any) -> np.ndarray:
        """Torque that holds the angle `q`, N m."""
        q = np.asarray(q, dtype=float)
        return sum((t * np.sin(k * q + d) for k, t, d in self._harmonics), np.zeros_like(q))[()]

    def energy(self, q: Any) -> np.ndarray:
        q = np.asarray(q, dtype=float)
        return sum((t / k * (math.cos(d) - np.cos(k * q + d)) for k, t, d in self._harmonics), np.zeros_like(q))[()]

    def stiffness(self, q: Any) -> np.ndarray:
        q = np.asarray(q, dtype=float)
        return sum((t * k * np.cos(k * q + d) for k, t, d in self._harmonics), np.zeros_like(q))[()]

    @cached_property
    def equilibria(self) -> tuple[float, ...]:
        """Those within one turn to either side of phi = 0."""
        steps = 256 * max(h[0] for h in self._harmonics)
        found = crossings(self.force, 2.0 * math.pi * np.arange(-steps, steps + 1) / steps)
        merged: list[float] = []
        for q in found:
            if not merged or q - merged[-1] > 1e-9:
                merged.append(q)
        return tuple(merged)

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        import sympy as sp

        values = self._coefficients(symbols).values()
        return sp.Add(*(c * sp.sin(k * symbol + d) for c, (k, _, d) in zip(values, self._harmonics)))

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        import sympy as sp

        terms = zip(self._coefficients(symbols).values(), self._harmonics)
        return sp.Add(*(c * (sp.cos(sp.Float(d)) - sp.cos(k * symbol + d)) / k for c, (k, _, d) in terms))
