"""Two rectangular block magnets with parallel edges, magnetised along z: closed form of Akoun and Yonnet.

Corner distances u = x + s_i A2 - s_j A1, v = y + s_k B2 - s_l B1, w = z + s_p C2 - s_q C1 (half edges, s = +-1, (x, y,
z) from the centre of magnet 1 to that of magnet 2), r^2 = u^2 + v^2 + w^2. With polarisations J1, J2 the energy and
its derivatives with respect to z are

    W^(n) = J1 J2/(4 pi mu0) sum s_i s_j s_k s_l s_p s_q psi_n(u, v, w)

    psi_0 = u (v^2 - w^2)/2 asinh(u/|v,w|) + v (u^2 - w^2)/2 asinh(v/|u,w|) - u v w atan(u v/(r w))
            - r (u^2 + v^2 - 2 w^2)/6
    psi_1 = r w - u w asinh(u/|v,w|) - v w asinh(v/|u,w|) - u v atan(u v/(r w))
    psi_2 = 2 r - u asinh(u/|v,w|) - v asinh(v/|u,w|)
    psi_3 = w r (p + q),                                      p = 1/(v^2 + w^2), q = 1/(u^2 + w^2)
    psi_4 = (r + w^2/r) (p + q) - 2 w^2 r (p^2 + q^2)

with d^4 psi_0/du^2 dv^2 = 1/r. The force on magnet 2 is F_z = -W^(1). ln(r - u) of the reference is written
-asinh(u/|v,w|) plus a term that cancels in the sum: no loss of digits, no log of zero for aligned edges.

Reference: G. Akoun and J.-P. Yonnet, IEEE Trans. Magn. 20 (1984) 1962. Derivatives re-derived (sympy).
"""

from __future__ import annotations

import itertools

import numpy as np

__all__ = ["block_interaction"]


def block_interaction(
    half1: tuple[float, float, float],
    half2: tuple[float, float, float],
    offset: tuple[float, float],
    z: np.ndarray,
    order: int = 0,
) -> np.ndarray:
    """W^(order)(z) for J1 J2/(4 pi mu0) = 1; parallel polarisation.

    Parameters
    ----------
    half1, half2 : (3,) floats
        Half edges along x, y, z.
    offset : (2,) floats
        Lateral position (x, y) of centre 2 from centre 1.
    z : (N,) array
        Axial distance of the centres; facing poles must not touch.
    order : int
        0 (energy) to 4.

    Returns
    -------
    (N,) array
        Length^(3 - order).

    Notes
    -----
    Accuracy: the 64 terms cancel to a dipole law far away; the relative error grows as 1e-16 (z/edge)^6.

    Examples
    --------
    >>> w = block_interaction((0.5, 0.5, 0.5), (0.5, 0.5, 0.5), (0.0, 0.0), np.array([10.0]))[0]
    >>> round(float(w) * 10.0**3, 3)                       # parallel unit dipoles: -2/z^3
    -2.0
    """
    z = np.asarray(z, dtype=float)
    total = np.zeros(z.shape)
    signs = (-1.0, 1.0)
    for i, j, k, m, p, q in itertools.product(signs, repeat=6):
        u = offset[0] + i * half2[0] - j * half1[0]
        v = offset[1] + k * half2[1] - m * half1[1]
        total += i * j * k * m * p * q * _corner(u, v, z + p * half2[2] - q * half1[2], order)
    return total


def _corner(u: float, v: float, w: np.ndarray, order: int) -> np.ndarray:
    r = np.sqrt(u * u + v * v + w * w)
    if order >= 3:
        p, q = 1.0 / (v * v + w * w), 1.0 / (u * u + w * w)
        return w * r * (p + q) if order == 3 else (r + w * w / r) * (p + q) - 2.0 * w * w * r * (p * p + q * q)
    along_u, along_v = np.arcsinh(u / np.hypot(v, w)), np.arcsinh(v / np.hypot(u, w))
    if order == 2:
        return 2.0 * r - u * along_u - v * along_v
    angle = np.arctan2(u * v * np.sign(w), r * np.abs(w))
    if order == 1:
        return r * w - w * (u * along_u + v * along_v) - u * v * angle
    bent = u * (v * v - w * w) * along_u + v * (u * u - w * w) * along_v
    return 0.5 * bent - u * v * w * angle - r * (u * u + v * v - 2.0 * w * w) / 6.0
