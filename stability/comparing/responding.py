r"""`responses`: one oscillator, several methods, one call.

A method is a word:

    averaging, averaging2            slow flow of the first, second order (the response frequency kept)
    multiple-scales, multiple-scales2
    hb1, hb3, hb9, ...               harmonic balance with that many harmonics
    collocation, shooting            the full equations
    sweep, sweep-up, sweep-down      simulation along a slow sweep (sweep: both)

Each is computed on its own: an error of one is kept beside the results of the others. Branches are started at both ends
of the window (a second one counts if it is another), with `born` also those that leave at branch points and period
doublings. The reference is the first of collocation, shooting, harmonic balance with most harmonics, anything else.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

from ..analytic.slow_flow import averaging, multiple_scales
from ..errors import InputError, StabilityError, check_names, unknown_name
from ..following.driver import continuation
from ..following.families import families
from ..problems.collocation import Collocation
from ..problems.equilibria import Equilibrium
from ..problems.harmonic_balance import HarmonicBalance
from ..problems.shooting import Shooting
from ..problems.switching import switch
from ..results.branch import Branch
from ..results.comparison import Comparison, Difference
from ..results.measured import MeasuredResponse
from ..results.responses import Responses
from ..results.sweep import Sweep
from ..simulation.sweeping import sweep
from ..words import Kind
from .curves import Curves, default_quantity
from .overlay import difference, drawn

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["METHODS", "responses"]

METHODS = ("averaging", "averaging2", "multiple-scales", "multiple-scales2", "hb<harmonics>", "collocation",
           "shooting", "sweep", "sweep-up", "sweep-down")  # fmt: skip
_SLOW = {"averaging": (averaging, 1), "averaging2": (averaging, 2), "multiple-scales": (multiple_scales, 1),
         "multiple-scales2": (multiple_scales, 2)}  # fmt: skip
_USUAL = ("averaging", "hb3", "hb9", "collocation", "sweep")
_SMOOTH = 0.08  # longest step of a branch, so that it is a smooth curve in a picture
_NEAR = 1e-6  # of the window: two special points are one


def responses(
    system: System,
    parameter: str,
    window: tuple[float, float],
    methods: Iterable[str] = _USUAL,
    *,
    quantity: str | None = None,
    points: int = 81,
    born: bool = False,
    resonance: Any = None,
    small: Any = None,
    x0: Any = None,
    step: float | None = None,
    measured: MeasuredResponse | None = None,
    progress: Callable[[str], Any] | None = None,
) -> Responses:
    """The response of a forced oscillator over one parameter by several methods, and how far they are apart.

    Parameters
    ----------
    system : System
        Forced.
    parameter : str
        The continued or swept parameter.
    window : (from, to)
        Branches start at both ends.
    methods : sequence of str
        ``averaging``, ``averaging2``, ``multiple-scales``, ``multiple-scales2``, ``hb<harmonics>`` (hb3, hb9),
        ``collocation``, ``shooting``, ``sweep`` (up and down), ``sweep-up``, ``sweep-down``.
    quantity : str, optional
        Compared column, ``u.amplitude(1)`` or ``u.max``; by default the fundamental amplitude of the first coordinate.
    points : int
        How many values of the parameter the methods are compared at.
    born : bool
        Also follow the branches that are born at branch points and period doublings.
    resonance, small
        For the slow flows, as in `averaging`.
    x0 : state, optional
        Where sweeps start (a pendulum exactly at rest stays there).
    step : float, optional
        Step of the sweeps; by default a hundredth of the window.
    measured : MeasuredResponse, optional
        A measurement along the same parameter (`load_response`), laid over the reference like the methods.
    progress : callable, optional
        Called with each method as it begins.

    Returns
    -------
    Responses
        ``[method]`` -> branches or sweep, ``.table()``, ``.plot()``, ``.comparison``, ``.failures``.

    Raises
    ------
    InputError, UnknownNameError
        An autonomous system, no or unknown methods, one given twice, a parameter that does not exist; before any work.
        What goes wrong in one method stands in ``failures``.

    *Accuracy*: each branch has its own estimate (``Branch.error``); the differences are those of `compare`.

    Examples
    --------
    >>> import stability as st
    >>> found = st.responses(st.models.duffing(), "Omega", (0.9, 1.5), ("averaging", "collocation"), points=9)
    >>> found.comparison["averaging"].worst < 0.02, found.failures == {}
    (True, True)
    """
    words = _checked(system, parameter, window, methods)
    runs: dict[str, Callable[[], Any]] = {}
    for word in words:
        if word.startswith("sweep"):
            ends = window if word == "sweep-up" else (window[1], window[0])
            runs[word] = partial(sweep, system, parameter, ends, step=step, x0=x0)
        else:
            making = partial(_problem, word, system, resonance, small)
            runs[word] = partial(_branches, making, parameter, window, born)
    results: dict[str, Any] = {}
    failures: dict[str, StabilityError] = {}
    seconds: dict[str, float] = {}
    for word, run in runs.items():
        if progress is not None:
            progress(word)
        begun = time.perf_counter()
        try:
            results[word] = run()
        except StabilityError as error:
            failures[word] = error
        seconds[word] = time.perf_counter() - begun
    if measured is not None:
        results["measured"], seconds["measured"] = measured, 0.0
    return Responses(_compared(results, failures, parameter, quantity, points), failures, seconds)


def _checked(system: System, parameter: str, window: Any, methods: Iterable[str]) -> list[str]:
    """The methods, `sweep` as its two directions; every mistake that can be seen before any work."""
    if system.period_expression is None:
        raise InputError(
            f"'{system.name}' is autonomous: responses are those of a forced oscillator; follow its equilibria or "
            "limit cycles by continuation(Equilibrium(system), ...) or continuation(Collocation(system), ...)"
        )
    check_names("parameter", [parameter], system.parameters, f"'{system.name}'")
    try:
        low, high = (float(v) for v in window)
    except (TypeError, ValueError):
        raise InputError(f"the window is (from, to), two numbers; got {window!r}") from None
    if not low < high:
        raise InputError(f"the window needs from < to; got ({low:g}, {high:g})")
    for end in (low, high):
        system.parameter_vector(**{parameter: end})
    given = [methods] if isinstance(methods, str) else list(methods)
    if not given:
        raise InputError(f"give at least one method of {', '.join(METHODS)}")
    for word in given:
        if (word not in METHODS and not re.fullmatch(r"hb[1-9]\d{0,2}", str(word))) or word == "hb<harmonics>":
            raise unknown_name("method", word, METHODS, "responses")
    words = [w for word in given for w in (("sweep-up", "sweep-down") if word == "sweep" else (word,))]
    twice = next((w for w in words if words.count(w) > 1), None)
    if twice is not None:
        raise InputError(f"the method {twice} is given twice")
    return words


def _problem(word: str, system: System, resonance: Any, small: Any) -> Any:
    if word in _SLOW:
        verb, order = _SLOW[word]
        return Equilibrium(verb(system, order=order, resonance=resonance, small=small))
    if word.startswith("hb"):
        return HarmonicBalance(system, harmonics=int(word[2:]))
    return Collocation(system) if word == "collocation" else Shooting(system)


def _branches(
    making: Callable[[], Any], parameter: str, window: tuple[float, float], born: bool
) -> tuple[Branch, ...]:
    """Branches from both ends, and those that are born on them."""
    found = families(making(), parameter, window, places=0, ds_max=_SMOOTH)
    children: list[Branch] = []
    if not born:
        return found
    near = _NEAR * abs(window[1] - window[0])
    for branch in found:
        for point in branch.special:
            known = [p.params[parameter] for child in children for p in child.special if p.kind is Kind.BRANCH_POINT]
            place = point.params[parameter]
            if point.kind in (Kind.BRANCH_POINT, Kind.PERIOD_DOUBLING) and all(abs(k - place) > near for k in known):
                children.append(continuation(switch(point), parameter, window, ds_max=_SMOOTH))
    return (*found, *children)


def _rank(word: str) -> tuple[int, int]:
    """Which method is the reference: the smallest."""
    if word.startswith("hb"):
        return 2, -int(word[2:])
    order = {"collocation": 0, "shooting": 1, "averaging2": 3, "multiple-scales2": 4}
    return order.get(word, 5), 0


def _compared(
    results: dict[str, Any], failures: dict[str, StabilityError], parameter: str, quantity: str | None, points: int
) -> Comparison:
    """All results that have the quantity, laid over the reference; what has not goes to `failures`."""
    branches = sorted((w for w in results if isinstance(results[w], tuple)), key=_rank)
    while branches:
        reference = branches[0]
        try:
            base = Curves(reference, results[reference], quantity or default_quantity(results[reference][0]))
            break
        except StabilityError as error:
            failures[reference] = error
            del results[branches.pop(0)]
    else:
        return Comparison("", quantity or _swept(results), parameter, {}, tuple(results.values()), tuple(results))
    found: dict[str, Difference] = {}
    curves: dict[str, Any] = {reference: base.drawable()}
    for word, result in results.items():
        if word == reference:
            continue
        try:
            found[word] = difference(base, word, result, points)
            curves[word] = drawn(base.quantity, result)
        except StabilityError as error:
            failures[word] = error
    return Comparison(reference, base.quantity, parameter, found, tuple(curves.values()), tuple(curves))


def _swept(results: dict[str, Any]) -> str:
    """The fundamental amplitude of the first state, where there are sweeps only."""
    return next((f"{result.states[0]}.amplitude(1)" for result in results.values() if isinstance(result, Sweep)), "")
