"""Errata of the chapter, equations (40)-(67) and figures 8, 10, 12, 13: parametric and autoparametric systems.

Each test shows the printed form or number failing and the library's one holding. Witness: derivation from energies
(`by_hand`), the trace of the monodromy matrix, Mathieu characteristic values, time integration (DOP853).
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from by_hand import coordinate, lagrange, obeys, real, t, vanishes
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stability as st

M = st.models
GRAVITY, LENGTH = 9.81, 0.1081
W2 = np.sqrt(GRAVITY / LENGTH)
m, l_, A, w, g, D = real("mass length amplitude frequency gravity damping")


def driven(w, amplitude, length=LENGTH, linear=True):
    """The base-driven pendulum of figure 10 at the angular frequency w (rad/s)."""
    return M.base_driven_pendulum.from_physical(
        length=length, amplitude=amplitude, frequency=w / (2 * np.pi), linear=linear
    )


def trace(w, amplitude, length=LENGTH):
    return np.trace(st.monodromy(driven(w, amplitude, length)).matrix)


# ------------------------------------------------------------------------------------------------------- (42)-(44)
def pendulum_equation():
    phi, W = coordinate("phi"), 2 * sp.pi * w
    r = sp.Matrix([l_ * sp.sin(phi), A * sp.cos(W * t) - l_ * sp.cos(phi)])
    (e,) = lagrange(m * r.diff(t).dot(r.diff(t)) / 2, m * g * r[1], [phi], R=D * phi.diff(t) ** 2 / 2).values()
    return phi, W, e / (m * l_**2)


def test_42_second_derivative_of_a_cosine():
    Y = A * sp.cos(w * t)
    assert Y.diff(t, 2) == -A * w**2 * sp.cos(w * t)  # printed: +


def test_43_44_sign_and_damping():
    phi, W, e = pendulum_equation()
    system = M.base_driven_pendulum.from_physical(amplitude=0.1)
    assert obeys(system, {phi: e})
    load = A * W**2 * sp.cos(W * t)
    rest = phi.diff(t, 2) + D / (m * l_**2) * phi.diff(t)
    for sign, damper, holds in ((-1, l_**2, True), (1, l_**2, False), (-1, 1, False)):
        form = rest + sp.sin(phi) * (g + sign * load) / l_ + D / m * (1 / damper - 1 / l_**2) * phi.diff(t)
        assert obeys(system, {phi: form}) is holds


def test_43_44_sign_shifts_time_by_half_a_period():
    """The printed sign leaves the stability alone and changes the motion."""
    plus, minus = driven(W2, 0.1), driven(W2, 0.1).with_params(amplitude=-0.1)
    one, two = st.monodromy(plus), st.monodromy(minus)
    assert np.trace(one.matrix) == pytest.approx(np.trace(two.matrix), abs=1e-10)
    assert np.abs(one.matrix - two.matrix).max() > 0.1


def test_44_coefficients_of_mathieus_equation():
    """a = g/l, b = -A w^2/l; printed b = -(A - w^2)/l, and sin(phi) kept after linearising."""
    system = driven(7.0, 0.05)
    a, b = GRAVITY / LENGTH, -0.05 * 49 / LENGTH
    mathieu = st.monodromy(M.mathieu(a=a, b=b, Omega=7.0))
    assert st.monodromy(system).matrix == pytest.approx(mathieu.matrix, abs=1e-9)
    printed = st.monodromy(M.mathieu(a=a, b=-(0.05 - 49) / LENGTH, Omega=7.0))
    assert np.abs(printed.matrix - mathieu.matrix).max() > 1
    assert [sp.simplify(e) for e in st.linearised(driven(7.0, 0.05, linear=False)).rhs] == [
        sp.simplify(e) for e in system.rhs
    ]


# ------------------------------------------------------------------------------------------- text at (44), figure 10
def test_two_to_one_is_the_strong_resonance():
    """a = 1, b = 0.2: exponent .0499 at 2:1, .0037 at 1:1 (13 times weaker), and delta = .005 removes the latter."""
    strong = st.monodromy(M.mathieu(a=1.0, b=0.2, Omega=2.0)).growth_rate
    weak = st.monodromy(M.mathieu(a=1.0, b=0.2, Omega=1.0)).growth_rate
    assert strong == pytest.approx(0.0499, abs=5e-5) and weak == pytest.approx(0.0037, abs=5e-5)
    assert 13 < strong / weak < 14
    assert st.monodromy(M.mathieu(a=1.0, b=0.2, Omega=1.0, delta=0.005)).growth_rate < 0
    assert st.monodromy(M.mathieu(a=1.0, b=0.2, Omega=2.0, delta=0.005)).growth_rate > 0.04


def test_fig_10_ten_radians_per_second_are_stable():
    point = st.monodromy(driven(10.0, 0.1))
    assert np.trace(point.matrix) == pytest.approx(1.887, abs=5e-4)
    assert abs(point.growth_rate) < 1e-8 and point.verdict is not st.Verdict.UNSTABLE
    ratio = 10.0 / W2
    assert ratio == pytest.approx(1.050, abs=5e-4)
    edges = brentq(lambda x: trace(x, 0.1) - 2, 8, 9), brentq(lambda x: trace(x, 0.1) - 2, 9.6, 9.99)
    assert edges == pytest.approx((8.485, 9.880), abs=6e-4)


def mathieu_edges(amplitude, order):
    """Edges (rad/s) of a tongue: a_M = 4 g/(l w^2) = a_n or b_n of q = 2 A/l."""
    q = 2 * amplitude / LENGTH
    values = st.mathieu_a(order, q), st.mathieu_b(order, q)
    return sorted(2 * np.sqrt(GRAVITY / LENGTH / x) for x in values if x > 0)


def test_fig_10_edges_are_mathieu_characteristic_values():
    assert mathieu_edges(0.1, 2) == pytest.approx([8.485, 9.880], abs=6e-4)
    assert mathieu_edges(0.01, 1) == pytest.approx([17.53, 21.16], abs=6e-3)
    for edge in mathieu_edges(0.1, 2):
        assert trace(edge, 0.1) == pytest.approx(2, abs=1e-8)
    for edge in mathieu_edges(0.01, 1):
        assert trace(edge, 0.01) == pytest.approx(-2, abs=1e-8)


def test_fig_10_text_band_width():
    """ "ca. 1 rad" is rad/s, and fits the 1:1 tongue only; the 2:1 tongue at 100 mm has no upper end."""
    low, high = mathieu_edges(0.1, 2)
    assert high - low == pytest.approx(1.395, abs=1e-3)
    assert len(mathieu_edges(0.1, 1)) == 1  # one of a_1, b_1 is negative: no upper end
    assert mathieu_edges(0.1, 1)[0] == pytest.approx(12.49, abs=6e-3)
    assert trace(100.0, 0.1) < -2 and trace(1000.0, 0.1) < -2


def motion(system, seconds):
    return solve_ivp(system, (0, seconds), [0.01, 0.0], method="DOP853", rtol=1e-9, atol=1e-12, dense_output=True)


def test_fig_10_left_panel_is_exact_one_to_one():
    """w = w2 = 9.526 rad/s: exponent 0.7457 1/s, the linear solution reaches 1e4 rad in 18.5 s, the exact one beats."""
    assert pytest.approx(9.5262, abs=5e-5) == W2
    assert st.monodromy(driven(W2, 0.1)).growth_rate == pytest.approx(0.745666, abs=5e-7)
    linear = motion(driven(W2, 0.1), 20.0)
    times = np.linspace(0, 20, 20001)
    first = times[np.argmax(np.abs(linear.sol(times)[0]) > 1e4)]
    assert first == pytest.approx(18.5, abs=0.25)
    exact = np.abs(motion(driven(W2, 0.1, linear=False), 20.0).sol(times)[0])
    assert exact.max() == pytest.approx(1.032, abs=1e-3)
    beat = exact[times < 10]
    assert times[beat.argmax()] == pytest.approx(6.78, abs=0.02)
    stable = np.abs(motion(driven(10.0, 0.1, linear=False), 20.0).sol(times)[0])
    assert stable.max() == pytest.approx(0.0348, abs=2e-4)


def test_fig_10_shorter_pendulum_is_the_other_reading():
    point = st.monodromy(driven(10.0, 0.1, length=0.0981))
    assert point.growth_rate == pytest.approx(0.944, abs=5e-4)
    assert np.sqrt(GRAVITY / 0.0981) == pytest.approx(10.0, rel=1e-12)


def test_fig_10_right_panel_needs_a_small_amplitude():
    """2:1 at 100 mm rotates (exponent 6.83 1/s); at 10 mm it beats: 0.87774 1/s, 1.630 rad at 6.42 s."""
    assert st.monodromy(driven(2 * W2, 0.1)).growth_rate == pytest.approx(6.83, abs=5e-3)
    assert st.monodromy(driven(2 * W2, 0.01)).growth_rate == pytest.approx(0.87774, abs=5e-6)
    times = np.linspace(0, 10, 20001)
    large = np.abs(motion(driven(2 * W2, 0.1, linear=False), 10.0).sol(times)[0])
    small = np.abs(motion(driven(2 * W2, 0.01, linear=False), 10.0).sol(times)[0])
    assert large.max() > 2 * np.pi  # more than a turn
    first = small[times < 8]
    assert first.max() == pytest.approx(1.630, abs=1e-3) and times[first.argmax()] == pytest.approx(6.42, abs=0.01)


# ---------------------------------------------------------------------------------------------------- section 3, text
@pytest.mark.parametrize(("epsilon", "grows"), [(0.5, False), (1.0, False), (6.0, True)])
def test_modulated_damping_grows_only_with_negative_resistance(epsilon, grows):
    """E' = -R(t) q'^2: the chapter's "any system parameter including damping" holds only once R(t) < 0."""
    resonance = 1 / np.sqrt(1e-3 * 1e-6)
    rates = [
        st.monodromy(M.resistance_modulated_circuit(epsilon=epsilon, omega=ratio * resonance)).growth_rate
        for ratio in (0.5, 0.9, 1.0, 1.1, 1.9, 2.0, 2.1, 3.0)
    ]
    assert (max(rates) > 0) is grows


