r"""Units of measured columns: text such as mm, mm/s^2, deg, 1/min to a factor and an SI unit.

A unit is a product of powers of symbols with prefixes, separated by / * . or a blank: ``kN/m``, ``mm/s²``, ``V/(m s)``.
Frequencies stay frequencies: Hz, 1/min and rpm become Hz; rad/s stays rad/s, which is another quantity. A ``g`` is the
acceleration of gravity of the models (constants), ``g0`` the standard one, 9.80665 m/s^2; masses are written kg.
"""

from __future__ import annotations

import math
import re

from ..constants import GRAVITY
from ..errors import InputError

__all__ = ["si_unit"]

_PREFIXES = {"p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3,
             "M": 1e6, "G": 1e9}  # fmt: skip
_BASE = ("m", "s", "Hz", "rad", "N", "V", "A", "W", "J", "Pa", "K", "T", "F", "H", "Ohm", "C")
# symbol -> (factor, SI unit); those that take no prefix
_SPECIAL: dict[str, tuple[float, str]] = {
    "": (1.0, "1"), "1": (1.0, "1"), "-": (1.0, "1"), "%": (0.01, "1"),
    "deg": (math.pi / 180, "rad"), "°": (math.pi / 180, "rad"), "degree": (math.pi / 180, "rad"),
    "degrees": (math.pi / 180, "rad"), "rpm": (1 / 60, "Hz"), "min": (60.0, "s"), "h": (3600.0, "s"),
    "g": (GRAVITY, "m/s^2"), "g0": (9.80665, "m/s^2"), "kg": (1.0, "kg"), "in": (0.0254, "m"), "inch": (0.0254, "m"),
    "Ω": (1.0, "Ohm"),
}  # fmt: skip
_WHOLE = {"1/min": (1 / 60, "Hz"), "min^-1": (1 / 60, "Hz"), "1/s": (1.0, "Hz"), "s^-1": (1.0, "Hz"),
          "rad/s": (1.0, "rad/s"), "cycles/s": (1.0, "Hz")}  # fmt: skip
_SUPERSCRIPTS = str.maketrans({"²": "^2", "³": "^3", "⁻": "^-", "¹": "1", "·": "*", "×": "*"})


def si_unit(text: str) -> tuple[float, str]:
    """(factor, SI unit): the value in SI units is factor times the number.

    Raises
    ------
    InputError
        A unit that is not known.

    Examples
    --------
    >>> si_unit("mm"), si_unit("1/min")[1], si_unit("kN/m")
    ((0.001, 'm'), 'Hz', (1000.0, 'N/m'))
    """
    plain = re.sub(r"\s*([*/^])\s*", r"\1", text.strip().translate(_SUPERSCRIPTS)).replace("**", "^")
    if plain in _WHOLE:
        return _WHOLE[plain]
    if plain in _SPECIAL or _symbol(plain) is not None:
        return _known(plain, text)
    factor = 1.0
    over: list[str] = []
    under: list[str] = []
    for k, part in enumerate(re.split("/", plain.replace("(", "").replace(")", ""))):
        for piece in re.split(r"[*\s.]", part):
            if not piece:
                continue
            name, _, power = piece.partition("^")
            exponent = int(power) if re.fullmatch(r"-?\d", power) else 1
            if power and not re.fullmatch(r"-?\d", power):
                raise InputError(f"'{text}' is not a unit that is known: the power '{power}' is no whole number")
            value, unit = _known(name, text)
            sign = -exponent if k else exponent
            factor *= value**sign
            if unit != "1":
                shown = unit if abs(sign) == 1 else f"{unit}^{abs(sign)}"
                (over if sign > 0 else under).append(shown)
    top = " ".join(over) or "1"
    return factor, top if not under else f"{top}/({' '.join(under)})" if len(under) > 1 else f"{top}/{under[0]}"


def _symbol(name: str) -> tuple[float, str] | None:
    if name in _BASE:
        return 1.0, name
    for prefix, factor in _PREFIXES.items():
        if name.startswith(prefix) and name[len(prefix) :] in _BASE:
            return factor, name[len(prefix) :]
    return None


def _known(name: str, whole: str) -> tuple[float, str]:
    found = _SPECIAL.get(name) or _symbol(name)
    if found is None:
        raise InputError(
            f"'{whole}' is not a unit that is known; examples: Hz, 1/min, rad/s, mm, m/s^2, g, deg, N, V, mW, 1"
        )
    return found
