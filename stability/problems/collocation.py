r"""Periodic orbits by Gauss collocation with condensation: `Collocation`.

    x' = sigma f(phase, x, p) on s in [0, 1],      x(1) = S x(0) + w,      sigma = span T,

forced systems: T = T(p) is the forcing period, phase = frac(span s), span = k for orbits of k forcing periods (k/2
where x(t + k T/2) = S x(t), see orbit_symmetry); autonomous systems: T is the orbit's own period, an unknown, with an
integral phase condition.
Polynomials of degree m on N intervals through the Gauss points (order 2m at the nodes); each Newton solve is one
compiled call (kernels/condensation_newton.py), from which the tangent, the determinant sign and the monodromy matrix
fall out. The error is estimated by one Newton step at degree m + 1 from the same orbit, which gives the change of the
nodes, of the period and of the multipliers; the mesh follows it (`adapt`).

Inner product: time average of the states over their squared scales (+ the period's part); the stages are Gauss nodes,
so it is an exact quadrature. Reference: Ascher, Mattheij, Russell (1995), *Numerical Solution of Boundary Value
Problems for Ordinary Differential Equations*, chapters 5, 7, 9.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InputError
from ..integration.switches import has_switches
from ..kernels import condensation_newton as kernels
from ..kernels.meshes import uniform_edges
from ..protocols import Corrected, Spectrum, Stretch, Stride, Tangent
from ..systems.stops import refuse_stops
from .collocation_error import carried_to, node_error
from .collocation_kinks import kink_advice, passage
from .collocation_linearisation import CollocationLinearisation, Workspace
from .collocation_march import strides
from .collocation_spectrum import collocation_spectrum
from .orbit_adaption import adapted
from .orbit_mesh import OrbitMesh
from .orbit_starts import doubled_problem
from .orbit_symmetry import Mirror, broken, chosen, symmetric_doubled
from .orbits import OrbitDiscretisation, one_period, whole_number, winding_vector

__all__ = ["Collocation"]

Array = np.ndarray
_MAX_ITERATIONS = {0: 30, 1: 8}  # without and with a tangent
_NOTES = {kernels.NO_CONVERGENCE: "no convergence", kernels.SINGULAR: "singular"}
_MAX_INTERVALS = 1000


def _plain(array: Array) -> Array:
    """A writable contiguous array: kernels are compiled once for these, and again for every other sort."""
    flags = array.flags
    if flags.writeable and flags.c_contiguous and array.dtype == np.float64:
        return array
    return np.array(array, float, order="C")


@dataclass(frozen=True, eq=False, repr=False)
class Collocation(OrbitDiscretisation):
    """Periodic orbits of a system, forced or autonomous, as a continuation problem.

    Parameters
    ----------
    system : System
    degree : int
        Polynomial degree m on each interval, 1 to 11.
    intervals : int
        Number of mesh intervals to start with, and the smallest that `adapt` goes back to; 20, or 10 on half a period.
    multiple : int
        Orbits of k forcing periods (a doubled orbit: 2). Autonomous systems: leave it at 1.
    winding : mapping of angle -> whole number of turns per orbit, or array (n,) in radians
        x(end) = x(0) + 2 pi k for the angles a system declares; with `symmetry` the end is that of half the orbit.
    symmetry : Symmetry, mapping such as ``{"u": "-u"}``, signed permutation (n, n), "auto" or None
        S of x(t + P/2) = S x(t), P the orbit's period: only such orbits are sought, on half of the period, at half the
        cost. A multiplier -1 of the half-period map N = S^-1 Phi(P/2) is the loss of the symmetry: a branch point,
        ``symmetry_breaking``; those of the whole period, N^2, are shown. "auto": one of ``system.symmetries`` that
        allows it, the whole period where none does; symmetric doubled orbits are solved on their half, too.
    accuracy : float
        Wanted error of the nodes over the states' scales; `adapt` chooses the number of intervals for it.
    adaptive : bool
        False keeps the mesh as it is (the scales still follow the solution).
    edges, scales, period_scale : arrays and number, optional
        Mesh in s (N + 1,), sizes of the states (n,) and of the period; by default uniform, 1 and 1, set by `adapt`.
    automatic : bool
        Whether "auto" was asked for.
    mirror : Mirror, optional
        How a family without a symmetry is mapped to its image; set by `switch`.

    Raises
    ------
    InputError, UnknownNameError, EquationError
        Before any computation; EquationError: the equations do not have that symmetry.

    Examples
    --------
    >>> import stability as st
    >>> problem = st.Collocation(st.models.duffing(xi=0.02, beta=0.001, Omega=0.5))
    >>> p = problem.system.parameter_vector()
    >>> orbit = problem.view(problem.start(p), p)
    >>> round(orbit.max["u"], 4)
    0.3332
    """

    system: Any
    degree: int = 5
    intervals: Any = None
    multiple: int = 1
    winding: Any = None
    symmetry: Any = None
    accuracy: float = 1e-9
    adaptive: bool = True
    edges: Any = None
    scales: Any = None
    period_scale: float = 1.0
    automatic: bool = False
    mirror: Any = None
    _memo: dict[str, Any] = field(default_factory=dict, repr=False)
    _warned: set[str] = field(default_factory=set, repr=False)

    def __post_init__(self) -> None:
        refuse_stops(self.system, "Collocation")
        n = self.system.n
        object.__setattr__(self, "automatic", bool(self.automatic or str(self.symmetry) == "auto"))
        object.__setattr__(self, "symmetry", chosen(self.system, self.symmetry, self.multiple))
        object.__setattr__(self, "mirror", Mirror.of(self.mirror))
        symmetric = self.symmetry is not None
        if self.intervals is None:
            object.__setattr__(self, "intervals", 10 if symmetric else 20)
        for name, low, high in (("degree", 1, 11), ("intervals", 1, _MAX_INTERVALS), ("multiple", 1, 64)):
            object.__setattr__(self, name, whole_number(name, getattr(self, name), low, high))
        one_period("multiple", self.multiple, self.system, not self.own)
        if not self.accuracy > 0:
            raise InputError(f"accuracy = {self.accuracy!r}: a positive number is needed (1e-9 is the default)")
        object.__setattr__(self, "span", self.multiple * (0.5 if symmetric else 1.0))
        matrix = self.symmetry.matrix if symmetric else np.eye(n)
        scales = np.ones(n) if self.scales is None else np.array(self.scales, float)
        if scales.shape != (n,) or not (scales > 0).all():
            raise InputError(f"scales must be {n} positive numbers, got {self.scales!r}")
        if self.edges is None:
            edges = uniform_edges(self.intervals, self.break_points(self.system.parameter_vector()))
        else:
            edges = np.array(self.edges, float)
            if edges.ndim != 1 or len(edges) < 2 or not (np.diff(edges) > 0).all() or edges[0] != 0 or edges[-1] != 1:
                raise InputError("edges must ascend from 0 to 1")
        for name, value in (("closure", matrix), ("scales", scales), ("edges", edges)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "winding", winding_vector(self.system, self.winding))
        object.__setattr__(self, "mesh", OrbitMesh(edges, self.degree, n, self.span, self.own))

    @property
    def doubt(self) -> str:
        """Kinks in the equations, where a branch stops."""
        return kink_advice(self.system)

    def break_points(self, params: Array) -> Array:
        """Breaks of the forcing at `params` as points s of the orbit, ascending, in [0, 1)."""
        breaks = self.flow.breaks(params)
        points = (breaks[:, None] + np.arange(np.ceil(self.span))).ravel() / self.span
        if self.mirror is not None and self.mirror.fraction and not (np.abs(points - 0.5) < 1e-12).any():
            points = np.append(points, 0.5)
        return np.asarray(np.sort(points[points < 1 - 1e-12]))

    @property
    def halved(self) -> bool:  # type: ignore[override]
        """Whether the orbit is solved on half of its period."""
        return self.symmetry is not None

    @property
    def whole_winding(self) -> Array:
        """x(P) - x(0) of the whole orbit (n,)."""
        return np.asarray(self.closure @ self.winding + self.winding if self.halved else self.winding)

    # ------------------------------------------------------------------ what the problem is
    mesh: OrbitMesh = field(init=False, repr=False)
    span: float = field(init=False, repr=False)
    closure: Array = field(init=False, repr=False)

    @property
    def kept(self) -> Array:
        """State indices that enter the factorisation (see kernels/condensation.py)."""
        return self.flow.kept

    @property
    def position(self) -> Array:
        """For each kept state the state whose derivative it is, or -1."""
        return self.flow.position

    @property
    def size(self) -> int:  # type: ignore[override]
        """Length of u."""
        return self.mesh.size

    @cached_property
    def places(self) -> Array:
        """Points s (K,) whose states make u: mesh points, then stages."""
        return np.concatenate([self.mesh.edges, self.mesh.points.ravel()])

    def packed(self, values: Array, period: float) -> Array:
        """u from states (K, n) at `places`."""
        count = self.mesh.intervals + 1
        return self.mesh.join(values[:count], values[count:], period)

    def pieces(self, u: Array, params: Array) -> tuple[int, Array, Array, float]:
        """(degree d, edges (K + 1,) in [0, 1], values (K, d + 1, n) at (0, Gauss points), period) of the whole orbit.

        Nodes are more accurate than the polynomial between them. On every interval by itself the initial value problem
        from its left node is solved by one Newton step of a higher degree, which makes both equally accurate.
        """
        mesh = self.mesh.dense
        nodes, stages, rest = self.mesh.split(u)
        stages = self.mesh.resample(mesh, nodes, stages)
        _, stage, sign = self._condensed(mesh, nodes, stages, rest, params, True)
        if sign != 0.0:
            stages = stages - stage
        values, edges = mesh.polynomial(nodes, stages), mesh.edges
        if self.halved:
            values = np.concatenate([values, values @ self.closure.T + self.winding])
            edges = np.concatenate([edges / 2, 0.5 + edges[1:] / 2])
        period = float(rest[0]) if mesh.own else self.orbit_period(params)
        return mesh.degree, edges, values, period

    @cached_property
    def quadrature(self) -> Array:
        """(N, mn) weights of the inner product at the stages."""
        return self.mesh.quadrature(self.scales)

    @cached_property
    def raised_weights(self) -> Array:
        """`weights` on the mesh of degree m + 1."""
        higher = self.mesh.raised
        nodes = np.zeros((higher.intervals + 1, higher.n))
        return higher.join(nodes, higher.quadrature(self.scales), self.period_scale**-2)

    @cached_property
    def weights(self) -> Array:
        """(N,) of the inner product: zero at the nodes."""
        nodes = np.zeros((self.mesh.intervals + 1, self.mesh.n))
        return self.mesh.join(nodes, self.quadrature, self.period_scale**-2)

    def __repr__(self) -> str:
        periods = f", {self.multiple} forcing periods" if self.multiple > 1 else ""
        return f"Collocation of '{self.system.name}', {self._size_in_words}{periods}"

    def rescaled(self, scales: Array, period_scale: float) -> Collocation:
        """The same problem on the same mesh with other scales."""
        own = {k: v for k, v in vars(self).items() if k not in ("weights", "quadrature", "raised_weights")}
        scales = np.array(scales, float)
        scales.setflags(write=False)
        new: Collocation = object.__new__(type(self))
        vars(new).update(own, scales=scales, period_scale=float(period_scale), _memo={})
        carried_to(self, new)
        return new

    @property
    def _size_in_words(self) -> str:
        return f"{self.mesh.intervals} intervals of degree {self.degree}"

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data from which `from_spec` makes an equal problem."""
        own = {
            "problem": "Collocation",
            "degree": self.degree,
            "intervals": self.intervals,
            "multiple": self.multiple,
            "winding": self.winding.tolist(),
            "symmetry": self.closure.tolist() if self.halved else None,
            "accuracy": self.accuracy,
            "adaptive": self.adaptive,
            "edges": self.edges.tolist(),
            "scales": self.scales.tolist(),
            "period_scale": self.period_scale,
            "automatic": self.automatic,
            "mirror": None if self.mirror is None else self.mirror.plain,
        }
        if self.system.function is not None:
            return {**own, "view_only": True}
        return {**own, "system": self.system.to_dict()}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> Collocation:
        """The problem of a stored description."""
        from ..systems.system import System

        fields = {k: v for k, v in spec.items() if k not in ("problem", "system")}
        return cls(System.from_dict(spec["system"]), **fields)

    # ------------------------------------------------------------------ the Newton solve
    def correct(
        self, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
    ) -> Corrected:
        """The bordered Newton solve of `protocols.Problem`, in one compiled call."""
        return self.newton(self.mesh, u, params, self.index(free), tangent, ds, tolerance, None)

    def newton(
        self, mesh: OrbitMesh, u: Array, params: Array, index: int, tangent: Tangent | None, ds: float,
        tolerance: float, limit: int | None,
    ) -> Corrected:  # fmt: skip
        """`correct` on any mesh, at most `limit` iterations; its linearisation is a bare Workspace off the own mesh."""
        u, params = np.array(u, float), np.array(params, float)
        nodes, stages, _ = mesh.split(u)
        work = Workspace(mesh, len(params), len(self.kept), False)
        arc, t, t_l, weight = 0, u, 0.0, 0.0
        if tangent is not None:
            arc, t, t_l, weight = 1, _plain(tangent.u), float(tangent.parameter), float(tangent.weight)
        weights, stage_weights = self.weights, self.quadrature
        if mesh is not self.mesh:
            weights, stage_weights = self.raised_weights, mesh.split(self.raised_weights)[1]
        rule = mesh.rule
        x, report = np.empty((2, mesh.size + arc)), np.empty(4)
        status = kernels.newton(
            kernels.solvers(), self.flow.address, self.flow.period_address, mesh.span, mesh.phase, mesh.h,
            rule.inverse, rule.matrix, rule.row_sums, rule.update, self.kept,
            self.position, self.closure, self.winding, self.scales, weights, stage_weights, params, index, u,
            nodes, stages, work.T, arc, t, mesh.split(t)[1], t_l, weight, float(ds), float(tolerance),
            limit or _MAX_ITERATIONS[arc], work.F, work.J, work.Fp, work.dT, work.LU, work.pivots, work.Z, work.M, x,
            report,
        )  # fmt: skip
        _, iterations, residual, sign = report.tolist()
        if status != kernels.CONVERGED:
            note = _NOTES.get(status) or self._not_finite(mesh, work)
            return Corrected(u, params, None, residual, int(iterations), 0, None, False, note)
        direction = x[1, : mesh.size]
        new = Tangent(direction, 1.0, 1.0)
        if arc:
            size = math.sqrt(float((weights * direction).dot(direction)) + (weight * float(x[1, -1])) ** 2)
            new = Tangent(direction / size, float(x[1, -1]) / size, weight)
        linearisation: Any = work
        if mesh is self.mesh:
            correction = (x[0, : mesh.size], float(x[0, -1]) if arc else 0.0, index)
            linearisation = CollocationLinearisation(self, u, params, work, sign, correction)
            if arc:
                self._memo["tangent"] = (u, index, new)
        return Corrected(u, params, new, residual, int(iterations), int(sign), linearisation, True)

    def strides(self, ahead: Stretch) -> Iterator[Stride]:
        """Several steps in one compiled call; see `protocols.StridingProblem`."""
        return strides(self, ahead)

    def _not_finite(self, mesh: OrbitMesh, work: Workspace) -> str:
        bad, why = np.argwhere(~np.isfinite(work.F)), self.evaluations.failure()
        if not len(bad):
            return f"not finite: a derivative or the solution{why}"
        point, state = bad[0]
        where = mesh.phase[point] if not mesh.own else mesh.points.ravel()[point]
        return f"not finite: state {self.system.states[state]} at phase {where:.3g}{why}"

    def linearise(self, u: Array, params: Array) -> CollocationLinearisation:
        """The linearisation at (u, params)."""
        u, params = np.array(u, float), np.array(params, float)
        nodes, stages, rest = self.mesh.split(u)
        work, _, sign = self._condensed(self.mesh, nodes, stages, rest, params, False)
        if sign == 0.0:
            work.M[:], work.Z[:] = np.nan, np.nan
        return CollocationLinearisation(self, u, params, work, sign)

    def _condensed(
        self, mesh: OrbitMesh, nodes: Array, stages: Array, rest: Array, params: Array, correct: bool
    ) -> tuple[Workspace, Array, float]:
        """(arrays, G^-1 stage residuals where `correct`, sign) of one evaluation and elimination; sign 0: failed."""
        rule, work = mesh.rule, Workspace(mesh, len(params), len(self.kept), True)
        work.T[:] = rest if mesh.own else 0.0
        stage, node = np.empty_like(stages), np.empty_like(nodes)
        residual, sigma = kernels.evaluate(
            self.flow.address, self.flow.period_address, mesh.span, mesh.phase, mesh.h, rule.inverse, rule.update,
            self.closure, self.winding, self.scales, params, _plain(nodes), stages, work.T, work.F, work.J, work.Fp,
            work.dT, stage, node,
        )  # fmt: skip
        if not (residual < np.inf and np.isfinite(work.J).all()):
            return work, stage, 0.0
        columns = stage[:, :, None].copy() if correct else np.empty((*stage.shape, 0))
        sign = kernels.condense(
            rule.inverse, rule.matrix, rule.row_sums, rule.update, mesh.h, sigma, work.J, self.kept, self.position,
            columns, work.LU, work.pivots, work.Z, work.M,
        )  # fmt: skip
        return work, columns[:, :, 0] if correct else stage, float(sign)

    # ------------------------------------------------------------------ meshes and doubled orbits
    def adapt(
        self, u: Array, params: Array, tangent: Tangent | None
    ) -> tuple[Collocation, Array, Any] | None:
        """A better mesh or better scales (see `orbit_adaption`), or None."""
        return adapted(self, u, params, tangent)

    def doubled(self, u: Array, params: Array, vector: Array) -> tuple[Collocation, Array, Array]:
        """The problem of twice the period, the orbit run through twice, and the direction (v(s), -v(s)).

        On half of a period N v = -v breaks the symmetry: the problem of the whole period, not of twice of it.
        """
        if self.halved:
            return broken(self, u, params, vector)
        symmetric = symmetric_doubled(self, u, params, vector) if self.automatic else None
        return symmetric or doubled_problem(self, u, params, vector)

    # ------------------------------------------------------------------ spectrum and error
    def error(self, u: Array, params: Array) -> float:
        """Largest error of nodes and period over their scales, by degree m + 1 and past kinks; inf: unknown."""
        found = passage(self, u, params)
        return max(node_error(self, u, params), 0.0 if found is None else found.nodes)

    def spectrum(self, linearisation: Any) -> Spectrum:
        """Multipliers, their error, counts, verdict.

        The error is that by degree m + 1, the trivial multiplier's distance from 1, Liouville's gap and, past kinks,
        twice the distance from multipliers by integration (`collocation_kinks`) together.
        """
        return collocation_spectrum(self, linearisation)

    @cached_property
    def kinked(self) -> bool:
        """Whether the equations have kinks that an orbit may pass."""
        return has_switches(self.system)

    @cached_property
    def orientation(self) -> float:
        """Sign of det S."""
        return math.copysign(1.0, float(np.linalg.det(self.closure)))

    def spectral_of(self, product: Array) -> Array:
        """M of the fundamental matrix Phi."""
        if self.halved:
            product = self.closure @ product  # S^-1 = S
        return np.asarray(product * self.scales / self.scales[:, None])

    def direction_of_flow(self, linearisation: CollocationLinearisation) -> Array:
        """f at phase zero over the scales: the direction of the trivial multiplier."""
        start = self.mesh.split(linearisation.u)[0][:1]
        value = self.evaluations.F(None, np.ascontiguousarray(start), linearisation.params)[0]
        return np.asarray(value / self.scales)
