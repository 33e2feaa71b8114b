"""The warning of an open resonance. Witness: closed form, the peak of one-term balance exists for beta < 16 xi^2/3 only."""

import warnings

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import OpenResonanceWarning
from stability.following import open_resonance

XI = 0.02
LIMIT = 16 * XI**2 / 3


def warned(problem, name="Omega", window=(0.3, 3.0)):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        st.continuation(problem, name, window)
    return [w for w in caught if w.category is OpenResonanceWarning]


PROBLEMS = {
    "collocation": st.Collocation,
    "harmonic balance": lambda system: st.HarmonicBalance(system, harmonics=7),
    "shooting": st.Shooting,
    "averaging": lambda system: st.Equilibrium(st.averaging(system)),
}


@pytest.mark.parametrize("method", PROBLEMS)
@pytest.mark.parametrize(("share", "number"), [(0.5, 0), (0.99, 0), (1.01, 1), (10.0, 1)])
def test_duffing_on_a_moving_base(method, share, number):
    """Above the limit one warning, that names the system; below none, also where the peak lies beyond the window."""
    system = st.models.duffing(xi=XI, beta=share * LIMIT)
    found = warned(PROBLEMS[method](system))
    assert len(found) == number
    if found:
        text = str(found[0].message)
        assert "open resonance of 'duffing" in text and "constant acceleration" in text
        assert found[0].filename == __file__  # the caller's line, not the library's


def test_share_of_the_damping_force():
    """Far out on the backbone D/F = 4 xi/sqrt(3 beta)."""
    (found,) = warned(st.Collocation(st.models.duffing(xi=XI, beta=4 * LIMIT)))
    assert f"({4 * XI / (12 * LIMIT) ** 0.5:.2f} of it" in str(found.message)


def rubbing(force: float) -> st.System:
    """u'' + u + 0.3 sign(u') = force cos(w t): a straight backbone; D = 1.2/pi stays below F = 2."""
    t, w = sp.symbols("t w", real=True)
    u = sp.Function("u")(t)
    equation = force * sp.cos(w * t) - sp.Rational(3, 10) * sp.sign(u.diff(t)) - u
    return st.System.from_equations({u.diff(t, 2): equation}, [u], parameters=dict(w=2.0), period=2 * sp.pi / w)


QUIET = {
    "dry friction above the resonance": (lambda: st.Collocation(rubbing(2.0), accuracy=1e-4), "w", (2.5, 1.5)),
    "dry friction below the resonance": (lambda: st.Collocation(rubbing(2.0), accuracy=1e-3), "w", (0.8, 0.7)),
    "window ends before the peak": (lambda: st.Collocation(st.models.duffing(xi=XI, beta=0.001)), "Omega", (0.3, 1.2)),
    "window ends before the resonance": (lambda: st.Collocation(st.models.duffing(xi=XI, beta=0.05)), "Omega", (0.3, 0.8)),
    "linear": (lambda: st.Collocation(st.models.duffing(xi=XI, beta=0.0)), "Omega", (0.3, 3.0)),
    "force of constant amplitude": (lambda: st.Collocation(st.models.duffing_textbook(gamma=2.0)), "omega", (0.3, 2.0)),
    "constant acceleration": (lambda: st.Collocation(st.models.duffing.from_physical(acceleration=5.0)), "frequency", (5, 40)),
    "another parameter": (lambda: st.Collocation(st.models.duffing(Omega=1.2)), "beta", (0.0, 3.0)),
    "two degrees of freedom": (lambda: st.Collocation(st.models.chain(beta1=0.05)), "Omega", (0.3, 0.6)),
}  # fmt: skip


@pytest.mark.parametrize("case", QUIET)
def test_no_warning_without_reason(case):
    problem, name, window = QUIET[case]
    assert not warned(problem(), name, window)


def test_physical_units():
    """The same oscillator in SI at constant base amplitude: beta = k3 A^2/k1."""
    for share, number in ((0.5, 0), (3.0, 1)):
        amplitude, k1, m = 1e-3, 400.0, 0.04
        k3 = share * LIMIT * k1 / amplitude**2
        system = st.models.duffing.from_physical(
            mass=m, stiffness=k1, cubic=k3, damping=2 * XI * (k1 * m) ** 0.5, amplitude=amplitude
        )
        assert len(warned(st.Collocation(system), "frequency", (5, 60))) == number


def test_all_amplitudes_at_once_as_one_after_the_other(monkeypatch):
    """The share by Newton's method at all amplitudes together is that of the walk from one to the next: 300 systems."""
    t = sp.Symbol("t", real=True)
    names = "Omega xi beta eta drag rub tune lift"
    w, xi, beta, eta, drag, rub, tune, lift = sp.symbols(names, real=True)
    q = sp.Function("q")(t)
    v = q.diff(t)
    force = w**2 * sp.cos(w * t) * (1 + lift * q) - 2 * xi * w**tune * v - q - beta * q**3 - eta * q**5
    system = st.System.from_equations(
        {q.diff(t, 2): force - drag * v * sp.Abs(v) - rub * sp.sign(v)}, [q],
        parameters=dict(zip(names.split(), (1.0,) * 8)), period=2 * sp.pi / w,
    )  # fmt: skip
    problem, random = st.Collocation(system), np.random.default_rng(3)
    open_ones = 0
    for _ in range(300):
        stiffening = random.choice([-1, 1, 1]) * 10 ** random.uniform(-4, 0)
        p = system.parameter_vector(
            Omega=1.0, xi=random.uniform(0.001, 0.05), beta=stiffening, eta=random.choice([0.0, 1e-4]),
            drag=random.choice([0.0, 0.0, 0.0, 1e-3]), rub=random.choice([0.0, 0.01]), tune=random.choice([0, 0, 1]),
            lift=random.choice([0.0, 0.3]),
        )  # fmt: skip
        balance, amplitude = open_resonance._of_oscillator(problem, p, 0), random.uniform(3.0, 30.0)
        value = abs(1 + 0.75 * p[2] * amplitude**2) ** 0.5
        once = open_resonance._share(balance, amplitude, value)
        monkeypatch.setattr(open_resonance, "_at_once", lambda *_: None)
        turns = open_resonance._share(balance, amplitude, value)
        monkeypatch.undo()
        assert once == turns or abs(once - turns) < 1e-6 * abs(turns)
        open_ones += once < 1
    assert 30 < open_ones < 270


def test_the_amplitude_at_an_end_is_that_of_the_measures():
    """2 |c_1| by the stages of the mesh, beside the polynomials of twice the degree that `measures` uses."""
    branch = st.continuation(st.Collocation(st.models.duffing(xi=XI, beta=0.001)), "Omega", (0.9, 1.1))
    for i in range(len(branch)):
        problem, u, p = branch._problem(i), branch.unknowns[i], branch._vector(i)
        expected = problem.measures(u, p)["u.amplitude(1)"]
        assert abs(open_resonance._amplitude(problem, u, p) - expected) < 1e-8 * expected


def test_a_field_that_fails_far_out_costs_no_branch_and_says_so(monkeypatch):
    """The branch is finished when the question is asked: it stays, and that there is no answer is told."""

    def fails(*_):
        raise ArithmeticError("beyond its range")

    monkeypatch.setattr(open_resonance, "_share", fails)
    with pytest.warns(st.errors.StabilityWarning, match="is not known: .*ArithmeticError: beyond its range"):
        branch = st.continuation(st.Collocation(st.models.duffing(xi=0.02, beta=0.05)), "Omega", (0.3, 3.0))
    assert branch.status is st.Status.PARAMETER_BOUND