def test_stiffness_modulation_grows_inside_tongues_above_the_threshold_only():
    """Damped threshold of the first tongue |b| = 4 delta w0 (small b); outside the tongue there is no growth."""
    for b, verdict in ((0.9 * 0.02, st.Verdict.STABLE), (1.1 * 0.02, st.Verdict.UNSTABLE)):
        assert st.monodromy(M.mathieu(a=1.0, b=b, Omega=2.0, delta=0.005)).verdict is verdict
    assert st.monodromy(M.mathieu(a=1.0, b=0.2, Omega=1.7, delta=0.005)).verdict is st.Verdict.STABLE


# ------------------------------------------------------------------------------------------------------- (63)-(67)
def autoparametric():
    """(62), (63) derived from the positions (54) with y0, in units m = k = A = 1 (l = ll, g = ll Omega0^2)."""
    x1, x2, lm, ll, W0, Om = real("xi1 xi2 mass_ratio_total length_ratio Omega0 Omega")
    u, th = coordinate("u"), coordinate("theta")
    Y = u + sp.cos(Om * t)
    r = sp.Matrix([ll * sp.sin(th), Y - ll * sp.cos(th)])
    T = (1 - lm) * Y.diff(t) ** 2 / 2 + lm * r.diff(t).dot(r.diff(t)) / 2
    U = u**2 / 2 - lm * ll * W0**2 * ll * sp.cos(th)
    R = x1 * u.diff(t) ** 2 + x2 * W0 * lm * ll**2 * th.diff(t) ** 2
    return u, th, lagrange(T, U, [u, th], R=R)


