"""Electrical oscillators with a modulated element: capacitance, inductance or resistance.

    C(t):  L q'' + R q' + q/C(t) = 0                     Hill's equation directly          (figure 8, system 4)
    L(t):  (L q')' + R q' + q/C = 0                      flux psi = L q': psi'' + ((R/L) psi)' + psi/(L C) = 0   (5)
    R(t):  L q'' + R(t) q' + q/C = 0                     no growth while R(t) >= 0: E' = -R q'^2 <= 0

with X(t) = X0 (1 + epsilon cos(omega t)) for the modulated element. Source: catalogue 5.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from ..systems.system import System
from ._model import model
from ._shaker import positive

__all__ = ["capacitance_modulated_circuit", "inductance_modulated_circuit", "resistance_modulated_circuit"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-300, float("inf"))
_DEPTH = (-1 + 1e-9, 1 - 1e-9)
_UNITS = dict(inductance="H", capacitance="F", resistance="ohm", omega="rad/s", q="C", q_dot="A")


def _checked(**values: float) -> dict[str, float]:
    positive(inductance=values["inductance"], capacitance=values["capacitance"], omega=values["omega"])
    positive(zero_allowed=True, resistance=values["resistance"])
    return values


def _circuit(name: str, acceleration: Any, values: dict[str, float], description: str, deep: bool = False) -> System:
    q = sp.Function("q")(t)
    bounds = dict(inductance=_POSITIVE, capacitance=_POSITIVE, omega=_POSITIVE)
    return System.from_equations(
        {q.diff(t, 2): acceleration(q)},
        [q],
        parameters=values,
        units=_UNITS,
        bounds=bounds if deep else dict(bounds, epsilon=_DEPTH),
        orders=dict(epsilon=1, resistance=1),
        name=name,
        description=description,
    )


L, C, R, e, w = sp.symbols("inductance capacitance resistance epsilon omega", real=True)
_WAVE = 1 + e * sp.cos(w * t)


@model(
    equation="L q'' + R q' + q/C(t) = 0,  C = C0 (1 + epsilon cos(omega t))",
    source="catalogue 5 (system 4)",
    figure="8",
    group="parametric",
)
def capacitance_modulated_circuit(
    *,
    inductance: float = 1e-3,
    capacitance: float = 1e-6,
    resistance: float = 0.0,
    epsilon: float = 0.2,
    omega: float = 6.3246e4,
) -> System:
    """Series circuit with a modulated capacitor (figure 8, system 4): L q'' + R q' + q/C(t) = 0.

    C(t) = C0 (1 + epsilon cos(omega t)); the state q is the charge.

    Parameters
    ----------
    inductance : float
        L (H).
    capacitance : float
        Mean capacitance C0 (F).
    resistance : float
        R (ohm).
    epsilon : float
        Relative modulation, below 1.
    omega : float
        Modulation frequency (rad/s); the default is twice the natural frequency.

    Returns
    -------
    System
        States ``q, q_dot`` (C, A).

    References
    ----------
    Source chapter, figure 8.

    Examples
    --------
    >>> import stability as st
    >>> st.models.capacitance_modulated_circuit().states
    ('q', 'q_dot')
    """
    values = _checked(
        inductance=inductance, capacitance=capacitance, resistance=resistance, epsilon=epsilon, omega=omega
    )
    return _circuit(
        "capacitance_modulated_circuit",
        lambda q: -R / L * q.diff(t) - q / (L * C * _WAVE),
        values,
        "series circuit with a modulated capacitor",
    )


@model(
    equation="(L(t) q')' + R q' + q/C = 0,  L = L0 (1 + epsilon cos(omega t))",
    source="catalogue 5 (system 5)",
    figure="8",
    group="parametric",
)
def inductance_modulated_circuit(
    *,
    inductance: float = 1e-3,
    capacitance: float = 1e-6,
    resistance: float = 0.0,
    epsilon: float = 0.2,
    omega: float = 6.3246e4,
) -> System:
    """Series circuit with a modulated coil (figure 8, system 5): (L q')' + R q' + q/C = 0.

    L(t) = L0 (1 + epsilon cos(omega t)), so that L q'' + (L' + R) q' + q/C = 0: the multipliers' product is
    exp(-int R/L), although the damping term contains L'.

    Parameters
    ----------
    inductance : float
        Mean inductance L0 (H).
    capacitance : float
        C (F).
    resistance : float
        R (ohm).
    epsilon : float
        Relative modulation, below 1.
    omega : float
        Modulation frequency (rad/s).

    Returns
    -------
    System
        States ``q, q_dot`` (C, A).

    References
    ----------
    Source chapter, figure 8.

    Examples
    --------
    >>> import stability as st
    >>> st.models.inductance_modulated_circuit(resistance=1.0).parameters["resistance"]
    1.0
    """
    values = _checked(
        inductance=inductance, capacitance=capacitance, resistance=resistance, epsilon=epsilon, omega=omega
    )
    now = L * _WAVE
    return _circuit(
        "inductance_modulated_circuit",
        lambda q: -(sp.diff(now, t) + R) / now * q.diff(t) - q / (now * C),
        values,
        "series circuit with a modulated coil",
    )


@model(
    equation="L q'' + R(t) q' + q/C = 0,  R = R0 (1 + epsilon cos(omega t))",
    source="catalogue 5 (extra)",
    figure="8",
    group="parametric",
)
def resistance_modulated_circuit(
    *,
    inductance: float = 1e-3,
    capacitance: float = 1e-6,
    resistance: float = 10.0,
    epsilon: float = 0.5,
    omega: float = 6.3246e4,
) -> System:
    """Series circuit with a modulated resistor: no parametric growth while R(t) >= 0, whatever the text says.

    L q'' + R(t) q' + q/C = 0 with R(t) = R0 (1 + epsilon cos(omega t)); the energy E' = -R q'^2 can only grow once R
    changes its sign, |epsilon| > 1.

    Parameters
    ----------
    inductance : float
        L (H).
    capacitance : float
        C (F).
    resistance : float
        Mean resistance R0 (ohm).
    epsilon : float
        Relative modulation; beyond 1 the resistance is negative for part of the period.
    omega : float
        Modulation frequency (rad/s).

    Returns
    -------
    System
        States ``q, q_dot`` (C, A).

    References
    ----------
    Source chapter, section 3 and its erratum on modulated damping.

    Examples
    --------
    >>> import stability as st
    >>> st.models.resistance_modulated_circuit(epsilon=3.0).parameters["epsilon"]
    3.0
    """
    values = _checked(
        inductance=inductance, capacitance=capacitance, resistance=resistance, epsilon=epsilon, omega=omega
    )
    return _circuit(
        "resistance_modulated_circuit",
        lambda q: -R * _WAVE / L * q.diff(t) - q / (L * C),
        values,
        "series circuit with a modulated resistor",
        deep=True,
    )
