"""Numbers of the catalogue (sections 1, 3-6, 9-11) that models, charts and linear responses reach.

Numbers that already stand in an erratum (peaks of figure 6 as printed, figure 10, thresholds of (67)) are in the
`test_errata` files; here is the rest. Witness: the catalogue, which is an independent re-derivation, and closed forms.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, fsolve, minimize_scalar
from scipy.special import ellipk
from test_errata_minor import balance

import stability as st

M = st.models
G = 9.81


# ------------------------------------------------------------------------------------------------ sections 3 and 4
def test_oscillator_peaks():
    ((where, height),) = st.linear_response(M.linear_oscillator(xi=0.021)).peaks("u")
    assert where == pytest.approx(1.000441, abs=5e-7) and height == pytest.approx(23.8148, abs=5e-5)
    ((where, _),) = st.linear_response(M.linear_oscillator(xi=0.2)).peaks("u_absolute")
    assert where**2 == pytest.approx((np.sqrt(1 + 8 * 0.2**2) - 1) / (4 * 0.2**2), rel=1e-9)


def test_constant_acceleration_peak_is_below_the_natural_frequency():
    """y = (acc/w1^2)/(1 - Om^2 + 2 j xi Om): peak at sqrt(1 - 2 xi^2)."""
    system = M.linear_oscillator.from_physical(acceleration=4.905, damping=0.5)
    w1 = np.sqrt(315.827 / 0.02)
    xi = 0.5 / (2 * 0.02 * w1)
    response = st.linear_response(system)
    ((where, height),) = response.peaks("y")
    assert 2 * np.pi * where / w1 == pytest.approx(np.sqrt(1 - 2 * xi**2), rel=1e-9)
    amplitude = abs(response.frequency_response(where, "y"))
    assert amplitude == pytest.approx(4.905 / w1**2 / (2 * xi * np.sqrt(1 - xi**2)), rel=1e-9)
    assert height == pytest.approx(amplitude, rel=1e-9)
    assert 1000 * amplitude == pytest.approx(abs(response.frequency_response(where, "y_mm")), rel=1e-12)


@pytest.mark.parametrize(
    ("Omega0", "name", "expected"),
    [
        (1.0, "u", [(0.7072, 22.45), (1.4218, 5.79)]),
        (1.0, "v", [(0.7073, 44.90), (1.4029, 6.06)]),
        (5.0, "u", [(0.8131, 29.24), (6.342, 1.083)]),
    ],
)
def test_chain_peaks(Omega0, name, expected):
    peaks = st.linear_response(M.chain(Omega0=Omega0)).peaks(name)
    for (where, height), (x, y) in zip(peaks, expected, strict=True):
        assert where == pytest.approx(x, abs=5e-4 if x > 6 else 5e-5)
        assert height == pytest.approx(y, abs=5e-4 if y < 2 else 5e-3)


@pytest.mark.parametrize("excitation", [dict(acceleration=4.905), dict(amplitude=1e-4)])
@pytest.mark.parametrize("name", ["y1", "y2", "y1_mm"])
def test_peaks_in_si_units_are_those_of_the_curve(excitation, name):
    """The peaks of a polynomial whose coefficients span many powers of ten against a dense frequency response."""
    response = st.linear_response(M.chain.from_physical(**excitation))
    f = np.linspace(5, 45, 80001)
    a = abs(response.frequency_response(f, name))
    inner = np.flatnonzero((a[1:-1] > a[:-2]) & (a[1:-1] > a[2:])) + 1
    found = [peak for peak in response.peaks(name) if peak[0] < 45]
    assert [x for x, _ in found] == pytest.approx(f[inner], abs=1e-3)
    assert [x for _, x in found] == pytest.approx(a[inner], rel=1e-6)


def test_every_transfer_function_is_a_direct_complex_solve():
    """Z(f) = C (j w - A)^-1 B by numpy from differences of the equations of motion, to 1e-12."""
    cases = [
        (M.linear_oscillator(xi=0.03, gravity=0.4), "Omega", 0.7, lambda f: f),
        (M.chain(gravity=0.2), "Omega", 1.3, lambda f: f),
        (M.chain(damper2="base", Omega0=5.0), "Omega", 4.0, lambda f: f),
        (M.harvester(theta=0.1, lam=0.05), "Omega", 0.9, lambda f: f),
        (M.chain.from_physical(), "frequency", 21.0, lambda f: 2 * np.pi * f),
        (M.harvester.from_physical(), "frequency", 19.0, lambda f: 2 * np.pi * f),
    ]
    for system, name, value, angular in cases:
        response = st.linear_response(system, **{name: value})
        own = system.with_params(**{name: value})
        w, x = angular(value), own.state_vector(response.equilibrium)
        quarter = 2 * np.pi / w / 4
        at = [np.asarray(own(k * quarter, x)) for k in range(4)]
        B = (at[0] - at[2]) / 2 - 1j * (at[1] - at[3]) / 2  # amplitude of cos and sin of the load
        Z = np.linalg.solve(1j * w * np.eye(own.n) - response.A, B)
        for k, state in enumerate(own.states):
            scale = np.abs(Z).max() * 1e-13
            assert response.frequency_response(value, state) == pytest.approx(Z[k], rel=1e-12, abs=scale)


def test_responses_that_do_not_exist_are_typed_errors():
    """A power is quadratic (its linear part is zero, not its value); an undamped resonance is infinite."""
    with pytest.raises(st.errors.EquationError, match="no linear part"):
        st.linear_response(M.harvester.from_physical()).frequency_response(20.0, "power_mW")
    with pytest.raises(st.errors.InputError, match="undamped resonance"):
        st.linear_response(M.linear_oscillator(xi=0.0)).frequency_response(1.0, "u")


def test_static_positions():
    rest = st.linear_response(M.chain.from_physical(gravity=True)).equilibrium
    assert rest["y1"] == pytest.approx(-0.03 * G / 571.22, rel=1e-12)
    assert rest["y2"] == pytest.approx(-0.03 * G / 571.22 - 0.01 * G / 285.61, rel=1e-12)


# ------------------------------------------------------------------------------------------------------- section 1
def test_springs_of_figure_2():
    ring = M.LevitatedMagnetSpring(M.RingMagnet(3e-3, 6e-3, 4e-3, 1.2), gap=12e-3)
    _, k1, _, k3 = ring.taylor
    assert k1 == pytest.approx(189.2, abs=0.05) and k3 == pytest.approx(1.87e6, rel=3e-3)
    assert ring.odd and float(ring.force(0.0)) == 0.0
    rotor = M.RotationalMagneticSpring({2: 1e-2, 4: -1e-3})
    assert float(rotor.force(0.1)) == pytest.approx(1e-2 * np.sin(0.2) - 1e-3 * np.sin(0.4), rel=1e-13)


def test_magnets_closed_form_is_the_charge_model_and_the_energy_its_integral():
    pairs = [
        M.MagnetPair(M.DiscMagnet(5e-3, 3e-3, 1.2), M.DiscMagnet(4e-3, 2e-3, 1.1)),
        M.MagnetPair(M.RingMagnet(3e-3, 6e-3, 4e-3, 1.2), M.RingMagnet(2e-3, 6e-3, 3e-3, 1.2)),
    ]
    gaps = np.array([0.5e-3, 2e-3, 5e-3, 9e-3])
    for pair in pairs:
        assert pair.force(gaps, method="closed form") == pytest.approx(
            pair.force(gaps, method="charge model"), rel=1e-12
        )
        work, _ = quad(lambda z, p=pair: float(p.force(z)), 2e-3, 9e-3, epsabs=0, epsrel=1e-12)
        assert float(pair.energy(2e-3) - pair.energy(9e-3)) == pytest.approx(work, rel=1e-11)


@pytest.mark.parametrize(
    ("gap", "ratio", "places"), [(40e-3, 1.06, 2), (20e-3, 1.21, 2), (12e-3, 1.5, 1), (0.5e-3, 15, 0)]
)
def test_far_field_is_too_large(gap, ratio, places):
    pair = M.MagnetPair(M.DiscMagnet(5e-3, 3e-3, 1.2), M.DiscMagnet(5e-3, 3e-3, 1.2))
    found = float(pair.far_field(gap) / pair.force(gap))
    assert found == pytest.approx(ratio, abs=0.6 * 10.0**-places)


def test_nested_rings_change_the_sign():
    pair = M.MagnetPair(M.DiscMagnet(2e-3, 3e-3, 1.2), M.RingMagnet(4e-3, 8e-3, 3e-3, 1.2))
    change = brentq(lambda z: float(pair.force(z)), 3e-3, 5e-3)
    assert change == pytest.approx(4e-3, abs=2.5e-4)
    assert float(pair.force(3e-3)) < 0 < float(pair.force(5e-3))


def test_one_sided_spring():
    """w^2 = 4 g/h0: 30.06 Hz at 1.1 mm; real discs of centimetre size stay below about 10 Hz."""
    law = M.DipoleMagnetSpring(weight=0.02 * G, floating_gap=1.1e-3)
    assert float(law.backbone(0.0, 0.02)) / (2 * np.pi) == pytest.approx(30.06, abs=5e-3)
    own = st.linear_response(M.one_sided_magnet.from_physical()).natural_frequencies
    assert own == pytest.approx([2 * np.sqrt(G / 1.1e-3)], rel=1e-12)
    for radius, thickness in ((5e-3, 3e-3), (5e-3, 10e-3), (10e-3, 5e-3)):
        spring = M.OneSidedMagnetSpring(M.DiscMagnet(radius, thickness, 1.2), mass=0.02)
        assert spring.natural_frequency / (2 * np.pi) < 10


def test_backbone_of_the_cubic_spring():
    """T = 4 K(mu)/sqrt(w1^2 + kap a^2), mu = kap a^2/(2 (w1^2 + kap a^2)); one harmonic: w^2 = w1^2 + 3/4 kap a^2."""
    k1, k3, m = 315.827, 1.9e7, 0.02
    spring = M.PowerLawSpring(k1=k1, kn=k3)
    w2, kap = k1 / m, k3 / m
    for a in (1e-3, 4e-3):
        stiff = w2 + kap * a**2
        exact = 2 * np.pi / (4 * ellipk(kap * a**2 / (2 * stiff)) / np.sqrt(stiff))
        assert float(spring.backbone(a, m)) == pytest.approx(exact, rel=1e-10)
    assert float(spring.backbone(1e-3, m)) == pytest.approx(np.sqrt(w2 + 0.75 * kap * 1e-6), rel=2e-3)
    softening = M.PowerLawSpring(k1=k1, kn=-k3)
    assert softening.escape == pytest.approx((-np.sqrt(k1 / k3), np.sqrt(k1 / k3)), rel=1e-12)


# ------------------------------------------------------------------------------------------------- sections 5 and 6
def test_first_tongue_formulas():
    """Small b: half width |b|/(2 w0), exponent |b|/(4 w0) at its centre, damped threshold |b| = 4 delta w0."""
    a, w0 = 1.44, 1.2
    for b in (1e-2, 1e-3):
        centre = st.monodromy(M.mathieu(a=a, b=b, Omega=2 * w0)).growth_rate
        assert centre == pytest.approx(b / (4 * w0), rel=b)
        edge = brentq(
            lambda Om, b=b: np.trace(st.monodromy(M.mathieu(a=a, b=b, Omega=Om)).matrix) + 2, 2 * w0, 2 * w0 + b
        )
        assert edge - 2 * w0 == pytest.approx(b / (2 * w0), rel=b)
    delta = 1e-3
    threshold = brentq(
        lambda b: st.monodromy(M.mathieu(a=a, b=b, Omega=2 * w0, delta=delta)).growth_rate, delta * w0, 8 * delta * w0
    )
    assert threshold == pytest.approx(4 * delta * w0, rel=1e-4)


@pytest.mark.parametrize("q", [0.02, 0.1])
def test_second_tongue_edges(q):
    """a_M from 4 - q^2/12 to 4 + 5 q^2/12."""
    assert float(st.mathieu_b(2, q)) == pytest.approx(4 - q**2 / 12, abs=q**4)
    assert float(st.mathieu_a(2, q)) == pytest.approx(4 + 5 * q**2 / 12, abs=q**4)


def test_damping_moves_stiffness_and_exponent():
    """q = exp(-delta t) x with a - delta^2: the exponent is that of the undamped equation less delta."""
    damped = st.monodromy(M.mathieu(a=1.0, b=0.4, Omega=2.0, delta=0.05)).growth_rate
    plain = st.monodromy(M.mathieu(a=1.0 - 0.05**2, b=0.4, Omega=2.0)).growth_rate
    assert damped == pytest.approx(plain - 0.05, abs=1e-12)


@pytest.mark.parametrize(("a", "b", "Omega"), [(1.0, 0.4, 2.0), (0.25, 0.1, 1.0), (3.0, 2.9, 1.1)])
def test_meissner_trace(a, b, Omega):
    p, r, T = np.sqrt(a + b), np.sqrt(a - b), 2 * np.pi / Omega
    trace = 2 * np.cos(p * T / 2) * np.cos(r * T / 2) - (p / r + r / p) * np.sin(p * T / 2) * np.sin(r * T / 2)
    found = np.trace(st.monodromy(M.meissner(a=a, b=b, Omega=Omega)).matrix)
    assert found == pytest.approx(trace, abs=1e-10)


def test_kapitza_threshold():
    """A w > sqrt(2 g l), epsilon Omega > sqrt(2), for small epsilon."""
    for epsilon, error in ((0.02, 3e-3), (0.005, 3e-4)):
        system = M.kapitza_pendulum(epsilon=epsilon, xi=0.0)
        limit = brentq(
            lambda Om, s=system: np.trace(st.monodromy(s, Omega=Om).matrix) - 2, 1.2 / epsilon, 1.6 / epsilon
        )
        assert epsilon * limit == pytest.approx(np.sqrt(2), rel=error)


# -------------------------------------------------------------------------------------------------------- section 7
def test_figure_11_at_25_hertz():
    """Three solutions at 25 Hz, 0.5 g: 0.562, 3.342, 3.718 mm; from rest the lower one is reached."""
    m, k1, k3, d, w = 0.02, 315.827, 1.9e7, 0.1365, 50 * np.pi
    h, detuned, lag = 0.75 * k3 / m, k1 / m - w**2, d * w / m
    squares = np.sort(np.roots([h**2, 2 * h * detuned, detuned**2 + lag**2, -((0.5 * G) ** 2)]).real)
    largest, phase, k = [], np.linspace(0, 2 * np.pi, 4000), np.arange(1, 8)[:, None]
    for a2 in squares:  # one harmonic, then seven
        amplitude = 500 * G / (detuned + h * a2 + 1j * lag)
        z = np.zeros(15)
        z[1], z[8] = amplitude.real, -amplitude.imag
        z = fsolve(balance, z, args=(25.0, 0.0), full_output=True)[0]
        assert np.abs(balance(z, 25.0, 0.0)).max() < 1e-8
        largest.append(np.abs(z[0] + z[1:8] @ np.cos(k * phase) + z[8:] @ np.sin(k * phase)).max())
    assert largest == pytest.approx([0.562, 3.342, 3.718], abs=6e-4)
    run = solve_ivp(
        M.duffing.from_physical(), (0, 2.0), [0, 0], method="DOP853", rtol=1e-8, atol=1e-12, dense_output=True
    )
    assert 1000 * np.abs(run.sol(np.linspace(1.8, 2.0, 1000))[0]).max() == pytest.approx(0.562, abs=2e-3)


# -------------------------------------------------------------------------------------------------------- section 9
PENDULUM = dict(xi1=0.021, xi2=0.021, mass_ratio_total=0.2, Omega0=0.5)


def test_figure_13_parameters():
    p = M.autoparametric_pendulum.from_physical().parameters
    w1 = 2 * np.pi * 22.22
    assert p["length"] == pytest.approx(G / (w1 / 2) ** 2, rel=1e-12)
    assert 0.2 * G / w1**2 == pytest.approx(0.10066e-3, rel=1e-4)
    assert p["length"] / (0.2 * G / w1**2) == pytest.approx(20.0, rel=1e-12)


def test_figure_13_pendulum_turns_over_after_seven_and_a_half_periods():
    system = M.autoparametric_pendulum(**{**PENDULUM, "length_ratio": 20.0, "Omega": 1.0})

    def upside_down(_, x):
        return abs(x[1]) - np.pi

    upside_down.terminal = True
    run = solve_ivp(
        system, (0, 10 * 2 * np.pi), [0, 0.01, 0, 0], method="DOP853", rtol=1e-9, atol=1e-11, events=upside_down
    )
    periods = run.t_events[0][0] / (2 * np.pi)
    assert periods == pytest.approx(7.526, abs=1e-3)
    assert periods / 22.22 == pytest.approx(0.339, abs=5e-4)


def test_semi_trivial_chart_has_the_threshold_at_its_tip_and_a_gap():
    """Charts about the linear response: tip of the principal tongue, and stability between 0.528 and 0.540 g."""
    system = M.autoparametric_pendulum.from_acceleration(**PENDULUM)
    low = st.chart(system, x=("Omega", 0.98, 1.02), y=("acceleration", 0.003, 0.005), about="linear", shape=(21, 21))
    (tip,) = low.tips
    assert (tip.x, tip.y, tip.kind) == (pytest.approx(0.99961, abs=2e-5), pytest.approx(0.0035240, abs=5e-8), "-1")

    def beyond(acceleration):
        point = st.monodromy(system, about="linear", Omega=1.0, acceleration=acceleration)
        return np.abs(point.multipliers).max() - 1

    edges = brentq(beyond, 0.520, 0.532), brentq(beyond, 0.532, 0.545)
    assert edges == pytest.approx((0.528, 0.540), abs=5e-4)
    inside = [st.monodromy(system, about="linear", Omega=1.0, acceleration=a) for a in (0.520, 0.545)]
    assert [str(p.kind) for p in inside] == ["-1", "+1"]


# ------------------------------------------------------------------------------------------------------- section 11
def harvester_power(load, inductance):
    """Mean power (mW) in the load at linear resonance, 20 Hz and 0.5 g."""
    coil = M.Coil(coupling=5.0, coil_resistance=50.0, load_resistance=load, inductance=inductance)
    system = M.harvester.from_physical(
        mass=0.02, stiffness=0.02 * (40 * np.pi) ** 2, damping=0.05, coil=coil, acceleration=0.5 * G
    )
    return 500 * load * abs(st.linear_response(system).frequency_response(20.0, "current")) ** 2


@pytest.mark.parametrize(("inductance", "load", "power"), [(0.0, 550.0, 21.8718), (0.01, 550.0014, 21.87181)])
def test_harvester_optimum(inductance, load, power):
    best = minimize_scalar(lambda x: -harvester_power(x, inductance), bracket=(500, 550, 600), tol=1e-12)
    slope = brentq(
        lambda x: harvester_power(x + 0.5, inductance) - harvester_power(x - 0.5, inductance), 540, 560, xtol=1e-9
    )
    assert slope == pytest.approx(load, abs=3e-3 if inductance == 0 else 1e-3)
    assert -best.fun == pytest.approx(power, abs=5e-5 if inductance == 0 else 5e-6)
    if inductance == 0:
        k2d = 25 / 0.05
        closed = 1000 * (0.02 * 0.5 * G) ** 2 / (8 * 0.05) * k2d / (50 + k2d)
        assert -best.fun == pytest.approx(closed, rel=1e-12) and 50 + k2d == load
