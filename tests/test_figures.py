"""Every script of figures/ computes, passes its own checks of the numbers, and draws; warnings are errors.

A script has ``compute() -> dict``, ``check(data)``, ``draw(data, path)`` and ``main(folder) -> list of files``.
"""

from __future__ import annotations

import importlib.util
import sys
import warnings
from pathlib import Path

import pytest

FIGURES = Path(__file__).resolve().parents[1] / "figures"
SCRIPTS = sorted(path for path in FIGURES.glob("*.py") if not path.name.startswith("_"))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_figure(script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(FIGURES))
    specification = importlib.util.spec_from_file_location(f"figure_{script.stem}", script)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    monkeypatch.setitem(sys.modules, specification.name, module)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=DeprecationWarning, module=r"(?!stability)")  # between others
        specification.loader.exec_module(module)
        for part in ("compute", "check", "draw", "main"):
            assert callable(getattr(module, part, None)), f"{script.name} has no {part}()"
        written = module.main(tmp_path)
    assert written, "main() gives the files that it wrote"
    for path in written:
        assert Path(path).parent == tmp_path and Path(path).stat().st_size > 1000
