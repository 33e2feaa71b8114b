"""Verdicts and multipliers do not depend on how an orbit is discretised; special points have their multiplier.

Witnesses: meshes of 10, 20, 40 intervals and shooting with 1, 3, 5 segments against each other, on families that are
stable, unstable by +1, by -1 and by a pair; a multiplier +1 or -1 at folds, branch points, doublings, |mu| = 1 at torus
points, within the error that is stated for the multipliers there.
"""

from __future__ import annotations

import numpy as np
import pytest

import stability as st
from stability.errors import StabilityError

FAMILIES = {
    "bent resonance": (lambda: st.models.duffing(xi=0.02, beta=0.001), "Omega", (0.8, 1.6), ()),
    "symmetry breaking": (lambda: st.models.duffing_textbook(delta=0.1, gamma=5.0), "omega", (0.8, 1.5), ("BP1",)),
    "period doubling": (lambda: st.models.duffing_textbook(delta=0.1, gamma=25.0), "omega", (2.4, 1.25), ("BP1",)),
    "pendulum": (
        lambda: st.models.autoparametric_pendulum(
            length_ratio=10.0, mass_ratio_total=0.2, Omega0=0.5, xi1=0.02, xi2=0.01
        ),
        "Omega", (0.7, 1.3), ("PD1",),
    ),
    "cycle": (lambda: st.models.van_der_pol(), "mu", (0.3, 2.0), None),
}  # fmt: skip


def followed(name: str) -> tuple[st.Branch, ...]:
    model, parameter, window, born = FAMILIES[name]
    start = {"start": dict(x=2.0)} if born is None else {}
    branches = [st.continuation(st.Collocation(model()), parameter, window, **start)]
    for label in born or ():
        branches.append(st.continuation(st.switch(branches[-1][label]), parameter, window))
    return tuple(branches)


def verdicts(branch: st.Branch, indices: list[int]) -> np.ndarray:
    """(orbits, methods) of the same orbits by six discretisations, each starting from the orbit of the branch."""
    problem = branch.meshes[0]
    common = {"multiple": problem.multiple, "winding": problem.winding}
    problems = [st.Collocation(problem.system, intervals=n * problem.multiple, adaptive=False, **common) for n in (10, 20, 40)]
    problems += [st.Shooting(problem.system, segments=m, **common) for m in (1, 3, 5)]
    table = []
    for i in indices:
        orbit, row = branch.solution(i), [str(branch.verdicts[i])]
        for one in problems:
            try:
                again = st.solve(one, start=orbit, **{branch.name: float(branch.parameter[i])})
            except StabilityError:
                row.append("none")  # single shooting of an orbit with multipliers of 1e5
                continue
            near = np.abs(again.x.max(axis=1) - orbit.x.max(axis=1)) <= 1e-2 * np.abs(orbit.x).max(axis=1) + 1e-6
            row.append(str(again.verdict) if near.all() else "none")
        table.append(row)
    return np.array(table)


def agree(tables: list[np.ndarray]) -> None:
    rows = [row for table in tables for row in table]
    for row in rows:
        assert not {"stable", "unstable"} <= set(row), row
    everything = np.concatenate([t.ravel() for t in tables])
    assert np.mean(everything == "undetermined") <= 0.02, everything
    assert np.mean(everything == "none") <= 0.05
    assert {"stable", "unstable"} <= set(everything)


@pytest.mark.slow
def test_verdicts_of_five_families() -> None:
    tables = []
    for name in FAMILIES:
        for branch in followed(name):
            ordinary = [i for i in range(len(branch)) if branch.marks[i] < 0]
            tables.append(verdicts(branch, ordinary[2 :: max(1, len(ordinary) // 12)]))
    agree(tables)


def test_verdicts_of_the_bent_resonance() -> None:
    (branch,) = followed("bent resonance")
    ordinary = [i for i in range(len(branch)) if branch.marks[i] < 0]
    agree([verdicts(branch, ordinary[3::7])])


@pytest.mark.parametrize("name", ["bent resonance", "symmetry breaking", "period doubling", "pendulum"])
@pytest.mark.parametrize("intervals", [10, 20, 40])
def test_critical_multipliers_within_their_stated_error(name: str, intervals: int) -> None:
    """On meshes that are kept: a rough one moves the special point, not the multiplier of its own orbit there."""
    model, parameter, window, born = FAMILIES[name]
    problem = st.Collocation(model(), intervals=intervals, adaptive=False)
    branch = st.continuation(problem, parameter, window)
    checked = 0
    for one in (branch, *(st.continuation(st.switch(branch[label]), parameter, window) for label in born or ())):
        for i in np.nonzero(one.marks >= 0)[0].tolist():
            point, values = one.special[one.marks[i]], one.values[i]
            critical = {st.Kind.FOLD: 1.0, st.Kind.BRANCH_POINT: 1.0, st.Kind.PERIOD_DOUBLING: -1.0}
            if point.kind in critical:
                distance = np.abs(values - critical[point.kind]).min()
            elif point.kind is st.Kind.NEIMARK_SACKER:
                distance = np.abs(np.abs(values[values.imag != 0]) - 1).min()
            else:
                continue
            assert distance <= one.value_errors[i] + 1e-7, (point, distance, one.value_errors[i])
            checked += 1
    assert checked >= 2
