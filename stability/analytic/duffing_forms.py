r"""Closed-form responses of Duffing's oscillators by one-term harmonic balance, and their next order.

    u'' + 2 xi u' + u + beta u^3 = F cos(Omega t),    u = a cos(Omega t + psi),    F = Omega^2 for a moving base

    (p - 1 - k(s))^2 + 4 xi^2 p = F^2/s,     p = Omega^2,  s = a^2,  k = 3/4 beta s (+ 3/128 beta^2 s^2 at order 2)

so that p solves a quadratic for given a (the two flanks of the response), and s a cubic for given Omega, whose
discriminant, a polynomial in p, vanishes exactly at the folds. Phase resonance (p = 1 + k) is the peak for the damping
force: with base excitation Omega_p^2 = 1/(1 - 3 beta/(16 xi^2)), a_p = Omega_p/(2 xi), which exists only for
beta < 16 xi^2/3: above, the resonance is open. Folds begin at a_c^2 = 16 xi/(3 sqrt(3) beta),
F_c^2 = 256 xi^3/(9 sqrt(3) beta), Omega_c = 1 + sqrt(3) xi (leading order in xi). a is that of the
fundamental harmonic.
References: Nayfeh and Mook (1979), chapter 4; Krack and Gross (2019), chapter 2; source chapter (53).
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import numpy.typing as npt

from ..errors import InputError, OpenResonanceWarning

__all__ = [
    "duffing_amplitudes",
    "duffing_fold_onset",
    "duffing_folds",
    "duffing_frequencies",
    "duffing_mathieu_amplitudes",
    "duffing_peak",
]

Array = npt.NDArray[np.float64]


def _checked(**values: npt.ArrayLike | None) -> None:
    for name, value in values.items():
        if value is not None and not (np.all(np.isfinite(value)) and np.all(np.asarray(value) >= 0)):
            raise InputError(f"{name} must be finite and not negative; got {value}")


def duffing_frequencies(
    amplitude: npt.ArrayLike, *, xi: float, beta: float, force: float | None = None, order: int = 1
) -> Array:
    """The two frequencies at which Duffing's oscillator answers with a given amplitude.

    u'' + 2 xi u' + u + beta u^3 = F cos(Omega t), F = Omega^2 for force=None.

    Parameters
    ----------
    amplitude : array
        Amplitudes a of the fundamental harmonic, > 0.
    xi, beta : float
        Damping ratio, cubic coefficient.
    force : float or None
        F; None is base excitation, F = Omega^2.
    order : int
        1: one-term harmonic balance; 2: the third harmonic eliminated (3/128 beta^2 a^4).

    Returns
    -------
    array, (2, ...)
        Lower and upper flank; NaN where the amplitude is not reached.

    Raises
    ------
    InputError
        Values that are negative or not finite; an order other than 1 and 2.

    References
    ----------
    Nayfeh and Mook (1979), section 4.1.

    Examples
    --------
    >>> import stability as st
    >>> st.duffing_frequencies(1.0, xi=0.0, beta=0.0, force=0.5).round(6)
    array([0.707107, 1.224745])
    """
    a = np.asarray(amplitude, dtype=float)
    _checked(amplitude=a, xi=xi, force=force)
    if order not in (1, 2):
        raise InputError(f"order = {order}: 1 or 2")
    s = a * a
    stiffness = 1 + 0.75 * beta * s + (3 / 128 * beta**2 * s**2 if order == 2 else 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        lead = 1 - (1 / s if force is None else 0.0)
        constant = stiffness**2 - (0.0 if force is None else force**2 / s)
        half = stiffness - 2 * xi**2
        root = np.sqrt(half**2 - lead * constant)
        low = constant / (half + root)  # the other root of the quadratic, free of cancellation
        high = (half + root) / lead
        found = np.sqrt(np.array([low, high]))
    return np.asarray(np.where(np.isfinite(found), found, np.nan))


def _cubic(p: float, xi: float, beta: float, force: float | None) -> list[float]:
    F2 = p * p if force is None else force**2
    return [9 / 16 * beta**2, 1.5 * beta * (1 - p), (1 - p) ** 2 + 4 * xi**2 * p, -F2]


def duffing_amplitudes(Omega: float, *, xi: float, beta: float, force: float | None = None) -> tuple[float, ...]:
    """All amplitudes of the one-term response of Duffing's oscillator at a frequency (one or three).

    Parameters
    ----------
    Omega : float
        Excitation frequency.
    xi, beta, force
        As in `duffing_frequencies`.

    Returns
    -------
    tuple of float
        Ascending; of three the middle one is unstable.

    Raises
    ------
    InputError
        Values that are negative or not finite.

    References
    ----------
    Nayfeh and Mook (1979), section 4.1.

    Examples
    --------
    >>> import stability as st
    >>> len(st.duffing_amplitudes(1.2, xi=0.02, beta=0.001))
    3
    """
    _checked(Omega=Omega, xi=xi, force=force)
    coefficients = _cubic(Omega**2, xi, beta, force)
    while coefficients[0] == 0 and len(coefficients) > 2:
        coefficients = coefficients[1:]
    roots = np.roots(coefficients)
    scale = max(abs(roots)) if len(roots) else 0.0
    found = sorted(math.sqrt(r.real) for r in roots if abs(r.imag) <= 1e-9 * scale and r.real > 0)
    return tuple(found)


def duffing_folds(*, xi: float, beta: float, force: float | None = None) -> tuple[tuple[float, float], ...]:
    """The folds of Duffing's one-term response, from the exact discriminant.

    The cubic in a^2 of `duffing_amplitudes` has a double root where its discriminant, a polynomial in Omega^2, is zero.

    Parameters
    ----------
    xi, beta, force
        As in `duffing_frequencies`.

    Returns
    -------
    tuple of (Omega, amplitude)
        Descending in amplitude; empty for a single-valued response, one fold for an open resonance; a softening spring
        has one more at amplitudes where it has long lost its stiffness.

    Raises
    ------
    InputError
        Values that are negative or not finite; beta = 0.

    References
    ----------
    Nayfeh and Mook (1979), section 4.1.

    Examples
    --------
    >>> import stability as st
    >>> [round(Omega, 4) for Omega, _ in st.duffing_folds(xi=0.02, beta=0.001)]
    [1.3726, 1.0884]
    """
    _checked(xi=xi, force=force)
    if beta == 0 or not math.isfinite(beta):
        raise InputError(f"beta = {beta}: a linear response has no folds")
    P = np.polynomial.Polynomial
    p = P([0.0, 1.0])
    F2 = p**2 if force is None else P([force**2])
    # s is scaled by beta: z = beta s, z^3 9/16 + ...
    A, B, C, D = P([9 / 16]), 1.5 * (1 - p), (1 - p) ** 2 + 4 * xi**2 * p, -beta * F2
    discriminant = B**2 * C**2 - 4 * A * C**3 - 4 * B**3 * D - 27 * A**2 * D**2 + 18 * A * B * C * D
    found = []
    for value in discriminant.roots().astype(complex).tolist():
        if abs(value.imag) > 1e-7 * abs(value) or value.real <= 0:
            continue
        w = float(value.real)
        a, b, c, d = (float(q(w)) for q in (A, B, C, D))
        delta0 = b * b - 3 * a * c
        z = (9 * a * d - b * c) / (2 * delta0) if delta0 != 0 else -b / (3 * a)
        if z / beta > 0:
            found.append((math.sqrt(w), math.sqrt(z / beta)))
    return tuple(sorted(found, key=lambda pair: -pair[1]))


def duffing_peak(*, xi: float, beta: float) -> tuple[float, float]:
    """Phase resonance of Duffing's oscillator on a moving base, where the response lags by 90 degrees.

    u'' + 2 xi u' + u + beta u^3 = Omega^2 cos(Omega t): Omega_p^2 = 1/(1 - 3 beta/(16 xi^2)), a_p = Omega_p/(2 xi).

    Parameters
    ----------
    xi, beta : float
        Damping ratio, > 0, and cubic coefficient.

    Returns
    -------
    (Omega_p, a_p)
        Exact in one-term harmonic balance. Infinite, with a warning, for an open resonance, beta >= 16 xi^2/3.

    Raises
    ------
    InputError
        xi not positive.

    References
    ----------
    Source chapter, (53) and figure 9.

    Examples
    --------
    >>> import stability as st
    >>> st.duffing_peak(xi=0.02, beta=0.001)[0].__round__(9)
    1.371988681
    """
    if not (xi > 0 and math.isfinite(xi) and math.isfinite(beta)):
        raise InputError(f"xi = {xi}, beta = {beta}: a peak needs finite values and xi > 0")
    inverse = 1 - 3 * beta / (16 * xi**2)
    if inverse <= 0:
        warnings.warn(
            f"open resonance: beta = {beta:g} >= 16 xi^2/3 = {16 * xi**2 / 3:g}, so that the upper branch under base "
            "excitation never turns back; more damping or a smaller base amplitude closes the peak",
            OpenResonanceWarning,
            stacklevel=2,
        )
        return math.inf, math.inf
    Omega = 1 / math.sqrt(inverse)
    return Omega, Omega / (2 * xi)


def duffing_fold_onset(*, xi: float, beta: float) -> tuple[float, float, float]:
    """Where the folds of the forced Duffing oscillator begin (the cusp), to leading order in the damping.

    u'' + 2 xi u' + u + beta u^3 = F cos(Omega t): F_c^2 = 256 xi^3/(9 sqrt(3) |beta|),
    a_c^2 = 16 xi/(3 sqrt(3) |beta|), Omega_c = 1 +- sqrt(3) xi (+ stiffening, - softening).

    Parameters
    ----------
    xi, beta : float
        Damping ratio, cubic coefficient.

    Returns
    -------
    (Omega_c, F_c, a_c)
        Relative error O(xi); `locus` of a fold gives the cusp exactly.

    Raises
    ------
    InputError
        xi not positive or beta zero.

    References
    ----------
    Nayfeh and Mook (1979), section 4.1.

    Examples
    --------
    >>> import stability as st
    >>> [round(v, 4) for v in st.duffing_fold_onset(xi=0.01, beta=0.1)]
    [1.0173, 0.0128, 0.5549]
    """
    if not (xi > 0 and math.isfinite(xi) and beta != 0 and math.isfinite(beta)):
        raise InputError(f"xi = {xi}, beta = {beta}: the onset of folds needs xi > 0 and beta != 0")
    size = abs(beta)
    force = math.sqrt(256 * xi**3 / (9 * math.sqrt(3) * size))
    return 1 + math.copysign(math.sqrt(3) * xi, beta), force, math.sqrt(16 * xi / (3 * math.sqrt(3) * size))


def duffing_mathieu_amplitudes(
    Omega: npt.ArrayLike, *, xi: float, h: float, beta: float, method: str = "averaging"
) -> Array:
    """Amplitudes of the parametrically excited Duffing oscillator in its principal (2:1) resonance.

    u'' + 2 xi u' + (1 + h cos(2 Omega t)) u + beta u^3 = 0: (Omega^2 - 1 - 3/4 beta a^2)^2 + 4 xi^2 Omega^2 = h^2/4.

    Parameters
    ----------
    Omega : array
        Half the modulation frequency.
    xi, h, beta : float
        Damping ratio, modulation depth, cubic coefficient.
    method : {"averaging", "multiple scales"}
        The equation above, or a^2 = 8/(3 beta) (Omega - 1 +- sqrt(h^2/16 - xi^2)).

    Returns
    -------
    array, (2, ...)
        The larger, then the smaller for beta > 0: stable, unstable (beta < 0: the reverse); NaN where there is none.

    Raises
    ------
    InputError
        beta = 0, an unknown method.

    References
    ----------
    Nayfeh and Mook (1979), section 5.7.

    Examples
    --------
    >>> import stability as st
    >>> st.duffing_mathieu_amplitudes(1.0, xi=0.0, h=0.3, beta=0.2).round(6)
    array([ 1., nan])
    """
    if beta == 0:
        raise InputError("beta = 0: the amplitude of a linear parametric resonance is not bounded")
    if method not in ("averaging", "multiple scales"):
        raise InputError(f"method = {method!r}: 'averaging' or 'multiple scales'")
    w = np.asarray(Omega, dtype=float)
    sign = np.array([1.0, -1.0]).reshape(2, *([1] * w.ndim))
    with np.errstate(invalid="ignore"):
        if method == "averaging":
            square = 4 / (3 * beta) * (w**2 - 1 + sign * np.sqrt(h**2 / 4 - 4 * xi**2 * w**2))
        else:
            square = 8 / (3 * beta) * (w - 1 + sign * np.sqrt(h**2 / 16 - xi**2))
        return np.sqrt(np.where(square > 0, square, np.nan))
