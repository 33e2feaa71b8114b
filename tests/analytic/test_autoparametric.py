"""Autoparametric 2:1 resonance: rows 5a-5d of the verified closed forms, and the pendulum in its own scaling.

Witnesses: Floquet multipliers of the exact y-equation by DOP853, periodic orbits by shooting, the numeric Jacobian of the
averaged flow, Neimark-Sacker points of the full systems by collocation, switching and continuation.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from exact_orbits import SMALL, amplitudes, assert_order, floquet_matrix, observed_orders, periodic_orbit
from scipy.optimize import brentq

import stability as st
from stability.errors import InputError, UnknownNameError
from stability.systems.evaluators import evaluator


def scaled(e, *, detuned, force=0.6):
    """The scaling of row 5d: xi = 0.1 eps, g1 = eps, g2 = 1.2 eps, f = 0.6 eps; q = (1 + 0.6 eps)/2, eta = 1 + 0.2 eps."""
    values = dict(xi1=0.1 * e, xi2=0.1 * e, g1=e, g2=1.2 * e, f=force * e)
    if detuned:
        return dict(**values, q=(1 + 0.6 * e) / 2, eta=1 + 0.3 * e)
    return dict(**values, q=0.5, eta=1.0)


def picked(values, *names):
    return {k: values[k] for k in names}


# ------------------------------------------------------------------ 5a
@pytest.mark.parametrize(("detuned", "order"), [(False, 2.00), (True, 0.98)])
def test_threshold_of_the_semitrivial_solution(detuned, order):
    """Row 5a: f_c against the Floquet multiplier -1 of y'' + 2 xi2 y' + (q^2 + g2 R0 cos eta t) y = 0."""
    errors = []
    for e in SMALL:
        v = scaled(e, detuned=detuned)
        f_c = float(st.autoparametric_threshold(v["eta"], **picked(v, "xi1", "xi2", "q", "g2")))
        D1 = abs(1 - v["eta"] ** 2 + 2j * v["xi1"] * v["eta"])

        def edge(f, v=v, D1=D1):
            M = floquet_matrix(
                lambda s: v["q"] ** 2 + v["g2"] * f / D1 * math.cos(v["eta"] * s), v["xi2"], 2 * math.pi / v["eta"]
            )
            return 1 + np.trace(M) + np.linalg.det(M)

        exact = brentq(edge, 0.8 * f_c, 1.2 * f_c, xtol=1e-12 * f_c)
        errors.append(abs(f_c / exact - 1))
    assert_order(errors, order, slack=0.08)


def test_interval_of_instability():
    """Its ends are where f_c(eta) = f; between them the trivial y grows in the averaged flow, outside it decays."""
    v = dict(xi1=0.002, xi2=0.002, q=0.47, g2=0.12)
    assert len(st.autoparametric_interval(**v, f=0.004)) == 2  # below the saddle of f_c: one at each resonance
    for f in (0.004, 0.02):
        for low, high in st.autoparametric_interval(**v, f=f):
            for edge in (low, high):
                assert float(st.autoparametric_threshold(edge, **v)) == pytest.approx(f, rel=1e-9)
            assert float(st.autoparametric_threshold((low + high) / 2, **v)) < f
    assert st.autoparametric_interval(**v, f=1e-5) == ()
    # the branch points of the averaged flow are the same numbers
    slow = st.averaging(st.models.autoparametric_quadratic(**v, f=0.02, g1=0.1), resonance=(2, 1))
    semi = st.continuation(st.Equilibrium(slow), "eta", (0.8, 1.2))
    found = [p.params["eta"] for p in semi.special if p.kind is st.Kind.BRANCH_POINT]
    ((low, high),) = st.autoparametric_interval(**v, f=0.02)
    assert found == pytest.approx([low, high], abs=1e-8)


