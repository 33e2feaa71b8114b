"""The one physical constant: the acceleration of gravity, 9.81 m/s^2, rounded as the source of the models rounds it.

An acceleration of 0.5 g is 4.905 m/s^2 wherever it stands: in the defaults of the models, on the command line, in the
columns of a measured response. The standard acceleration 9.80665 m/s^2, 0.03 % less, is the unit ``g0`` of columns.
"""

from __future__ import annotations

__all__ = ["GRAVITY"]

GRAVITY = 9.81  # m/s^2
