r"""What happens at a wall: restitution, and chatter that ends in sticking.

    q = position:    q'+ = -e q'-,   0 <= e <= 1           (the other velocities do not change)

With e < 1 a body pressed on a wall bounces infinitely often in a finite time; the heights of the bounces, r^2/(2 a)
for a rebound speed r and a pressing acceleration a, form a geometric series. When the height is below the tolerance
of the coordinate the rest of the series is not followed: the body is on the wall, q' = 0, and is held there until the
acceleration that it would have without the wall points away. A free body (a <= 0) is never held.

The restitution acts on one coordinate: the equations must not couple its acceleration with others through the mass
matrix. Reference: M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk (2008), Piecewise-smooth Dynamical Systems,
section 2.5 and chapter 6.
"""

from __future__ import annotations

import numpy as np

from .events import Wall

__all__ = ["bounce"]

Array = np.ndarray


def bounce(wall: Wall, x: Array, pressing: float, tolerance: float) -> tuple[Array, Array, bool]:
    """(state behind the wall, derivative of the map (n, n), whether the body stays on it).

    Parameters
    ----------
    x : (n,) state at the wall;  pressing : acceleration towards the wall, side q'' without it
    tolerance : height of a bounce that is not followed any more
    """
    after, derivative = x.copy(), np.eye(len(x))
    after[wall.coordinate] = wall.position
    speed = abs(wall.restitution * x[wall.velocity])
    sticks = pressing > 0.0 and speed**2 <= 2.0 * pressing * tolerance and wall.hold >= 0
    if sticks:
        after[wall.velocity] = 0.0
        derivative[wall.coordinate] = derivative[wall.velocity] = 0.0
        return after, derivative, True
    after[wall.velocity] = -wall.restitution * x[wall.velocity]
    derivative[wall.velocity, wall.velocity] = -wall.restitution
    return after, derivative, False
