"""Issue E from outside: averaging, harmonic balance, backbones and their comparison.

Witness: averages by numerical quadrature, Galerkin's residual by numpy's FFT, own shooting (`independent_witness`), periods
of conservative motion by quadrature, transfer functions of a chain by numpy.linalg.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import sympy as sp
from independent_witness import CONDITIONS, at, flow, locate, polish
from scipy.integrate import quad

import stability as st

t = sp.Symbol("t")
q = sp.Function("x")(t)
e, d, F, w, c2, c3, mu = sp.symbols("e d F w c2 c3 mu")


def oscillator(acceleration, **parameters):
    """x'' = acceleration, as a user writes it."""
    return st.System.from_equations({q.diff(t, 2): acceleration}, [q], parameters=parameters)


def with_term(term):
    """x'' + d x' + x + e term = F cos(w t)."""
    return oscillator(-d * q.diff(t) - q - e * term + F * sp.cos(w * t), e=0.3, d=0.1, F=0.4, w=0.7)


def averaged(term, cos, sin, value, parameters):
    """(x_cos', x_sin') by quadrature: x = c cos + s sin, x' = w (-c sin + s cos), x'' + w^2 x = g."""

    def g(s):
        x, v = cos * np.cos(s) + sin * np.sin(s), value * (-cos * np.sin(s) + sin * np.cos(s))
        return (value**2 - 1) * x - term(x, v, parameters) + parameters["F"] * np.cos(s)

    half = 1 / (2 * np.pi * value)
    return (
        -half * quad(lambda s: g(s) * np.sin(s), 0, 2 * np.pi, limit=400, epsabs=1e-12)[0],
        half * quad(lambda s: g(s) * np.cos(s), 0, 2 * np.pi, limit=400, epsabs=1e-12)[0],
    )


@pytest.mark.parametrize(("term", "own"), [
    (e * q**5 + d * q.diff(t), lambda x, v, p: p["e"] * x**5 + p["d"] * v),
    (e * q**3 + d * sp.Abs(q.diff(t)) * q.diff(t), lambda x, v, p: p["e"] * x**3 + p["d"] * abs(v) * v),
    (e * sp.Abs(q) ** sp.Rational(3, 2) * sp.sign(q) + d * sp.sign(q.diff(t)),
     lambda x, v, p: p["e"] * abs(x) ** 1.5 * np.sign(x) + p["d"] * np.sign(v)),
    (-e * (1 - q**2) * q.diff(t) + d * q**2 * q.diff(t) ** 2 * q,
     lambda x, v, p: -p["e"] * (1 - x**2) * v + p["d"] * x**3 * v**2),
], ids=["quintic", "quadratic drag", "power and dry friction", "van der Pol"])  # fmt: skip
def test_slow_flow_is_the_average_by_quadrature(term, own):
    values = dict(e=0.2, d=0.07, F=0.3, w=1.2)
    slow = st.averaging(oscillator(-q - term + F * sp.cos(w * t), **values), small=("e", "d", "F"))
    rng = np.random.default_rng(5)
    for cos, sin in rng.uniform(-1.5, 1.5, (4, 2)):
        ours = averaged(own, cos, sin, 1.2, values)
        assert np.allclose(slow(0.0, np.array([cos, sin])), ours, atol=1e-8)


