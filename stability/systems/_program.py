"""Straight-line programs: a right-hand side and its derivatives as assignments over shared subexpressions.

The equations f(x, p, t) are rewritten in generated symbols and, for forced systems, at fixed phase s = t/T(p):

    t -> s T(p)   before any derivative is taken,  so that  df/dp  includes  s dT/dp df/dt

(at fixed time the parameter derivative grows with t, and a collocation node sits at a phase, not at a time). Repeated
subexpressions become assignments r_k = g_k(r_1 ... r_{k-1}, z), z = (x, p). Derivatives are taken on this program, not
on the expanded expressions: forward over the assignments with sparse gradients for Jacobians, and by the tangent
operator D_V r_k = sum_a (dg_k/da) D_V a, applied once, twice, three times, for directional derivatives. The cost stays
proportional to the size of the program; expanded Hessians do not.

Reference: A. Griewank and A. Walther, Evaluating Derivatives (2008), chapters 3 and 13.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp
from sympy.core.relational import Relational

from ..errors import EquationError
from .expressions import PowerLog, alternatives, differentiate

__all__ = ["Equations", "Program"]

Assignment = tuple[sp.Symbol, sp.Expr]


def symbols(prefix: str, count: int) -> tuple[sp.Symbol, ...]:
    """Generated real symbols; a user's name never enters generated code."""
    return tuple(sp.Symbol(f"{prefix}{i}", real=True) for i in range(count))


@dataclass(frozen=True)
class Program:
    """Assignments in order, then the results of each output array (row-major per point).

    `directions` are the symbol blocks of extra input arrays (N, len(block)).
    """

    phase: sp.Symbol
    states: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    directions: tuple[tuple[sp.Symbol, ...], ...]
    assignments: tuple[Assignment, ...]
    results: tuple[tuple[sp.Expr, ...], ...]


