"""Sensitivities of special points against closed forms and against differences of separately continued branches."""

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import InputError, UnknownNameError
from stability.words import Kind

STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))


def difference(place, value, step):
    """Fourth-order central difference of place(parameter)."""
    return sum(c * place(value + k * step) for k, c in STENCIL) / step


def test_hopf_point_of_the_lorenz_system():
    """rho = sigma (sigma + b + 3)/(sigma - b - 1), omega^2 = b (sigma + rho)."""
    branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14))
    table = branch["HB1"].sensitivity()
    s, b = sp.symbols("s b")
    rho = s * (s + b + 3) / (s - b - 1)
    omega = sp.sqrt(b * (s + rho))
    at = {s: 10, b: sp.Rational(8, 3)}
    for name, symbol in (("sigma", s), ("beta", b)):
        assert table[name] == pytest.approx(float(rho.diff(symbol).subs(at)), rel=1e-9)
        assert table.angle[name] == pytest.approx(float(omega.diff(symbol).subs(at)), rel=1e-9)
    assert list(table.relative) == ["beta", "sigma"] and "% per %" in repr(table)
    turned = branch["HB1"].sensitivity(of="sigma")
    assert turned["rho"] == pytest.approx(1 / table["sigma"], rel=1e-9)
    assert turned["beta"] == pytest.approx(-table["beta"] / table["sigma"], rel=1e-9)


def test_fold_of_cycles_in_closed_form():
    """z' = (mu + i) z + ell |z|^2 z - |z|^4 z: mu = -ell^2/4."""
    mu, ell, x, y = sp.symbols("mu ell x y", real=True)
    rho = x**2 + y**2
    growth = mu + ell * rho - rho**2
    system = st.System(
        name="bautin", coordinates=("x", "y"), states=("x", "y"), parameters={"mu": -0.3, "ell": 1.3},
        rhs=(growth * x - y, growth * y + x),
    )  # fmt: skip
    hopf = st.continuation(st.Equilibrium(system), "mu", (-0.3, 0.3))["HB1"]
    cycles = st.continuation(st.switch(hopf), "mu", (-0.5, 0.5))
    assert cycles["LP1"].sensitivity()["ell"] == pytest.approx(-1.3 / 2, rel=1e-8)


def test_fold_of_duffing_against_differences():
    def fold(**params):
        system = st.models.duffing(**{"xi": 0.02, "beta": 8e-4, **params})
        return st.continuation(st.Collocation(system), "Omega", (0.9, 1.4))["LP1"]

    table = fold().sensitivity()
    for name, value in (("xi", 0.02), ("beta", 8e-4)):
        wanted = difference(lambda v, name=name: fold(**{name: v}).params["Omega"], value, 2e-3 * value)
        assert table[name] == pytest.approx(wanted, rel=1e-6)


def test_doubling_and_torus_point_of_the_pendulum_against_differences():
    def points(**params):
        system = st.models.autoparametric_pendulum(**params)
        doubling = st.continuation(st.Collocation(system), "Omega", (0.9, 1.0))["PD1"]
        swing = st.continuation(st.switch(doubling), "Omega", (0.9, 1.05), stop_at="NS1")
        return doubling, swing["NS1"]

    doubling, torus = points()
    tables = doubling.sensitivity(), torus.sensitivity()
    for name, value in (("xi2", 0.005), ("length_ratio", 1000.0)):
        step = 2e-3 * value
        runs = {k: [p.params["Omega"] for p in points(**{name: value + k * step})] for k, _ in STENCIL}
        for i, table in enumerate(tables):
            wanted = sum(c * runs[k][i] for k, c in STENCIL) / step
            assert table[name] == pytest.approx(wanted, rel=1e-6)
    # the semi-trivial motion does not know the pendulum's mass
    assert abs(tables[0]["mass_ratio_total"]) < 1e-12
    assert set(tables[1].angle) == set(tables[1].derivatives)


