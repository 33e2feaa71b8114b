"""Exit codes, JSON, errors without tracebacks: what every command shares. Witness: the contract of the command line."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import click
import pytest

from stability.cli import COMMANDS, _console, main
from stability.errors import ConvergenceError, InputError

ROOT = Path(__file__).resolve().parents[2]


def shell(*arguments: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line as a person starts it, in a folder that is not the repository."""
    return subprocess.run(
        [sys.executable, "-m", "stability", *arguments],
        cwd=cwd, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=120,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", **environment},
    )  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"Usage: stability {command}") and "--json" in text


def test_bare_command_shows_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    shown = capsys.readouterr().out
    assert all(command in shown for command in COMMANDS)


BAD = {
    "misspelt command": (["chrat", "mathieu"], "did you mean 'chart'"),
    "no such option": (["models", "--frobnicate"], "--frobnicate"),
    "no such model": (["models", "mathieux"], "did you mean 'mathieu'"),
    "no such constructor": (["models", "mathieu.from_moon"], "mathieu.from_moon"),
    "no such parameter": (["chart", "mathieu", "--set", "dleta=0.1"], "did you mean 'delta'"),
    "set twice": (["chart", "mathieu", "--set", "delta=0.1", "--set", "delta=0.2"], "set twice"),
    "no value": (["chart", "mathieu", "--set", "delta"], "name=value"),
    "word for a number": (["chart", "mathieu", "--set", "delta=large"], "delta"),
    "truth for a number": (["chart", "mathieu", "--set", "delta=true"], "delta must be a number"),
    "not finite": (["chart", "mathieu", "--set", "delta=nan"], "finite"),
    "infinite": (["chart", "mathieu", "--x", "a:0:inf"], "finite"),
    "lo above hi": (["chart", "mathieu", "--x", "a:2:1"], "less than"),
    "half an interval": (["chart", "mathieu", "--x", "a:2"], "name:lo:hi"),
    "shape": (["chart", "mathieu", "--shape", "100"], "1000x1000"),
    "shape of one point": (["chart", "mathieu", "--shape", "1x10"], "at least 2"),
    "kind": (["chart", "mathieu", "--kind", "colour"], "growth_rate"),
    "format": (["chart", "mathieu", "-o", "chart.docx"], ".png"),
    "folder": (["chart", "mathieu", "-o", "no/such/folder/chart.png"], "no folder"),
    "missing axes": (["chart", "coupled_mathieu"], "--x"),
    "no such file": (["models", "no_such_file.toml"], "no_such_file.toml"),
    "no such python file": (["models", "no_such_file.py:f"], "no_such_file.py"),
    "section": (["demo", "tonges"], "did you mean 'tongues'"),
    "template": (["new", "model.yaml"], ".toml"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_mistake_is_one_sentence(
    case: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit code 2, the sentence names what is wrong; nothing is written, nothing is traced back."""
    monkeypatch.chdir(tmp_path)
    arguments, expected = BAD[case]
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert expected in captured.err and "error: " in captured.err
    assert "Traceback" not in captured.err and captured.out == ""
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("case", BAD)
def test_a_mistake_as_json(
    case: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*BAD[case][0], "--json"]) == 2
    document = json.loads(capsys.readouterr().out)
    assert document["error"]["exit_code"] == 2 and document["error"]["message"]


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InputError("x"), 2),
        (FileNotFoundError(2, "No such file", "x"), 2),
        (click.UsageError("x"), 2),
        (ConvergenceError("x", residual=1.0), 1),
        (MemoryError(), 1),
        (OSError(28, "No space left on device"), 1),
        (KeyboardInterrupt(), 130),
        (click.Abort(), 130),
    ],
    ids=lambda value: type(value).__name__,
)
def test_exit_codes(error: BaseException, code: int) -> None:
    assert _console.exit_code(error) == code


def test_interruption(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Ctrl-C is 130 and one line."""
    import stability.cli.models as module

    def interrupt(console: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "_list", interrupt)
    assert main(["models"]) == 130
    assert capsys.readouterr().err.strip() == "error: interrupted; no unfinished file was left"


def test_library_warnings_are_sentences(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    import warnings

    import stability.cli.models as module
    from stability.errors import TruncationWarning

    monkeypatch.setattr(module, "_list", lambda console: warnings.warn(TruncationWarning("7 harmonics"), stacklevel=1))
    assert main(["models"]) == 0
    assert capsys.readouterr().err == "warning: 7 harmonics\n"


def test_trouble_in_a_python_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The user's own mistake: the file, the line and the exception, no traceback."""
    file = tmp_path / "mine.py"
    file.write_text("def mine():\n    return 1 / 0\n")
    assert main(["models", f"{file}:mine"]) == 2
    said = capsys.readouterr().err
    assert "line 2: ZeroDivisionError" in said and "Traceback" not in said


def test_started_by_a_shell(tmp_path: Path) -> None:
    """A process: exit codes reach the shell, no colour codes in a pipe, foreign files do no harm."""
    for name in ("numpy.txt", "types.toml"):
        (tmp_path / name).write_text("not a module")
    version = shell("--version", cwd=tmp_path)
    assert version.returncode == 0 and version.stdout.startswith("stability, version 0.")
    wrong = shell("models", "mathieux", cwd=tmp_path)
    assert wrong.returncode == 2 and "\x1b" not in wrong.stderr and "Traceback" not in wrong.stderr
