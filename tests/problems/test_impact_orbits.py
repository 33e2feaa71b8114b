"""Periodic impact orbits by `Shooting`, and grazing, against closed forms of linear oscillators and bouncing balls."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

import stability as st
from stability.integration.saltation import saltation

XI, GAP, E = 0.05, 5.0, 0.8
t, A, w, g = sp.symbols("t A w g", real=True)
z = sp.Function("z")(t)


def grazing_frequencies():
    """|H| = gap: Omega^4 = gap^2 ((1 - Omega^2)^2 + 4 xi^2 Omega^2), ascending."""
    return np.sort(np.sqrt(np.roots([1 - GAP**2, 2 * GAP**2 - 4 * XI**2 * GAP**2, -(GAP**2)]).real))


def free_wave(Omega):
    """(amplitude of the linear response, W(t) = [c, s; c', s'] of the free motion c = e^-xi t cos .., s = e^-xi t sin ..)"""
    nu = np.sqrt(1 - XI**2)

    def W(time):
        decay, c, s = np.exp(-XI * time), np.cos(nu * time), np.sin(nu * time)
        return decay * np.array([[c, s], [-XI * c - nu * s, -XI * s + nu * c]])

    return Omega**2 / np.hypot(1 - Omega**2, 2 * XI * Omega), W


def one_impact_defect(Omega, speed):
    """Residual of the closed condition for an orbit with one impact a period at u = GAP, of this speed.

    Between impacts u = P(t) + W(t) c, P = amplitude cos(Omega t + phase). u(0) = u(T) = GAP and u'(0) = -e u'(T) are
    linear in c and P'(0) for a given P(0): c = (GAP - P) k, P' = (GAP - P) kappa, and P^2 + (P'/Omega)^2 = amplitude^2.
    """
    amplitude, W = free_wave(Omega)
    T = 2 * np.pi / Omega
    k = np.linalg.solve(np.array([W(0)[0], W(T)[0]]), [1.0, 1.0])
    kappa = -(W(0)[1] + E * W(T)[1]) @ k / (1 + E)
    P = GAP - speed / (kappa + W(T)[1] @ k)
    return (P**2 + ((GAP - P) * kappa / Omega) ** 2) / amplitude**2 - 1


def monodromy(Omega, speed, force):
    """Of an orbit that meets the wall with this speed while the excitation is `force`: closed free motion, saltation."""
    _, W = free_wave(Omega)
    flow = W(2 * np.pi / Omega) @ np.linalg.inv(W(0))
    before = np.array([speed, -2 * XI * speed - GAP + force])
    after = np.array([-E * speed, 2 * XI * E * speed - GAP + force])
    return saltation(np.diag([1.0, -E]), before, after, np.array([-1.0, 0.0])) @ flow


@pytest.fixture(scope="module")
def branches():
    system = st.models.hard_stop_oscillator(xi=XI, gap=GAP, restitution=E, sides="above")
    quiet = st.continuation(st.Shooting(system), "Omega", (0.5, 2.0))
    back = st.continuation(st.Shooting(system), "Omega", (2.0, 0.5))
    knocking = st.continuation(st.switch(quiet["GR1"]), "Omega", (0.5, 2.0))
    return quiet, back, knocking


def test_grazing_where_the_linear_response_reaches_the_stop(branches):
    """Non-impacting orbits from either side, and impacts that become infinitely slow: 1e-10 in the frequency."""
    quiet, back, knocking = branches
    low, high = grazing_frequencies()
    assert quiet.labels == ("GR1",) and quiet.status is st.Status.STOPPED
    assert abs(quiet["GR1"].params["Omega"] - low) < 1e-10 and quiet.parameter[-1] == quiet["GR1"].params["Omega"]
    assert abs(back["GR1"].params["Omega"] - high) < 1e-10
    assert knocking["GR1"].kind is st.Kind.GRAZING and abs(knocking["GR1"].params["Omega"] - high) < 1e-10
    assert abs(quiet["GR1"].solution.max["u"] - GAP) < 1e-9
    assert quiet["GR1"].kind.label == "GR" and len(quiet["GR1"].bracket) == 2
    assert len(quiet.extend(max_points=20)) == len(quiet)  # nothing that means anything lies beyond


def test_one_impact_orbits_are_the_closed_form(branches):
    """Impact speeds at every point of the branch, which runs through both of the orbits that coexist."""
    knocking = branches[2]
    speeds, counts = knocking.columns["impact_speed.max"], knocking.columns["impacts"]
    assert (counts == 1).all() and len(knocking) > 20
    for Omega, speed in zip(knocking.parameter[1:-1], speeds[1:-1]):
        assert abs(one_impact_defect(float(Omega), speed)) < 1e-9
    assert knocking.columns["u.max"] == pytest.approx(GAP, abs=1e-9)


def test_multipliers_of_impact_orbits_against_closed_monodromy(branches):
    """tr and det of W-based flow and saltation; det = e^2 exp(-2 xi T)."""
    knocking = branches[2]
    for i in range(2, len(knocking) - 2, 4):
        Omega, orbit = float(knocking.parameter[i]), knocking.solution(i)
        instant = next(s for s in knocking._problem(i).edges(knocking.unknowns[i])[1:-1])
        force = Omega**2 * np.cos(2 * np.pi * instant)
        wanted = np.linalg.eigvals(monodromy(Omega, float(knocking.columns["impact_speed.max"][i]), force))
        size = np.abs(wanted).max()
        assert np.abs(np.sort_complex(orbit.multipliers) - np.sort_complex(wanted)).max() < 1e-7 * size**2
        assert np.prod(wanted).real == pytest.approx(E**2 * np.exp(-4 * np.pi * XI / Omega), rel=1e-9)


def test_stable_impact_orbits_are_what_simulation_settles_on(branches):
    """Motions beside the stable part settle on it (a second code: events instead of a fixed sequence)."""
    knocking, system = branches[2], st.models.hard_stop_oscillator(xi=XI, gap=GAP, restitution=E, sides="above")
    orbit = next(o for o in knocking.at(Omega=1.3) if o.verdict is st.Verdict.STABLE)
    period, beside = orbit.period, orbit(0.0) + np.array([0.05, -0.05])
    run = st.simulate(system, (0, 60 * period), x0=beside, rtol=1e-11, Omega=1.3)
    assert np.abs(run(60 * period - 1e-9) - orbit(period - 1e-9)).max() < 1e-7
    settled = st.solve(st.Shooting(system), start=beside, Omega=1.3)
    assert settled.verdict is st.Verdict.STABLE and settled.max["u"] == pytest.approx(GAP, abs=1e-10)


def ball(restitution):
    """Height over a table A cos(w t): z'' = -g + A w^2 cos(w t), z >= 0."""
    return st.System.from_equations(
        {z.diff(t, 2): -g + A * w**2 * sp.cos(w * t)}, [z], parameters=dict(A=1.2, w=1.0, g=1.0),
        period=2 * sp.pi / w, stops=[st.HardStop("z", 0.0, -1, restitution)], name="bouncing ball",
    )  # fmt: skip


@pytest.mark.parametrize("restitution", (0.5, 0.8))
def test_ball_on_a_shaken_table(restitution):
    """One bounce a period: born in a fold at Gamma = A w^2/g = pi (1 - e)/(1 + e), doubled at
    Gamma^2 = 4 (1 + e^2)^2/(1 + e)^4 + pi^2 (1 - e)^2/(1 + e)^2; impact speed g T/(1 + e); det M = e^2,
    tr M = 1 + e^2 -+ (1 + e)^2 sqrt(Gamma^2 - Gamma_fold^2) (from the exact map of impact times and speeds)."""
    e = restitution
    fold = np.pi * (1 - e) / (1 + e)
    double = np.hypot(2 * (1 + e**2) / (1 + e) ** 2, fold)
    system = ball(e)
    # impact where the table moves up with fold g/w (g = w = 1) and slows down: -1.2 sin t = fold, cos t > 0
    instant = -np.arcsin(fold / 1.2) % (2 * np.pi)
    takeoff = 2 * np.pi * e / (1 + e)  # relative to the table
    start = st.simulate(system, (instant, 2 * np.pi), x0=dict(z_dot=takeoff), rtol=1e-12).final
    orbit = st.solve(st.Shooting(system), start=(lambda s: np.outer(start, np.ones_like(s)), 2 * np.pi))
    assert orbit.min["z"] == pytest.approx(0.0, abs=1e-10)
    branch = st.continuation(st.Shooting(system), "A", (0.05, 3.0), start=orbit)
    assert set(branch.labels) >= {"LP1", "PD1"}
    assert abs(branch["LP1"].params["A"] - fold) < 1e-9
    doubled = [s.params["A"] for s in branch.special if s.kind is st.Kind.PERIOD_DOUBLING]
    assert min(abs(value - double) for value in doubled) < 1e-9
    assert branch.columns["impact_speed.max"] == pytest.approx(2 * np.pi / (1 + e), rel=1e-9)
    for value, multipliers in zip(branch.parameter, branch.values):
        root = (1 + e) ** 2 * np.sqrt(max(value**2 - fold**2, 0.0))
        trace = multipliers.sum().real
        assert min(abs(trace - (1 + e**2) - root), abs(trace - (1 + e**2) + root)) < 1e-6 * (1 + root)
        assert np.prod(multipliers).real == pytest.approx(e**2, abs=1e-7)
    twice = st.continuation(st.switch(branch["PD1"]), "A", (0.05, 3.0), max_points=12)
    assert twice.columns["impacts"][-1] == 2 and twice.columns["impact_speed.min"][-1] < 2 * np.pi / (1 + e) - 1e-3


def limit_cycle(d, e):
    """(period, impact speed) of u'' - d u' + u = 0, u <= 1, u'+ = -e u'-: from (1, -e v) back to (1, v)."""
    W = np.sqrt(1 - d**2 / 4)

    def speeds(T):
        s = (np.exp(-d * T / 2) - np.cos(W * T)) / np.sin(W * T)
        wave, slope = np.cos(W * T) + s * np.sin(W * T), W * (s * np.cos(W * T) - np.sin(W * T))
        return -(W * s + d / 2), np.exp(d * T / 2) * (d / 2 * wave + slope)

    def gap(T):
        after, before = speeds(T)
        return after - e * before

    period = brentq(gap, np.pi / W + 1e-3, 2 * np.pi / W - 1e-3, xtol=1e-14)
    return period, speeds(period)[1]


def test_limit_cycle_between_negative_damping_and_a_stop():
    """An autonomous system: the period is an unknown; one multiplier, det M = e^2 exp(d T)."""
    u, d = sp.Function("u")(t), sp.Symbol("d", real=True)
    system = st.System.from_equations(
        {u.diff(t, 2): d * u.diff(t) - u}, [u], parameters=dict(d=0.1), stops=[st.HardStop("u", 1.0, 1, 0.6)]
    )
    branch = st.continuation(st.Shooting(system), "d", (0.1, 0.3), start=dict(u=0.3))
    assert branch.status is st.Status.PARAMETER_BOUND and len(branch) > 5
    for i in range(0, len(branch), 3):
        period, speed = limit_cycle(float(branch.parameter[i]), 0.6)
        assert branch.columns["period"][i] == pytest.approx(period, rel=1e-9)
        assert branch.columns["impact_speed.max"][i] == pytest.approx(speed, rel=1e-9)
        assert branch.values[i, 0].real == pytest.approx(0.36 * np.exp(branch.parameter[i] * period), rel=1e-7)


def test_symmetric_stops_are_grazed_together():
    """Two impacts a period are born at once, u(t + T/2) = -u(t), until a pitchfork; Branch.at after loading, too."""
    system = st.models.hard_stop_oscillator(xi=XI, gap=GAP, restitution=E, sides="both")
    quiet = st.continuation(st.Shooting(system), "Omega", (0.5, 2.0))
    both = st.continuation(st.switch(quiet["GR1"]), "Omega", (0.5, 1.5))
    assert (both.columns["impacts"] == 2).all() and both["BP1"].kind is st.Kind.BRANCH_POINT
    assert both.columns["u.max"] == pytest.approx(-both.columns["u.min"], abs=1e-9)
    for Omega, speed in zip(both.parameter[1::3], both.columns["impact_speed.max"][1::3]):
        amplitude, W = free_wave(Omega)  # half a period: u(T/2) = -GAP, u'(T/2) = -(-e u'(0-))/.. by symmetry
        half = W(np.pi / Omega)
        k = np.linalg.solve(np.array([W(0)[0], -half[0]]), [1.0, 1.0])
        kappa = -(W(0)[1] - E * half[1]) @ k / (1 + E)
        P = GAP - speed / (kappa - half[1] @ k)
        assert abs((P**2 + ((GAP - P) * kappa / Omega) ** 2) / amplitude**2 - 1) < 1e-9


def test_stored_branches_of_impact_orbits_go_on(branches, tmp_path):
    knocking = branches[2]
    knocking.save(tmp_path / "knocking.npz")
    loaded = st.load(tmp_path / "knocking.npz")
    assert [o.verdict for o in loaded.at(Omega=1.3)] == [o.verdict for o in knocking.at(Omega=1.3)]
    again = st.continuation(st.switch(loaded["GR1"]), "Omega", (0.5, 2.0), max_points=5)
    assert (again.columns["impacts"] == 0).all() and again.parameter[1] > again.parameter[0]


def test_sticking_orbits_are_followed_as_they_are():
    """e = 0 and a small gap: the mass rests on the stop in every period; det M = 0, and simulation agrees."""
    u, W = sp.Function("u")(t), sp.Symbol("W", real=True)
    system = st.System.from_equations(
        {u.diff(t, 2): -0.4 * u.diff(t) - u + 3 * sp.cos(W * t)}, [u], parameters=dict(W=0.7),
        period=2 * sp.pi / W, stops=[st.HardStop("u", 0.5, 1, 0.0)],
    )  # fmt: skip
    branch = st.continuation(st.Shooting(system), "W", (0.7, 0.9))
    assert branch.status is st.Status.PARAMETER_BOUND and np.abs(branch.values[:, -1]).max() < 1e-9
    orbit = branch.at(W=0.8)[0]
    run = st.simulate(system, (0, 20 * orbit.period), rtol=1e-11, W=0.8)
    assert {h.kind for h in run.events[-3:]} >= {"stick", "release"}
    assert np.abs(run.final - orbit(0.0)).max() < 1e-8


@pytest.mark.parametrize("segments", (2, 5))
def test_cuts_change_nothing(branches, segments):
    system = st.models.hard_stop_oscillator(xi=XI, gap=GAP, restitution=E, sides="above")
    quiet = st.continuation(st.Shooting(system, segments=segments), "Omega", (0.85, 1.0))
    knocking = st.continuation(st.switch(quiet["GR1"]), "Omega", (0.85, 1.05))
    assert abs(quiet["GR1"].params["Omega"] - grazing_frequencies()[0]) < 1e-10
    assert knocking["PD1"].params["Omega"] == pytest.approx(branches[2]["PD1"].params["Omega"], abs=1e-9)


def test_impacts_wander_through_the_whole_period():
    """Excitation 25 cos(t + psi): psi only shifts the orbit in time, so its impact passes every phase, t = 0 too."""
    u, psi = sp.Function("u")(t), sp.Symbol("psi", real=True)
    system = st.System.from_equations(
        {u.diff(t, 2): -0.1 * u.diff(t) - u + 1.3 * sp.cos(1.3 * t + psi)}, [u], parameters=dict(psi=0.0),
        period=2 * sp.pi / sp.Float("1.3", 30), stops=[st.HardStop("u", 0.6, 1, 0.8)],
    )  # fmt: skip
    branch = st.continuation(st.Shooting(system), "psi", (0.0, 4 * np.pi), start=dict(u=0.0, u_dot=-2.0))
    assert branch.status is st.Status.PARAMETER_BOUND and branch.columns["impacts"].max() >= 1
    for name in ("impact_speed.max", "u.min", "u_dot.max"):
        assert np.ptp(branch.columns[name]) < 1e-8 * np.abs(branch.columns[name]).max()
    assert np.abs(branch.values - branch.values[0]).max() < 1e-6
    origins = {round(problem.origin, 6) for problem in branch._problems}
    assert len(origins) > 2
    turned = st.solve(st.Shooting(system), start=dict(u=0.0, u_dot=-2.0), psi=1.0)
    assert turned.min["u"] == pytest.approx(branch.columns["u.min"][0], rel=1e-9)
