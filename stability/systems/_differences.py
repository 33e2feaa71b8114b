r"""Derivatives of a Python function f(t, x, p) by central differences, with an error estimate.

One Richardson step on the central difference D(h) = (f(z + h) - f(z - h)) / 2h in each direction:

    D = (4 D(h/2) - D(h)) / 3 = f' + O(h^4),                               d2(h) = f(z + h) - 2 f(z) + f(z - h)
    error estimate  |D - D(h/2)| / 4 + |4 d2(h/2) - d2(h)| / 2h + rounding of f over h

with h = eps^(1/5) max(|z|, 1). The middle term is O(h^3) where f is smooth and as large as the jump of the slope where
a kink lies within h. For smooth functions the estimate is pessimistic by one to three digits. All displaced points of
all directions go to the function in ONE call, state axis first: t (M,), x (n, M), each parameter a number or (M,). A
function that fails for arrays of parameters is called once for each set of numbers among them.
Second and third directional derivatives are polarised differences with the same Richardson step.

The parameter derivative is taken at fixed phase: t = phase T(p + h). The complex step f' = Im f(z + ih)/h is offered
on request only: it is exact to rounding for analytic functions, and silently wrong for |x| or comparisons.

Reference: C. Ridders, Advances in Engineering Software 4 (1982) 75.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from ..errors import EquationError, InputError, NonFiniteError
from ._evaluator import Evaluator
from .expressions import differentiate

__all__ = ["FunctionEvaluator"]

Array = np.ndarray
EPS = float(np.finfo(float).eps)
FIRST, SECOND, THIRD = EPS ** (1 / 5), EPS ** (1 / 6), EPS ** (1 / 7)  # error terms h^4 against eps/h, /h^2, /h^3
COMPLEX_STEP = 1e-30
LATER = 0.7390851332151607  # a time that is no multiple of anything, to see whether an autonomous function looks at t


def _hint(error: Exception) -> str:
    """What to write instead, where a function seems to have been written for single points."""
    text = str(error)
    if "truth value of an array" in text or "only length-1 arrays" in text or "only 0-dimensional arrays" in text:
        return " (x is (n,) or (n, N), t a number or (N,): write np.where for if, np.sin for math.sin)"
    return ""


class FunctionEvaluator(Evaluator):
    """Evaluator of a system around a Python function."""

    backend = "function"

    def __init__(self, system: Any, complex_step: bool = False) -> None:
        super().__init__(system)
        self.function = system.function
        self.complex_step = complex_step
        self.name = system.name
        self._numbers_only = False  # whether the function has turned out to refuse arrays of parameters
        self._breaks = tuple(system.breaks)
        self._period, self._period_slopes = None, None
        self._time_checked = self.forced
        if self.forced:
            self._period, self._period_slopes = _clock(system.period_expression, self.parameters)
            if complex_step and self._period_slopes is None:
                raise InputError("the complex step needs the period as an expression, not as a Python function")

    # ------------------------------------------------------------------ the function

    def _values(self, phase: Array, X: Array, P: Array) -> Array:
        """f at M points: phase (M,), X (M, n), P (m,) or (M, m); possibly complex. Result (M, n)."""
        time = phase * self._period_of(P) if self.forced else phase
        rates = self._rates(time, X, P)
        if not self._time_checked:
            later = self._rates(time + LATER, X, P)
            if not np.array_equal(rates, later, equal_nan=True):
                raise EquationError(
                    "the function depends on t but declares no period: give from_function(..., period=...)"
                )
            self._time_checked = True
        return rates

    def _rates(self, time: Array, X: Array, P: Array) -> Array:
        if P.ndim == 1:
            return self._called(time, X, tuple(P))
        if not self._numbers_only:
            try:
                return self._called(time, X, tuple(np.ascontiguousarray(P.T)))
            except NonFiniteError:  # it may be a function of parameters that are numbers: `if a < 0.5: ...`
                pass
        values, owner = np.unique(P, axis=0, return_inverse=True)
        owner, rates = owner.ravel(), np.empty(X.shape, np.result_type(X, P))
        for k, parameters in enumerate(values):
            own = owner == k
            rates[own] = self._called(time[own], X[own], tuple(parameters))
        self._numbers_only = True
        return rates

    def _called(self, time: Array, X: Array, parameters: tuple[Any, ...]) -> Array:
        """The function at points (M, n), each parameter a number or (M,); what it raises is named and kept."""
        state = np.ascontiguousarray(X.T)
        try:
            rates = self.function(time, state, **dict(zip(self.parameters, parameters, strict=True)))
        except Exception as error:  # a user's function may raise anything
            raise NonFiniteError(
                f"the right-hand side of '{self.name}' raised {type(error).__name__}: {error}{_hint(error)}"
            ) from error
        if isinstance(rates, (list, tuple)):  # rows of different shape (a constant beside arrays) broadcast
            rates = np.stack([np.broadcast_to(np.asarray(row), state.shape[1:]) for row in rates]) if rates else rates
        rates = np.asarray(rates)
        if rates.shape != state.shape:
            raise InputError(
                f"the function must return dx/dt of shape (n, N) = {state.shape}, state axis first; got {rates.shape}"
            )
        return np.asarray(rates.T)

    def _period_of(self, P: Array) -> Any:
        assert self._period is not None
        return self._period(*(P if P.ndim == 1 else P.T))

    # ------------------------------------------------------------------ the back end

    def _compiled(self, which: str) -> Any:
        return None  # a Python function needs no compilation

    def _run(
        self, which: str, phase: Array | None, X: Array, P: Array, directions: tuple[Array, ...], out: tuple[Array, ...]
    ) -> None:
        N = len(X)
        phase = np.zeros(N) if phase is None else phase
        if which == "outputs":
            if self.output_names:
                raise InputError("outputs of a system around a Python function cannot be evaluated; compute them there")
            return
        if which in ("second", "third"):
            out[0][...] = self._directional_difference(phase, X, P, directions)
            return
        flat = [array.reshape(N, -1) if array.size else array for array in out]
        if which == "F":
            flat[0][...] = self._values(phase, X, P)
            return
        count = self.n if which == "FJ" else self.n + self.m
        if self.complex_step:
            value, slopes = self._complex_slopes(phase, X, P, count)
        else:
            value, slopes, _ = self._slopes(phase, X, P, count)
        flat[0][...] = value
        out[1].reshape(N, self.n, self.n)[...] = slopes[..., : self.n]
        if which == "FJP" and self.m:
            out[2].reshape(N, self.n, self.m)[...] = slopes[..., self.n :]

    def derivative_error(self, phase: Any, X: Any, P: Any) -> tuple[Array, Array]:
        """Estimated absolute errors of J (N, n, n) and Fp (N, n, m) at these points."""
        checked, X, P = self._checked(phase, X, P)
        _, _, error = self._slopes(np.zeros(len(X)) if checked is None else checked, X, P, self.n + self.m)
        return error[..., : self.n], error[..., self.n :]

    def _joined(self, X: Array, P: Array) -> Array:
        return np.hstack([X, np.broadcast_to(P, (len(X), self.m))])

    def _slopes(self, phase: Array, X: Array, P: Array, count: int) -> tuple[Array, Array, Array]:
        """F (N, n), dF/dz (N, n, count) over the first `count` of z = (x, p), and its error estimate."""
        z = self._joined(X, P)
        N = len(z)
        h = FIRST * np.maximum(np.abs(z[:, :count]), 1.0)
        points = np.repeat(z[None], 4 * count + 1, axis=0)
        for j in range(count):
            for k, factor in enumerate((1.0, -1.0, 0.5, -0.5)):
                points[1 + 4 * j + k, :, j] += factor * h[:, j]
        shared = P if P.ndim == 1 and count == self.n else None
        values = self._at(phase, points, shared)
        value, rest = values[0], values[1:].reshape(count, 4, N, self.n)
        width = np.stack([points[1 + 4 * j, :, j] - points[2 + 4 * j, :, j] for j in range(count)])[..., None]
        half_width = np.stack([points[3 + 4 * j, :, j] - points[4 + 4 * j, :, j] for j in range(count)])[..., None]
        coarse, fine = (rest[:, 0] - rest[:, 1]) / width, (rest[:, 2] - rest[:, 3]) / half_width
        slopes = (4.0 * fine - coarse) / 3.0
        bend, fine_bend = rest[:, 0] - 2.0 * value + rest[:, 1], rest[:, 2] - 2.0 * value + rest[:, 3]
        size = np.max(np.abs(rest), axis=(0, 1)) + np.einsum("jki,kj->ki", np.abs(slopes), np.abs(z[:, :count]))
        rounding = 4.0 * EPS * size / half_width  # of f: its value and the terms that may have cancelled in it
        error = np.abs(slopes - fine) / 4.0 + np.abs(4.0 * fine_bend - bend) / width + rounding
        return value, np.moveaxis(slopes, 0, -1), np.moveaxis(error, 0, -1)

    def _complex_slopes(self, phase: Array, X: Array, P: Array, count: int) -> tuple[Array, Array]:
        z = self._joined(X, P).astype(complex)
        points = np.repeat(z[None], count + 1, axis=0)
        for j in range(count):
            points[1 + j, :, j] += 1j * COMPLEX_STEP
        values = self._at(phase, points, None)
        return values[0].real, np.moveaxis(values[1:].imag / COMPLEX_STEP, 0, -1)

    def _at(self, phase: Array, points: Array, shared: Array | None) -> Array:
        """f at points (K, N, n+m) in one call -> (K, N, n); parameters go as numbers where they are `shared`."""
        K, N, _ = points.shape
        flat = points.reshape(K * N, -1)
        P = flat[:, self.n :] if shared is None else shared
        return self._values(np.tile(phase, K), flat[:, : self.n], P).reshape(K, N, self.n)

    def _directional_difference(self, phase: Array, X: Array, P: Array, directions: tuple[Array, ...]) -> Array:
        """D^k f [V_1 ... V_k] = sum over signs of (prod signs) f(z + sum sign_i h V_i) / (2h)^k, extrapolated."""
        z = self._joined(X, P)
        order = len(directions)
        step = SECOND if order == 2 else THIRD
        sizes = [np.linalg.norm(v, axis=1) for v in directions]
        units = [v / np.where(s > 0, s, 1.0)[:, None] for v, s in zip(directions, sizes, strict=True)]
        h = step * np.maximum(np.max(np.abs(z), axis=1, initial=0.0), 1.0)
        signs = list(itertools.product((1.0, -1.0), repeat=order))
        points = np.stack(
            [
                z + (factor * h)[:, None] * sum(s * u for s, u in zip(pattern, units, strict=True))
                for factor in (1.0, 0.5)
                for pattern in signs
            ]
        )
        values = self._at(phase, points, None).reshape(2, len(signs), len(z), self.n)
        weights = np.array([np.prod(pattern) for pattern in signs])
        coarse, fine = np.einsum("s,fskn->fkn", weights, values)
        coarse = coarse / (2.0 * h[:, None]) ** order
        fine = fine / h[:, None] ** order
        return (4.0 * fine - coarse) / 3.0 * np.prod(sizes, axis=0)[:, None]

    # ------------------------------------------------------------------ period and breaks

    def _period_values(self, P: Array) -> tuple[Array, Array]:
        period = np.broadcast_to(np.asarray(self._period_of(P), dtype=float), P.shape[:-1])
        gradient = np.empty(P.shape)
        if self._period_slopes is not None:
            for j, value in enumerate(self._period_slopes(*(P if P.ndim == 1 else P.T))):
                gradient[..., j] = value
            return period, gradient
        h = FIRST * np.maximum(np.abs(P), 1.0)

        def slope(j: int) -> Array:
            shift = np.zeros_like(P)
            shift[..., j] = h[..., j]
            coarse, fine = (
                (self._period_of(P + f * shift) - self._period_of(P - f * shift)) / (2.0 * f * h[..., j])
                for f in (1.0, 0.5)
            )
            return np.asarray((4.0 * fine - coarse) / 3.0)

        for j in range(self.m):
            gradient[..., j] = slope(j)
        return period, gradient

    def _break_values(self, P: Array) -> Array:
        return np.array([_clock(b, self.parameters)[0](*P) for b in self._breaks], dtype=float)


def _clock(expression: Any, parameters: tuple[str, ...]) -> tuple[Any, Any]:
    """T and its slopes as functions of the parameters in order; no slopes where T is a Python function of keywords."""
    if callable(expression) and not hasattr(expression, "free_symbols"):

        def each(*values: Any) -> Any:
            rows = np.stack(np.broadcast_arrays(*values), axis=-1) if values else np.empty((1, 0))
            if rows.ndim < 2:
                return expression(**dict(zip(parameters, values, strict=True)))
            different, place = np.unique(rows, axis=0, return_inverse=True)
            periods = [expression(**dict(zip(parameters, row, strict=True))) for row in different]
            return np.array(periods, dtype=float)[place.reshape(len(rows))]

        return each, None
    import sympy as sp

    from ._lambdify import numpy_function

    symbols = [sp.Symbol(name, real=True) for name in parameters]
    period = sp.sympify(expression)
    value = numpy_function(symbols, [period])
    return lambda *values: value(*values)[0], numpy_function(symbols, [differentiate(period, s) for s in symbols])
