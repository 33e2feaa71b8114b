r"""`Locus`: the curve of special points in two parameters, as a problem for the same `continuation`.

A fold, Hopf, period-doubling, Neimark-Sacker or (where it persists) branch point is an isolated zero of its defining
system (`defining`) at one parameter; with a second one free these zeros are curves. Unknowns (u, lambda_2, e) over the
continued lambda_1; the inner product is that of the inner problem plus (lambda_2 / scale_2)^2, e does not count.

Of the spectrum the critical values are taken out: the verdict says whether the others are inside. STABLE: the curve
bounds a stable region. Beyond a resonance 1:1 or 1:2 (a Bogdanov-Takens point) the defining system of a pair goes on
with real values r, 1/r (r, -r), a neutral saddle: nothing bifurcates there, and the verdict is UNSTABLE, for one of
them is outside. A branch point persists where a symmetry or a trivial solution makes it: its unfolding parameter
mu stays zero; anywhere else a second parameter breaks it into folds, and the curve does not start.
References: Kuznetsov (2004), 10.3; Govaerts (2000), chapter 4.
"""

from __future__ import annotations

import cmath
import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..protocols import Corrected, Critical, Seed, Spectrum, Tangent
from ..results.revival import revive
from ..words import Kind, Verdict
from .defining import first_extra, singular_matrix
from .locus_newton import corrected, response
from .locus_system import Place
from .locus_tests import confirmed, monitors

__all__ = ["CURVES", "Locus"]

Array = NDArray[np.float64]
CURVES = (Kind.FOLD, Kind.BRANCH_POINT, Kind.HOPF, Kind.PERIOD_DOUBLING, Kind.NEIMARK_SACKER)
_PAIRS = (Kind.HOPF, Kind.NEIMARK_SACKER)


