"""What a first use compiles: one signature each, and no more kernels than this; a fresh process and an empty cache."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import json, sys, warnings
import stability as st
warnings.simplefilter("ignore")
system = st.models.duffing(xi=0.02, beta=0.001)
method = sys.argv[1]
if method == "simulate":
    st.simulate(system, (0.0, 10.0), x0={"u": 0.1})
elif method == "locus":
    semi = st.continuation(st.Collocation(st.models.autoparametric_pendulum()), "Omega", (0.93, 1.0))
    st.continuation(st.locus(semi["PD1"], free="length_ratio"), "Omega", (0.94, 0.96))
else:
    st.continuation(getattr(st, method)(system), "Omega", (0.3, 3.0))
from numba.core.dispatcher import Dispatcher
found = {}
for name, module in list(sys.modules.items()):
    if name.startswith("stability.kernels"):
        for value in vars(module).values():
            if isinstance(value, Dispatcher) and value.signatures:
                key = f"{value.py_func.__module__}.{value.py_func.__name__}".removeprefix("stability.kernels.")
                found[key] = len(value.signatures), value.targetoptions.get("no_cpython_wrapper", False)
print(json.dumps(found))
"""
# functions that Python calls, at most so many; a new one is a second and more of everybody's first minute
MOST = {"Collocation": 11, "HarmonicBalance": 7, "Shooting": 2, "simulate": 2, "locus": 15}


@pytest.mark.parametrize(
    "method",
    ["simulate", *(pytest.param(m, marks=pytest.mark.slow) for m in ("Collocation", "HarmonicBalance", "Shooting", "locus"))],
)
def test_first_use(method: str, tmp_path: Path) -> None:
    """Arrays of another sort (read-only, strided, an integer literal) would compile a kernel or a helper once more."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, method],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout.splitlines()[-1])
    assert {name: count for name, (count, _) in found.items() if count != 1} == {}
    kernels = [name for name, (_, helper) in found.items() if not helper]
    assert 1 <= len(kernels) <= MOST[method], kernels
