"""Numbers of the kernels' language: arithmetic, comparison, conversion.

Semantics are Python's, with two exceptions that numerical loops want: integers are 64 bits wide, and 1/0 is inf or
nan. No fast-math flag anywhere: operations are neither reordered nor fused, so that a kernel run as plain Python gives
the same bits.
"""

from __future__ import annotations

import ast

from ...errors import CompileError
from .values import LLVM, Complex, Scalar, Value, literal

__all__ = ["Scalars"]

_ARITHMETIC = {"Add": ("add nsw", "fadd"), "Sub": ("sub nsw", "fsub"), "Mult": ("mul nsw", "fmul")}
_COMPARISON = {
    "Lt": ("slt", "olt"), "LtE": ("sle", "ole"), "Gt": ("sgt", "ogt"), "GtE": ("sge", "oge"), "Eq": ("eq", "oeq"),
    "NotEq": ("ne", "une"),
}  # fmt: skip


class Scalars:
    """Writes instructions for numbers; `lines` are those of the function so far, `entry` its stack slots."""

    where: str

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.entry: list[str] = []
        self.count = 0

    # ------------------------------------------------------------------ writing
    def expression(self, node: ast.expr) -> Value:
        """The value of any expression."""
        raise NotImplementedError

    def refuse(self, node: ast.AST, why: str) -> CompileError:
        """The error for something the language does not have."""
        return CompileError(f"kernel {self.where}, line {getattr(node, 'lineno', '?')}: {why}: '{ast.unparse(node)}'")

    def new(self, stem: str = "r") -> str:
        """A fresh register or label."""
        self.count += 1
        return f"{stem}{self.count}"

    def write(self, instruction: str) -> str:
        """An instruction with a result; returns its register."""
        register = f"%{self.new()}"
        self.lines.append(f"  {register} = {instruction}")
        return register

    def label(self, name: str) -> None:
        """Begin a basic block; falls into it from the one before."""
        self.lines += [f"  br label %{name}", f"{name}:"]

    def slot(self, kind: str) -> str:
        """A place on the stack (a register after optimisation)."""
        name = f"%{self.new('s')}"
        self.entry.append(f"  {name} = alloca {kind}")
        return name

    # ------------------------------------------------------------------ conversion
    def scalar(self, node: ast.expr) -> Scalar:
        """An expression that must be a real number."""
        value = self.expression(node)
        if not isinstance(value, Scalar):
            raise self.refuse(node, "a real number is needed")
        return value

    def integer(self, node: ast.expr) -> str:
        """Register of an expression that must be an integer."""
        return self.converted(self.scalar(node), "i", node).text

    def converted(self, value: Value, kind: str, node: ast.AST) -> Scalar:
        """The same number as another real type: integers become floats where a float is wanted, nothing else."""
        if isinstance(value, Scalar) and value.kind == kind:
            return value
        if isinstance(value, Scalar) and (value.kind, kind) == ("i", "f"):
            if value.text.lstrip("-").isdigit():
                return literal(float(value.text))
            return Scalar("f", self.write(f"sitofp i64 {value.text} to double"))
        raise self.refuse(node, f"a number of type {kind} is needed")

    def as_complex(self, value: Value, node: ast.AST) -> Complex:
        """A number as a complex one."""
        if isinstance(value, Complex):
            return value
        return Complex(self.converted(value, "f", node).text, literal(0.0).text)

    def number_as(self, value: Value, kind: str, node: ast.AST) -> Value:
        """A number as one of type `kind`."""
        return self.as_complex(value, node) if kind == "c" else self.converted(value, kind, node)

    def common(self, a: Value, b: Value, node: ast.AST) -> str:
        """The type that holds two numbers."""
        kinds = {"c" if isinstance(one, Complex) else one.kind if isinstance(one, Scalar) else "" for one in (a, b)}
        if "" in kinds:
            raise self.refuse(node, "numbers are needed")
        return "c" if "c" in kinds else "f" if "f" in kinds else kinds.pop()

    def matched(self, node: ast.AST, a: Value, b: Value) -> tuple[Scalar, Scalar]:
        """Two real numbers of one type."""
        kind = self.common(a, b, node)
        return self.converted(a, kind, node), self.converted(b, kind, node)

    # ------------------------------------------------------------------ arithmetic
    def arithmetic(self, node: ast.AST, operation: str, left: Value, right: Value) -> Value:
        """left (operation) right, but for powers."""
        if isinstance(left, Complex) or isinstance(right, Complex):
            return self.complex_arithmetic(node, operation, left, right)
        if operation == "Div":
            left, right = self.converted(left, "f", node), self.converted(right, "f", node)
            return Scalar("f", self.write(f"fdiv double {left.text}, {right.text}"))
        a, b = self.matched(node, left, right)
        if operation in _ARITHMETIC and a.kind != "b":
            verb = _ARITHMETIC[operation][a.kind == "f"]
            return Scalar(a.kind, self.write(f"{verb} {LLVM[a.kind]} {a.text}, {b.text}"))
        if operation in ("FloorDiv", "Mod") and a.kind == "i":
            return self.floored(operation, a.text, b.text)
        raise self.refuse(node, "no such operation on these types")

    def floored(self, operation: str, a: str, b: str) -> Scalar:
        """Integer // and %, rounded down as Python does."""
        quotient, rest = self.write(f"sdiv i64 {a}, {b}"), self.write(f"srem i64 {a}, {b}")
        signs = self.write(f"xor i64 {rest}, {b}")
        opposite, some = self.write(f"icmp slt i64 {signs}, 0"), self.write(f"icmp ne i64 {rest}, 0")
        below = self.write(f"and i1 {opposite}, {some}")
        if operation == "Mod":
            shift = self.write(f"select i1 {below}, i64 {b}, i64 0")
            return Scalar("i", self.write(f"add nsw i64 {rest}, {shift}"))
        return Scalar("i", self.write(f"sub nsw i64 {quotient}, {self.write(f'zext i1 {below} to i64')}"))

    def power(self, node: ast.AST, base: Scalar, exponent: ast.expr) -> Scalar:
        """x ** 2, 3, 4 by products; every other one by the C library's pow."""
        if isinstance(exponent, ast.Constant) and exponent.value in (2, 3, 4) and isinstance(exponent.value, int):
            verb = "fmul double" if base.kind == "f" else "mul nsw i64"
            square = self.write(f"{verb} {base.text}, {base.text}")
            if exponent.value == 2:
                return Scalar(base.kind, square)
            return Scalar(base.kind, self.write(f"{verb} {square}, {base.text if exponent.value == 3 else square}"))
        x, y = self.converted(base, "f", node), self.converted(self.scalar(exponent), "f", node)
        return Scalar("f", self.write(f"call double @llvm.pow.f64(double {x.text}, double {y.text})"))

    def negative(self, value: Value) -> Value:
        """-value."""
        if isinstance(value, Complex):
            return Complex(self.write(f"fneg double {value.real}"), self.write(f"fneg double {value.imaginary}"))
        assert isinstance(value, Scalar)
        if value.kind == "f":
            return Scalar("f", self.write(f"fneg double {value.text}"))
        return Scalar("i", self.write(f"sub nsw i64 0, {value.text}"))

    def absolute(self, value: Value, node: ast.AST) -> Scalar:
        """|x|."""
        if isinstance(value, Complex):
            return Scalar("f", self.write(f"call double @hypot(double {value.real}, double {value.imaginary})"))
        if isinstance(value, Scalar) and value.kind == "i":
            return Scalar("i", self.write(f"call i64 @llvm.abs.i64(i64 {value.text}, i1 true)"))
        return Scalar("f", self.function("fabs", self.converted(value, "f", node).text))

    def function(self, name: str, x: str) -> str:
        """An elementary function of a float."""
        return self.write(f"call double @llvm.{name}.f64(double {x})")

    def compared(self, node: ast.AST, operation: str, left: Value, right: Value) -> str:
        """Register of one comparison."""
        a, b = self.matched(node, left, right)
        verb = _COMPARISON[operation][a.kind == "f"]
        return self.write(f"{'fcmp' if a.kind == 'f' else 'icmp'} {verb} {LLVM[a.kind]} {a.text}, {b.text}")

    # ------------------------------------------------------------------ complex numbers
    def complex_arithmetic(self, node: ast.AST, operation: str, left: Value, right: Value) -> Complex:
        """left (operation) right where at least one is complex; a real factor scales both parts."""
        if operation == "Mult" and (isinstance(left, Scalar) or isinstance(right, Scalar)):
            number, factor = (right, left) if isinstance(left, Scalar) else (left, right)
            assert isinstance(number, Complex)
            f = self.converted(factor, "f", node).text
            return Complex(self.float("fmul", number.real, f), self.float("fmul", number.imaginary, f))
        a, b = self.as_complex(left, node), self.as_complex(right, node)
        if operation in ("Add", "Sub"):
            verb = _ARITHMETIC[operation][1]
            return Complex(self.float(verb, a.real, b.real), self.float(verb, a.imaginary, b.imaginary))
        if operation == "Mult":
            real = self.float("fsub", self.float("fmul", a.real, b.real), self.float("fmul", a.imaginary, b.imaginary))
            other = self.float("fadd", self.float("fmul", a.real, b.imaginary), self.float("fmul", a.imaginary, b.real))
            return Complex(real, other)
        if operation == "Div":
            return self.quotient(a, b)
        raise self.refuse(node, "no such operation on complex numbers")

    def float(self, verb: str, a: str, b: str) -> str:
        """One operation on two floats."""
        return self.write(f"{verb} double {a}, {b}")

    def quotient(self, a: Complex, b: Complex) -> Complex:
        """a / b without overflow, by the ratio of the smaller part of b to the larger one (Smith, 1962)."""
        first = self.write(f"fcmp oge double {self.function('fabs', b.real)}, {self.function('fabs', b.imaginary)}")

        def either(x: str, y: str) -> str:
            return self.write(f"select i1 {first}, double {x}, double {y}")

        large, small = either(b.real, b.imaginary), either(b.imaginary, b.real)
        ratio = self.float("fdiv", small, large)
        below = self.float("fadd", large, self.float("fmul", small, ratio))
        real = self.float("fadd", either(a.real, a.imaginary), self.float("fmul", either(a.imaginary, a.real), ratio))
        direct = self.float("fsub", a.imaginary, self.float("fmul", a.real, ratio))
        turned = self.float("fsub", self.float("fmul", a.imaginary, ratio), a.real)
        return Complex(self.float("fdiv", real, below), self.float("fdiv", either(direct, turned), below))

    def exponential(self, z: Complex) -> Complex:
        """exp(x + iy) = exp(x) (cos y + i sin y)."""
        size, cosine, sine = self.function("exp", z.real), *(self.function(f, z.imaginary) for f in ("cos", "sin"))
        return Complex(self.float("fmul", size, cosine), self.float("fmul", size, sine))
