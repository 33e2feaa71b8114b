"""Calling a compiled vector field by its address from inside a kernel.

The field is one C function for all points of a discretisation,

    void field(int64 N, const double* phase, const double* X, const double* P, int64 pstride,
               double* F, double* J, double* Fp)

with X (N, n), F (N, n), J (N, n, n) = dF/dx and Fp (N, n, m) = dF/dp at fixed phase, all C-contiguous; P is (m,) with
``pstride = 0`` or (N, m) with ``pstride = m``. A forcing period T(p) is a field of one state that does not depend on
it: F = T, Fp = dT/dp. Because an address is an ordinary integer argument, kernels are compiled once for all models and
cached on disk.

A wrong address or shape is a crash, not an exception: sizes are validated in Python before a kernel is entered, and
the owner of the machine code must be kept alive as long as its address is used.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

__all__ = [
    "borrowed", "call_eigenvalues", "call_field", "call_solver", "eigenvalue_address", "native_address", "native_call",
    "solver_address",
]  # fmt: skip

_DOUBLE = ir.DoubleType()
_INT64 = ir.IntType(64)


def _data(context: Any, builder: Any, array_type: Any, value: Any) -> Any:
    """The data pointer of a numba array value."""
    return context.make_array(array_type)(context, builder, value=value).data


def _function(builder: Any, address: Any, arguments: list[Any]) -> Any:
    """The function pointer behind an integer address."""
    return builder.inttoptr(address, ir.FunctionType(ir.VoidType(), arguments).as_pointer())


@intrinsic
def borrowed(typingctx, array):  # type: ignore[no-untyped-def]
    """The same array without its owner: whoever calls keeps the owner alive, by a use of it behind the last of these.

    numba counts the references of every array that is handed to a function, by an atomic instruction before and one
    after. In an integrator's small functions these were half of the time; an array without an owner has none.
    """

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        view = context.make_array(sig.args[0])(context, builder, value=args[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), codegen


@intrinsic
def call_field(typingctx, address, count, phase, X, P, stride, F, J, Fp):  # type: ignore[no-untyped-def]
    """``field(count, phase, X, P, stride, F, J, Fp)`` at an integer address, on float64 C-contiguous arrays."""
    signature = types.void(types.int64, types.int64, phase, X, P, types.int64, F, J, Fp)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        pointer = _DOUBLE.as_pointer()
        call = _function(builder, args[0], [_INT64, pointer, pointer, pointer, _INT64, pointer, pointer, pointer])
        data = [_data(context, builder, sig.args[k], args[k]) for k in (2, 3, 4, 6, 7, 8)]
        builder.call(call, [args[1], data[0], data[1], data[2], args[5], data[3], data[4], data[5]])
        return context.get_dummy_value()

    return signature, codegen


def _lapack(name: str) -> int:
    import scipy.linalg.cython_lapack  # noqa: F401 - the address is looked up in the imported module
    from numba.extending import get_cython_function_address

    return int(get_cython_function_address("scipy.linalg.cython_lapack", name))


def solver_address() -> int:
    """Address of LAPACK's dgesv, from scipy, for `call_solver`."""
    return _lapack("dgesv")


def eigenvalue_address() -> int:
    """Address of LAPACK's dgeev, from scipy, for `call_eigenvalues`."""
    return _lapack("dgeev")


@intrinsic
def call_eigenvalues(typingctx, address, sizes, A, re, im, room):  # type: ignore[no-untyped-def]
    """``dgeev`` at an address, eigenvalues only: those of A (n * n,), which is overwritten, in re (n,) and im (n,).

    sizes (3,) int32: n, the length of `room`, at least 3 n, and LAPACK's info, which is set (0: done).
    """
    signature = types.void(types.int64, sizes, A, re, im, room)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        double, integer, letter = _DOUBLE.as_pointer(), ir.IntType(32).as_pointer(), ir.IntType(8).as_pointer()
        kinds = [letter, letter, integer, double, integer, double, double, double, integer, double, integer, double]
        call = _function(builder, args[0], [*kinds, integer, integer])
        data = [_data(context, builder, sig.args[k], args[k]) for k in range(1, 6)]
        n, length, info = (builder.gep(data[0], [ir.Constant(_INT64, k)]) for k in range(3))
        none = cgutils.alloca_once_value(builder, ir.Constant(ir.IntType(8), ord("N")))
        A, re, im, room = data[1:]
        builder.call(call, [none, none, n, A, n, re, im, room, n, room, n, room, length, info])
        return context.get_dummy_value()

    return signature, codegen


@intrinsic
def call_solver(typingctx, address, sizes, A, pivots, B):  # type: ignore[no-untyped-def]
    """``dgesv`` at an address: A (n, n) and B (k, n) hold columns as rows and become the factors and the solutions.

    sizes (3,) int32: n, k, and LAPACK's info, which is set (0: solved); pivots (n,) int32, counted from 1.
    """
    signature = types.void(types.int64, sizes, A, pivots, B)

    def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
        double, integer = _DOUBLE.as_pointer(), ir.IntType(32).as_pointer()
        call = _function(builder, args[0], [integer, integer, double, integer, integer, double, integer, integer])
        data = [_data(context, builder, sig.args[k], args[k]) for k in range(1, 5)]
        n, count, info = (builder.gep(data[0], [ir.Constant(_INT64, k)]) for k in range(3))
        builder.call(call, [n, count, data[1], n, data[2], data[3], n, info])
        return context.get_dummy_value()

    return signature, codegen


def native_call(argument_types: tuple[Any, ...]) -> Any:
    """An intrinsic ``call(address, arguments)`` of a compiled kernel that takes `argument_types` and returns a float64.

    A kernel that calls another one directly contains a copy of it, which is optimised again; called by its address it
    is compiled once. Arguments of any other types are a typing error, not a crash.
    """

    @intrinsic
    def call(typingctx, address, arguments):  # type: ignore[no-untyped-def]
        if tuple(arguments.types) != argument_types:
            raise TypingError(f"the kernel takes {argument_types}, not {arguments.types}")

        def codegen(context, builder, sig, args):  # type: ignore[no-untyped-def]
            convention = context.call_conv
            values = cgutils.unpack_tuple(builder, args[1], len(argument_types))
            kind = convention.get_function_type(types.float64, argument_types)
            pointer = builder.inttoptr(args[0], kind.as_pointer())
            status, result = convention.call_function(builder, pointer, types.float64, argument_types, values)
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return result

        return types.float64(types.int64, arguments), codegen

    return call


def native_address(kernel: Any, argument_types: tuple[Any, ...]) -> int:
    """Address of a kernel compiled (or loaded from the cache) for these types."""
    kernel.compile(argument_types)
    result = kernel.overloads[argument_types]
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))
