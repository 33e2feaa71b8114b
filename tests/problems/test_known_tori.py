"""Torus and doubling curves in closed form: Langford's system, two uncoupled rotors, and a flow whose period map is Henon's."""

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.words import Criticality, Kind

x, y, z, u, v, t = sp.symbols("x y z u v t", real=True)


def circle(radius, frequency, *rest):
    """t -> states (2 + len(rest), K): a circular orbit, the others at rest."""

    def states(time):
        angle = frequency * np.atleast_1d(time)
        still = [np.full(angle.shape, value) for value in rest]
        return np.array([radius * np.cos(angle), radius * np.sin(angle), *still])

    return states, 2 * np.pi / frequency


# ---------------------------------------------------------------------- Langford
ALPHA, BETA, DELTA, RHO = 0.95, 0.7, 3.5, 0.25


def langford():
    """x' = (z - beta) x - delta y, y' = delta x + (z - beta) y, z' = lam + alpha z - z^3/3 - (x^2 + y^2)(1 + rho z)."""
    lam, alpha, beta, delta, rho = sp.symbols("lam alpha beta delta rho", real=True)
    rhs = (
        (z - beta) * x - delta * y, delta * x + (z - beta) * y,
        lam + alpha * z - z**3 / 3 - (x**2 + y**2) * (1 + rho * z),
    )  # fmt: skip
    parameters = {"lam": 1.8, "alpha": ALPHA, "beta": BETA, "delta": DELTA, "rho": RHO}
    return st.System(name="langford", coordinates=("x", "y", "z"), states=("x", "y", "z"), parameters=parameters, rhs=rhs)


def langford_branch():
    radius = np.sqrt((1.8 + ALPHA * BETA - BETA**3 / 3) / (1 + RHO * BETA))
    problem = st.Collocation(langford())
    orbit = st.solve(problem, start=circle(radius, DELTA, BETA))
    return st.continuation(problem, "lam", (1.3, 2.0), start=orbit)


def test_torus_point_of_langford():
    """z = beta, r^2 (1 + rho beta) = lam + alpha beta - beta^3/3; a torus where alpha = beta^2 + rho r^2: lam = 1.6113333."""
    branch = langford_branch()
    exact = (ALPHA - BETA**2) / RHO * (1 + RHO * BETA) - ALPHA * BETA + BETA**3 / 3
    assert exact == pytest.approx(1.6113333, abs=5e-8)
    (point,) = branch.of_kind(Kind.NEIMARK_SACKER)
    assert point.params["lam"] == pytest.approx(exact, abs=1e-9)


def test_torus_curve_of_langford():
    """The same over lam and alpha, and the torus's frequency, omega^2 = 2 r^2 (1 + rho beta)."""
    (point,) = langford_branch().of_kind(Kind.NEIMARK_SACKER)
    curve = st.continuation(st.locus(point, free="alpha", window=(0.6, 1.3)), "lam", (0.1, 3.5))
    lam, alpha = curve.columns["lam"], curve.columns["alpha"]
    squared = (alpha - BETA**2) / RHO
    assert np.abs(lam - (squared * (1 + RHO * BETA) - alpha * BETA + BETA**3 / 3)).max() < 1e-8
    angle = np.sqrt(2 * squared * (1 + RHO * BETA)) * 2 * np.pi / DELTA
    assert np.cos(curve.columns["torus_angle"]) == pytest.approx(np.cos(angle), abs=1e-7)
    assert alpha.min() == 0.6 and alpha.max() == 1.3
    crossed = [(Kind.R3, 2 * np.pi / 3), (Kind.R4, np.pi / 2)]
    for kind, at in crossed:
        alphas = BETA**2 + RHO * (np.array([at, 2 * np.pi - at]) * DELTA / (2 * np.pi)) ** 2 / (2 * (1 + RHO * BETA))
        wanted = sorted(a for a in alphas if 0.6 < a < 1.3)
        assert sorted(p.params["alpha"] for p in curve.of_kind(kind)) == pytest.approx(wanted, abs=1e-7)


