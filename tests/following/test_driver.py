"""The driver on equilibria with known curves: walls, loops, stops, wanted points, failures, going on."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, InputError, NonFiniteError, UnknownNameError

x, y, a, b = sp.symbols("x y a b", real=True)


def one_state(rhs: sp.Expr, **parameters: float) -> st.Equilibrium:
    """x' = rhs(x, parameters)."""
    return st.Equilibrium(
        st.System(name="toy", coordinates=("x",), states=("x",), parameters=parameters or {"a": 0.0}, rhs=(rhs,))
    )


def test_fold_of_a_parabola_and_both_walls() -> None:
    """x' = a - x^2: fold at 0; the branch comes in at a = 2 and leaves at a = 2, exactly."""
    branch = st.continuation(one_state(a - x**2, a=0.0), "a", (2.0, -1.0), start=[1.4])
    assert branch.labels == ("LP1",)
    assert abs(branch["LP1"].params["a"]) < 1e-12
    assert branch.parameter[0] == 2.0 and branch.parameter[-1] == 2.0
    assert branch.status is st.Status.PARAMETER_BOUND
    np.testing.assert_allclose(branch.columns["x"] ** 2, branch.parameter, atol=1e-9)
    assert [s.verdict for s in branch.segments()] == [st.Verdict.STABLE, st.Verdict.UNSTABLE]


def test_closed_curve_is_followed_once() -> None:
    """x^2 + a^2/4 = 1 from a solution inside the window: folds at +-2, the last point is the first."""
    problem = one_state(x**2 + a**2 / 4 - 1, a=0.0)
    first = st.solve(problem, start=[-0.9], a=0.3)
    branch = st.continuation(problem, "a", (-3.0, 3.0), start=first)
    assert branch.status is st.Status.CLOSED_LOOP
    np.testing.assert_allclose(sorted(p.params["a"] for p in branch.special), [-2, 2], atol=1e-10)
    assert all(p.kind is st.Kind.FOLD for p in branch.special)
    np.testing.assert_allclose(branch.unknowns[-1], branch.unknowns[0], atol=1e-6)
    turned = np.unwrap(np.arctan2(branch.columns["x"], branch.parameter / 2))
    assert abs(abs(turned[-1] - turned[0]) - 2 * np.pi) < 1e-6


@pytest.mark.parametrize("value", [0.3, 0.31])
def test_a_closed_curve_has_its_seam_once(value: float) -> None:
    """x = +-sqrt(1 - a^2/4), also at the value where the loop was begun and ends."""
    problem = one_state(x**2 + a**2 / 4 - 1, a=0.0)
    branch = st.continuation(problem, "a", (-3.0, 3.0), start=st.solve(problem, start=[-0.9], a=0.3))
    assert branch.statuses == (st.Status.CLOSED_LOOP,) * 2
    exact = np.sqrt(1 - value**2 / 4)
    np.testing.assert_allclose(sorted(p["x"] for p in branch.at(a=value)), [-exact, exact], atol=1e-9)
    assert len(branch.rows_at(a=value)) == 2


def test_a_solution_inside_the_window_is_followed_both_ways() -> None:
    problem = one_state(a - x**3 - x, a=0.0)
    branch = st.continuation(problem, "a", (-2.0, 2.0), start=st.solve(problem, a=0.5))
    assert (branch.parameter[0], branch.parameter[-1]) == (-2.0, 2.0)
    assert (np.diff(branch.parameter) > 0).all() and branch.statuses == (st.Status.PARAMETER_BOUND,) * 2


def test_no_hop_onto_a_crossing_branch() -> None:
    """Transcritical x' = a x - x^2 and pitchfork x' = a x - x^3, seen in curved coordinates: stay on x = curve."""
    for power in (2, 3):
        z = x - sp.Rational(1, 5) * sp.sin(3 * a)  # the branch z = 0 bends
        problem = one_state(a * z - z**power + sp.Rational(3, 5) * sp.cos(3 * a) * 0, a=0.0)
        branch = st.continuation(problem, "a", (-1.0, 1.0), start=[-0.02], ds_max=0.5)
        np.testing.assert_allclose(branch.columns["x"], np.sin(3 * branch.parameter) / 5, atol=1e-8)
        assert branch.labels == ("BP1",) and abs(branch["BP1"].params["a"]) < 1e-10


