r"""Which Fourier series are unknown: velocities that are exactly x' = v are eliminated.

With the phase s in [0, 1) of the orbit, omega = 2 pi / T and theta = 2 pi s, every state is

    x(s) = w s + series(c),       v(s) = omega ( w / 2 pi + dx/dtheta )      where x' = v is one of the equations,

(w: winding of angles). The equations left are one per unknown series, order r = 2 or 1:

    omega^2 x'' - f_v(x, v, ...) = 0      (r = 2),          omega x' - f_x = 0      (r = 1),       ' = d/dtheta,

projected on the harmonics 0 .. H. A System of second-order equations has half as many unknowns as states; states of
first order (a temperature, a current) stay as they are, side by side with the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..kernels.fourier import FourierBasis, fourier_basis, series

__all__ = ["HarmonicLayout"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class HarmonicLayout:
    """Unknown series, equations and basis of one discretisation.

    Attributes
    ----------
    n : number of states;  harmonics : H;  samples : N
    rows : (q,) states whose equations are kept;  unknowns : (q,) states whose series are unknown
    second : (q,) bool, whether unknown k is a coordinate whose velocity is state rows[k]
    winding : (n,) radians per orbit
    """

    n: int
    harmonics: int
    samples: int
    rows: Array
    unknowns: Array
    second: Array
    winding: Array

    @classmethod
    def of(cls, flow: Any, n: int, harmonics: int, samples: int, winding: Array) -> HarmonicLayout:
        """From the kinematic equations of a system (`CompiledField.kept` and `.position`)."""
        rows, position = np.array(flow.kept), np.array(flow.position)
        second = position >= 0
        return cls(n, harmonics, samples, rows, np.where(second, position, rows), second, np.array(winding))

    @cached_property
    def basis(self) -> FourierBasis:
        """Matrices of H harmonics on N samples."""
        return fourier_basis(self.harmonics, self.samples)

    @property
    def q(self) -> int:
        """Number of unknown series."""
        return len(self.rows)

    @property
    def count(self) -> int:
        """Coefficients of one series, 2 H + 1."""
        return 2 * self.harmonics + 1

    @cached_property
    def pairs(self) -> tuple[Array, Array]:
        """(places k of the coordinates among the unknowns, their velocity states)."""
        places = np.flatnonzero(self.second)
        return places, self.rows[places]

    @cached_property
    def velocities(self) -> Array:
        """(q,) for each series the state that is its velocity, or -1."""
        return np.where(self.second, self.rows, -1)

    @cached_property
    def turns(self) -> Array:
        """(q,) winding of the unknowns."""
        return np.asarray(self.winding[self.unknowns])

    @cached_property
    def all_second(self) -> bool:
        """Whether there are no states of first order."""
        return bool(self.second.all())

    @cached_property
    def turn(self) -> Array | None:
        """(q,) winding of the unknowns, or None where nothing winds."""
        w = self.winding[self.unknowns]
        return w if w.any() else None

    def states(self, c: Array, omega: float, at: Array | None = None) -> Array:
        """X (N, n) at the samples, or at other points s, of the coefficients c (2H + 1, q)."""
        if at is None:
            G, slope, s = self.basis.synthesis, self.basis.slope, self.basis.points
        else:
            G, s = series((len(c) - 1) // 2, at), at
            slope = slope_of(G)
        return self.states_by(G, slope, s, c, omega)

    def states_by(self, G: Array, slope: Array, s: Array, c: Array, omega: float) -> Array:
        """The same with given matrices G and G D of the points s."""
        X = np.empty((len(s), self.n))
        x = G @ c
        places, velocities = self.pairs
        v = omega * (slope @ (c if self.all_second else c[:, places]))
        if self.turn is not None:
            x += s[:, None] * self.turn
            v += omega / (2 * np.pi) * self.turn[places]
        X[:, self.unknowns] = x
        X[:, velocities] = v
        return X

    def coefficients(self, X: Array) -> Array:
        """c (2H + 1, q) of samples X (N, n)."""
        x = X[:, self.unknowns]
        if self.turn is not None:
            x = x - self.basis.points[:, None] * self.turn
        return np.asarray(self.basis.analysis @ x)

    @cached_property
    def order(self) -> Array:
        """(q,) orders of the equations, 2 or 1."""
        return np.where(self.second, 2, 1)

    @cached_property
    def growth(self) -> Array:
        """(2H + 1, q): max(1, k)^order, by which the rows of the equations grow with the harmonic."""
        k = np.maximum(self.basis.k, 1.0)[:, None]
        return np.asarray(k**self.order)


def slope_of(G: Array) -> Array:
    """G D from G (K, 2H + 1)."""
    out = np.zeros_like(G)
    k = np.arange(1, (G.shape[1] + 1) // 2)
    out[:, 1::2], out[:, 2::2] = -k * G[:, 2::2], k * G[:, 1::2]
    return out
