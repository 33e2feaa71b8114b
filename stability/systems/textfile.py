"""Models from text: a TOML file is data that becomes a `System`; nothing in it can run.

    [model]       name, description, source, coordinates; then either `equations` (with '=' and primes) or
                  `lagrangian`, or `kinetic` and `potential`:  d/dt (dL/dq') - dL/dq + dR/dq' = Q,  L = T - U,
                  with R = `dissipation`; period, angles, breaks
    [parameters]  name = number, or name = { value, unit, bounds = [lo, hi], description }
    [forces]      coordinate = "Q"              [outputs]  name = "expression"         [units]  state or output = "mm"
    [orders]      parameter = power of the small parameter that it carries (averaging)
    [base]        parameter (amplitude or acceleration), angular_frequency: the motion with_excitation prescribes
    [[stops]]     coordinate, position, side, restitution: walls
    [tables.NAME] x, y (samples), method, extrapolate: a measured function of one argument, used as NAME(...)

Keys of [model] may also stand at the top of the file. Expressions are read by parsing.py: velocities are ``x'`` or
``x_dot``, accelerations ``x''`` or ``x_ddot``, time is ``t``. Every refusal names the file and the key, and for
expressions the column. The result is equal (by content) to the one of `System.from_equations` or `from_lagrangian`.
"""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sympy as sp

from ..errors import (
    CompileError,
    EquationError,
    ExpressionError,
    FileFormatError,
    InputError,
    UnknownNameError,
    unknown_name,
)
from .nodes import valid_name
from .parsing import parse_equation, parse_expression

if TYPE_CHECKING:
    from .system import System

__all__ = ["MAX_BYTES", "TEMPLATE", "load_model", "model_from_text", "template"]

MAX_BYTES = 1 << 20
MAX_COORDINATES = 100
_TEXTS = ("name", "description", "source", "lagrangian", "kinetic", "potential", "dissipation", "period")
_LISTS = ("coordinates", "equations", "angles", "breaks")
_MODEL_KEYS = (*_TEXTS, *_LISTS)
_SECTIONS = ("model", "parameters", "forces", "outputs", "units", "orders", "base", "stops", "tables")
_TIME = sp.Symbol("t", real=True)

TEMPLATE = '''\
# A model for `stability`: the Duffing oscillator, hardening spring under harmonic force.
#
#     x'' + 2 xi x' + x + beta x^3 = F cos(Omega t)
#
# Expressions are text: + - * / **, brackets, sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp log
# sqrt abs sign heaviside max min mod floor, piecewise(value, condition, ..., otherwise), where(condition, yes, no),
# the constants pi and E, the time t. x' is the velocity (also x_dot), x'' the acceleration (also x_ddot).

[model]
name = "my_oscillator"
description = "Duffing oscillator under harmonic force"
source = "G. Duffing, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz (1918)"
coordinates = ["x"]
equations = ["x'' + 2*xi*x' + x + beta*x**3 = F*cos(Omega*t)"]
period = "2*pi/Omega"          # of the forcing; leave out for an autonomous system
# angles = ["theta"]           # coordinates that are angles
# breaks = [0, "1/2"]          # phases in [0, 1) at which the equations jump in time

# Instead of `equations`, energies (Lagrange's equations are derived):
# kinetic = "m*x'**2/2"
# potential = "k*x**2/2"       # or lagrangian = "m*x'**2/2 - k*x**2/2"
# dissipation = "c*x'**2/2"    # Rayleigh's function, half the dissipated power
# [forces]
# x = "F*cos(Omega*t)"

[parameters]                   # every name needs a value; unit, bounds and description are optional
xi = { value = 0.02, bounds = [0.0, 10.0], description = "damping ratio" }
beta = 0.05
F = 0.1
Omega = { value = 1.0, bounds = [1e-6, 1e6], description = "frequency of the force" }

[outputs]                      # further quantities to record
energy = "x'**2/2 + x**2/2 + beta*x**4/4"

# [units]
# x = "m"

# [orders]                     # powers of the small parameter, for averaging
# xi = 1
# beta = 1
# F = 1
'''


def template(name: str = "my_oscillator") -> str:
    """The commented template with the model's name filled in.

    >>> template("swing").splitlines()[9]
    'name = "swing"'
    """
    plain = re.sub(r"[^A-Za-z0-9 ._-]", "_", name) or "model"
    return TEMPLATE.replace('"my_oscillator"', f'"{plain}"')


