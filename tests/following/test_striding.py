"""Several steps in one compiled call: the branch is that of single steps, point by point.

Witness: the same continuation with the compiled march switched off, where every step is predicted, corrected and
judged by `following/stepping.py` in Python.
"""

import numpy as np
import pytest

import stability as st
from stability.following import follower
from stability.kernels import marching


def chain():
    return st.models.chain(xi1=0.02, xi2=0.02, beta1=0.05, beta2=0.05)


CASES = {
    "two states": (lambda: st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.3, 3.0), None),
    "four states": (lambda: st.Collocation(st.models.autoparametric_pendulum()), "Omega", (0.7, 1.3), None),
    "four states, other": (lambda: st.Collocation(chain()), "Omega", (0.3, 2.0), None),
    "half of the period": (
        lambda: st.Collocation(st.models.duffing(xi=0.02, beta=0.001), symmetry="auto"), "Omega", (0.3, 3.0), None),
    "no forcing": (lambda: st.Collocation(st.models.van_der_pol()), "mu", (0.5, 4.0), dict(x=2.0)),
    "broken by a fold": (
        lambda: st.Collocation(st.models.duffing_textbook(delta=0.1, gamma=5.0)), "omega", (3.0, 0.4), None),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_march_and_single_steps_make_the_same_branch(name, monkeypatch):
    make, parameter, window, start = CASES[name]
    taken = []
    march = marching.march
    monkeypatch.setattr(marching, "march", lambda *args: taken.append(march(*args)) or taken[-1])
    together = st.continuation(make(), parameter, window, start=start)
    assert sum(taken) > 0.6 * len(together)
    monkeypatch.setattr(follower.Strides, "step", lambda *_: None)
    single = st.continuation(make(), parameter, window, start=start)
    assert len(together) == len(single) and together.status is single.status and together.labels == single.labels
    size = np.abs(single.columns[parameter]).max()
    assert np.abs(together.columns[parameter] - single.columns[parameter]).max() < 1e-6 * size
    for a, b in zip(together.special, single.special):
        assert a.kind is b.kind and abs(a.params[parameter] - b.params[parameter]) < 1e-9
    assert together.verdicts == single.verdicts
    size = np.maximum(1.0, np.abs(single.values).max(axis=1))
    assert (np.abs(together.values - single.values).max(axis=1) < 1e-5 * size).all()
    for u, v in zip(together.unknowns[::7], single.unknowns[::7]):
        assert np.abs(u - v).max() < 1e-5 * np.abs(v).max()


def test_a_step_of_another_length_drops_what_was_made_ahead():
    problem = st.Collocation(st.models.duffing(xi=0.02, beta=0.001))
    walk = st.steps(problem, "Omega", (0.3, 3.0))
    for _ in range(8):
        next(walk)
    side = walk.side(0)
    side.length *= 0.5  # as events and walls do
    asked, before = side.length, side.last
    next(walk)
    assert side.last.step == pytest.approx(asked, rel=1e-2) and side.last.s > before.s


def test_a_field_that_ends_leaves_the_step_to_the_driver():
    """The square root ends at x = -1: the march stops before it, single steps close in on it."""

    def f(t, x, *, F=0.1, Omega=0.5):
        with np.errstate(invalid="ignore"):
            return np.array([x[1], -0.1 * x[1] - x[0] * np.sqrt(1.0 + x[0]) + F * np.cos(Omega * t)])

    system = st.System.from_function(f, states="x v", period=lambda Omega: 2 * np.pi / Omega)
    branch = st.continuation(st.Collocation(system), "F", (0.01, 5.0))
    assert branch.status is st.Status.STEP_TOO_SMALL and len(branch) > 3
    assert -1.0 < branch.columns["x.min"].min() < -0.5
