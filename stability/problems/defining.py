r"""Defining systems of special points: one builder for every problem class, for location and for loci.

Each kind is the rank drop of a small dense matrix A(u, p, e), bordered by constant frames W (k, a), V (l, b) to

    [ A    W ] [ v ]   [ 0 ]           [ A^T  V ] [ w ]   [ 0 ]
    [ V^T  0 ] [ G ] = [ I ]    and    [ W^T  0 ] [ . ] = [ I ],      dG = - w^T dA v;       G = 0 where the rank drops.

    kind              A                           unknowns besides u, lambda      conditions
    fold              S (k, k)                    -                               1
    branch point      [S, s_lambda] (k, k + 1)    mu, with F + mu b = 0           2      (b = a core equation; mu -> 0)
    period doubling   M - c I, c = -1             -                               1
    Hopf              M^2 + kappa I               kappa = omega^2                 2 of 4
    Neimark-Sacker    M^2 - 2 c M + I             c = cos(theta)                  2 of 4

S is the core and M the spectral matrix of `protocols.Linearisation`. With the unfolding mu the system of a branch point
is regular at a simple one; with kappa or c as unknown the pair systems stay regular where the pair becomes real
(Bogdanov-Takens, strong resonances 1:1 and 1:2). On the kernel of a polynomial in M, G lies in the span of W^T V and
W^T M V: the two conditions are the components there. Frames taken from the singular vectors of A make v = V, w = W.
Newton on all of it converges quadratically and needs first derivatives of M and S only.
References: Govaerts (2000), chapters 3-5; Kuznetsov (2004), 10.2; Griewank and Reddien, SIAM J. Numer. Anal. 21 (1984).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..protocols import Critical, Linearisation, Problem
from ..words import Kind

__all__ = [
    "Conditions", "Equations", "Frame", "Located", "conditions", "equations", "first_extra", "frame_of", "gradients",
    "locate", "singular_matrix", "values_in",
]  # fmt: skip

Array = NDArray[np.float64]
_PAIRS = (Kind.HOPF, Kind.NEIMARK_SACKER)
_MAX_NEWTON = 12


class Frame(NamedTuple):
    """Constant borders W (k, a), V (l, b) and, for pairs, the two functions `combination` (2, a b) of G that count."""

    left: NDArray[Any]
    right: NDArray[Any]
    combination: Array | None


class Conditions(NamedTuple):
    """Conditions g (q,) at one iterate with the borders taken there: v = V and w = W, G = -(smallest singular values).

    `orientation` is the sign by which g differs from a function that is smooth along a curve (0: none is known).
    """

    g: Array
    frame: Frame
    orientation: int


class Equations(NamedTuple):
    """Conditions g (q,) and their gradients with respect to u (q, N), p (q, m) and the extra unknowns (q, e)."""

    g: Array
    by_u: Array
    by_params: Array
    by_extra: Array
    left: NDArray[Any]  # w (k, a)
    right: NDArray[Any]  # v (l, b)


class Located(NamedTuple):
    """Where a defining system was solved, or how far it came."""

    u: Array
    params: Array
    extra: Array  # (e,): mu, kappa or c
    left: NDArray[Any]
    right: NDArray[Any]
    accuracy: float  # last Newton update in the weighted norm (the error left is about its square)
    iterations: int
    converged: bool


def singular_matrix(kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array) -> NDArray[Any]:
    """A(u, p, e) of the table above.

    Raises
    ------
    InputError
        The kind has no defining system, or cannot occur for this problem.
    """
    if kind is Kind.FOLD:
        return L.core
    if kind is Kind.BRANCH_POINT:
        return np.column_stack([L.core, L.core_column(free)])
    M = L.spectral
    eye = np.eye(M.shape[0])
    if kind is Kind.PERIOD_DOUBLING and critical.minus is not None:
        shift = critical.minus
        return M - (shift if complex(shift).imag else complex(shift).real) * eye
    if kind in _PAIRS and kind is critical.pair:
        return M @ M - 2 * extra[0] * M + eye if critical.circle else M @ M + extra[0] * eye
    raise InputError(f"there is no defining system for '{kind}' in this problem")


def first_extra(kind: Kind, critical: Critical, values: NDArray[Any]) -> Array:
    """First values of the extra unknowns; `values` are the multipliers or eigenvalues near the point."""
    if kind is Kind.BRANCH_POINT:
        return np.zeros(1)
    if kind not in _PAIRS:
        return np.zeros(0)
    upper = values[values.imag > 0]
    if not upper.size:
        return np.zeros(1)
    distance = np.abs(np.log(np.abs(upper))) if critical.circle else np.abs(upper.real)
    nearest = upper[int(np.argmin(distance))]
    return np.array([nearest.real / abs(nearest) if critical.circle else abs(nearest) ** 2])


def conditions(kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array) -> Conditions:
    """The conditions with borders from the singular vectors of the smallest singular values at this point."""
    A = singular_matrix(kind, L, critical, free, extra)
    k, c = A.shape
    a = min(2 if kind in _PAIRS else 1, k)
    b = a + c - k
    left, sizes, right = np.linalg.svd(A)
    W, V = left[:, k - a :].conj(), right[c - b :].conj().T
    G = np.zeros((a, b))
    G[:, :a] = -np.diag(sizes[k - a :])
    if kind in _PAIRS:
        # coordinates in the span of W^T V and W^T M V: no rotation or reflection of the borders changes them
        pair = np.stack([(W.T @ V).ravel(), (W.T @ L.spectral @ V).ravel()], axis=1)
        combination = np.linalg.pinv(pair)
        return Conditions(combination @ G.ravel(), Frame(W, V, combination), 1)
    orientation = 0
    if c == k and not np.iscomplexobj(A):
        orientation = int(np.sign(np.linalg.det(left) * np.linalg.det(right)))
    return Conditions(G.ravel(), Frame(W, V, None), orientation)


def frame_of(kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array) -> Frame:
    """Borders from the singular vectors that belong to the smallest singular values at this point."""
    return conditions(kind, L, critical, free, extra).frame


def _gradient(
    kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array, w: NDArray[Any], v: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Gradient of w^T A v with respect to u, p and the extra unknowns."""
    if kind is Kind.FOLD:
        return *L.core_gradient(w, np.append(v, 0.0), free), np.zeros(0)
    if kind is Kind.BRANCH_POINT:
        return *L.core_gradient(w, v, free), np.zeros(1)
    if kind is Kind.PERIOD_DOUBLING:
        return *L.spectral_gradient(w, v), np.zeros(0)
    M = L.spectral
    shift = 2 * extra[0] if critical.circle else 0.0
    first = L.spectral_gradient(w, M @ v - shift * v)
    second = L.spectral_gradient(M.T @ w, v)
    by_extra = -2 * (w @ M @ v) if critical.circle else w @ v
    return first[0] + second[0], first[1] + second[1], np.array([by_extra])


