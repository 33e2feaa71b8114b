"""Assembly to machine code and into this process, by llvmlite; neither a compiler nor a linker is needed.

The object code that is stored holds no address: it takes what it calls from a table that is filled after loading. What
LLVM may call on its own account (memset, memcpy, pow, ...) is registered by address, so that nothing is left to be
resolved (an unresolved name would end the process).
"""

from __future__ import annotations

import ctypes
import hashlib
import platform
import sys
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ...errors import CompileError
from .border import INTERFACE, OBJECTS, layout_holds

__all__ = ["Loaded", "object_code", "processor"]

_MEMORY = ("memset", "memcpy", "memmove")
_MATHEMATICS = ("pow", "floor", "sqrt", "roundeven", "exp", "sin", "cos", "hypot")
_METH_FASTCALL = 0x80


@lru_cache(maxsize=1)
def _started() -> Any:
    """The llvmlite binding with its native target, and the C functions it may call."""
    import llvmlite.binding as llvm

    if not layout_holds():
        raise CompileError("this build of Python and numpy keeps its arrays in a form the kernels do not know")
    if llvm.llvm_version_info[0] < 20:  # newer ones initialise themselves and refuse the call
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for names, libraries in ((_MEMORY, _c_libraries()), (_MATHEMATICS, _mathematics_libraries())):
        for name in names:
            address = _address(name, libraries)
            if address:
                llvm.add_symbol(name, address)
    return llvm


def _c_libraries() -> tuple[str | None, ...]:
    if sys.platform == "win32":
        return "ucrtbase", "msvcrt"
    return ("/usr/lib/libSystem.B.dylib", None) if sys.platform == "darwin" else (None, "libc.so.6")


def _mathematics_libraries() -> tuple[str | None, ...]:
    return ("libm.so.6", None, "libm.so") if sys.platform.startswith("linux") else _c_libraries()


def _address(name: str, libraries: tuple[str | None, ...]) -> int:
    for library in libraries:
        try:
            function = getattr(ctypes.CDLL(library), name)
        except (OSError, AttributeError, TypeError):
            continue
        return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
    return 0


def _machine(llvm: Any) -> Any:
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=_features(llvm), opt=2, codemodel="jitdefault", jit=True
    )


def _features(llvm: Any) -> str:
    try:
        return str(llvm.get_host_cpu_features().flatten())
    except RuntimeError:  # some virtual processors do not tell
        return ""


@lru_cache(maxsize=1)
def processor() -> str:
    """Short digest of everything that object code depends on but its source."""
    llvm = _started()
    import llvmlite

    facts = (
        llvm.get_default_triple(), llvm.get_host_cpu_name(), _features(llvm), llvmlite.__version__,
        platform.python_version(), str(object.__basicsize__),
    )  # fmt: skip
    return hashlib.blake2b("|".join(facts).encode(), digest_size=6).hexdigest()


def object_code(assembly: str) -> bytes:
    """The optimised object code of a module."""
    llvm = _started()
    module = llvm.parse_assembly(assembly)
    module.verify()
    machine = _machine(llvm)
    module.triple, module.data_layout = llvm.get_default_triple(), str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    # loops over a few states are neither unrolled nor interleaved: measured, it costs half of the compilation and 20 %
    # of the speed
    options.loop_vectorization, options.loop_unrolling, options.loop_interleaving = True, False, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


class _Definition(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p), ("function", ctypes.c_void_p), ("flags", ctypes.c_int), ("text", ctypes.c_char_p),
    )  # fmt: skip


class Loaded:
    """Object code in this process: `.address` of the kernel for other kernels, `.call` for Python. Owns its memory."""

    def __init__(self, code: bytes, name: str, addresses: list[int]) -> None:
        llvm = _started()
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine(llvm))
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()
        entries = [*_interface(), *addresses]
        table = (ctypes.c_void_p * len(entries))(*entries)
        ctypes.CFUNCTYPE(None, ctypes.c_void_p)(self._engine.get_function_address("fill"))(ctypes.addressof(table))
        self.address = int(self._engine.get_function_address("kernel"))
        border = self._engine.get_function_address("border")
        self._definition = _Definition(name.encode(), border, _METH_FASTCALL, None)
        make = ctypes.pythonapi.PyCFunction_NewEx
        make.restype, make.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
        self.call: Callable[..., Any] = make(ctypes.addressof(self._definition), None, None)


@lru_cache(maxsize=1)
def _interface() -> tuple[int, ...]:
    """The first entries of every table: Python's C interface and a few of its objects."""
    functions = (getattr(ctypes.pythonapi, name) for name in INTERFACE)
    addresses = [int(ctypes.cast(function, ctypes.c_void_p).value or 0) for function in functions]
    return (*addresses, *(id(one) for one in OBJECTS))
