"""The autoparametric pendulum end to end: semi-trivial branch, period doublings, nontrivial branch, torus points.

Witnesses: the ends of the semi-trivial instability against the exact damped Mathieu problem (characteristic exponents by
tridiagonal recursions, no time stepping); torus points against direct simulation by scipy on both sides of each; points
of AUTO-07p (catalogue parameter sets, without the direct base term) stored here with six digits or more.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stability as st

SETS = [(10.0, 0.2), (50.0, 0.1), (100.0, 0.2)]


def pendulum(length_ratio, mass_ratio, base_term=True):
    return st.models.autoparametric_pendulum(
        xi1=0.02, xi2=0.01, Omega0=0.5, length_ratio=length_ratio, mass_ratio_total=mass_ratio, base_term=base_term
    )


def surplus_growth(Omega, length_ratio, base_term, xi1=0.02, xi2=0.01, Omega0=0.5):
    """Growth of theta'' + (Omega0^2 + Re(A e^{i Omega tau})/ll - delta^2) theta = 0 less the damping delta."""
    U = Omega**2 / (1 - Omega**2 + 2j * xi1 * Omega)
    depth = Omega**2 * abs(U + 1 if base_term else U) / length_ratio
    delta = xi2 * Omega0
    a, q = 4 * (Omega0**2 - delta**2) / Omega**2, 2 * depth / Omega**2
    return st.mathieu_exponent(a, q).imag * Omega / 2 - delta


@pytest.fixture(scope="module", params=[(*s, b) for s in SETS for b in (True, False)], ids=str)
def branches(request):
    length_ratio, mass_ratio, base_term = request.param
    system = pendulum(length_ratio, mass_ratio, base_term)
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.6))
    return request.param, semi, swing


def test_both_ends_of_the_instability_are_those_of_the_mathieu_problem(branches):
    (length_ratio, _, base_term), semi, _ = branches
    doublings = semi.of_kind(st.Kind.PERIOD_DOUBLING)
    assert len(doublings) == 2 == len(semi.special)
    for point in doublings:
        here = point.params["Omega"]
        exact = brentq(surplus_growth, here - 1e-4, here + 1e-4, args=(length_ratio, base_term), xtol=1e-14)
        assert here == pytest.approx(exact, abs=1e-9)
        assert np.abs(point.multipliers + 1).min() < 1e-9
    inside = sum(p.params["Omega"] for p in doublings) / 2
    assert {s.verdict for s in semi.at(Omega=inside)} == {st.Verdict.UNSTABLE}
    assert {s.verdict for s in semi.at(Omega=0.55)} == {st.Verdict.STABLE}


def test_the_doubled_branch_has_symmetric_orbits_of_twice_the_period(branches):
    _, _, swing = branches
    assert swing.status is st.Status.CLOSED_LOOP  # through theta = 0 into its mirror image and back
    orbit = swing.solution(len(swing) // 3)
    omega = float(swing.parameter[len(swing) // 3])
    assert orbit.period == pytest.approx(4 * np.pi / omega, rel=1e-12)
    times = np.linspace(0, orbit.period / 2, 17)
    if abs(orbit.max["theta"] + orbit.min["theta"]) < 1e-8:
        shifted = orbit(times + orbit.period / 2)
        assert shifted[1] == pytest.approx(-orbit(times)[1], abs=1e-7 * max(1, orbit.max["theta"]))
        assert shifted[0] == pytest.approx(orbit(times)[0], abs=1e-7 * max(1, orbit.max["u"]))


def test_points_of_auto():
    """Set (10, 0.2) without the base term: PD 0.83573310719 (EPSS 1e-7), symmetry breaking 0.742976."""
    system = pendulum(10.0, 0.2, base_term=False)
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
    assert semi["PD1"].params["Omega"] == pytest.approx(0.835733105945, abs=2e-9)
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.6))
    breaking = [p.params["Omega"] for p in swing.of_kind(st.Kind.BRANCH_POINT)]
    assert min(abs(value - 0.7429760406) for value in breaking) < 1e-9


def growth_by_simulation(system, branch, Omega, periods=40):
    """Growth factor per period of a disturbance of the orbit nearest to the torus point, by scipy's DOP853."""
    orbits = [o for o in branch.at(Omega=Omega) if o.max["theta"] > 1e-3]
    factors = []
    for orbit in orbits:
        settings = dict(method="DOP853", rtol=1e-11, atol=1e-12)
        x0 = orbit(0.0)

        def rhs(time, x, Omega=Omega):
            return system(time, x, Omega=Omega)

        random = np.random.default_rng(5).normal(size=4)
        disturbed = x0 + 1e-6 * random * np.maximum(np.abs(x0), 1e-2)
        end = periods * orbit.period
        halves = [end / 2, end]
        plain = solve_ivp(rhs, (0, end), x0, t_eval=halves, **settings).y
        other = solve_ivp(rhs, (0, end), disturbed, t_eval=halves, **settings).y
        distance = np.linalg.norm((other - plain) / np.maximum(np.abs(x0), 1e-2)[:, None], axis=0)
        factors.append((orbit, distance[1] / distance[0]))
    return factors


