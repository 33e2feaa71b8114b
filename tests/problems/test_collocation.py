"""Collocation against closed forms, scipy's DOP853, identities (Liouville, order 2m), and differences of its residual."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.errors import ConvergenceError, InputError, UnknownNameError
from stability.problems.collocation import Collocation
from stability.protocols import OrbitProblem, Problem
from stability.words import Verdict

t, xi, beta, Omega, mu, k = sp.symbols("t xi beta Omega mu k", real=True)
u = sp.Function("u")(t)
VDP_PERIOD = 6.6632868593231301896996820305  # mu = 1; Andersen & Geer (1982), J. Comput. Appl. Math. 42, 678


def duffing(**values):
    return st.System.from_equations(
        {u.diff(t, 2): -2 * xi * u.diff(t) - u - beta * u**3 + Omega**2 * sp.cos(Omega * t)},
        coordinates=[u],
        parameters={"xi": 0.02, "beta": 0.05, "Omega": 2.0, **values},
        period=2 * sp.pi / Omega,
    )


def van_der_pol(value=1.0):
    return st.System.from_equations(
        {u.diff(t, 2): mu * (1 - u**2) * u.diff(t) - u}, coordinates=[u], parameters={"mu": value}
    )


def circle(radius=2.0, period=6.66):
    w = 2 * np.pi / period
    return (lambda s: radius * np.array([np.cos(w * s), -w * np.sin(w * s)]), period)


def solved(problem, params=None, guess=None):
    """(problem, u, params) with the mesh the problem wants."""
    params = problem.system.parameter_vector() if params is None else params
    x = problem.start(params, guess)
    for _ in range(12):
        better = problem.adapt(x, params, None)
        if better is None:
            break
        problem, x, _ = better
        x = problem.start(params, x)
    return problem, x, params


# ---------------------------------------------------------------------- solutions
@pytest.mark.parametrize("value", (0.3, 0.98, 1.0, 2.7))
def test_linear_response_and_multipliers_are_the_closed_form(value):
    """u = Re(Omega^2 / (1 - Omega^2 + 2 i xi Omega) e^{i Omega t}); multipliers exp(T (-xi +- i sqrt(1 - xi^2)))."""
    system = duffing(beta=0.0, Omega=value)
    problem, x, p = solved(Collocation(system))
    orbit = problem.view(x, p)
    amplitude = value**2 / (1 - value**2 + 2j * 0.02 * value)
    times = np.linspace(0, orbit.period, 101)
    wanted = np.array([(amplitude * np.exp(1j * value * times) * f).real for f in (1, 1j * value)])
    assert np.abs(orbit(times) - wanted).max() < 1e-8 * abs(amplitude)
    T = 2 * np.pi / value
    root = np.exp(T * (-0.02 + 1j * np.sqrt(1 - 0.02**2)))
    assert np.abs(np.sort_complex(orbit.multipliers) - np.sort_complex([root, root.conj()])).max() < 1e-8
    columns = problem.measures(x, p)
    assert abs(columns["u.amplitude(1)"] - abs(amplitude)) < 1e-8 * abs(amplitude)
    assert abs(columns["u.max"] - abs(amplitude)) < 1e-8 * abs(amplitude)
    assert abs(columns["period"] - T) < 1e-14 * T
    assert orbit.verdict is Verdict.STABLE


def test_van_der_pol_period_and_liouville():
    """T to ten digits; the non-trivial multiplier is exp(int_0^T (1 - u^2) dt)."""
    problem, x, p = solved(Collocation(van_der_pol(), accuracy=1e-11), guess=circle())
    assert abs(x[-1] - VDP_PERIOD) < 1e-10
    orbit = problem.view(x, p)
    s, w = np.polynomial.legendre.leggauss(200)
    times = orbit.period * (s + 1) / 2
    divergence = (orbit.period / 2 * w) @ (1 - orbit(times)[0] ** 2)
    spectrum = problem.spectrum(problem.linearise(x, p))
    assert abs(np.log(spectrum.values[0].real) - divergence) < 1e-6
    assert spectrum.error < 1e-8 and spectrum.verdict is Verdict.STABLE
    assert len(orbit.multipliers) == 2 and orbit.multipliers[0] == 1


def test_monodromy_against_an_independent_integrator():
    system = duffing()
    problem, x, p = solved(Collocation(system))
    n = 2

    def rhs(time, z):
        V = z[n:].reshape(n, n)
        a = np.array([[0, 1], [-1 - 0.15 * z[0] ** 2, -0.04]])
        f = [z[1], -0.04 * z[1] - z[0] - 0.05 * z[0] ** 3 + 4 * np.cos(2 * time)]
        return np.concatenate([f, (a @ V).ravel()])

    start = problem.mesh.split(x)[0][0]
    end = solve_ivp(rhs, (0, np.pi), np.concatenate([start, np.eye(n).ravel()]), "DOP853", rtol=1e-12, atol=1e-13).y[
        :, -1
    ]
    linearisation = problem.linearise(x, p)
    assert np.abs(end[:n] - start).max() < 1e-8
    assert np.abs(linearisation.fundamental - end[n:].reshape(n, n)).max() < 1e-8
    D = problem.scales
    assert np.abs(linearisation.spectral - linearisation.fundamental * D / D[:, None]).max() < 1e-15


@pytest.mark.parametrize("degree", (2, 3, 4))
def test_nodes_converge_with_order_2m_and_the_estimate_tells_the_error(degree):
    system, errors, estimates = van_der_pol(), [], []
    for N in (30, 60) if degree == 4 else (40, 80):
        problem = Collocation(system, degree=degree, intervals=N, adaptive=False, scales=[2.0, 2.7], period_scale=6.66)
        x = problem.start(system.parameter_vector(), circle())
        errors.append(abs(x[-1] - VDP_PERIOD) / VDP_PERIOD)
        estimates.append(problem.error(x, system.parameter_vector()))
    assert 2 ** (2 * degree - 1.0) < errors[0] / errors[1] < 2 ** (2 * degree + 1.5)
    assert all(error < 2 * estimate for error, estimate in zip(errors, estimates))
    assert 2 ** (2 * degree - 1.0) < estimates[0] / estimates[1] < 2 ** (2 * degree + 1.5)


def test_mesh_reaches_the_wanted_accuracy_and_stays():
    for accuracy in (1e-5, 1e-9):
        problem, x, p = solved(Collocation(van_der_pol(5.0), accuracy=accuracy), guess=circle(2.0, 11.6))
        assert problem.error(x, p) <= accuracy
        assert problem.adapt(x, p, None) is None
        wanted = 11.612230667  # mu = 5: the same period from shooting, see test_shooting
        assert abs(x[-1] - wanted) < max(3 * accuracy * wanted, 1e-8)


def test_breaks_are_mesh_points_and_keep_the_order():
    """q'' + 0.2 q' + q = sign(cos Omega t): piecewise closed form by matrix exponentials."""
    from scipy.linalg import expm

    system = st.System.from_equations(
        {u.diff(t, 2): -sp.Rational(1, 5) * u.diff(t) - u + sp.sign(sp.cos(Omega * t))},
        coordinates=[u],
        parameters={"Omega": 0.9},
        period=2 * sp.pi / Omega,
        breaks=(sp.Rational(1, 4), sp.Rational(3, 4)),
    )
    problem, x, p = solved(Collocation(system))
    assert {0.25, 0.75} <= set(problem.edges.tolist())
    T, A = 2 * np.pi / 0.9, np.array([[0, 1], [-1, -0.2]])
    force = np.linalg.solve(A, np.array([0, 1.0]))
    half = expm(A * T / 2)  # x(3T/4) = half x(T/4) + (half - 1) A^-1 b (-1), and x(3T/4) = -x(T/4) by symmetry
    quarter = np.linalg.solve(-np.eye(2) - half, -(half - np.eye(2)) @ force)
    orbit = problem.view(x, p)
    assert np.abs(orbit(T / 4) - quarter).max() < 1e-8
    assert problem.error(x, p) < 1e-9


