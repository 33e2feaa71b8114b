"""Points of codimension two on curves of special points: closed forms, planted cases, and two curves that meet in one point."""

import numpy as np
import planted_normal_forms as plant
import pytest
import sympy as sp

import stability as st
from stability.words import Kind

a, b, x, y, u, v = sp.symbols("a b x y u v", real=True)


def reaction(**params):
    """A -> B: x' = -x + D (1 - x) e^y, y' = -y + B D (1 - x) e^y - beta y (the `ab` demo of AUTO-07p)."""
    D, B, beta = sp.symbols("D B beta", real=True)
    rate = D * (1 - x) * sp.exp(y)
    return st.System(
        name="reaction", coordinates=("x", "y"), states=("x", "y"), parameters={"D": 0.0, "B": 14.0, "beta": 2.0} | params,
        rhs=(-x + rate, -y + B * rate - beta * y),
    )  # fmt: skip


def test_cusp_and_bogdanov_takens_of_the_reaction():
    """Cusp at (D, beta) = (e^-2, 2.5), Bogdanov-Takens at (0.109543268, 2.0731849); both curves meet in the latter kind."""
    branch = st.continuation(st.Equilibrium(reaction()), "D", (0.0, 0.4))
    folds = st.continuation(st.locus(branch["LP1"], free="beta"), "D", (0.0, 0.6))
    (cusp,) = folds.of_kind(Kind.CUSP)
    assert cusp.params["D"] == pytest.approx(np.exp(-2), abs=1e-10)
    assert cusp.params["beta"] == pytest.approx(2.5, abs=1e-9)
    double = max(folds.of_kind(Kind.BOGDANOV_TAKENS), key=lambda p: p.params["D"])
    assert double.params["D"] == pytest.approx(0.109543268, abs=5e-10)
    assert double.params["beta"] == pytest.approx(2.0731849, abs=5e-8)
    values = {sp.Symbol(name, real=True): value for name, value in double.params.items()}
    J = sp.Matrix(reaction().rhs).jacobian([x, y]).subs(values | {x: double.solution["x"], y: double.solution["y"]})
    assert abs(float(J.trace())) < 1e-8 and abs(float(J.det())) < 1e-8
    folds = st.continuation(st.locus(branch["LP1"], free="B"), "D", (0.05, 0.2))
    hopf = st.continuation(st.locus(branch["HB1"], free="B"), "D", (0.05, 0.3))
    one, other = folds["BT1"], hopf["BT1"]
    assert one.params["D"] == pytest.approx(other.params["D"], abs=1e-9)
    assert one.params["B"] == pytest.approx(other.params["B"], abs=1e-7)
    assert folds["CP1"].params["B"] == pytest.approx(12.0, abs=1e-9)  # 4 (1 + beta)


def test_bautin_point_of_the_quintic_hopf_normal_form():
    """z' = (a + i) z + b |z|^2 z - |z|^4 z: the coefficient vanishes at b = 0 on a = 0."""
    rho = x**2 + y**2
    growth = a + b * rho - rho**2
    system = st.System(
        name="bautin", coordinates=("x", "y"), states=("x", "y"), parameters={"a": -0.3, "b": 1.0},
        rhs=(growth * x - y, growth * y + x),
    )  # fmt: skip
    hopf = st.continuation(st.Equilibrium(system), "a", (-0.3, 0.3))["HB1"]
    curve = st.continuation(st.locus(hopf, free="a", along="b"), "b", (-1.0, 1.5))
    assert curve.labels.count("GH1") == 1 and len(curve.special) == 2
    assert abs(curve["GH1"].params["b"]) < 1e-9


def test_zero_hopf_and_double_hopf():
    """Pairs growing with a + u, u' = b - u^2: the Hopf curve b = a^2 touches the folds b = 0; two pairs of growth a and b."""
    pair = ((a + u - x**2 - y**2) * x - y, (a + u - x**2 - y**2) * y + x, b - u**2)
    system = st.System(
        name="zh", coordinates=("x", "y", "u"), states=("x", "y", "u"), parameters={"a": -1.2, "b": 1.0}, rhs=pair
    )
    branch = st.continuation(st.Equilibrium(system), "a", (-2.0, 0.0), start=dict(u=1.0))
    curve = st.continuation(st.locus(branch["HB1"], free="b"), "a", (-1.5, 1.0))
    assert np.abs(curve.columns["b"] - curve.columns["a"] ** 2).max() < 1e-10
    found = {p.kind: p for p in curve.special if p.kind is not Kind.USER}
    assert set(found) == {Kind.ZERO_HOPF, Kind.EXTREMUM} and len(curve.special) == 3
    assert all(abs(point.params["a"]) < 1e-8 for point in found.values())
    r, s = x**2 + y**2, u**2 + v**2
    pairs = ((a - r) * x - y, (a - r) * y + x, (b - s) * u - 2 * v, (b - s) * v + 2 * u)
    names = ("x", "y", "u", "v")
    system = st.System(name="hh", coordinates=names, states=names, parameters={"a": -1.0, "b": -0.5}, rhs=pairs)
    hopf = st.continuation(st.Equilibrium(system), "a", (-1.0, 1.0))["HB1"]
    curve = st.continuation(st.locus(hopf, free="a", along="b"), "b", (-0.7, 0.9))
    assert abs(curve["HH1"].params["b"]) < 1e-9 and abs(curve["HH1"].params["a"]) < 1e-10