def test_second_order_backbone_of_an_asymmetric_spring():
    # x'' + x + c2 x^2 + c3 x^3 = 0: omega = 1 + (3 c3/8 - 5 c2^2/12) a^2 + ..., and the period by energy.
    system = oscillator(-q - c2 * q**2 - c3 * q**3, c2=0.3, c3=0.1)
    backbone = st.continuation(st.Backbone(system), "amplitude", (0.01, 0.8))
    a, omega = backbone.columns["amplitude"], backbone.columns["omega"]
    small = a < 0.1
    assert np.allclose(omega[small] - 1, (3 * 0.1 / 8 - 5 * 0.09 / 12) * a[small] ** 2, atol=30 * 0.1**4 * 0.1)
    law = st.frequency_law(
        oscillator(-q - c2 * q**2 - c3 * q**3, c2=0.3, c3=0.1).replace(orders=dict(c2=1, c3=2)), order=2
    )
    symbol = next(s for s in law.free_symbols if s.name == "a")
    coefficient = (
        sp.expand(law).subs({s: dict(c2=0.3, c3=0.1)[s.name] for s in law.free_symbols - {symbol}}).coeff(symbol, 2)
    )
    assert abs(float(coefficient) - (3 * 0.1 / 8 - 5 * 0.09 / 12)) < 1e-12
    for i in (len(backbone) // 2, len(backbone) - 1):
        orbit = backbone.solution(i)
        high, low = orbit.max["x"], orbit.min["x"]

        def potential(x):
            return x**2 / 2 + 0.1 * x**3 + 0.025 * x**4

        middle, radius = (high + low) / 2, (high - low) / 2
        energy = potential(high)
        assert abs(potential(low) - energy) < 1e-8

        def integrand(s, m=middle, r=radius, h=energy):
            x = m + r * np.sin(s)
            return r * np.cos(s) / np.sqrt(max(2 * (h - potential(x)), 1e-300))

        period = 2 * quad(integrand, -np.pi / 2 + 1e-7, np.pi / 2 - 1e-7, limit=400)[0]
        assert abs(orbit.period / period - 1) < 1e-6


def test_hopf_of_the_slow_flow_converges_to_the_torus_point():
    # x'' - m (1 - x^2) x' + x = m f cos(w t), m -> 0: both at w = 1 + O(m), their distance O(m^2).
    distances = []
    for m in (0.2, 0.1, 0.05):
        system = oscillator(mu * (1 - q**2) * q.diff(t) - q + F * sp.cos(w * t), mu=m, F=1.5 * m, w=1.0)
        window = ("w", (1.0, 1.0 + 1.5 * m))
        full = st.continuation(st.Collocation(system), *window, start=dict(x=2.0))
        slow = st.continuation(st.Equilibrium(st.averaging(system, small=("mu", "F"))), *window)
        torus, hopf = full.of_kind(st.Kind.NEIMARK_SACKER), slow.of_kind(st.Kind.HOPF)
        assert len(torus) == len(hopf) == 1
        distances.append(abs(torus[0].params["w"] - hopf[0].params["w"]))
    assert distances[0] / distances[1] > 3.0 and distances[1] / distances[2] > 3.0


def test_harmonic_balance_fulfils_galerkin_by_fft():
    system = with_term(q**2 + q**3)
    orbit = st.solve(st.HarmonicBalance(system, harmonics=2))
    samples = 64
    x = orbit(np.arange(samples) * orbit.period / samples)[0]
    c = np.fft.rfft(x) / samples
    assert abs(c[3:]).max() < 1e-11
    k = np.arange(len(c)) * 0.7
    residual = (1 - k**2 + 0.1j * k) * c + 0.3 * np.fft.rfft(x**2 + x**3) / samples
    residual[1] -= 0.2
    assert abs(residual[:3]).max() < 1e-9
    assert abs(residual[3]) > 1e-3  # not a solution of the full equation, and it says so
    assert orbit.error > 1e-3


TERMS = {
    "sin": (sp.sin(q), lambda x: np.sin(x), lambda x: np.cos(x)),
    "exp": (sp.exp(q), lambda x: np.exp(x), lambda x: np.exp(x)),
    "|x| x": (sp.Abs(q) * q, lambda x: abs(x) * x, lambda x: 2 * abs(x)),
    "x^12": (q**12 / 10, lambda x: x**12 / 10, lambda x: 1.2 * x**11),
    "1/(2+x)": (1 / (2 + q), lambda x: 1 / (2 + x), lambda x: -1 / (2 + x) ** 2),
    "max": (sp.Max(q, 0), lambda x: max(x, 0.0), lambda x: float(x > 0)),
}


@pytest.mark.parametrize("name", TERMS)
def test_terms_through_harmonic_balance_by_own_shooting(name):
    term, function, slope = TERMS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.TruncationWarning)
        orbit = st.solve(st.HarmonicBalance(with_term(term), harmonics=31))
    x0, matrix = polish(
        lambda s, y: np.array([y[1], -0.1 * y[1] - y[0] - 0.3 * function(y[0]) + 0.4 * np.cos(0.7 * s)]),
        lambda s, y: np.array([[0.0, 1.0], [-1 - 0.3 * slope(y[0]), -0.1]]), orbit(0.0), orbit.period)  # fmt: skip
    assert abs(orbit(0.0) - x0).max() < max(1e-7, 3 * orbit.error)
    assert orbit.error < (1e-4 if name in ("|x| x", "max") else 1e-8)
    assert orbit.verdict is st.Verdict.STABLE and abs(np.linalg.eigvals(matrix)).max() < 1


