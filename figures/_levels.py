"""Values of the stable parts of a branch at a parameter value, between its points too: what a sweep has to show."""

from __future__ import annotations

from typing import Any

import numpy as np

import stability as st

__all__ = ["nearest"]


def nearest(branch: Any, column: str, parameter: float, value: float) -> float:
    """The value of `column` on a stable part at `parameter` that is nearest to `value` (inf where there is none)."""
    found = [np.inf]
    for part in branch.segments():
        if part.verdict is not st.Verdict.STABLE:
            continue
        at = branch.parameter[part.start : part.stop]
        values = branch.columns[column][part.start : part.stop]
        for k in np.nonzero((at[:-1] - parameter) * (at[1:] - parameter) <= 0)[0]:
            share = (parameter - at[k]) / (at[k + 1] - at[k]) if at[k + 1] != at[k] else 0.0
            found.append(float(values[k] + share * (values[k + 1] - values[k])))
    return min(found, key=lambda level: abs(level - value))
