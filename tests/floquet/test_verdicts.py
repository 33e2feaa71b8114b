"""Verdicts: every case of the definition, and the rule that a guess is no verdict."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stability.errors import InputError
from stability.floquet.verdicts import Counts, classify
from stability.words import Crossing, Verdict


@pytest.mark.parametrize(
    ("multipliers", "error", "neutral", "verdict", "kind", "counts"),
    [
        ([1.5, 0.5], 1e-9, False, Verdict.UNSTABLE, Crossing.PLUS_ONE, (1, 1, 0, 0)),
        ([-1.5, 0.5], 1e-9, False, Verdict.UNSTABLE, Crossing.MINUS_ONE, (1, 0, 1, 0)),
        ([1.2j, -1.2j, 0.5], 1e-9, False, Verdict.UNSTABLE, Crossing.PAIR, (2, 0, 0, 1)),
        ([1.2j, -1.2j, -1.1], 1e-9, False, Verdict.UNSTABLE, Crossing.PAIR, (3, 0, 1, 1)),
        ([0.99, -0.5], 1e-9, False, Verdict.STABLE, None, (0, 0, 0, 0)),
        ([0.99, -0.5], 0.02, False, Verdict.UNDETERMINED, None, (0, 0, 0, 0)),
        ([1.01, -0.5], 0.02, False, Verdict.UNDETERMINED, None, (0, 0, 0, 0)),
        ([0.6 + 0.8j, 0.6 - 0.8j], 1e-9, True, Verdict.NEUTRAL, None, (0, 0, 0, 0)),
        ([0.6 + 0.8j, 0.6 - 0.8j], 1e-9, False, Verdict.UNDETERMINED, None, (0, 0, 0, 0)),
        ([1.0, 1.0], 1e-9, True, Verdict.UNDETERMINED, None, (0, 0, 0, 0)),
        ([1.2, 1 / 1.2], 1e-9, True, Verdict.UNSTABLE, Crossing.PLUS_ONE, (1, 1, 0, 0)),
        ([], 0.0, False, Verdict.STABLE, None, (0, 0, 0, 0)),
    ],
)
def test_cases(multipliers, error, neutral, verdict, kind, counts) -> None:
    found = classify(multipliers, error, neutral)
    assert found == (verdict, kind, Counts(*counts))


def test_error_per_multiplier() -> None:
    """A badly known small multiplier does not cloud a well known large one."""
    assert classify([0.9, 1e-12], [1e-3, 0.5]).verdict is Verdict.STABLE
    assert classify([0.9, 1e-12], [0.2, 1e-15]).verdict is Verdict.UNDETERMINED


@given(some.lists(some.complex_numbers(max_magnitude=3, allow_nan=False), min_size=1, max_size=6), some.floats(0, 0.5))
def test_a_smaller_error_never_reverses_a_verdict(multipliers, error) -> None:
    rough, sharp = classify(multipliers, error).verdict, classify(multipliers, error / 10).verdict
    assert rough in (sharp, Verdict.UNDETERMINED)


def test_nan_has_no_verdict() -> None:
    with pytest.raises(InputError, match="NaN"):
        classify([np.nan, 0.5])
    with pytest.raises(InputError, match="error"):
        classify([0.5], np.nan)
