"""The six springs of figures 1 and 2: translational and rotational; linear, nonlinear, nonlinear unsymmetrical.

All parameters are chosen (catalogue, section 1): the source gives none. Rings 3/6 mm, 4 mm thick, 1.2 T, gap 12 mm; a
weight of 0.02 kg floating 8 mm above its magnet (dipole law); 5e-3 N m/rad; T2 = 1e-2, T4 = -1e-3, T1 = 4e-3 N m.

F is the force that HOLDS the displacement, so the rotor T = +T2 sin 2 phi + T4 sin 4 phi is stable at phi = 0 (magnets
before the iron). The source draws it in the unstable position, 90 degrees further, where the curve with this slope is
the torque that the magnets exert. The unsymmetrical rotor has T1 sin(phi + pi/4) added and is measured from its own
neutral position, as the text says ("shown in the neutral position").
"""

from __future__ import annotations

import math

from stability import models
from stability.models import Spring

MASS, GRAVITY = 0.02, 9.81
RING = models.RingMagnet(inner_radius=3e-3, outer_radius=6e-3, thickness=4e-3, polarization=1.2)


def springs() -> dict[str, Spring]:
    """The six springs by name, translational ones first."""
    unsymmetrical = models.RotationalMagneticSpring({1: 4e-3, 2: 1e-2, 4: -1e-3}, {1: math.pi / 4})
    return {
        "linear": models.PowerLawSpring(k1=190.0),
        "three rings": models.LevitatedMagnetSpring(RING, gap=12e-3),
        "one-sided": models.DipoleMagnetSpring(weight=MASS * GRAVITY, floating_gap=8e-3),
        "linear rotational": models.PowerLawSpring(k1=5e-3, motion="rotation"),
        "rotor": models.RotationalMagneticSpring({2: 1e-2, 4: -1e-3}),
        "unsymmetrical rotor": unsymmetrical.about(unsymmetrical.rest),
    }
