"""The two names of a method: the word that `responses` takes, and what tables and legends of `compare` call it.

    hb9 = harmonic balance 9,  averaging2 = averaging, order 2,  multiple-scales = multiple scales,  sweep-up = sweep up

The others are called the same. Results that are looked up by method take either.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

__all__ = ["called", "in_words"]


def in_words(method: str) -> str:
    """The name in a legend of a method given by its word; any other text as it is.

    >>> in_words("hb9"), in_words("multiple-scales2"), in_words("sweep-up"), in_words("collocation")
    ('harmonic balance 9', 'multiple scales, order 2', 'sweep up', 'collocation')
    """
    found = re.fullmatch(r"hb([1-9]\d*)", method)
    if found:
        return f"harmonic balance {found[1]}"
    found = re.fullmatch(r"(averaging|multiple-scales)(2?)", method)
    if found:
        return found[1].replace("-", " ") + (", order 2" if found[2] else "")
    return method.replace("-", " ") if method in ("sweep-up", "sweep-down") else method


def called(method: str, names: Iterable[str]) -> str | None:
    """The one of the names that means this method; None if there is none."""
    listed = list(names)
    if method in listed:
        return method
    return next((name for name in listed if in_words(name) == in_words(method)), None)
