"""Guarded on-disk caching of compiled kernels.

numba keeps compiled functions in an index file and one data file per signature. A damaged entry (a full disk, a killed
process, a copied home directory) makes numba raise from the middle of a call, or even from an import. Here a kernel
that cannot be loaded from its cache has the cache files deleted and is compiled again; if the cache directory cannot be
written, the kernel is compiled without a cache. A kernel is therefore never lost to its cache: it only becomes slower
to get.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache
from numba.core.compiler import Compiler, CompilerBase

__all__ = ["kernel"]

_EVERYTHING_A_DAMAGED_FILE_RAISES = (
    EOFError, OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, ImportError, RuntimeError,
    MemoryError,
)  # fmt: skip


def _part_compiler() -> type[CompilerBase]:
    """That of `parts`; numba's own where its insides are others: then compilation only takes longer."""
    try:
        from stability.kernels.parts import PartCompiler
    except (ImportError, AttributeError):
        return Compiler
    return PartCompiler


class _GuardedCache(FunctionCache):
    """numba's function cache; a damaged entry is removed and treated as absent."""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """A kernel holds copies of the kernels it calls: an entry is good only for the same sources of all of them."""
        return (*super()._index_key(sig, codegen), _sources(self._py_func.__module__))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except _EVERYTHING_A_DAMAGED_FILE_RAISES + _unpickling_errors():
            self.remove()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except _EVERYTHING_A_DAMAGED_FILE_RAISES + _unpickling_errors():
            self.remove()
            with contextlib.suppress(*_EVERYTHING_A_DAMAGED_FILE_RAISES):
                super().save_overload(sig, data)

    def remove(self) -> None:
        """Delete this function's index and data files."""
        folder, prefix = self._impl.locator.get_cache_path(), self._impl.filename_base
        with contextlib.suppress(OSError):
            for name in os.listdir(folder):
                if name.startswith((prefix + ".", prefix + "-")):
                    with contextlib.suppress(OSError):
                        os.unlink(os.path.join(folder, name))


@functools.cache
def _unpickling_errors() -> tuple[type[Exception], ...]:
    import pickle

    return (pickle.UnpicklingError,)


@functools.cache
def _sources(module: str) -> str:
    """Digest of a kernel module and of the kernel modules it takes functions from."""
    names, waiting = set(), [module]
    while waiting:
        name = waiting.pop()
        if name not in names and name in sys.modules:
            names.add(name)
            owners = (getattr(value, "__module__", None) for value in vars(sys.modules[name]).values())
            waiting += [owner for owner in owners if isinstance(owner, str) and owner.startswith(__package__ + ".")]
    digest = hashlib.blake2b(digest_size=16)
    for name in sorted(names):
        digest.update(Path(str(sys.modules[name].__file__)).read_bytes())
    return digest.hexdigest()


def kernel(
    function: Callable[..., Any] | None = None, *, inline: bool = False, merged: bool = False, sums: bool = False
) -> Any:
    """Decorator: a compiled kernel with a guarded disk cache (`error_model="numpy"`: 1/0 is inf or nan).

    `inline=True` is for small functions that are only called by other kernels: no cache file of their own;
    `merged=True` puts their machine code into that of their caller (many arguments, one call). `sums=True` lets the
    compiler take the terms of sums in another order, several at a time.
    """
    if function is None:
        return functools.partial(kernel, inline=inline, merged=merged, sums=sums)
    dispatcher = numba.njit(
        error_model="numpy",
        nogil=True,
        boundscheck=False,
        no_cfunc_wrapper=True,
        no_cpython_wrapper=inline,
        forceinline=merged,
        fastmath={"reassoc"} if sums else False,
        pipeline_class=_part_compiler() if inline else Compiler,
    )(function)
    if not inline:
        with contextlib.suppress(*_EVERYTHING_A_DAMAGED_FILE_RAISES):
            dispatcher._cache = _GuardedCache(function)
    return dispatcher
