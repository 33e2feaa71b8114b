"""Equation text: what is read, what is refused, where the caret stands.

Witnesses: Python's own arithmetic (`eval` of the same text with the functions of `math`, in the test only) for values
and precedence; sympy's operators for the structure; golden texts for the messages; the attack list for safety.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time

import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stability.errors import ExpressionError
from stability.systems.parsing import FUNCTIONS, parse_equation, parse_expression
from stability.systems.tokens import MAX_CHARACTERS
from stability.systems.tree import canonical, from_tree, to_tree

NAMES = ["x", "x_dot", "x_ddot", "y", "t", "xi", "beta", "Omega", "k"]
X, Y, K = sp.symbols("x y k", real=True)
SYMBOLS = {name: sp.Symbol(name, real=True) for name in NAMES}


@pytest.fixture(scope="module", autouse=True)
def warm() -> None:
    """sympy imports parts of itself on first use; that time belongs to no attack."""
    parse_expression("mod(x, y) + max(x, 1) + where(x > 0 and y < 1, x, atan2(x, y)) + floor(abs(x) + sqrt(2))", NAMES)


# ------------------------------------------------------------------------------------------------------- what is read


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("-x**2", -(X**2)),
        ("2**3**2", sp.Integer(512)),
        ("2**-x", 2 ** (-X)),
        ("x - y - k", X - Y - K),
        ("x/y/k", X / Y / K),
        ("x/y*k", X / Y * K),
        ("-x*-y", X * Y),
        ("1/3*x", sp.Rational(1, 3) * X),
        ("0.1*x", 0.1 * X),
        ("2*(x + 1)*y", 2 * (X + 1) * Y),
        ("x'' + k*x'", SYMBOLS["x_ddot"] + K * SYMBOLS["x_dot"]),
        ("x_dot**2", SYMBOLS["x_dot"] ** 2),
        ("pi*E", sp.pi * sp.E),
        ("sqrt(x**2)", sp.Abs(X)),
        ("heaviside(x)", sp.Heaviside(X)),
        ("heaviside(x, 1)", sp.Heaviside(X, 1)),
        ("atan2(y, x)", sp.atan2(Y, X)),
        ("max(x, 0, y)", sp.Max(X, 0, Y)),
        ("min(x, 0, 2)", sp.Min(X, 0)),
        ("mod(x, 2*pi)", sp.Mod(X, 2 * sp.pi)),
        ("floor(x)", sp.floor(X)),
        ("where(x > 0, x, -x)", sp.Piecewise((X, X > 0), (-X, True))),
        ("piecewise(x, x >= 1, 0, x < -1, y)", sp.Piecewise((X, X >= 1), (0, X < -1), (Y, True))),
        ("where(0 < x <= 1, 1, 0)", sp.Piecewise((1, (X > 0) & (X <= 1)), (0, True))),
        ("where(not x > 0 or y == k, 1, 2)", sp.Piecewise((1, (X <= 0) | sp.Eq(Y, K)), (2, True))),
        ("where((x + 1)*2 > 0 and (y != 0), 1, 2)", sp.Piecewise((1, (2 * X + 2 > 0) & sp.Ne(Y, 0)), (2, True))),
        ("1e3 + .5 + 2.", sp.Float(1002.5)),
        ("007", sp.Integer(7)),
    ],
)
def test_reads_as_python_and_sympy_do(text: str, expected: sp.Expr) -> None:
    assert canonical(sp.sympify(expected)) == parse_expression(text, NAMES) or (
        parse_expression(text, NAMES).doit() == sp.sympify(expected).doit()
    )


def test_equation_gives_both_sides() -> None:
    m, c, k, F, W, t = sp.symbols("m c k F Omega t", real=True)
    x, v, a = sp.symbols("x x_dot x_ddot", real=True)
    assert parse_equation("m*x'' + c*x' + k*x = F*cos(Omega*t)") == (m * a + c * v + k * x, F * sp.cos(W * t))


def test_declared_name_wins_over_the_constant() -> None:
    assert parse_expression("E*x", ["E", "x"]) == sp.Symbol("E", real=True) * X


def test_functions_can_be_added() -> None:
    assert parse_expression("spring(2*x)", ["x"], {"spring": sp.Function("spring")}) == sp.Function("spring")(2 * X)


def test_long_sums_and_products_are_read() -> None:
    assert parse_expression("+".join(["x"] * 600), ["x"]) == 600 * X
    assert parse_expression("*".join(["x"] * 600), ["x"]) == X**600


# ------------------------------------------------------------------------------------------------------ where it points

GOLDEN = [
    ("x^2", "the character '^' has no place in an expression; write ** for powers", 1),
    ("2x + 1", "an operator is missing between 2 and x; write 2*x", 1),
    ("x y", "an operator is missing before 'y'", 2),
    ("sin x", "the function 'sin' needs its argument in brackets, sin(...)", 0),
    ("k*sinn(x)", "no function 'sinn'; an expression has", 2),
    ("beta*x**3 + omga", "no name 'omga'; this expression has x, x_dot", 12),
    ("x(t)", "'x' is not a function; for a product write x*(...)", 0),
    ("(x + 1", "this bracket is never closed", 0),
    ("x + 1)", "this bracket closes nothing", 5),
    ("x +", "a number, a name or a bracket is missing before the end", 3),
    ("x*/y", "a number, a name or a bracket is missing before '/'", 2),
    ("atan2(x)", "'atan2' takes 2 arguments, not 1", 0),
    ("x > 0", "'>' is allowed only in the conditions of piecewise(...) and where(...)", 2),
    ("x = 0", "'=' does not belong here; a comparison is written ==", 2),
    ("1 + sqrt(-1)", "(-1)**(0.5) is not a finite real number", 4),
    ("x + 1/0", "(0)**(-1) is not a finite real number", 5),
    ("x**65", "a constant exponent must lie within -64 ... 64", 3),
    ("y + exp(exp(exp(9)))", "a constant part of the expression is too large for double precision", 8),
    ("x.real", "a point stands only inside a number; attributes do not exist here", 1),
    ("x'''", "at most two primes: first and second time derivatives", 3),
    ("x' + z'", "no name 'z''; this expression has", 5),
    ("\u03b1*x", "the character '\\u03b1' (GREEK SMALL LETTER ALPHA) is not plain ASCII; write Greek letters by name", 0),
    ("3j*x", "complex numbers are not allowed: the quantities of a model are real", 0),
    ("ln(x)", "no function 'ln'; did you mean 'log'?", 0),
    ("x // y", "'//' is not an operator here; write floor(a/b)", 2),
    ("1e400*x", "1e400 is too large for double precision", 0),
    ("where(x, y, 1)", "each condition of 'piecewise' must be a comparison, such as x > 0", 0),
    ("max(x)", "'max' takes 2 to 16 arguments, not 1", 0),
    ("x' + k__x", "the name 'k__x' is not allowed", 5),
]


@pytest.mark.parametrize(("text", "message", "column"), GOLDEN, ids=[g[0].encode("ascii", "replace") for g in GOLDEN])
def test_caret_stands_under_the_culprit(text: str, message: str, column: int) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse_expression(text, NAMES)
    assert str(caught.value).startswith(message)
    assert caught.value.column == column
    assert str(caught.value).endswith("\n    " + " " * column + "^")


def test_unknown_name_proposes_the_nearest() -> None:
    with pytest.raises(ExpressionError, match="did you mean 'Omega'"):
        parse_expression("cos(omega*t)", NAMES)


def test_equation_without_right_side() -> None:
    for text, column in (("x'' + x", 7), ("x = ", 3), ("x = y = k", 6), ("= x", 0), ("x == 0", 2)):
        with pytest.raises(ExpressionError) as caught:
            parse_equation(text, NAMES)
        assert caught.value.column == column, text


def test_long_text_is_cut_around_the_caret() -> None:
    with pytest.raises(ExpressionError) as caught:
        parse_expression("x + " * 200 + "? + " + "x + " * 200, NAMES)
    line, caret = str(caught.value).split("\n    ")[1:]
    assert len(line) <= 120 and line[caret.index("^")] == "?"


# ------------------------------------------------------------------------------------------------------------ attacks

_WALKS = [
    "x.__class__", "x.__class__.__mro__", "().__class__.__bases__[0].__subclasses__()", "x.__init__.__globals__",
    "(1).__class__", "sin.__globals__", "sin.func_globals", "x.real", "x.args[0]", "x.free_symbols", "pi.evalf()",
    "x.subs(x, 1)", "x.xreplace", "''.__class__", "''.join(x)", "[].append(x)", "{}.get(x)", "1..__class__", "1.0.hex()",
    "x .__dict__", "x. __dict__", "(x).__reduce__()", "x.__getattribute__('a')", "getattr(x, 'a')", "x[0]", "x[0:1]",
    "(x for x in y)", "x.__class__.__base__.__subclasses__()[140].__init__",
]  # fmt: skip
_CALLS = [
    "__import__('os')", "__import__('os').system('echo')", "eval('1')", "exec('1')", "compile('1','','eval')", "open('f')",
    "globals()", "locals()", "vars()", "dir()", "input()", "print(x)", "breakpoint()", "exit()", "quit()", "help()",
    "type(x)", "object()", "id(x)", "hash(x)", "memoryview(x)", "setattr(x, y, k)", "delattr(x, y)", "super()", "iter(x)",
    "sympify(x)", "S(x)", "Symbol(x)", "Function(x)", "Lambda(x, x)", "lambdify(x, x)", "os()", "sys()", "builtins()",
    "__builtins__", "__name__", "__file__", "__doc__", "__debug__", "_", "__", "___", "_x", "x__", "x__y", "__x__(1)",
    "sin(x)(y)", "(sin)(x)", "sin(*x)", "sin(**x)", "sin(x=1)", "sin(x, evaluate=1)", "max(x, key=y)", "sin()", "sin(,)",
    "sin(x,)", "sin(x y)", "x()", "1(x)", "pi(x)", "E(x)", "where()", "piecewise(x)", "piecewise(x, x > 0)",
]  # fmt: skip
_SYNTAX = [
    "lambda: 1", "lambda x: x", "(lambda: 1)()", "x := 1", "(x := 1)", "x if y else k", "[x]", "[x for x in y]", "{x}",
    "{x: y}", "{x for x in y}", "{**x}", "(x, y)", "x, y", "x,", "()", "f'x'", 'f"{x}"', "'{0.__class__}'.format(x)",
    "'%s' % x", "b'x'", "r'x'", "'x'", '"x"', "'''x'''", "u'x'", "x; y", "x\ny", "x\\\ny", "x # y", "#", "@x", "x @ y",
    "x = 1", "x += 1", "import os", "from os import path", "del x", "yield x", "await x", "async", "return x", "raise x",
    "assert x", "global x", "nonlocal x", "pass", "not x", "x and y", "x or y", "x is y", "x in y", "x not in y", "x < y",
    "x == y", "x != y", "x ^ y", "x & y", "x | y", "~x", "x << 1", "x >> 1", "x % y", "x // y", "x ?? y", "x ? y : k",
    "`x`", "$x", "x!", "!x", "...", "x...", "..", ".", "True", "False", "None", "Ellipsis", "NotImplemented", "1j", "2J",
    "0x10", "0b1", "0o7", "1_000", "1e", "1e+", "1.2.3", "1..2", "1x", "0xfor", "1if x", "1or x", "e5x(", "x'y", "'", "x'(",
]  # fmt: skip
_SIZE = [
    "10**10**10", "9**9**9**9", "10**65", "x**65", "x**-65", "x**(2*40)", "x**1e3", "x**64.5", "2**(2**20)",
    "exp(1000)", "exp(exp(exp(9)))", "cosh(cosh(cosh(9)))", "sinh(1000)", "1e308*10", "1e308**2", "1e309", "1e-400", "1e999999",
    "9" * 41, "9" * 4000, "0.1**64**64", "((2*x)**64)**64", "((x**64)**64)**64", "(3/2)**64**64", "((10**39)**8)**8",
    "1/0", "1/(1 - 1)", "x/(y - y)", "0**-1", "0/0", "log(0)", "log(-1)", "sqrt(-1)", "(-1)**0.5", "(-8)**(1/3)",
    "asin(2)", "acos(-2)", "acosh(0)", "atanh(1)", "atanh(2)", "tan(pi/2)", "mod(1, 0)", "mod(x, x - x)", "sqrt(-x**2)",
    "1e-300*1e-300", "(" * 61 + "x" + ")" * 61, "(" * 4000, ")" * 4000, "(" * 60 + "x" + ")" * 60, "[" * 2000, "-" * 4000 + "x",
    "+" * 61 + "x", "x" + "**x" * 500, "2" + "**2" * 100, "x**-" * 70 + "1", "sqrt(" * 60 + "x*x+1" + ")" * 60,
    "x" * 65, "x" * 4097, " " * 4097, "x+" * 1400 + "x", "1*" * 1500 + "1", "max(" + ",".join(f"x+{i}" for i in range(17)) + ")",
    "+".join(f"max(x+{i},y,sin(x+{i}))" for i in range(190)), "((" * 29 + "x" + "+1)**3)" * 29, "1/(x+" * 40 + "x" + ")" * 40,
    "max(" * 20 + "x" + "".join(f",y+{i})" for i in range(20)), "sin(" * 61 + "x" + ")" * 61, "where(" * 61, "not " * 500 + "x",
    "cos(sinh((acosh(where(mod(x,y)/x - x > pi + 1.5, atan2(y - k, 0.3*7), y - x)) + atan2(mod(7,2) + y, k)/1.5 + k)**64))",
    "where(" + "not " * 1000 + "x > 0, 1, 2)", "where(" + "x < " * 1000 + "x, 1, 2)",
]  # fmt: skip
_LOOKALIKES = [
    "s\u0456n(x)", "\uff53in(x)", "x\u200b", "x\u202e", "\ufeffx", "\u0445", "x\u00a0+ 1", "x\u20111", "1\u0660", "\uff11",
    "x\u00b2", "x \u2212 y", "x \u00d7 y", "\u03c0", "\u2202x", "x\u2032", "\U0001d465", "\ud800", "\x00", "x\x00y", "x\x1b[31m",
    "x\t+ y", "x\r+ y", "x\x0b", "\u2028", "\u00aa", "_\u0332_", "e\u0301", "\u017fin(x)", "\u212a", "x\x7f",
]  # fmt: skip
_CONDITIONS = [
    "where(x > 0, 1)", "where(x, 1, 2)", "where(1, 2, 3)", "where(x > 0, y > 0, 1)", "sin(x > 0)", "(x > 0) + 1",
    "where((x > 0) + 1, 1, 2)", "where(x > (y > 0), 1, 2)", "piecewise(x > 0, x, y)", "max(x > 0, 1)", "x > 0", "not x > 0",
    "where(x >, 1, 2)", "where(> x, 1, 2)", "where(x > 0 and, 1, 2)", "where(x => 0, 1, 2)", "where(x = 0, 1, 2)",
    "where(x and y, 1, 2)", "where(x <> y, 1, 2)", "where(sin(x > 0) > 0, 1, 2)", "x**(y > 0)", "-(x > 0)",
]  # fmt: skip
ATTACKS = [*_WALKS, *_CALLS, *_SYNTAX, *_SIZE, *_LOOKALIKES, *_CONDITIONS, "", " ", "   "]


def test_the_attack_list_is_long() -> None:
    assert len(set(ATTACKS)) >= 250


@pytest.mark.parametrize("number", range(len(ATTACKS)))
def test_attack_is_refused_at_once(number: int) -> None:
    start = time.process_time()
    with pytest.raises(ExpressionError):
        parse_expression(ATTACKS[number], NAMES)
    assert time.process_time() - start < 0.1  # a safety limit, two decades above the usual millisecond


@pytest.mark.parametrize("value", [None, 1, b"x", ["x"], sp.Symbol("x")])
def test_only_text_is_read(value: object) -> None:
    with pytest.raises(ExpressionError, match="an expression is text"):
        parse_expression(value, NAMES)  # type: ignore[arg-type]


def test_no_attack_runs_code() -> None:
    """A child process with an audit hook reads every attack: nothing is compiled, executed, started or connected."""
    script = (
        "import sys, sympy\n"
        "from stability.errors import ExpressionError\n"
        "from stability.systems.parsing import parse_equation, parse_expression\n"
        "import test_parsing as attacks\n"
        "seen = []\n"
        "armed = False\n"
        "names = ('exec', 'compile', 'open', 'os.system', 'subprocess.Popen', 'socket.connect', 'pickle.find_class')\n"
        "def hook(event, args):\n"
        "    if armed and event in names:\n"
        "        seen.append(event)\n"
        "sys.addaudithook(hook)\n"
        "for armed in (False, True):  # the first pass only makes sympy import what it imports late\n"
        "    for text in attacks.ATTACKS:\n"
        "        for read in (parse_expression, parse_equation):\n"
        "            try:\n"
        "                read(text, attacks.NAMES)\n"
        "            except ExpressionError:\n"
        "                pass\n"
        "armed = False\n"
        "print(len(seen), seen[:5])\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.path.dirname(__file__)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[0] == "0", done.stdout


# --------------------------------------------------------------------------------------------------------------- fuzz

_ONE = ["sin", "cos", "atan", "tanh", "abs", "sign", "asinh", "heaviside", "floor"]
_leaves = st.one_of(
    st.sampled_from(["x", "y", "k", "x'", "pi", "E"]),
    st.integers(0, 30).map(str),
    st.floats(0.01, 100, allow_nan=False).map(lambda v: f"{v:.6g}"),
)


def _grow(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.one_of(
        st.tuples(inner, st.sampled_from([" + ", "-", "*", " / "]), inner).map("".join),
        st.tuples(inner, st.sampled_from(["+", "-", "*"]), inner).map(lambda p: f"({''.join(p)})"),
        inner.map(lambda e: f"-{e}"),
        st.tuples(inner, st.sampled_from(["2", "3", "-1", "-2"])).map(lambda p: f"({p[0]})**{p[1]}"),
        st.tuples(st.sampled_from(_ONE), inner).map(lambda p: f"{p[0]}({p[1]})"),
        st.tuples(st.sampled_from(["max", "min", "atan2", "mod"]), inner, inner).map(lambda p: f"{p[0]}({p[1]}, {p[2]})"),
        st.tuples(inner, st.sampled_from(["<", ">=", ">"]), inner, inner, inner).map(
            lambda p: f"where({p[0]} {p[1]} {p[2]}, {p[3]}, {p[4]})"
        ),
    )


_texts = st.recursive(_leaves, _grow, max_leaves=12)
_POINTS = [
    {"x": 0.7310585, "y": -1.2337005, "k": 2.4142135, "x_dot": 0.3183098},
    {"x": -2.2360679, "y": 0.5772156, "k": 0.9159655, "x_dot": -1.3247179},
    {"x": 1.6180339, "y": 2.6854520, "k": -0.2614972, "x_dot": 4.6692016},
]
_PYTHON = {
    "__builtins__": {}, "sin": math.sin, "cos": math.cos, "atan": math.atan, "tanh": math.tanh, "abs": abs,
    "sign": lambda v: (v > 0) - (v < 0), "asinh": math.asinh, "heaviside": lambda v: 0.5 if v == 0 else float(v > 0),
    "floor": math.floor, "max": max, "min": min, "atan2": math.atan2, "mod": lambda p, q: p - q * math.floor(p / q),
    "where": lambda c, yes, no: yes if c else no, "pi": math.pi, "E": math.e,
}  # fmt: skip
_JUMPS = ("floor", "sign", "heaviside", "mod", "where", "atan2", "max", "min", "abs")


def _python(text: str, point: dict[str, float], change: float = 0.0) -> float:
    """Python's value of a text of the grammar below, at a point moved by a relative change; NaN where it has none."""
    try:
        values = {name: value * (1 + change) for name, value in point.items()}
        return float(eval(text.replace("x'", "x_dot"), {**_PYTHON, **values}))  # noqa: S307 (our own grammar, as witness)
    except (ArithmeticError, ValueError):
        return math.nan


