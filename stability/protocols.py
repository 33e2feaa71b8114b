r"""What the driver knows of a problem: one page of mathematics with array sizes.

A problem is a square system with a curve of zeros

    F(u, p) = 0,     F : R^N x R^m -> R^N,     lambda = p[free] is the continued parameter,

and its spectral matrix M(u, p) (n, n): the Jacobian of an equilibrium, the monodromy matrix of a periodic orbit, a
Hill matrix. u (N,) is the problem's own layout (nodes and stages of a mesh, Fourier coefficients, a period among
them), p (m,) float in the order of ``parameters``. The tangent t = (t_u, t_lambda) of the curve satisfies

    F_u t_u + F_lambda t_lambda = 0,     <t, t> = 1,
    <(u, l), (v, k)> = sum_i weights_i u_i v_i  +  weight^2 l k      (a time integral plus the parameter's part).

``weights`` (N,) >= 0 are quadrature weights over squared scales (zero entries allowed: unknowns that other ones
determine); they make the inner product independent of the mesh and of units. ``weight`` is 1 / (scale of lambda),
chosen by the driver and carried by the `Tangent`.

**One call is a whole Newton solve.** `Problem.correct` solves, from (u + ds t_u, lambda + ds t_lambda),

    F(u', p') = 0,     <t, (u', lambda') - (u, lambda)> = ds          (pseudo-arclength), or
    F(u', p') = 0,     lambda' = lambda                               (tangent None).

With ds = 0 any predicted point may be given: the correction is then orthogonal to t. A phase condition takes the
*given* u as its reference orbit.

**Small core.** F_u may be huge but structured; eliminating the inner unknowns leaves a dense Schur complement
S(u, p) (k, k), singular exactly when F_u is, and s_lambda (k,), the same reduction of F_lambda. Equilibria: S = F_u,
s = F_lambda, k = n. Forced orbits: S = M - I, k = n. Autonomous orbits: k = n + 1 (state at phase zero, period). The
defining systems of fold and branch point are built from S, those of period doubling, Neimark-Sacker and Hopf from M,
and their Newton steps need only first derivatives of scalars w^T S v and w^T M v (`core_gradient`,
`spectral_gradient`) and the bordered solve. References: Kuznetsov, *Elements of Applied Bifurcation Theory* (2004),
10.2-10.3; Govaerts, *Numerical Methods for Bifurcations of Dynamical Equilibria* (2000), chapters 3-5.

Vectors w, v may be complex; all products are bilinear (transpose, never conjugate).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from .words import Kind, Verdict

__all__ = [
    "Corrected",
    "Critical",
    "Linearisation",
    "OrbitProblem",
    "Problem",
    "Seed",
    "Spectrum",
    "Stretch",
    "Stride",
    "StridingProblem",
    "Tangent",
]

Array = NDArray[np.float64]


class Tangent(NamedTuple):
    """A direction (t_u, t_lambda) of the curve and the weight (1 / scale) of the parameter in its inner product."""

    u: Array  # (N,)
    parameter: float
    weight: float


class Corrected(NamedTuple):
    """What a bordered Newton solve found; all but `iterations` and `note` are meaningful only when `converged`.

    `tangent` is the new one, normalised, <t_new, t_given> > 0; where none was given it is (du/dlambda, 1, weight 1.0),
    not normalised (the driver does it), or None if F_u is singular. `determinant_sign` is that of
    [[F_u, F_lambda], [t^T]] with the new tangent (none given: of F_u); along a branch it changes at branch points only:
    a change of mesh or scale must not flip it, nor an exact fold.
    """

    u: Array  # (N,)
    params: Array  # (m,), a copy with the corrected lambda
    tangent: Tangent | None
    residual: float  # max norm of the scaled F at the point
    iterations: int
    determinant_sign: int
    linearisation: Linearisation | None  # at the last Newton iterate (within the tolerance of u): costs nothing
    converged: bool
    note: str = ""  # why not: "no convergence", "singular", "not finite: state x at phase 0.3"


class Stretch(NamedTuple):
    """What the driver asks of a problem that can take several steps in one call (`StridingProblem`).

    The last point (u, params), its tangent and those before it (latest first, on the same mesh) with the lengths of the
    steps that led to them; spectra, test functions and signs of determinants of it and of the point before, on any
    mesh; `older`: that one's rate of the parameter, and the arclength from it. `length` of the first step to try, at
    most `most` steps, each inside the `window` of the parameter; the mesh is adapted after `rest` of them, and after
    each `every` more, where it needs to be. `limits` (angle, chord, miss, motion), `pace` (longest
    step, far, few, approach, creep) and `watch` (dip, fall, turn) are the driver's constants.
    """

    u: Array
    params: Array
    free: str
    tangents: tuple[Tangent, ...]
    steps: tuple[float, ...]
    spectra: tuple[Spectrum, ...]
    tests: tuple[tuple[float, float, float], ...]
    signs: tuple[int, ...]
    older: tuple[float, float]
    length: float
    most: int
    rest: int
    every: int
    window: tuple[float, float]
    tolerance: float
    limits: tuple[float, float, float, float]
    pace: tuple[float, float, float, float, float]
    watch: tuple[float, float, float]


class Stride(NamedTuple):
    """One plainly good step: the point, the length tried, its distance, and what is left of the limits (at most 1).

    The spectrum and its test functions, where nothing about them is in doubt; quiet: nothing can have happened on the
    way; rests: the mesh need not be adapted now. A stretch ends with a step that is in doubt or not at rest.
    """

    found: Corrected
    tried: float
    distance: float
    angle: float
    chord: float
    missed: float
    motion: float
    following: float  # length to try next
    spectrum: Spectrum | None
    tests: tuple[float, float, float] | None
    quiet: bool
    rests: bool


class Seed(NamedTuple):
    """A solution at which a new branch is born, and where it goes from there."""

    problem: Problem  # the problem to follow
    u: Array  # (N,) the birth point
    params: Array  # (m,)
    tangent: Array  # (N,) u-part of the direction of the new branch
    parameter: float  # parameter's part of the direction (0 for pitchfork, Hopf and period doubling)
    sides: int  # 0: this direction only; 1: the other half is the same shifted in time; 2: both are followed and joined
    kind: Kind  # of the point it is born at
    free: str  # the parameter along which that point was found
    avoid: tuple[Array, float] | None = None  # direction of the old branch: the first step is taken orthogonally to it
    mirror: bool = False  # with sides = 2: the other half is the image of the first, `problem.image(u)`


class Spectrum(NamedTuple):
    """Multipliers or eigenvalues without the trivial ones, integer counts, and the verdict they support."""

    values: NDArray[np.complex128]  # (n',) multipliers by descending modulus; eigenvalues by descending real part
    error: float  # absolute error estimate of the values near the stability limit
    unstable: int  # |mu| > 1, or Re > 0
    beyond_plus: int  # real mu > +1, or real eigenvalue > 0
    beyond_minus: int  # real mu < -1; always 0 for eigenvalues
    pairs: int  # complex pairs outside
    verdict: Verdict


class Critical(NamedTuple):
    """How values leave the stable region, hence which defining systems apply to a problem.

    ``circle`` True: multipliers; a pair leaves at exp(+-i theta), M^2 - 2 c M + I singular, unknown c = cos(theta).
    ``circle`` False: eigenvalues; a pair leaves at +-i omega, M^2 + kappa I singular, unknown kappa = omega^2.
    ``pair`` is the kind of a leaving pair (HOPF or NEIMARK_SACKER; None if it has no meaning here), ``minus`` the value
    that is critical for period doubling (-1 for multipliers, a complex shift for Hill matrices, None if impossible).
    """

    circle: bool
    pair: Kind | None
    minus: complex | None


@runtime_checkable
class Linearisation(Protocol):
    """F, F_u and the spectral data at one point (u, p); lazy: nothing is computed before it is asked for."""

    @property
    def residual(self) -> Array:
        """F(u, p), (N,)."""

    @property
    def spectral(self) -> Array:
        """M(u, p), (n, n)."""

    @property
    def core(self) -> Array:
        """S(u, p), (k, k): Schur complement of F_u on the core equations and core unknowns."""

    def column(self, name: str) -> Array:
        """dF/dp_name, (N,)."""

    def core_column(self, name: str) -> Array:
        """s_name, (k,): the same reduction of dF/dp_name, so that det [[F_u, F_l], [0, 1]]-type borders reduce too."""

    def solve(self, rows: Array, columns: Array, corner: Array, right_sides: Array) -> Array:
        """Solve [[F_u, columns], [rows, corner]] x = right_sides.

        columns (N, q), rows (q, N), corner (q, q), right_sides (N + q, r) -> (N + q, r); q = 0 is allowed. The bordered
        matrix is regular where F_u alone is not. A singular one gives non-finite numbers, not an exception.
        """

    def spectral_gradient(self, w: NDArray[Any], v: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Gradient of w^T M(u, p) v for fixed w, v (n,): with respect to u, (N,), and to p, (m,)."""

    def core_gradient(self, w: NDArray[Any], v: NDArray[Any], free: str) -> tuple[NDArray[Any], NDArray[Any]]:
        """Gradient of w^T [S, s_free] v for fixed w (k,), v (k + 1,): with respect to u, (N,), and to p, (m,)."""

    def embed(self, w: NDArray[Any]) -> NDArray[Any]:
        """(N,): w (k,) placed in the core equations, zero elsewhere (a right side of F)."""

    def lift(self, v: NDArray[Any], free: str | None = None) -> NDArray[Any]:
        """(N,): the unknowns u that belong to core unknowns v (k,) when all inner equations hold.

        A null vector of S becomes the null vector of F_u. With `free`, v is (k + 1,) and its last entry multiplies
        F_free: a null vector of [S, s_free] becomes the u-part of a null vector of [F_u, F_free].
        """


