"""Every model of the catalogue against its own derivation from energies in the inertial frame (catalogue 3 to 11).

Witness: `by_hand.lagrange`, which shares no line with the library; absolute positions Y = y + y0 stand in T and U, so
that the load of the moving base is a result and not an assumption. Dimensionless models are the same derivation in units
in which mass, length and natural frequency are one.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import sympy as sp
from by_hand import base, coordinate, lagrange, obeys, real, regular, t, vanishes

import stability as st

M = st.models
m, k, d, k3, g = real("mass stiffness damping cubic g")
BY = {"amplitude": dict(amplitude=1e-4), "acceleration": dict(acceleration=4.905)}


def one_mass(U, by="amplitude", gravity=False, damper=d):
    """m on the base with the spring energy U(y), y relative: (energies, equations)."""
    y = coordinate("y")
    y0, _ = base(by)
    Y = y + y0
    T = m * Y.diff(t) ** 2 / 2
    return lagrange(T, U(y) + (m * g * Y if gravity else 0), [y], R=damper * y.diff(t) ** 2 / 2)


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("gravity", [False, True])
def test_linear_oscillator_16(by, gravity):
    system = M.linear_oscillator.from_physical(gravity=gravity, **BY[by])
    assert obeys(system, one_mass(lambda y: k * y**2 / 2, by, gravity))
    assert not obeys(system, one_mass(lambda y: -k * y**2 / 2, by, gravity))  # the comparison can fail


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("gravity", [False, True])
def test_duffing_50(by, gravity):
    system = M.duffing.from_physical(gravity=gravity, **BY[by])
    assert obeys(system, one_mass(lambda y: k * y**2 / 2 + k3 * y**4 / 4, by, gravity))


def dimensionless_mass(U):
    """Unit mass on the base cos(Omega t), damper 2 xi, weight `gravity`."""
    u, Om, xi, rho = coordinate("u"), *real("Omega xi gravity")
    Y = u + sp.cos(Om * t)
    return lagrange(Y.diff(t) ** 2 / 2, U(u) + rho * Y, [u], R=xi * u.diff(t) ** 2)


def test_dimensionless_oscillators_19_53():
    beta = real("beta")
    assert obeys(M.linear_oscillator(), dimensionless_mass(lambda u: u**2 / 2))
    assert obeys(M.duffing(), dimensionless_mass(lambda u: u**2 / 2 + beta * u**4 / 4))


def chain(masses, stiffnesses, cubics, dampings, y, y0, weight, damper2):
    """Energies of the chain base - m1 - m2 in the inertial frame, and its equations."""
    (m1, m2), (y1, y2) = masses, y
    Y1, Y2 = y1 + y0, y2 + y0
    v1, v2 = y1.diff(t), y2.diff(t)
    T = m1 * Y1.diff(t) ** 2 / 2 + m2 * Y2.diff(t) ** 2 / 2
    U = sum(c * z**2 / 2 + c3 * z**4 / 4 for c, c3, z in zip(stiffnesses, cubics, (y1, y2 - y1)))
    U += weight * (m1 * Y1 + m2 * Y2)
    second = v2 - v1 if damper2 == "relative" else v2
    return T, lagrange(T, U, [y1, y2], R=dampings[0] * v1**2 / 2 + dampings[1] * second**2 / 2)


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("gravity", [False, True])
@pytest.mark.parametrize("damper2", ["relative", "base"])
def test_chain_30_31_and_cubic_A2(by, gravity, damper2):
    y = coordinate("y1"), coordinate("y2")
    numbered = [real(f"{name}1 {name}2") for name in ("mass", "stiffness", "cubic", "damping")]
    T, equations = chain(*numbered, y, base(by)[0], g if gravity else 0, damper2)
    system = M.chain.from_physical(gravity=gravity, damper2=damper2, cubic1=1e7, cubic2=1e7, **BY[by])
    assert obeys(system, equations) and regular(T, y)
    other = {"relative": "base", "base": "relative"}[damper2]
    assert not obeys(M.chain.from_physical(gravity=gravity, damper2=other, cubic1=1e7, cubic2=1e7, **BY[by]), equations)


@pytest.mark.parametrize("damper2", ["relative", "base"])
def test_dimensionless_chain_32_33(damper2):
    x1, x2, lam, W0, b1, b2, Om, rho = real("xi1 xi2 mass_ratio_21 Omega0 beta1 beta2 Omega gravity")
    u, v = coordinate("u"), coordinate("v")
    _, equations = chain(
        (1, lam), (1, lam * W0**2), (b1, lam * b2), (2 * x1, 2 * lam * x2 * W0), (u, v), sp.cos(Om * t), rho, damper2
    )
    assert obeys(M.chain(damper2=damper2), equations)


def pendulum_on_a_mass(m1, m2, k, d, length, D, g, y0, y, phi, static):
    """Catalogue 9 from the positions (54): r1 = (0, Y), r2 = (l sin phi, Y - l cos phi), Y = y + y0."""
    Y = y + y0
    r1, r2 = sp.Matrix([0, Y]), sp.Matrix([length * sp.sin(phi), Y - length * sp.cos(phi)])
    T = m1 * r1.diff(t).dot(r1.diff(t)) / 2 + m2 * r2.diff(t).dot(r2.diff(t)) / 2
    U = k * (y + static) ** 2 / 2 + g * (m1 * r1[1] + m2 * r2[1])
    return T, lagrange(T, U, [y, phi], R=d * y.diff(t) ** 2 / 2 + D * phi.diff(t) ** 2 / 2)


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("gravity", [False, True])
def test_autoparametric_pendulum_62_63(by, gravity):
    m1, m2, length, D = real("mass1 mass2 length pendulum_damping")
    y, phi = coordinate("y"), coordinate("phi")
    weight = g if gravity else 0
    static = -(m1 + m2) * weight / k  # y is measured from the static position
    T, equations = pendulum_on_a_mass(m1, m2, k, d, length, D, weight, base(by)[0], y, phi, static)
    assert obeys(M.autoparametric_pendulum.from_physical(gravity=gravity, **BY[by]), equations)
    assert regular(T, (y, phi))


def dimensionless_pendulum(ll):
    """(66), (67): total mass, spring and base amplitude one, l = ll, g = ll Omega0^2."""
    x1, x2, lm, W0, Om = real("xi1 xi2 mass_ratio_total Omega0 Omega")
    u, theta = coordinate("u"), coordinate("theta")
    D = 2 * x2 * W0 * lm * ll**2
    _, equations = pendulum_on_a_mass(
        1 - lm, lm, 1, 2 * x1, ll, D, ll * W0**2, sp.cos(Om * t), u, theta, -ll * W0**2
    )  # fmt: skip
    return u, theta, equations


@pytest.mark.parametrize("form", ["length_ratio", "acceleration"])
def test_dimensionless_autoparametric_pendulum_66_67_and_as_printed(form):
    lm, W0, Om = real("mass_ratio_total Omega0 Omega")
    ll = real("length_ratio") if form == "length_ratio" else Om**2 / (real("acceleration") * W0**2)
    make = M.autoparametric_pendulum if form == "length_ratio" else M.autoparametric_pendulum.from_acceleration
    _, theta, equations = dimensionless_pendulum(ll)
    assert obeys(make(), equations)
    printed = dict(equations)  # m2 l^2 theta'' + ... without the base's own term in the second equation
    printed[theta] = equations[theta] + lm * ll * Om**2 * sp.cos(Om * t) * sp.sin(theta)
    assert obeys(make(base_term=False), printed)
    assert not obeys(make(), printed) and not obeys(make(base_term=False), equations)


def test_one_sided_magnet():
    h0 = real("gap")
    for by, values in BY.items():
        equations = one_mass(lambda y: m * g * h0**4 / (3 * (h0 + y) ** 3), by, gravity=True)
        assert obeys(M.one_sided_magnet.from_physical(**values), equations)
    u, Om, xi, acc = coordinate("u"), *real("Omega xi acceleration")
    weight = sp.Rational(1, 4)  # units h0, m and w0^2 = 4 g/h0
    Y = u + acc * weight / Om**2 * sp.cos(Om * t)
    equations = lagrange(Y.diff(t) ** 2 / 2, weight * (Y + 1 / (3 * (1 + u) ** 3)), [u], R=xi * u.diff(t) ** 2)
    assert obeys(M.one_sided_magnet(), equations)


def below(q, energy):
    """A spring that acts for q < 0 only."""
    return sp.Piecewise((energy, q < 0), (0, True))


def test_unilateral_spring():
    for by, values in BY.items():
        equations = one_mass(lambda y: below(y, k * y**2 / 2 + k3 * y**4 / 4), by, gravity=True)
        assert obeys(M.unilateral_spring.from_physical(**values), equations)
    beta = real("beta")
    assert obeys(M.unilateral_spring(), dimensionless_mass(lambda u: below(u, u**2 / 2 + beta * u**4 / 4)))


@pytest.mark.parametrize("sides", ["both", "above", "below"])
def test_soft_stops(sides):
    gap, kappa, eta, xi, Om = real("gap kappa eta xi Omega")
    u = coordinate("u")
    Y = u + sp.cos(Om * t)
    contact = {"above": [u - gap], "below": [-u - gap], "both": [u - gap, -u - gap]}[sides]
    U = u**2 / 2 + sum(below(-z, kappa * z**2 / 2) for z in contact)
    R = xi * u.diff(t) ** 2 + sum(below(-z, eta * u.diff(t) ** 2) for z in contact)
    equations = lagrange(Y.diff(t) ** 2 / 2, U, [u], R=R)
    system = M.soft_stop_oscillator(sides=sides)
    assert obeys(system, equations, gap=0.5)
    assert not obeys(system, lagrange(Y.diff(t) ** 2 / 2, u**2 / 2, [u], R=R), gap=0.5)  # contact was met


def test_hard_stops_are_free_between_the_walls():
    u, xi, Om = coordinate("u"), *real("xi Omega")
    Y = u + sp.cos(Om * t)
    for sides, walls in (("both", {(5.0, 1), (-5.0, -1)}), ("above", {(5.0, 1)}), ("below", {(-5.0, -1)})):
        system = M.hard_stop_oscillator(sides=sides)
        assert obeys(system, lagrange(Y.diff(t) ** 2 / 2, u**2 / 2, [u], R=xi * u.diff(t) ** 2))
        assert {(s.position, s.side) for s in system.stops} == walls


SPRINGS = {
    "power law": (M.PowerLawSpring(k1=190.0, kn=2e4, n=3), lambda q: 95 * q**2 + 5000 * q**4),
    "unsymmetric": (M.PolynomialSpring((0.5, 190.0, 300.0)), lambda q: q / 2 + 95 * q**2 + 100 * q**3),
    "fractional power": (
        M.PowerLawSpring(k1=190.0, kn=50.0, n=1.5),
        lambda q: 95 * q**2 + 20 * (q**2) ** sp.Rational(5, 4),
    ),
    "unilateral": (M.UnilateralSpring(k1=40.0, k3=8.0), lambda q: below(q, 20 * q**2 + 2 * q**4)),
    "rotational magnet": (
        M.RotationalMagneticSpring({2: 0.5, 4: -0.25}),
        lambda q: -sp.cos(2 * q) / 4 + sp.cos(4 * q) / 16,
    ),
}


@pytest.mark.parametrize("name", SPRINGS)
@pytest.mark.parametrize("gravity", [False, True])
def test_any_spring_on_the_shaker(name, gravity):
    spring, U = SPRINGS[name]
    assert obeys(M.spring_oscillator(spring, gravity=gravity, amplitude=1e-4), one_mass(U, gravity=gravity))


def pendulum(positions, g, mass, D, phi):
    """A point mass at positions(t, phi) with a torsional damper."""
    r = sp.Matrix(positions)
    return lagrange(mass * r.diff(t).dot(r.diff(t)) / 2, mass * g * r[1], [phi], R=D * phi.diff(t) ** 2 / 2)


def first_order(equations):
    """Linear part of the equations in the one coordinate."""
    ((q, e),) = equations.items()
    small = sp.Dummy("small", real=True)
    return {q: sp.diff(e.subs(q, small * q).doit(), small).subs(small, 0)}


@pytest.mark.parametrize("by", BY)
def test_base_driven_pendulum_43_44(by):
    length, gravity, phi = *real("length gravity"), coordinate("phi")
    Y, _ = base(by)
    equations = pendulum([length * sp.sin(phi), Y - length * sp.cos(phi)], gravity, m, d, phi)
    assert obeys(M.base_driven_pendulum.from_physical(**BY[by]), equations)
    assert obeys(M.base_driven_pendulum.from_physical(linear=True, **BY[by]), first_order(equations))


@pytest.mark.parametrize(
    ("model", "angle", "sign"), [("base_driven_pendulum", "phi", -1), ("kapitza_pendulum", "psi", 1)]
)
def test_hanging_and_inverted_pendulum(model, angle, sign):
    eps, Om, xi, q = *real("epsilon Omega xi"), coordinate(angle)
    equations = pendulum([sp.sin(q), eps * sp.cos(Om * t) + sign * sp.cos(q)], 1, 1, 2 * xi, q)
    assert obeys(getattr(M, model)(), equations)
    assert obeys(getattr(M, model)(linear=True), first_order(equations))


def test_mechanical_systems_of_figure_8():
    eps, w, gravity, l0 = real("epsilon omega gravity length")
    phi, y = coordinate("phi"), coordinate("y")
    length = l0 * (1 + eps * sp.cos(w * t))
    equations = pendulum([length * sp.sin(phi), -length * sp.cos(phi)], gravity, m, d, phi)
    assert obeys(M.variable_length_pendulum(), equations)
    assert obeys(M.variable_length_pendulum(linear=True), first_order(equations))
    a, S = real("half_length"), real("tension") * (1 + eps * sp.cos(w * t))
    T, R = m * y.diff(t) ** 2 / 2, d * y.diff(t) ** 2 / 2
    assert obeys(M.modulated_string(), lagrange(T, 2 * S * (sp.sqrt(a**2 + y**2) - a), [y], R=R))
    assert obeys(M.modulated_string(linear=True), lagrange(T, S * y**2 / a, [y], R=R))
    stiffness = k * (1 + eps * sp.cos(2 * real("omega_rot") * t))
    assert obeys(M.rotating_shaft(), lagrange(T, stiffness * y**2 / 2, [y], R=R))


def test_electrical_systems_of_figure_8():
    L, C, R, eps, w = real("inductance capacitance resistance epsilon omega")
    q = coordinate("q")
    i, modulated = q.diff(t), 1 + eps * sp.cos(w * t)
    cases = {
        "capacitance": lagrange(L * i**2 / 2, q**2 / (2 * C * modulated), [q], R=R * i**2 / 2),
        "inductance": lagrange(L * modulated * i**2 / 2, q**2 / (2 * C), [q], R=R * i**2 / 2),
        "resistance": lagrange(L * i**2 / 2, q**2 / (2 * C), [q], R=R * modulated * i**2 / 2),
    }
    for name, equations in cases.items():
        assert obeys(getattr(M, f"{name}_modulated_circuit")(), equations)


def test_forced_and_parametric_classics():
    x, u, q, w = coordinate("x"), coordinate("u"), coordinate("q"), coordinate("w")
    delta, alpha, beta, gamma, omega, xi, h, Om = real("delta alpha beta gamma omega xi h Omega")
    drive = {x: gamma * sp.cos(omega * t)}
    U = alpha * x**2 / 2 + beta * x**4 / 4
    assert obeys(M.duffing_textbook(), lagrange(x.diff(t) ** 2 / 2, U, [x], R=delta * x.diff(t) ** 2 / 2, Q=drive))
    U = (1 + h * sp.cos(2 * Om * t)) * u**2 / 2 + beta * u**4 / 4
    assert obeys(M.duffing_mathieu(), lagrange(u.diff(t) ** 2 / 2, U, [u], R=xi * u.diff(t) ** 2))
    a, b, c1, c2, zeta, q_m = real("a b c1 c2 zeta q")
    R = delta * q.diff(t) ** 2
    hill = {
        M.mathieu(): sp.cos(Om * t),
        M.hill(): c1 * sp.cos(Om * t) + c2 * sp.cos(2 * Om * t),
        M.hill(sp.sin(t) ** 3): sp.sin(t) ** 3,
    }
    for system, f in hill.items():
        assert obeys(system, lagrange(q.diff(t) ** 2 / 2, (a + b * f) * q**2 / 2, [q], R=R))
    U = (a - 2 * q_m * sp.cos(2 * t)) * w**2 / 2
    assert obeys(M.mathieu_canonical(), lagrange(w.diff(t) ** 2 / 2, U, [w], R=zeta * w.diff(t) ** 2))


@pytest.mark.parametrize("duty", [0.5, 0.3])
def test_meissner_is_the_square_wave(duty):
    a, b, delta = real("a b delta")
    q = coordinate("q")
    for phase in (0.1, 0.29, 0.31, 0.49, 0.51, 0.99):
        stiffness = a + b * (1 if phase < duty else -1)
        equations = lagrange(q.diff(t) ** 2 / 2, stiffness * q**2 / 2, [q], R=delta * q.diff(t) ** 2)
        assert obeys(M.meissner(duty=duty), equations, Omega=2.0, t=phase * math.pi, duty=duty), phase


def test_paul_trap_has_a_harmonic_potential():
    """Laplace's equation in the trap: the two (three) curvatures add up to zero."""
    a, q, zeta = real("a q zeta")
    x, y = coordinate("x"), coordinate("y")
    p = (a - 2 * q * sp.cos(2 * t)) / 2
    T, R = (x.diff(t) ** 2 + y.diff(t) ** 2) / 2, zeta * (x.diff(t) ** 2 + y.diff(t) ** 2)
    assert obeys(M.paul_trap(), lagrange(T, p * (x**2 - y**2), [x, y], R=R))
    assert obeys(M.paul_trap(geometry="3d"), lagrange(T, p * (x**2 - 2 * y**2), [x, y], R=R))