def _sympy(expression: sp.Expr, point: dict[str, float]) -> float:
    value = expression.xreplace({sp.Symbol(n, real=True): sp.Float(v) for n, v in point.items()})
    return float(value) if value.is_real else math.nan


def _check_grammar_text(text: str) -> None:
    try:
        expression = parse_expression(text, NAMES)
    except ExpressionError:
        return  # constants like 1/(1 - 1): the attack list says which must be refused
    tree = to_tree(expression)
    again = from_tree(tree)
    assert to_tree(again) == tree
    agreed = []
    for point in _POINTS:
        expected, moved = _python(text, point), _python(text, point, 1e-13)
        scale = max(1.0, abs(expected))
        if not scale < 1e12 or not abs(moved - expected) <= 1e-10 * scale:
            continue  # no value, or so sensitive that rounding alone moves it
        agreed.append(all(abs(_sympy(e, point) - expected) <= 1e-9 * scale for e in (expression, again)))
    # where 3*x - x - x - x is rounded in Python and 0 in sympy, a jump may differ; but hardly at every point
    assert not agreed or (any(agreed) if any(word in text for word in _JUMPS) else all(agreed)), text


_quick = settings(max_examples=400, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
_long = settings(max_examples=6000, deadline=None, suppress_health_check=list(HealthCheck))


@given(_texts)
@_quick
def test_grammar_text_round_trips_and_agrees_with_python(text: str) -> None:
    _check_grammar_text(text)


@pytest.mark.slow
@given(_texts)
@_long
def test_grammar_text_round_trips_and_agrees_with_python_long(text: str) -> None:
    _check_grammar_text(text)


_WORDS = [*FUNCTIONS, *NAMES, "pi", "E", "lambda", "__import__", "import", "1e5", "0.5", "9" * 12, "64", "**", "//", "<=",
          ">=", "==", "!=", "and", "or", "not", "x'", "''", "(", ")", ",", "+", "-", "*", "/", "<", ">", "=", " ", ".", "e"]  # fmt: skip
_noise = st.one_of(
    st.text(max_size=60),
    st.text(alphabet="xyk0123456789+-*/(),.<>=!' eE", max_size=80),
    st.lists(st.sampled_from(_WORDS), max_size=30).map("".join),
    st.lists(st.sampled_from(_WORDS), max_size=30).map(" ".join),
)


def _check_noise(text: str) -> None:
    for read in (parse_expression, parse_equation):
        try:
            result = read(text, NAMES)
        except ExpressionError as error:
            assert error.column is None or 0 <= error.column <= len(error.text)
        else:
            assert isinstance(result, (sp.Expr, tuple))


@given(_noise)
@settings(_quick, max_examples=3000)
def test_only_expression_errors_escape(text: str) -> None:
    _check_noise(text)


@pytest.mark.slow
@given(_noise)
@settings(_long, max_examples=50_000)
def test_only_expression_errors_escape_long(text: str) -> None:
    _check_noise(text)


def test_the_limit_of_characters_is_exact() -> None:
    assert parse_expression("x" + " " * (MAX_CHARACTERS - 1), NAMES) == X
