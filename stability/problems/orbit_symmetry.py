r"""Symmetric periodic orbits: solved on half of their period, unfolded, broken, and mirrored.

With a symmetry f(t + sigma T, S x) = S f(t, x) (systems/symmetries.py) an orbit of period P may satisfy
x(t + P/2) = S x(t) + w; forced, P = k T, this needs sigma = k/2 modulo 1. It solves a boundary value problem on
[0, P/2], and its stability follows from the half-period map,

    N = S^-1 Phi(P/2),     N^2 = Phi(P) up to a change of basis:
    nu = +1 of N: fold (or a crossing of symmetric branches);   nu = -1: loss of the symmetry, a pitchfork;
    a pair exp(+-i theta): torus;   a pair +-i: a double -1 of the whole period.

At nu = -1 the multiplier of the whole period is +1, and two branches of orbits without the symmetry are born, images of
one another: N v = -v gives the direction V(s) on the first half, -S V(s) on the second. The orbit is unfolded on a mesh
that is the same in both halves, so that the discrete problem has the pitchfork exactly. Along the new branch the mesh
keeps a knot at the middle, so that the image y(t) = S x(t - P/2) of a discrete solution is one on the turned mesh: it
is written down, not computed. Where x(t) = S x(t) at every time (a hanging pendulum) the image is S x(t).

Period doubling never happens to such orbits unless a pair of N passes +-i. Reference: Swift and Wiesenfeld (1984),
Phys. Rev. Lett. 52, 705; Golubitsky, Stewart, Schaeffer (1988), chapter XVI.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..kernels.gauss import lagrange_matrix
from ..systems.symmetries import Symmetry, verified

if TYPE_CHECKING:
    from .collocation import Collocation

__all__ = [
    "Mirror", "broken", "chosen", "invariances", "mirrored", "mirrored_problem", "on_half", "symmetric_doubled",
    "turned", "turned_equilibrium",
]  # fmt: skip

Array = np.ndarray
_INVARIANT = 1e-5  # largest part of the scales by which an orbit may differ from its image and be its own
_ALONG = 1e-3  # the same for directions, which are known less well


class Mirror(NamedTuple):
    """How the orbits of a family are mapped to their images: y(t) = S x(t - fraction P), fraction 0 or 1/2."""

    symmetry: Symmetry
    fraction: float

    @property
    def plain(self) -> list[Any]:
        """As JSON data; ``Mirror.of`` reads it."""
        return [dict(self.symmetry.images), self.symmetry.shift, self.fraction]

    @classmethod
    def of(cls, given: Any) -> Mirror | None:
        """From None, a Mirror, or plain data."""
        if given is None or isinstance(given, Mirror):
            return given
        images, shift, fraction = given
        return cls(Symmetry(images, float(shift)), float(fraction))


# ---------------------------------------------------------------------- which symmetry
def _usable(system: Any) -> list[Symmetry]:
    """Those that are declared, or proved from the equations."""
    declared = set(system.declared_symmetries)
    return [s for s in system.symmetries if s.proved or s in declared]


def _shift_of_half(multiple: int) -> float:
    """sigma = k/2 modulo 1."""
    return 0.5 * (multiple % 2)


def chosen(system: Any, given: Any, multiple: int) -> Symmetry | None:
    """The symmetry S of x(t + P/2) = S x(t), verified: from a Symmetry, a mapping, a matrix, "auto" or None.

    Raises
    ------
    InputError
        It shifts time by another fraction than orbits of so many periods need; no signed permutation.
    EquationError
        The equations do not have it.
    """
    forced = system.period_expression is not None
    shift = _shift_of_half(multiple) if forced else 0.0
    if given is None:
        return None
    if isinstance(given, str):
        if given != "auto":
            raise InputError(f"symmetry = {given!r}: give a Symmetry, a mapping such as {{'u': '-u'}}, 'auto' or None")
        fitting = [s for s in _usable(system) if s.shift == shift]
        return min(fitting, key=lambda s: float(np.trace(s.matrix)), default=None)
    if isinstance(given, Mapping):
        given = Symmetry(given, shift)  # type: ignore[arg-type]
    elif not isinstance(given, Symmetry):
        given = _from_matrix(system.states, given, shift)
    if given.shift != shift:
        half = "half a" if shift else "no"
        raise InputError(
            f"{given!r}: half of {multiple} forcing period(s) goes with a symmetry that has {half} period of shift, "
            f"shift={shift:g}"
        )
    return verified(system, Symmetry(given.images, given.shift))


def _from_matrix(states: tuple[str, ...], given: Any, shift: float) -> Symmetry:
    matrix, n = np.array(given, float), len(states)
    signed = matrix.shape == (n, n) and np.abs(matrix).sum() == n and (np.abs(matrix).max(axis=1) == 1).all()
    if not signed:
        raise InputError(f"symmetry must be a signed permutation of {n} states, S S = I; got {given!r}")
    places = np.abs(matrix).argmax(axis=1)
    images = tuple((s, f"{'-' if matrix[i, k] < 0 else ''}{states[k]}") for i, (s, k) in enumerate(zip(states, places)))
    return Symmetry(images, shift)


# ---------------------------------------------------------------------- orbits and their images
def _sampled(problem: Collocation, u: Array, s: Array) -> Array:
    """(K, n) values at points s of the problem's own span."""
    mesh = problem.mesh
    nodes, stages, _ = mesh.split(u)
    piece = np.clip(np.searchsorted(mesh.edges, s, side="right") - 1, 0, mesh.intervals - 1)
    basis = lagrange_matrix(mesh.rule.abscissae, (s - mesh.edges[piece]) / mesh.h[piece])[:, None, :]
    return np.asarray((basis @ mesh.polynomial(nodes, stages)[piece])[:, 0])


