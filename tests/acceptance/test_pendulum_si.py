"""The autoparametric pendulum in SI units at constant base acceleration, and its rotations.

Witnesses: the dimensionless system (other variables, other scales, a length ratio that moves with the frequency), the
exact damped Mathieu problem of the pendulum at rest, simulation, direct integration by scipy, multiple shooting, Liouville's formula.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stability as st

G, HERTZ, XI = 9.81, 22.22, 0.021
SET = dict(acceleration=0.2, xi1=XI, xi2=XI, mass_ratio_total=0.2, Omega0=0.5)
WINDOW = (12.0, 35.0)


def closing_error(system, orbit, **params):
    """|x(T) - x(0) - winding| relative to the states' sizes, T of the orbit, by scipy."""
    x0 = orbit(0.0)
    end = solve_ivp(lambda t, x: system(t, x, **params), (0, orbit.period), x0, method="DOP853", rtol=1e-12, atol=1e-15)
    size = np.maximum(np.abs(orbit.x).max(axis=1), 1e-9)
    return float((np.abs(end.y[:, -1] - x0 - orbit.winding) / size).max())


@pytest.fixture(scope="module")
def physical():
    return st.models.autoparametric_pendulum.from_physical()


@pytest.fixture(scope="module")
def rest(physical):
    return st.continuation(st.Collocation(physical), "frequency", WINDOW)


@pytest.fixture(scope="module")
def swing(rest):
    return st.continuation(st.switch(rest["PD2"]), "frequency", WINDOW)


def surplus_growth(frequency):
    """Growth rate over w1 of phi about rest less its damping; A(w) = acceleration/w^2 in depth and length ratio."""
    Omega = frequency / HERTZ
    absolute = abs(1 + Omega**2 / (1 - Omega**2 + 2j * XI * Omega))
    depth, delta = 0.2 * 0.25 * absolute, XI * 0.5  # Omega^2 U_abs/ll = acceleration Omega0^2 U_abs
    a, q = 4 * (0.25 - delta**2) / Omega**2, 2 * depth / Omega**2
    return st.mathieu_exponent(a, q).imag * Omega / 2 - delta


def test_instability_of_rest_against_the_mathieu_problem(rest):
    assert rest.labels == ("PD1", "PD2")
    for point in rest.special:
        here = point.params["frequency"]
        assert here == pytest.approx(brentq(surplus_growth, here - 1e-3, here + 1e-3, xtol=1e-13), rel=1e-10)
        assert np.abs(point.multipliers + 1).min() < 1e-9


def test_the_motion_at_rest_is_the_linear_response(rest):
    W = rest.parameter / HERTZ
    exact = 0.2 * G / (2 * np.pi * HERTZ) ** 2 / np.abs(1 - W**2 + 2j * XI * W)
    np.testing.assert_allclose(rest.columns["y.max"], exact, rtol=1e-7)


