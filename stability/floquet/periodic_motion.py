"""Solutions to linearise about: constants, orbits and the linear response, as Fourier sums over the phase.

x*(s) = sum_{|k| <= H} c_k exp(2 pi i k s) for each parameter node, real by c_{-k} = conj(c_k); s = t / T.

Linear response: x_e is the equilibrium of the averaged equations, 0 = mean over s of f(s, x_e, p), found by Newton's
method; the deviation solves y' = J(s) y + g(s) with J = df/dx and g = f at x_e. With the mean A0 of J over s,
c_k = (2 pi i k / T - A0)^-1 g_k is the answer if (J - A0) y = 0 (constant coefficients, or time-dependent ones that
the motion does not meet); else the periodic problem is solved by Fourier collocation, D Y / T - J Y = g.

Shapes: phases (K, N), coefficients (N, 2 H + 1, n) as values at 2 H + 1 equal phases, results (K, N, n).
Reference: L. N. Trefethen, Spectral methods in MATLAB (2000), chapter 3 (Fourier differentiation).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConvergenceError, InputError, NonFiniteError

__all__ = ["Motion", "constant_motion", "linear_response", "orbit_motion"]

Array = NDArray[np.float64]
_SAMPLES = 64


@dataclass(frozen=True, eq=False)
class Motion:
    """A periodic motion per parameter node: Fourier coefficients c_k, k = 0 .. H, (H + 1, N, n) complex."""

    coefficients: NDArray[np.complex128]

    @classmethod
    def from_samples(cls, values: Array) -> Motion:
        """From values (K, N, n) at the phases 0, 1/K, ..., K even; negligible high harmonics are dropped."""
        c = np.fft.rfft(values, axis=0) / len(values)
        c[1:] *= 2.0
        c[-1] *= 0.5
        size = np.abs(c).max(axis=(1, 2))
        keep = max(1, int(np.flatnonzero(size > 2e-15 * max(size.max(), 1e-300)).max(initial=0)) + 1)
        return cls(c[:keep])

    @classmethod
    def stacked(cls, motions: list[Motion]) -> Motion:
        """Motions of single nodes side by side."""
        length = max(len(m.coefficients) for m in motions)
        padded = [np.pad(m.coefficients, ((0, length - len(m.coefficients)), (0, 0), (0, 0))) for m in motions]
        return cls(np.concatenate(padded, axis=1))

    def at(self, phase: Array) -> Array:
        """x*(phase): (K, N, n) for phases (K,) or (K, N)."""
        return self._sum(phase, self.coefficients)

    def rate(self, phase: Array) -> Array:
        """dx*/dphase: (K, N, n)."""
        k = np.arange(len(self.coefficients))[:, None, None]
        return self._sum(phase, 2j * np.pi * k * self.coefficients)

    @staticmethod
    def _sum(phase: Array, c: NDArray[np.complex128]) -> Array:
        if phase.ndim == 1:  # the same phases for all nodes: one matrix product
            harmonics = np.arange(len(c))
            wave = 2.0 * np.pi * phase[:, None] * harmonics
            flat = c.reshape(len(c), -1)
            return (np.cos(wave) @ flat.real - np.sin(wave) @ flat.imag).reshape(len(phase), *c.shape[1:])
        out = np.zeros((*phase.shape, c.shape[2])) + c[0].real
        for k in range(1, len(c)):
            wave = 2.0 * np.pi * k * phase[..., None]
            out += np.cos(wave) * c[k].real - np.sin(wave) * c[k].imag
        return out


def constant_motion(field: Any, guess: Array, P: Array) -> Motion:
    """The constant solution near `guess` (N, n), refined by Newton's method on the mean of f over the phase."""
    return Motion(_equilibrium(field, np.array(guess, dtype=float), P)[None].astype(complex))


