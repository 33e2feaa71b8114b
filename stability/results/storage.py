r"""Results on disk: one ``.npz`` with a JSON header, nothing that could run code.

A file holds the arrays of a result and one more, ``__header__``: the UTF-8 bytes of a JSON object
``{"schema": name, "version": 1, "header": {...}}`` as uint8. Reading never unpickles (``allow_pickle=False``). Writing
goes to a temporary file in the same directory which then replaces the target (`os.replace`), so that a reader sees the
old file or the new one, never half of one.

A result class registers its schema by the name of the module that defines it, so that `load` imports only what the file
needs: no solver is imported to plot a stored branch.
"""

from __future__ import annotations

import csv
import json
import os
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import FileFormatError, InputError

__all__ = ["class_of", "load", "read", "register", "schema_of", "write", "write_columns"]

_VERSION = 1
_HEADER = "__header__"
_NOT_OURS = "not a stored result of this library"
_CLASSES: dict[str, type] = {}
# schema -> module below `stability` that registers it, imported on demand
_HOMES = {
    "branch": "results.branch",
    "special-point": "results.special",
    "fixed-point": "results.solutions",
    "periodic-orbit": "results.solutions",
    "stability-chart": "results.chart",
    "trajectory": "results.trajectory",
    "sweep": "results.sweep",
    "measured-response": "results.measured",
    "basins": "results.basins",
    "difference": "results.comparison",
    "responses": "results.responses",
}
T = TypeVar("T", bound=type)


def register(schema: str) -> Callable[[T], T]:
    """Class decorator: files of this schema are read by ``cls.from_storage(header, arrays)``."""

    def decorate(cls: T) -> T:
        _CLASSES[schema] = cls
        return cls

    return decorate


def class_of(schema: str) -> Any:
    """The class that reads a schema; its module is imported on demand."""
    if schema not in _CLASSES and schema in _HOMES:
        import_module(f"stability.{_HOMES[schema]}")
    if schema not in _CLASSES:
        raise FileFormatError(f"it holds a '{schema}', which this version does not know")
    return _CLASSES[schema]


def schema_of(result: Any) -> str:
    """The schema of a result's class."""
    return next(schema for schema, cls in _CLASSES.items() if cls is type(result))


def _plain(value: Any) -> Any:
    """What `json` cannot write by itself: numpy scalars and arrays, mappings, paths."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, (set, frozenset, tuple)):
        return list(value)
    raise InputError(f"a {type(value).__name__} cannot be stored: results hold numbers, text, lists and mappings")


def write(
    path: str | os.PathLike[str], schema: str, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write header and arrays to `path`, atomically (``.npz`` is appended if the name has no suffix).

    Raises
    ------
    InputError
        An array of objects, or a header value that is not plain data.
    FileNotFoundError
        The folder does not exist.

    Examples
    --------
    >>> import os, tempfile, numpy as np
    >>> path = os.path.join(tempfile.mkdtemp(), "x.npz")
    >>> write(path, "note", {"text": "u"}, {"a": np.arange(3.0)})
    >>> read(path)[0], read(path)[2]["a"].tolist()
    ('note', [0.0, 1.0, 2.0])
    """
    target = Path(path)
    if not target.suffix:
        target = target.with_suffix(".npz")
    for name, array in arrays.items():
        if np.asarray(array).dtype.hasobject:
            raise InputError(f"array '{name}' holds Python objects; only numbers and fixed-width text are stored")
    outer = {"schema": schema, "version": _VERSION, "header": dict(header)}
    text = json.dumps(outer, default=_plain, ensure_ascii=False)
    content = {name: np.asarray(a) for name, a in arrays.items()}
    content[_HEADER] = np.frombuffer(text.encode(), dtype=np.uint8)
    if not target.parent.is_dir():
        raise FileNotFoundError(f"'{os.fspath(path)}' cannot be written: there is no folder '{target.parent}'")
    handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".tmp", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            np.savez(stream, **content)  # type: ignore[arg-type]
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def write_columns(path: str | os.PathLike[str], columns: Mapping[str, NDArray[Any]]) -> None:
    """Columns of equal length as comma-separated text with a header line."""
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*(a.tolist() for a in columns.values())))


def read(path: str | os.PathLike[str]) -> tuple[str, dict[str, Any], dict[str, NDArray[Any]]]:
    """Schema, header and arrays of a file that `write` made.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileFormatError
        Not a ``.npz`` of this library, damaged, or of a newer version.
    """
    name = os.fspath(path)
    with open(path, "rb") as stream:  # no such file, no permission, a folder: in the system's own words
        if not zipfile.is_zipfile(stream):
            raise FileFormatError(f"'{name}' is {_NOT_OURS}: it is no .npz file")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as trouble:
        raise FileFormatError(f"'{name}' is {_NOT_OURS}, or is damaged: its arrays cannot be read") from trouble
    if _HEADER not in arrays:
        held = ", ".join(arrays) or "none"
        raise FileFormatError(f"'{name}' is {_NOT_OURS}: it has no header; its arrays are {held}")
    try:
        outer = json.loads(bytes(arrays.pop(_HEADER)).decode())
        schema, version, header = outer["schema"], outer["version"], outer["header"]
    except (ValueError, KeyError, TypeError, AttributeError) as trouble:
        raise FileFormatError(f"'{name}' is {_NOT_OURS}, or is damaged: its header cannot be read") from trouble
    if not isinstance(version, int) or version > _VERSION:
        raise FileFormatError(f"'{os.fspath(path)}' has format version {version}; this library reads up to {_VERSION}")
    if not isinstance(header, dict) or not isinstance(schema, str):
        raise FileFormatError(f"'{os.fspath(path)}' has a damaged header")
    return schema, header, arrays


def load(path: str | os.PathLike[str]) -> Any:
    """Read a stored result (Branch, SpecialPoint, StabilityChart, ...); no solver is imported, so plotting is cheap.

    Parameters
    ----------
    path : str or path
        An ``.npz`` file that the result's ``save`` wrote.

    Returns
    -------
    The result, of its own class.

    Raises
    ------
    FileNotFoundError, FileFormatError
        No such file; not a stored result, damaged, or of a kind this version does not know.

    Examples
    --------
    >>> import stability as st
    >>> tongues = st.chart(st.models.mathieu(), x=("a", 0.1, 0.4), y=("b", 0, 0.2), shape=(20, 10))
    >>> tongues.save("tongues.npz")
    >>> st.load("tongues.npz").growth_rate.shape
    (10, 20)
    """
    schema, header, arrays = read(path)
    try:
        return class_of(schema).from_storage(header, arrays)
    except FileFormatError as trouble:
        raise FileFormatError(f"'{os.fspath(path)}': {trouble}") from trouble
    except (KeyError, TypeError, IndexError, ValueError) as trouble:
        raise FileFormatError(f"'{os.fspath(path)}' is damaged: {type(trouble).__name__}: {trouble}") from trouble
