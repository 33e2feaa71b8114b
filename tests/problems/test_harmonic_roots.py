"""All one-harmonic solutions against polynomials in the amplitude; the families that begin there."""

import numpy as np
import pytest
from absorbers import absorber, relative_amplitudes

import stability as st
from stability.errors import InputError
from stability.problems.harmonic_roots import one_harmonic_roots, polynomial_roots


def amplitudes(roots, series=None):
    """First-harmonic amplitudes of one series, or of the difference of the first two."""
    waves = [c[1:3, 0] - c[1:3, 1] if series is None else c[1:3, series] for c in roots]
    return np.sort([float(np.hypot(*w)) for w in waves])


@pytest.mark.parametrize("Omega", [0.5, 0.9, 1.2, 1.3, 1.5])
@pytest.mark.parametrize("beta", [0.001, 0.05])
def test_all_roots_of_the_duffing_oscillator(Omega, beta):
    """(Omega^2 - 1 - 3/4 beta s)^2 s + 4 xi^2 Omega^2 s = Omega^4, s = a^2: as many roots, the same ones."""
    xi = 0.02
    system = st.models.duffing(xi=xi, beta=beta)
    found = one_harmonic_roots(st.HarmonicBalance(system, harmonics=1), system.parameter_vector(Omega=Omega))
    b, d = 0.75 * beta, 1 - Omega**2
    s = np.roots([b * b, 2 * b * d, d * d + (2 * xi * Omega) ** 2, -(Omega**4)])
    exact = np.sqrt(np.sort([v.real for v in s if abs(v.imag) < 1e-9 * abs(v) and v.real > 0]))
    assert np.allclose(amplitudes(found, 0), exact, rtol=1e-9, atol=0)


@pytest.mark.parametrize(("Omega", "F"), [(0.9, 0.6), (0.95, 0.6), (1.06, 0.6), (1.2, 0.6), (0.95, 0.2)])
def test_all_roots_of_the_absorber(Omega, F):
    """Two degrees of freedom, 81 paths of motions without mean: the cubic in |r|^2."""
    system = absorber(F)
    problem = st.HarmonicBalance(system, harmonics=1)
    found = one_harmonic_roots(problem, system.parameter_vector(Omega=Omega), 100)
    assert np.allclose(amplitudes(found), relative_amplitudes(Omega, F), rtol=1e-8, atol=0)
    params = system.parameter_vector(Omega=Omega)
    for c in found:
        assert np.abs(problem.linearise(c.ravel(), params).residual).max() < 1e-9


def test_a_quadratic_term_needs_the_mean():
    """x'' + .1 x' + x + x^2 = F cos t at H = 1: eliminated by hand, a_0 + a_0^2 + s/2 = 0 and
    ((1 - Omega^2 + 2 a_0)^2 + .01 Omega^2) s = F^2.
    """
    import sympy as sp

    t = sp.Symbol("t", real=True)
    x, w = sp.Function("x")(t), sp.Symbol("Omega", real=True)
    F, Omega = 0.12, 0.8
    system = st.System.from_equations(
        {x.diff(t, 2): -x.diff(t) / 10 - x - x**2 + F * sp.cos(w * t)}, coordinates=[x], period=2 * sp.pi / w,
        parameters={"Omega": Omega}, name="quadratic",
    )  # fmt: skip
    found = one_harmonic_roots(st.HarmonicBalance(system, harmonics=1), system.parameter_vector())
    a0 = np.polynomial.Polynomial([0, 1])
    balance = -2 * (a0 + a0**2) * ((1 - Omega**2 + 2 * a0) ** 2 + 0.01 * Omega**2) - F**2
    means = np.sort([r.real for r in balance.roots() if abs(r.imag) < 1e-9 and -(r.real + r.real**2) > 0])
    assert len(means) >= 2
    assert np.allclose(np.sort([c[0, 0] for c in found]), means, atol=1e-9)


def test_roots_of_a_system_with_solutions_at_infinity():
    """x^2 - 1 = 0, x z^2 - z = 0: z = 0 and z = 1/x; Bezout counts 6, two of them at infinity."""
    def f(y):
        x, z = y[:, 0], y[:, 1]
        slopes = np.stack([np.stack([2 * x, 0 * z], 1), np.stack([z * z, 2 * x * z - 1], 1)], 1)
        return np.stack([x * x - 1, x * z * z - z], 1), slopes

    ends = polynomial_roots(f, np.array([2, 3]))
    exact = np.array([[1, 0], [1, 1], [-1, 0], [-1, -1]])
    assert np.abs(ends[:, None] - exact).max(axis=2).min(axis=0).max() < 1e-9
    assert np.abs(ends[:, None] - exact).max(axis=2).min(axis=1).max() < 1e-9


def test_terms_that_are_no_polynomials_have_no_list():
    system = st.models.base_driven_pendulum()
    assert one_harmonic_roots(st.HarmonicBalance(system, harmonics=1), system.parameter_vector()) == []


# ---------------------------------------------------------------------- families
def test_the_isola_of_the_absorber_is_found():
    """Between birth and merger two families, the second a closed loop with two folds, as collocation has them."""
    system = absorber(0.6)
    main, isola = st.families(st.HarmonicBalance(system), "Omega", (0.7, 1.3), places=4)
    assert isola.status is st.Status.CLOSED_LOOP
    folds = sorted(p.params["Omega"] for p in isola.of_kind(st.Kind.FOLD))
    other = st.continuation(st.Collocation(system), "Omega", (0.7, 1.3), start=isola.at(Omega=0.9)[0])
    exact = sorted(p.params["Omega"] for p in other.of_kind(st.Kind.FOLD))
    assert len(folds) == 2
    assert np.allclose(folds, exact, rtol=0, atol=1e-9)
    for Omega in (0.8, 0.9, 0.95, 1.06, 1.2):
        count = sum(len(branch.at(Omega=Omega)) for branch in (main, isola))
        assert count == len(relative_amplitudes(Omega, 0.6))


def test_amplitude_continuation_finds_the_detached_family():
    """No guesses at all: through the forcing, from the only family that the window's ends give, by collocation."""

    class WithoutCandidates(st.Collocation):
        def candidates(self, params):
            return []

    problem, common = WithoutCandidates(absorber(0.6)), dict(places=3, sizes=())
    assert len(st.families(problem, "Omega", (0.75, 1.15), **common)) == 1
    found = st.families(problem, "Omega", (0.75, 1.15), through={"F": (0.001, 2.0)}, **common)
    assert len(found) == 2
    assert found[1].status is st.Status.CLOSED_LOOP


def test_mistakes_of_through():
    problem = st.HarmonicBalance(absorber(0.6), harmonics=3)
    with pytest.raises(InputError, match="continued parameter itself"):
        st.families(problem, "Omega", (0.75, 1.15), through={"Omega": (0.5, 2.0)})
    with pytest.raises(st.errors.UnknownNameError, match="forcing"):
        st.families(problem, "Omega", (0.75, 1.15), through={"forcing": (0.5, 2.0)})
