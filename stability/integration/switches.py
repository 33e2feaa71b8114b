r"""Switches of a right-hand side, frozen: piecewise smooth systems as smooth systems with modes.

A kink or jump in the states (|a|, sign a, Heaviside a, max, min, Piecewise) is decided by the sign of a *guard* g(t,
x, p). Each guard gets a mode sigma = +1 or -1, an extra parameter, and the right-hand side is rewritten so that it
depends on the modes and no longer on the signs:

    |a| -> sigma a      sign a -> sigma      max(a, b) -> a where sigma > 0, else b      (g = a - b)      and so on.

Between two changes of sign the field is then as smooth as its pieces, and continues smoothly beyond them: a step may
look over the edge without seeing the other side, the Runge-Kutta method keeps its order, and the crossing is a simple
root of g. Under a fractional power or a logarithm the pieces do not continue; there the guard is located, but the
expression keeps its own form. Switches that depend on time alone are the system's `breaks`.

Reference: E. Hairer, S. P. Norsett, G. Wanner (1993), section II.6 (discontinuous right-hand sides); A. F. Filippov
(1988).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import sympy as sp
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean

__all__ = ["SWITCHES", "Frozen", "frozen_switches", "has_switches"]

SWITCHES = (sp.Abs, sp.sign, sp.Heaviside, sp.Max, sp.Min, sp.Piecewise)
_MOST = 24  # more guards than this (a spring of many pieces) cost more than they give


class Frozen:
    """The rewriting of one system's expressions; collects the guards it meets.

    Attributes
    ----------
    guards : list of sympy expressions, in the order of `modes`
    modes : list of symbols, the extra parameters
    """

    def __init__(self, states: Iterable[str], taken: Iterable[str]) -> None:
        self.own = {sp.Symbol(s, real=True) for s in states}
        self.prefix = "mode"
        while any(name.startswith(self.prefix + "_") for name in taken):
            self.prefix += "x"
        self.guards: list[sp.Expr] = []
        self.modes: list[sp.Symbol] = []
        self._known: dict[sp.Expr, sp.Expr] = {}
        self._done: dict[sp.Basic, sp.Basic] = {}

    def mode(self, guard: sp.Expr) -> sp.Expr:
        """The symbol (or its negative) that stands for the sign of this guard."""
        guard = sp.expand(guard)
        known = self._known.get(guard)
        if known is None:
            symbol = sp.Symbol(f"{self.prefix}_{len(self.guards)}", real=True)
            self.guards.append(guard)
            self.modes.append(symbol)
            self._known[guard] = known = symbol
            self._known[sp.expand(-guard)] = -symbol
        return known

    def switches(self, guard: sp.Basic) -> bool:
        """Whether a guard depends on the states."""
        return bool(guard.free_symbols & self.own)

    def rewrite(self, node: sp.Basic) -> sp.Basic:
        """The expression with modes in place of signs."""
        if not node.args or not node.has(*SWITCHES):
            return node
        if node not in self._done:
            self._done[node] = self._rewritten(node)
        return self._done[node]

    def _rewritten(self, node: sp.Basic) -> sp.Basic:
        if isinstance(node, sp.Pow) and not (node.exp.is_Integer and node.exp.is_positive):
            return self._located(node)
        if isinstance(node, sp.log):
            return self._located(node)
        if isinstance(node, (sp.Max, sp.Min)):
            return self._selection(node)
        if isinstance(node, (sp.Abs, sp.sign, sp.Heaviside)) and self.switches(node.args[0]):
            inner = self.rewrite(node.args[0])
            mode = self.mode(node.args[0])
            if isinstance(node, sp.Abs):
                return mode * inner
            return mode if isinstance(node, sp.sign) else (1 + mode) / 2
        if isinstance(node, sp.Piecewise):
            pairs = [(self.rewrite(value), self._condition(condition)) for value, condition in node.args]
            return sp.Piecewise(*pairs, evaluate=False)
        return node.func(*(self.rewrite(a) for a in node.args))

    def _located(self, node: sp.Basic) -> sp.Basic:
        """Unchanged, but its guards are known, so that steps end there."""
        for inner in node.atoms(sp.Abs, sp.sign, sp.Heaviside):
            if self.switches(inner.args[0]):
                self.mode(inner.args[0])
        for inner in node.atoms(sp.Max, sp.Min):
            first = inner.args[0]
            for other in inner.args[1:]:
                if self.switches(first - other):
                    self.mode(first - other)
        for inner in node.atoms(sp.Piecewise):
            for _, condition in inner.args:
                self._condition(condition)
        return node

    def _selection(self, node: Any) -> sp.Basic:
        better = node.args[0]
        value = self.rewrite(better)
        for other in node.args[1:]:
            gap = better - other if isinstance(node, sp.Max) else other - better
            if not self.switches(gap) or gap.has(*SWITCHES):
                return self._located(node)
            chosen = self.mode(gap) > 0
            value = sp.Piecewise((value, chosen), (self.rewrite(other), True), evaluate=False)
            better = node.func(better, other)
        return value

    def _condition(self, condition: Any) -> Any:
        if isinstance(condition, Relational) and self.switches(condition):
            if isinstance(condition, (sp.Eq, sp.Ne)):
                return condition
            flipped = isinstance(condition, (sp.Lt, sp.Le))
            guard = condition.rhs - condition.lhs if flipped else condition.lhs - condition.rhs
            return self.mode(guard) > 0
        if isinstance(condition, Boolean) and condition.args and not isinstance(condition, Relational):
            return condition.func(*(self._condition(c) for c in condition.args))
        return condition


@lru_cache(maxsize=256)
def has_switches(system: Any) -> bool:
    """Whether the right-hand side has kinks or jumps in the states."""
    if system.rhs is None or not any(e.has(*SWITCHES) for e in system.rhs):
        return False
    return bool(frozen_switches(system)[0].guards)


def frozen_switches(system: Any) -> tuple[Frozen, tuple[sp.Expr, ...]]:
    """(the guards and modes, the right-hand side in terms of the modes); no guards: the right-hand side as it is.

    Examples
    --------
    >>> import stability as st
    >>> found, rhs = frozen_switches(st.models.unilateral_spring())
    >>> found.guards
    [u]
    """
    found = Frozen(system.states, system.parameters)
    if system.rhs is None:
        return found, ()
    rhs = tuple(found.rewrite(e) for e in system.rhs)
    if not found.guards or len(found.guards) > _MOST:
        return Frozen(system.states, system.parameters), system.rhs
    return found, rhs
