r"""Amplitude equations to second order by harmonics: averaging, and multiple scales.

With q_i = A_i e^{i K_i phi} + conj + x_i1, the harmonic K_i of q_i'' + omega_i^2 q_i = g_i is, with W_i = K_i nu,

    2 i W_i A_i' + A_i'' = R_i,       R_i1 = (W_i^2 - omega_i^2) A_i + [g_i1]_{K_i},
    x_i1 = sum over k != +-K_i of  [g_i1]_k e^{i k phi} / (nu^2 (K_i^2 - k^2)),
    R_i2 = [ g_i2 + (dg_i1/dq) x_1 + (dg_i1/dq') (x_1' + A' e^{i K phi} + conj) ]_{K_i}.

A_i is the *fundamental* harmonic of q_i (x_i1 has none): 2 |A_i| is the amplitude that every result here returns.

`averaged` keeps nu. To first order A' = R_1/(2 i W) is Krylov-Bogoliubov averaging of the standard form, and its
equilibria R_1 = 0 are the one-term harmonic balance exactly. To second order, with A'' = -i delta A' + (dN/dA) A',
delta = (W^2 - omega^2)/(2 W) the detuning (taken to the left side, so that the linear part stays stable at any distance
from resonance) and N = [g_1]_K/(2 i M),

    A' = Z + (V - dN/dA) Z,     Z = R/(2 i M),     M = W - delta/2 = (3 W^2 + omega^2)/(4 W),

V the effect of A' in the velocities: its equilibria R_1 + R_2 = 0 are the balance with the other harmonics eliminated.
Of modes, which may be far from their resonance, A' = (R_1 + R_2)/(2 i W): the same equilibria, rates to first order.

`expanded` is the textbook's method of multiple scales: everything is expanded about W_i = omega_i + sigma_i with
sigma_i of order eps, and powers beyond eps^2 are dropped. References: Nayfeh and Mook (1979), sections 2.3, 4.1;
Krylov and Bogoliubov (1947); Rahman and Burton, J. Sound Vib. 133 (1989) 369 (consistent second order).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp
from sympy.polys.domains import QQ_I

from ..errors import EquationError
from .fourier_terms import Amplitudes, Terms, add, added, multiplied, rows_at, scaled
from .monomials import readable
from .standard_form import StandardForm, natural_frequency

__all__ = ["AmplitudeEquations", "averaged", "expanded"]

Corrections = list[dict[int, Terms]]


@dataclass(frozen=True)
class AmplitudeEquations:
    """A_i' = `motion[i]`, the corrections x_i1 by harmonics, and what W_j stands for."""

    amplitudes: Amplitudes
    motion: tuple[Terms, ...]
    corrections: tuple[Mapping[int, Terms], ...]
    residual: tuple[Terms, ...]
    frequencies: Mapping[sp.Symbol, sp.Expr]


def _detunings(amplitudes: Amplitudes) -> list[Terms]:
    form = amplitudes.form
    return [{W**2 - k: A} for W, k, A in zip(amplitudes.W, form.stiffness, amplitudes.A)]


def _first(amplitudes: Amplitudes) -> list[Terms]:
    """[g_i1]_{K_i}."""
    return [rows_at(amplitudes, i, terms) for i, terms in enumerate(amplitudes.form.orders[0])]


def _over_2iW(amplitudes: Amplitudes, i: int, terms: Terms) -> Terms:
    return scaled(terms, 1 / (2 * amplitudes.W[i]), -1j)


def _corrections(amplitudes: Amplitudes) -> Corrections:
    """The harmonics of x_i1; of a form that is exact with omega_i^2 - k^2 nu^2 below."""
    found: Corrections = []
    form = amplitudes.form
    for i, terms in enumerate(form.orders[0]):
        K = form.multiples[i]
        rows: dict[int, Terms] = {}
        for term in terms:
            if term.rough:
                shown = readable(term.expression(form.states))
                raise EquationError(
                    f"the term {shown} has infinitely many harmonics: averaging takes it to order 1 "
                    "only; use order=1, or HarmonicBalance(system)"
                )
            coefficient, series = amplitudes.harmonics(term)
            for k, element in series.items():
                if abs(k) != K and element:
                    if form.exact:
                        factor = 1 / (form.stiffness[i] - sp.Rational(k**2, K**2) * amplitudes.W[i] ** 2)
                    else:
                        factor = sp.Rational(K**2, K**2 - k**2) / amplitudes.W[i] ** 2
                    add(rows.setdefault(k, {}), coefficient * factor, element)
        found.append({k: row for k, row in rows.items() if row})
    return found


def _moved(amplitudes: Amplitudes, corrections: Corrections, speeds: list[Terms]) -> Corrections:
    """What the corrections x_1, and A_j' = speeds[j] in the velocities, add to each state, by harmonics."""
    form, n = amplitudes.form, amplitudes.n
    moved: Corrections = [dict(rows) for rows in corrections]
    for j in range(n):
        K, W = form.multiples[j], amplitudes.W[j]
        rows = {k: scaled(row, sp.Rational(k, K) * W, 1j) for k, row in corrections[j].items() if k}
        rows[K] = added(rows.get(K, {}), speeds[j])
        rows[-K] = added(rows.get(-K, {}), amplitudes.conjugate(speeds[j]))
        moved.append(rows)
    return moved