def orbit_motion(orbit: Any, period: Array, name: str) -> Motion:
    """A periodic orbit as a Fourier sum; its period must be the forcing period."""
    ratio = float(orbit.period) / period
    if np.abs(ratio - 1.0).max() > 1e-9:
        raise InputError(
            f"the orbit has the period {orbit.period:.9g}, the forcing of '{name}' {period[0]:.9g} here; stability "
            "over the forcing period needs an orbit of that period (give a function of the parameters)"
        )
    samples = 64
    while True:
        values = np.asarray(orbit(np.arange(samples) / samples * orbit.period), dtype=float).T
        spectrum = np.abs(np.fft.rfft(values, axis=0)).max(axis=1)
        if spectrum[-samples // 8 :].max() <= 1e-13 * spectrum.max() or samples >= 1024:
            break
        samples *= 2
    return Motion.from_samples(np.repeat(values[:, None, :], len(period), axis=1))


def linear_response(field: Any, period: Array, P: Array) -> Motion:
    """The periodic solution of the equations linearised about their equilibrium (see the head of this module)."""
    count, n = len(P), field.n
    rest = _equilibrium(field, np.zeros((count, n)), P)
    g, J = _sampled(field, rest, P)
    mean = J.mean(axis=0)
    k = np.fft.rfftfreq(_SAMPLES, 1.0 / _SAMPLES)
    waves = (2j * np.pi * k[:, None] / period)[..., None, None] * np.eye(n)
    forcing = np.fft.rfft(g, axis=0)
    forcing[0] = 0.0
    moving = np.abs(forcing).max(axis=(1, 2)) > 1e-15 * np.abs(forcing).max(initial=0.0)
    response = np.zeros_like(forcing)
    if moving.any():
        response[moving] = np.linalg.solve(waves[moving] - mean, forcing[moving][..., None])[..., 0]
    y = np.fft.irfft(response, _SAMPLES, axis=0)
    leftover = np.abs(np.einsum("knij,knj->kni", J - mean, y)).max(initial=0.0)
    if leftover > 1e-13 * max(np.abs(g).max(initial=0.0), 1e-300):
        y = _collocated(J, g, period)
    return Motion.from_samples(rest + y)


def _sampled(field: Any, states: Array, P: Array) -> tuple[Array, Array]:
    """f (K, N, n) and df/dx (K, N, n, n) at equal phases and constant states (N, n)."""
    phases = np.repeat(np.arange(_SAMPLES) / _SAMPLES, len(P))
    F, J = field.FJ(phases, np.tile(states, (_SAMPLES, 1)), np.tile(P, (_SAMPLES, 1)))
    if not (np.isfinite(F).all() and np.isfinite(J).all()):
        raise NonFiniteError(
            "the equations are not finite at a state on the way to the equilibrium; restrict the range of parameters, "
            "or give about=dict(<state>=<value>) near it"
        )
    return F.reshape(_SAMPLES, *states.shape), J.reshape(_SAMPLES, *states.shape, field.n)


def _equilibrium(field: Any, x: Array, P: Array) -> Array:
    """Zero of the mean of f over the phase, (N, n), by Newton's method; singular directions stay where they are."""
    step = np.zeros_like(x)
    for _ in range(40):
        F, J = _sampled(field, x, P)
        F, J = F.mean(axis=0), J.mean(axis=0)
        scale = np.abs(J).max(axis=(1, 2))[:, None] * (1.0 + np.abs(x).max(axis=1))[:, None]
        if np.all(np.abs(F) <= 1e-15 * scale):
            return x
        step = (np.linalg.pinv(J, rcond=1e-13) @ F[..., None])[..., 0]
        x = x - step
        if not np.isfinite(x).all():
            break
        if np.all(np.abs(step) <= 1e-15 * (1.0 + np.abs(x))):
            return x
    if np.isfinite(x).all() and np.abs(step).max() < 1e-9 * (1.0 + np.abs(x).max()):
        return x
    raise ConvergenceError(
        "no equilibrium was found by Newton's method from this start; give about=dict(<state>=<value>) nearer to it",
        last=x, step=step,
    )  # fmt: skip


def _collocated(J: Array, g: Array, period: Array) -> Array:
    """Periodic solution of y' = J(s) y + g(s) by Fourier collocation at the sample phases: (K, N, n)."""
    count, n = g.shape[1:]
    D = _differentiation(_SAMPLES)
    out = np.empty_like(g)
    for node in range(count):
        matrix = np.kron(D / period[node], np.eye(n)).reshape(_SAMPLES, n, _SAMPLES, n)
        index = np.arange(_SAMPLES)
        matrix[index, :, index, :] -= J[:, node]
        size = _SAMPLES * n
        out[:, node] = np.linalg.solve(matrix.reshape(size, size), g[:, node].ravel()).reshape(_SAMPLES, n)
    return out


def _differentiation(samples: int) -> Array:
    """Fourier differentiation matrix d/ds on `samples` (even) equal phases of period 1."""
    j = np.arange(samples)
    gap = j[:, None] - j
    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.pi * (-1.0) ** gap / np.tan(np.pi * gap / samples)
    values[j, j] = 0.0
    return np.asarray(values)
