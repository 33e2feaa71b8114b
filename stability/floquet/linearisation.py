"""Linearisation about a periodic or constant solution: the periodic matrix A(t) whose Floquet theory decides stability.

Equation and convention
-----------------------
For x' = f(t, x, p) with forcing period T(p) and a solution x*(t) of period T the variation obeys

    y' = A(t) y,      A(t) = df/dx (t, x*(t), p),      A(t + T) = A(t),      phase s = t / T in [0, 1).

What x* is (`about`):

* None: x* = 0; it must be a solution for all t.
* a mapping of state names or an array (n,): a constant solution, refined by Newton's method from these values.
* a periodic orbit (an object with `period` and ``orbit(t) -> (n, N)``): must solve the equations.
* a function ``f(**parameters)`` that returns any of these, called once per parameter node.
* "linear": the linear response, that is the T-periodic solution of the equations linearised about their equilibrium,
  0 = mean of f(t, x_e) and y' = J(t, x_e) y + f(t, x_e). Where the motion it describes is an exact solution (the
  semi-trivial solution of an autoparametric system), the full equations are linearised about it.

Every choice is checked: the relative residual of x*' = f(t, x*, p) has to vanish at every parameter node, or a typed
error names it. Shapes: parameters P (N, m); phases (K,) or (K, N); A (K, N, n, n).

Reference: A. Tondl, T. Ruijgrok, F. Verhulst, R. Nabergoj, Autoparametric resonance in mechanical systems (2000),
chapter 1 (semi-trivial solutions).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, NonFiniteError
from .periodic_motion import Motion, constant_motion, linear_response, orbit_motion

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["PeriodicLinear", "linearise"]

Array = NDArray[np.float64]

_RESIDUAL = 1e-7  # relative; an orbit from a solver with tolerance 1e-9 passes, a truncated one does not
_PROBES = (np.arange(16) + 0.37) / 16.0  # phases where residuals and structure are looked at; not symmetric on purpose


@dataclass(frozen=True, eq=False)
class PeriodicLinear:
    """x' = A(t, p) x with A of period T(p): what `linearise` returns.

    Attributes
    ----------
    system : System
    about : what the system is linearised about (see the head of this module)
    evaluator : Evaluator of the system
    columns : bool, whether A is read off from f at unit vectors (Python functions that are linear in x)
    rows : the states that A is restricted to (a decoupled block), or None for all
    """

    system: System
    about: Any
    evaluator: Any
    columns: bool = False
    rows: tuple[int, ...] | None = None
    _motions: dict[bytes, Motion | None] = field(default_factory=dict, repr=False)

    @property
    def n(self) -> int:
        """Number of states of A."""
        return int(self.evaluator.n) if self.rows is None else len(self.rows)

    def block(self, rows: tuple[int, ...]) -> PeriodicLinear:
        """The linear system of some of the states only (sensible where no others act on them, or they on no others)."""
        return replace(self, rows=rows) if len(rows) < self.evaluator.n else self

    def A(self, phase: Any, P: Any) -> Array:
        """The matrix A at phases (K,) or (K, N) and parameters (N, m) or (m,): (K, N, n, n), per unit time."""
        return self.bind(P)(np.asarray(phase, dtype=float))

    def period(self, P: Any) -> Array:
        """T(p), (N,) for parameters (N, m) or (m,)."""
        return np.atleast_1d(np.asarray(self.evaluator.period(_nodes(P)), dtype=float))

    def breaks(self, P: Any) -> Array:
        """Phases in [0, 1) where A jumps: (nb,) if the same for all parameters (N, m), else (nb, N)."""
        P = _nodes(P)
        if not self.system.breaks:
            return np.zeros(0)
        first = np.asarray(self.evaluator.breaks(P[0]), dtype=float)
        if self._breaks_are_constant:
            return first
        each = [np.asarray(self.evaluator.breaks(p), dtype=float) for p in P]
        if len({len(b) for b in each}) > 1:
            raise InputError(
                f"two breaks of '{self.system.name}' merge on the range of parameters; restrict the range so that "
                "their number and order stay the same"
            )
        table = np.array(each).T
        return table[:, 0] if np.ptp(table, axis=1).max(initial=0.0) == 0.0 else table

    @property
    def _breaks_are_constant(self) -> bool:
        return not any(getattr(b, "free_symbols", None) for b in self.system.breaks)

    def motion(self, P: Any) -> Motion | None:
        """The solution x*(phase) at parameters (N, m), checked; None stands for x* = 0."""
        P = _nodes(P)
        key = P.tobytes()
        if key not in self._motions:
            motion = None
            if self.about is None:
                self._check_zero(P)
            else:
                motion = _motion(self, self.about, P)
                self._check(motion, P)
            while len(self._motions) >= 8:  # the same nodes come back several times in a row
                self._motions.pop(next(iter(self._motions)))
            self._motions[key] = motion
        return self._motions[key]

    def bind(self, P: Any) -> Callable[[Array], Array]:
        """``phases (K,) or (K, N) -> A (K, N, n, n)`` at fixed parameters: x* is found and checked once, here."""
        P = np.ascontiguousarray(_nodes(P))
        motion = self.motion(P)
        count, n, m = len(P), int(self.evaluator.n), P.shape[1]
        chosen = None if self.rows is None else np.array(self.rows)

        def matrix(phase: Array) -> Array:
            steps = len(phase)
            s = np.broadcast_to(phase[:, None] if phase.ndim == 1 else phase, (steps, count))
            flat = np.ascontiguousarray(s).reshape(-1)
            states = (
                np.zeros((flat.size, n)) if motion is None else np.ascontiguousarray(motion.at(phase).reshape(-1, n))
            )
            each = P[0] if count == 1 else np.broadcast_to(P, (steps, count, m)).reshape(-1, m)
            values = self._jacobian(flat, states, each)
            if not np.isfinite(values).all():
                raise self._non_finite(values, flat, each)
            values = values.reshape(steps, count, n, n)
            return values if chosen is None else values[..., chosen[:, None], chosen]

        return matrix

    def _jacobian(self, phase: Array, states: Array, P: Array) -> Array:
        if not self.columns:
            return np.asarray(self.evaluator.FJ(phase, states, P)[1])
        n = int(self.evaluator.n)
        values = np.empty((phase.size, n, n))
        for j in range(n):
            unit = np.zeros((phase.size, n))
            unit[:, j] = 1.0
            values[:, :, j] = self.evaluator.F(phase, unit, P)
        return values

    def _check_zero(self, P: Array) -> None:
        """x = 0 must be a solution at all phases."""
        F, scale = self._field(np.zeros((_PROBES.size, len(P), self.evaluator.n)), P)
        if np.abs(F).max(initial=0.0) <= 1e-12 * scale:
            return
        worst = int(np.abs(F).max(axis=(0, 1)).argmax())
        name = self.system.states[worst]
        raise InputError(
            f"x = 0 is not a solution of '{self.system.name}': {name}' = {np.abs(F[..., worst]).max():.3g} there; say "
            "what to linearise about: about=dict(<state>=<value>) for an equilibrium, about='linear' for the linear "
            "response, a PeriodicOrbit, or a function of the parameters that gives one of these"
        )

    def _check(self, motion: Motion, P: Array) -> None:
        """The residual x*' - f(t, x*, p), relative to the size of x*', must vanish."""
        s = np.broadcast_to(_PROBES[:, None], (_PROBES.size, len(P)))
        x, rate = motion.at(s), motion.rate(s) / self.period(P)[:, None]
        F, scale = self._field(x, P)
        residual = np.abs(F - rate).max(axis=(0, 1))
        relative = residual / max(float(np.abs(rate).max(initial=0.0)), 1e-3 * scale, 1e-300)
        if relative.max() <= _RESIDUAL:
            return
        state = self.system.states[int(relative.argmax())]
        what = "the linear response" if isinstance(self.about, str) else "what `about` gives"
        raise InputError(
            f"{what} is not a solution of '{self.system.name}' on this range of parameters: relative residual "
            f"{relative.max():.2g} in {state}'; linearise about a solution of the full equations: a PeriodicOrbit, or "
            "a function of the parameters that gives one (for instance from `solve` or a branch of `continuation`)"
        )

    def _field(self, x: Array, P: Array) -> tuple[Array, float]:
        """f at the probe phases, (K, N, n), and the size of its terms (from A times states of size one)."""
        count, n = len(P), int(self.evaluator.n)
        flat = np.repeat(_PROBES, count)
        each = np.tile(P, (_PROBES.size, 1))
        F, J = self.evaluator.FJ(flat, np.ascontiguousarray(x.reshape(-1, n)), each)
        if not np.isfinite(F).all():
            raise self._non_finite(F, flat, each)
        return F.reshape(_PROBES.size, count, n), max(1e-300, float(np.abs(J).max(initial=0.0)))

    def _non_finite(self, values: Array, phase: Array, P: Array) -> NonFiniteError:
        bad = np.argwhere(~np.isfinite(values))[0]
        p = P if P.ndim == 1 else P[bad[0]]
        listing = ", ".join(f"{k} = {v:.6g}" for k, v in zip(self.system.parameters, p, strict=True))
        return NonFiniteError(
            f"the equation of {self.system.states[bad[1]]} in '{self.system.name}' is not finite at phase "
            f"{phase[bad[0]]:.4g} and {listing}; restrict the range of parameters"
        )


def linearise(system: System, about: Any = None) -> PeriodicLinear:
    """The periodic linear system x' = A(t, p) x of a forced system about a solution.

    Parameters
    ----------
    system : System with a forcing period.
    about : None, equilibrium, periodic orbit, function of the parameters, or "linear"
        See the head of this module.

    Returns
    -------
    PeriodicLinear
        ``.A(phase (K,), P (N, m)) -> (K, N, n, n)``, ``.period(P)``, ``.breaks(P)``; errors about the solution are
        raised when parameters are given.

    Raises
    ------
    InputError
        The system is autonomous, or `about` is none of the above; at use: x* does not solve the equations.
    NonFiniteError
        At use: the equations are not finite at some parameters.

    *Accuracy*: A is exact to rounding about equilibria and exact orbits; checked against closed forms.

    Examples
    --------
    >>> import stability as st
    >>> mathieu = linearise(st.models.mathieu(a=1.0, b=0.5))
    >>> mathieu.A([0.0, 0.5], mathieu.system.parameter_vector())[:, 0, 1, 0]
    array([-1.5, -0.5])
    """
    if system.period_expression is None:
        raise InputError(
            f"'{system.name}' is autonomous: it has no forcing period, so there is no periodic matrix to integrate; "
            "use continuation(Equilibrium(system), ...) for its equilibria or Collocation for its periodic orbits"
        )
    known = about is None or callable(about) or hasattr(about, "period") or isinstance(about, Mapping)
    if isinstance(about, str):
        if about != "linear":
            raise InputError(f"about={about!r}: the only word is 'linear'; else an equilibrium, an orbit or a function")
    elif not known or isinstance(about, Mapping):
        about = system.state_vector(about)
    from ..systems.evaluators import evaluator

    compiled = evaluator(system)
    return PeriodicLinear(system, about, compiled, _is_linear_function(system, compiled))


def _nodes(P: Any) -> Array:
    P = np.asarray(P, dtype=float)
    return P[None, :] if P.ndim == 1 else P


def _motion(linear: PeriodicLinear, about: Any, P: Array) -> Motion:
    """x* for one value of `about` at parameters (N, m)."""
    field, n = linear.evaluator, linear.n
    if isinstance(about, str):
        return linear_response(field, linear.period(P), P)
    if hasattr(about, "period"):
        return orbit_motion(about, linear.period(P), linear.system.name)
    if not callable(about):
        return constant_motion(field, np.broadcast_to(about, (len(P), n)), P)
    each = []
    for p in P:
        value = about(**dict(zip(linear.system.parameters, p.tolist(), strict=True)))
        if not hasattr(value, "period"):
            value = linear.system.state_vector(value)
        each.append(_motion(linear, value, p[None, :]))
    return Motion.stacked(each)


def _is_linear_function(system: System, compiled: Any) -> bool:
    """Whether a Python function is linear in x, found by trying: then A needs no differences at all."""
    if system.function is None:
        return False
    P = system.parameter_vector()
    x = np.random.default_rng(7).normal(size=(_PROBES.size, compiled.n))
    one, two, zero = (compiled.F(_PROBES, c * x, P) for c in (1.0, 2.0**20, 0.0))
    return bool(np.all(zero == 0) and np.allclose(two, 2.0**20 * one, rtol=1e-14, atol=0))
