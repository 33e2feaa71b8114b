r"""Kinks and jumps of a right-hand side that a solution meets, and how smooth its flow still is.

A switch in the states (|a|, max, min, sign, Heaviside, Piecewise) is decided by a guard g(t, x, p); the two forms of
the field on its sides differ by

    f_+ - f_- = c g^r (1 + ...),      r = 0: a jump, 1: a kink such as |x|, 2: a jump of curvature such as x |x|, ...

Where an orbit passes g = 0 with g' != 0, the flow has r continuous derivatives and an (r + 1)-th one, of which the part
that comes from the passage is no integral of derivatives of f (saltation of higher order). The normal forms of
`normal_forms` hold such integrals only: quadratic coefficients are right for r >= 2, cubic ones for r >= 3. An orbit or
equilibrium that stays on g = 0 needs one order more. Reference: R. I. Leine, H. Nijmeijer (2004), *Dynamics and
Bifurcations of Non-Smooth Mechanical Systems*, chapters 7 and 9.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..integration.switches import SWITCHES, frozen_switches, has_switches

__all__ = ["SMOOTH", "kink_words", "passes", "passes_a_kink", "smoothness", "smoothness_along"]

Array = np.ndarray
_SAMPLES = 2049
SMOOTH = 99  # no kink at all
_HIGHEST = 3  # orders above are told apart by nobody
_ON = 1e-9  # a guard below this part of the states' size is zero
_ZERO = 1e-7  # a jump of a derivative below this part of the derivative's size is none


class _Guards(NamedTuple):
    values: Any  # (t, *states, *parameters) -> list of guards
    jumps: list[Any]  # per guard None (unknown), or (derivatives of the jump by order, gradient of the guard)


@lru_cache(maxsize=64)
def _guards(system: Any) -> _Guards:
    import sympy as sp

    found, rhs = frozen_switches(system)
    states = [sp.Symbol(s, real=True) for s in system.states]
    arguments = [sp.Symbol("t", real=True), *states, *(sp.Symbol(p, real=True) for p in system.parameters)]
    jumps: list[Any] = []
    for guard, mode in zip(found.guards, found.modes):
        jump = [e.subs(mode, 1) - e.subs(mode, -1) for e in rhs if e.has(mode)]
        if not jump:
            jumps.append(None)
            continue
        orders = [jump]
        for _ in range(_HIGHEST - 1):
            orders.append([sp.diff(e, s) for e in orders[-1] for s in states])
        gradient = [sp.diff(guard, s) for s in states]
        given = [*arguments, *found.modes]
        jumps.append((
            [sp.lambdify(given, order, "numpy", cse=True) for order in orders],
            sp.lambdify(arguments, [guard, *gradient], "numpy"),
        ))  # fmt: skip
    return _Guards(sp.lambdify(arguments, list(found.guards), "numpy"), jumps)


def _values(system: Any, times: Array, X: Array, params: Array) -> Array:
    """(guards, N) along a solution."""
    values = _guards(system).values(times, *X.T, *params)
    return np.array([np.broadcast_to(np.asarray(v, float), len(X)) for v in values]).reshape(-1, len(X))


def passes(system: Any, times: Array, X: Array, params: Array) -> bool:
    """Whether a solution x(times) (N, n) meets a kink or jump of its right-hand side."""
    if not has_switches(system):
        return False
    values, tiny = _values(system, times, X, params), _ON * float(np.abs(X).max(initial=1.0))
    return bool(((values.min(axis=1) <= tiny) & (values.max(axis=1) >= -tiny)).any())


def passes_a_kink(system: Any, orbit: Any) -> bool:
    """`passes` for a periodic orbit as a user sees it."""
    if not has_switches(system):
        return False
    return passes(system, *_sampled(system, orbit))


def smoothness_along(system: Any, orbit: Any) -> int:
    """`smoothness` of a periodic orbit as a user sees it."""
    return smoothness(system, *_sampled(system, orbit)) if has_switches(system) else SMOOTH


def _sampled(system: Any, orbit: Any) -> tuple[Array, Array, Array]:
    times = np.linspace(0.0, orbit.period, _SAMPLES)
    return times, np.ascontiguousarray(orbit(times).T), np.array([orbit.params[name] for name in system.parameters])


def kink_words(system: Any) -> str:
    """The functions that make the kinks: "Abs, Max", or empty.

    Examples
    --------
    >>> import stability as st
    >>> kink_words(st.models.soft_stop_oscillator())
    'Max, Min, Piecewise'
    """
    if not has_switches(system):
        return ""
    own = set(system.states)
    met = {
        type(atom).__name__ for e in system.rhs for atom in e.atoms(*SWITCHES)
        if own & {s.name for s in atom.free_symbols}
    }  # fmt: skip
    return ", ".join(sorted(met))


def smoothness(system: Any, times: Array, X: Array, params: Array) -> int:
    """The least r along a solution x(times) (N, n), one less where it stays on a kink; SMOOTH where it meets none.

    Systems given by Python functions, and of more than 24 switches (splines), are taken for smooth.
    """
    if not has_switches(system):
        return SMOOTH
    known, least = _guards(system), SMOOTH
    values, tiny = _values(system, times, X, params), _ON * float(np.abs(X).max(initial=1.0))
    signs = np.where(values >= 0, 1.0, -1.0)
    for k, jump in enumerate(known.jumps):
        low, high = float(values[k].min()), float(values[k].max())
        if not (low <= tiny and high >= -tiny):
            continue
        stays = max(-low, high) <= tiny
        places = [0] if stays else np.flatnonzero(np.diff(signs[k])).tolist() or [int(np.argmin(np.abs(values[k])))]
        for i in places:
            found = _order(jump, times[i], X[i], params, signs[:, i])
            least = min(least, found - 1 if stays else found)
    return least


def _order(jump: Any, t: float, x: Array, params: Array, modes: Array) -> int:
    """r at the point of g = 0 next to x."""
    if jump is None:
        return 0
    derivatives, guard = jump
    for _ in range(8):
        value, *gradient = (float(v) for v in guard(t, *x, *params))
        slope = np.array(gradient)
        if value == 0.0:
            break
        if not slope.any():
            return 0
        x = x - value * slope / (slope @ slope)
    size = np.abs(x).max(initial=1.0)
    for order, function in enumerate(derivatives):
        found = np.abs(np.array(function(t, *x, *params, *modes), float))
        if not (found <= _ZERO * size).all():
            return order
    return _HIGHEST
