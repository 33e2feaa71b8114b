"""SI units and dimensionless forms give the same motion; energy balances close; impossible parameters are refused.

Witness: the scales t = tau/w1, q = L u applied by hand to two separate integrations (DOP853, rtol 1e-12); the first law:
stored energy = supplied - dissipated - delivered, with the powers integrated along.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stability as st
from stability.errors import InputError, StabilityError, UnknownNameError

M = st.models
G = 9.81
A = 2e-4  # base amplitude, m


def end_state(system, x0, end):
    return solve_ivp(system, (0, end), x0, method="DOP853", rtol=1e-12, atol=1e-18).y[:, -1]


def same_motion(physical, scaled, x0, lengths, w1, periods=3.0):
    """Integrate both from the same start and compare in SI units, relative to each state's scale."""
    end = periods * physical.period
    scale = np.array([L * (w1 if name.endswith("_dot") else 1) for name, L in zip(physical.states, lengths)])
    one = end_state(physical, np.asarray(x0) * scale, end)
    two = end_state(scaled, x0, w1 * end) * scale
    assert scaled.period / w1 == pytest.approx(physical.period, rel=1e-12)
    assert np.abs((one - two) / scale).max() < 1e-10 * max(1.0, np.abs(two / scale).max())


@pytest.mark.parametrize("gravity", [False, True])
def test_linear_and_cubic_oscillator(gravity):
    m, k, d, k3, f = 0.02, 315.827, 0.1365, 1.9e7, 21.0
    w1 = np.sqrt(k / m)
    groups = dict(xi=d / (2 * m * w1), Omega=2 * np.pi * f / w1, gravity=gravity * G / (A * w1**2))
    shared = dict(mass=m, stiffness=k, damping=d, amplitude=A, frequency=f, gravity=gravity)
    linear = M.linear_oscillator.from_physical(**shared)
    same_motion(linear, M.linear_oscillator(**groups), [1.5, -0.4], (A, A), w1)
    duffing = M.duffing.from_physical(cubic=k3, **shared)
    same_motion(duffing, M.duffing(beta=k3 * A**2 / k, **groups), [1.5, -0.4], (A, A), w1)


@pytest.mark.parametrize("damper2", ["relative", "base"])
def test_cubic_chain(damper2):
    m, k, d, k3, f = (0.02, 0.01), (571.22, 400.0), (0.14, 0.08), (4e7, 2e7), 23.0
    w1, w2 = np.sqrt(k[0] / m[0]), np.sqrt(k[1] / m[1])
    physical = M.chain.from_physical(
        mass1=m[0], mass2=m[1], stiffness1=k[0], stiffness2=k[1], damping1=d[0], damping2=d[1],
        cubic1=k3[0], cubic2=k3[1], amplitude=A, frequency=f, gravity=True, damper2=damper2,
    )  # fmt: skip
    scaled = M.chain(
        xi1=d[0] / (2 * m[0] * w1), xi2=d[1] / (2 * m[1] * w2), mass_ratio_21=m[1] / m[0], Omega0=w2 / w1,
        beta1=k3[0] * A**2 / (m[0] * w1**2), beta2=k3[1] * A**2 / (m[1] * w1**2),
        Omega=2 * np.pi * f / w1, gravity=G / (A * w1**2), damper2=damper2,
    )  # fmt: skip
    same_motion(physical, scaled, [1.0, -0.5, 0.2, 0.3], (A,) * 4, w1)


