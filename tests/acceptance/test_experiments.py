"""The experiment on the computer against continuation: settling errors, hysteresis, delays, cascades, bad stops."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import InputError, UnsettledWarning

t = sp.Symbol("t", real=True)
phi = sp.Function("phi")(t)
g, q = sp.symbols("g q", real=True)


def quiet(*arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnsettledWarning)
        return st.sweep(*arguments, **options)


@pytest.fixture(scope="module")
def duffing():
    """(branch, up, down) of figure 11's oscillator, 120 periods a point."""
    system = st.models.duffing.from_physical()
    branch = st.continuation(st.Collocation(system), "frequency", (20.0, 29.0))
    sweeps = [quiet(system, "frequency", w, step=0.5, periods=120) for w in ((20.0, 29.0), (29.0, 20.0))]
    return branch, *sweeps


def test_sweeps_agree_with_stable_orbits_to_the_settling_error(duffing):
    """Every settled point, both ways: the distance to the nearest stable orbit is what `transient` says is left."""
    branch, *sweeps = duffing
    for run in sweeps:
        assert run.settled.sum() >= len(run) - 2
        for k in np.nonzero(run.settled)[0]:
            stable = [row["y.max"] for row in branch.rows_at(frequency=float(run.parameter[k]))
                      if row["verdict"] is st.Verdict.STABLE]  # fmt: skip
            top = run.maximum["y"][k]
            gap = min(abs(top - value) for value in stable)
            assert gap <= 1.5 * run.transient[k] * run.peak_to_peak["y"][k] / 2 + 1e-6 * top


def test_sweeps_agree_with_each_other_outside_the_hysteresis(duffing):
    branch, up, down = duffing
    low, high = sorted(p.params["frequency"] for p in branch.special)
    other = {round(float(f), 6): k for k, f in enumerate(down.parameter)}
    outside = inside = 0
    for k, f in enumerate(up.parameter):
        j = other[round(float(f), 6)]
        gap = abs(up.maximum["y"][k] - down.maximum["y"][j])
        if f < low - 0.1 or f > high + 0.1:
            left = up.transient[k] * up.peak_to_peak["y"][k] + down.transient[j] * down.peak_to_peak["y"][j]
            assert gap <= left + 1e-6 * up.maximum["y"][k]
            outside += 1
        elif low < f < high:
            assert gap > 0.5 * up.maximum["y"][k]
            inside += 1
    assert outside >= 8 and inside >= 6


def test_jumps_come_after_the_fold_by_the_delay_of_the_passage():
    """A distance d beyond a fold the motion needs a time like 1/sqrt d to leave: n periods a step, a delay like 1/n^2."""
    system = st.models.duffing.from_physical()
    fold = 26.99827
    late = []
    for periods in (40, 80, 320):
        run = quiet(system, "frequency", (20.0, 28.0), step=0.5, periods=periods)
        late.append(run.jumps[0].bracket[1] - fold)
    assert late[0] > late[1] > late[2] > 0 and late[2] < 0.002
    assert late[1] < 0.5 * late[0]


def driven_pendulum():
    """phi'' + phi'/q + sin phi = g cos(2 t/3), q = 2."""
    return st.System.from_equations(
        {phi.diff(t, 2): -phi.diff(t) / q - sp.sin(phi) + g * sp.cos(sp.Rational(2, 3) * t)}, [phi],
        parameters=dict(g=1.06, q=2.0), period=3 * sp.pi, angles=["phi"], name="driven pendulum",
    )  # fmt: skip


def repeats_after(strobes):
    """(N,) number of periods after which motions with strobes (N, 32, 2) repeat to 1e-3: 1, 2, 4, 8, or 0."""
    turned = np.stack([np.cos(strobes[..., 0]), np.sin(strobes[..., 0]), strobes[..., 1]])
    found = np.zeros(len(strobes), int)
    for m in (8, 4, 2, 1):
        found[np.abs(turned[:, :, m:] - turned[:, :, :-m]).max(axis=(0, 2)) < 1e-3] = m
    return found