def test_derivative_by_the_frequency_contains_the_amplitude():
    """At fixed phase, by central differences; ll = Omega^2/(acceleration Omega0^2) stands in the equations."""
    from stability.systems.evaluators import evaluator

    system = st.models.autoparametric_pendulum.from_acceleration(**SET)
    functions, random = evaluator(system), np.random.default_rng(3)
    phase, X = random.random(20), random.normal(size=(20, 4))
    place, p, step = list(system.parameters).index("Omega"), system.parameter_vector(Omega=0.9), 1e-5
    up, down = p.copy(), p.copy()
    up[place] += step
    down[place] -= step
    difference = (functions.F(phase, X, up) - functions.F(phase, X, down)) / (2 * step)
    np.testing.assert_allclose(functions.FJP(phase, X, p)[2][:, :, place], difference, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("birth", ["PD1", "PD2"])
def test_the_swinging_branch_is_that_of_the_dimensionless_system(rest, birth):
    """States of 1e-4 m beside angles of a radian: the same points to ten digits, from either end of the branch."""
    system = st.models.autoparametric_pendulum.from_acceleration(**SET)
    other = st.continuation(st.Collocation(system), "Omega", (WINDOW[0] / HERTZ, WINDOW[1] / HERTZ))
    here = st.continuation(st.switch(rest[birth]), "frequency", WINDOW)
    there = st.continuation(st.switch(other[birth]), "Omega", (WINDOW[0] / HERTZ, WINDOW[1] / HERTZ))
    assert here.status is there.status is st.Status.CLOSED_LOOP
    assert here.labels == there.labels and len(here.of_kind(st.Kind.FOLD)) == 4
    mine = [p.params["frequency"] / HERTZ for p in here.special]
    np.testing.assert_allclose(mine, [p.params["Omega"] for p in there.special], rtol=1e-9)
    angles = [p.solution.max["phi"] for p in here.special[:-1]]
    np.testing.assert_allclose(angles, [p.solution.max["theta"] for p in there.special[:-1]], rtol=1e-5)


def test_the_swinging_branch_by_harmonic_balance(physical, swing):
    """Another discretisation, with the same scales of angles: the same points within its stated errors, the same end."""
    rest = st.continuation(st.HarmonicBalance(physical, harmonics=9), "frequency", WINDOW)
    with pytest.warns(st.errors.TruncationWarning):
        other = st.continuation(st.switch(rest["PD2"]), "frequency", WINDOW)
    assert other.status is st.Status.CLOSED_LOOP and other.labels == swing.labels
    for one, exact in zip(other.special, swing.special, strict=True):
        here, there = one.params["frequency"], exact.params["frequency"]
        assert here == pytest.approx(there, rel=1e-9 + one.solution.error)


def test_absorbed_motion_by_simulation(physical, swing, rest):
    """At 22.22 Hz the mass moves 30.52 dB less: what a pendulum that almost hung has settled on after 400 periods."""
    (orbit,) = (o for o in swing.at(frequency=HERTZ) if o.verdict is st.Verdict.STABLE)
    (hung,) = rest.at(frequency=HERTZ)
    assert hung.verdict is st.Verdict.UNSTABLE
    ends = np.linspace(398, 400, 2001) / HERTZ
    seen = st.simulate(physical, (0, ends[-1]), x0=dict(phi=0.01))(ends)
    largest = max(orbit.max["y"], -orbit.min["y"])
    assert np.abs(seen[0]).max() == pytest.approx(largest, rel=1e-5)
    turns = 2 * np.pi * np.round(seen[1].mean() / (2 * np.pi))  # it goes round a few times before
    assert np.abs(seen[1] - turns).max() == pytest.approx(orbit.max["phi"], rel=1e-5)
    assert closing_error(physical, orbit) < 1e-8
    assert 20 * math.log10(largest / hung.max["y"]) == pytest.approx(-30.523, abs=1e-3)


def test_saturation_above_the_threshold(physical):
    """First-order averaging: the mass keeps the amplitude that it has at the threshold 4 xi2/|U_abs|."""
    window = (0.001 * G, 0.1 * G)
    quiet = st.continuation(st.Collocation(physical), "acceleration", window)
    absorbed = st.continuation(st.switch(quiet["PD1"]), "acceleration", window)
    threshold = quiet["PD1"].params["acceleration"]
    assert threshold / G == pytest.approx(4 * XI / abs(1 + 1 / (2j * XI)), rel=5e-3)
    u = absorbed.columns["y.max"] / absorbed.columns["y.max"][0]
    assert np.abs(u[absorbed.parameter < 10 * threshold] - 1).max() < 0.02
    assert quiet.columns["y.max"][-1] / absorbed.columns["y.max"][-1] > 20


def test_asymmetric_and_doubled_orbits(physical, swing):
    """Born where theta(t + T) = -theta(t) breaks, mirror images in pairs, doubled again; each closes under scipy."""
    branch = st.continuation(st.switch(swing["BP1"]), "frequency", WINDOW)
    assert branch.status is st.Status.CLOSED_LOOP
    doubling = branch.of_kind(st.Kind.PERIOD_DOUBLING)[0]
    between = 0.5 * (doubling.params["frequency"] + branch.of_kind(st.Kind.NEIMARK_SACKER)[0].params["frequency"])
    tops = sorted((o.max["phi"], -o.min["phi"]) for o in branch.at(frequency=between))
    for top, bottom in tops:
        assert any(abs(top - b) + abs(bottom - t) < 1e-6 for t, b in tops) and abs(top - bottom) > 1e-2
    doubled = st.continuation(st.switch(doubling), "frequency", WINDOW)
    for one, index, periods in ((branch, len(branch) // 4, 2), (doubled, len(doubled) // 2, 4)):
        orbit = one.solution(index)
        assert orbit.period * one.parameter[index] == pytest.approx(periods)
        growth = max(1.0, float(np.abs(orbit.multipliers[0])))
        assert closing_error(physical, orbit, frequency=float(one.parameter[index])) < 1e-7 * growth


@pytest.fixture(scope="module")
def rotation():
    """A pendulum that a simulation has left rotating, as a problem and its solution."""
    system = st.models.autoparametric_pendulum(xi1=0.02, xi2=0.05, length_ratio=3.0, Omega=2.0)
    T = system.period
    motion = st.simulate(system, (0, 200 * T), x0=dict(theta_dot=2.0))
    turns = 2 * np.pi * round(motion(199 * T)[1] / (2 * np.pi))
    problem = st.Collocation(system, winding=dict(theta=1))
    start = (lambda t: motion(199 * T + t) - np.array([0, turns, 0, 0])[:, None], T)
    return system, problem, start, st.solve(problem, start=start)


def test_rotation_with_the_forcing_frequency(rotation):
    system, _, start, orbit = rotation
    assert orbit.verdict is st.Verdict.STABLE
    turned = orbit(orbit.period) - orbit(0.0)
    assert turned == pytest.approx([0, 2 * np.pi, 0, 0], abs=1e-9)
    assert turned[1] / orbit.period == pytest.approx(2.0, rel=1e-12)  # the average speed is Omega
    times = np.linspace(0, orbit.period, 9)
    left = 10 * np.abs(orbit.multipliers[0]) ** 199  # of the transient
    np.testing.assert_allclose(orbit(times), start[0](times), atol=left, rtol=0)
    assert left < 1e-4
    assert closing_error(system, orbit) < 1e-8


def test_multipliers_of_a_rotation_by_shooting(rotation):
    system, _, start, orbit = rotation
    other = st.solve(st.Shooting(system, winding=dict(theta=1), segments=3), start=start)
    np.testing.assert_allclose(np.poly(other.multipliers), np.poly(orbit.multipliers), atol=1e-7)


def test_rotations_are_followed(rotation):
    _, problem, _, orbit = rotation
    branch = st.continuation(problem, "length_ratio", (1.0, 30.0), start=orbit)
    assert {p.kind for p in branch.special} == {st.Kind.NEIMARK_SACKER, st.Kind.FOLD}
    for index in range(0, len(branch), 7):
        here = branch.solution(index)
        assert (here(here.period) - here(0.0))[1] / here.period == pytest.approx(2.0, rel=1e-11)


@pytest.fixture(scope="module")
def rotating(rotation):
    """The rotating family over the forcing frequency, from the simulated rotation at Omega = 2."""
    _, problem, _, orbit = rotation
    return st.continuation(problem, "Omega", (0.3, 4.0), start=orbit)


def test_rotations_over_the_frequency_are_a_loop(rotating):
    """Between two folds, one rotation at each end of the window's part; theta(0) goes once round on the way."""
    assert rotating.status is st.Status.CLOSED_LOOP and not rotating.of_kind(st.Kind.UNEXPLAINED)
    assert rotating.parameter.min() == pytest.approx(0.5741376295, abs=1e-8)
    assert rotating.parameter.max() == pytest.approx(3.5078830099, abs=1e-8)
    counts = {kind: len(rotating.of_kind(kind)) for kind in (st.Kind.FOLD, st.Kind.PERIOD_DOUBLING)}
    assert counts == {st.Kind.FOLD: 4, st.Kind.PERIOD_DOUBLING: 6}
    assert len(rotating.of_kind(st.Kind.NEIMARK_SACKER)) == 3 and len(rotating.special) == 13
    for index in range(0, len(rotating), 10):
        orbit = rotating.solution(index)
        omega = rotating.parameter[index]
        assert (orbit(orbit.period) - orbit(0.0))[1] / orbit.period == pytest.approx(omega, rel=1e-11)
    assert "undetermined" not in {str(s.verdict) for s in rotating.segments()}


def test_both_ends_are_the_same_points_from_another_start(rotating, rotation):
    _, problem, _, _ = rotation
    start = rotating.at(Omega=1.5)[0]
    again = st.continuation(problem, "Omega", (0.3, 4.0), start=start)
    assert again.status is st.Status.CLOSED_LOOP
    one, two = (sorted(p.params["Omega"] for p in b.special) for b in (rotating, again))
    np.testing.assert_allclose(one, two, atol=1e-8)


def turns_after(system, orbit, Omega, periods):
    """Mean speed over Omega, and the distance from the orbit, after so many periods from a disturbed state."""
    x0 = orbit(0.0) + 1e-4 * np.array([1.0, -1.0, 0.5, 1.0])
    motion = st.simulate(system, (0, periods * orbit.period), x0=x0, rtol=1e-10, atol=1e-10, Omega=Omega)
    end, half = motion(periods * orbit.period), motion(periods // 2 * orbit.period)
    speed = (end[1] - half[1]) / (periods - periods // 2) / orbit.period
    away = end - orbit(0.0)
    away[1] -= 2 * np.pi * round(away[1] / (2 * np.pi))
    return speed / Omega, float(np.abs(away).max())


@pytest.mark.parametrize(("omega", "stable"), [(1.70, False), (1.85, True), (3.45, True), (1.10, True), (1.15, False)])
def test_rotations_by_simulation(rotating, rotation, omega, stable):
    """On both sides of the torus point 1.7784, of the doubling 1.1122, and just before the fold 3.5079."""
    system = rotation[0]
    wanted = st.Verdict.STABLE if stable else st.Verdict.UNSTABLE
    orbits = [o for o in rotating.at(Omega=omega) if o.verdict is wanted]
    assert orbits and (stable or len(orbits) == len(rotating.at(Omega=omega)))
    for orbit in orbits:
        modulus = float(np.abs(orbit.multipliers).max())
        periods = min(600, int(np.ceil(8 / abs(np.log(modulus)))))
        speed, away = turns_after(system, orbit, omega, periods)
        if stable:
            assert speed == pytest.approx(1.0, abs=1e-4) and away < 1e-5
        else:
            assert away > 1e-3


def test_beyond_the_fold_rotation_is_lost(rotating, rotation):
    orbit = rotating["LP1"].solution
    speed, _ = turns_after(rotation[0], orbit, 3.56, 400)
    assert abs(speed - 1.0) > 0.01


def test_rotation_of_the_pendulum_on_a_driven_pivot():
    """No guess is needed; det M = exp(-2 xi T) at each point."""
    system = st.models.base_driven_pendulum(xi=0.05, epsilon=0.3, Omega=2.0)
    branch = st.continuation(st.Collocation(system, winding=dict(phi=1)), "Omega", (4.0, 0.5))
    assert len(branch) > 10 and np.isfinite(branch.values).all()
    product = branch.values.prod(axis=1)
    np.testing.assert_allclose(product.real, np.exp(-0.1 * 2 * np.pi / branch.parameter), rtol=1e-6)
    assert {str(o.verdict) for o in branch.at(Omega=2.0)} == {"stable", "unstable"}
    for orbit in branch.at(Omega=2.0):
        assert closing_error(system, orbit, Omega=2.0) < 1e-6
