"""From a kernel's Python source to the LLVM module of it and of the helpers that it calls.

One module per kernel. A helper (`inline`) is translated into the module of each kernel that uses it, for the types of
that call; a kernel called by another one is compiled by itself and called through a table of addresses that the loader
fills, together with the few functions of Python that the border needs: machine code with nothing left to be resolved
can be kept on disk.

Memory: arrays made inside live in a list that belongs to the outermost function whose results hold no array; it is
freed where that function ends.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from typing import Any

import numpy as np

from ...errors import CompileError
from .statements import Statements
from .values import ELEMENT, WIDTH, Block, Kind, Scalar, Value, flat, is_array, kind_of, literal, parts, rebuilt

__all__ = ["EXTERNAL", "Module", "source_of"]

# C functions that are called by their address (kernels/addresses.py): element types of arrays, i for an integer, and
# which of them are written to
EXTERNAL = {"call_field": ("ifffifff", (5, 6, 7)), "call_solver": ("hfhf", (0, 1, 2, 3))}
_HEAD = """declare double @llvm.sqrt.f64(double)
declare double @llvm.floor.f64(double)
declare double @llvm.roundeven.f64(double)
declare double @llvm.fabs.f64(double)
declare double @llvm.exp.f64(double)
declare double @llvm.sin.f64(double)
declare double @llvm.cos.f64(double)
declare double @llvm.pow.f64(double, double)
declare double @hypot(double, double)
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
declare i64 @llvm.abs.i64(i64, i1)

define internal noalias ptr @allocate(ptr %list, i64 %bytes) {
  %whole = add i64 %bytes, 16
  %slot = getelementptr ptr, ptr @table, i64 0
  %function = load ptr, ptr %slot
  %memory = call ptr %function(i64 %whole)
  %before = load ptr, ptr %list
  store ptr %before, ptr %memory
  store ptr %memory, ptr %list
  %data = getelementptr i8, ptr %memory, i64 16
  ret ptr %data
}

define internal void @release(ptr %list) {
  %slot = getelementptr ptr, ptr @table, i64 1
  %function = load ptr, ptr %slot
  br label %round
round:
  %memory = load ptr, ptr %list
  %none = icmp eq ptr %memory, null
  br i1 %none, label %done, label %more
more:
  %before = load ptr, ptr %memory
  store ptr %before, ptr %list
  call void %function(ptr %memory)
  br label %round
done:
  ret void
}
"""
_TAIL = """!0 = !{!"kernel"}
!1 = !{!5, !5, i64 0}
!2 = !{!6, !6, i64 0}
!3 = !{!7, !7, i64 0}
!4 = !{!8, !8, i64 0}
!5 = !{!"double", !0}
!6 = !{!"integer", !0}
!7 = !{!"bool", !0}
!8 = !{!"short integer", !0}
"""


def source_of(function: Any) -> ast.FunctionDef:
    """The syntax tree of a kernel."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise CompileError(f"'{function.__name__}' is not a plain function")
    return tree


