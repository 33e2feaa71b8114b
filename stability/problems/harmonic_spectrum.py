r"""Stability of a harmonic-balance orbit: Hill's exponents, checked by the monodromy along the corrected orbit.

Two computations that share nothing but the orbit:

* *Hill*: exponents of the truncated system's own Hill matrix. A fold of the truncated system is an eigenvalue zero of
  it, so that counts and folds agree at every H.
* *Monodromy*: the variational equation along the orbit corrected by its missing harmonics (harmonic_truncation),
  integrated by Gauss collocation (kernels/condensation).

The modes of the second, exp(-lambda t) Phi(t) y, cut off after H harmonics, are excellent trial vectors for the first:
with the left ones (rows of their inverse) the two-sided Rayleigh quotient

    lambda = w^T Hill v / w^T v

differs from Hill's eigenvalue by the product of both residuals. Where that bound is not below 1e-8 (1e-5 where all
multipliers are a hundred times as far from the unit circle), a Hill matrix of order up to 140 is solved whole and its
exponents are selected (kernels/hill_matrix); the bound joins the error.
Twice the difference between the two sets of multipliers is the error estimate: truncation of orbit and of modes both. A
verdict that it does not support is UNDETERMINED.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..kernels.fourier import series
from ..kernels.gauss import gauss_rule
from ..kernels.harmonic_stability import condenser, propagate, quotients
from ..kernels.hill_matrix import hill_matrix, koopman_hill, mean_harmonics, selected
from ..protocols import Spectrum
from ..words import Verdict
from .harmonic_layout import slope_of
from .harmonic_truncation import Correction
from .orbit_spectrum import deflated, eigenvalues, orbit_spectrum, spectrum_distance

if TYPE_CHECKING:
    from .harmonic_balance import HarmonicBalance
    from .harmonic_linearisation import HarmonicLinearisation

__all__ = ["HillModes", "Propagation", "checked_spectrum", "hill_modes", "independent_multipliers", "propagated"]

Array = np.ndarray
_DEGREE = 5
_BOUND = 1e-8
_LOOSE, _SHARE = 1e-5, 1e-2  # a larger bound will do where it is a small share of all distances to the unit circle
_WHOLE = 140  # order of the largest Hill matrix that is solved whole at an ordinary point
_FARTHEST = 30.0  # of exponents times T: beyond it a quotient belongs to another mode
_SMALL = 0.3
_LARGEST_TRACE = 700.0  # its exponential is a number still
_APART = 1e-2  # autonomous: nearer multipliers to 1 than this are left to the whole problem


# ---------------------------------------------------------------------- Hill's matrix, whole
@dataclass(frozen=True, eq=False)
class HillModes:
    """The eigenproblem of Hill's matrix, solved whole.

    Attributes
    ----------
    values : (N,);  vectors, inverse : (N, N) complex, all modes and their inverse
    chosen : (n,) indices of the exponents;  multipliers : (n,) complex, exp(lambda T), of the chosen ones
    start : (n, N) states at s = 0 of all modes
    monodromy : (n, n) real, in units of the problem's scales
    certain : whether the strip held exactly n exponents
    """

    values: Array
    vectors: Array
    inverse: Array
    chosen: Array
    multipliers: Array
    start: Array
    monodromy: Array
    certain: bool


def all_products(L: HarmonicLinearisation) -> Array:
    """T(A) (2H + 1, 2H + 1, n, n) of the whole first-order system."""
    layout = L.problem.layout
    out = np.zeros((layout.count, layout.count, layout.n, layout.n))
    out[:, :, layout.rows] = L.products
    places, velocities = layout.pairs
    eye = np.arange(layout.count)
    for coordinate, velocity in zip(layout.unknowns[places].tolist(), velocities.tolist()):
        out[eye, eye, coordinate, velocity] = 1.0
    return out


def hill_modes(L: HarmonicLinearisation) -> HillModes:
    """All modes of the truncated Hill matrix and the real monodromy matrix that the selected ones make."""
    n, D = L.problem.layout.n, L.problem.scales
    matrix = hill_matrix(all_products(L), L.omega)
    if not np.isfinite(matrix).all():
        nothing = np.full((n, n), np.nan)
        empty = np.zeros((0, 0), complex)
        return HillModes(empty[0:0].ravel(), empty, empty, np.zeros(0, int), np.full(n, np.nan), empty, nothing, False)
    values, vectors = np.linalg.eig(matrix)
    values, vectors = values.astype(complex), vectors.astype(complex)
    spread = mean_harmonics(vectors, n)[1]
    chosen, certain = selected(values, spread, L.omega, n)
    with np.errstate(over="ignore"):
        mu = np.exp(values[chosen] * L.period)
    blocks = vectors.reshape(-1, n, len(values))
    start = blocks[0] + blocks[1::2].sum(axis=0)
    try:
        inverse = np.linalg.inv(vectors)
        monodromy = np.real((start[:, chosen] * mu) @ np.linalg.inv(start[:, chosen])) * D / D[:, None]
    except np.linalg.LinAlgError:  # a mode that is not there twice: the monodromy matrix is not to be had this way
        inverse, monodromy = np.full_like(vectors, np.nan), np.full((n, n), np.nan)
    return HillModes(values, vectors, inverse, chosen, mu, start, monodromy, certain)


# ---------------------------------------------------------------------- monodromy along the corrected orbit
class Propagation(NamedTuple):
    """Phi at the starts of S equal intervals (S, n, n), Phi(T) (n, n), f at s = 0 (n,) of an autonomous orbit, and the
    defect of Liouville's formula.
    """

    fundamental: Array
    monodromy: Array
    flow: Any
    defect: float


@lru_cache(maxsize=64)
def _points(harmonics: int, multiple: int) -> tuple[tuple[Array, ...], Array]:
    """(points of the collocation, phases, G and G D of K harmonics, widths) and the analysis of their starts."""
    S = max(16, 2 * harmonics + 2)
    s = ((np.arange(S)[:, None] + gauss_rule(_DEGREE).points) / S).ravel()
    G = series(2 * harmonics + 1, s)
    coarse = series(harmonics, np.arange(S) / S).T * (2.0 / S)
    coarse[0] *= 0.5
    coarse, slope = np.ascontiguousarray(coarse), slope_of(G)
    for array in (s, G, slope, coarse):  # read-only as the basis is: kernels are compiled for one sort of arrays
        array.setflags(write=False)
    return (s, np.mod(multiple * s, 1.0), G, slope, np.full(S, 1.0 / S)), coarse


def _nodes(problem: HarmonicBalance) -> tuple[Any, ...]:
    """(address of F and J, points with their matrices, coefficients of Gauss collocation, analysis, solver)."""
    known = problem._memo.get("nodes")
    if known is None:
        rule = gauss_rule(_DEGREE)
        points, coarse = _points(problem.harmonics, problem.multiple)
        coefficients = rule.inverse, rule.matrix, rule.row_sums, rule.update, rule.weights
        known = problem._memo["nodes"] = (
            problem.evaluations.address("FJ"), points, coefficients, coarse, condenser()
        )
    return known  # type: ignore[no-any-return]


def propagated(L: HarmonicLinearisation, found: Correction) -> Propagation | None:
    """The variational equation along the corrected orbit over one period; None where it is not finite."""
    problem, n = L.problem, L.problem.layout.n
    address, points, coefficients, _, solver = _nodes(problem)
    kept = problem._fixed[0][-1]
    fundamental = np.empty((len(points[-1]) + 1, n, n))
    trace = propagate(
        solver, address, L.params, found.period, found.coefficients, points, coefficients, kept, problem.flow.position,
        fundamental,
    )  # fmt: skip
    if not abs(trace) < _LARGEST_TRACE:
        return None
    growth = math.exp(trace)
    defect = abs(determinant(fundamental[-1]) - growth) / max(1.0, growth)
    rate = None
    if problem.own:
        start = problem.layout.states(found.coefficients, 2 * np.pi / found.period, np.zeros(1))
        rate = problem.evaluations.F(None, start, L.params)[0]
    return Propagation(fundamental[:-1], fundamental[-1], rate, defect)


def _refined(L: HarmonicLinearisation, along: Propagation) -> tuple[Array, Array, float] | None:
    """(multipliers along the orbit, Hill multipliers by the Rayleigh quotient, bound of its error) or None.

    None where the bound is too large and Hill's matrix small enough to be solved whole, or modes are not independent.
    """
    layout, T, basis = L.problem.layout, L.period, L.problem.layout.basis
    mu, Y = _eigen(along.monodromy)
    n, listed = len(mu), mu.astype(complex).tolist()
    if not min(map(abs, listed)) > 1e-200:
        return None
    used = _not_trivial(mu) if L.problem.own else range(n)
    if used is None:
        return None
    exponents = [cmath.log(m) for m in listed]
    quotient, bound = np.empty(n, complex), np.empty(n)
    if not quotients(
        basis.synthesis, basis.analysis, _nodes(L.problem)[3], basis.k, L.J, along.fundamental,
        np.ascontiguousarray(Y, complex), np.array(exponents), L.omega, quotient, bound,
    ):  # fmt: skip
        return None
    values, worst, margin = [], 0.0, 1.0
    for m, exponent, at, limit in zip(listed, exponents, quotient.tolist(), bound.tolist()):
        change = at * T - exponent
        if not abs(change) < _FARTHEST:
            return None
        values.append(m * cmath.exp(change if m.imag else change.real))
        worst = max(worst, limit * T * min(1.0, abs(m)))
    values, listed = [values[i] for i in used], [listed[i] for i in used]
    margin = min((abs(abs(v) - 1.0) for v in values), default=1.0)
    if not (worst < _BOUND or (worst < _LOOSE and worst < _SHARE * margin)) and layout.count * n <= _WHOLE:
        return None
    return (np.array(listed), np.array(values), worst) if worst < 1e-2 else None


def determinant(M: Array) -> float:
    """det M; 2 x 2 without LAPACK's overhead."""
    if len(M) == 2:
        (a, b), (c, d) = M.tolist()
        return float(a * d - b * c)
    return float(np.linalg.det(M))


