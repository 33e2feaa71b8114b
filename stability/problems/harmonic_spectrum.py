r"""Stability of a harmonic-balance orbit: Hill's exponents, checked by the monodromy along the corrected orbit.

Two computations that share nothing but the orbit:

* *Hill*: exponents of the truncated system's own Hill matrix. A fold of the truncated system is an eigenvalue zero of
  it, so that counts and folds agree at every H.
* *Monodromy*: the variational equation along the orbit corrected by its missing harmonics (harmonic_truncation),
  integrated by Gauss collocation (kernels/condensation).

The modes of the second, exp(-lambda t) Phi(t) y, cut off after H harmonics, are excellent trial vectors for the first:
with the left ones (rows of their inverse) the two-sided Rayleigh quotient

    lambda = w^T Hill v / w^T v

differs from Hill's eigenvalue by the product of both residuals. Where that bound is not below 1e-8, a Hill matrix of
order up to 140 is solved whole and its exponents are selected (kernels/hill_matrix); the bound joins the error.
Twice the difference between the two sets of multipliers is the error estimate: truncation of orbit and of modes both. A
verdict that it does not support is UNDETERMINED.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kernels.fourier import fourier_basis, series
from ..kernels.gauss import gauss_rule
from ..kernels.hill_matrix import hill_matrix, koopman_hill, mean_harmonics, selected
from ..protocols import Spectrum
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
_WHOLE = 140  # order of the largest Hill matrix that is solved whole at an ordinary point
_SMALL = 0.3
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
    """Phi at the starts of S equal intervals (S, n, n), Phi(T) (n, n), f at s = 0 (n,), and the defect of Liouville."""

    fundamental: Array
    monodromy: Array
    flow: Array
    defect: float


class _Nodes(NamedTuple):
    s: Array
    phase: Array
    G: Array
    slope: Array
    widths: Array
    LU: Array
    pivots: Array
    Z: Array
    M: Array
    none: Array


def _nodes(problem: HarmonicBalance) -> _Nodes:
    known = problem._memo.get("nodes")
    if known is None:
        layout = problem.layout
        n, small, S = layout.n, layout.q, max(16, 2 * layout.harmonics + 2)
        s = ((np.arange(S)[:, None] + gauss_rule(_DEGREE).points) / S).ravel()
        G = series(2 * layout.harmonics + 1, s)
        size = _DEGREE * small
        known = problem._memo["nodes"] = _Nodes(
            s, np.mod(problem.multiple * s, 1.0), G, slope_of(G), np.full(S, 1.0 / S), np.empty((S, size, size)),
            np.empty((S, size), np.int64), np.empty((S, _DEGREE * n, n)), np.empty((S, n, n)),
            np.empty((S, _DEGREE * n, 0)),
        )  # fmt: skip
    return known  # type: ignore[no-any-return]


def propagated(L: HarmonicLinearisation, found: Correction) -> Propagation | None:
    """The variational equation along the corrected orbit over one period; None where it is not finite."""
    from ..kernels.condensation import condense

    problem, layout, flow = L.problem, L.problem.layout, L.problem.flow
    nodes, rule, n = _nodes(L.problem), gauss_rule(_DEGREE), L.problem.layout.n
    X = layout.states_by(nodes.G, nodes.slope, nodes.s, found.coefficients, 2 * np.pi / found.period)
    if not np.isfinite(X).all():
        return None
    F, J = problem.evaluations.FJ(nodes.phase, X, L.params)
    if not np.isfinite(J).all():
        return None
    sign = condense(
        rule.inverse, rule.matrix, rule.row_sums, rule.update, nodes.widths, found.period, J, flow.kept, flow.position,
        nodes.none, nodes.LU, nodes.pivots, nodes.Z, nodes.M,
    )  # fmt: skip
    if sign == 0.0:
        return None
    S = len(nodes.widths)
    fundamental = np.empty((S + 1, n, n))
    fundamental[0] = np.eye(n)
    for j in range(S):
        np.dot(nodes.M[j], fundamental[j], out=fundamental[j + 1])
    trace = np.einsum("kii->k", J).reshape(S, -1) @ rule.weights
    growth = np.exp(found.period / S * float(trace.sum()))
    defect = abs(float(np.linalg.det(fundamental[-1])) - growth) / max(1.0, growth)
    rate = F[0]
    if problem.own:
        start = layout.states(found.coefficients, 2 * np.pi / found.period, np.zeros(1))
        rate = problem.evaluations.F(None, start, L.params)[0]
    return Propagation(fundamental[:-1], fundamental[-1], rate, defect)


def _refined(L: HarmonicLinearisation, along: Propagation) -> tuple[Array, Array, float] | None:
    """(multipliers along the orbit, Hill multipliers by the Rayleigh quotient, bound of its error) or None.

    None where the bound is too large and Hill's matrix small enough to be solved whole, or modes are not independent.
    """
    layout, T, omega = L.problem.layout, L.period, L.omega
    mu, Y = _eigen(along.monodromy)
    if not (np.abs(mu) > 1e-200).all():
        return None
    used = _not_trivial(mu) if L.problem.own else slice(None)
    if used is None:
        return None
    exponents = np.log(mu.astype(complex))
    S = len(along.fundamental)
    basis, samples = fourier_basis_of(layout.harmonics, S), layout.basis
    shrink = np.exp(-exponents * (np.arange(S) / S)[:, None])
    P = (along.fundamental @ Y) * shrink[:, None, :]
    left = _inverses(P)  # (S, mode, state)
    if left is None:
        return None
    n = layout.n
    v = (basis @ P.reshape(S, n * n)).reshape(-1, n, n)  # coefficient, state, mode
    w = (basis @ left.reshape(S, n * n)).reshape(-1, n, n)  # coefficient, mode, state
    values = (samples.synthesis @ v.reshape(-1, n * n)).reshape(-1, n, n)
    applied = (samples.analysis @ (L.J @ values).reshape(-1, n * n)).reshape(-1, n, n)
    applied[1::2] -= (omega * samples.k[1::2, None, None]) * v[2::2]
    applied[2::2] += (omega * samples.k[2::2, None, None]) * v[1::2]
    mean = np.where(samples.k == 0, 1.0, 0.5)[:, None, None]
    wt = w.transpose(0, 2, 1) * mean
    below = (wt * v).sum(axis=(0, 1))
    quotient = (wt * applied).sum(axis=(0, 1)) / below
    rest = np.sqrt((mean * np.abs(applied - quotient * v) ** 2).sum(axis=(0, 1)))
    size = np.sqrt((np.abs(wt) ** 2 / mean).sum(axis=(0, 1)))
    bound = (rest * size / np.abs(below)) * (rest / np.sqrt((mean * np.abs(v) ** 2).sum(axis=(0, 1)))) / omega
    worst = float((bound * T * np.minimum(1.0, np.abs(mu)))[used].max(initial=0.0))
    if not worst < (_BOUND if layout.count * n <= _WHOLE else 1e-2):
        return None
    change = quotient * T - exponents
    change = np.where(np.imag(mu) == 0.0, change.real, change)
    return mu[used], (mu * np.exp(change))[used], worst


def _eigen(M: Array) -> tuple[Array, Array]:
    """Eigenvalues and vectors (columns); 2 x 2 without LAPACK's overhead."""
    if len(M) != 2:
        values, vectors = np.linalg.eig(M)
        return values, vectors
    (a, b), (c, d) = M.tolist()
    if b == c == 0.0:
        return np.array([a, d]), np.eye(2)
    values = eigenvalues(M)
    values = values.real if not values.imag.any() else values
    first, second = values.tolist()
    rows = [[b, b], [first - a, second - a]] if abs(b) >= abs(c) else [[first - d, second - d], [c, c]]
    return values, np.array(rows)


