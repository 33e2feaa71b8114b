"""Two masses in a chain on a moving base, with linear or cubic springs.

base -(k1, k3_1, d1)- m1 -(k2, k3_2, d2)- m2, coordinates relative to the base, r = v - u:

    u'' + 2 xi1 u' + 2 xi2 Omega0 lam (u' - v') + u + lam Omega0^2 (u - v) + beta1 u^3 - lam beta2 (v - u)^3
        + gravity = Omega^2 cos(Omega tau)
    v'' + 2 xi2 Omega0 (v' - u') + Omega0^2 (v - u) + beta2 (v - u)^3 + gravity = Omega^2 cos(Omega tau)

w1^2 = k1/m1, w2^2 = k2/m2, xi_i = d_i/(2 m_i w_i), Omega0 = w2/w1, lam = m2/m1 (`mass_ratio_21`), u = y1/A, v = y2/A,
beta_i = k3_i A^2/(m_i w1^2). Errata: the base loads both masses (the source loads only the first), the second damper
acts on the relative velocity (`damper2="base"` is the printed variant), and the cubic term of the second spring acts
on v - u with its reaction on the first mass. Source: (26)-(39), A.2; catalogue 4, 8; figures 5, 6, 7, A2.
"""

from __future__ import annotations

import sympy as sp

from ..errors import InputError
from ..systems.system import System
from ._builder import Coil, physical_system
from ._model import model
from ._shaker import GRAVITY, positive, shaker

