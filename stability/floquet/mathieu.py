r"""Characteristic values of Mathieu's equation: the edges of the undamped instability tongues.

    x'' + (a - 2 q cos 2z) x = 0        (DLMF 28.2.1)

has a solution of period pi or 2 pi for the characteristic values ``a = a_n(q)`` (even solutions ``ce_n``) and
``b_n(q)`` (odd solutions ``se_n``). With ``x = sum A_k cos kz`` or ``sum B_k sin kz`` they are the eigenvalues of
four symmetric tridiagonal matrices with diagonal ``k^2`` and off-diagonal ``q`` (DLMF 28.4.5-8):

    a_0, a_2, ...   k = 0, 2, 4, ...   first off-diagonal sqrt(2) q
    b_2, b_4, ...   k = 2, 4, 6, ...
    a_1, a_3, ...   k = 1, 3, 5, ...   first diagonal 1 + q
    b_1, b_3, ...   k = 1, 3, 5, ...   first diagonal 1 - q

For ``q > 0``: ``a_0 < b_1 < a_1 < b_2 < a_2 < ...``; tongue ``n`` lies between ``b_n`` and ``a_n``. A negative ``q``
is a shift of ``z`` by pi/2: ``a_2n(-q) = a_2n(q)``, ``a_2n+1(-q) = b_2n+1(q)``, ``b_2n+2(-q) = b_2n+2(q)``; the
matrices know it. The order is counted by Sturm sequences (`stability.kernels.tridiagonal`), it cannot jump as root
searches on the continued fraction do. Complex ``q`` is the matter of `stability.floquet.complex_mathieu`.

Reference: DLMF chapter 28; J. Meixner, F. W. Schaefke, Mathieusche Funktionen und Sphaeroidfunktionen (1954).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..kernels.tridiagonal import indexed_eigenvalues

__all__ = ["MAX_ORDER", "MAX_Q", "mathieu_a", "mathieu_b"]

MAX_ORDER = 499
MAX_Q = 1e6
NO_COUPLING = 1e-140
_BLOCK, _LEAST = 100_000, 600  # numbers (rows times points) in a block of matrices, but at least so many points


def mathieu_a(n: ArrayLike, q: ArrayLike) -> Any:
    r"""Characteristic value ``a_n(q)`` of the even Mathieu function ``ce_n`` in ``x'' + (a - 2 q cos 2z) x = 0``.

    Parameters
    ----------
    n : int, 0 <= n < 500 (broadcasts with `q`).
    q : real with ``|q| <= 1e6``, or complex with ``|q| <= 500`` (continued from ``q = 0`` along the straight ray; on
    the
        imaginary axis, which holds double points, from the side ``Re q > 0``: see `stability.floquet.complex_mathieu`).

    Returns
    -------
    float (complex for complex `q`), or an array of the broadcast shape.

    Raises
    ------
    InputError
        An order that is no integer or out of range, a `q` that is not finite or too large.
    ConvergenceError
        Complex `q` only: the eigenvalue is too ill-conditioned for double precision, or the ray meets a double point.

    Notes
    -----
    *Accuracy*: error below ``2e-15 max(|a|, |q|, n^2)``, checked against 30-digit values for n <= 60, |q| <= 1e4,
    and at scattered orders up to 499 with q up to 1e6. References: DLMF 28.2(v), 28.4.

    Examples
    --------
    >>> import stability as st
    >>> print(round(st.mathieu_a(5, 21.0), 10), st.mathieu_a(2, 0.0))
    37.462613226 4.0
    """
    return _characteristic_values(n, q, odd=False)


def mathieu_b(n: ArrayLike, q: ArrayLike) -> Any:
    r"""Characteristic value ``b_n(q)`` of the odd Mathieu function ``se_n`` in ``x'' + (a - 2 q cos 2z) x = 0``.

    Parameters
    ----------
    n : int, 1 <= n < 500 (broadcasts with `q`); there is no ``b_0``.
    q : as in `mathieu_a`.

    Returns
    -------
    float (complex for complex `q`), or an array of the broadcast shape.

    Raises
    ------
    InputError, ConvergenceError
        As `mathieu_a`.

    Notes
    -----
    *Accuracy* and references as in `mathieu_a`.

    Examples
    --------
    >>> import stability as st
    >>> print(round(st.mathieu_b(1, 0.5), 12), st.mathieu_b(1, -0.5) == st.mathieu_a(1, 0.5))
    0.470654354934 True
    """
    return _characteristic_values(n, q, odd=True)


def check_orders(n: ArrayLike, odd: bool) -> NDArray[np.int64]:
    """`n` as integers, or an InputError that says what is allowed."""
    name, lowest = ("b_n", 1) if odd else ("a_n", 0)
    given = np.asarray(n)
    if given.dtype.kind not in "iuf" or given.size == 0:
        raise InputError(f"order n = {n!r} of {name} is no integer; use {lowest} <= n <= {MAX_ORDER}")
    bad = ~np.isfinite(given) | (given != np.round(given)) if given.dtype.kind == "f" else np.zeros(given.shape, bool)
    if np.any(bad):
        raise InputError(
            f"order n = {given[bad].flat[0]} of {name} is no integer; for real orders use mathieu_a_of_exponent"
        )
    bad = (given < lowest) | (given > MAX_ORDER)
    if np.any(bad):
        hint = "; there is no b_0" if odd and np.any(given == 0) else ""
        raise InputError(f"order n = {given[bad].flat[0]} of {name} is out of range {lowest}..{MAX_ORDER}{hint}")
    return given.astype(np.int64)


def check_numbers(what: str, value: ArrayLike, largest: float) -> NDArray[Any]:
    """`value` as a float or complex array with finite members of modulus <= `largest`, or an InputError."""
    array = np.asarray(value)
    if array.dtype.kind not in "iufc" or array.size == 0:
        raise InputError(f"{what} = {value!r} is no number; give a number or an array of numbers")
    array = array.astype(complex if array.dtype.kind == "c" else float)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{what} holds NaN or infinity; it must be finite with |{what}| <= {largest:g}")
    if np.any(np.abs(array) > largest):
        worst = array.flat[np.argmax(np.abs(array))]
        raise InputError(f"{what} = {worst} is too large; |{what}| <= {largest:g} is allowed")
    return array


def _characteristic_values(n: ArrayLike, q: ArrayLike, odd: bool) -> Any:
    order = check_orders(n, odd)
    coupling = check_numbers("q", q, MAX_Q)
    if coupling.dtype.kind == "c":
        from .complex_mathieu import continued_values  # the rarer, slower road

        values: NDArray[Any] = continued_values(order, coupling, odd)
    else:
        order, coupling = np.broadcast_arrays(order, coupling)
        values = real_values(order.ravel(), coupling.ravel(), odd).reshape(order.shape)
    return values if values.ndim else values.item()


def rows_needed(highest: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.int64]:
    """Rows after which the eigenvectors have died out, for eigenvalues below `highest`.

    The coefficients turn from waves to decay at ``k^2 = a + 2|q|``, there over a length of Airy type
    ``(2|q|/k)^(1/3)``.
    """
    turning = np.sqrt(np.maximum(highest + 2.0 * np.abs(q), 1.0))
    reach = turning + 10.0 * np.cbrt(2.0 * np.abs(q) / turning) + 18.0
    return np.asarray(np.ceil(0.5 * reach), dtype=np.int64) + 1


def bracket(order: NDArray[np.int64], q: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bounds of a_n(q) and b_n(q) by Weyl's inequality, ``|a - n^2| <= 2|q|``."""
    strength = np.abs(q)
    square = order.astype(float) ** 2
    margin = 1.0 + 1e-12 * (square + strength)
    return square - 2.0 * strength - margin, square + 2.0 * strength + margin


