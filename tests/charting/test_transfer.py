"""Linear response. Witnesses: closed forms of the catalogue, direct complex solves by hand, time integration."""

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, EquationError, InputError, UnknownNameError

s = sp.Symbol("s")


def chain_by_hand(Om, xi1, xi2, lam, Om0, damper2="relative"):
    """Catalogue 4: complex 2 x 2 solve of the equations of motion for the base motion cos(Om tau)."""
    c12 = 2 * xi2 * Om0 * lam if damper2 == "relative" else 0.0
    c21 = -2 * xi2 * Om0 if damper2 == "relative" else 0.0
    C = np.array([[2 * xi1 + c12, -c12], [c21, 2 * xi2 * Om0]])
    K = np.array([[1 + lam * Om0**2, -lam * Om0**2], [-(Om0**2), Om0**2]])
    return np.linalg.solve(K - Om**2 * np.eye(2) + 1j * Om * C, Om**2 * np.ones(2))


def test_oscillator_has_the_corrected_sign_and_peak():
    response = st.linear_response(st.models.linear_oscillator(xi=0.021))
    xi = sp.Symbol("xi", real=True)
    assert sp.simplify(response.transfer("u") + s**2 / (1 + 2 * xi * s + s**2)) == 0
    ((where, height),) = response.peaks("u")
    assert where == pytest.approx(1 / np.sqrt(1 - 2 * 0.021**2), rel=1e-12)
    assert height == pytest.approx(1 / (2 * 0.021 * np.sqrt(1 - 0.021**2)), rel=1e-12)
    assert (round(where, 6), round(height, 4)) == (1.000441, 23.8148)


def test_transmissibility_of_the_absolute_motion():
    xi = 0.1
    response = st.linear_response(st.models.linear_oscillator(xi=xi))
    Om = np.array([0.3, 1.0, np.sqrt(2), 4.0])
    expected = (1 + 2j * xi * Om) / (1 - Om**2 + 2j * xi * Om)
    assert response.frequency_response(Om, "u_absolute") == pytest.approx(expected, rel=1e-13)
    ((where, _),) = response.peaks("u_absolute")
    assert where**2 == pytest.approx((np.sqrt(1 + 8 * xi**2) - 1) / (4 * xi**2), rel=1e-10)


def test_no_peak_beyond_critical_damping():
    assert st.linear_response(st.models.linear_oscillator(xi=0.75)).peaks("u") == []


@pytest.mark.parametrize("damper2", ["relative", "base"])
@pytest.mark.parametrize("lam", [0.42, 0.5])
@pytest.mark.parametrize("Omega0", [1.0, 5.0])
def test_chain_against_a_complex_solve_by_hand(damper2, lam, Omega0):
    response = st.linear_response(st.models.chain(mass_ratio_21=lam, Omega0=Omega0, damper2=damper2))
    Om = np.linspace(0.1, 8.0, 41)
    hand = np.array([chain_by_hand(w, 0.021, 0.021, lam, Omega0, damper2) for w in Om])
    for k, name in enumerate("uv"):
        assert response.frequency_response(Om, name) == pytest.approx(hand[:, k], rel=1e-12, abs=1e-13)
        own = {sp.Symbol(n, real=True): v for n, v in response.system.parameters.items()}
        symbolic = sp.lambdify(s, response.transfer(name).subs(own))(1j * Om)
        assert symbolic == pytest.approx(hand[:, k], rel=1e-10, abs=1e-12)


def test_chain_transfer_functions_are_those_of_the_catalogue():
    x1, x2, lam, W0 = sp.symbols("xi1 xi2 mass_ratio_21 Omega0", real=True)
    D = (
        s**4 + 2 * (x1 + x2 * W0 * (1 + lam)) * s**3 + (1 + W0**2 * (1 + lam) + 4 * x1 * x2 * W0) * s**2
        + 2 * (x1 * W0**2 + x2 * W0) * s + W0**2
    )  # fmt: skip
    U = -(s**2) * (s**2 + 2 * x2 * W0 * (1 + lam) * s + W0**2 * (1 + lam)) / D
    V = -(s**2) * (s**2 + 2 * (x1 + x2 * W0 * (1 + lam)) * s + 1 + W0**2 * (1 + lam)) / D
    response = st.linear_response(st.models.chain())
    assert sp.simplify(response.transfer("u") - U) == 0
    assert sp.simplify(response.transfer("v") - V) == 0


