"""Trouble of every sort: the right status or a typed error, what to try, the branch so far, and never NaN in a point.

Witnesses: curves in closed form; a switched force and dry friction whose motions are known; units that change nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import ConvergenceError, InputError

x, a = sp.symbols("x a", real=True)
t = sp.Symbol("t", real=True)
u = sp.Function("u")(t)


def one_state(rhs: sp.Expr) -> st.Equilibrium:
    return st.Equilibrium(st.System(name="toy", coordinates=("x",), states=("x",), parameters={"a": 0.0}, rhs=(rhs,)))


def sound(branch: st.Branch) -> st.Branch:
    """No accepted point holds anything that is not a number, nor a residual that is none."""
    for values in (branch.parameter, branch.rates, branch.arclength, branch.values, branch.residuals):
        assert np.isfinite(values).all()
    assert all(np.isfinite(v).all() for v in (*branch.unknowns, *branch.tangents))
    assert all(np.isfinite(column).all() for column in branch.to_dict().values() if column.dtype.kind == "f")
    assert np.isfinite(branch.error).all()
    assert branch.residuals.max() < 1e-6
    return branch


@pytest.mark.parametrize("rhs", [a * x - x**3, a - x**2], ids=["branch point", "fold"])
def test_singular_starts_are_named(rhs: sp.Expr) -> None:
    with pytest.raises(ConvergenceError, match=r"singular \(a fold or a branch point\).*beside"):
        st.continuation(one_state(rhs), "a", (0.0, 1.0), start=[0.0])


def test_a_singular_orbit_as_start() -> None:
    problem = st.Collocation(st.models.duffing(xi=0.02, beta=0.001))
    fold = st.continuation(problem, "Omega", (0.9, 1.5))["LP1"].solution
    branch = sound(st.continuation(problem, "Omega", (0.9, 1.5), start=fold))
    assert branch.statuses == (st.Status.PARAMETER_BOUND,) * 2
    assert abs(branch.columns["u.max"].max() - fold.max["u"]) < 0.1


def test_bad_starts_say_what_to_give() -> None:
    with pytest.raises(InputError, match="start=dict"):
        st.continuation(st.Collocation(st.models.van_der_pol()), "mu", (0.5, 1.0))
    with pytest.raises(ConvergenceError, match="give start="):
        st.continuation(one_state(a + x**2), "a", (1.0, 2.0), start=[3.0])
    with pytest.raises(InputError):
        st.continuation(one_state(a - x), "a", (1.0, 2.0), start=[3.0, 4.0])


def test_a_dead_end_and_a_blow_up_keep_their_points() -> None:
    """x = a^2 of sqrt(x) = a ends at a = 0; x = 1/a grows without bound."""
    dead = sound(st.continuation(one_state(a - sp.sqrt(x)), "a", (1.0, -1.0), start=[1.0]))
    assert dead.status is st.Status.STEP_TOO_SMALL and dead.message and 0 < dead.parameter[-1] < 0.05
    np.testing.assert_allclose(dead.columns["x"], dead.parameter**2, atol=1e-8)
    blown = sound(st.continuation(one_state(a * x - 1), "a", (1.0, -1.0), start=[1.0]))
    assert blown.status is st.Status.DIVERGED and "grown" in blown.message
    np.testing.assert_allclose(blown.columns["x"], 1 / blown.parameter, rtol=1e-7)


def test_a_force_that_switches() -> None:
    """u'' + 0.2 u' + u = sign(cos(w t)): linear, every harmonic is known; the jumps are mesh points."""
    w = sp.Symbol("w", real=True)
    force = sp.sign(sp.cos(w * t))
    system = st.System.from_equations(
        {u.diff(t, 2): force - sp.Rational(1, 5) * u.diff(t) - u}, [u], parameters=dict(w=2.0), period=2 * sp.pi / w,
        breaks=(0.25, 0.75),
    )  # fmt: skip
    branch = sound(st.continuation(st.Collocation(system), "w", (0.6, 2.5)))
    assert branch.status is st.Status.PARAMETER_BOUND and not branch.special
    omega = branch.parameter
    exact = 4 / np.pi / np.abs(1 - omega**2 + 0.2j * omega)
    np.testing.assert_allclose(branch.columns["u.amplitude(1)"], exact, rtol=1e-8)


def test_a_force_that_jumps_with_the_state() -> None:
    """Dry friction: u'' + u = 2 cos(w t) - 0.3 sign(u'). Den Hartog's motion without stops; other meshes agree."""
    w = sp.Symbol("w", real=True)
    system = st.System.from_equations(
        {u.diff(t, 2): 2 * sp.cos(w * t) - sp.Rational(3, 10) * sp.sign(u.diff(t)) - u}, [u], parameters=dict(w=2.0),
        period=2 * sp.pi / w,
    )  # fmt: skip
    branch = sound(st.continuation(st.Collocation(system, accuracy=1e-4), "w", (2.5, 1.5), max_points=60))
    assert len(branch) > 3 and not branch.of_kind(st.Kind.UNEXPLAINED)
    assert branch.status in (st.Status.PARAMETER_BOUND, st.Status.STEP_TOO_SMALL, st.Status.MAX_POINTS)
    # amplitude: x0 = sqrt((P/(1-w^2))^2 - (F sin(pi/w)/(w (1 + cos(pi/w))))^2), P = 2, F = 0.3
    omega = branch.parameter
    ratio = 0.3 * np.sin(np.pi / omega) / (omega * (1 + np.cos(np.pi / omega)))
    exact = np.sqrt((2 / (1 - omega**2)) ** 2 - ratio**2)
    np.testing.assert_allclose(branch.columns["u.max"], exact, rtol=2e-2)


@pytest.mark.parametrize("exponents", [(9, -9), (-9, 9), (9, 9), (-9, -9)])
def test_orbits_in_variables_of_1e_minus_9_to_1e9(exponents: tuple[int, int]) -> None:
    """The Duffing oscillator with u = 10^p U and time in units of 10^q: the same folds, multipliers and error."""
    size, unit = 10.0 ** exponents[0], 10.0 ** exponents[1]
    Omega, xi, beta = sp.symbols("Omega xi beta")
    equation = (
        size * Omega**2 * sp.cos(Omega * t / unit) - 2 * xi * unit * u.diff(t) - u - beta * u**3 / size**2
    ) / unit**2
    system = st.System.from_equations(
        {u.diff(t, 2): equation}, [u], parameters=dict(xi=0.02, beta=0.001, Omega=1.0), period=2 * sp.pi * unit / Omega
    )
    branch = sound(st.continuation(st.Collocation(system), "Omega", (0.8, 1.6)))
    assert branch.labels == ("LP1", "LP2") and branch.status is st.Status.PARAMETER_BOUND
    found = [p.params["Omega"] for p in branch.special]
    np.testing.assert_allclose(found, (1.380933030, 1.088436639), atol=2e-9)
    expected = np.exp(-0.04 * 2 * np.pi / branch.parameter)
    np.testing.assert_allclose(np.prod(branch.values, axis=1).real, expected, rtol=1e-7)
    assert branch.count(st.Verdict.UNDETERMINED) <= 2 and branch.error.max() < 1e-6

