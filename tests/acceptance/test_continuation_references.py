"""Reference problems of periodic orbits and equilibria with known answers.

Duffing folds (published to ten digits), van der Pol's period and Hopf point, Lorenz' Hopf point and orbits, verdicts
that do not depend on the mesh or the number of shooting segments, points of the textbook Duffing oscillator against
multiple shooting.
"""

import numpy as np
import pytest
import sympy as sp

import stability as st

FOLDS = (1.088436639, 1.380933030)  # xi = 0.02, beta = 0.001


@pytest.mark.parametrize("window", [(0.3, 3.0), (3.0, 0.3)])
def test_duffing_folds_from_either_direction(window):
    branch = st.continuation(st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", window)
    found = sorted(p.params["Omega"] for p in branch.of_kind(st.Kind.FOLD))
    assert found == pytest.approx(FOLDS, abs=2e-9)
    assert len(branch.special) == 2 and branch.status is st.Status.PARAMETER_BOUND
    assert branch.parameter[0] == window[0] and branch.parameter[-1] == window[1]
    for point in branch.special:
        assert np.abs(point.multipliers - 1).min() < 1e-6
    between = branch.at(Omega=1.2)
    assert sorted(str(o.verdict) for o in between) == ["stable", "stable", "unstable"]


def test_open_resonance_has_no_fold_from_below_and_a_detached_family_from_above():
    oscillator = st.models.duffing(xi=0.02, beta=0.05)
    rising = st.continuation(st.Collocation(oscillator), "Omega", (0.3, 3.0))
    falling = st.continuation(st.Collocation(oscillator), "Omega", (3.0, 0.3))
    detached = falling if len(falling.of_kind(st.Kind.FOLD)) else rising
    assert [p.params["Omega"] for p in detached.of_kind(st.Kind.FOLD)] == pytest.approx([1.416368134], abs=2e-9)
    assert len(rising.of_kind(st.Kind.FOLD)) == 0


def test_van_der_pol_period():
    orbit = st.solve(st.Collocation(st.models.van_der_pol(mu=1.0)), start=dict(x=2.0))
    assert orbit.period == pytest.approx(6.6632868593, abs=5e-10 + orbit.error * 10)
    assert np.abs(orbit.multipliers).min() < 1e-3 and orbit.verdict is st.Verdict.STABLE


def test_hopf_point_and_amplitude_law():
    t, mu = sp.symbols("t mu")
    x = sp.Function("x")(t)
    system = st.System.from_equations({x.diff(t, 2): (mu - x**2) * x.diff(t) - x}, [x], parameters=dict(mu=-0.5))
    rest = st.continuation(st.Equilibrium(system), "mu", (-0.5, 1.0))
    assert rest["HB1"].params["mu"] == pytest.approx(0.0, abs=1e-10)
    cycles = st.continuation(st.switch(rest["HB1"]), "mu", (-0.5, 1.0))
    for value in (0.01, 0.04):
        (orbit,) = cycles.at(mu=value)
        assert orbit.max["x"] == pytest.approx(2 * np.sqrt(value), rel=value**2)
        assert orbit.period == pytest.approx(2 * np.pi * (1 + value**2 / 16), abs=value**4)
        assert orbit.verdict is st.Verdict.STABLE


def test_van_der_pol_hopf_point_is_degenerate():
    rest = st.continuation(st.Equilibrium(st.models.van_der_pol()), "mu", (-1.0, 1.0))
    assert rest["HB1"].params["mu"] == pytest.approx(0.0, abs=1e-10)
    family = st.continuation(st.switch(rest["HB1"]), "mu", (-1.0, 1.0), max_points=40)
    assert np.abs(family.parameter).max() < 1e-8  # vertical: every amplitude at mu = 0
    assert family.count(st.Verdict.STABLE) == family.count(st.Verdict.UNSTABLE) == 0


def test_lorenz_hopf_point_and_the_orbits_born_there():
    lorenz = st.models.lorenz()
    start = dict(x=8.8, y=8.8, z=29.0)
    steady = st.continuation(st.Equilibrium(lorenz), "rho", (30.0, 15.0), start=start)
    assert steady["HB1"].params["rho"] == pytest.approx(470 / 19, abs=1e-9)
    orbits = st.continuation(st.switch(steady["HB1"]), "rho", (13.93, 25.0))
    period = orbits.columns["period"]
    first, last = (period[0], period[-1]) if orbits.parameter[0] > orbits.parameter[-1] else (period[-1], period[0])
    assert first == pytest.approx(2 * np.pi / np.sqrt(8 / 3 * (470 / 19 + 10)), rel=1e-3)
    assert last > 3.5 and orbits.parameter.min() == pytest.approx(13.93)  # toward the homoclinic near 13.926557
    assert orbits.count(st.Verdict.STABLE) == 0


@pytest.mark.parametrize(
    ("gamma", "every"),
    [(5.0, 25), (10.0, 25), *(pytest.param(gamma, 2, marks=pytest.mark.slow) for gamma in (5.0, 10.0, 25.0))],
)
def test_points_of_the_textbook_duffing_oscillator_by_multiple_shooting(gamma, every):
    """Symmetry breaking, folds and superharmonics on one branch; many of its points solved again by another method."""
    system = st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=gamma)
    branch = st.continuation(st.Collocation(system), "omega", (16.0, 0.3), tolerance=1e-11)
    assert len(branch.of_kind(st.Kind.FOLD)) >= 5 and len(branch.of_kind(st.Kind.BRANCH_POINT)) >= 6
    shooting = st.Shooting(system, segments=6)
    for i in range(3, len(branch), every):
        if branch.marks[i] >= 0:
            continue
        one = branch.solution(i)
        two = st.solve(shooting, start=one, omega=float(branch.parameter[i]))
        times = np.linspace(0, one.period, 9)
        scale = max(one.max.values())
        allowed = 1e-9 * scale + 10 * branch.error[i] * scale
        assert np.abs(one(times) - two(times)).max() < allowed, (i, float(branch.parameter[i]))
        assert {one.verdict, two.verdict} != {st.Verdict.STABLE, st.Verdict.UNSTABLE}


def test_verdicts_do_not_depend_on_mesh_or_segments():
    system = st.models.autoparametric_pendulum(xi1=0.02, xi2=0.01, Omega0=0.5, length_ratio=100.0)
    values = np.linspace(0.88, 1.12, 25)
    problems = [st.Collocation(system, intervals=n) for n in (10, 20, 40)]
    problems += [st.Shooting(system, segments=m) for m in (1, 3, 5)]
    verdicts = np.array([[str(st.solve(p, Omega=float(v)).verdict) for v in values] for p in problems])
    for column in verdicts.T:
        assert not {"stable", "unstable"} <= set(column)
    assert np.mean(verdicts == "undetermined") <= 0.02
