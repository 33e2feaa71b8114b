"""One-sided springs: a magnet that floats over another, and a cubic spring that acts in compression only.

Magnet (catalogue 10): the repulsion falls with the fourth power of the distance, f = m g (h0/(h0 + y))^4, y upwards
from the equilibrium gap h0:

    m y'' + d y' + m g [1 - (h0/(h0 + y))^4] = m A w^2 cos(w t),            small-oscillation w0^2 = 4 g/h0

In tau = w0 t, u = y/h0 and with the acceleration amplitude in g: u'' + 2 xi u' + (1 - (1 + u)^-4)/4 = (acceleration/4)
cos(Omega tau). Softening upwards, hardening downwards; it works upright only. Free motion of a unilateral spring obeys
f <= 1/(2 sqrt(2 H/g)) with the peak-to-peak height H, which is why figure A3's 3.65 mm must be peak-to-peak.

Unilateral cubic spring: F = k1 y + k3 y^3 for y < 0, 0 for y > 0, with the weight m g.
"""

from __future__ import annotations

import sympy as sp

from ..systems.system import System
from ._builder import Coil
from ._linear import single_degree
from ._model import model
from ._shaker import GRAVITY, positive

__all__ = ["one_sided_magnet", "unilateral_spring"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


@model(
    equation="u'' + 2 xi u' + (1 - (1 + u)^-4)/4 = (acceleration/4) cos(Omega tau)",
    source="A.3; catalogue 10",
    figure="A3",
    group="nonlinear",
)
def one_sided_magnet(*, xi: float = 0.0529, acceleration: float = 0.5, Omega: float = 1.0) -> System:
    """Magnet floating over a magnet, u'' + 2 xi u' + (1 - (1 + u)^-4)/4 = (acceleration/4) cos(Omega tau).

    Parameters
    ----------
    xi : float
        Damping ratio d/(2 m w0).
    acceleration : float
        Base acceleration amplitude in g.
    Omega : float
        Excitation over the small-oscillation frequency w0 = 2 sqrt(g/h0).

    Returns
    -------
    System
        States ``u, u_dot``; u = y/h0 > -1.

    References
    ----------
    Source chapter, A.3, figure A3.

    Examples
    --------
    >>> import stability as st
    >>> st.models.one_sided_magnet.from_physical().parameters["gap"]
    0.0011
    """
    u = sp.Function("u")(t)
    x, acc, W = sp.symbols("xi acceleration Omega", real=True)
    return System.from_equations(
        {u.diff(t, 2): -2 * x * u.diff(t) - (1 - (1 + u) ** -4) / 4 + acc / 4 * sp.cos(W * t)},
        [u],
        parameters=dict(xi=xi, acceleration=acceleration, Omega=Omega),
        bounds=dict(Omega=_POSITIVE),
        orders=dict(xi=1, acceleration=1),
        name="one_sided_magnet",
        description="magnet floating over a magnet",
    )


@one_sided_magnet.constructor
def from_physical(
    *,
    mass: float = 0.02,
    gap: float = 1.1e-3,
    damping: float = 0.4,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 20.0,
    coil: Coil | None = None,
) -> System:
    """The floating magnet in SI units: m y'' + d y' + m g [1 - (h0/(h0 + y))^4] = m A w^2 cos(w t).

    Parameters
    ----------
    mass : float
        m (kg).
    gap : float
        Equilibrium gap h0 (m), an effective length; the default reproduces figure A3.
    damping : float
        d (N s/m); the default is d/m = 20 1/s.
    amplitude, acceleration : float, optional
        Base amplitude A (m) or acceleration amplitude A w^2 (m/s^2); 0.5 g if neither is given.
    frequency : float
        w/2 pi (Hz).
    coil : Coil, optional
        Electromagnetic transducer.

    Returns
    -------
    System
        States ``y, y_dot``; outputs ``y_mm``, ``y_absolute``, ``acceleration_g``.
    """
    positive(gap=gap, mass=mass)
    if amplitude is None and acceleration is None:
        acceleration = 0.5 * GRAVITY
    m, h, g = sp.symbols("mass gap g", real=True)
    return single_degree(
        "one_sided_magnet", "magnet floating over a magnet, SI units",
        lambda y: m * g * (y + h**4 / (3 * (h + y) ** 3)),
        {"gap": gap, "g": GRAVITY}, {"gap": "m", "g": "m/s^2"},
        mass=mass, damping=damping, amplitude=amplitude, acceleration=acceleration, frequency=frequency,
        gravity=False, coil=coil,
    )  # fmt: skip


@model(
    equation="u'' + 2 xi u' + min(u, 0) + beta min(u, 0)^3 + gravity = Omega^2 cos(Omega tau)",
    source="A.3 (alternative); catalogue 10",
    figure="A3",
    group="nonlinear",
)
def unilateral_spring(*, xi: float = 0.0272, beta: float = 0.01, Omega: float = 0.6, gravity: float = 2.0) -> System:
    """Cubic spring that acts in compression only, held down by gravity: free flight above u = 0.

    u'' + 2 xi u' + min(u, 0) + beta min(u, 0)^3 + gravity = Omega^2 cos(Omega tau).

    Parameters
    ----------
    xi : float
        Damping ratio of the linear spring (acts in flight, too).
    beta : float
        Cubic coefficient k3 A^2/k1.
    Omega : float
        Excitation over sqrt(k1/m).
    gravity : float
        varrho = g/(A w1^2); the only force that brings the mass back.

    Returns
    -------
    System
        States ``u, u_dot``.

    References
    ----------
    Source chapter, A.3.

    Examples
    --------
    >>> import stability as st
    >>> st.models.unilateral_spring().states
    ('u', 'u_dot')
    """
    u = sp.Function("u")(t)
    x, b, W, r = sp.symbols("xi beta Omega gravity", real=True)
    pressed = sp.Min(u, 0)
    return System.from_equations(
        {u.diff(t, 2): -2 * x * u.diff(t) - pressed - b * pressed**3 - r + W**2 * sp.cos(W * t)},
        [u],
        parameters=dict(xi=xi, beta=beta, Omega=Omega, gravity=gravity),
        bounds=dict(Omega=_POSITIVE, gravity=(0, float("inf"))),
        orders=dict(xi=1, beta=1),
        name="unilateral_spring",
        description="cubic spring in compression only, under gravity",
    )


def _unilateral_from_physical(
    *,
    mass: float = 0.020,
    stiffness: float = 315.827,
    cubic: float = 1.90e7,
    damping: float = 0.1365,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 15.0,
    coil: Coil | None = None,
) -> System:
    """The one-sided cubic spring in SI units: m y'' + d y' + F(y) + m g = m A w^2 cos(w t), F = 0 for y > 0.

    Parameters
    ----------
    mass : float
        m (kg).
    stiffness, cubic : float
        F = k1 y + k3 y^3 for y < 0 (N/m, N/m^3); the defaults are the spring of figure 11.
    damping : float
        d (N s/m).
    amplitude, acceleration : float, optional
        Base amplitude A (m) or acceleration amplitude A w^2 (m/s^2); 0.5 g if neither is given.
    frequency : float
        w/2 pi (Hz).
    coil : Coil, optional
        Electromagnetic transducer.

    Returns
    -------
    System
        States ``y, y_dot``, y from the unloaded end of the spring; always with gravity.
    """
    positive(stiffness=stiffness)
    if amplitude is None and acceleration is None:
        acceleration = 0.5 * GRAVITY
    k1, k3 = sp.symbols("stiffness cubic", real=True)

    def spring(y: sp.Expr, v: sp.Expr) -> sp.Expr:
        pressed = sp.Min(y, 0)
        return -k1 * pressed - k3 * pressed**3

    return single_degree(
        "unilateral_spring", "cubic spring in compression only, under gravity, SI units",
        lambda y: sp.S.Zero, {"stiffness": stiffness, "cubic": cubic}, {"stiffness": "N/m", "cubic": "N/m^3"},
        mass=mass, damping=damping, amplitude=amplitude, acceleration=acceleration, frequency=frequency,
        gravity=True, coil=coil, force=spring,
    )  # fmt: skip


_unilateral_from_physical.__name__ = "from_physical"
unilateral_spring.constructor(_unilateral_from_physical)
