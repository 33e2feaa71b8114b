r"""Numbers of twice the working precision as unevaluated sums ``high + low`` of two doubles, on whole arrays.

``|low| <= ulp(high)/2``, so that a pair carries about 32 digits. Only what the three-term recursions of Hill's
determinant need: exact sum and exact product of two doubles, and sum, product and scaling by a double of pairs. No
fused multiply-add is assumed (Dekker's splitting); a factor above 1e290 would overflow in the splitting, callers
scale by powers of two.

References: T. J. Dekker, Numer. Math. 18 (1971) 224-242; D. E. Knuth, The Art of Computer Programming 2, section 4.2.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Pair", "add", "exact_product", "exact_sum", "multiply"]

Array = NDArray[np.float64]
Pair = tuple[Array, Array]

_SPLITTER = 134217729.0  # 2^27 + 1


def exact_sum(x: Array, y: Array) -> Pair:
    """``x + y`` without error (Knuth).

    >>> high, low = exact_sum(np.array(1.0), np.array(1e-20))
    >>> float(high), float(low)
    (1.0, 1e-20)
    """
    total = x + y
    shadow = total - x
    return total, (x - (total - shadow)) + (y - shadow)


def exact_product(x: Array, y: Array) -> Pair:
    """``x y`` without error (Dekker), barring overflow and underflow.

    >>> high, low = exact_product(np.array(0.1), np.array(0.1))
    >>> float(low) != 0.0
    True
    """
    product = x * y
    big = _SPLITTER * x
    x_high = big - (big - x)
    x_low = x - x_high
    big = _SPLITTER * y
    y_high = big - (big - y)
    y_low = y - y_high
    return product, ((x_high * y_high - product) + x_high * y_low + x_low * y_high) + x_low * y_low


def add(x: Pair, y: Pair) -> Pair:
    """Sum of two pairs; relative error about 2^-104 also under cancellation (accurate variant)."""
    high, low = exact_sum(x[0], y[0])
    more, rest = exact_sum(x[1], y[1])
    high, low = _renormalised(high, low + more)
    return _renormalised(high, low + rest)


def multiply(x: Pair, y: Pair) -> Pair:
    """Product of two pairs; relative error about 2^-102."""
    high, low = exact_product(x[0], y[0])
    return _renormalised(high, low + (x[0] * y[1] + x[1] * y[0]))


def _renormalised(high: Array, low: Array) -> Pair:
    total = high + low
    return total, low - (total - high)
