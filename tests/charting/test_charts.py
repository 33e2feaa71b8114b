"""Charts against independent values: 30-digit table, closed form (Meissner), DOP853, eigenproblems, published apex."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stability as st

DATA = Path(__file__).parents[1] / "data"
t = sp.Symbol("t", real=True)


@pytest.fixture(scope="module")
def table():
    """30-digit growth rates at 1200 random points of the 1000 x 1000 grid; made by data/make_mathieu_table.py."""
    return np.load(DATA / "mathieu_growth.npz")


@pytest.mark.parametrize("delta", [0.0, 0.05, 0.3])
def test_million_point_chart_against_the_thirty_digit_table(table, delta):
    a0, a1, b0, b1 = table["window"]
    chart = st.chart(st.models.mathieu(delta=delta), x=("a", a0, a1), y=("b", b0, b1), shape=(1000, 1000))
    here = table["delta"] == delta
    column, row, exact = table["column"][here], table["row"][here], table["growth"][here]
    assert here.sum() > 350
    assert np.array_equal(chart.x[column], table["a"][here]) and np.array_equal(chart.y[row], table["b"][here])
    error = np.abs(chart.growth_rate[row, column] - exact)
    assert error.max() <= 1e-10
    assert error.max() <= chart.error
    verdict, kind = np.asarray(chart.verdict)[row, column], np.asarray(chart.kind)[row, column]
    unstable = exact > 0
    assert np.all(verdict[unstable] == st.Verdict.UNSTABLE)
    assert np.all(verdict[~unstable] == (st.Verdict.STABLE if delta else st.Verdict.NEUTRAL))
    expected = np.where(table["trace"][here] > 0, "+1", "-1")
    assert np.all(kind[unstable] == expected[unstable]) and np.all(kind[~unstable] == "none")


def meissner_growth(a, b, delta=0.0):
    k = a - delta**2
    p, q = np.sqrt(complex(k + b)), np.sqrt(complex(k - b))
    tr = 2 * np.cos(p * np.pi) * np.cos(q * np.pi) - (p**2 + q**2) * np.pi**2 * np.sinc(p) * np.sinc(q)
    return np.arccosh(max(1.0, abs(tr.real) / 2)) / (2 * np.pi) - delta


@pytest.mark.parametrize("delta", [0.0, 0.1])
def test_meissner_against_the_closed_form(delta):
    chart = st.chart(st.models.meissner(delta=delta), x=("a", -0.5, 3), y=("b", 0, 3), shape=(83, 71))
    exact = np.array([[meissner_growth(a, b, delta) for a in chart.x] for b in chart.y])
    error = np.abs(chart.growth_rate - exact)
    assert error.max() <= max(1e-10, chart.error) and np.quantile(error, 0.99) < 1e-11


def dop853_growth(f, n, period):
    """log of the spectral radius of the monodromy matrix by DOP853, over the period."""
    y = solve_ivp(
        lambda s, y: (f(s) @ y.reshape(n, n)).ravel(), (0, period), np.eye(n).ravel(), method="DOP853",
        rtol=1e-13, atol=1e-14,
    ).y[:, -1].reshape(n, n)  # fmt: skip
    return np.log(np.abs(np.linalg.eigvals(y)).max()) / period, y


def test_three_term_hill_with_sines_against_dop853():
    system = st.models.hill(cos=(1.0, 0.5, 0.2), sin=(0.3, 0.7, -0.4), delta=0.03)
    chart = st.chart(system, x=("a", -0.5, 3), y=("b", 0, 2), shape=(61, 53))
    for j, i in np.random.default_rng(2).integers(0, 53, (25, 2)):
        a, b = chart.x[i], chart.y[j]

        def matrix(s, a=a, b=b):
            f = np.cos(s) + 0.5 * np.cos(2 * s) + 0.2 * np.cos(3 * s)
            f += 0.3 * np.sin(s) + 0.7 * np.sin(2 * s) - 0.4 * np.sin(3 * s)
            return np.array([[0, 1], [-(a + b * f), -0.06]])

        assert abs(dop853_growth(matrix, 2, 2 * np.pi)[0] - chart.growth_rate[j, i]) < 2e-11


def coupled(s, W, e, h21):
    return np.array([
        [0, 0, 1, 0], [0, 0, 0, 1],
        [-1 - e * np.cos(W * s), -e * np.cos(W * s), -0.02, 0],
        [-e * h21 * np.cos(W * s), -(1.7**2) - e * np.cos(W * s), 0, -0.04 if h21 < 0 else -0.02],
    ])  # fmt: skip


def test_combination_resonance_boundary_of_two_degrees_of_freedom_against_dop853():
    system = st.models.coupled_mathieu()
    chart = st.chart(system, x=("Omega", 2.4, 3.0), y=("epsilon", 0, 0.5), shape=(60, 60))
    curve = next(c for c in chart.boundaries if c.kind == "pair")
    for k in np.linspace(3, len(curve.x) - 4, 5).astype(int):
        W, e = curve.x[k], curve.y[k]

        def growth(scale, W=W, e=e):
            return dop853_growth(lambda s: coupled(s, W, e * scale, 1.0), 4, 2 * np.pi / W)[0]

        assert abs(growth(1.0)) < 1e-11
    # one root found by the second method alone, at the frequency of a grid column
    W = 2.6
    e = brentq(lambda e: dop853_growth(lambda s: coupled(s, W, e, 1.0), 4, 2 * np.pi / W)[0], 0.05, 0.45, xtol=1e-12)
    narrow = st.chart(system, x=("Omega", W, 2.7), y=("epsilon", 0.05, 0.45), shape=(20, 20))
    ends = [c.y[i] for c in narrow.boundaries for i in (0, -1) if abs(c.x[i] - W) < 1e-12]
    assert min(abs(v - e) for v in ends) < 1e-8


def nonreciprocal():
    x, y = (sp.Function(n)(t) for n in "xy")
    e, W = sp.symbols("e W", real=True)
    c = sp.cos(W * t)
    d = sp.Rational(1, 50)
    equations = {
        x.diff(t, 2): -d * x.diff(t) - x - e * c * (x + y),
        y.diff(t, 2): -2 * d * y.diff(t) - sp.Rational(289, 100) * y - e * c * (-x + y),
    }
    return st.System.from_equations(equations, [x, y], parameters=dict(e=0.3, W=2.0), period=2 * sp.pi / W)


def test_unequal_damping_uses_the_general_quartic_and_agrees_with_eigenvalues():
    chart = st.chart(nonreciprocal(), x=("W", 0.8, 4), y=("e", 0, 1), shape=(90, 90))
    assert chart.layers[0].form == "four"
    for j, i in np.random.default_rng(3).integers(0, 90, (20, 2)):
        W, e = chart.x[i], chart.y[j]
        exact, _ = dop853_growth(lambda s, W=W, e=e: coupled(s, W, e, -1.0), 4, 2 * np.pi / W)
        assert abs(exact - chart.growth_rate[j, i]) < max(1e-10, min(chart.error, 1e-7))


def test_ten_degrees_of_freedom_match_eigenvalues():
    n = 10
    q = [sp.Function(f"q{i}")(t) for i in range(n)]
    e, W = sp.symbols("e W", real=True)
    random = np.random.default_rng(4)
    K = np.diag(np.linspace(1, 3, n)) + 0.05 * random.normal(size=(n, n))
    H = 0.3 * random.normal(size=(n, n))
    C = 0.02 * np.eye(n) + 0.005 * random.normal(size=(n, n))
    equations = {
        q[i].diff(t, 2): -sum(
            C[i, j] * q[j].diff(t) + (K[i, j] + e * H[i, j] * sp.cos(W * t)) * q[j] for j in range(n)
        )
        for i in range(n)
    }  # fmt: skip
    system = st.System.from_equations(equations, q, parameters=dict(e=0.1, W=2.0), period=2 * sp.pi / W)
    chart = st.chart(system, x=("W", 1.8, 2.2), y=("e", 0, 0.6), shape=(12, 10), tolerance=1e-8)
    for j, i in ((0, 0), (9, 11), (5, 6), (8, 2)):
        W_, e_ = chart.x[i], chart.y[j]

        def matrix(s, W_=W_, e_=e_):
            top = np.hstack([np.zeros((n, n)), np.eye(n)])
            return np.vstack([top, np.hstack([-(K + e_ * H * np.cos(W_ * s)), -C])])

        exact, _ = dop853_growth(matrix, 2 * n, 2 * np.pi / W_)
        assert abs(exact - chart.growth_rate[j, i]) < 1e-8


def test_every_kind_of_axis_gives_the_same_growth_rate():
    model = st.models.mathieu(a=1.2, b=0.9, Omega=1.1, delta=0.07)
    point = dict(model.parameters)
    values = []
    for x, y in (("a", "b"), ("Omega", "delta"), ("b", "Omega"), ("delta", "a")):
        chart = st.chart(model, x=(x, 0.5 * point[x], 1.5 * point[x]), y=(y, 0.5 * point[y], 1.5 * point[y]), shape=5)
        values.append(chart.growth_rate[2, 2])
        assert abs(chart.at(**{x: point[x], y: point[y]}).growth_rate - values[-1]) < 1e-13
    assert np.ptp(values) < 2e-12


def test_ion_trap_apex_and_cut_off_to_ten_digits(table):
    """Apex (0.236994, 0.705996) and cut-off 0.908046 of the first region, from tridiagonal eigenvalues in mpmath."""
    import mpmath

    mpmath.mp.dps = 30

    def characteristic(q, which):
        size = 24
        matrix = mpmath.zeros(size)
        for k in range(size):
            matrix[k, k] = (2 * k) ** 2 if which == "a0" else (2 * k + 1) ** 2
            if k + 1 < size:
                matrix[k, k + 1] = matrix[k + 1, k] = q
        if which == "a0":
            matrix[0, 1] = matrix[1, 0] = mpmath.sqrt(2) * q
        else:
            matrix[0, 0] -= q
        return mpmath.eigsy(matrix, eigvals_only=True)[0]

    cut = mpmath.findroot(lambda q: characteristic(q, "b1"), (0.9, 0.91), tol=1e-25)
    apex = mpmath.findroot(lambda q: characteristic(q, "b1") + characteristic(q, "a0"), (0.7, 0.71), tol=1e-25)
    trap = st.models.paul_trap()
    chart = st.chart(trap, x=("a", 0.0, 0.3), y=("q", 0.5, 1.0), shape=40)
    ends = [c.y[i] for c in chart.boundaries for i in (0, -1) if abs(c.x[i]) < 1e-12]
    assert min(abs(v - float(cut)) for v in ends) < 1e-10
    a_apex, q_apex = float(characteristic(apex, "b1")), float(apex)
    assert abs(q_apex - 0.705996) < 1e-6 and abs(a_apex - 0.236994) < 1e-6
    h = 1e-4
    near = st.chart(trap, x=("a", a_apex - h, a_apex + h), y=("q", q_apex - h, q_apex + h), shape=40)
    lines = [np.polyfit(c.y - q_apex, c.x - a_apex, 3) for c in near.boundaries]
    first, second = (np.polynomial.Polynomial(c[::-1]) for c in lines[:2])
    q_cross = min((first - second).roots().real, key=abs)
    assert len(near.boundaries) == 2
    assert abs(q_cross) < 1e-10 and abs(first(q_cross)) < 1e-10


def test_semi_trivial_solution_of_the_autoparametric_pendulum():
    """th'' + 2 xi2 Omega0 th' + (Omega0^2 + U_abs''/ll) th = 0 with the absolute base motion (catalogue 9), DOP853."""
    p = dict(st.models.autoparametric_pendulum.from_acceleration().parameters)
    system = st.models.autoparametric_pendulum.from_acceleration()
    chart = st.chart(system, x=("Omega", 0.9, 0.97), y=("acceleration", 0, 0.01), about="linear", shape=(8, 7))
    for j, i in ((6, 0), (6, 4), (3, 7), (1, 5)):
        W, acc = chart.x[i], chart.y[j]
        U = W**2 / (1 - W**2 + 2j * p["xi1"] * W) + 1.0
        ll = W**2 / (acc * p["Omega0"] ** 2)

        def matrix(s, W=W, U=U, ll=ll):
            k = p["Omega0"] ** 2 + (-(W**2) * U * np.exp(1j * W * s)).real / ll
            return np.array([[0, 1], [-k, -2 * p["xi2"] * p["Omega0"]]])

        theta, _ = dop853_growth(matrix, 2, 2 * np.pi / W)
        assert abs(max(theta, -p["xi1"]) - chart.growth_rate[j, i]) < 1e-10
