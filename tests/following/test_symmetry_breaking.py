"""Symmetric branches on half of their period, and what is born where the symmetry is lost.

Witnesses: the same branches on the whole period; pitchforks by shooting with scipy's DOP853, det(N + I) = 0 solved
together with the orbit; loops of which both halves are followed; images under S by definition.
"""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import root

import stability as st
from stability.following.families import _mirrors, _Search
from stability.words import Criticality, Kind, Status

START = {5.0: 8.0, 10.0: 12.0, 25.0: 16.0}


def duffing(force):
    return st.models.duffing_textbook(delta=0.1, alpha=1.0, beta=1.0, gamma=force)


@pytest.fixture(scope="module", params=[5.0, 10.0, 25.0])
def pair(request):
    """The same branch on the whole period and on half of it, finer than usual."""
    system, window = duffing(request.param), (START[request.param], 0.3)
    problems = [st.Collocation(system, symmetry=s, accuracy=1e-11) for s in (None, "auto")]
    return request.param, *(st.continuation(p, "omega", window) for p in problems)


def test_the_same_special_points_with_the_same_labels(pair):
    force, whole, half = pair
    assert whole.labels == half.labels and len(half.labels) == {5.0: 14, 10.0: 18, 25.0: 24}[force]
    for p, q in zip(whole.special, half.special):
        assert q.params["omega"] == pytest.approx(p.params["omega"], abs=1e-10 * max(1.0, p.params["omega"]) ** 2)
        assert q.symmetry_breaking is p.symmetry_breaking is (q.kind is Kind.BRANCH_POINT)
        assert q.criticality is p.criticality
        assert q.coefficient == pytest.approx(p.coefficient, rel=1e-4)
        assert np.abs(q.multipliers - 1).min() < 1e-6
        critical = -1 if q.kind is Kind.BRANCH_POINT else 1
        assert np.abs(q.half_multipliers - critical).min() < 1e-7


def test_the_same_orbits(pair):
    """Orbits at the same omega agree to 1e-9 at all times, with their multipliers."""
    force, whole, half = pair
    for omega in np.linspace(0.35, 0.95 * START[force], 7):
        one, other = whole.at(omega=omega), half.at(omega=omega)
        assert len(one) == len(other) > 0
        for a, b in zip(one, other):
            times = np.linspace(0.0, a.period, 40)
            size = max(abs(a.max["x"]), abs(a.max["x_dot"]), abs(a.min["x_dot"]))
            np.testing.assert_allclose(b(times), a(times), atol=1e-9 * size)
            np.testing.assert_allclose(np.sort_complex(b.multipliers), np.sort_complex(a.multipliers), atol=1e-8)
            assert a.verdict is b.verdict


def test_special_points_are_as_accurate_as_the_branch():
    """At F = 5 the second pitchfork comes where the mesh has fallen behind: it is located again on a better one."""
    usual, fine = (
        st.continuation(st.Collocation(duffing(5.0), symmetry="auto", accuracy=accuracy), "omega", (2.0, 0.8))
        for accuracy in (1e-9, 1e-12)
    )
    assert usual.labels == fine.labels == ("BP1", "BP2")
    for p, q in zip(usual.special, fine.special):
        assert p.solution.error < 3e-9
        assert p.params["omega"] == pytest.approx(q.params["omega"], abs=1e-8)


