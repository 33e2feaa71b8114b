"""Beyond a resonance 1:1 or a Bogdanov-Takens point a curve of pairs goes on with real values: no border of stability.

Witnesses: the planar system x' = y, y' = b1 + b2 x + x^2 - x y has its Hopf points on b1 = 0, b2 < 0 (at x = 0, omega^2 = -b2)
and saddles with eigenvalues +-sqrt(b2) on b1 = 0, b2 > 0; the forced oscillator of van der Pol has real multipliers
r, 1/r on the neutral part (equal determinant, trace beyond 2), by the multipliers of the inner orbit itself.
"""

import numpy as np
import sympy as sp

import stability as st

T = sp.Symbol("t")


def test_hopf_curve_through_bogdanov_takens():
    x, y = sp.Function("x")(T), sp.Function("y")(T)
    b1, b2 = sp.symbols("b1 b2")
    system = st.System.from_equations(
        [sp.Eq(x.diff(T), y), sp.Eq(y.diff(T), b1 + b2 * x + x**2 - x * y)], [x, y], parameters=dict(b1=-0.1, b2=-0.5)
    )
    branch = st.continuation(st.Equilibrium(system), "b1", (-0.2, 0.5), start=dict(x=-0.3))
    curve = st.continuation(st.locus(branch["HB1"], free="b1", along="b2"), "b2", (-1, 1))
    assert abs(curve["BT1"].params["b2"]) < 1e-8
    for place, verdict in zip(curve.parameter, curve.verdicts, strict=True):
        if abs(place) > 1e-6:
            assert verdict is (st.Verdict.STABLE if place < 0 else st.Verdict.UNSTABLE), place


def test_torus_curve_between_two_resonances():
    x = sp.Function("x")(T)
    mu, F, w = sp.symbols("mu F w")
    system = st.System.from_equations(
        {x.diff(T, 2): mu * (1 - x**2) * x.diff(T) - x + F * sp.cos(w * T)}, [x], parameters=dict(mu=0.3, F=0.5, w=1.0)
    )
    branch = st.continuation(st.Collocation(system), "w", (0.6, 1.6))
    curve = st.continuation(st.locus(branch["NS2"], free="F"), "w", (0.85, 1.2))
    ends = sorted(curve[label].params["w"] for label in ("R1_1", "R1_2"))
    neutral = 0
    for k, (place, verdict) in enumerate(zip(curve.parameter, curve.verdicts, strict=True)):
        values = curve.solution(k).multipliers
        if ends[0] + 1e-6 < place < ends[1] - 1e-6:
            neutral += 1
            assert verdict is st.Verdict.UNSTABLE
            assert np.abs(values.imag).max() == 0 and np.abs(values).max() > 1
        elif place < ends[0] - 1e-6 or place > ends[1] + 1e-6:
            assert verdict is st.Verdict.STABLE
            assert np.abs(np.abs(values) - 1).max() < 1e-8
    assert neutral >= 3
    assert not [p for p in curve.special if p.kind is st.Kind.EXTREMUM and ends[0] < p.params["w"] < ends[1]]
