"""Pages that list things list all of them: models against the catalogue, errata against their tests, figures against
their scripts. (That their Python blocks run and their links exist is checked in tests/test_documents.py.)
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import stability as st

ROOT = Path(__file__).resolve().parents[2]


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def row(model) -> str:
    """The model's line in docs/models.md."""
    constructors = ", ".join(f"`{name}`" for name in model.constructors) or "-"
    equation = model.equation.replace("|", r"\|")
    return f"| `{model.name}` | {equation} | {constructors} | {model.source} | {model.figure or '-'} |"


@pytest.mark.parametrize("name", st.models.catalogue())
def test_model_has_its_line(name):
    model = st.models.catalogue()[name]
    lines = page("models.md").splitlines()
    assert row(model) in lines
    heading = f"## {model.group[0].upper()}{model.group[1:]}"
    assert max(i for i, x in enumerate(lines[: lines.index(row(model))]) if x.startswith("## ")) == lines.index(heading)


def test_no_line_without_a_model():
    listed = re.findall(r"^\| `(\w+)` \|", page("models.md"), re.MULTILINE)
    assert sorted(listed) == sorted(st.models.catalogue())


def names_in(pattern: str) -> set[str]:
    files = (ROOT / "tests" / "acceptance").glob(pattern)
    return {t for f in files for t in re.findall(r"^def (test_\w+)", f.read_text(encoding="utf-8"), re.MULTILINE)}


def test_every_erratum_names_a_test_that_exists_and_every_test_is_named():
    named = set(re.findall(r"`(test_\w+)`", page("errata.md")))
    existing = names_in("test_errata*.py")
    assert named - existing == set()
    assert existing - named == set()


def test_every_row_of_the_errata_has_a_test():
    rows = [x for x in page("errata.md").splitlines() if x.startswith("| ") and not x.startswith("| where")]
    assert len(rows) > 40 and all("`test_" in x for x in rows)


def test_figures_that_are_called_drawn_have_a_script_and_all_scripts_are_listed():
    text = page("figures.md")
    rows = [x for x in text.splitlines() if x.startswith("| ") and not x.startswith("| figure")]
    for line in rows:
        assert ("](../figures/" in line) == ("drawn" in line and "| -" not in line), line
    scripts = {p.name for p in (ROOT / "figures").glob("*.py") if re.match(r"fig|table", p.name)}
    assert scripts - set(re.findall(r"\(\.\./figures/(\w+\.py)\)", text)) == set()


@pytest.mark.parametrize("figure", [*(str(k) for k in range(1, 14)), "A1", "A2", "A3", "table 1", "table 2"])
def test_every_figure_of_the_chapter_has_a_row(figure):
    assert re.search(rf"^\| {figure}[ ,|]", page("figures.md"), re.MULTILINE)


def test_every_spring_is_on_its_page():
    text = page("springs-and-magnets.md")
    springs = [name for name in dir(st.models) if name.endswith("Spring") and name not in ("Spring",)]
    assert len(springs) >= 9 and [name for name in springs if name not in text] == []