def test_autoparametric_pendulum():
    m1, m2, k, d, length, D, f = 0.04, 0.01, 974.0, 0.29, 2.0132e-3, 1.19e-7, 22.22
    m = m1 + m2
    w1, w2 = np.sqrt(k / m), np.sqrt(G / length)
    physical = M.autoparametric_pendulum.from_physical(
        mass1=m1, mass2=m2, stiffness=k, damping=d, length=length, pendulum_damping=D, amplitude=A, frequency=f
    )
    groups = dict(
        xi1=d / (2 * m * w1), xi2=D / (2 * m2 * length**2 * w2), mass_ratio_total=m2 / m, Omega0=w2 / w1,
        Omega=2 * np.pi * f / w1,
    )  # fmt: skip
    x0, lengths = [0.5, 0.8, 0.0, -0.2], (A, 1.0, A, 1.0)
    same_motion(physical, M.autoparametric_pendulum(length_ratio=length / A, **groups), x0, lengths, w1)
    acceleration = A * (2 * np.pi * f) ** 2 / G
    by_acceleration = M.autoparametric_pendulum.from_acceleration(acceleration=acceleration, **groups)
    same_motion(physical, by_acceleration, x0, lengths, w1)


def test_base_driven_pendulum():
    length, m, D, f = 0.1081, 0.01, 2e-5, 2.9
    w2 = np.sqrt(G / length)
    physical = M.base_driven_pendulum.from_physical(length=length, mass=m, damping=D, amplitude=0.01, frequency=f)
    scaled = M.base_driven_pendulum(epsilon=0.01 / length, Omega=2 * np.pi * f / w2, xi=D / (2 * m * length**2 * w2))
    same_motion(physical, scaled, [0.9, 0.1], (1.0, 1.0), w2)


def test_one_sided_springs():
    h0, m, d, f = 1.1e-3, 0.02, 0.4, 20.0
    w0 = 2 * np.sqrt(G / h0)
    physical = M.one_sided_magnet.from_physical(mass=m, gap=h0, damping=d, acceleration=2.0, frequency=f)
    scaled = M.one_sided_magnet(xi=d / (2 * m * w0), acceleration=2.0 / G, Omega=2 * np.pi * f / w0)
    same_motion(physical, scaled, [0.2, 0.1], (h0, h0), w0)
    k, k3, w1 = 315.827, 1.9e7, np.sqrt(315.827 / m)
    contact = M.unilateral_spring.from_physical(mass=m, stiffness=k, cubic=k3, damping=d, amplitude=A, frequency=f)
    scaled = M.unilateral_spring(
        xi=d / (2 * m * w1), beta=k3 * A**2 / k, Omega=2 * np.pi * f / w1, gravity=G / (A * w1**2)
    )
    same_motion(contact, scaled, [-6.0, 0.0], (A, A), w1, periods=1.0)  # a few contacts: kinks limit the integrator


def test_harvester():
    m, k, d, k3, f, kem, R, Lc = 0.02, 315.827, 0.05, 5e6, 21.0, 5.0, 600.0, 0.6
    w1, X = np.sqrt(k / m), 1e-3
    coil = M.Coil(coupling=kem, coil_resistance=50.0, load_resistance=550.0, inductance=Lc)
    physical = M.harvester.from_physical(
        mass=m, stiffness=k, cubic=k3, damping=d, coil=coil, acceleration=4.905, frequency=f
    )
    scaled = M.harvester(
        xi=d / (2 * m * w1), beta=k3 * X**2 / k, theta=kem**2 / (R * m * w1), lam=w1 * Lc / R,
        f=4.905 / (X * w1**2), Omega=2 * np.pi * f / w1,
    )  # fmt: skip
    current = kem * w1 * X / R
    assert physical.states == ("y", "i", "y_dot") and scaled.states == ("u", "j", "u_dot")
    same_motion(physical, scaled, [0.5, 0.2, 0.3], (X, current, X), w1)


# ---------------------------------------------------------------------------------------------------- energy balance
def balanced(system, x0, stored, rates, periods=4):
    """Stored energy gained against the integral of the net power, relative to the energy that went through."""
    n = system.n

    def extended(t, z):
        return [*system(t, z[:n]), *rates(t, z[:n])]

    start = np.concatenate((x0, np.zeros(2)))
    run = solve_ivp(extended, (0, periods * system.period), start, method="DOP853", rtol=1e-12, atol=1e-18)
    supplied, lost = run.y[n:, -1]
    gained = stored(run.y[:n, -1]) - stored(np.asarray(x0))
    assert gained == pytest.approx(supplied - lost, abs=1e-10 * (abs(supplied) + lost + abs(gained)))
    assert lost > 0


