"""Period-doubling curves over two parameters beside AUTO-07p: same equations, mesh (NTST, NCOL), tolerance, window.

Run:  python tests/benchmarks/bench_loci.py [tongue light]

AUTO finds the doubling on a one-parameter branch first (run 1), makes starting data from it (run 2, neither is counted) and
then follows the curve to both sides (ISW = 2). Its longest step is set so that it comes around the tip of the tongue in a
few hundred points; ours is the default. AUTO watches the multipliers (ISP = 2); ours besides locates generalised doublings
(which AUTO does not know), turns and extrema, and states errors and verdicts.
Processor times of one thread, the least of several runs. What counts is the ratio per accepted point.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[_name] = "1"

import resource
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
from bench_continuation import auto_directory, auto_executable, auto_source

import stability as st

DOUBLING = 7


def constants(n, icp, restart, switch, window, mesh, ds, ds_max):
    """AUTO's constants file for a run with these free parameters (numbers as in `auto_source`)."""
    lo, hi = min(window), max(window)
    return (
        f"NDIM={n}, IPS=2, IRS={restart}, ILP=1, ISP=2, ISW={switch}, ICP=[{', '.join(map(str, icp))}]\n"
        f"NTST={mesh[0]}, NCOL={mesh[1]}, IAD=3, IPLT=0\n"
        f"NMX=5000, RL0={lo - 1e-3}, RL1={hi + 1e-3}, NPR=100000, MXBF=0, IID=0, ITMX=8, ITNW=7, NWTN=3, JAC=1\n"
        f"EPSL=1e-8, EPSU=1e-8, EPSS=1e-7, DS={ds}, DSMIN=1e-6, DSMAX={ds_max}, IADS=1\n"
    )


def rows_of(folder):
    """(type, label, parameter) of every line of AUTO's summary, and its last point's number."""
    rows = [r.split() for r in (folder / "fort.7").read_text().splitlines()]
    rows = [r for r in rows if r and r[0] != "0"]
    return [(int(r[2]), int(r[3]), float(r[4])) for r in rows], max(abs(int(r[1])) for r in rows)


def run(folder, executable, text):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([executable], cwd=folder, input=text, text=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime


def auto_curve(system, orbit, first, free, window, mesh, repeats, longest):
    """(seconds, points, last lines) of the doubling curve from the first doubling, both directions; None without AUTO."""
    home = auto_directory()
    if home is None:
        return None
    n, names = len(system.states) + 2, list(system.parameters)
    number = {name: k + 1 if k < 10 else k + 11 for k, name in enumerate(names)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        executable = auto_executable(folder, auto_source(system, orbit, first), home)
        if executable is None:
            return None
        icp = [number[first], 11]
        up = 1 if orbit.params[first] < 0.5 * sum(window) else -1
        run(folder, executable, constants(n, icp, 0, 1, window, mesh, 0.01 * up, 0.05))
        labels = [label for kind, label, _ in rows_of(folder)[0] if kind % 10 == DOUBLING]
        icp = [number[first], number[free], 11]
        shutil.copy(folder / "fort.8", folder / "fort.3")
        run(folder, executable, constants(n, icp, labels[0], 2, window, mesh, 0.01, 0.2))  # makes starting data
        shutil.copy(folder / "fort.8", folder / "fort.3")
        start = max(label for _, label, _ in rows_of(folder)[0])
        seconds, points, ends = 0.0, 0, []
        for sign in (1, -1):
            text = constants(n, icp, start, 2, window, mesh, 0.01 * sign, longest)
            seconds += min(run(folder, executable, text) for _ in range(repeats))
            rows, count = rows_of(folder)
            points += count
            ends.append(rows[-1])
        return seconds, points, ends


def our_curve(system, first, free, window, mesh, repeats):
    """(seconds, points, Newton iterations, branch)."""
    problem = st.Collocation(system, intervals=mesh[0], degree=mesh[1], adaptive=False)
    branch = st.continuation(problem, first, window, tolerance=1e-8)
    point = branch.of_kind(st.Kind.PERIOD_DOUBLING)[0]
    best = np.inf
    for _ in range(repeats + 1):
        begin = time.process_time()
        curve = st.continuation(st.locus(point, free=free), first, window, tolerance=1e-8)
        best = min(best, time.process_time() - begin)
    return best, len(curve), int(curve.iterations.sum()), curve


def tongue():
    return st.models.autoparametric_pendulum(xi1=0.02, xi2=0.01, Omega0=0.5, length_ratio=10.0)


CASES = {
    "tongue": (tongue, "Omega", "length_ratio", (0.7, 1.4), 3, 20.0),
    "light": (lambda: st.models.autoparametric_pendulum(), "Omega", "length_ratio", (0.88, 1.12), 3, 200.0),
}


def main(names):
    warnings.simplefilter("ignore")
    print(f"{'case':9} {'NTST':>4} {'NCOL':>4} | {'AUTO s':>7} {'points':>6} {'ms/pt':>7} | {'ours s':>7} {'points':>6} {'ms/pt':>7} "
          f"{'it/pt':>5} | {'run':>5} {'point':>5}")  # fmt: skip
    for name in names:
        make, first, free, window, repeats, longest = CASES[name]
        system = make()
        for mesh in ((50, 4), (20, 5)):
            problem = st.Collocation(system)
            params = system.parameter_vector(**{first: window[0]})
            orbit = problem.view(problem.start(params), params)
            auto = auto_curve(system, orbit, first, free, window, mesh, repeats, longest)
            mine = our_curve(system, first, free, window, mesh, repeats)
            per = mine[0] / mine[1] * 1e3
            left, ratios = f"{'-':>7} {'-':>6} {'-':>7}", f"{'-':>5} {'-':>5}"
            if auto is not None:
                theirs = auto[0] / auto[1] * 1e3
                left = f"{auto[0]:7.3f} {auto[1]:6d} {theirs:7.3f}"
                ratios = f"{auto[0] / mine[0]:5.1f} {theirs / per:5.2f}"
            print(f"{name:9} {mesh[0]:4d} {mesh[1]:4d} | {left} | {mine[0]:7.3f} {mine[1]:6d} {per:7.3f} "
                  f"{mine[2] / mine[1]:5.1f} | {ratios}")  # fmt: skip
            print("          ours:", mine[3], "AUTO ends:", auto and auto[2])


if __name__ == "__main__":
    main(sys.argv[1:] or list(CASES))