def load_model(path: str | os.PathLike[str]) -> System:
    """The system that a TOML file describes.

    Parameters
    ----------
    path : str or path
        At most 1 MiB; see the head of this file, or the `TEMPLATE` that ``stability new`` writes.

    Raises
    ------
    FileFormatError
        Not TOML, not UTF-8, too large, a value of the wrong type.
    UnknownNameError
        A key, name or coordinate that does not exist; the nearest one is proposed.
    ExpressionError, EquationError
        An expression that is not allowed (with a caret), or equations that are no system.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "mine.toml")
    ...     size = file.write_text(TEMPLATE)
    ...     load_model(file).states
    ('x', 'x_dot')
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"the model file {file} cannot be read: {error.strerror}") from None
    if len(data) > MAX_BYTES:
        raise FileFormatError(f"{file.name}: a model file has at most {MAX_BYTES} bytes")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{file.name}: not UTF-8 text (byte {error.start})") from None
    return model_from_text(text, where=file.name)


def model_from_text(text: str, *, where: str = "model text") -> System:
    """The system that TOML text describes; `where` names it in errors. Errors as `load_model`."""
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"{where}: not TOML: {error}") from None
    return _Reader(content, where).system()


class _Reader:
    """The content of one file; every method reads one part and says where it stood when it refuses."""

    def __init__(self, content: dict[str, Any], where: str) -> None:
        self.where = where
        sections = {k: v for k, v in content.items() if k in _SECTIONS}
        top = {k: v for k, v in content.items() if k not in _SECTIONS}
        self.check_keys(top, (*_SECTIONS, *_MODEL_KEYS), "the top of the file")
        self.sections = sections
        model = self.section("model")
        self.check_keys(model, _MODEL_KEYS, "[model]")
        twice = sorted(set(top) & set(model))
        if twice:
            raise self.wrong(twice[0], "stands at the top of the file and again in [model]")
        self.model = {**top, **model}
        self.coordinates = self.names("coordinates")
        self.parameters = self.read_parameters()
        self.tables = self.read_tables()
        self.check_clashes()

    # ------------------------------------------------------------------------------------------------- the system
    def system(self) -> System:
        """Build it through the constructors that Python users call."""
        from .system import System

        velocities = [f"{c}_dot" for c in self.coordinates]
        everything = [*self.coordinates, *velocities, *(f"{c}_ddot" for c in self.coordinates), "t", *self.parameters]
        common = self.common(everything)
        functions = [sp.Function(c)(_TIME) for c in self.coordinates]
        with_equations = "equations" in self.model
        energies = [k for k in ("lagrangian", "kinetic", "potential", "dissipation") if k in self.model]
        if with_equations and (energies or "forces" in self.sections):
            other = energies[0] if energies else "[forces]"
            raise self.wrong("equations", f"and {other} exclude each other: give equations or energies")
        if with_equations:
            equations = self.read_equations(everything)
            return self.built(lambda: System.from_equations(equations, functions, **common))
        names = [*self.coordinates, *velocities, "t", *self.parameters]
        lagrangian, dissipation = self.lagrangian(names), self.optional("dissipation", names)
        forces = {
            sp.Function(c)(_TIME): self.timed(self.expression(f"forces.{c}", text, names))
            for c, text in self.named("forces", self.coordinates, "coordinate").items()
        }
        return self.built(
            lambda: System.from_lagrangian(lagrangian, functions, dissipation=dissipation, forces=forces, **common)
        )

    def built(self, build: Callable[[], System]) -> System:
        try:
            return build()
        except (EquationError, UnknownNameError, InputError, CompileError) as error:
            raise type(error)(f"{self.where}: {error}") from error

    def common(self, everything: list[str]) -> dict[str, Any]:
        """The arguments that both constructors share."""
        parameters = list(self.parameters)
        description, source = self.text("description"), self.text("source")
        outputs = {
            k: self.timed(self.expression(f"outputs.{k}", v, everything)) for k, v in self.section("outputs").items()
        }
        states = [*self.coordinates, *(f"{c}_dot" for c in self.coordinates), *parameters, *outputs]
        units = {k: self.typed(f"units.{k}", v, str) for k, v in self.named("units", states, "name").items()}
        orders = {k: self.typed(f"orders.{k}", v, int) for k, v in self.named("orders", states, "name").items()}
        period = self.model.get("period")
        return {
            "name": self.text("name") or Path(self.where).stem or "model",
            "description": f"{description} [{source}]" if source else description,
            "parameters": self.parameters,
            "period": None if period is None else self.expression("period", period, parameters),
            "outputs": outputs,
            "units": units,
            "orders": orders,
            "angles": self.names("angles", within=self.coordinates),
            "breaks": [self.expression("breaks", b, parameters) for b in self.items("breaks")],
            "base": self.base(parameters),
            "stops": self.stops(),
        }

    # ------------------------------------------------------------------------------------------------ expressions
    def expression(self, key: str, text: Any, names: Iterable[str]) -> sp.Expr:
        """One expression; numbers are allowed as they are. Line breaks of a TOML text count as spaces."""
        if isinstance(text, (int, float)) and not isinstance(text, bool):
            return sp.Integer(text) if isinstance(text, int) else sp.Float(self.number(key, text))
        return self.parsed(key, text, lambda line: parse_expression(line, names, self.tables))

    def parsed(self, key: str, text: Any, parse: Callable[[str], Any]) -> Any:
        line = self.typed(key, text, str).replace("\r", " ").replace("\n", " ")
        try:
            return parse(line)
        except ExpressionError as error:
            located = ExpressionError(f"{self.where}, {key}: {error}")
            located.text, located.column = error.text, error.column
            raise located from None

    def read_equations(self, names: list[str]) -> list[sp.Expr]:
        """Residuals left - right in functions of time."""
        residuals = []
        for number, text in enumerate(self.items("equations"), start=1):
            key = f"equations, number {number}"
            left, right = self.parsed(key, text, lambda line: parse_equation(line, names, self.tables))
            residuals.append(self.timed(left) - self.timed(right))
        return residuals

    def lagrangian(self, names: list[str]) -> sp.Expr:
        if "lagrangian" in self.model:
            if "kinetic" in self.model or "potential" in self.model:
                raise self.wrong("lagrangian", "and kinetic, potential exclude each other")
            return self.timed(self.expression("lagrangian", self.model["lagrangian"], names))
        if "kinetic" not in self.model:
            raise self.wrong("equations", "is missing: give equations, lagrangian, or kinetic and potential", "[model]")
        kinetic = self.timed(self.expression("kinetic", self.model["kinetic"], names))
        return kinetic - self.optional("potential", names)

    def optional(self, key: str, names: list[str]) -> sp.Expr:
        return self.timed(self.expression(key, self.model.get(key, 0), names))

    def timed(self, expression: sp.Expr) -> sp.Expr:
        """Names of coordinates and their derivatives become functions of time."""
        replacements: dict[sp.Basic, sp.Basic] = {}
        for c in self.coordinates:
            f = sp.Function(c)(_TIME)
            for order, suffix in enumerate(("", "_dot", "_ddot")):
                replacements[sp.Symbol(c + suffix, real=True)] = f.diff(_TIME, order) if order else f
        return expression.xreplace(replacements)

    # --------------------------------------------------------------------------------------------------- sections
    def read_parameters(self) -> dict[str, Any]:
        out: dict[str, Any] = {}
        for name, entry in self.section("parameters").items():
            key = f"parameters.{name}"
            self.check_name(key, name)
            if isinstance(entry, dict):
                self.check_keys(entry, ("value", "unit", "bounds", "description"), f"[{key}]")
                if "value" not in entry:
                    raise self.wrong(key, "needs a value")
                out[name] = {"value": self.number(f"{key}.value", entry["value"])}
                if "unit" in entry:
                    out[name]["unit"] = self.typed(f"{key}.unit", entry["unit"], str)
                if "bounds" in entry:
                    out[name]["bounds"] = self.bounds(f"{key}.bounds", entry["bounds"])
                self.typed(f"{key}.description", entry.get("description", ""), str)
            else:
                out[name] = self.number(key, entry)
        return out

    def read_tables(self) -> dict[str, Any]:
        from .tables import Table

        tables = {}
        for name, entry in self.section("tables").items():
            key = f"tables.{name}"
            self.check_name(key, name)
            self.check_keys(self.typed(key, entry, dict), ("x", "y", "method", "extrapolate"), f"[{key}]")
            samples = []
            for axis in ("x", "y"):
                values = self.typed(f"{key}.{axis}", entry.get(axis, []), list)
                samples.append([self.number(f"{key}.{axis}", v) for v in values])
            options = {k: self.typed(f"{key}.{k}", entry[k], str) for k in ("method", "extrapolate") if k in entry}
            try:
                tables[name] = Table.from_samples(name, samples[0], samples[1], **options)
            except InputError as error:
                raise InputError(f"{self.where}, {key}: {error}") from None
        return tables

    def base(self, parameters: list[str]) -> Any:
        from .excitation import BaseMotion

        section = self.section("base")
        if not section:
            return None
        self.check_keys(section, ("parameter", "angular_frequency"), "[base]")
        if len(section) < 2:
            raise self.wrong("base", "needs parameter and angular_frequency")
        name = self.typed("base.parameter", section["parameter"], str)
        self.check_member("base.parameter", "parameter", name, parameters)
        frequency = self.expression("base.angular_frequency", section["angular_frequency"], parameters)
        try:
            return BaseMotion(name, frequency)
        except InputError as error:
            raise InputError(f"{self.where}, base: {error}") from None

    def stops(self) -> list[Any]:
        from .stops import HardStop

        out = []
        for number, entry in enumerate(self.typed("stops", self.sections.get("stops", []), list), start=1):
            key = f"stops, number {number}"
            self.check_keys(self.typed(key, entry, dict), ("coordinate", "position", "side", "restitution"), f"[{key}]")
            for needed in ("coordinate", "position"):
                if needed not in entry:
                    raise self.wrong(key, f"needs {needed}")
            self.check_member(key, "coordinate", entry["coordinate"], self.coordinates)
            side = self.typed(f"{key}.side", entry.get("side", 1), int)
            numbers = [self.number(key, entry["position"]), self.number(key, entry.get("restitution", 1.0))]
            try:
                out.append(HardStop(entry["coordinate"], numbers[0], side, numbers[1]))
            except InputError as error:
                raise InputError(f"{self.where}, {key}: {error}") from None
        return out

    # ----------------------------------------------------------------------------------------------------- values
    def section(self, name: str) -> dict[str, Any]:
        value = self.sections.get(name, {})
        if not isinstance(value, dict):
            raise self.wrong(name, f"must be a table [{name}], not {type(value).__name__}")
        return value

    def named(self, section: str, allowed: list[str], what: str) -> dict[str, Any]:
        entries = self.section(section)
        for key in entries:
            self.check_member(f"[{section}]", what, key, allowed)
        return entries

    def items(self, key: str) -> list[Any]:
        return self.typed(key, self.model.get(key, []), list)

    def names(self, key: str, within: list[str] | None = None) -> list[str]:
        found = self.items(key)
        for name in found:
            self.check_name(key, name)
            if within is not None:
                self.check_member(key, "coordinate", name, within)
        if within is None and not 1 <= len(found) <= MAX_COORDINATES:
            raise self.wrong(key, f'needs 1 to {MAX_COORDINATES} names, such as ["x"]; it has {len(found)}')
        return found

    def text(self, key: str) -> str:
        return str(self.typed(key, self.model.get(key, ""), str))

    def number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.wrong(key, f"must be a number, not {_shown(value)}")
        if (isinstance(value, int) and value.bit_length() > 1023) or not math.isfinite(value):
            raise self.wrong(key, f"must be a finite number, not {_shown(value)}")
        return float(value)

    def bounds(self, key: str, value: Any) -> tuple[float, float]:
        if not isinstance(value, list) or len(value) != 2:
            raise self.wrong(key, f"must be [lo, hi], not {_shown(value)}")
        return self.number(key, value[0]), self.number(key, value[1])

    def typed(self, key: str, value: Any, kind: type) -> Any:
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            words = {str: "text in quotes", list: "a list [...]", dict: "a table", int: "a whole number"}
            raise self.wrong(key, f"must be {words[kind]}, not {_shown(value)}")
        return value

    # ----------------------------------------------------------------------------------------------------- checks
    def check_keys(self, given: Mapping[str, Any], allowed: Iterable[str], place: str) -> None:
        for key in given:
            if key not in tuple(allowed):
                raise unknown_name("key", _shown(key).strip("'"), allowed, f"{place} in {self.where}")

    def check_member(self, key: str, what: str, name: Any, allowed: list[str]) -> None:
        if name not in allowed:
            raise UnknownNameError(f"{self.where}, {key}: {unknown_name(what, name, allowed, 'the model')}")

    def check_name(self, key: str, name: Any) -> None:
        if not valid_name(name):
            raise self.wrong(key, f"{_shown(name)} is no name: a letter, then letters, digits, single underscores")

    def check_clashes(self) -> None:
        derived = [c + suffix for c in self.coordinates for suffix in ("", "_dot", "_ddot")]
        names = [*derived, *self.parameters, *self.tables, "t"]
        for name in names:
            if names.count(name) > 1:
                raise EquationError(f"{self.where}: the name '{name}' stands for two things")

    def wrong(self, key: str, what: str, place: str = "") -> FileFormatError:
        return FileFormatError(f"{self.where}, {place + ' ' if place else ''}{key}: {what}")


def _shown(value: Any) -> str:
    if isinstance(value, (list, dict)):
        return "a list" if isinstance(value, list) else "a table"
    if isinstance(value, int) and value.bit_length() > 128:
        return "a number of that size"
    text = ascii(value)
    return text if len(text) <= 60 else text[:57] + "..."