@pytest.mark.parametrize(
    ("values", "name", "window", "number"),
    [
        (dict(delta=0.2, alpha=-1.0, gamma=1.0), "omega", (4.0, 0.3), 8),  # double well
        (dict(delta=0.1, alpha=-1.0, gamma=3.0), "omega", (6.0, 0.4), 8),
        (dict(delta=0.1, beta=-0.1, gamma=0.2), "omega", (0.2, 3.0), 1),  # softening
        (dict(delta=0.1, omega=0.5), "gamma", (0.1, 60.0), 15),
    ],
)
def test_labels_of_other_oscillators(values, name, window, number):
    """x'' + delta x' + alpha x + beta x^3 = gamma cos(omega t), both ways."""
    system = st.models.duffing_textbook(**values)
    problems = [st.Collocation(system, symmetry=s, accuracy=1e-11) for s in (None, "auto")]
    whole, half = (st.continuation(p, name, window) for p in problems)
    assert whole.labels == half.labels and len(half.labels) == number and whole.statuses == half.statuses
    for p, q in zip(whole.special, half.special):
        assert q.params[name] == pytest.approx(p.params[name], rel=1e-9, abs=1e-9)
        assert q.symmetry_breaking is (q.kind is Kind.BRANCH_POINT)


def shot(force, omega, x0):
    """(x0, omega) with x(T/2) = -x0 and det(N + I) = 0, N = -Phi(T/2), by DOP853."""

    def rhs(time, z, w):
        k = -1.0 - 3.0 * z[0] ** 2
        a = -0.1 * z[1] - z[0] - z[0] ** 3 + force * np.cos(w * time)
        return [z[1], a, z[4], z[5], k * z[2] - 0.1 * z[4], k * z[3] - 0.1 * z[5]]

    def equations(y):
        start = [y[0], y[1], 1.0, 0.0, 0.0, 1.0]
        end = solve_ivp(rhs, (0, np.pi / y[2]), start, "DOP853", rtol=1e-13, atol=1e-14, args=(y[2],)).y[:, -1]
        N = -end[2:].reshape(2, 2)
        return [end[0] + y[0], end[1] + y[1], 1 + np.trace(N) + np.linalg.det(N)]

    found = root(equations, [*x0, omega], method="hybr", tol=1e-13, options={"eps": 1e-7})
    assert np.abs(equations(found.x)).max() < 1e-9
    return found.x


def check_by_shooting(branch, force, points):
    for point in points:
        exact = shot(force, point.params["omega"], point.solution(0.0))
        assert point.params["omega"] == pytest.approx(exact[2], abs=1e-10), point.label
        np.testing.assert_allclose(point.solution(0.0), exact[:2], atol=1e-7)


def test_some_pitchforks_by_shooting():
    half = st.continuation(st.Collocation(duffing(25.0), symmetry="auto", accuracy=1e-11), "omega", (2.5, 1.0))
    check_by_shooting(half, 25.0, half.of_kind(Kind.BRANCH_POINT)[:2])


@pytest.mark.slow
def test_all_pitchforks_of_the_branch_by_shooting(pair):
    force, _, half = pair
    points = half.of_kind(Kind.BRANCH_POINT)
    assert len(points) == {5.0: 6, 10.0: 8, 25.0: 12}[force]
    check_by_shooting(half, force, points)


# ---------------------------------------------------------------------- what is born there
@pytest.fixture(scope="module")
def loop():
    """The first asymmetric loop at F = 25: with its second half as an image, and with both halves followed."""
    half = st.continuation(st.Collocation(duffing(25.0), symmetry="auto"), "omega", (3.0, 1.0))
    window = (0.5, 3.0)
    both = st.continuation(st.switch(half["BP1"]), "omega", window, events={"none": lambda orbit: 1.0})
    return half, st.continuation(st.switch(half["BP1"]), "omega", window), both


def test_a_loop_and_its_image_are_the_loop_followed_round(loop):
    half, quick, slow = loop
    assert quick.statuses == slow.statuses == (Status.CLOSED_LOOP,) * 2
    assert quick.labels == slow.labels
    for p, q in zip(quick.special, slow.special):
        assert p.params["omega"] == pytest.approx(q.params["omega"], abs=5e-8)
    regained = quick.of_kind(Kind.BRANCH_POINT)[1]
    assert regained.params["omega"] == pytest.approx(half["BP2"].params["omega"], abs=1e-8)
    assert regained.symmetry_breaking and quick["BP1"].symmetry_breaking


