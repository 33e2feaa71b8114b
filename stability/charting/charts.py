"""`chart`: stability of a periodic system over two of its parameters.

    y' = A(t, p) y,  A(t + T) = A(t),  growth = log(max |mu|) / T over (x, y) in p,  mu: eigenvalues of M = Y(T)

M is analytic in the parameters, so it is not integrated at every point of the grid: a few hundred Chebyshev nodes
carry it (`tensors`), the grid is two matrix products and a closed form (`painting`). Even scalar equations use half a
period and give tr M -+ 2 as products, accurate at the limits of stability; the damping of one degree of freedom is
exact algebra; n degrees of freedom use the characteristic polynomial or the matrix itself.

Reference: W. Magnus, S. Winkler, Hill's equation (1966); L. N. Trefethen, Approximation theory and approximation
practice (2013).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, check_names
from ..floquet.linearisation import linearise
from ..floquet.structure import blocks, structure
from ..results.categories import KINDS, VERDICTS, Categories
from ..results.chart import StabilityChart
from ..results.tiles import Layer
from .boundaries import Tracer
from .painting import Picture, combine, paint, worst_error
from .refining import refine
from .sampling import Sampler
from .tensors import build_tiles
from .windows import axis, grid_shape, sampled_window

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["chart"]

Array = NDArray[np.float64]


def chart(
    system: System,
    x: tuple[str, float, float],
    y: tuple[str, float, float],
    *,
    shape: tuple[int, int] | int = (400, 400),
    about: Any = None,
    tolerance: float = 1e-10,
    **params: float,
) -> StabilityChart:
    """Stability chart of a periodically forced or parametrically excited system over two parameters.

    Solves y' = A(t, p) y, A = df/dx along a solution of period T, and reports the growth rate log(max|mu|)/T.

    Parameters
    ----------
    system : System
        With a forcing period; any number of states, jumps in time declared as breaks.
    x, y : (name, lo, hi)
        Two different parameters and their intervals, lo < hi; any parameter will do, the frequency and the damping
        too. x varies along the columns of the result, y along its rows.
    shape : (nx, ny) or one number for both
        Grid points, both ends included.
    about : None, equilibrium, periodic orbit, function of the parameters, or "linear"
        The solution whose stability is asked for; None is x = 0. See `linearise`.
    tolerance : float, 1e-13 to 1e-2
        Wanted absolute error of the growth rate; at least 2e-12 / T is used.
    **params : float
        Other parameters, by name; missing ones keep the system's defaults.

    Returns
    -------
    StabilityChart
        ``.growth_rate (ny, nx)``, ``.verdict``, ``.kind``, ``.error``, ``.boundaries``, ``.tips``, ``.at()``,
        ``.plot()``, ``.save()``.

    Raises
    ------
    UnknownNameError, InputError, ResourceLimitError
        Unknown or equal parameters, lo >= hi, values outside declared bounds, a shape below 2 or beyond memory, a
        period that is not positive, an autonomous system, or `about` that is not a solution: before any work.
    NonFiniteError
        The equations are not finite somewhere in the window.

    *Accuracy*: `error` estimates truncation, time steps and rounding; checked at 1000 random points against 30-digit
    values (Mathieu, damped), closed forms (Meissner), eigenvalues and DOP853 (several degrees of freedom). It can
    exceed the tolerance at points so close to an edge that the square root in the multipliers magnifies rounding.

    Examples
    --------
    >>> import stability as st
    >>> tongues = st.chart(st.models.mathieu(delta=0.05), x=("a", -0.5, 2.5), y=("b", 0, 2), shape=(60, 40))
    >>> tongues.growth_rate.shape, bool((tongues.verdict == st.Verdict.UNSTABLE)[-1, 30])
    ((40, 60), True)
    """
    x_name, x_lo, x_hi = axis("x", x, system)
    y_name, y_lo, y_hi = axis("y", y, system)
    if x_name == y_name:
        raise InputError(f"x and y are both '{x_name}'; a chart needs two different parameters")
    check_names("parameter", params, system.parameters)
    taken = [n for n in params if n in (x_name, y_name)]
    if taken:
        raise InputError(f"'{taken[0]}' is an axis of the chart; it cannot also be given a value")
    nx, ny = grid_shape(shape)
    if not (isinstance(tolerance, int | float) and 1e-13 <= tolerance <= 1e-2):
        raise InputError(f"tolerance = {tolerance!r}; the allowed range is 1e-13 to 1e-2")
    low = system.parameter_vector(**params, **{x_name: x_lo, y_name: y_lo})
    high = system.parameter_vector(**params, **{x_name: x_hi, y_name: y_hi})
    linear = linearise(system, about)
    names = list(system.parameters)
    corners = np.array([low, high])
    window = sampled_window(linear, low, (names.index(x_name), names.index(y_name)), (x_lo, x_hi, y_lo, y_hi))
    grid_x, grid_y = np.linspace(x_lo, x_hi, nx), np.linspace(y_lo, y_hi, ny)
    # rounding forbids a growth rate better than some digits of 1/T, whatever the unit of time
    tolerance = max(tolerance, 2e-12 / float(linear.period(corners).min()))
    samplers, layers = [], []
    picture: Picture | None = None
    error = 0.0
    for rows in blocks(linear, corners):
        part = linear.block(rows)
        sampler = Sampler(part, low, names.index(x_name), names.index(y_name), structure(part, corners), window)
        layer = _layer(sampler, tolerance)
        painted = paint(layer.tiles, layer.form, layer.neutral, grid_x, grid_y, tolerance)
        error = max(error, refine(sampler, painted, layer.neutral, grid_x, grid_y))
        picture = painted if picture is None else combine(picture, painted)
        samplers.append(sampler)
        layers.append(layer)
    assert picture is not None
    fixed = {k: v for k, v in zip(names, low.tolist(), strict=True) if k not in (x_name, y_name)}
    return StabilityChart(
        x_name, y_name, grid_x, grid_y, picture.growth,
        Categories(picture.verdict, VERDICTS), Categories(picture.kind, KINDS), error,
        fixed, system.name, tuple(layers), Tracer(tuple(samplers)),
    )  # fmt: skip


def _layer(sampler: Sampler, tolerance: float) -> Layer:
    """Tiles of one block over the window."""
    form, n, found = sampler.form, sampler.linear.n, sampler.structure
    tiles = build_tiles(sampler, sampler.window, tolerance, lambda tile: worst_error(tile, form, tolerance))
    neutral = found.trace_free and (n == 2 or sampler.is_reciprocal)
    return Layer(form, n, neutral, tiles)
