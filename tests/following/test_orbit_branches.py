"""Branches of periodic orbits end to end, through `Collocation`.

Witnesses: folds of the Duffing oscillator and points of the pendulum as found by other programs (values in the
project's issue and studies), period of van der Pol's orbit, the Lorenz homoclinic value, identities of multipliers, and
the other direction of the same branch.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import stability as st

FOLDS = (1.380933030, 1.088436639)


@pytest.fixture(scope="module")
def resonance() -> st.Branch:
    return st.continuation(st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.3, 3.0))


def test_folds_of_the_duffing_resonance(resonance: st.Branch) -> None:
    assert resonance.labels == ("LP1", "LP2") and resonance.status is st.Status.PARAMETER_BOUND
    np.testing.assert_allclose([p.params["Omega"] for p in resonance.special], FOLDS, atol=1e-9)
    assert resonance.parameter[-1] == 3.0


def test_the_same_folds_from_the_other_end(resonance: st.Branch) -> None:
    back = st.continuation(st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (3.0, 0.3))
    np.testing.assert_allclose([p.params["Omega"] for p in back.special], FOLDS[::-1], atol=1e-9)


def test_a_fold_has_the_multiplier_one(resonance: st.Branch) -> None:
    for point in resonance.special:
        assert np.abs(point.multipliers - 1).min() < 1e-8
    unstable = [s for s in resonance.segments() if s.verdict is st.Verdict.UNSTABLE]
    assert len(unstable) == 1
    assert {int(resonance.marks[i]) for i in (unstable[0].start, unstable[0].stop - 1)} == {0, 1}


def test_product_of_multipliers_is_liouvilles(resonance: st.Branch) -> None:
    """mu_1 mu_2 = exp(-2 xi T) at every point, whatever the amplitude."""
    expected = np.exp(-2 * 0.02 * 2 * np.pi / resonance.parameter)
    np.testing.assert_allclose(np.prod(resonance.values, axis=1).real, expected, rtol=1e-7)


def test_three_solutions_between_the_folds(resonance: st.Branch) -> None:
    upper, middle, lower = sorted(resonance.at(Omega=1.2), key=lambda o: -o.max["u"])
    assert [o.verdict for o in (upper, middle, lower)] == [st.Verdict.STABLE, st.Verdict.UNSTABLE, st.Verdict.STABLE]
    assert upper.max["u"] > middle.max["u"] > lower.max["u"]


def test_open_resonance() -> None:
    """beta = 0.05: no fold from the low end; the detached family from the other end has its fold at 1.416368134."""
    problem = st.Collocation(st.models.duffing(xi=0.02, beta=0.05))
    assert st.continuation(problem, "Omega", (0.3, 3.0)).labels == ()
    detached = st.continuation(problem, "Omega", (3.0, 0.3))
    assert detached.labels == ("LP1",) and detached["LP1"].params["Omega"] == pytest.approx(1.416368134, abs=1e-9)


def test_van_der_pol_period() -> None:
    problem = st.Collocation(st.models.van_der_pol())
    branch = st.continuation(problem, "mu", (0.5, 3.0), start={"x": 2.0}, at=(1.0,))
    assert branch["UZ1"].solution.period == pytest.approx(6.6632868593, abs=1e-8)
    assert branch.count(st.Verdict.UNSTABLE) == 0 and branch.special[0].kind is st.Kind.USER


def test_lorenz_orbits_end_at_the_homoclinic() -> None:
    """Born at 470/19, unstable, the period grows without bound toward rho = 13.926557407520 (Doedel and others)."""
    flow = st.Equilibrium(st.models.lorenz())
    fixed = st.continuation(flow, "rho", (15, 30), start={"x": 6, "y": 6, "z": 14})
    orbits = st.continuation(st.switch(fixed["HB1"]), "rho", (13.0, 30.0))
    assert orbits.status is st.Status.DIVERGED
    assert orbits.parameter[0] == pytest.approx(470 / 19, abs=1e-9)
    assert orbits.parameter[-1] == pytest.approx(13.926557407520, abs=1e-8)
    assert orbits.solution(-1).period > 8 and not orbits.of_kind(st.Kind.UNEXPLAINED)
    assert not orbits.of_kind(st.Kind.FOLD)  # the contracted multiplier is rounding of the other one, of 1e9 and more


@pytest.mark.parametrize(
    ("length_ratio", "mass_ratio", "omegas"), [(10.0, 0.2, (0.835733105945, 0.7429760406))], ids=["P2"]
)
def test_pendulum_instability_and_the_branch_born_there(
    length_ratio: float, mass_ratio: float, omegas: tuple[float, float]
) -> None:
    """The period doubling and the symmetry breaking of the study of research/continuation-performance.md."""
    system = st.models.autoparametric_pendulum(
        length_ratio=length_ratio, mass_ratio_total=mass_ratio, Omega0=0.5, xi1=0.02, xi2=0.01, base_term=False
    )
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.5))
    assert semi.labels == ("PD1", "PD2")
    assert semi["PD1"].params["Omega"] == pytest.approx(omegas[0], abs=1e-10)
    for point in semi.special:
        assert np.abs(point.multipliers + 1).min() < 1e-8
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.5))
    assert swing["BP1"].params["Omega"] == pytest.approx(omegas[1], abs=1e-8)
    assert swing.status is st.Status.CLOSED_LOOP and not swing.of_kind(st.Kind.UNEXPLAINED)
    assert swing.special[-1].params["Omega"] == pytest.approx(semi["PD2"].params["Omega"], abs=1e-7)
    assert swing.solution(5).max["theta"] > 0.01


def test_asymmetric_loops_are_followed_once() -> None:
    """From a symmetry-breaking point to the other one and back along the mirror image: closed, every point twice."""
    system = st.models.autoparametric_pendulum(
        length_ratio=10.0, mass_ratio_total=0.2, Omega0=0.5, xi1=0.02, xi2=0.01, base_term=False
    )
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.5))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.5))
    for born, other in (("BP1", "BP2"), ("BP3", "BP4")):
        loop = st.continuation(st.switch(swing[born]), "Omega", (0.5, 1.5))
        assert loop.status is st.Status.CLOSED_LOOP
        crossings = [p.params["Omega"] for p in loop.of_kind(st.Kind.BRANCH_POINT)]
        np.testing.assert_allclose(crossings, [swing[born].params["Omega"], swing[other].params["Omega"]], atol=1e-7)
        for kind in (st.Kind.PERIOD_DOUBLING, st.Kind.NEIMARK_SACKER, st.Kind.FOLD):
            places = sorted(p.params["Omega"] for p in loop.of_kind(kind))
            np.testing.assert_allclose(places[::2], places[1::2], atol=1e-8)


def test_default_pendulum_goes_to_a_torus() -> None:
    semi = st.continuation(st.Collocation(st.models.autoparametric_pendulum()), "Omega", (0.5, 1.5))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.5))
    torus = swing["NS1"]
    pair = torus.multipliers[np.abs(torus.multipliers.imag) > 1e-6]
    assert np.abs(np.abs(pair) - 1).min() < 1e-8
    assert np.abs(np.prod(torus.multipliers) - np.exp(-2 * (0.002 + 0.005 * 0.48) * torus.solution.period)) < 0.05


def test_cascade_of_the_textbook_oscillator() -> None:
    """Symmetry breaking, 2T, 4T: the doublings lie inside one another and shrink by Feigenbaum's kind of ratio."""
    system = st.models.duffing_textbook(delta=0.1, gamma=25.0)
    branch = st.continuation(st.Collocation(system), "omega", (3.0, 1.1))
    asymmetric = st.continuation(st.switch(branch["BP1"]), "omega", (3.0, 1.1))
    intervals = []
    for _ in range(3):
        doublings = sorted(p.params["omega"] for p in asymmetric.of_kind(st.Kind.PERIOD_DOUBLING))
        intervals.append((doublings[0], doublings[-1]))
        first = max(asymmetric.of_kind(st.Kind.PERIOD_DOUBLING), key=lambda p: p.params["omega"])
        asymmetric = st.continuation(st.switch(first), "omega", (3.0, 1.1))
        assert not asymmetric.of_kind(st.Kind.UNEXPLAINED)
    assert all(outer[0] < inner[0] < inner[1] < outer[1] for outer, inner in pairwise(intervals))
    steps = [a[1] - b[1] for a, b in pairwise(intervals)]
    assert steps[0] > 3 * steps[1] > 0


