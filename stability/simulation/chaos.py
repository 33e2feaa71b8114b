r"""Lyapunov exponents: the mean growth rates of small deviations along one motion.

With the flow's derivative Phi_k over the k-th interval and an orthogonal start Q_0, the products are kept apart by QR,

    Phi_k Q_(k-1) = Q_k R_k,        lambda_i = 1/T sum_k log |R_k,ii|.

The derivative is that of the discrete flow, events included (saltation), so chaotic motion of impact oscillators is
covered. Error bars are those of batch means: the motion after the transient is cut into blocks, whose averages are
taken as independent. Checks: the sum is the mean divergence of the field; an autonomous motion that does not end in a
fixed point has one exponent 0; a stable periodic orbit has the real parts of its Floquet exponents.

Reference: G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn (1980), Meccanica 15, 9-30; J. L. Kaplan, J. A. Yorke
(1979), Lecture Notes in Mathematics 730, 204 (dimension).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError
from ..integration.engine import Engine, Precision
from ..results.solutions import frozen
from ..results.trajectory import Ending

__all__ = ["LyapunovSpectrum", "lyapunov"]

Array = np.ndarray
_STRETCH = 1.5  # norm of J times the interval: how far deviations grow between two orthogonalisations
_BLOCKS = 20
_MOST = 500_000  # intervals per block


@dataclass(frozen=True, eq=False, repr=False)
class LyapunovSpectrum:
    """Lyapunov exponents of one motion with their error bars; what `lyapunov` returns.

    Attributes
    ----------
    system : str
    exponents : (n,) descending, per unit time (base e);  error : (n,) standard errors from block averages
    duration, transient : float, time averaged over and time left out before
    final : (n,) state at the end
    divergence : float, mean divergence of the field along the motion, counted from the determinants
    params : dict of parameter values
    """

    system: str
    exponents: Array
    error: Array
    duration: float
    transient: float
    final: Array
    divergence: float
    params: dict[str, float]

    def __post_init__(self) -> None:
        for key in ("exponents", "error", "final"):
            object.__setattr__(self, key, frozen(getattr(self, key)))

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension: j + (sum of the j largest)/|next|, j the most with a sum >= 0."""
        sums = np.cumsum(self.exponents)
        j = int((sums >= 0).sum())
        if j == 0:
            return 0.0
        return float(len(sums)) if j == len(sums) else float(j + sums[j - 1] / abs(self.exponents[j]))

    @property
    def chaotic(self) -> bool:
        """Whether the largest exponent is positive by more than three standard errors."""
        return bool(self.exponents[0] > 3 * self.error[0])

    def __repr__(self) -> str:
        values = "  ".join(f"{v:.5g} +- {e:.1g}" for v, e in zip(self.exponents, self.error))
        return f"LyapunovSpectrum {self.system} | {values} | dimension {self.dimension:.4g}"


def lyapunov(
    system: Any, duration: float, *, x0: Any = None, transient: float | None = None, rtol: float = 1e-8,
    atol: Any = 1e-10, **params: float,
) -> LyapunovSpectrum:  # fmt: skip
    """All Lyapunov exponents of the motion that starts at x0.

    Parameters
    ----------
    system : System
    duration : float
        Time that is averaged over, after the transient.
    x0 : state, default rest
    transient : float, optional
        Time that is left out before; by default a tenth of `duration`.
    rtol, atol : tolerances of the integration
    **params : parameter values by name

    Returns
    -------
    LyapunovSpectrum

    Raises
    ------
    InputError, UnknownNameError
        Before any work.
    ConvergenceError
        The motion escapes; carries t and x.

    Notes
    -----
    *Accuracy*: standard errors of block averages; they shrink with the square root of `duration`. Lorenz's exponents
    come out as 0.9056, 0, -14.572 (tests/simulation/test_chaos.py).

    Examples
    --------
    >>> import numpy as np, stability as st
    >>> found = st.lyapunov(st.models.linear_oscillator(xi=0.1), 200.0)
    >>> np.round(found.exponents, 3)
    array([-0.1, -0.1])
    """
    transient = 0.1 * duration if transient is None else float(transient)
    if not 0 < duration < np.inf or not 0 <= transient < np.inf:
        raise InputError(f"duration = {duration:g} must be positive, transient = {transient:g} not negative; finite")
    precision, engine = Precision(rtol, atol), Engine.of(system)
    precision.scales(system.n)
    p, x, t = system.parameter_vector(**params), system.state_vector(x0), 0.0
    if transient > 0:
        start = engine.run(p, x, 0.0, transient, precision, dense=True)
        _check(engine, start, 0.0)
        x, t = start.x, transient
        size = _stretching(engine, p, start.nested[:, 0][-200:], start.edges[:-1][-200:])
    else:
        size = _stretching(engine, p, x[None], np.zeros(1))
    step = min(duration / _BLOCKS, _STRETCH / max(size, 1e-300))
    if engine.forced:
        step = min(step, engine.period(p))
    count = _BLOCKS * max(1, int(min(np.ceil(duration / step / _BLOCKS), _MOST)))
    if count >= _BLOCKS * _MOST:
        raise ConvergenceError(
            f"deviations of '{system.name}' may grow {np.exp(_STRETCH):.1f}-fold within {step:.3g}, "
            f"{duration / step:.2g} intervals are too many; is the motion escaping?",
            t=t, x=x,
        )  # fmt: skip
    step = duration / count
    period = engine.period(p) if engine.forced else np.inf
    Q, logs = np.eye(system.n), np.empty((count, system.n))
    for k in range(count):
        begin = t if not engine.forced else np.mod(t, period)
        motion = engine.run(p, x, begin, begin + step, precision, dense=False, variations=True)
        _check(engine, motion, t)
        assert motion.variations is not None
        Q, R = np.linalg.qr(motion.variations @ Q)
        logs[k] = np.log(np.maximum(np.abs(np.diag(R)), 1e-300))
        x, t = motion.x, t + step
    blocks = logs.reshape(_BLOCKS, -1, system.n).mean(axis=1) / step
    order = np.argsort(-blocks.mean(axis=0), kind="stable")
    values, error = blocks.mean(axis=0)[order], blocks.std(axis=0, ddof=1)[order] / np.sqrt(_BLOCKS)
    named = dict(zip(system.parameters, p.tolist()))
    return LyapunovSpectrum(system.name, values, error, duration, transient, x, float(values.sum()), named)


def _stretching(engine: Engine, p: Array, states: Array, times: Array) -> float:
    """Largest norm of the Jacobian along some states."""
    phase = np.ascontiguousarray(times / engine.period(p))
    _, J = engine.compiled.evaluations.FJ(phase, np.ascontiguousarray(states), p)
    return float(np.linalg.norm(J, axis=(1, 2)).max())


def _check(engine: Engine, motion: Any, t: float) -> None:
    if motion.ending is not Ending.COMPLETED:
        raise ConvergenceError(
            f"the motion of '{engine.system.name}' ended at t = {t + motion.t:.6g} ({motion.ending}): Lyapunov "
            "exponents need one that goes on; start inside its basin",
            t=t + motion.t, x=motion.x,
        )  # fmt: skip
