r"""`families`: several branches of one problem, detached ones too.

Branches are started at both ends of the window. Then, at a few values of the parameter in between, solutions that no
branch has yet are looked for by deflated Newton iteration: with the known solutions u_k,

    M(u) F(u) = 0,   M(u) = prod_k (1 + 1 / |u - u_k|^2),      step = tau step_Newton,  tau = 1 / (1 - M'(step)/M),

(norm of the problem), which cannot go to a known one. Every solution found is followed to both sides, and belongs from
then on to the known ones, and so do its images S x(t - sigma T) under the symmetries of the system. Forced orbit
problems bring guesses of their own, at these values and at both ends of the window (problems/orbit_candidates): all
solutions with one harmonic of polynomial equations, the equilibria of the averaged field, what transients from there
settle on. `through` another parameter, a forcing amplitude for example, known solutions are continued at those values,
and every new crossing of the nominal value is a solution too. A search from finitely many guesses: what is found is
there, what is not found may be.

Reference: Farrell, Birkisson, Funke (2015), SIAM J. Sci. Comput. 37, A2026-A2045.
"""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, OpenResonanceWarning, check_names
from ..protocols import Problem
from ..results.branch import Branch
from .driver import continuation
from .settings import checked_problem

__all__ = ["families"]

Array = NDArray[np.float64]
_SAME = 1e-5  # relative distance below which two solutions are one
_MAX_NEWTON = 40
_SAMPLES = 64


def families(
    problem: Problem,
    name: str,
    window: tuple[float, float],
    *,
    places: int = 5,
    sizes: tuple[float, ...] = (0.5, 2.0, 8.0),
    merge: bool = True,
    through: Mapping[str, tuple[float, float]] | None = None,
    **options: Any,
) -> tuple[Branch, ...]:
    """All branches that starts at both ends of the window and a search between them find.

    Parameters
    ----------
    problem : Problem
        `Equilibrium`, or a forced orbit problem such as ``Collocation(system, multiple=3)``. For autonomous orbits give
        one by ``start=``; nothing is searched for.
    name : str
        The continued parameter lambda.
    window : (from, to)
    places : int
        Number of values of lambda, inside the window, at which more solutions are looked for; forced orbits also at
        both ends, by the problem's own guesses alone. 0: no search at all.
    sizes : tuple of float
        Sizes of the guesses, relative to the largest known solution's states there.
    merge : bool
        Branches that are images of each other under a symmetry of the system (``system.symmetries``) are listed once;
        False lists them all.
    through : mapping of parameter name -> (from, to), optional
        Amplitude continuation: at each of the places the known solutions are continued in these parameters too (a
        forcing amplitude), and followed in `name` from every new solution at the nominal value.
    **options
        Passed on to `continuation`.

    Returns
    -------
    tuple of Branch
        In the order found; the first starts at `from`. Branches that were met from two sides are listed once, and so
        are those that are mirror images of one another.

    Raises
    ------
    InputError
        The problem is born at a special point, or `places` is no whole number >= 0.
    ConvergenceError
        Nothing at all was found.

    Notes
    -----
    *Accuracy*: every branch is one of `continuation`. The set is a lower bound: deflation is no proof of completeness.

    Examples
    --------
    >>> import sympy as sp, stability as st
    >>> x, r = sp.symbols("x r", real=True)  # a trivial branch, and a circle around (r, x) = (0, 3)
    >>> f = -x * ((x - 3) ** 2 + r**2 - 1)
    >>> system = st.System(name="isola", coordinates=("x",), states=("x",), parameters={"r": 0.0}, rhs=(f,))
    >>> len(st.families(st.Equilibrium(system), "r", (-2, 2)))
    2
    """
    checked_problem(problem)
    if problem.seed() is not None:
        raise InputError("a problem born at a special point is one branch: give it to continuation")
    if not isinstance(places, int) or places < 0:
        raise InputError(f"places must be a whole number >= 0, got {places!r}")
    check_names("parameter", through or {}, list(problem.parameters), "this problem")
    if name in (through or {}):
        raise InputError(f"through = {name!r} is the continued parameter itself: give another one, a forcing amplitude")
    search = _Search(problem, name, _mirrors(problem, name) if merge else ())
    with warnings.catch_warnings():  # what an open resonance is advised to do is done here
        warnings.simplefilter("ignore", OpenResonanceWarning)
        return search.run(window, places, sizes, through or {}, options)


