"""A continuation point by point: the same points, left and taken up again at any moment, on paper and from a file.

Witness: `continuation` itself, run in one go.
"""

from __future__ import annotations

import math
import re
import warnings

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import InputError, StabilityWarning, UnknownNameError

x, a = sp.symbols("x a", real=True)


def one_state(rhs: sp.Expr) -> st.Equilibrium:
    """x' = rhs(x, a)."""
    return st.Equilibrium(
        st.System(name="toy", coordinates=("x",), states=("x",), parameters={"a": 0.0}, rhs=(rhs,))
    )


def same(one: st.Branch, other: st.Branch) -> None:
    assert one.labels == other.labels and one.statuses == other.statuses and len(one) == len(other)
    np.testing.assert_array_equal(one.parameter, other.parameter)
    np.testing.assert_array_equal(one.values, other.values)


CUBIC, ELLIPSE = one_state(a - x**3 - x), one_state(x**2 + a**2 / 4 - 1)
CASES = {
    "from the wall": (one_state(a - x**2), (2.0, -1.0), {"start": [1.4]}),
    "both ways": (CUBIC, (-2.0, 2.0), {"start": st.solve(CUBIC, a=0.5)}),
    "closed": (ELLIPSE, (-3.0, 3.0), {"start": st.solve(ELLIPSE, start=[-0.9], a=0.3)}),
    "stopped": (one_state(a - x**2), (2.0, -1.0), {"start": [1.4], "stop_at": "LP"}),
}


@pytest.mark.parametrize("case", CASES, ids=str)
def test_steps_are_the_points_of_continuation(case: str) -> None:
    problem, window, options = CASES[case]
    whole, walk = st.continuation(problem, "a", window, **options), st.steps(problem, "a", window, **options)
    numbers = [step.number for step in walk]
    assert numbers == sorted(numbers) and walk.status is whole.status
    same(walk.branch, whole)


def test_born_at_a_pitchfork() -> None:
    trivial = st.continuation(one_state(a * x - x**3), "a", (-1.0, 1.0))
    whole = st.continuation(st.switch(trivial["BP1"]), "a", (-1.0, 1.0))
    walk = st.steps(st.switch(trivial["BP1"]), "a", (-1.0, 1.0))
    signs = {float(np.sign(step.solution["x"])) for step in walk}
    assert len(signs) == 1  # one half is walked, the other is its image under x -> -x
    assert set(np.sign(walk.branch.columns["x"])) >= {-1.0, 1.0}
    same(walk.branch, whole)


def test_left_at_a_fold_and_taken_up_again() -> None:
    problem = st.Collocation(st.models.duffing(xi=0.02, beta=0.001))
    walk = st.steps(problem, "Omega", (0.3, 3.0))
    for step in walk:
        if st.Kind.FOLD in step.special:
            break
    half = walk.branch
    assert half.labels == ("LP1",) and half.status is st.Status.STOPPED and half.message == "not followed to its end yet"
    assert walk.status is None and step.verdict is st.Verdict.UNSTABLE and np.abs(step.values[0]) > 1
    assert step.parameter == half.parameter[-1] == step.solution.params["Omega"]
    same(walk.run().branch, st.continuation(problem, "Omega", (0.3, 3.0)))
    assert walk.status is st.Status.PARAMETER_BOUND and next(walk, None) is None
    assert half.labels == ("LP1",)  # a branch is frozen: what was taken on the way stays as it was


def test_taken_up_from_a_file(tmp_path: object) -> None:
    problem, window = one_state(a + 2 * x - x**3), (5.0, -5.0)
    first = st.steps(problem, "a", window, start=[-2.5], ds_max=0.05)
    for _ in range(14):
        next(first)
    first.branch.save(f"{tmp_path}/half.npz")
    second = st.steps(st.load(f"{tmp_path}/half.npz"))
    assert "goes on" in repr(second)
    whole = st.continuation(problem, "a", window, start=[-2.5], ds_max=0.05)
    again = second.run().branch
    assert again.labels == whole.labels == ("LP1", "LP2") and again.status is whole.status
    np.testing.assert_allclose(again.parameter, whole.parameter, atol=1e-9)


def test_the_other_side_of_a_walk_that_was_left_early() -> None:
    """Started inside the window and left on the first side: going on from the file follows both."""
    problem = one_state(a - x**3 - x)
    walk = st.steps(problem, "a", (-2.0, 2.0), start=st.solve(problem, a=0.5))
    for _ in range(4):
        next(walk)
    early = walk.branch
    assert early.statuses == (st.Status.STOPPED,) * 2
    late = early.extend()
    assert (late.parameter[0], late.parameter[-1]) == (-2.0, 2.0)


def test_an_exception_in_the_loop_loses_nothing() -> None:
    walk = st.steps(one_state(a - x**3 - x), "a", (0.0, 5.0))
    with pytest.raises(ZeroDivisionError):
        for step in walk:
            if step.number == 6:
                raise ZeroDivisionError
    assert len(walk.branch) == 7 and next(walk).number == 7


def test_wrong_requests() -> None:
    problem = one_state(a - x**3 - x)
    with pytest.raises(InputError, match="which parameter"):
        st.steps(problem)
    with pytest.raises(UnknownNameError, match="did you mean"):
        st.steps(problem, "A", (0.0, 1.0))
    branch = st.continuation(problem, "a", (0.0, 1.0))
    with pytest.raises(UnknownNameError):
        st.steps(branch, "b")
    with pytest.raises(InputError, match="start"):
        st.steps(branch, start=[0.0])


# ---------------------------------------------------------------------- users' functions that fail
def fails_beyond(limit: float):
    def event(solution: st.FixedPoint) -> float:
        return 1.0 / (solution["x"] > limit) - 2.0

    return event


