"""Strutt boundaries: rows 6a-6i of the verified closed forms, each with its order.

Witnesses: Mathieu numbers of scipy and of the library, Floquet multipliers by DOP853, the width of Levy and Keller.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from exact_orbits import SMALL, assert_order, floquet_matrix, observed_orders
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

import stability as st
from stability.errors import InputError

q, mu = sp.symbols("q mu", real=True)


def numbers(expression, **values):
    return float(expression.subs({s: values[s.name] for s in expression.free_symbols}))


@pytest.mark.parametrize(
    ("n", "which", "formula", "order"),
    [
        (1, 1, 1 + q - q**2 / 8, 3.0),
        (1, 0, 1 - q - q**2 / 8, 3.0),
        (2, 1, 4 + 5 * q**2 / 12, 4.0),
        (2, 0, 4 - q**2 / 12, 4.0),
        (0, 0, -(q**2) / 2, 4.0),
    ],
)
def test_undamped_boundaries(n, which, formula, order):
    """Rows 6a-6e."""
    curve = st.transition_series(n, 2)[which]
    assert sp.expand(curve - formula) == 0
    exact = mathieu_a if which == 1 or n == 0 else mathieu_b
    errors = [abs(numbers(curve, q=e) - float(exact(n, e))) for e in SMALL]
    assert_order(errors, order, slack=0.06)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_width_of_the_tongue(n):
    """Row 6f: a_n - b_n ~ q^n/(2^(2n-3) ((n-1)!)^2), relative error of order 2."""
    lower, upper = st.transition_series(n, n)
    lead = sp.Rational(1, 1) / (sp.Integer(2) ** (2 * n - 3) * sp.factorial(n - 1) ** 2)
    assert sp.expand(upper - lower) == lead * q**n
    errors = []
    for e in (0.4, 0.2, 0.1):
        width = float(st.mathieu_a(n, e) - st.mathieu_b(n, e))
        errors.append(abs(numbers(lead * q**n, q=e) / width - 1))
    assert abs(observed_orders(errors, (0.4, 0.2, 0.1))[-1] - 2.0) < 0.1


@pytest.mark.parametrize("n", range(6))
def test_any_order_with_rational_coefficients(n):
    """DLMF 28.6 to order 5 or 6 by its own terms; at order 20 the numbers themselves."""
    curves = st.transition_series(n, 20)
    for curve in curves:
        assert all(c.is_Rational for c in sp.Poly(curve, q).coeffs())
    exact = [st.mathieu_a(n, 0.4)] if n == 0 else [st.mathieu_b(n, 0.4), st.mathieu_a(n, 0.4)]
    for curve, number in zip(curves, exact):
        assert numbers(curve, q=0.4) == pytest.approx(float(number), abs=1e-11)


def test_terms_of_the_handbook():
    """DLMF 28.6.2-28.6.6."""
    assert (
        sp.expand(
            st.transition_series(1, 6)[1]
            - (1 + q - q**2 / 8 - q**3 / 64 - q**4 / 1536 + 11 * q**5 / 36864 + 49 * q**6 / 589824)
        )
        == 0
    )
    assert sp.expand(st.transition_series(0, 6)[0] - (-(q**2) / 2 + 7 * q**4 / 128 - 29 * q**6 / 2304)) == 0
    assert (
        sp.expand(st.transition_series(2, 6)[1] - (4 + 5 * q**2 / 12 - 763 * q**4 / 13824 + 1002401 * q**6 / 79626240))
        == 0
    )
    assert (
        sp.expand(st.transition_series(3, 5)[0] - (9 + q**2 / 16 - q**3 / 64 + 13 * q**4 / 20480 + 5 * q**5 / 16384))
        == 0
    )


def floquet_boundary(n, e, damping, guess, half_width):
    """a near the guess at which a multiplier over pi is (-1)^n, by DOP853."""
    sign = (-1) ** n

    def edge(a):
        M = floquet_matrix(lambda s: a - 2 * e * math.cos(2 * s), damping, math.pi)
        return 1 - sign * np.trace(M) + np.linalg.det(M)

    return brentq(edge, guess - half_width, guess + half_width, xtol=1e-13)


@pytest.mark.parametrize(
    ("n", "order", "formula", "damping", "stated"),
    [
        (1, 1, (1, q**2 - 4 * mu**2), lambda e: 0.3 * e, 2.01),
        (1, 2, (1 - q**2 / 8, q**2 - 4 * mu**2), lambda e: 0.3 * e, 3.00),
        (2, 2, (4 + q**2 / 6, q**4 / 16 - 16 * mu**2), lambda e: 0.04 * e**2, 4.00),
    ],
)
def test_damped_boundaries(n, order, formula, damping, stated):
    """Rows 6g-6i: tongue 1 to first and second order (mu = 0.3 q), tongue 2 (mu = 0.04 q^2); both flanks."""
    mean, square = formula
    curves = st.transition_series(n, order, damping=True)
    for curve, sign in zip(curves, (-1, 1)):
        assert sp.simplify(curve - mean - sign * sp.sqrt(square)) == 0
        errors = []
        for e in SMALL:
            predicted = numbers(curve, q=e, mu=damping(e))
            close = numbers(st.transition_series(n, n + 4, damping=True)[(sign + 1) // 2], q=e, mu=damping(e))
            width = 0.3 * math.sqrt(numbers(square, q=e, mu=damping(e)))
            errors.append(abs(predicted - floquet_boundary(n, e, damping(e), close, width)))
        assert_order(errors, stated, slack=0.1)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_higher_order_with_damping_meets_in_the_tip(n):
    """Order n + 5 against Floquet theory beside the tip (mu just inside), and no pole in the tip itself."""
    lower, upper = st.transition_series(n, n + 5, damping=True)
    e = 0.3
    width = e**n / 4 ** (n - 1) / math.factorial(n - 1) ** 2
    damping = 0.99 * width / (2 * n)
    for curve in (lower, upper):
        predicted = numbers(curve, q=e, mu=damping)
        half = 0.5 * abs(numbers(upper - lower, q=e, mu=damping)) * 0.9
        truth = floquet_boundary(n, e, damping, predicted, half)
        assert abs(predicted - truth) < 30 * e ** (n + 5) / 4 ** (n - 1) * 10
    assert math.isfinite(numbers(upper, q=e, mu=0.8 * damping))


def test_smallest_modulation():
    """q_min = 2 mu in tongue 1, 4 sqrt(mu) in tongue 2, to leading order: where the curves meet."""
    for n, tip in ((1, lambda m: 2 * m), (2, lambda m: 4 * math.sqrt(m))):
        lower, upper = st.transition_series(n, n, damping=True)
        gap = sp.simplify(((upper - lower) / 2) ** 2)
        m = 0.013
        assert numbers(gap, q=tip(m), mu=m) == pytest.approx(0, abs=1e-12)
        assert numbers(gap, q=1.01 * tip(m), mu=m) > 0


def test_form_with_frequency():
    """u'' + 2 xi u' + (1 + h cos 2 Omega t) u: with a = 1/Omega^2, q = -h/(2 Omega^2), mu = xi/Omega the averaged boundary
    (1 - Omega^2)^2 + 4 xi^2 Omega^2 = h^2/4 is the first order of tongue 1 exactly."""
    xi, h = 0.01, 0.08
    for sign in (-1, 1):
        Omega = brentq(
            lambda w, sign=sign: (1 - w * w) + sign * math.sqrt(h * h / 4 - 4 * xi * xi * w * w), 0.9, 1.1, xtol=1e-15
        )
        a_, q_, mu_ = 1 / Omega**2, h / (2 * Omega**2), xi / Omega
        curve = st.transition_series(1, 1, damping=True)[0 if sign > 0 else 1]
        # 1 - Omega^2 = -+ sqrt(...) divided by Omega^2: a = 1 -+ sqrt(q^2 - 4 mu^2)
        assert numbers(curve, q=q_, mu=mu_) == pytest.approx(a_, abs=1e-12)


@pytest.mark.parametrize(
    "bad", [dict(n=-1), dict(n=1.5), dict(n=2, order=99), dict(n=0, damping=True), dict(n=3, order=2, damping=True)]
)
def test_refusals(bad):
    with pytest.raises(InputError):
        st.transition_series(**bad)
