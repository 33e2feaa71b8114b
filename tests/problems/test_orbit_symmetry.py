"""Periodic orbits on half of their period, x(t + P/2) = S x(t).

Witnesses: the same orbits on the whole period; the half-period map by scipy's DOP853; a decoupled oscillator whose
multipliers are known in closed form; van der Pol's equation, whose limit cycle has x(t + T/2) = -x(t).
"""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.errors import EquationError, InputError
from stability.problems.orbit_symmetry import Mirror, invariances

t, Omega = sp.symbols("t Omega", real=True)


def half_map(system, orbit, S, **params):
    """S^-1 Phi(P/2) along an orbit by DOP853 and differences of the field."""
    n = system.n

    def rhs(time, z):
        x, V = z[:n], z[n:].reshape(n, n)
        h = 1e-6
        steps = [(system(time, x + h * e, **params) - system(time, x - h * e, **params)) / (2 * h) for e in np.eye(n)]
        return np.concatenate([system(time, x, **params), (np.array(steps).T @ V).ravel()])

    start = np.concatenate([orbit(0.0), np.eye(n).ravel()])
    end = solve_ivp(rhs, (0, orbit.period / 2), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return end[:n], S @ end[n:].reshape(n, n)


# ---------------------------------------------------------------------- which symmetry
def test_a_symmetry_that_the_equations_do_not_have_is_refused():
    with pytest.raises(EquationError, match="does not have the symmetry"):
        st.Collocation(st.models.one_sided_magnet(), symmetry={"u": "-u"})
    with pytest.raises(InputError, match="half of 2 forcing period"):
        st.Collocation(st.models.duffing(), multiple=2, symmetry=st.Symmetry({"u": "-u"}, shift=0.5))
    with pytest.raises(InputError, match="signed permutation"):
        st.Collocation(st.models.duffing(), symmetry=np.diag([1.0, 2.0]))
    with pytest.raises(InputError, match="'auto' or None"):
        st.Collocation(st.models.duffing(), symmetry="yes")


def test_parameters_that_break_the_symmetry_are_refused():
    """gravity = 0 makes the oscillator symmetric: it cannot be continued, freed or set to another value."""
    problem = st.Collocation(st.models.duffing(xi=0.02, beta=0.05), symmetry="auto")
    with pytest.raises(InputError, match="'gravity' breaks the symmetry u -> -u"):
        st.continuation(problem, "gravity", (0.0, 1.0))
    with pytest.raises(InputError, match="'gravity' breaks"):
        st.solve(problem, gravity=0.5)
    fold = st.continuation(problem, "Omega", (3.0, 1.2))["LP1"]
    with pytest.raises(InputError, match="'gravity' breaks"):
        st.locus(fold, free="gravity")


def test_the_first_parameter_may_be_one_that_breaks_the_symmetry():
    """x'' + x'/5 + x + x^3 = cos(Omega t) + bias with bias = 0 in front."""
    x, bias = sp.Function("x")(t), sp.Symbol("bias", real=True)
    system = st.System.from_equations(
        {x.diff(t, 2): -x.diff(t) / 5 - x - x**3 + sp.cos(Omega * t) + bias}, coordinates=[x],
        parameters={"bias": 0.0, "Omega": 1.2}, period=2 * sp.pi / Omega,
    )  # fmt: skip
    problem = st.Collocation(system, symmetry="auto")
    assert problem.symmetry.fixed == ("bias",)
    orbit, whole = st.solve(problem), st.solve(st.Collocation(system))
    assert orbit.max["x"] == pytest.approx(whole.max["x"], abs=1e-9)
    assert len(st.continuation(problem, "Omega", (1.2, 1.5))) > 3
    with pytest.raises(InputError, match="'bias' breaks"):
        st.continuation(problem, "bias", (0.0, 0.1))


def test_auto_takes_what_there_is():
    half = st.Collocation(st.models.duffing_textbook(), symmetry="auto")
    assert half.halved and half.symmetry in half.system.symmetries and half.intervals == 10
    assert st.Collocation(st.models.duffing_textbook(), symmetry="auto", multiple=3).halved
    for problem in (
        st.Collocation(st.models.duffing_textbook(), symmetry="auto", multiple=2),
        st.Collocation(st.models.one_sided_magnet(), symmetry="auto"),
        st.Collocation(st.models.duffing_textbook()),
    ):
        assert not problem.halved and problem.intervals == 20
    pendulum = st.Collocation(st.models.autoparametric_pendulum(), symmetry="auto", multiple=2)
    assert repr(pendulum.symmetry) == "theta -> -theta"
    by_name = st.Collocation(st.models.duffing_textbook(), symmetry={"x": "-x"})
    by_matrix = st.Collocation(st.models.duffing_textbook(), symmetry=-np.eye(2))
    assert by_name.symmetry == by_matrix.symmetry == half.symmetry


def test_the_spec_is_complete():
    problem = st.Collocation(st.models.autoparametric_pendulum(), symmetry="auto", multiple=2)
    again = st.Collocation.from_spec(problem.spec)
    assert again.symmetry == problem.symmetry and again.automatic and again.spec == problem.spec


# ---------------------------------------------------------------------- orbits
def test_the_same_orbit_as_on_the_whole_period_and_its_half_map():
    system = st.models.duffing_textbook(delta=0.2, gamma=3.0, omega=0.7)
    orbits = [st.solve(st.Collocation(system, symmetry=s, accuracy=1e-11, intervals=n)) for s, n in ((None, 60), ("auto", 30))]
    whole, half = orbits
    times = np.linspace(0, 2 * whole.period, 77)
    np.testing.assert_allclose(half(times), whole(times), atol=1e-9)
    np.testing.assert_allclose(np.sort_complex(half.multipliers), np.sort_complex(whole.multipliers), atol=1e-9)
    np.testing.assert_allclose(np.sort_complex(half.half_multipliers**2), np.sort_complex(half.multipliers), atol=1e-14)
    assert whole.half_multipliers is None and half.period == whole.period
    assert half.amplitude(2)["x"] < 1e-13 and half.amplitude(3)["x"] == pytest.approx(whole.amplitude(3)["x"], abs=1e-9)
    end, N = half_map(system, half, -np.eye(2))
    np.testing.assert_allclose(-end, half(0.0), atol=1e-8)
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(N)), np.sort_complex(half.half_multipliers), atol=1e-7)


