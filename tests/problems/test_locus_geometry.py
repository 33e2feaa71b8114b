"""Extrema, isolas and crossings of two-parameter curves against normal forms."""

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.words import Kind, Status

a, b, x, y = sp.symbols("a b x y", real=True)


def scalar(f, **parameters):
    return st.System(name="scalar", coordinates=("x",), states=("x",), parameters=parameters, rhs=(f,))


def kinds(curve):
    return sorted(str(p.kind) for p in curve.special if p.kind is not Kind.USER)


def folds(f, start, window=(-2.0, 2.0), **parameters):
    """The fold curve through the first fold of x' = f along a, with b free."""
    problem = st.Equilibrium(scalar(f, **parameters))
    branch = st.continuation(problem, "a", window, start=st.solve(problem, start=dict(x=start)))
    return st.continuation(st.locus(branch["LP1"], free="b"), "a", window)


@pytest.mark.parametrize("bend", [-0.5, 0.0, 0.8])
@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_birth_of_an_isola(bend, shift):
    """x^2 + a^2 = b, moved and bent: closed curves for b > 0, none for b < 0; the fold curve b = a^2 turns at (0, 0)."""
    z, away = x - shift + bend * a, a - shift
    curve = folds(-(z**2 + away**2 - b - b * z / 5), 1.0 + shift, a=shift, b=1.0)
    assert kinds(curve) == ["isola centre"]
    birth = curve.of_kind(Kind.ISOLA_CENTRE)[0]
    assert birth.label == "IC1"
    assert birth.params["a"] == pytest.approx(shift, abs=1e-7) and abs(birth.params["b"]) < 1e-12


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("bend", [-0.5, 0.0, 0.8])
def test_two_branches_that_meet_and_change_partners(bend, sign):
    """x^2 - a^2 = +-b: two branches on either side of b = 0, other ones; the folds of one sign of b disappear at 0."""
    z = x + bend * a
    curve = folds(-(z**2 - a**2 + sign * b + b * z / 5), 1.3 + 2 * abs(bend), a=2.0, b=sign * 1.0)
    assert kinds(curve) == ["isola merger"]
    point = curve.of_kind(Kind.ISOLA_MERGER)[0]
    assert abs(point.params["a"]) < 1e-7 and abs(point.params["b"]) < 1e-12


def test_an_isola_is_born_and_merges():
    """x^2 = b - V(a), V = a^2 (a - 1) (a + 0.6) + 0.05 a: minima of V are births, its maximum the merger."""
    V = a**2 * (a - 1) * (a + sp.Rational(3, 5)) + a / 20
    extreme = sorted(float(r) for r in sp.Poly(sp.diff(V, a), a).nroots() if abs(sp.im(r)) < 1e-12)
    curve = folds(b - V - x**2, 1.5, (-1.0, 1.5), a=0.0, b=1.0)
    found = sorted((p.params["a"], p.kind, p.params["b"]) for p in curve.special if p.kind is not Kind.USER)
    assert [kind for _, kind, _ in found] == [Kind.ISOLA_CENTRE, Kind.ISOLA_MERGER, Kind.ISOLA_CENTRE]
    assert [at for at, _, _ in found] == pytest.approx(extreme, abs=1e-7)
    assert [at for _, _, at in found] == pytest.approx([float(V.subs(a, r)) for r in extreme], abs=1e-12)


@pytest.mark.parametrize("half", [0.05, 0.02, 0.01])
def test_two_extrema_within_one_step(half):
    """V' = (a - 0.4)^2 - half^2: a merger and a birth at 0.4 -+ half, between points of the curve further apart."""
    V = a**3 / 3 - sp.Rational(2, 5) * a**2 + (sp.Rational(4, 25) - half**2) * a
    problem = st.Equilibrium(scalar(b - V - x**2, a=-0.9, b=1.0))
    branch = st.continuation(problem, "b", (1.5, -2.0), start=st.solve(problem, start=dict(x=1.2)))
    curve = st.continuation(st.locus(branch["LP1"], free="b", along="a"), "a", (-1.0, 1.5))
    found = [(p.kind, p.params["a"]) for p in curve.special if p.kind is not Kind.USER]
    assert [kind for kind, _ in found] == [Kind.ISOLA_MERGER, Kind.ISOLA_CENTRE]
    assert [at for _, at in found] == pytest.approx([0.4 - half, 0.4 + half], abs=1e-7)


