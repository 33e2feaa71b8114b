"""Linear response of any system about its equilibrium: transfer functions, modes, peaks, periodic base motion.

About the equilibrium x_e of the time-averaged equations,

    y' = A y + g(t),      A = df/dx (x_e),      g(t) = Re [ g1(w) e^{i w t} ],      w = 2 pi/T,

an output z = C y + D(t) answers a harmonic excitation with Z = G(i w),

    G(s) = C (s I - A)^-1 g1(s/i) + d1(s/i):

the response per unit of what is in the equations. In the dimensionless models that is the base motion y0 = cos(Omega
tau), so that G = U/Y0 = -s^2/(1 + 2 xi s + s^2) for the linear oscillator (the minus sign is an erratum of (24)); in SI
units it is the response in m at the model's own base amplitude or acceleration. Natural frequencies are |lambda| and
damping ratios -Re(lambda)/|lambda| of the eigenvalues lambda of A. Source: (22)-(25), (36)-(39); catalogue 3, 4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import sympy as sp

from ..errors import EquationError, InputError, unknown_name
from ..systems.equations import TIME, symbol
from ..systems.expressions import differentiate
from .equilibrium import averaged_equilibrium, harmonic_parts

if TYPE_CHECKING:
    from ..systems.system import System

__all__ = ["LinearResponse", "linear_response"]

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
LAPLACE = sp.Symbol("s")


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """The linear behaviour of a system about its equilibrium: what `linear_response` returns.

    Attributes
    ----------
    system : System
        With the parameters that were asked for as defaults.
    equilibrium : dict
        State -> value of the equilibrium of the time-averaged equations (the static position).
    A : (n, n) array
        The linearised equations' matrix.
    """

    system: System
    equilibrium: dict[str, float]
    A: Array
    _matrix: sp.Matrix = field(repr=False)
    _input: sp.Matrix | None = field(repr=False)
    _frequency: tuple[str, sp.Expr] | None = field(repr=False)

    # ------------------------------------------------------------------ free motion
    @cached_property
    def poles(self) -> Complex:
        """Eigenvalues of A, (n,), by rising modulus, the one with positive imaginary part of a pair first."""
        values = np.linalg.eigvals(self.A).astype(complex)
        return values[np.lexsort((-values.imag, np.round(np.abs(values), 12)))]

    @cached_property
    def _modes(self) -> tuple[Complex, Complex]:
        values, vectors = np.linalg.eig(self.A)
        keep = np.nonzero(values.imag > 1e-12 * max(1.0, float(np.abs(values).max(initial=0.0))))[0]
        keep = keep[np.argsort(np.abs(values[keep]))]
        return values[keep], vectors[:, keep]

    @property
    def natural_frequencies(self) -> Array:
        """|lambda| of the oscillating modes, rising (rad per unit time)."""
        return np.abs(self._modes[0])

    @property
    def damping_ratios(self) -> Array:
        """-Re(lambda)/|lambda| of the oscillating modes, in the order of `natural_frequencies`."""
        return -self._modes[0].real / np.abs(self._modes[0])

    @property
    def mode_shapes(self) -> Complex:
        """Coordinates' shapes, (coordinates, modes), the largest component of each mode 1."""
        rows = [self.system.states.index(c) for c in self.system.coordinates]
        shapes = self._modes[1][rows]
        return np.asarray(shapes / shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])])

    # ------------------------------------------------------------------ transfer functions
    def transfer(self, output: str) -> sp.Expr:
        """G(s) of a state or output as a rational function of ``s`` in the parameters (sympy).

        Parameters
        ----------
        output : str
            Name of a state or an output.

        Returns
        -------
        sympy expression
        """
        row, feed = self._output(output)
        name, omega = self._forcing()
        scale = omega.coeff(symbol(name))
        swap = {symbol(name): LAPLACE / (sp.I * scale)}
        n = len(self.system.states)
        assert self._input is not None
        forcing = self._input.subs(swap)
        denominator = (LAPLACE * sp.eye(n) - self._matrix).det(method="berkowitz")
        numerator = (row * (LAPLACE * sp.eye(n) - self._matrix).adjugate() * forcing)[0]
        return sp.cancel(sp.together(numerator / denominator + feed.subs(swap)))

    def latex(self, output: str) -> str:
        """The transfer function in LaTeX, sorted by powers of s."""
        numerator, denominator = sp.fraction(self.transfer(output))
        top, bottom = (sp.collect(sp.expand(e), LAPLACE) for e in (numerator, denominator))
        return f"G_{{{sp.latex(sp.Symbol(output))}}}(s) = {sp.latex(top / bottom)}"

    def frequency_response(self, frequency: npt.ArrayLike, output: str) -> Complex:
        """Complex response Z of an output at values of the system's frequency parameter (direct complex solves).

        Parameters
        ----------
        frequency : float or array (N,)
            Values of the frequency parameter (``Omega``, ``frequency`` in Hz, ...).
        output : str
            Name of a state or an output.

        Returns
        -------
        complex (N,) or scalar
            |Z| is the amplitude; the argument is the phase against cos(w t).
        """
        row, feed = self._output(output)
        name, omega = self._forcing()
        values = np.atleast_1d(np.asarray(frequency, dtype=float))
        if not np.isfinite(values).all():
            raise InputError("the frequencies must be finite")
        assert self._input is not None
        own = {symbol(k): v for k, v in self.system.parameters.items() if k != name}
        w = np.asarray(sp.lambdify(symbol(name), omega.subs(own), "numpy")(values), dtype=float)
        g = _columns(self._input.subs(own), symbol(name), values)
        c = np.array(row.subs(own).tolist(), dtype=complex)[0]
        d = _columns(sp.Matrix([feed.subs(own)]), symbol(name), values)[:, 0]
        matrices = 1j * w[:, None, None] * np.eye(len(self.A)) - self.A
        try:
            out = np.linalg.solve(matrices, g[..., None])[..., 0] @ c + d
        except np.linalg.LinAlgError:
            raise InputError(
                f"an undamped resonance stands at one of the values of '{name}': the response is infinite"
            ) from None
        return out if np.ndim(frequency) else out[0]

    def peaks(self, output: str, prominence: float = 1e-3) -> list[tuple[float, float]]:
        """Local maxima of |G| over the frequency parameter > 0: [(frequency, amplitude), ...], rising frequency.

        The stationary points are the positive real roots of d|N/D|^2/dw, a polynomial: none is missed.

        Parameters
        ----------
        output : str
            Name of a state or an output.
        prominence : float
            A maximum counts if it exceeds the higher of its neighbouring minima by this share.

        Returns
        -------
        list of (float, float)
        """
        name, omega = self._forcing()
        scale = float(omega.coeff(symbol(name)))
        own = {symbol(k): v for k, v in self.system.parameters.items() if k != name}
        numerator, denominator = sp.fraction(sp.together(self.transfer(output).subs(own)))
        top, bottom = (_modulus_squared(sp.Poly(p, LAPLACE)) for p in (numerator, denominator))
        unit = _typical_square(bottom)  # x = w^2 in this unit: SI coefficients span dozens of powers of ten
        top, bottom = (c * unit ** np.arange(len(c) - 1.0, -1, -1) for c in (top, bottom))
        one, two = np.polymul(np.polyder(top), bottom), np.polymul(top, np.polyder(bottom))
        size = np.polyadd(
            np.polymul(np.abs(np.polyder(top)), np.abs(bottom)), np.polymul(np.abs(top), np.abs(np.polyder(bottom)))
        )
        slope: Array = np.polysub(one, two)
        roots = np.roots(np.trim_zeros(np.where(np.abs(slope) < 1e-14 * size, 0.0, slope), "f"))
        squares = np.sort(roots[(np.abs(roots.imag) < 1e-7 * np.abs(roots)) & (roots.real > 0)].real)
        ends = [0.0, 1e8 * (1.0 + (squares.max() if squares.size else 1.0))]
        x = np.concatenate([ends[:1], squares, ends[1:]])
        with np.errstate(divide="ignore"):  # an undamped resonance is infinite
            heights = np.sqrt(np.maximum(np.polyval(top, x) / np.polyval(bottom, x), 0.0))
        found = []
        for k in range(1, len(x) - 1):
            if heights[k] > (1 + prominence) * max(heights[k - 1], heights[k + 1]):
                found.append((float(np.sqrt(x[k] * unit) / scale), float(heights[k])))
        return found

    def periodic(self, coefficients: Mapping[int, complex] | Sequence[complex], frequency: float, output: str) -> Any:
        """Response to a periodic base motion given by its Fourier coefficients, as a function of time.

        Parameters
        ----------
        coefficients : mapping or sequence
            k -> c_k (k = 1, 2, ...; a sequence starts with k = 1) of the excitation sum Re[c_k e^{i k w t}], in units
            of the model's own harmonic excitation.
        frequency : float
            Fundamental value of the frequency parameter.
        output : str
            Name of a state or an output.

        Returns
        -------
        callable
            ``z(t)`` for t scalar or (N,): the steady response, without the static position.
        """
        pairs = coefficients.items() if isinstance(coefficients, Mapping) else enumerate(coefficients, start=1)
        orders = [(int(k), complex(c)) for k, c in pairs]
        if any(k < 1 for k, _ in orders):
            raise InputError("Fourier orders start at 1: a constant base position does nothing")
        name, omega = self._forcing()
        w = float(omega.subs({**{symbol(k): v for k, v in self.system.parameters.items()}, symbol(name): frequency}))
        z = [c * self.frequency_response(k * frequency, output) for k, c in orders]

        def response(time: npt.ArrayLike) -> Array:
            time = np.asarray(time, dtype=float)
            return np.asarray(sum((zk * np.exp(1j * k * w * time)).real for zk, (k, _) in zip(z, orders)))

        return response

    def plot(
        self, output: str | Sequence[str], frequency: npt.ArrayLike, *, kind: str = "magnitude", ax: Any = None
    ) -> Any:
        """Draw |G| (``kind="magnitude"``) or magnitude and phase (``"bode"``, two axes) over the frequency parameter.

        Parameters
        ----------
        output : str or sequence of str
            States or outputs.
        frequency : array (N,)
            Values of the frequency parameter.
        kind : str
            ``"magnitude"`` or ``"bode"``.
        ax : Axes, or pair of Axes for a Bode plot, optional
            Where to draw.

        Returns
        -------
        list of artists
        """
        from ..plots.response import draw_frequency_response

        return draw_frequency_response(self, output, frequency, kind=kind, ax=ax)

    @property
    def frequency_name(self) -> str:
        """The parameter that sets the excitation frequency."""
        return self._forcing()[0]

    def _forcing(self) -> tuple[str, sp.Expr]:
        if self._input is None or self._frequency is None:
            raise InputError(
                f"'{self.system.name}' has no harmonic excitation whose frequency is a parameter: "
                "it has poles and modes, but no frequency response"
            )
        return self._frequency

    def _output(self, name: str) -> tuple[sp.Matrix, sp.Expr]:
        """(row C, feedthrough d1) of a state or output."""
        system = self.system
        states = [symbol(s) for s in system.states]
        if name in system.states:
            return sp.Matrix([[1 if s == name else 0 for s in system.states]]), sp.S.Zero
        if name not in system.outputs:
            raise unknown_name("output", name, [*system.states, *system.outputs], f"'{system.name}'")
        expression = system.outputs[name]
        at = {symbol(s): v for s, v in self.equilibrium.items() if v != 0.0}
        rest = {s: 0 for s in states if s not in at}
        row = [differentiate(expression, s).xreplace(at).xreplace(rest) for s in states]
        if any(e.has(TIME) for e in row):
            raise EquationError(
                f"output '{name}' multiplies states with functions of time: it has no transfer function"
            )
        if not any(row) and expression.free_symbols & set(states):
            raise EquationError(
                f"output '{name}' has no linear part about the equilibrium: it has no transfer function; compute it "
                "from the responses of the states or of another output (a mean power from |current|^2)"
            )
        _, first = harmonic_parts(expression.xreplace(at).xreplace(rest), system)
        return sp.Matrix([row]), first


