"""What compiled kernels need of a system: addresses, forcing period, breaks, which equations are x' = v.

The forcing period T(p) with its gradient is handed to kernels as a field of one state by the same C signature as the
system itself (F = T, Fp = dT/dp): machine code where the period is an expression, a callback where it is a Python
function. An `CompiledField` keeps the owners of both addresses alive.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from ..errors import unknown_name
from ..systems.evaluators import evaluator

__all__ = ["CompiledField"]

Array = np.ndarray
_KEPT = 64
_KINDS = [ctypes.c_int64] + [ctypes.c_void_p] * 3 + [ctypes.c_int64] + [ctypes.c_void_p] * 3


@dataclass(frozen=True, eq=False)
class CompiledField:
    """Compiled field and period of one system.

    Attributes
    ----------
    evaluations : Evaluator of the system;  clock : Evaluator of the period (None: autonomous, or a Python function)
    address, period_address : int;  0 for an autonomous system's period
    kept, position : int arrays, see kernels/condensation.py
    places : parameter name -> index in p
    expressions : (right-hand sides or None, names of the states)
    """

    evaluations: Any
    clock: Any
    address: int
    period_address: int
    kept: Array
    position: Array
    places: dict[str, int]
    expressions: tuple[Any, tuple[str, ...]]
    keep_alive: Any = field(default=None, repr=False)
    _timings: dict[bytes, tuple[float, Array, Array]] = field(default_factory=dict, repr=False)

    @property
    def forced(self) -> bool:
        """Whether the system has a forcing period."""
        return bool(self.evaluations.forced)

    def place(self, name: str) -> int:
        """Index of a parameter in p."""
        if name not in self.places:
            raise unknown_name("parameter", name, self.places)
        return self.places[name]

    def breaks(self, params: Array) -> Array:
        """Phases in [0, 1) where the field jumps."""
        return np.asarray(self.evaluations.breaks(params))

    def timing(self, params: Array) -> tuple[float, Array, Array]:
        """(forcing period T, T_p / T (m,), breaks) at `params`, kept for a while; (1, zeros, none) without a period."""
        key = params.tobytes()
        known = self._timings.get(key)
        if known is None:
            if self.forced:
                period = float(self.evaluations.period(params))
                known = period, np.asarray(self.evaluations.period_gradient(params)) / period, self.breaks(params)
            else:
                known = 1.0, np.zeros(len(params)), np.zeros(0)
            if len(self._timings) >= _KEPT:
                self._timings.clear()
            self._timings[key] = known
        return known

    def divergence_free(self, params: Array) -> bool:
        """Whether sum dF_i/dx_i vanishes identically at `params` (False for Python functions)."""
        rhs, states = self.expressions
        if rhs is None:
            return False
        import sympy

        symbols = [sympy.Symbol(name, real=True) for name in states]
        total = sum(sympy.diff(e, x) for e, x in zip(rhs, symbols))
        values = {sympy.Symbol(name, real=True): sympy.Float(float(params[k])) for name, k in self.places.items()}
        return bool(sympy.simplify(sympy.sympify(total).subs(values)) == 0)

    def period_second(self, params: Array, free: int) -> Array:
        """d2T / dp_free dp, (m,)."""
        m = len(params)
        if self.clock is not None:
            direction = np.zeros((m, 1 + m))
            direction[:, 1 + free] = 1.0
            units = np.hstack([np.zeros((m, 1)), np.eye(m)])
            return np.asarray(self.clock.second(None, np.zeros((m, 1)), params, direction, units)[:, 0])
        step = 1e-5 * max(abs(params[free]), 1e-3)
        up, down = params.copy(), params.copy()
        up[free], down[free] = params[free] + step, params[free] - step
        slope = self.evaluations.period_gradient
        return np.asarray((slope(up) - slope(down)) / (2 * step))

    @classmethod
    def of(cls, system: Any) -> CompiledField:
        """The field of a system, made once; the last 64 are kept."""
        return _kept(system)

    @classmethod
    def _made(cls, system: Any) -> CompiledField:
        evaluations = evaluator(system)
        kept, position = _kinematics(system)
        places = {name: k for k, name in enumerate(system.parameters)}
        clock, address, owner = None, 0, None
        if evaluations.forced:
            if hasattr(system.period_expression, "free_symbols"):
                clock = evaluator(_clock(system))
                address = clock.address("FJP")
            else:
                address, owner = _period_callback(evaluations)
        expressions = (system.rhs, tuple(system.states))
        return cls(evaluations, clock, evaluations.address("FJP"), address, kept, position, places, expressions, owner)


@lru_cache(maxsize=64)
def _kept(system: Any) -> CompiledField:
    return CompiledField._made(system)


def _clock(system: Any) -> Any:
    """A one-state system whose right-hand side is the forcing period."""
    from ..systems.system import System

    return System("forcing period", ("elapsed",), ("elapsed",), dict(system.parameters), (system.period_expression,))


def _period_callback(evaluations: Any) -> tuple[int, Any]:
    m = evaluations.m

    def callback(count: int, phase: int, X: int, P: int, stride: int, F: int, J: int, Fp: int) -> None:
        params = np.ctypeslib.as_array((ctypes.c_double * m).from_address(P)).copy() if m else np.zeros(0)
        value = ctypes.c_double.from_address(F)
        slope = np.ctypeslib.as_array((ctypes.c_double * m).from_address(Fp)) if m else np.zeros(0)
        try:
            value.value, slope[:] = evaluations.period(params), evaluations.period_gradient(params)
        except (ArithmeticError, ValueError, TypeError):
            value.value, slope[:] = np.nan, np.nan

    function = ctypes.CFUNCTYPE(None, *_KINDS)(callback)
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0), function


def _kinematics(system: Any) -> tuple[Array, Array]:
    """(kept, position): states whose equation is exactly x' = another state are not kept."""
    n = len(system.states)
    if system.rhs is None:
        return np.arange(n), np.full(n, -1)
    names = [getattr(expression, "name", None) for expression in system.rhs]
    derivative = {a: system.states.index(name) for a, name in enumerate(names) if name in system.states}
    # a velocity that is itself some state's copy, or serves two positions, is left alone
    pairs: dict[int, int] = {}
    for a, v in derivative.items():
        if v != a and v not in derivative and v not in pairs:
            pairs[v] = a
    kept = [k for k in range(n) if k not in pairs.values()]
    return np.array(kept, np.int64), np.array([pairs.get(k, -1) for k in kept], np.int64)