# ---------------------------------------------------------------------- orbits: planted in periodic, nonlinear coordinates
def curve_of(form, frame, kind, free, along, window, seed, **given):
    """The planted curve that starts at the given point."""
    values = plant.random_values(seed) | given
    system = plant.planted(form, frame).with_params(**values)
    problem = st.Collocation(system, degree=6)
    start = plant.orbit(values)
    first = st.continuation(
        problem, free, (values[free] - 0.05, values[free] + 0.05), start=(start, 2 * np.pi / values["Omega"])
    )
    point = min(first.of_kind(kind), key=lambda p: abs(p.params[free] - values[free]))
    assert point.params[free] == pytest.approx(values[free], abs=1e-7)
    return values, st.continuation(st.locus(point, free=free, along=along), along, window)


@pytest.mark.parametrize("seed", range(3))
def test_strong_resonances_of_the_torus_curve(seed):
    """Angle w T on a = 0: 1:3 at w = Omega/3, 1:4 at w = Omega/4."""
    values = plant.random_values(seed)
    W = values["Omega"]
    _, curve = curve_of("pair", "torus", Kind.NEIMARK_SACKER, "a", "w", (0.2 * W, 0.4 * W), seed, w=0.3 * W)
    assert curve.columns["torus_angle"] == pytest.approx(2 * np.pi * curve.columns["w"] / W, abs=1e-8)
    assert curve["R4_1"].params["w"] == pytest.approx(W / 4, abs=1e-9)
    assert curve["R3_1"].params["w"] == pytest.approx(W / 3, abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_coefficients_that_vanish(seed):
    """c + e m / k = 0 on a = 0: Chenciner point of the torus curve, generalised period doubling of the other."""
    values = plant.random_values(seed)
    zero = -values["e"] * values["m"] / values["k"]
    window, away = (zero - 0.5, zero + 0.5), zero + 0.2
    W = values["Omega"]
    _, curve = curve_of("pair", "torus", Kind.NEIMARK_SACKER, "a", "c", window, seed, c=away, w=0.27 * W)
    assert curve["CH1"].params["c"] == pytest.approx(zero, abs=1e-6)
    _, curve = curve_of("single", "doubling", Kind.PERIOD_DOUBLING, "a", "c", window, seed, c=away)
    assert curve["GPD1"].params["c"] == pytest.approx(zero, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_double_multipliers(seed):
    """w = 0: multiplier -1 twice on the doubling curve (1:2), +1 twice on the fold curve (1:1), with one eigenvector."""
    _, curve = curve_of("takens", "doubling", Kind.PERIOD_DOUBLING, "a", "w", (-0.3, 0.4), seed, w=0.2)
    assert [p.kind for p in curve.special if p.kind is not Kind.USER] == [Kind.R2]
    assert abs(curve["R2_1"].params["w"]) < 1e-8
    _, curve = curve_of("nilfold", "torus", Kind.FOLD, "a", "w", (-0.3, 0.4), seed, w=0.2, a=0.0)
    assert Kind.R1 in {p.kind for p in curve.special} and abs(curve["R1_1"].params["w"]) < 1e-8


def test_fold_flip():
    """Doubling where a + u = 0 beside a fold u^2 = m: the curve m = a^2 touches the fold curve at a = 0."""
    values = plant.random_values(1)
    system = plant.planted("folding", "doubling").with_params(**values | {"m": 0.09, "a": -0.35})
    start = (plant.orbit(values), 2 * np.pi / values["Omega"])
    branch = st.continuation(st.Collocation(system, degree=6), "a", (-0.45, 0.1), start=start)
    point = branch.of_kind(Kind.PERIOD_DOUBLING)[0]
    assert abs(abs(point.params["a"]) - 0.3) < 1e-7
    curve = st.continuation(st.locus(point, free="m"), "a", (-0.4, 0.4))
    assert np.abs(curve.columns["m"] - curve.columns["a"] ** 2).max() < 1e-8
    assert abs(curve["FF1"].params["a"]) < 1e-7
