"""What every spring can do: force, energy, stiffness, rest position, escape, backbone, work along a path.

Sign: F(q) is the force (or torque) that HOLDS the displacement q; the restoring force is -F. The energy is
E(s) = int_0^s F dq, the stiffness dF/dq. A mass on the spring obeys m q'' + F(q) = 0.

A spring enters a model as a sympy expression of its displacement: `Spring.expression`, `Spring.energy_expression`
(an opaque `Table` function for measured and magnetic springs, whose fit error is stated).

Units: translation m, N, N/m, J; rotation rad, N m, N m/rad, J.
Reference: equations (3)-(6) of the source chapter; catalogue section 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, check_names
from . import _spring_motion as motion_on
from ._ranges import choice, non_negative, positive

if TYPE_CHECKING:
    import sympy as sp

    from ._spring_sums import ParallelSprings

__all__ = ["Spring"]

MOTIONS = ("translation", "rotation")
METHODS = ("exact", "quadrature", "harmonic balance")


class Spring:
    """What every spring can do; subclasses give `force`, `energy`, `stiffness`, `equilibria` and the expressions.

    Examples
    --------
    >>> from stability.models import PolynomialSpring, PowerLawSpring
    >>> hung = PowerLawSpring(k1=100.0, kn=1e6) + PolynomialSpring((0.2,))     # with a weight of 0.2 N
    >>> round(1e3 * hung.rest, 4), hung.odd                                    # mm
    (-1.9283, False)
    """

    motion: str = "translation"

    def force(self, q: Any) -> np.ndarray:
        """Force (torque) that holds the displacement `q`, any shape."""
        raise NotImplementedError

    def energy(self, q: Any) -> np.ndarray:
        """Energy stored between 0 and `q`, the exact antiderivative of the force."""
        raise NotImplementedError

    def stiffness(self, q: Any) -> np.ndarray:
        """Slope of the force at `q`."""
        raise NotImplementedError

    def expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        """The force as a sympy expression of `symbol`; `symbols` maps names of `parameters` to symbols."""
        raise NotImplementedError

    def energy_expression(self, symbol: Any, symbols: Mapping[str, Any] | None = None) -> sp.Expr:
        """The energy as a sympy expression; its derivative is `expression`."""
        raise NotImplementedError

    @property
    def equilibria(self) -> tuple[float, ...]:
        """Displacements at which no force is needed, ascending."""
        raise NotImplementedError

    @property
    def parameters(self) -> dict[str, float]:
        """Named coefficients that `expression` can replace by symbols; empty for springs given by data."""
        return {}

    @property
    def domain(self) -> tuple[float, float]:
        """Open interval in which the law holds."""
        return -math.inf, math.inf

    @property
    def breaks(self) -> tuple[float, ...]:
        """Displacements at which the law is not analytic."""
        return ()

    @property
    def odd(self) -> bool:
        """Whether F(-q) = -F(q)."""
        return False

    @property
    def length_scale(self) -> float:
        """A displacement that is typical for the law (used to look beyond the last equilibrium)."""
        low, high = self.domain
        return min(1.0, 0.5 * min(abs(low), abs(high))) if min(abs(low), abs(high)) > 0.0 else 1.0

    @property
    def units(self) -> tuple[str, str, str, str]:
        """Units of displacement, force, stiffness and energy."""
        return ("m", "N", "N/m", "J") if self.motion == "translation" else ("rad", "N m", "N m/rad", "J")

    @cached_property
    def _well(self) -> tuple[float, float, float]:
        return motion_on.rest_position(self, self.equilibria)

    @property
    def rest(self) -> float:
        """The stable equilibrium nearest to q = 0; InputError where there is none."""
        return self._well[0]

    @property
    def escape(self) -> tuple[float, float]:
        """Unstable equilibria on either side of the rest position, beyond which the spring pushes away (or infinite).

        Examples
        --------
        >>> from stability.models import PowerLawSpring
        >>> PowerLawSpring(k1=100.0, kn=-1e6).escape   # sqrt(k1/|k3|) on both sides
        (-0.01, 0.01)
        >>> PowerLawSpring(k1=100.0, kn=1e6).escape
        (-inf, inf)
        """
        return self._well[1], self._well[2]

    @property
    def well(self) -> tuple[float, float]:
        """The interval that a free motion about the rest position may fill: up to escape, contact or end of data."""
        return max(self.escape[0], self.domain[0]), min(self.escape[1], self.domain[1])

    def backbone(self, amplitude: Any, inertia: float, method: str = "exact") -> np.ndarray:
        """Angular frequency of free motion against amplitude, of ``inertia q'' + F(q) = 0``.

        Parameters
        ----------
        amplitude : array_like
            Half the peak-to-peak displacement, >= 0; 0 gives the linear frequency about the rest position.
        inertia : float
            Mass in kg (rotation: moment of inertia in kg m^2), > 0.
        method : "exact", "quadrature" or "harmonic balance"
            "exact" is a closed form where there is one and quadrature elsewhere; "harmonic balance" keeps one harmonic
            and a static offset, and its amplitude is that of the harmonic.

        Returns
        -------
        ndarray
            rad/s, shape of `amplitude`.

        Raises
        ------
        InputError
            Amplitude that reaches escape, contact or the end of the data; inertia <= 0; no stable rest position.

        Notes
        -----
        Accuracy: quadrature agrees with the elliptic closed form of the cubic spring and with the Gamma-function closed
        form of a pure power law to 1e-12 (relative); 6e-11 at 0.999999 of the escape, where the period diverges.

        Examples
        --------
        >>> from stability.models import PowerLawSpring
        >>> spring = PowerLawSpring(k1=1.0, kn=1.0, n=3)
        >>> round(float(spring.backbone(1.0, 1.0, "harmonic balance")), 12)   # sqrt(1 + 3/4)
        1.322875655532
        >>> round(float(spring.backbone(1.0, 1.0)), 12)
        1.317776064966
        """
        name = type(self).__name__
        inertia = positive(name, "inertia", inertia, "kg" if self.motion == "translation" else "kg m^2")
        choice(name, "method", method, METHODS)
        values = np.asarray(amplitude, dtype=float)
        for value in values.ravel():
            non_negative(name, "amplitude", value, self.units[0])
        out = [self._frequency(float(a), inertia, method) for a in values.ravel()]
        return np.array(out).reshape(values.shape)[()]

    def _frequency(self, amplitude: float, inertia: float, method: str) -> float:
        if amplitude == 0.0:
            slope = float(self.stiffness(self.rest))
            if not 0.0 <= slope < math.inf:
                raise InputError(
                    f"{type(self).__name__}: no linear frequency at amplitude 0 (stiffness {slope:g} at rest)"
                )
            return math.sqrt(slope / inertia)
        if method == "harmonic balance":
            return motion_on.harmonic_frequency(self, amplitude, inertia)
        return 2.0 * math.pi / motion_on.period(self, amplitude, inertia)

    def work(self, path: Any) -> float:
        """Work done along a path of displacements, from the force alone (Gauss quadrature): zero for every closed path.

        Over ``(-s, s)`` it vanishes for odd springs only; over one turn, ``(0, 2 pi)``, for every periodic potential.

        Examples
        --------
        >>> from stability.models import PowerLawSpring
        >>> abs(PowerLawSpring(k1=3.0, kn=2.0, n=2).work((0.0, 1.0, -0.5, 0.3, 0.0))) < 1e-14
        True
        >>> round(PowerLawSpring(k1=3.0, kn=2.0, n=2).work((-1.0, 1.0)), 12)   # not odd: 2 kn/3
        1.333333333333
        """
        points = np.asarray(path, dtype=float)
        if points.ndim != 1 or len(points) < 2:
            raise InputError(f"{type(self).__name__}: path must be a sequence of at least two displacements")
        nodes, weights = np.polynomial.legendre.leggauss(48)
        total = 0.0
        for start, end in pairwise(points):
            inner = sorted(b for b in (0.0, *self.breaks) if min(start, end) < b < max(start, end))
            cuts = [start, *(inner if end > start else reversed(inner)), end]
            for a, b in pairwise(cuts):
                q = 0.5 * (a + b) + 0.5 * (b - a) * nodes
                total += 0.5 * (b - a) * float(np.sum(weights * np.asarray(self.force(q))))
        return float(total)

    def __add__(self, other: Any) -> ParallelSprings:
        """Two springs in parallel: same displacement, forces add."""
        if not isinstance(other, Spring):
            return NotImplemented
        from ._spring_sums import ParallelSprings

        mine, theirs = (s.springs if isinstance(s, ParallelSprings) else (s,) for s in (self, other))
        return ParallelSprings((*mine, *theirs))

    def _coefficients(self, symbols: Mapping[str, Any] | None) -> dict[str, Any]:
        """Parameter name -> the symbol given for it, or its number."""
        import sympy as sp

        given = dict(symbols or {})
        check_names("parameter", given, self.parameters, type(self).__name__)
        return {name: given.get(name, sp.Float(value)) for name, value in self.parameters.items()}
