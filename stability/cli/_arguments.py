"""The small grammar of the command line: ``name:lo:hi``, ``1000x1000``, ``name=value``, and files that are written.

Each piece is read before any work starts; a mistake names the piece, what was received and an example.
"""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import click

__all__ = ["INTERVAL", "SETTING", "SHAPE", "SPAN", "check_outputs", "replacing", "settings"]


class _Span(click.ParamType):
    """``name:lo:hi`` -> (name, lo, hi)."""

    name = "name:lo:hi"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float, float]:
        if isinstance(value, tuple):
            return value
        parts = value.split(":")
        if len(parts) != 3 or not parts[0]:
            self.fail(f"'{value}' is not name:lo:hi, for example a:-0.5:2.5", param, ctx)
        low, high = (_number(part) for part in parts[1:])
        if low is None or high is None:
            self.fail(f"'{value}': lo and hi must be finite numbers, for example {parts[0]}:0:2", param, ctx)
        if low >= high:
            self.fail(f"'{value}': lo must be less than hi", param, ctx)
        return parts[0], low, high


class _Shape(click.ParamType):
    """``1000x1000`` -> (1000, 1000): points along x, points along y."""

    name = "NXxNY"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        parts = value.lower().split("x")
        if len(parts) != 2 or not all(part.isascii() and part.isdigit() for part in parts):
            self.fail(f"'{value}' is not NXxNY, for example 1000x1000", param, ctx)
        nx, ny = int(parts[0][:12]), int(parts[1][:12])
        if min(nx, ny) < 2:
            self.fail(f"'{value}': at least 2 points along each axis", param, ctx)
        return nx, ny


class _Setting(click.ParamType):
    """``name=value`` -> (name, number, or a word for an option of a model: true, false, relative)."""

    name = "name=value"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, Any]:
        if isinstance(value, tuple):
            return value
        name, equals, text = value.partition("=")
        name, text = name.strip(), text.strip()
        if not (name and equals and text):
            self.fail(f"'{value}' is not name=value, for example delta=0.05", param, ctx)
        number = _number(text)
        if number is not None:
            return name, number
        words = {"true": True, "yes": True, "false": False, "no": False}
        if text.lower() in words:
            return name, words[text.lower()]
        if not text.isidentifier() or text.lower() in ("nan", "inf", "infinity"):
            self.fail(f"'{value}': the value of {name} must be a finite number, true, false or a word", param, ctx)
        return name, text


class _Interval(click.ParamType):
    """``from:to`` -> (from, to), in this order: a branch may be followed downward."""

    name = "from:to"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        if isinstance(value, tuple):
            return value
        numbers = [_number(part) for part in value.split(":")]
        if len(numbers) != 2 or numbers[0] is None or numbers[1] is None:
            self.fail(f"'{value}' is not from:to in finite numbers, for example 0.3:3", param, ctx)
        if numbers[0] == numbers[1]:
            self.fail(f"'{value}': from and to must differ", param, ctx)
        return numbers[0], numbers[1]


SPAN, SHAPE, SETTING, INTERVAL = _Span(), _Shape(), _Setting(), _Interval()


def settings(pairs: Sequence[tuple[str, Any]], option: str = "--set") -> dict[str, Any]:
    """The settings by name; one name given twice is a mistake, not a silent choice."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise click.BadParameter(f"{name} is set twice", param_hint=f"'{option}'")
        found[name] = value
    return found


def check_outputs(paths: Sequence[Path], formats: Sequence[str], force: bool) -> None:
    """Refuse, before any work, a format that is not written, a missing folder, and a file that exists already."""
    for path in paths:
        if path.suffix.lower() not in formats:
            raise click.BadParameter(f"{path}: the ending must be one of {' '.join(formats)}")
        if not path.parent.is_dir():
            raise click.BadParameter(f"{path}: there is no folder {path.parent}")
        if path.is_dir():
            raise click.BadParameter(f"{path} is a folder")
        if path.exists() and not force:
            raise click.BadParameter(f"{path} exists; choose another name or use --force")


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its name when the block ends well, and goes away when it does not."""
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in text else None
