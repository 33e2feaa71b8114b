r"""`load_response`: a measured sweep from a text file, as instruments and spreadsheets write it.

    # comments and blank lines anywhere
    frequency [Hz]; amplitude [mm]; phase [deg]        names with units: [..], (..), or on a line of their own below
    20,0;           0,412;          -12,5              one row per point, in the order recorded

The separator is the first of ; tab , blank that the header contains; decimal commas are understood wherever the comma
is not the separator. Everything is converted to SI units (results/measured_units.py). The swept parameter is the column
called frequency (f, freq), or the first one; a frequency in rad/s becomes one in Hz.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import FileFormatError, InputError, check_names
from .measured import MeasuredResponse
from .measured_units import si_unit

__all__ = ["load_response"]

_COMMENTS = ("#", "%", "//", "!")
_FREQUENCIES = ("frequency", "f", "freq", "excitation_frequency", "forcing_frequency", "drive_frequency")
_MEASURES = ("amplitude", "phase", "max", "min", "pp", "maximum", "minimum")
_EXAMPLE = "frequency [Hz], amplitude [mm], phase [deg]"


class _Line(NamedTuple):
    number: int
    text: str


def load_response(
    file: Any, *, parameter: str | None = None, names: Mapping[str, str] | None = None
) -> MeasuredResponse:
    """Read a measured sweep from a text file with named columns and units.

    Parameters
    ----------
    file : path
        Comma-, semicolon-, tab- or blank-separated text, for example ``frequency [Hz], amplitude [mm], phase [deg]``.
        Comments begin with # or %; decimal commas are understood where the comma does not separate.
    parameter : str, optional
        The swept column; by default the one called frequency (f, freq), else the first.
    names : mapping of a name in the file to the library's name, optional
        ``names={"sensor 1": "y.amplitude"}``; names are otherwise taken as they are, with ``_`` for blanks.

    Returns
    -------
    MeasuredResponse
        In SI units, in the order recorded.

    Raises
    ------
    FileFormatError
        No header, a field that is no number, a row of another length, a unit that is not known: with line and column.
    UnknownNameError
        `parameter` or a name of `names` that the file does not have.

    Examples
    --------
    >>> import tempfile, pathlib, stability as st
    >>> path = pathlib.Path(tempfile.mkdtemp(), "sweep.csv")
    >>> _ = path.write_text("f [Hz]; amplitude [mm]; phase [deg]\\n20,0; 0,41; -12\\n20,5; 0,47; -15\\n")
    >>> st.load_response(path).columns["amplitude"]
    array([0.00041, 0.00047])
    """
    path = Path(file)
    lines, comments = _lines(path)
    header, rows = _header(path, lines, comments)
    separator = _separator(header.text)
    titles, units = _titles(path, header, separator)
    if rows and not units_known(units) and _units_line(rows[0], separator, len(titles)):
        units = [_bare(cell) for cell in _cells(rows[0].text, separator)]
        rows = rows[1:]
    if not rows:
        raise FileFormatError(f"{path.name} has a header, but no rows of numbers")
    values = _numbers(path, rows, titles, separator)
    factors, si = [], []
    for k, unit in enumerate(units):
        try:
            factor, name = si_unit(unit or "")
        except InputError as error:
            place = f"{path.name}, line {header.number}, column {k + 1} ('{titles[k]}')"
            raise FileFormatError(f"{place}: {error}") from None
        factors.append(factor)
        si.append(name)
    final = _names(titles, dict(names or {}), path)
    swept = _swept(final, parameter, path)
    for k, name in enumerate(final):
        if name == "frequency" and si[k] == "rad/s":
            factors[k], si[k] = factors[k] / (2 * math.pi), "Hz"
    table = values * np.array(factors)
    columns = {name: table[:, k] for k, name in enumerate(final) if k != swept}
    return MeasuredResponse(final[swept], table[:, swept], columns, dict(zip(final, si)), path.name)


def _lines(path: Path) -> tuple[list[_Line], list[_Line]]:
    """(lines with content, comments before the first of them)."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise FileFormatError(f"{path} cannot be read: {error.strerror or error}") from error
    if b"\0" in raw[:4096]:
        raise FileFormatError(f"{path.name} is not a text file; a response begins with '{_EXAMPLE}' and has rows below")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    lines, comments = [], []
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if not stripped:
            continue
        mark = next((m for m in _COMMENTS if stripped.startswith(m)), None)
        if mark is None:
            lines.append(_Line(number, stripped))
        elif not lines:
            comments.append(_Line(number, stripped.lstrip("".join(_COMMENTS)).strip()))
    return lines, comments


