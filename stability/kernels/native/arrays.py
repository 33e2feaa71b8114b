"""Arrays of the kernels' language: elements, rows, leading slices, and the same memory seen in another shape."""

from __future__ import annotations

import ast

from .scalars import Scalars
from .values import ELEMENT, WIDTH, Block, Complex, Scalar, Value

__all__ = ["Arrays"]

_TAGS = {"f": "!1", "c": "!1", "i": "!2", "b": "!3", "h": "!4"}


class Arrays(Scalars):
    """Writes instructions that address, read and write memory."""

    def block(self, node: ast.expr) -> Block:
        """An expression that must be an array."""
        value = self.expression(node)
        if not isinstance(value, Block):
            raise self.refuse(node, "an array is needed")
        return value

    def place(self, array: Block, indices: list[str]) -> str:
        """Pointer to [indices]; missing indices are zero."""
        total = indices[0]
        for k in range(1, len(array.shape)):
            total = self.write(f"mul nsw i64 {total}, {array.shape[k]}")
            if k < len(indices):
                total = self.write(f"add nsw i64 {total}, {indices[k]}")
        element = "[2 x double]" if array.element == "c" else ELEMENT[array.element]
        return self.write(f"getelementptr inbounds {element}, ptr {array.data}, i64 {total}")

    def imaginary_place(self, pointer: str) -> str:
        """Pointer to the imaginary part behind a real one."""
        return self.write(f"getelementptr inbounds double, ptr {pointer}, i64 1")

    def loaded(self, element: str, pointer: str) -> Value:
        """The number at a pointer."""
        if element == "c":
            real = self.write(f"load double, ptr {pointer}, align 8, !tbaa !1")
            behind = self.imaginary_place(pointer)
            return Complex(real, self.write(f"load double, ptr {behind}, align 8, !tbaa !1"))
        text = self.write(f"load {ELEMENT[element]}, ptr {pointer}, align {WIDTH[element]}, !tbaa {_TAGS[element]}")
        if element == "b":
            return Scalar("b", self.write(f"icmp ne i8 {text}, 0"))
        if element == "h":
            return Scalar("i", self.write(f"sext i32 {text} to i64"))
        return Scalar(element, text)

    def stored(self, element: str, pointer: str, value: Value, node: ast.AST) -> None:
        """Write a number to a pointer."""
        if element == "c":
            number = self.as_complex(value, node)
            self.lines.append(f"  store double {number.real}, ptr {pointer}, align 8, !tbaa !1")
            behind = self.imaginary_place(pointer)
            self.lines.append(f"  store double {number.imaginary}, ptr {behind}, align 8, !tbaa !1")
            return
        text = self.converted(value, "i" if element == "h" else element, node).text
        if element in "bh":
            text = self.write(f"zext i1 {text} to i8" if element == "b" else f"trunc i64 {text} to i32")
        self.lines.append(
            f"  store {ELEMENT[element]} {text}, ptr {pointer}, align {WIDTH[element]}, !tbaa {_TAGS[element]}"
        )

    def indices(self, array: Block, node: ast.Subscript) -> tuple[list[str], ast.Slice | None]:
        """Registers of the indices of x[i, j, ...], and a slice behind them."""
        items = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        last = items[-1] if isinstance(items[-1], ast.Slice) else None
        items = items[: len(items) - (last is not None)]
        if len(items) + (last is not None) > len(array.shape):
            raise self.refuse(node, f"more indices than dimensions ({len(array.shape)})")
        if any(isinstance(item, ast.UnaryOp | ast.Slice) for item in items) or (last is not None and last.step):
            raise self.refuse(node, "no negative indices, and one slice, without a step, as the last index")
        return [self.integer(item) for item in items], last

    def element(self, node: ast.Subscript) -> Value:
        """x[i, j]: a number; x[i] of a matrix: its row; x[a:b]: rows a .. b - 1; t[0]: an entry of a tuple."""
        whole = self.expression(node.value)
        if isinstance(whole, tuple):
            index = node.slice.value if isinstance(node.slice, ast.Constant) else None
            if isinstance(index, int) and index < len(whole):
                return whole[index]
            raise self.refuse(node, f"an index from 0 to {len(whole) - 1} is needed")
        if not isinstance(whole, Block):
            raise self.refuse(node, "an array is needed")
        found, cut = self.indices(whole, node)
        if cut is not None:
            return self.slice(whole, found, cut)
        pointer = self.place(whole, found)
        if len(found) == len(whole.shape):
            return self.loaded(whole.element, pointer)
        return Block(whole.element, pointer, whole.shape[len(found) :])

    def slice(self, array: Block, found: list[str], cut: ast.Slice) -> Block:
        """x[i, a:b]."""
        size = array.shape[len(found)]
        start = self.integer(cut.lower) if cut.lower else "0"
        stop = self.integer(cut.upper) if cut.upper else size
        length = self.write(f"sub nsw i64 {stop}, {start}")
        return Block(array.element, self.place(array, [*found, start]), (length, *array.shape[len(found) + 1 :]))

    def total(self, array: Block) -> str:
        """Number of elements."""
        total = array.shape[0]
        for size in array.shape[1:]:
            total = self.write(f"mul nsw i64 {total}, {size}")
        return total

    def reshaped(self, array: Block, shape: list[Scalar]) -> Block:
        """The same memory in another shape; the sizes are not checked."""
        return Block(array.element, array.data, tuple(one.text for one in shape))

    def floats(self, array: Block, node: ast.AST) -> Block:
        """A complex array as the floats it consists of: the last dimension is twice as long."""
        if array.element != "c":
            raise self.refuse(node, "a complex array is needed")
        return Block("f", array.data, (*array.shape[:-1], self.write(f"mul nsw i64 {array.shape[-1]}, 2")))
