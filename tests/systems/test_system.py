"""`System`: constructors, data, copies, errors. Witnesses: hand-derived equations, round trips, other processes."""

import os
import subprocess
import sys

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import EquationError, FileFormatError, InputError, UnknownNameError

t = sp.Symbol("t")
x = sp.Function("x")(t)
y = sp.Function("y")(t)


def oscillator(**params):
    k, F, Omega = sp.symbols("k F Omega")
    return st.System.from_equations(
        [sp.Eq(2 * x.diff(t, 2) + k * x, F * sp.cos(Omega * t))],
        [x],
        parameters={"k": 8.0, "F": 0.1, "Omega": 2.0, **params},
    )


def test_states_are_coordinates_then_velocities():
    system = st.System.from_equations({x.diff(t, 2): -x + y, y.diff(t): x.diff(t) - y}, [x, y])
    assert system.states == ("x", "y", "x_dot")
    assert system(0.0, [1.0, 2.0, 3.0]).tolist() == [3.0, 3.0 - 2.0, -1.0 + 2.0]


def test_mass_matrix_is_solved_like_numpy_does():
    m = sp.Matrix([[2, 1], [1, 3]])
    accelerations = m * sp.Matrix([x.diff(t, 2), y.diff(t, 2)])
    system = st.System.from_equations([sp.Eq(accelerations[0], -4 * x), sp.Eq(accelerations[1], -5 * y)], [x, y])
    state = np.array([0.3, -0.7, 0.1, 0.2])
    expected = np.linalg.solve(np.array([[2.0, 1], [1, 3]]), [-4 * 0.3, 5 * 0.7])
    assert system(0.0, state)[2:] == pytest.approx(expected, rel=1e-15)


def test_lagrangian_of_the_double_pendulum_gives_known_small_frequencies():
    a, b = sp.Function("a")(t), sp.Function("b")(t)
    T = sp.Rational(1, 2) * (2 * a.diff(t) ** 2 + b.diff(t) ** 2 + 2 * a.diff(t) * b.diff(t) * sp.cos(a - b))
    U = -2 * sp.cos(a) - sp.cos(b)
    system = st.System.from_lagrangian(T - U, [a, b])
    step, columns = 1e-6, []
    for e in np.eye(4):
        columns.append((system(0.0, step * e) - system(0.0, -step * e)) / (2 * step))
    frequencies = np.sort(np.abs(np.linalg.eigvals(np.array(columns).T).imag))[::2]
    assert frequencies**2 == pytest.approx([2 - np.sqrt(2), 2 + np.sqrt(2)], rel=1e-8)


def test_external_force_period_is_found_and_follows_the_parameter():
    system = oscillator()
    assert system.period == pytest.approx(np.pi, rel=1e-15)
    assert system.with_params(Omega=4.0).period == pytest.approx(np.pi / 2, rel=1e-15)
    assert system.period_at(Omega=1.0) == pytest.approx(2 * np.pi, rel=1e-15)


def test_common_period_of_several_harmonics():
    w = sp.Symbol("w")
    system = st.System.from_equations(
        {x.diff(t, 2): -(1 + sp.cos(2 * w * t) + sp.sin(3 * w * t)) * x}, [x], parameters=dict(w=1.0)
    )
    assert system.period == pytest.approx(2 * np.pi)


def test_equality_and_hash_by_content_also_in_another_process():
    assert oscillator() == oscillator() and hash(oscillator()) == hash(oscillator())
    assert oscillator() != oscillator(k=9.0)
    code = (
        "import sympy as sp, stability as st; t = sp.Symbol('t'); x = sp.Function('x')(t);"
        "k, F, Omega = sp.symbols('k F Omega');"
        "s = st.System.from_equations([sp.Eq(2*x.diff(t, 2) + k*x, F*sp.cos(Omega*t))], [x],"
        " parameters=dict(k=8.0, F=0.1, Omega=2.0)); print(s.digest)"
    )
    for seed in "01":
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "PYTHONHASHSEED": seed}
        )
        assert done.stdout.strip() == oscillator().digest, done.stderr


def test_round_trip_through_plain_data():
    import json

    for system in (oscillator(), st.models.meissner(), st.models.autoparametric_pendulum(), st.models.harvester()):
        again = st.System.from_dict(json.loads(json.dumps(system.to_dict())))
        assert again == system and again.parameters == system.parameters


def test_damaged_data_is_refused():
    data = oscillator().to_dict()
    for broken in ({}, {"schema": "x"}, {k: v for k, v in data.items() if k != "rhs"}, {**data, "parameters": 3}):
        with pytest.raises(FileFormatError):
            st.System.from_dict(broken)


