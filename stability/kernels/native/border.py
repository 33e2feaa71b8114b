"""The border between Python and a kernel, in LLVM assembly: unpacks arguments, calls, packs the results.

A C function of Python's vector call convention, ``PyObject *border(self, args, count)``: a number is read through
Python's C interface, an array from the fields of numpy's array object (whose order `layout_holds` verifies). Any other
type, number of dimensions, byte order, or an array that is not C-contiguous is a TypeError that says what is needed.
The global interpreter lock is released meanwhile. An array among the results becomes a bytearray and its sizes, which
`machine` turns into an array again.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache

import numpy as np

from .values import WIDTH, Kind, flat, is_array

__all__ = ["INTERFACE", "OBJECTS", "border", "layout_holds"]

INTERFACE = (
    "PyMem_RawMalloc", "PyMem_RawFree", "PyFloat_AsDouble", "PyErr_Occurred", "PyLong_AsLongLong", "PyFloat_FromDouble",
    "PyLong_FromLongLong", "PyBool_FromLong", "PyTuple_New", "PyTuple_SetItem", "PyErr_SetString", "PyEval_SaveThread",
    "PyEval_RestoreThread", "PyByteArray_FromStringAndSize", "Py_IncRef", "PyTuple_Size", "PyTuple_GetItem",
)  # fmt: skip
OBJECTS = (TypeError, np.ndarray, None)
_HEAD = object.__basicsize__
_DATA, _RANK, _SIZES, _DESCRIPTION, _FLAGS = _HEAD, _HEAD + 8, _HEAD + 16, _HEAD + 40, _HEAD + 48
_BYTE_ORDER, _NUMBER = _HEAD + 10, _HEAD + 12
_CONTIGUOUS, _ALIGNED, _WRITEABLE = 0x1, 0x100, 0x400
_TYPES = {k: np.dtype(v) for k, v in (("f", float), ("i", np.int64), ("b", bool), ("c", complex), ("h", np.int32))}


@lru_cache(maxsize=1)
def layout_holds() -> bool:
    """Whether numpy's array object has its fields where the border reads them."""
    probe = np.zeros((3, 5))[:, :4]
    view, sizes = id(probe), (ctypes.c_int64 * 2).from_address(ctypes.c_int64.from_address(id(probe) + _SIZES).value)
    description = ctypes.c_int64.from_address(view + _DESCRIPTION).value
    return (
        ctypes.c_int64.from_address(view + _HEAD - 8).value == id(np.ndarray)
        and ctypes.c_int64.from_address(view + _DATA).value == probe.ctypes.data
        and ctypes.c_int32.from_address(view + _RANK).value == 2
        and tuple(sizes) == (3, 4)
        and description == id(probe.dtype)
        and ctypes.c_int32.from_address(view + _FLAGS).value & 0x501 == _ALIGNED | _WRITEABLE
        and ctypes.c_char.from_address(description + _BYTE_ORDER).value == probe.dtype.byteorder.encode()
        and ctypes.c_int32.from_address(description + _NUMBER).value == probe.dtype.num
    )


