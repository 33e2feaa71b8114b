"""Whole branches of periodic orbits beside AUTO-07p: same mesh (NTST, NCOL), tolerance, window, special points.

Run:  python tests/benchmarks/bench_continuation.py [duffing fold pendulum chain peak cold]

AUTO (the Debian package auto-07p) gets the equations as generated C code with analytic derivatives, and the forcing as
its usual oscillator of two more states. Both sides run on one thread, in turns; times are processor times, the least
of several runs; AUTO's include reading constants and writing its files, ours the whole of `continuation` in a running
interpreter (cold starts are lines of their own). Ratios are what counts: of whole runs and per accepted point.

Three comparisons: equal mesh, degree and tolerance (AUTO at the usual DSMAX and at the best one that finds the same
points; we with our own steps, and with as many as AUTO takes); then equal delivered accuracy, every special point to
1e-9 against a converged reference, each side with the cheapest settings of a grid that deliver it.
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
import warnings
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import sympy as sp

import stability as st
from stability.errors import StabilityWarning

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


@contextmanager
def auto_program(system, orbit, Omega):
    """A function (window, NTST, NCOL, DSMAX, EPS) -> (seconds, points, special values) of AUTO; None without AUTO."""
    home = auto_directory()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        executable = None if home is None else auto_executable(folder, auto_source(system, orbit, Omega), home)
        if executable is None:
            yield None
            return
        n, index = len(system.states) + 2, list(system.parameters).index(Omega) + 1

        def run(window, intervals, degree, ds_max=0.2, eps=1e-8):
            lo, hi, sign = min(window), max(window), 1 if window[1] > window[0] else -1
            constants = (
                f"NDIM={n}, IPS=2, IRS=0, ILP=1, ISP=2, ISW=1, ICP=[{index},11]\nNTST={intervals}, NCOL={degree}, IAD=3\n"
                f"NMX=20000, RL0={lo - 1e-3}, RL1={hi + 1e-3}, NPR=100000, MXBF=0, IID=0, ITMX=8, ITNW=7, NWTN=3, JAC=1\n"
                f"IPLT=0, EPSL={eps}, EPSU={eps}, EPSS={10 * eps}, DS={sign * 0.01}, DSMIN=1e-6, DSMAX={ds_max}, IADS=1\n"
            )
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([executable], cwd=folder, input=constants, text=True, capture_output=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            rows = [r.split() for r in (folder / "fort.7").read_text().splitlines()]
            rows = [r for r in rows if r and r[0] != "0"]
            special = [(_AUTO_KINDS[int(r[2]) % 10], float(r[4])) for r in rows if int(r[2]) % 10 in _AUTO_KINDS]
            return after.ru_utime - before.ru_utime, max((abs(int(r[1])) for r in rows), default=0), special

        yield run


_AUTO_KINDS = {1: "BP", 2: "BP", 5: "LP", 6: "BP", 7: "PD", 8: "TR"}


# ---------------------------------------------------------------------- ours
def our_run(system, Omega, window, intervals, degree, ds_max=None, tolerance=1e-8, **keywords):
    """(processor seconds, points, special values) of one branch."""
    problem = st.Collocation(system, degree=degree, intervals=intervals, **keywords)
    start = time.process_time()
    branch = st.continuation(problem, Omega, window, ds_max=ds_max, tolerance=tolerance)
    seconds = time.process_time() - start
    return seconds, len(branch), [(s.kind.label, s.params[Omega]) for s in branch.special]


def least(calls, repeats):
    """The least time of each call, interleaved, with the rest of its answer; a call may be None."""
    best = [None] * len(calls)
    for _ in range(repeats):
        for k, call in enumerate(calls):
            got = None if call is None else call()
            if got is not None and (best[k] is None or got[0] < best[k][0]):
                best[k] = got
    return best


def agree(special, wanted, error=1e-6):
    """Whether the special points are those wanted, by kind and to `error` in the parameter."""
    one, other = sorted(special, key=lambda s: s[1]), sorted(wanted, key=lambda s: s[1])
    return len(one) == len(other) and all(a[0] == b[0] and abs(a[1] - b[1]) <= error for a, b in zip(one, other))


def worst(special, wanted):
    """Largest difference of the special values."""
    return max((abs(a[1] - b[1]) for a, b in zip(sorted(special, key=lambda s: s[1]), sorted(wanted, key=lambda s: s[1]))),
               default=0.0)  # fmt: skip


# ---------------------------------------------------------------------- the tables
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


CASES = {  # system, window, NTST, NCOL, repeats
    "duffing": (lambda: st.models.duffing(xi=0.02, beta=0.001), (0.3, 3.0), 50, 4, 9),
    "fold": (lambda: st.models.duffing(xi=0.02, beta=0.05), (3.0, 0.3), 50, 4, 9),
    "pendulum": (lambda: st.models.autoparametric_pendulum(), (0.7, 1.3), 50, 4, 5),
    "chain": (lambda: hardening_chain(10), (0.05, 0.25), 50, 4, 2),
    "peak": (lambda: hardening_chain(10), (0.25, 0.34), 50, 4, 2),
}
DS_MAX = (0.2, 0.5, 1.0, 2.0)
ACCURACY = 1e-9


def line(label, n, auto, mine):
    left, ratios = f"{'-':>8} {'-':>6} {'-':>7}", f"{'-':>6} {'-':>6}"
    if auto is not None:
        left = f"{auto[0] * 1e3:8.1f} {auto[1]:6d} {auto[0] / auto[1] * 1e3:7.3f}"
        ratios = f"{auto[0] / mine[0]:6.2f} {auto[0] / auto[1] / mine[0] * mine[1]:6.2f}"
    print(f"{label:34} {n:3d} | {left} | {mine[0] * 1e3:8.1f} {mine[1]:6d} {mine[0] / mine[1] * 1e3:7.3f} | {ratios}")


def equal_settings(name, system, auto, window, intervals, degree, repeats):
    """Same NTST, NCOL and tolerance; AUTO with its usual DSMAX and with the best one, we with our own steps and as many."""
    ours = partial(our_run, system, "Omega", window, intervals, degree, adaptive=False)
    wanted = ours()[2]
    runs = [None if auto is None else partial(auto, window, intervals, degree, ds) for ds in DS_MAX]
    *theirs, mine, default = least([*runs, ours, partial(our_run, system, "Omega", window, 20, 5)], repeats)
    line(f"{name}: AUTO at DSMAX {DS_MAX[0]}", system.n, theirs[0], mine)
    good = [(got, ds) for got, ds in zip(theirs, DS_MAX) if got is not None and agree(got[2], wanted)]
    if good:
        fastest, ds = min(good, key=lambda pair: pair[0][0])
        line(f"{name}: AUTO at its best DSMAX {ds}", system.n, fastest, mine)
        line(f"{name}: that, and our default mesh", system.n, fastest, default)
        ds_max = 0.2
        for _ in range(20):
            if ours(ds_max=ds_max)[1] >= 0.9 * fastest[1]:
                break
            ds_max *= 0.8
        many = least([partial(ours, ds_max=ds_max), runs[DS_MAX.index(ds)]], repeats)
        line(f"{name}: that, and as many steps as it", system.n, many[1], many[0])
    print(f"{'':34} ours", *(f"{kind} {value:.10f}" for kind, value in mine[2]))
    if theirs[0] is not None:
        print(f"{'':34} AUTO", *(f"{kind} {value:.10f}" for kind, value in theirs[0][2]))


def equal_accuracy(name, system, auto, window, repeats):
    """The cheapest settings of either side that give every special point to ACCURACY, and our defaults.

    AUTO's among all, and among those with its usual DSMAX: which longer steps find the same points is known afterwards.
    """
    reference = our_run(system, "Omega", window, 60 if system.n < 10 else 40, 7, tolerance=1e-11, adaptive=False)[2]
    if not reference:
        return
    meshes = [(N, m) for m in (4, 5, 6, 7) for N in (10, 14, 20, 28, 40, 57, 80)]

    def cheapest(run, choices):
        """(seconds, settings) of the fastest run that is good enough; for each degree the coarsest good mesh."""
        best, done = None, set()
        for choice in choices:
            if choice[1:] in done:
                continue
            got = run(*choice)
            if agree(got[2], reference, ACCURACY):
                done.add(choice[1:])
                best = min(best, (got[0], choice)) if best else (got[0], choice)
        return best

    mine = cheapest(lambda N, m: our_run(system, "Omega", window, N, m, adaptive=False), meshes)
    settings = [(N, m, ds, eps) for m in (4, 5, 7) for ds in DS_MAX for eps in (1e-7, 1e-9) for N in (20, 28, 40, 57, 80)]
    if auto is not None and system.n > 4:  # seconds a run: only what the smaller cases chose
        settings = [(N, m, ds, 1e-9) for m in (4, 5) for ds in (0.5, 2.0) for N in (20, 28, 40, 57)]
    theirs = usual = None
    if auto is not None:
        theirs = cheapest(lambda N, m, ds, eps: auto(window, N, m, ds, eps), settings)
        bounded = dict.fromkeys((N, m, DS_MAX[0], eps) for N, m, _, eps in settings)
        usual = cheapest(lambda N, m, ds, eps: auto(window, N, m, ds, eps), bounded)
    calls = [
        None if usual is None else partial(auto, window, *usual[1]),
        None if theirs is None else partial(auto, window, *theirs[1]),
        None if mine is None else partial(our_run, system, "Omega", window, *mine[1], adaptive=False),
        partial(our_run, system, "Omega", window, 20, 5),
    ]
    their_usual, their_best, our_best, default = least(calls, repeats)
    if our_best is not None:
        line(f"{name}: to {ACCURACY:g}, AUTO at DSMAX {DS_MAX[0]}", system.n, their_usual, our_best)
        line(f"{name}: special points to {ACCURACY:g}", system.n, their_best, our_best)
    line(f"{name}: that, and our defaults", system.n, their_best, default)
    print(f"{'':34} AUTO (NTST, NCOL, DSMAX, EPS) {theirs and theirs[1]} error {their_best and worst(their_best[2], reference):.0e};"
          f" ours {mine and mine[1]} error {our_best and worst(our_best[2], reference):.0e}, defaults error "
          f"{worst(default[2], reference):.0e}")  # fmt: skip


COLD = """
import time; start = time.process_time()
import stability as st
from stability.errors import StabilityWarning
branch = st.continuation(st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.3, 3.0))
print(time.process_time() - start)
"""


def cold():
    """Seconds of a first branch in a new process: nothing on disk, kernels on disk; AUTO's compiler, linker and run."""
    with tempfile.TemporaryDirectory() as name:
        environment = {**os.environ, "NUMBA_CACHE_DIR": name}
        for what in ("kernels to be compiled first", "kernels on disk"):
            done = subprocess.run([sys.executable, "-c", COLD], env=environment, capture_output=True, text=True)
            print(f"cold, {what}: {float(done.stdout):.2f} s")
    system = st.models.duffing(xi=0.02, beta=0.001)
    problem, params = st.Collocation(system), system.parameter_vector(Omega=0.3)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with auto_program(system, problem.view(problem.start(params), params), "Omega") as auto:
        if auto is not None:
            auto((0.3, 3.0), 50, 4)
            print(f"cold, AUTO: {resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before:.2f} s")


def main(names):
    print(f"{'case':34}   n | {'AUTO ms':>8} {'points':>6} {'ms/pt':>7} | {'ours ms':>8} {'points':>6} {'ms/pt':>7} | "
          f"{'run':>6} {'step':>6}   (AUTO over ours)")  # fmt: skip
    for name in names:
        if name == "cold":
            cold()
            continue
        make, window, intervals, degree, repeats = CASES[name]
        system = make()
        params = system.parameter_vector(Omega=window[0])
        problem = st.Collocation(system)
        with auto_program(system, problem.view(problem.start(params), params), "Omega") as auto:
            equal_settings(name, system, auto, window, intervals, degree, repeats)
            equal_accuracy(name, system, auto, window, repeats)


if __name__ == "__main__":
    warnings.simplefilter("ignore", StabilityWarning)
    main(sys.argv[1:] or [*CASES, "cold"])
