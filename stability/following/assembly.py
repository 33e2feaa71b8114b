r"""From what the followers found to a frozen `Branch`: arrays, labels, and what is needed to go on later."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..protocols import Tangent
from ..results.branch import Branch
from ..results.special import SpecialPoint
from ..words import Kind, Status, Verdict
from .follower import Entry, Follower
from .locating import Found, chord_length
from .loops import Home
from .points import Point, dot, rescaled, smooth_tests
from .settings import Settings
from .sharpening import sharpened
from .walking import Walk, ended
from .walls import on_wall

__all__ = ["assemble", "resumed", "turned"]

Array = NDArray[np.float64]
_MERGE = 1e-10
_TWINS = (1e-5, 2e-2)  # how far apart a fold and a branch point that may be one can be: parameter, arclength
_PAST = 4  # points that the predictor looks at
_CRITICAL = (Kind.FOLD, Kind.BRANCH_POINT, Kind.PERIOD_DOUBLING, Kind.NEIMARK_SACKER, Kind.HOPF)


def _merged(entries: list[Entry]) -> list[Entry]:
    """Without points that repeat their neighbour; what is special about either is kept."""
    kept: list[Entry] = []
    for entry in entries:
        if kept and _same(kept[-1].point, entry.point):
            if entry.found is None:
                continue
            if kept[-1].found is None:
                kept[-1] = entry
                continue
            if entry.found.kind is kept[-1].found.kind:
                continue
        kept.append(entry)
    return kept


def _without_twins(entries: list[Entry]) -> list[Entry]:
    """A branch is vertical where it crosses its parent at a pitchfork: a fold found beside that point is the point.

    A mesh that is not the same in both halves of a symmetric orbit unfolds the pitchfork by its error.
    """
    folds, crossings = (
        [k for k, e in enumerate(entries) if e.found is not None and e.found.kind is kind]
        for kind in (Kind.FOLD, Kind.BRANCH_POINT)
    )
    drop = {i for i in folds if any(_twins(entries[i].point, entries[j].point) for j in crossings)}
    return [e for k, e in enumerate(entries) if k not in drop]


def _twins(fold: Point, crossing: Point) -> bool:
    gap, apart = abs(fold.parameter - crossing.parameter) * fold.tangent.weight, abs(fold.s - crossing.s)
    if not (gap < _TWINS[0] and apart < _TWINS[1]):
        return False
    errors = [r.problem.error(r.u, r.params) for r in (fold, crossing)]
    error = max((e for e in errors if math.isfinite(e)), default=0.0)
    return gap < 3 * error or (gap < 1e-8 and apart < 2e-4 + 100 * math.sqrt(error))


def _same(p: Point, q: Point) -> bool:
    if p.u.size != q.u.size or p.problem is not q.problem:
        return False
    gap = abs(p.parameter - q.parameter) * p.tangent.weight
    if gap > _MERGE:
        return False
    du = p.u - q.u
    return math.sqrt(dot(p.problem.weights, du, du)) + gap <= _MERGE


def _labelled(settings: Settings, entries: list[Entry]) -> tuple[list[SpecialPoint], list[int]]:
    counts: dict[Kind, int] = {}
    special: list[SpecialPoint] = []
    marks: list[int] = []
    for entry in entries:
        found = entry.found
        if found is None:
            marks.append(-1)
            continue
        counts[found.kind] = counts.get(found.kind, 0) + 1
        marks.append(len(special))
        special.append(_special(settings, entry.point, found, f"{found.kind.label}{counts[found.kind]}"))
    return special, marks


def _special(settings: Settings, point: Point, found: Found, label: str) -> SpecialPoint:
    problem = point.problem
    return SpecialPoint(
        kind=found.kind,
        label=label,
        params=dict(zip(problem.parameters, point.params.tolist())),
        multipliers=_whole(problem, point.spectrum.values),
        half_multipliers=point.spectrum.values if getattr(problem, "halved", False) else None,
        breaking=True if found.breaking else None,
        bracket=found.bracket,
        free=settings.name,
        u=point.u,
        direction=point.tangent.u,
        rate=point.tangent.parameter,
        source=problem,
        accuracy=found.accuracy,
        name=found.name,
    )


def _whole(problem: Any, values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Multipliers of the whole period, also where an orbit is solved on half of it."""
    return values**2 if getattr(problem, "halved", False) else values


