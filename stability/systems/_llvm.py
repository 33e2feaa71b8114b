"""LLVM IR text for a straight-line program (compiled by _machine.py).

One C function per program, the loop over the points inside:

    void f(int64 N, const double *phase, const double *X, const double *P, int64 pstride, <inputs>, <outputs>)

with X (N, n), inputs (N, n + m) and three or more outputs, row-major per point; parameters of point k at P + k*pstride
(pstride 0: shared). Arrays that the program does not read may be null. All inputs of a point are read before its
outputs are written. No fast-math flags anywhere: NaN stays NaN, and the order of operations is the expression's.

Elementary functions are calls into the C mathematics library under an own prefix (`stability_sin`, ...). Integer powers
up to 64 are products by repeated squaring, half-integer ones a product with a square root, all others calls of `pow`.
Equal subexpressions, and equal operations, are computed once.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

import sympy as sp

from ..errors import CompileError
from ._llvm_tables import number, table_function
from ._program import Program
from .tables import Table, TableFunction

__all__ = ["LIBRARY_FUNCTIONS", "OUTPUTS", "SUPPORTED", "TWO_ARGUMENTS", "emit"]

LIBRARY_FUNCTIONS = {
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan", "atan2": "atan2",
    "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "asinh": "asinh", "acosh": "acosh", "atanh": "atanh",
    "exp": "exp", "log": "log", "floor": "floor", "ceiling": "ceil",
}  # fmt: skip
TWO_ARGUMENTS = ("atan2", "pow", "fmod")
RECIPROCALS = {"sec": sp.cos, "csc": sp.sin, "cot": sp.tan, "sech": sp.cosh, "csch": sp.sinh, "coth": sp.tanh}
COMPARISONS = {
    "StrictLessThan": "olt",
    "LessThan": "ole",
    "StrictGreaterThan": "ogt",
    "GreaterThan": "oge",
    "Equality": "oeq",
    "Unequality": "une",
}
MAX_PRODUCT_POWER = 64
OUTPUTS = 3  # the least number of output arguments: F, FJ and FJP have one C signature
CONNECTIVES = ("And", "Or", "Not", "ITE")
Register = str


def pointer_type() -> str:
    """How this LLVM writes a pointer to doubles."""
    import llvmlite.binding as llvm

    return "double*" if llvm.llvm_version_info[0] < 17 else "ptr"


def emit(program: Program) -> str:
    """LLVM IR text of a program; CompileError names a function it does not know."""
    return _Emitter(program).module()


class _Emitter:
    """Writes one basic block; equal subexpressions are computed once (memo by expression)."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.pointer = pointer_type()
        self.lines: list[str] = []
        self.count = 0
        self.memo: dict[Any, Register] = {}
        self.operations: dict[str, Register] = {}
        self.library: set[str] = set()
        self.tables: dict[Table, str] = {}
        self.inputs: dict[sp.Symbol, tuple[str, int]] = {program.phase: ("phase", 0)}
        blocks = [("X", program.states), ("P", program.parameters)]
        blocks += [(f"V{k}", block) for k, block in enumerate(program.directions)]
        for name, block in blocks:
            self.inputs.update({symbol: (name, offset) for offset, symbol in enumerate(block)})
        self.strides = {name: str(len(block)) for name, block in blocks} | {"phase": "1", "P": "%pstride"}

    # --- the module

    def module(self) -> str:
        program, p = self.program, self.pointer
        for symbol, expression in program.assignments:
            self.memo[symbol] = self.value(expression)
        registers = [[self.value(e) for e in block] for block in program.results]
        for k, block in enumerate(registers):
            base = self.base(f"Y{k}", str(len(block)))
            for offset, register in enumerate(block):
                self.lines.append(f"store double {register}, {p} {self.element(base, offset)}")
        arguments = [f"i64 %N, {p} %phase, {p} %X, {p} %P, i64 %pstride"]
        arguments += [f"{p} %V{k}" for k in range(len(program.directions))]
        arguments += [f"{p} %Y{k}" for k in range(max(len(program.results), OUTPUTS))]
        body = "\n  ".join(self.lines)
        declared = ["declare double @llvm.sqrt.f64(double)", "declare double @llvm.fabs.f64(double)"]
        for name in sorted(self.library):
            kinds = "double, double" if name in TWO_ARGUMENTS else "double"
            declared.append(f"declare double @stability_{name}({kinds})")
        helpers = [table_function(table, name, p) for table, name in self.tables.items()]
        attributes = '"no-stack-arg-probe"' if sys.platform == "win32" else "nounwind"
        return (
            "\n".join([*declared, *helpers])
            + f"""
define void @evaluate({", ".join(arguments)}) {attributes} {{
entry:
  %some = icmp sgt i64 %N, 0
  br i1 %some, label %point, label %done
point:
  %i = phi i64 [0, %entry], [%next, %point]
  {body}
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, %N
  br i1 %more, label %point, label %done
done:
  ret void
}}
"""
        )

    # --- single operations

    def line(self, operation: str) -> Register:
        known = self.operations.get(operation)
        if known is None:
            known = self.operations[operation] = f"%r{self.count}"
            self.count += 1
            self.lines.append(f"{known} = {operation}")
        return known

    def base(self, array: str, stride: str) -> Register:
        offset = self.line(f"mul i64 %i, {stride}")
        return self.line(f"getelementptr double, {self.pointer} %{array}, i64 {offset}")

    def element(self, base: Register, offset: int) -> Register:
        return self.line(f"getelementptr double, {self.pointer} {base}, i64 {offset}")

    def binary(self, operation: str, a: Register, b: Register) -> Register:
        return self.line(f"{operation} double {a}, {b}")

    def select(self, condition: Register, a: Register, b: Register) -> Register:
        return self.line(f"select i1 {condition}, double {a}, double {b}")

    def compare(self, how: str, a: Register, b: Register) -> Register:
        return self.line(f"fcmp {how} double {a}, {b}")

    def intrinsic(self, name: str, a: Register) -> Register:
        return self.line(f"call double @llvm.{name}.f64(double {a})")

    def called(self, name: str, *arguments: Register) -> Register:
        self.library.add(name)
        return self.line(f"call double @stability_{name}({', '.join(f'double {a}' for a in arguments)})")

    # --- expressions

    def value(self, node: sp.Basic) -> Register:
        known = self.memo.get(node)
        if known is None:
            known = self.memo[node] = self._value(node)
        return known

    def _value(self, node: sp.Basic) -> Register:
        if node.is_Symbol:
            array, offset = self.inputs[node]
            element = self.element(self.base(array, self.strides[array]), offset)
            return self.line(f"load double, {self.pointer} {element}")
        if not node.args:
            return number(constant(node))
        if isinstance(node, TableFunction):
            name = self.tables.setdefault(node.table, f"table_{len(self.tables)}")
            return self.line(f"call double @{name}(double {self.value(node.args[0])})")
        name = type(node).__name__
        if name in LIBRARY_FUNCTIONS:
            return self.called(LIBRARY_FUNCTIONS[name], *(self.value(a) for a in node.args))
        if name in RECIPROCALS:
            return self.value(1 / RECIPROCALS[name](node.args[0]))
        rule = getattr(self, f"emit_{name}", None)
        if rule is None:
            raise CompileError(f"'{name}' has no machine code; use backend='lambdify', elementary functions or a Table")
        return str(rule(node))

    def emit_Add(self, node: sp.Add) -> Register:
        total: Register | None = None
        for term in node.args:
            coefficient = term.as_coeff_Mul()[0]
            negative = total is not None and coefficient.is_Number and coefficient.is_negative
            register = self.value(-term if negative else term)
            if total is None:
                total = register
            else:
                total = self.binary("fsub" if negative else "fadd", total, register)
        assert total is not None
        return total

    def emit_Mul(self, node: sp.Mul) -> Register:
        above: list[Register] = []
        below: list[Register] = []
        negative = False
        for factor in node.args:
            if factor is sp.S.NegativeOne:
                negative = True
            elif factor.is_Rational and not factor.is_Integer and factor.is_finite:
                if factor.p != 1:
                    above.append(number(float(factor.p)))
                below.append(number(float(factor.q)))
            elif isinstance(factor, sp.Pow) and factor.exp.is_Number and factor.exp.is_negative:
                below.append(self.value(factor.base ** (-factor.exp)))
            else:
                above.append(self.value(factor))
        product = self.product(above) if above else number(1.0)
        if below:
            product = self.binary("fdiv", product, self.product(below))
        return self.line(f"fneg double {product}") if negative else product

    def product(self, factors: Sequence[Register]) -> Register:
        result = factors[0]
        for factor in factors[1:]:
            result = self.binary("fmul", result, factor)
        return result

    def emit_Pow(self, node: sp.Pow) -> Register:
        base, exponent = node.args
        if exponent.is_Number and exponent.is_negative:
            return self.binary("fdiv", number(1.0), self.value(base ** (-exponent)))
        register = self.value(base)
        if exponent.is_Number and abs(exponent) <= MAX_PRODUCT_POWER:
            doubled = 2.0 * float(exponent)
            if doubled == int(doubled):
                whole, half = divmod(int(doubled), 2)
                parts = [self.intrinsic("sqrt", register)] if half else []
                return self.product([*parts, self.whole_power(register, whole)] if whole else parts)
        return self.called("pow", register, self.value(exponent))

    def whole_power(self, register: Register, exponent: int) -> Register:
        if exponent == 1:
            return register
        half = self.whole_power(register, exponent // 2)
        square = self.binary("fmul", half, half)
        return self.binary("fmul", square, register) if exponent % 2 else square

    def emit_Abs(self, node: sp.Abs) -> Register:
        return self.intrinsic("fabs", self.value(node.args[0]))

    def emit_sign(self, node: sp.sign) -> Register:
        return self.three_way(self.value(node.args[0]), -1.0, 0.0, 1.0)

    def emit_Heaviside(self, node: sp.Heaviside) -> Register:
        argument = self.value(node.args[0])
        return self.three_way(argument, 0.0, self.value(node.args[1]), 1.0)

    def three_way(self, argument: Register, below: float, at: float | Register, above: float) -> Register:
        """below, at or above for argument < 0, == 0, > 0; NaN stays NaN."""
        zero = number(0.0)
        middle = at if isinstance(at, str) else number(at)
        result = self.select(self.compare("oeq", argument, zero), middle, argument)
        result = self.select(self.compare("olt", argument, zero), number(below), result)
        return self.select(self.compare("ogt", argument, zero), number(above), result)

    def emit_Max(self, node: sp.Max) -> Register:
        return self.extreme("ogt", node)

    def emit_Min(self, node: sp.Min) -> Register:
        return self.extreme("olt", node)

    def extreme(self, how: str, node: sp.Expr) -> Register:
        """Like numpy's maximum and minimum: a NaN among the arguments is the result."""
        result = self.value(node.args[0])
        for argument in node.args[1:]:
            other = self.value(argument)
            chosen = self.select(self.compare(how, result, other), result, other)
            result = self.select(self.compare("uno", result, other), self.binary("fadd", result, other), chosen)
        return result

    def emit_Mod(self, node: sp.Mod) -> Register:
        """The remainder with the sign of the divisor, as Python's and numpy's."""
        divisor = self.value(node.args[1])
        rest = self.called("fmod", self.value(node.args[0]), divisor)
        zero = number(0.0)
        opposite = self.line(f"xor i1 {self.compare('olt', rest, zero)}, {self.compare('olt', divisor, zero)}")
        wrong = self.line(f"and i1 {opposite}, {self.compare('one', rest, zero)}")
        return self.select(wrong, self.binary("fadd", rest, divisor), rest)

    def emit_frac(self, node: sp.Expr) -> Register:
        argument = self.value(node.args[0])
        return self.binary("fsub", argument, self.called("floor", argument))

    def emit_PowerLog(self, node: sp.Expr) -> Register:
        base, exponent, count = node.args
        power = self.called("pow", self.value(base), self.value(exponent))
        product = self.binary("fmul", power, self.value(sp.log(base) ** count))
        at_zero = self.compare("oeq", self.value(base), number(0.0))
        limit = self.line(f"and i1 {at_zero}, {self.compare('ogt', self.value(exponent), number(0.0))}")
        return self.select(limit, number(0.0), product)

    def emit_Piecewise(self, node: sp.Piecewise) -> Register:
        result = number(math.nan)
        for value, condition in reversed(node.args):
            if condition == sp.true:
                result = self.value(value)
            else:
                result = self.select(self.condition(condition), self.value(value), result)
        return result

    # --- conditions

    def condition(self, node: sp.Basic) -> Register:
        if node == sp.true or node == sp.false:
            return "true" if node == sp.true else "false"
        name = type(node).__name__
        if name in COMPARISONS:
            return self.compare(COMPARISONS[name], *(self.value(a) for a in node.args))
        parts = [self.condition(a) for a in node.args]
        if name == "Not":
            return self.line(f"xor i1 {parts[0]}, true")
        if name == "ITE":
            return self.line(f"select i1 {parts[0]}, i1 {parts[1]}, i1 {parts[2]}")
        if name not in ("And", "Or"):
            raise CompileError(f"the condition '{name}' has no machine code; use comparisons, And, Or, Not")
        result = parts[0]
        for part in parts[1:]:
            result = self.line(f"{name.lower()} i1 {result}, {part}")
        return result


SUPPORTED = frozenset(
    {*LIBRARY_FUNCTIONS, *RECIPROCALS, *COMPARISONS, *CONNECTIVES, "ExprCondPair", "TableFunction"}
    | {name.removeprefix("emit_") for name in vars(_Emitter) if name.startswith("emit_")}
)


def constant(node: sp.Basic) -> float:
    """A number without arguments (pi, 3, 1/2, oo, nan) as a double."""
    if node is sp.S.NaN or node is sp.S.ComplexInfinity:
        return math.nan
    if node is sp.S.ImaginaryUnit or not getattr(node, "is_number", False):
        raise CompileError(f"'{node}' is not a real number; equations of motion are real")
    return float(node)
