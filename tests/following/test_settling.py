"""A single solution is as accurate as its problem promises, or a warning says what is missing.

Witness: collocation, a second method with its own error estimate.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import TruncationWarning

t, F, w = sp.symbols("t F w", real=True)
x = sp.Function("x")(t)
TERMS = {"rational": -1 / (2 + x), "high power": x**12 / 10, "cubic": x**3}


def oscillator(term: sp.Expr) -> st.System:
    """x'' + x'/10 + x + term = F cos(w t)."""
    return st.System.from_equations(
        {x.diff(t, 2): -x.diff(t) / 10 - x - term + F * sp.cos(w * t)}, [x], parameters=dict(F=0.4, w=0.7)
    )


@pytest.mark.parametrize("name", TERMS)
def test_harmonics_follow_a_single_solution(name: str) -> None:
    system = oscillator(TERMS[name])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        series, nodes = st.solve(st.HarmonicBalance(system)), st.solve(st.Collocation(system))
    assert series.error < 1e-8
    times = np.linspace(0, series.period, 50)
    np.testing.assert_allclose(series(times), nodes(times), atol=2e-8 * max(series.max.values()))


def test_fixed_harmonics_that_are_too_few_are_told() -> None:
    with pytest.warns(TruncationWarning, match=r"3 harmonics are too few.*wanted 1e-03; about \d+ more are missing"):
        orbit = st.solve(st.HarmonicBalance(oscillator(TERMS["cubic"]), harmonics=3))
    assert orbit.error > 1e-3


def test_a_kink_asks_for_more_than_is_sensible() -> None:
    with pytest.warns(TruncationWarning, match="a term with a kink converges slowly"):
        orbit = st.solve(st.HarmonicBalance(oscillator(sp.Rational(3, 10) * sp.Max(x, 0))))
    assert 1e-8 < orbit.error < 1e-4  # of 7 harmonics: 6.5e-4


def test_a_mesh_follows_a_single_solution() -> None:
    """Five intervals of degree 2 are far too few for 1e-9."""
    system = oscillator(TERMS["cubic"])
    fixed = st.solve(st.Collocation(system, degree=2, intervals=5, adaptive=False))
    adapted = st.solve(st.Collocation(system, degree=2, intervals=5))
    assert fixed.error > 1e-5 and adapted.error < 1e-9
