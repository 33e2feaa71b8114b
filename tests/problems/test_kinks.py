"""Orbits through a kink have no coefficient made of derivatives of the field; those beside it have.

Witness: a bilinear spring that is touched or not; the doubling at w = 0.524276 is supercritical (orbits beyond it are
stable, their size grows as the root of the distance), and its field is linear on either side: all derivatives vanish.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import StabilityWarning
from stability.problems.kinks import SMOOTH, passes_a_kink, smoothness, smoothness_along

t = sp.Symbol("t", real=True)
x = sp.Function("x")(t)


def bilinear(w: float, gap: float = 1.0, force: float = 1.0) -> st.System:
    """x'' + x'/10 + x + 8 max(x - gap, 0) = force cos(w t)."""
    W = sp.Symbol("w", real=True)
    spring = x + 8 * sp.Max(x - gap, 0)
    equation = {x.diff(t, 2): force * sp.cos(W * t) - x.diff(t) / 10 - spring}
    return st.System.from_equations(equation, [x], parameters=dict(w=w), period=2 * sp.pi / W)


@pytest.mark.parametrize(("gap", "passed"), [(1.0, True), (5.0, False)])
def test_an_orbit_passes_its_stop_or_not(gap: float, passed: bool) -> None:
    """Amplitude 1/|1 - w^2 + i w/10| = 1.33 of the linear motion at w = 0.5."""
    system = bilinear(0.5, gap)
    orbit = st.solve(st.Shooting(system))
    assert passes_a_kink(system, orbit) is passed is bool(orbit.max["x"] > gap)


def test_smooth_systems_have_no_kinks() -> None:
    system = st.models.duffing()
    assert not passes_a_kink(system, st.solve(st.Collocation(system)))


def test_a_doubling_through_a_kink_has_no_word() -> None:
    branch = st.continuation(st.Shooting(bilinear(0.5)), "w", (0.5, 0.53))
    point = branch["PD1"]
    assert abs(point.params["w"] - 0.5242755675) < 1e-8
    assert point.coefficient is None and point.criticality is None
    doubled = st.continuation(st.switch(point), "w", (0.5, 0.53), max_points=6)
    side = doubled.parameter[1:] - point.params["w"]
    assert doubled.verdicts[-1] is st.Verdict.STABLE and (side > 0).all()  # "degenerate" would be wrong


def test_a_fold_on_the_soft_side_keeps_its_coefficient() -> None:
    """A term with a kink that is never reached changes nothing."""
    system = st.models.duffing(xi=0.02, beta=0.001)
    u = sp.Symbol("u", real=True)
    other = st.System(
        name="guarded", coordinates=system.coordinates, states=system.states, parameters=dict(system.parameters),
        rhs=(system.rhs[0], system.rhs[1] - sp.Max(u - 100, 0)), period_expression=system.period_expression,
    )  # fmt: skip
    folds = [st.continuation(st.Collocation(s), "Omega", (0.9, 1.5))["LP1"] for s in (system, other)]
    np.testing.assert_allclose(folds[1].coefficient, folds[0].coefficient, rtol=1e-6)


def forced(term: sp.Expr) -> st.System:
    """x'' + x'/20 + x + term = cos(t) / 2."""
    equation = {x.diff(t, 2): sp.cos(t) / 2 - x.diff(t) / 20 - x - term}
    return st.System.from_equations(equation, [x], parameters=dict(w=1.0), period=2 * sp.pi)


@pytest.mark.filterwarnings("ignore::stability.errors.StabilityWarning")
@pytest.mark.parametrize(("power", "order"), [(1, 1), (2, 2), (3, 3)])
def test_order_of_a_kink(power: int, order: int) -> None:
    """max(x - 1/4, 0)^r has r - 1 continuous derivatives, so that the r-th one jumps."""
    system = forced(sp.Max(x - sp.Rational(1, 4), 0) ** power)
    assert smoothness_along(system, st.solve(st.Collocation(system))) == order


def test_a_jump_is_of_order_zero_and_staying_on_a_kink_costs_one_order() -> None:
    system = forced(sp.sign(x.diff(t)) / 10)
    assert smoothness_along(system, st.solve(st.Shooting(system))) == 0
    drag = forced(sp.Abs(x.diff(t)) * x.diff(t))
    rest, moving = np.zeros((5, 2)), np.ones((5, 2))
    assert smoothness(drag, np.zeros(5), rest, drag.parameter_vector()) == 1
    assert smoothness(drag, np.zeros(5), moving, drag.parameter_vector()) == SMOOTH


