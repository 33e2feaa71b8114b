"""The compiled Newton solve of curves of special orbits against the one for all problem classes, and gradients."""

from __future__ import annotations

import functools
import math
import warnings

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import StabilityWarning
from stability.problems.normal_forms_orbits import MapForms
from stability.protocols import Tangent
from stability.words import Kind

mu, k, x, y, z = sp.symbols("mu k x y z", real=True)


def folds(system):
    """A fold of a resonance curve."""
    problem = st.Collocation(system, intervals=16, degree=4, adaptive=False)
    return st.continuation(problem, "Omega", (2.5, 0.8)).of_kind(Kind.FOLD)[0], "xi"


def oscillator(t, x, *, xi=0.1, beta=0.05, f=1.0, Omega=1.0):
    return x[1], f * np.cos(Omega * t) - 2 * xi * x[1] - x[0] - beta * x[0] ** 3


def from_function():
    """Derivatives by differences, through callbacks."""
    return folds(st.System.from_function(oscillator, states="u u_dot", period=lambda Omega: 2 * np.pi / Omega))


def pendulum():
    """Period doubling of the semi-trivial motion: the other pair of multipliers is complex."""
    system = st.models.autoparametric_pendulum(xi1=0.02, xi2=0.01, Omega0=0.5, length_ratio=10.0)
    branch = st.continuation(st.Collocation(system, intervals=12, degree=4, adaptive=False), "Omega", (0.7, 1.0))
    return branch.of_kind(Kind.PERIOD_DOUBLING)[0], "length_ratio"


def pitchfork():
    """Loss of a symmetry, -1 of the half-period map: the boundary condition has a matrix."""
    system = st.models.duffing_textbook(delta=0.2, alpha=1.0, beta=1.0, gamma=25.0, omega=2.0)
    problem = st.Collocation(system, symmetry={"x": "-x"}, intervals=10, adaptive=False)
    branch = st.continuation(problem, "omega", (1.8, 3.0))
    return max(branch.of_kind(Kind.BRANCH_POINT), key=lambda p: p.params["omega"]), "gamma"


def cycles():
    """A fold of cycles of an autonomous system that does not turn evenly: the period is an unknown."""
    rho = x**2 + y**2
    growth = mu + rho - rho**2 + x * y / 5
    rhs = (growth * x - y + k * y**2, growth * y + x)
    system = st.System(name="cycles", coordinates=("x", "y"), states=("x", "y"), parameters={"mu": -0.3, "k": 0.1}, rhs=rhs)
    hopf = st.continuation(st.Equilibrium(system), "mu", (-0.3, 0.3))["HB1"]
    return st.continuation(st.switch(hopf), "mu", (-0.5, 0.5)).of_kind(Kind.FOLD)[0], "k"


def langford():
    """A torus point of an autonomous system."""
    a, b = sp.symbols("lam alpha", real=True)
    rhs = (
        (z - sp.Rational(7, 10)) * x - 3.5 * y, 3.5 * x + (z - sp.Rational(7, 10)) * y,
        a + b * z - z**3 / 3 - (x**2 + y**2) * (1 + z / 4),
    )  # fmt: skip
    system = st.System(
        name="langford", coordinates=("x", "y", "z"), states=("x", "y", "z"), parameters={"lam": 1.8, "alpha": 0.95}, rhs=rhs
    )
    problem, period = st.Collocation(system), 2 * np.pi / 3.5
    start = (lambda time: np.array([1.4 * np.cos(3.5 * time), 1.4 * np.sin(3.5 * time), 0.7 + 0 * time]), period)
    branch = st.continuation(problem, "lam", (1.3, 2.0), start=st.solve(problem, start=start))
    return branch.of_kind(Kind.NEIMARK_SACKER)[0], "alpha"


def torus():
    """A torus point of a forced system."""
    semi = st.continuation(st.Collocation(st.models.autoparametric_pendulum()), "Omega", (0.94, 1.02))
    branch = st.continuation(st.switch(semi["PD1"]), "Omega", (0.9, 1.1))
    return branch.of_kind(Kind.NEIMARK_SACKER)[0], "mass_ratio_total"


CASES = {
    "fold": lambda: folds(st.models.duffing(xi=0.1, beta=0.05)), "python function": from_function, "doubling": pendulum,
    "symmetry": pitchfork, "fold of cycles": cycles, "torus": torus, "torus of cycles": langford,
}  # fmt: skip


