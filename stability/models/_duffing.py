"""Duffing's oscillator on a moving base, and in its textbook form.

    m y'' + d y' + k1 y + k3 y^3 (+ m g) = m A w^2 cos(w t)                                  (50)
    u'' + 2 xi u' + u + beta u^3 + gravity = Omega^2 cos(Omega tau),  beta = k3 A^2/k1       (53)
    x'' + delta x' + alpha x + beta x^3 = gamma cos(omega t)                                 textbook

The base forcing Omega^2 makes the response peak close only for beta < 16 xi^2/3; above it the upper branch never turns
back (open resonance). For constant acceleration A changes with the frequency: use `from_physical(acceleration=...)`,
where nothing is scaled by A. Source: catalogue 7; figures 9, 11 (swapped with 10 in the text).
"""

from __future__ import annotations

import sympy as sp

from ..systems.system import System
from ._builder import Coil
from ._linear import single_degree
from ._model import model
from ._shaker import GRAVITY, positive

__all__ = ["duffing", "duffing_mathieu", "duffing_textbook"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


@model(
    equation="u'' + 2 xi u' + u + beta u^3 + gravity = Omega^2 cos(Omega tau)",
    source="equations (45)-(53); catalogue 7",
    figure="9, 11",
    group="nonlinear",
)
def duffing(*, xi: float = 0.02, beta: float = 0.001, Omega: float = 1.0, gravity: float = 0.0) -> System:
    """Duffing's oscillator on a moving base, u'' + 2 xi u' + u + beta u^3 + gravity = Omega^2 cos(Omega tau).

    Parameters
    ----------
    xi : float
        Damping ratio.
    beta : float
        Cubic coefficient k3 A^2/k1; the peak closes for beta < 16 xi^2/3.
    Omega : float
        Excitation over the linear natural frequency.
    gravity : float
        varrho = g/(A w1^2): shifts the equilibrium, changes the stiffness and adds a quadratic term.

    Returns
    -------
    System
        States ``u, u_dot``; output ``u_absolute`` = u + cos(Omega tau).

    References
    ----------
    Source chapter, (53), figures 9 and 11; Nayfeh and Mook, Nonlinear Oscillations (1979), ch. 4.

    Examples
    --------
    >>> import stability as st
    >>> st.models.duffing(xi=0.02, beta=0.001).states
    ('u', 'u_dot')
    """
    u = sp.Function("u")(t)
    x, b, W, r = sp.symbols("xi beta Omega gravity", real=True)
    return System.from_equations(
        {u.diff(t, 2): -2 * x * u.diff(t) - u - b * u**3 - r + W**2 * sp.cos(W * t)},
        [u],
        parameters=dict(xi=xi, beta=beta, Omega=Omega, gravity=gravity),
        bounds=dict(Omega=_POSITIVE),
        outputs=dict(u_absolute=u + sp.cos(W * t)),
        # the base motion is 1, the response at resonance and a static deflection that is not zero are 1/eps
        orders=dict(xi=1, beta=3, gravity=-1 if gravity else 1, u=-1),
        name="duffing",
        description="Duffing's oscillator on a moving base",
    )


@duffing.constructor
def from_physical(
    *,
    mass: float = 0.020,
    stiffness: float = 315.827,
    cubic: float = 1.90e7,
    damping: float = 0.1365,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 25.0,
    gravity: bool = False,
    coil: Coil | None = None,
) -> System:
    """Duffing's oscillator in SI units: m y'' + d y' + k1 y + k3 y^3 (+ m g) = m A w^2 cos(w t).

    The defaults are those of figure 11 (0.5 g; chosen to put the upper fold at 27 Hz and 4.3 mm).

    Parameters
    ----------
    mass : float
        m (kg).
    stiffness : float
        k1 (N/m).
    cubic : float
        k3 (N/m^3); negative softens, with an escape at |y| = sqrt(k1/|k3|).
    damping : float
        d (N s/m).
    amplitude, acceleration : float, optional
        Base amplitude A (m) or acceleration amplitude A w^2 (m/s^2); 0.5 g if neither is given.
    frequency : float
        w/2 pi (Hz).
    gravity : bool
        Adds the weight m g.
    coil : Coil, optional
        Electromagnetic transducer.

    Returns
    -------
    System
        States ``y, y_dot`` (m, m/s); outputs ``y_mm``, ``y_absolute``, ``acceleration_g``.
    """
    positive(stiffness=stiffness)
    if amplitude is None and acceleration is None:
        acceleration = 0.5 * GRAVITY
    k1, k3 = sp.symbols("stiffness cubic", real=True)
    system = single_degree(
        "duffing", "Duffing's oscillator on a moving base, SI units",
        lambda y: k1 * y**2 / 2 + k3 * y**4 / 4,
        {"stiffness": stiffness, "cubic": cubic}, {"stiffness": "N/m", "cubic": "N/m^3"},
        mass=mass, damping=damping, amplitude=amplitude, acceleration=acceleration, frequency=frequency,
        gravity=gravity, coil=coil,
    )  # fmt: skip
    return system.replace(orders=dict(damping=1, cubic=1, **{system.base.parameter: 1}) if system.base else {})


@model(
    equation="x'' + delta x' + alpha x + beta x^3 = gamma cos(omega t)",
    source="catalogue 7; Guckenheimer and Holmes (1983)",
    group="nonlinear",
)
def duffing_textbook(
    *, delta: float = 0.1, alpha: float = 1.0, beta: float = 1.0, gamma: float = 5.0, omega: float = 1.0
) -> System:
    """Duffing's oscillator as the textbooks write it, x'' + delta x' + alpha x + beta x^3 = gamma cos(omega t).

    Parameters
    ----------
    delta : float
        Damping coefficient.
    alpha : float
        Linear stiffness; negative for the double well.
    beta : float
        Cubic stiffness.
    gamma : float
        Forcing amplitude.
    omega : float
        Forcing frequency (rad/time).

    Returns
    -------
    System
        States ``x, x_dot``.

    References
    ----------
    Guckenheimer and Holmes, Nonlinear Oscillations (1983), section 2.2.

    Examples
    --------
    >>> import stability as st
    >>> st.models.duffing_textbook(alpha=-1.0).parameters["alpha"]
    -1.0
    """
    x = sp.Function("x")(t)
    d, a, b, c, w = sp.symbols("delta alpha beta gamma omega", real=True)
    return System.from_equations(
        {x.diff(t, 2): -d * x.diff(t) - a * x - b * x**3 + c * sp.cos(w * t)},
        [x],
        parameters=dict(delta=delta, alpha=alpha, beta=beta, gamma=gamma, omega=omega),
        bounds=dict(omega=_POSITIVE),
        orders=dict(delta=1, beta=1, gamma=1),
        name="duffing_textbook",
        description="Duffing's oscillator",
    )


@model(
    equation="u'' + 2 xi u' + (1 + h cos(2 Omega t)) u + beta u^3 = 0",
    source="Nayfeh and Mook (1979), section 5.7",
    group="parametric",
)
def duffing_mathieu(*, xi: float = 0.02, h: float = 0.2, beta: float = 0.1, Omega: float = 1.0) -> System:
    """Parametrically excited Duffing oscillator, u'' + 2 xi u' + (1 + h cos(2 Omega t)) u + beta u^3 = 0.

    Parameters
    ----------
    xi : float
        Damping ratio.
    h : float
        Modulation depth; the trivial solution is unstable near Omega = 1 for h > 4 xi.
    beta : float
        Cubic coefficient.
    Omega : float
        Half the modulation frequency: the principal resonance stands at 1.

    Returns
    -------
    System
        States ``u, u_dot``; period pi/Omega.

    References
    ----------
    Nayfeh and Mook, Nonlinear Oscillations (1979), section 5.7.

    Examples
    --------
    >>> import math, stability as st
    >>> st.models.duffing_mathieu().period == math.pi
    True
    """
    u = sp.Function("u")(t)
    x, hh, b, W = sp.symbols("xi h beta Omega", real=True)
    return System.from_equations(
        {u.diff(t, 2): -2 * x * u.diff(t) - (1 + hh * sp.cos(2 * W * t)) * u - b * u**3},
        [u],
        parameters=dict(xi=xi, h=h, beta=beta, Omega=Omega),
        bounds=dict(Omega=_POSITIVE),
        orders=dict(xi=1, h=1, beta=1),
        name="duffing_mathieu",
        description="parametrically excited Duffing oscillator",
    )
