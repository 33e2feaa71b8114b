"""A mass held by a modulated string or spring, and the rotating flat shaft: modulated stiffness in mechanics.

String (figure 8, system 3): mass m in the middle of a string of half length a under the imposed tension S(t),

    m y'' + d y' + 2 S(t) y/sqrt(a^2 + y^2) = 0,      linear: 2 S(t) y/a,      S = S0 (1 + epsilon cos(omega t)).

Shaft: a flat shaft turning at omega_rot meets the mass with its stiff and its soft side twice a turn,

    m y'' + d y' + k0 (1 + epsilon cos(2 omega_rot t)) y = 0.
"""

from __future__ import annotations

import sympy as sp

from ..systems.system import System
from ._model import model
from ._shaker import positive

__all__ = ["modulated_string", "rotating_shaft"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


@model(
    equation="m y'' + d y' + 2 S(t) y/sqrt(a^2 + y^2) = 0,  S = S0 (1 + epsilon cos(omega t))",
    source="catalogue 5 (system 3)",
    figure="8",
    group="parametric",
)
def modulated_string(
    *,
    mass: float = 0.01,
    half_length: float = 0.5,
    tension: float = 10.0,
    epsilon: float = 0.2,
    omega: float = 126.0,
    damping: float = 0.0,
    linear: bool = False,
) -> System:
    """Mass in the middle of a string whose tension is modulated (figure 8, system 3), in SI units.

    m y'' + d y' + 2 S(t) y/sqrt(a^2 + y^2) = 0 with S(t) = S0 (1 + epsilon cos(omega t)); linear: 2 S(t) y/a.

    Parameters
    ----------
    mass : float
        m (kg).
    half_length : float
        a (m).
    tension : float
        Mean tension S0 (N).
    epsilon : float
        Relative modulation.
    omega : float
        Modulation frequency (rad/s); the default is about twice the natural frequency sqrt(2 S0/(m a)) = 63.2 rad/s.
    damping : float
        d (N s/m).
    linear : bool
        Small deflections.

    Returns
    -------
    System
        States ``y, y_dot`` (m, m/s).

    References
    ----------
    Source chapter, figure 8; Magnus, Popp and Sextro, Schwingungen.

    Examples
    --------
    >>> import stability as st
    >>> st.models.modulated_string(linear=True).states
    ('y', 'y_dot')
    """
    positive(mass=mass, half_length=half_length, tension=tension, omega=omega)
    positive(zero_allowed=True, damping=damping)
    y = sp.Function("y")(t)
    m, a, S0, e, w, d = sp.symbols("mass half_length tension epsilon omega damping", real=True)
    slope = y / a if linear else y / sp.sqrt(a**2 + y**2)
    return System.from_equations(
        {y.diff(t, 2): -d / m * y.diff(t) - 2 * S0 * (1 + e * sp.cos(w * t)) / m * slope},
        [y],
        parameters=dict(
            mass=mass, half_length=half_length, tension=tension, epsilon=epsilon, omega=omega, damping=damping
        ),
        units=dict(mass="kg", half_length="m", tension="N", omega="rad/s", damping="N s/m", y="m", y_dot="m/s"),
        bounds=dict(omega=_POSITIVE, mass=_POSITIVE, half_length=_POSITIVE),
        orders=dict(epsilon=2, damping=2, y=1),
        name="modulated_string",
        description="mass on a string of modulated tension",
    )


@model(
    equation="m y'' + d y' + k0 (1 + epsilon cos(2 omega_rot t)) y = 0",
    source="catalogue 5 (system 3, variant)",
    figure="8",
    group="parametric",
)
def rotating_shaft(
    *,
    mass: float = 1.0,
    stiffness: float = 1.0e4,
    epsilon: float = 0.2,
    omega_rot: float = 100.0,
    damping: float = 0.0,
) -> System:
    """Mass on a flat shaft that turns: the stiffness in the guided direction varies twice a turn (SI units).

    m y'' + d y' + k0 (1 + epsilon cos(2 omega_rot t)) y = 0; the first tongue stands at omega_rot = sqrt(k0/m).

    Parameters
    ----------
    mass : float
        m (kg).
    stiffness : float
        Mean stiffness k0 (N/m).
    epsilon : float
        Relative difference of the two stiffnesses.
    omega_rot : float
        Speed of rotation (rad/s).
    damping : float
        d (N s/m).

    Returns
    -------
    System
        States ``y, y_dot`` (m, m/s).

    References
    ----------
    Magnus, Popp and Sextro, Schwingungen.

    Examples
    --------
    >>> import math, stability as st
    >>> round(st.models.rotating_shaft().period*100/math.pi, 12)
    1.0
    """
    positive(mass=mass, stiffness=stiffness, omega_rot=omega_rot)
    positive(zero_allowed=True, damping=damping)
    y = sp.Function("y")(t)
    m, k, e, w, d = sp.symbols("mass stiffness epsilon omega_rot damping", real=True)
    return System.from_equations(
        {y.diff(t, 2): -d / m * y.diff(t) - k / m * (1 + e * sp.cos(2 * w * t)) * y},
        [y],
        parameters=dict(mass=mass, stiffness=stiffness, epsilon=epsilon, omega_rot=omega_rot, damping=damping),
        units=dict(mass="kg", stiffness="N/m", omega_rot="rad/s", damping="N s/m", y="m", y_dot="m/s"),
        bounds=dict(omega_rot=_POSITIVE, mass=_POSITIVE),
        orders=dict(epsilon=1, damping=1),
        name="rotating_shaft",
        description="mass on a rotating flat shaft",
    )
