"""Two-parameter curves: closed forms of equilibria and cycles, the exact Mathieu problem, and separate one-parameter runs."""

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

import stability as st
from stability.errors import InputError, UnknownNameError
from stability.words import Kind, Status, Verdict

t, r, s, h = sp.symbols("t r s h", real=True)
mu, ell, x, y = sp.symbols("mu ell x y", real=True)


def scalar(f, **parameters):
    return st.System(name="scalar", coordinates=("x",), states=("x",), parameters=parameters, rhs=(f,))


def bautin(**parameters):
    """z' = (mu + i) z + ell |z|^2 z - |z|^4 z: cycles r^2 = (ell +- sqrt(ell^2 + 4 mu))/2, their fold at mu = -ell^2/4."""
    rho = x**2 + y**2
    growth = mu + ell * rho - rho**2
    return st.System(
        name="bautin", coordinates=("x", "y"), states=("x", "y"), parameters={"mu": -0.3, "ell": 1.0, **parameters},
        rhs=(growth * x - y, growth * y + x),
    )  # fmt: skip


# ---------------------------------------------------------------------- equilibria
def test_folds_of_the_cusp_normal_form_pass_through_the_cusp():
    """x' = r + s x - x^3: 27 r^2 = 4 s^3, smooth in (x, r, s) through the cusp at the origin."""
    problem = st.Equilibrium(scalar(r + s * x - x**3, r=0.0, s=1.0))
    branch = st.continuation(problem, "r", (-1.0, 1.0))
    curve = st.continuation(st.locus(branch["LP1"], free="s"), "r", (-1.0, 1.0))
    R, S, X = (curve.columns[k] for k in "rsx")
    assert np.abs(R + 2 * X**3).max() < 1e-11 and np.abs(S - 3 * X**2).max() < 1e-11
    assert X.min() < -0.7 and X.max() > 0.7 and curve.statuses == (Status.PARAMETER_BOUND,) * 2
    assert curve.residuals.max() < 1e-11 and set(curve.verdicts) == {Verdict.STABLE}


def test_the_curve_can_follow_either_parameter():
    problem = st.Equilibrium(scalar(r + s * x - x**3, r=0.0, s=1.0))
    branch = st.continuation(problem, "r", (-1.0, 1.0))
    curve = st.continuation(st.locus(branch["LP1"], free="r", along="s"), "s", (0.2, 2.0))
    R, S = curve.columns["r"], curve.columns["s"]
    assert S.min() == 0.2 and S.max() == 2.0
    assert np.abs(27 * R**2 - 4 * S**3).max() < 1e-10


def test_hopf_curve_of_the_lorenz_system():
    """rho = sigma (sigma + beta + 3)/(sigma - beta - 1), omega^2 = 2 beta sigma (sigma + 1)/(sigma - beta - 1)."""
    branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14))
    curve = st.continuation(st.locus(branch["HB1"], free="sigma"), "rho", (20, 30))
    sigma, rho, b = curve.columns["sigma"], curve.columns["rho"], 8 / 3
    assert np.abs(rho - sigma * (sigma + b + 3) / (sigma - b - 1)).max() < 1e-11
    omega = np.sqrt(2 * b * sigma * (sigma + 1) / (sigma - b - 1))
    assert curve.columns["hopf_frequency"] == pytest.approx(omega, rel=1e-11)
    assert sigma.min() < 10 < sigma.max() and len(curve) < 60


def test_branch_points_persist_where_a_symmetry_makes_them():
    """x' = (r - s^2) x - x^3: pitchforks at r = s^2; x' = r x - x^3 + h unfolds them."""
    branch = st.continuation(st.Equilibrium(scalar((r - s**2) * x - x**3, r=0.0, s=0.5)), "r", (-1.0, 1.0))
    curve = st.continuation(st.locus(branch["BP1"], free="s"), "r", (-1.0, 1.0))
    assert np.abs(curve.columns["r"] - curve.columns["s"] ** 2).max() < 1e-11
    assert curve.columns["s"].min() == pytest.approx(-1) and curve.columns["s"].max() == pytest.approx(1)
    broken = st.continuation(st.Equilibrium(scalar(r * x - x**3 + h, r=0.0, h=0.0)), "r", (-1.0, 1.0))
    with pytest.raises(InputError, match="breaks up"):
        st.locus(broken["BP1"], free="h")