def test_tip_of_a_tongue_by_the_envelope_theorem():
    """The smallest modulation depth that destabilises Mathieu's equation, against differences of the curve's minimum."""
    t = sp.symbols("t", real=True)
    a, b, delta, Omega = sp.symbols("a b delta Omega", real=True)
    u = sp.Function("u")(t)
    system = st.System.from_equations(
        {u.diff(t, 2): -2 * delta * u.diff(t) - (a + b * sp.cos(Omega * t)) * u - u**3}, coordinates=[u],
        parameters={"a": 0.25, "b": 0.3, "delta": 0.05, "Omega": 1.0}, period=2 * sp.pi / Omega,
    )  # fmt: skip

    def tip(delta):
        """(place, depth) of the minimum, by a polynomial through seven solved points."""
        doubling = st.continuation(st.Collocation(system.with_params(delta=delta)), "a", (-0.1, 0.4))["PD1"]
        curve = st.continuation(st.locus(doubling, free="b"), "a", (-0.1, 0.6))
        near = curve.columns["a"][np.argmin(curve.columns["b"])] + 4e-3 * np.arange(-3, 4)
        fit = np.polynomial.Polynomial.fit(near, [curve.at(a=x)[0].params["b"] for x in near], 6)
        place = min(fit.deriv().roots().real, key=lambda x: abs(x - near[3]))
        return curve, float(place), float(fit(place))

    _, place, _ = tip(0.05)
    doubling = st.continuation(st.Collocation(system), "a", (-0.1, 0.4))["PD1"]
    curve = st.continuation(st.locus(doubling, free="b"), "a", (-0.1, 0.6), at=(place,))
    point = min(curve.of_kind(Kind.USER), key=lambda p: abs(p.params["a"] - place))
    table = point.sensitivity(of="b")
    assert table["delta"] == pytest.approx(difference(lambda v: tip(v)[2], 0.05, 1e-3), rel=1e-6)
    assert abs(table["a"]) < 1e-6


def test_parameters_that_break_a_branch_point_are_told_apart():
    """x' = (r - s^2) x - x^3 + h: the pitchfork at r = s^2 moves with s and is broken up by h."""
    r, s, h, x = sp.symbols("r s h x", real=True)
    system = st.System(
        name="fork", coordinates=("x",), states=("x",), parameters={"r": 0.0, "s": 0.5, "h": 0.0},
        rhs=((r - s**2) * x - x**3 + h,),
    )  # fmt: skip
    branch = st.continuation(st.Equilibrium(system), "r", (-1.0, 1.0))
    table = branch["BP1"].sensitivity()
    assert table["s"] == pytest.approx(1.0, rel=1e-10)
    assert table.breaking == ("h",) and set(table.derivatives) == {"s"}
    assert "broken up by: h" in repr(table)


def test_requests_that_make_no_sense():
    branch = st.continuation(
        st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14), at=(20.0,)
    )
    with pytest.raises(InputError, match="no defining system"):
        branch["UZ1"].sensitivity()
    with pytest.raises(UnknownNameError, match="sigma"):
        branch["HB1"].sensitivity(of="sigm")
    with pytest.raises(UnknownNameError, match="this table"):
        branch["HB1"].sensitivity()["rho"]


# ---------------------------------------------------------------------- tips of tongues
def test_tip_of_a_tongue_against_differences():
    """The largest length ratio that still makes the pendulum swing: by the envelope theorem, against tips of other curves."""

    def tip(**params):
        values = {"xi1": 0.02, "xi2": 0.01, "Omega0": 0.5, "length_ratio": 100.0, **params}
        semi = st.continuation(st.Collocation(st.models.autoparametric_pendulum(**values)), "Omega", (0.8, 1.2))
        window = (0.5 * values["length_ratio"], 1e5)
        curve = st.continuation(st.locus(semi["PD1"], free="length_ratio", window=window), "Omega", (0.8, 1.2))
        return max(curve.of_kind(Kind.EXTREMUM), key=lambda p: p.params["length_ratio"])

    table = tip().sensitivity(of="length_ratio")
    for name, value in (("xi2", 0.01), ("xi1", 0.02)):
        wanted = difference(lambda v, name=name: tip(**{name: v}).params["length_ratio"], value, 2e-3 * value)
        assert table[name] == pytest.approx(wanted, rel=1e-6)
    assert abs(table["Omega"]) < 1e-6 * table.value


