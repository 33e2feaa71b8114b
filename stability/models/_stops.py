"""An oscillator between stops, hard or soft, and an oscillator on any spring.

Soft stop at |u| = gap: while in contact an extra spring and damper act,

    u'' + 2 xi u' + u + kappa (|u| - gap)+ sign(u) + 2 eta u' [|u| > gap] = Omega^2 cos(Omega tau).

Hard stop: u'+ = -e u'- at |u| = gap (`HardStop`; found as an event by simulation and shooting). Source: A.3 and
catalogue 2. `spring_oscillator` puts any spring of the catalogue (power law, polynomial, piecewise, table, magnet)
under a mass on the shaker.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ..errors import InputError
from ..systems.stops import HardStop
from ..systems.system import System
from ._builder import Coil
from ._linear import single_degree
from ._model import model
from ._shaker import GRAVITY, positive

__all__ = ["hard_stop_oscillator", "soft_stop_oscillator", "spring_oscillator"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


def _sides(sides: str) -> tuple[bool, bool]:
    if sides not in ("both", "above", "below"):
        raise InputError(f"sides must be 'both', 'above' or 'below'; got {sides!r}")
    return sides in ("both", "above"), sides in ("both", "below")


@model(
    equation="u'' + 2 xi u' + u + kappa (|u| - gap)+ sign(u) + 2 eta u' [|u| > gap] = Omega^2 cos(Omega tau)",
    source="A.3; catalogue 2",
    group="impact",
)
def soft_stop_oscillator(
    *,
    xi: float = 0.021,
    gap: float = 5.0,
    kappa: float = 10.0,
    eta: float = 0.0,
    Omega: float = 1.0,
    sides: str = "both",
) -> System:
    """Linear oscillator between soft stops: extra stiffness and damping in contact.

    u'' + 2 xi u' + u + kappa (|u| - gap)+ sign(u) + 2 eta u' [|u| > gap] = Omega^2 cos(Omega tau).

    Parameters
    ----------
    xi : float
        Damping ratio.
    gap : float
        Distance of the stops from rest, in base amplitudes.
    kappa : float
        Stiffness of a stop over that of the spring.
    eta : float
        Damping ratio of a stop, in contact only.
    Omega : float
        Excitation over natural frequency.
    sides : str
        ``"both"``, ``"above"`` or ``"below"``.

    Returns
    -------
    System
        States ``u, u_dot``; piecewise smooth.

    Raises
    ------
    InputError
        If the gap is not positive (stops that overlap at rest) or `sides` is another word.

    References
    ----------
    Source chapter, A.3.

    Examples
    --------
    >>> import stability as st
    >>> st.models.soft_stop_oscillator(gap=3.0, sides="above").parameters["gap"]
    3.0
    """
    above, below = _sides(sides)
    positive(gap=gap)
    u = sp.Function("u")(t)
    x, g, k, e, W = sp.symbols("xi gap kappa eta Omega", real=True)
    v = u.diff(t)
    contact = sp.S.Zero
    if above:
        contact += k * sp.Max(u - g, 0) + sp.Piecewise((2 * e * v, u > g), (0, True))
    if below:
        contact += k * sp.Min(u + g, 0) + sp.Piecewise((2 * e * v, u < -g), (0, True))
    return System.from_equations(
        {u.diff(t, 2): -2 * x * v - u - contact + W**2 * sp.cos(W * t)},
        [u],
        parameters=dict(xi=xi, gap=gap, kappa=kappa, eta=eta, Omega=Omega),
        bounds=dict(Omega=_POSITIVE, gap=_POSITIVE),
        name="soft_stop_oscillator",
        description="linear oscillator between soft stops",
    )


@model(
    equation="u'' + 2 xi u' + u = Omega^2 cos(Omega tau),  |u| <= gap,  u'+ = -restitution u'- at the stops",
    source="A.3; catalogue 2",
    group="impact",
)
def hard_stop_oscillator(
    *,
    xi: float = 0.021,
    gap: float = 5.0,
    restitution: float = 0.8,
    Omega: float = 1.0,
    sides: str = "both",
) -> System:
    """Linear oscillator between hard stops: u'+ = -e u'- at |u| = gap.

    Parameters
    ----------
    xi : float
        Damping ratio.
    gap : float
        Distance of the stops from rest, in base amplitudes.
    restitution : float
        e in [0, 1]; 1 conserves energy.
    Omega : float
        Excitation over natural frequency.
    sides : str
        ``"both"``, ``"above"`` or ``"below"``.

    Returns
    -------
    System
        States ``u, u_dot``, with `HardStop` entries in ``stops``.

    Raises
    ------
    InputError
        If the gap is not positive, the restitution is outside [0, 1] or `sides` is another word.

    References
    ----------
    Source chapter, A.3.

    Examples
    --------
    >>> import stability as st
    >>> [s.position for s in st.models.hard_stop_oscillator(gap=4.0).stops]
    [4.0, -4.0]
    """
    above, below = _sides(sides)
    positive(gap=gap)
    u = sp.Function("u")(t)
    x, W = sp.symbols("xi Omega", real=True)
    stops = [HardStop("u", gap, +1, restitution)] if above else []
    if below:
        stops.append(HardStop("u", -gap, -1, restitution))
    return System.from_equations(
        {u.diff(t, 2): -2 * x * u.diff(t) - u + W**2 * sp.cos(W * t)},
        [u],
        parameters=dict(xi=xi, Omega=Omega),
        bounds=dict(Omega=_POSITIVE),
        stops=stops,
        name="hard_stop_oscillator",
        description="linear oscillator between hard stops",
    )


@model(
    equation="m y'' + d y' + F(y) (+ m g) = m A w^2 cos(w t)",
    source="equations (3)-(6), (45)-(50); catalogue 1, 7",
    figure="1, 2",
    group="nonlinear",
)
def spring_oscillator(
    spring: Any = None,
    *,
    mass: float = 0.02,
    damping: float = 0.1365,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 20.0,
    gravity: bool = False,
    coil: Coil | None = None,
) -> System:
    """A mass on any spring of the catalogue, on the shaker: m y'' + d y' + F(y) (+ m g) = m A w^2 cos(w t).

    Parameters
    ----------
    spring : spring
        Anything with ``expression(y)``, the force that holds the displacement y, as sympy: power law, polynomial,
        piecewise, tabulated, magnetic. Without one, the linear spring of 315.827 N/m (20 Hz).
    mass : float
        m (kg).
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
        States ``y, y_dot`` (m, m/s).

    Raises
    ------
    InputError
        If `spring` has no ``expression``.

    Examples
    --------
    >>> import stability as st
    >>> st.models.spring_oscillator(st.models.PowerLawSpring(k1=190.0, kn=1e6, n=3)).states
    ('y', 'y_dot')
    """
    if spring is not None and not hasattr(spring, "expression"):
        raise InputError(f"spring must have expression(y), as the springs of stability.models do; got {spring!r}")
    if amplitude is None and acceleration is None:
        acceleration = 0.5 * GRAVITY
    k = sp.Symbol("stiffness", real=True)
    position = sp.Dummy("y", real=True)

    def force(y: sp.Expr, v: sp.Expr) -> sp.Expr:
        if spring is None:
            return -k * y
        return -sp.sympify(spring.expression(position)).xreplace({position: y})

    return single_degree(
        "spring_oscillator", "mass on a spring, on a moving base",
        lambda y: sp.S.Zero,
        {"stiffness": 315.827} if spring is None else {}, {"stiffness": "N/m"} if spring is None else {},
        mass=mass, damping=damping, amplitude=amplitude, acceleration=acceleration, frequency=frequency,
        gravity=gravity, coil=coil, force=force,
    )  # fmt: skip