@pytest.mark.parametrize("both", [False, True])
def test_an_event_that_fails_on_the_way_ends_the_branch_and_keeps_it(both: bool) -> None:
    options = {"start": st.solve(one_state(a - x**2), start=[1.0], a=1.0)} if both else {"start": [1.4]}
    with pytest.warns(StabilityWarning, match="points are kept"):
        branch = st.continuation(
            one_state(a - x**2), "a", (2.0, -1.0), events={"edge": fails_beyond(-0.5)}, **options
        )
    assert branch.status is st.Status.STOPPED and branch.labels == ("LP1",) and branch.columns["x"].min() < -0.5
    assert branch.message == "the event 'edge': ZeroDivisionError: float division by zero"
    assert (branch.residuals < 1e-9).all()


@pytest.mark.parametrize("both", [False, True])
def test_an_event_that_is_not_a_number_is_told_once(both: bool) -> None:
    """Beyond x = -0.5 the function has no value, and the branch says why; x = 0.3 is found."""
    options = {"start": st.solve(one_state(a - x**2), start=[1.0], a=1.0)} if both else {"start": [1.4]}

    def lost(solution: st.FixedPoint) -> float:
        return solution["x"] - 0.3 if solution["x"] > -0.5 else math.nan

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        branch = st.continuation(one_state(a - x**2), "a", (2.0, -1.0), events={"edge": lost}, **options)
    assert [str(w.message) for w in caught if w.category is StabilityWarning] == [branch.message]
    assert re.fullmatch(r"the event 'edge' is not a number at a = 0\.\d+: a zero of it may be missed", branch.message)
    assert branch.status is st.Status.PARAMETER_BOUND and branch.labels == ("UZ1", "LP1")
    assert abs(branch["edge"].params["a"] - 0.09) < 1e-9


def test_an_event_that_is_never_a_number() -> None:
    with pytest.warns(StabilityWarning, match="'nothing' is not a number at a = 2: a zero of it may be missed"):
        branch = st.continuation(
            one_state(a - x**2), "a", (2.0, -1.0), start=[1.4], events={"nothing": lambda solution: math.nan}
        )
    assert branch.status is st.Status.PARAMETER_BOUND and "'nothing' is not a number" in branch.message


def test_an_event_that_fails_at_once_is_a_mistake() -> None:
    with pytest.raises(InputError, match=r"event 'edge' failed at the first solution: ZeroDivisionError"):
        st.continuation(one_state(a - x**2), "a", (2.0, -1.0), start=[1.4], events={"edge": fails_beyond(9.0)})


def test_progress_that_fails() -> None:
    def progress(at: object) -> None:
        if at.points == 5:  # type: ignore[attr-defined]
            raise ValueError("the bar is full")

    with pytest.warns(StabilityWarning, match="the progress function: ValueError: the bar is full"):
        branch = st.continuation(one_state(a - x**3 - x), "a", (0.0, 5.0), progress=progress)
    assert branch.status is st.Status.STOPPED and len(branch) == 6
    longer = branch.extend()
    assert longer.status is st.Status.PARAMETER_BOUND and longer.message == ""


def oscillator(time, state, *, a=0.1, w=1.0):
    """u'' + 0.1 u' + u = a cos(w t) as long as |u| < 5."""
    if np.any(np.abs(state[0]) > 5):
        raise ValueError("the spring broke")
    return np.stack([state[1], -0.1 * state[1] - state[0] + a * np.cos(w * time)])


def test_what_a_right_hand_side_raises_is_named() -> None:
    system = st.System.from_function(oscillator, states="u v", period="2*pi/w")
    for problem in (st.Collocation(system), st.HarmonicBalance(system, harmonics=3)):
        branch = st.continuation(problem, "a", (0.45, 1.0))
        assert branch.status is st.Status.STEP_TOO_SMALL and branch.parameter[-1] == pytest.approx(0.5, rel=2e-2)
        assert "ValueError: the spring broke" in branch.message, branch.message
    for problem in (st.Collocation(system), st.HarmonicBalance(system, harmonics=3), st.Shooting(system)):
        with pytest.raises(st.errors.StabilityError, match="ValueError: the spring broke"):
            st.solve(problem, a=3.0)


def root(time, state, *, a=0.0):
    """x' = a - x^2 for x > -1."""
    if np.any(state[0] < -1):
        raise ZeroDivisionError("no root left")
    return np.stack([a - state[0] ** 2])


def test_equilibria_up_to_where_the_right_hand_side_ends() -> None:
    system = st.System.from_function(root, states="x")
    branch = st.continuation(st.Equilibrium(system), "a", (2.0, -1.0), start=[1.4])
    assert branch.status is st.Status.STEP_TOO_SMALL and branch.message == "NonFiniteError: the right-hand side of 'root' raised ZeroDivisionError: no root left"
    assert branch.labels == ("LP1",) and branch.columns["x"].min() == pytest.approx(-1.0, abs=1e-3)


def test_a_status_says_why() -> None:
    grown = st.continuation(one_state(a * x - 1), "a", (1.0, -1.0), start=[1.0])
    assert grown.status is st.Status.DIVERGED and "grown" in grown.message
    short = st.continuation(one_state(a - x**3 - x), "a", (0.0, 5.0), max_points=4)
    assert short.message == "max_points = 4 reached"
    stopped = st.continuation(one_state(a - x**2), "a", (2.0, -1.0), start=[1.4], stop_at="LP")
    assert "fold" in stopped.message
    assert st.continuation(one_state(a - x**3 - x), "a", (0.0, 1.0)).messages == ("", "")
