"""Periodic orbits as piecewise polynomials: extrema, harmonics and interpolation of known functions."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import stability as st
from stability.errors import InputError, UnknownNameError
from stability.results.storage import read, write

T = 2.5


def wave(t: np.ndarray) -> np.ndarray:
    s = 2 * np.pi * t / T
    return np.array([1.5 + 2 * np.cos(s - 0.3) + 0.25 * np.sin(3 * s), np.exp(np.sin(s))])


@pytest.fixture(scope="module")
def orbit() -> st.PeriodicOrbit:
    return st.PeriodicOrbit.from_function(("u", "v"), wave, T, {"a": 1.0}, pieces=16, degree=12)


def test_values_and_slopes_everywhere(orbit: st.PeriodicOrbit) -> None:
    t = np.linspace(-3, 7, 101)
    np.testing.assert_allclose(orbit(t), wave(t), atol=1e-11)
    assert orbit(0.4).shape == (2,)
    slope = (wave(t + 1e-6) - wave(t - 1e-6)) / 2e-6
    np.testing.assert_allclose(orbit.derivative(t), slope, atol=1e-6)


def test_extrema_are_those_of_the_function_not_of_points(orbit: st.PeriodicOrbit) -> None:
    assert orbit.max["v"] == pytest.approx(np.e, abs=1e-12) and orbit.min["v"] == pytest.approx(1 / np.e, abs=1e-12)
    fine = wave(np.linspace(0, T, 2_000_001))
    assert orbit.max["u"] == pytest.approx(fine[0].max(), abs=1e-10)
    assert orbit.max["u"] >= fine[0].max() - 1e-13


def test_harmonics(orbit: st.PeriodicOrbit) -> None:
    """Amplitudes 1.5, 2, 0, 1/4 by construction; those of exp(sin s) are 2 I_k(1)."""
    assert [orbit.amplitude(k)["u"] for k in range(4)] == pytest.approx([1.5, 2, 0, 0.25], abs=1e-12)
    assert orbit.amplitude(1)["v"] == pytest.approx(2 * 0.5651591039924851, abs=1e-12)
    with pytest.raises(InputError):
        orbit.amplitude(-1)


def test_winding_angles_go_on() -> None:
    orbit = st.PeriodicOrbit.from_function(
        ("theta",), lambda t: (2 * np.pi * t / T + 0.1 * np.sin(2 * np.pi * t / T))[None], T, winding=[2 * np.pi]
    )
    assert orbit(3 * T)[0] - orbit(0.0)[0] == pytest.approx(6 * np.pi)
    assert orbit(T)[0] == pytest.approx(2 * np.pi)
    assert orbit.amplitude(1)["theta"] == pytest.approx(0.1)


def test_exponents_and_read_only(orbit: st.PeriodicOrbit) -> None:
    stable = st.PeriodicOrbit(orbit.states, orbit.edges, orbit.coefficients, {}, multipliers=[np.exp(-T), -0.5])
    np.testing.assert_allclose(stable.exponents.real, [-1, np.log(0.5) / T])
    with pytest.raises(ValueError, match="read-only"):
        orbit.x[0] = 1


def test_shapes_are_checked(orbit: st.PeriodicOrbit) -> None:
    with pytest.raises(InputError, match="do not fit"):
        st.PeriodicOrbit(("u",), orbit.edges, orbit.coefficients, {})


def test_fixed_points_by_name() -> None:
    point = st.FixedPoint(("x", "y"), [1.0, 2.0], {"a": 0.5}, [-1.0, -2.0], st.Verdict.STABLE)
    assert point["y"] == 2.0 and point.max["x"] == 1.0
    with pytest.raises(UnknownNameError, match="did you mean"):
        point["Y"]


def test_storage_round_trip(orbit: st.PeriodicOrbit, tmp_path: Path) -> None:
    header, arrays = orbit.to_storage()
    write(tmp_path / "orbit.npz", "periodic-orbit", header, arrays)
    assert read(tmp_path / "orbit.npz")[0] == "periodic-orbit"
    again = st.load(tmp_path / "orbit.npz")
    np.testing.assert_array_equal(again.x, orbit.x)
    assert again.params == orbit.params and again.verdict is orbit.verdict
    assert [p.name for p in tmp_path.iterdir()] == ["orbit.npz"]


def test_objects_cannot_be_stored(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        write(tmp_path / "x.npz", "note", {}, {"a": np.array([{}], dtype=object)})
    with pytest.raises(InputError):
        write(tmp_path / "x.npz", "note", {"f": print}, {})
    assert list(tmp_path.iterdir()) == []


def test_harmonics_of_a_doubled_orbit_count_in_the_forcing_frequency() -> None:
    """x = 3 cos t + 0.5 cos t/2 + 0.25 sin 3t/2 over two periods of the forcing."""

    def x(t):
        return np.array([3 * np.cos(t) + 0.5 * np.cos(t / 2) + 0.25 * np.sin(1.5 * t)])

    orbit = st.PeriodicOrbit.from_function(("x",), x, 4 * np.pi, multiple=2)
    found = [orbit.amplitude(k)["x"] for k in (0, 0.5, 1, Fraction(3, 2), 2)]
    assert found == pytest.approx([0, 0.5, 3, 0.25, 0], abs=1e-12)
    for wrong in (1 / 3, 0.25, -1, "1/2", float("nan")):
        with pytest.raises(InputError, match="harmonic number"):
            orbit.amplitude(wrong)
    header, arrays = orbit.to_storage()
    assert st.PeriodicOrbit.from_storage(header, arrays).amplitude(0.5)["x"] == pytest.approx(0.5)
