"""Mathieu's and Hill's equations: linear oscillators whose stiffness varies periodically.

    q'' + 2 delta q' + (a + b f(t)) q = 0,     f(t + T) = f(t)

Mathieu: f = cos(Omega t). With z = Omega t/2 it is the canonical x'' + (a_M - 2 q_M cos 2z) x = 0 (DLMF 28.2) for
a_M = 4 a/Omega^2, |q_M| = 2 |b|/Omega^2 (the sign of b is a shift of time). Damping: q = exp(-delta t) x with a -
delta^2 in place of a. Tongues open at Omega = 2 sqrt(a)/n. Source: equations (40), (41); catalogue 5; figure 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp

from ..errors import InputError
from ..systems.system import System
from ._model import model

__all__ = ["coupled_mathieu", "hill", "mathieu", "mathieu_canonical", "meissner"]

t = sp.Symbol("t", real=True)
_POSITIVE = (1e-12, float("inf"))


@model(
    equation="q'' + 2 delta q' + (a + b cos(Omega t)) q = 0",
    source="equation (40); catalogue 5",
    figure="8",
    group="parametric",
)
def mathieu(*, a: float = 0.25, b: float = 0.1, Omega: float = 1.0, delta: float = 0.0) -> System:
    """Mathieu's equation with damping, q'' + 2 delta q' + (a + b cos(Omega t)) q = 0.

    Tongues of instability open at a = (n Omega/2)^2; the default stands in the first one.

    Parameters
    ----------
    a : float
        Mean stiffness, the square of the undamped natural frequency (1/time^2).
    b : float
        Modulation depth of the stiffness (1/time^2).
    Omega : float
        Modulation frequency (rad/time).
    delta : float
        Damping constant (1/time): exponents are those of a - delta^2 without damping, less delta.

    Returns
    -------
    System
        States ``q, q_dot``; period 2 pi/Omega.

    References
    ----------
    Source chapter, (40), figure 8; DLMF 28.2 for the canonical form.

    Examples
    --------
    >>> import stability as st
    >>> st.models.mathieu(delta=0.05).states
    ('q', 'q_dot')
    """
    q = sp.Function("q")(t)
    A, B, W, D = sp.symbols("a b Omega delta", real=True)
    return System.from_equations(
        {q.diff(t, 2): -2 * D * q.diff(t) - (A + B * sp.cos(W * t)) * q},
        [q],
        parameters=dict(a=a, b=b, Omega=Omega, delta=delta),
        bounds=dict(Omega=_POSITIVE),
        orders=dict(b=1, delta=1),
        name="mathieu",
        description="Mathieu's equation with damping",
    )


@model(
    equation="w'' + 2 zeta w' + (a - 2 q cos 2z) w = 0",
    source="DLMF 28.2; catalogue 5",
    figure="8",
    group="parametric",
)
def mathieu_canonical(*, a: float = 1.0, q: float = 0.5, zeta: float = 0.0) -> System:
    """Mathieu's equation in canonical form, w'' + 2 zeta w' + (a - 2 q cos 2z) w = 0; the time is z.

    Parameters
    ----------
    a : float
        Characteristic parameter; the tongues open at a = n^2.
    q : float
        Modulation parameter.
    zeta : float
        Damping constant.

    Returns
    -------
    System
        States ``w, w_dot``; period pi.

    References
    ----------
    DLMF 28.2.1.

    Examples
    --------
    >>> import math, stability as st
    >>> st.models.mathieu_canonical().period == math.pi
    True
    """
    w = sp.Function("w")(t)
    A, Q, Z = sp.symbols("a q zeta", real=True)
    return System.from_equations(
        {w.diff(t, 2): -2 * Z * w.diff(t) - (A - 2 * Q * sp.cos(2 * t)) * w},
        [w],
        parameters=dict(a=a, q=q, zeta=zeta),
        orders=dict(q=1, zeta=1),
        name="mathieu_canonical",
        description="Mathieu's equation, DLMF form",
    )


def _from_callable(
    function: Callable[[Any], Any], period: float, breaks: Sequence[float], values: dict[str, float]
) -> System:
    def rhs(t: Any, x: Any, *, a: float, b: float, delta: float) -> Any:
        return np.stack([x[1], -2 * delta * x[1] - (a + b * np.asarray(function(t), dtype=float)) * x[0]])

    fields = System.from_function(rhs, "q q_dot", period=period, parameters=values, breaks=breaks, name="hill")
    return fields.replace(coordinates=("q",))


def _series(cos: Sequence[float], sin: Sequence[float]) -> tuple[sp.Expr, dict[str, float]]:
    W = sp.Symbol("Omega", real=True)
    terms, values = [], {}
    for letter, wave, coefficients in (("c", sp.cos, cos), ("s", sp.sin, sin)):
        for k, value in enumerate(coefficients, start=1):
            values[f"{letter}{k}"] = float(value)
            terms.append(sp.Symbol(f"{letter}{k}", real=True) * wave(k * W * t))
    return sp.Add(*terms), values


@model(
    equation="q'' + 2 delta q' + (a + b f(t)) q = 0",
    source="equation (41); catalogue 5",
    figure="8",
    group="parametric",
)
def hill(
    function: Any = None,
    *,
    a: float = 0.25,
    b: float = 0.1,
    delta: float = 0.0,
    cos: Sequence[float] = (),
    sin: Sequence[float] = (),
    Omega: float = 1.0,
    period: Any = None,
    breaks: Sequence[Any] = (),
    parameters: Mapping[str, float] | None = None,
) -> System:
    """Hill's equation q'' + 2 delta q' + (a + b f(t)) q = 0 for any periodic f.

    Parameters
    ----------
    function : sympy expression in t, or callable, optional
        f(t). An expression may contain further parameters; a callable takes numpy arrays and needs `period`.
        Without it f is the Fourier series of `cos` and `sin`; without any of them, cos Omega t + 0.5 cos 2 Omega t.
    a, b, delta : float
        Mean stiffness, modulation depth, damping constant.
    cos, sin : sequences of float
        f = sum c_k cos(k Omega t) + s_k sin(k Omega t), k from 1; the coefficients become parameters ``c1, s1, ...``.
    Omega : float
        Fundamental frequency of the Fourier series.
    period : float or expression, optional
        Period of f; found by itself for sines and cosines.
    breaks : sequence
        Phases in [0, 1) at which f jumps or bends. Found by themselves where they do not depend on parameters.
    parameters : mapping, optional
        Defaults of further parameters in `function`.

    Returns
    -------
    System
        States ``q, q_dot``.

    Raises
    ------
    InputError
        If both a function and Fourier coefficients are given, or a callable comes without a period.

    References
    ----------
    Source chapter, (41); Magnus and Winkler, Hill's Equation (1966).

    Examples
    --------
    >>> import sympy as sp, stability as st
    >>> square = st.models.hill(sp.sign(sp.cos(sp.Symbol("t"))))
    >>> square.breaks
    (1/4, 3/4)
    """
    series = len(tuple(cos)) + len(tuple(sin)) > 0
    if function is None and not series:
        cos, series = (1.0, 0.5), True
    if function is not None and series:
        raise InputError("hill takes either a function f(t) or Fourier coefficients cos=[...], sin=[...], not both")
    values = dict(a=float(a), b=float(b), delta=float(delta))
    if function is not None and not isinstance(function, sp.Basic) and callable(function):
        if period is None:
            raise InputError("a callable f(t) needs its period: hill(f, period=...)")
        return _from_callable(function, period, breaks, values)
    bounds = {}
    if series:
        f, extra = _series(cos, sin)
        values.update(extra, Omega=float(Omega))
        bounds["Omega"] = _POSITIVE
    else:
        f = sp.sympify(function)
        f = f.xreplace({s: sp.Symbol(s.name, real=True) for s in f.free_symbols})
        if not f.has(t):
            raise InputError(f"f = {f} does not depend on the time t")
        values.update(parameters or {})
    q = sp.Function("q")(t)
    A, B, D = sp.symbols("a b delta", real=True)
    return System.from_equations(
        {q.diff(t, 2): -2 * D * q.diff(t) - (A + B * f) * q},
        [q],
        parameters=values,
        bounds=bounds,
        period=period,
        breaks=breaks,
        orders=dict(b=1, delta=1),
        name="hill",
        description="Hill's equation with damping",
    )


@model(
    equation="q'' + 2 delta q' + (a + b s(t)) q = 0,  s = +1 while the phase is below duty, else -1",
    source="catalogue 5; Meissner (1918)",
    figure="8",
    group="parametric",
)
def meissner(*, a: float = 0.25, b: float = 0.1, Omega: float = 1.0, delta: float = 0.0, duty: float = 0.5) -> System:
    """Meissner's equation: Hill's equation with a square wave, solvable in closed form.

    q'' + 2 delta q' + (a + b s(t)) q = 0 with s = +1 for phases in [0, duty) and -1 in [duty, 1). For duty 1/2 and
    delta 0 the trace of the monodromy matrix is 2 cos(p1 T/2) cos(p2 T/2) - (p1/p2 + p2/p1) sin(p1 T/2) sin(p2 T/2),
    p = sqrt(a +- b).

    Parameters
    ----------
    a, b : float
        Mean stiffness and modulation depth.
    Omega : float
        Modulation frequency (rad/time).
    delta : float
        Damping constant.
    duty : float
        Share of the period with the higher stiffness, in (0, 1).

    Returns
    -------
    System
        States ``q, q_dot``; breaks at the phases 0 and duty.

    References
    ----------
    E. Meissner, Schweizerische Bauzeitung 72 (1918).

    Examples
    --------
    >>> import stability as st
    >>> st.models.meissner(duty=0.25).breaks
    (0, duty)
    """
    q = sp.Function("q")(t)
    A, B, W, D, S = sp.symbols("a b Omega delta duty", real=True)
    square = sp.Piecewise((1, sp.Mod(W * t / (2 * sp.pi), 1) < S), (-1, True))
    return System.from_equations(
        {q.diff(t, 2): -2 * D * q.diff(t) - (A + B * square) * q},
        [q],
        parameters=dict(a=a, b=b, Omega=Omega, delta=delta, duty=duty),
        bounds=dict(Omega=_POSITIVE, duty=(1e-9, 1 - 1e-9)),
        period=2 * sp.pi / W,
        breaks=(0, S),
        name="meissner",
        description="Hill's equation with a square wave",
    )


@model(
    equation="x_i'' + 2 delta x_i' + omega_i^2 x_i + epsilon cos(Omega t) (h_i1 x1 + h_i2 x2) = 0,  i = 1, 2",
    source="catalogue 5; Yakubovich and Starzhinskii (1975)",
    group="parametric",
)
def coupled_mathieu(
    *,
    omega1: float = 1.0,
    omega2: float = 1.7,
    epsilon: float = 0.3,
    Omega: float = 2.7,
    delta: float = 0.01,
    h11: float = 1.0,
    h12: float = 1.0,
    h21: float = 1.0,
    h22: float = 1.0,
) -> System:
    """Two modes with a modulated coupling: simple and combination resonances.

    x1'' + 2 delta x1' + omega1^2 x1 + epsilon cos(Omega t) (h11 x1 + h12 x2) = 0, and likewise for x2. Sum resonances
    Omega = (omega1 + omega2)/k need h12 h21 > 0, difference resonances h12 h21 < 0. The default stands in the first
    sum resonance.

    Parameters
    ----------
    omega1, omega2 : float
        Natural frequencies (rad/time).
    epsilon : float
        Modulation depth.
    Omega : float
        Modulation frequency (rad/time).
    delta : float
        Damping constant of both modes.
    h11, h12, h21, h22 : float
        Modulation matrix.

    Returns
    -------
    System
        States ``x1, x2, x1_dot, x2_dot``.

    References
    ----------
    Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975).

    Examples
    --------
    >>> import stability as st
    >>> st.models.coupled_mathieu().n
    4
    """
    x1, x2 = sp.Function("x1")(t), sp.Function("x2")(t)
    w1, w2, e, W, D, a11, a12, a21, a22 = sp.symbols("omega1 omega2 epsilon Omega delta h11 h12 h21 h22", real=True)
    wave = e * sp.cos(W * t)
    return System.from_equations(
        {
            x1.diff(t, 2): -2 * D * x1.diff(t) - w1**2 * x1 - wave * (a11 * x1 + a12 * x2),
            x2.diff(t, 2): -2 * D * x2.diff(t) - w2**2 * x2 - wave * (a21 * x1 + a22 * x2),
        },
        [x1, x2],
        parameters=dict(
            omega1=omega1, omega2=omega2, epsilon=epsilon, Omega=Omega, delta=delta, h11=h11, h12=h12, h21=h21, h22=h22
        ),
        bounds=dict(Omega=_POSITIVE),
        orders=dict(epsilon=1, delta=1),
        name="coupled_mathieu",
        description="two coupled Mathieu equations",
    )
