"""One solution on a mesh, or with harmonics, as good as its problem promises: solved, adapted, solved again.

Along a branch the discretisation follows the solution every few points; for a single solution it is adapted until the
problem asks for nothing more, at most `_ROUNDS` times. A finer mesh on which Newton's method fails is not taken.
"""

from __future__ import annotations

from typing import Any

from ..protocols import Corrected

__all__ = ["adapted_solution"]

_ROUNDS = 12


def adapted_solution(problem: Any, found: Corrected, name: str, tolerance: float) -> tuple[Any, Corrected]:
    """(problem, solution at the same parameters) after adaption, for problems whose discretisation can be adapted."""
    if not hasattr(problem, "adaptive"):
        return problem, found
    for _ in range(_ROUNDS):
        better = problem.adapt(found.u, found.params, None)
        if better is None:
            break
        new, u, _ = better
        again = found if u is found.u else new.correct(u, found.params, name, None, 0.0, tolerance)
        if not again.converged:
            break
        problem, found = new, again
    return problem, found
