"""Errata of severity B and C: incomplete formulas, conventions, statements that hold only under conditions.

Witness: sympy, closed forms, energy balance, harmonic balance written out in this file.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from by_hand import coordinate, lagrange, real, t, vanishes
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve, minimize_scalar

import stability as st

M = st.models
G = 9.81


# ------------------------------------------------------------------------------------------------- (1), (2), (3)-(6)
def test_2_derivative_by_the_velocity():
    """Printed d/dt(dL/dq) - dL/dq = Q has no acceleration in it at all."""
    m, k = real("m k")
    y = coordinate("y")
    L = m * y.diff(t) ** 2 / 2 - k * y**2 / 2
    printed = sp.diff(sp.diff(L, y), t) - sp.diff(L, y)
    assert not printed.has(y.diff(t, 2))
    (ours,) = st.equations_of_motion(L, [y])
    assert sp.expand(ours.lhs - ours.rhs - m * y.diff(t, 2) - k * y) == 0
    assert (
        sp.expand(next(iter(lagrange(m * y.diff(t) ** 2 / 2, k * y**2 / 2, [y]).values())) - ours.lhs + ours.rhs) == 0
    )


def test_1_the_lagrangian_collects_the_conservative_part():
    """T and U alone keep the energy; R alone removes it at the rate 2 R."""
    m, k, d = real("m k d")
    y = coordinate("y")
    energy = m * y.diff(t) ** 2 / 2 + k * y**2 / 2
    L, R = m * y.diff(t) ** 2 / 2 - k * y**2 / 2, d * y.diff(t) ** 2 / 2
    for dissipation in (0, R):
        (e,) = st.equations_of_motion(L, [y], dissipation=dissipation)
        acceleration = sp.solve(e, y.diff(t, 2))[0]
        rate = energy.diff(t).subs(y.diff(t, 2), acceleration)
        assert sp.simplify(rate + 2 * dissipation) == 0


def test_4_and_6_inner_forms():
    q, s, k1, kn, n = sp.symbols("q s k1 kn n", positive=True)
    energy = sp.integrate(k1 * q + kn * q**n, (q, 0, s))
    right = k1 * s**2 / 2 + kn * s ** (n + 1) / (n + 1)
    assert sp.simplify(energy - right) == 0
    printed_4 = k1 / 2 + kn / (1 + n) * s ** (1 + n)  # q^2 is missing
    printed_6 = k1 * s**2 / 2 + kn / (1 + n) * kn * s ** (1 + n)  # k_n twice
    assert sp.simplify(energy - printed_4) != 0 and sp.simplify(energy - printed_6) != 0
    for motion in ("translation", "rotation"):
        spring = M.PowerLawSpring(k1=3.0, kn=0.7, n=3, motion=motion)
        assert float(spring.energy(1.2)) == pytest.approx(3 * 1.2**2 / 2 + 0.7 * 1.2**4 / 4, rel=1e-14)


@pytest.mark.parametrize("n", [0.5, 1.5, 2.5])
def test_3_to_6_negative_displacement_needs_the_sign(n):
    """q^n is complex for q < 0 and non-integer n; the library's law is odd and real, with an even energy."""
    assert isinstance((-0.8) ** n, complex)
    spring = M.PowerLawSpring(k1=3.0, kn=0.7, n=n)
    assert spring.odd
    assert float(spring.force(-0.8)) == pytest.approx(-3 * 0.8 - 0.7 * 0.8**n, rel=1e-14)
    assert float(spring.energy(-0.8)) == pytest.approx(3 * 0.32 + 0.7 * 0.8 ** (n + 1) / (n + 1), rel=1e-14)


@pytest.mark.parametrize("n", [2, 4])
def test_3_even_powers_are_unsymmetric(n):
    spring = M.PowerLawSpring(k1=3.0, kn=0.7, n=n)
    assert not spring.odd and float(spring.force(-0.5)) != -float(spring.force(0.5))