class _Border:
    """Writes the function line by line."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.messages: list[str] = []
        self.count = 0

    def write(self, instruction: str) -> str:
        self.count += 1
        self.lines.append(f"  %r{self.count} = {instruction}")
        return f"%r{self.count}"

    def entry(self, index: int) -> str:
        """An entry of the table."""
        return self.write(f"load ptr, ptr {self.write(f'getelementptr ptr, ptr @table, i64 {index}')}")

    def call(self, name: str, kind: str, arguments: str) -> str:
        """A call of Python's C interface."""
        function = self.entry(INTERFACE.index(name))
        if kind == "void":
            self.lines.append(f"  call void {function}({arguments})")
            return ""
        return self.write(f"call {kind} {function}({arguments})")

    def field(self, owner: str, offset: int, kind: str) -> str:
        """A field of a C structure."""
        return self.write(f"load {kind}, ptr {self.write(f'getelementptr i8, ptr {owner}, i64 {offset}')}")

    def refuse_unless(self, condition: str, message: str) -> None:
        """TypeError(message) where the condition is false."""
        self.count += 1
        good, bad = f"good{self.count}", f"bad{self.count}"
        coded = message.encode("ascii", "replace")
        text = f"@message{len(self.messages)}"
        shown = "".join(chr(c) if 32 <= c < 127 and c not in (34, 92) else f"\\{c:02X}" for c in coded)
        self.messages.append(f'{text} = internal constant [{len(coded) + 1} x i8] c"{shown}\\00"')
        self.lines += [f"  br i1 {condition}, label %{good}, label %{bad}", f"{bad}:"]
        error = self.entry(len(INTERFACE))
        self.call("PyErr_SetString", "void", f"ptr {error}, ptr {text}")
        self.lines += ["  ret ptr null", f"{good}:"]

    def number(self, source: str, kind: str) -> str:
        """A float or an int."""
        if kind == "f":
            value = self.call("PyFloat_AsDouble", "double", f"ptr {source}")
            suspicious = self.write(f"fcmp oeq double {value}, -1.0")
        else:
            value = self.call("PyLong_AsLongLong", "i64", f"ptr {source}")
            suspicious = self.write(f"icmp eq i64 {value}, -1")
        self.count += 1
        ask, fine, wrong = f"ask{self.count}", f"fine{self.count}", f"wrong{self.count}"
        self.lines += [f"  br i1 {suspicious}, label %{ask}, label %{fine}", f"{ask}:"]
        error = self.write(f"icmp eq ptr {self.call('PyErr_Occurred', 'ptr', '')}, null")
        self.lines += [f"  br i1 {error}, label %{fine}, label %{wrong}", f"{wrong}:", "  ret ptr null", f"{fine}:"]
        return self.write(f"icmp ne i64 {value}, 0") if kind == "b" else value

    def array(self, source: str, kind: str, where: str, written: bool) -> list[str]:
        """Pointer and sizes of an array."""
        element, rank = kind[0], int(kind[1:])
        adjective = "writeable, " if written else ""
        message = f"{where} must be a {adjective}C-contiguous {_TYPES[element]} array of {rank} dimension(s)"
        own, wanted = self.field(source, _HEAD - 8, "ptr"), self.entry(len(INTERFACE) + 1)
        self.refuse_unless(self.write(f"icmp eq ptr {own}, {wanted}"), message)
        mask = _CONTIGUOUS | _ALIGNED | (_WRITEABLE if written else 0)
        flags = self.write(f"and i32 {self.field(source, _FLAGS, 'i32')}, {mask}")
        description = self.field(source, _DESCRIPTION, "ptr")
        number = self.field(description, _NUMBER, "i32")
        order = self.field(description, _BYTE_ORDER, "i8")
        numbers = {np.dtype(one).num for one in "bhilqfdD?" if np.dtype(one) == _TYPES[element]}
        checks = [
            self.write(f"icmp eq i32 {flags}, {mask}"),
            self.write(f"icmp eq i32 {self.field(source, _RANK, 'i32')}, {rank}"),
            self.write(f"icmp ne i8 {order}, {ord('>' if np.little_endian else '<')}"),
        ]
        among = "false"
        for one in sorted(numbers):
            among = self.write(f"or i1 {among}, {self.write(f'icmp eq i32 {number}, {one}')}")
        for check in checks:
            among = self.write(f"and i1 {among}, {check}")
        self.refuse_unless(among, message)
        sizes = self.field(source, _SIZES, "ptr")
        return [self.field(source, _DATA, "ptr"), *(self.field(sizes, 8 * k, "i64") for k in range(rank))]

    def argument(self, source: str, kind: Kind, where: str, written: bool) -> list[str]:
        """The registers of an argument."""
        if isinstance(kind, str):
            return self.array(source, kind, where, written) if is_array(kind) else [self.number(source, kind)]
        size = self.call("PyTuple_Size", "i64", f"ptr {source}")
        self.refuse_unless(self.write(f"icmp eq i64 {size}, {len(kind)}"), f"{where} must be a tuple of {len(kind)}")
        found = []
        for k, one in enumerate(kind):
            entry = self.call("PyTuple_GetItem", "ptr", f"ptr {source}, i64 {k}")
            found += self.argument(entry, one, f"entry {k} of {where}", written)
        return found

    def packed(self, registers: list[str], kinds: tuple[Kind, ...]) -> list[str]:
        """Python objects of the results."""
        objects = []
        for kind in kinds:
            taken, registers = registers[: len(flat(kind))], registers[len(flat(kind)) :]
            if kind == "f":
                objects.append(self.call("PyFloat_FromDouble", "ptr", f"double {taken[0]}"))
            elif kind == "i":
                objects.append(self.call("PyLong_FromLongLong", "ptr", f"i64 {taken[0]}"))
            elif kind == "b":
                wide = self.write(f"zext i1 {taken[0]} to i64")
                objects.append(self.call("PyBool_FromLong", "ptr", f"i64 {wide}"))
            else:
                total = str(WIDTH[kind[0]])
                for size in taken[1:]:
                    total = self.write(f"mul i64 {total}, {size}")
                objects.append(self.call("PyByteArray_FromStringAndSize", "ptr", f"ptr {taken[0]}, i64 {total}"))
                objects += [self.call("PyLong_FromLongLong", "ptr", f"i64 {size}") for size in taken[1:]]
        return objects