def test_63_base_acceleration_is_missing():
    u, th, e = autoparametric()
    x2, lm, ll, W0, Om = real("xi2 mass_ratio_total length_ratio Omega0 Omega")
    printed = lm * ll**2 * th.diff(t, 2) + lm * ll**2 * W0**2 * sp.sin(th) + ll * lm * u.diff(t, 2) * sp.sin(th)
    printed += 2 * x2 * W0 * lm * ll**2 * th.diff(t)
    assert sp.simplify(printed - e[th].doit() - ll * lm * Om**2 * sp.sin(th) * sp.cos(Om * t)) == 0
    assert obeys(M.autoparametric_pendulum(), e)
    assert not obeys(M.autoparametric_pendulum(base_term=False), e)


PARAMETERS = dict(xi1=0.021, xi2=0.021, mass_ratio_total=0.2, Omega0=0.5)


def threshold(base_term, Omega, low, high):
    """Acceleration (g) at which theta = 0 loses its stability, from the multipliers about the linear response."""
    system = M.autoparametric_pendulum.from_acceleration(base_term=base_term, Omega=Omega, **PARAMETERS)

    def beyond(acceleration):
        multipliers = st.monodromy(system, about="linear", acceleration=acceleration).multipliers
        return np.abs(multipliers).max() - 1

    below = [beyond(a) for a in np.linspace(low / 20, low, 20)]
    assert max(below) < 0  # the first threshold
    return brentq(beyond, low, high, xtol=1e-12)


