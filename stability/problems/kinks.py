"""Does an orbit pass a kink or jump of its right-hand side?

Where it does, the map of one period has second and third derivatives that come from the moment of passing, not from the
field on either side (x' = 8 max(x - 1, 0) has none there), so that nothing built on derivatives of the field holds.
Guards g(t, x, p), whose signs decide the pieces, are those of `integration.switches`; an orbit passes one where g has
both signs along it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from ..integration.switches import frozen_switches, has_switches

__all__ = ["passes_a_kink"]

_SAMPLES = 1024


@lru_cache(maxsize=64)
def _guards(system: Any) -> Any:
    """g(t, x, p) of all guards as one function; None without any."""
    if not has_switches(system):
        return None
    t = sp.Symbol("t", real=True)
    symbols = [sp.Symbol(name, real=True) for name in (*system.states, *system.parameters)]
    return sp.lambdify([t, *symbols], list(frozen_switches(system)[0].guards), "numpy")


def passes_a_kink(system: Any, orbit: Any) -> bool:
    """Whether a guard of the system changes its sign along a periodic orbit."""
    guards = _guards(system)
    if guards is None:
        return False
    times = np.linspace(0.0, orbit.period, _SAMPLES, endpoint=False)
    values = guards(times, *orbit(times), *(orbit.params[name] for name in system.parameters))
    return any(float(np.min(g)) < 0.0 < float(np.max(g)) for g in values)
