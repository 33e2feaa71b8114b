"""All symmetries of a system among the signed permutations of its states, found by trial and then proved.

Candidates are the involutions S of coordinates with signs, velocities carried along (states without a coordinate count
by themselves): all of them up to six coordinates (1384), of larger systems sign changes only (up to twelve), the
reversal of the order of the coordinates, and single sign changes. Each is tried at random points, with and without the
shift by half a forcing period, in one batched call; those that survive are verified one by one (`symmetries.verified`).
A larger symmetry that is not among the candidates can be declared: it is verified in the same way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..errors import EquationError
from .symmetries import Symmetry, defects, verified

if TYPE_CHECKING:
    from .system import System

__all__ = ["find_symmetries"]

Array = npt.NDArray[np.float64]
_ALL, _SIGNS = 6, 12  # coordinates up to which all involutions, all sign changes are tried
_BATCH = 512
_CLOSE = 1e-9


def _blocks(states: Sequence[str]) -> list[list[str]]:
    """Coordinates with their velocities; other states by themselves."""
    return [[s, f"{s}_dot"] if f"{s}_dot" in states else [s] for s in states if not _is_velocity(s, states)]


def _is_velocity(state: str, states: Sequence[str]) -> bool:
    return state.endswith("_dot") and state[:-4] in states


def _pairings(items: list[int]) -> Iterator[dict[int, int]]:
    """All involutions of the items."""
    if not items:
        yield {}
        return
    first, rest = items[0], items[1:]
    for other in _pairings(rest):
        yield {first: first, **other}
    for k, partner in enumerate(rest):
        for other in _pairings(rest[:k] + rest[k + 1 :]):
            yield {first: partner, partner: first, **other}


def _signed(pairing: dict[int, int], free: bool) -> Iterator[dict[int, tuple[int, int]]]:
    """Signs for an involution: one for every fixed item and every pair, so that it remains one."""
    orbits = sorted({tuple(sorted((i, j))) for i, j in pairing.items()})
    choices = product((1, -1), repeat=len(orbits)) if free else ((1,) * len(orbits), (-1,) * len(orbits))
    for signs in choices:
        sign_of = {i: sign for orbit, sign in zip(orbits, signs) for i in orbit}
        yield {i: (sign_of[i], j) for i, j in pairing.items()}


def _candidates(count: int) -> Iterator[dict[int, tuple[int, int]]]:
    """Signed involutions of `count` coordinates, as {place: (sign, image)}."""
    same = {i: i for i in range(count)}
    if count <= _ALL:
        for pairing in _pairings(list(range(count))):
            yield from _signed(pairing, True)
        return
    if count <= _SIGNS:
        yield from _signed(same, True)
    else:
        yield from _signed(same, False)
        for k in range(count):
            yield {i: (-1 if i == k else 1, i) for i in range(count)}
    yield from _signed({i: count - 1 - i for i in range(count)}, False)


def _as_symmetry(blocks: list[list[str]], choice: dict[int, tuple[int, int]], shift: float) -> Symmetry | None:
    images = []
    for i, (sign, j) in choice.items():
        if len(blocks[i]) != len(blocks[j]):
            return None
        images += [(s, f"-{r}" if sign < 0 else r) for s, r in zip(blocks[i], blocks[j])]
    return Symmetry(tuple(images), shift)


@lru_cache(maxsize=64)
def find_symmetries(system: System) -> tuple[Symmetry, ...]:
    """All symmetries among the candidates (see the head of this file), most sign changes first.

    Returns
    -------
    tuple of Symmetry
        Without the identity; with a shift by half the forcing period before those without.

    Notes
    -----
    *Accuracy*: a symmetry with ``proved`` True follows from the equations; what is not listed may still be there.
    """
    blocks = _blocks(system.states)
    shifts = (0.0,) if system.period_expression is None else (0.5, 0.0)
    params = system.parameter_vector()
    found: list[Symmetry] = []
    for shift in shifts:
        tried = [_as_symmetry(blocks, choice, shift) for choice in _candidates(len(blocks))]
        whole = [s.completed(system.states) for s in tried if s is not None]
        whole = [s for s in whole if any(name != image for name, image in s.images)]
        for k in range(0, len(whole), _BATCH):
            part = whole[k : k + _BATCH]
            worst = defects(system, np.array([s.matrix for s in part]), shift, params).max(axis=1)
            found += [s for s, w in zip(part, worst) if w <= _CLOSE]
    kept = []
    for one in found:
        try:
            kept.append(verified(system, one))
        except EquationError:  # its stops are not carried along
            continue
    return tuple(sorted(kept, key=lambda s: (-s.shift, float(np.trace(s.matrix)))))