@pytest.fixture(scope="module")
def soft_stop() -> st.Branch:
    with pytest.warns(StabilityWarning, match=r"Max, Min, Piecewise.*Shooting") as seen:
        branch = st.continuation(st.Collocation(st.models.soft_stop_oscillator()), "Omega", (1.8, 0.5))
    assert sum("kinks" in str(w.message) for w in seen) == 1
    return branch


def test_stated_errors_of_collocation_hold_past_kinks(soft_stop: st.Branch) -> None:
    """Witness: shooting from the same state, whose integration locates the kinks; at every point of the branch."""
    passed = 0
    for i, omega in enumerate(soft_stop.parameter):
        orbit, system = soft_stop.solution(i), st.models.soft_stop_oscillator().with_params(Omega=omega)
        if not passes_a_kink(system, orbit):
            continue
        passed += 1
        exact, p = st.Shooting(system, rtol=1e-11), system.parameter_vector()
        u = exact.correct(orbit(0.0), p, "Omega", None, 0.0, 1e-11).u
        true = exact.spectrum(exact.linearise(u, p)).values
        for mu in soft_stop.values[i][
            np.abs(soft_stop.values[i]) > 0.3
        ]:  # the error is that near and outside the circle
            assert np.abs(true - mu).min() <= soft_stop.value_errors[i], omega
        times = np.linspace(0.0, orbit.period, 400)
        gap = np.abs(exact.view(u, p)(times) - orbit(times)).max(axis=1) / np.abs(orbit(times)).max(axis=1)
        assert gap.max() <= soft_stop.error[i], omega
    assert passed > 12


def test_smooth_parts_keep_their_small_errors(soft_stop: st.Branch) -> None:
    """Orbits that stay between the stops have nothing to fear from them."""
    assert soft_stop.value_errors[0] < 1e-11 and soft_stop.error[0] < 1e-12


@pytest.mark.filterwarnings("ignore::stability.errors.StabilityWarning")
def test_a_branch_that_stops_names_the_kinks() -> None:
    """A mesh too coarse for the passages: Newton's method fails, and the message says why and what to do."""
    coarse = st.Collocation(bilinear(0.5), adaptive=False, degree=2, intervals=10)
    branch = st.continuation(coarse, "w", (0.5, 3.0))
    assert branch.status is st.Status.STEP_TOO_SMALL
    assert "kinks (Max)" in branch.message and "Shooting" in branch.message
    assert not coarse.doubt.startswith(" ") and st.Collocation(st.models.duffing()).doubt == ""


def van_der_pol() -> st.System:
    """x'' + (|x| - 1) x' / 2 + x = 0, a limit cycle of its own period."""
    mu = sp.Symbol("mu", real=True)
    return st.System.from_equations({x.diff(t, 2): -mu * (sp.Abs(x) - 1) * x.diff(t) - x}, [x], parameters=dict(mu=0.5))


def two_sided() -> st.System:
    """x'' + x'/10 + x + 8 max(x - 1, 0) + 8 min(x + 1, 0) = cos(t/2)."""
    spring = x + 8 * (sp.Max(x - 1, 0) + sp.Min(x + 1, 0))
    equation = {x.diff(t, 2): sp.cos(t / 2) - x.diff(t) / 10 - spring}
    return st.System.from_equations(equation, [x], parameters=dict(unused=0.0), period=4 * sp.pi)


@pytest.mark.filterwarnings("ignore::stability.errors.StabilityWarning")
@pytest.mark.parametrize(
    ("system", "symmetry"), [(van_der_pol(), None), (two_sided(), {"x": "-x"})], ids=["own", "half"]
)
def test_stated_errors_on_an_own_period_and_on_half_a_period(system: st.System, symmetry: object) -> None:
    """Witness: shooting over the whole period."""
    start = dict(x=2.0) if symmetry is None else None
    problem, exact = st.Collocation(system, symmetry=symmetry), st.Shooting(system)
    p = system.parameter_vector()
    u, v = problem.start(p, start), exact.start(p, start)
    found, true = problem.spectrum(problem.linearise(u, p)), exact.spectrum(exact.linearise(v, p))
    values = found.values if symmetry is None else found.values**2
    error = found.error if symmetry is None else found.error * 2 * np.abs(found.values).max()
    for number in true.values[np.abs(true.values) > 0.1]:
        assert 1e-8 < np.abs(values - number).min() < error
