"""Colours, lines, markers, symbols. Witness: definitions of luminance and contrast (WCAG 2), matplotlib's parser."""

from __future__ import annotations

import itertools

import pytest
from matplotlib import colormaps, colors
from matplotlib.mathtext import MathTextParser

from stability import models
from stability.plots import style
from stability.words import Kind, Verdict


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2: what is left in a grey print."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colors.to_rgb(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def test_neighbouring_series_differ_in_grey() -> None:
    for one, other in itertools.pairwise(style.SERIES):
        assert contrast(one, other) > 1.15, (one, other)


def test_stable_and_unstable_areas_differ_in_grey() -> None:
    assert contrast(style.VERDICT_FILLS[Verdict.STABLE], style.VERDICT_FILLS[Verdict.UNSTABLE]) > 1.8


def test_boundaries_stand_out_from_paper_and_from_unstable_areas() -> None:
    for colour, _ in style.BOUNDARIES.values():
        assert contrast(colour, "#FFFFFF") > 3 and contrast(colour, style.VERDICT_FILLS[Verdict.UNSTABLE]) > 1.5


def test_growth_map_is_monotone_in_grey() -> None:
    values = [luminance(colors.to_hex(colormaps[style.GROWTH_MAP](k / 255))) for k in range(256)]
    assert all(b <= a + 1e-3 for a, b in itertools.pairwise(values)), "darker grows faster"


def test_every_verdict_has_its_own_line() -> None:
    assert set(style.LINES) == set(Verdict) == set(style.VERDICT_FILLS)
    assert len({str(value) for value in style.LINES.values()}) == len(Verdict)
    assert style.LINES[Verdict.STABLE] == "solid"


def test_every_kind_has_its_own_marker() -> None:
    assert set(style.MARKERS) == set(Kind)
    assert len(set(style.MARKERS.values())) == len(Kind)


@pytest.mark.parametrize("kind", Kind)
def test_markers_draw(kind: Kind) -> None:
    from matplotlib.figure import Figure

    (artist,) = Figure().add_subplot().plot([0.0], [0.0], **style.marker(kind, style.SERIES[0]))
    assert artist.get_marker() == style.MARKERS[kind]


def test_symbols_of_all_models_are_mathtext() -> None:
    """Every parameter and state of the catalogue gives a label that matplotlib can set."""
    parser = MathTextParser("path")
    for entry in models.catalogue().values():
        system = entry()
        for name in (*system.parameters, *system.states):
            label = style.axis_label(name, system.units.get(name, ""))
            assert label and parser.parse(label, dpi=72)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Omega", r"$\Omega$"),
        ("Omega0", r"$\Omega_{0}$"),
        ("mass_ratio_21", "$m_2/m_1$"),
        ("theta_dot", r"$\dot{\theta}$"),
        ("k_em", r"$k_{\mathrm{em}}$"),
        ("x1_dot", r"$\dot{x_{1}}$"),
        ("length", "length"),
        ("coil_resistance", "coil resistance"),
    ],
)
def test_symbol(name: str, expected: str) -> None:
    assert style.symbol(name) == expected