def _eigen(M: Array) -> tuple[Array, Array]:
    """Eigenvalues and vectors (columns); 2 x 2 without LAPACK's overhead."""
    if len(M) != 2:
        values, vectors = np.linalg.eig(M)
        return values, vectors
    (a, b), (c, d) = M.tolist()
    if b == c == 0.0:
        return np.array([a, d]), np.eye(2)
    values = eigenvalues(M)
    first, second = values.tolist()
    rows = [[b, b], [first - a, second - a]] if abs(b) >= abs(c) else [[first - d, second - d], [c, c]]
    return values, np.array(rows)


def _not_trivial(mu: Array) -> Array | None:
    """Indices of all multipliers but the trivial one; None where another is too close to it to be told apart."""
    order = np.argsort(np.abs(mu - 1))
    return np.sort(order[1:]) if len(mu) < 2 or abs(mu[order[1]] - 1) > _APART else None


def checked_spectrum(L: HarmonicLinearisation) -> Spectrum:
    """Hill multipliers without the trivial one, their error, counts and verdict."""
    problem = L.problem
    own, found = problem.own, L.correction
    if not found.error < np.inf and not np.isfinite(L.J).all():
        return orbit_spectrum(np.full(problem.layout.n - own, np.nan, complex), np.inf)
    along = propagated(L, found) if found.error < np.inf else None
    if along is not None:
        refined = _refined(L, along)
        if refined is not None:
            others, values, bound = refined
            error = 2 * spectrum_distance(values, others) + bound + _floor(along) + (_drift(L, along) if own else 0.0)
            return _judged(_ordered(values), error)
    values = _whole_values(L)
    if along is None or not np.isfinite(values).all():
        return orbit_spectrum(values, np.inf)
    M, error = along.monodromy * problem.scales / problem.scales[:, None], _floor(along)
    if own:
        M, drift = deflated(M, along.flow / problem.scales)
        error += drift
    others = eigenvalues(M)
    error += 2 * max(spectrum_distance(values, others), spectrum_distance(others, values))
    return _judged(_with_small_ones(values, others), error)


