r"""One side of a branch, point by point: predict, correct, check, detect, locate, adapt, stop.

`Follower` is an iterator over accepted points; everything found so far is in its `entries`, in order, whatever ends the
iteration. Walls are hard: a step whose prediction or result lies beyond a window end is replaced by a solve *at* that
end. The mesh is adapted at accepted points only, after the segment behind them has been searched, so that both ends of
a segment always share a mesh; an adaption that would change the counts (an event within the discretisation error of
this point) is put off to the next point.

Whatever goes wrong on the way, in a user's function or anywhere else, ends the iteration with a status and a `note`
that says what it was; points that were accepted are never lost.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import StabilityWarning
from ..protocols import Corrected, Problem, Tangent
from ..words import Kind, Status
from .edges import Edge
from .events import changes
from .locating import Found, Locator, chord_length
from .loops import Home, collapsed
from .monitoring import Monitor
from .points import Point, dot, make_point, rescaled, strode
from .searching import between, hopped
from .settings import Progress, Settings
from .stepping import KINK, Comparison, compare, next_length, predict
from .striding import Strides
from .walls import landing, on_wall
from .wanted import Wanted

__all__ = ["Entry", "Follower"]

Array = NDArray[np.float64]
_ADAPT_EVERY = 3
_GROWTH = 1e6
_STALL_POINTS, _STALL, _STALL_LENGTH = 8, 1e-8, 0.05
_PATIENCE = 6
_BEYOND_GRAZING = "the orbit grazes a stop, what lies beyond has other impacts: go on by switch"
_ONE = 1e-7  # two events nearer to each other than this are one


class Entry(NamedTuple):
    """A point of the branch; `found` tells what is special about it."""

    point: Point
    found: Found | None


class Follower(Iterator[Point]):
    """Follows one side of a branch from a first point whose tangent shows the way."""

    def __init__(
        self, settings: Settings, first: Point, *, past: Sequence[Point] = (), length: float | None = None,
        since_adapt: int = 0, home: Home | None = None, mirrored: bool = False, rate: float = 0.0,
    ) -> None:
        self.settings, self.last = settings, first
        self.before = past[0] if past else None
        self._older: list[Point] = list(past[1:])  # points before that one, latest first
        self._twin: Point | None = None  # `last` before its mesh was adapted
        self.length = settings.steps.first if length is None else length
        self.since_adapt = since_adapt
        self.entries: list[Entry] = []
        self.status: Status | None = None
        self.note = ""  # why the last step was shortened, or why the iteration ended
        self.interrupted = False
        self.accepted = 0
        self.mirrored = mirrored  # beyond its other end the branch repeats itself, shifted in time
        self.home = Home(first) if home is None else home
        self.locator = Locator(settings.name, settings.index, settings.tolerance, settings.steps.shortest)
        self._growth = 1.0
        self._rate = max(rate, float(np.abs(first.spectrum.values).max(initial=0.0)))
        self._norm = self._norm_of(first)
        self._extent: list[tuple[float, float]] = []
        self.wanted = Wanted(settings, self.locator, first)
        self._monitor, self._edge, self._strides = Monitor(first), Edge(), Strides(settings)
        self._seen: dict[str, int] = {}

    # ------------------------------------------------------------------ iteration
    def __iter__(self) -> Follower:
        return self

    def __next__(self) -> Point:
        if self.status is not None:
            raise StopIteration
        if len(self.entries) >= self.settings.max_points:
            self.status, self.note = Status.MAX_POINTS, f"max_points = {self.settings.max_points} reached"
            raise StopIteration
        step = None
        try:
            step = self._advance()
            if step is not None:
                self._take(*step)
                self._report(step[0])
        except Exception as error:  # noqa: BLE001 - nothing that is raised on the way may cost the points so far
            self._broken(error)
        if step is None:
            raise StopIteration
        return step[0]

    def _report(self, point: Point) -> None:
        if self.settings.progress is None:
            return
        events = sum(e.found is not None for e in self.entries)
        try:
            self.settings.progress(Progress(len(self.entries), point.parameter, self.length, events))
        except Exception as error:
            error.add_note("the progress function")
            raise

    def _broken(self, error: Exception) -> None:
        """End here, saying why, with a warning; the exception's note tells whose function raised it."""
        who = "".join(f"{note}: " for note in getattr(error, "__notes__", ())[:1])
        self.status, self.note = Status.STOPPED, f"{who}{type(error).__name__}: {error}"
        at = f"{self.settings.name} = {self.last.parameter:.10g}"
        warnings.warn(f"the branch stopped at {at}: {self.note}; its points are kept", StabilityWarning, stacklevel=2)

    def run(self) -> Follower:
        """Follow to the end; an interrupt from the keyboard ends the branch and keeps it."""
        try:
            for _ in self:
                pass
        except KeyboardInterrupt:
            self.interrupt()
        return self

    def interrupt(self) -> None:
        """End here, as by a keyboard interrupt."""
        self.status, self.interrupted, self.note = Status.STOPPED, True, "interrupted"

    # ------------------------------------------------------------------ one step
    def _advance(self) -> tuple[Point, Comparison, list[Found]] | None:
        h = min(self.length, self.settings.steps.longest)
        doubts = 0
        while h >= self.settings.steps.shortest:
            made = self._try(h)
            if isinstance(made, float):
                h *= made
                continue
            if self._monitor.alone:
                return *made, []
            end = self._edge.reached(self.locator, self.before, self.last, made[0])
            if isinstance(end, float):
                h *= end
                continue
            if end is not None:
                made = (end[1], made[1])
            if made[1].quiet and end is None:
                return *made, []
            found, doubtful = between(self.locator, self.before, self.last, made[0], self._twin)
            found = [f for f in found if not self._known(f)] + ([end[0]] if end is not None else [])
            strange = any(f.kind is Kind.UNEXPLAINED for f in found)
            if not (strange or doubtful) or doubts >= _PATIENCE:
                return *made, found
            if doubts and not strange and not hopped(self.locator, self.last, made[0]):
                return *made, found
            # a crossing was foretold and is not there, or one that nothing explains: is this point on another branch?
            self.note = "stability changes as no bifurcation explains, or another branch is close by"
            doubts += 1
            h = 0.3 * made[1].distance
        self.status = Status.STEP_TOO_SMALL
        self.note += getattr(self.last.problem, "doubt", "")
        return None

    def _try(self, h: float) -> tuple[Point, Comparison] | float:
        """An accepted point, or the factor by which to shorten the step."""
        settings, last = self.settings, self.last
        stride = self._strides.step(last, self._past, h, _ADAPT_EVERY - self.since_adapt, _ADAPT_EVERY)
        if stride is not None:
            point = strode(last, stride, settings.index)
            if point is not None:
                return point, Comparison(*stride[2:8], quiet=stride.quiet, rests=stride.rests)
        u, parameter = predict(last, self._past, h)
        landed = self._landed(parameter, u, h)
        if landed is not None:
            return landed
        params = last.params.copy()
        params[settings.index] = parameter
        try:
            found = last.problem.correct(u, params, settings.name, last.tangent, 0.0, settings.tolerance)
        except Exception as error:  # noqa: BLE001 - a right-hand side that ends somewhere: go nearer to that place
            self.note = f"{type(error).__name__}: {error}"
            return 0.4
        if not found.converged or found.tangent is None:
            self.note = found.note
            return 0.4
        landed = self._landed(float(found.params[settings.index]), found.u, h)
        return self._judged(found, found.tangent, h, (u, parameter)) if landed is None else landed

    def _landed(self, parameter: float, u: Array, h: float) -> tuple[Point, Comparison] | float | None:
        """A solve on the wall beyond which (u, parameter) lies; None: beyond none."""
        made = landing(self.last, partial(predict, self.last, self._past), self.settings, u, parameter, h)
        if made is None:
            return None
        if isinstance(made, str):
            self.note = made or self.note
            return 0.5
        return self._judged(*made)

    def _judged(
        self, found: Corrected, tangent: Tangent, h: float, guess: tuple[Array, float]
    ) -> tuple[Point, Comparison] | float:
        last, settings = self.last, self.settings
        point = make_point(last.problem, found, tangent, settings.index, last.s, h)
        if not np.isfinite(point.spectrum.values).all():
            known = getattr(last.problem, "evaluations", None)
            self.note = "multipliers or eigenvalues are not finite" + ("" if known is None else known.failure())
            return 0.4
        seen = compare(last, point, guess, self._rate)
        point = point._replace(s=last.s + seen.distance, step=seen.distance)
        if seen.worst > 1 and not h < KINK * settings.steps.longest:
            self.note = seen.reason
            return max(0.25, 0.8 / seen.worst)
        if seen.distance > 3 * h or seen.distance == 0:
            self.note = "Newton's method ends on another curve, or where it began"
            return 0.4
        return point, seen

    # ------------------------------------------------------------------ after a step
    def _take(self, point: Point, seen: Comparison, found: list[Found]) -> None:
        settings, last = self.settings, self.last
        back = self.home.reached(last, point, self.locator, self.accepted)
        if back is not None:
            point = back[0]
            found = [f for f in found if f.point.s <= point.s]
        failure: Exception | None = None
        if found or not seen.quiet or self.wanted.anything:
            try:
                found = self._with_wanted(last, point, found)
            except Exception as error:  # noqa: BLE001 - the point is sound, whatever a user's function makes of it
                failure = error
            if self._stops(found):
                return
            self._part(last, point, found)
        at_point = self._value_at(point)
        self.entries.append(Entry(point, at_point))
        self.accepted += 1
        self.home.remember(self.accepted, point)
        if not seen.quiet:  # a rate of eigenvalues: multipliers are compared on the sphere
            self._rate = max(self._rate, float(np.abs(point.spectrum.values).max(initial=0.0)))
        self.length = next_length(seen.distance, seen, last, point, settings.steps)
        if at_point is not None and self._named_stop(at_point):
            self.status, self.note = Status.STOPPED, "at a value that was to stop it"
        elif back is not None:
            self._close(back[1])
            return
        elif point.parameter in settings.window or on_wall(point):
            self.status, self.note = Status.PARAMETER_BOUND, ""
        elif (grown := self._runaway(point)):
            self.status, self.note = Status.DIVERGED, grown
        self._older = self._past[:2]
        self.before, self.last, self._twin = last, point, None
        if failure is not None:
            self._broken(failure)
        self.since_adapt += 1
        if self.since_adapt >= _ADAPT_EVERY and self.status is None:
            if seen.rests:
                self.since_adapt = 0
            else:
                self._adapt()

    def _close(self, loop: float) -> None:
        """End the branch where it began: what was followed a second time is dropped, the first point closes it."""
        self.status, self.note = Status.CLOSED_LOOP, ""
        first = self.home.marks[0][1]
        end = first.s + loop
        self.entries = [e for e in self.entries if e.point.s < end - 1e-9]
        self.entries.append(Entry(first._replace(s=end), None))
        self.last = first

    def _value_at(self, point: Point) -> Found | None:
        if point.parameter not in self.settings.at:
            return None
        return Found(point, Kind.USER, (point.parameter, point.parameter), 0.0)

    def _stops(self, found: list[Found]) -> bool:
        """Append what was found; True if the branch ends at one of them."""
        for one in found:
            previous = self.entries[-1].point if self.entries else self.last
            point = one.point._replace(step=max(one.point.s - previous.s, 0.0))
            crossing = self.mirrored and one.kind in (Kind.BRANCH_POINT, Kind.FOLD)
            met = collapsed(point) if crossing else None
            returned = met is not None
            if met is not None:  # the two families cross there
                one = one._replace(kind=Kind.BRANCH_POINT, name=met)
            self.entries.append(Entry(point, one._replace(point=point)))
            if returned or self._named_stop(one) or one.kind is Kind.GRAZING:
                self.status = Status.CLOSED_LOOP if returned else Status.STOPPED
                ends = _BEYOND_GRAZING if one.kind is Kind.GRAZING else f"at the {one.kind} that was to stop it"
                self.note = "" if returned else ends
                self.before, self.last = None, point
                return True
        if found and found[0].point.s < self.last.s:  # seen late: it belongs before the last point
            self.entries.sort(key=lambda e: e.point.s)
        return False

    def _part(self, a: Point, b: Point, found: list[Found]) -> None:
        """A point between neighbouring events of one step, so that the stretch between them has a verdict."""
        own = [f.point for f in found if f.kind is not Kind.USER and f.point.s > a.s]
        middles = [self.locator.on_curve(a, b, (0.5 * (p.s + q.s) - a.s) / (b.s - a.s)) for p, q in pairwise(own)]
        between = [m for m, (p, q) in zip(middles, pairwise(own)) if m is not None and p.s < m.s < q.s]
        if between:
            self.entries.extend(Entry(m, None) for m in between)
            self.entries.sort(key=lambda e: e.point.s)

    def _named_stop(self, found: Found) -> bool:
        prefix = found.kind.label
        self._seen[prefix] = self._seen.get(prefix, 0) + 1
        return bool({prefix, f"{prefix}{self._seen[prefix]}", found.name} & set(self.settings.stop_at))

    def _runaway(self, point: Point) -> str:
        """What makes going on senseless, or nothing."""
        size = self._norm_of(point)
        extent = self._extent
        extent.append((point.s, point.parameter))
        if not math.isfinite(size) or self._growth * size > _GROWTH * max(1.0, self._norm):
            return f"the solution has grown by more than {_GROWTH:g}"
        # a family that stands still in the parameter: a homoclinic orbit whose period grows, a vertical branch
        limit = _STALL / point.tangent.weight
        if len(extent) < _STALL_POINTS or abs(extent[-_STALL_POINTS][1] - point.parameter) >= limit:
            return ""
        recent = extent[-_STALL_POINTS:]
        values = [parameter for _, parameter in recent]
        if max(values) - min(values) < limit and point.s - recent[0][0] > _STALL_LENGTH:
            return f"the solutions change, but {self.settings.name} stands still at {point.parameter:.10g}"
        return ""

    @staticmethod
    def _norm_of(point: Point) -> float:
        return math.sqrt(dot(point.problem.weights, point.u, point.u))

    def _adapt(self) -> None:
        settings, old = self.settings, self.last
        better = old.problem.adapt(old.u, old.params, old.tangent)
        if better is None:
            self.since_adapt = 0
            return
        problem, u, tangent = better
        if u is old.u:
            self._rescale(problem)
            return
        found = problem.correct(u, old.params, settings.name, tangent, 0.0, settings.tolerance)
        if not found.converged or found.tangent is None:
            return
        parameter = float(found.params[settings.index])
        if not self.settings.low <= parameter <= self.settings.high:
            return
        new = make_point(problem, found, found.tangent, settings.index, old.s, old.step)
        if not changes(old, new).nothing:
            return  # an event lies within the discretisation error: leave the mesh until it is passed
        self._exchange(new)
        self._twin = old

    def _rescale(self, problem: Problem) -> None:
        """Other scales on the same mesh: nothing to solve, and the point before goes along."""
        old, new = self.last, rescaled(self.last, problem)
        past = [new, *(rescaled(p, problem) for p in self._past if p.problem is old.problem)]
        past = [p._replace(step=chord_length(q, p)) for p, q in pairwise(past)] + past[-1:]
        self._exchange(past[0])
        if len(past) > 1:
            self.before, self._older = past[1], past[2:]

    @property
    def _past(self) -> list[Point]:
        """The points before the last one, latest first."""
        return [] if self.before is None else [self.before, *self._older]

    def _exchange(self, new: Point) -> None:
        """Put `new` in the place of the last point."""
        old = self.last
        self._growth *= self._norm_of(old) / max(self._norm_of(new), 1e-300)
        self.since_adapt = 0
        self.last = new
        where = next(i for i in range(len(self.entries) - 1, -1, -1) if self.entries[i].point is old)
        self.entries[where] = Entry(new, self.entries[where].found)

    # ------------------------------------------------------------------ events of a segment
    def _with_wanted(self, a: Point, b: Point, found: list[Found]) -> list[Found]:
        """Also the parameter values and zeros of user functions asked for, between a, the found points and b."""
        own = [f for f in found if f.point.s >= a.s]
        knots = [a, *(f.point for f in sorted(own, key=lambda f: f.point.s)), b]
        found = found + self._monitor.zeros(self.locator, knots)
        if self.wanted.anything:
            found = found + self.wanted.between(knots)
        return sorted(found, key=lambda f: f.point.s)

    def _known(self, found: Found) -> bool:
        """Whether this event is among the entries already (a segment that is searched again)."""
        point, weight = found.point, self.settings.weight
        for entry in reversed(self.entries):
            known = entry.point
            if known.s < point.s - self.settings.steps.longest:
                return False
            if entry.found is None or entry.found.kind is not found.kind or known.u.size != point.u.size:
                continue
            # not by arclength: other scales measure it otherwise
            du, dl = known.u - point.u, (known.parameter - point.parameter) * weight
            if dot(point.problem.weights, du, du) + dl * dl < _ONE**2:
                return True
        return False
