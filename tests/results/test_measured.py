"""Measured responses: text as instruments write it, units by hand, errors with line and column, and over a branch."""

from __future__ import annotations

import numpy as np
import pytest

import stability as st
from stability.errors import FileFormatError, InputError, UnknownNameError
from stability.results.measured_units import si_unit

SEMICOLON = "# shaker 2\n\nFrequency [Hz]; Amplitude [mm]; phase [deg]\n20,0;0,412;-12,5\n20,5;4,7e-1;-15\n# pause\n21;0,55;-20\n"
FORMS = {
    "semicolons, decimal commas": SEMICOLON,
    "commas": "f (Hz),amplitude (mm),phase (°)\n20,0.412,-12.5\n20.5,0.47,-15\n21,.55,-20\n",
    "tabs, units below": "f\tamplitude\tphase\nHz\tmm\tdeg\n20,0\t0,412\t-12,5\n20,5\t0,470\t-15\n21\t0,55\t-20\n",
    "blanks": "freq [1/min]  amplitude [µm]  phase [rad]\n1200 412 -0.2181661564992912\n"
    "1230  470  -0.2617993877991494\n1260  550 -0.3490658503988659\n",
    "names in a comment": "# f [Hz], amplitude [mm], phase [deg]\n20,0.412,-12.5\n20.5,0.47,-15\n21,0.55,-20\n",
    "angular frequency": f"frequency [rad/s];amplitude [m];phase [deg];\n{40 * np.pi};0.000412;-12.5;\n"
    f"{41 * np.pi};0.00047;-15;\n{42 * np.pi};0.00055;-20;\n",
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1"])
def test_forms_of_text_are_one_response(tmp_path, form, encoding):
    path = tmp_path / "m.csv"
    path.write_text(FORMS[form], encoding=encoding)
    found = st.load_response(path)
    assert found.name == "frequency" and found.parameter == pytest.approx([20.0, 20.5, 21.0], rel=1e-14)
    assert found.columns["amplitude"] == pytest.approx([0.412e-3, 0.47e-3, 0.55e-3], rel=1e-14)
    assert found.columns["phase"] == pytest.approx(np.radians([-12.5, -15, -20]), rel=1e-14)
    assert dict(found.units) == {"frequency": "Hz", "amplitude": "m", "phase": "rad"}
    assert found.direction == 1 and found.source == "m.csv" and "3 points" in repr(found)


@pytest.mark.parametrize(("text", "factor", "unit"), [
    ("mm", 1e-3, "m"), ("µm", 1e-6, "m"), ("mm/s^2", 1e-3, "m/s^2"), ("m/s²", 1.0, "m/s^2"), ("g", 9.81, "m/s^2"),
    ("g0", 9.80665, "m/s^2"), ("kN/m", 1e3, "N/m"), ("rpm", 1 / 60, "Hz"), ("kHz", 1e3, "Hz"), ("rad/s", 1.0, "rad/s"), ("mV", 1e-3, "V"),
    ("%", 0.01, "1"), ("", 1.0, "1"), ("deg", np.pi / 180, "rad"), ("MPa", 1e6, "Pa"), ("V/(m s)", 1.0, "V/(m s)"),
    ("ms", 1e-3, "s"), ("min", 60.0, "s"), ("mW", 1e-3, "W"), ("deg/s", np.pi / 180, "rad/s"),
])  # fmt: skip
def test_units(text, factor, unit):
    assert si_unit(text) == (pytest.approx(factor, rel=1e-15), unit)


@pytest.mark.parametrize("text", ["furlong", "m^x", "kkg", "Hz!"])
def test_unknown_units(text):
    with pytest.raises(InputError, match="not a unit"):
        si_unit(text)


@pytest.mark.parametrize(("text", "said"), [
    ("", "empty"),
    ("# nothing\n", "empty"),
    ("1;2\n3;4\n", "line 1: no line of names"),
    ("f [Hz]; amplitude [mm]\n", "no rows"),
    ("f [Hz]; amplitude [mm]\n20; 0.4\n\n21; oops\n", r"line 4, column 2 \('amplitude'\): 'oops' is not a finite number"),
    ("f [Hz]; amplitude [mm]\n20; 0.4\n21; nan\n", r"line 3, column 2 .*'nan'"),
    ("f [Hz]; amplitude [mm]\n20; 1e999\n", "line 2, column 2"),
    ("f [Hz]; amplitude [mm]\n20; 0.4; 3\n", "line 2: 3 columns, but the header names 2"),
    ("f [Hz], amplitude [mm]\n20,0,0,4\n", "decimal commas"),
    ("f [Hz]; amplitude [furlong]\n20; 1\n", r"line 1, column 2 \('amplitude'\): 'furlong' is not a unit"),
    ("f [Hz]; a [mm]; a [mm]\n20; 1; 2\n", "column 3: 'a' is there twice"),
    ("f [Hz]; [mm]\n20; 1\n", "column 2: the column has no name"),
    ("f [Hz]\n20\n21\n", "one column only"),
    ("f [Hz]; a b [mm]; a_b [mm]\n20;20;1\n", "called alike"),
    ("f [Hz]; a [mm]\n20; __import__('os')\n", "is not a finite number"),
])  # fmt: skip
def test_damage_is_named_with_line_and_column(tmp_path, text, said):
    path = tmp_path / "m.csv"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=said):
        st.load_response(path)