class Module:
    """The LLVM module of one kernel; `others` are the kernels it calls, in the order of the table behind `reserved`."""

    def __init__(self, reserved: int) -> None:
        self.reserved = reserved
        self.others: list[Any] = []
        self.constants: dict[int, tuple[str, Any]] = {}
        self.functions: dict[tuple[Any, ...], tuple[str, tuple[Kind, ...]]] = {}
        self.texts: list[str] = []

    def text(self, *more: str) -> str:
        """The module as LLVM assembly."""
        size = self.reserved + len(self.others)
        table = f"@table = internal global [{size} x ptr] zeroinitializer"
        filling = (
            f"define void @fill(ptr %from) {{\n"
            f"  call void @llvm.memcpy.p0.p0.i64(ptr @table, ptr %from, i64 {8 * size}, i1 false)\n  ret void\n}}\n"
        )
        constants = [self._constant(name, array) for name, array in self.constants.values()]
        return "\n".join([table, *constants, _HEAD, filling, *self.texts, *more, _TAIL])

    def _constant(self, name: str, array: Any) -> str:
        element = ELEMENT["i" if array.dtype.kind == "i" else "f"]
        entries = ", ".join(f"{element} {literal(one).text}" for one in array.ravel().tolist())
        return f"{name} = internal constant [{array.size} x {element}] [{entries}]"

    def constant(self, array: Any) -> Block:
        """A constant array."""
        if array.dtype not in (np.dtype(float), np.dtype(np.int64)):
            raise CompileError(f"a constant array of {array.dtype} in a kernel")
        name, _ = self.constants.setdefault(id(array), (f"@constant{len(self.constants)}", array))
        return Block("i" if array.dtype.kind == "i" else "f", name, tuple(str(size) for size in array.shape))

    def place_of(self, other: Any) -> int:
        """Position in the table of a kernel that is called."""
        if other not in self.others:
            self.others.append(other)
        return self.reserved + self.others.index(other)

    def function(
        self, kernel: Any, kinds: tuple[Kind, ...], results: tuple[Kind, ...] | None, name: str = ""
    ) -> tuple[str, tuple[Kind, ...]]:
        """(name, types of the results) of a kernel's or helper's code for arguments of these types."""
        key = (kernel, kinds)
        if key not in self.functions:
            label = name or f"helper{len(self.functions)}_{kernel.function.__name__}"
            self.functions[key] = label, ()
            body = _Function(self, kernel, kinds, results)
            self.texts.append(body.text(label, exported=bool(name)))
            self.functions[key] = label, body.results or ()
        return self.functions[key]


