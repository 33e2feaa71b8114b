r"""Exact free motion of the conservative Duffing oscillator and of the pendulum, by Jacobi's elliptic functions.

    x'' + alpha x + beta x^3 = 0,  x(0) = A, x'(0) = 0:
        beta > 0, alpha + beta A^2 > 0:  x = A cn(w t, m),  w^2 = alpha + beta A^2,  m = beta A^2/(2 w^2)  (m < 1)
        alpha < 0 inside a well:         x = A dn(w t, m),  w^2 = beta A^2/2,        m = 2 + 2 alpha/(beta A^2)
        beta < 0, |beta| A^2 < alpha:    x = A sn(w t + K, m),  w^2 = alpha + beta A^2/2,  m = -beta A^2/(2 w^2)
    theta'' + omega0^2 sin theta = 0,  theta(0) = A < pi:
        sin(theta/2) = k sn(omega0 t + K, k^2),  k = sin(A/2),  omega = pi omega0/(2 K(k^2)).

Angular frequency 2 pi over the period: pi w/(2 K) for cn and sn, pi w/K for dn. m is the parameter (not the modulus).
Reference: DLMF 22.19; Nayfeh and Mook (1979), section 2.1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..errors import InputError

__all__ = ["ConservativeMotion", "duffing_motion", "pendulum_motion"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ConservativeMotion:
    """An exact periodic motion, x(0) = amplitude, x'(0) = 0; call it with times.

    Attributes
    ----------
    amplitude : float
        The largest displacement.
    frequency : float
        Angular frequency 2 pi over the period.

    Examples
    --------
    >>> import stability as st
    >>> float(st.duffing_motion(amplitude=1.0, beta=0.0)(0.5)[0].round(6))
    0.877583
    """

    amplitude: float
    frequency: float
    _motion: Callable[[Array], tuple[Array, Array]] = field(repr=False)

    @property
    def period(self) -> float:
        """2 pi / frequency."""
        return 2 * math.pi / self.frequency

    def __call__(self, t: npt.ArrayLike) -> Array:
        """Position and velocity at time(s) t, (2,) or (2, N)."""
        return np.array(self._motion(np.asarray(t, dtype=float)))

    def harmonic(self, k: int = 1) -> float:
        """Cosine coefficient of the k-th harmonic of x(t) (the mean for k = 0), by the trapezoidal rule (spectral)."""
        n = 512
        x = self(self.period * np.arange(n) / n)[0]
        weight = np.cos(2 * np.pi * k * np.arange(n) / n)
        return float((x @ weight) / n * (1 if k == 0 else 2))


def duffing_motion(*, amplitude: float, alpha: float = 1.0, beta: float = 1.0) -> ConservativeMotion:
    """Exact free motion of x'' + alpha x + beta x^3 = 0 from x = amplitude at rest.

    Parameters
    ----------
    amplitude : float
        The largest displacement A > 0; inside a well (alpha < 0) the outer turning point.
    alpha, beta : float
        Linear and cubic stiffness, of any sign as long as the motion is periodic.

    Returns
    -------
    ConservativeMotion
        With the exact ``frequency``; for beta > 0, omega = pi sqrt(alpha + beta A^2)/(2 K(m)).

    Raises
    ------
    InputError
        No periodic motion at that amplitude (an equilibrium, a separatrix, escape from a softening spring).

    References
    ----------
    DLMF 22.19(ii); Nayfeh and Mook (1979), section 2.1.

    Examples
    --------
    >>> import stability as st
    >>> round(st.duffing_motion(amplitude=1.0, alpha=0.0, beta=1.0).frequency, 6)
    0.847213
    """
    from scipy.special import ellipj, ellipk

    if not (math.isfinite(amplitude) and amplitude > 0):
        raise InputError(f"amplitude must be positive and finite; got {amplitude}")
    A, z = float(amplitude), beta * amplitude**2
    if beta >= 0 and alpha + z > 0 and alpha + z / 2 > 0:
        w = math.sqrt(alpha + z)
        m = z / (2 * w * w)

        def motion(t: Array) -> tuple[Array, Array]:
            sn, cn, dn, _ = ellipj(w * t, m)
            return A * cn, -A * w * sn * dn

        return ConservativeMotion(A, math.pi * w / (2 * float(ellipk(m))), motion)
    if beta > 0 and alpha < 0 and alpha + z > 0 and alpha + z / 2 < 0:
        w = math.sqrt(z / 2)
        m = 2 + 2 * alpha / z

        def inside(t: Array) -> tuple[Array, Array]:
            sn, cn, dn, _ = ellipj(w * t, m)
            return A * dn, -A * w * m * sn * cn

        return ConservativeMotion(A, math.pi * w / float(ellipk(m)), inside)
    if beta < 0 < alpha and -z < alpha:
        w = math.sqrt(alpha + z / 2)
        m = -z / (2 * w * w)
        quarter = float(ellipk(m))

        def softening(t: Array) -> tuple[Array, Array]:
            sn, cn, dn, _ = ellipj(w * t + quarter, m)
            return A * sn, A * w * cn * dn

        return ConservativeMotion(A, math.pi * w / (2 * quarter), softening)
    raise InputError(
        f"x'' + {alpha:g} x + {beta:g} x^3 = 0 has no periodic motion with the turning point {A:g}: it must lie "
        "outside the equilibria and the separatrix, and inside |x| < sqrt(alpha/|beta|) for a softening spring"
    )


def pendulum_motion(*, amplitude: float, omega0: float = 1.0) -> ConservativeMotion:
    """Exact free swing of the pendulum theta'' + omega0^2 sin theta = 0 from theta = amplitude at rest.

    Parameters
    ----------
    amplitude : float
        The largest angle (rad), 0 < amplitude < pi.
    omega0 : float
        Natural frequency of small swings.

    Returns
    -------
    ConservativeMotion
        With omega = pi omega0/(2 K(sin^2(amplitude/2))).

    Raises
    ------
    InputError
        An amplitude outside (0, pi), a frequency that is not positive.

    References
    ----------
    DLMF 22.19(i).

    Examples
    --------
    >>> import stability as st
    >>> round(st.pendulum_motion(amplitude=1.5707963267948966).frequency, 6)
    0.847213
    """
    from scipy.special import ellipj, ellipk

    if not 0 < amplitude < math.pi:
        raise InputError(f"amplitude must lie between 0 and pi (at the top the period is infinite); got {amplitude}")
    if not (math.isfinite(omega0) and omega0 > 0):
        raise InputError(f"omega0 must be positive; got {omega0}")
    k = math.sin(amplitude / 2)
    quarter = float(ellipk(k * k))

    def motion(t: Array) -> tuple[Array, Array]:
        sn, cn, _, _ = ellipj(omega0 * t + quarter, k * k)
        return 2 * np.arcsin(k * sn), 2 * k * omega0 * cn

    return ConservativeMotion(float(amplitude), math.pi * omega0 / (2 * quarter), motion)