def _inverses(P: Array) -> Array | None:
    """Inverses of (S, n, n), None where one is singular."""
    if P.shape[1] != 2:
        try:
            return np.asarray(np.linalg.inv(P))
        except np.linalg.LinAlgError:
            return None
    determinant = P[:, 0, 0] * P[:, 1, 1] - P[:, 0, 1] * P[:, 1, 0]
    if not determinant.all():
        return None
    out = np.empty_like(P)
    out[:, 0, 0], out[:, 1, 1] = P[:, 1, 1], P[:, 0, 0]
    out[:, 0, 1], out[:, 1, 0] = -P[:, 0, 1], -P[:, 1, 0]
    return np.asarray(out / determinant[:, None, None])


def _not_trivial(mu: Array) -> Array | None:
    """Indices of all multipliers but the trivial one; None where another is too close to it to be told apart."""
    order = np.argsort(np.abs(mu - 1))
    return np.sort(order[1:]) if len(mu) < 2 or abs(mu[order[1]] - 1) > _APART else None


def fourier_basis_of(harmonics: int, samples: int) -> Array:
    """Analysis matrix (2H + 1, S) of S >= 2 H + 1 samples."""
    if samples >= 4 * harmonics + 3:
        return fourier_basis(harmonics, samples).analysis
    known = _ANALYSIS.get((harmonics, samples))
    if known is None:
        known = series(harmonics, np.arange(samples) / samples).T * (2.0 / samples)
        known[0] *= 0.5
        _ANALYSIS[harmonics, samples] = known
    return known


_ANALYSIS: dict[tuple[int, int], Array] = {}


def checked_spectrum(L: HarmonicLinearisation) -> Spectrum:
    """Hill multipliers without the trivial one, their error, counts and verdict."""
    problem = L.problem
    n, own = problem.layout.n, problem.own
    unknown = np.full(n - own, np.nan, complex)
    if not np.isfinite(L.J).all():
        return orbit_spectrum(unknown, np.inf)
    found = L.correction
    along = propagated(L, found) if np.isfinite(found.error) else None
    if along is not None:
        refined = _refined(L, along)
        if refined is not None:
            others, values, bound = refined
            error = 2 * spectrum_distance(values, others) + bound + _floor(along) + (_drift(L, along) if own else 0.0)
            return orbit_spectrum(_ordered(values), error)
    values = _whole_values(L)
    if along is None or not np.isfinite(values).all():
        return orbit_spectrum(values, np.inf)
    M, error = along.monodromy * problem.scales / problem.scales[:, None], _floor(along)
    if own:
        M, drift = deflated(M, along.flow / problem.scales)
        error += drift
    others = eigenvalues(M)
    error += 2 * max(spectrum_distance(values, others), spectrum_distance(others, values))
    return orbit_spectrum(_with_small_ones(values, others), error)


def _drift(L: HarmonicLinearisation, along: Propagation) -> float:
    """|Phi f - f| / |f| over the scales: the trivial multiplier, measured."""
    f = along.flow / L.problem.scales
    image = along.monodromy @ along.flow / L.problem.scales
    return float(np.linalg.norm(image - f) / np.linalg.norm(f))


def _floor(along: Propagation) -> float:
    return along.defect + 1e-14 * len(along.fundamental) * float(np.abs(along.monodromy).max())


def _ordered(values: Array) -> Array:
    """By descending modulus, conjugates side by side, the upper one first."""
    return np.asarray(values[np.lexsort((-values.imag, -np.abs(values).round(14)))])


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
