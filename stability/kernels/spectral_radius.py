"""From interpolated Floquet data to growth exponents, elementwise and in place: closed forms for two and four states.

All forms are for the normalised monodromy matrix M0 = M exp(-trace part), det M0 = 1; theta = log of the largest
modulus of its multipliers, so that the growth rate is sigma + theta / T with sigma the mean trace over n.

Two states, half-period factors f = (u1', u2, u1, u2') of an even Hill equation:

    p = f0 f1 = (tr - 2) / 4,  m = f2 f3 = (tr + 2) / 4,  s = max(p, -m),  theta = 2 arsinh(sqrt(max(s, 0))).

Two states, f = (M11 - M22, M12, M21, tr): s = (f0^2 + 4 f1 f2) / 4 = (tr^2 - 4) / 4, theta = arsinh(sqrt(max(s, 0))).
Both keep the relative accuracy of s, on which theta depends by a square root, where tr -+ 2 alone would lose it.

Four states, z^4 - c1 z^3 + c2 z^2 - c3 z + 1: the resolvent cubic y^3 - c2 y^2 + (c1 c3 - 4) y = c1^2 + c3^2 - 4 c2
has its largest real root y = q + 1/q >= 2, and the quartic is (z^2 - s1 z + q)(z^2 - s2 z + 1/q) with s1 + s2 = c1,
s1 s2 = c2 - y and sign(s1 - s2) = -sign(c3 - c1 y / 2). If the polynomial is its own reciprocal (c1 = c3), with
w = z + 1/z: w^2 - c1 w + c2 - 2 = 0 and cosh theta = (|w - 2| + |w + 2|) / 4, the largest over both w.

The kind says where the largest multiplier is when it is outside the unit circle: 1 (positive real, "+1"), 2 (negative
real, "-1"), 3 (complex pair).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["four_states", "four_states_reciprocal", "largest_root_slope", "polynomial_error"]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]


def four_states_reciprocal(c: Array) -> tuple[Array, Codes, Array]:
    """theta, kind and the distance to instability for coefficients (3, ...) of a reciprocal quartic.

    Returns
    -------
    theta : (...) log of the spectral radius, >= 0
    kind : (...) int8
    margin : (...) negative inside the region where all multipliers lie on the unit circle: the largest of
        |w| - 2 and -(discriminant of the equation for w).

    >>> theta, kind, margin = four_states_reciprocal(np.array([[0.0], [2.0 - 9.0], [0.0]]))  # w = -3, 3
    >>> bool(abs(2 * np.cosh(theta[0]) - 3) < 1e-14)
    True
    """
    c1, c2 = 0.5 * (c[0] + c[2]), c[1]
    discriminant = c1 * c1 - 4.0 * c2 + 8.0
    complex_pair = discriminant < 0
    root = np.sqrt(np.abs(discriminant))
    real_extreme = 0.5 * (np.abs(c1) + root)  # the larger |w| when both are real
    re, im = 0.5 * np.abs(c1), 0.5 * root
    # cosh theta - 1 for complex w = re + i im, without cancellation: (|w - 2| + |w + 2|) / 4 - 1
    far, near = np.hypot(re + 2.0, im), np.hypot(re - 2.0, im)
    # |w - 2| - (2 - re) = im^2 / (|w - 2| + 2 - re) for re < 2, and the same with + for |w + 2|
    small = im * im * (1.0 / (far + re + 2.0) + 1.0 / (near + np.abs(2.0 - re))) + 2.0 * np.maximum(re - 2.0, 0.0)
    excess = np.where(complex_pair, 0.25 * small, 0.5 * np.maximum(real_extreme - 2.0, 0.0))
    theta = 2.0 * np.arcsinh(np.sqrt(0.5 * excess))
    kind = np.where(complex_pair, 3, np.where(c1 >= 0, 1, 2)).astype(np.int8)
    return theta, kind, np.maximum(real_extreme - 2.0, -discriminant)


def four_states(c: Array) -> tuple[Array, Codes, Array]:
    """theta, kind and the sensitivity of theta for coefficients c1, c2, c3, (3, ...), of the quartic.

    Returns
    -------
    theta : (...) log of the spectral radius
    kind : (...) int8, where the largest multiplier lies
    slope : (...) 1 / |z P'(z)| at the largest root: an error d of P(z) moves theta by about d times this.

    >>> theta, kind, _ = four_states(np.array([[4.25], [0.0], [0.0]]) * 0 + np.poly([2, .5, 1j, -1j])[1:4, None]
    ...                              * np.array([[-1.], [1.], [-1.]]))
    >>> bool(abs(theta[0] - np.log(2)) < 1e-14), int(kind[0])
    (True, 1)
    """
    theta, z, slope = _largest_root(c)
    kind = np.where(z.imag != 0, 3, np.where(z.real >= 0, 1, 2)).astype(np.int8)
    return theta, kind, slope


def _largest_root(c: Array) -> tuple[Array, NDArray[np.complex128], Array]:
    """log of the largest modulus, the root itself (imaginary part >= 0), and 1 / |z P'(z)|."""
    c1, c2, c3 = c
    y = np.maximum(_largest_cubic_root(c2, c1 * c3 - 4.0, c1 * c1 + c3 * c3 - 4.0 * c2), 2.0)
    q = 0.5 * (y + np.sqrt((y - 2.0) * (y + 2.0)))
    spread = np.sqrt(np.maximum(c1 * c1 - 4.0 * (c2 - y), 0.0))
    spread = np.where(c3 - 0.5 * c1 * y > 0, -spread, spread)
    s1, s2, r = 0.5 * (c1 + spread), 0.5 * (c1 - spread), 1.0 / q
    s1, q, s2, r = _polish(c, *_polish(c, s1, q, s2, r))
    size1, size2 = _pair_radius(s1, q), _pair_radius(s2, r)
    first = size1 >= size2
    s, p, other_s, other_p = (
        np.where(first, s1, s2),
        np.where(first, q, r),
        np.where(first, s2, s1),
        np.where(first, r, q),
    )
    radius = np.maximum(size1, size2)
    own = s * s - 4.0 * p
    real = own >= 0
    z_re = np.where(real, np.where(s >= 0, radius, -radius), 0.5 * s)
    z_im = np.where(real, 0.0, 0.5 * np.sqrt(np.abs(own)))
    # the other factor at z
    o_re = z_re * z_re - z_im * z_im - other_s * z_re + other_p
    o_im = z_im * (2.0 * z_re - other_s)
    slope = 1.0 / np.maximum(radius * np.sqrt(np.abs(own) * (o_re * o_re + o_im * o_im)), 1e-300)
    return np.log(radius), z_re + 1j * z_im, slope