# ---------------------------------------------------------------------- two uncoupled rotors
def test_strong_resonances_of_two_uncoupled_rotors():
    """r = 1 turning at 1, and a focus of growth a and frequency w: a torus at a = 0, angle 2 pi w."""
    a, w = sp.symbols("a w", real=True)
    ring, focus = 1 - x**2 - y**2, a - u**2 - v**2
    system = st.System(
        name="rotors", coordinates=("x", "y", "u", "v"), states=("x", "y", "u", "v"), parameters={"a": -0.05, "w": 0.3},
        rhs=(ring * x - y, ring * y + x, focus * u - w * v, focus * v + w * u),
    )  # fmt: skip
    problem = st.Collocation(system)
    orbit = st.solve(problem, start=circle(1.0, 1.0, 0.0, 0.0))
    point = st.continuation(problem, "a", (-0.1, 0.1), start=orbit)["NS1"]
    curve = st.continuation(st.locus(point, free="a", along="w"), "w", (0.21, 0.58))
    assert np.abs(curve.columns["a"]).max() < 1e-9
    assert not curve.of_kind(Kind.EXTREMUM)  # a is zero all along
    for kind, at in ((Kind.R4, 1 / 4), (Kind.R3, 1 / 3), (Kind.R2, 1 / 2)):
        (resonance,) = curve.of_kind(kind)
        assert resonance.params["w"] == pytest.approx(at, abs=1e-6)


# ---------------------------------------------------------------------- Henon's map as a period map
def henon(a=0.5, b=0.5):
    """(x, y) -> (1 + y - a x^2, -b^2 x): for half a period y' = 2 (1 - a x^2)/T, for the other z' = 2 A z/T.

    exp A = [[0, 1], [-b^2, 0]]: A = log b + (pi/2) [[0, 1/b], [-b, 0]]. Henon's b is -b^2 here.
    """
    A, B = sp.symbols("a b", real=True)
    first = sp.Heaviside(sp.sin(t), 0)
    second = 1 - first
    kick, turn = (1 - A * x**2) / sp.pi, sp.log(B) / sp.pi
    rhs = (
        second * (turn * x + y / (2 * B)),
        first * kick + second * (turn * y - B * x / 2),
    )
    return st.System(
        name="henon", coordinates=("x", "y"), states=("x", "y"), parameters={"a": a, "b": b}, rhs=rhs,
        period_expression=2 * sp.pi, breaks=(sp.Integer(0), sp.Rational(1, 2)),
    )  # fmt: skip


@pytest.mark.parametrize("b", [0.3, 0.7])
def test_doublings_and_fold_of_henon(b):
    """Doublings at a = 3 (1 + b^2)^2/4 and, of the doubled orbit, (5 + 6 b^2 + 5 b^4)/4; the fold at -(1 + b^2)^2/4."""
    q = 1 + b**2
    problem = st.Collocation(henon(a=0.5, b=b))
    branch = st.continuation(problem, "a", (0.5, 2.2), start=dict(x=0.5, y=-(b**2) * 0.5))
    first = branch["PD1"]
    assert first.params["a"] == pytest.approx(3 * q**2 / 4, abs=1e-10)
    assert first.criticality is Criticality.SUPERCRITICAL
    double = st.continuation(st.switch(first), "a", (0.5, 2.6))
    assert double["PD1"].params["a"] == pytest.approx((5 + 6 * b**2 + 5 * b**4) / 4, abs=1e-9)
    down = st.continuation(problem, "a", (0.5, -1.2), start=dict(x=0.5, y=-(b**2) * 0.5))
    assert down["LP1"].params["a"] == pytest.approx(-(q**2) / 4, abs=1e-10)


def test_curves_of_henon():
    """The same over a and b."""
    problem = st.Collocation(henon(a=0.5, b=0.5))
    start = dict(x=0.5, y=-0.125)
    doubling = st.continuation(problem, "a", (0.5, 2.2), start=start)["PD1"]
    fold = st.continuation(problem, "a", (0.5, -1.2), start=start)["LP1"]
    for point, factor in ((doubling, 3 / 4), (fold, -1 / 4)):
        curve = st.continuation(st.locus(point, free="b", window=(0.2, 0.9)), "a", (-2.5, 3.0))
        a, b = curve.columns["a"], curve.columns["b"]
        assert np.abs(a - factor * (1 + b**2) ** 2).max() < 1e-9
        assert sorted((b[0], b[-1])) == [0.2, 0.9]
    table = doubling.sensitivity()
    assert table["b"] == pytest.approx(3 * (1 + 0.25) * 0.5, rel=1e-9)
