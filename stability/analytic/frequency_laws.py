r"""Frequency against amplitude of a free oscillator, as a series, with the amplitude that is meant.

    omega(a) = omega_0 + omega_1(a) + omega_2(a) + ...,  q = a cos(omega t) + sum over k != 1 of X_k cos(k omega t)

a is the amplitude of the fundamental harmonic; the largest displacement is A = a + x_1(a), x_1 = sum X_k, and in it
omega = omega_0 + omega_1(A) + [omega_2 - omega_1' x_1](A). For u'' + u + beta u^3 = 0 the coefficient of
beta^2 is -15/256 in the first and -21/256 in the second. Reference: Nayfeh and Mook (1979), section 2.3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from ..errors import EquationError, InputError
from ..systems.equations import TIME, symbol
from .slow_flow import multiple_scales
from .standard_form import Small, standard_form

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["frequency_law"]


def frequency_law(
    system: System, *, order: int = 2, amplitude: str = "fundamental", squared: bool = False, small: Small = None
) -> sp.Expr:
    """The frequency of free motion against its amplitude, a series in the small parameter (the backbone).

    omega = omega_0 + omega_1(a) + omega_2(a) for q'' + omega_0^2 q = eps g(q, q'), one degree of freedom.

    Parameters
    ----------
    system : System
        One degree of freedom; of a forced system the forcing is left out.
    order : int
        1 or 2.
    amplitude : {"fundamental", "maximum"}
        What `a` means: the amplitude of the fundamental harmonic, or the largest displacement (to second order).
    squared : bool
        The series of omega^2: the same order, several times closer for stiffening springs.
    small : str, sequence, mapping or None
        As in `averaging`.

    Returns
    -------
    sympy expression
        In the symbol ``a`` and the system's parameters.

    Raises
    ------
    InputError, EquationError
        More than one degree of freedom; anything that `multiple_scales` refuses.

    References
    ----------
    Nayfeh and Mook, Nonlinear Oscillations (1979), section 2.3.

    Examples
    --------
    >>> import stability as st
    >>> st.frequency_law(st.models.duffing_textbook(), squared=True, order=1)
    3*a**2*beta/4 + alpha
    """
    if amplitude not in ("fundamental", "maximum"):
        raise InputError(f"amplitude = {amplitude!r}: 'fundamental' or 'maximum'")
    if order not in (1, 2):
        raise InputError(f"order = {order}: 1 or 2")
    free = _unforced(system)
    if len(free.coordinates) != 1:
        raise InputError(
            f"'{system.name}' has {len(free.coordinates)} degrees of freedom: a frequency law is offered for one; use "
            "Backbone(system)"
        )
    (c,) = free.coordinates
    a, old = sp.Symbol("a", positive=True), symbol(f"{c}_amplitude")
    first = multiple_scales(free, order=1, small=small)
    zeroth = standard_form(free, 1, (1, 1), small).base_frequency
    one = sp.expand(first.outputs["frequency"].subs(old, a) - zeroth)
    two = sp.S.Zero
    if order == 2:
        second = multiple_scales(free, order=2, small=small)
        two = sp.expand(second.outputs["frequency"].subs(old, a) - zeroth - one)
        if amplitude == "maximum":
            extra = second.reconstruction[c].subs(old, a).subs(TIME, 0) - a
            two = sp.expand(two - sp.diff(one, a) * extra)
    if squared:
        return (
            sp.expand(zeroth**2)
            + sp.expand(2 * zeroth * one)
            + sp.expand(one**2 + 2 * zeroth * two if order == 2 else 0)
        )
    return zeroth + one + two


def _unforced(system: System) -> System:
    """The system without its forcing (sines and cosines of time set to zero)."""
    if system.rhs is None:
        raise EquationError(f"'{system.name}' is a Python function: a frequency law needs expressions")
    if system.period_expression is None:
        return system
    rhs = [
        e.replace(lambda n: isinstance(n, (sp.sin, sp.cos)) and n.has(TIME), lambda n: sp.S.Zero) for e in system.rhs
    ]
    return system.replace(rhs=tuple(rhs), period_expression=None, outputs={}, breaks=(), base=None)
