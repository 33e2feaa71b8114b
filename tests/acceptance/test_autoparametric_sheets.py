"""Borders of the semi-trivial motion of the autoparametric pendulum: every sheet against the exact damped Mathieu problem.

theta'' + 2 xi2 Omega0 theta' + (Omega0^2 + depth cos(Omega tau + phase)) theta = 0 with the depth of the linear motion
of the mass. Its trace over one period, without damping, is 2 cos(pi nu), nu the characteristic exponent by tridiagonal
recursions; a multiplier of the damped problem is +-1 where the trace is +-2 cosh(xi2 Omega0 T).
"""

import itertools

import numpy as np
import pytest
from scipy.optimize import brentq

import stability as st
from stability.words import Kind

XI1, XI2, OMEGA0 = 0.02, 0.01, 0.5
SIGN = {Kind.PERIOD_DOUBLING: -1, Kind.BRANCH_POINT: 1}


def gap(kind, Omega, length_ratio):
    """sign * trace / (2 cosh) - 1 of the exact problem: zero on the sheets of a kind, positive where it is unstable."""
    depth = Omega**2 * abs(Omega**2 / (1 - Omega**2 + 2j * XI1 * Omega) + 1) / length_ratio
    delta = XI2 * OMEGA0
    a, q = 4 * (OMEGA0**2 - delta**2) / Omega**2, 2 * depth / Omega**2
    trace = 2 * np.cos(np.pi * st.mathieu_exponent(a, q)).real
    return SIGN[kind] * trace / (2 * np.cosh(delta * 2 * np.pi / Omega)) - 1


def by_acceleration(kind, Omega, acceleration):
    return gap(kind, Omega, Omega**2 / (acceleration * OMEGA0**2))


def kind_of(curve):
    return curve.meshes[0].kind


def on_curve(exact, curve, free, tolerance=1e-9):
    """Every point of a curve within `tolerance` (relative, in the plane of both parameters) of the exact one."""
    for at, second in zip(curve.columns["Omega"], curve.columns[free]):
        h = 1e-6
        down = (exact(kind_of(curve), at, second * (1 + h)) - exact(kind_of(curve), at, second * (1 - h))) / (2 * h)
        across = (exact(kind_of(curve), at * (1 + h), second) - exact(kind_of(curve), at * (1 - h), second)) / (2 * h)
        assert abs(exact(kind_of(curve), at, second)) < tolerance * np.hypot(down, across)


def rough(kind, Omega, ratio, steps=600):
    """The same gap on a whole grid of frequencies by the classical Runge-Kutta method: to see where it changes sign."""
    complex_depth = Omega**2 * (Omega**2 / (1 - Omega**2 + 2j * XI1 * Omega) + 1) / ratio
    delta, T = XI2 * OMEGA0, 2 * np.pi / Omega
    h, Y = T / steps, np.broadcast_to(np.eye(2)[:, :, None], (2, 2, Omega.size)).copy()

    def rate(t, Y):
        stiffness = OMEGA0**2 - delta**2 + abs(complex_depth) * np.cos(Omega * t)
        return np.array([Y[1], -stiffness * Y[0]])

    for k in range(steps):
        t = k * h
        k1 = rate(t, Y)
        k2 = rate(t + h / 2, Y + h / 2 * k1)
        k3 = rate(t + h / 2, Y + h / 2 * k2)
        Y = Y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(t + h, Y + h * k3))
    return SIGN[kind] * (Y[0, 0] + Y[1, 1]) / (2 * np.cosh(delta * T)) - 1


def exact_crossings(kind, ratio, window=(0.45, 1.7), count=4000):
    """All Omega where a sheet of the kind crosses a cut; `ratio` is a function of Omega.

    Sign changes on a grid that is dense at the resonance, then the exact problem.
    """
    grid = np.unique(np.concatenate([np.linspace(*window, count), 1 + 0.1 * np.linspace(-1, 1, count) ** 3]))
    values = rough(kind, grid, ratio(grid))
    at = np.flatnonzero(values[:-1] * values[1:] < 0)
    return [brentq(lambda w: gap(kind, w, ratio(w)), grid[k] - 1e-7, grid[k + 1] + 1e-7, xtol=1e-13) for k in at]


