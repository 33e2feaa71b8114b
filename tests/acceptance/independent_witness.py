"""Witnesses of the independent acceptance tests: orbits and their special points by scipy alone.

Nothing here imports the library. A right-hand side is f(t, x, lam) with the Jacobian J(t, x, lam), the forcing period
T(lam); the flow with its variational equation M' = J M, M(0) = I is integrated by DOP853, and a special point is the root
of (x(T) - x(0), condition(M)) = 0 by a hybrid Powell method.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root


def flow(f, jacobian, x0, duration, rtol=1e-11, atol=1e-12):
    """(x(t), M(t)) after a duration, starting at t = 0."""
    n = len(x0)

    def both(t, y):
        x, matrix = y[:n], y[n:].reshape(n, n)
        return np.concatenate([f(t, x), (jacobian(t, x) @ matrix).ravel()])

    start = np.concatenate([x0, np.eye(n).ravel()])
    end = solve_ivp(both, (0.0, duration), start, method="DOP853", rtol=rtol, atol=atol).y[:, -1]
    return end[:n], end[n:].reshape(n, n)


def polish(f, jacobian, x0, period, steps=6):
    """The periodic orbit near x0 by Newton's method, and its monodromy matrix."""
    x = np.array(x0, float)
    for _ in range(steps):
        y, matrix = flow(f, jacobian, x, period)
        change = np.linalg.solve(matrix - np.eye(len(x)), x - y)
        x = x + change
        if abs(change).max() < 1e-11 * (1 + abs(x).max()):
            break
    return x, flow(f, jacobian, x, period)[1]


def at(model, value):
    """(f(t, x), J(t, x)) of (f, J, T) at one value of lam."""
    f, jacobian, _ = model
    return (lambda t, x: f(t, x, value)), (lambda t, x: jacobian(t, x, value))


def locate(model, x0, lam, condition):
    """The value of lam near the given one at which an orbit near x0 fulfils condition(M) = 0."""
    n, period = len(x0), model[2]

    def equations(z):
        x, value = z[:n], z[n]
        y, matrix = flow(*at(model, value), x, period(value))
        return np.append(y - x, condition(matrix))

    found = root(equations, np.append(x0, lam), method="hybr", options=dict(xtol=1e-13, eps=1e-7))
    assert abs(found.fun).max() < 1e-8
    return found.x[n]


def fold(matrix):
    """Zero where a multiplier is +1."""
    return np.linalg.det(matrix - np.eye(len(matrix)))


def doubling(matrix):
    """Zero where a multiplier is -1."""
    return np.linalg.det(matrix + np.eye(len(matrix)))


def torus(matrix):
    """Zero where the multipliers of a system of two states have the product 1."""
    return np.linalg.det(matrix) - 1.0


CONDITIONS = {"LP": fold, "PD": doubling, "NS": torus}
