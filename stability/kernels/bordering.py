r"""Singular borders of small dense matrices, and the bordered systems whose corner G vanishes where the rank drops.

    [ A    W ] [ v ]   [ 0 ]           [ A^T  V ] [ w ]   [ 0 ]
    [ V^T  0 ] [ G ] = [ I ]    and    [ W^T  0 ] [ . ] = [ I ]        A (k, k),  W, V, w, v (k, a),  G (a, a)

Borders are the singular vectors of the a smallest singular values; then v = V, w = W, G = - W^T A V. G is a smooth
function of a smooth family of matrices between constant borders, and G det K, K the bordered matrix, for any borders
(a = 1): G = det A / det K. By LAPACK's dgesvd and dgesv.
Reference: Govaerts (2000), chapter 3.
"""

from __future__ import annotations

import functools

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic

from stability.kernels.addresses import call_solver, solver_address
from stability.kernels.caching import kernel

__all__ = ["bordered", "borders", "lapack"]


@functools.cache
def lapack() -> tuple[int, int]:
    """Addresses of dgesvd and dgesv for the kernels below."""
    import scipy.linalg.cython_lapack  # noqa: F401 - the address is looked up in the imported module

    return int(get_cython_function_address("scipy.linalg.cython_lapack", "dgesvd")), solver_address()


@intrinsic
def _decompose(typingctx, address, sizes, A, values, right, left, room):  # type: ignore[no-untyped-def]
    """``dgesvd`` at an address: A (k, k) = left diag(values) right, row by row; A is overwritten.

    sizes (3,) int32: k, the length of `room`, at least 5 k, and LAPACK's info, which is set (0: done).
    """
    signature = types.void(types.int64, sizes, A, values, right, left, room)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        double, integer = ir.DoubleType().as_pointer(), ir.IntType(32).as_pointer()
        letter = ir.IntType(8).as_pointer()
        kinds = [letter, letter, integer, integer, double, integer, double, double, integer, double, integer]
        kinds += [double, integer, integer]
        call = builder.inttoptr(args[0], ir.FunctionType(ir.VoidType(), kinds).as_pointer())
        data = [context.make_array(sig.args[k])(context, builder, value=args[k]).data for k in range(1, 7)]
        k, length, info = (builder.gep(data[0], [ir.Constant(ir.IntType(64), i)]) for i in range(3))
        every = cgutils.alloca_once_value(builder, ir.Constant(ir.IntType(8), ord("A")))
        _, A, values, right, left, room = data  # column by column the matrix is A^T = right^T diag(values) left^T
        builder.call(call, [every, every, k, k, A, k, values, right, k, left, k, room, length, info])
        return context.get_dummy_value()

    return signature, codegen


@kernel(inline=True)
def borders(lapack, A, W, V):  # type: ignore[no-untyped-def]
    """Fill W, V (k, a); see the head of this file. Not finite where A is not."""
    k, a = W.shape
    B, left, right, values = np.empty((k, k)), np.empty((k, k)), np.empty((k, k)), np.empty(k)
    room, sizes = np.empty(16 * k), np.zeros(3, np.int32)
    sizes[0], sizes[1] = k, 16 * k
    total = 0.0
    for i in range(k):
        for j in range(k):
            B[i, j] = A[i, j]
            total += A[i, j]
    sizes[2] = 1
    if abs(total) < np.inf:
        _decompose(lapack[0], sizes, B, values, right, left, room)
    for i in range(k):
        for j in range(a):
            W[i, j] = left[i, k - 1 - j] if sizes[2] == 0 else np.nan
            V[i, j] = right[k - 1 - j, i] if sizes[2] == 0 else np.nan


@kernel(inline=True)
def bordered(lapack, A, W, V, w, v, G):  # type: ignore[no-untyped-def]
    """Fill w, v (k, a) and G (a, a) for any borders; returns the sign of det K, 0: singular."""
    k, a = W.shape
    size, sign = k + a, 1.0
    K, B = np.empty((size, size)), np.empty((a, size))
    pivots, sizes = np.empty(size, np.int32), np.zeros(3, np.int32)
    sizes[0], sizes[1] = size, a
    for transposed in range(2):
        for i in range(size):
            for j in range(size):
                K[i, j] = 0.0
                if i < k and j < k:
                    K[i, j] = A[i, j] if transposed == 1 else A[j, i]
                elif i < k:
                    K[i, j] = W[i, j - k] if transposed == 1 else V[i, j - k]
                elif j < k:
                    K[i, j] = V[j, i - k] if transposed == 1 else W[j, i - k]
            for j in range(a):
                B[j, i] = 1.0 if i == k + j else 0.0
        call_solver(lapack[1], sizes, K, pivots, B)
        if sizes[2] != 0:
            return 0.0
        for j in range(a):
            for i in range(k):
                if transposed == 1:
                    w[i, j] = B[j, i]
                else:
                    v[i, j] = B[j, i]
            for i in range(a):
                if transposed == 0:
                    G[i, j] = B[j, k + i]
    for i in range(size):
        if (K[i, i] < 0.0) != (pivots[i] != i + 1):
            sign = -sign
    return sign