def crossings(curves, kind, free, second):
    """All Omega where the curves of a kind cross a cut: solved on the curves themselves."""
    found = []
    for curve in curves:
        if kind_of(curve) is kind:
            level = curve.columns[free] - second
            for k in np.flatnonzero(level[:-1] * level[1:] < 0):
                ends = sorted((curve.columns["Omega"][k], curve.columns["Omega"][k + 1]))

                def height(at, curve=curve):
                    return min((o.params[free] - second for o in curve.at(Omega=at)), key=abs)

                found.append(brentq(height, *ends, xtol=1e-12))
    return sorted(found)


@pytest.fixture(scope="module")
def sheets():
    system = st.models.autoparametric_pendulum(xi1=XI1, xi2=XI2, Omega0=OMEGA0, mass_ratio_total=0.2)
    return st.loci(
        st.Collocation(system, degree=7), "Omega", (0.45, 1.7), free="length_ratio", free_window=(0.7, 500.0), cuts=(0.9, 2.0, 20.0)
    )


def test_sheets_of_both_kinds_lie_on_the_exact_problem(sheets):
    """Two tongues of period doubling, one inside the other around the resonance, and one of multiplier +1 between, ..."""
    assert sum(kind_of(c) is Kind.PERIOD_DOUBLING for c in sheets) >= 3
    assert sum(kind_of(c) is Kind.BRANCH_POINT for c in sheets) >= 2
    for curve in sheets:
        on_curve(gap, curve, "length_ratio")


@pytest.mark.parametrize("ratio", [1.5, 4.0, 40.0])
def test_no_sheet_is_missing_and_gaps_are_where_they_belong(sheets, ratio):
    """On cuts that were not searched: as many borders of each kind as the exact problem has, in the same order."""
    names = []
    for kind in SIGN:
        exact = exact_crossings(kind, lambda w: ratio + 0 * w)
        found = crossings(sheets, kind, "length_ratio", ratio)
        assert len(found) == len(exact) and found == pytest.approx(exact, abs=1e-9)
        names += [(at, kind) for at in exact]
    names.sort()
    assert len(names) == {1.5: 11, 4.0: 8, 40.0: 2}[ratio]
    # a border of one kind after one of the other: the hanging pendulum is stable between them
    for (a, p), (b, q) in itertools.pairwise(names):
        if p is not q:
            middle = [gap(kind, 0.5 * (a + b), ratio) for kind in SIGN]
            assert max(middle) < 0
    if ratio == 1.5:
        assert sum(p is not q for (_, p), (_, q) in itertools.pairwise(names)) == 5


def test_tips_are_the_weakest_excitations(sheets):
    """The largest length ratio of each tongue: d/dOmega of the exact gap vanishes there."""
    tips = [(kind_of(c), p) for c in sheets for p in c.of_kind(Kind.EXTREMUM)]
    assert len(tips) >= 4
    for kind, tip in tips:
        Omega, ratio = tip.params["Omega"], tip.params["length_ratio"]
        h = 1e-4
        ends = [gap(kind, Omega + s * h, ratio) for s in (-1, 0, 1)]
        slope, bend = (ends[2] - ends[0]) / (2 * h), (ends[2] - 2 * ends[1] + ends[0]) / h**2
        assert abs(slope / bend) < 1e-5 and abs(ends[1]) < 1e-9 * max(1.0, abs(bend))


@pytest.mark.slow
def test_sheets_over_frequency_and_acceleration():
    system = st.models.autoparametric_pendulum.from_acceleration(xi1=XI1, xi2=XI2, Omega0=OMEGA0)
    curves = st.loci(
        st.Collocation(system, degree=7), "Omega", (0.45, 1.7), free="acceleration", free_window=(0.02, 3.0), cuts=(0.3, 2.0)
    )
    assert {kind_of(c) for c in curves} == set(SIGN)
    for curve in curves:
        on_curve(by_acceleration, curve, "acceleration")
    for kind in SIGN:
        exact = exact_crossings(kind, lambda w: w**2 / (1.5 * OMEGA0**2))
        assert crossings(curves, kind, "acceleration", 1.5) == pytest.approx(exact, abs=1e-9)
