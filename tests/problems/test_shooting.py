"""Shooting against collocation (1e-9), closed forms, differences of its residual; single and multiple alike."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, InputError
from stability.problems.collocation import Collocation
from stability.problems.shooting import Shooting
from stability.protocols import OrbitProblem, Problem
from stability.words import Verdict

t, xi, beta, Omega, mu = sp.symbols("t xi beta Omega mu", real=True)
u = sp.Function("u")(t)
VDP_PERIOD = 6.6632868593231301896996820305  # mu = 1; Andersen & Geer (1982)


def duffing():
    return st.System.from_equations(
        {u.diff(t, 2): -2 * xi * u.diff(t) - u - beta * u**3 + Omega**2 * sp.cos(Omega * t)},
        coordinates=[u],
        parameters={"xi": 0.02, "beta": 0.05, "Omega": 2.0},
        period=2 * sp.pi / Omega,
    )


def van_der_pol(value=1.0):
    return st.System.from_equations(
        {u.diff(t, 2): mu * (1 - u**2) * u.diff(t) - u}, coordinates=[u], parameters={"mu": value}
    )


def circle(radius=2.0, period=6.66):
    w = 2 * np.pi / period
    return (lambda s: radius * np.array([np.cos(w * s), -w * np.sin(w * s)]), period)


@pytest.mark.parametrize("segments", (1, 3, 5))
def test_the_same_forced_orbit_as_collocation(segments):
    system = duffing()
    p = system.parameter_vector(Omega=1.2)
    one, other = Shooting(system, segments=segments), Collocation(system, accuracy=1e-12)
    orbit = one.view(one.start(p), p)
    x = other.start(p)
    while (better := other.adapt(x, p, None)) is not None:
        other, x, _ = better
        x = other.start(p, x)
    same = other.view(x, p)
    times = np.linspace(0, orbit.period, 77)
    assert np.abs(orbit(times) - same(times)).max() < 1e-9
    assert np.abs(np.sort_complex(orbit.multipliers) - np.sort_complex(same.multipliers)).max() < 1e-9
    assert orbit.verdict is same.verdict is Verdict.STABLE
    assert abs(np.prod(orbit.multipliers) - np.exp(-2 * 0.02 * orbit.period)) < 1e-10  # Liouville


@pytest.mark.parametrize("segments", (1, 4))
def test_van_der_pol(segments):
    problem = Shooting(van_der_pol(), segments=segments)
    p = np.array([1.0])
    x = problem.start(p, circle())
    assert abs(x[-1] - VDP_PERIOD) < 1e-10
    spectrum = problem.spectrum(problem.linearise(x, p))
    assert spectrum.verdict is Verdict.STABLE and len(spectrum.values) == 1
    orbit = problem.view(x, p)
    s, w = np.polynomial.legendre.leggauss(300)
    divergence = (orbit.period / 2 * w) @ (1 - orbit(orbit.period * (s + 1) / 2)[0] ** 2)
    assert abs(np.log(spectrum.values[0].real) - divergence) < 1e-6
    assert problem.error(x, p) < 1e-11


def test_stiff_relaxation_agrees_with_collocation():
    """mu = 5: a transient multiplier of e^-85."""
    system, p = van_der_pol(5.0), np.array([5.0])
    shooting = Shooting(system, segments=6)
    x = shooting.start(p, dict(u=2.0))
    assert abs(x[-1] - 11.612230667) < 1e-8
    assert shooting.spectrum(shooting.linearise(x, p)).verdict is Verdict.STABLE


@pytest.fixture(params=[(0, 1), (0, 3), (1, 1), (1, 3)], ids=("forced 1", "forced 3", "own 1", "own 3"))
def case(request):
    kind, segments = request.param
    system = (duffing, van_der_pol)[kind]()
    problem = Shooting(system, segments=segments, scales=[1.3, 2.0], rtol=1e-13, atol=1e-14)
    p = system.parameter_vector()
    return problem, problem.start(p, {"u": 2.0} if kind else None), p, ("Omega", "mu")[kind]


def central(f, step):
    return (8 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12 * step)


def test_linearisation_is_the_derivative_of_the_residual(case):
    problem, x, p, free = case
    L, size = problem.linearise(x, p), problem.size

    def F(x_, p_):
        M = problem.linearise(x_, p_)
        M.reference = x
        return M.residual

    J = np.column_stack([central(lambda h: F(x + h * e, p), 1e-3) for e in np.eye(size)])  # noqa: B023
    j = problem.index(free)
    column = central(lambda h: F(x, p + h * np.eye(len(p))[j]), 1e-3)
    assert np.abs(L.matrix - J).max() < 1e-8
    assert np.abs(L.column(free) - column).max() < 1e-8
    rng = np.random.default_rng(0)
    v = rng.standard_normal(problem.n + problem.own + 1)
    assert np.abs(L.matrix @ L.lift(v[:-1]) - L.embed(L.core @ v[:-1])).max() < 1e-12
    whole = L.matrix @ L.lift(v, free) + v[-1] * L.column(free)
    assert np.abs(whole - L.embed(L.core @ v[:-1] + v[-1] * L.core_column(free))).max() < 1e-12


def test_gradients_against_larger_differences(case):
    """Fourth order with a tenfold step against the second-order ones of the class."""
    problem, x, p, free = case
    L, rng = problem.linearise(x, p), np.random.default_rng(1)
    w, v = rng.standard_normal(2), rng.standard_normal(2)
    du, dp = rng.standard_normal(len(x)) * 0.3, np.zeros(len(p))
    dp[problem.index(free)] = 0.2
    gu, gp = L.spectral_gradient(w, v)
    wanted = central(lambda h: w @ problem.linearise(x + h * du, p + h * dp).spectral @ v, 1e-3)
    assert abs(gu @ du + gp @ dp - wanted) < 1e-6 * max(1, abs(wanted))


@pytest.mark.parametrize("segments", (1, 3))
def test_folds_of_the_duffing_peak_are_those_of_collocation(segments):
    system = st.models.duffing(xi=0.02, beta=0.001)
    branch = st.continuation(Shooting(system, segments=segments), "Omega", (1.0, 1.5))
    found = sorted(s.params["Omega"] for s in branch.special)
    assert len(found) == 2
    assert abs(found[0] - 1.088436639) < 2e-9 and abs(found[1] - 1.380933030) < 2e-9
    for point in branch.special:
        assert min(abs(point.multipliers - 1)) < 1e-6


@pytest.mark.parametrize("omega", (2.6, 0.8))
def test_strongly_nonlinear_orbits_between_the_nodes(omega):
    """x'' + 0.1 x' + x + x^3 = 25 cos(omega t): the orbit of collocation, anywhere in time, to its stated error."""
    system = st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=25.0, omega=omega)
    p = system.parameter_vector()
    problem = Collocation(system)
    x = problem.start(p, {system.states[0]: 3.0})
    for _ in range(8):
        better = problem.adapt(x, p, None)
        if better is None:
            break
        problem, x, _ = better
        x = problem.start(p, x)
    orbit = problem.view(x, p)
    other = Shooting(system, segments=5, rtol=1e-12, atol=1e-13)
    same = other.view(other.start(p, orbit), p)
    times = np.linspace(0, orbit.period, 997)
    assert orbit.error <= 1e-9
    assert np.abs((orbit(times) - same(times)) / problem.scales[:, None]).max() < 2e-9
    assert orbit.verdict is same.verdict
    columns = problem.measures(x, p)
    assert abs(columns[f"{system.states[0]}.max"] - same.max[system.states[0]]) < 1e-8


