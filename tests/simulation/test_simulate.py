"""Motions against closed forms, scipy and tighter tolerances; statuses, batches, measures, storage, refusals."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.errors import InputError, NonFiniteError, UnknownNameError
from stability.results.trajectory import Ending

t = sp.Symbol("t", real=True)
u, v = sp.Function("u")(t), sp.Function("v")(t)
CHAOTIC = {"lorenz"}


def free(beta, w=1.0):
    return st.System.from_equations({u.diff(t, 2): -(w**2) * u - beta * u**3}, [u], parameters={})


def test_free_oscillator_against_its_closed_form():
    run = st.simulate(free(0.0), (0.0, 100.0), x0=dict(u=1.0), rtol=1e-11, atol=1e-13)
    times = np.linspace(0, 100, 1001)
    assert np.abs(run(times) - [np.cos(times), -np.sin(times)]).max() < 1e-9
    assert run.status is Ending.COMPLETED and run(3.0).shape == (2,) and run(times, "u").shape == (1001,)
    assert abs(run.max["u"] - 1) < 1e-10 and abs(run.min["u_dot"] + 1) < 1e-10
    tops = run.extrema("u")
    assert np.abs(tops[0][tops[2] > 0] - 2 * np.pi * np.arange(1, 16)).max() < 1e-8
    assert np.abs(run.crossings("u", 0.5, -1) - np.pi / 3 - 2 * np.pi * np.arange(16)).max() < 1e-9
    assert abs(run.window(0, 20 * np.pi).mean["u"]) < 1e-10
    assert np.abs(run.window(10.0, 20.0)(times[100:201]) - run(times[100:201])).max() < 1e-14


@pytest.mark.parametrize("name", sorted(set(st.models.catalogue()) - CHAOTIC))
def test_global_error_of_every_model(name):
    """Over five periods (or 20 time units) within 100 x the tolerance of a run at 1e-13, in units of the largest state."""
    system = st.models.catalogue()[name]()
    span = (0.0, 5 * system.period if system.period else 20.0)
    x0 = np.full(system.n, 0.05)
    rtol = 1e-8
    coarse = st.simulate(system, span, x0=x0, rtol=rtol, atol=1e-12)
    fine = st.simulate(system, span, x0=x0, rtol=1e-13, atol=1e-16)
    assert coarse.status is fine.status is Ending.COMPLETED
    times = np.linspace(*span, 301)[1:]
    jumps = np.array([h.t for h in fine.events if h.kind == "impact"])
    if jumps.size:  # velocities jump there: an error in time is no error of the state
        times = times[np.abs(times[:, None] - jumps).min(axis=1) > 1e-3]
    scale = np.abs(fine.coefficients[:, 0]).max(axis=0) + np.abs(fine.x).max(axis=1)
    assert (np.abs(coarse(times) - fine(times)) / scale[:, None]).max() < 100 * rtol


@pytest.mark.parametrize("name", ["duffing", "pendulum"])
def test_energy_drift_over_a_thousand_periods(name):
    """Conservative Duffing oscillator and pendulum at rtol 1e-12: relative drift of the energy <= 1e-9."""
    if name == "duffing":
        system, x0, T = free(0.5), dict(u=1.0), 2 * np.pi / np.sqrt(1.375)
        energy = lambda x: x[1] ** 2 / 2 + x[0] ** 2 / 2 + 0.125 * x[0] ** 4  # noqa: E731
    else:
        system, T = st.System.from_equations({u.diff(t, 2): -sp.sin(u)}, [u], parameters={}), 2 * np.pi * 1.0663
        x0, energy = dict(u=1.0), lambda x: x[1] ** 2 / 2 + 1 - np.cos(x[0])
    run = st.simulate(system, (0, 1000 * T), x0=x0, rtol=1e-12, atol=1e-14)
    values = energy(run(np.linspace(0, 1000 * T, 20001)))
    assert np.ptp(values) <= 1e-9 * values[0]


def test_forced_motion_against_scipy_and_stiff_methods():
    system = st.models.duffing(xi=0.05, beta=0.1, Omega=1.3)
    run = st.simulate(system, (0, 40), x0=dict(u=0.5), rtol=1e-11, atol=1e-13)
    other = solve_ivp(system, (0, 40), [0.5, 0.0], "DOP853", rtol=1e-12, atol=1e-14, t_eval=np.linspace(0, 40, 101))
    assert np.abs(run(other.t) - other.y).max() < 1e-9
    for method in ("Radau", "LSODA"):
        stiff = st.simulate(system, (0, 40), x0=dict(u=0.5), rtol=1e-9, atol=1e-11, method=method)
        assert np.abs(stiff(other.t) - other.y).max() < 1e-6


def test_stiff_van_der_pol():
    """mu = 1000: an implicit method needs few steps; period (3 - 2 log 2) mu + 7.0143 mu^(-1/3) asymptotically."""
    system, mu = st.models.van_der_pol(), 1000.0
    name = next(iter(system.parameters))
    run = st.simulate(system, (0, 4000), x0=[2.0, 0.0], rtol=1e-6, atol=1e-8, method="Radau", **{name: mu})
    upward = run.crossings(system.states[0], 0.0, 1)
    asymptotic = (3 - 2 * np.log(2)) * mu + 7.0143 / mu ** (1 / 3)
    assert run.steps < 5000 and abs(np.diff(upward)[-1] - asymptotic) < 2e-3 * mu


def test_batches_agree_with_single_motions():
    system = st.models.duffing.from_physical()
    frequencies = np.array([20.0, 25.0, 30.0])
    together = st.simulate(system, (0, 1), x0=dict(y=[1e-4, 2e-4, 3e-4]), frequency=frequencies, workers=2)
    assert together(0.5).shape == (2, 3) and together([0.1, 0.2]).shape == (2, 2, 3) and together.final.shape == (2, 3)
    for k, f in enumerate(frequencies):
        alone = st.simulate(system, (0, 1), x0=dict(y=[1e-4, 2e-4, 3e-4][k]), frequency=f)
        assert np.array_equal(together[k].final, alone.final)
    four = st.simulate(system, (0, 1), x0=np.zeros((2, 4)), workers=1)
    assert len(four) == 4 and np.array_equal(four.final, np.tile(st.simulate(system, (0, 1)).final[:, None], 4))


def test_escape_is_a_status_with_time_and_state():
    """u' = u^2 escapes at t = 1; a softening spring lets go: no NaN, and nothing beyond the end."""
    blow = st.System.from_equations({u.diff(t): u**2}, [u], parameters={})
    run = st.simulate(blow, (0, 2), x0=dict(u=1.0))
    assert run.status is Ending.DIVERGED and 0.999 < run.span[1] < 1.0 + 1e-9 and np.isfinite(run.x).all()
    soft = st.System.from_equations({u.diff(t, 2): -u + u**3}, [u], parameters={})
    over = st.simulate(soft, (0, 100), x0=dict(u=0.9, u_dot=0.9))
    assert over.status is Ending.DIVERGED and over.span[1] < 100 and np.isfinite(over.x).all()
    with pytest.raises(InputError, match="outside"):
        over(99.0)
    few = st.simulate(soft, (0, 1e5), x0=dict(u=0.5), max_steps=50)
    assert few.status is Ending.MAX_STEPS and 0 < few.steps <= 50


