"""Averaging of coupled oscillators in modal coordinates. Witness: one-term harmonic balance (equilibria of the first order
are its solutions exactly), the linear transfer function, harmonic balance with many harmonics for the orders of the error."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from exact_orbits import observed_orders

import stability as st
from stability.errors import EquationError, InputError, UnknownNameError

t = sp.Symbol("t")
x, y, z = (sp.Function(name, real=True)(t) for name in "xyz")
e, c, w = sp.symbols("e c w", real=True)


def three(**values):
    """Three masses in a line, cubic springs to the ground, force e cos(w t) on the first."""
    q = (x, y, z)
    linear = (2 * x - y, 2 * y - x - z, 2 * z - y)
    rows = {s.diff(t, 2): -k - c * e * s.diff(t) - e * s**3 for s, k in zip(q, linear)}
    rows[x.diff(t, 2)] += 1.2 * e * sp.cos(w * t)
    return st.System.from_equations(rows, q, parameters=dict(e=0.1, c=0.3, w=0.6) | values, orders=dict(e=1))


def chain(eps, **values):
    """xi = 0.1 eps, beta u^2 = O(eps) at resonance, where u = O(1/eps)."""
    scaled = dict(xi1=0.1 * eps, xi2=0.1 * eps, beta1=0.03 * eps**3, beta2=0.02 * eps**3)
    return st.models.chain(**scaled, mass_ratio_21=0.4, Omega0=1.1, **values)


def test_linear_chain_is_its_transfer_function():
    """Without cubic springs the equilibria are the exact linear response at any frequency, both peaks and between."""
    system = st.models.chain(xi1=0.02, xi2=0.03, mass_ratio_21=0.4, Omega0=1.2)
    slow = st.averaging(system)
    assert slow.states == ("mode1_cos", "mode1_sin", "mode2_cos", "mode2_sin")
    assert set(system.parameters) - set(slow.parameters) == {"mass_ratio_21", "Omega0"} and "mass_ratio_21" in slow.description
    exact = st.linear_response(system)
    for value in (0.4, 0.8, 1.1, 1.7, 2.0):
        point = st.solve(st.Equilibrium(slow.with_params(Omega=value)))
        motion = st.reconstruct(slow, point, 2 * np.pi / value * np.arange(64) / 64)
        found = 2 * np.abs(np.fft.rfft(motion, axis=1)[:2, 1]) / 64
        wanted = [abs(complex(exact.frequency_response(value, k))) for k in ("u", "v")]
        assert found == pytest.approx(wanted, rel=1e-10)


def test_first_order_is_one_term_harmonic_balance():
    """Folds and amplitudes of the slow flow of three coupled masses, beside harmonic balance with one harmonic."""
    system = three()
    flow = st.continuation(st.Equilibrium(st.averaging(system)), "w", (0.6, 1.6))
    balance = st.continuation(st.HarmonicBalance(system, harmonics=1, accuracy=0.9), "w", (0.6, 1.6))
    folds = [[p.params["w"] for p in b.of_kind(st.Kind.FOLD)] for b in (flow, balance)]
    assert len(folds[0]) == 4 and folds[0] == pytest.approx(folds[1], abs=1e-8)
    for value in (0.7, 0.7955, 0.95, 1.5):
        ours = sorted(row["x_amplitude"] for row in flow.rows_at(w=value))
        assert ours == pytest.approx(sorted(row["x.amplitude(1)"] for row in balance.rows_at(w=value)), rel=1e-8)


def test_polar_and_cartesian_are_the_same_flow():
    """u_cos + i u_sin = a e^{-i psi}: rates of the two at one state; outputs and motion too."""
    system = three()
    one, two = st.averaging(system), st.averaging(system, variables="polar")
    random = np.random.default_rng(3)
    a, psi = random.uniform(0.2, 1.0, 3), random.uniform(-3, 3, 3)
    cartesian = np.array([a * np.cos(psi), -a * np.sin(psi)]).T.ravel()
    polar = np.array([a, psi]).T.ravel()
    rate = two(0.0, polar).reshape(3, 2)
    turned = (rate[:, 0] + 1j * a * rate[:, 1]) * np.exp(1j * psi)
    assert one(0.0, cartesian).reshape(3, 2) == pytest.approx(np.array([turned.real, -turned.imag]).T, abs=1e-13)
    assert st.reconstruct(one, cartesian, 1.3) == pytest.approx(st.reconstruct(two, polar, 1.3), abs=1e-13)
    sizes = [
        float(flow.outputs["y_amplitude"].subs({sp.Symbol(s, real=True): v for s, v in zip(flow.states, state)}))
        for flow, state in ((one, cartesian), (two, polar))
    ]
    assert sizes[0] == pytest.approx(sizes[1], abs=1e-13)


@pytest.mark.parametrize("mode", [0, 1])
def test_orders_of_the_error_of_the_cubic_chain(mode):
    """Near each resonance: fundamental amplitudes and the whole reconstructed motion against harmonic balance with nine
    harmonics; relative errors of order 1 and 2."""
    small = (0.1, 0.05)
    errors = {1: [], 2: []}
    for eps in small:
        # resonance of the linear system, detuned by 0.2 eps
        lam, W0 = 0.4, 1.1
        natural = np.sqrt(np.linalg.eigvalsh([[1 + lam * W0**2, -np.sqrt(lam) * W0**2], [-np.sqrt(lam) * W0**2, W0**2]]))
        system = chain(eps, Omega=float(natural[mode] * (1 + 0.2 * eps)))
        problem = st.HarmonicBalance(system, harmonics=9)
        for order, found in errors.items():
            slow = st.averaging(system, order=order)
            point = st.solve(st.Equilibrium(slow))
            times = system.period * np.arange(64) / 64
            mine = st.reconstruct(slow, point, times)
            p = system.parameter_vector()
            orbit = problem.view(problem.correct(problem.discretise(times, mine, system.period), p, "Omega", None, 0.0, 1e-10).u, p)
            truth = orbit(times)
            found.append(np.abs(mine[:2] - truth[:2]).max() / np.abs(truth[:2]).max())
    assert observed_orders(errors[1], small)[-1] == pytest.approx(1.0, abs=0.2)
    assert observed_orders(errors[2], small)[-1] > 1.8
    assert errors[2][-1] < 0.1 * errors[1][-1]


def test_second_order_of_the_chain_has_better_folds():
    system = st.models.chain(xi1=0.02, xi2=0.02, beta1=0.001, beta2=0.0005)
    truth = st.continuation(st.HarmonicBalance(system, harmonics=9), "Omega", (0.7, 0.9))
    wanted = sorted(p.params["Omega"] for p in truth.of_kind(st.Kind.FOLD))
    worst = []
    for order in (1, 2):
        slow = st.averaging(system, order=order)
        branch = st.continuation(st.Equilibrium(slow), "Omega", (0.7, 0.9))
        found = sorted(p.params["Omega"] for p in branch.of_kind(st.Kind.FOLD))
        worst.append(np.abs(np.array(found) - wanted).max())
    assert len(wanted) == 2 and worst[1] < 0.7 * worst[0] < 2e-3


def test_ratios_by_mode():
    """A mapping by the modes' names; all at 1:1 is what None takes; one by coordinates is refused by name."""
    system = st.models.chain(beta1=0.001)
    given = st.averaging(system, resonance=dict(mode1=(1, 1), mode2=(1, 1)))
    assert given.rhs == st.averaging(system).rhs == st.averaging(system, resonance=(1, 1)).rhs
    with pytest.raises(UnknownNameError, match="mode1"):
        st.averaging(system, resonance=dict(u=(1, 1), v=(1, 1)))
    with pytest.raises(InputError, match=r"no effect.*mode1, mode2"):
        st.averaging(system, resonance=(5, 1))
    apart = st.averaging(system, resonance=dict(mode1=(1, 1), mode2=(1, 3)))
    assert "u_amplitude" not in apart.outputs and "mode2_amplitude" in apart.outputs


