"""Derivatives of right-hand sides with kinks and jumps: d/dx for code that is evaluated, not for distributions.

sympy differentiates in the sense of distributions (sign' = 2 delta) and leaves forms that are NaN at the kink. A
right-hand side is evaluated at points, so its derivatives here are the one-sided or almost-everywhere ones:

    d sign(u) = d Heaviside(u) = d floor(u) = 0            d |u| = sign(u) u'
    d sign(u) |u|^p = p |u|^(p-1) u'                       d |u|^p = p |u|^(p-1) sign(u) u'
    d max(u, v) = u' where u >= v, else v'                 d Mod(u, v) = u' - floor(u/v) v'
    d Piecewise = branch by branch, the conditions kept    d u^p/dp = u^p log u, and 0 at u = 0 for p > 0
    d max(u, v)^p, d Piecewise^p = branch by branch, too   (contact laws: 0 out of contact in every derivative)

At a tie of `Max` or `Min` the argument that sympy lists first gives the derivative, always. A point where the true
derivative is infinite (|u|^(1/2) at 0) stays infinite. Every consumer (evaluators, averaging) uses `differentiate`,
so no derivative contains DiracDelta, Derivative or Subs.

Reference: F. H. Clarke, Optimization and Nonsmooth Analysis (1983), chapter 2: each choice above is an element of the
generalised gradient.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from ..errors import CompileError
from .tables import TableFunction

__all__ = ["PowerLog", "alternatives", "differentiate"]

Memo = dict[sp.Basic, sp.Expr]
Pairs = list[tuple[sp.Expr, sp.Basic]]


class PowerLog(sp.Function):
    """u^p (log u)^k, k a non-negative integer, with its limit 0 at u = 0 for p > 0: the derivatives of u^p over p.

    >>> u, p = sp.symbols("u p", real=True)
    >>> differentiate(abs(u)**p, p)
    PowerLog(Abs(u), p, 1)
    """

    nargs = 3

    @classmethod
    def eval(cls, base: sp.Expr, exponent: sp.Expr, count: sp.Expr) -> sp.Expr | None:
        """Without a logarithm it is an ordinary power."""
        return base**exponent if count == 0 else None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """p u^(p-1) (log u)^k + k u^(p-1) (log u)^(k-1) over u; one logarithm more over p."""
        base, exponent, count = self.args
        if argindex == 1:
            return exponent * PowerLog(base, exponent - 1, count) + count * PowerLog(base, exponent - 1, count - 1)
        if argindex == 2:
            return PowerLog(base, exponent, count + 1)
        return sp.S.Zero


def differentiate(expression: Any, symbol: sp.Symbol) -> sp.Expr:
    """Derivative of `expression` over `symbol` by the rules at the head of this file.

    Parameters
    ----------
    expression : sympy expression (or a number)
    symbol : sympy.Symbol

    Returns
    -------
    sympy.Expr
        Finite wherever the derivative is; free of DiracDelta, Derivative, Subs.

    Raises
    ------
    CompileError
        A function without a derivative rule; the sentence names it.

    Examples
    --------
    >>> x = sp.Symbol("x", real=True)
    >>> differentiate(sp.sign(x) * sp.Abs(x)**sp.Rational(3, 2), x)
    3*sqrt(Abs(x))/2
    >>> differentiate(sp.sign(x), x)
    0
    """
    return _derivative(sp.sympify(expression), symbol, {})


def _derivative(node: sp.Basic, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    if node == symbol:
        return sp.S.One
    if not node.args:
        return sp.S.Zero
    known = memo.get(node)
    if known is None:
        # a table before the rules by class name: a user may call one "floor"
        rule = _table if isinstance(node, TableFunction) else _RULES.get(type(node).__name__, _chain_rule)
        known = memo[node] = rule(node, symbol, memo)
    return known


def _sum(node: sp.Add, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    return sp.Add(*(_derivative(a, symbol, memo) for a in node.args))


def _product(node: sp.Mul, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    terms = []
    for i, factor in enumerate(node.args):
        slope = _derivative(factor, symbol, memo)
        if slope != 0:
            terms.append(_absorb_signs(sp.Mul(*node.args[:i], slope, *node.args[i + 1 :])))
    return sp.Add(*terms)


def _absorb_signs(product: sp.Expr) -> sp.Expr:
    """sign(u)^2 |u|^q -> |u|^q: the same number off u = 0, and the right one at u = 0 (no 0 * inf, no 0 * 0^0)."""
    factors = sp.Mul.make_args(product)
    moduli = {f.as_base_exp()[0].args[0] for f in factors if isinstance(f.as_base_exp()[0], sp.Abs)}
    if not moduli:
        return product
    kept = []
    for factor in factors:
        base, exponent = factor.as_base_exp()
        if isinstance(base, sp.sign) and base.args[0] in moduli and exponent.is_Integer and exponent >= 2:
            factor = base ** (exponent % 2)
        kept.append(factor)
    return sp.Mul(*kept)


def _power(node: sp.Pow, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    base, exponent = node.args
    pairs = None if exponent.is_Integer and exponent.is_positive else alternatives(base)
    if pairs is not None:
        return _branches(sp.Piecewise(*((value**exponent, c) for value, c in pairs), evaluate=False), symbol, memo)
    base_slope, exponent_slope = _derivative(base, symbol, memo), _derivative(exponent, symbol, memo)
    total = sp.S.Zero
    if base_slope != 0:
        total += _absorb_signs(exponent * base ** (exponent - 1) * base_slope)
    if exponent_slope != 0:
        factor = node * sp.log(base) if base.is_positive else PowerLog(base, exponent, 1)
        total += factor * exponent_slope
    return total


def _zero(node: sp.Basic, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    return sp.S.Zero


def _modulus(node: sp.Abs, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    inner = node.args[0]  # not known to be real (log(x), say): sympy must not split it into real and imaginary parts
    slope = _derivative(inner, symbol, memo)
    return sp.sign(inner, evaluate=bool(inner.is_extended_real)) * slope if slope != 0 else sp.S.Zero


def _remainder(node: sp.Mod, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    value, period = node.args
    return _derivative(value, symbol, memo) - sp.floor(value / period) * _derivative(period, symbol, memo)


def _fraction(node: sp.Expr, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    return _derivative(node.args[0], symbol, memo)


def _selection(node: sp.Expr, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    """Max and Min: the slope of the argument that is chosen; at a tie the first in the argument order."""
    pairs = [(_derivative(value, symbol, memo), condition) for value, condition in _chosen(node)]
    if all(slope == pairs[0][0] for slope, _ in pairs):
        return pairs[0][0]
    return sp.Piecewise(*pairs, evaluate=False)


def _chosen(node: sp.Expr) -> Pairs:
    """Max and Min as values with conditions."""
    wins = sp.Ge if isinstance(node, sp.Max) else sp.Le
    pairs: Pairs = []
    for i, argument in enumerate(node.args[:-1]):
        tests = [wins(argument, other, evaluate=False) for other in node.args[i + 1 :]]
        pairs.append((argument, tests[0] if len(tests) == 1 else sp.And(*tests, evaluate=False)))
    return [*pairs, (node.args[-1], sp.true)]


def alternatives(node: sp.Basic) -> Pairs | None:
    """Values with conditions of a selection, also under a modulus or as a factor; None where nothing is selected.

    A power is differentiated alternative by alternative: max(u, 0)^(3/2) has second derivative 0 where u < 0, but the
    chain rule through the maximum gives max(u, 0)^(-1/2) times 0, which is NaN.
    """
    if isinstance(node, (sp.Max, sp.Min)):
        return _chosen(node)
    if isinstance(node, sp.Piecewise):
        return [tuple(pair.args) for pair in node.args]
    if isinstance(node, sp.Abs):
        inner = alternatives(node.args[0])
        return None if inner is None else [(sp.Abs(value), condition) for value, condition in inner]
    if isinstance(node, sp.Mul):
        for i, factor in enumerate(node.args):
            inner = alternatives(factor)
            if inner is not None:
                rest = sp.Mul(*node.args[:i], *node.args[i + 1 :])
                return [(rest * value, condition) for value, condition in inner]
    return None


def _branches(node: sp.Piecewise, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    pairs = [(_derivative(value, symbol, memo), condition) for value, condition in node.args]
    if all(slope == 0 for slope, _ in pairs):
        return sp.S.Zero
    return sp.Piecewise(*pairs, evaluate=False)


def _table(node: TableFunction, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    slope = _derivative(node.args[0], symbol, memo)
    return node.fdiff() * slope if slope != 0 else sp.S.Zero


def _chain_rule(node: sp.Basic, symbol: sp.Symbol, memo: Memo) -> sp.Expr:
    slopes = [_derivative(a, symbol, memo) for a in node.args]
    if all(s == 0 for s in slopes):
        return sp.S.Zero
    name = type(node).__name__
    if isinstance(node, AppliedUndef) or not isinstance(node, sp.Function):
        raise CompileError(f"'{name}' has no derivative rule; write it with elementary functions or as a Table")
    total = sp.S.Zero
    for i, slope in enumerate(slopes):
        if slope == 0:
            continue
        outer = node.fdiff(i + 1)
        if outer.has(sp.Derivative, sp.Subs, sp.DiracDelta):
            raise CompileError(f"'{name}' has no closed derivative; write it with elementary functions or as a Table")
        total += outer * slope
    return total


_RULES: dict[str, Callable[..., sp.Expr]] = {
    "Add": _sum,
    "Mul": _product,
    "Pow": _power,
    "Abs": _modulus,
    "sign": _zero,
    "Heaviside": _zero,
    "floor": _zero,
    "ceiling": _zero,
    "frac": _fraction,
    "Mod": _remainder,
    "Max": _selection,
    "Min": _selection,
    "Piecewise": _branches,
}
