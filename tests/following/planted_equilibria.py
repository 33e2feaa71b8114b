r"""Equilibria with planted bifurcations: normal forms in nonlinear, mixed and rescaled coordinates, compiled once.

    z1' = sigma (lambda - g(z1)),           g = c (z^3/3 - (r1 + r2) z^2/2 + r1 r2 z) + l z    folds at r1, r2
    (z2, z3)' = alpha (z2, z3) + omega (-z3, z2) - (z2^2 + z3^2)(z2, z3),   alpha = (z1 - h1)(ha + hb (z1 - h2))   Hopf
    z4' = beta z4 - q2 z4^2 - q3 z4^3,       beta = (z1 - b1)(ba + bb (z1 - b2))         transcritical or pitchfork

seen in y = A phi(z) with the polynomial shear phi = (z1, z2 + k1 z1^2, z3 + k2 z1 z2, z4 + k3 z1 z3 + k4 z2^2), whose
inverse is a polynomial too. The branch z2 = z3 = z4 = 0, lambda = g(z1) has its bifurcations exactly where planted.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

import stability as st

N = 4
NORMAL = ("lam", "sigma", "c", "r1", "r2", "l", "h1", "h2", "ha", "hb", "omega", "b1", "b2", "ba", "bb", "q2", "q3")
SHEAR = ("k1", "k2", "k3", "k4")


@functools.cache
def planted_system() -> st.System:
    """The system of the module's head with every coefficient a parameter."""
    y = sp.symbols("y1:5", real=True)
    p = {name: sp.Symbol(name, real=True) for name in (*NORMAL, *SHEAR)}
    A = sp.Matrix(N, N, lambda i, j: sp.Symbol(f"A{i}{j}", real=True))
    B = sp.Matrix(N, N, lambda i, j: sp.Symbol(f"B{i}{j}", real=True))
    w = B * sp.Matrix(y)
    z1 = w[0]
    z2 = w[1] - p["k1"] * z1**2
    z3 = w[2] - p["k2"] * z1 * z2
    z4 = w[3] - p["k3"] * z1 * z3 - p["k4"] * z2**2
    g = p["c"] * (z1**3 / 3 - (p["r1"] + p["r2"]) * z1**2 / 2 + p["r1"] * p["r2"] * z1) + p["l"] * z1
    alpha = (z1 - p["h1"]) * (p["ha"] + p["hb"] * (z1 - p["h2"]))
    beta = (z1 - p["b1"]) * (p["ba"] + p["bb"] * (z1 - p["b2"]))
    r = z2**2 + z3**2
    f = [
        p["sigma"] * (p["lam"] - g),
        alpha * z2 - p["omega"] * z3 - r * z2,
        p["omega"] * z2 + alpha * z3 - r * z3,
        beta * z4 - p["q2"] * z4**2 - p["q3"] * z4**3,
    ]
    d = [
        f[0],
        f[1] + 2 * p["k1"] * z1 * f[0],
        f[2] + p["k2"] * (f[0] * z2 + z1 * f[1]),
        f[3] + p["k3"] * (f[0] * z3 + z1 * f[2]) + 2 * p["k4"] * z2 * f[1],
    ]
    rhs = tuple(A * sp.Matrix(d))
    values = dict.fromkeys((*NORMAL, *SHEAR), 0.0)
    values |= {str(s): float(i == j) for M in (A, B) for (i, j), s in zip(np.ndindex(N, N), M)}
    names = tuple(str(s) for s in y)
    return st.System(name="planted", coordinates=names, states=names, parameters=values, rhs=rhs)


@dataclass
class Case:
    """One random planted branch: parameter values, window, start and the exact events in the order of the branch."""

    params: dict[str, float]
    window: tuple[float, float]
    start: np.ndarray
    expected: list[tuple[str, float]] = field(default_factory=list)

    def g(self, z: float) -> float:
        p = self.params
        cubic = z**3 / 3 - (p["r1"] + p["r2"]) * z**2 / 2 + p["r1"] * p["r2"] * z
        return p["c"] * cubic + p["l"] * z


def random_case(seed: int, scales: float = 0.0) -> Case:
    """A planted branch; `scales` > 0 spreads the variables over 10^-scales .. 10^scales."""
    rng = np.random.default_rng(seed)
    p = dict.fromkeys((*NORMAL, *SHEAR), 0.0)
    p["sigma"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2)
    places: list[float] = []

    def place() -> float:
        """A new place on (-0.9, 0.9), sometimes close to an old one, never nearer than 3e-4."""
        while True:
            x = rng.uniform(-0.9, 0.9)
            if places and rng.random() < 0.3:
                x = places[-1] + rng.choice([-1, 1]) * 10 ** rng.uniform(-3.5, -1)
            if abs(x) < 0.95 and all(abs(x - o) > 3e-4 for o in places):
                places.append(x)
                return x

    kinds: list[tuple[str, float]] = []
    if rng.random() < 0.6:
        p["c"], p["r1"], p["r2"] = rng.uniform(0.5, 3), place(), place()
        kinds += [("LP", p["r1"]), ("LP", p["r2"])]
    else:
        p["l"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2)
    p["omega"] = rng.uniform(0.3, 3)
    p["h1"] = place()
    kinds.append(("HB", p["h1"]))
    p["ha"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2)
    if rng.random() < 0.4:
        p["h2"] = place()
        p["ha"], p["hb"] = 0.0, rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2)
        kinds.append(("HB", p["h2"]))
    p["b1"] = place()
    kinds.append(("BP", p["b1"]))
    p["ba"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2)
    if rng.random() < 0.4:
        p["b2"] = place()
        p["ba"], p["bb"] = 0.0, rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2)
        kinds.append(("BP", p["b2"]))
    # between two transcritical points the other branch is bb (b1 - b2)^2 / (4 q2) away: closer than 1e-5 of the scale
    # the two curves are one to any corrector, so close pairs of branch points are pitchforks
    apart = p["bb"] == 0 or abs(p["b1"] - p["b2"]) > 0.02
    transcritical = apart and rng.random() < 0.5
    p["q2"], p["q3"] = (rng.uniform(0.5, 2), 0.0) if transcritical else (0.0, rng.choice([-1.0, 1.0]))
    for name in SHEAR:
        p[name] = rng.uniform(-0.5, 0.5)
    Q = np.linalg.qr(rng.standard_normal((N, N)))[0]
    S = 10.0 ** rng.uniform(-scales, scales, N) if scales else np.ones(N)
    A, B = S[:, None] * Q, Q.T / S
    p |= {f"A{i}{j}": A[i, j] for i in range(N) for j in range(N)}
    p |= {f"B{i}{j}": B[i, j] for i in range(N) for j in range(N)}
    case = Case(p, (0.0, 1.0), np.zeros(N))
    zs, ze = (-2.5, 2.5) if p["c"] else (-1.1, 1.1)
    w = np.array([zs, p["k1"] * zs**2, 0.0, 0.0])
    case.window, case.start = (case.g(zs), case.g(ze)), A @ w
    case.expected = [(k, case.g(z)) for k, z in sorted(kinds, key=lambda item: item[1])]
    return case


def followed(case: Case, **options: object) -> st.Branch:
    """The branch of a case."""
    system = planted_system().with_params(**case.params)
    return st.continuation(st.Equilibrium(system), "lam", case.window, start=case.start, **options)