# ---------------------------------------------------------------------- solutions
@pytest.mark.parametrize("method", [st.Collocation, st.HarmonicBalance, st.Shooting], ids=lambda m: m.__name__)
@pytest.mark.parametrize("of", ["u.max", "u_dot.min", "u.amplitude(1)"])
def test_orbit_of_a_linear_oscillator_in_closed_form(method, of):
    """u'' + 2 xi u' + u = W^2 cos(W t): u = Re A exp(i W t), A = W^2/(1 - W^2 + 2 i xi W)."""
    xi, W = sp.symbols("xi W", positive=True)
    A = W**2 / (1 - W**2 + 2 * sp.I * xi * W)
    forms = {
        "u.max": sp.sqrt(A * sp.conjugate(A)), "u_dot.min": -W * sp.sqrt(A * sp.conjugate(A)),
        "u.amplitude(1)": sp.sqrt(A * sp.conjugate(A)),
    }  # fmt: skip
    options = {"harmonics": 3} if method is st.HarmonicBalance else {}
    table = st.sensitivity(method(st.models.duffing(xi=0.1, beta=0.0), **options), of, Omega=1.3)
    for name, symbol in (("xi", xi), ("Omega", W)):
        exact = complex(sp.diff(forms[of], symbol).subs({xi: 0.1, W: 1.3}).evalf()).real
        assert table[name] == pytest.approx(exact, rel=1e-7)


@pytest.mark.parametrize("of", ["theta.max", "theta.amplitude(1/2)", "u_dot.max"])
def test_swinging_pendulum_against_differences(of):
    """An orbit of two forcing periods: rates of its amplitudes against differences of orbits solved separately."""
    values = {"Omega": 0.97, "length_ratio": 1000.0, "Omega0": 0.48, "xi1": 0.002, "xi2": 0.005, "mass_ratio_total": 0.2}
    semi = st.continuation(st.Collocation(st.models.autoparametric_pendulum()), "Omega", (0.94, 1.0))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.85, 1.1))
    orbit = max(swing.at(Omega=0.97), key=lambda o: o.max["theta"])
    problem = st.Collocation(st.models.autoparametric_pendulum(), multiple=2)
    table = st.sensitivity(problem, of, start=orbit)
    assert table.value == pytest.approx(orbit.max["theta"] if of == "theta.max" else table.value, rel=1e-8)

    def measured(**params):
        vector = problem.system.parameter_vector(**{**values, **params})
        u = problem.start(vector, orbit)
        found = problem.correct(u, vector, "Omega", None, 0.0, 1e-12)
        return problem.measures(found.u, found.params)[of]

    for name in ("xi2", "mass_ratio_total", "length_ratio", "Omega"):
        step = 1e-4 * values[name] if name != "Omega" else 1e-5
        wanted = difference(lambda v, name=name: measured(**{name: v}), values[name], step)
        assert table[name] == pytest.approx(wanted, rel=1e-6)


def test_equilibrium_and_period_in_closed_form():
    """Lorenz: x^2 = b (rho - 1); the cycle of the quintic normal form: period 2 pi / w."""
    table = st.sensitivity(st.Equilibrium(st.models.lorenz()), "x", start=dict(x=6, y=6, z=14), rho=15.0)
    assert table["rho"] == pytest.approx(np.sqrt(8 / 3 / 14) / 2, rel=1e-9) and abs(table["sigma"]) < 1e-9
    x, y, mu, w = sp.symbols("x y mu w", real=True)
    growth = mu - x**2 - y**2
    system = st.System(
        name="cycle", coordinates=("x", "y"), states=("x", "y"), parameters={"mu": 0.25, "w": 1.5},
        rhs=(growth * x - w * y, growth * y + w * x),
    )  # fmt: skip
    start = (lambda s: 0.5 * np.array([np.cos(1.5 * s), np.sin(1.5 * s)]), 2 * np.pi / 1.5)
    assert st.sensitivity(st.Collocation(system), "period", start=start)["w"] == pytest.approx(-2 * np.pi / 1.5**2, rel=1e-9)
    assert st.sensitivity(st.Collocation(system), "x.max", start=start)["mu"] == pytest.approx(1.0, rel=1e-7)


def test_sensitivity_refuses_what_makes_no_sense():
    problem = st.Collocation(st.models.duffing(xi=0.1))
    with pytest.raises(InputError, match="say of what"):
        st.sensitivity(problem)
    with pytest.raises(UnknownNameError, match="did you mean"):
        st.sensitivity(problem, "u.maxx")
    with pytest.raises(UnknownNameError, match="xi"):
        st.sensitivity(problem, "u.max", xii=0.2)
    with pytest.raises(InputError, match="no reliable rate"):
        st.sensitivity(problem, "u_absolute.max")