def test_verdicts_agree_with_harmonic_balance():
    system = st.models.chain(xi1=0.02, xi2=0.02, beta1=0.001, beta2=0.0005)
    slow = st.continuation(st.Equilibrium(st.averaging(system)), "Omega", (0.5, 2.2))
    full = st.continuation(st.HarmonicBalance(system, harmonics=9), "Omega", (0.5, 2.2))
    difference = st.compare(full, slow, points=18)["averaging"]
    assert not difference.missing and not difference.extra and difference.worst < 0.03


def test_own_names_and_parameters_in_the_coupling():
    """A coordinate called mode1 keeps its name; parameters of the linear part are numbers of the slow flow."""
    m, n, k = sp.Function("mode1", real=True)(t), sp.Function("n", real=True)(t), sp.Symbol("k", real=True)
    system = st.System.from_equations(
        {m.diff(t, 2): -m - k * (m - n) - e * m**3 + e * sp.cos(w * t), n.diff(t, 2): -2 * n - k * (n - m) - e * n.diff(t)},
        [m, n], parameters=dict(k=0.5, e=0.05, w=1.1), orders=dict(e=1),
    )  # fmt: skip
    slow = st.averaging(system)
    assert set(slow.parameters) == {"e", "w"} and slow.states[0] == "mode_1_cos" and "mode1" in slow.reconstruction
    assert st.averaging(system.with_params(k=0.6)).rhs != slow.rhs


def test_refusals():
    q = {x.diff(t, 2): -x - 2 * y - e * x**3, y.diff(t, 2): -y - 2 * x + e * sp.cos(w * t)}
    unstable = st.System.from_equations(q, [x, y], parameters=dict(e=0.1, w=1.0), orders=dict(e=1))
    with pytest.raises(EquationError, match=r"eigenvalues -1, 3.*positive"):
        st.averaging(unstable)
    one_way = {x.diff(t, 2): -x - y - e * x**3, y.diff(t, 2): -y + e * sp.cos(w * t)}
    with pytest.raises(EquationError, match="differ"):
        st.averaging(st.System.from_equations(one_way, [x, y], parameters=dict(e=0.1, w=1.0), orders=dict(e=1)))


@pytest.mark.parametrize("term", [sp.Abs(x) * x, sp.sign(x.diff(t)), sp.Max(x, 0), sp.exp(x)])
def test_terms_that_mix_modes_and_are_no_polynomials_are_refused_by_name(term):
    rows = {x.diff(t, 2): -2 * x + y - e * term, y.diff(t, 2): -2 * y + x + e * sp.cos(w * t)}
    system = st.System.from_equations(rows, [x, y], parameters=dict(e=0.1, w=1.0), orders=dict(e=1))
    with pytest.raises(EquationError, match=r"(Abs|sign|Max|exp)\(.*HarmonicBalance"):
        st.averaging(system)
