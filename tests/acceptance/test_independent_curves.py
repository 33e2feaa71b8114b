"""Issue D from outside: curves in two parameters, criticality, sensitivities, symmetry, detached branches.

Witness: discriminants and normal forms derived here, Mathieu's equation integrated by scipy, own shooting
(`independent_witness`) at shifted parameters, simulations.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import sympy as sp
from independent_witness import at, doubling, flow, fold, locate, polish, torus
from scipy.optimize import brentq

import stability as st

t = sp.Symbol("t")
q = sp.Function("x")(t)
mu, F, w, d, e, c3 = sp.symbols("mu F w d e c3")


def van_der_pol(mu_value, force):
    """(f, J, T) of x'' - mu (1 - x^2) x' + x = F cos(w t)."""
    return (
        lambda s, y, v: np.array([y[1], mu_value * (1 - y[0] ** 2) * y[1] - y[0] + force * np.cos(v * s)]),
        lambda s, y, v: np.array([[0.0, 1.0], [-1 - 2 * mu_value * y[0] * y[1], mu_value * (1 - y[0] ** 2)]]),
        lambda v: 2 * np.pi / v,
    )


@pytest.fixture(scope="module")
def entrained():
    system = st.System.from_equations(
        {q.diff(t, 2): mu * (1 - q**2) * q.diff(t) - q + F * sp.cos(w * t)}, [q], parameters=dict(mu=0.3, F=0.5, w=1.0)
    )
    return system, st.continuation(st.Collocation(system), "w", (0.6, 1.6))


def flat(**parameters):
    """A system x' = f of one state and named parameters, from a sympy expression in x."""
    rhs = parameters.pop("rhs")
    return st.System(name="flat", states=("x",), coordinates=("x",), parameters=parameters, rhs=(rhs,))


