"""The kinds of node an expression may have, and the one place where a node is built.

An expression of the library is a finite tree over real symbols. Its inner nodes are

    add, mul, pow, exp, log, sin ... atanh, atan2, abs, sign, heaviside, floor, mod, max, min,
    piecewise with lt, le, gt, ge, eq, ne, and, or, not;   its leaves: symbols, exact numbers, doubles, pi, e;
    powerlog(u, p, k) = u^p (log u)^k, which our derivative rules bring in, and tabulated functions (tables.py).

Each kind carries its name in trees, the sympy class and how many arguments it takes. Everything that comes from
outside (text, files, trees) is built through `Builder`, bottom up, and a node is refused *before* sympy sees it when

* all its arguments are constants and its value in double precision is not a finite real number (``sqrt(-1)``,
  ``exp(exp(exp(9)))``, ``1/0``, ``10**10**10``): sympy would work on the exact number, which may not fit the machine;
* a number has more than 1024 bits, or an exponent is above 4096, so that no chain of powers can grow without limit.

Every argument is taken as real where it is defined: a term such as log(x) at negative x is NaN at run time, never a
complex number, and an expression that sympy itself turns complex (``sqrt(-x**2)``) is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from ..errors import CompileError, ExpressionError
from .expressions import PowerLog
from .tables import TableFunction

__all__ = ["KINDS", "MAX_BITS", "MAX_EXPONENT", "Builder", "NodeKind", "arity", "kind_of", "real_symbol", "valid_name"]

MAX_BITS = 1024  # of the numerator and of the denominator of an exact number: the range of a double
MAX_EXPONENT = 4096  # of a power after sympy has merged powers of powers
MAX_ALTERNATIVES = 16  # arguments of one max, min or piecewise
MAX_CONSTANT = 16  # nodes of a constant that stays exact; a larger one becomes a double
MAX_TERMS = 100  # of the argument of a hyperbolic function, multiplied out: sympy does so where it may be complex
MAX_POWERS = 16  # powers and quotients inside one another: sympy's questions about signs go through all of them
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def valid_name(name: object) -> bool:
    """Whether `name` may name a state or parameter: ``[A-Za-z][A-Za-z0-9_]*``, no ``__``, at most 64 characters."""
    return isinstance(name, str) and len(name) <= 64 and "__" not in name and _NAME.fullmatch(name) is not None


def real_symbol(name: str) -> sp.Symbol:
    """The library's symbol of that name (always ``real=True``); refuses names that could not be written in a file."""
    if not valid_name(name):
        raise ExpressionError(
            f"the name {name!r} is not allowed: a letter, then letters, digits and single underscores, at most 64"
        )
    return sp.Symbol(name, real=True)


@dataclass(frozen=True)
class NodeKind:
    """One kind of node: name in trees, sympy class, fewest and most arguments, value in doubles, order-free or not."""

    name: str
    cls: Any
    fewest: int
    most: int | None
    value: Callable[..., Any]
    commutative: bool = False


def _power(base: float, exponent: float) -> float:
    if base < 0 and exponent != int(exponent):
        raise ValueError("power of a negative number")
    return math.pow(base, exponent)


def _mod(p: float, q: float) -> float:
    return p - q * math.floor(p / q)


def _heaviside(x: float, at_zero: float = 0.5) -> float:
    return at_zero if x == 0 else float(x > 0)


def _powerlog(base: float, exponent: float, count: float) -> float:
    return 0.0 if base == 0 and exponent > 0 else _power(base, exponent) * math.log(base) ** count


def _sign(x: float) -> float:
    return float((x > 0) - (x < 0))


