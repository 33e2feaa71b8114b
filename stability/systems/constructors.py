"""The ways to write an oscillator down once: equations, a Lagrangian, a Python function, a text model.

`System` inherits these constructors; the mathematics of each is in its own file (`equations`, `lagrangian`,
`functions`, `textfile`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self, cast

if TYPE_CHECKING:
    from .excitation import BaseMotion

__all__ = ["Constructors"]


class Constructors:
    """The constructors of `System`."""

    @classmethod
    def from_equations(
        cls,
        equations: Mapping[Any, Any] | Sequence[Any],
        coordinates: Sequence[Any],
        *,
        parameters: Mapping[Any, Any] | None = None,
        period: Any = None,
        name: str = "system",
        outputs: Mapping[str, Any] | None = None,
        units: Mapping[str, str] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        breaks: Iterable[Any] = (),
        angles: Iterable[str] = (),
        orders: Mapping[str, int] | None = None,
        base: BaseMotion | None = None,
        stops: Iterable[Any] = (),
        symmetries: Iterable[Any] = (),
        description: str = "",
    ) -> Self:
        """A system from equations of motion of first or second order, solved through their mass matrix.

        Parameters
        ----------
        equations : mapping or sequence
            ``{x.diff(t, 2): expression, ...}``, or a list of ``Eq`` (or of expressions that are zero), as many as
            there are coordinates and linear in the highest derivatives: M(x, t) h = F(x, t) is solved for h.
        coordinates : sequence of sympy functions of time
            ``[x(t), ...]``. A coordinate whose second derivative occurs gets a state ``x_dot``.
        parameters : mapping
            Name (or symbol) -> default value, or -> ``dict(value=..., unit=..., bounds=(lo, hi))``.
        period : expression, optional
            Of the forcing, in the parameters. Found by itself where time occurs only in sines and cosines.
        name, outputs, units, bounds, breaks, angles, orders, base, stops, description
            As in `System`; expressions may use the coordinates and their derivatives.
        symmetries : sequence of Symmetry
            Declared ones, verified now; the usual ones are found without (`System.symmetries`).

        Returns
        -------
        System

        Raises
        ------
        EquationError
            Not square, singular mass matrix, nonlinear in the highest derivative, unknown symbol, or no period.

        Examples
        --------
        >>> import sympy as sp, stability as st
        >>> t, k = sp.symbols("t k"); x = sp.Function("x")(t)
        >>> free = st.System.from_equations([sp.Eq(2*x.diff(t, 2) + k*x, 0)], [x], parameters={"k": 8.0})
        >>> free.rhs
        (x_dot, -k*x/2)
        """
        from .equations import system_fields

        common: dict[str, Any] = {
            "name": name, "angles": angles, "orders": orders, "base": base, "stops": stops,
            "description": description, "units": units, "bounds": bounds, "declared_symmetries": symmetries,
        }  # fmt: skip
        return cls(**system_fields(equations, coordinates, parameters, period, outputs, breaks, **common))

    @classmethod
    def from_lagrangian(
        cls,
        lagrangian: Any,
        coordinates: Sequence[Any],
        *,
        dissipation: Any = 0,
        forces: Mapping[Any, Any] | None = None,
        parameters: Mapping[Any, Any] | None = None,
        period: Any = None,
        name: str = "system",
        outputs: Mapping[str, Any] | None = None,
        units: Mapping[str, str] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        breaks: Iterable[Any] = (),
        angles: Iterable[str] = (),
        orders: Mapping[str, int] | None = None,
        base: BaseMotion | None = None,
        stops: Iterable[Any] = (),
        symmetries: Iterable[Any] = (),
        description: str = "",
    ) -> Self:
        """A system from its Lagrangian L = T - U, Rayleigh function R and external forces Q.

            d/dt (dL/dq') - dL/dq + dR/dq' = Q

        The accelerations come out of the mass matrix M = d2L/dq'2: no symbolic solve, no simplification.

        Parameters
        ----------
        lagrangian : sympy expression
            T - U in the coordinates, their first derivatives, time and parameters.
        coordinates : sequence of sympy functions of time
            The generalised coordinates q(t).
        dissipation : sympy expression
            The Rayleigh function R (half the dissipated power for viscous damping).
        forces : mapping
            Coordinate -> external generalised force Q.
        parameters, period, name, outputs, units, bounds, breaks, angles, orders, base, stops, symmetries, description
            As in `from_equations`.

        Returns
        -------
        System

        Raises
        ------
        EquationError
            If the mass matrix is singular, or a symbol has no value.

        Examples
        --------
        >>> import sympy as sp, stability as st
        >>> t, g, l = sp.symbols("t g l"); phi = sp.Function("phi")(t)
        >>> L = l**2*phi.diff(t)**2/2 + g*l*sp.cos(phi)
        >>> st.System.from_lagrangian(L, [phi], parameters=dict(g=9.81, l=0.5)).rhs
        (phi_dot, -g*sin(phi)/l)
        """
        from .lagrangian import equations_of_motion

        equations = equations_of_motion(lagrangian, coordinates, dissipation=dissipation, forces=forces)
        return cls.from_equations(
            equations, coordinates, parameters=parameters, period=period, name=name, outputs=outputs, units=units,
            bounds=bounds, breaks=breaks, angles=angles, orders=orders, base=base, stops=stops,
            symmetries=symmetries, description=description,
        )  # fmt: skip

    @classmethod
    def from_function(
        cls,
        function: Callable[..., Any],
        states: str | Sequence[str],
        *,
        period: Any = None,
        parameters: Mapping[str, float] | None = None,
        name: str | None = None,
        breaks: Iterable[float] = (),
        angles: Iterable[str] = (),
        bounds: Mapping[str, tuple[float, float]] | None = None,
        units: Mapping[str, str] | None = None,
        symmetries: Iterable[Any] = (),
        description: str = "",
    ) -> Self:
        """A system around a numpy-broadcasting Python function ``f(t, x, *, <parameters>)`` -> dx/dt.

        ``x`` has the state axis first, (n,) or (n, N), and ``t`` is a scalar or (N,): write ``np.where`` for ``if``
        and ``np.sin`` for ``math.sin``. The parameters and their defaults are the function's keyword-only arguments;
        each is a number, or (N,) where points of different parameters are evaluated together (derivatives). A function
        that raises for such arrays, as ``if a < 0.5`` does, is called again with numbers, once a set of parameters:
        slower, with equal results. Derivatives come from differences with an error estimate.
        Such a system hashes by the identity of its function, and a result that holds one is view-only after loading.

        Parameters
        ----------
        function : callable
            ``f(t, x, *, a=..., b=...)`` returning an array (n, N) or a sequence of n rows.
        states : str or sequence of str
            State names, ``"x v"``.
        period : number, expression in the parameters, or callable of parameters, optional
            Forcing period; None for an autonomous system.
        parameters : mapping, optional
            Defaults for keyword-only arguments that have none, or to replace those they have.
        name, breaks, angles, bounds, units, description
            As in `System`.
        symmetries : sequence of Symmetry
            Declared ones, verified at random points now: such a system cannot prove those that it has.

        Returns
        -------
        System

        Raises
        ------
        InputError
            If the function's signature does not fit, or a parameter has no value.
        NonFiniteError
            Later, where the function raises something: it names that, and has it as its ``__cause__``.

        Examples
        --------
        >>> import numpy as np, stability as st
        >>> def swing(t, x, *, delta=0.1):
        ...     return x[1], -delta*x[1] - np.sin(x[0])
        >>> st.System.from_function(swing, "phi omega").parameters["delta"]
        0.1
        """
        from .functions import function_fields

        common: dict[str, Any] = {
            "angles": angles, "bounds": bounds, "units": units, "description": description, "breaks": breaks,
            "declared_symmetries": symmetries,
        }  # fmt: skip
        return cls(**function_fields(function, states, period, parameters, name, **common))

    @classmethod
    def from_toml(cls, path: str) -> Self:
        """A system from a text model: coordinates, Lagrangian or equations, forces, parameters, outputs.

        The text is data: it is parsed by a whitelist and can never run code.

        Parameters
        ----------
        path : str
            A TOML file; ``stability new FILE.toml`` writes a commented template.

        Returns
        -------
        System

        Raises
        ------
        ExpressionError
            With the file, the key and a caret under the column.
        """
        from .textfile import load_model

        return cast(Self, load_model(path))