def test_torus_curve_by_own_monodromy(entrained):
    _, branch = entrained
    curve = st.continuation(st.locus(branch["NS2"], free="F", window=(0.4, 2.0)), "w", (1.0, 1.6))
    assert {"R3", "R4"} <= {p.kind.label.strip("_") for p in curve.special}
    for i in range(0, len(curve), max(1, len(curve) // 8)):
        value, force = curve.parameter[i], curve.columns["F"][i]
        _, matrix = polish(*at(van_der_pol(0.3, force), value), curve.solution(i)(0.0), 2 * np.pi / value)
        pair = np.linalg.eigvals(matrix)
        assert np.allclose(abs(pair), 1.0, atol=1e-8)
        assert abs(abs(np.angle(pair[0])) - curve.columns["torus_angle"][i]) < 1e-7
    for point in curve.special:
        angle = dict(R3=2 * np.pi / 3, R4=np.pi / 2).get(point.kind.label.strip("_"))
        if angle:
            value, model = point.params["w"], van_der_pol(0.3, point.params["F"])
            _, matrix = polish(*at(model, value), point.solution(0.0), 2 * np.pi / value)
            assert abs(abs(np.angle(np.linalg.eigvals(matrix)[0])) - angle) < 1e-6


@pytest.mark.parametrize("name", ["mu", "F"])
def test_sensitivity_of_a_torus_point_by_own_shooting(entrained, name):
    _, branch = entrained
    point, h, moved = branch["NS2"], 2e-4, []
    for sign in (-1, 1):
        values = dict(mu=0.3, F=0.5)
        values[name] += sign * h
        moved.append(locate(van_der_pol(values["mu"], values["F"]), point.solution(0.0), point.params["w"], torus))
    difference = (moved[1] - moved[0]) / (2 * h)
    assert abs(point.sensitivity()[name] / difference - 1) < 1e-6


def test_the_entrained_isola_is_found(entrained):
    # Below the critical forcing the response near w = 1 is detached; own folds at both of its ends.
    system, _ = entrained
    low = system.with_params(F=0.2)
    found = st.families(st.Collocation(low), "w", (0.8, 1.2), places=3)
    closed = [b for b in found if b.status is st.Status.CLOSED_LOOP]
    assert len(found) == 2 and len(closed) == 1
    folds = closed[0].of_kind(st.Kind.FOLD)
    assert len(folds) == 2
    for point in folds:
        own = locate(van_der_pol(0.3, 0.2), point.solution(0.0), point.params["w"], fold)
        assert abs(own - point.params["w"]) < 1e-9
    verdicts = sorted(str(o.verdict) for b in found for o in b.at(w=1.01))
    assert verdicts == ["stable", "unstable", "unstable"]


def test_fold_curve_is_the_discriminant_of_one_harmonic():
    # z = a^2: k^2 z^3 + 2 k D z^2 + (D^2 + d^2 w^2) z = g^2, k = 3 beta/4, D = 1 - w^2: double root on the curve.
    damping, k = 0.1, 0.75 * 0.5
    system = st.models.duffing_textbook(delta=damping, alpha=1, beta=0.5, gamma=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.TruncationWarning)  # true, and not what is tested
        branch = st.continuation(st.HarmonicBalance(system, harmonics=1), "omega", (0.3, 3.0))
        curve = st.continuation(st.locus(branch["LP1"], free="gamma"), "omega", (0.3, 3.0))
    for v, force in zip(curve.columns["omega"], curve.columns["gamma"], strict=True):
        cubic = [k * k, 2 * k * (1 - v * v), (1 - v * v) ** 2 + damping**2 * v * v, -force * force]
        extrema = np.roots(np.polyder(cubic))
        assert min(abs(np.polyval(cubic, extrema))) < 1e-9 * force**2
    v = brentq(lambda s: s * s - 1 - np.sqrt(3) * damping * s, 1.0, 2.0)
    z = 2 * (v * v - 1) / (3 * k)
    force = np.sqrt(np.polyval([k * k, 2 * k * (1 - v * v), (1 - v * v) ** 2 + damping**2 * v * v, 0.0], z))
    (cusp,) = curve.of_kind(st.Kind.CUSP)
    assert abs(cusp.params["omega"] - v) < 1e-8 and abs(cusp.params["gamma"] - force) < 1e-8


def test_doubling_curve_of_a_parametric_oscillator_is_mathieus():
    # Rest of x'' + d x' + (1 + e cos w t) x + c x^3 = 0 is linear: det(M + I) = 0 of the damped Mathieu equation.
    system = st.System.from_equations(
        {q.diff(t, 2): -d * q.diff(t) - (1 + e * sp.cos(w * t)) * q - c3 * q**3}, [q],
        parameters=dict(d=0.05, e=0.3, c3=0.5, w=2.0))  # fmt: skip
    rest = st.continuation(st.Collocation(system), "w", (1.6, 2.4))
    tongue = st.continuation(st.locus(rest["PD1"], free="e", window=(0.05, 0.8)), "w", (1.4, 2.7))

    def border(depth, value):
        _, matrix = flow(
            lambda s, y: np.array([y[1], -0.05 * y[1] - (1 + depth * np.cos(value * s)) * y[0]]),
            lambda s, y: np.array([[0.0, 1.0], [-1 - depth * np.cos(value * s), -0.05]]),
            np.zeros(2), 2 * np.pi / value, rtol=1e-12, atol=1e-14)  # fmt: skip
        return doubling(matrix)

    for i in range(0, len(tongue), max(1, len(tongue) // 8)):
        depth, value = tongue.columns["e"][i], tongue.parameter[i]
        if depth > 0.15:  # near the tip both roots come together
            assert abs(brentq(border, depth - 1e-3, depth + 1e-3, args=(value,), xtol=1e-13) - depth) < 1e-8
    tip = min(tongue.of_kind(st.Kind.EXTREMUM), key=lambda p: p.params["e"])
    assert abs(tip.params["e"] - 4 * 0.025) < 0.1**3  # |b| = 4 delta w0 to first order, next order cubic
    assert tip.sensitivity(of="e")["c3"] == pytest.approx(0.0, abs=1e-10)
    assert tip.sensitivity(of="e")["d"] == pytest.approx(2.0, rel=0.02)


def test_cusp_of_a_cubic_and_its_fold_curve():
    # x' = b + a x - x^3: folds 27 b^2 = 4 a^3, cusp at the origin.
    x, a, b = sp.symbols("x a b", real=True)
    branch = st.continuation(st.Equilibrium(flat(rhs=b + a * x - x**3, a=1.0, b=0.0)), "b", (-2, 2), start=dict(x=-1.5))
    curve = st.continuation(st.locus(branch["LP1"], free="a"), "b", (-1.0, 1.0))
    assert np.allclose(27 * curve.columns["b"] ** 2, 4 * curve.columns["a"] ** 3, atol=1e-9)
    (cusp,) = curve.of_kind(st.Kind.CUSP)
    assert abs(cusp.params["a"]) < 1e-8 and abs(cusp.params["b"]) < 1e-8
    slope = branch["LP1"].sensitivity()["a"]
    assert abs(abs(slope) - 3 * 4 / (2 * 27 * np.sqrt(4 / 27))) < 1e-8  # db/da = 12 a^2/(54 b)


def test_bogdanov_takens_and_bautin_points_by_normal_forms():
    x, y, b1, b2 = sp.symbols("x y b1 b2", real=True)
    takens = st.System(name="takens", states=("x", "y"), coordinates=("x", "y"), parameters=dict(b1=-0.1, b2=-0.3),
                       rhs=(y, b1 + b2 * x + x**2 - x * y))  # fmt: skip
    branch = st.continuation(st.Equilibrium(takens), "b1", (-0.2, 0.5), start=dict(x=-0.3))
    assert abs(branch["LP1"].params["b1"] - 0.3**2 / 4) < 1e-10
    assert branch["HB1"].criticality is st.Criticality.SUPERCRITICAL  # the sign of -x y
    folds = st.continuation(st.locus(branch["LP1"], free="b2"), "b1", (-0.1, 0.5))
    assert np.allclose(folds.columns["b1"], folds.columns["b2"] ** 2 / 4, atol=1e-10)
    (bt,) = folds.of_kind(st.Kind.BOGDANOV_TAKENS)
    assert abs(bt.params["b1"]) < 1e-9 and abs(bt.params["b2"]) < 1e-8
    a, b = sp.symbols("a b", real=True)  # r' = a r + b r^3 - r^5
    r2 = x**2 + y**2
    bautin = st.System(name="bautin", states=("x", "y"), coordinates=("x", "y"), parameters=dict(a=-1.0, b=0.5),
                       rhs=(a * x - y + b * x * r2 - x * r2**2, x + a * y + b * y * r2 - y * r2**2))  # fmt: skip
    rest = st.continuation(st.Equilibrium(bautin), "a", (-1.0, 1.0))
    assert rest["HB1"].criticality is st.Criticality.SUBCRITICAL
    curve = st.continuation(st.locus(rest["HB1"], free="a", along="b"), "b", (-1.0, 1.0))
    (gh,) = curve.of_kind(st.Kind.GENERALIZED_HOPF)
    assert abs(gh.params["b"]) < 1e-7 and abs(gh.params["a"]) < 1e-9
    cycles = st.continuation(st.switch(rest["HB1"]), "a", (-1.0, 0.5))
    assert abs(cycles["LP1"].params["a"] + 0.5**2 / 4) < 1e-9  # fold of cycles a = -b^2/4
    assert abs(cycles["LP1"].solution.max["x"] - 0.5) < 1e-6  # r^2 = b/2


def test_isola_birth_and_merger_of_a_lemniscate():
    # x^2 = b - V(a), V = a^4/4 - a^2/2 + a/10: births at the minima of V, merger at its maximum.
    x, a, b = sp.symbols("x a b", real=True)
    potential = a**4 / 4 - a**2 / 2 + a / 10
    branch = st.continuation(
        st.Equilibrium(flat(rhs=b - potential - x**2, a=0.0, b=1.0)), "a", (0.0, 3.0), start=dict(x=1.0)
    )
    curve = st.continuation(st.locus(branch["LP1"], free="b"), "a", (-2.0, 2.0))
    stationary = np.sort(np.roots([1.0, 0.0, -1.0, 0.1]).real)
    births = sorted(p.params["a"] for p in curve.of_kind(st.Kind.ISOLA_CENTRE))
    (merger,) = curve.of_kind(st.Kind.ISOLA_MERGER)
    assert np.allclose(births, stationary[[0, 2]], atol=1e-7)
    assert abs(merger.params["a"] - stationary[1]) < 1e-7
    value = merger.params["a"] ** 4 / 4 - merger.params["a"] ** 2 / 2 + merger.params["a"] / 10
    assert abs(merger.params["b"] - value) < 1e-9


def test_half_period_orbits_are_those_of_the_whole_period():
    system = st.models.duffing_textbook(delta=0.2, alpha=1, beta=1, gamma=7)
    whole = st.continuation(st.Collocation(system), "omega", (2.6, 1.0))
    half = st.continuation(st.Collocation(system, symmetry="auto"), "omega", (2.6, 1.0))
    assert whole.labels == half.labels and len(whole.of_kind(st.Kind.BRANCH_POINT)) >= 1
    for label in whole.labels:
        assert abs(whole[label].params["omega"] - half[label].params["omega"]) < 1e-8
    point = half.of_kind(st.Kind.BRANCH_POINT)[0]
    assert point.symmetry_breaking
    value, orbit = point.params["omega"], point.solution

    def f(s, y):
        return np.array([y[1], -0.2 * y[1] - y[0] - y[0] ** 3 + 7 * np.cos(value * s)])

    def jacobian(s, y):
        return np.array([[0.0, 1.0], [-1 - 3 * y[0] ** 2, -0.2]])

    end, matrix = flow(f, jacobian, orbit(0.0), np.pi / value)
    assert np.allclose(end, -orbit(0.0), atol=1e-8)  # x(t + T/2) = -x(t)
    assert abs(np.linalg.det(-matrix + np.eye(2))) < 1e-7  # N = -Phi(T/2) has -1
    left_right = st.continuation(st.switch(point), "omega", (2.6, 1.0)).at(omega=value - 0.05)
    assert any(abs(a.max["x"] + b.min["x"]) < 1e-6 for a in left_right for b in left_right if a is not b)


def test_refusals_before_work(entrained):
    _, branch = entrained
    with pytest.raises(st.errors.InputError):
        st.locus(branch["NS2"], free="w")
    with pytest.raises(st.errors.UnknownNameError, match="mu"):
        st.locus(branch["NS2"], free="nu")
    with pytest.raises(st.errors.InputError):
        st.switch(branch["NS1"])
