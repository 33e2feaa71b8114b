r"""The four half-period factors of Mathieu's equation as infinite tridiagonal determinants, with the tail summed.

For ``x'' + (a - 2 q cos 2z) x = 0`` let ``u1, u2`` be the solutions with ``u1 = u2' = 1``, ``u1' = u2 = 0`` at ``z =
0`` and ``h = pi/2``. The numbers ``u1'(h)``, ``u2(h)``, ``u1(h)``, ``u2'(h)`` are entire functions of ``a`` (order
1/2) with the zeros ``a_2n``, ``b_2n+2``, ``a_2n+1``, ``b_2n+1``, hence (Hadamard) equal to the tridiagonal
determinants of those families divided by the diagonal ``D_j`` of ``q = 0``:

    u1' = (pi/2) P_ae,   u2 = (pi/2) P_be,   u1 = P_ao,   u2' = P_bo,
    p_{j+1} = (1 - a/D_j) p_j - q^2/(D_j D_{j-1}) p_{j-1},        P = lim p_j        (D_0 -> 1 for ae).

Three facts make this accurate. (1) The recursion is the one of Sturm sequences: its zeros are those of a matrix
changed by roundings, so that each factor has the relative accuracy that its own zero allows, and sign changes count
the zeros below ``a``. In pairs of doubles (`double_double`) the zeros are right to 30 digits. (2) No quotient is
formed: rows are scaled by powers of two, the product of the ``D_j`` is taken in exact integers. (3) The truncation
error of the product falls only like 1/j. The ratio ``r(t) = p_{j+1}/p_j``, ``t = sqrt(D_j)/2``, has an expansion in
``1/t``, so the tail ``sum_{i>=0} log r(t0 + i)`` is summed by a quadrature rule that is exact for ``sum_i f(t0 +
i)`` when ``f(t) = phi(t) - phi(t + 1)``, ``phi = (t0/t)^j``, ``j = 1..18``; at its nodes ``t >= t0``, no integers in
general, ``r(t) = 1 - a/(4 t^2) - q^2/(16 t^2 (t-1)^2 r(t-1))`` is run from seven steps back, which contracts.

References: DLMF 28.4, 28.29; E. T. Whittaker, G. N. Watson, Modern Analysis, section 19.42 (Hill's determinant).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .double_double import add, exact_product, exact_sum, multiply

__all__ = ["FAMILIES", "Factors", "half_period_factors", "rows_for"]

FAMILIES = ("ae", "be", "ao", "bo")
_FIRST = np.array([0, 2, 1, 1])  # first wave number of each family
_NODES = 18
_BACK = 7
_RESCALE = 8


@dataclass(frozen=True)
class Factors:
    """P_ae, P_be, P_ao, P_bo as ``mantissa * 2**exponent``; all arrays (4, P).

    `slope` is ``d log P / d a`` of the finite product (its tail is small and smooth), `below` the number of zeros
    below ``a`` (for real arguments).
    """

    mantissa: NDArray[Any]
    exponent: NDArray[np.int64]
    slope: NDArray[Any]
    below: NDArray[np.int64]


def rows_for(a: NDArray[Any], q: NDArray[Any]) -> NDArray[np.int64]:
    """Rows before the tail: four times the turning points of ``a`` and of ``q``, in steps of a quarter."""
    rows = np.maximum(24.0, 2.1 * np.sqrt(np.maximum(np.abs(a), np.abs(q))))
    return np.asarray(np.ceil(24.0 * 1.25 ** np.ceil(np.log(rows / 24.0) / np.log(1.25) - 1e-9)), dtype=np.int64)


def half_period_factors(a: NDArray[Any], q: NDArray[Any], rows: int, precise: bool = False) -> Factors:
    """The four factors at P points.

    Parameters
    ----------
    a, q : (P,) float or complex.
    rows : steps of the recursion, at least `rows_for(a, q)`.
    precise : run the recursion in pairs of doubles (real arguments only): the zeros are then right to 30 digits.
    """
    wave = _FIRST[:, None] + 2 * np.arange(rows)  # (4, rows)
    diagonal = (wave * wave).astype(float)
    powers = np.exp2(np.round(np.log2(np.maximum(diagonal, 1.0))))
    run = _minors_precise if precise else _minors
    mantissa, exponent, slope, below = run(a, q, diagonal, powers)
    for family in range(4):
        factor, shift = _diagonal_product(family, rows)
        tail = _tail(a, q, rows + 0.5 * float(_FIRST[family]))
        mantissa[family] *= factor * np.exp(tail)
        exponent[family] += shift
    return Factors(mantissa, exponent, slope, below)


def _couplings(family_powers: NDArray[np.float64], j: int) -> NDArray[np.float64]:
    """Exact powers of two (times 2 in the second row of ae) that scale ``q^2`` in row `j`, shape (4, 1)."""
    scale = 1.0 / (family_powers[:, j] * family_powers[:, j - 1])
    if j == 1:
        scale = scale * np.array([2.0, 1.0, 1.0, 1.0])
    return scale[:, None]


def _minors(a: Any, q: Any, diagonal: Any, powers: Any) -> tuple[Any, Any, Any, Any]:
    """Scaled leading minors by the recursion in doubles (or complex doubles)."""
    kind = np.result_type(a, q, float)
    square = q * q
    edge = np.stack([np.zeros_like(q), np.zeros_like(q), q, -q])
    now = ((diagonal[:, :1] - a) + edge) / powers[:, :1]
    before, slope_before = np.ones_like(now), np.zeros_like(now)
    slope = np.broadcast_to(-1.0 / powers[:, :1], now.shape).astype(kind)
    exponent = np.zeros(now.shape, dtype=np.int64)
    below = (now.real < 0).astype(np.int64)
    for j in range(1, diagonal.shape[1]):
        factor = (diagonal[:, j : j + 1] - a) / powers[:, j : j + 1]
        weight = square * _couplings(powers, j)
        later = factor * now - weight * before
        slope, slope_before = factor * slope - now / powers[:, j : j + 1] - weight * slope_before, slope
        now, before = later, now
        below += (now.real < 0) != (before.real < 0)
        if j % _RESCALE == 0:
            _, shift = np.frexp(np.maximum(np.abs(now), np.abs(before)))
            unit = np.ldexp(1.0, -shift)
            now, before, slope, slope_before = now * unit, before * unit, slope * unit, slope_before * unit
            exponent += shift
    with np.errstate(divide="ignore", invalid="ignore"):
        return now, exponent, slope / now, below


def _minors_precise(a: Any, q: Any, diagonal: Any, powers: Any) -> tuple[Any, Any, Any, Any]:
    """The recursion of `_minors` in pairs of doubles; real arguments, no slope."""
    square = exact_product(q, q)
    edge = np.stack([np.zeros_like(q), np.zeros_like(q), q, -q])
    now = exact_sum(diagonal[:, :1] - np.zeros_like(a), -np.broadcast_to(a, (4, a.size)))
    now = add(now, (edge, np.zeros_like(edge)))
    now = (now[0] / powers[:, :1], now[1] / powers[:, :1])
    before = (np.ones_like(now[0]), np.zeros_like(now[0]))
    exponent = np.zeros(now[0].shape, dtype=np.int64)
    below = (now[0] < 0).astype(np.int64)
    for j in range(1, diagonal.shape[1]):
        high, low = exact_sum(diagonal[:, j : j + 1], -a)
        factor = high / powers[:, j : j + 1], low / powers[:, j : j + 1]
        scale = -_couplings(powers, j)
        weight = square[0] * scale, square[1] * scale
        now, before = add(multiply(factor, now), multiply(weight, before)), now
        below += (now[0] < 0) != (before[0] < 0)
        if j % _RESCALE == 0:
            _, shift = np.frexp(np.maximum(np.abs(now[0]), np.abs(before[0])))
            unit = np.ldexp(1.0, -shift)
            now, before = (now[0] * unit, now[1] * unit), (before[0] * unit, before[1] * unit)
            exponent += shift
    return now[0] + now[1], exponent, np.full(now[0].shape, np.nan), below


@lru_cache(maxsize=256)
def _diagonal_product(family: int, rows: int) -> tuple[float, int]:
    """``prod 2**e_j / D_j`` (with ``D_0 = 1`` for ae) as mantissa and exponent, from exact integers."""
    product, shift = 1, 0
    for j in range(rows):
        wave = int(_FIRST[family]) + 2 * j
        if wave:
            product *= wave * wave
            shift += round(float(np.log2(wave * wave)))
    bits = product.bit_length()
    kept = 100
    top = product >> (bits - kept) if bits > kept else product << (kept - bits)
    return float(1.0 / (top / 2.0**kept)), shift - bits


@lru_cache(maxsize=256)
def _tail_rule(t0: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes ``t >= t0`` and weights with ``sum_i w_i f(t_i) = sum_{k >= 0} f(t0 + k)`` for the f of the module text."""
    position, _ = np.polynomial.legendre.leggauss(_NODES)
    x = 0.5 * (position + 1.0)
    y = x / (1.0 + x / t0)
    gap = x * x / (t0 + x)  # x - y without cancellation
    columns = [np.ones_like(x)]
    for j in range(1, _NODES):
        columns.append(columns[-1] * x + y**j)  # (x^(j+1) - y^(j+1)) / (x - y)
    weights = np.linalg.solve(np.array(columns), np.ones(_NODES)) / gap
    return t0 / x, weights


def _tail(a: Any, q: Any, t0: float) -> Any:
    """``sum_{k >= 0} log r(t0 + k)``, shape (P,)."""
    nodes, weights = _tail_rule(t0)
    quarter, strength = 0.25 * a, 0.0625 * (q * q)
    change = np.zeros((nodes.size, a.size), dtype=np.result_type(a, q, float))  # r - 1: far nodes keep their digits
    for back in range(_BACK, -1, -1):
        t = (nodes - back)[:, None]
        change = -quarter / (t * t) - strength / ((t * (t - 1.0)) ** 2 * (1.0 + change))
    return weights @ _log1p(change)


def _log1p(x: Any) -> Any:
    """``log(1 + x)`` with relative accuracy for small x; numpy's own loses it for complex arguments."""
    if x.dtype.kind != "c":
        return np.log1p(x)
    return 0.5 * np.log1p(2.0 * x.real + x.real**2 + x.imag**2) + 1j * np.arctan2(x.imag, 1.0 + x.real)
