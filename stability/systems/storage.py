"""A `System` as plain data and back: JSON-able, validated on reading, never run.

Floats survive exactly (JSON writes the shortest text that reads back as the same number); expressions are trees.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import FileFormatError, InputError
from .excitation import BaseMotion
from .stops import HardStop
from .symmetries import Symmetry
from .tree import from_tree, to_tree

if TYPE_CHECKING:
    from .system import System

__all__ = ["from_plain", "to_plain"]


def to_plain(system: System, schema: str) -> dict[str, Any]:
    """The system's fields as JSON-able data under a schema name."""
    if system.function is not None or system.rhs is None:
        raise InputError(f"'{system.name}' is built around a Python function, which is not data and cannot be written")
    period = system.period_expression
    declared = system.declared_symmetries
    slow = {k: to_tree(e) for k, e in system.reconstruction.items()}
    return {
        "schema": schema,
        "name": system.name,
        "coordinates": list(system.coordinates),
        "states": list(system.states),
        "parameters": [[k, v] for k, v in system.parameters.items()],
        "rhs": [to_tree(e) for e in system.rhs],
        "period": None if period is None else to_tree(period),
        "outputs": [[k, to_tree(e)] for k, e in system.outputs.items()],
        "units": dict(system.units),
        "bounds": {k: list(b) for k, b in system.bounds.items()},
        "breaks": [to_tree(b) for b in system.breaks],
        "angles": list(system.angles),
        "orders": dict(system.orders),
        "stops": [[s.coordinate, s.position, s.side, s.restitution] for s in system.stops],
        "base": None if system.base is None else [system.base.parameter, to_tree(system.base.angular_frequency)],
        "description": system.description,
        **({"reconstruction": [[k, e] for k, e in slow.items()]} if slow else {}),
        **({"symmetries": [[dict(s.images), s.shift] for s in declared]} if declared else {}),
    }


def from_plain(data: Mapping[str, Any]) -> dict[str, Any]:
    """The constructor fields of the system that `to_plain` wrote; FileFormatError for anything else."""
    try:
        period, base = data["period"], data["base"]
        return {
            "name": str(data["name"]),
            "coordinates": tuple(data["coordinates"]),
            "states": tuple(data["states"]),
            "parameters": {k: float(v) for k, v in data["parameters"]},
            "rhs": tuple(from_tree(e) for e in data["rhs"]),
            "period_expression": None if period is None else from_tree(period),
            "outputs": {k: from_tree(e) for k, e in data["outputs"]},
            "units": {k: str(u) for k, u in data["units"].items()},
            "bounds": {k: (float(lo), float(hi)) for k, (lo, hi) in data["bounds"].items()},
            "breaks": tuple(from_tree(b) for b in data["breaks"]),
            "angles": tuple(data["angles"]),
            "orders": {k: int(o) for k, o in data["orders"].items()},
            "stops": tuple(HardStop(str(c), float(x), int(s), float(e)) for c, x, s, e in data["stops"]),
            "base": None if base is None else BaseMotion(str(base[0]), from_tree(base[1])),
            "description": str(data["description"]),
            "reconstruction": {str(k): from_tree(e) for k, e in data.get("reconstruction", ())},
            "declared_symmetries": tuple(
                Symmetry(tuple(dict(s).items()), float(h)) for s, h in data.get("symmetries", ())
            ),
        }
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(f"damaged system data: {type(error).__name__}: {error}") from error
