"""Dimensionless forms, linearised equations, analogies. Witness: the catalogue's dimensionless models, derived apart."""

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import EquationError, ExpressionError, InputError


def same_equations(one, two):
    return all(sp.simplify(a - b) == 0 for a, b in zip(one.rhs, two.rhs))


DUFFING = dict(
    frequency="sqrt(stiffness/mass)",
    lengths=dict(y="amplitude"),
    names=dict(y="u"),
    groups=dict(
        xi="damping/(2*sqrt(stiffness*mass))",
        beta="cubic*amplitude**2/stiffness",
        Omega="2*pi*frequency*sqrt(mass/stiffness)",
    ),
)


def test_duffing_in_si_units_becomes_equation_53():
    scaled = st.dimensionless(st.models.duffing.from_physical(amplitude=2e-4), **DUFFING)
    assert scaled.states == ("u", "u_dot")
    assert same_equations(scaled, st.models.duffing(gravity=0.0).replace(rhs=tuple(
        e.subs(sp.Symbol("gravity", real=True), 0) for e in st.models.duffing().rhs)))  # fmt: skip
    assert scaled.parameters["beta"] == pytest.approx(1.9e7 * 4e-8 / 315.827)


def test_gravity_gives_varrho():
    groups = {**DUFFING["groups"], "gravity": "g*mass/(amplitude*stiffness)"}
    scaled = st.dimensionless(
        st.models.duffing.from_physical(amplitude=2e-4, gravity=True), **{**DUFFING, "groups": groups}
    )
    assert same_equations(scaled, st.models.duffing())


def test_chain_in_si_units_becomes_the_dimensionless_chain():
    w1 = "sqrt(stiffness1/mass1)"
    scaled = st.dimensionless(
        st.models.chain.from_physical(amplitude=2e-4, gravity=True),
        frequency=w1,
        lengths=dict(y1="amplitude", y2="amplitude"),
        names=dict(y1="u", y2="v"),
        groups=dict(
            xi1=f"damping1/(2*mass1*{w1})",
            xi2="damping2/(2*sqrt(stiffness2*mass2))",
            mass_ratio_21="mass2/mass1",
            Omega0=f"sqrt(stiffness2/mass2)/{w1}",
            beta1=f"cubic1*amplitude**2/(mass1*{w1}**2)",
            beta2=f"cubic2*amplitude**2/(mass2*{w1}**2)",
            Omega=f"2*pi*frequency/{w1}",
            gravity=f"g/(amplitude*{w1}**2)",
        ),
    )
    assert same_equations(scaled, st.models.chain())


def test_pendulum_in_si_units_becomes_the_corrected_equations():
    m = "(mass1+mass2)"
    w1 = f"sqrt(stiffness/{m})"
    scaled = st.dimensionless(
        st.models.autoparametric_pendulum.from_physical(amplitude=1e-4),
        frequency=w1,
        lengths=dict(y="amplitude"),
        names=dict(y="u", phi="theta"),
        groups=dict(
            xi1=f"damping/(2*{m}*{w1})",
            xi2="pendulum_damping/(2*mass2*length**2*sqrt(g/length))",
            mass_ratio_total=f"mass2/{m}",
            length_ratio="length/amplitude",
            Omega0=f"sqrt(g/length)/{w1}",
            Omega=f"2*pi*frequency/{w1}",
        ),
    )
    assert same_equations(scaled, st.models.autoparametric_pendulum())
    assert not same_equations(scaled, st.models.autoparametric_pendulum(base_term=False))
    assert scaled.parameters["length_ratio"] == pytest.approx(20.13, abs=0.01)