def test_from_function_agrees_with_the_same_equations():
    def f(t, x, *, k=8.0, F=0.1, Omega=2.0):
        return x[1], -0.5 * k * x[0] + 0.5 * F * np.cos(Omega * t)

    by_function = st.System.from_function(f, "x x_dot", period=lambda Omega: 2 * np.pi / Omega)
    state, times = np.array([[0.1, 0.2, 0.3], [1.0, 2.0, 3.0]]), np.array([0.0, 0.3, 7.0])
    assert by_function(times, state) == pytest.approx(oscillator()(times, state), rel=1e-14)
    assert by_function.period == pytest.approx(oscillator().period)
    with pytest.raises(InputError):
        by_function.to_dict()


def test_solve_ivp_takes_a_system():
    from scipy.integrate import solve_ivp

    free = oscillator(F=0.0)
    end = solve_ivp(free, (0, 1.0), [1.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert end == pytest.approx([np.cos(2.0), -2 * np.sin(2.0)], abs=1e-8)


def test_excitation_is_exchanged_exactly():
    physical = st.models.duffing.from_physical(amplitude=2e-4)
    shaken = physical.with_excitation(st.ConstantAcceleration(4.905))
    w = 2 * np.pi * 25.0
    assert shaken(0.01, [1e-3, 0.1]) == pytest.approx(physical(0.01, [1e-3, 0.1], amplitude=4.905 / w**2), rel=1e-13)
    assert shaken.with_excitation(st.ConstantAmplitude(2e-4))(0.01, [1e-3, 0.1]) == pytest.approx(
        physical(0.01, [1e-3, 0.1]), rel=1e-13
    )
    with pytest.raises(InputError, match="declares no base motion"):
        st.models.duffing().with_excitation(st.ConstantAcceleration(1.0))


def test_systems_are_frozen():
    with pytest.raises(AttributeError):
        oscillator().name = "other"
    with pytest.raises(TypeError):
        oscillator().parameters["k"] = 1.0


k = sp.Symbol("k")


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: st.System.from_equations([x.diff(t, 2) + x], [x, y]), EquationError, "must be square"),
        (lambda: st.System.from_equations({x.diff(t, 2): -k * x}, [x]), EquationError, "parameters=dict"),
        (lambda: st.System.from_equations({x.diff(t, 2): -x * sp.exp(-t)}, [x]), EquationError, "period"),
        (lambda: st.System.from_equations([x.diff(t, 2) ** 2 + x], [x]), EquationError, "not linear"),
        (lambda: st.System.from_equations([x.diff(t) + y, y.diff(t, 3)], [x, y]), EquationError, "order"),
        (lambda: st.System.from_equations([x.diff(t) + y.diff(t), x.diff(t) + y.diff(t) + x], [x, y]), EquationError, "singular"),
        (lambda: st.System.from_equations({x.diff(t, 2): -k * x}, [x], parameters={"k": float("nan")}), InputError, "finite"),
        (lambda: st.System.from_equations({x.diff(t, 2): -k * x}, [x], parameters={"k": "2"}, period=-1), InputError, "positive"),
        (lambda: st.System.from_equations({x.diff(t, 2): -k * x}, [x], parameters={"k": 1, "lambda": 2}), EquationError, "keyword"),
        (lambda: st.System.from_equations({x.diff(t, 2): -k * x}, [x], parameters={"k": 1, "x": 2}), EquationError, "two things"),
        (lambda: st.System.from_equations({x.diff(t, 2): -k * x}, [x], parameters={"k": 1}, bounds={"k": (2, 3)}), InputError, "bounds"),
        (lambda: st.System.from_equations({x.diff(t, 2): -k * x}, [x], parameters={"k": 1}, angles=["phi"]), UnknownNameError, "phi"),
        (lambda: oscillator().with_params(omga=1.0), UnknownNameError, "did you mean 'Omega'"),
        (lambda: oscillator().with_params(Omega=0.0), (InputError, ZeroDivisionError), "period"),
        (lambda: oscillator()(0.0, [1.0, 2.0, 3.0]), InputError, "state axis first"),
        (lambda: oscillator().state_vector(dict(z=1.0)), UnknownNameError, "z"),
        (lambda: st.System.from_function(lambda t: 0, "x"), InputError, "signature"),
        (lambda: st.models.mathieu(detla=0.1), UnknownNameError, "did you mean 'delta'"),
        (lambda: st.models.mathieu(0.1), InputError, "keyword"),
        (lambda: st.models.mathiu, AttributeError, "did you mean 'mathieu'"),
    ],
)  # fmt: skip
def test_bad_input_is_answered_at_the_door(make, error, words):
    with pytest.raises(error, match=words):
        make()
