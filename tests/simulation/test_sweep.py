"""Sweeps against closed forms, the folds of continuation, and the catalogue; settling, jumps, refusals, storage."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import stability as st
from stability.errors import InputError, StabilityError, UnknownNameError, UnsettledWarning
from stability.results.trajectory import Ending


def quiet(*arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnsettledWarning)
        return st.sweep(*arguments, **options)


def test_linear_sweep_is_the_transfer_function():
    """Amplitude, phase and both directions of the linear oscillator within the reported transient."""
    xi = 0.1
    system = st.models.linear_oscillator(xi=xi)
    up, down = (st.sweep(system, "Omega", w, step=0.1) for w in ((0.5, 2.0), (2.0, 0.5)))
    for run in (up, down):
        s = 1j * run.parameter
        G = -(s**2) / (1 + 2 * xi * s + s**2)
        assert (np.abs(run.amplitude()["u"] - np.abs(G)) <= np.maximum(run.transient, 1e-8) * np.abs(G)).all()
        assert np.abs(np.angle(np.exp(1j * (run.phase()["u"] - np.angle(G))))).max() < 1e-4
        assert run.settled.all() and (run.multiple == 1).all() and not run.jumps
        assert np.abs(run.maximum["u"] + run.minimum["u"]).max() < 1e-4
    assert np.abs(up.maximum["u"] - down.maximum["u"][::-1]).max() < 1e-4
    assert np.allclose(up.parameter, down.parameter[::-1], atol=1e-12) and len(up) == 16


def test_figure_11_jumps_and_the_lower_branch():
    """Catalogue 7: 26.998 Hz at 4.3016 mm, 22.798 Hz, 25 Hz from rest on 0.562 mm; against the folds of continuation."""
    system = st.models.duffing.from_physical()
    up = quiet(system, "frequency", (20, 29), step=0.5, periods=200)
    down = quiet(system, "frequency", (29, 21), step=0.5, periods=200)
    (first,), (second,) = up.jumps, down.jumps
    assert 26.998 <= first.bracket[1] < 26.998 + 0.01 and second.bracket[1] <= 22.798 and second.parameter > 22.788
    branch = st.continuation(st.Collocation(system), "frequency", (20.0, 30.0))
    low, high = sorted(p.params["frequency"] for p in branch.special)
    assert abs(high - 26.998) < 5e-4 and abs(low - 22.798) < 6e-4
    assert first.bracket[1] > high and second.bracket[1] < low  # never before the fold
    assert abs(first.before["y_mm"][1] - 4.3016) < 0.02
    rest = quiet(system, "frequency", (25, 25.5), step=0.5, start="rest", periods=100)
    assert abs(rest.maximum["y_mm"][0] - 0.562) < 6e-4
    on = branch.at(frequency=25.0)
    assert np.abs(np.sort([s.max["y"] for s in on]) * 1e3 - [0.562, 3.342, 3.718]).max() < 6e-4
    carried = up.maximum["y_mm"][up.parameter == 25.0]
    assert abs(carried[0] - 3.718) < 1e-3


def test_finer_dwell_brings_the_jump_to_the_fold():
    system = st.models.duffing.from_physical()
    late = [quiet(system, "frequency", (22, 28), step=0.5, periods=n).jumps[0].parameter - 26.99827 for n in (30, 300)]
    assert 0 < late[1] < late[0]


def test_figure_a2_jumps():
    """Catalogue 8: 25.514 Hz with 7.906 mm peak to peak, 21.328 Hz."""
    system = st.models.chain.from_physical(
        damping1=2 * 0.031 * 0.02 * 169, damping2=2 * 0.031 * 0.01 * 169, cubic1=1.98e9 * 0.02, cubic2=1.98e9 * 0.01,
        acceleration=0.5 * 9.81,
    )  # fmt: skip
    up = quiet(system, "frequency", (20, 26.5), step=0.25, periods=120)
    down = quiet(system, "frequency", (27, 20.5), step=0.25, periods=120)
    (first,), (second,) = up.jumps, down.jumps
    assert 25.514 <= first.bracket[1] < 25.53 and 21.318 < second.bracket[1] <= 21.328
    low, high = first.before["y1"]
    assert abs((high - low) * 1e3 - 7.906) < 0.03


def test_figure_a3_jumps():
    """Catalogue 10: sweep-down fold 17.420 Hz, sweep-up jump 22.781 Hz, 3.654 mm peak to peak at 17.53 Hz."""
    system = st.models.one_sided_magnet.from_physical()
    up = quiet(system, "frequency", (16.5, 25), step=0.25, periods=100)
    down = quiet(system, "frequency", (25, 16.5), step=0.25, periods=100)
    (first,), (second,) = up.jumps, down.jumps
    assert 22.781 <= first.bracket[1] < 22.79 and 17.41 < second.bracket[1] <= 17.4201
    fine = quiet(system, "frequency", (24, 17.45), step=0.05, periods=100)
    top = fine.peak_to_peak["y"].argmax()
    assert abs(fine.peak_to_peak["y"][top] * 1e3 - 3.654) < 2e-3 and abs(fine.parameter[top] - 17.53) < 0.03


def test_unsettled_points_warn_and_say_where():
    system = st.models.duffing(xi=0.002, beta=0.0)
    with pytest.warns(UnsettledWarning, match="more periods"):
        run = st.sweep(system, "Omega", (0.9, 1.1), step=0.05, periods=20)
    assert not run.settled.all()
    true = 1 / np.abs(1 - run.parameter**2 + 2j * 0.002 * run.parameter) * run.parameter**2
    error = np.abs(run.amplitude()["u"] - true) / true
    assert (error[~run.settled] <= 20 * run.transient[~run.settled]).all()


def test_subharmonic_motion_counts_as_settled():
    """Base-driven pendulum in its 2:1 tongue: the motion repeats after two periods."""
    system = st.models.base_driven_pendulum(epsilon=0.1, Omega=2.0, xi=0.05)
    run = quiet(system, "Omega", (1.95, 2.0), step=0.05, periods=400, record=4, x0=dict(phi=0.5))
    assert run.settled.all() and (run.multiple == 2).all() and run.maximum["phi"].min() > 0.5


def test_escape_ends_the_sweep_with_its_points():
    soft = st.models.duffing.from_physical(cubic=-6e7, acceleration=4.0)
    run = quiet(soft, "frequency", (5, 30), step=0.5)
    assert run.status is Ending.DIVERGED and 2 < len(run) < 51 and np.isfinite(run.high).all()
    with pytest.raises(StabilityError, match="first value"):
        st.sweep(soft, "frequency", (5, 6), step=0.5, x0=dict(y=0.1))


def test_workers_and_progress():
    system, seen = st.models.duffing.from_physical(), []
    one = quiet(system, "frequency", (20, 30), step=2.0, start="rest", workers=1)
    two = quiet(system, "frequency", (20, 30), step=2.0, start="rest", workers=2, progress=lambda k, n: seen.append((k, n)))
    assert np.array_equal(one.high, two.high) and seen == [(k, 6) for k in range(1, 7)]


def test_constant_amplitude_and_acceleration():
    system = st.models.linear_oscillator.from_physical(acceleration=1.0)
    ride = system.with_excitation(st.ConstantAmplitude(1e-3))
    a, b = (quiet(s, "frequency", (10, 12), step=1.0, periods=150) for s in (system, ride))
    w = 2 * np.pi * a.parameter
    assert np.abs(b.maximum["y"] / a.maximum["y"] / (1e-3 * w**2) - 1).max() < 1e-3


def test_storage(tmp_path):
    run = quiet(st.models.duffing.from_physical(), "frequency", (26, 28), step=0.5)
    run.save(tmp_path / "s.npz")
    back = st.load(tmp_path / "s.npz")
    assert np.array_equal(back.high, run.high) and back.jumps == run.jumps and repr(back) == repr(run)
    run.to_csv(tmp_path / "s.csv")
    text = np.genfromtxt(tmp_path / "s.csv", delimiter=",", names=True)
    assert np.allclose(text["frequency"], run.parameter) and "y_mmmax" in text.dtype.names


@pytest.mark.parametrize("change, match", [
    (dict(window=(1, 1)), "different"), (dict(step=0.0), "step"), (dict(step=5.0), "step"), (dict(start="up"), "carry"),
    (dict(periods=1), "periods"), (dict(record=50), "settling"), (dict(Omega=1.0), "swept"), (dict(period=1.0), "own forcing"),
    (dict(rtol=1.0), "rtol"), (dict(window=(-1, 1)), "bounds"), (dict(window=3), "two numbers"), (dict(harmonics=0), "harmonics"),
])  # fmt: skip
def test_bad_input_is_refused(change, match):
    arguments = dict(window=(0.5, 1.5)) | change
    with pytest.raises(InputError, match=match):
        st.sweep(st.models.duffing(), "Omega", arguments.pop("window"), **arguments)
    with pytest.raises(UnknownNameError):
        st.sweep(st.models.duffing(), "omega_", (1, 2))
    with pytest.raises(InputError, match="autonomous"):
        st.sweep(st.models.van_der_pol(), next(iter(st.models.van_der_pol().parameters)), (1, 2))