def test_winding_orbit_of_a_driven_rotor():
    """theta'' = k - xi theta' - small cos theta cos(Omega t) turning once per period: k = xi Omega on average."""
    theta = sp.Function("theta")(t)
    system = st.System.from_equations(
        {theta.diff(t, 2): -xi * theta.diff(t) - k * sp.sin(theta) * sp.cos(Omega * t) + xi},
        coordinates=[theta],
        parameters={"xi": 0.3, "k": 0.4, "Omega": 1.0},
        period=2 * sp.pi / Omega,
        angles=("theta",),
    )
    problem = Collocation(system, winding={"theta": 1})
    p = system.parameter_vector()
    times = np.linspace(0, 2 * np.pi, 200)
    x = problem.start(p, (lambda s: np.array([s + 1.0, 1 + 0 * s]), 2 * np.pi))
    nodes = problem.mesh.split(x)[0]
    assert np.abs(nodes[-1] - nodes[0] - [2 * np.pi, 0]).max() < 1e-12
    orbit = problem.view(x, p)
    again = solve_ivp(
        lambda s, y: system(s, y), (0, 2 * np.pi), nodes[0], "DOP853", rtol=1e-11, atol=1e-12, dense_output=True
    )
    assert np.abs(orbit(times) - again.sol(times)).max() < 1e-7
    assert np.abs(orbit(times + orbit.period) - orbit(times) - [[2 * np.pi], [0]]).max() < 1e-9
    with pytest.raises(UnknownNameError):
        Collocation(system, winding={"theta_dot": 1})


