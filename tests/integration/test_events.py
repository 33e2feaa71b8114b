"""Impacts and switches against closed forms; saltation against differences and determinants."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, ExpressionError, InputError, UnknownNameError
from stability.integration.flow import flow
from stability.integration.saltation import saltation
from stability.integration.switches import frozen_switches, has_switches
from stability.results.trajectory import Ending

t = sp.Symbol("t", real=True)
y, z = sp.Function("y")(t), sp.Function("z")(t)
g, k1, k2 = sp.symbols("g k1 k2", real=True)


def ball(restitution):
    return st.System.from_equations(
        {y.diff(t, 2): -g}, [y], parameters=dict(g=9.81), stops=[st.HardStop("y", 0.0, -1, restitution)], name="ball"
    )


def test_bouncing_ball_against_its_closed_form():
    """Impacts at t1 (1 + 2 sum e^k), rebounds e^k v1; rest after t1 (1 + e)/(1 - e), then held."""
    e, t1 = 0.8, np.sqrt(2 / 9.81)
    run = st.simulate(ball(e), (0, 6), x0=dict(y=1.0), rtol=1e-12)
    impacts = [h for h in run.events if h.kind == "impact"]
    times = t1 * (1 + 2 * np.cumsum(np.append(0.0, e ** np.arange(1, 40))))
    assert np.abs(np.array([h.t for h in impacts[:40]]) - times).max() < 1e-12
    speeds = 9.81 * t1 * e ** np.arange(1, 41)
    assert np.abs(np.array([h.after[1] for h in impacts[:40]]) - speeds).max() < 1e-11
    sticking = run.events[-1]
    assert sticking.kind == "stick" and 0 < t1 * (1 + e) / (1 - e) - sticking.t < 1e-4
    assert run.status is Ending.COMPLETED and np.abs(run([5.0, 6.0])).max() < 1e-14
    assert run.min["y"] > -1e-12


def test_perfect_stops_conserve_energy():
    """e = 1: two walls, a cubic spring, 100 impacts and more; the energy keeps its value to 1e-10."""
    system = st.System.from_equations(
        {y.diff(t, 2): -y - 0.3 * y**3}, [y], parameters={},
        stops=[st.HardStop("y", 0.7, 1, 1.0), st.HardStop("y", -0.9, -1, 1.0)],
    )  # fmt: skip
    run = st.simulate(system, (0, 120), x0=dict(y=0.2, y_dot=2.0), rtol=1e-12, atol=1e-14)
    energy = run["y_dot"] ** 2 / 2 + run["y"] ** 2 / 2 + 0.3 * run["y"] ** 4 / 4
    assert sum(h.kind == "impact" for h in run.events) > 100
    assert np.ptp(energy) < 1e-10 * energy[0]
    assert run.max["y"] <= 0.7 + 1e-12 and run.min["y"] >= -0.9 - 1e-12


def test_bilinear_oscillator_keeps_its_order():
    """q'' = -k1 q (q > 0), -k2 q (q < 0): period pi/sqrt k1 + pi/sqrt k2; few steps, none lost at the kinks."""
    system = st.System.from_equations(
        {y.diff(t, 2): -k1 * sp.Max(y, 0) - k2 * sp.Min(y, 0)}, [y], parameters=dict(k1=1.0, k2=25.0)
    )
    period = np.pi + np.pi / 5
    run = st.simulate(system, (0, 50 * period), x0=dict(y_dot=1.0), rtol=1e-12, atol=1e-14)
    assert np.abs(run.final - [0.0, 1.0]).max() < 5e-10
    switches = np.array([h.t for h in run.events])
    assert np.abs(switches[1::2][:49] - period * np.arange(1, 50)).max() < 5e-10
    assert run.steps < 5000


def test_two_events_in_one_step_and_grazing():
    """A hump of height 1e-6 over the guard lies inside one long step of a nearly linear motion; one just below is none."""
    fall = st.System.from_equations({y.diff(t, 2): -1}, [y], parameters={})
    for height, count in ((0.5 - 1e-6, 2), (0.5 + 1e-6, 0)):
        run = st.simulate(fall, (0, 2.5), x0=dict(y_dot=1.0), events=dict(top=f"y - {height!r}"))
        assert len(run.events) == count
        if count:
            wanted = 1 + np.array([-1, 1]) * np.sqrt(1 - 2 * height)
            assert np.abs(np.array([h.t for h in run.events]) - wanted).max() < 1e-9
    three = dict(a="y - 0.4999", b="y - 0.49991", c="y - 0.49992")
    run = st.simulate(fall, (0, 2.0), x0=dict(y_dot=1.0), events=three)
    assert [h.name for h in run.events] == ["a", "b", "c", "c", "b", "a"]


def test_sticking_and_release():
    """Held on a wall while a slow force presses, let go where it changes its sign: t = T/2 exactly."""
    W = sp.Symbol("W", real=True)
    system = st.System.from_equations(
        {y.diff(t, 2): sp.sin(W * t)}, [y], parameters=dict(W=1.0), period=2 * sp.pi / W,
        stops=[st.HardStop("y", 0.0, 1, 0.3)],
    )  # fmt: skip
    run = st.simulate(system, (0, 4.5), rtol=1e-12)
    kinds = [h.kind for h in run.events]
    assert kinds == ["stick", "release"] and abs(run.events[1].t - np.pi) < 1e-10
    # afterwards y'' = sin t from rest at pi
    assert abs(run.final[1] - (-np.cos(4.5) - 1)) < 1e-9 and np.abs(run(np.linspace(0.1, 3.1, 9))).max() < 1e-12


def test_a_dry_slider_slides():
    """x' = -sign(x): the switch is met at t = 1 and both sides push back; the motion ends there with that word."""
    system = st.System.from_equations({y.diff(t): -sp.sign(y)}, [y], parameters={})
    run = st.simulate(system, (0, 3), x0=dict(y=1.0))
    assert run.status is Ending.SLIDING and abs(run.span[1] - 1) < 1e-12 and abs(run.final[0]) < 1e-14


