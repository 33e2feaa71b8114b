"""`averaging`, `multiple_scales` and the way back: what is accepted, what is refused and how, and what is exact.

Witnesses: direct quadrature of the right-hand side over the fast phase (the definition of the average), the two sets of
variables against each other, the residual in the original equations, DOP853.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
import sympy as sp
from exact_orbits import TIGHT, observed_orders
from scipy.integrate import solve_ivp

import stability as st
from stability.analytic.monomials import monomials
from stability.analytic.scales import graded
from stability.errors import EquationError, InputError, UnknownNameError

t = sp.Symbol("t")
x, y = sp.Function("x", real=True)(t), sp.Function("y", real=True)(t)
e, w, F, b = sp.symbols("e w F b", real=True)
xs, vs = sp.symbols("x x_dot", real=True)


def oscillator(rest, **parameters):
    """x'' + x + rest = F cos(w t)."""
    values = dict(e=0.1, w=1.05, F=0.1) | parameters
    return st.System.from_equations({x.diff(t, 2): -x - rest + F * sp.cos(w * t)}, [x], parameters=values)


def by_quadrature(system, state, ratio=(1, 1), **params):
    """u' = -<g sin>/nu, v' = <g cos>/nu with g = f + nu^2 x, by the trapezoidal rule over the fast phase."""
    values = {**system.parameters, **params}
    nu = 2 * math.pi / system.period_at(**params) * ratio[1] / ratio[0]
    n = 40000 if ratio == (1, 1) else 4000
    phase = 2 * math.pi * ratio[0] * (np.arange(n) + 0.5) / n
    u, v = state
    q = u * np.cos(phase) + v * np.sin(phase)
    rate = nu * (-u * np.sin(phase) + v * np.cos(phase))
    g = system(phase / nu, np.array([q, rate]), **values)[1] + nu**2 * q
    return np.array([-np.mean(g * np.sin(phase)), np.mean(g * np.cos(phase))]) / nu


TERMS = {
    "cubic": e * x**3,
    "eleventh power": e * x**11,
    "even powers": e * (x**2 + x**12 + x**2 * x.diff(t) ** 2),
    "van der Pol": e * (x**2 - 1) * x.diff(t),
    "inertia": e * x * x.diff(t) ** 2,
    "parametric": e * x * sp.cos(2 * w * t) + e * x**3 * sp.sin(2 * w * t) + e * sp.cos(w * t) ** 2 * x.diff(t),
    "quadratic parametric": e * x**2 * sp.cos(w * t + sp.Rational(3, 10)),
    "dry friction": e * sp.sign(x.diff(t)),
    "quadratic damping": e * sp.Abs(x.diff(t)) * x.diff(t),
    "real power": e * sp.Abs(x) ** sp.Rational(3, 2) * sp.sign(x),
    "mixed modulus": e * sp.Abs(x) * x.diff(t) + e * x * sp.Abs(x.diff(t)),
    "modulus": e * sp.Abs(x) + e * sp.Abs(x) ** 3 * x,
}


@pytest.mark.parametrize("name", TERMS)
def test_first_order_is_the_average_over_the_fast_phase(name):
    system = oscillator(TERMS[name])
    slow = st.averaging(system, small=("e", "F"))
    for state in ([0.7, 0.0], [0.4, -0.9], [-1.1, 0.2]):
        # the midpoint rule over a kink or a jump converges as 1/n^2 or 1/n; smooth ones are exact
        tolerance = (
            1e-12
            if "modul" not in name and "real" not in name and "friction" not in name and "quadratic d" not in name
            else 2e-5
        )
        assert slow(0.0, state) == pytest.approx(by_quadrature(system, state), abs=tolerance)


def test_parametric_resonance_is_the_average_over_two_periods():
    model = st.models.duffing_mathieu()
    slow = st.averaging(model, resonance=(2, 1))
    for state in ([0.7, 0.1], [-0.3, 0.5]):
        assert slow(0.0, state, h=0.3) == pytest.approx(by_quadrature(model, state, (2, 1), h=0.3), abs=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("method", [st.averaging, st.multiple_scales])
@pytest.mark.parametrize(
    "model", [st.models.duffing_textbook, st.models.duffing_mathieu, st.models.autoparametric_quadratic]
)
def test_polar_and_cartesian_are_the_same_flow(model, method, order):
    """q = a cos(phi + psi) = u cos phi + v sin phi: the two vector fields, mapped into each other, and reconstructions."""
    system = model()
    pair = (1, 1) if model is st.models.duffing_textbook else (2, 1)
    cartesian = method(system, order=order, resonance=pair)
    polar = method(system, order=order, resonance=pair, variables="polar")
    a, psi = np.array([0.8, 0.3])[: cartesian.n // 2], np.array([0.4, -1.1])[: cartesian.n // 2]
    z = np.ravel(np.column_stack([a * np.cos(psi), -a * np.sin(psi)]))
    rates = polar(0.0, np.ravel(np.column_stack([a, psi]))).reshape(-1, 2)
    mapped = np.column_stack(
        [
            rates[:, 0] * np.cos(psi) - a * np.sin(psi) * rates[:, 1],
            -rates[:, 0] * np.sin(psi) - a * np.cos(psi) * rates[:, 1],
        ]
    ).ravel()
    assert cartesian(0.0, z) == pytest.approx(mapped, abs=1e-13)
    times = np.linspace(0, 5, 7)
    mine, other = st.reconstruct(cartesian, z, times), st.reconstruct(polar, np.ravel(np.column_stack([a, psi])), times)
    assert mine == pytest.approx(other, abs=1e-13)


def test_slow_flow_is_a_system_like_any_other():
    """Stored and read back, hashed, printed, followed; the reconstruction comes along."""
    slow = st.averaging(st.models.autoparametric_pendulum(), resonance=(2, 1))
    again = st.System.from_dict(json.loads(json.dumps(slow.to_dict())))
    assert again == slow and hash(again) == hash(slow)
    assert dict(again.reconstruction) == dict(slow.reconstruction)
    assert slow.states == ("u_cos", "u_sin", "theta_cos", "theta_sin")
    assert slow.period is None and list(slow.reconstruction) == ["u", "theta", "u_dot", "theta_dot"]
    assert r"\dot{\theta_{cos}}" in slow.latex()
    assert slow != slow.replace(reconstruction={})
    branch = st.continuation(st.Equilibrium(st.averaging(st.models.duffing())), "Omega", (0.3, 3.0))
    assert [p.kind for p in branch.special] == [st.Kind.FOLD, st.Kind.FOLD]
    assert "u_amplitude" in branch.columns


def test_systems_without_reconstruction_are_stored_as_before():
    assert "reconstruction" not in st.models.duffing().to_dict()
    with pytest.raises(EquationError, match="reconstruction of 'x'"):
        st.models.duffing().replace(reconstruction={"x": sp.Symbol("nobody", real=True)})


# ------------------------------------------------------------------ the way back
@pytest.mark.parametrize(("order", "slope"), [(1, 1.0), (2, 2.0)])
def test_residual_falls_with_the_order_of_the_method(order, slope):
    """max |q'' - f|/max |q''| over eps = 0.2 ... 0.025, Duffing with a quadratic term at 1:1."""
    small, residuals = (0.2, 0.1, 0.05, 0.025), []
    system = oscillator(e * x**3 + e * x**2 / 2 + e * x.diff(t) / 5)
    slow = st.averaging(system, small=("e", "F"), order=order)
    for value in small:
        params = dict(e=value, F=value / 2, w=1 + 0.4 * value)
        point = st.solve(st.Equilibrium(slow.with_params(**params)), start=dict(x_cos=0.8, x_sin=0.3))
        residuals.append(st.reconstruction_residual(system, slow, point))
    assert abs(observed_orders(residuals)[-1] - slope) < 0.15


@pytest.mark.parametrize("order", [1, 2])
def test_transient_of_the_slow_flow_follows_the_oscillator(order):
    """Reconstruction along a slow trajectory against DOP853 up to t = 1/eps: error O(eps), O(eps^2)."""
    small, errors = (0.1, 0.05, 0.025), []
    system = oscillator(e * x**3 + e * x.diff(t) / 5)
    slow = st.averaging(system, small=("e", "F"), order=order)
    for value in small:
        params = dict(e=value, F=value / 2, w=1 + 0.3 * value)
        times = np.linspace(0, 1 / value, 60)
        z0 = np.array([0.9, 0.2])
        path = solve_ivp(lambda s, z, p=params: slow(s, z, **p), (0, times[-1]), z0, t_eval=times, **TIGHT).y
        mine = st.reconstruct(slow, path, times, **params)
        full = solve_ivp(lambda s, q, p=params: system(s, q, **p), (0, times[-1]), mine[:, 0], t_eval=times, **TIGHT).y
        errors.append(np.abs(mine - full).max())
    assert observed_orders(errors, small)[-1] > (0.85 if order == 1 else 1.8)


def test_superharmonic_of_soft_excitation_needs_hard_forcing_or_order_two():
    """x^2 has a 1:2 superharmonic at the second order: the forcing enters through F^2."""
    system = oscillator(e * x**2)
    with pytest.raises(InputError, match=r"no resonance 1:2 to order 1.*1:1"):
        st.averaging(system, small=("e", "F"), resonance=(1, 2))
    assert st.averaging(system, small=dict(e=1), resonance=(1, 2)).rhs[1].has(F)


INTERNAL = {
    "1:1": (1.0, {"x": (1, 1), "y": (1, 1)}, e * x * y**2 + e * x.diff(t) * y * y.diff(t), e * y * x**2 + e * x**3),
    "1:3": (9.0, {"x": (1, 1), "y": (1, 3)}, e * x**2 * y + e * x * y**2, e * x**3 + e * x.diff(t) ** 3 + e * y**3),
    "2:1": (0.25, {"x": (1, 1), "y": (2, 1)}, e * y**2 + e * y.diff(t) ** 2, e * x * y + e * x.diff(t) * y.diff(t)),
    "3:2": (2.25, {"x": (2, 1), "y": (2, 3)}, e * x.diff(t), e * x * sp.cos(2 * w * t) + e * y**2 * x**2),
}


@pytest.mark.parametrize("name", INTERNAL)
def test_two_degrees_of_freedom_are_averaged_over_the_common_period(name):
    """Internal resonances 1:1, 1:3, 2:1, 3:2, by quadrature over the period of the slowest harmonic."""
    stiffness, ratios, first, second = INTERNAL[name]
    system = st.System.from_equations(
        {x.diff(t, 2): -x - first + F * sp.cos(w * t), y.diff(t, 2): -stiffness * y - second}, [x, y],
        parameters=dict(e=0.1, w=1.1, F=0.1),
    )  # fmt: skip
    slow = st.averaging(system, small=("e", "F"), resonance=ratios)
    z = np.array([0.7, -0.2, 0.4, 0.5])
    base = 2 * math.pi / system.period / 2  # all ratios here are multiples of a half
    n, nu = 64, [base * 2 * q / p for p, q in ratios.values()]
    times = 2 * math.pi / base * (np.arange(n) + 0.5) / n
    phases = np.outer(nu, times)
    q = z[::2, None] * np.cos(phases) + z[1::2, None] * np.sin(phases)
    rates = np.array(nu)[:, None] * (-z[::2, None] * np.sin(phases) + z[1::2, None] * np.cos(phases))
    g = system(times, np.vstack([q, rates]))[2:] + np.array(nu)[:, None] ** 2 * q
    wanted = (
        np.column_stack([-np.mean(g * np.sin(phases), axis=1), np.mean(g * np.cos(phases), axis=1)])
        / np.array(nu)[:, None]
    )
    assert slow(0.0, z) == pytest.approx(wanted.ravel(), abs=1e-13)


def test_declared_period_may_be_a_multiple_of_the_least_one():
    once = st.System.from_equations(
        {x.diff(t, 2): -x - e * x**3 + F * sp.cos(w * t)}, [x], parameters=dict(e=0.1, w=1.0, F=0.1)
    )
    twice = once.replace(period_expression=4 * sp.pi / w)
    for options in (dict(small=("e", "F")), dict(small="e", resonance=(3, 1))):
        assert st.averaging(once, **options).rhs == st.averaging(twice, **options).rhs


def test_names_of_the_workings_are_free_for_users():
    """A parameter may be called E, A0 or M0, a coordinate B0."""
    B0 = sp.Function("B0", real=True)(t)
    E, A0, M0 = sp.symbols("E A0 M0", real=True)
    named = st.System.from_equations(
        {B0.diff(t, 2): -B0 - E * B0**3 - M0 * B0.diff(t) + A0 * sp.cos(w * t)}, [B0],
        parameters=dict(E=0.1, A0=0.1, M0=0.02, w=1.0),
    )  # fmt: skip
    plain = oscillator(e * x**3 + b * x.diff(t), b=0.02, w=1.0)
    for order in (1, 2):
        mine = st.averaging(named, small=("E", "A0", "M0"), order=order)
        other = st.averaging(plain, small=("e", "F", "b"), order=order)
        assert mine(0.0, [0.6, -0.4]) == pytest.approx(other(0.0, [0.6, -0.4]), abs=1e-15)


@pytest.mark.parametrize("amplitude", [1e-4, 3e-4])
def test_physical_pendulum_is_the_dimensionless_one(amplitude):
    """y = A u, t = tau/w1: the two averaged flows in each other's units."""
    physical = st.models.autoparametric_pendulum.from_physical(amplitude=amplitude, frequency=22.0, length=0.0022)
    p = physical.parameters
    mass = p["mass1"] + p["mass2"]
    w1, w2 = math.sqrt(p["stiffness"] / mass), math.sqrt(p["g"] / p["length"])
    model = st.models.autoparametric_pendulum(
        xi1=p["damping"] / (2 * mass * w1), xi2=p["pendulum_damping"] / (2 * p["mass2"] * p["length"] ** 2 * w2),
        mass_ratio_total=p["mass2"] / mass, length_ratio=p["length"] / amplitude, Omega0=w2 / w1,
        Omega=2 * math.pi * p["frequency"] / w1,
    )  # fmt: skip
    for order in (1, 2):
        mine, other = st.averaging(physical, order=order), st.averaging(model, order=order)
        z = np.array([20.0, -7.0, 0.3, 0.1])
        units = np.array([amplitude, amplitude, 1.0, 1.0])
        assert mine(0.0, units * z) / (units * w1) == pytest.approx(other(0.0, z), rel=1e-11, abs=1e-13)


