"""Springs given by data: measured force-displacement samples, and the table form of any smooth spring law.

Measured samples (q_i, F_i) are joined by a monotone cubic (no overshoot, C^1) or by a quintic spline (C^4, smooth
data); the energy is the exact antiderivative of the interpolant, zero at q = 0. F is the force that HOLDS q.

In equations such a spring is an opaque `Table` function: value and derivatives in every back end, outside the data
continued with the end slope. `force`, `energy`, `stiffness` refuse to leave the data.

Reference: F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ._ranges import choice, finite
from ._spring_motion import crossings
from ._springs import MOTIONS, Spring

if TYPE_CHECKING:
    import sympy as sp

    from ..systems.tables import Table

__all__ = ["OpaqueSpring", "TabulatedSpring"]


class OpaqueSpring(Spring):
    """A spring that enters equations as a `Table`; subclasses give `force_table`."""

    @property
    def force_table(self) -> Table:
        """The force as a `Table`."""
        raise NotImplementedError

    @cached_property
    def energy_table(self) -> Table:
        """Exact antiderivative of `force_table` (zero at its first breakpoint, not at q = 0)."""
        return self.force_table.antiderivative()

    @property
    def fit_error(self) -> float:
        """Largest measured difference between the table and the law, in N (N m)."""
        return float(self.force_table.fit_error)

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        self._coefficients(symbols)
        return self.force_table(symbol)

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        self._coefficients(symbols)
        return self.energy_table(symbol) - float(self.energy_table.evaluate(0.0))

    def _inside(self, q: Any) -> np.ndarray:
        """The displacements as an array; InputError with the offending value when one leaves the domain."""
        q = np.asarray(q, dtype=float)
        low, high = self.domain
        outside = ~((q >= low) & (q <= high))
        if np.any(outside):
            raise InputError(
                f"{type(self).__name__}: displacement must stay in [{low:g}, {high:g}] {self.units[0]} "
                f"({self._limit}); got {float(q[outside].flat[0]):g}"
            )
        return q

    _limit = "end of the data"


@dataclass(frozen=True)
class TabulatedSpring(OpaqueSpring):
    """A spring given by samples of force against displacement.

    Parameters
    ----------
    displacements, forces : sequences of float, (N,)
        Displacements strictly increasing and around 0; m, N (rotation: rad, N m).
    method : "monotone" or "quintic"
        "monotone" never overshoots (measured data); "quintic" has continuous derivatives (smooth data, 6 or more).
    motion : "translation" or "rotation"
    name : str
        Name of the table in printed equations.

    Raises
    ------
    InputError
        Samples not finite, not increasing, too few, or not around q = 0 (where the energy is zero).

    Examples
    --------
    >>> from stability.models import TabulatedSpring
    >>> spring = TabulatedSpring((-2e-3, -1e-3, 0.0, 1e-3, 2e-3), (-0.9, -0.4, 0.0, 0.4, 0.9))
    >>> float(spring.force(1e-3)), spring.rest
    (0.4, 0.0)
    >>> import sympy as sp
    >>> spring.expression(sp.Symbol("y", real=True))
    F_table(y)
    """

    displacements: tuple[float, ...]
    forces: tuple[float, ...]
    method: str = "monotone"
    motion: str = "translation"
    name: str = "F_table"

    def __post_init__(self) -> None:
        owner = "TabulatedSpring"
        choice(owner, "motion", self.motion, MOTIONS)
        choice(owner, "method", self.method, ("monotone", "quintic"))
        for field in ("displacements", "forces"):
            values = np.asarray(getattr(self, field)).ravel()
            object.__setattr__(self, field, tuple(finite(owner, f"{field}[{i}]", v) for i, v in enumerate(values)))
        q = self.displacements
        if len(q) != len(self.forces):
            raise InputError(f"{owner}: {len(q)} displacements but {len(self.forces)} forces")
        if len(q) < 2 or any(b <= a for a, b in pairwise(q)):
            raise InputError(f"{owner}: displacements must be two or more strictly increasing numbers")
        if not q[0] <= 0.0 <= q[-1]:
            raise InputError(f"{owner}: displacements must lie around 0 (zero energy); got [{q[0]:g}, {q[-1]:g}]")
        _ = self.force_table

    @cached_property
    def force_table(self) -> Table:
        from ..systems.tables import Table

        return Table.from_samples(self.name, self.displacements, self.forces, method=self.method)

    @property
    def domain(self) -> tuple[float, float]:
        return self.displacements[0], self.displacements[-1]

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.displacements[1:-1]

    @property
    def odd(self) -> bool:
        mirrored = tuple(-q for q in reversed(self.displacements)), tuple(-f for f in reversed(self.forces))
        return mirrored == (self.displacements, self.forces)

    def force(self, q: Any) -> np.ndarray:
        return self.force_table.evaluate(self._inside(q))

    def energy(self, q: Any) -> np.ndarray:
        return self.energy_table.evaluate(self._inside(q)) - self.energy_table.evaluate(0.0)

    def stiffness(self, q: Any) -> np.ndarray:
        return self.force_table.evaluate(self._inside(q), 1)

    @cached_property
    def equilibria(self) -> tuple[float, ...]:
        q = np.array(self.displacements)
        fine = q[:-1, None] + np.diff(q)[:, None] * np.arange(4) / 4.0  # quintic pieces may turn
        return crossings(self.force, np.unique(np.append(fine.ravel(), [0.0, q[-1]])))