def test_swinging_pendulum_over_one_forcing_period():
    """theta(t + T) = -theta(t), u(t + T) = u(t) on 2T, solved on T; both by direct integration over 2T."""
    system = st.models.autoparametric_pendulum(
        length_ratio=10.0, mass_ratio_total=0.2, Omega0=0.5, xi1=0.02, xi2=0.01, base_term=False, Omega=0.9
    )
    problem = st.Collocation(system, multiple=2, symmetry="auto", accuracy=1e-11)
    assert problem.span == 1.0
    hanging = st.continuation(st.Collocation(system), "Omega", (0.7, 0.9))
    guess = st.continuation(st.switch(hanging["PD1"]), "Omega", (0.7, 0.9)).at(Omega=0.8)[0]
    orbit = st.solve(problem, start=guess, Omega=0.8)
    assert orbit.max["theta"] > 0.05 and orbit.period == pytest.approx(4 * np.pi / 0.8, rel=1e-12)
    T = orbit.period / 2
    system = system.with_params(Omega=0.8)
    run = solve_ivp(system, (0, 2 * T), orbit(0.0), method="DOP853", rtol=1e-11, atol=1e-12, t_eval=[T, 2 * T]).y
    signs = np.array([1, -1, 1, -1])
    np.testing.assert_allclose(run[:, 0], signs * orbit(0.0), atol=1e-7)
    np.testing.assert_allclose(run[:, 1], orbit(0.0), atol=1e-7)
    _, N = half_map(system, orbit, np.diag(signs))
    expected = np.sort_complex(np.linalg.eigvals(N))
    np.testing.assert_allclose(np.sort_complex(orbit.half_multipliers), expected, atol=1e-6)


def test_limit_cycle_of_van_der_pol_on_half_of_its_own_period():
    """T(mu = 1) = 6.663286859323..., multiplier from Liouville's formula: exp int mu (1 - x^2) dt."""
    system = st.models.van_der_pol(mu=1.0)
    half = st.solve(st.Collocation(system, symmetry={"x": "-x"}, intervals=20), start=dict(x=2.0))
    whole = st.solve(st.Collocation(system, intervals=40), start=dict(x=2.0))
    assert half.period == pytest.approx(6.6632868593231, abs=1e-8)
    assert half.period == pytest.approx(whole.period, abs=1e-9)
    np.testing.assert_allclose(np.sort(half.multipliers.real), np.sort(whole.multipliers.real), atol=1e-8)
    times = np.linspace(0, half.period, 23)
    np.testing.assert_allclose(half(times + half.period / 2), -half(times), atol=1e-12)


def test_oscillation_about_the_upright_position():
    """theta(t + T/2) = 2 pi - theta(t) of a driven pendulum: S theta + w with w = 2 pi, no winding of the whole orbit."""
    theta = sp.Function("theta")(t)
    system = st.System.from_equations(
        {theta.diff(t, 2): -sp.Rational(1, 10) * theta.diff(t) - sp.sin(theta) + sp.cos(Omega * t) / 5},
        coordinates=[theta], parameters={"Omega": 1.5}, period=2 * sp.pi / Omega, angles=("theta",),
    )  # fmt: skip
    guess = (lambda s: np.array([np.pi + 0 * s, 0 * s]), 2 * np.pi / 1.5)
    half = st.solve(st.Collocation(system, symmetry="auto", winding=[2 * np.pi, 0.0]), start=guess)
    whole = st.solve(st.Collocation(system), start=guess)
    assert half.max["theta"] == pytest.approx(whole.max["theta"], abs=1e-9) and 3 < half.min["theta"] < np.pi
    np.testing.assert_allclose(half.winding, 0.0, atol=1e-15)
    np.testing.assert_allclose(np.sort(half.multipliers.real), np.sort(whole.multipliers.real), rtol=1e-8)


