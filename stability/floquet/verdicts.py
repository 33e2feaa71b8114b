r"""From Floquet multipliers and their error to a verdict: four words, and never a guess.

A solution of a linear periodic system is asymptotically stable when all multipliers have ``|mu| < 1``, unstable when
one has ``|mu| > 1``. Multipliers are known to an error: with discs of that radius around them the verdict is

* UNSTABLE      some disc lies outside the unit circle;
* STABLE        all discs lie inside;
* NEUTRAL       the caller proves that multipliers come in reciprocal pairs (area-preserving, conservative,
  reversible), all discs meet the circle, and all discs are disjoint: then none can leave the circle without meeting
  another (Krein);
* UNDETERMINED  all else: a disc meets the circle.

The way out: +1 (fold, transcritical or pitchfork), -1 (period doubling), a complex pair (Neimark-Sacker).

Reference: V. A. Yakubovich, V. M. Starzhinskii, Linear differential equations with periodic coefficients (1975),
chapter 3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..words import Crossing, Verdict

__all__ = ["Classification", "Counts", "classify"]


class Counts(NamedTuple):
    """Multipliers outside the unit circle: all, real beyond +1, real beyond -1, complex pairs."""

    unstable: int
    beyond_plus_one: int
    beyond_minus_one: int
    pairs: int


class Classification(NamedTuple):
    """Verdict, the way in which the largest multiplier left (None unless unstable), and the counts."""

    verdict: Verdict
    kind: Crossing | None
    counts: Counts


def classify(
    multipliers: ArrayLike, error: ArrayLike = 0.0, neutral: bool = False, block: ArrayLike = 0
) -> Classification:
    """Verdict on the stability of a periodic linear system.

    Parameters
    ----------
    multipliers : (n,) complex; trivial ones (the 1 of an autonomous orbit) removed by the caller.
    error : float or (n,), absolute error of the multipliers, >= 0.
    neutral : the structure of the equations proves that multipliers come in pairs mu, 1/mu (undamped Hill equation,
        conservative or reversible system).
    block : int or (n,), which block of coupled states a multiplier belongs to; only multipliers of the same block can
        meet on the unit circle and leave it.

    Returns
    -------
    Classification
        ``verdict``, ``kind`` (Crossing of the largest multiplier; None unless unstable), ``counts`` of the
        multipliers that are certainly outside.

    Raises
    ------
    InputError
        NaN among the multipliers or a negative or NaN error: an unknown multiplier has no verdict.

    Examples
    --------
    >>> print(*classify([-1.2, 0.5], 1e-9)[:2])
    unstable -1
    >>> print(classify([0.6 + 0.8j, 0.6 - 0.8j], 1e-9, neutral=True).verdict)
    neutral
    """
    mu = np.atleast_1d(np.asarray(multipliers, dtype=complex))
    radius = np.broadcast_to(np.asarray(error, dtype=float), mu.shape)
    if np.isnan(mu).any() or not np.all(radius >= 0):
        raise InputError("multipliers must not be NaN, and their error must be >= 0; there is no verdict on NaN")
    if mu.size == 0:
        return Classification(Verdict.STABLE, None, Counts(0, 0, 0, 0))
    excess = np.abs(mu) - 1.0
    outside = excess > radius
    is_real = np.abs(mu.imag) <= np.where(mu.imag == 0.0, 0.0, radius)
    counts = Counts(
        int(outside.sum()),
        int((outside & is_real & (mu.real > 0)).sum()),
        int((outside & is_real & (mu.real < 0)).sum()),
        int((outside & ~is_real).sum()) // 2,
    )
    if counts.unstable:
        largest = int(np.argmax(np.where(outside, np.abs(mu), 0.0)))
        kind = Crossing.PAIR
        if is_real[largest]:
            kind = Crossing.PLUS_ONE if mu[largest].real > 0 else Crossing.MINUS_ONE
        return Classification(Verdict.UNSTABLE, kind, counts)
    if np.all(excess < -radius):
        return Classification(Verdict.STABLE, None, counts)
    if neutral and np.all(np.abs(excess) <= radius + 4.0 * np.finfo(float).eps) and _disjoint(mu, radius, block):
        return Classification(Verdict.NEUTRAL, None, counts)
    return Classification(Verdict.UNDETERMINED, None, counts)


def _disjoint(mu: np.ndarray, radius: np.ndarray, block: ArrayLike) -> bool:
    """Whether no two discs of the same block meet."""
    label = np.broadcast_to(np.asarray(block), mu.shape)
    distance = np.where(label[:, None] == label[None, :], np.abs(mu[:, None] - mu[None, :]), np.inf)
    np.fill_diagonal(distance, np.inf)
    return bool(np.all(distance > radius[:, None] + radius[None, :] + 4.0 * np.finfo(float).eps))
