"""Calling compiled directional derivatives of a field by their address from inside a kernel.

    void derivative(int64 N, const double* phase, const double* X, const double* P, int64 pstride,
                    const double* D1, .., const double* Dk, double* out, const double* sizes, void* unused)

with k = 2 for D2F[D1, D2] and for the gradient of D2 . F_z D1, k = 3 for D3F[D1, D2, D3]; see
`Evaluator.directional_address`. `sizes` (n + m,) of states and parameters scale the differences of a field without
formulas. As for `addresses`, a wrong address or shape is a crash.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["call_directional"]

_DOUBLE, _INT64 = ir.DoubleType(), ir.IntType(64)


def _data(context: Any, builder: Any, array_type: Any, value: Any) -> Any:
    return context.make_array(array_type)(context, builder, value=value).data


@intrinsic
def call_directional(typingctx, address, phase, X, P, directions, out, sizes):  # type: ignore[no-untyped-def]
    """``derivative(N, ...)`` at an address: phase (N,), X of N points, P (m,), a tuple of directions, out, sizes."""
    signature = types.void(types.int64, phase, X, P, directions, out, sizes)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        pointer = _DOUBLE.as_pointer()
        many = [
            _data(context, builder, kind, value)
            for kind, value in zip(sig.args[4].types, cgutils.unpack_tuple(builder, args[4]))
        ]
        phase, X, P, out, sizes = (_data(context, builder, sig.args[k], args[k]) for k in (1, 2, 3, 5, 6))
        count = builder.extract_value(context.make_array(sig.args[1])(context, builder, value=args[1]).shape, 0)
        kinds = [_INT64, pointer, pointer, pointer, _INT64, *[pointer] * (len(many) + 3)]
        call = builder.inttoptr(args[0], ir.FunctionType(ir.VoidType(), kinds).as_pointer())
        zero = ir.Constant(_INT64, 0)
        builder.call(call, [count, phase, X, P, zero, *many, out, sizes, cgutils.get_null_value(pointer)])
        return context.get_dummy_value()

    return signature, codegen
