"""Bad input is refused before work starts; the result is frozen, saved, loaded and exported without loss."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import stability as st
from stability.errors import InputError, NonFiniteError, ResourceLimitError, StabilityError, UnknownNameError

MATHIEU = st.models.mathieu(delta=0.05)
X, Y = ("a", -0.5, 2.5), ("b", 0.0, 2.0)


@pytest.mark.parametrize(
    ("x", "y", "options", "error", "words"),
    [
        (("aa", 0, 1), Y, {}, UnknownNameError, "did you mean 'a'"),
        (X, ("b", 2.0, 2.0), {}, InputError, "lo < hi"),
        (X, ("b", 2.0, 1.0), {}, InputError, "lo < hi"),
        (("a", 0.0, float("nan")), Y, {}, InputError, "finite"),
        (("a", 0.0, float("inf")), Y, {}, InputError, "finite"),
        (("a", 0.0, "wide"), Y, {}, InputError, "two numbers"),
        (X, ("a", 0.0, 1.0), {}, InputError, "different"),
        ("a", Y, {}, InputError, "(name, lo, hi)"),
        (X, Y, dict(shape=(1, 5)), InputError, "at least 2"),
        (X, Y, dict(shape=(10.5, 5)), InputError, "whole numbers"),
        (X, Y, dict(shape=(10**7, 10**7)), ResourceLimitError, "GiB"),
        (X, Y, dict(tolerance=0.0), InputError, "1e-13"),
        (X, Y, dict(delt=0.1), UnknownNameError, "did you mean 'delta'"),
        (X, Y, dict(a=1.0), InputError, "axis"),
        (X, Y, dict(delta=float("nan")), InputError, "finite"),
        (X, Y, dict(about="linea"), InputError, "'linear'"),
        (X, Y, dict(about=dict(p=1.0)), UnknownNameError, "q, q_dot"),
        (("Omega", -1.0, 2.0), Y, {}, InputError, "bounds"),
    ],
)
def test_refusals(x, y, options, error, words):
    with pytest.raises(error, match=words.replace("(", r"\(").replace(")", r"\)")):
        st.chart(MATHIEU, x=x, y=y, **options)


def test_autonomous_and_forced_systems_are_told_what_to_do():
    with pytest.raises(InputError, match="autonomous"):
        st.chart(st.models.lorenz(), x=("rho", 1.0, 20.0), y=("sigma", 5.0, 10.0))
    with pytest.raises(InputError, match="about='linear'"):
        st.chart(st.models.duffing(), x=("Omega", 0.5, 2.0), y=("xi", 0.01, 0.1))
    with pytest.raises(InputError, match="relative residual"):
        st.chart(st.models.duffing(beta=0.5), x=("Omega", 0.5, 2.0), y=("xi", 0.01, 0.1), about="linear")


def test_an_equation_without_a_limit_names_the_state():
    import sympy as sp

    t, a, b = sp.symbols("t a b", real=True)
    q = sp.Function("q")(t)
    system = st.System.from_equations(
        {q.diff(t, 2): -(1 / a + b * sp.cos(t)) * q}, [q], parameters=dict(a=1.0, b=0.1), period=2 * sp.pi
    )
    with pytest.raises(NonFiniteError, match="q_dot"):
        st.chart(system, x=("a", 0.0, 1.0), y=("b", 0.0, 1.0))


@pytest.fixture(scope="module")
def chart():
    return st.chart(MATHIEU, x=X, y=Y, shape=(60, 40))


def test_words_compare_elementwise_and_count(chart):
    unstable = chart.verdict == st.Verdict.UNSTABLE
    assert unstable.shape == (40, 60) and unstable.dtype == bool
    assert np.array_equal(unstable, chart.growth_rate > 0)
    assert np.array_equal(chart.verdict != "stable", unstable)
    assert np.array_equal(chart.kind == "none", ~unstable)
    assert chart.verdict.counts()["unstable"] == unstable.sum()
    assert chart.verdict[0, 0] == "unstable" and str(chart.kind[0, 0]) == "+1"
    with pytest.raises(InputError, match="words are"):
        _ = chart.verdict == "wobbly"


def test_the_result_is_frozen(chart):
    with pytest.raises(ValueError):
        chart.growth_rate[0, 0] = 1.0
    with pytest.raises(AttributeError):
        chart.error = 0.0


def test_at_agrees_with_the_grid_and_with_liouville(chart):
    for j, i in ((3, 4), (30, 50), (39, 0)):
        point = chart.at(a=chart.x[i], b=chart.y[j])
        assert abs(point.growth_rate - chart.growth_rate[j, i]) < 1e-12
        assert point.verdict == chart.verdict[j, i] and point.kind == chart.kind[j, i]
        assert abs(np.prod(point.multipliers) - np.exp(-0.1 * 2 * np.pi)) < 1e-13
        assert abs(point.exponents[0].real - point.growth_rate) < 1e-14
    with pytest.raises(InputError, match="outside"):
        chart.at(a=9.0, b=1.0)
    with pytest.raises(UnknownNameError):
        chart.at(a=1.0, c=1.0)


def test_save_and_load_keep_everything(chart, tmp_path):
    path = tmp_path / "tongues.npz"
    chart.save(path)
    again = st.load(path)
    assert isinstance(again, st.StabilityChart)
    assert np.array_equal(again.growth_rate, chart.growth_rate) and np.all(again.verdict == chart.verdict)
    assert again.tips == chart.tips and again.error == chart.error and dict(again.params) == dict(chart.params)
    for old, new in zip(chart.boundaries, again.boundaries, strict=True):
        assert np.array_equal(old.x, new.x) and (old.kind, old.order) == (new.kind, new.order)
    assert np.array_equal(again.at(a=1.0, b=0.3).multipliers, chart.at(a=1.0, b=0.3).multipliers)


def test_csv_and_xarray(chart, tmp_path):
    path = tmp_path / "tongues.csv"
    chart.to_csv(path)
    rows = list(csv.reader(path.open()))
    assert rows[0] == ["a", "b", "growth_rate", "verdict", "kind"] and len(rows) == 1 + 2400
    assert float(rows[61][2]) == chart.growth_rate[1, 0]
    data = chart.to_xarray()
    assert data["growth_rate"].dims == ("b", "a") and data["growth_rate"].shape == (40, 60)


def test_every_refusal_is_a_stability_error():
    for error in (InputError, NonFiniteError, ResourceLimitError, UnknownNameError):
        assert issubclass(error, StabilityError)


def test_the_plot_has_symbols_on_its_axes_and_curves_by_kind(chart):
    ax = chart.plot()
    assert ax.get_xlabel() == "$a$" and ax.get_ylabel() == "$b$"
    assert len(ax.lines) == len(chart.boundaries) > 2
    assert {text.get_text() for text in ax.texts} >= {"1", "2"}
    assert chart.plot("class").images
    with pytest.raises(InputError, match="growth_rate"):
        chart.plot("colour")
