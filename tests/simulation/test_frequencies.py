"""Frequencies of quasi-periodic motion: planted tones, and the angle of the multiplier at a Neimark-Sacker point."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import InputError, UnknownNameError
from stability.kernels import piecewise, spectral_lines
from stability.results.trajectory import Trajectory

GOLDEN = (np.sqrt(5) - 1) / 2


def recorded(function, duration, step, period=None, angles=()):
    """A trajectory of one state that follows a function of time."""
    edges = np.arange(0.0, duration + step / 2, step)
    times = piecewise.node_times(edges)
    coefficients = piecewise.from_nodes(function(times)[..., None])
    return Trajectory("planted", ("x",), edges, coefficients, {}, period=period, angles=angles)


def cos(f, t, phase=0.0):
    return np.cos(2 * np.pi * f * t + phase)


def test_two_tones_and_their_combinations():
    """Base frequencies to 1e-8 of themselves over 200 periods; amplitudes, phases and whole numbers as planted."""
    f1, f2 = 1.0, GOLDEN / np.pi

    def signal(t):
        pair = 1.3 * cos(f1, t, 0.3) + 0.4 * cos(f1 + f2, t, -1.0) + 0.25 * cos(f1 - f2, t, 2.0)
        return 0.5 + pair + 0.05 * cos(2 * f1 - 3 * f2, t) + 1e-4 * cos(3 * f2, t, 1.0)

    for period in (1.0, None):
        found = recorded(signal, 200.0, 0.05, period).frequencies()
        wanted = [f1, f2] if period else [f1, f1 - f2]  # autonomous: the second strongest family member may be either
        if period:
            assert found.base == pytest.approx(wanted, rel=1e-8) and found.error[0] == 0.0
        else:
            assert found.base[0] == pytest.approx(f1, rel=1e-8)
            assert min(abs(found.base[1] - f) for f in (f1 + f2, f1 - f2, f2)) < 1e-8
        assert found.quasiperiodic and found.residual < 1e-7 and (found.error < 1e-8).all()
        assert found.frequency[:3] == pytest.approx([f1, f1 + f2, f1 - f2], rel=1e-8)
        assert found.amplitude[:3] == pytest.approx([1.3, 0.4, 0.25], rel=1e-7)
        assert found.phase[:3] == pytest.approx([0.3, -1.0, 2.0], abs=1e-6)
        assert np.abs(found.orders @ found.base - found.frequency).max() < 1e-7
        assert found.mean == pytest.approx(0.5, abs=1e-8)
    artists = found.plot()
    assert len(artists) == 1 + min(6, found.frequency.size) and artists[1].get_text() == f"({found.orders[0, 0]}, {found.orders[0, 1]})"
    assert "+1 -1" in recorded(signal, 200.0, 0.05, 1.0).frequencies().table()


def test_close_tones_and_noise():
    """Tones five widths apart, one 1000 times weaker; white noise of 1e-3 leaves about its own share."""
    f1, f2, T = 0.7, 0.7 + 5 / 400, 400.0
    clean = recorded(lambda t: cos(f1, t) + 1e-3 * cos(f2, t, 0.4), T, 0.1).frequencies()
    assert clean.frequency == pytest.approx([f1, f2], rel=1e-8)
    t = np.arange(4096) * 0.1
    noisy = cos(f1, t) + 1e-3 * np.random.default_rng(3).standard_normal(t.size)
    (found,) = spectral_lines.lines(noisy, 0.1, 1)
    assert abs(found - f1) < 10 * np.sqrt(6) / (np.pi * 409.6) * 1e-3 / np.sqrt(t.size)  # ten Cramer-Rao bounds


def test_periodic_motions_have_one_base_frequency():
    """Forced: the forcing's, or its part where the period has doubled; free: its own, the exact one of a pendulum."""
    plain = st.simulate(st.models.duffing(xi=0.05, beta=0.05, Omega=1.2), (0, 200 * 2 * np.pi / 1.2)).frequencies(periods=60)
    assert plain.base == pytest.approx([1.2 / (2 * np.pi)]) and not plain.quasiperiodic
    assert (plain.orders[:2, 0] == [1, 3]).all()  # odd harmonics of a symmetric oscillator
    doubled = recorded(lambda t: cos(1.0, t) + 0.2 * cos(0.5, t) + 0.1 * cos(1.5, t), 100.0, 0.05, 1.0).frequencies()
    assert doubled.base == pytest.approx([0.5]) and doubled.orders[:, 0].tolist() == [2, 1, 3]
    time = sp.Symbol("t", real=True)
    phi = sp.Function("phi")(time)
    pendulum = st.System.from_equations({phi.diff(time, 2): -sp.sin(phi)}, [phi])
    free = st.simulate(pendulum, (0, 400.0), x0=dict(phi=2.0), rtol=1e-12)
    assert free.frequencies("phi").base == pytest.approx([1 / st.pendulum_motion(amplitude=2.0).period], rel=1e-9)


def test_chaos_has_no_pair_of_frequencies():
    chaos = st.simulate(st.models.lorenz(), (0, 100.0), x0=[1.0, 1.0, 20.0])
    found = chaos.frequencies("x")
    assert not found.quasiperiodic or found.error.max() > 1e-4


def test_second_frequency_of_the_pendulum_beyond_its_torus_point():
    """Autoparametric pendulum at Omega_NS + d: f_2 tends to theta/(2 pi P), P = 2 T of the swinging orbit.

    Along the torus f_2 is smooth in d (the amplitude's square is): extrapolation from three distances, to d^3.
    """
    pendulum = st.models.autoparametric_pendulum()
    semi = st.continuation(st.Collocation(pendulum), "Omega", (0.5, 1.1), stop_at="PD1")
    swing = st.continuation(st.switch(semi["PD1"]), "Omega", (0.5, 1.5), stop_at="NS1")
    point = swing["NS1"]
    critical = point.multipliers[np.argmin(np.abs(np.abs(point.multipliers) - 1))]
    wanted = abs(np.angle(critical)) / (2 * np.pi * point.solution.period)
    side = 1 if swing.rates[-1] > 0 else -1
    second, swings = [], []
    for k in (1, 2, 4):
        Omega = point.params["Omega"] + side * 1e-4 * k
        start = point.solution(0.0) * 1.03
        run = st.simulate(pendulum, (0, 16000 * np.pi / Omega), x0=start, rtol=1e-10, Omega=Omega)
        found = run.frequencies("theta", periods=1600, most=8)
        assert found.quasiperiodic and found.error[1] < 1e-8
        assert found.base[0] == pytest.approx(Omega / (4 * np.pi), rel=1e-14)  # swings at half the forcing
        second.append(found.base[1])
        swings.append(found.amplitude[1])
    assert (8 * second[0] - 6 * second[1] + second[2]) / 3 == pytest.approx(wanted, rel=1e-4)
    assert swings[1] / swings[0] == pytest.approx(np.sqrt(2), rel=0.05)  # the torus grows like a square root


def test_refusals():
    run = st.simulate(st.models.duffing(), (0, 100))
    with pytest.raises(UnknownNameError):
        run.frequencies("w")
    with pytest.raises(InputError, match="most"):
        run.frequencies(most=0)
    with pytest.raises(InputError, match="at least 8"):
        run.frequencies(periods=3)
    still = recorded(lambda t: 0.0 * t + 2.0, 100.0, 0.1)
    assert still.frequencies().base.size == 0 and "no lines" in still.frequencies().table()
