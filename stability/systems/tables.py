"""Tabulated functions: piecewise polynomials that stand as opaque functions inside equations.

Between breakpoints b_0 < ... < b_K a table is, for b_{k-1} <= x < b_k (the last piece closed on the right),

    f(x) = sum_j c[k, j] (x - b_{k-1})^j,     k = 1 ... K,

with two more rows for the outside: c[0] about b_0 for x < b_0, c[K+1] about b_K for x > b_K. ``extrapolate="linear"``
fills them with value and slope at the end; ``"nan"`` with NaN, so that leaving the table shows in every result.
Derivative and antiderivative act on all rows and are exact; the antiderivative is continuous and starts at 0 in b_0.

From samples: interpolating spline of degree 5 (C^4, so three derivatives mean something; not-a-knot ends) or monotone
cubic (C^1, no overshoot; second and third derivatives are piecewise only). From a function: a quintic spline whose
error, measured against the function between the nodes, is below the tolerance or the constructor refuses.

References: C. de Boor, A Practical Guide to Splines (2001); F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17
(1980) 238 (monotone cubic).
"""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from ..errors import ConvergenceError, InputError

__all__ = ["Table", "TableFunction", "table_from_plain"]

EXTRAPOLATIONS = ("linear", "nan")


@dataclass(frozen=True, eq=False)
class Table:
    """A named function of one argument given by data; call it on a sympy expression to use it in equations.

    Parameters
    ----------
    name : str
        Identifier, as printed in equations.
    breakpoints : (K+1,) increasing
    coefficients : (K, d+1)
        Row k about the left end of piece k, lowest power first.
    extrapolate : "linear" or "nan"
    fit_error : float
        Largest measured difference from what was tabulated; 0 for interpolated samples at the samples.

    Examples
    --------
    >>> cube = Table("cube", [-1.0, 1.0], [[-1.0, 3.0, -3.0, 1.0]])
    >>> cube(sp.Symbol("x", real=True))
    cube(x)
    >>> float(cube.evaluate(0.5)), float(cube.derivative().evaluate(0.5)), float(cube.evaluate(2.0))
    (0.125, 0.75, 4.0)
    """

    name: str
    breakpoints: np.ndarray
    coefficients: np.ndarray
    extrapolate: str = "linear"
    fit_error: float = 0.0
    rows: np.ndarray = field(init=False, repr=False)
    key: tuple[str, bytes, bytes] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        breaks, coefficients = _checked(self.name, self.breakpoints, self.coefficients, self.extrapolate)
        outside = np.zeros((2, coefficients.shape[1]))
        if self.extrapolate == "nan":
            outside[:] = np.nan
        else:
            outside[0, :2] = coefficients[0, :2]
            outside[1, :2] = _taylor(coefficients[-1], breaks[-1] - breaks[-2])[:2]
        self._fill(breaks, coefficients, np.vstack([outside[:1], coefficients, outside[1:]]))

    def _fill(self, breaks: np.ndarray, coefficients: np.ndarray, rows: np.ndarray) -> None:
        for array in (breaks, coefficients, rows):
            array.flags.writeable = False
        for attribute, value in (("breakpoints", breaks), ("coefficients", coefficients), ("rows", rows)):
            object.__setattr__(self, attribute, value)
        object.__setattr__(self, "key", (self.name, breaks.tobytes(), rows.tobytes()))

    @classmethod
    def _from_rows(cls, name: str, breaks: np.ndarray, rows: np.ndarray, extrapolate: str) -> Table:
        """A table whose outside rows are given, not derived (derivatives and antiderivatives)."""
        table = object.__new__(cls)
        object.__setattr__(table, "name", name)
        object.__setattr__(table, "extrapolate", extrapolate)
        object.__setattr__(table, "fit_error", float("nan"))
        table._fill(np.array(breaks), np.ascontiguousarray(rows[1:-1]), np.ascontiguousarray(rows))
        return table

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    def __call__(self, argument: Any) -> sp.Expr:
        """The table applied to a sympy expression."""
        return _function_class(self)(argument)

    def evaluate(self, x: Any, order: int = 0) -> np.ndarray:
        """Value (or derivative of the given order) at real numbers `x`, any shape; NaN in gives NaN out."""
        if order:
            return self.derivative(order).evaluate(x)
        x = np.asarray(x, dtype=np.float64)
        breaks, rows = self.breakpoints, self.rows
        piece = np.searchsorted(breaks[:-1], x, side="right") + (x > breaks[-1])
        piece = np.where(np.isnan(x), 0, piece)
        distance = x - breaks[np.maximum(piece - 1, 0)]
        with np.errstate(all="ignore"):  # NaN and infinity pass through, as in machine code
            value = rows[piece, -1] + 0.0 * distance  # a constant piece, too, must pass NaN on
            for j in range(rows.shape[1] - 2, -1, -1):
                value = value * distance + rows[piece, j]
        return value

    def derivative(self, order: int = 1) -> Table:
        """The table of the derivative (exact, piece by piece)."""
        table = self
        for _ in range(order):
            table = _derivative_table(table)
        return table

    def antiderivative(self) -> Table:
        """The continuous antiderivative that vanishes at the first breakpoint (exact)."""
        rows = np.zeros((len(self.rows), self.rows.shape[1] + 1))
        rows[:, 1:] = self.rows / np.arange(1, self.rows.shape[1] + 1)
        widths = np.diff(self.breakpoints)
        powers = widths[:, None] ** np.arange(rows.shape[1])
        rows[2:, 0] = np.cumsum(np.sum(rows[1:-1] * powers, axis=1))
        if self.extrapolate == "nan":
            rows[[0, -1]] = np.nan
        return Table._from_rows(f"{self.name}_integral", self.breakpoints, rows, self.extrapolate)

    def to_dict(self) -> dict[str, Any]:
        """Plain data: lists, numbers, text."""
        rows = [[None if np.isnan(c) else float(c) for c in row] for row in self.rows]
        return {
            "name": self.name,
            "breakpoints": self.breakpoints.tolist(),
            "rows": rows,
            "extrapolate": self.extrapolate,
            "fit_error": None if np.isnan(self.fit_error) else float(self.fit_error),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Table:
        """The inverse of `to_dict`; refuses damaged data with an InputError."""
        missing = {"name", "breakpoints", "rows", "extrapolate"} - set(data)
        if missing:
            raise InputError(f"table data lacks {', '.join(sorted(missing))}")
        try:
            rows = np.array([[np.nan if c is None else c for c in row] for row in data["rows"]], dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"table '{data['name']}': rows must be equally long lists of numbers ({error})") from error
        if rows.ndim != 2 or len(rows) < 3 or not np.all(np.isfinite(rows[1:-1])):
            raise InputError(f"table '{data['name']}': rows must be finite, one for each piece and two for the outside")
        breaks, _ = _checked(data["name"], data["breakpoints"], rows[1:-1], data["extrapolate"])
        table = cls._from_rows(data["name"], breaks, rows, data["extrapolate"])
        fit_error = data.get("fit_error")
        object.__setattr__(table, "fit_error", float("nan") if fit_error is None else float(fit_error))
        return table

    @classmethod
    def from_samples(cls, name: str, x: Any, y: Any, *, method: str = "quintic", extrapolate: str = "linear") -> Table:
        """Interpolate samples.

        Parameters
        ----------
        name : str
            Identifier, as printed in equations.
        x, y : (N,) samples, x strictly increasing
        method : "quintic" or "monotone"
            Spline of degree 5 (C^4, not-a-knot ends; N >= 6), or monotone cubic (C^1, no overshoot; N >= 2).
        extrapolate : "linear" or "nan"

        Raises
        ------
        InputError
            Samples not finite, not increasing, not enough, or of different length.

        Examples
        --------
        >>> x = np.linspace(0, 1, 9)
        >>> abs(float(Table.from_samples("f", x, x**5).evaluate(0.3)) - 0.3**5) < 1e-15
        True
        """
        x, y = np.array(x, dtype=np.float64), np.array(y, dtype=np.float64)
        if x.ndim != 1 or x.shape != y.shape:
            raise InputError(f"table '{name}': x and y must be equally long and 1-d, got {x.shape}, {y.shape}")
        if not (np.all(np.isfinite(x)) and np.all(np.isfinite(y)) and np.all(np.diff(x) > 0)):
            raise InputError(f"table '{name}': samples must be finite and x strictly increasing")
        if method == "quintic":
            if len(x) < 6:
                raise InputError(f"table '{name}': a quintic needs at least 6 samples, got {len(x)}; or use 'monotone'")
            return cls(name, *_quintic(x, y), extrapolate)
        if method == "monotone":
            if len(x) < 2:
                raise InputError(f"table '{name}': at least 2 samples are needed, got {len(x)}")
            return cls(name, *_monotone(x, y), extrapolate)
        raise InputError(f"table '{name}': method must be 'quintic' or 'monotone', got {method!r}")

    @classmethod
    def from_function(
        cls,
        name: str,
        function: Callable[[np.ndarray], Any],
        interval: tuple[float, float],
        *,
        tolerance: float = 1e-10,
        extrapolate: str = "linear",
        max_pieces: int = 4096,
    ) -> Table:
        """Tabulate a numpy function on an interval with a measured, bounded error (quintic spline, equidistant nodes).

        Parameters
        ----------
        name : str
            Identifier, as printed in equations.
        function : callable
            Of an array, giving an array.
        interval : (low, high)
        tolerance : float
            Bound of the error divided by the largest modulus of the function at the nodes.
        extrapolate : "linear" or "nan"
        max_pieces : int

        Raises
        ------
        InputError
            Bad interval or tolerance; function not finite on the interval.
        ConvergenceError
            `max_pieces` pieces do not reach the tolerance (a kink or jump inside: tabulate the two sides apart).

        *Accuracy*: the error is measured at four points in every piece, and nodes are doubled until it is below the
        tolerance; the largest, in absolute terms, is kept as `fit_error`. Derivatives of order k lose about k orders
        of the node distance.

        Examples
        --------
        >>> Table.from_function("bell", lambda x: np.exp(-x**2), (-3, 3), tolerance=1e-9).fit_error < 1e-9
        True
        """
        low, high = float(interval[0]), float(interval[1])
        if not (np.isfinite(low) and np.isfinite(high) and low < high and tolerance > 0):
            raise InputError(f"table '{name}': needs finite low < high and tolerance > 0, got {interval}, {tolerance}")
        pieces, error, scale = 16, np.inf, 1.0
        while pieces <= max_pieces:
            x = np.linspace(low, high, pieces + 1)
            check = (x[:-1, None] + np.diff(x)[:, None] * np.array([0.13, 0.38, 0.62, 0.87])).ravel()
            y, truth = (np.broadcast_to(np.asarray(function(at), dtype=np.float64), at.shape) for at in (x, check))
            if not (np.all(np.isfinite(y)) and np.all(np.isfinite(truth))):
                raise InputError(f"table '{name}': the function is not finite everywhere on [{low}, {high}]")
            table = cls(name, *_quintic(x, y), extrapolate)
            scale = float(np.max(np.abs(y))) or 1.0
            error = float(np.max(np.abs(table.evaluate(check) - truth)))
            if error <= tolerance * scale:
                object.__setattr__(table, "fit_error", error)
                return table
            pieces *= 2
        raise ConvergenceError(
            f"table '{name}': {max_pieces} pieces leave a relative error of {error / scale:.1e} > {tolerance:.1e}; "
            "tabulate the two sides of a kink apart, or ask for less",
            error=error,
        )


class TableFunction(sp.Function):
    """A `Table` applied to an expression; every table has its own subclass, which carries it as `.table`."""

    table: Table
    is_real = True
    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """The derivative table at the same argument."""
        return self.table.derivative()(self.args[0])

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        """Pickled as the table and its argument: the class is made at run time."""
        return self.table, (self.args[0],)

    def to_plain(self) -> dict[str, Any]:
        """The table as plain data, for the expression tree (the argument stands beside it)."""
        return self.table.to_dict()

    def _eval_evalf(self, prec: int) -> sp.Expr | None:
        argument = self.args[0].evalf(17)
        return sp.Float(float(self.table.evaluate(float(argument)))) if argument.is_Float else None


def table_from_plain(data: Mapping[str, Any], argument: sp.Expr) -> sp.Expr:
    """The applied table of an expression tree: the inverse of `TableFunction.to_plain`."""
    return Table.from_dict(data)(argument)


_CLASSES: weakref.WeakValueDictionary[Table, type[TableFunction]] = weakref.WeakValueDictionary()
_CLASSES_LOCK = threading.Lock()


def _function_class(table: Table) -> type[TableFunction]:
    """One class for equal tables, so that equal expressions are equal; it goes when no expression uses it."""
    with _CLASSES_LOCK:
        known = _CLASSES.get(table)
        if known is None:
            known = _CLASSES[table] = type(table.name, (TableFunction,), {"table": table})
        return known


@lru_cache(maxsize=128)
def _derivative_table(table: Table) -> Table:
    rows: np.ndarray = table.rows[:, 1:] * np.arange(1, table.rows.shape[1])
    if rows.shape[1] == 0:
        rows = 0.0 * table.rows
    return Table._from_rows(f"{table.name}_prime", table.breakpoints, rows, table.extrapolate)


def _checked(name: Any, breaks: Any, coefficients: Any, extrapolate: Any) -> tuple[np.ndarray, np.ndarray]:
    if not (isinstance(name, str) and name.isidentifier()):
        raise InputError(f"a table's name must be an identifier, got {name!r}")
    if extrapolate not in EXTRAPOLATIONS:
        raise InputError(f"table '{name}': extrapolate must be 'linear' or 'nan', got {extrapolate!r}")
    try:
        breaks, coefficients = np.array(breaks, dtype=np.float64), np.array(coefficients, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"table '{name}': breakpoints and coefficients must be numbers ({error})") from error
    if breaks.ndim != 1 or len(breaks) < 2 or not np.all(np.isfinite(breaks)) or not np.all(np.diff(breaks) > 0):
        raise InputError(f"table '{name}': breakpoints must be finite, at least two, strictly increasing")
    if coefficients.ndim != 2 or len(coefficients) != len(breaks) - 1 or coefficients.shape[1] < 1:
        raise InputError(
            f"table '{name}': {len(breaks) - 1} pieces need coefficients ({len(breaks) - 1}, degree+1), "
            f"got {coefficients.shape}"
        )
    if not np.all(np.isfinite(coefficients)):
        raise InputError(f"table '{name}': coefficients must be finite")
    return breaks, coefficients


def _taylor(row: np.ndarray, shift: float) -> np.ndarray:
    """Coefficients of the same polynomial about a point `shift` further right."""
    moved = row.copy()
    for i in range(len(row) - 1):
        for j in range(len(row) - 2, i - 1, -1):
            moved[j] += shift * moved[j + 1]
    return moved


def _quintic(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from scipy.interpolate import PPoly, make_interp_spline

    pieces = PPoly.from_spline(make_interp_spline(x, y, k=5))
    real = np.diff(pieces.x) > 0  # the spline's repeated end knots give empty pieces
    return np.append(pieces.x[:-1][real], pieces.x[-1]), np.ascontiguousarray(pieces.c[::-1, real].T)


def _monotone(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from scipy.interpolate import PchipInterpolator

    pieces = PchipInterpolator(x, y)
    return np.array(pieces.x), np.ascontiguousarray(pieces.c[::-1].T)
