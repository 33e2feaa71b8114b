"""From the stored description of a problem back to the problem, without a table of solvers imported at load time.

A branch keeps, for every mesh it used, the problem's *spec*: plain JSON data with the key "problem". Loading and
plotting a branch never needs more. Only `Branch.at`, `Branch.extend`, `switch` and `locus` of a loaded branch come here
and import the one module that defines the problem; ``cls.from_spec(spec)`` makes an equal problem. The table is closed:
a file can name a problem in it, and nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from ..errors import FileFormatError, InputError

__all__ = ["revive"]

# class name -> module below `stability`
_PROBLEMS = {
    "Equilibrium": "problems.equilibria",
    "Collocation": "problems.collocation",
    "Shooting": "problems.shooting",
    "ImpactShooting": "problems.impact_shooting",
    "HarmonicBalance": "problems.harmonic_balance",
    "Backbone": "problems.backbone",
    "Locus": "problems.locus",
    "Born": "problems.switching",
}


def revive(spec: Mapping[str, Any]) -> Any:
    """The problem described by `spec`.

    Raises
    ------
    InputError
        The problem's system was made from a Python function: its results can be viewed after loading, not continued.
    FileFormatError
        A problem this version does not know.
    """
    name = spec.get("problem")
    if spec.get("view_only"):
        raise InputError(
            "this result comes from a system made of a Python function, which a file cannot hold: "
            "it can be plotted, but to continue it build the system again and start from a solution of this branch"
        )
    if name not in _PROBLEMS:
        raise FileFormatError(f"problem '{name}' is not one this version knows ({', '.join(_PROBLEMS)})")
    return getattr(import_module(f"stability.{_PROBLEMS[name]}"), name).from_spec(spec)