def _verdict(entry: Entry) -> Verdict:
    """At a bifurcation a value sits on the limit: unstable if another one is clearly outside, else undetermined."""
    spectrum, found = entry.point.spectrum, entry.found
    if found is None or found.kind not in _CRITICAL or not spectrum.values.size:
        return spectrum.verdict
    values = spectrum.values
    circle = entry.point.problem.critical.circle
    excess = np.abs(values) - 1 if circle else values.real / (np.abs(values).max() or 1.0)
    return Verdict.UNSTABLE if float(excess.max()) > 1e-5 + 100 * spectrum.error else Verdict.UNDETERMINED


def _resume_data(follower: Follower | None) -> dict[str, Any] | None:
    if follower is None:
        return None
    return {"length": float(follower.length), "since_adapt": follower.since_adapt, "mirrored": follower.mirrored}


def _note(follower: Follower | None) -> str:
    """Why a side ended, in words."""
    if follower is None:
        return ""
    end = "not followed to its end yet" if follower.status is None else follower.note
    return "; ".join(part for part in (end, follower.wanted.note) if part)


def _rows(spectra: list[NDArray[np.complex128]]) -> NDArray[np.complex128]:
    """(K, n): one below the other; shorter ones end in nan."""
    width = max(map(len, spectra), default=0)
    if all(len(one) == width for one in spectra):
        return np.concatenate(spectra).astype(complex, copy=False).reshape(len(spectra), width)
    out = np.full((len(spectra), width), np.nan, dtype=complex)
    for row, one in zip(out, spectra):
        row[: len(one)] = one
    return out


def assemble(
    settings: Settings,
    entries: list[Entry],
    statuses: tuple[Status, Status],
    ends: tuple[Follower | None, Follower | None],
    notes: tuple[str, str] | None = None,
) -> Branch:
    """The branch that these entries are; `notes` say why it ended on either side, by default what the followers say."""
    entries = [sharpened(settings, e) for e in _without_twins(_merged(entries))]
    special, marks = _labelled(settings, entries)
    points = [e.point for e in entries]
    meshes: dict[int, Any] = {}
    mesh_of = []
    order: dict[int, int] = {}
    for p in points:
        key = id(p.problem)
        if key not in order:
            order[key] = len(order)
            meshes[order[key]] = p.problem
        mesh_of.append(order[key])
    halved = [getattr(meshes[i], "halved", False) for i in range(len(meshes))]
    values = _rows([p.spectrum.values for p in points])
    halves = values if any(halved) else None
    if halves is not None:
        values = np.where(np.array(halved)[mesh_of][:, None], halves**2, halves)
    first = points[0]
    s0 = first.s
    method = {
        "problem": type(first.problem).__name__,
        "tolerance": settings.tolerance,
        "ds": settings.steps.first,
        "ds_max": settings.steps.longest,
        "scale": 1.0 / settings.weight,
        "state_scales": np.asarray(getattr(first.problem, "scales", ())).tolist(),
        "circle": first.problem.critical.circle,
        "at": list(settings.at),
        "resume": [_resume_data(f) for f in ends],
        "notes": [_note(f) for f in ends] if notes is None else list(notes),
    }
    for p in points:
        for array in (p.u, p.tangent.u):
            array.setflags(write=False)
    return Branch(
        name=settings.name,
        window=settings.window,
        parameter=np.array([p.parameter for p in points]),
        rates=np.array([p.tangent.parameter for p in points]),
        arclength=np.array([p.s - s0 for p in points]),
        unknowns=tuple(p.u for p in points),
        tangents=tuple(p.tangent.u for p in points),
        meshes=tuple(meshes[i] for i in range(len(meshes))),
        mesh_of=np.array(mesh_of),
        params=dict(zip(first.problem.parameters, first.params.tolist())),
        values=values,
        half_values=halves,
        value_errors=np.array([p.spectrum.error for p in points]),
        verdicts=tuple(_verdict(e) for e in entries),
        residuals=np.array([p.residual for p in points]),
        iterations=np.array([p.iterations for p in points]),
        marks=np.array(marks),
        special=tuple(special),
        statuses=statuses,
        method=method,
    )


