"""Errata of the chapter, equations (7)-(39): each test shows the printed form failing and the library's one holding.

Severity A (changes physics or numbers) and B; the other halves are `test_errata_pendulum` (42)-(67) and
`test_errata_minor`. Witness: derivation from energies (`by_hand`), direct complex solves, closed forms.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from by_hand import base, coordinate, lagrange, obeys, real, t, vanishes

import stability as st

M = st.models
s = sp.Symbol("s")
m, d, k, g, A, w = real("m d k g A w")
y = coordinate("y")
v, acc = y.diff(t), y.diff(t, 2)


def residual(lagrangian, q, **rest):
    """Left minus right side of the library's equation of motion."""
    (equation,) = st.equations_of_motion(lagrangian, [q], **rest)
    return sp.expand(equation.lhs - equation.rhs)


# ---------------------------------------------------------------------------------------------- (7)-(10), table 2
def test_7_lagrangian_is_kinetic_minus_potential():
    printed = m * v**2 / 2 + k * y**2 / 2 - m * g * y
    ours = m * v**2 / 2 - k * y**2 / 2 - m * g * y
    R = d * v**2 / 2
    assert sp.expand(residual(printed, y, dissipation=R) - (m * acc + d * v - k * y + m * g)) == 0
    assert sp.expand(residual(ours, y, dissipation=R) - (m * acc + d * v + k * y + m * g)) == 0
    poles = {}
    for name, L in (("printed", printed), ("ours", ours)):
        system = st.System.from_lagrangian(
            L.subs(g, 0), coordinates=[y], dissipation=R, parameters=dict(m=1.0, k=4.0, d=0.1)
        )
        poles[name] = st.linear_response(system).poles.real.max()
    assert poles["printed"] > 1.9 and poles["ours"] == pytest.approx(-0.05, rel=1e-12)


def test_8_and_table_2_source_and_capacitor():
    L, R, C, U0 = real("L R C U0")
    q = coordinate("q")
    i = q.diff(t)
    printed = L * i**2 / 2 + q**2 / (2 * C) - U0 * q
    ours = L * i**2 / 2 - (q**2 / (2 * C) - U0 * q)  # U_B = -U0 q
    table_2 = L * i**2 / 2 - (q**2 / (2 * C) + U0 * q)  # U_B = +U0 q: the source drives backwards
    target = L * i.diff(t) + R * i + q / C - U0  # (10)
    assert sp.expand(residual(ours, q, dissipation=R * i**2 / 2) - target) == 0
    assert sp.expand(residual(printed, q, dissipation=R * i**2 / 2) - target) == -2 * q / C + 2 * U0
    assert sp.expand(residual(table_2, q, dissipation=R * i**2 / 2) - target) == 2 * U0


def test_8_the_analogue_of_the_oscillator_is_10():
    system = M.analogue(M.linear_oscillator.from_physical(amplitude=1e-4))
    q, qd, L, R, C = real("q q_dot inductance resistance capacitance")
    free = system.rhs[1].subs(real("amplitude"), 0)
    assert sp.simplify(free - (-R * qd - q / C) / L) == 0
    values = M.mechanical_to_electrical(mass=0.02, damping=0.1056, stiffness=315.827, force=0.3)
    w_el = 1 / np.sqrt(values["inductance"] * values["capacitance"])
    xi_el = values["resistance"] / 2 * np.sqrt(values["capacitance"] / values["inductance"])
    assert w_el == pytest.approx(np.sqrt(315.827 / 0.02), rel=1e-14)
    assert xi_el == pytest.approx(0.1056 / (2 * np.sqrt(315.827 * 0.02)), rel=1e-14)
    assert values["voltage"] == 0.3


def test_9_gravity_pulls_down():
    """m y'' + d y' + k y = -m g with y up; +m g would lift the mass."""
    assert vanishes(residual(m * v**2 / 2 - k * y**2 / 2 - m * g * y, y).subs({acc: 0, y: -m * g / k}))
    assert not vanishes(residual(m * v**2 / 2 - k * y**2 / 2 - m * g * y, y).subs({acc: 0, y: m * g / k}))
    system = M.linear_oscillator.from_physical(gravity=True)
    rest = st.linear_response(system).equilibrium["y"]
    assert rest == pytest.approx(-0.02 * 9.81 / 315.827, rel=1e-13)