def test_user_events_stop():
    run = st.simulate(ball(1.0), (0, 5), x0=dict(y=1.0), events=dict(half="y - 1/2", low=y - 0.1), stop_at="low")
    assert run.status is Ending.STOPPED and [h.name for h in run.events] == ["half", "low"]
    assert abs(run.span[1] - np.sqrt(2 * 0.9 / 9.81)) < 1e-12 and abs(run.final[0] - 0.1) < 1e-13
    with pytest.raises(ExpressionError, match="did you mean 'y'"):
        st.simulate(ball(1.0), (0, 5), events=dict(a="yy - 1"))
    with pytest.raises(UnknownNameError):
        st.simulate(ball(1.0), (0, 5), stop_at="a")


def test_bad_stops_are_refused():
    pair = [st.HardStop("y", -0.1, 1), st.HardStop("y", 0.1, -1)]
    overlapping = st.System.from_equations({y.diff(t, 2): -y}, [y], parameters={}, stops=pair)
    with pytest.raises(InputError, match="overlap"):
        st.simulate(overlapping, (0, 1))
    with pytest.raises(InputError, match="beyond"):
        st.simulate(ball(0.5), (0, 1), x0=dict(y=-1.0))
    with pytest.raises(InputError, match="restitution"):
        st.HardStop("y", 0.0, 1, -0.1)
    with pytest.raises(ConvergenceError, match="beyond"):
        flow(ball(0.5), (0, 1), [-1.0, 0.0])


def end_of(system, T):
    def end(x, p=None):
        span = (0, T if system.period is None or p is None else T / system.period * system.period_at(**dict(zip(system.parameters, p))))
        return flow(system, span, x, p, rtol=1e-12, atol=1e-13).x

    return end