def test_other_files(tmp_path):
    with pytest.raises(FileFormatError, match="cannot be read"):
        st.load_response(tmp_path / "none.csv")
    np.savez(tmp_path / "x.npz", a=np.zeros(3))
    with pytest.raises(FileFormatError, match="not a text file"):
        st.load_response(tmp_path / "x.npz")


def test_names(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("base acceleration [g], sensor 1 [mm], sensor 2 [mm]\n0.1,1,2\n0.2,2,3\n")
    plain = st.load_response(path)
    assert plain.name == "base_acceleration" and list(plain.columns) == ["sensor_1", "sensor_2"]
    named = st.load_response(path, names={"base acceleration": "acceleration", "sensor 1": "y.amplitude", "sensor 2": "y.pp"})
    assert named.name == "acceleration" and named.parameter == pytest.approx([0.981, 1.962])
    assert named.values("y.amplitude(1)") == pytest.approx([1e-3, 2e-3])
    assert st.load_response(path, parameter="sensor_1").name == "sensor_1"
    with pytest.raises(UnknownNameError, match="did you mean 'sensor 1'"):
        st.load_response(path, names={"sensor1": "y.max"})
    with pytest.raises(UnknownNameError, match="sensor_2"):
        st.load_response(path, parameter="sensor_3")
    with pytest.raises(UnknownNameError, match=r"quantity 'y\.max'"):
        named.values("y.max")
    with pytest.raises(InputError, match="equal length"):
        st.MeasuredResponse("f", np.zeros(3), {"a": np.zeros(2)})
    with pytest.raises(InputError, match="finite"):
        st.MeasuredResponse("f", np.zeros(1), {"a": np.array([np.nan])})


def test_storage_and_text_come_back(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text(SEMICOLON)
    found = st.load_response(path)
    found.save(tmp_path / "m.npz")
    found.to_csv(tmp_path / "again.csv")
    for again in (st.load(tmp_path / "m.npz"), st.load_response(tmp_path / "again.csv")):
        assert np.array_equal(again.parameter, found.parameter) and again.units == found.units
        assert all(np.array_equal(again.columns[k], found.columns[k]) for k in found.columns)


@pytest.fixture(scope="module")
def linear():
    """(branch, sweep, the exact amplitude) of u'' + 2 xi u' + u = Omega^2 cos Omega t."""
    system = st.models.linear_oscillator(xi=0.1)
    branch = st.continuation(st.Collocation(system), "Omega", (0.5, 1.5))
    sweep = st.sweep(system, "Omega", (0.5, 1.5), step=0.05, periods=60)
    return branch, sweep, lambda W: W**2 / np.hypot(1 - W**2, 0.2 * W)


def test_compare_with_measured_points(linear):
    """Errors are the planted ones, over the largest value; points outside the branch are left out or missing."""
    branch, sweep, exact = linear
    W = np.linspace(0.6, 1.6, 11)
    planted = 0.02 * np.sin(7 * W)
    seen = st.MeasuredResponse("Omega", W, {"amplitude": exact(W) + planted})
    inside = W <= 1.5
    one = st.compare(branch, seen)["measured"]
    assert one.errors == pytest.approx(planted[inside] / exact(W[inside]).max(), abs=1e-9)
    both = st.compare(seen, branch, sweep)
    assert both.reference == "measured" and both.quantity == "u.amplitude(1)"
    scale = np.abs(exact(W) + planted)[inside].max()
    assert both["collocation"].errors == pytest.approx(-planted[inside] / scale, abs=1e-9)
    assert both["sweep up"].errors == pytest.approx(-planted[inside] / scale, abs=0.02)
    assert "measured" in both.table() and both.to_dict()["Omega"].size == 2 * inside.sum()
    axes = both.plot()[0].axes
    assert {"measured", "collocation", "sweep up"} == {t.get_text() for t in axes.get_legend().get_texts()}


def test_what_cannot_be_compared(linear):
    branch, sweep, _ = linear
    seen = st.MeasuredResponse("frequency", np.array([1.0]), {"amplitude": np.array([1.0])})
    with pytest.raises(InputError, match="runs along"):
        st.compare(branch, seen)
    with pytest.raises(InputError, match="rename"):
        st.compare(seen, branch)
    with pytest.raises(UnknownNameError, match="quantity"):
        st.compare(branch, st.MeasuredResponse("Omega", np.array([1.0]), {"phase": np.array([1.0])}))
    with pytest.raises(InputError, match="which quantity"):
        st.compare(seen, sweep)


def test_missing_points_of_a_branch():
    """Where the branch has no stable solution a measured point is missing from it."""
    branch = st.continuation(st.Equilibrium(st.models.lorenz()), "rho", (0.5, 3.0))
    seen = st.MeasuredResponse("rho", np.array([0.7, 2.0]), {"x": np.array([0.0, 0.1])})
    found = st.compare(seen, branch, quantity="x")["equilibria"]
    assert found.parameter.tolist() == [0.7] and [p for p, _, _ in found.missing] == [2.0]


def test_drawn_over_a_branch_on_the_command_line(linear, tmp_path, capsys):
    from stability.cli import main

    branch, _, exact = linear
    W = np.linspace(0.6, 1.4, 9)
    (tmp_path / "m.csv").write_text("Omega [1]; amplitude [1]\n" + "\n".join(f"{w:.6f};{exact(w):.6f}" for w in W))
    branch.save(tmp_path / "b.npz")
    picture = tmp_path / "b.png"
    assert main(["plot", str(tmp_path / "b.npz"), "--data", str(tmp_path / "m.csv"), "-o", str(picture)]) == 0
    assert picture.stat().st_size > 5000 and "MeasuredResponse m.csv" in capsys.readouterr().out
    (tmp_path / "w.csv").write_text("f [Hz]; amplitude [1]\n1;1\n")
    assert main(["plot", str(tmp_path / "b.npz"), "--data", str(tmp_path / "w.csv"), "-o", str(tmp_path / "c.png")]) == 2
    assert "runs along frequency" in capsys.readouterr().err
    assert main(["plot", str(tmp_path / "b.npz"), "--data", str(tmp_path / "b.npz"), "-o", str(tmp_path / "d.png")]) != 0
    assert not (tmp_path / "d.png").exists()


def test_one_acceleration_of_gravity():
    """0.5 g of a measured column, of the command line and of a model's default are the same 4.905 m/s^2."""
    from stability.cli._motions import ACCELERATION

    assert 0.5 * si_unit("g")[0] == ACCELERATION.convert("0.5g", None, None) == 4.905
    assert st.models.duffing.from_physical().parameters["acceleration"] == 4.905