class Equations:
    """The right-hand side, outputs and period of a system in generated symbols, at fixed phase."""

    def __init__(self, system: Any) -> None:
        self.phase = sp.Symbol("s_", real=True)
        self.states = symbols("x_", len(system.states))
        self.parameters = symbols("p_", len(system.parameters))
        names = (*system.states, *system.parameters)
        self._rename = {
            sp.Symbol(name, real=True): own for name, own in zip(names, (*self.states, *self.parameters), strict=True)
        }
        period = system.period_expression
        self.forced = period is not None
        self.period = self._renamed("the period", period, time=None) if self.forced else None
        time = self.phase * self.period if self.forced else None
        self.rhs = tuple(
            self._renamed(f"the equation of '{name}'", e, time)
            for name, e in zip(system.states, system.rhs, strict=True)
        )
        time = self.phase if time is None else time
        self.outputs = tuple(self._renamed(f"output '{name}'", e, time) for name, e in system.outputs.items())
        self.breaks = tuple(self._renamed("a break", e, time=None) for e in system.breaks)

    def _renamed(self, what: str, expression: Any, time: sp.Expr | None) -> sp.Expr:
        expression = sp.sympify(expression)
        known = dict(self._rename)
        if time is not None:
            known[sp.Symbol("t", real=True)] = time
        unknown = sorted(str(s) for s in expression.free_symbols - set(known))
        if unknown:
            hint = " (a forced system must declare its period)" if "t" in unknown else ""
            raise EquationError(f"{what} contains {', '.join(unknown)}, neither state nor parameter{hint}")
        return replaced(expression, known)

    @property
    def variables(self) -> tuple[sp.Symbol, ...]:
        """z = (x, p)."""
        return (*self.states, *self.parameters)

    @cached_property
    def _shared(self) -> tuple[list[Assignment], list[sp.Expr]]:
        return share(self.rhs)

    @property
    def _along_and_weights(self) -> tuple[tuple[sp.Symbol, ...], tuple[sp.Symbol, ...]]:
        """A direction over z and weights over the equations: the inputs of "second_gradient"."""
        return symbols("v_", len(self.variables)), symbols("w_", len(self.rhs))

    def _program(
        self,
        assignments: Iterable[Assignment],
        *results: Sequence[sp.Expr],
        directions: tuple[tuple[sp.Symbol, ...], ...] = (),
    ) -> Program:
        blocks = tuple(tuple(block) for block in results)
        return Program(self.phase, self.states, self.parameters, directions, tuple(assignments), blocks)

    def program(self, which: str) -> Program:
        """The program of "F", "FJ", "FJP", "outputs", "period", "second", "third" or "second_gradient"."""
        if which == "period":
            return self.expanded(which)
        assignments, rhs = self._shared
        if which == "F":
            return self._program(assignments, rhs)
        if which == "outputs":
            return self._program(*share(self.outputs))
        if which in ("FJ", "FJP"):
            wanted = self.states if which == "FJ" else self.variables
            rows, assignments = gradients(assignments, rhs, wanted)
            blocks = [[row.get(z, sp.S.Zero) for row in rows for z in self.states]]
            if which == "FJP":
                blocks.append([row.get(z, sp.S.Zero) for row in rows for z in self.parameters])
            return self._program(assignments, rhs, *blocks)
        if which == "second_gradient":
            v, w = self._along_and_weights
            assignments, rhs = tangent(assignments, rhs, dict(zip(self.variables, v, strict=True)))
            total = sp.Add(*(a * e for a, e in zip(w, rhs, strict=True)))
            rows, assignments = gradients(assignments, [total], self.variables)
            return self._program(assignments, [rows[0].get(z, sp.S.Zero) for z in self.variables], directions=(v, w))
        directions = tuple(symbols(f"{letter}_", len(self.variables)) for letter in ("v", "w", "u")[: ORDERS[which]])
        for block in directions:
            assignments, rhs = tangent(assignments, rhs, dict(zip(self.variables, block, strict=True)))
        return self._program(assignments, rhs, directions=directions)

    def expanded(self, which: str) -> Program:
        """The same results as expressions without assignments, by whole-expression differentiation (the oracle)."""
        if which == "F":
            return self._program((), self.rhs)
        if which == "outputs":
            return self._program((), self.outputs)
        if which == "period":
            return self._program((), (self.period,), [differentiate(self.period, p) for p in self.parameters])
        if which in ("FJ", "FJP"):
            blocks = [[differentiate(e, z) for e in self.rhs for z in self.states]]
            if which == "FJP":
                blocks.append([differentiate(e, z) for e in self.rhs for z in self.parameters])
            return self._program((), self.rhs, *blocks)
        if which == "second_gradient":
            v, w = self._along_and_weights
            slopes = (a * b * differentiate(e, z) for a, e in zip(w, self.rhs) for b, z in zip(v, self.variables))
            total = sp.Add(*slopes)
            return self._program((), [differentiate(total, z) for z in self.variables], directions=(v, w))
        directions = tuple(symbols(f"{letter}_", len(self.variables)) for letter in ("v", "w", "u")[: ORDERS[which]])
        results = list(self.rhs)
        for block in directions:
            results = [
                sp.Add(*(differentiate(e, z) * v for z, v in zip(self.variables, block, strict=True))) for e in results
            ]
        return self._program((), results, directions=directions)


ORDERS = {"second": 2, "third": 3}


def share(expressions: Sequence[sp.Expr], prefix: str = "r_") -> tuple[list[Assignment], list[sp.Expr]]:
    """Pull every repeated subexpression out as an assignment (exact repeats only: fast, and rounding unchanged)."""
    uses: dict[sp.Basic, int] = {}
    pending: list[sp.Basic] = list(expressions)
    while pending:
        node = pending.pop()
        uses[node] = uses.get(node, 0) + 1
        if uses[node] == 1:
            pending.extend(node.args)
    assignments: list[Assignment] = []
    done: dict[sp.Basic, sp.Basic] = {}

    def rebuilt(node: sp.Basic) -> sp.Basic:
        if not node.args:
            return node
        if node not in done:
            new: sp.Basic = _with_args(node, tuple(rebuilt(a) for a in node.args))
            if uses[node] > 1 and _worth_sharing(new):
                symbol = sp.Symbol(f"{prefix}{len(assignments)}", real=True)
                assignments.append((symbol, new))
                new = symbol
            done[node] = new
        return done[node]

    reduced = [rebuilt(e) for e in expressions]
    return assignments, reduced


def _with_args(node: sp.Basic, args: tuple[sp.Basic, ...]) -> sp.Basic:
    if args == node.args:
        return node
    if isinstance(node, (sp.Piecewise, sp.Mod, Relational)):  # evaluation would compare and factor: slow, no gain
        return node.func(*args, evaluate=False)
    if isinstance(node, (sp.Abs, sp.sign)) and not args[0].is_extended_real:
        return node.func(*args, evaluate=False)
    return node.func(*args)


