"""The condensed solve against a sparse direct solve of the whole matrix, and its products against dense ones."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from stability.kernels.condensation import condense, solve_stages, solve_stages_transposed
from stability.kernels.condensation_reduced import monodromy_product, reduce_and_solve
from stability.kernels.condensation_sweeps import adjoint_sweep, forward_sweep
from stability.kernels.gauss import gauss_rule


class Case:
    """A random linearised collocation problem; `whole` is its matrix, unknowns (nodes, stages)."""

    def __init__(self, n, intervals, degree, oscillator, growth=0.0, seed=0):
        rng = np.random.default_rng(seed)
        self.rule, self.n, self.N = gauss_rule(degree), n, intervals
        self.h = rng.uniform(0.5, 1.5, intervals) / intervals
        self.sigma = 2.3
        J = rng.standard_normal((intervals * degree, n, n)) + growth * np.diag(np.linspace(1, -1, n))
        self.kept, self.position = np.arange(n), np.full(n, -1)
        if oscillator:
            half = n // 2
            J[:, :half] = 0
            J[:, np.arange(half), half + np.arange(half)] = 1
            self.kept, self.position = np.arange(half, n), np.arange(half)
        self.J, self.size = J, degree * n
        self.S = np.linalg.qr(rng.standard_normal((n, n)))[0]
        small = degree * len(self.kept)
        self.LU, self.pivots = np.empty((intervals, small, small)), np.empty((intervals, small), np.int64)
        self.Z, self.M = np.empty((intervals, self.size, n)), np.empty((intervals, n, n))
        self.rng = rng

    def factors(self):
        return self.rule.matrix, self.h, self.sigma, self.J, self.kept, self.position, self.LU, self.pivots

    def condense(self, columns):
        r = self.rule
        return condense(
            r.inverse, r.matrix, r.row_sums, r.update, self.h, self.sigma, self.J, self.kept, self.position, columns,
            self.LU, self.pivots, self.Z, self.M,
        )  # fmt: skip

    def block(self, j):
        m, n = self.rule.degree, self.n
        G = np.kron(self.rule.inverse, np.eye(n))
        for i in range(m):
            G[i * n : (i + 1) * n, i * n : (i + 1) * n] -= self.h[j] * self.sigma * self.J[j * m + i]
        return G

    def whole(self):
        N, n, size, r = self.N, self.n, self.size, self.rule
        nodes = (N + 1) * n
        K = sparse.lil_matrix((nodes + N * size, nodes + N * size))
        for j in range(N):
            here, stage = slice(j * n, (j + 1) * n), slice(nodes + j * size, nodes + (j + 1) * size)
            K[stage, stage] = self.block(j)
            K[stage, here] = -np.kron(r.row_sums[:, None], np.eye(n))
            K[here, here] = -(1 - r.update.sum()) * np.eye(n)
            K[here, (j + 1) * n : (j + 2) * n] = np.eye(n)
            K[here, stage] = -np.kron(r.update[None], np.eye(n))
        K[N * n : nodes, N * n : nodes] = np.eye(n)
        K[N * n : nodes, :n] = -self.S
        return K.tocsc()


CASES = [
    (2, 6, 4, False, 0.0),
    (2, 6, 4, True, 0.0),
    (3, 5, 5, False, 0.0),
    (4, 8, 3, True, 0.0),
    (12, 4, 4, True, 0.0),
    (4, 20, 4, False, 25.0),
]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("q", (0, 1, 2))
def test_bordered_solve_against_splu(case, q):
    """Also with directions that grow and shrink by e^50 over the period (the last case), where products are useless."""
    c = Case(*case)
    sides, nodes = 2, (c.N + 1) * c.n
    total = nodes + c.N * c.size
    columns, rows = c.rng.standard_normal((total, q + sides)), c.rng.standard_normal((q, total))
    corner, last = c.rng.standard_normal((q, q)), c.rng.standard_normal((q, sides))
    full = (
        sparse.bmat([[c.whole(), sparse.csc_matrix(columns[:, :q])], [sparse.csc_matrix(rows), corner]]).tocsc()
        if q
        else c.whole()
    )
    right = np.concatenate([columns[:, q:], last]) if q else columns
    wanted = splu(full).solve(right)
    X = columns[nodes:].reshape(c.N, c.size, -1).copy()
    assert c.condense(X) != 0
    solutions = np.empty((sides, total + q))
    sign = reduce_and_solve(
        c.rule.update, c.Z, c.M, X, columns[:nodes].reshape(c.N + 1, c.n, -1), rows[:, nodes:].reshape(q, c.N, c.size),
        rows[:, :nodes].reshape(q, c.N + 1, c.n), np.concatenate([corner, last], axis=1), c.S, 0,
        solutions,
    )  # fmt: skip
    assert sign in (-1, 1)
    for side in range(sides):
        x = solutions[side]
        residual = np.abs(full @ x - right[:, side]).max()
        assert residual < 1e-10 * (1 + np.abs(x).max())
        assert np.abs(x - wanted[:, side]).max() < 1e-8 * np.abs(wanted).max()


def test_determinant_sign_does_not_depend_on_the_mesh_and_flips_with_the_determinant():
    """det (Phi - S) of one and the same flow on 3 to 9 intervals; a row exchange of S flips the sign."""
    signs = []
    for N in (3, 4, 7, 9):
        for flip in (1.0, -1.0):
            c = Case(2, N, 4, True, seed=3)
            c.h[:] = 1 / N
            c.J[:] = c.J[0]
            c.S = np.diag([flip, 1.0])
            X = np.zeros((N, c.size, 1))
            assert c.condense(X) == 1
            none = np.zeros((0, N, c.size)), np.zeros((0, N + 1, 2)), np.zeros((0, 1))
            out = np.empty((1, (N + 1) * 2 + N * c.size))
            sign = reduce_and_solve(c.rule.update, c.Z, c.M, X, np.zeros((N + 1, 2, 1)), *none, c.S, 0, out)
            signs.append((flip, sign, np.sign(np.linalg.det(monodromy_product(c.M) - c.S))))
    assert all(s == d for _, s, d in signs)


def _chain(n):
    """States that know their neighbours only."""
    return np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= 1


PATTERNS = {
    "chain": _chain,
    "apart": lambda n: np.kron(np.eye(-(-n // 2)), np.ones((2, 2)))[:n, :n] > 0,
    "arrow": lambda n: np.eye(n, dtype=bool) | (np.arange(n) == 0)[:, None] | (np.arange(n) == 0),
    "down": lambda n: np.tri(n, dtype=bool),
    "at random": lambda n: np.random.default_rng(n).random((n, n)) < 0.3,
}


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("oscillator", (False, True))
@pytest.mark.parametrize("sigma", (2.3, 60.0))
def test_zeros_of_the_jacobian_against_dense_blocks(pattern, oscillator, sigma):
    """Blocks of zeros are left out: the same solutions, factors and sign, also with rows interchanged (sigma = 60)."""
    n = 12
    c = Case(n, 5, 4, oscillator, seed=8)
    c.sigma = sigma
    half = n // 2 if oscillator else 0
    known = PATTERNS[pattern](n - half)
    c.J[:, half:, half:] *= known
    c.J[:, half:, :half] *= known[:, :half]
    c.J[3, half:] = 0.0  # and a point of an interval where nothing is coupled
    X = c.rng.standard_normal((c.N, c.size, 2))
    blocks = [c.block(j) for j in range(c.N)]
    wanted, again = np.array([np.linalg.solve(G, x) for G, x in zip(blocks, X)]), X.copy()
    sign = c.condense(X)
    assert sign == np.prod([np.sign(np.linalg.det(G)) for G in blocks])
    limit = 1e-13 * max(np.linalg.cond(G) for G in blocks) * np.abs(wanted).max()
    assert np.abs(X - wanted).max() < limit
    ones = np.kron(c.rule.row_sums[:, None], np.eye(n))
    assert np.abs(c.Z - [np.linalg.solve(G, ones) for G in blocks]).max() < limit
    solve_stages(*c.factors(), again)
    assert np.abs(again - wanted).max() < limit
    y = c.rng.standard_normal((c.N, c.size))
    wanted = np.array([np.linalg.solve(G.T, row) for G, row in zip(blocks, y)])
    solve_stages_transposed(*c.factors(), y)
    assert np.abs(y - wanted).max() < limit * max(1.0, np.abs(wanted).max())
    moved = (c.pivots != np.arange(c.pivots.shape[1])).any()
    assert moved or sigma < 50 or pattern == "down"


@pytest.mark.parametrize("intervals", (1, 7, 8, 9, 63, 64, 65, 130))
def test_any_number_of_intervals_against_dense_blocks(intervals):
    """Intervals are eliminated in groups of multiples of eight; whoever fills up the last group counts for nothing."""
    c = Case(2, intervals, 2, True, seed=intervals)
    c.J[:, 1] *= 40.0  # signs of the determinants differ
    X = c.rng.standard_normal((c.N, c.size, 3))
    blocks = [c.block(j) for j in range(c.N)]
    wanted, sizes = np.array([np.linalg.solve(G, x) for G, x in zip(blocks, X)]), [np.linalg.cond(G) for G in blocks]
    sign = c.condense(X)
    assert sign == np.prod([np.sign(np.linalg.det(G)) for G in blocks])
    assert (np.abs(X - wanted).max((1, 2)) < 1e-13 * np.array(sizes) * np.abs(wanted).max((1, 2))).all()
    ones = np.kron(c.rule.row_sums[:, None], np.eye(2))
    Z = np.array([np.linalg.solve(G, ones) for G in blocks])
    assert (np.abs(c.Z - Z).max((1, 2)) < 1e-13 * np.array(sizes) * np.abs(Z).max((1, 2))).all()


@pytest.mark.parametrize("case", CASES[:5])
def test_local_solves_and_sweeps_against_dense_blocks(case):
    c = Case(*case)
    X = c.rng.standard_normal((c.N, c.size, 2))
    wanted = np.array([np.linalg.solve(c.block(j), X[j]) for j in range(c.N)])
    again = X.copy()
    c.condense(X)
    assert np.abs(X - wanted).max() < 1e-11
    solve_stages(*c.factors(), again)
    assert np.abs(again - wanted).max() < 1e-11
    y = c.rng.standard_normal((c.N, c.size))
    wanted = np.array([np.linalg.solve(c.block(j).T, y[j]) for j in range(c.N)])
    solve_stages_transposed(*c.factors(), y)
    assert np.abs(y - wanted).max() < 1e-11
    # forward and backward sweeps are adjoint: eta . du_N + rho . dY is the same number both ways
    C, eta, rho = (
        c.rng.standard_normal((c.N, c.size, 1)),
        c.rng.standard_normal(c.n),
        c.rng.standard_normal((c.N, c.size)),
    )
    du, dY, omega = np.empty((c.N + 1, c.n)), np.empty((c.N, c.size)), np.empty((c.N, c.size))
    forward_sweep(*c.factors(), c.rule.update, c.Z, 1, C.copy(), np.zeros(c.n), du, dY)
    adjoint_sweep(*c.factors(), c.rule.update, c.rule.row_sums, rho, eta, omega)
    assert abs(eta @ du[-1] + (rho * dY).sum() - (omega * C[:, :, 0]).sum()) < 1e-10 * np.abs(omega).max()
    # what was solved before is taken as it is
    again = np.empty_like(dY)
    forward_sweep(*c.factors(), c.rule.update, c.Z, 0, np.linalg.solve([c.block(j) for j in range(c.N)], C),
                  np.zeros(c.n), du, again)
    assert np.abs(again - dY).max() < 1e-11 * (1 + np.abs(dY).max())


def test_interval_matrix_is_the_matrix_exponential():
    """Constant J: M_j -> expm(h sigma J), error of order 2m."""
    from scipy.linalg import expm

    errors = []
    for N in (4, 8):
        c = Case(2, N, 3, True, seed=5)
        c.h[:] = 1 / N
        c.J[:] = [[0.0, 1.0], [-1.7, -0.2]]
        c.condense(np.empty((N, c.size, 0)))
        errors.append(np.abs(monodromy_product(c.M) - expm(c.sigma * c.J[0])).max())
    assert errors[0] < 1e-3
    assert 2**5.5 < errors[0] / errors[1] < 2**6.5  # global order 2m = 6


def test_a_singular_interval_is_reported_not_divided_by():
    c = Case(2, 3, 1, False)
    c.J[:] = np.eye(2) * 2 / (c.h[1] * c.sigma)  # G = 2 - h sigma J = 0 on interval 1 (m = 1: W = 2)
    assert c.condense(np.zeros((3, 2, 1))) == 0.0
    c.J[:] = np.nan
    assert c.condense(np.zeros((3, 2, 1))) == 0.0


@pytest.mark.parametrize("case", [(1, 3, 3, False, 0.0), (2, 5, 4, True, 0.0), (3, 7, 5, False, 0.0)])
def test_intervals_that_need_interchanges_beside_others_that_do_not(case):
    """Jacobians up to 1e4 times too large for their mesh, against LAPACK; the sign of all determinants; a singular one."""
    c = Case(*case, seed=1)
    c.J[:, c.kept] *= 10.0 ** np.repeat(np.linspace(0, 4, c.N), c.rule.degree)[:, None, None]
    blocks = np.array([c.block(j) for j in range(c.N)])
    X = c.rng.standard_normal((c.N, c.size, 2))
    wanted = np.linalg.solve(blocks, X)
    assert c.condense(X) == np.prod(np.linalg.slogdet(blocks)[0])
    moved = (c.pivots != np.arange(c.pivots.shape[1])).any(axis=1)
    assert moved.any() or c.n == 1
    assert np.abs(X - wanted).max() < 1e-9 * np.abs(wanted).max()
    again = np.ascontiguousarray(blocks @ wanted)
    solve_stages(*c.factors(), again)
    assert np.abs(again - wanted).max() < 1e-9 * np.abs(wanted).max()
    c.J[c.rule.degree :] = np.nan
    assert c.condense(X) == 0.0
