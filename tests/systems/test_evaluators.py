"""The evaluator's contract: shapes, fixed phase, period, breaks, addresses, threads, typed errors.

Witnesses: closed forms written by hand in numpy, differences at fixed phase, and the C addresses called through ctypes.
"""

import ctypes
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
import sympy as sp

from stability.errors import EquationError, InputError
from stability.systems.evaluators import evaluator
from stability.systems.system import System

x, v, xi, beta, Omega, A, t = sp.symbols("x v xi beta Omega A t", real=True)
BACKENDS = ("llvm", "lambdify")
FORCED = System(
    "duffing", ("x",), ("x", "x_dot"), {"xi": 0.05, "beta": 0.3, "Omega": 1.7, "A": 0.8},
    (sp.Symbol("x_dot", real=True), -2 * xi * sp.Symbol("x_dot", real=True) - x - beta * x**3 + A * Omega**2 * sp.cos(Omega * t)
    ),
    period_expression=2 * sp.pi / Omega,
    outputs={"energy": sp.Symbol("x_dot", real=True) ** 2 / 2 + x**2 / 2, "base": A * sp.cos(Omega * t), "one": sp.Integer(1)},
)  # fmt: skip
FREE = System("oscillator", ("x", "v"), ("x", "v"), {"xi": 0.2}, (v, -xi * v * (x**2 - 1) - x))
PREFIX = [ctypes.c_int64] + [ctypes.c_void_p] * 3 + [ctypes.c_int64] + [ctypes.c_void_p] * 3
NATIVE = ctypes.CFUNCTYPE(None, *PREFIX)


def points(N=30, n=2, seed=1):
    rng = np.random.default_rng(seed)
    return rng.random(N), rng.normal(size=(N, n)), FORCED.parameter_vector()


def by_hand(phase, X, P):
    """F, J and Fp at fixed phase: cos(Omega t) = cos(2 pi phase) does not depend on Omega."""
    xi, beta, Omega, A = np.broadcast_to(P, (len(X), 4)).T
    q, w = X.T
    zero, one, c = np.zeros_like(q), np.ones_like(q), np.cos(2 * np.pi * phase)
    F = np.stack([w, -2 * xi * w - q - beta * q**3 + A * Omega**2 * c], axis=1)
    J = np.stack([zero, one, -1 - 3 * beta * q**2, -2 * xi], axis=1).reshape(-1, 2, 2)
    Fp = np.zeros((len(X), 2, 4))
    Fp[:, 1] = np.stack([-2 * w, -(q**3), 2 * A * Omega * c, Omega**2 * c], axis=1)
    return F, J, Fp


@pytest.mark.parametrize("backend", BACKENDS)
def test_closed_form_with_shared_and_own_parameters(backend):
    e = evaluator(FORCED, backend)
    assert (e.n, e.m, e.forced, e.backend) == (2, 4, True, backend)
    phase, X, P = points()
    own = P * (1 + 0.1 * np.random.default_rng(3).random((len(X), 4)))
    for parameters in (P, own):
        want = by_hand(phase, X, parameters)
        for got, truth in zip(e.FJP(phase, X, parameters), want, strict=True):
            assert got.shape == truth.shape and got.flags.c_contiguous
            np.testing.assert_allclose(got, truth, rtol=0, atol=1e-14)
        np.testing.assert_allclose(e.F(phase, X, parameters), want[0], rtol=0, atol=1e-14)


@pytest.mark.parametrize("backend", BACKENDS)
def test_parameter_derivative_is_at_fixed_phase(backend):
    """Witness: F at p + h and p - h at the same phase; the answer must be bounded for phases far from 0 (not secular)."""
    system = System("drift", ("x", "v"), ("x", "v"), {"Omega": 1.3, "A": 0.5},
                    (v, A * sp.cos(Omega * t) * x + sp.sin(2 * Omega * t + A) + t), period_expression=2 * sp.pi / Omega)  # fmt: skip
    e = evaluator(system, backend)
    phase, X, _ = points()
    P = np.array([1.3, 0.5])
    Fp = e.FJP(phase, X, P)[2]
    for j, h in enumerate((1e-4, 1e-4)):
        shift = h * np.eye(2)[j]
        slope = (8 * (e.F(phase, X, P + shift) - e.F(phase, X, P - shift))
                 - e.F(phase, X, P + 2 * shift) + e.F(phase, X, P - 2 * shift)) / (12 * h)  # fmt: skip
        np.testing.assert_allclose(Fp[:, :, j], slope, rtol=0, atol=1e-10)
    np.testing.assert_allclose(Fp[:, 1, 0], -phase * 2 * np.pi / 1.3**2, rtol=1e-12)  # only the bare t moves with Omega