def test_stored_branch_goes_on(resonance: st.Branch, tmp_path: object) -> None:
    resonance.save(f"{tmp_path}/duffing.npz")
    again = st.load(f"{tmp_path}/duffing.npz")
    for a, b in zip(resonance.at(Omega=1.25), again.at(Omega=1.25)):
        assert a.max["u"] == pytest.approx(b.max["u"], rel=1e-12)
    wider = again.extend(window=(0.3, 3.5))
    assert wider.parameter[-1] == 3.5 and wider.labels == again.labels


def test_undamped_resonance_is_climbed_as_far_as_the_digits_go() -> None:
    """xi = 0, beta = 0.05: no fold ends the climb along the third superharmonic resonance; both multipliers come so
    close to 1 that Newton's update stops at rounding, and no mesh helps. Witness: one period integrated at the far end."""
    system = st.models.duffing(xi=0.0, beta=0.05)
    branch = st.continuation(st.Collocation(system), "Omega", (0.3, 3.0))
    assert branch.status is st.Status.PARAMETER_BOUND and branch.labels == ()
    assert max(p.mesh.intervals for p in branch.meshes) < 100
    assert 1e-12 < branch.error[-1] < 1e-3  # said, not hidden
    last = branch.solution(-1)
    path = st.simulate(system, (0.0, last.period), x0=last(0.0), rtol=1e-12, atol=1e-12, Omega=3.0)
    size = np.array([last.max["u"], last.max["u_dot"]])
    assert np.abs((path(last.period) - last(0.0)) / size).max() < 100 * branch.error[-1] < 1e-2