# ------------------------------------------------------------------ 5b
def equilibrium(v):
    """(slow flow, cartesian slow state) of the upper nontrivial solution, from the closed form with its phases."""
    slow = st.averaging(st.models.autoparametric_quadratic(**v), resonance=(2, 1))
    _, r = st.autoparametric_amplitudes(v["eta"], **{k: v[k] for k in ("xi1", "xi2", "q", "g1", "g2", "f")})
    w, r = v["eta"], float(r[0])
    D1, D2 = 1 - w**2 + 2j * v["xi1"] * w, v["q"] ** 2 - w**2 / 4 + 1j * v["xi2"] * w
    turned = v["f"] / (v["g1"] * r**2 / 2 - 2 / v["g2"] * D1 * D2)
    # y = r cos(eta t/2 + phi): e^{2 i phi} = f/(g1 r^2/2 - P) up to sign conventions of the forcing; X = -(2/g2) D2 e^{2 i phi}
    for sign in (1, -1):
        phi = 0.5 * np.angle(sign * turned)
        X = -2 / v["g2"] * D2 * np.exp(2j * phi)
        state = np.array([X.real, -X.imag, r * math.cos(phi), -r * math.sin(phi)])
        if np.abs(slow(0.0, state)).max() < 1e-10:
            return slow, state
    raise AssertionError("the closed form does not rest in the averaged flow")


def full_field(v):
    def field(t, z):
        x, y, xd, yd = z
        return [
            xd, yd, -2 * v["xi1"] * xd - x - v["g1"] * y * y + v["f"] * math.cos(v["eta"] * t),
            -2 * v["xi2"] * yd - v["q"] ** 2 * y - v["g2"] * x * y,
        ]  # fmt: skip

    return field


@pytest.mark.parametrize(("detuned", "order_R", "order_r"), [(False, 2.0, 2.0), (True, 1.0, 1.0)])
def test_nontrivial_amplitudes(detuned, order_R, order_r):
    """Row 5b: R and r against the full orbit (shooting from the reconstruction); R does not depend on f (saturation)."""
    small = SMALL if not detuned else (0.1, 0.05, 0.025, 0.0125)
    errors_R, errors_r = [], []
    for e in small:
        v = scaled(e, detuned=detuned)
        R, r = st.autoparametric_amplitudes(v["eta"], **{k: v[k] for k in ("xi1", "xi2", "q", "g1", "g2", "f")})
        slow, state = equilibrium(v)
        start = st.reconstruct(slow, state, 0.0)
        period = 4 * math.pi / v["eta"]
        _, rows = periodic_orbit(full_field(v), period, start)
        harmonics = 2 * np.abs(np.fft.rfft(rows, axis=1)) / rows.shape[1]
        errors_R.append(abs(float(R) / harmonics[0, 2] - 1))
        errors_r.append(abs(float(r[0]) / harmonics[1, 1] - 1))
        assert float(
            st.autoparametric_amplitudes(v["eta"], **{**picked(v, "xi1", "xi2", "q", "g1", "g2"), "f": 2 * v["f"]})[0]
        ) == float(R)
    assert_order(errors_R, order_R, slack=0.12, small=small)
    assert_order(errors_r, order_r, slack=0.25 if detuned else 0.12, small=small)


@pytest.mark.parametrize("method", [st.averaging, st.multiple_scales])
@pytest.mark.parametrize("detuned", [False, True])
def test_second_order_of_the_averaged_flow(detuned, method):
    """One order better than row 5b: the mean of x and the 3/2 harmonic of y are there."""
    small = (0.1, 0.05, 0.025)
    errors = []
    for e in small:
        v = scaled(e, detuned=detuned)
        _, state = equilibrium(v)
        slow = method(st.models.autoparametric_quadratic(**v), resonance=(2, 1), order=2)
        point = st.solve(st.Equilibrium(slow), start=state)
        period = 4 * math.pi / v["eta"]
        _, rows = periodic_orbit(full_field(v), period, st.reconstruct(slow, point, 0.0))
        harmonics = 2 * np.abs(np.fft.rfft(rows, axis=1)) / rows.shape[1]
        errors.append(
            abs(math.hypot(*point.x[2:]) / harmonics[1, 1] - 1) + abs(math.hypot(*point.x[:2]) / harmonics[0, 2] - 1)
        )
        mean = float(np.mean(st.reconstruct(slow, point, period * np.arange(64) / 64)[0]))
        assert mean == pytest.approx(amplitudes(rows[0])[0], rel=10 * e)
    assert observed_orders(errors, small)[-1] > 1.75