@pytest.mark.parametrize("k2", [-4e3, 4e3])
@pytest.mark.parametrize("k3", [0.0, 2e5])
def test_figure_1_hardening_and_softening(k2, k3):
    """A quadratic term softens for either sign: w = w1 + (3 k3/(8 m w1) - 5 k2^2/(12 m^2 w1^3)) a^2 (Lindstedt)."""
    k1, m = 200.0, 0.02
    spring = M.PolynomialSpring((0.0, k1, k2, k3))
    w1 = np.sqrt(k1 / m)
    slope = 3 * k3 / (8 * m * w1) - 5 * k2**2 / (12 * m**2 * w1**3)
    for a in (1e-3, 5e-4):
        exact = float(spring.backbone(a, m))
        # the amplitude of Lindstedt's series is half the peak-to-peak value up to second order
        assert exact - w1 == pytest.approx(slope * a**2, rel=0.2 * a / 1e-3)
    assert float(M.PowerLawSpring(k1=k1, kn=k2, n=2).backbone(1e-3, m)) < w1


def test_figure_2_closing_integrals():
    """Zero round closed paths and, for odd forces, over [-s, s]; not for an unsymmetric spring."""
    s = 2e-3
    odd, unsymmetric = M.PowerLawSpring(k1=190.0, kn=1e6), M.PolynomialSpring((0.0, 190.0, 2e4))
    for spring in (odd, unsymmetric):
        assert spring.work([-s, s, 0.5 * s, -s]) == pytest.approx(0.0, abs=1e-15)
    assert odd.work([-s, s]) == pytest.approx(0.0, abs=1e-15)
    assert unsymmetric.work([-s, s]) == pytest.approx(2e4 * 2 * s**3 / 3, rel=1e-12)
    turn = M.RotationalMagneticSpring({1: 4e-3, 2: 1e-2, 4: -1e-3}, phases={1: 0.3})
    assert turn.work([0.2, 0.2 + 2 * np.pi]) == pytest.approx(0.0, abs=1e-2 * 1e-13)
    assert abs(turn.work([0.2, 0.2 + np.pi])) > 1e-3


def test_45_exponent_is_three():
    q = sp.Symbol("q", real=True)
    k1, k3 = 3.0, 0.7
    for n, fits in ((2, False), (3, True)):
        energy = M.PowerLawSpring(k1=k1, kn=k3, n=n).energy_expression(q)
        assert vanishes(sp.nsimplify(energy) - sp.nsimplify(k1 * q**2 / 2 + k3 * q**4 / 4)) is fits


# ------------------------------------------------------------------------------------------------ (14)-(22), (29)...
def test_14_29_49_61_one_sign_convention():
    """The generalised force of the base is -m y0''; all final equations agree with it: T(y + y0) and Q give the same."""
    m, d, k, A, w = real("m d k A w")
    y = coordinate("y")
    y0 = A * sp.cos(w * t)
    R = d * y.diff(t) ** 2 / 2
    inertial = lagrange(m * (y + y0).diff(t) ** 2 / 2, k * y**2 / 2, [y], R=R)[y]
    L = m * y.diff(t) ** 2 / 2 - k * y**2 / 2
    for sign, holds in ((-1, True), (1, False)):
        (e,) = st.equations_of_motion(L, [y], dissipation=R, forces={y: sign * m * y0.diff(t, 2)})
        assert (sp.expand((e.lhs - e.rhs - inertial).doit()) == 0) is holds


def test_22_right_side_is_transformed():
    """-L{d2/dtau2 cos} = -s^2 L{cos} + s with zero initial data of u; the transfer function keeps -s^2."""
    tau, Om, s = sp.symbols("tau Omega s", positive=True)
    transformed = -sp.laplace_transform(sp.cos(Om * tau).diff(tau, 2), tau, s, noconds=True)
    cosine = sp.laplace_transform(sp.cos(Om * tau), tau, s, noconds=True)
    assert sp.simplify(transformed - (-(s**2) * cosine + s)) == 0
    numerator = st.linear_response(M.linear_oscillator()).transfer("u") * (1 + 2 * real("xi") * s + s**2)
    assert sp.simplify(numerator.subs(sp.Symbol("s"), s) + s**2) == 0


