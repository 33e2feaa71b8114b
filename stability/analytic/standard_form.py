r"""The standard form for averaging: weakly nonlinear oscillators that respond at multiples of one base frequency.

    q_i'' + omega_i^2 q_i = eps g_i1(q, q', t) + eps^2 g_i2(q, q', t) + ...,       i = 1 ... n

with the scaling orders of the system (parameters and states). nu = w/P is the base frequency, w = 2 pi/T(p) that of
the forcing; coordinate i answers at K_i nu. A resonance ``(p, q)`` means excitation : response = p : q for the slowest
coordinate, P = p, K_i = q k_i with k_i the nearest integer to omega_i/omega_min (2:1: the pendulum swings at half the
excitation frequency and the primary mass, twice as fast, at the excitation frequency); a mapping gives (p, q) for each
coordinate by name. The detuning (K_i nu)^2 - omega_i^2 is of order eps.

Forcing of order 0 that is not in resonance moves each coordinate by the linear response h_i(t) of order 0 (hard
excitation), q_i = h_i + y_i; forcing in resonance must be of order eps. The first order step eps is the lowest positive
order that occurs. References: Nayfeh and Mook (1979), chapters 4-6; Verhulst (1996), chapter 11.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import sympy as sp

from ..errors import EquationError, InputError, check_names
from ..systems.equations import TIME, symbol
from .monomials import Monomial, forcing_of, monomials, readable, with_harmonics
from .scales import graded

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["Small", "StandardForm", "standard_form"]

Small = str | Iterable[str] | Mapping[str, int] | None
Resonance = tuple[int, int] | Mapping[str, tuple[int, int]] | None


@dataclass(frozen=True)
class StandardForm:
    """The oscillators of the module's head, as monomials (harmonics counted in the base frequency)."""

    system: System
    base_frequency: sp.Expr
    multiples: tuple[int, ...]
    stiffness: tuple[sp.Expr, ...]
    orders: tuple[tuple[tuple[Monomial, ...], ...], ...]
    hard: tuple[Mapping[int, tuple[sp.Expr, sp.Expr]], ...]
    ratio: tuple[int, int]
    exact: bool = False  # other harmonics by omega_i^2 itself, for coordinates that are not near their resonance

    @property
    def states(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the coordinates, then of the velocities."""
        names = self.system.coordinates
        return tuple(symbol(c) for c in names) + tuple(symbol(f"{c}_dot") for c in names)


def scaling_orders(system: System, small: Small) -> dict[sp.Symbol, int]:
    """Symbol -> order from `small` or the system's own `orders`; a velocity follows its coordinate."""
    if small is None:
        given: dict[str, int] = dict(system.orders)
        if not given:
            names = ", ".join(system.parameters)
            raise InputError(
                f"'{system.name}' declares no scaling orders, so that averaging does not know what is small: name the "
                f"small parameters, small=('...',) or small=dict(name=order), among {names} (and states)"
            )
    elif isinstance(small, Mapping):
        given = {k: int(v) for k, v in small.items()}
        if any(int(v) != v for v in small.values()):
            raise InputError(f"scaling orders are integers; got {dict(small)}")
    else:
        given = dict.fromkeys([small] if isinstance(small, str) else list(small), 1)
    check_names("parameter or state", given, [*system.parameters, *system.states], f"'{system.name}'")
    if not any(o > 0 for o in given.values()):
        raise InputError(f"no parameter of '{system.name}' is small: one scaling order at least must be positive")
    for c in system.coordinates:
        if c in given:
            given.setdefault(f"{c}_dot", given[c])
    return {symbol(k): o for k, o in given.items() if o != 0}


def check_oscillators(system: System) -> None:
    """Refuse what has no oscillators to average: Python functions, first-order states, walls."""
    if system.rhs is None:
        raise EquationError(
            f"'{system.name}' is a Python function: averaging needs expressions; use HarmonicBalance(system)"
        )
    expected = (*system.coordinates, *(f"{c}_dot" for c in system.coordinates))
    if set(system.states) != set(expected):
        odd = next(s for s in (*system.states, *expected) if (s in system.states) != (s in expected))
        first = odd.removesuffix("_dot")
        raise EquationError(
            f"'{first}' of '{system.name}' has an equation of first order: averaging needs oscillators q'' = f; "
            "use HarmonicBalance(system)"
        )
    if system.stops:
        raise EquationError(f"'{system.name}' has hard stops, which averaging does not know; use Collocation(system)")


def graded_rows(
    system: System, orders: Mapping[sp.Symbol, int], number: int
) -> tuple[list[dict[Fraction, list[Monomial]]], Fraction]:
    """For each coordinate: order -> monomials of its acceleration, relative to that of the coordinate; the step."""
    check_oscillators(system)
    assert system.rhs is not None
    rows = dict(zip(system.states, system.rhs))
    states = [symbol(s) for s in (*system.coordinates, *(f"{c}_dot" for c in system.coordinates))]
    frequency = None if system.period_expression is None else 2 * sp.pi / system.period_expression
    moving = frozenset({*states, TIME})
    accelerations = [with_harmonics(rows[f"{c}_dot"], frequency) for c in system.coordinates]
    own = [orders.get(symbol(c), 0) for c in system.coordinates]
    highest, largest = Fraction(number), Fraction(2 * max(abs(o) for o in orders.values()))
    while True:
        series = [graded(f, orders, moving, highest + o) for f, o in zip(accelerations, own)]
        found = [{k - o: sp.expand(e) for k, e in s.items()} for s, o in zip(series, own)]
        step = min((k for f in found for k, e in f.items() if k > 0 and e != 0), default=None)
        if step is not None and step * number <= highest:
            break
        if step is None and highest > largest:
            raise InputError(f"nothing of '{system.name}' is small in these scaling orders: nothing is left to average")
        highest = step * number if step is not None else highest + 1
    return [{k: monomials(e, states) for k, e in f.items() if k <= step * number} for f in found], step


def slowest_forcing(rows: Iterable[Mapping[Fraction, list[Monomial]]]) -> int:
    """The greatest common divisor of the harmonics that occur: a declared period may be a multiple of the least one."""
    return math.gcd(*(t.harmonic for row in rows for terms in row.values() for t in terms)) or 1


def root(system: System, stiffness: sp.Expr) -> sp.Expr:
    """The natural frequency sqrt(stiffness); parameters with a positive default count as positive, sqrt(q^2) = q."""
    positive = {symbol(name): sp.Dummy(name, positive=True) for name, value in system.parameters.items() if value > 0}
    value = sp.sqrt(stiffness.xreplace(positive))
    return value.xreplace({dummy: s for s, dummy in positive.items()})


def natural_frequency(form: StandardForm, stiffness: sp.Expr) -> sp.Expr:
    """omega_i of a standard form."""
    return root(form.system, stiffness)


def standard_form(
    system: System, order: int, resonance: Resonance, small: Small, exact: bool = False
) -> StandardForm:
    """The standard form of a system up to eps^order.

    Raises
    ------
    InputError
        No scaling orders; a resonance that is no pair of positive integers, or does not fit the natural frequencies.
    EquationError
        A term that is not small, or cannot be averaged.
    """
    scaled = scaling_orders(system, small)
    found, step = graded_rows(system, scaled, order)
    states = [symbol(s) for s in (*system.coordinates, *(f"{c}_dot" for c in system.coordinates))]
    stiffness, forcings = [], []
    for i, row in enumerate(found):
        k, forcing = _linear_part(system, i, row, states)
        stiffness.append(k)
        forcings.append(forcing)
    ratio, multiples = _multiples(system, stiffness, resonance)
    forced = system.period_expression is not None
    common = slowest_forcing(found)
    base = (
        common * 2 * sp.pi / system.period_expression / ratio[0]
        if forced
        else root(system, stiffness[0]) / multiples[0]
    )
    levels = []
    for level in range(1, order + 1):
        rows = []
        for row in found:
            terms = [t for o, ts in row.items() if (level - 1) * step < o <= level * step for t in ts]
            if exact:  # sums of fractions times parameters: taken apart, like coefficients are few
                terms = [dataclasses.replace(t, coefficient=c) for t in terms
                         for c in sp.Add.make_args(sp.expand(t.coefficient))]  # fmt: skip
            rows.append(tuple(dataclasses.replace(t, harmonic=t.harmonic // common * ratio[0]) for t in terms))
        levels.append(tuple(rows))
    hard = [
        _linear_response(system, i, forcing, sp.Rational(ratio[0], common), multiples[i], base, stiffness[i])
        for i, forcing in enumerate(forcings)
    ]
    return StandardForm(system, base, multiples, tuple(stiffness), tuple(levels), tuple(hard), ratio, exact)


def _linear_part(
    system: System, i: int, row: Mapping[Fraction, list[Monomial]], states: Sequence[sp.Symbol]
) -> tuple[sp.Expr, dict[int, sp.Expr]]:
    """omega_i^2 and the forcing of order 0; everything else of order 0 or less is refused."""
    name = system.coordinates[i]
    stiffness = sp.S.Zero
    zeroth = [t for o, found in row.items() if o <= 0 for t in found]
    for o, found in row.items():
        for term in found if o <= 0 else ():
            unit = tuple(int(k == i) for k in range(len(states)))
            bare = not any(term.powers) and not term.rough
            if o == 0 and (bare or (term.powers == unit and not term.rough and term.harmonic == 0)):
                if not bare:
                    stiffness -= term.coefficient
                continue
            shown = readable(term.expression(states))
            linear = sum(term.powers) == 1 and not term.rough and term.harmonic == 0
            if linear and term.powers.index(1) < len(system.coordinates):
                raise EquationError(
                    f"the term {shown} couples '{name}' to another coordinate at order {o}: `averaging` takes modal "
                    "coordinates where all coordinates have one scaling order (and the coupling order 0), "
                    "`multiple_scales` does not; else give a coupling parameter a positive scaling order (small=), or "
                    "use HarmonicBalance(system)"
                )
            names = ", ".join(sorted(s.name for s in term.coefficient.free_symbols))
            remedy = f"one of its parameters ({names}) or states" if names else "its states"
            raise EquationError(
                f"the term {shown} in the equation of '{name}' is of order {o}, but only a linear spring and forcing "
                f"may be: give {remedy} a positive scaling order (small=), or use "
                "HarmonicBalance(system)"
            )
    values = {symbol(k): v for k, v in system.parameters.items()}
    number = float(stiffness.subs(values)) if stiffness != 0 else 0.0
    if not number > 0:
        raise EquationError(
            f"'{name}' has the linear stiffness {stiffness} = {number:g} at order 0: averaging needs a positive one; "
            "shift the coordinate to a stable equilibrium, or use HarmonicBalance(system)"
        )
    return sp.factor(stiffness), forcing_of(zeroth)


def _pair(value: Any) -> tuple[int, int]:
    try:
        p, q = value
        ok = int(p) == p and int(q) == q and p > 0 and q > 0
    except (TypeError, ValueError):
        ok = False
    if not ok:
        raise InputError(
            f"resonance is a pair (p, q) of positive integers, excitation : response = p : q; got {value!r}"
        )
    common = math.gcd(int(p), int(q))
    return int(p) // common, int(q) // common


def _multiples(
    system: System, stiffness: list[sp.Expr], resonance: Resonance
) -> tuple[tuple[int, int], tuple[int, ...]]:
    """(P, q) and K_i."""
    if isinstance(resonance, Mapping):
        check_names("coordinate", resonance, system.coordinates, f"'{system.name}'")
        missing = [c for c in system.coordinates if c not in resonance]
        if missing:
            raise InputError(f"resonance names no ratio for {', '.join(missing)} of '{system.name}'")
        pairs = [_pair(resonance[c]) for c in system.coordinates]
        common = math.lcm(*(p for p, _ in pairs))
        multiples = tuple(q * common // p for p, q in pairs)
        return (common, min(multiples)), multiples
    p, q = _pair(resonance)
    values = {symbol(k): v for k, v in system.parameters.items()}
    natural = [math.sqrt(float(k.subs(values))) for k in stiffness]
    slowest = min(natural)
    integers = [round(w / slowest) for w in natural]
    for c, w, k in zip(system.coordinates, natural, integers):
        if abs(w / (k * slowest) - 1) > 0.25:
            listing = ", ".join(f"{name} {value:.4g}" for name, value in zip(system.coordinates, natural))
            raise InputError(
                f"the natural frequencies of '{system.name}' ({listing}) are not near integer multiples of the lowest: "
                f"say at which ratio each coordinate answers, resonance={{'{c}': (p, q), ...}}"
            )
    return (p, q), tuple(q * k for k in integers)


def _linear_response(
    system: System,
    i: int,
    forcing: Mapping[int, sp.Expr],
    scale: sp.Rational,
    multiple: int,
    base: sp.Expr,
    stiffness: sp.Expr,
) -> dict[int, tuple[sp.Expr, sp.Expr]]:
    """Harmonic m >= 0 -> (cosine, sine) coefficients of the response h_i to forcing of order 0."""
    found = {}
    for m, value in forcing.items():
        if m < 0 or value == 0:
            continue
        harmonic = int(m * scale)
        if harmonic == multiple:
            name = system.coordinates[i]
            amplitude = sp.simplify(2 * value)
            raise EquationError(
                f"the forcing of '{name}' at its response frequency, amplitude {amplitude}, is of order 0: in "
                f"resonance it must be small. Give a parameter of it the order 1, or say that the response is large: "
                f"small=dict(..., {name}=-1)"
            )
        factor = (1 if m == 0 else 2) / (stiffness - (harmonic * base) ** 2)
        found[harmonic] = (sp.re(value) * factor, -sp.im(value) * factor)
    return found
