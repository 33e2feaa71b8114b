"""Which solution of one method is which solution of another, at one value of the parameter.

Solutions are matched within the same verdict (a stable one with a stable one); what is neither is matched with anything
that is left. Within a group the assignment has the least sum of distances of the compared quantity, so that a missing
solution leaves one over instead of shifting all pairs.
"""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np

from ..words import Verdict

__all__ = ["matched"]

Row = tuple[Verdict, float]
_EXHAUSTIVE = 6


def matched(reference: list[Row], other: list[Row]) -> tuple[list[tuple[int, int]], list[int], list[int]]:
    """(pairs of indices, reference solutions without a partner, other solutions without a partner)."""
    pairs: list[tuple[int, int]] = []
    left, right = list(range(len(reference))), list(range(len(other)))
    for strict in (True, False):
        for verdict in Verdict if strict else (None,):
            one = [i for i in left if verdict is None or reference[i][0] is verdict]
            two = [j for j in right if verdict is None or other[j][0] is verdict]
            if not strict:  # a solution that one of the methods could not judge
                one = [i for i in one if _open(reference[i][0])] or (
                    one if any(_open(other[j][0]) for j in two) else []
                )
                two = [j for j in two if _open(other[j][0])] or two
            for i, j in _assigned([reference[i][1] for i in one], [other[j][1] for j in two]):
                pairs.append((one[i], two[j]))
            left = [i for i in left if i not in {a for a, _ in pairs}]
            right = [j for j in right if j not in {b for _, b in pairs}]
    return sorted(pairs), left, right


def _open(verdict: Verdict) -> bool:
    return verdict in (Verdict.UNDETERMINED, Verdict.NEUTRAL)


def _assigned(one: list[float], two: list[float]) -> list[tuple[int, int]]:
    """Pairs with the least sum of distances between two lists of numbers."""
    if not one or not two:
        return []
    if len(one) > len(two):
        return [(i, j) for j, i in _assigned(two, one)]
    if len(two) > _EXHAUSTIVE:
        from scipy.optimize import linear_sum_assignment

        cost: Any = np.abs(np.subtract.outer(one, two))
        return [(int(i), int(j)) for i, j in zip(*linear_sum_assignment(cost))]
    best = min(permutations(range(len(two)), len(one)), key=lambda p: sum(abs(a - two[j]) for a, j in zip(one, p)))
    return list(enumerate(best))
