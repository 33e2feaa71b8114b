"""Machine code in memory: LLVM IR text compiled by llvmlite's MCJIT, and the mathematics library it calls.

Neither a compiler nor the linker of the machine is needed: the functions of the C library are looked up through ctypes
and registered with LLVM by absolute address under an own prefix, on Linux, macOS and Windows alike (an unresolved name
would end the process, so none is left to LLVM). No optimisation passes over the text: it has no repeated work left.
"""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ..errors import CompileError
from ._llvm import LIBRARY_FUNCTIONS, OUTPUTS, TWO_ARGUMENTS, emit
from ._program import Program

__all__ = ["MachineCode", "unavailable"]


@lru_cache(maxsize=1)
def _started() -> Any:
    """The llvmlite binding, its native target initialised once, and the mathematics library registered."""
    import llvmlite.binding as llvm

    if llvm.llvm_version_info[0] < 20:  # newer ones initialise themselves and refuse the call
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for name in sorted({*LIBRARY_FUNCTIONS.values(), *TWO_ARGUMENTS}):
        llvm.add_symbol(f"stability_{name}", _library_address(name))
    return llvm


def _library_address(name: str) -> int:
    """Address of a C mathematics function in this process."""
    if sys.platform == "win32":
        candidates: tuple[str | None, ...] = ("ucrtbase", "msvcrt")
    elif sys.platform == "darwin":
        candidates = ("/usr/lib/libSystem.B.dylib", None)
    else:
        candidates = ("libm.so.6", None, "libm.so")
    for library in candidates:
        try:
            function = getattr(ctypes.CDLL(library), name)
        except (OSError, AttributeError):
            continue
        return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
    raise CompileError(f"the C mathematics library of this machine has no '{name}'; use backend='lambdify'")


def unavailable() -> str:
    """Why this machine cannot make machine code; empty where it can."""
    try:
        with MachineCode._lock:
            _started()
    except (ImportError, OSError) as error:
        return f"llvmlite cannot be loaded ({error})"
    except CompileError as error:
        return str(error)
    return ""


class MachineCode:
    """Compiled program: `.address`, and `.call(...)` with integers for pointers. Owns the memory of the code."""

    _lock = threading.Lock()

    def __init__(self, program: Program) -> None:
        text = emit(program)
        arrays = len(program.directions) + max(len(program.results), OUTPUTS)
        with MachineCode._lock:
            llvm = _started()
            module = llvm.parse_assembly(text)
            module.verify()
            machine = llvm.Target.from_default_triple().create_target_machine(
                cpu=llvm.get_host_cpu_name(), features=_features(llvm), opt=2, codemodel="jitdefault"
            )
            self._engine = llvm.create_mcjit_compiler(module, machine)
            self._engine.finalize_object()
            self.address = int(self._engine.get_function_address("evaluate"))
        kinds = [ctypes.c_int64] + [ctypes.c_void_p] * 3 + [ctypes.c_int64] + [ctypes.c_void_p] * arrays
        self.call: Callable[..., None] = ctypes.CFUNCTYPE(None, *kinds)(self.address)


def _features(llvm: Any) -> str:
    try:
        return str(llvm.get_host_cpu_features().flatten())
    except RuntimeError:  # some virtual processors do not tell
        return ""
