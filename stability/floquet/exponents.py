r"""Characteristic exponent of Mathieu's equation, and its inverse: ``nu(a, q)`` and ``a(nu, q)``.

    x'' + (a - 2 q cos 2z) x = 0,        x = exp(+-i nu z) times a pi-periodic function        (DLMF 28.2(iii))

With the half-period factors (`stability.kernels.mathieu_factors`)

    S = -(pi^2/4) P_ae P_be = sin^2(pi nu/2),   C = P_ao P_bo = cos^2(pi nu/2),   trace = 2 - 4 S = 4 C - 2,

S and C keep their relative accuracy where they vanish, at the tongue edges; the trace has lost half of the digits
there. The identity ``S + C = 1`` (the Wronskian) is not used but checked: it is the error control.

**Convention.** For real ``a, q`` the exponent is unfolded by the number ``k`` of characteristic values below ``a``:

* ``k = 2m + 1`` (stable band between tongues m and m + 1): ``nu`` is real, ``m < nu < m + 1``, and ``nu -> sqrt(a)``
  for ``q -> 0``;
* ``k = 2m`` (in tongue m; m = 0: below ``a_0``): ``Re nu = m`` exactly, ``Im nu >= 0`` is the growth rate per unit
  of ``z``.

``nu`` is continuous in ``a`` along the real axis, and ``Re nu`` never decreases. For complex ``a`` or ``q`` there is
no order to unfold by: the principal value ``0 <= Re nu <= 1`` with ``Im nu >= 0`` where ``Re nu`` is 0 or 1 is given
(``nu`` is one of ``+-nu + 2k``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ConvergenceError, InputError
from ..kernels.mathieu_factors import Factors, half_period_factors, rows_for
from ..kernels.tridiagonal import indexed_eigenvalues
from .mathieu import MAX_Q, NO_COUPLING, check_numbers, mathieu_a, rows_needed

__all__ = ["mathieu_a_of_exponent", "mathieu_exponent"]

_MAX_A = 4e6
_MAX_NU = 500.0
_POINTS = 20_000  # points in one block
_EPS = float(np.finfo(float).eps)
_GOAL = 1e-13  # estimated error of nu above which the recursion is repeated in pairs of doubles
_DEFECT = 1e-9  # largest |S + C - 1| relative to |S|, |C|, 1 that is returned
_LOG2 = float(np.log(2.0))


def mathieu_exponent(a: ArrayLike, q: ArrayLike) -> Any:
    r"""Characteristic exponent of Mathieu's equation, unfolded.

    ``x'' + (a - 2 q cos 2z) x = 0`` has the solutions ``exp(+-i nu z)`` times a pi-periodic function.

    Parameters
    ----------
    a, q : real or complex, broadcast; ``|a| <= 4e6``, ``|q| <= 1e6``.

    Returns
    -------
    complex, or an array of the broadcast shape. Real `a`, `q`: ``Re nu`` unfolded (``nu = sqrt(a)`` at ``q = 0``);
    in tongue m ``Re nu = m`` and ``Im nu > 0`` is the growth rate per unit of z. Complex `a` or `q`: ``0 <= Re nu <=
    1``.

    Raises
    ------
    InputError
        Arguments that are not finite or out of range.
    ConvergenceError
        The Wronskian identity is violated by more than 1e-9 (complex arguments of large modulus).

    Notes
    -----
    *Accuracy*: absolute error below 1e-12 against 30-digit values for ``|a| <= 1e4, |q| <= 4900``, also 1e-9 and 1e-12
    from tongue edges (the arguments are taken as exact doubles); up to q = 1e6 by independent truncations. Complex
    arguments: 1e-9, controlled by the Wronskian. In the exponentially thin bands of large q the value is that of
    arguments moved by 1e-30 relative. Reference: DLMF 28.2(iii), 28.29.

    Examples
    --------
    >>> import stability as st
    >>> print(st.mathieu_exponent(6.25, 0.0), st.mathieu_exponent(1.0, 0.5).real)
    (2.5+0j) 1.0
    """
    first = check_numbers("a", a, _MAX_A)
    second = check_numbers("q", q, MAX_Q)
    kind = np.result_type(first, second)
    first, second = np.broadcast_arrays(first.astype(kind), second.astype(kind))
    # numbers whose square is none any more are zero as far as nu is concerned
    flat_a, flat_q = (np.where(np.abs(x) < NO_COUPLING, 0.0, x) for x in (first.ravel(), second.ravel()))
    result = np.empty(flat_a.size, dtype=complex)
    rows = rows_for(flat_a, flat_q)
    compute = _principal if kind.kind == "c" else _unfolded
    for size in np.unique(rows):
        members = np.flatnonzero(rows == size)
        for start in range(0, members.size, _POINTS):
            block = members[start : start + _POINTS]
            result[block] = compute(flat_a[block], flat_q[block], int(size))
    return result.reshape(first.shape) if first.ndim else complex(result[0])


def _sines(factors: Factors) -> tuple[Any, Any, Any, Any]:
    """Mantissas and exponents of S and C."""
    m, e = factors.mantissa, factors.exponent
    return -(0.25 * np.pi**2) * m[0] * m[1], e[0] + e[1], m[2] * m[3], e[2] + e[3]


def _defect(s: Any, s_exp: Any, c: Any, c_exp: Any) -> NDArray[np.float64]:
    """``|S + C - 1|`` relative to the largest of the three."""
    shift = np.maximum(np.maximum(s_exp, c_exp), 0)
    one = np.ldexp(1.0, -np.minimum(shift, 2000))
    left, right = s * np.exp2((s_exp - shift).astype(float)), c * np.exp2((c_exp - shift).astype(float))
    return np.abs(left + right - one) / np.maximum(np.maximum(np.abs(left), np.abs(right)), one)


def _refuse(defect: NDArray[np.float64], a: Any, q: Any) -> None:
    """Raise where the Wronskian identity is violated."""
    if np.all(defect <= _DEFECT):
        return
    worst = int(np.argmax(np.where(np.isfinite(defect), defect, np.inf)))
    raise ConvergenceError(
        f"the exponent at a = {a[worst]}, q = {q[worst]} cannot be computed in double precision: its Wronskian is "
        f"wrong by {defect[worst]:.1e}; take smaller complex arguments",
        a=a[worst],
        q=q[worst],
        defect=float(defect[worst]),
    )


def _unfolded(a: NDArray[np.float64], q: NDArray[np.float64], rows: int) -> NDArray[np.complex128]:
    """Real arguments: the convention of the module."""
    result, sensitivity, defect = _assemble(half_period_factors(a, q, rows))
    # what roundings of the size of the largest entries of the matrix that matter do to nu
    error = 4.0 * _EPS * np.maximum(np.maximum(np.abs(a), np.abs(q)), 1.0) * sensitivity
    again = np.flatnonzero(~((error <= _GOAL) & (defect <= _GOAL)))
    if again.size:
        precise = half_period_factors(a[again], q[again], rows, precise=True)
        result[again], _, defect[again] = _assemble(precise)
    _refuse(defect, a, q)
    return result


def _assemble(factors: Factors) -> tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.float64]]:
    """nu, ``|d nu / d a|`` and the defect of the identity, from the factors."""
    s, s_exp, c, c_exp = _sines(factors)
    below = factors.below.sum(axis=0)
    order, band = below // 2, below % 2 == 1
    odd = order % 2 == 1
    # the one of the two that vanishes at the lower edge of the band, or that is negative in the tongue
    near, near_exp = np.where(odd, c, s), np.where(odd, c_exp, s_exp)
    far, far_exp = np.where(odd, s, c), np.where(odd, s_exp, c_exp)
    huge = near_exp > 900
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = np.sqrt(np.abs(near)) * np.exp2(0.5 * np.minimum(near_exp, 1000))
        other = np.sqrt(np.abs(far)) * np.exp2(0.5 * np.minimum(far_exp, 1000))
        growth = np.where(huge, 0.5 * np.log(4.0 * np.abs(near)) + 0.5 * _LOG2 * near_exp, np.arcsinh(root))
        slope = factors.slope
        log_slope = np.where(odd, slope[2] + slope[3], slope[0] + slope[1])
        sensitivity = np.abs(log_slope) * np.where(huge, 1.0, root / other) / np.pi
    scale = 2.0 / np.pi
    nu = np.where(band, order + scale * np.arctan2(root, other), order + 1j * scale * growth)
    return nu, sensitivity, _defect(s, s_exp, c, c_exp)


def _principal(a: NDArray[np.complex128], q: NDArray[np.complex128], rows: int) -> NDArray[np.complex128]:
    """Complex arguments: ``nu = (2/pi) arcsin sqrt S``, or from C where that is the smaller one."""
    s, s_exp, c, c_exp = _sines(half_period_factors(a, q, rows))
    _refuse(_defect(s, s_exp, c, c_exp), a, q)
    huge = np.maximum(s_exp, c_exp) > 900
    with np.errstate(over="ignore", invalid="ignore"):
        sine = np.sqrt(s) * np.exp2(0.5 * np.where(huge, 0, s_exp))
        cosine = np.sqrt(c) * np.exp2(0.5 * np.where(huge, 0, c_exp))
        nu = np.where(np.abs(sine) <= np.abs(cosine), np.arcsin(sine), 0.5 * np.pi - np.arcsin(cosine)) * (2.0 / np.pi)
    # |S| beyond 2^900: sin w = (i/2) exp(-i w) for Im w > 0
    deep = 1j * (np.log(2.0 * np.sqrt(s) / 1j) + 0.5 * _LOG2 * s_exp) * (2.0 / np.pi)
    nu = np.where(huge, deep, nu)
    real = np.mod(nu.real, 2.0)  # +-nu + 2k: fold into 0 <= Re nu <= 1
    nu = np.where(real > 1.0, (2.0 - real) - 1j * nu.imag, real + 1j * nu.imag)
    on_edge = (nu.real == 0.0) | (nu.real == 1.0)
    return np.where(on_edge & (nu.imag < 0), nu.real - 1j * nu.imag, nu)


def mathieu_a_of_exponent(nu: ArrayLike, q: ArrayLike) -> Any:
    r"""The ``a`` of a given characteristic exponent: the inverse of `mathieu_exponent`.

    ``x'' + (a - 2 q cos 2z) x = 0`` with the solutions ``exp(+-i nu z)`` times a pi-periodic function.
    For real ``nu`` in ``[m, m + 1)`` this is eigenvalue number m of the two-sided tridiagonal matrix with diagonal
    ``(nu + 2k)^2`` and off-diagonal ``q`` (DLMF 28.12(i)), symmetric, counted from below.

    Parameters
    ----------
    nu : real, ``0 <= nu <= 500`` (negative values by symmetry), or ``i y`` with ``y >= 0`` (below ``a_0``). At an
    integer ``nu = m``
        the value is the limit from above, ``a_m(|q|)``. Complex ``nu = m + i y`` inside a tongue ``m >= 1`` belongs
        to two values of ``a`` or to none, and is refused.
    q : real, ``|q| <= 1e6``.

    Returns
    -------
    float, or an array of the broadcast shape.

    Raises
    ------
    InputError
        As above.

    Notes
    -----
    *Accuracy*: a few roundings of ``max(|a|, |q|, nu^2)``, as `mathieu_a`.

    Examples
    --------
    >>> import stability as st
    >>> a = st.mathieu_a_of_exponent(2.4, 3.0)
    >>> abs(st.mathieu_exponent(a, 3.0) - 2.4) < 1e-14
    True
    """
    exponent = check_numbers("nu", nu, _MAX_NU)
    strength = check_numbers("q", q, MAX_Q)
    if strength.dtype.kind == "c":
        raise InputError("complex q has no ordered spectrum; mathieu_a_of_exponent takes a real q")
    exponent, strength = np.broadcast_arrays(exponent, strength)
    real, imaginary = np.abs(exponent.real).ravel(), np.abs(exponent.imag).ravel()
    if np.any((imaginary > 0) & (real > 0)):
        bad = exponent.ravel()[np.argmax((imaginary > 0) & (real > 0))]
        raise InputError(
            f"nu = {bad} lies inside a tongue (two values of a, or none) or off the real spectrum; "
            "give a real nu, or i*y with y >= 0"
        )
    flat, result = np.abs(strength).ravel(), np.empty(real.size)
    growing = imaginary > 0
    result[~growing] = _from_real(real[~growing], flat[~growing])
    if np.any(growing):
        result[growing] = _below_first_edge(imaginary[growing], flat[growing])
    return result.reshape(exponent.shape) if exponent.ndim else float(result[0])


def _from_real(nu: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Counted eigenvalues of the two-sided matrix, in blocks of like size."""
    result = nu * nu
    index = np.floor(nu).astype(np.int64)
    square = nu * nu
    rows = rows_needed(square + 2.0 * q, q)
    sizes = np.ceil(12.0 * 1.25 ** np.ceil(np.log(rows / 12.0) / np.log(1.25))).astype(np.int64)
    for size in np.unique(sizes):
        members = np.flatnonzero((sizes == size) & (q >= NO_COUPLING))
        step = max(600, 100_000 // int(2 * size + 1))
        for start in range(0, members.size, step):
            block = members[start : start + step]
            fraction = nu[block] - 2.0 * np.round(0.5 * nu[block])
            k = 2.0 * np.arange(-size, size + 1)[:, None]
            squares = np.broadcast_to(q[block] ** 2, (2 * size, block.size))
            margin = 1.0 + 1e-12 * (square[block] + q[block])
            # unfolded exponents of one matrix lie in [m, m + 1]: Weyl's bound for the free value (m or m + 1)^2
            lower = index[block] ** 2.0 - 2.0 * q[block] - margin
            upper = (index[block] + 1.0) ** 2 + 2.0 * q[block] + margin
            scale = np.maximum(np.maximum(q[block], square[block]), 1e-280)
            result[block] = indexed_eigenvalues((fraction + k) ** 2, squares, index[block], lower, upper, scale)
    return result


def _below_first_edge(growth: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """``a < a_0(q)`` with growth rate ``y``: Im nu falls monotonically in a, so bisection, then Newton's secant."""
    upper = np.asarray(mathieu_a(0, q), dtype=float).reshape(q.shape).copy()
    lower = upper - growth**2 - 4.0 * np.sqrt(q) * growth - 1.0
    for _ in range(200):
        wrong = mathieu_exponent(lower, q).imag < growth
        if not np.any(wrong):
            break
        lower = np.where(wrong, 2.0 * lower - upper, lower)
    for _ in range(64):
        middle = 0.5 * (lower + upper)
        high = mathieu_exponent(middle, q).imag < growth
        lower, upper = np.where(high, lower, middle), np.where(high, middle, upper)
        if np.all(upper - lower <= 2.0 * _EPS * np.maximum(np.abs(upper), q)):
            break
    return 0.5 * (lower + upper)