def border(
    name: str, names: list[str], kinds: tuple[Kind, ...], results: tuple[Kind, ...], writes: frozenset[int]
) -> str:
    """LLVM assembly of the border of `@kernel`, whose arguments have these names and types."""
    b = _Border()
    right = b.write(f"icmp eq i64 %count, {len(kinds)}")
    b.refuse_unless(right, f"{name}() takes {len(kinds)} arguments: {', '.join(names)}")
    arguments = ["ptr %list"]
    for k, kind in enumerate(kinds):
        source, where = b.field("%args", 8 * k, "ptr"), f"argument '{names[k]}' of {name}()"
        found = b.argument(source, kind, where, k in writes)
        arguments += [f"{llvm} {register}" for llvm, register in zip(flat(kind), found)]
    thread = b.call("PyEval_SaveThread", "ptr", "")
    types = flat(results)
    whole = f"{{ {', '.join(types)} }}"
    given = ""
    if types:
        given = b.write(f"call {whole} @kernel({', '.join(arguments)})")
    else:
        b.lines.append(f"  call void @kernel({', '.join(arguments)})")
    b.call("PyEval_RestoreThread", "void", f"ptr {thread}")
    registers = [b.write(f"extractvalue {whole} {given}, {k}") for k in range(len(types))]
    objects = b.packed(registers, results)
    b.lines.append("  call void @release(ptr %list)")
    if not objects:
        result = b.entry(len(INTERFACE) + 2)
        b.call("Py_IncRef", "void", f"ptr {result}")
    elif len(objects) == 1:
        result = objects[0]
    else:
        result = b.call("PyTuple_New", "ptr", f"i64 {len(objects)}")
        for k, item in enumerate(objects):
            b.call("PyTuple_SetItem", "i32", f"ptr {result}, i64 {k}, ptr {item}")
    start = ["entry:", "  %list = alloca ptr", "  store ptr null, ptr %list"]
    body = "\n".join([*start, *b.lines, f"  ret ptr {result}"])
    messages = "\n".join(b.messages)
    return f"{messages}\ndefine ptr @border(ptr %self, ptr %args, i64 %count) nounwind {{\n{body}\n}}\n"
