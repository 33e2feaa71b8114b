"""Blocks of a matrix pattern: states that influence each other both ways, found by transitive closure.

Ordered along the influences the matrix is block triangular, so that its eigenvalues are those of the diagonal blocks:
decoupled degrees of freedom, and a variation that is driven by another without driving it (the pendulum about the
semi-trivial solution), keep the accuracy of the small problems they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["mutual_blocks"]


def mutual_blocks(pattern: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Index sets of the strongly connected components of a pattern (n, n), ordered by their first index.

    Parameters
    ----------
    pattern : (n, n) bool
        Whether entry (i, j) is anything but zero.

    Returns
    -------
    list of (k,) index arrays

    Examples
    --------
    >>> import numpy as np
    >>> [b.tolist() for b in mutual_blocks(np.array([[1, 0, 1], [1, 1, 0], [1, 0, 0]], bool))]
    [[0, 2], [1]]
    """
    n = len(pattern)
    reach = pattern | np.eye(n, dtype=bool)
    for _ in range(max(1, int(np.ceil(np.log2(max(n, 2)))))):
        reach = (reach.astype(np.int64) @ reach.astype(np.int64)) > 0
    mutual = reach & reach.T
    seen: set[int] = set()
    blocks = []
    for i in range(n):
        if i not in seen:
            members = np.nonzero(mutual[i])[0]
            seen.update(members.tolist())
            blocks.append(members)
    return blocks