def test_motion_is_the_same_after_scaling_back():
    from scipy.integrate import solve_ivp

    physical = st.models.duffing.from_physical(amplitude=2e-4, frequency=22.0)
    scaled = st.dimensionless(physical, **DUFFING)
    w1, A = np.sqrt(315.827 / 0.02), 2e-4
    end = 0.3
    one = solve_ivp(physical, (0, end), [1e-3, 0.05], method="DOP853", rtol=1e-12, atol=1e-15).y[:, -1]
    two = solve_ivp(scaled, (0, w1 * end), [1e-3 / A, 0.05 / (A * w1)], method="DOP853", rtol=1e-12, atol=1e-12).y[
        :, -1
    ]
    assert two * [A, A * w1] == pytest.approx(one, rel=1e-9, abs=1e-12)


def test_a_missing_group_is_named():
    groups = {k: v for k, v in DUFFING["groups"].items() if k != "beta"}
    with pytest.raises(EquationError, match=r"leave .*cubic"):
        st.dimensionless(st.models.duffing.from_physical(amplitude=2e-4), **{**DUFFING, "groups": groups})
    with pytest.raises(ExpressionError, match=r"did you mean .stiffness"):
        st.dimensionless(st.models.duffing.from_physical(amplitude=2e-4), **{**DUFFING, "frequency": "sqrt(stifness)"})


def test_linearised_jacobian_against_differences():
    system = st.models.autoparametric_pendulum(xi1=0.02)
    about = dict(u=0.3, theta=0.4, theta_dot=0.1)
    linear = st.linearised(system, about)
    base = system.state_vector(about)
    for e in np.eye(4):
        numeric = (system(0.7, base + 1e-6 * e) - system(0.7, base - 1e-6 * e)) / 2e-6
        assert linear(0.7, e) - linear(0.7, 0 * e) == pytest.approx(numeric, rel=1e-6, abs=1e-6)


def test_linearised_twice_changes_nothing():
    once = st.linearised(st.models.chain(beta1=0.1))
    assert [sp.expand(e) for e in st.linearised(once).rhs] == [sp.expand(e) for e in once.rhs]


def test_analogies_are_inverse_and_keep_frequency_and_damping():
    for analogy in ("force-voltage", "force-current"):
        circuit = st.models.mechanical_to_electrical(
            mass=0.02, damping=0.1, stiffness=300.0, force=2.0, analogy=analogy
        )
        back = st.models.electrical_to_mechanical(**circuit, analogy=analogy)
        assert back == pytest.approx(dict(mass=0.02, damping=0.1, stiffness=300.0, force=2.0), rel=1e-15)
        assert circuit["inductance"] * circuit["capacitance"] == pytest.approx(0.02 / 300.0)
    R, C, L = (circuit[k] for k in ("resistance", "capacitance", "inductance"))
    assert 1 / (2 * R) * np.sqrt(L / C) == pytest.approx(0.1 / (2 * np.sqrt(0.02 * 300.0)))  # parallel circuit


def test_the_analogue_system_moves_alike():
    mechanical = st.models.chain.from_physical(cubic1=1e6)
    for analogy in ("force-voltage", "force-current"):
        electrical = st.models.analogue(mechanical, analogy)
        assert electrical(0.01, [1e-3, 2e-3, 0.1, -0.2]) == pytest.approx(
            mechanical(0.01, [1e-3, 2e-3, 0.1, -0.2]), rel=1e-12
        )


def test_bad_analogies():
    with pytest.raises(InputError, match="force-voltage"):
        st.models.mechanical_to_electrical(mass=1, damping=1, stiffness=1, analogy="mobility")
    with pytest.raises(InputError, match="infinite"):
        st.models.mechanical_to_electrical(mass=1, damping=1, stiffness=0)
    with pytest.raises(InputError, match="no parameter"):
        st.models.analogue(st.models.van_der_pol())


def test_table_one_is_corrected():
    rows = {r.quantity: r for r in st.models.TRANSLATION_ROTATION}
    assert rows["power"].rotation == "P = T omega" and rows["velocity"].rotation == "omega = dphi/dt"
    assert len(rows) == 10
