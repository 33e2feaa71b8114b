"""Harmonic balance at any number of harmonics: verdicts that are never wrong without a warning, torus points, folds.

Witness: collocation, started from the very orbit; one-harmonic polynomials; simulation on both sides of a torus point.
"""

import warnings

import numpy as np
import pytest
import sympy as sp
from absorbers import absorber

import stability as st
from stability.errors import ConvergenceError, TruncationWarning
from stability.problems.harmonic_spectrum import independent_multipliers
from stability.problems.orbit_spectrum import spectrum_distance

CHAIN = dict(xi1=0.021, xi2=0.021, mass_ratio_21=0.42, Omega0=1.0, beta1=0.0003, beta2=0.0003)


def parametric():
    """x'' + x'/20 + (1 + b cos 2 Omega t) x + 3/10 x^2 + x^3 = F cos Omega t: mean, even harmonics, tongues."""
    t = sp.Symbol("t", real=True)
    x, (w, b, F) = sp.Function("x")(t), sp.symbols("Omega b F", real=True)
    rhs = -x.diff(t) / 20 - (1 + b * sp.cos(2 * w * t)) * x - sp.Rational(3, 10) * x**2 - x**3 + F * sp.cos(w * t)
    return st.System.from_equations(
        {x.diff(t, 2): rhs}, coordinates=[x], period=2 * sp.pi / w, parameters={"Omega": 1.0, "b": 0.3, "F": 0.3},
        name="parametric",
    )  # fmt: skip


CASES = {
    "duffing": (lambda: st.models.duffing(xi=0.02, beta=0.001), "Omega", (0.3, 3.0)),
    "textbook": (lambda: st.models.duffing_textbook(delta=0.2, alpha=1, beta=1, gamma=2.5), "omega", (0.3, 2.5)),
    "chain": (lambda: st.models.chain(**CHAIN), "Omega", (0.3, 3.0)),
    "absorber": (lambda: absorber(0.6), "Omega", (0.7, 1.3)),
    "parametric": (parametric, "Omega", (0.3, 2.0)),
    "van der Pol": (lambda: st.models.van_der_pol(), "mu", (0.1, 3.0)),
}
STARTS = {"van der Pol": {"x": 2.0}}  # its only multiplier reaches 1e-6: an estimate far outside is no verdict


def verdicts(name, harmonics, every):
    """(wrong verdicts, whether a TruncationWarning was given, how many were compared)."""
    make, parameter, window = CASES[name]
    system = make()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        branch = st.continuation(
            st.HarmonicBalance(system, harmonics=harmonics), parameter, window, start=STARTS.get(name)
        )
    wrong, compared = [], 0
    for i in range(0, len(branch), every):
        if branch.marks[i] >= 0 or branch.verdicts[i] is st.Verdict.UNDETERMINED:
            continue
        orbit, value = branch.solution(i), float(branch.parameter[i])
        try:
            other = st.solve(st.Collocation(system), start=orbit, **{parameter: value})
        except ConvergenceError:
            continue
        t = np.linspace(0, orbit.period, 40)
        if np.abs(orbit(t) - other(t)).max() > 0.3 * np.abs(other(t)).max():
            wrong.append((value, "no such orbit"))
        elif other.verdict is not st.Verdict.UNDETERMINED:
            compared += 1
            if other.verdict is not branch.verdicts[i]:
                wrong.append((value, str(branch.verdicts[i])))
    return wrong, any(issubclass(w.category, TruncationWarning) for w in caught), compared


@pytest.mark.parametrize("name", CASES)
def test_no_wrong_verdict_without_a_warning(name):
    """Three numbers of harmonics drawn between 1 and 15 (another draw for every case)."""
    random = np.random.default_rng(sum(map(ord, name)))
    for harmonics in random.choice(np.arange(1, 16), 3, replace=False).tolist():
        wrong, warned, compared = verdicts(name, harmonics, every=5)
        assert warned or not wrong, (harmonics, wrong)
        assert warned or compared > 5


@pytest.mark.slow
@pytest.mark.parametrize("harmonics", range(1, 16))
@pytest.mark.parametrize("name", CASES)
def test_no_wrong_verdict_at_any_number_of_harmonics(name, harmonics):
    wrong, warned, _ = verdicts(name, harmonics, every=1)
    assert warned or not wrong, wrong


