"""Pendulums whose support or length moves: parametric excitation of a nonlinear oscillator.

Base-driven: massless rod of length l, mass m, pivot at y = A cos(w t), damping torque D phi':

    phi'' + D/(m l^2) phi' + ((g - A w^2 cos w t)/l) sin phi = 0            (43), (44) with the errata

In tau = w2 t, w2 = sqrt(g/l), Omega = w/w2, epsilon = A/l, xi = D/(2 m l^2 w2):

    phi'' + 2 xi phi' + (1 - epsilon Omega^2 cos Omega tau) sin phi = 0.

Upright (psi = phi - pi) the bracket changes its sign: Kapitza's pendulum, stable for about epsilon Omega > sqrt 2.
Linearised, this is Mathieu's equation with a = g/l, b = -A w^2/l, delta = D/(2 m l^2); q_M = 2A/l at every frequency.
Source: catalogue 5, 6; figures 8, 10. Errata: the sign of b, the l^2 in the damping term, and the chapter's operating
point (w = 10 rad/s is stable; figure 10 shows w = w2 = 9.526 rad/s).
"""

from __future__ import annotations

import sympy as sp

from ..systems.system import System
from ._model import model
from ._shaker import GRAVITY, positive, shaker

__all__ = ["base_driven_pendulum", "kapitza_pendulum", "variable_length_pendulum"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


def _restoring(angle: sp.Expr, linear: bool) -> sp.Expr:
    return angle if linear else sp.sin(angle)


@model(
    equation="phi'' + 2 xi phi' + (1 - epsilon Omega^2 cos(Omega tau)) sin(phi) = 0",
    source="equations (42)-(44) corrected; catalogue 5 (system 1), 6",
    figure="8, 10",
    group="parametric",
)
def base_driven_pendulum(*, epsilon: float = 0.1, Omega: float = 2.0, xi: float = 0.0, linear: bool = False) -> System:
    """Pendulum with a vertically driven pivot (figure 8, system 1; figure 10), hanging down at phi = 0.

    phi'' + 2 xi phi' + (1 - epsilon Omega^2 cos(Omega tau)) sin(phi) = 0, tau = w2 t.

    Parameters
    ----------
    epsilon : float
        Pivot amplitude over length, A/l.
    Omega : float
        Excitation over natural frequency, w/w2.
    xi : float
        Damping ratio.
    linear : bool
        phi in place of sin(phi).

    Returns
    -------
    System
        States ``phi, phi_dot``; phi is an angle (rad). `from_physical` gives it in SI units.

    References
    ----------
    Source chapter, (42)-(44), figures 8 and 10.

    Examples
    --------
    >>> import stability as st
    >>> st.models.base_driven_pendulum.from_physical(length=0.1081).parameters["frequency"]
    1.5
    """
    phi = sp.Function("phi")(t)
    e, W, x = sp.symbols("epsilon Omega xi", real=True)
    return System.from_equations(
        {phi.diff(t, 2): -2 * x * phi.diff(t) - (1 - e * W**2 * sp.cos(W * t)) * _restoring(phi, linear)},
        [phi],
        parameters=dict(epsilon=epsilon, Omega=Omega, xi=xi),
        bounds=dict(Omega=_POSITIVE),
        angles=() if linear else ("phi",),
        orders=dict(epsilon=2, xi=2, phi=1),
        name="base_driven_pendulum",
        description="pendulum with a vertically driven pivot",
    )


@base_driven_pendulum.constructor
def from_physical(
    *,
    length: float = 0.1081,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 1.5,
    mass: float = 0.01,
    damping: float = 0.0,
    gravity: float = GRAVITY,
    linear: bool = False,
) -> System:
    """The base-driven pendulum in SI units: phi'' + D/(m l^2) phi' + ((g - A w^2 cos w t)/l) sin(phi) = 0.

    Parameters
    ----------
    length : float
        l (m).
    amplitude, acceleration : float, optional
        Pivot amplitude A (m; 0.01 if neither is given) or acceleration amplitude A w^2 (m/s^2).
    frequency : float
        w/2 pi (Hz).
    mass : float
        m (kg).
    damping : float
        D (N m s/rad).
    gravity : float
        g (m/s^2).
    linear : bool
        phi in place of sin(phi).

    Returns
    -------
    System
        Output ``phi_deg`` (degrees).
    """
    positive(length=length, mass=mass, gravity=gravity)
    positive(zero_allowed=True, damping=damping)
    base = shaker(0.01 if amplitude is None and acceleration is None else amplitude, acceleration, frequency)
    phi = sp.Function("phi")(t)
    lc, m, D, g = sp.symbols("length mass damping gravity", real=True)
    rate = (g - base.load) / lc
    return System.from_equations(
        {phi.diff(t, 2): -D / (m * lc**2) * phi.diff(t) - rate * _restoring(phi, linear)},
        [phi],
        parameters=dict(base.parameters, length=length, mass=mass, damping=damping, gravity=gravity),
        units=dict(base.units, length="m", mass="kg", damping="N m s/rad", gravity="m/s^2", phi="rad", phi_deg="deg"),
        bounds=dict(base.bounds, length=_POSITIVE, mass=_POSITIVE),
        outputs=dict(phi_deg=180 * phi / sp.pi),
        angles=() if linear else ("phi",),
        base=base.motion,
        period=2 * sp.pi / base.omega,
        name="base_driven_pendulum",
        description="pendulum with a vertically driven pivot, SI units",
    )


@model(
    equation="psi'' + 2 xi psi' - (1 - epsilon Omega^2 cos(Omega tau)) sin(psi) = 0",
    source="catalogue 6; Kapitza (1951)",
    group="parametric",
)
def kapitza_pendulum(*, epsilon: float = 0.1, Omega: float = 20.0, xi: float = 0.05, linear: bool = False) -> System:
    """Inverted pendulum held upright by a fast pivot motion: stable for about epsilon Omega > sqrt(2).

    psi'' + 2 xi psi' - (1 - epsilon Omega^2 cos(Omega tau)) sin(psi) = 0, psi from the upright position.

    Parameters
    ----------
    epsilon : float
        Pivot amplitude over length, A/l.
    Omega : float
        Excitation over the hanging pendulum's natural frequency.
    xi : float
        Damping ratio.
    linear : bool
        psi in place of sin(psi).

    Returns
    -------
    System
        States ``psi, psi_dot``.

    References
    ----------
    P. L. Kapitza, Soviet Physics JETP 21 (1951) 588.

    Examples
    --------
    >>> import stability as st
    >>> st.models.kapitza_pendulum(Omega=30).angles
    ('psi',)
    """
    psi = sp.Function("psi")(t)
    e, W, x = sp.symbols("epsilon Omega xi", real=True)
    return System.from_equations(
        {psi.diff(t, 2): -2 * x * psi.diff(t) + (1 - e * W**2 * sp.cos(W * t)) * _restoring(psi, linear)},
        [psi],
        parameters=dict(epsilon=epsilon, Omega=Omega, xi=xi),
        bounds=dict(Omega=_POSITIVE),
        angles=() if linear else ("psi",),
        name="kapitza_pendulum",
        description="inverted pendulum with a driven pivot",
    )


@model(
    equation="phi'' + (2 l'/l + D/(m l^2)) phi' + (g/l) sin(phi) = 0,  l = l0 (1 + epsilon cos(omega t))",
    source="catalogue 5 (system 2)",
    figure="8",
    group="parametric",
)
def variable_length_pendulum(
    *,
    length: float = 1.0,
    epsilon: float = 0.1,
    omega: float = 6.264,
    mass: float = 1.0,
    damping: float = 0.0,
    gravity: float = GRAVITY,
    linear: bool = False,
) -> System:
    """Pendulum of varying length l(t) = l0 (1 + epsilon cos(omega t)) (figure 8, system 2), in SI units.

    phi'' + (2 l'/l + D/(m l^2)) phi' + (g/l) sin(phi) = 0; undamped and linear, psi = l phi obeys Hill's equation
    psi'' + ((g - l'')/l) psi = 0.

    Parameters
    ----------
    length : float
        Mean length l0 (m).
    epsilon : float
        Relative modulation, below 1.
    omega : float
        Modulation frequency (rad/s); the default is twice the natural frequency.
    mass : float
        m (kg).
    damping : float
        D (N m s/rad).
    gravity : float
        g (m/s^2).
    linear : bool
        phi in place of sin(phi).

    Returns
    -------
    System
        States ``phi, phi_dot``.

    References
    ----------
    Magnus, Popp and Sextro, Schwingungen; source chapter, figure 8.

    Examples
    --------
    >>> import stability as st
    >>> st.models.variable_length_pendulum(epsilon=0.2).states
    ('phi', 'phi_dot')
    """
    positive(length=length, mass=mass, gravity=gravity, omega=omega)
    positive(zero_allowed=True, damping=damping)
    phi = sp.Function("phi")(t)
    l0, e, w, m, D, g = sp.symbols("length epsilon omega mass damping gravity", real=True)
    now = l0 * (1 + e * sp.cos(w * t))
    rate = 2 * sp.diff(now, t) / now + D / (m * now**2)
    return System.from_equations(
        {phi.diff(t, 2): -rate * phi.diff(t) - g / now * _restoring(phi, linear)},
        [phi],
        parameters=dict(length=length, epsilon=epsilon, omega=omega, mass=mass, damping=damping, gravity=gravity),
        units=dict(length="m", omega="rad/s", mass="kg", damping="N m s/rad", gravity="m/s^2", phi="rad"),
        bounds=dict(omega=_POSITIVE, length=_POSITIVE, mass=_POSITIVE, epsilon=(-1 + 1e-9, 1 - 1e-9)),
        angles=() if linear else ("phi",),
        orders=dict(epsilon=2, damping=2, phi=1),
        name="variable_length_pendulum",
        description="pendulum of periodically varying length",
    )
