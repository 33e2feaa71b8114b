"""Expressions as data: sympy expression <-> nested lists that JSON can carry, one canonical form, one digest.

A tree is a list whose first entry is the kind of the node (see nodes.py):

    ["symbol", "x"]   ["integer", 3]   ["rational", 1, 3]   ["float", "0x1.999999999999ap-4"]   ["pi"]   ["e"]
    ["add", a, b, ...]   ["pow", base, exponent]   ["sin", a]   ["piecewise", [value, condition], ...]   ["true"]
    ["table", plain data, a]                    tabulated functions (tables.py)

Doubles are written in hexadecimal (other precisions as mantissa, exponent, bits), so that the round trip is exact to
the bit. Arguments of commutative nodes are sorted by their own bytes, not by sympy's order or by hash: the same
expression has the same bytes, and the same SHA-256 digest, in every process and with every version of sympy.
`from_tree` takes trees from files: it checks size, depth, names and numbers, builds sympy nodes from a table, and
evaluates no text. The inverse holds both ways: from_tree(to_tree(e)) == canonical(e), to_tree(from_tree(t)) == t for
every t that to_tree gave.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from typing import Any

import sympy as sp

from ..errors import CompileError, ExpressionError, FileFormatError, InputError, unknown_name
from .nodes import KINDS, Builder, kind_of, real_symbol, valid_name
from .tables import Table, TableFunction

__all__ = ["MAX_DEPTH", "MAX_NODES", "canonical", "canonical_bytes", "digest", "from_tree", "to_tree"]

MAX_NODES = 100_000
MAX_DEPTH = 150
Tree = list[Any]

# classes that sympy's simplifications like to introduce, in terms of the kinds of nodes.py
_REWRITES: dict[Any, Callable[..., sp.Basic]] = {
    sp.cot: lambda a: sp.cos(a) / sp.sin(a),
    sp.sec: lambda a: 1 / sp.cos(a),
    sp.csc: lambda a: 1 / sp.sin(a),
    sp.coth: lambda a: 1 / sp.tanh(a),
    sp.sech: lambda a: 1 / sp.cosh(a),
    sp.csch: lambda a: 1 / sp.sinh(a),
    sp.acot: lambda a: sp.atan(1 / a),
    sp.ceiling: lambda a: -sp.floor(-a),
    sp.frac: lambda a: a - sp.floor(a),
    sp.ITE: lambda c, yes, no: sp.Or(sp.And(c, yes), sp.And(sp.Not(c), no)),
    sp.re: lambda a: a,  # every quantity is real where it is defined
    sp.conjugate: lambda a: a,
}


def canonical(expr: Any, names: Iterable[str] | None = None) -> sp.Basic:
    """The expression in the library's form: real symbols, evaluated nodes of the known kinds only.

    Parameters
    ----------
    expr : sympy expression, number or condition
        Text is refused (see `stability.systems.parsing.parse_expression`).
    names : iterable of str, optional
        The symbols that may occur; any when not given. Symbols of any assumptions become ``Symbol(name, real=True)``.

    Raises
    ------
    UnknownNameError
        A symbol that is not among `names`.
    CompileError
        A function that the library does not know; the sentence names it.
    ExpressionError
        A constant part that is not a finite real number, or a name that could not be written.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> canonical(sp.sqrt(x**2)), canonical(sp.sec(x))
    (Abs(x), 1/cos(x))
    """
    allowed = None if names is None else list(names)
    node = _sympified(expr)
    for _ in range(4):  # a rebuilt node may let its parent simplify once more
        rebuilt = _rebuild(node, allowed, Builder(), {}, 0)
        if rebuilt == node:
            break
        node = rebuilt
    return rebuilt


def _sympified(expr: Any) -> sp.Basic:
    if isinstance(expr, (str, bytes)):
        raise InputError(f"an expression is needed, not the text {expr!r}; parse_expression(text, names) reads text")
    try:
        node = sp.sympify(expr, strict=True)
    except sp.SympifyError:
        raise InputError(f"an expression is needed, not {type(expr).__name__}") from None
    if not isinstance(node, (sp.Expr, sp.logic.boolalg.Boolean)) or getattr(node, "is_Matrix", False):
        raise InputError(f"a scalar expression is needed, not {type(node).__name__}")
    return node


def _rebuild(
    node: sp.Basic, names: list[str] | None, builder: Builder, memo: dict[sp.Basic, sp.Basic], depth: int
) -> sp.Basic:
    if node in memo:
        return memo[node]
    if depth > MAX_DEPTH:
        raise ExpressionError(f"the expression is nested deeper than {MAX_DEPTH} levels")
    if isinstance(node, sp.Symbol):
        if names is not None and node.name not in names:
            raise unknown_name("symbol", node.name, names, "this expression may use")
        result: sp.Basic = real_symbol(node.name)
    elif not node.args:
        builder.value(node)
        result = node
    elif isinstance(node, sp.Piecewise):
        pairs = [tuple(_rebuild(part, names, builder, memo, depth + 1) for part in pair.args) for pair in node.args]
        result = builder.piecewise(pairs)
    else:
        _check_known(node)
        args = [_rebuild(arg, names, builder, memo, depth + 1) for arg in node.args]
        result = _rebuilt_function(node, args, builder)
    memo[node] = result
    return result


def _rebuilt_function(node: sp.Basic, args: list[sp.Basic], builder: Builder) -> sp.Basic:
    kind = kind_of(node)
    if kind is not None:
        return builder.build(kind.name, args)
    if isinstance(node, TableFunction):
        result = node.func(*args)
        builder.value(result)
        return result
    return _rebuild(_REWRITES[type(node)](*args), None, builder, {}, 0)


def _check_known(node: sp.Basic) -> None:
    if kind_of(node) is None and not isinstance(node, TableFunction) and type(node) not in _REWRITES:
        raise CompileError(
            f"the function '{type(node).__name__}' in {_shortened(node)} is not among those the library compiles: "
            f"{', '.join(KINDS)}; write it with these, or give the system as a Python function (System.from_function)"
        )


def _shortened(node: sp.Basic) -> str:
    text = str(node)
    return text if len(text) <= 60 else text[:57] + "..."


# ------------------------------------------------------------------------------------------------ expression -> tree


def to_tree(expr: Any) -> Tree:
    """The JSON-able tree of ``canonical(expr)``.

    Raises
    ------
    CompileError, ExpressionError
        As `canonical`.

    Examples
    --------
    >>> to_tree(2 * sp.Symbol("x"))
    ['mul', ['integer', 2], ['symbol', 'x']]
    """
    memo: dict[sp.Basic, tuple[Tree, bytes, int]] = {}
    tree, _, size = _tree(canonical(expr), memo)
    if size > MAX_NODES:
        raise ExpressionError(f"the expression has {size} nodes; at most {MAX_NODES} are kept")
    return tree


def _tree(node: sp.Basic, memo: dict[sp.Basic, tuple[Tree, bytes, int]]) -> tuple[Tree, bytes, int]:
    """Tree, its canonical bytes (the sort key of commutative parents) and its number of nodes."""
    if node.args and node in memo:
        return memo[node]
    if isinstance(node, sp.Piecewise):
        pairs = [[_tree(part, memo) for part in pair.args] for pair in node.args]
        tree: Tree = ["piecewise", *([part[0] for part in pair] for pair in pairs)]
        key = b'["piecewise",' + b",".join(b"[" + b",".join(part[1] for part in pair) + b"]" for pair in pairs) + b"]"
        size = 1 + sum(part[2] for pair in pairs for part in pair)
    elif node.args:
        children = [_tree(arg, memo) for arg in node.args]
        kind = kind_of(node)
        if kind is not None and kind.commutative:
            children.sort(key=lambda child: child[1])
        head = [kind.name] if kind is not None else ["table", node.table.to_dict()]
        tree = [*head, *(child[0] for child in children)]
        key = canonical_bytes(head)[:-1] + b"," + b",".join(child[1] for child in children) + b"]"
        size = 1 + sum(child[2] for child in children)
    else:
        tree, size = _leaf_tree(node), 1
        return tree, canonical_bytes(tree), size
    memo[node] = (tree, key, size)
    return memo[node]


def _leaf_tree(node: sp.Basic) -> Tree:
    if isinstance(node, sp.Symbol):
        return ["symbol", node.name]
    if isinstance(node, sp.Integer):
        return ["integer", int(node)]
    if isinstance(node, sp.Rational):
        return ["rational", int(node.p), int(node.q)]
    if isinstance(node, sp.Float):
        if node._prec == 53 and sp.Float(float(node)) == node:
            return ["float", float(node).hex()]
        sign, mantissa, exponent, _ = node._mpf_
        return ["float", -int(mantissa) if sign else int(mantissa), int(exponent), int(node._prec)]
    for name, constant in _CONSTANTS.items():
        if node is constant:
            return [name]
    raise CompileError(f"'{node}' ({type(node).__name__}) has no place in an expression")


_CONSTANTS: dict[str, sp.Basic] = {"pi": sp.pi, "e": sp.E, "true": sp.true, "false": sp.false}

# ------------------------------------------------------------------------------------------------ tree -> expression


def from_tree(tree: Any) -> sp.Basic:
    """The expression of a tree; everything in it is checked, whoever wrote it.

    Raises
    ------
    FileFormatError
        Not a tree: wrong types, unknown kind, wrong number of entries, too many nodes, too deep.
    ExpressionError
        A tree of an expression that is not allowed (see nodes.py).

    Examples
    --------
    >>> from_tree(["pow", ["symbol", "x"], ["integer", 2]])
    x**2
    """
    _measure(tree)
    builder = Builder()
    node = _expression(tree, builder)
    builder.value(node)
    return node


def _measure(tree: Any) -> None:
    """Count nodes and depth without recursion, before anything is built."""
    count, stack = 0, [(tree, 0)]
    while stack:
        item, depth = stack.pop()
        count += 1
        if count > 20 * MAX_NODES or depth > 2 * MAX_DEPTH + 8:
            raise FileFormatError(f"an expression tree has too many nodes (> {MAX_NODES}) or levels (> {MAX_DEPTH})")
        if isinstance(item, list):
            stack.extend((part, depth + 1) for part in item)
        elif isinstance(item, dict):
            stack.extend((part, depth + 1) for part in item.values())


def _expression(tree: Any, builder: Builder, depth: int = 0) -> sp.Basic:
    if depth > MAX_DEPTH:
        raise FileFormatError(f"an expression tree has more than {MAX_DEPTH} levels")
    if not isinstance(tree, list) or not tree or not isinstance(tree[0], str):
        raise FileFormatError(f"an expression tree must be a list that starts with a kind, not {_shown(tree)}")
    name, entries = tree[0], tree[1:]
    if name in _LEAVES:
        return _LEAVES[name](entries)
    if name == "piecewise":
        if not all(isinstance(pair, list) and len(pair) == 2 for pair in entries):
            raise FileFormatError("'piecewise' needs pairs [value, condition]")
        return builder.piecewise([tuple(_expression(part, builder, depth + 1) for part in pair) for pair in entries])
    if name == "table":
        return _table(entries, builder, depth)
    if name not in KINDS:
        raise FileFormatError(f"unknown kind of node {_shown(name)} in an expression tree")
    return builder.build(name, [_expression(entry, builder, depth + 1) for entry in entries])


def _table(entries: list[Any], builder: Builder, depth: int) -> sp.Basic:
    if len(entries) != 2 or not isinstance(entries[0], dict) or not valid_name(entries[0].get("name")):
        raise FileFormatError("'table' needs its data (with a plain name) and one argument")
    argument = _expression(entries[1], builder, depth + 1)
    if not isinstance(argument, sp.Expr):
        raise ExpressionError("a table takes a number, not a comparison")
    try:
        table = Table.from_dict(entries[0])
    except (InputError, TypeError, ValueError, KeyError) as error:
        raise FileFormatError(f"damaged table data: {error}") from None
    node = table(argument)
    builder.value(node)
    return node


def _symbol(entries: list[Any]) -> sp.Basic:
    if len(entries) != 1 or not valid_name(entries[0]):
        raise FileFormatError(f"a symbol needs one name (letters, digits, single underscores), not {_shown(entries)}")
    return real_symbol(entries[0])


def _integers(entries: list[Any], count: int, what: str) -> list[int]:
    if len(entries) != count or not all(type(e) is int for e in entries):
        raise FileFormatError(f"'{what}' needs {count} whole numbers, not {_shown(entries)}")
    if any(abs(e).bit_length() > 4096 for e in entries):
        raise FileFormatError(f"'{what}' holds a number of more than 4096 bits")
    return entries


def _rational(entries: list[Any]) -> sp.Basic:
    p, q = _integers(entries, 2, "rational")
    if q < 2:
        raise FileFormatError(f"the denominator of a rational must be at least 2, not {q}")
    return sp.Rational(p, q)


def _float(entries: list[Any]) -> sp.Basic:
    if len(entries) == 3:
        mantissa, exponent, bits = _integers(entries, 3, "float")
        if not (2 <= bits <= 4096 and abs(exponent) <= 8192):
            raise FileFormatError(f"a float of {bits} bits and exponent {exponent} is outside what is kept")
        size = abs(mantissa)
        return sp.Float((int(mantissa < 0), size, exponent, size.bit_length()), precision=bits)
    if len(entries) != 1 or not isinstance(entries[0], str) or len(entries[0]) > 40:
        raise FileFormatError(f"'float' needs one hexadecimal number as text, not {_shown(entries)}")
    try:
        return sp.Float(float.fromhex(entries[0]))
    except (ValueError, OverflowError):
        raise FileFormatError(f"'float' needs one hexadecimal number as text, not {_shown(entries)}") from None


def _constant(name: str) -> Callable[[list[Any]], sp.Basic]:
    def constant(entries: list[Any]) -> sp.Basic:
        if entries:
            raise FileFormatError(f"'{name}' takes no entries")
        return _CONSTANTS[name]

    return constant


_LEAVES: dict[str, Callable[[list[Any]], sp.Basic]] = {
    "symbol": _symbol,
    "integer": lambda entries: sp.Integer(_integers(entries, 1, "integer")[0]),
    "rational": _rational,
    "float": _float,
    **{name: _constant(name) for name in _CONSTANTS},
}


def _shown(value: Any) -> str:
    text = repr(value) if not isinstance(value, (list, dict)) else type(value).__name__
    return text if len(text) <= 40 else text[:37] + "..."


# ------------------------------------------------------------------------------------------------------------ digest


def canonical_bytes(tree: Any) -> bytes:
    """The one JSON text of plain data: sorted keys, no spaces, ASCII; NaN and infinities are refused."""
    try:
        text = json.dumps(tree, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    except (TypeError, ValueError, RecursionError):
        raise FileFormatError("this is not plain data (lists, texts, finite numbers)") from None
    return text.encode("ascii")


def digest(tree: Any) -> str:
    """SHA-256 of `canonical_bytes`, as 64 hexadecimal digits: equal for equal content, in any process."""
    return hashlib.sha256(canonical_bytes(tree)).hexdigest()