@pytest.mark.parametrize("backend", BACKENDS)
def test_period_gradient_and_breaks(backend):
    system = System("jumps", ("x",), ("x",), {"Omega": 2.0, "A": 0.25}, (sp.sign(sp.cos(Omega * t)) * x,),
                    period_expression=2 * sp.pi / Omega, breaks=(sp.Rational(3, 4), A, A + 1))  # fmt: skip
    e = evaluator(system, backend)
    P = np.array([2.0, 0.25])
    assert isinstance(e.period(P), float) and e.period(P) == pytest.approx(np.pi, rel=1e-15)
    np.testing.assert_allclose(e.period_gradient(P), [-np.pi / 2, 0.0], rtol=1e-15)
    many = np.array([[2.0, 0.2], [4.0, 0.3]])
    np.testing.assert_allclose(e.period(many), [np.pi, np.pi / 2], rtol=1e-15)
    np.testing.assert_allclose(e.period_gradient(many), [[-np.pi / 2, 0], [-np.pi / 8, 0]], rtol=1e-15)
    np.testing.assert_allclose(e.breaks(P), [0.25, 0.75])
    with pytest.raises(InputError, match="positive"):
        e.period([-2.0, 0.2])


@pytest.mark.parametrize("backend", BACKENDS)
def test_outputs(backend):
    e = evaluator(FORCED, backend)
    phase, X, P = points(5)
    want = np.stack([(X**2).sum(axis=1) / 2, 0.8 * np.cos(2 * np.pi * phase), np.ones(5)], axis=1)
    assert e.output_names == ("energy", "base", "one")
    np.testing.assert_allclose(e.outputs(phase, X, P), want, atol=1e-15)
    assert evaluator(FREE, backend).outputs(None, X, [0.2]).shape == (5, 0)


@pytest.mark.parametrize("backend", BACKENDS)
def test_autonomous_systems_ignore_the_phase(backend):
    e = evaluator(FREE, backend)
    _, X, _ = points(4)
    F, J = e.FJ(None, X, [0.2])
    np.testing.assert_array_equal(F, e.F(np.full(4, 7.0), X, [0.2]))
    np.testing.assert_allclose(F[:, 1], -0.2 * X[:, 1] * (X[:, 0] ** 2 - 1) - X[:, 0], atol=1e-15)
    assert J.shape == (4, 2, 2)
    for call in (e.period, e.period_gradient):
        with pytest.raises(InputError, match="autonomous"):
            call([0.2])
    assert e.breaks([0.2]).shape == (0,)


@pytest.mark.parametrize("backend", BACKENDS)
def test_c_address_gives_the_same_numbers(backend):
    """The address is called as a kernel would call it, with null pointers for what was not asked for."""
    e = evaluator(FORCED, backend)
    phase, X, P = points(9)
    own = np.tile(P, (9, 1)) * np.linspace(0.9, 1.1, 9)[:, None]
    for stride, parameters in ((0, P), (4, own)):
        want = e.FJP(phase, X, parameters)
        quantities = {"F": (e.F(phase, X, parameters),), "FJ": e.FJ(phase, X, parameters), "FJP": want}
        outputs = [np.full_like(array, np.nan) for array in want]
        pointers = [array.ctypes.data for array in outputs]
        head = (9, phase.ctypes.data, X.ctypes.data, parameters.ctypes.data, stride)
        for which, asked in (("F", 1), ("FJ", 2), ("FJP", 3)):
            for array in outputs:
                array[...] = np.nan
            NATIVE(e.address(which))(*head, *pointers[:asked], *[None] * (3 - asked))
            for got, truth in zip(outputs, quantities[which], strict=False):
                np.testing.assert_array_equal(got, truth)
    assert e.address("F") == e.address("F")
    with pytest.raises(InputError, match="'second'"):
        e.address("second")


