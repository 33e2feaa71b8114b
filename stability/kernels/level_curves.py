"""Zero curves G(u, v) = 0 in the square [-1, 1]^2, from exact gradients: roots on the rim, tips, tracing.

A curve enters the square through its rim or is closed; a closed curve has points where its tangent is parallel to the
u axis, that is G = G_u = 0. Roots on the rim and such points together therefore reach every smooth curve, however
narrow the region it bounds: extremes of G along lines are looked at, not only its signs on a mesh.

Tracing is a predictor along the tangent (-G_v, G_u) / |grad G| and a Newton corrector along the gradient, for all
starts at once; the step is halved where the tangent turns by more than 0.2 rad and grown where it turns little.

`function(u (B,), v (B,)) -> (G, G_u, G_v)`, each (B,).

Reference: E. L. Allgower, K. Georg, Introduction to numerical continuation methods (2003), chapters 2 and 6.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["critical_points", "refine_root", "rim_roots", "trace"]

Array = NDArray[np.float64]
Function = Callable[[Array, Array], tuple[Array, Array, Array]]

_TURN = 0.2
_STEP_LARGEST, _STEP_SMALLEST = 0.03, 1e-9


def refine_root(function: Callable[[Array], tuple[Array, Array]], lo: Array, hi: Array) -> Array:
    """Roots in brackets [lo, hi] (B,) of a function with derivative, by Newton's method inside shrinking brackets."""
    lo, hi = lo.copy(), hi.copy()
    at_lo = function(lo)[0]
    x = 0.5 * (lo + hi)
    for _ in range(80):
        value, slope = function(x)
        left = np.sign(value) == np.sign(at_lo)
        lo, hi = np.where(left, x, lo), np.where(left, hi, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            new = x - value / slope
        inside = (new >= lo) & (new <= hi) & np.isfinite(new)
        new = np.where(value == 0, x, np.where(inside, new, 0.5 * (lo + hi)))
        if np.all(np.abs(new - x) <= 2e-16 * np.maximum(1.0, np.abs(x))):
            return new
        x = new
    return x


def rim_roots(function: Function, samples: int = 801) -> Array:
    """Points of the zero set on the rim of the square: (B, 2)."""
    found = []
    s = np.linspace(-1.0, 1.0, samples)
    for axis, level in ((1, -1.0), (1, 1.0), (0, -1.0), (0, 1.0)):

        def along(t: Array, axis: int = axis, level: float = level) -> tuple[Array, Array]:
            fixed = np.full_like(t, level)
            g, gu, gv = function(t, fixed) if axis == 1 else function(fixed, t)
            return g, gu if axis == 1 else gv

        def slope(t: Array, along: Callable[[Array], tuple[Array, Array]] = along) -> tuple[Array, Array]:
            step = 1e-6
            return along(t)[1], (along(t + step)[1] - along(t - step)[1]) / (2.0 * step)

        g, dg = along(s)
        points = s
        turning = np.flatnonzero((np.sign(dg[1:]) != np.sign(dg[:-1])) & (np.sign(g[1:]) == np.sign(g[:-1])))
        if turning.size:  # an extreme between two samples may reach beyond zero: a region narrower than the mesh
            points = np.sort(np.concatenate([s, refine_root(slope, s[turning], s[turning + 1])]))
            g = along(points)[0]
        change = np.flatnonzero(np.sign(g[1:]) * np.sign(g[:-1]) < 0)
        roots = refine_root(along, points[change], points[change + 1])
        roots = np.concatenate([roots, points[g == 0]])
        fixed = np.full_like(roots, level)
        found.append(np.stack([roots, fixed] if axis == 1 else [fixed, roots], axis=1))
    return np.concatenate(found)


def critical_points(function: Function, rows: int = 101, columns: int = 241) -> Array:
    """Points with G = G_u = 0 inside the square, (B, 2), and whether v is least there, in a third column (1 or 0)."""
    u, v = np.linspace(-1.0, 1.0, columns), np.linspace(-1.0, 1.0, rows)
    U, V = np.tile(u, rows), np.repeat(v, columns)
    gu = function(U, V)[1].reshape(rows, columns)
    row, column = np.nonzero(np.sign(gu[:, 1:]) * np.sign(gu[:, :-1]) <= 0)
    if row.size == 0:
        return np.zeros((0, 3))
    at = v[row]
    step = 1e-6

    def slope(t: Array) -> tuple[Array, Array]:
        return function(t, at)[1], (function(t + step, at)[1] - function(t - step, at)[1]) / (2.0 * step)

    ridge = refine_root(slope, u[column], u[column + 1])
    g, _, gv = function(ridge, at)
    with np.errstate(divide="ignore", invalid="ignore"):
        predicted = at - g / gv
    near = np.isfinite(predicted) & (np.abs(predicted - at) < 4.0 / (rows - 1))
    x, y = ridge[near], np.clip(predicted[near], -1.0, 1.0)
    if x.size == 0:
        return np.zeros((0, 3))
    for _ in range(12):
        g, g_u, g_v = function(x, y)
        _, g_uu, g_uv = _second(function, x, y)
        determinant = g_u * g_uv - g_v * g_uu
        with np.errstate(divide="ignore", invalid="ignore"):
            dx = (g * g_uv - g_v * g_u) / determinant
            dy = (g_u * g_u - g * g_uu) / determinant
        ok = np.isfinite(dx) & np.isfinite(dy)
        dx, dy = np.where(ok, dx, 0.0), np.where(ok, dy, 0.0)
        limit = np.maximum(1.0, np.hypot(dx, dy) / 0.05)
        x, y = x - dx / limit, y - dy / limit
    g, g_u, g_v = function(x, y)
    _, g_uu, _ = _second(function, x, y)
    good = ok & (np.hypot(dx, dy) < 1e-9) & (np.abs(x) <= 1.0) & (np.abs(y) < 1.0) & (np.abs(g_v) > 0)
    least = (-g_uu / np.where(g_v == 0, 1.0, g_v)) > 0
    points = np.stack([x, y, least.astype(float)], axis=1)[good]
    kept: list[Array] = []
    for p in points[np.lexsort((points[:, 1], points[:, 0]))]:
        if all(np.hypot(*(p - q)[:2]) > 1e-7 for q in kept):
            kept.append(p)
    return np.array(kept).reshape(-1, 3)


def _second(function: Function, u: Array, v: Array) -> tuple[Array, Array, Array]:
    """G, G_uu, G_uv by central differences of the exact gradient."""
    h = 1e-5
    right, left = function(u + h, v)[1], function(u - h, v)[1]
    up, down = function(u, v + h)[1], function(u, v - h)[1]
    return function(u, v)[0], (right - left) / (2.0 * h), (up - down) / (2.0 * h)


def _correct(function: Function, p: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Points on the curve next to p (B, 2), unit tangents (B, 2), and whether Newton converged (B,)."""
    for _ in range(4):
        g, gu, gv = function(p[:, 0], p[:, 1])
        size = np.maximum(gu * gu + gv * gv, 1e-300)
        move = (g / size)[:, None] * np.stack([gu, gv], axis=1)
        p = p - move
        last = np.hypot(move[:, 0], move[:, 1])
    _, gu, gv = function(p[:, 0], p[:, 1])
    tangent = np.stack([-gv, gu], axis=1) / np.maximum(np.hypot(gu, gv), 1e-300)[:, None]
    return p, tangent, np.asarray(last < 1e-11)


def trace(
    function: Function, starts: Array, signs: Array, first_step: float = 1e-3, limit: int = 6000
) -> list[tuple[Array, str]]:
    """Follow zero curves from points on them.

    Parameters
    ----------
    starts : (B, 2) points with G = 0.
    signs : (B,) +1 or -1 along the tangent (-G_v, G_u).

    Returns
    -------
    One (points (K, 2), how it ended) per start; ends: "rim" (the last point lies on the rim), "closed", "stopped"
    (the gradient vanishes or jumps) or "limit".
    """
    count = len(starts)
    paths: list[list[Array]] = [[p] for p in starts]
    ends = ["limit"] * count
    p, tangent, _ = _correct(function, starts.copy())
    direction = tangent * signs[:, None]
    step = np.full(count, first_step)
    travelled = np.zeros(count)
    active = np.arange(count)
    for _ in range(limit):
        if active.size == 0:
            break
        trial = p[active] + step[active, None] * direction[active]
        new, tangent, converged = _correct(function, trial)
        tangent = tangent * np.sign(np.einsum("bi,bi->b", tangent, direction[active]))[:, None]
        turn = np.arccos(np.clip(np.einsum("bi,bi->b", tangent, direction[active]), -1.0, 1.0))
        moved = np.hypot(*(new - p[active]).T)
        good = converged & (turn < _TURN) & (moved < 2.0 * step[active]) & (moved > 0.3 * step[active])
        finished = np.zeros(active.size, dtype=bool)
        for k, lane in enumerate(active):
            if np.abs(trial[k]).max() > 1.0:
                point = _onto_rim(function, p[lane], trial[k])
                if point is not None and np.hypot(*(point - p[lane])) < 2.0 * step[lane]:
                    paths[lane].append(point)
                    ends[lane], finished[k] = "rim", True
                    continue
                good[k] = False
            if not good[k]:
                step[lane] *= 0.4
                if step[lane] < _STEP_SMALLEST:
                    ends[lane], finished[k] = "stopped", True
                continue
            if np.abs(new[k]).max() > 1.0:
                step[lane] *= 0.4
                continue
            back = np.hypot(*(new[k] - starts[lane]))
            if travelled[lane] > 8.0 * step[lane] and back < 0.9 * step[lane]:
                paths[lane].append(starts[lane])
                ends[lane], finished[k] = "closed", True
                continue
            travelled[lane] += moved[k]
            p[lane], direction[lane] = new[k], tangent[k]
            paths[lane].append(new[k])
            if turn[k] < 0.35 * _TURN:
                step[lane] = min(1.6 * step[lane], _STEP_LARGEST)
        active = active[~finished]
    return [(np.array(path), end) for path, end in zip(paths, ends, strict=True)]


def _onto_rim(function: Function, inside: Array, outside: Array) -> Array | None:
    """The point of the curve on the rim between a point inside and one outside the square; None if there is none."""
    beyond = np.abs(outside) > 1.0
    gap = outside - inside
    fractions = np.where(beyond, (np.sign(outside) - inside) / np.where(beyond, gap, 1.0), np.inf)
    side = int(fractions.argmin())
    point = inside + fractions[side] * gap
    point[side] = np.sign(outside[side])
    other = 1 - side
    point[other] = np.clip(point[other], -1.0, 1.0)
    for _ in range(20):
        g, gu, gv = function(point[:1], point[1:])
        slope = float((gu, gv)[other][0])
        if slope == 0.0:
            return None
        change = float(g[0]) / slope
        if abs(change) > 0.05 or abs(point[other] - change) > 1.0:
            return None
        point[other] -= change
        if abs(change) < 1e-15:
            break
    return point if abs(change) < 1e-11 else None
