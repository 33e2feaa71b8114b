"""Free motion on a spring: where it rests, where it escapes, and how its frequency depends on the amplitude.

    m q'' + F(q) = 0,   E = 1/2 m q'^2 + U(q),   U' = F

F(q) is the force that HOLDS the displacement q, so q* with F(q*) = 0 is a stable rest position where F rises through
zero. Turning points q- < q+ have the same potential energy; the amplitude is half their distance, a = (q+ - q-)/2.
With q = c + a sin(theta), c = (q+ + q-)/2,

    T = sqrt(2 m) int_{-pi/2}^{pi/2} d theta / sqrt(g),    g = (E - U(q)) / ((q+ - q)(q - q-)),

where g is finite and positive up to the ends: there E - U is taken as (mean force) x (distance to the end), which
has no cancellation. The interval is cut where the spring law is not analytic, and each part is integrated by the
double-exponential rule, which does not mind algebraic singularities at its ends.

One-harmonic balance, q = c + a cos(theta):  int F d theta = 0 gives c,  w^2 = 2/(pi a m) int_0^pi F cos(theta) d theta.

References: A. H. Nayfeh and D. T. Mook, Nonlinear Oscillations (1979), chapter 2; H. Takahasi and M. Mori, Publ. RIMS
Kyoto Univ. 9 (1974) 721 (double-exponential rule).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError

if TYPE_CHECKING:
    from ._springs import Spring

__all__ = ["crossings", "harmonic_frequency", "period", "real_roots", "refine", "rest_position", "turning_points"]

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(16)
_GAUSS_NODES, _GAUSS_WEIGHTS = 0.5 * (1.0 + _GAUSS_NODES), 0.5 * _GAUSS_WEIGHTS


@lru_cache(maxsize=4)
def _double_exponential(step: float = 1.0 / 16.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes x in (0, 1), their complements 1 - x (both to full relative accuracy) and weights."""
    s = step * np.arange(-int(3.1 / step), int(3.1 / step) + 1)
    lean = 0.5 * math.pi * np.sinh(s)
    x = 1.0 / (1.0 + np.exp(-2.0 * lean))
    complement = 1.0 / (1.0 + np.exp(2.0 * lean))
    weights = step * math.pi * np.cosh(s) * x * complement
    return x, complement, weights


def refine(function: Callable[[float], float], low: float, high: float) -> float:
    """The zero of a continuous function between two points where it has opposite signs (Brent's method)."""
    from scipy.optimize import brentq

    return float(brentq(function, low, high, xtol=4e-16 * max(abs(low), abs(high)), rtol=4e-15, maxiter=300))