# ---------------------------------------------------------------------- folds and torus points
@pytest.mark.parametrize(("harmonics", "bound"), [(1, 1e-2), (3, 1e-4), (7, 1e-9), (15, 1e-9)])
def test_folds_of_the_chain(harmonics, bound):
    """Against collocation; the survey found 2e-3 (relative) at one harmonic, 1e-6 .. 1e-5 at three."""
    system = st.models.chain(**CHAIN)
    fine = st.continuation(st.Collocation(system, accuracy=1e-11), "Omega", (0.3, 3.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncationWarning)
        branch = st.continuation(st.HarmonicBalance(system, harmonics=harmonics), "Omega", (0.3, 3.0))
    assert branch.labels == fine.labels == ("LP1", "LP2")
    for ours, exact in zip(branch.special, fine.special):
        assert abs(ours.params["Omega"] - exact.params["Omega"]) < bound


def test_torus_points_of_the_absorber_converge_with_the_harmonics():
    """Errors of NS1, NS2 against collocation fall from three harmonics on, below 1e-9 where nothing is warned of."""
    system = absorber(0.6)
    exact = st.continuation(st.Collocation(system, accuracy=1e-11), "Omega", (0.7, 1.3))
    truth = sorted(p.params["Omega"] for p in exact.of_kind(st.Kind.NEIMARK_SACKER))
    assert len(truth) == 2
    errors = {}
    for harmonics in (3, 5, 7, 9, None):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TruncationWarning)
            branch = st.continuation(st.HarmonicBalance(system, harmonics=harmonics), "Omega", (0.7, 1.3))
        found = sorted(p.params["Omega"] for p in branch.of_kind(st.Kind.NEIMARK_SACKER))
        errors[harmonics] = np.abs(np.array(found) - truth).max()
    assert errors[3] > errors[5] > errors[9]
    assert errors[9] < 1e-7
    assert errors[None] < 1e-8


def test_motion_on_both_sides_of_a_torus_point():
    """Simulated from the orbit with a small push: it returns below NS1, and is modulated above it."""
    system = absorber(0.6)
    branch = st.continuation(st.HarmonicBalance(system), "Omega", (0.7, 1.3))
    (torus, *_) = branch.of_kind(st.Kind.NEIMARK_SACKER)
    spread = []
    for Omega in (torus.params["Omega"] - 0.01, torus.params["Omega"] + 0.01):
        orbit = min(branch.at(Omega=Omega), key=lambda o: o.max["x"])
        T = orbit.period
        motion = st.simulate(system, (0, 400 * T), x0=1.01 * orbit(0.0), Omega=Omega, rtol=1e-9, atol=1e-11)
        strobe = motion(np.arange(350, 400) * T)[0]
        spread.append(float(np.ptp(strobe)))
        assert (orbit.verdict is st.Verdict.STABLE) == (Omega < torus.params["Omega"])
    assert spread[0] < 1e-3 * spread[1]


def test_three_methods_on_the_absorber():
    """Hill, Koopman-Hill and the monodromy: apart at three harmonics, where the verdict's error says so; one at 21."""
    system = absorber(0.6)
    orbit = st.continuation(st.Collocation(system), "Omega", (0.7, 1.3)).at(Omega=1.0)[0]
    p, apart = system.parameter_vector(Omega=1.0), {}
    for harmonics in (2, 21):
        problem = st.HarmonicBalance(system, harmonics=harmonics)
        u = problem.start(p, orbit)
        found = independent_multipliers(problem, u, p)
        apart[harmonics] = max(spectrum_distance(found[a], found[b]) for a in found for b in found)
        error = problem.spectrum(problem.linearise(u, p)).error
        assert error > 0.5 * spectrum_distance(found["hill"], found["monodromy"])
    assert apart[2] > 1e-3
    assert apart[21] < 1e-7


# ---------------------------------------------------------------------- as many harmonics as needed
def test_harmonics_are_chosen_where_none_are_given():
    """Default: error below 1e-8 all along, folds as by collocation; a given number stays."""
    system = st.models.duffing_textbook(delta=0.1, alpha=1, beta=1, gamma=1.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error", TruncationWarning)
        branch = st.continuation(st.HarmonicBalance(system), "omega", (0.4, 3.0))
    fine = st.continuation(st.Collocation(system, accuracy=1e-11), "omega", (0.4, 3.0))
    assert branch.labels == fine.labels
    for ours, exact in zip(branch.special, fine.special):
        assert abs(ours.params["omega"] - exact.params["omega"]) < 1e-8
    used = {branch._problem(i).harmonics for i in range(len(branch))}
    assert max(used) > min(used) >= 7
    assert not st.HarmonicBalance(system, harmonics=5).adaptive


def test_a_kink_stops_at_a_moderate_number_and_says_so():
    """|x| converges algebraically: 63 harmonics, a warning that names the remedy, more where `most` asks for it."""
    t = sp.Symbol("t", real=True)
    x, w = sp.Function("x")(t), sp.Symbol("Omega", real=True)
    system = st.System.from_equations(
        {x.diff(t, 2): -x.diff(t) / 10 - x - sp.Abs(x) / 2 + sp.cos(w * t) / 5}, coordinates=[x],
        period=2 * sp.pi / w, parameters={"Omega": 0.6}, name="kinked",
    )  # fmt: skip
    with pytest.warns(TruncationWarning, match="kink converges slowly"):
        branch = st.continuation(st.HarmonicBalance(system), "Omega", (0.6, 0.9))
    assert max(branch._problem(i).harmonics for i in range(len(branch))) == 63
    with pytest.warns(TruncationWarning):
        more = st.continuation(st.HarmonicBalance(system, harmonics=90, adaptive=True, most=100), "Omega", (0.6, 0.65))
    assert 90 <= max(more._problem(i).harmonics for i in range(len(more))) <= 100
    with pytest.raises(st.errors.InputError, match="most"):
        st.HarmonicBalance(system, harmonics=9, most=5)
