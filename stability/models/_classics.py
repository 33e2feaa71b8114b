"""The classics: self-excited oscillators, Lorenz' system, the nonlinear tuned vibration absorber.

Self-excited systems, the class that the chapter announces and never treats, draw their energy from a steady source:
the damping is negative at small amplitude, the equilibrium unstable, and a limit cycle is born in a Hopf point.
"""

from __future__ import annotations

import sympy as sp

from ..systems.system import System
from ._model import model

__all__ = ["lorenz", "nonlinear_absorber", "rayleigh", "van_der_pol"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


@model(
    equation="x'' - mu (1 - x^2) x' + x = 0",
    source="van der Pol, Phil. Mag. 2 (1926) 978",
    group="self-excited",
)
def van_der_pol(*, mu: float = 1.0) -> System:
    """Van der Pol's oscillator, x'' - mu (1 - x^2) x' + x = 0: the model of self-excitation.

    Parameters
    ----------
    mu : float
        Negative damping at small amplitude; amplitude 2 and period 2 pi for small mu, relaxation for large.

    Returns
    -------
    System
        States ``x, x_dot``; autonomous.

    References
    ----------
    B. van der Pol, Philosophical Magazine 2 (1926) 978.

    Examples
    --------
    >>> import stability as st
    >>> st.models.van_der_pol().period is None
    True
    """
    x = sp.Function("x")(t)
    m = sp.Symbol("mu", real=True)
    return System.from_equations(
        {x.diff(t, 2): m * (1 - x**2) * x.diff(t) - x},
        [x],
        parameters=dict(mu=mu),
        orders=dict(mu=1),
        name="van_der_pol",
        description="self-excited oscillator",
    )


@model(
    equation="x'' - mu (1 - x'^2/3) x' + x = 0",
    source="Rayleigh, Phil. Mag. 15 (1883) 229",
    group="self-excited",
)
def rayleigh(*, mu: float = 1.0) -> System:
    """Rayleigh's oscillator, x'' - mu (1 - x'^2/3) x' + x = 0; its velocity obeys van der Pol's equation.

    Parameters
    ----------
    mu : float
        Negative damping at small velocity.

    Returns
    -------
    System
        States ``x, x_dot``; autonomous.

    References
    ----------
    Lord Rayleigh, Philosophical Magazine 15 (1883) 229.

    Examples
    --------
    >>> import stability as st
    >>> st.models.rayleigh(mu=0.1).states
    ('x', 'x_dot')
    """
    x = sp.Function("x")(t)
    m = sp.Symbol("mu", real=True)
    return System.from_equations(
        {x.diff(t, 2): m * (1 - x.diff(t) ** 2 / 3) * x.diff(t) - x},
        [x],
        parameters=dict(mu=mu),
        orders=dict(mu=1),
        name="rayleigh",
        description="self-excited oscillator",
    )


@model(
    equation="x' = sigma (y - x);  y' = x (rho - z) - y;  z' = x y - beta z",
    source="Lorenz, J. Atmos. Sci. 20 (1963) 130",
    group="classic",
)
def lorenz(*, sigma: float = 10.0, rho: float = 28.0, beta: float = 8.0 / 3.0) -> System:
    """Lorenz' system, x' = sigma (y - x), y' = x (rho - z) - y, z' = x y - beta z.

    Parameters
    ----------
    sigma, rho, beta : float
        Prandtl number, Rayleigh number (the Hopf point stands at 470/19 for the defaults), geometry.

    Returns
    -------
    System
        States ``x, y, z``; autonomous.

    References
    ----------
    E. N. Lorenz, Journal of the Atmospheric Sciences 20 (1963) 130.

    Examples
    --------
    >>> import stability as st
    >>> st.models.lorenz().states
    ('x', 'y', 'z')
    """
    x, y, z = (sp.Function(n)(t) for n in "xyz")
    s, r, b = sp.symbols("sigma rho beta", real=True)
    return System.from_equations(
        {x.diff(t): s * (y - x), y.diff(t): x * (r - z) - y, z.diff(t): x * y - b * z},
        [x, y, z],
        parameters=dict(sigma=sigma, rho=rho, beta=beta),
        name="lorenz",
        description="convection rolls",
    )


@model(
    equation="x1'' + 2 mu1 x1' + x1 + alpha x1^3 + epsilon [2 mu2 lam (x1'-x2') + lam^2 (x1-x2) + beta (x1-x2)^3] = "
    "f cos(omega t);  epsilon x2'' = epsilon [2 mu2 lam (x1'-x2') + lam^2 (x1-x2) + beta (x1-x2)^3]",
    source="Habib, Detroux, Viguie and Kerschen, MSSP 52-53 (2015) 17",
    group="nonlinear",
)
def nonlinear_absorber(
    *,
    mu1: float = 0.001,
    mu2: float = 0.1346,
    lam: float = 0.952,
    alpha: float = 1.0,
    beta: float = 0.042,
    epsilon: float = 0.05,
    f: float = 0.01,
    omega: float = 1.0,
) -> System:
    """Nonlinear tuned vibration absorber on a Duffing oscillator.

    x1'' + 2 mu1 x1' + x1 + alpha x1^3 + epsilon F_a = f cos(omega t), x2'' = F_a with
    F_a = 2 mu2 lam (x1'-x2') + lam^2 (x1-x2) + beta (x1-x2)^3. `beta` is the absorber's cubic stiffness over its mass.

    Parameters
    ----------
    mu1, mu2 : float
        Damping ratios of the primary system and the absorber.
    lam : float
        Absorber over primary natural frequency.
    alpha : float
        Cubic stiffness of the primary system.
    beta : float
        Cubic stiffness of the absorber over the absorber's mass.
    epsilon : float
        Mass ratio.
    f, omega : float
        Forcing amplitude and frequency.

    Returns
    -------
    System
        States ``x1, x2, x1_dot, x2_dot``.

    References
    ----------
    Habib et al., Mechanical Systems and Signal Processing 52-53 (2015) 17.

    Examples
    --------
    >>> import stability as st
    >>> st.models.nonlinear_absorber().n
    4
    """
    x1, x2 = sp.Function("x1")(t), sp.Function("x2")(t)
    names = "mu1 mu2 lam alpha beta epsilon f omega"
    m1, m2, la, al, be, ep, F, w = sp.symbols(names, real=True)
    absorber = 2 * m2 * la * (x1.diff(t) - x2.diff(t)) + la**2 * (x1 - x2) + be * (x1 - x2) ** 3
    return System.from_equations(
        {
            x1.diff(t, 2): F * sp.cos(w * t) - 2 * m1 * x1.diff(t) - x1 - al * x1**3 - ep * absorber,
            x2.diff(t, 2): absorber,
        },
        [x1, x2],
        parameters=dict(mu1=mu1, mu2=mu2, lam=lam, alpha=alpha, beta=beta, epsilon=epsilon, f=f, omega=omega),
        bounds=dict(omega=_POSITIVE, epsilon=(0, float("inf"))),
        outputs=dict(relative=x2 - x1),
        name="nonlinear_absorber",
        description="nonlinear tuned vibration absorber on a Duffing oscillator",
    )
