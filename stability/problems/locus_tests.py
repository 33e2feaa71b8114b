r"""Points of codimension two on a curve of special points: smooth functions whose zeros they are.

With the values lambda_i of the spectrum (multipliers, eigenvalues; no trivial ones), chi(z) = prod (z - lambda_i), and
the product pi over pairs of the values that are not critical, lambda_i + lambda_j (eigenvalues; lambda_i lambda_j - 1):

    curve             function -> point
    fold              chi'(0) -> Bogdanov-Takens;  pi -> zero-Hopf;  of orbits: chi'(1) -> resonance 1:1;
                      chi(-1) -> fold-flip
    Hopf              omega^2 -> Bogdanov-Takens;  product of the others -> zero-Hopf;  pi -> double Hopf;
                      first Lyapunov coefficient -> generalized Hopf
    period doubling   chi'(-1) -> resonance 1:2;  chi(1) -> fold-flip;  cubic coefficient -> generalized period doubling
    Neimark-Sacker    c - 1, c + 1, c + 1/2, c -> resonances 1:1, 1:2, 1:3, 1:4 (c = cos theta; c may touch +-1 and turn
                      back: dc/ds);  d -> Chenciner
    on half a period  chi'(-1), c^2 - 1, c + 1/2, c -> resonances 1:1, 1:1, 1:3, 1:2 of the whole one

chi' at the critical value is a symmetric function of all values, smooth where two of them meet (each of them alone is
not). Where the rate of the followed parameter vanishes the curve turns (fold); where both rates do, on a fold curve, it
is a cusp.

Where the rate of the second parameter vanishes it is extreme: the tip of a tongue (extremum). On a fold curve the
reduced equation h(x, lambda_1) = 0 at that lambda_2 is singular, h = h_x = h_1 = 0, and the sign of
h_xx h_11 - h_x1^2 = - lambda_2'' h_2 h_xx (derivatives along the curve, l_1' = 1) tells an isola centre (+: a closed
branch is born) from a merger (-: two branches meet and change partners).

A zero that is a pole, or a neutral saddle (real values whose sum is 0, whose product is 1), is no such point.
Reference: Kuznetsov (2004), chapters 8, 9 and section 10.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..words import Kind
from .locus_newton import sharpened
from .locus_system import ExtendedLinearisation

if TYPE_CHECKING:
    from .locus import Locus

__all__ = ["confirmed", "monitors"]

Complex = NDArray[np.complex128]
_STILL = 1e-4  # scaled rate of both parameters at a cusp
_TOUCHED = 1e-5  # distance of cos(theta) from its limit where it touches
_STILL_JUMP = 1e-2  # the same where the tangent is not known: folds of doubled orbits that shrink to the simple one
_STRAIGHT = 1e-10  # a second difference below this part of lambda_2's scale is rounding: it is constant
_NOISE = 1e-7  # a scaled rate below this is rounding: the parameter is constant along the curve
_ASIDE = 1e-3  # arclength to the neighbours that tell the sign of a second derivative


class Rate:
    """The rate of a parameter along the curve; `exact` takes the tangent of the point's own derivatives.

    `primitive` is the parameter itself, in the same scale.
    """

    def __init__(self, of: Callable[[Any], float], primitive: Callable[[Any], float]) -> None:
        self.of, self.primitive = of, primitive

    def __call__(self, point: Any) -> float:
        value = self.of(point)
        return value if abs(value) > _NOISE else 0.0

    def exact(self, point: Any) -> float:
        """The same without the error that a cheap last Newton step leaves in the tangent."""
        return self.of(sharpened(point))


def _first(point: Any) -> float:
    return float(point.tangent.parameter * point.tangent.weight)


def _second(point: Any) -> float:
    return float(point.problem.parts(point.tangent.u)[1]) / float(point.problem.scale)


def _third(point: Any) -> float:
    return float(point.problem.parts(point.tangent.u)[2][0])


_TURNS = Rate(_first, lambda point: float(point.parameter * point.tangent.weight))
_EXTREMA = Rate(_second, lambda point: float(point.problem.parts(point.u)[1]) / float(point.problem.scale))
_TOUCHES = Rate(_third, lambda point: float(point.problem.parts(point.u)[2][0]))


def monitors(curve: Locus) -> tuple[tuple[Kind, Callable[[Any], float]], ...]:
    """(kind, function of a point of the curve): where it turns, and every point of codimension two it can have."""
    return ((Kind.FOLD, _TURNS), (Kind.EXTREMUM, _EXTREMA), *_by_kind(curve))


def _by_kind(curve: Locus) -> tuple[tuple[Kind, Callable[[Any], float]], ...]:
    circle = curve.inner.critical.circle
    if getattr(curve.inner, "halved", False):
        return _on_half(curve.kind)
    if curve.kind is Kind.FOLD and not circle:
        return ((Kind.BOGDANOV_TAKENS, _slope(0.0)), (Kind.ZERO_HOPF, _pairs(circle)))
    if curve.kind is Kind.FOLD:
        return ((Kind.R1, _slope(1.0)), (Kind.FOLD_FLIP, _value(-1.0)))
    if curve.kind is Kind.HOPF:
        return (
            (Kind.BOGDANOV_TAKENS, _extra(0.0)), (Kind.ZERO_HOPF, _rest), (Kind.DOUBLE_HOPF, _pairs(circle)),
            (Kind.GENERALIZED_HOPF, _coefficient),
        )  # fmt: skip
    if curve.kind is Kind.PERIOD_DOUBLING:
        return (
            (Kind.R2, _slope(-1.0)), (Kind.FOLD_FLIP, _value(1.0)), (Kind.GENERALIZED_PERIOD_DOUBLING, _coefficient),
        )  # fmt: skip
    if curve.kind is Kind.NEIMARK_SACKER:
        resonances = ((Kind.R1, 1.0), (Kind.R2, -1.0), (Kind.R3, -0.5), (Kind.R4, 0.0))
        return (*((kind, _extra(c)) for kind, c in resonances), (Kind.CHENCINER, _coefficient), (Kind.R2, _TOUCHES))
    return ()


def _on_half(kind: Kind) -> tuple[tuple[Kind, Callable[[Any], float]], ...]:
    """Strong resonances of a half-period map N by the names of the whole period, N^2 (see `orbit_symmetry`).

    A double -1 of N, on a curve of symmetry-breaking points, is a double +1; a pair at +-i a double -1.
    """
    if kind is Kind.NEIMARK_SACKER:
        return ((Kind.R1, _both_ends), (Kind.R2, _extra(0.0)), (Kind.R3, _extra(-0.5)), (Kind.CHENCINER, _coefficient))
    double = {Kind.FOLD: 1.0, Kind.PERIOD_DOUBLING: -1.0}
    return ((Kind.R1, _slope(double[kind])),) if kind in double else ()


def _both_ends(point: Any) -> float:
    return float(point.problem.parts(point.u)[2][0] ** 2 - 1)


def confirmed(curve: Locus, kind: Kind, point: Any, scale: float) -> Kind | None:
    """The kind of a located zero, or None: nothing. `scale`: largest modulus of the function at the bracket's ends."""
    if kind in (Kind.FOLD, Kind.EXTREMUM):
        return _extreme(curve, kind, sharpened(point), scale)
    if kind in (Kind.R1, Kind.R2):
        return _resonance(curve, kind, point, scale)
    function = dict(monitors(curve)).get(kind)
    if function is None:
        return kind
    value = function(point)
    if not math.isfinite(value) or abs(value) > 1e-3 * scale:
        return None
    if kind in (Kind.ZERO_HOPF, Kind.DOUBLE_HOPF):
        rest = _others(point) if not (curve.kind is Kind.HOPF and kind is Kind.ZERO_HOPF) else np.ones(1)
        if curve.kind is Kind.FOLD or kind is Kind.DOUBLE_HOPF:
            sums = np.abs(np.add.outer(rest, rest)) + 1e300 * np.eye(rest.size)
            i, _ = np.unravel_index(int(np.argmin(sums)), sums.shape)
            return kind if rest[i].imag != 0 else None
    if curve.kind is Kind.HOPF and kind is not Kind.BOGDANOV_TAKENS and not curve.parts(point.u)[2][0] > 0:
        return None  # beyond a Bogdanov-Takens point: neutral saddles
    return kind


