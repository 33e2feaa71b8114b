r"""Periodic orbits by harmonic balance: `HarmonicBalance`.

    x(t) = w t/T + a_0 + sum_(k=1..H) ( a_k cos k omega t + b_k sin k omega t ),      omega = 2 pi / T,

put into x' = f(t, x, p) and projected on the same 2H + 1 functions (Galerkin). Forced systems: T = k T_f(p), k the
`subharmonic`, so that harmonic k of the orbit is the forcing; autonomous ones: T is an unknown, with the integral phase
condition. Velocities that are exactly x' = v are eliminated (harmonic_layout). The projection is computed from N
samples in time (alternating frequency-time): for polynomials of degree d in the states N > (d + 1) H makes it exact,
for other terms the aliasing is measured and N grows (harmonic_truncation). The Jacobian is exact.

Stability: Hill's eigenproblem of the same truncated system, checked against the monodromy matrix along the corrected
orbit (harmonic_spectrum): folds of the truncated system are changes of its Hill exponents at every H, and a verdict
that the check does not support is UNDETERMINED.

Inner product: time average of the unknown states over their squared scales. Reference: M. Krack, J. Gross (2019),
*Harmonic Balance for Nonlinear Vibration Problems*; T. Detroux et al. (2015), CMAME 296, 18-38.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InputError
from ..kernels.addresses import solver_address
from ..kernels.gauss import gauss_rule
from ..kernels.harmonic_newton import CONVERGED, NEGATIVE_PERIOD, NO_CONVERGENCE, NOT_FINITE, SINGULAR, newton
from ..protocols import Corrected, Spectrum, Tangent
from ..systems.stops import refuse_stops
from .harmonic_layout import HarmonicLayout
from .harmonic_linearisation import HarmonicLinearisation, HarmonicWork
from .harmonic_samples import first_samples, polynomial_degree
from .orbits import OrbitDiscretisation, one_period, whole_number, winding_vector

__all__ = ["HarmonicBalance"]

Array = np.ndarray
_MAX_ITERATIONS = {True: 30, False: 8}
_DENSE_DEGREE = 9
_SETTLED = 1e-14  # multipliers belong to the point itself, not to the last iterate
_NOTES = {NO_CONVERGENCE: "no convergence", SINGULAR: "singular", NEGATIVE_PERIOD: "the period became negative"}
_MAX_HARMONICS, _MAX_SAMPLES = 1000, 65536
_FIRST, _MOST = 7, 127  # harmonics to begin with where none are given; those that adaption goes to


@dataclass(frozen=True, eq=False, repr=False)
class HarmonicBalance(OrbitDiscretisation):
    """Periodic orbits of a system, forced or autonomous, as a continuation problem with Fourier unknowns.

    Parameters
    ----------
    system : System
    harmonics : int, optional
        Harmonics H >= 1 of the orbit's own period (with subharmonic k: harmonic k is the forcing). None: as many as
        the motion needs, beginning with 7 k.
    subharmonic : int
        Orbits of k forcing periods. Autonomous systems have no forcing: leave it at 1.
    samples : int, optional
        Samples per period N >= 4 H + 4. None: exact for polynomials, and grown by measured aliasing for other terms.
    adaptive : bool, optional
        True: harmonics grow and drop so that the estimated error stays below `accuracy`, never below `harmonics`.
        False: H stays; where the estimated error exceeds `accuracy` a TruncationWarning says how many are missing. By
        default True where no number of harmonics is given, else False.
    accuracy : float
        Wanted error of the states over their scales; None: 1e-8 where adaptive, else 1e-3.
    winding : mapping of angle -> whole number of turns per orbit, or array (n,) in radians
    scales, period_scale : sizes of the states (n,) and of the period; by default 1, then set by `adapt`.
    fewest, most : int, optional
        Harmonics between which adaption stays; by default `harmonics`, and 127 (or `harmonics`). At `most` a
        TruncationWarning says what is missing: terms with a kink (abs, max) may ask for more than is sensible.

    Raises
    ------
    InputError, UnknownNameError
        Before any computation.

    Notes
    -----
    *Accuracy*: `error` solves for the harmonics H + 1 .. 2H + 1 that the residual in time asks for, and for what they
    change below; it is the largest such change of a state over its scale.

    Examples
    --------
    >>> import stability as st
    >>> problem = st.HarmonicBalance(st.models.duffing(xi=0.02, beta=0.001, Omega=0.5), harmonics=7)
    >>> p = problem.system.parameter_vector()
    >>> round(problem.view(problem.start(p), p).max["u"], 4)
    0.3332
    """

    system: Any
    harmonics: Any = None
    subharmonic: int = 1
    samples: Any = None
    adaptive: Any = None
    accuracy: Any = None
    winding: Any = None
    scales: Any = None
    period_scale: float = 1.0
    fewest: Any = None
    most: Any = None
    _memo: dict[str, Any] = field(default_factory=dict, repr=False)
    _warned: set[str] = field(default_factory=set, repr=False)

    def __post_init__(self) -> None:
        refuse_stops(self.system, "HarmonicBalance")
        n = self.system.n
        object.__setattr__(self, "subharmonic", whole_number("subharmonic", self.subharmonic, 1, 64))
        object.__setattr__(self, "adaptive", self.harmonics is None if self.adaptive is None else bool(self.adaptive))
        harmonics = _FIRST * self.subharmonic if self.harmonics is None else self.harmonics
        object.__setattr__(self, "harmonics", whole_number("harmonics", harmonics, 1, _MAX_HARMONICS))
        one_period("subharmonic", self.subharmonic, self.system, not self.own)
        fewest = self.harmonics if self.fewest is None else whole_number("fewest", self.fewest, 1, self.harmonics)
        object.__setattr__(self, "fewest", fewest)
        most = max(_MOST, self.harmonics) if self.most is None else self.most
        object.__setattr__(self, "most", whole_number("most", most, self.harmonics, _MAX_HARMONICS))
        accuracy = (1e-8 if self.adaptive else 1e-3) if self.accuracy is None else self.accuracy
        if not (isinstance(accuracy, (int, float)) and 0 < accuracy < 1):
            raise InputError(f"accuracy = {self.accuracy!r}: a number between 0 and 1 is needed (1e-8, for example)")
        object.__setattr__(self, "accuracy", float(accuracy))
        scales = np.ones(n) if self.scales is None else np.array(self.scales, float)
        if scales.shape != (n,) or not (scales > 0).all():
            raise InputError(f"scales must be {n} positive numbers, got {self.scales!r}")
        scales.setflags(write=False)
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "winding", winding_vector(self.system, self.winding))
        least = 4 * self.harmonics + 4
        object.__setattr__(self, "fixed_samples", self.samples is not None)
        if self.samples is None:
            object.__setattr__(self, "samples", first_samples(self.system, self.harmonics, self.subharmonic))
        else:
            object.__setattr__(self, "samples", whole_number("samples", self.samples, 1, _MAX_SAMPLES))
            if self.samples < least:
                raise InputError(
                    f"samples = {self.samples}: {self.harmonics} harmonics need at least 4 H + 4 = {least} samples; "
                    "give more samples or fewer harmonics, or leave samples away"
                )
        layout = HarmonicLayout.of(self.flow, n, self.harmonics, self.samples, self.winding)
        object.__setattr__(self, "layout", layout)

    layout: HarmonicLayout = field(init=False, repr=False)
    fixed_samples: bool = field(init=False, repr=False)

    def __repr__(self) -> str:
        periods = f", {self.subharmonic} forcing periods" if self.subharmonic > 1 else ""
        plural = "s" if self.harmonics > 1 else ""
        return f"HarmonicBalance of '{self.system.name}', {self.harmonics} harmonic{plural}{periods}"

    # ------------------------------------------------------------------ what the problem is
    @property
    def multiple(self) -> int:  # type: ignore[override]
        """Forcing periods per orbit, the same number as `subharmonic`."""
        return self.subharmonic

    @property
    def advice(self) -> str:
        """More harmonics, where their number was given."""
        if self.adaptive:
            return ""
        of = f"; of an orbit of {self.subharmonic} periods the forcing is harmonic {self.subharmonic}, and" * (
            self.subharmonic > 1
        )
        return f"{of or ';'} harmonics={self.harmonics} may be too few: give more, or leave them away and they grow"

    @cached_property
    def own(self) -> int:  # type: ignore[override]
        """1 where the period is an unknown."""
        return 0 if self.flow.forced else 1

    @cached_property
    def size(self) -> int:  # type: ignore[override]
        """Length of u: coefficients (2H + 1, q), and the period of an autonomous orbit."""
        return self.layout.count * self.layout.q + self.own

    @property
    def places(self) -> Array:
        """The samples s."""
        return self.layout.basis.points

    @cached_property
    def exact_samples(self) -> bool:
        """Whether the samples are exact for the equations' degree, so that there is no aliasing to measure."""
        degree = polynomial_degree(self.system)
        if degree is None:
            return False
        return self.samples >= first_samples(self.system, self.harmonics, self.subharmonic, degree)

    @cached_property
    def phase(self) -> Array:
        """(N,) phases of the forcing at the samples."""
        return np.mod(self.subharmonic * self.layout.basis.points, 1.0)

    def packed(self, values: Array, period: float) -> Array:
        """u from states (N, n) at the samples."""
        return np.append(self.layout.coefficients(values).ravel(), [period] * self.own)

    def coefficients(self, u: Array) -> Array:
        """(2H + 1, q) of u."""
        return u[: self.layout.count * self.layout.q].reshape(self.layout.count, self.layout.q)

    @cached_property
    def weights(self) -> Array:
        """(N,) time average over squared scales: a_0^2 + sum (a_k^2 + b_k^2) / 2."""
        mean = np.where(self.layout.basis.k == 0, 1.0, 0.5)[:, None] * self.scales[self.layout.unknowns] ** -2.0
        return np.append(mean.ravel(), [self.period_scale**-2] * self.own)

    @cached_property
    def column_sizes(self) -> Array:
        """(N,) sizes of the unknowns."""
        sizes = np.tile(self.scales[self.layout.unknowns], self.layout.count)
        return np.append(sizes, [self.period_scale] * self.own)

    @cached_property
    def row_sizes(self) -> Array:
        """(N,) sizes of the equations: scale times (rate k)^r, with the rate of the problem's own parameters."""
        rate = self._memo.get("rate")
        if rate is None or self.own:
            period = self.period_scale if self.own else self.orbit_period(self.system.parameter_vector())
            rate = self._memo["rate"] = 2 * np.pi / period
        sizes = self.layout.growth * (self.scales[self.layout.unknowns] * rate**self.layout.order)
        return np.append(sizes.ravel(), [1.0] * self.own)

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data from which `from_spec` makes an equal problem."""
        own = {
            "problem": "HarmonicBalance",
            "harmonics": self.harmonics,
            "subharmonic": self.subharmonic,
            "samples": self.samples,
            "fixed": self.fixed_samples,
            "adaptive": self.adaptive,
            "accuracy": self.accuracy,
            "winding": self.winding.tolist(),
            "scales": self.scales.tolist(),
            "period_scale": self.period_scale,
            "fewest": self.fewest,
            "most": self.most,
        }
        if self.system.function is not None:
            return {**own, "view_only": True}
        return {**own, "system": self.system.to_dict()}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> HarmonicBalance:
        """The problem of a stored description."""
        from ..systems.system import System

        fields = {k: v for k, v in spec.items() if k not in ("problem", "system", "fixed")}
        made = cls(System.from_dict(spec["system"]), **fields)
        object.__setattr__(made, "fixed_samples", bool(spec["fixed"]))
        return made

    def changed(self, **fields: Any) -> HarmonicBalance:
        """A copy with other fields; samples follow the harmonics unless they are given or were given by the user."""
        keep = {"samples": self.samples} if self.fixed_samples or "harmonics" not in fields else {"samples": None}
        keep["samples"] = max(keep["samples"] or 0, 4 * fields.get("harmonics", self.harmonics) + 4) or None
        if "harmonics" in fields and not self.fixed_samples:
            keep["samples"] = None
        kept = {"rate": self._memo["rate"]} if "rate" in self._memo and "subharmonic" not in fields else {}
        made = dataclasses.replace(self, **{**keep, **fields, "_memo": kept})
        object.__setattr__(made, "fixed_samples", self.fixed_samples)
        return made

    # ------------------------------------------------------------------ the Newton solve
    def linearise(self, u: Array, params: Array) -> HarmonicLinearisation:
        """The linearisation at (u, params)."""
        known = self._memo.get("last")
        if known is not None and np.array_equal(known[0], u) and np.array_equal(known[1].params, params):
            return known[1]  # type: ignore[no-any-return]
        return HarmonicLinearisation.at(self, u, params)

    @cached_property
    def _fixed(self) -> tuple[Any, ...]:
        """Arguments of the kernel that never change: solver, field, period, multiple, phase, tables, layout; sizes."""
        flow, layout, b = self.flow, self.layout, self.layout.basis
        tables = b.points, b.synthesis, b.slope, b.analysis, b.spectrum, b.first, b.second, b.swap, b.turn, b.k
        kept = layout.rows, layout.unknowns, layout.velocities, layout.turns
        head = solver_address(), flow.address, flow.period_address, float(self.multiple), self.phase, tables, kept
        return head, self.weights, self.row_sizes, np.zeros(self.size)

    def newton(
        self, u: Array, params: Array, index: int, tangent: Tangent | None, ds: float, tolerance: float, most: int
    ) -> tuple[HarmonicWork, int, int, tuple[float, int], float]:
        """The compiled solve, u and params corrected in place: (work, status, iterations, (residual, sign), period)."""
        head, weights, row_sizes, nothing = self._fixed
        arc = 0 if tangent is None else 1
        work = HarmonicWork(self.layout, len(params), self.own, arc)
        t = nothing if tangent is None else np.ascontiguousarray(tangent.u, float)
        rate, weight = (0.0, 1.0) if tangent is None else (float(tangent.parameter), float(tangent.weight))
        status, iterations, residual, sign, period = newton(
            *head, work.filled, params, index, u, weights, row_sizes, t, rate, weight, arc, float(ds),
            float(tolerance), _SETTLED, most, work.full, work.pivots, work.x,
        )
        return work, status, iterations, (residual, sign), period

    def correct(
        self, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
    ) -> Corrected:
        """The bordered Newton solve of `protocols.Problem`.

        The row of the given tangent stays in the determinant: with the new one it has the same sign, since both have a
        positive product with the null vector x of [F_u, F_lambda].
        """
        index = self.index(free)
        given, u, params = u, np.array(u, float), np.array(params, float)
        work, status, iterations, (residual, sign), period = self.newton(
            u, params, index, tangent, ds, tolerance, _MAX_ITERATIONS[tangent is None]
        )
        reference = np.array(given, float) if self.own else None
        factors = None if tangent is None else (work.full.T, work.pivots - 1)
        L = HarmonicLinearisation(self, u, params, work, period, index, reference, factors)
        if status != CONVERGED:
            note = L.complaint if status == NOT_FINITE else _NOTES[status]
            return Corrected(u, params, None, residual, iterations, 0, None, False, note)
        x = work.x[1]
        if tangent is None:
            new = Tangent(x, 1.0, 1.0)
        else:
            new = Tangent(x[:-1], float(x[-1]), tangent.weight)
        self._memo["last"] = (u, L) if reference is None else None
        return Corrected(u, params, new, residual, iterations, sign, L, True)

    # ------------------------------------------------------------------ spectrum, error, adaption
    def spectrum(self, linearisation: HarmonicLinearisation) -> Spectrum:
        """Hill multipliers, their error by the monodromy along the corrected orbit, counts, verdict."""
        from .harmonic_spectrum import checked_spectrum

        return checked_spectrum(linearisation)

    def error(self, u: Array, params: Array) -> float:
        """Largest change of a state over its scale that the harmonics H + 1 .. 2H + 1 would make; inf: unknown."""
        return float(self.linearise(u, params).correction.error)

    def adapt(
        self, u: Array, params: Array, tangent: Tangent | None
    ) -> tuple[HarmonicBalance, Array, Tangent | None] | None:
        """More or fewer harmonics, more samples, better scales (see harmonic_truncation), or None."""
        from .harmonic_truncation import adapted

        return adapted(self, u, params, tangent)

    def doubled(self, u: Array, params: Array, vector: Array) -> tuple[HarmonicBalance, Array, Array]:
        """The problem of twice the period, the orbit run through twice, and the antiperiodic direction."""
        from .harmonic_switching import doubled_problem

        return doubled_problem(self, u, params)

    def pieces(self, u: Array, params: Array) -> tuple[int, Array, Array, float]:
        """The series on 2H pieces, or more, as polynomials of degree 9."""
        period = float(u[-1]) if self.own else self.orbit_period(params)
        count = max(2 * self.harmonics, 8)
        edges = np.arange(count + 1) / count
        local = gauss_rule(_DENSE_DEGREE).abscissae
        at = (edges[:-1, None] + local / count).ravel()
        values = self.layout.states(self.coefficients(u), 2 * np.pi / period, at)
        return _DENSE_DEGREE, edges, values.reshape(count, len(local), self.layout.n), period

    def harmonic(self, u: Array, state: str) -> Array:
        """(H + 1,) complex Fourier coefficients c_k of an unknown state, x = sum c_k exp(2 pi i k s) + conjugate."""
        names = [self.system.states[k] for k in self.layout.unknowns]
        if state not in names:
            from ..errors import unknown_name

            raise unknown_name("unknown series", state, names, "this problem")
        c = self.coefficients(u)[:, names.index(state)]
        return np.concatenate([c[:1].astype(complex), 0.5 * (c[1::2] - 1j * c[2::2])])