@pytest.mark.parametrize(
    ("lam", "Omega0", "name", "expected"),
    [
        (0.5, 1.0, "u", [(0.7072, 22.45), (1.4218, 5.79)]),
        (0.5, 1.0, "v", [(0.7073, 44.90), (1.4029, 6.06)]),
        (0.5, 5.0, "u", [(0.8131, 29.24), (6.342, 1.083)]),
        (0.42, 1.0, "u", [(0.727, 21.4), (1.375, 6.2)]),
    ],
)
def test_chain_peaks_of_the_catalogue(lam, Omega0, name, expected):  # for 0.42 it gives the undamped frequencies
    peaks = st.linear_response(st.models.chain(mass_ratio_21=lam, Omega0=Omega0)).peaks(name)
    assert len(peaks) == len(expected)
    for (where, height), (catalogue_where, catalogue_height) in zip(peaks, expected):
        assert where == pytest.approx(catalogue_where, abs=1e-2 if lam == 0.42 else 6e-4 * Omega0)
        assert height == pytest.approx(catalogue_height, rel=8e-3)


def test_undamped_frequencies_and_shapes_of_the_chain():
    response = st.linear_response(st.models.chain(xi1=0.0, xi2=0.0))
    squares = response.natural_frequencies**2
    assert squares.sum() == pytest.approx(2.5, rel=1e-13)
    assert squares.prod() == pytest.approx(1.0, rel=1e-13)
    assert np.abs(response.mode_shapes.real[0] / response.mode_shapes.real[1]) == pytest.approx([0.5, 1.0], rel=1e-12)
    assert response.damping_ratios == pytest.approx([0, 0], abs=1e-14)


def test_static_positions_under_gravity():
    chain = st.linear_response(st.models.chain(gravity=0.3, Omega0=1.5))
    assert chain.equilibrium["u"] == pytest.approx(-1.5 * 0.3, rel=1e-14)
    assert chain.equilibrium["v"] == pytest.approx(-1.5 * 0.3 - 0.3 / 1.5**2, rel=1e-14)
    plain = st.linear_response(st.models.chain(Omega0=1.5))
    assert chain.frequency_response(0.7, "u") == pytest.approx(plain.frequency_response(0.7, "u"), rel=1e-14)


def test_gravity_stiffens_the_duffing_oscillator():
    response = st.linear_response(st.models.duffing(beta=0.01, gravity=2.0))
    u = response.equilibrium["u"]
    assert u + 0.01 * u**3 + 2.0 == pytest.approx(0.0, abs=1e-13)
    assert response.natural_frequencies[0] ** 2 == pytest.approx(1 + 3 * 0.01 * u**2, rel=1e-12)


def test_harvester_load_and_power():
    def power(load, inductance):
        coil = st.models.Coil(coupling=5.0, coil_resistance=50.0, load_resistance=load, inductance=inductance)
        k = 0.02 * (2 * np.pi * 20.0) ** 2
        system = st.models.harvester.from_physical(stiffness=k, damping=0.05, acceleration=4.905, coil=coil)
        current = abs(st.linear_response(system).frequency_response(20.0, "current"))
        return 1000 * load * current**2 / 2

    assert power(550.0, 0.0) == pytest.approx(21.8718, abs=5e-5)
    assert power(550.0014, 0.01) == pytest.approx(21.87181, abs=5e-6)
    from scipy.optimize import minimize_scalar

    best = minimize_scalar(lambda load: -power(load, 0.0), bracket=(400, 550, 700), tol=1e-10)
    assert best.x == pytest.approx(550.0, abs=1e-2)


def test_power_balance_closes():
    system = st.models.harvester.from_physical(acceleration=4.905, frequency=19.0)
    response = st.linear_response(system)
    p, w = system.parameters, 2 * np.pi * 19.0
    velocity, current = (response.frequency_response(19.0, n) for n in ("y_dot", "i"))
    supplied = p["mass"] * 4.905 * velocity.real / 2
    lost = p["damping"] * abs(velocity) ** 2 / 2 + (50.0 + 550.0) * abs(current) ** 2 / 2
    assert supplied == pytest.approx(lost, rel=1e-10)
    assert abs(velocity) == pytest.approx(w * abs(response.frequency_response(19.0, "y")), rel=1e-12)


