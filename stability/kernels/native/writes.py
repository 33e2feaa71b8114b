"""Which arguments of a kernel are written to: those must not be read-only arrays."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any

from .functions import EXTERNAL, source_of

__all__ = ["written"]


@lru_cache(maxsize=256)
def written(kernel: Any) -> frozenset[int]:
    """Positions of the arguments that a kernel, or what it calls, writes to."""
    tree = source_of(kernel.function)
    owners = {one.arg: {number} for number, one in enumerate(tree.args.args)}
    found: set[int] = set()
    for node in ast.walk(tree):  # a name that stands for (a part of) an argument
        if isinstance(node, ast.Assign):
            for name, value in _pairs(node.targets[0], node.value):
                owners[name] = owners.get(name, set()) | _owners(value, owners)
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign | ast.AugAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                for one in target.elts if isinstance(target, ast.Tuple) else [target]:
                    found |= _owners(one, owners) if isinstance(one, ast.Subscript) else set()
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            other = kernel.function.__globals__.get(node.func.id)
            places: Iterable[int] = written(other) if hasattr(other, "inline") else ()
            if node.func.id in EXTERNAL:
                places = (place + 1 for place in EXTERNAL[node.func.id][1])
            for place in places:
                found |= _owners(node.args[place], owners)
    return frozenset(found)


def _owners(node: ast.expr, owners: dict[str, set[int]]) -> set[int]:
    """Arguments that an array expression may be a part of."""
    while isinstance(node, ast.Subscript | ast.Attribute | ast.Call):  # a part, or another shape, of an array
        node = node.func if isinstance(node, ast.Call) else node.value
    return owners.get(node.id, set()) if isinstance(node, ast.Name) else set()


def _pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    """Names and the expressions they stand for; several names of one tuple stand for parts of it."""
    if isinstance(target, ast.Name):
        yield target.id, value
    elif isinstance(target, ast.Tuple):
        several = isinstance(value, ast.Tuple) and len(value.elts) == len(target.elts)
        for k, one in enumerate(target.elts):
            yield from _pairs(one, value.elts[k] if several and isinstance(value, ast.Tuple) else value)
