"""Criticality: planted normal forms with known coefficients, closed forms, and the direction and stability of new branches."""

import numpy as np
import planted_normal_forms as plant
import pytest
import sympy as sp

import stability as st
from stability.problems.criticality import criticality_of
from stability.words import Criticality, Kind, Verdict

CASES = [  # form, frame, kind
    ("pair", "equilibrium", Kind.HOPF),
    ("single", "equilibrium", Kind.BRANCH_POINT),
    ("pair", "torus", Kind.NEIMARK_SACKER),
    ("single", "doubling", Kind.PERIOD_DOUBLING),
]


def expected(values, form, kind):
    """(coefficient, word) of the planted case: of the field, or of the map of one period."""
    c, T = plant.effective(values), 2 * np.pi / values["Omega"]
    length = float(np.linalg.norm(plant.critical_vector(values, form)) ** 2)
    number = {
        Kind.HOPF: 2 * c / values["w"], Kind.BRANCH_POINT: c, Kind.NEIMARK_SACKER: 2 * c * T,
        Kind.PERIOD_DOUBLING: -c * T,
    }[kind] / length  # fmt: skip
    return number, Criticality.SUPERCRITICAL if c < 0 else Criticality.SUBCRITICAL


def check(form, frame, kind, seed):
    values = plant.random_values(seed)
    if frame == "equilibrium":
        values |= {"v1": 0.0, "v2": 0.0, "v3": 0.0}
    system = plant.planted(form, frame).with_params(**values)
    params = system.parameter_vector()
    if frame == "equilibrium":
        problem, u = st.Equilibrium(system), np.zeros(3)
    else:
        angle = np.exp(2j * np.pi * values["w"] / values["Omega"])
        if kind is Kind.NEIMARK_SACKER and min(abs(angle**k - 1) for k in (1, 2, 3, 4)) < 1e-2:
            return False
        problem = st.Collocation(system, degree=6)
        u = problem.start(params, (plant.orbit(values), 2 * np.pi / values["Omega"]))
    found = criticality_of(problem, kind, u, params)
    number, word = expected(values, form, kind)
    assert found.criticality is word, (seed, found, number)
    assert found.coefficient == pytest.approx(number, rel=1e-5), seed
    return True


@pytest.mark.parametrize(("form", "frame", "kind"), CASES, ids=lambda c: str(c))
def test_planted_coefficients(form, frame, kind):
    assert sum(check(form, frame, kind, seed) for seed in range(100)) > 90


@pytest.mark.slow
@pytest.mark.parametrize(("form", "frame", "kind"), CASES, ids=lambda c: str(c))
def test_many_planted_coefficients(form, frame, kind):
    assert sum(check(form, frame, kind, seed) for seed in range(1000, 1500)) > 450


# ---------------------------------------------------------------------- closed forms and the new branches themselves
def test_hopf_points_of_textbooks():
    """Lorenz: subcritical at sigma = 10, b = 8/3 (Kuznetsov 2004, exercise 5.6.3); van der Pol, a linear centre at mu = 0."""
    branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14))
    assert branch["HB1"].criticality is Criticality.SUBCRITICAL and "subcritical" in repr(branch["HB1"])
    trivial = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (0.0, 3.0))
    assert trivial["BP1"].criticality is Criticality.SUPERCRITICAL
    centre = st.continuation(st.Equilibrium(st.models.van_der_pol()), "mu", (-1.0, 1.0))["HB1"]
    assert centre.criticality is Criticality.DEGENERATE


def test_fold_transcritical_and_cusp():
    """x' = r - x^2, r x - 2 x^2, r - x^3: folds and transcritical points have a quadratic coefficient, a cusp none."""
    r, x = sp.symbols("r x", real=True)

    def system(f, **parameters):
        return st.System(name="one", coordinates=("x",), states=("x",), parameters=parameters, rhs=(f,))

    fold = st.continuation(st.Equilibrium(system(r - x**2, r=1.0)), "r", (1.0, -1.0))["LP1"]
    assert fold.criticality is None and abs(fold.coefficient) == pytest.approx(1.0)
    crossing = st.continuation(st.Equilibrium(system(r * x - 2 * x**2, r=-1.0)), "r", (-1.0, 1.0))["BP1"]
    assert crossing.criticality is None and abs(crossing.coefficient) == pytest.approx(2.0)
    cusp = criticality_of(st.Equilibrium(system(r - x**3, r=0.0)), Kind.FOLD, np.zeros(1), np.zeros(1))
    assert cusp.criticality is Criticality.DEGENERATE


