r"""From a located special point of any problem class to its normal form.

Equilibria give the derivatives of their field, collocation those of its discrete period map; an orbit of another
method (harmonic balance, shooting) is first solved again by collocation on its own period, from which the derivatives
then come. See `normal_forms` for coefficients and words. An orbit that passes a kink of its right-hand side, or an
equilibrium on one, has neither where the coefficient would feel it (`kinks`): derivatives of the field are not all.

*Accuracy*: derivatives are exact for the discrete problem; a coefficient is off by the relative discretisation error of
the orbit. Systems given by Python functions have derivatives by differences: third ones are known to about 1e-4.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import StabilityError
from ..integration.switches import has_switches
from ..words import Kind
from .kinks import SMOOTH, smoothness, smoothness_along
from .normal_forms import FieldForms, NormalForm, normal_form
from .normal_forms_orbits import MapForms

__all__ = ["criticality_of"]

Array = NDArray[np.float64]
_KINDS = (Kind.FOLD, Kind.BRANCH_POINT, Kind.HOPF, Kind.PERIOD_DOUBLING, Kind.NEIMARK_SACKER)
_NONE = NormalForm(None, None)


def criticality_of(problem: Any, kind: Kind, u: Array, params: Array, linearisation: Any = None) -> NormalForm:
    """Coefficient and word at a special point, (None, None) where nothing can be said; never raises for numerics.

    `linearisation`: the problem's there, where it is known already.
    """
    if kind not in _KINDS:
        return _NONE
    try:
        if _smoothness(problem, u, params) < (2 if kind is Kind.FOLD else 3):
            return _NONE
        forms = _forms(problem, u, params, linearisation)
        if forms is None or not np.isfinite(forms.matrix).all():
            return _NONE
        return _of_whole_period(problem, kind, normal_form(kind, forms, problem.critical.circle))
    except (np.linalg.LinAlgError, StabilityError):
        return _NONE


def _smoothness(problem: Any, u: Array, params: Array) -> int:
    """Order of the sharpest kink that the equilibrium or orbit meets (see `kinks`)."""
    kinked = getattr(problem, "kinked", None)  # known once and for all of a collocation problem
    if not (has_switches(problem.system) if kinked is None else kinked):
        return SMOOTH
    if hasattr(problem, "discretise"):
        return smoothness_along(problem.system, problem.view(u, params))
    return smoothness(problem.system, np.zeros(1), np.array(u, float)[None, : problem.system.n], params)


def _of_whole_period(problem: Any, kind: Kind, found: NormalForm) -> NormalForm:
    """From the half-period map N to N^2: x + a x^2 -> x + 2 a x^2, and -x + b x^3 -> x - 2 b x^3, a pitchfork."""
    if found.coefficient is None or not getattr(problem, "halved", False):
        return found
    return found._replace(coefficient=(-2.0 if kind is Kind.PERIOD_DOUBLING else 2.0) * found.coefficient)


def _forms(problem: Any, u: Array, params: Array, L: Any) -> Any:
    from .collocation import Collocation
    from .equilibria import Equilibrium

    if isinstance(problem, Equilibrium):
        return FieldForms(problem.linearise(u, params) if L is None else L)
    if not isinstance(problem, Collocation):
        if not hasattr(problem, "discretise"):
            return None
        orbit = problem.view(u, params)
        multiple = int(getattr(problem, "subharmonic", getattr(problem, "multiple", 1)))
        problem = Collocation(problem.system, multiple=multiple)
        u, L = problem.start(params, orbit), None
    return MapForms(problem.linearise(u, params) if L is None else L)
