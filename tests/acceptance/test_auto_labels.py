"""The textbook Duffing oscillator beside AUTO-07p: every label of AUTO's stored table, and what it misses or invents.

tests/data/auto_duffing.csv was made by tests/data/make_auto_duffing.py (NTST 200, NCOL 4). On these branches AUTO
* finds 3 of the 6 symmetry-breaking points at F = 5 and none of 8 at F = 10;
* prints two labels at F = 5 that are no points of their own, 2e-6 beside branch points it has already found;
* misses the fold at omega = 14.7747 for F = 25, and hops at omega = 0.3379 onto the asymmetric branch, which it then
  follows round and round (the table is cut at the first repetition).
"""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stability as st

TABLE = Path(__file__).parents[1] / "data" / "auto_duffing.csv"
FALSE = {5.0: [("LP", 0.37180224716), ("BP", 0.38522318038)]}
HOP = {25.0: 0.338}  # below this AUTO is on another branch
START = {5.0: 8.0, 10.0: 12.0, 25.0: 16.0}
KIND = {"LP": st.Kind.FOLD, "BP": st.Kind.BRANCH_POINT, "PD": st.Kind.PERIOD_DOUBLING}


def rows(F):
    with open(TABLE, encoding="utf-8") as stream:
        return [(r["kind"], float(r["omega"])) for r in csv.DictReader(stream) if float(r["F"]) == F]


@pytest.fixture(scope="module", params=[5.0, 10.0, 25.0])
def branch(request):
    system = st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=request.param)
    return request.param, st.continuation(st.Collocation(system), "omega", (START[request.param], 0.3))


def test_every_true_label_of_auto_is_found(branch):
    F, ours = branch
    for kind, omega in rows(F):
        if (kind, omega) in FALSE.get(F, []) or omega < HOP.get(F, 0.0):
            continue
        found = [p.params["omega"] for p in ours.of_kind(KIND[kind])]
        assert min(abs(f - omega) for f in found) < 5e-9, (kind, omega)


def test_labels_that_are_no_points(branch):
    F, ours = branch
    for kind, omega in FALSE.get(F, []):
        found = [p.params["omega"] for p in ours.special]
        assert 1e-6 < min(abs(f - omega) for f in found) < 5e-6, (kind, omega)


def test_what_auto_misses_is_there(branch):
    """Multiplier +1 at each of our points, by scipy's DOP853 with the variational equations."""
    F, ours = branch
    known = [omega for _, omega in rows(F)]
    missed = [p for p in ours.special if min(abs(p.params["omega"] - k) for k in known) > 1e-7]
    assert len(missed) >= {5.0: 3, 10.0: 8, 25.0: 10}[F]
    for point in missed:
        omega = point.params["omega"]

        def variations(time, z, omega=omega, F=F):
            x, v, a, b, c, d = z
            k = -1.0 - 3.0 * x * x
            force = -0.1 * v - x - x**3 + F * np.cos(omega * time)
            return [v, force, c, d, k * a - 0.1 * c, k * b - 0.1 * d]

        orbit = point.solution
        start = [*orbit(0.0), 1.0, 0.0, 0.0, 1.0]
        end = solve_ivp(variations, (0, orbit.period), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        assert end[:2] == pytest.approx(orbit(0.0), abs=1e-6)
        multipliers = np.linalg.eigvals(np.array([[end[2], end[3]], [end[4], end[5]]]))
        assert np.abs(multipliers - 1).min() < 2e-6, (point.label, omega, multipliers)


def test_the_branch_onto_which_auto_hops():
    system = st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=25.0)
    ours = st.continuation(st.Collocation(system), "omega", (16.0, 0.3))
    (crossing,) = [p for p in ours.of_kind(st.Kind.BRANCH_POINT) if abs(p.params["omega"] - 0.337904) < 1e-5]
    asymmetric = st.continuation(st.switch(crossing), "omega", (0.25, 1.0))
    doublings = [p.params["omega"] for p in asymmetric.of_kind(st.Kind.PERIOD_DOUBLING)]
    for kind, omega in rows(25.0):
        if kind == "PD":
            assert min(abs(d - omega) for d in doublings) < 1e-8


def test_a_period_doubling_cascade_to_eight_periods():
    """2T, 4T, 8T branches, each with two doublings of its own; the distances shrink by Feigenbaum's 4.669 in the end."""
    system = st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=25.0)
    branch = st.continuation(st.Collocation(system), "omega", (3.0, 1.5))
    branch = st.continuation(st.switch(branch["BP1"]), "omega", (0.8, 3.0))
    doublings = []
    for period in (1, 2, 4, 8):
        if period > 1:
            branch = st.continuation(st.switch(point), "omega", (0.8, 3.0), max_points=400)  # noqa: F821
            middle = len(branch) // 2
            assert branch.solution(middle).period == pytest.approx(period * 2 * np.pi / branch.parameter[middle], rel=1e-12)
        point = max(branch.of_kind(st.Kind.PERIOD_DOUBLING), key=lambda p: p.params["omega"])
        assert np.abs(point.multipliers + 1).min() < 1e-7
        doublings.append(point.params["omega"])
    steps = -np.diff(doublings)
    assert (steps > 0).all() and 4.0 < steps[1] / steps[2] < 7.0
