"""Right-hand sides as sums of monomials in the states and in the harmonics of the forcing.

    f = sum of  c(p) unit E^m  prod_j q_j^a q_j'^b |q_j|^s sgn(q_j)^S |q_j'|^r sgn(q_j')^R,      E = e^{i w t},

w = 2 pi / T the forcing frequency, c real and free of states and time, unit a Gaussian rational. This is what can be
averaged in closed form; anything else is an `EquationError` that names the term.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ..errors import EquationError
from ..systems.equations import TIME

__all__ = ["HARMONIC", "Monomial", "Rough", "monomials", "with_harmonics"]

HARMONIC = sp.Dummy("E", real=True)  # only placeholders: real keeps sympy from splitting moduli
_INVERSE = sp.Dummy("E_inverse", real=True)


@dataclass(frozen=True)
class Rough:
    """|x|^power sgn(x)^parity of one state."""

    power: sp.Expr = sp.S.Zero
    parity: int = 0


@dataclass(frozen=True)
class Monomial:
    """One term: real coefficient, Gaussian unit, harmonic of the forcing, powers of the states, rough factors."""

    coefficient: sp.Expr
    unit: sp.Expr
    harmonic: int
    powers: tuple[int, ...]
    rough: tuple[tuple[int, Rough], ...] = ()

    def slope(self, state: int) -> Monomial | None:
        """The derivative over a state (of a polynomial term)."""
        power = self.powers[state]
        if power == 0:
            return None
        powers = (*self.powers[:state], power - 1, *self.powers[state + 1 :])
        return dataclasses.replace(self, coefficient=power * self.coefficient, powers=powers)

    def expression(self, states: Sequence[sp.Symbol]) -> sp.Expr:
        """As a person writes it (E^m for the harmonics)."""
        factors = [s**k for s, k in zip(states, self.powers)]
        for j, r in self.rough:
            factors.append(sp.Abs(states[j]) ** r.power * sp.sign(states[j]) ** r.parity)
        return self.coefficient * self.unit * HARMONIC**self.harmonic * sp.Mul(*factors)


def with_harmonics(expression: sp.Expr, frequency: sp.Expr | None) -> sp.Expr:
    """Sines and cosines of time in terms of E = e^{i w t}: cos(m w t + c) = (E^m + E^-m)/2 cos c - ..."""
    if not expression.has(TIME):
        return expression

    def rewritten(node: sp.Expr) -> sp.Expr:
        argument = sp.expand(node.args[0])
        rate = argument.coeff(TIME, 1)
        rest = sp.expand(argument - rate * TIME)
        ratio = sp.nsimplify(sp.cancel(sp.together(rate / frequency))) if frequency is not None else sp.nan
        if rest.has(TIME) or not ratio.is_Integer:
            raise _not_averaged(node, "its argument is no multiple of the forcing frequency")
        m = int(abs(ratio))
        sign = 1 if ratio > 0 else -1
        even = (HARMONIC**m + _INVERSE**m) / 2
        odd = sign * (HARMONIC**m - _INVERSE**m) / (2 * sp.I)
        if isinstance(node, sp.cos):
            return even * sp.cos(rest) - odd * sp.sin(rest)
        return odd * sp.cos(rest) + even * sp.sin(rest)

    found = expression.replace(lambda n: isinstance(n, (sp.sin, sp.cos)) and n.has(TIME), rewritten)
    if found.has(TIME):
        parts = [term for term in sp.Add.make_args(expression) if with_time(term, frequency)]
        raise _not_averaged(
            parts[0] if parts else expression, "time enters it otherwise than through sines and cosines"
        )
    return found


def with_time(term: sp.Expr, frequency: sp.Expr | None) -> bool:
    """Whether time is left after its sines and cosines are taken out."""
    bare = term.replace(lambda n: isinstance(n, (sp.sin, sp.cos)) and n.has(TIME), lambda n: sp.S.One)
    return bool(bare.has(TIME))


def monomials(expression: sp.Expr, states: Sequence[sp.Symbol]) -> list[Monomial]:
    """The monomials of an expression in the states and HARMONIC; like terms are collected.

    Raises
    ------
    EquationError
        A term that is no monomial; the sentence names it and the alternative.
    """
    moving = {*states, HARMONIC, _INVERSE}
    place = {s: j for j, s in enumerate(states)}
    found: dict[tuple[Any, ...], list[sp.Expr]] = {}
    for term in sp.Add.make_args(sp.expand(expression)):
        if term == 0:
            continue
        coefficient, unit, m, powers = sp.S.One, sp.S.One, 0, [0] * len(states)
        rough: dict[int, Rough] = {}
        for factor in sp.Mul.make_args(term):
            if factor == sp.I:
                unit *= sp.I
            elif not factor.free_symbols & moving:
                coefficient *= factor
            else:
                base, exponent = factor.as_base_exp()
                if base in (HARMONIC, _INVERSE) and exponent.is_Integer:
                    m += int(exponent) if base == HARMONIC else -int(exponent)
                elif base in place and exponent.is_Integer and exponent > 0:
                    powers[place[base]] += int(exponent)
                else:
                    j, piece = _rough_factor(base, exponent, place, term)
                    old = rough.get(j, Rough())
                    rough[j] = Rough(old.power + piece.power, (old.parity + piece.parity) % 2)
        key = (m, tuple(powers), tuple(sorted(rough.items(), key=lambda item: item[0])), unit)
        found.setdefault(key, []).append(coefficient)
    return [
        Monomial(total, key[3], key[0], key[1], key[2])
        for key, parts in found.items()
        if (total := sp.Add(*parts)) != 0
    ]


def _rough_factor(base: sp.Expr, exponent: sp.Expr, place: Mapping[sp.Symbol, int], term: sp.Expr) -> tuple[int, Rough]:
    """|x|^n and sgn(x)^k of one state."""
    inner = base.args[0] if isinstance(base, (sp.Abs, sp.sign)) else None
    if inner in place:
        if isinstance(base, sp.sign) and exponent.is_Integer and exponent > 0:
            return place[inner], Rough(sp.S.Zero, int(exponent) % 2)
        if isinstance(base, sp.Abs) and exponent.is_number and exponent > -1:
            return place[inner], Rough(exponent, 0)
        if isinstance(base, sp.Abs) and not exponent.is_number:
            raise _not_averaged(
                term, "its exponent is a parameter; give it as a number (the coefficient is a Gamma function)"
            )
    raise _not_averaged(term, "it is neither a polynomial nor a real power |x|^n of one state")


def _not_averaged(term: sp.Expr, why: str) -> EquationError:
    return EquationError(
        f"the term {readable(term)} cannot be averaged: {why}. If its states are small, say so "
        "(small=dict(<state>=1, ...)), and smooth functions are expanded; else use HarmonicBalance(system)"
    )


def readable(term: sp.Expr) -> str:
    """A term with e^{i w t} in words."""
    return str(term.xreplace({HARMONIC: sp.Symbol("exp(i w t)"), _INVERSE: sp.Symbol("exp(-i w t)")}))


def forcing_of(terms: Iterable[Monomial]) -> dict[int, sp.Expr]:
    """Harmonic -> complex coefficient of the terms without states."""
    found: dict[int, sp.Expr] = {}
    for term in terms:
        if not any(term.powers) and not term.rough:
            found[term.harmonic] = found.get(term.harmonic, sp.S.Zero) + term.coefficient * term.unit
    return found
