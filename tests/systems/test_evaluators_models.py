"""Every model of the catalogue: machine code and numpy agree to 1e-13, values and all derivatives."""

import numpy as np
import pytest

import stability as st
from stability.systems.evaluators import evaluator

TOLERANCE = 1e-13  # relative to the largest entry of the quantity over the points


def agree(got, want):
    np.testing.assert_array_equal(np.isfinite(got), np.isfinite(want))
    finite = np.isfinite(want)
    scale = np.max(np.abs(want[finite]), initial=0.0)
    assert np.max(np.abs(got - want)[finite], initial=0.0) <= TOLERANCE * scale


@pytest.mark.parametrize("name", sorted(st.models.catalogue()))
def test_back_ends_agree(name):
    """Witness: the numpy back end, which differentiates the whole expressions and shares no generated code."""
    system = getattr(st.models, name)()
    if system.function is not None:
        pytest.skip("a Python function has no second back end")
    rng = np.random.default_rng(7)
    n, m = len(system.states), len(system.parameters)
    phase, X = rng.random(50), 0.3 * rng.normal(size=(50, n))
    P = system.parameter_vector() * (1 + 0.01 * rng.random((50, m)))
    V, W = rng.normal(size=(2, 50, n + m))
    one, other = evaluator(system, "llvm"), evaluator(system, "lambdify")
    for got, want in zip(one.FJP(phase, X, P), other.FJP(phase, X, P), strict=True):
        agree(got, want)
    agree(one.second(phase, X, P, V, W), other.second(phase, X, P, V, W))
    agree(one.outputs(phase, X, P), other.outputs(phase, X, P))
    if one.forced:
        agree(one.period(P), other.period(P))
        agree(one.period_gradient(P), other.period_gradient(P))


@pytest.mark.parametrize("name", sorted(st.models.catalogue()))
def test_jacobian_against_differences(name):
    """Witness: a fourth-order difference quotient of F along a random direction of (x, p), at fixed phase."""
    system = getattr(st.models, name)()
    e = evaluator(system)
    rng = np.random.default_rng(8)
    n, m = e.n, e.m
    phase, X = rng.random(20), 0.3 * rng.normal(size=(20, n))
    X += 0.05 * np.sign(X)
    P = np.tile(system.parameter_vector(), (20, 1))
    V = np.hstack([rng.normal(size=(20, n)), P * rng.normal(size=(20, m))])
    _, J, Fp = e.FJP(phase, X, P)
    slope = np.einsum("kij,kj->ki", np.concatenate([J, Fp], axis=2), V)
    h = 1e-4

    def at(factor):
        return e.F(phase, X + factor * h * V[:, :n], P + factor * h * V[:, n:])

    quotient = (8 * (at(1) - at(-1)) - at(2) + at(-2)) / (12 * h)
    smooth = np.abs(at(1) - 2 * at(0) + at(-1)) < 1e-2 * h * np.maximum(
        1.0, np.abs(slope)
    )  # no kink within the stencil
    assert smooth.mean() > 0.5
    assert np.max(np.abs(quotient - slope)[smooth]) < 1e-7 * np.max(np.abs(slope))
