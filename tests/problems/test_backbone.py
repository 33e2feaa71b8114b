"""Backbones against exact elliptic integrals, closed forms, linear modes, and responses at phase resonance."""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.special import ellipk

import stability as st
from stability.errors import InputError, UnknownNameError


def exact(z):
    """omega of u'' + u + beta u^3 = 0, z = beta A^2, A the largest displacement."""
    return np.pi * np.sqrt(1 + z) / (2 * ellipk(z / (2 * (1 + z))))


@pytest.mark.parametrize("of", ["fundamental", "max"])
@pytest.mark.parametrize("beta", [0.001, 1.0])
def test_duffing_backbone_is_the_elliptic_one(of, beta):
    """Damping and forcing fall away: omega(A) to 1e-10 from z = 1e-7 to z = 2500; the growth is 2 xi."""
    curve = st.continuation(st.Backbone(st.models.duffing(xi=0.02, beta=beta), of=of), "amplitude", (0.01, 50.0))
    A = curve.columns["u.max"]
    assert np.abs(curve.columns["omega"] / exact(beta * A**2) - 1).max() < 1e-10
    assert np.abs(curve.columns["balancing_growth"] - 0.04).max() < 1e-10
    assert np.array_equal(curve.columns["Omega"], curve.columns["omega"])
    named = {"fundamental": "u.amplitude(1)", "max": "u.max"}[of]
    assert np.abs(curve.columns[named] / curve.columns["amplitude"] - 1).max() < 1e-8


def test_series_in_both_amplitudes():
    """omega = 1 + 3/8 z - 15/256 z^2 (fundamental) and - 21/256 z^2 (max): third-order differences."""
    for of, coefficient in (("fundamental", 15 / 256), ("max", 21 / 256)):
        problem = st.Backbone(st.models.duffing(beta=1.0), of=of)
        errors = []
        for z in (0.02, 0.01):
            omega = 2 * np.pi / st.solve(problem, amplitude=np.sqrt(z)).period
            errors.append(abs(omega - 1 - 3 * z / 8 + coefficient * z * z))
        assert 2.8 < np.log2(errors[0] / errors[1]) < 3.2


def test_one_harmonic_is_the_averaged_law():
    """omega^2 = 1 + 3/4 beta a^2 at H = 1."""
    problem = st.Backbone(st.models.duffing(beta=0.3), harmonics=1, adaptive=False)
    orbit = st.solve(problem, amplitude=2.0)
    assert abs((2 * np.pi / orbit.period) ** 2 - 1 - 0.75 * 0.3 * 4) < 1e-10


def test_pendulum_backbone():
    """omega / omega_0 = pi / (2 K(sin^2(A/2))), parametric drive averaged away, harmonics grown by need."""
    system = st.models.base_driven_pendulum()
    curve = st.continuation(st.Backbone(system, of="max"), "amplitude", (0.01, 3.0))
    A = curve.columns[f"{system.coordinates[0]}.max"]
    ratio = curve.columns["omega"] * 2 * ellipk(np.sin(A / 2) ** 2) / np.pi
    assert (np.abs(ratio / ratio[0] - 1) < 3 * curve.error + 1e-9).all()
    assert curve.error.max() < 1e-6
    assert set(curve.verdicts) == {st.Verdict.NEUTRAL}


@pytest.mark.parametrize("mode", [1, 2])
def test_modes_of_a_chain_start_at_the_linear_frequencies(mode):
    chain = st.models.chain(xi1=0.0, xi2=0.0, mass_ratio_21=0.42, Omega0=1.0, beta1=0.1, beta2=0.03)
    curve = st.continuation(st.Backbone(chain, mode=mode), "amplitude", (1e-4, 1.0))
    K = np.array([[1 + 0.42, -0.42], [-1.0, 1.0]])
    assert abs(curve.columns["omega"][0] - np.sqrt(np.sort(np.linalg.eigvals(K).real)[mode - 1])) < 1e-7
    assert np.abs(curve.columns["balancing_growth"]).max() < 1e-10
    assert curve.columns["omega"][-1] > curve.columns["omega"][0]


def _two_masses(hardening=0.5):
    """x'' + 2x - y + x^3/2 = 0, y'' + 2y - x = 0: Kerschen et al. (2009), MSSP 23, 170-194, section 2."""
    t = sp.Symbol("t", real=True)
    x, y = (sp.Function(name)(t) for name in "xy")
    k = sp.Symbol("k", real=True)
    return st.System.from_equations(
        {x.diff(t, 2): y - 2 * x - k * x**3, y.diff(t, 2): x - 2 * y}, coordinates=[x, y], parameters={"k": hardening},
        name="two masses",
    )  # fmt: skip