@pytest.mark.parametrize("coupling", ["constant", "position"])
def test_power_balance_of_the_nonlinear_harvester(coupling):
    """d/dt(m v^2/2 + U + L i^2/2) = -m y0'' v - d v^2 - (R_c + R_l) i^2, also for k_em(y)."""
    kem = 5.0 if coupling == "constant" else (lambda q: 5.0 * (1 - 4e4 * q**2))
    coil = M.Coil(coupling=kem, coil_resistance=50.0, load_resistance=550.0, inductance=1.0)
    system = M.duffing.from_physical(acceleration=4.905, frequency=22.0, coil=coil)
    m, k, k3, d, w = 0.02, 315.827, 1.9e7, 0.1365, 44 * np.pi

    def stored(x):
        y, i, v = x
        return m * v**2 / 2 + k * y**2 / 2 + k3 * y**4 / 4 + 1.0 * i**2 / 2

    def rates(t, x):
        _, i, v = x
        return m * 4.905 * np.cos(w * t) * v, d * v**2 + 600.0 * i**2

    balanced(system, [1e-3, 1e-4, 0.05], stored, rates)


def test_power_balance_of_the_pendulum_on_a_spring():
    """In the moving frame the base works on both masses: power m A w^2 cos (y') + m2 l A w^2 cos sin(phi) phi'."""
    system = M.autoparametric_pendulum.from_physical(amplitude=A)
    p = system.parameters
    m1, m2, k, d, l0, D = (p[n] for n in ("mass1", "mass2", "stiffness", "damping", "length", "pendulum_damping"))
    w = 2 * np.pi * p["frequency"]

    def stored(x):
        y, phi, v, s = x
        kinetic = (m1 + m2) * v**2 / 2 + m2 * l0 * np.sin(phi) * s * v + m2 * l0**2 * s**2 / 2
        return kinetic + k * y**2 / 2 - m2 * G * l0 * np.cos(phi)

    def rates(t, x):
        _, phi, v, s = x
        load = A * w**2 * np.cos(w * t)
        return load * ((m1 + m2) * v + m2 * l0 * np.sin(phi) * s), d * v**2 + D * s**2

    balanced(system, [2e-4, 0.7, 0.0, 5.0], stored, rates)


def test_mean_power_of_the_linear_harvester():
    """mean(-m y0'' y') = mean(d y'^2 + (R_c + R_l) i^2) in the steady state, at any frequency."""
    for f in (12.0, 20.0, 31.0):
        response = st.linear_response(M.harvester.from_physical(acceleration=4.905, frequency=f))
        v, i = (response.frequency_response(f, n) for n in ("y_dot", "i"))
        supplied = 0.02 * 4.905 * v.real / 2
        assert supplied == pytest.approx(0.05 * abs(v) ** 2 / 2 + 600.0 * abs(i) ** 2 / 2, rel=1e-10)


@pytest.mark.parametrize(("model", "gap"), [("soft_stop_oscillator", 1.0)])
def test_soft_stops_without_damping_keep_the_energy(model, gap):
    system = getattr(M, model)(xi=0.0, gap=gap, kappa=10.0, eta=0.0, Omega=1e-6)  # no load to speak of
    run = solve_ivp(system, (0, 30), [1.5, 0.0], method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.05)
    u, v = run.y
    energy = (u**2 + v**2) / 2 + 10.0 * np.maximum(np.abs(u) - gap, 0) ** 2 / 2
    assert energy == pytest.approx(np.full_like(energy, energy[0]), rel=1e-7)


