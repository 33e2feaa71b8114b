r"""All solutions of one-harmonic balance of a polynomial system, as starts for more harmonics: `one_harmonic_roots`.

With x = a_0 + a_1 cos theta + b_1 sin theta for every series, the equations projected on 1, cos, sin are polynomials
f_i(y) = 0 of the equations' degrees d_i in the 3 q coefficients y: at most prod d_i^3 isolated complex solutions
(Bezout). All of them are the ends of the paths of the homotopy

    h_i(y, t) = (1 - t) gamma_i (y_i^(d_i) - 1) + t f_i(y) / |f_i| = 0,     t from 0 to 1,

gamma on the unit circle: for almost all gamma the paths do not meet before t = 1 (Sommese, Wampler, 2005, The Numerical
Solution of Systems of Polynomials, chapter 8). Paths that go to infinity belong to solutions that are not there. All
paths are followed at once, each with its own steps: tangent predictor, Newton corrector, in complex numbers. The real
ends are the periodic motions whose first harmonic dominates; motions that need more harmonics to exist are not among
them, so that the set is complete for the one-harmonic equations only.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels.fourier import resized, series
from .harmonic_layout import slope_of
from .harmonic_samples import equation_degrees

if TYPE_CHECKING:
    from .harmonic_balance import HarmonicBalance

__all__ = ["MOST_PATHS", "one_harmonic_roots", "polynomial_roots"]

Array = np.ndarray
MOST_PATHS = 1000
_FAR = 1e5  # a path beyond this many times the size of the unknowns goes to infinity
_STEPS = 3000
_SMALLEST = 1e-7
_REAL = 1e-6
_SAME = 1e-5


def _degrees(problem: HarmonicBalance) -> Array | None:
    """(q,) of the kept equations; None where they are not polynomials, or the motion is not one of harmonic 1."""
    found = equation_degrees(problem.system)
    if found is None or problem.own or problem.subharmonic > 1 or problem.winding.any():
        return None
    return np.maximum(np.array(found)[problem.layout.rows], 1)


def one_harmonic_roots(problem: HarmonicBalance, params: Array, most: int = MOST_PATHS) -> list[Array]:
    """Coefficients (2H + 1, q) of all real one-harmonic solutions, filled with zeros.

    Empty where the equations are not polynomials in the states, or prod d_i^3 (two degrees of freedom, cubic: 729)
    exceeds `most`. If it does and the equations are odd in states and forcing, solutions with mean zero are looked for
    (81 paths).
    """
    degrees = _degrees(problem)
    if degrees is None:
        return []
    balance, q = _balance(problem, params), problem.layout.q
    if np.prod(degrees.astype(float) ** 3) <= most:
        ends = polynomial_roots(balance, np.tile(degrees, 3))
    elif np.prod(degrees.astype(float) ** 2) <= most and _is_odd(balance, q):
        ends = polynomial_roots(_without_mean(balance, q), np.tile(degrees, 2))
        ends = np.hstack([np.zeros((len(ends), q)), ends])
    else:
        return []
    return [resized(y.reshape(3, q), problem.harmonics) for y in _real(ends)]


def _is_odd(balance: Callable[[Array], tuple[Array, Array]], q: int) -> bool:
    """Whether motions without mean have no mean force."""
    y = np.random.default_rng(0).standard_normal((4, 3 * q)) * np.array([0.1, 1.0, 10.0, 100.0])[:, None]
    y[:, :q] = 0.0
    R = balance(y.astype(complex))[0]
    return bool((np.abs(R[:, :q]).max(axis=1) <= 1e-9 * np.abs(R[:, q:]).max(axis=1)).all())


def _without_mean(balance: Callable[[Array], tuple[Array, Array]], q: int) -> Callable[[Array], tuple[Array, Array]]:
    def reduced(y: Array) -> tuple[Array, Array]:
        R, A = balance(np.hstack([np.zeros((len(y), q)), y]))
        return R[:, q:], A[:, q:, q:]

    return reduced


def _real(ends: Array) -> list[Array]:
    """The real ones among complex solutions (K, m), each once."""
    kept: list[Array] = []
    for y in ends:
        size = float(np.abs(y).max())
        if np.abs(y.imag).max() > _REAL * max(size, 1e-12):
            continue
        if all(np.abs(y.real - other).max() > _SAME * max(size, 1e-12) for other in kept):
            kept.append(y.real)
    return kept


def _balance(problem: HarmonicBalance, params: Array) -> Callable[[Array], tuple[Array, Array]]:
    """(K, 3 q) complex coefficients -> residuals (K, 3 q) and Jacobians (K, 3 q, 3 q)."""
    layout, q = problem.layout, problem.layout.q
    degree = max(equation_degrees(problem.system) or (1,))
    N = 2 * (degree + 2) + 2 * problem.multiple + 4
    s = np.arange(N) / N
    G = series(1, s)
    D, back = slope_of(G), G.T * (2.0 / N)
    back[0] *= 0.5
    omega = 2 * np.pi / problem.orbit_period(params)
    field, jacobian = _complex_field(problem.system)
    t = s * problem.orbit_period(params)
    places, velocities = layout.pairs
    by_state, by_rate = ((back[:, None] * K.T).reshape(9, N) for K in (G, omega * D))  # (3 e + m, N)

    def projected(kernel: Array, J: Array) -> Array:
        """(K, e, r, m, j): the Jacobians (K, N, r, j) times series m of the state, projected on series e."""
        r, j = J.shape[2:]
        return (kernel @ J.reshape(len(J), N, r * j)).reshape(len(J), 3, 3, r, j).transpose(0, 1, 3, 2, 4)

    power = np.where(layout.second, -(omega**2), 0.0) * np.array([0.0, 1.0, 1.0])[:, None]  # (3, q)
    first = np.where(layout.second, 0.0, omega)

    def balance(y: Array) -> tuple[Array, Array]:
        c = y.reshape(-1, 3, q)
        X = np.zeros((len(c), N, layout.n), complex)
        X[:, :, layout.unknowns] = G @ c
        X[:, :, velocities] = omega * (D @ c[:, :, places])
        states = [X[:, :, k] for k in range(layout.n)]
        F = field(states, t, params)[:, :, layout.rows]
        J = jacobian(states, t, params)[:, :, layout.rows]
        turned = np.stack([np.zeros_like(c[:, 0]), c[:, 2], -c[:, 1]], axis=1)
        R = power * c + first * turned - back @ F
        A = -projected(by_state, J[:, :, :, layout.unknowns])
        A[:, :, :, :, places] -= projected(by_rate, J[:, :, :, velocities])
        for r in range(q):
            for e in range(3):
                A[:, e, r, e, r] += power[e, r]
            A[:, 1, r, 2, r] += first[r]
            A[:, 2, r, 1, r] -= first[r]
        return R.reshape(len(c), -1), A.reshape(len(c), 3 * q, 3 * q)

    return balance


@lru_cache(maxsize=32)
def _complex_field(system: Any) -> tuple[Callable[..., Array], Callable[..., Array]]:
    """f and df/dx of polynomial equations for complex states, by numpy."""
    import sympy as sp

    states = [sp.Symbol(name, real=True) for name in system.states]
    names = [sp.Symbol(name, real=True) for name in system.parameters]
    arguments = [*states, sp.Symbol("t", real=True), *names]
    rhs = [sp.sympify(e) for e in system.rhs]
    f = sp.lambdify(arguments, rhs, "numpy", cse=True)
    J = sp.lambdify(arguments, [sp.diff(e, x) for e in rhs for x in states], "numpy", cse=True)
    n = len(states)

    def field(X: list[Array], t: Array, p: Array) -> Array:
        return np.stack([np.broadcast_to(v, X[0].shape) for v in f(*X, t, *p)], axis=-1)

    def jacobian(X: list[Array], t: Array, p: Array) -> Array:
        values = np.stack([np.broadcast_to(v, X[0].shape) for v in J(*X, t, *p)], axis=-1)
        return values.reshape(*X[0].shape, n, n)

    return field, jacobian


# ---------------------------------------------------------------------- all roots of a polynomial system
def polynomial_roots(f: Callable[[Array], tuple[Array, Array]], degrees: Array, seed: int = 7) -> Array:
    """Isolated complex solutions (K, m) of m polynomials of given degrees, by the total-degree homotopy.

    f: (K, m) complex -> values (K, m) and Jacobians (K, m, m). Solutions at infinity are left out; multiple ones may
    come more than once, or not at all.

    >>> def f(y):
    ...     x, z = y[:, 0], y[:, 1]
    ...     values = np.stack([x**2 + z**2 - 5, x * z - 2], axis=1)
    ...     return values, np.stack([np.stack([2 * x, 2 * z], axis=1), np.stack([z, x], axis=1)], axis=1)
    >>> np.sort(polynomial_roots(f, np.array([2, 2])).real[:, 0]).round(6)
    array([-2., -1.,  1.,  2.])
    """
    degrees = np.asarray(degrees)
    m = len(degrees)
    random = np.random.default_rng(seed)
    units, weights = _sizes(f, degrees, random)
    gamma = np.exp(2j * np.pi * random.random(m))
    grids = np.meshgrid(*[np.exp(2j * np.pi * np.arange(d) / d) for d in degrees], indexing="ij")
    y = np.stack([g.ravel() for g in grids], axis=1)

    def homotopy(y: Array, t: Array) -> tuple[Array, Array, Array]:
        values, slopes = f(y * units)
        values, slopes = values / weights, slopes * units / weights[:, None]
        start = gamma * (y**degrees - 1)
        A = t[:, None, None] * slopes
        k = np.arange(m)
        A[:, k, k] += (1 - t)[:, None] * gamma * degrees * y ** (degrees - 1)
        return (1 - t)[:, None] * start + t[:, None] * values, A, values - start

    return _followed(homotopy, y) * units


def _sizes(f: Callable[[Array], tuple[Array, Array]], degrees: Array, random: Any) -> tuple[float, Array]:
    """(size of the unknowns at which highest and lower terms balance, sizes (m,) of the equations there)."""
    m = len(degrees)
    v = random.standard_normal((8, m)) + 1j * random.standard_normal((8, m))
    far = 1e4
    top = np.abs(f(far * v)[0]).mean(axis=0) / far**degrees
    low = np.abs(f(0 * v)[1]).max(axis=(0, 2)) + np.abs(f(0 * v)[0]).max(axis=0)
    nonlinear = degrees > 1
    with np.errstate(divide="ignore"):
        size = (low[nonlinear] / top[nonlinear]) ** (1.0 / (degrees[nonlinear] - 1))
    units = float(np.median(size)) if nonlinear.any() else 1.0
    units = units if np.isfinite(units) and units > 0 else 1.0
    return units, np.maximum(np.abs(f(units * v)[0]).mean(axis=0), 1e-300)


def _followed(homotopy: Callable[[Array, Array], tuple[Array, Array, Array]], y: Array) -> Array:
    """Ends at t = 1 of the paths from y (K, m) at t = 0; those that do not arrive are left out."""
    K = len(y)
    t, h, alive = np.zeros(K), np.full(K, 0.02), np.ones(K, bool)
    y = y.astype(complex)
    for _ in range(_STEPS):
        k = np.flatnonzero(alive & (t < 1))
        if not len(k):
            break
        _, A, rate = homotopy(y[k], t[k])
        new_t = np.minimum(t[k] + h[k], 1.0)
        z = y[k] - (new_t - t[k])[:, None] * _solved(A, rate)
        first = change = np.zeros(len(k))
        for turn in range(4):
            value, A, _ = homotopy(z, new_t)
            step = _solved(A, value)
            z = z - step
            change = np.abs(step).max(axis=1) / (1 + np.abs(z).max(axis=1))
            first = first if turn else change
            if (change < 1e-11).all():
                break
        good = np.isfinite(z).all(axis=1) & (change < 1e-11) & (first < 0.02)
        y[k[good]], t[k[good]] = z[good], new_t[good]
        h[k] = np.where(good, np.where(first < 0.004, 2 * h[k], h[k]), 0.4 * h[k])
        alive[k] = (h[k] > _SMALLEST) & (np.abs(y[k]).max(axis=1) < _FAR)
    return y[(t >= 1) & alive]


def _solved(A: Array, b: Array) -> Array:
    """A^-1 b for stacks; nan where one is singular."""
    try:
        return np.asarray(np.linalg.solve(A, b[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.stack([_solved_one(a, x) for a, x in zip(A, b)])


def _solved_one(a: Array, x: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(a, x))
    except np.linalg.LinAlgError:
        return np.full(len(x), np.nan + 0j)
