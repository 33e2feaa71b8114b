r"""Amplitude equations as a `System`: cartesian or polar slow states, outputs, and the way back to the coordinates.

    cartesian   q = u cos(K phi) + v sin(K phi),    A = (u - i v)/2:    u' = 2 Re A',  v' = -2 Im A'
    polar       q = a cos(K phi + psi),             A = a e^{i psi}/2:  a' = 2 Re(A' e^{-i psi}),  a psi' = 2 Im(...)

States are named ``<q>_cos, <q>_sin`` or ``<q>_amplitude, <q>_phase``. The slow time is the time of the original
equations. An autonomous oscillator is invariant under shifts of time: its polar slow flow has the state
``<q>_amplitude`` only, and the output ``frequency`` = omega + psi'.
"""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.polys.domains import QQ, QQ_I
from sympy.polys.rings import ring

from ..systems.equations import TIME, symbol
from ..systems.system import System
from .amplitude_equations import AmplitudeEquations
from .fourier_terms import Terms

__all__ = ["slow_system"]


class _Variables:
    """Polynomials in A, B, H as real and imaginary sympy expressions in the slow states."""

    def __init__(self, equations: AmplitudeEquations, polar: bool) -> None:
        self.equations, self.polar = equations, polar
        self.amplitudes = equations.amplitudes
        form = self.amplitudes.form
        self.decimal = form.exact
        names = form.system.coordinates
        ends = ("amplitude", "phase") if polar else ("cos", "sin")
        self.pairs = [tuple(symbol(f"{c}_{end}") for end in ends) for c in names]
        self.hard = [form.hard[j][m][part] for j, m, part in self.amplitudes.hard]
        self.values: dict[sp.Symbol, sp.Expr] = dict(equations.frequencies)
        for dummy, (x, y) in zip(self.amplitudes.modulus, self.pairs):
            self.values[dummy] = x if polar else sp.sqrt(x**2 + y**2)
        flat = [s for pair in self.pairs for s in pair] + [sp.Dummy(f"h{k}") for k in range(len(self.hard))]
        self.ring, *generators = ring(flat, QQ_I)
        n = self.amplitudes.n
        half, i = QQ_I(1, 0) / QQ_I(2, 0), QQ_I(0, 1)
        u, v = generators[0 : 2 * n : 2], generators[1 : 2 * n : 2]
        self.images = [(a - b * i) * half for a, b in zip(u, v)] + [(a + b * i) * half for a, b in zip(u, v)]
        self.images += generators[2 * n :]
        self.back = dict(zip(flat[2 * n :], self.hard))

    def parts(self, terms: Terms, turn: int | None = None) -> tuple[sp.Expr, sp.Expr]:
        """Real and imaginary part; polar ones are multiplied by e^{-i psi_turn}."""
        real, imaginary = [], []
        for coefficient, element in terms.items():
            factor = coefficient.xreplace(self.values)
            a, b = self._polar(element, turn) if self.polar else self._cartesian(element)
            real.append(factor * a)
            imaginary.append(factor * b)
        return sp.Add(*real), sp.Add(*imaginary)

    def _cartesian(self, element: Any) -> tuple[sp.Expr, sp.Expr]:
        total = self.ring.zero
        for powers, c in element.terms():
            product = self.ring.one * c
            for image, k in zip(self.images, powers):
                if k:
                    product = product * image**k
            total = total + product
        exact = self.ring.clone(domain=QQ)
        out = []
        for part in ("x", "y"):
            piece = exact.from_dict({m: getattr(c, part) for m, c in total.terms() if getattr(c, part)})
            found = piece.as_expr() if piece else sp.S.Zero
            out.append((found.evalf() if self.decimal else sp.factor(found)).xreplace(self.back))
        return out[0], out[1]

    def _polar(self, element: Any, turn: int | None) -> tuple[sp.Expr, sp.Expr]:
        n = self.amplitudes.n
        real, imaginary = [], []
        for powers, c in element.terms():
            size, angle = sp.S.One, sp.S.Zero if turn is None else -self.pairs[turn][1]
            for j, (a, psi) in enumerate(self.pairs):
                size *= (a / 2) ** (powers[j] + powers[n + j])
                angle += (powers[j] - powers[n + j]) * psi
            size *= sp.Mul(*(h**k for h, k in zip(self.hard, powers[2 * n :])))
            x, y = QQ.to_sympy(c.x), QQ.to_sympy(c.y)
            real.append(size * (x * sp.cos(angle) - y * sp.sin(angle)))
            imaginary.append(size * (x * sp.sin(angle) + y * sp.cos(angle)))
        return sp.Add(*real), sp.Add(*imaginary)


