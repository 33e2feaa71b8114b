"""Harmonic balance against collocation, closed forms, published folds, differences, and its own refinement."""

import warnings

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, InputError, TruncationWarning
from stability.problems.harmonic_spectrum import independent_multipliers
from stability.problems.orbit_spectrum import spectrum_distance

FOLDS = (1.3809330298, 1.0884366395)  # xi = .02, beta = .001; by collocation to 1e-11, research/harmonic-balance: 8 digits


@pytest.fixture(scope="module")
def duffing():
    return st.models.duffing(xi=0.02, beta=0.001)


@pytest.fixture(scope="module")
def chain():
    return st.models.chain(xi1=0.021, xi2=0.021, mass_ratio_21=0.42, Omega0=1.0, beta1=0.0003, beta2=0.0003)


def response(system, window=(0.3, 3.0), name="Omega", start=None, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncationWarning)
        return st.continuation(st.HarmonicBalance(system, **options), name, window, start=start)


# ---------------------------------------------------------------------- folds
def test_folds_of_the_duffing_oscillator(duffing):
    """Errors of both folds at 1, 3, 7, 15 harmonics: survey's 6e-3 and 1.1e-5 at the peak, below 1e-9 from 7 on."""
    reference = st.continuation(st.Collocation(duffing, accuracy=1e-11), "Omega", (0.3, 3.0))
    truth = [p.params["Omega"] for p in reference.of_kind(st.Kind.FOLD)]
    assert np.allclose(truth, FOLDS, atol=1e-9, rtol=0)
    bounds = {1: (1e-2, 1e-4), 3: (2e-5, 1e-8), 7: (1e-9, 1e-9), 15: (1e-9, 1e-9)}
    for harmonics, bound in bounds.items():
        branch = response(duffing, harmonics=harmonics)
        assert branch.labels == ("LP1", "LP2")
        for point, exact, limit in zip(branch.special, truth, bound):
            assert abs(point.params["Omega"] - exact) < limit


def test_one_harmonic_meets_its_closed_form(duffing):
    """(Omega^2 - 1 - 3/4 beta a^2)^2 + 4 xi^2 Omega^2 = Omega^4 / a^2, and the peak a = Omega / (2 xi)."""
    branch = response(duffing, harmonics=1)
    a, Om = branch.columns["u.amplitude(1)"], branch.columns["Omega"]
    misfit = (Om**2 - 1 - 0.75 * 0.001 * a**2) ** 2 + 4 * 0.02**2 * Om**2 - Om**4 / a**2
    assert np.abs(misfit).max() < 1e-7
    peak = 1 / np.sqrt(1 - 3 * 0.001 / (16 * 0.02**2))
    at_peak = max(branch.at(Omega=peak), key=lambda orbit: orbit.max["u"])
    assert abs(at_peak.amplitude(1)["u"] - peak / 0.04) < 1e-6


def test_open_resonance_is_found_from_the_other_end():
    """beta = .05 > 16 xi^2 / 3: the second family folds at 1.416368134 (closed-forms survey)."""
    branch = response(st.models.duffing(xi=0.02, beta=0.05), (3.0, 0.3))
    assert branch.labels == ("LP1",)
    assert abs(branch["LP1"].params["Omega"] - 1.416368134) < 1e-9


@pytest.mark.parametrize("harmonics", [7, 15])
def test_folds_of_the_chain_agree_with_collocation(chain, harmonics):
    reference = st.continuation(st.Collocation(chain), "Omega", (0.3, 3.0))
    branch = response(chain, harmonics=harmonics)
    assert branch.labels == reference.labels
    for a, b in zip(branch.special, reference.special):
        assert a.kind is b.kind
        assert abs(a.params["Omega"] - b.params["Omega"]) < 1e-9


# ---------------------------------------------------------------------- derivatives
def _differences(scalar, size, step=1e-6):
    return np.array([(scalar(step * e) - scalar(-step * e)) / (2 * step) for e in np.eye(size)])


