"""One thread for BLAS and OpenMP, and no display, before anything imports numpy or matplotlib.

The suite runs in two processes (pytest-xdist); results must not depend on how many cores the machine has.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"):
    os.environ[_name] = "1"
os.environ["MPLBACKEND"] = "Agg"
