r"""Periodic orbits by single and multiple shooting: `Shooting`.

With the flow Psi_j over the j-th of K segments of the period and the states x_0 .. x_{K-1} at their starts,

    Psi_j(x_j, p) - x_{j+1} = 0   (j < K - 1),      Psi_{K-1}(x_{K-1}, p) - x_0 - w = 0,

and for autonomous systems, whose period T is an unknown, the phase condition x_ref' . (x_0 - x_ref) = 0. The flow and
its derivatives come from one integration of the variational equations (integration/flow.py): they are the exact
derivatives of the discrete flow. Slower than collocation and limited by growth over a segment, but independent of it:
the second method of the tests, and the one for systems whose orbits are not smooth.

The error is estimated by integrating again with a tolerance 100 times smaller. Unknowns u = (x_0 .. x_{K-1}, T).
Reference: J. Stoer, R. Bulirsch (2002), *Introduction to Numerical Analysis*, section 7.3.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError, NonFiniteError
from ..integration.flow import flow
from ..kernels import piecewise
from ..kernels.gauss import gauss_rule
from ..protocols import Corrected, Spectrum, Tangent
from .impact_layout import frozen, started_at_walls
from .orbit_adaption import natural_sizes, state_scales
from .orbit_spectrum import contracted, deflated, eigenvalues, orbit_spectrum, spectrum_distance
from .orbits import OrbitDiscretisation, one_period, whole_number, winding_vector
from .shooting_linearisation import Segments, ShootingLinearisation

__all__ = ["Shooting"]

Array = np.ndarray
_DENSE_DEGREE = 7
_MAX_ITERATIONS = {True: 30, False: 8}


@dataclass(frozen=True, eq=False, repr=False)
class Shooting(OrbitDiscretisation):
    """Periodic orbits of a system as a continuation problem, by shooting.

    Parameters
    ----------
    system : System
    segments : int
        Number of segments K; 1 is single shooting. More of them where the motion is strongly unstable.
    multiple : int
        Orbits of k forcing periods. Autonomous systems: leave it at 1.
    winding : mapping of angle -> turns, or array (n,) in radians
    rtol, atol : float
        Tolerances of the integration (atol is relative to `scales`).
    scales, period_scale : sizes of the states (n,) and of the period; by default 1, set by `adapt`.

    Raises
    ------
    InputError, UnknownNameError
        Before any computation.

    Examples
    --------
    >>> import stability as st
    >>> problem = st.Shooting(st.models.duffing(xi=0.02, beta=0.001, Omega=0.5))
    >>> p = problem.system.parameter_vector()
    >>> round(problem.view(problem.start(p), p).max["u"], 4)
    0.3332
    """

    system: Any
    segments: int = 1
    multiple: int = 1
    winding: Any = None
    rtol: float = 1e-11
    atol: float = 1e-12
    scales: Any = None
    period_scale: float = 1.0
    _memo: dict[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        for name, high in (("segments", 1000), ("multiple", 64)):
            object.__setattr__(self, name, whole_number(name, getattr(self, name), 1, high))
        one_period("multiple", self.multiple, self.system, not self.own)
        for name in ("rtol", "atol"):
            if not 1e-14 <= getattr(self, name) <= 1e-3:
                raise InputError(f"{name} = {getattr(self, name)!r}: a number from 1e-14 to 1e-3 is needed")
        n = self.system.n
        scales = np.ones(n) if self.scales is None else np.array(self.scales, float)
        if scales.shape != (n,) or not (scales > 0).all():
            raise InputError(f"scales must be {n} positive numbers, got {self.scales!r}")
        scales.setflags(write=False)
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "winding", winding_vector(self.system, self.winding))

    # ------------------------------------------------------------------ layout
    @property
    def n(self) -> int:
        """Number of states."""
        return int(self.system.n)

    @property
    def size(self) -> int:  # type: ignore[override]
        """Length of u."""
        return self.segments * self.n + self.own

    @cached_property
    def places(self) -> Array:
        """Starts of the segments in s."""
        return np.arange(self.segments) / self.segments

    def packed(self, values: Array, period: float) -> Array:
        """u from the states at the starts of the segments."""
        return np.append(np.ravel(values), [period] * self.own)

    def sizes(self, period: float) -> Array:
        """(N,) natural sizes of the unknowns."""
        return self.packed(np.tile(self.scales, (self.segments, 1)), period)

    @cached_property
    def row_sizes(self) -> Array:
        """(N,) natural sizes of the equations."""
        return np.append(np.tile(self.scales, self.segments), [1.0] * self.own)

    @cached_property
    def weights(self) -> Array:
        """(N,) mean square over the segments in units of the scales."""
        return self.packed(np.tile(self.scales**-2 / self.segments, (self.segments, 1)), self.period_scale**-2)

    def __repr__(self) -> str:
        periods = f", {self.multiple} forcing periods" if self.multiple > 1 else ""
        return f"Shooting of '{self.system.name}', {self._size_in_words}{periods}"

    @property
    def _size_in_words(self) -> str:
        return f"{self.segments} segment{'s' * (self.segments > 1)}"

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data from which `from_spec` makes an equal problem."""
        own = {
            "problem": "Shooting",
            "segments": self.segments,
            "multiple": self.multiple,
            "winding": self.winding.tolist(),
            "rtol": self.rtol,
            "atol": self.atol,
            "scales": self.scales.tolist(),
            "period_scale": self.period_scale,
        }
        if self.system.function is not None:
            return {**own, "view_only": True}
        return {**own, "system": self.system.to_dict()}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> Shooting:
        """The problem of a stored description."""
        from ..systems.system import System

        fields = {k: v for k, v in spec.items() if k not in ("problem", "system")}
        return cls(System.from_dict(spec["system"]), **fields)

    def period_of(self, u: Array, params: Array) -> float:
        """Period of the orbit."""
        return float(u[-1]) if self.own else self.orbit_period(params)

    def integrate(self, u: Array, params: Array, tighter: float = 1.0) -> Segments:
        """All segments with their variational equations."""
        period, n = self.period_of(u, params), self.n
        if not 0 < period < np.inf:
            raise NonFiniteError(f"the period is {period:g}")
        ends, matrices, slopes = [], [], []
        names = tuple(self.parameters)
        for j in range(self.segments):
            span = (period * j / self.segments, period * (j + 1) / self.segments)
            end = flow(
                self.system, span, u[j * n : (j + 1) * n], params, rtol=max(self.rtol * tighter, 1.01e-15),
                atol=self.atol * self.scales * tighter, variations=True, parameters=names, max_steps=100_000,
            )  # fmt: skip
            ends.append(end.x)
            matrices.append(end.matrix)
            slopes.append(end.by_parameter)
        ends_, phases = np.array(ends), np.full(self.segments, 0.0)
        if self.flow.forced:
            phases = np.mod(np.arange(1, self.segments + 1) * self.multiple / self.segments, 1.0)
        rates = self.evaluations.F(phases, ends_, params) * (period / self.segments)
        return Segments(ends_, np.array(matrices), np.array(slopes).reshape(self.segments, n, -1), rates, period)

    def start(self, params: Array, guess: Any = None) -> Array:
        """A converged u from a guess (see `orbit_starts`), or an error that says which guess to give."""
        if self.system.stops:
            found = started_at_walls(self, np.asarray(params, float), guess)
            if found is not None:
                return found
        return super().start(params, guess)

    # ------------------------------------------------------------------ the Newton solve
    def linearise(self, u: Array, params: Array) -> ShootingLinearisation:
        """The linearisation at (u, params); not finite where the integration fails."""
        return self._linearised(np.array(u, float), np.array(params, float), 1.0)

    def _linearised(self, u: Array, params: Array, tighter: float) -> ShootingLinearisation:
        try:
            parts = self.integrate(u, params, tighter)
        except (ConvergenceError, NonFiniteError):
            parts = Segments.failed(self.segments, self.n, len(params))
        return ShootingLinearisation(self, u, params, parts)

    def correct(
        self, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
    ) -> Corrected:
        """The bordered Newton solve of `protocols.Problem`."""
        index, w = self.index(free), self.weights
        given, given_p = np.array(u, float), np.array(params, float)
        u, params = given.copy(), given_p.copy()
        if tangent is not None:
            u, params[index] = u + ds * tangent.u, params[index] + ds * tangent.parameter
        previous, residual, note, L = np.inf, np.inf, "no convergence", None
        iteration = 0
        for iteration in range(1, _MAX_ITERATIONS[tangent is None] + 1):
            L = self.linearise(u, params)
            L.reference = given
            residual = L.size_of_residual
            if not residual < np.inf:
                note = L.complaint
                break
            column = L.column(free)
            if tangent is None:
                right = np.column_stack([-L.residual, -column])
                x = L.solve(np.zeros((0, self.size)), np.zeros((self.size, 0)), np.zeros((0, 0)), right)
            else:
                pull = tangent.weight**2 * tangent.parameter
                gap = ds - tangent.u @ (w * (u - given)) - pull * (params[index] - given_p[index])
                right = np.zeros((self.size + 1, 2))
                right[:-1, 0], right[-1] = -L.residual, (gap, 1.0)
                x = L.solve((w * tangent.u)[None], column[:, None], np.array([[pull]]), right)
            if not np.isfinite(x).all():
                note = "singular"
                break
            step = x[: self.size, 0]
            change_l = 0.0 if tangent is None else float(x[-1, 0])
            change = float(np.sqrt(w @ step**2 + (0.0 if tangent is None else (tangent.weight * change_l) ** 2)))
            length = float(np.sqrt(w @ u**2))
            damping = 1.0
            if tangent is None and change > 0.5 * (1 + length):
                damping = 0.5 * (1 + length) / change
            if self.own and step[-1] < -0.5 * u[-1]:
                damping = min(damping, -0.5 * u[-1] / step[-1])
            u, params[index] = u + damping * step, params[index] + damping * change_l
            if change <= tolerance * (1 + length):
                return self._corrected(u, params, x, tangent, residual, iteration, L, column)
            if tangent is not None and iteration > 1 and change > 2 * previous:
                break
            previous = change
        return Corrected(u, params, None, residual, iteration, 0, None, False, note)

    def _corrected(
        self, u: Array, params: Array, x: Array, tangent: Tangent | None, residual: float, iterations: int,
        L: ShootingLinearisation, column: Array,
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

    # ------------------------------------------------------------------ spectrum, error, results
    def _tighter(self, u: Array, params: Array) -> ShootingLinearisation:
        known = self._memo.get("tighter")
        if known is None or not (np.array_equal(known.u, u) and np.array_equal(known.params, params)):
            known = self._memo["tighter"] = self._linearised(np.array(u, float), np.array(params, float), 1e-2)
        return known

    def error(self, u: Array, params: Array) -> float:
        """Largest error of the states over their scales: the shortest correction that the tighter residual asks for."""
        tighter = self._tighter(u, params)
        if not np.isfinite(tighter.residual).all():
            return np.inf
        matrix = tighter.matrix * self.sizes(self.period_scale) / self.row_sizes[:, None]
        return float(np.abs(np.linalg.lstsq(matrix, tighter.residual / self.row_sizes, rcond=1e-7)[0]).max())

    def spectrum(self, linearisation: Any) -> Spectrum:
        """Multipliers, their error (by a tighter tolerance, and the trivial multiplier), counts, verdict."""
        M, error = linearisation.spectral, 0.0
        tighter = self._tighter(linearisation.u, linearisation.params).spectral
        if not (np.isfinite(M).all() and np.isfinite(tighter).all()):
            return orbit_spectrum(np.full(self.n - self.own, np.nan, complex), np.inf)
        if self.own:
            start = linearisation.u[None, : self.n]
            direction = self.evaluations.F(None, start, linearisation.params)[0] / self.scales
            M, error = deflated(M, direction)
            tighter = deflated(tighter, direction)[0]
        values = eigenvalues(M)
        error += spectrum_distance(values, eigenvalues(tighter)) + 1e-15 * float(np.abs(M).max()) * self.n
        J = self.evaluations.FJ(np.zeros(1), linearisation.u[None, : self.n], linearisation.params)[1][0]
        elastic = all(stop.restitution == 1.0 for stop in self.system.stops)
        neutral = self.n == 2 and not self.own and elastic and float(np.trace(J)) == 0.0
        values = contracted(values, linearisation.factors)
        return orbit_spectrum(values, error, neutral and self.flow.divergence_free(linearisation.params))

    def pieces(self, u: Array, params: Array) -> tuple[int, Array, Array, float]:
        """The steps of the integration as polynomials of degree 7."""
        period, n = self.period_of(u, params), self.n
        local = gauss_rule(_DENSE_DEGREE).abscissae
        basis = np.polynomial.chebyshev.chebvander(2 * local - 1, _DENSE_DEGREE)
        edges, values = [np.zeros(1)], []
        for j in range(self.segments):
            span = (period * j / self.segments, period * (j + 1) / self.segments)
            part = flow(
                self.system, span, u[j * n : (j + 1) * n], params, rtol=self.rtol, atol=self.atol * self.scales,
                dense=True,
            )  # fmt: skip
            values.append(np.einsum("li,kin->kln", basis, piecewise.from_steps(part.nested)))
            edges.append(part.times[1:] / period)
        all_edges = np.concatenate(edges)
        all_edges[-1] = 1.0
        return _DENSE_DEGREE, all_edges, np.concatenate(values), period

    def adapt(self, u: Array, params: Array, tangent: Tangent | None) -> tuple[Shooting, Array, Any] | None:
        """New scales where the solution has outgrown the present ones by a factor of 2; else None.

        With hard stops the orbit's own sequence of impacts becomes part of the problem (`ImpactShooting`), unless it
        sticks to a wall.
        """
        if self.system.stops:
            made = frozen(self, u[: self.n], params, self.period_of(u, params))
            if made is not None:
                return *made, None if tangent is None else tangent._replace(u=np.zeros(made[0].size))
        period_scale = float(u[-1]) if self.own else 1.0
        smallest = natural_sizes(self.system, period_scale if self.own else self.orbit_period(params))
        scales = state_scales(self.pieces(u, params)[2].reshape(-1, self.n), smallest)
        ratios = np.append(scales / self.scales, period_scale / self.period_scale)
        if not ((ratios > 2) | (ratios < 0.5)).any():
            return None
        return dataclasses.replace(self, scales=scales, period_scale=period_scale, _memo={}), u, tangent

    def doubled(self, u: Array, params: Array, vector: Array) -> tuple[Shooting, Array, Array]:
        """The problem of twice the period, the orbit run through twice, and the direction (v(s), -v(s))."""
        new = dataclasses.replace(
            self, segments=2 * self.segments, multiple=self.multiple if self.own else 2 * self.multiple,
            winding=2 * self.winding, period_scale=2 * self.period_scale if self.own else 1.0, _memo={},
        )  # fmt: skip
        n, K = self.n, self.segments
        states = u[: K * n].reshape(K, n)
        lifted = self.linearise(u, params).lift(np.concatenate([vector, np.zeros(self.own)]))[: K * n].reshape(K, n)
        period = 2 * float(u[-1]) if self.own else 0.0
        twice = new.packed(np.concatenate([states, states + self.winding]), period)
        return new, twice, new.packed(np.concatenate([lifted, -lifted]), 0.0)
