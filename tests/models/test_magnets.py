"""Magnets. Witnesses: Bessel integrals (mpmath), elliptic closed forms, surface-charge quadrature, dipole limit."""

import dataclasses
import math
import pickle

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as some

import stability as st
from stability.errors import InputError
from stability.kernels.block_magnets import block_interaction
from stability.kernels.coaxial_cylinders import cylinder_faces
from stability.kernels.coaxial_discs import charged_discs
from stability.models._magnets import MU0
from stability.systems.evaluators import evaluator

models = st.models
mm = 1e-3
RING = models.RingMagnet(3 * mm, 6 * mm, 4 * mm, 1.2)  # the three-ring spring of the catalogue
DISC = models.DiscMagnet(5 * mm, 3 * mm, 1.2)  # "10 mm discs"
HOLE, PIN = models.RingMagnet(4 * mm, 8 * mm, 3 * mm, 1.2), models.DiscMagnet(2 * mm, 3 * mm, 1.2)
BLOCK = models.BlockMagnet(10 * mm, 6 * mm, 3 * mm, 1.2)
PAIRS = {
    "rings": models.MagnetPair(RING, RING),
    "discs": models.MagnetPair(DISC, DISC),
    "unequal": models.MagnetPair(RING, models.DiscMagnet(4 * mm, 2 * mm, 0.9)),
    "unlike": models.MagnetPair(RING, models.RingMagnet(2 * mm, 5 * mm, 1 * mm, 1.0), facing="unlike"),
    "nested": models.MagnetPair(HOLE, PIN),
    "blocks": models.MagnetPair(BLOCK, models.BlockMagnet(8 * mm, 8 * mm, 5 * mm, 1.1)),
}
COAXIAL = [name for name in PAIRS if name != "blocks"]


# ---- kernels


@pytest.mark.parametrize("order", [-1, 0, 1, 2, 3])
@pytest.mark.parametrize(("a", "b", "z"), [(1.0, 1.0, 0.6), (1.0, 2.0, 0.5), (3.0, 1.5, 8.0)])
def test_disc_integral_is_the_bessel_integral(a, b, z, order):
    """S_n = (-1)^n a b int_0^inf J1(ka) J1(kb) e^(-kz) k^(n-1) dk (S_-1 = int_z^inf S_0): the other form of catalogue 1."""
    mpmath.mp.dps = 25
    cuts = [0, *(mpmath.mpf(2) * i for i in range(1, 12)), mpmath.inf] if z > 2 else [*range(0, 120, 2), mpmath.inf]
    exact = a * b * mpmath.quad(
        lambda k: mpmath.besselj(1, k * a) * mpmath.besselj(1, k * b) * mpmath.exp(-k * z) * k ** (order - 1), cuts
    )
    value = charged_discs(a, b, np.array([z, -z]), order)
    sign = -1.0 if order in (1, 3) else 1.0
    np.testing.assert_allclose(value[0], sign * float(exact), rtol=2e-12)
    assert value[1] == (-value[0] if order in (0, 2) else value[0])


@pytest.mark.parametrize(("a", "b", "z"), [(1.0, 1.0, 1e-4), (1.0, 1.0, 0.3), (1.0, 2.0, 1e-9), (2.0, 1.0, 3.0)])
def test_disc_derivative_is_maxwells_coil_formula(a, b, z):
    """S_1 = -(a b/pi) int_0^pi cos t/R dt: mutual inductance of two loops in K and E."""
    from scipy.special import ellipe, ellipkm1

    m = 4 * a * b / ((a + b) ** 2 + z**2)
    rest = ((a - b) ** 2 + z**2) / ((a + b) ** 2 + z**2)
    kappa = math.sqrt(m)
    loops = ((2 / kappa - kappa) * ellipkm1(rest) - 2 / kappa * ellipe(m)) / math.sqrt(a * b)
    assert math.isclose(charged_discs(a, b, np.array([z]), 1)[0], -a * b / math.pi * loops, rel_tol=1e-12)


