"""A damaged numba cache entry must cost time only: the kernel gives the same answer, in a fresh process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = """
import numpy as np
from stability.kernels.condensation_reduced import monodromy_product
print(monodromy_product(np.array([[[2.0]], [[3.0]]]))[0, 0])
"""


def run(cache: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.strip()


def test_damaged_entries_are_rebuilt(tmp_path):
    assert run(tmp_path) == "6.0"
    files = [f for f in tmp_path.rglob("*") if f.suffix in (".nbi", ".nbc")]
    assert len(files) >= 2
    for damage in (b"", b"not a pickle", None):
        for f in files:
            f.write_bytes(f.read_bytes()[: f.stat().st_size // 2] if damage is None else damage)
        assert run(tmp_path) == "6.0"
        assert run(tmp_path) == "6.0"


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path):
    locked = tmp_path / "file"
    locked.write_text("in the way of a directory")
    assert run(locked) == "6.0"
