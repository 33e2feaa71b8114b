"""First compilation ever: which kernels a workflow compiles, what each of them costs, and the sum over all workflows.

Run ``python tests/benchmarks/bench_compile.py [workflow ...]``. Each workflow runs in a process of its own with an empty
cache, then all of them in one process, which is what a user pays in all. CPU seconds of that process, one thread:
`own` is a function without the helpers that it makes numba compile, `import` the import of numba. Overloads of numba's
own (`impl`) are summed up in one line. Budget: 6 s in all.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import stability as st


def collocation() -> Any:
    """The resonance curve of the Duffing oscillator."""
    return st.continuation(st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.3, 3.0))


def autonomous() -> Any:
    """Orbits of van der Pol's oscillator from a state."""
    start = {"x": 2.0, "x_dot": 0.0}
    return st.continuation(st.Collocation(st.models.van_der_pol()), "mu", (0.5, 2.0), start=start)


def harmonic_balance() -> Any:
    """The same resonance curve by harmonic balance."""
    return st.continuation(st.HarmonicBalance(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.3, 3.0))


def shooting() -> Any:
    """The same by shooting."""
    return st.continuation(st.Shooting(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.3, 3.0))


def simulation() -> Any:
    """A hundred seconds of it."""
    return st.simulate(st.models.duffing(xi=0.02, beta=0.001), (0.0, 100.0), x0={"u": 0.1})


WORKFLOWS: dict[str, Callable[[], Any]] = {
    f.__name__: f for f in (collocation, autonomous, harmonic_balance, shooting, simulation)
}


class Recorder:
    """Listens to numba's compilations: rows of (function, seconds in all, seconds of its own, depth)."""

    def __init__(self) -> None:
        from numba.core import event

        self.open: list[list[Any]] = []
        self.rows: list[tuple[str, float, float, int]] = []
        recorder = self

        class Listener(event.Listener):
            def on_start(self, event: Any) -> None:
                function = event.data["dispatcher"].py_func
                name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
                own = function.__module__.startswith("stability")
                recorder.open.append([name if own else "numba's overloads", time.process_time(), 0.0])

            def on_end(self, event: Any) -> None:
                name, start, inner = recorder.open.pop()
                seconds = time.process_time() - start
                if recorder.open:
                    recorder.open[-1][2] += seconds
                recorder.rows.append((name, seconds, seconds - inner, len(recorder.open)))

        event.register("numba:compile", Listener())


def measured(names: list[str]) -> None:
    """Run the workflows and print what was compiled."""
    start = time.process_time()
    recorder = Recorder()
    imported, start = time.process_time() - start, time.process_time()
    for name in names:
        WORKFLOWS[name]()
    whole = time.process_time() - start
    compiled = sum(row[2] for row in recorder.rows)
    helpers = sum(1 for row in recorder.rows if row[3] > 0)
    print(
        f"{' + '.join(names)}: {compiled:.2f} s in {len(recorder.rows) - helpers} kernels with {helpers} helpers "
        f"(import {imported:.2f}, all of the work {whole:.2f})"
    )
    total: dict[str, tuple[float, float, int, int]] = {}
    for name, seconds, own, depth in recorder.rows:
        known = total.get(name, (0.0, 0.0, 0, depth))
        total[name] = known[0] + seconds, known[1] + own, known[2] + 1, min(depth, known[3])
    for name, (seconds, own, count, depth) in sorted(total.items(), key=lambda item: -item[1][0]):
        if depth == 0 or "-v" in sys.argv:
            mark = "" if depth == 0 else "  helper "
            print(f"  {mark}{name:44s} {seconds:6.2f}   own {own:5.2f}" + (f"   {count} times" if count > 1 else ""))


def main() -> int:
    """All workflows, each in a new process with an empty cache."""
    if "--here" in sys.argv:
        measured([name for name in sys.argv[1:] if name in WORKFLOWS])
        return 0
    chosen = [name for name in sys.argv[1:] if name in WORKFLOWS] or list(WORKFLOWS)
    for names in [*([name] for name in chosen), *([chosen] if len(chosen) > 1 else [])]:
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, "NUMBA_CACHE_DIR": folder, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
            options = [one for one in sys.argv[1:] if one == "-v"]
            subprocess.run([sys.executable, __file__, "--here", *names, *options], env=environment, check=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