def test_cycles_born_and_lost_by_an_autonomous_orbit():
    """z' = (1 + i) z - |z|^2 z with w' = a w + c w^3 beside it: pitchfork of the unit circle, coefficient of its map c T.

    With w turned half around the circle (w1 + i w2 = w exp(i phi/2)) it is a period doubling, -c T.
    """
    a, c, x, y, w = sp.symbols("a c x y w", real=True)
    r = x**2 + y**2
    growth = 1 - r + 3 * w**2 / 10
    for value in (-0.7, 0.4):
        system = st.System(
            name="circle", coordinates=("x", "y", "w"), states=("x", "y", "w"), parameters={"a": -0.1, "c": value},
            rhs=(growth * x - y, growth * y + x, a * w + c * w**3 + w * (r - 1)),
        )  # fmt: skip
        circle = (lambda t: np.array([np.cos(t), np.sin(t), 0 * t]), 2 * np.pi)
        problem = st.Collocation(system)
        params = system.parameter_vector(a=0.0)
        u = problem.start(params, circle)
        found = criticality_of(problem, Kind.BRANCH_POINT, u, params)
        # r - 1 follows 3 w^2 / 20 .. on the centre manifold: (1 - r) r + 0.3 w^2 r = 0 at r = 1 + 0.3 w^2 in r = |z|^2
        effective = value + 0.3
        assert found.coefficient == pytest.approx(2 * np.pi * effective, rel=1e-6)
        assert found.criticality is (Criticality.SUBCRITICAL if effective > 0 else Criticality.SUPERCRITICAL)


@pytest.mark.parametrize("method", [st.Collocation, st.HarmonicBalance, st.Shooting], ids=lambda m: m.__name__)
def test_the_doubling_of_a_parametric_oscillator_by_averaging(method):
    """q'' + 2 delta q' + (a + b cos t) q + beta q^3 = 0 at its upper boundary: the sign of beta decides.

    The response at half the frequency follows a + 3/4 beta A^2 = 1/4: with beta > 0 it leaves both boundaries towards
    smaller a, into the tongue at the upper one (supercritical), out of it at the lower one (subcritical).
    """
    t, a, b, delta, beta = sp.symbols("t a b delta beta", real=True)
    q = sp.Function("q")(t)

    def doublings(value):
        system = st.System.from_equations(
            {q.diff(t, 2): -2 * delta * q.diff(t) - (a + b * sp.cos(t)) * q - beta * q**3}, coordinates=[q],
            parameters={"a": 0.1, "b": 0.2, "delta": 0.02, "beta": value}, period=2 * sp.pi,
        )  # fmt: skip
        return st.continuation(method(system), "a", (0.0, 0.5)).of_kind(Kind.PERIOD_DOUBLING)

    for value in (0.5, -0.5):
        words = [p.criticality for p in doublings(value)]
        both = [Criticality.SUBCRITICAL, Criticality.SUPERCRITICAL]
        assert words == (both if value > 0 else both[::-1])


def test_directions_of_the_branches_born_at_the_pendulums_doublings():
    """Supercritical: the new orbits are stable beside a point where the old ones lose stability; subcritical: unstable."""
    seen = []
    for ratio, mass in ((10.0, 0.2), (50.0, 0.1), (100.0, 0.2)):
        system = st.models.autoparametric_pendulum(
            xi1=0.02, xi2=0.01, Omega0=0.5, length_ratio=ratio, mass_ratio_total=mass
        )
        semi = st.continuation(st.Collocation(system), "Omega", (0.5, 1.6))
        for point in semi.of_kind(Kind.PERIOD_DOUBLING):
            born = st.continuation(st.switch(point), "Omega", (0.5, 1.6), max_points=4, ds=1e-3, ds_max=1e-3)
            wanted = Verdict.STABLE if point.criticality is Criticality.SUPERCRITICAL else Verdict.UNSTABLE
            assert born.verdicts[-1] is wanted, point
            inside = (born.parameter[-1] > point.params["Omega"]) == (point.label == "PD1")
            assert inside == (point.criticality is Criticality.SUPERCRITICAL), point
            seen.append(point.criticality)
    assert len(seen) == 6 and Criticality.SUBCRITICAL in seen


