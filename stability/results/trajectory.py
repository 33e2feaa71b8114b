r"""One simulated motion: dense, named, and honest about where and why it ended.

The states are piecewise polynomials of degree 7 in time (kernels/piecewise.py), one piece a step of the integration; at
an impact they jump, and the later value counts. Outputs are functions of t and x and are expanded on the same pieces.
A motion that escapes keeps everything up to the last good point and has a `status` other than ``completed``; no NaN is
ever stored, and a time outside the motion is an error, not an extrapolation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..kernels import piecewise
from ..kernels.settling import SETTLED, transient_left
from .solutions import frozen
from .storage import register, write

if TYPE_CHECKING:
    from .line_spectrum import LineSpectrum

__all__ = ["Ending", "Happening", "Spectrum", "Trajectory"]

Array = NDArray[np.float64]


class Ending(StrEnum):
    """Why a simulation ended; what was computed until then is kept with any of them."""

    COMPLETED = "completed"
    STOPPED = "stopped by an event"
    DIVERGED = "diverged"
    STEP_TOO_SMALL = "step too small"
    MAX_STEPS = "max steps"
    TOO_MANY_EVENTS = "too many events"
    SLIDING = "sliding on a switch"
    FAILED = "failed right-hand side"
    INTERRUPTED = "interrupted"


class Happening(NamedTuple):
    """An event on a trajectory: kind is impact, stick, release, switch or event."""

    t: float
    kind: str
    name: str
    before: tuple[float, ...]
    after: tuple[float, ...]


class Spectrum(NamedTuple):
    """Amplitude spectrum: frequencies (M,) in cycles per unit time, amplitudes (M,) in the unit of the quantity."""

    frequency: Array
    amplitude: Array


class _Named(Mapping[str, float]):
    """One number per state and output, computed when asked for."""

    def __init__(self, names: tuple[str, ...], value: Callable[[str], float]) -> None:
        self._names, self._value = names, value

    def __getitem__(self, name: str) -> float:
        if name not in self._names:
            raise unknown_name("state or output", name, self._names, "this trajectory")
        return self._value(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return "{" + ", ".join(f"{name}: {self._value(name):.6g}" for name in self._names) + "}"


@register("trajectory")
@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A motion x(t) from t0 to where it ended; callable: ``trajectory(t)`` is (n,) for a number, (n, N) for an array.

    Attributes
    ----------
    system : str, name of the system
    states, output_names : tuples of str
    edges : (K + 1,) times, ends of the steps;  coefficients : (K, 8, n), see kernels/piecewise.py
    params : mapping of parameter values
    status : Ending
    period : forcing period, None for an autonomous system
    angles : tuple of str, states that are angles
    units : mapping of state or output -> unit
    events : tuple of Happening
    rtol, steps : float, int

    Examples
    --------
    >>> import numpy as np, stability as st
    >>> run = st.simulate(st.models.duffing(xi=0.02, beta=0.0, Omega=1.0), (0, 600), x0=dict(u=0.1))
    >>> run.status, round(run.last(5).max["u"], 3)
    (<Ending.COMPLETED: 'completed'>, 25.0)
    """

    system: str
    states: tuple[str, ...]
    edges: Array
    coefficients: Array
    params: Mapping[str, float]
    status: Ending = Ending.COMPLETED
    period: float | None = None
    angles: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    output_names: tuple[str, ...] = ()
    events: tuple[Happening, ...] = ()
    rtol: float = 0.0
    steps: int = 0
    _outputs: Callable[[Array, Array], Array] | Array | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "edges", frozen(self.edges))
        object.__setattr__(self, "coefficients", frozen(self.coefficients))
        object.__setattr__(self, "status", Ending(self.status))
        for key in ("params", "units"):
            object.__setattr__(self, key, MappingProxyType(dict(getattr(self, key))))
        for key in ("states", "angles", "output_names"):
            object.__setattr__(self, key, tuple(getattr(self, key)))
        object.__setattr__(self, "events", tuple(Happening(*e[:3], tuple(e[3]), tuple(e[4])) for e in self.events))

    # ------------------------------------------------------------------ values
    @property
    def names(self) -> tuple[str, ...]:
        """States, then outputs."""
        return self.states + self.output_names

    @property
    def span(self) -> tuple[float, float]:
        """First and last time."""
        return float(self.edges[0]), float(self.edges[-1])

    @cached_property
    def _expanded_outputs(self) -> Array:
        if not callable(self._outputs):
            return np.zeros((len(self.edges) - 1, 8, 0)) if self._outputs is None else self._outputs
        # a hair inside the pieces: an output may jump where the forcing does
        width = np.diff(self.edges)[:, None]
        times = self.edges[:-1, None] + width * (1e-12 + (1 - 2e-12) * piecewise.NODES)
        basis = np.polynomial.chebyshev.chebvander(2 * piecewise.NODES - 1, 7)
        states = np.einsum("ik,jkn->jin", basis, self.coefficients)
        values = self._outputs(times.ravel(), states.reshape(-1, len(self.states)))
        return piecewise.from_nodes(values.reshape(*times.shape, -1))

    def _column(self, name: str) -> Array:
        if name in self.states:
            return self.coefficients[:, :, self.states.index(name)]
        if name in self.output_names:
            return self._expanded_outputs[:, :, self.output_names.index(name)]
        raise unknown_name("state or output", name, self.names, "this trajectory")

    def _checked(self, t: Any) -> Array:
        times = np.asarray(t, float)
        t0, t1 = self.span
        slack = 1e-12 * max(abs(t0), abs(t1))
        if times.size and not (times.min() >= t0 - slack and times.max() <= t1 + slack):
            why = "" if self.status is Ending.COMPLETED else f" ({self.status})"
            asked = f"t from {times.min():g} to {times.max():g}"
            raise InputError(f"{asked} is outside this trajectory, [{t0:g}, {t1:g}]{why}")
        return times

    def __call__(self, t: Any, name: str | None = None) -> Array:
        """States at t: (n,) or (n, N); with `name` one state or output: () or (N,)."""
        times = self._checked(t)
        columns = self.coefficients if name is None else self._column(name)[..., None]
        values = piecewise.at(self.edges, columns, times.ravel()).T.reshape(-1, *times.shape)
        return values if name is None else values[0]

    def __getitem__(self, name: str) -> Array:
        """A state or output at the times `t`."""
        return self._sampled(self._column(name)[..., None])[0]

    @cached_property
    def t(self) -> Array:
        """(N,) times, dense enough to plot; the instant of an impact stands twice."""
        return frozen(self.edges[:-1, None] + np.diff(self.edges)[:, None] * np.linspace(0, 1, 8)).ravel()

    @cached_property
    def x(self) -> Array:
        """(n, N) states at `t`."""
        return frozen(self._sampled(self.coefficients))

    def _sampled(self, columns: Array) -> Array:
        basis = np.polynomial.chebyshev.chebvander(2 * np.linspace(0, 1, 8) - 1, columns.shape[1] - 1)
        return np.einsum("si,kin->ksn", basis, columns).reshape(-1, columns.shape[2]).T

    @property
    def final(self) -> Array:
        """(n,) state at the end: the start of the next simulation."""
        return self.coefficients[-1].sum(axis=0)

    # ------------------------------------------------------------------ parts and measures
    def window(self, t0: float, t1: float) -> Trajectory:
        """The part from t0 to t1."""
        self._checked([t0, t1])
        if not t1 > t0:
            raise InputError(f"window({t0:g}, {t1:g}): t1 must be greater than t0")
        t0, t1 = max(t0, self.span[0]), min(t1, self.span[1])
        edges, part = piecewise.restricted(self.edges, self.coefficients, t0, t1)
        outputs = self._outputs
        if outputs is not None and not callable(outputs):
            outputs = piecewise.restricted(self.edges, outputs, t0, t1)[1]
        inside = tuple(e for e in self.events if t0 <= e.t <= t1)
        return replace(self, edges=edges, coefficients=part, events=inside, _outputs=outputs)

    def last(self, periods: float) -> Trajectory:
        """The last `periods` forcing periods."""
        return self.window(max(self.span[1] - periods * self._period("last(periods)"), self.span[0]), self.span[1])

    def _period(self, what: str) -> float:
        if self.period is None:
            raise InputError(
                f"{what} needs a forcing period; '{self.system}' is autonomous: use window(t0, t1) or section="
            )
        return self.period

    @cached_property
    def _bounds(self) -> dict[str, tuple[float, float]]:
        return {name: piecewise.bounds(self.edges, self._column(name)) for name in self.names}

    @property
    def max(self) -> Mapping[str, float]:
        """State or output -> largest value, between the steps too."""
        return _Named(self.names, lambda name: self._bounds[name][1])

    @property
    def min(self) -> Mapping[str, float]:
        """State or output -> smallest value."""
        return _Named(self.names, lambda name: self._bounds[name][0])

    @property
    def peak_to_peak(self) -> Mapping[str, float]:
        """State or output -> max - min."""
        return _Named(self.names, lambda name: self._bounds[name][1] - self._bounds[name][0])

    @property
    def mean(self) -> Mapping[str, float]:
        """State or output -> mean over the time of the trajectory."""
        length = self.span[1] - self.span[0]
        return _Named(
            self.names, lambda name: float(piecewise.integrals(self.edges, self._column(name)[..., None])[0] / length)
        )

    def extrema(self, name: str) -> tuple[Array, Array, Array]:
        """(times, values, signs) of the local extrema of a state or output; sign +1 maximum, -1 minimum."""
        return piecewise.extrema(self.edges, self._column(name))

    def crossings(self, name: str, value: float = 0.0, direction: int = 0) -> Array:
        """Times in (t0, t1] at which a state or output passes `value` (direction +1 upwards, -1 downwards, 0 both).

        Each passage is there once, also on the end of a step; a touch and a jump over the value are none.
        """
        return piecewise.crossings(self.edges, self._column(name), direction, level=value)

    def harmonic(self, k: int, name: str, periods: int = 1) -> complex:
        """c_k = mean of x exp(-2 pi i k t / T) over the last whole forcing periods; amplitude 2 |c_k| for k >= 1.

        The phase of cos(2 pi t / T + phase) is the argument of c_1, whatever t0 is.
        """
        part = self.last(periods)
        omega = 2 * np.pi * k / self._period("harmonic")
        return complex(piecewise.projections(part.edges, part._column(name)[..., None], omega)[0, 0])

    # ------------------------------------------------------------------ long-time behaviour
    def poincare(self, section: str | None = None, value: float = 0.0, direction: int = 1) -> Array:
        """Poincare section: (n, N) states once a forcing period, or where a state or output passes a value.

        Parameters
        ----------
        section : name of a state or output; None takes t = t0 + k T
        value, direction : see `crossings`
        """
        if section is None:
            t0, t1 = self.span
            period = self._period("a stroboscopic section")
            return self(t0 + period * np.arange(int((t1 - t0) / period * (1 + 1e-12)) + 1))
        return self(self.crossings(section, value, direction))

    def spectrum(self, name: str, samples: int | None = None) -> Spectrum:
        """Amplitude spectrum of one state or output: Hann window, mean removed, evenly resampled.

        A line's height is its amplitude where it stands on the grid of frequencies, at most 15 % too low between.
        """
        t0, t1 = self.span
        count = samples or int(min(2 ** np.ceil(np.log2(8 * len(self.edges))), 2**20))
        if count < 16:
            raise InputError(f"samples = {count}: at least 16 are needed")
        values = self(np.linspace(t0, t1, count, endpoint=False), name)
        window = np.hanning(count + 1)[:-1]
        heights = np.abs(np.fft.rfft((values - values.mean()) * window)) * 2 / window.sum()
        return Spectrum(np.asarray(np.fft.rfftfreq(count, (t1 - t0) / count), float), np.asarray(heights, float))

    def frequencies(self, name: str | None = None, *, periods: float | None = None, most: int = 20) -> LineSpectrum:
        """Base frequencies and combination lines of a periodic or quasi-periodic motion, with an error estimate.

        Parameters
        ----------
        name : state or output, default the first state
        periods : only the last so many forcing periods (transients broaden the lines)
        most : number of lines
        """
        from .line_spectrum import line_spectrum

        return line_spectrum(self if periods is None else self.last(periods), name or self.states[0], most)

    @cached_property
    def transient(self) -> tuple[float, int]:
        """(left, m): estimated distance to the steady motion over half the peak-to-peak values, and its period m T."""
        states = self.poincare()
        if states.shape[1] < 3:
            return float("inf"), 1
        recent = self.last(min(5, states.shape[1] - 1))
        scale = np.array([0.5 * recent.peak_to_peak[s] for s in self.states])
        largest = max(scale.max(), 1e-300)
        scale = np.where(scale > 1e-9 * largest, scale, largest)
        return transient_left(states, scale, np.isin(self.states, self.angles))

    @property
    def settled(self) -> bool:
        """Whether the estimated transient left is at most 1 % (a motion of period up to 8 T)."""
        return self.transient[0] <= SETTLED

    def turns(self, name: str) -> float:
        """Net number of turns of an angle, from the first to the last time."""
        column = self._column(name)
        return float((column[-1].sum() - column[0] @ (-1.0) ** np.arange(8)) / (2 * np.pi))

    # ------------------------------------------------------------------ showing and keeping
    def plot(self, kind: str = "time", *, ax: Any = None, **options: Any) -> Any:
        """Draw it: kind "time" (`name=`), "phase" (`x=`, `y=`), "spectrum" (`name=`) or "poincare" (`x=`, `y=`)."""
        from ..plots.trajectories import plot_trajectory

        return plot_trajectory(self, kind, ax=ax, **options)

    def __repr__(self) -> str:
        t0, t1 = self.span
        largest = "  ".join(f"max {s}={self.max[s]:.6g}" for s in self.states[:2])
        events = f" | {len(self.events)} events" if self.events else ""
        return f"Trajectory {self.system} t {t0:g} -> {t1:.6g} | {self.steps} steps{events} | {largest} | {self.status}"

    def to_columns(self) -> dict[str, Array]:
        """Columns by name: t, states, outputs at the times `t`."""
        return {"t": self.t, **{name: self[name] for name in self.names}}

    def to_csv(self, path: Any) -> None:
        """t, states and outputs as comma-separated text with a line of names."""
        columns = self.to_columns()
        np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")

    def save(self, path: Any) -> None:
        """Write to ``.npz``; `load` reads it back (outputs are kept as polynomials)."""
        header, arrays = self.to_storage()
        write(path, "trajectory", header, arrays)

    def to_storage(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Header and arrays for `results.storage.write`."""
        keys = ("system", "states", "params", "period", "angles", "units", "output_names", "events", "rtol", "steps")
        header = {k: getattr(self, k) for k in keys} | {"status": str(self.status)}
        header["events"] = [list(e) for e in self.events]
        arrays = {"edges": self.edges, "coefficients": self.coefficients, "outputs": self._expanded_outputs}
        return header, arrays

    @classmethod
    def from_storage(cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Trajectory:
        """The inverse of `to_storage`."""
        return cls(
            edges=arrays["edges"], coefficients=arrays["coefficients"], _outputs=frozen(arrays["outputs"]), **header
        )
