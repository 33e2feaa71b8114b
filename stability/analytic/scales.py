"""Expansion of a right-hand side in the small parameter that its scaling orders declare.

Every symbol s with order o_s stands for eps^o_s s (parameters, coordinates; a velocity has the order of its
coordinate). An expression becomes a truncated power series

    f = eps^m (f_m + eps f_{m+1} + ...),     f_k free of eps,

by arithmetic on series: sums, products, powers (binomial series about the leading term) and smooth functions (Taylor
about the part of order zero, which must not contain a state). sin(theta) with theta = O(eps) is so cut at the order
that the averaging needs; polynomials stay exact. Each series knows the first order it does not know, so that a
cancellation of leading terms (a mass matrix that nearly decouples) is met by a longer expansion, not by a wrong one.
Orders are rational numbers. Reference: Nayfeh and Mook, Nonlinear Oscillations (1979), section 2.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy as sp

from ..errors import EquationError

__all__ = ["Graded", "graded"]

_SMOOTH = (sp.sin, sp.cos, sp.tan, sp.exp, sp.log, sp.sinh, sp.cosh, sp.tanh, sp.atan, sp.asin)
_EXACT = Fraction(10**9)


@dataclass(frozen=True)
class Graded:
    """A truncated series: order -> coefficient, and the first order that is not known (`_EXACT`: none is missing)."""

    terms: Mapping[Fraction, sp.Expr]
    unknown: Fraction = _EXACT

    @property
    def lead(self) -> Fraction:
        """The lowest order present."""
        return min(self.terms, default=self.unknown)


def graded(
    expression: sp.Expr, orders: Mapping[sp.Symbol, int], moving: frozenset[sp.Symbol], highest: Fraction
) -> dict[Fraction, sp.Expr]:
    """The expansion of an expression up to and including eps^highest.

    Parameters
    ----------
    expression : sympy expression
    orders : mapping of symbol to int
        Scaling orders; symbols left out have order 0.
    moving : frozenset of symbols
        The states and time: what a function may not contain at order zero if it is to be expanded.
    highest : Fraction
        The last order wanted.

    Returns
    -------
    dict
        Order -> coefficient (zero coefficients left out), orders up to `highest`.

    Raises
    ------
    EquationError
        A function that has no expansion (min, max, Table, |x + eps y|); the sentence names it.
    """
    length = Fraction(1)
    for _ in range(6):
        series = _Expansion(orders, moving, length)(expression)
        if series.unknown > highest:
            return {o: c for o, c in series.terms.items() if o <= highest and c != 0}
        length += highest - series.unknown + 1
    raise EquationError(f"the scaling orders give no expansion of {expression}; check `orders` or `small`")


class _Expansion:
    """Series arithmetic with a common length (orders kept beyond the leading one)."""

    def __init__(self, orders: Mapping[sp.Symbol, int], moving: frozenset[sp.Symbol], length: Fraction) -> None:
        self.orders = {s: Fraction(o) for s, o in orders.items()}
        self.moving, self.length = moving, length
        self.memo: dict[sp.Basic, Graded] = {}

    def __call__(self, node: sp.Basic) -> Graded:
        known = self.memo.get(node)
        if known is None:
            known = self.memo[node] = self._expanded(node)
        return known

    def _expanded(self, node: Any) -> Graded:
        if node.is_Symbol:
            return Graded({self.orders.get(node, Fraction(0)): node})
        if not node.free_symbols & self.orders.keys():
            return Graded({Fraction(0): node} if node != 0 else {})
        if node.is_Add:
            return self._sum([self(a) for a in node.args])
        if node.is_Mul:
            product = Graded({Fraction(0): sp.S.One})
            for a in node.args:
                product = self._product(product, self(a))
            return product
        if isinstance(node, sp.exp):
            return self._function(node, sp.exp, self(node.args[0]))
        if node.is_Pow:
            return self._power(node)
        if isinstance(node, (sp.Abs, sp.sign)):
            inner = self(node.args[0])
            if len(inner.terms) != 1 or inner.unknown != _EXACT:
                raise _no_expansion(node)
            ((order, coefficient),) = inner.terms.items()
            return Graded({order if isinstance(node, sp.Abs) else Fraction(0): node.func(coefficient)})
        if isinstance(node, _SMOOTH):
            return self._function(node, node.func, self(node.args[0]))
        raise _no_expansion(node)

    def _cut(self, terms: Mapping[Fraction, sp.Expr], unknown: Fraction) -> Graded:
        """Drop zeros, and everything further than `length` beyond the leading order."""
        kept = {o: c for o, c in terms.items() if o < unknown and c != 0}
        if not kept:
            return Graded({}, unknown)
        last = min(kept) + self.length
        if max(kept) > last:
            unknown = min(unknown, *(o for o in kept if o > last))
            kept = {o: c for o, c in kept.items() if o <= last}
        return Graded(kept, unknown)

    def _sum(self, parts: list[Graded]) -> Graded:
        terms: dict[Fraction, list[sp.Expr]] = {}
        for part in parts:
            for order, coefficient in part.terms.items():
                terms.setdefault(order, []).append(coefficient)
        return self._cut({o: sp.Add(*c) for o, c in terms.items()}, min(p.unknown for p in parts))

    def _product(self, a: Graded, b: Graded) -> Graded:
        unknown = min(
            _EXACT if a.unknown == _EXACT else a.unknown + b.lead, _EXACT if b.unknown == _EXACT else b.unknown + a.lead
        )
        terms: dict[Fraction, list[sp.Expr]] = {}
        for m, x in a.terms.items():
            for n, y in b.terms.items():
                terms.setdefault(m + n, []).append(x * y)
        return self._cut({o: sp.Add(*c) for o, c in terms.items()}, unknown)

    def _power(self, node: sp.Pow) -> Graded:
        base, exponent = self(node.base), node.exp
        if exponent.free_symbols & self.moving or not base.terms:
            raise _no_expansion(node)
        exact = len(base.terms) == 1 and base.unknown == _EXACT
        if exponent.is_Integer and exponent.is_positive and not exact:
            product = base
            for _ in range(int(exponent) - 1):
                product = self._product(product, base)
            return product
        lead = base.lead
        if lead != 0 and not exponent.is_Rational:
            raise EquationError(f"the exponent of {node} is a parameter, so that its scaling order is not a number")
        shift = lead * Fraction(exponent.p, exponent.q) if exponent.is_Rational else Fraction(0)
        head = base.terms[lead]
        if exact:
            return Graded({shift: head**exponent})
        if head.free_symbols & self.moving:
            raise _no_expansion(node)
        rest = Graded({o - lead: c / head for o, c in base.terms.items() if o != lead}, base.unknown - lead)
        total = self._taylor(rest, lambda k: sp.ff(exponent, k) / sp.factorial(k))
        return Graded({o + shift: head**exponent * c for o, c in total.terms.items()}, total.unknown + shift)

    def _function(self, node: sp.Expr, function: Any, inner: Graded) -> Graded:
        start = inner.terms.get(Fraction(0), sp.S.Zero)
        if inner.terms and inner.lead < 0:
            raise _no_expansion(node)
        if inner.unknown == _EXACT and set(inner.terms) <= {Fraction(0)}:
            return Graded({Fraction(0): node})
        if start.free_symbols & {s for s in self.moving if s.name != "t"}:
            raise _no_expansion(node)
        z = sp.Dummy("z", real=True)
        rest = Graded({o: c for o, c in inner.terms.items() if o > 0}, inner.unknown)
        return self._taylor(rest, lambda k: sp.diff(function(z), z, k).subs(z, start) / sp.factorial(k))

    def _taylor(self, small: Graded, coefficient: Any) -> Graded:
        """Sum of coefficient(k) small^k, small = O(eps^lead) with lead > 0, up to `length`."""
        total, power, k = Graded({Fraction(0): coefficient(0)}), Graded({Fraction(0): sp.S.One}), 0
        while True:
            k += 1
            power = self._product(power, small)
            if not power.terms or power.lead > self.length:
                return self._sum([total, Graded({}, min(power.lead, power.unknown))])
            factor = coefficient(k)
            if factor != 0:
                terms = {o: factor * c for o, c in power.terms.items() if o <= self.length}
                total = self._sum([total, Graded(terms, power.unknown)])


def _no_expansion(node: sp.Basic) -> EquationError:
    return EquationError(
        f"the term {node} cannot be averaged: it is neither a polynomial nor a real power |x|^n of a state, nor a "
        "smooth function of small ones; if its states are small, give them scaling orders (small=dict(x=1, ...)); else "
        "use HarmonicBalance(system)"
    )