def test_modulated_coupling_of_two_modes():
    w1, w2, eps, Om, delta, h11, h12, h22 = real("omega1 omega2 epsilon Omega delta h11 h12 h22")
    x, y = coordinate("x1"), coordinate("x2")
    U = (w1**2 * x**2 + w2**2 * y**2) / 2 + eps * sp.cos(Om * t) * (h11 * x**2 / 2 + h12 * x * y + h22 * y**2 / 2)
    R = delta * (x.diff(t) ** 2 + y.diff(t) ** 2)
    equations = lagrange((x.diff(t) ** 2 + y.diff(t) ** 2) / 2, U, [x, y], R=R)
    left = equations[x].doit(), equations[y].doit().subs(h12, real("h21"))  # h21 = h12 if there is a potential
    assert obeys(M.coupled_mathieu(), dict(zip((x, y), left)))


def test_autoparametric_quadratic_has_a_cubic_potential():
    """g1 y^2 and g2 x y come from U = g1 x y^2 with the second mass 2 g1/g2."""
    x1, x2, q, g1, g2, f, eta = real("xi1 xi2 q g1 g2 f eta")
    x, y = coordinate("x"), coordinate("y")
    mu = 2 * g1 / g2
    T = (x.diff(t) ** 2 + mu * y.diff(t) ** 2) / 2
    U = (x**2 + mu * q**2 * y**2) / 2 + g1 * x * y**2
    R = x1 * x.diff(t) ** 2 + mu * x2 * y.diff(t) ** 2
    assert obeys(M.autoparametric_quadratic(), lagrange(T, U, [x, y], R=R, Q={x: f * sp.cos(eta * t)}))


