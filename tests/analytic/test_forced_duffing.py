"""Forced and parametrically excited Duffing oscillators: rows 2a-2e and 4a-4b of the verified closed forms.

Witness: periodic orbits with a prescribed fundamental amplitude, by DOP853 shooting (exact_orbits.py); folds and
stability by collocation. Scaling: xi = 0.1 eps, beta = eps, F = 0.7 eps (h = eps); amplitude 1.5.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from exact_orbits import SMALL, amplitudes, assert_order, observed_orders, orbit_with_amplitude, periodic_orbit
from scipy.optimize import brentq, fsolve

import stability as st
from stability.errors import InputError, OpenResonanceWarning, TruncationWarning

XI, F, A = 0.1, 0.7, 1.5


def forced(e):
    """(model, field) of u'' + 2 xi u' + u + beta u^3 = F cos(omega t); textbook names: delta = 2 xi."""
    model = st.models.duffing_textbook(delta=2 * XI * e, alpha=1.0, beta=e, gamma=F * e, omega=1.0)

    def field(t, y, w):
        return [y[1], -2 * XI * e * y[1] - y[0] - e * y[0] ** 3 + F * e * math.cos(w * t)]

    return model, field


_TRUTH: dict[tuple[float, int], float] = {}


def exact_frequency(e, sign):
    """Frequency at which the full oscillator has the fundamental amplitude A, on the flank `sign`."""
    if (e, sign) not in _TRUTH:
        guess = float(st.duffing_frequencies(A, xi=XI * e, beta=e, force=F * e, order=2)[(sign + 1) // 2])
        model, field = forced(e)
        slow = st.averaging(model, order=2, variables="polar")
        _, psi = balance(slow, guess, sign, omega=guess)
        start = st.reconstruct(slow, [A, psi], 0.0, omega=guess)
        _TRUTH[e, sign] = orbit_with_amplitude(field, A, start, guess)
    return _TRUTH[e, sign]


def balance(slow, guess, sign, **params):
    """(omega, psi) at which the polar slow flow rests with amplitude A; |psi| is small on the lower flank."""

    def rates(z):
        return slow(0.0, [A, z[1]], **{**params, "omega": z[0]})

    start = -0.2 if sign < 0 else math.pi + 0.2
    z, _, flag, message = fsolve(rates, [guess, start], full_output=True, xtol=1e-14)
    assert flag == 1 or np.abs(rates(z)).max() < 1e-12, message
    return z


METHODS = {
    "2a": (lambda model: st.multiple_scales(model, variables="polar"), {-1: 1.98, 1: 1.97}),
    "2b": (lambda model: st.averaging(model, variables="polar"), {-1: 1.94, 1: 1.91}),
    "2c": (lambda model: st.averaging(model, order=2, variables="polar"), {-1: 2.95, 1: 2.91}),
    "mms2": (lambda model: st.multiple_scales(model, order=2, variables="polar"), {}),
}


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("row", METHODS)
def test_frequency_at_an_amplitude(row, sign):
    """Rows 2a, 2b, 2c and multiple scales to second order, from the slow flows, with their orders."""
    method, orders = METHODS[row]
    errors = []
    for e in SMALL:
        exact = exact_frequency(e, sign)
        omega, _ = balance(method(forced(e)[0]), exact, sign)
        errors.append(abs(omega - exact))
    if row == "mms2":  # at least the third order (at these numbers the leading term nearly cancels on one flank)
        assert observed_orders(errors)[-1] > 2.8
    else:
        assert_order(errors, orders[sign], slack=0.13)


@pytest.mark.parametrize("sign", [-1, 1])
def test_closed_forms_are_the_equilibria(sign):
    """Row 2a's formula, and `duffing_frequencies` of order 1 and 2, are what the slow flows rest on."""
    e = 0.1
    model, _ = forced(e)
    omega, _ = balance(st.multiple_scales(model, variables="polar"), 1 + 0.08 + sign * 0.02, sign)
    assert omega == pytest.approx(
        1 + 3 / 8 * e * A**2 + sign * math.sqrt((F * e) ** 2 / (4 * A**2) - (XI * e) ** 2), abs=1e-12
    )
    for order in (1, 2):
        closed = st.duffing_frequencies(A, xi=XI * e, beta=e, force=F * e, order=order)[(sign + 1) // 2]
        omega, _ = balance(st.averaging(model, order=order, variables="polar"), closed, sign)
        assert omega == pytest.approx(closed, abs=1e-12 if order == 1 else 2e-4)  # 3/128 beta^2 a^4 against .../Omega^2
    closed = st.duffing_frequencies(A, xi=XI * e, beta=e, force=F * e)[(sign + 1) // 2]
    response = st.duffing_amplitudes(closed, xi=XI * e, beta=e, force=F * e)
    assert min(abs(np.array(response) - A)) < 1e-9


def test_averaging_that_keeps_the_frequency_is_closer_than_multiple_scales():
    """HB1 against MMS1: more than five times on the flank beyond resonance, closer on the other one, too."""
    for sign, factor in ((-1, 1.5), (1, 5.0)):
        exact = exact_frequency(0.05, sign)
        errors = [abs(balance(METHODS[row][0](forced(0.05)[0]), exact, sign)[0] - exact) for row in ("2a", "2b")]
        assert errors[0] > factor * errors[1]


def test_third_harmonic_of_the_second_order():
    """a3 = beta a^3/32 from the reconstruction, against the exact orbit: relative error O(eps)."""
    errors = []
    for e in SMALL:
        omega = exact_frequency(e, -1)
        model, field = forced(e)
        slow = st.averaging(model, order=2)
        point = st.solve(st.Equilibrium(slow.with_params(omega=omega)), start=dict(x_cos=1.4, x_sin=0.5))
        period = 2 * math.pi / omega
        start = st.reconstruct(slow, point, 0.0)
        _, rows = periodic_orbit(lambda s, y, w=omega, f=field: f(s, y, w), period, start)
        mine = st.reconstruct(slow, point, period * np.arange(256) / 256)
        errors.append(np.abs(mine - rows).max())
        third = 2 * np.abs(np.fft.rfft(mine[0]))[3] / 256
        assert third == pytest.approx(e * amplitudes(mine[0])[1] ** 3 / 32 / omega**2, rel=1e-9)
    assert observed_orders(errors)[-1] > 1.8


# ------------------------------------------------------------------ folds, cusp, peak
def cusp_of(order, xi, beta):
    """Least force with folds: the flank frequencies of `duffing_frequencies` get a vertical tangent (dOmega/da = 0)."""

    def folds(force):
        a = np.linspace(0.3, 0.99, 4001) * force / (2 * xi)
        low, high = st.duffing_frequencies(a, xi=xi, beta=beta, force=force, order=order)
        slopes = np.concatenate([np.diff(low), -np.diff(high)])
        return np.nanmin(slopes)

    _, scale, _ = st.duffing_fold_onset(xi=xi, beta=beta)
    return brentq(folds, 0.7 * scale, 1.5 * scale, xtol=1e-9 * scale)


def test_onset_of_folds():
    """Row 2d: F_c^2 = 256 xi^3/(9 sqrt(3) beta), relative error of order 1, against the second-order response."""
    errors = []
    for e in SMALL:
        _, force, _ = st.duffing_fold_onset(xi=0.3 * e, beta=e)
        errors.append(abs((force / cusp_of(2, 0.3 * e, e)) ** 2 - 1))
    assert_order(errors, 0.97, slack=0.15)


def test_onset_of_folds_in_the_full_oscillator():
    """Two folds 4 % above the second-order cusp, none 4 % below, by collocation."""
    xi, beta = 0.03, 0.1
    force = cusp_of(2, xi, beta)
    omega = st.duffing_fold_onset(xi=xi, beta=beta)[0]
    for factor, number in ((1.04, 2), (0.96, 0)):
        model = st.models.duffing_textbook(delta=2 * xi, beta=beta, gamma=factor * force)
        branch = st.continuation(st.Collocation(model), "omega", (omega - 0.06, omega + 0.08))
        assert sum(p.kind is st.Kind.FOLD for p in branch.special) == number


@pytest.mark.parametrize(
    ("xi", "beta", "force"), [(0.02, 0.001, None), (0.05, 0.3, 0.4), (0.05, -0.2, 0.12), (0.01, 0.02, None)]
)
def test_folds_from_the_discriminant(xi, beta, force):
    """The folds are those of the averaged branch (the same one-term balance), and dp/ds = 0 there."""
    folds = st.duffing_folds(xi=xi, beta=beta, force=force)
    assert len(folds) == {0.001: 2, 0.3: 2, -0.2: 3, 0.02: 1}[beta]  # softening: one more beyond the escape; open: one
    for Omega, a in folds:
        flanks = [st.duffing_frequencies(a * k, xi=xi, beta=beta, force=force) for k in (1 - 1e-4, 1, 1 + 1e-4)]
        k = int(np.nanargmin(np.abs(flanks[1] - Omega)))
        assert flanks[1][k] == pytest.approx(Omega, abs=1e-9)
    if force is None and beta < 16 * xi**2 / 3:
        branch = st.continuation(st.Equilibrium(st.averaging(st.models.duffing(xi=xi, beta=beta))), "Omega", (0.3, 3.0))
        found = [p.params["Omega"] for p in branch.special if p.kind is st.Kind.FOLD]
        assert sorted(found) == pytest.approx(sorted(w for w, _ in folds), abs=1e-8)


def test_peak_under_base_excitation():
    """Row 2e: the phase-resonance point satisfies one-term balance to rounding; it exists iff beta < 16 xi^2/3."""
    Omega, a = st.duffing_peak(xi=0.02, beta=0.001)
    assert (Omega, a) == (pytest.approx(1.371988681, abs=1e-9), pytest.approx(34.2997, abs=1e-4))
    residual = (Omega**2 - 1 - 0.75 * 0.001 * a**2) ** 2 + 4 * 0.02**2 * Omega**2 - Omega**4 / a**2
    assert abs(residual) < 1e-13
    slow = st.averaging(st.models.duffing(xi=0.02, beta=0.001, Omega=Omega))
    assert np.abs(slow(0.0, [0.0, a])).max() < 1e-13
    limit = 16 * 0.02**2 / 3
    for beta in (limit * 1.0001, 0.01):
        with pytest.warns(OpenResonanceWarning, match="open resonance"):
            assert st.duffing_peak(xi=0.02, beta=beta)[0] == math.inf
        assert np.isfinite(st.duffing_frequencies(np.array([1e3, 1e5]), xi=0.02, beta=beta)).all()  # never closes
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        top = st.duffing_peak(xi=0.02, beta=limit * 0.99)[1]
    assert np.isnan(st.duffing_frequencies(1.1 * top, xi=0.02, beta=limit * 0.99)).all()


def test_first_order_is_one_term_harmonic_balance():
    """Folds of `HarmonicBalance(harmonics=1)` and of the averaged branch are the same numbers."""
    model = st.models.duffing(xi=0.02, beta=0.001)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncationWarning)  # one harmonic is too few, and says so
        balanced = st.continuation(st.HarmonicBalance(model, harmonics=1), "Omega", (0.3, 3.0))
    slow = st.continuation(st.Equilibrium(st.averaging(model)), "Omega", (0.3, 3.0))
    for label in ("LP1", "LP2"):
        assert balanced[label].params["Omega"] == pytest.approx(slow[label].params["Omega"], abs=1e-9)


def test_static_deflection_stiffens():
    """gravity: the frequency of small motion is 1 + 3 beta u_s^2 with u_s = -gravity, and the cubic's drift is in h(t)."""
    heavy = st.models.duffing(xi=0.001, beta=1e-4, gravity=20.0)
    slow = st.averaging(heavy)
    value = slow.with_params(Omega=1.0)(0.0, [1e-3, 0.0])[1] - slow.with_params(Omega=1.0)(0.0, [0.0, 0.0])[1]
    assert value / 1e-3 == pytest.approx(-3 * 1e-4 * 20.0**2 / 2, rel=1e-6)
    assert float(st.reconstruct(slow, [0.0, 0.0], 0.0)[0]) == pytest.approx(-20.0)
    assert "gravity" not in str(st.averaging(st.models.duffing()).rhs)


def test_stability_changes_at_the_vertical_tangents_only():
    branch = st.continuation(st.Equilibrium(st.averaging(st.models.duffing(xi=0.02, beta=0.001))), "Omega", (0.3, 3.0))
    assert [p.kind for p in branch.special] == [st.Kind.FOLD, st.Kind.FOLD]


# ------------------------------------------------------------------ row 4
def parametric(e):
    return dict(xi=XI * e, h=e, beta=e)


def exact_parametric(e, Omega, sign):
    """Fundamental amplitude of the full orbit of period 2 pi/Omega, started from the averaged one."""
    model = st.models.duffing_mathieu(**parametric(e), Omega=Omega)
    slow = st.averaging(model)
    a = float(st.duffing_mathieu_amplitudes(Omega, **parametric(e))[0 if sign > 0 else 1])
    # e^{-2 i phi} = -(2/h) (1 - Omega^2 + 3/4 beta a^2 + 2 i xi Omega), u = Re(a e^{i phi} e^{i Omega t})
    phi = -0.5 * np.angle(-(1 - Omega**2 + 0.75 * e * a * a + 2j * XI * e * Omega))
    state = [a * math.cos(phi), -a * math.sin(phi)]
    assert (
        np.abs(slow(0.0, state)).max() < 1e-12
    )  # the phase of the table, and the closed amplitude, are the equilibrium
    start = st.reconstruct(slow, state, 0.0)

    def field(t, y):
        return [y[1], -2 * XI * e * y[1] - (1 + e * math.cos(2 * Omega * t)) * y[0] - e * y[0] ** 3]

    _, rows = periodic_orbit(field, 2 * math.pi / Omega, start)
    return amplitudes(rows[0])[1], np.linalg.eigvals(slow_jacobian(slow, state))


def slow_jacobian(slow, state):
    h = 1e-6
    return np.array([(slow(0.0, state + h * e) - slow(0.0, state - h * e)) / (2 * h) for e in np.eye(len(state))]).T


@pytest.mark.parametrize(("sign", "detuning"), [(1, 0.7), (-1, 0.95)])
def test_parametric_resonance(sign, detuning):
    """Rows 4a, 4b: amplitudes of size 1.4-1.6, order 1; the upper branch is stable, the lower one unstable (beta > 0)."""
    errors = {"averaging": [], "multiple scales": []}
    for e in SMALL:
        Omega = 1 + detuning * e
        exact, eigenvalues = exact_parametric(e, Omega, sign)
        assert (eigenvalues.real.max() < 0) == (sign > 0)
        for method, found in errors.items():
            a = st.duffing_mathieu_amplitudes(Omega, **parametric(e), method=method)[0 if sign > 0 else 1]
            found.append(abs(float(a) / exact - 1))
    assert_order(errors["multiple scales"], 1.0)
    assert_order(errors["averaging"], 1.03 if sign > 0 else 0.98, slack=0.1)
    assert errors["averaging"][-1] < errors["multiple scales"][-1]


def test_multiplier_from_the_slow_flow():
    """exp(lambda T) of the slow flow against the collocated orbit: difference O(eps^2), the verdicts equal."""
    errors = []
    for e in (0.1, 0.05, 0.025):
        Omega = 1 + 0.5 * e
        model = st.models.duffing_mathieu(**parametric(e), Omega=Omega)
        slow = st.averaging(model)
        a = float(st.duffing_mathieu_amplitudes(Omega, **parametric(e))[0])
        phi = -0.5 * np.angle(-(1 - Omega**2 + 0.75 * e * a * a + 2j * XI * e * Omega))
        state = np.array([a * math.cos(phi), -a * math.sin(phi)])
        predicted = np.exp(np.linalg.eigvals(slow_jacobian(slow, state)) * 2 * math.pi / Omega)

        def field(t, y, e=e, Omega=Omega):
            return [y[1], -2 * XI * e * y[1] - (1 + e * math.cos(2 * Omega * t)) * y[0] - e * y[0] ** 3]

        start, _ = periodic_orbit(field, 2 * math.pi / Omega, st.reconstruct(slow, state, 0.0))
        M = period_map_slope(field, 2 * math.pi / Omega, start)
        truth = np.linalg.eigvals(M)
        errors.append(np.abs(np.sort_complex(predicted) - np.sort_complex(truth)).max())
    assert observed_orders(errors, (0.1, 0.05, 0.025))[-1] > 1.8


def period_map_slope(field, period, start):
    from scipy.integrate import solve_ivp

    def end(y):
        return solve_ivp(field, (0, period), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    return np.array([(end(start + 1e-6 * e) - end(start - 1e-6 * e)) / 2e-6 for e in np.eye(2)]).T


def test_threshold_of_the_trivial_solution():
    """(1 - Omega^2)^2 + 4 xi^2 Omega^2 < h^2/4, h = 4 xi at Omega = 1: eigenvalues of the slow flow at zero."""
    slow = st.averaging(st.models.duffing_mathieu())
    for h, Omega in ((0.079, 1.0), (0.081, 1.0), (0.2, 1.03), (0.2, 1.06)):
        values = dict(xi=0.02, h=h, Omega=Omega)
        system = slow.with_params(**values)
        growth = np.linalg.eigvals(slow_jacobian(system, np.zeros(2))).real.max()
        assert (growth > 0) == ((1 - Omega**2) ** 2 + 4 * 0.02**2 * Omega**2 < h**2 / 4)


@pytest.mark.parametrize(
    "call",
    [
        lambda: st.duffing_frequencies(-1.0, xi=0.1, beta=1.0),
        lambda: st.duffing_frequencies(1.0, xi=0.1, beta=1.0, order=3),
        lambda: st.duffing_folds(xi=0.1, beta=0.0),
        lambda: st.duffing_peak(xi=0.0, beta=0.1),
        lambda: st.duffing_fold_onset(xi=0.1, beta=0.0),
        lambda: st.duffing_mathieu_amplitudes(1.0, xi=0.1, h=0.5, beta=0.0),
        lambda: st.duffing_mathieu_amplitudes(1.0, xi=0.1, h=0.5, beta=0.1, method="guess"),
        lambda: st.duffing_amplitudes(math.nan, xi=0.1, beta=0.1),
    ],
)
def test_refusals(call):
    with pytest.raises(InputError):
        call()