def test_19_20_gravity_can_be_dropped_for_linear_springs_only():
    """About u_s: x'' + 2 xi x' + (1 + 3 beta u_s^2) x + 3 beta u_s x^2 + beta x^3 = Omega^2 cos."""
    u, v, beta, rho, xi, Om = real("u u_dot beta gravity xi Omega")
    x, u_s = real("x u_s")
    f = M.duffing().rhs[1]
    moved = sp.expand(f.subs(u, x + u_s).subs(rho, -u_s - beta * u_s**3))
    expected = -2 * xi * v - (1 + 3 * beta * u_s**2) * x - 3 * beta * u_s * x**2 - beta * x**3 + Om**2 * sp.cos(Om * t)
    assert sp.expand(moved - expected) == 0
    dropped = sp.expand(moved - f.subs({u: x, rho: 0}))
    assert sp.expand(dropped.subs(beta, 0)) == 0 and dropped != 0
    response = st.linear_response(M.duffing(beta=0.01, gravity=2.0, xi=0.0))
    rest = response.equilibrium["u"]
    assert response.natural_frequencies[0] == pytest.approx(np.sqrt(1 + 0.03 * rest**2), rel=1e-12)


def balance(z, frequency, weight, harmonics=7):
    """Harmonic balance of figure 11's oscillator in mm and ms units of the period; z = mean, cosines, sines (mm)."""
    w = 2 * np.pi * frequency
    n = 64
    phase = 2 * np.pi * np.arange(n) / n
    k = np.arange(1, harmonics + 1)
    C, S = np.cos(np.outer(phase, k)), np.sin(np.outer(phase, k))
    mean, a, b = z[0], z[1 : harmonics + 1], z[harmonics + 1 :]
    y = (mean + C @ a + S @ b) * 1e-3
    force = (315.827 * y + 1.9e7 * y**3) / 0.02 + weight * G - 0.5 * G * np.cos(phase)
    damping = 0.1365 / 0.02 * w * k * 1e-3
    inertia = (w * k) ** 2 * 1e-3
    return np.concatenate(
        (
            [force.mean()],
            2 * C.T @ force / n - inertia * a + damping * b,
            2 * S.T @ force / n - inertia * b - damping * a,
        )
    )


def folds(weight):
    """Upper and lower fold (Hz): extrema of the frequency over the phase lag, which is monotone along the curve."""

    def along(lag, guess):
        def equations(x):
            return np.append(balance(x[:-1], x[-1], weight), x[1] * np.sin(lag) - x[8] * np.cos(lag))

        x, _, _, message = fsolve(equations, guess, xtol=1e-12, full_output=True)
        assert np.abs(equations(x)).max() < 1e-6, message
        return x

    x = np.zeros(16)
    x[1], x[-1] = 0.6, 15.0
    curve = []
    for lag in np.linspace(0.1, 3.0, 59):
        x = along(lag, x)
        curve.append((lag, x))
    frequency = np.array([c[-1] for _, c in curve])
    found = []
    for sign in (-1, 1):
        inner = sign * frequency
        (k,) = [i for i in range(1, len(curve) - 1) if inner[i] < min(inner[i - 1], inner[i + 1])]
        lags, start = [curve[i][0] for i in (k - 1, k, k + 1)], curve[k][1]
        best = minimize_scalar(lambda lag, s=sign, z=start: s * along(lag, z)[-1], bracket=lags, tol=1e-8)
        found.append(sign * best.fun)
    return found


def test_gravity_moves_the_folds_of_figure_11():
    """Top fold 26.998 -> 27.048 Hz, lower fold 22.798 -> 23.208 Hz."""
    assert folds(0.0) == pytest.approx([26.998, 22.798], abs=6e-4)
    assert folds(1.0) == pytest.approx([27.048, 23.208], abs=6e-4)


