r"""Fixed points of maps with planted bifurcations: what orbits are to a stroboscopic map, without any orbit.

    z1 -> z1 + sigma (lambda - g(z1))                       fold at r1, r2 (g as in planted_equilibria)
    z2 -> -(1 + beta) z2 + q z2^3,  beta = (z1 - b1)(ba + bb (z1 - b2))            period doubling
    (z3, z4) -> (1 + alpha - |.|^2) R(theta) (z3, z4),  alpha = (z1 - h1)(ha + hb (z1 - h2))     Neimark-Sacker

seen in the nonlinear coordinates of planted_equilibria. The driver gets F(y) = G(y) - y and the multipliers of DG: an
`Equilibrium` of F whose spectral matrix is its Jacobian plus one. The planted neutral saddles (two real multipliers of
product one) must not be called Neimark-Sacker points.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp
from planted_equilibria import NORMAL, SHEAR, Case, N

import stability as st
from stability.problems.equilibrium_linearisation import DenseLinearisation
from stability.problems.orbit_spectrum import eigenvalues, orbit_spectrum
from stability.protocols import Critical, Spectrum


@dataclass(frozen=True, eq=False)
class MapLinearisation(DenseLinearisation):
    """M = DG = DF + 1; the core is DF."""

    @property
    def core(self) -> np.ndarray:
        s = self.problem.scales
        return self.J * s / s[:, None]

    @property
    def spectral(self) -> np.ndarray:
        return self.core + np.eye(self.F.size)


@dataclass(frozen=True, eq=False)
class MapFixedPoint(st.Equilibrium):
    """G(y) = y as an equilibrium of G(y) - y with multipliers."""

    @property
    def critical(self) -> Critical:
        return Critical(circle=True, pair=st.Kind.NEIMARK_SACKER, minus=-1.0)

    def _linearisation(self, *arrays: Any) -> MapLinearisation:
        return MapLinearisation(self, *arrays)

    def spectrum(self, linearisation: Any) -> Spectrum:
        return orbit_spectrum(eigenvalues(linearisation.spectral), 1e-13)


@functools.cache
def planted_map() -> st.System:
    """The map of the module's head, minus the identity, with every coefficient a parameter."""
    y = sp.symbols("y1:5", real=True)
    p = {name: sp.Symbol(name, real=True) for name in (*NORMAL, *SHEAR)}
    A = sp.Matrix(N, N, lambda i, j: sp.Symbol(f"A{i}{j}", real=True))
    B = sp.Matrix(N, N, lambda i, j: sp.Symbol(f"B{i}{j}", real=True))
    w = B * sp.Matrix(y)
    z1, z2 = w[0], w[1] - p["k1"] * w[0] ** 2
    z3 = w[2] - p["k2"] * z1 * z2
    z4 = w[3] - p["k3"] * z1 * z3 - p["k4"] * z2**2
    g = p["c"] * (z1**3 / 3 - (p["r1"] + p["r2"]) * z1**2 / 2 + p["r1"] * p["r2"] * z1) + p["l"] * z1
    alpha = (z1 - p["h1"]) * (p["ha"] + p["hb"] * (z1 - p["h2"]))
    beta = (z1 - p["b1"]) * (p["ba"] + p["bb"] * (z1 - p["b2"]))
    rho = 1 + alpha - z3**2 - z4**2
    co, si = sp.cos(p["omega"]), sp.sin(p["omega"])
    m = (
        z1 + p["sigma"] * (p["lam"] - g),
        -(1 + beta) * z2 + p["q3"] * z2**3,
        rho * (co * z3 - si * z4),
        rho * (si * z3 + co * z4),
    )
    mapped = (m[0], m[1] + p["k1"] * m[0] ** 2, m[2] + p["k2"] * m[0] * m[1], m[3] + p["k3"] * m[0] * m[2])
    image = A * sp.Matrix([*mapped[:3], mapped[3] + p["k4"] * m[1] ** 2])
    values = dict.fromkeys((*NORMAL, *SHEAR), 0.0)
    values |= {str(s): float(i == j) for M in (A, B) for (i, j), s in zip(np.ndindex(N, N), M)}
    names = tuple(str(s) for s in y)
    rhs = tuple(image[k] - y[k] for k in range(N))
    return st.System(name="planted map", coordinates=names, states=names, parameters=values, rhs=rhs)


def random_map(seed: int) -> Case:
    """A planted branch of fixed points with its exact events."""
    rng = np.random.default_rng(10_000 + seed)
    p = dict.fromkeys((*NORMAL, *SHEAR), 0.0)
    p["sigma"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.1)
    places: list[float] = []

    def place() -> float:
        while True:
            x = rng.uniform(-0.9, 0.9)
            if places and rng.random() < 0.3:
                x = places[-1] + rng.choice([-1, 1]) * 10 ** rng.uniform(-3.5, -1)
            if abs(x) < 0.95 and all(abs(x - o) > 3e-4 for o in places):
                places.append(x)
                return x

    kinds: list[tuple[str, float]] = []
    if rng.random() < 0.6:
        p["c"], p["r1"], p["r2"] = rng.uniform(0.5, 2), place(), place()
        kinds += [("LP", p["r1"]), ("LP", p["r2"])]
    else:
        p["l"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2)
    p["omega"] = rng.uniform(0.4, 2.7)
    for label, one, two, a, b, size in (("NS", "h1", "h2", "ha", "hb", 0.2), ("PD", "b1", "b2", "ba", "bb", 0.3)):
        p[one] = place()
        kinds.append((label, p[one]))
        p[a] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5) * size
        if rng.random() < 0.4:
            p[two] = place()
            kinds.append((label, p[two]))
            p[a], p[b] = 0.0, p[a]
        if p["c"]:  # the branch reaches further out: keep the values from meeting other limits there
            p[a], p[b] = 0.3 * p[a], 0.3 * p[b]
    p["q3"] = rng.choice([-1.0, 1.0])
    for name in SHEAR:
        p[name] = rng.uniform(-0.4, 0.4)
    Q = np.linalg.qr(rng.standard_normal((N, N)))[0]
    p |= {f"A{i}{j}": Q[i, j] for i in range(N) for j in range(N)}
    p |= {f"B{i}{j}": Q[j, i] for i in range(N) for j in range(N)}
    case = Case(p, (0.0, 1.0), np.zeros(N))
    ends = (-2.0, 2.0) if p["c"] else (-1.1, 1.1)
    case.window = (case.g(ends[0]), case.g(ends[1]))
    z = ends[0]
    case.start = Q @ np.array([z, p["k1"] * z**2, 0.0, 0.0])
    low, high = min(case.window), max(case.window)
    kinds.sort(key=lambda item: item[1])
    case.expected = [(k, case.g(v)) for k, v in kinds]
    assert all(low < v < high for _, v in case.expected)
    return case


def followed_map(case: Case) -> st.Branch:
    """The branch of a case."""
    problem = MapFixedPoint(planted_map().with_params(**case.params))
    return st.continuation(problem, "lam", case.window, start=case.start)