def _header(path: Path, lines: list[_Line], comments: list[_Line]) -> tuple[_Line, list[_Line]]:
    if not lines:
        raise FileFormatError(f"{path.name} is empty; it needs a line of names and units, '{_EXAMPLE}', and rows")
    first = lines[0]
    if not _is_row(first.text):
        return first, lines[1:]
    if comments and not _is_row(comments[-1].text):  # the names stand in a comment, as numpy.savetxt writes them
        above, separator = comments[-1], _separator(comments[-1].text)
        if len(_cells(above.text, separator)) == len(_cells(first.text, _separator(first.text))) > 1:
            return above, lines
    raise FileFormatError(
        f"{path.name}, line {first.number}: no line of names; write one above the numbers, such as '{_EXAMPLE}'"
    )


def _is_row(text: str) -> bool:
    return all(_number(cell) is not None for cell in re.split(r"[;,\t\s]+", text.strip(" ;,\t")))


def _separator(text: str) -> str:
    bare = re.sub(r"\[[^\]]*\]|\([^)]*\)", "", text)
    return next((s for s in (";", "\t", ",") if s in bare), " ")


def _cells(text: str, separator: str) -> list[str]:
    if separator == " ":
        return re.findall(r"[^\s\[(]+(?:\s*(?:\[[^\]]*\]|\([^)]*\)))?|\[[^\]]*\]|\([^)]*\)", text)
    cells = [cell.strip().strip('"').strip() for cell in text.split(separator)]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _bare(cell: str) -> str:
    return cell.strip().strip("[]()").strip()


def _titles(path: Path, header: _Line, separator: str) -> tuple[list[str], list[str | None]]:
    titles: list[str] = []
    units: list[str | None] = []
    for k, cell in enumerate(_cells(header.text, separator)):
        found = re.fullmatch(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)\d][^)]*)\)|\s/\s*(\S+))?", cell)
        title = found[1].strip() if found else cell
        if not title:
            raise FileFormatError(f"{path.name}, line {header.number}, column {k + 1}: the column has no name")
        if title in titles:
            raise FileFormatError(f"{path.name}, line {header.number}, column {k + 1}: '{title}' is there twice")
        titles.append(title)
        units.append(next((u for u in found.groups()[1:] if u is not None), None) if found else None)
    if len(titles) < 2:
        raise FileFormatError(f"{path.name}, line {header.number}: one column only; separate them by ; , or tabs")
    return titles, units


def units_known(units: list[str | None]) -> bool:
    """Whether any column has its unit in the header."""
    return any(unit is not None for unit in units)


def _units_line(line: _Line, separator: str, count: int) -> bool:
    """Whether a line holds units only."""
    cells = _cells(line.text, separator)
    if len(cells) != count or all(_number(cell) is not None for cell in cells):
        return False
    try:
        for cell in cells:
            si_unit(_bare(cell))
    except InputError:
        return False
    return True


def _numbers(path: Path, rows: list[_Line], titles: list[str], separator: str) -> np.ndarray:
    values = np.empty((len(rows), len(titles)))
    for i, row in enumerate(rows):
        cells = row.text.split() if separator == " " else _cells(row.text, separator)
        if len(cells) != len(titles):
            hint = ""
            if separator == "," and len(cells) == 2 * len(titles):
                hint = "; with decimal commas, separate the columns by ; or tabs"
            raise FileFormatError(
                f"{path.name}, line {row.number}: {len(cells)} columns, but the header names {len(titles)}{hint}"
            )
        for k, cell in enumerate(cells):
            value = _number(cell, separator != ",")
            if value is None:
                said = f"'{cell}' is not a finite number" if cell else "nothing there"
                raise FileFormatError(f"{path.name}, line {row.number}, column {k + 1} ('{titles[k]}'): {said}")
            values[i, k] = value
    return values


def _number(text: str, comma: bool = True) -> float | None:
    """A finite decimal number, with a decimal comma where allowed; None for anything else."""
    plain = text.strip()
    if comma and plain.count(",") == 1 and "." not in plain:
        plain = plain.replace(",", ".")
    if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", plain):
        return None
    value = float(plain)
    return value if math.isfinite(value) else None


def _names(titles: list[str], wanted: dict[str, str], path: Path) -> list[str]:
    check_names("column", wanted, titles, path.name)
    final = [wanted.get(title, re.sub(r"\s+", "_", title)) for title in titles]
    lowered = [name.lower() if name.lower() in _FREQUENCIES else name for name in final]
    final = ["frequency" if name in _FREQUENCIES and "frequency" not in final else name for name in lowered]
    final = [name.lower() if name.lower() in _MEASURES else name for name in final]
    if len(set(final)) < len(final):
        raise FileFormatError(f"{path.name}: two columns would be called alike: {', '.join(final)}")
    return final


def _swept(names: list[str], parameter: str | None, path: Path) -> int:
    if parameter is not None:
        check_names("column", [parameter], names, path.name)
        return names.index(parameter)
    return names.index("frequency") if "frequency" in names else 0
