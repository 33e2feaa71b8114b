"""The catalogue: every oscillator of the source chapter, and the classics. Loaded on first use.

``stability.models.<name>(...)`` gives a `System`; ``stability.models.catalogue()`` lists all entries.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..errors import UnknownNameError, unknown_name

if TYPE_CHECKING:
    from ._model import Model

# model name -> private module
_MODELS: dict[str, str] = {
    "mathieu": "_hill",
    "mathieu_canonical": "_hill",
    "hill": "_hill",
    "meissner": "_hill",
    "coupled_mathieu": "_hill",
    "paul_trap": "_traps",
    "base_driven_pendulum": "_pendulum",
    "kapitza_pendulum": "_pendulum",
    "variable_length_pendulum": "_pendulum",
    "modulated_string": "_strings",
    "rotating_shaft": "_strings",
    "capacitance_modulated_circuit": "_circuits",
    "inductance_modulated_circuit": "_circuits",
    "resistance_modulated_circuit": "_circuits",
    "linear_oscillator": "_linear",
    "chain": "_chain",
    "duffing": "_duffing",
    "duffing_textbook": "_duffing",
    "duffing_mathieu": "_duffing",
    "autoparametric_pendulum": "_autoparametric",
    "autoparametric_quadratic": "_autoparametric",
    "one_sided_magnet": "_one_sided",
    "unilateral_spring": "_one_sided",
    "spring_oscillator": "_stops",
    "soft_stop_oscillator": "_stops",
    "hard_stop_oscillator": "_stops",
    "harvester": "_harvester",
    "van_der_pol": "_classics",
    "rayleigh": "_classics",
    "lorenz": "_classics",
    "nonlinear_absorber": "_classics",
}

# springs, magnets and other public things that are no models
_OTHERS: dict[str, str] = {
    "BlockMagnet": "_magnets",
    "Coil": "_builder",
    "TRANSLATION_ROTATION": "_analogies",
    "analogue": "_analogies",
    "electrical_to_mechanical": "_analogies",
    "mechanical_to_electrical": "_analogies",
    "DipoleMagnetSpring": "_magnet_one_sided",
    "DiscMagnet": "_magnets",
    "LevitatedMagnetSpring": "_magnet_springs",
    "MagnetPair": "_magnet_pairs",
    "NestedRingSpring": "_magnet_springs",
    "OneSidedMagnetSpring": "_magnet_one_sided",
    "ParallelSprings": "_spring_sums",
    "PiecewiseSpring": "_spring_pieces",
    "PolynomialSpring": "_spring_laws",
    "PowerLawSpring": "_spring_laws",
    "RingMagnet": "_magnets",
    "RotationalMagneticSpring": "_magnet_rotational",
    "Spring": "_springs",
    "TabulatedSpring": "_spring_tables",
    "UnilateralSpring": "_spring_pieces",
}

__all__ = sorted([*_MODELS, *_OTHERS, "catalogue"])


def catalogue() -> dict[str, Model]:
    """All models by name.

    Returns
    -------
    dict of str to Model

    Examples
    --------
    >>> import stability as st
    >>> st.models.catalogue()["mathieu"].source
    'equation (40); catalogue 5'
    """
    return {name: getattr(import_module(f"{__name__}.{module}"), name) for name, module in _MODELS.items()}


def by_name(name: str) -> Model:
    """The model of this name; UnknownNameError with the nearest one otherwise."""
    if name not in _MODELS:
        raise unknown_name("model", name, _MODELS, "the catalogue")
    found: Model = getattr(import_module(f"{__name__}.{_MODELS[name]}"), name)
    return found


def __getattr__(name: str) -> Any:
    module = _MODELS.get(name) or _OTHERS.get(name)
    if module is None:
        if name.startswith("_"):
            raise AttributeError(name)
        raise _NoSuchModel(str(unknown_name("model", name, __all__, "the catalogue")))
    value = getattr(import_module(f"{__name__}.{module}"), name)
    globals()[name] = value
    return value


class _NoSuchModel(UnknownNameError, AttributeError):
    """A misspelt model name: an AttributeError that proposes the nearest one."""


def __dir__() -> list[str]:
    return list(__all__)