def test_disc_integral_near_contact_and_far_away():
    """Small gaps: the mapped rule against the closed form down to 1e-8 radii. Far: a^2 b^2/(4 z^2) in leading order."""
    z = np.geomspace(1e-8, 1.0, 30)
    closed = math.pi / 2 - cylinder_faces(1.0, 1.0, z) / 2
    np.testing.assert_allclose(math.pi * charged_discs(1.0, 1.0, z), closed, rtol=1e-13)
    far = charged_discs(1.0, 2.0, np.array([1e3, 1e5])) * np.array([1e3, 1e5]) ** 2
    np.testing.assert_allclose(far, 1.0, rtol=1e-5)  # next order: (a^2 + b^2)/z^2
    assert abs(far[1] - 1.0) < 1e-9


@pytest.mark.parametrize(("a", "b", "z"), [(1.0, 1.0, 0.3), (1.0, 2.0, 0.5), (3.0, 2.9, 1e-3), (2.0, 0.5, -4.0)])
def test_cylinder_faces_are_the_published_formula(a, b, z):
    """a1 a2 a3 [K - E/a2 - (1 - a1^2/a3^2) Pi(n, m)] as in the catalogue, by mpmath's own Pi (0 times it for a = b)."""
    mpmath.mp.dps = 40
    a1, d = mpmath.mpf(z), mpmath.mpf(a) - mpmath.mpf(b)
    a2, a3 = 1 + d**2 / a1**2, mpmath.sqrt((mpmath.mpf(a) + b) ** 2 + a1**2)
    m = 4 * mpmath.mpf(a) * b / a3**2
    third = (1 - a1**2 / a3**2) * mpmath.ellippi(m / (1 - a2), m) if d else 0
    exact = a1 * a2 * a3 * (mpmath.ellipk(m) - mpmath.ellipe(m) / a2 - third)
    assert math.isclose(cylinder_faces(a, b, np.array([z]))[0], float(exact), rel_tol=1e-13)


def _overlap(half1, half2, shift, nodes=40):
    """Gauss nodes in u and weights of the chance to find two points of two edges at distance u: a trapezoid."""
    outer, inner = half1 + half2, abs(half1 - half2)
    x, w = np.polynomial.legendre.leggauss(nodes)
    u, weight = [], []
    for low, high in ((-outer, -inner), (-inner, inner), (inner, outer)):
        part = 0.5 * (low + high) + 0.5 * (high - low) * x
        u.append(part)
        weight.append(0.5 * (high - low) * w * np.minimum(2 * min(half1, half2), outer - np.abs(part)))
    return np.concatenate(u) + shift, np.concatenate(weight)


@pytest.mark.parametrize("order", [0, 1, 2, 3, 4])
def test_block_sum_is_the_surface_charge_quadrature(order):
    """Numerical integral of s1 s2 d^n(1/r)/dz^n over the four pairs of pole faces, edges not aligned."""
    one, two, shift, z = (0.5, 0.7, 0.3), (0.6, 0.4, 0.45), (0.1, -0.2), np.array([1.4, 2.2, 3.5])
    u, wu = _overlap(one[0], two[0], shift[0])
    v, wv = _overlap(one[1], two[1], shift[1])
    x, y, h = sp.symbols("x y h", positive=True)
    kernel = sp.lambdify((x, y, h), sp.diff(1 / sp.sqrt(x**2 + y**2 + h**2), h, order))
    total = np.zeros(3)
    for p in (-1, 1):
        for s in (-1, 1):
            height = z + p * two[2] - s * one[2]
            values = kernel(u[:, None, None], v[:, None], height)
            total += p * s * np.einsum("i,j,ijk->k", wu, wv, values)
    np.testing.assert_allclose(block_interaction(one, two, shift, z, order), total, rtol=1e-10)


def test_block_symmetries():
    """Exchange of the blocks, of the edges x and y, and the sign of the offset leave the energy alone."""
    one, two, z = (0.5, 0.7, 0.3), (0.6, 0.4, 0.45), np.array([1.2])
    energy = block_interaction(one, two, (0.1, -0.2), z)
    np.testing.assert_allclose(block_interaction(two, one, (-0.1, 0.2), z), energy, rtol=1e-12)
    swapped = block_interaction((0.7, 0.5, 0.3), (0.4, 0.6, 0.45), (-0.2, 0.1), z)
    np.testing.assert_allclose(swapped, energy, rtol=1e-12)
    np.testing.assert_allclose(block_interaction(one, two, (-0.1, -0.2), z), energy, rtol=1e-12)


# ---- pairs