@runtime_checkable
class Problem(Protocol):
    """A zero problem F(u, p) = 0 with a spectrum. Frozen: every change is a new problem."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """Name -> default, in the order of p (m,); the problem's own ("period", "amplitude") included."""

    @property
    def critical(self) -> Critical:
        """Which bifurcations the spectrum can show."""

    @property
    def weights(self) -> Array:
        """(N,) of the inner product; N is the length of the current u."""

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain JSON data, key "problem" = class name, from which ``cls.from_spec(spec)`` makes an equal problem.

        Mesh and scales included. Results keep it, so that `Branch.at`, `switch` and `locus` work after `load`
        (results/revival.py maps the class name to its module).
        """

    def start(self, params: Array, guess: Any = None) -> Array:
        """A first u (N,) near a solution, or InputError / ConvergenceError that says which guess to give.

        guess: None, a state (dict of names, missing ones zero, or array), a FixedPoint or PeriodicOrbit, an array u.
        """

    def seed(self) -> Seed | None:
        """Where the branch is born, for problems made by `switch` or `locus`; None for all others."""

    def correct(
        self, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
    ) -> Corrected:
        """The whole bordered Newton solve (see the head of this file).

        Converged: the last update, in the weighted norm relative to 1 + |u|, is below `tolerance`, and everything is
        finite. Never raises for numerical trouble: `converged` is False and `note` says why.
        """

    def linearise(self, u: Array, params: Array) -> Linearisation:
        """The linearisation at any point, a solution or not."""

    def spectrum(self, linearisation: Any) -> Spectrum:
        """Values without the trivial ones, counts, verdict."""

    def adapt(self, u: Array, params: Array, tangent: Any) -> tuple[Any, Array, Any] | None:
        """A better mesh or scales for this solution, with u and tangent carried over (to be corrected); None: keep.

        The given u itself says that only the scales are new, which leaves solutions and spectra as they are.
        """

    def measures(self, u: Array, params: Array) -> dict[str, float]:
        """Columns of a branch: ``<state>`` or ``<state>.max``, ``.min``, ``.amplitude`` ..., outputs, "period"."""

    def error(self, u: Array, params: Array) -> float:
        """Estimated discretisation error of u (largest state error over the state's scale)."""

    def view(self, u: Array, params: Array) -> Any:
        """What a user sees: FixedPoint or PeriodicOrbit, with spectrum and verdict."""


@runtime_checkable
class StridingProblem(Problem, Protocol):
    """A problem that can take several steps of a branch in one call."""

    def strides(self, ahead: Stretch) -> Iterator[Stride]:
        """The steps that are plainly good, one after the other: predicted, corrected and judged as the driver would.

        It ends before the first step that Newton's method or one of the limits refuses, or that leaves the window; the
        driver then goes on by `correct`. Events between the points are the driver's business.
        """


@runtime_checkable
class OrbitProblem(Problem, Protocol):
    """What `switch` needs of a periodic-orbit problem besides."""

    def doubled(self, u: Array, params: Array, vector: Array) -> tuple[Problem, Array, Array]:
        """Period doubling: (problem of twice the period, its u = the orbit twice, its direction).

        vector (n,): M v = -v; the direction is the variation (v(s), -v(s)) along the doubled orbit, in the layout of u.
        """

    def discretise(self, times: Array, states: Array, period: float) -> Array:
        """u (N,) on the problem's own mesh of the periodic function with samples states (n, K) at times (K,).

        times are equispaced in [0, period); linear in `states` for a fixed period (trigonometric interpolation). For
        autonomous problems the entry of u that is the period gets `period`.
        """