def test_periodic_base_motion_against_time_integration():
    from scipy.integrate import solve_ivp

    xi, W = 0.1, 0.4
    response = st.linear_response(st.models.linear_oscillator(xi=xi))
    steady = response.periodic({1: 1.0, 3: 0.3 - 0.2j}, W, "u")

    def load(time):  # -y0'' of the same base motion
        return sum(((k * W) ** 2 * c * np.exp(1j * k * W * time)).real for k, c in ((1, 1.0), (3, 0.3 - 0.2j)))

    end = 40 * 2 * np.pi / W
    times = end + np.linspace(0, 2 * np.pi / W, 7)
    sim = solve_ivp(
        lambda time, x: [x[1], -2 * xi * x[1] - x[0] + load(time)],
        (0, times[-1]),
        [0, 0],
        t_eval=times,
        rtol=1e-10,
        atol=1e-12,
    )
    assert sim.y[0] == pytest.approx(steady(times), abs=1e-7)


def test_constant_acceleration_response_in_millimetres():
    system = st.models.linear_oscillator.from_physical(acceleration=4.905)
    w1, xi = np.sqrt(315.827 / 0.02), 0.1056 / (2 * 0.02 * np.sqrt(315.827 / 0.02))
    Om = 2 * np.pi * 18.0 / w1
    expected = 1000 * 4.905 / w1**2 / (1 - Om**2 + 2j * xi * Om)
    assert st.linear_response(system).frequency_response(18.0, "y_mm") == pytest.approx(expected, rel=1e-12)


def test_autonomous_systems_have_poles_only():
    assert st.linear_response(st.models.van_der_pol()).poles == pytest.approx(
        [0.5 + 0.75**0.5 * 1j, 0.5 - 0.75**0.5 * 1j]
    )
    rho = 470 / 19
    fixed = st.linear_response(st.models.lorenz(rho=rho), about=dict(x=7.9, y=7.9, z=rho - 1))
    assert np.sort(fixed.poles.real)[1:] == pytest.approx([0, 0], abs=1e-10)  # Hopf at 470/19


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: st.linear_response(st.models.mathieu()), EquationError, "periodic coefficients"),
        (lambda: st.linear_response(st.models.lorenz()).transfer("x"), InputError, "no harmonic excitation"),
        (lambda: st.linear_response(st.models.linear_oscillator()).transfer("v"), UnknownNameError, "no output 'v'"),
        (lambda: st.linear_response(st.models.linear_oscillator(), zeta=0.1), UnknownNameError, "zeta"),
        (lambda: st.linear_response(st.System.from_function(lambda t, x: -x, "x")), EquationError, "Python function"),
        (lambda: st.linear_response(st.models.linear_oscillator()).frequency_response(np.nan, "u"), InputError, "finite"),
        (lambda: st.linear_response(st.models.linear_oscillator()).periodic([0, 1], 0.1, "w"), UnknownNameError, "w"),
        (lambda: st.linear_response(st.models.linear_oscillator()).plot("u", [1.0], kind="nyquist"), InputError, "kind"),
    ],
)  # fmt: skip
def test_bad_input(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_no_equilibrium_is_a_typed_error():
    t = sp.Symbol("t")
    x = sp.Function("x")(t)
    runaway = st.System.from_equations({x.diff(t, 2): 1 + x**2}, [x])
    with pytest.raises(ConvergenceError):
        st.linear_response(runaway, about=dict(x=0.3))


def test_plot_takes_axes():
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    response = st.linear_response(st.models.chain())
    figure, axes = plt.subplots(2, 1)
    lines = response.plot(["u", "v"], np.linspace(0.1, 2, 50), kind="bode", ax=axes)
    assert {line.axes for line in lines} == set(axes) and len(lines) == 4
    assert lines[0].get_ydata() == pytest.approx(np.abs(response.frequency_response(np.linspace(0.1, 2, 50), "u")))
    plt.close(figure)


def test_rest_of_a_spring_with_its_kink_at_zero():
    response = st.linear_response(st.models.unilateral_spring.from_physical())
    y = response.equilibrium["y"]
    assert 315.827 * y + 1.9e7 * y**3 == pytest.approx(-0.02 * 9.81, rel=1e-12)
    assert response.natural_frequencies[0] ** 2 == pytest.approx((315.827 + 3 * 1.9e7 * y**2) / 0.02, rel=1e-3)
