r"""Saltation: how a small deviation passes an event.

The event g(t, x, p) = 0 is met at a time that depends on the deviation; behind it the state is mapped, x+ = R(x-), and
the field is f+ in place of f-. To first order a deviation d- in front becomes, at the same time,

    d+ = R' d- + (f+ - R' f-) (g_x d- + g_p) / (g_x f- + g_t)

(g_p for derivatives by a parameter only). For a continuous field without map this is the identity; a wall on q has R'
= I but -e for the velocity, and det d+/d- = e^2 for one degree of freedom. Where the event is grazed, g_x f- + g_t =
0, the derivative does not exist.

Reference: R. I. Leine, H. Nijmeijer (2004), Dynamics and Bifurcations of Non-Smooth Mechanical Systems, chapter 7;
P. C. Mueller (1995), Chaos, Solitons and Fractals 5, 1671.
"""

from __future__ import annotations

import numpy as np

__all__ = ["passed", "saltation"]

Array = np.ndarray


def passed(
    columns: Array, map_derivative: Array, before: Array, after: Array, gradient: Array, rate: float, by_guard: Array
) -> Array:
    """Deviations (n, k) behind an event.

    Parameters
    ----------
    columns : (n, k) deviations in front of it
    map_derivative : (n, n), R'
    before, after : (n,) fields f-, f+
    gradient : (n,) g_x;  rate : total time derivative of g in front, g_x f- + g_t
    by_guard : (k,) explicit derivative of g along each column (g_p; zero for deviations of the state)
    """
    jump = after - map_derivative @ before
    return np.asarray(map_derivative @ columns + np.outer(jump, gradient @ columns + by_guard) / rate)


def saltation(
    map_derivative: Array, before: Array, after: Array, gradient: Array, by_time: float = 0.0
) -> Array:
    """The saltation matrix (n, n), d+/d-.

    Examples
    --------
    >>> import numpy as np
    >>> wall = saltation(np.diag([1.0, -0.8]), np.array([2.0, -9.81]), np.array([-1.6, -9.81]), np.array([-1.0, 0.0]))
    >>> round(float(np.linalg.det(wall)), 12)
    0.64
    """
    n = len(before)
    rate = float(gradient @ before + by_time)
    return passed(np.eye(n), map_derivative, before, after, gradient, rate, np.zeros(n))
