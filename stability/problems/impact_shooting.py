r"""Periodic orbits with a given sequence of impacts: what `Shooting` becomes for a system with hard stops.

The orbit is cut into arcs of flight (problems/impact_linearisation.py); the impact times are unknowns and every arc is
integrated without its walls. The sequence of impacts is part of the problem, so that the solutions are smooth in the
parameters up to and *through* grazing; what tells whether a solution is physical is its clearance, the smallest of

    side q'(t_i-) / scale            speed towards the wall, at every impact,
    side (position - q(t*)) / scale  distance from it, at every extremum t* towards it (q'(t*) = 0) between impacts.

It is positive on physical orbits and zero where one grazes: the driver locates that zero (`Kind.GRAZING`) and ends the
branch there. Unknowns u = (X_0 .. X_(N-1), impact times in units of the period, T): X_0 at the phase `origin`, chosen
in the middle of the longest flight and moved by `adapt` when impacts come near.
References: M. di Bernardo et al. (2008), Piecewise-smooth Dynamical Systems, chapters 6 and 8; A. B. Nordmark (1991),
J. Sound Vib. 145, 279-297.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError, NonFiniteError
from ..integration.engine import Engine
from ..integration.events import Wall
from ..integration.flow import Flow, flow
from ..kernels import piecewise
from ..kernels.gauss import gauss_rule
from .impact_layout import Impact, laid_out, uneven
from .impact_linearisation import Arcs, ImpactLinearisation
from .orbit_adaption import natural_sizes, state_scales
from .shooting import Shooting

__all__ = ["ImpactShooting"]

Array = np.ndarray
_DENSE_DEGREE = 7
_TOUCHING = 1e-7  # clearance of a located grazing point
_SAME_TIME = 1e-5  # of the period: an impact without speed is its own extremum
_FAR = 1.0  # clearance of an orbit that never turns towards a wall


@dataclass(frozen=True, eq=False, repr=False)
class ImpactShooting(Shooting):
    """Periodic orbits with a fixed sequence of impacts; made by `Shooting` from a motion.

    Parameters
    ----------
    marks : tuple of int
        What ends the arcs 0 .. N - 2: the number of a stop, or -1 for a cut.
    cuts : tuple of float
        Times of the cuts, in units of the orbit's period, ascending.
    origin : float in [0, 1)
        Time of X_0, in units of the orbit's period.
    """

    marks: tuple[int, ...] = ()
    cuts: tuple[float, ...] = ()
    origin: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "marks", tuple(int(m) for m in self.marks))
        object.__setattr__(self, "cuts", tuple(float(c) for c in self.cuts))
        if sum(m < 0 for m in self.marks) != len(self.cuts) or max(self.marks, default=-1) >= len(self.contacts):
            raise InputError(f"marks = {self.marks} and cuts = {self.cuts} do not fit each other or the stops")

    # ------------------------------------------------------------------ layout
    @cached_property
    def contacts(self) -> tuple[Wall, ...]:
        """The stops of the system."""
        guards = Engine.of(self.system).guards
        return () if guards is None else guards.walls

    @cached_property
    def smooth(self) -> Any:
        """The system without its stops."""
        return self.system.replace(stops=())

    @property
    def count(self) -> int:
        """Number of arcs N."""
        return len(self.marks) + 1

    @property
    def impacts(self) -> int:
        """Number of impacts q in a period of the orbit."""
        return len(self.marks) - len(self.cuts)

    @property
    def size(self) -> int:  # type: ignore[override]
        """Length of u."""
        return self.count * self.n + self.impacts + self.own

    @property
    def places(self) -> Array:
        """(1,) time of X_0 in units of the period."""
        return np.array([self.origin])

    @cached_property
    def time_columns(self) -> tuple[int, ...]:
        """Column of the time of every node s_0 .. s_N in u; -1 where it is fixed."""
        columns, k = [-1], self.count * self.n
        for mark in self.marks:
            columns.append(k if mark >= 0 else -1)
            k += mark >= 0
        return (*columns, -1)

    def edges(self, u: Array) -> Array:
        """(N + 1,) times of the nodes in units of the period."""
        cuts = iter(self.cuts)
        inner = [u[c] if c >= 0 else next(cuts) for c in self.time_columns[1:-1]]
        return np.array([self.origin, *inner, self.origin + 1.0])

    def packed(self, values: Array, period: float, times: Any = ()) -> Array:
        """u from the states at the nodes and the impact times."""
        return np.concatenate([np.ravel(values), np.asarray(times, float), [period] * self.own])

    def sizes(self, period: float) -> Array:
        """(N,) natural sizes of the unknowns."""
        return self.packed(np.tile(self.scales, (self.count, 1)), period, np.ones(self.impacts))

    @cached_property
    def row_sizes(self) -> Array:
        """(N,) natural sizes of the equations."""
        walls = [self.scales[self.contacts[m].coordinate] for m in self.marks if m >= 0]
        return np.concatenate([np.tile(self.scales, self.count), walls, [1.0] * self.own])

    @cached_property
    def weights(self) -> Array:
        """(N,) mean square over the arcs in units of the scales; impact times in units of the period."""
        tiled = np.tile(self.scales**-2 / self.count, (self.count, 1))
        return self.packed(tiled, self.period_scale**-2, np.full(self.impacts, 1.0 / self.count))

    @property
    def _size_in_words(self) -> str:
        return f"{self.impacts} impact{'s' * (self.impacts != 1)} a period"

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data from which `from_spec` makes an equal problem."""
        own = {"marks": list(self.marks), "cuts": list(self.cuts), "origin": self.origin}
        return {**super().spec, "problem": "ImpactShooting", **own}

    # ------------------------------------------------------------------ integration
    def _arc(self, x: Array, span: tuple[float, float], params: Array, tighter: float, **options: Any) -> Flow:
        return flow(
            self.smooth, span, x, params, rtol=max(self.rtol * tighter, 1.01e-15),
            atol=self.atol * self.scales * tighter, max_steps=100_000, **options,
        )  # fmt: skip

    def integrate(self, u: Array, params: Array, tighter: float = 1.0) -> Arcs:  # type: ignore[override]
        """All arcs with their variational equations."""
        period, n, edges = self.period_of(u, params), self.n, self.edges(u)
        if not 0 < period < np.inf:
            raise NonFiniteError(f"the period is {period:g}")
        if not (np.diff(edges) > 0).all():
            raise NonFiniteError("the impacts are out of order")
        states, names = u[: self.count * n].reshape(self.count, n), tuple(self.parameters)
        found = [
            self._arc(x, (a * period, b * period), params, tighter, variations=True, parameters=names)
            for x, a, b in zip(states, edges, edges[1:])
        ]
        ends = np.array([end.x for end in found])
        phases = np.mod(edges * self.multiple, 1.0) if self.flow.forced else np.zeros(len(edges))
        first = self.evaluations.F(phases[:-1].copy(), np.ascontiguousarray(states), params)
        last = self.evaluations.F(phases[1:].copy(), ends, params)
        slopes = np.array([end.by_parameter for end in found]).reshape(self.count, n, -1)
        return Arcs(edges, ends, np.array([end.matrix for end in found]), slopes, first, last, period)

    def linearise(self, u: Array, params: Array) -> ImpactLinearisation:
        """The linearisation at (u, params); not finite where the integration fails."""
        return self._linearised(np.array(u, float), np.array(params, float), 1.0)

    def _linearised(self, u: Array, params: Array, tighter: float) -> ImpactLinearisation:
        try:
            parts = self.integrate(u, params, tighter)
        except (ConvergenceError, NonFiniteError):
            parts = Arcs.failed(self.count, self.n, len(params))
        return ImpactLinearisation(self, u, params, parts)

    def motion(self, u: Array, params: Array) -> list[tuple[Array, Array]]:
        """(edges (k + 1,) in units of the period, Chebyshev coefficients (k, 8, n)) of every arc."""
        known = self._memo.get("motion")
        if known is not None and np.array_equal(known[0], u) and np.array_equal(known[1], params):
            return known[2]  # type: ignore[no-any-return]
        period, edges = self.period_of(u, params), self.edges(u)
        states = u[: self.count * self.n].reshape(self.count, self.n)
        arcs = []
        for x, a, b in zip(states, edges, edges[1:]):
            spans = [(a, 1.0), (1.0, b)] if a < 1.0 < b else [(a, b)]  # a piece ends where the period does
            for low, high in spans:
                part = self._arc(x, (low * period, high * period), params, 1.0, dense=True)
                x = part.x
                times = part.times / period
                times[0], times[-1] = low, high
                arcs.append((times, piecewise.from_steps(part.nested)))
        self._memo["motion"] = (np.array(u), np.array(params), arcs)
        return arcs

    def state_at(self, u: Array, params: Array, s: float) -> Array:
        """(n,) state at a time in units of the period, in [origin, origin + 1]."""
        for times, coefficients in self.motion(u, params):
            if times[0] <= s < times[-1]:
                return np.asarray(piecewise.at(times, coefficients, np.array([s]))[0])
        times, coefficients = self.motion(u, params)[-1]
        return np.asarray(piecewise.at(times, coefficients, times[-1:])[0])

    # ------------------------------------------------------------------ grazing
    def touches(self, u: Array, params: Array) -> list[tuple[float, int, float, Array]]:
        """(clearance, wall, time in periods, state) of every extremum towards a wall between impacts."""
        found = []
        for times, coefficients in self.motion(u, params):
            for number, wall in enumerate(self.contacts):
                for s in piecewise.crossings(times, coefficients[:, :, wall.velocity], -wall.side):
                    x = piecewise.at(times, coefficients, np.array([s]))[0]
                    gap = wall.side * (wall.position - x[wall.coordinate]) / self.scales[wall.coordinate]
                    found.append((float(gap), number, float(s), np.asarray(x)))
        return found

    def speeds(self, u: Array, params: Array) -> Array:
        """(q,) speeds towards the walls at the impacts, over the scales of the velocities."""
        edges, walls = self.edges(u), [self.contacts[m] if m >= 0 else None for m in self.marks]
        ends = {}
        for times, coefficients in self.motion(u, params):
            ends[float(times[-1])] = coefficients[-1].sum(axis=0)
        found = [(ends[float(s)], w) for s, w in zip(edges[1:-1], walls) if w is not None]
        return np.array([w.side * x[w.velocity] / self.scales[w.velocity] for x, w in found])

    def clearance(self, u: Array, params: Array) -> float:
        """The smallest speed at an impact or distance at an extremum, over its scale; positive on physical orbits."""
        near = [touch[0] for touch in self.touches(u, params)]
        return float(min([*self.speeds(u, params).tolist(), *near], default=_FAR))

    def beyond(self, u: Array, params: Array) -> tuple[ImpactShooting, Array]:
        """At a grazing point: the problem with an impact more, or one less, and the same orbit as its solution.

        Where several walls are grazed at once (a symmetric orbit between two stops), each of them counts.
        """
        speeds, touches = np.abs(self.speeds(u, params)), self.touches(u, params)
        least = min([*speeds.tolist(), *(abs(touch[0]) for touch in touches)], default=np.inf)
        if not least < _TOUCHING:
            raise InputError(f"no wall is grazed by this orbit: its clearance is {self.clearance(u, params):.3g}")
        old = list(zip(self._impacts(u), speeds))
        impacts = [impact for impact, speed in old if speed >= _TOUCHING]
        gone = np.array([impact.time for impact, speed in old if speed < _TOUCHING])
        for gap, number, s, x in touches:
            if abs(gap) < _TOUCHING and not (np.abs(gone - s) < _SAME_TIME).any():
                wall = self.contacts[number]
                x[wall.coordinate], x[wall.velocity] = wall.position, -wall.restitution * x[wall.velocity]
                impacts.append(Impact(s, number, x))
        return self._relaid(u, params, sorted(impacts, key=lambda impact: impact.time))

    def _impacts(self, u: Array) -> list[Impact]:
        edges, states = self.edges(u), u[: self.count * self.n].reshape(self.count, self.n)
        nodes = zip(edges[1:-1], self.marks, states[1:])
        return [Impact(float(s), mark, state.copy()) for s, mark, state in nodes if mark >= 0]

    def _relaid(self, u: Array, params: Array, impacts: list[Impact]) -> tuple[ImpactShooting, Array]:
        def state(s: float) -> Array:
            back = np.floor(s - self.origin)
            return self.state_at(u, params, s - back) + back * self.winding

        marks, cuts, origin, states, times = laid_out(impacts, self.segments, state, self.winding)
        new = dataclasses.replace(self, marks=marks, cuts=cuts, origin=origin, _memo={})
        return new, new.packed(states, self.period_of(u, params), times)

    # ------------------------------------------------------------------ results
    def start(self, params: Array, guess: Any = None) -> Array:
        """u from a solution in this layout; other guesses belong to `Shooting`, which finds the sequence of impacts."""
        if isinstance(guess, np.ndarray) and guess.shape == (self.size,):
            return np.array(guess, float)
        raise InputError("this problem has a fixed sequence of impacts: give Shooting(system) to find another one")

    def pieces(self, u: Array, params: Array) -> tuple[int, Array, Array, float]:
        """The steps of the integration as polynomials of degree 7, from phase zero on."""
        local = 2 * gauss_rule(_DENSE_DEGREE).abscissae - 1
        basis = np.polynomial.chebyshev.chebvander(local, _DENSE_DEGREE)
        arcs = self.motion(u, params)
        late = [k for k, (times, _) in enumerate(arcs) if times[0] >= 1.0]
        edges, values = [np.zeros(1)], []
        for k in [*late, *(k for k in range(len(arcs)) if k not in late)]:
            times, coefficients = arcs[k]
            shift = 1.0 if k in late else 0.0
            edges.append(times[1:] - shift)
            values.append(np.einsum("li,kin->kln", basis, coefficients) - shift * self.winding)
        all_edges = np.concatenate(edges)
        all_edges[-1] = 1.0
        return _DENSE_DEGREE, all_edges, np.concatenate(values), self.period_of(u, params)

    def measures(self, u: Array, params: Array) -> dict[str, float]:
        """The columns of all orbits, then ``impacts`` (in a period), ``impact_speed.max``, ``.min`` (0 without any)."""
        out, params = super().measures(u, params), np.asarray(params, float)
        scales = np.array([self.scales[self.contacts[m].velocity] for m in self.marks if m >= 0])
        speeds = np.abs(self.speeds(u, params)) * scales
        out["impacts"] = float(self.impacts)
        out["impact_speed.max"] = float(speeds.max(initial=0.0))
        out["impact_speed.min"] = float(speeds.min()) if len(speeds) else 0.0
        return out

    def adapt(self, u: Array, params: Array, tangent: Any) -> Any:
        """New scales where the solution has outgrown them, new places of origin and cuts where impacts come near."""
        period = self.period_of(u, params)
        period_scale = period if self.own else 1.0
        scales = state_scales(self.pieces(u, params)[2].reshape(-1, self.n), natural_sizes(self.system, period))
        ratios = np.append(scales / self.scales, period_scale / self.period_scale)
        rescale, move = bool(((ratios > 2) | (ratios < 0.5)).any()), uneven(self.edges(u), self.marks)
        if not (rescale or move):
            return None
        new, x = self._relaid(u, params, self._impacts(u)) if move else (self, u)
        if rescale:
            new = dataclasses.replace(new, scales=scales, period_scale=period_scale, _memo={})
        return new, x, self._carried(new, self.edges(u), tangent) if move and tangent is not None else tangent

    def _carried(self, new: ImpactShooting, edges: Array, tangent: Any) -> Any:
        """The direction in the new layout, good enough to tell its sense: impacts keep their part, cuts have none."""
        n, old = self.n, tangent.u
        keys = [k for k, m in enumerate(self.marks) if m >= 0]
        parts = [(old[(k + 1) * n : (k + 2) * n], old[self.time_columns[k + 1]]) for k in keys]
        places = [k for k, m in enumerate(new.marks) if m >= 0]
        times = np.array([edges[k + 1] for k in keys])
        turn = int(np.argmin(np.mod(times - new.origin, 1.0))) if keys else 0
        out = np.zeros(new.size)
        for k, (state, time) in zip(places, parts[turn:] + parts[:turn]):
            out[(k + 1) * n : (k + 2) * n], out[new.time_columns[k + 1]] = state, time
        if self.own:
            out[-1] = old[-1]
        return tangent._replace(u=out)

    def doubled(self, u: Array, params: Array, vector: Array) -> tuple[ImpactShooting, Array, Array]:
        """The problem of twice the period, the orbit run through twice, and the direction (v(s), -v(s))."""
        edges, n, count = self.edges(u), self.n, self.count
        seam = (self.origin + 1.0) / 2
        cuts = np.array(self.cuts) / 2
        new = dataclasses.replace(
            self, multiple=self.multiple if self.own else 2 * self.multiple, winding=2 * self.winding,
            period_scale=2 * self.period_scale if self.own else 1.0, segments=2 * self.segments,
            marks=(*self.marks, -1, *self.marks), cuts=(*cuts, seam, *(cuts + 0.5)), origin=self.origin / 2, _memo={},
        )  # fmt: skip
        states = u[: count * n].reshape(count, n)
        times = np.array([s for s, mark in zip(edges[1:-1], self.marks) if mark >= 0])
        lifted = self.linearise(u, params).lift(np.concatenate([vector, np.zeros(self.own)]))
        moved, late = lifted[: count * n].reshape(count, n), lifted[count * n : count * n + len(times)]
        period = 2 * float(u[-1]) if self.own else 0.0
        twice = new.packed(np.concatenate([states, states + self.winding]), period, [*times / 2, *(times + 1) / 2])
        return new, twice, new.packed(np.concatenate([moved, -moved]), 0.0, [*late / 2, *-late / 2])
