"""Spring laws in closed form: power law and polynomial, for translation and rotation.

F(q) is the force that HOLDS the displacement q; E = int_0^s F dq.

    power law   F = k1 q + kn q^n          E = k1 q^2/2 + kn q^(n+1)/(n+1)                      n an integer >= 0
                F = k1 q + kn sign(q)|q|^n E = k1 q^2/2 + kn |q|^(n+1)/(n+1)                    any other n > -1
    polynomial  F = sum_j k_j q^j          E = sum_j k_j q^(j+1)/(j+1)

An odd integer n gives a symmetric spring (kn > 0 hardens, kn < 0 softens), an even one an unsymmetric spring, which
softens for either sign of kn: w = w1 + (3 k3/(8 m w1) - 5 k2^2/(12 m^2 w1^3)) a^2 + O(a^4). A softening spring lets
its mass escape over the unstable equilibrium at |q| = (k1/|kn|)^(1/(n-1)). The cubic spring has the exact period

    T = 4 K(mu)/sqrt(w1^2 + kap a^2),   mu = kap a^2/(2 (w1^2 + kap a^2)),   kap = k3/m,   w1^2 = k1/m.

References: equations (3)-(6) of the source chapter; A. H. Nayfeh and D. T. Mook, Nonlinear Oscillations (1979).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from . import _spring_motion as motion_on
from ._ranges import choice, finite
from ._springs import MOTIONS, Spring

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["PolynomialSpring", "PowerLawSpring"]


@dataclass(frozen=True)
class PowerLawSpring(Spring):
    """Linear plus one power: ``F = k1 q + kn q^n`` (integer n), ``F = k1 q + kn sign(q)|q|^n`` (any other n > -1).

    Parameters
    ----------
    k1 : float
        Linear stiffness, N/m (rotation: N m/rad).
    kn : float
        Coefficient of the power, N/m^n.
    n : float
        Exponent, > -1, not 1. For -1 < n < 0 the force is infinite at q = 0, the energy is not.
    motion : "translation" or "rotation"

    Examples
    --------
    >>> from stability.models import PowerLawSpring
    >>> spring = PowerLawSpring(k1=189.2, kn=1.87e6)
    >>> round(float(spring.force(2e-3)), 12), float(spring.stiffness(0.0))
    (0.39336, 189.2)
    >>> import sympy as sp
    >>> PowerLawSpring(k1=2.0, kn=-1.0, n=1.5).expression(sp.Symbol("q", real=True))
    2.0*q - 1.0*Abs(q)**(3/2)*sign(q)
    """

    k1: float
    kn: float = 0.0
    n: float = 3
    motion: str = "translation"

    def __post_init__(self) -> None:
        choice("PowerLawSpring", "motion", self.motion, MOTIONS)
        for name in ("k1", "kn", "n"):
            object.__setattr__(self, name, finite("PowerLawSpring", name, getattr(self, name)))
        if self.n <= -1.0 or self.n == 1.0:
            raise InputError(f"PowerLawSpring: n must be > -1 (finite energy) and not 1 (that is k1); got {self.n:g}")

    @property
    def _integer(self) -> bool:
        return self.n >= 0.0 and self.n == int(self.n)

    @property
    def odd(self) -> bool:
        return self.kn == 0.0 or not self._integer or self.n % 2.0 == 1.0

    @property
    def breaks(self) -> tuple[float, ...]:
        return () if self._integer or self.kn == 0.0 else (0.0,)

    @property
    def parameters(self) -> dict[str, float]:
        letter = "k" if self.motion == "translation" else "D"
        return {f"{letter}1": self.k1, f"{letter}{int(self.n) if self._integer else 'n'}": self.kn}

    def _power(self, q: np.ndarray, exponent: float) -> np.ndarray:
        """q^n with the spring's own parity, for exponents n and n - 1 and n + 1."""
        if self._integer:
            return q**exponent if exponent >= 0.0 else np.zeros_like(q)
        parity = np.sign(q) if (exponent == self.n) else 1.0
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where((q == 0.0) & (exponent == self.n), 0.0, parity * np.abs(q) ** exponent)

    def force(self, q: Any) -> np.ndarray:
        q = np.asarray(q, dtype=float)
        return self.k1 * q + self.kn * self._power(q, self.n) if self.kn else self.k1 * q

    def energy(self, q: Any) -> np.ndarray:
        q = np.asarray(q, dtype=float)
        return 0.5 * self.k1 * q**2 + self.kn / (self.n + 1.0) * self._power(q, self.n + 1.0)

    def stiffness(self, q: Any) -> np.ndarray:
        q = np.asarray(q, dtype=float)
        if self.kn == 0.0 or self.n == 0.0:
            return self.k1 + np.zeros_like(q)
        return self.k1 + self.n * self.kn * self._power(q, self.n - 1.0)

    @property
    def equilibria(self) -> tuple[float, ...]:
        if self.kn == 0.0:
            return (0.0,)
        if self.n == 0.0:
            return (-self.kn / self.k1,) if self.k1 else ()
        ratio = -self.k1 / self.kn
        if self.odd:
            if ratio <= 0.0:
                return (0.0,)
            side = ratio ** (1.0 / (self.n - 1.0))
            return -side, 0.0, side
        root = math.copysign(abs(ratio) ** (1.0 / (self.n - 1.0)), ratio)
        return tuple(sorted({0.0, root}))

    @property
    def length_scale(self) -> float:
        if self.kn and self.k1:
            return abs(self.k1 / self.kn) ** (1.0 / (self.n - 1.0))
        return 1.0

    def _frequency(self, amplitude: float, inertia: float, method: str) -> float:
        stiff, cubic = self.k1 / inertia, self.kn / inertia
        if (
            self.n != 3.0
            or method != "exact"
            or amplitude == 0.0
            or stiff + 0.5 * min(cubic, 0.0) * amplitude**2 <= 0.0
        ):
            return super()._frequency(amplitude, inertia, method)
        motion_on.turning_points(self, amplitude)  # refuses amplitudes beyond the escape
        square = stiff + cubic * amplitude**2
        modulus = 0.5 * cubic * amplitude**2 / square
        return 0.5 * math.pi * math.sqrt(square) / _complete_elliptic(modulus)

    def _monomial(self, symbol: Any, extra: int) -> sp.Expr:
        import sympy as sp

        if self._integer:
            return symbol ** sp.Integer(int(self.n) + extra)
        fraction = Fraction(self.n).limit_denominator(1000)
        exact = float(fraction) == self.n
        exponent = sp.Rational(fraction.numerator, fraction.denominator) if exact else sp.Float(self.n)
        return sp.Abs(symbol) ** (exponent + extra) * (1 if extra else sp.sign(symbol))

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        first, power = self._coefficients(symbols).values()
        return first * symbol + power * self._monomial(symbol, 0) if power else first * symbol

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        import sympy as sp

        first, power = self._coefficients(symbols).values()
        linear = first * symbol**2 / 2
        top = sp.Integer(int(self.n) + 1) if self._integer else sp.Float(self.n + 1.0)
        return linear + power * self._monomial(symbol, 1) / top if power else linear


