r"""One solution: a fixed point or a periodic orbit, as frozen data that knows how accurate it is.

A periodic orbit of period T is kept as a piecewise polynomial, x(t) on [e_j, e_(j+1)] = sum_i C[j, i] T_i(s),
s = 2 (t - e_j)/(e_(j+1) - e_j) - 1, with Chebyshev polynomials T_i: every method's orbit (collocation, shooting,
Fourier series) has this form or is brought to it within rounding. Extrema are those of the interpolant (roots of its
derivative), not of mesh points; harmonics are integrals over it,

    c_k = 1/T int_0^T x(t) exp(-2 pi i k m t / T) dt,     amplitude_k = 2 |c_k|  (|c_0| for k = 0),

for an orbit of m forcing periods (T = m times the forcing's; m = 1 of an autonomous one). So k counts in the forcing
frequency: amplitude(1) is the response at it, whatever the period, and a doubled orbit has amplitude(1/2), (3/2), ...
besides. Angles that wind, x(T) = x(0) + 2 pi w, carry ``winding`` = 2 pi w.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..words import Verdict
from .storage import register

__all__ = ["FixedPoint", "PeriodicOrbit"]


def frozen(array: Any, dtype: Any = float) -> NDArray[Any]:
    """A read-only C-contiguous copy."""
    copy = np.array(array, dtype=dtype, order="C")
    copy.setflags(write=False)
    return copy


def _named(states: Sequence[str], values: NDArray[Any]) -> Mapping[str, float]:
    return MappingProxyType({name: float(v) for name, v in zip(states, values)})


@register("fixed-point")
@dataclass(frozen=True, eq=False, repr=False)
class FixedPoint:
    """An equilibrium x with f(x, p) = 0 and the eigenvalues of df/dx.

    Attributes
    ----------
    states : tuple of str
    x : (n,) float
    params : mapping of parameter values
    eigenvalues : (n,) complex, descending real part
    verdict : Verdict
    error : float, estimated error of x (scaled);  residual : float, max norm of f over its scale
    """

    states: tuple[str, ...]
    x: NDArray[np.float64]
    params: Mapping[str, float]
    eigenvalues: NDArray[np.complex128]
    verdict: Verdict
    error: float = 0.0
    residual: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", tuple(self.states))
        object.__setattr__(self, "x", frozen(self.x))
        object.__setattr__(self, "params", MappingProxyType({k: float(v) for k, v in self.params.items()}))
        object.__setattr__(self, "eigenvalues", frozen(self.eigenvalues, complex))
        object.__setattr__(self, "verdict", Verdict(self.verdict))

    def __getitem__(self, state: str) -> float:
        if state not in self.states:
            raise unknown_name("state", state, self.states, "this fixed point")
        return float(self.x[self.states.index(state)])

    @property
    def exponents(self) -> NDArray[np.complex128]:
        """(n,) the eigenvalues: growth rates per unit time."""
        return self.eigenvalues

    @property
    def max(self) -> Mapping[str, float]:
        """State -> value (a fixed point does not move)."""
        return _named(self.states, self.x)

    @property
    def min(self) -> Mapping[str, float]:
        """State -> value."""
        return _named(self.states, self.x)

    def __repr__(self) -> str:
        values = "  ".join(f"{s}={v:.6g}" for s, v in zip(self.states[:6], self.x))
        return f"FixedPoint {values}{' ...' if len(self.states) > 6 else ''} | {self.verdict}"

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        header = {
            "type": "fixed-point",
            "states": list(self.states),
            "params": dict(self.params),
            "verdict": str(self.verdict),
            "error": float(self.error),
            "residual": float(self.residual),
        }
        return header, {"x": self.x, "eigenvalues": self.eigenvalues}

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> FixedPoint:
        """The inverse of `to_storage`."""
        fields = {k: header[k] for k in ("states", "params", "verdict", "error", "residual")}
        return cls(x=arrays["x"], eigenvalues=arrays["eigenvalues"], **fields)


@register("periodic-orbit")
@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit:
    """A periodic solution x(t + T) = x(t) (+ winding) with its Floquet multipliers; callable: ``orbit(t)``.

    Attributes
    ----------
    states : tuple of str
    edges : (K + 1,) float, times of the pieces from 0 to T
    coefficients : (K, d + 1, n) float, Chebyshev coefficients of the pieces (see the head of this module)
    params : mapping of parameter values
    multipliers : (n,) complex, descending modulus; the trivial 1 of an autonomous orbit included
    verdict : Verdict
    error : float, estimated largest state error over the state's scale;  residual : float
    winding : (n,) float, x(T) - x(0)
    half_multipliers : (k,) complex or None, of the half-period map S^-1 Phi(T/2) of an orbit x(t + T/2) = S x(t) that
        was solved on half of its period; their squares are `multipliers`
    multiple : int, forcing periods that the orbit covers (2 after a period doubling); 1 for autonomous systems

    Examples
    --------
    >>> import numpy as np
    >>> orbit = PeriodicOrbit.from_function(("u", "u_dot"), lambda t: np.array([np.cos(t), -np.sin(t)]), 2*np.pi)
    >>> round(orbit.max["u"], 12), round(orbit.amplitude(1)["u_dot"], 12)
    (1.0, 1.0)
    """

    states: tuple[str, ...]
    edges: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    params: Mapping[str, float]
    multipliers: NDArray[np.complex128] = field(default_factory=lambda: np.zeros(0, complex))
    verdict: Verdict = Verdict.UNDETERMINED
    error: float = 0.0
    residual: float = 0.0
    winding: NDArray[np.float64] | None = None
    half_multipliers: NDArray[np.complex128] | None = None
    multiple: int = 1

    def __post_init__(self) -> None:
        states = tuple(self.states)
        edges, coefficients = frozen(self.edges), frozen(self.coefficients)
        if coefficients.ndim != 3 or coefficients.shape[0] != edges.size - 1 or coefficients.shape[2] != len(states):
            shapes = f"{edges.size - 1} pieces and {len(states)} states"
            raise InputError(f"coefficients of shape {coefficients.shape} do not fit {shapes}")
        winding = np.zeros(len(states)) if self.winding is None else self.winding
        object.__setattr__(self, "states", states)
        object.__setattr__(self, "edges", edges)
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "params", MappingProxyType({k: float(v) for k, v in self.params.items()}))
        object.__setattr__(self, "multipliers", frozen(self.multipliers, complex))
        object.__setattr__(self, "verdict", Verdict(self.verdict))
        object.__setattr__(self, "winding", frozen(winding))
        if self.half_multipliers is not None:
            object.__setattr__(self, "half_multipliers", frozen(self.half_multipliers, complex))

    @classmethod
    def from_nodes(
        cls, states: Sequence[str], edges: Any, nodes: Any, values: Any, params: Mapping[str, float], **fields: Any
    ) -> PeriodicOrbit:
        """From values (K, d + 1, n) at local nodes (d + 1,) in [0, 1] of every piece; other fields by keyword."""
        basis = np.polynomial.chebyshev.chebvander(2 * np.asarray(nodes, float) - 1, len(nodes) - 1)
        coefficients = np.linalg.solve(basis, np.asarray(values, float))
        return cls(tuple(states), edges, coefficients, params, **fields)

    @classmethod
    def from_function(
        cls,
        states: Sequence[str],
        function: Callable[[NDArray[np.float64]], NDArray[np.float64]],
        period: float,
        params: Mapping[str, float] | None = None,
        pieces: int = 32,
        degree: int = 12,
        **fields: Any,
    ) -> PeriodicOrbit:
        """From x = function(t): (N,) -> (n, N), interpolated at Chebyshev points of equal pieces."""
        edges = np.linspace(0.0, period, pieces + 1)
        nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        times = edges[:-1, None] + nodes * (period / pieces)
        values = np.asarray(function(times.ravel()), float).T.reshape(pieces, degree + 1, len(states))
        return cls.from_nodes(states, edges, nodes, values, params or {}, **fields)

    @property
    def period(self) -> float:
        """T, in units of time."""
        return float(self.edges[-1])

    @property
    def exponents(self) -> NDArray[np.complex128]:
        """(n,) Floquet exponents log(multiplier)/T, imaginary part folded into (-pi/T, pi/T]."""
        with np.errstate(divide="ignore"):
            return np.log(self.multipliers.astype(complex)) / self.period

    @cached_property
    def t(self) -> NDArray[np.float64]:
        """(N,) times from 0 to T, both ends included, dense enough to plot."""
        parts = max(4, self.coefficients.shape[1] - 1)
        steps = np.arange(parts) / parts
        inner = self.edges[:-1, None] + np.diff(self.edges)[:, None] * steps
        return frozen(np.append(inner.ravel(), self.period))

    @cached_property
    def x(self) -> NDArray[np.float64]:
        """(n, N) states at `t`."""
        return frozen(self(self.t))

    def __call__(self, t: Any) -> NDArray[np.float64]:
        """x(t): (n,) for a number, (n, N) for an array; any real times, the orbit is continued periodically."""
        times = np.asarray(t, float)
        turns = np.floor(times.ravel() / self.period)
        local = times.ravel() - turns * self.period
        # a time equal to T is the end of the last piece, so that winding angles are continuous there
        at_end = (local == 0) & (turns == 1)
        local[at_end], turns[at_end] = self.period, 0
        values = self._values(local) + turns[:, None] * self.winding
        return values.T.reshape(len(self.states), *times.shape)

    def _values(self, local: NDArray[np.float64], derivative: bool = False) -> NDArray[np.float64]:
        """(N, n) at times in [0, T]; the derivative with respect to time on request."""
        piece = np.clip(np.searchsorted(self.edges, local, side="right") - 1, 0, self.edges.size - 2)
        width = np.diff(self.edges)[piece]
        s = 2 * (local - self.edges[piece]) / width - 1
        c = self.coefficients
        if derivative:
            c = np.asarray(np.polynomial.chebyshev.chebder(c, axis=1), dtype=np.float64)
        basis = np.polynomial.chebyshev.chebvander(s, c.shape[1] - 1)
        values = np.einsum("ki,kin->kn", basis, c[piece])
        return values * (2 / width)[:, None] if derivative else values

    def derivative(self, t: Any) -> NDArray[np.float64]:
        """dx/dt of the interpolant, (n,) or (n, N)."""
        times = np.asarray(t, float)
        return self._values(np.mod(times.ravel(), self.period), derivative=True).T.reshape(-1, *times.shape)

    @cached_property
    def _extrema(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Largest and smallest values (n,): sign changes of the derivative on a fine grid, then bisection on all."""
        degree = self.coefficients.shape[1] - 1
        steps = np.linspace(0, 1, 2 * degree + 3)
        times = (self.edges[:-1, None] + np.diff(self.edges)[:, None] * steps[:-1]).ravel()
        times = np.append(times, self.period)
        values, slopes = self._values(times), self._values(times, derivative=True)
        top, bottom = values.max(axis=0), values.min(axis=0)
        at, state = np.nonzero(slopes[:-1] * slopes[1:] < 0)
        lo, hi, left = times[at].copy(), times[at + 1].copy(), slopes[at, state]
        rows = np.arange(at.size)
        for _ in range(40):
            middle = 0.5 * (lo + hi)
            same = self._values(middle, derivative=True)[rows, state] * left > 0
            lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
        peaks = self._values(0.5 * (lo + hi))[rows, state]
        np.maximum.at(top, state, peaks)
        np.minimum.at(bottom, state, peaks)
        return top, bottom

    @cached_property
    def max(self) -> Mapping[str, float]:
        """State -> largest value over a period, of the interpolant."""
        return _named(self.states, self._extrema[0])

    @cached_property
    def min(self) -> Mapping[str, float]:
        """State -> smallest value over a period, of the interpolant."""
        return _named(self.states, self._extrema[1])

    def harmonic(self, k: float) -> NDArray[np.complex128]:
        """(n,) Fourier coefficient c_k (a winding angle: of x - winding t / T); k counts in the forcing frequency.

        Raises
        ------
        InputError
            k is no multiple of 1/m, m forcing periods per orbit.
        """
        number = self._order(k)
        degree = self.coefficients.shape[1] - 1
        count = degree + 8 + int(4 * abs(number) / (self.edges.size - 1))
        s, w = np.polynomial.legendre.leggauss(count)
        times = self.edges[:-1, None] + np.diff(self.edges)[:, None] * (0.5 + 0.5 * s)
        weights = (np.diff(self.edges)[:, None] * (0.5 * w)).ravel() / self.period
        values = self._values(times.ravel()) - times.ravel()[:, None] / self.period * np.asarray(self.winding)
        return (weights * np.exp(-2j * np.pi * number * times.ravel() / self.period)) @ values

    def _order(self, k: float) -> int:
        """k of the forcing as a harmonic number of the orbit's own period."""
        try:
            number = float(k) * self.multiple
        except (TypeError, ValueError):
            raise InputError(f"harmonic number {k!r}: a number is needed") from None
        if not np.isfinite(number) or abs(number - round(number)) > 1e-9 * self.multiple:
            allowed = "a whole number" if self.multiple == 1 else f"a multiple of 1/{self.multiple}"
            raise InputError(f"harmonic number {k!r}: {allowed} is needed, k counts in the forcing frequency")
        return round(number)

    def amplitude(self, k: float = 1) -> Mapping[str, float]:
        """State -> amplitude 2 |c_k| at k times the forcing frequency (k = 0: the mean; k = 1/2 of a doubled orbit)."""
        if isinstance(k, str) or not float(k) >= 0:
            raise InputError(f"harmonic number {k!r}: a number >= 0 is needed")
        c = self.harmonic(k)
        return _named(self.states, c.real if k == 0 else 2 * np.abs(c))

    def plot(self, ax: Any = None, x: str | None = None, y: str | None = None, **style: Any) -> Any:
        """Draw the orbit in the phase plane (first coordinate against its velocity unless named)."""
        from ..plots.branches import plot_orbit

        return plot_orbit(self, ax=ax, x=x, y=y, **style)

    def __repr__(self) -> str:
        largest = "  ".join(f"max {s}={self.max[s]:.6g}" for s in self.states[:2])
        return f"PeriodicOrbit T={self.period:.6g}  {largest} | {self.verdict}"

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        header = {
            "type": "periodic-orbit",
            "states": list(self.states),
            "params": dict(self.params),
            "verdict": str(self.verdict),
            "error": float(self.error),
            "residual": float(self.residual),
            "multiple": self.multiple,
        }
        arrays = {"edges": self.edges, "coefficients": self.coefficients, "multipliers": self.multipliers}
        if self.half_multipliers is not None:
            arrays["half_multipliers"] = self.half_multipliers
        return header, {**arrays, "winding": np.asarray(self.winding)}

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> PeriodicOrbit:
        """The inverse of `to_storage`."""
        fields: dict[str, Any] = {k: header[k] for k in ("states", "params", "verdict", "error", "residual")}
        fields |= {k: arrays[k] for k in ("edges", "coefficients", "multipliers", "winding")}
        return cls(**fields, half_multipliers=arrays.get("half_multipliers"), multiple=int(header.get("multiple", 1)))