def test_images_are_solutions_and_mirror_the_other_half(loop):
    quick = loop[1]
    for i in range(len(quick)):
        residual = quick._problem(i).linearise(quick.unknowns[i], quick._vector(i)).residual
        assert np.abs(residual).max() < 1e-6, i
    for omega in (1.5, 2.1):
        orbits = quick.at(omega=omega)
        assert len(orbits) % 2 == 0 and len(orbits) > 0
        for one, other in zip(orbits, orbits[::-1]):
            times = np.linspace(0, one.period, 21)
            np.testing.assert_allclose(other(times), -one(times - one.period / 2), atol=1e-6)
            assert one.verdict is other.verdict
    assert (np.diff(quick.arclength) >= 0).all()


def test_the_whole_period_leads_to_the_same_loop(loop):
    """From a branch point found on the whole period: located again on half of it."""
    whole = st.continuation(st.Collocation(duffing(25.0)), "omega", (3.0, 1.0))
    assert whole["BP1"].symmetry_breaking and "symmetry breaking" in repr(whole["BP1"])
    again = st.continuation(st.switch(whole["BP1"]), "omega", (0.5, 3.0))
    assert again.labels == loop[1].labels
    for p, q in zip(again.special, loop[1].special):
        assert p.params["omega"] == pytest.approx(q.params["omega"], abs=5e-8)


def test_an_open_half_and_its_image(loop):
    half = loop[0]
    branch = st.continuation(st.switch(half["BP1"]), "omega", (2.1, 3.0))
    assert branch.statuses == (Status.PARAMETER_BOUND,) * 2 and branch.parameter[0] == branch.parameter[-1] == 2.1
    top, bottom = branch.columns["x.max"], branch.columns["x.min"]
    np.testing.assert_allclose(top, -bottom[::-1], atol=1e-9)
    assert branch["BP1"].params["omega"] == pytest.approx(half["BP1"].params["omega"], abs=1e-12)
    doubled = loop[1].of_kind(Kind.PERIOD_DOUBLING)
    assert doubled and len(doubled) % 2 == 0


def test_storage_and_going_on(loop, tmp_path):
    half = loop[0]
    half.save(tmp_path / "half.npz")
    stored = st.load(tmp_path / "half.npz")
    assert stored["BP1"].symmetry_breaking and stored["BP1"].defining_kind is Kind.PERIOD_DOUBLING
    np.testing.assert_array_equal(stored.half_values**2, stored.values)
    again = st.continuation(st.switch(stored["BP1"]), "omega", (0.5, 3.0), max_points=12)
    assert again.status is Status.MAX_POINTS and not again._problem(0).halved
    longer = again.extend(max_points=8)
    assert len(longer) > len(again)
    again.save(tmp_path / "born.npz")
    assert st.load(tmp_path / "born.npz").labels == again.labels
    assert st.load(tmp_path / "half.npz").solution(3).half_multipliers is not None


# ---------------------------------------------------------------------- curves and sensitivities of such points
def test_curve_of_pitchforks_by_its_simple_system(loop):
    point = loop[0]["BP1"]
    curve = st.continuation(st.locus(point, free="gamma"), "omega", (1.8, 2.5))
    other = st.continuation(st.Collocation(duffing(26.0), symmetry="auto"), "omega", (3.0, 1.8))["BP1"].params["omega"]
    gamma = [orbit.params["gamma"] for orbit in curve.at(omega=other)]
    assert min(abs(g / 26.0 - 1) for g in gamma) < 1e-8
    whole = st.continuation(st.Collocation(duffing(25.0)), "omega", (3.0, 1.8))["BP1"]
    ours, theirs = point.sensitivity(), whole.sensitivity()
    for name in ("gamma", "delta", "alpha", "beta"):
        assert ours[name] == pytest.approx(theirs[name], rel=1e-6)
    assert ours.kind is Kind.BRANCH_POINT


def test_a_parameter_that_breaks_the_symmetry_has_no_sensitivity():
    system = st.models.duffing(xi=0.02, beta=0.05)
    fold = st.continuation(st.Collocation(system, symmetry="auto"), "Omega", (3.0, 1.2))["LP1"]
    assert fold.sensitivity().breaking == ("gravity",)


