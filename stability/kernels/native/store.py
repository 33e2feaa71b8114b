"""Machine code on disk: one file per kernel, source and processor; a damaged or foreign file is as good as none.

A file is the digest of its content followed by the content. What does not fit its digest (a full disk, a killed
process, a copied home directory) is deleted and made again; where nothing can be written, code is made anew in every
process. Code is therefore never lost to its store: it only becomes slower to get.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import tempfile
from pathlib import Path

__all__ = ["folder", "read", "write"]

_DIGEST = 32


def folder() -> Path:
    """Where the code is kept: STABILITY_CACHE_DIR, or beside the kernels, or among the user's caches."""
    given = os.environ.get("STABILITY_CACHE_DIR")
    if given:
        return Path(given)
    beside = Path(__file__).resolve().parent.parent / "__pycache__"
    existing = beside if beside.exists() else beside.parent
    if os.access(existing, os.W_OK):
        return beside
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "stability"


def _path(name: str, processor: str, source: str) -> Path:
    return folder() / f"{name}-{processor}-{source}.code"


def read(name: str, processor: str, source: str) -> bytes | None:
    """The code of a kernel for this processor from these sources, or None."""
    path = _path(name, processor, source)
    try:
        whole = path.read_bytes()
    except OSError:
        return None
    content = whole[_DIGEST:]
    if content and hashlib.blake2b(content, digest_size=_DIGEST).digest() == whole[:_DIGEST]:
        return content
    with contextlib.suppress(OSError):
        path.unlink()
    return None


def write(name: str, processor: str, source: str, content: bytes) -> None:
    """Keep the code; older code of the same kernel for the same processor is deleted."""
    path = _path(name, processor, source)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        for old in path.parent.glob(f"{name}-{processor}-*.code"):
            with contextlib.suppress(OSError):
                old.unlink()
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f"{name}-", suffix=".part")
        with os.fdopen(handle, "wb") as file:
            file.write(hashlib.blake2b(content, digest_size=_DIGEST).digest() + content)
        os.replace(temporary, path)