def test_stability_of_a_nonlinear_normal_mode():
    """Small motions: exp(+-2 pi i sqrt 3), the other linear mode seen over a period of the first. Beyond the branch
    point at 1:1 of the multipliers the mode is unstable; its multipliers by scipy's integration of the variations.
    """
    system = _two_masses()
    curve = st.continuation(st.Backbone(system), "amplitude", (0.01, 3.0))
    small = curve.solution(0).multipliers
    assert np.allclose(sorted(small.real)[:2], np.cos(2 * np.pi * np.sqrt(3)), atol=1e-4)
    (birth, *_) = curve.of_kind(st.Kind.BRANCH_POINT)
    at = curve.columns["amplitude"]
    first = np.arange(len(at)) < int(np.argmax(at > birth.params["amplitude"]))
    assert {v for v, below in zip(curve.verdicts, first) if below} <= {st.Verdict.NEUTRAL, st.Verdict.UNDETERMINED}
    assert sum(v is st.Verdict.NEUTRAL for v in curve.verdicts) > 10
    for amplitude, verdict in ((2.0, st.Verdict.NEUTRAL), (2.8, st.Verdict.UNSTABLE)):
        orbit = curve.at(amplitude=amplitude)[0]
        assert orbit.verdict is verdict

        def variations(t, z):
            x, phi = z[:4], z[4:].reshape(4, 4)
            J = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-2 - 1.5 * x[0] ** 2, 1, 0, 0], [1, -2, 0, 0.0]])
            return np.concatenate([[x[2], x[3], x[1] - 2 * x[0] - x[0] ** 3 / 2, x[0] - 2 * x[1]], (J @ phi).ravel()])

        start = np.concatenate([orbit(0.0), np.eye(4).ravel()])
        end = solve_ivp(variations, (0, orbit.period), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        assert np.abs(end[:4] - orbit(0.0)).max() < 1e-6
        exact = np.linalg.eigvals(end[4:].reshape(4, 4))
        ours = orbit.multipliers[np.abs(orbit.multipliers - 1) > 1e-9]
        assert len(ours) == 2 and np.abs(ours[:, None] - exact).min(axis=1).max() < 1e-5


def test_a_mode_with_damping_has_no_verdict():
    """Its growth is artificial: UNDETERMINED, and said by the column."""
    chain = st.models.chain(xi1=0.01, xi2=0.01, mass_ratio_21=0.42, Omega0=1.0, beta1=0.1, beta2=0.03)
    curve = st.continuation(st.Backbone(chain), "amplitude", (0.01, 0.5))
    assert set(curve.verdicts) == {st.Verdict.UNDETERMINED}
    assert curve.columns["balancing_growth"].min() > 1e-3
    assert np.isfinite(curve.columns["largest_multiplier"]).all()


def test_the_backbone_runs_through_the_phase_resonance_of_a_response():
    """Linear damper, cos forcing: where the first harmonic lags by a quarter turn it lies on the backbone to O(xi^2)."""
    xi, beta = 0.005, 0.5
    duffing = st.models.duffing_textbook(delta=2 * xi, alpha=1.0, beta=beta, gamma=0.01, omega=0.5)
    response = st.continuation(st.HarmonicBalance(duffing, harmonics=9), "omega", (0.5, 1.6))
    amplitude = response.columns[f"{duffing.coordinates[0]}.amplitude(1)"]
    peak = int(np.argmax(amplitude))
    orbit = st.solve(st.Backbone(duffing), amplitude=float(amplitude[peak]))
    assert abs(2 * np.pi / orbit.period - response.parameter[peak]) < 2e-3


def test_a_backbone_is_drawn_over_a_response():
    """By the forcing frequency's column: the lines are those numbers."""
    from matplotlib.figure import Figure

    duffing = st.models.duffing(xi=0.02, beta=0.001)
    ax, curve = Figure().subplots(), st.continuation(st.Backbone(duffing), "amplitude", (0.01, 30))
    st.continuation(st.HarmonicBalance(duffing, harmonics=5), "Omega", (0.5, 2.0)).plot(ax=ax, y="u.amplitude(1)")
    (line,) = curve.plot(ax=ax, x="Omega", y="u.amplitude(1)", smooth=False)
    assert np.array_equal(line.get_xdata(), curve.columns["omega"])
    assert np.array_equal(line.get_ydata(), curve.columns["u.amplitude(1)"])


def test_a_loaded_backbone_goes_on(tmp_path):
    curve = st.continuation(st.Backbone(st.models.duffing(beta=0.1)), "amplitude", (0.1, 2.0))
    curve.save(tmp_path / "b.npz")
    again = st.load(tmp_path / "b.npz")
    A = again.at(amplitude=1.0)[0].max["u"]
    assert abs(2 * np.pi / again.at(amplitude=1.0)[0].period - exact(0.1 * A**2)) < 1e-9


def test_gradients_of_the_core_are_exact():
    """Central differences at a random point, for the amplitude and a parameter of the system."""
    problem = st.Backbone(st.models.duffing(xi=0.02, beta=0.3), harmonics=3)
    rng = np.random.default_rng(5)
    p = np.array(list(problem.parameters.values()))
    u = 0.2 * rng.standard_normal(problem.size)
    u[1], u[-2] = 1.0, 6.0
    w, v = rng.standard_normal(problem.size), rng.standard_normal(problem.size + 1)
    for free in ("amplitude", "beta"):
        def scalar(d, free=free):
            L = problem.linearise(u + d, p)
            return w @ (L.core @ v[:-1] + v[-1] * L.core_column(free))

        numeric = np.array([(scalar(1e-6 * e) - scalar(-1e-6 * e)) / 2e-6 for e in np.eye(problem.size)])
        found = problem.linearise(u, p).core_gradient(w, v, free)[0]
        assert np.abs(found - numeric).max() < 1e-6 * np.abs(numeric).max()


def test_mistakes_are_told_before_work():
    duffing = st.models.duffing()
    with pytest.raises(UnknownNameError, match="coordinate"):
        st.Backbone(duffing, coordinate="v")
    with pytest.raises(InputError, match="fundamental"):
        st.Backbone(duffing, of="rms")
    with pytest.raises(InputError, match="mode"):
        st.Backbone(duffing, mode=2)
    with pytest.raises(InputError, match="second-order"):
        st.Backbone(st.models.lorenz())
    with pytest.raises(InputError, match="positive amplitude"):
        st.continuation(st.Backbone(duffing), "amplitude", (-1.0, 1.0))