@pytest.mark.slow
def test_torus_points_of_the_default_set_by_simulation():
    """Beyond the torus point a disturbance grows, before it decays, on the orbit whose verdict says so."""
    system = st.models.autoparametric_pendulum()
    semi = st.continuation(st.Collocation(system), "Omega", (0.9, 1.1))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.9, 1.1))
    values = sorted({round(p.params["Omega"], 7) for p in swing.of_kind(st.Kind.NEIMARK_SACKER)})
    assert len(values) == 2
    seen = set()
    for value in values:
        for offset in (-2e-3, 2e-3):
            for orbit, factor in growth_by_simulation(system, swing, value + offset):
                largest = np.abs(orbit.multipliers).max() ** 20
                if abs(np.log(largest)) > 0.3:
                    assert (factor > 1) == (orbit.verdict is st.Verdict.UNSTABLE), (value, offset, factor, largest)
                    seen.add((value, orbit.verdict))
    assert {v for _, v in seen} == {st.Verdict.STABLE, st.Verdict.UNSTABLE}


def test_the_default_set_has_its_torus_points_between_the_resonances():
    system = st.models.autoparametric_pendulum()
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.5))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.5))
    values = sorted({round(p.params["Omega"], 7) for p in swing.of_kind(st.Kind.NEIMARK_SACKER)})
    assert len(values) == 2 and 2 * 0.48 < values[0] < values[1] < 1.0
    for point in swing.of_kind(st.Kind.NEIMARK_SACKER):
        pair = [m for m in point.multipliers if m.imag > 1e-3]
        assert min(abs(abs(m) - 1) for m in pair) < 1e-7


def test_amplitudes_of_the_doubled_branch_count_in_the_forcing_frequency():
    """theta answers at half of the forcing's frequency, u at the whole: u.amplitude(1) of both branches is one curve.

    Witness: at the point of birth the doubled orbit is the semi-trivial one twice over; the harmonics of its samples.
    """
    system = pendulum(10.0, 0.2)
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.6), max_points=12)
    assert {"u.amplitude(1)", "u.amplitude(1/2)", "theta.amplitude(1/2)"} <= set(swing.columns)
    assert "u.amplitude(1/2)" not in semi.columns
    at = int(np.argmin(np.abs(semi.parameter - semi["PD1"].params["Omega"])))
    assert swing.columns["u.amplitude(1)"][0] == pytest.approx(semi.columns["u.amplitude(1)"][at], rel=1e-9)
    orbit = swing.solution(-1)
    samples = orbit(np.linspace(0, orbit.period, 512, endpoint=False))
    spectrum = 2 * np.abs(np.fft.rfft(samples, axis=1)) / 512
    assert orbit.multiple == 2
    assert orbit.amplitude(0.5)["theta"] == pytest.approx(spectrum[1, 1], rel=1e-9)
    assert spectrum[1, 1] > 0.1 * orbit.max["theta"]
    assert swing.columns["theta.amplitude(1/2)"][-1] == pytest.approx(spectrum[1, 1], rel=1e-8)
    assert swing.columns["u.amplitude(1)"][-1] == pytest.approx(spectrum[0, 2], rel=1e-8)
    assert swing.columns["theta.amplitude(1)"][-1] < 1e-9 and swing.columns["u.amplitude(1/2)"][-1] < 1e-9


