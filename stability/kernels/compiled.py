"""The decorator of kernels: plain Python functions that are compiled when they are first called, once for all models.

    @kernel
    def total(x: R1) -> float:
        value = 0.0
        for k in range(x.shape[0]):
            value += x[k]
        return value

The annotations are its one signature: int, float, bool, and arrays by element and number of dimensions (R1 .. R4 of
float64, I1, I2 of int64, B1 of bool), all C-contiguous; results are numbers and arrays, several as a tuple. A helper
(`@kernel(inline=True)`) has no signature: it becomes part of the kernels that call it, for the types of the call. The
undecorated function stays `.function`: run as it is, it gives the same bits. The language is described in
kernels/native.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import re
import threading
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CompileError
from .native.values import B1, C1, C2, H1, I1, I2, R1, R2, R3, R4, Kind, is_array

__all__ = ["B1", "C1", "C2", "H1", "I1", "I2", "R1", "R2", "R3", "R4", "Kernel", "kernel"]

_DTYPES = {"f": np.float64, "i": np.int64, "b": np.bool_, "c": np.complex128, "h": np.int32}
_SCALARS = {float: "f", int: "i", bool: "b"}
_IMPORTED = re.compile(r"^from (?:stability\.kernels)?\.(\w+) import", re.MULTILINE)
_lock = threading.RLock()
_kernels: dict[str, Kernel] = {}


class Kernel:
    """A compiled function. `inline`: part of its callers, without a signature."""

    def __init__(self, function: Callable[..., Any], inline: bool) -> None:
        functools.update_wrapper(self, function)
        self.function, self.inline = function, inline
        self._loaded: Any = None
        if not inline:
            _kernels[self.name] = self

    @functools.cached_property
    def signature(self) -> tuple[tuple[Kind, ...], tuple[Kind, ...]]:
        """(types of the arguments, types of the results)."""
        hints = typing.get_type_hints(self.function, include_extras=True)
        names = inspect.signature(self.function).parameters
        missing = [name for name in (*names, "return") if name not in hints]
        if missing:
            raise CompileError(f"kernel {self.name}: no type of {', '.join(missing)}")
        given = _kind(hints["return"], self.name) if hints["return"] is not type(None) else ()
        return tuple(_kind(hints[name], self.name) for name in names), given if isinstance(given, tuple) else (given,)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Types of the arguments."""
        return self.signature[0]

    @property
    def results(self) -> tuple[Kind, ...]:
        """Types of the results."""
        return self.signature[1]

    @property
    def name(self) -> str:
        """Module and function."""
        return f"{self.function.__module__.rpartition('.')[2]}.{self.function.__name__}"

    def __call__(self, *arguments: Any) -> Any:
        """Run the machine code, loaded or made at the first call; a helper by itself runs as plain Python."""
        if self._loaded is None:
            if self.inline:
                return self.function(*arguments)
            self.load()
        try:
            return self._call(*arguments)
        except TypeError:
            fitting = self._fitting(arguments)
            if fitting is None:
                raise
            return self._call(*fitting)

    def _fitting(self, arguments: tuple[Any, ...]) -> list[Any] | None:
        """The arguments with contiguous copies of the arrays that are only read; None where that changes nothing."""
        from .native.writes import written

        found = list(arguments)
        for k, (kind, value) in enumerate(zip(self.kinds, arguments)):
            if isinstance(kind, str) and is_array(kind) and k not in written(self) and isinstance(value, np.ndarray):
                fits = value.ndim == int(kind[1:]) and np.can_cast(value.dtype, _DTYPES[kind[0]], "safe")
                found[k] = np.ascontiguousarray(value, _DTYPES[kind[0]]) if fits else value
        return found if any(a is not b for a, b in zip(found, arguments)) else None

    def load(self) -> Any:
        """The machine code, from the store or made now."""
        with _lock:
            if self._loaded is None:
                from .native import machine, store

                source, where = _digest(self.function), machine.processor()
                names, _, code = (store.read(self.name, where, source) or b"").partition(b"\0")
                called = names.decode("utf-8", "replace").split()
                others = [_kernels[name] for name in called if name in _kernels]
                if not code or len(others) < len(called):
                    text, others = self.assembly()
                    code = machine.object_code(text)
                    store.write(self.name, where, source, " ".join(one.name for one in others).encode() + b"\0" + code)
                loaded = machine.Loaded(code, self.name, [one.load().address for one in others])
                self._call = loaded.call
                if any(map(is_array, self.results)):
                    self._call = functools.partial(_with_arrays, loaded.call, self.results)
                self._loaded = loaded
            return self._loaded

    def assembly(self) -> tuple[str, list[Any]]:
        """(LLVM assembly of the module, kernels that it calls)."""
        from .native import border, functions, writes

        module = functions.Module(len(border.INTERFACE) + len(border.OBJECTS))
        module.function(self, self.kinds, self.results, "kernel")
        names = list(inspect.signature(self.function).parameters)
        outside = border.border(self.function.__name__, names, self.kinds, self.results, writes.written(self))
        return module.text(outside), module.others


def kernel(function: Callable[..., Any] | None = None, *, inline: bool = False) -> Any:
    """Decorator: a compiled kernel, or with `inline=True` a helper of kernels."""
    if function is None:
        return functools.partial(kernel, inline=inline)
    return Kernel(function, inline)


def _kind(note: Any, name: str) -> Kind:
    """The type that an annotation means."""
    if note in _SCALARS:
        return _SCALARS[note]
    if typing.get_origin(note) is tuple:
        return tuple(_kind(one, name) for one in typing.get_args(note))
    marks = getattr(note, "__metadata__", ())
    if not marks:
        raise CompileError(f"kernel {name}: '{note}' is no type of the kernels' language")
    return str(marks[0])


def _with_arrays(call: Callable[..., Any], kinds: tuple[Kind, ...], *arguments: Any) -> Any:
    """The call with its arrays made out of bytes and sizes."""
    rest = list(call(*arguments))
    found: list[Any] = []
    for kind in kinds:
        value, rest = rest[0], rest[1:]
        if isinstance(kind, str) and is_array(kind):
            rank = int(kind[1:])
            value, rest = np.frombuffer(value, _DTYPES[kind[0]]).reshape(rest[:rank]), rest[rank:]
        found.append(value)
    return found[0] if len(found) == 1 else tuple(found)


@functools.cache
def _digest(function: Any) -> str:
    """Digest of the file of a kernel, of the kernel modules it takes anything from, and of the translator."""
    here, waiting = Path(__file__).parent, [Path(inspect.getfile(function))]
    files: set[Path] = set()
    while waiting:
        file = waiting.pop()
        if file not in files and file.is_file():
            files.add(file)
            waiting += [here / f"{name}.py" for name in _IMPORTED.findall(file.read_text(encoding="utf-8"))]
    digest = hashlib.blake2b(digest_size=8)
    for file in [*sorted(files), *sorted((here / "native").glob("*.py"))]:
        digest.update(file.read_bytes())
    return digest.hexdigest()
