r"""`averaging` and `multiple_scales`: from an oscillator to its slow flow, which is a `System` again.

    q_i'' + omega_i^2 q_i = eps g_i(q, q', t)   ->   u_i', v_i',      q_i = u_i cos(K_i nu t) + v_i sin(K_i nu t) + ...

The equilibria of the slow flow are the periodic responses, its Hopf points the torus bifurcations (Neimark-Sacker), and
its eigenvalues the Floquet exponents of the responses, all to the order of the method. How the terms are sorted is in
`standard_form`, the amplitude equations are in `amplitude_equations`.

References: Krylov and Bogoliubov, Introduction to Non-linear Mechanics (1947); Nayfeh and Mook, Nonlinear Oscillations
(1979); Verhulst, Nonlinear Differential Equations and Dynamical Systems (1996); Sanders, Verhulst and Murdock (2007).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING

from ..errors import EquationError, InputError
from ..systems.equations import symbol
from .amplitude_equations import AmplitudeEquations, averaged, expanded
from .modal_coordinates import Modes, coupling, modes_of, physical
from .slow_systems import slow_system
from .standard_form import (
    Resonance,
    Small,
    StandardForm,
    check_oscillators,
    graded_rows,
    scaling_orders,
    standard_form,
)

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["averaging", "multiple_scales"]

# the order in which resonances are tried where none is given
_USUAL = ((1, 1), (2, 1), (3, 1), (1, 2), (1, 3))


def averaging(
    system: System,
    *,
    order: int = 1,
    resonance: Resonance = None,
    variables: str | None = None,
    small: Small = None,
) -> System:
    r"""The averaged slow flow of weakly nonlinear oscillators, symbolically.

    q_i'' + omega_i^2 q_i = eps g_i(q, q', t), q_i = u_i cos(K_i nu t) + v_i sin(K_i nu t). The frequency nu is that of
    the response, not omega: with the detuning (K_i nu)^2 - omega_i^2 kept exactly, the equilibria of the first order
    are those of one-term harmonic balance, 5 to 10 times closer than an expansion in nu - omega (`multiple_scales`).

    Parameters
    ----------
    system : System
        Oscillators q'' = f of one or more degrees of freedom. Polynomials of any degree, real powers |q|^n and |q'|^n
        (first order), parametric terms, smooth functions of states with a positive scaling order.
    order : int
        1, or 2 (even powers, drift, the third harmonic's effect on the first).
    resonance : (int, int), mapping or None
        Excitation : response = p : q, for the slowest coordinate: ``(2, 1)`` is the principal parametric resonance, the
        response at half the excitation frequency; the others follow at the nearest integer multiples of it. A mapping
        gives a pair for each coordinate. None takes the first of 1:1, 2:1, 3:1, 1:2, 1:3 at which the forcing acts.
        Coordinates that are coupled at order 0 are averaged as modes ``mode1, mode2, ...`` (`modal_coordinates`), which
        all answer at the one ratio, or as a mapping by these names says.
    variables : {"cartesian", "polar"} or None
        Slow states ``<q>_cos, <q>_sin``, or ``<q>_amplitude, <q>_phase`` (singular at zero). None: cartesian; for an
        autonomous oscillator polar, where the phase is cyclic: state ``<q>_amplitude`` and output ``frequency``.
    small : str, sequence of str, mapping or None
        What is small: names (order 1), or name -> order, of parameters and states; an order of -1 says that a quantity
        is large. None takes ``system.orders``.

    Returns
    -------
    System
        Autonomous, with the original parameters; ``.reconstruction`` (and `reconstruct`) leads back to the original
        states. Amplitudes are those of the fundamental harmonic.

    Raises
    ------
    InputError
        No scaling orders; a resonance that the system does not have; an order other than 1 and 2.
    EquationError
        A term that cannot be averaged, or is not small; the sentence names it and the alternative.

    Notes
    -----
    *Accuracy*: amplitudes to relative O(eps^order), checked against shooting, elliptic functions and Floquet theory;
    `reconstruction_residual` measures what a solution leaves in the original equations.

    References
    ----------
    Krylov and Bogoliubov (1947); Nayfeh and Mook (1979), chapters 2-6; Sanders, Verhulst and Murdock (2007), chapter 2.

    Examples
    --------
    >>> import stability as st
    >>> slow = st.averaging(st.models.duffing_textbook())
    >>> slow.states
    ('x_cos', 'x_sin')
    >>> st.averaging(st.models.van_der_pol()).rhs
    (-mu*x_amplitude**3/8 + mu*x_amplitude/2,)
    """
    return _slow_flow(system, averaged, "averaging", order, resonance, variables, small)


def multiple_scales(
    system: System,
    *,
    order: int = 1,
    resonance: Resonance = None,
    variables: str | None = None,
    small: Small = None,
) -> System:
    """The slow flow of the method of multiple scales: everything expanded about the natural frequencies.

    q_i'' + omega_i^2 q_i = eps g_i(q, q', t), K_i nu = omega_i + sigma_i with sigma_i of order eps; terms beyond
    eps^order are dropped. The textbook's equations; `averaging`, which keeps nu, is closer at the same order.

    Parameters
    ----------
    system : System
        As for `averaging`.
    order : int
        1 or 2.
    resonance, variables, small
        As for `averaging`.

    Returns
    -------
    System
        As for `averaging`; amplitudes are those of the fundamental harmonic (so the free Duffing oscillator has
        omega = 1 + 3/8 beta a^2 - 15/256 beta^2 a^4; in the maximum it would be 21/256, see `frequency_law`).

    Raises
    ------
    InputError, EquationError
        As for `averaging`.

    References
    ----------
    Nayfeh and Mook, Nonlinear Oscillations (1979), sections 2.3, 4.1, 5.7, 6.5.

    Examples
    --------
    >>> import sympy as sp, stability as st
    >>> slow = st.multiple_scales(st.models.van_der_pol(), order=2)
    >>> slow.outputs["frequency"].subs(sp.Symbol("x_amplitude", real=True), 2)
    1 - mu**2/16
    """
    return _slow_flow(system, expanded, "multiple scales", order, resonance, variables, small)


def _slow_flow(
    system: System,
    method: Callable[[StandardForm], AmplitudeEquations],
    label: str,
    order: int,
    resonance: Resonance,
    variables: str | None,
    small: Small,
) -> System:
    if order not in (1, 2):
        raise InputError(f"order = {order}: {label} is offered to order 1 and 2; for more use HarmonicBalance(system)")
    if variables not in (None, "cartesian", "polar"):
        raise InputError(f"variables = {variables!r}: 'cartesian' or 'polar'")
    free = system.period_expression is None and system.function is None
    check_oscillators(system)
    if free:
        _check_free(system, resonance)
        return slow_system(method(standard_form(system, order, (1, 1), small)), variables != "cartesian", label, order)
    modes = _modes(system, small) if method is averaged else None
    if modes is not None:
        return _modal_flow(modes, label, order, resonance, variables)
    equations = _resonant(system, method, label, order, resonance, small)
    return slow_system(equations, variables == "polar", label, order)


def _modes(system: System, small: Small) -> Modes | None:
    """Modal coordinates of a system whose coordinates are coupled at order 0; None for all others."""
    scaled = scaling_orders(system, small)
    if len(system.coordinates) < 2 or len({scaled.get(symbol(c), 0) for c in system.coordinates}) > 1:
        return None
    K = coupling(system, graded_rows(system, scaled, 1)[0])
    return None if K is None else modes_of(system, K, scaled)


def _modal_flow(modes: Modes, label: str, order: int, resonance: Resonance, variables: str | None) -> System:
    """All modes answer at one frequency, or each as a mapping by its name says."""
    tried: list[Resonance] = [resonance]
    if not isinstance(resonance, Mapping):
        tried = [dict.fromkeys(modes.names, pair) for pair in (_USUAL if resonance is None else (resonance,))]
    for pairs in tried:
        equations = averaged(standard_form(modes.system, order, pairs, None, exact=True))
        if _acts(equations):
            break
    else:
        raise InputError(
            f"the forcing of '{modes.original.name}' has no effect to order {order} at resonance = "
            f"{'any of the usual ones' if resonance is None else resonance}; give another (p, q), or one for each of "
            f"{', '.join(modes.names)}"
        )
    slow = slow_system(equations, variables == "polar", label, order)
    return physical(slow, modes, len(set(equations.amplitudes.form.multiples)) == 1)


def _resonant(
    system: System, method: Callable[[StandardForm], AmplitudeEquations], label: str, order: int, resonance: Resonance,
    small: Small,
) -> AmplitudeEquations:  # fmt: skip
    """The amplitude equations at the resonance asked for, or at the first at which the forcing acts."""
    if resonance is not None:
        equations = method(standard_form(system, order, resonance, small))
        if not _acts(equations):
            raise _no_resonance(system, order, resonance, method, small)
        return equations
    for level in range(1, order + 1):
        for pair in _USUAL:
            try:
                acts = _acts(method(standard_form(system, level, pair, small)))
            except EquationError:
                if pair == _USUAL[0]:
                    raise
                continue
            if acts:
                return method(standard_form(system, order, pair, small))
    raise InputError(
        f"the forcing of '{system.name}' has no effect to order {order} at any of "
        f"{', '.join(f'{p}:{q}' for p, q in _USUAL)}; give resonance=(p, q), or order=2"
    )


def _check_free(system: System, resonance: Resonance) -> None:
    if len(system.coordinates) > 1:
        raise InputError(
            f"'{system.name}' is autonomous with {len(system.coordinates)} degrees of freedom: averaging takes "
            "autonomous oscillators of one degree of freedom, or forced ones of any; use HarmonicBalance(system)"
        )
    if resonance is not None and (isinstance(resonance, Mapping) or tuple(resonance) != (1, 1)):
        raise InputError(
            f"'{system.name}' is autonomous: there is no excitation for resonance={resonance!r} to refer to"
        )


def _acts(equations: AmplitudeEquations) -> bool:
    """Whether the forcing enters: a term that changes when time is shifted, A_j -> A_j e^{i K_j s}."""
    amplitudes = equations.amplitudes
    n, K = amplitudes.n, amplitudes.form.multiples
    for i, terms in enumerate(equations.motion):
        for element in terms.values():
            for powers in element.itermonoms():
                if sum(K[j] * (powers[j] - powers[n + j]) for j in range(n)) != K[i]:
                    return True
    return False


def _no_resonance(
    system: System, order: int, resonance: Resonance, method: Callable[[StandardForm], AmplitudeEquations], small: Small
) -> InputError:
    """The error for a resonance at which the forcing has no effect; it lists those at which it has."""
    found = []
    for pair in _USUAL:
        try:
            if _acts(method(standard_form(system, order, pair, small))):
                found.append(f"{pair[0]}:{pair[1]}")
        except (EquationError, InputError):
            continue
    listing = ", ".join(found) or "none of the usual ones"
    shown = (
        dict(resonance) if isinstance(resonance, Mapping) else f"{resonance[0]}:{resonance[1]}" if resonance else None
    )
    advice = "; order=2 may show more" if order == 1 else ""
    form = standard_form(system, order, resonance, small)
    answers = ", ".join(f"{c} at {Fraction(K, form.ratio[0])}" for c, K in zip(system.coordinates, form.multiples))
    return InputError(
        f"'{system.name}' has no resonance {shown} to order {order}: the forcing does not enter its slow flow "
        f"(response over excitation frequency: {answers}); it has {listing}{advice}"
    )
