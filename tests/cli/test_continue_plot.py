"""`stability continue` and `plot`. Witness: closed forms, known folds, and `stability.continuation` called directly."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import stability as st
from stability.cli import main

ROOT = Path(__file__).resolve().parents[2]
DUFFING = ["continue", "duffing", "--set", "beta=0.001", "--parameter", "Omega", "--range", "0.8:1.6"]
LORENZ = ["continue", "lorenz", "--parameter", "rho", "--range", "0:30"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_folds_of_the_duffing_oscillator(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Folds at 1.380933030 and 1.088436639 (an independent multiple-shooting solve); files hold the same branch."""
    assert main([*DUFFING, "--json", "-o", "b.npz", "-o", "b.csv", "-o", "b.png"]) == 0
    document = json.loads(capsys.readouterr().out)
    (facts,) = document["branches"]
    places = [point["Omega"] for point in facts["special"] if point["kind"] == "fold"]
    assert np.allclose(places, [1.380933030, 1.088436639], atol=1e-8, rtol=0)
    stored = st.load("b.npz")
    assert len(stored) == facts["points"] and stored.labels == ("LP1", "LP2")
    with (folder / "b.csv").open(newline="") as stream:
        column = [float(row["Omega"]) for row in csv.DictReader(stream)]
    assert np.array_equal(column, stored.parameter)
    assert (folder / "b.png").read_bytes().startswith(b"\x89PNG")


