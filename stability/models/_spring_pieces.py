"""Springs made of pieces: stops, play, bilinear springs, and the spring that only pushes.

Between breakpoints b_1 < ... < b_m the force is a polynomial of the displacement itself (not of the distance to the
breakpoint); the force that HOLDS q is

    F(q) = sum_j c[k][j] q^j   for b_k <= q < b_{k+1},   b_0 = -inf, b_{m+1} = +inf,      E(s) = int_0^s F dq.

E is continuous even where F jumps. The unilateral spring touches its load on one side only:

    F = k1 q + k3 q^3 for q < 0,   0 for q > 0        (side="negative"; the mirror image for side="positive").

Reference: catalogue section 1; A.3 of the source chapter ("continuous piecewise functions").
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ._ranges import choice, finite
from ._spring_motion import real_roots
from ._springs import MOTIONS, Spring

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["PiecewiseSpring", "UnilateralSpring"]

_poly = np.polynomial.polynomial


@dataclass(frozen=True)
class PiecewiseSpring(Spring):
    """Polynomial force between breakpoints; the value at a breakpoint is that of the piece to its right.

    Parameters
    ----------
    breakpoints : sequence of float, (m,)
        Strictly increasing, m or rad.
    pieces : sequence of sequences, (m + 1,)
        Coefficients of each piece in powers of the displacement, lowest first, from left to right.
    motion : "translation" or "rotation"

    Examples
    --------
    >>> from stability.models import PiecewiseSpring
    >>> play = PiecewiseSpring.from_stiffness((-1e-3, 1e-3), (2e4, 0.0, 2e4))
    >>> [round(float(f), 12) for f in play.force([-2e-3, 0.5e-3, 3e-3])]
    [-20.0, 0.0, 40.0]
    >>> play.rest, play.odd
    (0.0, True)
    """

    breakpoints: tuple[float, ...]
    pieces: tuple[tuple[float, ...], ...]
    motion: str = "translation"

    def __post_init__(self) -> None:
        owner = "PiecewiseSpring"
        choice(owner, "motion", self.motion, MOTIONS)
        breaks = tuple(finite(owner, f"breakpoints[{i}]", b) for i, b in enumerate(self.breakpoints))
        if not breaks or any(b <= a for a, b in pairwise(breaks)):
            raise InputError(f"{owner}: breakpoints must be one or more strictly increasing numbers; got {breaks}")
        if len(self.pieces) != len(breaks) + 1:
            needed = len(breaks) + 1
            raise InputError(f"{owner}: {needed - 1} breakpoints need {needed} pieces; got {len(self.pieces)}")
        pieces = []
        for k, piece in enumerate(self.pieces):
            values = tuple(finite(owner, f"pieces[{k}][{j}]", c) for j, c in enumerate(piece))
            pieces.append(values or (0.0,))
        object.__setattr__(self, "breakpoints", breaks)
        object.__setattr__(self, "pieces", tuple(pieces))

    @classmethod
    def from_stiffness(
        cls, breakpoints: Sequence[float], stiffness: Sequence[float], motion: str = "translation"
    ) -> PiecewiseSpring:
        """Continuous, piecewise linear, F(0) = 0: one stiffness more than there are breakpoints."""
        if len(stiffness) != len(breakpoints) + 1:
            raise InputError(
                f"PiecewiseSpring: {len(breakpoints)} breakpoints need {len(breakpoints) + 1} stiffnesses; "
                f"got {len(stiffness)}"
            )
        offsets = np.concatenate([[0.0], np.cumsum(-np.diff(stiffness) * np.asarray(breakpoints, dtype=float))])
        home = int(np.searchsorted(np.asarray(breakpoints, dtype=float), 0.0, side="right"))
        pieces = tuple((float(c), float(k)) for c, k in zip(offsets - offsets[home], stiffness))
        return cls(tuple(breakpoints), pieces, motion)

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.breakpoints

    @property
    def jumps(self) -> tuple[float, ...]:
        """Jump of the force at each breakpoint (0 up to round-off for a continuous spring)."""
        sides = zip(self.breakpoints, self.pieces, self.pieces[1:])
        return tuple(float(_poly.polyval(b, right) - _poly.polyval(b, left)) for b, left, right in sides)

    @cached_property
    def odd(self) -> bool:
        if any(a != -b for a, b in zip(self.breakpoints, reversed(self.breakpoints))):
            return False
        signs = [np.array([c * (-1.0) ** (j + 1) for j, c in enumerate(piece)]) for piece in reversed(self.pieces)]
        mirrored = (np.trim_zeros(s, "b") for s in signs)
        return all(np.array_equal(np.trim_zeros(np.array(p), "b"), m) for p, m in zip(self.pieces, mirrored))

    @property
    def length_scale(self) -> float:
        return max(abs(b) for b in self.breakpoints) or 1.0

    @cached_property
    def _antiderivatives(self) -> tuple[np.ndarray, ...]:
        """Energy polynomials, continuous at the breakpoints and zero at q = 0."""
        raw = [_poly.polyint(piece) for piece in self.pieces]
        constants = [0.0]
        for b, left, right in zip(self.breakpoints, raw, raw[1:]):
            constants.append(constants[-1] + float(_poly.polyval(b, left) - _poly.polyval(b, right)))
        home = constants[int(np.searchsorted(self.breakpoints, 0.0, side="right"))]
        for polynomial, constant in zip(raw, constants):
            polynomial[0] += constant - home
        return tuple(raw)

    def _evaluate(self, q: Any, polynomials: Sequence[Any]) -> np.ndarray:
        q = np.asarray(q, dtype=float)
        piece = np.searchsorted(self.breakpoints, q, side="right")
        values = np.empty(q.shape)
        for k, polynomial in enumerate(polynomials):
            mask = piece == k
            values[mask] = _poly.polyval(q[mask], polynomial)
        return values[()]

    def force(self, q: Any) -> np.ndarray:
        return self._evaluate(q, self.pieces)

    def energy(self, q: Any) -> np.ndarray:
        return self._evaluate(q, self._antiderivatives)

    def stiffness(self, q: Any) -> np.ndarray:
        """Slope of the piece (a jump of the force at a breakpoint has none and is left out)."""
        return self._evaluate(q, [_poly.polyder(piece) for piece in self.pieces])

    @cached_property
    def equilibria(self) -> tuple[float, ...]:
        ends = (-math.inf, *self.breakpoints, math.inf)
        near = 1e-12 * self.length_scale  # round-off of a zero that lies on a breakpoint
        found = [b for b, jump in zip(self.breakpoints, self.jumps) if self._straddles(b, jump)]
        dead: list[tuple[float, float]] = []
        for (low, high), piece in zip(pairwise(ends), self.pieces):
            if not any(piece):
                dead.append((low, high))
            found += [r for r in real_roots(piece) if low - near <= r <= high + near]
        zeros: list[float] = []
        for zero in sorted(found):
            in_dead_zone = any(low - near <= zero <= high + near for low, high in dead)
            if not in_dead_zone and not (zeros and zero - zeros[-1] <= near):
                zeros.append(zero)
        finite_zones = [z for z in dead if math.isfinite(z[0]) and math.isfinite(z[1])]
        zeros += [0.0 if low <= 0.0 <= high else 0.5 * (low + high) for low, high in finite_zones]  # counts once
        return tuple(sorted(zeros))

    def _straddles(self, breakpoint: float, jump: float) -> bool:
        right = float(self.force(breakpoint))
        return right * (right - jump) < 0.0

    def _piecewise(self, symbol: Any, polynomials: Sequence[Any]) -> sp.Expr:
        import sympy as sp

        branches = [sp.Add(*(sp.Float(c) * symbol**j for j, c in enumerate(p) if c)) for p in polynomials]
        conditions = [symbol < sp.Float(b) for b in self.breakpoints]
        return sp.Piecewise(*zip(branches, [*conditions, True]))

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        self._coefficients(symbols)
        return self._piecewise(symbol, self.pieces)

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        self._coefficients(symbols)
        return self._piecewise(symbol, self._antiderivatives)


@dataclass(frozen=True)
class UnilateralSpring(Spring):
    """A spring that only pushes: ``F = k1 q + k3 q^3`` on one side of q = 0, nothing on the other.

    Parameters
    ----------
    k1, k3 : float
        N/m, N/m^3.
    side : "negative" or "positive"
        The side on which the load touches the spring.
    motion : "translation" or "rotation"

    Alone it has no rest position; a weight gives it one.

    Examples
    --------
    >>> from stability.models import PolynomialSpring, UnilateralSpring
    >>> float(UnilateralSpring(k1=100.0).force(1e-3)), float(UnilateralSpring(k1=100.0).force(-1e-3))
    (0.0, -0.1)
    >>> loaded = UnilateralSpring(k1=100.0) + PolynomialSpring((0.2,))    # stands under a weight of 0.2 N
    >>> round(loaded.rest, 12)
    -0.002
    """

    k1: float
    k3: float = 0.0
    side: str = "negative"
    motion: str = "translation"

    def __post_init__(self) -> None:
        choice("UnilateralSpring", "motion", self.motion, MOTIONS)
        choice("UnilateralSpring", "side", self.side, ("negative", "positive"))
        for name in ("k1", "k3"):
            object.__setattr__(self, name, finite("UnilateralSpring", name, getattr(self, name)))

    @property
    def breaks(self) -> tuple[float, ...]:
        return (0.0,)

    @property
    def parameters(self) -> dict[str, float]:
        letter = "k" if self.motion == "translation" else "D"
        return {f"{letter}1": self.k1, f"{letter}3": self.k3}

    @property
    def length_scale(self) -> float:
        return math.sqrt(abs(self.k1 / self.k3)) if self.k1 and self.k3 else 1.0

    def _touching(self, q: Any) -> tuple[np.ndarray, np.ndarray]:
        q = np.asarray(q, dtype=float)
        return q, (q < 0.0 if self.side == "negative" else q > 0.0)

    def force(self, q: Any) -> np.ndarray:
        q, touching = self._touching(q)
        return np.where(touching, self.k1 * q + self.k3 * q**3, 0.0)[()]

    def energy(self, q: Any) -> np.ndarray:
        q, touching = self._touching(q)
        return np.where(touching, 0.5 * self.k1 * q**2 + 0.25 * self.k3 * q**4, 0.0)[()]

    def stiffness(self, q: Any) -> np.ndarray:
        q, touching = self._touching(q)
        return np.where(touching, self.k1 + 3.0 * self.k3 * q**2, 0.0)[()]

    @property
    def equilibria(self) -> tuple[float, ...]:
        roots = real_roots((0.0, self.k1, 0.0, self.k3))
        return tuple(r for r in roots if r and (r < 0.0) == (self.side == "negative"))

    def _one_sided(self, symbol: Any, touching: Any) -> sp.Expr:
        import sympy as sp

        if self.side == "negative":
            return sp.Piecewise((touching, symbol < 0), (0, True))
        return sp.Piecewise((0, symbol <= 0), (touching, True))

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        k1, k3 = self._coefficients(symbols).values()
        return self._one_sided(symbol, k1 * symbol + k3 * symbol**3 if k3 else k1 * symbol)

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        k1, k3 = self._coefficients(symbols).values()
        linear = k1 * symbol**2 / 2
        return self._one_sided(symbol, linear + k3 * symbol**4 / 4 if k3 else linear)
