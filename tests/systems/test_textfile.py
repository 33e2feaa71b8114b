"""Models from text: equal to the same model built in Python; every mistake named with file, key and column.

Witness: equality by content (and digest) with `System.from_equations` and `System.from_lagrangian`; golden messages.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as hst

import stability as st
from stability.errors import (
    EquationError,
    ExpressionError,
    FileFormatError,
    InputError,
    StabilityError,
    UnknownNameError,
)
from stability.systems.sources import resolve_model
from stability.systems.textfile import MAX_BYTES, TEMPLATE, load_model, model_from_text, template

T = sp.Symbol("t", real=True)
XI, BETA, F, W, M, K, C, G, L = sp.symbols("xi beta F Omega m k c g l")

PENDULUM = """
[model]
name = "swing"
description = "spring and pendulum"
coordinates = ["u", "theta"]
kinetic = '''
  (m + 1)*u'**2/2 + l**2*theta'**2/2
  + l*u'*theta'*sin(theta)'''
potential = "k*u**2/2 - g*l*cos(theta)"
dissipation = "c*u'**2/2"
angles = ["theta"]
[forces]
u = "F*cos(Omega*t)"
[parameters]
m = 1.5
k = { value = 4, unit = "N/m", bounds = [0, 100], description = "stiffness" }
c = 0.1
g = { value = 9.81, unit = "m/s^2" }
l = 1.0
F = 0.1
Omega = 2
[outputs]
force = "k*u + c*u'"
acceleration = "u''"
[units]
u = "m"
[orders]
c = 1
F = 1
"""


def test_template_is_the_duffing_oscillator() -> None:
    x = sp.Function("x")(T)
    expected = st.System.from_equations(
        {x.diff(T, 2): -2 * XI * x.diff(T) - x - BETA * x**3 + F * sp.cos(W * T)},
        [x],
        parameters={"xi": {"value": 0.02, "bounds": (0.0, 10.0)}, "beta": 0.05, "F": 0.1, "Omega": {"value": 1.0, "bounds": (1e-6, 1e6)}},
        period=2 * sp.pi / W,
        name="my_oscillator",
        description="Duffing oscillator under harmonic force "
        "[G. Duffing, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz (1918)]",
        outputs={"energy": x.diff(T) ** 2 / 2 + x**2 / 2 + BETA * x**4 / 4},
    )
    got = model_from_text(TEMPLATE)
    assert got == expected and got.digest == expected.digest
    assert got.states == ("x", "x_dot") and got.period == pytest.approx(2 * np.pi, rel=1e-15)


def test_energies_give_the_system_of_from_lagrangian() -> None:
    u, th = sp.Function("u")(T), sp.Function("theta")(T)
    kinetic = (M + 1) * u.diff(T) ** 2 / 2 + L**2 * th.diff(T) ** 2 / 2 + L * u.diff(T) * th.diff(T) * sp.sin(th)
    expected = st.System.from_lagrangian(
        kinetic - (K * u**2 / 2 - G * L * sp.cos(th)),
        [u, th],
        dissipation=C * u.diff(T) ** 2 / 2,
        forces={u: F * sp.cos(W * T)},
        parameters={"m": 1.5, "k": {"value": 4, "unit": "N/m", "bounds": (0, 100)}, "c": 0.1,
                    "g": {"value": 9.81, "unit": "m/s^2"}, "l": 1.0, "F": 0.1, "Omega": 2},
        name="swing", description="spring and pendulum", angles=["theta"], orders={"c": 1, "F": 1}, units={"u": "m"},
        outputs={"force": K * u + C * u.diff(T), "acceleration": u.diff(T, 2)},
    )  # fmt: skip
    got = model_from_text(PENDULUM)
    assert got == expected
    assert list(got.parameters) == ["m", "k", "c", "g", "l", "F", "Omega"]


def test_lagrangian_and_energies_are_the_same() -> None:
    energies = 'coordinates = ["x"]\nkinetic = "x\'**2/2"\npotential = "k*x**2/2"\n[parameters]\nk = 2'
    whole = 'coordinates = ["x"]\nlagrangian = "x\'**2/2 - k*x**2/2"\n[parameters]\nk = 2'
    assert model_from_text(energies) == model_from_text(whole)


def test_system_from_toml_and_back_through_data(tmp_path: Path) -> None:
    file = tmp_path / "swing.toml"
    file.write_text(PENDULUM)
    system = st.System.from_toml(str(file))
    assert system == load_model(file) == resolve_model(str(file)) == model_from_text(PENDULUM)
    assert st.System.from_dict(system.to_dict()) == system


def test_first_order_equations_stops_base_and_tables() -> None:
    text = """
    name = "oscillator"
    coordinates = ["x", "z"]
    equations = ["x'' + spring(x) + z = amplitude*Omega**2*cos(Omega*t)", "z' = -z + x'"]
    breaks = [0, "1/2"]
    period = "2*pi/Omega"
    [parameters]
    amplitude = 0.1
    Omega = 2.0
    [base]
    parameter = "amplitude"
    angular_frequency = "Omega"
    [[stops]]
    coordinate = "x"
    position = 0.5
    restitution = 0.8
    [tables.spring]
    x = [-2, -1, 0, 1, 2, 3]
    y = [-8, -1, 0, 1, 8, 27]
    """
    system = model_from_text(text)
    assert system.states == ("x", "z", "x_dot")
    assert system.base.parameter == "amplitude" and system.stops[0].restitution == 0.8 and len(system.breaks) == 2
    force = next(iter(system.rhs[-1].atoms(sp.Function) - system.rhs[-1].atoms(sp.cos)))
    assert float(force.table.evaluate(1.5)) == pytest.approx(1.5**3, rel=1e-13)  # a cubic lies in the quintic spline's space


def test_template_takes_the_name_and_stays_valid() -> None:
    for name in ("swing", "my-model 2", 'a"b\\c', "", "\n[model]"):
        assert model_from_text(template(name)).n == 2


# ---------------------------------------------------------------------------------------------------------- mistakes


def _model(**changes: str) -> str:
    parts = {
        "top": "",
        "coordinates": 'coordinates = ["x"]',
        "equations": "equations = [\"x'' + k*x = F*cos(Omega*t)\"]",
        "more": "",
        "parameters": "[parameters]\nk = 1.0\nF = 0.1\nOmega = 2.0",
        "end": "",
    }
    parts.update(changes)
    return "\n".join(parts.values())


MISTAKES = [
    ({"equations": "equations = [\"x'' + kk*x = 0\"]"}, ExpressionError, "m.toml, equations, number 1: no name 'kk'; this", 6),
    ({"equations": "equations = [\"x'' + 2k*x = 0\"]"}, ExpressionError, "an operator is missing between 2 and k; write 2[*]k", 7),
    ({"equations": "equations = [\"x'' + k*x\"]"}, ExpressionError, "an equation needs a '=' and its right side", 9),
    ({"equations": "equations = [\"x'' + k*x^3 = 0\"]"}, ExpressionError, "write [*][*] for powers", 9),
    ({"end": '[outputs]\ne = "x\'**2 + y"'}, ExpressionError, "m.toml, outputs.e: no name 'y'", 8),
    ({"more": 'period = "2*pi/omega"'}, ExpressionError, "m.toml, period: no name 'omega'; .*did you mean 'Omega'", 5),
    ({"more": 'period = "2*pi/x"'}, ExpressionError, "m.toml, period: no name 'x'", 5),
    ({"equations": "kinetic = \"x''**2/2\""}, ExpressionError, "m.toml, kinetic: no name 'x'''", 0),
    ({"more": "perod = 1"}, UnknownNameError, "no key 'perod'; the top of the file in m.toml has .*did you mean 'period'", None),
    ({"end": "[model]\nnmae = 'x'"}, UnknownNameError, r"no key 'nmae'; \[model\] in m.toml has .*did you mean 'name'", None),
    ({"end": "[output]\ne = 'x'"}, UnknownNameError, "no key 'output'; .*did you mean 'outputs'", None),
    ({"end": "[model]\ncoordinates = ['x']"}, FileFormatError, r"coordinates: stands at the top of the file and again in \[model\]", None),
    ({"equations": ""}, FileFormatError, r"m.toml, \[model\] equations: is missing", None),
    ({"coordinates": ""}, FileFormatError, "m.toml, coordinates: needs 1 to", None),
    ({"coordinates": "coordinates = 'x'"}, FileFormatError, "m.toml, coordinates: must be a list", None),
    ({"coordinates": "coordinates = ['x.y']"}, FileFormatError, "m.toml, coordinates: 'x.y' is no name", None),
    ({"coordinates": "coordinates = ['x', 'x']"}, EquationError, "the name 'x' stands for two things", None),
    ({"coordinates": "coordinates = ['x', 'x_dot']"}, EquationError, "the name 'x_dot' stands for two things", None),
    ({"coordinates": "coordinates = ['x', 'y']"}, EquationError, "m.toml: 1 equation", None),
    ({"coordinates": "coordinates = [1]"}, FileFormatError, "coordinates: 1 is no name", None),
    ({"equations": 'kinetic = "x_dot**2/2"\nlagrangian = "x"'}, FileFormatError, "lagrangian: and kinetic, potential exclude", None),
    ({"more": 'kinetic = "x_dot**2/2"'}, FileFormatError, "equations: and kinetic exclude each other", None),
    ({"end": '[forces]\nx = "F"'}, FileFormatError, r"equations: and \[forces\] exclude each other", None),
    ({"equations": "kinetic = \"x'**2/2\"", "end": '[forces]\ny = "F"'}, UnknownNameError, "no coordinate 'y'; the model has x", None),
    ({"equations": 'equations = "x"'}, FileFormatError, "equations: must be a list", None),
    ({"equations": "equations = [1]"}, FileFormatError, "equations, number 1: must be text in quotes, not 1", None),
    ({"parameters": "[parameters]\nk = 'one'"}, FileFormatError, "parameters.k: must be a number, not 'one'", None),
    ({"parameters": "[parameters]\nk = true"}, FileFormatError, "parameters.k: must be a number, not True", None),
    ({"parameters": "[parameters]\nk = inf"}, FileFormatError, "parameters.k: must be a finite number", None),
    ({"parameters": "[parameters]\nk = nan"}, FileFormatError, "parameters.k: must be a finite number", None),
    ({"parameters": "[parameters]\nk = " + "9" * 400}, FileFormatError, "parameters.k: must be a finite number", None),
    ({"parameters": "[parameters]\nk = { unit = 'N' }"}, FileFormatError, "parameters.k: needs a value", None),
    ({"parameters": "[parameters]\nk = { value = 1, unti = 'N' }"}, UnknownNameError, "no key 'unti'.*did you mean 'unit'", None),
    ({"parameters": "[parameters]\nk = { value = 1, bounds = [0] }"}, FileFormatError, "parameters.k.bounds: must be", None),
    ({"parameters": "[parameters]\nk = { value = 1, unit = 2 }"}, FileFormatError, "parameters.k.unit: must be text", None),
    ({"parameters": "[parameters]\nk = { value = 1, bounds = [2, 3] }\nF = 1\nOmega = 1"}, InputError, "outside its bounds", None),
    ({"parameters": "[parameters]\nk__a = 1"}, FileFormatError, "parameters.k__a: 'k__a' is no name", None),
    ({"parameters": "[parameters]\n'__import__(\"os\")' = 1"}, FileFormatError, "is no name", None),
    ({"parameters": "[parameters]\nt = 1"}, EquationError, "the name 't' stands for two things", None),
    ({"parameters": "[parameters]\nx = 1"}, EquationError, "the name 'x' stands for two things", None),
    ({"parameters": "parameters = 1"}, FileFormatError, r"parameters: must be a table \[parameters\]", None),
    ({"more": "angles = ['y']"}, UnknownNameError, "m.toml, angles: no coordinate 'y'", None),
    ({"end": "[units]\ny = 'm'"}, UnknownNameError, r"m.toml, \[units\]: no name 'y'", None),
    ({"end": "[orders]\nk = 1.5"}, FileFormatError, "orders.k: must be a whole number", None),
    ({"end": "[orders]\nkk = 1"}, UnknownNameError, "no name 'kk'", None),
    ({"end": "[base]\nparameter = 'A'\nangular_frequency = 'Omega'"}, UnknownNameError, "base.parameter: no parameter 'A'", None),
    ({"end": "[base]\nparameter = 'F'\nangular_frequency = 'Omega'"}, InputError, "m.toml, base: a base motion", None),
    ({"end": "[base]\nparameter = 'F'"}, FileFormatError, "base: needs parameter and angular_frequency", None),
    ({"end": "[[stops]]\nposition = 1"}, FileFormatError, "stops, number 1: needs coordinate", None),
    ({"end": "[[stops]]\ncoordinate = 'y'\nposition = 1"}, UnknownNameError, "no coordinate 'y'", None),
    ({"end": "[tables.s]\nx = [1, 2]"}, InputError, "m.toml, tables.s: ", None),
    ({"top": "x = ["}, FileFormatError, "m.toml: not TOML: .*line", None),
    ({"top": "name = 1"}, FileFormatError, "m.toml, name: must be text in quotes, not 1", None),
    ({"top": "coordinates = ['y']"}, FileFormatError, "not TOML: .*", None),
    ({"more": "breaks = ['x']"}, ExpressionError, "m.toml, breaks: no name 'x'", 0),
    ({"equations": "equations = [\"x''**2 = 1\"]"}, EquationError, "m.toml: ", None),
    ({"equations": "equations = [\"k*x = 1\"]"}, EquationError, "m.toml: ", None),
    ({"equations": "equations = [\"x'' + x = t\"]"}, EquationError, "m.toml: .*period", None),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "error", "words", "column"), MISTAKES, ids=range(len(MISTAKES)))
def test_mistake_names_file_key_and_column(changes: dict, error: type, words: str, column: int | None) -> None:
    with pytest.raises(error, match=words) as caught:
        model_from_text(_model(**changes), where="m.toml")
    assert "m.toml" in str(caught.value)
    if column is not None:
        assert caught.value.column == column
        assert str(caught.value).endswith("\n    " + " " * column + "^")


def test_hostile_files_are_refused(tmp_path: Path) -> None:
    cases = {
        "large.toml": b"#" * (MAX_BYTES + 1),
        "latin.toml": b'name = "\xe9"',
        "nul.toml": b"name = \x00",
        "deep.toml": b"a = " + b"[" * 100_000,
        "deep_tables.toml": b"a = " + b"{a=" * 5000,
        "keys.toml": b".".join([b"a"] * 5000) + b" = 1",
        "pickle.toml": b"\x80\x04\x95",
        "number.toml": b"name = " + b"9" * 10_000,
        "empty.toml": b"",
        "python.toml": b"import os\nos.system('echo')",
        "code.toml": b"coordinates = ['x']\nequations = [\"x'' = __import__('os').system('echo')\"]",
        "walk.toml": b"coordinates = ['x']\nequations = [\"x'' = x.__class__\"]",
        "tower.toml": b"coordinates = ['x']\nequations = [\"x'' = -x*9**9**9**9\"]",
    }
    for name, content in cases.items():
        file = tmp_path / name
        file.write_bytes(content)
        with pytest.raises(StabilityError) as caught:
            load_model(file)
        assert name in str(caught.value)
    with pytest.raises(InputError, match="cannot be read"):
        load_model(tmp_path / "absent.toml")
    with pytest.raises(InputError, match="cannot be read"):
        load_model(tmp_path)


@given(hst.integers(0, len(PENDULUM) - 1), hst.one_of(hst.characters(max_codepoint=0x2FF), hst.sampled_from(["", '"', "'", "[", "=", "\n"])))
@settings(max_examples=150, deadline=None)
def test_one_changed_character_gives_a_system_or_a_typed_error(place: int, character: str) -> None:
    try:
        system = model_from_text(PENDULUM[:place] + character + PENDULUM[place + 1 :])
    except StabilityError:
        return
    assert system.n >= 2


# -------------------------------------------------------------------------------------------------- file.py:function

_CODE = '''
import sympy as sp
import stability as st

def swing():
    t, k = sp.symbols("t k")
    x = sp.Function("x")(t)
    return st.System.from_equations([sp.Eq(x.diff(t, 2) + k*x, 0)], [x], parameters={"k": 4.0})

def rhs(t, x, *, delta=0.1):
    return x[1], -delta*x[1] - x[0]

rhs.states = "q v"
built = swing()

def bare(t, x):
    return x

def needs(a):
    return a

def three():
    return 3
'''


@pytest.fixture
def code(tmp_path: Path) -> str:
    file = tmp_path / "json.py"  # named like a module of the standard library, which it must not hide
    file.write_text(_CODE)
    return str(file)


def test_function_of_a_file_gives_the_system(code: str) -> None:
    import json

    swing = resolve_model(f"{code}:swing")
    assert swing.states == ("x", "x_dot") and resolve_model(f"{code}:built") == swing
    rhs = resolve_model(f"{code}:rhs")
    assert rhs.states == ("q", "v") and dict(rhs.parameters) == {"delta": 0.1}
    assert "json" in sys.modules and sys.modules["json"] is json


@pytest.mark.parametrize(
    ("spec", "error", "words"),
    [
        ("{}:swnig", UnknownNameError, "no function 'swnig'; json.py has swing.*did you mean 'swing'"),
        ("{}:bare", InputError, "without names of its states"),
        ("{}:needs", InputError, "must take no arguments"),
        ("{}:three", InputError, "gave int; a System is needed"),
        ("{}:sp", InputError, "neither a function nor a System"),
        ("{}", InputError, "name the function too"),
        ("absent.py:f", InputError, "there is no file"),
        ("mathieu", InputError, "is no model"),
        ("", InputError, "is no model"),
    ],
)
def test_bad_python_sources(code: str, spec: str, error: type, words: str) -> None:
    with pytest.raises(error, match=words):
        resolve_model(spec.format(code))


def test_catalogue_is_asked_for_plain_names() -> None:
    system = model_from_text(TEMPLATE)
    assert resolve_model("duffing", {"duffing": system}.__getitem__) is system


def test_broken_python_file(tmp_path: Path) -> None:
    file = tmp_path / "broken.py"
    file.write_text("def f(:\n")
    with pytest.raises(InputError, match=r"broken.py, line 1 cannot be run: SyntaxError"):
        resolve_model(f"{file}:f")


def test_reading_text_needs_neither_scipy_nor_numba() -> None:
    script = (
        "import sys; from stability.systems.textfile import TEMPLATE, model_from_text; model_from_text(TEMPLATE)\n"
        "print([m for m in ('scipy', 'numba', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