@pytest.mark.parametrize(
    ("system", "options"),
    [
        (st.models.duffing(xi=0.02, beta=0.1, Omega=1.3), {}),
        (st.models.autoparametric_pendulum(), {"subharmonic": 2}),
        (st.models.van_der_pol(mu=0.5), {}),
        (st.models.lorenz(), {}),
    ],
    ids=lambda v: getattr(v, "name", ""),
)
def test_jacobian_columns_and_gradients_are_exact(system, options):
    """Against central differences, at a random point, for every parameter and unknown."""
    problem = st.HarmonicBalance(system, harmonics=2, **options)
    rng = np.random.default_rng(3)
    p, u = system.parameter_vector(), 0.3 * rng.standard_normal(problem.size)
    u[1] += 1.5
    if problem.own:
        u[-1] = 6.2
    at = problem.linearise(u, p)
    at.reference = u

    def moved(du=0.0, dp=0.0):
        L = problem.linearise(u + du, p + dp)
        L.reference = u
        return L

    N, m, n = problem.size, len(p), problem.layout.n
    numeric = _differences(lambda d: moved(d).residual, N).T
    assert np.abs(numeric - at.matrix).max() < 1e-7 * np.abs(at.matrix).max()
    by_params = _differences(lambda d: moved(dp=d).residual, m)
    for k, name in enumerate(problem.parameters):
        assert np.abs(by_params[k] - at.column(name)).max() < 1e-6 * max(1.0, np.abs(at.column(name)).max())
    w, v, a, b = (rng.standard_normal(k) for k in (n, n, N, N + 1))
    for scalar, found in (
        (lambda L: w @ L.spectral @ v, at.spectral_gradient(w, v)),
        *(
            (lambda L, f=f: a @ (L.core @ b[:-1] + b[-1] * L.core_column(f)), at.core_gradient(a, b, f))
            for f in problem.parameters
        ),
    ):
        for gradient, numeric in zip(
            found,
            (_differences(lambda d, g=scalar: g(moved(d)), N), _differences(lambda d, g=scalar: g(moved(dp=d)), m)),
        ):
            assert np.abs(gradient - numeric).max() < 1e-5 * max(1e-3, np.abs(numeric).max())


# ---------------------------------------------------------------------- autonomous, subharmonic, switching
def test_limit_cycle_of_van_der_pol():
    """T(mu) by collocation, and the series 2 pi (1 + mu^2 / 16) at mu = .1 to its next term, 5 mu^4 / 3072."""
    system = st.models.van_der_pol()
    branch = response(system, (0.1, 2.0), "mu", start={system.states[0]: 2.0}, harmonics=31)
    T = branch.columns["period"]
    assert abs(T[0] / (2 * np.pi) - 1 - 0.1**2 / 16) < 5 * 0.1**4 / 3072 * 1.2
    orbit = st.continuation(st.Collocation(system), "mu", (0.1, 2.0), start={system.states[0]: 2.0}).solution(-1)
    assert abs(T[-1] - orbit.period) < 3 * (branch.error[-1] + orbit.error) * orbit.period
    assert branch.error[-1] < 1e-3
    assert set(branch.verdicts) == {st.Verdict.STABLE}
    inner = orbit.multipliers[np.argmin(np.abs(orbit.multipliers))]
    assert abs(branch.values[-1][0] - inner) < branch.value_errors[-1] + 1e-8 < 1e-4


def test_period_doubling_and_what_is_born_there():
    """Autoparametric pendulum: PD, then NS and LP of the swinging branch, all against collocation to 1e-9."""
    system = st.models.autoparametric_pendulum()
    found = []
    for problem in (st.HarmonicBalance(system, harmonics=5), st.Collocation(system)):
        semi = st.continuation(problem, "Omega", (0.5, 1.5))
        swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.5))
        found.append((semi, swing))
    for ours, theirs in zip(*found):
        assert ours.status is theirs.status
        assert sorted(ours.labels) == sorted(theirs.labels)
        for label in ours.labels:
            assert abs(ours[label].params["Omega"] - theirs[label].params["Omega"]) < 1e-9


def test_a_subharmonic_problem_holds_the_harmonic_orbit(duffing):
    """subharmonic = 3 with 21 harmonics, from the 7-harmonic orbit: the same states; multipliers to the third power."""
    p = duffing.parameter_vector(Omega=0.7)
    one, three = st.HarmonicBalance(duffing, harmonics=7), st.HarmonicBalance(duffing, harmonics=21, subharmonic=3)
    a = one.view(one.start(p), p)
    b = three.view(three.start(p, a), p)
    t = np.linspace(0, a.period, 50)
    assert np.abs(a(t) - b(t)).max() < 1e-10
    assert spectrum_distance(a.multipliers**3, b.multipliers) < 1e-8


# ---------------------------------------------------------------------- stability
def _partner(orbit, others):
    t = np.linspace(0, orbit.period, 41)
    return min(others, key=lambda other: np.abs(other(t) - orbit(t)).max())


@pytest.mark.parametrize("harmonics", [5, 9])
@pytest.mark.parametrize("which", ["duffing", "chain"])
def test_verdicts_and_multipliers_agree_with_collocation(which, harmonics, request):
    """Along the whole branch: no contradiction; multipliers within both errors (x 3), away from the folds themselves."""
    system = request.getfixturevalue(which)
    reference = st.continuation(st.Collocation(system, accuracy=1e-11), "Omega", (0.3, 3.0))
    branch = response(system, harmonics=harmonics)
    folds = np.array([p.params["Omega"] for p in reference.special])
    for i in range(len(branch)):
        Om = float(branch.parameter[i])
        if branch.marks[i] >= 0 or np.abs(Om - folds).min() < 1e-3:
            continue
        other = _partner(branch.solution(i), reference.at(Omega=Om))
        assert branch.verdicts[i] is other.verdict
        if np.abs(Om - folds).min() > 0.05:
            distance = spectrum_distance(other.multipliers, branch.values[i])
            assert distance < 3 * branch.value_errors[i] + 1e-11


