"""The evaluator's contract: batched F, dF/dx, dF/dp of one system, whatever computes them.

    F = f(t, x, p),    J_ij = dF_i/dx_j,    Fp_ij = dF_i/dp_j + phase (dT/dp_j) dF_i/dt,      t = phase T(p)

Forced systems are evaluated at fixed phase: T(p) is put into the equations before they are differentiated, so Fp has
no secular term. F is dx/dt, not multiplied by T. Arrays are point-major, C-contiguous float64:

    phase (N,) in units of the period   X (N, n)   P (m,) shared or (N, m)   ->   F (N, n)   J (N, n, n)   Fp (N, n, m)

A back end supplies `_run` (and what it compiles); this class checks shapes and types (a wrong shape in machine code is
a crash, not an exception), allocates, and hands out C addresses. Compilation happens at the first use of each
quantity, once, under a lock; afterwards an evaluator has no mutable state that a result depends on, so threads may
share it.
"""

from __future__ import annotations

import ctypes
import math
import threading
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from ..errors import InputError, NonFiniteError

__all__ = ["Evaluator"]

Array = np.ndarray
ADDRESSES = ("F", "FJ", "FJP")
DIRECTIONS = {"second": 2, "third": 3, "second_gradient": 2}  # direction arrays of each
FLOAT = np.dtype(np.float64)


