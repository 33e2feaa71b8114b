"""Passages of a motion where the equations switch: the closed form of a bilinear spring, of dry friction."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st

t = sp.Symbol("t", real=True)
q = sp.Function("q")(t)


@pytest.mark.parametrize("x0, end, rtol", [(1.0, 30, 1e-12), (0.3, 300, 1e-6), (0.77, 300, 1e-6)])
def test_every_passage_of_a_bilinear_spring_is_there_once(x0, end, rtol):
    """q'' = -q - 3 max(q, 0): half a period is pi above its frequency 2, that is pi/2, the other one is pi."""
    spring = st.System.from_equations({q.diff(t, 2): -q - 3 * sp.Max(q, 0)}, [q])
    run = st.simulate(spring, (0, end), x0=dict(q=x0), rtol=rtol)
    expected = np.pi / 4 + np.pi + 1.5 * np.pi * np.arange(int((end - 1.25 * np.pi) / (1.5 * np.pi)) + 1)
    assert run.crossings("q", 0.0, +1) == pytest.approx(expected, abs=1e4 * rtol)
    assert run.crossings("q").size == len(run.events)
    assert run.poincare("q", 0.0, 1).shape == (2, expected.size)


def test_extrema_of_a_motion_that_comes_to_rest_on_a_switch():
    """x'' = -x - 0.3 sign(x'): turning points lose 0.6 each: 2.05, -1.45, 0.85, -0.25 (within friction: it sticks)."""
    friction = st.System.from_equations({q.diff(t, 2): -q - sp.Rational(3, 10) * sp.sign(q.diff(t))}, [q])
    times, values, signs = st.simulate(friction, (0, 30), x0=dict(q=2.05)).extrema("q")
    assert values == pytest.approx([-1.45, 0.85, -0.25], abs=1e-8) and signs.tolist() == [-1, 1, -1]
    assert times == pytest.approx(np.pi * np.arange(1, 4), abs=1e-6)
