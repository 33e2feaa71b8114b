"""Hard excitation: averaged sub- and superharmonics and static loads. Witness: shooting by DOP853, two orders of eps."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from exact_orbits import observed_orders, periodic_orbit

import stability as st

t = sp.Symbol("t")
x = sp.Function("x", real=True)(t)
e, w, F, b, c = sp.symbols("e w F b c", real=True)

HARD = {
    "3:1 subharmonic": ((3, 1), 3, [1.5, 0.0], lambda v: dict(e=v, b=0.05 * v, F=4.0, c=0.0, w=3 * (1 + 1.25 * v))),
    "1:3 superharmonic": ((1, 3), 1, [0.5, 0.0], lambda v: dict(e=v, b=0.3 * v, F=1.0, c=0.0, w=(1 + 0.6 * v) / 3)),
    "static load": ((1, 1), 1, [0.5, 0.0], lambda v: dict(e=v, b=0.3 * v, F=0.5 * v, c=0.7, w=1 + 1.2 * v)),
}


@pytest.mark.parametrize("name", HARD)
def test_hard_excitation(name):
    """Forcing of order 0 away from resonance, dynamic or static, moves the oscillator by h(t) of order 0: the response
    of x'' + x + e x^3 + b x' + c = F cos w t against shooting, error O(eps) to order 1 and O(eps^2) to order 2."""
    resonance, periods, start, values = HARD[name]
    small = (0.02, 0.01)
    errors = {1: [], 2: []}
    for v in small:
        p = values(v)
        system = st.System.from_equations(
            {x.diff(t, 2): -x - e * x**3 - b * x.diff(t) - c + F * sp.cos(w * t)}, [x], parameters=p
        )
        scaled = ("e", "b", "F") if name == "static load" else ("e", "b")

        def field(s, q, p=p):
            return [q[1], p["F"] * math.cos(p["w"] * s) - q[0] - p["e"] * q[0] ** 3 - p["b"] * q[1] - p["c"]]

        point = start
        for order, found in errors.items():
            slow = st.averaging(system, small=scaled, resonance=resonance, order=order)
            point = st.solve(st.Equilibrium(slow), start=np.array(getattr(point, "x", point)))
            assert math.hypot(*point.x) > 0.3  # not the forced motion alone
            times = periods * system.period * np.arange(32) / 32
            mine = st.reconstruct(slow, point, times)
            _, rows = periodic_orbit(field, periods * system.period, mine[:, 0], samples=32)
            found.append(np.abs(mine - rows).max())
    assert observed_orders(errors[1], small)[-1] > 0.85
    assert observed_orders(errors[2], small)[-1] > 1.75
