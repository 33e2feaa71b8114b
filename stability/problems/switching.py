r"""`switch`: from a special point to the branch that is born there.

At a simple branch point the null space of [F_u, F_lambda] has two directions; solutions along a z_1 + b z_2 exist if

    c_11 a^2 + 2 c_12 a b + c_22 b^2 = 0,      c_ij = w^T D^2F [z_i, z_j],     w^T [F_u, F_lambda] = 0.

With z_1 the tangent of the old branch, c_11 = 0 and the other root is (a, b) = (-c_22, 2 c_12). At a Hopf point the
orbits x_0 + eps Re(q exp(i omega t)) + O(eps^2) of period 2 pi / omega are born (J q = i omega q); at a period doubling
(M v = -v) the orbit run twice, displaced by eps v(t) in the first and -eps v(t) in the second turn. Both have a second
half that is the same family shifted in time. References: Keller (1977); Kuznetsov (2004), 10.2-10.3.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..protocols import OrbitProblem, Seed
from ..results.revival import revive
from ..results.special import SpecialPoint
from ..words import Kind
from .breaking import pitchfork

__all__ = ["Born", "null_directions", "switch"]

Array = NDArray[np.float64]
_SAMPLES = 64


@dataclass(frozen=True, eq=False)
class Born:
    """A problem with a seed: the driver follows ``seed().problem`` from the birth point on."""

    inner: Any
    first: Seed

    def seed(self) -> Seed:
        """Where the branch is born and where it goes."""
        return self.first

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in ("inner", "first"):
            raise AttributeError(name)
        return getattr(self.inner, name)

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data; `from_spec` is the inverse."""
        seed = self.first
        fields: dict[str, Any] = {k: np.asarray(getattr(seed, k)).tolist() for k in ("u", "params", "tangent")}
        fields |= {"parameter": seed.parameter, "sides": seed.sides, "kind": str(seed.kind), "free": seed.free}
        fields["mirror"] = seed.mirror
        avoid = None if seed.avoid is None else [seed.avoid[0].tolist(), seed.avoid[1]]
        return {"problem": "Born", "inner": dict(self.inner.spec), "seed": {**fields, "avoid": avoid}}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> Born:
        """The problem that `spec` describes."""
        inner, fields = revive(spec["inner"]), dict(spec["seed"])
        for key in ("u", "params", "tangent"):
            fields[key] = np.array(fields[key], dtype=float)
        if fields["avoid"] is not None:
            fields["avoid"] = (np.array(fields["avoid"][0]), float(fields["avoid"][1]))
        return cls(inner, Seed(**{**fields, "problem": inner, "kind": Kind(fields["kind"])}))

    def __repr__(self) -> str:
        return f"{type(self.inner).__name__} born at {self.first.kind}"


def switch(point: SpecialPoint) -> Born:
    """The problem of the new branch at a branch, Hopf, period-doubling or grazing point; give it to `continuation`.

    Parameters
    ----------
    point : SpecialPoint
        Of a branch, also of a loaded one. The new branch is continued in the same parameter.

    Returns
    -------
    Born
        A branch point gives both halves of the crossing branch, joined (where they are images of each other under a
        symmetry of the system, ``point.symmetry_breaking``, the second is written down from the first); a Hopf point
        the periodic orbits (by `Collocation`); a period doubling the orbits of twice the period; a grazing point the
        orbits with one impact more, or one less.

    Raises
    ------
    InputError
        Nothing is born at a point of this kind (a fold: the branch goes on by itself; a Neimark-Sacker point: a torus,
        which is not a periodic orbit: simulate it, or follow the Hopf point of the averaged system).

    Examples
    --------
    >>> import stability as st
    >>> trivial = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (0.0, 30.0))
    >>> st.continuation(st.switch(trivial["BP1"]), "rho", (0.0, 30.0)).labels
    ('HB1', 'BP1', 'HB2')
    """
    if not isinstance(point, SpecialPoint):
        raise InputError(f"switch needs a special point such as branch['BP1'], got {type(point).__name__}")
    if point.kind is Kind.BRANCH_POINT:
        seed = pitchfork(point)
        return _crossing_branch(point) if seed is None else Born(seed.problem, seed)
    if point.kind is Kind.HOPF:
        return _orbits(point)
    if point.kind is Kind.PERIOD_DOUBLING:
        return _doubled(point)
    if point.kind is Kind.GRAZING:
        return _beyond_grazing(point)
    advice = {
        Kind.FOLD: "at a fold the branch turns and goes on by itself",
        Kind.NEIMARK_SACKER: "a torus is born there, which is no periodic orbit: simulate it, or follow the Hopf point "
        "of the averaged system",
    }
    known = "only branch points, Hopf points, period doublings and grazing points give birth to branches"
    raise InputError(f"{point.label} is a {point.kind} point: {advice.get(point.kind, known)}")