def decoupled(rate, frequency=0.5):
    """A linear forced oscillator, and w'' = rate w' - frequency^2 w - w'^3 beside it: a torus at rate = 0."""
    u, w = sp.Function("u")(t), sp.Function("w")(t)
    a = sp.Symbol("a", real=True)
    return st.System.from_equations(
        {
            u.diff(t, 2): -sp.Rational(1, 5) * u.diff(t) - 2 * u + sp.cos(Omega * t),
            w.diff(t, 2): a * w.diff(t) - frequency**2 * w - w.diff(t) ** 3,
        },
        coordinates=[u, w], parameters={"Omega": 1.0, "a": rate}, period=2 * sp.pi / Omega,
    )  # fmt: skip


@pytest.mark.parametrize(("frequency", "resonance"), [(0.5, "resonance 1:2"), (0.31, None), (1 / 3, "resonance 1:3")])
def test_pairs_of_the_half_period_map(frequency, resonance):
    """S = -1 on both: N has -exp(+-i frequency T/2) at a = 0. Frequency 1/2: +-i, a double -1 of the whole period."""
    problem = st.Collocation(decoupled(-0.1, frequency), symmetry={"u": "-u", "w": "-w"})
    torus = st.continuation(problem, "a", (-0.1, 0.1))["NS1"]
    assert abs(torus.params["a"]) < 1e-9
    exact = -np.exp(1j * frequency * np.pi)
    assert np.abs(torus.half_multipliers - exact).min() < 1e-8
    assert np.abs(torus.multipliers - exact**2).min() < 1e-8
    assert (None if torus.resonance is None else str(torus.resonance)) == resonance
    assert ("near" in repr(torus)) == (resonance is not None)


def test_curve_of_torus_points_of_the_half_period_map():
    """At a = 0 for every frequency W; angle of the whole period W T, folded; a double -1 where W = 1/2."""
    u, w = sp.Function("u")(t), sp.Function("w")(t)
    a, W = sp.symbols("a W", real=True)
    system = st.System.from_equations(
        {
            u.diff(t, 2): -sp.Rational(1, 5) * u.diff(t) - 2 * u + sp.cos(Omega * t),
            w.diff(t, 2): a * w.diff(t) - W**2 * w - w.diff(t) ** 3,
        },
        coordinates=[u, w], parameters={"Omega": 1.0, "a": -0.1, "W": 0.4}, period=2 * sp.pi / Omega,
    )  # fmt: skip
    torus = st.continuation(st.Collocation(system, symmetry={"u": "-u", "w": "-w"}), "a", (-0.1, 0.1))["NS1"]
    curve = st.continuation(st.locus(torus, free="a", along="W"), "W", (0.3, 0.7))
    assert np.abs(curve.columns["a"]).max() < 1e-9
    turns = 2 * np.pi * curve.columns["W"]
    np.testing.assert_allclose(curve.columns["torus_angle"], np.minimum(turns, 2 * np.pi - turns), atol=1e-7)
    places = {str(p.kind): p.params["W"] for p in curve.special if str(p.kind).startswith("resonance")}
    assert places == {"resonance 1:2": pytest.approx(0.5, abs=1e-7), "resonance 1:3": pytest.approx(1 / 3, abs=1e-7)}


# ---------------------------------------------------------------------- images
def test_the_image_of_a_discrete_solution_is_one():
    """An asymmetric orbit of Duffing's oscillator on a mesh with a knot at the middle: the image's residual is rounding."""
    system = st.models.duffing_textbook(delta=0.1, gamma=25.0)
    symmetric = st.continuation(st.Collocation(system, symmetry="auto"), "omega", (2.5, 2.1))
    loop = st.continuation(st.switch(symmetric["BP1"]), "omega", (2.5, 1.9), max_points=8)
    problem, u = loop._problem(len(loop) - 2), np.array(loop.unknowns[len(loop) - 2])
    params = loop._vector(len(loop) - 2)
    assert 0.5 in problem.mesh.edges and isinstance(problem.mirror, Mirror) and invariances(problem, u) == []
    image, v = problem.image_problem(), problem.image(u)
    assert np.abs(image.linearise(v, params).residual).max() < 1e-9
    one, other = problem.view(u, params), image.view(v, params)
    times = np.linspace(0, one.period, 41)
    np.testing.assert_allclose(other(times), -one(times - one.period / 2), atol=1e-12)
    assert np.abs(other(times) - one(times)).max() > 0.1
    np.testing.assert_array_equal(image.image(v), u)
