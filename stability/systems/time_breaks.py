"""Where a right-hand side jumps or bends in time: the breaks that no integration step may straddle.

A term such as sign(cos(Omega t)) switches where its argument, a function of the phase s = t/T(p) alone, changes sign.
The arguments of sign, Heaviside, Abs, Max - Min and the conditions of Piecewise are collected, written at phase s, and
their zeros in [0, 1) are found by a fine scan and bisection. Where an argument still contains a parameter (a duty
cycle), its zeros are no constants: then the breaks must be declared.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import sympy as sp

from ..errors import EquationError
from .equations import TIME, symbol

__all__ = ["time_breaks"]

_SCAN = 4801  # samples per period: switching intervals down to 1/2400 of a period are seen


def _switching_arguments(expression: sp.Expr) -> list[sp.Expr]:
    found: list[sp.Expr] = []
    for e in expression.atoms(sp.sign, sp.Heaviside, sp.Abs):
        found.append(e.args[0])
    for e in expression.atoms(sp.Max, sp.Min):
        found += [e.args[i] - e.args[j] for i in range(len(e.args)) for j in range(i)]
    for e in expression.atoms(sp.Piecewise):
        for _, condition in e.args:
            for r in condition.atoms(sp.core.relational.Relational):
                found.append(r.lhs - r.rhs)
    for e in expression.atoms(sp.floor, sp.Mod):
        argument = e.args[0] if isinstance(e, sp.floor) else e.args[0] / e.args[1]
        found.append(sp.sin(sp.pi * argument))
    return found


def _zeros(argument: sp.Expr, phase: sp.Symbol) -> list[float]:
    f = sp.lambdify(phase, argument, "numpy")
    s = np.linspace(0.0, 1.0, _SCAN) + 0.3141592653589793 / _SCAN  # off the likely zeros, over one whole period
    v = np.broadcast_to(np.asarray(f(s), dtype=float), s.shape)
    zeros = []
    for k in np.nonzero(np.sign(v[:-1]) * np.sign(v[1:]) < 0)[0]:
        lo, hi, sign = s[k], s[k + 1], np.sign(v[k])
        for _ in range(80):
            middle = 0.5 * (lo + hi)
            lo, hi = (middle, hi) if np.sign(f(middle)) == sign else (lo, middle)
        zeros.append(float(hi % 1.0))
    return zeros


def time_breaks(expressions: Iterable[Any], period: Any, states: Iterable[str]) -> tuple[sp.Expr, ...]:
    """Phases in [0, 1), sorted, at which the expressions switch in time (not in the states).

    Raises
    ------
    EquationError
        Where a switching argument contains parameters even at fixed phase: declare ``breaks=`` then.
    """
    if period is None:
        return ()
    phase = sp.Dummy("phase", real=True)
    own = {symbol(s) for s in states}
    values: list[float] = []
    for e in expressions:
        for argument in _switching_arguments(sp.sympify(e)):
            if not argument.has(TIME) or argument.free_symbols & own:
                continue
            at_phase = sp.simplify(argument.subs(TIME, phase * period))
            if at_phase.free_symbols - {phase}:
                raise EquationError(
                    f"the right-hand side switches in time where {argument} = 0, which depends on parameters: "
                    "give breaks=(...), the phases in [0, 1) in terms of the parameters"
                )
            values += _zeros(at_phase, phase)
    distinct: list[float] = []
    for v in sorted(0.0 if abs(v) < 1e-12 or abs(v - 1) < 1e-12 else v for v in values):
        if not distinct or v - distinct[-1] > 1e-10:
            distinct.append(v)
    return tuple(_exact(v) for v in distinct)


def _exact(value: float) -> sp.Expr:
    """The simple fraction that this phase evidently is, else the float."""
    fraction = sp.Rational(round(value * 5040), 5040)
    return fraction if abs(value - float(fraction)) < 1e-13 else sp.Float(value)
