"""`stability models`, `doctor` and `new`. Witness: the objects of the library that they show."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from stability import models
from stability.cli import doctor, main


def test_models_lists_all_with_equations(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    for name, entry in models.catalogue().items():
        assert name in shown and " ".join(entry.equation.split()) in shown


def test_models_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["models"]
    assert {card["name"]: card["equation"] for card in listed} == {
        name: entry.equation for name, entry in models.catalogue().items()
    }


@pytest.mark.parametrize("name", models.catalogue())
def test_one_model(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The description holds the equation of the catalogue and the parameters of the system."""
    assert main(["models", name, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    system = models.catalogue()[name]()
    assert facts["equation"] == models.catalogue()[name].equation
    assert facts["parameters"] == dict(system.parameters) and facts["states"] == list(system.states)
    assert main(["models", name]) == 0
    assert repr(system) in capsys.readouterr().out


def test_constructor_of_a_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models", "base_driven_pendulum.from_physical", "--json"]) == 0
    system = models.base_driven_pendulum.from_physical()
    assert json.loads(capsys.readouterr().out)["parameters"] == dict(system.parameters)


def test_doctor_is_well_here(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["troubles"] == []
    assert set(document["back_ends"]) == {"lambdify", "llvm"} and document["versions"]["numpy"]
    assert Path(document["package"]["path"]) == Path(doctor.__file__).parents[1]


def test_doctor_sees_the_other_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A distribution named `stability` that installs a package of our name is trouble, whoever came last."""
    information = tmp_path / "stability-0.0.4.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: stability\nVersion: 0.0.4\n")
    (information / "RECORD").write_text("stability/__init__.py,,\n")
    (information / "top_level.txt").write_text("stability\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert main(["doctor"]) == 1


def test_doctor_sees_an_overwritten_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A file whose content is not what the installation recorded."""

    class Recorded:
        def __init__(self, name: str, text: bytes, hash_of: bytes) -> None:
            import base64
            import hashlib

            (tmp_path / name).write_bytes(text)
            digest = base64.urlsafe_b64encode(hashlib.sha256(hash_of).digest()).rstrip(b"=").decode()
            self.hash = type("Hash", (), {"mode": "sha256", "value": digest})
            self.parts, self.name = ("stability", name), name

        def locate(self) -> Path:
            return tmp_path / self.name

        def __str__(self) -> str:
            return f"stability/{self.name}"

    files = [Recorded("words.py", b"ours", b"ours"), Recorded("__init__.py", b"theirs", b"ours")]
    monkeypatch.setattr(doctor.metadata, "files", lambda name: files)
    assert doctor._altered() == ["stability/__init__.py"]


def test_doctor_names_a_broken_back_end(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def broken(*arguments: object) -> list[list[float]]:
        raise RuntimeError("no target machine")

    monkeypatch.setattr(doctor, "_oscillator_values", broken)
    assert main(["doctor"]) == 1
    assert "no target machine" in capsys.readouterr().out


def test_new_writes_a_template_that_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "my_oscillator.toml"]) == 0
    assert [p.name for p in tmp_path.iterdir()] == ["my_oscillator.toml"]
    capsys.readouterr()
    assert main(["models", "my_oscillator.toml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "my_oscillator"


@pytest.mark.parametrize("name", ["my-oscillator", "2dof", "a__b", "Ünder", "___"])
def test_new_makes_a_model_name_of_any_file_name(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", f"{name}.toml"]) == 0 and main(["models", f"{name}.toml"]) == 0


def test_new_never_overwrites_unasked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.toml"
    path.write_text("precious")
    assert main(["new", "mine.toml"]) == 2 and path.read_text() == "precious"
    assert main(["new", "mine.toml", "--force"]) == 0 and path.read_text() != "precious"
