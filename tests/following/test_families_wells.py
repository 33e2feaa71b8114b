"""`families` finds what a double well has: x'' + x'/4 - x + x^3 = F cos w t, by collocation and by shooting.

Witnesses: harmonic balance, and scipy's DOP853 from other states than any guess.
"""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.problems.orbit_candidates import averaged_equilibria

METHODS = (st.Collocation, pytest.param(st.Shooting, marks=pytest.mark.slow))


def well():
    x, v, t, F, w = sp.symbols("x x_dot t F w", real=True)
    return st.System(
        name="double well", coordinates=("x",), states=("x", "x_dot"), parameters={"F": 0.1, "w": 1.0},
        rhs=(v, -v / 4 + x - x**3 + F * sp.cos(w * t)), period_expression=2 * sp.pi / w,
    )  # fmt: skip


def settled(F, w, start, periods=60):
    """Stroboscopic state after `periods` periods."""
    T = 2 * np.pi / w
    field = lambda t, x: (x[1], -x[1] / 4 + x[0] - x[0] ** 3 + F * np.cos(w * t))  # noqa: E731
    return solve_ivp(field, (0, periods * T), start, "DOP853", rtol=1e-10, atol=1e-11).y[:, -1]


@pytest.mark.parametrize("method", METHODS)
def test_the_orbits_inside_the_wells_are_found_along_the_forcing(method):
    """LP1, LP2, PD1 as harmonic balance has them; the stable orbit at F = 0.05 is where simulation settles."""
    found = st.families(method(well()), "F", (0.01, 8.0))
    inside = [b for b in found if b.of_kind(st.Kind.FOLD) and abs(b["LP1"].params["F"] - 0.265) < 1e-3]
    assert len(inside) == 1
    start = inside[0].at(F=0.05)[0]
    known = st.continuation(st.HarmonicBalance(well()), "F", (0.01, 8.0), start=start)
    for label in ("LP1", "LP2", "PD1"):
        assert inside[0][label].params["F"] == pytest.approx(known[label].params["F"], abs=1e-6)
    assert [inside[0][label].params["F"] for label in ("LP1", "LP2", "PD1")] == pytest.approx(
        [0.265, 0.1598, 0.1817], abs=1e-4
    )
    ends = [settled(0.05, 1.0, (side * 1.2, 0.1)) for side in (1, -1)]
    orbits = [o for o in inside[0].at(F=0.05) if o.verdict is st.Verdict.STABLE]
    for end in ends:  # the mirror image of the orbit is -x(t + T/2)
        points = [x for o in orbits for x in (o(0.0), -o(o.period / 2))]
        assert min(np.abs(end - x).max() for x in points) < 1e-5


@pytest.mark.parametrize("method", METHODS)
def test_both_attractors_are_on_the_families_along_the_frequency(method):
    """At F = 0.1, w = 1: the stable orbits, images counted, are the two that a grid of states settles on."""
    found = st.families(method(well()), "w", (0.5, 2.0))
    plain = st.families(method(well()), "w", (0.5, 2.0), merge=False)
    stable, both = ([o for b in some for o in b.at(w=1.0) if o.verdict is st.Verdict.STABLE] for some in (found, plain))
    assert len(stable) == 1 and len(both) == 2
    ends = [settled(0.1, 1.0, (x, v)) for x in np.linspace(-1.5, 1.5, 4) for v in (-0.5, 0.5)]
    for end in ends:
        assert min(np.abs(end - o(0.0)).max() for o in both) < 1e-5
    for orbit in both:
        assert min(np.abs(end - orbit(0.0)).max() for end in ends) < 1e-5


def test_equilibria_of_the_averaged_field():
    """x - x^3 = 0 in the well; phi = 0 and pi of a driven pendulum, once each although angles repeat."""
    problem = st.Collocation(well())
    rests = averaged_equilibria(problem, well().parameter_vector())
    assert sorted(x[0] for x in rests) == pytest.approx([-1.0, 0.0, 1.0], abs=1e-9)
    assert np.abs([x[1] for x in rests]).max() < 1e-9
    a, v, t = sp.symbols("a a_dot t", real=True)
    pendulum = st.System(
        name="pendulum", coordinates=("a",), states=("a", "a_dot"), parameters={"w": 2.0}, angles=("a",),
        rhs=(v, -v / 10 - sp.sin(a) + sp.cos(sp.Symbol("w", real=True) * t) / 10), period_expression=sp.pi,
    )  # fmt: skip
    found = averaged_equilibria(st.Shooting(pendulum), pendulum.parameter_vector())
    assert np.cos([x[0] for x in found]) == pytest.approx([1.0, -1.0], abs=1e-9)


def test_a_hanging_and_an_inverted_pendulum():
    """No polynomial, so no one-harmonic roots: equilibria are the starts; weak forcing, one orbit around each."""
    a, v, t, w = sp.symbols("a a_dot t w", real=True)
    pendulum = st.System(
        name="pendulum", coordinates=("a",), states=("a", "a_dot"), parameters={"w": 2.0}, angles=("a",),
        rhs=(v, -v / 10 - sp.sin(a) + sp.cos(w * t) / 10), period_expression=2 * sp.pi / w,
    )  # fmt: skip
    found = st.families(st.Collocation(pendulum), "w", (1.8, 2.2), places=1, sizes=())
    middles = sorted(np.cos(b.at(w=2.0)[0].amplitude(0)["a"]) for b in found)
    assert middles == pytest.approx([-1.0, 1.0], abs=1e-2)
    verdicts = {round(float(np.cos(o.amplitude(0)["a"]))): o.verdict for b in found for o in b.at(w=2.0)}
    assert verdicts == {1: st.Verdict.STABLE, -1: st.Verdict.UNSTABLE}


def test_candidates_are_for_forced_systems_only():
    cycle = st.models.lorenz()
    assert st.Collocation(cycle).candidates(cycle.parameter_vector()) == []
    assert len(st.Collocation(well()).candidates(well().parameter_vector())) > 3
