"""Several steps along a branch of collocated orbits in one compiled call (kernels/marching.py).

Each step comes back as what `Collocation.correct` would have given, with the measures by which the driver judges a
step, and its spectrum; the last one, where that is in doubt, with its linearisation instead. A step that is not asked
for costs no Python.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..kernels import marching
from ..protocols import Corrected, Spectrum, Stretch, Stride, Tangent
from ..words import Verdict
from .collocation_error import TRUST
from .collocation_linearisation import CollocationLinearisation, Workspace
from .orbit_adaption import resting

if TYPE_CHECKING:
    from .collocation import Collocation

__all__ = ["strides"]

Array = np.ndarray
_ITERATIONS = 8
_VERDICTS = {1.0: Verdict.STABLE, -1.0: Verdict.UNSTABLE}


def strides(problem: Collocation, ahead: Stretch) -> Iterator[Stride]:
    """The steps of `protocols.Problem.strides`; none where the first one is to be looked at by itself."""
    mesh, flow, K = problem.mesh, problem.flow, ahead.most
    rule, n, m, own = mesh.rule, mesh.n, len(ahead.params), mesh.own
    if len(ahead.spectra[0].values) != n - own:  # a point without a spectrum of its own
        return
    past, size, index = len(ahead.tangents) - 1, mesh.size, problem.index(ahead.free)
    P, points = np.empty((K + 1, m)), np.empty((K + 1, size))
    tangents, rates, lengths = np.empty((past + K + 1, size)), np.empty(past + K + 1), np.empty(past + K + 1)
    re, im, readings, signs = np.empty((K + 2, n)), np.empty((K + 2, n)), np.empty((K + 2, 9)), np.empty(K + 2)
    P[0], points[0] = ahead.params, ahead.u
    for row, (t, step) in enumerate(zip(reversed(ahead.tangents), reversed(ahead.steps))):
        tangents[row], rates[row], lengths[row] = t.u, t.parameter, step
    comparable = _known(problem, ahead, re, im, readings, signs)
    work = Workspace(mesh, m, len(problem.kept), False)
    x, report, seen = np.empty((2, size + 1)), np.empty((K, 4)), np.empty((K, 13))
    product, spectral, weight = np.empty((n, n)), np.empty((n, n)), ahead.tangents[0].weight
    level = problem._memo.get("level")
    known = (math.inf, math.inf, 0.0) if level is None or problem.kinked else tuple(map(float, level))
    resting_sizes = problem._memo.get("resting")  # a period that changes by a few steps makes no difference to them
    if resting_sizes is None:
        resting_sizes = resting(problem, float(ahead.u[-1]) if own else problem.orbit_period(ahead.params))
        problem._memo["resting"] = resting_sizes
    smallest, units, low, high = resting_sizes
    rest = problem.period_scale, low, high, float(ahead.rest), float(ahead.every)
    taken = marching.march(
        marching.addresses(), flow.address, flow.period_address, mesh.span, mesh.phase, mesh.h, rule.inverse,
        rule.matrix, rule.row_sums, rule.update, rule.weights, rule.leading, problem.kept, problem.position,
        problem.closure, problem.winding, problem.scales, problem.weights, problem.quadrature, ahead.tolerance,
        _ITERATIONS, index, own, past, weight, ahead.window, ahead.limits, ahead.pace, ahead.watch,
        ahead.older if comparable else (0.0, 0.0), known, TRUST, problem.orientation, smallest, units, rest,
        ahead.length,
        P, points, tangents, rates, lengths, re, im, readings, signs, work.T, work.F, work.J, work.Fp, work.dT,
        work.LU, work.pivots, work.Z, work.M, x, product, spectral, report, seen,
    )  # fmt: skip
    for k in range(taken):
        u, params = points[k + 1], P[k + 1]
        tangent = Tangent(tangents[past + k + 1], float(rates[past + k + 1]), weight)
        _, iterations, residual, sign = report[k].tolist()
        values = np.empty(n - own, complex)
        values.real, values.imag = re[k + 2, : n - own], im[k + 2, : n - own]
        *seven, trace, rough, trivial, complete, quiet, rests = seen[k].tolist()
        tried, distance, angle, chord, missed, motion, following = seven
        problem._memo.update(tangent=(u, index, tangent), roughness=(u, rough))
        L = spectrum = tests = None
        if complete:
            error_of, verdict, unstable, plus, minus, pairs, *three = readings[k + 2].tolist()
            spectrum = Spectrum(values, error_of, int(unstable), int(plus), int(minus), int(pairs), _VERDICTS[verdict])
            tests = tuple(three)
        else:
            L = CollocationLinearisation(problem, u, params, work, sign, (x[0, :size], float(x[0, size]), index))
            vars(L).update(summary=(product, trace, rough), spectral=spectral, nontrivial=(values, trivial))
        found = Corrected(u, params, tangent, residual, int(iterations), int(sign), L, True)
        yield Stride(
            found, tried, distance, angle, chord, missed, motion, following, spectrum, tests, bool(quiet), bool(rests)
        )


def _known(problem: Collocation, ahead: Stretch, re: Array, im: Array, readings: Array, signs: Array) -> bool:
    """Fill what is known of the point before (row 0) and of the last point (row 1); whether there is one before."""
    count = len(ahead.spectra[0].values)
    for row, spectrum, tests, sign in zip((1, 0), ahead.spectra, ahead.tests, ahead.signs):
        if len(spectrum.values) != count:
            return False
        re[row, :count], im[row, :count], signs[row] = spectrum.values.real, spectrum.values.imag, sign
        readings[row, 2:] = (spectrum.unstable, spectrum.beyond_plus, spectrum.beyond_minus, spectrum.pairs, *tests)
    return len(ahead.spectra) == 2
