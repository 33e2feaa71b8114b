r"""Energy audit of a motion: what was put in, what was stored, what was lost.

For an energy E(x, p) the motion x' = f = f_0(x) + f_t(t, x), with all terms that contain time in f_t, changes it by

    E(t1) - E(t0) = int E_x . f_t dt  +  int E_x . f_0 dt  +  sum over impacts of E(x+) - E(x-)
                    supplied             - dissipated         - lost in impacts

Each term is computed on its own (quadrature over the steps, differences at impacts), so that what is left over, the
imbalance, measures the integration. Without an energy, one degree of freedom takes v^2/2 + U(q) per unit mass, U' =
-f_0 at v = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from ..errors import InputError
from ..results.trajectory import Trajectory
from ..systems.equations import symbol
from ..systems.evaluators import evaluator
from ..systems.expressions import differentiate
from ..systems.parsing import parse_expression

__all__ = ["EnergyBalance", "energy_balance"]

Array = np.ndarray
TIME = sp.Symbol("t", real=True)
_INSIDE = 1e-12


@dataclass(frozen=True)
class EnergyBalance:
    """Terms of the energy balance of a trajectory; what `energy_balance` returns.

    Attributes
    ----------
    stored : float, energy at the end minus energy at the start
    supplied : float, work of the terms that contain time
    dissipated : float, work taken by the others (a negative damper gives)
    impacts : float, energy lost in impacts
    imbalance : float, stored - supplied + dissipated + impacts, over the largest of the energies that moved
    """

    stored: float
    supplied: float
    dissipated: float
    impacts: float
    imbalance: float


def energy_balance(system: Any, trajectory: Trajectory, energy: Any = None) -> EnergyBalance:
    """Audit the energy of a trajectory.

    Parameters
    ----------
    system : System whose motion it is
    trajectory : Trajectory
    energy : expression of states and parameters, sympy or text; default v^2/2 + U(q) for one degree of freedom

    Returns
    -------
    EnergyBalance

    Raises
    ------
    InputError
        A Python function (it has no equations to read), other states, or an energy that has to be given.

    Examples
    --------
    >>> import stability as st
    >>> duffing = st.models.duffing(xi=0.02, beta=0.1)
    >>> abs(st.energy_balance(duffing, st.simulate(duffing, (0, 50))).imbalance) < 1e-8
    True
    """
    if system.rhs is None:
        raise InputError(f"'{system.name}' is a Python function: it has no equations to take the powers from")
    if tuple(system.states) != trajectory.states:
        raise InputError(f"this trajectory has the states {', '.join(trajectory.states)}, '{system.name}' has others")
    parts = [sp.expand(e).as_independent(TIME, as_Add=True) for e in system.rhs]
    E = _energy(system, energy, [rest for rest, _ in parts])
    slopes = [differentiate(E, symbol(s)) for s in system.states]
    powers = {
        "stored_energy": E,
        "supplied_power": sp.Add(*(g * timed for g, (_, timed) in zip(slopes, parts))) + differentiate(E, TIME),
        "other_power": sp.Add(*(g * rest for g, (rest, _) in zip(slopes, parts))),
    }
    audited = evaluator(system.replace(outputs=powers, stops=(), units={}))
    p = system.parameter_vector(**dict(trajectory.params))
    rate = 1.0 if trajectory.period is None else 1.0 / trajectory.period

    def at(times: Array, states: Array) -> Array:
        return np.asarray(audited.outputs(np.ascontiguousarray(times * rate), np.ascontiguousarray(states), p))

    supplied, other = _work(trajectory, at)
    ends = at(np.array(trajectory.span), np.array([trajectory(trajectory.span[0]), trajectory.final]))[:, 0]
    hits = [e for e in trajectory.events if e.kind in ("impact", "stick")]
    lost = 0.0
    if hits:
        times = np.array([e.t for e in hits])
        before, after = np.array([e.before for e in hits]), np.array([e.after for e in hits])
        lost = float((at(times, before) - at(times, after))[:, 0].sum())
    stored = float(ends[1] - ends[0])
    moved = max(abs(stored), abs(supplied), abs(other), abs(lost), float(np.abs(ends).max()), 1e-300)
    return EnergyBalance(stored, supplied, -other, lost, (stored - supplied - other + lost) / moved)


def _work(trajectory: Trajectory, at: Any) -> tuple[float, float]:
    """Integrals of the two powers over all steps, Gauss-Legendre with 12 points each."""
    s, w = np.polynomial.legendre.leggauss(12)
    widths = np.diff(trajectory.edges)
    times = trajectory.edges[:-1, None] + widths[:, None] * (0.5 + 0.5 * s)
    basis = np.polynomial.chebyshev.chebvander(s, 7)
    states = np.einsum("si,kin->ksn", basis, trajectory.coefficients)
    values = at(times.ravel(), states.reshape(-1, len(trajectory.states)))[:, 1:].reshape(*times.shape, 2)
    supplied, other = np.einsum("k,s,ksp->p", 0.5 * widths, w, values)
    return float(supplied), float(other)


def _energy(system: Any, energy: Any, rest: list[sp.Expr]) -> sp.Expr:
    if energy is not None:
        names = [*system.states, *system.parameters, "t"]
        return parse_expression(energy, names) if isinstance(energy, str) else sp.sympify(energy)
    if len(system.coordinates) != 1 or len(system.states) != 2 or system.rhs[0] != symbol(system.states[1]):
        raise InputError(f"'{system.name}' is no oscillator of one degree of freedom: give energy=, by its states")
    q, v = (symbol(s) for s in system.states)
    force = rest[1].subs(v, 0)
    potential = -sp.integrate(force, q)
    if potential.has(sp.Integral, sp.Piecewise, sp.Max, sp.Min, sp.Abs):
        raise InputError(f"the potential of {force} is not found in closed form: give energy=, by the states")
    return v**2 / 2 + potential
