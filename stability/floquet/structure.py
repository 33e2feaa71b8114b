"""What kind of periodic linear system it is, which decides how little has to be computed.

Looked for, on random nodes of the range of parameters and phases that favour no symmetry:

* scalar: two states with A = [[0, 1], [-k(t), -c(t)]], that is q'' + c q' + k q = 0;
* constant damping: c does not depend on t; then q = exp(-c t / 2) x with x'' + (k - c^2/4) x = 0 (Hill's equation),
  so that damping is exact algebra;
* even: k(s0 + s) = k(s0 - s) for a phase s0 that is the same for all parameters; then half a period is enough;
* blocks: groups of states that act on each other (strongly connected in the pattern of A). The multipliers of A are
  those of its diagonal blocks together, so decoupled or one-way coupled parts are done one by one;
* constant trace, and trace-free: det of the monodromy matrix is 1, so a system of two states is stable only
  neutrally.

The answers are identities of analytic functions: found true at random points to rounding, they hold everywhere but
with probability zero. This works for equations and for Python functions alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.block_triangular import mutual_blocks
from .linearisation import PeriodicLinear

__all__ = ["Structure", "blocks", "structure"]

Array = NDArray[np.float64]
_ROUNDING = 1e-13


@dataclass(frozen=True)
class Structure:
    """Flags of a periodic linear system on a range of parameters.

    Attributes
    ----------
    scalar : q'' + c(t) q' + k(t) q = 0
    constant_damping : scalar with c independent of t
    centre : phase s0 about which k is even, or None
    constant_trace : trace of A independent of t
    trace_free : trace of A zero
    """

    scalar: bool
    constant_damping: bool
    centre: float | None
    constant_trace: bool
    trace_free: bool


def structure(linear: PeriodicLinear, nodes: Array) -> Structure:
    """The structure of `linear` on the box of parameters spanned by `nodes` (N, m), N >= 2.

    >>> import stability as st
    >>> from stability.floquet.linearisation import linearise
    >>> mathieu = linearise(st.models.mathieu())
    >>> found = structure(mathieu, mathieu.system.parameter_vector() * [[0.5] * 4, [1.5] * 4])
    >>> found.scalar, found.constant_damping, found.centre, found.trace_free
    (True, True, 0.0, True)
    """
    random = np.random.default_rng(20)
    lo, hi = nodes.min(axis=0), nodes.max(axis=0)
    probes = lo + (hi - lo) * random.random((5, len(lo)))
    phases: Array = np.asarray((np.arange(64) + 0.37) / 64.0, dtype=np.float64)
    field = linear.bind(probes)
    A = field(phases)
    trace = np.asarray(np.trace(A, axis1=2, axis2=3), dtype=float)
    # against the diagonal itself: off-diagonal entries have other units (k/m of a fast circuit is 1e21 beside R/L)
    size = float(np.abs(np.diagonal(A, axis1=2, axis2=3)).max())
    constant_trace = bool(np.ptp(trace, axis=0).max() <= _ROUNDING * size)
    trace_free = bool(np.abs(trace).max() <= _ROUNDING * size * 1e-2)
    scalar = linear.n == 2 and bool(np.all(A[..., 0, 0] == 0) and np.all(A[..., 0, 1] == 1))
    damping = scalar and constant_trace
    centre = _centre(linear, field, probes, np.asarray(A[..., 1, 0], dtype=float)) if damping else None
    return Structure(scalar, damping, centre, constant_trace, trace_free)


def blocks(linear: PeriodicLinear, nodes: Array) -> tuple[tuple[int, ...], ...]:
    """Groups of states that act on each other, on the box of parameters spanned by `nodes` (N, m).

    >>> import stability as st
    >>> from stability.floquet.linearisation import linearise
    >>> trap = linearise(st.models.paul_trap())
    >>> blocks(trap, trap.system.parameter_vector() * [[0.5] * 3, [1.5] * 3])
    ((0, 2), (1, 3))
    """
    lo, hi = nodes.min(axis=0), nodes.max(axis=0)
    probes = lo + (hi - lo) * np.random.default_rng(21).random((5, len(lo)))
    A = linear.bind(probes)(np.asarray((np.arange(32) + 0.37) / 32.0, dtype=np.float64))
    # exact zeros only: between units as far apart as q and q'' of a fast circuit no threshold tells noise from coupling
    return tuple(tuple(group.tolist()) for group in mutual_blocks((A != 0.0).any(axis=(0, 1))))


def _centre(linear: PeriodicLinear, field: Callable[[Array], Array], probes: Array, stiffness: Array) -> float | None:
    """The first candidate phase about which the stiffness is even at all probes."""
    shifts = (np.arange(23) + 0.29) / 47.0
    size = max(float(np.abs(stiffness).max()), 1e-300)
    for s0 in _candidates(linear, probes, stiffness):
        right, left = (field(np.mod(s0 + sign * shifts, 1.0))[..., 1, 0] for sign in (1.0, -1.0))
        if np.abs(right - left).max() <= _ROUNDING * size:
            return s0
    return None


def _candidates(linear: PeriodicLinear, probes: Array, stiffness: Array) -> Iterator[float]:
    """Phases that could be centres: 0 and 1/4, those of the leading harmonic, midpoints of breaks."""
    yield from (0.0, 0.25)
    breaks = linear.breaks(probes)
    if breaks.ndim == 1:
        for i, first in enumerate(breaks):
            for second in breaks[i:]:
                yield float(np.mod(0.5 * (first + second), 0.5))
        for start in breaks[:1]:
            yield float(np.mod(0.5 * (start + breaks[-1] - 1.0), 0.5))
    spectrum = np.fft.rfft(stiffness[:, 0])[1:]
    size = np.abs(spectrum)
    if not size.any():
        return
    m = int(np.flatnonzero(size > 1e-6 * size.max())[0]) + 1
    angle = np.angle(spectrum[m - 1])
    for j in range(2 * m):
        yield float(np.mod(0.37 / 64.0 - (angle + np.pi * j) / (2.0 * np.pi * m), 1.0))