# ---------------------------------------------------------------------- what is known
def _mirrors(problem: Any, name: str) -> tuple[Any, ...]:
    """The symmetries of the system that the continued parameter leaves."""
    system = getattr(problem, "system", None)
    found = () if system is None else getattr(system, "symmetries", ())
    declared = set(getattr(system, "declared_symmetries", ()))
    return tuple(s for s in found if name not in s.fixed and (s.proved or s in declared))


@dataclass(frozen=True, eq=False)
class _Image:
    """S x(t - lag) of an orbit x(t), as a guess and to be compared with others."""

    orbit: Any
    symmetry: Any
    lag: float

    def __call__(self, t: Any) -> Array:
        return np.asarray(self.symmetry.matrix @ self.orbit(np.asarray(t) - self.lag))

    @property
    def period(self) -> float:
        return float(self.orbit.period)


@dataclass(frozen=True, eq=False)
class _Search:
    """A search for solutions of one problem along one parameter, up to symmetries."""

    problem: Any
    name: str
    mirrors: tuple[Any, ...]

    def run(
        self, window: tuple[float, float], places: int, sizes: tuple[float, ...],
        through: Mapping[str, tuple[float, float]], options: dict[str, Any],
    ) -> tuple[Branch, ...]:  # fmt: skip
        """All branches found; see `families`."""
        first, last = (float(v) for v in window)
        found: list[Branch] = []
        trouble: ConvergenceError | None = None
        for ends in ((first, last), (last, first)):
            try:
                if found and not self.is_new(ends[0], options.get("start"), found):
                    continue
                found.append(continuation(self.problem, self.name, ends, **options))
            except ConvergenceError as error:
                trouble = error
        for value, ends, factors in self.searched(first, last, places, sizes):
            inside = value not in ends
            across = (self.across(value, found, *item, options) for item in through.items()) if inside else ()
            for solution in chain(self.solutions(value, found, factors), *across):
                try:
                    found.append(continuation(self.problem, self.name, ends, **{**options, "start": solution}))
                except ConvergenceError as error:
                    trouble = error
        if not found:
            raise trouble or ConvergenceError("no solution was found anywhere in the window; give start=")
        return tuple(found)

    def searched(
        self, first: float, last: float, places: int, sizes: tuple[float, ...]
    ) -> Iterator[tuple[float, tuple[float, float], tuple[float, ...]]]:
        """(value, window, sizes of guesses): the places, and the ends by the problem's own candidates alone."""
        if getattr(self.problem, "own", 0) or not places:
            return
        for k in range(places):
            yield first + (last - first) * (k + 0.5) / places, (first, last), sizes
        yield first, (first, last), ()
        yield last, (last, first), ()

    def params_at(self, value: float) -> Array:
        params = np.array(list(self.problem.parameters.values()), dtype=float)
        params[list(self.problem.parameters).index(self.name)] = value
        return params

    def known(self, found: list[Branch], value: float) -> list[Any]:
        """All solutions of the branches at a value of the parameter."""
        solutions: list[Any] = []
        for branch in found:
            try:
                solutions += branch.at(**{self.name: value})
            except ConvergenceError:
                continue
        return solutions

    def images(self, solution: Any) -> list[Any]:
        """A solution and those images of it that are other solutions."""
        if not callable(solution):
            moved: list[Any] = [dataclasses.replace(solution, x=s.matrix @ solution.x) for s in self.mirrors]
        else:
            T = solution.period / _turns(self.problem)
            moved = [_Image(solution, s, s.shift * T) for s in self.mirrors]
        distinct = [solution]
        for image in moved:
            if all(_distance(self.problem, image, other) > _SAME for other in distinct):
                distinct.append(image)
        return distinct

    def is_new(self, value: float, start: Any, found: list[Branch]) -> bool:
        params = self.params_at(value)
        solution = self.problem.view(self.problem.start(params, start), params)
        return self.differs(solution, self.known(found, value))

    def differs(self, solution: Any, known: list[Any]) -> bool:
        """Whether a solution is none of the known ones, nor an image of one."""
        others = [image for other in known for image in self.images(other)]
        return all(_distance(self.problem, solution, other) > _SAME for other in others)

    def solutions(self, value: float, found: list[Branch], sizes: tuple[float, ...]) -> Iterator[Any]:
        """Solutions at a value that are on none of the branches; `found` grows while this runs."""
        problem, params = self.problem, self.params_at(value)
        for guess in list(_guesses(problem, params, self.known(found, value), sizes)):
            known = self.known(found, value)
            images = [image for other in known for image in self.images(other)]
            others = [u for u in (_unknowns(problem, params, s) for s in images) if u is not None]
            u = _deflated(problem, params, guess, others)
            if u is None:
                continue
            corrected = problem.correct(u, params, self.name, None, 0.0, 1e-9)
            if not corrected.converged:
                continue
            solution = problem.view(corrected.u, params)
            if self.differs(solution, known):
                yield solution

    def across(
        self, value: float, found: list[Branch], other: str, window: tuple[float, float], options: dict[str, Any]
    ) -> Iterator[Any]:
        """New solutions at a value where branches in `other` cross its nominal value; `found` grows while this runs."""
        nominal = float(self.problem.parameters[other])
        there = dataclasses.replace(self.problem, system=self.problem.system.with_params(**{self.name: value}))
        for known in self.known(found, value):
            try:
                crossings = continuation(there, other, window, **{**options, "start": known}).at(**{other: nominal})
            except ConvergenceError:
                continue
            for solution in crossings:
                if self.differs(solution, self.known(found, value)):
                    yield solution