@pytest.mark.parametrize("name", COAXIAL)
def test_charge_model_is_the_closed_form(name):
    """Quadrature of the charge model against complete elliptic integrals to 1e-12."""
    pair = PAIRS[name]
    gaps = np.array([-4.0, -1.2, 0.4, 2.0, 9.0]) * mm if pair.nested else np.array([0.01, 0.1, 1.0, 4.0, 8.0, 15.0]) * mm
    charge, closed = pair.force(gaps), pair.force(gaps, "closed form")
    contact = pair.first.polarization * pair.second.polarization * pair.first.size**2 / MU0
    np.testing.assert_allclose(charge, closed, rtol=1e-12, atol=1e-14 * contact)  # round-off of the terms in the sum
    assert np.max(np.abs(charge)) > 0.02 * contact


@pytest.mark.parametrize("name", PAIRS)
def test_energy_is_the_integral_of_the_force(name):
    from scipy.integrate import quad

    pair, gap = PAIRS[name], 1.5 * mm
    near = quad(lambda g: float(pair.force(g)), gap, 20 * mm, epsrel=1e-12, epsabs=0)[0]
    assert math.isclose(near, float(pair.energy(gap) - pair.energy(20 * mm)), rel_tol=1e-11)
    far = pair.far_field(300 * mm) * (300 * mm + pair.centre_offset) / 3.0  # int of the dipole law
    assert math.isclose(float(pair.energy(300 * mm)), float(far), rel_tol=2e-2)


@pytest.mark.parametrize("name", PAIRS)
def test_derivatives_of_the_pair_force(name):
    """Each order is the slope of the one below (fourth-order differences)."""
    pair, gap, h = PAIRS[name], 3.1 * mm, 0.02 * mm
    for order in (1, 2, 3):
        f = pair.derivative(gap + h * np.array([-2, -1, 1, 2]), order - 1)
        slope = (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h)
        assert math.isclose(float(pair.derivative(gap, order)), slope, rel_tol=1e-6)


@pytest.mark.parametrize("name", PAIRS)
def test_far_field(name):
    """f -> 3 mu0 m1 m2/(2 pi z^4): the deviation falls as 1/z^2, and moments are J V/mu0."""
    pair = PAIRS[name]
    near, far = (float(pair.far_field(g) / pair.force(g)) - 1.0 for g in (0.1, 0.2))
    assert abs(far) < 0.02 and math.isclose(near / far, 4.0, rel_tol=0.2)


def test_far_field_percentages_of_the_catalogue():
    """10 mm discs, 3 mm thick: the dipole law is 6 % too large at 40 mm, 21 % at 20 mm, 50 % at 12 mm, 15 times at 0.5 mm."""
    ratio = PAIRS["discs"].far_field(np.array([40, 20, 12, 0.5]) * mm) / PAIRS["discs"].force(np.array([40, 20, 12, 0.5]) * mm)
    np.testing.assert_allclose(ratio, (1.060117, 1.215275, 1.526759, 14.945449), rtol=1e-6)
    assert ratio[0] == pytest.approx(1.06, abs=0.005) and ratio[3] == pytest.approx(15.0, abs=0.1)


def test_action_is_reaction_and_poles_change_the_sign():
    for name in ("unequal", "unlike", "blocks", "nested"):
        pair = PAIRS[name]
        turned = models.MagnetPair(pair.second, pair.first, pair.facing)
        other = models.MagnetPair(pair.first, pair.second, "unlike" if pair.facing == "like" else "like")
        assert math.isclose(float(turned.force(2 * mm)), float(pair.force(2 * mm)), rel_tol=1e-12)
        assert float(other.force(2 * mm)) == -float(pair.force(2 * mm))
    assert float(PAIRS["rings"].force(1 * mm)) > 0.0


def test_touching_discs_reach_the_maxwell_pressure():
    """Wide thin gap: f -> J^2 A/(2 mu0), the pull of two magnets in contact, when the magnets are long."""
    long = models.DiscMagnet(5 * mm, 500 * mm, 1.2)
    pull = 1.2**2 * long.area / (2 * MU0)
    assert float(models.MagnetPair(long, long, "unlike").force(1e-9)) == pytest.approx(-pull, rel=1e-3)


def test_square_blocks_are_nearly_discs_of_equal_area():
    square = models.BlockMagnet(10 * mm, 10 * mm, 3 * mm, 1.2)
    disc = square.equal_area_disc()
    assert math.isclose(disc.volume, square.volume, rel_tol=1e-14)
    ratio = models.MagnetPair(square, square).force(12 * mm) / models.MagnetPair(disc, disc).force(12 * mm)
    assert 0.97 < float(ratio) < 1.0  # the corners reach further out