def test_switch_gives_both_halves_of_a_pitchfork() -> None:
    trivial = st.continuation(one_state(a * x - x**3, a=0.0), "a", (-1.0, 1.0))
    side = st.continuation(st.switch(trivial["BP1"]), "a", (-1.0, 1.0))
    np.testing.assert_allclose(side.columns["x"] ** 2, side.parameter, atol=1e-9)
    assert side.columns["x"].min() == pytest.approx(-1) and side.columns["x"].max() == pytest.approx(1)
    assert (np.diff(side.columns["x"]) > 0).all() or (np.diff(side.columns["x"]) < 0).all()
    assert side.labels == ("BP1",) and side.statuses == (st.Status.PARAMETER_BOUND,) * 2


def test_switch_at_a_transcritical_point_finds_the_other_line() -> None:
    """x' = x (a - 2 x): the other line is x = a/2."""
    trivial = st.continuation(one_state(x * (a - 2 * x), a=0.0), "a", (-1.0, 1.0))
    other = st.continuation(st.switch(trivial["BP1"]), "a", (-1.0, 1.0))
    np.testing.assert_allclose(other.columns["x"], other.parameter / 2, atol=1e-9)
    assert other.labels == ("BP1",)


def test_a_pitchfork_met_from_its_side_branch() -> None:
    """Started on x = -sqrt(a): the branch turns at 0 onto x = +sqrt(a) and the point is one branch point, no fold."""
    branch = st.continuation(one_state(a * x - x**3, a=0.0), "a", (1.0, -1.0), start=[-1.0])
    assert branch.labels == ("BP1",)
    np.testing.assert_allclose(branch.columns["x"] ** 2, branch.parameter, atol=1e-9)


def test_wanted_values_are_points_of_the_branch() -> None:
    branch = st.continuation(one_state(a - x**2, a=0.0), "a", (2.0, -1.0), start=[1.4], at=(0.25, 1.0, 2.0))
    users = branch.of_kind(st.Kind.USER)
    assert sorted(p.params["a"] for p in users) == [0.25, 0.25, 1.0, 1.0, 2.0, 2.0]
    assert sorted(round(p.solution["x"], 9) for p in users if p.params["a"] == 0.25) == [-0.5, 0.5]


def test_user_events_and_stopping_at_them() -> None:
    problem = one_state(a - x**2, a=0.0)
    events = {"crosses": lambda solution: solution["x"] + 0.3}
    branch = st.continuation(problem, "a", (2.0, -1.0), start=[1.4], events=events, stop_at=("crosses",))
    assert branch.status is st.Status.STOPPED
    assert branch["crosses"].params["a"] == pytest.approx(0.09, abs=1e-10)
    assert branch.columns["x"][-1] == pytest.approx(-0.3, abs=1e-10)
    stopped = st.continuation(problem, "a", (2.0, -1.0), start=[1.4], stop_at=st.Kind.FOLD)
    assert stopped.status is st.Status.STOPPED and abs(stopped.parameter[-1]) < 1e-12


def test_wrong_requests_are_refused_before_any_work() -> None:
    problem = one_state(a - x**2, a=0.0)
    with pytest.raises(UnknownNameError, match="did you mean 'a'"):
        st.continuation(problem, "A", (0, 1))
    for bad in ({"ds": -1.0}, {"ds": 2.0}, {"max_points": 0}, {"at": (7.0,)}, {"tolerance": 1.0}, {"events": (3,)}):
        with pytest.raises(InputError):
            st.continuation(problem, "a", (0.0, 1.0), **bad)
    with pytest.raises(InputError):
        st.continuation(problem, "a", (1.0, 1.0))
    with pytest.raises(UnknownNameError):
        st.continuation(problem, "a", (0.0, 1.0), stop_at=("nonsense",))
    with pytest.raises(ConvergenceError, match="give start="):
        st.continuation(problem, "a", (-1.0, 1.0))