_TABLE: tuple[tuple[str, Any, int, int | None, Callable[..., Any], bool], ...] = (
    ("add", sp.Add, 2, None, lambda *a: math.fsum(a), True),
    ("mul", sp.Mul, 2, None, lambda *a: math.prod(a), True),
    ("pow", sp.Pow, 2, 2, _power, False),
    ("exp", sp.exp, 1, 1, math.exp, False),
    ("log", sp.log, 1, 1, math.log, False),
    ("sin", sp.sin, 1, 1, math.sin, False),
    ("cos", sp.cos, 1, 1, math.cos, False),
    ("tan", sp.tan, 1, 1, math.tan, False),
    ("asin", sp.asin, 1, 1, math.asin, False),
    ("acos", sp.acos, 1, 1, math.acos, False),
    ("atan", sp.atan, 1, 1, math.atan, False),
    ("sinh", sp.sinh, 1, 1, math.sinh, False),
    ("cosh", sp.cosh, 1, 1, math.cosh, False),
    ("tanh", sp.tanh, 1, 1, math.tanh, False),
    ("asinh", sp.asinh, 1, 1, math.asinh, False),
    ("acosh", sp.acosh, 1, 1, math.acosh, False),
    ("atanh", sp.atanh, 1, 1, math.atanh, False),
    ("atan2", sp.atan2, 2, 2, math.atan2, False),
    ("abs", sp.Abs, 1, 1, abs, False),
    ("sign", sp.sign, 1, 1, _sign, False),
    ("heaviside", sp.Heaviside, 1, 2, _heaviside, False),
    ("floor", sp.floor, 1, 1, math.floor, False),
    ("mod", sp.Mod, 2, 2, _mod, False),
    ("powerlog", PowerLog, 3, 3, _powerlog, False),
    ("max", sp.Max, 2, MAX_ALTERNATIVES, max, True),
    ("min", sp.Min, 2, MAX_ALTERNATIVES, min, True),
    ("lt", sp.StrictLessThan, 2, 2, lambda a, b: a < b, False),
    ("le", sp.LessThan, 2, 2, lambda a, b: a <= b, False),
    ("gt", sp.StrictGreaterThan, 2, 2, lambda a, b: a > b, False),
    ("ge", sp.GreaterThan, 2, 2, lambda a, b: a >= b, False),
    ("eq", sp.Equality, 2, 2, lambda a, b: a == b, False),
    ("ne", sp.Unequality, 2, 2, lambda a, b: a != b, False),
    ("and", sp.And, 2, MAX_ALTERNATIVES, lambda *a: all(a), True),
    ("or", sp.Or, 2, MAX_ALTERNATIVES, lambda *a: any(a), True),
    ("not", sp.Not, 1, 1, lambda a: not a, False),
)

KINDS: dict[str, NodeKind] = {row[0]: NodeKind(*row) for row in _TABLE}
_BY_CLASS: dict[Any, NodeKind] = {kind.cls: kind for kind in KINDS.values()}
RELATIONS = frozenset({"lt", "le", "gt", "ge", "eq", "ne"})
CONNECTIVES = frozenset({"and", "or", "not"})


def kind_of(node: sp.Basic) -> NodeKind | None:
    """The kind of an inner node, or None where it is a leaf, a piecewise or something the library does not know."""
    return _BY_CLASS.get(type(node))


def _construct(kind: NodeKind, args: Sequence[sp.Basic], constants: Sequence[Any]) -> sp.Basic:
    """Call sympy's constructor, without the evaluations that expand polynomials, compare symbols or turn complex.

    sympy's Mod takes polynomial gcds, Max compares its arguments pairwise, abs introduces conjugates, a comparison of
    constants evaluates them to any precision: minutes where someone wants them to be.
    """
    name = kind.name
    if None not in constants and name in _BY_VALUE:
        return _BY_VALUE[name](kind, args, constants)
    if name in ("max", "min"):
        return _extremum(kind, args, constants)
    if name in ("mod", "floor", "ceiling") or name in RELATIONS:
        return kind.cls(*args, evaluate=False)
    if name in ("abs", "sign") and not bool(args[0].is_extended_real):
        return kind.cls(args[0], evaluate=False)
    return kind.cls(*args)


def _terms(node: sp.Basic) -> float:
    """A bound for the number of terms of `node` and of all that is in it, multiplied out."""
    inside = [_terms(arg) for arg in node.args]
    if isinstance(node, sp.Add):
        return sum(inside)
    if isinstance(node, sp.Mul):
        return math.prod(inside)
    if isinstance(node, sp.Pow) and isinstance(node.exp, sp.Rational) and inside[0] > 1:
        return min(inside[0], 1e6) ** min(abs(float(node.exp)) + 1, 40.0)
    return max(inside, default=1.0)


def _by_order(kind: NodeKind, args: Sequence[sp.Basic], constants: Sequence[Any]) -> sp.Basic:
    return args[constants.index(kind.value(*constants))]


def _constant_mod(kind: NodeKind, args: Sequence[sp.Basic], constants: Sequence[Any]) -> sp.Basic:
    if all(isinstance(a, sp.Rational) for a in args):
        return sp.Mod(*args)
    return sp.Float(kind.value(*constants))