# ---- springs


def test_three_ring_spring_of_the_catalogue():
    """k1 = 189.2 N/m, k3 = 1.87e6 N/m^3; k1 = -2 f'(gap), k3 = -f'''(gap)/3; and the same from differences of F."""
    spring, pair = models.LevitatedMagnetSpring(RING, gap=12 * mm), PAIRS["rings"]
    k0, k1, k2, k3 = spring.taylor
    assert round(k1, 1) == 189.2 and round(k3 / 1e4) == 187 and k0 == 0.0 and k2 == 0.0
    assert math.isclose(k1, -2 * float(pair.derivative(12 * mm, 1)), rel_tol=1e-14)
    assert math.isclose(k3, -float(pair.derivative(12 * mm, 3)) / 3, rel_tol=1e-14)
    y = np.linspace(-1, 1, 41) * mm
    fit = np.polynomial.polynomial.polyfit(y / mm, pair.force(12 * mm - y, "closed form") - pair.force(12 * mm + y, "closed form"), 9)
    assert math.isclose(fit[1] / mm, k1, rel_tol=1e-9) and math.isclose(fit[3] / mm**3, k3, rel_tol=1e-6)
    assert spring.odd and spring.rest == 0.0 and spring.escape == (-math.inf, math.inf)
    assert float(spring.backbone(6 * mm, 0.02)) > float(spring.backbone(0.0, 0.02)) == pytest.approx(math.sqrt(k1 / 0.02))


SPRINGS = {
    "levitated": models.LevitatedMagnetSpring(RING, gap=12 * mm),
    "unequal gaps": models.LevitatedMagnetSpring(RING, gap=12 * mm, upper_gap=8 * mm, upper=DISC),
    "blocks": models.LevitatedMagnetSpring(BLOCK, gap=10 * mm),
    "one-sided": models.OneSidedMagnetSpring(DISC, mass=0.02),
    "bistable": models.NestedRingSpring(PIN, HOLE),
    "held": models.NestedRingSpring(PIN, HOLE, facing="like"),
}


@pytest.mark.parametrize("name", SPRINGS)
def test_table_is_the_spring_within_its_stated_error(name):
    """In equations: force within `fit_error` of the geometry on a fresh grid, derivatives close, energy its antiderivative."""
    spring, y = SPRINGS[name], sp.Symbol("y", real=True)
    low, high = spring.travel or spring._default_travel
    at = np.linspace(low, high, 3333)[1:-1]
    table, scale = spring.force_table, np.max(np.abs(spring.force(at)))
    assert spring.fit_error <= 1e-10 * float(np.max(np.abs(spring.force(np.array([low, high, *at])))))
    assert np.max(np.abs(table.evaluate(at) - spring.force(at))) <= 2.0 * spring.fit_error + 1e-15 * scale
    for order, loss in ((1, 1e-7), (2, 1e-4), (3, 2e-2)):
        exact = spring.derivative(at, order)
        assert np.max(np.abs(table.evaluate(at, order) - exact)) < loss * np.max(np.abs(exact))
    energy = spring.energy_expression(y)
    for value in (0.6 * low, 0.1 * high, 0.7 * high):
        expected = float(spring.energy(value))
        assert math.isclose(float(energy.subs(y, value)), expected, rel_tol=1e-8, abs_tol=1e-10 * scale * (high - low))
        assert math.isclose(spring.work(np.linspace(0.0, value, 5)), expected, rel_tol=1e-10)


@pytest.mark.parametrize("backend", ["llvm", "lambdify"])
@pytest.mark.parametrize("name", SPRINGS)
def test_magnet_spring_in_a_system(name, backend):
    """Equation of motion from the energy, compiled: force and slope of the geometry within the fit error of the table."""
    spring, m = SPRINGS[name], 0.02
    t = sp.Symbol("t", real=True)
    y = sp.Function("y")(t)
    energy = m * y.diff(t) ** 2 / 2 - spring.energy_expression(y)
    system = st.System.from_lagrangian(energy, coordinates=[y], parameters={})
    low, high = spring._default_travel
    at = np.linspace(0.95 * low, 0.95 * high, 61)
    values, slopes = evaluator(system, backend).FJ(np.zeros(61), np.column_stack([at, 0.0 * at]), np.zeros(0))
    scale = float(np.max(np.abs(spring.force(at))))
    assert np.max(np.abs(m * values[:, 1] + spring.force(at))) <= spring.fit_error + 1e-13 * scale
    stiffness = spring.stiffness(at)
    assert np.max(np.abs(m * slopes[:, 1, 0] + stiffness)) < 1e-7 * np.max(np.abs(stiffness))