@pytest.mark.parametrize("backend", BACKENDS)
def test_address_of_an_autonomous_system_needs_no_phase(backend):
    e = evaluator(FREE, backend)
    X, P, F = np.array([[0.3, -0.4]]), np.array([0.2]), np.zeros((1, 2))
    NATIVE(e.address("F"))(1, None, X.ctypes.data, P.ctypes.data, 0, F.ctypes.data, None, None)
    np.testing.assert_array_equal(F, e.F(None, X, P))


def test_sixteen_threads_share_one_evaluator():
    """Compilation and evaluation from 16 threads at once: bit-equal results."""
    fresh = FORCED.replace(outputs={"thread": x**2})
    e = evaluator(fresh, "llvm")
    phase, X, P = points(500)
    V = np.random.default_rng(0).normal(size=(500, 6))
    start, results = threading.Barrier(16), [None] * 16

    def work(k):
        start.wait()
        for _ in range(20):
            results[k] = [*e.FJP(phase, X, P), e.second(phase, X, P, V, V), e.outputs(phase, X, P), evaluator(fresh)]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in results[1:]:
        for got, want in zip(result[:-1], results[0][:-1], strict=True):
            np.testing.assert_array_equal(got, want)


def test_one_evaluator_for_equal_equations():
    """Default values are not part of the code; equations, outputs and back end are."""
    assert evaluator(FORCED) is evaluator(FORCED.with_params(beta=7.0))
    assert evaluator(FORCED) is evaluator(System.from_dict(FORCED.to_dict()))
    assert evaluator(FORCED) is not evaluator(FORCED, "lambdify")
    assert evaluator(FORCED) is not evaluator(FORCED.replace(outputs={}))


def test_points_are_independent():
    """Evaluating in one batch or one by one gives the same bits (nothing is shared between points)."""
    e = evaluator(FORCED)
    phase, X, P = points(7)
    batch = e.FJP(phase, X, P)
    for k in range(7):
        for got, want in zip(e.FJP(phase[k], X[k : k + 1], P), batch, strict=True):
            np.testing.assert_array_equal(got[0], want[k])


def test_empty_batch_strided_and_integer_input():
    e = evaluator(FORCED)
    phase, X, P = points(8)
    assert e.FJ(np.empty(0), np.empty((0, 2)), P)[1].shape == (0, 2, 2)
    wide = np.hstack([X, X])
    wide.flags.writeable = False
    np.testing.assert_array_equal(e.F(phase[::2], wide[::2, 2:], P), e.F(phase, X, P)[::2])
    np.testing.assert_array_equal(e.F(0, [[1, 2]], P), e.F(0.0, [[1.0, 2.0]], P))


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("phase", "X", "P", "words"),
    [
        (0.0, np.zeros(2), None, "X has shape"),
        (0.0, np.zeros((3, 4)), None, "X has shape"),
        (0.0, np.zeros((3, 2)), np.zeros(3), "P has shape"),
        (0.0, np.zeros((3, 2)), np.zeros((2, 4)), "P has shape"),
        (np.zeros(2), np.zeros((3, 2)), None, "phase has shape"),
        (0.0, np.zeros((3, 2), dtype=complex), None, "real numbers"),
        (0.0, [["a", "b"]], None, "real numbers"),
        (None, np.zeros((3, 2)), None, "real numbers"),
    ],
)
def test_wrong_input_is_refused_before_work(backend, phase, X, P, words):
    P = FORCED.parameter_vector() if P is None else P
    with pytest.raises(InputError, match=words):
        evaluator(FORCED, backend).F(phase, X, P)


def test_wrong_directions_and_names():
    e = evaluator(FORCED)
    phase, X, P = points(3)
    with pytest.raises(InputError, match="direction"):
        e.second(phase, X, P, np.zeros((3, 2)), np.zeros((3, 6)))
    np.testing.assert_array_equal(e.second(phase, X, P, np.ones(6), np.ones(6)),
                                  e.second(phase, X, P, np.ones((3, 6)), np.ones((3, 6))))  # fmt: skip
    with pytest.raises(InputError, match="backend"):
        evaluator(FORCED, "fortran")
    with pytest.raises(InputError, match="derivatives"):
        evaluator(FORCED, derivatives="guess")


