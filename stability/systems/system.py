"""`System`: what an oscillator is, as data.

    x' = f(t, x, p),      x in R^n,   p in R^m,      f(t + T(p), x, p) = f(t, x, p)   (or autonomous: no t, no T)

The states are the coordinates, then the velocities of those coordinates that have an equation of second order, named
``<coordinate>_dot``. All symbols are real sympy symbols of the states' and parameters' names; time is ``t``. A system
of expressions is data: it serialises to a JSON tree, and two systems with the same content are equal and hash alike,
in every process. A system around a Python function hashes by the function's identity.

A `System` carries no analysis: the verbs (`monodromy`, `chart`, `continuation`, ...) are functions that take it.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import EquationError, FileFormatError, InputError, check_names
from .constructors import Constructors

if TYPE_CHECKING:
    import sympy as sp

    from .excitation import BaseMotion, Excitation
    from .symmetries import Symmetry

__all__ = ["System"]

Array = npt.NDArray[np.float64]
_SCHEMA = "stability.system/1"


def _frozen(mapping: Mapping[str, Any] | None) -> Mapping[str, Any]:
    return MappingProxyType(dict(mapping or {}))


@dataclass(frozen=True, eq=False, repr=False)
class System(Constructors):
    """An oscillator: x' = f(t, x, p) with named states, named parameters with defaults, and outputs.

    Build one with `from_equations`, `from_lagrangian`, `from_function`, `from_toml` or a model of the catalogue; the
    constructor itself takes the explicit first-order form and checks it.

    Parameters
    ----------
    name : str
        What it is called in tables and figures.
    coordinates : tuple of str
        The generalised coordinates.
    states : tuple of str, length n
        The coordinates, then the velocities ``<coordinate>_dot``.
    parameters : mapping of str to float, length m
        Name -> default value, in declared order.
    rhs : tuple of sympy expressions, length n, or None
        x' in real symbols of the states, the parameters and ``t``; None for a system around a Python function.
    period_expression : sympy expression or None
        The forcing period T(p); None for an autonomous system.
    outputs : mapping of str to sympy expression
        Further named quantities of states, parameters and ``t``.
    units, bounds : mappings
        Of parameters (and states): a unit to print; an interval (lo, hi) of allowed values.
    breaks : tuple of sympy expressions
        Phases in [0, 1) at which f jumps in time.
    angles : tuple of str
        Coordinates that are angles (periodic orbits may wind: x(T) = x(0) + 2 pi k).
    orders : mapping of str to int
        Scaling orders: the power of the small parameter that a parameter carries (used by averaging).
    stops : tuple of HardStop
        Walls that limit coordinates.
    reconstruction : mapping of str to sympy expression
        For a slow flow: the states of the original system in the slow states, the parameters and ``t``.
    base : BaseMotion or None
        Which parameter is the base amplitude or acceleration, and the angular frequency (for `with_excitation`).
    description : str
        One sentence.
    function : callable or None
        ``f(t, x, *, <parameters>)`` of a system around a Python function.
    declared_symmetries : tuple of Symmetry, or of mappings ``{"u": "-u"}``
        Symmetries to be verified now, beside those that `symmetries` finds by itself.

    Raises
    ------
    EquationError
        If the equations are not square, use unknown symbols, or depend on time without a period.

    Examples
    --------
    >>> import sympy as sp, stability as st
    >>> t, Omega = sp.symbols("t Omega", real=True); q = sp.Function("q")(t)
    >>> hill = st.System.from_equations({q.diff(t, 2): -(1 + 0.2*sp.cos(Omega*t))*q},
    ...                                 coordinates=[q], parameters=dict(Omega=2.0))
    >>> hill.states, round(hill.period, 6)
    (('q', 'q_dot'), 3.141593)
    """

    name: str
    coordinates: tuple[str, ...]
    states: tuple[str, ...]
    parameters: Mapping[str, float]
    rhs: tuple[sp.Expr, ...] | None
    period_expression: Any = None
    outputs: Mapping[str, sp.Expr] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    breaks: tuple[Any, ...] = ()
    angles: tuple[str, ...] = ()
    orders: Mapping[str, int] = field(default_factory=dict)
    stops: tuple[Any, ...] = ()
    reconstruction: Mapping[str, sp.Expr] = field(default_factory=dict)
    base: BaseMotion | None = None
    description: str = ""
    function: Callable[..., Any] | None = None
    declared_symmetries: tuple[Any, ...] = ()
    _hash: str = field(default="", init=False)

    def __post_init__(self) -> None:
        from .checks import checked_fields

        for key in ("parameters", "outputs", "units", "bounds", "orders", "reconstruction"):
            object.__setattr__(self, key, _frozen(getattr(self, key)))
        for key, value in checked_fields(self).items():
            object.__setattr__(self, key, _frozen(value) if isinstance(value, Mapping) else value)
        object.__setattr__(self, "_hash", self._digest())
        if self.declared_symmetries:
            from .symmetries import verified

            object.__setattr__(self, "declared_symmetries", tuple(verified(self, s) for s in self.declared_symmetries))

    # ------------------------------------------------------------------ reading
    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.states)

    @property
    def period(self) -> float | None:
        """The forcing period at the system's own parameters; None for an autonomous system."""
        if self.period_expression is None:
            return None
        return self.period_at(**dict(self.parameters))

    @property
    def symmetries(self) -> tuple[Symmetry, ...]:
        """Space-time symmetries f(t + shift T, S x, p) = S f(t, x, p): the declared ones, then those that were found.

        >>> import stability as st
        >>> st.models.autoparametric_pendulum().symmetries
        (theta -> -theta,)
        """
        from .symmetry_search import find_symmetries

        own = {(s.images, s.shift) for s in self.declared_symmetries}
        return (*self.declared_symmetries, *(s for s in find_symmetries(self) if (s.images, s.shift) not in own))

    def period_at(self, **params: float) -> float:
        """The forcing period at the given parameters (others at their defaults)."""
        values = {**self.parameters, **params}
        check_names("parameter", params, self.parameters)
        expression = self.period_expression
        if expression is None:
            raise InputError(f"'{self.name}' is autonomous: it has no forcing period")
        if self.function is not None and callable(expression) and not hasattr(expression, "free_symbols"):
            value = float(expression(**values))
        else:
            number = expression.subs({s: values[s.name] for s in expression.free_symbols}).evalf()
            value = float(number) if number.is_real else math.inf
        if not math.isfinite(value) or value <= 0:
            used = ", ".join(f"{k} = {v:g}" for k, v in values.items())
            raise InputError(f"the period of '{self.name}' is {value:g} at {used}; it must be finite and positive")
        return value

    def parameter_vector(self, **overrides: float) -> Array:
        """Parameter values (m,) in declared order, with `overrides` by name; checked against names and bounds."""
        check_names("parameter", overrides, self.parameters)
        for key, value in overrides.items():
            self._check_value(key, value)
        values = {**self.parameters, **overrides} if overrides else self.parameters
        return np.array(list(values.values()), float)

    def state_vector(self, x0: Mapping[str, float] | npt.ArrayLike | None = None) -> Array:
        """State (n,) from a mapping of names (missing ones zero), an array in state order, or None (all zero)."""
        if x0 is None:
            return np.zeros(self.n)
        if isinstance(x0, Mapping):
            check_names("state", x0, self.states)
            out = np.array([float(x0.get(s, 0.0)) for s in self.states])
        else:
            out = np.asarray(x0, dtype=float)
            if out.shape != (self.n,):
                listing = ", ".join(self.states)
                raise InputError(f"a state of '{self.name}' has shape ({self.n},): {listing}; got {out.shape}")
        if not all(map(math.isfinite, out.tolist())):
            raise InputError(f"the state {dict(zip(self.states, out.tolist()))} is not finite")
        return out

    def __call__(self, t: npt.ArrayLike, x: npt.ArrayLike, **params: float) -> Array:
        """dx/dt at time(s) t; x is (n,) or (n, N), state axis first, so ``solve_ivp(system, ...)`` works."""
        from .evaluators import evaluator

        X = np.asarray(x, dtype=float)
        if X.shape[:1] != (self.n,):
            raise InputError(f"x has the state axis first, ({self.n},) or ({self.n}, N); got shape {X.shape}")
        shape = np.broadcast_shapes(np.shape(t), X.shape[1:])
        points = np.ascontiguousarray(np.broadcast_to(X, (self.n, *shape)).reshape(self.n, -1).T)
        time = np.broadcast_to(np.asarray(t, dtype=float), shape).reshape(-1)
        p = self.parameter_vector(**params)
        period = self.period_at(**params) if self.period_expression is not None else 1.0
        values = evaluator(self).F(np.ascontiguousarray(time / period), points, p)
        return np.asarray(values.T.reshape(self.n, *shape))

    # ------------------------------------------------------------------ copies
    def with_params(self, **values: float) -> System:
        """A copy with other default parameter values.

        >>> import stability as st
        >>> st.models.mathieu().with_params(delta=0.1).parameters["delta"]
        0.1
        """
        check_names("parameter", values, self.parameters)
        for key, value in values.items():
            self._check_value(key, value)
        return self.replace(parameters={k: float(values.get(k, v)) for k, v in self.parameters.items()})

    def with_excitation(self, excitation: Excitation) -> System:
        """A copy driven at constant base amplitude or constant base acceleration.

        Parameters
        ----------
        excitation : ConstantAmplitude or ConstantAcceleration
            Amplitude in m, or acceleration amplitude in m/s^2 (base motion y0 = A cos wt, acceleration A w^2).

        Returns
        -------
        System
            Its base parameter is ``amplitude`` or ``acceleration``.

        Raises
        ------
        InputError
            If the system declares no base motion.
        """
        return excitation.applied_to(self)

    def replace(self, **fields: Any) -> System:
        """A copy with other fields (checked again)."""
        return dataclasses.replace(self, **fields)

    def _check_value(self, key: str, value: float) -> None:
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InputError(f"parameter '{key}' must be a number; got {value!r}") from None
        lo, hi = self.bounds.get(key, (-math.inf, math.inf))
        if not math.isfinite(number):
            raise InputError(f"parameter '{key}' must be finite; got {number}")
        if not lo <= number <= hi:
            raise InputError(f"parameter '{key}' = {number:.15g} is outside its bounds [{lo:.15g}, {hi:.15g}]")

    # ------------------------------------------------------------------ data
    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-able data that `from_dict` turns back into an equal system (not for Python functions)."""
        from .storage import to_plain

        return to_plain(self, _SCHEMA)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> System:
        """The system that `to_dict` described; the data is validated and never run."""
        from .storage import from_plain

        if not isinstance(data, Mapping) or data.get("schema") != _SCHEMA:
            raise FileFormatError(f"not a system of schema {_SCHEMA}")
        return cls(**from_plain(data))

    def _digest(self) -> str:
        if self.function is not None:
            content: dict[str, Any] = {"function": id(self.function), "parameters": dict(self.parameters)}
        else:
            content = self.to_dict()
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    @property
    def digest(self) -> str:
        """A hash of the content (hex), the same in every process for systems of expressions."""
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, System) and self._hash == other._hash and self.function is other.function

    def __hash__(self) -> int:
        return int(self._hash[:15], 16)

    # ------------------------------------------------------------------ showing
    def __repr__(self) -> str:
        from .printing import summary

        return summary(self)

    def latex(self) -> str:
        r"""The equations as a LaTeX ``aligned`` block, coordinates with dots.

        >>> import stability as st
        >>> print(st.models.van_der_pol().latex().splitlines()[1])
        \ddot{x} &= \mu \dot{x} \left(1 - x^{2}\right) - x
        """
        from .printing import latex_equations

        if self.rhs is None:
            raise EquationError(f"'{self.name}' is a Python function: it has no equations to print")
        return latex_equations(self)