@pytest.mark.parametrize("harmonics", [1, 2, 3])
def test_too_few_harmonics_are_said_and_counts_follow_the_own_folds(duffing, harmonics):
    """A TruncationWarning with a number; stable and unstable change only at folds of the same truncated system."""
    with pytest.warns(TruncationWarning, match=r"about \d+ more are missing"):
        branch = st.continuation(st.HarmonicBalance(duffing, harmonics=harmonics), "Omega", (0.3, 3.0))
    assert branch.labels == ("LP1", "LP2")
    turning = np.sign(branch.rates)
    for i in range(len(branch)):
        if branch.verdicts[i] is st.Verdict.STABLE and branch.marks[i] < 0:
            assert turning[i] > 0
        if branch.verdicts[i] is st.Verdict.UNSTABLE and branch.marks[i] < 0:
            assert turning[i] < 0


def test_three_ways_to_the_multipliers(duffing):
    """Hill, Koopman-Hill and the monodromy along the orbit: apart at 2 harmonics, within 1e-7 of each other at 15."""
    p = duffing.parameter_vector(Omega=1.2)
    orbit = max(st.continuation(st.Collocation(duffing), "Omega", (0.3, 3.0)).at(Omega=1.2), key=lambda o: o.max["u"])
    spread = {}
    for harmonics in (2, 15):
        problem = st.HarmonicBalance(duffing, harmonics=harmonics)
        found = independent_multipliers(problem, problem.start(p, orbit), p)
        assert set(found) == {"hill", "koopman", "monodromy"}
        spread[harmonics] = max(spectrum_distance(found["hill"], found[k]) for k in found)
    assert spread[2] > 1e-3
    assert spread[15] < 1e-7


# ---------------------------------------------------------------------- error, adaption, terms
def test_error_estimate_against_the_truth(duffing):
    """Estimate and distance to collocation agree within a factor of 3 from 1 to 5 harmonics."""
    p = duffing.parameter_vector(Omega=1.2)
    orbit = max(
        st.continuation(st.Collocation(duffing, accuracy=1e-11), "Omega", (0.3, 3.0)).at(Omega=1.2),
        key=lambda o: o.max["u"],
    )
    t = np.linspace(0, orbit.period, 200)
    for harmonics in (1, 2, 3, 4, 5):
        problem = st.HarmonicBalance(duffing, harmonics=harmonics)
        u = problem.start(p, orbit)
        distance = np.abs(problem.view(u, p)(t) - orbit(t)).max()
        assert distance / 3 < problem.error(u, p) < 3 * distance