class Evaluator:
    """Batched F, dF/dx, dF/dp and directional derivatives of one system; made by `evaluator`.

    Attributes
    ----------
    n, m : int
        Numbers of states and parameters.
    forced : bool
        Whether the system has a forcing period (then `phase` matters).
    backend : "llvm", "lambdify" or "function"
    states, parameters, output_names : tuples of str
        What the columns of X, P and of `outputs` are.
    callback_error : exception or None
        The last error of a Python back end behind `address` (its outputs were filled with NaN).
    """

    backend = ""

    def __init__(self, system: Any) -> None:
        self.states = tuple(system.states)
        self.parameters = tuple(system.parameters)
        self.output_names = tuple(system.outputs)
        self.n, self.m = len(self.states), len(self.parameters)
        self.forced = system.period_expression is not None
        self._lock = threading.RLock()
        self._codes: dict[str, Any] = {}
        self._callbacks: dict[str, Any] = {}
        self.callback_error: BaseException | None = None

    # ------------------------------------------------------------------ values and derivatives

    def F(self, phase: Any, X: Any, P: Any) -> Array:
        """dx/dt, shape (N, n).

        Parameters
        ----------
        phase : (N,) or a number; ignored (may be None) by autonomous systems
        X : (N, n)
        P : (m,) or (N, m)

        Raises
        ------
        InputError
            Wrong shapes or types, before anything is computed.
        """
        phase, X, P = self._checked(phase, X, P)
        F = np.empty((len(X), self.n))
        self._run("F", phase, X, P, (), (F,))
        return F

    def FJ(self, phase: Any, X: Any, P: Any) -> tuple[Array, Array]:
        """F (N, n) and J (N, n, n) with J[k, i, j] = dF_i/dx_j at point k."""
        phase, X, P = self._checked(phase, X, P)
        N, n = len(X), self.n
        F, J = np.empty((N, n)), np.empty((N, n, n))
        self._run("FJ", phase, X, P, (), (F, J))
        return F, J

    def FJP(self, phase: Any, X: Any, P: Any) -> tuple[Array, Array, Array]:
        """F, J and Fp (N, n, m) = dF/dp at fixed phase."""
        phase, X, P = self._checked(phase, X, P)
        N, n = len(X), self.n
        F, J, Fp = np.empty((N, n)), np.empty((N, n, n)), np.empty((N, n, self.m))
        self._run("FJP", phase, X, P, (), (F, J, Fp))
        return F, J, Fp

    def second(self, phase: Any, X: Any, P: Any, V: Any, W: Any) -> Array:
        """Second directional derivative D2F[V, W] over z = (x, p) at fixed phase; V, W (N, n+m); result (N, n)."""
        return self._directional("second", phase, X, P, (V, W))

    def third(self, phase: Any, X: Any, P: Any, U: Any, V: Any, W: Any) -> Array:
        """Third directional derivative D3F[U, V, W] over z = (x, p) at fixed phase; result (N, n)."""
        return self._directional("third", phase, X, P, (U, V, W))

    def second_gradient(self, phase: Any, X: Any, P: Any, V: Any, W: Any, sizes: Any) -> Array:
        """sum_i W_i D2F_i[V, e_k] for every k of z = (x, p): gradient of W . D_V F at fixed V (N, n+m), W (N, n).

        `sizes` (n+m,) of the variables scale the differences of back ends without formulas. Result (N, n+m).
        """
        sizes = np.asarray(sizes, dtype=float)
        N, width = len(X), self.n + self.m
        V, W = np.broadcast_to(V, (N, width)), np.broadcast_to(W, (N, self.n))
        length = float(np.abs(V / sizes).max(initial=0.0))
        if length == 0.0:
            return np.zeros((N, width))
        units = np.repeat(np.diag(sizes), N, axis=0)
        times = None if phase is None else np.tile(np.broadcast_to(phase, (N,)), width)
        P = np.asarray(P, dtype=float)
        values = self.second(
            times, np.tile(X, (width, 1)), P if P.ndim == 1 else np.tile(P, (width, 1)),
            np.tile(V / length, (width, 1)), units,
        )  # fmt: skip
        slopes: Array = np.einsum("kcn,cn->ck", values.reshape(width, N, self.n), W) * (length / sizes)
        return slopes

    def _directional(self, which: str, phase: Any, X: Any, P: Any, directions: Sequence[Any]) -> Array:
        phase, X, P = self._checked(phase, X, P)
        shape = (len(X), self.n + self.m)
        blocks = []
        for direction in directions:
            block = _float_array(direction, "a direction")
            if block.shape != shape and block.shape != shape[1:]:
                raise InputError(f"a direction has shape (N, n+m) = {shape} or {shape[1:]}; got {block.shape}")
            blocks.append(np.ascontiguousarray(np.broadcast_to(block, shape)))
        F = np.empty((len(X), self.n))
        self._run(which, phase, X, P, tuple(blocks), (F,))
        return F

    def outputs(self, phase: Any, X: Any, P: Any) -> Array:
        """The named outputs, shape (N, number of outputs), in the order of `output_names`.

        In an output of an autonomous system ``t`` is `phase` itself.
        """
        given = phase
        phase, X, P = self._checked(phase, X, P)
        if phase is None:
            phase = np.zeros(len(X)) if given is None else self._checked_phase(given, len(X))
        values = np.empty((len(X), len(self.output_names)))
        self._run("outputs", phase, X, P, (), (values,))
        return values

    # ------------------------------------------------------------------ period and breaks

    def period(self, P: Any) -> Any:
        """T(p): a float for P (m,), an array (N,) for P (N, m)."""
        P = self._checked_parameters(P)
        period = self._period_values(P)[0]
        if P.ndim == 1:
            number = float(period)
            if 0.0 < number < math.inf:
                return number
        elif np.all((period > 0.0) & (period < np.inf)):
            return period
        raise InputError(f"the period must be finite and positive, got {period} at {self._named(P)}")

    def period_gradient(self, P: Any) -> Array:
        """dT/dp: (m,) for P (m,), (N, m) for P (N, m)."""
        return self._period_values(self._checked_parameters(P))[1]

    def breaks(self, P: Any) -> Array:
        """Phases in [0, 1) at which F jumps in time, sorted, each once; P (m,)."""
        P = self._checked_parameters(P, need_period=False)
        if P.ndim != 1:
            raise InputError(f"breaks need one parameter vector ({self.m},), got {P.shape}")
        return np.unique(np.mod(self._break_values(P), 1.0))

    def _named(self, P: Array) -> str:
        if P.ndim > 1:
            return f"some of {len(P)} parameter vectors"
        return ", ".join(f"{name} = {value:g}" for name, value in zip(self.parameters, P, strict=True))

    # ------------------------------------------------------------------ the C border

    def address(self, which: str) -> int:
        """Address of the C function of "F", "FJ" or "FJP"; valid as long as this evaluator lives.

        ``void f(int64 N, const double *phase, const double *X, const double *P, int64 pstride, double *F, double *J,
        double *Fp)``; pstride is 0 for shared parameters, else m; outputs not asked for may be null, and so may
        `phase` of an autonomous system.
        """
        if which not in ADDRESSES:
            raise InputError(f"address of 'F', 'FJ' or 'FJP', not {which!r}")
        with self._lock:
            if which not in self._callbacks:
                self._callbacks[which] = self._native(which)
            return int(self._callbacks[which][0])

    def directional_address(self, which: str) -> int:
        """Address of the C function of "second", "third" or "second_gradient"; valid as long as this evaluator lives.

        ``void f(int64 N, const double *phase, const double *X, const double *P, int64 pstride, const double *D1, ..,
        double *out, const double *sizes, void *unused)`` with the directions as in the method of that name (in the
        order of its arguments); `sizes` (n+m,), which "second_gradient" alone reads, may be null for the others.
        """
        if which not in DIRECTIONS:
            raise InputError(f"address of 'second', 'third' or 'second_gradient', not {which!r}")
        with self._lock:
            if which not in self._callbacks:
                self._callbacks[which] = self._native_directional(which)
            return int(self._callbacks[which][0])

    def failure(self, keep: bool = False) -> str:
        """What a Python function behind `address` raised last, as the end of a sentence; told once unless kept.

        A keyboard interrupt that fell into the function is raised here.
        """
        error = self.callback_error
        if not keep:
            self.callback_error = None
        if isinstance(error, KeyboardInterrupt):
            self.callback_error = None
            raise error
        return "" if error is None else f"; its right-hand side raised {type(error).__name__}: {error}"

    def _native(self, which: str) -> tuple[int, Any]:
        """A ctypes callback around `_run`; an exception cannot cross the C border, so it fills the outputs with NaN."""
        kinds = [ctypes.c_int64] + [ctypes.c_void_p] * 3 + [ctypes.c_int64] + [ctypes.c_void_p] * 3
        n, m, used = self.n, self.m, ADDRESSES.index(which) + 1
        sizes = (n, n * n, n * m)[:used]
        self._code(which)

        def callback(N: int, phase: int, X: int, P: int, stride: int, F: int, J: int, Fp: int) -> None:
            outputs = tuple(_view(a, N, size) for a, size in zip((F, J, Fp), sizes))
            try:
                parameters = _view(P, N, m) if stride else _view(P, 1, m)[0]
                self._run(which, _view(phase, N, 1)[:, 0] if phase else None, _view(X, N, n), parameters, (), outputs)
            except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - what is raised here must not enter C
                known = isinstance(error, NonFiniteError) and error.__cause__ is not None
                self.callback_error = error.__cause__ if known else error
                for output in outputs:
                    output[:] = np.nan

        function = ctypes.CFUNCTYPE(None, *kinds)(callback)
        return int(ctypes.cast(function, ctypes.c_void_p).value or 0), function

    def _native_directional(self, which: str) -> tuple[int, Any]:
        """As `_native`, around the method of that name."""
        n, z = self.n, self.n + self.m
        gradient = which == "second_gradient"
        widths = (z, n) if gradient else (z,) * DIRECTIONS[which]
        kinds = [ctypes.c_int64] + [ctypes.c_void_p] * 3 + [ctypes.c_int64] + [ctypes.c_void_p] * (len(widths) + 3)

        def callback(N: int, phase: int, X: int, P: int, stride: int, *arrays: int) -> None:
            out = _view(arrays[len(widths)], N, z if gradient else n)
            try:
                directions = [_view(a, N, width) for a, width in zip(arrays, widths)]
                sizes = [_view(arrays[len(widths) + 1], 1, z)[0]] if gradient else []
                parameters = _view(P, N, self.m) if stride else _view(P, 1, self.m)[0]
                times = _view(phase, N, 1)[:, 0] if phase else None
                out[:] = getattr(self, which)(times, _view(X, N, n), parameters, *directions, *sizes)
            except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - what is raised here must not enter C
                known = isinstance(error, NonFiniteError) and error.__cause__ is not None
                self.callback_error = error.__cause__ if known else error
                out[:] = np.nan

        function = ctypes.CFUNCTYPE(None, *kinds)(callback)
        return int(ctypes.cast(function, ctypes.c_void_p).value or 0), function

    # ------------------------------------------------------------------ what a back end supplies

    def _compiled(self, which: str) -> Any:
        raise NotImplementedError

    def _run(
        self, which: str, phase: Array | None, X: Array, P: Array, directions: tuple[Array, ...], out: tuple[Array, ...]
    ) -> None:
        raise NotImplementedError

    def _period_values(self, P: Array) -> tuple[Array, Array]:
        """T, a number or (N,), and dT/dp, of the shape of P."""
        raise NotImplementedError

    def _break_values(self, P: Array) -> Array:
        raise NotImplementedError

    def _code(self, which: str) -> Any:
        code = self._codes.get(which)
        if code is None:
            with self._lock:
                code = self._codes.get(which)
                if code is None:
                    code = self._codes[which] = self._compiled(which)
        return code

    # ------------------------------------------------------------------ checks

    def _checked(self, phase: Any, X: Any, P: Any) -> tuple[Array | None, Array, Array]:
        X = _float_array(X, "X")
        if X.ndim != 2 or X.shape[1] != self.n:
            raise InputError(f"X has shape (N, n) = (N, {self.n}), one row per point; got {X.shape}")
        P = _float_array(P, "P")
        if P.shape != (self.m,) and P.shape != (len(X), self.m):
            raise InputError(f"P has shape (m,) = ({self.m},) or (N, m) = ({len(X)}, {self.m}); got {P.shape}")
        return self._checked_phase(phase, len(X)) if self.forced else None, X, P

    def _checked_phase(self, phase: Any, N: int) -> Array:
        phase = _float_array(phase, "phase")
        if phase.ndim == 0:
            return np.full(N, float(phase))
        if phase.shape != (N,):
            raise InputError(f"phase has shape (N,) = ({N},) or is a number; got {phase.shape}")
        return phase

    def _checked_parameters(self, P: Any, need_period: bool = True) -> Array:
        if need_period and not self.forced:
            raise InputError("an autonomous system has no forcing period; its orbits have their own")
        P = _float_array(P, "P")
        if P.ndim not in (1, 2) or P.shape[-1] != self.m:
            raise InputError(f"P has shape (m,) = ({self.m},) or (N, m); got {P.shape}")
        return P


def _float_array(values: Any, what: str) -> Array:
    """C-contiguous float64; a fast way out for arrays that already are."""
    if type(values) is np.ndarray and values.dtype == FLOAT and values.flags.c_contiguous:
        return values
    array = np.asarray(values)
    if array.dtype.kind not in "fiub":
        raise InputError(f"{what} must be real numbers; got {array.dtype} ({type(values).__name__})")
    return np.ascontiguousarray(array, dtype=np.float64) if array.ndim else array.astype(np.float64)


def address_of(array: Array) -> int:
    """Address of an array's first element (a quarter of the time that `array.ctypes.data` takes, where it can)."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(cast(Any, array)))
    except (TypeError, ValueError):  # read-only or empty
        return int(array.ctypes.data)


def _view(address: int | None, N: int, size: int) -> Array:
    """Memory at an address as an (N, size) array; an empty one for null."""
    if not address or N * size == 0:
        return np.empty((N, size))
    memory = (ctypes.c_double * (N * size)).from_address(address)
    return np.ctypeslib.as_array(memory).reshape(N, size)
