"""Expressions of the kernels' language as LLVM instructions.

An index is never negative and is not checked. The right sides of `and` and `or` and the sides of `a if c else b` are
computed only where Python computes them.
"""

from __future__ import annotations

import ast
from typing import Any

import numpy as np

from .arrays import Arrays
from .values import LLVM, Block, Complex, Scalar, Value, flat, kind_of, literal, parts, rebuilt

__all__ = ["Expressions"]

_FUNCTIONS = {"sqrt": "sqrt", "floor": "floor", "round": "roundeven", "rint": "roundeven", "exp": "exp", "sin": "sin",
              "cos": "cos"}  # fmt: skip
_ELEMENTS = {"np.int64": "i", "np.int32": "h", "np.bool_": "b", "bool": "b", "np.complex128": "c", "np.float64": "f"}


class Expressions(Arrays):
    """Writes instructions for expressions."""

    globals: dict[str, Any]
    names: dict[str, Any]

    # ------------------------------------------------------------------ what the function's translator supplies
    def variable(self, name: str) -> Value:
        """The value of a local variable."""
        raise NotImplementedError

    def constant(self, array: Any) -> Block:
        """A constant array of the module."""
        raise NotImplementedError

    def called(self, node: ast.Call) -> Value:
        """A call of another kernel, or of a field."""
        raise NotImplementedError

    def allocated(self, element: str, shape: list[Scalar], zero: bool) -> Block:
        """A new array that lives as long as the outermost kernel that can see it."""
        raise NotImplementedError

    def copied(self, array: Block) -> Block:
        """A copy of an array."""
        raise NotImplementedError

    # ------------------------------------------------------------------ expressions
    def expression(self, node: ast.expr) -> Value:
        """The value of any expression."""
        match node:
            case ast.Constant(value=complex() as number):
                return Complex(literal(number.real).text, literal(number.imag).text)
            case ast.Constant(value=bool() | int() | float() as number):
                return literal(number)
            case ast.Name(id=name):
                return self.variable(name) if name in self.names else self.outer(node, self.globals.get(name))
            case ast.Attribute(value=ast.Name(id="np"), attr=name) if name in ("inf", "nan", "pi"):
                return literal(float(getattr(np, name)))
            case ast.Attribute():
                return self.attribute(node)
            case ast.Tuple(elts=items):
                return tuple(self.expression(item) for item in items)
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
                return literal(-number)
            case ast.UnaryOp(op=ast.USub()):
                return self.negative(self.expression(node.operand))
            case ast.UnaryOp(op=ast.Not()):
                return Scalar("b", self.write(f"xor i1 {self.condition(node.operand)}, true"))
            case ast.BinOp(op=ast.Pow()):
                return self.power(node, self.scalar(node.left), node.right)
            case ast.BinOp():
                left = self.expression(node.left)
                return self.arithmetic(node, type(node.op).__name__, left, self.expression(node.right))
            case ast.Compare() | ast.BoolOp():
                return Scalar("b", self.condition(node))
            case ast.IfExp():
                return self.choice(node)
            case ast.Subscript():
                return self.element(node)
            case ast.Call():
                return self.call(node)
        raise self.refuse(node, "no such expression in a kernel")

    def outer(self, node: ast.expr, value: Any) -> Value:
        """A name of the module: a number or a constant array."""
        if isinstance(value, bool | int | float):
            return literal(value)
        if isinstance(value, np.ndarray):
            return self.constant(value)
        raise self.refuse(node, "not set in every case, or not a number or array of the module")

    def attribute(self, node: ast.Attribute) -> Value:
        """.shape of an array, .real and .imag of a number."""
        value = self.expression(node.value)
        if node.attr == "shape" and isinstance(value, Block):
            return tuple(Scalar("i", size) for size in value.shape)
        if node.attr in ("real", "imag") and isinstance(value, Complex):
            return Scalar("f", value.real if node.attr == "real" else value.imaginary)
        raise self.refuse(node, "no such attribute")

    # ------------------------------------------------------------------ truth
    def condition(self, node: ast.expr) -> str:
        """Register (i1) of a truth value."""
        if isinstance(node, ast.BoolOp):
            return self.connected(node)
        if isinstance(node, ast.Compare):
            return self.comparison(node)
        value = self.scalar(node)
        if value.kind == "i":
            return self.write(f"icmp ne i64 {value.text}, 0")
        if value.kind != "b":
            raise self.refuse(node, "a truth value is needed")
        return value.text

    def connected(self, node: ast.BoolOp) -> str:
        """`and`, `or`."""
        result, after = self.slot("i1"), self.new("L")
        for number, part in enumerate(node.values):
            value = self.condition(part)
            self.lines.append(f"  store i1 {value}, ptr {result}")
            if number < len(node.values) - 1:
                further = self.new("L")
                yes, no = (further, after) if isinstance(node.op, ast.And) else (after, further)
                self.lines += [f"  br i1 {value}, label %{yes}, label %{no}", f"{further}:"]
        self.label(after)
        return self.write(f"load i1, ptr {result}")

    def comparison(self, node: ast.Compare) -> str:
        """a < b < c, and membership in a tuple that is written out."""
        left, found = self.expression(node.left), ""
        for operation, item in zip(node.ops, node.comparators):
            if isinstance(operation, ast.In | ast.NotIn) and isinstance(item, ast.Tuple):
                one = "false"
                for entry in item.elts:
                    same = self.compared(node, "Eq", left, self.expression(entry))
                    one = self.write(f"or i1 {one}, {same}")
                one = self.write(f"xor i1 {one}, true") if isinstance(operation, ast.NotIn) else one
            else:
                right = self.expression(item)
                one = self.compared(node, type(operation).__name__, left, right)
                left = right
            found = self.write(f"and i1 {found}, {one}") if found else one
        return found

    def choice(self, node: ast.IfExp) -> Value:
        """a if condition else b, of numbers or tuples of numbers."""
        condition = self.condition(node.test)
        first, second, after = self.new("L"), self.new("L"), self.new("L")
        self.lines += [f"  br i1 {condition}, label %{first}, label %{second}", f"{first}:"]
        yes = self.expression(node.body)
        mark = len(self.lines)
        self.lines += [f"  br label %{after}", f"{second}:"]
        no = self.expression(node.orelse)
        pairs = list(zip(yes, no)) if isinstance(yes, tuple) and isinstance(no, tuple) else [(yes, no)]
        results = []
        for a, b in pairs:
            kind = self.common(a, b, node)
            slots = [self.slot(llvm) for llvm in flat(kind)]
            results.append((kind, slots))
            self.put(self.number_as(b, kind, node), slots)
            kept, self.lines = self.lines, []  # what the first side needs goes before its end
            self.put(self.number_as(a, kind, node), slots)
            kept[mark:mark], mark = self.lines, mark + len(self.lines)
            self.lines = kept
        self.label(after)
        found = tuple(self.got(kind, slots) for kind, slots in results)
        return found if isinstance(yes, tuple) else found[0]

    def put(self, value: Value, slots: list[str]) -> None:
        """Store the registers of a value in stack slots."""
        for llvm, slot, register in zip(flat(kind_of(value)), slots, parts(value)):
            self.lines.append(f"  store {llvm} {register}, ptr {slot}")

    def got(self, kind: Any, slots: list[str]) -> Value:
        """The value in stack slots."""
        return rebuilt(kind, [self.write(f"load {llvm}, ptr {slot}") for llvm, slot in zip(flat(kind), slots)])

    # ------------------------------------------------------------------ calls
    def call(self, node: ast.Call) -> Value:
        """Calls of built-in functions and methods; `called` does the rest."""
        match node.func:
            case ast.Name(id="abs"):
                return self.absolute(self.expression(node.args[0]), node)
            case ast.Name(id="min" | "max" as name):
                return self.extreme(node, name)
            case ast.Name(id="len"):
                return Scalar("i", self.block(node.args[0]).shape[0])
            case ast.Name(id="float"):
                return self.converted(self.scalar(node.args[0]), "f", node)
            case ast.Attribute(value=ast.Name(id="np"), attr="empty" | "zeros" as name):
                word = ast.unparse(node.args[1]) if len(node.args) > 1 else "np.float64"
                if word not in _ELEMENTS:
                    raise self.refuse(node, "no such type of array")
                return self.allocated(_ELEMENTS[word], self.sizes(node.args[0]), name == "zeros")
            case ast.Attribute(value=ast.Name(id="np"), attr=name) if name in _FUNCTIONS:
                x = self.expression(node.args[0])
                if isinstance(x, Complex) and name == "exp":
                    return self.exponential(x)
                return Scalar("f", self.function(_FUNCTIONS[name], self.converted(x, "f", node).text))
            case ast.Attribute(value=owner, attr="copy"):
                return self.copied(self.block(owner))
            case ast.Attribute(value=owner, attr="reshape"):
                array = self.block(owner)
                sizes = self.sizes(node.args[0] if len(node.args) == 1 else ast.Tuple(node.args, ast.Load()))
                return self.reshaped(array, sizes)
            case ast.Attribute(value=owner, attr="view") if ast.unparse(node.args[0]) == "np.float64":
                return self.floats(self.block(owner), node)
        return self.called(node)

    def sizes(self, node: ast.expr) -> list[Scalar]:
        """The sizes of a shape: an integer or a tuple of them."""
        value = self.expression(node)
        return [self.converted(one, "i", node) for one in (value if isinstance(value, tuple) else (value,))]

    def extreme(self, node: ast.Call, name: str) -> Scalar:
        """min and max: the later argument only where it is strictly beyond, as in Python."""
        best = self.scalar(node.args[0])
        for item in node.args[1:]:
            best, other = self.matched(node, best, self.scalar(item))
            beyond = self.compared(node, "Lt" if name == "min" else "Gt", other, best)
            kind = LLVM[best.kind]
            best = Scalar(best.kind, self.write(f"select i1 {beyond}, {kind} {other.text}, {kind} {best.text}"))
        return best
