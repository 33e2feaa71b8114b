"""Whole branches of periodic orbits beside AUTO-07p: same mesh (NTST, NCOL), tolerance, window, special points.

Run:  python tests/benchmarks/bench_continuation.py [duffing fold pendulum chain]

AUTO (the Debian package auto-07p) gets the equations as generated C code with analytic derivatives, and the forcing as
its usual oscillator of two more states. Both sides run on one thread; times are processor times, the least of several
runs; AUTO's include reading constants and writing its files, ours the whole of `continuation` in a running interpreter
(compilation is a line of its own). Ratios are what counts.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[_name] = "1"

import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import sympy as sp

import stability as st

STUB = "#include <stdlib.h>\nvoid _gfortran_os_error_at(const char *a, const char *b, ...) { abort(); }\n"
EMPTY = """
int pvls(integer n, const doublereal *u, doublereal *par) { return 0; }
int bcnd(integer n, const doublereal *par, const integer *icp, integer nbc, const doublereal *u0, const doublereal *u1,
         integer ijac, doublereal *fb, doublereal *dbc) { return 0; }
int icnd(integer n, const doublereal *par, const integer *icp, integer nint, const doublereal *u,
         const doublereal *uold, const doublereal *udot, const doublereal *upold, integer ijac, doublereal *fi,
         doublereal *dint) { return 0; }
int fopt(integer n, const doublereal *u, const integer *icp, const doublereal *par, integer ijac, doublereal *fs,
         doublereal *dfdu, doublereal *dfdp) { return 0; }
"""


# ---------------------------------------------------------------------- AUTO
def auto_directory() -> Path | None:
    """Where AUTO's object files are: $AUTO_DIR, or what its start script says."""
    if "AUTO_DIR" in os.environ:
        return Path(os.environ["AUTO_DIR"])
    script = shutil.which("auto-07p") or shutil.which("auto")
    if script is None:
        return None
    found = re.search(r"AUTO_DIR=(/\S+)", Path(script).read_text(errors="ignore"))
    return Path(found.group(1)) if found else None


def auto_source(system: st.System, orbit, Omega: str) -> str:
    """The system with a forcing oscillator as C code with derivatives; the start is a Fourier series of `orbit`."""
    t = sp.Symbol("t", real=True)
    c, s = sp.symbols("c_osc s_osc", real=True)
    W = sp.Symbol(Omega, real=True)
    states = [sp.Symbol(name, real=True) for name in system.states] + [c, s]
    params = [sp.Symbol(name, real=True) for name in system.parameters]
    rhs = [sp.expand(e).subs({sp.cos(W * t): c, sp.sin(W * t): s}) for e in system.rhs]
    assert not any(e.has(t) for e in rhs), "only cos and sin of the forcing phase"
    r = c**2 + s**2
    rhs += [c * (1 - r) - W * s, s * (1 - r) + W * c]
    plain = {x: sp.Symbol(f"x_{k}", real=True) for k, x in enumerate(states)}
    plain |= {x: sp.Symbol(f"p_{k}", real=True) for k, x in enumerate(params)}
    values = dict(orbit.params)
    defaults = [values[p.name] for p in params]
    rhs = [e.subs(plain, simultaneous=True) for e in rhs]
    states, params = [plain[x] for x in states], [plain[x] for x in params]
    n = len(states)
    lines = ['#include "auto_f2c.h"', "#include <math.h>"]
    lines.append("int func(integer ndim, const doublereal *u, const integer *icp, const doublereal *par, integer ijac, "
                 "doublereal *f, doublereal *dfdu, doublereal *dfdp) {")  # fmt: skip
    lines += [f"  const double {x} = u[{k}];" for k, x in enumerate(states)]
    lines += [f"  const double {x} = par[{k if k < 10 else k + 10}];" for k, x in enumerate(params)]
    J = [(f"dfdu[{i} + {j} * ndim]", sp.diff(e, x)) for j, x in enumerate(states) for i, e in enumerate(rhs)]
    Q = [
        (f"dfdp[{i} + {j if j < 10 else j + 10} * ndim]", sp.diff(e, x))
        for j, x in enumerate(params)
        for i, e in enumerate(rhs)
    ]
    lines += [f"  f[{k}] = {sp.ccode(e)};" for k, e in enumerate(rhs)] + ["  if (ijac == 0) return 0;"]
    lines += [f"  {name} = {sp.ccode(e)};" for name, e in J] + ["  if (ijac == 1) return 0;"]
    lines += [f"  {name} = {sp.ccode(e)};" for name, e in Q] + ["  return 0; }"]
    lines.append(
        "int stpnt(integer ndim, doublereal t, doublereal *u, doublereal *par) { const double w = 2 * M_PI * t;"
    )
    lines += [f"  par[{k if k < 10 else k + 10}] = {value!r};" for k, value in enumerate(defaults)]
    lines.append(f"  par[10] = {orbit.period!r};")
    for k in range(n - 2):
        harmonics = [orbit.harmonic(h)[k] for h in range(12)]
        terms = [repr(float(harmonics[0].real))]
        terms += [
            f"{2 * z.real!r} * cos({h} * w) - ({2 * z.imag!r}) * sin({h} * w)" for h, z in enumerate(harmonics) if h
        ]
        lines.append(f"  u[{k}] = {' + '.join(terms)};".replace("np.float64", ""))
    lines.append(f"  u[{n - 2}] = cos(w); u[{n - 1}] = sin(w); return 0; }}")
    return "\n".join(lines) + EMPTY


