"""The constant and the first-harmonic part of a right-hand side, and the equilibrium of its time average.

An expression that is affine in cos(k w t), sin(k w t), e(t, x) = e0(x) + Re[e1(x) e^{i w t}] + higher harmonics, is
split by writing sines and cosines as exponentials. The equilibrium solves e0(x) = 0: gravity moves it, the harmonic
excitation does not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import sympy as sp

from ..errors import ConvergenceError, EquationError
from ..systems.equations import TIME, symbol

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["averaged_equilibrium", "harmonic_parts"]


def harmonic_parts(expression: sp.Expr, system: System) -> tuple[sp.Expr, sp.Expr]:
    """(e0, e1): the time average and the complex amplitude of e^{i w t}, cos -> 1 and sin -> -i.

    Raises
    ------
    EquationError
        If the expression is not affine in sines and cosines of multiples of the forcing frequency.
    """
    expression = sp.sympify(expression)
    if not expression.has(TIME):
        return expression, sp.S.Zero
    omega = 2 * sp.pi / system.period_expression
    waves = sorted((a for a in expression.atoms(sp.sin, sp.cos) if a.has(TIME)), key=str)
    markers = [sp.Dummy(f"wave{i}") for i in range(len(waves))]
    marked = expression.xreplace(dict(zip(waves, markers)))
    if marked.has(TIME):
        raise EquationError(f"'{system.name}' is not forced by sines and cosines alone: {expression}")
    rest = dict.fromkeys(markers, 0)
    mean, first = marked.xreplace(rest), sp.S.Zero
    for wave, marker in zip(waves, markers):
        weight = sp.diff(marked, marker)
        if weight.free_symbols & set(markers):
            raise EquationError(f"'{system.name}' multiplies functions of time: {expression}")
        argument = sp.expand(wave.args[0])
        multiple = sp.simplify(sp.diff(argument, TIME) / omega)
        shift = argument.subs(TIME, 0)
        if not multiple.is_Integer:
            raise EquationError(f"{wave} is not a harmonic of the forcing frequency {omega}")
        if abs(multiple) == 1:
            unit = sp.S.One if isinstance(wave, sp.cos) else -sp.I * sp.sign(multiple)
            first += weight * unit * sp.exp(sp.I * shift * sp.sign(multiple))
    return mean, first


def averaged_equilibrium(system: System, mean: sp.Matrix, start: npt.NDArray[np.float64]) -> dict[str, float]:
    """State -> value of a root of the time-averaged equations, by Newton's method from `start`."""
    states = [symbol(s) for s in system.states]
    own = {symbol(k): v for k, v in system.parameters.items()}
    at_zero = mean.xreplace(dict.fromkeys(states, sp.S.Zero))
    if not start.any() and all(e == 0 for e in at_zero):
        return dict.fromkeys(system.states, 0.0)
    from ..systems.expressions import differentiate

    numeric = mean.subs(own)
    jacobian = sp.Matrix([[differentiate(e, s) for s in states] for e in numeric])
    f, df = sp.lambdify([states], numeric, "numpy"), sp.lambdify([states], jacobian, "numpy")
    starts = [start] if start.any() else [start, start - 1e-9, start + 1e-9]  # zero may be a kink of the spring
    for first in starts:
        found, x = _newton(f, df, first)
        if found:
            return {s: float(v) if abs(v) > 1e-300 else 0.0 for s, v in zip(system.states, x)}
    raise ConvergenceError(
        f"no equilibrium of '{system.name}' from {dict(zip(system.states, start.tolist()))}; give another about=",
        last=x,
    )  # fmt: skip


def _newton(f: Any, df: Any, start: npt.NDArray[np.float64]) -> tuple[bool, npt.NDArray[np.float64]]:
    """(whether it converged, the last iterate) of Newton's method."""
    x = start.copy()
    for _ in range(60):
        residual = np.asarray(f(x), dtype=float).ravel()
        matrix = np.asarray(df(x), dtype=float)
        if not (np.isfinite(residual).all() and np.isfinite(matrix).all()):
            return False, x
        try:
            step = np.linalg.solve(matrix, -residual)
        except np.linalg.LinAlgError:
            return False, x
        x = x + step
        if np.abs(step).max() <= 1e-14 * max(1.0, float(np.abs(x).max())):
            return True, x
    return False, x
