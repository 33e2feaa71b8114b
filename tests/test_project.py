"""The house rules that a machine can check: floors, lazy import, names, sizes."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import stability

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "stability"
HEAVY = ("scipy", "sympy", "numba", "llvmlite", "matplotlib", "xarray", "pandas", "rich")


def modules_after(code: str) -> set[str]:
    """Top-level names in sys.modules after `code` ran in a fresh interpreter."""
    listing = "sorted({name.split('.')[0] for name in sys.modules})"
    program = f"import json, sys\n{code}\nsys.stdout.write('\\n' + json.dumps({listing}))"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True)
    return set(json.loads(run.stdout.splitlines()[-1]))


def test_imports_point_down_only() -> None:
    """The import contract of pyproject.toml, by import-linter."""
    program = "import sys; from importlinter.cli import lint_imports_command as c; sys.exit(c())"
    run = subprocess.run(
        [sys.executable, "-c", program, "--no-cache"],
        cwd=ROOT, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"},
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr


def test_import_loads_nothing_heavy() -> None:
    """`import stability` costs next to nothing (PEP 562)."""
    assert modules_after("import stability").isdisjoint({*HEAVY, "numpy", "click"})


def test_words_and_errors_load_nothing_heavy() -> None:
    assert modules_after("import stability; stability.Kind.FOLD; stability.errors.InputError").isdisjoint(HEAVY)


def test_results_load_without_solvers_or_sympy() -> None:
    """A saved branch can be loaded by a program that has no need of a solver."""
    assert modules_after("import stability.results.storage").isdisjoint({"scipy", "sympy", "numba", "matplotlib"})


@pytest.mark.parametrize("name", stability.__all__)
def test_every_public_name_resolves(name: str) -> None:
    assert getattr(stability, name) is not None
    assert name in dir(stability)


def test_unknown_attribute_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_thing"):
        stability.no_such_thing  # noqa: B018


def packages() -> list[str]:
    found = [info.name for info in pkgutil.walk_packages([str(PACKAGE)], "stability.") if info.ispkg]
    return ["stability", *found]


@pytest.mark.parametrize("package", packages())
def test_no_public_callable_is_named_like_a_sibling_module(package: str) -> None:
    """Importing a submodule binds its name in the package, and overwrites a function of the same name."""
    module = importlib.import_module(package)
    siblings = {info.name for info in pkgutil.iter_modules(module.__path__)}
    public = [name for name in getattr(module, "__all__", ()) if name in siblings]
    clashes = [name for name in public if not inspect.ismodule(getattr(module, name))]
    assert not clashes, f"{package}: {clashes} are both functions and modules"


def test_functions_survive_the_import_of_every_module() -> None:
    """The same promise, by doing it: after everything is imported the public names are what they were."""
    for info in pkgutil.walk_packages([str(PACKAGE)], "stability."):
        if not info.name.endswith("__main__"):
            importlib.import_module(info.name)
    for name, home in stability._EXPORTS.items():
        assert getattr(stability, name) is getattr(importlib.import_module(f"stability.{home}"), name), name


SOURCES = sorted(PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_file_is_one_idea(path: Path) -> None:
    """At most 450 lines a file and 70 a function (its docstring not counted); every file opens with a docstring."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    assert ast.get_docstring(tree), "a file opens with what it is"
    assert text.count("\n") <= 450, "more than one idea: split the file"
    functions = [node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
    long = [f"{node.name} ({length(node)} lines)" for node in functions if length(node) > 70]
    assert not long, f"longer than 70 lines: {long}"


def length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring."""
    first = function.body[0]
    docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return lines(function) - (lines(first) if docstring else 0)


def lines(node: ast.stmt) -> int:
    return (node.end_lineno or node.lineno) - node.lineno + 1


def test_version_is_the_changelogs_first_entry() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    first = next(line for line in text.splitlines() if line.startswith("## "))
    assert stability.__version__ in first


def test_citation_names_this_version() -> None:
    assert f"version: {stability.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
