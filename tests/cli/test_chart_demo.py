"""`stability chart` and `demo`: files, JSON, cold start. Witness: `stability.chart` called directly; sys.modules."""

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
from stability.cli.demos import SECTIONS

ROOT = Path(__file__).resolve().parents[2]
SMALL = ["--set", "delta=0.05", "--x", "a:0:0.6", "--y", "b:0:0.4", "--shape", "40x30"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def reference() -> st.results.chart.StabilityChart:  # type: ignore[name-defined]
    return st.chart(st.models.mathieu(delta=0.05), x=("a", 0, 0.6), y=("b", 0, 0.4), shape=(40, 30))


@pytest.mark.parametrize(
    ("ending", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF"), ("PNG", b"\x89PNG")]
)
@pytest.mark.parametrize("kind", ["growth_rate", "class"])
def test_pictures(folder: Path, ending: str, magic: bytes, kind: str) -> None:
    assert main(["chart", "mathieu", *SMALL, "--kind", kind, "-o", f"tongues.{ending}"]) == 0
    assert [p.name for p in folder.iterdir()] == [f"tongues.{ending}"], "one file, and nothing temporary"
    assert (folder / f"tongues.{ending}").read_bytes().startswith(magic)


@pytest.mark.parametrize("ending", ["png", "svg", "pdf", "npz", "csv"])
def test_same_input_same_bytes(folder: Path, ending: str) -> None:
    for name in ("one", "two"):
        assert main(["chart", "mathieu", *SMALL, "-o", f"{name}.{ending}"]) == 0
    assert (folder / f"one.{ending}").read_bytes() == (folder / f"two.{ending}").read_bytes()


def test_npz_is_the_chart(folder: Path, reference: object) -> None:
    assert main(["chart", "mathieu", *SMALL, "-o", "a.npz"]) == 0
    stored = st.load(folder / "a.npz")
    assert np.array_equal(stored.growth_rate, reference.growth_rate)  # type: ignore[attr-defined]
    assert stored.tips == reference.tips  # type: ignore[attr-defined]


def test_csv_is_the_chart(folder: Path, reference: object) -> None:
    assert main(["chart", "mathieu", *SMALL, "-o", "a.csv"]) == 0
    with (folder / "a.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    growth = np.array([float(row["growth_rate"]) for row in rows]).reshape(30, 40)
    assert np.array_equal(growth, reference.growth_rate)  # type: ignore[attr-defined]
    assert list(rows[0]) == ["a", "b", "growth_rate", "verdict", "kind"]


def test_json(folder: Path, capsys: pytest.CaptureFixture[str], reference: object) -> None:
    assert main(["chart", "mathieu", *SMALL, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["shape"] == [40, 30] and document["set"] == {"delta": 0.05} and document["written"] == []
    assert document["tips"] == [{"order": t.order, "kind": t.kind, "a": t.x, "b": t.y} for t in reference.tips]  # type: ignore[attr-defined]
    assert abs(sum(document["shares"].values()) - 1) < 1e-12
    assert not list(folder.iterdir())


def test_never_overwrites_unasked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "precious.png"
    path.write_text("precious")
    assert main(["chart", "mathieu", *SMALL, "-o", "precious.png"]) == 2
    assert path.read_text() == "precious" and "--force" in capsys.readouterr().err
    assert main(["chart", "mathieu", *SMALL, "-o", "precious.png", "--force"]) == 0
    assert path.read_bytes().startswith(b"\x89PNG")


def test_a_write_that_fails_leaves_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk while writing: exit code 1, no half file under the name, no temporary file."""
    import stability.cli.chart as module

    def full(computed: object, path: Path, kind: str) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(module, "_write", full)
    assert main(["chart", "mathieu", *SMALL, "-o", "a.png"]) == 1
    assert not list(folder.iterdir())


def test_summary_names_the_tips(capsys: pytest.CaptureFixture[str], reference: object) -> None:
    assert main(["chart", "mathieu", *SMALL]) == 0
    text = capsys.readouterr().out
    for tip in reference.tips:  # type: ignore[attr-defined]
        assert f"tongue {tip.order} opens (mu = {tip.kind})" in text and f"{tip.y:.10g}" in text


def test_equilibrium_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["chart", "base_driven_pendulum", "--x", "Omega:1:2.5", "--y", "epsilon:0:0.3", "--shape", "20x10"]
    assert main([*arguments, "--about", "phi=0", "--json"]) == 0
    assert main([*arguments, "--about", "phj=0"]) == 2
    assert "did you mean 'phi'" in capsys.readouterr().err


def test_model_files(folder: Path, capsys: pytest.CaptureFixture[str], reference: object) -> None:
    """A text file and a Python function give the chart of the same equation in the catalogue."""
    (folder / "mine.toml").write_text(
        'name = "mine"\ncoordinates = ["q"]\nequations = ["q\'\' + 2*delta*q\' + (a + b*cos(t))*q = 0"]\n'
        'period = "2*pi"\n[parameters]\na = 0.25\nb = 0.1\ndelta = 0.0\n'
    )
    (folder / "mine.py").write_text("import stability as st\n\ndef mine():\n    return st.models.mathieu()\n")
    for model in ("mine.toml", "mine.py:mine"):
        assert main(["chart", model, *SMALL, "-o", "mine.npz", "--force"]) == 0
        error = np.abs(st.load("mine.npz").growth_rate - reference.growth_rate)  # type: ignore[attr-defined]
        assert error.max() < 1e-9


COLD = """
import json, sys
from stability.cli import main
code = main({arguments!r})
sys.stderr.write(json.dumps([code, sorted({{name.split(".")[0] for name in sys.modules}})]))
"""


@pytest.mark.parametrize("picture", [False, True])
def test_cold_start_loads_neither_scipy_nor_numba(folder: Path, picture: bool) -> None:
    """What keeps `stability chart mathieu` short from a cold shell: numpy and sympy, matplotlib for a picture only."""
    arguments = ["chart", "mathieu", "--shape", "40x30", *(["-o", "a.png"] if picture else [])]
    run = subprocess.run(
        [sys.executable, "-c", COLD.format(arguments=arguments)],
        capture_output=True, text=True, cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, check=True,
    )  # fmt: skip
    code, loaded = json.loads(run.stderr.splitlines()[-1])
    assert code == 0
    assert not {"scipy", "numba", "pandas", "xarray"} & set(loaded)
    assert ("matplotlib" in loaded) == picture


@pytest.mark.parametrize("section", SECTIONS)
def test_demo_section(section: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", section, "--json"]) == 0
    (document,) = json.loads(capsys.readouterr().out)["sections"]
    assert document["table"] and (folder / document["figure"]).stat().st_size > 10_000


def test_demo_keeps_what_is_there(folder: Path) -> None:
    assert main(["demo", "tongues"]) == 0
    before = (folder / "stability-demo" / "tongues.png").stat()
    assert main(["demo", "tongues"]) == 0
    assert (folder / "stability-demo" / "tongues.png").stat() == before
    assert (folder / "stability-demo-2" / "tongues.png").is_file()
