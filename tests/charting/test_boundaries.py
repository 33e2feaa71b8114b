"""Boundary curves and tips against the linear eigenproblem in the stiffness (research note 3.5) and known minima."""

from __future__ import annotations

import numpy as np
import pytest

import stability as st


def stiffness_values(b, delta, parity, size=40):
    """All a at which q'' + 2 delta q' + (a + b cos t) q = 0 has multiplier +1 (parity 0) or -1 (parity 1).

    q = sum c_k exp(i k t), k whole or half numbers: a c_k = (k^2 - 2 i delta k) c_k - (b/2)(c_{k-1} + c_{k+1}).
    """
    k = np.arange(-size, size + 1) + 0.5 * parity
    matrix = np.diag(k**2 - 2j * delta * k)
    off = np.arange(len(k) - 1)
    matrix[off, off + 1] = matrix[off + 1, off] = -0.5 * b
    return np.linalg.eigvals(matrix)


@pytest.fixture(scope="module")
def charts():
    return {
        d: st.chart(st.models.mathieu(delta=d), x=("a", -0.5, 3.2), y=("b", 0, 2.2), shape=(50, 50))
        for d in (0.0, 0.01, 0.05)
    }


@pytest.mark.parametrize("delta", [0.0, 0.01, 0.05])
def test_edges_are_eigenvalues_to_ten_digits(charts, delta):
    checked = 0
    for curve in charts[delta].boundaries:
        assert curve.kind == ("+1" if curve.order % 2 == 0 else "-1")
        tips = [tip for tip in charts[delta].tips if tip.order == curve.order]
        for a, b in zip(curve.x[::7], curve.y[::7], strict=True):
            if any(abs(b - tip.y) < 1e-3 for tip in tips):
                continue  # the eigenvalue itself is a double one there
            values = stiffness_values(b, delta, curve.order % 2)
            assert np.abs(values - a).min() < 1e-10
            checked += 1
    assert checked > 40


def tip_of(order, delta, guess):
    """Least b of a tongue: the two real eigenvalues coalesce, so their squared difference, analytic in b, vanishes."""

    def squared_gap(b):
        values = stiffness_values(b, delta, order % 2)
        first, second = values[np.argsort(np.abs(values - guess[0]))[:2]]
        return ((first - second) ** 2).real, (0.5 * (first + second)).real

    b0, b1 = guess[1] * (1 + 1e-4), guess[1] * (1 - 1e-4)
    f0, f1 = squared_gap(b0)[0], squared_gap(b1)[0]
    for _ in range(12):
        if f1 == f0 or abs(b1 - b0) < 1e-15:
            break
        b0, b1, f0 = b1, b1 - f1 * (b1 - b0) / (f1 - f0), f1
        f1 = squared_gap(b1)[0]
    return squared_gap(b1)[1], b1


@pytest.mark.parametrize(
    ("delta", "published"),
    [(0.01, (0.0200015, 0.2853361, 1.0031131)), (0.05, (0.1001870, 0.6596572, 1.7838147))],
)
def test_tips_of_orders_one_to_three(charts, delta, published):
    tips = {tip.order: tip for tip in charts[delta].tips}
    for order, value in enumerate(published, start=1):
        tip = tips[order]
        assert abs(tip.y - value) < 6e-8
        a, b = tip_of(order, delta, (tip.x, tip.y))
        assert abs(tip.y - b) < 1e-9
        assert abs(tip.x - a) < 1e-8


def test_undamped_edges_include_both_sides_of_narrow_tongues(charts):
    roots = sorted(c.x[i] for c in charts[0.0].boundaries for i in (0, -1) if abs(c.y[i]) < 1e-12)
    np.testing.assert_allclose(roots, [0, 0.25, 0.25, 1, 1, 2.25, 2.25], atol=1e-9)


def test_the_growth_rate_vanishes_on_every_boundary_point(charts):
    for delta in (0.01, 0.05):
        chart = charts[delta]
        for curve in chart.boundaries:
            growth = [chart.at(a=x, b=y).growth_rate for x, y in zip(curve.x[::5], curve.y[::5], strict=True)]
            assert np.abs(growth).max() < 1e-10


def test_orders_when_the_frequency_is_the_axis():
    chart = st.chart(st.models.mathieu(a=1.0, delta=0.02), x=("Omega", 0.6, 2.4), y=("b", 0, 0.7), shape=30)
    tips = {tip.order: tip.x for tip in chart.tips}
    assert {1, 2} <= set(tips)
    for order in (1, 2):
        assert abs(tips[order] - 2.0 / order) < 0.1


def test_combination_resonance_tips_stand_near_the_sum_of_frequencies():
    chart = st.chart(st.models.coupled_mathieu(), x=("Omega", 1.8, 3.6), y=("epsilon", 0, 0.4), shape=40)
    kinds = sorted((round(tip.x, 1), tip.kind) for tip in chart.tips)
    assert kinds == [(2.0, "-1"), (2.7, "pair"), (3.4, "-1")]
