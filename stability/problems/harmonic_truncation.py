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
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrs

from ..errors import TruncationWarning
from ..kernels.fourier import resized, series, tail_fit
from ..protocols import Tangent
from .harmonic_layout import slope_of
from .orbit_adaption import natural_sizes, state_scales

if TYPE_CHECKING:
    from .harmonic_balance import HarmonicBalance
    from .harmonic_linearisation import HarmonicLinearisation

__all__ = ["Correction", "adapted", "correction", "missing_harmonics"]

Array = np.ndarray
_MOST = 63  # harmonics that adaption goes to by itself
_FAR = 1000  # largest number of missing harmonics that is extrapolated to
_MOST_SAMPLES = 32  # per harmonic
_ALIAS = 0.1  # largest share of aliasing in the error that is left alone
_ROUNDING = 1e-13


class Correction(NamedTuple):
    """What the harmonics that are missing would change.

    coefficients (2K + 1, q) of the corrected orbit, its period; error (largest change of a state over its scale); the
    part of it that comes from aliasing; sizes (K,) of harmonics 1 .. K over the scales.
    """

    coefficients: Array
    period: float
    error: float
    aliasing: float
    sizes: Array


def _doubled_analysis(problem: HarmonicBalance) -> tuple[Array, Array, Array, Array, Array]:
    """(points s between the samples, their matrices G and G D of H harmonics, analysis to K, phases)."""
    known = problem._memo.get("between")
    if known is None:
        layout = problem.layout
        s = layout.basis.points + 0.5 / layout.samples
        G = series(layout.harmonics, s)
        analysis = series(2 * layout.harmonics + 1, s).T * (2.0 / layout.samples)
        analysis[0] *= 0.5
        phase = np.mod(problem.multiple * s, 1.0)
        known = problem._memo["between"] = (s, G, slope_of(G), analysis, phase)
    return known  # type: ignore[no-any-return]


def _upper_basis(problem: HarmonicBalance) -> tuple[Array, Array]:
    """G and G D (N, 2H + 2) of the harmonics H + 1 .. K at the samples."""
    known = problem._memo.get("upper")
    if known is None:
        layout = problem.layout
        G = series(2 * layout.harmonics + 1, layout.basis.points)
        known = problem._memo["upper"] = (
            np.ascontiguousarray(G[:, layout.count :]), np.ascontiguousarray(slope_of(G)[:, layout.count :])
        )
    return known  # type: ignore[no-any-return]


def correction(L: HarmonicLinearisation) -> Correction:
    """One Newton step in the harmonics up to K = 2H + 1; see the head of this file."""
    problem, layout = L.problem, L.problem.layout
    H, q, rows = layout.harmonics, layout.q, layout.rows
    failed = Correction(resized(L.c, 2 * H + 1), L.period, np.inf, 0.0, np.zeros(2 * H + 1))
    if not np.isfinite(L.J).all():
        return failed
    force = layout.basis.spectrum @ L.F[:, rows]
    if not problem.exact_samples:
        s, G, slope, analysis, phase = _doubled_analysis(problem)
        X = layout.states_by(G, slope, s, L.c, L.omega)
        finer = 0.5 * (force + analysis @ problem.evaluations.F(phase, X, L.params)[:, rows])
        alias = finer[: layout.count] - force[: layout.count]
        force = finer
    upper = _upper_harmonics(L, force[layout.count :])
    G_upper, slope_upper = _upper_basis(problem)
    places, velocities = layout.pairs
    change = np.zeros_like(L.X)
    change[:, layout.unknowns] = G_upper @ upper
    change[:, velocities] = L.omega * (slope_upper @ upper[:, places])
    pushed = (L.J[:, rows] @ change[:, :, None])[:, :, 0]
    lower = layout.basis.analysis @ pushed - L.residual[: layout.count * q].reshape(layout.count, q)
    sides = [lower.ravel()] if problem.exact_samples else [(lower + alias).ravel(), alias.ravel()]
    step = _lower_step(L, np.stack(sides, axis=1))
    if step is None:
        return failed
    size = layout.count * q
    delta = step[:size, 0].reshape(layout.count, q)
    d_omega = -L.omega / L.period * float(step[-1, 0]) if problem.own else 0.0
    change += _lower_states(L, delta, d_omega)
    aliasing = 0.0
    if not problem.exact_samples:
        by_alias = _lower_states(L, step[:size, 1].reshape(layout.count, q), 0.0)
        aliasing = float((np.abs(by_alias) / problem.scales).max())
    coefficients = np.concatenate([L.c + delta, upper])
    per_harmonic = np.hypot(coefficients[1::2], coefficients[2::2]) / problem.scales[layout.unknowns]
    period = L.period + (float(step[-1, 0]) if problem.own else 0.0)
    error = float((np.abs(change) / problem.scales).max())
    if problem.own:
        error = max(error, abs(period - L.period) / L.period)
    return Correction(coefficients, period, error, aliasing, per_harmonic.max(axis=1))


