"""What a simulation starts from: initial states and parameters by name, single ones or batches.

A batch is any array among the initial values and parameters; all of them broadcast to one shape, (B,). The state axis
comes first: states (n, B). Everything is checked before work starts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InputError, check_names

__all__ = ["batch", "checked_span"]

Array = np.ndarray


def checked_span(span: Any) -> tuple[float, float]:
    """(t0, t1): finite, ascending."""
    try:
        t0, t1 = (float(value) for value in span)
    except (TypeError, ValueError):
        raise InputError(f"the time interval is (t0, t1), two numbers; got {span!r}") from None
    if not (math.isfinite(t0) and math.isfinite(t1) and t1 > t0):
        raise InputError(f"the time interval is (t0, t1) with finite t0 < t1; got ({t0:g}, {t1:g})")
    return t0, t1


def _states(system: Any, x0: Any) -> Array:
    """(n,) or (n, B)."""
    if x0 is None or (not isinstance(x0, Mapping) and np.ndim(x0) <= 1):
        return np.asarray(system.state_vector(x0))
    if not isinstance(x0, Mapping):
        values = np.asarray(x0, float)
        if values.ndim != 2 or len(values) != system.n:
            listing = ", ".join(system.states)
            shapes = f"({system.n},) or ({system.n}, B)"
            raise InputError(f"states of '{system.name}' have shape {shapes}: {listing}; got {values.shape}")
    else:
        check_names("state", x0, system.states)
        try:
            rows = np.broadcast_arrays(*(np.asarray(x0.get(s, 0.0), float) for s in system.states))
        except ValueError as error:
            raise InputError(f"the initial values do not broadcast: {error}") from None
        values = np.array(rows)
    if values.ndim > 2:
        raise InputError(f"a batch of initial states has one axis; got values of shape {values.shape[1:]}")
    if not np.isfinite(values).all():
        raise InputError("an initial state is not finite")
    return values


def batch(system: Any, x0: Any, params: Mapping[str, Any]) -> tuple[Array, Array, int | None]:
    """(X (B, n), P (B, m), B): C-contiguous rows; B is None where nothing is an array (then there is one row).

    Raises
    ------
    InputError, UnknownNameError
        Wrong shapes, names, bounds, or values that are not finite.
    """
    states = _states(system, x0)
    check_names("parameter", params, system.parameters)
    sizes = {np.size(value) for value in params.values() if np.ndim(value)}
    if any(np.ndim(value) > 1 for value in params.values()):
        raise InputError("a batch of parameters has one axis, (B,)")
    if states.ndim == 2:
        sizes.add(states.shape[1])
    sizes -= {1} if len(sizes) > 1 else set()
    if len(sizes) > 1:
        raise InputError(f"batches of different lengths: {', '.join(map(str, sorted(sizes)))}")
    count = sizes.pop() if sizes else None
    rows = 1 if count is None else count
    if rows == 0:
        raise InputError("an empty batch")
    X = np.ascontiguousarray(np.broadcast_to(states[:, None] if states.ndim == 1 else states, (system.n, rows)).T)
    fixed = {k: float(np.ravel(v)[0]) for k, v in params.items() if np.size(v) == 1}
    P = np.tile(system.parameter_vector(**fixed), (rows, 1))
    names = list(system.parameters)
    for name, value in params.items():
        if name not in fixed:
            values = np.asarray(value, float)
            for extreme in (values.min(), values.max(), *values[~np.isfinite(values)][:1]):
                system.parameter_vector(**{name: float(extreme)})
            P[:, names.index(name)] = values
    return X, P, count