# ------------------------------------------------------------------ 5c
@pytest.mark.parametrize("seed", range(6))
def test_characteristic_polynomial(seed):
    """Row 5c: coefficients against the exact Jacobian of the averaged flow; equality to rounding."""
    random = np.random.default_rng(seed)
    e = 0.1
    v = scaled(e, detuned=True) | dict(xi1=e * random.uniform(0.05, 0.2), xi2=e * random.uniform(0.05, 0.2))
    v["eta"] = 1 + e * random.uniform(-0.1, 0.7)
    slow, state = equilibrium(v)
    J = evaluator(slow).FJ(np.zeros(1), state[None], slow.parameter_vector())[1][0]
    r = math.hypot(*state[2:])
    closed = st.autoparametric_characteristic(v["eta"], r=r, **picked(v, "xi1", "xi2", "q", "g1", "g2"))
    assert np.abs(np.poly(J) - closed).max() < 1e-15


# ------------------------------------------------------------------ 5d
FORMULA = {0.1: 0.21631, 0.05: 0.21440, 0.025: 0.21340, 0.0125: 0.21289}


def hopf_window(e):
    v = scaled(e, detuned=True)
    return st.autoparametric_hopf(**picked(v, "xi1", "xi2", "q", "g1", "g2", "f"))


@pytest.mark.parametrize("e", FORMULA)
def test_hopf_points_from_the_polynomial(e):
    """Row 5d, the upper edge: c1 c2 c3 = c3^2 + c1^2 c4, at the listed detunings."""
    assert (hopf_window(e)[-1] - 1) / e == pytest.approx(FORMULA[e], abs=6e-6)


def test_hopf_points_are_those_of_the_averaged_branch():
    e = 0.05
    v = scaled(e, detuned=True)
    slow = st.averaging(st.models.autoparametric_quadratic(**v), resonance=(2, 1))
    semi = st.continuation(st.Equilibrium(slow), "eta", (1 - 2 * e, 1 + 2 * e))
    point = next(p for p in semi.special if p.kind is st.Kind.BRANCH_POINT)
    branch = st.continuation(st.switch(point), "eta", (1 - 2 * e, 1 + 2 * e))
    found = {round(p.params["eta"], 9) for p in branch.special if p.kind is st.Kind.HOPF}
    assert sorted(found) == pytest.approx(list(hopf_window(e)), abs=2e-9)


@functools.cache
def torus_points(e):
    """Neimark-Sacker points of the full quadratic system: semi-trivial orbit, period doubling, switch, continuation."""
    v = scaled(e, detuned=True)
    system = st.models.autoparametric_quadratic(**v)
    window = (1 - 2 * e, 1 + 2 * e)
    semi = st.continuation(st.Collocation(system), "eta", window)
    branch = st.continuation(st.switch(semi["PD1"]), "eta", window)
    return sorted((p.params["eta"] - 1) / e for p in branch.special if p.kind is st.Kind.NEIMARK_SACKER)


def test_hopf_points_converge_to_torus_points():
    """Row 5d: the upper edge of the window; full values .17744 .19773 .20603 .20951, order 1.13-1.22."""
    listed = {0.1: 0.17744, 0.05: 0.19773, 0.025: 0.20603, 0.0125: 0.20951}
    errors = []
    for e, number in listed.items():
        full = torus_points(e)
        assert max(full) == pytest.approx(number, abs=2e-5)
        errors.append(abs((hopf_window(e)[-1] - 1) / e - max(full)))
    orders = observed_orders(errors, tuple(listed))
    assert ((orders > 1.0) & (orders < 1.3)).all()