__all__ = ["chain"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


def _check_damper(damper2: str) -> None:
    if damper2 not in ("relative", "base"):
        raise InputError(
            f"damper2 must be 'relative' (parallel to the second spring) or 'base' (printed); got {damper2!r}"
        )


@model(
    equation="u'' + 2 xi1 u' + 2 xi2 Omega0 lam (u'-v') + u + lam Omega0^2 (u-v) + beta1 u^3 - lam beta2 (v-u)^3 = "
    "Omega^2 cos;  v'' + 2 xi2 Omega0 (v'-u') + Omega0^2 (v-u) + beta2 (v-u)^3 = Omega^2 cos",
    source="equations (26)-(39), A.2, with errata (28)-(33); catalogue 4, 8",
    figure="5, 6, 7, A2",
    group="linear",
)
def chain(
    *,
    xi1: float = 0.021,
    xi2: float = 0.021,
    mass_ratio_21: float = 0.5,
    Omega0: float = 1.0,
    beta1: float = 0.0,
    beta2: float = 0.0,
    Omega: float = 1.0,
    gravity: float = 0.0,
    damper2: str = "relative",
) -> System:
    """Chain of two masses on a moving base; linear for beta1 = beta2 = 0, else with cubic springs.

    u'' + 2 xi1 u' + 2 xi2 Omega0 lam (u'-v') + u + lam Omega0^2 (u-v) + beta1 u^3 - lam beta2 (v-u)^3 + gravity
    = Omega^2 cos(Omega tau); v'' + 2 xi2 Omega0 (v'-u') + Omega0^2 (v-u) + beta2 (v-u)^3 + gravity = Omega^2 cos.

    Parameters
    ----------
    xi1, xi2 : float
        Damping ratios d_i/(2 m_i w_i).
    mass_ratio_21 : float
        lam = m2/m1.
    Omega0 : float
        w2/w1, w_i^2 = k_i/m_i.
    beta1, beta2 : float
        Cubic coefficients k3_i A^2/(m_i w1^2) (both over w1^2).
    Omega : float
        w/w1.
    gravity : float
        varrho = g/(A w1^2).
    damper2 : str
        ``"relative"`` (parallel to the second spring) or ``"base"`` (as printed: both dampers at the base).

    Returns
    -------
    System
        States ``u, v, u_dot, v_dot``; output ``relative`` = v - u.

    Raises
    ------
    InputError
        For another `damper2`.

    References
    ----------
    Source chapter, (26)-(39), figures 5 to 7, A2.

    Examples
    --------
    >>> import stability as st
    >>> st.models.chain(beta1=0.01).states
    ('u', 'v', 'u_dot', 'v_dot')
    """
    _check_damper(damper2)
    u, v = sp.Function("u")(t), sp.Function("v")(t)
    x1, x2, lam, W0, b1, b2, W, r = sp.symbols("xi1 xi2 mass_ratio_21 Omega0 beta1 beta2 Omega gravity", real=True)
    ud, vd = u.diff(t), v.diff(t)
    relative = damper2 == "relative"
    damping1 = 2 * x1 * ud + (2 * x2 * W0 * lam * (ud - vd) if relative else 0)
    damping2 = 2 * x2 * W0 * ((vd - ud) if relative else vd)
    load = W**2 * sp.cos(W * t) - r
    return System.from_equations(
        {
            u.diff(t, 2): load - damping1 - u - lam * W0**2 * (u - v) - b1 * u**3 + lam * b2 * (v - u) ** 3,
            v.diff(t, 2): load - damping2 - W0**2 * (v - u) - b2 * (v - u) ** 3,
        },
        [u, v],
        parameters=dict(
            xi1=xi1, xi2=xi2, mass_ratio_21=mass_ratio_21, Omega0=Omega0, beta1=beta1, beta2=beta2, Omega=Omega,
            gravity=gravity,
        ),
        bounds=dict(Omega=_POSITIVE, mass_ratio_21=(0, float("inf"))),
        outputs=dict(relative=v - u),
        # as for `duffing`: the base motion is 1, the response at resonance 1/eps
        orders=dict(xi1=1, xi2=1, beta1=3, beta2=3, gravity=-1 if gravity else 1, u=-1, v=-1),
        name="chain",
        description="two masses in a chain on a moving base",
    )  # fmt: skip


@chain.constructor
def from_physical(
    *,
    mass1: float = 0.02,
    mass2: float = 0.01,
    stiffness1: float = 0.02 * 169.0**2,
    stiffness2: float = 0.01 * 169.0**2,
    damping1: float = 2 * 0.021 * 0.02 * 169.0,
    damping2: float = 2 * 0.021 * 0.01 * 169.0,
    cubic1: float = 0.0,
    cubic2: float = 0.0,
    amplitude: float | None = None,
    acceleration: float | None = None,
    frequency: float = 25.0,
    gravity: bool = False,
    damper2: str = "relative",
    coil: Coil | None = None,
) -> System:
    """The chain of two masses in SI units.

    m1 y1'' + d1 y1' - d2 (y2'-y1') + k1 y1 - k2 (y2-y1) + k3_1 y1^3 - k3_2 (y2-y1)^3 (+ m1 g) = m1 A w^2 cos(w t) and
    m2 y2'' + d2 (y2'-y1') + k2 (y2-y1) + k3_2 (y2-y1)^3 (+ m2 g) = m2 A w^2 cos(w t).

    Parameters
    ----------
    mass1, mass2 : float
        kg.
    stiffness1, stiffness2 : float
        k_i (N/m); the defaults give w1 = w2 = 169 rad/s.
    damping1, damping2 : float
        d_i (N s/m).
    cubic1, cubic2 : float
        k3_i (N/m^3).
    amplitude, acceleration : float, optional
        Base amplitude A (m) or acceleration amplitude A w^2 (m/s^2); 0.5 g if neither is given.
    frequency : float
        w/2 pi (Hz).
    gravity : bool
        Adds the weights.
    damper2 : str
        ``"relative"`` or ``"base"`` (printed).
    coil : Coil, optional
        Electromagnetic transducer on y1 or y2.

    Returns
    -------
    System
        States ``y1, y2, y1_dot, y2_dot``; outputs in mm.
    """
    _check_damper(damper2)
    positive(mass1=mass1, mass2=mass2, stiffness1=stiffness1, stiffness2=stiffness2)
    positive(zero_allowed=True, damping1=damping1, damping2=damping2)
    if amplitude is None and acceleration is None:
        acceleration = 0.5 * GRAVITY
    base = shaker(amplitude, acceleration, frequency)
    y1, y2 = sp.Function("y1")(t), sp.Function("y2")(t)
    names = "mass1 mass2 stiffness1 stiffness2 damping1 damping2 cubic1 cubic2 g"
    m1, m2, k1, k2, d1, d2, c1, c2, g = sp.symbols(names, real=True)
    v1, v2 = y1.diff(t), y2.diff(t)
    kinetic = m1 * v1**2 / 2 + m2 * v2**2 / 2
    potential = k1 * y1**2 / 2 + k2 * (y2 - y1) ** 2 / 2 + c1 * y1**4 / 4 + c2 * (y2 - y1) ** 4 / 4
    if gravity:
        potential += g * (m1 * y1 + m2 * y2)
    slip = v2 - v1 if damper2 == "relative" else v2
    values = dict(
        mass1=mass1, mass2=mass2, stiffness1=stiffness1, stiffness2=stiffness2, damping1=damping1, damping2=damping2,
        cubic1=cubic1, cubic2=cubic2,
    )  # fmt: skip
    units = {
        **dict.fromkeys(("mass1", "mass2"), "kg"), **dict.fromkeys(("stiffness1", "stiffness2"), "N/m"),
        **dict.fromkeys(("damping1", "damping2"), "N s/m"), **dict.fromkeys(("cubic1", "cubic2"), "N/m^3"),
        "y1": "m", "y2": "m", "y1_mm": "mm", "y2_mm": "mm", "relative_mm": "mm", **({"g": "m/s^2"} if gravity else {}),
    }  # fmt: skip
    return physical_system(
        "chain", "two masses in a chain on a moving base, SI units", kinetic - potential, [y1, y2],
        {**values, **({"g": GRAVITY} if gravity else {})},
        base=base, dissipation=d1 * v1**2 / 2 + d2 * slip**2 / 2, forces={y1: m1 * base.load, y2: m2 * base.load},
        units=units, outputs=dict(y1_mm=1000 * y1, y2_mm=1000 * y2, relative_mm=1000 * (y2 - y1)), coil=coil,
    )  # fmt: skip
