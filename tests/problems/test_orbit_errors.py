"""The error of an orbit at a singular point: a number like its neighbours', and like the true one.

Witness: the same special point on a mesh of four times as many intervals of a higher degree.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import stability as st


@pytest.fixture(scope="module")
def branch() -> st.Branch:
    system = st.models.duffing_textbook(delta=0.1, gamma=25.0)
    return st.continuation(st.Collocation(system, accuracy=1e-7), "omega", (3.0, 1.1))


def index_of(branch: st.Branch, label: str) -> int:
    """The point of the branch that carries a label."""
    return next(k for k, m in enumerate(branch.marks.tolist()) if m >= 0 and branch.special[m].label == label)


def test_error_at_folds_and_branch_points_is_that_of_their_neighbours(branch: st.Branch) -> None:
    for label in ("BP1", "BP2", "LP1", "LP2"):
        i = index_of(branch, label)
        beside = [branch.error[k] for k in (i - 1, i + 1)]
        assert 0.01 * min(beside) < branch.error[i] < 10 * max(beside), label
        assert branch[label].solution.error == pytest.approx(branch.error[i], rel=1e-6)


@pytest.mark.parametrize("label", ["BP1", "BP2", "LP1", "LP2"])
def test_estimate_against_a_fine_mesh(branch: st.Branch, label: str) -> None:
    i = index_of(branch, label)
    point, beside = branch[label], branch.solution(i - 1)
    at, near = point.params["omega"], beside.params["omega"]
    fine = st.Collocation(branch.meshes[0].system, intervals=120, degree=7, adaptive=False)
    window = (min(at, near) - 0.01, max(at, near) + 0.01)
    other = st.continuation(fine, "omega", window, start=beside)
    again = min(other.of_kind(point.kind), key=lambda p: abs(p.params["omega"] - at))
    assert again.params["omega"] == pytest.approx(at, abs=1e-6)
    nodes = branch._problem(i).mesh.edges
    one, two = point.solution(nodes * point.solution.period), again.solution(nodes * again.solution.period)
    wrong = float(np.abs((one - two) / np.abs(two).max(axis=1)[:, None]).max())
    assert wrong < 30 * point.solution.error + 1e-10
    assert point.solution.error < 30 * wrong + 1e-10


def test_doubled_orbits_where_they_meet_their_parent(branch: st.Branch) -> None:
    lopsided = st.continuation(st.switch(branch["BP1"]), "omega", (3.0, 1.1))
    doubled = st.continuation(st.switch(lopsided["PD1"]), "omega", (3.0, 1.1))
    for born in (lopsided, doubled):
        for point in born.of_kind(st.Kind.BRANCH_POINT):
            assert point.solution.error < 1e-6


def test_highest_degree_and_orbits_at_their_birth() -> None:
    """Degree 11 is compared with degree 10; an orbit of no size has an error too."""
    steep = st.Collocation(st.models.duffing(xi=0.02, beta=0.001), degree=11, intervals=8)
    fold = st.continuation(steep, "Omega", (1.0, 1.5))["LP1"]
    assert 0 < fold.solution.error < 1e-6
    rest = st.continuation(st.Equilibrium(st.models.van_der_pol()), "mu", (-1, 1))
    cycles = st.continuation(st.switch(rest["HB1"]), "mu", (-1, 1), max_points=5)
    assert np.isfinite(cycles.error[1:]).all()


def test_a_mesh_made_for_one_orbit_is_not_trusted_with_another():
    """A magnet on one side: the sharp turn moves along the orbit, away from the fine part of the mesh, and flattens.

    The error that is carried from point to point must see it (the m-th derivative alone falls). Witness: the error of
    every orbit by a step of its own.
    """
    system = st.models.one_sided_magnet.from_physical()
    branch = st.continuation(st.Collocation(system), "frequency", (17.0, 30.0), ds_max=0.05, start=None)
    folds = [p.params["frequency"] for p in branch.special]
    away = [i for i in range(2, len(branch), 3) if all(abs(branch.parameter[i] - f) > 0.2 for f in folds)]
    assert len(folds) == 2 and len(away) > 20
    errors = np.array([branch.solution(i).error for i in away])
    assert errors.max() < 1e-8 and np.median(errors) < 1e-9


@pytest.mark.parametrize(
    ("system", "name", "window"),
    [
        (st.models.duffing(xi=0.02, beta=0.001), "Omega", (0.3, 3.0)),
        (st.models.autoparametric_pendulum(), "Omega", (0.7, 1.3)),
        (st.models.duffing_textbook(delta=0.1, gamma=5.0), "omega", (8.0, 0.3)),
    ],
)
def test_errors_of_multipliers_along_a_branch_are_not_understated(system, name, window):
    """Most are carried over from an earlier point. Witness: the step at a higher degree, taken at every point."""
    branch = st.continuation(st.Collocation(system), name, window)
    for i in range(0, len(branch), 2):
        problem = dataclasses.replace(branch._problems[branch.mesh_of[i]], _memo={})
        params = system.parameter_vector(**{name: branch.parameter[i]})
        measured = problem.spectrum(problem.linearise(branch.unknowns[i], params)).error
        assert measured < max(4 * branch.value_errors[i], 1e-9)