def slow_system(equations: AmplitudeEquations, polar: bool, method: str, order: int) -> System:
    """The slow flow as a System."""
    variables = _Variables(equations, polar)
    form = equations.amplitudes.form
    system = form.system
    alone = system.period_expression is None
    states: list[str] = []
    rhs: list[sp.Expr] = []
    outputs: dict[str, sp.Expr] = {}
    for i, (c, pair) in enumerate(zip(system.coordinates, variables.pairs)):
        real, imaginary = variables.parts(equations.motion[i], i)
        if polar and alone:
            states.append(pair[0].name)
            rhs.append(sp.expand(2 * real))
            rate = sp.expand(2 * imaginary / pair[0])
            outputs["frequency"] = form.multiples[i] * form.base_frequency + rate
        elif polar:
            states += [s.name for s in pair]
            rhs += [2 * real, 2 * imaginary / pair[0]]
        else:
            states += [s.name for s in pair]
            rhs += [2 * real, -2 * imaginary]
            outputs[f"{c}_amplitude"] = sp.sqrt(pair[0] ** 2 + pair[1] ** 2)
    kept = {k: b for k, b in system.bounds.items() if k in system.parameters}
    return System(
        name=f"{system.name}, {method} {form.ratio[0]}:{form.ratio[1]}, order {order}",
        coordinates=tuple(states),
        states=tuple(states),
        parameters=system.parameters,
        rhs=tuple(rhs),
        outputs=outputs,
        units={k: u for k, u in system.units.items() if k in system.parameters},
        bounds=kept,
        angles=tuple(s for s in states if s.endswith("_phase")),
        orders={k: o for k, o in system.orders.items() if k in system.parameters},
        reconstruction=_reconstruction(equations, variables, alone and polar, outputs),
        description=f"slow flow of '{system.name}' by {method}, order {order}; amplitudes of the fundamental harmonic",
    )


def _reconstruction(
    equations: AmplitudeEquations, variables: _Variables, free: bool, outputs: dict[str, sp.Expr]
) -> dict[str, sp.Expr]:
    """Coordinates and velocities in slow states, parameters and t."""
    form = equations.amplitudes.form
    system = form.system
    phase = TIME * (outputs["frequency"] / form.multiples[0] if free else form.base_frequency)
    positions, velocities = {}, {}
    for i, c in enumerate(system.coordinates):
        K = form.multiples[i]
        series: dict[int, Terms] = {k: dict(row) for k, row in equations.corrections[i].items()}
        for k, element in equations.amplitudes.state(i).items():
            row = series.setdefault(k, {})
            row[sp.S.One] = row.get(sp.S.One, equations.amplitudes.ring.zero) + element
        position, velocity = sp.S.Zero, sp.S.Zero
        rate = K * form.base_frequency
        for k in sorted(k for k in series if k >= 0):
            real, imaginary = variables.parts(series[k])
            if free:
                real, imaginary = (e.subs(symbol(f"{c}_phase"), 0) for e in (real, imaginary))
            if k == 0:
                position += real
                continue
            cosine, sine = sp.cos(k * phase), sp.sin(k * phase)
            position += 2 * (real * cosine - imaginary * sine)
            speed = outputs["frequency"] if free else rate
            velocity += 2 * sp.Rational(k, K) * speed * (-real * sine - imaginary * cosine)
        if len(form.orders) > 1 and not free and not form.exact:  # zero in a steady state
            slow, turning = variables.parts(equations.motion[i], i)
            if variables.polar:
                psi = variables.pairs[i][1]
                velocity += 2 * (slow * sp.cos(K * phase + psi) - turning * sp.sin(K * phase + psi))
            else:
                velocity += 2 * (slow * sp.cos(K * phase) - turning * sp.sin(K * phase))
        positions[c], velocities[f"{c}_dot"] = position, velocity
    return {**positions, **velocities}