# ------------------------------------------------------------------------------------------------------- (24), (25)
def test_24_transfer_function_has_a_minus_sign():
    xi = real("xi")
    ours = st.linear_response(M.linear_oscillator()).transfer("u")
    printed = s**2 / (1 + 2 * xi * s + s**2)
    assert sp.simplify(ours + printed) == 0
    Om = sp.Symbol("Omega", positive=True)
    u = coordinate("u")
    Y = u + sp.cos(Om * t)  # steady motion Re(G exp(j Om t)) put into the equation derived from energies
    (equation,) = lagrange(Y.diff(t) ** 2 / 2, u**2 / 2, [u], R=xi * u.diff(t) ** 2).values()
    for G, holds in ((ours, True), (printed, False)):
        z = G.subs(s, sp.I * Om).as_real_imag()
        steady = sp.simplify(z[0]) * sp.cos(Om * t) - sp.simplify(z[1]) * sp.sin(Om * t)
        assert vanishes(equation.subs(u, steady).doit()) is holds


def test_24_phase_of_the_bode_diagram():
    """Slow base motion: the relative displacement follows -y0'' and is in phase with y0; printed: 180 degrees off."""
    slow = st.linear_response(M.linear_oscillator(xi=0.05)).frequency_response(0.05, "u")
    assert abs(np.angle(slow)) < 0.01
    printed = (0.05j) ** 2 / (1 + 2 * 0.05 * 0.05j + (0.05j) ** 2)
    assert abs(abs(np.angle(printed)) - np.pi) < 0.01


def test_25_denominator_has_a_resonance():
    def printed(Om, xi):
        return abs(Om**2 / (1 + Om**2 + 2j * xi * Om))

    assert printed(1.0, 0.05) == pytest.approx(0.499, abs=5e-4)
    ours = abs(st.linear_response(M.linear_oscillator(xi=0.05)).frequency_response(1.0, "u"))
    assert ours == pytest.approx(10.0, rel=1e-13)
    assert printed(np.linspace(0.01, 50, 5000), 0.05).max() < 1.0  # nothing to resonate
    ((where, height),) = st.linear_response(M.linear_oscillator(xi=0.05)).peaks("u")
    assert where == pytest.approx(1 / np.sqrt(1 - 2 * 0.05**2), rel=1e-12)
    assert height == pytest.approx(1 / (2 * 0.05 * np.sqrt(1 - 0.05**2)), rel=1e-12)


# ------------------------------------------------------------------------------------------------------- (28)-(33)
def chain_equations():
    """Inertial-frame derivation of the physical chain, and the printed (30), (31), as left minus right side."""
    m1, m2, k1, k2, d1, d2 = real("mass1 mass2 stiffness1 stiffness2 damping1 damping2")
    y1, y2, (y0, W) = coordinate("y1"), coordinate("y2"), base()
    v1, v2 = y1.diff(t), y2.diff(t)
    T = m1 * (v1 + y0.diff(t)) ** 2 / 2 + m2 * (v2 + y0.diff(t)) ** 2 / 2
    U = k1 * y1**2 / 2 + k2 * (y2 - y1) ** 2 / 2 + g * (m1 * y1 + m2 * y2)
    ours = lagrange(T, U, [y1, y2], R=d1 * v1**2 / 2 + d2 * (v2 - v1) ** 2 / 2)
    load = real("amplitude") * W**2 * sp.cos(W * t)
    printed = {
        y1: m1 * v1.diff(t) + d1 * v1 + k1 * y1 - k2 * (y2 - y1) + m1 * g - (m1 + m2) * load,
        y2: m2 * v2.diff(t) + d2 * v2 + k2 * (y2 - y1) + m2 * g,
    }
    return ours, printed, (y1, y2), (m1, m2, d2, load)


def test_28_30_31_dampers_and_loads():
    ours, printed, (y1, y2), (_, m2, d2, load) = chain_equations()
    relative = d2 * (y2 - y1).diff(t)
    first = sp.expand((printed[y1] - ours[y1]).doit() - relative + m2 * load)
    second = sp.expand((printed[y2] - ours[y2]).doit() - d2 * y1.diff(t) - m2 * load)
    assert sp.simplify(first) == 0 and sp.simplify(second) == 0
    system = M.chain.from_physical(amplitude=1e-4, gravity=True)
    assert obeys(system.replace(rhs=[e.subs({real("cubic1"): 0, real("cubic2"): 0}) for e in system.rhs]), ours)
    assert not obeys(system, printed)