def test_adaptive_harmonics_grow_and_drop(duffing):
    problem = st.HarmonicBalance(duffing, harmonics=2, adaptive=True, accuracy=1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("error", TruncationWarning)
        branch = st.continuation(problem, "Omega", (0.3, 3.0))
    used = [branch._problem(i).harmonics for i in range(len(branch))]
    assert max(used) >= 7
    assert used[-1] < max(used)
    assert min(used) >= 2
    for point, exact in zip(branch.special, FOLDS):
        assert abs(point.params["Omega"] - exact) < 1e-8


t = sp.Symbol("t", real=True)
x = sp.Function("x")(t)
Om, F, xi = sp.symbols("Omega F xi", real=True)
TERMS = {
    "sin": (sp.sin(x), 1e-9),
    "exp": (sp.exp(x / 2) - 1 + x / 2, 1e-8),
    "power 12": (x + x**12 / 10, 1e-7),
    "reciprocal": (2 - 2 / (1 + x), 1e-9),
    "absolute": (x + sp.Abs(x) / 2, 3e-3),
    "max": (x + 2 * sp.Max(x - sp.Rational(1, 4), 0), 3e-3),
    "min": (x + sp.Min(x, 0), 3e-3),
}


@pytest.mark.parametrize("name", TERMS)
def test_any_term_goes_through(name):
    """Against collocation at one frequency beside resonance; kinked ones only algebraically."""
    term, limit = TERMS[name]
    system = st.System.from_equations(
        {x.diff(t, 2): -2 * xi * x.diff(t) - term + F * sp.cos(Om * t)}, coordinates=[x], period=2 * sp.pi / Om,
        parameters={"Omega": 0.6, "F": 0.15, "xi": 0.05}, name=name,
    )  # fmt: skip
    problem = st.HarmonicBalance(system, harmonics=15)
    p = system.parameter_vector()
    u = problem.start(p)
    better = problem.adapt(u, p, None)
    if better is not None:
        problem, u, _ = better
        u = problem.start(p, u)
    ours, other = problem.view(u, p), st.solve(st.Collocation(system))
    s = np.linspace(0, other.period, 200)
    distance = np.abs(ours(s) - other(s)).max()
    assert distance < limit
    assert distance < 3 * problem.error(u, p) * max(problem.scales) + 1e-8
    assert ours.verdict is st.Verdict.STABLE
    assert other.verdict is not st.Verdict.UNSTABLE


def test_first_order_states_stand_beside_coordinates():
    """x'' + .1 x' + x + z = cos t, z' = -z + x: linear, so that the transfer function is the witness."""
    z = sp.Function("z")(t)
    system = st.System.from_equations(
        {x.diff(t, 2): -x.diff(t) / 10 - x - z + sp.cos(Om * t), z.diff(t): -z + x}, coordinates=[x, z],
        period=2 * sp.pi / Om, parameters={"Omega": 1.3}, name="mixed",
    )  # fmt: skip
    problem = st.HarmonicBalance(system, harmonics=2)
    assert problem.size == 10  # two series of five coefficients, no velocity
    p = system.parameter_vector()
    orbit = problem.view(problem.start(p), p)
    exact = 1 / (1 - 1.3**2 + 0.13j + 1 / (1 + 1.3j))
    assert abs(orbit.amplitude(1)["x"] - abs(exact)) < 1e-12
    A = np.array([[0, 0, 1.0], [1, -1, 0], [-1, -1, -0.1]])
    order = [system.states.index(name) for name in ("x", "z", "x_dot")]
    assert order == [0, 1, 2]
    assert spectrum_distance(np.exp(2 * np.pi / 1.3 * np.linalg.eigvals(A)), orbit.multipliers) < 1e-10


# ---------------------------------------------------------------------- columns, storage, mistakes
def test_columns_are_those_of_collocation(duffing):
    ours = response(duffing, (0.3, 0.6), harmonics=9)
    theirs = st.continuation(st.Collocation(duffing), "Omega", (0.3, 0.6))
    assert set(ours.columns) == set(theirs.columns)
    for name in ("u.max", "u.min", "u_dot.max", "u.amplitude(1)", "period"):
        assert abs(ours.columns[name][-1] - theirs.columns[name][-1]) < 1e-9


def test_a_loaded_branch_goes_on(duffing, tmp_path):
    branch = response(duffing, (0.3, 1.2), harmonics=5)
    branch.save(tmp_path / "b.npz")
    again = st.load(tmp_path / "b.npz")
    assert abs(again.at(Omega=0.8)[0].max["u"] - branch.at(Omega=0.8)[0].max["u"]) < 1e-12


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"harmonics": 0}, "harmonics"),
        ({"harmonics": 2.5}, "whole number"),
        ({"subharmonic": 0}, "subharmonic"),
        ({"samples": 12}, "at least 4 H"),
        ({"accuracy": -1.0}, "accuracy"),
        ({"scales": [1.0]}, "scales"),
    ],
)
def test_mistakes_are_told_before_work(duffing, options, message):
    with pytest.raises(InputError, match=message):
        st.HarmonicBalance(duffing, **options)


def test_an_autonomous_system_has_no_subharmonic():
    with pytest.raises(InputError, match="no forcing period"):
        st.HarmonicBalance(st.models.van_der_pol(), subharmonic=2)
    with pytest.raises(InputError, match="start"):
        st.continuation(st.HarmonicBalance(st.models.van_der_pol()), "mu", (0.1, 1.0))


def test_too_few_harmonics_are_named_where_nothing_converges():
    """x'' + x'/10 = 1 + x^2 + cos(Omega t)/2: the mean of the right side is positive, so there is no periodic motion."""
    x, t, Omega = sp.Function("x")(sp.Symbol("t")), sp.Symbol("t"), sp.Symbol("Omega")
    force = 1 + x**2 + sp.cos(Omega * t) / 2 - x.diff(t) / 10
    system = st.System.from_equations({x.diff(t, 2): force}, [x], parameters=dict(Omega=1.8))
    with pytest.raises(ConvergenceError, match=r"forcing is harmonic 2, and harmonics=1 may be too few: give more"):
        guess = (lambda time: np.array([np.cos(0.9 * time), -0.9 * np.sin(0.9 * time)]), 4 * np.pi / 1.8)
        st.solve(st.HarmonicBalance(system, harmonics=1, subharmonic=2), start=guess)
    assert st.HarmonicBalance(system, subharmonic=2).advice == ""
