"""From a slow flow back to the original oscillator in time, and what that leaves in the original equations.

q(t) = Q(z, t, p),    residual r(t) = Q'' - f(t, Q, Q', p)  with  z constant (an equilibrium of the slow flow).

Q is a sum of cosines and sines of multiples of one frequency, so that extrema of a steady motion are taken over one
common period, from samples with a parabola through the three highest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError, check_names

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["reconstruct", "reconstruction_residual", "steady_extrema"]

Array = npt.NDArray[np.float64]
_SAMPLES = 512


def reconstruct(slow_system: System, slow_state: Any, t: npt.ArrayLike, **params: float) -> Array:
    """The original states at time(s) t that a state of a slow flow stands for.

    Parameters
    ----------
    slow_system : System
        From `averaging` or `multiple_scales`.
    slow_state : mapping, array (n,) or (n, N), or FixedPoint
        Slow states; (n, N) one for each time (a slow trajectory). A FixedPoint brings its parameters along.
    t : float or array (N,)
        Time of the original system.
    **params : float
        Parameter values (others at their defaults).

    Returns
    -------
    array, (n_original,) or (n_original, N)
        In the order of ``slow_system.reconstruction``: coordinates, then velocities.

    Raises
    ------
    InputError
        A system without a reconstruction.

    Examples
    --------
    >>> import stability as st
    >>> slow = st.averaging(st.models.duffing_textbook())
    >>> st.reconstruct(slow, dict(x_cos=0.5), [0.0])
    array([[0.5],
           [0. ]])
    """
    values, x = _values(slow_system, slow_state, params)
    time = np.asarray(t, dtype=float)
    rows = _motion(slow_system)(*x, *values.values(), time)
    shape = np.broadcast_shapes(time.shape, x.shape[1:])
    return np.array([np.broadcast_to(row, shape) for row in rows], dtype=float)


@lru_cache(maxsize=64)
def _motion(slow_system: System) -> Callable[..., Any]:
    """(slow states, parameters, t) -> original states, compiled once for each slow flow."""
    import sympy as sp

    names = [*slow_system.states, *slow_system.parameters, "t"]
    rows = list(slow_system.reconstruction.values())
    return sp.lambdify([sp.Symbol(n, real=True) for n in names], rows, modules="numpy", cse=True)  # type: ignore[no-any-return]


@lru_cache(maxsize=64)
def _rates(slow_system: System) -> Callable[..., Any]:
    """(slow states, parameters) -> the angular frequencies that occur in the reconstruction."""
    import sympy as sp

    t = sp.Symbol("t", real=True)
    waves = {w for e in slow_system.reconstruction.values() for w in e.atoms(sp.sin, sp.cos) if w.has(t)}
    rates = sorted({sp.diff(w.args[0], t) for w in waves}, key=str)
    names = [*slow_system.states, *slow_system.parameters]
    return sp.lambdify([sp.Symbol(n, real=True) for n in names], rates, modules="numpy")  # type: ignore[no-any-return]


def steady_extrema(slow_system: System, states: Array, params: Mapping[str, Any]) -> tuple[Array, Array]:
    """(low, high), (n_original, P) each, of the steady motions that slow states (n, P) stand for.

    params gives each parameter as a number or as (P,) values. Error of the parabola: about (pi k/256)^4/10 relative
    for a motion of k swings a period.
    """
    number = states.shape[1]
    values = [np.broadcast_to(np.asarray(params[k], float), (number,)) for k in slow_system.parameters]
    rates = np.array([np.broadcast_to(r, (number,)) for r in _rates(slow_system)(*states, *values)])
    slowest = np.abs(rates).min(axis=0)
    parts = [Fraction(float(r)).limit_denominator(24) for r in np.abs(rates[:, 0]) / slowest[0]]
    period = 2 * np.pi / slowest * math.lcm(*(part.denominator for part in parts))
    time = period[:, None] * np.arange(_SAMPLES) / _SAMPLES
    rows = _motion(slow_system)(*states[:, :, None], *(v[:, None] for v in values), time)
    waves = np.array([np.broadcast_to(row, time.shape) for row in rows])
    return -_tops(-waves), _tops(waves)


def _tops(waves: Array) -> Array:
    """Largest values along the last axis (one period), by a parabola through the highest sample and its neighbours."""
    place = waves.argmax(axis=-1)[..., None]
    before, here, after = (
        np.take_along_axis(waves, (place + k) % waves.shape[-1], axis=-1)[..., 0] for k in (-1, 0, 1)
    )
    bend = before - 2 * here + after
    with np.errstate(divide="ignore", invalid="ignore"):
        rise = np.where(bend < 0, (after - before) ** 2 / (-8 * bend), 0.0)
    return np.asarray(here + rise)


def reconstruction_residual(
    system: System, slow_system: System, slow_state: Any, *, samples: int = 256, **params: float
) -> float:
    """What a steady solution of the slow flow leaves in the original equations, relative to the acceleration.

    max_t |q'' - f(t, q, q')| / max_t |q''| over one period of the response, the largest over the coordinates; q(t) is
    the reconstructed coordinate, its derivatives are exact.

    Parameters
    ----------
    system : System
        The original system.
    slow_system : System
        Its slow flow.
    slow_state : mapping, array (n,) or FixedPoint
        An equilibrium of the slow flow.
    samples : int
        Times over the period.
    **params : float
        Parameter values.

    Returns
    -------
    float
        O(eps) for the first order (the third harmonic is missing), O(eps^2) for the second.

    Raises
    ------
    InputError
        A slow flow that does not belong to the system.

    Examples
    --------
    >>> import stability as st
    >>> system = st.models.duffing_textbook(beta=0.01, gamma=0.1, omega=1.2)
    >>> slow = st.averaging(system)
    >>> point = st.solve(st.Equilibrium(slow))
    >>> st.reconstruction_residual(system, slow, point) < 1e-3
    True
    """
    import sympy as sp

    expected = [c for c in system.coordinates if c not in slow_system.reconstruction]
    if expected:
        raise InputError(f"'{slow_system.name}' is no slow flow of '{system.name}': it has no '{expected[0]}'")
    values, x = _values(slow_system, slow_state, params)
    if x.ndim > 1:
        raise InputError("the residual is that of one steady state, (n,); got a trajectory")
    t = sp.Symbol("t", real=True)
    numbers = {sp.Symbol(k, real=True): v for k, v in [*values.items(), *zip(slow_system.states, x.tolist())]}
    fixed = [slow_system.reconstruction[c].subs(numbers) for c in system.coordinates]
    position = sp.lambdify(t, fixed, modules="numpy")
    velocity = sp.lambdify(t, [e.diff(t) for e in fixed], modules="numpy")
    acceleration = sp.lambdify(t, [e.diff(t, 2) for e in fixed], modules="numpy")
    time = np.linspace(0.0, _response_period(system, slow_system, values, numbers), samples, endpoint=False)
    q, v, a = (
        np.array([np.broadcast_to(row, time.shape) for row in f(time)]) for f in (position, velocity, acceleration)
    )
    by_name = {**dict(zip(system.coordinates, q)), **{f"{c}_dot": row for c, row in zip(system.coordinates, v)}}
    rates = system(time, np.array([by_name[s] for s in system.states]), **values)
    wanted = np.array([rates[system.states.index(f"{c}_dot")] for c in system.coordinates])
    return float(np.max(np.abs(a - wanted)) / max(float(np.max(np.abs(a))), 1e-300))


def _response_period(
    system: System, slow_system: System, values: dict[str, float], numbers: Mapping[Any, float]
) -> float:
    """A time over which the reconstructed motion repeats (12 forcing periods hold 1:1 to 1:4 resonances)."""
    if system.period_expression is not None:
        return 12 * system.period_at(**values)
    return float(2 * np.pi / float(slow_system.outputs["frequency"].subs(numbers)))


def _values(slow_system: System, slow_state: Any, params: Mapping[str, float]) -> tuple[dict[str, float], Array]:
    if not slow_system.reconstruction:
        raise InputError(f"'{slow_system.name}' is no slow flow: it has no reconstruction (see `averaging`)")
    check_names("parameter", params, slow_system.parameters)
    values = {**slow_system.parameters}
    if hasattr(slow_state, "x") and hasattr(slow_state, "params"):
        values |= {k: float(v) for k, v in slow_state.params.items() if k in values}
        slow_state = slow_state.x
    values |= {k: float(v) for k, v in params.items()}
    if isinstance(slow_state, Mapping) or np.ndim(slow_state) < 2:
        return values, slow_system.state_vector(slow_state)
    x = np.asarray(slow_state, dtype=float)
    if x.shape[0] != slow_system.n:
        raise InputError(f"slow states have the state axis first, ({slow_system.n}, N); got {x.shape}")
    return values, x
