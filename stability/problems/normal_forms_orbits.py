r"""Second and third derivatives of the period map of an orbit, exact for the discrete flow of its collocation.

With variations V_i along the orbit (V' = sigma J V, V(0) = v_i) the map x(0) -> x(1) has the derivatives

    B(v_1, v_2) = W_12(1),      W_ij' = sigma (J W_ij + f_xx[V_i, V_j]),                                  W_ij(0) = 0,
    C(v_1, v_2, v_3) = U(1),    U' = sigma (J U + f_xxx[V_1, V_2, V_3] + sum f_xx[V_i, W_jk]),            U(0) = 0:

forward sweeps through the condensed intervals, second and third directional derivatives of f at the stages. They are
computed along real lines, D3[v, v, v] (on a section D2[v, v] too), and polarised; S^-1 and the states' scales are
applied as in the monodromy matrix.

Autonomous: the map to the section n.(x - x*) = 0, n = f(x*), is P = Phi(T + tau(x), x); with the jet x* + d(e) of
Phi(T, x* + e v) and tau = t1 e + t2 e^2 + t3 e^3,

    P = y + tau f(y) + tau^2/2 (J f)(y) + tau^3/6 (f_xx[f, f] + J J f),      y = x* + d,

expanded in e; n.(P - x*) = 0 gives the t_k. Coordinates on the section: an orthonormal basis of n's complement.
Reference: Kuznetsov, Govaerts, Doedel, Dhooge (2005), SIAM J. Numer. Anal. 43, 1407-1435 (the same by periodic normal
forms).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.bordering import lapack
from ..kernels.condensation_cubic import cubic_terms
from ..kernels.condensation_sweeps import adjoint_sweep, sweeps

__all__ = ["MapForms"]

Array = NDArray[np.float64]


class MapForms:
    """A, B, C of the period map (or the map of the section) at a collocation linearisation, in scaled variables."""

    def __init__(self, L: Any) -> None:
        mesh, problem = L.mesh, L.problem
        self.L, self.n, self.own = L, mesh.n, mesh.own
        self.scales = np.asarray(problem.scales)
        self.states = np.ascontiguousarray(mesh.split(L.u)[1])
        self.matrix, self.sizes, self.basis = np.asarray(L.spectral), self.scales, np.eye(self.n)
        if self.own:
            self.start = np.ascontiguousarray(mesh.split(L.u)[0][:1])
            F, J = problem.evaluations.FJ(np.zeros(1), self.start, L.params)
            self.rate, self.jacobian = F[0] / self.scales, J[0] * self.scales / self.scales[:, None]
            self.normal = self.rate / np.linalg.norm(self.rate)
            self.basis = np.linalg.svd(self.normal[None, :])[2][1:].T  # (n, n - 1)
            self.matrix = self.basis.T @ np.asarray(L.spectral) @ self.basis
            self.sizes = np.ones(self.n - 1)  # of the section's coordinates, which mix states

    # ------------------------------------------------------------------ jets along a line
    def _derivatives(self, *groups: tuple[Array, ...]) -> Array:
        """f_xx or f_xxx of groups of two or three variations (count, n) at the stages: (groups, count, n)."""
        L, many = self.L, len(groups)
        states = self.states.reshape(-1, self.n)
        directions = np.zeros((len(groups[0]), many * len(states), self.n + len(L.params)))
        for k, vectors in enumerate(zip(*groups)):
            directions[k, :, : self.n] = np.concatenate(vectors)
        evaluations = L.problem.evaluations
        function = evaluations.second if len(directions) == 2 else evaluations.third
        found = function(np.tile(L.mesh.phase, many), np.tile(states, (many, 1)), L.params, *directions)
        return np.asarray(found).reshape(many, -1, self.n)

    def _derivative(self, *vectors: Array) -> Array:
        """The same of one group."""
        return np.asarray(self._derivatives(vectors)[0])

    def _sweep(self, start: Array, forcing: Array | None) -> tuple[Array, Array]:
        """(end (n,), stages (count, n)) of the variation from `start` with f's inhomogeneity `forcing` (count, n)."""
        L, mesh = self.L, self.L.mesh
        columns = None
        if forcing is not None:
            columns = (L.sigma * mesh.h[:, None] * forcing.reshape(mesh.intervals, -1))[:, :, None]
        nodes, stages = L.variation(start, columns)
        return nodes[-1], stages.reshape(-1, self.n)

    def _returned(self, end: Array) -> Array:
        return np.asarray(np.linalg.solve(self.L.problem.closure, end) / self.scales)

    def _jet(self, v: Array, third: bool) -> tuple[Array, Array, Array]:
        """D[v], D2[v, v], D3[v, v, v] of the map in scaled variables, from scaled v (n,)."""
        zero = np.zeros(self.n)
        end, V = self._sweep(self.scales * v, None)
        first = self._returned(end)
        end, W = self._sweep(zero, self._derivative(V, V))
        second = self._returned(end)
        if not third:
            return first, second, zero
        end, _ = self._sweep(zero, self._derivative(V, V, V) + 3 * self._derivative(V, W))
        return first, second, self._returned(end)

    def _on_section(self, v: Array, third: bool) -> tuple[Array, Array]:
        """D2 and D3 of the map of the section along the direction v (n - 1,) of its coordinates."""
        d1, d2, d3 = self._jet(self.basis @ v, third)
        d2, d3 = d2 / 2, d3 / 6
        f, J, n = self.rate, self.jacobian, self.normal
        bend = self._at_start
        f1 = J @ d1
        f2 = J @ d2 + bend(d1, d1) / 2
        g0 = J @ f  # x'' along the flow
        g1 = bend(d1, f) + J @ f1
        k0 = bend(f, f) + J @ g0
        speed = float(n @ f)
        t1 = -float(n @ d1) / speed
        rest = d2 + t1 * f1 + t1**2 / 2 * g0
        t2 = -float(n @ rest) / speed
        second = rest + t2 * f
        rest = d3 + t1 * f2 + t2 * f1 + t1 * t2 * g0 + t1**2 / 2 * g1 + t1**3 / 6 * k0
        cubic = rest - float(n @ rest) / speed * f
        return 2 * self.basis.T @ second, 6 * self.basis.T @ cubic

    def _at_start(self, x: Array, y: Array) -> Array:
        """f_xx at the section's point, scaled."""
        L = self.L
        zeros = np.zeros(len(L.params))
        directions = [np.concatenate([v * self.scales, zeros])[None, :] for v in (x, y)]
        value = L.problem.evaluations.second(np.zeros(1), self.start, L.params, *directions)[0]
        return np.asarray(value / self.scales)

    def _line(self, v: Array, third: bool) -> tuple[Array, Array]:
        return self._on_section(v, third) if self.own else self._jet(v, third)[1:]

    def cubic_terms(self, p: Array, q: Array) -> tuple[float, float] | None:
        """p.C(q, q, q)/6 and p.B(q, h)/2 with (I - A) h = B(q, q), by fewest sweeps; None on a section.

        p . (end of a variation with inhomogeneity g) is a sum of g over the stages, by one adjoint sweep from p.
        """
        if self.own:
            return None
        L, mesh, rule = self.L, self.L.mesh, self.L.mesh.rule
        derivative, terms = L.problem.evaluations.directional_address, np.empty(2)
        cubic_terms(
            sweeps(), lapack()[1], derivative("second"), derivative("third"), *L.factors(), rule.update,
            rule.row_sums, L.work.Z, L.problem.closure, self.scales, self.matrix, np.ascontiguousarray(p),
            np.ascontiguousarray(q), mesh.phase, self.states, L.params, L.sizes, terms,
        )  # fmt: skip
        return float(terms[0]), float(terms[1])

    def torus_terms(self, p: Any, q: Any, mu: complex) -> tuple[complex, complex, complex] | None:
        """p.C(q, q, q*), 2 p.B(q, h), p.B(q*, k), (I - A) h = B(q, q*), (mu^2 - A) k = B(q, q); None on a section.

        With the variations V, W0, W2, H, K of q, f_xx[V, V*], f_xx[V, V], h and k they are sums over the stages of
        f_xxx[V, V, V*] + 2 f_xx[V, W0] + f_xx[V*, W2], of 2 f_xx[V, H] and of f_xx[V*, K], by the adjoint sweep from p.
        """
        if self.own:
            return None
        eye, zero = np.eye(self.n), np.zeros(self.n)
        a, b = (self._sweep(self.scales * part, None)[1] for part in (q.real, q.imag))
        aa, ab, bb = self._derivatives((a, a), (a, b), (b, b))
        (end, still), (end_2, W2) = self._sweep(zero, aa + bb), self._complex(zero, aa - bb + 2j * ab)
        h = np.linalg.solve(eye - self.matrix, self._returned(end))
        k = np.linalg.solve(mu**2 * eye - self.matrix, self._returned(end_2))
        H, (_, K) = self._sweep(self.scales * h, None)[1], self._complex(self.scales * k, None)
        pairs = [(x, y) for y in (still, H, W2.real, W2.imag, K.real, K.imag) for x in (a, b)]
        Va, Vb, Ha, Hb, ra, rb, ia, ib, ka, kb, la, lb = self._derivatives(*pairs)
        aaa, aab, abb, bbb = self._derivatives((a, a, a), (a, a, b), (a, b, b), (b, b, b))
        cubic = aaa + abb + 1j * (aab + bbb) + 2 * (Va + 1j * Vb) + ra + ib + 1j * (ia - rb)
        weighted = self._adjoint(p.real) + 1j * self._adjoint(p.imag)
        terms = (cubic, 2 * (Ha + 1j * Hb), ka + lb + 1j * (la - kb))
        first, second, third = (complex((weighted * term).sum()) for term in terms)
        return first, second, third

    def _complex(self, start: Any, forcing: Any) -> tuple[Any, Any]:
        """`_sweep` of a complex variation, by its parts."""
        parts = [
            self._sweep(take(start), None if forcing is None else take(forcing)) for take in (np.real, np.imag)
        ]
        return parts[0][0] + 1j * parts[1][0], parts[0][1] + 1j * parts[1][1]

    def _adjoint(self, p: Array) -> Array:
        """(count, n): p . (end of the variation from zero with inhomogeneity g) is the sum of this times g."""
        L, mesh = self.L, self.L.mesh
        none = np.zeros((mesh.intervals, mesh.degree * self.n))
        omega, eta = np.empty_like(none), np.linalg.solve(L.problem.closure.T, p / self.scales)
        adjoint_sweep(*L.factors(), mesh.rule.update, mesh.rule.row_sums, none, eta, omega)
        return np.asarray(L.sigma * (omega * mesh.h[:, None]).reshape(-1, self.n))

    # ------------------------------------------------------------------ multilinear forms
    def second(self, x: Any, y: Any) -> Any:
        """B(x, y): directly, on a section by polarisation of vectors brought to equal length."""
        total: Any = np.zeros(len(self.matrix))
        for i, a in enumerate((np.real(x), np.imag(x))):
            for j, b in enumerate((np.real(y), np.imag(y))):
                size = float(np.linalg.norm(a)) * float(np.linalg.norm(b))
                if size > 0:
                    total = total + 1j ** (i + j) * size * self._pair(a / np.linalg.norm(a), b / np.linalg.norm(b))
        return total

    def _pair(self, a: Array, b: Array) -> Array:
        if not self.own:
            one, other = (self._sweep(self.scales * v, None)[1] for v in (a, b))
            return self._returned(self._sweep(np.zeros(self.n), self._derivative(one, other))[0])
        if np.array_equal(a, b):
            return self._line(a, False)[0]
        return (self._line(a + b, False)[0] - self._line(a - b, False)[0]) / 4

    def third(self, x: Any, y: Any, z: Any) -> Any:
        """C(q, q, q) of a real q, or C(q, q, q*) of a complex one: all that normal forms need.

        C(q, q, q*) = C(aaa) + C(abb) + i (C(aab) + C(bbb)), q = a + i b; C(aab) = (T(a+b) - T(a-b) - 2 T(b)) / 6.
        """
        if not np.iscomplexobj(x):
            return self._line(np.asarray(x), True)[1]
        a, b = np.real(x), np.imag(x)
        length = math.hypot(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
        if not (np.array_equal(x, y) and np.array_equal(np.conj(x), z)) or length == 0:
            raise NotImplementedError("third derivatives of maps are known on q, q, q* only")
        a, b = a / length, b / length
        plus, minus, Ta, Tb = (self._line(v, True)[1] for v in (a + b, a - b, a, b))
        aab = (plus - minus - 2 * Tb) / 6
        abb = (plus + minus - 2 * Ta) / 6
        return length**3 * (Ta + abb + 1j * (aab + Tb))
