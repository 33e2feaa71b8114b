"""Sums of rows, four neighbouring entries at a time.

numba turns loops over arrays into vector instructions only behind tests that no two of the arrays overlap, which cost
more than the few entries of a small system's state. Here all operands are read before the result is written:

    K[out, e : e + 4] = K[start, e : e + 4] + sum_j w_j K[rows_j, e : e + 4]
    out[i, e : e + 4] = factor V[b, k : k + 4],    out[i, e : e + 4] += factor V[b, k : k + 4]

Arrays are float64 and C-contiguous; the caller sees to it that the entries exist. Four is what was written by the last
such sum: a processor hands on an entry that is still being written only to a read that fits into what was written.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["add_four", "combine_four", "set_four"]

_FOUR = ir.VectorType(ir.DoubleType(), 4)
_FUSED = ("contract",)  # a product and a sum may be one instruction where the processor has it


def _place(context: Any, builder: Any, array_type: Any, value: Any, at: list[Any]) -> Any:
    """Pointer to four entries from place `at` = [row, column] of an array."""
    array = context.make_array(array_type)(context, builder, value=value)
    columns = cgutils.unpack_tuple(builder, array.shape, 2)[1]
    place = builder.add(builder.mul(at[0], columns), at[1])
    return builder.bitcast(builder.gep(array.data, [place]), _FOUR.as_pointer())


def _all(builder: Any, number: Any) -> Any:
    """A vector of one number."""
    empty, integer = ir.Constant(_FOUR, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(empty, number, ir.Constant(integer, 0))
    return builder.shuffle_vector(first, empty, ir.Constant(ir.VectorType(integer, 4), [0] * 4))


def _sum(builder: Any, total: Any, weight: Any, row: Any) -> Any:
    """total + weight row."""
    return builder.fadd(total, builder.fmul(_all(builder, weight), row, flags=_FUSED), flags=_FUSED)


@intrinsic
def combine_four(typingctx, K, out, start, e, rows, weights):  # type: ignore[no-untyped-def]
    """``K[out, e : e + 4] = K[start, e : e + 4] + sum_j weights[j] K[rows[j], e : e + 4]``, for tuples of j."""
    integer, count = types.int64, len(rows)
    tuples = types.UniTuple(integer, count), types.UniTuple(types.float64, count)
    signature = types.void(K, integer, integer, integer, *tuples)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        def four(row: Any) -> Any:
            return _place(context, builder, sig.args[0], args[0], [row, args[3]])

        places, factors = (cgutils.unpack_tuple(builder, args[k], count) for k in (4, 5))
        total = builder.load(four(args[2]), align=8)
        for row, factor in zip(places, factors):
            total = _sum(builder, total, factor, builder.load(four(row), align=8))
        builder.store(total, four(args[1]), align=8)
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def add_four(typingctx, out, i, e, factor, V, b, k):  # type: ignore[no-untyped-def]
    """``out[i, e : e + 4] += factor V[b, k : k + 4]``."""
    signature = types.void(out, types.int64, types.int64, types.float64, V, types.int64, types.int64)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        place = _place(context, builder, sig.args[0], args[0], args[1:3])
        entries = builder.load(_place(context, builder, sig.args[4], args[4], args[5:7]), align=8)
        builder.store(_sum(builder, builder.load(place, align=8), args[3], entries), place, align=8)
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def set_four(typingctx, out, i, e, factor, V, b, k):  # type: ignore[no-untyped-def]
    """``out[i, e : e + 4] = factor V[b, k : k + 4]``."""
    signature = types.void(out, types.int64, types.int64, types.float64, V, types.int64, types.int64)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        entries = builder.load(_place(context, builder, sig.args[4], args[4], args[5:7]), align=8)
        product = builder.fmul(_all(builder, args[3]), entries)
        builder.store(product, _place(context, builder, sig.args[0], args[0], args[1:3]), align=8)
        return context.get_dummy_value()

    return signature, codegen
