"""The linearised equations of a system about a constant state, as a system again.

With x = x_e + y:  y' = [f(t, x_e) - mean part that vanishes] + A(t) y,  A = df/dx (t, x_e). The forcing f(t, x_e)
stays, so that the linearised system answers the same excitation; the states keep their names and mean the deviation y.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from ..errors import EquationError, check_names
from .equations import symbol
from .expressions import differentiate
from .system import System

__all__ = ["linearised"]


def linearised(system: System, about: Mapping[str, Any] | None = None) -> System:
    """The system linearised about a constant state x_e: y' = f(t, x_e) + A(t) y.

    Parameters
    ----------
    system : System
        A system of expressions.
    about : mapping, optional
        State -> value, a number or a sympy expression in the parameters; zero where left out.

    Returns
    -------
    System
        Linear in its states, which are the deviations from `about`.

    Raises
    ------
    EquationError
        If the system is a Python function.

    Examples
    --------
    >>> import stability as st
    >>> st.linearised(st.models.kapitza_pendulum(xi=0.0)).rhs[1]
    psi*(-Omega**2*epsilon*cos(Omega*t) + 1) - 2*psi_dot*xi
    """
    if system.rhs is None:
        raise EquationError(f"'{system.name}' is a Python function: its linearised equations need expressions")
    check_names("state", about or {}, system.states, f"'{system.name}'")
    states = [symbol(s) for s in system.states]
    at = dict.fromkeys(states, sp.S.Zero)
    for key, value in (about or {}).items():
        e = sp.sympify(value)
        at[symbol(key)] = e.xreplace({v: symbol(v.name) for v in e.free_symbols})
    rows = []
    for e in system.rhs:
        constant = e.xreplace(at)
        rows.append(sp.Add(constant, *(differentiate(e, s).xreplace(at) * s for s in states)))
    outputs = {}
    for key, e in system.outputs.items():
        outputs[key] = sp.Add(e.xreplace(at), *(differentiate(e, s).xreplace(at) * s for s in states))
    return system.replace(rhs=tuple(rows), outputs=outputs, name=f"{system.name}, linearised")
