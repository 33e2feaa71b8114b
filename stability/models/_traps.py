"""The quadrupole ion trap and mass filter: Mathieu's equation in two directions at once.

    x'' + (a - 2 q p(z)) x = 0,      y'' - (a - 2 q p(z)) y = 0        (mass filter, linear trap)
    r'' + (a - 2 q p(z)) r = 0,      u'' - 2 (a - 2 q p(z)) u = 0      (three-dimensional trap)

with the time z = Omega t/2 and the drive p(z) = cos 2z, or a rectangular wave of given duty cycle. An ion stays inside
where both directions are stable. First region of the filter: apex (q, a) = (0.705996, 0.236994), cut-off q = 0.908046
at a = 0.
"""

from __future__ import annotations

import sympy as sp

from ..errors import InputError
from ..systems.system import System
from ._model import model

__all__ = ["paul_trap"]

t = sp.Symbol("t", real=True)


@model(
    equation="x'' + 2 zeta x' + (a - 2 q p) x = 0,  y'' + 2 zeta y' - (a - 2 q p) y = 0,  p = cos 2z or rectangular",
    source="Paul, Rev. Mod. Phys. 62 (1990) 531; catalogue 5",
    group="parametric",
)
def paul_trap(
    *, a: float = 0.1, q: float = 0.5, zeta: float = 0.0, duty: float | None = None, geometry: str = "linear"
) -> System:
    """Radio-frequency quadrupole: the ion's motion in both directions of the trap (time z = Omega t/2, period pi).

    Parameters
    ----------
    a : float
        Direct-voltage parameter.
    q : float
        Radio-frequency parameter.
    zeta : float
        Damping by a buffer gas.
    duty : float, optional
        Duty cycle in (0, 1) of a rectangular drive, +1 for phases below it and -1 above; None for a cosine drive.
    geometry : str
        ``"linear"`` (mass filter, second direction -a, -q) or ``"3d"`` (axial direction -2a, -2q).

    Returns
    -------
    System
        States ``x, y, x_dot, y_dot``.

    Raises
    ------
    InputError
        For another geometry or a duty cycle outside (0, 1).

    References
    ----------
    W. Paul, Reviews of Modern Physics 62 (1990) 531; Konenkov et al. (2002) for rectangular drives.

    Examples
    --------
    >>> import stability as st
    >>> st.models.paul_trap(duty=0.4).breaks
    (0, duty)
    """
    if geometry not in ("linear", "3d"):
        raise InputError(f"geometry must be 'linear' or '3d'; got {geometry!r}")
    if duty is not None and not 0 < duty < 1:
        raise InputError(f"duty must be in (0, 1); got {duty}")
    x, y = sp.Function("x")(t), sp.Function("y")(t)
    A, Q, Z, S = sp.symbols("a q zeta duty", real=True)
    drive = sp.cos(2 * t) if duty is None else sp.Piecewise((1, sp.Mod(t / sp.pi, 1) < S), (-1, True))
    factor = 1 if geometry == "linear" else 2
    stiffness = A - 2 * Q * drive
    values = dict(a=a, q=q, zeta=zeta)
    return System.from_equations(
        {
            x.diff(t, 2): -2 * Z * x.diff(t) - stiffness * x,
            y.diff(t, 2): -2 * Z * y.diff(t) + factor * stiffness * y,
        },
        [x, y],
        parameters=values if duty is None else {**values, "duty": duty},
        bounds={} if duty is None else dict(duty=(1e-9, 1 - 1e-9)),
        period=sp.pi,
        breaks=() if duty is None else (0, S),
        name="paul_trap",
        description="radio-frequency quadrupole ion trap",
    )
