"""Files that are no results of this library, or damaged ones, and places that cannot be written: in our own words."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import stability as st
from stability.errors import FileFormatError
from stability.results.storage import read, write


def header(**content: object) -> np.ndarray:
    return np.frombuffer(json.dumps(content).encode(), np.uint8)


def damaged(path: Path) -> None:
    write(path, "note", {}, {"a": np.arange(1000.0)})
    content = bytearray(path.read_bytes())
    content[200:1200] = bytes(1000)
    path.write_bytes(content)


FILES = {
    "text": (lambda path: path.write_text("Omega,verdict\n1,stable\n"), r"it is no \.npz file"),
    "empty": (lambda path: path.write_bytes(b""), r"it is no \.npz file"),
    "pickle": (lambda path: path.write_bytes(b"\x80\x04K\x01."), r"it is no \.npz file"),
    "one array": (lambda path: path.write_bytes(np.lib.format.MAGIC_PREFIX + b"\x01\x00"), r"it is no \.npz file"),
    "cut": (lambda path: (damaged(path), path.write_bytes(path.read_bytes()[:900])), r"it is no \.npz file"),
    "zeros inside": (damaged, "its arrays cannot be read"),
    "objects": (lambda path: _saved(path, a=np.array([{}], object)), "its arrays cannot be read"),
    "no header": (lambda path: _saved(path, a=np.zeros(2)), "no header; its arrays are a"),
    "no JSON": (lambda path: _saved(path, __header__=np.zeros(3, np.uint8)), "its header cannot be read"),
    "no schema": (lambda path: _saved(path, __header__=header(version=1)), "its header cannot be read"),
    "newer": (lambda path: _saved(path, __header__=header(schema="a", version=99, header={})), "format version 99"),
}


def _saved(path: Path, **arrays: np.ndarray) -> None:
    with open(path, "wb") as stream:
        np.savez(stream, **arrays)


@pytest.mark.parametrize("case", FILES)
def test_files_that_are_no_results(case: str, tmp_path: Path) -> None:
    """The sentence is ours: NumPy's advice to unpickle is never passed on."""
    make, match = FILES[case]
    path = tmp_path / "b.csv"
    make(path)
    with pytest.raises(FileFormatError, match=match) as caught:
        st.load(path)
    assert str(path) in str(caught.value) and "pickle" not in str(caught.value)


def test_places_that_are_not_there(tmp_path: Path) -> None:
    branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 16), start=dict(x=6, y=6, z=14))
    path = tmp_path / "nowhere" / "x.npz"
    with pytest.raises(FileNotFoundError, match=r"nowhere/x\.npz' cannot be written: there is no folder"):
        branch.save(path)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        st.load(path)
    with pytest.raises(IsADirectoryError):
        st.load(tmp_path)


def test_what_was_written_is_read(tmp_path: Path) -> None:
    write(tmp_path / "x", "note", {"text": "u"}, {"a": np.arange(3.0)})
    schema, told, arrays = read(tmp_path / "x.npz")
    assert (schema, told) == ("note", {"text": "u"}) and arrays["a"].tolist() == [0.0, 1.0, 2.0]