def test_nonlinear_absorber():
    mu1, mu2, lam, alpha, beta, eps, f, w = real("mu1 mu2 lam alpha beta epsilon f omega")
    x, y = coordinate("x1"), coordinate("x2")
    T = (x.diff(t) ** 2 + eps * y.diff(t) ** 2) / 2
    U = x**2 / 2 + alpha * x**4 / 4 + eps * (lam**2 * (x - y) ** 2 / 2 + beta * (x - y) ** 4 / 4)
    R = mu1 * x.diff(t) ** 2 + eps * mu2 * lam * (x - y).diff(t) ** 2
    assert obeys(M.nonlinear_absorber(), lagrange(T, U, [x, y], R=R, Q={x: f * sp.cos(w * t)}))


def test_self_excited_oscillators_and_their_relation():
    """Rayleigh's function with negative damping; the velocity of Rayleigh's oscillator is van der Pol's coordinate."""
    mu, x = real("mu"), coordinate("x")
    v = x.diff(t)
    T, U = v**2 / 2, x**2 / 2
    assert obeys(M.van_der_pol(), lagrange(T, U, [x], R=-mu * (1 - x**2) * v**2 / 2))
    assert obeys(M.rayleigh(), lagrange(T, U, [x], R=-mu * (v**2 / 2 - v**4 / 12)))
    X, V = real("x x_dot")
    rayleigh, van_der_pol = M.rayleigh().rhs, M.van_der_pol().rhs
    accelerated = sp.diff(rayleigh[1], X) * V + sp.diff(rayleigh[1], V) * rayleigh[1]
    z, z_dot = V, rayleigh[1]
    assert vanishes(accelerated - van_der_pol[1].subs({X: z, V: z_dot}, simultaneous=True), ("x", "x_dot"))