def gradients(
    kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array, found: Conditions
) -> Equations:
    """The conditions and their exact gradients at the point whose singular vectors are the borders."""
    return _assembled(kind, L, critical, free, extra, found.frame, found.g, found.frame.left, found.frame.right)


def _bordered(A: NDArray[Any], frame: Frame) -> NDArray[Any]:
    (_, a), (_, b) = frame.left.shape, frame.right.shape
    return np.block([[A, frame.left], [frame.right.T, np.zeros((b, a), dtype=A.dtype)]])


def values_in(kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array, frame: Frame) -> Array:
    """The conditions g for any constant borders, without gradients."""
    A = singular_matrix(kind, L, critical, free, extra)
    k, b = A.shape[0], frame.right.shape[1]
    right = np.zeros((k + b, b))
    right[k:] = np.eye(b)
    g = np.linalg.solve(_bordered(A, frame), right)[A.shape[1] :].ravel()
    return np.real(g if frame.combination is None else frame.combination @ g)


def equations(
    kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array, frame: Frame
) -> Equations:
    """The conditions g = 0 of a kind and their exact gradients, for any constant frame."""
    A = singular_matrix(kind, L, critical, free, extra)
    (k, a), (c, b) = frame.left.shape, frame.right.shape
    K = _bordered(A, frame)
    unit = np.zeros((c + a, b))
    unit[k:] = np.eye(b)
    solution = np.linalg.solve(K, unit)
    v, g = solution[:c], solution[c:].ravel()
    unit = np.zeros((k + b, a))
    unit[c:] = np.eye(a)
    w = np.linalg.solve(K.T, unit)[:k]
    g = g if frame.combination is None else frame.combination @ g
    return _assembled(kind, L, critical, free, extra, frame, g, w, v)