def test_a_failing_python_function_is_an_error():
    def broken(t, x, *, a=1.0):
        if t > 0.5:
            raise ZeroDivisionError("no")
        return np.array([-a * x[0]])

    system = st.System.from_function(broken, states="x", period=1.0)
    with pytest.raises(NonFiniteError, match="failed"):
        st.simulate(system, (0, 1), x0=dict(x=1.0))


def test_long_time_measures_of_a_forced_motion():
    """Linear oscillator at resonance: amplitude 1/(2 xi), phase -90 degrees, spectrum line, stroboscopic point."""
    xi = 0.05
    system = st.models.duffing(xi=xi, beta=0.0, Omega=1.0)
    T = system.period
    run = st.simulate(system, (0, 100 * T), rtol=1e-10)
    assert run.settled and run.transient[1] == 1
    assert abs(2 * abs(run.harmonic(1, "u")) - 10) < 1e-7 and abs(np.angle(run.harmonic(1, "u")) + np.pi / 2) < 1e-7
    assert abs(run.last(3).max["u"] - 10) < 1e-7 and abs(run.last(1).peak_to_peak["u_absolute"] / 2 - np.hypot(10, 1)) < 1e-6
    section = run.poincare()
    assert section.shape == (2, 101) and np.abs(section[:, -1] - [0, 10]).max() < 1e-6
    crossing = run.last(10).poincare("u_dot", 0.0, -1)
    assert np.abs(crossing[0] - 10).max() < 1e-6
    line = run.last(64).spectrum("u")
    top = line.amplitude.argmax()
    assert abs(line.frequency[top] - 1 / T) < 1e-3 and abs(line.amplitude[top] - 10) < 0.01
    unsettled = st.simulate(system, (0, 5 * T))
    assert not unsettled.settled