def test_lorenz_equations_contract_and_bound_the_energy():
    """Divergence -(sigma + 1 + beta); half of d/dt(x^2 + y^2 + (z - sigma - rho)^2) has no cubic terms (Lorenz 1963)."""
    sigma, rho, beta, x, y, z = real("sigma rho beta x y z")
    f = M.lorenz().rhs
    assert sp.simplify(sum(sp.diff(e, s) for e, s in zip(f, (x, y, z))) + sigma + 1 + beta) == 0
    energy = x * f[0] + y * f[1] + (z - sigma - rho) * f[2]
    assert sp.expand(energy + sigma * x**2 + y**2 + beta * z**2 - beta * (sigma + rho) * z) == 0
    assert f[2].coeff(x * y) == 1 and f[0] == sigma * (y - x)
    c = sp.sqrt(beta * (rho - 1))
    assert [sp.simplify(e.subs({x: c, y: c, z: rho - 1})) for e in f] == [0, 0, 0]


def test_no_model_of_the_catalogue_is_left_out():
    here = "".join(p.read_text(encoding="utf-8") for p in Path(__file__).parent.glob("test_equations_of_*.py"))
    missing = [name for name in M.catalogue() if f"M.{name}" not in here and f'"{name}"' not in here]
    assert [name for name in missing if not name.endswith("_modulated_circuit")] == []