def test_half_period_symmetry_gives_the_same_orbit_and_the_root_of_the_monodromy():
    """x(t + T/2) = -x(t) of the Duffing oscillator: N = -Phi_half, N^2 = Phi."""
    system = duffing()
    whole, x, p = solved(Collocation(system))
    half, y, _ = solved(Collocation(system, symmetry=-np.eye(2), intervals=10))
    times = np.linspace(0, np.pi, 60)
    assert np.abs(whole.view(x, p)(times) - half.view(y, p)(times)).max() < 1e-8
    N = half.linearise(y, p)
    D, E = half.scales, whole.scales
    square = (N.spectral @ N.spectral) * D[:, None] / D
    full = whole.linearise(x, p).spectral * E[:, None] / E
    assert np.abs(square - full).max() < 1e-8
    assert abs(half.measures(y, p)["u.amplitude(1)"] - whole.measures(x, p)["u.amplitude(1)"]) < 1e-8
    assert (
        np.abs(np.sort_complex(half.view(y, p).multipliers) - np.sort_complex(whole.view(x, p).multipliers)).max()
        < 1e-8
    )


# ---------------------------------------------------------------------- linear algebra of the protocol
def cases():
    forced = Collocation(duffing(), degree=3, intervals=5)
    own = Collocation(van_der_pol(), degree=4, intervals=7)
    slow = Collocation(
        st.System.from_equations(  # first-order equations: no state is the derivative of another
            {u.diff(t): -u + xi * u**2 + sp.sin(Omega * t)}, coordinates=[u], parameters={"xi": 0.2, "Omega": 1.0},
            period=2 * sp.pi / Omega,
        ),
        degree=3, intervals=4,
    )  # fmt: skip
    return [(forced, None, "Omega"), (own, circle(), "mu"), (slow, None, "Omega")]