def test_not_finite_at_the_start_and_on_the_way() -> None:
    """x' = sqrt(a) - x leaves the reals at a = 0: refused at the start; on the way the branch ends and is kept."""
    problem = one_state(sp.sqrt(a) - x, a=1.0)
    with pytest.raises(NonFiniteError):
        st.continuation(problem, "a", (-1.0, 1.0), start=[1.0])
    branch = st.continuation(problem, "a", (1.0, -1.0), start=[1.0])
    assert branch.status is st.Status.STEP_TOO_SMALL and len(branch) > 5
    assert np.isfinite(branch.columns["x"]).all() and branch.parameter.min() >= 0
    assert branch.parameter[-1] < 1e-4


def test_runaway_ends_as_diverged() -> None:
    """x = 1/a grows without bound toward a = 0."""
    branch = st.continuation(one_state(a * x - 1, a=1.0), "a", (1.0, -1.0), start=[1.0])
    assert branch.status is st.Status.DIVERGED
    assert np.isfinite(branch.columns["x"]).all()


def test_interrupt_keeps_everything() -> None:
    def interrupt(progress: object) -> None:
        if progress.points == 7:  # type: ignore[attr-defined]
            raise KeyboardInterrupt

    branch = st.continuation(one_state(a - x**3 - x, a=0.0), "a", (0.0, 5.0), progress=interrupt)
    assert branch.status is st.Status.STOPPED and len(branch) == 8


def test_interrupt_on_one_half_does_not_start_the_other() -> None:
    def interrupt(progress: object) -> None:
        raise KeyboardInterrupt

    trivial = st.continuation(one_state(a * x - x**3, a=0.0), "a", (-1.0, 1.0))
    side = st.continuation(st.switch(trivial["BP1"]), "a", (-1.0, 1.0), progress=interrupt)
    assert side.statuses == (st.Status.STOPPED,) * 2 and 2 <= len(side) < 6


def test_extend_equals_one_long_run() -> None:
    problem = one_state(a + 2 * x - x**3, a=0.0)
    options = {"start": [-2.5], "ds_max": 0.05}
    whole = st.continuation(problem, "a", (5.0, -5.0), **options)
    parts = st.continuation(problem, "a", (5.0, -5.0), max_points=12, **options)
    assert parts.status is st.Status.MAX_POINTS
    for _ in range(3):
        parts = parts.extend(max_points=15)
    parts = parts.extend()
    assert parts.status is whole.status and parts.labels == whole.labels
    np.testing.assert_allclose(parts.columns["x"], whole.columns["x"], atol=1e-9)


def test_extend_into_a_wider_window() -> None:
    problem = one_state(a - x**3 - x, a=0.0)
    branch = st.continuation(problem, "a", (0.0, 1.0)).extend(window=(0.0, 3.0))
    assert branch.parameter[-1] == 3.0 and branch.window == (0.0, 3.0)


def test_two_hopf_points_and_a_neutral_saddle() -> None:
    """(x, y)' with trace a (1 - a) and determinant 1 + ...: Hopf at 0 and 1; a saddle with trace 0 at 2 is no Hopf."""
    trace, det = a * (1 - a) * (2 - a), sp.Rational(3, 2) - a
    system = st.System(
        name="linear", coordinates=("x", "y"), states=("x", "y"), parameters={"a": 0.0}, rhs=(y, -det * x + trace * y)
    )
    branch = st.continuation(st.Equilibrium(system), "a", (-0.5, 2.5))
    assert [(p.label, round(p.params["a"], 9)) for p in branch.special] == [("HB1", 0.0), ("HB2", 1.0), ("BP1", 1.5)]
    assert branch["HB1"].multipliers[0].imag == pytest.approx(np.sqrt(1.5))


def test_every_point_satisfies_the_equations() -> None:
    branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start={"x": 6, "y": 6, "z": 14})
    system = st.models.lorenz()
    for i in range(len(branch)):
        assert np.abs(system(0.0, branch.unknowns[i], rho=branch.parameter[i])).max() < 1e-9
    assert branch["HB1"].params["rho"] == pytest.approx(470 / 19, abs=1e-11)