def _gap(problem: Collocation, u: Array, mirror: Mirror, sign: float) -> float:
    """Largest difference of u and `sign` times its image, over the scales."""
    S = mirror.symmetry.matrix
    s = np.linspace(0.0, 0.5, 26) if mirror.fraction else np.linspace(0.0, 1.0, 51)
    one, other = _sampled(problem, u, s), _sampled(problem, u, s + mirror.fraction)
    return float(np.abs((sign * other - one @ S.T) / problem.scales).max())


def invariances(problem: Collocation, u: Array) -> list[Mirror]:
    """The symmetries of the system that map an orbit (solved on its whole period) to itself."""
    if problem.halved or problem.winding.any():
        return []
    half = _shift_of_half(problem.multiple)
    found = []
    for symmetry in _usable(problem.system):
        for fraction in (0.0, 0.5):
            if problem.mesh.own or symmetry.shift == (half if fraction else 0.0):
                mirror = Mirror(symmetry, fraction)
                if _gap(problem, u, mirror, 1.0) < _INVARIANT:
                    found.append(mirror)
    return found


def turned(problem: Collocation, u: Array, direction: Array) -> Mirror | None:
    """The symmetry of an orbit that a direction loses, d -> -d: at a pitchfork; None where there is none."""
    length = float(np.sqrt(problem.weights @ np.square(direction)))
    if not length > 0:
        return None
    for mirror in invariances(problem, u):
        if _gap(problem, direction / length, mirror, -1.0) < _ALONG:
            return mirror
    return None


def turned_equilibrium(problem: Any, u: Array, direction: Array) -> Mirror | None:
    """The same for an equilibrium u (n,) and a direction: S u = u, S d = -d."""
    size = float(np.abs(direction / problem.scales).max()) or 1.0
    for symmetry in _usable(problem.system):
        S = symmetry.matrix
        still = np.abs((S @ u - u) / problem.scales).max() < _INVARIANT
        if still and np.abs((S @ direction + direction) / problem.scales).max() < _ALONG * size:
            return Mirror(symmetry, 0.0)
    return None


