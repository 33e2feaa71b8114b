"""Springs in parallel: one displacement, forces (that HOLD it) and energies add.

    F(q) = sum_i F_i(q),   E(q) = sum_i E_i(q)

A weight in parallel is the constant spring ``PolynomialSpring((m g,))``. A negative magnetic stiffness in parallel
with an equal positive one gives a quasi-zero-stiffness spring; a weaker one a bistable spring.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ._spring_motion import crossings
from ._springs import Spring

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["ParallelSprings"]


@dataclass(frozen=True)
class ParallelSprings(Spring):
    """Sum of springs over the same displacement; written ``first + second``.

    Parameters
    ----------
    springs : tuple of Spring
        All for translation or all for rotation.

    Examples
    --------
    >>> from stability.models import PolynomialSpring, PowerLawSpring
    >>> pair = PowerLawSpring(k1=-100.0, kn=1e6) + PolynomialSpring((0.0, 50.0))    # bistable
    >>> [round(q, 9) for q in pair.equilibria]
    [-0.007071068, 0.0, 0.007071068]
    """

    springs: tuple[Spring, ...]

    def __post_init__(self) -> None:
        if not self.springs or not all(isinstance(s, Spring) for s in self.springs):
            raise InputError("ParallelSprings: springs must be one or more springs")
        if len({s.motion for s in self.springs}) > 1:
            raise InputError("ParallelSprings: springs for translation and for rotation cannot stand in parallel")

    @property
    def motion(self) -> str:  # type: ignore[override]
        return self.springs[0].motion

    @property
    def domain(self) -> tuple[float, float]:
        return max(s.domain[0] for s in self.springs), min(s.domain[1] for s in self.springs)

    @property
    def breaks(self) -> tuple[float, ...]:
        low, high = self.domain
        return tuple(sorted({b for s in self.springs for b in s.breaks if low < b < high}))

    @property
    def odd(self) -> bool:
        return all(s.odd for s in self.springs)

    @property
    def length_scale(self) -> float:
        return max(s.length_scale for s in self.springs)

    @property
    def parameters(self) -> dict[str, float]:
        return {renamed: value for names in self._names for renamed, (_, value) in names.items()}

    @cached_property
    def _names(self) -> tuple[dict[str, tuple[str, float]], ...]:
        """For each spring: name in the sum -> (own name, value); names that occur twice get the spring's number."""
        every = [name for s in self.springs for name in s.parameters]
        return tuple(
            {(f"{n}_{i}" if every.count(n) > 1 else n): (n, v) for n, v in s.parameters.items()}
            for i, s in enumerate(self.springs, start=1)
        )

    def force(self, q: Any) -> np.ndarray:
        return np.sum([s.force(q) for s in self.springs], axis=0)[()]

    def energy(self, q: Any) -> np.ndarray:
        return np.sum([s.energy(q) for s in self.springs], axis=0)[()]

    def stiffness(self, q: Any) -> np.ndarray:
        return np.sum([s.stiffness(q) for s in self.springs], axis=0)[()]

    @cached_property
    def equilibria(self) -> tuple[float, ...]:
        """Sign changes of the force on a grid of 0.5 % steps (pairs of equilibria closer than that are not seen)."""
        low, high = self.domain
        scales = [s.length_scale for s in self.springs]
        steps = np.geomspace(1e-9 * min(scales), 1e4 * max(scales), 6400)
        special = [0.0, *self.breaks, *(q for s in self.springs for q in s.equilibria)]
        grid = np.unique(np.concatenate([-steps, steps, special]))
        if math.isfinite(low) and math.isfinite(high):
            grid = np.unique(np.concatenate([grid, np.linspace(low, high, 801)]))
        grid = grid[(grid > low) & (grid < high)]
        ordinary = grid[np.abs(grid) <= max(scales)]
        noise = 1e-14 * max(float(np.max(np.abs(s.force(ordinary)))) for s in self.springs)
        return crossings(self.force, grid, noise)

    def _sum(self, symbol: Any, symbols: Mapping[str, Any] | None, energy: bool) -> sp.Expr:
        import sympy as sp

        given = dict(symbols or {})
        self._coefficients(given)
        terms = []
        for spring, names in zip(self.springs, self._names):
            own = {name: given[renamed] for renamed, (name, _) in names.items() if renamed in given}
            terms.append(spring.energy_expression(symbol, own) if energy else spring.expression(symbol, own))
        return sp.Add(*terms)

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        return self._sum(symbol, symbols, energy=False)

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        return self._sum(symbol, symbols, energy=True)
