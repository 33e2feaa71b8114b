"""Expression trees: exact round trips, one digest everywhere, and refusal of hostile trees.

Witnesses: equality of the sympy objects themselves, bit patterns of doubles, child processes with other hash seeds.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from stability.errors import CompileError, ExpressionError, FileFormatError, InputError, UnknownNameError
from stability.systems.expressions import PowerLog, differentiate
from stability.systems.nodes import KINDS
from stability.systems.tables import Table
from stability.systems.tree import MAX_DEPTH, canonical, canonical_bytes, digest, from_tree, to_tree

X, Y, F = sp.symbols("x y F")
EXPRESSIONS = [
    sp.Integer(3), sp.Rational(-2, 7), sp.Float(0.1), sp.Float(5e-324), sp.Float(1.7976931348623157e308), sp.Float(0.0),
    sp.Float("0.1", 40), sp.pi * X + sp.E, X + 1, 2 * X, X**2 / 3, sp.sqrt(X), 2**X, X**Y, (X + Y) ** sp.Rational(3, 2),
    sp.exp(-X), sp.log(X), sp.sin(X), sp.cos(X), sp.tan(X) ** 2, sp.asin(X), sp.acos(X), sp.atan(X), sp.sinh(X), sp.cosh(X),
    sp.tanh(X), sp.asinh(X), sp.acosh(X), sp.atanh(X), sp.atan2(Y, X), sp.Abs(X), sp.Abs(sp.log(X)), sp.sign(X),
    sp.Heaviside(X), sp.Heaviside(X, 1), sp.floor(X + Y), sp.Mod(X, 2 * sp.pi), sp.Max(X, Y, 0), sp.Min(X, Y),
    sp.Piecewise((X, X > 0), (-X, True)), sp.Piecewise((X, sp.And(X >= 0, Y < 1)), (Y, sp.Or(sp.Eq(X, Y), X <= -3)), (0, True)),
    sp.Piecewise((X, sp.Ne(X, Y)), (1, sp.Not(sp.And(X > 0, Y > 0))), (2, True)), PowerLog(sp.Abs(X), Y, 1), X > 0, sp.true,
    (X + Y + F) * (X - Y) / (1 + X**2) + sp.Max(sp.sin(X), 0) * sp.Heaviside(Y) - sp.Float(1 / 3) * X * Y * F,
]  # fmt: skip


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_round_trip_gives_the_same_object_and_the_same_tree(expression: sp.Basic) -> None:
    tree = json.loads(json.dumps(to_tree(expression)))
    again = from_tree(tree)
    assert again == canonical(expression)
    assert to_tree(again) == tree
    assert all(symbol.is_real for symbol in again.free_symbols)


def test_every_kind_of_node_is_in_the_round_trip() -> None:
    def kinds(tree: object) -> set[str]:
        if not isinstance(tree, list):
            return set()
        return {tree[0] if tree and isinstance(tree[0], str) else ""}.union(*map(kinds, tree))

    seen = set().union(*(kinds(to_tree(e)) for e in EXPRESSIONS))
    assert set(KINDS) | {"piecewise", "symbol", "integer", "rational", "float", "pi", "e", "true"} <= seen


@given(st.floats(allow_nan=False, allow_infinity=False))
@settings(max_examples=300, deadline=None)
def test_doubles_survive_to_the_bit(value: float) -> None:
    back = from_tree(json.loads(json.dumps(to_tree(sp.Float(value)))))
    assert np.float64(float(back)).tobytes() == np.float64(value + 0.0).tobytes()  # sympy has no negative zero


@given(st.integers(-(2**1000), 2**1000), st.integers(1, 2**1000))
@settings(max_examples=100, deadline=None)
def test_exact_numbers_survive(p: int, q: int) -> None:
    assert from_tree(to_tree(sp.Rational(p, q))) == sp.Rational(p, q)


def test_tables_travel_inside_trees() -> None:
    x = np.linspace(-1, 1, 9)
    table = Table.from_samples("spring", x, x**3 + x)
    expression = 2 * table(X) + table.derivative()(Y)
    tree = json.loads(json.dumps(to_tree(expression)))
    again = from_tree(tree)
    assert again == canonical(expression) and to_tree(again) == tree
    (first,) = [f for f in again.atoms(sp.Function) if f.table.name == "spring"]
    assert first.table.evaluate(0.3) == table.evaluate(0.3)
    assert digest(tree) != digest(to_tree(2 * Table.from_samples("spring", x, x**3)(X) + table.derivative()(Y)))


def test_derivatives_by_our_rules_are_data_too() -> None:
    x, p = sp.symbols("x p", real=True)
    for e in (sp.sign(x) * sp.Abs(x) ** p, sp.Max(x, p) ** 2, sp.Mod(x, p), sp.Abs(x) ** p):
        for s in (x, p):
            derivative = differentiate(e, s)
            assert from_tree(to_tree(derivative)) == canonical(derivative)


# ----------------------------------------------------------------------------------------------------- canonical form


def test_symbols_become_real_whatever_they_were() -> None:
    real, positive, plain = sp.Symbol("x", real=True), sp.Symbol("x", positive=True), sp.Symbol("x")
    assert canonical(real + positive + plain) == 3 * real
    assert to_tree(sp.sqrt(plain**2)) == ["abs", ["symbol", "x"]]


def test_order_and_evaluation_do_not_matter() -> None:
    a = sp.Add(X, sp.Mul(2, Y + 1, evaluate=False), F, evaluate=False)
    b = sp.Add(F, sp.Integer(2), 2 * Y, X, evaluate=False)
    assert to_tree(a) == to_tree(b)
    assert digest(to_tree(sp.Max(X, Y, F))) == digest(to_tree(sp.Max(F, Y, X)))


def test_rewritten_functions_have_the_same_values() -> None:
    for f in (sp.cot, sp.sec, sp.csc, sp.coth, sp.sech, sp.csch, sp.acot, sp.ceiling, sp.frac):
        for value in (0.7, 1.9, -0.3):
            expected = float(f(sp.Float(value)))
            got = float(canonical(f(X)).subs(sp.Symbol("x", real=True), value))
            assert abs(got - expected) <= 1e-13 * max(1, abs(expected)), f


def test_names_are_checked() -> None:
    assert canonical(X + Y, ["x", "y"]).free_symbols == {sp.Symbol("x", real=True), sp.Symbol("y", real=True)}
    with pytest.raises(UnknownNameError, match="did you mean 'x1'"):
        canonical(sp.Symbol("x2") + 1, ["x1", "beta"])


@pytest.mark.parametrize(
    ("expression", "error", "word"),
    [
        (sp.erf(X), CompileError, "'erf'"),
        (sp.gamma(X), CompileError, "'gamma'"),
        (sp.DiracDelta(X), CompileError, "'DiracDelta'"),
        (sp.Function("g")(X), CompileError, "'g'"),
        (sp.Function("x")(X).diff(X), CompileError, "the function"),
        (sp.Integral(X, X), CompileError, "'Integral'"),
        (sp.EulerGamma * X, CompileError, "EulerGamma"),
        (sp.besselj(0, X), CompileError, "'besselj'"),
        (sp.I * X, ExpressionError, "not real"),
        (sp.oo, ExpressionError, "not finite"),
        (sp.nan, ExpressionError, "not finite"),
        (sp.zoo * X, ExpressionError, "not finite"),
        (X * sp.exp(1000), ExpressionError, "too large"),
        (X**5000, ExpressionError, "exponent"),
        (sp.Integer(10) ** 400 * X, ExpressionError, "too large"),
        (sp.Float("1e400"), ExpressionError, "too large"),
        (sp.Symbol("a__b"), ExpressionError, "not allowed"),
        (sp.Symbol("__import__('os')"), ExpressionError, "not allowed"),
        (sp.Symbol("\u03b1"), ExpressionError, "not allowed"),
        ("x + 1", InputError, "parse_expression"),
        (None, InputError, "needed"),
        ([X], InputError, "needed"),
        (sp.Matrix([X]), InputError, "scalar"),
    ],
)
def test_what_cannot_be_data_is_named(expression: object, error: type, word: str) -> None:
    with pytest.raises(error, match=word.replace("(", r"\(")):
        to_tree(expression)


def test_deep_expressions_are_refused_not_overflowed() -> None:
    e = X
    for _ in range(MAX_DEPTH + 5):
        e = sp.sin(e)
    with pytest.raises(ExpressionError, match="deeper"):
        to_tree(e)


# ------------------------------------------------------------------------------------------------------------- digest

_CHILD = """
import sympy as sp
from stability.systems.tree import digest, to_tree
names = "a b c d e1 f g h x y z".split()
s = sp.symbols(names)
e = sum(s[i] * s[(3 * i + 1) % 11] ** (i + 1) for i in range(11)) + sp.Max(*s[:6]) + sp.sin(s[2] * s[3] + s[4] * s[5])
e += sp.Piecewise((s[0], sp.And(s[1] > 0, s[2] < s[3], sp.Or(s[4] > 1, s[5] > 2))), (s[6] * s[7], True))
print(digest(to_tree(e)))
"""


def test_digest_is_the_same_for_every_hash_seed() -> None:
    found = set()
    for seed in range(4):
        environment = {**os.environ, "PYTHONHASHSEED": str(seed)}
        done = subprocess.run([sys.executable, "-c", _CHILD], capture_output=True, text=True, env=environment, check=True)
        found.add(done.stdout.strip())
    assert len(found) == 1 and len(found.pop()) == 64


def test_digest_of_a_known_tree() -> None:
    tree = to_tree(2 * X)
    assert canonical_bytes(tree) == b'["mul",["integer",2],["symbol","x"]]'
    assert digest(tree) == "dd92bfea0f50135b95639f51ba5f06f3570b83ac31554214a97eed657038d061"  # sha256sum of those bytes


def test_canonical_bytes_take_plain_data_only() -> None:
    for data in (float("nan"), float("inf"), {1, 2}, X, b"x"):
        with pytest.raises(FileFormatError):
            canonical_bytes([data])


# ------------------------------------------------------------------------------------------------------ hostile trees


def _nested(levels: int) -> list:
    tree: list = ["symbol", "x"]
    for _ in range(levels):
        tree = ["sin", tree]
    return tree


_INTEGER = ["integer", 2]
HOSTILE = [
    None, 1, 1.5, "x", True, [], {}, [[]], [1], [None], [["symbol", "x"]], ["symbol"], ["symbol", 1], ["symbol", "x", "y"],
    ["symbol", ""], ["symbol", "1x"], ["symbol", "_x"], ["symbol", "x__y"], ["symbol", "x.y"], ["symbol", "x y"],
    ["symbol", "\u03b1"], ["symbol", "x\n"], ["symbol", "x" * 65], ["symbol", "__import__('os')"], ["symbol", ["x"]],
    ["integer"], ["integer", "2"], ["integer", 2.0], ["integer", True], ["integer", None], ["integer", 10**400],
    ["integer", 10**2000], ["integer", 1, 2], ["rational", 1], ["rational", 1, 0], ["rational", 1, -2], ["rational", 1, 1],
    ["rational", 1.0, 2], ["rational", "1", 2], ["float"], ["float", 0.5], ["float", "nan"], ["float", "inf"], ["float", "-inf"],
    ["float", "0x1p+99999"], ["float", "eval(1)"], ["float", "1" * 100], ["float", 1, 2], ["float", 1, 2, 0], ["float", 1, 10**9, 53],
    ["float", 1, 5000, 53], ["float", 1, 0, 10**9], ["float", True, 0, 53], ["pi", 1], ["e", []], ["I"], ["oo"], ["zoo"], ["nan"],
    ["sqrt", _INTEGER], ["eval", "1"], ["__class__"], ["Symbol", "x"], ["srepr", "x"], ["lambda", "x"], ["add"], ["add", _INTEGER],
    ["mul"], ["mul", _INTEGER], ["pow", _INTEGER], ["pow", _INTEGER, _INTEGER, _INTEGER], ["sin"], ["sin", _INTEGER, _INTEGER],
    ["sin", 1], ["sin", "x"], ["sin", None], ["sin", {}], ["sin", ["true"]], ["add", _INTEGER, ["true"]], ["and", _INTEGER, _INTEGER],
    ["not", ["symbol", "x"]], ["lt", ["true"], _INTEGER], ["max", _INTEGER], ["max", *([["symbol", "x"]] * 17)], ["heaviside"],
    ["piecewise"], ["piecewise", _INTEGER], ["piecewise", [_INTEGER]], ["piecewise", [_INTEGER, _INTEGER]],
    ["piecewise", [["true"], ["true"]]], ["piecewise", [_INTEGER, ["false"]]], ["piecewise", [_INTEGER, ["true"], _INTEGER]],
    ["pow", ["integer", 10], ["pow", ["integer", 10], ["integer", 10]]], ["pow", ["integer", 10], ["integer", 400]],
    ["pow", ["symbol", "x"], ["integer", 5000]], ["pow", ["integer", -1], ["rational", 1, 2]], ["pow", ["integer", 0], ["integer", -1]],
    ["exp", ["exp", ["exp", ["integer", 9]]]], ["log", ["integer", 0]], ["asin", ["integer", 2]], ["mod", ["symbol", "x"], ["integer", 0]],
    ["pow", ["mul", ["integer", -1], ["pow", ["symbol", "x"], ["integer", 2]]], ["rational", 1, 2]], _nested(200), _nested(20_000),
    ["table"], ["table", {}], ["table", {}, ["symbol", "x"]], ["table", [], ["symbol", "x"]], ["table", {"name": "f"}, ["symbol", "x"]],
    ["table", {"name": "a__b", "breakpoints": [0, 1], "rows": [[0], [0], [0]], "extrapolate": "linear"}, ["symbol", "x"]],
    ["table", {"name": "f", "breakpoints": [0, "1"], "rows": "x", "extrapolate": "linear"}, ["symbol", "x"]],
    ["table", {"name": "f", "breakpoints": [1, 0], "rows": [[0], [0], [0]], "extrapolate": "linear"}, ["symbol", "x"]],
    ["table", {"name": "f", "breakpoints": [0, 1], "rows": [[0], [0], [0]], "extrapolate": "linear"}, ["true"]],
    ["table", {"name": "f", "breakpoints": [0, 1], "rows": [[0], [0], [0]], "extrapolate": []}, ["symbol", "x"]],
    ["table", {"name": "f", "breakpoints": [0, 1], "rows": [[0], [{}], [0]], "extrapolate": "nan"}, ["symbol", "x"]],
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(HOSTILE)))
def test_hostile_tree_is_refused(number: int) -> None:
    with pytest.raises((FileFormatError, ExpressionError)):
        from_tree(HOSTILE[number])


def test_a_bomb_of_shared_lists_is_refused_before_it_unfolds() -> None:
    tree: list = ["symbol", "x"]
    for _ in range(60):
        tree = ["add", tree, tree]  # 2^60 nodes if unfolded, 60 lists in memory
    with pytest.raises(FileFormatError, match="too many"):
        from_tree(tree)


_plain = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.sampled_from([*KINDS, "symbol", "x"])),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=3), inner, max_size=2)),
    max_leaves=15,
)


@given(st.one_of(_plain, st.builds(lambda kind, rest: [kind, *rest], st.sampled_from([*KINDS, "table", "float"]), st.lists(_plain))))
@settings(max_examples=500, deadline=None)
def test_only_typed_errors_escape_from_any_plain_data(tree: object) -> None:
    try:
        result = from_tree(tree)
    except (FileFormatError, ExpressionError, CompileError):
        return
    assert isinstance(result, sp.Basic)
