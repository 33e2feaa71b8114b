"""The pendulum's torus points over frequency and acceleration: a closed curve, its resonances, and separate branches."""

import numpy as np
import pytest

import stability as st
from stability.words import Kind, Status


def swing(acceleration, window=(0.7, 1.4)):
    system = st.models.autoparametric_pendulum.from_acceleration(acceleration=acceleration)
    rest = st.continuation(st.Collocation(system), "Omega", (0.9, 1.1))
    first = rest.of_kind(Kind.PERIOD_DOUBLING)[-1]
    return st.continuation(st.switch(first), "Omega", window)


@pytest.fixture(scope="module")
def curve():
    point = swing(0.00434)["NS1"]
    return st.continuation(st.locus(point, free="acceleration", window=(1e-5, 0.5)), "Omega", (0.8, 1.2))


def test_the_curve_is_closed_and_its_resonances_are_named(curve):
    """Multipliers exp(+-i pi/2) at 1:4; nothing of the spectrum is missed anywhere on the loop."""
    assert curve.statuses == (Status.CLOSED_LOOP,) * 2
    resonances = curve.of_kind(Kind.R4)
    assert len(resonances) == 2 and not [p for kind in (Kind.R1, Kind.R2, Kind.R3) for p in curve.of_kind(kind)]
    for point in resonances:
        assert min(abs(m - 1j) for m in point.solution.multipliers) < 1e-7
    angle = curve.columns["torus_angle"]
    assert 0.01 < angle.min() < 0.05 and np.pi / 2 < angle.max() < 2 * np.pi / 3  # away from 1:1, short of 1:3
    assert np.isfinite(np.concatenate([curve.columns[k] for k in ("Omega", "acceleration", "theta.max")])).all()
    assert curve.residuals.max() < 1e-9 and set(curve.verdicts) <= {st.Verdict.STABLE, st.Verdict.UNDETERMINED}


@pytest.mark.parametrize("acceleration", [0.001, 0.02])
def test_torus_points_of_separate_branches_lie_on_it(curve, acceleration):
    points = swing(acceleration).of_kind(Kind.NEIMARK_SACKER)
    assert len(points) == 2
    for point in points:
        values = [o.params["acceleration"] for o in curve.at(Omega=point.params["Omega"])]
        assert min(abs(v / acceleration - 1) for v in values) < 1e-7


def test_no_torus_below_its_lowest_point(curve):
    """The extremum of the curve: branches a little above have two torus points, a little below none."""
    lowest = min(p.params["acceleration"] for p in curve.of_kind(Kind.EXTREMUM))
    assert len(swing(lowest * 1.005).of_kind(Kind.NEIMARK_SACKER)) == 2
    assert not swing(lowest * 0.995).of_kind(Kind.NEIMARK_SACKER)
