"""Planted bifurcations of equilibria: every one found, none invented, each where it was put.

Witness: the construction (planted_equilibria.py): the special points of a case are known in closed form before the
branch is followed. Places are random, a third of them within 3e-4 .. 0.1 of another.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from planted_equilibria import followed, random_case

import stability as st


def outcome(seed: int, scales: float = 0.0) -> tuple[bool, int, float]:
    """(all found in order, false alarms, largest error of the parameter relative to the window)."""
    case = random_case(seed, scales)
    branch = followed(case)
    got = [(p.label[:2], p.params["lam"]) for p in branch.special]
    right = [k for k, _ in got] == [k for k, _ in case.expected] and branch.status is st.Status.PARAMETER_BOUND
    spare = max(0, len(got) - len(case.expected)) + sum(k == "XX" for k, _ in got)
    if not right:
        return False, spare, np.inf
    width = abs(case.window[1] - case.window[0])
    return True, spare, max(abs(g - e) for (_, g), (_, e) in zip(got, case.expected)) / width


def check(seeds: Sequence[int], scales: float = 0.0) -> None:
    results = [outcome(seed, scales) for seed in seeds]
    wrong = [seed for seed, (right, _, error) in zip(seeds, results) if not right or error > 1e-8]
    assert not wrong
    assert sum(spare for _, spare, _ in results) <= 1e-3 * len(seeds)


@pytest.mark.parametrize("first", range(0, 300, 100))
def test_planted_points_are_all_found(first: int) -> None:
    check(range(first, first + 100))


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_variables_of_1e_minus_9_to_1e9(first: int) -> None:
    """The same normal forms in variables spread over eighteen decades."""
    check(range(first, first + 20), scales=9.0)


@pytest.mark.slow
def test_three_thousand() -> None:
    check(range(3000))


def test_pairs_between_two_points_of_the_branch() -> None:
    """705: the other curve of a transcritical pair runs 1e-4 away, where a step hops; 1829, 3020: two values near zero
    at once; 2036: the mesh changes between the two steps that show the dip."""
    check((705, 1829, 2036, 3020))


def test_same_points_in_either_direction() -> None:
    case = random_case(17)
    there = followed(case)
    end = there.solution(-1)
    back = st.continuation(
        st.Equilibrium(there._problem(-1).system), "lam", (case.window[1], case.window[0]), start=end
    )
    a = [(p.kind, p.params["lam"]) for p in there.special]
    b = [(p.kind, p.params["lam"]) for p in reversed(back.special)]
    assert [k for k, _ in a] == [k for k, _ in b]
    np.testing.assert_allclose([v for _, v in a], [v for _, v in b], atol=1e-9)