def test_a_closed_curve_is_followed_once():
    """(x - 3 - r/3)^2 + r^2 + s^2 = 1: folds on the unit circle, which turns in r at +-1; no cusps there."""
    system = scalar(-((x - 3 - r / 3) ** 2 + r**2 + s**2 - 1), r=0.0, s=0.2)
    problem = st.Equilibrium(system)
    branch = st.continuation(problem, "r", (-2, 2), start=st.solve(problem, start=dict(x=4.0)))
    curve = st.continuation(st.locus(branch["LP1"], free="s"), "r", (-2, 2))
    assert curve.statuses == (Status.CLOSED_LOOP,) * 2 and len(curve) < 100
    assert np.abs(curve.columns["r"] ** 2 + curve.columns["s"] ** 2 - 1).max() < 1e-12
    assert sorted(p.params["r"] for p in curve.of_kind(Kind.FOLD)) == pytest.approx([-1.0, 1.0], abs=1e-12)
    assert not curve.of_kind(Kind.CUSP)


# ---------------------------------------------------------------------- orbits
def test_folds_of_cycles_of_the_bautin_normal_form():
    """mu = -ell^2/4, r^2 = ell/2."""
    hopf = st.continuation(st.Equilibrium(bautin()), "mu", (-0.3, 0.3))["HB1"]
    cycles = st.continuation(st.switch(hopf), "mu", (-0.5, 0.5))
    curve = st.continuation(st.locus(cycles["LP1"], free="ell"), "mu", (-0.5, -0.05))
    ell = curve.columns["ell"]
    assert np.abs(curve.columns["mu"] + ell**2 / 4).max() < 1e-9
    assert curve.columns["x.max"] == pytest.approx(np.sqrt(ell / 2), abs=1e-8)
    assert curve.columns["mu"].min() == -0.5 and curve.columns["mu"].max() == -0.05
    assert curve.error.max() < 1e-8


def surplus_growth(Omega, length_ratio, xi1=0.02, xi2=0.01, Omega0=0.5):
    """Floquet exponent of the damped Mathieu problem about the semi-trivial motion, by tridiagonal recursions."""
    depth = Omega**2 * abs(Omega**2 / (1 - Omega**2 + 2j * xi1 * Omega) + 1) / length_ratio
    delta = xi2 * Omega0
    a, q = 4 * (Omega0**2 - delta**2) / Omega**2, 2 * depth / Omega**2
    return st.mathieu_exponent(a, q).imag * Omega / 2 - delta


def test_tongue_of_the_autoparametric_pendulum_is_that_of_the_exact_mathieu_problem(tmp_path):
    system = st.models.autoparametric_pendulum(xi1=0.02, xi2=0.01, Omega0=0.5, length_ratio=10.0, mass_ratio_total=0.2)
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
    tongue = st.continuation(st.locus(semi["PD1"], free="length_ratio"), "Omega", (0.5, 1.6))
    assert tongue.statuses == (Status.PARAMETER_BOUND,) * 2
    Omega, ratio = tongue.columns["Omega"], tongue.columns["length_ratio"]
    assert Omega.min() < 0.65 and Omega.max() == 1.6 and ratio.max() > 1000 and ratio.min() < 1
    ordinary = np.array([m < 0 or tongue.special[m].kind is not Kind.FOLD for m in tongue.marks])
    assert max(abs(surplus_growth(a, b)) for a, b in zip(Omega[~ordinary], ratio[~ordinary])) < 1e-10  # vertical there
    for a, b in zip(Omega[ordinary], ratio[ordinary]):
        exact = brentq(lambda v, a=a: surplus_growth(a, v), b * (1 - 1e-5), b * (1 + 1e-5), xtol=1e-14, rtol=1e-14)
        assert abs(b / exact - 1) < 1e-9
    other = semi["PD2"].params["Omega"]  # the same tongue's other side, found without the curve
    crossings = [o.params["length_ratio"] for o in tongue.at(Omega=other)]
    assert min(abs(v - 10.0) for v in crossings) < 1e-7
    tongue.save(tmp_path / "tongue.npz")
    again = st.load(tmp_path / "tongue.npz")
    assert np.array_equal(again.columns["length_ratio"], ratio)
    assert again.at(Omega=0.9)[0].params["length_ratio"] == pytest.approx(tongue.at(Omega=0.9)[0].params["length_ratio"])
    line = tongue.plot(y="length_ratio")[0]
    assert np.array_equal(line.get_ydata(), tongue.plot()[0].get_ydata())  # the second parameter is the default