def monodromy_by_simulation(system, orbit, Omega):
    """Multipliers of an orbit by scipy's DOP853 with the variational equations, over its whole period."""
    from stability.systems.evaluators import evaluator

    code, p, n = evaluator(system), system.parameter_vector(Omega=Omega), 4

    def rhs(time, z):
        F, J = code.FJ(np.array([time * Omega / (2 * np.pi)]), np.ascontiguousarray(z[None, :n]), p)
        return np.concatenate([F[0], (J[0] @ z[n:].reshape(n, n)).ravel()])

    z0 = np.concatenate([orbit(0.0), np.eye(n).ravel()])
    end = solve_ivp(rhs, (0, orbit.period), z0, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    assert np.abs(end[:n] - orbit(orbit.period)).max() < 1e-6 * max(1.0, np.abs(orbit.multipliers).max())
    return np.linalg.eigvals(end[n:].reshape(n, n))


@pytest.mark.parametrize("base_term", [True, False])
def test_torus_points_of_the_lightest_set_by_simulation(base_term):
    """Sets (50, 0.1) and (100, 0.2) have none; here a pair of multipliers passes the unit circle between both sides."""
    system = pendulum(10.0, 0.2, base_term)
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.6))
    points = swing.of_kind(st.Kind.NEIMARK_SACKER)
    assert len(points) == 2 and np.nanmax(np.abs(swing.values)) > 1e5  # on the way
    for point in points:
        here = point.params["Omega"]
        critical = [m for m in point.multipliers if m.imag > 1e-6]
        critical = min(critical, key=lambda m: abs(abs(m) - 1))
        sides = []
        for offset in (-1e-3, 1e-3):
            orbits = swing.at(Omega=here + offset)
            orbit = min(orbits, key=lambda o: np.abs(o.multipliers - critical).min())
            values = monodromy_by_simulation(system, orbit, here + offset)
            sides.append(abs(values[np.argmin(np.abs(values - critical))]) - 1)
        assert sides[0] * sides[1] < 0 and max(map(abs, sides)) < 0.2


@pytest.mark.parametrize(("length_ratio", "mass_ratio"), SETS[1:])
def test_sets_without_torus_points(length_ratio, mass_ratio):
    """Folds and symmetry breakings alone; where the semi-trivial motion is unstable the swing is stable."""
    system = pendulum(length_ratio, mass_ratio)
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.6))
    assert {p.kind for p in swing.special} == {st.Kind.FOLD, st.Kind.BRANCH_POINT}
    assert "stable" in {str(o.verdict) for o in swing.at(Omega=1.0)}


@pytest.mark.parametrize("sets", [4, pytest.param(40, marks=pytest.mark.slow)])
def test_random_sets_from_either_end_of_their_instability(sets):
    """Both period doublings lead to one loop: the same points whichever way round, and nothing unexplained."""
    rng = np.random.default_rng(7)
    compared = 0
    for _ in range(sets):
        system = st.models.autoparametric_pendulum(
            xi1=rng.uniform(0.005, 0.04), xi2=rng.uniform(0.003, 0.02), Omega0=rng.uniform(0.45, 0.55),
            length_ratio=10 ** rng.uniform(0.9, 2.5), mass_ratio_total=rng.uniform(0.05, 0.3),
        )  # fmt: skip
        semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
        doublings = semi.of_kind(st.Kind.PERIOD_DOUBLING)
        if len(doublings) != 2:
            continue  # a deep modulation: both instabilities overlap
        loops = [st.continuation(st.switch(point), "Omega", (0.4, 1.7)) for point in doublings]
        assert [loop.status for loop in loops] == [st.Status.CLOSED_LOOP] * 2
        assert not any(loop.of_kind(st.Kind.UNEXPLAINED) for loop in loops)
        one, two = (sorted((p.kind.label, p.params["Omega"]) for p in loop.special if not p.name) for loop in loops)
        assert [kind for kind, _ in one] == [kind for kind, _ in two]
        np.testing.assert_allclose([at for _, at in one], [at for _, at in two], atol=1e-6)
        compared += 1
    assert compared > sets / 2