@pytest.mark.slow
def test_cascade_of_the_driven_pendulum():
    """A carried sweep repeats after T, 2 T, 4 T, 8 T, changing within two of its steps of PD1 of T, 2 T and 4 T by
    continuation; the distances of the doublings shrink by Feigenbaum's 4.669."""
    system = driven_pendulum()
    window, settled = ("g", (1.06, 1.09)), st.simulate(system, (0, 1500.0), x0=dict(phi=0.3)).final
    start = dict(phi=float(np.angle(np.exp(1j * settled[0]))), phi_dot=float(settled[1]))
    points = []
    branch = st.continuation(st.Collocation(system), *window, start=start, stop_at="PD")
    for _ in range(3):
        points.append(branch["PD1"].params["g"])
        branch = st.continuation(st.switch(branch["PD1"]), *window, stop_at="PD")
    points.append(branch["PD1"].params["g"])
    gaps = np.diff(points)
    assert gaps[:-1] / gaps[1:] == pytest.approx(4.669, rel=0.005)
    run = None
    for (low, high), step, wanted in (((1.064, 1.081), 2.5e-4, (1, 2, 4)), ((1.081, 1.0825), 5e-5, (4, 8))):
        x0 = start if run is None else dict(zip(system.states, run.ends[-1]))
        run = quiet(system, "g", (low, high), step=step, periods=700, record=32, x0=x0)
        multiples = repeats_after(run.strobes)
        for m in wanted[:-1]:
            place = points[(1, 2, 4).index(m)]
            last = run.parameter[multiples == m].max()
            first = run.parameter[multiples == 2 * m].min()
            assert place - 2 * step < last < place + step and place - step < first < place + 2 * step


def test_global_error_on_the_chaotic_model():
    """Lorenz over two time units, in which deviations grow less than 100-fold: 100 x the tolerance, as all others."""
    system = st.models.lorenz()
    coarse = st.simulate(system, (0, 2.0), x0=[1.0, 1.0, 20.0], rtol=1e-8, atol=1e-12)
    fine = st.simulate(system, (0, 2.0), x0=[1.0, 1.0, 20.0], rtol=1e-13, atol=1e-16)
    times = np.linspace(0, 2.0, 201)
    scale = np.abs(fine(times)).max(axis=1)
    assert (np.abs(coarse(times) - fine(times)) / scale[:, None]).max() < 100 * 1e-8


@pytest.mark.parametrize(("arguments", "said"), [
    (dict(position=0.1, restitution=-0.1), "restitution must be in"),
    (dict(position=0.1, restitution=1.1), "restitution must be in"),
    (dict(position=np.nan), "finite"),
    (dict(position=0.1, side=2), "side must be"),
])  # fmt: skip
def test_bad_stops(arguments, said):
    with pytest.raises(InputError, match=said):
        st.HardStop("u", **arguments)


def test_stops_that_overlap_at_rest_and_motions_that_begin_beyond():
    system = st.models.linear_oscillator()
    overlapping = system.replace(stops=(st.HardStop("u", -1.0, 1), st.HardStop("u", 1.0, -1)))
    with pytest.raises(InputError, match=r"overlap: from above at -1, from below at 1"):
        st.simulate(overlapping, (0, 1))
    with pytest.raises(InputError, match="gap"):
        st.models.hard_stop_oscillator(gap=-1.0)
    beyond = system.replace(stops=(st.HardStop("u", 1.0, 1),))
    with pytest.raises(InputError, match="beyond the u stop above at 1: u = 2"):
        st.simulate(beyond, (0, 1), x0=dict(u=2.0))
    with pytest.raises(InputError, match="beyond"):
        st.sweep(beyond, "Omega", (0.5, 0.7), step=0.1, x0=dict(u=2.0))


@pytest.mark.parametrize(("Omega", "base_term", "window", "wanted"), [
    (1.0, True, (0.0033, 0.0037), 0.00352523), (1.0, False, (0.0033, 0.0037), 0.0035283),
    (1.5, True, (2.8, 3.0), 2.94635), (1.5, False, (1.25, 1.4), 1.31208),
])  # fmt: skip
def test_thresholds_of_figure_13_by_continuation(Omega, base_term, window, wanted):
    """Where the pendulum at rest loses its stability, in g: the doubling point along the acceleration, all digits given."""
    system = st.models.autoparametric_pendulum.from_acceleration(
        xi1=0.021, xi2=0.021, mass_ratio_total=0.2, Omega0=0.5, Omega=Omega, base_term=base_term
    )
    branch = st.continuation(st.Collocation(system), "acceleration", window, stop_at="PD1")
    found = branch["PD1"].params["acceleration"]
    digits = len(f"{wanted}".split(".")[1])
    assert abs(found - wanted) <= 0.51 * 10.0**-digits
