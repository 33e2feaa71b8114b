"""Elimination with row interchanges: of one small matrix, and of many at once.

    T = [A | B]   ->   [L\\U | A^-1 B]

Right-looking; the multipliers stay below the diagonal and move with the row interchanges (LAPACK's convention).
Matrices of a few rows are all loop overhead one by one; *lanes* T[:, :, q], q innermost, are eliminated together, each
operation for all of them, in the processor's vector registers: `wide` of them, a multiple of eight, of which the first
`lanes` are asked for. Lanes interchange rows where a pivot of any is ten times smaller than the largest of its column
(threshold pivoting). Their zeros outside of an envelope, row i from begin[i] to end[i], are left out: chains leave a
band, and states that are not coupled leave blocks.
References: G. H. Golub, C. F. Van Loan (2013), Matrix Computations, 4th edition, sections 3.2 and 3.4; A. George,
J. W. Liu (1981), Computer Solution of Large Sparse Positive Definite Systems, chapter 4 (envelopes).
"""

from __future__ import annotations

import numpy as np

from stability.kernels.caching import kernel
from stability.kernels.vectors import subtract_lanes

__all__ = ["back_substitute", "eliminate", "eliminate_lanes", "substitute_lanes"]


@kernel(inline=True)
def eliminate(T, rows, size, width, swaps):  # type: ignore[no-untyped-def]
    """LU with row interchanges of the first `size` columns of T[:rows], applied to all `width` columns.

    `swaps` (size,) receives the pivot rows. Returns the sign of the product of the pivots and interchanges, 0 where a
    pivot is zero or not finite.
    """
    sign = 1.0
    for p in range(size):
        best, row = abs(T[p, p]), p
        for i in range(p + 1, rows):
            value = abs(T[i, p])
            if value > best:
                best, row = value, i
        swaps[p] = row
        if not (best > 0.0 and best < np.inf):
            return 0.0
        if row != p:
            sign = -sign
            for k in range(width):
                T[p, k], T[row, k] = T[row, k], T[p, k]
        if T[p, p] < 0.0:
            sign = -sign
        inverse = 1.0 / T[p, p]
        for i in range(p + 1, rows):
            factor = T[i, p] * inverse
            T[i, p] = factor
            for k in range(p + 1, width):
                T[i, k] -= factor * T[p, k]
    return sign


@kernel(inline=True)
def back_substitute(T, size, width):  # type: ignore[no-untyped-def]
    """Solve with the upper triangle of T[:size, :size] for the columns size .. width, in place."""
    for p in range(size - 1, -1, -1):
        inverse = 1.0 / T[p, p]
        for k in range(size, width):
            T[p, k] *= inverse
        for i in range(p):
            factor = T[i, p]
            for k in range(size, width):
                T[i, k] -= factor * T[p, k]


@kernel(inline=True)
def _interchange(T, p, size, width, lanes, wide, swaps, hold, begin, end):  # type: ignore[no-untyped-def]
    """Bring an acceptable pivot to row p of every lane; sign of these and of the pivots, 0 for a bad one.

    A pivot is acceptable if none in its column is ten times larger: true of all lanes on a mesh that resolves the
    orbit. If one lane has none, every lane takes its largest.
    """
    for q in range(wide):
        hold[q] = 0.0
        swaps[p, q] = p
    for i in range(p + 1, size):
        if begin[i] <= p:
            for q in range(wide):
                hold[q] = max(hold[q], abs(T[i, p, q]))
    poor = False
    for q in range(wide):
        if not 0.1 * hold[q] <= abs(T[p, p, q]):
            poor = True
    sign = 1.0
    if poor:
        for q in range(wide):
            row = p
            for i in range(p + 1, size):
                if abs(T[i, p, q]) > abs(T[row, p, q]):
                    row = i
            swaps[p, q] = row
            if row != p:
                sign = -sign if q < lanes else sign
                for k in range(width):
                    T[p, k, q], T[row, k, q] = T[row, k, q], T[p, k, q]
                begin[row], end[p] = min(begin[row], begin[p]), max(end[row], end[p])
                end[row] = end[p]
    for q in range(wide):
        pivot = T[p, p, q]
        if not (abs(pivot) > 0.0 and abs(pivot) < np.inf):
            return 0.0
        if pivot < 0.0 and q < lanes:
            sign = -sign
        hold[q] = 1.0 / pivot
    return sign


@kernel(inline=True)
def eliminate_lanes(T, size, width, lanes, wide, swaps, hold, begin, end):  # type: ignore[no-untyped-def]
    """LU of T[:, :size, q] for every lane q, applied to all columns; the sign of the determinants asked for.

    Row i is zero before column begin[i] and from end[i] to `size`; what fills up is added to `end`.
    """
    sign = 1.0
    for p in range(size):
        sign *= _interchange(T, p, size, width, lanes, wide, swaps, hold, begin, end)
        if sign == 0.0:
            return 0.0
        for i in range(p + 1, size):
            if begin[i] <= p:
                for q in range(wide):
                    T[i, p, q] *= hold[q]
                end[i] = max(end[i], end[p])
                subtract_lanes(T, i, p, p + 1, end[p], wide)
                subtract_lanes(T, i, p, size, width, wide)
    return sign


@kernel(inline=True)
def substitute_lanes(T, size, width, wide, hold, end):  # type: ignore[no-untyped-def]
    """`back_substitute` of T[:, :, q] for every lane q; row i is zero from end[i] to `size`."""
    for p in range(size - 1, -1, -1):
        for q in range(wide):
            hold[q] = 1.0 / T[p, p, q]
        for k in range(size, width):
            for q in range(wide):
                T[p, k, q] *= hold[q]
        for i in range(p):
            if end[i] > p:
                subtract_lanes(T, i, p, size, width, wide)
