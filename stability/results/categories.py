"""Arrays of words in one byte a point: the verdicts and kinds of a chart.

A chart of 4000 x 4000 points cannot hold sixteen million strings; it holds small integers and shows words. Comparing
with a word is elementwise and gives a boolean array, ``chart.verdict == Verdict.UNSTABLE``; indexing gives a word (one
point) or a smaller array of the same sort; ``np.asarray`` gives the words as text.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..words import Verdict

__all__ = ["KINDS", "NEUTRAL", "STABLE", "UNDETERMINED", "UNSTABLE", "VERDICTS", "Categories"]

STABLE, UNSTABLE, NEUTRAL, UNDETERMINED = 0, 1, 2, 3
VERDICTS: tuple[str, ...] = (Verdict.STABLE, Verdict.UNSTABLE, Verdict.NEUTRAL, Verdict.UNDETERMINED)
KINDS: tuple[str, ...] = ("none", "+1", "-1", "pair")


@dataclass(frozen=True, eq=False, repr=False)
class Categories:
    """An array of words, stored as int8 codes.

    Parameters
    ----------
    codes : int8 array of any shape
    words : what the codes 0, 1, ... mean

    Examples
    --------
    >>> kinds = Categories(np.array([0, 2, 2], dtype=np.int8), KINDS)
    >>> (kinds == "-1").tolist(), kinds[0], kinds.counts()
    ([False, True, True], 'none', {'none': 1, '-1': 2})
    """

    codes: NDArray[np.int8]
    words: tuple[str, ...]

    def __post_init__(self) -> None:
        self.codes.setflags(write=False)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return self.codes.shape

    @property
    def size(self) -> int:
        """Number of points."""
        return self.codes.size

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self.codes.ndim

    def counts(self) -> dict[str, int]:
        """How many points carry each word that occurs."""
        numbers = np.bincount(self.codes.ravel(), minlength=len(self.words))
        return {word: int(n) for word, n in zip(self.words, numbers, strict=True) if n}

    def _code(self, word: object) -> int:
        if word in self.words:
            return self.words.index(str(word))
        allowed = ", ".join(f"'{w}'" for w in self.words)
        raise InputError(f"compared with {word!r}; the words are {allowed}")

    def __eq__(self, other: object) -> Any:
        if isinstance(other, Categories):
            return self.codes == other.codes
        return self.codes == (self._code(other) if isinstance(other, str) else np.vectorize(self._code)(other))

    def __ne__(self, other: object) -> Any:
        return ~(self == other)

    __hash__ = None  # type: ignore[assignment]

    def __getitem__(self, index: Any) -> Any:
        picked = self.codes[index]
        return self.words[int(picked)] if np.ndim(picked) == 0 else Categories(picked, self.words)

    def __len__(self) -> int:
        return len(self.codes)

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array([str(w) for w in self.words])[self.codes].astype(dtype or "U", copy=False)

    def tolist(self) -> list[Any]:
        """Nested lists of words."""
        return list(np.asarray(self).tolist())

    def __repr__(self) -> str:
        shares = "  ".join(f"{word} {count / self.size:.1%}" for word, count in self.counts().items())
        return f"Categories {'x'.join(map(str, self.shape))} | {shares}"