def real_values(order: NDArray[np.int64], q: NDArray[np.float64], odd: bool) -> NDArray[np.float64]:
    """a_n(q) or b_n(q) for flat arrays, in blocks of matrices of like size."""
    lower, upper = bracket(order, q)
    rows = rows_needed(upper, q)
    result = order.astype(float) ** 2
    turn = np.argsort(rows, kind="stable")
    turn = turn[np.abs(q[turn]) >= NO_COUPLING]  # below, q changes nothing and its square is no longer a number
    start = 0
    while start < turn.size:
        size = int(rows[turn[start]])
        stop = start + 1
        while stop < turn.size and rows[turn[stop]] <= 1.25 * size + 4 and stop - start < max(_BLOCK // size, _LEAST):
            stop += 1
        block = turn[start:stop]
        n, strength = order[block], q[block]
        diagonal, squares, index = family(n, strength, odd, int(rows[block].max()))
        scale = np.maximum(np.maximum(np.abs(strength), n.astype(float) ** 2), 1e-280)
        result[block] = indexed_eigenvalues(diagonal, squares, index, lower[block], upper[block], scale)
        start = stop
    return result


def family(
    order: NDArray[np.int64], q: NDArray[Any], odd: bool, rows: int
) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.int64]]:
    """Diagonal (rows, P), squared off-diagonal (rows - 1, P) and index (P,) of the matrices that hold a_n or b_n."""
    parity = order % 2
    first = np.where(parity == 1, 1, 2 if odd else 0)
    k = first + 2.0 * np.arange(rows)[:, None]
    diagonal = (k * k).astype(q.dtype)
    diagonal[0] += np.where(parity == 1, -q if odd else q, 0.0)
    squares = np.broadcast_to(q * q, (rows - 1, q.size)).copy()
    if not odd:
        squares[0] = np.where(parity == 0, 2.0 * squares[0], squares[0])
    return diagonal, squares, (order - first) // 2