def test_same_slow_flow_in_every_process():
    """The digest does not depend on the hash seed."""
    code = "import stability as st; print(st.averaging(st.models.autoparametric_quadratic(), order=2).digest)"
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "77")
    }
    assert len(found) == 1


def test_ratios_by_coordinate_name():
    model = st.models.autoparametric_quadratic()
    named = st.averaging(model, resonance={"x": (1, 1), "y": (2, 1)})
    assert named.rhs == st.averaging(model, resonance=(2, 1)).rhs == st.averaging(model).rhs


def test_physical_units_and_orders_by_hand():
    model = st.models.duffing.from_physical()
    slow = st.averaging(model, small=("damping", "cubic", "acceleration"))
    nu = 2 * math.pi * model.parameters["frequency"]
    state = np.array([1e-3, 2e-3])
    assert slow(0.0, state) == pytest.approx(by_quadrature(model, state), rel=1e-9)
    assert nu > 0 and slow.units["stiffness"] == "N/m"


def test_pendulum_by_taylor_expansion():
    """sin(theta) with theta = O(eps): the averaged cubic is -1/16 a^2 in the frequency; swings by elliptic functions."""
    th = sp.Function("theta")(t)
    system = st.System.from_equations({th.diff(t, 2): -sp.sin(th)}, [th], parameters={"g": 1.0}, angles=("theta",))
    law = st.frequency_law(system, small=dict(theta=1))
    a = sp.Symbol("a", positive=True)
    assert sp.expand(law.subs(a, sp.Symbol("a", positive=True)) - (1 - a**2 / 16 + 1 * law.coeff(a, 4) * a**4)) == 0
    errors = []
    for A in (0.8, 0.4, 0.2):
        motion = st.pendulum_motion(amplitude=A)
        errors.append(abs(float(law.subs(a, motion.harmonic())) - motion.frequency))
    assert observed_orders(errors, (0.8, 0.4, 0.2))[-1] > 5.7  # the next term is a^6


