"""Equilibria: known solutions, exact gradients against differences, defining systems, scales."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, InputError
from stability.problems.defining import equations, first_extra, frame_of, locate
from stability.protocols import Problem


def lorenz_at(rho: float) -> tuple[st.Equilibrium, np.ndarray, np.ndarray]:
    problem = st.Equilibrium(st.models.lorenz())
    params = problem.system.parameter_vector(rho=rho)
    return problem, problem.start(params, {"x": 8, "y": 8, "z": rho - 1}), params


def test_lorenz_equilibrium_and_its_eigenvalues() -> None:
    """C+ = (sqrt(beta (rho - 1)), same, rho - 1); the cubic of its eigenvalues is in every textbook."""
    problem, u, params = lorenz_at(20.0)
    sigma, _, beta = (problem.parameters[k] for k in ("sigma", "rho", "beta"))
    c = np.sqrt(beta * 19)
    np.testing.assert_allclose(u, [c, c, 19.0], rtol=1e-12)
    cubic = np.roots([1, sigma + beta + 1, beta * (sigma + 20), 2 * sigma * beta * 19])
    point = problem.view(u, params)
    np.testing.assert_allclose(np.sort_complex(point.eigenvalues), np.sort_complex(cubic), rtol=1e-10)
    assert point.verdict is st.Verdict.STABLE and point["z"] == pytest.approx(19.0)


def test_it_is_a_problem() -> None:
    assert isinstance(st.Equilibrium(st.models.lorenz()), Problem)


@pytest.mark.parametrize("complex_vectors", [False, True])
def test_gradient_of_the_spectral_matrix_is_exact(complex_vectors: bool) -> None:
    problem, u, params = lorenz_at(24.0)
    rng = np.random.default_rng(1)
    w, v = rng.standard_normal((2, 3))
    if complex_vectors:
        w, v = w + 1j * rng.standard_normal(3), v + 1j * rng.standard_normal(3)
    by_u, by_p = problem.linearise(u, params).spectral_gradient(w, v)
    for k in range(6):
        du, dp = np.zeros(3), np.zeros(3)
        (du if k < 3 else dp)[k % 3] = 1e-5
        ends = [w @ problem.linearise(u + s * du, params + s * dp).spectral @ v for s in (1, -1)]
        expected = (ends[0] - ends[1]) / 2e-5
        assert (by_u if k < 3 else by_p)[k % 3] == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("kind", [st.Kind.FOLD, st.Kind.BRANCH_POINT, st.Kind.HOPF])
def test_conditions_of_the_defining_systems_have_exact_gradients(kind: st.Kind) -> None:
    problem, u, params = lorenz_at(24.0)
    u = u + 0.1
    L = problem.linearise(u, params)
    critical, k = problem.critical, list(problem.parameters).index("rho")
    extra = first_extra(kind, critical, np.linalg.eigvals(L.spectral))
    frame = frame_of(kind, L, critical, "rho", extra)
    at = equations(kind, L, critical, "rho", extra, frame)

    def g(du: np.ndarray, dp: np.ndarray, de: np.ndarray) -> np.ndarray:
        return equations(kind, problem.linearise(u + du, params + dp), critical, "rho", extra + de, frame).g

    none = np.zeros(3), np.zeros(3), np.zeros(extra.size)
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-5
        slope = (g(step, *none[1:]) - g(-step, *none[1:])) / 2e-5
        np.testing.assert_allclose(at.by_u[:, i], slope, atol=1e-7)
    step = np.zeros(3)
    step[k] = 1e-5
    slope = (g(none[0], step, none[2]) - g(none[0], -step, none[2])) / 2e-5
    np.testing.assert_allclose(at.by_params[:, k], slope, atol=1e-7)
    if kind is st.Kind.HOPF:
        slope = (g(none[0], none[1], np.array([1e-4])) - g(none[0], none[1], np.array([-1e-4]))) / 2e-4
        np.testing.assert_allclose(at.by_extra[:, 0], slope, rtol=1e-5, atol=1e-9)


def test_location_converges_quadratically() -> None:
    """From 10 % away the Hopf point of the Lorenz system is found to rounding in a few steps, omega^2 with it."""
    problem, u, params = lorenz_at(22.5)
    values = problem.view(u, params).eigenvalues
    found = locate(problem, st.Kind.HOPF, u, params, "rho", 1 / 30, values)
    sigma, beta = problem.parameters["sigma"], problem.parameters["beta"]
    assert found.converged and found.iterations <= 7
    assert found.params[1] == pytest.approx(470 / 19, abs=1e-11)
    assert found.extra[0] == pytest.approx(beta * (sigma + 470 / 19), rel=1e-10)


def test_bordered_solve_matches_a_dense_one() -> None:
    problem, u, params = lorenz_at(24.0)
    L = problem.linearise(u, params)
    rng = np.random.default_rng(2)
    for q in (0, 1, 2):
        rows, columns, corner = rng.standard_normal((q, 3)), rng.standard_normal((3, q)), rng.standard_normal((q, q))
        right = rng.standard_normal((3 + q, 2))
        K = np.block([[L.J, columns], [rows, corner]])
        np.testing.assert_allclose(L.solve(rows, columns, corner, right), np.linalg.solve(K, right), rtol=1e-9)


def test_starts_from_nothing_and_says_when_there_is_none() -> None:
    x, a = sp.symbols("x a", real=True)
    found = st.System(name="cubic", coordinates=("x",), states=("x",), parameters={"a": 30.0}, rhs=(a - x**3,))
    assert st.solve(st.Equilibrium(found))["x"] == pytest.approx(30 ** (1 / 3))
    never = st.System(name="none", coordinates=("x",), states=("x",), parameters={"a": 1.0}, rhs=(a + x**2,))
    with pytest.raises(ConvergenceError, match="give start="):
        st.solve(st.Equilibrium(never))


def test_forced_systems_and_wrong_scales_are_refused() -> None:
    with pytest.raises(InputError, match="use Collocation"):
        st.Equilibrium(st.models.duffing())
    with pytest.raises(InputError, match="positive numbers"):
        st.Equilibrium(st.models.lorenz(), scales={"x": -1.0})


def test_specification_makes_an_equal_problem() -> None:
    problem = st.Equilibrium(st.models.lorenz(), scales={"x": 2.0})
    again = st.Equilibrium.from_spec(problem.spec)
    assert again.system == problem.system and again.spec == problem.spec


def test_hopf_amplitude_law_of_a_slow_oscillator() -> None:
    """x'' - (mu - x^2) x' + x = 0: orbits of amplitude 2 sqrt(mu) and period 2 pi (1 + mu^2/16...) near mu = 0."""
    x, v, mu = sp.symbols("x x_dot mu", real=True)
    system = st.System(
        name="weak", coordinates=("x",), states=("x", "x_dot"), parameters={"mu": 0.0}, rhs=(v, (mu - x**2) * v - x)
    )
    branch = st.continuation(st.Equilibrium(system), "mu", (-0.5, 0.5))
    assert branch.labels == ("HB1",) and abs(branch["HB1"].params["mu"]) < 1e-11
    orbits = st.continuation(st.switch(branch["HB1"]), "mu", (-0.5, 0.5), at=(0.01,))
    small = orbits["UZ1"].solution
    assert small.max["x"] == pytest.approx(2 * np.sqrt(0.01), rel=1e-3)
    assert small.period == pytest.approx(2 * np.pi, rel=1e-4) and small.verdict is st.Verdict.STABLE