@pytest.fixture(params=range(3), ids=("forced", "autonomous", "first order"))
def case(request):
    problem, guess, free = cases()[request.param]
    p = problem.system.parameter_vector()
    problem = dataclasses.replace(problem, scales=np.linspace(0.7, 2.0, problem.system.n), _memo={})
    return problem, problem.start(p, guess), p, free


def central(f, step):
    """Fourth-order central difference."""
    return (8 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12 * step)


def residual_of(problem, reference):
    def residual(x, p):
        out = problem.linearise(x, p).residual.copy()
        if problem.own:  # the phase condition of a fixed reference orbit
            out[-1] = (reference.phase_row * (problem.mesh.split(x)[1] - problem.mesh.split(reference.u)[1])).sum()
        return out

    return residual


def test_linearisation_is_the_derivative_of_the_residual(case):
    problem, x, p, free = case
    L = problem.linearise(x, p)
    F, size = residual_of(problem, L), len(x)
    rng = np.random.default_rng(0)
    J = np.column_stack([central(lambda h: F(x + h * e, p), 1e-3) for e in np.eye(size)])  # noqa: B023
    j = problem.index(free)
    column = central(lambda h: F(x, p + h * np.eye(len(p))[j]), 1e-3)
    assert np.abs(L.column(free) - column).max() < 1e-9
    for q in (0, 1, 2):
        rows, columns = rng.standard_normal((q, size)), rng.standard_normal((size, q))
        corner, right = rng.standard_normal((q, q)), rng.standard_normal((size + q, 3))
        solution = L.solve(rows, columns, corner, right)
        full = np.block([[J, columns], [rows, corner]])
        assert np.abs(full @ solution - right).max() < 1e-8 * max(1, np.abs(solution).max())
    order = problem.system.n + problem.own
    v = rng.standard_normal(order + 1)
    assert np.abs(J @ L.lift(v[:-1]) - L.embed(L.core @ v[:-1])).max() < 1e-8
    whole = J @ L.lift(v, free) + v[-1] * column
    assert np.abs(whole - L.embed(L.core @ v[:-1] + v[-1] * L.core_column(free))).max() < 1e-8


def test_gradients_of_monodromy_and_core_against_differences(case):
    problem, x, p, free = case
    L, rng, n = problem.linearise(x, p), np.random.default_rng(1), problem.system.n
    du, dp = rng.standard_normal(len(x)), rng.standard_normal(len(p))
    w, v = (rng.standard_normal(n) + 1j * rng.standard_normal(n) for _ in range(2))
    gradient_u, gradient_p = L.spectral_gradient(w, v)
    difference = central(lambda h: w @ problem.linearise(x + h * du, p + h * dp).spectral @ v, 1e-4)
    assert abs(gradient_u @ du + gradient_p @ dp - difference) < 1e-8 * max(1, abs(difference))
    order = n + problem.own
    a, b = rng.standard_normal(order), rng.standard_normal(order + 1)

    def core(h):
        M = problem.linearise(x + h * du, p + h * dp)
        if problem.own:
            object.__setattr__(M, "phase_row", L.phase_row)
        return a @ (M.core @ b[:-1] + M.core_column(free) * b[-1])

    gradient_u, gradient_p = L.core_gradient(a, b, free)
    difference = central(core, 1e-4)
    assert abs(gradient_u @ du + gradient_p @ dp - difference) < 1e-8 * max(1, abs(difference))


