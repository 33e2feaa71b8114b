"""Questions that have no meaning are answered before work starts; trouble in the middle keeps the branch."""

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, InputError, UnknownNameError

t, lam = sp.symbols("t lam")
x, y = sp.Function("x")(t), sp.Function("y")(t)


def first_order(expression, start=1.0):
    return st.System.from_equations({x.diff(t): expression}, [x], parameters=dict(lam=start))


@pytest.mark.parametrize("problem", [st.Collocation, st.HarmonicBalance])
def test_hard_stops_are_not_passed_through_in_silence(problem):
    """The error names the problem that knows them."""
    with pytest.raises(InputError, match=r"hard stops.*Shooting\(system\)"):
        problem(st.models.hard_stop_oscillator())


@pytest.mark.parametrize(
    ("window", "error"),
    [((0.3, -3.0), "bounds"), ((0.3, 0.3), "different"), ((0.3, np.nan), "finite"), ("ab", "two numbers")],
)
def test_windows(window, error):
    with pytest.raises(InputError, match=error):
        st.continuation(st.Collocation(st.models.duffing()), "Omega", window)


def test_names():
    with pytest.raises(UnknownNameError, match="did you mean 'Omega'"):
        st.continuation(st.Collocation(st.models.duffing()), "Omgea", (0.3, 3.0))
    with pytest.raises(InputError, match="forced"):
        st.Equilibrium(st.models.duffing())
    branch = st.continuation(st.Collocation(st.models.duffing()), "Omega", (0.3, 0.5))
    with pytest.raises(UnknownNameError, match="LP1"):
        branch["LP1"]


def test_no_solution_is_a_typed_error():
    with pytest.raises(ConvergenceError, match="start="):
        st.continuation(st.Equilibrium(first_order(lam + x**2)), "lam", (1.0, 2.0))


def test_trouble_on_the_way_ends_the_branch_with_a_status_and_keeps_it():
    """x = 1/lam runs away at lam = 0; x = lam^2 of sqrt x = lam ends at lam = 0, beyond which there is nothing."""
    runaway = st.continuation(st.Equilibrium(first_order(lam * x - 1, -1.0)), "lam", (-1.0, 1.0))
    assert runaway.status is st.Status.DIVERGED and runaway.parameter.max() < 0
    assert runaway.columns["x"] == pytest.approx(1 / runaway.parameter, rel=1e-8)
    root = st.continuation(st.Equilibrium(first_order(lam - sp.sqrt(x))), "lam", (1.0, -1.0), start=dict(x=1.0))
    assert root.status in (st.Status.STEP_TOO_SMALL, st.Status.DIVERGED) and root.parameter.min() < 0.1
    for branch in (runaway, root):
        assert len(branch) > 5 and np.isfinite(np.concatenate(branch.unknowns)).all()
        assert (branch.residuals < 1e-6).all()


def test_variables_of_very_different_size():
    """x ~ 1e3 and y ~ 1e12 with rates 1e9 and 1e-9: every point is the closed-form equilibrium."""
    system = st.System.from_equations(
        {x.diff(t): 1e9 * (lam - 1e-9 * x**3), y.diff(t): 1e-9 * (1e9 * x - y)}, [x, y], parameters=dict(lam=1.0)
    )
    branch = st.continuation(st.Equilibrium(system), "lam", (0.5, 2.0), start=dict(x=800.0, y=8e11))
    assert branch.status is st.Status.PARAMETER_BOUND
    assert branch.columns["x"] == pytest.approx(1e3 * np.cbrt(branch.parameter), rel=1e-9)
    assert branch.columns["y"] == pytest.approx(1e12 * np.cbrt(branch.parameter), rel=1e-9)
    assert branch.count(st.Verdict.UNSTABLE) == 0


def test_a_failed_start_says_what_was_tried():
    """An undamped linear oscillator at resonance has no periodic motion."""
    resonant = st.Collocation(st.models.duffing(xi=0.0, beta=0.0, Omega=1.0))
    with pytest.raises(ConvergenceError, match=r"tried Newton's method from rest \(.*\), then transients from rest"):
        st.solve(resonant)