@pytest.mark.parametrize("start", [0.003, 0.01, 0.02, 0.03, 0.05])
def test_a_closed_curve_that_is_met_close_to_its_turning_point(start):
    """Folds of x^2 = 1 - a^2 - b^2 from b = start: the last step passes a = 1 and the start, the parameter on one side."""
    problem = st.Equilibrium(scalar(1 - a**2 - b**2 - x**2, a=0.0, b=start))
    branch = st.continuation(problem, "a", (0.0, 1.5), start=st.solve(problem, start=dict(x=1.0)))
    curve = st.continuation(st.locus(branch["LP1"], free="b"), "a", (-2.0, 2.0))
    assert curve.status is Status.CLOSED_LOOP
    angle = np.unwrap(np.arctan2(curve.columns["b"], curve.columns["a"]))
    assert abs(angle[-1] - angle[0]) == pytest.approx(2 * np.pi, abs=2e-2)  # once, not several times
    assert np.abs(np.hypot(curve.columns["a"], curve.columns["b"]) - 1).max() < 1e-9


def test_isola_of_orbits():
    """r' = r (b - a^2 - (r^2 - 1)^2): cycles (r^2 - 1)^2 = b - a^2 are an isola, born at (0, 0)."""
    r2 = x**2 + y**2
    growth = b - a**2 - (r2 - 1) ** 2
    system = st.System(
        name="ring", coordinates=("x", "y"), states=("x", "y"), parameters={"a": 0.0, "b": 0.25},
        rhs=(growth * x - y, growth * y + x),
    )  # fmt: skip
    problem = st.Collocation(system)
    orbit = st.solve(problem, start=(lambda s: np.sqrt(1.5) * np.array([np.cos(s), np.sin(s)]), 2 * np.pi))
    branch = st.continuation(problem, "a", (-1.0, 1.0), start=orbit)
    assert branch.statuses == (st.Status.CLOSED_LOOP,) * 2 and len(branch.of_kind(Kind.FOLD)) == 2
    curve = st.continuation(st.locus(branch["LP1"], free="b"), "a", (-1.0, 1.0))
    assert np.abs(curve.columns["b"] - curve.columns["a"] ** 2).max() < 1e-9
    (birth,) = curve.of_kind(Kind.ISOLA_CENTRE)
    assert abs(birth.params["a"]) < 1e-6 and abs(birth.params["b"]) < 1e-9


def test_tip_of_a_tongue():
    """Hopf points of growth b - a^2 - 2 a^3/3: the least b is at a = 0; an extremum, no isola."""
    growth = b - a**2 - sp.Rational(2, 3) * a**3 - x**2 - y**2
    system = st.System(
        name="tip", coordinates=("x", "y"), states=("x", "y"), parameters={"a": -0.5, "b": 0.0},
        rhs=(growth * x - y, growth * y + x),
    )  # fmt: skip
    hopf = st.continuation(st.Equilibrium(system), "b", (0.0, 0.5))["HB1"]
    curve = st.continuation(st.locus(hopf, free="b", along="a"), "a", (-0.8, 0.8))
    assert kinds(curve) == ["extremum"]
    assert abs(curve["EX1"].params["a"]) < 1e-9 and abs(curve["EX1"].params["b"]) < 1e-14


