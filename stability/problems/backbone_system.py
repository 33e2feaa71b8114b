r"""The free system behind a forced one: forcing averaged away, a uniform growth that balances the damping.

    x'' = f(x, x', t)   ->   x'' = <f>(x, x') + g x',        <f> = 1/T int_0^T f dt at fixed x, x'.

Additive forcing has mean zero and goes; parametric terms keep their mean. g (1/time) is the artificial,
mass-proportional growth of the extended periodic motion concept: 2 xi for a linear damper of one degree of freedom, 0
for conservative systems. Reference: M. Krack (2015), Nonlinear modal analysis of nonconservative systems, Computers &
Structures 154, 59-71.
"""

from __future__ import annotations

from typing import Any

from ..errors import EquationError, InputError

__all__ = ["GROWTH", "driving_parameter", "free_system"]

GROWTH = "balancing_growth"


def free_system(system: Any) -> Any:
    """The autonomous System with the parameter `GROWTH`, made of a system of second-order equations.

    Raises
    ------
    InputError
        A system made of a Python function, or without velocities.
    EquationError
        A term in which time cannot be separated from the states.
    """
    import sympy as sp

    from ..systems.system import System

    if system.rhs is None:
        raise InputError(
            f"'{system.name}' is made of a Python function, whose forcing cannot be told from the rest: write the "
            "equations with System.from_equations, or give a function without forcing as equations"
        )
    if GROWTH in system.parameters:
        raise InputError(f"the parameter name '{GROWTH}' is used by Backbone itself")
    velocities = [f"{c}_dot" for c in system.coordinates if f"{c}_dot" in system.states]
    if not velocities:
        raise InputError(
            f"'{system.name}' has no coordinate with a velocity; a backbone belongs to oscillators with second-order "
            "equations: follow its orbits with HarmonicBalance or Collocation"
        )
    growth = sp.Symbol(GROWTH, real=True)
    rhs = [_mean(system, sp.sympify(e)) for e in system.rhs]
    for name in velocities:
        k = system.states.index(name)
        rhs[k] = rhs[k] + growth * sp.Symbol(name, real=True)
    return System(
        name=f"{system.name}, free", states=tuple(system.states), coordinates=tuple(system.coordinates),
        parameters={**system.parameters, GROWTH: 0.0}, rhs=tuple(rhs), angles=tuple(system.angles),
    )  # fmt: skip


def _mean(system: Any, expression: Any) -> Any:
    """Time average at fixed states."""
    import sympy as sp

    t = sp.Symbol("t", real=True)
    if t not in expression.free_symbols:
        return expression
    s = sp.Symbol("phase", real=True)
    states = {sp.Symbol(name, real=True) for name in system.states}
    total = sp.Integer(0)
    for term in sp.Add.make_args(sp.expand(expression)):
        factor, timed = term.as_independent(t, as_Add=False)
        if timed == 1:
            total += term
            continue
        inner = timed.subs(t, s * system.period_expression)
        average = sp.Integral(inner, (s, 0, 1)).doit() if not timed.free_symbols & states else None
        if average is None or average.has(sp.Integral):
            raise EquationError(
                f"the term {term} of '{system.name}' mixes time with the states, so that no free system is left when "
                "the forcing is taken away; give Backbone the free system itself (without t)"
            )
        total += factor * sp.simplify(average)
    return total


def driving_parameter(system: Any) -> str | None:
    """The parameter Omega with T = 2 pi / Omega, or None."""
    import sympy as sp

    if system.period_expression is None:
        return None
    for name in system.parameters:
        if sp.simplify(system.period_expression * sp.Symbol(name, real=True) / (2 * sp.pi)) == 1:
            return str(name)
    return None