def _upper_harmonics(L: HarmonicLinearisation, force: Array) -> Array:
    """(2H + 2, q): Z_k x_k = f_k for the harmonics H + 1 .. K."""
    layout = L.problem.layout
    H = layout.harmonics
    places, velocities = layout.pairs
    mean = L.J[:, layout.rows].mean(axis=0)
    ik = 1j * L.omega * np.arange(H + 1, 2 * H + 2)[:, None, None]
    Z = np.where(layout.second, ik**2, ik) * np.eye(layout.q) - mean[:, layout.unknowns]
    Z[:, :, places] -= ik * mean[:, velocities]
    right = force[::2] - 1j * force[1::2]
    # a harmonic that resonates in the mean system is not a matter of this estimate: keep the solve regular
    x = right / Z[:, 0] if layout.q == 1 else np.linalg.solve(Z, right[:, :, None])[:, :, 0]
    out = np.empty_like(force)
    out[::2], out[1::2] = x.real, -x.imag
    return out


def _lower_states(L: HarmonicLinearisation, delta: Array, d_omega: float) -> Array:
    """Change (N, n) of the states at the samples by that of the first H harmonics and of the frequency."""
    layout = L.problem.layout
    places, velocities = layout.pairs
    out = np.zeros_like(L.X)
    out[:, layout.unknowns] = layout.basis.synthesis @ delta
    out[:, velocities] = L.omega * (layout.basis.slope @ delta[:, places]) + d_omega / L.omega * L.X[:, velocities]
    return out


def _lower_step(L: HarmonicLinearisation, force: Array) -> Array | None:
    """F_u x = force, orthogonal to the branch where its tangent is known, else of least length if F_u is singular."""
    problem = L.problem
    sides = force.shape[1]
    if problem.own:
        force = np.vstack([force, np.zeros((1, sides))])
    if L.factors is not None:
        lu, pivots = L.factors
        x = dgetrs(lu, pivots, np.vstack([force / problem.row_sizes[:, None], np.zeros((1, sides))]))[0][:-1]
    else:
        x, *_ = np.linalg.lstsq(L.core, force / problem.row_sizes[:, None], rcond=1e-7)
        x = x * problem.column_sizes[:, None]
    return x if np.isfinite(x).all() else None


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
    scales = state_scales(L.X, natural_sizes(problem.system, L.period))
    period_scale = L.period if problem.own else 1.0
    ratios = np.append(scales / problem.scales, period_scale / problem.period_scale)
    if ((ratios > 2) | (ratios < 0.5)).any():
        fields |= {"scales": scales, "period_scale": period_scale}
    worst = found.error * float((problem.scales / scales).max()) if fields else found.error
    harmonics = _wanted_harmonics(problem, found._replace(error=worst)) if problem.adaptive else problem.harmonics
    if harmonics != problem.harmonics:
        fields["harmonics"] = harmonics
    elif not problem.fixed_samples and found.aliasing > max(_ALIAS * found.error, _ROUNDING):
        fields |= {"samples": 2 * problem.samples} if problem.samples < _MOST_SAMPLES * harmonics else {}
    if not problem.adaptive or harmonics >= _MOST:
        warn_of_truncation(problem, found._replace(error=worst), params)
    if not fields:
        return None
    new = problem.changed(**fields)
    if tangent is not None:
        tangent = Tangent(_carried(problem, new, tangent.u), tangent.parameter, tangent.weight)
    return new, _carried(problem, new, u), tangent


def _carried(old: HarmonicBalance, new: HarmonicBalance, u: Array) -> Array:
    return np.append(resized(old.coefficients(u), new.harmonics).ravel(), u[u.size - old.own :])


def _wanted_harmonics(problem: HarmonicBalance, found: Correction) -> int:
    H, accuracy = problem.harmonics, problem.accuracy
    if found.error > accuracy:
        return min(max(_MOST, problem.fewest), H + min(max(missing_harmonics(found, 0.3 * accuracy), 1), max(H, 2)))
    tail = np.cumsum(found.sizes[::-1])[::-1]  # tail[k]: harmonics above k
    enough = int(np.argmax(np.append(tail, 0.0) < 1e-2 * accuracy))
    lower = max(enough, problem.fewest, math.ceil(2 * H / 3), 1)
    return lower if lower < H - 1 and found.error < 1e-2 * accuracy else H


def warn_of_truncation(problem: HarmonicBalance, found: Correction, params: Array) -> None:
    """One TruncationWarning for a problem and its adapted copies: where, how large, how many harmonics are missing."""
    if found.error <= problem.accuracy or problem._warned:
        return
    problem._warned.add("truncation")
    more = missing_harmonics(found, problem.accuracy)
    where = ", ".join(f"{k} = {v:.6g}" for k, v in zip(problem.parameters, params.tolist()))
    warnings.warn(
        f"{problem.harmonics} harmonics are too few for '{problem.system.name}' at {where}: estimated error "
        f"{found.error:.1e} of the states' scales, wanted {problem.accuracy:.0e}; about {more} more are missing "
        f"(harmonics={problem.harmonics + more}, or adaptive=True)",
        TruncationWarning, stacklevel=3,
    )  # fmt: skip