def _columns(matrix: sp.Matrix, parameter: sp.Symbol, values: Array) -> Complex:
    entries = [
        np.broadcast_to(np.asarray(sp.lambdify(parameter, e, "numpy")(values), complex), values.shape) for e in matrix
    ]
    return np.stack(entries, axis=-1)


def _modulus_squared(polynomial: sp.Poly) -> Array:
    """|p(i w)|^2 as a polynomial in w^2, highest power first."""
    c = np.array([complex(v) for v in polynomial.all_coeffs()])[::-1]
    powers = c * 1j ** np.arange(len(c))
    squared = np.convolve(powers, powers.conj()).real  # in powers of w; odd ones cancel
    return squared[::2][::-1]


def _typical_square(bottom: Array) -> float:
    """Geometric mean of the moduli of the roots of |D|^2 in w^2, the natural frequencies squared."""
    moduli = np.abs(np.roots(bottom))
    moduli = moduli[moduli > 0]
    return float(np.exp(np.log(moduli).mean())) if moduli.size else 1.0


def linear_response(system: System, about: Any = None, **params: float) -> LinearResponse:
    """The linear response of a system about an equilibrium: transfer functions, poles, modes, peaks.

    Parameters
    ----------
    system : System
        Any system of expressions; a forced one needs harmonic excitation for transfer functions.
    about : mapping or array, optional
        Starting value of the equilibrium (states that are missing are zero); found by Newton's method from it.
    **params : float
        Parameter values other than the defaults.

    Returns
    -------
    LinearResponse

    Raises
    ------
    EquationError
        If the linearised equations vary in time (use `chart` or `monodromy`), or the system is a Python function.
    ConvergenceError
        If no equilibrium is found.

    *Accuracy*: transfer functions are exact; numeric responses come from complex solves with the numeric matrix and
    agree with them to rounding. Peaks are roots of a polynomial.

    References
    ----------
    Source chapter, (22)-(25), (36)-(39), figures 4 and 6.

    Examples
    --------
    >>> import stability as st
    >>> response = st.linear_response(st.models.linear_oscillator(xi=0.021))
    >>> response.transfer("u")
    -s**2/(s**2 + 2*s*xi + 1)
    >>> [(round(f, 6), round(a, 4)) for f, a in response.peaks("u")]
    [(1.000441, 23.8148)]
    """
    system = system.with_params(**params)
    if system.rhs is None:
        raise EquationError(f"'{system.name}' is a Python function: transfer functions need expressions")
    states = [symbol(s) for s in system.states]
    parts = [harmonic_parts(e, system) for e in system.rhs]
    mean = sp.Matrix([p[0] for p in parts])
    equilibrium = averaged_equilibrium(system, mean, system.state_vector(about))
    at = {symbol(s): v for s, v in equilibrium.items() if v != 0.0}
    rest = {s: 0 for s in states if s not in at}
    jacobian = sp.Matrix([[differentiate(e, s) for s in states] for e in system.rhs])
    matrix = jacobian.xreplace(at).xreplace(rest)
    if matrix.has(TIME):
        raise EquationError(
            f"'{system.name}' is linear with periodic coefficients about its equilibrium: it has no transfer function; "
            "use chart or monodromy"
        )
    own = {symbol(k): v for k, v in system.parameters.items()}
    numeric = np.array(matrix.subs(own).evalf().tolist(), dtype=float)
    forcing = sp.Matrix([p[1].xreplace(at).xreplace(rest) for p in parts])
    frequency = _frequency_parameter(system)
    forced = frequency is not None and any(e != 0 for e in forcing)
    return LinearResponse(
        system, equilibrium, numeric, matrix, forcing if forced else None, frequency if forced else None
    )


def _frequency_parameter(system: System) -> tuple[str, sp.Expr] | None:
    """(name, w) where w = 2 pi/T is a multiple of one parameter."""
    if system.period_expression is None:
        return None
    omega = sp.simplify(2 * sp.pi / system.period_expression)
    free = sorted(omega.free_symbols, key=str)
    if len(free) != 1 or not (omega / free[0]).is_number:
        return None
    return free[0].name, sp.expand(omega)