def auto_executable(folder: Path, source: str, home: Path) -> Path | None:
    """Compile and link with gfortran, or with gcc and the Fortran runtime that numpy brings."""
    (folder / "eq.c").write_text(source)
    (folder / "stub.c").write_text(STUB)
    objects = [str(o) for o in sorted((home / "lib").glob("*.o"))]
    library = f"-L{home / 'lib'}", "-lauto_c"
    subprocess.run(["gcc", "-O2", f"-I{home / 'include'}", "-c", "eq.c", "stub.c"], cwd=folder, check=True)
    link = ["gfortran", "-fopenmp", "eq.o", *objects, *library, "-lm"]
    if shutil.which("gfortran") is None:
        runtime = sorted((Path(np.__file__).parent.parent / "numpy.libs").glob("libgfortran*"))
        if not runtime:
            return None
        link = ["gcc", "-fopenmp", "eq.o", "stub.o", *objects, *library, str(runtime[0])]
        link += [f"-Wl,-rpath,{runtime[0].parent}", "-Wl,--allow-shlib-undefined", "-lm"]
    done = subprocess.run([*link, "-o", "eq.exe"], cwd=folder, capture_output=True, text=True)
    return folder / "eq.exe" if done.returncode == 0 else None


def auto_run(system, orbit, Omega, window, intervals, degree, repeats, ds_max=0.2):
    """(processor seconds, accepted points, special parameter values) of one branch; None without AUTO."""
    home = auto_directory()
    if home is None:
        return None
    n, index = len(system.states) + 2, list(system.parameters).index(Omega) + 1
    lo, hi = min(window), max(window)
    sign = 1 if window[1] > window[0] else -1
    constants = (
        f"NDIM={n}, IPS=2, IRS=0, ILP=1, ISP=2, ISW=1, ICP=[{index},11]\nNTST={intervals}, NCOL={degree}, IAD=3, IPLT=0\n"
        f"NMX=20000, RL0={lo - 1e-3}, RL1={hi + 1e-3}, NPR=100000, MXBF=0, IID=0, ITMX=8, ITNW=7, NWTN=3, JAC=1\n"
        f"EPSL=1e-8, EPSU=1e-8, EPSS=1e-7, DS={sign * 0.01}, DSMIN=1e-6, DSMAX={ds_max}, IADS=1\n"
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        executable = auto_executable(folder, auto_source(system, orbit, Omega), home)
        if executable is None:
            return None
        best = np.inf
        for _ in range(repeats):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([executable], cwd=folder, input=constants, text=True, capture_output=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            best = min(best, after.ru_utime - before.ru_utime)
        rows = [r.split() for r in (folder / "fort.7").read_text().splitlines()]
        rows = [r for r in rows if r and r[0] not in ("0",)]
        special = [(int(r[2]), float(r[4])) for r in rows if int(r[2]) % 10 in (1, 2, 5, 6, 7, 8)]
        return best, max(abs(int(r[1])) for r in rows), special


# ---------------------------------------------------------------------- ours
def ours(system, Omega, window, intervals, degree, repeats, **keywords):
    best = np.inf
    for _ in range(repeats):
        problem = st.Collocation(system, degree=degree, intervals=intervals, **keywords)
        start = time.process_time()
        branch = st.continuation(problem, Omega, window, tolerance=1e-8)
        best = min(best, time.process_time() - start)
    return best, len(branch.columns[Omega]), branch


def kernel_cost(system, intervals, degree, params):
    """Microseconds of one Newton iteration in the kernel, of the linearisation, of the spectrum with its error."""
    problem = st.Collocation(system, degree=degree, intervals=intervals)
    u = problem.start(params)
    name = next(iter(problem.parameters))

    def least(call, count=60):
        times = []
        for _ in range(7):
            start = time.process_time()
            for _ in range(count):
                call()
            times.append((time.process_time() - start) / count * 1e6)
        return min(times)

    found = problem.correct(u, params, name, None, 0.0, 1e-9)

    def spectrum():
        problem._memo.clear()
        problem.spectrum(found.linearisation)

    per_solve = least(lambda: problem.correct(u, params, name, None, 0.0, 1e-9)) / found.iterations
    return per_solve, least(lambda: problem.linearise(u, params)), least(spectrum)


def duffing(beta):
    return st.models.duffing(xi=0.02, beta=beta)


CASES = {
    "duffing": (lambda: duffing(0.001), (0.3, 3.0), 50, 4, 9),
    "fold": (lambda: duffing(0.05), (3.0, 0.3), 50, 4, 9),
    "pendulum": (lambda: st.models.autoparametric_pendulum(), (0.7, 1.3), 50, 4, 5),
    "chain": (lambda: hardening_chain(10), (0.05, 0.25), 50, 4, 2),
}


def hardening_chain(count):
    """`count` unit masses in a row, springs q + 0.1 q^3, relative dampers 0.05, the first one forced."""
    t = sp.Symbol("t", real=True)
    Omega, F = sp.symbols("Omega F", real=True)
    q = [sp.Function(f"q{k}")(t) for k in range(count)]
    ends = [0, *q, 0]
    equations = {}
    for k in range(count):
        force = sp.Integer(0)
        for other in (ends[k], ends[k + 2]):
            gap = other - q[k]
            force += gap + gap**3 / 10 + sp.Rational(1, 20) * sp.diff(gap, t)
        equations[q[k].diff(t, 2)] = force + (F * sp.cos(Omega * t) if k == 0 else 0)
    return st.System.from_equations(
        equations, coordinates=q, parameters={"Omega": 0.1, "F": 0.3}, period=2 * sp.pi / Omega
    )


def main(names):
    print("compilation and first solve, s:", end=" ")
    start = time.perf_counter()
    first = st.Collocation(duffing(0.001))
    first.start(first.system.parameter_vector())
    print(f"{time.perf_counter() - start:.2f} (warm disk cache unless this was the first run ever)")
    print(f"{'case':9} {'states':>6} | {'AUTO ms':>8} {'points':>6} {'ms/pt':>7} | {'ours ms':>8} {'points':>6} {'ms/pt':>7} | "
          f"{'run':>5} {'step':>5}  Newton it, linearise, spectrum in us")  # fmt: skip
    for name in names:
        make, window, intervals, degree, repeats = CASES[name]
        system = make()
        params = system.parameter_vector(Omega=window[0])
        problem = st.Collocation(system)
        orbit = problem.view(problem.start(params), params)
        auto = auto_run(system, orbit, "Omega", window, intervals, degree, repeats)
        for label, keywords in ((name, dict(adaptive=False)), (" default", None)):
            if keywords is None:
                mine = ours(system, "Omega", window, 20, 5, repeats)
            else:
                mine = ours(system, "Omega", window, intervals, degree, repeats, **keywords)
            costs = kernel_cost(system, *((20, 5) if keywords is None else (intervals, degree)), params)
            left = f"{'-':>8} {'-':>6} {'-':>7}"
            ratios = f"{'-':>5} {'-':>5}"
            if auto is not None:
                left = f"{auto[0] * 1e3:8.1f} {auto[1]:6d} {auto[0] / auto[1] * 1e3:7.3f}"
                ratios = f"{auto[0] / mine[0]:5.1f} {auto[0] / auto[1] / mine[0] * mine[1]:5.2f}"
            print(f"{label:9} {system.n:6d} | {left} | {mine[0] * 1e3:8.1f} {mine[1]:6d} {mine[0] / mine[1] * 1e3:7.3f} | "
                  f"{ratios}  {costs[0]:.0f} {costs[1]:.0f} {costs[2]:.0f}")  # fmt: skip
            print("          ours:", "  ".join(f"{s.label} {s.params['Omega']:.10f}" for s in mine[2].special))
        if auto is not None:
            kinds = {1: "BP", 2: "BP", 5: "LP", 6: "BP", 7: "PD", 8: "TR"}
            print("          AUTO:", "  ".join(f"{kinds[abs(k) % 10]} {x:.10f}" for k, x in auto[2]))


if __name__ == "__main__":
    main(sys.argv[1:] or list(CASES))
