r"""Characteristic values of Mathieu's equation for complex q: continuation along a ray, with the branch cuts stated.

For complex ``q`` the functions ``a_n(q)``, ``b_n(q)`` of ``x'' + (a - 2 q cos 2z) x = 0`` are branches of one
analytic function in each of the four families (even or odd solution, period pi or 2 pi); the branches of a family
meet in pairs at square-root points. The first are ``a_0 = a_2 = 2.0886989...`` at ``q = +-1.46876861...i``. A name
for a branch needs a path:

* ``a_n(q)`` is the value reached from ``a_n(0) = n^2`` along the straight ray from 0 to ``q``. It is analytic off
  the cuts that run radially outwards from each double point, agrees with the real axis, and ``a_n(conj q) = conj
  a_n(q)``.
* On the imaginary axis, which holds double points of the families of period pi, the value is the limit from ``Re q >
  0``: beyond ``|q| = 1.4687686`` ``a_0`` and ``a_2`` are then a conjugate pair. A real part below 1e-12 |q| counts
  as zero.
* At a double point itself the eigenvalue is defective: a rounding of ``q`` moves it by the square root of that
  rounding, and about eight digits are meaningful. Where the estimated error (condition number times rounding) passes
  1e-6 of ``max(|a|, |q|, 1)``, or where roundings on the way reach the next branch, a `ConvergenceError` is raised.

Reference: C. Hunter, B. Guerrieri, Stud. Appl. Math. 64 (1981) 113-141 (branch points); DLMF 28.7.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError
from .mathieu import family, rows_needed

__all__ = ["MAX_COMPLEX_Q", "continued_values"]

MAX_COMPLEX_Q = 500.0
_TILT = 1e-3  # rad; the path to an imaginary q runs this far from the axis, then turns onto it
_FIRST_STEP, _LEAST_STEP = 1 / 32, 1e-11
_SURE = 0.2  # a match is accepted when the second nearest eigenvalue is five times as far away
_ROUNDING = 4.0 * float(np.finfo(float).eps)
_WORST = 1e-6  # largest estimated relative error that is still returned

Complex = NDArray[np.complex128]


def continued_values(order: NDArray[np.int64], q: Complex, odd: bool) -> Complex:
    """a_n(q) or b_n(q) for arrays that broadcast; see the module for the branches.

    Raises
    ------
    InputError
        ``|q|`` above 500.
    ConvergenceError
        A double point on the ray, or an eigenvalue too ill-conditioned for double precision, at `q` or on the way.
    """
    if np.any(np.abs(q) > MAX_COMPLEX_Q):
        worst = q.flat[np.argmax(np.abs(q))]
        raise InputError(f"complex q = {worst} is too large; |q| <= {MAX_COMPLEX_Q:g} is allowed (1e6 for real q)")
    order, q = np.broadcast_arrays(order, q)
    result = np.empty(order.shape, dtype=complex)
    flat, orders, strengths = result.reshape(-1), order.ravel(), q.ravel()
    for strength in np.unique(strengths):
        for parity in (0, 1):
            chosen = np.flatnonzero((strengths == strength) & (orders % 2 == parity))
            for n in np.unique(orders[chosen]):
                flat[chosen[orders[chosen] == n]] = _continued_value(int(n), complex(strength), odd)
    return result


def _matrix(n: int, q: complex, odd: bool, first: int, rows: int) -> Complex:
    """Rows `first` .. `rows` - 1 of the complex symmetric matrix of the family of order `n`."""
    diagonal, _, _ = family(np.array([n]), np.array([q]), odd, rows)
    off = np.full(rows - 1, q, dtype=complex)
    if not odd and n % 2 == 0:
        off[0] = np.sqrt(2.0) * q
    full = np.diag(diagonal[:, 0]) + np.diag(off, 1) + np.diag(off, -1)
    return full[first:, first:]


def _path(q: complex, s: float) -> complex:
    """The ray from 0 to `q`; for imaginary `q` a ray tilted towards Re q > 0, then an arc onto the axis."""
    if abs(q.real) > 1e-12 * abs(q):
        return s * q
    tilt = -_TILT if q.imag > 0 else _TILT
    if s < 0.9:
        return s / 0.9 * q * np.exp(1j * tilt)
    return q * np.exp(1j * tilt * (1.0 - s) / 0.1)


def _continued_value(n: int, q: complex, odd: bool) -> complex:
    """Follow one eigenvalue from ``q = 0`` along the path, in steps that leave no doubt which one it is."""
    if q == 0:
        return complex(n * n)
    size = abs(q)
    rows = int(rows_needed(np.array([n * n + 2.0 * size]), np.array([size]))[0])
    first = max(0, int(0.5 * np.sqrt(max(n * n - 4.0 * size, 0.0)) - 7.0 * np.cbrt(size) - 12.0))
    value, s, step = complex(n * n), 0.0, _FIRST_STEP
    while s < 1.0:
        target = min(1.0, s + step)
        spectrum, vectors = np.linalg.eig(_matrix(n, _path(q, target), odd, first, rows))
        distance = np.abs(spectrum - value)
        nearest, second = np.argsort(distance)[:2]
        gap = abs(spectrum[second] - spectrum[nearest])
        rounding = _condition(vectors[:, nearest]) * _ROUNDING * max(abs(value), size, 1.0)
        at_end = target == 1.0 and step <= 1e-8  # a double point at q itself: both candidates are its value
        sure = distance[nearest] <= _SURE * distance[second] and rounding <= _SURE * gap
        if sure or at_end:
            value, s, step = complex(spectrum[nearest]), target, min(1.6 * step, 0.1)
            continue
        step *= 0.5
        if step < _LEAST_STEP:
            raise ConvergenceError(
                f"order {n} cannot be followed to q = {q}: at q = {_path(q, s):.9g} it meets another order, or "
                "roundings reach the next one; choose a q off this ray, or a smaller one",
                last_q=_path(q, s),
                last_value=value,
            )
    return _polished(n, q, odd, value, _matrix(n, q, odd, first, rows))


def _polished(n: int, q: complex, odd: bool, value: complex, matrix: Complex) -> complex:
    """Rayleigh quotient ``v^T T v / v^T v`` of the complex symmetric matrix, with its condition number checked."""
    spectrum, vectors = np.linalg.eig(matrix)
    at = int(np.argmin(np.abs(spectrum - value)))
    vector = vectors[:, at]
    weight = np.sum(vector * vector)
    condition = _condition(vector)
    scale = max(abs(value), abs(q), 1.0)
    # at a simple double point the error saturates at the square root
    error = min(condition * _ROUNDING, np.sqrt(_growth(spectrum, at, scale) * _ROUNDING))
    if error > _WORST:
        raise ConvergenceError(
            f"{'b' if odd else 'a'}_{n} at q = {q} has condition number {condition:.1e}: only about "
            f"{error:.0e} relative would be right in double precision",
            condition=condition,
            estimated_error=error * scale,
        )
    if condition > 1e4:
        return value
    return complex(np.sum(vector * (matrix @ vector)) / weight)


def _condition(vector: Complex) -> float:
    """Condition number ``|v|^2 / |v^T v|`` of a simple eigenvalue of a complex symmetric matrix."""
    return float(np.sum(np.abs(vector) ** 2) / max(abs(np.sum(vector * vector)), 1e-300))


def _growth(spectrum: Complex, at: int, scale: float) -> float:
    """1 where only one other eigenvalue is near (square-root point), infinity where the cluster is larger."""
    near = np.sum(np.abs(spectrum - spectrum[at]) < 1e-3 * scale)
    return 1.0 if near == 2 else np.inf
