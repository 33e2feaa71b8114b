r"""Normal forms with a known cubic coefficient, seen in nonlinear, mixed, possibly time-periodic coordinates.

    pair     z1' = a z1 - w z2 + (c r + e z3) z1,   z2' = a z2 + w z1 + (c r + e z3) z2,   z3' = -k z3 + m r,  r = z1^2 + z2^2
    single   z1' = a z1 + (c z1^2 + e z3) z1,       z2' = -z2 + g z1 z3,                   z3' = -k z3 + m z1^2

    takens   z1' = z2,                             z2' = a z1 + w z2 + c z1^3,         z3' = -k z3
    nilfold  z1' = z2,                             z2' = a + w z2 + z1^2,              z3' = -k z3
    folding  z1' = (a + z3) z1 + c z1^3,           z2' = -z2,                          z3' = m - z3^2

On the centre manifold of a = 0, z3 = (m / k) r + ..., so that the effective cubic coefficient is c + e m / k.
`planted`: x = A phi(y), phi = (y1, y2 + k1 y1^2, y3 + k2 y1 y2 + k3 y1^2), and

    "equilibrium"   y = z                           Hopf, pitchfork at x = 0
    "torus"         y = z + v cos(Omega t)          the same pair as a forced orbit: Neimark-Sacker point, angle w T
    "doubling"      (y1, y2) = R(Omega t / 2) (z1, z2) + v cos(Omega t): half a turn per period, multiplier -exp(a T)
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

import stability as st

NAMES = ("a", "w", "c", "e", "k", "m", "g", "k1", "k2", "k3", "v1", "v2", "v3", "Omega")


@functools.cache
def planted(form: str, frame: str) -> st.System:
    """The system of the module's head with every coefficient a parameter."""
    t = sp.Symbol("t", real=True)
    p = {name: sp.Symbol(name, real=True) for name in NAMES}
    A = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"A{i}{j}", real=True))
    B = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"B{i}{j}", real=True))  # its inverse
    x = sp.Matrix(sp.symbols("x1:4", real=True))
    y = sp.Matrix(sp.symbols("y1:4", real=True))
    phase = p["Omega"] * t
    shift = sp.Matrix([p["v1"], p["v2"], p["v3"]]) * sp.cos(phase) if frame != "equilibrium" else sp.zeros(3, 1)
    turn = sp.eye(3)
    if frame == "doubling":
        turn[:2, :2] = sp.Matrix([[sp.cos(phase / 2), -sp.sin(phase / 2)], [sp.sin(phase / 2), sp.cos(phase / 2)]])
    u = B * x
    u = sp.Matrix([u[0], u[1] - p["k1"] * u[0] ** 2, u[2]])
    u[2] = u[2] - p["k2"] * u[0] * u[1] - p["k3"] * u[0] ** 2
    z1, z2, z3 = turn.T * (u - shift)
    r = z1**2 + z2**2
    if form == "pair":
        growth = p["a"] + p["c"] * r + p["e"] * z3
        rates = sp.Matrix([growth * z1 - p["w"] * z2, growth * z2 + p["w"] * z1, -p["k"] * z3 + p["m"] * r])
    elif form == "takens":
        rates = sp.Matrix([z2, p["a"] * z1 + p["w"] * z2 + p["c"] * z1**3, -p["k"] * z3])
    elif form == "nilfold":
        rates = sp.Matrix([z2, p["a"] + p["w"] * z2 + z1**2, -p["k"] * z3])
    elif form == "folding":
        rates = sp.Matrix([(p["a"] + z3 + p["c"] * z1**2) * z1, -z2, p["m"] - z3**2])
    else:
        growth = p["a"] + p["c"] * z1**2 + p["e"] * z3
        rates = sp.Matrix([growth * z1, -z2 + p["g"] * z1 * z3, -p["k"] * z3 + p["m"] * z1**2])
    z = sp.Matrix([z1, z2, z3])
    velocity = turn * rates + turn.diff(t) * z + shift.diff(t)
    phi = sp.Matrix([y[0], y[1] + p["k1"] * y[0] ** 2, y[2] + p["k2"] * y[0] * y[1] + p["k3"] * y[0] ** 2])
    slope = phi.jacobian(y).subs(dict(zip(y, u)), simultaneous=True)
    rhs = tuple(A * slope * velocity)
    values = dict.fromkeys(NAMES, 0.0) | {"Omega": 1.0, "k": 1.0}
    values |= {str(s): float(i == j) for M in (A, B) for (i, j), s in zip(np.ndindex(3, 3), M)}
    names = tuple(str(s) for s in x)
    period = None if frame == "equilibrium" else 2 * sp.pi / p["Omega"]
    return st.System(
        name=f"{form} {frame}", coordinates=names, states=names, parameters=values, rhs=rhs, period_expression=period
    )


def random_values(seed: int) -> dict[str, float]:
    """Parameters of a random case at its critical point, a = 0."""
    rng = np.random.default_rng(seed)
    values = {name: rng.uniform(-0.6, 0.6) for name in ("g", "k1", "k2", "k3", "v1", "v2", "v3")}
    values |= {"a": 0.0, "w": rng.uniform(0.3, 2.0), "k": rng.uniform(0.3, 2.0), "Omega": rng.uniform(0.7, 1.5)}
    values |= {"c": rng.choice([-1, 1]) * rng.uniform(0.1, 1.0), "e": rng.uniform(-1, 1), "m": rng.uniform(-1, 1)}
    if abs(effective(values)) < 0.05:
        values["e"] = 0.0
    A = np.linalg.qr(rng.standard_normal((3, 3)))[0] * 10.0 ** rng.uniform(-1, 1, 3)[:, None]
    B = np.linalg.inv(A)
    for i, j in np.ndindex(3, 3):
        values |= {f"A{i}{j}": A[i, j], f"B{i}{j}": B[i, j]}
    return values


def effective(values: dict[str, float]) -> float:
    """c + e m / k."""
    return values["c"] + values["e"] * values["m"] / values["k"]


def matrix(values: dict[str, float]) -> np.ndarray:
    """A (3, 3)."""
    return np.array([[values[f"A{i}{j}"] for j in range(3)] for i in range(3)])


def orbit(values: dict[str, float]):
    """t -> (3, K), x(t) of the solution z = 0."""
    v = np.array([values["v1"], values["v2"], values["v3"]])

    def states(time):
        y = v[:, None] * np.cos(values["Omega"] * np.atleast_1d(time))
        bent = [y[0], y[1] + values["k1"] * y[0] ** 2, y[2] + values["k2"] * y[0] * y[1] + values["k3"] * y[0] ** 2]
        return matrix(values) @ np.array(bent)

    return states


def critical_vector(values: dict[str, float], form: str) -> np.ndarray:
    """q at phase zero in the states x, from q = e1 or (e1 - i e2)/sqrt 2 in z (whose turn at phase zero is none)."""
    y1, y2 = values["v1"], values["v2"]
    slope = np.array(
        [
            [1, 0, 0],
            [2 * values["k1"] * y1, 1, 0],
            [values["k2"] * y2 + 2 * values["k3"] * y1, values["k2"] * y1, 1],
        ]
    )
    q = np.array([1, 0, 0]) if form == "single" else np.array([1, -1j, 0]) / np.sqrt(2)
    return matrix(values) @ slope @ q