# ---------------------------------------------------------------------- other sorts of systems
def test_symmetric_cycles_of_lorenz():
    """x(t + T/2) = (-x, -y, z) at rho = 350, lost at 313 (Sparrow 1982, chapter 4), then a doubling at 229.4."""
    system = st.models.lorenz(rho=350.0)
    start = st.simulate(system, (0, 30), x0=dict(x=1.0, y=2.0, z=300.0), rtol=1e-9, atol=1e-9)(30.0)
    branches = []
    for symmetry in (None, "auto"):
        problem = st.Collocation(system, symmetry=symmetry, accuracy=1e-11)
        branch = st.continuation(problem, "rho", (350.0, 250.0), start=dict(zip(system.states, start)))
        assert branch.labels == ("BP1",) and branch["BP1"].symmetry_breaking
        branches.append(branch)
    whole, half = branches
    assert half["BP1"].params["rho"] == pytest.approx(whole["BP1"].params["rho"], abs=1e-8)
    assert half["BP1"].params["rho"] == pytest.approx(312.97, abs=0.01)
    assert half.solution(0).period == pytest.approx(whole.solution(0).period, rel=1e-10)
    born = st.continuation(st.switch(half["BP1"]), "rho", (350.0, 220.0))
    assert born.labels == ("PD1", "BP1", "PD2")
    assert born["PD1"].params["rho"] == born["PD2"].params["rho"] == pytest.approx(229.4, abs=0.05)


def test_a_force_that_jumps():
    """x'' + x'/5 + x + x^3 = 20 sign cos(Omega t); what is started symmetric stays so, where others attract, too."""
    t, Omega, F = sp.symbols("t Omega F", real=True)
    x = sp.Function("x")(t)
    system = st.System.from_equations(
        {x.diff(t, 2): -x.diff(t) / 5 - x - x**3 + F * sp.sign(sp.cos(Omega * t))}, coordinates=[x],
        parameters={"F": 20.0, "Omega": 2.0}, period=2 * sp.pi / Omega, breaks=(sp.Rational(1, 4), sp.Rational(3, 4)),
    )  # fmt: skip
    whole = st.continuation(st.Collocation(system, accuracy=1e-11), "Omega", (0.62, 2.0))
    half = st.continuation(st.Collocation(system, accuracy=1e-11, symmetry="auto"), "Omega", (0.62, 2.0))
    assert whole.labels == half.labels and "BP2" in half.labels
    for p, q in zip(whole.special, half.special):
        assert q.params["Omega"] == pytest.approx(p.params["Omega"], abs=1e-9)
    born = st.continuation(st.switch(half["BP1"]), "Omega", (0.62, 2.0))
    residuals = [born._problem(i).linearise(born.unknowns[i], born._vector(i)).residual for i in range(len(born))]
    assert max(np.abs(r).max() for r in residuals) < 1e-6
    coexisting = st.solve(st.Collocation(system), start=born.at(Omega=0.64)[0], Omega=0.64)
    assert coexisting.max["x"] + coexisting.min["x"] != pytest.approx(0.0, abs=1e-3)
    back = st.solve(st.Collocation(system, symmetry="auto"), start=coexisting, Omega=0.64)
    assert back.max["x"] == pytest.approx(-back.min["x"], abs=1e-9)


