r"""`continuation`: the one loop of this library that follows a curve; `extend` and `solve` beside it.

    F(u, lambda) = 0,   |(u', lambda')| = 1   in the norm   |(u, lambda)|^2 = <u, u> + (lambda / window width)^2.

The driver sees only `protocols.Problem`. Without a seed it starts at the first end of the window and goes inward; a
problem with a seed is followed from its birth point, on one side or on both, and the halves are joined before special
points are labelled. The window is a pair of hard walls, reached exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError
from ..protocols import Corrected, Problem, Seed, Tangent
from ..results.branch import Branch
from ..words import Kind, Status
from .assembly import assemble, resumed
from .follower import Entry, Follower
from .images import with_images
from .locating import Found
from .points import Point, dot, make_point, smooth_tests, tangent_of
from .settings import Settings, checked

__all__ = ["continuation", "extend", "followers", "solve"]

Array = NDArray[np.float64]


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
        Functions solution -> float; their zeros are located (``Kind.USER``, named).
    stop_at : tuple
        Kinds, labels ("PD", "PD2") or event names at which to stop; the branch then ends at that point.
    tolerance : float
        Of Newton's method: the last update relative to 1 + |u|, in the scaled norm.
    progress : callable or None
        Called after every accepted point with a `Progress` (points, parameter, step, special).

    Returns
    -------
    Branch
        With a status. Trouble along the way ends the branch and keeps its points, a keyboard interrupt too.

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
    seed = problem.seed()
    if seed is not None:
        if start is not None:
            raise InputError("this problem is born at a special point: it brings its own start, leave start= away")
        return _from_seed(seed, settings)
    inside = _inside_window(start, settings)
    first = _first_point(problem, settings, start, settings.window[0] if inside is None else inside)
    ahead = Follower(settings, first)
    mark = ahead._value_at(first)
    ahead.run()
    if inside is None:
        entries = [Entry(first, mark), *ahead.entries]
        return assemble(settings, entries, (Status.PARAMETER_BOUND, _ended(ahead)), (None, ahead))
    if ahead.status in (Status.CLOSED_LOOP, Status.STOPPED):
        entries = [Entry(first, mark), *ahead.entries]
        return assemble(settings, entries, (_ended(ahead), _ended(ahead)), (None, ahead))
    behind = Follower(settings, _turned(Entry(first, None)).point).run()
    entries = [*(_turned(e) for e in reversed(behind.entries)), Entry(first, mark), *ahead.entries]
    return assemble(settings, entries, (_ended(behind), _ended(ahead)), (behind, ahead))


def _inside_window(start: Any, settings: Settings) -> float | None:
    """The parameter value of a start that is a solution from inside the window; None for any other start."""
    value = getattr(start, "params", {}).get(settings.name)
    return value if value is not None and settings.low < value < settings.high else None


def followers(problem: Problem, name: str, window: tuple[float, float], **options: Any) -> tuple[Follower, ...]:
    """The steppable form of `continuation`: one iterator over accepted points per side, options as there.

    Each follower's ``entries`` and ``status`` tell what it has found so far.
    """
    start = options.pop("start", None)
    given = {"ds": None, "ds_max": None, "max_points": 2000, "at": (), "events": (), "stop_at": (), "tolerance": 1e-9}
    settings = checked(problem, name, window, **{**given, "progress": None, **options})
    seed = problem.seed()
    if seed is None:
        return (Follower(settings, _first_point(problem, settings, start, settings.window[0])),)
    return tuple(f for f in _sides(seed, settings)[1] if f is not None)


def _ended(follower: Follower | None) -> Status:
    """The status of a side; one that never made a step could not leave its first point."""
    if follower is None or follower.status is None:
        return Status.STEP_TOO_SMALL
    return follower.status


# ---------------------------------------------------------------------- the first point
def _params_of(problem: Problem) -> Array:
    return np.array(list(problem.parameters.values()), dtype=float)


def _first_point(problem: Problem, settings: Settings, start: Any, value: float) -> Point:
    """A corrected solution at a parameter value, its tangent pointing to the far end of the window."""
    params = _params_of(problem)
    params[settings.index] = value
    u = problem.start(params, start)
    found = problem.correct(u, params, settings.name, None, 0.0, settings.tolerance)
    if not found.converged:
        raise ConvergenceError(
            f"no solution at {settings.name} = {value:g}: {found.note}; give start= nearer to a solution, "
            "or begin at another end of the window",
            last=u, iterations=found.iterations, note=found.note,
        )
    inward = math.copysign(1.0, settings.window[1] - settings.window[0])
    found, tangent = _with_tangent(problem, found, settings, inward)
    better = problem.adapt(found.u, found.params, tangent)
    if better is not None:
        u, old = better[1], found
        problem = better[0]
        found = problem.correct(u, old.params, settings.name, None, 0.0, settings.tolerance)
        if not found.converged:
            raise ConvergenceError(f"the first solution was lost when its mesh was adapted: {found.note}", last=old.u)
        found, tangent = _with_tangent(problem, found, settings, inward)
    return make_point(problem, found, tangent, settings.index, 0.0, 0.0)


def _with_tangent(
    problem: Problem, found: Corrected, settings: Settings, inward: float
) -> tuple[Corrected, Tangent]:
    """The unit tangent of a fixed-parameter solve, and its determinant's sign turned into that of the bordered one."""
    w, weight = problem.weights, settings.weight
    if found.tangent is not None:
        size = math.sqrt(dot(w, found.tangent.u, found.tangent.u) + weight**2) * inward
        if math.isfinite(size) and abs(size) < 1e8 * weight:
            sign = int(math.copysign(1, inward)) * found.determinant_sign
            return found._replace(determinant_sign=sign), Tangent(found.tangent.u / size, 1.0 / size, weight)
    # a fold at the very start: the tangent lies across the parameter
    L = problem.linearise(found.u, found.params)
    random = np.random.default_rng(0).standard_normal(found.u.size) * (w > 0)
    random /= math.sqrt(dot(w, random, random)) or 1.0
    tangent = tangent_of(problem, L, settings.name, (random, inward / weight), weight)
    if tangent is None:
        raise ConvergenceError(
            f"the solution at {settings.name} = {settings.window[0]:g} is singular (a branch point); "
            "begin a little away from it", last=found.u,
        )
    if tangent.parameter * inward < 0:
        tangent = Tangent(-tangent.u, -tangent.parameter, weight)
    return found._replace(determinant_sign=0), tangent


