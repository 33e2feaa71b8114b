"""README and docs are run: Python blocks of a page in order, in one namespace; commands through the command line.

A block that is fenced as ``python`` has to run; lines ``$ stability ...`` in ``console`` blocks have to end with 0.
"""

from __future__ import annotations

import re
import shlex
import warnings
from pathlib import Path

import pytest

from stability.cli import main

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^(?P<quote>(?:> ?)?)```(?P<language>\w+)\n(?P<code>.*?)^(?P=quote)```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\[[^\]]*\]\((?!https?:|mailto:|#)([^)#\s]+)[^)]*\)")


def blocks(page: Path, language: str) -> list[tuple[int, str]]:
    """(first line, code) of the fenced blocks in a language."""
    text = page.read_text(encoding="utf-8")
    found = [m for m in FENCE.finditer(text) if m["language"] == language]
    return [(text.count("\n", 0, m.start()) + 2, m["code"]) for m in found]


def commands(page: Path) -> list[str]:
    """``stability`` commands of a page, continued lines joined."""
    code = "\n".join(code for _, code in blocks(page, "console")).replace("\\\n", " ")
    return [line[2:].strip() for line in code.splitlines() if line.startswith("$ stability ")]


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python")], ids=name)
def test_python_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {"__name__": "page"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=DeprecationWarning, module=r"(?!stability)")  # between others
        for line, code in blocks(page, "python"):
            exec(compile("\n" * (line - 1) + code, str(page), "exec"), namespace)  # noqa: S102


@pytest.mark.parametrize("page", [p for p in PAGES if commands(p)], ids=name)
def test_commands_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for command in commands(page):
        assert main(shlex.split(command)[1:]) == 0, command


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    missing = [link for link in LINK.findall(page.read_text(encoding="utf-8")) if not (page.parent / link).exists()]
    assert not missing


def test_every_page_is_in_the_index() -> None:
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    missing = [p.name for p in PAGES[1:] if p.name != "index.md" and f"({p.relative_to(ROOT / 'docs')})" not in index]
    assert not missing