@pytest.mark.parametrize(("name", "shown"), [("exp", "exp"), ("1/(2+x)", "x"), ("max", "Max")])
def test_averaging_refuses_by_name(name, shown):
    with pytest.raises(st.errors.EquationError, match="HarmonicBalance") as caught:
        st.averaging(with_term(TERMS[name][0]), small=("e", "d", "F"))
    assert shown in str(caught.value)


def test_no_wrong_verdict_at_any_number_of_harmonics():
    # A parametric drive with a skew spring: every verdict of the balance is right, missing, or comes with a warning.
    system = oscillator(-d * q.diff(t) - (1 + e * sp.cos(w * t)) * q - c2 * q**2 - c3 * q**3 + F * sp.cos(w * t),
                        d=0.05, e=0.5, c2=0.4, c3=0.3, F=0.2, w=1.6)  # fmt: skip
    exact = st.continuation(st.Collocation(system), "w", (1.3, 2.4))
    seen = 0
    for harmonics in (1, 2, 3, 5, 9):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            branch = st.continuation(st.HarmonicBalance(system, harmonics=harmonics), "w", (1.3, 2.4))
        warned = any(issubclass(c.category, st.errors.TruncationWarning) for c in caught)
        for value in (1.5, 1.75, 1.9, 2.0, 2.3):
            true = sorted((o.max["x"], str(o.verdict)) for o in exact.at(w=value))
            for orbit in branch.at(w=value):
                nearest = min(true, key=lambda pair: abs(pair[0] - orbit.max["x"]))
                agree = str(orbit.verdict) in (nearest[1], "undetermined")
                assert agree or warned, (harmonics, value)
                seen += str(orbit.verdict) == nearest[1]
        if harmonics == 9:
            assert not warned and branch.labels == exact.labels
    assert seen > 15


def chain_model(k3, xi, force):
    """(f, J, T) of three unit masses on cubic springs, base - a - b - c, force on the last."""
    B = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])

    def f(s, y, v):
        stretch, rate = B @ y[:3], B @ y[3:]
        load = np.array([0.0, 0.0, force * np.cos(v * s)])
        return np.concatenate([y[3:], load - B.T @ (stretch + k3 * stretch**3 + xi * rate)])

    def jacobian(s, y, v):
        stiffness = B.T @ np.diag(1 + 3 * k3 * (B @ y[:3]) ** 2) @ B
        return np.block([[np.zeros((3, 3)), np.eye(3)], [-stiffness, -xi * B.T @ B]])

    return f, jacobian, lambda v: 2 * np.pi / v


def chain_system():
    """The same, as a user writes it."""
    k3, xi = sp.symbols("k3 xi")
    coordinates = [sp.Function(n)(t) for n in "abc"]
    stretch = [coordinates[0], coordinates[1] - coordinates[0], coordinates[2] - coordinates[1]]
    force = [s + k3 * s**3 + xi * s.diff(t) for s in stretch]
    return st.System.from_equations({
        coordinates[0].diff(t, 2): force[1] - force[0],
        coordinates[1].diff(t, 2): force[2] - force[1],
        coordinates[2].diff(t, 2): F * sp.cos(w * t) - force[2],
    }, coordinates, parameters=dict(k3=0.3, xi=0.03, F=0.05, w=0.4))  # fmt: skip


def test_three_masses_by_linear_algebra_and_own_shooting():
    system = chain_system()
    B = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])
    K = B.T @ B
    linear = st.solve(st.HarmonicBalance(system.with_params(k3=0.0), harmonics=1), w=0.7)
    X = np.linalg.solve(K + 0.7j * 0.03 * K - 0.49 * np.eye(3), [0, 0, 0.05])
    assert np.allclose([linear.amplitude(1)[n] for n in "abc"], abs(X), rtol=1e-9)
    collocation = st.continuation(st.Collocation(system), "w", (0.42, 0.65))
    balance = st.continuation(st.HarmonicBalance(system), "w", (0.42, 0.65))
    assert collocation.labels == balance.labels == ("LP1", "LP2")
    for label in balance.labels:
        assert abs(balance[label].params["w"] - collocation[label].params["w"]) < 1e-7
    point = collocation["LP2"]
    own = locate(chain_model(0.3, 0.03, 0.05), point.solution(0.0), point.params["w"], CONDITIONS["LP"])
    assert abs(own - point.params["w"]) < 1e-9
    for mode, frequency in enumerate(np.sqrt(np.linalg.eigvalsh(K)), 1):
        backbone = st.continuation(st.Backbone(system.with_params(xi=0.0), mode=mode), "amplitude", (0.001, 0.3))
        assert abs(backbone.columns["omega"][0] - frequency) < 1e-5
        orbit = backbone.solution(len(backbone) - 1)
        end, _ = flow(*at(chain_model(0.3, 0.0, 0.0), 1.0), orbit(0.0), orbit.period)
        assert np.allclose(end, orbit(0.0), atol=1e-7)


