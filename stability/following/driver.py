r"""`continuation`: the one verb of this library that follows a curve; `steps`, point by point, `extend`, `solve`.

    F(u, lambda) = 0,   |(u', lambda')| = 1   in the norm   |(u, lambda)|^2 = <u, u> + (lambda / window width)^2.

The driver sees only `protocols.Problem`. Without a seed it starts at the first end of the window and goes inward; a
problem with a seed is followed from its birth point, on one side or on both, and the halves are joined before special
points are labelled. The window is a pair of hard walls, reached exactly. What is said here is how the sides make a
branch; where they begin is in `starting`, how a side is followed in `follower`, their order in `walking`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError, unknown_name
from ..protocols import Problem, Seed
from ..results.branch import Branch
from ..words import Kind, Status
from .assembly import assemble, resumed, turned
from .follower import Entry, Follower
from .images import with_images
from .locating import Found
from .open_resonance import warn_if_open
from .points import Point
from .settings import Settings, checked, checked_problem
from .settling import adapted_solution
from .starting import born_sides, first_point, inside_window
from .walking import Walk, ended

__all__ = ["continuation", "extend", "solve", "steps"]


def continuation(
    problem: Problem,
    name: str,
    window: tuple[float, float],
    *,
    start: Any = None,
    ds: float | None = None,
    ds_max: float | None = None,
    max_points: int = 2000,
    at: Any = (),
    events: Any = (),
    stop_at: Any = (),
    tolerance: float = 1e-9,
    progress: Callable[[Any], Any] | None = None,
) -> Branch:
    """Follow a branch of solutions of F(u, lambda) = 0 by pseudo-arclength continuation.

    Parameters
    ----------
    problem : Problem
        What to follow: `Equilibrium`, `Collocation`, `Shooting`, ..., or what `switch` and `locus` return.
    name : str
        The continued parameter lambda.
    window : (from, to)
        The branch starts at `from` (unless the problem has a seed) and is followed until it leaves the interval at
        either end (a last point exactly on it), closes, or stops.
    start : state, solution or None
        A first solution, or something near one: dict of state names, array, FixedPoint, PeriodicOrbit. A solution whose
        own parameter value lies inside the window is followed from there in both directions (so closed branches are
        found whole).
    ds, ds_max : float
        First and longest step, in the scaled norm where the window has width one and every state its own scale
        (defaults 0.01 and 0.2).
    max_points : int
        At most so many points on either side.
    at : float or tuple of float
        Values of lambda at which a point is computed exactly (``Kind.USER``).
    events : callable, tuple of callables or mapping of names to callables
        Functions solution -> float; their zeros are located (``Kind.USER``, named). Where one is NaN a zero may be
        missed: a `StabilityWarning`, and ``Branch.message``, say so.
    stop_at : tuple
        Kinds, labels ("PD", "PD2") or event names at which to stop; the branch then ends at that point.
    tolerance : float
        Of Newton's method: the last update relative to 1 + |u|, in the scaled norm.
    progress : callable or None
        Called after every accepted point with a `Progress` (points, parameter, step, special).

    Returns
    -------
    Branch
        With a status. Trouble along the way ends the branch and keeps its points: a keyboard interrupt, and whatever
        `events` or `progress` raise (``Status.STOPPED``, a `StabilityWarning`, the cause in ``Branch.message``).

    Raises
    ------
    UnknownNameError, InputError
        Arguments that make no sense, before any work starts.
    ConvergenceError
        There is no first solution; carries the last iterate.

    Notes
    -----
    Every accepted point has a residual, a spectrum and a verdict. Special points are detected by integer counts and
    located on regular defining systems to about 1e-11 in lambda (or the discretisation error, see ``Branch.error``).

    References
    ----------
    Keller (1977), in: Applications of Bifurcation Theory, 359-384. Kuznetsov (2004), chapter 10.

    Examples
    --------
    >>> import stability as st
    >>> branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (15, 30), start=dict(x=6, y=6, z=14))
    >>> abs(branch["HB1"].params["rho"] - 470/19) < 1e-9
    True
    """
    settings = checked(
        problem, name, window, ds=ds, ds_max=ds_max, max_points=max_points, at=at, events=events, stop_at=stop_at,
        tolerance=tolerance, progress=progress,
    )
    branch = _walk(problem, start, settings).run().branch
    warn_if_open(branch)
    return branch


def steps(
    problem: Problem | Branch,
    name: str | None = None,
    window: tuple[float, float] | None = None,
    *,
    start: Any = None,
    ds: float | None = None,
    ds_max: float | None = None,
    max_points: int = 2000,
    at: Any = (),
    events: Any = (),
    stop_at: Any = (),
    tolerance: float | None = None,
) -> Walk:
    """Follow a branch point by point: an iterator that is a branch at any moment.

    Parameters
    ----------
    problem : Problem or Branch
        What to follow, as in `continuation`; or a branch, computed or loaded, that is taken up where it stopped, at
        either end.
    name : str
        The continued parameter (of a branch: its own).
    window : (from, to)
        As in `continuation` (of a branch: its own where none is given).
    start, ds, ds_max, max_points, at, events, stop_at, tolerance
        As in `continuation`; of a branch, steps and tolerance are those it was computed with unless given.

    Returns
    -------
    Walk
        Iterate over it, or call ``next``, for one `Step` after the other: parameter, verdict, multipliers, what was
        found on the way, and the solution on request. ``walk.branch`` is the branch so far, ``walk.status`` None while
        there is more to follow, ``walk.run()`` goes on to the end.

    Raises
    ------
    UnknownNameError, InputError, ConvergenceError
        As `continuation`; another parameter than that of the given branch.

    Notes
    -----
    The points are those of `continuation`, to the last digit: it is this walk, run to its end.

    Examples
    --------
    >>> import stability as st
    >>> walk = st.steps(st.Collocation(st.models.duffing(xi=0.02, beta=0.001)), "Omega", (0.3, 3.0))
    >>> for step in walk:
    ...     if st.Kind.FOLD in step.special:
    ...         break
    >>> walk.branch.labels, walk.status, next(walk).verdict.name
    (('LP1',), None, 'UNSTABLE')
    """
    asked = {"ds": ds, "ds_max": ds_max, "max_points": max_points, "at": at, "events": events, "stop_at": stop_at}
    if isinstance(problem, Branch):
        if name is not None and name != problem.name:
            raise unknown_name("continued parameter", name, [problem.name], "this branch")
        if start is not None:
            raise InputError("a branch goes on from its own ends: leave start= away")
        return _walk_on(problem, window, tolerance=tolerance, progress=None, **asked)
    checked_problem(problem)
    if name is None or window is None:
        raise InputError("which parameter, and from where to where? steps(problem, name, (from, to))")
    accuracy = 1e-9 if tolerance is None else tolerance
    return _walk(problem, start, checked(problem, name, window, tolerance=accuracy, progress=None, **asked))


def _walk_on(branch: Branch, window: Any, **asked: Any) -> Walk:
    """The walk from the ends of a branch, with its own steps and tolerance where none are given."""
    method = branch.method
    for key in ("ds", "ds_max", "tolerance"):
        if asked[key] is None:
            asked[key] = float(method[key])
    asked["ds"] = min(asked["ds"], asked["ds_max"])
    problem = branch._problems[branch.mesh_of[-1]]
    settings = checked(problem, branch.name, branch.window if window is None else window, **asked)
    return resumed(branch, settings)


# ---------------------------------------------------------------------- how the sides of a branch make a walk
def _walk(problem: Problem, start: Any, settings: Settings) -> Walk:
    """The walk along the branch of a problem, from its seed, the window's end or a solution inside the window."""
    seed = problem.seed()
    if seed is not None:
        if start is not None:
            raise InputError("this problem is born at a special point: it brings its own start, leave start= away")
        return _walk_from_seed(seed, settings)
    inside = inside_window(start, settings)
    first = first_point(problem, settings, start, settings.window[0] if inside is None else inside)
    ahead = Follower(settings, first)
    middle = Entry(first, ahead._value_at(first))

    def begin_behind() -> Follower:
        return Follower(settings, turned(Entry(first, None)).point)

    def from_wall(walk: Walk) -> Branch:
        return assemble(settings, [middle, *ahead.entries], (Status.PARAMETER_BOUND, ended(ahead)), (None, ahead))

    def both_ways(walk: Walk) -> Branch:
        if ahead.status is Status.CLOSED_LOOP:
            return assemble(settings, [middle, *ahead.entries], (Status.CLOSED_LOOP,) * 2, (None, ahead))
        behind = walk.side(1) or begin_behind()
        entries = [*(turned(e) for e in reversed(behind.entries)), middle, *ahead.entries]
        return assemble(settings, entries, (ended(behind), ended(ahead)), (behind, ahead))

    if inside is None:
        return Walk((ahead,), from_wall)
    return Walk((ahead, begin_behind), both_ways, alone=(Status.CLOSED_LOOP, Status.STOPPED))