def test_outputs_and_breaks():
    """An output with cos(Omega t); a right-hand side that jumps in time is integrated exactly."""
    square = st.System.from_equations({u.diff(t, 2): sp.sign(sp.cos(t))}, [u], parameters={}, period=2 * sp.pi,
                                      breaks=(sp.Rational(1, 4), sp.Rational(3, 4)), outputs=dict(push=sp.sign(sp.cos(t))))  # fmt: skip
    run = st.simulate(square, (0, 2 * np.pi), rtol=1e-6)
    q, w, time = 0.0, 0.0, 0.0
    for corner, sign in ((np.pi / 2, 1), (3 * np.pi / 2, -1), (2 * np.pi, 1)):
        d = corner - time
        q, w, time = q + w * d + sign * d**2 / 2, w + sign * d, corner
    assert np.abs(run.final - [q, w]).max() < 1e-11
    assert np.abs(run([1.0, 3.0, 5.5], "push") - [1, -1, 1]).max() < 1e-9


def test_rotation_is_counted():
    system = st.System.from_equations({u.diff(t, 2): -sp.sin(u)}, [u], parameters={}, angles=("u",))
    assert abs(st.simulate(system, (0, 50), x0=dict(u_dot=3.0)).turns("u")) > 10
    assert abs(st.simulate(system, (0, 50), x0=dict(u_dot=1.0)).turns("u")) < 0.3


def test_storage_round_trip(tmp_path):
    run = st.simulate(st.models.hard_stop_oscillator(gap=1.0), (0, 20))
    run.save(tmp_path / "run.npz")
    back = st.load(tmp_path / "run.npz")
    assert np.array_equal(back.x, run.x) and back.events == run.events and back.status is run.status
    assert back.params == run.params and back.period == run.period
    linear = st.simulate(st.models.linear_oscillator.from_physical(acceleration=1.0), (0, 1))
    linear.save(tmp_path / "linear.npz")
    again = st.load(tmp_path / "linear.npz")
    assert np.abs(again["y_mm"] - linear["y_mm"]).max() < 1e-14 and again.max["y_mm"] == linear.max["y_mm"]
    linear.to_csv(tmp_path / "linear.csv")
    text = np.genfromtxt(tmp_path / "linear.csv", delimiter=",", names=True)
    assert np.allclose(text["y_mm"], linear["y_mm"]) and np.allclose(text["t"], linear.t)


@pytest.mark.parametrize("change, match", [
    (dict(span=(1, 1)), "t0 < t1"), (dict(span=(0, np.inf)), "finite"), (dict(rtol=0.5), "rtol"), (dict(atol=-1), "atol"),
    (dict(x0=[1.0]), "shape"), (dict(x0=dict(u=np.nan)), "finite"), (dict(method="Euler"), "DOP853"),
    (dict(workers=0), "workers"), (dict(xi=np.array([0.1, 0.2]), x0=np.zeros((2, 3))), "lengths"), (dict(Omega=-1.0), "bounds"),
    (dict(xi=np.array([0.1, np.nan])), "finite"), (dict(span=3), "two numbers"),
])  # fmt: skip
def test_bad_input_is_refused(change, match):
    arguments = dict(span=(0, 1)) | change
    with pytest.raises(InputError, match=match):
        st.simulate(st.models.duffing(), arguments.pop("span"), **arguments)


def test_unknown_names_are_refused():
    with pytest.raises(UnknownNameError, match="did you mean 'Omega'"):
        st.simulate(st.models.duffing(), (0, 1), omga=1.0)
    with pytest.raises(UnknownNameError):
        st.simulate(st.models.duffing(), (0, 1), x0=dict(w=1.0))
    with pytest.raises(UnknownNameError):
        st.simulate(st.models.duffing(), (0, 1))["w"]
