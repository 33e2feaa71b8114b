"""`stability response`: table, files and JSON against `stability.responses`, and what a mistake says."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import stability as st
from stability.cli import main

DUFFING = ["response", "duffing", "--set", "beta=0.001", "--parameter", "Omega", "--range", "0.8:1.6"]
PLAIN = ["response", "duffing_textbook", "--set", "gamma=0.3", "--parameter", "omega", "--range", "0.4:0.6"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_methods_side_by_side(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Folds of ten digits; averaging has those of one-harmonic balance (discriminant of the cubic)."""
    arguments = [*DUFFING, "--method", "averaging, hb9, collocation", "-o", "r.png", "-o", "r.csv", "-o", "r.npz"]
    assert main([*arguments, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    rows = {row["method"]: row for row in document["methods"]}
    assert document["reference"] == "collocation" and document["quantity"] == "u.amplitude(1)"
    assert np.allclose(rows["collocation"]["folds"], [1.088436639, 1.380933030], atol=2e-9, rtol=0)
    closed = sorted(place for place, _ in st.duffing_folds(xi=0.02, beta=0.001))
    assert np.allclose(rows["averaging"]["folds"], closed, atol=1e-9, rtol=0)
    assert rows["hb9"]["largest_error"] < 1e-9 < rows["averaging"]["largest_error"]
    assert (folder / "r.png").read_bytes().startswith(b"\x89PNG")
    stored = st.load("r.npz")
    assert list(stored) == list(rows)
    with (folder / "r.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert {row["method"] for row in table} == set(rows)
    assert [float(row["Omega"]) for row in table] == stored.to_dict()["Omega"].tolist()
    assert main(["plot", "r.npz", "-o", "again.png"]) == 0


def test_report_is_the_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*PLAIN, "--method", "averaging2,collocation", "--quantity", "x.max"]) == 0
    out = capsys.readouterr().out
    assert "x.max along omega" in out and "averaging2" in out and not list(folder.iterdir())


def test_a_method_that_fails_is_reported_and_the_others_are_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """|x| with forcing cannot be averaged: exit code 1, the sentence, and the file of the rest."""
    (folder / "m.toml").write_text(
        'name = "m"\ncoordinates = ["x"]\nequations = ["x\'\' + 0.1*x\' + x + e*exp(x) = e*cos(w*t)"]\n'
        'period = "2*pi/w"\n[parameters]\ne = 0.1\nw = 1.0\n'
    )
    arguments = ["response", "m.toml", "--parameter", "w", "--range", "0.5:0.8", "--small", "e"]
    assert main([*arguments, "--method", "averaging,hb5,collocation", "-o", "r.npz"]) == 1
    out = capsys.readouterr().out
    assert "averaging    failed: " in out and "use HarmonicBalance(system)" in out
    assert list(st.load("r.npz")) == ["collocation", "hb5"]
    # alone it is bad input
    assert main([*arguments, "--method", "averaging"]) == 2


def test_measured_data_beside_the_methods(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "shaker.csv").write_text("frequency [Hz]; amplitude [mm]\n24,0; 3,32\n25,0; 3,66\n26,0; 3,99\n")
    arguments = ["response", "duffing.from_physical", "--parameter", "frequency", "--range", "20:29"]
    assert main([*arguments, "--method", "collocation", "--data", "shaker.csv", "-o", "r.png", "--json"]) == 0
    rows = {row["method"]: row for row in json.loads(capsys.readouterr().out)["methods"]}
    assert rows["measured"]["matched"] == 3 and rows["measured"]["largest_error"] < 0.01
    (folder / "bad.csv").write_text("frequency [Hz]; amplitude [mm]\n24,0; x\n")
    assert main([*arguments, "--method", "collocation", "--data", "bad.csv"]) == 2
    assert main([*arguments, "--method", "collocation", "--data", "none.csv"]) == 2


MISTAKES = {
    "no such method": ([*PLAIN, "--method", "colocation"], "did you mean 'collocation'"),
    "no harmonics": ([*PLAIN, "--method", "hb0"], "hb0"),
    "no method": ([*PLAIN, "--method", ","], "at least one"),
    "no such parameter": (["response", "duffing", "--parameter", "omega", "--range", "0.5:1"], "did you mean 'Omega'"),
    "autonomous": (["response", "lorenz", "--parameter", "rho", "--range", "1:2"], "autonomous"),
    "downward": ([*PLAIN[:6], "--range", "0.6:0.4"], "from < to"),
    "format": ([*PLAIN, "-o", "a.txt"], ".npz"),
    "no such column": ([*PLAIN, "--method", "hb3", "--quantity", "x.mux"], "did you mean 'x.max'"),
    "resonance": ([*PLAIN, "--resonance", "2"], "for example 2:1"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_one_sentence(case: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments, expected = MISTAKES[case]
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert expected in captured.err and "Traceback" not in captured.err
    assert not list(folder.iterdir())