def test_67_threshold_at_resonance_and_away_from_it():
    assert threshold(True, 1.0, 0.003, 0.004) == pytest.approx(0.0035252, abs=5e-8)
    assert threshold(False, 1.0, 0.003, 0.004) == pytest.approx(0.0035283, abs=5e-8)
    assert threshold(True, 1.5, 2.8, 3.1) == pytest.approx(2.946, abs=5e-4)
    assert threshold(False, 1.5, 1.25, 1.4) == pytest.approx(1.312, abs=5e-4)


def test_67_small_damping_estimate_holds_at_exact_tuning():
    """acc/g = 4 xi2/|U_abs| at Omega = 2 Omega0 (catalogue 9)."""
    response = st.linear_response(M.linear_oscillator(xi=0.021)).frequency_response(1.0, "u_absolute")
    assert 4 * 0.021 / abs(response) == pytest.approx(0.0035252, rel=2e-3)


def test_64_xi1_stands_on_the_total_mass():
    """With d/(2 m1 w1) the term reads 2 (1 - lm) xi1 u': residual -2 lm xi1 u'."""
    m1, m2, d, w1 = real("m1 m2 d w1")
    lm = m2 / (m1 + m2)
    for xi1, factor, holds in (
        (d / (2 * (m1 + m2) * w1), 1, True),
        (d / (2 * m1 * w1), 1, False),
        (d / (2 * m1 * w1), 1 - lm, True),
    ):
        assert vanishes(d / ((m1 + m2) * w1) - 2 * factor * xi1) is holds
    physical = M.autoparametric_pendulum.from_physical()
    p = physical.parameters
    w1 = np.sqrt(p["stiffness"] / (p["mass1"] + p["mass2"]))
    assert p["damping"] / (2 * (p["mass1"] + p["mass2"]) * w1) == pytest.approx(0.021, rel=1e-12)


def test_fig_13_frequency_ratio():
    """w1 : w2 = 2:1, Omega0 = 1/2 (printed inverted): only then is the threshold low."""
    half = threshold(True, 1.0, 0.003, 0.004)
    system = M.autoparametric_pendulum.from_acceleration(**{**PARAMETERS, "Omega0": 2.0}, Omega=1.0)
    printed = st.monodromy(system, about="linear", acceleration=10 * half)
    assert printed.verdict is st.Verdict.STABLE
    p = M.autoparametric_pendulum.from_physical().parameters
    w1, w2 = np.sqrt(p["stiffness"] / (p["mass1"] + p["mass2"])), np.sqrt(p["g"] / p["length"])
    assert w1 / w2 == pytest.approx(2.0, rel=1e-12)
    assert p["length"] == pytest.approx(2.0132e-3, rel=1e-4)


def test_65_angle_scale_must_be_one_radian():
    """phi = phi0 theta gives sin(phi0 theta): (66), (67) hold for phi0 = 1 rad only."""
    phi0 = real("phi0")
    u, th, e = autoparametric()
    scaled = e[th].doit().subs(th, phi0 * th).doit() / phi0
    assert sp.simplify((scaled - e[th].doit()).subs(phi0, 1)) == 0
    assert not vanishes((scaled - e[th].doit()).subs({th.diff(t, 2): 0, th.diff(t): 0, u.diff(t, 2): 0, th: 1}))
