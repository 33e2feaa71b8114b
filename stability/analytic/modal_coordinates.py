r"""Modal coordinates: oscillators that are coupled at order 0, before they are averaged.

    q'' + K q = eps g(q, q', t, p),    q = Phi m,    K Phi = Phi diag(omega_j^2):
    m'' + diag(omega_j^2) m = eps Phi^-1 g(Phi m, Phi m', t, p)

K (n, n) holds the linear terms of order 0 in the coordinates and needs n different positive eigenvalues; damping is of
order eps, so that it may be of any kind. The modes are averaged like any other coordinates; those that are far from the
frequency of the response keep their exact linear response there, because the detuning is not expanded.

Phi is numbers, at the system's own parameter values; the parameters that K depends on are therefore no parameters of
the slow flow any more: average again for other values of them. All these numbers are kept as fractions of their decimal
digits, which is what keeps the second order small (few different coefficients), and become decimals in the slow flow.
Reference: Nayfeh and Mook (1979), chapter 6; Krack and Gross (2019), chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..errors import EquationError
from ..systems.equations import symbol
from ..systems.system import System

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .monomials import Monomial

__all__ = ["Modes", "coupling", "modes_of", "physical"]

Array = NDArray[Any]


@dataclass(frozen=True)
class Modes:
    """The modal system, its shapes Phi (n, n), and the parameters that are numbers in it."""

    original: System
    system: System
    names: tuple[str, ...]
    shapes: Array
    fixed: tuple[str, ...]


def coupling(system: System, rows: list[dict[Fraction, list[Monomial]]]) -> sp.Matrix | None:
    """K of the module's head; None where no coordinate is coupled to another at order 0."""
    n = len(system.coordinates)
    K = sp.zeros(n, n)
    for i, row in enumerate(rows):
        for term in row.get(Fraction(0), ()):
            if sum(term.powers) == 1 and not term.rough and term.harmonic == 0 and term.powers.index(1) < n:
                K[i, term.powers.index(1)] -= term.coefficient
    return K if any(K[i, j] != 0 for i in range(n) for j in range(n) if i != j) else None


def modes_of(system: System, K: sp.Matrix, orders: Mapping[sp.Symbol, int]) -> Modes:
    """The system in modal coordinates.

    Raises
    ------
    EquationError
        K has eigenvalues that are not positive and different.
    """
    assert system.rhs is not None
    n = len(system.coordinates)
    numbers = {symbol(k): v for k, v in system.parameters.items()}
    squares, shapes = _solved(system, np.array(K.subs(numbers), float))
    inverse = np.linalg.inv(shapes)
    fixed = {s: _fraction(numbers[s]) for s in K.free_symbols}
    stem = "mode"
    while any(name.startswith(stem) for name in (*system.states, *system.parameters)):
        stem += "_"
    names = tuple(f"{stem}{j + 1}" for j in range(n))
    position, velocity = ([symbol(f"{m}{end}") for m in names] for end in ("", "_dot"))
    moved = {symbol(c): _sum(shapes[i], position) for i, c in enumerate(system.coordinates)}
    moved |= {symbol(f"{c}_dot"): _sum(shapes[i], velocity) for i, c in enumerate(system.coordinates)}
    rows = dict(zip(system.states, system.rhs))
    own = [symbol(c) for c in system.coordinates]
    rest = [sp.expand(rows[f"{c}_dot"] + K[i, :].dot(own)) for i, c in enumerate(system.coordinates)]
    rest = [r.xreplace(fixed).xreplace(moved) for r in rest]
    acceleration = [_sum(inverse[j], rest) - _fraction(squares[j]) * position[j] for j in range(n)]
    parameters = {k: v for k, v in system.parameters.items() if symbol(k) not in fixed}
    scaled = {s.name: o for s, o in orders.items() if s.name in parameters}
    order = orders.get(own[0], 0)
    period = system.period_expression
    modal = System(
        name=system.name,
        coordinates=names,
        states=(*names, *(f"{m}_dot" for m in names)),
        parameters=parameters,
        rhs=(*velocity, *acceleration),
        period_expression=None if period is None else period.xreplace(fixed),
        bounds={k: b for k, b in system.bounds.items() if k in parameters},
        units={k: u for k, u in system.units.items() if k in parameters},
        orders={**scaled, **(dict.fromkeys(names, order) if order else {})},
    )
    return Modes(system, modal, names, shapes, tuple(s.name for s in fixed))


def physical(slow: System, modes: Modes, aligned: bool) -> System:
    """The slow flow of the modes with amplitudes and motion in the original coordinates.

    aligned: all modes answer at one frequency, so that their cosines and sines add up to one amplitude.
    """
    original, shapes = modes.original, modes.shapes
    motion: dict[str, sp.Expr] = {}
    for end in ("", "_dot"):
        parts = [slow.reconstruction[f"{m}{end}"] for m in modes.names]
        motion |= {f"{c}{end}": _sum(shapes[i], parts) for i, c in enumerate(original.coordinates)}
    outputs = dict(slow.outputs)
    if aligned:
        pairs = [_pair(slow, m) for m in modes.names]
        for i, c in enumerate(original.coordinates):
            cosine, sine = (_sum(shapes[i], parts) for parts in zip(*pairs))
            outputs[f"{c}_amplitude"] = sp.sqrt(cosine**2 + sine**2)
    note = f"; its mode shapes fix {', '.join(modes.fixed)}" if modes.fixed else ""
    outputs, motion = ({k: e.evalf() for k, e in part.items()} for part in (outputs, motion))
    return slow.replace(
        outputs=outputs, reconstruction=motion, description=f"{slow.description}; in modal coordinates{note}"
    )


def _pair(slow: System, mode: str) -> tuple[sp.Expr, sp.Expr]:
    """Cosine and sine coefficient of a mode in the slow states."""
    if f"{mode}_cos" in slow.states:
        return symbol(f"{mode}_cos"), symbol(f"{mode}_sin")
    a, psi = symbol(f"{mode}_amplitude"), symbol(f"{mode}_phase")
    return a * sp.cos(psi), -a * sp.sin(psi)


def _sum(factors: Array, parts: Any) -> sp.Expr:
    return sp.Add(*(_fraction(f) * part for f, part in zip(factors, parts) if f != 0))


def _fraction(value: float) -> sp.Rational:
    return sp.Rational(repr(float(value)))


def _solved(system: System, K: Array) -> tuple[Array, Array]:
    """(n,) omega^2 ascending and (n, n) Phi, the largest entry of each mode 1."""
    values, vectors = np.linalg.eig(K)
    place = np.argsort(values.real)
    values, vectors = values[place], vectors[:, place].real
    size = float(np.abs(values).max())
    if np.abs(values.imag).max() > 0 or values.real.min() <= 0 or np.diff(values.real).min() < 1e-6 * size:
        listing = ", ".join(f"{v:.4g}" for v in values)
        raise EquationError(
            f"the linear part of '{system.name}' at order 0 has the eigenvalues {listing}: averaging in modal "
            "coordinates needs positive ones that differ; give a coupling parameter a positive scaling order (small=), "
            "or use HarmonicBalance(system)"
        )
    return values.real, vectors / vectors[np.abs(vectors).argmax(axis=0), range(len(values))]