def test_unknown_symbols_are_named():
    from types import SimpleNamespace

    system = SimpleNamespace(states=("x",), parameters={}, rhs=(x * xi + t,), period_expression=None, outputs={},
                             breaks=(), function=None)  # fmt: skip
    with pytest.raises(EquationError, match="'x' contains t, xi"):
        evaluator(system)


def test_names_that_are_functions_or_generated_ones():
    """Names of the user never enter generated code: numpy functions and our own symbols are all fine."""
    states, parameters = ("x_0", "r_0", "sin"), ("nan", "where")
    x_0, r_0, sine, nan, where = sp.symbols((*states, *parameters), real=True)
    rhs = (sp.sin(sine) * nan + (r_0 + nan) ** 2, (r_0 + nan) ** 2 * where, x_0 * where)
    system = System("names", states, states, {"nan": 0.5, "where": 2.0}, rhs)
    want = [[np.sin(0.3) * 0.5 + 0.49, 0.98, 0.2]]
    for backend in BACKENDS:
        np.testing.assert_allclose(evaluator(system, backend).F(None, [[0.1, 0.2, 0.3]], [0.5, 2.0]), want, rtol=1e-15)


def test_machine_code_needs_neither_scipy_nor_numba():
    """The chart path stays light: a fresh process evaluates both back ends without them."""
    code = (
        "import sys, stability as st; from stability.systems.evaluators import evaluator; s = st.models.duffing();"
        "[evaluator(s, b).FJP(0.0, [[0.1, 0.2]], s.parameter_vector()) for b in ('llvm', 'lambdify')];"
        "print([m for m in ('scipy', 'numba', 'matplotlib') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_the_code_is_the_same_in_every_process():
    """Same input, same bytes: the LLVM text does not depend on hash seeds."""
    code = (
        "import stability as st; from stability.systems._llvm import emit; from stability.systems._program import Equations;"
        "e = Equations(st.models.autoparametric_pendulum()); print(emit(e.program('FJP')), emit(e.program('second')))"
    )
    texts = set()
    for seed in ("1", "2", "3"):
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                             env={**os.environ, "PYTHONHASHSEED": seed})  # fmt: skip
        texts.add(run.stdout)
    assert len(texts) == 1 and "define void @evaluate" in texts.pop()


def test_system_without_parameters():
    system = System("bare", ("x", "v"), ("x", "v"), {}, (v, -sp.sin(x)))
    for backend in BACKENDS:
        F, J, Fp = evaluator(system, backend).FJP(None, [[0.5, 1.0]], [])
        assert Fp.shape == (1, 2, 0) and J[0, 1, 0] == pytest.approx(-np.cos(0.5)) and F[0, 0] == 1.0


def test_twenty_states_compile_and_agree():
    """A chain of ten Duffing oscillators: the two back ends, and the Jacobian's known pattern."""
    q = sp.symbols("q0:10", real=True)
    w = sp.symbols("q0:10_dot", real=True)
    force = [-q[i] - 2 * xi * w[i] - beta * q[i] ** 3 for i in range(10)]
    for i in range(9):
        force[i] += q[i + 1] - q[i] + beta * (q[i + 1] - q[i]) ** 3
        force[i + 1] -= q[i + 1] - q[i] + beta * (q[i + 1] - q[i]) ** 3
    names = tuple(s.name for s in q)
    system = System("chain", names, names + tuple(s.name for s in w), {"xi": 0.01, "beta": 0.2}, (*w, *force))
    X = np.random.default_rng(8).normal(size=(5, 20))
    one, other = (evaluator(system, b).FJP(None, X, [0.01, 0.2]) for b in BACKENDS)
    for got, want in zip(one, other, strict=True):
        np.testing.assert_allclose(got, want, rtol=1e-13, atol=1e-13)
    stiffness = one[1][:, 10:, :10]
    np.testing.assert_allclose(stiffness, stiffness.transpose(0, 2, 1), atol=1e-13)
    assert not np.triu(stiffness, 2).any()
