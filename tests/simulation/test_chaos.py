"""Lyapunov spectra against published values, divergences and Floquet exponents; period doublings against continuation."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, InputError

LORENZ = np.array([0.9056, 0.0, -14.572])  # Sprott (2003), Chaos and Time-Series Analysis, appendix A


def test_lorenz_within_its_error_bars():
    found = st.lyapunov(st.models.lorenz(), 1000.0, x0=[1.0, 1.0, 20.0])
    assert (np.abs(found.exponents - LORENZ) < 4 * found.error).all() and (found.error < 0.03).all()
    assert abs(found.divergence + 10 + 1 + 8 / 3) < 1e-6 and found.chaotic
    assert abs(found.dimension - 2.062) < 0.002


@pytest.mark.slow
def test_lorenz_to_three_digits():
    found = st.lyapunov(st.models.lorenz(), 20000.0, x0=[1.0, 1.0, 20.0])
    assert (np.abs(found.exponents - LORENZ) < np.maximum(3 * found.error, 1e-3)).all() and found.error.max() < 2e-3


def test_stable_orbit_has_its_floquet_exponents():
    system = st.models.duffing(xi=0.1, beta=0.05, Omega=1.4)
    found = st.lyapunov(system, 400.0, transient=400.0)
    orbit = st.solve(st.Collocation(system))
    assert (np.abs(found.exponents - np.sort(orbit.exponents.real)[::-1]) < 3 * found.error).all() and found.error.max() < 0.02
    assert abs(found.divergence + 0.2) < 1e-8 and found.dimension == 0 and not found.chaotic


def test_chaotic_double_well():
    """Holmes' Duffing equation at delta = 0.3, gamma = 0.5, omega = 1.2: chaotic, and the sum is -delta exactly."""
    system = st.models.duffing_textbook(delta=0.3, alpha=-1.0, beta=1.0, gamma=0.5, omega=1.2)
    found = st.lyapunov(system, 1500.0)
    assert found.chaotic and abs(found.divergence + 0.3) < 1e-8 and 1 < found.dimension < 2


def test_impacts_count_in_the_sum():
    """Hard stops: the sum is -2 xi + 2 log(e) x impacts per unit time."""
    system = st.models.hard_stop_oscillator(xi=0.05, gap=1.0, restitution=0.8, Omega=1.3)
    T = system.period
    found = st.lyapunov(system, 100 * T, transient=20 * T)
    run = st.simulate(system, (0, 120 * T), rtol=1e-8, atol=1e-10)
    impacts = sum(e.kind == "impact" and e.t > 20 * T for e in run.events)
    assert abs(found.divergence - (-2 * 0.05 + 2 * np.log(0.8) * impacts / (100 * T))) < 2e-2 / T


def test_period_doubling_where_continuation_puts_it():
    """The double well's motion around x = 1: PD1 by continuation lies between the last motion of period T and the first
    of period 2T of the sweep; the next doubling is between 2T and 4T."""
    system = st.models.duffing_textbook(delta=0.3, alpha=-1.0, beta=1.0, gamma=0.2, omega=1.2)
    branch = st.continuation(st.Collocation(system), "gamma", (0.2, 0.3), start=dict(x=1.0))
    point = next(p for p in branch.special if p.kind is st.Kind.PERIOD_DOUBLING).params["gamma"]
    run = st.sweep(system, "gamma", (0.26, 0.29), step=0.001, periods=600, record=8, x0=dict(x=1.0))
    multiples = run.multiple
    assert run.settled.all() and set(multiples.tolist()) == {1, 2, 4} and (np.diff(multiples) >= 0).all()
    assert run.parameter[multiples == 1].max() < point < run.parameter[multiples == 2].min()
    section = run.section["x"]
    assert section.shape == (31, 8) and np.ptp(section[0]) < 1e-4 and np.ptp(section[10]) > 0.05
    assert np.abs(section[:, 0] - section[:, 4]).max() < 1e-4  # all of them repeat after four periods


def test_bad_input():
    with pytest.raises(InputError, match="duration"):
        st.lyapunov(st.models.lorenz(), -1.0)
    t = sp.Symbol("t", real=True)
    x = sp.Function("x")(t)
    runaway = st.System.from_equations({x.diff(t): x**2}, [x], parameters={})
    with pytest.raises(ConvergenceError, match="diverged"):
        st.lyapunov(runaway, 20.0, x0=[1.0])
    with pytest.raises(ConvergenceError, match="escaping"):
        st.lyapunov(runaway, 10.0, x0=[1.0])
