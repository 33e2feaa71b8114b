"""Equations as a person reads them: plain text, and LaTeX with dots for time derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from .equations import symbol

if TYPE_CHECKING:
    from .system import System

__all__ = ["latex_equations", "summary"]


def _names(system: System) -> dict[sp.Symbol, str]:
    names = {}
    for s in system.states:
        base = s.removesuffix("_dot")
        if s.endswith("_dot") and base in system.states:
            names[symbol(s)] = rf"\dot{{{sp.latex(sp.Symbol(base))}}}"
    return names


def latex_equations(system: System) -> str:
    """An ``aligned`` block: one line for each coordinate, second-order equations with two dots."""
    assert system.rhs is not None
    names = _names(system)
    rhs = dict(zip(system.states, system.rhs))
    lines = []
    for c in system.coordinates:
        second = f"{c}_dot" in rhs
        letter = sp.latex(sp.Symbol(c))
        left = rf"\ddot{{{letter}}}" if second else rf"\dot{{{letter}}}"
        lines.append(rf"{left} &= {sp.latex(rhs[f'{c}_dot' if second else c], symbol_names=names)}")
    body = " \\\\\n".join(lines)
    return f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}"


def summary(system: System) -> str:
    """The equations, the period, the parameters and the outputs in plain text."""
    lines = [f"System {system.name}" + ("" if system.period_expression is None else "  (forced)")]
    if system.rhs is None:
        lines.append(f"  x' = {system.name}(t, x) with x = ({', '.join(system.states)})")
    else:
        lines += [f"  {s}' = {e}" for s, e in zip(system.states, system.rhs)]
    if system.period_expression is not None:
        shown = str(system.period_expression) if hasattr(system.period_expression, "free_symbols") else "T(p)"
        lines.append(f"  period {shown} = {system.period:.6g}")
    units = system.units
    given = (f"{k} = {v:.6g}" + (f" {units[k]}" if units.get(k) else "") for k, v in system.parameters.items())
    lines.append("  parameters " + (", ".join(given) or "none"))
    if system.outputs:
        lines.append("  outputs " + ", ".join(f"{k} = {e}" for k, e in system.outputs.items()))
    return "\n".join(lines)
