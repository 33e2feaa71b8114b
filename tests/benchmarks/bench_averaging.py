"""Time of symbolic averaging, in one run: budgets 1 s (one degree of freedom, order 1) and 5 s (pendulum at 2:1).

The peer is the definition itself, done with sympy: substitute, expand, integrate over the fast phase. The equations have
to agree. Run ``python tests/benchmarks/bench_averaging.py``.
"""

from __future__ import annotations

import sys
import time

import sympy as sp

import stability as st

CASES = [
    ("duffing", st.models.duffing, (1, 1), 1),
    ("duffing", st.models.duffing, (1, 1), 2),
    ("duffing_mathieu", st.models.duffing_mathieu, (2, 1), 1),
    ("autoparametric_quadratic", st.models.autoparametric_quadratic, (2, 1), 1),
    ("autoparametric_pendulum", st.models.autoparametric_pendulum, (2, 1), 1),
    ("autoparametric_pendulum", st.models.autoparametric_pendulum, (2, 1), 2),
]


def by_integration(system: st.System) -> list[sp.Expr]:
    """The average of the standard form by sympy's integrate, one degree of freedom at 1:1."""
    t = sp.Symbol("t", real=True)
    phase = sp.Symbol("phase", real=True)
    (c,) = system.coordinates
    u, v = (sp.Symbol(f"{c}_{end}", real=True) for end in ("cos", "sin"))
    nu = 2 * sp.pi / system.period_expression
    q = u * sp.cos(phase) + v * sp.sin(phase)
    moved = {sp.Symbol(c, real=True): q, sp.Symbol(f"{c}_dot", real=True): nu * sp.diff(q, phase), t: phase / nu}
    g = sp.expand(system.rhs[1].subs(moved) + nu**2 * q)
    return [
        -sp.integrate(sp.expand(g * sp.sin(phase)), (phase, 0, 2 * sp.pi)) / (2 * sp.pi * nu),
        sp.integrate(sp.expand(g * sp.cos(phase)), (phase, 0, 2 * sp.pi)) / (2 * sp.pi * nu),
    ]


def main() -> None:
    out = sys.stdout
    st.averaging(st.models.van_der_pol())  # imports are not averaging
    for name, model, resonance, order in CASES:
        system = model()
        start = time.perf_counter()
        st.averaging(system, resonance=resonance, order=order)
        out.write(f"{name:26s} {resonance[0]}:{resonance[1]} order {order}: {time.perf_counter() - start:7.3f} s\n")
    system = st.models.duffing()
    start = time.perf_counter()
    mine = st.averaging(system, resonance=(1, 1)).rhs
    ours = time.perf_counter() - start
    start = time.perf_counter()
    theirs = by_integration(system)
    peer = time.perf_counter() - start
    agree = all(sp.simplify(a - b) == 0 for a, b in zip(mine, theirs))
    out.write(f"duffing by sympy.integrate: {peer:.2f} s, {peer / ours:.0f} times as long; equations agree: {agree}\n")


if __name__ == "__main__":
    main()
