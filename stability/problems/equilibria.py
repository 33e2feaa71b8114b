r"""Equilibria of an autonomous system, f(x, p) = 0, as a continuation problem: dense Newton with exact Jacobians.

Everything is solved in scaled variables y = x / s (scales s_i > 0) with the scaled parameter l = weight lambda:

    [ D^-1 f_x D   D^-1 f_lambda / weight ] [ dy ]     [ -D^-1 f ]
    [ tau^T        sigma                  ] [ dl ]  =  [ rest    ],      D = diag(s),

rows equilibrated before the LU factorisation; the tangent is one more right side. The spectral matrix is the similar
matrix D^-1 f_x D, and the core S is the same matrix, so that variables of 1e-9 and of 1e9 do not spoil the small
singular values from which folds and branch points are located. Default scales follow the solution (`adapt`): first
the modulus at the start or its change over the window, then the largest modulus met; a state that stays zero takes its
scale from the balanced Jacobian, relative to the others.
Stable: all eigenvalues of f_x in the left half plane. Reference: Kuznetsov (2004), 10.1-10.2.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, NonFiniteError
from ..protocols import Corrected, Critical, Seed, Spectrum, Tangent
from ..results.solutions import FixedPoint
from ..words import Kind
from .equilibrium_linearisation import DenseLinearisation, eigenvalue_spectrum, equilibrated_solve
from .orbit_symmetry import Mirror

__all__ = ["Equilibrium"]

Array = NDArray[np.float64]
_CRITICAL = Critical(circle=False, pair=Kind.HOPF, minus=None)
_NO_PHASE = np.zeros(1)
_MAX_NEWTON = 10


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """The fixed points of an autonomous system, f(x, p) = 0.

    Parameters
    ----------
    system : System
        Autonomous (a slow flow of `averaging` is one). A forced system is an InputError: use `Collocation`.
    scales : mapping of state to float, or None
        Typical size of each state, > 0, in the state's units; None follows the solution. Steps and tolerances are
        relative to them.
    evaluations : Evaluator or None
        Where f and its derivatives come from; None compiles the system.

    Notes
    -----
    Newton ends when the update, in scaled variables relative to 1 + |y|, is below the tolerance; convergence being
    quadratic, the error left is its square. Eigenvalues have the estimated error 1e-13 |D^-1 f_x D|.

    Examples
    --------
    >>> import stability as st
    >>> branch = st.continuation(st.Equilibrium(st.models.van_der_pol()), "mu", (-1.0, 1.0))
    >>> branch["HB1"].params["mu"] == 0 or abs(branch["HB1"].params["mu"]) < 1e-10
    True
    """

    system: Any
    scales: Any = None
    evaluations: Any = field(default=None, repr=False)
    following: bool = field(default=True, repr=False)
    fresh: bool = field(default=True, repr=False)
    mirror: Any = field(default=None, repr=False)  # of a family that has lost a symmetry (`orbit_symmetry.Mirror`)

    def __post_init__(self) -> None:
        system = self.system
        if getattr(system, "period_expression", None) is not None:
            raise InputError(
                f"'{system.name}' is forced periodically and has no equilibria; use Collocation({system.name}) for its "
                "periodic orbits, or Equilibrium(averaging(system)) for the slow flow"
            )
        if self.evaluations is None:
            from ..systems.evaluators import evaluator

            object.__setattr__(self, "evaluations", evaluator(system))
        given = self.scales
        if isinstance(given, np.ndarray):
            scales = given
        else:
            if given is not None:
                object.__setattr__(self, "following", False)
                object.__setattr__(self, "fresh", False)
            scales = np.array([float((given or {}).get(name, 1.0)) for name in system.states])
            unknown = set(given or {}) - set(system.states)
            if unknown or not (np.isfinite(scales).all() and (scales > 0).all()):
                names = ", ".join(system.states)
                raise InputError(f"scales {dict(given or {})}: positive numbers by state name are needed ({names})")
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "_index", {name: k for k, name in enumerate(system.parameters)})
        object.__setattr__(self, "_weights", 1.0 / scales**2)
        object.__setattr__(self, "mirror", Mirror.of(self.mirror))

    # ------------------------------------------------------------------ what the driver reads
    @property
    def parameters(self) -> Mapping[str, float]:
        """The system's parameters and defaults."""
        return self.system.parameters  # type: ignore[no-any-return]

    @property
    def critical(self) -> Critical:
        """Real eigenvalues through 0, pairs through the imaginary axis (Hopf)."""
        return _CRITICAL

    @property
    def weights(self) -> Array:
        """(n,) 1 / s^2."""
        return self._weights  # type: ignore[attr-defined, no-any-return]

    @property
    def spec(self) -> Mapping[str, Any]:
        """Plain data; `from_spec` is the inverse."""
        spec: dict[str, Any] = {"problem": "Equilibrium", "scales": self.scales.tolist()}
        spec |= {"following": self.following, "fresh": self.fresh}
        spec["mirror"] = None if self.mirror is None else self.mirror.plain
        if getattr(self.system, "function", None) is not None or not hasattr(self.system, "to_dict"):
            return {**spec, "view_only": True}
        return {**spec, "system": self.system.to_dict()}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> Equilibrium:
        """The problem that `spec` describes."""
        from ..systems.system import System

        flags = {key: bool(spec[key]) for key in ("following", "fresh")}
        mirror = spec.get("mirror")
        return cls(System.from_dict(spec["system"]), np.array(spec["scales"], float), mirror=mirror, **flags)

    def index(self, name: str) -> int:
        """Position of a parameter."""
        return self._index[name]  # type: ignore[attr-defined, no-any-return]

    def seed(self) -> Seed | None:
        """None: an equilibrium branch starts from a solution."""
        return None

    def image_problem(self) -> Equilibrium:
        """The problem whose unknowns are the images S x of this one's, where there is a `mirror`."""
        scales = np.abs(self.mirror.symmetry.matrix) @ self.scales
        return dataclasses.replace(self, scales=scales)

    def image(self, u: Array) -> Array:
        """S u."""
        return np.asarray(self.mirror.symmetry.matrix @ u)

    def linearise(self, u: Array, params: Array) -> DenseLinearisation:
        """f, f_x, f_p at (u, params)."""
        F, J, Fp = self.evaluations.FJP(_NO_PHASE, u[None, :], params)
        return self._linearisation(u, params, F[0], J[0], Fp[0])

    def _linearisation(self, u: Array, params: Array, F: Array, J: Array, Fp: Array) -> DenseLinearisation:
        return DenseLinearisation(self, u, params, F, J, Fp)

    def spectrum(self, linearisation: Any) -> Spectrum:
        """Eigenvalues of the Jacobian; their error is 1e-13 of its norm."""
        return eigenvalue_spectrum(linearisation.spectral, 1e-13)

    def correct(
        self, u: Array, params: Array, free: str, tangent: Tangent | None, ds: float, tolerance: float
    ) -> Corrected:
        """Newton on the bordered system of the module's head (see `protocols.Problem.correct`)."""
        k, n, s = self._index[free], u.size, self.scales  # type: ignore[attr-defined]
        params = params.copy()
        weight = 1.0 if tangent is None else tangent.weight
        K = np.zeros((n + 1, n + 1))
        rhs = np.zeros((n + 1, 2))
        rhs[n, 1] = 1.0
        if tangent is None:
            K[n, n] = 1.0
        else:
            K[n, :n] = tangent.u / s
            K[n, n] = tangent.parameter * weight
            u = u + ds * tangent.u
            params[k] += ds * tangent.parameter
        y0, l0, last = u / s, params[k], math.inf
        row = K[n].copy()
        y = y0
        for iteration in range(1, _MAX_NEWTON + 1):
            F, J, Fp = self.evaluations.FJP(_NO_PHASE, u[None, :], params)
            K[:n, :n] = J[0] * s / s[:, None]
            K[:n, n] = Fp[0, :, k] / (s * weight)
            rhs[:n, 0] = -F[0] / s
            rhs[n, 0] = -(float(row[:n] @ (y - y0)) + row[n] * weight * (params[k] - l0))
            solution = equilibrated_solve(K, rhs)
            step = solution[:, 0]
            size = math.sqrt(float(step @ step))
            if not math.isfinite(size):
                return self._failed(u, params, iteration, F[0], J[0])
            u = u + step[:n] * s
            params[k] += step[n] / weight
            y = u / s
            scale = 1.0 + math.sqrt(float(y @ y))
            if size <= tolerance * scale:
                return self._succeeded(u, params, F[0], J[0], Fp[0], K, solution[:, 1], tangent, iteration)
            if (size > 4 * last and iteration > 2) or size > 1e8 * scale:
                break
            last = size
        return Corrected(u, params, None, math.inf, iteration, 0, None, False, "no convergence")

    def _succeeded(
        self, u: Array, params: Array, F: Array, J: Array, Fp: Array, K: Array, direction: Array,
        tangent: Tangent | None, iterations: int,
    ) -> Corrected:
        n, s = u.size, self.scales
        new: Tangent | None = None
        if tangent is None:
            sign = float(np.linalg.slogdet(K[:n, :n])[0])
            if math.isfinite(float(direction @ direction)):
                new = Tangent(direction[:n] * s, 1.0, 1.0)
        else:
            sign = float(np.linalg.slogdet(K)[0])
            length = math.sqrt(float(direction @ direction))
            if not math.isfinite(length):
                return Corrected(u, params, None, math.inf, iterations, 0, None, False, "singular")
            new = Tangent(direction[:n] * (s / length), float(direction[n]) / (length * tangent.weight), tangent.weight)
        final = self.evaluations.F(_NO_PHASE, u[None, :], params)[0]
        residual = float(np.max(np.abs(final) / (np.abs(J) @ (np.abs(u) + s) + 1e-300)))
        if not math.isfinite(residual):
            return self._failed(u, params, iterations, final, J)
        linearisation = self._linearisation(u, params, F, J, Fp)
        return Corrected(u, params, new, residual, iterations, int(sign), linearisation, True)

    def _failed(self, u: Array, params: Array, iterations: int, F: Array, J: Array) -> Corrected:
        note = "singular"
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            bad = ~(np.isfinite(F) & np.isfinite(J).all(axis=1))
            note = "not finite: equation of " + ", ".join(n for n, b in zip(self.system.states, bad) if b)
        return Corrected(u, params, None, math.inf, iterations, 0, None, False, note)

    # ------------------------------------------------------------------ start, scales, what a user sees
    def start(self, params: Array, guess: Any = None) -> Array:
        """A solution at `params`: Newton from the guess, then implicit pseudo-time steps, then a few random starts.

        Raises
        ------
        InputError
            The guess has the wrong names or shape.
        NonFiniteError
            f is not finite at a guess that was given.
        ConvergenceError
            Nothing converged; give ``start=`` nearer to a solution.
        """
        if isinstance(guess, FixedPoint):
            x = np.array(guess.x)
        else:
            x = np.array(self.system.state_vector(guess), dtype=float)
        F = self.evaluations.F(_NO_PHASE, x[None, :], params)[0]
        if guess is not None and not np.isfinite(F).all():
            bad = [n for n, f in zip(self.system.states, F) if not math.isfinite(f)]
            where = dict(zip(self.system.states, x.tolist()))
            raise NonFiniteError(f"the right-hand side is not finite at the start {where}: equation of {bad}")
        free = next(iter(self.parameters), None)
        problem = self._rescaled(x) if guess is not None and self.fresh else self
        trials = [x]
        if guess is None:
            random = np.random.default_rng(0)
            trials += [random.standard_normal(x.size) * self.scales * 10.0**e for e in (-1, 0, 0, 1, 1)]
        for trial in trials:
            for candidate in (trial, problem._relaxed(trial, params)):
                if candidate is None:
                    continue
                found = problem.correct(candidate, params, free, None, 0.0, 1e-9) if free else None
                if found is not None and found.converged and np.isfinite(found.u).all():
                    return found.u
        if guess is not None and self._is_singular_solution(x, params):
            where = dict(zip(self.system.states, x.tolist()))
            raise ConvergenceError(
                f"start {where} is an equilibrium of '{self.system.name}', but its Jacobian is singular "
                "(a fold or a branch point): begin at another parameter value, a little beside it", last=x,
            )
        origin = "the default start" if guess is None else "start"
        raise ConvergenceError(
            f"no equilibrium of '{self.system.name}' was found from {origin}; give start={{state: value, ...}} nearer "
            "to a solution, for example the end of a simulation",
            last=x,
        )

    def _is_singular_solution(self, x: Array, params: Array) -> bool:
        """Whether f(x) is zero but for rounding, and df/dx has no inverse."""
        F, J = (a[0] for a in self.evaluations.FJ(_NO_PHASE, x[None, :], params))
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            return False
        least = float(np.linalg.svd(J * self.scales / self.scales[:, None], compute_uv=False)[-1])
        sizes = np.abs(J) @ (np.abs(x) + self.scales)
        return bool((np.abs(F) <= 1e-9 * (sizes + 1e-300) + 1e-15).all()) and least < 1e-7

    def _relaxed(self, x: Array, params: Array) -> Array | None:
        """Implicit Euler steps in pseudo-time whose length grows as |f| falls: ends at a stable equilibrium, if any."""
        eye = np.eye(x.size)
        F, J = (a[0] for a in self.evaluations.FJ(_NO_PHASE, x[None, :], params))
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            return None
        size = float(np.max(np.abs(F) / self.scales))
        step = 0.1 / max(float(np.abs(J).max()), size, 1e-300)
        for _ in range(200):
            if size == 0 or step > 1e12:
                break
            try:
                x_new = x + np.linalg.solve(eye / step - J, F)
            except np.linalg.LinAlgError:
                return x
            F_new, J_new = (a[0] for a in self.evaluations.FJ(_NO_PHASE, x_new[None, :], params))
            if not (np.isfinite(F_new).all() and np.isfinite(J_new).all()):
                step *= 0.1
                continue
            new_size = float(np.max(np.abs(F_new) / self.scales))
            step *= min(4.0, max(0.25, 1.5 * size / new_size)) if new_size else 1.0
            x, F, J, size = x_new, F_new, J_new, new_size
        return x

    def _rescaled(self, sizes: Array) -> Equilibrium:
        """Scales equal to these sizes where they are not zero."""
        return dataclasses.replace(self, scales=np.where(sizes > 1e-12, np.abs(sizes), self.scales))

    def adapt(self, u: Array, params: Array, tangent: Tangent) -> tuple[Equilibrium, Array, Tangent] | None:
        """New scales at the first call, and when a state has outgrown its own twice (it is then doubled again)."""
        if not self.following:
            return None
        s = self.scales
        if self.fresh:
            slope = np.abs(tangent.u) / max(abs(tangent.parameter * tangent.weight), 0.1)
            sizes = np.maximum(np.abs(u), 0.1 * slope)
            scales = self._completed(np.where(sizes > 1e-12, sizes, 0.0), self.linearise(u, params).J)
        elif (np.abs(u) <= 2 * s).all():
            return None
        else:
            scales = np.where(np.abs(u) > 2 * s, 2 * np.abs(u), s)
        problem = dataclasses.replace(self, scales=scales, fresh=False)
        length = math.sqrt(float(problem.weights @ tangent.u**2) + (tangent.parameter * tangent.weight) ** 2)
        return problem, u, Tangent(tangent.u / length, tangent.parameter / length, tangent.weight)

    def _completed(self, sizes: Array, J: Array) -> Array:
        """Scales for zero states: |J_ij| s_j / s_i = |J_ji| s_i / s_j with the known ones, else the old scale."""
        known = np.nonzero(sizes > 0)[0]
        magnitude, scales = np.abs(J), np.where(sizes > 0, sizes, self.scales)
        for i in np.nonzero(sizes == 0)[0] if known.size else ():
            both = known[(magnitude[i, known] > 0) & (magnitude[known, i] > 0)]
            if both.size:
                scales[i] = np.max(sizes[both] * np.sqrt(magnitude[i, both] / magnitude[both, i]))
        return scales

    def measures(self, u: Array, params: Array) -> dict[str, float]:
        """``<state>`` for every state, then the system's outputs by name."""
        columns = {name: float(v) for name, v in zip(self.system.states, u)}
        names = tuple(getattr(self.system, "outputs", None) or ())
        if names:
            values = self.evaluations.outputs(_NO_PHASE, u[None, :], params)[0]
            columns.update({name: float(v) for name, v in zip(names, values)})
        return columns

    def error(self, u: Array, params: Array) -> float:
        """Zero but for rounding: there is no discretisation."""
        return 0.0

    def view(self, u: Array, params: Array) -> FixedPoint:
        """The fixed point with its eigenvalues."""
        linearisation = self.linearise(u, params)
        spectrum = self.spectrum(linearisation)
        scale = np.abs(linearisation.J) @ (np.abs(u) + self.scales) + 1e-300
        residual = float(np.max(np.abs(linearisation.F) / scale))
        named = dict(zip(self.parameters, params.tolist()))
        return FixedPoint(self.system.states, u, named, spectrum.values, spectrum.verdict, 0.0, residual)