def _walk_from_seed(seed: Seed, settings: Settings) -> Walk:
    """The walk along a branch that is born at a special point: one side, both, or one and its image."""
    if settings.events:
        seed = seed._replace(mirror=False)  # a user's function need not have the symmetry
    birth, (ahead, behind) = born_sides(seed, settings)
    if ahead is None and behind is None:
        raise ConvergenceError(
            f"no solution was found on the new branch near {settings.name} = {birth.parameter:.10g}; "
            "the point may be degenerate, or its branch may lie outside the window", last=birth.u,
        )
    two = seed.sides == 2
    mark = Found(birth, seed.kind, (birth.parameter, birth.parameter), 0.0, "", seed.mirror) if two else None
    middle = Entry(birth, mark)

    def together(walk: Walk) -> Branch:
        if seed.mirror and ahead is not None:
            entries, status = with_images(middle, ahead)
            return assemble(settings, entries, (status, status), (ahead, ahead))
        closed = ahead is not None and ahead.status is Status.CLOSED_LOOP
        after = _until_birth(ahead, birth) if ahead is not None and closed else ahead.entries if ahead else []
        before = [] if behind is None or closed else [turned(e) for e in reversed(behind.entries)]
        first = Status.CLOSED_LOOP if closed else ended(behind)
        if not two:
            first = Status.STOPPED
        return assemble(settings, [*before, middle, *after], (first, ended(ahead)), (None if closed else behind, ahead))

    return Walk((ahead, behind), together, alone=(Status.CLOSED_LOOP,))