def _distance(problem: Problem, one: Any, other: Any) -> float:
    """Largest difference of the states over their size; of orbits of k forcing periods the least over shifts by one."""
    if not callable(one):
        size = np.maximum(np.abs(one.x), np.abs(other.x)) + 1e-9
        return float(np.max(np.abs(one.x - other.x) / size))
    turns = _turns(problem)
    times = np.linspace(0.0, one.period, 33)
    values = one(times)
    size = np.abs(values).max() + 1e-12
    shifts = [other(times + j * one.period / turns) for j in range(turns)]
    return float(min(np.abs(values - shifted).max() for shifted in shifts) / size)


def _turns(problem: Problem) -> int:
    return int(getattr(problem, "subharmonic", getattr(problem, "multiple", 1)))


# ---------------------------------------------------------------------- what is new
def _unknowns(problem: Problem, params: Array, solution: Any) -> Array | None:
    try:
        return problem.start(params, solution)
    except ConvergenceError:
        return None


def _guesses(problem: Any, params: Array, known: list[Any], sizes: tuple[float, ...]) -> Iterator[Array]:
    """The problem's own candidates; then equilibria: random states, orbits: the largest known one plus a harmonic of
    the motion's own period.
    """
    if hasattr(problem, "candidates"):
        yield from problem.candidates(params)
    if not hasattr(problem, "discretise"):
        n = len(problem.weights)
        size = max((float(np.abs(s.x).max()) for s in known), default=0.0) or 1.0
        random = np.random.default_rng(0)
        for factor in sizes:
            yield from factor * size * random.standard_normal((6, n))
        return
    system, turns = problem.system, _turns(problem)
    period = float(problem.orbit_period(params))
    times = np.arange(_SAMPLES * turns) * (period / (_SAMPLES * turns))
    base = np.zeros((len(system.states), times.size)) if not known else known[0](times)
    for factor in sizes:
        for place, coordinate in enumerate(system.coordinates):
            amplitude = factor * (float(np.abs(base[place]).max()) or 1.0)
            for j in range(1, turns + 1):
                omega = 2 * math.pi * j / period
                for phase in (0.0, 0.5 * math.pi):
                    states = base.copy()
                    states[place] += amplitude * np.cos(omega * times + phase)
                    if f"{coordinate}_dot" in system.states:
                        rate = -amplitude * omega * np.sin(omega * times + phase)
                        states[system.states.index(f"{coordinate}_dot")] += rate
                    yield problem.discretise(times, states, period)


def _deflated(problem: Problem, params: Array, u: Array, known: list[Array]) -> Array | None:
    """Newton on M F from `u`; None where it does not settle."""
    w, n = problem.weights, u.size
    scale = max([float(w @ v**2) for v in known] + [float(w @ u**2)]) or 1.0
    empty = np.zeros((0, n)), np.zeros((n, 0)), np.zeros((0, 0))
    for _ in range(_MAX_NEWTON):
        L = problem.linearise(u, params)
        residual = np.asarray(L.residual)
        if not np.isfinite(residual).all():
            return None
        step = L.solve(*empty, -residual[:, None])[:, 0]
        if not np.isfinite(step).all():
            return None
        slope = 0.0
        for other in known:
            gap = u - other
            square = float(w @ gap**2) / scale + 1e-300
            slope -= 2 * float(w @ (gap * step)) / scale / (square * (square + 1))
        step = step / (1 - slope) if slope != 1 else step
        length = math.sqrt(float(w @ step**2) / scale)
        u = u + step * min(1.0, 1.0 / length if length else 1.0)
        if length < 1e-8:
            return u
    return None
