"""Points of a chart too close to an edge for the tiles: done again one by one.

Near an edge the growth rate depends on the Floquet data f like a square root, so the error of a tile (a share of the
largest |f| on it) is magnified. At the few points where that exceeds the tolerance the data are computed directly;
their error is the rounding of the point's own values.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..results.categories import NEUTRAL, STABLE, UNDETERMINED, UNSTABLE
from .painting import Picture
from .sampling import Sampler

__all__ = ["refine"]

Array = NDArray[np.float64]
_MOST = 2000
_STEPS = 256


def refine(sampler: Sampler, picture: Picture, neutral: bool, x: Array, y: Array) -> float:
    """Compute the doubtful points of a picture directly, in place, and return the error of the whole picture."""
    error, doubts = picture.error, picture.doubts
    if doubts.size == 0:
        return error
    order = np.argsort(-doubts, kind="stable")
    if doubts.size > _MOST:
        error = max(error, float(doubts[order[_MOST]]))
    rows, columns = picture.doubtful[:, order[:_MOST]]
    before = doubts[order[:_MOST]]
    at = x[columns], y[rows]
    coarse, f = (sampler.fields(*at, steps) for steps in (_STEPS, _STEPS + _STEPS // 2))
    chi, sigma = sampler.clock(*at)
    size = np.abs(f).max(axis=0)
    # the finer value is better than the difference by 1.5^8 - 1
    d = np.abs(f - coarse).max(axis=0) / 24.0 + np.finfo(float).eps * (8.0 + 0.02 * _STEPS) * size
    if sampler.form == "hill":
        p, m = f[0] * f[1], f[2] * f[3]
        plus = p >= -m
        s, factor = np.maximum(p, -m), 2.0
        ds = d * np.where(plus, np.abs(f[0]) + np.abs(f[1]), np.abs(f[2]) + np.abs(f[3])) + d * d
    else:
        s, factor = 0.25 * f[0] ** 2 + f[1] * f[2], 1.0
        plus = f[3] > 0
        ds = d * (0.5 * np.abs(f[0]) + np.abs(f[1]) + np.abs(f[2])) + 2.0 * d * d
        ds += 4e-16 * (0.25 * f[0] ** 2 + np.abs(f[1] * f[2]))
    middle, upper, lower = (np.arcsinh(np.sqrt(np.maximum(v, 0.0))) for v in (s, s + ds, s - ds))
    growth, each = sigma + factor * chi * middle, factor * chi * (upper - lower)
    better = each < before
    rows, columns, growth, each, s, ds = (v[better] for v in (rows, columns, growth, each, s, ds))
    if neutral:
        verdict = np.where(s > ds, UNSTABLE, np.where(s < -ds, NEUTRAL, UNDETERMINED))
    else:
        verdict = np.where(growth > each, UNSTABLE, np.where(growth < -each, STABLE, UNDETERMINED))
    picture.growth[rows, columns] = growth
    picture.verdict[rows, columns] = verdict
    kind = np.where(s > 0, np.where(plus[better], 1, 2), 3)
    picture.kind[rows, columns] = np.where(verdict == UNSTABLE, kind, 0)
    return max(error, float(np.max(each, initial=0.0)), float(np.max(before[~better], initial=0.0)))