def largest_root_slope(c: Array, changes: list[Array]) -> tuple[Array, list[Array]]:
    """log of the spectral radius of the quartic c (3, B), and its change with c: one array (B,) per dc (3, B).

    With the largest root z, d log|z| = Re(dz / z) and dz = (z^3 dc1 - z^2 dc2 + z dc3) / P'(z).
    """
    theta, z, _ = _largest_root(c)
    slope = ((4.0 * z - 3.0 * c[0]) * z + 2.0 * c[1]) * z - c[2]
    safe = np.where(np.abs(slope) > 1e-300, slope, 1.0)
    return theta, [(((z * d[0] - d[1]) * z + d[2]) / safe).real for d in changes]


def _pair_radius(s: Array, p: Array) -> Array:
    """Largest modulus of the roots of z^2 - s z + p."""
    own = s * s - 4.0 * p
    return np.where(own >= 0, 0.5 * (np.abs(s) + np.sqrt(np.maximum(own, 0.0))), np.sqrt(np.abs(p)))


def _largest_cubic_root(b: Array, c: Array, d: Array) -> Array:
    """Largest real root of y^3 - b y^2 + c y - d, in closed form, polished by one Newton step."""
    shift = b / 3.0
    p = c / 3.0 - shift * shift
    half = shift * (shift * shift - 0.5 * c) + 0.5 * d
    discriminant = half * half + p * p * p
    three = discriminant < 0
    size = np.sqrt(np.maximum(-p, 0.0))
    angle = np.arccos(np.clip(half / np.maximum(size * size * size, 1e-300), -1.0, 1.0))
    big = np.cbrt(np.abs(half) + np.sqrt(np.maximum(discriminant, 0.0)))
    one = np.copysign(big - p / np.maximum(big, 1e-300), half)
    y = shift + np.where(three, 2.0 * size * np.cos(angle / 3.0), one)
    for _ in range(2):
        value = ((y - b) * y + c) * y - d
        slope = (3.0 * y - 2.0 * b) * y + c
        step = np.where(np.abs(slope) > 1e-5 * (1.0 + y * y), value / np.where(slope == 0, 1.0, slope), 0.0)
        y = y - np.clip(step, -1e-3 * (1.0 + np.abs(y)), 1e-3 * (1.0 + np.abs(y)))
    return y


def _polish(c: Array, s1: Array, q: Array, s2: Array, r: Array) -> tuple[Array, Array, Array, Array]:
    """One Newton step for (z^2 - s1 z + q)(z^2 - s2 z + r) = the quartic; left out where the factors are too alike."""
    e1 = c[0] - (s1 + s2)
    e2 = c[1] - (q + r + s1 * s2)
    e3 = c[2] - (s1 * r + s2 * q)
    e4 = 1.0 - q * r
    # unknown steps: ds2 = e1 - ds1, dr from e2, then a 2 x 2 system in (ds1, dq)
    ds = s2 - s1
    # e2 = dq + dr + s2 ds1 + s1 ds2 -> dr = e2 - s1 e1 - dq - ds ds1
    base = e2 - s1 * e1
    # e3 = r ds1 + s1 dr + q ds2 + s2 dq ; e4 = r dq + q dr
    a11, a12, b1 = (r - q) - s1 * ds, ds, e3 - s1 * base - q * e1
    a21, a22, b2 = -q * ds, r - q, e4 - q * base
    determinant = a11 * a22 - a12 * a21
    size = (np.abs(a11) + np.abs(a12)) * (np.abs(a21) + np.abs(a22))
    good = np.abs(determinant) > 1e-9 * np.maximum(size, 1e-300)
    scale = np.where(good, 1.0, 0.0) / np.where(good, determinant, 1.0)
    d1 = (b1 * a22 - b2 * a12) * scale
    dq = (a11 * b2 - a21 * b1) * scale
    ok = good & (np.abs(dq) < 1e-2 * (1.0 + np.abs(q))) & (np.abs(d1) < 1e-2 * (1.0 + np.abs(s1)))
    d1, dq = np.where(ok, d1, 0.0), np.where(ok, dq, 0.0)
    d2 = np.where(ok, e1 - d1, 0.0)
    dr = np.where(ok, base - dq - ds * d1, 0.0)
    return s1 + d1, q + dq, s2 + d2, r + dr


def polynomial_error(radius: Array, coefficient_error: float, degree: int) -> Array:
    """Bound of the error of P(z) at |z| = radius if each coefficient c_1 .. c_{degree - 1} is off by at most this."""
    total = np.zeros_like(radius)
    power = np.ones_like(radius)
    for _ in range(1, degree):
        power = power * radius
        total += power
    return coefficient_error * total
