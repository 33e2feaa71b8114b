"""Gradient of W . D_V F over states and parameters: machine code, numpy, and directional second derivatives agree."""

import ctypes

import numpy as np
import pytest

import stability as st
from stability.errors import InputError
from stability.systems._evaluator import Evaluator
from stability.systems.evaluators import evaluator

MODELS = ("duffing", "autoparametric_pendulum", "chain", "lorenz", "van_der_pol", "base_driven_pendulum", "mathieu")


def sample(system, count=5):
    rng = np.random.default_rng(4)
    n, m = len(system.states), len(system.parameters)
    X, V, W = rng.normal(size=(count, n)), rng.normal(size=(count, n + m)), rng.normal(size=(count, n))
    return rng.uniform(size=count), 0.3 * X, system.parameter_vector(), V, W, np.ones(n + m)


@pytest.mark.parametrize("name", MODELS)
def test_one_program_gives_what_one_direction_at_a_time_gives(name):
    system = getattr(st.models, name)()
    given = sample(system)
    one = evaluator(system, "llvm").second_gradient(*given)
    scale = np.abs(one).max()
    assert scale > 0
    assert np.abs(one - evaluator(system, "lambdify").second_gradient(*given)).max() < 1e-14 * scale
    assert np.abs(one - Evaluator.second_gradient(evaluator(system), *given)).max() < 1e-13 * scale


def test_python_functions_by_differences():
    """x'' = -x^3 - c x' + cos(t): d2F_2[V, e_x] = -6 x V_x, d2F_2[V, e_v] = -V_c, d2F_2[V, e_c] = -V_v."""

    def f(t, x, *, c):
        return np.array([x[1], -(x[0] ** 3) - c * x[1] + np.cos(t)])

    system = st.System.from_function(f, states="x v", parameters={"c": 0.2}, period=2 * np.pi)
    phase, X, P, V, W, sizes = sample(system)
    got = evaluator(system).second_gradient(phase, X, P, V, W, sizes)
    want = W[:, 1:] * np.stack([-6 * X[:, 0] * V[:, 0], -V[:, 2], -V[:, 1]], axis=1)
    assert np.abs(got - want).max() < 1e-6
    assert not evaluator(system).second_gradient(phase, X, P, 0 * V, W, sizes).any()


def test_wrong_shapes_are_refused():
    system = st.models.duffing()
    phase, X, P, V, W, sizes = sample(system)
    with pytest.raises(InputError, match="direction"):
        evaluator(system).second_gradient(phase, X, P, V[:, :2], W, sizes)


def pendulum_function(t, x, *, c):
    return np.array([x[1], -np.sin(x[0]) - c * x[1] + np.cos(t)])


@pytest.mark.parametrize("kind", ["llvm", "lambdify", "function"])
def test_c_addresses_of_directional_derivatives_give_the_same_numbers(kind):
    """As a kernel calls them: shared or own parameters, `sizes` behind the result."""
    system = st.models.autoparametric_pendulum()
    if kind == "function":
        system = st.System.from_function(pendulum_function, states="x v", parameters={"c": 0.2}, period=2 * np.pi)
    e = evaluator(system) if kind == "function" else evaluator(system, kind)
    phase, X, P, V, W, sizes = sample(system)
    U = np.ascontiguousarray(V[::-1])
    given = {"second": (V, U), "third": (V, U, 0.5 * V + U), "second_gradient": (V, W)}
    for which, directions in given.items():
        scaled = (sizes,) if which == "second_gradient" else ()
        want = getattr(e, which)(phase, X, P, *directions, *scaled)
        kinds = [ctypes.c_int64] + [ctypes.c_void_p] * 3 + [ctypes.c_int64] + [ctypes.c_void_p] * (len(directions) + 3)
        call = ctypes.CFUNCTYPE(None, *kinds)(e.directional_address(which))
        for stride, parameters in ((0, P), (len(P), np.tile(P, (len(X), 1)))):
            out = np.full(want.shape, np.nan)
            arrays = [a.ctypes.data for a in (*directions, out, sizes)]
            call(len(X), phase.ctypes.data, X.ctypes.data, parameters.ctypes.data, stride, *arrays, None)
            np.testing.assert_array_equal(out, want)
    with pytest.raises(InputError, match="'F'"):
        e.directional_address("F")


def test_an_error_behind_the_address_becomes_nan_and_is_kept():
    def f(t, x, *, c):
        if np.any(np.abs(x) > 10):
            raise ZeroDivisionError("far out")
        return np.array([x[1], -c * x[0]])

    e = evaluator(st.System.from_function(f, states="x v", parameters={"c": 0.2}, period=2 * np.pi))
    kinds = [ctypes.c_int64] + [ctypes.c_void_p] * 3 + [ctypes.c_int64] + [ctypes.c_void_p] * 5
    phase, X, P, V, out = np.zeros(1), np.full((1, 2), 50.0), np.array([0.2]), np.ones((1, 3)), np.zeros((1, 2))
    pointers = [a.ctypes.data for a in (phase, X, P)]
    call = ctypes.CFUNCTYPE(None, *kinds)(e.directional_address("second"))
    call(1, *pointers, 0, *[a.ctypes.data for a in (V, V, out)], None, None)
    assert np.isnan(out).all() and "far out" in e.failure()
