"""Transition matrices of linear systems with periodic coefficients: Magnus order 6, batched over parameter nodes.

Equation and convention
-----------------------
dX/ds = G(s) X, X(start) = I, where the phase s is time in units of the period and ``G = T A`` is the generator already
multiplied by the period T. One step of length h from s0 uses the three Gauss points and

    a1 = h G2,   a2 = (sqrt(15) h / 3) (G3 - G1),   a3 = (10 h / 3) (G3 - 2 G2 + G1),
    c1 = [a1, a2],   c2 = -[a1, 2 a3 + c1] / 60,
    X(s0 + h) = exp(a1 + a3 / 12 + [-20 a1 - a3 + c1, a2 + c2] / 240) X(s0) + O(h^7).

The trace of the exponent is the Gauss quadrature of the trace of G, so Liouville's formula holds to quadrature
accuracy. A 2 x 2 exponential is closed (a series in -det of the trace-free part); for larger n: scaling and Taylor by
Paterson and Stockmeyer. The step error is even in h (the map is time-symmetric), so one Richardson step raises the
order from 6 to 8 and measures the error. The Gauss points lie inside the steps and the steps never straddle a break.

Shapes: phases (K,) shared by all nodes or (K, N) per node; generators (K, N, n, n); results (N, n, n).

Reference: S. Blanes, F. Casas, J. A. Oteo, J. Ros, Physics Reports 470 (2009) 151-238, equations (253) to (257).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["cosh_sinhc", "ordered_product", "propagate", "rounding_error", "step_edges", "step_factors", "transition"]

Array = NDArray[np.float64]
Generator = Callable[[Array], Array]

_GAUSS = np.sqrt(0.15)  # the outer Gauss points lie at the middle -+ this times h
_BLOCK = 24_000  # (steps in a block) x nodes: keeps the temporaries of the 2 x 2 kernel in the second-level cache
_SERIES_LIMIT = 4.0
_COSH = np.array([1.0 / float(np.prod(np.arange(1.0, 2 * k + 1))) for k in range(13)])
_SINHC = np.array([1.0 / float(np.prod(np.arange(1.0, 2 * k + 2))) for k in range(13)])


def step_edges(steps: int, breaks: ArrayLike = (), start: float = 0.0, stop: float = 1.0) -> Array:
    """Edges of about `steps` steps from `start` to `stop`; every break inside is an edge.

    Parameters
    ----------
    steps : number of steps without breaks; each piece between breaks gets its share, at least one.
    breaks : (nb,) phases at which the generator jumps, or (nb, N) if they differ from node to node (their order must
        be the same for all nodes).
    start, stop : phases, start < stop.

    Returns
    -------
    (S + 1,) or (S + 1, N) float

    >>> step_edges(4, breaks=[0.3])
    array([0.        , 0.15      , 0.3       , 0.53333333, 0.76666667,
           1.        ])
    """
    inner = np.asarray(breaks, dtype=float)
    if inner.size == 0:
        return np.linspace(start, stop, max(1, steps) + 1)
    per_node = inner.ndim == 2
    inner = inner if per_node else inner[:, None]
    keep = np.any((inner > start) & (inner < stop), axis=1)
    inner = np.clip(inner[keep], start, stop)
    ends = np.full((1, inner.shape[1]), float(start)), np.full((1, inner.shape[1]), float(stop))
    corners = np.concatenate([ends[0], inner, ends[1]])
    widths = np.diff(corners, axis=0).max(axis=1)
    counts = np.maximum(1, np.ceil(steps * widths / (stop - start) - 1e-9)).astype(int)
    pieces = [corners[0:1]]
    for i, count in enumerate(counts):
        fractions = np.arange(1, count + 1)[:, None] / count
        pieces.append(corners[i] + fractions * (corners[i + 1] - corners[i]))
    edges = np.concatenate(pieces)
    return edges if per_node else edges[:, 0]


def step_factors(generator: Generator, edges: Array) -> Array:
    """Transition matrices of the single steps, first step first (what a periodic Schur form needs).

    Parameters
    ----------
    generator : phases (K,) or (K, N) -> (K, N, n, n), the matrix of dX/ds = G X.
    edges : (S + 1,) or (S + 1, N), see `step_edges`.

    Returns
    -------
    (S, N, n, n) float
    """
    edges = np.asarray(edges, dtype=float)
    steps = len(edges) - 1
    half = 0.5 * (edges[1:] - edges[:-1])
    middle = 0.5 * (edges[1:] + edges[:-1])
    shift = 2.0 * _GAUSS * half
    phases = np.concatenate([middle - shift, middle, middle + shift])
    values = np.asarray(generator(phases), dtype=float)
    g1, g2, g3 = values[:steps], values[steps : 2 * steps], values[2 * steps :]
    h = 2.0 * (half[:, None] if half.ndim == 1 else half)
    if values.shape[-1] == 2:
        return _factors_two(g1, g2, g3, h)
    return _factors_general(g1, g2, g3, h[:, :, None, None])


def ordered_product(factors: Array) -> Array:
    """Product of (S, ...) square matrices with the last on the left, by a tree: shape (...).

    >>> ordered_product(np.array([[[1.0, 1.0], [0.0, 1.0]], [[1.0, 0.0], [1.0, 1.0]]]))
    array([[1., 1.],
           [1., 2.]])
    """
    while len(factors) > 1:
        odd = factors[-1:] if len(factors) % 2 else None
        paired = factors[: len(factors) - len(factors) % 2]
        factors = _product(paired[1::2], paired[0::2])
        if odd is not None:
            factors = np.concatenate([factors, odd])
    return factors[0]


def propagate(generator: Generator, edges: Array, nodes: int = 1) -> Array:
    """Transition matrix over all steps, (N, n, n), in blocks of steps so that memory stays small.

    `nodes` is N, needed only to size the blocks.
    """
    edges = np.asarray(edges, dtype=float)
    block = max(1, _BLOCK // max(1, nodes))
    total: Array | None = None
    for first in range(0, len(edges) - 1, block):
        part = ordered_product(step_factors(generator, edges[first : first + block + 1]))
        total = part if total is None else _product(part, total)
    assert total is not None
    return total


def rounding_error(matrix: Array, steps: int) -> Array:
    """Size of the accumulated rounding of a product of `steps` factors, (N,): eps n (8 + steps / 4) max|M_ij|.

    Linear in the number of steps, since equal steps repeat the same rounding; n terms stand in each scalar product.
    """
    largest = np.abs(matrix).max(axis=(-2, -1))
    return np.asarray(np.finfo(float).eps * matrix.shape[-1] * (8.0 + 0.25 * steps) * np.maximum(1.0, largest))


def transition(
    generator: Generator,
    *,
    breaks: ArrayLike = (),
    start: float = 0.0,
    stop: float = 1.0,
    tolerance: float = 1e-12,
    nodes: int = 1,
    steps: int = 16,
    max_steps: int = 16384,
) -> tuple[Array, Array, int]:
    """Transition matrix X(stop) with an error estimate, by step doubling and one Richardson step.

    Solves dX/ds = G(s) X, X(start) = I for N parameter nodes at once.

    Parameters
    ----------
    generator : phases (K,) or (K, N) -> (K, N, n, n).
    breaks : phases at which G jumps, (nb,) or (nb, N).
    tolerance : absolute error wanted, relative to max(1, max|M_ij|) of each node.
    nodes : N, to size the blocks.
    steps, max_steps : first and largest number of steps.

    Returns
    -------
    matrix : (N, n, n)
    error : (N,) estimate of max_ij |error of M_ij|, rounding included
    steps : the number of steps of the finest level; if `error` exceeds the tolerance, `max_steps` was reached.

    Notes
    -----
    *Accuracy*: the estimate is the difference of two successive Richardson values divided by 2^8 - 1 and multiplied by
    a safety factor of 4, plus `rounding_error`; checked against closed forms (constant coefficients, Meissner).

    >>> spring = lambda s: np.broadcast_to(np.array([[0.0, 1.0], [-np.pi**2, 0.0]]), (len(s), 1, 2, 2))
    >>> matrix, error, _ = transition(spring)
    >>> bool(abs(matrix[0, 0, 0] + 1.0) < 1e-14)
    True
    """
    coarse = propagate(generator, step_edges(steps, breaks, start, stop), nodes)
    previous: Array | None = None
    while True:
        steps *= 2
        fine = propagate(generator, step_edges(steps, breaks, start, stop), nodes)
        value = fine + (fine - coarse) / 63.0
        scale = np.maximum(1.0, np.abs(value).max(axis=(-2, -1)))
        floor = rounding_error(value, steps)
        if previous is None:
            error = np.abs(fine - coarse).max(axis=(-2, -1)) / 63.0
        else:
            error = 4.0 * np.abs(value - previous).max(axis=(-2, -1)) / 255.0
        done = bool(np.all(error <= np.maximum(tolerance * scale, floor)))
        if done or 2 * steps > max_steps:
            return value, error + floor, steps
        coarse, previous = fine, value


def _product(left: Array, right: Array) -> Array:
    """Batched product; written out for 2 x 2, where one BLAS call per matrix would cost more than the work."""
    if left.shape[-1] != 2:
        return left @ right
    out = np.empty(np.broadcast_shapes(left.shape, right.shape))
    for i in range(2):
        for j in range(2):
            np.multiply(left[..., i, 0], right[..., 0, j], out=out[..., i, j])
            out[..., i, j] += left[..., i, 1] * right[..., 1, j]
    return out


def _bracket(x: Sequence[Array], y: Sequence[Array]) -> tuple[Array, Array, Array]:
    """Commutator of trace-free 2 x 2 matrices [[a, b], [c, -a]] given as (a, b, c)."""
    (xa, xb, xc), (ya, yb, yc) = x, y
    return xb * yc - yb * xc, 2.0 * (xa * yb - ya * xb), 2.0 * (xc * ya - yc * xa)


def _factors_two(g1: Array, g2: Array, g3: Array, h: Array) -> Array:
    """Step matrices for n = 2: the commutators in the three components of sl(2), the trace apart."""
    parts = []
    for g in (g1, g2, g3):
        half_trace = 0.5 * (g[..., 0, 0] + g[..., 1, 1])
        parts.append((half_trace, 0.5 * (g[..., 0, 0] - g[..., 1, 1]), g[..., 0, 1], g[..., 1, 0]))
    mean = h * (5.0 * parts[0][0] + 8.0 * parts[1][0] + 5.0 * parts[2][0]) / 18.0
    w2, w3 = np.sqrt(15.0) / 3.0 * h, 10.0 / 3.0 * h
    a1 = [h * parts[1][i] for i in (1, 2, 3)]
    a2 = [w2 * (parts[2][i] - parts[0][i]) for i in (1, 2, 3)]
    a3 = [w3 * (parts[2][i] - 2.0 * parts[1][i] + parts[0][i]) for i in (1, 2, 3)]
    c1 = _bracket(a1, a2)
    c2 = _bracket(a1, [2.0 * u + v for u, v in zip(a3, c1, strict=True)])
    left = [-20.0 * u - v + w for u, v, w in zip(a1, a3, c1, strict=True)]
    right = [u - v / 60.0 for u, v in zip(a2, c2, strict=True)]
    outer = _bracket(left, right)
    a, b, c = (u + v / 12.0 + w / 240.0 for u, v, w in zip(a1, a3, outer, strict=True))
    square = a * a + b * c  # minus the determinant: the square of the trace-free exponent is this times I
    cosh, sinhc = cosh_sinhc(square)
    if np.any(mean):
        growth = np.exp(mean)
        cosh, sinhc = cosh * growth, sinhc * growth
    out = np.empty((*square.shape, 2, 2))
    out[..., 0, 0] = cosh + sinhc * a
    out[..., 0, 1] = sinhc * b
    out[..., 1, 0] = sinhc * c
    out[..., 1, 1] = cosh - sinhc * a
    return out


def cosh_sinhc(square: Array) -> tuple[Array, Array]:
    """cosh(sqrt(z)) and sinh(sqrt(z)) / sqrt(z) for real z of either sign."""
    largest = float(np.abs(square).max(initial=0.0))
    if not largest <= _SERIES_LIMIT:
        root = np.sqrt(np.abs(square))
        safe = np.where(root < 1e-4, 1.0, root)
        with np.errstate(over="ignore"):
            cosh = np.where(square > 0, np.cosh(root), np.cos(root))
            sinhc = np.where(square > 0, np.sinh(root), np.sin(root)) / safe
        return cosh, np.where(root < 1e-4, 1.0 + square / 6.0, sinhc)
    terms = 1
    while terms < 12 and largest**terms * _COSH[terms] > 1e-17:
        terms += 1
    cosh, sinhc = np.full_like(square, _COSH[terms]), np.full_like(square, _SINHC[terms])
    for k in range(terms - 1, -1, -1):
        cosh *= square
        cosh += _COSH[k]
        sinhc *= square
        sinhc += _SINHC[k]
    return cosh, sinhc


def _factors_general(g1: Array, g2: Array, g3: Array, h: Array) -> Array:
    """Step matrices for any n."""
    a1, a2, a3 = h * g2, np.sqrt(15.0) / 3.0 * h * (g3 - g1), 10.0 / 3.0 * h * (g3 - 2.0 * g2 + g1)
    c1 = a1 @ a2 - a2 @ a1
    inner = 2.0 * a3 + c1
    right = a2 - (a1 @ inner - inner @ a1) / 60.0
    left = c1 - 20.0 * a1 - a3
    return _exponential(a1 + a3 / 12.0 + (left @ right - right @ left) / 240.0)


def _exponential(exponent: Array) -> Array:
    """Batched matrix exponential: scaling to norm <= 1/2, Taylor to rounding in blocks of four powers, squaring."""
    norm = float(np.abs(exponent).sum(axis=-2).max(initial=0.0))
    squarings = max(0, int(np.ceil(np.log2(max(norm, 1e-300) / 0.5)))) if np.isfinite(norm) else 0
    x = exponent / 2.0**squarings
    norm /= 2.0**squarings
    degree, term = 1, norm
    while degree < 15 and term > 1e-18:
        degree += 1
        term *= norm / degree
    identity = np.eye(x.shape[-1])
    x2 = x @ x
    powers = [identity, x, x2, x2 @ x] if degree > 2 else [identity, x, x2]
    coefficients = 1.0 / np.cumprod(np.concatenate([[1.0], np.arange(1.0, 16.0)]))

    def part(block: int) -> Array:
        out = np.zeros_like(x) + coefficients[4 * block] * identity
        for j, power in enumerate(powers[1:], start=1):
            if 4 * block + j <= degree:
                out += coefficients[4 * block + j] * power
        return out

    result = part(degree // 4)
    if degree >= 4:
        fourth = x2 @ x2
        for block in range(degree // 4 - 1, -1, -1):
            result = result @ fourth + part(block)
    for _ in range(squarings):
        result = result @ result
    return result
