r"""The frequencies of a periodic or quasi-periodic motion: base frequencies and the lines they make.

    x(t) = mean + sum_j a_j cos(2 pi f_j t + phase_j),      f_j = k_1 b_1 + .. + k_d b_d,     k whole numbers, d = 1, 2.

The lines come from kernels/spectral_lines.py. A forced motion has b_1 = (forcing frequency)/m with the smallest m for
which the lines fit, known exactly; b_2 is then the distance of the strongest other line from the nearest multiple of
b_1, so that 0 < b_2 <= b_1/2: near a Neimark-Sacker point with multipliers exp(+-i theta) of an orbit of period P = 1 /
b_1 it tends to theta/(2 pi P). An autonomous motion has b_1 from its strongest line. The error is how much b_2 changes
between the first and the last two thirds of the record: a transient that is left, or chaos, shows there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..kernels import spectral_lines
from .solutions import frozen

__all__ = ["LineSpectrum", "line_spectrum"]

Array = NDArray[np.float64]
_LARGEST = 12  # whole numbers k are sought up to this modulus (of b_1: three times as far)
_MULTIPLES = 8
_PER_PERIOD, _FEWEST, _MOST = 32, 512, 2**16
_NOTICED = 1e-4  # of the strongest line: what may be a base frequency
_STRONGEST = 6  # so many lines decide about m


@dataclass(frozen=True, eq=False, repr=False)
class LineSpectrum:
    """Lines of one quantity of a motion; what `Trajectory.frequencies` returns.

    Attributes
    ----------
    name : str, the state or output
    base : (d,) base frequencies in cycles per unit time, d = 1 (periodic) or 2 (quasi-periodic); 0 without any line
    error : (d,) their estimated errors (0 where the forcing gives it)
    frequency, amplitude, phase : (K,) of the lines, strongest first;  mean : float
    orders : (K, d) whole numbers k with frequency = k . base
    misfit : (K,) frequency - k . base
    residual : float, rms of what the lines leave, over the rms of the motion

    Examples
    --------
    >>> import stability as st
    >>> run = st.simulate(st.models.duffing(xi=0.05, beta=0.05, Omega=1.2), (0, 600))
    >>> found = run.frequencies("u", periods=50)
    >>> found.orders[:2, 0].tolist()
    [1, 3]
    """

    name: str
    base: Array
    error: Array
    frequency: Array
    amplitude: Array
    phase: Array
    mean: float
    orders: NDArray[np.int64]
    misfit: Array
    residual: float

    def __post_init__(self) -> None:
        for key in ("base", "error", "frequency", "amplitude", "phase", "misfit"):
            object.__setattr__(self, key, frozen(getattr(self, key)))
        object.__setattr__(self, "orders", frozen(self.orders, np.int64))

    @property
    def quasiperiodic(self) -> bool:
        """Whether two base frequencies explain the lines, and do so within their errors (chaos has no such pair)."""
        return self.base.size == 2 and self.explained > 0.9

    @property
    def explained(self) -> float:
        """Part of the lines' power whose frequencies are sums of base frequencies to within a tenth of the smallest."""
        if not self.base.size:
            return 0.0
        power = self.amplitude**2
        fits = np.abs(self.misfit) <= np.maximum(10 * self.error.sum(), 1e-6 * self.base[0])
        return float(power[fits].sum() / power.sum())

    def table(self, most: int = 12) -> str:
        """The strongest lines as text."""
        words = "  ".join(f"b{k + 1} = {b:.10g} +- {e:.1g}" for k, (b, e) in enumerate(zip(self.base, self.error)))
        rows = [f"{self.name}: {words or 'no lines'}", f"{'frequency':>14} {'amplitude':>12} {'phase':>8}  orders"]
        for f, a, p, k in list(zip(self.frequency, self.amplitude, self.phase, self.orders.tolist()))[:most]:
            rows.append(f"{f:14.9g} {a:12.5g} {p:8.3f}  {' '.join(f'{n:+d}' for n in k)}")
        return "\n".join(rows)

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw the lines, the strongest with their whole numbers."""
        from ..plots.line_spectra import plot_lines

        return plot_lines(self, ax=ax, **options)

    def __repr__(self) -> str:
        words = ", ".join(f"{b:.9g} +- {e:.1g}" for b, e in zip(self.base, self.error)) or "none"
        lines = f"{self.frequency.size} lines | rest {self.residual:.1e}"
        return f"LineSpectrum {self.name} | base frequencies {words} | {lines}"


def line_spectrum(trajectory: Any, name: str, most: int = 20) -> LineSpectrum:
    """See `Trajectory.frequencies`."""
    if not isinstance(most, int) or not 1 <= most <= 60:
        raise InputError(f"most = {most!r}: a whole number of lines from 1 to 60 is needed")
    t0, t1 = trajectory.span
    forcing = trajectory.period
    periods = (t1 - t0) / forcing if forcing else None
    if periods is not None and periods < 8:
        raise InputError(f"frequencies of a motion over {periods:.3g} forcing periods: at least 8 are needed")
    wanted = _PER_PERIOD * periods if periods else 8 * len(trajectory.edges)
    count = int(min(max(wanted, _FEWEST), _MOST))
    dt = (t1 - t0) / count
    values = trajectory(t0 + dt * np.arange(count), name)
    if name in trajectory.angles:  # a winding angle: its steady turning is no line
        values = values - 2 * np.pi * np.round((values[-1] - values[0]) / (2 * np.pi)) * np.arange(count) / count
    found = spectral_lines.lines(values, dt, most)
    if not found.size:
        return _empty(name, float(values.mean()))
    mean, amplitudes, residual = spectral_lines.fitted(values, dt, found)
    strongest = np.argsort(-np.abs(amplitudes), kind="stable")
    found, amplitudes = found[strongest], amplitudes[strongest] * np.exp(-2j * np.pi * found[strongest] * t0)
    slack = 0.1 / (t1 - t0)
    notable = found[np.abs(amplitudes) > _NOTICED * np.abs(amplitudes[0])]
    base = _forced_base(notable, 1.0 / forcing, slack) if forcing else _own_base(notable, slack)
    orders, base = _assigned(found, base, np.abs(amplitudes), bool(forcing))
    error = _errors(values, dt, found, base, orders, bool(forcing))
    misfit = found - orders @ base
    size, phase = np.abs(amplitudes), np.angle(amplitudes)
    return LineSpectrum(name, base, error, found, size, phase, mean, orders, misfit, residual)


def _empty(name: str, mean: float) -> LineSpectrum:
    none = np.zeros(0)
    return LineSpectrum(name, none, none, none, none, none, mean, np.zeros((0, 0), np.int64), none, 0.0)


def _distance(lines: Array, step: float) -> Array:
    """Distance from the nearest multiple of a step."""
    return np.asarray(np.abs(lines - step * np.round(lines / step)))


def _forced_base(lines: Array, forcing: float, slack: float) -> Array:
    """(d,) forcing / m, and the second one if the lines need it, with the smallest m that explains them."""
    for m in range(1, _MULTIPLES + 1):
        if (_distance(lines, forcing / m) <= slack).all():
            return np.array([forcing / m])
    found = []
    for m in range(1, _MULTIPLES + 1):
        first = forcing / m
        free = lines[_distance(lines, first) > slack]
        if not free.size:
            break
        base = np.array([first, float(_distance(free[:1], first)[0])])
        found.append((_unfit(lines[:_STRONGEST], base, slack), m, base))
        if found[-1][0] == 0:
            break
    return min(found, key=lambda one: one[:2])[2]


def _own_base(lines: Array, slack: float) -> Array:
    """(d,) of an autonomous motion: the strongest line (or its fraction), then the strongest that is no multiple."""
    for m in range(1, _MULTIPLES + 1):
        if (_distance(lines, lines[0] / m) <= m * slack).all():
            return np.array([lines[0] / m])
    free = lines[_distance(lines, lines[0]) > slack]
    return np.array([lines[0], float(free[0])])


def _unfit(lines: Array, base: Array, slack: float) -> int:
    """Number of lines that no small whole numbers make."""
    return int((np.abs(lines - _orders(lines, base) @ base) > 3 * slack).sum())


def _orders(lines: Array, base: Array) -> NDArray[np.int64]:
    """(K, d) the whole numbers that come nearest, small ones preferred by a hair."""
    if base.size == 1:
        return np.round(lines / base[0]).astype(np.int64)[:, None]
    second = np.arange(-_LARGEST, _LARGEST + 1)
    first = np.round((lines[:, None] - second * base[1]) / base[0])
    gap = np.abs(lines[:, None] - first * base[0] - second * base[1])
    best = np.argmin(gap + 1e-7 * base[0] * (np.abs(second) + 0.1 * np.abs(first)), axis=1)
    return np.column_stack([first[np.arange(len(lines)), best], second[best]]).astype(np.int64)


def _assigned(lines: Array, base: Array, amplitudes: Array, forced: bool) -> tuple[NDArray[np.int64], Array]:
    """Orders of all lines, and the free base frequencies fitted to those that they explain, by their power."""
    orders = _orders(lines, base)
    fits = np.abs(lines - orders @ base) < 0.02 * base.min()
    known = np.array([base[0] if forced else 0.0, 0.0])[: base.size]
    free = np.arange(int(forced), base.size)
    if fits.any() and free.size:
        A = orders[fits][:, free] * amplitudes[fits][:, None]
        right = (lines[fits] - orders[fits] @ known) * amplitudes[fits]
        if np.linalg.matrix_rank(A) == free.size:
            base = base.copy()
            base[free] = np.linalg.lstsq(A, right, rcond=None)[0]
    return orders, base


def _errors(values: Array, dt: float, found: Array, base: Array, orders: NDArray[np.int64], forced: bool) -> Array:
    """Change of the base frequencies between the first and the last two thirds of the record."""
    part = 2 * len(values) // 3
    ends = []
    for piece in (values[:part], values[-part:]):
        again = spectral_lines.lines(piece, dt, len(found), start=found)
        kept, fitted_base = _assigned(again, base, np.abs(spectral_lines.fitted(piece, dt, again)[1]), forced)
        ends.append(fitted_base if kept.shape == orders.shape else base)
    rounding = 1e-15 * np.abs(base)
    return np.asarray(np.maximum(np.abs(ends[0] - ends[1]), rounding) * (np.arange(base.size) >= int(forced)))