@dataclass(frozen=True, eq=False)
class Locus:
    """A curve of special points of one kind; made by `locus`.

    Attributes
    ----------
    inner : Problem whose special points these are
    kind : Kind
    free : str, the second parameter lambda_2;  along : str, the one along which the point was found
    scale : float, size of lambda_2 in the inner product
    window : (low, high) of lambda_2: the curve ends there
    """

    inner: Any
    kind: Kind
    free: str
    along: str
    scale: float
    window: tuple[float, float] = (-math.inf, math.inf)
    born: tuple[Array, Array, Array, float] | None = field(default=None, repr=False)  # U, params, direction, rate
    _memo: dict[str, Any] = field(default_factory=dict, repr=False)

    # ------------------------------------------------------------------ layout
    @property
    def parameters(self) -> Mapping[str, float]:
        """Those of the inner problem (the value of lambda_2 there is that of the solution, not an input)."""
        return self.inner.parameters  # type: ignore[no-any-return]

    @property
    def extras(self) -> int:
        """Number of extra unknowns."""
        return 1 if self.kind in _PAIRS or self.kind is Kind.BRANCH_POINT else 0

    @cached_property
    def condensed(self) -> bool:
        """Whether a Newton solve is one compiled call (`locus_collocation`)."""
        from .locus_collocation import serves

        return serves(self)

    @cached_property
    def _place(self) -> int:
        return list(self.inner.parameters).index(self.free)

    def parts(self, U: Array) -> tuple[Array, float, Array]:
        """(u, lambda_2, e)."""
        n = U.size - 1 - self.extras
        return U[:n], float(U[n]), U[n + 1 :]

    def completed(self, U: Array, params: Array) -> Array:
        """A copy of `params` with lambda_2 of U."""
        params = np.array(params, dtype=float)
        params[self._place] = self.parts(U)[1]
        return params

    @cached_property
    def weights(self) -> Array:
        """(N + 1 + e,) those of the inner problem, 1 / scale^2, zeros."""
        return np.concatenate([self.inner.weights, [self.scale**-2], np.zeros(self.extras)])

    @property
    def walls(self) -> tuple[tuple[int, float, float], ...]:
        """(place of lambda_2 counted from the end of U, low, high)."""
        return ((-1 - self.extras, *self.window),)

    @property
    def critical(self) -> Critical:
        """No special points of its own by spectrum."""
        return Critical(self.inner.critical.circle, None, None)

    @property
    def system(self) -> Any:
        """That of the inner problem."""
        return self.inner.system

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data; `from_spec` is the inverse."""
        own = {"problem": "Locus", "kind": str(self.kind), "free": self.free, "along": self.along}
        born = None if self.born is None else [np.asarray(part).tolist() for part in self.born]
        inner = dict(self.inner.spec)
        flag = {"view_only": True} if inner.get("view_only") else {}
        window = [v if math.isfinite(v) else None for v in self.window]
        return {**own, "scale": self.scale, "window": window, "born": born, "inner": inner, **flag}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> Locus:
        """The problem that `spec` describes."""
        born = spec["born"]
        if born is not None:
            born = (*(np.array(part, dtype=float) for part in born[:3]), float(born[3]))
        fields = {key: spec[key] for key in ("free", "along", "scale")}
        low, high = spec.get("window", (None, None))
        fields["window"] = (-math.inf if low is None else low, math.inf if high is None else high)
        return cls(revive(spec["inner"]), Kind(spec["kind"]), born=born, **fields)

    # ------------------------------------------------------------------ start
    def seed(self) -> Seed | None:
        """The point it was made from; followed to both sides."""
        if self.born is None:
            return None
        U, params, direction, rate = self.born
        return Seed(self, U, params, direction, rate, 2, Kind.USER, self.along)

    def start(self, params: Array, guess: Any = None) -> Array:
        """U of a solution on another mesh of this curve (with its own value of lambda_2).

        Raises
        ------
        InputError
            Anything else: a curve of special points starts from a special point.
        """
        values = getattr(guess, "params", None)
        if values is None:
            raise InputError("a curve of special points starts from a special point: locus(branch['PD1'], free=...)")
        params = np.array(params, dtype=float)
        params[self._place] = values[self.free]
        u = self.inner.start(params, guess)
        spectrum = self.inner.spectrum(self.inner.linearise(u, params))
        return np.concatenate([u, [values[self.free]], first_extra(self.kind, self.inner.critical, spectrum.values)])

    # ------------------------------------------------------------------ Newton
    def linearise(self, u: Array, params: Array) -> Any:
        """Where a spectrum is wanted; the extended linearisation is made when something else is asked of it."""
        return Place(self, u, params)

    def correct(
        self, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
    ) -> Corrected:
        """The bordered Newton solve of `locus_newton`."""
        return corrected(self, u, params, free, tangent, ds, tolerance)

    def residual_at(self, u: Array, params: Array) -> float:
        """Largest residual of the inner equations, and the singular values that ought to be zero.

        Raises
        ------
        LinAlgError
            The linearisation is not finite.
        """
        extra, L = self.parts(u)[2], self._linearised(u, params)
        A = singular_matrix(self.kind, L, self.inner.critical, self.along, extra)
        values = np.linalg.svd(A, compute_uv=False)
        self.remember("inner", u, L)
        return float(max(np.max(np.abs(L.residual)), values[-2 if self.kind in _PAIRS and values.size > 1 else -1]))

    def remember(self, what: str, u: Array, value: Any) -> None:
        """Keep something that belongs to this very array u, until the next one."""
        self._memo[what] = (u, value)

    def recalled(self, what: str, u: Array) -> Any:
        """What is remembered for u, else None."""
        known = self._memo.get(what)
        return known[1] if known is not None and known[0] is u else None

    def inner_linearisation(self, u: Array, params: Array) -> Any:
        """The inner problem's linearisation, remembered for the last point."""
        L = self.recalled("inner", u)
        if L is None:
            L = self._linearised(u, params)
            self.remember("inner", u, L)
        return L

    def _linearised(self, u: Array, params: Array) -> Any:
        """The inner problem's linearisation; one that can is told which values are critical."""
        L = self.inner.linearise(self.parts(u)[0], self.completed(u, params))
        if not hasattr(L, "critical"):
            return L
        return dataclasses.replace(L, critical=tuple(self.targets(self.parts(u)[2])))

    def inner_values(self, u: Array, params: Array) -> NDArray[np.complex128]:
        """The inner problem's multipliers or eigenvalues, remembered for the last point."""
        return np.asarray(self._inner_spectrum(u, params).values)

    def _inner_spectrum(self, u: Array, params: Array) -> Spectrum:
        spectrum = self.recalled("spectrum", u)
        if spectrum is None:
            L = self.inner_linearisation(u, params)
            if self.kind is Kind.FOLD and not self.condensed:  # a collocated orbit holds itself (`collocation_error`)
                self._settled(u, params)
            spectrum = self.inner.spectrum(L)
            self.remember("spectrum", u, spectrum)
        return spectrum  # type: ignore[no-any-return]

    def row_of(self, tangent: Tangent | None, n: int) -> Array:
        """The last row in the order (u, lambda_1, lambda_2, e)."""
        if tangent is None:
            return self.ordered(np.zeros(n), 1.0)
        return self.ordered(self.weights * tangent.u, tangent.parameter * tangent.weight**2)

    def ordered(self, U: Array, first: float) -> Array:
        """(u, lambda_1, lambda_2, e) from U = (u, lambda_2, e) and lambda_1."""
        n, out = U.size - 1 - self.extras, np.empty(U.size + 1)
        out[:n], out[n], out[n + 1 :] = U[:n], first, U[n:]
        return out

    def split(self, x: Array) -> tuple[Array, float]:
        """The inverse of `ordered`."""
        n, out = x.size - 2 - self.extras, np.empty(x.size - 1)
        out[:n], out[n:] = x[:n], x[n + 1 :]
        return out, float(x[n])

    # ------------------------------------------------------------------ spectrum, adaption, what a user sees
    def spectrum(self, linearisation: Place) -> Spectrum:
        """No values and no counts (their changes are no events of this curve); the verdict of those not critical."""
        u = linearisation.u
        inner = self._inner_spectrum(u, linearisation.params)
        others = self.others(inner.values, self.parts(u)[2])
        circle = self.inner.critical.circle
        growth = np.abs(others) - 1 if circle else others.real
        if not np.isfinite(inner.error) or not np.isfinite(growth).all():
            verdict = Verdict.UNDETERMINED
        elif self.pair_growth(self.parts(u)[2]) > inner.error or (growth > inner.error).any():
            verdict = Verdict.UNSTABLE
        else:
            verdict = Verdict.STABLE if (growth < -inner.error).all() else Verdict.UNDETERMINED
        return Spectrum(np.zeros(0, complex), inner.error, 0, 0, 0, 0, verdict)

    def pair_growth(self, extra: Array) -> float:
        """How far outside the larger one of a real critical pair is; 0 of a complex one: no neutral saddle."""
        if self.kind not in _PAIRS:
            return 0.0
        e = float(extra[0])
        if self.inner.critical.circle:
            return abs(e) - 1 + math.sqrt(e * e - 1) if abs(e) > 1 else 0.0
        return math.sqrt(-e) if e < 0 else 0.0

    @property
    def monitors(self) -> tuple[tuple[Kind, Any], ...]:
        """Functions of a point of this curve whose zeros are points of codimension two (see `locus_tests`)."""
        return monitors(self)

    def response(self, point: Any) -> Array | None:
        """How the linearised curve answers a fixed change of its conditions: infinitely where it branches."""
        if self.kind is Kind.BRANCH_POINT:
            return None
        answer = response(point)
        if answer is None or not answer.any():
            return None
        return answer * np.sqrt(self.ordered(self.weights, point.tangent.weight**2))  # type: ignore[no-any-return]

    def confirmed(self, kind: Kind, point: Any, scale: float) -> Kind | None:
        """The kind of a zero that was located; None where it is no special point."""
        return confirmed(self, kind, point, scale)

    def others(self, values: NDArray[np.complex128], extra: Array) -> NDArray[np.complex128]:
        """The values without the critical ones."""
        rest = list(values.tolist())
        for target in self.targets(extra)[: len(rest)]:
            rest.remove(min(rest, key=lambda v: abs(v - target)))
        return np.array(rest, dtype=complex)

    def targets(self, extra: Array) -> list[complex]:
        """The critical values."""
        critical = self.inner.critical
        if self.kind in _PAIRS:
            e = float(extra[0])
            upper = complex(e, 0.0) + 1j * cmath.sqrt(1 - e * e) if critical.circle else 1j * cmath.sqrt(e)
            return [upper, upper.conjugate() if upper.imag else 1 / upper if critical.circle else -upper]
        if self.kind is Kind.PERIOD_DOUBLING:
            return [complex(critical.minus or -1.0)]
        return [1.0 + 0j if critical.circle else 0j]

    def _settled(self, u: Array, params: Array) -> Array:
        """Inner u at a fold, corrected along its null vector: the inner problem then knows it, for its error there."""
        L, x = self.inner_linearisation(u, params), self.parts(u)[0]
        null = np.real(L.lift(np.linalg.svd(L.core)[2][-1]))
        size = math.sqrt(float(self.inner.weights @ null**2))
        if not (math.isfinite(size) and size > 0):
            return x
        border = Tangent(null / size, 0.0, 1.0)
        found = self.inner.correct(x, self.completed(u, params), self.along, border, 0.0, 1e-6)
        return found.u if found.converged else x

    def adapt(self, u: Array, params: Array, tangent: Tangent) -> tuple[Locus, Array, Tangent] | None:
        """The inner problem's better mesh or scales, and a scale that follows lambda_2.

        A mesh that breaks the symmetry which keeps a branch point alive is not taken: scales only, then.
        """
        x, _, _ = self.parts(u)
        params = self.completed(u, params)
        if self.kind is Kind.FOLD:
            x = self._settled(u, params)
        t = self.parts(tangent.u)[0]
        better = self.inner.adapt(x, params, Tangent(t, tangent.parameter, tangent.weight))
        if better is None or better[1] is x:  # other scales at most, which leave solutions as they are
            inner = self.inner if better is None else better[0]
            problem, _, moved = self._moved(inner, x, t, u, tangent)
            return None if inner is self.inner and problem.scale == self.scale else (problem, u, moved)
        new = self._moved(better[0], better[1], better[2].u, u, tangent)
        if self.kind is Kind.BRANCH_POINT:
            again = new[0].correct(new[1], params, self.along, new[2], 0.0, 1e-8)
            if not again.converged:
                if not hasattr(self.inner, "rescaled"):
                    return None
                scaled = self.inner.rescaled(better[0].scales, better[0].period_scale)
                problem, _, moved = self._moved(scaled, x, t, u, tangent)
                return problem, u, moved
        return new

    def _moved(self, inner: Any, x: Array, t: Array, u: Array, tangent: Tangent) -> tuple[Locus, Array, Tangent]:
        """This curve over another inner problem, with unknowns x and direction t there."""
        (_, second, extra), (_, t_second, t_extra) = self.parts(u), self.parts(tangent.u)
        scale = 2 * abs(second) if abs(second) > 2 * self.scale else self.scale
        new = dataclasses.replace(self, inner=inner, scale=scale, born=None, _memo={})
        direction = np.concatenate([t, [t_second], t_extra])
        length = math.sqrt(float(new.weights @ direction**2) + (tangent.parameter * tangent.weight) ** 2)
        moved = Tangent(direction / length, tangent.parameter / length, tangent.weight)
        return new, np.concatenate([x, [second], extra]), moved

    def measures(self, u: Array, params: Array) -> dict[str, float]:
        """lambda_2, ``torus_angle`` (NS, radians) or ``hopf_frequency``, then the inner problem's columns."""
        x, second, extra = self.parts(u)
        own = {self.free: second}
        if self.kind is Kind.NEIMARK_SACKER:
            angle = math.acos(min(1.0, max(-1.0, float(extra[0]))))
            halved = getattr(self.inner, "halved", False)  # then theta of the half-period map
            own["torus_angle"] = min(2 * angle, 2 * (math.pi - angle)) if halved else angle
        if self.kind is Kind.HOPF:
            own["hopf_frequency"] = math.sqrt(max(0.0, float(extra[0])))
        return {**own, **self.inner.measures(x, self.completed(u, params))}

    def error(self, u: Array, params: Array) -> float:
        """That of the inner solution."""
        return float(self.inner.error(self._solution(u, params), self.completed(u, params)))

    def view(self, u: Array, params: Array) -> Any:
        """The inner solution."""
        return self.inner.view(self._solution(u, params), self.completed(u, params))

    def _solution(self, u: Array, params: Array) -> Array:
        return self._settled(u, params) if self.kind is Kind.FOLD else self.parts(u)[0]