def _complete_elliptic(parameter: float) -> float:
    """K(m) by the arithmetic-geometric mean, m < 1 (negative too).

    >>> round(_complete_elliptic(0.5), 14)
    1.85407467730137
    """
    a, b = 1.0, math.sqrt(1.0 - parameter)
    while abs(a - b) > 1e-15 * a:
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return math.pi / (a + b)


@dataclass(frozen=True)
class PolynomialSpring(Spring):
    """``F = k_0 + k_1 q + k_2 q^2 + ...``; a constant ``k_0`` is a preload or a weight (+m g holds a mass up).

    Parameters
    ----------
    coefficients : sequence of float
        ``(k_0, k_1, k_2, ...)``, N/m^j, lowest power first.
    motion : "translation" or "rotation"

    Examples
    --------
    >>> spring = PolynomialSpring((0.0, 100.0, -5e3, 1e6))
    >>> float(spring.force(1e-3)), spring.rest, spring.odd
    (0.096, 0.0, False)
    """

    coefficients: tuple[float, ...]
    motion: str = "translation"

    def __post_init__(self) -> None:
        choice("PolynomialSpring", "motion", self.motion, MOTIONS)
        given = np.atleast_1d(np.asarray(self.coefficients, dtype=object))
        if given.ndim != 1 or not len(given):
            raise InputError("PolynomialSpring: coefficients must be a sequence (k_0, k_1, ...), lowest power first")
        values = tuple(finite("PolynomialSpring", f"coefficients[{j}]", k) for j, k in enumerate(given))
        object.__setattr__(self, "coefficients", values)

    @property
    def odd(self) -> bool:
        return not any(self.coefficients[::2])

    @property
    def parameters(self) -> dict[str, float]:
        letter = "k" if self.motion == "translation" else "D"
        return {f"{letter}{j}": k for j, k in enumerate(self.coefficients) if k}

    def force(self, q: Any) -> np.ndarray:
        return np.polynomial.polynomial.polyval(np.asarray(q, dtype=float), self.coefficients)

    def energy(self, q: Any) -> np.ndarray:
        antiderivative = np.polynomial.polynomial.polyint(self.coefficients)
        return np.polynomial.polynomial.polyval(np.asarray(q, dtype=float), antiderivative)

    def stiffness(self, q: Any) -> np.ndarray:
        slope = np.polynomial.polynomial.polyder(self.coefficients)
        return np.polynomial.polynomial.polyval(np.asarray(q, dtype=float), slope)

    @property
    def equilibria(self) -> tuple[float, ...]:
        return motion_on.real_roots(self.coefficients)

    @property
    def length_scale(self) -> float:
        nonzero = [(j, abs(k)) for j, k in enumerate(self.coefficients) if k and j]
        if len(nonzero) < 2:
            return 1.0
        (i, low), (j, high) = nonzero[0], nonzero[-1]
        return float((low / high) ** (1.0 / (j - i)))

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        import sympy as sp

        return sp.Add(*(k * symbol ** int(name[1:]) for name, k in self._coefficients(symbols).items()))

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        import sympy as sp

        powers = ((int(name[1:]) + 1, k) for name, k in self._coefficients(symbols).items())
        return sp.Add(*(k * symbol**power / power for power, k in powers))