def test_28_printed_dampers_are_both_at_the_base():
    """The option damper2="base" keeps the printed dampers (with the right loads); only then a common motion meets d2."""
    u_dot, v_dot, xi1, xi2, lam, W0 = real("u_dot v_dot xi1 xi2 mass_ratio_21 Omega0")
    common = {real("u"): 0, real("v"): 0, v_dot: u_dot}
    for damper2, force in (("relative", 0), ("base", 2 * xi2 * W0 * u_dot)):
        rhs = M.chain(damper2=damper2).rhs
        friction = [sp.diff(e.subs(common), u_dot) * u_dot for e in rhs[2:]]
        assert sp.simplify(friction[1] + force) == 0
        assert sp.simplify(friction[0] + 2 * xi1 * u_dot) == 0
    assert lam not in M.chain(damper2="base").rhs[2].coeff(u_dot).free_symbols


def printed_chain(Om, lam, W0, xi=0.021):
    """(32), (33) as printed: base dampers, load on the first equation only."""
    K = np.array([[1 + lam * W0**2, -lam * W0**2], [-(W0**2), W0**2]])
    C = np.diag([2 * xi, 2 * xi * W0])
    Z = K - Om[:, None, None] ** 2 * np.eye(2) + 1j * Om[:, None, None] * C
    load = np.stack([Om**2, 0 * Om], axis=-1)
    return np.abs(np.linalg.solve(Z, load[..., None])[..., 0])


def maxima(Om, a):
    inner = np.flatnonzero((a[1:-1] > a[:-2]) & (a[1:-1] > a[2:])) + 1
    return [(Om[i], a[i]) for i in inner]


def test_29_33_the_large_and_the_small_peak_swap():
    Om = np.linspace(0.4, 2.0, 160001)
    printed = maxima(Om, printed_chain(Om, 0.42, 1.0)[:, 0])
    ours = st.linear_response(M.chain(mass_ratio_21=0.42)).peaks("u")
    assert [h for _, h in printed] == pytest.approx([6.0, 21.5], abs=0.05)
    assert [h for _, h in ours] == pytest.approx([21.4, 6.2], abs=0.05)


def test_32_load_does_not_follow_from_printed_30():
    """Dividing printed (30) by m1 A w1^2 gives (1 + lam) Omega^2 cos, while (32) has Omega^2 cos, the right load."""
    m1, m2, w1 = real("m1 m2 w1")
    Om = real("Omega")
    printed_30 = (m1 + m2) * A * (Om * w1) ** 2 / (m1 * A * w1**2)
    right = m1 * A * (Om * w1) ** 2 / (m1 * A * w1**2)
    assert sp.simplify(printed_30 - (1 + m2 / m1) * Om**2) == 0 and sp.simplify(right - Om**2) == 0
    assert M.chain().rhs[2].coeff(sp.cos(Om * t)) == Om**2


def test_33_has_a_load_of_its_own():
    Om = real("Omega")
    assert M.chain().rhs[3].coeff(sp.cos(Om * t)) == Om**2  # printed: 0
    stiff = st.linear_response(M.chain(Omega0=1e4, xi1=0.0, xi2=0.0)).frequency_response(0.5, "u")
    together = (1 + 0.5) * 0.5**2 / (1 - (1 + 0.5) * 0.5**2)  # both masses as one, m1 (1 + lam)
    assert stiff == pytest.approx(together, rel=1e-6)
    printed = printed_chain(np.array([0.5]), 0.5, 1e4, xi=0.0)[0, 0]
    assert printed == pytest.approx(0.5**2 / (1 - (1 + 0.5) * 0.5**2), rel=1e-6)  # only m1 is driven


