r"""The Newton solve of a curve of special orbits by collocation: one compiled call (kernels/condensation_curves.py).

The same equations, borders and strategy as `locus_newton` has for all problem classes, which is the witness of this one
in the tests. What is left at the solution is its own linearisation, so that spectrum and tests along the curve find it
there. Branch points, whose unfolding needs second derivatives of the forcing period, are solved by `locus_newton`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..protocols import Corrected, Tangent
from ..words import Kind
from .collocation import Collocation
from .collocation_linearisation import CollocationLinearisation, Workspace

if TYPE_CHECKING:
    from .locus import Locus

__all__ = ["compiled", "serves"]

Array = NDArray[np.float64]
_KINDS = {Kind.FOLD: 0, Kind.PERIOD_DOUBLING: 1, Kind.NEIMARK_SACKER: 2}


def serves(curve: Locus) -> bool:
    """Whether `compiled` can solve for this curve."""
    return isinstance(curve.inner, Collocation) and curve.kind in _KINDS


def compiled(
    curve: Locus, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float,
    limits: tuple[float, float, int],
) -> tuple[Corrected, Array, bool]:  # fmt: skip
    """(solution, (K, 3) last step, response and direction in the order (u, lambda_1, lambda_2, e), sharp) of one solve.

    `limits`: steps below the first are followed by one with old gradients, rounding may stop the iteration below the
    second; the third is the number of iterations. The tangent of the solution is left to the caller.
    """
    from ..kernels import condensation_curves as kernels
    from ..kernels.bordering import lapack

    problem, params = curve.inner, np.array(params, dtype=float)
    mesh, flow, rule = problem.mesh, problem.flow, problem.mesh.rule
    first, other = problem.index(free), problem.index(curve.free)
    weight = 0.0
    if tangent is not None:
        u, weight = u + ds * tangent.u, tangent.weight
        params[first] += ds * tangent.parameter
    params[other] = curve.parts(u)[1]
    x, extra = np.array(u[: mesh.size]), np.array(curve.parts(u)[2])
    nodes, stages, _ = mesh.split(x)
    work = Workspace(mesh, len(params), len(problem.kept), True)
    out, report = np.zeros((3, u.size + 1)), np.empty(4)
    sizes = np.concatenate([problem.scales, np.maximum(np.abs(params), 1e-3)])
    near, stalled, most = limits
    second = problem.evaluations.directional_address("second_gradient")
    status = kernels.curve_newton(
        kernels.calls(), lapack(), flow.address, flow.period_address, second, _KINDS[curve.kind], first, other,
        mesh.span, mesh.phase, mesh.h, rule.inverse, rule.matrix, rule.row_sums, rule.update, problem.kept,
        problem.position, problem.closure, problem.winding, problem.scales, problem.quadrature, params, x, nodes,
        stages, extra, work.T, curve.row_of(tangent, u.size), curve.ordered(curve.weights, weight**2), sizes,
        float(tolerance), near, stalled, most, work.F, work.J, work.Fp, work.dT, work.LU, work.pivots, work.Z, work.M,
        out, report,
    )  # fmt: skip
    iterations, residual, sign, sharp = report.tolist()
    solution = np.concatenate([x, params[other : other + 1], extra])
    found = status == kernels.CONVERGED
    note = "" if found else ("singular" if status == kernels.SINGULAR else "no convergence")
    note += "" if found else problem.evaluations.failure()
    critical = tuple(curve.targets(extra))
    L: Any = CollocationLinearisation(problem, x, params, work, sign, None, critical) if found else None
    return Corrected(solution, params, None, residual, int(iterations), 0, L, found, note), out.T, sharp == 1.0