def on_half(problem: Collocation, u: Array, symmetry: Symmetry) -> tuple[Collocation, Array]:
    """A symmetric orbit known on its whole period as a problem on half of it, and its unknowns (to be corrected)."""
    edges = problem.mesh.edges
    half = np.append(edges[edges < 0.5 - 1e-9], 0.5) * 2
    new = dataclasses.replace(
        problem, symmetry=symmetry, edges=half, intervals=max(1, problem.intervals // 2), mirror=None, _memo={}
    )
    period = float(u[-1]) if problem.mesh.own else 0.0
    return new, new.packed(_sampled(problem, u, new.places / 2), period)


def broken(problem: Collocation, u: Array, params: Array, vector: Array) -> tuple[Collocation, Array, Array]:
    """Loss of the symmetry, N v = -v: the problem of the whole period, the orbit unfolded, the direction (V, -S V)."""
    mesh, S, w = problem.mesh, problem.closure, problem.winding
    symmetry: Symmetry = problem.symmetry
    new = dataclasses.replace(
        problem, symmetry=None, mirror=None if w.any() else Mirror(symmetry, 0.5), intervals=2 * problem.intervals,
        edges=np.concatenate([mesh.edges / 2, 0.5 + mesh.edges[1:] / 2]), winding=problem.whole_winding, _memo={},
    )  # fmt: skip
    nodes, stages, rest = mesh.split(u)
    whole = _joined(problem, new, nodes, stages, S, w, rest)
    linearisation = problem.linearise(u, params)
    lifted = linearisation.lift(np.concatenate([vector, np.zeros(mesh.own)]))
    dn, ds, _ = mesh.split(lifted)
    return new, whole, _joined(problem, new, dn, ds, -S, np.zeros(mesh.n), 0.0)


def _joined(
    problem: Collocation, new: Collocation, nodes: Array, stages: Array, S: Array, w: Array, rest: Array | float
) -> Array:
    """u on the whole period from its first half x and its second S x + w."""
    mesh = problem.mesh
    other = (stages.reshape(mesh.intervals, mesh.degree, mesh.n) @ S.T + w).reshape(stages.shape)
    return new.mesh.join(np.concatenate([nodes, nodes[1:] @ S.T + w]), np.concatenate([stages, other]), rest)


def symmetric_doubled(problem: Collocation, u: Array, params: Array, vector: Array) -> tuple[Any, Array, Array] | None:
    """A period doubling whose orbits have x(t + P) = S x(t): on the old period, where S x = x and S v = -v; else None.

    The doubled orbit begins as the old one and M v = -v: its half is the old period, its mesh the old mesh.
    """
    fitting = [m.symmetry for m in invariances(problem, u) if m.fraction == 0.0]
    linearisation = problem.linearise(u, params)
    lifted = linearisation.lift(np.concatenate([vector, np.zeros(problem.mesh.own)]))
    length = float(np.sqrt(problem.weights @ lifted**2)) or 1.0
    for symmetry in fitting:
        if _gap(problem, lifted / length, Mirror(symmetry, 0.0), -1.0) >= _ALONG:
            continue
        own = problem.mesh.own
        new = dataclasses.replace(
            problem, multiple=1 if own else 2 * problem.multiple, symmetry=symmetry, mirror=None,
            period_scale=2 * problem.period_scale if own else 1.0, _memo={},
        )  # fmt: skip
        whole = np.array(u)
        if own:
            whole[-1] *= 2
        return new, whole, lifted
    return None


# ---------------------------------------------------------------------- images of a discrete solution
def mirrored_problem(problem: Any) -> Any:
    """The problem whose unknowns are the images of this one's (see `Collocation.mirror`)."""
    mirror: Mirror = problem.mirror
    edges, S = problem.mesh.edges, mirror.symmetry.matrix
    if mirror.fraction:
        k = _middle(problem)
        edges = np.concatenate([edges[k:-1] - 0.5, edges[: k + 1] + 0.5])
        edges[0], edges[-1] = 0.0, 1.0
    return dataclasses.replace(problem, edges=edges, scales=np.abs(S) @ problem.scales, _memo={})


def mirrored(problem: Any, u: Array) -> Array:
    """The image of unknowns, or of a direction in them, in the layout of `mirrored_problem`."""
    mirror: Mirror = problem.mirror
    mesh, S = problem.mesh, mirror.symmetry.matrix
    nodes, stages, rest = mesh.split(u)
    nodes = nodes @ S.T
    stages = (stages.reshape(mesh.intervals, mesh.degree, mesh.n) @ S.T).reshape(stages.shape)
    if mirror.fraction:
        k = _middle(problem)
        nodes, stages = np.concatenate([nodes[k:-1], nodes[: k + 1]]), np.roll(stages, -k, axis=0)
    return mesh.join(nodes, stages, rest)


def _middle(problem: Any) -> int:
    """The knot at s = 1/2, which the mesh of such a problem has."""
    return int(np.argmin(np.abs(problem.mesh.edges - 0.5)))
