"""Several results in one file: their headers in a list, their arrays under ``<k>/<name>`` (see `storage`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from .storage import class_of, schema_of

__all__ = ["packed", "unpacked"]


def packed(results: Sequence[Any]) -> tuple[list[dict[str, Any]], dict[str, NDArray[Any]]]:
    """Headers, each with its schema, and arrays of results that have ``to_storage``."""
    headers, arrays = [], {}
    for k, result in enumerate(results):
        header, own = result.to_storage()
        headers.append({"schema": schema_of(result), "header": header})
        arrays.update({f"{k}/{name}": array for name, array in own.items()})
    return headers, arrays


def unpacked(headers: Sequence[Mapping[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> list[Any]:
    """The inverse of `packed`."""
    results = []
    for k, outer in enumerate(headers):
        own = {name.removeprefix(f"{k}/"): a for name, a in arrays.items() if name.startswith(f"{k}/")}
        results.append(class_of(outer["schema"]).from_storage(outer["header"], own))
    return results