# --------------------------------------------------------------------------------- (17), (51), (64) and their sweeps
def test_17_51_64_groups_change_along_a_constant_acceleration_sweep():
    """A = acc/w^2: beta ~ w^-4, varrho and lambda_l ~ w^2 when the shaker keeps the acceleration."""
    system = M.duffing.from_physical(acceleration=4.905)
    amplitude = {
        f: system.outputs["y_absolute"].subs({real("y"): 0, t: 0, real("acceleration"): 4.905, real("frequency"): f})
        for f in (20, 25)
    }
    assert float(amplitude[25]) == pytest.approx(0.19879e-3, abs=6e-9)
    beta = {f: 1.9e7 * float(A) ** 2 / 315.827 for f, A in amplitude.items()}
    assert beta[20] / beta[25] == pytest.approx((25 / 20) ** 4, rel=1e-12)
    switched = M.duffing.from_physical(amplitude=1e-4).with_excitation(st.ConstantAcceleration(4.905))
    x = [1e-3, 0.1]
    assert switched(0.01, x) == pytest.approx(system(0.01, x), rel=1e-12)
    ll, W, acc, W0 = real("length_ratio Omega acceleration Omega0")
    by_length = M.autoparametric_pendulum().rhs
    by_acceleration = M.autoparametric_pendulum.from_acceleration().rhs
    for one, two in zip(by_length, by_acceleration):
        assert vanishes(one.subs(ll, W**2 / (acc * W0**2)) - two)


# ------------------------------------------------------------------------------------------------------ section 3.1
def steady(system, x0, period):
    """Fixed point of the period map by Newton's method on a DOP853 flow, and the orbit as a callable."""

    def miss(x):
        return solve_ivp(system, (0, period), x, method="DOP853", rtol=1e-9, atol=1e-11).y[:, -1] - x

    start = fsolve(miss, x0, xtol=1e-9)
    solution = solve_ivp(system, (0, period), start, method="DOP853", rtol=1e-10, atol=1e-12, dense_output=True)

    class Orbit:
        def __call__(self, time):
            return solution.sol(np.mod(time, self.period))

    Orbit.period = period
    return start, Orbit()


def test_duffing_has_parametric_instability_through_its_variational_equation():
    """x'' + 2 xi x' + (1 + 3 beta u*^2) x = 0 is Hill's equation: the middle of three solutions leaves through +1."""
    u, u_star, beta = real("u u_star beta")
    linear = sp.diff(M.duffing().rhs[1], u).subs(u, u_star)
    assert sp.expand(linear + 1 + 3 * beta * u_star**2) == 0
    system = M.duffing(xi=0.05, beta=0.02, Omega=1.5)
    T = system.period
    h, damped = 0.75 * 0.02, (2 * 0.05 * 1.5) ** 2  # starting values by one harmonic
    amplitudes = np.roots([h**2, 2 * h * (1 - 2.25), (1 - 2.25) ** 2 + damped, -(2.25**2)])
    amplitudes = np.sqrt(np.sort(amplitudes[np.isreal(amplitudes)].real))
    verdicts = []
    for a in amplitudes:
        z = 2.25 / (1 - 2.25 + h * a**2 + 2j * 0.05 * 1.5)
        _, orbit = steady(system, [z.real, -1.5 * z.imag], T)
        verdicts.append(st.monodromy(system, about=orbit))
    assert [p.verdict for p in verdicts] == [st.Verdict.STABLE, st.Verdict.UNSTABLE, st.Verdict.STABLE]
    assert verdicts[1].multipliers[0].real > 1 and verdicts[1].counts.beyond_plus_one == 1


# -------------------------------------------------------------------------------------------------- other statements
@pytest.mark.parametrize("xi", [0.021, 0.1, 0.3])
def test_9_10_natural_frequency_is_not_the_peak(xi):
    ((where, height),) = st.linear_response(M.linear_oscillator(xi=xi)).peaks("u")
    assert where == pytest.approx(1 / np.sqrt(1 - 2 * xi**2), rel=1e-11) and where > 1
    assert height == pytest.approx(1 / (2 * xi * np.sqrt(1 - xi**2)), rel=1e-11)
    assert st.linear_response(M.linear_oscillator(xi=xi)).natural_frequencies == pytest.approx([1.0], rel=1e-13)


