r"""Space-time symmetries of a system: what they are, and when the equations have one.

A signed permutation S of the states with S S = I, together with a shift of time by sigma = 0 or 1/2 forcing periods, is
a symmetry of x' = f(t, x, p) if

    f(t + sigma T(p), S x, p) = S f(t, x, p)          for all t, x (and all p, but for parameters that must stay fixed).

With x(t) then also S x(t - sigma T) is a solution: its mirror image. A solution that is its own image is symmetric; an
orbit of period P may besides be its own image half a period later, x(t + P/2) = S x(t), and is known from half of it.
Autonomous systems: sigma = 0 (any shift of time is a symmetry by itself).

A symmetry is checked at random points first, which names the equation that breaks it; then each
f_i(t + sigma T, S x) - (S f)_i is brought to zero symbolically, which proves it. Equations that resist the second step,
and Python functions, leave a symmetry with ``proved`` False. Reference: Golubitsky, Stewart, Schaeffer (1988),
*Singularities and Groups in Bifurcation Theory* II, chapter XVI; Swift and Wiesenfeld (1984), Phys. Rev. Lett. 52, 705.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import EquationError, InputError, unknown_name

if TYPE_CHECKING:
    from .system import System

__all__ = ["Symmetry", "defects", "proved_symbolically", "sample_points", "verified"]

Array = npt.NDArray[np.float64]
_SIZES = (1.0, 0.3, 1e-3)  # of the random states at which equations are compared
_POINTS = 6  # per size
_CLOSE = 1e-9
_FEWEST = 4  # points at which the equations must be finite
_MAX_OPERATIONS, _MAX_QUOTIENTS = 20000, 1000  # of an equation to be expanded, to be brought to one denominator


@dataclass(frozen=True, repr=False)
class Symmetry:
    """S and a shift of time: f(t + shift T, S x, p) = S f(t, x, p), S a signed permutation with S S = I.

    Parameters
    ----------
    images : mapping of str to str
        What S puts in the place of a state: ``{"theta": "-theta"}``, ``{"x1": "x2", "x2": "x1"}``. The velocity of a
        coordinate goes along with it; states that are not named stay.
    shift : float
        0 or 0.5, in forcing periods T; 0 for autonomous systems.
    fixed : tuple of str
        Parameters that must keep the system's own values (``gravity`` = 0); found by the library.
    proved : bool
        Whether it follows from the equations symbolically, or has been seen at random points only; set by the library.

    Raises
    ------
    InputError
        An image that is no signed name, or a shift other than 0 and 1/2.

    Examples
    --------
    >>> import stability as st
    >>> st.models.duffing().symmetries
    (u -> -u half a forcing period later, while gravity stays,)
    """

    images: tuple[tuple[str, str], ...]
    shift: float = 0.0
    fixed: tuple[str, ...] = ()
    proved: bool = False

    def __post_init__(self) -> None:
        pairs = self.images.items() if isinstance(self.images, Mapping) else self.images
        try:
            images = tuple((str(name), str(image).replace(" ", "")) for name, image in pairs)
        except (TypeError, ValueError):
            raise InputError(f'images must be a mapping such as {{"u": "-u"}}, got {self.images!r}') from None
        if self.shift not in (0, 0.5):
            raise InputError(f"shift = {self.shift!r}: a symmetry shifts time by 0 or by 0.5 forcing periods")
        for name, image in images:
            if not image.removeprefix("-").isidentifier():
                raise InputError(f"the image {image!r} of '{name}' is neither a state nor a state with a minus sign")
        object.__setattr__(self, "images", images)
        object.__setattr__(self, "shift", float(self.shift))
        object.__setattr__(self, "fixed", tuple(self.fixed))

    def completed(self, states: Sequence[str]) -> Symmetry:
        """With an image for every state: velocities follow their coordinates, what is not named stays.

        Raises
        ------
        UnknownNameError, InputError
            A name that is no state; images that are no permutation; S S other than I.
        """
        images = dict(self.images)
        for name, image in self.images:
            for one in (name, image.removeprefix("-")):
                if one not in states:
                    raise unknown_name("state", one, states)
        for name, image in self.images:
            if f"{name}_dot" in states:
                images.setdefault(f"{name}_dot", f"{image}_dot")
        whole = Symmetry(tuple((s, images.get(s, s)) for s in states), self.shift, self.fixed, self.proved)
        S = whole.matrix
        if not (np.abs(S).sum(axis=0) == 1).all():
            raise InputError(f"{whole!r} is no permutation of the states: two of them have the same image")
        if not np.array_equal(S @ S, np.eye(len(S))):
            raise InputError(f"{whole!r}: applied twice it must give every state back")
        return whole

    @property
    def matrix(self) -> Array:
        """S (n, n), of a completed symmetry, in the order of its states."""
        states = [name for name, _ in self.images]
        S = np.zeros((len(states), len(states)))
        for i, (_, image) in enumerate(self.images):
            S[i, states.index(image.removeprefix("-"))] = -1.0 if image.startswith("-") else 1.0
        return S

    def __repr__(self) -> str:
        moved = {name: image for name, image in self.images if name != image}
        shown = [
            f"{name} -> {image}" for name, image in moved.items()
            if not (name.endswith("_dot") and moved.get(name[:-4], "").removeprefix("-") + "_dot" == image.lstrip("-"))
        ]  # fmt: skip
        later = " half a forcing period later" if self.shift else ""
        stay = f", while {' and '.join(self.fixed)} stay{'s' * (len(self.fixed) == 1)}" if self.fixed else ""
        return f"{', '.join(shown) or 'every state stays'}{later}{stay}"


# ---------------------------------------------------------------------- at random points
def sample_points(system: System) -> tuple[Array, Array]:
    """(phases (K,), states (K, n)) at which equations are compared: random, of several sizes, the same every time."""
    random = np.random.default_rng(20)
    count = _POINTS * len(_SIZES)
    sizes = np.repeat(_SIZES, _POINTS)[:, None]
    return random.uniform(0.0, 1.0, count), sizes * random.standard_normal((count, system.n))


def defects(system: System, S: Array, shift: float, params: Array) -> Array:
    """(c, n): by how much each equation breaks each of the candidates S (c, n, n), relative to its size; inf: unknown.

    params : (m,) or (K, m), of the points.
    """
    from .evaluators import evaluator

    phases, states = sample_points(system)
    evaluations, count = evaluator(system), len(phases)
    candidates = len(S)
    moved = np.einsum("cij,kj->cki", S, states).reshape(-1, system.n)
    shifted = np.tile(np.mod(phases + shift, 1.0), candidates)
    rows = np.atleast_2d(params)
    rows = np.repeat(rows, count, axis=0) if len(rows) == 1 else rows
    with np.errstate(all="ignore"):
        F = np.asarray(evaluations.F(phases, np.ascontiguousarray(states), np.ascontiguousarray(rows)))
        many = np.ascontiguousarray(np.tile(rows, (candidates, 1)))
        G = np.asarray(evaluations.F(shifted, np.ascontiguousarray(moved), many)).reshape(candidates, count, -1)
        expected = np.einsum("cij,kj->cki", S, F)
        size = np.where(np.isfinite(F), np.abs(F), 0.0).reshape(len(_SIZES), _POINTS, -1).max(axis=1)
        size = np.einsum("cij,gj->cgi", np.abs(S), size).repeat(_POINTS, axis=1)
        gap = np.abs(G - expected) / np.where(size > 0, size, 1.0)
    one, other = np.isfinite(G), np.isfinite(expected)
    gap[~one & ~other] = 0.0
    gap[one != other] = np.inf
    worst = gap.max(axis=1)
    worst[(one & other).all(axis=2).sum(axis=1) < _FEWEST] = np.inf
    return np.asarray(worst)


def _varied(system: System, names: Sequence[str]) -> Array:
    """(K, m) parameter values at the sample points, those named at random around their own."""
    random = np.random.default_rng(21)
    values = np.tile(system.parameter_vector(), (len(sample_points(system)[0]), 1))
    for name in names:
        k, own = list(system.parameters).index(name), system.parameters[name]
        low, high = system.bounds.get(name, (-np.inf, np.inf))
        reach = 0.3 * abs(own) or 0.5
        values[:, k] = np.clip(own + reach * random.uniform(-1, 1, len(values)), low, high)
    return values


# ---------------------------------------------------------------------- symbolically
def proved_symbolically(system: System, symmetry: Symmetry) -> bool:
    """Whether f(t + sigma T, S x, p) - S f(t, x, p) is brought to zero (`fixed` parameters at their values)."""
    if system.rhs is None:
        return False
    import sympy as sp

    from .equations import TIME, symbol

    def number(value: float) -> Any:
        return sp.Integer(int(value)) if float(value).is_integer() else sp.Float(value)

    constants = {symbol(name): number(system.parameters[name]) for name in symmetry.fixed}
    place = {s: symbol(s) for s in system.states}
    signed = {name: (-1 if image.startswith("-") else 1, image.removeprefix("-")) for name, image in symmetry.images}
    change = {place[name]: sign * place[image] for name, (sign, image) in signed.items()}
    if symmetry.shift:
        change[TIME] = TIME + system.period_expression.xreplace(constants) / 2
    fields = {s: e.xreplace(constants) for s, e in zip(system.states, system.rhs)}
    for name, (sign, image) in signed.items():
        gap = fields[name].subs(change, simultaneous=True) - sign * fields[image]
        if gap.count_ops() > _MAX_OPERATIONS:
            return False
        gap = sp.expand(gap)
        if gap != 0 and gap.count_ops() < _MAX_QUOTIENTS:
            gap = sp.expand(sp.numer(sp.together(gap)))
        if gap != 0:
            return False
    return True


# ---------------------------------------------------------------------- one declared or found
def _same_stops(system: System, symmetry: Symmetry) -> bool:
    """Whether the walls of the system are carried into one another."""
    signs = {name: (-1 if image.startswith("-") else 1, image.removeprefix("-")) for name, image in symmetry.images}
    there = {(s.coordinate, s.position, s.side, s.restitution) for s in system.stops}
    moved = set()
    for s in system.stops:
        sign, image = signs[s.coordinate]
        moved.add((image, sign * s.position, sign * s.side, s.restitution))
    return moved == there


@lru_cache(maxsize=256)
def verified(system: System, symmetry: Symmetry) -> Symmetry:
    """The completed symmetry, with the parameters that must stay fixed and whether it is proved.

    Raises
    ------
    EquationError
        The equations do not have it; the sentence names the equation that breaks it.
    UnknownNameError, InputError
        As in `Symmetry.completed`; a shift of time for an autonomous system.
    """
    whole = symmetry.completed(system.states)
    if whole.shift and system.period_expression is None:
        raise InputError(f"'{system.name}' is autonomous: a symmetry of it has no shift of time, got {whole!r}")
    S = whole.matrix[None]
    broken = defects(system, S, whole.shift, system.parameter_vector())[0]
    if not (broken <= _CLOSE).all():
        worst = system.states[int(np.argmax(np.where(np.isnan(broken), np.inf, broken)))]
        amount = f"by {broken.max():.2g} of its size" if np.isfinite(broken.max()) else "where it is finite"
        raise EquationError(
            f"'{system.name}' does not have the symmetry {whole!r}: the equation of {worst} changes {amount}; "
            "system.symmetries lists those that it has"
        )
    if not _same_stops(system, whole):
        raise EquationError(f"'{system.name}' does not have the symmetry {whole!r}: its stops are not carried along")
    free = []
    for name in system.parameters:
        if (defects(system, S, whole.shift, _varied(system, [name])) <= _CLOSE).all():
            free.append(name)
    if not (defects(system, S, whole.shift, _varied(system, free)) <= _CLOSE).all():
        free = []
    fixed = tuple(name for name in system.parameters if name not in free)
    found = Symmetry(whole.images, whole.shift, fixed, False)
    return Symmetry(found.images, found.shift, fixed, proved_symbolically(system, found))