def _extreme(curve: Locus, kind: Kind, point: Any, scale: float) -> Kind | None:
    """What it is where a parameter's rate vanishes."""
    if scale < 10 * _NOISE or (kind is Kind.EXTREMUM and curve.pair_growth(curve.parts(point.u)[2]) > 0):
        return None
    first, second = abs(_first(point)), abs(_second(point))
    jumps = (first if kind is Kind.FOLD else second) > 0.1 * scale  # a singular point: the family begins there
    if curve.kind is Kind.FOLD and max(first, second) < (_STILL_JUMP if jumps else _STILL):
        return Kind.CUSP
    if jumps:
        return None
    if kind is Kind.FOLD:
        return kind
    bend = _bend(curve, point)
    if bend is None or abs(bend) < _STRAIGHT * curve.scale:
        return None
    if curve.kind is not Kind.FOLD:
        return kind
    sign = _hessian_sign(curve, point, bend)
    return Kind.EXTREMUM if not sign else Kind.ISOLA_CENTRE if sign > 0 else Kind.ISOLA_MERGER


def _resonance(curve: Locus, kind: Kind, point: Any, scale: float) -> Kind | None:
    """1:1 and 1:2: a root of c -+ 1 or of chi', or c touching -+1 (two oscillators that do not know of each other)."""
    function = next(f for k, f in _by_kind(curve) if k is kind and f is not _TOUCHES)
    value, pairs = function(point), curve.kind is Kind.NEIMARK_SACKER
    if math.isfinite(value) and abs(value) <= (_TOUCHED if pairs else 1e-3) * scale:
        return kind
    if not pairs or getattr(curve.inner, "halved", False):
        return None
    c = float(curve.parts(point.u)[2][0])
    return None if min(abs(c - 1), abs(c + 1)) > _TOUCHED else Kind.R1 if c > 0 else Kind.R2