def test_tangent_and_arclength(case):
    """The corrected point is at the distance ds, and the tangent annihilates [F_u, F_lambda]."""
    problem, x, p, free = case
    first = problem.correct(x, p, free, None, 0.0, 1e-11)
    weight = 0.7
    size = np.sqrt(problem.weights @ first.tangent.u**2 + weight**2)
    tangent = first.tangent._replace(u=first.tangent.u / size, parameter=1 / size, weight=weight)
    second = problem.correct(first.u, first.params, free, tangent, 0.01, 1e-11)
    assert second.converged and second.iterations <= 4
    j = problem.index(free)
    gap = second.u - first.u
    length = problem.weights @ (tangent.u * gap) + weight**2 * tangent.parameter * (second.params[j] - first.params[j])
    assert abs(length - 0.01) < 1e-10
    L = problem.linearise(second.u, second.params)
    if problem.own:  # the phase condition of the solve had the given orbit as its reference
        object.__setattr__(L, "phase_row", problem.linearise(first.u, first.params).phase_row)
    new = second.tangent
    J = L.solve(np.zeros((0, len(x))), np.zeros((len(x), 0)), np.zeros((0, 0)), L.column(free)[:, None])[:, 0]
    assert np.abs(new.u + new.parameter * J).max() < 1e-6 * max(1, np.abs(J).max())
    norm = problem.weights @ new.u**2 + (weight * new.parameter) ** 2
    assert abs(norm - 1) < 1e-12
    assert problem.weights @ (new.u * tangent.u) + weight**2 * new.parameter * tangent.parameter > 0
    assert second.determinant_sign in (-1, 1)


def test_undamped_orbits_are_neutral_and_strong_contraction_is_known():
    """xi = 0: area is preserved, det M = 1 (NEUTRAL, never STABLE). mu = 5: log of the multiplier by Liouville."""
    problem, x, p = solved(Collocation(duffing(xi=0.0)))
    spectrum = problem.spectrum(problem.linearise(x, p))
    assert spectrum.verdict is Verdict.NEUTRAL
    assert abs(np.prod(spectrum.values) - 1) < 1e-10
    problem, x, p = solved(Collocation(van_der_pol(5.0), intervals=400), guess={"u": 2.0})
    orbit = problem.view(x, p)
    s, w = np.polynomial.legendre.leggauss(40)
    edges = orbit.edges
    times = (edges[:-1, None] + np.diff(edges)[:, None] * (s + 1) / 2).ravel()
    weights = (np.diff(edges)[:, None] * w / 2).ravel()
    divergence = weights @ (5 * (1 - orbit(times)[0] ** 2))
    value = problem.spectrum(problem.linearise(x, p)).values[0]
    assert abs(divergence + 85.4520) < 1e-3  # research: -85.4520
    assert abs(np.log(value.real) - divergence) < 1e-3 * abs(divergence)


def test_kernels_are_compiled_once_whatever_the_sort_of_array():
    """Read-only and strided tangents, as from a stored branch, must not start another compilation."""
    from stability.kernels import condensation_newton

    problem = Collocation(duffing(), winding=np.zeros(2))
    p = problem.system.parameter_vector()
    x = problem.start(p)
    tangent = problem.correct(x, p, "Omega", None, 0.0, 1e-9).tangent
    before = len(condensation_newton.newton.signatures)
    strided = np.repeat(tangent.u, 2)[::2]
    frozen = tangent.u.copy()
    frozen.setflags(write=False)
    x.setflags(write=False)
    for t_u in (strided, frozen):
        assert problem.correct(x, p, "Omega", tangent._replace(u=t_u), 0.0, 1e-9).converged
    problem.linearise(x, p)
    problem.view(x, p)
    assert len(condensation_newton.newton.signatures) == before == 1


def test_carried_error_of_the_multipliers_bounds_the_measured_one():
    """Along a branch on one mesh, the error carried over is never below the one measured at the point itself."""
    system = duffing(beta=0.001)
    problem = Collocation(system, scales=[3.0, 3.0])
    for value in np.linspace(0.5, 0.9, 9):
        p = system.parameter_vector(Omega=value)
        x = problem.start(p)
        carried = problem.spectrum(problem.linearise(x, p)).error
        fresh = dataclasses.replace(problem, _memo={})
        assert carried >= fresh.spectrum(fresh.linearise(x, p)).error - 1e-14