@pytest.mark.parametrize("slope", [0.3, 1.0, -2.0])
def test_curves_that_cross(slope):
    """Growth (b - slope a)(b + a^2 + a/2) of a focus: two Hopf curves that cross at the origin, one branch point on each."""
    growth = (b - sp.Float(slope) * a) * (b + a**2 + a / 2) - x**2 - y**2
    system = st.System(
        name="cross", coordinates=("x", "y"), states=("x", "y"), parameters={"a": 0.4, "b": -1.0},
        rhs=(growth * x - y, growth * y + x),
    )  # fmt: skip
    branch = st.continuation(st.Equilibrium(system), "b", (-1.0, 1.5))
    for point in branch.of_kind(Kind.HOPF):
        curve = st.continuation(st.locus(point, free="b", along="a"), "a", (-0.9, 0.9))
        crossings = curve.of_kind(Kind.BRANCH_POINT)
        exact = [0.0, -0.5 - slope]
        want = sorted(v for v in exact if abs(v) < 0.9)
        assert sorted(p.params["a"] for p in crossings) == pytest.approx(want, abs=1e-6)


# ---------------------------------------------------------------------- windows of the second parameter
def fold_of_parabola():
    """The fold of x' = a - x^2 - b (x - 1) at b = 0.5."""
    problem = st.Equilibrium(scalar(a - x**2 - b * (x - 1), a=1.0, b=0.5))
    return st.continuation(problem, "a", (4.0, -4.0), start=dict(x=2.0))["LP1"]


@pytest.mark.parametrize("window", [(-1.5, 0.75), (0.75, -1.5), [-1.5, 0.75]])
def test_a_curve_ends_exactly_at_the_window_of_the_second_parameter(window, tmp_path):
    """Folds of x' = a - x^2 - b (x - 1): x = -b/2, a = -b^2/4 - b; both ends are on the walls, points as without."""
    point = fold_of_parabola()
    curve = st.continuation(st.locus(point, free="b", window=window), "a", (-4.0, 4.0))
    b_, a_ = curve.columns["b"], curve.columns["a"]
    assert sorted((b_[0], b_[-1])) == [-1.5, 0.75] and curve.statuses == (st.Status.PARAMETER_BOUND,) * 2
    assert np.abs(a_ + b_**2 / 4 + b_).max() < 1e-12
    assert b_.min() == -1.5 and b_.max() == 0.75
    curve.save(tmp_path / "curve.npz")
    again = st.load(tmp_path / "curve.npz")
    assert again.meshes[0]["window"] == [-1.5, 0.75] and again.extend().statuses == curve.statuses


def test_the_window_of_the_followed_parameter_comes_first_where_it_is_nearer():
    point = fold_of_parabola()
    curve = st.continuation(st.locus(point, free="b", window=(-50.0, 50.0)), "a", (-1.0, 4.0))
    assert curve.columns["a"][[0, -1]].tolist() == [-1.0, -1.0]
    assert sorted(curve.columns["b"][[0, -1]]) == pytest.approx([-2 - 2 * np.sqrt(2), -2 + 2 * np.sqrt(2)], abs=1e-9)


def test_bounds_of_the_system_are_walls():
    """The same with b bounded from below by the model itself: the curve does not leave it."""
    system = st.System(
        name="bounded", coordinates=("x",), states=("x",), parameters={"a": 1.0, "b": 0.5}, bounds={"b": (0.1, 2.0)},
        rhs=(a - x**2 - b * (x - 1),),
    )  # fmt: skip
    branch = st.continuation(st.Equilibrium(system), "a", (4.0, -4.0), start=dict(x=2.0))
    curve = st.continuation(st.locus(branch["LP1"], free="b"), "a", (-4.0, 4.0))
    assert sorted(curve.columns["b"][[0, -1]]) == [0.1, 2.0]
    with pytest.raises(st.errors.InputError, match="leaves the bounds"):
        st.locus(branch["LP1"], free="b", window=(0.0, 1.0))


@pytest.mark.parametrize("window, message", [((1.0, 2.0), "outside the window"), ((0, 0), "different"), (3, "two numbers")])
def test_windows_that_make_no_sense(window, message):
    point = fold_of_parabola()
    with pytest.raises(st.errors.InputError, match=message):
        st.locus(point, free="b", window=window)