def _judged(values: Array, error: float) -> Spectrum:
    """Counts and verdict; the error of a multiplier outside the circle is relative, and must leave it outside."""
    found = orbit_spectrum(values, error)
    if found.verdict is Verdict.UNSTABLE and not float(np.abs(values).max()) * (1.0 - error) > 1.0:
        return found._replace(verdict=Verdict.UNDETERMINED)
    return found


def _drift(L: HarmonicLinearisation, along: Propagation) -> float:
    """|Phi f - f| / |f| over the scales: the trivial multiplier, measured."""
    f = along.flow / L.problem.scales
    image = along.monodromy @ along.flow / L.problem.scales
    return float(np.linalg.norm(image - f) / np.linalg.norm(f))


def _floor(along: Propagation) -> float:
    return along.defect + 1e-14 * len(along.fundamental) * float(np.abs(along.monodromy).max())


def _ordered(values: Array) -> Array:
    """By descending modulus, conjugates side by side, the upper one first."""
    return np.array(sorted(values.tolist(), key=_rank), complex)


def _rank(value: complex) -> tuple[float, float]:
    return -round(abs(value), 14), -value.imag


def _with_small_ones(values: Array, others: Array) -> Array:
    """Values, with those far inside the circle taken from `others`: large ones spoil them in a product of modes."""
    mixed = np.concatenate([values[np.abs(values) >= _SMALL], others[np.abs(others) < _SMALL]])
    return mixed if len(mixed) == len(values) else values


def _whole_values(L: HarmonicLinearisation) -> Array:
    """Multipliers from Hill's matrix solved whole, the trivial one removed by the direction of the flow."""
    modes, problem = L.modes, L.problem
    if not np.isfinite(modes.monodromy).all():
        return np.full(problem.layout.n - problem.own, np.nan, complex)
    if not problem.own:
        return eigenvalues(modes.monodromy)
    velocity = problem.evaluations.F(None, np.ascontiguousarray(L.X[:1]), L.params)[0]
    return eigenvalues(deflated(modes.monodromy, velocity / problem.scales)[0])


# ---------------------------------------------------------------------- for users and tests
def independent_multipliers(problem: HarmonicBalance, u: Array, params: Array) -> dict[str, Array]:
    """Multipliers (n,), the trivial one too, by three methods: "hill", "koopman" (subharmonic form), "monodromy"."""
    L = problem.linearise(u, params)
    n, H = problem.layout.n, problem.harmonics
    out: dict[str, Array] = {"hill": eigenvalues(L.modes.monodromy)}
    samples = 8 * H + 8
    s = np.arange(samples) / samples
    X = problem.layout.states(L.c, L.omega, s)
    A = problem.evaluations.FJ(np.mod(problem.multiple * s, 1.0), X, L.params)[1]
    out["koopman"] = eigenvalues(koopman_hill(A, L.omega, H))
    along = propagated(L, L.correction)
    out["monodromy"] = np.full(n, np.nan, complex) if along is None else eigenvalues(along.monodromy)
    return out
