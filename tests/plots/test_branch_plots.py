"""Bifurcation diagrams: what is drawn, read back from the artists (no pixels)."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
import sympy as sp
from matplotlib.figure import Figure

import stability as st
from stability.errors import UnknownNameError
from stability.plots.branches import plot_multipliers
from stability.plots.style import LINES, MARKERS


@pytest.fixture(scope="module")
def branch() -> st.Branch:
    x, a = sp.symbols("x a", real=True)
    system = st.System(name="fold", coordinates=("x",), states=("x",), parameters={"a": 1.0}, rhs=(a - x**2,))
    return st.continuation(st.Equilibrium(system), "a", (2.0, -1.0), start=[1.4])


def test_styles_markers_and_labels(branch: st.Branch) -> None:
    ax = Figure().add_subplot()
    stable, unstable, mark, text = branch.plot(ax=ax, y="x")
    assert stable.get_linestyle() == "-" and unstable.get_linestyle() == "--"
    assert LINES[st.Verdict.STABLE] == "solid" and mark.get_marker() == MARKERS[st.Kind.FOLD]
    assert text.get_text() == "LP1" and abs(mark.get_xdata()[0]) < 1e-12
    drawn = np.concatenate([stable.get_xdata(), unstable.get_xdata()[1:]])
    np.testing.assert_array_equal(drawn, branch.parameter)


def test_wrong_column(branch: st.Branch) -> None:
    with pytest.raises(UnknownNameError):
        branch.plot(ax=Figure().add_subplot(), y="y")


def test_orbit_is_closed_in_the_phase_plane() -> None:
    orbit = st.PeriodicOrbit.from_function(("u", "u_dot"), lambda t: np.array([np.cos(t), -np.sin(t)]), 2 * np.pi)
    ax = Figure().add_subplot()
    (drawn,) = orbit.plot(ax=ax)
    x, y = drawn.get_data()
    assert (x[0], y[0]) == pytest.approx((x[-1], y[-1])) and np.hypot(x, y) == pytest.approx(1.0)


def test_eigenvalues_in_the_complex_plane() -> None:
    branch = st.continuation(st.Equilibrium(st.models.van_der_pol()), "mu", (-1.0, 1.0))
    ax = Figure().add_subplot()
    _, cloud, hopf = plot_multipliers(branch, ax)
    assert hopf.get_marker() == MARKERS[st.Kind.HOPF]
    assert set(np.round(hopf.get_ydata(), 9)) == {-1.0, 1.0} and cloud.get_xdata().size == 2 * len(branch)
