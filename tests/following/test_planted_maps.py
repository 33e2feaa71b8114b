"""Planted folds, period doublings and Neimark-Sacker points of maps: every one found, none invented, each in place.

Witness: the construction (planted_maps.py). Tested is what periodic orbits rely on: integer counts of multipliers,
the defining systems with the unknown cos(theta), neutral saddles that are no Neimark-Sacker points.
"""

from __future__ import annotations

import numpy as np
import pytest
from planted_maps import followed_map, random_map

import stability as st


def outcome(seed: int) -> tuple[bool, int, float]:
    case = random_map(seed)
    branch = followed_map(case)
    got = [(p.label[:2], p.params["lam"]) for p in branch.special]
    right = [k for k, _ in got] == [k for k, _ in case.expected] and branch.status is st.Status.PARAMETER_BOUND
    spare = max(0, len(got) - len(case.expected)) + sum(k == "XX" for k, _ in got)
    if not right:
        return False, spare, np.inf
    width = abs(case.window[1] - case.window[0])
    return True, spare, max(abs(g - e) for (_, g), (_, e) in zip(got, case.expected)) / width


def check(seeds: range) -> None:
    results = [outcome(seed) for seed in seeds]
    wrong = [seed for seed, (right, _, error) in zip(seeds, results) if not right or error > 1e-8]
    assert not wrong
    assert sum(spare for _, spare, _ in results) <= 1e-3 * len(seeds)


@pytest.mark.parametrize("first", range(0, 300, 100))
def test_planted_points_are_all_found(first: int) -> None:
    check(range(first, first + 100))


@pytest.mark.slow
def test_three_thousand() -> None:
    check(range(3000))


def test_angle_at_a_neimark_sacker_point() -> None:
    """The pair is exp(+-i omega) with the planted omega."""
    case = next(c for c in map(random_map, range(50)) if [k for k, _ in c.expected].count("NS") == 1)
    pair = followed_map(case)["NS1"].multipliers
    pair = pair[pair.imag > 1e-3]
    nearest = pair[np.argmin(np.abs(np.abs(pair) - 1))]
    assert np.angle(nearest) == pytest.approx(case.params["omega"], abs=1e-9)