@pytest.mark.parametrize("method", [st.Collocation, st.HarmonicBalance], ids=lambda m: m.__name__)
def test_folds_of_duffing_against_separate_branches(method):
    def problem(beta):
        options = {"harmonics": 9} if method is st.HarmonicBalance else {}
        return method(st.models.duffing(xi=0.02, beta=beta), **options)

    first = st.continuation(problem(5e-4), "Omega", (0.3, 2.0))
    curve = st.continuation(st.locus(first["LP1"], free="beta"), "Omega", (0.3, 2.0))
    for beta in (4e-4, 1e-3):
        for point in st.continuation(problem(beta), "Omega", (0.3, 2.0)).of_kind(Kind.FOLD):
            values = [o.params["beta"] for o in curve.at(Omega=point.params["Omega"])]
            assert min(abs(v / beta - 1) for v in values) < 1e-8
    (cusp,) = curve.of_kind(Kind.CUSP)
    beside = [len(st.continuation(problem(cusp.params["beta"] * f), "Omega", (0.9, 1.2)).special) for f in (0.98, 1.02)]
    assert beside == [0, 2]


def test_torus_points_of_the_pendulum_against_separate_branches():
    def points(mass_ratio):
        system = st.models.autoparametric_pendulum(mass_ratio_total=mass_ratio)
        semi = st.continuation(st.Collocation(system), "Omega", (0.94, 1.02))
        return st.continuation(st.switch(semi["PD1"]), "Omega", (0.9, 1.1)).of_kind(Kind.NEIMARK_SACKER)

    limit = {"edge": lambda orbit: orbit.params["mass_ratio_total"] - 0.35}
    first, second = points(0.2)
    curve = st.continuation(
        st.locus(first, free="mass_ratio_total"), "Omega", (0.9, 1.1), events=limit, stop_at="edge"
    )
    found = points(0.1)
    for point in (*found, second):
        values = curve.at(Omega=point.params["Omega"])
        closest = min(values, key=lambda o: abs(o.params["mass_ratio_total"] - point.params["mass_ratio_total"]))
        assert closest.params["mass_ratio_total"] == pytest.approx(point.params["mass_ratio_total"], rel=1e-6)
        pair = min(closest.multipliers, key=lambda m: abs(abs(m) - 1))
        assert abs(abs(pair) - 1) < 1e-8
    assert curve.columns["torus_angle"].min() > 0.1


# ---------------------------------------------------------------------- what a user can get wrong
def test_requests_that_make_no_sense():
    branch = st.continuation(st.Equilibrium(scalar(r + s * x - x**3, r=0.0, s=1.0)), "r", (-1, 1), at=(0.5,))
    with pytest.raises(InputError, match="parameter of the branch itself"):
        st.locus(branch["LP1"], free="r")
    with pytest.raises(UnknownNameError, match="did you mean 's'"):
        st.locus(branch["LP1"], free="S")
    with pytest.raises(InputError, match="curves exist for"):
        st.locus(branch["UZ1"], free="s")
    with pytest.raises(InputError, match="special point"):
        st.locus(branch, free="s")
    with pytest.raises(InputError, match="along 'r'"):
        st.continuation(st.locus(branch["LP1"], free="s"), "s", (0, 1))


def test_symmetry_breaking_of_duffing_against_a_separate_branch():
    """Pitchforks of orbits persist: x(t + T/2) = -x(t) is a symmetry at every amplitude of the force."""

    def last(force):
        system = st.models.duffing_textbook(delta=0.2, alpha=1.0, beta=1.0, gamma=force, omega=2.0)
        branch = st.continuation(st.Collocation(system), "omega", (1.8, 3.0))
        return max(branch.of_kind(Kind.BRANCH_POINT), key=lambda p: p.params["omega"])

    curve = st.continuation(st.locus(last(25.0), free="gamma"), "omega", (2.0, 2.5))
    other = last(26.0).params["omega"]
    values = [o.params["gamma"] for o in curve.at(omega=other)]
    assert min(abs(v / 26.0 - 1) for v in values) < 1e-7