# ------------------------------------------------------------------------------------------------- (36)-(39), fig. 6
def test_36_to_39_algebra_is_right_and_inherits_the_faults():
    x1, x2, lam, W0, rho, Y0 = real("xi1 xi2 mass_ratio_21 Omega0 rho Y0")
    U, V = sp.symbols("U V")
    eq36 = U * s**2 + 2 * x1 * U * s + U * (1 + lam * W0**2) - lam * W0**2 * V + rho - s**2 * Y0
    eq37 = V * s**2 + 2 * x2 * W0 * V * s + V * W0**2 - U * W0**2 + rho
    solved = sp.solve([eq36, eq37], [U, V], dict=True)[0]
    q = s**2 + 2 * s * x2 * W0 + W0**2
    eq38 = -(-rho * lam * W0**2 + q * (-rho + s**2 * Y0)) / (lam * W0**4 - q * (1 + s**2 + 2 * s * x1 + lam * W0**2))
    D = s**4 + W0**2 + 2 * s**3 * (x1 + x2 * W0) + 2 * s * W0 * (x2 + x1 * W0 + lam * x2 * W0**2)
    D += s**2 * (1 + W0 * (4 * x1 * x2 + W0 + lam * W0))
    eq39 = (-rho * (1 + s**2 + 2 * s * x1 + (1 + lam) * W0**2) + s**2 * W0**2 * Y0) / D
    assert vanishes(solved[U] - eq38) and vanishes(solved[V] - eq39)
    response = st.linear_response(M.chain())
    assert not vanishes((response.transfer("u") - eq38).subs({rho: 0, Y0: 1}))
    assert not vanishes((response.transfer("v") - eq39).subs({rho: 0, Y0: 1}))


def test_36_37_base_acceleration_is_minus_s_squared_on_both():
    """Transform of the library's equations by hand: right sides -s^2 Y0 in both lines."""
    x1, x2, lam, W0 = real("xi1 xi2 mass_ratio_21 Omega0")
    response = st.linear_response(M.chain())
    U, V = response.transfer("u"), response.transfer("v")
    coupling = 2 * x2 * W0 * s + W0**2
    assert sp.simplify(U * (s**2 + 2 * x1 * s + 1) + lam * coupling * (U - V) + s**2) == 0
    assert sp.simplify(V * s**2 + coupling * (V - U) + s**2) == 0


def test_38_39_gravity_adds_no_damping():
    """Static offsets u_s = -(1 + lam) varrho, v_s = -(1 + lam + 1/Omega0^2) varrho; poles and responses unchanged."""
    plain, heavy = st.linear_response(M.chain(Omega0=1.5)), st.linear_response(M.chain(Omega0=1.5, gravity=0.3))
    assert heavy.equilibrium["u"] == pytest.approx(-1.5 * 0.3, rel=1e-13)
    assert heavy.equilibrium["v"] == pytest.approx(-(1.5 + 1 / 1.5**2) * 0.3, rel=1e-13)
    assert heavy.poles == pytest.approx(plain.poles, rel=1e-13)
    Om = np.linspace(0.1, 4.0, 40)
    assert heavy.frequency_response(Om, "u") == pytest.approx(plain.frequency_response(Om, "u"), rel=1e-13)


@pytest.mark.parametrize(("lam", "fits"), [(0.42, False), (0.50, True)])
def test_fig_6_mass_ratio(lam, fits):
    """The text's peaks 0.71, 1.41 and 0.82, 6.1 need lam = 0.50: product of the frequencies Omega0, sum of squares."""
    stated = {1.0: (0.71, 1.41), 5.0: (0.82, 6.1)}
    near = []
    for W0, text in stated.items():
        own = st.linear_response(M.chain(mass_ratio_21=lam, Omega0=W0, xi1=0.0, xi2=0.0)).natural_frequencies
        assert own.prod() == pytest.approx(W0, rel=1e-12)
        assert (own**2).sum() == pytest.approx(1 + W0**2 * (1 + lam), rel=1e-12)
        near.append(np.abs(own / text - 1).max() < 0.01)
    assert all(near) is fits and any(near) is fits


def test_fig_6_base_dampers_give_all_four_stated_values():
    W0 = {w: st.linear_response(M.chain(Omega0=w, damper2="base")) for w in (1.0, 5.0)}
    assert [round(x, 2) for x, _ in W0[1.0].peaks("u")] == [0.71, 1.42]
    assert [round(x, 2) for x, _ in W0[1.0].peaks("v")] == [0.71, 1.41]
    (low, _), (high, _) = W0[5.0].peaks("v")
    assert (round(low, 3), round(high, 2)) == (0.816, 6.05)
    assert round(W0[5.0].peaks("u")[1][0], 2) == 6.17
    hertz = 169 / (2 * np.pi)
    assert [round(x * hertz) for x, _ in W0[1.0].peaks("v")] == [19, 38]