def test_A2_second_spring_acts_on_the_relative_displacement():
    """beta2 (v - u)^3 with the reaction lam on mass 1; beta2 v^3 pulls on a mass that moves with its neighbour."""
    u, v, b2, lam = real("u v beta2 mass_ratio_21")
    f = M.chain().rhs
    assert sp.expand(f[3].coeff(b2) + (v - u) ** 3) == 0
    assert sp.expand(f[2].coeff(b2) - lam * (v - u) ** 3) == 0
    assert f[3].coeff(b2).subs(v, u) == 0 and (v**3).subs(v, u) != 0


def bounce(H):
    """Highest frequency of a mass that leaves the spring: free flight over the peak-to-peak height H takes 2 sqrt(2 H/g)."""
    return 1 / (2 * np.sqrt(2 * H / G))


def test_A3_amplitude_is_peak_to_peak():
    """3.65 mm at 17.5 Hz: as an amplitude (H = 7.3 mm) gravity cannot bring the mass back in time."""
    assert bounce(7.3e-3) == pytest.approx(12.96, abs=5e-3) and bounce(7.3e-3) < 17.5
    assert bounce(3.65e-3) == pytest.approx(18.33, abs=5e-3) and bounce(3.65e-3) > 17.5
    m = 0.02
    for stiffness in (1e3, 1e5, 1e7):  # any unilateral spring is slower than its flight alone
        y0 = brentq(lambda y, k=stiffness: k * y**2 / 2 - m * G * (3.65e-3 - y), 0, 3.65e-3)
        up = 3.65e-3 - y0  # height of the flight above the end of the spring
        spring = M.UnilateralSpring(k1=stiffness) + M.PolynomialSpring((m * G,))
        rest = m * G / stiffness
        frequency = float(spring.backbone(up + rest, m)) / (2 * np.pi)
        low = -rest - np.sqrt(rest**2 + 2 * m * G * up / stiffness)
        assert frequency < bounce(up - low)


@pytest.mark.parametrize(("lam", "left"), [(0.42, 0.034), (0.5, 0.041)])
def test_fifty_periods_are_not_always_settled(lam, left):
    """Lower mode after 45 periods at 25 Hz, w1 = 169 rad/s."""
    pole = st.linear_response(M.chain(mass_ratio_21=lam)).poles[0]
    assert np.exp(pole.real * 169 * 45 / 25) == pytest.approx(left, abs=6e-4)


def test_34_and_64_mass_ratios_have_two_names():
    assert "mass_ratio_21" in M.chain().parameters and "mass_ratio_total" in M.autoparametric_pendulum().parameters
    assert "mass_ratio_21" not in M.autoparametric_pendulum().parameters


# ------------------------------------------------------------------------------------------------------- severity C
def test_table_1_rotational_power_and_derivatives():
    rows = {row.quantity: row for row in M.TRANSLATION_ROTATION}
    assert rows["power"].rotation == "P = T omega"  # printed: J omega
    assert rows["velocity"].rotation == "omega = dphi/dt" and rows["acceleration"].rotation == "alpha = domega/dt"
    assert "s^2" in rows["potential energy"].translation


def test_55_kinetic_energy_of_the_first_mass():
    m1 = real("m1")
    y = coordinate("y")
    r = sp.Matrix([0, y])
    assert sp.expand(m1 * r.diff(t).dot(r.diff(t)) / 2 - m1 * y.diff(t) ** 2 / 2) == 0  # printed: y t^2


def test_frequencies_in_hertz_are_not_angular():
    """ "omega = 25 Hz": f = 25 Hz, w = 157.08 rad/s; the library's parameter is `frequency` in Hz."""
    system = M.duffing.from_physical()
    assert system.period == pytest.approx(1 / 25, rel=1e-14) and system.units["frequency"] == "Hz"
