"""Impact stops: walls that limit a coordinate.

Hard: at q = position the velocity is reversed, q'+ = -e q'-, with the coefficient of restitution e in [0, 1]. A stop
bounds q from above (side +1) or from below (side -1). A soft stop is no event but a force, stiffness k_s and damping
d_s in contact; models write it into their equations with Max and Piecewise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from .system import System

__all__ = ["HardStop", "refuse_stops"]


@dataclass(frozen=True)
class HardStop:
    """A rigid wall for one coordinate, q <= position (side +1) or q >= position (side -1), q'+ = -e q'-.

    Parameters
    ----------
    coordinate : str
        The coordinate that meets the wall.
    position : float
        Where the wall stands, in the coordinate's unit.
    side : int
        +1: the motion stays below the position; -1: above.
    restitution : float
        e in [0, 1]; 1 conserves energy.

    Raises
    ------
    InputError
        If the restitution is outside [0, 1], the position not finite or the side not +1 or -1.

    Examples
    --------
    >>> import stability as st
    >>> st.HardStop("y", position=0.004, restitution=0.8).side
    1
    """

    coordinate: str
    position: float
    side: int = 1
    restitution: float = 1.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.position):
            raise InputError(f"the stop's position must be finite; got {self.position}")
        if self.side not in (1, -1):
            raise InputError(f"side must be +1 (bounds from above) or -1 (from below); got {self.side}")
        if not 0.0 <= self.restitution <= 1.0:
            raise InputError(f"restitution must be in [0, 1]; got {self.restitution}")


def refuse_stops(system: System, method: str) -> None:
    """InputError where a method would pass through a system's hard stops without seeing them."""
    if system.stops:
        raise InputError(
            f"{method} does not see the hard stops of '{system.name}' and would pass through them; use "
            "Shooting(system), simulate or sweep, or a model with soft stops (models.soft_stop_oscillator)"
        )
