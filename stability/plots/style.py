"""How figures look: colours, lines, markers and symbols, in one place.

Colours are those of Okabe and Ito (2008), told apart with any of the usual colour vision deficiencies; what matters is
never said by colour alone, so that a grey print says it too:

    stable solid, unstable dashed, undetermined dotted, neutral dash-dotted      (the line's style)
    one marker and one fill per kind of special point                            (the marker's shape)
    growth rate: pale yellow to dark blue, darker is faster; stable parts white   (the surface's lightness)
    a boundary at multiplier +1 solid, at -1 dashed, of a complex pair dotted    (the boundary's style)

Nothing here touches matplotlib's global state: the values are passed to the artists.

Reference: M. Okabe and K. Ito, Color Universal Design, 2008; lightness order checked in tests/plots/test_style.py.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from ..words import Crossing, Kind, Verdict

__all__ = [
    "ABOVE",
    "BOUNDARIES",
    "COLOURS",
    "GROWTH_MAP",
    "LINES",
    "MARKERS",
    "SERIES",
    "VERDICT_FILLS",
    "axis_label",
    "boundary_line",
    "line",
    "marker",
    "symbol",
]

COLOURS: Mapping[str, str] = MappingProxyType({
    "black": "#000000",
    "blue": "#0072B2",
    "vermilion": "#D55E00",
    "green": "#009E73",
    "sky": "#56B4E9",
    "orange": "#E69F00",
    "purple": "#CC79A7",
    "grey": "#7F7F7F",
})  # fmt: skip

# branches and methods in one picture, in this order: neighbours differ in lightness as well as in hue
_ORDER = ("black", "orange", "blue", "purple", "vermilion", "sky", "green", "grey")
SERIES: tuple[str, ...] = tuple(COLOURS[name] for name in _ORDER)

LINES: Mapping[Verdict, str | tuple[float, tuple[float, ...]]] = MappingProxyType({
    Verdict.STABLE: "solid",
    Verdict.UNSTABLE: (0.0, (4.0, 2.0)),
    Verdict.UNDETERMINED: (0.0, (1.0, 1.5)),
    Verdict.NEUTRAL: (0.0, (6.0, 1.5, 1.0, 1.5)),
})  # fmt: skip

# areas of a class chart: light where stable, so that boundaries and labels stay readable in print
VERDICT_FILLS: Mapping[Verdict, str] = MappingProxyType({
    Verdict.STABLE: "#FFFFFF",
    Verdict.NEUTRAL: "#EAF2F8",
    Verdict.UNDETERMINED: "#BDBDBD",
    Verdict.UNSTABLE: COLOURS["sky"],
})  # fmt: skip

GROWTH_MAP = "YlGnBu"

# one marker per kind; filled where the point is of codimension one, open where of codimension two
MARKERS: Mapping[Kind, str] = MappingProxyType({
    Kind.FOLD: "o",
    Kind.BRANCH_POINT: "D",
    Kind.HOPF: "s",
    Kind.PERIOD_DOUBLING: "^",
    Kind.NEIMARK_SACKER: "*",
    Kind.GRAZING: "v",
    Kind.USER: "|",
    Kind.UNEXPLAINED: "x",
    Kind.CUSP: "<",
    Kind.BOGDANOV_TAKENS: ">",
    Kind.GENERALIZED_HOPF: "p",
    Kind.ZERO_HOPF: "h",
    Kind.DOUBLE_HOPF: "H",
    Kind.R1: "1",
    Kind.R2: "2",
    Kind.R3: "3",
    Kind.R4: "4",
    Kind.FOLD_FLIP: "d",
    Kind.GENERALIZED_PERIOD_DOUBLING: "P",
    Kind.CHENCINER: "8",
    Kind.EXTREMUM: "_",
    Kind.ISOLA_CENTRE: r"$\odot$",
    Kind.ISOLA_MERGER: "X",
})  # fmt: skip
_UNFILLED = frozenset("|_x1234")
_CODIMENSION_ONE = frozenset({
    Kind.FOLD, Kind.BRANCH_POINT, Kind.HOPF, Kind.PERIOD_DOUBLING, Kind.NEIMARK_SACKER, Kind.GRAZING,
})  # fmt: skip

# how a multiplier crosses the unit circle on a tongue's boundary
BOUNDARIES: Mapping[Crossing, tuple[str, Any]] = MappingProxyType({
    Crossing.PLUS_ONE: (COLOURS["black"], "solid"),
    Crossing.MINUS_ONE: (COLOURS["vermilion"], (0.0, (5.0, 1.5))),
    Crossing.PAIR: (COLOURS["blue"], (0.0, (1.5, 1.2))),
})  # fmt: skip

# a legend above the axes, at the right: it never covers data
ABOVE: Mapping[str, Any] = MappingProxyType({
    "loc": "lower right",
    "bbox_to_anchor": (1.0, 1.0),
    "ncols": 3,
    "fontsize": "small",
    "frameon": False,
    "borderaxespad": 0.2,
    "handlelength": 2.6,
    "columnspacing": 1.4,
})  # fmt: skip

_GREEK = frozenset({
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda", "mu", "nu", "xi", "rho",
    "sigma", "tau", "phi", "chi", "psi", "omega",
    "Gamma", "Delta", "Theta", "Lambda", "Xi", "Sigma", "Phi", "Psi", "Omega",
})  # fmt: skip
_NAMED: Mapping[str, str] = MappingProxyType({
    "mass_ratio_21": r"$m_2/m_1$",
    "mass_ratio_total": r"$m_2/(m_1+m_2)$",
    "length_ratio": r"$l/A$",
    "frequency": r"$f$",
    "amplitude": r"$A$",
    "acceleration": r"$A\omega^2$",
    "growth_rate": "growth rate",
})  # fmt: skip
_NUMBERED = re.compile(r"([A-Za-z]+?)_?(\d+)")


def symbol(name: str) -> str:
    r"""Mathtext of a parameter, a state or a column: what stands on an axis.

    Parameters
    ----------
    name : str
        As in the program: ``Omega``, ``xi1``, ``mass_ratio_21``, ``theta_dot``, ``u.max``.

    Returns
    -------
    str
        Mathtext where the name is a known symbol, else the name with blanks for underscores.

    Examples
    --------
    >>> symbol("Omega"), symbol("xi1"), symbol("mass_ratio_21"), symbol("theta_dot")
    ('$\\Omega$', '$\\xi_{1}$', '$m_2/m_1$', '$\\dot{\\theta}$')
    >>> symbol("u.max"), symbol("rod length")
    ('max $u$', 'rod length')
    """
    if name in _NAMED:
        return _NAMED[name]
    state, dot, measure = name.partition(".")
    if dot and measure:
        return f"{measure.replace('_', ' ')} {symbol(state)}"
    inner = _letters(name)
    return f"${inner}$" if inner else name.replace("_", " ")


def _letters(name: str) -> str | None:
    if name.endswith("_dot"):
        base = _letters(name[:-4])
        return rf"\dot{{{base}}}" if base else None
    numbered = _NUMBERED.fullmatch(name)
    if numbered:
        base = _letters(numbered[1])
        return f"{base}_{{{numbered[2]}}}" if base else None
    if name in _GREEK:
        return f"\\{name}"
    if len(name) == 1 and name.isalpha():
        return name
    stem, bar, suffix = name.partition("_")
    if bar and len(suffix) <= 4 and suffix.isalnum():
        base = _letters(stem)
        return rf"{base}_{{\mathrm{{{suffix}}}}}" if base else None
    return None


def axis_label(name: str, unit: str = "") -> str:
    r"""Label of an axis: the symbol, with its unit where it has one (also where the symbol needs its name beside it).

    Examples
    --------
    >>> axis_label("Omega"), axis_label("frequency", "Hz"), axis_label("u.max", "mm")
    ('$\\Omega$', 'frequency $f$ (Hz)', 'max $u$ (mm)')
    """
    text = symbol(name)
    if name in ("frequency", "amplitude", "acceleration"):
        text = f"{name} {text}"
    return f"{text} ({unit})" if unit and unit != "1" else text


def line(verdict: Verdict) -> dict[str, Any]:
    """Keywords of a branch's line: solid where stable, dashed where unstable, dotted where undetermined.

    Examples
    --------
    >>> line(Verdict.STABLE)["linestyle"], line(Verdict.UNSTABLE)["linewidth"]
    ('solid', 1.2)
    """
    return {"linestyle": LINES[verdict], "linewidth": 1.8 if verdict is Verdict.STABLE else 1.2}


def boundary_line(crossing: str) -> dict[str, Any]:
    """Keywords of a tongue's boundary curve: by how the multiplier leaves the unit circle (grey if unknown).

    Examples
    --------
    >>> boundary_line("-1")["color"] == COLOURS["vermilion"]
    True
    """
    known = crossing in tuple(Crossing)
    colour, style = BOUNDARIES[Crossing(crossing)] if known else (COLOURS["grey"], "solid")
    return {"color": colour, "linestyle": style, "linewidth": 1.3}


def marker(kind: Kind, colour: str = "#000000") -> dict[str, Any]:
    """Keywords of a special point's marker: the shape says the kind, the fill the codimension.

    Examples
    --------
    >>> marker(Kind.FOLD)["marker"], marker(Kind.CUSP)["markerfacecolor"]
    ('o', 'white')
    """
    shape = MARKERS[kind]
    filled = kind in _CODIMENSION_ONE or shape in _UNFILLED
    return {
        "marker": shape,
        "markersize": 9.0 if shape == "*" else 6.0,
        "markerfacecolor": colour if filled else "white",
        "markeredgecolor": colour,
        "markeredgewidth": 1.2 if shape in _UNFILLED else 0.8,
        "linestyle": "none",
    }
