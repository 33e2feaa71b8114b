"""Equation text to sympy, by a grammar of our own: the text is data and can never run code.

    expression = term {("+" | "-") term}          term  = factor {("*" | "/") factor}
    factor     = {"+" | "-"} power                power = atom ["**" factor]
    atom       = number | name | pi | E | "(" expression ")" | function "(" expression {"," expression} ")"
    condition  = expression ("<" | "<=" | ">" | ">=" | "==" | "!=") expression, joined by and, or, not
                 (only inside  piecewise(value, condition, ..., otherwise)  and  where(condition, yes, no))
    equation   = expression "=" expression

Precedence and associativity are Python's: -x**2 is -(x**2), 2**3**2 is 2**9. There is no eval, no sympify of text, no
attribute, no index, no string: a construct that is not in this grammar has no code that could execute it. Limits: the
characters, brackets and numbers of tokens.py; 2000 nodes; constant exponents of at most 64; constant parts that are
finite real numbers in double precision (nodes.py). Every refusal is an ExpressionError with a caret at the culprit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import sympy as sp

from ..errors import CompileError, ExpressionError, unknown_name
from .nodes import KINDS, MAX_ALTERNATIVES, Builder, arity, real_symbol
from .tokens import Token, refuse, tokenise

__all__ = ["FUNCTIONS", "MAX_NODES", "MAX_POWER", "parse_equation", "parse_expression"]

MAX_NODES = 2000
MAX_POWER = 64  # largest constant exponent that may be written
MAX_PAIRWISE = 16  # factors multiplied one by one, as Python does; the rest of a longer product in one go
MAX_NESTING = 60  # of brackets, signs and powers of powers together
FUNCTIONS = (
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "exp", "log", "sqrt", "abs", "sign", "heaviside", "max", "min", "mod", "floor", "piecewise", "where",
)  # fmt: skip
_CONSTANTS = {"pi": sp.pi, "E": sp.E}
_COMPARISONS = {"<": "lt", "<=": "le", ">": "gt", ">=": "ge", "==": "eq", "!=": "ne"}
_SPELLINGS = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "ln": "log", "sgn": "sign"}
Function = Callable[..., sp.Basic]


def parse_expression(
    text: str, names: Iterable[str] | None = None, functions: Mapping[str, Function] | None = None
) -> sp.Expr:
    """The sympy expression of `text`.

    Parameters
    ----------
    text : str
        At most 4096 ASCII characters; ``x'`` and ``x''`` stand for the names ``x_dot`` and ``x_ddot``.
    names : iterable of str, optional
        The names that may occur (each a real symbol); any when not given. A name of this list takes precedence over
        the constant ``E``.
    functions : mapping of str to callable, optional
        Further functions of one argument (tables), besides `FUNCTIONS`.

    Raises
    ------
    ExpressionError
        Anything else than an allowed expression; `text` and `column` of the error place the caret.

    Examples
    --------
    >>> parse_expression("k*x + beta*x**3 - F*cos(2*t)", ["k", "x", "beta", "F", "t"])
    -F*cos(2*t) + beta*x**3 + k*x
    """
    parser = _Parser(text, names, functions)
    node = parser.expression(0)
    parser.finish()
    return node


def parse_equation(
    text: str, names: Iterable[str] | None = None, functions: Mapping[str, Function] | None = None
) -> tuple[sp.Expr, sp.Expr]:
    """Left and right side of an equation ``left = right``; arguments and errors as `parse_expression`.

    >>> parse_equation("m*x'' + k*x = F*cos(Omega*t)")
    (k*x + m*x_ddot, F*cos(Omega*t))
    """
    parser = _Parser(text, names, functions)
    left = parser.expression(0)
    if parser.token.text != "=":
        if parser.token.kind == "end":
            raise refuse("an equation needs a '=' and its right side", text, parser.token.column)
        raise parser.unexpected()
    parser.advance()
    right = parser.expression(0)
    parser.finish()
    return left, right


class _Parser:
    """Recursive descent over the tokens; builds each node through `Builder`, which holds the limits."""

    def __init__(self, text: str, names: Iterable[str] | None, functions: Mapping[str, Function] | None) -> None:
        self.text = text
        self.tokens = tokenise(text)
        self.position = 0
        self.names = None if names is None else list(names)
        self.functions = dict(functions or {})
        self.builder = Builder()
        self.nodes = 0
        self.nesting = 0
        self.conditions = False  # whether comparisons are allowed here

    @property
    def token(self) -> Token:
        return self.tokens[self.position]

    def advance(self) -> Token:
        token = self.tokens[self.position]
        self.position += 1
        return token

    def finish(self) -> None:
        if self.token.kind != "end":
            raise self.unexpected()

    # ------------------------------------------------------------------------------------------------ building
    def build(self, name: str, args: Sequence[sp.Basic], token: Token) -> Any:
        self.count(token)
        return self.guarded(lambda: self.builder.build(name, args), token)

    def guarded(self, make: Callable[[], sp.Basic], token: Token) -> Any:
        try:
            return make()
        except (ExpressionError, CompileError) as error:
            raise refuse(str(error), self.text, token.column) from None

    def count(self, token: Token) -> None:
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise refuse(f"the expression has more than {MAX_NODES} nodes", self.text, token.column)

    # ------------------------------------------------------------------------------------------------- grammar
    def expression(self, opened: int) -> Any:
        """A sum, or a condition where conditions are allowed; `opened` is the column to blame for deep nesting."""
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise refuse(f"the expression nests deeper than {MAX_NESTING} levels", self.text, opened)
        node = self.alternatives() if self.conditions else self.sum()
        self.nesting -= 1
        return node

    def alternatives(self) -> Any:
        parts, token = [self.conjunction()], self.token
        while self.token.text == "or":
            self.advance()
            parts.append(self.conjunction())
        return parts[0] if len(parts) == 1 else self.build("or", parts, token)

    def conjunction(self) -> Any:
        parts, token = [self.comparison()], self.token
        while self.token.text == "and":
            self.advance()
            parts.append(self.comparison())
        return parts[0] if len(parts) == 1 else self.build("and", parts, token)

    def comparison(self) -> Any:
        negations = []
        while self.token.text == "not":
            negations.append(self.advance())
            self.count(self.token)
        left, parts = self.sum(), []
        first = self.token
        while self.token.text in _COMPARISONS:
            operator = self.advance()
            right = self.sum()
            parts.append(self.build(_COMPARISONS[operator.text], [left, right], operator))
            left = right
        node = left if not parts else parts[0] if len(parts) == 1 else self.build("and", parts, first)
        for token in reversed(negations):
            node = self.build("not", [node], token)
        return node

    def sum(self) -> Any:
        first = self.token
        terms = [self.product()]
        while self.token.text in ("+", "-"):
            operator = self.advance()
            term = self.product()
            terms.append(term if operator.text == "+" else self.build("mul", [sp.S.NegativeOne, term], operator))
            self.count(operator)
        return terms[0] if len(terms) == 1 else self.build("add", terms, first)

    def product(self) -> Any:
        node, first, rest, count = self.signed(), self.token, [], 0
        while self.token.text in ("*", "/"):
            operator = self.advance()
            factor = self.signed()
            if operator.text == "/":
                factor = self.build("pow", [factor, sp.S.NegativeOne], operator)
            count += 1
            if count < MAX_PAIRWISE:
                node = self.build("mul", [node, factor], operator)
            else:
                self.count(operator)
                rest.append(factor)
        return self.build("mul", [node, *rest], first) if rest else node

    def signed(self) -> Any:
        signs = []
        while self.token.text in ("+", "-"):
            signs.append(self.advance())
            if len(signs) > MAX_NESTING:
                raise refuse(f"more than {MAX_NESTING} signs in a row", self.text, signs[-1].column)
        node = self.power()
        for sign in reversed(signs):
            if sign.text == "-":
                node = self.build("mul", [sp.S.NegativeOne, node], sign)
        return node

    def power(self) -> Any:
        base = self.atom()
        if self.token.text != "**":
            return base
        operator = self.advance()
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise refuse(f"powers nest deeper than {MAX_NESTING} levels", self.text, operator.column)
        where = self.token
        exponent = self.signed()
        self.nesting -= 1
        value = self.guarded(lambda: self.builder.value(exponent), where)
        if value is not None and abs(value) > MAX_POWER:
            raise refuse(f"a constant exponent must lie within -{MAX_POWER} ... {MAX_POWER}", self.text, where.column)
        return self.build("pow", [base, exponent], operator)

    def atom(self) -> Any:
        token = self.token
        if token.kind == "number":
            self.advance()
            self.count(token)
            return sp.Integer(int(token.text)) if token.text.isdigit() else sp.Float(float(token.text))
        if token.kind == "name":
            self.advance()
            return self.call(token) if self.token.text == "(" else self.symbol(token)
        if token.text == "(":
            self.advance()
            node = self.expression(token.column)
            if self.token.text != ")":
                raise self.unexpected()
            self.advance()
            return node
        raise self.missing()

    def symbol(self, token: Token) -> sp.Basic:
        self.count(token)
        if self.names is not None and token.text in self.names:
            return real_symbol(token.text)
        if token.text in _CONSTANTS:
            return _CONSTANTS[token.text]
        if token.text in FUNCTIONS or token.text in self.functions:
            message = f"the function '{token.text}' needs its argument in brackets, {token.text}(...)"
            raise refuse(message, self.text, token.column)
        if self.names is None:
            return self.guarded(lambda: real_symbol(token.text), token)
        error = unknown_name("name", token.written, [*self.names, *_CONSTANTS], "this expression")
        raise refuse(str(error), self.text, token.column)

    def call(self, token: Token) -> Any:
        name = token.text
        if name not in FUNCTIONS and name not in self.functions:
            raise self.unknown_function(token)
        self.advance()
        outer, self.conditions = self.conditions, False
        arguments: list[Any] = []
        while self.token.text != ")":
            index = len(arguments)
            self.conditions = (name == "where" and index == 0) or (name == "piecewise" and index % 2 == 1)
            arguments.append(self.expression(token.column))
            if self.token.text == ",":
                self.advance()
                if self.token.text == ")":
                    raise self.missing()
            elif self.token.text != ")":
                raise self.unexpected()
        self.advance()
        self.conditions = outer
        return self.apply(name, arguments, token)

    def apply(self, name: str, arguments: list[Any], token: Token) -> Any:
        count = len(arguments)
        if name in self.functions:
            self.count(token)
            return self.guarded(lambda: self.checked(name, arguments), token)
        if name == "sqrt":
            self.arity(name, "1 argument", count == 1, count, token)
            return self.build("pow", [arguments[0], sp.Rational(1, 2)], token)
        if name == "where":
            self.arity(name, "3 arguments (condition, yes, no)", count == 3, count, token)
            condition, yes, no = arguments
            return self.branches([(yes, condition), (no, sp.true)], token)
        if name == "piecewise":
            wanted = "value, condition, ..., and a last value for all other cases"
            self.arity(name, wanted, count % 2 == 1 and 3 <= count <= 2 * MAX_ALTERNATIVES - 1, count, token)
            pairs = list(zip(arguments[:-1:2], arguments[1::2]))
            return self.branches([*pairs, (arguments[-1], sp.true)], token)
        kind = KINDS[name]
        fits = kind.fewest <= count and (kind.most is None or count <= kind.most)
        self.arity(name, arity(kind), fits, count, token)
        return self.build(name, arguments, token)

    def checked(self, name: str, arguments: list[Any]) -> sp.Basic:
        for argument in arguments:
            self.builder.value(argument)
        if len(arguments) != 1:
            raise ExpressionError(f"'{name}' takes 1 argument, not {len(arguments)}")
        return self.functions[name](*arguments)

    def branches(self, pairs: list[tuple[Any, Any]], token: Token) -> Any:
        self.count(token)
        return self.guarded(lambda: self.builder.piecewise(pairs), token)

    # -------------------------------------------------------------------------------------------------- refusals
    def arity(self, name: str, wanted: str, fits: bool, count: int, token: Token) -> None:
        if not fits:
            raise refuse(f"'{name}' takes {wanted}, not {count}", self.text, token.column)

    def unknown_function(self, token: Token) -> ExpressionError:
        name = token.text
        if name in _SPELLINGS:
            message = f"no function '{name}'; did you mean '{_SPELLINGS[name]}'?"
        elif name in _CONSTANTS or (self.names is not None and name in self.names):
            message = f"'{token.written}' is not a function; for a product write {token.written}*(...)"
        else:
            message = str(unknown_name("function", name, [*FUNCTIONS, *self.functions], "an expression"))
        return refuse(message, self.text, token.column)

    def missing(self) -> ExpressionError:
        """A number or name was expected at this token."""
        token = self.token
        found = "the end" if token.kind == "end" else f"'{token.text}'"
        if token.text in ("and", "or", "not"):
            return self.unexpected()
        return refuse(f"a number, a name or a bracket is missing before {found}", self.text, token.column)

    def unexpected(self) -> ExpressionError:
        """An operator or the end was expected at this token."""
        token = self.token
        if token.kind == "end":
            return self.missing()
        if token.text == "=":
            message = "'=' does not belong here; a comparison is written =="
        elif token.text in _COMPARISONS or token.text in ("and", "or", "not"):
            message = f"'{token.text}' is allowed only in the conditions of piecewise(...) and where(...)"
        elif token.text == ",":
            message = "a comma separates only the arguments of a function"
        elif token.text == ")":
            message = "this bracket closes nothing"
        else:
            message = f"an operator is missing before '{token.written or token.text}'"
        return refuse(message, self.text, token.column)
