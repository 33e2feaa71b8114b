"""Electromagnetic vibration energy harvester: an oscillator on the shaker with a coil and a load.

    m y'' + d y' + k1 y + k3 y^3 + k_em i = m A w^2 cos(w t),      L_c i' + (R_c + R_l) i = k_em y',      P = R_l i^2

Power balance over a period: mean(-m y0'' y') = mean(d y'^2 + (R_c + R_l) i^2). Without inductance the coil is a damper
d_e = k_em^2/(R_c + R_l); at linear resonance the best load is R_l = R_c + k_em^2/d, with

    P_max = (m acc)^2/(8 d) * (k_em^2/d)/(R_c + k_em^2/d).

A coil goes on every physical model of the catalogue by ``coil=Coil(...)``; this one is the Duffing oscillator with a
coil as its default. Source: mentioned in the chapter; catalogue 11.
"""

from __future__ import annotations

import sympy as sp

from ..systems.system import System
from ._builder import Coil
from ._linear import single_degree
from ._model import model
from ._shaker import GRAVITY, positive

__all__ = ["harvester"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


@model(
    equation="u'' + 2 xi u' + u + beta u^3 + theta j = f cos(Omega tau);  lam j' + j = u'",
    source="catalogue 11",
    group="harvester",
)
def harvester(
    *,
    xi: float = 0.01,
    beta: float = 0.0,
    theta: float = 0.02,
    lam: float = 0.0021,
    f: float = 1.0,
    Omega: float = 1.0,
) -> System:
    """Electromagnetic harvester, dimensionless: u'' + 2 xi u' + u + beta u^3 + theta j = f cos, lam j' + j = u'.

    j is the current over k_em w1 X/(R_c + R_l), with X the length scale.

    Parameters
    ----------
    xi : float
        Mechanical damping ratio.
    beta : float
        Cubic coefficient.
    theta : float
        Coupling k_em^2/((R_c + R_l) m w1): electrical damping 2 xi_e.
    lam : float
        Electrical over mechanical time constant, w1 L_c/(R_c + R_l).
    f : float
        Acceleration amplitude over X w1^2.
    Omega : float
        Excitation over natural frequency.

    Returns
    -------
    System
        States ``u, j, u_dot``.

    References
    ----------
    Stephen, Journal of Sound and Vibration 293 (2006) 409; catalogue 11.

    Examples
    --------
    >>> import stability as st
    >>> st.models.harvester().states
    ('u', 'j', 'u_dot')
    """
    positive(lam=lam)
    u, j = sp.Function("u")(t), sp.Function("j")(t)
    x, b, th, la, F, W = sp.symbols("xi beta theta lam f Omega", real=True)
    return System.from_equations(
        {
            u.diff(t, 2): -2 * x * u.diff(t) - u - b * u**3 - th * j + F * sp.cos(W * t),
            j.diff(t): (u.diff(t) - j) / la,
        },
        [u, j],
        parameters=dict(xi=xi, beta=beta, theta=theta, lam=lam, f=f, Omega=Omega),
        bounds=dict(Omega=_POSITIVE, lam=_POSITIVE),
        outputs=dict(power=th * j**2),
        name="harvester",
        description="electromagnetic vibration energy harvester",
    )


@harvester.constructor
def from_physical(
    *,
    mass: float = 0.02,
    stiffness: float = 315.827,
    cubic: float = 0.0,
    damping: float = 0.05,
    coil: Coil | None = None,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 20.0,
    gravity: bool = False,
) -> System:
    """The harvester in SI units: m y'' + d y' + k1 y + k3 y^3 + k_em i = m A w^2 cos, L_c i' + (R_c + R_l) i = k_em y'.

    Parameters
    ----------
    mass : float
        m (kg).
    stiffness, cubic : float
        k1 (N/m; 20 Hz by default) and k3 (N/m^3).
    damping : float
        Mechanical d (N s/m).
    coil : Coil, optional
        The transducer; by default k_em = 5 V s/m, R_c = 50 ohm, R_l = 550 ohm, L_c = 10 mH.
    amplitude, acceleration : float, optional
        Base amplitude A (m) or acceleration amplitude A w^2 (m/s^2); 0.5 g if neither is given.
    frequency : float
        w/2 pi (Hz).
    gravity : bool
        Adds the weight m g.

    Returns
    -------
    System
        States ``y, i, y_dot`` (m, A, m/s), or ``y, y_dot`` without inductance; outputs ``power_mW``, ``current``.
    """
    positive(stiffness=stiffness)
    if coil is None:
        coil = Coil(coupling=5.0, coil_resistance=50.0, load_resistance=550.0, inductance=0.01)
    if amplitude is None and acceleration is None:
        acceleration = 0.5 * GRAVITY
    k1, k3 = sp.symbols("stiffness cubic", real=True)
    return single_degree(
        "harvester", "electromagnetic vibration energy harvester, SI units",
        lambda y: k1 * y**2 / 2 + k3 * y**4 / 4,
        {"stiffness": stiffness, "cubic": cubic}, {"stiffness": "N/m", "cubic": "N/m^3"},
        mass=mass, damping=damping, amplitude=amplitude, acceleration=acceleration, frequency=frequency,
        gravity=gravity, coil=coil,
    )  # fmt: skip