_BY_VALUE: dict[str, Callable[[NodeKind, Sequence[Any], Sequence[Any]], sp.Basic]] = {
    **dict.fromkeys(RELATIONS, lambda kind, args, constants: sp.true if kind.value(*constants) else sp.false),
    "max": _by_order,
    "min": _by_order,
    "mod": _constant_mod,
    "floor": lambda kind, args, constants: sp.Integer(math.floor(constants[0])),
    "sign": lambda kind, args, constants: sp.Integer(int(_sign(constants[0]))),
    "abs": lambda kind, args, constants: -args[0] if constants[0] < 0 else args[0],
}


def _extremum(kind: NodeKind, args: Sequence[sp.Basic], constants: Sequence[Any]) -> sp.Basic:
    """Max or Min: nested ones joined, repeated arguments dropped, of several constants only the one that counts."""
    flat = [part for arg in args for part in (arg.args if kind_of(arg) is kind else (arg,))]
    numbers = {part: float(part) for part in flat if not part.free_symbols and part.is_Number}
    keep = kind.value(numbers, key=lambda part: numbers[part]) if numbers else None
    parts = {part: None for part in flat if part not in numbers or part == keep}
    if len(parts) > MAX_ALTERNATIVES:
        raise ExpressionError(f"'{kind.name}' of '{kind.name}' has more than {MAX_ALTERNATIVES} arguments in all")
    return next(iter(parts)) if len(parts) == 1 else kind.cls(*parts, evaluate=False)