@pytest.mark.parametrize(
    "name",
    [
        "base_driven_pendulum",
        "variable_length_pendulum",
        "modulated_string",
        "linear_oscillator",
        "mathieu",
        "rayleigh",
    ],
)
def test_catalogue_models_average_by_their_own_orders(name):
    slow = st.averaging(getattr(st.models, name)())
    assert slow.reconstruction and slow.period is None


# ------------------------------------------------------------------ refusals
REFUSED = {
    "exp": (e * sp.exp(x), r"e\*exp\(x\)"),
    "fraction": (e / (1 + x), r"e/\(x \+ 1\)"),
    "sine": (e * sp.sin(x), r"e\*sin\(x\)"),
    "max": (e * sp.Max(x, 0), r"Max\(0, x\)"),
    "min": (e * sp.Min(x, 0), r"Min\(0, x\)"),
    "root": (e * sp.sqrt(1 + x**2), r"sqrt\(x\*\*2 \+ 1\)"),
    "modulus with forcing": (e * sp.Abs(x) * sp.cos(w * t), r"Abs\(x\)"),
    "square wave": (F * sp.sign(sp.cos(w * t)), r"sign"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_terms_that_cannot_be_averaged_are_named(name):
    rest, pattern = REFUSED[name]
    system = st.System.from_equations(
        {x.diff(t, 2): -x - rest}, [x], parameters=dict(e=0.1, w=1.0, F=0.1), period=2 * sp.pi / w
    )
    with pytest.raises(EquationError, match=pattern) as caught:
        st.averaging(system, small=("e", "F"))
    assert "HarmonicBalance" in str(caught.value)


@pytest.mark.parametrize("name", ["sine", "exp", "fraction"])
def test_smooth_functions_of_small_states_are_expanded(name):
    """The same terms with x of order 1: the average over the fast phase, to the first power of x that is left out."""
    term = {"sine": sp.sin(x), "exp": sp.exp(x) - 1, "fraction": x / (1 + x)}[name]
    system = oscillator(e * term, e=0.3, F=0.0)
    slow = st.averaging(system, small=dict(e=1, x=1, F=2))
    errors = []
    for size in (0.1, 0.05):
        state = np.array([0.8, -0.6]) * size
        errors.append(np.abs(slow(0.0, state) - by_quadrature(system, state)).max())
    assert 0 < errors[0] < 0.3 * 0.1**3 and np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("rest", [e * sp.Min(x, 0), e * sp.Max(x, 0)])
def test_kinks_are_refused_even_where_states_are_small(rest):
    with pytest.raises(EquationError, match=r"M(in|ax).*HarmonicBalance"):
        st.averaging(oscillator(rest), small=dict(e=1, x=1, F=2))


def test_table_is_refused():
    table = st.Table("measured", [-1.0, 1.0], [[-1.0, 3.0, -3.0, 1.0]])
    system = st.System.from_equations({x.diff(t, 2): -x - e * table(x)}, [x], parameters=dict(e=0.1))
    with pytest.raises(EquationError, match="measured"):
        st.averaging(system, small="e")


CASES = {
    "no orders": (lambda: st.averaging(oscillator(e * x**3)), InputError, r"no scaling orders.*small="),
    "nothing small": (lambda: st.averaging(oscillator(e * x**3), small=()), InputError, "one scaling order at least"),
    "unknown name": (lambda: st.averaging(oscillator(e * x**3), small="ee"), UnknownNameError, "no parameter or state 'ee'"),
    "broken order": (lambda: st.averaging(oscillator(e * x**3), small=dict(e=1.5)), InputError, "integers"),
    "strong forcing": (lambda: st.averaging(oscillator(e * x**3), small="e"), EquationError, r"is of order 0: in resonance.*x=-1"),
    "strong nonlinearity": (lambda: st.averaging(oscillator(x**3), small="F"), EquationError, r"x\*\*3.*of order 0"),
    "no such resonance": (
        lambda: st.averaging(oscillator(e * x**3), small=("e", "F"), resonance=(2, 1)), InputError, r"no resonance 2:1.*1:1"),
    "no pair": (lambda: st.averaging(oscillator(e * x**3), small=("e", "F"), resonance=3), InputError, "pair"),
    "zero": (lambda: st.averaging(oscillator(e * x**3), small=("e", "F"), resonance=(1, 0)), InputError, "pair"),
    "order": (lambda: st.averaging(oscillator(e * x**3), small=("e", "F"), order=3), InputError, "order = 3"),
    "variables": (lambda: st.averaging(oscillator(e * x**3), small=("e", "F"), variables="complex"), InputError, "polar"),
    "rough second order": (
        lambda: st.averaging(oscillator(e * sp.sign(x.diff(t))), small=("e", "F"), order=2), EquationError, "order 1 only"),
    "first-order states": (lambda: st.averaging(st.models.lorenz(), small="sigma"), EquationError, "first order"),
    "python function": (
        lambda: st.averaging(st.System.from_function(lambda t, q: (q[1], -q[0]), "x v")), EquationError, "Python function"),
    "negative stiffness": (lambda: st.averaging(st.models.duffing_textbook(alpha=-1.0)), EquationError, "linear stiffness"),
    "coupled at order 0": (lambda: st.multiple_scales(st.models.chain()), EquationError, r"modal.*`multiple_scales` does not"),
    "excitation of a free system": (lambda: st.averaging(st.models.van_der_pol(), resonance=(2, 1)), InputError, "autonomous"),
    "name of a ratio": (
        lambda: st.averaging(st.models.autoparametric_quadratic(), resonance={"x": (1, 1)}), InputError, "no ratio for y"),
    "not a slow flow": (lambda: st.reconstruct(st.models.duffing(), [1, 0], 0.0), InputError, "no slow flow"),
    "another system": (
        lambda: st.reconstruction_residual(st.models.duffing(), st.averaging(st.models.duffing_textbook()), [0.1, 0.0]),
        InputError, "no slow flow of 'duffing'"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_refusals_say_what_to_do(name):
    call, error, pattern = CASES[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(error, match=pattern):
            call()


def test_hard_stops_are_refused():
    with pytest.raises(EquationError, match="hard stops"):
        st.averaging(st.models.hard_stop_oscillator(), small="xi")


# ------------------------------------------------------------------ the parts
def test_series_knows_what_it_does_not_know():
    """1/(1 - eps) - 1/(1 - eps): leading terms cancel; sin(x)/x through eps^4; a function of order zero is refused."""
    from fractions import Fraction

    orders, moving = {xs: 1, e: 1}, frozenset({xs})
    assert graded(1 / (1 - e) - (1 + e), orders, moving, Fraction(3)) == {Fraction(2): e**2, Fraction(3): e**3}
    found = graded(sp.sin(xs) / (1 + xs**2), orders, moving, Fraction(5))
    series = sp.series(sp.sin(xs) / (1 + xs**2), xs, 0, 6).removeO()
    assert sp.expand(sum(found.values()) - series) == 0
    with pytest.raises(EquationError):
        graded(sp.exp(xs / e), orders | {e: 2}, moving, Fraction(1))


def test_monomials_collect_like_terms():
    found = monomials(sp.expand((xs + vs) ** 2 - xs**2 + e * xs * vs), [xs, vs])
    assert {(m.powers, m.coefficient) for m in found} == {((1, 1), 2 + e), ((0, 2), 1)}