def test_verdicts_of_meshes_and_segments_agree():
    """10, 20, 40 intervals; 1, 3, 5 segments: stable and unstable solutions of the detached family."""
    system = duffing()
    branch = st.continuation(Collocation(system), "Omega", (3.0, 1.45))
    for point in branch.at(Omega=1.8):
        p = system.parameter_vector(Omega=1.8)
        problems = [Collocation(system, intervals=N, adaptive=False) for N in (10, 20, 40)]
        problems += [Shooting(system, segments=K) for K in (1, 3, 5)]
        verdicts = {problem.view(problem.start(p, point), p).verdict for problem in problems}
        assert verdicts == {point.verdict}


def test_doubled_problem_and_spec():
    problem = Shooting(duffing(), segments=2)
    p = problem.system.parameter_vector()
    x = problem.start(p)
    double, y, direction = problem.doubled(x, p, np.array([0.5, -1.0]))
    assert double.linearise(y, p).size_of_residual < 1e-9
    assert np.abs(direction[:4] + direction[4:]).max() == 0
    assert Shooting.from_spec(problem.spec).spec == problem.spec
    assert isinstance(problem, Problem) and isinstance(problem, OrbitProblem)


def test_refusals_and_trouble():
    with pytest.raises(InputError, match="rtol"):
        Shooting(duffing(), rtol=0)
    with pytest.raises(InputError, match="segments"):
        Shooting(duffing(), segments=0)
    with pytest.raises(InputError, match="autonomous"):
        Shooting(van_der_pol()).start(np.array([1.0]))
    with pytest.raises(ConvergenceError, match="did not settle"):
        Shooting(van_der_pol(-1.0)).start(np.array([-1.0]), dict(u=0.5))
    blow = st.System.from_equations(  # u' = 1 + u^2 explodes within one period
        {u.diff(t): 1 + u**2 + sp.cos(Omega * t)}, coordinates=[u], parameters={"Omega": 1.0}, period=2 * sp.pi / Omega
    )
    problem = Shooting(blow)
    found = problem.correct(np.zeros(1), np.array([1.0]), "Omega", None, 0.0, 1e-9)
    assert not found.converged and "not finite" in found.note


def test_a_parameter_that_does_not_act_on_the_orbit_does_not_stop_the_integration():
    """At phi = 0 nothing depends on the pendulum's length; its computed derivative is rounding (SI units, 0.2 g)."""
    system = st.models.autoparametric_pendulum.from_physical()
    one, two = st.solve(st.Shooting(system)), st.solve(st.Collocation(system))
    assert one.max["y"] == pytest.approx(two.max["y"], rel=1e-8)
    assert one.multipliers == pytest.approx(two.multipliers, rel=1e-6, abs=1e-9)