@functools.cache
def case_of(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StabilityWarning)
        return CASES[name]()


def both(point, free, name):
    """(compiled, for all problem classes) curves through the point, and a tangent at it."""
    curves = [st.locus(point, free=free) for _ in range(2)]
    assert curves[0].condensed
    vars(curves[1])["condensed"] = False
    U, params, direction, rate = curves[0].born
    weight = 1 / max(abs(params[curves[0].inner.index(name)]), 0.1)
    length = math.sqrt(float(curves[0].weights @ direction**2) + (rate * weight) ** 2)
    return curves, U, params, Tangent(direction / length, rate / length, weight)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("ds", [0.0, 0.03, -0.02])
def test_the_same_solution_as_by_the_general_builder(case, ds):
    """Borders, gradients and the bordered system are built twice, by arrays and by kernels; Newton ends at one point."""
    point, free = case_of(case)
    curves, U, params, tangent = both(point, free, point.free)
    one, other = (c.correct(U, params, point.free, tangent, ds, 1e-11) for c in curves)
    assert one.converged and other.converged and one.iterations == other.iterations
    assert np.abs(one.u - other.u).max() < 1e-9 * (1 + np.abs(other.u).max())
    assert np.abs(one.params - other.params).max() < 1e-9
    w = np.sqrt(curves[0].weights)
    assert np.abs(w * (one.tangent.u - other.tangent.u)).max() < 3e-3
    assert one.tangent.parameter == pytest.approx(other.tangent.parameter, abs=3e-3)
    a, b = (c.recalled("response", f.u) for c, f in zip(curves, (one, other)))
    assert float(a @ b) / math.sqrt(float(a @ a) * float(b @ b)) == pytest.approx(1.0, abs=1e-3)
    # at the solution: the linearisation that is left, its critical multiplier, and the residual of both
    L = curves[0].recalled("inner", one.u)
    fresh = curves[0].inner.linearise(curves[0].parts(one.u)[0], one.params)
    assert np.abs(L.spectral - fresh.spectral).max() < 1e-12 * np.abs(fresh.spectral).max()
    target = curves[0].targets(curves[0].parts(one.u)[2])[0]
    assert np.abs(np.linalg.eigvals(L.spectral) - target).min() < 1e-5  # the square root of rounding at a defective one
    assert max(one.residual, other.residual) < 1e-9


@pytest.mark.parametrize("case", ["doubling", "symmetry"])
def test_cubic_terms_by_one_pass_are_those_of_the_multilinear_forms(case):
    """p.C(q, q, q)/6 and p.B(q, h)/2 by the general forms, whose derivatives are taken sweep by sweep."""
    point, _ = case_of(case)
    L = point.problem.linearise(point.u, point.params_vector)
    forms = MapForms(L)
    left, _, right = np.linalg.svd(forms.matrix + np.eye(forms.n))
    q, p = right[-1], left[:, -1] / (left[:, -1] @ right[-1])
    h = np.linalg.solve(np.eye(forms.n) - forms.matrix, forms.second(q, q))
    wanted = p @ forms.third(q, q, q) / 6, p @ forms.second(q, h) / 2
    got = forms.cubic_terms(p, q)
    assert got == pytest.approx(wanted, rel=1e-10, abs=1e-12 * max(np.abs(wanted)))
    assert abs(wanted[0]) > 1e-6
    zero = forms.cubic_terms(p, 0 * q)
    assert zero == (0.0, 0.0)


def test_torus_terms_by_one_pass_are_those_of_the_multilinear_forms():
    point, _ = case_of("torus")
    forms = MapForms(point.problem.linearise(point.u, point.params_vector))
    A, eye = forms.matrix, np.eye(forms.n)
    values, right = np.linalg.eig(A)
    at = int(np.argmin(np.abs(np.abs(values) - 1) + 10 * (values.imag <= 0)))
    mu_, q = values[at], right[:, at]
    left = np.linalg.inv(right)[at]
    h = np.linalg.solve(eye - A, np.real(forms.second(q, q.conj())))
    twice = np.linalg.solve(mu_**2 * eye - A, forms.second(q, q))
    wanted = left @ forms.third(q, q, q.conj()), 2 * left @ forms.second(q, h), left @ forms.second(q.conj(), twice)
    got = forms.torus_terms(left, q, mu_)
    assert np.abs(np.array(got) - np.array(wanted)).max() < 1e-9 * np.abs(wanted).max()
    assert min(np.abs(wanted)) > 1e-6