def null_directions(point: SpecialPoint) -> tuple[tuple[Array, float], tuple[Array, float]]:
    """(old, new): directions (t_u, t_lambda) of the two branches that cross at a branch point, not normalised.

    Raises
    ------
    InputError
        The crossing is not a simple one: the quadratic form does not tell a second direction.
    """
    problem, free = point.problem, point.free
    L = problem.linearise(point.u, point.params_vector)
    A = np.column_stack([L.core, L.core_column(free)])
    left, _, right = np.linalg.svd(A)
    w, V = left[:, -1], right[-2:].T
    k, w_u = list(problem.parameters).index(free), problem.weights
    z = [(np.real(L.lift(v, free)), float(v[-1])) for v in V.T]

    def product(p: tuple[Array, float], q: tuple[Array, float], scale: float) -> float:
        return float(np.dot(w_u * p[0], q[0])) + scale * p[1] * q[1]

    # a scale that makes the parameter's part of the null vectors comparable with the rest
    own = [product(p, p, 0.0) for p in z]
    rates = [p[1] ** 2 for p in z]
    scale = max(own) / max(rates) if max(rates) > 0 and max(own) > 0 else 1.0
    old = (np.array(point.direction), float(point.rate))
    gram = np.array([[product(p, q, scale) for q in z] for p in z])
    a = np.linalg.solve(gram, np.array([product(p, old, scale) for p in z]))
    b = np.linalg.solve(gram, np.array([-a[1], a[0]]))  # any direction independent of a, made orthogonal
    b = b - a * (a @ gram @ b) / (a @ gram @ a)
    pair = [(sum(c * p[0] for c, p in zip(q, z)), float(sum(c * p[1] for c, p in zip(q, z)))) for q in (a, b)]
    gradient_u, gradient_p = L.core_gradient(w, V @ b, free)
    c12, c22 = (float(np.real(gradient_u @ d[0] + gradient_p[k] * d[1])) for d in pair)
    size_1, size_2 = math.sqrt(product(pair[0], pair[0], scale)), math.sqrt(product(pair[1], pair[1], scale))
    if abs(c12) * size_2 * 1e7 < abs(c22) * size_1 or c12 == 0:
        raise InputError(f"{point.label} is not a simple branch point: its crossing directions are not distinct")
    new = (2 * c12 * pair[1][0] - c22 * pair[0][0], 2 * c12 * pair[1][1] - c22 * pair[0][1])
    size = math.sqrt(product(new, new, scale))
    return pair[0], (new[0] / size, new[1] / size)


def _crossing_branch(point: SpecialPoint) -> Born:
    old, new = null_directions(point)
    problem = point.problem
    if getattr(problem, "following", False):
        problem = dataclasses.replace(problem, fresh=True)  # the new branch has its own scales
    seed = Seed(problem, np.array(point.u), point.params_vector, new[0], new[1], 2, point.kind, point.free, old)
    return Born(problem, seed)


def _orbits(point: SpecialPoint) -> Born:
    from .collocation import Collocation

    system = point.problem.system
    x0, params = np.array(point.solution.x), point.params_vector
    linearisation = point.problem.linearise(point.u, params)
    values, vectors = np.linalg.eig(linearisation.J)
    upper = np.nonzero(values.imag > 0)[0]
    critical = upper[int(np.argmin(np.abs(values[upper].real)))]
    omega, q = float(values[critical].imag), vectors[:, critical]
    problem = Collocation(system)
    period = 2 * math.pi / omega
    times = np.arange(_SAMPLES) * (period / _SAMPLES)
    still = np.repeat(x0[:, None], _SAMPLES, axis=1)
    wave = np.real(q[:, None] * np.exp(1j * omega * times))
    u = problem.discretise(times, still, period)
    tangent = problem.discretise(times, still + wave, period) - u
    named = {**problem.parameters, **point.params}
    vector = np.array([named[name] for name in problem.parameters])
    return Born(problem, Seed(problem, u, vector, tangent, 0.0, 1, point.kind, point.free))


def _doubled(point: SpecialPoint) -> Born:
    problem = point.problem
    if not isinstance(problem, OrbitProblem):
        raise InputError(
            f"{type(problem).__name__} cannot double a period: follow the orbit with Collocation and switch there"
        )
    params = point.params_vector
    M = problem.linearise(point.u, params).spectral
    vector = np.linalg.svd(M + np.eye(M.shape[0]))[2][-1]
    twice, u, tangent = problem.doubled(point.u, params, vector)
    return Born(twice, Seed(twice, u, params, tangent, 0.0, 1, point.kind, point.free))


def _beyond_grazing(point: SpecialPoint) -> Born:
    """One impact more (or less) than on the old branch: the orbits on whose side the new clearance is positive."""
    params, free = point.params_vector, point.free
    problem, u = point.problem.beyond(point.u, params)
    found = problem.correct(u, params, free, None, 0.0, 1e-10)
    if not found.converged or found.tangent is None:
        raise InputError(f"{point.label} is degenerate: no orbits with one impact more or less were found beside it")
    k = list(problem.parameters).index(free)
    weights, slope = problem.weights, found.tangent.u
    step = 1e-4 / math.sqrt(float(weights @ slope**2) + 1e-300)
    clear = []
    for side in (1.0, -1.0):
        moved = found.params.copy()
        moved[k] += side * step
        clear.append(problem.clearance(found.u + side * step * slope, moved))
    side = 1.0 if clear[0] > clear[1] else -1.0
    return Born(problem, Seed(problem, found.u, found.params, side * slope, side, 0, point.kind, free))
