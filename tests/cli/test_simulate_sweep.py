"""The time-domain commands: files, numbers and refusals; the numbers are those of the functions they call."""

from __future__ import annotations

import json

import numpy as np
import pytest

import stability as st
from stability.cli import main


def document(capsys, *arguments):
    capsys.readouterr()
    code = main([*arguments, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_simulate_writes_what_it_computed(tmp_path, capsys):
    picture, table, stored = (tmp_path / f"m.{ending}" for ending in ("png", "csv", "npz"))
    code, found = document(
        capsys, "simulate", "duffing.from_physical", "--periods", "50", "--acceleration", "0.5g", "--set", "frequency=25",
        "-o", str(picture), "-o", str(table), "-o", str(stored),
    )  # fmt: skip
    run = st.simulate(st.models.duffing.from_physical(), (0, 2.0))
    assert code == 0 and found["status"] == "completed" and found["settled"] is True
    assert found["values"]["y"]["max"] == pytest.approx(run.max["y"], rel=1e-9)
    assert found["final"]["y"] == pytest.approx(run.final[0], rel=1e-9)
    assert picture.stat().st_size > 5000 and np.array_equal(st.load(stored).x, run.x)
    assert np.genfromtxt(table, delimiter=",", names=True)["y_mm"].max() == pytest.approx(run["y_mm"].max())


@pytest.mark.parametrize("kind", ["phase", "spectrum", "poincare"])
def test_simulate_draws_every_kind(tmp_path, kind):
    path = tmp_path / "k.png"
    assert main(["simulate", "duffing", "--time", "0:60", "--x0", "u=0.5", "--kind", kind, "-o", str(path)]) == 0
    assert path.stat().st_size > 4000


def test_simulate_shows_impacts(capsys):
    code, found = document(capsys, "simulate", "hard_stop_oscillator", "--set", "gap=1", "--time", "0:30")
    assert code == 0 and len(found["events"]) > 5 and {e["kind"] for e in found["events"]} == {"impact"}
    assert main(["simulate", "hard_stop_oscillator", "--set", "gap=1", "--time", "0:30"]) == 0
    assert "impact u stop" in capsys.readouterr().out


def test_sweep_both_ways(tmp_path, capsys):
    picture, table = tmp_path / "s.png", tmp_path / "s.csv"
    code, found = document(
        capsys, "sweep", "duffing.from_physical", "--range", "20:29", "--step", "0.5", "--acceleration", "0.5g", "--both",
        "--y", "y_mm.pp", "-o", str(picture), "-o", str(table),
    )  # fmt: skip
    assert code == 0 and found["parameter"] == "frequency"
    (up,), (down,) = (one["jumps"] for one in found["sweeps"])
    assert 26.998 < up["at"] < 27.05 and 22.75 < down["at"] < 22.798
    rows = np.genfromtxt(table, delimiter=",", names=True)
    assert len(rows) == 38 and rows["frequency"][0] == 20 and rows["frequency"][-1] == 20
    assert picture.stat().st_size > 5000


def test_sweep_keeps_a_result(tmp_path, capsys):
    path = tmp_path / "s.npz"
    assert main(["sweep", "linear_oscillator", "--set", "xi=0.1", "--range", "2:1", "--step", "0.5", "-o", str(path)]) == 0
    stored = st.load(path)
    assert stored.parameter.tolist() == [2.0, 1.5, 1.0] and stored.maximum["u"][-1] == pytest.approx(5.0, rel=1e-3)
    assert "largest" in capsys.readouterr().out


@pytest.mark.parametrize(("arguments", "said"), [
    (["simulate", "duffing"], "either --time"),
    (["simulate", "duffing", "--time", "5"], "from:to"),
    (["simulate", "duffing", "--time", "5:1"], "t0 < t1"),
    (["simulate", "lorenz", "--periods", "5"], "autonomous"),
    (["simulate", "duffing", "--time", "0:1", "--name", "w"], "no state or output 'w'"),
    (["simulate", "duffing", "--time", "0:1", "--acceleration", "1g"], "base motion"),
    (["simulate", "duffing", "--time", "0:1", "--acceleration", "1h"], "0.5g"),
    (["simulate", "duffing", "--time", "0:1", "--x0", "v=1"], "no state 'v'"),
    (["sweep", "duffing"], "--range"),
    (["sweep", "duffing", "--range", "1:1"], "differ"),
    (["sweep", "lorenz", "--range", "1:2"], "which parameter"),
    (["sweep", "duffing", "--range", "1:2", "--y", "u.top"], "measure"),
    (["sweep", "duffing", "--range", "1:2", "--record", "50"], "settling"),
    (["sweep", "duffing", "--range", "1:2", "--both", "-o", "x.npz"], "--both"),
    (["sweep", "duffing.from_physical", "--range", "1:2", "--acceleration", "1g", "--amplitude", "1"], "exclude"),
])  # fmt: skip
def test_refusals(arguments, said, capsys):
    assert main(arguments) == 2
    assert said in capsys.readouterr().err


def test_basins(tmp_path, capsys):
    """The numbers of the function; picture, table and data; shares on the terminal."""
    grid = ["--set", "frequency=25", "--x", "y:-6e-3:6e-3", "--y", "y_dot:-0.8:0.8", "--shape", "12x10"]
    picture, table, stored = (tmp_path / f"b.{ending}" for ending in ("png", "csv", "npz"))
    files = [part for path in (picture, table, stored) for part in ("-o", str(path))]
    code, found = document(capsys, "basins", "duffing.from_physical", *grid, *files)
    own = st.basins(
        st.models.duffing.from_physical(frequency=25.0), x=("y", -6e-3, 6e-3), y=("y_dot", -0.8, 0.8), shape=(12, 10)
    )
    assert code == 0 and [a["share"] for a in found["attractors"]] == [a.share for a in own.attractors]
    assert np.array_equal(st.load(stored).labels, own.labels) and picture.stat().st_size > 4000
    assert np.genfromtxt(table, delimiter=",", names=True)["attractor"].tolist() == own.labels.ravel().tolist()
    assert main(["basins", "duffing.from_physical", *grid]) == 0
    assert "repeats after 1 period; y = " in capsys.readouterr().out
    assert main(["basins", "lorenz", "--x", "x:0:1", "--y", "y:0:1"]) == 2
    assert "autonomous" in capsys.readouterr().err
