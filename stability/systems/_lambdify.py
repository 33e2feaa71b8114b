"""numpy code for the expressions of a system: the fallback back end, and the oracle of the compiled one.

sympy's `lambdify` writes one vectorised function of the phase, states, parameters and directions, all arrays over the
points. The source holds generated names only. Conditions become nested ``where`` (every branch is computed, warnings
about the branches not taken are silenced), maxima and logical connectives are pairwise, so that constants broadcast.
It works on the whole expressions with whole-expression derivatives (`Equations.expanded`), the compiled back end on
the shared program: the two agree only if both are right.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp
from sympy.printing.numpy import NumPyPrinter

from ._program import Program, functions_in, share
from .tables import Table, TableFunction

__all__ = ["SUPPORTED", "NumpyCode", "numpy_function"]

RECIPROCALS = {"sec": "cos", "csc": "sin", "cot": "tan", "sech": "cosh", "csch": "sinh", "coth": "tanh"}
SUPPORTED = frozenset(
    {"Add", "Mul", "Pow", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"}
    | {"asinh", "acosh", "atanh", "Abs", "sign", "Heaviside", "Max", "Min", "Mod", "floor", "ceiling", "frac"}
    | {"Piecewise", "ExprCondPair", "And", "Or", "Not", "ITE", "StrictLessThan", "LessThan", "Equality"}
    | {"StrictGreaterThan", "GreaterThan", "Unequality", "PowerLog", "TableFunction", *RECIPROCALS}
)


def power_log(base: Any, exponent: Any, count: Any) -> Any:
    """u^p (log u)^k with its limit 0 at u = 0 for p > 0."""
    value = np.power(base, exponent) * np.log(base) ** count
    return np.where((np.equal(base, 0)) & (np.greater(exponent, 0)), 0.0, value)


class _Printer(NumPyPrinter):
    """numpy source in which everything broadcasts; tables are collected in `tables`."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False, "inline": True, "allow_unknown_functions": True})
        self.tables: dict[Table, str] = {}

    def _pairwise(self, name: str, arguments: Sequence[sp.Basic]) -> str:
        text = self._print(arguments[0])
        for argument in arguments[1:]:
            text = f"{name}({text}, {self._print(argument)})"
        return str(text)

    def _print_Max(self, node: sp.Max) -> str:
        return self._pairwise("maximum", node.args)

    def _print_Min(self, node: sp.Min) -> str:
        return self._pairwise("minimum", node.args)

    def _print_And(self, node: sp.And) -> str:
        return self._pairwise("logical_and", node.args)

    def _print_Or(self, node: sp.Or) -> str:
        return self._pairwise("logical_or", node.args)

    def _print_ITE(self, node: sp.ITE) -> str:
        return f"where({', '.join(self._print(a) for a in node.args)})"

    def _print_Piecewise(self, node: sp.Piecewise) -> str:
        text = "nan"
        for value, condition in reversed(node.args):
            text = f"where({self._print(condition)}, {self._print(value)}, {text})"
        return text

    def _print_Mod(self, node: sp.Mod) -> str:
        return self._pairwise("mod", node.args)

    def _print_sign(self, node: sp.sign) -> str:
        return f"sign({self._print(node.args[0])})"

    def _print_Heaviside(self, node: sp.Heaviside) -> str:
        return self._pairwise("heaviside", node.args)

    def _print_frac(self, node: sp.Expr) -> str:
        argument = self._print(node.args[0])
        return f"(({argument}) - floor({argument}))"

    def _print(self, expr: Any, **options: Any) -> str:
        if isinstance(expr, TableFunction):  # before the dispatch by class name: a user may call a table "sin"
            return f"{self.tables[expr.table]}({self._print(expr.args[0])})"
        return str(super()._print(expr, **options))

    def _print_PowerLog(self, node: sp.Expr) -> str:
        return f"power_log({', '.join(self._print(a) for a in node.args)})"

    def _reciprocal(self, node: sp.Expr) -> str:
        return f"(1.0/{RECIPROCALS[type(node).__name__]}({self._print(node.args[0])}))"

    _print_sec = _print_csc = _print_cot = _print_sech = _print_csch = _print_coth = _reciprocal


def numpy_function(arguments: Sequence[sp.Symbol], expressions: Sequence[sp.Expr]) -> Any:
    """A function of arrays (or numbers) that gives the list of values."""
    printer = _Printer()
    namespace: dict[str, Any] = {
        "power_log": power_log,
    }
    tables = _tables_in(expressions)
    for k, table in enumerate(tables):
        printer.tables[table] = f"table_{k}"
        namespace[f"table_{k}"] = table.evaluate
    conditional = "Piecewise" in functions_in(expressions)  # sympy's own cse would name conditions like numbers
    cse: Any = share if conditional else True
    return sp.lambdify(list(arguments), list(expressions), [namespace, "numpy"], printer=printer, cse=cse)


def _tables_in(expressions: Sequence[sp.Expr]) -> list[Table]:
    found: set[Any] = set().union(*(e.atoms(TableFunction) for e in expressions))
    return sorted({node.table for node in found}, key=lambda table: table.key)


class NumpyCode:
    """The expanded program as one numpy function; `run` fills output arrays in place."""

    def __init__(self, program: Program) -> None:
        arguments = [program.phase, *program.states, *program.parameters]
        for block in program.directions:
            arguments.extend(block)
        self._function = numpy_function(arguments, [e for block in program.results for e in block])

    def run(
        self,
        phase: np.ndarray,
        X: np.ndarray,
        P: np.ndarray,
        directions: Sequence[np.ndarray],
        outputs: Sequence[np.ndarray],
    ) -> None:
        """Evaluate at N points: arrays as in the evaluator, outputs (N, size)."""
        columns = [phase, *X.T, *(P if P.ndim == 1 else P.T)]
        for block in directions:
            columns.extend(block.T)
        with np.errstate(all="ignore"):
            values = iter(self._function(*columns))
            for output in outputs:
                for k in range(output.shape[1]):
                    output[:, k] = next(values)