# ---------------------------------------------------------------------- born at a special point
def _from_seed(seed: Seed, settings: Settings) -> Branch:
    if settings.events:
        seed = seed._replace(mirror=False)  # a user's function need not have the symmetry
    birth, (ahead, behind) = _sides(seed, settings)
    if ahead is not None:
        ahead.run()
    if ahead is not None and ahead.status is Status.CLOSED_LOOP:
        behind = None  # the loop came back along the other side
        _end_at_birth(ahead, birth)
    if behind is not None and not (ahead is not None and ahead.interrupted):
        behind.run()
    if ahead is None and behind is None:
        raise ConvergenceError(
            f"no solution was found on the new branch near {settings.name} = {birth.parameter:.10g}; "
            "the point may be degenerate, or its branch may lie outside the window", last=birth.u,
        )
    two = seed.sides == 2
    mark = Found(birth, seed.kind, (birth.parameter, birth.parameter), 0.0, "", seed.mirror) if two else None
    if seed.mirror and ahead is not None:
        entries, status = with_images(Entry(birth, mark), ahead)
        return assemble(settings, entries, (status, status), (ahead, ahead))
    entries = [Entry(birth, mark), *(ahead.entries if ahead else [])]
    if behind is not None:
        entries = [_turned(e) for e in reversed(behind.entries)] + entries
    closed = ahead is not None and ahead.status is Status.CLOSED_LOOP
    interrupted = ahead is not None and ahead.interrupted
    first = Status.CLOSED_LOOP if closed and two else Status.STOPPED if interrupted or not two else _ended(behind)
    return assemble(settings, entries, (first, _ended(ahead)), (behind, ahead))


def _end_at_birth(follower: Follower, birth: Point) -> None:
    """A loop that came back to its branch point ends there, and the point is listed once."""
    end = follower.entries[-1].point.s if follower.entries else 0.0
    for k, (point, found) in enumerate(follower.entries):
        again = found is not None and found.kind in (Kind.BRANCH_POINT, Kind.FOLD) and point.s > 0.9 * end
        if again and abs(point.parameter - birth.parameter) * birth.tangent.weight < 1e-5:
            follower.entries[k:] = [Entry(point, None)]
            return


def _turned(entry: Entry) -> Entry:
    """The same point, passed in the other direction."""
    p = entry.point
    t = Tangent(-p.tangent.u, -p.tangent.parameter, p.tangent.weight)
    return Entry(p._replace(tangent=t, s=-p.s, determinant_sign=-p.determinant_sign), entry.found)