def test_switching_to_the_branch_that_is_born(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Lorenz: pitchfork at rho = 1, Hopf points of both halves at 470/19."""
    assert main([*LORENZ, "--switch", "BP1", "--json"]) == 0
    first, born = json.loads(capsys.readouterr().out)["branches"]
    assert abs(first["special"][0]["rho"] - 1) < 1e-9
    hopf = [point["rho"] for point in born["special"] if point["kind"] == "Hopf"]
    assert len(hopf) == 2 and np.allclose(hopf, 470 / 19, atol=1e-8, rtol=0)
    assert not list(folder.iterdir())


def test_a_curve_of_special_points(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Hopf points of the Lorenz system: rho = sigma (sigma + b + 3)/(sigma - b - 1)."""
    arguments = ["continue", "lorenz", "--parameter", "rho", "--range", "15:30", "--json", "-o", "c.csv", "-o", "c.png"]
    arguments += ["--start", "x=6", "--start", "y=6", "--start", "z=14", "--locus", "HB1", "--free", "sigma"]
    assert main(arguments) == 0
    assert len(json.loads(capsys.readouterr().out)["branches"]) == 2
    with (folder / "c.csv").open(newline="") as stream:
        rows = [(float(row["rho"]), float(row["sigma"])) for row in csv.DictReader(stream)]
    rho, sigma = np.array(rows).T
    assert np.allclose(rho, sigma * (sigma + 17 / 3) / (sigma - 11 / 3), rtol=1e-10, atol=0)
    assert (folder / "c.png").read_bytes().startswith(b"\x89PNG")


def test_going_on_from_a_saved_branch(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same Hopf curve from the file of the branch, ended at sigma = 8 and 15; a born branch from the same file."""
    arguments = ["continue", "lorenz", "--parameter", "rho", "--range", "15:30", "-o", "saved.npz"]
    assert main([*arguments, "--start", "x=6", "--start", "y=6", "--start", "z=14"]) == 0
    curve = ["continue", "saved.npz", "--locus", "HB1", "--free", "sigma", "--free-range", "8:15", "--json"]
    assert main([*curve, "-o", "curve.npz", "-o", "curve.svg"]) == 0
    out = capsys.readouterr().out
    assert len(json.loads(out[out.index("{") :])["branches"]) == 2
    found = st.load("curve.npz")
    rho, sigma = found.columns["rho"], found.columns["sigma"]
    assert np.allclose(rho, sigma * (sigma + 17 / 3) / (sigma - 11 / 3), rtol=1e-10, atol=0)
    assert sorted((sigma[0], sigma[-1])) == [8.0, 15.0]
    assert main(curve[:-1]) == 0
    assert "sigma = 10" in capsys.readouterr().out
    assert main(["continue", "saved.npz", "--switch", "HB1", "--range", "22:26"]) in (0, 1)
    assert "Branch rho 22 -> 26" in capsys.readouterr().out


def test_a_saved_branch_asks_where_to_go_on(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*LORENZ, "-o", "saved.npz"]) == 0
    wrong = {
        "--switch LABEL": [], "only": ["--set", "beta=1", "--switch", "BP1"],
        "'rho'": ["--parameter", "sigma", "--switch", "BP1"], "window of --free": ["--free-range", "1:2"],
    }  # fmt: skip
    for words, options in wrong.items():
        capsys.readouterr()
        assert main(["continue", "saved.npz", *options]) == 2
        assert words in capsys.readouterr().err


def test_report_names_the_points(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(LORENZ) == 0
    assert "BP1  rho = 1  branch point" in capsys.readouterr().out


def test_start_of_a_branch(capsys: pytest.CaptureFixture[str]) -> None:
    """From a state near x = y = sqrt(8/3 (rho - 1)) the nontrivial equilibria are followed."""
    arguments = ["continue", "lorenz", "--parameter", "rho", "--range", "15:30", "--json"]
    assert main([*arguments, "--start", "x=6", "--start", "y=6", "--start", "z=14"]) == 0
    (facts,) = json.loads(capsys.readouterr().out)["branches"]
    assert abs(facts["special"][0]["rho"] - 470 / 19) < 1e-8


def branches_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> list[dict[str, object]]:
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)["branches"]  # type: ignore[no-any-return]


def test_methods_find_the_same_folds(capsys: pytest.CaptureFixture[str]) -> None:
    for method in ("harmonic-balance", "shooting"):
        (facts,) = branches_of([*DUFFING, "--method", method], capsys)
        places = [point["Omega"] for point in facts["special"] if point["kind"] == "fold"]  # type: ignore[attr-defined]
        assert np.allclose(places, [1.380933030, 1.088436639], atol=1e-6, rtol=0)


def test_steps_and_periods(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A shorter longest step takes more points; an orbit run through twice has the period doubled and the same folds."""
    plain, fine = (branches_of([*DUFFING, *more], capsys)[0] for more in ([], ["--ds-max", "0.05"]))
    assert fine["points"] > 2 * plain["points"]  # type: ignore[operator]
    arguments = [*DUFFING, "--multiple", "2", "-o", "b.npz"]
    (twice,) = branches_of(arguments, capsys)
    assert [point["label"] for point in twice["special"]] == ["LP1", "LP2"]  # type: ignore[attr-defined]
    assert st.load("b.npz").columns["period"][0] == pytest.approx(4 * np.pi / 0.8)
    (few,) = branches_of([*DUFFING, "--method", "harmonic-balance", "--harmonics", "1"], capsys)
    assert len(few["special"]) == 2  # type: ignore[arg-type]


def test_symmetric_orbits(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The symmetry-breaking points of x'' + 0.1 x' + x + x^3 = 5 cos omega t are those of the whole period."""
    model = ["continue", "duffing_textbook", "--set", "delta=0.1", "--set", "gamma=5"]
    arguments = [*model, "--parameter", "omega", "--range", "0.8:2.0"]
    whole, half = (branches_of([*arguments, *more], capsys)[0]["special"] for more in ([], ["--symmetric"]))
    assert [point["label"] for point in whole] == [point["label"] for point in half]  # type: ignore[attr-defined]
    assert [point["symmetry_breaking"] for point in half] == [True, True]  # type: ignore[attr-defined]
    places = [[point["omega"] for point in special] for special in (whole, half)]  # type: ignore[attr-defined]
    assert places[0] == pytest.approx(places[1], abs=1e-6)


ROTOR = """name = "rotor"
coordinates = ["phi"]
equations = ["phi'' + 0.2*phi' + w**2*A*sin(phi)*cos(w*t) + 0.05*sin(phi) = 0"]
period = "2*pi/w"
angles = ["phi"]
[parameters]
w = 1.0
A = 0.8
"""


def test_rotations(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A pendulum on a driven pivot turns once per period: phi(T) = phi(0) + 2 pi."""
    (folder / "rotor.toml").write_text(ROTOR)
    arguments = ["continue", "rotor.toml", "--parameter", "w", "--range", "1:1.1", "--winding", "phi=1"]
    (facts,) = branches_of([*arguments, "--start", "phi_dot=1", "-o", "r.npz"], capsys)
    orbit = st.load("r.npz").solution(-1)
    assert facts["status"] == "parameter bound"
    assert orbit(orbit.period)[0] - orbit(0.0)[0] == pytest.approx(2 * np.pi)


def test_far_ends_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["continue", "autoparametric_pendulum", "--parameter", "Omega", "--range", "0.5:1.5", "--switch", "PD1"]
    for pair in ("length_ratio=10", "Omega0=0.5", "xi1=0.02", "xi2=0.01"):
        arguments += ["--set", pair]
    assert main(arguments) == 0
    assert "(parent's PD)" in capsys.readouterr().out


MISTAKES = {
    "harmonics of nothing": ([*DUFFING, "--harmonics", "3"], "harmonic-balance"),
    "an angle twice": ([*DUFFING, "--winding", "u=1", "--winding", "u=2"], "--winding"),
    "no such angle": ([*DUFFING, "--winding", "u=1"], "no angle"),
    "turns of an equilibrium": ([*LORENZ, "--winding", "x=1"], "--method collocation"),
    "no step": ([*LORENZ, "--ds-max", "0"], "--ds-max"),
    "no such parameter": ([*LORENZ[:3], "roh", *LORENZ[4:]], "did you mean 'rho'"),
    "no range": (LORENZ[:4], "--range"),
    "half a range": ([*LORENZ[:5], "3"], "from:to"),
    "empty range": ([*LORENZ[:5], "3:3"], "differ"),
    "no such point": ([*LORENZ, "--switch", "PD1"], "PD1"),
    "nothing is born there": ([*DUFFING, "--switch", "LP1"], "LP1"),
    "no second parameter": ([*LORENZ, "--locus", "BP1"], "--free"),
    "no parameter": (["continue", "duffing"], "--parameter"),
    "no such second parameter": ([*LORENZ, "--locus", "BP1", "--free", "sigm"], "did you mean 'sigma'"),
    "equilibria of a forced system": ([*DUFFING, "--method", "equilibrium"], "Collocation"),
    "format": ([*LORENZ, "-o", "a.txt"], ".npz"),
    "no stored file": (["plot", "none.npz"], "none.npz"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_one_sentence(case: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments, expected = MISTAKES[case]
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert expected in captured.err and "Traceback" not in captured.err
    assert not list(folder.iterdir())


def test_a_branch_that_breaks_off_is_written_and_fails(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """x' = sqrt(mu) - x has no equilibrium beyond mu = 0. Exit code 1 tells a script; what was computed is kept."""
    (folder / "edge.toml").write_text(
        'name = "edge"\ncoordinates = ["x"]\nequations = ["x\' = sqrt(mu) - x"]\n[parameters]\nmu = 1.0\n'
    )
    assert main(["continue", "edge.toml", "--parameter", "mu", "--range", "1:-1", "-o", "a.npz", "--json"]) == 1
    (facts,) = json.loads(capsys.readouterr().out)["branches"]
    assert facts["status"] in ("step too small", "diverged")
    stored = st.load("a.npz")
    assert len(stored) > 5 and stored.parameter.min() >= 0


def test_a_misspelt_column_costs_the_picture_only(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Data are written before pictures, whatever their order: the branch is not lost."""
    assert main([*DUFFING, "--y", "u.mux", "-o", "b.png", "-o", "b.npz"]) == 2
    assert "did you mean 'u.max'?" in capsys.readouterr().err
    assert st.load("b.npz").labels == ("LP1", "LP2") and not (folder / "b.png").exists()


def test_rounding_errors_are_not_shown(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Van der Pol's Hopf point is at mu = 0, not at 1e-32."""
    assert main(["continue", "van_der_pol", "--parameter", "mu", "--range=-1:1"]) == 0
    out = capsys.readouterr().out
    assert "mu = 0  " in out and "e-" not in out


def test_plot_draws_what_was_stored(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*DUFFING, "-o", "b.npz"]) == 0
    assert main(["plot", "b.npz", "--y", "u.max"]) == 0
    assert (folder / "b.png").read_bytes().startswith(b"\x89PNG")
    assert main(["plot", "b.npz"]) == 2, "it is there already"
    assert main(["plot", "b.npz", "--y", "u.maxx", "-o", "c.png"]) == 2
    assert "did you mean 'u.max'" in capsys.readouterr().err
    assert main(["plot", "b.npz", "--kind", "class", "-o", "c.png"]) == 2
    assert "not drawn with --kind" in capsys.readouterr().err
    assert sorted(p.name for p in folder.iterdir()) == ["b.npz", "b.png"]


def test_plot_refuses_a_damaged_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "a.npz").write_bytes(b"PK\x03\x04 not an archive")
    assert main(["plot", "a.npz"]) == 2
    assert "a.npz" in capsys.readouterr().err and not (folder / "a.png").exists()


def test_plot_loads_no_solver(folder: Path) -> None:
    """A stored branch is drawn without scipy, numba or sympy."""
    assert main([*LORENZ, "-o", "a.npz"]) == 0
    program = "import sys; from stability.cli import main; code = main(['plot', 'a.npz']); " \
              "sys.exit(code or bool({'scipy', 'numba', 'sympy'} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", program], env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=folder)
    assert run.returncode == 0