@settings(max_examples=20, deadline=None)
@given(stretch=some.floats(0.01, 100.0), inner=some.floats(0.5, 5.0), thick=some.floats(0.2, 10.0), gap=some.floats(0.5, 20.0))
def test_forces_scale_with_the_area(stretch, inner, thick, gap):
    """All lengths times s at fixed polarisation: force times s^2, k1 times s, k3 by s, energy times s^3."""
    one, other = (
        models.LevitatedMagnetSpring(models.RingMagnet(inner * s, 6 * s, thick * s, 1.2), gap=gap * s)
        for s in (mm, mm * stretch)
    )
    np.testing.assert_allclose(other.taylor[1::2], np.array(one.taylor[1::2]) * (stretch, 1 / stretch), rtol=1e-9)
    y = 0.4 * gap * mm
    assert math.isclose(float(other.force(y * stretch)), float(one.force(y)) * stretch**2, rel_tol=1e-11)
    assert math.isclose(float(other.energy(y * stretch)), float(one.energy(y)) * stretch**3, rel_tol=1e-9)


def test_springs_are_data():
    """Frozen, hashable, picklable, and a changed copy is a new spring."""
    for spring in SPRINGS.values():
        again = pickle.loads(pickle.dumps(spring))  # noqa: S301 (own bytes)
        assert again == spring and hash(again) == hash(spring) and float(again.force(1 * mm)) == float(spring.force(1 * mm))
    wider = dataclasses.replace(SPRINGS["levitated"], gap=16 * mm)
    assert wider.taylor[1] < SPRINGS["levitated"].taylor[1]
    with pytest.raises(dataclasses.FrozenInstanceError):
        wider.gap = 1.0


def test_unequal_gaps_give_an_unsymmetric_spring():
    spring = SPRINGS["unequal gaps"]
    assert not spring.odd and spring.taylor[2] != 0.0 and spring.domain == (-12 * mm, 8 * mm)
    assert abs(float(spring.force(spring.rest))) < 1e-12 and spring.rest != 0.0


def _period_in_time(law, start, guess):
    """Second method for a period: DOP853 from rest at the upper turning point until the velocity falls through zero again."""
    from scipy.integrate import solve_ivp

    def turns(_, x):
        return x[1]

    turns.direction = -1.0
    motion = solve_ivp(
        lambda _, x: [x[1], law(x[0])], (0, 1.2 * guess), [start, 0.0],
        method="DOP853", rtol=1e-12, atol=1e-15, events=turns,
    )  # fmt: skip
    return float(motion.t_events[0][-1])


@pytest.mark.parametrize("amplitude", [4 * mm, 11 * mm])
def test_levitated_backbone_against_time_integration(amplitude):
    """Up to 1 mm before contact; the elliptic closed form drives the motion."""
    spring, pair, m = SPRINGS["levitated"], PAIRS["rings"], 0.02

    def law(y):
        return float(pair.force(12 * mm + y, "closed form") - pair.force(12 * mm - y, "closed form")) / m

    period = 2 * math.pi / float(spring.backbone(amplitude, m))
    assert math.isclose(_period_in_time(law, amplitude, period), period, rel_tol=1e-9)


def test_one_sided_spring_floats_where_the_force_is_the_weight():
    """f(h0) = m g, w^2 = -f'(h0)/m; the motion with weight in time (DOP853) has the period of the backbone."""
    spring, m = SPRINGS["one-sided"], 0.02
    h0 = spring.floating_gap
    assert math.isclose(float(spring.pair.force(h0, "closed form")), m * 9.81, rel_tol=1e-12)
    w2 = -float(spring.pair.derivative(h0, 1)) / m
    assert math.isclose(spring.natural_frequency**2, w2, rel_tol=1e-14)
    a = 6 * mm
    w = spring.backbone([0.0, a], m)
    assert math.isclose(w[0], spring.natural_frequency, rel_tol=1e-12) and w[1] < w[0]  # softening
    assert w[1] / (2 * math.pi) < 1 / (2 * math.sqrt(2 * 2 * a / 9.81))
    from stability.models._spring_motion import turning_points

    period, start = 2 * math.pi / w[1], turning_points(spring, a)[1]
    measured = _period_in_time(lambda y: float(spring.pair.force(h0 + y)) / m - 9.81, start, period)
    assert math.isclose(measured, period, rel_tol=1e-9)