def test_torus_points_at_one_scale():
    """The full system's torus points lie within O(eps) of the averaged Hopf points (eps = 0.05; quick)."""
    full, averaged = torus_points(0.05), [(w - 1) / 0.05 for w in hopf_window(0.05)]
    assert len(full) == len(averaged) == 2
    assert max(full) == pytest.approx(0.19773, abs=2e-5)
    assert np.abs(np.array(full) - averaged).max() < 3 * 0.05


# ------------------------------------------------------------------ the pendulum in its own scaling
def pendulum(e):
    """u = U/eps, theta = O(eps), length_ratio = 0.4/eps^2, xi1 = 0.1 eps, xi2 = 0.25 eps, Omega0 = (1 - 2 eps)/2."""
    return st.models.autoparametric_pendulum(
        xi1=0.1 * e, xi2=0.25 * e, length_ratio=0.4 / e**2, Omega0=(1 - 2 * e) / 2, mass_ratio_total=0.2
    )


def nontrivial(problem, kind, window):
    semi = st.continuation(problem, "Omega", window)
    point = next(p for p in semi.special if p.kind in (st.Kind.BRANCH_POINT, st.Kind.PERIOD_DOUBLING))
    branch = st.continuation(st.switch(point), "Omega", window, max_points=400)
    return sorted({round(p.params["Omega"], 8) for p in branch.special if p.kind is kind})


def test_hopf_points_of_the_averaged_pendulum_converge_to_torus_points():
    """(Omega - 1)/eps of the Hopf points against the full pendulum's torus points: order 1, and 2 by second order."""
    small = (0.04, 0.02, 0.01)
    errors = {1: [], 2: []}
    for e in small:
        system = pendulum(e)
        window = (1 - 6 * e, 1 + 6 * e)
        full = nontrivial(st.Collocation(system), st.Kind.NEIMARK_SACKER, window)
        assert len(full) == 2
        for order, found in errors.items():
            slow = st.averaging(system, resonance=(2, 1), order=order)
            hopf = nontrivial(st.Equilibrium(slow), st.Kind.HOPF, window)
            assert len(hopf) == 2
            found.append(np.abs(np.array(hopf) - full).max() / e)
    assert observed_orders(errors[1], small)[-1] > 0.8
    assert observed_orders(errors[2], small)[-1] > 1.6


def test_default_pendulum_has_its_torus_points():
    """The tutorial's line: the averaged Hopf points of the default pendulum, beside 0.98487 and 0.99988 of the full one."""
    flow = st.averaging(st.models.autoparametric_pendulum(), resonance=(2, 1))
    hopf = nontrivial(st.Equilibrium(flow), st.Kind.HOPF, (0.5, 1.5))
    assert hopf == pytest.approx([0.98487, 0.99988], abs=4e-4)


def test_the_branch_at_rest_says_where_the_torus_point_is():
    """HB1 lies on the branch that is born at BP1: the message is code, and run, it gives the point."""
    flow = st.averaging(st.models.autoparametric_pendulum(), resonance=(2, 1))
    branch = st.continuation(st.Equilibrium(flow), "Omega", (0.5, 1.5))
    with pytest.raises(UnknownNameError, match="HB1") as caught:
        branch["HB1"]
    assert str(caught.value).endswith(": continuation(switch(branch['BP1']), 'Omega', (0.5, 1.5))['HB1']")
    point = st.continuation(st.switch(branch["BP1"]), "Omega", (0.5, 1.5))["HB1"]
    assert point.params["Omega"] == pytest.approx(0.98487, abs=4e-4)
    with pytest.raises(UnknownNameError, match="did you mean 'BP2'"):
        branch["BP3"]


@pytest.mark.parametrize("name", ["g1", "g2"])
def test_refusals(name):
    values = dict(xi1=0.01, xi2=0.01, q=0.5, g1=0.1, g2=0.1, f=0.1) | {name: 0.0}
    with pytest.raises(InputError, match=name):
        st.autoparametric_amplitudes(1.0, **values)
    with pytest.raises(InputError, match=name):
        st.autoparametric_hopf(**values)
