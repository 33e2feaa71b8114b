"""Basins against continuation's stable orbits and against single motions; escape, angles, refusals, storage."""

from __future__ import annotations

import numpy as np
import pytest

import stability as st
from stability.errors import InputError, UnknownNameError
from stability.simulation.strobe_tables import tabulated


def grid(shape, **options):
    system = st.models.duffing.from_physical()
    return system, st.basins(system, x=("y", -6e-3, 6e-3), y=("y_dot", -0.8, 0.8), shape=shape, **options)


def test_two_attractors_of_figure_11():
    """At 25 Hz: the two stable orbits of the branch, and every cell's own motion comes to the one it is labelled with."""
    system, found = grid((24, 20))
    assert len(found.attractors) == 2 and found.undecided == 0 and found.escaped == 0
    branch = st.continuation(st.Collocation(system), "frequency", (20.0, 30.0), at=(25.0,))
    stable = [o for o in branch.at(frequency=25.0) if o.verdict is st.Verdict.STABLE]
    starts = np.array([o(0.0) for o in stable])
    for attractor in found.attractors:
        assert attractor.multiple == 1
        assert (np.abs(starts - attractor.points[0]) / np.abs(starts).max(axis=0)).max(axis=1).min() < 5e-3
    for j, i in [(0, 0), (3, 17), (7, 9), (10, 12), (12, 3), (15, 20), (19, 23)]:
        run = st.simulate(system, (0, 300 / 25.0), x0=dict(y=found.x[i], y_dot=found.y[j]))
        mine = found.attractors[found.labels[j, i]].points[0]
        others = found.attractors[1 - found.labels[j, i]].points[0]
        assert np.abs(run.final - mine).max() < 0.05 * np.abs(run.final - others).max()
    assert abs(sum(a.share for a in found.attractors) - 1) < 1e-12


def test_threads_do_not_matter_and_storage(tmp_path):
    seen = []
    _, one = grid((10, 8), workers=1, progress=lambda k, n: seen.append((k, n)))
    _, two = grid((10, 8), workers=2)
    assert np.array_equal(one.labels, two.labels) and seen[-1] == (8, 8)
    one.save(tmp_path / "b.npz")
    back = st.load(tmp_path / "b.npz")
    assert repr(back) == repr(one) and np.array_equal(back.labels, one.labels)
    axes = back.plot()
    assert axes.get_xlabel() == "$y$" and len(axes.lines) == 2


def test_a_table_of_the_map_gives_what_integration_gives(tmp_path, monkeypatch):
    """Two attractors, a turning angle: every cell alike; the same for any number of threads; where some motions escape
    the table must not be used, or agree."""
    from stability.simulation import basin_maps

    cases = [
        (st.models.duffing.from_physical(), dict(x=("y", -6e-3, 6e-3), y=("y_dot", -0.8, 0.8), shape=(80, 60))),
        (st.models.base_driven_pendulum(epsilon=0.1, Omega=2.0, xi=0.05),
         dict(x=("phi", 0.1, 0.1 + 2 * np.pi), y=("phi_dot", -1.5, 1.5), shape=(90, 80))),
    ]  # fmt: skip
    made = []
    for system, arguments in cases:
        seen = []
        with monkeypatch.context() as patch:
            patch.setattr(basin_maps, "tabulated", lambda *a: made.append(tabulated(*a)) or made[-1])
            fast = st.basins(system, **arguments, progress=lambda k, n, seen=seen: seen.append((k, n)))
        with monkeypatch.context() as patch:
            patch.setattr(basin_maps, "tabulated", lambda *a: None)
            slow = st.basins(system, **arguments)
        assert made[-1] is not None and (fast.labels == slow.labels).mean() > 0.999
        assert fast.agreement > 0.99 and slow.agreement == 1.0
        assert [a.multiple for a in fast.attractors] == [a.multiple for a in slow.attractors]
        assert seen[-1][0] == seen[-1][1] and [k for k, _ in seen] == sorted({k for k, _ in seen})
    soft = st.models.duffing_textbook(alpha=1.0, beta=-1.0, delta=0.05, gamma=0.05, omega=1.2)
    few = st.basins(soft, x=("x", -0.85, 0.8), y=("x_dot", -0.3, 0.4), shape=(12, 10))
    assert 0 < few.escaped < 0.2 and few.agreement == 1.0
    again = st.basins(cases[0][0], **cases[0][1], workers=1)
    assert np.array_equal(again.labels, st.basins(cases[0][0], **cases[0][1], workers=2).labels)
    again.save(tmp_path / "b.npz")
    assert st.load(tmp_path / "b.npz").agreement == again.agreement


def test_escape_over_a_softening_spring():
    """Undriven x'' = -x + x^3 - 0.2 x': beyond the saddles at +-1 with outward velocity there is no way back."""
    system = st.models.duffing_textbook(alpha=1.0, beta=-1.0, delta=0.2, gamma=0.0)
    found = st.basins(system, x=("x", -2.0, 2.0), y=("x_dot", -1.0, 1.0), shape=(16, 9))
    inside = np.abs(found.x) < 0.6
    assert (found.labels[4, inside] == 0).all()
    outward = (found.x[None, :] > 1) & (found.y[:, None] >= 0) | (found.x[None, :] < -1) & (found.y[:, None] <= 0)
    assert (found.labels[outward] == -1).all() and found.escaped > 0.2 and len(found.attractors) == 1


def test_period_doubled_attractor_of_a_pendulum():
    """2:1 tongue: the swing repeats after two periods; rest is unstable; turns more or less are the same attractor."""
    system = st.models.base_driven_pendulum(epsilon=0.1, Omega=2.0, xi=0.05)
    found = st.basins(system, x=("phi", 0.1, 0.1 + 2 * np.pi), y=("phi_dot", -1.0, 1.0), shape=(8, 6))
    assert [a.multiple for a in found.attractors] == [2] and found.attractors[0].share == 1.0


@pytest.mark.parametrize("change, match", [
    (dict(y=("u", 0, 1)), "different"), (dict(x=("u", 1, 0)), "lo < hi"), (dict(shape=(1, 5)), "shape"),
    (dict(periods=3), "periods"), (dict(x="u"), "lo, hi"), (dict(tolerance=1.0), "tolerance"),
])  # fmt: skip
def test_bad_input(change, match):
    arguments = dict(x=("u", -1, 1), y=("u_dot", -1, 1), shape=(4, 4)) | change
    with pytest.raises(InputError, match=match):
        st.basins(st.models.duffing(), **arguments)


def test_systems_it_is_not_for():
    with pytest.raises(InputError, match="autonomous"):
        st.basins(st.models.lorenz(), x=("x", 0, 1), y=("y", 0, 1))
    with pytest.raises(InputError, match="stops"):
        st.basins(st.models.hard_stop_oscillator(), x=("u", 0, 1), y=("u_dot", 0, 1))
    with pytest.raises(UnknownNameError, match="did you mean"):
        st.basins(st.models.duffing(), x=("uu", 0, 1), y=("u_dot", 0, 1))
