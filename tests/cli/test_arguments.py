"""The small grammar of the command line, and files that appear whole or never. Witness: the grammar's definition."""

from __future__ import annotations

import math
from pathlib import Path

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stability.cli._arguments import SETTING, SHAPE, SPAN, replacing, settings
from stability.cli._sketch import sketch

numbers = st.floats(allow_nan=False, allow_infinity=False)
names = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,12}", fullmatch=True)


@given(names, numbers, numbers)
def test_span_keeps_every_digit(name: str, a: float, b: float) -> None:
    low, high = min(a, b), max(a, b)
    if low < high:
        assert SPAN.convert(f"{name}:{low!r}:{high!r}", None, None) == (name, low, high)


@given(names, numbers)
def test_setting_keeps_every_digit(name: str, value: float) -> None:
    assert SETTING.convert(f"{name}={value!r}", None, None) == (name, value)


@pytest.mark.parametrize(("text", "value"), [("x=true", True), ("x=No", False), ("x=relative", "relative")])
def test_setting_takes_words(text: str, value: object) -> None:
    assert SETTING.convert(text, None, None) == ("x", value)


@given(st.text(max_size=30))
def test_nonsense_is_a_usage_error(text: str) -> None:
    """Any text is either read or refused with a sentence; a number that is read is finite."""
    for kind in (SPAN, SHAPE, SETTING):
        try:
            read = kind.convert(text, None, None)
        except click.UsageError as error:
            assert error.exit_code == 2 and error.message
        else:
            assert all(math.isfinite(v) for v in read if isinstance(v, float))


def test_shape() -> None:
    assert SHAPE.convert("20X10", None, None) == (20, 10)


def test_settings_refuse_a_name_twice() -> None:
    with pytest.raises(click.UsageError, match="set twice"):
        settings([("a", 1.0), ("a", 1.0)])


def test_replacing_is_all_or_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]
    with replacing(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new" and list(tmp_path.iterdir()) == [path]


def test_sketch_is_the_chart() -> None:
    """Blank exactly where no point of the cell grows; y upwards; NaN is blank."""
    import numpy as np

    growth = np.full((40, 80), -1.0)
    growth[30:, 60:] = 1.0
    growth[0, 0] = np.nan
    axis = {"parameter": "a", "from": 0.0, "to": 1.0}
    lines = [line.split("|")[1] for line in sketch(growth, axis, axis, columns=80).splitlines() if "|" in line]
    assert len(lines) == 20 and all(len(line) == 80 for line in lines)
    assert all(line == " " * 60 + "█" * 20 for line in lines[:5]) and all(line == " " * 80 for line in lines[5:])
