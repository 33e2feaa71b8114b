"""Coaxial cylinder magnets in closed form: complete elliptic integrals instead of a quadrature.

For each pair of pole faces with radii a, b and distance z (Robertson, Cazzolato and Zander 2011, eq. (6); their
a1 = z, a3^2 = (a + b)^2 + z^2, m = 4 a b/a3^2, d = a - b)

    C(z) = z a3 (1 + d^2/z^2) [K - E/(1 + d^2/z^2) - (1 - z^2/a3^2) Pi(n, m)],    n = -m z^2/d^2.

Written with Pi - K = (n/3) RJ(0, 1 - m, 1, 1 - n) the poles at z = 0 cancel and so does the round-off:

    C(z) = z a3 { (z^2 + d^2) [ m (1 - z^2/a3^2)/(3 d^2) RJ(0, 1 - m, 1, 1 + m z^2/d^2) + K/a3^2 ] - E },   d != 0,
    C(z) = z a3 (K - E),                                                                                  d  = 0.

Then pi S_0(z) = pi sign(z) min(a, b)^2/2 - C(z)/2 with S_0 of `coaxial_discs`; the jump cancels in the sum over the
four faces of two magnets that do not overlap, the second term is the whole force.

References: W. Robertson, B. Cazzolato and A. Zander, IEEE Trans. Magn. 47 (2011) 2045; B. C. Carlson, Numer.
Algorithms 10 (1995) 13 (RF, RJ).
"""

from __future__ import annotations

import numpy as np

__all__ = ["cylinder_faces"]


def cylinder_faces(a: float, b: float, z: np.ndarray) -> np.ndarray:
    """C(z) of one pair of faces, odd in z, smooth through z = 0 for a != b.

    Parameters
    ----------
    a, b : float
        Radii, > 0.
    z : (N,) array
        Axial distance, any sign; for a = b not 0.

    Returns
    -------
    (N,) array
        Length^2.

    Examples
    --------
    >>> from stability.kernels.coaxial_discs import charged_discs
    >>> z = np.array([0.7])
    >>> bool(abs(np.pi * charged_discs(1.0, 2.0, z) - (np.pi / 2 - cylinder_faces(1.0, 2.0, z) / 2))[0] < 1e-14)
    True
    """
    from scipy.special import ellipe, ellipkm1, elliprj

    z = np.asarray(z, dtype=float)
    square, d = z**2, a - b
    longest = (a + b) ** 2 + square
    rest = (d**2 + square) / longest  # 1 - m
    k, e = ellipkm1(rest), ellipe(1.0 - rest)
    if d == 0.0:
        return z * np.sqrt(longest) * (k - e)
    m = 4.0 * a * b / longest
    third = m * (1.0 - square / longest) / (3.0 * d**2) * elliprj(0.0, rest, 1.0, 1.0 + m * square / d**2)
    return z * np.sqrt(longest) * ((square + d**2) * (third + k / longest) - e)
