"""Boundary curves and tongue tips of a chart, traced with the exact gradients of its tiles.

The limit of stability is where the largest multiplier has modulus 1. With theta_c = -sigma T (the damping over one
period) the curves are zero sets of

    hill     p - sinh^2(theta_c / 2)  (+1),      -m - sinh^2(theta_c / 2)  (-1),
             undamped: the four factors one by one, each with simple zeros, so that narrow tongues are not lost
    two      tr / 2 - cosh(theta_c)  (+1),      -tr / 2 - cosh(theta_c)  (-1)
    n > 2    log|mu| of the largest multiplier, its gradient from left and right eigenvectors;
             undamped reciprocal quartics: P(1), P(-1) and the discriminant of the equation for w = z + 1/z (pair)

A tip solves {G = 0, dG/dx = 0} with y least. The order n of a tongue of a scalar equation is the number of half turns
of its solution in one period (the multiplier's sign fixes the parity, the Prüfer angle is off by less than one).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.level_curves import critical_points, rim_roots, trace
from ..kernels.propagators import step_edges, step_factors
from ..kernels.spectral_radius import largest_root_slope
from ..results.chart import BoundaryCurve, StabilityChart, TongueTip, normalised_multipliers
from ..results.tiles import Layer, evaluate
from .sampling import Sampler

__all__ = ["Tracer"]

Array = NDArray[np.float64]
Level = Callable[[Array, Array], tuple[Array, Array, Array]]


@dataclass(frozen=True, eq=False)
class Tracer:
    """Finds the curves of a chart; a chart calls it at the first access to `boundaries` or `tips`."""

    samplers: tuple[Sampler, ...]

    def __call__(self, chart: StabilityChart) -> tuple[list[BoundaryCurve], list[TongueTip]]:
        """Boundary curves and tips, in the chart's own coordinates, ordered by kind and position."""
        curves: list[BoundaryCurve] = []
        tips: list[TongueTip] = []
        for sampler, layer in zip(self.samplers, chart.layers, strict=True):
            for kind, level in _levels(layer):
                found, bottoms = _curves_of(chart, level, (31, 91) if layer.form == "matrix" else (101, 241))
                for path in found:
                    for piece in _limits(chart, path):
                        middle = piece[len(piece) // 2]
                        order = _order(sampler, middle[0], middle[1], kind)
                        curves.append(BoundaryCurve(piece[:, 0], piece[:, 1], _kind(chart, middle, kind), order))
                for x, y in bottoms:
                    if _limits(chart, np.array([[x, y]])):
                        order = _order(sampler, x, y, kind)
                        tips.append(TongueTip(float(x), float(y), _kind(chart, (x, y), kind), order))
        curves.sort(key=lambda c: (c.order is None, c.order or 0, c.kind, float(c.x[0])))
        tips.sort(key=lambda t: (t.order is None, t.order or 0, t.x))
        return curves, tips


def _order(sampler: Sampler, x: float, y: float, kind: str) -> int | None:
    """Tongue order at a point, for scalar equations."""
    structure, linear = sampler.structure, sampler.linear
    if not structure.scalar or kind not in ("+1", "-1"):
        return None
    P = sampler.parameters(np.array([x]), np.array([y]))
    period, field = linear.period(P), linear.bind(P)
    factors = step_factors(lambda s: field(s) * period[:, None, None], step_edges(400, linear.breaks(P)))[:, 0]
    vector, turned, angle = np.array([1.0, 0.0]), 0.0, 0.0
    for factor in factors:
        vector = factor @ vector
        vector /= np.hypot(*vector)
        new = np.arctan2(-vector[1], vector[0])
        turned += np.mod(new - angle + np.pi, 2.0 * np.pi) - np.pi
        angle = new
    parity = 0 if kind == "+1" else 1
    return max(parity, 2 * int(np.rint((turned / np.pi - parity) / 2.0)) + parity)


def _unit(chart: StabilityChart) -> tuple[Array, Array]:
    """Centre and half widths of the window."""
    lo, hi = np.array([chart.x[0], chart.y[0]]), np.array([chart.x[-1], chart.y[-1]])
    return 0.5 * (lo + hi), 0.5 * (hi - lo)


def _levels(layer: Layer) -> list[tuple[str, Level]]:
    """The functions whose zeros are the boundary curves, with the kind of each."""

    def fields(x: Array, y: Array) -> tuple[Array, Array, Array]:
        return evaluate(layer.tiles, x, y)

    def critical(x: Array, y: Array) -> tuple[Array, Array, Array]:
        """theta_c = -sigma T and its gradient."""
        value, in_x, in_y = evaluate(layer.tiles, x, y, "clock")
        chi, sigma = value
        parts = [-(d[1] * chi - sigma * d[0]) / chi**2 for d in (in_x, in_y)]
        return -sigma / chi, parts[0], parts[1]

    def factor(i: int) -> Level:
        def level(x: Array, y: Array) -> tuple[Array, Array, Array]:
            v, in_x, in_y = fields(x, y)
            return v[i], in_x[i], in_y[i]

        return level

    def product(i: int, sign: float) -> Level:
        def level(x: Array, y: Array) -> tuple[Array, Array, Array]:
            v, in_x, in_y = fields(x, y)
            c, c_x, c_y = critical(x, y)
            half = 0.5 * np.sinh(c)
            out = [sign * (d[i] * v[i + 1] + v[i] * d[i + 1]) - half * e for d, e in ((in_x, c_x), (in_y, c_y))]
            return sign * v[i] * v[i + 1] - np.sinh(0.5 * c) ** 2, out[0], out[1]

        return level

    def trace_level(sign: float) -> Level:
        def level(x: Array, y: Array) -> tuple[Array, Array, Array]:
            v, in_x, in_y = fields(x, y)
            c, c_x, c_y = critical(x, y)
            out = [0.5 * sign * d[3] - np.sinh(c) * e for d, e in ((in_x, c_x), (in_y, c_y))]
            return 0.5 * sign * v[3] - np.cosh(c), out[0], out[1]

        return level

    if layer.form == "hill":
        if layer.neutral:
            return [("+1", factor(0)), ("+1", factor(1)), ("-1", factor(2)), ("-1", factor(3))]
        return [("+1", product(0, 1.0)), ("-1", product(2, -1.0))]
    if layer.form == "two":
        return [("+1", trace_level(1.0)), ("-1", trace_level(-1.0))]
    if layer.neutral:
        return _reciprocal_levels(layer) if layer.form == "reciprocal" else []
    if layer.form in ("four", "reciprocal"):
        return [("any", _largest_of_four(layer))]
    return [("any", _largest_multiplier(layer))]


def _reciprocal_levels(layer: Layer) -> list[tuple[str, Level]]:
    """P(1), P(-1) and the discriminant for undamped systems of two degrees of freedom."""

    def combination(sign: float) -> Level:
        def level(x: Array, y: Array) -> tuple[Array, Array, Array]:
            v, *slopes = evaluate(layer.tiles, x, y, count=3)
            out = [d[1] - sign * (d[0] + d[2]) for d in slopes]
            return v[1] + 2.0 - sign * (v[0] + v[2]), out[0], out[1]

        return level

    def discriminant(x: Array, y: Array) -> tuple[Array, Array, Array]:
        v, *slopes = evaluate(layer.tiles, x, y, count=3)
        c1 = 0.5 * (v[0] + v[2])
        out = [c1 * (d[0] + d[2]) - 4.0 * d[1] for d in slopes]
        return c1 * c1 - 4.0 * v[1] + 8.0, out[0], out[1]

    return [("+1", combination(1.0)), ("-1", combination(-1.0)), ("pair", discriminant)]


def _largest_of_four(layer: Layer) -> Level:
    """log|mu| of the largest root of the quartic, with its gradient."""

    def level(x: Array, y: Array) -> tuple[Array, Array, Array]:
        c, *slopes = evaluate(layer.tiles, x, y, count=3)
        (chi, sigma), *clock_slopes = evaluate(layer.tiles, x, y, "clock")
        theta, parts = largest_root_slope(c, slopes)
        damped = [(e[1] * chi - sigma * e[0]) / chi**2 for e in clock_slopes]
        return theta + sigma / chi, parts[0] + damped[0], parts[1] + damped[1]

    return level


def _largest_multiplier(layer: Layer) -> Level:
    """log|mu| of the largest multiplier, with its gradient from left and right eigenvectors."""
    n = layer.states

    def level(x: Array, y: Array) -> tuple[Array, Array, Array]:
        v, *slopes = evaluate(layer.tiles, x, y)
        (chi, sigma), *clock_slopes = evaluate(layer.tiles, x, y, "clock")
        M = v[-n * n :].T.reshape(-1, n, n)
        values, right = np.linalg.eig(M)
        lead = np.abs(values).argmax(axis=1)
        rows = np.arange(len(M))
        z, vector = values[rows, lead], right[rows, :, lead]
        other = np.linalg.eig(M.transpose(0, 2, 1))
        match = np.abs(other[0] - z[:, None]).argmin(axis=1)
        left = other[1][rows, :, match]
        norm = np.einsum("bi,bi->b", left, vector)
        out = []
        for d, e in zip(slopes, clock_slopes, strict=True):
            dM = d[-n * n :].T.reshape(-1, n, n)
            with np.errstate(divide="ignore", invalid="ignore"):
                dz = np.einsum("bi,bij,bj->b", left, dM, vector) / norm
            out.append(np.nan_to_num((dz / z).real) + (e[1] * chi - sigma * e[0]) / chi**2)
        return np.log(np.abs(z)) + sigma / chi, out[0], out[1]

    return level


def _curves_of(chart: StabilityChart, level: Level, mesh: tuple[int, int]) -> tuple[list[Array], Array]:
    """All zero curves of one level function in the window, and the points on them where y is least.

    `mesh` (rows, columns) is where extremes along x are looked for.
    """
    centre, half = _unit(chart)

    def function(u: Array, v: Array) -> tuple[Array, Array, Array]:
        g, gx, gy = level(centre[0] + half[0] * u, centre[1] + half[1] * v)
        return g, gx * half[0], gy * half[1]

    rim, special = _distinct(rim_roots(function)), critical_points(function, *mesh)
    _, gu, gv = function(rim[:, 0], rim[:, 1])
    # into the square: the tangent (-gv, gu) must point away from the side the root lies on
    side = np.abs(rim).argmax(axis=1)
    inward = -np.sign(rim[np.arange(len(rim)), side])
    tangent = np.stack([-gv, gu], axis=1)[np.arange(len(rim)), side]
    signs = np.where(np.sign(tangent) == 0, 1.0, np.sign(tangent)) * inward
    paths: list[Array] = []
    used = np.zeros(len(rim), dtype=bool)
    for i, (path, end) in enumerate(trace(function, rim, signs) if len(rim) else []):
        if used[i] or len(path) < 2:
            continue
        used[i] = True
        if end == "rim":
            twin = np.hypot(*(rim - path[-1]).T)
            twin[i] = np.inf
            if twin.min(initial=np.inf) < 1e-6:
                used[int(twin.argmin())] = True
        paths.append(path)
    seeds = [*special[:, :2], *_sign_changes(function)]
    for seed in seeds:
        if any(_distance(path, seed) < 2e-3 for path in paths):
            continue
        forward, backward = trace(function, np.array([seed, seed]), np.array([1.0, -1.0]))
        if forward[1] == "closed":
            paths.append(forward[0])
        elif len(forward[0]) + len(backward[0]) > 3:
            paths.append(np.concatenate([backward[0][::-1], forward[0][1:]]))
    bottoms = special[special[:, 2] > 0, :2]
    return [_with_special(path, special[:, :2]) * half + centre for path in paths], bottoms * half + centre


def _distinct(points: Array) -> Array:
    """Points (B, 2) without repetitions."""
    kept: list[Array] = []
    for p in points:
        if all(np.abs(p - q).max() > 1e-9 for q in kept):
            kept.append(p)
    return np.array(kept).reshape(-1, 2)


def _sign_changes(function: Level, mesh: int = 61) -> Array:
    """Roots on the edges of a coarse mesh: starts for curves that neither the rim nor a tip reaches."""
    s = np.linspace(-1.0, 1.0, mesh)
    U, V = np.meshgrid(s, s)
    g = function(U.ravel(), V.ravel())[0].reshape(mesh, mesh)
    j, i = np.nonzero(np.sign(g[:, 1:]) * np.sign(g[:, :-1]) < 0)
    lo, hi, at = s[i], s[i + 1], s[j]
    low = function(lo, at)[0]
    for _ in range(50):
        middle = 0.5 * (lo + hi)
        same = np.sign(function(middle, at)[0]) == np.sign(low)
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    return np.stack([0.5 * (lo + hi), at], axis=1)


def _distance(path: Array, point: Array) -> float:
    """Distance of a point from a polygon, end pieces included."""
    a, d = path[:-1], np.diff(path, axis=0)
    length = np.maximum((d * d).sum(axis=1), 1e-300)
    s = np.clip(((point - a) * d).sum(axis=1) / length, 0.0, 1.0)
    return float(np.hypot(*(a + s[:, None] * d - point).T).min())


def _with_special(path: Array, special: Array) -> Array:
    """The path with the tips and tops that lie on it put in."""
    for point in special:
        d = np.hypot(*(path - point).T)
        near = int(d.argmin())
        spacing = np.hypot(*np.diff(path, axis=0).T).max()
        if d[near] > spacing or d[near] < 1e-12 or len(path) < 3:
            continue
        a, e = path[:-1], np.diff(path, axis=0)
        s = np.clip(((point - a) * e).sum(axis=1) / np.maximum((e * e).sum(axis=1), 1e-300), 0.0, 1.0)
        off = np.hypot(*(a + s[:, None] * e - point).T)
        k = int(off.argmin())
        if off[k] < 0.2 * max(np.hypot(*e[k]), 1e-9):
            path = np.insert(path, k + 1, point, axis=0)
    return path


def _limits(chart: StabilityChart, path: Array) -> list[Array]:
    """The pieces of a path on which it is the limit of stability (the largest multiplier has modulus 1)."""
    on = np.ones(len(path), dtype=bool)
    for layer in chart.layers:
        chi, sigma = evaluate(layer.tiles, path[:, 0], path[:, 1], "clock")[0]
        growth = sigma + chi * _theta(layer, path)
        scale = np.maximum(np.abs(sigma), chi)
        on &= (growth <= 1e-5 * scale) & (sigma <= 1e-12 * scale)
    if on.all():
        return [path]
    pieces, start = [], None
    for i, flag in enumerate([*on.tolist(), False]):
        if flag and start is None:
            start = i
        elif not flag and start is not None:
            if i - start > 1 or len(path) == 1:
                pieces.append(path[start:i])
            start = None
    return pieces


def _theta(layer: Layer, path: Array) -> Array:
    """log of the largest modulus of the normalised multipliers at points (B, 2)."""
    fields = evaluate(layer.tiles, path[:, 0], path[:, 1])[0]
    each = [normalised_multipliers(layer.form, f, layer.states) for f in fields.T]
    return np.log(np.abs(np.array(each)).max(axis=1))


def _kind(chart: StabilityChart, point: Sequence[float] | Array, kind: str) -> str:
    """The kind of a curve at a point; looked up in the largest multiplier where the level does not say it."""
    if kind != "any":
        return kind
    x, y = (float(np.clip(v, axis[0], axis[-1])) for v, axis in zip(point, (chart.x, chart.y), strict=True))
    lead = chart.at(**{chart.x_name: x, chart.y_name: y}).multipliers[0]
    if abs(lead.imag) > 1e-6 * abs(lead):
        return "pair"
    return "+1" if lead.real > 0 else "-1"