@pytest.mark.parametrize("system, x0", [
    (st.models.hard_stop_oscillator(restitution=0.8, gap=1.0, Omega=1.0), [0.1, 0.2]),
    (st.models.soft_stop_oscillator(gap=1.0, eta=0.1, Omega=1.0), [0.1, 0.2]),
    (st.models.unilateral_spring(gravity=0.2), [0.1, 0.2]),
], ids=lambda s: getattr(s, "name", None))  # fmt: skip
def test_variations_pass_events(system, x0):
    """By the state and by every parameter (at fixed phase) against central differences of the flow."""
    T, x0 = system.period, np.array(x0)
    whole = flow(system, (0, T), x0, rtol=1e-12, atol=1e-13, variations=True, parameters=tuple(system.parameters))
    assert len(st.simulate(system, (0, T), x0=x0).events) > 0
    end, h = end_of(system, T), 1e-5

    def central(f, h):
        return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)

    for k in range(2):
        unit = np.eye(2)[k]
        assert np.abs(central(lambda s: end(x0 + s * unit), h) - whole.matrix[:, k]).max() < 2e-8  # noqa: B023
    p = system.parameter_vector()
    for k in range(len(p)):
        unit = np.eye(len(p))[k] * max(1, abs(p[k]))
        wanted = central(lambda s: end(x0, p + s * unit), 1e-6) / max(1, abs(p[k]))  # noqa: B023
        assert np.abs(wanted - whole.by_parameter[:, k]).max() < 5e-8


def test_determinant_of_an_impact_orbit():
    """Liouville: det M = e^(2 impacts) exp(-2 xi T) of the settled two-impact orbit, which Newton's method finds, too."""
    e, xi = 0.8, 0.1
    system = st.models.hard_stop_oscillator(restitution=e, gap=2.0, Omega=1.0, xi=xi)
    run = st.simulate(system, (0, 200 * system.period), rtol=1e-10)
    assert run.transient[0] < 1e-6 and len(run.last(1).events) == 2
    orbit = flow(system, (0, system.period), run.final, variations=True, rtol=1e-12)
    det = e**4 * np.exp(-2 * xi * system.period)
    assert abs(np.linalg.det(orbit.matrix) - det) < 1e-10
    x = run.final + np.array([1e-3, -2e-3])  # Newton's method on the stroboscopic map, with the matrix over the impacts
    for _ in range(5):
        end = flow(system, (0, system.period), x, variations=True, rtol=1e-12)
        x = x + np.linalg.solve(np.eye(2) - end.matrix, end.x - x)
    assert np.abs(x - run.final).max() < 1e-7


def test_saltation_identity_and_wall():
    f = np.array([1.3, -0.4])
    assert np.abs(saltation(np.eye(2), f, f, np.array([1.0, 0.0])) - np.eye(2)).max() < 1e-15
    wall = saltation(np.diag([1.0, -0.5]), np.array([2.0, -9.81]), np.array([-1.0, -9.81]), np.array([-1.0, 0.0]))
    assert abs(np.linalg.det(wall) - 0.25) < 1e-14 and abs(wall[0, 0] + 0.5) < 1e-15


def test_frozen_forms():
    """Every switch becomes a mode; the form with the right modes has the value of the original."""
    a, b = sp.symbols("a b", real=True)
    forms = [sp.Abs(y - a) * y, sp.sign(y) + sp.Max(y, a, b), sp.Piecewise((y**2, (y > a) & (y < b)), (-y, True)),
             sp.Heaviside(y - b) * sp.Min(y, 1), sp.Abs(y) ** sp.Rational(3, 2) * sp.sign(y)]  # fmt: skip
    for form in forms:
        system = st.System.from_equations({y.diff(t): form}, [y], parameters=dict(a=0.3, b=0.7))
        assert has_switches(system)
        found, rhs = frozen_switches(system)
        for value in (-0.4, 0.1, 0.5, 0.9, 1.4):
            at = {sp.Symbol("y", real=True): value, a: 0.3, b: 0.7}
            modes = {m: (1 if guard.subs(at) > 0 else -1) for m, guard in zip(found.modes, found.guards)}
            assert abs(float(rhs[0].subs(modes).subs(at)) - float(system.rhs[0].subs(at))) < 1e-14
    smooth = st.models.duffing()
    assert not has_switches(smooth) and frozen_switches(smooth)[1] == smooth.rhs
