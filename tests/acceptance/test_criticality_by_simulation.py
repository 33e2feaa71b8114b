"""Which ends of the pendulum's instability are dangerous: the word of the normal form against direct simulation.

Just inside a period doubling the hanging pendulum is disturbed a little and left alone for thousands of periods. Beyond
a supercritical doubling it settles to a swing that grows like the square root of the distance, and carried back across
the threshold it comes to rest; beyond a subcritical one it jumps, to the same large swing at any small distance, and
carried back it keeps swinging.
"""

import numpy as np
import pytest

import stability as st
from stability.words import Criticality, Kind

SMALL, NEAR = 1e-3, 5e-4


def settled(system, Omega, x0, periods):
    """(largest |theta| over the last 40 periods, last state)."""
    T = 2 * np.pi / Omega
    motion = st.simulate(system, (0, periods * T), x0=x0, rtol=1e-9, atol=1e-12, Omega=Omega)
    states = motion(np.linspace((periods - 40) * T, periods * T, 40 * 32))
    return float(np.abs(states[1]).max()), states[:, -1]


def observed(system, rest, point, periods, near=NEAR):
    """The word that simulation gives, and the swings at two distances inside and at one outside."""
    at = point.params["Omega"]
    rates = [max(abs(rest.at(Omega=at + side * near)[0].multipliers)) for side in (-1, 1)]
    inside = -1 if rates[0] > rates[1] else 1
    swings, end = [], None
    for distance in (near, 4 * near):
        x0 = np.array(rest.at(Omega=at + inside * distance)[0](0.0))
        x0[1] += SMALL
        swing, state = settled(system, at + inside * distance, x0, periods)
        swings.append(swing)
        end = state if distance == near else end
    back, _ = settled(system, at - inside * near, end, periods)
    grows = 1.4 < swings[1] / swings[0] < 2.3  # 2 in the limit
    if grows and back < SMALL:
        return Criticality.SUPERCRITICAL, (*swings, back)
    if abs(swings[1] / swings[0] - 1) < 0.2 and back > 0.5 * swings[0]:
        return Criticality.SUBCRITICAL, (*swings, back)
    return None, (*swings, back)


def ends(window=(0.85, 1.15), **parameters):
    system = st.models.autoparametric_pendulum(**parameters)
    rest = st.continuation(st.Collocation(system), "Omega", window)
    return system, rest, rest.of_kind(Kind.PERIOD_DOUBLING)


@pytest.mark.parametrize("xi2, ratio, word", [(0.03, 500.0, "supercritical"), (0.01, 100.0, "subcritical")])
def test_both_ends_of_an_instability(xi2, ratio, word):
    system, rest, points = ends(xi1=0.02, xi2=xi2, Omega0=0.5, length_ratio=ratio)
    assert len(points) == 2
    for point in points:
        assert point.criticality == word
        assert observed(system, rest, point, 6000)[0] == word


@pytest.mark.slow
@pytest.mark.parametrize("parameters, periods, near", [
    (dict(), 20000, NEAR),
    (dict(xi1=0.02, xi2=0.01, Omega0=0.48, length_ratio=800.0), 12000, NEAR),
    (dict(xi1=0.02, xi2=0.01, Omega0=0.48, length_ratio=500.0), 12000, 1e-4),
    (dict(xi1=0.02, xi2=0.03, Omega0=0.5, length_ratio=200.0), 6000, NEAR),
    (dict(xi1=0.02, xi2=0.03, Omega0=0.5, length_ratio=800.0), 12000, NEAR),
    (dict(xi1=0.02, xi2=0.01, Omega0=0.5, length_ratio=200.0), 12000, NEAR),
])  # fmt: skip
def test_ends_of_many_instabilities(parameters, periods, near):
    """The model's default among them: both of its ends are subcritical."""
    system, rest, points = ends(**parameters)
    assert len(points) == 2
    for point in points:
        seen, swings = observed(system, rest, point, periods, near)
        assert point.criticality is seen, (point, swings)
    if not parameters:
        assert {p.criticality for p in points} == {Criticality.SUBCRITICAL}
