"""Several steps along a branch of collocated orbits in one compiled call (kernels/marching.py).

Each step comes back as what `Collocation.correct` would have given, linearisation included, with the measures by which
the driver judges a step. The arrays of all steps are made at once, row by row; a step that is not asked for costs no
Python.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..kernels import marching
from ..protocols import Corrected, Stretch, Stride, Tangent
from .collocation_linearisation import CollocationLinearisation, Workspace

if TYPE_CHECKING:
    from .collocation import Collocation

__all__ = ["strides"]

_ITERATIONS = 8


def strides(problem: Collocation, ahead: Stretch) -> Iterator[Stride]:
    """The steps of `protocols.Problem.strides`; none where the first one is to be looked at by itself."""
    mesh, flow, K = problem.mesh, problem.flow, ahead.most
    rule, N, n, m, own = mesh.rule, mesh.intervals, mesh.n, len(ahead.params), mesh.own
    if len(ahead.values) != n - own:  # a point without a spectrum of its own
        return
    past, size, index, count = len(ahead.tangents) - 1, mesh.size, problem.index(ahead.free), N * mesh.degree
    P, points = np.empty((K + 1, m)), np.empty((K + 1, size))
    tangents, rates, lengths = np.empty((past + K + 1, size)), np.empty(past + K + 1), np.empty(past + K + 1)
    re, im = np.empty((K + 1, n)), np.empty((K + 1, n))
    P[0], points[0], re[0, : n - own], im[0, : n - own] = ahead.params, ahead.u, ahead.values.real, ahead.values.imag
    for row, (t, step) in enumerate(zip(reversed(ahead.tangents), reversed(ahead.steps))):
        tangents[row], rates[row], lengths[row] = t.u, t.parameter, step
    F, J, Fp = np.empty((K, count, n)), np.empty((K, count, n, n)), np.empty((K, count, n, m))
    T, dT, Z, M = np.zeros((K, 1)), np.zeros((K, m)), np.empty((K, N, mesh.degree * n, n)), np.empty((K, N, n, n))
    x, report, seen = np.empty((K, 2, size + 1)), np.empty((K, 4)), np.empty((K, 10))
    small = mesh.degree * len(problem.kept)
    LU, pivots = np.empty((0, small, small)), np.empty((0, small), np.int64)
    products, spectral, weight = np.empty((K, n, n)), np.empty((K, n, n)), ahead.tangents[0].weight
    taken = marching.march(
        marching.addresses(), flow.address, flow.period_address, mesh.span, mesh.phase, mesh.h, rule.inverse,
        rule.matrix, rule.row_sums, rule.update, rule.weights, rule.leading, problem.kept, problem.position,
        problem.closure, problem.winding, problem.scales, problem.weights, problem.quadrature, ahead.tolerance,
        _ITERATIONS, index, own, past, weight, ahead.window, ahead.limits, ahead.pace, ahead.length,
        P, points, tangents, rates, lengths, re, im, T, F, J, Fp, dT, LU, pivots, Z, M, x, products, spectral, report,
        seen,
    )  # fmt: skip
    for k in range(taken):
        work: Workspace = object.__new__(Workspace)
        work.F, work.J, work.Fp, work.T, work.dT = F[k], J[k], Fp[k], T[k], dT[k]
        work.LU, work.pivots, work.Z, work.M = LU, pivots, Z[k], M[k]
        u, params = points[k + 1], P[k + 1]
        tangent = Tangent(tangents[past + k + 1], float(rates[past + k + 1]), weight)
        _, iterations, residual, sign = report[k].tolist()
        L = CollocationLinearisation(problem, u, params, work, sign, (x[k, 0, :size], float(x[k, 0, size]), index))
        *judged, trace, roughness, trivial = seen[k].tolist()
        values = np.empty(n - own, complex)
        values.real, values.imag = re[k + 1, : n - own], im[k + 1, : n - own]
        vars(L).update(summary=(products[k], trace, roughness), spectral=spectral[k], nontrivial=(values, trivial))
        problem._memo["tangent"] = (u, index, tangent)
        found = Corrected(u, params, tangent, residual, int(iterations), int(sign), L, True)
        yield Stride(found, *judged)
