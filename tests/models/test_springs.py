"""Springs. Witnesses: closed forms (elliptic, Gamma), Gauss quadrature of the force, sympy, scipy's integrator."""

import math
from math import gamma

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as some

import stability as st
from stability.errors import InputError, UnknownNameError
from stability.systems.evaluators import evaluator

models = st.models
q = sp.Symbol("q", real=True)
SAMPLES = np.arange(-20, 21) / 10.0  # exactly symmetric

SPRINGS = {
    "linear": models.PowerLawSpring(k1=3.0),
    "hardening": models.PowerLawSpring(k1=1.0, kn=0.7),
    "softening": models.PowerLawSpring(k1=1.0, kn=-0.2),
    "even": models.PowerLawSpring(k1=1.0, kn=0.3, n=2),
    "fractional": models.PowerLawSpring(k1=0.5, kn=2.0, n=1.5),
    "root": models.PowerLawSpring(k1=0.5, kn=2.0, n=0.5),
    "singular": models.PowerLawSpring(k1=0.5, kn=2.0, n=-0.5),
    "irrational": models.PowerLawSpring(k1=0.5, kn=2.0, n=math.pi),
    "polynomial": models.PolynomialSpring((0.1, 1.0, -0.2, 0.3)),
    "play": models.PiecewiseSpring.from_stiffness((-0.5, 0.5), (4.0, 0.0, 4.0)),
    "pieces": models.PiecewiseSpring((-1.0, 0.5), ((0.0, 2.0), (0.0, 1.0, 0.0, 0.5), (1.0, 0.2, 0.3))),
    "unilateral": models.UnilateralSpring(k1=2.0, k3=1.0),
    "unilateral positive": models.UnilateralSpring(k1=2.0, k3=1.0, side="positive"),
    "table": models.TabulatedSpring(SAMPLES, SAMPLES + 0.2 * SAMPLES**2),
    "quintic table": models.TabulatedSpring(SAMPLES, np.sinh(SAMPLES), method="quintic"),
    "sum": models.PowerLawSpring(k1=1.0, kn=0.7) + models.PolynomialSpring((0.2, -0.5)),
    "dipole": models.DipoleMagnetSpring(weight=0.2, floating_gap=3.0),
    "rotor": models.RotationalMagneticSpring({1: 0.4, 2: 1.0}, {1: 0.3}),
}


@pytest.fixture(params=SPRINGS, name="spring")
def _spring(request):
    return SPRINGS[request.param]


def test_energy_is_the_quadrature_of_the_force(spring):
    """E(s) = int_0^s F dq with the force alone (Gauss in short steps), and E(0) = 0."""
    assert float(spring.energy(0.0)) == 0.0
    for s in (-1.9, -0.37, 0.8, 1.7):
        steps = s * np.linspace(0.0, 1.0, 9) ** (8.0 if spring == SPRINGS["singular"] else 2.0)
        tolerance = 2e-3 if spring == SPRINGS["singular"] else 2e-8 if spring == SPRINGS["root"] else 1e-11
        assert math.isclose(spring.work(steps), float(spring.energy(s)), rel_tol=tolerance)


def test_closed_path_costs_nothing(spring):
    scale = float(np.max(np.abs(spring.force(SAMPLES[SAMPLES != 0.0]))))
    slack = 1e-4 if spring in (SPRINGS["singular"], SPRINGS["root"]) else 1e-9  # Gauss rule at the kink of |q|^n
    assert abs(spring.work((0.0, 1.9, -0.4, 0.3, -1.8, 0.0))) < slack * scale


def test_symmetric_integral_vanishes_for_odd_springs_only(spring):
    integral = float(spring.energy(1.5)) - float(spring.energy(-1.5))
    mirrored = np.allclose(spring.force(-SAMPLES), -np.asarray(spring.force(SAMPLES)), rtol=0, atol=1e-14)
    assert spring.odd == mirrored
    assert (abs(integral) < 1e-14) == spring.odd