def test_comparison_counts_what_a_method_misses():
    system = oscillator(-d * q.diff(t) - q - c3 * q**3 + F * sp.cos(w * t), d=0.1, c3=0.5, F=0.5, w=1.0)
    full = st.continuation(st.Collocation(system), "w", (0.6, 2.0))
    good = st.continuation(st.HarmonicBalance(system, harmonics=9), "w", (0.6, 2.0))
    up = st.continuation(st.HarmonicBalance(system, harmonics=9), "w", (0.6, 2.0), stop_at=("LP",))
    low, high = sorted(p.params["w"] for p in full.of_kind(st.Kind.FOLD))
    whole = st.compare(full, good, points=29)["harmonic balance 9"]
    assert whole.worst < 1e-8 and not len(whole.missing)
    half = st.compare(full, up, points=29)["harmonic balance 9"]
    assert len(half.missing) >= 10  # two solutions at every value between the folds
    assert all(low < row[0] < high for row in half.missing)
    assert len(whole.folds) == 2 and all(abs(a - b) < 1e-8 for a, b in whole.folds)


def test_responses_reports_failures_and_goes_on():
    system = oscillator(-d * q.diff(t) - sp.exp(q) + 1 + F * sp.cos(w * t), d=0.1, F=0.1, w=1.0)
    found = st.responses(system, "w", (0.6, 1.4), ("averaging", "hb9", "collocation"), points=9)
    assert list(found.failures) == ["averaging"]
    assert found.comparison["hb9"].worst < 1e-6
    for bad in (("magic",), ("hb3", "hb3"), ()):
        with pytest.raises(st.errors.StabilityError):
            st.responses(system, "w", (0.6, 1.4), bad)


def test_doubled_orbits_of_the_balance():
    system = oscillator(-d * q.diff(t) - (1 + e * sp.cos(w * t)) * q - c3 * q**3, d=0.05, e=0.3, c3=0.5, w=2.0)
    rest = st.continuation(st.HarmonicBalance(system, harmonics=5), "w", (1.6, 2.4))
    swing = st.continuation(st.switch(rest["PD1"]), "w", (1.6, 2.4))
    (orbit,) = [o for o in swing.at(w=2.0) if o.verdict is st.Verdict.STABLE]
    x0, _ = polish(
        lambda s, y: np.array([y[1], -0.05 * y[1] - (1 + 0.3 * np.cos(2 * s)) * y[0] - 0.5 * y[0] ** 3]),
        lambda s, y: np.array([[0.0, 1.0], [-1 - 0.3 * np.cos(2 * s) - 1.5 * y[0] ** 2, -0.05]]),
        orbit(0.0), 2 * np.pi)  # fmt: skip
    assert abs(orbit.period - 2 * np.pi) < 1e-12 and np.allclose(x0, orbit(0.0), atol=1e-6)
    assert abs(orbit.amplitude(0.5)["x"]) > 0.5


@pytest.mark.parametrize("call", [
    lambda s: st.HarmonicBalance(s, harmonics=0),
    lambda s: st.HarmonicBalance(s, harmonics=2.5),
    lambda s: st.HarmonicBalance(s, harmonics=3, samples=8),
    lambda s: st.HarmonicBalance(st.models.van_der_pol(), harmonics=5, subharmonic=3),
    lambda s: st.averaging(s),
    lambda s: st.averaging(s, small=("e", "d", "F"), resonance=(5, 1)),
    lambda s: st.averaging(s, small=("e", "d", "F"), order=0),
    lambda s: st.averaging(s, small=("nonsense",)),
    lambda s: st.multiple_scales(s),
])  # fmt: skip
def test_bad_input_is_typed(call):
    with pytest.raises(st.errors.StabilityError):
        call(with_term(q**3))
