r"""Nonlinear normal modes by amplitude: `Backbone`.

The periodic motions of the free system (backbone_system) x'' = <f>(x, x') + g x' with harmonics 0 .. H; unknowns are
the coefficients c, the period T and the growth g, and two linear conditions fix phase and amplitude A of one coordinate
x:

    of="fundamental":   b_1 = 0,            a_1 = A           (first harmonic A cos omega t),
    of="max":           sum k b_k = 0,      sum a_k = A       (x(0) = A is a turning point, mean included).

The first follows a response at phase resonance, the second compares with exact solutions: for u'' + u + beta u^3 = 0
omega = pi sqrt(1 + z) / (2 K(m)), z = beta A^2, m = z / (2 (1 + z)) with A the largest displacement. g is the damping
that a forcing in phase with the velocity would have to balance (extended periodic motion concept); 0 without damping.

Reference: M. Krack (2015), Computers & Structures 154, 59-71; M. Krack, J. Gross (2019), chapter 2.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError, unknown_name
from ..kernels.fourier import resized
from ..protocols import Corrected, Critical, Seed, Spectrum, Tangent
from ..results.solutions import PeriodicOrbit
from .backbone_linearisation import BackboneLinearisation
from .backbone_system import GROWTH, driving_parameter, free_system
from .harmonic_balance import HarmonicBalance
from .harmonic_truncation import missing_harmonics
from .orbit_adaption import state_scales
from .orbits import whole_number

__all__ = ["Backbone"]

Array = np.ndarray
_CRITICAL = Critical(circle=True, pair=None, minus=None)
_MAX_ITERATIONS = {True: 30, False: 8}
_MEASURES = ("fundamental", "max")


@dataclass(frozen=True, eq=False, repr=False)
class Backbone:
    """The family of free periodic motions of an oscillator, by amplitude, as a continuation problem.

    Parameters
    ----------
    system : System
        With or without forcing and damping; second-order equations.
    coordinate : str, optional
        Whose amplitude is prescribed; the first by default.
    of : "fundamental" or "max"
        Which amplitude (see the head of this file).
    mode : int
        Which linear mode the family starts from, 1 the slowest.
    harmonics : int
    adaptive : bool
        Harmonics grow where the estimated error exceeds `accuracy`.
    accuracy : float
        Wanted error of the states over their scales.
    amplitude : float
        Default of the parameter "amplitude".
    inner : HarmonicBalance, optional
        The free system's discretisation; made here, and changed by `adapt`.

    Raises
    ------
    InputError, UnknownNameError, EquationError
        Before any computation.

    Notes
    -----
    Parameters are those of the system and "amplitude". Columns: "omega" = 2 pi / T (under the name of the forcing
    frequency too, so that a backbone can be laid over responses), "period", "balancing_growth", extrema and amplitudes.
    Motions of one degree of freedom are NEUTRAL; of more, NEUTRAL or UNSTABLE by the multipliers of the conservative
    motion (see backbone_spectrum; column "largest_multiplier"), UNDETERMINED where damping is balanced.

    Examples
    --------
    >>> import stability as st
    >>> curve = st.continuation(st.Backbone(st.models.duffing(beta=0.1)), "amplitude", (0.01, 1.0))
    >>> round(float(curve.columns["omega"][-1]), 5)
    1.03693
    """

    system: Any
    coordinate: str | None = None
    of: str = "fundamental"
    mode: int = 1
    harmonics: int = 15
    adaptive: bool = True
    accuracy: float = 1e-9
    amplitude: float = 1.0
    inner: Any = None

    def __post_init__(self) -> None:
        system = self.system
        coordinate = system.coordinates[0] if self.coordinate is None else self.coordinate
        if coordinate not in system.coordinates:
            raise unknown_name("coordinate", coordinate, system.coordinates, f"'{system.name}'")
        if self.of not in _MEASURES:
            raise InputError(f"of = {self.of!r}: 'fundamental' (first harmonic) or 'max' (largest displacement)")
        if "amplitude" in system.parameters:
            raise InputError("the system has a parameter 'amplitude' of its own, which Backbone needs for the motion's")
        if not (isinstance(self.accuracy, (int, float)) and 0 < self.accuracy < 1):
            raise InputError(f"accuracy = {self.accuracy!r}: a number between 0 and 1 is needed")
        object.__setattr__(self, "coordinate", coordinate)
        object.__setattr__(self, "mode", whole_number("mode", self.mode, 1, len(system.coordinates)))
        if self.inner is None:
            made = HarmonicBalance(free_system(system), self.harmonics, accuracy=0.5)
            object.__setattr__(self, "inner", made)
        names = [self.inner.system.states[k] for k in self.inner.layout.unknowns]
        object.__setattr__(self, "place", names.index(coordinate))

    place: int = field(init=False, repr=False)

    def __repr__(self) -> str:
        which = f"{self.of} amplitude of {self.coordinate}"
        return f"Backbone of '{self.system.name}', mode {self.mode}, {which}, {self.inner.harmonics} harmonics"

    # ------------------------------------------------------------------ what the problem is
    @cached_property
    def parameters(self) -> Mapping[str, float]:
        """Those of the system, and "amplitude"."""
        return {**self.system.parameters, "amplitude": self.amplitude}

    @property
    def critical(self) -> Critical:
        """No multipliers: folds and branch points only."""
        return _CRITICAL

    @property
    def size(self) -> int:
        """Length of u: the coefficients, the period, the growth."""
        return int(self.inner.size + 1)

    @cached_property
    def weights(self) -> Array:
        """(N,) of the inner product; the growth is determined by the rest."""
        return np.append(self.inner.weights, 0.0)

    @cached_property
    def column_sizes(self) -> Array:
        """(N,) sizes of the unknowns."""
        return np.append(self.inner.column_sizes, 1.0 / self.inner.period_scale)

    @cached_property
    def row_sizes(self) -> Array:
        """(N,) sizes of the equations."""
        size = self.inner.scales[self.inner.layout.unknowns[self.place]]
        return np.concatenate([self.inner.row_sizes[:-1], [size, size]])

    @cached_property
    def conditions(self) -> Array:
        """(2, N): phase and amplitude, linear in u."""
        layout = self.inner.layout
        rows = np.zeros((2, layout.count, layout.q))
        k = layout.basis.k
        if self.of == "fundamental":
            rows[0, 2, self.place], rows[1, 1, self.place] = 1.0, 1.0
        else:
            rows[0, 2::2, self.place], rows[1, 0, self.place], rows[1, 1::2, self.place] = k[2::2], 1.0, 1.0
        return np.hstack([rows.reshape(2, -1), np.zeros((2, 2))])

    def index(self, name: str) -> int:
        """Place of a parameter in p."""
        names = list(self.parameters)
        if name not in names:
            raise unknown_name("parameter", name, names, "this backbone")
        return names.index(name)

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data from which `from_spec` makes an equal problem."""
        own = {k: getattr(self, k) for k in ("coordinate", "of", "mode", "adaptive", "accuracy", "amplitude")}
        inner = dict(self.inner.spec)
        return {"problem": "Backbone", **own, "inner": inner, "system": self.system.to_dict()}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> Backbone:
        """The problem of a stored description."""
        from ..systems.system import System

        fields = {k: v for k, v in spec.items() if k not in ("problem", "system", "inner")}
        inner = HarmonicBalance.from_spec(spec["inner"])
        return cls(System.from_dict(spec["system"]), harmonics=inner.harmonics, inner=inner, **fields)

    # ------------------------------------------------------------------ start
    def seed(self) -> Seed | None:
        """None: not born at a special point."""
        return None

    def start(self, params: Array, guess: Any = None) -> Array:
        """From the linear mode about the equilibrium, or from an array u or a periodic orbit."""
        amplitude = float(params[-1])
        if not amplitude > 0:
            raise InputError(f"amplitude = {amplitude:g}: a backbone starts at a positive amplitude, such as 0.01")
        if isinstance(guess, np.ndarray) and guess.shape == (self.size,):
            u = np.array(guess, float)
        elif callable(guess) and hasattr(guess, "period"):
            at = self.inner.places * guess.period
            u = np.append(self.inner.packed(np.asarray(guess(at)).T, float(guess.period)), 0.0)
        elif guess is None:
            u = self._linear_mode(params, amplitude)
        else:
            raise InputError("a backbone starts from its linear mode (no start=), from an orbit, or from an array u")
        found = self.correct(u, params, "amplitude", None, 0.0, 1e-10)
        if not found.converged:
            raise ConvergenceError(
                f"no free motion of '{self.system.name}' at amplitude {amplitude:g} from the linear mode {self.mode} "
                f"({found.note}); begin at a smaller amplitude", u=u, params=params,
            )  # fmt: skip
        return found.u

    def _linear_mode(self, params: Array, amplitude: float) -> Array:
        inner, evaluations = self.inner, self.inner.evaluations
        p, x = np.append(params[:-1], 0.0), np.zeros((1, inner.layout.n))
        for _ in range(50):
            F, J = evaluations.FJ(None, x, p)
            step = np.linalg.lstsq(J[0], -F[0], rcond=None)[0]
            x = x + step
            if np.abs(step).max() <= 1e-13 * (1 + np.abs(x).max()):
                break
        values, vectors = np.linalg.eig(evaluations.FJ(None, x, p)[1][0])
        upper = np.flatnonzero(values.imag > 1e-9 * np.abs(values).max())
        upper = upper[np.argsort(values.imag[upper])]
        if len(upper) < self.mode:
            raise InputError(
                f"'{self.system.name}' has {len(upper)} oscillating modes about its equilibrium "
                f"{dict(zip(self.system.states, x[0].round(6).tolist()))}; mode = {self.mode} is not among them"
            )
        value, shape = values[upper[self.mode - 1]], vectors[:, upper[self.mode - 1]]
        own = shape[inner.layout.unknowns[self.place]]
        if abs(own) < 1e-6 * np.abs(shape).max():
            raise InputError(f"'{self.coordinate}' does not move in mode {self.mode}: give another coordinate=")
        angle = 2 * np.pi * inner.places
        wave = np.real(np.outer(np.exp(1j * angle), amplitude * shape / own))
        return np.append(inner.packed(x + wave, 2 * np.pi / value.imag), -2 * value.real)

    # ------------------------------------------------------------------ the Newton solve
    def linearise(self, u: Array, params: Array) -> BackboneLinearisation:
        """The linearisation at (u, params)."""
        return BackboneLinearisation(self, np.array(u, float), np.array(params, float))

    def correct(
        self, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
    ) -> Corrected:
        """The bordered Newton solve of `protocols.Problem`."""
        index, w, N = self.index(free), self.weights, self.size
        given, given_p = np.array(u, float), np.array(params, float)
        u, params = given.copy(), given_p.copy()
        rows, corner = np.zeros((0, N)), np.zeros((0, 0))
        if tangent is not None:
            u, params[index] = u + ds * tangent.u, params[index] + ds * tangent.parameter
            pull = tangent.weight**2 * tangent.parameter
            rows, corner = (w * tangent.u)[None], np.array([[pull]])
        residual, note, iteration, previous = np.inf, "no convergence", 0, np.inf
        for iteration in range(1, _MAX_ITERATIONS[tangent is None] + 1):
            if not u[-2] > 0:
                note = "the period became negative"
                break
            L = self.linearise(u, params)
            residual = L.size_of_residual
            if not residual < np.inf:
                note = "not finite"
                break
            column = L.column(free)
            right = np.zeros((N + len(rows), 2))
            right[:N, 0] = -L.residual
            if tangent is None:
                right[:, 1] = -column
            else:
                gap = ds - float(rows[0] @ (u - given)) - pull * (params[index] - given_p[index])
                right[N] = gap, 1.0
            x = L.solve(rows, column[:, None][:, : len(rows)], corner, right)
            if not np.isfinite(x).all():
                note = "singular"
                break
            step, change_l = x[:N, 0], float(x[-1, 0]) if tangent is not None else 0.0
            change = float(np.sqrt(w @ step**2 + (0.0 if tangent is None else (tangent.weight * change_l) ** 2)))
            length = float(np.sqrt(w @ u**2))
            u, params[index] = u + step, params[index] + change_l
            if change <= tolerance * (1 + length):
                return self._corrected(u, params, x, tangent, residual, iteration, L, column)
            if tangent is not None and iteration > 1 and change > 2 * previous:
                break
            previous = change
        return Corrected(u, params, None, residual, iteration, 0, None, False, note)

    def _corrected(
        self, u: Array, params: Array, x: Array, tangent: Tangent | None, residual: float, iterations: int,
        L: BackboneLinearisation, column: Array,
    ) -> Corrected:  # fmt: skip
        w = self.weights
        if tangent is None:
            new, border = Tangent(x[:, 1].copy(), 1.0, 1.0), None
        else:
            t, k = x[: self.size, 1], float(x[-1, 1])
            size = float(np.sqrt(w @ t**2 + (tangent.weight * k) ** 2))
            new = Tangent(t / size, k / size, tangent.weight)
            border = np.append(w * new.u, tangent.weight**2 * new.parameter)
        return Corrected(u, params, new, residual, iterations, L.determinant_sign(column, border), L, True)

    # ------------------------------------------------------------------ what the driver asks besides
    def spectrum(self, linearisation: BackboneLinearisation) -> Spectrum:
        """The verdict; no values, since the family's own folds are not among the events of its multipliers."""
        found = linearisation.stability
        return Spectrum(np.zeros(0, complex), found.error, 0, 0, 0, 0, found.verdict)

    def error(self, u: Array, params: Array) -> float:
        """Largest change of a state over its scale that the missing harmonics would make; inf: unknown."""
        return float(self.linearise(u, params).inner.correction.error)

    def adapt(self, u: Array, params: Array, tangent: Tangent | None) -> tuple[Backbone, Array, Tangent | None] | None:
        """More harmonics where the error asks for them, scales that follow the motion; or None."""
        L = self.linearise(u, params).inner
        found, inner = L.correction, self.inner
        scales, fields = state_scales(L.X), {}
        ratios = np.append(scales / inner.scales, L.period / inner.period_scale)
        if ((ratios > 2) | (ratios < 0.5)).any():
            fields = {"scales": scales, "period_scale": L.period}
        if self.adaptive and found.error > self.accuracy and inner.harmonics < 127:
            more = min(missing_harmonics(found, 0.3 * self.accuracy), inner.harmonics)
            fields["harmonics"] = min(127, inner.harmonics + max(more, 1))
        elif not inner.fixed_samples and found.aliasing > 0.1 * found.error and found.aliasing > 0.1 * self.accuracy:
            fields["samples"] = 2 * inner.samples
        if not fields:
            return None
        new = dataclasses.replace(self, inner=inner.changed(**fields))
        if set(fields) <= {"scales", "period_scale"}:
            return new, u, tangent
        if tangent is not None:
            tangent = Tangent(self._carried(new, tangent.u), tangent.parameter, tangent.weight)
        return new, self._carried(new, u), tangent

    def _carried(self, new: Backbone, u: Array) -> Array:
        return np.append(resized(self.inner.coefficients(u), new.inner.harmonics).ravel(), u[-2:])

    @cached_property
    def driving(self) -> str | None:
        """The forcing frequency's name, under which the frequency of the motion is told too."""
        return driving_parameter(self.system)

    def measures(self, u: Array, params: Array) -> dict[str, float]:
        """Columns: extrema and amplitudes as of any orbit, "omega", "period", "balancing_growth"; of several degrees of
        freedom "largest_multiplier", the largest modulus beside the double 1.
        """
        columns = self.inner.measures(u[:-1], np.append(params[:-1], u[-1]))
        columns["omega"] = 2 * np.pi / float(u[-2])
        if self.driving is not None:
            columns[self.driving] = columns["omega"]
        if self.inner.layout.n > 2:
            values = self.linearise(u, params).stability.values
            columns["largest_multiplier"] = float(np.abs(values).max())
        return {**columns, GROWTH: float(u[-1])}

    def view(self, u: Array, params: Array) -> PeriodicOrbit:
        """The motion as a periodic orbit of the free system, with its multipliers: a double 1 and the others."""
        from ..kernels.gauss import gauss_rule

        L = self.linearise(u, params)
        degree, edges, values, period = self.inner.pieces(u[:-1], np.append(params[:-1], u[-1]))
        named = dict(zip(self.parameters, params.tolist()))
        if self.driving is not None:
            named[self.driving] = 2 * np.pi / period
        return PeriodicOrbit.from_nodes(
            self.system.states, edges * period, gauss_rule(degree).abscissae, values, named,
            multipliers=np.array(sorted([1.0, 1.0, *L.stability.values], key=_rank), complex),
            verdict=L.stability.verdict, error=L.inner.correction.error, residual=L.size_of_residual,
        )  # fmt: skip


def _rank(value: complex) -> float:
    return -round(abs(value), 9)