def test_light_weights_float_in_the_far_field():
    """w^2 z0/g -> 4 with z0 between the centres: the dipole spring is the limit of the geometry."""
    spring = models.OneSidedMagnetSpring(DISC, mass=2e-6)
    z0 = spring.floating_gap + 3 * mm
    assert spring.natural_frequency**2 * z0 / 9.81 == pytest.approx(4.0, rel=5e-3)
    dipole = models.DipoleMagnetSpring(weight=2e-6 * 9.81, floating_gap=z0)
    y = np.linspace(-0.3, 1.0, 14) * z0
    np.testing.assert_allclose(spring.force(y), dipole.force(y), rtol=0.02, atol=0.01 * dipole.weight)


def test_dipole_spring_of_catalogue_10():
    """h0 = 1.1 mm: w^2 = 4 g/h0, 30.06 Hz; softening towards the flight-time bound."""
    spring = models.DipoleMagnetSpring(weight=0.02 * 9.81, floating_gap=1.1 * mm)
    assert round(float(spring.backbone(0.0, 0.02)) / (2 * math.pi), 2) == 30.06
    assert math.isclose(float(spring.backbone(0.0, 0.02)), math.sqrt(4 * 9.81 / (1.1 * mm)), rel_tol=1e-12)
    heights = np.array([1.0, 3.654, 7.3, 200.0]) * mm
    ratio = spring.backbone(heights / 2, 0.02) / (2 * math.pi) * 2 * np.sqrt(2 * heights / 9.81)
    assert np.all(ratio < 1.0) and np.all(np.diff(ratio) > 0.0) and ratio[-1] > 0.99


def test_nested_rings_of_the_catalogue():
    """Disc 2 mm in a ring 4/8 mm, t = 3 mm, like poles: attraction below about 4 mm gap, repulsion above."""
    pair = PAIRS["nested"]
    assert np.all(pair.force(np.array([0.5, 1.0, 2.0, 4.0]) * mm) < 0.0)
    assert np.all(pair.force(np.array([4.5, 6.0, 10.0]) * mm) > 0.0)
    held, bistable = SPRINGS["held"], SPRINGS["bistable"]
    zero = held.escape[1]
    assert zero - 3 * mm == pytest.approx(4.16 * mm, abs=0.01 * mm)
    assert held.rest == 0.0 and held.escape[0] == pytest.approx(-zero)
    assert bistable.rest == pytest.approx(zero) and bistable.escape == (0.0, math.inf)
    assert float(bistable.energy(zero)) < 0.0 < float(held.energy(zero))  # well and hilltop seen from the centre


def test_quasi_zero_stiffness():
    """A spring of -k1 in parallel leaves a cubic law: w proportional to the amplitude (0.8472 sqrt(k3/m) a)."""
    spring = SPRINGS["bistable"]
    flat = spring + models.PolynomialSpring((0.0, spring.quasi_zero_support))
    assert abs(float(flat.stiffness(0.0))) < 1e-12 and flat.equilibria == (0.0,)
    k3 = spring.taylor[3]
    assert float(flat.backbone(0.02 * mm, 0.01)) == pytest.approx(0.8472130848 * math.sqrt(k3 / 0.01) * 0.02 * mm, rel=1e-3)
    weaker = spring + models.PolynomialSpring((0.0, 0.5 * spring.quasi_zero_support))
    assert len(weaker.equilibria) == 3 and 0.0 < weaker.rest < spring.rest


# ---- rotation


def test_rotational_spring_closes_over_a_turn():
    spring = models.RotationalMagneticSpring({1: 4e-3, 2: 1e-2, 4: -1e-3}, {1: 0.3}, pole_pairs=2)
    assert abs(spring.work((0.0, 2 * math.pi))) < 1e-15
    assert abs(float(spring.energy(2 * math.pi))) < 1e-15
    assert abs(spring.work((0.0, math.pi / 2))) > 1e-4  # half a pole pair does cost work
    assert spring.units == ("rad", "N m", "N m/rad", "J")