@dataclass
class Builder:
    """Builds nodes with every check of this file; keeps the values of constants seen, so that each costs once.

    >>> builder = Builder()
    >>> builder.build("pow", [sp.Integer(2), sp.Rational(1, 2)])
    sqrt(2)
    """

    values: dict[sp.Basic, float | bool | None] = field(default_factory=dict)
    sizes: dict[sp.Basic, int] = field(default_factory=dict)  # nodes below, of constants
    powers: dict[sp.Basic, int] = field(default_factory=dict)  # powers in powers

    def build(self, name: str, args: Sequence[sp.Basic]) -> sp.Basic:
        """The node `name` of `args` (themselves built or checked here); ExpressionError where a check fails."""
        kind = KINDS[name]
        if len(args) < kind.fewest or (kind.most is not None and len(args) > kind.most):
            raise ExpressionError(f"'{name}' takes {arity(kind)}, not {len(args)}")
        self._check_types(kind, args)
        constants = [self.value(arg) for arg in args]
        if kind.name == "mod" and constants[1] == 0:
            raise ExpressionError("'mod' divides by zero")
        if None not in constants:
            value = _finite(kind, constants)
            if sum(self.sizes.get(arg, 1) for arg in args) > MAX_CONSTANT and not isinstance(value, bool):
                return sp.Float(value)
        if name in ("sinh", "cosh", "tanh") and _terms(args[0]) > MAX_TERMS and not args[0].is_extended_real:
            raise ExpressionError(f"the argument of '{name}' has too many terms multiplied out, and may be complex")
        try:
            node = _construct(kind, args, constants)
        except RecursionError:
            raise ExpressionError(f"the argument of '{name}' is too involved for sympy") from None
        self.value(node)
        return node

    def piecewise(self, pairs: Sequence[tuple[sp.Basic, sp.Basic]]) -> sp.Basic:
        """Piecewise((value, condition), ...); a last condition `true` covers the rest."""
        if not 1 <= len(pairs) <= MAX_ALTERNATIVES:
            raise ExpressionError(f"'piecewise' takes 1 to {MAX_ALTERNATIVES} pairs, not {len(pairs)}")
        for value, condition in pairs:
            if not isinstance(value, sp.Expr):
                raise ExpressionError("a value of 'piecewise' must be a number, not a condition")
            if not _is_condition(condition):
                raise ExpressionError("each condition of 'piecewise' must be a comparison, such as x > 0")
            if condition.has(sp.Piecewise):  # sympy would multiply out every case of every case
                raise ExpressionError("a condition may not contain 'piecewise' or 'where' itself")
            self.value(value), self.value(condition)
        kept: list[tuple[sp.Basic, sp.Basic]] = []
        for value, condition in pairs:
            if condition is not sp.false:
                kept.append((value, condition))
            if condition is sp.true:
                break
        if not kept:
            raise ExpressionError("no condition of 'piecewise' can hold")
        node = kept[0][0] if kept[0][1] is sp.true else sp.Piecewise(*kept, evaluate=False)
        self.value(node)
        return node

    def value(self, node: sp.Basic) -> float | bool | None:
        """The value of a constant in double precision; None if symbols are left. Refuses what is not a finite real."""
        if node in self.values:
            return self.values[node]
        result = self._leaf(node) if not node.args else self._inner(node)
        self.values[node] = result
        return result

    def _leaf(self, node: sp.Basic) -> float | bool | None:
        if isinstance(node, sp.Symbol):
            return None
        if node is sp.true or node is sp.false:
            return node is sp.true
        if isinstance(node, sp.Rational):
            if max(abs(node.p).bit_length(), node.q.bit_length()) > MAX_BITS:
                raise ExpressionError("an exact number is too large or too small for double precision")
            return float(node)
        if isinstance(node, sp.Float) or node is sp.pi or node is sp.E:
            number = float(node)
            if not math.isfinite(number) or (number == 0 and not node.is_zero):
                raise ExpressionError("a number is too large or too small for double precision")
            return number
        if node in (sp.oo, -sp.oo, sp.zoo, sp.nan):
            raise ExpressionError("a constant part of the expression is not finite")
        if node is sp.I:
            raise ExpressionError("the expression is not real: it contains the square root of a negative number")
        raise CompileError(f"'{type(node).__name__}' ({node}) has no place in an expression")

    def _inner(self, node: sp.Basic) -> float | bool | None:
        values = [self.value(arg) for arg in node.args]
        if isinstance(node, sp.Pow) and isinstance(node.exp, sp.Number) and abs(float(node.exp)) > MAX_EXPONENT:
            raise ExpressionError(f"an exponent is beyond {MAX_EXPONENT}")
        self.powers[node] = max(self.powers.get(arg, 0) for arg in node.args) + isinstance(node, sp.Pow)
        if self.powers[node] > MAX_POWERS:
            raise ExpressionError(f"powers and quotients nest deeper than {MAX_POWERS} levels")
        if any(v is None for v in values) or isinstance(node, sp.Piecewise):
            return None
        self.sizes[node] = 1 + sum(self.sizes.get(arg, 1) for arg in node.args)
        if isinstance(node, TableFunction):
            return self._tabulated(node, values)
        kind = kind_of(node)
        if kind is None:  # a function of constants that is not in the table: tree.py says which
            return None
        return _finite(kind, values)

    @staticmethod
    def _tabulated(node: TableFunction, values: Sequence[Any]) -> float:
        result = float(node.table.evaluate(values[0]))
        if not math.isfinite(result):
            raise ExpressionError(f"the table '{node.table.name}' has no value at {values[0]:g}")
        return result

    @staticmethod
    def _check_types(kind: NodeKind, args: Sequence[sp.Basic]) -> None:
        wants_condition = kind.name in CONNECTIVES
        for arg in args:
            if wants_condition and not _is_condition(arg):
                raise ExpressionError(f"'{kind.name}' joins comparisons, such as x > 0")
            if not wants_condition and not isinstance(arg, sp.Expr):
                raise ExpressionError(f"'{kind.name}' takes numbers, not comparisons")


def _is_condition(node: object) -> bool:
    return isinstance(node, sp.logic.boolalg.Boolean) and not isinstance(node, sp.Symbol)


def arity(kind: NodeKind) -> str:
    """How many arguments a node of this kind takes, in words."""
    if kind.most is None:
        return f"at least {kind.fewest} arguments"
    if kind.most == kind.fewest:
        return f"{kind.fewest} argument{'s' if kind.fewest > 1 else ''}"
    return f"{kind.fewest} to {kind.most} arguments"


def _finite(kind: NodeKind, values: Sequence[Any]) -> float | bool:
    """The value of `kind` at constants; ExpressionError if it is not a finite real number."""
    try:
        result = kind.value(*values)
    except ZeroDivisionError:
        raise ExpressionError("a constant part of the expression divides by zero") from None
    except OverflowError:
        raise ExpressionError("a constant part of the expression is too large for double precision") from None
    except ValueError:
        shown = [f"{float(v):.6g}" for v in values]
        call = f"({shown[0]})**({shown[1]})" if kind.name == "pow" else f"{kind.name}({', '.join(shown)})"
        raise ExpressionError(f"{call} is not a finite real number") from None
    if isinstance(result, bool):
        return result
    if not math.isfinite(result):
        raise ExpressionError("a constant part of the expression is too large for double precision")
    return float(result)
