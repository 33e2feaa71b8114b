"""What all discretisations of periodic orbits share: the system, the period, winding angles, starts, measures, views.

An orbit covers `multiple` forcing periods of a forced system, or one period of its own of an autonomous one (then the
period is an unknown, `own` = 1); x(end) = x(0) + winding for angles that turn. A subclass keeps its unknowns as it
likes; it gives `places` (the points of scaled time whose states make u), `packed`, and `pieces` (the orbit as
polynomials), and the linear algebra of the Problem protocol.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, unknown_name
from ..integration.compiled import CompiledField
from ..protocols import Critical, Seed
from ..results.solutions import PeriodicOrbit
from ..words import Kind
from .orbit_candidates import orbit_candidates
from .orbit_measures import orbit_measures, orbit_view
from .orbit_starts import discretised, started
from .orbit_symmetry import mirrored, mirrored_problem

__all__ = ["OrbitDiscretisation", "one_period", "whole_number", "winding_vector"]

Array = np.ndarray
_CRITICAL = Critical(circle=True, pair=Kind.NEIMARK_SACKER, minus=-1.0)


def whole_number(name: str, value: Any, low: int, high: int) -> int:
    """`value` as an int between low and high, or InputError."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or int(value) != value:
        raise InputError(f"{name} = {value!r}: a whole number from {low} to {high} is needed")
    if not low <= value <= high:
        raise InputError(f"{name} = {value!r}: a whole number from {low} to {high} is needed")
    return int(value)


def one_period(name: str, number: int, system: Any, forced: bool) -> None:
    """InputError for orbits of several forcing periods of a system that has no forcing."""
    if number != 1 and not forced:
        raise InputError(
            f"{name} = {number}: '{system.name}' is autonomous and has no forcing period to be a multiple of; leave "
            f"{name}=1 (a doubled orbit comes from switch at a period doubling)"
        )


def winding_vector(system: Any, given: Any) -> Array:
    """(n,) in radians, from turns by angle, or from an array; zero for None."""
    states = system.states
    out = np.zeros(len(states))
    if isinstance(given, Mapping):
        for name, turns in given.items():
            if name not in system.angles:
                raise unknown_name("angle", name, system.angles)
            out[states.index(name)] = 2 * np.pi * float(turns)
    elif given is not None:
        out = np.array(given, float)
        if out.shape != (len(states),) or not np.isfinite(out).all():
            raise InputError(f"winding must be a mapping angle -> turns or {len(states)} numbers, got {given!r}")
    return out


class OrbitDiscretisation:
    """Base of `Collocation` and `Shooting`."""

    system: Any
    multiple: int
    winding: Any
    halved = False
    symmetry: Any = None
    mirror: Any = None  # how a family that has lost a symmetry is mapped to its image (see `orbit_symmetry.Mirror`)
    if TYPE_CHECKING:  # what the two add
        closure: Any
        correct: Any
        linearise: Any
        spectrum: Any
        error: Any

    @cached_property
    def flow(self) -> CompiledField:
        """The compiled field of the system and its forcing period."""
        return CompiledField.of(self.system)

    @property
    def evaluations(self) -> Any:
        """The evaluator of the system."""
        return self.flow.evaluations

    @property
    def own(self) -> int:
        """1 where the period is an unknown."""
        return 0 if self.flow.forced else 1

    @property
    def forcing_periods(self) -> int:
        """Forcing periods that an orbit covers; 1 for autonomous systems."""
        return 1 if self.own else self.multiple

    @property
    def parameters(self) -> Mapping[str, float]:
        """Those of the system."""
        return self.system.parameters  # type: ignore[no-any-return]

    @property
    def critical(self) -> Critical:
        """Multipliers leave at +1, -1 or as a pair."""
        return _CRITICAL

    @property
    def advice(self) -> str:
        """What of the discretisation to change where no orbit is found; begins with a semicolon, or empty."""
        return ""

    def index(self, name: str) -> int:
        """Place of a parameter in p."""
        return self.flow.place(name)

    @property
    def whole_winding(self) -> Array:
        """x(P) - x(0) of the whole orbit (n,), also where half of it is solved."""
        return np.asarray(self.winding)

    def orbit_period(self, params: Array) -> float:
        """Period of a forced system's orbits."""
        return float(self.multiple * self.evaluations.period(params))

    # ------------------------------------------------------------------ given by subclasses
    size: int

    @property
    def places(self) -> Array:
        """Points s (K,) in [0, 1] whose states make u."""
        raise NotImplementedError

    def packed(self, values: Array, period: float) -> Array:
        """u from states (K, n) at `places`."""
        raise NotImplementedError

    def pieces(self, u: Array, params: Array) -> tuple[int, Array, Array, float]:
        """(degree d, edges (K + 1,) in [0, 1], values (K, d + 1, n) at (0, Gauss points), period) of the orbit."""
        raise NotImplementedError

    # ------------------------------------------------------------------ starts and results
    def start(self, params: Array, guess: Any = None) -> Array:
        """A converged u from a guess (see `orbit_starts`), or an error that says which guess to give."""
        for name in self.symmetry.fixed if self.halved else ():
            self.check_free(name, float(params[self.index(name)]))
        return started(self, np.asarray(params, float), guess)

    def check_free(self, name: str, value: float = np.nan) -> None:
        """InputError for a parameter that must stay where the system has it, or the symmetry is lost."""
        if self.halved and name in self.symmetry.fixed and value != self.parameters[name]:
            raise InputError(
                f"'{name}' breaks the symmetry {self.symmetry!r}: with it the orbit is to be solved on its whole "
                "period, symmetry=None"
            )

    def image_problem(self) -> Any:
        """The problem whose unknowns are the images of this one's, where there is a `mirror`."""
        return mirrored_problem(self)

    def image(self, u: Array) -> Array:
        """The image of unknowns or of a direction, in the layout of `image_problem`."""
        return mirrored(self, u)

    def seed(self) -> Seed | None:
        """None: not born at a special point."""
        return None

    def discretise(self, times: Array, states: Array, period: float) -> Array:
        """u of a periodic function from equispaced samples states (n, K)."""
        return discretised(self, times, states, period)

    def candidates(self, params: Array) -> list[Array]:
        """Starts for `families` (see `orbit_candidates`)."""
        return orbit_candidates(self, params)

    def measures(self, u: Array, params: Array) -> dict[str, float]:
        """Columns of a branch (see `orbit_measures`)."""
        return orbit_measures(self, u, np.asarray(params, float))

    def view(self, u: Array, params: Array) -> PeriodicOrbit:
        """The orbit as a user sees it."""
        return orbit_view(self, u, np.asarray(params, float))