# ---------------------------------------------------------------------- branches
@pytest.mark.parametrize("window", ((0.3, 3.0), (3.0, 0.3)))
def test_folds_of_the_closed_duffing_peak(window):
    """The catalogue's numbers, from both directions; a fold has the multiplier +1."""
    branch = st.continuation(Collocation(duffing(beta=0.001)), "Omega", window)
    found = sorted(s.params["Omega"] for s in branch.special)
    assert len(found) == 2
    assert abs(found[1] - 1.380933030) < 2e-9 and abs(found[0] - 1.088436639) < 2e-9
    for point in branch.special:
        assert min(abs(point.multipliers - 1)) < 1e-7
        assert point.solution.error < 1e-8  # also where the linearisation at fixed Omega is singular


def test_the_open_resonance_has_its_fold_on_the_detached_family():
    assert not list(st.continuation(Collocation(duffing()), "Omega", (0.3, 3.0)).special)
    branch = st.continuation(Collocation(duffing()), "Omega", (3.0, 0.3))
    assert abs(branch["LP1"].params["Omega"] - 1.416368134) < 2e-9


def test_determinant_sign_survives_a_fold_and_a_change_of_mesh():
    system = duffing(beta=0.001)
    branch = st.continuation(Collocation(system), "Omega", (1.2, 1.5))
    signs = set()
    for intervals in (12, 20, 33):
        problem = Collocation(system, intervals=intervals, adaptive=False)
        for point in branch.at(Omega=1.3):
            p = system.parameter_vector(Omega=1.3)
            x = problem.start(p, point)
            first = problem.correct(x, p, "Omega", None, 0.0, 1e-10)
            size = np.sqrt(problem.weights @ first.tangent.u**2 + 1)
            sense = 1.0 if first.determinant_sign > 0 else -1.0  # along the branch, not along Omega
            tangent = first.tangent._replace(u=sense * first.tangent.u / size, parameter=sense / size)
            signs.add((intervals, problem.correct(x, p, "Omega", tangent, 0.0, 1e-9).determinant_sign))
    assert len(signs) == 3 and len({sign for _, sign in signs}) == 1


def test_unit_change_changes_nothing():
    """u = 1e6 q: the same multipliers and the same verdict from wildly scaled variables."""
    plain, x, p = solved(Collocation(duffing()))
    factor = 1e6
    scaled = st.System.from_equations(
        {u.diff(t, 2): -2 * xi * u.diff(t) - u - beta * u**3 / factor**2 + factor * Omega**2 * sp.cos(Omega * t)},
        coordinates=[u], parameters={"xi": 0.02, "beta": 0.05, "Omega": 2.0}, period=2 * sp.pi / Omega,
    )  # fmt: skip
    big, y, _ = solved(Collocation(scaled))
    assert np.abs(big.view(y, p).multipliers - plain.view(x, p).multipliers).max() < 1e-8
    assert abs(big.measures(y, p)["u.max"] / plain.measures(x, p)["u.max"] - factor) < 1e-8 * factor


# ---------------------------------------------------------------------- doubling, starts, data, refusals
def test_doubled_problem_runs_the_orbit_twice():
    problem, x, p = solved(Collocation(duffing()))
    vector = np.array([0.3, -0.8])
    double, y, direction = problem.doubled(x, p, vector)
    assert double.linearise(y, p).size_of_residual < 1e-9
    assert (
        np.abs(double.linearise(y, p).spectral - np.linalg.matrix_power(problem.linearise(x, p).spectral, 2)).max()
        < 1e-9
    )
    nodes = double.mesh.split(direction)[0]
    N = problem.mesh.intervals
    assert np.abs(nodes[N + 1 :] + nodes[1 : N + 1]).max() == 0
    assert np.abs(nodes[0] - problem.scales * vector).max() < 1e-14


