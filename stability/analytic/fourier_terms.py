r"""Exact harmonics of monomials on harmonic motion, in complex amplitudes.

    q_j = A_j e^{i K_j phi} + B_j e^{-i K_j phi} + h_j(phi),      B_j = conj A_j,     phi = nu t,
    q_j' = (W_j/K_j) dq_j/dphi,       W_j = K_j nu the response frequency of coordinate j,

h_j the hard response with coefficients (C, S) for each of its harmonics. A quantity is kept as `Terms`: real
coefficient (in the parameters) -> polynomial in A, B, C, S over the Gaussian rationals, so that products are exact.

Rough terms |q|^s sgn^P(q) |q'|^r sgn^R(q') have the harmonic N of q = a cos psi by Gamma functions: with moments

    M(s, r) = <|cos|^s |sin|^r> = Gamma((s+1)/2) Gamma((r+1)/2) / (pi Gamma((s+r)/2 + 1)),

cos N psi = T_N(cos psi), sin N psi = sin psi U_{N-1}(cos psi); 2 M(n + 1, 0) = c_n of the books (4/pi, 1, 8/(3 pi),
3/4, ...). Reference: Nayfeh and Mook (1979), sections 2.3 and 3.3.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import sympy as sp
from sympy.polys.domains import QQ_I
from sympy.polys.rings import PolyElement, ring

from ..errors import EquationError
from .monomials import Monomial, readable
from .standard_form import StandardForm

__all__ = ["Amplitudes", "Terms", "add", "added", "moment", "multiplied", "scaled"]

Terms = dict[sp.Expr, PolyElement]


def moment(s: sp.Expr, r: sp.Expr) -> sp.Expr:
    """The average of |cos|^s |sin|^r over a period.

    >>> 2 * moment(sp.Integer(3), sp.Integer(0))
    8/(3*pi)
    """
    s, r = sp.nsimplify(s), sp.nsimplify(r)
    value = sp.gamma((s + 1) / 2) * sp.gamma((r + 1) / 2) / (sp.pi * sp.gamma((s + r) / 2 + 1))
    return sp.Float(float(value)) if value.has(sp.gamma) else value


def add(terms: Terms, coefficient: sp.Expr, element: PolyElement) -> None:
    """terms += coefficient * element; rational factors move into the polynomial."""
    if not element:
        return
    number, rest = coefficient.as_coeff_Mul()
    if number.is_Rational:
        element = element * QQ_I(number.p, 0) / QQ_I(number.q, 0) if number != 1 else element
        coefficient = rest
    total = terms.get(coefficient, element.ring.zero) + element
    if total:
        terms[coefficient] = total
    else:
        terms.pop(coefficient, None)


def added(*parts: Terms) -> Terms:
    """The sum."""
    total: Terms = {}
    for part in parts:
        for coefficient, element in part.items():
            add(total, coefficient, element)
    return total


def multiplied(a: Terms, b: Terms) -> Terms:
    """The product."""
    product: Terms = {}
    for x, p in a.items():
        for y, q in b.items():
            add(product, x * y, p * q)
    return product


def scaled(terms: Terms, coefficient: sp.Expr, unit: complex = 1) -> Terms:
    """coefficient * unit * terms; unit is 1, -1, 1j or -1j."""
    product: Terms = {}
    gaussian = QQ_I(int(complex(unit).real), int(complex(unit).imag))
    for x, p in terms.items():
        add(product, coefficient * x, p * gaussian)
    return product


class Amplitudes:
    """The complex amplitudes of a standard form and the harmonics of monomials in them."""

    def __init__(self, form: StandardForm) -> None:
        self.form = form
        n = len(form.multiples)
        self.n = n
        self.hard = [(j, m, part) for j in range(n) for m in form.hard[j] for part in ((0,) if m == 0 else (0, 1))]
        names = [f"A{j}" for j in range(n)] + [f"B{j}" for j in range(n)]
        names += [f"H{j}_{m}_{part}" for j, m, part in self.hard]
        self.ring, *generators = ring(names, QQ_I)
        self.A, self.B, self.H = generators[:n], generators[n : 2 * n], generators[2 * n :]
        self.W = [sp.Dummy(f"W{j}", positive=True) for j in range(n)]
        self.modulus = [sp.Dummy(f"a{j}", positive=True) for j in range(n)]
        self._positions = [self._position(j) for j in range(n)]
        self._powers: dict[tuple[int, int], dict[int, PolyElement]] = {}

    def _position(self, j: int) -> dict[int, PolyElement]:
        K = self.form.multiples[j]
        series = {K: self.A[j], -K: self.B[j]}
        half, i = QQ_I(1, 0) / QQ_I(2, 0), QQ_I(0, 1)
        for (owner, m, part), H in zip(self.hard, self.H):
            if owner != j:
                continue
            if m == 0:
                series[0] = H
            else:
                plus = H * half if part == 0 else -H * half * i
                minus = H * half if part == 0 else H * half * i
                series[m] = series.get(m, self.ring.zero) + plus
                series[-m] = series.get(-m, self.ring.zero) + minus
        return series

    def state(self, s: int) -> dict[int, PolyElement]:
        """Harmonics of state s (coordinates, then velocities over W_j)."""
        if s < self.n:
            return self._positions[s]
        j = s - self.n
        K = self.form.multiples[j]
        return {k: e * QQ_I(0, k) / QQ_I(K, 0) for k, e in self._positions[j].items() if k}

    def _power(self, s: int, exponent: int) -> dict[int, PolyElement]:
        known = self._powers.get((s, exponent))
        if known is None:
            known = self.state(s) if exponent == 1 else convolved(self._power(s, exponent - 1), self.state(s))
            self._powers[(s, exponent)] = known
        return known

    def harmonics(self, term: Monomial) -> tuple[sp.Expr, dict[int, PolyElement]]:
        """(coefficient, harmonic -> polynomial) of a polynomial monomial."""
        series = {term.harmonic: self.ring.one * gaussian(term.unit)}
        coefficient = term.coefficient
        for s, exponent in enumerate(term.powers):
            if exponent:
                series = convolved(series, self._power(s, exponent))
                if s >= self.n:
                    coefficient *= self.W[s - self.n] ** exponent
        return coefficient, series

    def harmonic_of(self, term: Monomial, i: int) -> Terms:
        """The harmonic K_i of a monomial of equation i, rough ones included."""
        out: Terms = {}
        if term.rough:
            self._rough(term, i, out)
        else:
            coefficient, series = self.harmonics(term)
            element = series.get(self.form.multiples[i])
            if element:
                add(out, coefficient, element)
        return out

    def _rough(self, term: Monomial, i: int, out: Terms) -> None:
        shown = readable(term.expression(self.form.states))
        involved = {s % self.n for s, k in enumerate(term.powers) if k} | {s % self.n for s, _ in term.rough}
        (j, *others) = sorted(involved)
        if others or term.harmonic:
            raise EquationError(
                f"the term {shown} cannot be averaged: |x|^n multiplies another coordinate or the forcing; use "
                "HarmonicBalance(system)"
            )
        if self.form.hard[j]:
            raise EquationError(
                f"the term {shown} cannot be averaged: its coordinate moves under forcing of order 0 as well; use "
                "HarmonicBalance(system)"
            )
        N, remainder = divmod(self.form.multiples[i], self.form.multiples[j])
        rough = dict(term.rough)
        powers, parities = [], []
        for s in (j, j + self.n):
            power, parity = term.powers[s], 0
            if s in rough:
                power, parity = power + rough[s].power, rough[s].parity
            powers.append(sp.sympify(power))
            parities.append((parity + term.powers[s]) % 2)
        if remainder:
            return
        value, unit = self._rough_harmonic(N, powers, parities)
        if value == 0:
            return
        coefficient = term.coefficient * self.W[j] ** powers[1] * self.modulus[j] ** (powers[0] + powers[1] - N)
        add(out, coefficient * value * 2**N, self.A[j] ** N * gaussian(term.unit) * unit)

    @staticmethod
    def _rough_harmonic(N: int, powers: list[sp.Expr], parities: list[int]) -> tuple[sp.Expr, Any]:
        """<|c|^s sgn^P(c) |s|^r sgn^R(-s) e^{-i N psi}> as (number, unit)."""
        (s, r), (P, R) = powers, parities
        z = sp.Symbol("z")
        if R == 0:
            polynomial, extra, unit = sp.chebyshevt_poly(N, z), 0, QQ_I(1, 0)
        else:
            polynomial, extra, unit = sp.chebyshevu_poly(N - 1, z), 1, QQ_I(0, 1)
        total = sp.S.Zero
        for (k,), c in sp.Poly(polynomial, z).terms():
            if (k + P) % 2 == 0:
                total += c * moment(s + k, r + extra)
        return sp.simplify(total), unit

    def conjugate(self, terms: Terms) -> Terms:
        """Complex conjugate: A and B change places."""
        n = self.n
        out: Terms = {}
        for coefficient, element in terms.items():
            swapped = self.ring.from_dict(
                {m[n : 2 * n] + m[:n] + m[2 * n :]: QQ_I(c.x, -c.y) for m, c in element.terms()}
            )
            add(out, coefficient, swapped)
        return out

    def slope(self, terms: Terms, motion: list[Terms]) -> Terms:
        """The derivative of `terms` along A' = motion, B' = conj motion."""
        total: Terms = {}
        for j in range(self.n):
            for generator, speed in ((self.A[j], motion[j]), (self.B[j], self.conjugate(motion[j]))):
                derivative = {c: d for c, e in terms.items() if (d := e.diff(generator))}
                total = added(total, multiplied(derivative, speed))
        return total


def convolved(a: dict[int, PolyElement], b: dict[int, PolyElement]) -> dict[int, PolyElement]:
    """The harmonics of a product."""
    out: dict[int, PolyElement] = {}
    for m, x in a.items():
        for k, y in b.items():
            product = x * y
            out[m + k] = out[m + k] + product if m + k in out else product
    return out


def gaussian(unit: sp.Expr) -> Any:
    """i^k as an element of the Gaussian rationals."""
    re, im = sp.sympify(unit).as_real_imag()
    return QQ_I(sp.Rational(re).p, 0) / QQ_I(sp.Rational(re).q, 0) + QQ_I(0, sp.Rational(im).p) / QQ_I(
        sp.Rational(im).q, 0
    )


def rows_at(amplitudes: Amplitudes, i: int, terms: Iterable[Monomial]) -> Terms:
    """The harmonic K_i of a sum of monomials of equation i."""
    return added(*(amplitudes.harmonic_of(t, i) for t in terms))
