"""When a hop over a branch point is feared. Witness: values along normal forms, and a pitchfork that a mesh unfolds."""

from types import SimpleNamespace

import numpy as np
import pytest

import stability as st
from stability.following.events import matched
from stability.following.points import Point, smooth_tests
from stability.following.searching import _foretold
from stability.problems.orbit_spectrum import orbit_spectrum
from stability.protocols import Critical, Tangent
from stability.words import Kind

PROBLEM = SimpleNamespace(critical=Critical(True, Kind.NEIMARK_SACKER, -1.0))


def foretold(places, values, rates):
    points = []
    for k, (s, two, rate) in enumerate(zip(places, values, rates)):
        two = np.array(two, complex)
        spectrum, step = orbit_spectrum(two, 1e-9), s - places[max(k - 1, 0)]
        tangent, tests = Tangent(np.zeros(1), rate, 1.0), smooth_tests(two, True)
        points.append(Point(PROBLEM, np.zeros(1), np.zeros(1), s, tangent, spectrum, tests, 1, 0.0, 1, s, step))
    three = points[0], points[1], points[2]
    return _foretold(three, matched(three))


@pytest.mark.parametrize("sign", [1, -1])
def test_a_value_that_should_have_passed_the_limit(sign):
    """exp(s - 0.35) at 0.1, 0.3, then back on the other branch, at exp(-2 (s - 0.35)): a hop at +1, nothing at -1."""
    s = np.array([0.1, 0.3, 0.5])
    mu = np.exp(np.where(s < 0.4, s - 0.35, -2 * (s - 0.35)))
    assert foretold(s, [(sign * m, 0.2) for m in mu], [0.3] * 3) is (sign == 1)


def test_past_a_fold_only_the_value_at_the_limit_counts():
    """Past a fold at s = 0 the rate is s/3, the value there exp(s); the ratio of another value has a pole there."""
    s = np.array([0.01, 0.05, 0.13])
    assert not foretold(s, [(np.exp(x), 0.8 * np.exp(-x)) for x in s], s / 3)
    # with a branch point at 0.1 the value is exp(10 s (0.1 - s)); having hopped, it goes on like exp(20 s (s - 0.1))
    values = [(np.exp(10 * x * (0.1 - x)) if x < 0.1 else np.exp(20 * x * (x - 0.1)), 0.4) for x in s]
    assert foretold(s, values, s / 3)


@pytest.mark.parametrize("accuracy", [1e-9, 1e-8])
def test_a_pitchfork_that_the_mesh_unfolds_is_a_branch_point(accuracy):
    """x'' + 0.1 x' + x + x^3 = 25 cos(w t): asymmetric orbits on the whole period end where they are symmetric."""
    system = st.models.duffing_textbook(delta=0.1, gamma=25.0)
    half = st.continuation(st.Collocation(system, symmetry="auto", accuracy=1e-11), "omega", (3.0, 1.0))
    whole = st.continuation(st.Collocation(system, accuracy=accuracy), "omega", (3.0, 1.8), stop_at=("BP1",))
    born = st.continuation(st.switch(whole["BP1"]), "omega", (0.5, 3.0))
    ends = [p.params["omega"] for p in born.of_kind(Kind.BRANCH_POINT)]
    exact = [p.params["omega"] for p in half.of_kind(Kind.BRANCH_POINT)[:2]]
    assert born.status is st.Status.CLOSED_LOOP
    for value in exact:
        assert min(abs(value - end) for end in ends) < 1e-6