def test_stiffness_is_the_slope_of_the_force(spring):
    at = np.array([-1.713, -0.811, 0.217, 0.913, 1.618])  # away from breakpoints
    h = 1e-4
    slope = (8 * (spring.force(at + h) - spring.force(at - h)) - spring.force(at + 2 * h) + spring.force(at - 2 * h)) / (12 * h)
    np.testing.assert_allclose(spring.stiffness(at), slope, rtol=1e-8, atol=1e-9)


def test_expressions_are_force_and_energy(spring):
    """The sympy forms evaluate to the methods, and d(energy)/dq is the force."""
    force, energy = spring.expression(q), spring.energy_expression(q)
    for value in (-1.713, -0.811, 0.217, 1.618):
        assert math.isclose(float(force.subs(q, value)), float(spring.force(value)), rel_tol=1e-13, abs_tol=1e-15)
        assert math.isclose(float(energy.subs(q, value)), float(spring.energy(value)), rel_tol=1e-12, abs_tol=1e-14)
        slope = sp.diff(energy, q).subs(q, value).doit()
        assert math.isclose(float(slope), float(spring.force(value)), rel_tol=1e-12, abs_tol=1e-14)


@pytest.mark.parametrize("backend", ["llvm", "lambdify"])
def test_spring_in_a_system(spring, backend):
    """q'' = -F(q) as a System, from the force and from the energy: compiled force and slope are the methods'."""
    t = sp.Symbol("t", real=True)
    x = sp.Function("x")(t)
    newton = st.System.from_equations({x.diff(t, 2): -spring.expression(x)}, coordinates=[x], parameters={})
    lagrange = st.System.from_lagrangian(x.diff(t) ** 2 / 2 - spring.energy_expression(x), coordinates=[x], parameters={})
    at = np.linspace(-1.931, 1.877, 37)
    states = np.column_stack([at, 0.3 + 0.0 * at])
    for system in (newton, lagrange):
        values, slopes = evaluator(system, backend).FJ(np.zeros(len(at)), states, np.zeros(0))
        np.testing.assert_allclose(values[:, 1], -spring.force(at), rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(slopes[:, 1, 0], -spring.stiffness(at), rtol=1e-12, atol=1e-12)
    again = st.System.from_dict(newton.to_dict())
    assert again == newton and np.all(again(0.0, states.T) == newton(0.0, states.T))


def test_printed_forms_of_the_source_fail():
    """Errata (4), (6) inner lines, (3)-(6) for s < 0, section 3.1: the printed energies do not give the force; ours do."""
    k1, kn, third = sp.symbols("k1 kn D3", real=True)
    force = k1 * q + kn * q**3
    spring = models.PowerLawSpring(1.0, 1.0)
    ours = spring.energy_expression(q, {"k1": k1, "k3": kn})
    assert sp.simplify(sp.diff(ours, q) - force) == 0
    printed_4 = k1 / 2 + kn / 4 * q**4  # (4): q^2 is missing in the first term
    assert sp.simplify(sp.diff(printed_4, q) - force) == -k1 * q
    printed_6 = k1 * q**2 / 2 + kn / 4 * third * q**4  # (6): a factor k_n too many
    assert sp.simplify(sp.diff(printed_6, q) - (k1 * q + third * q**3)) != 0
    printed_45 = spring.energy_expression(q).subs(q, 2)  # section 3.1: "n = 2" has the energy k q^3/3, not k q^4/4
    assert float(printed_45) == 6.0 != float(models.PowerLawSpring(1.0, 1.0, n=2).energy(2.0))
    with np.errstate(invalid="ignore"):  # (3): q^n is no number for q < 0 and n = 1.5; sign(q)|q|^n is
        assert np.isnan(np.power(-2.0, 1.5))
    assert float(models.PowerLawSpring(0.0, 1.0, n=1.5).force(-2.0)) == -(2.0**1.5)


# ---- expressions with symbols


def test_symbols_replace_parameters():
    k1, k3 = sp.symbols("k1 k3", real=True)
    spring = models.PowerLawSpring(k1=2.0, kn=5.0)
    assert spring.expression(q, {"k1": k1, "k3": k3}) == k1 * q + k3 * q**3
    assert spring.energy_expression(q, {"k1": k1, "k3": k3}) == k1 * q**2 / 2 + k3 * q**4 / 4
    assert models.PowerLawSpring(1.0, 2.0, n=5, motion="rotation").parameters == {"D1": 1.0, "D5": 2.0}
    with pytest.raises(UnknownNameError, match="did you mean 'k3'"):
        spring.expression(q, {"k33": k3})


def test_sum_renames_parameters_that_occur_twice():
    total = models.PowerLawSpring(1.0, 2.0) + models.UnilateralSpring(3.0)
    assert total.parameters == {"k1_1": 1.0, "k3_1": 2.0, "k1_2": 3.0, "k3_2": 0.0}
    c = sp.Symbol("c", real=True)
    assert total.expression(q, {"k1_2": c}).coeff(c) == 0  # c sits inside the Piecewise
    assert total.expression(q, {"k1_2": c}).subs({c: 3.0, q: -0.5}) == float(total.force(-0.5))


# ---- escape and rest positions


def test_softening_escape():
    """|q| = sqrt(k1/|k3|): no force there, the energy has its maximum, and larger amplitudes are refused."""
    spring = models.PowerLawSpring(k1=250.0, kn=-4e6)
    edge = math.sqrt(250.0 / 4e6)
    np.testing.assert_allclose(spring.escape, (-edge, edge), rtol=1e-15)
    assert abs(float(spring.force(edge))) < 1e-12 and float(spring.stiffness(edge)) < 0.0
    assert math.isclose(float(spring.energy(edge)), 250.0**2 / (4 * 4e6), rel_tol=1e-14)
    with pytest.raises(InputError, match=r"amplitude must stay inside the well.*below 0.00790569"):
        spring.backbone(edge, 0.02)
    assert models.PowerLawSpring(k1=250.0, kn=4e6).escape == (-math.inf, math.inf)


def test_even_power_escapes_on_one_side():
    np.testing.assert_allclose(models.PowerLawSpring(k1=2.0, kn=0.5, n=2).escape, (-4.0, math.inf))
    np.testing.assert_allclose(models.PowerLawSpring(k1=2.0, kn=-0.5, n=2).escape, (-math.inf, 4.0))


def test_bistable_rest_and_escape():
    """-q + q^3 rests at 1 and escapes over 0; its linear frequency is sqrt(2)."""
    for spring in (models.PowerLawSpring(-1.0, 1.0), models.PolynomialSpring((0.0, -1.0, 0.0, 1.0))):
        assert math.isclose(spring.rest, 1.0, rel_tol=1e-15) and spring.escape == (0.0, math.inf)
        assert math.isclose(float(spring.backbone(0.0, 1.0)), math.sqrt(2.0), rel_tol=1e-14)


def test_spring_that_does_not_restore_is_refused():
    with pytest.raises(InputError, match="no stable rest position"):
        _ = models.UnilateralSpring(k1=100.0).rest
    with pytest.raises(InputError, match="no stable rest position"):
        models.PolynomialSpring((0.0, -1.0)).backbone(0.1, 1.0)


def test_unilateral_spring_under_a_weight():
    """k1 |q| + k3 |q|^3 = m g; thrown high, the flight time rules: frequency below 1/(2 sqrt(2 H/g))."""
    m, g = 0.02, 9.81
    spring = models.UnilateralSpring(k1=315.827, k3=1.9e7) + models.PolynomialSpring((m * g,))
    root = next(r.real for r in np.roots([1.9e7, 0.0, 315.827, -m * g]) if abs(r.imag) < 1e-12)
    assert math.isclose(spring.rest, -root, rel_tol=1e-12)
    heights = np.array([3.65e-3, 7.3e-3, 0.1])
    bound = 1.0 / (2.0 * np.sqrt(2.0 * heights / g))
    frequency = spring.backbone(heights / 2.0, m) / (2 * np.pi)
    assert np.all(frequency < bound) and frequency[-1] > 0.9 * bound[-1]
    np.testing.assert_allclose(bound[:2], (18.33, 12.96), atol=5e-3)  # the two limits of errata A.3


# ---- backbones


@pytest.mark.parametrize("k3", [1.0, -1.0, 100.0])
def test_cubic_backbone_is_the_elliptic_closed_form(k3):
    from scipy.special import ellipk

    spring, m = models.PowerLawSpring(k1=2.0, kn=k3), 0.5
    a = np.array([1e-3, 0.1, 0.7, 0.9, 1.3])
    a = a[a < spring.escape[1]]
    w1, kap = 4.0, k3 / m
    exact = 2 * np.pi / (4 * ellipk(kap * a**2 / (2 * (w1 + kap * a**2))) / np.sqrt(w1 + kap * a**2))
    np.testing.assert_allclose(spring.backbone(a, m), exact, rtol=1e-14)
    np.testing.assert_allclose(spring.backbone(a, m, "quadrature"), exact, rtol=1e-13)
    np.testing.assert_allclose(spring.backbone(a, m, "harmonic balance"), np.sqrt(w1 + 0.75 * kap * a**2), rtol=1e-13)


@pytest.mark.parametrize("n", [-0.5, 0.1, 0.5, 1.5, 2.5, 5, 7])
def test_pure_power_backbone_is_the_gamma_closed_form(n):
    """m q'' + c sign(q)|q|^n = 0: T and the one-harmonic frequency in Gamma functions."""
    c, m, a = 2.0, 0.3, np.array([0.02, 1.0, 3.0])
    spring = models.PowerLawSpring(k1=0.0, kn=c, n=n)
    quarter = np.sqrt(m * (n + 1) / (2 * c)) * a ** ((1 - n) / 2) * math.sqrt(math.pi) / (n + 1)
    exact = 2 * np.pi / (4 * quarter * gamma(1 / (n + 1)) / gamma(1 / (n + 1) + 0.5))
    np.testing.assert_allclose(spring.backbone(a, m), exact, rtol=1e-12)
    harmonic = c / m * a ** (n - 1) * 2 / math.sqrt(math.pi) * gamma(1 + n / 2) / gamma(1.5 + n / 2)
    np.testing.assert_allclose(spring.backbone(a, m, "harmonic balance"), np.sqrt(harmonic), rtol=1e-12)


def test_play_and_bilinear_backbones():
    """Play g: T = 2 pi/w + 4 g/(w (a - g)). Bilinear spring: the mean of the two half periods, at every amplitude."""
    m, k, g = 0.02, 2e4, 1e-3
    w, a = math.sqrt(k / m), np.array([1.2e-3, 2e-3, 9e-3])
    play = models.PiecewiseSpring.from_stiffness((-g, g), (k, 0.0, k))
    np.testing.assert_allclose(play.backbone(a, m), 2 * np.pi / (2 * np.pi / w + 4 * g / (w * (a - g))), rtol=1e-12)
    bilinear = models.PiecewiseSpring.from_stiffness((0.0,), (100.0, 400.0))
    halves = math.pi / math.sqrt(100.0 / m) + math.pi / math.sqrt(400.0 / m)
    np.testing.assert_allclose(bilinear.backbone(a, m), 2 * np.pi / halves, rtol=1e-12)


def test_quadratic_term_softens_by_lindstedt():
    """w = w1 + (3 k3/(8 m w1) - 5 k2^2/(12 m^2 w1^3)) a^2 + O(a^4); the printed rule 'k_n > 0 hardens' fails for n = 2."""
    m, k1, k2, k3 = 0.5, 2.0, 0.6, 0.2
    spring, w1 = models.PolynomialSpring((0.0, k1, k2, k3)), 2.0
    slope = 3 * k3 / (8 * m * w1) - 5 * k2**2 / (12 * m**2 * w1**3)
    a = np.array([0.02, 0.04])
    rest = spring.backbone(a, m) - (w1 + slope * a**2)
    assert math.isclose(rest[1] / rest[0], 16.0, rel_tol=0.02)  # what is left is of fourth order
    for kn in (0.3, -0.3):
        assert float(models.PowerLawSpring(1.0, kn, n=2).backbone(0.5, 1.0)) < 1.0


@pytest.mark.parametrize("name", ["even", "table", "dipole", "rotor", "sum", "pieces"])
def test_backbone_against_time_integration(name):
    """Second method: DOP853 from the upper turning point over one period comes back to it."""
    from scipy.integrate import solve_ivp

    spring, m, a = SPRINGS[name], 0.7, 0.6
    from stability.models._spring_motion import turning_points

    lower, upper = turning_points(spring, a)
    assert math.isclose(upper - lower, 2 * a, rel_tol=1e-12)
    assert math.isclose(float(spring.energy(upper)), float(spring.energy(lower)), rel_tol=1e-9, abs_tol=1e-12)
    tolerance = 1e-6 if name in ("table", "pieces") else 1e-9  # the integrator steps over kinks of F'
    period = 2 * math.pi / float(spring.backbone(a, m))

    def turns(_, x):
        return x[1]

    turns.direction = -1.0  # velocity falls through zero at the upper turning point only
    motion = solve_ivp(
        lambda _, x: [x[1], -float(spring.force(x[0])) / m], (0, 1.3 * period), [upper, 0.0],
        method="DOP853", rtol=1e-12, atol=1e-13, max_step=period / 50, events=turns,
    )  # fmt: skip
    back = [t for t in motion.t_events[0] if t > 0.5 * period]
    assert math.isclose(back[0], period, rel_tol=tolerance)
    assert math.isclose(float(np.min(motion.y[0])), lower, abs_tol=2e-3 * a)


@settings(max_examples=30, deadline=None)
@given(
    n=some.floats(0.3, 6.0).filter(lambda n: abs(n - 1) > 0.05),
    stretch=some.floats(0.1, 10.0),
    inertia=some.floats(0.01, 10.0),
)
def test_backbone_scales_with_units(n, stretch, inertia):
    """Lengths times s: kn/s^(n-1) at amplitude s a has the same frequency; inertia enters as 1/sqrt."""
    one = models.PowerLawSpring(k1=1.0, kn=0.8, n=n).backbone(0.7, 1.0, "quadrature")
    other = models.PowerLawSpring(k1=1.0, kn=0.8 / stretch ** (n - 1), n=n).backbone(0.7 * stretch, inertia, "quadrature")
    assert math.isclose(float(other) * math.sqrt(inertia), float(one), rel_tol=1e-11)


# ---- piecewise and tabulated


def test_piecewise_energy_is_continuous_across_jumps():
    spring = models.PiecewiseSpring((-1.0, 1.0), ((-2.0, 1.0), (0.0, 3.0), (5.0, 1.0)))
    np.testing.assert_allclose(spring.jumps, (3.0 * -1.0 - (-3.0), 6.0 - 3.0))
    eps = 1e-9
    for b in (-1.0, 1.0):
        assert abs(float(spring.energy(b + eps) - spring.energy(b - eps))) < 1e-7
    assert float(spring.energy(2.0)) == 1.5 + 5.0 + 1.5
    push = models.PiecewiseSpring((0.0,), ((-1.0,), (1.0,)))  # F = sign(q): T = 4 sqrt(2 m a)
    assert push.rest == 0.0
    assert math.isclose(float(push.backbone(0.5, 2.0)), 2 * math.pi / (4 * math.sqrt(2 * 2.0 * 0.5)), rel_tol=1e-13)


def test_tabulated_spring_is_monotone_and_exact():
    """No overshoot; antiderivative equals scipy's PCHIP antiderivative; a cubic through a quintic table is exact."""
    from scipy.interpolate import PchipInterpolator

    x = np.array([-3.0, -1.0, -0.2, 0.0, 0.4, 1.0, 3.0])
    f = np.array([-5.0, -4.9, -0.3, 0.0, 0.1, 2.0, 2.1])
    spring, fine = models.TabulatedSpring(x, f), np.linspace(-3.0, 3.0, 3001)
    assert np.all(np.diff(spring.force(fine)) >= -1e-15) and np.all(spring.stiffness(fine) >= -1e-12)
    integral = PchipInterpolator(x, f).antiderivative()
    np.testing.assert_allclose(spring.energy(fine), integral(fine) - integral(0.0), atol=1e-13)
    cubic = models.TabulatedSpring(SAMPLES, SAMPLES + SAMPLES**3, method="quintic")
    law = models.PowerLawSpring(1.0, 1.0)
    np.testing.assert_allclose(cubic.backbone([0.3, 1.5], 1.0), law.backbone([0.3, 1.5], 1.0), rtol=1e-12)
    assert cubic.fit_error == 0.0 and spring.escape == (-math.inf, math.inf)


def test_tabulated_spring_refuses_to_leave_its_data():
    spring = SPRINGS["table"]
    with pytest.raises(InputError, match=r"displacement must stay in \[-2, 2\] m \(end of the data\); got 2.5"):
        spring.force([0.0, 2.5])
    with pytest.raises(InputError, match="end of data"):
        spring.backbone(2.1, 1.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: models.PowerLawSpring(k1=1.0, kn=1.0, n=-1.0), "n must be > -1"),
        (lambda: models.PowerLawSpring(k1=1.0, kn=1.0, n=1), "not 1"),
        (lambda: models.PowerLawSpring(k1=math.nan), "k1 must be a finite number"),
        (lambda: models.PowerLawSpring(k1="stiff"), "k1 must be a number"),
        (lambda: models.PowerLawSpring(k1=1.0, motion="linear"), "motion must be one of 'translation', 'rotation'"),
        (lambda: models.PolynomialSpring(()), "coefficients must be"),
        (lambda: models.PolynomialSpring((1.0, math.inf)), r"coefficients\[1\] must be a finite"),
        (lambda: models.PiecewiseSpring((1.0, 1.0), ((0.0,),) * 3), "strictly increasing"),
        (lambda: models.PiecewiseSpring((1.0,), ((0.0,),)), "1 breakpoints need 2 pieces; got 1"),
        (lambda: models.PiecewiseSpring.from_stiffness((1.0,), (1.0,)), "need 2 stiffnesses"),
        (lambda: models.UnilateralSpring(1.0, side="left"), "side must be one of"),
        (lambda: models.TabulatedSpring((0.0, 1.0), (0.0,)), "2 displacements but 1 forces"),
        (lambda: models.TabulatedSpring((0.0, 0.0), (0.0, 1.0)), "strictly increasing"),
        (lambda: models.TabulatedSpring((1.0, 2.0), (0.0, 1.0)), "around 0"),
        (lambda: models.PowerLawSpring(1.0).backbone(-1.0, 1.0), "amplitude must be >= 0"),
        (lambda: models.PowerLawSpring(1.0).backbone(1.0, 0.0), "inertia must be > 0 kg"),
        (lambda: models.PowerLawSpring(1.0).backbone(1.0, 1.0, "hb"), "method must be one of"),
        (lambda: models.PowerLawSpring(1.0) + models.PowerLawSpring(1.0, motion="rotation"), "in parallel"),
        (lambda: models.PowerLawSpring(0.0, 1.0, n=0.5).backbone(0.0, 1.0), "no linear frequency"),
    ],
)
def test_mistakes_are_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_springs_are_frozen_and_compare_by_content():
    assert models.PowerLawSpring(1.0, 2.0) == models.PowerLawSpring(1.0, 2.0, n=3)
    assert hash(SPRINGS["table"]) == hash(models.TabulatedSpring(SAMPLES, SAMPLES + 0.2 * SAMPLES**2))
    with pytest.raises(AttributeError):
        SPRINGS["linear"].k1 = 2.0
