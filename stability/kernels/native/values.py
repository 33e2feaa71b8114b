"""Types and values of the kernels' language.

The type of a number is a letter, ``f`` (float64), ``i`` (int64), ``b`` (bool), ``c`` (complex128); that of an array is
its element (``h``, int32, too) and its number of dimensions, ``f2``; that of a tuple is the tuple of its types. Arrays
are C-contiguous; as LLVM values they are a pointer and the int64 sizes of their dimensions. A bool in memory is a byte.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ...errors import CompileError

__all__ = [
    "B1", "C1", "C2", "ELEMENT", "H1", "I1", "I2", "LLVM", "R1", "R2", "R3", "R4", "WIDTH", "Block", "Complex", "Kind",
    "Scalar", "Value", "flat", "is_array", "kind_of", "literal", "parts", "rebuilt",
]  # fmt: skip

# the annotations of a kernel's arguments: R2 is a float64 matrix, I1 an int64 vector, H1 an int32 one
R1 = Annotated[NDArray[np.float64], "f1"]
R2 = Annotated[NDArray[np.float64], "f2"]
R3 = Annotated[NDArray[np.float64], "f3"]
R4 = Annotated[NDArray[np.float64], "f4"]
C1 = Annotated[NDArray[np.complex128], "c1"]
C2 = Annotated[NDArray[np.complex128], "c2"]
I1 = Annotated[NDArray[np.int64], "i1"]
I2 = Annotated[NDArray[np.int64], "i2"]
H1 = Annotated[NDArray[np.int32], "h1"]
B1 = Annotated[NDArray[np.bool_], "b1"]

LLVM = {"f": "double", "i": "i64", "b": "i1"}
ELEMENT = {"f": "double", "i": "i64", "b": "i8", "h": "i32"}  # in memory; a complex number is two floats
WIDTH = {"f": 8, "i": 8, "b": 1, "h": 4, "c": 16}

Kind = str | tuple[Any, ...]


@dataclass(frozen=True)
class Scalar:
    """A number: its type and the LLVM register or literal that holds it."""

    kind: str
    text: str


@dataclass(frozen=True)
class Complex:
    """A complex number: registers or literals of its parts."""

    real: str
    imaginary: str


@dataclass(frozen=True)
class Block:
    """An array: element type, pointer and sizes of its dimensions."""

    element: str
    data: str
    shape: tuple[str, ...]


Value = Scalar | Complex | Block | tuple["Value", ...]


def literal(number: float | int | bool) -> Scalar:
    """A constant; floats by their bits."""
    if isinstance(number, bool | np.bool_):
        return Scalar("b", "true" if number else "false")
    if isinstance(number, int | np.integer):
        return Scalar("i", str(int(number)))
    bits = struct.unpack("<Q", struct.pack("<d", float(number)))[0]
    return Scalar("f", f"0x{bits:016X}")


def is_array(kind: Kind) -> bool:
    """Whether a type is that of an array."""
    return isinstance(kind, str) and len(kind) > 1


def kind_of(value: Value) -> Kind:
    """The type of a value."""
    if isinstance(value, Scalar):
        return value.kind
    if isinstance(value, Complex):
        return "c"
    if isinstance(value, Block):
        return f"{value.element}{len(value.shape)}"
    return tuple(kind_of(one) for one in value)


def flat(kind: Kind) -> list[str]:
    """The LLVM types that make up a value of this type."""
    if isinstance(kind, tuple):
        return [text for one in kind for text in flat(one)]
    if kind == "c":
        return ["double", "double"]
    if kind not in LLVM and len(kind) == 1:
        raise CompileError(f"no number of type '{kind}' in a kernel")
    return [LLVM[kind]] if len(kind) == 1 else ["ptr"] + ["i64"] * int(kind[1:])


def parts(value: Value) -> list[str]:
    """The registers that make up a value, in the order of `flat`."""
    if isinstance(value, Scalar):
        return [value.text]
    if isinstance(value, Complex):
        return [value.real, value.imaginary]
    if isinstance(value, Block):
        return [value.data, *value.shape]
    return [text for one in value for text in parts(one)]


def rebuilt(kind: Kind, registers: list[str]) -> Value:
    """The value of a type from its registers."""
    if isinstance(kind, tuple):
        found = []
        for one in kind:
            size = len(flat(one))
            found.append(rebuilt(one, registers[:size]))
            registers = registers[size:]
        return tuple(found)
    if kind == "c":
        return Complex(registers[0], registers[1])
    if len(kind) == 1:
        return Scalar(kind, registers[0])
    return Block(kind[0], registers[0], tuple(registers[1:]))
