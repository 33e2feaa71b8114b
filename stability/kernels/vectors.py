"""Sums of rows, four neighbouring entries at a time.

numba turns loops over arrays into vector instructions only behind tests that no two of the arrays overlap, which cost
more than the few entries of a small system's state. Here a sum stays in a register until it is complete:

    K[out, e : e + 4] = K[start, e : e + 4] + h sum_{j < count} weights[r, j] K[places[r, j], e : e + 4]   (or 16)
    K[i, start : start + c] = factor sum_{j < count} J[a, used[j]] V[used[j], 0 : c]
    T[i, k, :] -= T[i, p, :] T[p, k, :],    eight matrices at a time

Arrays are float64 (places int64) and C-contiguous; the caller sees to it that the entries exist. Four at a time, as
they are written: a processor hands on what is still being written only to a read that lies within one write.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["LANES", "combine_four", "combine_sixteen", "product", "subtract_lanes"]

_INTEGER = ir.IntType(64)
_FOUR = ir.VectorType(ir.DoubleType(), 4)
LANES = 8  # `subtract_lanes` works on a multiple of so many matrices
_EIGHT = ir.VectorType(ir.DoubleType(), LANES)
_FUSED = ("contract",)  # a product and a sum may be one instruction where the processor has it


class _Rows:
    """A two-dimensional array of a kernel."""

    def __init__(self, context: Any, builder: Any, array_type: Any, value: Any) -> None:
        array = context.make_array(array_type)(context, builder, value=value)
        self.builder, self.data = builder, array.data
        self.height, self.width = cgutils.unpack_tuple(builder, array.shape, 2)

    def entry(self, row: Any, column: Any) -> Any:
        """Pointer to an entry."""
        return self.builder.gep(self.data, [self.builder.add(self.builder.mul(row, self.width), column)])

    def four(self, row: Any, column: Any) -> Any:
        """Pointer to four of them."""
        return self.builder.bitcast(self.entry(row, column), _FOUR.as_pointer())


def _all(builder: Any, number: Any) -> Any:
    """A vector of one number."""
    empty, integer = ir.Constant(_FOUR, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(empty, number, ir.Constant(integer, 0))
    return builder.shuffle_vector(first, empty, ir.Constant(ir.VectorType(integer, 4), [0] * 4))


def _sums(builder: Any, count: Any, blocks: int, term: Callable[[Any], tuple[Any, list[Any]]]) -> list[Any]:
    """sum_{j < count} weight_j row_j, some blocks of four, with term(j) = pointers to the weight and to the blocks."""
    totals = [cgutils.alloca_once_value(builder, ir.Constant(_FOUR, [0.0] * 4)) for _ in range(blocks)]
    with cgutils.for_range(builder, count, intp=_INTEGER) as loop:
        weight, rows = term(loop.index)
        weight = _all(builder, builder.load(weight))
        for row, total in zip(rows, totals):
            product = builder.fmul(weight, builder.load(row, align=8), flags=_FUSED)
            builder.store(builder.fadd(builder.load(total), product, flags=_FUSED), total)
    return [builder.load(total) for total in totals]


def _combination(blocks: int) -> Any:
    @intrinsic
    def combination(typingctx, K, out, start, e, h, places, weights, r, count):  # type: ignore[no-untyped-def]
        """K[out, e :] = K[start, e :] + h sum_{j < count} weights[r, j] K[places[r, j], e :], some blocks of four."""
        integer = types.int64
        signature = types.void(K, integer, integer, integer, types.float64, places, weights, integer, integer)

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            _, out, start, e, h, _, _, r, count = args
            rows, where, what = (_Rows(context, builder, sig.args[k], args[k]) for k in (0, 5, 6))
            at = [builder.add(e, ir.Constant(_INTEGER, 4 * k)) for k in range(blocks)]

            def term(j: Any) -> tuple[Any, list[Any]]:
                row = builder.load(where.entry(r, j))
                return what.entry(r, j), [rows.four(row, place) for place in at]

            for place, total in zip(at, _sums(builder, count, blocks, term)):
                step = builder.fmul(_all(builder, h), total, flags=_FUSED)
                ending = builder.fadd(builder.load(rows.four(start, place), align=8), step, flags=_FUSED)
                builder.store(ending, rows.four(out, place), align=8)
            return context.get_dummy_value()

        return signature, codegen

    return combination


combine_four, combine_sixteen = _combination(1), _combination(4)


@intrinsic
def product(typingctx, K, i, start, factor, J, a, used, count, V):  # type: ignore[no-untyped-def]
    """``K[i, start : start + c] = factor sum_{j < count} J[a, used[j]] V[used[j]]`` for V (n, c).

    Up to three entries behind these are overwritten, too.
    """
    integer = types.int64
    signature = types.void(K, integer, integer, types.float64, J, integer, used, integer, V)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        _, i, start, factor, _, a, _, count, _ = args
        rows, J, V = (_Rows(context, builder, sig.args[k], args[k]) for k in (0, 4, 8))
        used = context.make_array(sig.args[6])(context, builder, value=args[6]).data
        zero, step = ir.Constant(_INTEGER, 0), ir.Constant(_INTEGER, 4)
        with cgutils.for_range_slice(builder, zero, V.width, step, intp=_INTEGER) as (k, _):

            def term(j: Any) -> tuple[Any, Any]:
                b = builder.load(builder.gep(used, [j]))
                return J.entry(a, b), [V.four(b, k)]

            result = builder.fmul(_all(builder, factor), _sums(builder, count, 1, term)[0])
            builder.store(result, rows.four(i, builder.add(start, k)), align=8)
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def subtract_lanes(typingctx, T, i, p, first, last, count):  # type: ignore[no-untyped-def]
    """``T[i, k, :count] -= T[i, p, :count] * T[p, k, :count]`` for first <= k < last, count a multiple of LANES.

    Product and difference are rounded one after the other: all lanes like a single matrix in plain Python.
    """
    integer = types.int64
    signature = types.void(T, integer, integer, integer, integer, integer)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        array = context.make_array(sig.args[0])(context, builder, value=args[0])
        _, columns, depth = cgutils.unpack_tuple(builder, array.shape, 3)
        _, i, p, first, last, count = args
        zero, one, step = (ir.Constant(_INTEGER, value) for value in (0, 1, LANES))
        with cgutils.for_range_slice(builder, zero, count, step, intp=_INTEGER) as (q, _):

            def lanes(row: Any, column: Any) -> Any:
                place = builder.mul(builder.add(builder.mul(row, columns), column), depth)
                return builder.bitcast(builder.gep(array.data, [builder.add(place, q)]), _EIGHT.as_pointer())

            factor = builder.load(lanes(i, p), align=8)
            with cgutils.for_range_slice(builder, first, last, one, intp=_INTEGER) as (k, _):
                product = builder.fmul(factor, builder.load(lanes(p, k), align=8))
                place = lanes(i, k)
                builder.store(builder.fsub(builder.load(place, align=8), product), place, align=8)
        return context.get_dummy_value()

    return signature, codegen
