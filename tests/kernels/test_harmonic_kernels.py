"""Loops of harmonic balance against numpy; the compiled Newton solve against dense algebra."""

import numpy as np
import pytest

import stability as st
from stability.kernels.harmonic_assembly import multiply
from stability.kernels.harmonic_stability import _solve_small
from stability.protocols import Tangent


@pytest.mark.parametrize("columns", [1, 2, 5])
@pytest.mark.parametrize("rows", [1, 4, 7, 10])
def test_products(rows, columns):
    rng = np.random.default_rng(rows)
    A, B = rng.standard_normal((3, rows)), rng.standard_normal((rows, columns))
    out = np.empty((3, columns))
    multiply.py_func(A, B, out)
    assert np.abs(out - A @ B).max() < 1e-14 * rows


def test_small_systems_with_interchanges():
    rng = np.random.default_rng(1)
    for n in (1, 2, 3, 6):
        A = rng.standard_normal((n, n)) + 1j * rng.standard_normal((n, n))
        A[0, 0] = 0.0 if n > 1 else 2.0
        b = rng.standard_normal((n, 2)) + 0j
        x = b.copy()
        assert _solve_small.py_func(A.copy(), x)
        assert np.abs(A @ x - b).max() < 1e-12
    assert not _solve_small.py_func(np.zeros((2, 2), complex), np.ones((2, 1), complex))


def test_one_step_of_the_compiled_newton_method():
    """One bordered step, its tangent, and the sign of the determinant, by numpy from the same Jacobian."""
    system = st.models.chain(beta1=0.01, beta2=0.02, Omega=0.8)
    problem = st.HarmonicBalance(system, harmonics=3)
    p, rng = system.parameter_vector(), np.random.default_rng(2)
    u = problem.start(p) + 1e-3 * rng.standard_normal(problem.size)
    index, w = problem.index("Omega"), problem.weights
    tangent = Tangent(rng.standard_normal(problem.size), 0.3, 0.7)
    L = problem.linearise(u, p)
    A = np.block([[L.matrix, L.column("Omega")[:, None]], [(w * tangent.u)[None], np.array([[0.3 * 0.7**2]])]])
    step = np.linalg.solve(A, np.append(-L.residual, 0.0))
    direction = np.linalg.solve(A, np.append(np.zeros(problem.size), 1.0))
    new_u, new_p = u.copy(), p.copy()
    work, _, iterations, (_, sign), _ = problem.newton(new_u, new_p, index, tangent, 0.0, 1e-30, 1)
    assert iterations == 1
    assert np.abs(new_u - u - step[:-1]).max() < 1e-12
    assert abs(new_p[index] - p[index] - step[-1]) < 1e-12
    direction /= np.sqrt(w @ direction[:-1] ** 2 + (0.7 * direction[-1]) ** 2)
    assert np.abs(work.x[1] - direction).max() < 1e-12
    assert sign == int(np.linalg.slogdet(A)[0])


def test_a_singular_system_is_said():
    """x'' + x = 0 with no damping at its own frequency: every first harmonic is a solution."""
    system = st.models.duffing(xi=0.0, beta=0.0)
    problem = st.HarmonicBalance(system, harmonics=1)
    p = system.parameter_vector(Omega=1.0)
    found = problem.correct(np.zeros(problem.size), p, "xi", None, 0.0, 1e-9)
    assert not found.converged
    assert found.note in ("singular", "no convergence")
