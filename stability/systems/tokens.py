"""The words of equation text: numbers, names (with primes for time derivatives), operators; nothing else.

    x'  -> x_dot        x'' -> x_ddot       (one and two primes; each token keeps its column in the text)

Checks, in this order, before anything is parsed: the text is a str of at most 4096 ASCII characters, each character
may occur in an expression, brackets balance and nest at most 60 deep, every piece is a known word, numbers fit double
precision (integers below 1e40). Each refusal points at the column and says what to write instead.
"""

from __future__ import annotations

import keyword
import math
import re
import unicodedata
from dataclasses import dataclass

from ..errors import ExpressionError
from .nodes import valid_name

__all__ = ["MAX_BRACKETS", "MAX_CHARACTERS", "Token", "refuse", "tokenise"]

MAX_CHARACTERS = 4096
MAX_BRACKETS = 60
_ALLOWED = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_+-*/(),.<>=!' ")
_PATTERN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)(?P<primes>'*)"
    r"|(?P<operator>\*\*|<=|>=|==|!=|//|[-+*/(),<>=])"
    r"|(?P<space> +)"
)
_HINTS = {
    "^": "write ** for powers",
    "%": "write mod(a, b)",
    "&": "write 'and' between conditions",
    "|": "write 'or' between conditions, abs(...) for the absolute value",
    "~": "write 'not' before a condition",
    "[": "write round brackets",
    "]": "write round brackets",
    "{": "write round brackets",
    "}": "write round brackets",
    '"': "write x'' with two single primes",
    ":": "slices, lambdas and assignments are not expressions",
    "\n": "an expression is one line",
    "\t": "use spaces",
    "\u2212": "write the minus sign -",
    "\u00d7": "write *",
    "\u00b7": "write *",
    "\u00b2": "write **2",
    "\u00b3": "write **3",
    "\u2032": "write x' with the single quote",
    "\u2019": "write x' with the single quote",
}


@dataclass(frozen=True)
class Token:
    """One word: its kind (number, name, operator, end), its text with primes resolved, its column, what was written."""

    kind: str
    text: str
    column: int
    written: str = ""


def refuse(message: str, text: str, column: int) -> ExpressionError:
    """The error with a caret; long texts are cut to a window around it, unprintable characters shown as '?'."""
    shown = "".join(c if " " <= c <= "~" else "?" for c in text)
    if len(shown) > 120:
        start = min(max(0, column - 60), max(0, len(shown) - 116))
        head = "..." if start else ""
        piece = shown[start : start + 114 - len(head)]
        tail = "..." if start + len(piece) < len(shown) else ""
        shown, column = head + piece + tail, column - start + len(head)
    return ExpressionError(message, shown, column)


def tokenise(text: str) -> list[Token]:
    """The words of `text`, closed by an ``end`` token; ExpressionError with a caret at the first thing that is none.

    >>> [token.text for token in tokenise("2*x'' + 1")]
    ['2', '*', 'x_ddot', '+', '1', '']
    """
    _check_characters(text)
    _check_brackets(text)
    tokens: list[Token] = []
    position = 0
    while position < len(text):
        match = _PATTERN.match(text, position)
        if match is None:
            raise refuse(_unknown_piece(text[position]), text, position)
        if match["number"]:
            tokens.append(_number(match, text))
        elif match["name"]:
            tokens.append(_name(match, text))
        elif match["operator"]:
            if match["operator"] == "//":
                raise refuse("'//' is not an operator here; write floor(a/b)", text, position)
            tokens.append(Token("operator", match["operator"], position, match["operator"]))
        position = match.end()
    tokens.append(Token("end", "", len(text.rstrip(" "))))
    return tokens


def _unknown_piece(character: str) -> str:
    if character == "'":
        return "a prime marks the time derivative of a name, as in x'"
    if character == "!":
        return "'!' is not an operator; write != or 'not'"
    return "a point stands only inside a number; attributes do not exist here"


def _check_characters(text: str) -> None:
    if not isinstance(text, str):
        raise ExpressionError(f"an expression is text, not {type(text).__name__}")
    if len(text) > MAX_CHARACTERS:
        raise ExpressionError(f"the expression has {len(text)} characters; at most {MAX_CHARACTERS} are read")
    for column, character in enumerate(text):
        if character in _ALLOWED:
            continue
        hint = _HINTS.get(character, "")
        if not character.isascii():
            name = unicodedata.name(character, "unnamed character")
            if not hint and character.isalpha():
                hint = "write Greek letters by name, such as omega"
            what = f"the character {character!a} ({name}) is not plain ASCII"
        else:
            what = f"the character {character!r} has no place in an expression"
        raise refuse(f"{what}; {hint}" if hint else what, text, column)
    if not text.strip(" "):
        raise ExpressionError("the expression is empty")


def _check_brackets(text: str) -> None:
    opened: list[int] = []
    for column, character in enumerate(text):
        if character == "(":
            opened.append(column)
            if len(opened) > MAX_BRACKETS:
                raise refuse(f"brackets nest deeper than {MAX_BRACKETS} levels", text, column)
        elif character == ")":
            if not opened:
                raise refuse("this bracket closes nothing", text, column)
            opened.pop()
    if opened:
        raise refuse("this bracket is never closed", text, opened[-1])


def _number(match: re.Match[str], text: str) -> Token:
    written, column, end = match["number"], match.start(), match.end()
    follower = text[end : end + 1]
    if follower and (follower.isalnum() or follower in "_'."):
        rest = _PATTERN.match(text, end)
        if follower == "." or follower == "'":
            raise refuse(f"'{written}{follower}' is not a number", text, end)
        name = rest["name"] if rest and rest["name"] else follower
        if name in ("j", "J"):
            raise refuse("complex numbers are not allowed: the quantities of a model are real", text, column)
        raise refuse(f"an operator is missing between {written} and {name}; write {written}*{name}", text, end)
    if written.isdigit():
        digits = written.lstrip("0")
        if len(digits) > 40 or (digits and int(digits) >= 10**40):
            raise refuse("whole numbers must be below 1e40", text, column)
        return Token("number", digits or "0", column, written)
    value = float(written)
    if not math.isfinite(value):
        raise refuse(f"{written} is too large for double precision", text, column)
    mantissa = re.split("[eE]", written)[0]
    if value == 0.0 and mantissa.strip("0."):
        raise refuse(f"{written} is too small for double precision", text, column)
    return Token("number", written, column, written)


def _name(match: re.Match[str], text: str) -> Token:
    name, primes, column = match["name"], match["primes"], match.start()
    if name in ("and", "or", "not") and not primes:
        return Token("operator", name, column, name)
    if not valid_name(name):
        raise refuse(
            f"the name '{name[:70]}' is not allowed: a letter, then letters, digits and single underscores, at most 64",
            text,
            column,
        )
    if keyword.iskeyword(name):
        raise refuse(f"'{name}' is a reserved word; use another name, such as {name[:3]}_{name[0]}", text, column)
    if len(primes) > 2:
        raise refuse("at most two primes: first and second time derivatives", text, column + len(name) + 2)
    return Token("name", name + ("", "_dot", "_ddot")[len(primes)], column, name + primes)
