"""Issue C from outside: branches of systems written here, against orbits and special points by scipy alone.

The oscillators are none of the catalogue's: quadratic and cubic springs under load, escape over a softening spring, forced
van der Pol, a parametric drive with cubic spring. Witness: `independent_witness` (shooting by DOP853), Floquet integration of
Mathieu's equation, closed forms, and simulations by solve_ivp.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from independent_witness import CONDITIONS, at, doubling, flow, locate, polish
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stability as st

t = sp.Symbol("t")
x = sp.Function("x")(t)


def oscillator(acceleration, **parameters):
    """x'' = acceleration, as a user writes it."""
    return st.System.from_equations({x.diff(t, 2): acceleration}, [x], parameters=parameters)


def forced(stiffness, slope, force, damping=0.1):
    """(f, J, T) of x'' + damping x' + stiffness(x) = force cos(w t)."""
    return (
        lambda s, q, w: np.array([q[1], -damping * q[1] - stiffness(q[0]) + force * np.cos(w * s)]),
        lambda s, q, w: np.array([[0.0, 1.0], [-slope(q[0]), -damping]]),
        lambda w: 2 * np.pi / w,
    )


d, c2, c3, F, w, e, mu = sp.symbols("d c2 c3 F w e mu")
SPRING = -d * x.diff(t) - x - c2 * x**2 - c3 * x**3 + F * sp.cos(w * t)
CASES = {
    "asymmetric": (
        oscillator(SPRING, d=0.1, c2=0.3, c3=0.2, F=0.8, w=1.0),
        (0.3, 2.5),
        forced(lambda q: q + 0.3 * q**2 + 0.2 * q**3, lambda q: 1 + 0.6 * q + 0.6 * q**2, 0.8),
        ("LP1", "LP2"),
    ),
    "escape": (
        oscillator(SPRING, d=0.1, c2=-1.0, c3=0.0, F=0.1, w=0.8),
        (1.5, 0.4),
        forced(lambda q: q - q**2, lambda q: 1 - 2 * q, 0.1),
        ("PD1",),
    ),
    "softening": (
        oscillator(SPRING, d=0.1, c2=0.0, c3=-1.0, F=0.15, w=0.8),
        (0.3, 1.5),
        forced(lambda q: q - q**3, lambda q: 1 - 3 * q**2, 0.15),
        ("LP1",),
    ),
    "van der Pol": (
        oscillator(mu * (1 - x**2) * x.diff(t) - x + F * sp.cos(w * t), mu=0.3, F=0.5, w=1.0),
        (0.6, 1.6),
        (
            lambda s, q, v: np.array([q[1], 0.3 * (1 - q[0] ** 2) * q[1] - q[0] + 0.5 * np.cos(v * s)]),
            lambda s, q, v: np.array([[0.0, 1.0], [-1 - 0.6 * q[0] * q[1], 0.3 * (1 - q[0] ** 2)]]),
            lambda v: 2 * np.pi / v,
        ),
        ("NS1", "NS2"),
    ),
    "parametric": (
        oscillator(
            -d * x.diff(t) - (1 + e * sp.cos(w * t)) * x - c2 * x**2 - c3 * x**3 + F * sp.cos(w * t),
            d=0.05, e=0.5, c2=0.4, c3=0.3, F=0.2, w=2.0,
        ),
        (0.5, 2.6),
        (
            lambda s, q, v: np.array([
                q[1], -0.05 * q[1] - (1 + 0.5 * np.cos(v * s)) * q[0] - 0.4 * q[0] ** 2 - 0.3 * q[0] ** 3
                + 0.2 * np.cos(v * s)]),
            lambda s, q, v: np.array([
                [0.0, 1.0], [-1 - 0.5 * np.cos(v * s) - 0.8 * q[0] - 0.9 * q[0] ** 2, -0.05]]),
            lambda v: 2 * np.pi / v,
        ),
        ("LP1", "LP2", "LP3", "LP4", "PD1", "PD2"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_special_points_and_verdicts_by_own_shooting(name):
    system, window, model, labels = CASES[name]
    branch = st.continuation(st.Collocation(system), "w", window)
    assert branch.labels == labels
    for point in branch.special:
        own = locate(model, point.solution(0.0), point.params["w"], CONDITIONS[point.kind.label])
        assert abs(own - point.params["w"]) < 2e-9, point
    last, crossings = None, 0
    for i in range(0, len(branch), max(1, len(branch) // 25)):
        value, orbit = branch.parameter[i], branch.solution(i)
        if min(abs(branch.parameter[i] - p.params["w"]) for p in branch.special) < 1e-6:
            continue
        end, matrix = flow(*at(model, value), orbit(0.0), model[2](value))
        own = np.sort(abs(np.linalg.eigvals(matrix)))
        assert np.allclose(end, orbit(0.0), atol=1e-7 * max(1.0, own[-1]))
        assert np.allclose(np.sort(abs(orbit.multipliers)), own, atol=(1e-6 if own[-1] < 1e3 else 1e-3) * own[-1])
        if abs(own[-1] - 1) > 1e-5:
            verdict = st.Verdict.STABLE if own[-1] < 1 else st.Verdict.UNSTABLE
            assert branch.verdicts[i] is verdict
            crossings += last is not None and last is not verdict
            last = verdict
    assert crossings > 0  # the check has seen a change of stability


def test_both_directions_give_the_same_points():
    system, window, _, _ = CASES["parametric"]
    there = st.continuation(st.Collocation(system), "w", window)
    back = st.continuation(st.Collocation(system), "w", window[::-1])
    ours = sorted((p.kind.label, p.params["w"]) for p in there.special)
    theirs = sorted((p.kind.label, p.params["w"]) for p in back.special)
    assert [k for k, _ in ours] == [k for k, _ in theirs]
    assert np.allclose([v for _, v in ours], [v for _, v in theirs], atol=1e-9)


def test_a_system_around_a_python_function_has_the_same_folds():
    def rhs(s, q, *, w=1.0):
        return q[1], -0.1 * q[1] - q[0] - 0.3 * q[0] ** 2 - 0.2 * q[0] ** 3 + 0.8 * np.cos(w * s)

    system = st.System.from_function(rhs, "x v", period="2*pi/w")
    branch = st.continuation(st.Collocation(system), "w", (1.0, 2.2))
    symbolic, _, model, _ = CASES["asymmetric"]
    reference = st.continuation(st.Collocation(symbolic), "w", (1.0, 2.2))
    assert branch.labels == reference.labels == ("LP1", "LP2")
    for label in branch.labels:
        own = locate(model, reference[label].solution(0.0), reference[label].params["w"], CONDITIONS["LP"])
        assert abs(branch[label].params["w"] - own) < 1e-7


def test_the_pendulums_doublings_by_own_floquet_integration():
    xi1, xi2, tuning, ratio = 0.015, 0.008, 0.49, 60.0
    pendulum = st.models.autoparametric_pendulum(
        xi1=xi1, xi2=xi2, Omega0=tuning, length_ratio=ratio, mass_ratio_total=0.15)  # fmt: skip
    branch = st.continuation(st.Collocation(pendulum), "Omega", (0.8, 1.25))

    def condition(Omega):
        """det(M + I) of theta'' + 2 xi2 Omega0 theta' + (Omega0^2 + U_abs''/ll) theta = 0."""
        absolute = 1 + Omega**2 / (1 - Omega**2 + 2j * xi1 * Omega)

        def stiffness(s):
            return tuning**2 - Omega**2 * (absolute * np.exp(1j * Omega * s)).real / ratio

        _, matrix = flow(
            lambda s, q: np.array([q[1], -2 * xi2 * tuning * q[1] - stiffness(s) * q[0]]),
            lambda s, q: np.array([[0.0, 1.0], [-stiffness(s), -2 * xi2 * tuning]]),
            np.zeros(2), 2 * np.pi / Omega, rtol=1e-12, atol=1e-14)  # fmt: skip
        return doubling(matrix)

    points = [p.params["Omega"] for p in branch.of_kind(st.Kind.PERIOD_DOUBLING)]
    assert len(points) >= 2
    for value in points:
        assert abs(brentq(condition, value - 1e-4, value + 1e-4, xtol=1e-13) - value) < 1e-9
    scanned = [condition(v) for v in np.linspace(0.8, 1.25, 91)]
    assert np.count_nonzero(np.diff(np.sign(scanned))) == len(points)  # none missed, none invented


def test_criticality_of_a_parametric_drive_by_simulation():
    # x'' + .05 x' + (1 + .3 cos w t) x + .5 x^3 = 0 hardens: the swing grows gently at the lower end, jumps at the upper.
    system = oscillator(-d * x.diff(t) - (1 + e * sp.cos(w * t)) * x - c3 * x**3, d=0.05, e=0.3, c3=0.5, w=2.0)
    rest = st.continuation(st.Collocation(system), "w", (1.6, 2.4))
    low, high = rest.of_kind(st.Kind.PERIOD_DOUBLING)
    assert low.criticality is st.Criticality.SUPERCRITICAL
    assert high.criticality is st.Criticality.SUBCRITICAL

    def final(value, start):
        run = solve_ivp(
            lambda s, q: [q[1], -0.05 * q[1] - (1 + 0.3 * np.cos(value * s)) * q[0] - 0.5 * q[0] ** 3],
            (0, 400 * 2 * np.pi / value), [start, 0.0], rtol=1e-8, atol=1e-12, t_eval=np.linspace(390, 400, 400)
            * 2 * np.pi / value)  # fmt: skip
        return abs(run.y[0]).max()

    assert final(low.params["w"] - 0.01, 0.3) < 1e-3  # below: rest attracts even a large start
    assert 0.03 < final(low.params["w"] + 0.01, 1e-3) < 0.35  # above: a small swing, growing like a square root
    assert final(high.params["w"] + 0.01, 1e-3) < 1e-3  # above the upper end rest is stable,
    assert final(high.params["w"] + 0.01, 0.9) > 0.5  # but so is a large swing
    swing = st.continuation(st.switch(low), "w", (1.6, 2.4))
    (stable,) = [o for o in swing.at(w=2.0) if o.verdict is st.Verdict.STABLE and o.max["x"] > 0.1]
    assert abs(stable.max["x"] - final(2.0, 0.5)) < 1e-3  # solve_ivp samples 40 times a period


def test_hopf_amplitude_and_first_lyapunov_sign():
    # x'' - (m - x^2) x' + x = 0: amplitude 2 sqrt(m) (1 + O(m)); with the other sign subcritical.
    m = sp.Symbol("m")
    soft = oscillator((m - x**2) * x.diff(t) - x, m=0.0)
    rest = st.continuation(st.Equilibrium(soft), "m", (-0.5, 0.5))
    assert abs(rest["HB1"].params["m"]) < 1e-10
    assert rest["HB1"].criticality is st.Criticality.SUPERCRITICAL
    cycle = st.continuation(st.switch(rest["HB1"]), "m", (-0.5, 0.3))
    for value in (0.01, 0.04):
        (orbit,) = cycle.at(m=value)
        assert abs(orbit.amplitude(1)["x"] - 2 * np.sqrt(value)) < 0.3 * value**1.5 + 1e-6
        assert orbit.verdict is st.Verdict.STABLE
    hard = oscillator((m + x**2) * x.diff(t) - x, m=0.0)
    rest = st.continuation(st.Equilibrium(hard), "m", (-0.5, 0.5))
    assert rest["HB1"].criticality is st.Criticality.SUBCRITICAL


def test_brusselator_hopf_and_its_cycle():
    # X' = a - (b + 1) X + X^2 Y, Y' = b X - X^2 Y: Hopf at b = 1 + a^2 with frequency a.
    X, Y = sp.Function("X")(t), sp.Function("Y")(t)
    a, b = sp.symbols("a b")
    system = st.System.from_equations(
        {X.diff(t): a - (b + 1) * X + X**2 * Y, Y.diff(t): b * X - X**2 * Y}, [X, Y], parameters=dict(a=1.0, b=1.5)
    )
    rest = st.continuation(st.Equilibrium(system), "b", (1.0, 4.0), start=dict(X=1.0, Y=1.0))
    assert abs(rest["HB1"].params["b"] - 2.0) < 1e-10
    assert np.isclose(abs(rest["HB1"].multipliers.imag).max(), 1.0, atol=1e-9)
    cycle = st.continuation(st.switch(rest["HB1"]), "b", (1.5, 3.0))
    (orbit,) = cycle.at(b=3.0)
    x0 = orbit(0.0)

    def f(s, q):
        return np.array([1 - 4 * q[0] + q[0] ** 2 * q[1], 3 * q[0] - q[0] ** 2 * q[1]])

    def jacobian(s, q):
        return np.array([[-4 + 2 * q[0] * q[1], q[0] ** 2], [3 - 2 * q[0] * q[1], -(q[0] ** 2)]])

    end, matrix = flow(f, jacobian, x0, orbit.period)
    assert np.allclose(end, x0, atol=1e-8)
    assert np.allclose(np.sort(abs(np.linalg.eigvals(matrix))), np.sort(abs(orbit.multipliers)), atol=1e-7)


def test_wild_scales_change_nothing():
    # The asymmetric oscillator in nanometres and gigaseconds: x = 1e-9 z, t = 1e6 s.
    L, S = 1e-9, 1e6
    force = (
        -d * x.diff(t) / S
        - x / S**2
        - c2 * x**2 / (L * S**2)
        - c3 * x**3 / (L * S) ** 2
        + F * L / S**2 * sp.cos(w * t / S)
    )
    tiny = oscillator(force, d=0.1, c2=0.3, c3=0.2, F=0.8, w=1.0)
    reference, window, _, labels = CASES["asymmetric"]
    small = st.continuation(st.Collocation(tiny), "w", window)
    plain = st.continuation(st.Collocation(reference), "w", window)
    assert small.labels == labels
    for label in labels:
        assert abs(small[label].params["w"] - plain[label].params["w"]) < 1e-8
        assert np.allclose(small[label].multipliers, plain[label].multipliers, atol=1e-5)
        assert np.isclose(small[label].solution.max["x"], L * plain[label].solution.max["x"], rtol=1e-7)


def test_a_text_model_written_here(tmp_path):
    path = tmp_path / "asymmetric.toml"
    path.write_text("""
[model]
name = "asymmetric"
coordinates = ["x"]
kinetic = "x'**2/2"
potential = "x**2/2 + c2*x**3/3 + c3*x**4/4"
dissipation = "d*x'**2/2"
period = "2*pi/w"

[forces]
x = "F*cos(w*t)"

[parameters]
d = 0.1
c2 = 0.3
c3 = 0.2
F = 0.8
w = { value = 1.0, bounds = [0.1, 10.0] }
""")
    branch = st.continuation(st.Collocation(st.load_model(path)), "w", (1.0, 2.2))
    _, _, model, _ = CASES["asymmetric"]
    assert branch.labels == ("LP1", "LP2")
    for point in branch.special:
        assert abs(locate(model, point.solution(0.0), point.params["w"], CONDITIONS["LP"]) - point.params["w"]) < 2e-9


def test_shooting_and_collocation_with_other_meshes_agree():
    system, _, model, labels = CASES["asymmetric"]
    problems = [st.Collocation(system, intervals=n) for n in (10, 40)] + [
        st.Shooting(system, segments=k) for k in (1, 3)
    ]
    found = [st.continuation(problem, "w", (1.2, 2.0)) for problem in problems]
    for branch in found:
        assert branch.labels == labels
        for label in labels:
            assert abs(branch[label].params["w"] - found[0][label].params["w"]) < 1e-8
    orbits = found[0].at(w=1.6)
    assert len(orbits) == 3
    for orbit in orbits:
        x0, matrix = polish(*at(model, 1.6), orbit(0.0), model[2](1.6))
        assert np.allclose(x0, orbit(0.0), atol=1e-8)
        assert (abs(np.linalg.eigvals(matrix)).max() < 1) == (orbit.verdict is st.Verdict.STABLE)


def test_interrupted_branches_keep_their_points_and_go_on(tmp_path):
    system, window, _, labels = CASES["asymmetric"]
    problem = st.Collocation(system)
    whole = st.continuation(problem, "w", window)

    def interrupt(progress):
        if progress.points > 15:
            raise KeyboardInterrupt

    cut = st.continuation(problem, "w", window, progress=interrupt)
    assert cut.status is st.Status.STOPPED and 15 <= len(cut) < len(whole)
    cut.save(tmp_path / "cut.npz")
    longer = st.load(tmp_path / "cut.npz").extend()
    assert longer.status is st.Status.PARAMETER_BOUND and longer.labels == labels
    for label in labels:
        assert abs(longer[label].params["w"] - whole[label].params["w"]) < 1e-10

    def fails(orbit):
        if orbit.params["w"] > 1.2:
            raise ZeroDivisionError("my own mistake")
        return 1.0

    with pytest.warns(st.errors.StabilityWarning, match="my own mistake"):
        stopped = st.continuation(problem, "w", window, events=dict(mine=fails))
    assert stopped.status is st.Status.STOPPED and len(stopped) > 5 and stopped.parameter.max() < 1.5
    few = st.continuation(problem, "w", window, max_points=7)
    assert few.status is st.Status.MAX_POINTS
    assert few.extend(max_points=2000).labels == labels
    wanted = st.continuation(
        problem, "w", window, at=(0.7, 2.1), stop_at=("LP2",), events=dict(one=lambda orbit: orbit.max["x"] - 1.5)
    )
    assert wanted.status is st.Status.STOPPED and wanted.parameter[-1] == wanted["LP2"].params["w"]
    assert abs(wanted["one"].solution.max["x"] - 1.5) < 1e-8


def test_what_is_stored_is_what_was_computed(tmp_path):
    system, window, _, _ = CASES["parametric"]
    branch = st.continuation(st.Collocation(system), "w", window)
    branch.save(tmp_path / "b.npz")
    stored = st.load(tmp_path / "b.npz")
    for name, column in branch.columns.items():
        assert np.array_equal(stored.columns[name], column)
    assert np.array_equal(stored.values, branch.values) and stored.verdicts == branch.verdicts
    swing = st.continuation(st.switch(stored["PD1"]), "w", window)
    again = st.continuation(st.switch(branch["PD1"]), "w", window)
    assert len(swing) == len(again) and np.allclose(swing.parameter, again.parameter, atol=1e-9)
    assert not np.isnan(branch.residuals).any() and branch.error.max() < 1e-6
    data = (tmp_path / "b.npz").read_bytes()
    (tmp_path / "half.npz").write_bytes(data[: len(data) // 2])
    with pytest.raises(st.errors.FileFormatError):
        st.load(tmp_path / "half.npz")


def test_dead_ends_have_a_status_and_finite_points():
    z, r = sp.symbols("x r", real=True)

    def flat(rhs):
        return st.Equilibrium(
            st.System(name="flat", states=("x",), coordinates=("x",), parameters=dict(r=1.0), rhs=(rhs,))
        )

    root = st.continuation(flat(sp.sqrt(r) - z), "r", (1.0, -1.0), start=dict(x=1.0))
    pole = st.continuation(flat(1 / r - z), "r", (1.0, -1.0), start=dict(x=1.0))
    kink = st.continuation(flat(sp.Abs(z) - z / 2 - r), "r", (1.0, -1.0), start=dict(x=2.0))
    assert root.status is kink.status is st.Status.STEP_TOO_SMALL and pole.status is st.Status.DIVERGED
    for branch in (root, pole, kink):
        assert len(branch) > 5 and np.isfinite(branch.columns["x"]).all()
        assert abs(branch.parameter[-1]) < 1e-2 or branch is pole
        assert branch.parameter.min() > -1e-6 and branch.message
    with pytest.raises(st.errors.ConvergenceError):
        st.continuation(flat(r + z**2 + 1), "r", (0.0, 1.0))


@pytest.mark.parametrize("call", [
    lambda c: st.continuation(c, "w", (1, 1)),
    lambda c: st.continuation(c, "w", (1, np.nan)),
    lambda c: st.continuation(c, "W", (1, 2)),
    lambda c: st.continuation(c, "w", (1, 2), ds=-1),
    lambda c: st.continuation(c, "w", (1, 2), max_points=1.5),
    lambda c: st.continuation(c, "w", (1, 2), at=(5,)),
    lambda c: st.continuation(c, "w", (1, 2), stop_at=("FOO",)),
    lambda c: st.continuation(c, "w", (1, 2), start=dict(y=1)),
    lambda c: st.continuation(c, "w", (1, 2), start=[1, 2, 3]),
    lambda c: st.continuation(c, "w", (1, 2), tolerance=0),
    lambda c: st.families(c, "w", (1, 2), places=-1),
    lambda c: st.Collocation(c.system, degree=0),
    lambda c: st.Collocation(c.system, winding=dict(x=1)),
    lambda c: st.Shooting(c.system, segments=0),
    lambda c: st.Equilibrium(c.system),
    lambda c: st.solve(st.Collocation(st.models.van_der_pol())),
])  # fmt: skip
def test_bad_input_is_typed(call):
    with pytest.raises(st.errors.StabilityError):
        call(st.Collocation(CASES["asymmetric"][0]))


def test_a_bilinear_spring_doubles_where_its_simulation_does():
    # x'' + .1 x' + x + 8 max(x - 1, 0) = cos w t: two doublings, between which the motion repeats after 2 T.
    k = sp.Symbol("k")
    system = oscillator(-d * x.diff(t) - x - k * sp.Max(x - 1, 0) + F * sp.cos(w * t), d=0.1, k=8.0, F=1.0, w=1.0)
    branch = st.continuation(st.Shooting(system), "w", (0.5, 0.6))
    low, high = branch.of_kind(st.Kind.PERIOD_DOUBLING)
    assert low.params["w"] < high.params["w"]
    swing = st.continuation(st.switch(low), "w", (0.5, 0.6))
    assert swing.status is st.Status.CLOSED_LOOP

    def strobes(value):
        period = 2 * np.pi / value
        run = solve_ivp(
            lambda s, q: [q[1], -0.1 * q[1] - q[0] - 8 * max(q[0] - 1, 0) + np.cos(value * s)],
            (0, 160 * period),
            [1.0, 0.0],
            rtol=1e-8,
            atol=1e-9,
            max_step=0.2,
            t_eval=np.array([158, 159, 160]) * period,
        )  # fmt: skip
        return run.y[0]

    for value in (0.522, 0.530, 0.540):
        one, two, three = strobes(value)
        doubled = low.params["w"] < value < high.params["w"]
        assert abs(one - three) < 1e-4 and (abs(one - two) > 1e-2) == doubled
        if doubled:
            own = [o for o in swing.at(w=value) if o.verdict is st.Verdict.STABLE]
            assert own and min(abs(o(0.0)[0] - v) for o in own for v in (one, two)) < 1e-4
