"""Right-hand sides that raise, and Ctrl-C (a KeyboardInterrupt from `progress`): what was computed is kept."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

import stability as st
from stability.errors import NonFiniteError, StabilityWarning
from stability.results.trajectory import Ending


def fragile(t, x, *, a=1.0, b=0.1, w=1.0):
    if a < 0.55:  # of a number only
        raise RuntimeError("a is out of range")
    return x[1], -a * x[0] - b * x[1] + np.cos(w * t)


def broken(t, x, *, a=1.0):
    raise RuntimeError("boom")


def driven():
    return st.System.from_function(fragile, "x v", period="2*pi/w")


def interrupting(after):
    def progress(done, total):
        if done == after:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize("start", ["carry", "rest"])
def test_a_sweep_keeps_its_points_where_the_right_hand_side_raises(start):
    with pytest.warns(StabilityWarning, match=r"5 of 9 points, at a = 0\.5: .*RuntimeError: a is out of range"):
        short = st.sweep(driven(), "a", (1.0, 0.2), step=0.1, start=start)
    assert short.status is Ending.FAILED and len(short) == 5
    whole = st.sweep(driven(), "a", (1.0, 0.6), step=0.1, start=start)
    assert np.array_equal(short.maximum["x"], whole.maximum["x"])
    with pytest.raises(NonFiniteError, match="RuntimeError: a is out of range"):
        st.sweep(driven(), "a", (0.5, 0.2), step=0.1, start=start)


@pytest.mark.parametrize("start", ["carry", "rest"])
def test_an_interrupted_sweep_keeps_its_points(start):
    duffing = st.models.duffing(xi=0.1, beta=0.0)
    with pytest.warns(StabilityWarning, match="3 of 5 points"):
        short = st.sweep(duffing, "Omega", (0.8, 1.2), step=0.1, start=start, progress=interrupting(3))
    assert short.status is Ending.INTERRUPTED and short.parameter == pytest.approx([0.8, 0.9, 1.0])


def test_interrupted_basins_keep_their_rows():
    duffing = st.models.duffing(xi=0.05, beta=0.05, Omega=1.6)
    window = dict(x=("u", -8, 8), y=("u_dot", -8, 8), shape=(12, 12), workers=1)
    with pytest.warns(StabilityWarning, match="interrupted: .* undecided"):
        part = st.basins(duffing, **window, progress=interrupting(4))
    whole = st.basins(duffing, **window)
    assert np.array_equal(part.labels[:4], whole.labels[:4]) and (part.labels[-1] == -2).all()


def test_basins_tell_of_a_right_hand_side_that_raises():
    with pytest.warns(StabilityWarning, match="count as escaped .*RuntimeError: a is out of range"):
        found = st.basins(driven(), x=("x", -1, 1), y=("v", -1, 1), shape=(3, 3), a=0.3)
    assert found.escaped == 1.0


@pytest.mark.parametrize("use", [
    lambda s: st.simulate(s, (0, 1)), lambda s: st.simulate(s, (0, 1), method="Radau"),
    lambda s: st.solve(st.Equilibrium(s)), lambda s: st.continuation(st.Equilibrium(s), "a", (0, 1)),
])  # fmt: skip
def test_one_error_names_what_a_function_raised(use):
    with pytest.raises(NonFiniteError, match="'broken' raised RuntimeError: boom") as caught:
        use(st.System.from_function(broken, "x v"))
    assert isinstance(caught.value.__cause__, RuntimeError)


def test_an_interrupt_inside_the_function_is_an_interrupt():
    def pressed(t, x):
        if np.any(x > 1.0):
            raise KeyboardInterrupt
        return (np.ones_like(x[0]),)

    with pytest.raises(KeyboardInterrupt):
        st.simulate(st.System.from_function(pressed, "x"), (0, 5))


@pytest.mark.parametrize("method", ["DOP853", "Radau"])
def test_a_start_without_a_rate_is_refused_without_noise(method):
    system = st.System.from_function(lambda t, x, *, a=1.0: (x[1], np.sqrt(x[0] - a)), "x v")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(NonFiniteError, match=r"rate of v .* is nan at the start, t = 0, x = 0"):
            st.simulate(system, (0, 1), method=method)


def test_a_function_of_numbers_gives_the_branch_of_one_of_arrays():
    def arrays(t, x, *, a=1.0, b=0.1, w=1.0):
        return x[1], -a * x[0] - b * x[1] + np.cos(w * t)

    plain = st.System.from_function(arrays, "x v", period="2*pi/w")
    for problem in (st.Collocation, st.Shooting, st.HarmonicBalance):
        one, two = (st.solve(problem(s), a=0.8) for s in (driven(), plain))
        assert one.max["x"] == pytest.approx(two.max["x"], rel=1e-12)
    branch = st.continuation(st.Collocation(driven()), "a", (0.7, 0.9))
    expected = 1 / np.hypot(branch.parameter - 1.0, 0.1)
    assert branch.columns["x.max"] == pytest.approx(expected, rel=1e-6)


def test_a_function_of_single_states_is_told_to_broadcast():
    system = st.System.from_function(lambda t, x: (x[1], -math.sin(x[0])), "x v")
    with pytest.raises(NonFiniteError, match=r"np\.sin for math\.sin"):
        st.solve(st.Equilibrium(system))
