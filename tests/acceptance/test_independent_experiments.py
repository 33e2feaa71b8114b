"""Issue F from outside: simulation, impacts, sweeps, basins, measured files and the command line, as a user meets them.

Witness: closed forms derived here (impact orbits, free flight, elliptic functions by mpmath, times of escape by
quadrature), solve_ivp, files written by hand, and the command line in a process of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import mpmath
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import stability as st

t = sp.Symbol("t")
q = sp.Function("x")(t)
d, F, w, k, c3, grav = sp.symbols("d F w k c3 grav")


def oscillator(acceleration, stops=(), **parameters):
    """x'' = acceleration, as a user writes it."""
    return st.System.from_equations({q.diff(t, 2): acceleration}, [q], parameters=parameters, stops=stops)


# ---- impacts

XI, GAP, E = 0.04, 2.5, 0.65


def one_impact(Omega):
    """[(impact speed, u(s))]: orbits of u'' + 2 xi u' + u = Omega^2 cos with one impact u = gap a period, at s = 0.

    u = e^(-xi s) (C cos + S sin)(wd s) + p cos - r sin: from u(0) = u(T) = gap and v(0) = -e v(T) all are multiples of one
    unknown, and p^2 + r^2 = A^2 is a quadratic.
    """
    wd, T = np.sqrt(1 - XI**2), 2 * np.pi / Omega
    A2 = Omega**4 / ((1 - Omega**2) ** 2 + (2 * XI * Omega) ** 2)

    def free(s):
        c, n, g = np.cos(wd * s), np.sin(wd * s), np.exp(-XI * s)
        return g * np.array([[c, n], [-XI * c - wd * n, -XI * n + wd * c]])

    first, last = free(0.0), free(T)
    row = (first - last)[0]
    ray = np.array([-row[1], row[0]]) / np.hypot(*row)
    kick = (first[1] + E * last[1]) @ ray / (Omega * (1 + E))
    found = []
    for size in np.roots([ray[0] ** 2 + kick**2, -2 * GAP * ray[0], GAP**2 - A2]):
        if abs(size.imag) < 1e-12:
            C, S = size.real * ray
            p, r = GAP - C, size.real * kick
            speed = last[1] @ [C, S] - Omega * r
            if speed > 0:
                found.append((speed, lambda s, C=C, S=S, p=p, r=r: (free(s)[0] @ [C, S]) + p * np.cos(Omega * s)
                              - r * np.sin(Omega * s)))  # fmt: skip
    return found


def discriminant(Omega):
    """Zero where the two orbits of `one_impact` meet: a fold."""
    wd, T = np.sqrt(1 - XI**2), 2 * np.pi / Omega
    c, n, g = np.cos(wd * T), np.sin(wd * T), np.exp(-XI * T)
    ray = np.array([g * n, 1 - g * c])
    kick = ((-XI * ray[0] + wd * ray[1]) + E * g * ((-XI * c - wd * n) * ray[0] + (-XI * n + wd * c) * ray[1])) / (
        Omega * (1 + E)
    )
    A2 = Omega**4 / ((1 - Omega**2) ** 2 + (2 * XI * Omega) ** 2)
    return GAP**2 * ray[0] ** 2 - (ray[0] ** 2 + kick**2) * (GAP**2 - A2)


def test_impact_orbits_and_grazing_by_own_closed_form():
    system = st.models.hard_stop_oscillator(xi=XI, gap=GAP, restitution=E, sides="above")
    quiet = st.continuation(st.Shooting(system), "Omega", (0.5, 2.0))
    graze = brentq(lambda s: s**4 / ((1 - s * s) ** 2 + (2 * XI * s) ** 2) - GAP**2, 0.5, 1.0)
    assert abs(quiet["GR1"].params["Omega"] - graze) < 1e-9
    knocking = st.continuation(st.switch(quiet["GR1"]), "Omega", (0.5, 2.0))
    for value in (0.95, 1.1, 1.3):
        own = sorted(speed for speed, _ in one_impact(value))
        orbits = knocking.at(Omega=value)
        assert orbits
        for orbit in orbits:
            s = np.linspace(0, orbit.period, 40001)
            lowest = [min(u(x) for x in s[::40]) for _, u in one_impact(value)]
            assert min(abs(orbit.min["u"] - v) for v in lowest) < 1e-3
            product = np.prod(orbit.multipliers)
            assert abs(product - E**2 * np.exp(-2 * XI * orbit.period)) < 1e-8  # Liouville with saltation
        assert own[-1] > 0
    point = knocking["LP1"]
    near = point.params["Omega"]
    assert abs(brentq(discriminant, near - 1e-3, near + 1e-3, xtol=1e-13) - near) < 1e-8
    run = st.simulate(system, (0, 400 * 2 * np.pi / 1.2), Omega=1.2, rtol=1e-11)
    speeds = [h.before[1] for h in run.events[-3:]]
    assert min(abs(speeds[-1] - speed) for speed, _ in one_impact(1.2)) < 1e-8


def test_bouncing_ball_until_it_rests():
    # Dropped from h: impacts at t0 (1 + 2 e + 2 e^2 + ...), at rest from t0 (1 + e)/(1 - e) on.
    e, height = 0.6, 2.0
    ball = oscillator(-grav, stops=(st.HardStop("x", 0.0, side=-1, restitution=e),), grav=9.81)
    run = st.simulate(ball, (0, 5.0), x0=dict(x=height), rtol=1e-11)
    first = np.sqrt(2 * height / 9.81)
    times = [h.t for h in run.events if h.kind == "impact"][:8]
    own = first + 2 * first * np.cumsum(np.concatenate([[0.0], e ** np.arange(1, 8)]))
    assert np.allclose(times, own, atol=1e-10)
    assert np.allclose(run(first * (1 + e) / (1 - e) + 0.1), 0.0, atol=1e-9)
    assert abs(run(first + first * e)[0] - e**2 * height) < 1e-9


def test_elastic_stops_conserve_energy_and_count():
    # x'' + x = 0 between +-1 at energy 2: a flight from wall to wall takes 2 asin(1/2), 100 impacts.
    box = oscillator(-q, stops=(st.HardStop("x", 1.0, side=1, restitution=1.0),
                                st.HardStop("x", -1.0, side=-1, restitution=1.0)))  # fmt: skip
    flight = 2 * np.arcsin(0.5)
    run = st.simulate(box, (0, flight * 100), x0=dict(x_dot=2.0), rtol=1e-12)
    assert len([h for h in run.events if h.kind == "impact"]) == 100
    end = run.final
    assert abs(end[0] ** 2 + end[1] ** 2 - 4.0) < 1e-10
    assert np.allclose(np.diff([h.t for h in run.events]), flight, atol=1e-10)


def test_a_one_sided_spring_by_its_two_half_periods():
    one = oscillator(-q - k * sp.Max(q, 0), k=3.0)
    run = st.simulate(one, (0, 30.0), x0=dict(x=1.0), rtol=1e-12)
    up = run.crossings("x", 0.5, +1)
    assert len(up) == 6 and np.allclose(np.diff(up), np.pi + np.pi / 2, atol=1e-9)
    assert np.allclose(run.min["x"], -2.0, atol=1e-9)


# ---- accuracy, escape, rotation


def test_duffing_by_elliptic_functions_and_its_energy():
    # x'' + x + 2 x^3 = 0, x(0) = 1: cn(sqrt 3 t | m = 1/3).
    system = oscillator(-q - c3 * q**3, c3=2.0)
    run = st.simulate(system, (0, 20.0), x0=dict(x=1.0), rtol=1e-11, atol=1e-13)
    for s in (3.0, 11.0, 20.0):
        own = mpmath.ellipfun("cn", mpmath.sqrt(3) * s, m=mpmath.mpf(1) / 3)
        assert abs(run(s)[0] - float(own)) < 1e-9
    period = float(4 * mpmath.ellipk(mpmath.mpf(1) / 3) / mpmath.sqrt(3))
    long = st.simulate(system, (0, 1000 * period), x0=dict(x=1.0), rtol=1e-12, atol=1e-14)
    x, v = long.final
    assert abs((v * v / 2 + x * x / 2 + x**4 / 2) / 1.0 - 1) < 1e-9


def test_escape_over_a_softening_spring_at_the_right_time():
    soft = oscillator(-q + c3 * q**3, c3=1.0)
    run = st.simulate(soft, (0, 100.0), x0=dict(x=1.2))
    energy = 1.2**2 / 2 - 1.2**4 / 4
    # v^2 = (x^2 - 1.44)(x^2 - 0.56)/2 with x = 1.2/cos(s)
    own = quad(lambda s: np.sqrt(2) / np.cos(s) / np.sqrt((1.2 / np.cos(s)) ** 2 - 0.56), 0, np.pi / 2 - 1e-9)[0]
    assert abs(energy - (0.5 * 1.44 - 0.25 * 1.44**2)) < 1e-15
    assert str(run.status) == "diverged" or "diverged" in repr(run)
    assert abs(run.span[1] - own) < 1e-3 and np.isfinite(run.x).all()


def test_turns_of_a_rotating_pendulum():
    # phi'^2/2 - cos phi = E: time of a turn 4 K(m)/sqrt(2 (E + 1)) / 2, m = 2/(E + 1).
    phi = sp.Function("phi")(t)
    pendulum = st.System.from_equations({phi.diff(t, 2): -sp.sin(phi)}, [phi], angles=("phi",))
    energy = 3.5
    turn = float(2 * mpmath.ellipk(mpmath.mpf(2) / (energy + 1))) * np.sqrt(2 / (energy + 1))
    run = st.simulate(pendulum, (0, 7 * turn), x0=dict(phi_dot=np.sqrt(2 * (energy + 1))), rtol=1e-11)
    assert abs(run.turns("phi") - 7) < 1e-8


def test_frequencies_of_a_sum_of_two_lines():
    # Undamped x'' + x = F cos w t from rest: F/(1 - w^2) (cos w t - cos t).
    system = oscillator(-q + F * sp.cos(w * t), F=0.3, w=np.sqrt(2.0))
    found = st.simulate(system, (0, 1500.0), rtol=1e-11).frequencies("x")
    assert found.quasiperiodic
    assert np.allclose(np.sort(found.frequency[:2]), np.sort([1, np.sqrt(2)]) / (2 * np.pi), atol=1e-9)
    assert np.allclose(found.amplitude[:2], 0.3, atol=1e-6)


def test_lyapunov_of_a_linear_oscillator_and_lorenz_divergence():
    linear = st.lyapunov(oscillator(-q - d * q.diff(t), d=0.3), 300.0, x0=dict(x=1.0))
    assert np.allclose(linear.exponents, -0.15, atol=0.01)
    chaos = st.lyapunov(st.models.lorenz(), 300.0, x0=[1.0, 1.0, 20.0])
    assert abs(chaos.exponents.sum() + 10 + 1 + 8 / 3) < 1e-3
    assert abs(chaos.exponents[0] - 0.9056) < 4 * chaos.error[0] + 0.01 and chaos.chaotic


# ---- sweeps, basins


def test_sweep_of_a_linear_oscillator_is_its_transfer_function():
    system = oscillator(-q - d * q.diff(t) + F * sp.cos(w * t), d=0.2, F=0.7, w=1.0)
    run = st.sweep(system, "w", (0.6, 1.5), step=0.1, periods=60)
    H = 0.7 / (1 - run.parameter**2 + 0.2j * run.parameter)
    assert np.allclose(run.amplitude()["x"], abs(H), rtol=1e-3)
    assert np.allclose(run.phase()["x"], np.angle(H), atol=2e-3)
    assert run.settled.all() and not run.jumps
    back = st.sweep(system, "w", (1.5, 0.6), step=0.1, periods=60, start="rest")
    assert np.allclose(back.amplitude()["x"][::-1], run.amplitude()["x"], rtol=2e-3)


def test_sweep_jumps_after_the_fold_and_never_before():
    system = oscillator(-d * q.diff(t) - q - c3 * q**3 + F * sp.cos(w * t), d=0.1, c3=0.5, F=0.5, w=1.0)
    branch = st.continuation(st.Collocation(system), "w", (0.6, 2.2))
    low, high = sorted(p.params["w"] for p in branch.of_kind(st.Kind.FOLD))
    up = st.sweep(system, "w", (1.0, 2.2), step=0.05, periods=120)
    down = st.sweep(system, "w", (2.2, 1.0), step=0.05, periods=120)
    assert len(up.jumps) == len(down.jumps) == 1
    assert high - 1e-3 < up.jumps[0].parameter < high + 0.02
    assert low - 0.02 < down.jumps[0].parameter < low + 1e-3
    for value, top in zip(up.parameter, up.maximum["x"], strict=True):
        if not low < value < high + 0.05:
            (orbit,) = branch.at(w=value)
            assert abs(top - orbit.max["x"]) < 5e-3 * orbit.max["x"]


def test_basins_by_own_integration():
    system = oscillator(-d * q.diff(t) - q - c3 * q**3 + F * sp.cos(w * t), d=0.2, c3=1.0, F=0.3, w=1.35)
    found = st.basins(system, x=("x", -2, 2), y=("x_dot", -2, 2), shape=(12, 12))
    assert len(found.attractors) == 2 and not found.undecided
    period, ends = 2 * np.pi / 1.35, {}
    for i, j in ((0, 0), (5, 5), (11, 3), (2, 9), (7, 1), (6, 10), (9, 6), (3, 4)):
        end = solve_ivp(lambda s, y: [y[1], -0.2 * y[1] - y[0] - y[0] ** 3 + 0.3 * np.cos(1.35 * s)], (0, 60 * period),
                        [found.x[i], found.y[j]], rtol=1e-8, atol=1e-9).y[:, -1]  # fmt: skip
        ends.setdefault(int(found.labels[j, i]), []).append(end)
    assert set(ends) == {0, 1}
    for group in ends.values():
        assert np.ptp(group, axis=0).max() < 1e-4
    assert np.abs(ends[0][0] - ends[1][0]).max() > 0.1


# ---- measured files


def test_measured_files_units_and_commas(tmp_path):
    path = tmp_path / "sweep.txt"
    path.write_text("% run 7\nFrequency [1/min];amplitude [um];phase [deg]\n1200,0;1,5;-90\n\n1260;2,5;-135\n")
    seen = st.load_response(path)
    assert np.allclose(seen.parameter, [20, 21]) and np.allclose(seen.columns["amplitude"], [1.5e-6, 2.5e-6])
    assert np.allclose(seen.columns["phase"], np.deg2rad([-90, -135]))
    path.write_bytes(b"f [kHz]\tdrive [g]\tsensor 1 [mm]\r\n0.02\t1\t2e0\r\n")
    seen = st.load_response(path, names={"sensor 1": "y.amplitude"})
    assert np.allclose(seen.parameter, 20) and np.allclose(seen.columns["drive"], 9.81)
    assert np.allclose(seen.values("y.amplitude(1)"), 2e-3)


@pytest.mark.parametrize(("text", "place"), [
    ("f [Hz], a [mm]\n20, 1\n21\n", "line 3"),
    ("f [Hz], a [mm]\n20, 1\n21, 2, 3\n", "line 3"),
    ("f [Hz], a [mm]\n20, 1\n21, broken\n", "line 3, column 2"),
    ("f [Hz], a [mm]\n20, nan\n", "line 2, column 2"),
    ("f [Hz], a [furlong]\n20, 1\n", "column 2"),
    ("f [Hz], a [mm]\n20,5, 1,5\n", "decimal commas"),
    ("20, 1\n21, 2\n", "names"),
    ("f [Hz], f [Hz]\n1, 2\n", "twice"),
    ("f [Hz], a [mm]\n", "no rows"),
    ("", "empty"),
])  # fmt: skip
def test_damaged_files_say_where(tmp_path, text, place):
    path = tmp_path / "damaged.csv"
    path.write_text(text)
    with pytest.raises(st.errors.FileFormatError, match=r"damaged\.csv") as caught:
        st.load_response(path)
    assert place in str(caught.value)


def test_a_measurement_made_by_solve_ivp_lies_on_the_branch(tmp_path):
    system = oscillator(-d * q.diff(t) - q - c3 * q**3 + F * sp.cos(w * t), d=0.2, c3=0.5, F=0.3, w=1.0)
    rows = ["w [rad/s], x.max [mm]"]
    for value in (0.7, 0.9, 1.1):
        T = 2 * np.pi / value
        run = solve_ivp(lambda s, y, v=value: [y[1], -0.2 * y[1] - y[0] - 0.5 * y[0] ** 3 + 0.3 * np.cos(v * s)],
                        (0, 40 * T), [0, 0], rtol=1e-9, atol=1e-11, dense_output=True)  # fmt: skip
        top = run.sol(np.linspace(39 * T, 40 * T, 4001))[0].max()
        rows.append(f"{value}, {1000 * float(top)!r}")
    path = tmp_path / "own.csv"
    path.write_text("\n".join(rows))
    branch = st.continuation(st.Collocation(system), "w", (0.6, 1.2))
    comparison = st.compare(branch, st.load_response(path, parameter="w"), quantity="x.max")
    assert np.abs(comparison["measured"].errors).max() < 1e-4


# ---- the command line, in a process of its own


def command(folder, *arguments):
    environment = dict(os.environ, OMP_NUM_THREADS="1", COLUMNS="200")
    code = "import sys; from stability.cli import main; sys.exit(main())"
    run = subprocess.run([sys.executable, "-c", code, *arguments], cwd=folder, env=environment, text=True,
                         capture_output=True, timeout=300, check=False)  # fmt: skip
    assert "Traceback" not in run.stderr + run.stdout
    return run


def test_commands_write_files_and_go_on_from_them(tmp_path):
    first = command(tmp_path, "continue", "duffing", "--set", "beta=0.001", "--parameter", "Omega", "--range", "0.9:1.6",
                    "-o", "b.npz", "-o", "b.csv")  # fmt: skip
    assert first.returncode == 0 and "LP1" in first.stdout and "1.38093303" in first.stdout
    stored = st.load(tmp_path / "b.npz")
    header, *lines = (tmp_path / "b.csv").read_text().splitlines()
    assert header.split(",")[0] == "Omega" and len(lines) == len(stored)
    again = command(tmp_path, "continue", "duffing", "--parameter", "Omega", "--range", "0.9:1.6", "-o", "b.npz")
    assert again.returncode == 2 and "--force" in again.stderr
    curve = command(tmp_path, "continue", "b.npz", "--locus", "LP1", "--free", "beta", "--range", "0.9:1.6", "--json")
    assert curve.returncode == 0 and json.loads(curve.stdout)
    sweep = command(tmp_path, "sweep", "duffing.from_physical", "--range", "20:21", "--step", "0.5", "--acceleration",
                    "0.5g", "-o", "s.csv")  # fmt: skip
    assert sweep.returncode == 0 and (tmp_path / "s.csv").stat().st_size > 100


@pytest.mark.parametrize("arguments", [
    ("continue", "duffing", "--parameter", "omega", "--range", "0.3:3"),
    ("continue", "duffing", "--parameter", "Omega", "--range", "0.3-3"),
    ("continue", "duffing", "--parameter", "Omega", "--range", "1:2", "-o", "nowhere/x.npz"),
    ("simulate", "nonsense"),
    ("plot", "missing.npz", "-o", "x.png"),
    ("response", "duffing", "--parameter", "Omega", "--range", "1:2", "--method", "magic"),
    ("average", "duffing", "--resonance", "2:1"),
], ids=lambda a: " ".join(a[:2]))  # fmt: skip
def test_mistakes_on_the_command_line_are_2(tmp_path, arguments):
    run = command(tmp_path, *arguments)
    assert run.returncode == 2 and "error:" in run.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("call", [
    lambda s: st.HardStop("x", 1.0, restitution=-0.1),
    lambda s: st.HardStop("x", 1.0, restitution=1.01),
    lambda s: st.simulate(s.replace(stops=(st.HardStop("x", -1.0, side=1), st.HardStop("x", 1.0, side=-1))), (0, 1)),
    lambda s: st.simulate(s, (1, 0)),
    lambda s: st.simulate(s, (0, 1), rtol=0),
    lambda s: st.simulate(s, (0, 1), x0=dict(x=float("nan"))),
    lambda s: st.simulate(s, (0, 1), x0=dict(y=1.0)),
    lambda s: st.simulate(s, (0, 1), events=dict(a="__import__('os')")),
    lambda s: st.sweep(s, "w", (1, 2), periods=3, record=5),
    lambda s: st.sweep(s, "w", (1, 2), step=-0.1),
    lambda s: st.basins(s, x=("x", 1, -1), y=("x_dot", -1, 1)),
    lambda s: st.lyapunov(s, -1.0),
])  # fmt: skip
def test_bad_input_is_typed(call):
    with pytest.raises(st.errors.StabilityError):
        call(oscillator(-q + F * sp.cos(w * t), F=0.1, w=2.0))
