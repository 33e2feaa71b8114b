"""The electromagnetic transducer on every model (catalogue 11), from one Lagrangian of motion and charge.

    L = T - U + 1/2 L_c q'^2 - Phi(x) q',   R = ... + 1/2 (R_c + R_l) q'^2,   k_em = dPhi/dx,   i = q'

gives -k_em i on the mechanical side and the back voltage k_em x' on the electrical one; without inductance, Kirchhoff's
law is algebraic. Witness: `by_hand.lagrange`.
"""

from __future__ import annotations

import pytest
import sympy as sp
from by_hand import base, coordinate, lagrange, obeys, real, t
from test_equations_of_motion import below

import stability as st

M = st.models
m, k, d, k3, g, kem, Rc, Rl, Lc = real("mass stiffness damping cubic g k_em coil_resistance load_resistance inductance")
charge = coordinate("charge")


def with_coil(T, U, R, coordinates, on, inductance, flux=None):
    """Equations of motion and charge; `flux` is Phi(x), k_em x by default."""
    i = charge.diff(t)
    linkage = kem * on if flux is None else flux(on)
    T = T + (Lc if inductance else 0) * i**2 / 2
    return lagrange(T, U + linkage * i, [*coordinates, charge], R=R + (Rc + Rl) * i**2 / 2)


def coil(inductance, **more):
    return M.Coil(inductance=0.01 if inductance else 0.0, **more)


y = coordinate("y")
Y = y + base()[0]
h0 = real("gap")
ONE_MASS = {
    "linear_oscillator": (k * y**2 / 2, {}),
    "duffing": (k * y**2 / 2 + k3 * y**4 / 4, {}),
    "harvester": (k * y**2 / 2 + k3 * y**4 / 4, {}),
    "one_sided_magnet": (m * g * h0**4 / (3 * (h0 + y) ** 3) + m * g * Y, {}),
    "unilateral_spring": (below(y, k * y**2 / 2 + k3 * y**4 / 4) + m * g * Y, {}),
}


@pytest.mark.parametrize("inductance", [True, False])
@pytest.mark.parametrize("name", ONE_MASS)
def test_coil_on_one_mass(name, inductance):
    U, options = ONE_MASS[name]
    equations = with_coil(m * Y.diff(t) ** 2 / 2, U, d * y.diff(t) ** 2 / 2, [y], y, inductance)
    system = getattr(M, name).from_physical(amplitude=1e-4, coil=coil(inductance), **options)
    assert ("i" in system.states) == inductance
    assert obeys(system, equations, charge)


@pytest.mark.parametrize("inductance", [True, False])
def test_coil_with_position_dependent_coupling(inductance):
    """k_em(y) = 5 (1 - 40 y^2): flux linkage 5 y - 200/3 y^3."""
    equations = with_coil(
        m * Y.diff(t) ** 2 / 2, 95 * y**2, d * y.diff(t) ** 2 / 2, [y], y, inductance, lambda q: 5 * q - 200 * q**3 / 3
    )
    own = coil(inductance, coupling=lambda q: 5 * (1 - 40 * q**2))
    system = M.spring_oscillator(M.PowerLawSpring(k1=190.0), amplitude=1e-4, coil=own)
    assert obeys(system, equations, charge)


@pytest.mark.parametrize("inductance", [True, False])
@pytest.mark.parametrize("on", ["y1", "y2"])
def test_coil_on_the_chain(on, inductance):
    m1, m2, k1, k2, d1, d2 = real("mass1 mass2 stiffness1 stiffness2 damping1 damping2")
    y1, y2, y0 = coordinate("y1"), coordinate("y2"), base()[0]
    T = m1 * (y1 + y0).diff(t) ** 2 / 2 + m2 * (y2 + y0).diff(t) ** 2 / 2
    c1, c2 = real("cubic1 cubic2")
    U = k1 * y1**2 / 2 + k2 * (y2 - y1) ** 2 / 2 + c1 * y1**4 / 4 + c2 * (y2 - y1) ** 4 / 4
    R = d1 * y1.diff(t) ** 2 / 2 + d2 * (y2 - y1).diff(t) ** 2 / 2
    equations = with_coil(T, U, R, [y1, y2], coordinate(on), inductance)
    system = M.chain.from_physical(amplitude=1e-4, coil=coil(inductance, coordinate=on))
    assert obeys(system, equations, charge)


@pytest.mark.parametrize("inductance", [True, False])
@pytest.mark.parametrize("on", ["y", "phi"])
def test_coil_on_the_autoparametric_pendulum(on, inductance):
    """On phi it is the rotary generator of the chapter's reference [12]: torque kappa i, back voltage kappa phi'."""
    m1, m2, length, D = real("mass1 mass2 length pendulum_damping")
    phi = coordinate("phi")
    r1, r2 = sp.Matrix([0, Y]), sp.Matrix([length * sp.sin(phi), Y - length * sp.cos(phi)])
    T = m1 * r1.diff(t).dot(r1.diff(t)) / 2 + m2 * r2.diff(t).dot(r2.diff(t)) / 2
    U = k * (y - (m1 + m2) * g / k) ** 2 / 2 + g * (m1 * r1[1] + m2 * r2[1])
    R = d * y.diff(t) ** 2 / 2 + D * phi.diff(t) ** 2 / 2
    equations = with_coil(T, U, R, [y, phi], coordinate(on), inductance)
    system = M.autoparametric_pendulum.from_physical(amplitude=1e-4, coil=coil(inductance, coordinate=on))
    assert obeys(system, equations, charge)


def test_dimensionless_harvester():
    """Unit mass, spring and length; unit current is k_em w1 X/R, so that k_em = R = theta and L_c = lam theta."""
    theta, lam, f, beta, xi, Om = real("theta lam f beta xi Omega")
    u, j = coordinate("u"), coordinate("j_charge")
    Y = u + f / Om**2 * sp.cos(Om * t)
    i = j.diff(t)
    T = Y.diff(t) ** 2 / 2 + lam * theta * i**2 / 2
    U = u**2 / 2 + beta * u**4 / 4 + theta * u * i
    equations = lagrange(T, U, [u, j], R=xi * u.diff(t) ** 2 + theta * i**2 / 2)
    system = M.harvester()
    rhs = dict(zip(system.states, system.rhs))
    known = {u.diff(t, 2): rhs["u_dot"], j.diff(t, 2): rhs["j"]}
    plain = {i: real("j"), u.diff(t): real("u_dot"), u: real("u")}
    left = [e.doit().subs(known).subs(plain) for e in equations.values()]
    assert [sp.simplify(e) for e in left] == [0, 0]
