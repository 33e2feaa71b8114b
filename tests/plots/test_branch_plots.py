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
from stability.plots.branches import plot_branch, plot_multipliers
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
    assert np.isin(branch.parameter, drawn).all()  # smooth between the points, exact at each
    stable, unstable, *_ = branch.plot(ax=ax, y="x", smooth=False)
    drawn = np.concatenate([stable.get_xdata(), unstable.get_xdata()[1:]])
    np.testing.assert_array_equal(drawn, branch.parameter)


def off(lines: list[object], curve: object) -> float:
    """Largest distance of what is drawn, densely sampled, from curve(x, y) = 0 over its gradient's size."""
    worst = 0.0
    for drawn in lines:
        x, y = (np.asarray(v) for v in drawn.get_data())  # type: ignore[attr-defined]
        t = np.linspace(0, x.size - 1, 40 * x.size)
        worst = max(worst, np.abs(curve(np.interp(t, range(x.size), x), np.interp(t, range(x.size), y))).max())  # type: ignore[operator]
    return worst


def test_lines_are_no_chords() -> None:
    """An ellipse from 30 points: the line stays ten times nearer to it than its chords do, and inside its folds."""
    x, a = sp.symbols("x a", real=True)
    system = st.System(
        name="ellipse", coordinates=("x",), states=("x",), parameters={"a": 0.0}, rhs=(x**2 + a**2 / 4 - 1,)
    )
    start = st.solve(st.Equilibrium(system), start=[-0.9], a=0.3)
    closed = st.continuation(st.Equilibrium(system), "a", (-3.0, 3.0), start=start)
    assert len(closed) < 50
    ax = Figure().add_subplot()

    def ellipse(a: np.ndarray, x: np.ndarray) -> np.ndarray:
        return (x**2 + a**2 / 4 - 1) / 2

    smooth, chords = (
        off(closed.plot(ax, y="x", smooth=s, labels=False)[: len(closed.segments())], ellipse) for s in (True, False)
    )
    assert smooth < 0.1 * chords
    drawn = np.concatenate([part.get_xdata() for part in closed.plot(ax, y="x", labels=False)[:2]])
    assert np.abs(drawn).max() < 2 + 1e-6


def test_gaps_in_a_column_stay_gaps() -> None:
    from stability.plots.curves import smooth_pieces

    t = np.linspace(0, np.pi, 9)
    y = np.sin(t)
    y[4] = np.nan
    pieces = smooth_pieces(t, y)
    assert len(pieces) == 8 and [p.shape[1] for p in pieces[2:6]] == [2] * 4
    assert np.isnan(pieces[3]).any() and np.isfinite(pieces[0]).all()
    assert smooth_pieces(t[:2], t[:2])[0].shape == (2, 2)  # two points: nothing to bend


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


def test_multipliers_along_a_branch_and_at_its_special_points() -> None:
    """A fold of the Duffing oscillator: a marker at +1; nothing is drawn beyond the limit, nothing on foreign axes."""
    branch = st.continuation(st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.9, 1.6))
    figure = Figure()
    ax, foreign = figure.subplots(1, 2)
    circle, cloud, *marks = plot_multipliers(branch, ax, limit=1.2)
    assert np.hypot(*circle.get_data()) == pytest.approx(1.0) and ax.get_aspect() == 1.0
    drawn = np.hypot(*cloud.get_data())
    assert np.nanmax(drawn) <= 1.2 < np.abs(branch.values).max() and not foreign.has_data()
    assert [m.get_marker() for m in marks] == [MARKERS[st.Kind.FOLD]] * len(branch.special) and marks
    for mark in marks:  # of the two multipliers only the critical one
        assert np.asarray(mark.get_xdata()) == pytest.approx([1.0], abs=1e-6)


def test_any_column_over_any_other_on_foreign_axes(branch: st.Branch) -> None:
    """The parabola a = x^2 drawn the other way round; its label names the stable part only."""
    ax = Figure().add_subplot()
    lines = plot_branch(branch, ax, y="a", x="x", label="name", labels=False, color="#123456", kinds=(), smooth=False)
    assert [line.get_linestyle() for line in lines] == ["-", "--"] and {x.get_color() for x in lines} == {"#123456"}
    for line in lines:
        np.testing.assert_allclose(line.get_ydata(), line.get_xdata() ** 2, atol=1e-10)
    assert ax.get_legend_handles_labels()[1] == ["name"] and lines[0].get_label() == "name"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$", "$a$")


def test_a_branch_that_begins_unstable_is_named_by_its_stable_part(branch: st.Branch) -> None:
    back = st.continuation(branch.meshes[0], "a", (2.0, -1.0), start=[-1.4])
    first, second = plot_branch(back, Figure().add_subplot(), y="x", label="name", labels=False, kinds=())
    assert (first.get_linestyle(), second.get_linestyle()) == ("--", "-")
    assert second.get_label() == "name" and first.get_label() != "name"


def test_an_orbit_is_drawn_in_the_states_asked_for() -> None:
    orbit = st.PeriodicOrbit.from_function(("u", "v"), lambda t: np.array([np.cos(t), np.sin(2 * t)]), 2 * np.pi)
    ax = Figure().add_subplot()
    (drawn,) = orbit.plot(ax=ax, x="v", y="u", color="#654321")
    v, u = drawn.get_data()
    assert (v**2).tolist() == pytest.approx((4 * u**2 * (1 - u**2)).tolist(), abs=1e-9)
    assert drawn.get_color() == "#654321" and ax.get_xlabel() == "$v$"
    with pytest.raises(UnknownNameError):
        orbit.plot(ax=ax, x="w")


def test_labels_keep_out_of_each_other_s_way():
    """Two labels at almost the same point: boxes measured by matplotlib do not overlap, whatever the limits."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from stability.plots.labels import write_label

    figure = Figure(figsize=(3, 2))
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    labels = [write_label(axes, f"LP{k}", (0.5 + 1e-3 * k, 0.5), "k") for k in range(4)]
    axes.set(xlim=(0, 1), ylim=(0.1, 10), yscale="log")
    canvas.draw()
    boxes = [label.get_window_extent() for label in labels]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    assert list(axes.texts) == labels