def _assembled(
    kind: Kind, L: Linearisation, critical: Critical, free: str, extra: Array, frame: Frame, g: NDArray[Any],
    w: NDArray[Any], v: NDArray[Any],
) -> Equations:  # fmt: skip
    parts = [
        _gradient(kind, L, critical, free, extra, w[:, i], v[:, j])
        for i in range(w.shape[1])
        for j in range(v.shape[1])
    ]
    by_u, by_params, by_extra = (-np.array([part[which] for part in parts]) for which in range(3))
    if frame.combination is not None:
        P = frame.combination
        by_u, by_params, by_extra = P @ by_u, P @ by_params, P @ by_extra
    return Equations(np.real(g), np.real(by_u), np.real(by_params), np.real(by_extra), w, v)


@dataclass
class _Iterate:
    u: Array
    params: Array
    extra: Array


def locate(
    problem: Problem,
    kind: Kind,
    u: Array,
    params: Array,
    free: str,
    weight: float,
    values: NDArray[Any],
    *,
    radius: float = math.inf,
    tolerance: float = 1e-11,
) -> Located:
    """Newton on the defining system of `kind`, from a point near it.

    Parameters
    ----------
    u, params : (N,), (m,)
        A point close to the special point (from the bracket); a solution of F = 0 or not.
    weight : float
        1 / (scale of the parameter), as in the tangent.
    values : (n,) complex
        Multipliers or eigenvalues there (start value of cos theta or omega^2).
    radius : float
        Largest distance from the start, in the weighted norm, before the attempt is given up.

    Returns
    -------
    Located
        ``converged`` False where Newton left the radius, met a singular matrix or did not settle.

    Notes
    -----
    Converges quadratically; the accuracy reported is the last update.
    """
    critical, k = problem.critical, list(problem.parameters).index(free)
    at = _Iterate(np.array(u), np.array(params), first_extra(kind, critical, values))
    left, right = np.zeros((0, 0)), np.zeros((0, 0))
    weights, best, moved = problem.weights, math.inf, np.zeros(u.size)
    for iteration in range(1, _MAX_NEWTON + 1):
        L = problem.linearise(at.u, at.params)
        try:
            step, found = _newton_step(problem, kind, L, critical, free, k, at)
        except np.linalg.LinAlgError:
            break
        left, right = found.left, found.right
        n = at.u.size
        scale = 1.0 + math.sqrt(float(weights @ at.u**2))
        size = math.sqrt(float(weights @ step[:n] ** 2) + (weight * step[n]) ** 2) / scale
        if not math.isfinite(size):
            break
        at.u = at.u + step[:n]
        at.params[k] += step[n]
        at.extra = at.extra + step[n + 1 :]
        moved = moved + step[:n]
        distance = math.sqrt(float(weights @ moved**2) + (weight * (at.params[k] - params[k])) ** 2)
        if distance > radius:
            break
        # rounding may stop the decrease above the tolerance: accept a stalled update that is small
        if size <= tolerance or (size < 1e-8 and size > 0.3 * best):
            return Located(at.u, at.params, at.extra, left, right, size, iteration, True)
        best = min(best, size)
    return Located(at.u, at.params, at.extra, left, right, best, _MAX_NEWTON, False)


def _newton_step(
    problem: Problem, kind: Kind, L: Linearisation, critical: Critical, free: str, k: int, at: _Iterate
) -> tuple[Array, Equations]:
    """One Newton step for (u, lambda, extra), stacked; frames from the singular vectors of this iterate."""
    begun = conditions(kind, L, critical, free, at.extra)
    found = gradients(kind, L, critical, free, at.extra, begun)
    n, q, e = at.u.size, found.g.size, at.extra.size
    columns = np.zeros((n, 1 + e))
    columns[:, 0] = L.column(free)
    residual = np.array(L.residual)
    if kind is Kind.BRANCH_POINT:
        columns[:, 1] = L.embed(np.real(begun.frame.left[:, 0]))
        residual = residual + at.extra[0] * columns[:, 1]
    if q != 1 + e:  # a pair needs two states at least
        raise np.linalg.LinAlgError("the defining system is not square")
    corner = np.column_stack([found.by_params[:, k], found.by_extra.reshape(q, e)])
    right_side = -np.concatenate([residual, found.g])[:, None]
    return L.solve(found.by_u, columns, corner, right_side)[:, 0], found