# ---------------------------------------------------------------------- going on
def _point_from(branch: Branch, i: int, settings: Settings, step: float, sign: int) -> Point:
    """A stored point as the driver knew it; its spectrum and determinant are computed again."""
    problem, u, params = branch._problem(i), branch.unknowns[i], branch._vector(i)
    direction, rate = branch.tangents[i], float(branch.rates[i])
    length = math.sqrt(dot(problem.weights, direction, direction) + (rate * settings.weight) ** 2)
    tangent = Tangent(sign * direction / length, sign * rate / length, settings.weight)
    again = problem.correct(u, params, settings.name, tangent, 0.0, settings.tolerance)
    spectrum = problem.spectrum(problem.linearise(u, params))
    tests = smooth_tests(spectrum.values, problem.critical.circle)
    s = sign * float(branch.arclength[i])
    return Point(
        problem, u, params, float(branch.parameter[i]), tangent, spectrum, tests, again.determinant_sign,
        float(branch.residuals[i]), int(branch.iterations[i]), s, step,
    )


def _entry_from(branch: Branch, i: int, settings: Settings) -> Entry:
    point = _point_from(branch, i, settings, 0.0, 1)
    mark = int(branch.marks[i])
    if mark < 0:
        return Entry(point, None)
    special = branch.special[mark]
    breaking = bool(special.breaking)
    return Entry(point, Found(point, special.kind, special.bracket, special.accuracy, special.name, breaking))


def _restarted(branch: Branch, settings: Settings, end: int) -> Follower | None:
    """A follower that goes on from the last (end 1) or, backwards, from the first point (end 0)."""
    status, resume = branch.statuses[end], branch.method["resume"][end]
    at_wall = status is Status.PARAMETER_BOUND
    i = len(branch) - 1 if end else 0
    inside = settings.low < branch.parameter[i] < settings.high
    if resume is None or status is Status.CLOSED_LOOP or (at_wall and not inside):
        return None
    if branch.marks[i] >= 0 and branch.special[branch.marks[i]].kind is Kind.GRAZING:
        return None  # beyond it these solutions mean nothing
    sign, inward = (1, -1) if end else (-1, 1)
    chain = [_point_from(branch, i, settings, 0.0, sign)]
    if at_wall and on_wall(chain[0]):
        return None
    k = i + inward
    while 0 <= k < len(branch) and len(chain) < _PAST:
        # neighbours as the driver met them: accepted points only, on one mesh
        if branch.marks[k] < 0 or branch.special[branch.marks[k]].kind is Kind.USER:
            point, problem = _point_from(branch, k, settings, 0.0, sign), chain[0].problem
            if not _differ_in_scales(point.problem, problem):
                break
            chain.append(point if point.problem is problem else rescaled(point, problem))
        k += inward
    chain = [p._replace(step=chord_length(q, p)) for p, q in pairwise(chain)] + chain[-1:]
    other = _point_from(branch, 0 if end else len(branch) - 1, settings, 0.0, sign)
    return Follower(
        settings, chain[0], past=chain[1:], length=float(resume["length"]), since_adapt=int(resume["since_adapt"]),
        home=Home(other), mirrored=bool(resume.get("mirrored", False)),
        rate=float(np.nanmax(np.abs(branch.values), initial=0.0)),
    )


def _differ_in_scales(one: Any, other: Any) -> bool:
    """Whether two problems are the same, or would be with the same scales."""
    if one is other:
        return True
    scales = ("scales", "period_scale")
    return {k: v for k, v in one.spec.items() if k not in scales} == {
        k: v for k, v in other.spec.items() if k not in scales
    }


def resumed(branch: Branch, settings: Settings) -> Walk:
    """The walk that goes on from every end of the branch that can go on (see `Branch.extend`)."""
    entries = [_entry_from(branch, i, settings) for i in range(len(branch))]
    behind, ahead = (_restarted(branch, settings, end) for end in (0, 1))

    def together(walk: Walk) -> Branch:
        before = [] if behind is None else [turned(e) for e in reversed(behind.entries)]
        after = [] if ahead is None else ahead.entries
        sides = zip((behind, ahead), branch.statuses, branch.messages)
        told = [(status, note) if f is None else (ended(f), _note(f)) for f, status, note in sides]
        (first, one), (last, other) = told
        return assemble(settings, [*before, *entries, *after], (first, last), (behind, ahead), (one, other))

    return Walk((behind, ahead), together)


def turned(entry: Entry) -> Entry:
    """The same point, passed in the other direction."""
    p = entry.point
    t = Tangent(-p.tangent.u, -p.tangent.parameter, p.tangent.weight)
    return Entry(p._replace(tangent=t, s=-p.s, determinant_sign=-p.determinant_sign), entry.found)
