"""The warning of an open resonance. Witness: closed form, the peak of one-term balance exists for beta < 16 xi^2/3 only."""

import warnings

import pytest
import sympy as sp

import stability as st
from stability.errors import OpenResonanceWarning

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
