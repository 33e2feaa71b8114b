"""Fold curves of Duffing's oscillator in one-harmonic balance against its discriminant; zeros that fall on a point."""

import itertools

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.following.monitoring import Monitor
from stability.words import Kind

pytestmark = pytest.mark.filterwarnings("ignore::stability.errors.TruncationWarning")


def folds(xi, fraction=0.4, **options):
    """Fold curve over (Omega, beta) in one-harmonic balance, begun at a part of the largest closed peak's beta."""
    beta = fraction * 16 * xi**2 / 3
    problem = st.HarmonicBalance(st.models.duffing(xi=xi, beta=beta), harmonics=1)
    branch = st.continuation(problem, "Omega", (0.3, 4.0))
    return st.continuation(st.locus(branch["LP1"], free="beta"), "Omega", (0.3, 4.0), **options)


def discriminant():
    """Of a z^3 + b z^2 + c z + d = 0, z = A^2: z ((1 - w + 3 beta z/4)^2 + 4 xi^2 w) = w^2, w = Omega^2; and its terms."""
    w, xi, beta = sp.symbols("w xi beta", positive=True)
    a, b, c, d = sp.Rational(9, 16) * beta**2, sp.Rational(3, 2) * beta * (1 - w), (1 - w) ** 2 + 4 * xi**2 * w, -(w**2)
    terms = (18 * a * b * c * d, -4 * b**3 * d, b**2 * c**2, -4 * a * c**3, -27 * a**2 * d**2)
    return sp.lambdify((w, xi, beta), (sum(terms), sum(abs(e) for e in terms)))


@pytest.mark.parametrize("xi", [0.02, 0.05, 0.1])
def test_fold_curve_is_where_the_discriminant_vanishes(xi):
    curve = folds(xi)
    Omega, beta = curve.columns["Omega"], curve.columns["beta"]
    value, size = discriminant()(Omega**2, xi, beta)
    assert np.abs(value / size).max() < 1e-12
    assert beta.min() < 16 * xi**2 / 3 < beta.max() and Omega.max() == 4.0


@pytest.mark.parametrize("ds_max", [0.05, 0.2])
@pytest.mark.parametrize("xi", [0.01, 0.02, 0.05, 0.1])
def test_cusp_of_one_harmonic_balance(xi, ds_max):
    """The cubic's triple root: Omega = sqrt(3) xi + sqrt(1 + 3 xi^2), beta = 32 (Omega^2 - 1)^3 / (81 Omega^4)."""
    Omega = np.sqrt(3) * xi + np.sqrt(1 + 3 * xi**2)
    beta = 32 * (Omega**2 - 1) ** 3 / (81 * Omega**4)
    (cusp,) = folds(xi, ds_max=ds_max).of_kind(Kind.CUSP)
    assert cusp.params["Omega"] == pytest.approx(Omega, abs=1e-8)
    assert cusp.params["beta"] == pytest.approx(beta, rel=1e-8)


def test_a_zero_that_falls_on_a_point_counts_once():
    """Functions that change sign between points, at a point, or touch zero and return."""

    class Problem:
        def __init__(self, function):
            self.monitors = ((Kind.CUSP, function),)

        def confirmed(self, kind, point, scale):
            return kind

    class Knot:
        def __init__(self, problem, s):
            self.problem, self.s, self.parameter = problem, s, s

    class Bisection:
        def zero(self, a, b, g, ga, gb):
            return Knot(a.problem, a.s + (b.s - a.s) * ga / (ga - gb))

    def zeros(function, places):
        problem = Problem(function)
        knots = [Knot(problem, s) for s in places]
        monitor, found = Monitor(knots[0]), []
        for a, b in itertools.pairwise(knots):
            found += monitor.zeros(Bisection(), [a, b])
        return [f.point.s for f in found]

    assert zeros(lambda p: p.s, (-1.0, -0.5, 0.5, 1.0)) == [0.0]
    assert zeros(lambda p: p.s, (-1.0, 0.0, 0.5, 1.0)) == [0.0]
    assert zeros(lambda p: p.s - 2.0, (-1.0, 0.0, 1.0)) == []
