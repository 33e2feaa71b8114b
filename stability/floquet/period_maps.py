r"""The period map (monodromy matrix) of a periodic linear system, its multipliers, exponents and their error.

    x' = A(t) x,  A(t + T) = A(t),  X(0) = I:   M = X(T),   multipliers mu = eig M,   exponents log(mu)/T (principal).

M is the product of transition matrices of steps, each by the Magnus integrator of order 6 (`kernels.propagators`) for
one step and for its two halves; the Richardson value ``F + (F - C)/63`` has order 8. Steps never straddle a break of
A. They are halved until two successive M agree to the tolerance. The error has two witnesses: this difference, and
Liouville's formula ``det M = exp(int tr A)``, with the integral by another quadrature rule than the integrator's.

Reference: V. A. Yakubovich, V. M. Starzhinskii, Linear differential equations with periodic coefficients (1975);
S. Blanes, F. Casas, J. A. Oteo, J. Ros, Phys. Rep. 470 (2009) 151.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, NonFiniteError
from ..kernels.block_triangular import mutual_blocks
from ..kernels.propagators import ordered_product, rounding_error, step_edges, step_factors
from ..words import Crossing, Verdict
from .along_orbits import orbit_generator
from .linearisation import linearise
from .multipliers import multipliers_with_errors
from .verdicts import Counts, classify

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["Monodromy", "monodromy"]

Array = NDArray[np.float64]
_FIRST_STEPS, _MAX_STEPS = 16, 32768
_PROBES: NDArray[np.float64] = np.asarray((np.arange(16) + 0.37) / 16, dtype=np.float64)
_LIMIT = 1e150  # entries of M beyond this: no multipliers, but a typed error


@dataclass(frozen=True, eq=False)
class Monodromy:
    """What `monodromy` returns; all fields are read-only.

    Attributes
    ----------
    matrix : (n, n) float, the map over one period, states in the order of the system.
    multipliers : (n,) complex, descending modulus.
    exponents : (n,) complex, ``log(multipliers)/period``, principal values: imaginary parts in (-pi/T, pi/T].
    multiplier_errors : (n,) float, estimated absolute errors of the multipliers; small ones keep relative accuracy.
    error : float, the largest of `multiplier_errors`.
    matrix_error : float, estimated error of the entries of `matrix`: step doubling and rounding.
    liouville_defect : float, ``|det M exp(-int tr A) - 1|``.
    period : float
    verdict : Verdict
    kind : Crossing or None, where the largest multiplier left the unit circle; None unless unstable.
    counts : Counts of the multipliers outside the unit circle.
    trivial : int or None, index of the multiplier 1 of an autonomous orbit, which the verdict leaves out.
    about : what the system was linearised about.
    params : dict of the parameter values.
    steps : int, integration steps in the finest pass.

    Examples
    --------
    >>> import stability as st
    >>> m = st.monodromy(st.models.mathieu(a=1.0, b=0.4, Omega=2.0, delta=0.05))
    >>> print(m.verdict, m.kind, m.multipliers.real.round(4), m.counts.beyond_minus_one)
    unstable -1 [-1.1687 -0.625 ] 1
    """

    matrix: Array
    multipliers: NDArray[np.complex128]
    exponents: NDArray[np.complex128]
    multiplier_errors: Array
    error: float
    matrix_error: float
    liouville_defect: float
    period: float
    verdict: Verdict
    kind: Crossing | None
    counts: Counts
    trivial: int | None
    about: Any
    params: dict[str, float]
    steps: int

    def __post_init__(self) -> None:
        for name in ("matrix", "multipliers", "exponents", "multiplier_errors"):
            getattr(self, name).setflags(write=False)

    @property
    def growth_rate(self) -> float:
        """Largest real part of the exponents (the trivial one left out), per unit time."""
        real = np.delete(self.exponents.real, self.trivial) if self.trivial is not None else self.exponents.real
        return float(real.max()) if real.size else -np.inf

    def __repr__(self) -> str:
        shown = "  ".join(f"{m.real:.6g}" if m.imag == 0 else f"{m:.6g}" for m in self.multipliers[:6])
        way = f" ({self.kind})" if self.kind else ""
        more = " ..." if len(self.multipliers) > 6 else ""
        return f"Monodromy T={self.period:.6g} | multipliers {shown}{more} +- {self.error:.1g} | {self.verdict}{way}"


def monodromy(system: System, about: Any = None, *, tolerance: float = 1e-13, **params: float) -> Monodromy:
    r"""Period map of a system linearised about a solution x*, its multipliers, exponents and verdict.

    ``y' = A(t) y`` with ``A = df/dx (t, x*(t), p)``, ``Y(0) = I``, ``M = Y(T)``.

    Parameters
    ----------
    system : System, n states.
    about : the solution x*: None (x = 0, checked), an equilibrium (mapping of states or array), a PeriodicOrbit (any
        callable ``orbit(t) -> (n,) or (n, N)`` with ``.period``; its period may be a multiple of the forcing
        period), a function of the parameters that gives one of these, or "linear" (the linear response).
    tolerance : error of the entries of M that is asked for, relative to max(1, max|M_ij|).
    **params : parameter values that differ from the defaults (or from those of the orbit).

    Returns
    -------
    Monodromy

    Raises
    ------
    UnknownNameError, InputError
        A parameter or state that does not exist, a value that is not finite, a period that is not positive, an
        autonomous system without an orbit, a point that is no solution.
    NonFiniteError
        The equations are not finite along the solution.
    ConvergenceError
        The tolerance is not reached, or M is beyond the range of floating point numbers; carries what there is.

    Notes
    -----
    *Accuracy*: `Monodromy.error` from step doubling, checked against closed forms (constant coefficients, Meissner),
    30-digit values of the damped Mathieu equation (also a multiplier of 1e-27 beside one of 1e-1), and Liouville's
    formula.

    Examples
    --------
    >>> import stability as st
    >>> m = st.monodromy(st.models.mathieu_canonical(), a=1.0, q=0.5, zeta=0.0)
    >>> print(m.verdict, m.kind, abs(m.growth_rate - st.mathieu_exponent(1.0, 0.5).imag) < 1e-12)
    unstable -1 True
    """
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise InputError(f"tolerance = {tolerance!r}; a positive number is needed")
    values, generator, period, breaks, trivial = _prepare(system, about, params)
    matrix, factors, matrix_error, steps = _integrate(generator, breaks, tolerance, values)
    log_determinant, defect = _liouville(generator, breaks, factors)
    multipliers, errors, block = multipliers_with_errors(matrix, factors, log_determinant, matrix_error)
    index = int(np.argmin(np.abs(multipliers - 1.0))) if trivial else None
    if index is not None:
        # the trivial multiplier shows how far the orbit itself is from being one
        errors = np.maximum(errors, abs(multipliers[index] - 1.0) * np.minimum(1.0, np.abs(multipliers)))
    judged = np.arange(len(multipliers)) if index is None else np.delete(np.arange(len(multipliers)), index)
    verdict, kind, counts = classify(
        multipliers[judged], errors[judged], neutral=_reciprocal(generator), block=block[judged]
    )
    with np.errstate(divide="ignore"):
        exponents = np.asarray(np.log(multipliers) / period, dtype=complex)
    return Monodromy(
        matrix=matrix,
        multipliers=multipliers,
        exponents=exponents,
        multiplier_errors=errors,
        error=float(errors.max()),
        matrix_error=matrix_error,
        liouville_defect=defect,
        period=period,
        verdict=verdict,
        kind=kind,
        counts=counts,
        trivial=index,
        about=about,
        params=values,
        steps=steps,
    )


Generator = Callable[[Array], Array]


def _prepare(
    system: System, about: Any, params: dict[str, float]
) -> tuple[dict[str, float], Generator, float, Array, bool]:
    """Parameter values, ``T A(s)`` with shape (K, 1, n, n), period, breaks, and whether 1 is a trivial multiplier."""
    if hasattr(about, "period") and callable(about):
        own = {k: v for k, v in dict(getattr(about, "params", {})).items() if k in system.parameters}
        P = system.parameter_vector(**{**own, **params})
        generator, period, breaks = orbit_generator(system, about, P)
        autonomous = system.period_expression is None
        return dict(zip(system.parameters, P.tolist(), strict=True)), generator, period, breaks, autonomous
    P = system.parameter_vector(**params)
    linear = linearise(system, about)
    period = float(linear.period(P)[0])
    if not (np.isfinite(period) and period > 0):
        raise InputError(
            f"the period of '{system.name}' is {period:.6g} at these parameters; it must be positive and finite"
        )
    A = linear.bind(P)
    breaks = np.asarray(linear.breaks(P), dtype=float).reshape(-1)
    return dict(zip(system.parameters, P.tolist(), strict=True)), lambda s: period * A(s), period, breaks, False


def _integrate(
    generator: Generator, breaks: Array, tolerance: float, values: dict[str, float]
) -> tuple[Array, Array, float, int]:
    """M, its factors, the error of its entries and the number of steps: halving until two results agree."""
    edges = step_edges(_FIRST_STEPS, breaks)
    coarse = step_factors(generator, edges)[:, 0]
    previous: Array | None = None
    while True:
        halves = np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))
        fine = step_factors(generator, halves)[:, 0]
        paired = fine[1::2] @ fine[0::2]
        factors = paired + (paired - coarse) / 63.0
        with np.errstate(over="ignore", invalid="ignore"):
            matrix = ordered_product(factors)
        if not np.abs(matrix).max() < _LIMIT:
            _out_of_range(matrix, values)
        rounding = float(rounding_error(matrix, len(fine)))
        scale = max(1.0, float(np.abs(matrix).max()))
        if previous is not None:
            change = 4.0 * float(np.abs(matrix - previous).max()) / 255.0
            if change <= max(tolerance * scale, rounding):
                return matrix, factors, change + rounding, len(fine)
            if 2 * len(fine) > _MAX_STEPS:
                raise ConvergenceError(
                    f"the period map is known to {change:.1e} after {len(fine)} steps, {tolerance * scale:.1e} was "
                    "asked for; declare the breaks of the right-hand side, or give a larger tolerance",
                    matrix=matrix,
                    error=change,
                    steps=len(fine),
                )
        previous, edges, coarse = matrix, halves, fine


def _out_of_range(matrix: Array, values: dict[str, float]) -> None:
    listing = ", ".join(f"{k} = {v:.6g}" for k, v in values.items())
    if np.isnan(matrix).any():
        raise NonFiniteError(f"the period map is not a number at {listing}; the equations overflow along the solution")
    raise ConvergenceError(
        f"the period map has entries beyond {_LIMIT:g} at {listing}: the multipliers are outside the range of floating "
        "point numbers; for Mathieu's equation mathieu_exponent gives the growth rate there",
        matrix=matrix,
    )


def _liouville(generator: Generator, breaks: Array, factors: Array) -> tuple[float, float]:
    """``int tr A`` over the period by eight-point Gauss rules, and the relative defect of the determinant."""
    edges = step_edges(64, breaks)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    phases = (middle[:, None] + half[:, None] * nodes).ravel()
    traces = np.trace(generator(phases)[:, 0], axis1=1, axis2=2).reshape(len(half), len(nodes))
    integral = float(np.sum((traces @ weights) * half))
    signs, logs = np.linalg.slogdet(factors)
    if np.any(signs <= 0):
        return integral, np.inf
    return integral, float(abs(np.expm1(np.sum(logs) - integral)))


def _reciprocal(generator: Generator) -> bool:
    """Whether structure proves reciprocal multipliers in each block of mutually coupled states."""
    A = generator(_PROBES)[:, 0]
    blocks = mutual_blocks((A != 0).any(axis=0))
    return all(_reciprocal_block(A[:, members[:, None], members]) for members in blocks)


def _reciprocal_block(A: Array) -> bool:
    """n = 2 trace-free, or ``x'' + K(t) x = 0`` with K symmetric."""
    n = A.shape[-1]
    size = float(np.abs(A).max(initial=0.0))
    if n == 2:
        diagonal = np.abs(np.diagonal(A, axis1=1, axis2=2)).max(initial=0.0)  # not `size`: other units
        return bool(np.all(np.abs(A[:, 0, 0] + A[:, 1, 1]) <= 1e-15 * diagonal))
    if n % 2:
        return False
    h = n // 2
    stiffness = A[:, h:, :h]
    upper = A[:, :h, :h] == 0.0
    same = A[:, :h, h:] == A[0, 0, h] * np.eye(h)
    damping_free = A[:, h:, h:] == 0.0
    symmetric = np.abs(stiffness - stiffness.transpose(0, 2, 1)) <= 1e-14 * size
    return bool(upper.all() and same.all() and damping_free.all() and symmetric.all())
