"""The autoparametric spring-mass-pendulum, and the quadratic 2:1 system that shares its resonance.

A mass m1 on a spring and damper moves vertically on a moving base; a pendulum (l, m2, D) hangs from it. With y relative
to the base, m = m1 + m2:

    m y'' + d y' + k y (+ m g) + m2 l (phi'^2 cos phi + phi'' sin phi) = m A w^2 cos(w t)            (62)
    m2 l^2 phi'' + D phi' + m2 l (g + y'' - A w^2 cos(w t)) sin phi = 0                              (63) corrected

Dimensionless, tau = w1 t, u = y/A, theta = phi:

    u'' + 2 xi1 u' + u + lm ll (theta'^2 cos theta + theta'' sin theta) = Omega^2 cos(Omega tau)
    theta'' + 2 xi2 Omega0 theta' + sin theta (Omega0^2 + (u'' - Omega^2 cos(Omega tau))/ll) = 0

lm = m2/m (`mass_ratio_total`), ll = l/A (`length_ratio`), Omega0 = w2/w1, w1^2 = k/m, w2^2 = g/l, xi1 = d/(2 m w1),
xi2 = D/(2 m2 l^2 w2); gravity shifts u only and is dropped. Errata: the base term -Omega^2 cos(Omega tau) is missing
from the printed (67) (`base_term=False`); xi1 stands on the total mass; Omega0 = 1/2, not 2. Source: (54)-(67);
catalogue 9; figures 12, 13.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ..systems.system import System
from ._builder import Coil, physical_system
from ._model import model
from ._shaker import GRAVITY, positive, shaker

__all__ = ["autoparametric_pendulum", "autoparametric_quadratic"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


def _dimensionless(
    length_ratio: Any, values: dict[str, float], base_term: bool, bounds: dict[str, Any], scale: dict[str, int],
    **others: Any,
) -> System:
    u, th = sp.Function("u")(t), sp.Function("theta")(t)
    x1, x2, lm, W0, W = sp.symbols("xi1 xi2 mass_ratio_total Omega0 Omega", real=True)
    ud, thd, udd, thdd = u.diff(t), th.diff(t), u.diff(t, 2), th.diff(t, 2)
    load = W**2 * sp.cos(W * t)
    support = udd - load if base_term else udd
    swing = thd**2 * sp.cos(th) + thdd * sp.sin(th)
    return System.from_equations(
        [
            sp.Eq(udd + 2 * x1 * ud + u + lm * length_ratio * swing, load),
            sp.Eq(thdd + 2 * x2 * W0 * thd + sp.sin(th) * (W0**2 + support / length_ratio), 0),
        ],
        [u, th],
        parameters=values,
        bounds=dict(Omega=_POSITIVE, mass_ratio_total=(0, 1 - 1e-9), **bounds),
        period=2 * sp.pi / W,
        angles=("theta",),
        outputs=dict(u_absolute=u + sp.cos(W * t)),
        units=dict(theta="rad"),
        orders=dict(xi1=1, xi2=1, u=-1, theta=1, **scale),
        name="autoparametric_pendulum",
        **others,
    )


@model(
    equation="u'' + 2 xi1 u' + u + lm ll (th'^2 cos th + th'' sin th) = Omega^2 cos(Omega tau);  "
    "th'' + 2 xi2 Omega0 th' + sin th (Omega0^2 + (u'' - Omega^2 cos(Omega tau))/ll) = 0",
    source="equations (54)-(67) with errata (63), (64), (67); catalogue 9",
    figure="12, 13",
    group="autoparametric",
)
def autoparametric_pendulum(
    *,
    xi1: float = 0.002,
    xi2: float = 0.005,
    mass_ratio_total: float = 0.2,
    length_ratio: float = 1000.0,
    Omega0: float = 0.48,
    Omega: float = 1.0,
    base_term: bool = True,
) -> System:
    """Spring-mass system that carries a pendulum, on a moving base: the autoparametric vibration absorber.

    u'' + 2 xi1 u' + u + lm ll (th'^2 cos th + th'' sin th) = Omega^2 cos(Omega tau);
    th'' + 2 xi2 Omega0 th' + sin th (Omega0^2 + (u'' - Omega^2 cos(Omega tau))/ll) = 0.
    The default is slightly detuned, so that the nontrivial branch has torus points between the two resonances.

    Parameters
    ----------
    xi1 : float
        Damping ratio of the primary, d/(2 m w1) with the total mass m.
    xi2 : float
        Damping ratio of the pendulum, D/(2 m2 l^2 w2).
    mass_ratio_total : float
        lm = m2/(m1 + m2), in [0, 1).
    length_ratio : float
        ll = l/A.
    Omega0 : float
        Pendulum over primary natural frequency; 1/2 is exact 2:1 tuning.
    Omega : float
        Excitation over primary natural frequency.
    base_term : bool
        False gives the printed (67), without the direct base term.

    Returns
    -------
    System
        States ``u, theta, u_dot, theta_dot``; theta is an angle (rad); output ``u_absolute`` = u + cos(Omega tau).

    References
    ----------
    Source chapter, (54)-(67), figures 12 and 13; Tondl et al., Autoparametric Resonance (2000).

    Examples
    --------
    >>> import stability as st
    >>> st.models.autoparametric_pendulum().angles
    ('theta',)
    """
    values = dict(
        xi1=xi1, xi2=xi2, mass_ratio_total=mass_ratio_total, length_ratio=length_ratio, Omega0=Omega0, Omega=Omega
    )
    return _dimensionless(
        sp.Symbol("length_ratio", real=True), values, base_term, dict(length_ratio=_POSITIVE), dict(length_ratio=-2),
        description="mass on a spring that carries a pendulum, on a moving base",
    )  # fmt: skip


@autoparametric_pendulum.constructor
def from_acceleration(
    *,
    acceleration: float = 0.002,
    xi1: float = 0.002,
    xi2: float = 0.005,
    mass_ratio_total: float = 0.2,
    Omega0: float = 0.48,
    Omega: float = 1.0,
    base_term: bool = True,
) -> System:
    """The same at constant base acceleration: length_ratio = Omega^2/(acceleration Omega0^2).

    Parameters
    ----------
    acceleration : float
        A w^2/g (in units of g).
    xi1, xi2, mass_ratio_total, Omega0, Omega, base_term
        As in the model itself.

    Returns
    -------
    System
        With the parameter ``acceleration`` in place of ``length_ratio``.
    """
    W, W0, acc = sp.symbols("Omega Omega0 acceleration", real=True)
    values = dict(
        xi1=xi1, xi2=xi2, mass_ratio_total=mass_ratio_total, acceleration=acceleration, Omega0=Omega0, Omega=Omega
    )
    return _dimensionless(
        W**2 / (acc * W0**2), values, base_term, dict(acceleration=(0, float("inf")), Omega0=_POSITIVE),
        dict(acceleration=2),
        description="mass on a spring that carries a pendulum, at constant base acceleration (g)",
    )  # fmt: skip


@autoparametric_pendulum.constructor
def from_physical(
    *,
    mass1: float = 0.04,
    mass2: float = 0.01,
    stiffness: float | None = None,
    damping: float | None = None,
    length: float | None = None,
    pendulum_damping: float | None = None,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 22.22,
    gravity: bool = True,
    coil: Coil | None = None,
) -> System:
    """The autoparametric pendulum in SI units (figure 13: 0.2 g at 22.22 Hz, w1 = 2 w2 = w).

    m y'' + d y' + k y + m2 l (phi'^2 cos phi + phi'' sin phi) = m A w^2 cos(w t);
    m2 l^2 phi'' + D phi' + m2 l (g + y'' - A w^2 cos(w t)) sin phi = 0. y is measured from the static position.

    Parameters
    ----------
    mass1, mass2 : float
        Primary and pendulum mass (kg).
    stiffness : float, optional
        k (N/m); by default w1 = 2 pi 22.22 Hz.
    damping : float, optional
        d (N s/m); by default xi1 = 0.021.
    length : float, optional
        l (m); by default w2 = w1/2, 2.0132 mm.
    pendulum_damping : float, optional
        D (N m s/rad); by default xi2 = 0.021.
    amplitude, acceleration : float, optional
        Base amplitude A (m) or acceleration amplitude (m/s^2); 0.2 g if neither is given.
    frequency : float
        w/2 pi (Hz).
    gravity : bool
        False removes the pendulum's gravity (it then has no natural frequency).
    coil : Coil, optional
        Electromagnetic transducer on y or, as a rotary one, on phi (``coordinate="phi"``).

    Returns
    -------
    System
        States ``y, phi, y_dot, phi_dot``; outputs ``y_mm`` and ``phi_deg``.
    """
    positive(mass1=mass1, mass2=mass2)
    w1 = float(2 * sp.pi * 22.22)
    stiffness = (mass1 + mass2) * w1**2 if stiffness is None else stiffness
    length = GRAVITY / (w1 / 2) ** 2 if length is None else length
    positive(stiffness=stiffness, length=length)
    own1, own2 = (stiffness / (mass1 + mass2)) ** 0.5, (GRAVITY / length) ** 0.5
    damping = 2 * 0.021 * (mass1 + mass2) * own1 if damping is None else damping
    pendulum_damping = 2 * 0.021 * mass2 * length**2 * own2 if pendulum_damping is None else pendulum_damping
    positive(zero_allowed=True, damping=damping, pendulum_damping=pendulum_damping)
    if amplitude is None and acceleration is None:
        acceleration = 0.2 * GRAVITY
    base = shaker(amplitude, acceleration, frequency)
    y, phi = sp.Function("y")(t), sp.Function("phi")(t)
    m1, m2, k, d, lp, D, g = sp.symbols("mass1 mass2 stiffness damping length pendulum_damping g", real=True)
    v, w = y.diff(t), phi.diff(t)
    kinetic = (m1 + m2) * v**2 / 2 + m2 * lp * sp.sin(phi) * w * v + m2 * lp**2 * w**2 / 2
    potential = k * y**2 / 2 - (m2 * g * lp * sp.cos(phi) if gravity else 0)
    values = dict(
        mass1=mass1, mass2=mass2, stiffness=stiffness, damping=damping, length=length, pendulum_damping=pendulum_damping
    )
    units = dict(
        mass1="kg", mass2="kg", stiffness="N/m", damping="N s/m", length="m", pendulum_damping="N m s/rad",
        y="m", phi="rad", y_mm="mm", phi_deg="deg", **({"g": "m/s^2"} if gravity else {}),
    )  # fmt: skip
    system = physical_system(
        "autoparametric_pendulum", "mass on a spring that carries a pendulum, SI units", kinetic - potential, [y, phi],
        {**values, **({"g": GRAVITY} if gravity else {})},
        base=base, dissipation=d * v**2 / 2 + D * w**2 / 2,
        forces={y: (m1 + m2) * base.load, phi: m2 * lp * base.load * sp.sin(phi)},
        units=units, outputs=dict(y_mm=1000 * y, phi_deg=180 * phi / sp.pi), angles=("phi",), coil=coil,
    )  # fmt: skip
    small = dict(damping=1, pendulum_damping=1, y=1, phi=1)
    return system.replace(orders={**small, system.base.parameter: 2} if system.base else small)


@model(
    equation="x'' + 2 xi1 x' + x + g1 y^2 = f cos(eta t);  y'' + 2 xi2 y' + q^2 y + g2 x y = 0",
    source="Tondl et al. (2000), ch. 2-5; Nayfeh and Mook (1979), section 6.5",
    group="autoparametric",
)
def autoparametric_quadratic(
    *,
    xi1: float = 0.01,
    xi2: float = 0.01,
    q: float = 0.5,
    g1: float = 0.1,
    g2: float = 0.12,
    f: float = 0.02,
    eta: float = 1.0,
) -> System:
    """Two oscillators with quadratic coupling in 2:1 internal resonance: the simplest autoparametric system.

    x'' + 2 xi1 x' + x + g1 y^2 = f cos(eta t); y'' + 2 xi2 y' + q^2 y + g2 x y = 0.

    Parameters
    ----------
    xi1, xi2 : float
        Damping.
    q : float
        Natural frequency of the second oscillator; 1/2 is exact tuning.
    g1, g2 : float
        Coupling coefficients.
    f : float
        Forcing amplitude; above f_c = (2/g2)|D1||D2| the semi-trivial solution y = 0 is unstable.
    eta : float
        Forcing frequency.

    Returns
    -------
    System
        States ``x, y, x_dot, y_dot``.

    References
    ----------
    Tondl, Ruijgrok, Verhulst and Nabergoj, Autoparametric Resonance in Mechanical Systems (2000).

    Examples
    --------
    >>> import stability as st
    >>> st.models.autoparametric_quadratic().coordinates
    ('x', 'y')
    """
    x, y = sp.Function("x")(t), sp.Function("y")(t)
    x1, x2, qq, c1, c2, F, w = sp.symbols("xi1 xi2 q g1 g2 f eta", real=True)
    return System.from_equations(
        {
            x.diff(t, 2): -2 * x1 * x.diff(t) - x - c1 * y**2 + F * sp.cos(w * t),
            y.diff(t, 2): -2 * x2 * y.diff(t) - qq**2 * y - c2 * x * y,
        },
        [x, y],
        parameters=dict(xi1=xi1, xi2=xi2, q=q, g1=g1, g2=g2, f=f, eta=eta),
        bounds=dict(eta=_POSITIVE),
        orders=dict(xi1=1, xi2=1, g1=1, g2=1, f=1),
        name="autoparametric_quadratic",
        description="two oscillators with quadratic coupling, 2:1",
    )