def _slopes(amplitudes: Amplitudes, moved: Corrections) -> list[Terms]:
    """The harmonic K_i of (dg_i1/dq) moved."""
    form, n = amplitudes.form, amplitudes.n
    results = []
    for i in range(n):
        total: Terms = {}
        for term in form.orders[0][i]:
            for s in range(2 * n):
                slope = term.slope(s)
                if slope is None or not moved[s]:
                    continue
                coefficient, series = amplitudes.harmonics(slope)
                for k, row in moved[s].items():
                    element = series.get(form.multiples[i] - k)
                    if element:
                        total = added(total, multiplied({coefficient: element}, row))
        results.append(total)
    return results


def _second(amplitudes: Amplitudes, corrections: Corrections, speeds: list[Terms]) -> list[Terms]:
    """R_i2, with A_j' = speeds[j] in the velocities."""
    slopes = _slopes(amplitudes, _moved(amplitudes, corrections, speeds))
    return [added(rows_at(amplitudes, i, terms), slopes[i]) for i, terms in enumerate(amplitudes.form.orders[1])]


def averaged(form: StandardForm) -> AmplitudeEquations:
    """The amplitude equations about the response frequencies W_i = K_i nu (see the module's head)."""
    amplitudes = Amplitudes(form)
    n = amplitudes.n
    values = {W: K * form.base_frequency for W, K in zip(amplitudes.W, form.multiples)}
    forces = _first(amplitudes)
    residual = [added(d, g) for d, g in zip(_detunings(amplitudes), forces)]
    if len(form.orders) == 1:
        motion = [_over_2iW(amplitudes, i, r) for i, r in enumerate(residual)]
        return AmplitudeEquations(amplitudes, tuple(motion), ({},) * n, tuple(residual), values)
    none: list[Terms] = [{} for _ in range(n)]
    corrections: Corrections = _corrections(amplitudes)
    residual = [added(r, s) for r, s in zip(residual, _second(amplitudes, corrections, none))]
    if form.exact:
        motion = [_over_2iW(amplitudes, i, r) for i, r in enumerate(residual)]
        return AmplitudeEquations(amplitudes, tuple(motion), tuple(corrections), tuple(residual), values)
    means = [sp.Dummy(f"M{i}", positive=True) for i in range(n)]
    Z = [scaled(r, 1 / (2 * M), -1j) for r, M in zip(residual, means)]
    N = [scaled(g, 1 / (2 * M), -1j) for g, M in zip(forces, means)]
    turning = _slopes(amplitudes, _moved(amplitudes, [{} for _ in range(n)], Z))
    motion = []
    for i, M in enumerate(means):
        slope = added(scaled(turning[i], 1 / (2 * M), -1j), scaled(amplitudes.slope(N[i], Z), -1 / (2 * M), -1j))
        motion.append(added(Z[i], slope))
    for i, M in enumerate(means):
        W = values[amplitudes.W[i]]
        values[M] = (3 * W**2 + form.stiffness[i]) / (4 * W)
    return AmplitudeEquations(amplitudes, tuple(motion), tuple(corrections), tuple(residual), values)


def expanded(form: StandardForm) -> AmplitudeEquations:
    """The amplitude equations of the method of multiple scales, about W_i = omega_i (see the module's head)."""
    amplitudes = Amplitudes(form)
    n = amplitudes.n
    natural = [natural_frequency(form, k) for k in form.stiffness]
    at_natural = dict(zip(amplitudes.W, natural))
    detuning = [sp.Dummy(f"sigma{j}", real=True) for j in range(n)]
    terms = [_over_2iW(amplitudes, i, g) for i, g in enumerate(_first(amplitudes))]
    first = [
        added(_replaced(terms[i], at_natural), scaled({detuning[i]: amplitudes.A[i]}, sp.S.One, -1j)) for i in range(n)
    ]
    motion = first
    corrections: Corrections = [{} for _ in range(n)]
    if len(form.orders) > 1:
        corrections = [{k: _replaced(row, at_natural) for k, row in rows.items()} for rows in _corrections(amplitudes)]
        second = _second(amplitudes, corrections, first)
        motion = []
        for i in range(n):
            parts = [first[i], {}]
            for W, sigma in zip(amplitudes.W, detuning):
                slopes = {c.diff(W): e for c, e in terms[i].items() if c.diff(W) != 0}
                for coefficient, element in slopes.items():
                    add(parts[1], sigma * coefficient.xreplace(at_natural), element)
            add(parts[1], detuning[i] ** 2 / (2 * natural[i]), amplitudes.A[i] * QQ_I(0, 1))
            parts.append(_replaced(_over_2iW(amplitudes, i, second[i]), at_natural))
            acceleration = _over_2iW(amplitudes, i, amplitudes.slope(first[i], first))
            parts.append(_replaced(scaled(acceleration, sp.S.NegativeOne), at_natural))
            motion.append(added(*parts))
    base = form.base_frequency
    values = {s: K * base - w for s, K, w in zip(detuning, form.multiples, natural)}
    values |= at_natural
    residual = [scaled(m, 2 * w, 1j) for m, w in zip(motion, natural)]
    return AmplitudeEquations(amplitudes, tuple(motion), tuple(corrections), tuple(residual), values)


def _replaced(terms: Terms, values: Mapping[sp.Symbol, sp.Expr]) -> Terms:
    out: Terms = {}
    for coefficient, element in terms.items():
        add(out, coefficient.xreplace(values), element)
    return out