def replaced(expression: sp.Expr, known: Mapping[sp.Basic, sp.Basic]) -> sp.Expr:
    """All replacements at once, each shared subexpression rebuilt once."""
    done: dict[sp.Basic, sp.Basic] = dict(known)

    def rebuilt(node: sp.Basic) -> sp.Basic:
        if node not in done:
            done[node] = _with_args(node, tuple(rebuilt(a) for a in node.args)) if node.args else node
        return done[node]

    return rebuilt(expression)


def _worth_sharing(node: sp.Basic) -> bool:
    """Not conditions, scaled symbols, or what a derivative rule must see: parts of sign(u)|u|^p, selections."""
    if not isinstance(node, sp.Expr) or not node.args or isinstance(node, (sp.Abs, sp.sign)):
        return False
    if alternatives(node) is not None:
        return False
    if isinstance(node, sp.Pow) and (isinstance(node.base, sp.Abs) or (node.exp.is_Integer and node.base.is_Symbol)):
        return False
    return not (isinstance(node, sp.Mul) and len(node.args) == 2 and node.args[0].is_Number and node.args[1].is_Symbol)


def gradients(
    assignments: Sequence[Assignment], results: Sequence[sp.Expr], wanted: Sequence[sp.Symbol]
) -> tuple[list[dict[sp.Symbol, sp.Expr]], list[Assignment]]:
    """Sparse gradients of the results over the wanted symbols, and the program extended by what they need."""
    program: list[Assignment] = []
    known: dict[sp.Symbol, dict[sp.Symbol, sp.Expr]] = {z: {z: sp.S.One} for z in wanted}

    def named(expression: sp.Expr) -> sp.Expr:
        if expression.is_Atom:
            return expression
        symbol = sp.Symbol(f"g_{len(program)}", real=True)
        program.append((symbol, expression))
        return symbol

    def gradient(expression: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
        terms: dict[sp.Symbol, list[sp.Expr]] = {}
        for symbol in _active(expression, known):
            partial = differentiate(expression, symbol)
            if partial == 0:
                continue
            inner = known[symbol]
            if symbol in inner:
                terms.setdefault(symbol, []).append(partial)
                continue
            partial = named(partial)
            for z, slope in inner.items():
                terms.setdefault(z, []).append(partial * slope)
        return {z: sp.Add(*parts) for z, parts in terms.items()}

    for symbol, expression in assignments:
        program.append((symbol, expression))
        slopes = gradient(expression)
        if slopes:
            known[symbol] = {z: named(slope) for z, slope in slopes.items()}
    return [gradient(e) for e in results], program


def tangent(
    assignments: Sequence[Assignment], results: Sequence[sp.Expr], seeds: dict[sp.Symbol, sp.Symbol]
) -> tuple[list[Assignment], list[sp.Expr]]:
    """The program of sum_z (d result / dz) seed_z."""
    program: list[Assignment] = []
    moving: dict[sp.Symbol, sp.Expr] = dict(seeds)
    mark = next(iter(seeds.values())).name[0] if seeds else "v"

    def total(expression: sp.Expr) -> sp.Expr:
        return sp.Add(*(differentiate(expression, s) * moving[s] for s in _active(expression, moving)))

    for symbol, expression in assignments:
        program.append((symbol, expression))
        slope = total(expression)
        if slope != 0:
            if not slope.is_Atom:
                own = sp.Symbol(f"{symbol.name}{mark}", real=True)
                program.append((own, slope))
                slope = own
            moving[symbol] = slope
    more, reduced = share([total(e) for e in results], prefix=f"q{mark}_")
    return program + more, reduced


def _active(expression: sp.Expr, moving: dict[sp.Symbol, Any]) -> list[sp.Symbol]:
    return sorted((s for s in expression.free_symbols if s in moving), key=lambda s: s.name)


def functions_in(expressions: Iterable[sp.Basic]) -> set[str]:
    """Class names of all operations in the expressions (a table counts as "TableFunction")."""
    from .tables import TableFunction

    found: set[str] = set()
    seen: set[sp.Basic] = set()
    pending = list(expressions)
    while pending:
        node = pending.pop()
        if node in seen:
            continue
        seen.add(node)
        pending.extend(node.args)
        if isinstance(node, TableFunction):
            found.add("TableFunction")
        elif isinstance(node, PowerLog) or node.args:
            found.add(type(node).__name__)
    return found