# ---------------------------------------------------------------------- the pendulum
def test_swinging_branch_of_the_pendulum_on_one_forcing_period():
    """theta(t + T) = -theta(t): by "auto" the doubled branch is solved on T; labels and places as on 2T."""
    system = st.models.autoparametric_pendulum(
        length_ratio=10.0, mass_ratio_total=0.2, Omega0=0.5, xi1=0.02, xi2=0.01, base_term=False
    )
    branches = []
    for symmetry in (None, "auto"):
        hanging = st.continuation(st.Collocation(system, symmetry=symmetry), "Omega", (0.5, 1.5))
        branches.append(st.continuation(st.switch(hanging["PD1"]), "Omega", (0.5, 1.5)))
    whole, half = branches
    assert half._problem(4).halved and half._problem(4).span == 1.0 and whole._problem(4).span == 2.0
    assert whole.labels == half.labels and whole.statuses == half.statuses
    for p, q in zip(whole.special, half.special):
        assert q.params["Omega"] == pytest.approx(p.params["Omega"], abs=1e-9)
    breaking = [p.label for p in half.of_kind(Kind.BRANCH_POINT) if p.symmetry_breaking]
    assert breaking == [p.label for p in whole.of_kind(Kind.BRANCH_POINT) if p.symmetry_breaking]
    assert breaking == ["BP1", "BP2", "BP3", "BP4"]
    assert half["BP1"].params["Omega"] == pytest.approx(0.7429760406, abs=1e-9)
    loop = st.continuation(st.switch(half["BP1"]), "Omega", (0.5, 1.5))
    assert loop.status is Status.CLOSED_LOOP
    crossings = [p.params["Omega"] for p in loop.of_kind(Kind.BRANCH_POINT)]
    np.testing.assert_allclose(crossings, [half["BP1"].params["Omega"], half["BP2"].params["Omega"]], atol=1e-9)


def test_pointwise_symmetry_lost_in_the_second_tongue():
    """q'' + 0.1 q' + (a + b cos t) q + q^3 / 4 = 0: motions of the forcing period beside rest; the image is -q(t)."""
    t, a = sp.symbols("t a", real=True)
    q = sp.Function("q")(t)
    system = st.System.from_equations(
        {q.diff(t, 2): -sp.Rational(1, 10) * q.diff(t) - (a + sp.Rational(4, 5) * sp.cos(t)) * q - q**3 / 4},
        coordinates=[q], parameters={"a": 0.6}, period=2 * sp.pi,
    )  # fmt: skip
    rest = st.continuation(st.Collocation(system), "a", (0.6, 1.6))
    crossing = rest["BP1"]
    assert crossing.symmetry_breaking and np.abs(crossing.multipliers - 1).min() < 1e-9
    branch = st.continuation(st.switch(crossing), "a", (0.2, 1.6))
    half = len(branch) // 2
    assert branch.labels.count("BP1") == 1
    np.testing.assert_allclose(branch.columns["q.max"], -branch.columns["q.min"][::-1], atol=1e-9)
    assert branch.columns["q.max"][: half - 1].max() > 0.1


def test_a_circle_of_equilibria_closed_by_its_image():
    """x' = (1 - r^2) x - x^3: pitchforks at r = -1 and 1, between them x = +-sqrt(1 - r^2)."""
    x, r = sp.symbols("x r", real=True)
    system = st.System(
        name="circle", coordinates=("x",), states=("x",), parameters={"r": -2.0}, rhs=((1 - r**2) * x - x**3,)
    )
    rest = st.continuation(st.Equilibrium(system), "r", (-2.0, 2.0))
    assert [p.symmetry_breaking for p in rest.special] == [True, True]
    circle = st.continuation(st.switch(rest["BP1"]), "r", (-2.0, 2.0))
    assert circle.statuses == (Status.CLOSED_LOOP,) * 2 and circle.labels == ("BP1", "BP2")
    assert circle.columns["x"] ** 2 + circle.columns["r"] ** 2 == pytest.approx(1.0, abs=1e-9)
    assert circle.columns["x"].max() == -circle.columns["x"].min() > 0.99
    one, other = circle.at(r=0.3)
    assert one["x"] == pytest.approx(-other["x"], abs=1e-12)