class _Function(Statements):
    """One function of the module."""

    def __init__(self, module: Module, kernel: Any, kinds: tuple[Kind, ...], results: tuple[Kind, ...] | None) -> None:
        super().__init__()
        self.module, self.results = module, results
        self.globals = kernel.function.__globals__
        self.where = f"{kernel.function.__module__}.{kernel.function.__name__}"
        self.tree = source_of(kernel.function)
        self.allocates = False
        names = [one.arg for one in self.tree.args.args]
        if len(names) != len(kinds):
            raise CompileError(f"kernel {self.where} takes {len(names)} arguments, not {len(kinds)}")
        self.header = ["ptr %list"]
        for number, (name, kind) in enumerate(zip(names, kinds)):
            registers = [f"%a{number}_{k}" for k in range(len(flat(kind)))]
            self.header += [f"{llvm} {register}" for llvm, register in zip(flat(kind), registers)]
            self.bind(name, rebuilt(kind, registers), self.tree)
        self.block_of(self.tree.body)

    def text(self, name: str, exported: bool) -> str:
        """The function as LLVM assembly."""
        results = self.results or ()
        types = flat(results)
        whole = f"{{ {', '.join(types)} }}" if types else "void"
        lines = ["  br label %leave", "leave:"]
        own = self.allocates and not any(map(is_array, results))
        if own:
            lines.append("  call void @release(ptr %own)")
        value = "undef"
        for k, (llvm, slot) in enumerate(zip(types, self.result_slots)):
            lines.append(f"  %out{k} = load {llvm}, ptr {slot}")
            lines.append(f"  %whole{k} = insertvalue {whole} {value}, {llvm} %out{k}, {k}")
            value = f"%whole{k}"
        lines.append(f"  ret {whole} {value}" if types else "  ret void")
        start = ["entry:", *self.entry]
        start += ["  %own = alloca ptr", "  store ptr null, ptr %own"] if own else []
        text = "\n".join([*start, *self.lines, *lines])
        if self.allocates:
            text = text.replace("%MEMORY", "%own" if own else "%list")
        # a helper with loops is optimised once, by itself, not again in each of its callers
        loops = any(isinstance(node, ast.For | ast.While) for node in ast.walk(self.tree))
        link, attributes = ("", "nounwind") if exported else ("internal ", "nounwind noinline" if loops else "nounwind")
        return f"define {link}{whole} @{name}({', '.join(self.header)}) {attributes} {{\n{text}\n}}\n"

    def constant(self, array: Any) -> Block:
        """A constant array of the module."""
        return self.module.constant(array)

    def allocated(self, element: str, shape: list[Scalar], zero: bool) -> Block:
        """np.empty, np.zeros."""
        self.allocates = True
        sizes = tuple(one.text for one in shape)
        data = self.write(f"call ptr @allocate(ptr %MEMORY, i64 {self.bytes(Block(element, '', sizes))})")
        block = Block(element, data, sizes)
        if zero:
            self.fill(block, literal({"i": 0, "h": 0, "b": False}.get(element, 0.0)), self.tree)
        return block

    def bytes(self, array: Block) -> str:
        """Size of an array in memory."""
        return self.write(f"mul nsw i64 {self.total(array)}, {WIDTH[array.element]}")

    def copied(self, array: Block) -> Block:
        """array.copy()."""
        new = self.allocated(array.element, [Scalar("i", size) for size in array.shape], False)
        size = self.bytes(array)
        self.lines.append(f"  call void @llvm.memcpy.p0.p0.i64(ptr {new.data}, ptr {array.data}, i64 {size}, i1 false)")
        return new

    def called(self, node: ast.Call) -> Value:
        """A field, a helper, or another kernel."""
        if not isinstance(node.func, ast.Name) or node.keywords:
            raise self.refuse(node, "no such function in a kernel")
        if node.func.id in EXTERNAL:
            return self.external(node, *EXTERNAL[node.func.id])
        kernel: Any = self.globals.get(node.func.id)
        if not hasattr(kernel, "inline"):
            raise self.refuse(node, "neither a kernel nor a built-in function")
        values = [self.expression(item) for item in node.args]
        if kernel.inline:
            kinds = tuple(kind_of(value) for value in values)
            name, results = self.module.function(kernel, kinds, None)
            target = f"@{name}"
        else:
            kinds, results = kernel.kinds, kernel.results
            if len(kinds) != len(values):
                raise self.refuse(node, f"{len(kinds)} arguments are needed")
            values = [self.argument(value, kind, node) for value, kind in zip(values, kinds)]
            slot = self.write(f"getelementptr ptr, ptr @table, i64 {self.module.place_of(kernel)}")
            target = self.write(f"load ptr, ptr {slot}")
        types = flat(kinds)
        self.allocates = self.allocates or any(map(is_array, results))
        memory = "ptr %MEMORY" if any(map(is_array, results)) else "ptr null"
        arguments = ", ".join([memory, *(f"{llvm} {one}" for llvm, one in zip(types, parts(tuple(values))))])
        return self.taken(f"{target}({arguments})", results)

    def taken(self, call: str, results: tuple[Kind, ...]) -> Value:
        """The results of a call."""
        types = flat(results)
        if not types:
            self.lines.append(f"  call void {call}")
            return ()
        whole = f"{{ {', '.join(types)} }}"
        value = self.write(f"call {whole} {call}")
        found = rebuilt(results, [self.write(f"extractvalue {whole} {value}, {k}") for k in range(len(types))])
        assert isinstance(found, tuple)
        return found[0] if len(found) == 1 else found

    def external(self, node: ast.Call, kinds: str, _: tuple[int, ...]) -> Value:
        """A C function at an address; arrays are passed by their pointers."""
        values = [self.expression(item) for item in node.args]
        if len(values) != len(kinds) + 1:
            raise self.refuse(node, f"{len(kinds) + 1} arguments are needed")
        pointer = self.write(f"inttoptr i64 {self.converted(values[0], 'i', node).text} to ptr")
        found = []
        for kind, value in zip(kinds, values[1:]):
            if kind == "i":
                found.append(f"i64 {self.converted(value, 'i', node).text}")
            elif isinstance(value, Block) and value.element == kind:
                found.append(f"ptr {value.data}")
            else:
                raise self.refuse(node, f"an array of type {kind} is needed")
        assert isinstance(node.func, ast.Name)
        if node.func.id == "call_solver":  # LAPACK takes everything by reference
            n, count, info = (self.write(f"getelementptr i32, {found[0]}, i64 {k}") for k in range(3))
            found = [f"ptr {n}", f"ptr {count}", found[1], f"ptr {n}", found[2], found[3], f"ptr {n}", f"ptr {info}"]
        self.lines.append(f"  call void {pointer}({', '.join(found)})")
        return ()
