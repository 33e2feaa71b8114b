"""Tests that read signatures and docstrings, and run every example of the package.

Witness: the docstrings themselves. No keyword is swallowed, no parameter undocumented, no public callable without an
example, and each example gives what it shows.
"""

from __future__ import annotations

import dataclasses
import doctest
import importlib
import inspect
import pkgutil
import re
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import stability
from stability import models
from stability.errors import StabilityError

PACKAGE = Path(stability.__file__ or "").parent
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
MODULES = sorted(
    info.name for info in pkgutil.walk_packages([str(PACKAGE)], "stability.") if not info.name.endswith("__main__")
)


def public() -> dict[str, Any]:
    """Public objects by name: the exports of the package and of the catalogue."""
    found = {name: getattr(stability, name) for name in stability._EXPORTS}
    found.update({f"models.{name}": getattr(models, name) for name in models.__all__})
    for name, entry in models.catalogue().items():
        found.update({f"models.{name}.{c}": f for c, f in entry.constructors.items()})
    return found


PUBLIC = {name: thing for name, thing in public().items() if callable(thing)}
# enumerations and exceptions are words: they are documented, an example would show nothing
VERBS = [
    name
    for name, thing in PUBLIC.items()
    if not (inspect.isclass(thing) and issubclass(thing, (str, BaseException)))
]


def made_by_the_library(thing: Any) -> bool:
    """Results have Attributes and no Parameters: the verb that makes them shows how."""
    text = inspect.getdoc(thing) or ""
    return inspect.isclass(thing) and "\nAttributes\n---" in text and "\nParameters\n---" not in text


def documented_parameters(docstring: str) -> set[str]:
    """Names in the numpydoc sections Parameters and Attributes: ``a, b : float`` gives a and b."""
    lines = inspect.cleandoc(docstring).splitlines()
    names: set[str] = set()
    inside = False
    for line, following in zip(lines, [*lines[1:], ""]):
        if re.fullmatch(r"-{3,}", following.strip()) and line.strip():
            inside = line.strip() in ("Parameters", "Other Parameters", "Attributes")
        elif inside and line and not line.startswith((" ", "---")):
            names.update(name.strip().lstrip("*") for name in line.split(" : ")[0].split(","))
    return names


@pytest.mark.parametrize("name", PUBLIC)
def test_docstring(name: str) -> None:
    text = inspect.getdoc(PUBLIC[name]) or ""
    assert len(text.splitlines()[0] if text else "") > 10, "a docstring opens with one sentence"


@pytest.mark.parametrize("name", [n for n in VERBS if n.count(".") < 2 and not made_by_the_library(PUBLIC[n])])
def test_example(name: str) -> None:
    assert ">>>" in (inspect.getdoc(PUBLIC[name]) or ""), "a public callable shows how it is called"


@pytest.mark.parametrize("name", [n for n in VERBS if not made_by_the_library(PUBLIC[n])])
def test_every_parameter_is_documented(name: str) -> None:
    thing = PUBLIC[name]
    text = inspect.getdoc(thing) or ""
    given = [p for p in inspect.signature(thing).parameters.values() if p.name not in ("self", "cls")]
    inner = {f.name for f in dataclasses.fields(thing) if not f.repr} if dataclasses.is_dataclass(thing) else set()
    missing = {p.name for p in given if not p.name.startswith("_")} - inner - documented_parameters(text)
    assert not missing, f"not in the section Parameters: {sorted(missing)}"


def test_documented_parameters_reads_numpydoc() -> None:
    text = "One.\n\nParameters\n----------\na, b : float\n    Two.\n*rest : str\nReturns\n-------\nc : int\n"
    assert documented_parameters(text) == {"a", "b", "rest"}


# how to call the public functions that take ** keywords; a new one has to be added here
OPEN: dict[str, Callable[[Any], Any]] = {
    "basins": lambda f: f(models.duffing(), x=("u", -1, 1), y=("u_dot", -1, 1), no_such_keyword=1.0),
    "chart": lambda f: f(models.mathieu(), x=("a", 0, 1), y=("b", 0, 1), no_such_keyword=1.0),
    "families": lambda f: f(stability.Collocation(models.duffing()), "Omega", (0.5, 0.6), no_such_keyword=1.0),
    "linear_response": lambda f: f(models.linear_oscillator(), no_such_keyword=1.0),
    "loci": lambda f: f(
        stability.Collocation(models.duffing()), "Omega", (0.5, 0.6), free="beta", free_window=(0.0, 1.0), cuts=1,
        no_such_keyword=1.0,
    ),
    "lyapunov": lambda f: f(models.duffing(), 10.0, no_such_keyword=1.0),
    "monodromy": lambda f: f(models.mathieu(), no_such_keyword=1.0),
    "reconstruct": lambda f: f(stability.averaging(models.duffing()), [1.0, 0.0], 0.0, no_such_keyword=1.0),
    "reconstruction_residual": lambda f: f(
        models.duffing(), stability.averaging(models.duffing()), [1.0, 0.0], no_such_keyword=1.0
    ),
    "sensitivity": lambda f: f(stability.Collocation(models.duffing()), "u.max", no_such_keyword=1.0),
    "simulate": lambda f: f(models.mathieu(), (0.0, 1.0), no_such_keyword=1.0),
    "solve": lambda f: f(stability.Collocation(models.duffing()), no_such_keyword=1.0),
    "sweep": lambda f: f(models.duffing(), "Omega", (0.5, 0.6), no_such_keyword=1.0),
}


def takes_anything(thing: Any) -> bool:
    if isinstance(thing, models._model.Model) or inspect.isclass(thing):
        return False
    return any(p.kind is p.VAR_KEYWORD for p in inspect.signature(thing).parameters.values())


@pytest.mark.parametrize("name", [n for n in VERBS if "." not in n and takes_anything(PUBLIC[n])])
def test_no_keyword_is_swallowed(name: str) -> None:
    assert name in OPEN, "add a call with an unknown keyword to OPEN"
    with pytest.raises((StabilityError, TypeError), match="no_such_keyword"):
        OPEN[name](PUBLIC[name])


@pytest.mark.parametrize("name", models.catalogue())
def test_models_refuse_unknown_parameters(name: str) -> None:
    with pytest.raises((StabilityError, TypeError), match="no_such_keyword"):
        models.catalogue()[name](no_such_keyword=1.0)


def run(tests: list[doctest.DocTest]) -> None:
    """Run examples; what fails is shown as doctest shows it."""
    report: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS)
    for test in tests:
        runner.run(test, out=report.append)
    assert runner.failures == 0, "".join(report)


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of its own for examples that write files."""
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=DeprecationWarning, module=r"(?!stability)")  # between others
        yield tmp_path


@pytest.mark.parametrize("module", MODULES)
@pytest.mark.usefixtures("elsewhere")
def test_examples_of_module(module: str) -> None:
    run(doctest.DocTestFinder().find(importlib.import_module(module)))


@pytest.mark.parametrize("name", models.catalogue())
@pytest.mark.usefixtures("elsewhere")
def test_examples_of_model(name: str) -> None:
    """Models are objects, which doctest does not look into by itself."""
    entry = models.catalogue()[name]
    sources = {name: entry.__doc__, **{f"{name}.{c}": f.__doc__ for c, f in entry.constructors.items()}}
    parser = doctest.DocTestParser()
    run([parser.get_doctest(text or "", {}, label, None, 0) for label, text in sources.items()])
