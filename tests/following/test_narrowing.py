"""Folds and period doublings by points of the curve. Witness: the defining systems of `problems.defining`, polynomials."""

from itertools import pairwise

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.following.locating import Locator
from stability.following.narrowing import interpolant, value_and_slope


def specials(problem, name, window, **options):
    branch = st.continuation(problem, name, window, **options)
    return [(p.label, p.params[name], p.multipliers, p.accuracy) for p in branch.special]


@pytest.fixture
def both(monkeypatch):
    """The special points with and without the short way, and how often that one was taken."""

    def compare(problem, name, window, **options):
        taken = []
        plain = Locator._alone
        monkeypatch.setattr(Locator, "_alone", lambda *a: taken.append(plain(*a)) or taken[-1])
        quick = specials(problem, name, window, **options)
        monkeypatch.setattr(Locator, "_alone", lambda *a: None)
        slow = specials(problem, name, window, **options)
        monkeypatch.setattr(Locator, "_alone", plain)
        return quick, slow, sum(t is not None for t in taken)

    return compare


def agree(quick, slow, tolerance=1e-10):
    assert [q[0] for q in quick] == [s[0] for s in slow]
    for (_, q, values, accuracy), (_, s, expected, _) in zip(quick, slow):
        assert abs(q - s) <= tolerance * (1 + abs(s)) and accuracy < 1e-8
        assert np.abs(values - expected).max() < 1e-6 * (1 + np.abs(expected).max())


@pytest.mark.parametrize("kind", [st.Collocation, st.Shooting, lambda s: st.HarmonicBalance(s, harmonics=9)])
def test_folds_of_the_duffing_oscillator(kind, both):
    random = np.random.default_rng(1)
    for _ in range(3):
        share = random.uniform(0.45, 0.8)
        system = st.models.duffing(xi=0.02, beta=share * 16 * 0.02**2 / 3)
        quick, slow, taken = both(kind(system), "Omega", (0.3, 3.0))
        agree(quick, slow)
        assert taken == len(quick) == 2


def test_period_doublings_of_the_pendulum(both):
    """Among them multipliers -1.000 and -0.97 at one point: the product of both is smooth."""
    quick, slow, taken = both(st.Collocation(st.models.autoparametric_pendulum()), "Omega", (0.7, 1.3))
    agree(quick, slow)
    assert taken == len(quick) == 2


def test_folds_between_branch_points_of_a_hard_spring(both):
    """x'' + 0.1 x' + x + x^3 = 25 cos(omega t): folds and symmetry breakings in turns, some of them close together."""
    system = st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=25.0)
    quick, slow, taken = both(st.Collocation(system), "omega", (0.5, 3.0))
    agree(quick, slow)
    assert taken == sum(label.startswith("LP") for label, *_ in quick) >= 6


def test_folds_of_equilibria(both):
    """0 = lam + c (x - 1)(x - 2)(x - 4) for 40 random c: folds where the derivative vanishes, in closed form."""
    t, lam, c = sp.symbols("t lam c", real=True)
    x = sp.Function("x")(t)
    equation = {x.diff(t): lam + c * (x - 1) * (x - 2) * (x - 4)}
    system = st.System.from_equations(equation, [x], parameters=dict(lam=0.0, c=1.0))
    random = np.random.default_rng(2)
    turning = np.roots(np.polyder(np.poly([1.0, 2.0, 4.0])))
    for _ in range(40):
        factor = random.uniform(0.3, 3.0)
        problem = st.Equilibrium(system.with_params(c=factor))
        start = dict(x=8.0)
        branch = st.continuation(problem, "lam", (-factor * 200.0, factor * 50.0), start=start)
        found = sorted(p.params["lam"] for p in branch.special)
        expected = sorted(-factor * np.polyval(np.poly([1.0, 2.0, 4.0]), turning))
        assert np.abs(np.array(found) - expected).max() < 1e-10 * factor


def test_interpolants_are_exact_for_polynomials():
    random = np.random.default_rng(0)
    for _ in range(100):
        p = np.polynomial.Polynomial(random.standard_normal(6))
        x = np.sort(random.uniform(-1, 2, 3)).tolist()
        if min(b - a for a, b in pairwise(x)) < 0.05:
            continue
        at = random.uniform(-1, 2)
        twice = [y for y in x for _ in (0, 1)]
        c = interpolant(x, [p(y) for y in x], [p.deriv()(y) for y in x])
        assert np.allclose(value_and_slope(twice, c, at, False), (p(at), p.deriv()(at)), rtol=0, atol=1e-9)
        assert np.allclose(value_and_slope(twice, c, at, True), (p.deriv()(at), p.deriv(2)(at)), rtol=0, atol=1e-8)
        low = p.cutdeg(2)
        c = interpolant(x, [low(y) for y in x])
        assert np.allclose(value_and_slope(x, c, at, False), (low(at), low.deriv()(at)), rtol=0, atol=1e-10)