def test_far_end_of_a_family_is_named_after_its_parent() -> None:
    """The doubled family of the pendulum ends at the second period doubling of its parent, cycles at a Hopf point."""
    system = st.models.autoparametric_pendulum(
        length_ratio=10.0, mass_ratio_total=0.2, Omega0=0.5, xi1=0.02, xi2=0.01, base_term=False
    )
    semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.5))
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.5))
    end = swing["parent's PD"]
    assert end is swing.special[-1] and end.params["Omega"] == pytest.approx(semi["PD2"].params["Omega"], abs=1e-8)
    assert [p.name for p in swing.special[:-1]] == [""] * (len(swing.special) - 1)


@pytest.mark.parametrize("problem", ["balance", "rough mesh"])
def test_a_pitchfork_met_on_its_own_side_branch_is_one_point(problem: str) -> None:
    """From one symmetry-breaking point to the other and back: two branch points, no folds beside them."""
    system = st.models.duffing_textbook(delta=0.1, alpha=1, beta=1, gamma=5)
    balance = st.HarmonicBalance(system, harmonics=15)
    solver = balance if problem == "balance" else st.Collocation(system, accuracy=1e-7)
    symmetric = st.continuation(solver, "omega", (0.85, 1.35))
    breaking = [p.params["omega"] for p in symmetric.of_kind(st.Kind.BRANCH_POINT)]
    for born in symmetric.of_kind(st.Kind.BRANCH_POINT):
        loop = st.continuation(st.switch(born), "omega", (0.85, 1.35))
        crossings = sorted(p.params["omega"] for p in loop.of_kind(st.Kind.BRANCH_POINT))
        np.testing.assert_allclose(crossings, sorted(breaking), atol=1e-6)
        assert len(loop.of_kind(st.Kind.FOLD)) == 4 and not loop.of_kind(st.Kind.UNEXPLAINED)