def test_a_symmetry_that_the_parameter_destroys_makes_no_images():
    """x' = (r + h) x - x^3 + h x^2 is odd at h = 0 only: along h the crossing at h = 1 has two different halves."""
    x, r, h = sp.symbols("x r h", real=True)
    system = st.System(
        name="bent", coordinates=("x",), states=("x",), parameters={"r": -1.0, "h": 0.0},
        rhs=((r + h) * x - x**3 + h * x**2,),
    )  # fmt: skip
    assert [s.fixed for s in system.symmetries] == [("h",)]
    crossing = st.continuation(st.Equilibrium(system), "h", (0.0, 2.0))["BP1"]
    assert not crossing.symmetry_breaking
    branch = st.continuation(st.switch(crossing), "h", (0.0, 2.0))
    ends = sorted(branch.columns["x"][[0, -1]])
    assert ends == pytest.approx([1 - np.sqrt(2), 1 + np.sqrt(2)], abs=1e-9)


# ---------------------------------------------------------------------- families
def test_families_list_images_once():
    """x' = r x - x^3: x = 0 and +-sqrt r, one of them the image of the other."""
    x, r = sp.symbols("x r", real=True)
    system = st.System(name="pitchfork", coordinates=("x",), states=("x",), parameters={"r": 1.0}, rhs=(r * x - x**3,))
    problem = st.Equilibrium(system)
    middles = [sorted(abs(b.at(r=1.0)[0]["x"]) for b in st.families(problem, "r", (0.5, 1.5), merge=m)) for m in (1, 0)]
    assert middles[0] == pytest.approx([0.0, 1.0]) and middles[1] == pytest.approx([0.0, 1.0, 1.0])


def test_families_of_orbits_list_images_once():
    """x' = x - x^3 + 0.2 cos(Omega t): an orbit about 0, one about 1 or -1, whose image is another solution."""
    t, g, Omega = sp.symbols("t g Omega", real=True)
    x = sp.Function("x")(t)
    system = st.System.from_equations(
        {x.diff(t): x - x**3 + g * sp.cos(Omega * t)}, coordinates=[x], parameters={"g": 0.2, "Omega": 2.0},
        period=2 * sp.pi / Omega,
    )  # fmt: skip
    problem = st.Collocation(system)
    found = st.families(problem, "Omega", (1.8, 2.2))
    means = [b.at(Omega=2.0)[0].amplitude(0)["x"] for b in found]
    assert np.abs(means) == pytest.approx([0.0, 1.0], abs=0.01)
    one = found[1].at(Omega=2.0)[0]
    other = st.solve(problem, start=[-one(one.period / 2)[0]])
    assert other.amplitude(0)["x"] == pytest.approx(-means[1], abs=1e-9)
    merging, plain = (_Search(problem, "Omega", m) for m in (_mirrors(problem, "Omega"), ()))
    assert plain.differs(other, [one]) and not merging.differs(other, [one])


def test_criticality_word_is_that_of_the_pitchfork(loop):
    assert loop[0]["BP1"].criticality is Criticality.SUPERCRITICAL
    assert loop[1].solution(3).verdict is st.Verdict.STABLE or loop[1].solution(len(loop[1]) - 4).verdict is st.Verdict.STABLE


def test_asymmetric_loop_closes_when_both_halves_are_followed():
    """From the window (16, 0.3), where the loop is a small part of the parameter's width: born once, closed, no twins.

    Witness: the same loop with its second half as the image of the first.
    """
    system = st.models.duffing_textbook(delta=0.1, gamma=25.0)
    branch = st.continuation(st.Collocation(system, symmetry="auto"), "omega", (16.0, 0.3), stop_at=("BP1",))
    half = st.continuation(st.switch(branch["BP1"]), "omega", (16.0, 0.3))
    # a user's event need not have the symmetry: with one, both halves are followed
    full = st.continuation(st.switch(branch["BP1"]), "omega", (16.0, 0.3), events=lambda orbit: 1.0)
    assert half.status is full.status is st.Status.CLOSED_LOOP
    assert half.labels == full.labels
    for a, b in zip(half.special, full.special):
        assert a.params["omega"] == pytest.approx(b.params["omega"], abs=1e-9)
