"""Liouville's formula as a witness at every point: the product of the multipliers is exp(int tr J dt).

Witness: the constant divergence -2 xi of the Duffing oscillator, for which the integral is known without quadrature;
a monodromy matrix that is damaged on purpose must cost the verdict that the damage could have turned.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.problems.collocation_spectrum import growth_of_volume
from stability.problems.orbit_spectrum import liouville_gap


def solved(**params: float):
    problem = st.Collocation(st.models.duffing(xi=1e-4, beta=0.001, **params))
    p = problem.system.parameter_vector()
    return problem, problem.linearise(problem.start(p), p)


def test_volume_by_quadrature_is_that_of_a_constant_divergence():
    problem, L = solved(Omega=0.5)
    assert growth_of_volume(L) == pytest.approx(-2 * 1e-4 * 2 * np.pi / 0.5, rel=1e-13)
    assert liouville_gap(problem.spectrum(L).values, growth_of_volume(L)) < 1e-11


@pytest.mark.parametrize("damage", [3e-3, 1e-2])
def test_a_damaged_monodromy_matrix_loses_its_verdict(damage):
    """Multipliers of modulus 0.9987: true by their own error; with one interval's map wrong by 1 % they may be outside."""
    problem, L = solved(Omega=0.5)
    sound = problem.spectrum(L)
    assert sound.verdict is st.Verdict.STABLE and sound.error < 1e-9
    L.work.M[7] *= 1 - damage
    broken = problem.spectrum(dataclasses.replace(L))
    assert np.abs(broken.values).max() < np.abs(sound.values).max()
    assert broken.error > damage and broken.verdict is st.Verdict.UNDETERMINED


def test_contracted_multipliers_are_not_mistaken_for_others():
    """A multiplier 1e-9 that is wrong by a factor of 100 says nothing about one of 0.999; one of 0.1 does."""
    assert liouville_gap(np.array([0.999, 1e-7], complex), np.log(0.999e-9)) < 2e-4
    assert liouville_gap(np.array([0.999, 0.11], complex), np.log(0.0999)) == pytest.approx(0.1, rel=0.1)
    assert liouville_gap(np.array([np.inf, 0.1], complex), 0.0) == 0.0


def test_a_product_too_large_is_explained_by_faint_multipliers_only():
    """e^-6000 found as 0.018 says nothing about 0.79; too small a product, or one with no faint factor, does."""
    pair = np.array([0.79 + 0.07j, 0.79 - 0.07j, 0.018])
    assert liouville_gap(pair, -6000.0) == 0.0
    assert liouville_gap(np.array([0.9, 0.02 + 0.01j, 0.02 - 0.01j]), -6000.0) == 0.0
    assert liouville_gap(pair, np.log(0.003)) > 0.7  # the smallest would be 0.005: known well, and it is not that
    assert liouville_gap(pair, np.log(0.02)) > 0.7  # too small
    assert liouville_gap(np.array([0.9 + 0.1j, 0.9 - 0.1j]), -20.0) > 0.8  # no others: both are wrong
    assert liouville_gap(np.array([5.0 + 0j, 3.0 + 0j]), -20.0) > 0.9  # outside: the verdict is theirs


def test_a_stiff_state_costs_no_verdict_of_the_others():
    """Circuit with L/R = 17 us beside a period of 0.1 s: multiplier e^-6000. Shooting (implicit, adaptive) agrees."""
    system = st.models.harvester.from_physical(cubic=1.9e7)
    orbits = [st.solve(problem(system), frequency=10.0) for problem in (st.Collocation, st.Shooting)]
    assert [orbit.verdict for orbit in orbits] == [st.Verdict.STABLE] * 2
    np.testing.assert_allclose(orbits[0].multipliers[:2], orbits[1].multipliers[:2], atol=1e-8)
    branch = st.continuation(st.Collocation(system), "frequency", (20.0, 32.0))
    assert branch.count(st.Verdict.UNDETERMINED) <= len(branch.special) and branch.count(st.Verdict.UNSTABLE) > 0


def test_errors_on_a_branch_contain_the_gap():
    """The error of every point of the textbook oscillator's branch is at least what Liouville's formula measures."""
    branch = st.continuation(st.Collocation(st.models.duffing_textbook(delta=0.1, gamma=25.0)), "omega", (3.0, 1.5))
    exact = np.exp(-0.1 * 2 * np.pi / branch.parameter)
    floor = 1e-3 * np.maximum(1, np.abs(branch.values[:, :1]))
    missed = np.abs(np.prod(branch.values, axis=1).real - exact)
    assert (missed / np.prod(np.maximum(np.abs(branch.values), floor), axis=1) <= branch.value_errors + 1e-15).all()
    assert branch.value_errors.max() < 1e-5


def test_halved_orbits_keep_the_orientation_of_their_symmetry():
    """N = S^-1 Phi of the half period with S = -1 on two states: det S = +1; on the one state of x' = -x + cos: -1."""
    t, Omega = sp.symbols("t Omega", real=True)
    x = sp.Function("x")(t)
    relaxing = st.System.from_equations(
        {x.diff(t): -x - x**3 + sp.cos(Omega * t)}, coordinates=[x], parameters={"Omega": 1.0}, period=2 * sp.pi / Omega
    )
    problems = [st.Collocation(system, symmetry="auto") for system in (st.models.duffing(), relaxing)]
    assert [problem.orientation for problem in problems] == [1.0, -1.0]
    for problem in problems:
        p = problem.system.parameter_vector()
        L = problem.linearise(problem.start(p), p)
        assert liouville_gap(problem.spectrum(L).values, growth_of_volume(L), problem.orientation) < 1e-10
