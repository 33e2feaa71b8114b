"""The linear oscillator on a moving base: the chapter's starting point.

    m y'' + d y' + k y (+ m g) = m A w^2 cos(w t)                                          (16)
    u'' + 2 xi u' + u + gravity = Omega^2 cos(Omega tau),   tau = w1 t, u = y/A            (17)-(20)

with w1^2 = k/m, Omega = w/w1, xi = d/(2 m w1), gravity = g/(A w1^2) (varrho in the source). y is relative to the base
and measured from the unloaded spring. Transfer function U/Y0 = -s^2/(1 + 2 xi s + s^2) (the sign is an erratum of
(24)); peak 1/(2 xi sqrt(1 - xi^2)) at Omega = 1/sqrt(1 - 2 xi^2) for xi < 1/sqrt 2.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ..systems.system import System
from ._builder import Coil, physical_system
from ._model import model
from ._shaker import GRAVITY, positive, shaker

__all__ = ["linear_oscillator", "single_degree"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


@model(
    equation="u'' + 2 xi u' + u + gravity = Omega^2 cos(Omega tau)",
    source="equations (11)-(25), with errata (24), (25); catalogue 3",
    figure="3, 4",
    group="linear",
)
def linear_oscillator(*, xi: float = 0.021, Omega: float = 1.0, gravity: float = 0.0) -> System:
    """Linear oscillator on a moving base, u'' + 2 xi u' + u + gravity = Omega^2 cos(Omega tau).

    Parameters
    ----------
    xi : float
        Damping ratio d/(2 m w1).
    Omega : float
        Excitation over natural frequency.
    gravity : float
        varrho = g/(A w1^2); shifts the static position and nothing else.

    Returns
    -------
    System
        States ``u, u_dot`` (relative displacement over base amplitude); output ``u_absolute`` = u + cos(Omega tau).

    References
    ----------
    Source chapter, (11)-(25), figures 3 and 4.

    Examples
    --------
    >>> import stability as st
    >>> st.models.linear_oscillator(xi=0.05).parameters["xi"]
    0.05
    """
    u = sp.Function("u")(t)
    x, W, r = sp.symbols("xi Omega gravity", real=True)
    return System.from_equations(
        {u.diff(t, 2): -2 * x * u.diff(t) - u - r + W**2 * sp.cos(W * t)},
        [u],
        parameters=dict(xi=xi, Omega=Omega, gravity=gravity),
        bounds=dict(Omega=_POSITIVE),
        outputs=dict(u_absolute=u + sp.cos(W * t)),
        orders=dict(xi=1, gravity=1, u=-1),  # the base motion is 1, the response at resonance 1/eps
        name="linear_oscillator",
        description="linear oscillator on a moving base",
    )


def single_degree(
    name: str,
    description: str,
    potential: Any,
    parameters: dict[str, float],
    units: dict[str, str],
    *,
    mass: float,
    damping: float,
    amplitude: float | None,
    acceleration: float | None,
    frequency: float,
    gravity: bool,
    coil: Coil | None,
    force: Any = None,
) -> System:
    """m y'' + d y' + dU/dy (+ m g) = m A w^2 cos w t in SI units, for a potential U(y), further force and coil."""
    positive(mass=mass)
    positive(zero_allowed=True, damping=damping)
    base = shaker(amplitude, acceleration, frequency)
    y = sp.Function("y")(t)
    m, d, g = sp.symbols("mass damping g", real=True)
    v = y.diff(t)
    energy = potential(y) + (m * g * y if gravity else 0)
    load = m * base.load + (force(y, v) if force is not None else 0)
    values = {"mass": mass, "damping": damping, **parameters, **({"g": GRAVITY} if gravity else {})}
    return physical_system(
        name,
        description,
        m * v**2 / 2 - energy,
        [y],
        values,
        base=base,
        dissipation=d * v**2 / 2,
        forces={y: load},
        units={"mass": "kg", "damping": "N s/m", **units, "g": "m/s^2", "y": "m", "y_dot": "m/s", "y_mm": "mm"}
        if gravity
        else {"mass": "kg", "damping": "N s/m", **units, "y": "m", "y_dot": "m/s", "y_mm": "mm"},
        outputs=dict(y_mm=1000 * y, y_absolute=y + base.displacement, acceleration_g=base.acceleration / GRAVITY),
        coil=coil,
    )


@linear_oscillator.constructor
def from_physical(
    *,
    mass: float = 0.02,
    stiffness: float = 315.827,
    damping: float = 0.1056,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 20.0,
    gravity: bool = False,
    coil: Coil | None = None,
) -> System:
    """The linear oscillator in SI units: m y'' + d y' + k y (+ m g) = m A w^2 cos(w t).

    Parameters
    ----------
    mass : float
        m (kg).
    stiffness : float
        k (N/m).
    damping : float
        d (N s/m).
    amplitude, acceleration : float, optional
        Base amplitude A (m) or acceleration amplitude A w^2 (m/s^2); 0.5 g if neither is given.
    frequency : float
        w/2 pi (Hz).
    gravity : bool
        Adds the weight m g (9.81 m/s^2); y is then measured from the unloaded spring.
    coil : Coil, optional
        Electromagnetic transducer.

    Returns
    -------
    System
        States ``y, y_dot`` (m, m/s); outputs ``y_mm``, ``y_absolute`` and ``acceleration_g``.
    """
    positive(stiffness=stiffness)
    if amplitude is None and acceleration is None:
        acceleration = 0.5 * GRAVITY
    k = sp.Symbol("stiffness", real=True)
    return single_degree(
        "linear_oscillator", "linear oscillator on a moving base, SI units",
        lambda y: k * y**2 / 2, {"stiffness": stiffness}, {"stiffness": "N/m"},
        mass=mass, damping=damping, amplitude=amplitude, acceleration=acceleration, frequency=frequency,
        gravity=gravity, coil=coil,
    )  # fmt: skip