# ------------------------------------------------------------------------------------------------- units and ranges
DISC = M.DiscMagnet(5e-3, 3e-3, 1.2)
REFUSED = {
    "negative mass": lambda: M.duffing.from_physical(mass=-0.02),
    "no mass": lambda: M.linear_oscillator.from_physical(mass=0.0),
    "mass not a number": lambda: M.duffing.from_physical(mass=math.nan),
    "negative second mass": lambda: M.chain.from_physical(mass2=-0.01),
    "negative pendulum mass": lambda: M.autoparametric_pendulum.from_physical(mass2=-0.01),
    "mass set later": lambda: M.duffing.from_physical().with_params(mass=-1.0),
    "negative mass of the shaft": lambda: M.rotating_shaft(mass=-1.0),
    "absorber of negative mass": lambda: M.nonlinear_absorber(epsilon=-0.1),
    "mass ratio one": lambda: M.autoparametric_pendulum(mass_ratio_total=1.0),
    "negative mass ratio": lambda: M.chain(mass_ratio_21=-0.5),
    "no length": lambda: M.base_driven_pendulum.from_physical(length=0.0),
    "no pendulum length": lambda: M.autoparametric_pendulum.from_physical(length=0.0),
    "no length ratio": lambda: M.autoparametric_pendulum(length_ratio=0.0),
    "string without length": lambda: M.modulated_string(half_length=0.0),
    "length that passes through zero": lambda: M.variable_length_pendulum(epsilon=1.0),
    "capacitor that passes through infinity": lambda: M.capacitance_modulated_circuit(epsilon=1.2),
    "coil that passes through zero": lambda: M.inductance_modulated_circuit(epsilon=1.0),
    "no inductance": lambda: M.resistance_modulated_circuit(inductance=0.0),
    "touching gap": lambda: M.LevitatedMagnetSpring(DISC, gap=0.0),
    "touching magnets": lambda: M.MagnetPair(DISC, DISC).force(0.0),
    "overlapping magnets": lambda: M.MagnetPair(DISC, DISC).force(-1e-3),
    "no floating gap": lambda: M.one_sided_magnet.from_physical(gap=0.0),
    "stops that touch at rest": lambda: M.soft_stop_oscillator(gap=0.0),
    "stops behind rest": lambda: M.hard_stop_oscillator(gap=-1.0),
    "stops that give energy": lambda: M.hard_stop_oscillator(restitution=1.2),
    "negative damping": lambda: M.duffing.from_physical(damping=-0.1),
    "no stiffness": lambda: M.linear_oscillator.from_physical(stiffness=0.0),
    "infinite stiffness": lambda: M.duffing.from_physical(cubic=math.inf),
    "no frequency": lambda: M.duffing.from_physical(frequency=0.0),
    "frequency ratio zero": lambda: M.mathieu(Omega=0.0),
    "two excitations": lambda: M.duffing.from_physical(amplitude=1e-3, acceleration=4.9),
    "negative resistance of the load": lambda: M.Coil(load_resistance=-1.0),
    "no time constant": lambda: M.harvester(lam=0.0),
    "damper that does not exist": lambda: M.chain(damper2="both"),
    "ring without wall": lambda: M.RingMagnet(5e-3, 4e-3, 1e-3, 1.2),
    "negative radius": lambda: M.DiscMagnet(-1e-3, 1e-3, 1.2),
}


@pytest.mark.parametrize("case", REFUSED)
def test_impossible_parameters_are_refused(case):
    with pytest.raises(InputError) as caught:
        REFUSED[case]()
    assert isinstance(caught.value, StabilityError) and isinstance(caught.value, ValueError)
    assert len(str(caught.value)) > 20


def test_misspelt_parameters_propose_the_nearest():
    with pytest.raises(UnknownNameError, match=r"did you mean .stiffness"):
        M.duffing.from_physical(stifness=300.0)


def test_units_are_those_of_the_docstrings():
    for name, model in M.catalogue().items():
        if "from_physical" in model.constructors:
            units = model.from_physical().units
            missing = [p for p in model.from_physical().parameters if p not in units]
            assert not missing, (name, missing)
