r"""How good a truncated Fourier series is, and how many harmonics and samples it should have.

The residual in time of the truncated orbit, f(X) - x', has harmonics H + 1, H + 2, ... Those up to K = 2H + 1 are used.
One Newton step in them, with the mean of the Jacobian (Z_k = (i k omega)^r - J_0, a small system per harmonic), gives
the harmonics that are missing; their effect J dX on the equations of the first H, and what is left of their own
residual, solved with the exact Jacobian, gives the change of those. Where a tangent
of the branch is known the change is taken orthogonally to it, so that a fold does not blow it up. The largest change of
a state over its scale is the error estimate; for terms that are no polynomials the residual is taken on twice as many
samples, so that the estimate contains the aliasing, whose share is told apart (`aliasing`).

How many harmonics are missing: the sizes of harmonics 1 .. K are fitted by ratio^k and by k^-power; the better fit is
extrapolated to the wanted accuracy.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg.lapack import dgetrs

from ..errors import TruncationWarning
from ..kernels.fourier import resized, series, tail_fit
from ..kernels.harmonic_stability import corrected, missing
from ..protocols import Tangent
from .harmonic_layout import slope_of
from .orbit_adaption import natural_sizes, state_scales

if TYPE_CHECKING:
    from .harmonic_balance import HarmonicBalance
    from .harmonic_linearisation import HarmonicLinearisation

__all__ = ["Correction", "adapted", "correction", "missing_harmonics"]

Array = np.ndarray
_EARLY = 0.1
_MODERATE = 63  # harmonics that adaption grows to before it believes that the decay is a slow one
_FAR = 1000  # largest number of missing harmonics that is extrapolated to
_MOST_SAMPLES = 32  # per harmonic
_ALIAS = 0.1  # largest share of aliasing in the error that is left alone
_ROUNDING = 1e-13


@dataclass(frozen=True, eq=False)
class Correction:
    """What the harmonics that are missing would change.

    Attributes
    ----------
    coefficients : (2K + 1, q) of the corrected orbit;  period : its period
    error : largest change of a state over its scale
    aliasing : the part of it that comes from aliasing
    units : (q,) scales of the unknown series
    """

    coefficients: Array
    period: float
    error: float
    aliasing: float
    units: Array

    @property
    def sizes(self) -> Array:
        """(K,) largest sizes of harmonics 1 .. K over the scales."""
        return np.asarray((np.hypot(self.coefficients[1::2], self.coefficients[2::2]) / self.units).max(axis=1))


@lru_cache(maxsize=64)
def _between(harmonics: int, samples: int, multiple: int) -> tuple[Array, ...]:
    """(points s between the samples, their matrices G and G D of H harmonics, analysis to K, phases)."""
    s = (np.arange(samples) + 0.5) / samples
    G = series(harmonics, s)
    analysis = series(2 * harmonics + 1, s).T * (2.0 / samples)
    analysis[0] *= 0.5
    return _frozen(s, G, slope_of(G), np.ascontiguousarray(analysis), np.mod(multiple * s, 1.0))


@lru_cache(maxsize=64)
def _upper_basis(harmonics: int, samples: int) -> tuple[Array, ...]:
    """G and G D (N, 2H + 2) of the harmonics H + 1 .. K at the samples."""
    G, first = series(2 * harmonics + 1, np.arange(samples) / samples), 2 * harmonics + 1
    return _frozen(np.ascontiguousarray(G[:, first:]), np.ascontiguousarray(slope_of(G)[:, first:]))


def _frozen(*arrays: Array) -> tuple[Array, ...]:
    """Read-only, as the basis is: kernels are compiled for one sort of arrays."""
    for array in arrays:
        array.setflags(write=False)
    return arrays


def _tables(problem: HarmonicBalance) -> tuple[Any, ...]:
    """(address of F, points between the samples, basis of the upper harmonics, units of the series)."""
    known = problem._memo.get("tables")
    if known is None:
        layout = problem.layout
        between = _between(layout.harmonics, layout.samples, problem.multiple)
        upper = _upper_basis(layout.harmonics, layout.samples)
        units, address = problem.scales[layout.unknowns], problem.evaluations.address("F")
        known = problem._memo["tables"] = address, between, upper, units
    return known  # type: ignore[no-any-return]


def correction(L: HarmonicLinearisation) -> Correction:
    """One Newton step in the harmonics up to K = 2H + 1; see the head of this file."""
    problem, layout = L.problem, L.problem.layout
    address, between, upper_basis, units = _tables(problem)
    kept, count, q = problem._fixed[0][-1], layout.count, layout.q
    upper, change = np.empty((count + 1, q)), np.empty_like(L.X)
    order = L.u.size if L.factors is None else len(L.factors[1])
    sides = np.empty((1 if problem.exact_samples else 2, order))
    missing(
        address, L.params, L.omega, layout.basis.spectrum, between, upper_basis, kept, L.filled, L.c, upper, change,
        sides,
    )  # fmt: skip
    steps = _lower_steps(L, sides)
    coefficients = np.empty((2 * count + 1, q))
    period, error, aliasing = corrected(
        layout.basis.synthesis, layout.basis.slope, kept, L.X, L.c, upper, L.period, problem.own, problem.scales, steps,
        change, coefficients,
    )  # fmt: skip
    if not error < np.inf:
        return Correction(resized(L.c, 2 * layout.harmonics + 1), L.period, np.inf, 0.0, units)
    return Correction(coefficients, period, error, aliasing, units)


def _lower_steps(L: HarmonicLinearisation, sides: Array) -> Array:
    """(k, order): F_u x = side, orthogonal to the branch where its tangent is known, else of least length."""
    problem, size = L.problem, L.u.size
    sides[:, :size] /= problem.row_sizes
    if L.factors is not None:
        dgetrs(*L.factors, sides.T, overwrite_b=1)
        return sides
    if not (np.isfinite(sides).all() and np.isfinite(L.core).all()):
        return np.full_like(sides, np.nan)
    x, *_ = np.linalg.lstsq(L.core, sides.T, rcond=1e-7)
    return np.ascontiguousarray((x * problem.column_sizes[:, None]).T)


# ---------------------------------------------------------------------- what to do about it
def missing_harmonics(found: Correction, accuracy: float) -> int:
    """How many more harmonics bring the error below `accuracy`, by the decay of the sizes: 1 to 1000.

    0 where the error is small enough already.
    """
    if not found.error > accuracy:
        return 0
    H = len(found.sizes) // 2
    if not np.isfinite(found.error):
        return H
    ratio, power, geometric = tail_fit(found.sizes)
    excess = math.log(2 * found.error / accuracy)
    if geometric and ratio < 1.0:
        more = excess / max(-math.log(max(ratio, 1e-6)), 1e-3)
    else:
        more = H * (math.exp(min(excess / max(power, 0.5), 7.0)) - 1)
    return int(min(max(math.ceil(more), 1), _FAR))


def adapted(
    problem: HarmonicBalance, u: Array, params: Array, tangent: Tangent | None
) -> tuple[HarmonicBalance, Array, Tangent | None] | None:
    """(problem, u, tangent) with better harmonics, samples or scales; None where the present ones are good."""
    L = problem.linearise(u, params)
    found = L.correction
    fields: dict[str, Any] = {}
    period_scale = L.period if problem.own else 1.0
    scales = state_scales(L.X, natural_sizes(problem.system, L.period))
    ratios = [*(scales / problem.scales).tolist(), period_scale / problem.period_scale]
    worst = found.error
    if max(ratios) > 2 or min(ratios) < 0.5:
        fields |= {"scales": scales, "period_scale": period_scale}
        worst *= 1.0 / min(ratios[:-1])
    found = found if worst == found.error else replace(found, error=worst)
    harmonics = _wanted_harmonics(problem, found) if problem.adaptive else problem.harmonics
    if harmonics != problem.harmonics:
        fields["harmonics"] = harmonics
    elif not problem.fixed_samples and found.aliasing > max(_ALIAS * found.error, _ROUNDING):
        fields |= {"samples": 2 * problem.samples} if problem.samples < _MOST_SAMPLES * harmonics else {}
    if not problem.adaptive or harmonics <= problem.harmonics:
        warn_of_truncation(problem, found, params)
    if not fields:
        return None
    new = problem.changed(**fields)
    if set(fields) <= {"scales", "period_scale"}:
        return new, u, tangent
    if tangent is not None:
        tangent = Tangent(_carried(problem, new, tangent.u), tangent.parameter, tangent.weight)
    return new, _carried(problem, new, u), tangent


def _carried(old: HarmonicBalance, new: HarmonicBalance, u: Array) -> Array:
    return np.append(resized(old.coefficients(u), new.harmonics).ravel(), u[u.size - old.own :])


def _wanted_harmonics(problem: HarmonicBalance, found: Correction) -> int:
    H, accuracy = problem.harmonics, problem.accuracy
    if found.error > _EARLY * accuracy:  # adaption comes every few points: it must be ahead of the error
        more = max(missing_harmonics(found, 0.3 * _EARLY * accuracy), 1)
        # where the decay says that even `most` will not do (a kink), a moderate number is as good
        highest = problem.most if H + more <= problem.most else min(problem.most, max(_MODERATE, H))
        return min(highest, H + min(more, max(H, 2)))
    tail = np.cumsum(found.sizes[::-1])[::-1]  # tail[k]: harmonics above k
    enough = int(np.argmax(np.append(tail, 0.0) < 0.1 * _EARLY * accuracy))
    lower = max(enough, problem.fewest, math.ceil(2 * H / 3), 1)
    return lower if lower < H - 1 and found.error < 0.1 * _EARLY * accuracy else H


def warn_of_truncation(problem: HarmonicBalance, found: Correction, params: Array) -> None:
    """One TruncationWarning for a problem and its adapted copies: where, how large, how many harmonics are missing."""
    if found.error <= problem.accuracy or problem._warned:
        return
    problem._warned.add("truncation")
    more = missing_harmonics(found, problem.accuracy)
    where = ", ".join(f"{k} = {v:.6g}" for k, v in zip(problem.parameters, params.tolist()))
    few = "harmonic is" if problem.harmonics == 1 else "harmonics are"
    remedy = f"harmonics={problem.harmonics + more}, or adaptive=True"
    if problem.adaptive:
        remedy = "a term with a kink converges slowly: Shooting is its method; or give harmonics= and a larger most="
    warnings.warn(
        f"{problem.harmonics} {few} too few for '{problem.system.name}' at {where}: estimated error {found.error:.1e} "
        f"of the states' scales, wanted {problem.accuracy:.0e}; about {more} more are missing ({remedy})",
        TruncationWarning, stacklevel=3,
    )  # fmt: skip