def _until_birth(follower: Follower, birth: Point) -> list[Entry]:
    """The entries of a loop that came back to its branch point: it ends there, and the point is listed once."""
    entries = follower.entries
    end = entries[-1].point.s if entries else 0.0
    for k, (point, found) in enumerate(entries):
        again = found is not None and found.kind in (Kind.BRANCH_POINT, Kind.FOLD) and point.s > 0.9 * end
        if again and abs(point.parameter - birth.parameter) * birth.tangent.weight < 1e-5:
            return [*entries[:k], Entry(point, None)]
    return entries


# ---------------------------------------------------------------------- more of a branch, one solution
def extend(branch: Branch, *, max_points: int, window: Any, progress: Any) -> Branch:
    """What `Branch.extend` does: follow on from every end that can go on."""
    walk = _walk_on(
        branch, window, ds=None, ds_max=None, max_points=max_points, at=tuple(branch.method["at"]), events=(),
        stop_at=(), tolerance=None, progress=progress,
    )  # fmt: skip
    return walk.run().branch


def solve(problem: Problem, *, start: Any = None, tolerance: float = 1e-9, **params: float) -> Any:
    """One solution of a problem, as FixedPoint or PeriodicOrbit.

    Mesh, harmonics and samples of an orbit are adapted to it, as along a branch, where the problem is adaptive.

    Parameters
    ----------
    problem : Problem
    start : state, solution or None
        Something near the solution; None lets the problem look for one.
    tolerance : float
        Of Newton's method, as in `continuation`.
    **params : float
        Parameter values that differ from the defaults.

    Raises
    ------
    UnknownNameError, InputError
        A parameter the problem does not have; a system where a problem is needed.
    ConvergenceError
        Nothing converged; carries the last iterate.

    Examples
    --------
    >>> import stability as st
    >>> point = st.solve(st.Equilibrium(st.models.lorenz()), start=dict(x=1, y=1, z=20), rho=20.0)
    >>> round(point["z"], 9)
    19.0
    """
    from ..errors import check_names

    checked_problem(problem)
    names = list(problem.parameters)
    check_names("parameter", params, names, "this problem")
    vector = np.array([float(params.get(k, v)) for k, v in problem.parameters.items()])
    if not np.isfinite(vector).all():
        raise InputError(f"parameter values must be finite, got {dict(zip(names, vector.tolist()))}")
    seed = problem.seed()
    if seed is not None:
        raise InputError("a problem born at a special point is a branch, not one solution: give it to continuation")
    u = problem.start(vector, start)
    if not names:
        return problem.view(u, vector)
    found = problem.correct(u, vector, names[0], None, 0.0, tolerance)
    if not found.converged:
        raise ConvergenceError(
            f"no solution: {found.note}; give start= nearer to one, for example the end of a simulation",
            last=u, iterations=found.iterations, note=found.note,
        )
    problem, found = adapted_solution(problem, found, names[0], tolerance)
    return problem.view(found.u, found.params)