def test_words_survive_a_file(tmp_path):
    branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14))
    branch.save(tmp_path / "lorenz.npz")
    again = st.load(tmp_path / "lorenz.npz")["HB1"]
    assert again.criticality is Criticality.SUBCRITICAL and again.coefficient == branch["HB1"].coefficient


@pytest.mark.parametrize("e", [0.0, 1.5, -0.5])
def test_torus_points_of_an_autonomous_orbit_by_its_reduction(e):
    """Langford's system without its symmetry-breaking term: (|z|^2, w) is planar, the torus point its Hopf point.

    It stands at m = 1.175 (0.49 + 0.48566667/4.7), whatever e is; a large e > 0 makes it subcritical.
    """
    m, x, y, w, r = sp.symbols("m x y w r", real=True)

    def axial(rho):
        return sp.Rational(3, 5) + m * w - w**3 / 3 - rho * (1 + w / 4) + e * (w - sp.Rational(7, 10)) ** 3

    spin, names = w - sp.Rational(7, 10), ("x", "y", "w")
    full = st.System(
        name="langford", coordinates=names, states=names, parameters={"m": 0.95},
        rhs=(spin * x - 3.5 * y, 3.5 * x + spin * y, axial(x**2 + y**2)),
    )  # fmt: skip
    plane = st.System(
        name="plane", coordinates=("r", "w"), states=("r", "w"), parameters={"m": 0.95}, rhs=(2 * spin * r, axial(r))
    )
    hopf = st.continuation(st.Equilibrium(full), "m", (-1.0, 1.0), start=dict(w=0.5))["HB1"]
    torus = st.continuation(st.switch(hopf), "m", (-1.0, 2.5))["NS1"]
    below = st.continuation(st.Equilibrium(plane), "m", (-0.5, 2.5), start=dict(r=0.1, w=0.7))["HB1"]
    assert torus.params["m"] == pytest.approx(below.params["m"], abs=1e-8)
    assert torus.params["m"] == pytest.approx(1.175 * (0.49 + (0.6 - 0.343 / 3) / 4.7), abs=1e-9)
    assert torus.criticality is below.criticality
    assert torus.criticality is (Criticality.SUBCRITICAL if e > 1 else Criticality.SUPERCRITICAL)


def test_doubling_of_the_roessler_cycle():
    """Supercritical: the doubled cycle is stable and lies beyond; its curve over (c, a) meets a separate branch."""
    a, b, c, x, y, z = sp.symbols("a b c x y z", real=True)
    system = st.System(
        name="roessler", coordinates=("x", "y", "z"), states=("x", "y", "z"), parameters={"a": 0.2, "b": 0.2, "c": 2.0},
        rhs=(-y - z, x + a * y, b + z * (x - c)),
    )  # fmt: skip

    def doubling(value):
        problem = st.Collocation(system.with_params(a=value))
        return st.continuation(problem, "c", (2.0, 3.2), start=dict(x=1, y=1, z=0))["PD1"]

    point = doubling(0.2)
    born = st.continuation(st.switch(point), "c", (2.0, 3.2), max_points=4)
    assert point.criticality is Criticality.SUPERCRITICAL
    assert born.verdicts[1] is Verdict.STABLE and born.parameter[-1] > point.params["c"]
    curve = st.continuation(st.locus(point, free="a"), "c", (2.0, 3.2))
    here = curve.at(c=doubling(0.22).params["c"])
    assert here[0].params["a"] == pytest.approx(0.22, abs=2e-9)