def test_two_pole_reluctance_is_a_pendulum():
    """J phi'' + T sin 2 phi = 0 is a pendulum in 2 phi: w = pi w0/(2 K(sin^2 a)), w0^2 = 2 T/J; it escapes at pi/2."""
    from scipy.special import ellipk

    spring, inertia, a = models.RotationalMagneticSpring({2: 1e-2}), 1e-6, np.array([0.1, 0.8, 1.5])
    exact = math.pi * math.sqrt(2e-2 / inertia) / (2 * ellipk(np.sin(a) ** 2))
    np.testing.assert_allclose(spring.backbone(a, inertia), exact, rtol=1e-12)
    np.testing.assert_allclose(spring.escape, (-math.pi / 2, math.pi / 2), rtol=1e-14)
    unstable = spring.about(math.pi / 2)
    assert math.isclose(float(unstable.stiffness(0.0)), -2e-2, rel_tol=1e-14)
    assert abs(abs(unstable.rest) - math.pi / 2) < 1e-12


# ---- mistakes


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: models.RingMagnet(-1 * mm, 6 * mm, 4 * mm, 1.2), "RingMagnet: inner_radius must be > 0 m; got -0.001"),
        (lambda: models.RingMagnet(6 * mm, 6 * mm, 4 * mm, 1.2), "inner_radius must be below outer_radius = 0.006 m"),
        (lambda: models.DiscMagnet(5 * mm, 0.0, 1.2), "thickness must be > 0 m"),
        (lambda: models.DiscMagnet(5 * mm, 3 * mm, math.inf), "polarization must be a finite number"),
        (lambda: models.BlockMagnet(5 * mm, "wide", 3 * mm, 1.2), "width must be a number"),
        (lambda: models.MagnetPair(RING, BLOCK), "must both be blocks"),
        (lambda: models.MagnetPair(RING, 3.0), "second must be a RingMagnet"),
        (lambda: models.MagnetPair(RING, RING, facing="north"), "facing must be one of 'like', 'unlike'"),
        (lambda: PAIRS["rings"].force(0.0), "gap must be finite and > 6e-11 m, else the magnets touch; got 0"),
        (lambda: PAIRS["rings"].force([1 * mm, -1 * mm]), "got -0.001"),
        (lambda: PAIRS["blocks"].force(1 * mm, "charge model"), "method must be one of 'closed form'"),
        (lambda: PAIRS["rings"].derivative(1 * mm, 4), "order must be 0, 1, 2 or 3"),
        (lambda: models.LevitatedMagnetSpring(RING, gap=0.0), "LevitatedMagnetSpring: gap must be > 0 m"),
        (lambda: models.LevitatedMagnetSpring("ring", gap=1.0), "moving must be a RingMagnet"),
        (lambda: models.LevitatedMagnetSpring(RING, gap=2 * mm, travel=(-3 * mm, 1 * mm)), "travel must lie around 0"),
        (lambda: SPRINGS["levitated"].force(12 * mm), "displacement must stay inside"),
        (lambda: SPRINGS["levitated"].force(13 * mm), "where the magnets touch"),
        (lambda: models.OneSidedMagnetSpring(DISC, mass=50.0), "mass must be below .* kg"),
        (lambda: models.OneSidedMagnetSpring(DISC, mass=-1.0), "mass must be > 0 kg; got -1"),
        (lambda: models.DipoleMagnetSpring(0.2, 1 * mm).force(-1 * mm), "contact"),
        (lambda: models.NestedRingSpring(RING, HOLE), "inner must fit into the hole of the ring outer, radius below 0.004"),
        (lambda: models.NestedRingSpring(PIN, DISC), "inner must fit into the hole"),
        (lambda: models.RotationalMagneticSpring({}), "at least one harmonic"),
        (lambda: models.RotationalMagneticSpring({0: 1.0}), "not conservative over a turn"),
        (lambda: models.RotationalMagneticSpring({2: 1.0}, {1: 0.3}), "harmonic 1, which has no torque"),
        (lambda: models.RotationalMagneticSpring({2: 1.0}, pole_pairs=0), "pole_pairs must be an integer >= 1"),
    ],
)
def test_mistakes_are_named(make, message):
    with pytest.raises(InputError, match=message):
        make()
