r"""Closed forms of the quadratic autoparametric system in 2:1 resonance.

    x'' + 2 xi1 x' + x + g1 y^2 = f cos(eta t),    y'' + 2 xi2 y' + q^2 y + g2 x y = 0          (eta ~ 1, q ~ 1/2)

    D1 = 1 - eta^2 + 2 i xi1 eta,   D2 = q^2 - eta^2/4 + i xi2 eta,   P = 2 D1 D2/g2

Semi-trivial: x = R0 cos, R0 = f/|D1|, y = 0; unstable where f > f_c = |P|.
Nontrivial: R = 2 |D2|/|g2| (saturation: independent of f), r^2 = 2/g1 [Re P +- sqrt(f^2 - (Im P)^2)].
Slow flow about the nontrivial solution, s1 = (1 - eta^2)/(2 eta), s2 = (q^2 - eta^2/4)/eta, G = g1 g2 r^2/(4 eta^2):

    lam^4 + c1 lam^3 + c2 lam^2 + c3 lam + c4,    c1 = 2 (xi1 + xi2),   c2 = xi1^2 + s1^2 + 4 xi1 xi2 + 2 G,
    c3 = 2 xi2 (xi1^2 + s1^2) + 2 G (xi1 + xi2),  c4 = G^2 + 2 G (xi1 xi2 - s1 s2)

Hopf (torus of the full system) where c1 c2 c3 = c3^2 + c1^2 c4, which needs s1 s2 < 0; fold where c4 = 0 (f = |Im P|).
References: Tondl, Ruijgrok, Verhulst and Nabergoj (2000), ch. 2-5; Nayfeh and Mook (1979), section 6.5.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

from ..errors import InputError

__all__ = [
    "autoparametric_amplitudes",
    "autoparametric_characteristic",
    "autoparametric_hopf",
    "autoparametric_interval",
    "autoparametric_threshold",
]

Array = npt.NDArray[np.float64]


def _impedances(eta: npt.ArrayLike, xi1: float, xi2: float, q: float) -> tuple[npt.NDArray[np.complex128], ...]:
    w = np.asarray(eta, dtype=float)
    return 1 - w**2 + 2j * xi1 * w, q**2 - w**2 / 4 + 1j * xi2 * w


def _coupled(**couplings: float) -> None:
    for name, value in couplings.items():
        if value == 0 or not math.isfinite(value):
            raise InputError(f"{name} = {value}: the coupling must be finite and different from zero")


def autoparametric_threshold(eta: npt.ArrayLike, *, xi1: float, xi2: float, q: float, g2: float) -> Array:
    """The forcing f_c above which the semi-trivial solution y = 0 is unstable.

    f_c = (2/g2) |1 - eta^2 + 2 i xi1 eta| |q^2 - eta^2/4 + i xi2 eta| for the system at the head of this module,
    x'' + 2 xi1 x' + x + g1 y^2 = f cos(eta t), y'' + 2 xi2 y' + q^2 y + g2 x y = 0.

    Parameters
    ----------
    eta : array
        Forcing frequency.
    xi1, xi2, q, g2 : float
        Damping, natural frequency of y, coupling.

    Returns
    -------
    array
        f_c, the shape of eta.

    Raises
    ------
    InputError
        g2 = 0.

    References
    ----------
    Tondl et al. (2000), chapter 2.

    Examples
    --------
    >>> import stability as st
    >>> float(st.autoparametric_threshold(1.0, xi1=0.01, xi2=0.01, q=0.5, g2=0.12).round(8))
    0.00333333
    """
    _coupled(g2=g2)
    D1, D2 = _impedances(eta, xi1, xi2, q)
    return np.asarray(2 / abs(g2) * np.abs(D1) * np.abs(D2))


def autoparametric_interval(
    *, xi1: float, xi2: float, q: float, g2: float, f: float
) -> tuple[tuple[float, float], ...]:
    """Intervals of the forcing frequency in which the semi-trivial solution is unstable.

    (4/g2^2) [(1 - eta^2)^2 + 4 xi1^2 eta^2] [(q^2 - eta^2/4)^2 + xi2^2 eta^2] < f^2, a quartic in eta^2.

    Parameters
    ----------
    xi1, xi2, q, g2, f : float
        As in `autoparametric_threshold`; f is the forcing amplitude.

    Returns
    -------
    tuple of (eta_low, eta_high)
        One or two intervals (two resonances far apart), or none.

    Raises
    ------
    InputError
        g2 = 0.

    References
    ----------
    Tondl et al. (2000), chapter 2.

    Examples
    --------
    >>> import stability as st
    >>> [(round(a, 4), round(b, 4)) for a, b in st.autoparametric_interval(xi1=0.01, xi2=0.01, q=0.5, g2=0.12, f=0.02)]
    [(0.9683, 1.0303)]
    """
    _coupled(g2=g2)
    p = np.polynomial.Polynomial([0.0, 1.0])
    first = (1 - p) ** 2 + 4 * xi1**2 * p
    second = (q**2 - p / 4) ** 2 + xi2**2 * p
    excess = 4 / g2**2 * first * second - f**2
    slope = (first * second).deriv()
    roots = []
    for root in excess.roots().astype(complex).tolist():
        z = root.real
        if abs(root.imag) > 1e-9 * abs(root) or z <= 0:
            continue
        for _ in range(3):  # Newton on the factors: the expanded quartic has lost digits
            z -= float((first(z) * second(z) - (f * g2 / 2) ** 2) / slope(z)) if slope(z) != 0 else 0.0
        roots.append(z)
    edges = [0.0, *sorted(roots)]
    found = []
    for low, high in itertools.pairwise(edges):
        if excess((low + high) / 2) < 0:
            found.append((math.sqrt(low), math.sqrt(high)))
    return tuple(found)


def autoparametric_amplitudes(
    eta: npt.ArrayLike, *, xi1: float, xi2: float, q: float, g1: float, g2: float, f: float
) -> tuple[Array, Array]:
    """Amplitudes R of x and r of y on the nontrivial solution.

    R = 2 |D2|/|g2|, r^2 = (2/g1) [Re P +- sqrt(f^2 - (Im P)^2)] (head of this module).

    Parameters
    ----------
    eta : array
        Forcing frequency.
    xi1, xi2, q, g1, g2, f : float
        Damping, natural frequency of y, couplings, forcing amplitude.

    Returns
    -------
    R : array
        The shape of eta.
    r : array, (2, ...)
        Upper (stable outside the Hopf window) and lower amplitude; NaN where there is none.

    Raises
    ------
    InputError
        A coupling that is zero.

    References
    ----------
    Tondl et al. (2000), chapter 2; Nayfeh and Mook (1979), section 6.5.

    Examples
    --------
    >>> import stability as st
    >>> R, r = st.autoparametric_amplitudes(1.0, xi1=0.01, xi2=0.01, q=0.5, g1=0.1, g2=0.12, f=0.02)
    >>> float(R.round(6)), r.round(6)
    (0.166667, array([0.57735,     nan]))
    """
    _coupled(g1=g1, g2=g2)
    D1, D2 = _impedances(eta, xi1, xi2, q)
    P = 2 / g2 * D1 * D2
    with np.errstate(invalid="ignore"):
        root = np.sqrt(f**2 - P.imag**2)
        squares = np.array([2 / g1 * (P.real + root), 2 / g1 * (P.real - root)])
        squares = -np.sort(-squares, axis=0)
        r = np.sqrt(np.where(squares > 0, squares, np.nan))
    return np.asarray(2 / abs(g2) * np.abs(D2)), np.asarray(r)


def autoparametric_characteristic(
    eta: npt.ArrayLike, *, xi1: float, xi2: float, q: float, g1: float, g2: float, r: npt.ArrayLike
) -> Array:
    """Coefficients (1, c1, c2, c3, c4) of the slow flow's characteristic polynomial on the nontrivial solution.

    lam^4 + c1 lam^3 + c2 lam^2 + c3 lam + c4, as at the head of this module.

    Parameters
    ----------
    eta : array
        Forcing frequency.
    xi1, xi2, q, g1, g2 : float
        As in `autoparametric_amplitudes`.
    r : array
        Amplitude of y.

    Returns
    -------
    array, (5, ...)
        Highest power first, as for `numpy.roots`.

    Raises
    ------
    InputError
        A coupling that is zero.

    References
    ----------
    Tondl et al. (2000), chapter 2.

    Examples
    --------
    >>> import numpy as np, stability as st
    >>> c = st.autoparametric_characteristic(1.0, xi1=0.01, xi2=0.01, q=0.5, g1=0.1, g2=0.12, r=0.57735)
    >>> bool(np.roots(c).real.max() < 0)
    True
    """
    _coupled(g1=g1, g2=g2)
    w, r = np.asarray(eta, dtype=float), np.asarray(r, dtype=float)
    s1, s2 = (1 - w**2) / (2 * w), (q**2 - w**2 / 4) / w
    G = g1 * g2 * r**2 / (4 * w**2)
    c2 = xi1**2 + s1**2 + 4 * xi1 * xi2 + 2 * G
    c3 = 2 * xi2 * (xi1**2 + s1**2) + 2 * G * (xi1 + xi2)
    c4 = G**2 + 2 * G * (xi1 * xi2 - s1 * s2)
    return np.array(np.broadcast_arrays(np.ones_like(c4), 2 * (xi1 + xi2) + 0 * c4, c2, c3, c4))


def autoparametric_hopf(
    *, xi1: float, xi2: float, q: float, g1: float, g2: float, f: float, window: tuple[float, float] | None = None
) -> tuple[float, ...]:
    """Forcing frequencies of the Hopf points on the upper nontrivial branch (torus points of the full system).

    Zeros of c1 c2 c3 - c3^2 - c1^2 c4 (head of this module), found between the two resonances 1 and 2 q, outside which
    there are none.

    Parameters
    ----------
    xi1, xi2, q, g1, g2, f : float
        As in `autoparametric_amplitudes`.
    window : (float, float), optional
        Where to look; by default the interval between 1 and 2 q.

    Returns
    -------
    tuple of float
        Ascending; to about 1e-12.

    Raises
    ------
    InputError
        A coupling that is zero.

    References
    ----------
    Tondl et al. (2000), chapter 4.

    Examples
    --------
    >>> import stability as st
    >>> st.autoparametric_hopf(xi1=0.01, xi2=0.01, q=0.5, g1=0.1, g2=0.12, f=0.02)
    ()
    """
    _coupled(g1=g1, g2=g2)
    low, high = window if window is not None else sorted((1.0, 2 * q))
    values = dict(xi1=xi1, xi2=xi2, q=q, g1=g1, g2=g2)

    def condition(eta: npt.ArrayLike) -> Array:
        r = autoparametric_amplitudes(eta, f=f, **values)[1][0]
        _, c1, c2, c3, c4 = autoparametric_characteristic(eta, r=r, **values)
        return np.asarray(c1 * c2 * c3 - c3**2 - c1**2 * c4)

    if not high > low:
        return ()
    grid = np.linspace(low, high, 2001)
    value = condition(grid)
    found = []
    for k in np.flatnonzero(value[:-1] * value[1:] < 0):
        a, b, fa = grid[k], grid[k + 1], value[k]
        for _ in range(60):
            middle = (a + b) / 2
            fm = float(condition(middle))
            a, b, fa = (middle, b, fm) if fm * fa > 0 else (a, middle, fa)
        found.append(float((a + b) / 2))
    return tuple(found)
