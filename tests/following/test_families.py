"""Detached branches: a closed curve known in closed form, and subharmonic orbits confirmed by direct integration."""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.errors import InputError
from stability.words import Kind, Status


def scalar(f, **parameters):
    return st.System(name="scalar", coordinates=("x",), states=("x",), parameters=parameters, rhs=(f,))


def test_an_isola_beside_a_trivial_branch():
    """x ((x - 3)^2 + r^2 - 1) = 0: the line x = 0 and the unit circle around (0, 3)."""
    x, r = sp.symbols("x r", real=True)
    line, circle = st.families(st.Equilibrium(scalar(-x * ((x - 3) ** 2 + r**2 - 1), r=0.0)), "r", (-2, 2))
    assert np.abs(line.columns["x"]).max() < 1e-12
    radius = (circle.columns["x"] - 3) ** 2 + circle.columns["r"] ** 2
    assert radius == pytest.approx(1.0, abs=1e-10)
    assert circle.status is Status.CLOSED_LOOP
    assert sorted(p.params["r"] for p in circle.of_kind(Kind.FOLD)) == pytest.approx([-1.0, 1.0], abs=1e-9)


def test_a_branch_that_reaches_both_ends_is_listed_once():
    x, r = sp.symbols("x r", real=True)
    (only,) = st.families(st.Equilibrium(scalar(r - x - x**3, r=0.0)), "r", (-1, 1))
    assert only.columns["x"] ** 3 + only.columns["x"] == pytest.approx(only.columns["r"], abs=1e-10)


def test_three_separate_lines_of_equilibria():
    """(x - 1)(x + 2)(x - 5 - r) = 0."""
    x, r = sp.symbols("x r", real=True)
    found = st.families(st.Equilibrium(scalar((x - 1) * (x + 2) * (x - 5 - r), r=0.0)), "r", (-1, 1))
    middles = sorted(branch.at(r=0.0)[0]["x"] for branch in found)
    assert middles == pytest.approx([-2.0, 1.0, 5.0], abs=1e-9)


def test_subharmonic_orbits_of_duffing_are_periodic_with_three_periods():
    """Every orbit at Omega = 4 returns after 3 periods under scipy's DOP853; one of them does not after one."""
    system = st.models.duffing(xi=0.005, beta=0.05)
    found = st.families(st.Collocation(system, multiple=3), "Omega", (3.0, 5.0))
    orbits = [orbit for branch in found for orbit in branch.at(Omega=4.0)]
    returns = []
    for orbit in orbits:
        T = 2 * np.pi / 4.0
        run = solve_ivp(
            lambda t, x: system(t, x, Omega=4.0), (0, 3 * T), orbit(0.0), "DOP853", t_eval=(T, 3 * T), rtol=1e-11,
            atol=1e-12,
        ).y  # fmt: skip
        assert run[:, 1] == pytest.approx(orbit(0.0), abs=1e-5 * np.abs(orbit(0.0)).max())
        returns.append(np.abs(run[:, 0] - orbit(0.0)).max() > 1e-2)
    assert any(returns) and not all(returns)
    places = np.array([orbit(0.0) for orbit in orbits])
    gaps = np.abs(places[:, None] - places[None]).max(axis=2) + np.eye(len(places))
    assert gaps.min() > 1e-3  # no orbit twice


def test_requests_that_make_no_sense():
    x, r = sp.symbols("x r", real=True)
    problem = st.Equilibrium(scalar(r * x - x**3, r=-1.0))
    with pytest.raises(InputError, match="places"):
        st.families(problem, "r", (-1, 1), places=-1)
    born = st.switch(st.continuation(problem, "r", (-1.0, 1.0))["BP1"])
    with pytest.raises(InputError, match="one branch"):
        st.families(born, "r", (-1, 1))
