"""Energy audits against closed forms: work of a steady vibration, losses of a bouncing ball, conservative motion."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import InputError

t = sp.Symbol("t", real=True)
y, g = sp.Function("y")(t), sp.Symbol("g", real=True)


def test_work_of_a_steady_vibration():
    """Linear resonance: the damper takes 2 xi (Omega A)^2 T/2 a period, and the base gives the same."""
    system = st.models.duffing(xi=0.05, beta=0.0, Omega=1.0)
    T = system.period
    last = st.simulate(system, (0, 100 * T), rtol=1e-11, atol=1e-13).last(1)
    found = st.energy_balance(system, last)
    wanted = 2 * 0.05 * 10.0**2 * T / 2
    assert abs(found.dissipated - wanted) < 1e-6 * wanted and abs(found.supplied - wanted) < 1e-6 * wanted
    assert abs(found.stored) < 1e-5 and abs(found.imbalance) < 1e-10 and found.impacts == 0


def test_losses_of_a_bouncing_ball():
    """(1 - e^2) g h0 at the first impact, e^2 times that at the next, and so on; no other loss."""
    e = 0.8
    ball = st.System.from_equations(
        {y.diff(t, 2): -g}, [y], parameters=dict(g=9.81), stops=[st.HardStop("y", 0.0, -1, e)]
    )
    run = st.simulate(ball, (0, 2.0), x0=dict(y=1.0), rtol=1e-11)
    impacts = len(run.events)
    found = st.energy_balance(ball, run)
    assert abs(found.impacts - 9.81 * (1 - e ** (2 * impacts))) < 1e-9
    assert abs(found.imbalance) < 1e-11 and abs(found.dissipated) < 1e-12 and found.supplied == 0


def test_conservative_and_given_energies():
    pendulum = st.System.from_equations({y.diff(t, 2): -sp.sin(y)}, [y], parameters={})
    run = st.simulate(pendulum, (0, 200), x0=dict(y=2.0), rtol=1e-12, atol=1e-14)
    found = st.energy_balance(pendulum, run)
    assert abs(found.stored) < 1e-10 and abs(found.dissipated) < 1e-10
    same = st.energy_balance(pendulum, run, "y_dot**2/2 - cos(y)")
    assert abs(same.stored - found.stored) < 1e-14


def test_two_degrees_of_freedom_need_an_energy():
    system = st.models.chain(Omega0=1.0)
    run = st.simulate(system, (0, 100), rtol=1e-11, atol=1e-13)
    with pytest.raises(InputError, match="give energy="):
        st.energy_balance(system, run)
    lam, W0 = "mass_ratio_21", "Omega0"
    energy = f"(u_dot**2 + {lam}*v_dot**2 + u**2 + {lam}*{W0}**2*(v - u)**2)/2"
    found = st.energy_balance(system, run, energy)
    assert abs(found.imbalance) < 1e-9 and found.dissipated > 0 and found.supplied > found.dissipated


def test_refusals():
    run = st.simulate(st.models.duffing(), (0, 1))
    with pytest.raises(InputError, match="states"):
        st.energy_balance(st.models.mathieu(), run)
    function = st.System.from_function(lambda t, x, *, a=1.0: np.array([-a * x[0]]), states="x", period=1.0)
    with pytest.raises(InputError, match="Python function"):
        st.energy_balance(function, run)