def crossings(force: Callable[[np.ndarray], np.ndarray], grid: np.ndarray, noise: float = 0.0) -> tuple[float, ...]:
    """Zeros of the force seen as sign changes along the ascending grid (pairs that are closer than the grid are lost).

    Neighbouring grid points at which |force| <= noise count as one zero: q = 0 if it is among them, else what lies
    between their neighbours. A run of such points that reaches the end of the grid is no equilibrium.
    """
    values = np.asarray(force(grid), dtype=float)
    signs = np.where(np.abs(values) <= noise, 0.0, np.sign(values))
    zeros: list[float] = []
    nonzero = np.flatnonzero(signs)
    for i, j in pairwise(nonzero):
        if j > i + 1 and grid[i] < 0.0 < grid[j] and np.any(grid[i + 1 : j] == 0.0):
            zeros.append(0.0)
        elif signs[i] != signs[j]:
            zeros.append(refine(lambda q: float(force(np.asarray(q))), float(grid[i]), float(grid[j])))
        elif j > i + 1:
            zeros.append(float(grid[(i + j) // 2]))
    return tuple(zeros)


def real_roots(coefficients: Any) -> tuple[float, ...]:
    """Real roots of a polynomial (lowest power first), each polished by Newton steps; none for the zero polynomial.

    >>> real_roots((0.0, 4.0, 0.0, -1.0))
    (-2.0, 0.0, 2.0)
    """
    values = np.trim_zeros(np.asarray(coefficients, dtype=float), "b")
    if len(values) < 2:
        return ()
    lowest = int(np.flatnonzero(values)[0])
    zeros = [0.0] if lowest else []
    core = values[lowest:]
    if len(core) > 1:
        unit = float((abs(core[0]) / abs(core[-1])) ** (1.0 / (len(core) - 1)))  # roots of order one
        scaled = core * unit ** np.arange(len(core))
        slope = np.polynomial.polynomial.polyder(scaled)
        for root in np.polynomial.polynomial.polyroots(scaled / np.max(np.abs(scaled))):
            if abs(root.imag) > 1e-7 * max(1.0, abs(root)):
                continue
            x = float(root.real)
            for _ in range(3):
                steep = float(np.polynomial.polynomial.polyval(x, slope))
                x -= float(np.polynomial.polynomial.polyval(x, scaled)) / steep if steep else 0.0
            zeros.append(x * unit)
    return tuple(sorted(zeros))


def _first_sign(spring: Spring, start: float, end: float) -> float:
    """Sign of the force on the way from an equilibrium to its neighbour (a dead zone is passed over)."""
    reach = end if math.isfinite(end) else start + math.copysign(2.0 * abs(start) + 2.0 * spring.length_scale, end)
    q = start + np.array([0.5, 0.25, 0.75, 0.95]) * (reach - start)
    signs = np.sign(np.asarray(spring.force(q), dtype=float))
    return float(next((s for s in signs if s), 0.0))


def rest_position(spring: Spring, equilibria: Iterable[float]) -> tuple[float, float, float]:
    """(rest, lower neighbour, upper neighbour): the stable equilibrium nearest to q = 0, the positive one of two.

    The neighbours are the unstable equilibria at which a free motion escapes; infinite, or the end of the domain of a
    spring that touches something there, where there is none.
    """
    zeros = sorted(set(equilibria))
    low, high = spring.domain
    stable = []
    for i, q in enumerate(zeros):
        left, right = (zeros[i - 1] if i else low), (zeros[i + 1] if i + 1 < len(zeros) else high)
        if _first_sign(spring, q, left) < 0.0 < _first_sign(spring, q, right):
            lower = zeros[i - 1] if i else -math.inf
            upper = zeros[i + 1] if i + 1 < len(zeros) else math.inf
            stable.append((q, lower, upper))
    if not stable:
        raise InputError(
            f"{type(spring).__name__} has no stable rest position: nothing brings it back on at least one side; "
            "add a weight or a second spring in parallel (spring + PolynomialSpring((weight,)))"
        )
    return min(stable, key=lambda entry: (abs(entry[0]), -entry[0]))


def turning_points(spring: Spring, amplitude: float) -> tuple[float, float]:
    """(q-, q+) with U(q-) = U(q+) about the rest position and (q+ - q-)/2 = amplitude."""
    rest, (low, high) = spring.rest, spring.well
    if spring.odd and rest == 0.0:
        if not amplitude < high:
            raise _too_large(spring, amplitude, high)
        return -amplitude, amplitude
    a = max(low + amplitude, rest - amplitude)
    b = min(high - amplitude, rest + amplitude)
    if not a < b:
        raise _too_large(spring, amplitude, 0.5 * (high - low))

    def imbalance(centre: float) -> float:
        return float(spring.energy(centre + amplitude)) - float(spring.energy(centre - amplitude))

    inset = 1e-9 * (b - a)  # the ends themselves may lie on a singular contact
    if not imbalance(a + inset) < 0.0 < imbalance(b - inset):
        raise _too_large(spring, amplitude, 0.5 * (high - low))
    centre = refine(imbalance, a + inset, b - inset)
    return centre - amplitude, centre + amplitude


def _too_large(spring: Spring, amplitude: float, limit: float) -> InputError:
    return InputError(
        f"{type(spring).__name__}: amplitude must stay inside the well around the rest position q = {spring.rest:g}, "
        f"which ends at ({spring.well[0]:g}, {spring.well[1]:g}) (escape, contact or end of data), so below {limit:g} "
        f"at most; got {amplitude:g}"
    )


def _cuts(spring: Spring, centre: float, amplitude: float) -> np.ndarray:
    """Angles in [-pi/2, pi/2] at which q = centre + amplitude sin(angle) meets a break of the law, ends included."""
    inner = [b for b in (*spring.breaks, centre) if abs(b - centre) < amplitude * (1.0 - 1e-12)]
    return np.concatenate([[-0.5 * math.pi], np.arcsin((np.unique(inner) - centre) / amplitude), [0.5 * math.pi]])


def _mean_force(spring: Spring, q: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Mean of the force between q and q + distance (16-point Gauss)."""
    return np.sum(spring.force(q[:, None] + distance[:, None] * _GAUSS_NODES) * _GAUSS_WEIGHTS, axis=1)


def period(spring: Spring, amplitude: float, inertia: float) -> float:
    """Exact period of the free motion whose half peak-to-peak displacement is `amplitude`."""
    lower, upper = turning_points(spring, amplitude)
    centre = 0.5 * (lower + upper)
    cuts = _cuts(spring, centre, amplitude)
    level = {1: float(spring.energy(upper)), -1: float(spring.energy(lower))}
    x, complement, weights = _double_exponential()
    total = 0.0
    for start, end in pairwise(cuts):
        width = end - start
        side = 1 if 0.5 * (start + end) > 0.0 else -1
        to_end = (0.5 * math.pi - end) + width * complement if side == 1 else (start + 0.5 * math.pi) + width * x
        near = 2.0 * amplitude * np.sin(0.5 * to_end) ** 2  # distance to the nearer turning point
        far = 2.0 * amplitude - near
        q = upper - near if side == 1 else lower + near
        well = level[side] - np.asarray(spring.energy(q), dtype=float)
        last = abs(start if side == -1 else end) > 0.5 * math.pi - 1e-12
        room = min(
            amplitude * (1.0 - math.cos(width)), abs((spring.domain[1 if side == 1 else 0]) - (upper, lower)[side < 0])
        )
        close = last & (near < 0.1 * room)
        if np.any(close):
            well[close] = near[close] * side * _mean_force(spring, q[close], side * near[close])
        total += width * float(np.sum(weights * np.sqrt(near * far / well)))
    return math.sqrt(2.0 * inertia) * total


def _cosine_integrals(spring: Spring, centre: float, amplitude: float) -> tuple[float, float]:
    """int_0^pi F(centre + amplitude cos) d theta, and the same with the weight cos(theta)."""
    cuts = _cuts(spring, centre, amplitude)
    x, _, weights = _double_exponential()
    mean = first = 0.0
    for start, end in pairwise(cuts):
        sine = np.sin(start + (end - start) * x)
        force = np.asarray(spring.force(centre + amplitude * sine), dtype=float)
        mean += (end - start) * float(np.sum(weights * force))
        first += (end - start) * float(np.sum(weights * force * sine))
    return mean, first


def harmonic_frequency(spring: Spring, amplitude: float, inertia: float) -> float:
    """Angular frequency of the free motion by one-harmonic balance with a static offset."""
    lower, upper = turning_points(spring, amplitude)
    centre = 0.5 * (lower + upper)
    if not (spring.odd and centre == 0.0):
        low, high = spring.well
        a, b = max(low + amplitude, spring.rest - amplitude), min(high - amplitude, spring.rest + amplitude)
        inset = 1e-9 * (b - a)
        centre = refine(lambda c: _cosine_integrals(spring, c, amplitude)[0], a + inset, b - inset)
    square = 2.0 / (math.pi * amplitude * inertia) * _cosine_integrals(spring, centre, amplitude)[1]
    return math.sqrt(square)