def test_discretise_is_exact_for_a_trigonometric_polynomial():
    problem = Collocation(duffing())
    times = np.arange(32) * np.pi / 32
    wave = np.array([1 + np.cos(2 * times) - 0.3 * np.sin(6 * times), np.sin(4 * times)])
    nodes = problem.mesh.split(problem.discretise(times, wave, np.pi))[0]
    s = problem.edges * np.pi
    wanted = np.array([1 + np.cos(2 * s) - 0.3 * np.sin(6 * s), np.sin(4 * s)]).T
    assert np.abs(nodes - wanted).max() < 1e-12


def test_starts_from_a_state_an_orbit_and_a_function():
    problem = Collocation(van_der_pol())
    p = problem.system.parameter_vector()
    for guess in (dict(u=0.1), np.array([0.1, 0.0]), circle()):
        x = problem.start(p, guess)
        assert abs(x[-1] - VDP_PERIOD) < 2 * VDP_PERIOD * problem.error(x, p) < 1e-4
    orbit = problem.view(problem.start(p, circle()), p)
    other = Collocation(van_der_pol(), degree=3, intervals=33)
    x = other.start(p, orbit)
    assert abs(x[-1] - VDP_PERIOD) < 2 * VDP_PERIOD * other.error(x, p) < 1e-3


def test_spec_makes_an_equal_problem():
    problem, x, p = solved(Collocation(duffing(), winding=None, accuracy=1e-7))
    again = Collocation.from_spec(problem.spec)
    assert again.spec == problem.spec
    assert (again.linearise(x, p).residual == problem.linearise(x, p).residual).all()
    assert isinstance(again, Problem) and isinstance(again, OrbitProblem)


def test_refusals_say_what_to_do():
    with pytest.raises(InputError, match="autonomous: give a state"):
        Collocation(van_der_pol()).start(np.array([1.0]))
    with pytest.raises(InputError, match="whole number"):
        Collocation(duffing(), degree=2.5)
    with pytest.raises(InputError, match="accuracy"):
        Collocation(duffing(), accuracy=-1)
    with pytest.raises(UnknownNameError, match="did you mean 'Omega'"):
        Collocation(duffing()).index("omega")
    with pytest.raises(ConvergenceError, match="periodic orbit"):  # mu < 0: everything decays to rest
        Collocation(van_der_pol(-1.0)).start(np.array([-1.0]), dict(u=0.5))


def test_trouble_is_reported_not_raised():
    """log(u) at u < 0 is not finite: `correct` says where."""
    system = st.System.from_equations(
        {u.diff(t): -u + sp.log(u) + sp.cos(Omega * t)},
        coordinates=[u],
        parameters={"Omega": 1.0},
        period=2 * sp.pi / Omega,
    )
    problem = Collocation(system)
    found = problem.correct(np.full(problem.size, -1.0), np.array([1.0]), "Omega", None, 0.0, 1e-9)
    assert not found.converged and found.note.startswith("not finite: state u at phase")
    L = problem.linearise(np.full(problem.size, -1.0), np.array([1.0]))
    right = np.ones((problem.size, 1))
    assert np.isnan(L.solve(np.zeros((0, problem.size)), np.zeros((problem.size, 0)), np.zeros((0, 0)), right)).all()
    assert problem.spectrum(L).verdict is Verdict.UNDETERMINED


def test_systems_of_python_functions():
    """The same fold from a Python function (derivatives by differences, period by a callback) as from equations."""

    def oscillator(time, x, *, xi=0.02, beta=0.05, Omega=2.0):
        return np.array([x[1], -2 * xi * x[1] - x[0] - beta * x[0] ** 3 + Omega**2 * np.cos(Omega * time)])

    system = st.System.from_function(oscillator, states="u u_dot", period=lambda Omega: 2 * np.pi / Omega)
    branch = st.continuation(Collocation(system), "Omega", (3.0, 1.2))
    assert abs(branch["LP1"].params["Omega"] - 1.416368134) < 2e-9
    assert Collocation(system).spec["view_only"]