def _sides(seed: Seed, settings: Settings) -> tuple[Point, tuple[Follower | None, Follower | None]]:
    """The birth point and a follower that has made its first step on each side (None where that failed)."""
    if settings.name != seed.free:
        raise InputError(
            f"this branch is born at a point found along '{seed.free}': continue it in '{seed.free}' first, then start "
            f"from one of its solutions in '{settings.name}'"
        )
    problem, weight = seed.problem, settings.weight
    w, params = problem.weights, np.array(seed.params, dtype=float)
    at = float(params[settings.index])
    if not settings.low <= at <= settings.high:
        window = f"({settings.low:g}, {settings.high:g})"
        raise InputError(f"the branch is born at {settings.name} = {at:.10g}, outside the window {window}")
    size = math.sqrt(dot(w, seed.tangent, seed.tangent) + (seed.parameter * weight) ** 2)
    tangent = Tangent(seed.tangent / size, seed.parameter / size, weight)
    # an orbit born at a Hopf point has no direction of flow at its birth: its spectrum is taken just beside it
    beside = seed.u if seed.sides == 2 else seed.u + 1e-4 * tangent.u
    spectrum = problem.spectrum(problem.linearise(beside, params))
    tests = smooth_tests(spectrum.values, problem.critical.circle)
    birth = Point(problem, seed.u, params, at, tangent, spectrum, tests, 0, 0.0, 0, 0.0, 0.0)
    ahead = _first_step(seed, birth, settings, 1.0)
    behind = _first_step(seed, birth, settings, -1.0) if seed.sides == 2 and not seed.mirror else None
    if ahead is None and (seed.sides == 1 or seed.mirror):
        ahead = _first_step(seed, birth, settings, -1.0)
    return birth, (ahead, behind)


def _first_step(seed: Seed, birth: Point, settings: Settings, side: float) -> Follower | None:
    """A short step along the new direction, kept away from the old branch; its length is found by trial."""
    t = birth.tangent
    if side < 0:
        t = Tangent(-t.u, -t.parameter, t.weight)
    problem, w, weight = birth.problem, birth.problem.weights, t.weight
    normal = t
    if seed.avoid is not None:
        old_u, old_l = seed.avoid
        size = math.sqrt(dot(w, old_u, old_u) + (weight * old_l) ** 2)
        c = (dot(w, t.u, old_u) + t.parameter * old_l * weight**2) / size**2
        u, parameter = t.u - c * old_u, t.parameter - c * old_l
        size = math.sqrt(dot(w, u, u) + (weight * parameter) ** 2)
        if size > 1e-3:
            normal = Tangent(u / size, parameter / size, weight)
    h = settings.steps.first
    while h > 1e-14:
        params = birth.params.copy()
        params[settings.index] += h * t.parameter
        found = problem.correct(birth.u + h * t.u, params, settings.name, normal, 0.0, settings.tolerance)
        point = _first_accepted(birth, t, found, settings, h)
        if point is not None:
            follower = Follower(settings, point, length=2 * point.step, mirrored=seed.sides == 1 or seed.mirror)
            follower.entries.append(Entry(point, None))
            follower._adapt()
            return follower
        h *= 0.25
    return None


def _first_accepted(birth: Point, t: Tangent, found: Corrected, settings: Settings, h: float) -> Point | None:
    """The first point of a side if it lies along `t` and inside the window."""
    if not found.converged or found.tangent is None:
        return None
    parameter = float(found.params[settings.index])
    if not settings.low <= parameter <= settings.high:
        return None
    w, weight = birth.problem.weights, t.weight
    du, dl = found.u - birth.u, (parameter - birth.parameter) * weight
    length = math.sqrt(dot(w, du, du) + dl * dl)
    along = dot(w, t.u, du) + t.parameter * weight * dl
    turn = dot(w, t.u, found.tangent.u) + t.parameter * found.tangent.parameter * weight**2
    if not (0.9 * length < along and 0.3 * h < length < 3 * h and abs(turn) > 0.9):
        return None
    tangent, sign = found.tangent, found.determinant_sign
    if turn < 0:
        tangent, sign = Tangent(-tangent.u, -tangent.parameter, weight), -sign
    turned = found._replace(determinant_sign=sign)
    return make_point(birth.problem, turned, tangent, settings.index, length, length)


# ---------------------------------------------------------------------- more of a branch, one solution
def extend(branch: Branch, *, max_points: int, window: Any, progress: Any) -> Branch:
    """What `Branch.extend` does: follow on from every end that can go on."""
    problem = branch._problems[branch.mesh_of[-1]]
    method = branch.method
    settings = checked(
        problem, branch.name, branch.window if window is None else window, ds=float(method["ds"]),
        ds_max=float(method["ds_max"]), max_points=max_points, at=tuple(method["at"]), events=(), stop_at=(),
        tolerance=float(method["tolerance"]), progress=progress,
    )
    return resumed(branch, settings)


def solve(problem: Problem, *, start: Any = None, tolerance: float = 1e-9, **params: float) -> Any:
    """One solution of a problem, as FixedPoint or PeriodicOrbit.

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
    UnknownNameError
        A parameter the problem does not have.
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
    return problem.view(found.u, found.params)
