"""Branches as data: reading, exact re-solving, going to other forms, and the round trip through a file."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import stability as st
from stability.errors import FileFormatError, InputError, UnknownNameError


@pytest.fixture(scope="module")
def branch() -> st.Branch:
    """x' = a - x^2: x = sqrt(a) stable, -sqrt(a) unstable, fold at 0."""
    x, a = sp.symbols("x a", real=True)
    system = st.System(name="fold", coordinates=("x",), states=("x",), parameters={"a": 1.0}, rhs=(a - x**2,))
    return st.continuation(st.Equilibrium(system), "a", (2.0, -1.0), start=[1.4], at=(0.5,))


def test_solutions_between_points_are_solved(branch: st.Branch) -> None:
    upper, lower = branch.at(a=1.2345)
    assert upper["x"] == pytest.approx(np.sqrt(1.2345), abs=1e-12)
    assert lower["x"] == pytest.approx(-np.sqrt(1.2345), abs=1e-12)
    assert (upper.verdict, lower.verdict) == (st.Verdict.STABLE, st.Verdict.UNSTABLE)
    assert len(branch.at(a=0.5)) == 2 and branch.at(a=-0.5) == ()
    with pytest.raises(UnknownNameError):
        branch.at(b=1.0)


def test_labels_columns_and_completion(branch: st.Branch) -> None:
    assert branch._ipython_key_completions_() == ["UZ1", "LP1", "UZ2"]
    assert branch["LP1"].kind is st.Kind.FOLD
    with pytest.raises(UnknownNameError, match="did you mean 'LP1'"):
        branch["LP2"]
    assert set(branch.columns) >= {"a", "x", "arclength", "residual"}
    with pytest.raises(UnknownNameError):
        branch.columns["y"]
    np.testing.assert_array_equal(branch.columns["a"], branch.parameter)


def test_arrays_cannot_be_written(branch: st.Branch) -> None:
    for array in (branch.parameter, branch.columns["x"], branch.values, branch.unknowns[0], branch["LP1"].u):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_representation_is_one_line(branch: st.Branch) -> None:
    text = repr(branch)
    assert text.startswith("Branch a 2 -> -1 | ") and "LP1" in text and text.endswith("| PARAMETER_BOUND")
    assert "\n" not in text and "unstable" in text


def test_segments_share_the_fold(branch: st.Branch) -> None:
    first, second = branch.segments()
    assert first.stop - 1 == second.start
    assert abs(branch.parameter[second.start]) < 1e-12
    assert branch.count(st.Verdict.STABLE) + branch.count(st.Verdict.UNSTABLE) >= len(branch) - 1


def test_tables(branch: st.Branch, tmp_path: Path) -> None:
    table = branch.to_dict()
    assert {len(column) for column in table.values()} == {len(branch)}
    branch.to_csv(tmp_path / "branch.csv")
    with open(tmp_path / "branch.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(branch) and {r["label"] for r in rows} == {"", "UZ1", "LP1", "UZ2"}
    np.testing.assert_array_equal([float(r["x"]) for r in rows], branch.columns["x"])


def test_round_trip(branch: st.Branch, tmp_path: Path) -> None:
    branch.save(tmp_path / "fold.npz")
    again = st.load(tmp_path / "fold.npz")
    assert repr(again) == repr(branch) and again.labels == branch.labels
    for name in branch.columns:
        np.testing.assert_array_equal(again.columns[name], branch.columns[name])
    np.testing.assert_array_equal(again.values, branch.values)
    assert [s["x"] for s in again.at(a=0.7)] == [s["x"] for s in branch.at(a=0.7)]
    assert again["LP1"].solution["x"] == branch["LP1"].solution["x"]
    longer = again.extend(window=(3.0, -1.0))
    assert longer.parameter[-1] == 3.0 and longer.labels == branch.labels


def test_switch_after_loading(tmp_path: Path) -> None:
    trivial = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (0.0, 20.0))
    trivial["BP1"].save(tmp_path / "bp.npz")
    side = st.continuation(st.switch(st.load(tmp_path / "bp.npz")), "rho", (0.0, 20.0))
    np.testing.assert_allclose(side.columns["z"], side.parameter - 1, atol=1e-8)


def test_loading_and_drawing_needs_no_solver(branch: st.Branch, tmp_path: Path) -> None:
    """A fresh process loads and plots a branch without scipy, sympy, numba or any problem class."""
    branch.save(tmp_path / "fold.npz")
    code = (
        "import sys, matplotlib; matplotlib.use('Agg'); import stability as st\n"
        f"st.load({str(tmp_path / 'fold.npz')!r}).plot()\n"
        "bad = [m for m in sys.modules if m.split('.')[0] in ('scipy', 'sympy', 'numba')"
        " or m.startswith(('stability.problems', 'stability.following'))]\n"
        "assert not bad, bad"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_system_of_a_python_function_is_view_only_after_loading(tmp_path: Path) -> None:
    def f(t: float, x: np.ndarray, *, a: float = 1.0) -> np.ndarray:
        return np.array([a - x[0] ** 3])

    system = st.System.from_function(f, states="x")
    branch = st.continuation(st.Equilibrium(system), "a", (0.5, 2.0))
    np.testing.assert_allclose(branch.columns["x"] ** 3, branch.parameter, rtol=1e-7)
    branch.save(tmp_path / "f.npz")
    again = st.load(tmp_path / "f.npz")
    np.testing.assert_array_equal(again.columns["x"], branch.columns["x"])
    with pytest.raises(InputError, match="Python function"):
        again.at(a=1.1)


def test_damaged_and_foreign_files(branch: st.Branch, tmp_path: Path) -> None:
    branch.save(tmp_path / "fold.npz")
    whole = (tmp_path / "fold.npz").read_bytes()
    for cut in (0, 10, len(whole) // 2, len(whole) - 30):
        (tmp_path / "cut.npz").write_bytes(whole[:cut])
        with pytest.raises(FileFormatError):
            st.load(tmp_path / "cut.npz")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(FileFormatError):
        st.load(tmp_path / "other.npz")
    with pytest.raises(FileNotFoundError):
        st.load(tmp_path / "none.npz")


def test_pickled_content_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "p.npz", __header__=np.array([{"a": 1}], dtype=object))
    with pytest.raises(FileFormatError):
        st.load(tmp_path / "p.npz")