def _bend(curve: Locus, point: Any) -> float | None:
    """Second difference of lambda_2 along the curve over _ASIDE; from nearer neighbours where it turns sharply."""
    for step in (_ASIDE, 0.1 * _ASIDE, 0.01 * _ASIDE):
        found = [curve.correct(point.u, point.params, curve.along, point.tangent, s, 1e-11) for s in (-step, step)]
        if all(f.converged for f in found):
            before, after = (curve.parts(f.u)[1] for f in found)
            return (before - 2 * curve.parts(point.u)[1] + after) * (_ASIDE / step) ** 2
    return None


def _hessian_sign(curve: Locus, point: Any, bend: float) -> int:
    """Sign of h_xx h_11 - h_x1^2 (see the head of this file); 0: not found."""
    try:
        L = ExtendedLinearisation.at(curve, point.u, point.params, curve.along)
        w, v = np.real(L.begun.frame.left[:, 0]), np.real(L.begun.frame.right[:, 0])
        h_2, h_xx = float(w @ L.inner.core_column(curve.free)), -float(L.found.by_u[0] @ np.real(L.inner.lift(v)))
    except np.linalg.LinAlgError:
        return 0
    return int(np.sign(-bend * h_2 * h_xx))


def _values(point: Any) -> Complex:
    return np.asarray(point.problem.inner_values(point.u, point.params))


def _others(point: Any) -> Complex:
    curve = point.problem
    return np.asarray(curve.others(_values(point), curve.parts(point.u)[2]))


def _slope(at: float) -> Callable[[Any], float]:
    """chi'(at) as sum_i prod_(j != i) (at - lambda_j)."""

    def function(point: Any) -> float:
        factors = at - _values(point)
        products = [np.prod(np.delete(factors, i)) for i in range(factors.size)]
        return float(np.sum(products).real)

    return function


def _value(at: float) -> Callable[[Any], float]:
    return lambda point: float(np.real(np.prod(at - _values(point))))


def _extra(at: float) -> Callable[[Any], float]:
    return lambda point: float(point.problem.parts(point.u)[2][0] - at)


def _rest(point: Any) -> float:
    return float(np.real(np.prod(_others(point))))


def _pairs(circle: bool) -> Callable[[Any], float]:
    def function(point: Any) -> float:
        values = _others(point)
        i, j = np.triu_indices(values.size, 1)
        products = values[i] * values[j] - 1 if circle else values[i] + values[j]
        return float(np.real(np.prod(products)))

    return function


def _coefficient(point: Any) -> float:
    from .criticality import criticality_of

    curve = point.problem
    u, params = curve.parts(point.u)[0], curve.completed(point.u, point.params)
    L = curve.inner_linearisation(point.u, point.params)
    coefficient = criticality_of(curve.inner, curve.kind, u, params, L).coefficient
    return math.nan if coefficient is None else coefficient
